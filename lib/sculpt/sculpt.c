/* From moved points of a surface to the detail, or the positions, that put them there. */
#include "tweend/detail.h"

#include <math.h>
#include <string.h>

#include "surface.h"

/* Rounds of moving the level. Each round leaves a remainder of about the miss times the angle by which the
 * level turned the deeper frames. */
enum { ROUNDS = 2 };

typedef struct sculpting {
  const tw_surface_options *options;
  const tw_parallel_for *parallel;
  const float *wanted; /* [rows][3] */
  uint32_t rows;
  uint32_t *vertices; /* [rows] */
  tw_detail_level level;
  tw_detail_frames *frames; /* frames of the level; NULL at level 0 */
  /* [vertices of the level][3] offsets of its detail; at level 0 [points of the mesh][3] positions. */
  float *offsets;
  tw_arena *scratch;
} sculpting;

static tw_status check_positions(const sculpting *s, tw_error *error) {
  for (size_t i = 0; i < 3 * (size_t)s->rows; i++) {
    if (fabsf(s->wanted[i]) <= TW_COORDINATE_MAX) continue;
    tw_fail(error, TW_INVALID, "a coordinate is not a number, or over %g", (double)TW_COORDINATE_MAX);
    return tw_error_at(error, "/positions/%zu/%zu", i / 3, i % 3);
  }
  return TW_OK;
}

/* Reads the points of the surface as they are now: [rows][3]. */
static tw_status read_points(const sculpting *s, const tw_surface *surface, float *out) {
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  if (!reader) return TW_NO_MEMORY;
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, s->rows, out);
  tw_surface_reader_destroy(reader);
  return TW_OK;
}

/* Adds a detail of this level, whose offsets will still change, to the mesh; offsets that the mesh has at
 * this level are taken over. */
static tw_status add_detail(sculpting *s, const tw_mesh *mesh, uint32_t vertices, tw_arena *arena,
                            tw_mesh *out) {
  uint32_t level = s->options->level, count = mesh->detail_count, at = 0;
  tw_detail *details = tw_arena_alloc(arena, (size_t)count + 1, sizeof *details);
  s->offsets = tw_arena_alloc(arena, vertices, 3 * sizeof *s->offsets);
  if (!details || !s->offsets) return TW_NO_MEMORY;
  while (at < count && mesh->details[at].level < level) at++;
  bool has_own = at < count && mesh->details[at].level == level;
  if (has_own) memcpy(s->offsets, mesh->details[at].offsets, 3 * (size_t)vertices * sizeof *s->offsets);
  for (uint32_t i = 0; i < count; i++) details[i < at || has_own ? i : i + 1] = mesh->details[i];
  details[at] = (tw_detail){level, vertices, s->offsets};
  out->details = details;
  out->detail_count = count + !has_own;
  return TW_OK;
}

static tw_status begin_level(sculpting *s, const tw_mesh *mesh, const tw_surface *surface, tw_arena *arena,
                             tw_mesh *out, tw_error *error) {
  tw_status status = tw_detail_level_of(mesh, s->options, s->parallel, s->scratch, &s->level, error);
  if (status != TW_OK) return status;
  tw_surface_vertices_of_points(surface, &s->level.topology, s->vertices);
  *out = *mesh;
  if (s->options->level > 0) {
    const tw_rules rules = tw_rules_of(s->options);
    status = tw_detail_frames_create(&s->level, &rules, s->scratch, &s->frames);
    return status == TW_OK ? add_detail(s, mesh, s->level.topology.vertex_count, arena, out) : status;
  }
  s->offsets = tw_arena_alloc_raw(arena, mesh->point_count, 3 * sizeof *s->offsets);
  if (!s->offsets) return TW_NO_MEMORY;
  memcpy(s->offsets, mesh->positions, 3 * (size_t)mesh->point_count * sizeof *s->offsets);
  out->positions = s->offsets;
  out->normals = (tw_corner_normals){0}; /* they were the normals of the unmoved cage */
  out->morph_normals = NULL;
  return TW_OK;
}

/* by: the vector from where the row is to where it should be. Returns false where that is 0. */
static bool find_miss(const sculpting *s, const float *now, uint32_t row, double by[3]) {
  bool misses = false;
  for (size_t c = 0; c < 3; c++) {
    by[c] = (double)s->wanted[3 * (size_t)row + c] - (double)now[3 * (size_t)row + c];
    misses |= by[c] != 0;
  }
  return misses;
}

static tw_status fail_far(uint32_t row, tw_error *error) {
  tw_fail(error, TW_INVALID, "the point is too far from the surface");
  return tw_error_at(error, "/positions/%u", row);
}

/* Returns false where the point is over TW_COORDINATE_MAX then. */
static bool move_point(const double by[3], float point[3]) {
  bool fits = true;
  for (int c = 0; c < 3; c++) {
    point[c] = (float)((double)point[c] + by[c]);
    fits &= fabsf(point[c]) <= TW_COORDINATE_MAX;
  }
  return fits;
}

