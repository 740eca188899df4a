/* Sampling: the formulas of every interpolation. */
#include "track.h"

#include <float.h>
#include <math.h>
#include <string.h>

double tw_track_seconds(const tw_track *track, uint32_t key) {
  const tw_timeline *timeline = track->timeline;
  if (key + 1 == timeline->key_count) return 0;
  return (double)timeline->times[key + 1] - (double)timeline->times[key];
}

/* How far into its segment a time is, in [0, 1); 0 at a key. */
static double segment_part(const tw_track *track, float time, uint32_t key) {
  double seconds = tw_track_seconds(track, key);
  return seconds > 0 ? ((double)time - (double)track->timeline->times[key]) / seconds : 0;
}

static void arc_at(const tw_track *track, uint32_t key, double part, double out[4]) {
  const arc_segment arc = track_arc(track, key);
  double angle = 0;
  if (part > 0) angle = part * (double)arc.rate * tw_track_seconds(track, key);
  double c = cos(angle), s = sin(angle);
  for (int i = 0; i < 4; i++) out[i] = (double)arc.from[i] * c + (double)arc.toward[i] * s;
}

static void nlerp_at(const tw_track *track, uint32_t key, double part, double out[4]) {
  const arc_segment arc = track_arc(track, key);
  const nlerp_shape *shape = track->shapes + key;
  double c = 1 - part * (double)shape->versine, s = part * (double)shape->sine;
  double length = sqrt(c * c + s * s);
  for (int i = 0; i < 4; i++)
    out[i] = (double)arc.from[i] * (c / length) + (double)arc.toward[i] * (s / length);
}

/* Shoemake's spherical quadrangle: slerp between the arc of the keys and that of the controls. */
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
  /* A spline through zero has no direction there: the key before it stands in. */
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
    travel += tw_angle_between(before, at);
    memcpy(before, at, sizeof before);
  }
  /* Splines may hurry between these places; arcs do not. */
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
  for (uint32_t i = 0; i < track->width; i++) /* huge tangents may leave the range of float */
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
  case TRACK_AXIS_ANGLE: break;
  }
  return rotation_at;
}

void tw_track_sample(const tw_track *track, const float *times, const uint32_t *keys, size_t count,
                     float *out) {
  if (track->kind == TRACK_ARC) {
    tw_arcs_sample(track->segments.arcs, track->timeline->key_count, keys, times, count, out);
    return;
  }
  sampler sample = sampler_of(track->kind);
  for (size_t i = 0; i < count; i++)
    sample(track, keys[i], segment_part(track, times[i], keys[i]), out + i * track->width);
}
