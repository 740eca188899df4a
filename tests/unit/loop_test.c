/* Loop's scheme: closed forms and invariants. OpenSubdiv's opinion is asked in tests/oracle. */
#include <math.h>

#include "built_cage.h"

/* ---- cages ---------------------------------------------------------------------------------- */

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

/* Triangles from an apex at height 1 to a ring at height 0. */
static cage *cone(uint32_t valence) {
  cage *c = new_cage();
  add_point(c, 0, 0, 1);
  for (uint32_t i = 0; i < valence; i++) {
    double angle = 2 * acos(-1) * i / valence;
    add_point(c, (float)cos(angle), (float)sin(angle), 0);
  }
  for (uint32_t i = 0; i < valence; i++) {
    uint32_t face[3] = {0, 1 + i, 1 + (i + 1) % valence};
    add_face(c, face, 3);
  }
  return c;
}

static tw_surface_options loop_at(uint32_t level) {
  return (tw_surface_options){.level = level, .scheme = TW_LOOP};
}

/* ---- bad input ------------------------------------------------------------------------------ */

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

/* ---- closed forms --------------------------------------------------------------------------- */

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
static float along_x(float x, float y) {
  (void)y;
  return x * x;
}

/* Every step adds a quarter of the squared step to such a quadratic, at points and at edges alike: the box
 * spline's own third in the end. Points lie on the finer grid. */
