/* Refines the triangles over a hole: Liepa, "Filling holes in meshes" (2003). A triangle whose centre is far
 * from its corners, relative to the edge lengths at the hole's border, is split at its centre. Edges are
 * swapped where that makes the triangles beside them less slender. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "angle.h"
#include "hole.h"

enum {
  ROUNDS = 64, /* rounds of splits */
  SWEEPS = 8   /* most sweeps of swaps after each round */
};
static const double DENSITY = 1.4142135623730951;

/* ---- what is round the hole ------------------------------------------------------------------ */

tw_status tw_rings_find(tw_rings *rings, const tw_editor *editor) {
  const tw_topology *t = editor->topology;
  rings->counts = tw_arena_alloc(editor->scratch, t->vertex_count, sizeof *rings->counts);
  rings->sums = tw_arena_alloc(editor->scratch, t->vertex_count, sizeof *rings->sums);
  rings->scales = tw_arena_alloc(editor->scratch, t->vertex_count, sizeof *rings->scales);
  if (!rings->counts || !rings->sums || !rings->scales) return tw_editor_no_memory(editor);
  for (uint32_t e = 0; e < t->edge_count; e++) {
    const uint32_t *ends = t->edge_vertices[e];
    const float *at[2] = {tw_editor_point(editor, ends[0]), tw_editor_point(editor, ends[1])};
    double side[3];
    tw_side3(at[0], at[1], side);
    for (int end = 0; end < 2; end++) {
      rings->counts[ends[end]]++;
      rings->scales[ends[end]] += tw_length3(side);
      for (int i = 0; i < 3; i++) rings->sums[ends[end]][i] += (double)at[1 - end][i];
    }
  }
  for (uint32_t p = 0; p < t->vertex_count; p++)
    if (rings->counts[p] > 0) rings->scales[p] /= rings->counts[p];
  return TW_OK;
}

/* ---- the patch ------------------------------------------------------------------------------- */

void tw_hole_patch_deinit(tw_hole_patch *patch) {
  tw_free(patch->triangles);
  tw_free(patch->beyond);
  tw_free(patch->is_fresh);
  tw_free(patch->points);
  tw_free(patch->scales);
  tw_free(patch->terms);
}

/* Enlarges an array if *has_room; without memory, clears *has_room and returns the array unchanged. */
static void *resize(void *array, uint64_t count, size_t size, bool *has_room) {
  void *larger = *has_room && count <= SIZE_MAX / size ? tw_resize(array, (size_t)count * size) : NULL;
  *has_room = larger != NULL;
  return larger ? larger : array;
}

static bool make_room(tw_hole_patch *p, uint32_t points) {
  if (points <= p->room) return true;
  uint64_t room = points + (uint64_t)points / 2;
  bool has_room = room < UINT32_MAX / 2;
  p->triangles = resize(p->triangles, 2 * room, sizeof *p->triangles, &has_room);
  p->beyond = resize(p->beyond, 2 * room, sizeof *p->beyond, &has_room);
  p->is_fresh = resize(p->is_fresh, 2 * room, sizeof *p->is_fresh, &has_room);
  p->points = resize(p->points, room, sizeof *p->points, &has_room);
  p->scales = resize(p->scales, room, sizeof *p->scales, &has_room);
  p->terms = resize(p->terms, room, sizeof *p->terms, &has_room);
  if (has_room) p->room = (uint32_t)room;
  return has_room;
}

typedef struct half_edge {
  uint32_t ends[2]; /* the lesser first */
  uint32_t triangle, corner;
} half_edge;

static int compare_half_edges(const void *left, const void *right) {
  const half_edge *a = left, *b = right;
  for (int i = 0; i < 2; i++)
    if (a->ends[i] != b->ends[i]) return a->ends[i] < b->ends[i] ? -1 : 1;
  return 0;
}

/* Finds the triangle across each side: two sides between the same two places face each other, a single one is
 * the loop's. */
