/* Levels 1 to 3 are read from all their points: the numbers of generic steps and, but for rounding, their
 * points, whatever the blocks and the threads. What they are not for, and where patches are quicker, patches
 * make. */
#include <math.h>
#include <string.h>

#include "cage.h"
#include "cube.h"
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

/* All rows of a domain, read in blocks. */
static float *read_blocks(const tw_surface *s, tw_domain domain, uint32_t block) {
  uint32_t count = (uint32_t)tw_surface_row_count(s, domain),
           width = domain == TW_DOMAIN_POINTS ? 3 : tw_surface_get_layout(s)->stride;
  float *rows = calloc(count, width * sizeof *rows);
  tw_surface_reader *reader = tw_surface_reader_create(s);
  assert_true(rows && reader);
  for (uint32_t first = 0; first < count; first += block)
    tw_surface_read_rows(reader, domain, first, block < count - first ? block : count - first,
                         rows + width * (size_t)first);
  tw_surface_reader_destroy(reader);
  return rows;
}

static void check_rows(const tw_surface *s, const refined *expected) {
  uint32_t count = expected->mesh.vertex_count;
  assert_int_equal(tw_surface_row_count(s, TW_DOMAIN_POINTS), count);
  float *rows = read_blocks(s, TW_DOMAIN_POINTS, count);
  for (size_t i = 0; i < 3 * (size_t)count; i++) assert_true(fabsf(rows[i] - expected->points[i]) < 4e-6f);
  free(rows);
}

static void check_blocks(const tw_surface *s) {
  uint32_t count = (uint32_t)tw_surface_row_count(s, TW_DOMAIN_VERTICES);
  size_t size = (size_t)count * tw_surface_get_layout(s)->stride * sizeof(float);
  float *whole = read_blocks(s, TW_DOMAIN_VERTICES, count);
  static const uint32_t blocks[] = {1, 7, 1000};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) {
    float *rows = read_blocks(s, TW_DOMAIN_VERTICES, blocks[i]);
    assert_memory_equal(rows, whole, size);
    free(rows);
  }
  free(whole);
}

/* In blocks of an odd size. */
static void check_faces(const tw_surface *s, const refined *expected) {
  enum { BLOCK = 13 };
  uint32_t count = expected->mesh.face_count;
  uint32_t *faces = calloc(count, 4 * sizeof *faces);
  tw_surface_reader *reader = tw_surface_reader_create(s);
  assert_true(faces && reader);
  assert_int_equal(tw_surface_get_counts(s)->faces, count);
  for (uint32_t first = 0; first < count; first += BLOCK)
    tw_surface_read_faces(reader, TW_DOMAIN_POINTS, first, BLOCK < count - first ? BLOCK : count - first,
                          NULL, faces + 4 * (size_t)first);
  assert_memory_equal(faces, expected->mesh.corner_vertex, (size_t)count * 4 * sizeof *faces);
  tw_surface_reader_destroy(reader);
  free(faces);
}

/* A plan of the mesh with its points elsewhere, moved to where they are: the bytes of the surface itself. */
static void check_moved(const tw_mesh *mesh, tw_surface_options options, const tw_surface *expected) {
  float elsewhere[POINTS_MAX][3] = {{0}};
  tw_mesh other = *mesh;
  tw_surface *plan, *moved;
  other.positions = elsewhere[0];
  options.movable = true;
  assert_int_equal(tw_surface_create(&other, &options, &plan, NULL), TW_OK);
  assert_int_equal(tw_surface_with_positions_by(plan, mesh->positions, &backwards, &moved), TW_OK);
  uint32_t count = (uint32_t)tw_surface_row_count(expected, TW_DOMAIN_VERTICES);
  assert_int_equal(tw_surface_row_count(moved, TW_DOMAIN_VERTICES), count);
  float *rows = read_blocks(moved, TW_DOMAIN_VERTICES, count),
        *others = read_blocks(expected, TW_DOMAIN_VERTICES, count);
  assert_memory_equal(rows, others, (size_t)count * tw_surface_get_layout(moved)->stride * sizeof *rows);
  free(rows);
  free(others);
  tw_surface_destroy(moved);
  tw_surface_destroy(plan);
}

static tw_way way_of(const tw_mesh *mesh, tw_surface_options options) {
  tw_surface *s;
  assert_int_equal(tw_mesh_check(mesh, NULL, NULL), TW_OK);
  assert_int_equal(tw_surface_create_by(mesh, &options, &backwards, &s, NULL), TW_OK);
  tw_way way = s->way;
  tw_surface_destroy(s);
  return way;
}

static void check(const tw_mesh *mesh, tw_surface_options options) {
  tw_surface *s;
  assert_int_equal(tw_surface_create_by(mesh, &options, &backwards, &s, NULL), TW_OK);
  assert_int_equal(s->way, TW_WAY_LEVELS);
  refined expected = refine(mesh, &options);
  check_rows(s, &expected);
  check_faces(s, &expected);
  check_blocks(s);
  check_moved(mesh, options, s);
  tw_arena_destroy(expected.arena);
  tw_surface_destroy(s);
}

