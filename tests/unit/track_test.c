/* Every interpolation against the formulas, and the textbook's cases. */
#include <string.h>

#include "keys.h"
#include "rotation_reference.h"

enum { KEYS_MAX = 24, SAMPLES = 300 };

/* One random rotation track in all forms of source. */
typedef struct random_track {
  uint32_t key_count;
  float times[KEYS_MAX];
  float values[KEYS_MAX][4], spline[KEYS_MAX][3][4];
  double eulers[KEYS_MAX][3], axis_angles[KEYS_MAX][4];
  tw_euler_order order;
  ref_quat unit[KEYS_MAX]; /* values, unit length, signs continuous */
} random_track;

static void random_track_init(random_track *track, uint64_t *seed) {
  track->key_count = 1 + (uint32_t)(ref_random(seed) * (KEYS_MAX - 1));
  track->order = (tw_euler_order)(ref_random(seed) * TW_EULER_ORDERS);
  double time = ref_random(seed), spread = ref_random(seed) < 0.5 ? 3.0 : 0.05;
  ref_quat q = ref_random_unit(seed);
  for (uint32_t i = 0; i < track->key_count; i++) {
    track->times[i] = (float)time;
    time += 0.01 + exp(ref_between(seed, -4, 2));
    ref_quat turn = ref_axis_angle(ref_between(seed, -1, 1), ref_between(seed, -1, 1),
                                   ref_between(seed, -1, 1), ref_between(seed, 0, spread));
    q = ref_product(q, turn);
    if (ref_random(seed) < 0.3) q = ref_add(q, -1, q, 0);
    ref_narrow(q, track->values[i]);
    track->unit[i] = ref_unit(ref_of(track->values[i]));
    if (i > 0) track->unit[i] = ref_toward(track->unit[i], track->unit[i - 1]);
    float length = i % 3 == 1 ? (float)ref_between(seed, 0.3, 3) : 1;
    for (int j = 0; j < 4; j++) {
      track->spline[i][0][j] = (float)ref_between(seed, -1, 1);
      track->spline[i][1][j] = length * track->values[i][j];
      track->spline[i][2][j] = (float)ref_between(seed, -1, 1);
      track->axis_angles[i][j] = ref_between(seed, -20, 20);
    }
    for (int j = 0; j < 3; j++) track->eulers[i][j] = ref_between(seed, -20, 20);
  }
}

static tw_track_keys track_keys(const random_track *track, tw_interpolation interpolation, tw_key_form form) {
  if (form == TW_KEY_EULER) return euler_keys(track->order, track->times, track->eulers[0], track->key_count);
  if (form == TW_KEY_AXIS_ANGLE)
    return axis_angle_keys(track->times, track->axis_angles[0], track->key_count);
  const float *values = interpolation == TW_CUBICSPLINE ? track->spline[0][0] : track->values[0];
  return quaternion_keys(interpolation, track->times, values, track->key_count);
}

/* ---- the reference: rotation of segment i at u ----------------------------------------------- */

typedef ref_matrix (*reference)(const random_track *track, uint32_t i, double u);

static ref_matrix reference_step(const random_track *track, uint32_t i, double u) {
  return ref_matrix_of(u < 1 ? track->unit[i] : track->unit[i + 1]);
}

static ref_matrix reference_slerp(const random_track *track, uint32_t i, double u) {
  return ref_matrix_of(ref_slerp(track->unit[i], track->unit[i + 1], u));
}

static ref_matrix reference_nlerp(const random_track *track, uint32_t i, double u) {
  return ref_matrix_of(ref_add(track->unit[i], 1 - u, track->unit[i + 1], u));
}

/* glTF 2.0, appendix C: the cubic spline, whose keys and tangents count as they stand. */
static ref_matrix reference_cubicspline(const random_track *track, uint32_t i, double u) {
  double seconds = (double)track->times[i + 1] - (double)track->times[i];
  ref_quat out = ref_of(track->spline[i][2]), in = ref_of(track->spline[i + 1][0]);
  ref_quat start = ref_of(track->spline[i][1]), end = ref_of(track->spline[i + 1][1]);
  ref_quat values = ref_add(start, 2 * u * u * u - 3 * u * u + 1, end, 3 * u * u - 2 * u * u * u);
  ref_quat tangents = ref_add(out, seconds * (u * u * u - 2 * u * u + u), in, seconds * (u * u * u - u * u));
  return ref_matrix_of(ref_add(values, 1, tangents, 1));
}

