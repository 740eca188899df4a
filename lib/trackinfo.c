/* Follows a rotation track's path in small steps, and reads its keys for what they hide. */
#include "tweend/trackinfo.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "clip.h"
#include "turns.h"

static const double PI = 3.14159265358979323846;
static const double STEP_ANGLE = 3.14159265358979323846 / 36;
static const double UNIT_TOLERANCE = 1e-5;
static const double SIGN_ROOM = 1e-6; /* about half turns neither sign is the opposite one */
static const double LOCKED = 1e-7;    /* nearer to lock is not worth looking for */

enum { STEPS_MIN = 4, STEPS_MAX = 512, REFINEMENTS = 40 };

/* |cos| of the middle angle: the product of the pairs in euler.c, precise up to lock itself. */
static double cos_middle(const double q[4], tw_euler_order order) {
  const unsigned char *axes = tw_euler_axes[order];
  bool even = (axes[0] + 1) % 3 == axes[1];
  double i = q[axes[0]], j = q[axes[1]], k = even ? q[axes[2]] : -q[axes[2]], w = q[3];
  return sqrt(((w + j) * (w + j) + (i + k) * (i + k)) * ((w - j) * (w - j) + (i - k) * (i - k))) /
         quat_dot(q, q);
}

/* ---- functions along one segment, and the place where they are least --------------------------- */

typedef struct segment {
  const tw_track *track;
  uint32_t key;
  tw_arc slerp; /* between the same keys */
} segment;

typedef struct measure {
  const segment *segment;
  int order; /* cos_middle of this order; -1 for how near the path is to slerp */
} measure;

static double stray(const segment *segment, double u) {
  double path[4], straight[4];
  tw_track_rotation(segment->track, segment->key, u, path);
  tw_arc_at(&segment->slerp, u, straight);
  return tw_angle_between(path, straight);
}

static double measure_at(const measure *measure, double u) {
  double q[4];
  if (measure->order < 0) return -stray(measure->segment, u);
  tw_track_rotation(measure->segment->track, measure->segment->key, u, q);
  return cos_middle(q, (tw_euler_order)measure->order);
}

/* Golden section; `u` becomes the place of the least value in [low, high], which is returned. */
static double least(const measure *measure, double low, double high, double *u) {
  static const double GOLDEN = 0.61803398874989485;
  double left = high - GOLDEN * (high - low), right = low + GOLDEN * (high - low);
  double at_left = measure_at(measure, left), at_right = measure_at(measure, right);
  for (int i = 0; i < REFINEMENTS; i++) {
    if (at_left < at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - GOLDEN * (high - low);
      at_left = measure_at(measure, left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + GOLDEN * (high - low);
      at_right = measure_at(measure, right);
    }
  }
  *u = at_left < at_right ? left : right;
  return fmin(at_left, at_right);
}

/* ---- following the path ------------------------------------------------------------------------- */

static double segment_time(const segment *segment, double u) {
  return (double)segment->track->timeline->times[segment->key] +
         u * tw_track_seconds(segment->track, segment->key);
}

static void note_gimbal(tw_track_report *report, int order, double cosine, double time) {
  tw_gimbal *gimbal = &report->gimbals[order];
  if (cosine >= gimbal->cos_middle) return;
  gimbal->cos_middle = cosine;
  gimbal->time = time;
}

/* The middle angle changes no faster than the rotation, so between two samples its cosine goes below them by
 * at most what is travelled there: only where that could beat the least so far is it searched. */
static void search_gimbals(const segment *segment, double low, double high, double travelled,
                           double cosines[2][TW_EULER_ORDERS], tw_track_report *report) {
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    double bound = (cosines[0][order] + cosines[1][order] - travelled) / 2, u;
    note_gimbal(report, order, cosines[1][order], segment_time(segment, high));
    if (bound >= report->gimbals[order].cos_middle || report->gimbals[order].cos_middle < LOCKED) continue;
    measure measure = {segment, order};
    double cosine = least(&measure, low, high, &u);
    note_gimbal(report, order, cosine, segment_time(segment, u));
  }
}

