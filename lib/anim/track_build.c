/* From keys as written to segments ready for sampling. */
#include "track.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rotation keys on their way to segments. */
typedef struct rotation_keys {
  double (*unit)[4];  /* unit length, each on the side of the one before it */
  float (*stored)[4]; /* what a sample at the key's time gives */
  double *scale;      /* what the source's value was multiplied by, for its tangents */
} rotation_keys;

static bool rotation_keys_init(rotation_keys *keys, tw_arena *arena, uint32_t key_count) {
  keys->unit = tw_arena_alloc(arena, key_count, sizeof *keys->unit);
  keys->stored = tw_arena_alloc(arena, key_count, sizeof *keys->stored);
  keys->scale = tw_arena_alloc(arena, key_count, sizeof *keys->scale);
  return keys->unit && keys->stored && keys->scale;
}

static tw_status no_rotation(tw_error *error, const char *form, uint32_t key, const char *why) {
  tw_fail(error, TW_INVALID, "key %u %s", key, why);
  return tw_error_at(error, "/%s/%u", form, key);
}

/* A key's quaternion as its form says it, of any length but zero. */
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

/* Off unit length by no more than what printing with seven digits leaves, a key stays bit for bit. */
static const double UNIT_TOLERANCE = 1e-6;

static tw_status prepare_rotations(const tw_track_keys *keys, rotation_keys *out, tw_error *error) {
  for (uint32_t i = 0; i < keys->key_count; i++) {
    double source[4] = {0, 0, 0, 0}, *unit = out->unit[i];
    tw_status status = read_rotation(keys, i, source, error);
    if (status != TW_OK) return status;
    memcpy(unit, source, sizeof source);
    double length = tw_normalize(unit, 4);
    double sign = i > 0 && quat_dot(unit, out->unit[i - 1]) < 0 ? -1 : 1;
    out->scale[i] = fabs(length - 1) <= UNIT_TOLERANCE ? sign : sign / length;
    for (int j = 0; j < 4; j++) {
      unit[j] *= sign;
      out->stored[i][j] = (float)(source[j] * out->scale[i]);
    }
  }
  return TW_OK;
}

static const void *no_memory(tw_error *error) {
  tw_fail(error, TW_NO_MEMORY, "no memory for a track");
  return NULL;
}

/* Half the rotation vector from one unit quaternion to another, in the frame of either. */
static void step_between(const double from[4], const double to[4], double out[3]) {
  double turn[4] = {-from[0], -from[1], -from[2], from[3]};
  quat_multiply(turn, to, turn);
  tw_quat_log(turn, out);
}

static double seconds_to_next(const tw_timeline *timeline, uint32_t key) {
  return (double)timeline->times[key + 1] - (double)timeline->times[key];
}

static const float *build_arcs(tw_arena *arena, const rotation_keys *keys, const tw_timeline *timeline,
                               bool hold, tw_error *error) {
  size_t count = timeline->key_count;
  float *arcs = tw_arena_alloc(arena, count * ARC_NUMBERS + ARC_ROOM, sizeof *arcs);
  if (!arcs) return no_memory(error);
  for (uint32_t i = 0; i < count; i++) {
    for (size_t j = 0; j < 4; j++) arcs[(ARC_FROM + j) * count + i] = keys->stored[i][j];
    arcs[ARC_START * count + i] = timeline->times[i];
    if (hold || i + 1 == count) continue;
    tw_arc arc = tw_arc_between(keys->unit[i], keys->unit[i + 1]);
    double from[4];
    quat_widen(keys->stored[i], from);
    double length = tw_length(from, 4);
    for (size_t j = 0; j < 4; j++) arcs[(ARC_TOWARD + j) * count + i] = (float)(arc.toward[j] * length);
    /* Segments of a denormal part of a second: their samples stay finite. */
    arcs[ARC_RATE * count + i] = (float)fmin(arc.angle / seconds_to_next(timeline, i), (double)FLT_MAX);
  }
  return arcs;
}