static ref_matrix reference_euler(const random_track *track, uint32_t i, double u) {
  double angles[3];
  for (int j = 0; j < 3; j++) angles[j] = track->eulers[i][j] * (1 - u) + track->eulers[i + 1][j] * u;
  return ref_euler(angles, track->order);
}

/* Rodrigues' formula about an axis that goes from one to the other key's. */
static ref_matrix reference_axis_angle(const random_track *track, uint32_t i, double u) {
  const double *from = track->axis_angles[i], *to = track->axis_angles[i + 1];
  double a = sqrt(from[0] * from[0] + from[1] * from[1] + from[2] * from[2]);
  double b = sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
  double cosine = (from[0] * to[0] + from[1] * to[1] + from[2] * to[2]) / (a * b);
  double sign = cosine < 0 ? -1 : 1, angle = acos(fabs(cosine)), n[3];
  for (int j = 0; j < 3; j++)
    n[j] = (from[j] / a * sin((1 - u) * angle) + sign * to[j] / b * sin(u * angle)) / sin(angle);
  double turn = from[3] * (1 - u) + sign * to[3] * u, c = cos(turn), s = sin(turn);
  const double skew[3][3] = {{0, -n[2], n[1]}, {n[2], 0, -n[0]}, {-n[1], n[0], 0}};
  ref_matrix out;
  for (int j = 0; j < 3; j++)
    for (int k = 0; k < 3; k++) out.at[j][k] = (j == k) * c + s * skew[j][k] + (1 - c) * n[j] * n[k];
  return out;
}

static ref_quat ref_log(ref_quat q) {
  double sine = sqrt(q.x * q.x + q.y * q.y + q.z * q.z), scale = sine > 0 ? atan2(sine, q.w) / sine : 0;
  return (ref_quat){q.x * scale, q.y * scale, q.z * scale, 0};
}

static ref_quat ref_exp(ref_quat v) {
  double angle = sqrt(ref_dot(v, v)), scale = angle > 0 ? sin(angle) / angle : 1;
  return (ref_quat){v.x * scale, v.y * scale, v.z * scale, cos(angle)};
}

/* Key steps as half rotation vectors; beyond the ends there is none. */
static ref_quat key_step(const random_track *track, uint32_t i) {
  return ref_log(ref_product(ref_inverse(track->unit[i]), track->unit[i + 1]));
}

/* Both steps beside key i over the time that they take. */
static ref_quat key_velocity(const random_track *track, uint32_t i) {
  ref_quat turn = {0, 0, 0, 0};
  double seconds = 0;
  if (i > 0) {
    turn = ref_add(turn, 1, key_step(track, i - 1), 1);
    seconds += (double)track->times[i] - (double)track->times[i - 1];
  }
  if (i + 1 < track->key_count) {
    turn = ref_add(turn, 1, key_step(track, i), 1);
    seconds += (double)track->times[i + 1] - (double)track->times[i];
  }
  return ref_add(turn, 1 / seconds, turn, 0);
}

static ref_matrix reference_squad(const random_track *track, uint32_t i, double u) {
  double seconds = (double)track->times[i + 1] - (double)track->times[i];
  ref_quat step = key_step(track, i);
  ref_quat leaving = ref_add(key_velocity(track, i), seconds / 2, step, -0.5);
  ref_quat arriving = ref_add(key_velocity(track, i + 1), -seconds / 2, step, 0.5);
  ref_quat out = ref_product(track->unit[i], ref_exp(leaving));
  ref_quat in = ref_product(track->unit[i + 1], ref_exp(arriving));
  ref_quat keys = ref_slerp(track->unit[i], track->unit[i + 1], u), controls = ref_slerp(out, in, u);
  return ref_matrix_of(ref_slerp(keys, controls, 2 * u * (1 - u)));
}

