/* Checking and describing control meshes. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "cube.h"
#include "tweend/mesh.h"

static void index_out_of_range_names_face_and_corner(void **state) {
  (void)state;
  tw_mesh mesh = cube();
  uint32_t corners[24], face;
  memcpy(corners, cube_corners, sizeof corners);
  corners[13] = 8;
  mesh.corners = corners;
  tw_error error;
  assert_int_equal(tw_mesh_check(&mesh, &error, &face), TW_INVALID);
  assert_string_equal(error.pointer, "/faces/3/1");
  assert_int_equal(face, 3);
}

static void repeated_point_in_a_face_is_refused(void **state) {
  (void)state;
  tw_mesh mesh = cube();
  uint32_t corners[24];
  memcpy(corners, cube_corners, sizeof corners);
  corners[7] = corners[4];
  mesh.corners = corners;
  tw_error error;
  assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_INVALID);
  assert_string_equal(error.pointer, "/faces/1/3");
}

static void not_a_number_is_refused(void **state) {
  (void)state;
  tw_mesh mesh = cube();
  float points[8][3];
  memcpy(points, cube_points, sizeof points);
  points[7][1] = NAN;
  mesh.positions = points[0];
  tw_error error;
  assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_INVALID);
  assert_string_equal(error.pointer, "/positions/7/1");
}

static void cube_is_a_closed_sphere(void **state) {
  (void)state;
  tw_mesh mesh = cube();
  tw_mesh_facts facts;
  assert_int_equal(tw_mesh_describe(&mesh, &facts, NULL), TW_OK);
  assert_int_equal(facts.vertices, 8);
  assert_int_equal(facts.edges, 12);
  assert_int_equal(facts.faces, 6);
  assert_int_equal(facts.euler_characteristic, 2);
  assert_int_equal(facts.components, 1);
  assert_int_equal(facts.boundary_loops, 0);
  assert_int_equal(facts.extraordinary_vertices, 8);
  assert_int_equal(facts.valence_count, 1);
  assert_int_equal(facts.valences[0], 3);
  assert_int_equal(facts.nonmanifold_vertices, 0);
  tw_mesh_facts_deinit(&facts);
}

static void three_faces_on_an_edge_are_found(void **state) {
  (void)state;
  static const float points[5][3] = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}};
  static const uint32_t corners[9] = {0, 1, 2, 1, 0, 3, 0, 1, 4}, offsets[4] = {0, 3, 6, 9};
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = 5;
  mesh.positions = points[0];
  mesh.face_count = 3;
  mesh.corner_count = 9;
  mesh.face_offsets = offsets;
  mesh.corners = corners;
  tw_mesh_facts facts;
  assert_int_equal(tw_mesh_describe(&mesh, &facts, NULL), TW_OK);
  assert_int_equal(facts.nonmanifold_edges, 1);
  assert_int_equal(facts.nonmanifold_edge_points[0][0], 0);
  assert_int_equal(facts.nonmanifold_edge_points[0][1], 1);
  assert_int_equal(facts.nonmanifold_vertices, 2);
  assert_int_equal(facts.boundary_edges, 6);
  tw_mesh_facts_deinit(&facts);
}

static void faces_that_share_only_a_point_are_a_bow_tie(void **state) {
  (void)state;
  static const float points[5][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
  static const uint32_t corners[6] = {0, 1, 2, 0, 3, 4}, offsets[3] = {0, 3, 6};
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = 5;
  mesh.positions = points[0];
  mesh.face_count = 2;
  mesh.corner_count = 6;
  mesh.face_offsets = offsets;
  mesh.corners = corners;
  tw_mesh_facts facts;
  assert_int_equal(tw_mesh_describe(&mesh, &facts, NULL), TW_OK);
  assert_int_equal(facts.nonmanifold_edges, 0);
  assert_int_equal(facts.nonmanifold_vertices, 1);
  assert_int_equal(facts.nonmanifold_vertex_points[0], 0);
  tw_mesh_facts_deinit(&facts);
}

static void a_mesh_of_nothing_is_described(void **state) {
  (void)state;
  static const uint32_t offsets[1] = {0};
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.face_offsets = offsets;
  tw_mesh_facts facts;
  assert_int_equal(tw_mesh_check(&mesh, NULL, NULL), TW_OK);
  assert_int_equal(tw_mesh_describe(&mesh, &facts, NULL), TW_OK);
  assert_int_equal(facts.vertices + facts.edges + facts.faces + facts.components, 0);
  tw_mesh_facts_deinit(&facts);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(index_out_of_range_names_face_and_corner),
      cmocka_unit_test(repeated_point_in_a_face_is_refused),
      cmocka_unit_test(not_a_number_is_refused),
      cmocka_unit_test(cube_is_a_closed_sphere),
      cmocka_unit_test(three_faces_on_an_edge_are_found),
      cmocka_unit_test(faces_that_share_only_a_point_are_a_bow_tie),
      cmocka_unit_test(a_mesh_of_nothing_is_described),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
