/* B-splines: weight tables by repeated knot insertion, exact until they are rounded to float, and the kernels
 * of rows for every machine with the choice of the best one. */
#include "bspline.h"

#include <stdlib.h>
#include <string.h>

#include "bspline_kernel.h"
#include "simd.h"

enum { ROWS = 4 + 4 + 3 };

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

/* Floats in a row of the table of a depth. */
static size_t row_length(uint32_t depth) {
  return ((size_t)1 << depth) + TW_SPLINE_LANES;
}

/* rows: [ROWS][row_length]. */
static void fill_table(uint32_t depth, const double (*points)[4], float *rows, tw_spline *out) {
  size_t length = row_length(depth);
  uint32_t n = 1u << depth;
  for (uint32_t i = 0; i < length; i++) {
    float weights[ROWS];
    weigh(points, n, i < n ? i : n, weights);
    for (uint32_t r = 0; r < ROWS; r++) rows[r * length + i] = weights[r];
  }
  for (uint32_t k = 0; k < 4; k++) {
    out->point[k] = rows + k * length;
    out->limit[k] = rows + (4 + k) * length;
    if (k < 3) out->slope[k] = rows + (8 + k) * length;
  }
}

size_t tw_spline_tables_size(uint32_t depth) {
  size_t size = 0;
  for (uint32_t d = 0; d <= depth; d++) size += sizeof(tw_spline) + ROWS * row_length(d) * sizeof(float);
  return size;
}

tw_spline *tw_spline_tables_create(uint32_t depth) {
  tw_spline *tables = tw_alloc(1, tw_spline_tables_size(depth));
  size_t room = ((size_t)1 << depth) + 3;
  double(*points)[4] = tw_alloc_zero(room, 2 * sizeof *points);
  if (!tables || !points) {
    free(tables);
    free(points);
    return NULL;
  }
  float *rows = (float *)(void *)(tables + depth + 1);
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
  free(points);
  return tables;
}

/* ---- rows: the kernel for every machine, and the choice of the best one ------------------------- */

/* The sum of three slopes weighted by entry i of their tables, added in the kernel's order. */
static float weighted_three(const float (*slopes)[TW_WIDTH_MAX], size_t c, const float *const table[3],
                            size_t i) {
  return (table[0][i] * slopes[0][c] + table[2][i] * slopes[2][c]) + table[1][i] * slopes[1][c];
}

static float weighted_four(const float (*slopes)[TW_WIDTH_MAX], size_t c, const float *const table[4],
                           size_t i) {
  return (table[0][i] * slopes[0][c] + table[3][i] * slopes[3][c]) +
         (table[1][i] * slopes[1][c] + table[2][i] * slopes[2][c]);
}

void tw_spline_look_closer(const tw_spline_job *job, size_t first, size_t count, size_t j, bool transposed,
                           float *out) {
  const float *corners[4] = {job->points[5], job->points[transposed ? 9 : 6], job->points[10],
                             job->points[transposed ? 6 : 9]};
  slopes slopes;
  line_slopes line;
  find_slopes(job->points, &slopes);
  weigh_slopes(&slopes, job->spline, j, &line);
  for (size_t i = first; i < first + count; i++, out += job->step) {
    float tangents[2][3];
    for (size_t c = 0; c < 3; c++) {
      tangents[transposed][c] =
          weighted_three((const float(*)[TW_WIDTH_MAX])line.along, c, job->spline->slope, i);
      tangents[!transposed][c] =
          weighted_four((const float(*)[TW_WIDTH_MAX])line.across, c, job->spline->limit, i);
    }
    tw_normal_from_tangents(tangents[0], tangents[1], corners, out);
  }
}

static void fill_anywhere(const tw_spline_job *job, bool transposed) {
  fill_job(job, transposed);
}

typedef void fill_kernel(const tw_spline_job *job, bool transposed);

static fill_kernel *const kernels[TW_SETS] = {fill_anywhere,
#ifdef __x86_64__
                                              tw_spline_fill_avx2
#endif
};

/* A single column runs along i once i and j have changed places. */
static void run(fill_kernel *kernel, const tw_spline_job *job) {
  bool column = job->column || job->rect.j0 != job->rect.j1;
  if (job->rect.i0 != job->rect.i1 || !column) {
    kernel(job, false);
    return;
  }
  float points[16][TW_WIDTH_MAX];
  for (size_t r = 0; r < 4; r++)
    for (size_t k = 0; k < 4; k++) memcpy(points[4 * r + k], job->points[4 * k + r], sizeof points[0]);
  tw_spline_job turned = *job;
  turned.points = (const float(*)[TW_WIDTH_MAX])points;
  turned.rect = (tw_patch_rect){job->rect.j0, job->rect.j1, job->rect.i0, job->rect.i1};
  turned.step = job->line_step;
  turned.line_step = job->step;
  kernel(&turned, true);
}

void tw_spline_rows(const tw_spline_job *job) {
  run(kernels[tw_processor_has(TW_SET_AVX2)], job);
}