/* Samples of 300 random clips, at random times and at keys, one by one and in bulk. */
static void assert_agrees(tw_interpolation interpolation, tw_key_form form, reference expected) {
  uint64_t seed = 17;
  double worst = 0;
  for (int n = 0; n < 300; n++) {
    random_track track;
    random_track_init(&track, &seed);
    tw_track_keys keys = track_keys(&track, interpolation, form);
    tw_clip *clip = clip_of(&keys, 1, -1);
    float times[SAMPLES], bulk[SAMPLES][4];
    float last = track.times[track.key_count - 1];
    for (int i = 0; i < SAMPLES; i++)
      times[i] = i % 10 == 0 ? track.times[(uint32_t)i % track.key_count]
                             : (float)ref_between(&seed, -0.1, (double)last * 1.02);
    tw_clip_sample(clip, 0, times, SAMPLES, bulk[0]);
    for (int i = 0; i < SAMPLES; i++) {
      float one[4];
      tw_clip_sample(clip, 0, &times[i], 1, one);
      assert_memory_equal(one, bulk[i], sizeof one);
      assert_true(fabs(sqrt(ref_dot(ref_of(one), ref_of(one))) - 1) < 1e-6);
      if (track.key_count == 1) continue;
      float time = fmaxf(track.times[0], fminf(times[i], last));
      uint32_t key = 0;
      while (key + 2 < track.key_count && track.times[key + 1] <= time) key++;
      double u = ((double)time - (double)track.times[key]) /
                 ((double)track.times[key + 1] - (double)track.times[key]);
      worst = fmax(worst, ref_matrix_angle(ref_matrix_of(ref_of(one)), expected(&track, key, u)));
    }
    tw_clip_destroy(clip);
  }
  if (!(worst <= 1e-6)) fail_msg("%g radians off", worst);
}

TEST(step_agrees_with_the_reference) {
  assert_agrees(TW_STEP, TW_KEY_QUATERNION, reference_step);
}

TEST(slerp_agrees_with_the_reference) {
  assert_agrees(TW_LINEAR, TW_KEY_QUATERNION, reference_slerp);
}

TEST(nlerp_agrees_with_the_reference) {
  assert_agrees(TW_NLERP, TW_KEY_QUATERNION, reference_nlerp);
}

TEST(squad_agrees_with_the_reference) {
  assert_agrees(TW_SQUAD, TW_KEY_QUATERNION, reference_squad);
}

TEST(cubicspline_agrees_with_the_reference) {
  assert_agrees(TW_CUBICSPLINE, TW_KEY_QUATERNION, reference_cubicspline);
}

TEST(euler_agrees_with_the_reference) {
  assert_agrees(TW_EULER, TW_KEY_EULER, reference_euler);
}

TEST(axis_angle_agrees_with_the_reference) {
  assert_agrees(TW_LINEAR, TW_KEY_AXIS_ANGLE, reference_axis_angle);
}

/* ---- properties ------------------------------------------------------------------------------ */

TEST(slerp_travels_at_constant_speed_and_never_over_half_a_turn) {
  uint64_t seed = 23;
  for (int n = 0; n < 2000; n++) {
    const float ends[] = {1, 3};
    float values[2][4], times[33], at[33][4];
    for (int i = 0; i < 2; i++) ref_narrow(ref_random_unit(&seed), values[i]);
    for (int i = 0; i <= 32; i++) times[i] = 1 + (float)i / 16;
    tw_track_keys keys = quaternion_keys(TW_LINEAR, ends, values[0], 2);
    tw_clip *clip = clip_of(&keys, 1, -1);
    tw_clip_sample(clip, 0, times, 33, at[0]);
    double whole = ref_angle(ref_of(values[0]), ref_of(values[1])), travelled = 0;
    for (int i = 0; i < 32; i++) {
      double step = ref_angle(ref_of(at[i]), ref_of(at[i + 1]));
      assert_true(fabs(step - whole / 32) < 1e-6);
      travelled += step;
    }
    assert_true(travelled <= REF_PI + 1e-5);
    tw_clip_destroy(clip);
  }
}

TEST(samples_keep_one_sign_along_a_track) {
  const tw_interpolation all[] = {TW_LINEAR, TW_NLERP, TW_SQUAD};
  uint64_t seed = 29;
  for (int n = 0; n < 100; n++) {
    random_track track;
    random_track_init(&track, &seed);
    for (size_t k = 0; k < 3; k++) {
      tw_track_keys keys = track_keys(&track, all[k], TW_KEY_QUATERNION);
      tw_clip *clip = clip_of(&keys, 1, -1);
      float before[4];
      tw_clip_sample(clip, 0, track.times, 1, before);
      for (uint32_t i = 0; i + 1 < track.key_count; i++)
        for (int j = 1; j <= 64; j++) {
          float at = track.times[i] + (track.times[i + 1] - track.times[i]) * (float)j / 64, q[4];
          tw_clip_sample(clip, 0, &at, 1, q);
          assert_true(ref_dot(ref_of(before), ref_of(q)) > 0.5);
          memcpy(before, q, sizeof q);
        }
      tw_clip_destroy(clip);
    }
  }
}

