/* Stencils: what they give is what splitting the patch gives, on every instruction set. */
#include "stencil.h"

#include <math.h>
#include <string.h>

#include "built_cage.h"
#include "cage.h"
#include "cube.h"
#include "shape.h"
#include "stencil.h"

enum { STRIDE = 11, DEPTH_MAX = TW_STENCIL_DEPTH_MAX, ROOM = (17 * 17 + 1) * STRIDE, PAIRS = 2000 };

static const float untouched = -77.5f;

static float bumps(float x, float y) {
  return sinf(2 * x + y) + 0.3f * cosf(3 * y);
}

/* Level 1 of a sheet of triangles, and its patches with stencils. */
typedef struct sheet {
  cage *cage;
  tw_arena *arena;
  tw_topology base;
  tw_rules rules;
  float *values[5]; /* by width */
  tw_patch_shapes *shapes;
  tw_patches patches;
  double *scratch;
} sheet;

static void fill_values(sheet *s, const tw_topology *parent) {
  for (uint32_t width = 2; width <= 4; width++) {
    float *in = tw_arena_alloc(s->arena, parent->vertex_count, width * sizeof *in);
    for (uint32_t v = 0; v < parent->vertex_count; v++)
      for (uint32_t c = 0; c < width; c++) in[v * width + c] = c < 3 ? s->cage->points[v][c] : (float)(v % 5);
    s->values[width] = tw_arena_alloc(s->arena, s->base.vertex_count, width * sizeof *in);
    tw_refine_values(parent, &s->rules, width, in, NULL, s->values[width]);
  }
}

static sheet new_sheet(float (*height)(float, float), float crease) {
  sheet s = {.cage = grid(9, 9, true, height), .arena = tw_arena_create()};
  assert_non_null(s.arena);
  static const uint32_t edges[6][2] = {{30, 31}, {31, 32}, {32, 33}, {39, 48}, {48, 57}, {57, 66}};
  static float sharpness[6];
  for (int i = 0; i < 6; i++) sharpness[i] = crease;
  s.cage->mesh.crease_count = crease > 0 ? 6 : 0;
  s.cage->mesh.crease_edges = edges[0];
  s.cage->mesh.crease_sharpness = sharpness;
  tw_surface_options options = {.level = 1};
  tw_cage read;
  assert_int_equal(tw_cage_read(&s.cage->mesh, &options, s.arena, &read), TW_OK);
  assert_int_equal(tw_refine_topology(&read.topology, &s.rules, s.arena, NULL, &s.base), TW_OK);
  fill_values(&s, &read.topology);
  return s;
}

static void plan(sheet *s, uint32_t depth, bool limit) {
  s->shapes = tw_patch_shapes_create();
  assert_non_null(s->shapes);
  assert_int_equal(tw_patches_create(&s->patches, &s->base, &s->rules, depth, s->shapes), TW_OK);
  assert_int_equal(tw_patches_sum(&s->patches, s->shapes, limit, true), TW_OK);
  s->scratch = calloc(s->patches.scratch_points, 4 * sizeof *s->scratch);
  assert_non_null(s->scratch);
}

static void free_plan(sheet *s) {
  tw_patches_deinit(&s->patches);
  tw_patch_shapes_destroy(s->shapes);
  free(s->scratch);
}

static void free_sheet(sheet *s) {
  tw_arena_destroy(s->arena);
  free(s->cage);
}

/* What readers ask for: a corner, the inside of a side, the inside. */
static tw_patch_rect rect_at(uint32_t n, uint32_t which) {
  const tw_patch_rect rects[9] = {{0, 0, 0, 0},     {n, n, 0, 0},     {n, n, n, n},
                                  {0, 0, n, n},     {1, n - 1, 0, 0}, {n, n, 1, n - 1},
                                  {1, n - 1, n, n}, {0, 0, 1, n - 1}, {1, n - 1, 1, n - 1}};
  return rects[which];
}

/* As tw_patch_evaluate, by splitting alone. */
static void evaluate_split(const tw_patches *patches, uint32_t quad, const tw_patch_job *job,
                           tw_patch_rect rect) {
  tw_patch *patch = &patches->patches[quad];
  bool summed = patch->summed;
  patch->summed = false;
  tw_patch_evaluate(patches, quad, job, rect);
  patch->summed = summed;
}

