/* The last levels of Loop's scheme, read from the connectivity above: to the last bit what the generic step
 * builds. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cage.h"
#include "loop_rows.h"
#include "test.h"
#include "torus_cage.h"

enum { NEVER = 100 }; /* of levels */

/* The same rows in blocks of many sizes. */
static void check_points(const tw_loop_rows *rows, const double *kept, const double *expected,
                         uint32_t count) {
  float *rounded = calloc(count, 3 * sizeof *rounded);
  assert_non_null(rounded);
  for (size_t i = 0; i < 3 * (size_t)count; i++) rounded[i] = (float)expected[i];
  for (uint32_t block = count; block > 0; block /= 3) {
    float *points = calloc(count, 3 * sizeof *points);
    assert_non_null(points);
    for (uint32_t first = 0; first < count; first += block)
      tw_loop_rows_points(rows, kept, first, block < count - first ? block : count - first,
                          points + 3 * (size_t)first);
    assert_memory_equal(points, rounded, (size_t)count * 3 * sizeof *points);
    free(points);
  }
  free(rounded);
}

static void check_triangles(const tw_loop_rows *rows, const uint32_t *expected, uint32_t count) {
  for (uint32_t block = count; block > 0; block /= 5) {
    uint32_t *triangles = calloc(count, 3 * sizeof *triangles);
    assert_non_null(triangles);
    for (uint32_t first = 0; first < count; first += block)
      tw_loop_rows_triangles(rows, first, block < count - first ? block : count - first,
                             triangles + 3 * (size_t)first);
    assert_memory_equal(triangles, expected, (size_t)count * 3 * sizeof *triangles);
    free(triangles);
  }
}

static void check_normals(const tw_loop_rows *plain, const double *points, const tw_topology *t,
                          const double *values) {
  enum { STRIDE = 5 };
  tw_loop_rows s = *plain;
  tw_limit_entry mask[64];
  s.normals = true;
  uint32_t count = t->vertex_count, half = count / 2;
  assert_int_equal(tw_loop_rows_kept_count(&s), count);
  double *kept = calloc(count, 3 * sizeof *kept);
  float *rows = calloc(count, STRIDE * sizeof *rows);
  assert_true(kept && rows);
  assert_int_equal(tw_loop_rows_keep(&s, points, NULL, kept), TW_OK);
  assert_memory_equal(kept, values, (size_t)count * 3 * sizeof *kept);
  check_points(&s, kept, values, count);
  tw_loop_rows_normals(&s, kept, 0, half, mask, rows, STRIDE);
  tw_loop_rows_normals(&s, kept, half, count - half, mask, rows + STRIDE * (size_t)half, STRIDE);
  for (uint32_t v = 0; v < count; v++) {
    double expected[3];
    mask_normal(t, values, v, expected);
    for (int i = 0; i < 3; i++) assert_float_equal(rows[STRIDE * (size_t)v + (size_t)i], expected[i], 1e-5);
    assert_true(rows[STRIDE * (size_t)v + 3] == 0 && rows[STRIDE * (size_t)v + 4] == 0);
  }
  free(kept);
  free(rows);
}

/* A mesh, its points and its child. */
typedef struct stage {
  tw_topology topology;
  double *values;
} stage;

static void check_against(const stage *above, uint32_t levels, const tw_rules *rules, const stage *at,
                          bool normals) {
  tw_loop_rows rows = {.above = above->topology, .rules = *rules, .levels = levels};
  tw_topology counts = tw_loop_rows_counts(&rows);
  assert_int_equal(counts.vertex_count, at->topology.vertex_count);
  assert_int_equal(counts.edge_count, at->topology.edge_count);
  assert_int_equal(counts.face_count, at->topology.face_count);
  assert_int_equal(counts.corner_count, at->topology.corner_count);
  double *kept = calloc(tw_loop_rows_kept_count(&rows), 3 * sizeof *kept);
  assert_non_null(kept);
  assert_int_equal(tw_loop_rows_keep(&rows, above->values, NULL, kept), TW_OK);
  check_points(&rows, kept, at->values, counts.vertex_count);
  check_triangles(&rows, at->topology.corner_vertex, counts.face_count);
  if (normals) check_normals(&rows, above->values, &at->topology, at->values);
  free(kept);
}

/* Levels 1 to 4, each from the one above and, where that may be, from two above. least_two: the first level
 * that is; least_normals: the first whose normals are. */
