/* What Catmull-Clark surfaces are exactly: splines, maps that they commute with, and normals
 * where there is no plane to be tangent to. */
#include <math.h>

#include "built_cage.h"
#include "cube.h"

/* ---- splines --------------------------------------------------------------------------------- */

static float cubic(float x, float y) {
  return 0.02f * x * x * x + 0.1f * x * x * y;
}

/* A uniform cubic B-spline over x^2 is x^2 + 1/3, over x^3 it is x^3 + x; the control points after some
 * levels lack a share of that which falls to a quarter with each. */
static double refined_cubic(double x, double y, double missing) {
  double raised = 1 - missing;
  return 0.02 * (x * x * x + x * raised) + 0.1 * (x * x + raised / 3) * y;
}

static size_t assert_cubic(const rows *r, double missing) {
  size_t inner = 0;
  for (size_t i = 0; i < r->count; i++) {
    const float *p = row_of(r, i), *normal = p + r->layout->normal;
    double x = (double)p[0], y = (double)p[1];
    if (x < 0.999 || x > 6.001 || y < 0.999 || y > 6.001) continue;
    assert_float_equal(p[2], (float)refined_cubic(x, y, missing), 2e-5);
    inner++;
    if (missing > 0) continue; /* the normal is that of the limit point above */
    double dx = 0.06 * x * x + 0.02 + 0.2 * x * y, dy = 0.1 * (x * x + 1.0 / 3);
    double length = sqrt(dx * dx + dy * dy + 1);
    assert_float_equal(normal[0], (float)(-dx / length), 2e-5);
    assert_float_equal(normal[1], (float)(-dy / length), 2e-5);
    assert_float_equal(normal[2], (float)(1 / length), 2e-5);
  }
  return inner;
}

TEST(a_regular_grid_is_the_bicubic_b_spline_at_every_level) {
  cage *c = grid(8, 8, false, cubic);
  for (uint32_t level = 0; level <= 7; level++)
    for (int limit = 0; limit < 2; limit++) {
      tw_surface_options options = {.level = level, .limit = limit, .normals = true};
      rows r = read_rows(&c->mesh, options);
      size_t inner = assert_cubic(&r, limit ? 0 : 1 / (double)(1u << (2 * level)));
      assert_true(inner >= (5 * (1u << level) - 1) * (5 * (1u << level) - 1));
      free_rows(&r);
    }
  free(c);
}

/* ---- maps ------------------------------------------------------------------------------------ */

static float ridge(float x, float y) {
  return 0.25f * fabsf(x - 3) + 0.125f * fabsf(y - 3);
}

/* A face of five corners, one of three and a pole amid quads, so that nothing is regular. */
static cage *irregular(void) {
  static const uint32_t faces[7][6] = {{4, 0, 1, 2, 3}, {4, 1, 4, 5, 2},  {3, 2, 5, 6},    {5, 3, 2, 6, 7, 8},
                                       {3, 0, 3, 8},    {4, 0, 8, 9, 10}, {4, 0, 10, 4, 1}};
  cage *c = new_cage();
  for (uint32_t i = 0; i < 11; i++)
    add_point(c, (float)(i * 7 % 5) - 2, (float)(i * 3 % 7) - 3, 0.5f * (float)(i * 5 % 4));
  for (int f = 0; f < 7; f++) add_face(c, faces[f] + 1, faces[f][0]);
  return c;
}

