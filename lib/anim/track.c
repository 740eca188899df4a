/* Tracks: timelines, segments built from keys, and the formula of each interpolation. */
#include "track.h"

#include "angle.h"
#include "sine.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- timelines ------------------------------------------------------------------------------- */

enum { BUCKETS_MAX = 1 << 24 };

static void fill_buckets(const tw_timeline *timeline, tw_bucket *buckets, uint32_t bucket_count) {
  uint32_t key = 0;
  for (uint32_t i = 0; i < bucket_count + 2; i++) {
    while (key < timeline->key_count && timeline_bucket(timeline, timeline->times[key]) < i) key++;
    buckets[i].first_key = key;
    for (uint32_t j = 0; j < 3; j++)
      buckets[i].times[j] = j < timeline->key_count - key ? timeline->times[key + j] : INFINITY;
  }
}

bool tw_timeline_init(tw_timeline *timeline, tw_arena *arena, const float *times, uint32_t key_count) {
  uint32_t bucket_count = key_count < BUCKETS_MAX ? key_count : BUCKETS_MAX;
  float *copy = tw_arena_alloc(arena, key_count, sizeof *copy);
  tw_bucket *buckets = tw_arena_alloc(arena, (size_t)bucket_count + 2, sizeof *buckets);
  if (!copy || !buckets) return false;
  memcpy(copy, times, key_count * sizeof *copy);
  double span = (double)times[key_count - 1] - (double)times[0];
  double rate = span > 0 ? bucket_count / span : 0;
  *timeline = (tw_timeline){.times = copy,
                            .buckets = buckets,
                            .key_count = key_count,
                            .first = times[0],
                            .last = times[key_count - 1],
                            .last_bucket = (float)bucket_count,
                            .buckets_per_second = (float)fmin(rate, (double)FLT_MAX)};
  fill_buckets(timeline, buckets, bucket_count);
  return true;
}

uint32_t tw_timeline_find_crowded(const tw_timeline *timeline, float clamped, uint32_t bucket) {
  const float *times = timeline->times;
  uint32_t low = timeline->buckets[bucket].first_key, high = timeline->buckets[bucket + 1].first_key;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (times[middle] <= clamped)
      low = middle + 1;
    else
      high = middle;
  }
  return low - 1;
}

void tw_timeline_find(const tw_timeline *timeline, const float *restrict times, size_t count,
                      float *restrict clamped, uint32_t *restrict keys) {
  const tw_timeline line = *timeline;
  for (size_t i = 0; i < count; i++) {
    clamped[i] = timeline_clamp(&line, times[i]);
    keys[i] = timeline_bucket(&line, clamped[i]);
  }
  for (size_t i = 0; i < count; i++) keys[i] = timeline_find_in(&line, clamped[i], keys[i]);
}

/* ---- building segments ----------------------------------------------------------------------- */

/* Rotation keys, prepared for building segments; each array has [key_count]. */
typedef struct rotation_keys {
  double (*unit)[4];  /* unit length, with continuous signs but for splines */
  float (*stored)[4]; /* the sample at the key's time */
} rotation_keys;

/* The input of building segments. */
typedef struct building {
  const tw_track_keys *keys;
  const tw_track *track;
  rotation_keys rotations; /* only for a rotation track */
  const float *values;     /* [key_count][width] the samples at the keys; unused for splines of values */
} building;

static tw_status start_rotations(building *b, tw_arena *scratch) {
  rotation_keys *r = &b->rotations;
  uint32_t count = b->keys->key_count;
  r->unit = tw_arena_alloc(scratch, count, sizeof *r->unit);
  r->stored = tw_arena_alloc(scratch, count, sizeof *r->stored);
  return r->unit && r->stored ? TW_OK : TW_NO_MEMORY;
}

static tw_status no_rotation(tw_error *error, const char *form, uint32_t key, const char *why) {
  tw_fail(error, TW_INVALID, "key %u %s", key, why);
  return tw_error_at(error, "/%s/%u", form, key);
}