static void evaluate(const sheet *s, bool split, uint32_t quad, uint32_t width, bool limit, bool backwards,
                     tw_patch_rect rect, float *out) {
  tw_patch_job job = {.in = s->values[width],
                      .width = width,
                      .limit = limit,
                      .backwards = backwards,
                      .values = out,
                      .normals = width == 3 ? out + 4 : NULL,
                      .stride = STRIDE,
                      .scratch = s->scratch};
  for (size_t i = 0; i < ROOM; i++) out[i] = untouched;
  if (split)
    evaluate_split(&s->patches, quad, &job, rect);
  else
    tw_patch_evaluate(&s->patches, quad, &job, rect);
}

static void compare_quad(const sheet *s, uint32_t quad, uint32_t width, bool limit) {
  static float expected[ROOM], found[ROOM];
  for (uint32_t which = 0; which < 9; which++)
    for (int backwards = 0; backwards < 2; backwards++) {
      tw_patch_rect rect = rect_at(1u << s->patches.depth, which);
      evaluate(s, true, quad, width, limit, backwards, rect, expected);
      evaluate(s, false, quad, width, limit, backwards, rect, found);
      for (size_t i = 0; i < ROOM; i++) assert_true(fabsf(found[i] - expected[i]) < 3e-5f);
    }
}

TEST(stencils_give_what_splitting_gives) {
  static const float creases[] = {0, 1.5f, 10};
  for (int c = 0; c < 3; c++) {
    sheet s = new_sheet(bumps, creases[c]);
    for (uint32_t depth = 1; depth <= DEPTH_MAX; depth++)
      for (int limit = 0; limit < 2; limit++) {
        plan(&s, depth, limit);
        uint32_t with = 0;
        for (uint32_t quad = 0; quad < s.base.face_count; quad++) {
          if (!s.patches.patches[quad].summed) continue;
          with++;
          if (with % 13 == depth) compare_quad(&s, quad, 2 + with % 3, limit);
        }
        assert_true(with > 100);
        free_plan(&s);
      }
    free_sheet(&s);
  }
}

/* A sheet without an extent in one direction has no normals but those of last resort. */
static float upright(float x, float y) {
  return 0 * x + 0 * y;
}

TEST(collapsed_patches_have_the_normals_of_splitting) {
  sheet s = new_sheet(upright, 0);
  for (uint32_t v = 0; v < s.base.vertex_count; v++) s.values[3][3 * v] = 0.25f;
  plan(&s, 2, false);
  for (uint32_t quad = 0; quad < s.base.face_count; quad++)
    if (s.patches.patches[quad].summed && quad % 5 == 0) compare_quad(&s, quad, 3, false);
  free_plan(&s);
  free_sheet(&s);
}

/* The class of a smooth quad counts its points in the order in which they are collected. */
TEST(smooth_points_come_in_the_order_of_the_class) {
  sheet s = new_sheet(bumps, 0);
  tw_patch_shapes *shapes = tw_patch_shapes_create();
  tw_collector *collector = tw_collector_create(&s.base, false);
  uint8_t *faces = calloc(s.base.vertex_count, 1);
  assert_true(shapes && collector && faces);
  for (uint32_t v = 0; v < s.base.vertex_count; v++) faces[v] = tw_vertex_smooth_faces(&s.base, v);
  uint32_t smooth = 0;
  for (uint32_t corner = 0; corner < s.base.corner_count; corner++) {
    bool all = true;
    for (uint32_t k = 0; k < 4; k++) all = all && faces[s.base.corner_vertex[corner / 4 * 4 + k]];
    if (!all) continue;
    smooth++;
    tw_patch_class *shape;
    const uint32_t *expected;
    uint32_t found[TW_SMOOTH_POINTS_MAX];
    assert_int_equal(tw_patch_classify(shapes, collector, corner, 1, &shape, &expected), TW_OK);
    assert_int_equal(tw_patch_smooth_points(&s.base, corner, faces, found), shape->point_count);
    assert_memory_equal(found, expected, shape->point_count * sizeof *found);
  }
  assert_true(smooth > 1000);
  tw_collector_destroy(collector);
  free(faces);
  tw_patch_shapes_destroy(shapes);
  free_sheet(&s);
}

/* ---- the kernels ---------------------------------------------------------------------------- */

/* A stencil of the sheet, and the control points of one of its patches. */
static const tw_stencil *stencil_of(const sheet *s, float points[TW_STENCIL_CONTROLS_MAX][4]) {
  uint32_t quad = 0, count;
  while (!s->patches.patches[quad].summed) quad++;
  const uint32_t *controls = tw_patch_controls(&s->patches, quad, &count);
  for (uint32_t i = 0; i < count; i++)
    for (uint32_t c = 0; c < 4; c++) points[i][c] = s->values[4][4 * controls[i] + c];
  return s->patches.patches[quad].shape->stencils[0][s->patches.depth];
}