TEST(regular_grid_is_the_quartic_box_spline) {
  cage *c = grid(8, 8, true, mixed);
  for (uint32_t level = 1; level <= 4; level++) {
    rows r = read_rows(&c->mesh, loop_at(level));
    float fine = (float)(1u << level), raised = (1 - 1 / (fine * fine)) / 3;
    size_t inner = 0;
    for (size_t i = 0; i < r.count; i++) {
      const float *p = row_of(&r, i);
      if (p[0] < 0.999f || p[0] > 6.001f || p[1] < 0.999f || p[1] > 6.001f) continue;
      assert_float_equal(p[0] * fine, roundf(p[0] * fine), 1e-4);
      assert_float_equal(p[1] * fine, roundf(p[1] * fine), 1e-4);
      assert_float_equal(p[2], mixed(p[0], p[1]) + raised, 2e-5);
      inner++;
    }
    assert_int_equal(inner, (5 * (1u << level) + 1) * (5 * (1u << level) + 1));
    free_rows(&r);
  }
  free(c);
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

TEST(border_is_the_cubic_spline_of_its_points) {
  cage *c = grid(9, 3, true, along_x);
  for (uint32_t level = 1; level <= 5; level++) {
    rows r = read_rows(&c->mesh, loop_at(level));
    float fine = (float)(1u << level), raised = (1 - 1 / (fine * fine)) / 3;
    size_t checked = 0;
    for (size_t i = 0; i < r.count; i++) {
      const float *p = row_of(&r, i);
      if (p[1] != 0 || p[0] < 0.999f || p[0] > 7.001f) continue;
      assert_float_equal(p[2], p[0] * p[0] + raised, 2e-5);
      checked++;
    }
    assert_int_equal(checked, 6 * (1u << level) + 1);
    free_rows(&r);
  }
  free(c);
}

static float apex_of_cone(uint32_t valence, uint32_t level, bool limit) {
  cage *c = cone(valence);
  tw_surface_options options = loop_at(level);
  options.limit = limit;
  rows r = read_rows(&c->mesh, options);
  float height = row_of(&r, 0)[2];
  free_rows(&r);
  free(c);
  return height;
}

/* Weights of Loop's thesis: 3/16 for each of three neighbours, 31/256 for each of four. */
TEST(apex_of_a_cone_sinks_by_the_weight_of_its_valence) {
  assert_float_equal(apex_of_cone(3, 1, false), 1 - 9.0 / 16, 1e-7);
  assert_float_equal(apex_of_cone(4, 1, false), 1 - 31.0 / 64, 1e-7);
  assert_float_equal(apex_of_cone(6, 1, false), 1 - 3.0 / 8, 1e-7);
  assert_float_equal(apex_of_cone(3, 0, true), 2.0 / 5, 1e-7);
  assert_float_equal(apex_of_cone(6, 0, true), 1.0 / 2, 1e-7);
}

TEST(limit_is_where_the_levels_lead) {
  for (uint32_t valence = 3; valence <= 12; valence++) {
    float limit = apex_of_cone(valence, 1, true);
    assert_float_equal(apex_of_cone(valence, 3, true), limit, 1e-6);
    assert_float_equal(apex_of_cone(valence, 8, false), limit, 1e-4);
    assert_true(fabsf(apex_of_cone(valence, 5, false) - limit) >
                fabsf(apex_of_cone(valence, 6, false) - limit));
  }
}

TEST(triangle_inside_an_infinite_crease_stays_flat_and_sharp) {
  cage *c = icosahedron();
  uint32_t creases[6] = {c->corners[0], c->corners[1], c->corners[1],
                         c->corners[2], c->corners[2], c->corners[0]};
  static const float sharpness[3] = {10, 10, 10};
  c->mesh.crease_count = 3;
  c->mesh.crease_edges = creases;
  c->mesh.crease_sharpness = sharpness;
  tw_surface_options options = loop_at(4);
  options.normals = true;
  rows r = read_rows(&c->mesh, options);
  uint32_t *faces = faces_of(&r, TW_DOMAIN_VERTICES);
  /* The first face of the cage comes first: 256 triangles whose normals are all the same. */
  const float *normal = row_of(&r, faces[0]) + r.layout->normal;
  for (uint32_t i = 0; i < 3 * 256; i++)
    for (int k = 0; k < 3; k++)
      assert_float_equal(row_of(&r, faces[i])[r.layout->normal + (uint32_t)k], normal[k], 1e-5);
  /* The crease's 48 points have a second row with the other side's normal. */
  assert_int_equal(r.count, tw_surface_get_counts(r.surface)->vertices + 48);
  free(faces);
  free_rows(&r);
  free(c);
}

/* ---- invariants ----------------------------------------------------------------------------- */

/* The surface of level 1 taken as a cage. */
static cage *first_level(const tw_mesh *mesh) {
  rows r = read_rows(mesh, loop_at(1));
  uint32_t *faces = faces_of(&r, TW_DOMAIN_POINTS);
  cage *c = new_cage();
  for (size_t i = 0; i < r.count; i++) add_point(c, row_of(&r, i)[0], row_of(&r, i)[1], row_of(&r, i)[2]);
  for (uint64_t f = 0; f < tw_surface_get_counts(r.surface)->faces; f++) add_face(c, faces + 3 * f, 3);
  free(faces);
  free_rows(&r);
  return c;
}

TEST(two_levels_are_one_level_twice) {
  cage *c = cone(5), *once = first_level(&c->mesh);
  rows twice = read_rows(&once->mesh, loop_at(1)), direct = read_rows(&c->mesh, loop_at(2));
  uint32_t *a = faces_of(&twice, TW_DOMAIN_POINTS), *b = faces_of(&direct, TW_DOMAIN_POINTS);
  uint64_t corners = tw_surface_get_counts(direct.surface)->corners;
  assert_int_equal(tw_surface_get_counts(twice.surface)->corners, corners);
  for (uint64_t i = 0; i < corners; i++)
    for (int k = 0; k < 3; k++) assert_float_equal(row_of(&twice, a[i])[k], row_of(&direct, b[i])[k], 1e-6);
  free(a);
  free(b);
  free_rows(&twice);
  free_rows(&direct);
  free(once);
  free(c);
}

TEST(affine_maps_commute_with_subdivision) {
  static const float map[3][4] = {{1.5f, 0.25f, -2, 3}, {0.5f, -1, 0.125f, -7}, {0.75f, 2, 1, 0.5f}};
  cage *c = icosahedron(), *mapped = icosahedron();
  for (uint32_t p = 0; p < 12; p++)
    for (int k = 0; k < 3; k++) {
      mapped->points[p][k] = map[k][3];
      for (int j = 0; j < 3; j++) mapped->points[p][k] += map[k][j] * c->points[p][j];
    }
  rows before = read_rows(&c->mesh, loop_at(4)), after = read_rows(&mapped->mesh, loop_at(4));
  for (size_t i = 0; i < before.count; i++)
    for (int k = 0; k < 3; k++) {
      const float *p = row_of(&before, i);
      float expected = map[k][0] * p[0] + map[k][1] * p[1] + map[k][2] * p[2] + map[k][3];
      assert_float_equal(row_of(&after, i)[k], expected, 1e-5);
    }
  free_rows(&before);
  free_rows(&after);
  free(c);
  free(mapped);
}

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
  memset(shapes[2]->points, 0, sizeof shapes[2]->points); /* all in one place */
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

TEST(blocks_of_any_size_hold_the_same_bytes) {
  cage *c = icosahedron();
  tw_surface_options options = loop_at(4);
  options.normals = options.limit = true;
  rows r = read_rows(&c->mesh, options);
  tw_surface_reader *reader = tw_surface_reader_create(r.surface);
  size_t stride = r.layout->stride;
  float *block = malloc(997 * stride * sizeof *block);
  assert_non_null(reader);
  assert_non_null(block);
  for (size_t first = 0, count = 1; first < r.count; first += count, count = (count * 7 + 3) % 997) {
    if (count > r.count - first) count = r.count - first;
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, first, count, block);
    assert_memory_equal(block, row_of(&r, first), count * stride * sizeof *block);
  }
  free(block);
  tw_surface_reader_destroy(reader);
  free_rows(&r);
  free(c);
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
        float min[3], max[3];
        assert_int_equal(tw_surface_bounds(r.surface, -1, min, max), TW_OK);
        for (int k = 0; k < 3; k++) {
          float low = row_of(&r, 0)[k], high = low;
          for (size_t i = 0; i < r.count; i++) {
            low = fminf(low, row_of(&r, i)[k]);
            high = fmaxf(high, row_of(&r, i)[k]);
          }
          assert_true(min[k] == low && max[k] == high);
        }
        free_rows(&r);
      }
  free(c);
}
