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

/* Where a path of node `node` is in each of `count` poses, and what goes there. The sizes are constants: a
 * copy of unknown size would cost more than the sample. */
static void scatter(tw_path path, const float *samples, size_t count, uint32_t node_count, uint32_t node,
                    tw_trs *locals) {
  tw_trs *target = locals + node;
  switch (path) {
  case TW_TRANSLATION:
    for (size_t i = 0; i < count; i++, target += node_count) memcpy(target->translation, samples + 3 * i, 12);
    break;
  case TW_ROTATION:
    for (size_t i = 0; i < count; i++, target += node_count) memcpy(target->rotation, samples + 4 * i, 16);
    break;
  case TW_SCALE:
    for (size_t i = 0; i < count; i++, target += node_count) memcpy(target->scale, samples + 3 * i, 12);
    break;
  case TW_WEIGHTS: break;
  }
}

/* Times are taken this many at once, so that what one track writes stays in cache for the next. */
enum { TIME_BLOCK = 64 };

/* Asks for what a later block of times needs: the numbers of arcs lie in more places than the machine
 * foresees. */
static void prefetch_arcs(const tw_track *track, uint32_t key) {
  enum { KEYS_AHEAD = 64, BUCKETS_A_LINE = 4 };
  const tw_timeline *timeline = track->timeline;
  size_t count = timeline->key_count, ahead = (size_t)key + KEYS_AHEAD;
  if (track->kind != TRACK_ARC || ahead + BUCKETS_A_LINE >= count) return;
  for (size_t i = 0; i < ARC_NUMBERS; i++) __builtin_prefetch(track->segments.arcs + i * count + ahead);
  __builtin_prefetch(timeline->times + ahead);
  __builtin_prefetch(timeline->buckets + ahead);
  __builtin_prefetch(timeline->buckets + ahead + BUCKETS_A_LINE);
}

void tw_clip_sample(const tw_clip *clip, uint32_t track, const float *times, size_t time_count, float *out) {
  const tw_track *sampled = &clip->tracks[track];
  float clamped[TIME_BLOCK];
  uint32_t keys[TIME_BLOCK];
  for (size_t done = 0; done < time_count; done += TIME_BLOCK) {
    size_t count = time_count - done < TIME_BLOCK ? time_count - done : TIME_BLOCK;
    tw_timeline_find_all(sampled->timeline, times + done, count, clamped, keys);
    prefetch_arcs(sampled, keys[count - 1]);
    tw_track_sample(sampled, clamped, keys, count, out + done * sampled->width);
  }
}

/* Tracks that are in no group one by one, each at all times. They stand together where their key times are
 * the same, which are searched once. */
static void pose_tracks(const tw_clip *clip, const float *times, size_t count, tw_trs *locals) {
  float clamped[TIME_BLOCK], samples[4 * TIME_BLOCK];
  uint32_t keys[TIME_BLOCK], timeline = TW_NO_INDEX;
  for (uint32_t i = 0; i < clip->other_count; i++) {
    const tw_track *track = &clip->tracks[clip->others[i]];
    if (track->timeline_index != timeline) {
      timeline = track->timeline_index;
      tw_timeline_find_all(track->timeline, times, count, clamped, keys);
    }
    tw_track_sample(track, clamped, keys, count, samples);
    scatter(track->path, samples, count, clip->node_count, track->node, locals);
  }
}

/* Moves poses that are at rest; at most TIME_BLOCK times. */
static void move(const tw_clip *clip, uint32_t node_count, const float *times, size_t count, tw_trs *locals) {
  for (size_t i = 0; i < count; i++)
    for (const tw_arc_group *group = clip->groups; group; group = group->following)
      tw_arc_group_pose(group, times[i], locals + i * node_count);
  pose_tracks(clip, times, count, locals);
}

void tw_clip_pose(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, float time,
                  tw_trs *locals) {
  for (uint32_t i = 0; i < node_count; i++) locals[i] = nodes[i].rest;
  move(clip, node_count, &time, 1, locals);
}

void tw_clip_poses(const tw_clip *clip, const tw_trs *rest, uint32_t node_count, const float *times,
                   size_t time_count, tw_trs *locals) {
  for (size_t done = 0; done < time_count; done += TIME_BLOCK) {
    size_t count = time_count - done < TIME_BLOCK ? time_count - done : TIME_BLOCK;
    tw_trs *block = locals + done * node_count;
    for (size_t i = 0; rest && i < count && node_count > 0; i++)
      memcpy(block + i * node_count, rest, node_count * sizeof *rest);
    move(clip, node_count, times + done, count, block);
  }
}