static void check(cage *c, tw_surface_options options, uint32_t least_two, uint32_t least_normals) {
  enum { LEVELS = 4 };
  assert_int_equal(tw_mesh_check(&c->mesh, NULL, NULL), TW_OK);
  tw_arena *arena = tw_arena_create();
  tw_rules rules = {.chaikin = options.creasing == TW_CREASE_CHAIKIN};
  tw_cage read;
  options.scheme = TW_LOOP;
  options.level = LEVELS;
  assert_int_equal(tw_cage_read(&c->mesh, &options, arena, &read), TW_OK);
  stage stages[LEVELS + 1] = {{read.topology, NULL}};
  uint32_t count = read.topology.vertex_count;
  stages[0].values = tw_arena_alloc(arena, count, 3 * sizeof(double));
  for (uint32_t v = 0; v < count; v++)
    for (uint32_t i = 0; i < 3; i++)
      stages[0].values[3 * (size_t)v + i] = (double)c->points[read.point_of ? read.point_of[v] : v][i];
  for (uint32_t level = 1; level <= LEVELS; level++) {
    const stage *above = &stages[level - 1];
    stage *at = &stages[level];
    assert_int_equal(tw_loop_topology(&above->topology, &rules, arena, NULL, &at->topology), TW_OK);
    at->values = tw_arena_alloc(arena, at->topology.vertex_count, 3 * sizeof(double));
    tw_loop_values(&above->topology, &rules, 3, above->values, NULL, at->values);
    bool normals = tw_loop_rows_fit_normals(&read.topology, &rules, level);
    assert_int_equal(normals, level >= least_normals);
    check_against(above, 1, &rules, at, normals);
    assert_int_equal(tw_loop_rows_fit(&read.topology, &rules, level), level < least_two ? 1 : 2);
    if (level >= least_two) check_against(&stages[level - 2], 2, &rules, at, normals);
  }
  tw_arena_destroy(arena);
  free(c);
}

TEST(closed_meshes_are_as_the_generic_step_makes_them) {
  check(torus(TORUS_TURNED_TRIANGLES, NO_GAPS, false), (tw_surface_options){0}, 2, 1);
}

TEST(borders_corners_and_fins_are_too) {
  check(torus(TORUS_TURNED_TRIANGLES, GAPS, false), (tw_surface_options){0}, 2, 1);
  check(torus(TORUS_TURNED_TRIANGLES, GAPS, false), (tw_surface_options){.boundary = TW_BOUNDARY_EDGE_ONLY},
        2, 1);
  check(torus(TORUS_TURNED_TRIANGLES, GAPS_THAT_TOUCH, false), (tw_surface_options){0}, 2, NEVER);
  check(torus(TORUS_TURNED_TRIANGLES, GAPS, true), (tw_surface_options){.boundary = TW_BOUNDARY_EDGE_ONLY}, 2,
        NEVER);
  check(torus(TORUS_TURNED_TRIANGLES, NO_GAPS, true), (tw_surface_options){0}, 2, NEVER);
}

TEST(infinite_creases_and_corners_are_too) {
  static const uint32_t sharp_points[] = {7, 20};
  static const float point_sharpness[] = {TW_SHARPNESS_INFINITE, TW_SHARPNESS_INFINITE};
  for (int creased = 0; creased < 2; creased++) {
    cage *c = torus(TORUS_TURNED_TRIANGLES, NO_GAPS, false);
    if (creased) crease_some(c, TW_SHARPNESS_INFINITE);
    c->mesh.sharp_point_count = 2;
    c->mesh.sharp_points = sharp_points;
    c->mesh.point_sharpness = point_sharpness;
    check(c, (tw_surface_options){0}, 2, creased ? NEVER : 1);
  }
}

/* Two levels at once, and normals, begin where all decay is over. */
TEST(what_decays_is_too) {
  static const uint32_t sharp_points[] = {7};
  static const float point_sharpness[] = {1.75f};
  cage *c = torus(TORUS_TURNED_TRIANGLES, GAPS, false);
  crease_some(c, 0.5f);
  check(c, (tw_surface_options){0}, 3, 3);
  c = torus(TORUS_TURNED_TRIANGLES, NO_GAPS, false);
  crease_some(c, 2);
  check(c, (tw_surface_options){0}, 4, 4);
  c = torus(TORUS_TURNED_TRIANGLES, NO_GAPS, false);
  c->mesh.sharp_point_count = 1;
  c->mesh.sharp_points = sharp_points;
  c->mesh.point_sharpness = point_sharpness;
  check(c, (tw_surface_options){0}, 4, 4);
  c = torus(TORUS_TURNED_TRIANGLES, NO_GAPS, false);
  crease_some(c, 1.5f);
  check(c, (tw_surface_options){.creasing = TW_CREASE_CHAIKIN}, NEVER, NEVER);
}
