/* Puts arcs into the order of time, takes snapshots along it, and poses by them. */
#include "arc_group.h"

#include <stdlib.h>
#include <string.h>

/* ---- the order of time ------------------------------------------------------------------------------ */

typedef struct group_key {
  uint32_t time; /* the bits, which are ordered as times are: no time is negative */
  uint32_t track;
} group_key;

static void list_keys(const tw_track *tracks, const uint32_t *which, uint32_t count, group_key *keys) {
  for (uint32_t i = 0; i < count; i++) {
    const tw_timeline *timeline = tracks[which[i]].timeline;
    for (uint32_t key = 0; key < timeline->key_count; key++, keys++) {
      float time = timeline->times[key] + 0.0f; /* makes -0 a 0 */
      memcpy(&keys->time, &time, sizeof time);
      keys->track = i;
    }
  }
}

/* Stable: equal times stay in the order of the tracks, a track's keys in their own. */
static void sort_by_byte(const group_key *restrict keys, uint32_t count, int shift, group_key *restrict out) {
  uint32_t places[257] = {0};
  for (uint32_t i = 0; i < count; i++) places[(keys[i].time >> shift & 0xFF) + 1]++;
  for (int i = 0; i < 256; i++) places[i + 1] += places[i];
  for (uint32_t i = 0; i < count; i++) out[places[keys[i].time >> shift & 0xFF]++] = keys[i];
}

/* Radix sort, byte by byte from the lowest. keys: [2][count], the other half is room; both are even in
 * number, so that the result is where the keys were. */
static void sort_keys(group_key *keys, uint32_t count) {
  for (int shift = 0; shift < 32; shift += 16) {
    sort_by_byte(keys, count, shift, keys + count);
    sort_by_byte(keys + count, count, shift + 8, keys);
  }
}

static bool order_arcs(tw_arc_group *group, tw_arena *arena, const tw_track *tracks, const uint32_t *which) {
  uint32_t count = group->arc_count, next_key[TW_GROUP_TRACKS] = {0};
  arc_segment *arcs = tw_arena_alloc(arena, count, sizeof *arcs);
  uint16_t *whose = tw_arena_alloc(arena, count, sizeof *whose);
  group_key *keys = tw_alloc(count, 2 * sizeof *keys);
  if (!arcs || !whose || !keys) {
    free(keys);
    return false;
  }
  list_keys(tracks, which, group->track_count, keys);
  sort_keys(keys, count);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t track = keys[i].track;
    arcs[i] = track_arc(&tracks[which[track]], next_key[track]++);
    whose[i] = (uint16_t)track;
  }
  free(keys);
  group->arcs = arcs;
  group->tracks = whose;
  group->last = arcs[count - 1].start;
  return true;
}

/* ---- snapshots ---------------------------------------------------------------------------------------- */

/* So many arcs at least are between two snapshots, or as many as there are tracks: then all snapshots are of
 * the size of four bytes a key. */
enum { SPACING_LEAST = 16 };

/* Never between arcs that start together: with the times of all tracks equal, a snapshot is the whole answer.
 * Returns how many there are. */
static uint32_t take_snapshots(const tw_arc_group *group, uint32_t spacing, uint32_t *standing,
                               uint32_t *next, float *times) {
  uint32_t at[TW_GROUP_TRACKS], count = 0, width = group->track_count;
  for (uint32_t i = group->arc_count; i-- > 0;) at[group->tracks[i]] = i;
  for (uint32_t i = 0; i < group->arc_count; i++) {
    at[group->tracks[i]] = i;
    bool is_followed = i + 1 < group->arc_count && group->arcs[i + 1].start == group->arcs[i].start;
    if (is_followed || (count > 0 && i - next[count - 1] < spacing)) continue;
    memcpy(standing + (size_t)count * width, at, width * sizeof *at);
    times[count] = group->arcs[i].start;
    next[count++] = i + 1;
  }
  return count;
}

