/* Shallow surfaces: levels 1 and 2 read from the cage are, to the last bit, those that the generic step
 * builds. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "cage.h"
#include "shallow.h"
#include "torus_cage.h"

/* The same rows in blocks of many sizes. */
static void check_points(const tw_shallow *s, const float *kept, const float *expected, uint32_t count) {
  for (uint32_t block = count; block > 0; block /= 3) {
    float *rows = calloc(count, 3 * sizeof *rows);
    assert_non_null(rows);
    for (uint32_t first = 0; first < count; first += block)
      tw_shallow_points(s, kept, first, block < count - first ? block : count - first,
                        rows + 3 * (size_t)first);
    assert_memory_equal(rows, expected, (size_t)count * 3 * sizeof *rows);
    free(rows);
  }
}

static void check_quads(const tw_shallow *s, const uint32_t *expected, uint32_t count) {
  for (uint32_t block = count; block > 0; block /= 5) {
    uint32_t *quads = calloc(count, 4 * sizeof *quads);
    assert_non_null(quads);
    for (uint32_t first = 0; first < count; first += block)
      tw_shallow_quads(s, first, block < count - first ? block : count - first, quads + 4 * (size_t)first);
    assert_memory_equal(quads, expected, (size_t)count * 4 * sizeof *quads);
    free(quads);
  }
}

/* Rows that others end in the middle of are the same, and nothing is written behind them. */
static void check_range(const tw_shallow *s, uint32_t set, const float *kept, const float *rows,
                        uint32_t first, uint32_t count, float *out) {
  const float mark = -7;
  if (first + count < tw_shallow_counts(s).vertex_count) out[6 * (size_t)count] = mark;
  assert_true(tw_shallow_normals_by(set, s, kept, first, count, out));
  assert_memory_equal(out, rows + 6 * (size_t)first, 6 * (size_t)count * sizeof *rows);
  if (first + count < tw_shallow_counts(s).vertex_count) assert_true(out[6 * (size_t)count] == mark);
}

static void check_normals(const tw_shallow *plain, const float *cage_values, const tw_topology *child,
                          const float *values) {
  tw_shallow s = *plain;
  s.normals = true;
  uint32_t count = child->vertex_count;
  bool remade = s.level == 2 && s.cage.face_size == 3 && s.cage.face_count >= 16;
  assert_int_equal(tw_shallow_is_remade(&s), remade);
  assert_int_equal(tw_shallow_kept_count(&s),
                   remade ? tw_shallow_kept_count(plain) + s.cage.vertex_count : count);
  float *kept = calloc(tw_shallow_kept_size(&s), sizeof *kept), *rows = calloc(count, 6 * sizeof *rows),
        *blocks = calloc(count, 6 * sizeof *blocks);
  double *exact = calloc(count, 3 * sizeof *exact);
  assert_true(kept && rows && blocks && exact);
  for (size_t i = 0; i < 3 * (size_t)count; i++) exact[i] = (double)values[i];
  assert_int_equal(tw_shallow_keep(&s, cage_values, NULL, NULL, kept), TW_OK);
  check_points(&s, kept, values, count);
  tw_shallow_normals(&s, kept, 0, count, rows);
  for (uint32_t v = 0; v < count; v++) {
    double expected[3];
    mask_normal(child, exact, v, expected);
    assert_memory_equal(rows + 6 * (size_t)v, values + 3 * (size_t)v, 3 * sizeof *rows);
    for (int i = 0; i < 3; i++)
      assert_true(fabs((double)rows[6 * (size_t)v + 3 + (size_t)i] - expected[i]) < 1e-4);
  }
  for (uint32_t block = count; block > 0; block /= 3) {
    memset(blocks, 0, count * 6 * sizeof *blocks);
    for (uint32_t first = 0; first < count; first += block)
      tw_shallow_normals(&s, kept, first, block < count - first ? block : count - first,
                         blocks + 6 * (size_t)first);
    assert_memory_equal(blocks, rows, count * 6 * sizeof *rows);
  }
  for (uint32_t set = 0; tw_shallow_normals_by(set, &s, kept, 0, count, blocks); set++)
    for (uint32_t first = 0; first < count; first++) {
      check_range(&s, set, kept, rows, first, count - first, blocks);
      check_range(&s, set, kept, rows, first / 2, (count - first / 2) / 2, blocks);
      check_range(&s, set, kept, rows, 0, first, blocks);
    }
  free(kept);
  free(rows);
  free(blocks);
  free(exact);
}

