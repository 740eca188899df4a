/* B-spline weight tables by repeated knot insertion, exact until they are rounded to float. */
#include "spline.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/subdiv.h"

enum { ROWS = 4 + 4 + 3 };

typedef struct table {
  tw_spline view;
  float rows[]; /* [ROWS][2^depth + TW_SPLINE_LANES] */
} table;

static _Atomic(table *) tables[TW_LEVEL_MAX + 1];

/* One step on points -1 .. n + 1 of a segment (n intervals): gives -1 .. 2n + 1. */
static void insert_knots(const double (*in)[4], uint32_t n, double (*out)[4]) {
  for (uint32_t i = 0; i <= 2 * n + 2; i++) { /* out[i] is point i - 1 */
    uint32_t left = i / 2;
    for (int k = 0; k < 4; k++)
      out[i][k] = i % 2 ? (in[left][k] + 6 * in[left + 1][k] + in[left + 2][k]) / 8
                        : (in[left][k] + in[left + 1][k]) / 2;
  }
}

/* Weights at place i of the segment's n + 1. */
static void weigh(const double (*points)[4], uint32_t n, uint32_t i, float out[ROWS]) {
  const double *before = points[i], *at = points[i + 1], *after = points[i + 2];
  double sum = 0;
  for (int k = 0; k < 4; k++) {
    out[k] = (float)at[k];
    out[4 + k] = (float)((before[k] + 4 * at[k] + after[k]) / 6);
    sum += (before[k] - after[k]) * n / 2;
    if (k < 3) out[8 + k] = (float)sum;
  }
}

static void fill(table *t, uint32_t n, const double (*points)[4]) {
  size_t length = (size_t)n + TW_SPLINE_LANES;
  for (uint32_t i = 0; i < length; i++) {
    float weights[ROWS];
    weigh(points, n, i < n ? i : n, weights);
    for (uint32_t r = 0; r < ROWS; r++) t->rows[r * length + i] = weights[r];
  }
  for (uint32_t k = 0; k < 4; k++) {
    t->view.point[k] = t->rows + k * length;
    t->view.limit[k] = t->rows + (4 + k) * length;
    if (k < 3) t->view.slope[k] = t->rows + (8 + k) * length;
  }
}

static table *make(uint32_t depth) {
  uint32_t n = 1u << depth;
  table *t = tw_alloc(1, sizeof *t + ((size_t)n + TW_SPLINE_LANES) * ROWS * sizeof(float));
  double(*points)[4] = tw_alloc_zero(n + 3, sizeof *points), (*next)[4] = tw_alloc_zero(n + 3, sizeof *next);
  if (t && points && next) {
    for (int k = 0; k < 4; k++) points[k][k] = 1;
    for (uint32_t level = 0; level < depth; level++) {
      insert_knots((const double(*)[4])points, 1u << level, next);
      double(*swap)[4] = points;
      points = next;
      next = swap;
    }
    fill(t, n, (const double(*)[4])points);
  } else {
    free(t);
    t = NULL;
  }
  free(points);
  free(next);
  return t;
}

const tw_spline *tw_spline_table(uint32_t depth) {
  table *t = atomic_load(&tables[depth]);
  if (t) return &t->view;
  t = make(depth);
  if (!t) return NULL;
  table *expected = NULL;
  if (atomic_compare_exchange_strong(&tables[depth], &expected, t)) return &t->view;
  free(t); /* another thread was first */
  return &expected->view;
}
