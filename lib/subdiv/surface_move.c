/* One surface over many positions: the base of new ones is made by the steps that the plan was made by, in
 * the same arithmetic, so that not a bit tells how a surface came about. */
#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "refine.h"
#include "surface.h"

static uint32_t cage_vertices(const tw_surface *s) {
  if (s->step_count > 0) return s->steps[0].parent.vertex_count;
  return s->loop.levels > 0 ? s->loop.above.vertex_count : s->fields[0].base.vertex_count;
}

/* The middle of points that are farther from 0 than from each other, by coordinate; else 0. */
static tw_point far_origin(const tw_point *points, uint32_t count) {
  tw_point low = points[0], high = points[0], origin = {0};
  float extent = 0;
  for (uint32_t v = 1; v < count; v++)
    for (int c = 0; c < 3; c++) {
      if (points[v][c] < low[c]) low[c] = points[v][c];
      if (points[v][c] > high[c]) high[c] = points[v][c];
    }
  for (int c = 0; c < 3; c++) extent = fmaxf(extent, high[c] - low[c]);
  for (int c = 0; c < 3; c++) {
    float middle = low[c] / 2 + high[c] / 2;
    if (fabsf(middle) > extent) origin[c] = middle;
  }
  return origin;
}

tw_status tw_surface_refine_levels(const tw_surface *surface, const float *in, const uint32_t *of,
                                   const tw_parallel_for *parallel, tw_values *values) {
  const tw_levels *levels = &surface->levels[values->field];
  uint32_t count = levels->at[0].vertex_count, width = values->width;
  /* Normals and tangents are of the points before their limits. */
  bool sloped = values == &surface->positions ? surface->options.normals
                                              : values->field > 0 && surface->tangent_frames,
       apart = surface->options.limit && sloped;
  tw_point *cage = tw_alloc(count, sizeof *cage);
  values->refined = tw_alloc(tw_levels_points(levels), sizeof *values->refined);
  values->points = values->refined;
  if (surface->options.limit) values->points = tw_alloc(tw_levels_points(levels), sizeof *values->points);
  tw_status status = cage && values->refined && values->points ? TW_OK : TW_NO_MEMORY;
  for (uint32_t v = 0; status == TW_OK && v < count; v++) {
    cage[v] = (tw_point){0};
    memcpy(&cage[v], in + (size_t)width * (of ? of[v] : v), width * sizeof *in);
  }
  values->origin = (tw_point){0};
  if (status == TW_OK && values == &surface->positions) values->origin = far_origin(cage, count);
  for (uint32_t v = 0; status == TW_OK && v < count; v++) cage[v] -= values->origin;
  if (status == TW_OK) status = tw_levels_refine(levels, cage, parallel, values->refined);
  if (status == TW_OK && surface->options.limit)
    tw_levels_limit(levels, values->refined, parallel, values->points);
  free(cage);
  if (status != TW_OK || !surface->options.limit || apart) return status;
  free(values->refined);
  values->refined = values->points;
  return TW_OK;
}

/* Numbers that positions.base holds, or positions.exact. */
static size_t base_size(const tw_surface *s) {
  return 3 *
         (s->loop.levels > 0 ? tw_loop_rows_kept_count(&s->loop) : (size_t)s->fields[0].base.vertex_count);
}

/* Positions of the cage's vertices, where a level 0 has them; NULL without memory. */
static float *gather_cage(const tw_surface *s, const float *positions, const tw_parallel_for *parallel) {
  uint32_t count = cage_vertices(s);
  float *cage = tw_alloc(count, 3 * sizeof *cage);
  if (!cage) return NULL;
  tw_gather_rows(positions, s->point_of, count, 3 * sizeof *cage, cage);
  const tw_topology *t = s->step_count > 0 ? &s->steps[0].parent : &s->fields[0].base;
  const tw_detail_step step = {&s->details, t, &s->rules, 0, s->options.level};
  if (tw_details_add_floats(&step, parallel, cage) == TW_OK) return cage;
  free(cage);
  return NULL;
}

static uint32_t refined_count(const tw_surface *s, const tw_surface_step *step) {
  const tw_topology *p = &step->parent;
  return p->vertex_count + p->edge_count + tw_refine_face_points(p, &s->rules);
}

/* Adds what is modelled onto a level. */
static tw_status add_details(const tw_surface *s, uint32_t level, const tw_parallel_for *parallel,
                             double *positions) {
  const tw_topology *t = level < s->step_count ? &s->steps[level].parent : &s->fields[0].base;
  const tw_detail_step step = {&s->details, t, &s->rules, level, s->options.level};
  return tw_details_add(&step, parallel, positions);
}

