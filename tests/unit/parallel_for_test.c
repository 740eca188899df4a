/* A surface has the same bytes whoever took part in making it: by one thread, by parts in another order, by
 * four threads at once. One that is not wanted any more is given up. */
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "parallel_for.h"
#include "test.h"
#include "tweend/subdiv.h"
#include "wrapped_memory.h"

/* ---- ways to run parts --------------------------------------------------------------------------------- */

static void run_backwards(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                          void *context) {
  *(uint32_t *)owner += count;
  while (count > 0) part(context, --count);
}

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

/* ---- cages ---------------------------------------------------------------------------------- */

typedef enum kind { TRIANGLES, MIXED } kind;

/* A sheet with a border, of side x side quads, all or some of which are cut. */
typedef struct sheet {
  tw_mesh mesh;
  float *points, *uvs;
  uint32_t *corners, *offsets, *creases;
  float *sharpness;
} sheet;

static void add_face(sheet *s, uint32_t size, const uint32_t *points) {
  memcpy(s->corners + s->mesh.corner_count, points, size * sizeof *points);
  s->mesh.corner_count += size;
  s->offsets[++s->mesh.face_count] = s->mesh.corner_count;
}

static void place(sheet *s, uint32_t x, uint32_t y) {
  float *point = s->points + 3 * (size_t)s->mesh.point_count, *uv = s->uvs + 2 * (size_t)s->mesh.point_count;
  point[0] = uv[0] = (float)x;
  point[1] = uv[1] = (float)y;
  point[2] = sinf(0.3f * (float)x) * cosf(0.2f * (float)(y + x));
  s->mesh.point_count++;
}

/* fin: one edge has a third face. */
static sheet new_sheet(uint32_t side, kind kind, bool fin) {
  size_t points = ((size_t)side + 1) * (side + 1) + 1, faces = 2 * (size_t)side * side + 1;
  sheet s = {.points = calloc(points, 3 * sizeof(float)),
             .uvs = calloc(points, 2 * sizeof(float)),
             .corners = calloc(faces, 4 * sizeof(uint32_t)),
             .offsets = calloc(faces + 1, sizeof(uint32_t)),
             .creases = calloc(side, 2 * sizeof(uint32_t)),
             .sharpness = calloc(side, sizeof(float))};
  assert_true(s.points && s.uvs && s.corners && s.offsets && s.creases && s.sharpness);
  tw_mesh_init(&s.mesh);
  for (uint32_t y = 0; y <= side; y++)
    for (uint32_t x = 0; x <= side; x++) place(&s, x, y);
  for (uint32_t y = 0; y < side; y++)
    for (uint32_t x = 0; x < side; x++) {
      uint32_t a = y * (side + 1) + x, d = a + side + 1;
      if (kind == MIXED && (x + 2 * y) % 3 > 0) {
        add_face(&s, 4, (uint32_t[]){a, a + 1, d + 1, d});
        continue;
      }
      add_face(&s, 3, (uint32_t[]){a, a + 1, d + 1});
      add_face(&s, 3, (uint32_t[]){a, d + 1, d});
    }
  if (fin) {
    place(&s, 1, 1);
    add_face(&s, 3, (uint32_t[]){s.corners[0], s.corners[1], s.mesh.point_count - 1});
  }
  s.mesh.positions = s.points;
  s.mesh.corners = s.corners;
  s.mesh.face_offsets = s.offsets;
  return s;
}

/* Along the first column of points, as sharp as each other or not. */
static void crease(sheet *s, uint32_t side) {
  for (uint32_t i = 0; i < side; i++) {
    uint32_t point = i * (side + 1) + 1;
    s->creases[2 * i] = point;
    s->creases[2 * i + 1] = point + side + 1;
    s->sharpness[i] = i % 5 == 4 ? TW_SHARPNESS_INFINITE : 0.7f * (float)(1 + i % 4);
  }
  s->mesh.crease_edges = s->creases;
  s->mesh.crease_sharpness = s->sharpness;
  s->mesh.crease_count = side;
}

