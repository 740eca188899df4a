/* Ear clipping. Only reflex corners can lie in an ear, and only those whose first coordinate is within its
 * range are looked at. */
#include "ear_clipping.h"

#include <math.h>
#include <string.h>

#include "vector3.h"

bool tw_ear_clipper_init(tw_ear_clipper *clipper, tw_arena *arena, uint32_t most) {
  clipper->corners = tw_arena_alloc_raw(arena, most, sizeof *clipper->corners);
  clipper->order = tw_arena_alloc_raw(arena, most, sizeof *clipper->order);
  clipper->size = 0;
  return clipper->corners && clipper->order;
}

/* Twice the signed area of a triangle. */
static double area(const tw_ear_clipper *k, uint32_t a, uint32_t b, uint32_t c) {
  const double *p = k->corners[a].at, *q = k->corners[b].at, *r = k->corners[c].at;
  return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
}

void tw_ear_clipper_take(tw_ear_clipper *clipper, const float *const *points, uint32_t size) {
  double normal[3] = {0, 0, 0};
  for (uint32_t i = 1; i + 1 < size; i++) {
    double a[3], b[3], cross[3];
    tw_side3(points[0], points[i], a);
    tw_side3(points[0], points[i + 1], b);
    tw_cross3(a, b, cross);
    for (int j = 0; j < 3; j++) normal[j] += cross[j];
  }
  uint32_t axis = 0;
  for (uint32_t i = 1; i < 3; i++)
    if (fabs(normal[i]) > fabs(normal[axis])) axis = i;
  uint32_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0) {
    u = (axis + 2) % 3;
    v = (axis + 1) % 3;
  }
  clipper->size = size;
  clipper->area = fabs(normal[axis]);
  for (uint32_t i = 0; i < size; i++)
    clipper->corners[i] = (tw_ear_corner){.at = {(double)points[i][u], (double)points[i][v]},
                                          .next = i + 1 < size ? i + 1 : 0,
                                          .previous = i > 0 ? i - 1 : size - 1};
}

bool tw_ear_clipper_is_fan(const tw_ear_clipper *clipper, uint32_t start, uint64_t *looks) {
  double least = -1e-6 * clipper->area;
  uint32_t second = clipper->corners[start].next;
  for (uint32_t i = 2; i < clipper->size; i++) {
    uint32_t third = clipper->corners[second].next;
    if (*looks == 0 || area(clipper, start, second, third) < least) return false;
    --*looks;
    second = third;
  }
  return true;
}

/* A corner and its first coordinate. */
typedef struct sorted_corner {
  double at;
  uint32_t corner;
} sorted_corner;

static int compare_corners(const void *left, const void *right) {
  const sorted_corner *a = left, *b = right;
  if (a->at != b->at) return a->at < b->at ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

static tw_status sort_corners(tw_ear_clipper *k) {
  sorted_corner *sorted = tw_alloc(k->size, sizeof *sorted);
  if (!sorted) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < k->size; i++) sorted[i] = (sorted_corner){k->corners[i].at[0], i};
  tw_status status = tw_sort(sorted, k->size, sizeof *sorted, compare_corners);
  for (uint32_t i = 0; status == TW_OK && i < k->size; i++) {
    k->order[i] = sorted[i].corner;
    k->corners[sorted[i].corner].place = i;
  }
  tw_free(sorted);
  return status;
}

static bool is_reflex(const tw_ear_clipper *k, uint32_t i) {
  return area(k, k->corners[i].previous, i, k->corners[i].next) <= 0;
}

/* The work left, in corners looked at. When the tests are spent, corners are cut off without a test; when the
 * skips are spent, the polygon stays whole. */
typedef struct ear_budget {
  uint64_t tests, skips;
} ear_budget;

/* Looks at the corners on one side of an ear in the order of the first coordinate, up to the ear's own range.
 */
