/* Poses: all tracks of a clip at one time, or at many. */
#include "clip.h"

#include <math.h>
#include <string.h>

float tw_loop_time(float t, float duration, tw_loop loop) {
  if (duration <= 0) return 0;
  double time = (double)t, length = (double)duration;
  switch (loop) {
  case TW_CLAMP: break;
  case TW_REPEAT:
    time = fmod(time, length);
    if (time < 0) time += length;
    if ((float)time >= duration) time = 0; /* a breath before 0 rounds up to the end */
    break;
  case TW_PINGPONG:
    time = fmod(fabs(time), 2 * length);
    if (time > length) time = 2 * length - time;
    break;
  }
  return (float)time;
}

static float *moved_part(tw_trs *trs, tw_path path) {
  switch (path) {
  case TW_TRANSLATION: return trs->translation;
  case TW_ROTATION: return trs->rotation;
  case TW_SCALE: return trs->scale;
  case TW_WEIGHTS: break;
  }
  return NULL;
}

/* Times are taken this many at once, so that what one track writes stays in cache for the next. */
enum { TIME_BLOCK = TW_ARC_BLOCK };

/* Keys at or before each time, times clamped. */
static void find_keys(const tw_timeline *timeline, const float *times, size_t count, float *clamped,
                      uint32_t *keys) {
  uint32_t hint = 0;
  for (size_t i = 0; i < count; i++) {
    clamped[i] = timeline_clamp(timeline, times[i]);
    keys[i] = hint = timeline_find_near(timeline, clamped[i], hint);
  }
}

void tw_clip_sample(const tw_clip *clip, uint32_t track, const float *times, size_t time_count, float *out) {
  const tw_track *sampled = &clip->tracks[track];
  float clamped[TIME_BLOCK];
  uint32_t keys[TIME_BLOCK];
  for (size_t done = 0; done < time_count; done += TIME_BLOCK) {
    size_t count = time_count - done < TIME_BLOCK ? time_count - done : TIME_BLOCK;
    find_keys(sampled->timeline, times + done, count, clamped, keys);
    tw_track_sample(sampled, clamped, keys, count, out + done * sampled->width);
  }
}

static void pose_block(const tw_clip *clip, const float *times, size_t count, tw_trs *locals) {
  float clamped[TIME_BLOCK], samples[4 * TIME_BLOCK];
  uint32_t keys[TIME_BLOCK], timeline = TW_NO_INDEX;
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track *track = &clip->tracks[clip->by_timeline[i]];
    if (track->path == TW_WEIGHTS) continue;
    if (track->timeline_index != timeline) {
      timeline = track->timeline_index;
      find_keys(track->timeline, times, count, clamped, keys);
    }
    tw_track_sample(track, clamped, keys, count, samples);
    for (size_t j = 0; j < count; j++)
      memcpy(moved_part(&locals[j * clip->node_count + track->node], track->path), samples + j * track->width,
             track->width * sizeof *samples);
  }
}

void tw_clip_poses(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, const float *times,
                   size_t time_count, tw_trs *locals) {
  for (size_t i = 0; i < time_count; i++)
    for (uint32_t j = 0; j < node_count; j++) locals[i * node_count + j] = nodes[j].rest;
  for (size_t done = 0; done < time_count; done += TIME_BLOCK) {
    size_t count = time_count - done < TIME_BLOCK ? time_count - done : TIME_BLOCK;
    pose_block(clip, times + done, count, locals + done * node_count);
  }
}

void tw_clip_pose(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, float time,
                  tw_trs *locals) {
  tw_clip_poses(clip, nodes, node_count, &time, 1, locals);
}
