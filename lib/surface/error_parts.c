/* Makes the levels that distances are measured on, and cuts parts out of them: what is around some faces. */
#include <math.h>
#include <string.h>

#include "surface_error.h"

enum { VERTICES_AT_ONCE = 1024, VERTEX_WORK = 256 }; /* between two charges of work */

/* Whether limit masks of this level are those of its scheme. */
static bool has_limit_masks(const tw_measuring *m, const tw_topology *t) {
  return m->rules.loop || m->rules.linear || t->face_size == 4;
}

double *tw_error_copy_points(const tw_error_part *p, const double *points) {
  size_t count = 3 * (size_t)p->topology.vertex_count;
  double *copy = tw_arena_alloc_raw(p->arena, count, sizeof *copy);
  if (copy) memcpy(copy, points, count * sizeof *copy);
  return copy;
}

/* Moves shown points to the limit. */
static tw_status push_to_limit(const tw_measuring *m, tw_error_part *p) {
  const tw_topology *t = &p->topology;
  tw_limit_entry *mask = tw_arena_alloc_raw(p->arena, tw_limit_greatest_capacity(t), sizeof *mask);
  double *limit = tw_error_copy_points(p, p->shown), to[3];
  if (!mask || !limit) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    if (v % VERTICES_AT_ONCE == 0 && !tw_work((uint64_t)VERTICES_AT_ONCE * VERTEX_WORK)) return TW_CANCELLED;
    uint32_t count = tw_limit_mask(t, m->rules.linear, t->fan_corners[t->fan_offsets[v]], mask);
    for (uint32_t i = 0; i < count; i++) {
      tw_difference3(tw_point_at(p->shown, mask[i].vertex), tw_point_at(p->shown, v), to);
      for (int c = 0; c < 3; c++) limit[3 * (size_t)v + (size_t)c] += (double)mask[i].position * to[c];
    }
  }
  p->shown = limit;
  return TW_OK;
}

/* Adds details, and finds the points that answers show. At a cage of polygons limits are those of the next
 * level: then p->shown is NULL. */
static tw_status show(const tw_measuring *m, tw_error_part *p) {
  tw_detail_step step = {&m->details, &p->topology, &m->rules, p->level, p->level};
  p->shown = p->control;
  if (p->level <= tw_deepest_detail(&m->details) && m->details.count > 0) {
    double *shown = tw_error_copy_points(p, p->control);
    tw_status status = shown ? tw_details_add(&step, m->parallel, shown) : TW_NO_MEMORY;
    step.answer = TW_LEVEL_MAX + 1; /* a deeper one, so that only the level's own detail is added */
    if (status == TW_OK) status = tw_details_add(&step, m->parallel, p->control);
    if (status != TW_OK) return status;
    p->shown = shown;
  }
  tw_status status = tw_error_find_rims(p);
  if (status != TW_OK || !m->options->limit || m->rules.linear) return status;
  if (has_limit_masks(m, &p->topology)) return push_to_limit(m, p);
  p->shown = NULL;
  return TW_OK;
}

tw_status tw_error_begin(tw_measuring *m, tw_error_part *p) {
  tw_surface_options options = *m->options;
  options.level = 1; /* of which faces the answer has */
  options.tagged = false;
  tw_cage cage;
  *p = (tw_error_part){.arena = tw_arena_create()};
  tw_status status = p->arena ? tw_cage_read(m->mesh, &options, p->arena, &cage) : TW_NO_MEMORY;
  if (status != TW_OK) return status;
  p->topology = cage.topology;
  p->states = cage.visible;
  for (uint32_t f = 0; f < cage.topology.face_count; f++) {
    p->states[f] = cage.visible[f] ? TW_FACE_OPEN : TW_FACE_HIDDEN;
    p->open_count += p->states[f] == TW_FACE_OPEN;
  }
  p->control = tw_arena_alloc_raw(p->arena, cage.topology.vertex_count, 3 * sizeof *p->control);
  if (!p->control) return TW_NO_MEMORY;
  tw_cage_gather(m->mesh->positions, cage.point_of, cage.topology.vertex_count, p->control);
  for (size_t i = 0; i < 3 * (size_t)cage.topology.vertex_count; i++)
    m->size = tw_greater(m->size, fabs(p->control[i]));
  return show(m, p);
}

tw_status tw_error_refine(const tw_measuring *m, const tw_error_part *p, tw_error_part *child) {
  *child = (tw_error_part){.arena = tw_arena_create(), .level = p->level + 1, .batch_level = p->batch_level};
  if (!child->arena) return TW_NO_MEMORY;
  tw_topology *t = &child->topology;
  tw_status status = tw_refine_topology(&p->topology, &m->rules, child->arena, m->parallel, t);
  if (status != TW_OK) return status;
  child->control = tw_arena_alloc_raw(child->arena, t->vertex_count, 3 * sizeof *child->control);
  child->states = tw_arena_alloc_raw(child->arena, t->face_count, 1);
  if (!child->control || !child->states) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < t->face_count; f++) {
    child->states[f] = p->states[m->rules.loop ? f / 4 : tw_corner_face(&p->topology, f)];
    child->open_count += child->states[f] >= TW_FACE_OPEN;
  }
  status = tw_refine_values(&p->topology, &m->rules, 3, p->control, m->parallel, child->control);
  return status == TW_OK ? show(m, child) : status;
}

