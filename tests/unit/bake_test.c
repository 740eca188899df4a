/* Baked and reduced clips against the clips that they come from. */
#include <stdlib.h>
#include <string.h>

#include "host.h"
#include "keys.h"
#include "rotation_reference.h"

static double distance(tw_path path, const float *a, const float *b) {
  if (path == TW_ROTATION) return ref_angle(ref_of(a), ref_of(b));
  double sum = 0;
  for (int i = 0; i < 3; i++) sum += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
  return sqrt(sum);
}

/* The largest difference between a track and its replacement, sampled 20,000 times. */
static double largest_difference(const tw_clip *before, const tw_clip *after, uint32_t track, tw_path path) {
  double largest = 0;
  float end = tw_clip_duration(before);
  for (int i = 0; i <= 20000; i++) {
    float at = end * (float)i / 20000, a[4], b[4];
    tw_clip_sample(before, track, &at, 1, a);
    tw_clip_sample(after, track, &at, 1, b);
    largest = fmax(largest, distance(path, a, b));
  }
  return largest;
}

static const float times_0_1_3[] = {0, 1, 3};
static const float plain_rotations[] = {0, 0, 0, 1, 1, 0, 0, 0, 0, 0.6f, 0, 0.8f};
static const tw_tolerance hundredth = {0.01 * REF_DEGREES, 1e-4};

TEST(times_to_bake_must_rise) {
  tw_track_keys track = quaternion_keys(TW_LINEAR, times_0_1_3, plain_rotations, 3);
  tw_clip *clip = clip_of(&track, 1, -1);
  tw_arena *arena = tw_arena_create();
  const float bad[][3] = {{0, 1, 1}, {-1, 0, 1}, {0, NAN, 2}};
  const char *pointers[] = {"/times/2", "/times/0", "/times/1"};
  tw_clip_keys out;
  tw_error error;
  for (int i = 0; i < 3; i++) {
    assert_int_equal(tw_clip_bake(clip, bad[i], 3, arena, &out, &error), TW_INVALID);
    assert_string_equal(error.pointer, pointers[i]);
  }
  assert_int_equal(tw_clip_bake(clip, bad[0], 0, arena, &out, &error), TW_INVALID);
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
}

TEST(tolerances_must_be_possible_and_keys_few_enough) {
  const double angles[] = {0, 0, 0, 400, 300, 200};
  tw_track_keys track = euler_keys(TW_XYZ, times_0_1_3, angles, 2);
  tw_clip_keys keys = {.track_count = 1, .tracks = &track}, out;
  tw_clip *clip = clip_of(&track, 1, -1);
  tw_arena *arena = tw_arena_create();
  tw_tolerance reached;
  const tw_tolerance none = {0, 1}, not_a_number = {1, NAN};
  assert_int_equal(
      tw_clip_reduce(clip, &keys, none, 1000, &(uint64_t){TW_REDUCTION_STEPS}, arena, &out, &reached, NULL),
      TW_INVALID);
  assert_int_equal(tw_clip_reduce(clip, &keys, not_a_number, 1000, &(uint64_t){TW_REDUCTION_STEPS}, arena,
                                  &out, &reached, NULL),
                   TW_INVALID);
  assert_int_equal(tw_clip_reduce(clip, &keys, hundredth, 100, &(uint64_t){TW_REDUCTION_STEPS}, arena, &out,
                                  &reached, NULL),
                   TW_LIMIT);
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
}

TEST(what_all_tracks_of_a_clip_take_is_limited) {
  enum { TRACKS = 4 };
  const double turns[] = {0, 1, 0, 0, 0, 1, 0, 6000}; /* 34,400 steps of 10 degrees */
  tw_track_keys tracks[TRACKS];
  for (uint32_t i = 0; i < TRACKS; i++) {
    tracks[i] = axis_angle_keys(times_0_1_3, turns, 2);
    tracks[i].node = i;
  }
  for (uint32_t count = 3; count <= TRACKS; count++) {
    tw_clip_keys keys = {.track_count = count, .tracks = tracks}, out;
    tw_clip *clip = clip_of(tracks, count, -1);
    tw_arena *arena = tw_arena_create();
    tw_tolerance reached, loose = {0.1, 1};
    tw_error error = {0};
    tw_status status = tw_clip_reduce(clip, &keys, loose, 1000000, &(uint64_t){TW_REDUCTION_STEPS / 10},
                                      arena, &out, &reached, &error);
    assert_int_equal(status, count == 3 ? TW_OK : TW_LIMIT);
    tw_arena_destroy(arena);
    tw_clip_destroy(clip);
  }
}