static void search_stray(const segment *segment, double low, double high, tw_track_report *report) {
  double room = (high - low) / 2, at = stray(segment, (low + high) / 2), u;
  if (at <= report->stray_angle) return;
  measure measure = {segment, -1};
  report->stray_angle = -least(&measure, fmax(0, low - room), fmin(1, high + room), &u);
  report->stray_time = segment_time(segment, u);
}

static void note_step(tw_track_report *report, uint32_t key, double travelled) {
  report->total_angle += travelled;
  if (travelled > report->largest_step) {
    report->largest_step = travelled;
    report->largest_key = key;
  }
}

static void cos_middles(const double q[4], double out[TW_EULER_ORDERS]) {
  for (int order = 0; order < TW_EULER_ORDERS; order++) out[order] = cos_middle(q, (tw_euler_order)order);
}

/* Speed is taken over a window at the start of each step, as many turns may hide in a whole one. */
static double follow_segment(const segment *segment, tw_track_report *report) {
  const tw_track *track = segment->track;
  double guess = tw_track_travel(track, segment->key), seconds = tw_track_seconds(track, segment->key);
  int count = (int)fmax(STEPS_MIN, ceil(fmin(guess / STEP_ANGLE, STEPS_MAX)));
  double window = guess > STEP_ANGLE * count ? STEP_ANGLE / guess : 1.0 / count, travelled = 0;
  double start[4], beside[4], end[4], cosines[2][TW_EULER_ORDERS];
  tw_track_rotation(track, segment->key, 0, start);
  cos_middles(start, cosines[0]);
  for (int i = 1; i <= count; i++) {
    double low = (double)(i - 1) / count, high = (double)i / count;
    tw_track_rotation(track, segment->key, low + window, beside);
    tw_track_rotation(track, segment->key, high, end);
    double speed = tw_angle_between(start, beside) / window;
    if (speed > report->peak_velocity * seconds) {
      report->peak_velocity = speed / seconds;
      report->peak_time = segment_time(segment, low + window / 2);
    }
    travelled += speed / count;
    cos_middles(end, cosines[1]);
    search_gimbals(segment, low, high, speed / count, cosines, report);
    if (report->has_stray) search_stray(segment, low, high, report);
    memcpy(start, end, sizeof start);
    memcpy(cosines[0], cosines[1], sizeof cosines[0]);
  }
  return travelled;
}

static tw_arc short_arc(const double a[4], const double b[4]) {
  double sign = quat_dot(a, b) < 0 ? -1 : 1;
  const double nearer[4] = {b[0] * sign, b[1] * sign, b[2] * sign, b[3] * sign};
  return tw_arc_between(a, nearer);
}

static void follow_path(const tw_track *track, bool jumps, tw_track_report *report) {
  uint32_t last = report->key_count - 1;
  double here[4], next[4], cosines[TW_EULER_ORDERS];
  for (uint32_t key = 0; key <= last; key++) {
    segment segment = {.track = track, .key = key};
    tw_track_rotation(track, key, 0, here);
    cos_middles(here, cosines);
    for (int order = 0; order < TW_EULER_ORDERS; order++)
      note_gimbal(report, order, cosines[order], segment_time(&segment, 0));
    if (key == last) break;
    tw_track_rotation(track, key + 1, 0, next);
    if (jumps) {
      note_step(report, key, tw_angle_between(here, next));
      continue;
    }
    segment.slerp = short_arc(here, next);
    double travelled = follow_segment(&segment, report);
    note_step(report, key, travelled);
    if (travelled > PI * (1 + 1e-6))
      report->long_steps++;
    else if (tw_track_turn(track, key) == TURN_HALF)
      report->half_turns++;
  }
}

/* ---- reading the keys ----------------------------------------------------------------------------- */

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
    for (int i = 0; i < 3; i++) wraps = wraps || fabs(angles[i] - before[i]) > PI;
    report->euler_wraps += wraps;
  }
}

