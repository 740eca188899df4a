/* Root motion: taken out, told, and put back, against plain products of matrices. */
#include <stdlib.h>
#include <string.h>

#include "keys.h"
#include "rotation_reference.h"
#include "tweend/root_motion.h"

enum { NODES = 6, KEYS = 7 };

static uint32_t seed;

static double random_in(double from, double to) {
  seed = seed * 1664525 + 1013904223;
  return from + (to - from) * (seed >> 8) / (1 << 24);
}

/* armature (lies on its back, of centimetres) > hips > spine, armature > prop; beside them ground > stone */
enum { ARMATURE, HIPS, SPINE, PROP, GROUND, STONE };

typedef struct figure {
  tw_node nodes[NODES];
  uint32_t order[NODES];
  float times[KEYS], turns[KEYS][4], places[KEYS][3], bends[KEYS][4], lifts[KEYS][3];
  tw_track_keys tracks[4];
  uint32_t track_count;
} figure;

static figure *make_figure(bool lifts) {
  figure *f = calloc(1, sizeof *f);
  assert_non_null(f);
  static const uint32_t parents[NODES] = {TW_NO_INDEX, ARMATURE, HIPS, ARMATURE, TW_NO_INDEX, GROUND};
  for (uint32_t i = 0; i < NODES; i++) {
    f->nodes[i] =
        (tw_node){.parent = parents[i], .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
    for (int k = 0; k < 3; k++) f->nodes[i].rest.translation[k] = (float)random_in(-2, 2);
  }
  f->nodes[ARMATURE].rest.rotation[0] = -sqrtf(0.5F), f->nodes[ARMATURE].rest.rotation[3] = sqrtf(0.5F);
  for (int k = 0; k < 3; k++) f->nodes[ARMATURE].rest.scale[k] = 0.01F;
  assert_int_equal(tw_nodes_order(f->nodes, NODES, f->order, NULL), TW_OK);
  for (int k = 0; k < KEYS; k++) {
    f->times[k] = (float)k / 3;
    for (int i = 0; i < 3; i++) {
      f->places[k][i] = (float)random_in(-200, 200);
      f->lifts[k][i] = (float)random_in(-1, 1);
    }
    for (int i = 0; i < 4; i++) {
      f->turns[k][i] = (float)(random_in(-1, 1) + (i == 3));
      f->bends[k][i] = (float)(random_in(-1, 1) + (i == 3));
    }
  }
  f->tracks[0] = value_keys(TW_TRANSLATION, TW_LINEAR, f->times, f->places[0], KEYS);
  f->tracks[1] = quaternion_keys(TW_LINEAR, f->times, f->turns[0], KEYS);
  f->tracks[2] = quaternion_keys(TW_LINEAR, f->times, f->bends[0], KEYS);
  f->tracks[3] = value_keys(TW_TRANSLATION, TW_LINEAR, f->times, f->lifts[0], KEYS);
  f->tracks[0].node = f->tracks[1].node = HIPS;
  f->tracks[2].node = SPINE;
  f->tracks[3].node = ARMATURE;
  f->track_count = lifts ? 4 : 3;
  return f;
}

static tw_clip *compile(const figure *f) {
  tw_clip *clip = NULL;
  const tw_clip_keys keys = {.track_count = f->track_count, .tracks = f->tracks};
  assert_int_equal(tw_clip_create(&keys, NODES, -1, &clip, NULL), TW_OK);
  return clip;
}

static tw_clip *take(const figure *f, tw_clip *clip, unsigned axes, uint32_t carrier) {
  const tw_root_job job = {f->nodes, NODES, HIPS, axes, carrier};
  tw_clip *out = NULL;
  tw_error error = {0};
  if (tw_clip_take_root(clip, &job, &out, &error) != TW_OK) fail_msg("%s", error.detail);
  return out;
}

/* World matrices in double precision. */
typedef double matrix[16];

static void multiply(const double *a, const double *b, double *out) {
  matrix m;
  for (int c = 0; c < 4; c++)
    for (int r = 0; r < 4; r++) {
      m[4 * c + r] = 0;
      for (int k = 0; k < 4; k++) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
  memcpy(out, m, sizeof m);
}

static void matrix_of(const tw_trs *trs, double *out) {
  ref_quat q = ref_unit(ref_of(trs->rotation));
  const double axes[9] = {
      1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y + q.w * q.z),     2 * (q.x * q.z - q.w * q.y),
      2 * (q.x * q.y - q.w * q.z),     1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z + q.w * q.x),
      2 * (q.x * q.z + q.w * q.y),     2 * (q.y * q.z - q.w * q.x),     1 - 2 * (q.x * q.x + q.y * q.y)};
  for (int c = 0; c < 3; c++) {
    for (int r = 0; r < 3; r++) out[4 * c + r] = axes[3 * c + r] * (double)trs->scale[c];
    out[4 * c + 3] = 0;
    out[12 + c] = (double)trs->translation[c];
  }
  out[15] = 1;
}

