/* B-splines: weight tables by repeated knot insertion, computed in double and then rounded to float, and rows
 * of points.
 *
 * For each line, control points are first weighted down their columns, then across. Derivatives come from
 * differences of control points: these are nearly exact, and equal points give exactly 0. */
#include "bspline.h"

#include <stdlib.h>

#include "normal.h"

enum { ROWS = 4 + 4 + 3 };

/* One knot insertion: from points -1 .. n + 1 of a segment of n intervals to points -1 .. 2n + 1. */
static void insert_knots(const double (*in)[4], uint32_t n, double (*out)[4]) {
  for (uint32_t i = 0; i <= 2 * n + 2; i++) { /* out[i] is point i - 1 */
    uint32_t left = i / 2;
    for (int k = 0; k < 4; k++)
      out[i][k] = i % 2 ? (in[left][k] + 6 * in[left + 1][k] + in[left + 2][k]) / 8
                        : (in[left][k] + in[left + 1][k]) / 2;
  }
}

/* Weights at point i of the segment's n + 1 points. */
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

/* Weights in each row of the table of a depth. */
static size_t row_length(uint32_t depth) {
  return ((size_t)1 << depth) + 1;
}

/* rows: [ROWS][row_length]. */
static void fill_table(uint32_t depth, const double (*points)[4], tw_point *rows, tw_spline *out) {
  size_t length = row_length(depth);
  uint32_t n = 1u << depth;
  for (uint32_t i = 0; i <= n; i++) {
    float weights[ROWS];
    weigh(points, n, i, weights);
    for (uint32_t r = 0; r < ROWS; r++)
      rows[r * length + i] = (tw_point){weights[r], weights[r], weights[r], weights[r]};
  }
  for (uint32_t k = 0; k < 4; k++) {
    out->point[k] = rows + k * length;
    out->limit[k] = rows + (4 + k) * length;
    if (k < 3) out->slope[k] = rows + (8 + k) * length;
  }
}

size_t tw_spline_tables_size(uint32_t depth) {
  size_t size = 0;
  for (uint32_t d = 0; d <= depth; d++) size += sizeof(tw_spline) + ROWS * row_length(d) * sizeof(tw_point);
  return size;
}

tw_spline *tw_spline_tables_create(uint32_t depth) {
  tw_spline *tables = tw_alloc(1, tw_spline_tables_size(depth));
  size_t room = ((size_t)1 << depth) + 3;
  double(*points)[4] = tw_alloc_zero(room, 2 * sizeof *points);
  if (!tables || !points) {
    tw_free(tables);
    tw_free(points);
    return NULL;
  }
  tw_point *rows = (tw_point *)(void *)(tables + depth + 1);
  double(*at)[4] = points, (*next)[4] = points + room;
  for (int k = 0; k < 4; k++) at[k][k] = 1;
  for (uint32_t d = 0; d <= depth; d++) {
    fill_table(d, (const double(*)[4])at, rows, &tables[d]);
    rows += ROWS * row_length(d);
    if (d == depth) break;
    insert_knots((const double(*)[4])at, 1u << d, next);
    double(*swap)[4] = at;
    at = next;
    next = swap;
  }
  tw_free(points);
  return tables;
}

/* ---- rows ------------------------------------------------------------------------------------ */

/* The weighted sum of four points, `apart` elements from each other, with the weights in column `at` of the
 * table. Summed from both ends, so that a mirrored patch gives mirrored points to the last bit. */
static inline tw_point sum_four(const tw_point *const table[4], size_t at, const tw_point *p, size_t apart) {
  return (table[0][at] * p[0] + table[3][at] * p[3 * apart]) +
         (table[1][at] * p[apart] + table[2][at] * p[2 * apart]);
}

static inline tw_point sum_three(const tw_point *const table[3], size_t at, const tw_point *p, size_t apart) {
  return (table[0][at] * p[0] + table[2][at] * p[2 * apart]) + table[1][at] * p[apart];
}

/* Differences of neighbouring control points, along i and along j. */
typedef struct slopes {
  tw_point along[4][3], across[3][4];
} slopes;

static void find_slopes(const tw_point points[16], slopes *out) {
  for (size_t r = 0; r < 4; r++)
    for (size_t k = 0; k < 4; k++) {
      const tw_point *p = &points[4 * r + k];
      if (k < 3) out->along[r][k] = p[1] - p[0];
      if (r < 3) out->across[r][k] = p[4] - p[0];
    }
}

/* Control points and slopes of one line (fixed j), weighted down the columns. */
typedef struct line {
  tw_point columns[4], along[3], across[4];
} line;

static inline void weigh_line(const tw_spline_job *job, const slopes *s, const tw_point *const *value,
                              size_t j, line *out) {
  for (size_t k = 0; k < 4; k++) out->columns[k] = sum_four(value, j, &job->points[k], 4);
  for (size_t k = 0; s && k < 4; k++) {
    if (k < 3) out->along[k] = sum_four(job->spline->limit, j, &s->along[0][k], 3);
    out->across[k] = sum_three(job->spline->slope, j, &s->across[0][k], 4);
  }
}

/* transposed: the job's i and j have changed places. */
static inline __attribute__((always_inline)) void fill(const tw_spline_job *job, bool transposed) {
  const tw_spline_job k = *job; /* a copy: the compiler knows that stores to rows cannot change it */
  const tw_spline spline = *k.spline;
  const tw_point *const *value = k.limit ? spline.limit : spline.point;
  const tw_point quad[4] = {k.points[5], k.points[transposed ? 9 : 6], k.points[10],
                            k.points[transposed ? 6 : 9]};
  slopes slopes;
  bool sloped = k.normals || k.derivatives;
  if (sloped) find_slopes(k.points, &slopes);
  ptrdiff_t begin = 0;
  for (size_t j = k.rect.j0; j <= k.rect.j1; j++, begin += k.line_step) {
    ptrdiff_t place = begin;
    line l;
    weigh_line(&k, sloped ? &slopes : NULL, value, j, &l);
    for (size_t i = k.rect.i0; i <= k.rect.i1; i++, place += k.step) {
      if (k.values) tw_store_values(k.origin + sum_four(value, i, l.columns, 1), k.width, k.values + place);
      if (!sloped) continue;
      tw_point tangents[2];
      tangents[transposed] = sum_three(spline.slope, i, l.along, 1);
      tangents[!transposed] = sum_four(spline.limit, i, l.across, 1);
      if (k.normals) tw_put_normal(tangents[0], tangents[1], quad, k.normals + place);
      if (k.derivatives) memcpy(k.derivatives + place, tangents, sizeof tangents);
    }
  }
}

/* Transposes the job where the rectangle is a single column, so that the inner loop runs along the column. */
void tw_spline_rows(const tw_spline_job *job) {
  bool column = job->column || job->rect.j0 != job->rect.j1;
  if (job->rect.i0 != job->rect.i1 || !column) {
    fill(job, false);
    return;
  }
  tw_point points[16];
  for (size_t r = 0; r < 4; r++)
    for (size_t k = 0; k < 4; k++) points[4 * r + k] = job->points[4 * k + r];
  tw_spline_job turned = *job;
  turned.points = points;
  turned.rect = (tw_patch_rect){job->rect.j0, job->rect.j1, job->rect.i0, job->rect.i1};
  turned.step = job->line_step;
  turned.line_step = job->step;
  fill(&turned, true);
}
