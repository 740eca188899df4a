/* What a rotation track's path tells, and what its keys hide. */
#include "tweend/trackinfo.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "clip.h"
#include "trackpath.h"

static const double PI = 3.14159265358979323846;
static const double UNIT_TOLERANCE = 1e-5;
static const double SIGN_ROOM = 1e-6; /* about half turns neither sign is the opposite one */
static const double LOCKED = 1e-7;    /* nearer to lock is lock */

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
    gimbal->cos_middle = gimbal->cos_middle < LOCKED ? 0 : fmin(gimbal->cos_middle, 1);
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

/* A sentence that begins with a number of things, none for 0: "1 key", "2 keys". */
static void warn_of_count(tw_track_report *report, uint32_t count, const char *thing, const char *rest) {
  if (count > 0)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE, "%u %s%s %s", count, thing, count > 1 ? "s" : "",
             rest);
}

static void warn_of_all(const tw_track_keys *keys, tw_track_report *report) {
  const tw_gimbal *own = &report->gimbals[report->order], *best = &report->gimbals[report->best_order];
  warn_of_count(report, report->non_unit_keys, "key", "not of unit length: normalised");
  warn_of_count(report, report->sign_flips, "key",
                "with the opposite sign of the key before: the short way is taken all the same");
  warn_of_count(report, report->half_turns, "step",
                "of exactly 180 degrees: quaternions turn either way as far, which one is arbitrary");
  if (report->long_steps)
    snprintf(next_warning(report), TW_TRACK_WARNING_SIZE,
             "%u step%s of more than 180 degrees, the largest %.6g: quaternions would cut them short",
             report->long_steps, report->long_steps > 1 ? "s" : "", degrees(report->largest_step));
  warn_of_count(report, report->euler_wraps, "step",
                "in which an Euler angle changes by more than 180 degrees");
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

static void inspect(const tw_track_keys *keys, const tw_clip *clip, uint32_t steps_most,
                    tw_track_report *report) {
  uint32_t last = keys->key_count - 1;
  *report = (tw_track_report){.key_count = keys->key_count,
                              .start = (double)keys->times[0],
                              .duration = (double)keys->times[last] - (double)keys->times[0],
                              .order = keys->form == TW_KEY_EULER ? keys->order : TW_XYZ,
                              .has_stray = keys->interpolation == TW_EULER};
  report->peak_time = report->stray_time = report->start;
  report->lost_axis = tw_euler_axes[report->order][2];
  tw_track_follow(&clip->tracks[0], steps_most, report);
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
  return TW_OK;
}
