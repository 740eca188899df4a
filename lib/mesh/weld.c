/* Welds vertices along shared edges. Everything is grouped by sorting in buckets, which hashes only choose:
 * no input takes longer than n log n, and the result does not depend on the hash. */
#include "weld.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bucket_sort.h"
#include "face_faults.h"
#include "union_find.h"

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "out of memory");
}

/* ---- equal positions ------------------------------------------------------------------------- */

/* Rows of numbers to compare. A magnitude below `tiny` counts as 0: generators close their shapes at an angle
 * of 2 pi, whose computed sine is not quite 0. All other numbers are compared exactly. */
typedef struct places {
  const float *rows; /* [][width] */
  uint32_t width;
  float tiny;
  const tw_soup *soup; /* whose `compare` tells equal rows apart, or NULL */
} places;

/* What is smaller than the size of a shape by this factor is no part of the shape. The computed sine of 2 pi
 * in 32 bits is 1.7e-7 instead of 0; 2^-20 leaves room. */
#define TINY 0x1p-20f

/* The greatest extent of the faces along an axis: points that no face uses may lie anywhere. Compared by
 * hand: fminf is a call. */
static float greatest_extent(const tw_soup *soup) {
  float least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY}, out = 0;
  for (uint32_t c = 0; c < soup->corner_count; c++)
    for (size_t axis = 0; axis < 3; axis++) {
      float value = soup->positions[3 * (size_t)soup->corners[c] + axis];
      least[axis] = value < least[axis] ? value : least[axis];
      most[axis] = value > most[axis] ? value : most[axis];
    }
  for (size_t axis = 0; axis < 3; axis++) out = fmaxf(out, most[axis] - least[axis]);
  return out;
}

/* Relative to the shape where that lies far from the origin: a cube of one metre there may have one metre as
 * a coordinate. 0 where no coordinate but 0 is so small, whatever the extent. */
static float tiny_coordinate(const tw_soup *soup) {
  float greatest = 0, least = INFINITY;
  for (size_t i = 0; i < 3 * (size_t)soup->vertex_count; i++) {
    float value = fabsf(soup->positions[i]);
    greatest = value > greatest ? value : greatest;
    least = value > 0 && value < least ? value : least;
  }
  return least < greatest * TINY ? fminf(greatest, greatest_extent(soup)) * TINY : 0;
}

static float coordinate(const places *at, uint32_t row, size_t axis) {
  float value = at->rows[at->width * (size_t)row + axis];
  return fabsf(value) < at->tiny ? 0 : value;
}

static int compare_further(const places *at, uint32_t a, uint32_t b) {
  return at->soup && at->soup->compare ? at->soup->compare(at->soup->context, a, b) : 0;
}

static bool place_less(const places *at, uint32_t a, uint32_t b) {
  for (size_t axis = 0; axis < at->width; axis++) {
    float p = coordinate(at, a, axis), q = coordinate(at, b, axis);
    if (p != q) return p < q;
  }
  int order = compare_further(at, a, b);
  return order != 0 ? order < 0 : a < b;
}

static bool same_row(const places *at, uint32_t a, uint32_t b) {
  for (size_t axis = 0; axis < at->width; axis++)
    if (coordinate(at, a, axis) != coordinate(at, b, axis)) return false;
  return compare_further(at, a, b) == 0;
}

static uint32_t hash_row(const places *at, uint32_t row) {
  uint64_t hash = 0;
  for (size_t axis = 0; axis < at->width; axis++) {
    float value = coordinate(at, row, axis) + 0.0f; /* -0 is equal to 0, and -0 + 0 is 0 */
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
  }
  return (uint32_t)hash;
}

/* Which rows are sorted, and in which bucket each belongs. */
typedef struct row_order {
  places at;
  const uint32_t *rows;   /* ascending */
  const uint32_t *hashes; /* of all rows */
  uint32_t bucket_mask;
} row_order;

