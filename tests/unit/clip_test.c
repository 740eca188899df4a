/* Clips: what is refused, what happens to keys, times outside them. */
#include <string.h>

#include "clip.h"
#include "keys.h"
#include "rotation_reference.h"

static const float two_times[] = {0, 1};
static const float identity_pair[] = {0, 0, 0, 1, 0, 0, 0, 1};

static void assert_refused(const tw_track_keys *tracks, uint32_t count, int force, const char *pointer) {
  tw_clip_keys keys = {.track_count = count, .tracks = tracks};
  tw_clip *clip = NULL;
  tw_error error = {0};
  assert_int_equal(tw_clip_create(&keys, 2, force, &clip, &error), TW_INVALID);
  assert_null(clip);
  assert_string_equal(error.pointer, pointer);
  assert_true(error.detail[0] != '\0');
  assert_int_equal(tw_clip_create(&keys, 2, force, &clip, NULL), TW_INVALID);
}

TEST(times_must_be_finite_not_negative_and_rising) {
  const float bad[][3] = {{0, NAN, 2}, {0, INFINITY, 2}, {-1, 0, 2}, {0, 1, 1}, {0, 2, 1}};
  const char *pointers[] = {"/tracks/0/times/1", "/tracks/0/times/1", "/tracks/0/times/0",
                            "/tracks/0/times/2", "/tracks/0/times/2"};
  const float values[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    tw_track_keys track = quaternion_keys(TW_LINEAR, bad[i], values, 3);
    assert_refused(&track, 1, -1, pointers[i]);
  }
}

/* A key's time, and the number of the key that the value comes from. */
typedef struct kept_key {
  float time;
  uint32_t key;
} kept_key;

static void assert_kept(const float *times, uint32_t count, uint32_t duplicates, const kept_key *kept,
                        uint32_t kept_count) {
  float values[8][3][3];
  double eulers[8][3];
  for (size_t i = 0; i < 72; i++) values[i / 9][i / 3 % 3][i % 3] = (float)(i / 9);
  for (size_t i = 0; i < 24; i++) eulers[i / 3][i % 3] = (double)(i / 3);
  tw_track_keys tracks[] = {value_keys(TW_TRANSLATION, TW_CUBICSPLINE, times, values[0][0], count),
                            euler_keys(TW_XYZ, times, eulers[0], count),
                            value_keys(TW_SCALE, TW_LINEAR, two_times, values[0][0], 2)};
  tw_clip_keys clip = {.track_count = 3, .tracks = tracks};
  tw_arena *arena = tw_arena_create();
  assert_int_equal(tw_clip_check(&clip, 1, -1, true, NULL), TW_OK);
  assert_int_equal(tw_clip_separate(&clip, arena, NULL), TW_OK);
  assert_int_equal(tw_clip_check(&clip, 1, -1, false, NULL), TW_OK);
  for (int t = 0; t < 2; t++) {
    const tw_track_keys *track = &clip.tracks[t];
    assert_int_equal(track->duplicate_times, duplicates);
    assert_int_equal(track->key_count, kept_count);
    for (uint32_t i = 0; i < kept_count; i++) {
      assert_true(track->times[i] == kept[i].time);
      for (size_t j = 0; j < 9 && t == 0; j++) assert_true(track->values[9 * i + j] == (float)kept[i].key);
      for (size_t j = 0; j < 3 && t == 1; j++) assert_true(track->angles[3 * i + j] == kept[i].key);
    }
  }
  assert_memory_equal(&clip.tracks[2], &tracks[2], sizeof tracks[2]);
  tw_arena_destroy(arena);
}

TEST(of_keys_at_one_time_the_first_is_moved_and_the_last_stays) {
  const float below = nextafterf(1, 0), above = nextafterf(1, 2);
  assert_kept((float[]){0, 1, 1, 2}, 4, 1, (kept_key[]){{0, 0}, {below, 1}, {1, 2}, {2, 3}}, 4);
  assert_kept((float[]){1, 1, 1, 1, 3}, 5, 3, (kept_key[]){{below, 0}, {1, 3}, {3, 4}}, 3);
  assert_kept((float[]){0, 0, 1, 1}, 4, 2, (kept_key[]){{0, 1}, {below, 2}, {1, 3}},
              3);                                                                     /* none is negative */
  assert_kept((float[]){1, above, above}, 3, 1, (kept_key[]){{1, 0}, {above, 2}}, 2); /* no room between */
  assert_kept((float[]){0, 0}, 2, 1, (kept_key[]){{0, 1}}, 1);
}

