/* Covers a loop of points by the triangles of least total area, by dynamic programming: Barequet and Sharir,
 * "Filling gaps in the boundary of a polyhedron" (1995). O(n^3) time and O(n^2) memory for a loop of n
 * points, both bounded. */
#include "hole.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
  LOOKS = 1024, /* budget of triangles compared, for each point and corner of the mesh */
  STEPS = 64,   /* budget of fairing steps times points, likewise */
  EDITS = 4,    /* edits of a list that may use their budgets whole */
  EXACT = 512,  /* the most points of a loop that is not halved */
  SMALL = 8     /* loops of up to so many points are never halved */
};

typedef struct covering {
  const tw_editor *editor;
  tw_hole_patch *patch;
  tw_hole_work *budget;
  double penalty;   /* added to the area for an edge that the mesh has already */
  double *areas;    /* [n * n] least area between two places, at [first * n + last] */
  uint16_t *splits; /* [n * n] third corner of the triangle on these two places */
} covering;

/* ---- edges between holes --------------------------------------------------------------------- */

tw_status tw_patch_edges_init(tw_patch_edges *edges, const tw_editor *editor, uint32_t count) {
  uint64_t room = 16;
  while (room < 2 * (uint64_t)count) room *= 2;
  edges->mask = (uint32_t)(room - 1);
  edges->pairs = tw_arena_alloc(editor->scratch, room, sizeof *edges->pairs);
  return edges->pairs ? TW_OK : tw_editor_no_memory(editor);
}

/* The slot of a pair of points, or a free one for it. */
static uint32_t *find_pair(const tw_patch_edges *edges, uint32_t a, uint32_t b) {
  uint32_t lesser = a < b ? a : b, greater = a < b ? b : a;
  uint64_t mixed = ((uint64_t)lesser << 32 | greater) * 0x9E3779B97F4A7C15u;
  for (uint32_t at = (uint32_t)(mixed >> 32) & edges->mask;; at = (at + 1) & edges->mask) {
    uint32_t *pair = edges->pairs[at];
    if (pair[0] == pair[1] || (pair[0] == lesser && pair[1] == greater)) return pair;
  }
}

bool tw_hole_patch_is_taken(const tw_hole_patch *patch, const tw_editor *editor, uint32_t a, uint32_t b) {
  const uint32_t *pair = find_pair(patch->edges, patch->loop[a], patch->loop[b]);
  return pair[0] != pair[1] ||
         tw_topology_find_edge(editor->topology, patch->loop[a], patch->loop[b]) != UINT32_MAX;
}

/* Adds fewer pairs than the loop has points, as inner edges do not cross: the set never fills up. */
void tw_hole_patch_finish(const tw_hole_patch *patch) {
  for (uint32_t i = 0; i < 3 * patch->triangle_count; i++) {
    uint32_t a = patch->triangles[i / 3][i % 3], b = patch->triangles[i / 3][(i + 1) % 3];
    if (a >= patch->loop_count || b >= patch->loop_count || (a + 1) % patch->loop_count == b) continue;
    uint32_t *pair = find_pair(patch->edges, patch->loop[a], patch->loop[b]);
    bool is_up = patch->loop[a] < patch->loop[b];
    pair[0] = patch->loop[is_up ? a : b];
    pair[1] = patch->loop[is_up ? b : a];
  }
}

/* ---- triangles ------------------------------------------------------------------------------- */

/* What an edit may do of one kind of work, `done` by those before it. */
static uint64_t left(uint64_t most, uint64_t done) {
  uint64_t of_list = EDITS * most;
  if (done >= of_list) return 0;
  return most < of_list - done ? most : of_list - done;
}

tw_hole_work tw_hole_budget_of(const tw_editor *editor) {
  uint64_t size = (uint64_t)editor->mesh.point_count + editor->mesh.corner_count;
  const tw_hole_work *done = &editor->hole_work;
  return (tw_hole_work){.triangles = left(LOOKS * size, done->triangles),
                        .steps = left(STEPS * size, done->steps),
                        .points = TW_FAIR_POINTS_MAX - done->points};
}

static void side(const covering *c, uint32_t from, uint32_t to, double out[3]) {
  tw_side3(tw_editor_point(c->editor, c->patch->loop[from]), tw_editor_point(c->editor, c->patch->loop[to]),
           out);
}

static double length(const covering *c, uint32_t a, uint32_t b) {
  double between[3];
  side(c, a, b, between);
  return tw_length3(between);
}

/* Twice the area of a triangle. */
static double area(const covering *c, uint32_t a, uint32_t b, uint32_t d) {
  double first[3], second[3], across[3];
  side(c, a, b, first);
  side(c, a, d, second);
  tw_cross3(first, second, across);
  return tw_length3(across);
}