static void clear(float *rows) {
  for (size_t i = 0; i < ROOM; i++) rows[i] = untouched;
}

/* What each instruction set writes for a job, and what it says of its normals; the first one's rows stay. */
static bool compare_sets(tw_stencil_job *job, bool joined, float out[2][ROOM]) {
  bool first = true, sure = true;
  for (uint32_t set = 0;; set++) {
    float *rows = out[set > 0];
    clear(rows);
    job->values = rows;
    if (job->width == 3) job->normals = rows + (joined ? 3 : 4);
    if (!tw_stencil_rows_by(set, job, &sure)) return first;
    if (set > 0) assert_memory_equal(out[0], out[1], sizeof out[0]);
    if (set > 0) assert_int_equal(sure, first);
    first = sure;
  }
}

/* Whether the normals of all points are sure by themselves: those of unused places are not. */
static bool all_sure(const tw_stencil_job *job) {
  static float rows[STRIDE];
  bool all = true;
  tw_stencil_job one = *job;
  one.count = one.lines = 1;
  one.values = NULL;
  one.normals = job->normals ? rows : NULL;
  for (uint32_t line = 0; line < job->lines; line++)
    for (uint32_t i = 0; i < job->count; i++) {
      one.first = job->first + line * job->apart + i;
      all = tw_stencil_rows(&one) && all;
    }
  return all;
}

/* Normals by themselves are those next to points. */
static void compare_normals(const tw_stencil_job *job, const float *rows) {
  static float apart[ROOM];
  tw_stencil_job alone = *job;
  alone.values = NULL;
  alone.normals = apart;
  tw_stencil_rows(&alone);
  for (uint32_t line = 0; line < job->lines; line++)
    for (uint32_t i = 0; i < job->count; i++) {
      ptrdiff_t place = (ptrdiff_t)line * job->line_step + (ptrdiff_t)i * job->step;
      assert_memory_equal(apart + place, rows + place + 3, 3 * sizeof(float));
    }
}

TEST(all_instruction_sets_write_the_same_bytes) {
  enum { PLACES = 97, GAP = 2, LINES = 3 };
  static float points[TW_STENCIL_CONTROLS_MAX][4], out[2][ROOM];
  uint32_t sure = 0, unsure = 0;
  sheet s = new_sheet(bumps, 0);
  plan(&s, 3, false);
  const tw_stencil *stencil = stencil_of(&s, points);
  for (uint32_t kind = 0; kind < 6; kind++)
    for (uint32_t first = 0; first < PLACES; first += 5)
      for (uint32_t count = 1; first + count <= PLACES; count += 3) {
        uint32_t apart = count + first % 3, lines = first + 2 * apart + count <= PLACES ? LINES : 1;
        bool joined = kind >= 3; /* normals next to points, of which they are no part otherwise */
        ptrdiff_t step = kind >= 4 ? 6 : STRIDE, gap = kind == 5 ? GAP : 0;
        tw_stencil_job job = {.stencil = stencil,
                              .first = first,
                              .count = count,
                              .lines = lines,
                              .apart = apart,
                              .controls = (const float(*)[4])points,
                              .origin = {1, 2, 3, 4},
                              .width = kind < 3 ? kind + 2 : 3,
                              .step = step,
                              .line_step = ((ptrdiff_t)count + gap) * step};
        bool all = compare_sets(&job, joined, out);
        assert_int_equal(all, all_sure(&job));
        sure += all;
        unsure += !all;
        if (joined) compare_normals(&job, out[0]);
        if (gap) assert_true(out[0][(ptrdiff_t)count * step] == untouched);
        assert_true(out[0][(ptrdiff_t)(lines - 1) * job.line_step + (ptrdiff_t)count * step] == untouched);
      }
  assert_true(sure > 900 && unsure > 900);
  free_plan(&s);
  free_sheet(&s);
}

/* grid: rows of all points. */
static void compare_rect(const tw_stencil_job *job, uint32_t depth, tw_patch_rect rect, const float *grid) {
  static float rows[ROOM];
  uint32_t side = (1u << depth) + 1, width = rect.i1 - rect.i0 + 1;
  tw_stencil_job part = *job;
  clear(rows);
  part.values = rows;
  part.normals = rows + 3;
  part.line_step = (ptrdiff_t)width * job->step;
  assert_true(tw_stencil_rect(&part, depth, rect));
  const float *row = rows;
  for (uint32_t j = rect.j0; j <= rect.j1; j++)
    for (uint32_t i = rect.i0; i <= rect.i1; i++, row += job->step)
      assert_memory_equal(row, grid + (ptrdiff_t)(j * side + i) * job->step, 6 * sizeof *row);
  assert_true(*row == untouched);
}

