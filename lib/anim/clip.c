/* Clips: checks, merges, compiles and evaluates the tracks of one animation. */
#include "clip.h"

#include <math.h>
#include <string.h>

#include "hash.h"

const char *const tw_path_names[] = {"translation", "rotation", "scale", "weights"};
const char *const tw_interpolation_names[] = {"step", "linear", "cubicspline", "nlerp", "squad", "euler"};

/* ---- checking: error pointers are relative to the clip --------------------------------------- */

/* Larger angles have no precision left. */
static const double ANGLE_MAX = 1e9;

static const char *values_word(tw_key_form form) {
  switch (form) {
  case TW_KEY_VALUES: return "values";
  case TW_KEY_QUATERNION: return "quaternions";
  case TW_KEY_EULER: return "eulers";
  case TW_KEY_AXIS_ANGLE: return "axis_angles";
  }
  return "values";
}

static tw_status check_times(const tw_track_keys *track, uint32_t index, bool may_repeat, tw_error *error) {
  for (uint32_t i = 0; i < track->key_count; i++) {
    float time = track->times[i];
    const char *fault = NULL;
    if (!isfinite(time))
      fault = "is not finite";
    else if (time < 0)
      fault = "is negative";
    else if (!may_repeat && i > 0 && time == track->times[i - 1])
      fault = "is the same as the one before it";
    else if (i > 0 && time < track->times[i - 1])
      fault = "is before the one before it";
    if (!fault) continue;
    tw_fail(error, TW_INVALID, "key time %u (%g) %s", i, (double)time, fault);
    return tw_error_at(error, "/tracks/%u/times/%u", index, i);
  }
  return TW_OK;
}

static tw_status check_values(const tw_track_keys *track, uint32_t index, tw_error *error) {
  bool cubic = track->interpolation == TW_CUBICSPLINE;
  size_t per_key =
      track->angles ? (track->form == TW_KEY_EULER ? 3 : 4) : (size_t)track->width * (cubic ? 3 : 1);
  size_t count = track->key_count * per_key;
  for (size_t i = 0; i < count; i++) {
    bool bad = track->angles ? !(fabs(track->angles[i]) <= ANGLE_MAX) : !isfinite(track->values[i]);
    if (!bad) continue;
    tw_fail(error, TW_INVALID, "key %zu has a number that is not finite%s", i / per_key,
            track->angles ? " or an angle beyond 1e9 radians" : "");
    return tw_error_at(error, "/tracks/%u/%s/%zu", index, values_word(track->form), i / per_key);
  }
  return TW_OK;
}

/* Requires a quaternion other than 0, or an axis. */
static tw_status check_rotations(const tw_track_keys *track, uint32_t index, tw_error *error) {
  if (track->path != TW_ROTATION || track->form == TW_KEY_EULER) return TW_OK;
  bool is_cubic = track->interpolation == TW_CUBICSPLINE, has_axis = track->form == TW_KEY_AXIS_ANGLE;
  for (uint32_t i = 0; i < track->key_count; i++) {
    double source[4] = {0, 0, 0, 0};
    if (has_axis)
      memcpy(source, track->angles + 4 * (size_t)i, 3 * sizeof *source);
    else
      quat_widen(track->values + 4 * (is_cubic ? 3 * (size_t)i + 1 : (size_t)i), source);
    if (tw_length(source, 4) > 0) continue;
    tw_fail(error, TW_INVALID, "key %u %s", i, has_axis ? "has no axis" : "is a zero quaternion");
    return tw_error_at(error, "/tracks/%u/%s/%u", index, values_word(track->form), i);
  }
  return TW_OK;
}

/* The width that a track's path and form require; 0: any. */
static uint32_t expected_width(const tw_track_keys *track) {
  switch (track->path) {
  case TW_TRANSLATION:
  case TW_SCALE: return 3;
  case TW_ROTATION: return track->form == TW_KEY_EULER ? 3 : 4;
  case TW_WEIGHTS: break;
  }
  return 0;
}

