/* Quads at one extraordinary vertex, whose shapes and stencils all surfaces share: they give what splitting
 * gives, wherever one begins to read. Linked with malloc, calloc and realloc wrapped. */
#include "common_shape.h"

#include <math.h>
#include <pthread.h>

#include "built_cage.h"
#include "cage.h"
#include "failing_memory.h"
#include "split_patch.h"

/* ---- cages ---------------------------------------------------------------------------------- */

enum { ARM = 3, WIDE = ARM + 1, FEWEST = 3, MOST = 9, DEPTH_MAX = 7, SIDE_MAX = (1 << DEPTH_MAX) + 1 };

static float bumps(float x, float y) {
  return 0.4f * sinf(2 * x + y) + 0.2f * cosf(3 * y);
}

/* In one direction without an extent. */
static float flat(float x, float y) {
  return 0 * x + 0 * y;
}

/* Point (x, y) of a sector, which lies between two rays. */
static uint32_t point_of(uint32_t sectors, uint32_t sector, uint32_t x, uint32_t y) {
  if (x == 0 && y == 0) return 0;
  uint32_t next = (sector + 1) % sectors;
  if (x == 0) return point_of(sectors, next, y, 0);
  return 1 + (sector * ARM + x - 1) * WIDE + y;
}

/* Squares of quads round a vertex, as many as it has faces; each quad begins at another of its corners. */
static cage *star(uint32_t sectors, float (*height)(float, float)) {
  cage *c = new_cage();
  add_point(c, 0, 0, height(0, 0));
  for (uint32_t s = 0; s < sectors; s++)
    for (uint32_t x = 1; x <= ARM; x++)
      for (uint32_t y = 0; y <= ARM; y++) {
        float turn = 6.2831853f / (float)sectors, angle = turn * (float)s, next = angle + turn;
        float px = (float)x * cosf(angle) + (float)y * cosf(next),
              py = (float)x * sinf(angle) + (float)y * sinf(next);
        add_point(c, height == flat ? 0 : px, py, height(px, py));
      }
  for (uint32_t s = 0; s < sectors; s++)
    for (uint32_t x = 0; x < ARM; x++)
      for (uint32_t y = 0; y < ARM; y++) {
        uint32_t quad[4], turn = s % 4;
        for (uint32_t k = 0; k < 4; k++) {
          uint32_t corner = (k + turn) % 4;
          quad[k] = point_of(sectors, s, x + (corner == 1 || corner == 2), y + (corner >= 2));
        }
        add_face(c, quad, 4);
      }
  return c;
}

/* Creases that end, meet and pass beside the vertex in the middle. */
static void add_creases(cage *c, uint32_t sectors) {
  static uint32_t edges[5][2];
  static const float sharpness[5] = {2.5f, 1.25f, TW_SHARPNESS_INFINITE, TW_SHARPNESS_INFINITE, 4};
  for (uint32_t i = 0; i < 2; i++) {
    edges[i][0] = point_of(sectors, 0, 1 + i, 1);
    edges[i][1] = point_of(sectors, 0, 2 + i, 1);
    edges[2 + i][0] = point_of(sectors, 1, 1, i + 1);
    edges[2 + i][1] = point_of(sectors, 1, 1, i + 2);
  }
  edges[4][0] = point_of(sectors, 2, 0, 0);
  edges[4][1] = point_of(sectors, 2, 1, 0);
  c->mesh.crease_count = 5;
  c->mesh.crease_edges = edges[0];
  c->mesh.crease_sharpness = sharpness;
}

/* ---- against splitting ---------------------------------------------------------------------- */

/* The cage itself, and its patches with stencils. */
typedef struct planned {
  cage *cage;
  tw_arena *arena;
  tw_cage read;
  tw_patch_shapes *shapes;
  tw_patches patches;
  double *scratch;
} planned;

static planned plan(cage *c, uint32_t depth, bool limit) {
  planned p = {.cage = c, .arena = tw_arena_create(), .shapes = tw_patch_shapes_create()};
  tw_surface_options options = {.level = depth};
  tw_rules rules = {.linear = false};
  assert_true(p.arena && p.shapes);
  assert_int_equal(tw_cage_read(&c->mesh, &options, p.arena, &p.read), TW_OK);
  assert_int_equal(tw_patches_create(&p.patches, &p.read.topology, &rules, depth, p.shapes), TW_OK);
  assert_int_equal(tw_patches_sum(&p.patches, p.shapes, limit, true), TW_OK);
  p.scratch = calloc(p.patches.scratch_points, 4 * sizeof *p.scratch);
  assert_non_null(p.scratch);
  return p;
}