TEST(baked_keys_are_the_samples_at_exactly_those_times) {
  const double turns[] = {0, 1, 0, 0, 0, 1, 0, 150, 0, 1, 0, 0};
  tw_track_keys tracks[] = {axis_angle_keys(times_0_1_3, turns, 3),
                            value_keys(TW_SCALE, TW_STEP, times_0_1_3, plain_rotations, 3)};
  tw_clip *clip = clip_of(tracks, 2, -1), *baked;
  tw_arena *arena = tw_arena_create();
  float times[50];
  for (int i = 0; i < 50; i++) times[i] = 0.25f + (float)i * 0.07f;
  tw_clip_keys out;
  assert_int_equal(tw_clip_bake(clip, times, 50, arena, &out, NULL), TW_OK);
  assert_int_equal(out.track_count, 2);
  assert_int_equal(out.tracks[0].interpolation, TW_LINEAR);
  assert_int_equal(out.tracks[1].interpolation, TW_STEP);
  baked = clip_of(out.tracks, 2, -1);
  for (int i = 0; i < 50; i++)
    for (uint32_t track = 0; track < 2; track++) {
      float a[4], b[4];
      assert_true(out.tracks[track].times[i] == times[i]);
      tw_clip_sample(clip, track, &times[i], 1, a);
      tw_clip_sample(baked, track, &times[i], 1, b);
      assert_true(distance(tracks[track].path, a, b) == 0);
      const float *key = out.tracks[0].values + 4 * (size_t)i;
      if (i > 0) assert_true(ref_dot(ref_of(key), ref_of(key - 4)) >= 0);
    }
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
  tw_clip_destroy(baked);
}

/* ---- the error of keys at given times -------------------------------------------------------- */

/* Bakes one track at times; checks that the error that is told is the one that is found. */
static void assert_told(const tw_track_keys *track, const float *times, uint32_t count) {
  tw_clip *clip = clip_of(track, 1, -1), *baked;
  tw_arena *arena = tw_arena_create();
  tw_clip_keys out;
  tw_tolerance reached;
  assert_int_equal(tw_clip_bake(clip, times, count, arena, &out, NULL), TW_OK);
  assert_int_equal(tw_clip_bake_error(clip, &out, NULL, &reached, NULL), TW_OK);
  baked = clip_of(out.tracks, 1, -1);
  double told = track->path == TW_ROTATION ? reached.angle : reached.distance, found = 0;
  for (int i = 0; i <= 20000; i++) {
    float at = times[0] + (times[count - 1] - times[0]) * (float)i / 20000, a[4], b[4];
    tw_clip_sample(clip, 0, &at, 1, a);
    tw_clip_sample(baked, 0, &at, 1, b);
    found = fmax(found, distance(track->path, a, b));
  }
  if (found > told * 16 / 15 + 2e-6 || told > found * 1.01 + 1e-4) fail_msg("told %g, found %g", told, found);
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
  tw_clip_destroy(baked);
}

TEST(the_error_of_keys_at_given_times_is_told) {
  uint64_t seed = 12;
  for (int n = 0; n < 140; n++) {
    float times[8], values[24][4], at[40];
    double angles[8][4], time = ref_random(&seed), baked = n % 3 ? 0 : 2 * ref_random(&seed);
    for (size_t i = 0; i < 8; i++) {
      times[i] = (float)time;
      time += 0.05 + 2 * ref_random(&seed) * ref_random(&seed);
      for (size_t j = 0; j < 3; j++) ref_narrow(ref_random_unit(&seed), values[3 * i + j]);
      for (size_t j = 0; j < 4; j++) angles[i][j] = ref_between(&seed, -4, 4);
    }
    uint32_t count = 2 + (uint32_t)n % 39;
    for (uint32_t i = 0; i < count; i++) {
      at[i] = (float)baked;
      baked += 0.01 + ref_random(&seed) * 20 / count; /* some beyond the end */
    }
    tw_track_keys tracks[] = {quaternion_keys(TW_LINEAR, times, values[0], 8),
                              quaternion_keys(TW_NLERP, times, values[0], 8),
                              quaternion_keys(TW_CUBICSPLINE, times, values[0], 8),
                              quaternion_keys(TW_SQUAD, times, values[0], 8),
                              euler_keys(TW_XYZ, times, angles[0], 6),
                              value_keys(TW_TRANSLATION, TW_LINEAR, times, values[0], 8),
                              value_keys(TW_TRANSLATION, TW_CUBICSPLINE, times, values[0], 8)};
    assert_told(&tracks[n % 7], at, count);
  }
}