TEST(rectangles_are_parts_of_the_whole) {
  static float points[TW_STENCIL_CONTROLS_MAX][4], grid[ROOM];
  sheet s = new_sheet(bumps, 0);
  for (uint32_t depth = 1; depth <= DEPTH_MAX; depth++) {
    plan(&s, depth, false);
    uint32_t n = 1u << depth;
    for (ptrdiff_t step = 6; step < STRIDE; step += 4) {
      tw_stencil_job job = {.stencil = stencil_of(&s, points),
                            .controls = (const float(*)[4])points,
                            .width = 3,
                            .values = grid,
                            .normals = grid + 3,
                            .step = step,
                            .line_step = (ptrdiff_t)(n + 1) * step};
      for (uint32_t j = 0; j <= n; j++)
        for (uint32_t i = 0; i <= n; i++) {
          job.values = grid + (ptrdiff_t)(j * (n + 1) + i) * step;
          job.normals = job.values + 3;
          assert_true(tw_stencil_rect(&job, depth, (tw_patch_rect){i, i, j, j}));
        }
      const uint32_t bounds[] = {0, 1, n / 2, n - 1, n};
      for (uint32_t k = 0; k < 5 * 5 * 5 * 5; k++) {
        tw_patch_rect rect = {bounds[k % 5], bounds[k / 5 % 5], bounds[k / 25 % 5], bounds[k / 125]};
        if (rect.i0 <= rect.i1 && rect.j0 <= rect.j1) compare_rect(&job, depth, rect, grid);
      }
    }
    free_plan(&s);
  }
  free_sheet(&s);
}

/* ---- memory --------------------------------------------------------------------------------- */

/* Pairs of cubes apart from all others, so that each has classes of its own: by how sharp their edges are. */
typedef struct cubes {
  float points[8 * 2 * PAIRS][3], sharpness[2 * PAIRS][12];
  uint32_t offsets[6 * 2 * PAIRS + 1], corners[2 * PAIRS][24], edges[2 * PAIRS][24];
  tw_mesh mesh;
} cubes;

static void add_cube(cubes *c, uint32_t index) {
  static const uint32_t edges[24] = {0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4, 0, 4, 1, 5, 2, 6, 3, 7};
  memcpy(c->points + 8 * (size_t)index, cube_points, sizeof cube_points);
  for (uint32_t i = 0; i < 8; i++) c->points[8 * index + i][0] += 3 * (float)index;
  for (uint32_t i = 0; i < 24; i++) {
    c->corners[index][i] = 8 * index + cube_corners[i];
    c->edges[index][i] = 8 * index + edges[i];
  }
  for (uint32_t i = 0; i < 12; i++) c->sharpness[index][i] = 0.5f + (float)(index / 2) / 4096;
  for (uint32_t i = 1; i <= 6; i++) c->offsets[6 * index + i] = 24 * index + cube_offsets[i];
}

static cubes *new_cubes(void) {
  cubes *c = calloc(1, sizeof *c);
  assert_non_null(c);
  for (uint32_t i = 0; i < 2 * PAIRS; i++) add_cube(c, i);
  tw_mesh_init(&c->mesh);
  c->mesh.point_count = 8 * 2 * PAIRS;
  c->mesh.positions = c->points[0];
  c->mesh.face_count = 6 * 2 * PAIRS;
  c->mesh.corner_count = 24 * 2 * PAIRS;
  c->mesh.face_offsets = c->offsets;
  c->mesh.corners = c->corners[0];
  c->mesh.crease_count = 12 * 2 * PAIRS;
  c->mesh.crease_edges = c->edges[0];
  c->mesh.crease_sharpness = c->sharpness[0];
  return c;
}

TEST(stencils_of_one_mesh_stay_small) {
  const size_t most = 4 << 20, around = most / 4; /* what an arena has beside them */
  cubes *c = new_cubes();
  for (uint32_t level = 4; level <= DEPTH_MAX; level++) {
    tw_patch_shapes *shapes = tw_patch_shapes_create();
    tw_surface_options options = {.level = level, .normals = true, .shapes = shapes};
    tw_surface *surface;
    assert_int_equal(tw_surface_create(&c->mesh, &options, &surface, NULL), TW_OK);
    assert_in_range(tw_arena_size(tw_patch_shapes_stencils(shapes)), most - around, most + around);
    tw_surface_destroy(surface);
    tw_patch_shapes_destroy(shapes);
  }
  free(c);
}
