/* A surface has the same bytes whoever took part in making it: by one thread, by parts in another order, by
 * four threads at once. One that is not wanted any more is given up. */
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "built_cage.h"
#include "host.h"
#include "parallel_for.h"
#include "wrapped_memory.h"

/* ---- ways to run parts ----------------------------------------------------------------------- */

typedef struct shared {
  void (*part)(void *context, uint32_t index);
  void *context;
  uint32_t count;
  atomic_uint next;
} shared;

static void *take_parts(void *context) {
  shared *s = context;
  for (uint32_t i = atomic_fetch_add(&s->next, 1); i < s->count; i = atomic_fetch_add(&s->next, 1))
    s->part(s->context, i);
  return NULL;
}

static void run_on_threads(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                           void *context) {
  enum { OTHERS = 3 };
  pthread_t others[OTHERS];
  shared s = {part, context, count, 0};
  *(uint32_t *)owner += count;
  for (int i = 0; i < OTHERS; i++) assert_int_equal(pthread_create(&others[i], NULL, take_parts, &s), 0);
  take_parts(&s);
  for (int i = 0; i < OTHERS; i++) pthread_join(others[i], NULL);
}

/* ---- cages ----------------------------------------------------------------------------------- */

typedef enum kind { TRIANGLES, MIXED } kind;

enum { SIDE_MAX = 100 };

/* A sheet with a border, of side x side quads, all or some of which are cut. fin: one edge has a third face.
 */
static cage *sheet(uint32_t side, kind kind, bool fin) {
  cage *c = new_cage_for((side + 1) * (side + 1) + 1, 2 * side * side + 1);
  for (uint32_t y = 0; y <= side; y++)
    for (uint32_t x = 0; x <= side; x++)
      add_point(c, (float)x, (float)y, sinf(0.3f * (float)x) * cosf(0.2f * (float)(y + x)));
  for (uint32_t y = 0; y < side; y++)
    for (uint32_t x = 0; x < side; x++) {
      uint32_t a = y * (side + 1) + x, d = a + side + 1, quad[4] = {a, a + 1, d + 1, d};
      add_quad(c, quad, kind == TRIANGLES || (x + 2 * y) % 3 == 0);
    }
  if (fin) add_face(c, (uint32_t[]){c->corners[0], c->corners[1], add_point(c, 1, 1, 0.28f)}, 3);
  return c;
}

/* Along the first column of points, as sharp as each other or not. */
static void crease(cage *c, uint32_t side) {
  static uint32_t creases[SIDE_MAX][2];
  static float sharpness[SIDE_MAX];
  for (uint32_t i = 0; i < side; i++) {
    creases[i][0] = i * (side + 1) + 1;
    creases[i][1] = creases[i][0] + side + 1;
    sharpness[i] = i % 5 == 4 ? TW_SHARPNESS_INFINITE : 0.7f * (float)(1 + i % 4);
  }
  c->mesh.crease_edges = creases[0];
  c->mesh.crease_sharpness = sharpness;
  c->mesh.crease_count = side;
}

/* Joins the borders that are across from each other: a torus. */
static void join(cage *c, uint32_t side) {
  for (uint32_t k = 0; k < c->mesh.corner_count; k++) {
    uint32_t x = c->corners[k] % (side + 1), y = c->corners[k] / (side + 1);
    c->corners[k] = y % side * (side + 1) + x % side;
  }
}

static void map(cage *c) {
  static float uvs[(SIDE_MAX + 1) * (SIDE_MAX + 1) + 1][2];
  for (uint32_t p = 0; p < c->mesh.point_count; p++) memcpy(uvs[p], c->points[p], sizeof uvs[p]);
  c->mesh.uv_set_count = 1;
  c->mesh.uv_sets[0] = (tw_uv_set){c->mesh.point_count, uvs[0], c->corners};
}

/* ---- comparing ------------------------------------------------------------------------------- */