static void choose_order(tw_track_report *report) {
  report->best_order = report->order;
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    tw_gimbal *gimbal = &report->gimbals[order];
    gimbal->cos_middle = fmin(gimbal->cos_middle, 1);
    gimbal->amplification = gimbal->cos_middle > 0 ? 1 / gimbal->cos_middle : INFINITY;
    if (gimbal->cos_middle > report->gimbals[report->best_order].cos_middle + LOCKED)
      report->best_order = (tw_euler_order)order;
  }
}

/* ---- sentences -------------------------------------------------------------------------------------- */

/* Room for one more; there are fewer sentences than places. */
static char *next_warning(tw_track_report *report) {
  return report->warnings[report->warning_count++];
}

static double degrees(double radians) {
  return radians * 180 / PI;
}

static void warn_of_all(const tw_track_keys *keys, tw_track_report *report) {
  const tw_gimbal *own = &report->gimbals[report->order], *best = &report->gimbals[report->best_order];
  if (report->non_unit_keys)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "%u keys are not of unit length and were normalised", report->non_unit_keys);
  if (report->sign_flips)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "%u keys have the opposite sign of the key before; the short way is taken all the same",
             report->sign_flips);
  if (report->half_turns)
    snprintf(
        next_warning(report), TW_TRACK_WARNING_SIZE,
        "%u steps are of exactly 180 degrees: quaternions turn either way as far, which one is arbitrary",
        report->half_turns);
  if (report->long_steps)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "%u steps turn more than 180 degrees, the largest %.6g: as quaternions they would be cut short",
             report->long_steps, degrees(report->largest_step));
  if (report->euler_wraps)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "%u steps change an Euler angle by more than 180 degrees", report->euler_wraps);
  if (keys->form == TW_KEY_EULER && own->cos_middle < 0.1)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "at %.6g s order %s is %.3g degrees from gimbal lock; order %s stays %.3g degrees away",
             own->time, tw_euler_order_names[report->order], degrees(asin(own->cos_middle)),
             tw_euler_order_names[report->best_order], degrees(asin(best->cos_middle)));
  if (report->has_stray && report->stray_angle > PI / 180)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "at %.6g s interpolating each angle on its own is %.6g degrees away from slerp",
             report->stray_time, degrees(report->stray_angle));
}

static void inspect(const tw_track_keys *keys, const tw_clip *clip, tw_track_report *report) {
  uint32_t last = keys->key_count - 1;
  *report = (tw_track_report){.key_count = keys->key_count,
                              .start = (double)keys->times[0],
                              .duration = (double)keys->times[last] - (double)keys->times[0],
                              .order = keys->form == TW_KEY_EULER ? keys->order : TW_XYZ,
                              .has_stray = keys->interpolation == TW_EULER};
  report->peak_time = report->stray_time = report->start;
  report->lost_axis = tw_euler_axes[report->order][2];
  for (int order = 0; order < TW_EULER_ORDERS; order++) report->gimbals[order].cos_middle = INFINITY;
  follow_path(&clip->tracks[0], keys->interpolation == TW_STEP, report);
  if (keys->form == TW_KEY_EULER) read_eulers(keys, report);
  if (!keys->angles) read_quaternions(keys, report);
  choose_order(report);
  warn_of_all(keys, report);
}

tw_status tw_track_inspect(const tw_track_keys *keys, tw_track_report *out, tw_error *error) {
  tw_track_keys alone = *keys;
  tw_clip_keys clip_keys = {.track_count = 1, .tracks = &alone};
  tw_clip *clip;
  alone.node = 0;
  if (keys->path != TW_ROTATION) return tw_fail(error, TW_INVALID, "only rotation tracks are inspected");
  tw_status status = tw_clip_create(&clip_keys, 1, -1, &clip, error);
  if (status != TW_OK) return status;
  inspect(keys, clip, out);
  tw_clip_destroy(clip);
  return TW_OK;
}
