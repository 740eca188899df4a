#include "feature_mesh.h"

#include <string.h>

/* ---- what is a feature ---------------------------------------------------------------------- */

bool tw_is_exceptional_edge(const tw_topology *t, uint32_t e) {
  return (t->edge_flags[e] != 0) | (t->edge_sharpness[e] > 0);
}

/* Whether the faces at a point have different tangent frames. */
static bool has_several_frames(const tw_feature_mesh *s, uint32_t point) {
  const tw_topology *t = &s->fields[0];
  const uint32_t *fan = t->fan_corners;
  uint32_t first = t->fan_offsets[point], end = t->fan_offsets[point + 1];
  for (uint32_t i = first + 1; i < end; i++)
    if (s->frames[tw_corner_face(t, fan[i])] != s->frames[tw_corner_face(t, fan[first])]) return true;
  return false;
}

/* Marks the vertices of a field that the loops get wrong. */
static void mark_exceptional(const tw_topology *topology, uint8_t *exceptional) {
  const tw_topology t = *topology; /* of its own, so that writing marks does not seem to change it */
  for (uint32_t v = 0; v < t.vertex_count; v++)
    exceptional[v] = (t.fan_offsets[v + 1] - t.fan_offsets[v] < 3) |
                     (!t.smooth && (t.vertex_flags[v] | (t.vertex_sharpness[v] > 0)));
  for (uint32_t e = 0; !t.smooth && e < t.edge_count; e++)
    if (t.edge_sharpness[e] > 0) exceptional[t.edge_vertices[e][0]] = exceptional[t.edge_vertices[e][1]] = 1;
}

tw_status tw_feature_mesh_mark(const tw_exceptions *l, tw_feature_mesh *s, const uint8_t *candidates) {
  const tw_topology *points = &s->fields[0];
  s->is_feature = tw_arena_alloc(l->scratch, points->vertex_count, 1);
  if (!s->is_feature) return TW_NO_MEMORY;
  for (uint32_t v = 0; s->frames && v < points->vertex_count; v++)
    s->is_feature[v] = has_several_frames(s, v);
  for (uint32_t f = 0; f < l->inputs->field_count; f++) {
    const tw_topology *t = &s->fields[f];
    s->exceptional[f] = tw_arena_alloc_raw(l->scratch, t->vertex_count, 1);
    if (!s->exceptional[f]) return TW_NO_MEMORY;
    mark_exceptional(t, s->exceptional[f]);
    for (uint32_t v = 0; v < t->vertex_count; v++)
      if (s->exceptional[f][v]) s->is_feature[points->corner_vertex[t->fan_corners[t->fan_offsets[v]]]] = 1;
  }
  for (uint32_t v = 0; candidates && v < points->vertex_count; v++) s->is_feature[v] &= candidates[v];
  return TW_OK;
}

/* An exceptional edge makes features in its middle; the constant, for each face at a feature of the last
 * level, was measured on cages that are features everywhere. */
uint64_t tw_exceptions_size(const tw_exceptions *l, const tw_feature_mesh *cage) {
  enum { FACE = 288 };
  const tw_topology *points = &cage->fields[0];
  uint64_t faces = 0, edges = 0;
  for (uint32_t v = 0; v < points->vertex_count; v++)
    if (cage->is_feature[v]) faces += points->fan_offsets[v + 1] - points->fan_offsets[v];
  for (uint32_t f = 0; f < l->inputs->field_count; f++) {
    const tw_topology *t = &cage->fields[f];
    for (uint32_t e = 0; !t->smooth && e < t->edge_count; e++) edges += tw_is_exceptional_edge(t, e);
  }
  return FACE * (faces + 4 * edges * ((1u << l->inputs->level) - 1));
}

/* ---- cutting -------------------------------------------------------------------------------- */

/* The faces to cut out, and for each of their corners which one it is of the mesh that they are cut from. */
typedef struct cut {
  uint32_t face_count, corner_count;
  uint32_t *offsets; /* NULL where faces are of one size */
  uint32_t *from;    /* [corner_count] */
} cut;

/* Chooses the faces at features. */
static tw_status choose_faces(const tw_feature_mesh *s, tw_arena *arena, cut *out) {
  const tw_topology *t = &s->fields[0];
  uint32_t faces = 0, corners = 0;
  uint8_t *chosen = tw_arena_alloc(arena, t->face_count, 1);
  if (!chosen) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    for (uint32_t i = t->fan_offsets[v]; s->is_feature[v] && i < t->fan_offsets[v + 1]; i++) {
      uint32_t face = tw_corner_face(t, t->fan_corners[i]);
      if (chosen[face]) continue;
      chosen[face] = 1;
      faces++;
      corners += tw_face_size(t, face);
    }
  *out = (cut){faces, 0, NULL, tw_arena_alloc_raw(arena, corners, sizeof(uint32_t))};
  if (t->face_offsets) out->offsets = tw_arena_alloc(arena, (size_t)faces + 1, sizeof(uint32_t));
  if (!out->from || (t->face_offsets && !out->offsets)) return TW_NO_MEMORY;
  faces = 0;
  for (uint32_t f = 0; f < t->face_count; f++) {
    if (!chosen[f]) continue;
    uint32_t begin = tw_face_begin(t, f), end = begin + tw_face_size(t, f);
    for (uint32_t c = begin; c < end; c++) out->from[out->corner_count++] = c;
    faces++;
    if (out->offsets) out->offsets[faces] = out->corner_count;
  }
  return TW_OK;
}

