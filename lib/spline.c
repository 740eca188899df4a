/* B-spline weight tables by repeated knot insertion, exact until they are rounded to float. */
#include "spline.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/subdiv.h"

typedef struct table {
  tw_spline view;
  float rows[]; /* three blocks of [2^depth + 1][4] */
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

static void fill(table *t, uint32_t n, const double (*points)[4]) {
  float(*point)[4] = (float(*)[4])t->rows, (*limit)[4] = point + n + 1, (*derivative)[4] = limit + n + 1;
  for (uint32_t i = 0; i <= n; i++) {
    const double *before = points[i], *at = points[i + 1], *after = points[i + 2];
    for (int k = 0; k < 4; k++) {
      point[i][k] = (float)at[k];
      limit[i][k] = (float)((before[k] + 4 * at[k] + after[k]) / 6);
      derivative[i][k] = (float)((after[k] - before[k]) * n / 2);
    }
  }
  t->view = (tw_spline){(const float(*)[4])point, (const float(*)[4])limit, (const float(*)[4])derivative};
}

static table *make(uint32_t depth) {
  uint32_t n = 1u << depth;
  table *t = tw_alloc(1, sizeof *t + (size_t)(n + 1) * 3 * 4 * sizeof(float));
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
