/* Puts arcs into the order of time, repeats those that a pose would miss, and poses by them. */
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

/* ---- the order of arcs -------------------------------------------------------------------------------- */

/* An order on its way. */
typedef struct arc_order {
  uint16_t *tracks;            /* [room] whose the arcs are, with ARC_NEXT where they are the next ones */
  size_t room, window, count;  /* of arcs */
  const group_key *next, *end; /* keys whose arcs are to come */
  uint32_t track_count;
  size_t places[TW_GROUP_TRACKS]; /* of each track's newest arc */
} arc_order;

enum { ARC_NEXT = 1 << 15 };

static void put_track(arc_order *order, uint32_t track, uint32_t flag) {
  order->places[track] = order->count;
  order->tracks[order->count++] = (uint16_t)(track | flag);
}

static uint32_t track_at(const arc_order *order, size_t place) {
  return order->tracks[place] % ARC_NEXT;
}

/* All tracks at the time of the first key. Of that time are first keys alone, since a track's ascend. */
static void begin_order(arc_order *order, const group_key *keys, uint32_t key_count, uint32_t window) {
  order->next = keys;
  order->end = keys + key_count;
  order->window = (size_t)window * ARC_BLOCK;
  order->count = 0;
  for (uint32_t i = 0; i < order->track_count; i++) put_track(order, i, 0);
  for (; order->next < order->end && order->next->time == keys->time; order->next++)
    order->tracks[order->next->track] |= ARC_NEXT;
}

static uint32_t blocks_for(uint32_t arc_count) {
  return (arc_count + ARC_BLOCK - 1) / ARC_BLOCK;
}

/* Whether the next keys are of all tracks at one time, and fill enough of their blocks. */
static bool all_meet(const arc_order *order) {
  uint32_t count = order->track_count;
  return 2 * count >= ARC_BLOCK && (size_t)(order->end - order->next) >= count &&
         order->next[0].time == order->next[count - 1].time;
}

/* Puts the arc of the next key; before it one that would leave the window while it goes on, or the last one
 * again, so that blocks are full where all tracks meet. One that leaves with such a one still goes on. */
static void put_next(arc_order *order) {
  uint32_t track = order->next->track;
  bool fills = order->count % ARC_BLOCK != 0 && all_meet(order);
  if (order->count >= order->window) {
    size_t leaving = order->count - order->window;
    uint32_t other = track_at(order, leaving);
    if (order->places[other] == leaving && (other != track || fills)) {
      put_track(order, other, 0);
      return;
    }
  }
  if (fills) {
    put_track(order, track_at(order, order->count - 1), 0);
    return;
  }
  put_track(order, track, ARC_NEXT);
  order->next++;
}

/* False where there is no room. */
static bool put_all(arc_order *order, const group_key *keys, uint32_t key_count, uint32_t window) {
  begin_order(order, keys, key_count, window);
  while (order->next < order->end && order->count < order->room) put_next(order);
  return order->next == order->end;
}

/* What poses cost with a window, up to a factor. A smaller one is read in less time, but the more arcs are
 * repeated for it, the less of them is in a cache; weighed as poses of clips of many sizes were fastest. */
static double cost_of(arc_order *order, const group_key *keys, uint32_t key_count, uint32_t window) {
  order->room = 2 * ((size_t)key_count + order->track_count);
  if (!put_all(order, keys, key_count, window)) return INFINITY;
  return (double)window * sqrt((double)window) * (double)order->count;
}

/* The window that is likely to be best, by the first keys. */
static uint32_t choose_window(arc_order *order, const group_key *keys, uint32_t key_count) {
  enum { STEPS = 8, KEYS_A_TRACK = 32 };
  uint32_t least = blocks_for(order->track_count), best = 2 * least, few = KEYS_A_TRACK * order->track_count;
  if (few > key_count) few = key_count;
  double cost = cost_of(order, keys, few, best);
  for (uint32_t step = STEPS; step-- > 0;) {
    uint32_t less = least + least * step / STEPS;
    if (less == best) continue;
    double other = cost_of(order, keys, few, less);
    if (other >= cost) break;
    best = less;
    cost = other;
  }
  return best;
}

/* Room for so many arcs; what was there is lost. False without memory. */
static bool make_room(arc_order *order, size_t room) {
  free(order->tracks);
  order->tracks = tw_alloc(room, sizeof *order->tracks);
  order->room = room;
  return order->tracks != NULL;
}

/* Puts all arcs into an order; as long as the smaller windows do, at most every other is repeated. So it is
 * with the largest one, twice the tracks, since it sees no track repeated twice; and where tracks meet, no
 * more are put again than came since they last did. False without memory. */
static bool order_arcs(arc_order *order, const group_key *keys, uint32_t key_count, uint32_t track_count,
                       uint32_t *window) {
  size_t twice = 2 * ((size_t)key_count + track_count);
  order->track_count = track_count;
  if (!make_room(order, twice)) return false;
  *window = choose_window(order, keys, key_count);
  order->room = twice;
  if (put_all(order, keys, key_count, *window)) return true;
  *window = 2 * blocks_for(track_count);
  return make_room(order, 2 * twice) && put_all(order, keys, key_count, *window);
}

/* ---- filling blocks ----------------------------------------------------------------------------------- */