typedef struct content {
  float *rows;
  uint32_t *corners;
  size_t row_size, corner_count;
} content;

static content read_all(tw_surface *surface) {
  const rows r = {.surface = surface};
  return (content){.rows = all_rows(surface, TW_DOMAIN_VERTICES),
                   .corners = faces_of(&r, TW_DOMAIN_VERTICES),
                   .row_size = (size_t)tw_surface_row_count(surface, TW_DOMAIN_VERTICES) *
                               tw_surface_get_layout(surface)->stride,
                   .corner_count = (size_t)tw_surface_get_counts(surface)->corners};
}

static content make(const tw_mesh *mesh, const tw_surface_options *options, const tw_parallel_for *parallel) {
  tw_surface *surface = NULL;
  tw_error error = {0};
  if (tw_surface_create_by(mesh, options, parallel, &surface, &error) != TW_OK) fail_msg("%s", error.detail);
  content c = read_all(surface);
  tw_surface_destroy(surface);
  return c;
}

static void free_content(content *c) {
  free(c->rows);
  free(c->corners);
}

static void check_same(content one, const content *other) {
  assert_int_equal(one.row_size, other->row_size);
  assert_int_equal(one.corner_count, other->corner_count);
  assert_memory_equal(one.rows, other->rows, other->row_size * sizeof *other->rows);
  assert_memory_equal(one.corners, other->corners, other->corner_count * sizeof *other->corners);
  free_content(&one);
}

/* Made by the calling thread, then moved to where it is. */
static content move(const tw_mesh *mesh, tw_surface_options options, const tw_parallel_for *parallel) {
  options.movable = true;
  tw_surface *plan = NULL, *moved = NULL;
  assert_int_equal(tw_surface_create(mesh, &options, &plan, NULL), TW_OK);
  assert_int_equal(tw_surface_with_positions_by(plan, mesh->positions, parallel, &moved), TW_OK);
  content c = read_all(moved);
  tw_surface_destroy(moved);
  tw_surface_destroy(plan);
  return c;
}

static bool is_thread_sanitized(void) {
  const char *sanitizer = getenv("TESTED_SANITIZED");
  return sanitizer && strcmp(sanitizer, "thread") == 0;
}

/* Smaller sheets under the thread sanitizer, which are still shared by threads. */
static uint32_t side_of(uint32_t side) {
  return is_thread_sanitized() ? 3 * side / 4 : side;
}

/* Returns the number of parts that threads shared. What one thread makes has the same bytes without
 * sanitizers: under them threads alone, which take the same ways through the library, are enough. */
static uint32_t check(const cage *c, tw_surface_options options) {
  uint32_t parts = 0, others = 0;
  const tw_parallel_for threads = {.owner = &parts, .run = run_on_threads},
                        backwards = {.owner = &others, .run = run_backwards};
  content shared = make(&c->mesh, &options, &threads);
  assert_true(shared.corner_count > 0);
  check_same(move(&c->mesh, options, &threads), &shared);
  if (!getenv("TESTED_SANITIZED")) {
    check_same(make(&c->mesh, &options, NULL), &shared);
    check_same(make(&c->mesh, &options, &backwards), &shared);
    check_same(move(&c->mesh, options, &backwards), &shared);
    assert_int_equal(others, parts);
  }
  free_content(&shared);
  return parts;
}

enum { FIN = 1, CREASED = 2, MAPPED = 4, LIVELY = 8 }; /* with normals, of another creasing and boundary */