TEST(squad_turns_steadily_where_keys_do) {
  const float times[] = {0, 1, 1.5f, 4, 5};
  float values[5][4];
  for (int i = 0; i < 5; i++) ref_narrow(ref_axis_angle(1, 2, 3, 0.5 * (double)times[i]), values[i]);
  tw_track_keys keys = quaternion_keys(TW_SQUAD, times, values[0], 5);
  tw_clip *clip = clip_of(&keys, 1, -1);
  for (int i = 0; i <= 50; i++) {
    float at = (float)i / 10, q[4];
    tw_clip_sample(clip, 0, &at, 1, q);
    assert_true(ref_angle(ref_of(q), ref_axis_angle(1, 2, 3, 0.5 * (double)at)) < 1e-6);
  }
  tw_clip_destroy(clip);
}

static double speed_at(const tw_clip *clip, float time, float delta) {
  float times[] = {time, time + delta}, q[2][4];
  tw_clip_sample(clip, 0, times, 2, q[0]);
  return ref_angle(ref_of(q[0]), ref_of(q[1])) / ((double)times[1] - (double)times[0]);
}

TEST(squad_keeps_its_speed_through_unequally_spaced_keys) {
  const float times[] = {0, 0.5f, 2, 3};
  float values[4][4];
  const double degrees[] = {0, 20, 70, 75};
  for (int i = 0; i < 4; i++) ref_narrow(ref_axis_angle(0, 1, 0.1 * i, degrees[i] * REF_DEGREES), values[i]);
  tw_track_keys keys = quaternion_keys(TW_SQUAD, times, values[0], 4);
  tw_clip *clip = clip_of(&keys, 1, -1);
  for (int i = 1; i <= 2; i++) {
    double before = speed_at(clip, times[i] - 0.004f, 0.004f), after = speed_at(clip, times[i], 0.004f);
    assert_true(fabs(before - after) < 0.01 * before);
  }
  tw_clip_destroy(clip);
}

/* ---- the textbook's cases -------------------------------------------------------------------- */

static void between(const tw_track_keys *keys, int force, float time, float out[4]) {
  tw_clip *clip = clip_of(keys, 1, force);
  tw_clip_sample(clip, 0, &time, 1, out);
  tw_clip_destroy(clip);
}

TEST(minus_170_to_170_passes_0_as_euler_and_180_as_quaternion) {
  const float times[] = {0, 1};
  for (int axis = 0; axis < 3; axis++)
    for (tw_euler_order order = TW_XYZ; order <= TW_ZYX; order++) {
      double angles[2][3] = {{0}};
      float q[4];
      angles[0][axis] = -170 * REF_DEGREES;
      angles[1][axis] = 170 * REF_DEGREES;
      tw_track_keys keys = euler_keys(order, times, angles[0], 2);
      between(&keys, -1, 0.5f, q);
      assert_true(ref_angle(ref_of(q), (ref_quat){0, 0, 0, 1}) < 1e-6);
      between(&keys, -1, 0.25f, q);
      assert_true(fabs(ref_angle(ref_of(q), (ref_quat){0, 0, 0, 1}) - 85 * REF_DEGREES) < 1e-6);
      between(&keys, TW_LINEAR, 0.5f, q);
      assert_true(fabs(ref_angle(ref_of(q), (ref_quat){0, 0, 0, 1}) - REF_PI) < 1e-6);
      assert_true(fabs(fabs((double)q[axis]) - 1) < 1e-6);
    }
}

