/* Diagnoses a rotation track: how far and how fast its path turns, how near it comes to gimbal lock, and
 * which of its keys are doubtful.
 *
 * A rotation that turns evenly about one axis moves every entry of its matrix as A + B cos x + C sin x, so
 * for slerp and turns about a fixed axis the places nearest to lock have a closed form. Other paths are
 * followed in steps small enough that the parabola through three places shows where the sine of the middle
 * angle peaks. */

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "angle.h"
#include "clip.h"

static const double STEP_ANGLE = TW_PI / 36;
static const double SAMPLE_ANGLE = 1; /* largest angle between the samples that give A, B and C */
static const double STILL = 1e-4;     /* a smaller turn is nearest to lock at an end, within 1e-9 */
static const double SINE_ROOM = 1e-5; /* error of a parabola over one step */
static const double MORE = 1 + 1e-9;  /* factor by which a value must exceed the largest so far */
static const double NEARER = 1e-12;   /* likewise below the least cosine; the first of equals counts */
static const double UNIT_TOLERANCE = 1e-5;
static const double SIGN_ROOM = 1e-6; /* near a half turn neither sign counts as opposite */
static const double LOCKED = 1e-7;    /* cosines that differ by less count as equal */

enum { STEPS_LEAST = 4, PEAK_ROUNDS = 3, GOLDEN_ROUNDS = 40 };
enum { KEY_WORK = 200, STEP_WORK = 200 }; /* steps of tw_work, about */

/* The sine of the order's middle angle. */
static double sine_middle(const double q[4], tw_euler_order order) {
  const unsigned char *axes = tw_euler_axes[order];
  return 2 * (q[3] * q[axes[1]] + euler_sign(order) * (q[axes[0]] * q[axes[2]])) / quat_dot(q, q);
}

typedef struct segment {
  const tw_track *track;
  uint32_t key;
  double start, seconds;
  double here[4], next[4]; /* the keys; next: none behind the last */
  bool may_stray;          /* the path may stray from slerp further than any before */
  tw_arc slerp;            /* between the keys, only where may_stray is set */
} segment;

static void rotation_at(const segment *s, double u, double out[4]) {
  tw_track_rotation(s->track, s->key, u, out);
}

/* Whether a middle angle with this sine could be nearer to lock than the least cosine so far. */
static bool is_nearer(double sine, double least) {
  return 1 - sine * sine < least * least + 1e-12;
}

static void note_gimbal(const segment *s, const double q[4], double u, int order, tw_track_report *report) {
  tw_gimbal *gimbal = &report->gimbals[order];
  double cosine = tw_euler_cos_middle(q, (tw_euler_order)order);
  if (cosine >= gimbal->cos_middle - NEARER) return;
  gimbal->cos_middle = cosine;
  gimbal->time = s->start + u * s->seconds;
}

/* Notes the gimbals of all orders that a place may be nearest to. */
static void note_place(const segment *s, const double q[4], double u, double sines[TW_EULER_ORDERS],
                       tw_track_report *report) {
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    sines[order] = sine_middle(q, (tw_euler_order)order);
    if (is_nearer(sines[order], report->gimbals[order].cos_middle)) note_gimbal(s, q, u, order, report);
  }
}

static void note_speed(const segment *s, double speed, double u, tw_track_report *report) {
  if (speed <= report->peak_velocity * s->seconds * MORE) return;
  report->peak_velocity = speed / s->seconds;
  report->peak_time = s->start + u * s->seconds;
}

/* ---- even turns about one axis --------------------------------------------------------------- */

/* Whether the segment turns about one fixed axis. *whole: the angle it turns through. */
static bool is_even_turn(const segment *s, double *whole) {
  switch (s->track->kind) {
  case TRACK_ARC:
  case TRACK_NLERP: *whole = tw_angle_between(s->here, s->next); return true;
  case TRACK_AXIS_ANGLE:
    *whole = fabs(s->track->segments.turns[s->key].change);
    return s->track->segments.turns[s->key].axis_angle == 0;
  default: return false;
  }
}

/* The part of the segment after which it has turned through `angle`. */
static double part_at(const segment *s, double whole, double angle) {
  if (s->track->kind != TRACK_NLERP) return angle / whole;
  double before = sin(angle / 2), after = sin((whole - angle) / 2);
  return before / (before + after);
}

