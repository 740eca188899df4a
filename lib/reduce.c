/* Clips with as few LINEAR keys as an error allows.
 *
 * A track is first sampled on a grid so dense that between neighbours nothing of note can hide: its keys
 * where it is LINEAR already, else steps whose own chord strays by less than a sixteenth of the tolerance.
 * From each key the next one is the farthest grid place whose chord stays near the path. Then every chord
 * is measured again, densely, between the keys as they will be written; one that fails is halved. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "clip.h"
#include "tweend/bake.h"

enum { STEPS_LEAST = 2, PARTS_MEASURED = 4, REFINEMENTS = 24 };

static const double STEP_ANGLE = 3.14159265358979323846 / 18;
static const double GRID_MARGIN = 16;  /* chords of the grid stray by less than this part of the tolerance */
static const double FLOAT_ROOM = 4e-7; /* of the largest value: what single precision cannot promise */

/* One track on its way. */
typedef struct reduction {
  const tw_clip *clip;
  uint32_t index, width, max_keys;
  bool rotation;
  double tolerance, reached;
  /* the grid */
  uint32_t grid_count, grid_room;
  float *grid_times, *grid_values; /* [grid_count], [grid_count][width] */
  /* the result */
  uint32_t key_count, key_room;
  float *times, *values;  /* [key_count], [key_count][width] */
  float *sample, *second; /* [width] */
} reduction;

static void reduction_deinit(reduction *r) {
  free(r->grid_times);
  free(r->grid_values);
  free(r->times);
  free(r->values);
  free(r->sample);
  free(r->second);
}

/* ---- errors of chords ------------------------------------------------------------------------------ */

static double distance(const reduction *r, const float *a, const float *b) {
  if (r->rotation) {
    double p[4], q[4];
    quat_widen(a, p);
    quat_widen(b, q);
    return tw_angle_between(p, q);
  }
  double sum = 0;
  for (uint32_t i = 0; i < r->width; i++) {
    double difference = (double)a[i] - (double)b[i];
    sum += difference * difference;
  }
  return sqrt(sum);
}

/* What a player makes of two keys. */
typedef struct chord {
  double start, seconds;
  const float *from, *to;
  tw_arc arc; /* of rotations */
} chord;

static chord chord_between(const reduction *r, float start, const float *from, float end, const float *to) {
  chord chord = {.start = (double)start, .seconds = (double)end - (double)start, .from = from, .to = to};
  if (!r->rotation) return chord;
  double a[4], b[4];
  quat_widen(from, a);
  quat_widen(to, b);
  tw_normalize(a, 4);
  tw_normalize(b, 4);
  double sign = quat_dot(a, b) < 0 ? -1 : 1;
  for (int i = 0; i < 4; i++) b[i] *= sign;
  chord.arc = tw_arc_between(a, b);
  return chord;
}

/* How far a chord is from a sample of the path at a time. */
static double stray(const reduction *r, const chord *chord, float time, const float *sample) {
  double u = ((double)time - chord->start) / chord->seconds;
  if (r->rotation) {
    double at[4], q[4];
    tw_arc_at(&chord->arc, u, at);
    quat_widen(sample, q);
    return tw_angle_between(at, q);
  }
  double sum = 0;
  for (uint32_t i = 0; i < r->width; i++) {
    double from = (double)chord->from[i], at = from + u * ((double)chord->to[i] - from);
    sum += ((double)sample[i] - at) * ((double)sample[i] - at);
  }
  return sqrt(sum);
}

static double stray_at(const reduction *r, const chord *chord, float time) {
  tw_clip_sample(r->clip, r->index, &time, 1, r->sample);
  return stray(r, chord, time, r->sample);
}

/* ---- the grid ----------------------------------------------------------------------------------------- */

/* Makes room for one more time and value; doubles, up to a number of keys. */
static tw_status grow(float **times, float **values, uint32_t *room, uint32_t count, uint32_t width,
                      uint32_t most, tw_error *error) {
  if (count < *room) return TW_OK;
  if (count >= most)
    return tw_fail(error, TW_LIMIT, "a track needs more than %u keys at this tolerance", most);
  uint32_t more = *room ? (*room > most / 2 ? most : *room * 2) : most < 256 ? most : 256;
  size_t row = width * sizeof(float);
  if (more > SIZE_MAX / row) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
  float *wider_times = realloc(*times, more * sizeof(float));
  if (wider_times) *times = wider_times;
  float *wider_values = wider_times ? realloc(*values, more * row) : NULL;
  if (!wider_values) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
  *values = wider_values;
  *room = more;
  return TW_OK;
}