static bool join_triangles(tw_hole_patch *p) {
  uint32_t count = 3 * p->triangle_count;
  half_edge *edges = tw_alloc(count, sizeof *edges);
  for (uint32_t i = 0; edges && i < count; i++) {
    uint32_t a = p->triangles[i / 3][i % 3], b = p->triangles[i / 3][(i + 1) % 3];
    edges[i] = (half_edge){{a < b ? a : b, a < b ? b : a}, i / 3, i % 3};
    p->beyond[i / 3][i % 3] = UINT32_MAX;
  }
  bool is_sorted = edges && tw_sort(edges, count, sizeof *edges, compare_half_edges) == TW_OK;
  for (uint32_t i = 1; is_sorted && i < count; i++) {
    if (compare_half_edges(&edges[i - 1], &edges[i]) != 0) continue;
    p->beyond[edges[i].triangle][edges[i].corner] = edges[i - 1].triangle;
    p->beyond[edges[i - 1].triangle][edges[i - 1].corner] = edges[i].triangle;
  }
  tw_free(edges);
  return is_sorted;
}

static bool begin(tw_hole_patch *p, const tw_editor *editor, const tw_rings *rings) {
  if (!make_room(p, p->loop_count)) return false;
  for (uint32_t i = 0; i < p->loop_count; i++) {
    for (int k = 0; k < 3; k++) p->points[i][k] = (double)tw_editor_point(editor, p->loop[i])[k];
    p->scales[i] = rings->scales[p->loop[i]];
    memset(p->terms[i], 0, sizeof p->terms[i]);
    p->terms[i][0] = (tw_term){i, 1};
  }
  memset(p->is_fresh, 1, p->triangle_count);
  return join_triangles(p);
}

/* The corner of a triangle whose side leads to another triangle. */
static uint32_t corner_to(const tw_hole_patch *p, uint32_t triangle, uint32_t other) {
  uint32_t k = 0;
  while (k < 2 && p->beyond[triangle][k] != other) k++;
  return k;
}

static void put_beyond(tw_hole_patch *p, uint32_t triangle, uint32_t from, uint32_t to) {
  if (triangle != UINT32_MAX) p->beyond[triangle][corner_to(p, triangle, from)] = to;
}

/* Writes a triangle. Those beside it are fresh, too: their sides have another triangle across. */
static void put_triangle(tw_hole_patch *p, uint32_t triangle, const uint32_t corners[3],
                         const uint32_t beyond[3]) {
  for (int k = 0; k < 3; k++)
    if (beyond[k] != UINT32_MAX) p->is_fresh[beyond[k]] = 1;
  memcpy(p->triangles[triangle], corners, sizeof *p->triangles);
  memcpy(p->beyond[triangle], beyond, sizeof *p->beyond);
  p->is_fresh[triangle] = 1;
}

/* ---- splits ---------------------------------------------------------------------------------- */

static int compare_terms(const void *left, const void *right) {
  const tw_term *a = left, *b = right;
  if (a->weight != b->weight) return a->weight > b->weight ? -1 : 1;
  return a->index < b->index ? -1 : a->index > b->index;
}

/* The mean of three means, reduced to its heaviest terms and normalised. */
static void mean_of_terms(const tw_hole_patch *p, const uint32_t corners[3], tw_term *out) {
  tw_term all[3 * TW_PATCH_TERMS];
  uint32_t count = 0;
  for (uint32_t i = 0; i < 3 * TW_PATCH_TERMS; i++) {
    const tw_term *term = &p->terms[corners[i / TW_PATCH_TERMS]][i % TW_PATCH_TERMS];
    uint32_t at = 0;
    while (at < count && all[at].index != term->index) at++;
    if (at == count) all[count++] = (tw_term){term->index, 0};
    all[at].weight += term->weight;
  }
  qsort(all, count, sizeof *all, compare_terms);
  double sum = 0;
  for (uint32_t i = 0; i < TW_PATCH_TERMS && i < count; i++) sum += all[i].weight;
  for (uint32_t i = 0; i < TW_PATCH_TERMS; i++)
    out[i] = i < count ? (tw_term){all[i].index, all[i].weight / sum} : (tw_term){0, 0};
}

static double distance(const double *a, const double *b) {
  double side[3];
  for (int i = 0; i < 3; i++) side[i] = b[i] - a[i];
  return tw_length3(side);
}