/* Moves the level's vertices by what their rows miss. */
static tw_status move_level(sculpting *s, const float *now, tw_error *error) {
  for (uint32_t row = 0; row < s->rows; row++) {
    double by[3];
    uint32_t vertex = s->vertices[row];
    if (!find_miss(s, now, row, by)) continue;
    bool fits;
    if (s->options->level == 0)
      fits =
          move_point(by, s->offsets + 3 * (size_t)(s->level.point_of ? s->level.point_of[vertex] : vertex));
    else
      fits = tw_detail_move(s->frames, vertex, by, s->offsets + 3 * (size_t)vertex);
    if (!fits) return fail_far(row, error);
  }
  return TW_OK;
}

/* Moves the same vertices on the deepest level with a detail, on whose offsets no frame depends. */
static tw_status move_deepest(sculpting *s, const float *now, tw_arena *arena, tw_mesh *mesh,
                              tw_error *error) {
  uint32_t last = mesh->detail_count - 1;
  tw_surface_options options = *s->options;
  options.level = mesh->details[last].level;
  const tw_rules rules = tw_rules_of(&options);
  tw_detail_level level;
  tw_detail_frames *frames;
  tw_status status = tw_detail_level_of(mesh, &options, s->parallel, s->scratch, &level, error);
  if (status == TW_OK) status = tw_detail_frames_create(&level, &rules, s->scratch, &frames);
  if (status != TW_OK) return status;
  size_t count = 3 * (size_t)mesh->details[last].vertex_count;
  tw_detail *details = tw_arena_alloc(arena, mesh->detail_count, sizeof *details);
  float *offsets = tw_arena_alloc_raw(arena, count, sizeof *offsets);
  if (!details || !offsets) return TW_NO_MEMORY;
  memcpy(details, mesh->details, mesh->detail_count * sizeof *details);
  memcpy(offsets, details[last].offsets, count * sizeof *offsets);
  for (uint32_t row = 0; row < s->rows; row++) {
    double by[3];
    uint32_t vertex = s->vertices[row];
    if (find_miss(s, now, row, by) && !tw_detail_move(frames, vertex, by, offsets + 3 * (size_t)vertex))
      return fail_far(row, error);
  }
  details[last].offsets = offsets;
  mesh->details = details;
  return TW_OK;
}

static tw_status read_anew(const sculpting *s, const tw_mesh *mesh, float *now, tw_error *error) {
  tw_surface *surface;
  tw_status status = tw_surface_create_by(mesh, s->options, s->parallel, &surface, error);
  if (status != TW_OK) return status;
  status = read_points(s, surface, now);
  tw_surface_destroy(surface);
  return status;
}

/* Makes the points meet exactly where deeper details exist: these turn with the level and move the points
 * again. Some rounds move the level; what then remains is moved on the deepest level alone. */
static tw_status meet_points(sculpting *s, float *now, tw_arena *arena, tw_mesh *mesh, tw_error *error) {
  bool has_deeper = mesh->detail_count > 0 && mesh->details[mesh->detail_count - 1].level > s->options->level;
  for (int round = 0; has_deeper && round <= ROUNDS; round++) {
    tw_status status = read_anew(s, mesh, now, error);
    if (status == TW_OK)
      status = round < ROUNDS ? move_level(s, now, error) : move_deepest(s, now, arena, mesh, error);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

static tw_status sculpt(sculpting *s, const tw_mesh *mesh, const tw_surface *surface,
                        const tw_points_back *back, tw_arena *arena, tw_mesh *out, tw_error *error) {
  float *now = tw_arena_alloc_raw(s->scratch, s->rows, 3 * sizeof *now);
  s->vertices = tw_arena_alloc_raw(s->scratch, s->rows, sizeof *s->vertices);
  if (!now || !s->vertices) return TW_NO_MEMORY;
  tw_status status = read_points(s, surface, now);
  if (status == TW_OK && back) back->take(back->context, now, s->rows);
  if (status == TW_OK) status = check_positions(s, error);
  if (status != TW_OK) return status;
  *out = *mesh;
  uint32_t row = 0;
  double by[3];
  while (row < s->rows && !find_miss(s, now, row, by)) row++;
  if (row == s->rows) return TW_OK;
  status = begin_level(s, mesh, surface, arena, out, error);
  if (status == TW_OK) status = move_level(s, now, error);
  return status == TW_OK ? meet_points(s, now, arena, out, error) : status;
}

tw_status tw_mesh_sculpt(const tw_mesh *mesh, const tw_surface_options *options, const float *positions,
                         const tw_points_back *back, const tw_parallel_for *parallel, tw_arena *arena,
                         tw_mesh *out, tw_error *error) {
  tw_surface *surface = NULL;
  tw_mesh sculpted;
  tw_status status = tw_surface_create_by(mesh, options, parallel, &surface, error);
  if (status != TW_OK) return status;
  sculpting s = {.options = options, .parallel = parallel, .wanted = positions};
  s.rows = (uint32_t)tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  s.scratch = tw_arena_create();
  status = s.scratch ? sculpt(&s, mesh, surface, back, arena, &sculpted, error) : TW_NO_MEMORY;
  tw_surface_destroy(surface);
  tw_arena_destroy(s.scratch);
  if (status == TW_OK) *out = sculpted;
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}