static void world_of(const figure *f, const tw_trs *locals, matrix *out) {
  for (uint32_t i = 0; i < NODES; i++) {
    uint32_t n = f->order[i];
    matrix_of(&locals[n], out[n]);
    if (f->nodes[n].parent != TW_NO_INDEX) multiply(out[f->nodes[n].parent], out[n], out[n]);
  }
}

static double apart(const double *a, const double *b) {
  double most = 0;
  for (int i = 0; i < 16; i++) most = fmax(most, fabs(a[i] - b[i]));
  return most;
}

static const unsigned all_axes[] = {TW_ROOT_X | TW_ROOT_Z | TW_ROOT_YAW, TW_ROOT_X | TW_ROOT_Y | TW_ROOT_Z,
                                    TW_ROOT_YAW, TW_ROOT_Z | TW_ROOT_YAW,
                                    TW_ROOT_X | TW_ROOT_Y | TW_ROOT_Z | TW_ROOT_YAW};

TEST(motion_put_back_is_what_was_there) {
  seed = 1;
  for (int form = 0; form < 10; form++) {
    figure *f = make_figure(form & 1);
    unsigned axes = all_axes[form / 2];
    tw_clip *plain = compile(f), *rooted = take(f, compile(f), axes, TW_NO_INDEX);
    for (int i = 0; i < 60; i++) {
      float time = (float)random_in(-0.2, 2.2);
      tw_trs locals[NODES], in_place[NODES], root;
      matrix world[NODES], rest[NODES], back;
      tw_clip_pose(plain, f->nodes, NODES, time, locals);
      tw_clip_pose(rooted, f->nodes, NODES, time, in_place);
      tw_clip_root_at(rooted, time, &root);
      world_of(f, locals, world);
      world_of(f, in_place, rest);
      for (uint32_t n = HIPS; n <= SPINE; n++) {
        matrix_of(&root, back);
        multiply(back, rest[n], back);
        if (!(apart(back, world[n]) < 1e-6 * 4)) fail_msg("%.9g off", apart(back, world[n]));
      }
      for (uint32_t n = PROP; n < NODES; n++) assert_memory_equal(&locals[n], &in_place[n], sizeof *locals);
      for (int axis = 0; axis < 3; axis++)
        if (!(axes & 1u << axis)) assert_true(root.translation[axis] == 0);
      if (!(axes & TW_ROOT_YAW)) assert_true(root.rotation[1] == 0);
      assert_true(root.rotation[0] == 0 && root.rotation[2] == 0);
    }
    tw_clip_destroy(plain);
    tw_clip_destroy(rooted);
    free(f);
  }
}

TEST(what_is_taken_stands_still) {
  seed = 2;
  figure *f = make_figure(true);
  tw_clip *rooted = take(f, compile(f), TW_ROOT_X | TW_ROOT_Z | TW_ROOT_YAW, TW_NO_INDEX);
  tw_trs locals[NODES], root;
  matrix world[NODES];
  double x = 0, z = 0;
  tw_clip_root_at(rooted, 0, &root);
  for (int i = 0; i < 3; i++)
    assert_true((double)fabsf(root.translation[i]) < 1e-12 && (double)fabsf(root.rotation[i]) < 1e-12);
  for (int i = 0; i <= 20; i++) {
    tw_clip_pose(rooted, f->nodes, NODES, (float)i / 10, locals);
    world_of(f, locals, world);
    if (i == 0) x = world[HIPS][12], z = world[HIPS][14];
    assert_true(fabs(world[HIPS][12] - x) < 1e-6 && fabs(world[HIPS][14] - z) < 1e-6);
  }
  tw_clip_destroy(rooted);
  free(f);
}