/* Records the place where the segment has turned through `at` modulo 2 pi, where the sine of the middle angle
 * peaks at `peak`. */
static void look_at_peak(const segment *s, double whole, int order, double at, double peak,
                         tw_track_report *report) {
  double angle = fmod(at, 2 * TW_PI), q[4];
  if (angle < 0) angle += 2 * TW_PI;
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
    look_at_peak(s, whole, order, highest + TW_PI, a - swing, report);
  }
  return whole;
}

/* ---- other paths, step by step --------------------------------------------------------------- */

typedef struct place {
  double u, q[4], sines[TW_EULER_ORDERS], stray;
} place;

/* path: the rotation at u. */
static double stray_from(const segment *s, double u, const double path[4]) {
  double straight[4];
  tw_arc_at(&s->slerp, u, straight);
  return tw_angle_between(path, straight);
}

static double stray_at(const segment *s, double u) {
  double path[4];
  rotation_at(s, u, path);
  return stray_from(s, u, path);
}

static void note_stray(const segment *s, double angle, double u, tw_track_report *report) {
  if (angle <= report->stray_angle) return;
  report->stray_angle = angle;
  report->stray_time = s->start + u * s->seconds;
}

static void look(const segment *s, double u, place *out, tw_track_report *report) {
  out->u = u;
  if (u == 0)
    memcpy(out->q, s->here, sizeof out->q);
  else
    rotation_at(s, u, out->q);
  note_place(s, out->q, u, out->sines, report);
  if (!s->may_stray) return;
  out->stray = stray_from(s, u, out->q);
  note_stray(s, out->stray, u, report);
}

/* The position of the vertex of the parabola through three values at -1, 0 and 1, clamped to this range. */
static double vertex(const double f[3]) {
  double bend = f[0] - 2 * f[1] + f[2];
  return bend == 0 ? 0 : fmax(-1, fmin(1, (f[0] - f[2]) / (2 * bend)));
}

/* Refines the place among three where the sine's magnitude peaks. */
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

/* Refines the largest stray by golden section: near 180 degrees the path bends too sharply for a parabola. */
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

/* Refines where the middle one of three places is near a peak that could count. */
static void look_between(const segment *s, const place at[3], tw_track_report *report) {
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    double f[3], sign = at[1].sines[order] < 0 ? -1 : 1;
    for (int i = 0; i < 3; i++) f[i] = sign * at[i].sines[order];
    if (f[1] < f[0] || f[1] < f[2] || f[0] + f[2] - 2 * f[1] > -1e-12) continue;
    double peak = f[1] + (f[2] - f[0]) * vertex(f) / 4 + SINE_ROOM;
    if (is_nearer(fmin(peak, 1), report->gimbals[order].cos_middle)) refine_gimbal(s, at, order, report);
  }
  if (!s->may_stray || at[1].stray < at[0].stray || at[1].stray < at[2].stray) return;
  double room = fmax(at[1].stray - at[0].stray, at[1].stray - at[2].stray);
  if (at[1].stray + room > report->stray_angle) refine_stray(s, at[0].u, at[2].u, report);
}

/* Follows a segment with two places for each step. Where a step may hide whole turns, speed is measured over
 * a short window at its start. Ends early where the result is no longer wanted. */
static double follow_steps(const segment *s, uint32_t steps_most, tw_track_report *report) {
  double guess = tw_track_travel(s->track, s->key), travelled = 0, beside[4];
  double steps = fmin(fmax(STEPS_LEAST, ceil(guess / STEP_ANGLE)), steps_most);
  uint32_t count = 2 * (uint32_t)steps;
  double part = 1.0 / count, window = guess * part > STEP_ANGLE ? STEP_ANGLE / guess : part;
  place at[3];
  look(s, 0, &at[1], report);
  for (uint32_t i = 1; i <= count && tw_work(STEP_WORK); i++) {
    look(s, i == count ? 1 : i * part, &at[2], report);
    const double *next = at[2].q;
    if (window < part) {
      rotation_at(s, at[1].u + window, beside);
      next = beside;
    }
    double speed = tw_track_angle(s->track, at[1].q, next) / window;
    note_speed(s, speed, at[1].u + window / 2, report);
    travelled += speed * part;
    if (i > 1) look_between(s, at, report);
    memmove(at, at + 1, 2 * sizeof *at);
  }
  return travelled;
}

