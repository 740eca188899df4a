/* Checking control meshes. */
#include <math.h>
#include <string.h>

#include "cube.h"
#include "test.h"
#include "tweend/mesh.h"

TEST(index_out_of_range_names_face_and_corner) {
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

TEST(a_point_twice_in_a_row_is_refused) {
  tw_mesh mesh = cube();
  uint32_t corners[24];
  memcpy(corners, cube_corners, sizeof corners);
  corners[7] = corners[4];
  mesh.corners = corners;
  tw_error error;
  assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_INVALID);
  assert_string_equal(error.pointer, "/faces/1/3");
  corners[7] = corners[5]; /* not in a row */
  assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_OK);
}

TEST(not_a_number_is_refused) {
  tw_mesh mesh = cube();
  float points[8][3];
  memcpy(points, cube_points, sizeof points);
  points[7][1] = NAN;
  mesh.positions = points[0];
  tw_error error;
  assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_INVALID);
  assert_string_equal(error.pointer, "/positions/7/1");
}

TEST(names_of_attributes_are_escaped_in_pointers) {
  static const float values[8] = {0, 0, INFINITY};
  char name[200] = "_A/B~C";
  tw_attribute attribute = {.name = name, .width = 1, .values = values};
  tw_mesh mesh = cube();
  mesh.attributes = &attribute;
  mesh.attribute_count = 1;
  tw_error error;
  assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_INVALID);
  assert_string_equal(error.pointer, "/_A~1B~0C/2/0");
  for (size_t length = 150; length < sizeof name; length++) { /* no room for name and indices */
    memset(name, '/', length - 1);
    name[length] = '\0';
    name[length - 1] = length % 2 ? '_' : '~';
    assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_INVALID);
    assert_string_equal(error.pointer, "");
  }
}

TEST(tangents_follow_no_uv_set_that_is_not_there) {
  static const uint8_t sets[6] = {0, 0, 0, 0, 1, 0};
  static const float uv[2] = {0, 0};
  static const uint32_t uv_corners[24] = {0};
  tw_mesh mesh = cube();
  mesh.uv_set_count = 1;
  mesh.uv_sets[0] = (tw_uv_set){1, uv, uv_corners};
  mesh.tangent_uvs = sets;
  tw_error error;
  assert_int_equal(tw_mesh_check(&mesh, &error, NULL), TW_INVALID);
  assert_string_equal(error.pointer, "/tangent_uvs/4");
}