/* stretched: which node the clip stretches and squashes meanwhile; NODES: none */
static void assert_whole_turn(uint32_t stretched, const float stretch[3]) {
  figure *f = make_figure(false);
  float scales[KEYS][3];
  f->nodes[ARMATURE].rest = TW_TRS_IDENTITY;
  f->track_count = 2;
  for (int k = 0; k < KEYS; k++) {
    double half = REF_PI * k / (KEYS - 1); /* a whole turn in all */
    f->turns[k][0] = f->turns[k][2] = 0;
    f->turns[k][1] = (float)sin(half), f->turns[k][3] = (float)cos(half);
    f->places[k][0] = (float)k, f->places[k][1] = 1, f->places[k][2] = (float)(-2 * k);
    for (int i = 0; i < 3; i++) scales[k][i] = k % 2 ? stretch[i] : 1;
  }
  if (stretched < NODES) {
    f->tracks[f->track_count] = value_keys(TW_SCALE, TW_LINEAR, f->times, scales[0], KEYS);
    f->tracks[f->track_count++].node = stretched;
  }
  tw_clip *rooted = take(f, compile(f), TW_ROOT_X | TW_ROOT_Z | TW_ROOT_YAW, TW_NO_INDEX);
  tw_trs locals[NODES], root;
  for (int k = 0; k < KEYS; k++) {
    tw_clip_root_at(rooted, f->times[k], &root);
    double yaw = 2 * REF_PI * k / (KEYS - 1);
    assert_true(ref_angle(ref_of(root.rotation), (ref_quat){0, sin(yaw / 2), 0, cos(yaw / 2)}) < 1e-6);
    assert_true(fabs((double)root.translation[0] - k) < 1e-6 &&
                fabs((double)root.translation[2] + 2 * k) < 1e-6);
    tw_clip_pose(rooted, f->nodes, NODES, f->times[k], locals);
    assert_true(ref_angle(ref_of(locals[HIPS].rotation), (ref_quat){0, 0, 0, 1}) < 1e-6);
    assert_true((double)fabsf(locals[HIPS].translation[0]) < 1e-6 && locals[HIPS].translation[1] == 1);
  }
  tw_clip_destroy(rooted);
  free(f);
}

/* Samples and poses are the same, and tracks of a carrier put the motion in front of it. */
TEST(a_carrier_moves_as_the_root_did) {
  seed = 3;
  for (int form = 0; form < 2; form++) {
    figure *f = make_figure(form == 0);
    uint32_t carrier = form == 0 ? ARMATURE : NODES;
    tw_clip *plain = compile(f), *rooted = take(f, compile(f), TW_ROOT_X | TW_ROOT_Z | TW_ROOT_YAW, carrier);
    for (int i = 0; i < 30; i++) {
      float time = (float)random_in(0, 2);
      tw_trs locals[NODES], carried[NODES + 1], root;
      matrix world[NODES], back[NODES], front;
      tw_clip_pose(plain, f->nodes, NODES, time, locals);
      for (uint32_t n = 0; n < NODES; n++) carried[n] = f->nodes[n].rest;
      carried[NODES] = TW_TRS_IDENTITY;
      for (uint32_t t = 0; t < tw_clip_track_count(rooted); t++) {
        tw_path path;
        uint32_t node = tw_clip_target(rooted, t, &path);
        tw_clip_sample(rooted, t, &time, 1,
                       path == TW_ROTATION ? carried[node].rotation : carried[node].translation);
      }
      world_of(f, locals, world);
      world_of(f, carried, back);
      matrix_of(&carried[NODES], front);
      for (uint32_t n = HIPS; n <= SPINE; n++) {
        multiply(front, back[n], back[n]);
        if (!(apart(back[n], world[n]) < 4e-6)) fail_msg("form %d: %.9g off", form, apart(back[n], world[n]));
      }
      tw_clip_root_at(rooted, time, &root);
      if (form == 1) assert_memory_equal(&root, &carried[NODES], sizeof root);
    }
    tw_clip_destroy(plain);
    tw_clip_destroy(rooted);
    free(f);
  }
}

