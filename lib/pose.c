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
enum { TIME_BLOCK = TW_ARC_BLOCK };

void tw_clip_sample(const tw_clip *clip, uint32_t track, const float *times, size_t time_count, float *out) {
  const tw_track *sampled = &clip->tracks[track];
  float clamped[TIME_BLOCK];
  uint32_t keys[TIME_BLOCK];
  for (size_t done = 0; done < time_count; done += TIME_BLOCK) {
    size_t count = time_count - done < TIME_BLOCK ? time_count - done : TIME_BLOCK;
    tw_timeline_find_all(sampled->timeline, times + done, count, clamped, keys);
    tw_track_sample(sampled, clamped, keys, count, out + done * sampled->width);
  }
}

static void put_at_rest(const tw_node *nodes, uint32_t node_count, tw_trs *locals) {
  for (uint32_t i = 0; i < node_count; i++) locals[i] = nodes[i].rest;
}

/* Asks for the block of arcs from `first` on, a block before it is read: when the clip is larger than the
 * cache, their loads wait side by side, not one behind the other. */
static void prefetch_arcs(const tw_arc_group *group, const uint32_t *found, uint32_t first) {
  for (uint32_t i = first; i < group->track_count && i < first + TW_ARC_BLOCK; i++) {
    __builtin_prefetch(group->arcs + found[i]);
    __builtin_prefetch(&group->arcs[found[i]].rate); /* may lie in another line of the cache */
  }
}

static void pose_group(const tw_arc_group *group, float time, tw_trs *locals) {
  uint32_t found[TW_GROUP_TRACKS];
  const arc_segment *arcs[TW_ARC_BLOCK];
  float angles[TW_ARC_BLOCK], rotations[TW_ARC_BLOCK][4];
  tw_arc_group_find(group, time, found);
  prefetch_arcs(group, found, 0);
  for (uint32_t done = 0; done < group->track_count; done += TW_ARC_BLOCK) {
    uint32_t left = group->track_count - done, count = left < TW_ARC_BLOCK ? left : TW_ARC_BLOCK;
    prefetch_arcs(group, found, done + TW_ARC_BLOCK);
    for (uint32_t i = 0; i < count; i++) {
      arcs[i] = group->arcs + found[done + i];
      angles[i] = arc_angle(group, arcs[i], time);
    }
    tw_arcs_sample(arcs, angles, count, rotations);
    for (uint32_t i = 0; i < count; i++)
      memcpy(locals[group->nodes[done + i]].rotation, rotations[i], sizeof rotations[i]);
  }
}

void tw_clip_pose(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, float time,
                  tw_trs *locals) {
  float clamped = 0, sample[4];
  uint32_t timeline = TW_NO_INDEX, key = 0;
  put_at_rest(nodes, node_count, locals);
  for (const tw_arc_group *group = clip->groups; group; group = group->following)
    pose_group(group, time, locals);
  for (uint32_t i = 0; i < clip->other_count; i++) {
    const tw_track *track = &clip->tracks[clip->others[i]];
    if (track->timeline_index != timeline) {
      timeline = track->timeline_index;
      clamped = timeline_clamp(track->timeline, time);
      key = timeline_find(track->timeline, clamped);
    }
    tw_track_sample(track, &clamped, &key, 1, sample);
    scatter(track->path, sample, 1, node_count, track->node, locals);
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
      tw_timeline_find_all(track->timeline, times, count, clamped, keys);
    }
    tw_track_sample(track, clamped, keys, count, samples);
    scatter(track->path, samples, count, clip->node_count, track->node, locals);
  }
}

/* Fewer times than this are quicker one by one. */
enum { TIMES_FEW = 4 };

void tw_clip_poses(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, const float *times,
                   size_t time_count, tw_trs *locals) {
  if (time_count < TIMES_FEW) {
    for (size_t i = 0; i < time_count; i++, locals += node_count)
      tw_clip_pose(clip, nodes, node_count, times[i], locals);
    return;
  }
  for (size_t done = 0; done < time_count; done += TIME_BLOCK) {
    size_t count = time_count - done < TIME_BLOCK ? time_count - done : TIME_BLOCK;
    for (size_t i = 0; i < count; i++) put_at_rest(nodes, node_count, locals + i * node_count);
    pose_block(clip, times + done, count, locals);
    locals += count * node_count;
  }
}
