/* Batches of times and of tracks: the same bits as one time of one track after another. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "clip.h"
#include "rotation_reference.h"
#include "test.h"

enum { KEYS_MOST = 700, TIMES_MOST = TW_TRACK_BATCH };

/* One rotation track; its keys come in bursts. */
static tw_clip *make_clip(uint32_t key_count) {
  static float times[KEYS_MOST], values[KEYS_MOST][4];
  uint64_t seed = key_count;
  float time = 1;
  for (uint32_t i = 0; i < key_count; i++) {
    times[i] = time;
    time += (float)(ref_random(&seed) < 0.2 ? 1 : ref_between(&seed, 0.001, 0.1));
    for (int j = 0; j < 4; j++) values[i][j] = (float)ref_between(&seed, -1, 1);
  }
  tw_track_keys track = {.path = TW_ROTATION,
                         .interpolation = TW_LINEAR,
                         .form = TW_KEY_QUATERNION,
                         .width = 4,
                         .key_count = key_count,
                         .times = times,
                         .values = values[0]};
  tw_clip_keys keys = {.track_count = 1, .tracks = &track};
  tw_clip *clip = NULL;
  assert_int_equal(tw_clip_create(&keys, 1, -1, &clip, NULL), TW_OK);
  return clip;
}

/* Batches of `count` times, written with a gap after each sample, beside one time after another. */
static void assert_all_are_as_alone(const tw_track *track, const float *times, size_t count) {
  enum { STEP = 5 };
  float clamped[TIMES_MOST], at[TIMES_MOST][STEP], alone_clamped, alone[4];
  uint32_t keys[TIMES_MOST], alone_key;
  for (size_t i = 0; i < count; i++) at[i][4] = 7;
  tw_timeline_find(track->timeline, times, count, clamped, keys);
  tw_track_sample(track, clamped, keys, count, at[0], sizeof at[0]);
  for (size_t i = 0; i < count; i++) {
    tw_timeline_find(track->timeline, &times[i], 1, &alone_clamped, &alone_key);
    tw_track_sample(track, &alone_clamped, &alone_key, 1, alone, sizeof alone);
    assert_int_equal(keys[i], alone_key);
    assert_memory_equal(&clamped[i], &alone_clamped, sizeof alone_clamped);
    assert_memory_equal(at[i], alone, sizeof alone);
    assert_true(at[i][4] == 7);
  }
}

/* `count` times, `step` seconds apart. */
static void assert_steps_are_as_alone(const tw_track *track, float start, float step, size_t count) {
  float times[TIMES_MOST];
  for (size_t i = 0; i < count; i++) times[i] = start + (float)i * step;
  assert_all_are_as_alone(track, times, count);
}

TEST(times_give_the_same_alone_and_together) {
  static const uint32_t key_counts[] = {1, 2, 3, 15, 16, 17, 40, KEYS_MOST};
  static const float steps[] = {0, 1e-4f, 0.003f, 0.02f, 0.1f, 0.7f, 3, -0.003f, -0.1f};
  for (size_t k = 0; k < sizeof key_counts / sizeof *key_counts; k++) {
    tw_clip *clip = make_clip(key_counts[k]);
    const tw_track *track = &clip->tracks[0];
    float last = tw_clip_duration(clip);
    for (size_t s = 0; s < sizeof steps / sizeof *steps; s++)
      for (size_t count = 1; count <= TIMES_MOST; count++) {
        assert_steps_are_as_alone(track, 0.9f, steps[s], count);
        assert_steps_are_as_alone(track, last / 2, steps[s], count);
        assert_steps_are_as_alone(track, last - 0.05f, steps[s], count);
      }
    tw_clip_destroy(clip);
  }
}

