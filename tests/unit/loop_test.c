/* Loop's scheme: closed forms and invariants. OpenSubdiv's opinion is asked in tests/oracle. */
#include <math.h>

#include "built_cage.h"
#include "wrapped_memory.h"

/* ---- cages ----------------------------------------------------------------------------------- */

static cage *icosahedron(void) {
  static const float g = 1.618034f;
  static const uint32_t faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                        {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                        {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                        {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  cage *c = new_cage();
  for (uint32_t axis = 0; axis < 3; axis++)
    for (uint32_t i = 0; i < 4; i++) {
      float point[3] = {0, 0, 0};
      point[axis] = i % 2 ? 1 : -1;
      point[(axis + 1) % 3] = i < 2 ? g : -g;
      add_point(c, point[0], point[1], point[2]);
    }
  for (uint32_t f = 0; f < 20; f++) add_face(c, faces[f], 3);
  return c;
}

static tw_surface_options loop_at(uint32_t level) {
  return (tw_surface_options){.level = level, .scheme = TW_LOOP};
}

/* ---- bad input ------------------------------------------------------------------------------- */

TEST(over_sixteen_million_triangles_are_refused) {
  cage *c = icosahedron();
  tw_surface *surface = NULL;
  tw_surface_options options = loop_at(10);
  tw_error error;
  tw_surface_counts counts;
  assert_int_equal(tw_surface_create(&c->mesh, &options, &surface, &error), TW_LIMIT);
  assert_non_null(strstr(error.detail, "16777216"));
  assert_null(surface);
  assert_int_equal(tw_surface_count(&c->mesh, &options, &counts, NULL), TW_LIMIT);
  assert_int_equal(counts.faces, 20u << 20);
  free(c);
}

/* What is left out of the answer is refined all the same. */
TEST(holes_do_not_hide_how_many_triangles_are_refined) {
  cage *c = icosahedron();
  uint32_t holes[19];
  for (uint32_t i = 0; i < 19; i++) holes[i] = i;
  c->mesh.holes = holes;
  c->mesh.hole_count = 19;
  tw_surface *surface = NULL;
  tw_surface_options options = loop_at(10);
  tw_surface_counts counts;
  assert_int_equal(tw_surface_create(&c->mesh, &options, &surface, NULL), TW_LIMIT);
  assert_int_equal(tw_surface_count(&c->mesh, &options, &counts, NULL), TW_LIMIT);
  assert_int_equal(counts.faces, 1u << 20);
  free(c);
}

TEST(mesh_without_faces_gives_an_empty_surface) {
  cage *c = new_cage();
  for (uint32_t level = 0; level < 3; level++) {
    rows r = read_rows(&c->mesh, loop_at(level));
    assert_int_equal(r.count, 0);
    free_rows(&r);
  }
  free(c);
}

/* ---- closed forms ---------------------------------------------------------------------------- */

TEST(icosahedron_has_10_times_4_to_the_level_and_2_points) {
  cage *c = icosahedron();
  uint64_t power = 1;
  for (uint32_t level = 0; level <= 9; level++, power *= 4) {
    tw_surface_counts counts;
    tw_surface_options options = loop_at(level);
    assert_int_equal(tw_surface_count(&c->mesh, &options, &counts, NULL), TW_OK);
    assert_int_equal(counts.vertices, 10 * power + 2);
    assert_int_equal(counts.edges, 30 * power);
    assert_int_equal(counts.faces, 20 * power);
    assert_int_equal(counts.corners, 60 * power);
    if (level > 5) continue;
    rows r = read_rows(&c->mesh, options);
    assert_int_equal(tw_surface_row_count(r.surface, TW_DOMAIN_POINTS), 10 * power + 2);
    assert_int_equal(tw_surface_corners_before(r.surface, counts.faces), counts.corners);
    free_rows(&r);
  }
  free(c);
}

TEST(lone_triangle_has_triangular_numbers_of_points) {
  cage *c = new_cage();
  static const uint32_t face[3] = {0, 1, 2};
  add_point(c, 0, 0, 0);
  add_point(c, 1, 0, 0);
  add_point(c, 0, 1, 0);
  add_face(c, face, 3);
  for (uint32_t level = 0; level < 7; level++) {
    uint64_t side = 1u << level;
    tw_surface_options options = loop_at(level);
    tw_surface_counts counts;
    assert_int_equal(tw_surface_count(&c->mesh, &options, &counts, NULL), TW_OK);
    assert_int_equal(counts.vertices, (side + 1) * (side + 2) / 2);
    assert_int_equal(counts.edges, 3 * side * (side + 1) / 2);
    assert_int_equal(counts.faces, side * side);
  }
  free(c);
}

TEST(level_0_is_the_cage) {
  cage *c = icosahedron();
  tw_surface_options options = loop_at(0);
  options.normals = true;
  rows r = read_rows(&c->mesh, options);
  uint32_t *faces = faces_of(&r, TW_DOMAIN_POINTS);
  for (uint32_t i = 0; i < c->mesh.corner_count; i++)
    assert_memory_equal(row_of(&r, faces[i]), c->points[c->corners[i]], sizeof(float[3]));
  free(faces);
  free_rows(&r);
  free(c);
}

/* Quadratic with x^2 as it is along x; its values over the six neighbours of a point sum to 6 times its own
 * and 4. */
static float mixed(float x, float y) {
  return x * x + 2 * x * y - y * y;
}
TEST(limit_of_a_regular_grid_is_the_box_spline_with_its_normals) {
  cage *c = grid(8, 8, true, mixed);
  for (uint32_t level = 0; level <= 4; level++) {
    tw_surface_options options = loop_at(level);
    options.limit = options.normals = true;
    rows r = read_rows(&c->mesh, options);
    size_t inner = 0;
    for (size_t i = 0; i < r.count; i++) {
      const float *p = row_of(&r, i), *normal = p + r.layout->normal;
      if (p[0] < 0.999f || p[0] > 6.001f || p[1] < 0.999f || p[1] > 6.001f) continue;
      assert_float_equal(p[2], mixed(p[0], p[1]) + 1.0f / 3, 2e-5);
      float dx = 2 * p[0] + 2 * p[1], dy = 2 * p[0] - 2 * p[1], length = sqrtf(dx * dx + dy * dy + 1);
      assert_float_equal(normal[0], -dx / length, 2e-5);
      assert_float_equal(normal[1], -dy / length, 2e-5);
      assert_float_equal(normal[2], 1 / length, 2e-5);
      inner++;
    }
    assert_true(inner >= 36);
    free_rows(&r);
  }
  free(c);
}

/* ---- invariants ------------------------------------------------------------------------------ */

/* Float alone would leave rounding of a thousandth in these normals. */
TEST(normals_stay_exact_far_from_the_origin) {
  cage *near = icosahedron(), *far = icosahedron();
  for (uint32_t p = 0; p < 12; p++) far->points[p][0] += 1000;
  tw_surface_options options = loop_at(6);
  options.normals = true;
  rows a = read_rows(&near->mesh, options), b = read_rows(&far->mesh, options);
  for (size_t i = 0; i < a.count; i++)
    for (uint32_t k = 0; k < 3; k++)
      assert_float_equal(row_of(&a, i)[a.layout->normal + k], row_of(&b, i)[b.layout->normal + k], 1e-4);
  free_rows(&a);
  free_rows(&b);
  free(near);
  free(far);
}

static void assert_unit_normals(const rows *r) {
  for (size_t i = 0; i < r->count; i++) {
    const float *n = row_of(r, i) + r->layout->normal;
    assert_float_equal(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-5);
  }
}

TEST(normals_are_unit_even_where_there_is_no_tangent_plane) {
  static const uint32_t pillow[2][3] = {{0, 1, 2}, {0, 2, 1}};
  cage *shapes[3] = {new_cage(), new_cage(), icosahedron()};
  for (int s = 0; s < 2; s++) {
    add_point(shapes[s], 0, 0, 0);
    add_point(shapes[s], 1, 0, 0);
    add_point(shapes[s], 0, s == 0 ? 1 : 0, 0); /* the second lies on a line */
    for (int f = 0; f < 2; f++) add_face(shapes[s], pillow[f], 3);
  }
  memset(shapes[2]->points, 0, 12 * sizeof *shapes[2]->points); /* all in one place */
  for (int s = 0; s < 3; s++) {
    for (uint32_t level = 0; level < 4; level++) {
      tw_surface_options options = loop_at(level);
      options.normals = true;
      options.limit = level & 1;
      rows r = read_rows(&shapes[s]->mesh, options);
      assert_unit_normals(&r);
      free_rows(&r);
    }
    free(shapes[s]);
  }
}

TEST(bounds_are_those_of_the_rows) {
  cage *c = grid(6, 5, true, mixed);
  for (uint32_t level = 0; level < 5; level++)
    for (int boundary = TW_BOUNDARY_EDGE_AND_CORNER; boundary <= TW_BOUNDARY_OPEN; boundary++)
      for (int limit = 0; limit < 2; limit++) {
        tw_surface_options options = loop_at(level);
        options.boundary = (tw_boundary)boundary;
        options.limit = limit;
        rows r = read_rows(&c->mesh, options);
        assert_exact_bounds(&r);
        free_rows(&r);
      }
  free(c);
}