/* ---- tests ---------------------------------------------------------------------------------- */

TEST(irregular_cages_are_what_generic_steps_make) {
  tw_mesh mesh = cube();
  for (uint32_t level = 1; level <= 3; level++)
    check(&mesh, (tw_surface_options){.level = level, .normals = true});
  for (int faces = TORUS_TURNED_TRIANGLES; faces <= TORUS_QUADS; faces++)
    for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++)
      for (uint32_t level = 1; level <= 3; level++) {
        if (faces == TORUS_QUADS && gaps == NO_GAPS && level == 3) continue;
        cage *c = torus((torus_faces)faces, (torus_gaps)gaps, faces == TORUS_MIXED);
        check(&c->mesh, (tw_surface_options){.level = level, .normals = true});
        check(&c->mesh, (tw_surface_options){.level = level, .boundary = TW_BOUNDARY_EDGE_ONLY});
        free(c);
      }
}

TEST(creases_are_what_generic_steps_make) {
  static const float sharpness[] = {0.7f, 1, 1.5f, 2.5f, TW_SHARPNESS_INFINITE};
  for (size_t i = 0; i < sizeof sharpness / sizeof *sharpness; i++)
    for (int chaikin = 0; chaikin < 2; chaikin++)
      for (uint32_t level = 1; level <= 3; level++) {
        cage *c = torus(TORUS_TRIANGLES, GAPS_THAT_TOUCH, false);
        crease_some(c, sharpness[i]);
        for (uint32_t e = 0; e < 4; e++) memcpy(c->creases[e], c->corners + 8 * e, sizeof c->creases[e]);
        c->sharpness[3] = 0.25f;
        check(&c->mesh, (tw_surface_options){.level = level,
                                             .normals = i % 2 == 0,
                                             .creasing = chaikin ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM});
        free(c);
      }
}

/* Faces of the answer stand in the order of the materials; the cage's do not. */
TEST(materials_order_the_children_of_faces) {
  tw_mesh mesh = cube();
  static const int32_t materials[] = {2, 0, 1, 0, 2, 1};
  static const uint32_t order[] = {1, 3, 2, 5, 0, 4};
  mesh.face_materials = materials;
  const tw_surface_options options = {.level = 2};
  refined expected = refine(&mesh, &options);
  tw_surface *s;
  assert_int_equal(tw_surface_create(&mesh, &options, &s, NULL), TW_OK);
  assert_int_equal(s->way, TW_WAY_LEVELS);
  assert_int_equal(tw_surface_group_count(s), 3);
  tw_surface_reader *reader = tw_surface_reader_create(s);
  uint32_t faces[6 * 16][4];
  for (uint32_t first = 0; first < 96; first += 24)
    tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, first, 24, NULL, faces[first]);
  for (uint32_t f = 0; f < 6; f++)
    assert_memory_equal(faces[16 * f], expected.mesh.corner_vertex + 64 * (size_t)order[f],
                        sizeof faces[0] * 16);
  tw_surface_reader_destroy(reader);
  tw_surface_destroy(s);
  tw_arena_destroy(expected.arena);
}

TEST(patches_make_what_levels_are_not_for) {
  tw_mesh mesh = cube();
  assert_int_equal(way_of(&mesh, (tw_surface_options){.level = 4}), TW_WAY_PATCHES);
  cage *regular = torus(TORUS_QUADS, NO_GAPS, false), *mixed = torus(TORUS_MIXED, NO_GAPS, false);
  assert_int_equal(way_of(&regular->mesh, (tw_surface_options){.level = 2}), TW_WAY_LEVELS);
  assert_int_equal(way_of(&regular->mesh, (tw_surface_options){.level = 3}), TW_WAY_PATCHES);
  assert_int_equal(way_of(&mixed->mesh, (tw_surface_options){.level = 3}), TW_WAY_LEVELS);
  const tw_surface_options smooth = {.level = 2, .triangles = TW_TRIANGLES_SMOOTH},
                           open = {.level = 2, .boundary = TW_BOUNDARY_OPEN};
  assert_int_equal(way_of(&mixed->mesh, smooth), TW_WAY_PATCHES);
  assert_int_equal(way_of(&mixed->mesh, open), TW_WAY_LEVELS);
  static const float uvs[POINTS_MAX][2] = {{0}};
  tw_mesh mapped = mixed->mesh; /* which way round a map goes is for patches to tell */
  mapped.has_tangents = true;
  mapped.uv_set_count = 1;
  mapped.uv_sets[0] = (tw_uv_set){mapped.point_count, uvs[0], mapped.corners};
  assert_int_equal(way_of(&mapped, (tw_surface_options){.level = 2}), TW_WAY_LEVELS);
  assert_int_equal(way_of(&mapped, (tw_surface_options){.level = 2, .normals = true}), TW_WAY_PATCHES);
  uint32_t hole = 0;
  tw_mesh holed = mixed->mesh;
  holed.hole_count = 1;
  holed.holes = &hole;
  assert_int_equal(way_of(&holed, (tw_surface_options){.level = 2}), TW_WAY_PATCHES);
  free(regular);
  free(mixed);
}