static tw_status cut_field(const tw_feature_mesh *s, uint32_t field, const cut *c, tw_arena *arena,
                           tw_feature_mesh *out) {
  const tw_topology *full = &s->fields[field];
  tw_topology *t = &out->fields[field];
  uint32_t *old;
  tw_status status =
      tw_topology_cut(full, c->face_count, c->offsets, c->corner_count, c->from, arena, t, &old);
  if (status != TW_OK) return status;
  uint32_t count = t->vertex_count, *edges = tw_arena_alloc_raw(arena, t->edge_count, sizeof *edges);
  if (!edges) return TW_NO_MEMORY;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    uint32_t corner = c->from[t->edge_corner[e]], edge = full->corner_edge[corner];
    /* An edge of the cut runs in the direction of its own first corner. */
    bool turned = full->edge_vertices[edge][0] != full->corner_vertex[corner];
    edges[e] = (s->edges[field] ? s->edges[field][edge] : 2 * edge) ^ (uint32_t)turned;
  }
  out->exceptional[field] = tw_arena_alloc_raw(arena, count, 1);
  if (!out->exceptional[field]) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < count; v++) out->exceptional[field][v] = s->exceptional[field][old[v]];
  if (field == 0) {
    out->is_feature = tw_arena_alloc_raw(arena, count, 1);
    if (!out->is_feature) return TW_NO_MEMORY;
    for (uint32_t v = 0; v < count; v++) out->is_feature[v] = s->is_feature[old[v]];
  }
  for (uint32_t v = 0; s->vertices[field] && v < count; v++) old[v] = s->vertices[field][old[v]];
  out->vertices[field] = old;
  out->edges[field] = edges;
  return TW_OK;
}

/* Makes the sums for Chaikin's rule: of the points, then copies for UV sets. */
static tw_status sum_semi(const tw_exceptions *l, tw_feature_mesh *s) {
  if (!l->inputs->rules.chaikin) return TW_OK;
  tw_status status = tw_topology_sum_semi(&s->fields[0], l->scratch);
  for (uint32_t f = 1; f < l->inputs->field_count && status == TW_OK; f++)
    status = tw_topology_copy_semi(&s->fields[f], &s->fields[0], l->scratch);
  return status;
}

tw_status tw_feature_mesh_cut(const tw_exceptions *l, const tw_feature_mesh *s, tw_feature_mesh *out) {
  cut c;
  memset(out, 0, sizeof *out);
  tw_status status = choose_faces(s, l->scratch, &c);
  for (uint32_t f = 0; f < l->inputs->field_count && status == TW_OK; f++)
    status = cut_field(s, f, &c, l->scratch, out);
  if (status != TW_OK) return status;
  if (s->frames) {
    const tw_topology *t = &out->fields[0];
    out->frames = tw_arena_alloc_raw(l->scratch, t->face_count, 1);
    if (!out->frames) return TW_NO_MEMORY;
    for (uint32_t f = 0; f < t->face_count; f++)
      out->frames[f] = s->frames[tw_corner_face(&s->fields[0], c.from[tw_face_begin(t, f)])];
  }
  for (uint32_t i = 0; s->corners && i < c.corner_count; i++) c.from[i] = s->corners[c.from[i]];
  out->corners = c.from;
  return sum_semi(l, out);
}

/* ---- a step --------------------------------------------------------------------------------- */

tw_rules tw_exceptions_rules(const tw_exceptions *l, uint32_t field) {
  tw_rules rules = l->inputs->rules;
  rules.linear = l->inputs->linear[field];
  return rules;
}

uint32_t tw_feature_mesh_share(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t field,
                               uint32_t step, uint32_t v) {
  const tw_topology *t = &s->fields[field];
  const tw_shallow_level *level = &l->levels[field].at[step];
  if (v < t->vertex_count) return s->vertices[field][v];
  uint32_t face = v - t->vertex_count - t->edge_count, corner = s->corners[tw_face_begin(t, face)];
  return level->vertex_count + level->edge_count + tw_shallow_corner_face(level, level->face_size, corner);
}

