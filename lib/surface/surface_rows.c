/* Numbers the rows of surfaces that are read from the base, from patches or from Loop's rows. */

#include "surface_plan.h"

/* Number of rows at vertices of the cage; they come first in every numbering. */
static uint32_t rows_of_cage(const tw_numbering *n, const tw_topology *base, uint32_t cage_vertices) {
  if (n->same_as) return cage_vertices;
  uint32_t count = 0;
  while (count < n->corner_count && base->corner_vertex[n->corner_base[count]] < cage_vertices) count++;
  return count;
}

static bool needs_splits(const tw_surface_builder *b) {
  const tw_surface *s = b->surface;
  if (s->evaluator->levels_below > 0) return false; /* bare points and normals */
  if (s->field_count > 1 || tw_has_own_normals(b->mesh, &s->options)) return true;
  return s->options.normals && (s->rules.linear || tw_topology_parts_normals(&b->topologies[0]));
}

static tw_status split_vertices(tw_surface_builder *b, const uint8_t *visible) {
  tw_surface *s = b->surface;
  const tw_topology *base = &s->fields[0].base;
  bool has_own = tw_has_own_normals(b->mesh, &s->options);
  tw_own_normals own = {.tangents = tw_builder_has_tangents(b), .morphs = b->morph_normals};
  tw_splits splits = {.channel_count = s->field_count - 1, .normals = s->options.normals};
  for (uint32_t i = 0; i < splits.channel_count; i++) splits.channels[i] = &s->fields[1 + i].base;
  /* On a bilinear surface every edge of the cage is sharp; its parts have the lowest numbers at each level,
   * unless the levels are cut. */
  if (s->rules.linear && tw_builder_shrinks(b))
    splits.sources = b->source;
  else if (s->rules.linear)
    splits.sharp_below = b->cage.topology.edge_count << b->levels;
  tw_status status = tw_builder_find_frames(b);
  if (status == TW_OK) status = tw_parallel_for_status(b->parallel);
  splits.tangent_frames = s->tangent_frames;
  if (status == TW_OK && has_own) {
    status = tw_own_normals_read(s, b->mesh, b->arena, &own);
    splits.own_normals = own.splits;
    splits.normals &= !own.is_whole; /* own normals alone decide where points are split */
  }
  if (status == TW_OK) status = tw_number_vertices(base, &splits, visible, s->arena, &s->vertices);
  if (status == TW_OK && has_own)
    status = tw_own_normals_keep(s, b->mesh, &own, rows_of_cage(&s->vertices, base, b->cage_vertices[0]));
  return status;
}

tw_status tw_builder_number(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  const tw_topology *base = &s->fields[0].base;
  uint8_t *visible = NULL;
  if (!b->keeps_all_faces) {
    visible = tw_alloc(base->face_count, 1);
    if (!visible) return TW_NO_MEMORY;
    for (uint32_t q = 0; q < base->face_count; q++)
      visible[q] = b->cage.visible[b->source[q]] && (!b->has_rim || b->part[q]);
  }
  tw_status status = tw_number_field(base, visible, s->arena, &s->points);
  if (status == TW_OK && b->point_order)
    status = tw_number_vertices_as(base, b->point_order, b->point_order_count, s->arena, &s->points);
  s->cage_points = rows_of_cage(&s->points, base, b->cage_vertices[0]);
  if (status == TW_OK && b->mesh->uv_set_count > 0) {
    status = tw_number_field(&s->fields[1].base, visible, s->arena, &s->uv_points);
    s->cage_uv_points = rows_of_cage(&s->uv_points, &s->fields[1].base, b->cage_vertices[1]);
  }
  if (status == TW_OK) status = tw_parallel_for_status(b->parallel);
  s->vertices = s->points;
  if (status == TW_OK && needs_splits(b)) status = split_vertices(b, visible);
  s->cage_vertices = rows_of_cage(&s->vertices, base, b->cage_vertices[0]);
  tw_free(visible);
  return status == TW_OK && b->inner ? tw_rim_number(b) : status;
}