static void check_all(uint32_t side, kind kind, tw_surface_options options) {
  static const int cases[] = {CREASED | MAPPED | LIVELY, 0, FIN, CREASED, MAPPED, LIVELY, FIN | MAPPED};
  uint32_t parts = 0;
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i += test_stride()) {
    cage *c = sheet(side, kind, cases[i] & FIN);
    if (cases[i] & CREASED) crease(c, side);
    if (cases[i] & MAPPED) map(c);
    bool lively = cases[i] & LIVELY;
    options.creasing = lively ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM;
    options.boundary = lively ? TW_BOUNDARY_EDGE_ONLY : TW_BOUNDARY_EDGE_AND_CORNER;
    options.normals = lively;
    parts += check(c, options);
    options.boundary = TW_BOUNDARY_OPEN;
    if (cases[i] & CREASED) parts += check(c, options);
    free(c);
  }
  assert_true(parts > 25 / test_stride());
}

/* ---- tests ----------------------------------------------------------------------------------- */

TEST(loop_surfaces_are_the_same) {
  check_all(side_of(24), TRIANGLES, (tw_surface_options){.level = 3, .scheme = TW_LOOP});
}

TEST(catmull_clark_surfaces_of_mixed_cages_are_the_same) {
  check_all(44, MIXED, (tw_surface_options){.level = 2});
}

TEST(bilinear_surfaces_are_the_same) {
  check_all(44, MIXED, (tw_surface_options){.level = 2, .scheme = TW_BILINEAR});
}

/* Levels that are read straight from the cage. */
TEST(shallow_surfaces_are_the_same) {
  uint32_t side = side_of(SIDE_MAX);
  cage *c = sheet(side, TRIANGLES, false);
  join(c, side);
  for (uint32_t level = 1; level <= 2; level++)
    for (int normals = 0; normals < 2; normals++)
      assert_true(check(c, (tw_surface_options){.level = level, .normals = normals}) >= 4);
  free(c);
}

/* Normals of an open border look at differences in double. */
TEST(points_refined_in_double_are_the_same) {
  cage *c = sheet(24, MIXED, false);
  crease(c, 24);
  assert_true(check(c, (tw_surface_options){.level = 3, .boundary = TW_BOUNDARY_OPEN, .normals = true}) > 1);
  free(c);
}

/* ---- giving up ------------------------------------------------------------------------------- */

typedef struct patience {
  uint32_t left; /* questions whose answer is to go on */
  bool is_over;
} patience;

static bool is_over(void *owner) {
  patience *p = owner;
  p->is_over = p->left == 0;
  if (!p->is_over) p->left--;
  return p->is_over;
}

/* For tests that start no thread. */
static void need_no_thread_sanitizer(void) {
  if (is_thread_sanitized()) skip();
}

/* Gives up at each step in turn; returns how many there are. */
static uint32_t cancel_each(const tw_mesh *mesh, const tw_surface_options *options) {
  content first = make(mesh, options, NULL); /* what is allocated once is there from here on */
  free_content(&first);
  tw_status status = TW_CANCELLED;
  uint32_t steps = 0;
  for (; status == TW_CANCELLED; steps++) {
    patience p = {.left = steps};
    const tw_parallel_for parallel = {&p, run_in_order, is_over};
    tw_surface *surface = NULL;
    tw_error error = {0};
    size_t held = test_memory.held;
    status = tw_surface_create_by(mesh, options, &parallel, &surface, &error);
    assert_int_equal(status, p.is_over ? TW_CANCELLED : TW_OK);
    assert_int_equal(error.status, status);
    assert_int_equal(surface != NULL, status == TW_OK);
    tw_surface_destroy(surface);
    assert_int_equal(test_memory.held, held);
  }
  return steps - 1;
}

TEST(a_surface_that_is_not_wanted_any_more_is_given_up_between_two_steps) {
  need_no_thread_sanitizer();
  static const tw_surface_options options[] = {
      {.level = 2}, {.level = 4}, {.level = 3, .scheme = TW_LOOP}, {.level = 3, .scheme = TW_BILINEAR}};
  static const uint32_t least[] = {7, 2, 4, 2};
  cage *c = sheet(24, TRIANGLES, false);
  map(c);
  for (size_t i = 0; i < sizeof options / sizeof *options; i++)
    assert_true(cancel_each(&c->mesh, &options[i]) >= least[i]);
  free(c);
}

