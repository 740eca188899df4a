/* Puts arcs into the order of time, cuts it into frames, and poses by them. */
#include "arc_group.h"

#include <math.h>
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

/* ---- frames ------------------------------------------------------------------------------------------- */

/* The keys between two frames. */
typedef struct frame_span {
  uint32_t first; /* that is later than the frame */
  uint32_t end;   /* the first one at the time of the next frame, if there is one */
} frame_span;

static uint32_t blocks_for(uint32_t arc_count) {
  return (arc_count + ARC_BLOCK - 1) / ARC_BLOCK;
}

/* Where all tracks meet, so that with equal times a frame is the whole answer, unless a few keys would make
 * it dear; and else when more keys have come than a frame has lanes, but never between keys that meet. So no
 * more than its lanes are in any span. Returns how many frames there are. */
static uint32_t list_spans(const group_key *keys, uint32_t key_count, uint32_t track_count,
                           frame_span *spans) {
  uint32_t count = 0, lanes = blocks_for(track_count) * ARC_BLOCK;
  for (uint32_t i = 0, meeting = 0; i < key_count; i++) {
    if (keys[i].time != keys[meeting].time) meeting = i;
    bool is_followed = i + 1 < key_count && keys[i + 1].time == keys[i].time;
    uint32_t passed = count > 0 ? i + 1 - spans[count - 1].first : UINT32_MAX;
    bool all_meet = i + 1 - meeting == track_count && passed >= ARC_BLOCK;
    if (is_followed || (passed <= lanes && !all_meet)) continue;
    if (count > 0) spans[count - 1].end = meeting;
    spans[count++] = (frame_span){i + 1, key_count};
  }
  return count;
}

/* The frames' times and places; returns the number of blocks, 0 without memory. */
static uint32_t place_frames(tw_arc_group *group, tw_arena *arena, const group_key *keys,
                             const frame_span *spans, uint32_t count) {
  uint32_t *places = tw_arena_alloc(arena, (size_t)count + 1, sizeof *places);
  float *times = tw_alloc(count, sizeof *times);
  bool is_done = places && times;
  for (uint32_t i = 0; is_done && i < count; i++) {
    memcpy(&times[i], &keys[spans[i].first - 1].time, sizeof *times);
    places[i + 1] = places[i] + group->standing_count + blocks_for(spans[i].end - spans[i].first);
  }
  is_done = is_done && tw_timeline_init(&group->frames, arena, times, count);
  free(times);
  group->places = places;
  return is_done ? places[count] : 0;
}

/* What fills the blocks. */
typedef struct frame_maker {
  const tw_track *tracks;
  const uint32_t *which;
  uint32_t begun[TW_GROUP_TRACKS]; /* arcs of each track */
  arc_block *block;                /* next one */
} frame_maker;

static void put_arc(const frame_maker *maker, uint32_t track, uint32_t key, size_t place) {
  const tw_track *source = &maker->tracks[maker->which[track]];
  const float *arc = source->segments.arcs + key;
  arc_block *block = maker->block + place / ARC_BLOCK;
  size_t lane = place % ARC_BLOCK;
  for (size_t i = 0; i < ARC_NUMBERS; i++, arc += source->timeline->key_count) block->numbers[i][lane] = *arc;
  block->nodes[lane] = source->node;
}

/* Where all tracks are. */
static void put_standing(frame_maker *maker, uint32_t track_count) {
  uint32_t blocks = blocks_for(track_count);
  for (uint32_t place = 0; place < blocks * ARC_BLOCK; place++) {
    uint32_t track = place < track_count ? place : track_count - 1, begun = maker->begun[track];
    put_arc(maker, track, begun > 0 ? begun - 1 : 0, place);
  }
  maker->block += blocks;
}

static void put_changes(frame_maker *maker, const group_key *keys, frame_span span) {
  uint32_t count = span.end - span.first, place = 0;
  for (; place < count; place++) {
    uint32_t track = keys[span.first + place].track;
    put_arc(maker, track, maker->begun[track]++, place);
  }
  for (; place % ARC_BLOCK != 0; place++)
    maker->block[place / ARC_BLOCK].numbers[ARC_START][place % ARC_BLOCK] = INFINITY;
  maker->block += blocks_for(count);
}

/* False without memory. */
static bool fill_frames(tw_arc_group *group, tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                        const group_key *keys, const frame_span *spans, uint32_t block_count) {
  enum { CACHE_LINE = 64 };
  frame_maker maker = {.tracks = tracks, .which = which};
  char *memory = tw_arena_alloc(arena, (size_t)block_count + 1, sizeof *maker.block);
  if (!memory) return false;
  memory += -(uintptr_t)memory % CACHE_LINE; /* a vector in each line of the cache */
  group->blocks = maker.block = (arc_block *)(void *)memory;
  for (uint32_t i = 0, key = 0; i < group->frames.key_count; i++) {
    for (; key < spans[i].first; key++) maker.begun[keys[key].track]++;
    put_standing(&maker, group->track_count);
    put_changes(&maker, keys, spans[i]);
    key = spans[i].end;
  }
  return true;
}

static bool build_frames(tw_arc_group *group, tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                         uint32_t key_count) {
  group_key *keys = tw_alloc(key_count, 2 * sizeof *keys);
  frame_span *spans = tw_alloc(1 + (size_t)key_count / ARC_BLOCK, sizeof *spans);
  bool is_done = false;
  if (keys && spans) {
    list_keys(tracks, which, group->track_count, keys);
    sort_keys(keys, key_count);
    memcpy(&group->last, &keys[key_count - 1].time, sizeof group->last);
    uint32_t count = list_spans(keys, key_count, group->track_count, spans);
    uint32_t block_count = place_frames(group, arena, keys, spans, count);
    is_done = block_count > 0 && fill_frames(group, arena, tracks, which, keys, spans, block_count);
  }
  free(keys);
  free(spans);
  return is_done;
}

tw_arc_group *tw_arc_group_create(tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                                  uint32_t count) {
  uint32_t most = count < TW_GROUP_TRACKS ? count : TW_GROUP_TRACKS, key_count = 0;
  tw_arc_group *group = tw_arena_alloc(arena, 1, sizeof *group);
  if (!group) return NULL;
  for (; group->track_count < most; group->track_count++) {
    uint32_t more = tracks[which[group->track_count]].timeline->key_count;
    if (more > UINT32_MAX - key_count) break;
    key_count += more;
  }
  group->standing_count = blocks_for(group->track_count);
  return build_frames(group, arena, tracks, which, key_count) ? group : NULL;
}

/* ---- posing ------------------------------------------------------------------------------------------- */

void tw_arc_group_pose(const tw_arc_group *group, float time, tw_trs *locals) {
  uint32_t frame = timeline_find(&group->frames, timeline_clamp(&group->frames, time));
  const uint32_t *places = group->places + frame;
  if (time > group->last) time = group->last; /* the last arcs stand still, but 0 times infinity is not 0 */
  tw_arcs_pose(group->blocks + places[0], group->standing_count, places[1] - places[0], time, locals);
}