TEST(values_must_be_finite_and_rotations_not_zero) {
  const float not_finite[] = {0, 0, 0, 1, 0, NAN, 0, 1}, zero[] = {0, 0, 0, 1, 0, 0, 0, 0};
  tw_track_keys track = quaternion_keys(TW_LINEAR, two_times, not_finite, 2);
  assert_refused(&track, 1, -1, "/tracks/0/quaternions/1");
  track = quaternion_keys(TW_LINEAR, two_times, zero, 2);
  assert_refused(&track, 1, -1, "/tracks/0/quaternions/1");

  const float moved[] = {0, 0, 0, 0, INFINITY, 0};
  track = value_keys(TW_TRANSLATION, TW_LINEAR, two_times, moved, 2);
  assert_refused(&track, 1, -1, "/tracks/0/values/1");

  const double no_axis[] = {1, 0, 0, 1, 0, 0, 0, 1}, endless[] = {0, 0, 0, 0, 1e10, 0};
  track = axis_angle_keys(two_times, no_axis, 2);
  assert_refused(&track, 1, -1, "/tracks/0/axis_angles/1");
  track.form = TW_KEY_EULER;
  track.width = 3;
  track.angles = endless;
  assert_refused(&track, 1, -1, "/tracks/0/eulers/1");
}

TEST(tangents_must_be_finite) {
  float values[24] = {0};
  values[7] = values[19] = 1;
  values[11] = NAN; /* out-tangent of the first key */
  tw_track_keys track = quaternion_keys(TW_LINEAR, two_times, values, 2);
  track.interpolation = TW_CUBICSPLINE;
  assert_refused(&track, 1, -1, "/tracks/0/quaternions/0");
}

TEST(nodes_widths_and_paths_must_fit) {
  tw_track_keys track = quaternion_keys(TW_LINEAR, two_times, identity_pair, 2);
  track.node = 2;
  assert_refused(&track, 1, -1, "/tracks/0/node");
  track.node = 0;
  track.width = 3;
  assert_refused(&track, 1, -1, "/tracks/0/quaternions");
  track.width = 4;
  track.key_count = 0;
  assert_refused(&track, 1, -1, "/tracks/0/times");
  track = value_keys(TW_SCALE, TW_LINEAR, two_times, identity_pair, 2);
  track.width = 4;
  assert_refused(&track, 1, -1, "/tracks/0/values");
  track.path = TW_WEIGHTS;
  track.width = 0;
  assert_refused(&track, 1, -1, "/tracks/0/values");
}

TEST(two_tracks_on_one_path_are_refused) {
  tw_track_keys tracks[] = {quaternion_keys(TW_LINEAR, two_times, identity_pair, 2),
                            value_keys(TW_SCALE, TW_LINEAR, two_times, identity_pair, 2),
                            quaternion_keys(TW_LINEAR, two_times, identity_pair, 2)};
  assert_refused(tracks, 3, -1, "/tracks/2/path");
  tracks[2].node = 1;
  tw_clip_destroy(clip_of(tracks, 3, -1));
}

TEST(interpolations_go_with_paths_and_forms) {
  const double eulers[] = {0, 0, 0, 1, 1, 1};
  tw_track_keys track = quaternion_keys(TW_LINEAR, two_times, identity_pair, 2);
  track.interpolation = TW_EULER;
  assert_refused(&track, 1, -1, "/tracks/0/interpolation");
  track = value_keys(TW_TRANSLATION, TW_LINEAR, two_times, identity_pair, 2);
  track.interpolation = TW_SQUAD;
  assert_refused(&track, 1, -1, "/tracks/0/interpolation");
  track = euler_keys(TW_XYZ, two_times, eulers, 2);
  track.interpolation = TW_CUBICSPLINE;
  assert_refused(&track, 1, -1, "/tracks/0/interpolation");
  track.interpolation = TW_EULER;
  assert_refused(&track, 1, TW_CUBICSPLINE, "/tracks/0/interpolation");
  for (int force = -1; force <= TW_EULER; force++)
    if (force != TW_CUBICSPLINE) tw_clip_destroy(clip_of(&track, 1, force));
}

TEST(an_empty_clip_leaves_nodes_at_rest) {
  tw_clip *clip = clip_of(NULL, 0, -1);
  tw_node nodes[2] = {{.rest = TW_TRS_IDENTITY}, {.rest = TW_TRS_IDENTITY}};
  nodes[1].rest.translation[1] = 5;
  tw_trs locals[2];
  tw_clip_pose(clip, nodes, 2, 3, locals);
  assert_true(locals[1].translation[1] == 5);
  assert_true(tw_clip_duration(clip) == 0);
  assert_false(tw_clip_moves(clip, 0));
  tw_clip_destroy(clip);
  tw_clip_destroy(NULL);
}

