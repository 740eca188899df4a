/* A rotation that turns evenly about one axis moves every entry of its matrix as A + B cos x + C sin x, so
 * where slerp and turns about a fixed axis come nearest to lock is known in closed form. Other paths are
 * followed in steps small enough that between three places a parabola tells where the middle one peaks. */
#include "trackpath.h"

#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const double STEP_ANGLE = 3.14159265358979323846 / 36;
static const double SAMPLE_ANGLE = 1; /* between the samples that tell A, B and C, at most */
static const double STILL = 1e-4;     /* who turns less has no lesser place than its ends, by 1e-9 */
static const double SINE_ROOM = 1e-5; /* what a parabola through a step leaves open */
static const double MORE = 1 + 1e-9;  /* rounding does not make a place the fastest, a step the largest */
static const double NEARER = 1e-12;   /* nor the nearest to lock: the first of equals is told */

enum { STEPS_LEAST = 4, PEAK_ROUNDS = 3, GOLDEN_ROUNDS = 40 };

/* The sine of the order's middle angle. */
static double sine_middle(const double q[4], tw_euler_order order) {
  const unsigned char *axes = tw_euler_axes[order];
  double product = q[axes[0]] * q[axes[2]];
  bool even = (axes[0] + 1) % 3 == axes[1];
  return 2 * (q[3] * q[axes[1]] + (even ? product : -product)) / quat_dot(q, q);
}

/* |cos| of the middle angle: the product of the pairs in euler.c, precise up to lock itself. */
static double cos_middle(const double q[4], tw_euler_order order) {
  const unsigned char *axes = tw_euler_axes[order];
  bool even = (axes[0] + 1) % 3 == axes[1];
  double i = q[axes[0]], j = q[axes[1]], k = even ? q[axes[2]] : -q[axes[2]], w = q[3];
  return sqrt(((w + j) * (w + j) + (i + k) * (i + k)) * ((w - j) * (w - j) + (i - k) * (i - k))) /
         quat_dot(q, q);
}

typedef struct segment {
  const tw_track *track;
  uint32_t key;
  double start, seconds;
  tw_arc slerp; /* between the same keys; of tracks that stray from it */
} segment;

static void rotation_at(const segment *s, double u, double out[4]) {
  tw_track_rotation(s->track, s->key, u, out);
}

/* Whether a middle angle of this sine could be nearer to lock than the least cosine so far. */
static bool is_nearer(double sine, double least) {
  return 1 - sine * sine < least * least + 1e-12;
}

static void note_gimbal(const segment *s, const double q[4], double u, int order, tw_track_report *report) {
  tw_gimbal *gimbal = &report->gimbals[order];
  double cosine = cos_middle(q, (tw_euler_order)order);
  if (cosine >= gimbal->cos_middle - NEARER) return;
  gimbal->cos_middle = cosine;
  gimbal->time = s->start + u * s->seconds;
}

static void note_speed(const segment *s, double speed, double u, tw_track_report *report) {
  if (speed <= report->peak_velocity * s->seconds * MORE) return;
  report->peak_velocity = speed / s->seconds;
  report->peak_time = s->start + u * s->seconds;
}

/* ---- even turns about one axis -------------------------------------------------------------------- */

/* Whether the segment is such a turn, and through which angle. */
static bool is_even_turn(const segment *s, double *whole) {
  double from[4], to[4];
  switch (s->track->kind) {
  case TRACK_ARC:
  case TRACK_NLERP:
    rotation_at(s, 0, from);
    tw_track_rotation(s->track, s->key + 1, 0, to);
    *whole = tw_angle_between(from, to);
    return true;
  case TRACK_AXIS_ANGLE:
    *whole = fabs(s->track->segments.turns[s->key].change);
    return s->track->segments.turns[s->key].axis_angle == 0;
  default: return false;
  }
}

/* The part of the segment at which it has turned through `angle`. */
static double part_at(const segment *s, double whole, double angle) {
  if (s->track->kind != TRACK_NLERP) return angle / whole;
  double before = sin(angle / 2), after = sin((whole - angle) / 2);
  return before / (before + after);
}

/* Looks at the first place after the start where the sine is `peak` at the angle `at`, but for whole turns.
 */