/* Adds a place unless single precision cannot tell it from the last one. */
static tw_status add_place(reduction *r, float time, tw_error *error) {
  if (r->grid_count > 0 && !(time > r->grid_times[r->grid_count - 1])) return TW_OK;
  uint32_t most = r->max_keys > UINT32_MAX / 64 ? UINT32_MAX : r->max_keys * 64;
  tw_status status =
      grow(&r->grid_times, &r->grid_values, &r->grid_room, r->grid_count, r->width, most, error);
  if (status != TW_OK) return status;
  r->grid_times[r->grid_count] = time;
  tw_clip_sample(r->clip, r->index, &time, 1, r->grid_values + (size_t)r->grid_count * r->width);
  r->grid_count++;
  return TW_OK;
}

static float part_time(const tw_track *track, uint32_t key, double part) {
  return (float)((double)track->timeline->times[key] + part * tw_track_seconds(track, key));
}

/* Chords between keys are the path itself. */
static bool is_linear(const tw_track *track) {
  return track->kind == TRACK_ARC || track->kind == TRACK_VALUES_LINEAR;
}

/* The most that chords of `steps` equal steps of a segment stray in their middles. */
static double largest_stray(reduction *r, const tw_track *track, uint32_t key, double steps) {
  double largest = 0;
  float start = part_time(track, key, 0), end;
  float *from = r->second, *to = r->second + r->width;
  tw_clip_sample(r->clip, r->index, &start, 1, from);
  for (double i = 1; i <= steps; i++, start = end) {
    end = part_time(track, key, i / steps);
    tw_clip_sample(r->clip, r->index, &end, 1, to);
    if (end > start) {
      chord chord = chord_between(r, start, from, end, to);
      largest = fmax(largest, stray_at(r, &chord, part_time(track, key, (i - 0.5) / steps)));
    }
    memcpy(from, to, r->width * sizeof *from);
  }
  return largest;
}

static tw_status lay_segment(reduction *r, const tw_track *track, uint32_t key, tw_error *error) {
  double steps = 1;
  if (!is_linear(track)) {
    double turns = track->path == TW_ROTATION ? ceil(tw_track_travel(track, key) / STEP_ANGLE) : 0;
    steps = fmax(STEPS_LEAST, turns);
    if (steps > r->max_keys)
      return tw_fail(error, TW_LIMIT, "a track turns too often for %u keys", r->max_keys);
    /* A chord's error goes with the square of its length. */
    double ratio = GRID_MARGIN * largest_stray(r, track, key, steps) / r->tolerance;
    if (ratio > 1) steps *= ceil(sqrt(ratio));
  }
  tw_status status = TW_OK;
  for (double i = 0; i < steps && status == TW_OK; i++)
    status = add_place(r, part_time(track, key, i / steps), error);
  return status;
}

static tw_status lay_grid(reduction *r, tw_error *error) {
  const tw_track *track = &r->clip->tracks[r->index];
  uint32_t last = track->timeline->key_count - 1;
  for (uint32_t key = 0; key < last; key++) {
    tw_status status = lay_segment(r, track, key, error);
    if (status != TW_OK) return status;
  }
  return add_place(r, track->timeline->times[last], error);
}

/* ---- choosing keys ---------------------------------------------------------------------------------------
 */

static const float *grid_value(const reduction *r, uint32_t place) {
  return r->grid_values + (size_t)place * r->width;
}

static bool chord_holds(const reduction *r, uint32_t from, uint32_t to) {
  chord chord =
      chord_between(r, r->grid_times[from], grid_value(r, from), r->grid_times[to], grid_value(r, to));
  double allowed = r->tolerance * (1 - 1 / GRID_MARGIN);
  for (uint32_t i = from + 1; i < to; i++)
    if (stray(r, &chord, r->grid_times[i], grid_value(r, i)) > allowed) return false;
  return true;
}

/* The farthest place that a chord reaches: doubling strides, then bisection. Not every shorter chord need
 * hold, but the one that is returned does. */