static void check(cage *c, tw_surface_options options) {
  assert_int_equal(tw_mesh_check(&c->mesh, NULL, NULL), TW_OK);
  tw_arena *arena = tw_arena_create();
  tw_rules rules = {options.scheme == TW_BILINEAR, false, options.triangles == TW_TRIANGLES_SMOOTH};
  tw_cage read;
  options.level = 2;
  assert_int_equal(tw_cage_read(&c->mesh, &options, arena, &read), TW_OK);
  tw_topology at = read.topology;
  float *values = tw_arena_alloc(arena, at.vertex_count, 3 * sizeof *values), *cage_values = values;
  for (uint32_t v = 0; v < at.vertex_count; v++)
    memcpy(values + 3 * (size_t)v, c->points[read.point_of ? read.point_of[v] : v], sizeof c->points[0]);
  for (uint32_t level = 1; level <= 2; level++) {
    tw_topology child;
    assert_int_equal(tw_refine_topology(&at, &rules, arena, NULL, &child), TW_OK);
    float *next = tw_arena_alloc(arena, child.vertex_count, 3 * sizeof *next);
    tw_refine_values(&at, &rules, 3, values, NULL, next);
    assert_true(tw_shallow_fits(&read.topology, 0, &rules, level));
    tw_shallow s = {read.topology, rules, level, false};
    tw_topology counts = tw_shallow_counts(&s);
    assert_int_equal(counts.vertex_count, child.vertex_count);
    assert_int_equal(counts.edge_count, child.edge_count);
    assert_int_equal(counts.face_count, child.face_count);
    assert_int_equal(counts.corner_count, child.corner_count);
    float *kept = tw_arena_alloc(arena, tw_shallow_kept_size(&s), sizeof *kept);
    assert_int_equal(tw_shallow_keep(&s, cage_values, NULL, NULL, kept), TW_OK);
    check_points(&s, kept, next, child.vertex_count);
    check_quads(&s, child.corner_vertex, child.face_count);
    if (tw_shallow_fits_normals(&read.topology, &rules)) check_normals(&s, cage_values, &child, next);
    at = child;
    values = next;
  }
  tw_arena_destroy(arena);
  free(c);
}

static void closed_meshes_are_as_the_generic_step_makes_them(void **state) {
  (void)state;
  check(torus(TORUS_TRIANGLES, NO_GAPS, false), (tw_surface_options){0});
  check(torus(TORUS_MIXED, NO_GAPS, false), (tw_surface_options){0});
  check(torus(TORUS_QUADS, NO_GAPS, false), (tw_surface_options){0});
}

/* Two pyramids of so many sides: of fewer faces and edges than vectors have lanes, of as many, of a few more.
 */
static void small_meshes_are_too(void **state) {
  (void)state;
  for (uint32_t sides = 3; sides <= 16; sides++) {
    cage *c = new_cage();
    add_scattered_points(c, sides + 2);
    for (uint32_t i = 0; i < sides; i++) {
      uint32_t next = (i + 1) % sides;
      add_face(c, (uint32_t[]){sides, i, next}, 3);
      add_face(c, (uint32_t[]){sides + 1, next, i}, 3);
    }
    check(c, (tw_surface_options){0});
  }
}

/* Of lengths that float cannot square, normals take a closer look. */
static void tiny_meshes_are_too(void **state) {
  (void)state;
  for (int mixed = 0; mixed < 2; mixed++) {
    cage *c = torus(mixed ? TORUS_MIXED : TORUS_TRIANGLES, NO_GAPS, false);
    for (uint32_t p = 0; p < c->mesh.point_count; p++)
      for (uint32_t i = 0; i < 3; i++) c->points[p][i] *= 1e-14f;
    check(c, (tw_surface_options){0});
  }
}

static void borders_corners_and_fins_are_too(void **state) {
  (void)state;
  check(torus(TORUS_TRIANGLES, GAPS_THAT_TOUCH, false), (tw_surface_options){0});
  check(torus(TORUS_MIXED, GAPS_THAT_TOUCH, true), (tw_surface_options){0});
  check(torus(TORUS_MIXED, GAPS_THAT_TOUCH, true), (tw_surface_options){.boundary = TW_BOUNDARY_EDGE_ONLY});
  check(torus(TORUS_TRIANGLES, NO_GAPS, true), (tw_surface_options){0});
}