static uint32_t row_bucket(const void *context, uint32_t i) {
  const row_order *order = context;
  return order->hashes[order->rows[i]] & order->bucket_mask;
}

static bool row_less(const void *context, uint32_t a, uint32_t b) {
  const row_order *order = context;
  return place_less(&order->at, order->rows[a], order->rows[b]);
}

/* first: [count] receives for each row the first equal row. hashes, rows, sorted: [count] scratch. */
static tw_status join_alike(const places *at, uint32_t count, uint32_t *hashes, uint32_t *rows,
                            uint32_t *sorted, uint32_t *first, bool *split, tw_error *error) {
  enum { ROWS = 1024, STEPS = 4 * ROWS }; /* charged at once, and what they take */
  for (uint32_t i = 0; i < count; i++) {
    if (i % ROWS == 0 && !tw_work(STEPS)) return tw_work_status(error);
    hashes[i] = hash_row(at, i);
    first[i] = i;
  }
  uint32_t alike, buckets;
  tw_status status = tw_list_alike(hashes, count, rows, &alike, error);
  if (status != TW_OK) return status;
  for (buckets = 1; buckets < alike && buckets < 1u << 31;) buckets *= 2;
  const row_order order = {*at, rows, hashes, buckets - 1};
  status = tw_sort_in_buckets(row_bucket, alike, buckets, row_less, &order, sorted, error);
  for (uint32_t i = 1; i < alike && status == TW_OK; i++) {
    if (i % ROWS == 0 && !tw_work(STEPS)) status = tw_work_status(error);
    uint32_t row = rows[sorted[i]], before = rows[sorted[i - 1]];
    if (!same_row(at, row, before)) continue;
    first[row] = first[before];
    *split = true;
  }
  return status;
}

/* first: [count] receives for each row the first equal row. *split: whether any two rows are equal. */
static tw_status find_places(places at, uint32_t count, uint32_t *first, bool *split, tw_error *error) {
  size_t rows = count;
  uint32_t *scratch = tw_alloc(rows, 3 * sizeof *scratch);
  *split = false;
  if (!scratch) return no_memory(error);
  tw_status status = join_alike(&at, count, scratch, scratch + rows, scratch + 2 * rows, first, split, error);
  tw_free(scratch);
  return status;
}

int tw_compare_floats(const float *a, const float *b, size_t count) {
  for (size_t i = 0; i < count; i++)
    if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
  return 0;
}

tw_status tw_find_equal_rows(const float *rows, uint32_t width, uint32_t count, uint32_t *first,
                             tw_error *error) {
  bool split;
  return find_places((places){.rows = rows, .width = width}, count, first, &split, error);
}

/* ---- edges along the same positions ---------------------------------------------------------- */

/* A face's side, from vertex `from` to vertex `to`. */
typedef struct side {
  uint32_t from, to, face;
} side;

typedef struct side_list {
  const side *sides;
  const uint32_t *place; /* [vertex_count] the first vertex at each vertex's place */
} side_list;

/* The lower, and then the higher, of the places at a side's ends. */
static uint32_t low_end(const void *context, uint32_t index) {
  const side_list *list = context;
  uint32_t from = list->place[list->sides[index].from], to = list->place[list->sides[index].to];
  return from < to ? from : to;
}

static uint32_t high_end(const side_list *list, uint32_t index) {
  uint32_t from = list->place[list->sides[index].from], to = list->place[list->sides[index].to];
  return from < to ? to : from;
}

static bool side_less(const void *context, uint32_t a, uint32_t b) {
  uint32_t p = high_end(context, a), q = high_end(context, b);
  return p != q ? p < q : a < b;
}

static uint32_t next_corner(const tw_soup *soup, uint32_t face, uint32_t corner) {
  return corner + 1 < soup->face_offsets[face + 1] ? corner + 1 : soup->face_offsets[face];
}