static void free_plan(planned *p) {
  tw_patches_deinit(&p->patches);
  tw_patch_shapes_destroy(p->shapes);
  tw_arena_destroy(p->arena);
  free(p->scratch);
}

/* Points, normals behind them and a float that stays. */
static void evaluate(const planned *p, bool split, uint32_t quad, bool limit, bool backwards,
                     tw_patch_rect rect, float *out) {
  tw_patch_job job = {.in = p->cage->points[0],
                      .width = 3,
                      .limit = limit,
                      .backwards = backwards,
                      .values = out,
                      .normals = out + 3,
                      .stride = 7,
                      .scratch = p->scratch};
  if (split)
    evaluate_split(&p->patches, p->shapes, quad, &job, rect);
  else
    tw_patch_evaluate(&p->patches, quad, &job, rect);
}

static const float untouched = -77.5f;
static float wanted[SIDE_MAX * SIDE_MAX * 7 + 7], found[SIDE_MAX * SIDE_MAX * 7 + 7];

/* Rectangles as readers ask for them, and others. */
static tw_patch_rect rect_at(uint32_t n, uint32_t which) {
  bool backwards;
  if (which < 4) return tw_patch_corner(n, which);
  if (which < 8) return n > 1 ? tw_patch_side(n, which % 4, &backwards) : tw_patch_corner(n, which % 4);
  const tw_patch_rect rects[] = {{0, n, 0, n},
                                 {n > 1, n - (n > 1), n > 1, n - (n > 1)},
                                 {0, n, n / 3, n / 3},
                                 {n / 5, n / 2 + 1, n / 4, n},
                                 {n / 2, n, 0, n / 2}};
  return rects[which - 8];
}

static void compare_quad(const planned *p, uint32_t quad, bool limit, float tolerance) {
  uint32_t n = 1u << p->patches.depth;
  for (uint32_t which = 0; which < 13; which++)
    for (int backwards = 0; backwards < 2; backwards++) {
      tw_patch_rect rect = rect_at(n, which);
      size_t floats = (size_t)(rect.i1 - rect.i0 + 1) * (rect.j1 - rect.j0 + 1) * 7;
      for (size_t i = 0; i < floats + 7; i++) wanted[i] = found[i] = untouched;
      evaluate(p, true, quad, limit, backwards, rect, wanted);
      evaluate(p, false, quad, limit, backwards, rect, found);
      for (size_t i = 0; i < floats + 7; i++)
        if (!(fabsf(found[i] - wanted[i]) <= (i % 7 < 3 ? 1e-6f : tolerance)))
          fail_msg("depth %u, quad %u, rectangle %u, float %zu: %g is not %g", p->patches.depth, quad, which,
                   i, (double)found[i], (double)wanted[i]);
      assert_true(found[floats] == untouched);
    }
}

static uint32_t commons_in(const tw_patch_shapes *shapes) {
  uint32_t count = 0;
  for (tw_patch_class *s = tw_patch_shapes_commons(shapes); s; s = s->next_common) count++;
  return count;
}

static void compare_star(uint32_t sectors, uint32_t depth, bool creased) {
  cage *c = star(sectors, bumps);
  if (creased) add_creases(c, sectors);
  bool limit = (depth + sectors) % 3 == 0, common = sectors != 4 && sectors != MOST;
  planned p = plan(c, depth, limit);
  if (!creased) assert_int_equal(commons_in(p.shapes), common ? (sectors < 4 ? sectors : 4) : 0);
  uint32_t each = depth > 4 ? 11 : 3;
  for (uint32_t quad = sectors % each; quad < p.read.topology.face_count; quad += each)
    if (p.patches.patches[quad].shape) compare_quad(&p, quad, limit, 2e-5f);
  for (uint32_t s = 0; common && s < sectors; s++) compare_quad(&p, s * ARM * ARM, limit, 2e-5f);
  free_plan(&p);
  free(c);
}

static void stencils_of_quarters_give_what_splitting_gives(void **state) {
  (void)state;
  for (uint32_t sectors = FEWEST; sectors <= MOST; sectors++)
    for (uint32_t depth = 1; depth <= DEPTH_MAX; depth++) {
      compare_star(sectors, depth, false);
      if (depth % 2 == sectors % 2) compare_star(sectors, depth, true);
    }
}

/* Where float does not do for all normals, a rectangle has those of splitting. */
static void collapsed_quarters_have_the_normals_of_splitting(void **state) {
  (void)state;
  for (uint32_t depth = 2; depth <= 6; depth += 2) {
    cage *c = star(5, flat);
    planned p = plan(c, depth, false);
    for (uint32_t s = 0; s < 5; s++) compare_quad(&p, s * ARM * ARM, false, 0);
    free_plan(&p);
    free(c);
  }
}