/* Joins the borders that are across from each other: a torus. */
static void join(sheet *s, uint32_t side) {
  for (uint32_t c = 0; c < s->mesh.corner_count; c++) {
    uint32_t x = s->corners[c] % (side + 1), y = s->corners[c] / (side + 1);
    s->corners[c] = y % side * (side + 1) + x % side;
  }
}

static void map(sheet *s) {
  s->mesh.uv_set_count = 1;
  s->mesh.uv_sets[0].value_count = s->mesh.point_count;
  s->mesh.uv_sets[0].values = s->uvs;
  s->mesh.uv_sets[0].corners = s->corners;
}

static void free_sheet(sheet *s) {
  free(s->points);
  free(s->uvs);
  free(s->corners);
  free(s->offsets);
  free(s->creases);
  free(s->sharpness);
}

/* ---- comparing ------------------------------------------------------------------------------ */

typedef struct content {
  float *rows;
  uint32_t *corners;
  size_t row_size, corner_count;
} content;

static content read_all(const tw_surface *surface) {
  uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
  const tw_surface_counts *counts = tw_surface_get_counts(surface);
  content c = {.row_size = (size_t)rows * tw_surface_get_layout(surface)->stride,
               .corner_count = (size_t)counts->corners};
  c.rows = calloc(c.row_size + 1, sizeof *c.rows);
  c.corners = calloc(c.corner_count + 1, sizeof *c.corners);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  assert_true(c.rows && c.corners && reader);
  tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, (size_t)rows, c.rows);
  tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, 0, (size_t)counts->faces, NULL, c.corners);
  tw_surface_reader_destroy(reader);
  return c;
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

/* What one thread makes races nothing: without the thread sanitizer it has the same bytes. */
static bool is_thread_sanitized(void) {
  const char *sanitizer = getenv("TESTED_SANITIZED");
  return sanitizer && strcmp(sanitizer, "thread") == 0;
}

/* Returns the number of parts that threads shared. */
static uint32_t check(const sheet *s, tw_surface_options options) {
  uint32_t parts = 0, others = 0;
  const tw_parallel_for threads = {.owner = &parts, .run = run_on_threads},
                        backwards = {.owner = &others, .run = run_backwards};
  content shared = make(&s->mesh, &options, &threads);
  assert_true(shared.corner_count > 0);
  check_same(move(&s->mesh, options, &threads), &shared);
  if (!is_thread_sanitized()) {
    check_same(make(&s->mesh, &options, NULL), &shared);
    check_same(make(&s->mesh, &options, &backwards), &shared);
    check_same(move(&s->mesh, options, &backwards), &shared);
    assert_int_equal(others, parts);
  }
  free_content(&shared);
  return parts;
}

enum { FIN = 1, CREASED = 2, MAPPED = 4, LIVELY = 8 }; /* with normals, of another creasing and boundary */

static void check_all(uint32_t side, kind kind, tw_surface_options options) {
  static const int cases[] = {0, FIN, CREASED, MAPPED, LIVELY, CREASED | MAPPED | LIVELY, FIN | MAPPED};
  uint32_t parts = 0;
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    sheet s = new_sheet(side, kind, cases[i] & FIN);
    if (cases[i] & CREASED) crease(&s, side);
    if (cases[i] & MAPPED) map(&s);
    bool lively = cases[i] & LIVELY;
    options.creasing = lively ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM;
    options.boundary = lively ? TW_BOUNDARY_EDGE_ONLY : TW_BOUNDARY_EDGE_AND_CORNER;
    options.normals = lively;
    parts += check(&s, options);
    options.boundary = TW_BOUNDARY_OPEN;
    if (cases[i] & CREASED) parts += check(&s, options);
    free_sheet(&s);
  }
  assert_true(parts > 25);
}

/* ---- tests ---------------------------------------------------------------------------------- */

TEST(loop_surfaces_are_the_same) {
  check_all(24, TRIANGLES, (tw_surface_options){.level = 3, .scheme = TW_LOOP});
}

TEST(catmull_clark_surfaces_of_mixed_cages_are_the_same) {
  check_all(44, MIXED, (tw_surface_options){.level = 2});
}