/* Reads a key of any form as a quaternion of any length but 0. */
static tw_status read_rotation(const tw_track_keys *keys, uint32_t key, double out[4], tw_error *error) {
  switch (keys->form) {
  case TW_KEY_EULER: tw_quat_euler(keys->angles + 3 * (size_t)key, keys->order, out); return TW_OK;
  case TW_KEY_AXIS_ANGLE: {
    const double *source = keys->angles + 4 * (size_t)key;
    double axis[3] = {source[0], source[1], source[2]};
    double length = tw_normalize(axis, 3);
    if (!(length > 0) || !isfinite(length)) return no_rotation(error, "axis_angles", key, "has no axis");
    tw_quat_axis_angle(axis, source[3], out);
    return TW_OK;
  }
  case TW_KEY_VALUES:
  case TW_KEY_QUATERNION: break;
  }
  bool cubic = keys->interpolation == TW_CUBICSPLINE;
  quat_widen(keys->values + 4 * (cubic ? 3 * (size_t)key + 1 : (size_t)key), out);
  if (tw_length(out, 4) == 0) return no_rotation(error, "quaternions", key, "is a zero quaternion");
  return TW_OK;
}

/* is_aligned: each key is negated where that is nearer to the key before. */
static tw_status prepare_rotations(const tw_track_keys *keys, bool is_aligned, rotation_keys *out,
                                   tw_error *error) {
  for (uint32_t i = 0; i < keys->key_count; i++) {
    double source[4] = {0, 0, 0, 0}, *unit = out->unit[i];
    tw_status status = read_rotation(keys, i, source, error);
    if (status != TW_OK) return status;
    memcpy(unit, source, sizeof source);
    tw_normalize(unit, 4);
    double scale = tw_quat_key_scale(source, is_aligned && i > 0 ? out->unit[i - 1] : NULL);
    double sign = scale < 0 ? -1 : 1;
    for (int j = 0; j < 4; j++) {
      unit[j] *= sign;
      out->stored[i][j] = (float)(source[j] * scale);
    }
  }
  return TW_OK;
}

/* Half the rotation vector from one unit quaternion to another. Its frame is that of either, as the axis is
 * the same in both. */
static void step_between(const double from[4], const double to[4], double out[3]) {
  double turn[4] = {-from[0], -from[1], -from[2], from[3]};
  quat_multiply(turn, to, turn);
  tw_quat_log(turn, out);
}

/* The arc from key i to the next. The last arc, or any arc with `hold`, stands still. */
static tw_arc_segment build_arc(const building *b, uint32_t i, bool hold) {
  const rotation_keys *r = &b->rotations;
  tw_arc_segment out = {.start = b->keys->times[i]};
  memcpy(out.from, r->stored[i], sizeof out.from);
  if (hold || i + 1 == b->keys->key_count) return out;
  tw_arc arc = tw_arc_between(r->unit[i], r->unit[i + 1]);
  double from[4];
  quat_widen(r->stored[i], from);
  double length = tw_length(from, 4);
  for (size_t j = 0; j < 4; j++) out.toward[j] = (float)(arc.toward[j] * length);
  /* Keeps samples finite where a segment takes a denormal fraction of a second. */
  out.rate = (float)fmin(arc.angle / tw_track_seconds(b->track, i), (double)FLT_MAX);
  return out;
}

static void build_arcs(const building *b, tw_arc_segment *out) {
  for (uint32_t i = 0; i < b->keys->key_count; i++) out[i] = build_arc(b, i, b->track->holds);
}

static void build_nlerps(const building *b, nlerp_segment *out) {
  const rotation_keys *r = &b->rotations;
  for (uint32_t i = 0; i < b->keys->key_count; i++) {
    out[i].arc = build_arc(b, i, false);
    if (i + 1 == b->keys->key_count) break;
    double angle = tw_arc_between(r->unit[i], r->unit[i + 1]).angle, half = sin(angle / 2);
    out[i].versine = (float)(2 * half * half);
    out[i].sine = (float)sin(angle);
  }
}

/* Half the angular velocity at a key, in the key's own frame: the mean over the segments on both sides, or
 * that of the only segment at the ends. However unequal the segments are, the control points then move no
 * farther than the keys themselves are apart. */
static void key_velocity(const building *b, uint32_t key, double out[3]) {
  const rotation_keys *r = &b->rotations;
  uint32_t last = b->keys->key_count - 1;
  uint32_t first_side = key > 0 ? key - 1 : 0, end_side = key < last ? key + 1 : last;
  double seconds = 0;
  for (int i = 0; i < 3; i++) out[i] = 0;
  for (uint32_t side = first_side; side < end_side; side++) {
    double step[3];
    step_between(r->unit[side], r->unit[side + 1], step);
    for (int i = 0; i < 3; i++) out[i] += step[i];
    seconds += tw_track_seconds(b->track, side);
  }
  for (int i = 0; i < 3 && seconds > 0; i++) out[i] /= seconds;
}

