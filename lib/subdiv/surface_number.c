/* The rows of a surface's base: which vertices they are, and what stands in them. */
#include "surface_build.h"

#include <stdlib.h>

#include "tangent_space.h"

/* Rows that stand for vertices of the cage: they come first in every numbering. */
static uint32_t rows_of_cage(const tw_numbering *n, const tw_topology *base, uint32_t cage_vertices) {
  if (n->same_as) return cage_vertices;
  uint32_t count = 0;
  while (count < n->corner_count && base->corner_vertex[n->corner_base[count]] < cage_vertices) count++;
  return count;
}

static bool needs_splits(const tw_build *b, bool split_normals) {
  if (b->mesh->uv_set_count > 0) return true;
  return split_normals && (b->rules.linear || tw_topology_parts_normals(&b->topologies[0]));
}

tw_status tw_build_find_frames(tw_build *b, const float *const uvs[]) {
  tw_surface *s = b->surface;
  const uint8_t *sets = b->mesh->tangent_uvs;
  uint32_t faces = b->topologies[0].face_count;
  s->tangent_frames = tw_arena_alloc(s->arena, faces, 1);
  if (!s->tangent_frames) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < faces; f++) {
    uint32_t set = sets ? sets[b->source ? b->source[f] : f] : 0;
    bool mirrored = tw_uv_is_mirrored(&b->topologies[1 + set], uvs[set], f);
    s->tangent_frames[f] = (uint8_t)(2 * set + mirrored);
  }
  return TW_OK;
}

static tw_status split_vertices(tw_build *b, const uint8_t *visible) {
  tw_surface *s = b->surface;
  tw_splits splits = {.uv_count = b->mesh->uv_set_count, .normals = s->options.normals};
  const float *uvs[TW_UV_SETS_MAX];
  for (uint32_t i = 0; i < splits.uv_count; i++) {
    splits.uv_bases[i] = &s->fields[1 + i].base;
    uvs[i] = s->uvs[i].base;
  }
  /* Of a bilinear surface every edge of the cage is sharp: at each level their parts come first. */
  splits.sharp_below = b->rules.linear ? b->cage.topology.edge_count << b->levels : 0;
  tw_status status = tw_build_has_tangents(b) ? tw_build_find_frames(b, uvs) : TW_OK;
  splits.tangent_frames = s->tangent_frames;
  return status == TW_OK ? tw_number_vertices(&s->fields[0].base, &splits, visible, s->arena, &s->vertices)
                         : status;
}

tw_status tw_build_number(tw_build *b, const uint32_t *cage_vertices) {
  tw_surface *s = b->surface;
  const tw_topology *base = &s->fields[0].base;
  uint8_t *visible = NULL;
  if (!b->whole) {
    visible = tw_alloc(base->face_count, 1);
    if (!visible) return TW_NO_MEMORY;
    for (uint32_t q = 0; q < base->face_count; q++) visible[q] = b->cage.visible[b->source[q]];
  }
  tw_status status = tw_number_field(base, visible, s->arena, &s->points);
  s->cage_points = rows_of_cage(&s->points, base, cage_vertices[0]);
  if (status == TW_OK && b->mesh->uv_set_count > 0) {
    status = tw_number_field(&s->fields[1].base, visible, s->arena, &s->uv_points);
    s->cage_uv_points = rows_of_cage(&s->uv_points, &s->fields[1].base, cage_vertices[1]);
  }
  s->vertices = s->points;
  if (status == TW_OK && s->way != TW_WAY_LOOP && needs_splits(b, s->options.normals))
    status = split_vertices(b, visible);
  s->cage_vertices = rows_of_cage(&s->vertices, base, cage_vertices[0]);
  free(visible);
  return status;
}

void tw_build_lay_out(tw_build *b) {
  tw_surface *s = b->surface;
  tw_surface_layout *l = &s->layout;
  uint32_t stride = 3;
  l->normal = l->tangent = l->color = l->joints = l->weights = l->morphs = UINT32_MAX;
  if (s->options.normals) {
    l->normal = stride;
    stride += 3;
  }
  if (s->tangent_frames) {
    l->tangent = stride;
    stride += 4;
  }
  l->uv_count = b->mesh->uv_set_count;
  for (uint32_t i = 0; i < l->uv_count; i++, stride += 2) l->uvs[i] = stride;
  if (b->mesh->colors) {
    l->color = stride;
    stride += 4;
  }
  if (b->mesh->skin.joints) {
    l->joints = stride;
    l->weights = stride + 4;
    stride += 8;
  }
  l->morph_count = s->morph_count;
  if (s->morph_count > 0) {
    l->morphs = stride;
    stride += 3 * s->morph_count;
  }
  l->stride = stride;
}