TEST(steps_that_come_late_are_told) {
  uint64_t seed = 34;
  for (int n = 0; n < 60; n++) {
    float times[8], values[8][4], at[12];
    double time = ref_random(&seed), baked = 2 * ref_random(&seed);
    for (size_t i = 0; i < 8; i++) {
      times[i] = (float)time;
      time += 0.2 + ref_random(&seed);
      ref_narrow(ref_random_unit(&seed), values[i]);
    }
    uint32_t count = 2 + (uint32_t)n % 11;
    for (uint32_t i = 0; i < count; i++) {
      at[i] = (float)baked;
      baked += 0.1 + ref_random(&seed);
    }
    tw_track_keys tracks[] = {quaternion_keys(TW_STEP, times, values[0], 8),
                              value_keys(TW_TRANSLATION, TW_STEP, times, values[0], 8)};
    assert_told(&tracks[n % 2], at, count);
  }
  /* With a key at the time of each jump, none comes late. */
  tw_track_keys track = value_keys(TW_SCALE, TW_STEP, times_0_1_3, plain_rotations, 3);
  assert_told(&track, times_0_1_3, 3);
}

TEST(half_turns_and_steps_are_told_for_what_they_are) {
  const double turns[] = {1, 2, 3, 0, 1, 2, 3, 6 * REF_PI};
  tw_track_keys tracks[] = {axis_angle_keys(times_0_1_3, turns, 2),
                            value_keys(TW_SCALE, TW_STEP, times_0_1_3, plain_rotations, 3)};
  tw_clip *clip = clip_of(tracks, 2, -1);
  tw_arena *arena = tw_arena_create();
  tw_clip_keys out;
  tw_tolerance reached;
  /* From 0 to 6 pi in a second: half a turn in a sixth. */
  const float quarters[] = {0, 1 / 12.f, 2 / 12.f}, halves[] = {0, 1 / 6.f};
  assert_int_equal(tw_clip_bake(clip, quarters, 3, arena, &out, NULL), TW_OK);
  assert_int_equal(tw_clip_bake_error(clip, &out, NULL, &reached, NULL), TW_OK);
  assert_true(reached.angle < 1e-6 && reached.distance == 0);
  assert_int_equal(tw_clip_bake(clip, halves, 2, arena, &out, NULL), TW_OK);
  assert_int_equal(tw_clip_bake_error(clip, &out, NULL, &reached, NULL), TW_OK);
  assert_true(fabs(reached.angle - REF_PI) < 1e-6);
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
}

TEST(measuring_keys_asks_whether_the_result_is_wanted) {
  enum { TIMES = 20000 };
  tw_track_keys track = quaternion_keys(TW_NLERP, times_0_1_3, plain_rotations, 3);
  tw_clip *clip = clip_of(&track, 1, -1);
  tw_arena *arena = tw_arena_create();
  float *times = malloc(TIMES * sizeof *times);
  assert_non_null(times);
  for (int i = 0; i < TIMES; i++) times[i] = (float)i * 1e-4f;
  tw_clip_keys out;
  tw_tolerance reached;
  uint32_t questions = 10;
  const tw_parallel_for parallel = {.owner = &questions, .is_cancelled = wants_no_more};
  assert_int_equal(tw_clip_bake(clip, times, TIMES, arena, &out, NULL), TW_OK);
  assert_int_equal(tw_clip_bake_error(clip, &out, &parallel, &reached, NULL), TW_CANCELLED);
  questions = 30;
  assert_int_equal(tw_clip_bake_error(clip, &out, &parallel, &reached, NULL), TW_OK);
  free(times);
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
}

/* ---- reduction ------------------------------------------------------------------------------- */

/* Checks that every player turns the same way between keys: no two are near 180 degrees apart. */
static void assert_short_steps(const tw_track_keys *track) {
  for (size_t i = 1; track->path == TW_ROTATION && i < track->key_count; i++) {
    const float *key = track->values + 4 * i;
    double angle = ref_angle(ref_of(key - 4), ref_of(key));
    if (angle > 155 * REF_DEGREES)
      fail_msg("key %zu is %g degrees from the one before", i, angle / REF_DEGREES);
  }
}