TEST(affine_maps_commute_with_subdivision) {
  static const float map[3][4] = {{1.5f, 0.25f, -2, 3}, {0.5f, -1, 0.125f, -7}, {0.75f, 2, 1, 0.5f}};
  for (int flags = 0; flags < 8; flags++) {
    cage *c = irregular(), *mapped = irregular();
    for (uint32_t p = 0; p < c->mesh.point_count; p++)
      for (int k = 0; k < 3; k++) {
        mapped->points[p][k] = map[k][3];
        for (int j = 0; j < 3; j++) mapped->points[p][k] += map[k][j] * c->points[p][j];
      }
    tw_surface_options options = {.level = 4,
                                  .limit = flags & 1,
                                  .boundary = flags & 2 ? TW_BOUNDARY_EDGE_ONLY : TW_BOUNDARY_EDGE_AND_CORNER,
                                  .triangles = flags & 4 ? TW_TRIANGLES_SMOOTH : TW_TRIANGLES_CATMULL_CLARK};
    rows before = read_rows(&c->mesh, options), after = read_rows(&mapped->mesh, options);
    assert_int_equal(before.count, after.count);
    for (size_t i = 0; i < before.count; i++)
      for (int k = 0; k < 3; k++) {
        const float *p = row_of(&before, i);
        float expected = map[k][0] * p[0] + map[k][1] * p[1] + map[k][2] * p[2] + map[k][3];
        assert_float_equal(row_of(&after, i)[k], expected, 2e-5);
      }
    free_rows(&before);
    free_rows(&after);
    free(c);
    free(mapped);
  }
}

/* ---- normals --------------------------------------------------------------------------------- */

/* Triangles are cut so that each side mirrors the other. */
static cage *symmetric_roof(bool triangles) {
  cage *whole = grid(7, 7, false, ridge);
  if (!triangles) return whole;
  cage *c = new_cage_over(whole);
  for (uint32_t f = 0; f < whole->mesh.face_count; f++) {
    const uint32_t *q = whole->corners + 4 * (size_t)f;
    uint32_t turned[4] = {q[1], q[2], q[3], q[0]};
    add_quad(c, f % 6 < 3 ? q : turned, true);
  }
  free(whole);
  return c;
}

/* Both sides of the roof have the same part in its ridge, however long that stays sharp. */
TEST(normals_along_a_semi_sharp_ridge_lean_to_neither_side) {
  for (int triangles = 0; triangles < 2; triangles++)
    for (int sharpness = 1; sharpness <= 4; sharpness++) {
      cage *c = symmetric_roof(triangles);
      uint32_t edges[12];
      float sharp[6];
      for (uint32_t i = 0; i < 6; i++) {
        edges[2 * i] = 3 + 7 * i;
        edges[2 * i + 1] = 3 + 7 * (i + 1);
        sharp[i] = (float)sharpness - 0.25f;
      }
      c->mesh.crease_count = 6;
      c->mesh.crease_edges = edges;
      c->mesh.crease_sharpness = sharp;
      for (uint32_t level = 0; level <= 5; level++) {
        tw_surface_options options = {
            .level = level, .scheme = triangles ? TW_LOOP : TW_CATMULL_CLARK, .normals = true};
        rows r = read_rows(&c->mesh, options);
        for (size_t i = 0; i < r.count; i++)
          if (row_of(&r, i)[0] == 3) assert_float_equal(row_of(&r, i)[r.layout->normal], 0, 1e-6);
        free_rows(&r);
      }
      free(c);
    }
}

/* The corner of a border that is smooth stays in the plane of its two edges, which straighten out: the
 * further the level, the less of a plane is left to see. Once as a patch, and once refined in the generic
 * way, to which UVs and Chaikin's rule lead together. */
