/* Lists the exceptions of shallow_levels.h: the vertices of each level that are not smooth, and those that
 * UV seams split. */
#include <string.h>

#include "exception_rows.h"

/* ---- masks ---------------------------------------------------------------------------------- */

/* The masks of one field while they are collected. */
typedef struct mask_list {
  tw_list vertices, first, shares;
  tw_share *room;
} mask_list;

static void list_mask(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t field, uint32_t step,
                      uint32_t child, uint32_t whole, mask_list *out) {
  tw_rules rules = tw_exceptions_rules(l, field);
  uint32_t count = tw_refine_mask(&s->fields[field], &rules, child, out->room),
           first = (uint32_t)out->shares.count;
  tw_list_push(&out->vertices, &whole);
  tw_list_push(&out->first, &first);
  for (uint32_t i = 0; i < count; i++) {
    tw_share share = out->room[i];
    if (share.weight == 0) continue;
    share.vertex = tw_feature_mesh_share(l, s, field, step, share.vertex);
    tw_list_push(&out->shares, &share);
  }
}

static tw_status list_masks(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t field, uint32_t step) {
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
    if (!s->is_feature[points[corner]] || !s->is_feature[points[next]] || !tw_is_exceptional_edge(t, e))
      continue;
    list_mask(l, s, field, step, t->vertex_count + e, level->vertex_count + (s->edges[field][e] >> 1), &list);
  }
  bool complete = list.room != NULL;
  tw_free(list.room);
  uint32_t end = (uint32_t)list.shares.count;
  tw_list_push(&list.first, &end);
  tw_shallow_masks *out = &l->levels[field].masks[step];
  out->count = (uint32_t)list.vertices.count;
  out->vertices = tw_list_move(&list.vertices, l->arena);
  out->first = tw_list_move(&list.first, l->arena);
  out->shares = tw_list_move(&list.shares, l->arena);
  return complete && out->vertices && out->first && out->shares ? TW_OK : TW_NO_MEMORY;
}

static tw_status list_limits(const tw_exceptions *l, const tw_feature_mesh *s, uint32_t field) {
  const tw_topology *t = &s->fields[field];
  tw_list vertices = {.size = sizeof(uint32_t)}, first = {.size = sizeof(uint32_t)},
          entries = {.size = sizeof(tw_limit_entry)};
  tw_last_mask mask = {.entries = tw_feature_mask_room(l, s)};
  for (uint32_t v = 0; mask.entries && v < t->vertex_count; v++) {
    uint32_t corner = t->fan_corners[t->fan_offsets[v]], begin = (uint32_t)entries.count;
    if (!s->is_feature[s->fields[0].corner_vertex[corner]] || !s->exceptional[field][v]) continue;
    tw_list_push(&vertices, &s->vertices[field][v]);
    tw_list_push(&first, &begin);
    tw_push_limit_entries(l, s, field, corner, false, &mask, &entries);
  }
  bool complete = mask.entries != NULL;
  tw_free(mask.entries);
  uint32_t end = (uint32_t)entries.count;
  tw_list_push(&first, &end);
  tw_shallow_limits *out = &l->levels[field].limits;
  out->count = (uint32_t)vertices.count;
  out->vertices = tw_list_move(&vertices, l->arena);
  out->first = tw_list_move(&first, l->arena);
  out->entries = tw_list_move(&entries, l->arena);
  return complete && out->vertices && out->first && out->entries ? TW_OK : TW_NO_MEMORY;
}

/* ---- all ------------------------------------------------------------------------------------ */

/* Continues in an arena of its own; what the feature mesh before it needed goes with the old one. */
static void continue_in(tw_exceptions *l, tw_arena *scratch) {
  tw_arena_destroy(l->scratch);
  l->scratch = scratch;
}

/* Refines the feature mesh. */
static tw_status refine_whole(tw_exceptions *l, uint32_t step, tw_feature_mesh *s) {
  tw_feature_mesh child;
  tw_exceptions next = *l;
  next.scratch = tw_arena_create();
  if (!next.scratch) return TW_NO_MEMORY;
  tw_status status = tw_feature_mesh_refine(&next, s, step, &child);
  continue_in(l, next.scratch);
  *s = child;
  return status;
}

/* Cuts the feature mesh back to the faces round vertices that are still features. */
static tw_status cut_back(tw_exceptions *l, tw_feature_mesh *s) {
  tw_feature_mesh cut;
  tw_exceptions next = *l;
  next.scratch = tw_arena_create();
  if (!next.scratch) return TW_NO_MEMORY;
  tw_status status = tw_feature_mesh_cut(&next, s, &cut);
  continue_in(l, next.scratch);
  *s = cut;
  return status;
}

static tw_status list_from(tw_exceptions *l, tw_feature_mesh *s) {
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
  return status == TW_OK ? tw_exceptions_list_rows(l, s) : status;
}

static tw_status list_all(tw_exceptions *l) {
  const tw_shallow_inputs *inputs = l->inputs;
  tw_feature_mesh cage = {0};
  for (uint32_t f = 0; f < inputs->field_count; f++) cage.fields[f] = *inputs->fields[f];
  if (inputs->frames) {
    cage.frames = tw_arena_alloc_raw(l->scratch, cage.fields[0].face_count, 1);
    if (!cage.frames) return TW_NO_MEMORY;
    memcpy(cage.frames, inputs->frames, cage.fields[0].face_count);
  }
  tw_status status = tw_feature_mesh_mark(l, &cage, NULL);
  if (status != TW_OK || !memchr(cage.is_feature, 1, cage.fields[0].vertex_count)) return status;
  uint64_t size = tw_exceptions_size(l, &cage);
  *inputs->is_large = size > inputs->exceptions_max;
  if (*inputs->is_large) return TW_LIMIT;
  status = cut_back(l, &cage);
  return status == TW_OK ? list_from(l, &cage) : status;
}

tw_status tw_shallow_list_exceptions(const tw_shallow_inputs *inputs, tw_arena *arena, tw_shallow *out,
                                     tw_shallow_rows *rows) {
  tw_exceptions l = {inputs, arena, tw_arena_create(), out, rows};
  *rows = (tw_shallow_rows){.row_count = tw_shallow_points(&out[0])};
  tw_status status = l.scratch ? list_all(&l) : TW_NO_MEMORY;
  tw_arena_destroy(l.scratch);
  return status;
}