uint32_t *tw_error_list_corners(const tw_error_part *p, int rows, uint32_t *count) {
  const tw_topology *t = &p->topology;
  uint8_t *touched = tw_arena_alloc(p->arena, t->vertex_count, 1);
  uint32_t *corners = tw_arena_alloc_raw(p->arena, t->corner_count, sizeof *corners), size = t->face_size;
  if (!touched || !corners) return NULL;
  for (uint32_t c = 0; c < t->corner_count; c++)
    if (p->states[c / size] >= TW_FACE_OPEN) touched[t->corner_vertex[c]] = 1;
  for (int row = 0; row < rows; row++) {
    *count = 0;
    for (uint32_t f = 0; f < t->face_count; f++) {
      bool is_listed = false;
      for (uint32_t i = 0; i < size; i++) is_listed |= touched[t->corner_vertex[size * f + i]];
      for (uint32_t i = 0; is_listed && i < size; i++) corners[(*count)++] = size * f + i;
    }
    for (uint32_t i = 0; i < *count; i++) touched[t->corner_vertex[corners[i]]] = 1;
  }
  return corners;
}

/* Copies what is known of faces and vertices. corners, vertices: those of `from`. */
static tw_status take_part(const tw_error_part *from, const uint32_t *corners, const uint32_t *vertices,
                           tw_error_part *out) {
  uint32_t size = from->topology.face_size, count = out->topology.vertex_count;
  double *shown = NULL;
  out->states = tw_arena_alloc_raw(out->arena, out->topology.face_count, 1);
  out->made = tw_arena_alloc_raw(out->arena, out->topology.face_count, sizeof *out->made);
  out->control = tw_arena_gather(out->arena, from->control, vertices, count, 3 * sizeof *out->control);
  out->is_rim = tw_arena_gather(out->arena, from->is_rim, vertices, count, 1);
  out->normals = tw_arena_gather(out->arena, from->normals, corners, out->topology.corner_count,
                                 3 * sizeof *out->normals);
  if (from->shown != from->control)
    shown = tw_arena_gather(out->arena, from->shown, vertices, count, 3 * sizeof *shown);
  out->shown = shown ? shown : out->control;
  if (!out->states || !out->made || !out->control || !out->is_rim || !out->normals ||
      (from->shown != from->control && !shown))
    return TW_NO_MEMORY;
  for (uint32_t f = 0; f < out->topology.face_count; f++) {
    uint32_t face = corners[(size_t)size * f] / size;
    out->states[f] = from->states[face];
    out->made[f] = tw_error_as_made(from, face);
  }
  return TW_OK;
}

tw_status tw_error_cut_out(const tw_measuring *m, const tw_error_part *p, const uint32_t *corners,
                           uint32_t count, tw_error_part *out) {
  const tw_topology *t = &p->topology;
  uint32_t *vertices;
  out->arena = tw_arena_create();
  if (!out->arena) return TW_NO_MEMORY;
  tw_status status =
      tw_topology_cut(t, count / t->face_size, NULL, count, corners, out->arena, &out->topology, &vertices);
  if (status == TW_OK && m->rules.chaikin) status = tw_topology_sum_semi(&out->topology, out->arena);
  return status == TW_OK ? take_part(p, corners, vertices, out) : status;
}

bool tw_error_can_cut(const tw_measuring *m, const tw_error_part *p) {
  if (p->topology.face_size == 0 || p->level < tw_deepest_detail(&m->details)) return false;
  return !m->rules.chaikin || !tw_limit_decays(&p->topology);
}

tw_status tw_error_cut(const tw_measuring *m, tw_error_part *p) {
  uint32_t count, *corners;
  if (!tw_error_can_cut(m, p)) return TW_OK;
  corners = tw_error_list_corners(p, 1, &count);
  if (!corners) return TW_NO_MEMORY;
  if (count > p->topology.corner_count / 4 * 3) return TW_OK;
  tw_error_part out = {.errors = p->errors,
                       .wholes = p->wholes,
                       .nexts = p->nexts,
                       .afters = p->afters,
                       .falls = p->falls,
                       .batch_level = p->batch_level,
                       .level = p->level,
                       .open_count = p->open_count};
  tw_status status = tw_error_cut_out(m, p, corners, count, &out);
  tw_arena_destroy(p->arena);
  *p = out;
  return status;
}
