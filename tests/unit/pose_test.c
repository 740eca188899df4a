/* Node order, whole poses, world and skinning matrices. */
#include <stdlib.h>
#include <string.h>

#include "keys.h"
#include "rotation_reference.h"

static tw_node rest_node(uint32_t parent) {
  return (tw_node){.parent = parent, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
}

TEST(a_parent_out_of_range_is_refused_by_its_place) {
  tw_node nodes[] = {rest_node(TW_NO_INDEX), rest_node(2)};
  uint32_t order[2];
  tw_error error;
  assert_int_equal(tw_nodes_order(nodes, 2, order, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/nodes/1/parent");
}

TEST(a_cycle_is_refused_at_a_node_on_it) {
  /* 5 and 0 hang from the cycle 2, 3, 4; they are not on it. */
  tw_node nodes[] = {rest_node(5), rest_node(TW_NO_INDEX), rest_node(4),
                     rest_node(2), rest_node(3),           rest_node(2)};
  uint32_t order[6] = {7, 7, 7, 7, 7, 7};
  tw_error error;
  assert_int_equal(tw_nodes_order(nodes, 6, order, &error), TW_INVALID);
  assert_true(strcmp(error.pointer, "/nodes/2/parent") == 0 ||
              strcmp(error.pointer, "/nodes/3/parent") == 0 || strcmp(error.pointer, "/nodes/4/parent") == 0);
  assert_int_equal(order[0], 7);
  tw_node self = rest_node(0);
  assert_int_equal(tw_nodes_order(&self, 1, order, NULL), TW_INVALID);
}

TEST(parents_come_before_children_however_deep) {
  enum { NODES = 200000 };
  tw_node *nodes = tw_alloc(NODES, sizeof *nodes);
  uint32_t *order = tw_alloc(NODES, sizeof *order);
  bool *seen = tw_alloc_zero(NODES, sizeof *seen);
  for (uint32_t i = 0; i < NODES; i++) nodes[i] = rest_node(i + 1 < NODES ? i + 1 : TW_NO_INDEX);
  assert_int_equal(tw_nodes_order(nodes, NODES, order, NULL), TW_OK);
  for (uint32_t i = 0; i < NODES; i++) {
    uint32_t parent = nodes[order[i]].parent;
    assert_true(parent == TW_NO_INDEX || seen[parent]);
    assert_false(seen[order[i]]);
    seen[order[i]] = true;
  }
  free(nodes);
  free(order);
  free(seen);
  assert_int_equal(tw_nodes_order(NULL, 0, NULL, NULL), TW_OK);
}

TEST(children_follow_a_turned_and_moved_parent) {
  tw_node nodes[] = {rest_node(1), rest_node(TW_NO_INDEX)};
  uint32_t order[2];
  nodes[0].rest.translation[0] = 2;
  nodes[1].rest.translation[1] = 5;
  nodes[1].rest.scale[0] = 3;
  ref_narrow(ref_axis_angle(0, 0, 1, REF_PI / 2), nodes[1].rest.rotation);
  assert_int_equal(tw_nodes_order(nodes, 2, order, NULL), TW_OK);
  tw_trs locals[] = {nodes[0].rest, nodes[1].rest};
  float local[32], world[32];
  tw_pose_locals(NULL, nodes, 2, locals, local);
  tw_pose_world(nodes, order, 2, local, world);
  /* 2 along the parent's x, scaled by 3 and turned to y, on top of its 5. */
  assert_true(fabsf(world[12]) < 1e-6f && fabsf(world[13] - 11) < 1e-5f);
  tw_pose_world(nodes, order, 2, local, local);
  assert_memory_equal(local, world, sizeof world);
}

TEST(shear_of_a_scaled_parent_is_kept) {
  tw_node nodes[] = {rest_node(TW_NO_INDEX), rest_node(0)};
  uint32_t order[] = {0, 1};
  nodes[0].rest.scale[1] = 2;
  ref_narrow(ref_axis_angle(0, 0, 1, REF_PI / 4), nodes[1].rest.rotation);
  tw_trs locals[] = {nodes[0].rest, nodes[1].rest}, back;
  float matrices[32];
  tw_pose_locals(NULL, nodes, 2, locals, matrices);
  tw_pose_world(nodes, order, 2, matrices, matrices);
  assert_true(fabsf(matrices[16] - sqrtf(0.5f)) < 1e-6f && fabsf(matrices[17] - 2 * sqrtf(0.5f)) < 1e-6f);
  assert_false(tw_trs_from_matrix(matrices + 16, &back));
}

/* A clip that turns node 0 by 90 degrees a second about z. */
static tw_clip *turning_clip(void) {
  static const float times[] = {0, 1}, values[] = {0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f};
  tw_track_keys track = quaternion_keys(TW_LINEAR, times, values, 2);
  return clip_of(&track, 1, -1);
}

TEST(a_matrix_counts_until_a_track_moves_the_node) {
  tw_node nodes[] = {rest_node(TW_NO_INDEX), rest_node(0)};
  for (int i = 0; i < 2; i++) {
    nodes[i].has_matrix = true;
    for (int j = 0; j < 16; j++) nodes[i].matrix[j] = (float)(10 * i + j);
  }
  tw_clip *clip = turning_clip();
  tw_trs locals[2];
  float matrices[32];
  tw_clip_pose(clip, nodes, 2, 1, locals);
  tw_pose_locals(clip, nodes, 2, locals, matrices);
  assert_true(fabsf(matrices[1] - 1) < 1e-6f && matrices[15] == 1);
  assert_memory_equal(matrices + 16, nodes[1].matrix, sizeof nodes[1].matrix);
  tw_pose_locals(NULL, nodes, 2, locals, matrices);
  assert_memory_equal(matrices, nodes[0].matrix, sizeof nodes[0].matrix);
  tw_clip_destroy(clip);
}

TEST(skin_matrices_are_the_identity_in_bind_pose) {
  tw_node nodes[] = {rest_node(TW_NO_INDEX), rest_node(0)};
  uint32_t order[] = {0, 1}, joints[] = {1};
  nodes[0].rest.translation[0] = 3;
  nodes[1].rest.translation[1] = 4;
  float inverse_bind[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -3, -4, 0, 1};
  tw_skin skin = {.joint_count = 1, .joints = joints, .inverse_bind = inverse_bind, .skeleton = TW_NO_INDEX};
  tw_clip *clip = turning_clip();
  tw_trs locals[2];
  float matrices[32], joint[16];
  tw_clip_pose(clip, nodes, 2, 0, locals);
  tw_pose_locals(clip, nodes, 2, locals, matrices);
  tw_pose_world(nodes, order, 2, matrices, matrices);
  tw_skin_matrices(&skin, matrices, joint);
  for (int i = 0; i < 16; i++) assert_true(joint[i] == (i % 5 == 0 ? 1 : 0));
  tw_clip_pose(clip, nodes, 2, 1,
               locals); /* turned about node 0: the joint's bind place (3, 4) goes to (-1, 0) */
  tw_pose_locals(clip, nodes, 2, locals, matrices);
  tw_pose_world(nodes, order, 2, matrices, matrices);
  tw_skin_matrices(&skin, matrices, joint);
  float x = joint[0] * 3 + joint[4] * 4 + joint[12], y = joint[1] * 3 + joint[5] * 4 + joint[13];
  assert_true(fabsf(x - -1) < 1e-5f && fabsf(y) < 1e-5f);
  tw_clip_destroy(clip);
}

enum { NODES = 70, TIMES = 150, KEYS = 40 };

/* Tracks of every path and kind on 70 nodes; about half share their key times, which come in bursts. */
static tw_clip *mixed_clip(tw_node *nodes) {
  static float times[NODES][KEYS], values[NODES][2][KEYS][12];
  static double angles[NODES][KEYS][4];
  tw_track_keys tracks[2 * NODES];
  uint64_t seed = 7;
  for (uint32_t n = 0; n < NODES; n++) {
    nodes[n] = rest_node(n ? n / 2 : TW_NO_INDEX);
    nodes[n].rest.translation[0] = (float)n;
    nodes[n].rest.scale[1] = n % 10 == 4 ? 2 : 1; /* no track scales these */
    float time = 0;
    for (int i = 0; i < KEYS; i++) {
      time += (float)(ref_random(&seed) < 0.2 ? 1.5 : ref_between(&seed, 0.001, 0.1));
      times[n][i] = n % 2 && n > 1 ? times[1][i] : time;
      for (int j = 0; j < 12; j++) {
        values[n][0][i][j] = (float)ref_between(&seed, -1, 1);
        values[n][1][i][j] = (float)ref_between(&seed, -1, 1);
      }
      for (int j = 0; j < 4; j++) angles[n][i][j] = ref_between(&seed, -9, 9);
    }
    static const tw_interpolation kinds[] = {TW_STEP, TW_LINEAR, TW_CUBICSPLINE, TW_NLERP, TW_SQUAD};
    tw_path path = n % 4 == 3 ? TW_WEIGHTS : n % 2 ? TW_SCALE : TW_TRANSLATION;
    tracks[2 * n] = n % 7 == 5   ? euler_keys(TW_XYZ, times[n], angles[n][0], KEYS)
                    : n % 7 == 6 ? axis_angle_keys(times[n], angles[n][0], KEYS)
                                 : quaternion_keys(kinds[n % 7], times[n], values[n][0][0], KEYS);
    tracks[2 * n + 1] = value_keys(path, (tw_interpolation)(n % 3), times[n], values[n][1][0], KEYS);
    tracks[2 * n].node = tracks[2 * n + 1].node = n;
  }
  return clip_of(tracks, 2 * NODES, -1);
}

/* The first times ascend by `step`, but for some that are out of order or none at all. */
static void assert_poses_are_samples(const tw_clip *clip, const tw_node *nodes, float step) {
  static const float odd[] = {-1, NAN, INFINITY, -INFINITY, 1e30f, -0.0f};
  uint64_t seed = 8;
  float times[TIMES];
  static float samples[NODES][TIMES][4];
  for (int i = 0; i < TIMES; i++)
    times[i] = i < TIMES / 2 ? (float)i * step : (float)ref_between(&seed, -1, 15);
  for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) times[11 * i + 3] = odd[i];
  for (uint32_t n = 0; n < NODES; n++)
    tw_clip_sample(clip, tw_clip_find(clip, n, TW_ROTATION), times, TIMES, samples[n][0]);
  for (int i = 0; i < TIMES; i++) {
    tw_trs pose[NODES];
    tw_clip_pose(clip, nodes, NODES, times[i], pose);
    for (uint32_t n = 0; n < NODES; n++)
      assert_memory_equal(pose[n].rotation, samples[n][i], sizeof pose[n].rotation);
    assert_true(pose[1].translation[0] == 1); /* at rest where no track moves it */
  }
}

TEST(poses_are_the_samples_of_their_tracks_byte_for_byte) {
  tw_node nodes[NODES];
  tw_clip *clip = mixed_clip(nodes);
  assert_poses_are_samples(clip, nodes, 0.2f);
  assert_poses_are_samples(clip, nodes, 0.01f); /* many times between two keys */
  tw_clip_destroy(clip);
}