/* Lists the sides that touch a place with several vertices; other sides have nothing to join. left_out: or
 * NULL. *has_short: whether a side has both ends at one place. */
static uint32_t collect_sides(const tw_soup *soup, const uint32_t *place, const bool *several,
                              const uint8_t *left_out, side *sides, bool *has_short) {
  uint32_t count = 0;
  *has_short = false;
  for (uint32_t face = 0; face < soup->face_count; face++)
    for (uint32_t c = soup->face_offsets[face]; c < soup->face_offsets[face + 1]; c++) {
      uint32_t from = soup->corners[c], to = soup->corners[next_corner(soup, face, c)];
      uint32_t p = place[from], q = place[to];
      if (left_out && left_out[face]) continue;
      *has_short |= p == q;
      if (p == q || (!several[p] && !several[q])) continue;
      sides[count++] = (side){from, to, face};
    }
  return count;
}

/* The end of the sides that begin at `begin` and lie between the same two places. order: the sides by (low
 * end, high end). */
static uint32_t group_end(const side_list *list, const uint32_t *order, uint32_t begin, uint32_t count) {
  uint32_t low = low_end(list, order[begin]), high = high_end(list, order[begin]), end = begin + 1;
  while (end < count && low_end(list, order[end]) == low && high_end(list, order[end]) == high) end++;
  return end;
}

static bool runs_upward(const side_list *list, const side *s) {
  return list->place[s->from] < list->place[s->to];
}

/* Steps of work of a group of sides, whose vertices lie anywhere. Loops over groups end where the result is
 * not wanted any more: what calls them asks tw_work_status. */
enum { GROUP_STEPS = 16 };

/* Values of vertices: [vertex_count][width]. */
typedef struct value_rows {
  const float *rows;
  uint32_t width;
} value_rows;

static bool same_value(const value_rows *values, uint32_t a, uint32_t b) {
  const float *p = values->rows + values->width * (size_t)a, *q = values->rows + values->width * (size_t)b;
  return tw_compare_floats(p, q, values->width) == 0;
}

static void join_pair(const side *a, const side *b, uint32_t *joined) {
  tw_union_find_join(joined, a->from, b->to);
  tw_union_find_join(joined, a->to, b->from);
}

/* ---- values along an edge -------------------------------------------------------------------- */

/* Joins the ends of each pair of opposite sides with the same values at both ends. */
static void join_values(const side_list *list, const uint32_t *order, uint32_t count,
                        const value_rows *values, uint32_t *joined) {
  for (uint32_t i = 0, end; i < count && tw_work(GROUP_STEPS); i = end) {
    end = group_end(list, order, i, count);
    const side *a = &list->sides[order[i]], *b = &list->sides[order[end - 1]];
    if (end - i != 2 || a->face == b->face || runs_upward(list, a) == runs_upward(list, b)) continue;
    if (same_value(values, a->from, b->to) && same_value(values, a->to, b->from)) join_pair(a, b, joined);
  }
}

/* ---- slivers --------------------------------------------------------------------------------- */

/* Marks in left_out while slivers are searched for; at the end 0 and 1 alone are left. */
enum { STAYS, LEFT_OUT, SLIVER, NO_SLIVER };

/* Whether all sides of a face were listed, so that all other faces there are known. */
static bool is_listed(const tw_soup *soup, const uint32_t *place, const bool *several, uint32_t face) {
  for (uint32_t c = soup->face_offsets[face]; c < soup->face_offsets[face + 1]; c++)
    if (!several[place[soup->corners[c]]] && !several[place[soup->corners[next_corner(soup, face, c)]]])
      return false;
  return true;
}

/* The sides of a soup, sorted, and what is found about its faces. */
typedef struct welding {
  const tw_soup *soup;
  side_list list;
  const bool *several; /* [vertex_count], read at a place's first vertex */
  uint32_t *order;     /* [count] sides */
  uint32_t count;
  uint32_t *joined;  /* [vertex_count] disjoint sets of vertices */
  uint8_t *left_out; /* [face_count] */
} welding;