static bool is_free_towards(const tw_ear_clipper *k, const uint32_t ear[3], bool is_up, double end,
                            ear_budget *budget) {
  uint32_t place = k->corners[ear[1]].place;
  for (uint32_t left = is_up ? k->size - 1 - place : place; left > 0 && budget->tests > 0;
       left--, --budget->tests) {
    uint32_t i = k->order[is_up ? ++place : --place];
    const tw_ear_corner *c = &k->corners[i];
    if (is_up ? c->at[0] > end : c->at[0] < end) return true;
    if (c->is_reflex && i != ear[0] && i != ear[2] && area(k, ear[0], ear[1], i) >= 0 &&
        area(k, ear[1], ear[2], i) >= 0 && area(k, ear[2], ear[0], i) >= 0)
      return false;
  }
  return true;
}

/* Whether a corner is an ear: no reflex corner lies in its triangle. When the tests are spent, the corner
 * counts as an ear. */
static bool is_ear(const tw_ear_clipper *k, uint32_t corner, ear_budget *budget) {
  const uint32_t ear[3] = {k->corners[corner].previous, corner, k->corners[corner].next};
  if (k->corners[corner].is_reflex) return false;
  double a = k->corners[ear[0]].at[0], b = k->corners[ear[2]].at[0];
  return is_free_towards(k, ear, true, fmax(a, b), budget) &&
         is_free_towards(k, ear, false, fmin(a, b), budget);
}

/* The next corner to cut off, from `at` on: an ear, or else the first candidate. UINT32_MAX where there is no
 * candidate: in a polygon that has a point twice, a corner whose two neighbours are one point is none and is
 * skipped. Also where the work is over: one ear may take all looks at the corners. */
static uint32_t find_ear(const tw_ear_clipper *k, const uint32_t *names, uint32_t at, uint32_t left,
                         ear_budget *budget) {
  uint32_t any = UINT32_MAX;
  for (uint32_t tried = 0; tried < left && budget->skips > 0; tried++, at = k->corners[at].next) {
    if (budget->tests > 0) --budget->tests;
    if (names[k->corners[at].previous] == names[k->corners[at].next]) {
      --budget->skips;
      if (!tw_work(1)) return UINT32_MAX;
      continue;
    }
    uint64_t before = budget->tests;
    bool is_found = before == 0 || is_ear(k, at, budget);
    if (!tw_work(1 + before - budget->tests)) return UINT32_MAX;
    if (is_found) return at;
    if (any == UINT32_MAX) any = at;
  }
  return any;
}

tw_status tw_ear_clipper_cut(tw_ear_clipper *clipper, const uint32_t *names, const tw_parallel_for *parallel,
                             uint32_t (*out)[3], uint32_t *count) {
  enum { STEPS = 256, EARS_AT_ONCE = 1024 };
  tw_ear_corner *corners = clipper->corners;
  uint32_t size = clipper->size, at = 0, done = 0;
  ear_budget budget = {STEPS * (uint64_t)size, STEPS * (uint64_t)size};
  *count = 0;
  tw_status status = sort_corners(clipper);
  if (status != TW_OK) return status;
  for (uint32_t i = 0; i < size; i++) corners[i].is_reflex = is_reflex(clipper, i);
  for (uint32_t left = size; left >= 3; left--) {
    status = done % EARS_AT_ONCE == 0 ? tw_parallel_for_status(parallel) : TW_OK;
    if (status != TW_OK) return status;
    at = find_ear(clipper, names, at, left, &budget);
    if (at == UINT32_MAX) return tw_work_status(NULL);
    uint32_t a = corners[at].previous, b = corners[at].next;
    const uint32_t triangle[3] = {a, at, b};
    memcpy(out[done++], triangle, sizeof triangle);
    corners[a].next = b;
    corners[b].previous = a;
    corners[at].is_reflex = false;
    corners[a].is_reflex = is_reflex(clipper, a);
    corners[b].is_reflex = is_reflex(clipper, b);
    at = corners[b].next;
  }
  *count = done;
  return TW_OK;
}