/* Arcs whose rate is that of u, and the shape of each. */
static tw_status build_nlerp(tw_track *track, tw_arena *arena, const rotation_keys *keys, tw_error *error) {
  const tw_timeline *timeline = track->timeline;
  nlerp_shape *shapes = tw_arena_alloc(arena, timeline->key_count, sizeof *shapes);
  track->segments.arcs = build_arcs(arena, keys, timeline, false, error);
  if (!shapes || !track->segments.arcs) return tw_fail(error, TW_NO_MEMORY, "no memory for a track");
  for (uint32_t i = 0; i + 1 < timeline->key_count; i++) {
    double angle = tw_arc_between(keys->unit[i], keys->unit[i + 1]).angle, half = sin(angle / 2);
    shapes[i] = (nlerp_shape){.versine = (float)(2 * half * half), .sine = (float)sin(angle)};
  }
  track->shapes = shapes;
  return TW_OK;
}

/* Half the angular velocity at a key, in the key's own frame: the mean over the segments on both sides,
 * at the ends of the only one. However unequal they are, it carries the control points no farther than
 * the keys themselves are apart. */
static void key_velocity(const rotation_keys *keys, const tw_timeline *timeline, uint32_t key,
                         double out[3]) {
  uint32_t last = timeline->key_count - 1;
  uint32_t first_side = key > 0 ? key - 1 : 0, end_side = key < last ? key + 1 : last;
  double seconds = 0;
  for (int i = 0; i < 3; i++) out[i] = 0;
  for (uint32_t side = first_side; side < end_side; side++) {
    double step[3];
    step_between(keys->unit[side], keys->unit[side + 1], step);
    for (int i = 0; i < 3; i++) out[i] += step[i];
    seconds += seconds_to_next(timeline, side);
  }
  for (int i = 0; i < 3 && seconds > 0; i++) out[i] /= seconds;
}

/* The control point of a segment at one of its keys, so that the curve passes the key with the given
 * velocity: d/du squad at 0 is log(q0^-1 q1) + 2 log(q0^-1 s0), at 1 log(q0^-1 q1) - 2 log(q1^-1 s1). */
static void control_point(const double key[4], const double step[3], const double velocity[3], double seconds,
                          double side, double out[4]) {
  double half[3], turn[4];
  for (int i = 0; i < 3; i++) half[i] = side * (velocity[i] * seconds - step[i]) / 2;
  tw_quat_exp(half, turn);
  quat_multiply(key, turn, out);
}

static const squad_segment *build_squads(tw_arena *arena, const rotation_keys *keys,
                                         const tw_timeline *timeline, tw_error *error) {
  squad_segment *squads = tw_arena_alloc(arena, timeline->key_count, sizeof *squads);
  if (!squads) return no_memory(error);
  double velocity[3], next_velocity[3];
  key_velocity(keys, timeline, 0, velocity);
  for (uint32_t i = 0; i + 1 < timeline->key_count; i++) {
    const double *q = keys->unit[i], *next = keys->unit[i + 1];
    double step[3], out_control[4], in_control[4], seconds = seconds_to_next(timeline, i);
    step_between(q, next, step);
    key_velocity(keys, timeline, i + 1, next_velocity);
    control_point(q, step, velocity, seconds, 1, out_control);
    control_point(next, step, next_velocity, seconds, -1, in_control);
    squads[i].keys = tw_arc_between(q, next);
    squads[i].controls = tw_arc_between(out_control, in_control);
    memcpy(velocity, next_velocity, sizeof velocity);
  }
  return squads;
}