static void infinite_creases_and_corners_are_too(void **state) {
  (void)state;
  static const uint32_t sharp_points[] = {7, 20};
  static const float point_sharpness[] = {TW_SHARPNESS_INFINITE, TW_SHARPNESS_INFINITE};
  for (int mixed = 0; mixed < 2; mixed++) {
    cage *c = torus(mixed ? TORUS_MIXED : TORUS_TRIANGLES, NO_GAPS, false);
    crease_some(c, TW_SHARPNESS_INFINITE);
    c->mesh.sharp_point_count = 2;
    c->mesh.sharp_points = sharp_points;
    c->mesh.point_sharpness = point_sharpness;
    check(c, (tw_surface_options){0});
  }
}

static void bilinear_and_smooth_triangles_are_too(void **state) {
  (void)state;
  check(torus(TORUS_MIXED, GAPS_THAT_TOUCH, true), (tw_surface_options){.scheme = TW_BILINEAR});
  check(torus(TORUS_TRIANGLES, NO_GAPS, false), (tw_surface_options){.triangles = TW_TRIANGLES_SMOOTH});
  check(torus(TORUS_MIXED, NO_GAPS, false), (tw_surface_options){.triangles = TW_TRIANGLES_SMOOTH});
}

static void what_decays_fits_for_one_level_alone(void **state) {
  (void)state;
  cage *c = torus(TORUS_MIXED, NO_GAPS, false);
  crease_some(c, 2.5f);
  tw_arena *arena = tw_arena_create();
  tw_cage read;
  assert_int_equal(tw_cage_read(&c->mesh, &(tw_surface_options){.level = 2}, arena, &read), TW_OK);
  assert_true(tw_shallow_fits(&read.topology, 0, &(tw_rules){0}, 1));
  for (uint32_t steps = 0; steps < 4; steps++)
    assert_int_equal(tw_shallow_fits(&read.topology, steps, &(tw_rules){0}, 2), steps >= 3);
  assert_false(tw_shallow_fits(&read.topology, 0, &(tw_rules){0}, 0));
  tw_arena_destroy(arena);
  free(c);
}

static void normals_fit_where_nothing_is_sharp_and_three_faces_meet(void **state) {
  (void)state;
  tw_arena *arena = tw_arena_create();
  tw_cage read;
  const tw_rules smooth = {0}, linear = {.linear = true};
  static const uint32_t back_to_back[] = {0, 1, 2, 2, 1, 0};
  for (uint32_t kind = 0; kind < 4; kind++) {
    cage *c = torus(TORUS_TRIANGLES, kind == 1 ? GAPS_THAT_TOUCH : NO_GAPS, false);
    if (kind == 2) crease_some(c, 1);
    if (kind == 3) {
      memcpy(c->corners, back_to_back, sizeof back_to_back);
      c->mesh.face_count = 2;
      c->mesh.corner_count = 6;
    }
    assert_int_equal(tw_cage_read(&c->mesh, &(tw_surface_options){.level = 2}, arena, &read), TW_OK);
    assert_int_equal(tw_shallow_fits_normals(&read.topology, &smooth), kind == 0);
    assert_false(tw_shallow_fits_normals(&read.topology, &linear));
    free(c);
  }
  tw_arena_destroy(arena);
}

/* Rows of points and normals of a shallow level. */
typedef struct shallow_rows {
  tw_arena *arena;
  tw_shallow shallow;
  uint32_t count;
  float *kept, *values;
} shallow_rows;

static shallow_rows read_normals(const cage *c, const float *positions, uint32_t level) {
  shallow_rows r = {.arena = tw_arena_create()};
  tw_cage read;
  assert_int_equal(tw_cage_read(&c->mesh, &(tw_surface_options){.level = level}, r.arena, &read), TW_OK);
  r.shallow = (tw_shallow){read.topology, (tw_rules){0}, level, true};
  r.count = tw_shallow_counts(&r.shallow).vertex_count;
  r.kept = tw_arena_alloc(r.arena, tw_shallow_kept_size(&r.shallow), sizeof *r.kept);
  r.values = tw_arena_alloc(r.arena, r.count, 6 * sizeof *r.values);
  assert_true(r.kept && r.values);
  assert_int_equal(tw_shallow_keep(&r.shallow, positions, NULL, NULL, r.kept), TW_OK);
  tw_shallow_normals(&r.shallow, r.kept, 0, r.count, r.values);
  return r;
}