static const side *side_at(const welding *w, uint32_t i) {
  return &w->list.sides[w->order[i]];
}

/* Marks slivers that share an edge with more than one other side. Returns how many. */
static uint32_t mark_slivers(const welding *w) {
  uint32_t found = 0;
  double height = 0; /* below it a face is a sliver; 0 until a face is looked at */
  for (uint32_t i = 0, end; i < w->count && tw_work(GROUP_STEPS); i = end) {
    end = group_end(&w->list, w->order, i, w->count);
    if (end - i > 2 && height == 0) height = (double)(TINY * greatest_extent(w->soup));
    for (uint32_t k = i; k < end && end - i > 2; k++) {
      uint32_t face = side_at(w, k)->face;
      if (w->left_out[face] != STAYS) continue;
      bool is_sliver =
          tw_is_sliver(w->soup, face, height) && is_listed(w->soup, w->list.place, w->several, face);
      w->left_out[face] = is_sliver ? SLIVER : NO_SLIVER;
      found += is_sliver;
    }
  }
  return found;
}

/* Keeps a sliver that another face needs: without it their edge would be a border. */
static void keep_needed(const welding *w) {
  for (uint32_t i = 0, end; i < w->count && tw_work(GROUP_STEPS); i = end) {
    end = group_end(&w->list, w->order, i, w->count);
    if (end - i != 2) continue;
    uint8_t *a = &w->left_out[side_at(w, i)->face], *b = &w->left_out[side_at(w, i + 1)->face];
    if (*a == SLIVER && *b != SLIVER) *a = NO_SLIVER;
    if (*b == SLIVER && *a != SLIVER) *b = NO_SLIVER;
  }
}

/* Leaves out slivers that lie between the two sides of a seam. Returns how many. */
static uint32_t leave_out_slivers(welding *w) {
  uint32_t left = 0, kept = 0;
  if (mark_slivers(w) > 0) keep_needed(w);
  for (uint32_t face = 0; face < w->soup->face_count; face++) {
    left += w->left_out[face] == SLIVER;
    w->left_out[face] = w->left_out[face] == SLIVER || w->left_out[face] == LEFT_OUT;
  }
  for (uint32_t i = 0; i < w->count; i++)
    if (!w->left_out[side_at(w, i)->face]) w->order[kept++] = w->order[i];
  w->count = kept;
  return left;
}

/* ---- pairs of sides -------------------------------------------------------------------------- */

static uint32_t low_vertex(const side_list *list, const side *s) {
  return runs_upward(list, s) ? s->from : s->to;
}
static uint32_t high_vertex(const side_list *list, const side *s) {
  return runs_upward(list, s) ? s->to : s->from;
}

/* Orders sides between the same places by the exact positions of their ends. */
static int compare_exactly(const welding *w, uint32_t a, uint32_t b) {
  const side *p = &w->list.sides[a], *q = &w->list.sides[b];
  const float *at = w->soup->positions;
  int order = tw_compare_floats(at + 3 * (size_t)low_vertex(&w->list, p),
                                at + 3 * (size_t)low_vertex(&w->list, q), 3);
  return order != 0 ? order
                    : tw_compare_floats(at + 3 * (size_t)high_vertex(&w->list, p),
                                        at + 3 * (size_t)high_vertex(&w->list, q), 3);
}

static bool exactly_less(const void *context, uint32_t a, uint32_t b) {
  int order = compare_exactly(context, a, b);
  return order != 0 ? order < 0 : a < b;
}

/* Joins two sides that run in opposite directions. Returns 1 if they run the same way and do not share both
 * vertices. */