static bool build_snapshots(tw_arc_group *group, tw_arena *arena) {
  uint32_t spacing = group->track_count > SPACING_LEAST ? group->track_count : SPACING_LEAST;
  size_t most = 1 + (size_t)group->arc_count / spacing; /* the first one at any arc, others spaced */
  uint32_t *standing = tw_arena_alloc(arena, most, group->track_count * sizeof *standing);
  uint32_t *next = tw_arena_alloc(arena, most, sizeof *next);
  float *times = tw_alloc(most, sizeof *times);
  bool is_done = false;
  if (standing && next && times) {
    uint32_t count = take_snapshots(group, spacing, standing, next, times);
    group->standing = standing;
    group->next = next;
    is_done = tw_timeline_init(&group->snapshots, arena, times, count);
  }
  free(times);
  return is_done;
}

/* ---- groups ------------------------------------------------------------------------------------------ */

tw_arc_group *tw_arc_group_create(tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                                  uint32_t count) {
  uint32_t most = count < TW_GROUP_TRACKS ? count : TW_GROUP_TRACKS;
  tw_arc_group *group = tw_arena_alloc(arena, 1, sizeof *group);
  uint32_t *nodes = tw_arena_alloc(arena, most, sizeof *nodes);
  if (!group || !nodes) return NULL;
  group->nodes = nodes;
  while (group->track_count < most) {
    const tw_track *track = &tracks[which[group->track_count]];
    if (track->timeline->key_count > UINT32_MAX - group->arc_count) break;
    group->arc_count += track->timeline->key_count;
    nodes[group->track_count++] = track->node;
  }
  return order_arcs(group, arena, tracks, which) && build_snapshots(group, arena) ? group : NULL;
}

/* ---- posing ------------------------------------------------------------------------------------------- */

static uint32_t find_snapshot(const tw_arc_group *group, float time) {
  return timeline_find(&group->snapshots, timeline_clamp(&group->snapshots, time));
}

uint32_t tw_arc_group_between(const tw_arc_group *group, float first, float last) {
  return group->next[find_snapshot(group, last)] - group->next[find_snapshot(group, first)];
}

/* For each track the last arc that starts at or before a time, else its first. */
static void find_arcs(const tw_arc_group *group, float time, uint32_t *found) {
  uint32_t snapshot = find_snapshot(group, time);
  memcpy(found, group->standing + (size_t)snapshot * group->track_count, group->track_count * sizeof *found);
  for (uint32_t i = group->next[snapshot]; i < group->arc_count && group->arcs[i].start <= time; i++)
    found[group->tracks[i]] = i;
}

enum { ARC_BLOCK = 64 };

/* Asks for the block of arcs from `first` on, a block before it is read: when the clip is larger than the
 * cache, their loads wait side by side, not one behind the other. */
static void prefetch_arcs(const tw_arc_group *group, const uint32_t *found, uint32_t first) {
  for (uint32_t i = first; i < group->track_count && i < first + ARC_BLOCK; i++) {
    __builtin_prefetch(group->arcs + found[i]);
    __builtin_prefetch(&group->arcs[found[i]].rate); /* may lie in another line of the cache */
  }
}

void tw_arc_group_pose(const tw_arc_group *group, float time, tw_trs *locals) {
  uint32_t found[TW_GROUP_TRACKS];
  find_arcs(group, time, found);
  prefetch_arcs(group, found, 0);
  if (time > group->last) time = group->last; /* the last arcs stand still, but 0 times infinity is not 0 */
  for (uint32_t done = 0; done < group->track_count; done += ARC_BLOCK) {
    uint32_t left = group->track_count - done, count = left < ARC_BLOCK ? left : ARC_BLOCK;
    prefetch_arcs(group, found, done + ARC_BLOCK);
    tw_arcs_pose(group->arcs, found + done, count, time, group->nodes + done, locals);
  }
}
