/* The kernels of every instruction set that the machine has: the same bytes as time after time on its own. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "clip.h"
#include "rotation_reference.h"

enum { KEYS_MOST = 700, TIMES_MOST = 200 };

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

/* The kernels for every machine with one time. */
static void sample_alone(const tw_track *track, float time, float *clamped, uint32_t *key, float *out) {
  const tw_track_kernels *kernels = tw_track_kernels_at(0);
  kernels->find_keys(track->timeline, &time, 1, clamped, key);
  kernels->sample_arcs(track->segments.arcs, track->timeline->key_count, key, clamped, 1, out);
}

static void assert_all_are_as_alone(const tw_track *track, const float *times, size_t count) {
  for (uint32_t set = 0; set < 3; set++) {
    const tw_track_kernels *kernels = tw_track_kernels_at(set);
    if (!kernels) continue;
    float clamped[TIMES_MOST], at[TIMES_MOST + 1][4], alone_clamped, alone[4];
    uint32_t keys[TIMES_MOST], alone_key;
    at[count][0] = 7;
    kernels->find_keys(track->timeline, times, count, clamped, keys);
    kernels->sample_arcs(track->segments.arcs, track->timeline->key_count, keys, clamped, count, at[0]);
    for (size_t i = 0; i < count; i++) {
      sample_alone(track, times[i], &alone_clamped, &alone_key, alone);
      assert_int_equal(keys[i], alone_key);
      assert_memory_equal(&clamped[i], &alone_clamped, sizeof alone_clamped);
      assert_memory_equal(at[i], alone, sizeof alone);
    }
    assert_true(at[count][0] == 7);
  }
}

/* `count` times, `step` seconds apart. */
static void assert_steps_are_as_alone(const tw_track *track, float start, float step, size_t count) {
  float times[TIMES_MOST];
  for (size_t i = 0; i < count; i++) times[i] = start + (float)i * step;
  assert_all_are_as_alone(track, times, count);
}

static void times_give_the_same_alone_and_together(void **state) {
  (void)state;
  static const uint32_t key_counts[] = {1, 2, 3, 15, 16, 17, 40, KEYS_MOST};
  static const float steps[] = {0, 1e-4f, 0.003f, 0.02f, 0.1f, 0.7f, 3, -0.003f, -0.1f};
  for (size_t k = 0; k < sizeof key_counts / sizeof *key_counts; k++) {
    tw_clip *clip = make_clip(key_counts[k]);
    const tw_track *track = &clip->tracks[0];
    float last = tw_clip_duration(clip);
    for (size_t s = 0; s < sizeof steps / sizeof *steps; s++)
      for (size_t count = 1; count <= TIMES_MOST; count += count < 70 ? 1 : 13) {
        assert_steps_are_as_alone(track, 0.9f, steps[s], count);
        assert_steps_are_as_alone(track, last / 2, steps[s], count);
        assert_steps_are_as_alone(track, last - 0.05f, steps[s], count);
      }
    tw_clip_destroy(clip);
  }
}

/* Somewhere among ascending ones: behind their first, beyond their last, and no times at all. */
static void a_time_out_of_order_is_found_too(void **state) {
  (void)state;
  static const float odd[] = {-1, 0, 1, 1.2f, 30, 1e30f, INFINITY, -INFINITY, NAN};
  enum { COUNT = 67 };
  tw_clip *clip = make_clip(KEYS_MOST);
  for (size_t o = 0; o < sizeof odd / sizeof *odd; o++)
    for (size_t place = 0; place < COUNT; place++) {
      float times[COUNT];
      for (size_t i = 0; i < COUNT; i++) times[i] = i == place ? odd[o] : 20 + 0.01f * (float)i;
      assert_all_are_as_alone(&clip->tracks[0], times, COUNT);
    }
  tw_clip_destroy(clip);
}

static void random_times_give_the_same_alone_and_together(void **state) {
  (void)state;
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

static void keys_are_given_back_exactly(void **state) {
  (void)state;
  tw_clip *clip = make_clip(KEYS_MOST);
  const tw_track *track = &clip->tracks[0];
  for (uint32_t set = 0; set < 3; set++) {
    const tw_track_kernels *kernels = tw_track_kernels_at(set);
    if (!kernels) continue;
    static float clamped[KEYS_MOST], at[KEYS_MOST][4];
    static uint32_t keys[KEYS_MOST];
    kernels->find_keys(track->timeline, track->timeline->times, KEYS_MOST, clamped, keys);
    kernels->sample_arcs(track->segments.arcs, KEYS_MOST, keys, clamped, KEYS_MOST, at[0]);
    for (uint32_t i = 0; i < KEYS_MOST; i++) {
      arc_segment arc = track_arc(track, i);
      assert_int_equal(keys[i], i);
      for (int j = 0; j < 4; j++) assert_true(at[i][j] == arc.from[j]);
    }
  }
  tw_clip_destroy(clip);
}

/* Arcs of a track as if they were nodes', some of which have two: those in a window before the first one that
 * starts later, from each block that has begun. */
static void arcs_of_many_tracks_are_as_alone(void **state) {
  (void)state;
  enum { BLOCKS = 4, ARCS = BLOCKS * ARC_BLOCK - 3, NODES = ARCS - 20 };
  tw_clip *clip = make_clip(ARCS);
  const tw_track *track = &clip->tracks[0];
  static arc_block blocks[BLOCKS];
  for (uint32_t i = 0; i < BLOCKS * ARC_BLOCK; i++) {
    for (uint32_t j = 0; j < ARC_NUMBERS && i < ARCS; j++)
      blocks[i / ARC_BLOCK].numbers[j][i % ARC_BLOCK] = track->segments.arcs[j * ARCS + i];
    if (i >= ARCS) blocks[i / ARC_BLOCK].numbers[ARC_START][i % ARC_BLOCK] = INFINITY;
    blocks[i / ARC_BLOCK].nodes[i % ARC_BLOCK] = i % NODES;
  }
  for (uint32_t set = 0; set < 3; set++) {
    const tw_track_kernels *kernels = tw_track_kernels_at(set);
    for (uint32_t key = 0; kernels && key < ARCS; key++)
      for (uint32_t window = 0; window <= BLOCKS; window++)
        for (uint32_t block = 0; block <= (key + 1) / ARC_BLOCK; block++) {
          tw_trs locals[NODES] = {{{0}, {0}, {0}}}, alone[NODES] = {{{0}, {0}, {0}}};
          float time = track_arc(track, key).start;
          uint32_t last = (key + 1) / ARC_BLOCK, first = last > window ? last - window : 0;
          kernels->pose_arcs(blocks, window, block, time, locals);
          for (uint32_t i = first * ARC_BLOCK; i <= key; i++)
            tw_track_kernels_at(0)->sample_arcs(track->segments.arcs, ARCS, &i, &time, 1,
                                                alone[i % NODES].rotation);
          assert_memory_equal(locals, alone, sizeof alone);
        }
  }
  tw_clip_destroy(clip);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(times_give_the_same_alone_and_together),
      cmocka_unit_test(a_time_out_of_order_is_found_too),
      cmocka_unit_test(random_times_give_the_same_alone_and_together),
      cmocka_unit_test(keys_are_given_back_exactly),
      cmocka_unit_test(arcs_of_many_tracks_are_as_alone),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