static uint32_t join_opposite(const welding *w, const side *a, const side *b) {
  if (a->face == b->face) return 0; /* a face as thin as a line */
  if (runs_upward(&w->list, a) == runs_upward(&w->list, b)) return a->from != b->from || a->to != b->to;
  join_pair(a, b, w->joined);
  return 0;
}

/* Joins each pair of opposite sides, where no third side runs between the same two places. Where one does,
 * two alone between exactly the same positions are joined: a plate thinner than a tiny coordinate stays
 * closed. Returns how many pairs run the same way. */
static uint32_t join_pairs(const welding *w) {
  uint32_t reversed = 0;
  for (uint32_t i = 0, end; i < w->count && tw_work(GROUP_STEPS); i = end) {
    end = group_end(&w->list, w->order, i, w->count);
    if (end - i == 2) reversed += join_opposite(w, side_at(w, i), side_at(w, i + 1));
    if (end - i <= 2) continue;
    tw_sort_items(w->order + i, end - i, exactly_less, w);
    for (uint32_t k = i, stop; k < end; k = stop) {
      for (stop = k + 1; stop < end; stop++)
        if (compare_exactly(w, w->order[k], w->order[stop]) != 0) break;
      if (stop - k == 2) join_opposite(w, side_at(w, k), side_at(w, k + 1));
    }
  }
  return reversed;
}

/* ---- open seams ------------------------------------------------------------------------------ */

/* Orders sides between the same places by the points at their ends. */
static int compare_points(const welding *w, uint32_t a, uint32_t b) {
  const side *p = &w->list.sides[a], *q = &w->list.sides[b];
  uint32_t low[2] = {tw_union_find_root(w->joined, low_vertex(&w->list, p)),
                     tw_union_find_root(w->joined, low_vertex(&w->list, q))};
  uint32_t high[2] = {tw_union_find_root(w->joined, high_vertex(&w->list, p)),
                      tw_union_find_root(w->joined, high_vertex(&w->list, q))};
  if (low[0] != low[1]) return low[0] < low[1] ? -1 : 1;
  return high[0] < high[1] ? -1 : high[0] > high[1];
}

static bool points_less(const void *context, uint32_t a, uint32_t b) {
  int order = compare_points(context, a, b);
  return order != 0 ? order < 0 : a < b;
}

/* Counts the sides that are alone at their points although others run between the same places. */
static uint32_t count_open(const welding *w) {
  uint32_t open = 0;
  for (uint32_t i = 0, end; i < w->count && tw_work(GROUP_STEPS); i = end) {
    end = group_end(&w->list, w->order, i, w->count);
    if (end - i <= 2) continue; /* joined, or wound against each other, which is told apart */
    tw_sort_items(w->order + i, end - i, points_less, w);
    uint32_t alone = 0;
    for (uint32_t k = i; k < end; k++) {
      bool is_first = k == i || compare_points(w, w->order[k - 1], w->order[k]) != 0;
      bool is_last = k + 1 == end || compare_points(w, w->order[k], w->order[k + 1]) != 0;
      alone += is_first && is_last;
    }
    open += alone > 1 ? alone : 0;
  }
  return open;
}

/* ---- both ------------------------------------------------------------------------------------ */

/* Sides and their order, for points and for values of corners. */
typedef struct side_arrays {
  side *sides;     /* [corner_count] */
  uint32_t *order; /* [corner_count] */
  bool *several;   /* [vertex_count] */
  uint32_t count;
  bool has_short;
} side_arrays;

static void side_arrays_deinit(side_arrays *arrays) {
  tw_free(arrays->sides);
  tw_free(arrays->order);
  tw_free(arrays->several);
}

/* place: [vertex_count] the first vertex at each vertex's place. left_out: or NULL. The caller frees the
 * arrays on failure too. */