/* A bound on how far three angles that change by `travel` in all stray from slerp. Their axes turn by at most
 * that, so the angular velocity changes by at most travel^2 / 2: the path bends away from the straight one by
 * an eighth of it, as a parabola from its chord. Twice that leaves room for the bend of space. */
static double stray_bound(double travel) {
  static const double SMALL = 0.5, ROUNDING = 1e-9;
  return travel < SMALL ? travel * travel / 8 + ROUNDING : INFINITY;
}

/* ---- whole tracks ---------------------------------------------------------------------------- */

static double follow_segment(segment *s, uint32_t steps_most, tw_track_report *report) {
  double whole;
  if (s->track->holds) return tw_angle_between(s->here, s->next);
  if (is_even_turn(s, &whole)) return follow_even_turn(s, whole, report);
  s->may_stray = report->has_stray && stray_bound(tw_track_travel(s->track, s->key)) > report->stray_angle;
  if (s->may_stray) s->slerp = tw_arc_short(s->here, s->next);
  return follow_steps(s, steps_most, report);
}

static void note_step(const tw_track *track, uint32_t key, double travelled, tw_track_report *report) {
  report->total_angle += travelled;
  if (travelled > report->largest_step * MORE) {
    report->largest_step = travelled;
    report->largest_key = key;
  }
  if (track->holds) return;
  if (travelled > TW_PI * (1 + 1e-6))
    report->long_steps++;
  else if (tw_track_turn(track, key) == TURN_HALF)
    report->half_turns++;
}

/* Fills in what the path shows, into a zeroed report: angles, speed, half turns, long steps, each order's
 * cosine and its time, and the stray where has_stray is set. A segment is followed in at most steps_most (at
 * least 1) steps. Ends early where the result is no longer wanted. */
static void follow_track(const tw_track *track, uint32_t steps_most, tw_track_report *report) {
  uint32_t last = track->timeline->key_count - 1;
  for (int order = 0; order < TW_EULER_ORDERS; order++) report->gimbals[order].cos_middle = INFINITY;
  segment s = {.track = track};
  tw_track_rotation(track, 0, 0, s.here);
  for (uint32_t key = 0; key <= last && tw_work(KEY_WORK); key++) {
    double sines[TW_EULER_ORDERS];
    s.key = key;
    s.start = (double)track->timeline->times[key];
    s.seconds = key < last ? tw_track_seconds(track, key) : 0;
    note_place(&s, s.here, 0, sines, report);
    if (key == last) break;
    tw_track_rotation(track, key + 1, 0, s.next);
    note_step(track, key, follow_segment(&s, steps_most, report), report);
    memcpy(s.here, s.next, sizeof s.here);
  }
}

/* ---- reading the keys ------------------------------------------------------------------------ */

static void read_quaternions(const tw_track_keys *keys, tw_track_report *report) {
  bool cubic = keys->interpolation == TW_CUBICSPLINE;
  double before[4] = {0, 0, 0, 0}, q[4];
  for (uint32_t key = 0; key < keys->key_count; key++) {
    quat_widen(keys->values + 4 * (cubic ? 3 * (size_t)key + 1 : (size_t)key), q);
    if (fabs(tw_normalize(q, 4) - 1) > UNIT_TOLERANCE) report->non_unit_keys++;
    double cosine = quat_dot(before, q);
    if (cosine < -SIGN_ROOM) report->sign_flips++;
    memcpy(before, q, sizeof before);
  }
}

static void read_eulers(const tw_track_keys *keys, tw_track_report *report) {
  for (uint32_t key = 1; key < keys->key_count; key++) {
    const double *before = keys->angles + 3 * (size_t)(key - 1), *angles = before + 3;
    bool wraps = false;
    for (int i = 0; i < 3; i++) wraps = wraps || fabs(angles[i] - before[i]) > TW_PI;
    report->euler_wraps += wraps;
  }
}

static void choose_order(tw_track_report *report) {
  report->best_order = report->order;
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    tw_gimbal *gimbal = &report->gimbals[order];
    gimbal->cos_middle = euler_cos_told(gimbal->cos_middle);
    gimbal->amplification = gimbal->cos_middle > 0 ? 1 / gimbal->cos_middle : INFINITY;
    if (gimbal->cos_middle > report->gimbals[report->best_order].cos_middle + LOCKED)
      report->best_order = (tw_euler_order)order;
  }
}

