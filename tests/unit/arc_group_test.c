/* Arcs in the order of time: the same poses as track by track, bit for bit, in memory and steps that no
 * choice of keys makes many. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "clip.h"
#include "rotation_reference.h"

/* Key `key` of `key_count` of a track. */
typedef float (*time_rule)(uint32_t track, uint32_t key, uint32_t key_count);

typedef struct group_scene {
  uint32_t track_count;
  uint64_t keys;
  float *times;  /* of all tracks, one after another */
  float *values; /* [keys][4] */
  tw_track_keys *tracks;
  tw_node *nodes;
  tw_clip *clip;
} group_scene;

static void *some(size_t count, size_t size) {
  void *memory = tw_alloc_zero(count, size);
  assert_non_null(memory);
  return memory;
}

/* Rotation tracks, each third one STEP. Track 0 has first_count keys, the others rest_count. */
static group_scene make_scene(uint32_t track_count, uint32_t first_count, uint32_t rest_count,
                              time_rule rule) {
  group_scene s = {.track_count = track_count,
                   .keys = first_count + (uint64_t)(track_count - 1) * rest_count};
  s.times = some(s.keys, sizeof *s.times);
  s.values = some(s.keys, 4 * sizeof *s.values);
  s.tracks = some(track_count, sizeof *s.tracks);
  s.nodes = some(track_count, sizeof *s.nodes);
  uint64_t seed = 5;
  for (size_t i = 0; i < 4 * s.keys; i++) s.values[i] = (float)ref_between(&seed, -1, 1);
  for (uint32_t i = 0, first = 0; i < track_count; i++) {
    uint32_t key_count = i == 0 ? first_count : rest_count;
    for (uint32_t key = 0; key < key_count; key++) s.times[first + key] = rule(i, key, key_count);
    s.nodes[i] = (tw_node){.parent = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
    s.tracks[i] = (tw_track_keys){.node = track_count - 1 - i,
                                  .path = TW_ROTATION,
                                  .interpolation = i % 3 == 2 ? TW_STEP : TW_LINEAR,
                                  .form = TW_KEY_QUATERNION,
                                  .width = 4,
                                  .key_count = key_count,
                                  .times = s.times + first,
                                  .values = s.values + 4 * (size_t)first};
    first += key_count;
  }
  tw_clip_keys keys = {.track_count = track_count, .tracks = s.tracks};
  assert_int_equal(tw_clip_create(&keys, track_count, -1, &s.clip, NULL), TW_OK);
  return s;
}

static void free_scene(group_scene *s) {
  tw_clip_destroy(s->clip);
  free(s->times);
  free(s->values);
  free(s->tracks);
  free(s->nodes);
}

static void assert_pose_is_its_samples(const group_scene *s, float time) {
  tw_trs *pose = some(s->track_count, sizeof *pose);
  tw_clip_pose(s->clip, s->nodes, s->track_count, time, pose);
  for (uint32_t i = 0; i < s->track_count; i++) {
    float sample[4];
    tw_clip_sample(s->clip, i, &time, 1, sample);
    assert_memory_equal(pose[s->tracks[i].node].rotation, sample, sizeof sample);
  }
  free(pose);
}

/* At keys and beside them, between them, far outside, and at what is no time. */
static void assert_poses_are_samples(const group_scene *s) {
  const float odd[] = {-1, -0.0f, 1e-45f, 1e30f, INFINITY, -INFINITY, NAN};
  uint64_t seed = 6;
  float duration = tw_clip_duration(s->clip);
  for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) assert_pose_is_its_samples(s, odd[i]);
  for (int i = 0; i < 200; i++) {
    float at = s->times[(size_t)(ref_random(&seed) * (double)s->keys)];
    assert_pose_is_its_samples(s, at);
    assert_pose_is_its_samples(s, nextafterf(at, 0));
    assert_pose_is_its_samples(s, nextafterf(at, INFINITY));
    assert_pose_is_its_samples(s, (float)ref_between(&seed, 0, (double)duration));
  }
}

