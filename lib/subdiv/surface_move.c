/* One surface over many positions: the base of new ones is made by the steps that the plan was made by, in
 * the same arithmetic, so that not a bit tells how a surface came about. */
#include <assert.h>
#include <stdlib.h>

#include "loop.h"
#include "refine_mask.h"
#include "surface.h"

static uint32_t cage_vertices(const tw_surface *s) {
  if (s->step_count > 0) return s->steps[0].parent.vertex_count;
  return s->loop.levels > 0 ? s->loop.above.vertex_count : s->fields[0].base.vertex_count;
}

/* Numbers that positions.base holds, or positions.exact. */
static size_t base_size(const tw_surface *s) {
  if (s->shallow.level > 0) return tw_shallow_kept_size(&s->shallow);
  return 3 *
         (s->loop.levels > 0 ? tw_loop_rows_kept_count(&s->loop) : (size_t)s->fields[0].base.vertex_count);
}

/* Positions of the cage's vertices; NULL without memory. */
static float *gather_cage(const tw_surface *s, const float *positions) {
  uint32_t count = cage_vertices(s);
  float *cage = tw_alloc(count, 3 * sizeof *cage);
  if (cage) tw_gather_rows(positions, s->point_of, count, 3 * sizeof *cage, cage);
  return cage;
}

static uint32_t refined_count(const tw_surface *s, const tw_surface_step *step) {
  const tw_topology *p = &step->parent;
  return p->vertex_count + p->edge_count + (s->options.scheme == TW_LOOP ? 0 : p->face_count);
}

/* The base from the cage by at least one step; NULL without memory. */
static float *refine_floats(const tw_surface *s, const float *cage, const tw_parallel_for *parallel) {
  float *at = NULL;
  for (uint32_t i = 0; i < s->step_count; i++) {
    const tw_surface_step *step = &s->steps[i];
    float *next = tw_alloc(refined_count(s, step), 3 * sizeof *next);
    if (next) tw_refine_values(&step->parent, &s->rules, 3, at ? at : cage, parallel, next);
    if (next && step->kept) tw_gather_rows(next, step->kept, step->vertex_count, 3 * sizeof *next, next);
    free(at);
    if (!next) return NULL;
    at = next;
  }
  return at;
}

tw_status tw_surface_refine_exact(const tw_surface *surface, const tw_topology *parent, const tw_rules *rules,
                                  uint32_t width, const double *in, const tw_parallel_for *parallel,
                                  double *out) {
  if (surface->options.scheme != TW_LOOP) return tw_refine_exact(parent, rules, width, in, parallel, out);
  tw_loop_values(parent, rules, width, in, parallel, out);
  return TW_OK;
}

/* The same in double. */
static double *refine_doubles(const tw_surface *s, const float *cage, const tw_parallel_for *parallel) {
  size_t count = 3 * (size_t)cage_vertices(s);
  double *at = tw_alloc(count, sizeof *at);
  for (size_t i = 0; at && i < count; i++) at[i] = (double)cage[i];
  for (uint32_t i = 0; at && i < s->step_count; i++) {
    const tw_surface_step *step = &s->steps[i];
    double *next = tw_alloc(refined_count(s, step), 3 * sizeof *next);
    if (next && tw_surface_refine_exact(s, &step->parent, &s->rules, 3, at, parallel, next) != TW_OK) {
      free(next);
      next = NULL;
    }
    if (next && step->kept) tw_gather_rows(next, step->kept, step->vertex_count, 3 * sizeof *next, next);
    free(at);
    at = next;
  }
  return at;
}

static tw_status move_exactly(tw_surface *s, const float *cage, const tw_parallel_for *parallel) {
  double *exact = refine_doubles(s, cage, parallel);
  size_t count = 3 * (size_t)s->fields[0].base.vertex_count;
  float *base = exact ? tw_alloc(count, sizeof *base) : NULL;
  for (size_t i = 0; base && i < count; i++) base[i] = (float)exact[i];
  s->positions.base = base;
  if (base && s->options.normals)
    s->positions.exact = exact;
  else
    free(exact);
  return base ? TW_OK : TW_NO_MEMORY;
}

/* points: of what rows are made of; point_of: as for tw_shallow_keep. */
static tw_status keep_shallow(tw_surface *s, const float *points, const uint32_t *point_of,
                              const tw_parallel_for *parallel) {
  float *kept = tw_alloc(tw_shallow_kept_size(&s->shallow), sizeof *kept);
  s->positions.base = kept;
  return kept ? tw_shallow_keep(&s->shallow, points, point_of, parallel, kept) : TW_NO_MEMORY;
}

static tw_status move_shallow(tw_surface *s, const float *positions, const tw_parallel_for *parallel) {
  if (s->step_count == 0) return keep_shallow(s, positions, s->point_of, parallel);
  float *cage = gather_cage(s, positions), *points = cage ? refine_floats(s, cage, parallel) : NULL;
  tw_status status = points ? keep_shallow(s, points, NULL, parallel) : TW_NO_MEMORY;
  free(cage);
  free(points);
  return status;
}

static tw_status move_loop(tw_surface *s, const float *cage, const tw_parallel_for *parallel) {
  double *points = refine_doubles(s, cage, parallel);
  double *kept = points ? tw_alloc(base_size(s), sizeof *kept) : NULL;
  tw_status status = kept ? tw_loop_rows_keep(&s->loop, points, parallel, kept) : TW_NO_MEMORY;
  free(points);
  s->positions.exact = kept;
  return status;
}

static tw_status move_points(tw_surface *s, const float *positions, const tw_parallel_for *parallel) {
  if (s->shallow.level > 0) return move_shallow(s, positions, parallel);
  float *cage = gather_cage(s, positions);
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
  tw_status status = TW_OK;
  if (s->exact)
    status = move_exactly(s, cage, parallel);
  else if (!(s->positions.base = refine_floats(s, cage, parallel)))
    status = TW_NO_MEMORY;
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

tw_status tw_surface_with_positions(const tw_surface *plan, const float *positions, tw_surface **out) {
  return tw_surface_with_positions_by(plan, positions, NULL, out);
}

void tw_surface_free_moved(tw_surface *surface) {
  if (surface->positions.cage != surface->positions.base) free(surface->positions.cage);
  free(surface->positions.base);
  free(surface->positions.exact);
  free(surface->bounds_ready);
  free(surface->bounds);
  free(surface);
}

size_t tw_surface_size_moved(const tw_surface *surface) {
  const tw_values *positions = &surface->positions;
  size_t base = base_size(surface);
  size_t size = sizeof *surface + sizeof *surface->bounds_ready + sizeof *surface->bounds;
  if (positions->base) size += base * sizeof *positions->base;
  if (positions->exact) size += base * sizeof *positions->exact;
  if (positions->cage && positions->cage != positions->base)
    size += 3 * (size_t)cage_vertices(surface) * sizeof *positions->cage;
  return size;
}
