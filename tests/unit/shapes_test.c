/* Shapes: their closed-form counts, closed and outward, in order, without doubled points. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"
#include "tweend/shape.h"

/* A shape under test; sizes that are all different. */
static tw_shape shape_of(tw_shape_kind kind, uint32_t a, uint32_t b, uint32_t c) {
  tw_shape shape;
  tw_shape_init(&shape, kind);
  shape.size[0] = 2;
  shape.size[1] = 1;
  shape.size[2] = 4;
  shape.radii[0] = 1.5f;
  shape.radii[1] = 0.5f;
  shape.height = 3;
  shape.segments[0] = a;
  shape.segments[1] = shape.rings = shape.sides = b;
  shape.segments[2] = c;
  return shape;
}

typedef struct made {
  tw_arena *arena;
  tw_mesh mesh;
} made;

static made make(const tw_shape *shape) {
  made out = {.arena = tw_arena_create()};
  tw_error error;
  if (tw_shape_make(shape, out.arena, &out.mesh, &error) != TW_OK)
    fail_msg("%s: %s", error.pointer, error.detail);
  assert_int_equal(tw_mesh_check(&out.mesh, &error, NULL), TW_OK);
  return out;
}

static const float *point_at(const tw_mesh *mesh, uint32_t corner) {
  return mesh->positions + 3 * (size_t)mesh->corners[corner];
}

/* Of the tetrahedra from the origin to each face. */
static double volume(const tw_mesh *mesh) {
  double sum = 0;
  for (uint32_t f = 0; f < mesh->face_count; f++)
    for (uint32_t c = mesh->face_offsets[f] + 1; c + 1 < mesh->face_offsets[f + 1]; c++) {
      const float *p = point_at(mesh, mesh->face_offsets[f]), *q = point_at(mesh, c),
                  *r = point_at(mesh, c + 1);
      sum += (double)p[0] * (q[1] * r[2] - q[2] * r[1]) + (double)p[1] * (q[2] * r[0] - q[0] * r[2]) +
             (double)p[2] * (q[0] * r[1] - q[1] * r[0]);
    }
  return sum / 6;
}

/* Of a face's UVs, seen from its front. */
static double uv_area(const tw_mesh *mesh, uint32_t face) {
  const tw_uv_set *set = &mesh->uv_sets[0];
  uint32_t begin = mesh->face_offsets[face], end = mesh->face_offsets[face + 1];
  double sum = 0;
  for (uint32_t c = begin; c < end; c++) {
    const float *p = set->values + 2 * (size_t)set->corners[c],
                *q = set->values + 2 * (size_t)set->corners[c + 1 < end ? c + 1 : begin];
    sum += (double)p[0] * q[1] - (double)p[1] * q[0];
  }
  return sum / 2;
}

/* By y, then z, then x, where the last bits of a float make no difference. */
static bool is_before(const float *p, const float *q) {
  static const int axes[3] = {1, 2, 0};
  for (int i = 0; i < 3; i++)
    if (fabsf(p[axes[i]] - q[axes[i]]) > 3e-7f) return p[axes[i]] < q[axes[i]];
  return false;
}

/* What every shape must be; the numbers, and how many pieces of border. */
static void assert_shape(const tw_shape *shape, uint64_t points, uint64_t faces, int64_t euler,
                         uint32_t borders) {
  tw_shape_counts counts;
  assert_int_equal(tw_shape_count(shape, &counts, NULL), TW_OK);
  assert_int_equal(counts.points, points);
  assert_int_equal(counts.faces, faces);
  made m = make(shape);
  tw_mesh_stats stats;
  assert_int_equal(tw_mesh_describe(&m.mesh, &stats, NULL), TW_OK);
  assert_int_equal(stats.vertices, points);
  assert_int_equal(stats.unused_points, 0);
  assert_int_equal(stats.faces, faces);
  assert_int_equal(stats.euler_characteristic, euler);
  assert_int_equal(stats.boundary_loops, borders);
  assert_int_equal(stats.components, 1);
  assert_int_equal(stats.nonmanifold_edges, 0);
  assert_int_equal(stats.nonmanifold_vertices, 0);
  assert_int_equal(stats.reversed_edges, 0);
  if (shape->kind != TW_SHAPE_GRID) assert_true(volume(&m.mesh) > 0);
  for (uint32_t i = 1; i < m.mesh.point_count; i++) {
    const float *p = m.mesh.positions + 3 * (size_t)i, *q = p - 3;
    assert_true(is_before(q, p));
  }
  for (size_t i = 0; i < 3 * (size_t)m.mesh.point_count; i++)
    assert_false(m.mesh.positions[i] == 0 && signbit(m.mesh.positions[i]));
  for (uint32_t f = 0; f < m.mesh.face_count; f++) assert_true(uv_area(&m.mesh, f) > 0);
  tw_mesh_stats_deinit(&stats);
  tw_arena_destroy(m.arena);
}

/* ---- parameters ------------------------------------------------------------------------------ */