/* ---- which are common ----------------------------------------------------------------------- */

/* The shapes round the vertex in the middle; allocation n fails. */
static tw_status classify(const tw_topology *base, bool chaikin, tw_patch_shapes *shapes, size_t n) {
  tw_collector *collector = tw_collector_create(base, chaikin);
  assert_non_null(collector);
  tw_status status = TW_OK;
  tw_patch_class *shape;
  const uint32_t *points;
  left = n;
  for (uint32_t quad = 0; quad < base->face_count && status == TW_OK; quad += ARM * ARM)
    status = tw_patch_classify(shapes, collector, 4 * quad, 6, &shape, &points);
  tw_collector_destroy(collector);
  return status;
}

static tw_patch_shapes *shapes_of(cage *c, bool chaikin) {
  tw_arena *arena = tw_arena_create();
  tw_patch_shapes *shapes = tw_patch_shapes_create();
  tw_surface_options options = {.level = 6, .creasing = chaikin ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM};
  tw_cage read;
  assert_true(arena && shapes);
  assert_int_equal(tw_cage_read(&c->mesh, &options, arena, &read), TW_OK);
  assert_int_equal(classify(&read.topology, chaikin, shapes, SIZE_MAX), TW_OK);
  left = SIZE_MAX;
  tw_arena_destroy(arena);
  return shapes;
}

static void expect_no_commons(cage *c, bool chaikin) {
  tw_patch_shapes *shapes = shapes_of(c, chaikin);
  assert_int_equal(commons_in(shapes), 0);
  tw_patch_shapes_destroy(shapes);
}

/* Before anything else here: what is not smooth must not take the place of what is, which later tests ask
 * for. */
static void shapes_that_are_not_smooth_are_not_shared(void **state) {
  (void)state;
  const uint32_t middle = 0;
  const float infinite[2] = {TW_SHARPNESS_INFINITE, TW_SHARPNESS_INFINITE};
  for (uint32_t sectors = FEWEST; sectors < MOST; sectors++) {
    if (sectors == 4) continue;
    cage *c = star(sectors, bumps);
    const uint32_t edges[2][2] = {{0, point_of(sectors, 0, 1, 0)}, {0, point_of(sectors, 1, 1, 0)}};
    expect_no_commons(c, true);
    c->mesh.sharp_point_count = 1;
    c->mesh.sharp_points = &middle;
    c->mesh.point_sharpness = infinite;
    expect_no_commons(c, false);
    c->mesh.sharp_point_count = 0;
    c->mesh.crease_edges = edges[0];
    c->mesh.crease_sharpness = infinite;
    c->mesh.crease_count = 2;
    expect_no_commons(c, false);
    free(c);
  }
}

/* As many faces and points, but joined in another way. */
static void what_looks_alike_is_not_shared(void **state) {
  (void)state;
  cage *c = star(5, bumps);
  tw_patch_shapes *shapes = shapes_of(c, false);
  for (tw_patch_class *shape = tw_patch_shapes_commons(shapes); shape; shape = shape->next_common) {
    tw_neighbourhood alike = shape->local;
    uint32_t(*quads)[4] = malloc(alike.key_size);
    tw_common_shape *common;
    assert_non_null(quads);
    memcpy(quads, alike.quads, alike.key_size);
    alike.sharpness = (float(*)[4])(void *)(quads + alike.face_count);
    alike.vertex_sharpness = (float *)(alike.sharpness + alike.face_count);
    alike.quads = quads;
    assert_int_equal(tw_common_find(&alike, &common), TW_OK);
    assert_ptr_equal(common, shape->common);
    uint32_t *last = quads[alike.face_count - 1], swapped = last[2];
    last[2] = last[1];
    last[1] = swapped;
    assert_int_equal(tw_common_find(&alike, &common), TW_OK);
    assert_null(common);
    free(quads);
  }
  tw_patch_shapes_destroy(shapes);
  free(c);
}

/* ---- memory and threads --------------------------------------------------------------------- */

/* Whether allocation n was to fail, be it that one can do without it. */
static bool failed(void) {
  bool failed = left == SIZE_MAX;
  left = SIZE_MAX;
  return failed;
}

static size_t fail_shapes(const tw_topology *base) {
  size_t failures = 0;
  for (size_t n = 0;; n++) {
    tw_patch_shapes *shapes = tw_patch_shapes_create();
    assert_non_null(shapes);
    tw_status status = classify(base, false, shapes, n);
    assert_true(status == TW_OK || status == TW_NO_MEMORY);
    tw_patch_shapes_destroy(shapes);
    failures += status != TW_OK;
    if (!failed()) return failures;
  }
}