static void look_at_peak(const segment *s, double whole, int order, double at, double peak,
                         tw_track_report *report) {
  double angle = fmod(at, 2 * PI), q[4];
  if (angle < 0) angle += 2 * PI;
  if (angle > whole || !is_nearer(fabs(peak) + 1e-9, report->gimbals[order].cos_middle)) return;
  double u = part_at(s, whole, angle);
  rotation_at(s, u, q);
  note_gimbal(s, q, u, order, report);
}

static double follow_even_turn(const segment *s, double whole, tw_track_report *report) {
  bool is_nlerp = s->track->kind == TRACK_NLERP;
  note_speed(s, is_nlerp ? 4 * tan(whole / 4) : whole, 0.5, report);
  if (whole < STILL) return whole;
  double reach = fmin(whole / 2, SAMPLE_ANGLE), q[3][4];
  for (int i = 0; i < 3; i++) rotation_at(s, part_at(s, whole, reach * i), q[i]);
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    double sines[3];
    for (int i = 0; i < 3; i++) sines[i] = sine_middle(q[i], (tw_euler_order)order);
    double b = (sines[1] - (sines[0] + sines[2]) / 2) / (1 - cos(reach));
    double c = (sines[2] - sines[0]) / (2 * sin(reach)), swing = hypot(b, c), a = sines[1] - b;
    double highest = reach + atan2(c, b);
    look_at_peak(s, whole, order, highest, a + swing, report);
    look_at_peak(s, whole, order, highest + PI, a - swing, report);
  }
  return whole;
}

/* ---- other paths, step by step ---------------------------------------------------------------------- */

typedef struct place {
  double u, q[4], sines[TW_EULER_ORDERS], stray;
} place;

static double stray_at(const segment *s, double u) {
  double path[4], straight[4];
  rotation_at(s, u, path);
  tw_arc_at(&s->slerp, u, straight);
  return tw_angle_between(path, straight);
}

static void note_stray(const segment *s, double angle, double u, tw_track_report *report) {
  if (angle <= report->stray_angle) return;
  report->stray_angle = angle;
  report->stray_time = s->start + u * s->seconds;
}

static void look(const segment *s, double u, place *out, tw_track_report *report) {
  out->u = u;
  rotation_at(s, u, out->q);
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    out->sines[order] = sine_middle(out->q, (tw_euler_order)order);
    if (is_nearer(out->sines[order], report->gimbals[order].cos_middle))
      note_gimbal(s, out->q, u, order, report);
  }
  if (!report->has_stray) return;
  out->stray = stray_at(s, u);
  note_stray(s, out->stray, u, report);
}

/* Where the parabola through three values at -1, 0 and 1 has its vertex, kept between them. */
static double vertex(const double f[3]) {
  double bend = f[0] - 2 * f[1] + f[2];
  return bend == 0 ? 0 : fmax(-1, fmin(1, (f[0] - f[2]) / (2 * bend)));
}

/* Closes in on the place between three where the sine's amount peaks. */
static void refine_gimbal(const segment *s, const place at[3], int order, tw_track_report *report) {
  double f[3] = {at[0].sines[order], at[1].sines[order], at[2].sines[order]}, reach = at[1].u - at[0].u;
  double u = at[1].u, q[4];
  for (int round = 0; round < PEAK_ROUNDS; round++) {
    u += vertex(f) * reach;
    reach /= 10;
    u = fmax(at[0].u + reach, fmin(at[2].u - reach, u));
    for (int i = 0; i < 3; i++) {
      double beside = u + (i - 1) * reach;
      rotation_at(s, beside, q);
      f[i] = sine_middle(q, (tw_euler_order)order);
      note_gimbal(s, q, beside, order, report);
    }
  }
}

/* Golden section: two keys and their angles may stray up to the half turn itself, where the way bends
 * sharply. */