typedef struct bad_shape {
  tw_shape_kind kind;
  const char *pointer;
  size_t offset; /* of the member */
  float length;
  uint32_t parts;
} bad_shape;

TEST(a_parameter_that_makes_no_shape_is_refused_at_its_place) {
  static const bad_shape all[] = {
      {TW_SHAPE_GRID, "/size/1", offsetof(tw_shape, size[2]), 0, 0},
      {TW_SHAPE_GRID, "/segments/1", offsetof(tw_shape, segments[2]), 0, 0},
      {TW_SHAPE_BOX, "/size/0", offsetof(tw_shape, size[0]), -1, 0},
      {TW_SHAPE_BOX, "/size/2", offsetof(tw_shape, size[2]), NAN, 0},
      {TW_SHAPE_BOX, "/size/2", offsetof(tw_shape, size[2]), INFINITY, 0},
      {TW_SHAPE_BOX, "/segments/1", offsetof(tw_shape, segments[1]), 0, 0},
      {TW_SHAPE_QUAD_SPHERE, "/segments", offsetof(tw_shape, segments[0]), 0, 0},
      {TW_SHAPE_QUAD_SPHERE, "/radius", offsetof(tw_shape, radii[0]), 0, 0},
      {TW_SHAPE_ELLIPSOID, "/radii/2", offsetof(tw_shape, radii[2]), 0, 0},
      {TW_SHAPE_UV_SPHERE, "/segments", offsetof(tw_shape, segments[0]), 0, 2},
      {TW_SHAPE_UV_SPHERE, "/rings", offsetof(tw_shape, rings), 0, 1},
      {TW_SHAPE_CYLINDER, "/height", offsetof(tw_shape, height), 2e18f, 0},
      {TW_SHAPE_CYLINDER, "/rings", offsetof(tw_shape, rings), 0, 0},
      {TW_SHAPE_CONE, "/segments", offsetof(tw_shape, segments[0]), 0, 2},
      {TW_SHAPE_TORUS, "/sides", offsetof(tw_shape, sides), 0, 2},
      {TW_SHAPE_TORUS, "/tube", offsetof(tw_shape, tube), 0, 0},
      {TW_SHAPE_TORUS, "/tube", offsetof(tw_shape, tube), 1, 0},
  };
  for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
    tw_shape shape;
    tw_shape_init(&shape, all[i].kind);
    bool is_length = all[i].offset < offsetof(tw_shape, segments);
    memcpy((char *)&shape + all[i].offset, is_length ? (const void *)&all[i].length : &all[i].parts, 4);
    tw_shape_counts counts = {.points = 7};
    tw_error error;
    assert_int_equal(tw_shape_count(&shape, &counts, &error), TW_INVALID);
    assert_string_equal(error.pointer, all[i].pointer);
    assert_int_equal(counts.points, 7);
  }
}

TEST(a_shape_over_32_bits_is_counted_and_not_made) {
  for (int kind = 0; kind < TW_SHAPES; kind++) {
    tw_shape shape;
    tw_shape_init(&shape, (tw_shape_kind)kind);
    shape.segments[0] = shape.segments[1] = shape.segments[2] = shape.rings = shape.sides = UINT32_MAX;
    shape.level = UINT32_MAX;
    tw_shape_counts counts;
    tw_error error;
    assert_int_equal(tw_shape_count(&shape, &counts, &error), TW_OK);
    assert_true(counts.faces >= UINT64_C(1) << 61 && counts.faces <= UINT64_C(1) << 62);
    tw_arena *arena = tw_arena_create();
    tw_mesh mesh;
    assert_int_equal(tw_shape_make(&shape, arena, &mesh, &error), TW_LIMIT);
    tw_arena_destroy(arena);
  }
}

/* ---- closed forms ---------------------------------------------------------------------------- */

static const uint32_t parts[][3] = {{1, 1, 1}, {2, 1, 3}, {3, 4, 5}, {7, 2, 1}, {1, 9, 2}};
enum { PARTS = sizeof parts / sizeof *parts };

TEST(grids_and_boxes_have_their_counts) {
  for (size_t i = 0; i < PARTS; i++) {
    uint32_t a = parts[i][0], b = parts[i][1], c = parts[i][2], quads = 2 * (a * b + b * c + c * a);
    tw_shape grid = shape_of(TW_SHAPE_GRID, a, 0, c), box = shape_of(TW_SHAPE_BOX, a, b, c);
    assert_shape(&grid, (a + 1) * (c + 1), a * c, 1, 1);
    assert_shape(&box, quads + 2, quads, 2, 0);
    made m = make(&box);
    assert_true(fabs(volume(&m.mesh) - 8) < 1e-6);
    tw_arena_destroy(m.arena);
  }
}

TEST(boxes_made_round_have_their_counts) {
  for (uint32_t n = 1; n < 8; n++) {
    tw_shape sphere = shape_of(TW_SHAPE_QUAD_SPHERE, n, 99, 99),
             ellipsoid = shape_of(TW_SHAPE_ELLIPSOID, n, 0, 0);
    assert_shape(&sphere, 6 * n * n + 2, 6 * n * n, 2, 0);
    assert_shape(&ellipsoid, 6 * n * n + 2, 6 * n * n, 2, 0);
  }
}

