/* Tracks as glTF can hold them: what a viewer shows must be what the track says. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "gltf/gltf.h"
#include "keys.h"

static const double DEGREE = 3.141592653589793 / 180;

/* Radians between two rotations. */
static double angle_between(const float a[4], const float b[4]) {
  double apart = 0, opposite = 0;
  for (int i = 0; i < 4; i++) {
    apart += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
    opposite += ((double)a[i] + (double)b[i]) * ((double)a[i] + (double)b[i]);
  }
  return 4 * asin(fmin(1, sqrt(fmin(apart, opposite)) / 2));
}

/* glTF's LINEAR, by the formula of its appendix C. */
static void viewer_slerp(const tw_track_keys *keys, float time, float out[4]) {
  uint32_t key = 0;
  while (key + 2 < keys->key_count && keys->times[key + 1] <= time) key++;
  const float *a = keys->values + 4 * key, *b = a + 4;
  double u =
      ((double)time - (double)keys->times[key]) / ((double)keys->times[key + 1] - (double)keys->times[key]);
  double dot = 0;
  for (int i = 0; i < 4; i++) dot += (double)a[i] * (double)b[i];
  double sign = dot < 0 ? -1 : 1, angle = acos(fmin(1, fabs(dot)));
  double from = angle > 1e-9 ? sin(angle * (1 - u)) / sin(angle) : 1 - u;
  double to = angle > 1e-9 ? sign * sin(angle * u) / sin(angle) : sign * u;
  for (int i = 0; i < 4; i++) out[i] = (float)(from * (double)a[i] + to * (double)b[i]);
}

static tw_track_keys convert(tw_arena *arena, const tw_track_keys *track) {
  tw_track_keys keys;
  tw_error error;
  if (tw_gltf_keys_of(track, 10000, &(uint64_t){TW_REDUCTION_STEPS}, arena, &keys, &error) != TW_OK)
    fail_msg("%s", error.detail);
  return keys;
}

/* The largest angle between what a viewer shows and what the track says, in degrees. */
static double largest_error(const tw_track_keys *track, const tw_track_keys *keys) {
  tw_clip_keys alone = {.track_count = 1, .tracks = track};
  tw_clip *clip = NULL;
  tw_error error;
  if (tw_clip_create(&alone, track->node + 1, -1, &clip, &error) != TW_OK) fail_msg("%s", error.detail);
  double largest = 0;
  float end = track->times[track->key_count - 1];
  for (int i = 0; i <= 20000; i++) {
    float time = end * (float)i / 20000, shown[4], wanted[4];
    if (time < track->times[0]) continue;
    viewer_slerp(keys, time, shown);
    tw_clip_sample(clip, 0, &time, 1, wanted);
    largest = fmax(largest, angle_between(shown, wanted) / DEGREE);
  }
  tw_clip_destroy(clip);
  return largest;
}

static const float times[4] = {0.25f, 0.4f, 1.7f, 2};
static const float quaternions[4][4] = {
    {0, 0, 0, 1}, {0, 1.2f, 0, 1.6f}, {0, -0.6f, 0, -0.8f}, {0.5f, 0.5f, 0.5f, -0.5f}};

static tw_track_keys rotation(tw_interpolation interpolation) {
  tw_track_keys keys = quaternion_keys(interpolation, times, quaternions[0], 4);
  keys.node = 3;
  return keys;
}

static int set_up(void **state) {
  *state = tw_arena_create();
  return *state ? 0 : -1;
}

static int tear_down(void **state) {
  tw_arena_destroy(*state);
  return 0;
}

TEST_WITH(quaternions_come_out_unit_and_continuous, set_up, tear_down) {
  tw_arena *arena = *state;
  static const tw_interpolation kinds[] = {TW_STEP, TW_LINEAR, TW_NLERP, TW_SQUAD};
  for (int k = 0; k < 4; k++) {
    tw_track_keys track = rotation(kinds[k]);
    tw_track_keys keys = convert(arena, &track);
    assert_int_equal(keys.interpolation, kinds[k] == TW_STEP ? TW_STEP : TW_LINEAR);
    for (uint32_t i = 0; i < keys.key_count; i++) {
      double square = 0, dot = 0;
      for (uint32_t j = 0; j < 4; j++) {
        square += (double)keys.values[4 * i + j] * (double)keys.values[4 * i + j];
        if (i > 0) dot += (double)keys.values[4 * i + j] * (double)keys.values[4 * i + j - 4];
      }
      assert_true(fabs(square - 1) < 1e-6);
      assert_true(dot >= 0);
    }
  }
}