static bool has_interpolation(const tw_track_keys *track) {
  switch (track->interpolation) {
  case TW_STEP:
  case TW_LINEAR: return true;
  case TW_CUBICSPLINE: return !track->angles;
  case TW_NLERP:
  case TW_SQUAD: return track->path == TW_ROTATION;
  case TW_EULER: return track->path == TW_ROTATION && track->form == TW_KEY_EULER;
  }
  return false;
}

static tw_status refuse(tw_error *error, uint32_t index, const char *member) {
  return tw_error_at(error, "/tracks/%u/%s", index, member);
}

static tw_status check_shape(const tw_track_keys *track, uint32_t index, uint32_t node_count, int force,
                             tw_error *error) {
  bool angular = track->form == TW_KEY_EULER || track->form == TW_KEY_AXIS_ANGLE;
  uint32_t width = expected_width(track);
  if (track->node >= node_count) {
    tw_fail(error, TW_INVALID, "track %u moves node %u, but there %s %u %s", index, track->node,
            tw_plural(node_count, "is", "are"), node_count, tw_plural(node_count, "node", "nodes"));
    return refuse(error, index, "node");
  }
  if (track->key_count == 0) {
    tw_fail(error, TW_INVALID, "track %u has no keys", index);
    return refuse(error, index, "times");
  }
  if (angular ? track->path != TW_ROTATION || !track->angles : track->angles || !track->values) {
    tw_fail(error, TW_INVALID, "a %s track cannot have keys in this form", tw_path_names[track->path]);
    return refuse(error, index, values_word(track->form));
  }
  if (track->width == 0 || (width != 0 && track->width != width)) {
    tw_fail(error, TW_INVALID, "a %s track cannot have keys of %u %s", tw_path_names[track->path],
            track->width, tw_plural(track->width, "number", "numbers"));
    return refuse(error, index, values_word(track->form));
  }
  if (!has_interpolation(track)) {
    tw_fail(error, TW_INVALID, "interpolation %s does not go with the keys of this %s track",
            tw_interpolation_names[track->interpolation], tw_path_names[track->path]);
    return refuse(error, index, "interpolation");
  }
  if (force == TW_CUBICSPLINE && track->path == TW_ROTATION && track->interpolation != TW_CUBICSPLINE) {
    tw_fail(error, TW_INVALID, "track %u has no tangents to interpolate as cubicspline", index);
    return refuse(error, index, "interpolation");
  }
  return TW_OK;
}

/* The node and path that a track moves. */
typedef struct moved {
  uint64_t what; /* node << 2 | path */
  uint32_t track;
} moved;

static int compare_moved(const void *a, const void *b) {
  const moved *left = a, *right = b;
  if (left->what != right->what) return left->what < right->what ? -1 : 1;
  return left->track < right->track ? -1 : left->track > right->track;
}

/* *track: the first track that moves what an earlier one moves; track_count where there is none. Sorts,
 * because a clip may have few tracks and a model many nodes. */
static tw_status find_repeated(const tw_clip_keys *keys, uint32_t *track, tw_error *error) {
  moved *all = tw_alloc(keys->track_count, sizeof *all);
  if (!all) return tw_fail(error, TW_NO_MEMORY, "no memory to check a clip");
  for (uint32_t i = 0; i < keys->track_count; i++)
    all[i] = (moved){(uint64_t)keys->tracks[i].node << 2 | (uint64_t)keys->tracks[i].path, i};
  tw_status status = tw_sort(all, keys->track_count, sizeof *all, compare_moved);
  *track = keys->track_count;
  for (uint32_t i = 1; status == TW_OK && i < keys->track_count; i++)
    if (all[i].what == all[i - 1].what && all[i].track < *track) *track = all[i].track;
  tw_free(all);
  return status == TW_OK ? TW_OK : tw_fail(error, status, "the tracks of a clip cannot be sorted");
}

tw_status tw_clip_check(const tw_clip_keys *keys, uint32_t node_count, int force, bool may_repeat,
                        tw_error *error) {
  uint32_t repeated = TW_NO_INDEX;
  tw_status status = find_repeated(keys, &repeated, error);
  for (uint32_t i = 0; i < keys->track_count && status == TW_OK; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    status = check_shape(track, i, node_count, force, error);
    if (status == TW_OK) status = check_times(track, i, may_repeat, error);
    if (status == TW_OK) status = check_values(track, i, error);
    if (status == TW_OK) status = check_rotations(track, i, error);
    if (status != TW_OK || i != repeated) continue;
    tw_fail(error, TW_INVALID, "two tracks move the %s of node %u", tw_path_names[track->path], track->node);
    status = refuse(error, i, "path");
  }
  return status;
}