static size_t fail_stencils(const tw_topology *base) {
  tw_patch_shapes *shapes = tw_patch_shapes_create();
  assert_non_null(shapes);
  assert_int_equal(classify(base, false, shapes, SIZE_MAX), TW_OK);
  for (size_t n = 0;; n++) {
    left = n;
    tw_status status = tw_common_stencils(shapes, false, true);
    bool any = failed();
    assert_int_equal(status, any ? TW_NO_MEMORY : TW_OK);
    if (any) continue;
    tw_patch_shapes_destroy(shapes);
    return n;
  }
}

/* Before anything here has made what is shared. Each time more of it is there already. */
static void every_allocation_that_fails_is_told_of(void **state) {
  (void)state;
  size_t shapes = 0, stencils = 0;
  for (uint32_t sectors = 3; sectors < 8; sectors++) {
    cage *c = star(sectors, bumps);
    tw_arena *arena = tw_arena_create();
    tw_cage read;
    tw_surface_options options = {.level = 6};
    assert_int_equal(tw_cage_read(&c->mesh, &options, arena, &read), TW_OK);
    shapes += fail_shapes(&read.topology);
    stencils += fail_stencils(&read.topology);
    tw_arena_destroy(arena);
    free(c);
  }
  assert_true(shapes > 40 && stencils > 60);
}

static void *read_star(void *mesh) {
  rows *r = malloc(sizeof *r);
  if (r) *r = read_rows(mesh, (tw_surface_options){.level = 6, .normals = true});
  return r;
}

static void threads_that_come_first_together_share_one_shape(void **state) {
  (void)state;
  enum { THREADS = 4 };
  cage *c = star(8, bumps);
  pthread_t threads[THREADS];
  void *read[THREADS];
  for (int i = 0; i < THREADS; i++)
    assert_int_equal(pthread_create(&threads[i], NULL, read_star, &c->mesh), 0);
  for (int i = 0; i < THREADS; i++) pthread_join(threads[i], &read[i]);
  const rows *first = read[0];
  for (int i = 1; i < THREADS; i++) {
    rows *other = read[i];
    assert_non_null(other);
    assert_int_equal(other->count, first->count);
    assert_memory_equal(other->values, first->values, first->count * 6 * sizeof(float));
    free_rows(other);
    free(other);
  }
  free_rows(read[0]);
  free(read[0]);
  free(c);
}

/* ---- any order ------------------------------------------------------------------------------ */

static uint32_t next_random(uint32_t *seed) {
  *seed = *seed * 1664525u + 1013904223u;
  return *seed >> 8;
}

/* Single rows and blocks, one after the other by the same reader. */
static void compare_reads(const rows *all, uint32_t seed) {
  enum { READS = 300, BLOCK = 3000 };
  size_t stride = all->layout->stride;
  float *block = malloc(BLOCK * stride * sizeof *block);
  tw_surface_reader *reader = tw_surface_reader_create(all->surface);
  assert_true(block && reader);
  for (uint32_t n = 0; n < READS; n++) {
    size_t first = next_random(&seed) % all->count, count = 1;
    if (n % 3 > 0) count += next_random(&seed) % (n % 3 == 1 ? 90 : BLOCK - 1);
    if (first + count > all->count) count = all->count - first;
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, first, count, block);
    assert_memory_equal(block, row_of(all, first), count * stride * sizeof *block);
  }
  tw_surface_reader_destroy(reader);
  free(block);
}

static void rows_are_the_same_in_any_order(void **state) {
  (void)state;
  for (uint32_t sectors = FEWEST; sectors <= MOST; sectors++)
    for (uint32_t level = 1; level <= 7; level += 2)
      for (int kind = 0; kind < 3; kind++) { /* smooth, creased, collapsed */
        if (level == 7 && sectors % 3 > 0) continue;
        cage *c = star(sectors, kind == 2 ? flat : bumps);
        if (kind == 1) add_creases(c, sectors);
        tw_surface_options options = {
            .level = level, .normals = sectors % 2 == 1 || kind == 2, .limit = level % 4 == 1};
        rows all = read_rows(&c->mesh, options);
        compare_reads(&all, sectors + level);
        free_rows(&all);
        free(c);
      }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(shapes_that_are_not_smooth_are_not_shared),
      cmocka_unit_test(every_allocation_that_fails_is_told_of),
      cmocka_unit_test(threads_that_come_first_together_share_one_shape),
      cmocka_unit_test(what_looks_alike_is_not_shared),
      cmocka_unit_test(stencils_of_quarters_give_what_splitting_gives),
      cmocka_unit_test(collapsed_quarters_have_the_normals_of_splitting),
      cmocka_unit_test(rows_are_the_same_in_any_order),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