/* The control point of a segment at one of its keys (side 1: its first, -1: its last), such that the curve
 * passes the key with the given velocity. d/du squad at 0 is log(q0^-1 q1) + 2 log(q0^-1 s0), at 1 it is
 * log(q0^-1 q1) - 2 log(q1^-1 s1). */
static void control_point(const double key[4], const double step[3], const double velocity[3], double seconds,
                          double side, double out[4]) {
  double half[3], turn[4];
  for (int i = 0; i < 3; i++) half[i] = side * (velocity[i] * seconds - step[i]) / 2;
  tw_quat_exp(half, turn);
  quat_multiply(key, turn, out);
}

static void build_squads(const building *b, squad_segment *out) {
  double velocity[3], next_velocity[3];
  key_velocity(b, 0, velocity);
  for (uint32_t i = 0; i + 1 < b->keys->key_count; i++) {
    const double *q = b->rotations.unit[i], *next = b->rotations.unit[i + 1];
    double step[3], out_control[4], in_control[4], seconds = tw_track_seconds(b->track, i);
    step_between(q, next, step);
    key_velocity(b, i + 1, next_velocity);
    control_point(q, step, velocity, seconds, 1, out_control);
    control_point(next, step, next_velocity, seconds, -1, in_control);
    out[i].keys = tw_arc_between(q, next);
    out[i].controls = tw_arc_between(out_control, in_control);
    memcpy(velocity, next_velocity, sizeof velocity);
  }
}

/* Builds cubic splines, one for each component of the track, of the keys and tangents as they stand:
 * glTF 2.0, appendix C, neither scales nor negates quaternions before it interpolates them. */
static void build_cubics(const building *b, cubic *out) {
  const tw_track_keys *keys = b->keys;
  uint32_t width = b->track->width;
  const float *key = keys->values; /* in-tangent, value, out-tangent */
  for (uint32_t i = 0; i < keys->key_count; i++, key += 3 * (size_t)width, out += width) {
    const float *from = key + width, *out_tangents = from + width, *in_tangents = out_tangents + width,
                *to = in_tangents + width;
    for (uint32_t j = 0; j < width; j++) out[j].c[0] = (double)from[j];
    if (i + 1 == keys->key_count) break;
    double seconds = tw_track_seconds(b->track, i);
    for (uint32_t j = 0; j < width; j++) {
      double start = (double)from[j], end = (double)to[j];
      double leaving = (double)out_tangents[j] * seconds, arriving = (double)in_tangents[j] * seconds;
      out[j].c[1] = leaving;
      out[j].c[2] = 3 * (end - start) - 2 * leaving - arriving;
      out[j].c[3] = 2 * (start - end) + leaving + arriving;
    }
  }
}

/* Takes the angles of an Euler track. Other keys become XYZ triples, each the one nearest to the triple
 * before it. */
static void build_eulers(const building *b, euler_segment *out) {
  const tw_track_keys *keys = b->keys;
  for (uint32_t i = 0; i < keys->key_count; i++) {
    if (keys->form == TW_KEY_EULER)
      memcpy(out[i].start, keys->angles + 3 * (size_t)i, sizeof out[i].start);
    else if (i == 0)
      tw_euler_of(b->rotations.unit[i], TW_XYZ, out[i].start);
    else
      tw_euler_near(b->rotations.unit[i], TW_XYZ, out[i - 1].start, out[i].start);
    for (int j = 0; i > 0 && j < 3; j++) out[i - 1].change[j] = out[i].start[j] - out[i - 1].start[j];
  }
}

