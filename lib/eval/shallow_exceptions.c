/* Lists the exceptions of shallow_levels.h: the vertices of each level that are not smooth, and those that
 * UV seams split.
 *
 * The faces round features (vertices with such exceptions) are cut out of the cage as a mesh of their own,
 * the feature mesh, for the points and for each UV set. Generic steps refine it. After each step it is cut
 * back to the faces round vertices that are still features, so that the cost is in proportion to the length
 * of borders, creases and seams. Only features have all of their faces in the feature mesh; masks of its
 * other vertices would be wrong and are not used. */
#include <stdlib.h>
#include <string.h>

#include "numbering.h"
#include "refine.h"
#include "shallow_levels.h"

enum { FIELDS_MAX = TW_FIELDS_MAX };

/* A feature mesh, with the numbers that its vertices, edges and corners have in the whole level. */
typedef struct feature_mesh {
  tw_topology fields[FIELDS_MAX];
  uint32_t *vertices[FIELDS_MAX]; /* [vertices of the field] */
  /* [edges of the field] 2 x edge, + 1 where the level's edge runs the other way. */
  uint32_t *edges[FIELDS_MAX];
  uint32_t *corners; /* [corners] */
  /* [vertices of the field] the loops get the vertex wrong; meaningful where its point is a feature. */
  uint8_t *exceptional[FIELDS_MAX];
  /* [vertices of the points] the point is exceptional in some field, or its faces have several tangent
   * frames. */
  uint8_t *is_feature;
  uint8_t *frames; /* [faces] tangent frames; NULL: no tangents */
} feature_mesh;

typedef struct exceptions {
  const tw_shallow_inputs *inputs;
  tw_arena *arena; /* memory of the plan */
  tw_arena *scratch;
  tw_shallow *levels;
  tw_shallow_rows *rows;
} exceptions;

/* A list of items of `size` bytes that grows. */
typedef struct growing {
  char *items;
  size_t count, room, size;
  bool failed;
} growing;

static void *push(growing *g, const void *item) {
  if (g->count == g->room) {
    size_t room = g->room ? 2 * g->room : 256;
    char *items = room < SIZE_MAX / 2 / g->size ? tw_resize(g->items, room * g->size) : NULL;
    if (!items) {
      g->failed = true;
      return NULL;
    }
    g->items = items;
    g->room = room;
  }
  void *place = g->items + g->size * g->count++;
  memcpy(place, item, g->size);
  return place;
}

/* Moves the list into the arena; the list is empty afterwards. NULL when the list or the copy had no
 * memory. */
static void *move_to_arena(growing *g, tw_arena *arena) {
  void *out = g->failed ? NULL : tw_arena_alloc_raw(arena, g->count, g->size);
  if (out && g->count > 0) memcpy(out, g->items, g->count * g->size);
  tw_free(g->items);
  *g = (growing){.size = g->size};
  return out;
}

/* ---- what is a feature ---------------------------------------------------------------------- */

static bool is_exceptional_edge(const tw_topology *t, uint32_t e) {
  return t->edge_flags[e] || t->edge_sharpness[e] > 0;
}

/* Whether the faces at a point have different tangent frames. */
static bool has_several_frames(const feature_mesh *s, uint32_t point) {
  const tw_topology *t = &s->fields[0];
  const uint32_t *fan = t->fan_corners;
  uint32_t first = t->fan_offsets[point], end = t->fan_offsets[point + 1];
  for (uint32_t i = first + 1; i < end; i++)
    if (s->frames[tw_corner_face(t, fan[i])] != s->frames[tw_corner_face(t, fan[first])]) return true;
  return false;
}

/* Marks the vertices of a field that the loops get wrong. */
static void mark_exceptional(const tw_topology *t, uint8_t *exceptional) {
  for (uint32_t v = 0; v < t->vertex_count; v++)
    exceptional[v] = t->fan_offsets[v + 1] - t->fan_offsets[v] < 3 ||
                     (!t->smooth && (t->vertex_flags[v] || t->vertex_sharpness[v] > 0));
  for (uint32_t e = 0; !t->smooth && e < t->edge_count; e++)
    if (t->edge_sharpness[e] > 0)
      exceptional[t->edge_vertices[e][0]] = exceptional[t->edge_vertices[e][1]] = 1;
}