TEST(loops_are_cut_into_even_parts_that_are_worth_it) {
  const tw_parallel_for parallel = {.run = run_backwards};
  assert_int_equal(tw_parallel_for_parts(NULL, 1000000, 10), 1);
  assert_int_equal(tw_parallel_for_parts(&parallel, 0, 10), 1);
  assert_int_equal(tw_parallel_for_parts(&parallel, 19, 10), 1);
  assert_int_equal(tw_parallel_for_parts(&parallel, 20, 10), 2);
  assert_int_equal(tw_parallel_for_parts(&parallel, UINT32_MAX, 10), TW_PARALLEL_FOR_PARTS_MAX);
}

/* Of somebody who goes on wanting: how often that is asked while the surface is made, and while its bounds
 * are found. */
static void count_questions(const tw_mesh *mesh, const tw_surface_options *options, uint32_t *making,
                            uint32_t *bounds) {
  patience p = {.left = UINT32_MAX};
  const tw_parallel_for parallel = {&p, run_in_order, is_over};
  tw_surface *surface;
  float min[3], max[3];
  assert_int_equal(tw_surface_create_by(mesh, options, &parallel, &surface, NULL), TW_OK);
  *making = UINT32_MAX - p.left;
  p.left = UINT32_MAX;
  assert_int_equal(tw_surface_bounds_by(surface, -1, &parallel, min, max), TW_OK);
  *bounds = UINT32_MAX - p.left;
  tw_surface_destroy(surface);
}

/* The longest loops of a great cage: one over its quads for each field, one over all rows. */
TEST(loops_over_many_patches_ask_on_their_way) {
  need_no_thread_sanitizer();
  const tw_surface_options shallow = {.level = 4}, deep = {.level = 9};
  uint32_t making, bounds, more, deeper;
  cage *small = sheet(8, TRIANGLES, false), *large = sheet(80, TRIANGLES, false);
  map(small);
  map(large);
  count_questions(&small->mesh, &shallow, &making, &bounds);
  count_questions(&large->mesh, &shallow, &more, &deeper);
  assert_true(more >= making + 2 * (large->mesh.corner_count / 4096 - 1));
  count_questions(&small->mesh, &deep, &making, &deeper);
  assert_int_equal(bounds, 1);
  assert_true(deeper >= small->mesh.corner_count / 32); /* 65,536 rows a quad of the first level */
  free(small);
  free(large);
}

TEST(bounds_that_are_not_wanted_any_more_are_given_up_and_found_later) {
  need_no_thread_sanitizer();
  cage *c = sheet(4, TRIANGLES, false);
  tw_surface *surface;
  float min[3], max[3], wanted[2][3];
  const tw_surface_options options = {.level = 9};
  assert_int_equal(tw_surface_create(&c->mesh, &options, &surface, NULL), TW_OK);
  for (uint32_t left = 0; left < 3; left++) {
    patience p = {.left = left};
    const tw_parallel_for parallel = {&p, run_in_order, is_over};
    assert_int_equal(tw_surface_bounds_by(surface, -1, &parallel, min, max), TW_CANCELLED);
  }
  assert_int_equal(tw_surface_bounds(surface, -1, min, max), TW_OK);
  uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  float *points = all_rows(surface, TW_DOMAIN_POINTS);
  memcpy(wanted[0], points, sizeof wanted[0]);
  memcpy(wanted[1], points, sizeof wanted[1]);
  for (uint64_t i = 0; i < 3 * rows; i++) {
    wanted[0][i % 3] = fminf(wanted[0][i % 3], points[i]);
    wanted[1][i % 3] = fmaxf(wanted[1][i % 3], points[i]);
  }
  assert_memory_equal(min, wanted[0], sizeof min);
  assert_memory_equal(max, wanted[1], sizeof max);
  free(points);
  tw_surface_destroy(surface);
  free(c);
}