static tw_status sort_sides(const tw_soup *soup, const uint32_t *place, const uint8_t *left_out,
                            side_arrays *out, tw_error *error) {
  *out = (side_arrays){tw_alloc(soup->corner_count, sizeof *out->sides),
                       tw_alloc(soup->corner_count, sizeof *out->order),
                       tw_alloc_zero(soup->vertex_count, sizeof *out->several), 0, false};
  if (!out->sides || !out->order || !out->several) return no_memory(error);
  for (uint32_t v = 0; v < soup->vertex_count; v++)
    if (place[v] != v) out->several[place[v]] = true;
  out->count = collect_sides(soup, place, out->several, left_out, out->sides, &out->has_short);
  const side_list list = {out->sides, place};
  return tw_sort_in_buckets(low_end, out->count, soup->vertex_count, side_less, &list, out->order, error);
}

/* Joins corners of one face that follow each other at one place. */
static void join_short_sides(const welding *w) {
  for (uint32_t face = 0; face < w->soup->face_count; face++)
    for (uint32_t c = w->soup->face_offsets[face]; c < w->soup->face_offsets[face + 1] && !w->left_out[face];
         c++) {
      uint32_t from = w->soup->corners[c], to = w->soup->corners[next_corner(w->soup, face, c)];
      if (from != to && w->list.place[from] == w->list.place[to]) tw_union_find_join(w->joined, from, to);
    }
}

/* Joins vertices. joined: [vertex_count] every vertex its own root before; afterwards the joined sets. */
static tw_status join_points(const tw_soup *soup, const uint32_t *place, uint32_t *joined, uint8_t *left_out,
                             tw_welded *out, tw_error *error) {
  side_arrays arrays;
  tw_status status = sort_sides(soup, place, left_out, &arrays, error);
  if (status == TW_OK) {
    welding w = {.soup = soup,
                 .list = {arrays.sides, place},
                 .several = arrays.several,
                 .order = arrays.order,
                 .count = arrays.count,
                 .joined = joined,
                 .left_out = left_out};
    out->slivers = leave_out_slivers(&w);
    out->reversed_edges = join_pairs(&w);
    if (arrays.has_short) join_short_sides(&w);
    out->open_edges = count_open(&w);
    status = tw_work_status(error);
  }
  side_arrays_deinit(&arrays);
  return status;
}

size_t tw_weld_size(uint32_t vertex_count, uint32_t corner_count) {
  /* Always: places and sets. Then either the hashes, order and buckets of vertices, or the sides, their order
   * and their buckets. */
  size_t vertices = vertex_count, corners = corner_count;
  size_t finding = 20 * vertices, joining = 5 * vertices + 16 * corners;
  return 8 * vertices + (finding > joining ? finding : joining) + 256;
}

/* Numbers the sets in the order of their roots, the first vertex of each. number: [count] receives each
 * vertex's number. */
static uint32_t number_roots(uint32_t *sets, uint32_t count, uint32_t *number) {
  uint32_t numbers = 0;
  for (uint32_t v = 0; v < count; v++) {
    uint32_t root = tw_union_find_root(sets, v);
    number[v] = root == v ? numbers++ : number[root];
  }
  return numbers;
}

/* Marks the faces to leave out by what they are alone, then joins points. place, joined: [vertex_count]
 * scratch. */
static tw_status weld_points(const tw_soup *soup, uint32_t *place, uint32_t *joined, uint8_t *left_out,
                             tw_welded *out, tw_error *error) {
  bool split = false;
  const places at = {.rows = soup->positions, .width = 3, .tiny = tiny_coordinate(soup), .soup = soup};
  tw_status status = find_places(at, soup->vertex_count, place, &split, error);
  if (status != TW_OK) return status;
  if (split) out->collapsed = tw_mark_collapsed(soup, place, left_out);
  status = tw_mark_doubled(soup, place, left_out, &out->doubled, error);
  return status == TW_OK && split ? join_points(soup, place, joined, left_out, out, error) : status;
}

