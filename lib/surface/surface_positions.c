/* Computes the positions of a surface from those of the mesh. The first positions and all later ones take the
 * same steps, so that surfaces over the same positions have the same bytes, however they were made. */
#include <assert.h>
#include <math.h>

#include "cage.h"
#include "evaluator.h"
#include "refine.h"

/* ---- steps ----------------------------------------------------------------------------------- */

/* Adds the detail of a level. */
static tw_status add_details(const tw_surface *s, uint32_t level, const tw_parallel_for *parallel,
                             double *positions) {
  const tw_detail_step step = {&s->details, &s->steps[level].topology, &s->rules, level, s->options.level};
  return s->details.count > 0 ? tw_details_add(&step, parallel, positions) : TW_OK;
}

/* Replaces the positions of a level by those of the next. */
static tw_status make_level(const tw_surface *s, uint32_t level, const tw_parallel_for *parallel,
                            double **positions) {
  const tw_topology *above = &s->steps[level - 1].topology;
  const tw_surface_step *step = &s->steps[level];
  uint32_t all = above->vertex_count + above->edge_count + tw_refine_face_points(above, &s->rules);
  double *next = tw_alloc(all, 3 * sizeof *next);
  tw_status status = next ? tw_refine_values(above, &s->rules, 3, *positions, parallel, next) : TW_NO_MEMORY;
  if (status == TW_OK && step->kept)
    tw_gather_rows(next, step->kept, step->topology.vertex_count, 3 * sizeof *next, next);
  if (status == TW_OK) status = add_details(s, level, parallel, next);
  if (status == TW_OK) status = tw_parallel_for_status(parallel);
  tw_free(*positions);
  *positions = next;
  return status;
}

/* Computes the positions of one part. Only a part whose faces are read needs to know how they are cut. */
static tw_status place(tw_surface *s, const float *positions, bool faces_are_read,
                       const tw_parallel_for *parallel) {
  s->positions.width = 3;
  double *at = tw_alloc(s->cage_vertex_count, 3 * sizeof *at);
  if (at) tw_cage_gather(positions, s->point_of, s->cage_vertex_count, at);
  tw_status status = at ? add_details(s, 0, parallel, at) : TW_NO_MEMORY;
  /* Of a rim all faces are looked at. */
  bool has_quads = s->options.level > 0 && s->options.scheme != TW_LOOP;
  bool is_base = s->step_count == 0 && s->steps[0].topology.face_size != 3;
  bool is_looked_at = faces_are_read && has_quads && !s->inner_faces;
  uint8_t *is_near = NULL;
  if (status == TW_OK && is_looked_at && !is_base) {
    status = tw_cage_find_concave(&s->steps[0].topology, at, &is_near);
    is_looked_at = is_near;
  }
  if (status == TW_OK && s->options.level == 0) {
    s->positions.cage = tw_surface_round_positions(at, s->cage_vertex_count);
    if (!s->positions.cage) status = TW_NO_MEMORY;
  }
  for (uint32_t level = 1; level <= s->step_count && status == TW_OK; level++)
    status = make_level(s, level, parallel, &at);
  if (status == TW_OK && is_looked_at) status = tw_surface_find_concave(s, is_near, at);
  tw_free(is_near);
  if (status == TW_OK) status = s->evaluator->place(s, &at, parallel);
  tw_free(at);
  if (status == TW_OK && faces_are_read && s->options.level == 0) status = tw_surface_cut_faces(s, parallel);
  return status;
}

tw_status tw_surface_place(tw_surface *surface, const float *positions, const tw_parallel_for *parallel) {
  tw_status status = place(surface, positions, true, parallel);
  return status == TW_OK && surface->rim ? tw_surface_place(surface->rim, positions, parallel) : status;
}

/* ---- other positions ------------------------------------------------------------------------- */

/* Makes one part of a surface with other positions. */
static tw_status move(const tw_surface *plan, const float *positions, bool faces_are_read,
                      const tw_parallel_for *parallel, tw_surface **out) {
  tw_surface *s = tw_alloc(1, sizeof *s);
  if (!s) return TW_NO_MEMORY;
  *s = *plan;
  if (!plan->plan) s->plan = plan;
  s->positions = (tw_values){0};
  s->rim = NULL;
  s->cuts = NULL;
  s->cut_triangles = NULL;
  s->cut_count = 0;
  s->cut_triangle_count = 0;
  s->near_concave = NULL;
  tw_status status = tw_surface_start_bounds(s);
  if (status == TW_OK) status = place(s, positions, faces_are_read, parallel);
  if (status == TW_OK)
    *out = s;
  else
    tw_surface_destroy(s);
  return status;
}

tw_status tw_surface_with_positions_by(const tw_surface *plan, const float *positions,
                                       const tw_parallel_for *parallel, tw_surface **out) {
  assert(plan->options.movable);
  tw_surface *s = NULL;
  tw_status status = move(plan, positions, true, parallel, &s);
  if (status == TW_OK && plan->rim) status = move(plan->rim, positions, true, parallel, &s->rim);
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
    status = move(surface, positions, false, parallel, &surface->morphed[m]);
    if (status != TW_OK) break;
    tw_surface_bare_rows(surface->morphed[m], true);
    status = tw_parallel_for_status(parallel);
  }
  tw_free(positions);
  return status == TW_OK && surface->rim ? tw_surface_morph(surface->rim, mesh, parallel) : status;
}