static void turn_between(const double *from, const double *to, turn_segment *out) {
  double start[3], end[3], sign = 1, cosine = 0;
  memcpy(start, from, sizeof start);
  memcpy(end, to, sizeof end);
  tw_normalize(start, 3);
  tw_normalize(end, 3);
  /* A key of angle 0 has no axis of its own: it takes the other key's. */
  if (from[3] == 0) memcpy(start, end, sizeof start);
  if (to[3] == 0) memcpy(end, start, sizeof end);
  for (int i = 0; i < 3; i++) cosine += start[i] * end[i];
  if (cosine < 0) sign = -1; /* the same rotation about the opposite axis */
  for (int i = 0; i < 3; i++) {
    out->axis[i] = start[i];
    out->toward[i] = sign * end[i] - start[i] * fabs(cosine);
  }
  double sine = tw_normalize(out->toward, 3);
  out->axis_angle = sine > 1e-12 ? atan2(sine, fabs(cosine)) : 0;
  out->start = from[3];
  out->change = sign * to[3] - from[3];
}

static void build_turns(const building *b, turn_segment *out) {
  for (uint32_t i = 0; i < b->keys->key_count; i++) {
    const double *key = b->keys->angles + 4 * (size_t)i;
    bool last = i + 1 == b->keys->key_count;
    turn_between(key, last ? key : key + 4, &out[i]);
  }
}

/* ---- tracks ---------------------------------------------------------------------------------- */

static track_kind kind_of(const tw_track_keys *keys, tw_interpolation interpolation, bool forced) {
  if (keys->path != TW_ROTATION) {
    if (interpolation == TW_STEP) return TRACK_VALUES_STEP;
    return interpolation == TW_CUBICSPLINE ? TRACK_VALUES_HERMITE : TRACK_VALUES_LINEAR;
  }
  switch (interpolation) {
  case TW_LINEAR: return keys->form == TW_KEY_AXIS_ANGLE && !forced ? TRACK_AXIS_ANGLE : TRACK_ARC;
  case TW_NLERP: return TRACK_NLERP;
  case TW_SQUAD: return TRACK_SQUAD;
  case TW_CUBICSPLINE: return TRACK_HERMITE;
  case TW_EULER: return TRACK_EULER;
  case TW_STEP: break;
  }
  return TRACK_ARC;
}

static size_t segment_size(const tw_track *track) {
  switch (track->kind) {
  case TRACK_ARC: return sizeof(tw_arc_segment);
  case TRACK_NLERP: return sizeof(nlerp_segment);
  case TRACK_SQUAD: return sizeof(squad_segment);
  case TRACK_EULER: return sizeof(euler_segment);
  case TRACK_AXIS_ANGLE: return sizeof(turn_segment);
  case TRACK_HERMITE:
  case TRACK_VALUES_HERMITE: return track->width * sizeof(cubic);
  case TRACK_VALUES_STEP:
  case TRACK_VALUES_LINEAR:
  case TRACK_MADE: break;
  }
  return 0;
}

static void build_segments(const building *b, void *out) {
  switch (b->track->kind) {
  case TRACK_ARC: build_arcs(b, out); return;
  case TRACK_NLERP: build_nlerps(b, out); return;
  case TRACK_SQUAD: build_squads(b, out); return;
  case TRACK_EULER: build_eulers(b, out); return;
  case TRACK_AXIS_ANGLE: build_turns(b, out); return;
  case TRACK_HERMITE:
  case TRACK_VALUES_HERMITE: build_cubics(b, out); return;
  case TRACK_VALUES_STEP:
  case TRACK_VALUES_LINEAR:
  case TRACK_MADE: return;
  }
}

static tw_status read_keys(building *b, tw_arena *scratch, tw_error *error) {
  b->values = b->keys->values;
  bool takes_angles = b->track->kind == TRACK_EULER && b->keys->form == TW_KEY_EULER;
  if (b->keys->path != TW_ROTATION || takes_angles) return TW_OK;
  tw_status status = start_rotations(b, scratch);
  b->values = status == TW_OK ? b->rotations.stored[0] : NULL;
  return status == TW_OK ? prepare_rotations(b->keys, b->track->kind != TRACK_HERMITE, &b->rotations, error)
                         : status;
}

/* Whether sampling reads the keys' values as well as segments. */
static bool needs_values(track_kind kind) {
  return kind == TRACK_SQUAD || kind == TRACK_HERMITE || kind == TRACK_VALUES_STEP ||
         kind == TRACK_VALUES_LINEAR;
}