/* Whether a triangle is too large. centre, scale: the triangle's centre, and the wanted edge length there. */
static bool is_large(const tw_hole_patch *p, uint32_t triangle, double centre[3], double *scale) {
  const uint32_t *corners = p->triangles[triangle];
  for (int i = 0; i < 3; i++)
    centre[i] = (p->points[corners[0]][i] + p->points[corners[1]][i] + p->points[corners[2]][i]) / 3;
  *scale = (p->scales[corners[0]] + p->scales[corners[1]] + p->scales[corners[2]]) / 3;
  for (int k = 0; k < 3; k++) {
    double away = DENSITY * distance(centre, p->points[corners[k]]);
    if (!(away > *scale && away > p->scales[corners[k]])) return false;
  }
  return true;
}

/* Splits a triangle at a new point. There must be room. */
static void split(tw_hole_patch *p, uint32_t t, const double centre[3], double scale) {
  uint32_t a = p->triangles[t][0], b = p->triangles[t][1], c = p->triangles[t][2];
  uint32_t ab = p->beyond[t][0], bc = p->beyond[t][1], ca = p->beyond[t][2];
  uint32_t u = p->triangle_count, v = u + 1, point = p->point_count;
  mean_of_terms(p, p->triangles[t], p->terms[point]);
  memcpy(p->points[point], centre, sizeof *p->points);
  p->scales[point] = scale;
  put_triangle(p, t, (uint32_t[]){a, b, point}, (uint32_t[]){ab, u, v});
  put_triangle(p, u, (uint32_t[]){b, c, point}, (uint32_t[]){bc, v, t});
  put_triangle(p, v, (uint32_t[]){c, a, point}, (uint32_t[]){ca, t, u});
  put_beyond(p, bc, t, u);
  put_beyond(p, ca, t, v);
  p->triangle_count += 2;
  p->point_count++;
}

/* ---- swaps ----------------------------------------------------------------------------------- */

/* The angle at a point between two others. */
static double angle(const tw_hole_patch *p, uint32_t at, uint32_t a, uint32_t b) {
  double first[3], second[3];
  for (int i = 0; i < 3; i++) {
    first[i] = p->points[a][i] - p->points[at][i];
    second[i] = p->points[b][i] - p->points[at][i];
  }
  return tw_angle3(first, second);
}

/* Whether two places share an edge, in the mesh or in the patch. Searches the triangles round place `a` from
 * triangle t on, both ways. True also where the result is no longer wanted. */
static bool has_edge(const tw_hole_patch *p, const tw_editor *editor, uint32_t t, uint32_t a, uint32_t b) {
  if (a < p->loop_count && b < p->loop_count && tw_hole_patch_is_taken(p, editor, a, b)) return true;
  for (uint32_t way = 0; way < 2; way++) {
    uint32_t at = t;
    do {
      enum { STEPS = 2 };
      uint32_t k = 0;
      if (!tw_work(STEPS)) return true;
      while (p->triangles[at][k] != a) k++;
      if (p->triangles[at][(k + 1) % 3] == b || p->triangles[at][(k + 2) % 3] == b) return true;
      at = p->beyond[at][way == 0 ? k : (k + 2) % 3];
    } while (at != UINT32_MAX && at != t);
  }
  return false;
}

/* Swaps the side after corner k for the other diagonal of its two triangles, where the Delaunay condition
 * asks for it. */
static bool swap(tw_hole_patch *p, const tw_editor *editor, uint32_t t, uint32_t k) {
  uint32_t u = p->beyond[t][k];
  if (u == UINT32_MAX || u < t) return false;
  uint32_t m = corner_to(p, u, t);
  uint32_t a = p->triangles[t][k], b = p->triangles[t][(k + 1) % 3], c = p->triangles[t][(k + 2) % 3];
  uint32_t d = p->triangles[u][(m + 2) % 3];
  if (c == d || !(angle(p, c, a, b) + angle(p, d, a, b) > TW_PI + 1e-9)) return false;
  if (has_edge(p, editor, t, c, d)) {
    p->is_fresh[t] = 1; /* until that edge is swapped */
    return false;
  }
  uint32_t bc = p->beyond[t][(k + 1) % 3], ca = p->beyond[t][(k + 2) % 3];
  uint32_t ad = p->beyond[u][(m + 1) % 3], db = p->beyond[u][(m + 2) % 3];
  put_triangle(p, t, (uint32_t[]){c, a, d}, (uint32_t[]){ca, ad, u});
  put_triangle(p, u, (uint32_t[]){d, b, c}, (uint32_t[]){db, bc, t});
  put_beyond(p, ad, u, t);
  put_beyond(p, bc, t, u);
  return true;
}