TEST(uv_spheres_and_icospheres_have_their_counts) {
  for (uint32_t s = 3; s < 20; s++)
    for (uint32_t r = 2; r < 9; r++) {
      tw_shape sphere = shape_of(TW_SHAPE_UV_SPHERE, s, r, 0);
      assert_shape(&sphere, s * (r - 1) + 2, s * r, 2, 0);
    }
  for (uint32_t level = 0; level < 6; level++) {
    tw_shape sphere = shape_of(TW_SHAPE_ICOSPHERE, 0, 0, 0);
    sphere.level = level;
    assert_shape(&sphere, (10u << 2 * level) + 2, 20u << 2 * level, 2, 0);
  }
}

TEST(cylinders_cones_and_tori_have_their_counts) {
  for (uint32_t s = 3; s < 20; s++)
    for (uint32_t r = 1; r < 5; r++) {
      tw_shape cylinder = shape_of(TW_SHAPE_CYLINDER, s, r, 0), cone = shape_of(TW_SHAPE_CONE, s, r, 0),
               torus = shape_of(TW_SHAPE_TORUS, s, r + 2, 0);
      assert_shape(&cylinder, s * (r + 1), s * r + 2, 2, 0);
      assert_shape(&cone, s * r + 1, s * r + 1, 2, 0);
      assert_shape(&torus, s * (r + 2), s * (r + 2), 0, 0);
      cylinder.caps = cone.caps = TW_CAPS_FAN;
      assert_shape(&cylinder, s * (r + 1) + 2, s * (r + 2), 2, 0);
      assert_shape(&cone, s * r + 2, s * (r + 1), 2, 0);
      cylinder.caps = cone.caps = TW_CAPS_NONE;
      assert_shape(&cylinder, s * (r + 1), s * r, 0, 2);
      assert_shape(&cone, s * r + 1, s * r, 1, 1);
    }
}

/* ---- places ---------------------------------------------------------------------------------- */

TEST(points_of_spheres_lie_on_them) {
  static const tw_shape_kind kinds[] = {TW_SHAPE_QUAD_SPHERE, TW_SHAPE_UV_SPHERE, TW_SHAPE_ICOSPHERE,
                                        TW_SHAPE_ELLIPSOID};
  for (size_t k = 0; k < 4; k++) {
    tw_shape shape = shape_of(kinds[k], 6, 5, 0);
    shape.level = 3;
    const float *radii = shape.radii;
    if (kinds[k] != TW_SHAPE_ELLIPSOID) shape.radii[1] = shape.radii[2] = shape.radii[0];
    made m = make(&shape);
    for (uint32_t i = 0; i < m.mesh.point_count; i++) {
      const float *p = m.mesh.positions + 3 * (size_t)i;
      assert_true(
          fabs(hypot(hypot((double)(p[0] / radii[0]), (double)(p[1] / radii[1])), (double)(p[2] / radii[2])) -
               1) < 1e-6);
    }
    tw_arena_destroy(m.arena);
  }
}

TEST(points_mirror_each_other_exactly) {
  for (int kind = TW_SHAPE_BOX; kind < TW_SHAPES; kind++) {
    if (kind == TW_SHAPE_CONE) continue;
    tw_shape shape = shape_of((tw_shape_kind)kind, 12, 6, 5);
    shape.level = 2;
    made m = make(&shape);
    /* Sorted as they are, a point and the one through the origin stand at mirrored places. */
    for (uint32_t i = 0; i < m.mesh.point_count; i++)
      for (int axis = 0; axis < 3; axis++)
        assert_true(m.mesh.positions[3 * (size_t)i + (size_t)axis] ==
                    -m.mesh.positions[3 * (size_t)(m.mesh.point_count - 1 - i) + (size_t)axis]);
    tw_arena_destroy(m.arena);
  }
}

TEST(points_0_and_1_of_a_box_are_an_edge_along_x) {
  tw_shape shape = shape_of(TW_SHAPE_BOX, 2, 1, 3);
  made m = make(&shape);
  static const float first[6] = {-1, -0.5f, -2, 0, -0.5f, -2};
  assert_memory_equal(m.mesh.positions, first, sizeof first);
  bool is_edge = false;
  for (uint32_t c = 0; c + 1 < m.mesh.corner_count; c++)
    is_edge = is_edge || (m.mesh.corners[c] == 1 && m.mesh.corners[c + 1] == 0);
  assert_true(is_edge);
  tw_arena_destroy(m.arena);
}

TEST(a_grid_faces_up) {
  tw_shape shape = shape_of(TW_SHAPE_GRID, 1, 0, 1);
  made m = make(&shape);
  static const uint32_t corners[4] = {0, 2, 3, 1};
  assert_memory_equal(m.mesh.corners, corners, sizeof corners);
  tw_arena_destroy(m.arena);
}