TEST_WITH(slerp_and_step_keep_their_keys, set_up, tear_down) {
  tw_arena *arena = *state;
  static const tw_interpolation kinds[] = {TW_STEP, TW_LINEAR};
  for (int k = 0; k < 2; k++) {
    tw_track_keys track = rotation(kinds[k]);
    tw_track_keys keys = convert(arena, &track);
    assert_int_equal(keys.key_count, 4);
    assert_ptr_equal(keys.times, times);
    for (uint32_t i = 0; i < 4; i++) {
      float unit[4];
      double length = i == 1 ? 2 : 1;
      for (int j = 0; j < 4; j++) unit[j] = (float)((double)quaternions[i][j] / length);
      assert_true(angle_between(keys.values + 4 * i, unit) < 1e-3);
    }
  }
}

TEST_WITH(euler_track_strays_less_than_a_tenth_of_a_degree, set_up, tear_down) {
  tw_arena *arena = *state;
  const double eulers[4][3] = {{-170 * DEGREE, 10 * DEGREE, 0},
                               {170 * DEGREE, 89 * DEGREE, 40 * DEGREE},
                               {-300 * DEGREE, -95 * DEGREE, 700 * DEGREE},
                               {0, 0, 0}};
  for (int order = 0; order < TW_EULER_ORDERS; order++) {
    tw_track_keys track = euler_keys(TW_XYZ, times, eulers[0], 4);
    track.order = (tw_euler_order)order;
    tw_track_keys keys = convert(arena, &track);
    assert_true(largest_error(&track, &keys) <= 0.1);
    assert_true(keys.key_count > 4 && keys.key_count < 300);
  }
}

/* Whether a key of the result has this time and rotation, bit for bit but for the sign. */
static bool has_key(const tw_track_keys *keys, float time, const float wanted[4]) {
  for (uint32_t i = 0; i < keys->key_count; i++)
    if (keys->times[i] == time) return angle_between(keys->values + 4 * i, wanted) == 0;
  return false;
}

TEST_WITH(euler_keys_stay_and_get_more_between_them_where_needed, set_up, tear_down) {
  tw_arena *arena = *state;
  const double near[4][3] = {{0, 0, 0}, {0.05, 0.02, 0}, {0.1, -0.01, 0.03}, {0.1, 0, 0.1}};
  const double far[4][3] = {{0, 0, 0}, {3.2, 0, 0}, {0, 0, 0}, {0.02, 0.02, 0.02}};
  for (int n = 0; n < 2; n++) {
    tw_track_keys track = euler_keys(TW_YZX, times, n ? far[0] : near[0], 4);
    tw_track_keys keys = convert(arena, &track);
    assert_int_equal(keys.key_count, n ? 6 : 4); /* two steps over 180 degrees in two parts each */
    assert_true(largest_error(&track, &keys) <= 0.1);
    tw_clip *clip = NULL;
    assert_int_equal(
        tw_clip_create(&(tw_clip_keys){.track_count = 1, .tracks = &track}, track.node + 1, -1, &clip, NULL),
        TW_OK);
    for (int i = 0; i < 4; i++) {
      float wanted[4];
      tw_clip_sample(clip, 0, &times[i], 1, wanted);
      assert_true(has_key(&keys, times[i], wanted));
    }
    tw_clip_destroy(clip);
  }
}

TEST_WITH(more_euler_turns_than_keys_are_refused, set_up, tear_down) {
  tw_arena *arena = *state;
  const double turns[2][3] = {{0, 0, 0}, {0, 27 * 1000, 0}}; /* of 2.7 radians each */
  tw_track_keys track = euler_keys(TW_XYZ, times, turns[0], 2);
  tw_track_keys keys;
  assert_int_equal(tw_gltf_keys_of(&track, 9998, &(uint64_t){TW_REDUCTION_STEPS}, arena, &keys, NULL),
                   TW_LIMIT);
  assert_int_equal(tw_gltf_keys_of(&track, 9999, &(uint64_t){TW_REDUCTION_STEPS}, arena, &keys, NULL), TW_OK);
  assert_int_equal(keys.key_count, 10001);
}

