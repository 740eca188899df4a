/* Nanoseconds per joint and time: sampling clips in order, at random and in bulk, compared with a plain
 * binary search and libm slerp; mixed clips, compared with their layers; local to world matrices. usage:
 * anim_bench [JSON] */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"
#include "tweend/anim.h"
#include "tweend/mix.h"

enum { ORDERED_TIMES = 512, RANDOM_TIMES = 512, BULK_TIMES = 10000 };

static void fail(void) {
  fprintf(stderr, "anim_bench: no clip\n");
  exit(1);
}

/* ---- the scene ------------------------------------------------------------------------------- */

/* Rotation tracks of `joint_count` joints with irregular keys over ten seconds. */
typedef struct scene {
  uint32_t joint_count, key_count;
  float *times;  /* [joint_count][key_count] */
  float *values; /* [joint_count][key_count][4] */
  tw_track_keys *tracks;
  tw_node *nodes;
  uint32_t *order;
  tw_clip *clip;
  const tw_clip *layers[2]; /* of a mixed clip */
} scene;

static void scene_init(scene *s, uint32_t joint_count, uint32_t key_count, bool shared_times) {
  size_t keys = (size_t)joint_count * key_count;
  *s = (scene){.joint_count = joint_count, .key_count = key_count};
  s->times = bench_alloc(keys, sizeof *s->times);
  s->values = bench_alloc(keys, 4 * sizeof *s->values);
  s->tracks = bench_alloc(joint_count, sizeof *s->tracks);
  s->nodes = bench_alloc(joint_count, sizeof *s->nodes);
  s->order = bench_alloc(joint_count, sizeof *s->order);
  for (uint32_t joint = 0; joint < joint_count; joint++) {
    float *times = s->times + (size_t)joint * key_count;
    double time = 0;
    for (uint32_t key = 0; key < key_count; key++) {
      times[key] = (float)time;
      time += 0.05 + bench_random() * bench_random();
    }
    for (uint32_t key = 0; key < key_count; key++) times[key] *= 10 / times[key_count - 1];
    if (shared_times) memcpy(times, s->times, key_count * sizeof *times);
    float *values = s->values + 4 * (size_t)joint * key_count;
    for (size_t i = 0; i < 4 * (size_t)key_count; i++) values[i] = (float)(bench_random() - 0.5);
    s->tracks[joint] = (tw_track_keys){.node = joint,
                                       .path = TW_ROTATION,
                                       .interpolation = TW_LINEAR,
                                       .form = TW_KEY_QUATERNION,
                                       .width = 4,
                                       .key_count = key_count,
                                       .times = times,
                                       .values = values};
    s->nodes[joint] = (tw_node){.parent = joint ? (joint - 1) / 2 : TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
    s->nodes[joint].rest.translation[1] = 0.3f;
  }
  tw_clip_keys clip = {.track_count = joint_count, .tracks = s->tracks};
  if (tw_clip_create(&clip, joint_count, -1, &s->clip, NULL) != TW_OK) fail();
  if (tw_nodes_order(s->nodes, joint_count, s->order, NULL) != TW_OK) fail();
}

static void scene_deinit(scene *s) {
  tw_clip_destroy(s->clip);
  free(s->times);
  free(s->values);
  free(s->tracks);
  free(s->nodes);
  free(s->order);
}

/* ---- the plain implementation: bisection, acos, sin ------------------------------------------ */

static void plain_slerp(const float *a, const float *b, float u, float *out) {
  float cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3], sign = cosine < 0 ? -1 : 1;
  cosine = fminf(cosine * sign, 1);
  float from = 1 - u, to = u;
  if (cosine < 0.9995f) {
    float angle = acosf(cosine), scale = 1 / sinf(angle);
    from = sinf(from * angle) * scale;
    to = sinf(to * angle) * scale;
  }
  for (int i = 0; i < 4; i++) out[i] = a[i] * from + b[i] * to * sign;
}

static void plain_sample(const float *times, const float *values, uint32_t key_count, float time,
                         float *out) {
  uint32_t low = 0, high = key_count - 1;
  while (high - low > 1) {
    uint32_t middle = (low + high) / 2;
    if (times[middle] <= time)
      low = middle;
    else
      high = middle;
  }
  float u = (time - times[low]) / (times[high] - times[low]);
  plain_slerp(values + 4 * (size_t)low, values + 4 * (size_t)high, u, out);
}

