/* Values of corners of the mesh that a change makes: old ones, means of them, and equal ones joined where two
 * edges became one. */
#include <string.h>

#include "change_maker.h"
#include "union_find.h"
#include "weld.h"

/* ---- edges that become one ---------------------------------------------------------------------------- */

/* An edge of two faces that were at different edges before. */
typedef struct welded_edge {
  uint32_t ends[2][2]; /* the corners at each of its ends, of both faces */
} welded_edge;

typedef struct welded_edges {
  welded_edge *edges; /* [count], of tw_alloc */
  uint32_t count;
} welded_edges;

/* A side of a face, from one corner to the corner behind, at least one of whose points was several before. */
typedef struct side {
  uint32_t low, high, corner, behind;
} side;

static int compare_sides(const void *left, const void *right) {
  const side *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  if (a->high != b->high) return a->high < b->high ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

/* Flags the new points at which corners of several old points are: [point_count]. NULL without memory. *any:
 * whether there is one. */
static uint8_t *flag_merged(const tw_change_maker *m, bool *any) {
  const tw_change *c = m->change;
  uint8_t *merged = tw_alloc_zero(c->point_count, 1);
  uint32_t *first = tw_alloc(c->point_count, sizeof *first);
  *any = false;
  if (first && c->point_count > 0) memset(first, 0xFF, c->point_count * sizeof *first);
  for (uint32_t i = 0; merged && first && i < c->corner_count; i++) {
    if (c->corner_parents[i] >= m->from->corner_count) continue;
    uint32_t old = m->from->corners[c->corner_parents[i]], *known = &first[c->corners[i]];
    if (*known == UINT32_MAX) *known = old;
    merged[c->corners[i]] |= *known != old;
    *any |= *known != old;
  }
  if (!first) {
    tw_free(merged);
    return NULL;
  }
  tw_free(first);
  return merged;
}

static uint32_t list_sides(const tw_change_maker *m, const uint8_t *merged, side *sides) {
  const tw_change *c = m->change;
  uint32_t count = 0;
  for (uint32_t f = 0; f < c->face_count; f++)
    for (uint32_t i = c->face_offsets[f]; i < c->face_offsets[f + 1]; i++) {
      uint32_t behind = tw_corner_behind(c, f, i), a = c->corners[i], b = c->corners[behind];
      if (merged[a] || merged[b]) sides[count++] = (side){a < b ? a : b, a < b ? b : a, i, behind};
    }
  return count;
}

/* Keeps the pairs of opposite sides that were at different edges. sides: sorted. */
static void pair_sides(const tw_change *c, const side *sides, uint32_t count, welded_edges *out) {
  for (uint32_t i = 0, end; i < count; i = end) {
    for (end = i + 1; end < count && sides[end].low == sides[i].low && sides[end].high == sides[i].high;)
      end++;
    const side *a = &sides[i], *b = &sides[i + 1];
    if (end - i != 2 || c->corners[a->corner] != c->corners[b->behind]) continue;
    uint32_t edge = c->corner_edges[a->corner];
    if (edge != UINT32_MAX && edge == c->corner_edges[b->corner]) continue;
    out->edges[out->count++] = (welded_edge){{{a->corner, b->behind}, {a->behind, b->corner}}};
  }
}

/* Finds the edges that the change has made of two. False without memory. */
static bool find_welded(const tw_change_maker *m, welded_edges *out) {
  bool any, has_room = false;
  uint8_t *merged = flag_merged(m, &any);
  side *sides = merged && any ? tw_alloc(m->change->corner_count, sizeof *sides) : NULL;
  if (sides) {
    uint32_t count = list_sides(m, merged, sides);
    out->edges = tw_alloc(count, sizeof *out->edges);
    has_room = out->edges && tw_sort(sides, count, sizeof *sides, compare_sides) == TW_OK;
    if (has_room) pair_sides(m->change, sides, count, out);
  }
  has_room |= merged && !any;
  tw_free(merged);
  tw_free(sides);
  return has_room;
}

/* ---- values of corners --------------------------------------------------------------------------------- */

/* A new corner whose value is a mean. Such corners of one point share a value where the first and the last
 * terms of their means had the same values. So a seam continues, and the two sides of an edge that is no seam
 * stay joined. */
typedef struct mean {
  uint32_t point, first, last, corner;
} mean;

static int compare_means(const void *left, const void *right) {
  const mean *a = left, *b = right;
  if (a->point != b->point) return a->point < b->point ? -1 : 1;
  if (a->first != b->first) return a->first < b->first ? -1 : 1;
  if (a->last != b->last) return a->last < b->last ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

/* The values of a channel in the making. A corner's value is an old index, or the count of old values plus
 * the number of a new one. */
typedef struct values {
  uint32_t *of_corner; /* [corner_count] */
  uint32_t *number;    /* [old value_count] new index, UINT32_MAX: no longer used */
  mean *means;         /* [mean_count] */
  uint32_t mean_count, new_count;
  float *fresh; /* [new_count][width] */
} values;

static void values_deinit(values *v) {
  tw_free(v->of_corner);
  tw_free(v->number);
  tw_free(v->means);
  tw_free(v->fresh);
}

/* Whether all corners of a mean have the same value. */
static bool is_one_value(const tw_channel *set, const tw_term *terms, uint32_t count) {
  for (uint32_t i = 1; i < count; i++)
    if (set->corners[terms[i].index] != set->corners[terms[0].index]) return false;
  return true;
}

/* Whether a weight is below 0, so that the mean may lie outside its terms: right for UVs, which go on past
 * the edge of a face, and wrong for colours. */
static bool is_beyond(const tw_term *terms, uint32_t count) {
  for (uint32_t i = 0; i < count; i++)
    if (terms[i].weight < 0) return true;
  return false;
}

static bool find_values(const tw_change_maker *m, const tw_channel *set, values *v) {
  const tw_change *c = m->change;
  uint32_t mixes = 0;
  for (uint32_t i = 0; i < c->corner_count; i++) mixes += c->corner_parents[i] >= m->from->corner_count;
  v->of_corner = tw_alloc(c->corner_count, sizeof *v->of_corner);
  v->number = tw_alloc(set->value_count, sizeof *v->number);
  v->means = tw_alloc(mixes, sizeof *v->means);
  v->fresh = tw_alloc(mixes, set->width * sizeof *v->fresh);
  if (!v->of_corner || !v->number || !v->means || !v->fresh) return false;
  for (uint32_t i = 0; i < c->corner_count; i++) {
    uint32_t count;
    tw_term single;
    const tw_term *terms = tw_terms_of(c, c->corner_parents[i], m->from->corner_count, &single, &count);
    uint32_t first = set->corners[terms[0].index], last = set->corners[terms[count - 1].index];
    if (set->is_whole)
      v->of_corner[i] = set->corners[tw_heaviest_term(terms, count)->index];
    else if (is_one_value(set, terms, count))
      v->of_corner[i] = first;
    else
      v->means[v->mean_count++] = (mean){c->corners[i], first, last, i};
  }
  return true;
}

/* Writes the mean of the values at some corners. */
static void write_mean(const tw_channel *set, const tw_term *terms, uint32_t count, float *out) {
  double sum[4] = {0};
  for (uint32_t i = 0; i < count; i++) {
    const float *value = set->values + (size_t)set->width * set->corners[terms[i].index];
    for (uint32_t k = 0; k < set->width; k++) sum[k] += terms[i].weight * (double)value[k];
  }
  for (uint32_t k = 0; k < set->width; k++) out[k] = tw_within_limits(sum[k]);
}

static bool shares_value(const mean *a, const mean *b) {
  return a->point == b->point && a->first == b->first && a->last == b->last;
}

/* Gives means that share a value the first one's; where that would lie outside its terms, and the channel is
 * no UV set, the first one's that does not. Where all do, each has the value of its heaviest term. */
static void join_means(const tw_change_maker *m, const tw_channel *set, bool is_map, const mean *means,
                       uint32_t mean_count, values *v) {
  const tw_change *c = m->change;
  uint32_t count, before = m->from->corner_count, chosen = 0;
  tw_term single;
  const tw_term *terms = NULL;
  for (; chosen < mean_count; chosen++) {
    terms = tw_terms_of(c, c->corner_parents[means[chosen].corner], before, &single, &count);
    if (is_map || !is_beyond(terms, count)) break;
  }
  if (chosen < mean_count) write_mean(set, terms, count, v->fresh + (size_t)set->width * v->new_count++);
  for (uint32_t i = 0; i < mean_count; i++) {
    uint32_t corner = means[i].corner;
    v->of_corner[corner] = set->value_count + v->new_count - 1;
    if (chosen < mean_count) continue;
    terms = tw_terms_of(c, c->corner_parents[corner], before, &single, &count);
    v->of_corner[corner] = set->corners[tw_heaviest_term(terms, count)->index];
  }
}

/* is_map: the channel is a UV set. */
static bool join_values(const tw_change_maker *m, const tw_channel *set, bool is_map, values *v) {
  if (tw_sort(v->means, v->mean_count, sizeof *v->means, compare_means) != TW_OK) return false;
  for (uint32_t i = 0, end; i < v->mean_count; i = end) {
    for (end = i + 1; end < v->mean_count && shares_value(&v->means[i], &v->means[end]);) end++;
    join_means(m, set, is_map, v->means + i, end - i, v);
  }
  return true;
}

/* The value at a corner, in the making. */
static const float *value_row(const tw_channel *set, const values *v, uint32_t corner) {
  uint32_t value = v->of_corner[corner];
  return value < set->value_count ? set->values + (size_t)set->width * value
                                  : v->fresh + (size_t)set->width * (value - set->value_count);
}

/* A corner of a new point, with its value. */
typedef struct corner_value {
  uint32_t point, value, corner;
} corner_value;

static int compare_corner_values(const void *left, const void *right) {
  const corner_value *a = left, *b = right;
  if (a->point != b->point) return a->point < b->point ? -1 : 1;
  if (a->value != b->value) return a->value < b->value ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

static bool same_rows(const tw_channel *set, const values *v, uint32_t a, uint32_t b) {
  return tw_compare_floats(value_row(set, v, a), value_row(set, v, b), set->width) == 0;
}

/* Where the change has made two edges one, makes equal values on its two sides one, as readers do where they
 * weld. All other seams stay: values that are equal and not one are a seam of the mesh's. */
static bool join_welded(const tw_change_maker *m, const welded_edges *welded, const tw_channel *set,
                        values *v) {
  const tw_change *c = m->change;
  uint32_t *joined = tw_alloc(c->corner_count, sizeof *joined);
  corner_value *sorted = tw_alloc(c->corner_count, sizeof *sorted);
  bool has_room = joined && sorted;
  for (uint32_t i = 0; has_room && i < c->corner_count; i++)
    sorted[i] = (corner_value){c->corners[i], v->of_corner[i], i};
  has_room = has_room && tw_sort(sorted, c->corner_count, sizeof *sorted, compare_corner_values) == TW_OK;
  if (has_room) tw_union_find_init(joined, c->corner_count);
  for (uint32_t i = 1; has_room && i < c->corner_count; i++)
    if (sorted[i].point == sorted[i - 1].point && sorted[i].value == sorted[i - 1].value)
      tw_union_find_join(joined, sorted[i].corner, sorted[i - 1].corner);
  for (uint32_t i = 0; has_room && i < welded->count; i++) {
    const welded_edge *edge = &welded->edges[i];
    if (!same_rows(set, v, edge->ends[0][0], edge->ends[0][1]) ||
        !same_rows(set, v, edge->ends[1][0], edge->ends[1][1]))
      continue;
    for (int k = 0; k < 2; k++) tw_union_find_join(joined, edge->ends[k][0], edge->ends[k][1]);
  }
  for (uint32_t i = 0; has_room && i < c->corner_count; i++)
    v->of_corner[i] = v->of_corner[tw_union_find_root(joined, i)];
  tw_free(sorted);
  tw_free(joined);
  return has_room;
}

/* Writes the old values that corners still use, in their order, then the new ones. */
static bool number_values(const tw_change_maker *m, const tw_channel *from, values *v, tw_channel *to) {
  uint32_t corner_count = m->change->corner_count, kept = 0;
  size_t row = from->width * sizeof(float);
  memset(v->number, 0xFF, from->value_count * sizeof *v->number);
  for (uint32_t i = 0; i < corner_count; i++)
    if (v->of_corner[i] < from->value_count) v->number[v->of_corner[i]] = 0;
  for (uint32_t i = 0; i < from->value_count; i++)
    if (v->number[i] == 0) v->number[i] = kept++;
  uint32_t *corners = tw_arena_alloc_raw(m->arena, corner_count, sizeof *corners);
  float *out = tw_arena_alloc_raw(m->arena, (size_t)kept + v->new_count, row);
  if (!corners || !out) return false;
  for (uint32_t i = 0; i < from->value_count; i++)
    if (v->number[i] != UINT32_MAX)
      memcpy(out + from->width * (size_t)v->number[i], from->values + from->width * (size_t)i, row);
  if (v->new_count > 0) memcpy(out + from->width * (size_t)kept, v->fresh, v->new_count * row);
  for (uint32_t i = 0; i < corner_count; i++) {
    uint32_t value = v->of_corner[i];
    corners[i] = value < from->value_count ? v->number[value] : kept + (value - from->value_count);
  }
  *to = (tw_channel){from->width, kept + v->new_count, out, corners, from->is_whole};
  return true;
}

static bool make_channel(const tw_change_maker *m, const welded_edges *welded, const tw_channel *from,
                         bool is_map, tw_channel *to) {
  values v = {0};
  bool has_room = find_values(m, from, &v) && join_values(m, from, is_map, &v) &&
                  (welded->count == 0 || join_welded(m, welded, from, &v)) && number_values(m, from, &v, to);
  values_deinit(&v);
  return has_room;
}

bool tw_change_make_channels(const tw_change_maker *m) {
  tw_channel channels[TW_CHANNELS_MAX], made[TW_CHANNELS_MAX];
  uint32_t count = tw_mesh_channels(m->from, channels);
  welded_edges welded = {0};
  bool has_room = count == 0 || find_welded(m, &welded);
  for (uint32_t i = 0; i < count && has_room; i++)
    has_room = make_channel(m, &welded, &channels[i], i < m->from->uv_set_count, &made[i]);
  /* make_points has allocated the attributes of the mesh that is made. */
  if (has_room) tw_mesh_set_channels(m->to, made, (tw_attribute *)m->to->attributes);
  tw_free(welded.edges);
  return has_room;
}