TEST(half_turns_about_opposite_axes_are_twenty_degrees_apart) {
  const float times[] = {0, 1};
  float values[2][4], at[4];
  ref_narrow(ref_axis_angle(1, 0, 0, 170 * REF_DEGREES), values[0]);
  ref_narrow(ref_axis_angle(-1, 0, 0, 170 * REF_DEGREES), values[1]);
  tw_track_keys keys = quaternion_keys(TW_LINEAR, times, values[0], 2);
  for (int i = 0; i <= 10; i++) {
    between(&keys, -1, (float)i / 10, at);
    assert_true(fabs(ref_angle(ref_of(values[0]), ref_of(at)) - 20 * REF_DEGREES * i / 10) < 1e-6);
  }
}

TEST(axis_angle_keys_turn_as_often_as_they_say) {
  const float times[] = {0, 2};
  /* The same 800 degrees, said in four ways. */
  const double turns[][2][4] = {{{0, 2, 0, 0}, {0, 1, 0, 800}},
                                {{0, 1, 0, -100}, {0, 1, 0, 700}},
                                {{0, 1, 0, 100}, {0, -1, 0, -900}},
                                {{1, 0, 0, 0}, {0, 0, -1, 800}}};
  for (size_t n = 0; n < 4; n++) {
    double angles[2][4];
    memcpy(angles, turns[n], sizeof angles);
    for (int i = 0; i < 2; i++) angles[i][3] *= REF_DEGREES;
    tw_track_keys keys = axis_angle_keys(times, angles[0], 2);
    tw_clip *clip = clip_of(&keys, 1, -1);
    const double *axis = angles[1];
    double start = axis[1] < 0 ? -angles[0][3] : angles[0][3], change = angles[1][3] - start;
    assert_true(fabs(fabs(change) - 800 * REF_DEGREES) < 1e-9);
    for (int i = 0; i <= 40; i++) {
      float at = (float)i / 20, q[4];
      tw_clip_sample(clip, 0, &at, 1, q);
      ref_quat expected = ref_axis_angle(axis[0], axis[1], axis[2], start + change * (double)at / 2);
      assert_true(ref_angle(ref_of(q), expected) < 1e-6);
    }
    tw_clip_destroy(clip);
  }
}

TEST(forced_interpolation_turns_keys_into_quaternions_first) {
  uint64_t seed = 31;
  for (int n = 0; n < 100; n++) {
    random_track track;
    random_track_init(&track, &seed);
    for (int form = TW_KEY_EULER; form <= TW_KEY_AXIS_ANGLE; form++) {
      tw_track_keys keys = track_keys(&track, form == TW_KEY_EULER ? TW_EULER : TW_LINEAR, (tw_key_form)form);
      float values[KEYS_MAX][4], q[4], expected[4];
      for (uint32_t i = 0; i < track.key_count; i++) {
        const double *turn = track.axis_angles[i];
        ref_narrow(form == TW_KEY_EULER ? ref_euler_quat(track.eulers[i], track.order)
                                        : ref_axis_angle(turn[0], turn[1], turn[2], turn[3]),
                   values[i]);
      }
      tw_track_keys as_quaternions = track_keys(&track, TW_LINEAR, TW_KEY_QUATERNION);
      as_quaternions.values = values[0];
      float at = (float)ref_between(&seed, 0, (double)track.times[track.key_count - 1]);
      between(&keys, TW_LINEAR, at, q);
      between(&as_quaternions, -1, at, expected);
      assert_true(ref_angle(ref_of(q), ref_of(expected)) < 1e-6);
    }
  }
}

TEST(forced_euler_follows_quaternions_round_and_round) {
  const float times[] = {0, 1, 2, 3, 4, 5, 6};
  float values[7][4];
  for (int i = 0; i < 7; i++) ref_narrow(ref_axis_angle(0, 0, 1, i * 1.5), values[i]);
  tw_track_keys keys = quaternion_keys(TW_LINEAR, times, values[0], 7);
  tw_clip *clip = clip_of(&keys, 1, TW_EULER);
  for (int i = 0; i <= 60; i++) {
    float at = (float)i / 10, q[4];
    tw_clip_sample(clip, 0, &at, 1, q);
    assert_true(ref_angle(ref_of(q), ref_axis_angle(0, 0, 1, 1.5 * (double)at)) < 1e-6);
  }
  tw_clip_destroy(clip);
}