tw_status tw_weld_points(const tw_soup *soup, uint32_t *point_of_vertex, uint8_t *left_out, tw_welded *out,
                         tw_error *error) {
  *out = (tw_welded){0};
  uint32_t *place = tw_alloc(soup->vertex_count, 2 * sizeof *place);
  if (!place) return no_memory(error);
  uint32_t *joined = place + soup->vertex_count;
  tw_union_find_init(joined, soup->vertex_count);
  if (soup->face_count > 0) memset(left_out, 0, soup->face_count);
  tw_status status = weld_points(soup, place, joined, left_out, out, error);
  if (status == TW_OK) out->point_count = number_roots(joined, soup->vertex_count, point_of_vertex);
  tw_free(place);
  return status;
}

tw_status tw_share_places(const tw_soup *soup, bool *out) {
  uint32_t *first = tw_alloc(soup->vertex_count, sizeof *first);
  const places at = {.rows = soup->positions, .width = 3, .tiny = tiny_coordinate(soup)};
  tw_status status = first ? find_places(at, soup->vertex_count, first, out, NULL) : TW_NO_MEMORY;
  tw_free(first);
  return status;
}

/* ---- values of corners ----------------------------------------------------------------------- */

/* first: [vertex_count] receives for each vertex the first vertex of its point. */
static tw_status find_first_vertices(const uint32_t *point_of_vertex, uint32_t vertex_count,
                                     uint32_t point_count, uint32_t *first, tw_error *error) {
  for (uint32_t v = 0; v < vertex_count; v++)
    if (point_of_vertex[v] >= point_count)
      return tw_fail(error, TW_INVALID, "point %u is out of range: there are %u", point_of_vertex[v],
                     point_count);
  uint32_t *of_point = tw_alloc(point_count, sizeof *of_point);
  if (!of_point) return no_memory(error);
  for (uint32_t v = vertex_count; v-- > 0;) of_point[point_of_vertex[v]] = v;
  for (uint32_t v = 0; v < vertex_count; v++) first[v] = of_point[point_of_vertex[v]];
  tw_free(of_point);
  return TW_OK;
}

tw_status tw_weld_values(const tw_soup *soup, const uint32_t *point_of_vertex, uint32_t point_count,
                         const float *rows, uint32_t width, uint32_t *value_of_vertex, uint32_t *value_count,
                         tw_error *error) {
  const value_rows values = {rows, width};
  uint32_t *place = tw_alloc(soup->vertex_count, 2 * sizeof *place);
  if (!place) return no_memory(error);
  uint32_t *joined = place + soup->vertex_count;
  side_arrays arrays = {0};
  tw_union_find_init(joined, soup->vertex_count);
  tw_status status = find_first_vertices(point_of_vertex, soup->vertex_count, point_count, place, error);
  if (status == TW_OK) status = sort_sides(soup, place, NULL, &arrays, error);
  const side_list list = {arrays.sides, place};
  if (status == TW_OK) join_values(&list, arrays.order, arrays.count, &values, joined);
  if (status == TW_OK) status = tw_work_status(error);
  side_arrays_deinit(&arrays);
  if (status == TW_OK) *value_count = number_roots(joined, soup->vertex_count, value_of_vertex);
  tw_free(place);
  return status;
}

bool tw_values_part(const uint32_t *point_of_vertex, uint32_t vertex_count, const uint32_t *first_vertices,
                    const float *rows, uint32_t width) {
  const value_rows values = {rows, width};
  for (uint32_t v = 0; v < vertex_count; v++)
    if (!same_value(&values, v, first_vertices[point_of_vertex[v]])) return true;
  return false;
}

/* ---- points near each other ------------------------------------------------------------------ */

/* Points sorted by the cells of a grid whose cells are as wide as the distance. */
typedef struct near_grid {
  const float *positions;
  double distance;
  const uint32_t *order; /* points by their cells' x, then y, then z */
  uint32_t count;
} near_grid;

