/* From points that somebody has moved to the details that put them there. */
#include "tweend/detail.h"

#include <math.h>
#include <string.h>

#include "surface.h"

/* Deeper details turn with the level, and with them its points: they are met in a few rounds. */
enum { ROUNDS_MAX = 16 };
static const double MISS_MAX = 1e-7; /* of the mesh's size */

typedef struct sculpting {
  const tw_surface_options *options;
  const tw_parallel_for *parallel;
  const float *wanted; /* [rows][3] */
  uint32_t rows;
  uint32_t *vertices; /* [rows] */
  double size;
  tw_detail_frames *frames; /* above level 0 */
  float *offsets;           /* of the level's vertices; at level 0 the mesh's positions, by points */
  const uint32_t *point_of; /* of level 0, or NULL */
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

static double size_of(const float *positions, uint32_t count) {
  double size = 0;
  for (int axis = 0; axis < 3; axis++) {
    float least = INFINITY, most = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      least = fminf(least, positions[3 * i + (size_t)axis]);
      most = fmaxf(most, positions[3 * i + (size_t)axis]);
    }
    size = fmax(size, (double)most - (double)least);
  }
  return size;
}

/* The points as they are now: [rows][3]. */
static tw_status read_points(const sculpting *s, const tw_surface *surface, float *out) {
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  if (!reader) return TW_NO_MEMORY;
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, s->rows, out);
  tw_surface_reader_destroy(reader);
  return TW_OK;
}

/* The mesh with a detail of this level, whose offsets may still change; those that it has there are taken
 * over. */
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
  tw_detail_level level;
  tw_status status = tw_detail_level_of(mesh, s->options, s->parallel, s->scratch, &level, error);
  if (status != TW_OK) return status;
  tw_surface_vertices_of_points(surface, &level.topology, s->vertices);
  *out = *mesh;
  if (s->options->level > 0) {
    const tw_rules rules = tw_rules_of(s->options);
    tw_detail_level *kept = tw_arena_alloc(s->scratch, 1, sizeof *kept);
    if (!kept) return TW_NO_MEMORY;
    *kept = level;
    status = tw_detail_frames_create(kept, &rules, s->scratch, &s->frames);
    return status == TW_OK ? add_detail(s, mesh, level.topology.vertex_count, arena, out) : status;
  }
  s->point_of = level.point_of;
  s->offsets = tw_arena_alloc_raw(arena, mesh->point_count, 3 * sizeof *s->offsets);
  if (!s->offsets) return TW_NO_MEMORY;
  memcpy(s->offsets, mesh->positions, 3 * (size_t)mesh->point_count * sizeof *s->offsets);
  out->positions = s->offsets;
  return TW_OK;
}

/* Moves what is still elsewhere towards where it should be. *miss: the greatest distance before. */
static tw_status take_round(sculpting *s, const float *now, double *miss, tw_error *error) {
  *miss = 0;
  for (uint32_t row = 0; row < s->rows; row++) {
    double by[3], distance = 0;
    uint32_t vertex = s->vertices[row];
    for (size_t c = 0; c < 3; c++) {
      by[c] = (double)s->wanted[3 * (size_t)row + c] - (double)now[3 * (size_t)row + c];
      distance = fmax(distance, fabs(by[c]));
    }
    if (!(distance > 0)) continue;
    *miss = fmax(*miss, distance);
    if (s->options->level == 0) {
      float *point = s->offsets + 3 * (size_t)(s->point_of ? s->point_of[vertex] : vertex);
      for (int c = 0; c < 3; c++) point[c] = (float)((double)point[c] + by[c]);
    } else if (!tw_detail_move(s->frames, vertex, by, s->offsets + 3 * (size_t)vertex)) {
      tw_fail(error, TW_INVALID, "the point is too far from the surface");
      return tw_error_at(error, "/positions/%u", row);
    }
  }
  return TW_OK;
}

/* The rounds after the first, which has met the points where no deeper detail moves them. */
static tw_status meet_points(sculpting *s, tw_mesh *mesh, float *now, tw_error *error) {
  double miss = INFINITY, before = INFINITY;
  bool has_deeper = mesh->detail_count > 0 && mesh->details[mesh->detail_count - 1].level > s->options->level;
  for (int round = 1; has_deeper && round < ROUNDS_MAX && miss > MISS_MAX * s->size; round++) {
    tw_surface *surface;
    tw_status status = tw_surface_create_by(mesh, s->options, s->parallel, &surface, error);
    if (status != TW_OK) return status;
    status = read_points(s, surface, now);
    tw_surface_destroy(surface);
    if (status == TW_OK) status = take_round(s, now, &miss, error);
    if (status != TW_OK) return status;
    if (miss > before) break; /* it gets no nearer */
    before = miss;
  }
  return TW_OK;
}

static tw_status sculpt(sculpting *s, const tw_mesh *mesh, const tw_surface *surface, tw_arena *arena,
                        tw_mesh *out, tw_error *error) {
  float *now = tw_arena_alloc_raw(s->scratch, s->rows, 3 * sizeof *now);
  s->vertices = tw_arena_alloc_raw(s->scratch, s->rows, sizeof *s->vertices);
  if (!now || !s->vertices) return TW_NO_MEMORY;
  tw_status status = check_positions(s, error);
  if (status == TW_OK) status = read_points(s, surface, now);
  if (status != TW_OK) return status;
  s->size = size_of(now, s->rows);
  *out = *mesh;
  if (memcmp(now, s->wanted, 3 * (size_t)s->rows * sizeof *now) == 0) return TW_OK;
  double miss;
  status = begin_level(s, mesh, surface, arena, out, error);
  if (status == TW_OK) status = take_round(s, now, &miss, error);
  return status == TW_OK ? meet_points(s, out, now, error) : status;
}

tw_status tw_mesh_sculpt(const tw_mesh *mesh, const tw_surface_options *options, const float *positions,
                         const tw_parallel_for *parallel, tw_arena *arena, tw_mesh *out, tw_error *error) {
  tw_surface *surface = NULL;
  tw_mesh sculpted;
  tw_status status = tw_surface_create_by(mesh, options, parallel, &surface, error);
  if (status != TW_OK) return status;
  sculpting s = {.options = options, .parallel = parallel, .wanted = positions};
  s.rows = (uint32_t)tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  s.scratch = tw_arena_create();
  status = s.scratch ? sculpt(&s, mesh, surface, arena, &sculpted, error) : TW_NO_MEMORY;
  tw_surface_destroy(surface);
  tw_arena_destroy(s.scratch);
  if (status == TW_OK) *out = sculpted;
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}