bool tw_keys_fit_gltf(const tw_track_keys *track) {
  static const double UNIT_ROOM = 0.005;
  if (track->interpolation == TW_LINEAR) return track->form != TW_KEY_AXIS_ANGLE;
  if (track->interpolation != TW_CUBICSPLINE) return track->interpolation == TW_STEP;
  for (uint32_t i = 0; track->path == TW_ROTATION && i < track->key_count; i++) {
    double key[4];
    quat_widen(track->values + 4 * (3 * (size_t)i + 1), key);
    if (fabs(tw_length(key, 4) - 1) > UNIT_ROOM) return false;
  }
  return true;
}

/* ---- keys at one time ------------------------------------------------------------------------ */

static uint32_t count_duplicates(const tw_track_keys *track) {
  uint32_t count = 0;
  for (uint32_t i = 1; i < track->key_count; i++) count += track->times[i] == track->times[i - 1];
  return count;
}

/* Fills times and kept, the keys that stay; returns their count. */
static uint32_t keep_keys(const tw_track_keys *track, float *times, uint32_t *kept) {
  uint32_t count = 0, end = track->key_count;
  for (uint32_t i = 0; i < end; i++) {
    bool is_first = i == 0 || track->times[i] > track->times[i - 1];
    bool is_last = i + 1 == end || track->times[i + 1] > track->times[i];
    float time = is_last ? track->times[i] : nextafterf(track->times[i], -1);
    bool fits = time >= 0 && (count == 0 || time > times[count - 1]);
    if (!is_last && !(is_first && fits)) continue;
    times[count] = time;
    kept[count++] = i;
  }
  return count;
}

/* The kept rows of an array; NULL for NULL and without memory. */
static void *keep_rows(tw_arena *arena, const void *rows, size_t row_size, const uint32_t *kept,
                       uint32_t count) {
  char *out = rows ? tw_arena_alloc_raw(arena, count, row_size) : NULL;
  for (uint32_t i = 0; out && i < count; i++)
    memcpy(out + i * row_size, (const char *)rows + kept[i] * row_size, row_size);
  return out;
}

static tw_status separate_track(tw_track_keys *track, tw_arena *arena, tw_error *error) {
  uint32_t *kept = tw_alloc(track->key_count, sizeof *kept);
  float *times = kept ? tw_arena_alloc_raw(arena, track->key_count, sizeof *times) : NULL;
  tw_status status = times ? TW_OK : tw_fail(error, TW_NO_MEMORY, "no memory for keys at one time");
  if (status == TW_OK) {
    tw_track_keys out = *track;
    size_t parts = track->interpolation == TW_CUBICSPLINE ? 3 : 1;
    out.key_count = keep_keys(track, times, kept);
    out.times = times;
    out.values = keep_rows(arena, track->values, parts * track->width * sizeof(float), kept, out.key_count);
    out.angles = keep_rows(arena, track->angles, track->width * sizeof(double), kept, out.key_count);
    if ((track->values && !out.values) || (track->angles && !out.angles))
      status = tw_fail(error, TW_NO_MEMORY, "no memory for keys at one time");
    else
      *track = out;
  }
  tw_free(kept);
  return status;
}