/* ---- sentences ------------------------------------------------------------------------------- */

/* Never overflows: there are as many places as kinds of warnings. */
static char *next_warning(tw_track_report *report) {
  return report->warnings[report->warning_count++];
}

static double degrees(double radians) {
  return radians * 180 / TW_PI;
}

/* Adds a sentence that begins with a count: "1 key", "2 keys"; none for 0. */
static void warn_of_count(tw_track_report *report, uint32_t count, const char *thing, const char *rest) {
  if (count > 0)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE, "%u %s%s %s", count, thing,
             tw_plural(count, "", "s"), rest);
}

static void warn_of_all(const tw_track_keys *keys, tw_track_report *report) {
  const tw_gimbal *own = &report->gimbals[report->order], *best = &report->gimbals[report->best_order];
  bool is_spline = keys->interpolation == TW_CUBICSPLINE;
  warn_of_count(report, report->non_unit_keys, "key",
                is_spline ? "not of unit length: the spline is normalised, not its keys"
                          : "not of unit length: normalised");
  warn_of_count(report, report->duplicate_times, "key",
                "at the time of the key before: the rotation jumps there");
  warn_of_count(report, report->sign_flips, "key",
                is_spline ? "with the opposite sign of the key before: the spline is taken as it is written"
                          : "with the opposite sign of the key before: the short way is taken all the same");
  warn_of_count(report, report->half_turns, "step",
                "of exactly 180 degrees: quaternions turn either way as far, which one is arbitrary");
  if (report->long_steps)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "%u %s of more than 180 degrees, the largest %.6g: %s would cut them short", report->long_steps,
             tw_plural(report->long_steps, "step", "steps"), degrees(report->largest_step),
             is_spline ? "LINEAR keys" : "quaternions");
  warn_of_count(report, report->euler_wraps, "step",
                "in which an Euler angle changes by more than 180 degrees");
  if (keys->form == TW_KEY_EULER && own->cos_middle < 0.1)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "at %.6g s order %s is %.3g degrees from gimbal lock; order %s stays %.3g degrees away",
             own->time, tw_euler_order_names[report->order], degrees(asin(own->cos_middle)),
             tw_euler_order_names[report->best_order], degrees(asin(best->cos_middle)));
  if (report->has_stray && report->stray_angle > TW_PI / 180)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "at %.6g s interpolating each angle on its own is %.6g degrees away from slerp",
             report->stray_time, degrees(report->stray_angle));
}

static void inspect(const tw_track_keys *keys, const tw_clip *clip, uint32_t steps_most,
                    tw_track_report *report) {
  uint32_t last = keys->key_count - 1;
  *report = (tw_track_report){.key_count = keys->key_count,
                              .start = (double)keys->times[0],
                              .duration = (double)keys->times[last] - (double)keys->times[0],
                              .duplicate_times = keys->duplicate_times,
                              .order = keys->form == TW_KEY_EULER ? keys->order : TW_XYZ,
                              .has_stray = keys->interpolation == TW_EULER};
  report->peak_time = report->stray_time = report->start;
  report->lost_axis = tw_euler_axes[report->order][2];
  follow_track(&clip->tracks[0], steps_most, report);
  if (keys->form == TW_KEY_EULER) read_eulers(keys, report);
  if (!keys->angles) read_quaternions(keys, report);
  choose_order(report);
  warn_of_all(keys, report);
}

tw_status tw_track_inspect(const tw_track_keys *keys, uint32_t steps_most, tw_track_report *out,
                           tw_error *error) {
  tw_track_keys alone = *keys;
  tw_clip_keys clip_keys = {.track_count = 1, .tracks = &alone};
  tw_clip *clip;
  alone.node = 0;
  if (keys->path != TW_ROTATION) return tw_fail(error, TW_INVALID, "only rotation tracks are inspected");
  tw_status status = tw_clip_create(&clip_keys, 1, -1, &clip, error);
  if (status != TW_OK) return status;
  inspect(keys, clip, steps_most, out);
  tw_clip_destroy(clip);
  return tw_work_status(error);
}