static void a_mesh_that_is_one_point_has_normals_up(void **state) {
  (void)state;
  static const float zeros[POINTS_MAX][3];
  for (uint32_t level = 1; level <= 2; level++) {
    cage *c = torus(TORUS_MIXED, NO_GAPS, false);
    shallow_rows r = read_normals(c, zeros[0], level);
    for (uint32_t v = 0; v < r.count; v++)
      assert_memory_equal(r.values + 6 * (size_t)v, ((float[]){0, 0, 0, 0, 1, 0}), 24);
    tw_arena_destroy(r.arena);
    free(c);
  }
}

/* Two opposite neighbours in one place leave a vertex between four triangles one tangent alone. All numbers
 * are multiples of 3, so that nothing is rounded before the tangents. */
static void neighbours_in_one_place_leave_the_normal_of_a_face(void **state) {
  (void)state;
  static const float points[6][3] = {{0, 0, 48},   {48, 0, 0}, {0, 48, 0},
                                     {-48, 0, 24}, {0, 48, 0}, {0, 0, -48}};
  cage *c = new_cage();
  for (uint32_t i = 0; i < 6; i++) add_point(c, points[i][0], points[i][1], points[i][2]);
  for (uint32_t i = 0; i < 4; i++) {
    uint32_t next = (i + 1) % 4;
    add_face(c, (uint32_t[]){0, 1 + i, 1 + next}, 3);
    add_face(c, (uint32_t[]){5, 1 + next, 1 + i}, 3);
  }
  shallow_rows r = read_normals(c, points[0], 1);
  const float *rows = r.values;
  uint32_t quads[4 * 24], ones = 0;
  tw_shallow_quads(&r.shallow, 0, 24, quads);
  for (uint32_t q = 0; q < 24; q++) {
    const uint32_t *v = quads + 4 * (size_t)q;
    if (v[0] != 0) continue;
    double along1 = 0, along2 = 0; /* of its diagonals */
    for (uint32_t i = 0; i < 3; i++) {
      along1 += (double)rows[3 + i] * ((double)rows[6 * v[2] + i] - (double)rows[6 * v[0] + i]);
      along2 += (double)rows[3 + i] * ((double)rows[6 * v[3] + i] - (double)rows[6 * v[1] + i]);
    }
    ones += fabs(along1) < 1e-4 && fabs(along2) < 1e-4;
  }
  assert_true(ones > 0);
  tw_arena_destroy(r.arena);
  free(c);
}

/* A torus pressed flat, a part of it to a point: zeros of its normals come from either side. */
static void flat_meshes_have_the_same_zeros_however_they_are_read(void **state) {
  (void)state;
  for (uint32_t level = 1; level <= 2; level++) {
    cage *c = torus(TORUS_TRIANGLES, NO_GAPS, false);
    for (uint32_t p = 0; p < c->mesh.point_count; p++) c->points[p][2] = 0;
    for (uint32_t p = 1; p < 3 * TORUS_SIDE; p++) memcpy(c->points[p], c->points[0], sizeof c->points[0]);
    shallow_rows r = read_normals(c, c->points[0], level);
    for (uint32_t v = 0; v < r.count; v++) {
      float alone[6];
      tw_shallow_normals(&r.shallow, r.kept, v, 1, alone);
      assert_memory_equal(alone, r.values + 6 * (size_t)v, sizeof alone);
    }
    tw_arena_destroy(r.arena);
    free(c);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(closed_meshes_are_as_the_generic_step_makes_them),
      cmocka_unit_test(small_meshes_are_too),
      cmocka_unit_test(tiny_meshes_are_too),
      cmocka_unit_test(borders_corners_and_fins_are_too),
      cmocka_unit_test(infinite_creases_and_corners_are_too),
      cmocka_unit_test(bilinear_and_smooth_triangles_are_too),
      cmocka_unit_test(what_decays_fits_for_one_level_alone),
      cmocka_unit_test(normals_fit_where_nothing_is_sharp_and_three_faces_meet),
      cmocka_unit_test(a_mesh_that_is_one_point_has_normals_up),
      cmocka_unit_test(flat_meshes_have_the_same_zeros_however_they_are_read),
      cmocka_unit_test(neighbours_in_one_place_leave_the_normal_of_a_face),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