tw_status tw_clip_separate(tw_clip_keys *clip, tw_arena *arena, tw_error *error) {
  tw_track_keys *tracks = NULL;
  for (uint32_t i = 0; i < clip->track_count; i++) {
    uint32_t duplicates = count_duplicates(&clip->tracks[i]);
    if (duplicates == 0) continue;
    if (!tracks) {
      tracks = tw_arena_alloc_raw(arena, clip->track_count, sizeof *tracks);
      if (!tracks) return tw_fail(error, TW_NO_MEMORY, "no memory for keys at one time");
      memcpy(tracks, clip->tracks, clip->track_count * sizeof *tracks);
      clip->tracks = tracks;
    }
    tracks[i].duplicate_times = duplicates;
    tw_status status = separate_track(&tracks[i], arena, error);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

/* ---- merging --------------------------------------------------------------------------------- */

enum { PATHS = TW_WEIGHTS + 1 };

static size_t place_moved(const tw_track_keys *track) {
  return (size_t)track->node * PATHS + (size_t)track->path;
}

/* Walks the clips from the last to the first: the first track found for a node's path stays. Fills `tracks`
 * from its end backwards. Returns how many tracks stay. */
static uint32_t keep_last(const tw_clip_keys *clips, uint32_t clip_count, uint32_t track_count,
                          bool *is_moved, tw_track_keys *tracks) {
  uint32_t first = track_count;
  for (uint32_t clip = clip_count; clip-- > 0;)
    for (uint32_t i = clips[clip].track_count; i-- > 0;) {
      const tw_track_keys *track = &clips[clip].tracks[i];
      bool *moved = &is_moved[place_moved(track)];
      if (!*moved) tracks[--first] = *track;
      *moved = true;
    }
  return track_count - first;
}

tw_status tw_clip_merge(const tw_clip_keys *clips, uint32_t clip_count, uint32_t node_count, tw_arena *arena,
                        tw_clip_keys *out, tw_error *error) {
  uint64_t all = 0;
  for (uint32_t i = 0; i < clip_count; i++) all += clips[i].track_count;
  tw_track_keys *tracks = all < UINT32_MAX ? tw_arena_alloc_raw(arena, (size_t)all, sizeof *tracks) : NULL;
  bool *is_moved = tw_alloc_zero(node_count, PATHS * sizeof *is_moved);
  if (!tracks || !is_moved) {
    tw_free(is_moved);
    return tw_fail(error, TW_NO_MEMORY, "no memory to merge clips");
  }
  uint32_t count = keep_last(clips, clip_count, (uint32_t)all, is_moved, tracks);
  tw_free(is_moved);
  *out = (tw_clip_keys){.track_count = count, .tracks = tracks + (all - count)};
  return TW_OK;
}

/* ---- compiling ------------------------------------------------------------------------------- */

/* Exporters give the joints of a skeleton the same key times, so tracks with equal times share one timeline
 * and one search. A small table holds the last timeline of each hash. A timeline evicted from it is no longer
 * shared, which is harmless. */
enum { RECENT_TIMELINES = 64 };

static uint64_t hash_times(const float *times, uint32_t count) {
  uint64_t hash = TW_HASH_BEGIN;
  for (uint32_t i = 0; i < count; i++) {
    uint32_t bits;
    memcpy(&bits, &times[i], sizeof bits);
    hash = tw_hash_add(hash, bits);
  }
  return tw_hash_end(hash);
}

static tw_status build_timelines(tw_clip *clip, const tw_clip_keys *keys, tw_error *error) {
  uint32_t recent[RECENT_TIMELINES];
  memset(recent, 0xFF, sizeof recent);
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    uint32_t *slot = &recent[hash_times(track->times, track->key_count) % RECENT_TIMELINES];
    const tw_timeline *found = *slot == TW_NO_INDEX ? NULL : &clip->timelines[*slot];
    if (!found || found->key_count != track->key_count ||
        memcmp(found->times, track->times, track->key_count * sizeof *track->times) != 0) {
      *slot = clip->timeline_count++;
      if (!tw_timeline_init(&clip->timelines[*slot], clip->arena, track->times, track->key_count))
        return tw_fail(error, TW_NO_MEMORY, "no memory for key times");
    }
    clip->tracks[i].timeline_index = *slot;
  }
  return TW_OK;
}

static tw_status build_tracks(tw_clip *clip, const tw_clip_keys *keys, int force, tw_error *error) {
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *source = &keys->tracks[i];
    tw_track *track = &clip->tracks[i];
    bool forced = force >= 0 && source->path == TW_ROTATION;
    tw_interpolation interpolation = forced ? (tw_interpolation)force : source->interpolation;
    const tw_timeline *timeline = &clip->timelines[track->timeline_index];
    tw_status status = tw_track_build(track, clip->arena, source, interpolation, forced, timeline, error);
    if (status != TW_OK) {
      char inner[sizeof error->pointer];
      if (error) {
        memcpy(inner, error->pointer, sizeof inner);
        tw_error_at(error, "/tracks/%u%s", i, inner);
      }
      return status;
    }
    clip->moves[source->node] |= (uint8_t)(1u << source->path);
  }
  return TW_OK;
}