/* Reduces one track, checks the error that is told against the one that is found; returns the keys left. */
static uint32_t reduced_count(const tw_track_keys *track, int force, tw_tolerance tolerance) {
  tw_clip_keys keys = {.track_count = 1, .tracks = track}, out;
  tw_clip *clip = clip_of(track, 1, force), *reduced;
  tw_arena *arena = tw_arena_create();
  tw_tolerance reached;
  assert_int_equal(tw_clip_reduce(clip, &keys, tolerance, 1000000, &(uint64_t){TW_REDUCTION_STEPS}, arena,
                                  &out, &reached, NULL),
                   TW_OK);
  uint32_t count = out.tracks[0].key_count;
  assert_short_steps(out.tracks);
  reduced = clip_of(out.tracks, 1, -1);
  assert_true(tw_clip_duration(reduced) == tw_clip_duration(clip));
  double allowed = track->path == TW_ROTATION ? tolerance.angle : tolerance.distance;
  double told = track->path == TW_ROTATION ? reached.angle : reached.distance;
  double found = largest_difference(clip, reduced, 0, track->path);
  if (told > allowed + 1e-6 || found > told + 1e-6)
    fail_msg("allowed %g, told %g, found %g", allowed, told, found);
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
  tw_clip_destroy(reduced);
  return count;
}

TEST(every_kind_of_track_is_reduced_within_its_tolerance) {
  uint64_t seed = 11;
  for (int n = 0; n < 60; n++) {
    float times[8], values[8][4];
    double angles[8][4], time = 0;
    for (int i = 0; i < 8; i++) {
      times[i] = (float)time;
      time += 0.05 + 2 * ref_random(&seed) * ref_random(&seed);
      ref_narrow(ref_random_unit(&seed), values[i]);
      for (int j = 0; j < 4; j++) angles[i][j] = ref_between(&seed, -4, 4);
    }
    tw_tolerance tolerance = {exp(ref_between(&seed, -9, -2)), exp(ref_between(&seed, -9, -2))};
    tw_track_keys tracks[] = {quaternion_keys(TW_LINEAR, times, values[0], 8),
                              quaternion_keys(TW_NLERP, times, values[0], 8),
                              quaternion_keys(TW_SQUAD, times, values[0], 8),
                              euler_keys(TW_XYZ, times, angles[0], 6),
                              axis_angle_keys(times, angles[0], 8),
                              value_keys(TW_TRANSLATION, TW_LINEAR, times, values[0], 8)};
    assert_true(reduced_count(&tracks[n % 6], n % 12 == 0 ? TW_EULER : -1, tolerance) >= 2);
  }
}

TEST(keys_along_one_arc_shrink_to_its_ends) {
  float times[100], values[100][4], moves[100][3];
  for (int i = 0; i < 100; i++) {
    times[i] = (float)i * 0.1f;
    ref_narrow(ref_axis_angle(1, 2, 3, 0.025 * (double)times[i] * 10), values[i]);
    for (int j = 0; j < 3; j++) moves[i][j] = times[i] * (float)(j + 1);
  }
  tw_track_keys turned = quaternion_keys(TW_LINEAR, times, values[0], 100);
  tw_track_keys moved = value_keys(TW_TRANSLATION, TW_LINEAR, times, moves[0], 100);
  assert_int_equal(reduced_count(&turned, -1, hundredth), 2);
  assert_int_equal(reduced_count(&moved, -1, hundredth), 2);
  moves[60][1] += 1; /* a bump needs its foot on both sides and its top */
  assert_int_equal(reduced_count(&moved, -1, hundredth), 5);
}

TEST(turns_are_cut_well_below_180_degrees) {
  const double turns[] = {0, 1, 0, 0, 0, 1, 0, 20 * REF_PI}, two_turns[] = {1, 0, 0, 0, 1, 0, 0, 4 * REF_PI};
  const double half_turns[] = {30, 40, 50, 10, 20, 210}, coarse = 2 * REF_DEGREES;
  tw_track_keys track = axis_angle_keys(times_0_1_3, turns, 2);
  uint32_t count = reduced_count(&track, -1, hundredth);
  assert_int_equal(count, 25); /* in steps of 150 degrees: 3600 / 150, and the first one */
  track = axis_angle_keys(times_0_1_3, two_turns, 2);
  assert_int_equal(reduced_count(&track, -1, (tw_tolerance){coarse, 1}), 6);
  track = euler_keys(TW_XYZ, times_0_1_3, half_turns, 2);
  assert_true(reduced_count(&track, -1, (tw_tolerance){REF_PI, 1}) >= 3);
  track = quaternion_keys(TW_LINEAR, times_0_1_3, plain_rotations, 2); /* exactly 180 degrees */
  assert_int_equal(reduced_count(&track, -1, hundredth), 3);
  track.interpolation = TW_NLERP;
  assert_true(reduced_count(&track, -1, (tw_tolerance){REF_PI, 1}) >= 3);
}

