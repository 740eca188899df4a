/* Meshes that nobody would model on purpose. */
#include "cube.h"
#include "refined_mesh.h"
#include "triangulator.h"

/* ---- faces that come to a vertex twice ------------------------------------------------------- */

/* Two quads, each of which has a vertex twice: alone, and joined to a quad that has not. */
static const float points[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}, {2, 0, 1}, {2, 1, 0}};
static const uint32_t twice[12] = {0, 1, 0, 2, 3, 4, 5, 4, 1, 4, 5, 3}, offsets[4] = {0, 4, 8, 12};

static tw_mesh twice_mesh(uint32_t faces) {
  return mesh_of(points[0], faces == 1 ? 3 : 6, twice, offsets, faces);
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

/* ---- edges of many faces --------------------------------------------------------------------- */

/* Reads a level with normals, and tangents where the mesh asks for them, below a first level that bears
 * details of no length: that of the same mesh without them, nearly. */
static void check_below_details(tw_mesh *mesh, uint32_t depth) {
  tw_surface_options options = {.level = 1, .normals = true};
  tw_surface_counts counts;
  assert_int_equal(tw_surface_count(mesh, &options, &counts, NULL), TW_OK);
  float *none = calloc(counts.vertices, 3 * sizeof *none);
  assert_non_null(none);
  const tw_detail detail = {1, (uint32_t)counts.vertices, none};
  options.level = depth;
  level plain = refine(mesh, options);
  mesh->detail_count = 1;
  mesh->details = &detail;
  level detailed = refine(mesh, options);
  mesh->detail_count = 0;
  assert_int_equal(detailed.mesh.point_count, plain.mesh.point_count);
  for (uint32_t p = 0; p < plain.mesh.point_count; p += 97)
    assert_true(distance_to(detailed.points + 3 * (size_t)p, &plain.mesh) < 1e-4F);
  free_level(&plain);
  free_level(&detailed);
  free(none);
}

/* An edge of n triangles: in the middle of it a vertex of 2 n quads. */
TEST(an_edge_of_thousands_of_faces_below_a_level_with_details) {
  const uint32_t face_count = 3000 / test_stride();
  float *positions = calloc(face_count + 2, 3 * sizeof *positions);
  uint32_t *corners = malloc(3 * face_count * sizeof *corners),
           *faces = malloc((face_count + 1) * sizeof *faces);
  assert_true(positions && corners && faces);
  positions[3] = 1;
  faces[0] = 0;
  for (uint32_t f = 0; f < face_count; f++) {
    const uint32_t face[3] = {f % 2, 1 - f % 2, 2 + f};
    positions[3 * (f + 2) + 1] = cosf((float)f);
    positions[3 * (f + 2) + 2] = sinf((float)f);
    memcpy(corners + 3 * (size_t)f, face, sizeof face);
    faces[f + 1] = 3 * (f + 1);
  }
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = face_count + 2;
  mesh.positions = positions;
  mesh.face_count = face_count;
  mesh.corner_count = 3 * face_count;
  mesh.face_offsets = faces;
  mesh.corners = corners;
  check_below_details(&mesh, 2);
  free(positions);
  free(corners);
  free(faces);
}

/* Four faces run along an edge, two of them twice: of the points that is three edges, of three faces at most,
 * of the texture one of four. */
TEST(a_texture_whose_edges_have_more_faces_than_those_of_the_points) {
  static const float positions[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1},
                                        {0, 1, 1}, {0, 0, 1}, {1, 0, 1}, {0, -1, 1}},
                     values[14][2] = {{0, 0},       {1, 0},       {0, 1},      {1, 1},
                                      {0.5F, 1},    {0.2F, 0.7F}, {1, 0.5F},   {0.3F, 1},
                                      {0.9F, 0.4F}, {0.6F, 0.3F}, {0.1F, 0.9F}};
  static const uint32_t corners[16] = {0, 1, 0, 2, 0, 1, 3, 4, 0, 1, 0, 5, 0, 1, 6, 7},
                        uv_corners[16] = {0, 1, 2, 3, 0, 1, 4, 5, 0, 1, 6, 7, 0, 1, 8, 9},
                        faces[5] = {0, 4, 8, 12, 16};
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = 8;
  mesh.positions = positions[0];
  mesh.face_count = 4;
  mesh.corner_count = 16;
  mesh.face_offsets = faces;
  mesh.corners = corners;
  mesh.uv_set_count = 1;
  mesh.uv_sets[0] = (tw_uv_set){14, values[0], uv_corners};
  mesh.has_tangents = true;
  check_below_details(&mesh, 2);
}

/* A face that goes to and fro between two points, beside faces whose fans start from both. What stands behind
 * its corners is not its. */
TEST(a_fan_starts_within_its_face) {
  const uint32_t corners[] = {0, 1, 0, 1, 7}, own = 4, zero = 0, one = 1, two = 2;
  uint32_t start;
  tw_fan_start(corners, own, NULL, &zero, &one, &start);
  assert_int_equal(corners[start], 1); /* at least not with the previous face */
  tw_fan_start(corners, own, NULL, &one, &zero, &start);
  assert_int_equal(corners[start], 0);
  assert_true(start < own);
  tw_fan_start(corners, own + 1, NULL, &zero, &one, &start);
  assert_int_equal(start, 4);
  assert_true(tw_fan_start(corners, own, NULL, &zero, &two, &start));
  assert_int_equal(start, 1);
}