/* What arcs of a track are copied from. */
typedef struct arc_source {
  const float *arcs; /* [ARC_NUMBERS][key_count] */
  size_t key_count;
  uint32_t begun; /* arcs so far */
  uint32_t node;
} arc_source;

typedef struct arc_maker {
  arc_block *blocks;
  float first; /* start of all */
  arc_source sources[TW_GROUP_TRACKS];
} arc_maker;

static void list_sources(arc_maker *maker, const tw_track *tracks, const uint32_t *which, uint32_t count) {
  for (uint32_t i = 0; i < count; i++) {
    const tw_track *track = &tracks[which[i]];
    maker->sources[i] = (arc_source){track->segments.arcs, track->timeline->key_count, 0, track->node};
  }
}

/* The arc that a track is on; before its first one it stands there. */
static void put_arc(const arc_maker *maker, const arc_source *source, size_t place) {
  const float *arc = source->arcs + source->begun - (source->begun > 0);
  arc_block *block = maker->blocks + place / ARC_BLOCK;
  size_t lane = place % ARC_BLOCK;
  for (size_t i = 0; i < ARC_NUMBERS; i++, arc += source->key_count) block->numbers[i][lane] = *arc;
  block->nodes[lane] = source->node;
  if (source->begun > 0) return;
  block->numbers[ARC_START][lane] = maker->first;
  block->numbers[ARC_RATE][lane] = 0;
}

/* Blocks in which the first arc that starts later is looked for at some times. Of equal times the last one is
 * kept: so before the next time it is in that block or the first of the block behind it. */
typedef struct frame_list {
  float *times;
  uint32_t *places;
  uint32_t count;
} frame_list;

static void add_frame(frame_list *frames, const group_key *key, size_t place) {
  float time;
  memcpy(&time, &key->time, sizeof time);
  if (frames->count == 0 || frames->times[frames->count - 1] < time) frames->count++;
  frames->times[frames->count - 1] = time;
  frames->places[frames->count - 1] = (uint32_t)(place / ARC_BLOCK);
}

static void fill_blocks(arc_maker *maker, const arc_order *order, const group_key *keys, frame_list *frames) {
  const group_key *key = keys;
  for (size_t place = 0; place < order->count; place++) {
    bool is_next = order->tracks[place] >= ARC_NEXT;
    arc_source *source = &maker->sources[track_at(order, place)];
    source->begun += is_next;
    key += is_next;
    put_arc(maker, source, place);
    size_t count = place + 1;
    if (count < order->track_count) continue;
    if (count % ARC_BLOCK == 0 || count == order->track_count || count == order->count)
      add_frame(frames, key - 1, count);
  }
  for (size_t place = order->count; place == order->count || place % ARC_BLOCK != 0; place++)
    maker->blocks[place / ARC_BLOCK].numbers[ARC_START][place % ARC_BLOCK] = INFINITY;
}

/* In whole lines of the cache, a vector in each. NULL without memory. */
static arc_block *allocate_blocks(tw_arena *arena, size_t count) {
  enum { CACHE_LINE = 64 };
  char *memory = tw_arena_alloc(arena, count + 1, sizeof(arc_block));
  return memory ? (arc_block *)(void *)(memory + -(uintptr_t)memory % CACHE_LINE) : NULL;
}

/* False without memory. */
static bool build_blocks(tw_arc_group *group, tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                         const group_key *keys, const arc_order *order) {
  size_t block_count = order->count / ARC_BLOCK + 1;
  arc_maker maker = {.blocks = allocate_blocks(arena, block_count)};
  frame_list frames = {.times = tw_alloc(block_count + 1, sizeof *frames.times),
                       .places = tw_arena_alloc(arena, block_count + 1, sizeof *frames.places)};
  bool is_done = maker.blocks && frames.times && frames.places;
  if (is_done) {
    memcpy(&maker.first, &keys->time, sizeof maker.first);
    list_sources(&maker, tracks, which, group->track_count);
    fill_blocks(&maker, order, keys, &frames);
    group->block_count = block_count;
    group->blocks = maker.blocks;
    group->places = frames.places;
    is_done = tw_timeline_init(&group->frames, arena, frames.times, frames.count);
  }
  free(frames.times);
  return is_done;
}

static bool build_group(tw_arc_group *group, tw_arena *arena, const tw_track *tracks, const uint32_t *which,
                        uint32_t key_count) {
  group_key *keys = tw_alloc(key_count, 2 * sizeof *keys);
  arc_order order = {0};
  bool is_done = false;
  if (keys) {
    list_keys(tracks, which, group->track_count, keys);
    sort_keys(keys, key_count);
    is_done = order_arcs(&order, keys, key_count, group->track_count, &group->window) &&
              build_blocks(group, arena, tracks, which, keys, &order);
  }
  free(keys);
  free(order.tracks);
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
  return build_group(group, arena, tracks, which, key_count) ? group : NULL;
}

/* ---- posing ------------------------------------------------------------------------------------------- */

void tw_arc_group_pose(const tw_arc_group *group, float time, tw_trs *locals) {
  float clamped = timeline_clamp(&group->frames, time);
  uint32_t frame = timeline_find(&group->frames, clamped);
  tw_arcs_pose(group->blocks, group->window, group->places[frame], clamped, locals);
}