/* Looks at the sides of fresh triangles only, those of others stay as they are. Ends early where the result
 * is no longer wanted. */
static void relax(tw_hole_patch *p, const tw_editor *editor) {
  enum { STEPS = 64 }; /* of a triangle: twelve angles */
  bool is_done = false;
  for (int sweep = 0; sweep < SWEEPS && !is_done; sweep++) {
    is_done = true;
    for (uint32_t t = 0; t < p->triangle_count && tw_work(p->is_fresh[t] ? STEPS : 1); t++) {
      bool is_fresh = p->is_fresh[t];
      p->is_fresh[t] = 0;
      for (uint32_t k = 0; is_fresh && k < 3; k++)
        if (swap(p, editor, t, k)) is_done = false;
    }
  }
}

/* About as many points as the patch needs at least: the edges of its triangles become as long as the lengths
 * wanted at the loop, at most twice as long. */
static double count_points(const tw_hole_patch *p) {
  double count = 0;
  for (uint32_t t = 0; t < p->triangle_count; t++) {
    const uint32_t *corners = p->triangles[t];
    double first[3], second[3], across[3], scale = 0;
    for (int i = 0; i < 3; i++) {
      first[i] = p->points[corners[1]][i] - p->points[corners[0]][i];
      second[i] = p->points[corners[2]][i] - p->points[corners[0]][i];
      scale = fmax(scale, p->scales[corners[i]]);
    }
    tw_cross3(first, second, across);
    if (scale > 0) count += tw_length3(across) / (4 * scale * scale);
  }
  return count;
}

/* Fails where a patch may not have so many points of its own. room: what limits leave. own_max: see
 * TW_FAIR_POINTS_MAX. */
static tw_status check_points(const tw_editor *editor, double count, uint64_t room, uint64_t own_max) {
  if (count > (double)room)
    return tw_editor_fail(editor, TW_LIMIT, "", "the patches would have more points than are allowed");
  if (count <= (double)own_max) return TW_OK;
  return tw_editor_fail(editor, TW_INVALID, "",
                        "fair patches have up to %d points, which this hole exceeds: fill it with triangles, "
                        "or cut it into parts",
                        TW_FAIR_POINTS_MAX);
}

/* Splits what is too large among the first `count` triangles. */
static tw_status split_large(tw_hole_patch *p, const tw_editor *editor, uint32_t count, uint64_t room,
                             uint64_t own_max) {
  for (uint32_t t = 0; t < count; t++) {
    double centre[3], scale;
    if (!is_large(p, t, centre, &scale)) continue;
    tw_status status = check_points(editor, p->point_count - p->loop_count + 1, room, own_max);
    if (status != TW_OK) return status;
    if (!make_room(p, p->point_count + 1)) return tw_editor_no_memory(editor);
    split(p, t, centre, scale);
  }
  return TW_OK;
}

tw_status tw_hole_patch_refine(tw_hole_patch *patch, const tw_editor *editor, const tw_rings *rings,
                               uint64_t room, uint64_t own_max) {
  if (!begin(patch, editor, rings)) return tw_editor_no_memory(editor);
  tw_status status = check_points(editor, count_points(patch), room, own_max);
  if (status == TW_OK) relax(patch, editor);
  for (uint32_t round = 0, before = 0; status == TW_OK && round < ROUNDS && before != patch->point_count;
       round++) {
    before = patch->point_count;
    status = tw_editor_go_on(editor);
    if (status == TW_OK) status = split_large(patch, editor, patch->triangle_count, room, own_max);
    if (status == TW_OK) relax(patch, editor);
  }
  return status;
}