TEST(keys_come_back_bit_for_bit_and_times_outside_clamp) {
  uint64_t seed = 5;
  float times[9], values[9][4], moves[9][3];
  ref_quat previous = {0, 0, 0, 1};
  for (int i = 0; i < 9; i++) {
    times[i] = 0.5f + (float)(i * i) * 0.37f;
    previous = ref_toward(ref_random_unit(&seed), previous);
    ref_narrow(previous, values[i]);
    for (int j = 0; j < 3; j++) moves[i][j] = (float)ref_between(&seed, -5, 5);
  }
  tw_node nodes[2] = {{.rest = TW_TRS_IDENTITY}, {.rest = TW_TRS_IDENTITY}};
  for (int force = -1; force <= TW_EULER; force++) {
    if (force == TW_CUBICSPLINE || force == TW_EULER) continue;
    tw_track_keys tracks[] = {quaternion_keys(TW_LINEAR, times, values[0], 9),
                              value_keys(TW_SCALE, TW_LINEAR, times, moves[0], 9)};
    tw_clip *clip = clip_of(tracks, 2, force);
    for (uint32_t path = TW_TRANSLATION; path <= TW_SCALE; path++) {
      assert_int_equal(tw_clip_find(clip, 0, path), path == TW_TRANSLATION ? TW_NO_INDEX : path - 1);
      assert_int_equal(tw_clip_find(clip, 1, path), TW_NO_INDEX);
    }
    tw_trs pose[2];
    for (int i = -1; i <= 9; i++) {
      int key = i < 0 ? 0 : i > 8 ? 8 : i;
      tw_clip_pose(clip, nodes, 2, i < 0 ? 0.25f : i > 8 ? 1e30f : times[i], pose);
      assert_memory_equal(pose[0].rotation, values[key], sizeof values[key]);
      assert_memory_equal(pose[0].scale, moves[key], sizeof moves[key]);
    }
    tw_clip_destroy(clip);
  }
}

TEST(a_single_key_holds_for_ever) {
  const float time[] = {2}, value[] = {0.6f, 0, 0, 0.8f};
  for (int force = -1; force <= TW_EULER; force++) {
    if (force == TW_CUBICSPLINE) continue;
    tw_track_keys track = quaternion_keys(TW_LINEAR, time, value, 1);
    tw_clip *clip = clip_of(&track, 1, force);
    for (int i = 0; i < 5; i++) {
      float at = (float)i, q[4];
      tw_clip_sample(clip, 0, &at, 1, q);
      assert_true(ref_angle(ref_of(q), ref_of(value)) < 1e-6);
    }
    tw_clip_destroy(clip);
  }
}

TEST(keys_are_normalised_and_their_signs_made_continuous) {
  const float times[] = {0, 1, 2}, values[] = {0, 0, 0, 2, 0, -0.6f, 0, -0.8f, 0, 1, 0, 0};
  tw_track_keys track = quaternion_keys(TW_LINEAR, times, values, 3);
  tw_clip *clip = clip_of(&track, 1, -1);
  float out[3][4];
  tw_clip_sample(clip, 0, times, 3, out[0]);
  assert_true(out[0][3] == 1);
  assert_true(out[1][1] == 0.6f && out[1][3] == 0.8f);
  assert_true(out[2][1] == 1);
  tw_clip_destroy(clip);
}

TEST(weights_are_sampled_by_track) {
  const float values[] = {0, 1, 2, 3, 4, 4, 4, 4, 4, 4};
  tw_track_keys track = value_keys(TW_WEIGHTS, TW_LINEAR, two_times, values, 2);
  track.width = 5;
  tw_clip *clip = clip_of(&track, 1, TW_SQUAD);
  float at = 0.5f, out[5];
  tw_clip_sample(clip, 0, &at, 1, out);
  for (int i = 0; i < 5; i++) assert_true(out[i] == (float)(i + 4) / 2);
  assert_int_equal(tw_clip_width(clip, 0), 5);
  assert_int_equal(tw_clip_find(clip, 0, TW_WEIGHTS), 0);
  assert_int_equal(tw_clip_find(clip, 0, TW_ROTATION), TW_NO_INDEX);
  assert_false(tw_clip_moves(clip, 0));
  tw_clip_destroy(clip);
}

TEST(crowded_and_denormal_key_times_are_found) {
  enum { KEYS = 2000 };
  static float times[KEYS], values[KEYS][3];
  for (int i = 0; i < KEYS; i++) {
    times[i] = i < KEYS - 1 ? (float)i * 1.4e-45f : 3e38f; /* all but the last in one bucket */
    values[i][0] = (float)i;
  }
  tw_track_keys track = value_keys(TW_TRANSLATION, TW_LINEAR, times, values[0], KEYS);
  track.interpolation = TW_STEP;
  tw_clip *clip = clip_of(&track, 1, -1);
  float out[KEYS][3];
  tw_clip_sample(clip, 0, times, KEYS, out[0]);
  assert_memory_equal(out, values, sizeof out);
  for (int i = KEYS; i-- > 0;) { /* one by one and backwards: found without a hint */
    tw_clip_sample(clip, 0, &times[i], 1, out[0]);
    assert_true(out[0][0] == (float)i);
  }
  tw_clip_destroy(clip);
}