static void refine_stray(const segment *s, double low, double high, tw_track_report *report) {
  static const double GOLDEN = 0.61803398874989485;
  double left = high - GOLDEN * (high - low), right = low + GOLDEN * (high - low);
  double at_left = stray_at(s, left), at_right = stray_at(s, right);
  for (int i = 0; i < GOLDEN_ROUNDS; i++) {
    if (at_left > at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - GOLDEN * (high - low);
      at_left = stray_at(s, left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + GOLDEN * (high - low);
      at_right = stray_at(s, right);
    }
  }
  note_stray(s, fmax(at_left, at_right), at_left > at_right ? left : right, report);
}

/* Looks closer where the middle one of three places may be beside a peak that counts. */
static void look_between(const segment *s, const place at[3], tw_track_report *report) {
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    double f[3], sign = at[1].sines[order] < 0 ? -1 : 1;
    for (int i = 0; i < 3; i++) f[i] = sign * at[i].sines[order];
    if (f[1] < f[0] || f[1] < f[2] || f[0] + f[2] - 2 * f[1] > -1e-12) continue;
    double peak = f[1] + (f[2] - f[0]) * vertex(f) / 4 + SINE_ROOM;
    if (is_nearer(fmin(peak, 1), report->gimbals[order].cos_middle)) refine_gimbal(s, at, order, report);
  }
  if (!report->has_stray || at[1].stray < at[0].stray || at[1].stray < at[2].stray) return;
  double room = fmax(at[1].stray - at[0].stray, at[1].stray - at[2].stray);
  if (at[1].stray + room > report->stray_angle) refine_stray(s, at[0].u, at[2].u, report);
}

/* Two places a step. Speed is taken over a window at the start of each part where many turns may hide in a
 * whole one. */
static double follow_steps(const segment *s, uint32_t steps_most, tw_track_report *report) {
  double guess = tw_track_travel(s->track, s->key), travelled = 0, beside[4];
  double steps = fmin(fmax(STEPS_LEAST, ceil(guess / STEP_ANGLE)), steps_most);
  uint32_t count = 2 * (uint32_t)steps;
  double part = 1.0 / count, window = guess * part > STEP_ANGLE ? STEP_ANGLE / guess : part;
  place at[3];
  look(s, 0, &at[1], report);
  for (uint32_t i = 1; i <= count; i++) {
    look(s, i == count ? 1 : i * part, &at[2], report);
    const double *next = at[2].q;
    if (window < part) {
      rotation_at(s, at[1].u + window, beside);
      next = beside;
    }
    double speed = tw_angle_between(at[1].q, next) / window;
    note_speed(s, speed, at[1].u + window / 2, report);
    travelled += speed * part;
    if (i > 1) look_between(s, at, report);
    memmove(at, at + 1, 2 * sizeof *at);
  }
  return travelled;
}

/* ---- whole tracks ----------------------------------------------------------------------------------- */

static tw_arc short_arc(const double a[4], const double b[4]) {
  double sign = quat_dot(a, b) < 0 ? -1 : 1;
  const double nearer[4] = {b[0] * sign, b[1] * sign, b[2] * sign, b[3] * sign};
  return tw_arc_between(a, nearer);
}

static double follow_segment(segment *s, uint32_t steps_most, tw_track_report *report) {
  double here[4], next[4], whole;
  rotation_at(s, 0, here);
  tw_track_rotation(s->track, s->key + 1, 0, next);
  if (s->track->holds) return tw_angle_between(here, next);
  if (is_even_turn(s, &whole)) return follow_even_turn(s, whole, report);
  if (report->has_stray) s->slerp = short_arc(here, next);
  return follow_steps(s, steps_most, report);
}

static void note_step(const tw_track *track, uint32_t key, double travelled, tw_track_report *report) {
  report->total_angle += travelled;
  if (travelled > report->largest_step * MORE) {
    report->largest_step = travelled;
    report->largest_key = key;
  }
  if (track->holds) return;
  if (travelled > PI * (1 + 1e-6))
    report->long_steps++;
  else if (tw_track_turn(track, key) == TURN_HALF)
    report->half_turns++;
}

void tw_track_follow(const tw_track *track, uint32_t steps_most, tw_track_report *report) {
  uint32_t last = track->timeline->key_count - 1;
  for (int order = 0; order < TW_EULER_ORDERS; order++) report->gimbals[order].cos_middle = INFINITY;
  for (uint32_t key = 0; key <= last; key++) {
    segment s = {.track = track,
                 .key = key,
                 .start = (double)track->timeline->times[key],
                 .seconds = key < last ? tw_track_seconds(track, key) : 0};
    double q[4];
    rotation_at(&s, 0, q);
    for (int order = 0; order < TW_EULER_ORDERS; order++) note_gimbal(&s, q, 0, order, report);
    if (key < last) note_step(track, key, follow_segment(&s, steps_most, report), report);
  }
}
