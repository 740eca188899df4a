/* Meshes that nobody would model on purpose. */
#include "refined_mesh.h"

/* ---- faces that come to a vertex twice ------------------------------------------------------ */

/* Two quads, each of which has a vertex twice: alone, and joined to a quad that has not. */
static const float points[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}, {2, 0, 1}, {2, 1, 0}};
static const uint32_t twice[12] = {0, 1, 0, 2, 3, 4, 5, 4, 1, 4, 5, 3}, offsets[4] = {0, 4, 8, 12};

static tw_mesh twice_mesh(uint32_t faces) {
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = faces == 1 ? 3 : 6;
  mesh.positions = points[0];
  mesh.face_count = faces;
  mesh.corner_count = 4 * faces;
  mesh.face_offsets = offsets;
  mesh.corners = twice;
  return mesh;
}

/* Of a point from the nearest one of a mesh, by coordinate. */
static float distance_to(const float *point, const tw_mesh *mesh) {
  float least = INFINITY;
  for (uint32_t p = 0; p < mesh->point_count; p++)
    least = fminf(least, greatest_difference(point, mesh->positions + 3 * (size_t)p, 3));
  return least;
}

/* Deep levels are those of the first level, whose quads have four vertices each. */
TEST(a_quad_with_a_vertex_twice_is_refined_as_its_first_level_is) {
  for (uint32_t faces = 1; faces <= 3; faces += 2)
    for (int boundary = TW_BOUNDARY_EDGE_AND_CORNER; boundary <= TW_BOUNDARY_EDGE_ONLY; boundary++)
      for (uint32_t depth = 2; depth <= 5; depth++) {
        const tw_mesh mesh = twice_mesh(faces);
        tw_surface_options options = {.level = depth, .boundary = (tw_boundary)boundary, .normals = true};
        level whole = refine(&mesh, options);
        options.level = 1;
        level first = refine(&mesh, options);
        options.level = depth - 1;
        level rest = refine(&first.mesh, options);
        assert_int_equal(whole.mesh.point_count, rest.mesh.point_count);
        assert_int_equal(whole.mesh.face_count, rest.mesh.face_count);
        for (uint32_t p = 0; p < whole.mesh.point_count; p++)
          assert_true(distance_to(whole.points + 3 * (size_t)p, &rest.mesh) < 1e-5F);
        free_level(&whole);
        free_level(&first);
        free_level(&rest);
      }
}
