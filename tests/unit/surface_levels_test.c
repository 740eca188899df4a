/* How the levels of a surface are shared out: small irregular cages go on in generic steps and rows, to the
 * last bit what generic steps alone make; where many points come of a quad, patches make them. */
#include <math.h>
#include <string.h>

#include "cage.h"
#include "cube.h"
#include "patch_cost.h"
#include "surface.h"
#include "torus_cage.h"

/* ---- generic steps -------------------------------------------------------------------------- */

typedef struct refined {
  tw_arena *arena;
  tw_topology mesh;
  float *points;
} refined;

static refined refine(const tw_mesh *mesh, const tw_surface_options *options) {
  refined r = {.arena = tw_arena_create()};
  const tw_rules rules = {options->scheme == TW_BILINEAR, options->creasing == TW_CREASE_CHAIKIN,
                          options->triangles == TW_TRIANGLES_SMOOTH};
  tw_cage read;
  assert_int_equal(tw_cage_read(mesh, options, r.arena, &read), TW_OK);
  r.mesh = read.topology;
  r.points = tw_arena_alloc(r.arena, r.mesh.vertex_count, 3 * sizeof *r.points);
  tw_gather_rows(mesh->positions, read.point_of, r.mesh.vertex_count, 3 * sizeof *r.points, r.points);
  for (uint32_t level = 0; level < options->level; level++) {
    tw_topology child;
    assert_int_equal(tw_refine_topology(&r.mesh, &rules, r.arena, NULL, &child), TW_OK);
    float *next = tw_arena_alloc(r.arena, child.vertex_count, 3 * sizeof *next);
    tw_refine_values(&r.mesh, &rules, 3, r.points, NULL, next);
    r.mesh = child;
    r.points = next;
  }
  return r;
}

/* ---- comparing ------------------------------------------------------------------------------ */

/* Does the parts of a loop last to first. */
static void run_backwards(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                          void *context) {
  (void)owner;
  while (count-- > 0) part(context, count);
}
static const tw_parallel_for backwards = {NULL, run_backwards};

static void check_rows(const tw_surface *s, const refined *expected) {
  uint32_t count = expected->mesh.vertex_count;
  float *rows = calloc(count, 3 * sizeof *rows);
  tw_surface_reader *reader = tw_surface_reader_create(s);
  assert_true(rows && reader);
  assert_int_equal(tw_surface_row_count(s, TW_DOMAIN_VERTICES), count);
  for (uint32_t block = count; block > 0; block /= 7) {
    memset(rows, 0, (size_t)count * 3 * sizeof *rows);
    for (uint32_t first = 0; first < count; first += block)
      tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, first, block < count - first ? block : count - first,
                           rows + 3 * (size_t)first);
    assert_memory_equal(rows, expected->points, (size_t)count * 3 * sizeof *rows);
  }
  tw_surface_reader_destroy(reader);
  free(rows);
}

static void check_faces(const tw_surface *s, const refined *expected) {
  uint32_t count = expected->mesh.face_count;
  uint32_t *faces = calloc(count, 4 * sizeof *faces);
  tw_surface_reader *reader = tw_surface_reader_create(s);
  assert_true(faces && reader);
  assert_int_equal(tw_surface_get_counts(s)->faces, count);
  tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, 0, count / 3, NULL, faces);
  tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, count / 3, count - count / 3, NULL,
                        faces + 4 * (size_t)(count / 3));
  assert_memory_equal(faces, expected->mesh.corner_vertex, (size_t)count * 4 * sizeof *faces);
  tw_surface_reader_destroy(reader);
  free(faces);
}

/* A plan of the mesh with its points elsewhere, moved to where they are. */
static void check_moved(const tw_mesh *mesh, tw_surface_options options, const refined *expected) {
  float elsewhere[POINTS_MAX][3] = {{0}};
  tw_mesh other = *mesh;
  tw_surface *plan, *moved;
  other.positions = elsewhere[0];
  options.movable = true;
  assert_int_equal(tw_surface_create(&other, &options, &plan, NULL), TW_OK);
  assert_int_equal(tw_surface_with_positions_by(plan, mesh->positions, &backwards, &moved), TW_OK);
  check_rows(moved, expected);
  check_faces(moved, expected);
  tw_surface_destroy(moved);
  tw_surface_destroy(plan);
}

/* Levels of rows. */
static uint32_t check(const tw_mesh *mesh, tw_surface_options options) {
  tw_surface *s;
  assert_int_equal(tw_mesh_check(mesh, NULL, NULL), TW_OK);
  assert_int_equal(tw_surface_create_by(mesh, &options, &backwards, &s, NULL), TW_OK);
  uint32_t levels = s->shallow.level;
  if (levels > 0) {
    refined expected = refine(mesh, &options);
    check_rows(s, &expected);
    check_faces(s, &expected);
    check_moved(mesh, options, &expected);
    tw_arena_destroy(expected.arena);
  }
  tw_surface_destroy(s);
  return levels;
}