TEST(a_short_bump_of_a_long_track_is_told) {
  const float times[] = {0, 1, 1.001f, 1.002f, 2, 2.001f, 2.002f, 1000};
  const float moves[] = {0, 0, 0, 0, 0, 0, 0.5f, 0, 0, 0, 0, 0, 0, 0, 0, 0.5f, 0.5f, 0, 0, 0, 0, 0, 0, 0};
  tw_track_keys track = value_keys(TW_TRANSLATION, TW_LINEAR, times, moves, 8);
  tw_clip_keys keys = {.track_count = 1, .tracks = &track}, out;
  tw_clip *clip = clip_of(&track, 1, -1);
  tw_arena *arena = tw_arena_create();
  tw_tolerance reached;
  const tw_tolerance loose = {1, 0.8};
  assert_int_equal(
      tw_clip_reduce(clip, &keys, loose, 100, &(uint64_t){TW_REDUCTION_STEPS}, arena, &out, &reached, NULL),
      TW_OK);
  assert_int_equal(out.tracks[0].key_count, 2);
  assert_true(fabs(reached.distance - sqrt(0.5)) < 1e-6);
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
}

TEST(looser_tolerances_leave_fewer_keys) {
  const double angles[] = {0, 0, 0, 2, 1, -2, -1, 3, 1};
  tw_track_keys track = euler_keys(TW_XYZ, times_0_1_3, angles, 3);
  uint32_t before = UINT32_MAX;
  for (int power = -3; power <= 0; power++) {
    uint32_t count = reduced_count(&track, -1, (tw_tolerance){pow(10, power) * REF_DEGREES, 1});
    assert_true(count < before);
    /* A chord's error goes with the square of its length: a tenth of the error, about three times the keys.
     */
    if (before != UINT32_MAX && count > 20)
      assert_true((double)before / count > 2.5 && (double)before / count < 4);
    before = count;
  }
}

TEST(a_still_track_keeps_one_key_unless_it_gives_the_duration) {
  const float still[] = {1, 2, 3, 1, 2, 3, 1, 2, 3};
  tw_track_keys tracks[] = {value_keys(TW_SCALE, TW_LINEAR, times_0_1_3, still, 2),
                            quaternion_keys(TW_LINEAR, times_0_1_3, plain_rotations, 3)};
  tw_clip_keys keys = {.track_count = 2, .tracks = tracks}, out;
  tw_clip *clip = clip_of(tracks, 2, -1);
  tw_arena *arena = tw_arena_create();
  tw_tolerance reached;
  assert_int_equal(tw_clip_reduce(clip, &keys, hundredth, 100, &(uint64_t){TW_REDUCTION_STEPS}, arena, &out,
                                  &reached, NULL),
                   TW_OK);
  assert_int_equal(out.tracks[0].key_count, 1);
  assert_int_equal(out.tracks[1].key_count, 5); /* one within each step of 180 degrees */
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
  tracks[0].key_count = 3;
  assert_int_equal(reduced_count(&tracks[0], -1, hundredth), 2);
}

TEST(steps_and_splines_stay_as_they_are) {
  float spline[3][3][3] = {{{0}}};
  for (int i = 0; i < 27; i++) spline[i / 9][i / 3 % 3][i % 3] = (float)i;
  tw_track_keys tracks[] = {value_keys(TW_TRANSLATION, TW_CUBICSPLINE, times_0_1_3, spline[0][0], 3),
                            quaternion_keys(TW_STEP, times_0_1_3, plain_rotations, 3)};
  tw_clip_keys keys = {.track_count = 2, .tracks = tracks}, out;
  tw_clip *clip = clip_of(tracks, 2, -1);
  tw_arena *arena = tw_arena_create();
  tw_tolerance reached;
  assert_int_equal(tw_clip_reduce(clip, &keys, hundredth, 100, &(uint64_t){TW_REDUCTION_STEPS}, arena, &out,
                                  &reached, NULL),
                   TW_OK);
  assert_int_equal(out.tracks[0].interpolation, TW_CUBICSPLINE);
  assert_memory_equal(out.tracks[0].values, spline, sizeof spline);
  assert_int_equal(out.tracks[1].interpolation, TW_STEP);
  assert_memory_equal(out.tracks[1].times, times_0_1_3, sizeof times_0_1_3);
  assert_memory_equal(out.tracks[1].values, plain_rotations, sizeof plain_rotations);
  assert_true(reached.angle == 0 && reached.distance == 0);
  tw_arena_destroy(arena);
  tw_clip_destroy(clip);
}