TEST(a_spline_turns_the_way_its_keys_say) {
  /* 0 and 200 degrees about z with the derivatives of an even turn: half of it is 100 degrees, not 80 back.
   */
  const float times[] = {0, 1};
  const double half = 100 * REF_DEGREES;
  const float speed[2][4] = {{0, 0, (float)half, 0},
                             {0, 0, (float)(half * cos(half)), (float)(-half * sin(half))}};
  const float values[2][3][4] = {
      {{0}, {0, 0, 0, 1}, {speed[0][0], 0, speed[0][2], speed[0][3]}},
      {{0, 0, speed[1][2], speed[1][3]}, {0, 0, (float)sin(half), (float)cos(half)}, {0}}};
  tw_track_keys keys = quaternion_keys(TW_CUBICSPLINE, times, values[0][0], 2);
  float q[4];
  between(&keys, -1, 0.5f, q);
  assert_true(fabs((double)q[2] - sin(half / 2)) < 1e-6 && fabs((double)q[3] - cos(half / 2)) < 1e-6);
}

TEST(a_spline_through_zero_stays_a_rotation) {
  const float times[] = {0, 1};
  /* Tangents that carry the value to zero at the middle: 1/2 + 1/2 + (-4 - 4) / 8. */
  float values[2][3][4] = {{{0}, {0, 0, 0, 1}, {0, 0, 0, -4}}, {{0, 0, 0, 4}, {0, 0, 0, 1}, {0}}};
  tw_track_keys keys = quaternion_keys(TW_CUBICSPLINE, times, values[0][0], 2);
  float q[4];
  between(&keys, -1, 0.5f, q);
  assert_true(q[3] == 1);
}

TEST(translations_and_scales_agree_with_the_formulas) {
  uint64_t seed = 41;
  float times[KEYS_MAX], values[KEYS_MAX][3][3];
  for (int n = 0; n < 200; n++) {
    double time = 0;
    for (int i = 0; i < KEYS_MAX; i++) {
      times[i] = (float)time;
      time += 0.01 + ref_random(&seed);
      for (int j = 0; j < 9; j++) values[i][j / 3][j % 3] = (float)ref_between(&seed, -10, 10);
    }
    tw_track_keys keys = {.path = n % 2 ? TW_SCALE : TW_TRANSLATION,
                          .interpolation = n % 4 < 2 ? TW_CUBICSPLINE : TW_LINEAR,
                          .width = n % 4 < 2 ? 3 : 9,
                          .key_count = KEYS_MAX,
                          .times = times,
                          .values = values[0][0]};
    if (n % 4 >= 2) keys.path = TW_WEIGHTS;
    tw_clip *clip = clip_of(&keys, 1, -1);
    for (int i = 0; i < KEYS_MAX - 1; i++) {
      float at = (float)ref_between(&seed, (double)times[i], (double)times[i + 1]), out[9];
      double h = (double)times[i + 1] - (double)times[i], u = ((double)at - (double)times[i]) / h;
      tw_clip_sample(clip, 0, &at, 1, out);
      for (int j = 0; j < (int)keys.width; j++) {
        double expected = (1 - u) * (double)values[i][j / 3][j % 3] + u * (double)values[i + 1][j / 3][j % 3];
        if (keys.width == 3)
          expected = (2 * u * u * u - 3 * u * u + 1) * (double)values[i][1][j] +
                     h * (u * u * u - 2 * u * u + u) * (double)values[i][2][j] +
                     (3 * u * u - 2 * u * u * u) * (double)values[i + 1][1][j] +
                     h * (u * u * u - u * u) * (double)values[i + 1][0][j];
        assert_true(fabs((double)out[j] - expected) < 1e-6 * 10);
      }
    }
    tw_clip_destroy(clip);
  }
}

TEST(huge_values_and_tangents_stay_finite) {
  const float times[] = {0, 1e30f};
  float values[18];
  for (int i = 0; i < 18; i++) values[i] = i % 2 ? 3e38f : -3e38f;
  for (int interpolation = TW_LINEAR; interpolation <= TW_CUBICSPLINE; interpolation++) {
    tw_track_keys keys = value_keys(TW_TRANSLATION, (tw_interpolation)interpolation, times, values, 2);
    tw_clip *clip = clip_of(&keys, 1, -1);
    for (int i = 0; i <= 10; i++) {
      float at = 1e29f * (float)i, out[3];
      tw_clip_sample(clip, 0, &at, 1, out);
      for (int j = 0; j < 3; j++) assert_true(isfinite(out[j]));
    }
    tw_clip_destroy(clip);
  }
}