/* ---- tests ---------------------------------------------------------------------------------- */

static void small_irregular_cages_are_what_generic_steps_make(void **state) {
  (void)state;
  tw_mesh mesh = cube();
  for (uint32_t level = 1; level <= 3; level++)
    assert_int_equal(check(&mesh, (tw_surface_options){.level = level}), level < 2 ? 1 : 2);
  for (int faces = TORUS_TURNED_TRIANGLES; faces <= TORUS_QUADS; faces++)
    for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++)
      for (uint32_t level = 1; level <= 3; level++) {
        bool regular = faces == TORUS_QUADS && gaps == NO_GAPS;
        cage *c = torus((torus_faces)faces, (torus_gaps)gaps, faces == TORUS_MIXED);
        assert_int_equal(check(&c->mesh, (tw_surface_options){.level = level}), level == 1             ? 1
                                                                                : regular && level > 2 ? 0
                                                                                                       : 2);
        check(&c->mesh, (tw_surface_options){.level = level, .boundary = TW_BOUNDARY_EDGE_ONLY});
        check(&c->mesh, (tw_surface_options){.level = level, .triangles = TW_TRIANGLES_SMOOTH});
        free(c);
      }
}

/* Two levels of rows once all that is semi-sharp has decayed, before that one. */
static void creases_are_what_generic_steps_make(void **state) {
  (void)state;
  static const float sharpness[] = {0.7f, 1, 1.5f, 2.5f, TW_SHARPNESS_INFINITE};
  for (size_t i = 0; i < sizeof sharpness / sizeof *sharpness; i++)
    for (int chaikin = 0; chaikin < 2; chaikin++)
      for (uint32_t level = 1; level <= 4; level++) {
        cage *c = torus(TORUS_QUADS, GAPS_THAT_TOUCH, false);
        crease_some(c, sharpness[i]);
        for (uint32_t e = 0; e < 4; e++) memcpy(c->creases[e], c->corners + 8 * e, sizeof c->creases[e]);
        c->sharpness[3] = 0.25f;
        tw_surface_options options = {.level = level,
                                      .creasing = chaikin ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM};
        bool decays = sharpness[i] < TW_SHARPNESS_INFINITE;
        float most = decays ? sharpness[i] : 0.25f;
        bool settled = level >= 2 && (float)(level - 2) >= most;
        assert_int_equal(check(&c->mesh, options), settled ? 2 : 1);
        free(c);
      }
}

static void patches_make_what_many_points_come_of(void **state) {
  (void)state;
  tw_mesh mesh = cube();
  for (uint32_t level = 5; level <= 7; level++)
    assert_int_equal(check(&mesh, (tw_surface_options){.level = level}), 0);
  cage *c = torus(TORUS_QUADS, NO_GAPS, false);
  assert_int_equal(check(&c->mesh, (tw_surface_options){.level = 2}), 2);
  assert_int_equal(check(&c->mesh, (tw_surface_options){.level = 3}), 0);
  free(c);
}

/* Patches find normals from exact differences, and limits and attributes besides. */
static void patches_make_what_rows_cannot(void **state) {
  (void)state;
  static const float colors[8][4] = {{0}};
  tw_mesh mesh = cube();
  for (uint32_t level = 1; level <= 3; level++) {
    assert_int_equal(check(&mesh, (tw_surface_options){.level = level, .normals = true}), 0);
    assert_int_equal(check(&mesh, (tw_surface_options){.level = level, .limit = true}), 0);
    tw_mesh colored = mesh;
    colored.colors = colors[0];
    assert_int_equal(check(&colored, (tw_surface_options){.level = level}), 0);
  }
}

/* Levels that patches make. */
static uint32_t patch_levels(const tw_mesh *mesh, tw_surface_options options) {
  tw_surface *s;
  assert_int_equal(tw_mesh_check(mesh, NULL, NULL), TW_OK);
  assert_int_equal(tw_surface_create(mesh, &options, &s, NULL), TW_OK);
  uint32_t levels = s->depth;
  assert_int_equal(s->exact, levels == 0 && options.normals);
  tw_surface_destroy(s);
  return levels;
}