/* Cubic splines of `width` components. scale: [key_count], or NULL for 1. stored: [key_count][width]. */
static const cubic *build_cubics(tw_arena *arena, const tw_track_keys *keys, const float *stored,
                                 const double *scale, tw_error *error) {
  uint32_t width = keys->width, key_count = keys->key_count;
  cubic *cubics = tw_arena_alloc(arena, (size_t)key_count * width, sizeof *cubics);
  if (!cubics) return no_memory(error);
  for (uint32_t i = 0; i < key_count; i++) {
    const float *from = stored + (size_t)i * width;
    cubic *out = cubics + (size_t)i * width;
    for (uint32_t j = 0; j < width; j++) out[j].c[0] = (double)from[j];
    if (i + 1 == key_count) break;
    double seconds = (double)keys->times[i + 1] - (double)keys->times[i];
    const float *out_tangents = keys->values + (3 * (size_t)i + 2) * width;
    const float *in_tangents = keys->values + 3 * ((size_t)i + 1) * width;
    double out_scale = seconds * (scale ? scale[i] : 1), in_scale = seconds * (scale ? scale[i + 1] : 1);
    for (uint32_t j = 0; j < width; j++) {
      double start = (double)from[j], end = (double)from[width + j];
      double leaving = (double)out_tangents[j] * out_scale, arriving = (double)in_tangents[j] * in_scale;
      out[j].c[1] = leaving;
      out[j].c[2] = 3 * (end - start) - 2 * leaving - arriving;
      out[j].c[3] = 2 * (start - end) + leaving + arriving;
    }
  }
  return cubics;
}

/* Own angles of an Euler track; any other keys become XYZ triples, each the one nearest to the triple
 * before it. */
static const euler_segment *build_eulers(tw_arena *arena, const tw_track_keys *keys,
                                         const rotation_keys *rotations, tw_error *error) {
  euler_segment *eulers = tw_arena_alloc(arena, keys->key_count, sizeof *eulers);
  if (!eulers) return no_memory(error);
  for (uint32_t i = 0; i < keys->key_count; i++) {
    if (keys->form == TW_KEY_EULER)
      memcpy(eulers[i].start, keys->angles + 3 * (size_t)i, sizeof eulers[i].start);
    else if (i == 0)
      tw_euler_of(rotations->unit[i], TW_XYZ, eulers[i].start);
    else
      tw_euler_near(rotations->unit[i], TW_XYZ, eulers[i - 1].start, eulers[i].start);
    for (int j = 0; i > 0 && j < 3; j++)
      eulers[i - 1].change[j] = eulers[i].start[j] - eulers[i - 1].start[j];
  }
  return eulers;
}