static uint32_t blocks_for(uint32_t arc_count) {
  return (arc_count + ARC_BLOCK - 1) / ARC_BLOCK;
}

/* Blocks are read for twice the tracks at most, and where to begin is found at once: before the next frame an
 * arc of the block starts later, or the first one of the block behind it. */
static void assert_steps_are_few(const tw_clip *clip) {
  for (const tw_arc_group *group = clip->groups; group; group = group->following) {
    const tw_timeline *frames = &group->frames;
    assert_in_range(group->window, blocks_for(group->track_count), 2 * blocks_for(group->track_count));
    for (uint32_t i = 0; i < frames->key_count; i++) {
      float time = i + 1 < frames->key_count ? nextafterf(frames->times[i + 1], 0) : frames->last;
      const float *starts = group->blocks[group->places[i]].numbers[ARC_START];
      size_t lane = 0;
      while (lane < ARC_BLOCK && starts[lane] <= time) lane++;
      assert_true(lane < ARC_BLOCK || group->blocks[group->places[i] + 1].numbers[ARC_START][0] > time);
    }
  }
}

/* ---- scenes -------------------------------------------------------------------------------------------- */

/* Each track in its own rhythm, from its own start on. */
static float own_time(uint32_t track, uint32_t key, uint32_t key_count) {
  (void)key_count;
  uint64_t seed = track * 1000 + key;
  return (float)(0.3 * track + key + 0.9 * ref_random(&seed));
}

static float shared_time(uint32_t track, uint32_t key, uint32_t key_count) {
  (void)track;
  return own_time(0, key, key_count);
}

/* Whole numbers: tracks meet at some of their keys. The first is minus zero. */
static float meeting_time(uint32_t track, uint32_t key, uint32_t key_count) {
  (void)key_count;
  return key == 0 ? -0.0f : (float)(key * (track % 4 + 1));
}

/* As near one another as numbers can be, then nothing for long. */
static float crowded_time(uint32_t track, uint32_t key, uint32_t key_count) {
  return key + 1 == key_count ? (float)(track + 10) : (float)key * 1.4e-45f;
}

/* One key a second, somewhere in it, after one at its beginning. */
static float regular_time(uint32_t track, uint32_t key, uint32_t key_count) {
  (void)key_count;
  uint64_t seed = track * 1000 + key;
  return key == 0 ? 0 : (float)(key + 0.8 * ref_random(&seed));
}

/* All tracks meet at each other key of the first. */
static float often_meeting_time(uint32_t track, uint32_t key, uint32_t key_count) {
  (void)key_count;
  return (float)(track == 0 ? key : 2 * key);
}

/* All tracks meet after some keys of their own, of which the first track's come first. */
static float gathering_time(uint32_t track, uint32_t key, uint32_t key_count) {
  (void)key_count;
  uint64_t seed = track * 1000 + key;
  uint32_t own = key % 4;
  if (own == 0) return (float)(25 * key);
  return (float)(25 * (key - own) + (track == 0 ? own : 25 * own + 24 * ref_random(&seed)));
}

static void poses_are_the_samples_of_their_tracks(void **state) {
  (void)state;
  const time_rule rules[] = {own_time, shared_time, meeting_time, crowded_time};
  const uint32_t shapes[][3] = {{40, 50, 50}, {2, 30, 30}, {65, 1, 7}, {30, 3000, 2}, {17, 300, 1}};
  for (size_t rule = 0; rule < 4; rule++)
    for (size_t i = 0; i < 5; i++) {
      group_scene s = make_scene(shapes[i][0], shapes[i][1], shapes[i][2], rules[rule]);
      assert_non_null(s.clip->groups);
      assert_poses_are_samples(&s);
      assert_steps_are_few(s.clip);
      free_scene(&s);
    }
}