TEST_WITH(euler_keys_with_slerp_need_no_more_keys, set_up, tear_down) {
  tw_arena *arena = *state;
  const double eulers[2][3] = {{-170 * DEGREE, 0, 0}, {170 * DEGREE, 0, 0}};
  tw_track_keys track = euler_keys(TW_XYZ, times, eulers[0], 2);
  track.interpolation = TW_LINEAR;
  tw_track_keys keys = convert(arena, &track);
  assert_int_equal(keys.key_count, 2);
  assert_true(largest_error(&track, &keys) < 0.001);
  assert_true(fabs(angle_between(keys.values, keys.values + 4) / DEGREE - 20) < 0.001);
}

TEST_WITH(wheel_turns_as_often_as_it_says, set_up, tear_down) {
  tw_arena *arena = *state;
  const double turns[2][4] = {{1, 2, 0, 0}, {1, 2, 0, 720 * DEGREE}};
  tw_track_keys track = axis_angle_keys(times, turns[0], 2);
  tw_track_keys keys = convert(arena, &track);
  double travelled = 0;
  for (uint32_t i = 1; i < keys.key_count; i++)
    travelled += angle_between(keys.values + 4 * i - 4, keys.values + 4 * i);
  assert_true(fabs(travelled / DEGREE - 720) < 0.1);
  assert_true(largest_error(&track, &keys) <= 0.1);
  assert_true(keys.key_count <= 33);
}

TEST_WITH(axis_that_turns_is_followed, set_up, tear_down) {
  tw_arena *arena = *state;
  const double turns[3][4] = {{1, 0, 0, 1}, {0, 1, 0, 9}, {0, 0, 1, -2}};
  tw_track_keys track = axis_angle_keys(times, turns[0], 3);
  tw_track_keys keys = convert(arena, &track);
  assert_true(largest_error(&track, &keys) <= 0.1);
}

TEST_WITH(nlerp_and_squad_stray_less_than_a_tenth_of_a_degree, set_up, tear_down) {
  tw_arena *arena = *state;
  static const tw_interpolation kinds[] = {TW_NLERP, TW_SQUAD};
  for (int k = 0; k < 2; k++) {
    tw_track_keys track = rotation(kinds[k]);
    tw_track_keys keys = convert(arena, &track);
    assert_true(largest_error(&track, &keys) <= 0.1);
    assert_true(keys.key_count > 4);
  }
}

TEST_WITH(times_rise_however_near_the_keys, set_up, tear_down) {
  tw_arena *arena = *state;
  const float near[3] = {1, 1.0000001f, 1.0000004f};
  const double eulers[3][3] = {{0, 0, 0}, {3, 1, 2}, {0, -1, 5}};
  tw_track_keys track = euler_keys(TW_XYZ, times, eulers[0], 3);
  track.times = near;
  tw_track_keys keys = convert(arena, &track);
  assert_true(keys.key_count >= 3);
  for (uint32_t i = 1; i < keys.key_count; i++) assert_true(keys.times[i] > keys.times[i - 1]);
  assert_true(keys.times[keys.key_count - 1] == near[2]);
}

TEST_WITH(more_turns_than_keys_are_refused, set_up, tear_down) {
  tw_arena *arena = *state;
  const double turns[2][4] = {{0, 0, 1, 0}, {0, 0, 1, 1e9}};
  tw_track_keys track = axis_angle_keys(times, turns[0], 2);
  tw_track_keys keys;
  assert_int_equal(tw_gltf_keys_of(&track, 1 << 20, &(uint64_t){TW_REDUCTION_STEPS}, arena, &keys, NULL),
                   TW_LIMIT);
}

TEST_WITH(single_key_is_a_key, set_up, tear_down) {
  tw_arena *arena = *state;
  static const tw_interpolation kinds[] = {TW_STEP, TW_LINEAR, TW_NLERP, TW_SQUAD};
  for (int k = 0; k < 4; k++) {
    tw_track_keys track = rotation(kinds[k]);
    track.key_count = 1;
    tw_track_keys keys = convert(arena, &track);
    assert_int_equal(keys.key_count, 1);
    assert_memory_equal(keys.values, quaternions[0], 16);
  }
}

TEST_WITH(straight_keys_are_the_tracks_own, set_up, tear_down) {
  tw_arena *arena = *state;
  static const float straight[2][4] = {{0, 0, 0, 1}, {0, 0.6f, 0, 0.8f}};
  static const tw_interpolation kinds[] = {TW_STEP, TW_LINEAR};
  for (int k = 0; k < 2; k++) {
    tw_track_keys track = rotation(kinds[k]);
    track.key_count = 2;
    track.values = straight[0];
    assert_ptr_equal(convert(arena, &track).values, straight);
  }
}