static void plain_pose(const scene *s, float time, tw_trs *locals) {
  for (uint32_t joint = 0; joint < s->joint_count; joint++) {
    locals[joint] = s->nodes[joint].rest;
    plain_sample(s->tracks[joint].times, s->tracks[joint].values, s->key_count, time, locals[joint].rotation);
  }
}

/* ---- measuring ------------------------------------------------------------------------------- */

/* A way to sample `count` times. Results go to memory that is reused, as in a server. */
typedef void (*sampling)(const scene *s, const float *times, uint32_t count, tw_trs *locals);

static void by_pose(const scene *s, const float *times, uint32_t count, tw_trs *locals) {
  for (uint32_t i = 0; i < count; i++) tw_clip_pose(s->clip, s->nodes, s->joint_count, times[i], locals);
}

static void by_plain_pose(const scene *s, const float *times, uint32_t count, tw_trs *locals) {
  for (uint32_t i = 0; i < count; i++) plain_pose(s, times[i], locals);
}

static void by_track(const scene *s, const float *times, uint32_t count, tw_trs *locals) {
  for (uint32_t joint = 0; joint < s->joint_count; joint++)
    tw_clip_sample(s->clip, joint, times, count, (float *)locals);
}

static void by_plain_track(const scene *s, const float *times, uint32_t count, tw_trs *locals) {
  for (uint32_t joint = 0; joint < s->joint_count; joint++)
    for (uint32_t i = 0; i < count; i++)
      plain_sample(s->tracks[joint].times, s->tracks[joint].values, s->key_count, times[i],
                   (float *)locals + 4 * (size_t)i);
}

static bench_timing measure(const scene *s, sampling sample, const float *times, uint32_t count,
                            tw_trs *locals) {
  double runs[BENCH_RUNS];
  sample(s, times, count, locals);
  for (int run = 0; run < BENCH_RUNS; run++) {
    double start = bench_now();
    sample(s, times, count, locals);
    runs[run] = (bench_now() - start) * 1e9 / ((double)count * s->joint_count);
  }
  return bench_summary(runs);
}

static void fill_times(float *times, uint32_t count, bool ascending) {
  for (uint32_t i = 0; i < count; i++)
    times[i] = (float)(10 * (ascending ? (double)i / count : bench_random()));
}

/* The plain implementation is slow, so it gets fewer times. */
static void compare_ways(bench_report *report, const char *name, const scene *s, sampling ours,
                         sampling plain, const float *times, uint32_t count, tw_trs *locals) {
  uint32_t fewer = count > RANDOM_TIMES ? count / 10 : count;
  bench_row(report, name, "ns", measure(s, ours, times, count, locals), "plain",
            measure(s, plain, times, fewer, locals), false);
}

static void bench_sampling(bench_report *report, uint32_t joint_count, uint32_t key_count,
                           bool shared_times) {
  scene s;
  scene_init(&s, joint_count, key_count, shared_times);
  float *times = bench_alloc(BULK_TIMES, sizeof *times);
  tw_trs *locals = bench_alloc(BULK_TIMES, sizeof *locals);
  bench_scene(report, "%u joints, %u keys%s", joint_count, key_count, shared_times ? ", the same times" : "");
  fill_times(times, ORDERED_TIMES, true);
  compare_ways(report, "in order", &s, by_pose, by_plain_pose, times, ORDERED_TIMES, locals);
  fill_times(times, RANDOM_TIMES, false);
  compare_ways(report, "at random", &s, by_pose, by_plain_pose, times, RANDOM_TIMES, locals);
  fill_times(times, BULK_TIMES, true);
  compare_ways(report, "10,000 times", &s, by_track, by_plain_track, times, BULK_TIMES, locals);
  free(times);
  free(locals);
  scene_deinit(&s);
}

static void by_poses_of_layers(const scene *s, const float *times, uint32_t count, tw_trs *locals) {
  for (int l = 0; l < 2; l++)
    for (uint32_t i = 0; i < count; i++)
      tw_clip_pose(s->layers[l], s->nodes, s->joint_count, times[i], locals);
}

static void by_tracks_of_layers(const scene *s, const float *times, uint32_t count, tw_trs *locals) {
  for (int l = 0; l < 2; l++)
    for (uint32_t joint = 0; joint < s->joint_count; joint++)
      tw_clip_sample(s->layers[l], joint, times, count, (float *)locals);
}