/* An arc that leaves when a block is filled for a meeting goes on until then. */
static void poses_before_a_meeting_have_all_tracks(void **state) {
  (void)state;
  for (uint32_t track_count = 2; track_count < 60; track_count++) {
    group_scene s = make_scene(track_count, 40, 40, gathering_time);
    for (uint32_t key = 4; key < 40; key += 4)
      assert_pose_is_its_samples(&s, nextafterf((float)(25 * key), 0));
    free_scene(&s);
  }
}

static void a_track_alone_is_in_no_group(void **state) {
  (void)state;
  group_scene s = make_scene(1, 50, 0, own_time);
  assert_null(s.clip->groups);
  assert_poses_are_samples(&s);
  free_scene(&s);
}

static void many_tracks_are_in_several_groups(void **state) {
  (void)state;
  group_scene s = make_scene(2 * TW_GROUP_TRACKS + 1, 4, 3, own_time);
  assert_non_null(s.clip->groups->following->following);
  assert_pose_is_its_samples(&s, -1);
  assert_pose_is_its_samples(&s, INFINITY);
  for (int i = 0; i < 20; i++) assert_pose_is_its_samples(&s, (float)i * 31);
  assert_steps_are_few(s.clip);
  free_scene(&s);
}

static void memory_grows_with_keys_and_not_with_where_they_are(void **state) {
  (void)state;
  const uint32_t shapes[][3] = {{1000, 60000, 2}, {2, 60000, 60000}, {100, 600, 600}, {3, 60000, 1}};
  const time_rule rules[] = {own_time, shared_time, crowded_time};
  for (size_t rule = 0; rule < 3; rule++)
    for (size_t i = 0; i < 4; i++) {
      group_scene s = make_scene(shapes[i][0], shapes[i][1], shapes[i][2], rules[rule]);
      /* Times and buckets 20 bytes, arcs 40, at most two copies 46 each; the rest is what tracks take. */
      assert_in_range(tw_clip_size(s.clip), 0, 152 * s.keys + 700 * (uint64_t)s.track_count + 200000);
      free_scene(&s);
    }
}

/* Blocks that are filled up for every few keys. */
static void tracks_that_often_meet_take_little_more(void **state) {
  (void)state;
  for (uint32_t track_count = 2; track_count < 40; track_count++) {
    group_scene s = make_scene(track_count, 8000, 4000, often_meeting_time);
    assert_in_range(tw_clip_size(s.clip), 0, 160 * s.keys + 700 * (uint64_t)track_count + 200000);
    free_scene(&s);
  }
}

/* With the times of all tracks equal, blocks are theirs and no other's. */
static void equal_times_fill_blocks_of_their_own(void **state) {
  (void)state;
  group_scene s = make_scene(40, 50, 50, shared_time);
  const tw_arc_group *group = s.clip->groups;
  assert_int_equal(group->window, blocks_for(40));
  assert_int_equal(group->block_count, 50 * blocks_for(40));
  assert_int_equal(group->frames.key_count, 50);
  for (uint32_t i = 0; i < 49; i++) assert_int_equal(group->places[i], (i + 1) * blocks_for(40));
  free_scene(&s);
}

/* At a regular pace no arc is needed again. */
static void regular_keys_are_hardly_repeated(void **state) {
  (void)state;
  group_scene s = make_scene(100, 100, 100, regular_time);
  assert_in_range(s.clip->groups->block_count, 100 * 100 / ARC_BLOCK, 108 * 100 / ARC_BLOCK);
  assert_poses_are_samples(&s);
  free_scene(&s);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(poses_are_the_samples_of_their_tracks),
      cmocka_unit_test(poses_before_a_meeting_have_all_tracks),
      cmocka_unit_test(a_track_alone_is_in_no_group),
      cmocka_unit_test(many_tracks_are_in_several_groups),
      cmocka_unit_test(memory_grows_with_keys_and_not_with_where_they_are),
      cmocka_unit_test(tracks_that_often_meet_take_little_more),
      cmocka_unit_test(equal_times_fill_blocks_of_their_own),
      cmocka_unit_test(regular_keys_are_hardly_repeated),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