TEST_WITH(a_spline_is_written_as_it_stands, set_up, tear_down) {
  tw_arena *arena = *state;
  const float keyed[2][3][4] = {{{0, 0, 0, 0}, {0, 0, 0, 1.00001f}, {4, 0, 0, 0}},
                                {{0, 3, 0, 0}, {0, 0, 0, -1}, {1, 0, 0, 0}}};
  tw_track_keys track = quaternion_keys(TW_CUBICSPLINE, times, keyed[0][0], 2);
  tw_track_keys keys = convert(arena, &track);
  assert_int_equal(keys.interpolation, TW_CUBICSPLINE);
  assert_ptr_equal(keys.values, keyed);
}

TEST_WITH(a_spline_of_long_and_short_keys_keeps_its_motion, set_up, tear_down) {
  tw_arena *arena = *state;
  const float keyed[4][3][4] = {{{0, 0, 0, 0}, {0, 0, 0, 2}, {4, 0, 0, 0}},
                                {{0, 3, 0, 0}, {0, 0.5f, 0, -1}, {1, 0, 0, 0}},
                                {{0, 0, 1, 0}, {0.3f, 0, 0, 0.1f}, {0, 1, 0, 0}},
                                {{0, 0, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 0}}};
  tw_track_keys track = quaternion_keys(TW_CUBICSPLINE, times, keyed[0][0], 4);
  tw_track_keys keys = convert(arena, &track);
  assert_int_equal(keys.interpolation, TW_LINEAR);
  assert_true(largest_error(&track, &keys) <= 0.1);
}

TEST_WITH(spline_of_one_key_is_a_step, set_up, tear_down) {
  tw_arena *arena = *state;
  const float keyed[3][3] = {{1, 1, 1}, {2, 3, 4}, {5, 5, 5}};
  tw_track_keys track = value_keys(TW_SCALE, TW_CUBICSPLINE, times, keyed[0], 1);
  tw_track_keys keys = convert(arena, &track);
  assert_int_equal(keys.interpolation, TW_STEP);
  assert_ptr_equal(keys.values, keyed[1]);
}

/* The clips of an answer share the steps that are not their own. */
TEST_WITH(turns_of_all_tracks_share_their_steps, set_up, tear_down) {
  tw_arena *arena = *state;
  const double turns[2][4] = {{0, 0, 1, 0}, {0, 0, 1, 1e5}}; /* radians: 573,000 steps of ten degrees */
  tw_track_keys track = axis_angle_keys(times, turns[0], 2), keys;
  uint64_t steps = TW_REDUCTION_STEPS;
  assert_int_equal(tw_gltf_keys_of(&track, 1 << 20, &steps, arena, &keys, NULL), TW_OK);
  assert_true(keys.key_count > 1e5 / 2.7);
  assert_true(steps < TW_REDUCTION_STEPS - 500000 && steps > 0);
  assert_int_equal(tw_gltf_keys_of(&track, 1 << 20, &steps, arena, &keys, NULL), TW_LIMIT);
  const double few[2][4] = {{0, 0, 1, 0}, {0, 0, 1, 10}};
  steps = 0;
  track = axis_angle_keys(times, few[0], 2);
  assert_int_equal(tw_gltf_keys_of(&track, 1 << 20, &steps, arena, &keys, NULL), TW_OK);
  assert_int_equal(steps, 0);
}

/* From the second question on. */
static bool is_over(void *owner) {
  return (*(int *)owner)++ > 0;
}

TEST_WITH(a_reduction_that_nobody_wants_ends, set_up, tear_down) {
  tw_arena *arena = *state;
  const double turns[2][4] = {{0, 0, 1, 0}, {0, 0, 1, 1e5}};
  tw_track_keys track = axis_angle_keys(times, turns[0], 2), keys;
  int questions = 0;
  const tw_meter_host host = {.owner = &questions, .is_over = is_over};
  tw_meter meter;
  tw_meter_init(&meter, &host, UINT64_MAX);
  tw_meter *before = tw_meter_use(&meter);
  tw_status status = tw_gltf_keys_of(&track, 1 << 20, &(uint64_t){TW_REDUCTION_STEPS}, arena, &keys, NULL);
  if (status == TW_NO_MEMORY) status = tw_work_status(NULL); /* what is allocated from then on fails */
  tw_meter_use(before);
  assert_int_equal(status, TW_CANCELLED);
}