static bool is_taken(const covering *c, uint32_t a, uint32_t b) {
  return tw_hole_patch_is_taken(c->patch, c->editor, a, b);
}

/* Finds the best third corner for the places from first to last of a loop. */
static void find_split(covering *c, const uint32_t *loop, uint32_t n, uint32_t first, uint32_t last) {
  double best = INFINITY;
  uint32_t split = first + 1;
  for (uint32_t k = first + 1; k < last; k++) {
    double sum = c->areas[first * n + k] + c->areas[k * n + last] + area(c, loop[first], loop[k], loop[last]);
    if (!(sum < best)) continue;
    best = sum;
    split = k;
  }
  bool is_whole = last - first == n - 1;
  c->areas[first * n + last] = best + (!is_whole && is_taken(c, loop[first], loop[last]) ? c->penalty : 0);
  c->splits[first * n + last] = (uint16_t)split;
}

/* Adds the triangles that cover the places from first to last. Recursion is at most EXACT deep. */
static void put_triangles(covering *c, const uint32_t *loop, uint32_t n, uint32_t first, uint32_t last) {
  if (last - first < 2) return;
  uint32_t k = c->splits[first * n + last];
  const uint32_t triangle[3] = {loop[first], loop[k], loop[last]};
  memcpy(c->patch->triangles[c->patch->triangle_count++], triangle, sizeof triangle);
  put_triangles(c, loop, n, first, k);
  put_triangles(c, loop, n, k, last);
}

static tw_status cover_exactly(covering *c, const uint32_t *loop, uint32_t n) {
  for (uint32_t i = 0; i + 1 < n; i++) c->areas[i * n + i + 1] = 0;
  for (uint32_t across = 2; across < n; across++)
    for (uint32_t first = 0; first + across < n; first++) {
      if (!tw_work(across)) return tw_editor_go_on(c->editor);
      find_split(c, loop, n, first, first + across);
    }
  put_triangles(c, loop, n, 0, n - 1);
  return TW_OK;
}

/* Finds where the cut that halves a loop is shortest. Returns the place where the first half begins. */
static uint32_t find_halves(const covering *c, const uint32_t *loop, uint32_t n) {
  uint32_t half = n / 2, best = 0;
  double least = INFINITY;
  for (uint32_t i = 0; i + half < n; i++) {
    double between = length(c, loop[i], loop[i + half]);
    if (is_taken(c, loop[i], loop[i + half])) between += c->penalty;
    if (!(between < least)) continue;
    least = between;
    best = i;
  }
  return best;
}

/* Covers a loop, halved where it is too large or the budget is spent. loop: [n] places. */
static tw_status cover(covering *c, const uint32_t *loop, uint32_t n) {
  uint64_t looks = (uint64_t)n * n * n / 6;
  tw_status status = n > SMALL ? tw_editor_go_on(c->editor) : TW_OK;
  if (status != TW_OK) return status;
  if (n <= SMALL || (n <= EXACT && looks <= c->budget->triangles)) {
    c->budget->triangles -= looks < c->budget->triangles ? looks : c->budget->triangles;
    return cover_exactly(c, loop, n);
  }
  uint32_t *halves = tw_alloc((size_t)n + 1, sizeof *halves), begin = find_halves(c, loop, n);
  if (!halves) return tw_editor_no_memory(c->editor);
  for (uint32_t i = 0; i <= n; i++) halves[i] = loop[(begin + i) % n];
  status = cover(c, halves, n / 2 + 1);
  if (status == TW_OK) status = cover(c, halves + n / 2, n - n / 2 + 1);
  tw_free(halves);
  return status;
}

tw_status tw_hole_patch_triangulate(tw_hole_patch *patch, const tw_editor *editor, tw_hole_work *budget) {
  covering c = {.editor = editor, .patch = patch, .budget = budget};
  uint32_t count = patch->loop_count;
  size_t most = count < EXACT ? count : EXACT;
  double around = 0;
  uint32_t *loop = tw_alloc(count, sizeof *loop);
  c.areas = tw_alloc(most * most, sizeof *c.areas);
  c.splits = tw_alloc(most * most, sizeof *c.splits);
  patch->point_count = count;
  patch->triangles = tw_alloc(count, sizeof *patch->triangles);
  bool has_room = loop && c.areas && c.splits && patch->triangles;
  tw_status status = has_room ? TW_OK : tw_editor_no_memory(editor);
  if (has_room) {
    for (uint32_t i = 0; i < count; i++) {
      loop[i] = i;
      around += length(&c, i, (i + 1) % count);
    }
    /* More than all triangles' areas together: each is less than the square of the loop's length. */
    c.penalty = (double)count * around * (around + 1);
    status = cover(&c, loop, count);
  }
  tw_free(loop);
  tw_free(c.areas);
  tw_free(c.splits);
  return status;
}