/* Where normals and the like of few points are wanted, vertices are done one by one, as exactly. */
static void first_levels_of_small_irregular_cages_have_no_patches(void **state) {
  (void)state;
  static const float colors[8][4] = {{0}};
  tw_mesh irregular = cube(), colored = cube();
  colored.colors = colors[0];
  cage *c = torus(TORUS_QUADS, NO_GAPS, false), *gaps = torus(TORUS_QUADS, GAPS_THAT_TOUCH, false);
  static const float uvs[POINTS_MAX][2] = {{0}};
  tw_mesh mapped = gaps->mesh; /* which way round a map goes is for the cage's faces to tell */
  mapped.has_tangents = true;
  mapped.uv_set_count = 1;
  mapped.uv_sets[0] = (tw_uv_set){mapped.point_count, uvs[0], mapped.corners};
  for (uint32_t level = 1; level <= 4; level++) {
    const tw_surface_options normals = {.level = level, .normals = true},
                             limit = {.level = level, .limit = true};
    assert_int_equal(patch_levels(&irregular, normals), level > 1 ? level : 0);
    assert_int_equal(patch_levels(&irregular, limit), level > 1 ? level : 0);
    assert_int_equal(patch_levels(&colored, (tw_surface_options){.level = level}), level > 1 ? level : 0);
    assert_int_equal(patch_levels(&gaps->mesh, normals), level > 2 ? level : 0);
    assert_int_equal(patch_levels(&mapped, normals), level);
    assert_int_equal(patch_levels(&c->mesh, normals), level);
  }
  free(c);
  free(gaps);
}

static uint64_t cost_of(const tw_mesh *mesh) {
  tw_arena *arena = tw_arena_create();
  tw_cage read;
  assert_int_equal(tw_cage_read(mesh, &(tw_surface_options){.level = 1}, arena, &read), TW_OK);
  uint64_t cost = tw_patch_cost(&read.topology);
  tw_arena_destroy(arena);
  return cost;
}

static void irregular_patches_cost_more_than_regular_ones(void **state) {
  (void)state;
  cage *regular = torus(TORUS_QUADS, NO_GAPS, false), *gaps = torus(TORUS_QUADS, GAPS_THAT_TOUCH, false),
       *creased = torus(TORUS_QUADS, NO_GAPS, false), *mixed = torus(TORUS_MIXED, NO_GAPS, false);
  uint64_t least = cost_of(&regular->mesh);
  assert_true(least < 64 * regular->mesh.face_count); /* of level 3 */
  assert_true(cost_of(&gaps->mesh) > 4 * least);
  assert_true(cost_of(&mixed->mesh) > 4 * least);
  for (int infinite = 0; infinite < 2; infinite++) { /* one edge: four vertices' faces touch its ends */
    crease_some(creased, infinite ? TW_SHARPNESS_INFINITE : 1);
    creased->mesh.crease_count = 1;
    assert_true(cost_of(&creased->mesh) > 2 * least);
  }
  free(regular);
  free(gaps);
  free(creased);
  free(mixed);
}

/* A sheet's border is as regular as its middle, and so is a crease all along it. */
static void straight_borders_and_creases_cost_nothing(void **state) {
  (void)state;
  enum { SIDE = 8 };
  cage *c = new_cage();
  uint32_t creases[SIDE][2];
  float sharpness[SIDE];
  for (uint32_t p = 0; p < (SIDE + 1) * (SIDE + 1); p++)
    add_point(c, (float)(p % (SIDE + 1)), (float)(p / (SIDE + 1)), 0); /* NOLINT(bugprone-integer-division) */
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    uint32_t a = i / SIDE * (SIDE + 1) + i % SIDE, d = a + SIDE + 1;
    add_face(c, (uint32_t[]){a, a + 1, d + 1, d}, 4);
  }
  uint64_t least = cost_of(&c->mesh);
  assert_true(least < 64 * SIDE * SIDE);
  for (uint32_t i = 0; i < SIDE; i++) {
    creases[i][0] = i * (SIDE + 1) + SIDE / 2;
    creases[i][1] = creases[i][0] + SIDE + 1;
    sharpness[i] = TW_SHARPNESS_INFINITE;
  }
  c->mesh.crease_count = SIDE;
  c->mesh.crease_edges = creases[0];
  c->mesh.crease_sharpness = sharpness;
  uint64_t creased = cost_of(&c->mesh);
  sharpness[3] = 1;
  uint64_t semi = cost_of(&c->mesh);
  assert_true(creased < semi);
  free(c);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(small_irregular_cages_are_what_generic_steps_make),
      cmocka_unit_test(creases_are_what_generic_steps_make),
      cmocka_unit_test(patches_make_what_many_points_come_of),
      cmocka_unit_test(patches_make_what_rows_cannot),
      cmocka_unit_test(first_levels_of_small_irregular_cages_have_no_patches),
      cmocka_unit_test(irregular_patches_cost_more_than_regular_ones),
      cmocka_unit_test(straight_borders_and_creases_cost_nothing),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
