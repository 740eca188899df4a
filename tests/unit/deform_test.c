/* Control meshes moved by morph targets and joints. */
#include <math.h>

#include "rotation_reference.h"
#include "scene_fixture.h"
#include "test.h"

static float *deformed(const fixture *f, const float *weights, const float *matrices) {
  const tw_mesh *mesh = &f->model->meshes[0];
  float *out = malloc((size_t)mesh->point_count * 3 * sizeof *out);
  assert_non_null(out);
  assert_int_equal(tw_mesh_deform(mesh, weights, matrices, matrices ? 2 : 0, out, NULL), TW_OK);
  return out;
}

/* Joint matrices of the fixture's skin with these local transforms of hip and knee. */
static void matrices_of(const fixture *f, tw_trs hip, tw_trs knee, float out[2][16]) {
  const tw_model *model = f->model;
  tw_trs locals[3] = {model->nodes[0].rest, hip, knee};
  float world[3][16];
  assert_int_equal(model->node_count, 3);
  tw_pose_locals(NULL, model->nodes, 3, locals, world[0]);
  tw_pose_world(model->nodes, model->node_order, 3, world[0], world[0]);
  tw_skin_matrices(&model->skins[0], world[0], out[0]);
}

/* ---- bad input ------------------------------------------------------------------------------- */