/* Two clips mixed, beside what their layers cost alone. They are made twice: a mixed clip owns its layers. */
static void bench_mix(bench_report *report, const char *what, uint32_t joint_count, const tw_layer *layers) {
  scene parts[4];
  for (int i = 0; i < 4; i++) scene_init(&parts[i], joint_count, 100, false);
  scene s = parts[0];
  for (int l = 0; l < 2; l++) s.layers[l] = parts[l].clip;
  tw_clip *clips[] = {parts[2].clip, parts[3].clip};
  static const float durations[] = {10, 10};
  const tw_mix_job job = {2, layers, clips, durations, s.nodes, joint_count, NULL};
  if (tw_clip_mix(&job, &s.clip, NULL) != TW_OK) fail();
  parts[2].clip = parts[3].clip = NULL;
  float *times = bench_alloc(BULK_TIMES, sizeof *times);
  tw_trs *locals = bench_alloc(BULK_TIMES, sizeof *locals);
  bench_scene(report, "%u joints, %s", joint_count, what);
  fill_times(times, RANDOM_TIMES, false);
  bench_row(report, "at random", "ns", measure(&s, by_pose, times, RANDOM_TIMES, locals), "layers",
            measure(&s, by_poses_of_layers, times, RANDOM_TIMES, locals), false);
  fill_times(times, BULK_TIMES, true);
  bench_row(report, "10,000 times", "ns", measure(&s, by_track, times, BULK_TIMES, locals), "layers",
            measure(&s, by_tracks_of_layers, times, BULK_TIMES, locals), false);
  tw_clip_destroy(s.clip);
  for (int i = 0; i < 4; i++) scene_deinit(&parts[i]);
  free(times);
  free(locals);
}

static void bench_mixes(bench_report *report, uint32_t joint_count) {
  static const float weights[] = {0.3f, 0.7f}, fade_times[] = {0, 10}, fades[2][2] = {{1, 0}, {0, 1}};
  tw_layer layers[2];
  for (int i = 0; i < 2; i++) layers[i] = (tw_layer){.speed = 1, .weight_count = 1, .weights = &weights[i]};
  bench_mix(report, "two layers blended", joint_count, layers);
  for (int i = 0; i < 2; i++)
    layers[i] = (tw_layer){
        .speed = 1, .is_synced = true, .weight_count = 2, .weight_times = fade_times, .weights = fades[i]};
  bench_mix(report, "one layer that fades into another in one phase", joint_count, layers);
  layers[0] = (tw_layer){.speed = 1, .weight_count = 1, .weights = &weights[0]};
  layers[1] = (tw_layer){.mode = TW_LAYER_ADDITIVE, .speed = 1, .weight_count = 1, .weights = &weights[1]};
  bench_mix(report, "one layer added to another", joint_count, layers);
}

/* Local transforms to world matrices. */
static void bench_worlds(bench_report *report, uint32_t joint_count) {
  enum { POSES = 16, ROUNDS = 64 };
  scene s;
  scene_init(&s, joint_count, 10, true);
  float times[POSES];
  tw_trs *locals = bench_alloc((size_t)joint_count * POSES, sizeof *locals);
  float *matrices = bench_alloc(joint_count, 16 * sizeof *matrices);
  fill_times(times, POSES, true);
  for (uint32_t pose = 0; pose < POSES; pose++)
    tw_clip_pose(s.clip, s.nodes, joint_count, times[pose], locals + (size_t)pose * joint_count);
  double runs[BENCH_RUNS];
  for (int run = 0; run < BENCH_RUNS; run++) {
    double start = bench_now();
    for (int round = 0; round < ROUNDS; round++)
      for (uint32_t pose = 0; pose < POSES; pose++) {
        tw_pose_locals(s.clip, s.nodes, joint_count, locals + (size_t)pose * joint_count, matrices);
        tw_pose_world(s.nodes, s.order, joint_count, matrices, matrices);
      }
    runs[run] = (bench_now() - start) * 1e9 / ((double)ROUNDS * POSES * joint_count);
  }
  bench_scene(report, "%u joints", joint_count);
  bench_row(report, "local to world", "ns", bench_summary(runs), NULL, (bench_timing){0}, false);
  free(locals);
  free(matrices);
  scene_deinit(&s);
}

int main(int argc, char **argv) {
  static const uint32_t joints[] = {24, 100, 1000}, keys[] = {10, 1000};
  bench_report report;
  bench_open(&report, argc > 1 ? argv[1] : NULL);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 2; j++) bench_sampling(&report, joints[i], keys[j], false);
  bench_sampling(&report, 1000, 1000, true);
  for (int i = 0; i < 3; i++) bench_mixes(&report, joints[i]);
  for (int i = 0; i < 3; i++) bench_worlds(&report, joints[i]);
  bench_close(&report);
  return 0;
}