static double cell_of(const near_grid *grid, uint32_t point, size_t axis) {
  return floor((double)grid->positions[3 * (size_t)point + axis] / grid->distance);
}

static bool cell_less(const void *context, uint32_t a, uint32_t b) {
  for (size_t axis = 0; axis < 3; axis++) {
    double p = cell_of(context, a, axis), q = cell_of(context, b, axis);
    if (p != q) return p < q;
  }
  return a < b;
}

/* The first place in the order whose cell does not come before this one. */
static uint32_t first_in_cell(const near_grid *grid, const double cell[3]) {
  uint32_t begin = 0, end = grid->count;
  while (begin < end) {
    uint32_t middle = begin + (end - begin) / 2;
    double order = 0;
    for (size_t axis = 0; axis < 3 && order == 0; axis++)
      order = cell_of(grid, grid->order[middle], axis) - cell[axis];
    if (order < 0)
      begin = middle + 1;
    else
      end = middle;
  }
  return begin;
}

static bool is_near(const near_grid *grid, uint32_t a, uint32_t b) {
  double square = 0;
  for (size_t axis = 0; axis < 3; axis++) {
    double side =
        (double)grid->positions[3 * (size_t)a + axis] - (double)grid->positions[3 * (size_t)b + axis];
    square += side * side;
  }
  return square <= grid->distance * grid->distance;
}

/* Assigns to `point` every later point near it that is unassigned, that is, still its own first point. */
static void take_near(const near_grid *grid, uint32_t point, uint32_t *first) {
  enum { STEPS = 16 };
  double cell[3], row[3], x = cell_of(grid, point, 0), y = cell_of(grid, point, 1),
                          z = cell_of(grid, point, 2);
  for (int n = 0; n < 9; n++) {
    int across = n / 3, along = n % 3;
    row[0] = cell[0] = x + across - 1;
    row[1] = cell[1] = y + along - 1;
    row[2] = z - 1;
    for (uint32_t i = first_in_cell(grid, row); i < grid->count && tw_work(STEPS); i++) {
      uint32_t other = grid->order[i];
      cell[2] = cell_of(grid, other, 2);
      if (cell_of(grid, other, 0) != cell[0] || cell_of(grid, other, 1) != cell[1] || cell[2] > z + 1) break;
      if (other > point && first[other] == other && is_near(grid, point, other)) first[other] = point;
    }
  }
}

/* Each unassigned point takes the later ones near it, in the points' order. A point that another one took
 * takes none, so that a chain of near points does not become one point. Points that take are more than
 * `distance` apart, so that a cell holds few of them and no point is looked at often. */
static tw_status find_near(const float *positions, uint32_t count, double distance, uint32_t *first,
                           tw_error *error) {
  enum { STEPS = 64 };
  uint32_t *order = tw_alloc(count, sizeof *order);
  if (!order) return no_memory(error);
  const near_grid grid = {positions, distance, order, count};
  for (uint32_t i = 0; i < count; i++) order[i] = first[i] = i;
  tw_sort_items(order, count, cell_less, &grid);
  for (uint32_t i = 0; i < count && tw_work(STEPS); i++)
    if (first[i] == i) take_near(&grid, i, first);
  tw_free(order);
  return tw_work_status(error);
}

tw_status tw_weld_within(const float *positions, uint32_t count, double distance, uint32_t *point_of,
                         uint32_t *point_count, tw_error *error) {
  uint32_t *first = tw_alloc(count, sizeof *first);
  if (!first) return no_memory(error);
  tw_status status = distance > 0 ? find_near(positions, count, distance, first, error)
                                  : tw_find_equal_rows(positions, 3, count, first, error);
  *point_count = 0;
  for (uint32_t i = 0; i < count && status == TW_OK; i++)
    point_of[i] = first[i] == i ? (*point_count)++ : point_of[first[i]];
  tw_free(first);
  return status;
}
