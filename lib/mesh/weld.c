/* Welds vertices along shared edges. Everything is grouped by sorting in buckets. Hashes only choose the
 * bucket: no input takes longer than n log n, and the result does not depend on the hash. */
#include "weld.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "union_find.h"

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "out of memory");
}

/* ---- sorting in buckets ---------------------------------------------------------------------- */

typedef bool less_fn(const void *context, uint32_t a, uint32_t b);

static void sift_down(uint32_t *heap, size_t root, size_t count, less_fn *less, const void *context) {
  for (;;) {
    size_t child = 2 * root + 1;
    if (child >= count) return;
    if (child + 1 < count && less(context, heap[child], heap[child + 1])) child++;
    if (!less(context, heap[root], heap[child])) return;
    uint32_t moved = heap[root];
    heap[root] = heap[child];
    heap[child] = moved;
    root = child;
  }
}

/* Leaves the items in any order where the result is no longer wanted. */
static void sort_items(uint32_t *items, size_t count, less_fn *less, const void *context) {
  enum { SMALL = 12, STEPS = 64 };
  if (count <= SMALL) {
    for (size_t i = 1; i < count; i++) {
      uint32_t item = items[i];
      size_t at = i;
      for (; at > 0 && less(context, item, items[at - 1]); at--) items[at] = items[at - 1];
      items[at] = item;
    }
    return;
  }
  /* Equal items, of which hostile files have millions, come in order. */
  size_t ordered = 1;
  while (ordered < count && !less(context, items[ordered], items[ordered - 1])) ordered++;
  if (ordered == count) return;
  for (size_t root = count / 2; root-- > 0 && tw_work(STEPS);) sift_down(items, root, count, less, context);
  for (size_t end = count - 1; end > 0 && tw_work(STEPS); end--) {
    uint32_t greatest = items[0];
    items[0] = items[end];
    items[end] = greatest;
    sift_down(items, 0, end, less, context);
  }
}

typedef uint32_t bucket_fn(const void *context, uint32_t item);

/* Sorts the items 0 to count - 1 by bucket, and within a bucket by `less`. order: [count] receives them. */
static tw_status sort_in_buckets(bucket_fn *bucket_of, uint32_t count, uint32_t bucket_count, less_fn *less,
                                 const void *context, uint32_t *order, tw_error *error) {
  enum { STEPS = 8 };
  uint32_t *starts = tw_alloc_zero((size_t)bucket_count + 1, sizeof *starts);
  if (!starts) return no_memory(error);
  for (uint32_t i = 0; i < count; i++) starts[bucket_of(context, i) + 1]++;
  for (uint32_t b = 0; b < bucket_count; b++) starts[b + 1] += starts[b];
  for (uint32_t i = 0; i < count; i++) order[starts[bucket_of(context, i)]++] = i;
  /* Each start has moved to its bucket's end. */
  for (uint32_t b = 0, begin = 0; b < bucket_count && tw_work(STEPS); begin = starts[b++])
    if (starts[b] - begin > 1) sort_items(order + begin, starts[b] - begin, less, context);
  tw_free(starts);
  return tw_work_status(error);
}

/* ---- equal positions ------------------------------------------------------------------------- */

/* Rows of numbers to compare. A magnitude below `tiny` counts as 0: generators close their shapes at an angle
 * of 2 pi, whose computed sine is not quite 0. All other numbers are compared exactly. */
typedef struct places {
  const float *rows; /* [][width] */
  uint32_t width;
  float tiny;
  const tw_soup *soup;     /* whose `compare` tells equal rows apart, or NULL */
  const uint32_t *buckets; /* bucket of each row, while rows are sorted */
} places;

/* The computed sine of 2 pi in 32 bits is 1.7e-7 instead of 0; 2^-20 leaves room. */
static float tiny_coordinate(const tw_soup *soup) {
  float greatest = 0;
  for (size_t i = 0; i < 3 * (size_t)soup->vertex_count; i++)
    greatest = fmaxf(greatest, fabsf(soup->positions[i]));
  return greatest * 0x1p-20f;
}

static float coordinate(const places *at, uint32_t row, size_t axis) {
  float value = at->rows[at->width * (size_t)row + axis];
  return fabsf(value) < at->tiny ? 0 : value;
}

static int compare_further(const places *at, uint32_t a, uint32_t b) {
  return at->soup && at->soup->compare ? at->soup->compare(at->soup->context, a, b) : 0;
}