TEST(points_beyond_all_bounds_are_named) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_skin(&f);
  float matrices[2][16] = {{0}}, out[24];
  tw_error error;
  matrices[0][0] = matrices[1][0] = 1;
  matrices[0][13] = INFINITY; /* moves y */
  assert_int_equal(tw_mesh_deform(&f.model->meshes[0], NULL, matrices[0], 2, out, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/positions/0/1");
  matrices[0][13] = 1e18f;
  assert_int_equal(tw_mesh_deform(&f.model->meshes[0], NULL, matrices[0], 2, out, &error), TW_OK);
  matrices[1][14] = 9e18f;
  assert_int_equal(tw_mesh_deform(&f.model->meshes[0], NULL, matrices[0], 2, out, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/positions/0/2");
  fixture_deinit(&f);
}

/* ---- closed forms ---------------------------------------------------------------------------- */

TEST(mesh_without_joints_and_targets_stays) {
  fixture f;
  fixture_init(&f, patchwork_text);
  float *out = deformed(&f, NULL, NULL);
  assert_memory_equal(out, f.model->meshes[0].positions, f.model->meshes[0].point_count * 12);
  free(out);
  fixture_deinit(&f);
}

TEST(weights_add_displacements) {
  static const float weights[3] = {0.5f, -1, 2};
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_add_morphs(&f, 3);
  const tw_mesh *mesh = &f.model->meshes[0];
  float *given = deformed(&f, weights, NULL), *own = deformed(&f, NULL, NULL);
  for (uint32_t i = 0; i < 3 * mesh->point_count; i++) {
    float by_given = mesh->positions[i], by_own = mesh->positions[i];
    for (int m = 0; m < 3; m++) {
      by_given += weights[m] * mesh->morphs[m][i];
      by_own += mesh->morph_weights[m] * mesh->morphs[m][i];
    }
    assert_float_equal(given[i], by_given, 1e-6);
    assert_float_equal(own[i], by_own, 1e-6);
  }
  free(given);
  free(own);
  fixture_deinit(&f);
}

TEST(rest_pose_leaves_points_where_they_are) {
  fixture f;
  float matrices[2][16];
  fixture_init(&f, cube_text);
  fixture_add_skin(&f);
  matrices_of(&f, f.model->nodes[1].rest, f.model->nodes[2].rest, matrices);
  float *out = deformed(&f, NULL, matrices[0]);
  for (int i = 0; i < 24; i++) assert_float_equal(out[i], f.model->meshes[0].positions[i], 1e-6);
  free(out);
  fixture_deinit(&f);
}

/* The knee turns a quarter round z at (0, 1, 0): three quarters of that for the high points. */
TEST(bent_knee_moves_points_by_their_shares) {
  fixture f;
  float matrices[2][16];
  fixture_init(&f, cube_text);
  fixture_add_skin(&f);
  tw_trs knee = f.model->nodes[2].rest;
  ref_narrow(ref_axis_angle(0, 0, 1, 1.5707963267948966), knee.rotation);
  matrices_of(&f, f.model->nodes[1].rest, knee, matrices);
  float *out = deformed(&f, NULL, matrices[0]);
  for (int p = 0; p < 8; p++) {
    const float *at = f.model->meshes[0].positions + 3 * p;
    float turned[3] = {1 - at[1], 1 + at[0], at[2]}, share = at[1] > 0 ? 0.75f : 0.25f;
    for (int c = 0; c < 3; c++)
      assert_float_equal(out[3 * p + c], (1 - share) * at[c] + share * turned[c], 1e-6);
  }
  free(out);
  fixture_deinit(&f);
}

TEST(targets_move_before_joints_do) {
  fixture f;
  float matrices[2][16];
  fixture_init(&f, cube_text);
  fixture_add_skin(&f);
  fixture_add_morphs(&f, 1);
  tw_trs hip = {{0, 0, 0, 1}, {1, 2, 3}, {2, 2, 2}};
  matrices_of(&f, hip, f.model->nodes[2].rest, matrices);
  static const float weight = 3;
  float *out = deformed(&f, &weight, matrices[0]);
  const tw_mesh *mesh = &f.model->meshes[0];
  for (int i = 0; i < 24; i++) {
    float wanted = 2 * (mesh->positions[i] + 3 * mesh->morphs[0][i]) + (float)(1 + i % 3);
    assert_float_equal(out[i], wanted, 1e-5);
  }
  free(out);
  fixture_deinit(&f);
}

TEST(sloppy_weights_count_relative_to_their_sum) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_skin(&f);
  tw_mesh *mesh = &f.model->meshes[0];
  float *weights = fixture_alloc(&f, mesh->point_count, 4 * sizeof *weights);
  for (uint32_t p = 1; p < mesh->point_count; p++) /* point 0 has none */
    for (uint32_t k = 0; k < 2; k++) weights[4 * p + k] = 5;
  mesh->skin.weights = weights;
  float matrices[2][16] = {{0}};
  for (int joint = 0; joint < 2; joint++)
    for (int i = 0; i < 4; i++) matrices[joint][5 * i] = 1;
  matrices[1][12] = 4;
  float *out = deformed(&f, NULL, matrices[0]);
  for (uint32_t p = 0; p < mesh->point_count; p++)
    assert_float_equal(out[3 * p], mesh->positions[3 * p] + (p == 0 ? 0.0f : 2.0f), 1e-6);
  free(out);
  fixture_deinit(&f);
}

/* Where one joint moves everything, subdividing before and after comes to the same. */
TEST(rigid_pose_commutes_with_subdivision) {
  fixture f;
  float matrices[2][16];
  fixture_init(&f, patchwork_text);
  fixture_add_skin(&f);
  tw_mesh *mesh = &f.model->meshes[0];
  uint16_t *joints = fixture_alloc(&f, mesh->point_count, 4 * sizeof *joints);
  for (uint32_t i = 0; i < 4 * mesh->point_count; i++) joints[i] = 1;
  mesh->skin.joints = joints;
  tw_trs knee = {{0.5f, 0.5f, -0.5f, 0.5f}, {3, 1, -2}, {1, 2, 3}};
  matrices_of(&f, f.model->nodes[1].rest, knee, matrices);
  float *moved = deformed(&f, NULL, matrices[0]);
  tw_mesh posed = *mesh;
  posed.positions = moved;
  tw_surface *before, *after;
  const tw_surface_options options = {.level = 3};
  assert_int_equal(tw_surface_create(mesh, &options, &before, NULL), TW_OK);
  assert_int_equal(tw_surface_create(&posed, &options, &after, NULL), TW_OK);
  tw_surface_reader *a = tw_surface_reader_create(before), *b = tw_surface_reader_create(after);
  for (uint64_t i = 0; i < tw_surface_row_count(before, TW_DOMAIN_POINTS); i++) {
    float at[3], to[3];
    tw_surface_read_rows(a, TW_DOMAIN_POINTS, i, 1, at);
    tw_surface_read_rows(b, TW_DOMAIN_POINTS, i, 1, to);
    const float *m = matrices[1];
    for (int c = 0; c < 3; c++)
      assert_float_equal(to[c], m[c] * at[0] + m[4 + c] * at[1] + m[8 + c] * at[2] + m[12 + c], 1e-5);
  }
  tw_surface_reader_destroy(a);
  tw_surface_reader_destroy(b);
  tw_surface_destroy(before);
  tw_surface_destroy(after);
  free(moved);
  fixture_deinit(&f);
}