/* Turns counts of elements by block, of which counts[b + 1] is block b's, into the first index of each. */
static void sum_blocks(uint32_t *counts, uint32_t block_count) {
  for (uint32_t b = 0; b < block_count; b++) counts[b + 1] += counts[b];
}

/* Copies what a pose reads of arc tracks, and lists the other tracks that move transforms; both by block of
 * nodes, in the source's order within a block. */
static tw_status sort_tracks(tw_clip *clip, tw_error *error) {
  uint32_t block_count = clip->node_count / TW_POSE_BLOCK + 1;
  clip->arc_blocks = tw_arena_alloc(clip->arena, (size_t)block_count + 1, sizeof *clip->arc_blocks);
  clip->other_blocks = tw_arena_alloc(clip->arena, (size_t)block_count + 1, sizeof *clip->other_blocks);
  uint32_t *next = tw_alloc_zero(block_count, 2 * sizeof *next);
  bool has_room = clip->arc_blocks && clip->other_blocks && next;
  for (uint32_t i = 0; has_room && i < clip->track_count; i++) {
    const tw_track *track = &clip->tracks[i];
    uint32_t block = track->node / TW_POSE_BLOCK;
    if (track->kind == TRACK_ARC)
      clip->arc_blocks[block + 1]++;
    else if (track->path != TW_WEIGHTS)
      clip->other_blocks[block + 1]++;
  }
  if (has_room) {
    sum_blocks(clip->arc_blocks, block_count);
    sum_blocks(clip->other_blocks, block_count);
    clip->arcs = tw_arena_alloc(clip->arena, clip->arc_blocks[block_count], sizeof *clip->arcs);
    has_room = clip->arcs != NULL;
  }
  for (uint32_t i = 0; has_room && i < clip->track_count; i++) {
    const tw_track *track = &clip->tracks[i];
    size_t block = track->node / TW_POSE_BLOCK;
    if (track->kind == TRACK_ARC)
      clip->arcs[clip->arc_blocks[block] + next[2 * block]++] =
          (posed_arc){*track->timeline, track->segments.arcs, track->node};
    else if (track->path != TW_WEIGHTS)
      clip->others[clip->other_blocks[block] + next[2 * block + 1]++] = i;
  }
  tw_free(next);
  return has_room ? TW_OK : tw_fail(error, TW_NO_MEMORY, "no memory for a clip");
}

static tw_clip *clip_alloc(const tw_clip_keys *keys, uint32_t node_count) {
  tw_arena *arena = tw_arena_create();
  tw_clip *clip = arena ? tw_arena_alloc(arena, 1, sizeof *clip) : NULL;
  if (!clip) {
    tw_arena_destroy(arena);
    return NULL;
  }
  *clip = (tw_clip){.arena = arena,
                    .node_count = node_count,
                    .track_count = keys->track_count,
                    .duration = tw_keys_duration(keys),
                    .cost = 1,
                    .leaves = 1};
  clip->tracks = tw_arena_alloc(arena, keys->track_count, sizeof *clip->tracks);
  clip->timelines = tw_arena_alloc(arena, keys->track_count, sizeof *clip->timelines);
  clip->others = tw_arena_alloc(arena, keys->track_count, sizeof *clip->others);
  clip->moves = tw_arena_alloc(arena, node_count, sizeof *clip->moves);
  if (clip->tracks && clip->timelines && clip->others && clip->moves) return clip;
  tw_arena_destroy(arena);
  return NULL;
}

tw_status tw_clip_create(const tw_clip_keys *keys, uint32_t node_count, int force, tw_clip **out,
                         tw_error *error) {
  tw_status status = tw_clip_check(keys, node_count, force, false, error);
  if (status != TW_OK) return status;
  tw_clip *clip = clip_alloc(keys, node_count);
  if (!clip) return tw_fail(error, TW_NO_MEMORY, "no memory for a clip");
  status = build_timelines(clip, keys, error);
  if (status == TW_OK) status = build_tracks(clip, keys, force, error);
  if (status == TW_OK) status = sort_tracks(clip, error);
  if (status == TW_OK)
    *out = clip;
  else
    tw_clip_destroy(clip);
  return status;
}