static bool row_less(const void *context, uint32_t a, uint32_t b) {
  for (size_t axis = 0; axis < ((const places *)context)->width; axis++) {
    float p = coordinate(context, a, axis), q = coordinate(context, b, axis);
    if (p != q) return p < q;
  }
  int order = compare_further(context, a, b);
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

static uint32_t place_bucket(const void *context, uint32_t row) {
  return ((const places *)context)->buckets[row];
}

/* first: [count] receives for each row the first equal row. *split: whether any two rows are equal. */
static tw_status find_places(places at, uint32_t count, uint32_t *first, bool *split, tw_error *error) {
  enum { STEPS = 4 };
  uint32_t buckets = 1;
  while (buckets < count && buckets < 1u << 31) buckets *= 2;
  uint32_t *order = tw_alloc(count, sizeof *order);
  if (!order) return no_memory(error);
  at.buckets = first;
  for (uint32_t i = 0; i < count; i++) first[i] = hash_row(&at, i) & (buckets - 1);
  tw_status status = sort_in_buckets(place_bucket, count, buckets, row_less, &at, order, error);
  *split = false;
  for (uint32_t i = 0; i < count && status == TW_OK; i++) {
    if (!tw_work(STEPS)) status = tw_work_status(error);
    bool again = i > 0 && same_row(&at, order[i], order[i - 1]);
    first[order[i]] = again ? first[order[i - 1]] : order[i];
    *split |= again;
  }
  tw_free(order);
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

/* Lists the sides that touch a place with several vertices; other sides have nothing to join. */
static uint32_t collect_sides(const tw_soup *soup, const uint32_t *place, const bool *several, side *sides) {
  uint32_t count = 0;
  for (uint32_t face = 0; face < soup->face_count; face++)
    for (uint32_t c = soup->face_offsets[face]; c < soup->face_offsets[face + 1]; c++) {
      uint32_t from = soup->corners[c], to = soup->corners[next_corner(soup, face, c)];
      uint32_t p = place[from], q = place[to];
      if (p == q || (!several[p] && !several[q])) continue;
      sides[count++] = (side){from, to, face};
    }
  return count;
}

/* Values of vertices: [vertex_count][width]. */
typedef struct value_rows {
  const float *rows;
  uint32_t width;
} value_rows;

static bool same_value(const value_rows *values, uint32_t a, uint32_t b) {
  const float *p = values->rows + values->width * (size_t)a, *q = values->rows + values->width * (size_t)b;
  return tw_compare_floats(p, q, values->width) == 0;
}

/* Joins the ends of each pair of opposite sides, where no third side runs between the same two places; where
 * values are given, only when these are equal at both ends. order: the sides by (low end, high end). Returns
 * how many pairs run the same way and do not share both vertices. */
static uint32_t join_pairs(const side_list *list, const uint32_t *order, uint32_t count,
                           const value_rows *values, uint32_t *joined) {
  const uint32_t *place = list->place;
  uint32_t reversed = 0;
  for (uint32_t i = 0, end; i < count; i = end) {
    uint32_t low = low_end(list, order[i]), high = high_end(list, order[i]);
    for (end = i + 1; end < count; end++)
      if (low_end(list, order[end]) != low || high_end(list, order[end]) != high) break;
    if (end - i != 2) continue;
    const side *a = &list->sides[order[i]], *b = &list->sides[order[i + 1]];
    if (a->face == b->face) continue;     /* a face as thin as a line */
    if (place[a->from] != place[b->to]) { /* they run the same way */
      reversed += a->from != b->from || a->to != b->to;
      continue;
    }
    if (values && (!same_value(values, a->from, b->to) || !same_value(values, a->to, b->from))) continue;
    tw_union_find_join(joined, a->from, b->to);
    tw_union_find_join(joined, a->to, b->from);
  }
  return reversed;
}

static tw_status join_sides(const tw_soup *soup, const uint32_t *place, const value_rows *values, side *sides,
                            uint32_t *order, bool *several, uint32_t *joined, uint32_t *reversed,
                            tw_error *error) {
  for (uint32_t v = 0; v < soup->vertex_count; v++)
    if (place[v] != v) several[place[v]] = true;
  uint32_t count = collect_sides(soup, place, several, sides);
  const side_list list = {sides, place};
  tw_status status = sort_in_buckets(low_end, count, soup->vertex_count, side_less, &list, order, error);
  if (status == TW_OK) *reversed = join_pairs(&list, order, count, values, joined);
  return status;
}

/* place: [vertex_count] the first vertex at each vertex's place. joined: [vertex_count] every vertex its own
 * root before; afterwards the joined sets. *reversed: as join_pairs returns it. */
static tw_status join_split_vertices(const tw_soup *soup, const uint32_t *place, const value_rows *values,
                                     uint32_t *joined, uint32_t *reversed, tw_error *error) {
  side *sides = tw_alloc(soup->corner_count, sizeof *sides);
  uint32_t *order = tw_alloc(soup->corner_count, sizeof *order);
  bool *several = tw_alloc_zero(soup->vertex_count, sizeof *several);
  tw_status status = sides && order && several
                         ? join_sides(soup, place, values, sides, order, several, joined, reversed, error)
                         : no_memory(error);
  tw_free(sides);
  tw_free(order);
  tw_free(several);
  return status;
}

size_t tw_weld_size(uint32_t vertex_count, uint32_t corner_count) {
  /* Always: places and sets. Then either the order and buckets of vertices, or the sides, their order and
   * their buckets. */
  size_t vertices = vertex_count, corners = corner_count;
  size_t finding = 12 * vertices, joining = 5 * vertices + 16 * corners;
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

tw_status tw_weld_points(const tw_soup *soup, uint32_t *point_of_vertex, tw_welded *out, tw_error *error) {
  *out = (tw_welded){0};
  uint32_t *place = tw_alloc(soup->vertex_count, 2 * sizeof *place);
  if (!place) return no_memory(error);
  uint32_t *joined = place + soup->vertex_count;
  tw_union_find_init(joined, soup->vertex_count);
  bool split = false;
  const places at = {.rows = soup->positions, .width = 3, .tiny = tiny_coordinate(soup), .soup = soup};
  tw_status status = find_places(at, soup->vertex_count, place, &split, error);
  if (status == TW_OK && split)
    status = join_split_vertices(soup, place, NULL, joined, &out->reversed_edges, error);
  if (status == TW_OK) out->point_count = number_roots(joined, soup->vertex_count, point_of_vertex);
  tw_free(place);
  return status;
}

/* ---- values of corners --------------------------------------------------------------------- */

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
  uint32_t *joined = place + soup->vertex_count, reversed;
  tw_union_find_init(joined, soup->vertex_count);
  tw_status status = find_first_vertices(point_of_vertex, soup->vertex_count, point_count, place, error);
  if (status == TW_OK) status = join_split_vertices(soup, place, &values, joined, &reversed, error);
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

/* ---- points near each other -------------------------------------------------------------------- */

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
  sort_items(order, count, cell_less, &grid);
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