TEST(the_plane_at_a_smooth_border_corner_holds_at_every_level) {
  static const uint32_t face[4] = {0, 1, 2, 3}, edge[2] = {1, 2};
  static const float sharpness = 1.5f, uvs[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  cage *c = new_cage();
  add_point(c, 5.1f, 5.2f, 5.3f);
  add_point(c, 6.1f, 5.2f, 5.3f); /* along x */
  add_point(c, 6.4f, 6.7f, 6.6f);
  add_point(c, 5.1f, 5.8f, 6.1f); /* along 3 y + 4 z */
  add_face(c, face, 4);
  for (int generic = 0; generic < 2; generic++) {
    if (generic) {
      c->mesh.uv_set_count = 1;
      c->mesh.uv_sets[0] = (tw_uv_set){4, uvs[0], face};
      c->mesh.crease_count = 1;
      c->mesh.crease_edges = edge;
      c->mesh.crease_sharpness = &sharpness;
    }
    for (uint32_t level = 0; level <= (generic ? 3 : 8); level++) { /* float sees no more of it there */
      tw_surface_options options = {
          .level = level, .boundary = TW_BOUNDARY_EDGE_ONLY, .creasing = TW_CREASE_CHAIKIN, .normals = true};
      rows r = read_rows(&c->mesh, options);
      const float *normal = row_of(&r, 0) + r.layout->normal;
      assert_float_equal(normal[0], 0, 1e-5);
      assert_float_equal(normal[1], -0.8f, 1e-5);
      assert_float_equal(normal[2], 0.6f, 1e-5);
      free_rows(&r);
    }
  }
  free(c);
}

static void assert_unit_normals(const tw_mesh *mesh) {
  for (uint32_t level = 0; level <= 3; level++)
    for (int scheme = 0; scheme < 2; scheme++)
      for (int boundary = TW_BOUNDARY_EDGE_AND_CORNER; boundary <= TW_BOUNDARY_OPEN; boundary++) {
        tw_surface_options options = {.level = level,
                                      .scheme = scheme ? TW_BILINEAR : TW_CATMULL_CLARK,
                                      .boundary = (tw_boundary)boundary,
                                      .limit = level & 1,
                                      .normals = true};
        rows r = read_rows(mesh, options);
        for (size_t i = 0; i < r.count; i++) {
          const float *n = row_of(&r, i) + r.layout->normal;
          assert_float_equal(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-5);
        }
        free_rows(&r);
      }
}

TEST(normals_are_unit_whatever_the_neighbourhood) {
  static const uint32_t pillow[2][4] = {{0, 1, 2, 3}, {3, 2, 1, 0}};
  static const uint32_t creases[6] = {0, 1, 1, 2, 2, 3};
  static const float sharpness[3] = {10, 1.5f, 0.5f};
  for (int shape = 0; shape < 6; shape++) {
    cage *c = shape == 0 ? new_cage() : shape == 1 ? irregular() : grid(5, 4, false, ridge);
    if (shape == 0) {
      for (int i = 0; i < 4; i++) add_point(c, (float)(i == 1 || i == 2), (float)(i >= 2), 0);
      for (int f = 0; f < 2; f++) add_face(c, pillow[f], 4);
    }
    for (uint32_t p = 0; p < c->mesh.point_count; p++)
      for (int k = 0; k < 3; k++) {
        float *at = &c->points[p][k];
        if (shape == 2) *at = 1;                        /* all in one place */
        if (shape == 3) *at = (float)p;                 /* on a line */
        if (shape == 4) *at *= 1e-30f;                  /* what float cannot square */
        if (shape == 5) *at *= TW_COORDINATE_MAX / 100; /* nor this */
      }
    c->mesh.crease_count = 3;
    c->mesh.crease_edges = creases;
    c->mesh.crease_sharpness = sharpness;
    assert_unit_normals(&c->mesh);
    free(c);
  }
}

/* The places of the corners are exact there too, and so are the differences that normals live on. */
TEST(normals_near_irregular_points_stay_as_they_are_far_from_the_origin) {
  float far[8][3];
  tw_mesh mesh = cube(), moved = cube();
  for (int p = 0; p < 8; p++)
    for (int k = 0; k < 3; k++) far[p][k] = cube_points[p][k] + (float)(4096 << k);
  moved.positions = far[0];
  for (uint32_t level = 1; level <= 7; level++) {
    tw_surface_options options = {.level = level, .normals = true};
    rows here = read_rows(&mesh, options), there = read_rows(&moved, options);
    assert_int_equal(here.count, there.count);
    for (size_t i = 0; i < here.count; i++)
      for (int k = 0; k < 3; k++) assert_float_equal(row_of(&here, i)[3 + k], row_of(&there, i)[3 + k], 1e-5);
    free_rows(&here);
    free_rows(&there);
  }
}