TEST(bilinear_surfaces_are_the_same) {
  check_all(44, MIXED, (tw_surface_options){.level = 2, .scheme = TW_BILINEAR});
}

/* Levels that are read straight from the cage. */
TEST(shallow_surfaces_are_the_same) {
  enum { SIDE = 100 };
  sheet s = new_sheet(SIDE, TRIANGLES, false);
  join(&s, SIDE);
  for (uint32_t level = 1; level <= 2; level++)
    for (int normals = 0; normals < 2; normals++)
      assert_true(check(&s, (tw_surface_options){.level = level, .normals = normals}) >= 4);
  free_sheet(&s);
}

/* Normals of an open border look at differences in double. */
TEST(points_refined_in_double_are_the_same) {
  sheet s = new_sheet(24, MIXED, false);
  crease(&s, 24);
  assert_true(check(&s, (tw_surface_options){.level = 3, .boundary = TW_BOUNDARY_OPEN, .normals = true}) > 1);
  free_sheet(&s);
}

/* ---- giving up ------------------------------------------------------------------------------------------
 */

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

static void run_in_order(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                         void *context) {
  (void)owner;
  for (uint32_t i = 0; i < count; i++) part(context, i);
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
  static const tw_surface_options options[] = {
      {.level = 2}, {.level = 4}, {.level = 3, .scheme = TW_LOOP}, {.level = 3, .scheme = TW_BILINEAR}};
  static const uint32_t least[] = {7, 2, 4, 2};
  sheet s = new_sheet(24, TRIANGLES, false);
  map(&s);
  for (size_t i = 0; i < sizeof options / sizeof *options; i++)
    assert_true(cancel_each(&s.mesh, &options[i]) >= least[i]);
  free_sheet(&s);
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
  const tw_surface_options shallow = {.level = 4}, deep = {.level = 9};
  uint32_t making, bounds, more, deeper;
  sheet s = new_sheet(8, TRIANGLES, false), large = new_sheet(80, TRIANGLES, false);
  map(&s);
  map(&large);
  count_questions(&s.mesh, &shallow, &making, &bounds);
  count_questions(&large.mesh, &shallow, &more, &deeper);
  assert_true(more >= making + 2 * (large.mesh.corner_count / 4096 - 1));
  count_questions(&s.mesh, &deep, &making, &deeper);
  assert_int_equal(bounds, 1);
  assert_true(deeper >= s.mesh.corner_count / 32); /* 65,536 rows a quad of the first level */
  free_sheet(&s);
  free_sheet(&large);
}

TEST(bounds_that_are_not_wanted_any_more_are_given_up_and_found_later) {
  sheet s = new_sheet(8, TRIANGLES, false);
  tw_surface *surface;
  float min[3], max[3], wanted[2][3];
  const tw_surface_options options = {.level = 9};
  assert_int_equal(tw_surface_create(&s.mesh, &options, &surface, NULL), TW_OK);
  for (uint32_t left = 0; left < 3; left++) {
    patience p = {.left = left};
    const tw_parallel_for parallel = {&p, run_in_order, is_over};
    assert_int_equal(tw_surface_bounds_by(surface, -1, &parallel, min, max), TW_CANCELLED);
  }
  assert_int_equal(tw_surface_bounds(surface, -1, min, max), TW_OK);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  float *points = malloc(rows * sizeof wanted[0]);
  assert_true(reader && points);
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, rows, points);
  memcpy(wanted[0], points, sizeof wanted[0]);
  memcpy(wanted[1], points, sizeof wanted[1]);
  for (uint64_t i = 0; i < 3 * rows; i++) {
    wanted[0][i % 3] = fminf(wanted[0][i % 3], points[i]);
    wanted[1][i % 3] = fmaxf(wanted[1][i % 3], points[i]);
  }
  assert_memory_equal(min, wanted[0], sizeof min);
  assert_memory_equal(max, wanted[1], sizeof max);
  free(points);
  tw_surface_reader_destroy(reader);
  tw_surface_destroy(surface);
  free_sheet(&s);
}