TEST(loops_fold_time_into_the_clip) {
  assert_true(tw_loop_time(5, 2, TW_CLAMP) == 5);
  assert_true(tw_loop_time(5, 2, TW_REPEAT) == 1);
  assert_true(tw_loop_time(2, 2, TW_REPEAT) == 0);
  assert_true(tw_loop_time(-0.5f, 2, TW_REPEAT) == 1.5f);
  assert_true(tw_loop_time(-1e-30f, 2, TW_REPEAT) == 0);
  assert_true(tw_loop_time(2, 2, TW_PINGPONG) == 2);
  assert_true(tw_loop_time(2.5f, 2, TW_PINGPONG) == 1.5f);
  assert_true(tw_loop_time(5, 2, TW_PINGPONG) == 1);
  assert_true(tw_loop_time(-0.5f, 2, TW_PINGPONG) == 0.5f);
  assert_true(tw_loop_time(3, 0, TW_REPEAT) == 0);
  assert_true(tw_loop_time(16777217, 3, TW_REPEAT) == 2); /* no float */
  assert_true(tw_loop_time(1e5 + 0.25, 0.1, TW_REPEAT) < 0.1f);
  for (int round = 1; round < 100; round++) {
    float at = tw_loop_time(1.2 * round, 1.2, TW_REPEAT), back = tw_loop_time(2.4 * round, 1.2, TW_PINGPONG);
    assert_true(at >= 0 && at < 1e-12f); /* the start, not the end */
    assert_true(back >= 0 && back < 1e-12f);
  }
}

TEST(merged_clips_have_the_tracks_of_all) {
  const float moves[] = {0, 0, 0, 1, 0, 0}, others[] = {0, 0, 0, 0, 5, 0};
  tw_track_keys turn = quaternion_keys(TW_LINEAR, two_times, identity_pair, 2);
  tw_track_keys move = value_keys(TW_TRANSLATION, TW_LINEAR, two_times, moves, 2), other = move, far = move;
  other.values = others;
  far.node = 1;
  const tw_track_keys walk[] = {turn, move}, wave[] = {far}, fall[] = {other};
  const tw_clip_keys clips[] = {{.name = "walk", .track_count = 2, .tracks = walk},
                                {.name = "wave", .track_count = 1, .tracks = wave},
                                {.name = "still"},
                                {.name = "fall", .track_count = 1, .tracks = fall}};
  tw_arena *arena = tw_arena_create();
  tw_clip_keys merged = {.name = "unchanged"};
  assert_int_equal(tw_clip_merge(clips, 3, 2, arena, &merged, NULL), TW_OK);
  assert_null(merged.name);
  assert_int_equal(merged.track_count, 3);
  assert_int_equal(merged.tracks[0].path, TW_ROTATION);
  assert_ptr_equal(merged.tracks[1].values, moves);
  assert_int_equal(merged.tracks[2].node, 1);
  /* Both move node 0: the later one stays, at its place. */
  assert_int_equal(tw_clip_merge(clips, 4, 2, arena, &merged, NULL), TW_OK);
  assert_int_equal(merged.track_count, 3);
  assert_int_equal(merged.tracks[0].path, TW_ROTATION);
  assert_int_equal(merged.tracks[1].node, 1);
  assert_ptr_equal(merged.tracks[2].values, others);
  assert_int_equal(tw_clip_merge(clips, 0, 2, arena, &merged, NULL), TW_OK);
  assert_int_equal(merged.track_count, 0);
  tw_arena_destroy(arena);
}

TEST(clip_tells_what_its_tracks_move) {
  const float moves[] = {0, 0, 0, 1, 0, 0};
  tw_track_keys tracks[] = {value_keys(TW_SCALE, TW_LINEAR, two_times, moves, 2),
                            value_keys(TW_TRANSLATION, TW_LINEAR, two_times, moves, 2)};
  tracks[1].node = 1;
  tw_clip *clip = clip_of(tracks, 2, -1);
  tw_path path;
  assert_int_equal(tw_clip_track_count(clip), 2);
  assert_int_equal(tw_clip_target(clip, 0, &path), 0);
  assert_int_equal(path, TW_SCALE);
  assert_int_equal(tw_clip_target(clip, 1, &path), 1);
  assert_int_equal(path, TW_TRANSLATION);
  tw_clip_destroy(clip);
}