static tw_status build(tw_track *track, tw_arena *arena, tw_arena *scratch, const tw_track_keys *keys,
                       tw_error *error) {
  building b = {.keys = keys, .track = track};
  size_t values_size = track->width * sizeof *b.values;
  tw_status status = read_keys(&b, scratch, error);
  if (status != TW_OK) return status;
  void *segments = tw_arena_alloc(arena, keys->key_count, segment_size(track));
  if (!segments) return TW_NO_MEMORY;
  build_segments(&b, segments);
  track->segments.any = segments;
  if (!needs_values(track->kind)) return TW_OK;
  float *values = tw_arena_alloc(arena, keys->key_count, values_size);
  if (!values) return TW_NO_MEMORY;
  memcpy(values, b.values, keys->key_count * values_size);
  track->keys = values;
  return TW_OK;
}

tw_status tw_track_build(tw_track *track, tw_arena *arena, const tw_track_keys *keys,
                         tw_interpolation interpolation, bool forced, const tw_timeline *timeline,
                         tw_error *error) {
  track->kind = kind_of(keys, interpolation, forced);
  track->node = keys->node;
  track->path = keys->path;
  track->holds = interpolation == TW_STEP;
  track->width = keys->path == TW_ROTATION ? 4 : keys->width;
  track->order = track->kind == TRACK_EULER && keys->form == TW_KEY_EULER ? keys->order : TW_XYZ;
  track->timeline = timeline;
  tw_arena *scratch = tw_arena_create();
  tw_status status = scratch ? build(track, arena, scratch, keys, error) : TW_NO_MEMORY;
  tw_arena_destroy(scratch);
  return status == TW_NO_MEMORY ? tw_fail(error, status, "no memory for a track") : status;
}

/* ---- sampling -------------------------------------------------------------------------------- */

double tw_track_seconds(const tw_track *track, uint32_t key) {
  const tw_timeline *timeline = track->timeline;
  if (key + 1 == timeline->key_count) return 0;
  return (double)timeline->times[key + 1] - (double)timeline->times[key];
}

/* How far a time is into its segment, in [0, 1); 0 at a key. */
static double segment_part(const tw_track *track, float time, uint32_t key) {
  double seconds = tw_track_seconds(track, key);
  return seconds > 0 ? ((double)time - (double)track->timeline->times[key]) / seconds : 0;
}

static void arc_at(const tw_track *track, uint32_t key, double part, double out[4]) {
  const tw_arc_segment *arc = &track->segments.arcs[key];
  double angle = 0;
  if (part > 0) angle = part * (double)arc->rate * tw_track_seconds(track, key);
  double c = cos(angle), s = sin(angle);
  for (int i = 0; i < 4; i++) out[i] = (double)arc->from[i] * c + (double)arc->toward[i] * s;
}

static void nlerp_at(const tw_track *track, uint32_t key, double part, double out[4]) {
  const nlerp_segment *segment = &track->segments.nlerps[key];
  double c = 1 - part * (double)segment->versine, s = part * (double)segment->sine;
  double length = sqrt(c * c + s * s);
  for (int i = 0; i < 4; i++)
    out[i] = (double)segment->arc.from[i] * (c / length) + (double)segment->arc.toward[i] * (s / length);
}

/* Shoemake's spherical quadrangle: slerp between a place on the keys' arc and one on the controls' arc. */
static void squad_at(const tw_track *track, uint32_t key, double part, double out[4]) {
  const squad_segment *segment = track->segments.squads + key;
  double between_keys[4], between_controls[4];
  tw_arc_at(&segment->keys, part, between_keys);
  tw_arc_at(&segment->controls, part, between_controls);
  tw_arc arc = tw_arc_between(between_keys, between_controls);
  tw_arc_at(&arc, 2 * part * (1 - part), out);
}

static double cubic_at(const cubic *cubic, double u) {
  const double *c = cubic->c;
  return c[0] + u * (c[1] + u * (c[2] + u * c[3]));
}

static void hermite_at(const tw_track *track, uint32_t key, double part, double out[4]) {
  const cubic *cubics = track->segments.cubics + 4 * (size_t)key;
  for (int i = 0; i < 4; i++) out[i] = cubic_at(&cubics[i], part);
  /* A spline that passes through zero has no direction there: takes the key before. */
  if (tw_normalize(out, 4) < 1e-30) quat_widen(track->keys + 4 * (size_t)key, out);
}