void tw_clip_destroy(tw_clip *clip) {
  if (!clip) return;
  for (uint32_t i = 0; i < clip->part_count; i++) tw_clip_destroy(clip->parts[i]);
  tw_arena_destroy(clip->arena);
}

float tw_clip_duration(const tw_clip *clip) {
  return clip->duration;
}

float tw_keys_duration(const tw_clip_keys *keys) {
  float duration = keys->layer_count > 0 ? fmaxf(keys->mixed_duration, 0) : 0;
  for (uint32_t i = 0; i < keys->track_count; i++) {
    const tw_track_keys *track = &keys->tracks[i];
    float last = track->key_count ? track->times[track->key_count - 1] : 0;
    if (last > duration) duration = last;
  }
  return duration;
}

size_t tw_clip_size(const tw_clip *clip) {
  size_t size = tw_arena_size(clip->arena);
  for (uint32_t i = 0; i < clip->part_count; i++) size += tw_clip_size(clip->parts[i]);
  return size;
}

bool tw_clip_moves(const tw_clip *clip, uint32_t node) {
  return (clip->moves[node] & ~(1u << TW_WEIGHTS)) != 0;
}

uint32_t tw_clip_find(const tw_clip *clip, uint32_t node, tw_path path) {
  if (!(clip->moves[node] & 1u << path)) return TW_NO_INDEX;
  uint32_t i = 0;
  while (clip->tracks[i].node != node || clip->tracks[i].path != path) i++;
  return i;
}

uint32_t tw_clip_width(const tw_clip *clip, uint32_t track) {
  return clip->tracks[track].width;
}

uint32_t tw_clip_cost(const tw_clip *clip) {
  return clip->leaves;
}

uint32_t tw_clip_track_count(const tw_clip *clip) {
  return clip->track_count;
}

uint32_t tw_clip_target(const tw_clip *clip, uint32_t track, tw_path *path) {
  *path = clip->tracks[track].path;
  return clip->tracks[track].node;
}

/* ---- evaluating ------------------------------------------------------------------------------ */

float tw_loop_time(double t, double duration, tw_loop loop) {
  if (duration <= 0) return 0;
  switch (loop) {
  case TW_CLAMP: break;
  case TW_REPEAT:
    t = fmod(t, duration);
    if (t < 0) t += duration;
    if ((float)t >= (float)duration) t = 0; /* what rounding puts just before the end */
    break;
  case TW_PINGPONG:
    t = fmod(fabs(t), 2 * duration);
    if (t > duration) t = 2 * duration - t;
    break;
  }
  return (float)t;
}

/* The floats of a transform that a path moves. */
static float *place_of(tw_trs *trs, tw_path path) {
  return path == TW_TRANSLATION ? trs->translation : path == TW_SCALE ? trs->scale : trs->rotation;
}

void tw_clip_sample(const tw_clip *clip, uint32_t track, const float *times, size_t time_count, float *out) {
  if (clip->kind) {
    clip->kind->sample(clip, track, times, time_count, out);
    return;
  }
  const tw_track *sampled = &clip->tracks[track];
  float clamped[TW_TRACK_BATCH];
  uint32_t keys[TW_TRACK_BATCH];
  for (size_t done = 0; done < time_count; done += TW_TRACK_BATCH) {
    size_t count = time_count - done < TW_TRACK_BATCH ? time_count - done : TW_TRACK_BATCH;
    tw_timeline_find(sampled->timeline, times + done, count, clamped, keys);
    tw_track_sample(sampled, clamped, keys, count, out + done * sampled->width,
                    sampled->width * sizeof(float));
  }
}

/* Evaluates the arcs of a batch of tracks together. Tracks lie far apart in memory, so each pass prefetches
 * what the next one reads: the cache misses of a batch overlap. */