/* Somewhere among ascending ones: behind their first, beyond their last, and no times at all. */
TEST(a_time_out_of_order_is_found_too) {
  static const float odd[] = {-1, 0, 1, 1.2f, 30, 1e30f, INFINITY, -INFINITY, NAN};
  enum { COUNT = TW_TRACK_BATCH };
  tw_clip *clip = make_clip(KEYS_MOST);
  for (size_t o = 0; o < sizeof odd / sizeof *odd; o++)
    for (size_t place = 0; place < COUNT; place++) {
      float times[COUNT];
      for (size_t i = 0; i < COUNT; i++) times[i] = i == place ? odd[o] : 20 + 0.01f * (float)i;
      assert_all_are_as_alone(&clip->tracks[0], times, COUNT);
    }
  tw_clip_destroy(clip);
}

TEST(random_times_give_the_same_alone_and_together) {
  uint64_t seed = 3;
  tw_clip *clip = make_clip(KEYS_MOST);
  for (int round = 0; round < 50; round++) {
    float times[TIMES_MOST];
    double span = ref_between(&seed, 0.1, 200);
    for (size_t i = 0; i < TIMES_MOST; i++) times[i] = (float)ref_between(&seed, 5, 5 + span);
    assert_all_are_as_alone(&clip->tracks[0], times, TIMES_MOST);
  }
  tw_clip_destroy(clip);
}

TEST(keys_are_given_back_exactly) {
  tw_clip *clip = make_clip(KEYS_MOST);
  const tw_track *track = &clip->tracks[0];
  static float at[KEYS_MOST][4];
  tw_clip_sample(clip, 0, track->timeline->times, KEYS_MOST, at[0]);
  for (uint32_t i = 0; i < KEYS_MOST; i++)
    for (int j = 0; j < 4; j++) assert_true(at[i][j] == track->segments.arcs[i].from[j]);
  tw_clip_destroy(clip);
}

/* Rotation tracks of more nodes than a batch has, every third one STEP; all on one timeline, or pairs. */
TEST(poses_are_the_samples_of_their_tracks) {
  enum { NODES = 150, KEYS = 20, TIMES = 100 };
  static float times[NODES][KEYS], values[KEYS][4];
  static tw_track_keys tracks[NODES];
  static tw_trs poses[TIMES][NODES], pose[NODES];
  static tw_node nodes[NODES];
  uint64_t seed = 9;
  for (int i = 0; i < KEYS; i++)
    for (int j = 0; j < 4; j++) values[i][j] = (float)ref_between(&seed, -1, 1);
  for (uint32_t sharing = 2; sharing <= NODES; sharing += NODES - 2) {
    for (uint32_t i = 0; i < NODES; i++) {
      float time = (float)(i / sharing) * 0.01f;
      for (int k = 0; k < KEYS; k++) times[i][k] = time += 0.1f;
      tracks[i] = (tw_track_keys){.node = NODES - 1 - i,
                                  .path = TW_ROTATION,
                                  .interpolation = i % 3 == 2 ? TW_STEP : TW_LINEAR,
                                  .form = TW_KEY_QUATERNION,
                                  .width = 4,
                                  .key_count = KEYS - i % 2,
                                  .times = times[i],
                                  .values = values[i % 2]};
      nodes[i] = (tw_node){.parent = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
    }
    const tw_clip_keys keys = {.track_count = NODES, .tracks = tracks};
    tw_clip *clip = NULL;
    assert_int_equal(tw_clip_create(&keys, NODES, -1, &clip, NULL), TW_OK);
    float at[TIMES] = {-1, NAN, INFINITY, -INFINITY, 1e30f, -0.0f, 0.1f};
    for (int i = 7; i < TIMES; i++) at[i] = (float)ref_between(&seed, 0, 4);
    tw_clip_poses(clip, pose, NODES, at, TIMES, poses[0]);
    for (size_t t = 0; t < TIMES; t++) {
      tw_clip_pose(clip, nodes, NODES, at[t], pose);
      for (uint32_t i = 0; i < NODES; i++) {
        float sample[4];
        tw_clip_sample(clip, i, &at[t], 1, sample);
        assert_memory_equal(pose[tracks[i].node].rotation, sample, sizeof sample);
        assert_memory_equal(poses[t][tracks[i].node].rotation, sample, sizeof sample);
      }
    }
    tw_clip_destroy(clip);
  }
}