/* Refines one field of a feature mesh, with its numbers in the whole level. */
static tw_status refine_field(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t field, uint32_t step,
                              tw_feature_mesh *out) {
  const tw_topology *p = &s->fields[field];
  const tw_shallow_level *level = &l->levels[field].at[step];
  tw_topology *t = &out->fields[field];
  tw_rules rules = tw_exceptions_rules(l, field);
  tw_status status = tw_refine_topology(p, &rules, l->scratch, NULL, t);
  if (status == TW_OK && field > 0 && rules.chaikin)
    status = tw_topology_copy_semi(t, &out->fields[0], l->scratch);
  if (status != TW_OK) return status;
  uint32_t *vertices = tw_arena_alloc_raw(l->scratch, t->vertex_count, sizeof *vertices),
           *edges = tw_arena_alloc_raw(l->scratch, t->edge_count, sizeof *edges);
  if (!vertices || !edges) return TW_NO_MEMORY;
  memcpy(vertices, s->vertices[field], p->vertex_count * sizeof *vertices);
  for (uint32_t e = 0; e < p->edge_count; e++) {
    uint32_t whole = s->edges[field][e];
    vertices[p->vertex_count + e] = level->vertex_count + (whole >> 1);
    for (uint32_t k = 0; k < 2; k++)
      edges[2 * e + k] = 2 * (2 * (whole >> 1) + (k ^ (whole & 1))) + (whole & 1);
  }
  for (uint32_t f = 0; f < p->face_count; f++)
    vertices[p->vertex_count + p->edge_count + f] =
        tw_feature_mesh_share(l, s, field, step, p->vertex_count + p->edge_count + f);
  for (uint32_t c = 0; c < p->corner_count; c++)
    edges[2 * p->edge_count + c] = 2 * (2 * level->edge_count + s->corners[c]);
  out->vertices[field] = vertices;
  out->edges[field] = edges;
  return TW_OK;
}

/* Marks the features of a refined feature mesh. Only features and the middles of their edges can be: the
 * feature mesh has all of their faces. */
static tw_status refine_features(const tw_exceptions *l, const tw_feature_mesh *s, tw_feature_mesh *out) {
  const tw_topology *p = &s->fields[0], *t = &out->fields[0];
  uint8_t *candidates = tw_arena_alloc(l->scratch, t->vertex_count, 1);
  if (!candidates) return TW_NO_MEMORY;
  memcpy(candidates, s->is_feature, p->vertex_count);
  for (uint32_t e = 0; e < p->edge_count; e++)
    candidates[p->vertex_count + e] =
        s->is_feature[p->edge_vertices[e][0]] || s->is_feature[p->edge_vertices[e][1]];
  return tw_feature_mesh_mark(l, out, candidates);
}

tw_status tw_feature_mesh_refine(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t step,
                                 tw_feature_mesh *out) {
  memset(out, 0, sizeof *out);
  tw_status status = TW_OK;
  for (uint32_t f = 0; f < l->inputs->field_count && status == TW_OK; f++)
    status = refine_field(l, s, f, step, out);
  if (status != TW_OK) return status;
  const tw_topology *t = &s->fields[0];
  out->corners = tw_arena_alloc_raw(l->scratch, out->fields[0].corner_count, sizeof *out->corners);
  if (!out->corners) return TW_NO_MEMORY;
  for (uint32_t c = 0; c < t->corner_count; c++)
    for (uint32_t k = 0; k < 4; k++) out->corners[4 * (size_t)c + k] = 4 * s->corners[c] + k;
  if (s->frames) {
    out->frames = tw_arena_alloc_raw(l->scratch, t->corner_count, 1);
    if (!out->frames) return TW_NO_MEMORY;
    for (uint32_t c = 0; c < t->corner_count; c++) out->frames[c] = s->frames[tw_corner_face(t, c)];
  }
  return refine_features(l, s, out);
}

/* ---- limit masks ---------------------------------------------------------------------------- */

tw_limit_entry *tw_feature_mask_room(const tw_exceptions *l, const tw_feature_mesh *s) {
  uint32_t capacity = 1;
  for (uint32_t f = 0; f < l->inputs->field_count; f++) {
    const tw_topology *t = &s->fields[f];
    for (uint32_t v = 0; v < t->vertex_count; v++) {
      if (!s->is_feature[s->fields[0].corner_vertex[t->fan_corners[t->fan_offsets[v]]]]) continue;
      uint32_t own = tw_limit_capacity(t, !t->smooth, v);
      if (own > capacity) capacity = own;
    }
  }
  return tw_alloc(capacity, sizeof(tw_limit_entry));
}

void tw_push_limit_entries(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t field, uint32_t corner,
                           bool tangents, tw_last_mask *mask, tw_list *out) {
  uint32_t count = tw_limit_mask_after(mask, &s->fields[field], l->inputs->linear[field], corner);
  for (uint32_t i = 0; i < count; i++) {
    tw_limit_entry entry = mask->entries[i];
    if (tangents ? entry.tangent1 == 0 && entry.tangent2 == 0 : entry.position == 0) continue;
    entry.vertex = s->vertices[field][entry.vertex];
    tw_list_push(out, &entry);
  }
}