static uint32_t farthest(const reduction *r, uint32_t from) {
  uint32_t last = r->grid_count - 1, good = from + 1, stride = 1, bad = last + 1;
  while (good < last) {
    uint32_t next = last - good > stride ? good + stride : last;
    if (!chord_holds(r, from, next)) {
      bad = next;
      break;
    }
    good = next;
    stride *= 2;
  }
  while (bad - good > 1) {
    uint32_t middle = good + (bad - good) / 2;
    if (chord_holds(r, from, middle))
      good = middle;
    else
      bad = middle;
  }
  return good;
}

static tw_status add_key(reduction *r, float time, const float *value, tw_error *error) {
  tw_status status = grow(&r->times, &r->values, &r->key_room, r->key_count, r->width, r->max_keys, error);
  if (status != TW_OK) return status;
  r->times[r->key_count] = time;
  memcpy(r->values + (size_t)r->key_count * r->width, value, r->width * sizeof *value);
  r->key_count++;
  return TW_OK;
}

/* Golden section for the worst place of a chord between two times. */
static double worst_near(const reduction *r, const chord *chord, double low, double high) {
  static const double GOLDEN = 0.61803398874989485;
  double worst = 0;
  for (int i = 0; i < REFINEMENTS; i++) {
    double left = high - GOLDEN * (high - low), right = low + GOLDEN * (high - low);
    double at_left = stray_at(r, chord, (float)left), at_right = stray_at(r, chord, (float)right);
    worst = fmax(worst, fmax(at_left, at_right));
    if (at_left > at_right)
      high = right;
    else
      low = left;
  }
  return worst;
}

/* The largest error of the chord between two written keys; `places` grid places lie between them. */
static double measure(const reduction *r, float start, const float *from, float end, const float *to,
                      uint32_t places) {
  chord chord = chord_between(r, start, from, end, to);
  double worst = 0, worst_part = 0, parts = PARTS_MEASURED * ((double)places + 1);
  for (double i = 1; i < parts; i++) {
    double error = stray_at(r, &chord, (float)(chord.start + chord.seconds * i / parts));
    if (error <= worst) continue;
    worst = error;
    worst_part = i;
  }
  if (worst == 0) return 0;
  double low = chord.start + chord.seconds * (worst_part - 1) / parts;
  double high = chord.start + chord.seconds * (worst_part + 1) / parts;
  return fmax(worst, worst_near(r, &chord, low, high));
}

/* Adds the key at a grid place; where the chord to it strays after all, keys half way before it. */
static tw_status reach(reduction *r, uint32_t place, uint32_t places, tw_error *error) {
  const float *goal = grid_value(r, place);
  float goal_time = r->grid_times[place];
  for (;;) {
    float start = r->times[r->key_count - 1], end = goal_time;
    float *value = r->second;
    memcpy(value, goal, r->width * sizeof *value);
    const float *from = r->values + (size_t)(r->key_count - 1) * r->width;
    double strays = measure(r, start, from, end, value, places);
    while (strays > r->tolerance) {
      float middle = (float)((double)start + ((double)end - (double)start) / 2);
      if (!(middle > start && middle < end)) break; /* time itself goes no finer */
      end = middle;
      tw_clip_sample(r->clip, r->index, &end, 1, value);
      strays = measure(r, start, from, end, value, places);
    }
    r->reached = fmax(r->reached, strays);
    tw_status status = add_key(r, end, value, error);
    if (status != TW_OK || end == goal_time) return status;
  }
}

/* How far the path goes from its first place; a track that stays there needs but one key. */
static double largest_departure(const reduction *r) {
  double largest = 0;
  for (uint32_t i = 1; i < r->grid_count; i++)
    largest = fmax(largest, distance(r, grid_value(r, 0), grid_value(r, i)));
  return largest;
}

static tw_status choose_keys(reduction *r, tw_error *error) {
  tw_status status = add_key(r, r->grid_times[0], grid_value(r, 0), error);
  double departure = largest_departure(r);
  bool gives_duration = r->grid_times[r->grid_count - 1] == r->clip->duration;
  if (departure <= r->tolerance * (1 - 1 / GRID_MARGIN) && !gives_duration) {
    r->reached = departure;
    return status;
  }
  for (uint32_t place = 0; status == TW_OK && place + 1 < r->grid_count;) {
    uint32_t next = farthest(r, place);
    status = reach(r, next, next - place - 1, error);
    place = next;
  }
  return status;
}