TEST(keys_of_a_rooted_clip_follow_it) {
  seed = 4;
  figure *f = make_figure(true);
  tw_clip *rooted = take(f, compile(f), TW_ROOT_X | TW_ROOT_Z | TW_ROOT_YAW, ARMATURE), *plain = NULL;
  tw_arena *arena = tw_arena_create();
  tw_clip_keys keys;
  uint64_t steps = TW_REDUCTION_STEPS;
  const tw_tolerance tolerance = {0.1 * REF_DEGREES, 1e-3};
  tw_tolerance reached;
  assert_int_equal(tw_clip_reduce(rooted, NULL, tolerance, 100000, &steps, arena, &keys, &reached, NULL),
                   TW_OK);
  assert_true(reached.angle <= tolerance.angle && reached.distance <= tolerance.distance);
  assert_int_equal(tw_clip_create(&keys, NODES, -1, &plain, NULL), TW_OK);
  for (int i = 0; i < 500; i++) {
    float time = (float)random_in(0, 2);
    tw_trs a[NODES], b[NODES];
    tw_clip_pose(rooted, f->nodes, NODES, time, a);
    tw_clip_pose(plain, f->nodes, NODES, time, b);
    for (uint32_t n = 0; n < NODES; n++) {
      assert_true(ref_angle(ref_of(a[n].rotation), ref_of(b[n].rotation)) <= tolerance.angle + 1e-6);
      for (int k = 0; k < 3; k++)
        assert_true(fabs((double)a[n].translation[k] - (double)b[n].translation[k]) <= 1.1e-3);
    }
  }
  tw_clip_destroy(plain);
  tw_clip_destroy(rooted);
  tw_arena_destroy(arena);
  free(f);
}

TEST(the_usual_root_is_the_topmost_node_that_travels) {
  seed = 5;
  figure *f = make_figure(false);
  tw_clip *clip = compile(f);
  assert_int_equal(tw_clip_find_root(clip, f->nodes, f->order, NODES), HIPS);
  tw_clip_destroy(clip);
  f->track_count = 4;
  clip = compile(f);
  assert_int_equal(tw_clip_find_root(clip, f->nodes, f->order, NODES), ARMATURE);
  tw_clip_destroy(clip);
  for (int k = 1; k < KEYS; k++) memcpy(f->lifts[k], f->lifts[0], sizeof f->lifts[0]);
  clip = compile(f); /* of the armature there is a track, as of an exporter that bakes, and it rests */
  assert_int_equal(tw_clip_find_root(clip, f->nodes, f->order, NODES), HIPS);
  tw_clip_destroy(clip);
  f->tracks[0] = f->tracks[3];
  f->track_count = 1;
  clip = compile(f); /* nothing else */
  assert_int_equal(tw_clip_find_root(clip, f->nodes, f->order, NODES), ARMATURE);
  tw_clip_destroy(clip);
  const float spline[2][3][3] = {{{0}, {0, 1, 0}, {3, 0, 0}}, {{3, 0, 0}, {0, 1, 0}, {0}}};
  f->tracks[0] = value_keys(TW_TRANSLATION, TW_CUBICSPLINE, f->times, spline[0][0], 2);
  f->tracks[0].node = ARMATURE; /* between equal keys it goes away and comes back */
  f->tracks[3] = value_keys(TW_TRANSLATION, TW_LINEAR, f->times, f->places[0], KEYS);
  f->tracks[3].node = HIPS;
  f->track_count = 4;
  clip = compile(f);
  assert_int_equal(tw_clip_find_root(clip, f->nodes, f->order, NODES), ARMATURE);
  tw_clip_destroy(clip);
  f->tracks[0] = f->tracks[3];
  f->tracks[3].node = STONE; /* which has fewer nodes below than the hips */
  clip = compile(f);
  assert_int_equal(tw_clip_find_root(clip, f->nodes, f->order, NODES), HIPS);
  tw_clip_destroy(clip);
  f->tracks[0] = f->tracks[2]; /* only turns */
  f->track_count = 2;
  clip = compile(f);
  assert_int_equal(tw_clip_find_root(clip, f->nodes, f->order, NODES), HIPS);
  tw_clip_destroy(clip);
  f->track_count = 0;
  clip = compile(f);
  assert_int_equal(tw_clip_find_root(clip, f->nodes, f->order, NODES), TW_NO_INDEX);
  tw_clip_destroy(clip);
  free(f);
}