static void pose_arcs(const tw_clip *clip, uint32_t first, uint32_t end, float time, tw_trs *locals,
                      uint32_t first_node) {
  const tw_arc_segment *arcs[TW_TRACK_BATCH];
  float clamped[TW_TRACK_BATCH], *out[TW_TRACK_BATCH];
  uint32_t keys[TW_TRACK_BATCH];
  for (uint32_t done = first, count; done < end; done += count) {
    const posed_arc *tracks = clip->arcs + done;
    count = end - done < TW_TRACK_BATCH ? end - done : TW_TRACK_BATCH;
    for (uint32_t i = 0; i < count; i++) {
      clamped[i] = timeline_clamp(&tracks[i].timeline, time);
      keys[i] = timeline_bucket(&tracks[i].timeline, clamped[i]);
      __builtin_prefetch(tracks[i].timeline.buckets + keys[i]);
    }
    for (uint32_t i = 0; i < count; i++) {
      arcs[i] = tracks[i].arcs + timeline_find_in(&tracks[i].timeline, clamped[i], keys[i]);
      __builtin_prefetch(arcs[i]);
      __builtin_prefetch(&arcs[i]->rate); /* half of the arcs straddle two cache lines */
      out[i] = locals[tracks[i].node - first_node].rotation;
    }
    tw_arcs_sample(arcs, clamped, count, out);
  }
}

/* Evaluates the other tracks one by one. Neighbours usually share a timeline, which is then searched once. */
static void pose_others(const tw_clip *clip, uint32_t first, uint32_t end, float time, tw_trs *locals,
                        uint32_t first_node) {
  const tw_timeline *timeline = NULL;
  float clamped;
  uint32_t key;
  for (uint32_t i = first; i < end; i++) {
    const tw_track *track = &clip->tracks[clip->others[i]];
    if (track->timeline != timeline) tw_timeline_find(track->timeline, &time, 1, &clamped, &key);
    timeline = track->timeline;
    tw_track_sample(track, &clamped, &key, 1, place_of(&locals[track->node - first_node], track->path), 0);
  }
}

void tw_clip_pose_nodes(const tw_clip *clip, const tw_node *nodes, uint32_t first, uint32_t count, float time,
                        tw_trs *locals) {
  for (uint32_t i = 0; !clip->kind && i < count; i++) locals[i] = nodes[first + i].rest;
  tw_clip_move_nodes(clip, nodes, first, count, time, locals);
}

void tw_clip_move_nodes(const tw_clip *clip, const tw_node *nodes, uint32_t first, uint32_t count, float time,
                        tw_trs *locals) {
  if (clip->kind) {
    clip->kind->pose(clip, nodes, first, count, time, locals);
    return;
  }
  uint32_t from = first / TW_POSE_BLOCK, to = (first + count + TW_POSE_BLOCK - 1) / TW_POSE_BLOCK;
  pose_arcs(clip, clip->arc_blocks[from], clip->arc_blocks[to], time, locals, first);
  pose_others(clip, clip->other_blocks[from], clip->other_blocks[to], time, locals, first);
}

void tw_clip_pose(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, float time,
                  tw_trs *locals) {
  tw_clip_pose_nodes(clip, nodes, 0, node_count, time, locals);
}

/* ---- bends ----------------------------------------------------------------------------------- */

/* Pieces of a segment of a rotation track that turn by less than half a turn each. */
static double count_pieces(const tw_track *track, uint32_t key) {
  static const double PIECE = 1;
  bool turns = track->path == TW_ROTATION && !track->holds;
  return turns ? fmax(1, ceil(tw_track_travel(track, key) / PIECE)) : 1;
}

bool tw_clip_bends(const tw_clip *clip, uint32_t index, const tw_bend_sink *sink) {
  if (clip->kind) return clip->kind->bends(clip, index, sink);
  const tw_track *track = &clip->tracks[index];
  const float *times = track->timeline->times;
  for (uint32_t key = 0; key < track->timeline->key_count; key++) {
    double time = (double)times[key], pieces = count_pieces(track, key),
           seconds = tw_track_seconds(track, key);
    if (track->holds && key > 0 && !bend_put(sink, (double)nextafterf(times[key], -1), 1)) return false;
    for (double piece = 0; piece < pieces; piece++)
      if (!bend_put(sink, time + seconds * piece / pieces, 1)) return false;
  }
  return true;
}