/* Marks features: points that are exceptional in some field, or whose faces have different tangent frames.
 * Where a seam splits a point, its values in the UV set have a border and so are exceptional. candidates:
 * [vertices] points that can be features; NULL: all. */
static tw_status mark_features(const exceptions *l, feature_mesh *s, const uint8_t *candidates) {
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

/* An upper bound, in bytes, of what listing the exceptions takes. An exceptional edge makes features in its
 * middle; the constant, for each face at a feature of the last level, was measured on cages that
 * are features everywhere. */
static uint64_t exceptions_size(const exceptions *l, const feature_mesh *cage) {
  enum { FACE = 288 };
  const tw_topology *points = &cage->fields[0];
  uint64_t faces = 0, edges = 0;
  for (uint32_t v = 0; v < points->vertex_count; v++)
    if (cage->is_feature[v]) faces += points->fan_offsets[v + 1] - points->fan_offsets[v];
  for (uint32_t f = 0; f < l->inputs->field_count; f++)
    for (uint32_t e = 0; !cage->fields[f].smooth && e < cage->fields[f].edge_count; e++)
      edges += is_exceptional_edge(&cage->fields[f], e);
  return FACE * (faces + 4 * edges * ((1u << l->inputs->level) - 1));
}

/* ---- cutting -------------------------------------------------------------------------------- */

/* The faces to cut out, and the corners that theirs were. */
typedef struct cut {
  uint32_t face_count, corner_count;
  uint32_t *offsets; /* NULL where faces are of one size */
  uint32_t *from;    /* [corner_count] */
} cut;

/* Chooses the faces at features. */
static tw_status choose_faces(const feature_mesh *s, tw_arena *arena, cut *out) {
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

static tw_status cut_field(const feature_mesh *s, uint32_t field, const cut *c, tw_arena *arena,
                           feature_mesh *out) {
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
static tw_status sum_semi(const exceptions *l, feature_mesh *s) {
  if (!l->inputs->rules.chaikin) return TW_OK;
  tw_status status = tw_topology_sum_semi(&s->fields[0], l->scratch);
  for (uint32_t f = 1; f < l->inputs->field_count && status == TW_OK; f++)
    status = tw_topology_copy_semi(&s->fields[f], &s->fields[0], l->scratch);
  return status;
}

/* Cuts the faces round features out of `s`. */
static tw_status cut_feature_mesh(const exceptions *l, const feature_mesh *s, feature_mesh *out) {
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

static tw_rules rules_of(const exceptions *l, uint32_t field) {
  tw_rules rules = l->inputs->rules;
  rules.linear = l->inputs->linear[field];
  return rules;
}

/* The number in the whole level of a share's vertex: a vertex of the step's own level, or a face point of the
 * next. */
static uint32_t share_vertex(const exceptions *l, const feature_mesh *s, uint32_t field, uint32_t step,
                             uint32_t v) {
  const tw_topology *t = &s->fields[field];
  const tw_shallow_level *level = &l->levels[field].at[step];
  if (v < t->vertex_count) return s->vertices[field][v];
  uint32_t face = v - t->vertex_count - t->edge_count, corner = s->corners[tw_face_begin(t, face)];
  return level->vertex_count + level->edge_count + tw_shallow_corner_face(level, level->face_size, corner);
}

/* The masks of one field while they are collected. */
typedef struct mask_list {
  growing vertices, first, shares;
  tw_share *room;
} mask_list;

static void list_mask(const exceptions *l, const feature_mesh *s, uint32_t field, uint32_t step,
                      uint32_t child, uint32_t whole, mask_list *out) {
  tw_rules rules = rules_of(l, field);
  uint32_t count = tw_refine_mask(&s->fields[field], &rules, child, out->room),
           first = (uint32_t)out->shares.count;
  push(&out->vertices, &whole);
  push(&out->first, &first);
  for (uint32_t i = 0; i < count; i++) {
    tw_share share = out->room[i];
    if (share.weight == 0) continue;
    share.vertex = share_vertex(l, s, field, step, share.vertex);
    push(&out->shares, &share);
  }
}

static tw_status list_masks(const exceptions *l, const feature_mesh *s, uint32_t field, uint32_t step) {
  const tw_topology *t = &s->fields[field];
  const tw_shallow_level *level = &l->levels[field].at[step];
  mask_list list = {.vertices = {.size = sizeof(uint32_t)},
                    .first = {.size = sizeof(uint32_t)},
                    .shares = {.size = sizeof(tw_share)},
                    .room = tw_alloc(tw_refine_mask_capacity(t), sizeof(tw_share))};
  for (uint32_t v = 0; list.room && v < t->vertex_count; v++) {
    uint32_t point = s->fields[0].corner_vertex[t->fan_corners[t->fan_offsets[v]]];
    if (s->is_feature[point] && s->exceptional[field][v])
      list_mask(l, s, field, step, v, s->vertices[field][v], &list);
  }
  for (uint32_t e = 0; list.room && e < t->edge_count; e++) {
    uint32_t corner = t->edge_corner[e], next = tw_corner_next(t, corner);
    const uint32_t *points = s->fields[0].corner_vertex;
    if (!s->is_feature[points[corner]] || !s->is_feature[points[next]] || !is_exceptional_edge(t, e))
      continue;
    list_mask(l, s, field, step, t->vertex_count + e, level->vertex_count + (s->edges[field][e] >> 1), &list);
  }
  bool complete = list.room != NULL;
  tw_free(list.room);
  uint32_t end = (uint32_t)list.shares.count;
  push(&list.first, &end);
  tw_shallow_masks *out = &l->levels[field].masks[step];
  out->count = (uint32_t)list.vertices.count;
  out->vertices = move_to_arena(&list.vertices, l->arena);
  out->first = move_to_arena(&list.first, l->arena);
  out->shares = move_to_arena(&list.shares, l->arena);
  return complete && out->vertices && out->first && out->shares ? TW_OK : TW_NO_MEMORY;
}

/* Refines one field of a feature mesh, with its numbers in the whole level. */
static tw_status refine_field(const exceptions *l, const feature_mesh *s, uint32_t field, uint32_t step,
                              feature_mesh *out) {
  const tw_topology *p = &s->fields[field];
  const tw_shallow_level *level = &l->levels[field].at[step];
  tw_topology *t = &out->fields[field];
  tw_rules rules = rules_of(l, field);
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
        share_vertex(l, s, field, step, p->vertex_count + p->edge_count + f);
  for (uint32_t c = 0; c < p->corner_count; c++)
    edges[2 * p->edge_count + c] = 2 * (2 * level->edge_count + s->corners[c]);
  out->vertices[field] = vertices;
  out->edges[field] = edges;
  return TW_OK;
}

/* Marks the features of a refined feature mesh. Only features and the middles of their edges can be: the
 * feature mesh has all of their faces. */
static tw_status refine_features(const exceptions *l, const feature_mesh *s, feature_mesh *out) {
  const tw_topology *p = &s->fields[0], *t = &out->fields[0];
  uint8_t *candidates = tw_arena_alloc(l->scratch, t->vertex_count, 1);
  if (!candidates) return TW_NO_MEMORY;
  memcpy(candidates, s->is_feature, p->vertex_count);
  for (uint32_t e = 0; e < p->edge_count; e++)
    candidates[p->vertex_count + e] =
        s->is_feature[p->edge_vertices[e][0]] || s->is_feature[p->edge_vertices[e][1]];
  return mark_features(l, out, candidates);
}

static tw_status refine_feature_mesh(const exceptions *l, const feature_mesh *s, uint32_t step,
                                     feature_mesh *out) {
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

/* ---- the last level ------------------------------------------------------------------------- */

/* Room for the largest limit mask at a feature, of any field. */
static tw_limit_entry *mask_room(const exceptions *l, const feature_mesh *s) {
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

/* Appends the nonzero entries of a corner's limit mask, of its tangents or of its position. */
static void push_entries(const exceptions *l, const feature_mesh *s, uint32_t field, uint32_t corner,
                         bool tangents, tw_last_mask *mask, growing *out) {
  uint32_t count = tw_limit_mask_after(mask, &s->fields[field], l->inputs->linear[field], corner);
  for (uint32_t i = 0; i < count; i++) {
    tw_limit_entry entry = mask->entries[i];
    if (tangents ? entry.tangent1 == 0 && entry.tangent2 == 0 : entry.position == 0) continue;
    entry.vertex = s->vertices[field][entry.vertex];
    push(out, &entry);
  }
}

static tw_status list_limits(const exceptions *l, const feature_mesh *s, uint32_t field) {
  const tw_topology *t = &s->fields[field];
  growing vertices = {.size = sizeof(uint32_t)}, first = {.size = sizeof(uint32_t)},
          entries = {.size = sizeof(tw_limit_entry)};
  tw_last_mask mask = {.entries = mask_room(l, s)};
  for (uint32_t v = 0; mask.entries && v < t->vertex_count; v++) {
    uint32_t corner = t->fan_corners[t->fan_offsets[v]], begin = (uint32_t)entries.count;
    if (!s->is_feature[s->fields[0].corner_vertex[corner]] || !s->exceptional[field][v]) continue;
    push(&vertices, &s->vertices[field][v]);
    push(&first, &begin);
    push_entries(l, s, field, corner, false, &mask, &entries);
  }
  bool complete = mask.entries != NULL;
  tw_free(mask.entries);
  uint32_t end = (uint32_t)entries.count;
  push(&first, &end);
  tw_shallow_limits *out = &l->levels[field].limits;
  out->count = (uint32_t)vertices.count;
  out->vertices = move_to_arena(&vertices, l->arena);
  out->first = move_to_arena(&first, l->arena);
  out->entries = move_to_arena(&entries, l->arena);
  return complete && out->vertices && out->first && out->entries ? TW_OK : TW_NO_MEMORY;
}

/* A listed row while rows are collected; fields as in tw_shallow_rows. */
typedef struct row {
  uint32_t row, point, first_entry, end_entry, quad[4];
  size_t channels; /* the first of its vertices in the channels, in the list of these */
  uint8_t frame;
  tw_shallow_slope_mask slopes[2];
} row;

/* A tangent mask in the list of entries, and the corner that represents those that have it. */
typedef struct tangent_mask {
  uint32_t corner, first, end;
} tangent_mask;

typedef struct row_list {
  const feature_mesh *s;
  tw_numbering numbering;
  bool split_by_seams; /* `numbering` is set: points may have several rows */
  tw_last_mask mask;
  growing rows, entries, channels; /* channels: uint32_t, field_count - 1 for each row */
  tangent_mask known[FIELDS_MAX]
                    [2]; /* the last masks of each field: a vertex with a crease has two large ones */
} row_list;

/* Appends the tangent mask of a corner, unless it is known. */
static tangent_mask push_tangents(const exceptions *l, row_list *list, uint32_t field, uint32_t corner) {
  const tw_topology *t = &list->s->fields[field];
  tangent_mask *known = list->known[field],
               new = {tw_limit_corner(t, l->inputs->linear[field], corner), 0, 0};
  for (int i = 0; i < 2; i++)
    if (known[i].end > 0 && known[i].corner == new.corner) return known[i];
  new.first = (uint32_t)list->entries.count;
  push_entries(l, list->s, field, corner, true, &list->mask, &list->entries);
  new.end = (uint32_t)list->entries.count;
  known[1] = known[0];
  known[0] = new;
  return new;
}

static void push_slopes(const exceptions *l, row_list *list, uint32_t corner, row *out) {
  const feature_mesh *s = list->s;
  out->frame = s->frames[tw_corner_face(&s->fields[0], corner)];
  const uint32_t fields[2] = {0, 1u + out->frame / 2};
  for (int i = 0; i < 2; i++) {
    uint32_t field = fields[i], first = (uint32_t)list->entries.count;
    tw_limit_entry sides[2];
    tw_shallow_slope_mask *slopes = &out->slopes[i];
    if (tw_slope_frame(&s->fields[field], l->inputs->linear[field], corner, slopes->frame, sides)) {
      tangent_mask mask = push_tangents(l, list, field, corner);
      slopes->first = mask.first;
      slopes->end = mask.end;
      continue;
    }
    for (int e = 0; e < 2; e++) {
      sides[e].vertex = s->vertices[field][sides[e].vertex];
      push(&list->entries, &sides[e]);
    }
    slopes->first = first;
    slopes->end = first + 2;
  }
}

/* Appends one of the rows of a point, at the corner that represents it. whole: NULL, or another row of the
 * point whose normal it shares. */
static void push_row(const exceptions *l, row_list *list, uint32_t number, uint32_t corner,
                     const row *whole) {
  const feature_mesh *s = list->s;
  const tw_topology *t = &s->fields[0];
  row own = {
      .row = number, .point = s->vertices[0][t->corner_vertex[corner]], .channels = list->channels.count};
  for (uint32_t f = 1; f < l->inputs->field_count; f++)
    push(&list->channels, &s->vertices[f][s->fields[f].corner_vertex[corner]]);
  if (l->inputs->normals && whole) { /* the surface has one normal at the point */
    own.first_entry = whole->first_entry;
    own.end_entry = whole->end_entry;
    memcpy(own.quad, whole->quad, sizeof own.quad);
  } else if (l->inputs->normals) {
    tangent_mask mask = push_tangents(l, list, 0, corner);
    own.first_entry = mask.first;
    own.end_entry = mask.end;
    for (uint32_t k = 0; k < 4; k++) own.quad[k] = s->vertices[0][t->corner_vertex[(corner & ~3u) + k]];
  }
  if (s->frames) push_slopes(l, list, corner, &own);
  push(&list->rows, &own);
}

/* Appends the rows of one point. The first row has the point's own number. new_row: [rows of the feature
 * mesh's numbering] the number in the level, UINT32_MAX where not yet given. */
static void push_rows(const exceptions *l, row_list *list, uint32_t v, uint32_t *new_row) {
  const tw_topology *t = &list->s->fields[0];
  uint32_t first = t->fan_offsets[v], end = t->fan_offsets[v + 1], corner = t->fan_corners[first];
  size_t begun = list->rows.count;
  push_row(l, list, list->s->vertices[0][v], corner, NULL);
  if (!list->split_by_seams) return;
  const uint32_t *row_of = list->numbering.corner_row;
  new_row[row_of[corner]] = list->s->vertices[0][v];
  bool smooth = !list->s->exceptional[0][v];
  for (uint32_t i = first + 1; i < end; i++) {
    uint32_t *number = &new_row[row_of[t->fan_corners[i]]];
    if (*number != UINT32_MAX || list->rows.failed) continue;
    *number = l->rows->row_count++;
    row whole = ((row *)(void *)list->rows.items)[begun];
    push_row(l, list, *number, t->fan_corners[i], smooth ? &whole : NULL);
  }
}

/* Lists the corners whose row is not the row of their point. They are ascending, because the feature mesh's
 * corners are in the level's order. */
static tw_status list_corners(const exceptions *l, const row_list *list, const uint32_t *new_row) {
  const feature_mesh *s = list->s;
  const tw_topology *t = &s->fields[0];
  growing corners = {.size = sizeof(uint32_t)}, rows = {.size = sizeof(uint32_t)};
  for (uint32_t c = 0; c < t->corner_count; c++) {
    uint32_t v = t->corner_vertex[c];
    if (!s->is_feature[v]) continue;
    uint32_t number = new_row[list->numbering.corner_row[c]];
    if (number == s->vertices[0][v]) continue;
    push(&corners, &s->corners[c]);
    push(&rows, &number);
  }
  l->rows->corner_count = (uint32_t)corners.count;
  l->rows->corners = move_to_arena(&corners, l->arena);
  l->rows->corner_rows = move_to_arena(&rows, l->arena);
  return l->rows->corners && l->rows->corner_rows ? TW_OK : TW_NO_MEMORY;
}

static int compare_rows(const void *left, const void *right) {
  const row *a = left, *b = right;
  return a->row < b->row ? -1 : a->row > b->row;
}

static tw_status store_rows(const exceptions *l, row_list *list) {
  tw_shallow_rows *out = l->rows;
  size_t count = list->rows.count;
  bool normals = l->inputs->normals;
  if (list->rows.failed || list->channels.failed) return TW_NO_MEMORY;
  out->count = (uint32_t)count;
  tw_status status = tw_sort(list->rows.items, count, sizeof(row), compare_rows);
  if (status != TW_OK) return status;
  out->rows = tw_arena_alloc_raw(l->arena, count, sizeof *out->rows);
  out->points = tw_arena_alloc_raw(l->arena, count, sizeof *out->points);
  out->first_entry = tw_arena_alloc_raw(l->arena, normals ? count : 0, sizeof *out->first_entry);
  out->end_entry = tw_arena_alloc_raw(l->arena, normals ? count : 0, sizeof *out->end_entry);
  out->quad = tw_arena_alloc_raw(l->arena, normals ? count : 0, sizeof *out->quad);
  out->entries = move_to_arena(&list->entries, l->arena);
  bool complete = out->rows && out->points && out->first_entry && out->end_entry && out->quad && out->entries;
  out->frames = tw_arena_alloc_raw(l->arena, l->inputs->frames ? count : 0, 1);
  out->slopes = tw_arena_alloc_raw(l->arena, l->inputs->frames ? count : 0, sizeof *out->slopes);
  complete = complete && out->frames && out->slopes;
  const uint32_t *channels = (const uint32_t *)(const void *)list->channels.items;
  for (uint32_t i = 0; i + 1 < l->inputs->field_count; i++) {
    out->channels[i] = tw_arena_alloc_raw(l->arena, count, sizeof *out->channels[i]);
    complete = complete && out->channels[i];
  }
  for (size_t i = 0; complete && i < count; i++) {
    const row *r = (const row *)(const void *)list->rows.items + i;
    out->rows[i] = r->row;
    out->points[i] = r->point;
    for (uint32_t k = 0; k + 1 < l->inputs->field_count; k++) out->channels[k][i] = channels[r->channels + k];
    if (!normals) continue;
    out->first_entry[i] = r->first_entry;
    out->end_entry[i] = r->end_entry;
    memcpy(out->quad[i], r->quad, sizeof r->quad);
    if (!l->inputs->frames) continue;
    out->frames[i] = r->frame;
    memcpy(out->slopes[i], r->slopes, sizeof r->slopes);
  }
  return complete ? TW_OK : TW_NO_MEMORY;
}

/* Numbers the feature mesh's rows where points can have several: with channels, and where sides of a crease
 * have normals of their own. */
static tw_status number_split(const exceptions *l, row_list *list, uint32_t **new_row) {
  const feature_mesh *s = list->s;
  tw_splits splits = {.channel_count = l->inputs->field_count - 1,
                      .normals = l->inputs->normals,
                      .tangent_frames = s->frames};
  for (uint32_t i = 0; i < splits.channel_count; i++) splits.channels[i] = &s->fields[1 + i];
  list->split_by_seams =
      splits.channel_count > 0 || (splits.normals && tw_topology_parts_normals(&s->fields[0]));
  if (!list->split_by_seams) return TW_OK;
  tw_status status = tw_number_corners(&s->fields[0], &splits, s->is_feature, l->scratch, &list->numbering);
  if (status != TW_OK) return status;
  *new_row = tw_arena_alloc_raw(l->scratch, list->numbering.corner_count, sizeof **new_row);
  if (!*new_row) return TW_NO_MEMORY;
  memset(*new_row, 0xFF, list->numbering.corner_count * sizeof **new_row);
  return TW_OK;
}

static tw_status list_rows(const exceptions *l, const feature_mesh *s) {
  row_list list = {.s = s,
                   .rows = {.size = sizeof(row)},
                   .entries = {.size = sizeof(tw_limit_entry)},
                   .channels = {.size = sizeof(uint32_t)}};
  uint32_t *new_row = NULL;
  tw_status status = number_split(l, &list, &new_row);
  list.mask.entries = mask_room(l, s);
  if (!list.mask.entries) status = TW_NO_MEMORY;
  if (status == TW_OK && list.split_by_seams &&
      !tw_is_quickly_read(&s->fields[0], &list.numbering, l->inputs->frames ? 3 : 1))
    status = TW_LIMIT;
  for (uint32_t v = 0; status == TW_OK && v < s->fields[0].vertex_count; v++) {
    if (v % 1024 == 0) status = tw_parallel_for_status(l->inputs->parallel);
    if (s->is_feature[v]) push_rows(l, &list, v, new_row);
  }
  if (status == TW_OK) status = store_rows(l, &list);
  if (status == TW_OK && list.split_by_seams) status = list_corners(l, &list, new_row);
  tw_free(list.mask.entries);
  tw_free(list.rows.items);
  tw_free(list.entries.items);
  tw_free(list.channels.items);
  return status;
}

/* ---- all ------------------------------------------------------------------------------------ */

/* Continues in an arena of its own; what the feature mesh before it needed goes with the old one. */
static void continue_in(exceptions *l, tw_arena *scratch) {
  tw_arena_destroy(l->scratch);
  l->scratch = scratch;
}

/* Refines the feature mesh. */
static tw_status refine_whole(exceptions *l, uint32_t step, feature_mesh *s) {
  feature_mesh child;
  exceptions next = *l;
  next.scratch = tw_arena_create();
  if (!next.scratch) return TW_NO_MEMORY;
  tw_status status = refine_feature_mesh(&next, s, step, &child);
  continue_in(l, next.scratch);
  *s = child;
  return status;
}

/* Cuts the feature mesh back to the faces round vertices that are still features. */
static tw_status cut_back(exceptions *l, feature_mesh *s) {
  feature_mesh cut;
  exceptions next = *l;
  next.scratch = tw_arena_create();
  if (!next.scratch) return TW_NO_MEMORY;
  tw_status status = cut_feature_mesh(&next, s, &cut);
  continue_in(l, next.scratch);
  *s = cut;
  return status;
}

static tw_status list_from(exceptions *l, feature_mesh *s) {
  const tw_shallow_inputs *inputs = l->inputs;
  for (uint32_t step = 0; step < inputs->level; step++) {
    tw_status status = TW_OK;
    for (uint32_t f = 0; f < inputs->field_count && status == TW_OK; f++)
      if (!inputs->linear[f]) status = list_masks(l, s, f, step);
    if (status == TW_OK) status = tw_parallel_for_status(inputs->parallel);
    if (status == TW_OK) status = refine_whole(l, step, s);
    if (status == TW_OK && step + 1 < inputs->level) status = cut_back(l, s);
    if (status != TW_OK) return status;
  }
  tw_status status = TW_OK;
  for (uint32_t f = 0; inputs->limit && f < inputs->field_count && status == TW_OK; f++)
    if (!inputs->linear[f]) status = list_limits(l, s, f);
  return status == TW_OK ? list_rows(l, s) : status;
}

static tw_status list_all(exceptions *l) {
  const tw_shallow_inputs *inputs = l->inputs;
  feature_mesh cage = {0};
  for (uint32_t f = 0; f < inputs->field_count; f++) cage.fields[f] = *inputs->fields[f];
  if (inputs->frames) {
    cage.frames = tw_arena_alloc_raw(l->scratch, cage.fields[0].face_count, 1);
    if (!cage.frames) return TW_NO_MEMORY;
    memcpy(cage.frames, inputs->frames, cage.fields[0].face_count);
  }
  tw_status status = mark_features(l, &cage, NULL);
  if (status != TW_OK || !memchr(cage.is_feature, 1, cage.fields[0].vertex_count)) return status;
  uint64_t size = exceptions_size(l, &cage);
  *inputs->is_large = size > inputs->exceptions_max;
  if (*inputs->is_large) return TW_LIMIT;
  status = cut_back(l, &cage);
  return status == TW_OK ? list_from(l, &cage) : status;
}

tw_status tw_shallow_list_exceptions(const tw_shallow_inputs *inputs, tw_arena *arena, tw_shallow *out,
                                     tw_shallow_rows *rows) {
  exceptions l = {inputs, arena, tw_arena_create(), out, rows};
  *rows = (tw_shallow_rows){.row_count = tw_shallow_points(&out[0])};
  tw_status status = l.scratch ? list_all(&l) : TW_NO_MEMORY;
  tw_arena_destroy(l.scratch);
  return status;
}