/* ---- clips -----------------------------------------------------------------------------------------------
 */

/* Of values, no finer than single precision tells them apart. */
static double effective_tolerance(const reduction *r, const tw_track *track, tw_tolerance tolerance) {
  if (r->rotation) return tolerance.angle;
  double largest = 0;
  for (uint32_t key = 0; key < track->timeline->key_count; key++) {
    tw_clip_sample(r->clip, r->index, &track->timeline->times[key], 1, r->sample);
    for (uint32_t i = 0; i < r->width; i++) largest = fmax(largest, fabs((double)r->sample[i]));
  }
  return fmax(tolerance.distance, FLOAT_ROOM * largest);
}

/* The chosen keys, moved to the arena. */
static tw_status deliver(const reduction *r, tw_arena *arena, tw_track_keys *out, tw_error *error) {
  float *times = tw_arena_alloc(arena, r->key_count, sizeof *times);
  float *values = tw_arena_alloc(arena, (size_t)r->key_count * r->width, sizeof *values);
  if (!times || !values) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
  memcpy(times, r->times, r->key_count * sizeof *times);
  memcpy(values, r->values, (size_t)r->key_count * r->width * sizeof *values);
  *out = tw_track_as_keys(&r->clip->tracks[r->index], times, values, r->key_count);
  return TW_OK;
}

static tw_status reduce_track(const tw_clip *clip, uint32_t index, tw_tolerance tolerance, uint32_t max_keys,
                              tw_arena *arena, tw_track_keys *out, double *reached, tw_error *error) {
  const tw_track *track = &clip->tracks[index];
  reduction r = {.clip = clip,
                 .index = index,
                 .width = track->width,
                 .max_keys = max_keys,
                 .rotation = track->path == TW_ROTATION};
  tw_status status = TW_NO_MEMORY;
  r.sample = tw_alloc(r.width, sizeof *r.sample);
  r.second = tw_alloc(r.width, 2 * sizeof *r.second);
  if (r.sample && r.second) {
    r.tolerance = effective_tolerance(&r, track, tolerance);
    status = lay_grid(&r, error);
    if (status == TW_OK) status = choose_keys(&r, error);
    if (status == TW_OK) status = deliver(&r, arena, out, error);
    *reached = fmax(*reached, r.reached);
  } else {
    tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
  }
  reduction_deinit(&r);
  return status;
}

static tw_status copy_steps(const tw_clip *clip, uint32_t index, tw_arena *arena, tw_track_keys *out,
                            tw_error *error) {
  const tw_track *track = &clip->tracks[index];
  uint32_t key_count = track->timeline->key_count;
  float *times = tw_arena_alloc(arena, key_count, sizeof *times);
  float *values = tw_arena_alloc(arena, (size_t)key_count * track->width, sizeof *values);
  if (!times || !values) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
  memcpy(times, track->timeline->times, key_count * sizeof *times);
  tw_clip_sample(clip, index, times, key_count, values);
  *out = tw_track_as_keys(track, times, values, key_count);
  return TW_OK;
}

tw_status tw_clip_reduce(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                         uint32_t max_keys, tw_arena *arena, tw_clip_keys *out, tw_tolerance *reached,
                         tw_error *error) {
  if (!(tolerance.angle >= 1e-6) || !(tolerance.distance > 0))
    return tw_fail(error, TW_INVALID, "a tolerance is at least 1e-6 radians and more than 0 metres");
  tw_track_keys *tracks = tw_arena_alloc(arena, clip->track_count, sizeof *tracks);
  if (!tracks) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced clip");
  tw_tolerance most = {0, 0};
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track *track = &clip->tracks[i];
    tw_status status = TW_OK;
    if (track->kind == TRACK_HERMITE || track->kind == TRACK_VALUES_HERMITE)
      tracks[i] = keys->tracks[i];
    else if (track->holds)
      status = copy_steps(clip, i, arena, &tracks[i], error);
    else
      status = reduce_track(clip, i, tolerance, max_keys, arena, &tracks[i],
                            track->path == TW_ROTATION ? &most.angle : &most.distance, error);
    if (status != TW_OK) return status;
  }
  *out = (tw_clip_keys){.track_count = clip->track_count, .tracks = tracks};
  *reached = most;
  return TW_OK;
}