/* The base from the cage, by the plan's steps; NULL without memory. */
static double *refine_cage(const tw_surface *s, const float *cage, const tw_parallel_for *parallel) {
  size_t count = 3 * (size_t)cage_vertices(s);
  double *at = tw_alloc(count, sizeof *at);
  for (size_t i = 0; at && i < count; i++) at[i] = (double)cage[i];
  for (uint32_t i = 0; at && i < s->step_count; i++) {
    const tw_surface_step *step = &s->steps[i];
    double *next = tw_alloc(refined_count(s, step), 3 * sizeof *next);
    if (next && (tw_refine_values(&step->parent, &s->rules, 3, at, parallel, next) != TW_OK ||
                 add_details(s, i + 1, parallel, next) != TW_OK)) {
      free(next);
      next = NULL;
    }
    if (next && step->kept) tw_gather_rows(next, step->kept, step->vertex_count, 3 * sizeof *next, next);
    free(at);
    at = next;
  }
  return at;
}

static tw_status move_base(tw_surface *s, const float *cage, const tw_parallel_for *parallel) {
  double *exact = refine_cage(s, cage, parallel);
  size_t count = 3 * (size_t)s->fields[0].base.vertex_count;
  float *base = exact ? tw_alloc(count, sizeof *base) : NULL;
  for (size_t i = 0; base && i < count; i++) base[i] = (float)exact[i];
  s->positions.base = base;
  if (base && s->options.normals && s->depth == 0)
    s->positions.exact = exact;
  else
    free(exact);
  return base ? TW_OK : TW_NO_MEMORY;
}

static tw_status move_loop(tw_surface *s, const float *cage, const tw_parallel_for *parallel) {
  double *points = refine_cage(s, cage, parallel);
  double *kept = points ? tw_alloc(base_size(s), sizeof *kept) : NULL;
  tw_status status = kept ? tw_loop_rows_keep(&s->loop, points, parallel, kept) : TW_NO_MEMORY;
  free(points);
  s->positions.exact = kept;
  return status;
}

static tw_status move_points(tw_surface *s, const float *positions, const tw_parallel_for *parallel) {
  if (s->way == TW_WAY_LEVELS)
    return tw_surface_refine_levels(s, positions, s->point_of, parallel, &s->positions);
  float *cage = gather_cage(s, positions, parallel);
  if (!cage) return TW_NO_MEMORY;
  if (s->loop.levels > 0) {
    tw_status status = move_loop(s, cage, parallel);
    free(cage);
    return status;
  }
  if (s->step_count == 0) {
    s->positions.cage = s->positions.base = cage;
    return TW_OK;
  }
  tw_status status = move_base(s, cage, parallel);
  if (s->options.level == 0)
    s->positions.cage = cage;
  else
    free(cage);
  return status;
}

tw_status tw_surface_with_positions_by(const tw_surface *plan, const float *positions,
                                       const tw_parallel_for *parallel, tw_surface **out) {
  assert(plan->options.movable);
  tw_surface *s = tw_alloc(1, sizeof *s);
  if (!s) return TW_NO_MEMORY;
  *s = *plan;
  if (!plan->plan) s->plan = plan;
  s->positions = (tw_values){.width = 3};
  s->bounds_ready = tw_alloc_zero(1, sizeof *s->bounds_ready);
  s->bounds = tw_alloc_zero(1, sizeof *s->bounds);
  tw_status status = s->bounds_ready && s->bounds ? move_points(s, positions, parallel) : TW_NO_MEMORY;
  if (status == TW_OK)
    *out = s;
  else
    tw_surface_destroy(s);
  return status;
}

tw_status tw_surface_morph(tw_surface *surface, const tw_mesh *mesh, const tw_parallel_for *parallel) {
  size_t count = 3 * (size_t)mesh->point_count;
  float *positions = tw_alloc(count, sizeof *positions);
  surface->morphed = tw_arena_alloc(surface->arena, mesh->morph_count, sizeof *surface->morphed);
  tw_status status = positions && surface->morphed ? TW_OK : TW_NO_MEMORY;
  for (uint32_t m = 0; m < mesh->morph_count && status == TW_OK; m++) {
    for (size_t i = 0; i < count; i++) {
      float moved = mesh->positions[i] + mesh->morphs[m][i];
      positions[i] = fmaxf(-TW_COORDINATE_MAX, fminf(moved, TW_COORDINATE_MAX));
    }
    status = tw_surface_with_positions_by(surface, positions, parallel, &surface->morphed[m]);
    if (status == TW_OK) tw_surface_bare_rows(surface->morphed[m], true);
  }
  free(positions);
  return status;
}

void tw_surface_free_moved(tw_surface *surface) {
  if (surface->positions.cage != surface->positions.base) free(surface->positions.cage);
  free(surface->positions.base);
  tw_values_free_points(&surface->positions);
  free(surface->positions.exact);
  free(surface->bounds_ready);
  free(surface->bounds);
  free(surface);
}

size_t tw_surface_size_moved(const tw_surface *surface) {
  const tw_values *positions = &surface->positions;
  size_t base = base_size(surface);
  size_t size = sizeof *surface + sizeof *surface->bounds_ready + sizeof *surface->bounds +
                tw_values_points_size(surface, positions);
  if (positions->base) size += base * sizeof *positions->base;
  if (positions->exact) size += base * sizeof *positions->exact;
  if (positions->cage && positions->cage != positions->base)
    size += 3 * (size_t)cage_vertices(surface) * sizeof *positions->cage;
  return size;
}