static void euler_at(const tw_track *track, uint32_t key, double part, double out[4]) {
  const euler_segment *segment = track->segments.eulers + key;
  double angles[3];
  for (int i = 0; i < 3; i++) angles[i] = segment->start[i] + part * segment->change[i];
  tw_quat_euler(angles, track->order, out);
}

static void turn_at(const tw_track *track, uint32_t key, double part, double out[4]) {
  const turn_segment *segment = track->segments.turns + key;
  double axis[3];
  double c = cos(part * segment->axis_angle), s = sin(part * segment->axis_angle);
  for (int i = 0; i < 3; i++) axis[i] = segment->axis[i] * c + segment->toward[i] * s;
  tw_quat_axis_angle(axis, segment->start + part * segment->change, out);
}

void tw_track_rotation(const tw_track *track, uint32_t key, double part, double out[4]) {
  static void (*const formulas[])(const tw_track *, uint32_t, double, double *) = {
      [TRACK_ARC] = arc_at,         [TRACK_NLERP] = nlerp_at, [TRACK_SQUAD] = squad_at,
      [TRACK_HERMITE] = hermite_at, [TRACK_EULER] = euler_at, [TRACK_AXIS_ANGLE] = turn_at,
  };
  if (part == 0 && track->keys)
    quat_widen(track->keys + 4 * (size_t)key, out);
  else
    formulas[track->kind](track, key, part, out);
}

double tw_track_angle(const tw_track *track, const double from[4], const double to[4]) {
  if (track->kind != TRACK_HERMITE) return tw_angle_between(from, to);
  double difference[4], sum[4];
  for (int i = 0; i < 4; i++) {
    difference[i] = to[i] - from[i];
    sum[i] = to[i] + from[i];
  }
  return 4 * atan2(tw_length(difference, 4), tw_length(sum, 4));
}

double tw_track_travel(const tw_track *track, uint32_t key) {
  enum { PLACES = 4 };
  if (track->kind == TRACK_EULER) {
    const double *change = track->segments.eulers[key].change;
    return fabs(change[0]) + fabs(change[1]) + fabs(change[2]);
  }
  if (track->kind == TRACK_AXIS_ANGLE) {
    const turn_segment *turn = &track->segments.turns[key];
    return fabs(turn->change) + 2 * turn->axis_angle;
  }
  double travel = 0, before[4], at[4];
  tw_track_rotation(track, key, 0, before);
  for (int i = 1; i <= PLACES; i++) {
    tw_track_rotation(track, key, (double)i / PLACES, at);
    travel += tw_track_angle(track, before, at);
    memcpy(before, at, sizeof before);
  }
  /* Splines may turn faster between these places; arcs do not. */
  return track->kind == TRACK_ARC || track->kind == TRACK_NLERP ? travel : 4 * travel;
}

static void rotation_at(const tw_track *track, uint32_t key, double part, float *out) {
  double q[4];
  tw_track_rotation(track, key, part, q);
  quat_narrow(q, out);
}

static void values_linear_at(const tw_track *track, uint32_t key, double part, float *out) {
  const float *start = track->keys + (size_t)key * track->width;
  const float *end = part == 0 ? start : start + track->width;
  for (uint32_t i = 0; i < track->width; i++)
    out[i] = (float)((double)start[i] + part * ((double)end[i] - (double)start[i]));
}

static void values_step_at(const tw_track *track, uint32_t key, double part, float *out) {
  (void)part;
  memcpy(out, track->keys + (size_t)key * track->width, track->width * sizeof *out);
}

static void values_hermite_at(const tw_track *track, uint32_t key, double part, float *out) {
  const cubic *cubics = track->segments.cubics + (size_t)key * track->width;
  for (uint32_t i = 0; i < track->width; i++) /* huge tangents may exceed the range of float */
    out[i] = (float)fmax(-(double)FLT_MAX, fmin((double)FLT_MAX, cubic_at(&cubics[i], part)));
}

typedef void (*sampler)(const tw_track *track, uint32_t key, double part, float *out);

static sampler sampler_of(track_kind kind) {
  switch (kind) {
  case TRACK_VALUES_STEP: return values_step_at;
  case TRACK_VALUES_LINEAR: return values_linear_at;
  case TRACK_VALUES_HERMITE: return values_hermite_at;
  case TRACK_ARC:
  case TRACK_NLERP:
  case TRACK_SQUAD:
  case TRACK_HERMITE:
  case TRACK_EULER:
  case TRACK_AXIS_ANGLE:
  case TRACK_MADE: break;
  }
  return rotation_at;
}