TEST(a_whole_turn_about_y_is_told) {
  static const float tall[3] = {1, 3, 1}, wide[3] = {2, 0.4F, 2}, odd[3] = {0.5F, 1, 3}, flat[3] = {1, 0, 1};
  assert_whole_turn(NODES, tall);
  assert_whole_turn(HIPS, tall);
  assert_whole_turn(HIPS, wide);
  assert_whole_turn(HIPS, odd);
  assert_whole_turn(HIPS, flat);
  assert_whole_turn(ARMATURE, tall);
}

TEST(a_turn_is_told_while_scales_change_their_signs) {
  static const float mirrored[][3] = {{-1, -1, -1}, {-1, 1, 1}, {1, -0.5F, 1}, {1, 1, -2}, {-0.5F, -1, -2}};
  for (size_t i = 0; i < sizeof mirrored / sizeof *mirrored; i++) assert_whole_turn(HIPS, mirrored[i]);
}

TEST(places_beyond_the_range_of_floats_end_there) {
  seed = 8;
  figure *f = make_figure(false);
  for (int k = 0; k < KEYS; k++)
    for (int i = 0; i < 3; i++) f->places[k][i] = k % 2 ? 3e38F : -3e38F;
  f->nodes[ARMATURE].rest.scale[0] = f->nodes[ARMATURE].rest.scale[1] = f->nodes[ARMATURE].rest.scale[2] = 1;
  tw_clip *rooted = take(f, compile(f), TW_ROOT_X | TW_ROOT_Z | TW_ROOT_YAW, TW_NO_INDEX);
  for (int k = 0; k < 4 * KEYS; k++) {
    tw_trs locals[NODES], root;
    float time = (float)k / 12;
    tw_clip_pose(rooted, f->nodes, NODES, time, locals);
    tw_clip_root_at(rooted, time, &root);
    for (int i = 0; i < 3; i++)
      assert_true(isfinite(locals[HIPS].translation[i]) && isfinite(root.translation[i]));
  }
  tw_clip_destroy(rooted);
  free(f);
}

TEST(a_turn_below_scales_that_become_unequal_is_refused) {
  seed = 7;
  for (int form = 0; form < 4; form++) { /* bit 0: along another axis than y; bit 1: STEP, for one key only */
    figure *f = make_figure(false);
    f->nodes[ARMATURE].rest = TW_TRS_IDENTITY;
    float scales[KEYS][3];
    for (int k = 0; k < KEYS; k++)
      for (int i = 0; i < 3; i++)
        scales[k][i] = i == (form & 1 ? 2 : 1) && (form & 2 ? k == 3 : k > 0) ? 1.1F : 1;
    f->tracks[3] = value_keys(TW_SCALE, form & 2 ? TW_STEP : TW_LINEAR, f->times, scales[0], KEYS);
    f->tracks[3].node = ARMATURE;
    f->track_count = 4;
    tw_clip *clip = compile(f), *out = NULL;
    tw_root_job job = {f->nodes, NODES, HIPS, TW_ROOT_YAW, TW_NO_INDEX};
    tw_error error;
    tw_status expected = form & 1 ? TW_UNSUPPORTED : TW_OK;
    assert_int_equal(tw_clip_take_root(clip, &job, &out, &error), expected);
    job.axes = TW_ROOT_X;
    if (expected != TW_OK) assert_int_equal(tw_clip_take_root(clip, &job, &out, &error), TW_OK);
    tw_clip_destroy(out);
    free(f);
  }
}

TEST(a_turn_below_unequal_scales_is_refused) {
  seed = 6;
  figure *f = make_figure(false);
  f->nodes[ARMATURE].rest.scale[1] = 0.02F;
  tw_clip *clip = compile(f), *out = NULL;
  tw_root_job job = {f->nodes, NODES, HIPS, TW_ROOT_YAW, TW_NO_INDEX};
  tw_error error;
  assert_int_equal(tw_clip_take_root(clip, &job, &out, &error), TW_UNSUPPORTED);
  job.axes = TW_ROOT_X;
  assert_int_equal(tw_clip_take_root(clip, &job, &out, &error), TW_OK);
  tw_clip_destroy(out);
  free(f);
}
