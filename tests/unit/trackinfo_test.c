/* What the inspection of rotation tracks finds. */
#include <string.h>

#include "keys.h"
#include "rotation_reference.h"

static const float times_0_to_3[] = {0, 1, 2, 3};

static tw_track_report inspect(tw_track_keys keys) {
  tw_track_report report;
  tw_error error;
  if (tw_track_inspect(&keys, TW_TRACK_STEPS, &report, &error) != TW_OK)
    fail_msg("%s: %s", error.pointer, error.detail);
  return report;
}

static void assert_near(double value, double expected, double tolerance) {
  if (!(fabs(value - expected) <= tolerance))
    fail_msg("%.9g is not %.9g within %g", value, expected, tolerance);
}

TEST(only_sound_rotation_tracks_are_inspected) {
  const float zero[8] = {0};
  tw_track_keys keys = quaternion_keys(TW_LINEAR, times_0_to_3, zero, 2);
  tw_track_report report;
  tw_error error;
  assert_int_equal(tw_track_inspect(&keys, TW_TRACK_STEPS, &report, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/tracks/0/quaternions/0");
  keys.path = TW_TRANSLATION;
  assert_int_equal(tw_track_inspect(&keys, TW_TRACK_STEPS, &report, &error), TW_INVALID);
}

TEST(minus_170_to_170_strays_half_a_turn_from_slerp) {
  const double angles[] = {-170 * REF_DEGREES, 0, 0, 170 * REF_DEGREES, 0, 0};
  tw_track_report report = inspect(euler_keys(TW_XYZ, times_0_to_3, angles, 2));
  assert_int_equal(report.euler_wraps, 1);
  assert_int_equal(report.long_steps, 1);
  assert_near(report.total_angle, 340 * REF_DEGREES, 1e-6);
  assert_near(report.largest_step, 340 * REF_DEGREES, 1e-6);
  assert_near(report.peak_velocity, 340 * REF_DEGREES, 1e-6);
  assert_true(report.has_stray);
  assert_near(report.stray_angle, REF_PI, 1e-6); /* 0 against 180 at the middle */
  assert_near(report.stray_time, 0.5, 1e-6);
  assert_near(report.gimbals[TW_XYZ].cos_middle, 1,
              1e-9); /* x is the first axis of XYZ and its middle never moves */
  assert_near(report.gimbals[TW_YXZ].cos_middle, 0, 1e-6); /* but the middle of YXZ */
  assert_true(report.warning_count >= 2);
}

/* Whatever comes before it: segments that cannot stray further than those before are not followed for it. */
TEST(the_farthest_stray_is_that_of_the_segments_alone) {
  uint32_t seed = 1;
  for (int round = 0; round < 300; round++) {
    double angles[9], size = round % 2 ? 0.4 : 0.02;
    for (int i = 0; i < 9; i++) {
      seed = seed * 1664525u + 1013904223u;
      double signed_one = (double)seed / 2147483648.0 - 1;
      angles[i] = i < 3 ? 3 * signed_one : angles[i - 3] + size * signed_one;
    }
    tw_track_report first = inspect(euler_keys(TW_XYZ, times_0_to_3, angles, 2));
    tw_track_report second = inspect(euler_keys(TW_XYZ, times_0_to_3, angles + 3, 2));
    double farthest = first.stray_angle > second.stray_angle ? first.stray_angle : second.stray_angle;
    assert_true(inspect(euler_keys(TW_XYZ, times_0_to_3, angles, 3)).stray_angle == farthest);
  }
}

TEST(lock_between_keys_is_found_with_its_time_in_every_order) {
  for (tw_euler_order order = TW_XYZ; order <= TW_ZYX; order++) {
    const char *letters = tw_euler_order_names[order];
    double angles[6] = {0};
    angles[letters[0] - 'X'] = 0.3;
    angles[3 + letters[0] - 'X'] = 0.3;
    angles[letters[1] - 'X'] = 60 * REF_DEGREES;
    angles[3 + letters[1] - 'X'] = 160 * REF_DEGREES;
    tw_track_report report = inspect(euler_keys(order, times_0_to_3, angles, 2));
    assert_near(report.gimbals[order].cos_middle, 0, 1e-6);
    assert_near(report.gimbals[order].time, 0.3, 1e-6);
    assert_true(report.gimbals[order].amplification > 1e6);
    assert_int_equal(report.lost_axis, letters[2] - 'X');
    assert_int_not_equal(report.best_order, order);
  }
}

TEST(the_nearest_place_to_lock_may_lie_between_keys_without_lock) {
  /* Two headings 80 degrees apart, the nose up at 70 in both: the straight way leads nearer to the pole. */
  float values[2][4];
  for (int i = 0; i < 2; i++) {
    double angles[] = {70 * REF_DEGREES, (i ? 40 : -40) * REF_DEGREES, (i ? 40 : -40) * REF_DEGREES};
    ref_narrow(ref_euler_quat(angles, TW_YXZ), values[i]);
  }
  tw_track_report report = inspect(quaternion_keys(TW_LINEAR, times_0_to_3, values[0], 2));
  double expected = 2;
  for (int i = 0; i <= 100000; i++) {
    ref_matrix m = ref_matrix_of(ref_slerp(ref_of(values[0]), ref_of(values[1]), i / 1e5));
    double sine = m.at[1][2]; /* YXZ: R12 = -sin of the middle angle */
    expected = fmin(expected, sqrt(1 - sine * sine));
  }
  assert_true(expected < cos(70 * REF_DEGREES) - 0.01);
  assert_near(report.gimbals[TW_YXZ].cos_middle, expected, 1e-6);
  assert_near(report.gimbals[TW_YXZ].time, 0.5, 1e-3);
  assert_int_equal(report.order, TW_XYZ);
}

/* Four random keys of a kind: slerp, nlerp, squad, spline, Euler angles, turns about a wandering and about
 * one axis. */
enum { KINDS = 7 };
typedef struct random_keys {
  float values[4][4], spline[4][3][4];
  double angles[4][4], eulers[4][3];
} random_keys;

static tw_track_keys random_track(uint64_t *seed, int kind, random_keys *keys) {
  static const tw_interpolation interpolations[] = {TW_LINEAR, TW_NLERP, TW_SQUAD, TW_CUBICSPLINE};
  for (int i = 0; i < 4; i++) {
    ref_narrow(ref_random_unit(seed), keys->values[i]);
    memcpy(keys->spline[i][1], keys->values[i], sizeof keys->values[i]);
    for (int j = 0; j < 4; j++) {
      keys->spline[i][0][j] = (float)ref_between(seed, -1, 1);
      keys->spline[i][2][j] = (float)ref_between(seed, -1, 1);
      keys->angles[i][j] = ref_between(seed, -6, 6);
      if (kind == 6 && j < 3) keys->angles[i][j] = keys->angles[0][j];
    }
    for (int j = 0; j < 3; j++) keys->eulers[i][j] = ref_between(seed, -4, 4);
  }
  tw_track_keys track =
      quaternion_keys(TW_LINEAR, times_0_to_3, kind == 3 ? keys->spline[0][0] : keys->values[0], 4);
  if (kind == 4)
    return euler_keys((tw_euler_order)(*seed % TW_EULER_ORDERS), times_0_to_3, keys->eulers[0], 4);
  if (kind > 4) return axis_angle_keys(times_0_to_3, keys->angles[0], 4);
  track.interpolation = interpolations[kind];
  return track;
}

TEST(cosines_of_all_orders_agree_with_a_fine_sampling) {
  uint64_t seed = 3;
  for (int n = 0; n < 10 * KINDS; n++) {
    random_keys random;
    tw_track_keys keys = random_track(&seed, n % KINDS, &random);
    tw_track_report report = inspect(keys);
    tw_clip *clip = clip_of(&keys, 1, -1);
    double least[TW_EULER_ORDERS] = {2, 2, 2, 2, 2, 2}, best = 0, total = 0;
    float before[4];
    for (int i = 0; i <= 30000; i++) {
      float at = (float)i / 10000, q[4];
      tw_clip_sample(clip, 0, &at, 1, q);
      if (i > 0) total += ref_angle(ref_of(before), ref_of(q));
      memcpy(before, q, sizeof q);
      ref_matrix m = ref_matrix_of(ref_of(q));
      for (int order = 0; order < TW_EULER_ORDERS; order++) {
        const char *letters = tw_euler_order_names[order];
        double sine = m.at[letters[0] - 'X'][letters[2] - 'X'];
        least[order] = fmin(least[order], sqrt(fmax(0, 1 - sine * sine)));
      }
    }
    assert_near(report.total_angle, total, 2e-3 * total); /* single precision rounds each of the short ways */
    for (int order = 0; order < TW_EULER_ORDERS; order++) {
      assert_near(report.gimbals[order].cos_middle, least[order], 1e-3);
      assert_true(report.gimbals[order].cos_middle <= least[order] + 1e-6);
      best = fmax(best, least[order]);
      /* Where it says that the path is so near, it is. */
      float at = (float)report.gimbals[order].time, q[4];
      tw_clip_sample(clip, 0, &at, 1, q);
      ref_matrix m = ref_matrix_of(ref_of(q));
      const char *letters = tw_euler_order_names[order];
      double sine = m.at[letters[0] - 'X'][letters[2] - 'X'];
      assert_near(sqrt(fmax(0, 1 - sine * sine)), report.gimbals[order].cos_middle, 1e-3);
    }
    assert_near(report.gimbals[report.best_order].cos_middle, best, 1e-3);
    tw_clip_destroy(clip);
  }
}

TEST(angle_and_speed_of_slerp_are_those_of_its_keys) {
  float values[3][4];
  const double degrees[] = {0, 30, 150};
  for (int i = 0; i < 3; i++) ref_narrow(ref_axis_angle(1, 1, 0, degrees[i] * REF_DEGREES), values[i]);
  tw_track_report report = inspect(quaternion_keys(TW_LINEAR, times_0_to_3, values[0], 3));
  assert_near(report.total_angle, 150 * REF_DEGREES, 1e-6);
  assert_near(report.largest_step, 120 * REF_DEGREES, 1e-6);
  assert_int_equal(report.largest_key, 1);
  assert_near(report.peak_velocity, 120 * REF_DEGREES, 1e-5);
  assert_true(report.peak_time > 1);
  assert_int_equal(report.key_count, 3);
  assert_true(report.duration == 2);
  assert_int_equal(report.warning_count, 0);
}

TEST(nlerp_is_fastest_in_the_middle) {
  float values[2][4] = {{0, 0, 0, 1}, {1, 0, 0, 0}};
  ref_narrow(ref_axis_angle(1, 0, 0, 120 * REF_DEGREES), values[1]);
  tw_track_keys keys = quaternion_keys(TW_LINEAR, times_0_to_3, values[0], 2);
  keys.interpolation = TW_NLERP;
  tw_track_report report = inspect(keys);
  /* Twice d/du atan(u sin a / (1 - u + u cos a)) at 1/2, a = 60 degrees: 4 tan 30. */
  assert_near(report.peak_velocity, 4 * tan(30 * REF_DEGREES), 1e-6);
  assert_near(report.peak_time, 0.5, 1e-6);
  assert_near(report.total_angle, 120 * REF_DEGREES, 1e-6);
}

TEST(a_spline_is_judged_by_the_way_it_goes) {
  /* 0 and 200 degrees about z, with the derivatives of an even turn. */
  const double half = 100 * REF_DEGREES;
  const float keys[2][3][4] = {{{0}, {0, 0, 0, 1}, {0, 0, (float)half, 0}},
                               {{0, 0, (float)(half * cos(half)), (float)(-half * sin(half))},
                                {0, 0, (float)sin(half), (float)cos(half)},
                                {0}}};
  tw_track_report report = inspect(quaternion_keys(TW_CUBICSPLINE, times_0_to_3, keys[0][0], 2));
  assert_near(report.total_angle, 200 * REF_DEGREES, 1e-5);
  assert_near(report.largest_step, 200 * REF_DEGREES, 1e-5);
  assert_int_equal(report.long_steps, 1);
  assert_int_equal(report.sign_flips, 1);
  assert_int_equal(report.half_turns, 0);
  assert_non_null(strstr(report.warnings[0], "the spline is taken as it is written"));
}

TEST(keys_that_hide_something_are_counted) {
  const float values[] = {0, 0, 0, 1, 0, -0.6f, 0, -0.8f, 0, 0.8f, 0, -0.6f, 0, 0, 0, -1.01f};
  tw_track_report report = inspect(quaternion_keys(TW_LINEAR, times_0_to_3, values, 4));
  assert_int_equal(report.sign_flips, 1);
  assert_int_equal(report.half_turns, 1); /* from the second to the third */
  assert_int_equal(report.non_unit_keys, 1);
  assert_int_equal(report.long_steps, 0);
  assert_int_equal(report.warning_count, 3);
}

TEST(half_turns_are_counted_in_every_form_of_key) {
  const double quarter = REF_PI / 2, eulers[] = {-quarter, 0, 0, quarter, 0, 0};
  const double turns[] = {0, 0, 1, 0, 0, 0, 1, REF_PI};
  tw_track_keys keys[] = {euler_keys(TW_XYZ, times_0_to_3, eulers, 2),
                          euler_keys(TW_XYZ, times_0_to_3, eulers, 2),
                          axis_angle_keys(times_0_to_3, turns, 2)};
  keys[1].interpolation = TW_LINEAR; /* slerp, whose way is arbitrary */
  for (int i = 0; i < 3; i++) {
    tw_track_report report = inspect(keys[i]);
    assert_int_equal(report.half_turns, 1);
    assert_int_equal(report.long_steps, 0);
    assert_int_equal(report.sign_flips, 0);
    assert_non_null(strstr(report.warnings[0], "180 degrees"));
  }
  keys[0].interpolation = TW_STEP;
  assert_int_equal(inspect(keys[0]).half_turns, 0);
}

TEST(many_turns_are_counted_whole) {
  for (int turns = 1; turns <= 100000; turns *= 10) {
    const double angles[] = {0, 0, 1, 0, 0, 0, 1, turns * 2 * REF_PI};
    tw_track_keys keys = axis_angle_keys(times_0_to_3, angles, 2);
    tw_track_report report = inspect(keys);
    assert_near(report.total_angle / (2 * REF_PI), turns, 1e-6 * turns);
    assert_near(report.peak_velocity / (2 * REF_PI), turns, 1e-6 * turns);
    assert_int_equal(report.long_steps, 1);
    assert_false(report.has_stray);
  }
}

TEST(steps_jump_and_have_no_speed) {
  float values[2][4] = {{0, 0, 0, 1}};
  ref_narrow(ref_axis_angle(0, 1, 0, 89 * REF_DEGREES), values[1]);
  tw_track_keys keys = quaternion_keys(TW_LINEAR, times_0_to_3, values[0], 2);
  keys.interpolation = TW_STEP;
  tw_track_report report = inspect(keys);
  assert_near(report.total_angle, 89 * REF_DEGREES, 1e-6);
  assert_true(report.peak_velocity == 0);
  assert_near(report.gimbals[TW_XYZ].cos_middle, cos(89 * REF_DEGREES), 1e-6);
  assert_near(report.gimbals[TW_XYZ].time, 1, 1e-9);
}

TEST(a_single_key_has_a_place_but_no_way) {
  const float value[] = {0, 0, 0, 1};
  tw_track_report report = inspect(quaternion_keys(TW_LINEAR, times_0_to_3, value, 1));
  assert_true(report.total_angle == 0 && report.duration == 0 && report.peak_velocity == 0);
  assert_near(report.gimbals[TW_ZYX].cos_middle, 1, 1e-9);
  assert_int_equal(report.best_order, TW_XYZ);
}