/* ---- arcs in bulk ---------------------------------------------------------------------------- */

typedef float four __attribute__((vector_size(16)));

static inline four load_four(const float *from) {
  four value;
  memcpy(&value, from, sizeof value);
  return value;
}

/* Replaces the angles by their cosines, and writes their sines. */
static void turn_angles(float *restrict angles, float *restrict sines, size_t count) {
  for (size_t i = 0; i < count; i++) {
    sines[i] = arc_sine(angles[i]);
    angles[i] = arc_cosine(angles[i]);
  }
}

static inline void put_rotation(const tw_arc_segment *arc, float cosine, float sine, float *out) {
  four rotation = load_four(arc->from) * cosine + load_four(arc->toward) * sine;
  memcpy(out, &rotation, sizeof rotation);
}

void tw_arcs_sample(const tw_arc_segment *const *arcs, const float *times, size_t count, float *const *out) {
  float cosines[TW_TRACK_BATCH], sines[TW_TRACK_BATCH];
  for (size_t i = 0; i < count; i++) cosines[i] = (times[i] - arcs[i]->start) * arcs[i]->rate;
  turn_angles(cosines, sines, count);
  for (size_t i = 0; i < count; i++) put_rotation(arcs[i], cosines[i], sines[i], out[i]);
}

static void sample_arcs(const tw_arc_segment *arcs, const float *times, const uint32_t *keys, size_t count,
                        float *out, size_t step) {
  float cosines[TW_TRACK_BATCH], sines[TW_TRACK_BATCH];
  for (size_t i = 0; i < count; i++) cosines[i] = (times[i] - arcs[keys[i]].start) * arcs[keys[i]].rate;
  turn_angles(cosines, sines, count);
  for (size_t i = 0; i < count; i++, out = (float *)(void *)((char *)out + step))
    put_rotation(&arcs[keys[i]], cosines[i], sines[i], out);
}

void tw_track_sample(const tw_track *track, const float *times, const uint32_t *keys, size_t count,
                     float *out, size_t step) {
  if (track->kind == TRACK_ARC) {
    sample_arcs(track->segments.arcs, times, keys, count, out, step);
    return;
  }
  sampler sample = sampler_of(track->kind);
  for (size_t i = 0; i < count; i++, out = (float *)(void *)((char *)out + step))
    sample(track, keys[i], segment_part(track, times[i], keys[i]), out);
}

/* ---- half turns and longer ones between keys ------------------------------------------------- */

static const double HALF_TURN_COSINE = 1e-6; /* of half the angle; rounding error is a tenth of this */
static const double ANGLE_ROOM = 1e-6;       /* relative to 180 degrees: keys may be in degrees or floats */

static tw_turn judge_angle(double change) {
  double turns = fabs(change) / TW_PI - 1;
  return turns < -ANGLE_ROOM ? TURN_SHORT : turns > ANGLE_ROOM ? TURN_LONG : TURN_HALF;
}

static tw_turn judge_keys(const tw_track *track, uint32_t key) {
  double from[4], to[4];
  tw_track_rotation(track, key, 0, from);
  tw_track_rotation(track, key + 1, 0, to);
  return fabs(quat_dot(from, to)) < HALF_TURN_COSINE ? TURN_HALF : TURN_SHORT;
}

tw_turn tw_angles_turn(const double from[3], const double to[3]) {
  double largest = 0;
  for (int i = 0; i < 3; i++) largest = fmax(largest, fabs(to[i] - from[i]));
  return judge_angle(largest);
}

bool tw_track_says_angles(const tw_track *track) {
  return track->kind == TRACK_EULER || track->kind == TRACK_AXIS_ANGLE;
}

tw_turn tw_track_turn(const tw_track *track, uint32_t key) {
  if (track->kind == TRACK_AXIS_ANGLE) return judge_angle(track->segments.turns[key].change);
  if (track->kind == TRACK_EULER) {
    static const double still[3] = {0};
    return tw_angles_turn(still, track->segments.eulers[key].change);
  }
  bool joins = track->kind == TRACK_ARC || track->kind == TRACK_NLERP || track->kind == TRACK_SQUAD;
  return joins && !track->holds ? judge_keys(track, key) : TURN_SHORT;
}
