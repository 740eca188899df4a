#include "exception_rows.h"

#include <string.h>

#include "numbering.h"

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
  const tw_feature_mesh *s;
  tw_numbering numbering;
  bool split_by_seams; /* `numbering` is set: points may have several rows */
  tw_last_mask mask;
  tw_list rows, entries, channels; /* channels: uint32_t, field_count - 1 for each row */
  tangent_mask known[TW_FIELDS_MAX]
                    [2]; /* the last masks of each field: a vertex with a crease has two large ones */
} row_list;

/* Appends the tangent mask of a corner, unless it is known. */
static tangent_mask push_tangents(const tw_exceptions *l, row_list *list, uint32_t field, uint32_t corner) {
  const tw_topology *t = &list->s->fields[field];
  tangent_mask *known = list->known[field],
               new = {tw_limit_corner(t, l->inputs->linear[field], corner), 0, 0};
  for (int i = 0; i < 2; i++)
    if (known[i].end > 0 && known[i].corner == new.corner) return known[i];
  new.first = (uint32_t)list->entries.count;
  tw_push_limit_entries(l, list->s, field, corner, true, &list->mask, &list->entries);
  new.end = (uint32_t)list->entries.count;
  known[1] = known[0];
  known[0] = new;
  return new;
}

static void push_slopes(const tw_exceptions *l, row_list *list, uint32_t corner, row *out) {
  const tw_feature_mesh *s = list->s;
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
      tw_list_push(&list->entries, &sides[e]);
    }
    slopes->first = first;
    slopes->end = first + 2;
  }
}

/* Appends one of the rows of a point, at the corner that represents it. whole: NULL, or another row of the
 * point whose normal it shares. */
static void push_row(const tw_exceptions *l, row_list *list, uint32_t number, uint32_t corner,
                     const row *whole) {
  const tw_feature_mesh *s = list->s;
  const tw_topology *t = &s->fields[0];
  row own = {
      .row = number, .point = s->vertices[0][t->corner_vertex[corner]], .channels = list->channels.count};
  for (uint32_t f = 1; f < l->inputs->field_count; f++)
    tw_list_push(&list->channels, &s->vertices[f][s->fields[f].corner_vertex[corner]]);
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
  tw_list_push(&list->rows, &own);
}

/* Appends the rows of one point. The first row has the point's own number. new_row: [rows of the feature
 * mesh's numbering] the number in the level, UINT32_MAX where not yet given. */
static void push_rows(const tw_exceptions *l, row_list *list, uint32_t v, uint32_t *new_row) {
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
static tw_status list_corners(const tw_exceptions *l, const row_list *list, const uint32_t *new_row) {
  const tw_feature_mesh *s = list->s;
  const tw_topology *t = &s->fields[0];
  tw_list corners = {.size = sizeof(uint32_t)}, rows = {.size = sizeof(uint32_t)};
  for (uint32_t c = 0; c < t->corner_count; c++) {
    uint32_t v = t->corner_vertex[c];
    if (!s->is_feature[v]) continue;
    uint32_t number = new_row[list->numbering.corner_row[c]];
    if (number == s->vertices[0][v]) continue;
    tw_list_push(&corners, &s->corners[c]);
    tw_list_push(&rows, &number);
  }
  l->rows->corner_count = (uint32_t)corners.count;
  l->rows->corners = tw_list_move(&corners, l->arena);
  l->rows->corner_rows = tw_list_move(&rows, l->arena);
  return l->rows->corners && l->rows->corner_rows ? TW_OK : TW_NO_MEMORY;
}

static int compare_rows(const void *left, const void *right) {
  const row *a = left, *b = right;
  return a->row < b->row ? -1 : a->row > b->row;
}

static tw_status store_rows(const tw_exceptions *l, row_list *list) {
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
  out->entries = tw_list_move(&list->entries, l->arena);
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
static tw_status number_split(const tw_exceptions *l, row_list *list, uint32_t **new_row) {
  const tw_feature_mesh *s = list->s;
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

tw_status tw_exceptions_list_rows(const tw_exceptions *l, const tw_feature_mesh *s) {
  row_list list = {.s = s,
                   .rows = {.size = sizeof(row)},
                   .entries = {.size = sizeof(tw_limit_entry)},
                   .channels = {.size = sizeof(uint32_t)}};
  uint32_t *new_row = NULL;
  tw_status status = number_split(l, &list, &new_row);
  list.mask.entries = tw_feature_mask_room(l, s);
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