static void turn_between(const double *from, const double *to, turn_segment *out) {
  double start[3], end[3], sign = 1, cosine = 0;
  memcpy(start, from, sizeof start);
  memcpy(end, to, sizeof end);
  tw_normalize(start, 3);
  tw_normalize(end, 3);
  /* No angle, no axis: the other key's serves. */
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

static const turn_segment *build_turns(tw_arena *arena, const tw_track_keys *keys, tw_error *error) {
  turn_segment *turns = tw_arena_alloc(arena, keys->key_count, sizeof *turns);
  if (!turns) return no_memory(error);
  for (uint32_t i = 0; i < keys->key_count; i++) {
    const double *key = keys->angles + 4 * (size_t)i;
    bool last = i + 1 == keys->key_count;
    turn_between(key, last ? key : key + 4, &turns[i]);
  }
  return turns;
}

static tw_status build_rotation(tw_track *track, tw_arena *arena, const tw_track_keys *keys,
                                tw_interpolation interpolation, bool forced, const rotation_keys *rotations,
                                tw_error *error) {
  const void *built = NULL;
  switch (interpolation) {
  case TW_STEP:
    track->kind = TRACK_ARC;
    built = track->segments.arcs = build_arcs(arena, rotations, track->timeline, true, error);
    break;
  case TW_LINEAR:
    if (keys->form == TW_KEY_AXIS_ANGLE && !forced) {
      track->kind = TRACK_AXIS_ANGLE;
      built = track->segments.turns = build_turns(arena, keys, error);
    } else {
      track->kind = TRACK_ARC;
      built = track->segments.arcs = build_arcs(arena, rotations, track->timeline, false, error);
    }
    break;
  case TW_NLERP: track->kind = TRACK_NLERP; return build_nlerp(track, arena, rotations, error);
  case TW_SQUAD:
    track->kind = TRACK_SQUAD;
    built = track->segments.squads = build_squads(arena, rotations, track->timeline, error);
    break;
  case TW_CUBICSPLINE:
    track->kind = TRACK_HERMITE;
    built = track->segments.cubics = build_cubics(arena, keys, rotations->stored[0], rotations->scale, error);
    break;
  case TW_EULER:
    track->kind = TRACK_EULER;
    track->order = keys->form == TW_KEY_EULER ? keys->order : TW_XYZ;
    built = track->segments.eulers = build_eulers(arena, keys, rotations, error);
    break;
  }
  return built ? TW_OK : TW_NO_MEMORY;
}

static const float *copy_floats(tw_arena *arena, const float *values, size_t count, tw_error *error) {
  float *copy = tw_arena_alloc(arena, count, sizeof *copy);
  if (!copy) return no_memory(error);
  memcpy(copy, values, count * sizeof *copy);
  return copy;
}

static tw_status build_rotations(tw_track *track, tw_arena *arena, tw_arena *scratch,
                                 const tw_track_keys *keys, tw_interpolation interpolation, bool forced,
                                 tw_error *error) {
  rotation_keys rotations;
  if (!rotation_keys_init(&rotations, scratch, keys->key_count))
    return tw_fail(error, TW_NO_MEMORY, "no memory for a track");
  tw_status status = prepare_rotations(keys, &rotations, error);
  if (status != TW_OK) return status;
  status = build_rotation(track, arena, keys, interpolation, forced, &rotations, error);
  if (status != TW_OK || (track->kind != TRACK_SQUAD && track->kind != TRACK_HERMITE)) return status;
  track->keys = copy_floats(arena, rotations.stored[0], 4 * (size_t)keys->key_count, error);
  return track->keys ? TW_OK : TW_NO_MEMORY;
}

static tw_status build_values(tw_track *track, tw_arena *arena, tw_arena *scratch, const tw_track_keys *keys,
                              tw_error *error) {
  size_t width = keys->width, count = keys->key_count * width;
  if (keys->interpolation != TW_CUBICSPLINE) {
    track->kind = keys->interpolation == TW_STEP ? TRACK_VALUES_STEP : TRACK_VALUES_LINEAR;
    track->keys = copy_floats(arena, keys->values, count, error);
    return track->keys ? TW_OK : TW_NO_MEMORY;
  }
  float *stored = tw_arena_alloc(scratch, count, sizeof *stored);
  if (!stored) return tw_fail(error, TW_NO_MEMORY, "no memory for a track");
  for (uint32_t i = 0; i < keys->key_count; i++)
    memcpy(stored + i * width, keys->values + (3 * (size_t)i + 1) * width, width * sizeof *stored);
  track->kind = TRACK_VALUES_HERMITE;
  track->segments.cubics = build_cubics(arena, keys, stored, NULL, error);
  return track->segments.cubics ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_track_build(tw_track *track, tw_arena *arena, const tw_track_keys *keys,
                         tw_interpolation interpolation, bool forced, const tw_timeline *timeline,
                         tw_error *error) {
  track->node = keys->node;
  track->path = keys->path;
  track->holds = interpolation == TW_STEP;
  track->width = keys->path == TW_ROTATION ? 4 : keys->width;
  track->timeline = timeline;
  tw_arena *scratch = tw_arena_create();
  if (!scratch) return tw_fail(error, TW_NO_MEMORY, "no memory for a track");
  tw_status status = keys->path == TW_ROTATION
                         ? build_rotations(track, arena, scratch, keys, interpolation, forced, error)
                         : build_values(track, arena, scratch, keys, error);
  tw_arena_destroy(scratch);
  return status;
}
