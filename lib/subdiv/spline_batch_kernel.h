/* Rectangles of several regular patches, as many at a time as a vector has lanes, by the arithmetic of
 * spline_kernel.h in the same order, so that a patch has the same bytes alone and among others. */
#ifndef TWEEND_SPLINE_BATCH_KERNEL_H
#define TWEEND_SPLINE_BATCH_KERNEL_H

#include "spline_batch.h"
#include "spline_kernel.h"

/* Differences of neighbouring control points, as slopes has them of one patch. */
typedef struct lane_slopes {
  vector along[4][3][3], across[3][4][3];
} lane_slopes;

/* Control points and slopes weighted down for one line. */
typedef struct lane_line {
  vector columns[4][3], along[3][3], across[4][3];
} lane_line;

static inline __attribute__((always_inline)) vector sum_four(const float *const table[4], size_t at,
                                                             const vector *v, size_t apart) {
  return (table[0][at] * v[0] + table[3][at] * v[3 * apart]) +
         (table[1][at] * v[apart] + table[2][at] * v[2 * apart]);
}

static inline __attribute__((always_inline)) vector sum_three(const float *const table[3], size_t at,
                                                              const vector *v, size_t apart) {
  return (table[0][at] * v[0] + table[2][at] * v[2 * apart]) + table[1][at] * v[apart];
}

static inline __attribute__((always_inline)) void find_lane_slopes(vector points[16][3], lane_slopes *out) {
  for (size_t r = 0; r < 4; r++)
    for (size_t k = 0; k < 4; k++)
      for (size_t c = 0; c < 3; c++) {
        vector point = points[4 * r + k][c];
        if (k < 3) out->along[r][k][c] = points[4 * r + k + 1][c] - point;
        if (r < 3) out->across[r][k][c] = points[4 * r + k + 4][c] - point;
      }
}

static inline __attribute__((always_inline)) void
weigh_lane_points(vector points[16][3], const float *const table[4], size_t j, lane_line *out) {
  for (size_t k = 0; k < 4; k++)
    for (size_t c = 0; c < 3; c++) out->columns[k][c] = sum_four(table, j, &points[k][c], 12);
}

static inline __attribute__((always_inline)) void
weigh_lane_slopes(const tw_spline *spline, const lane_slopes *s, size_t j, lane_line *out) {
  for (size_t k = 0; k < 4; k++)
    for (size_t c = 0; c < 3; c++) {
      if (k < 3) out->along[k][c] = sum_four(spline->limit, j, &s->along[0][k][c], 9);
      out->across[k][c] = sum_three(spline->slope, j, &s->across[0][k][c], 12);
    }
}

/* As greatest_square, of the vectors in each lane. */
static inline __attribute__((always_inline)) vector greatest_lane_square(vector (*v)[3], size_t count) {
  vector sum = {0};
  for (size_t c = 0; c < 3; c++) {
    vector most = {0};
    for (size_t i = 0; i < count; i++) most = greater(v[i][c] * v[i][c], most);
    sum += most;
  }
  return sum;
}

/* As tw_normal_least_square, and a little more: whatever is sure here is so alone. Tangents are convex
 * combinations of the line's slopes. */
static inline __attribute__((always_inline)) vector least_lane_square(lane_line *line) {
  vector lengths = greatest_lane_square(line->along, 3) * greatest_lane_square(line->across, 4), zero = {0};
  return greater(lengths * (1.001f * TW_NORMAL_PARALLEL), zero + TW_NORMAL_SQUARE_MIN);
}

/* Points i of a line of each patch. */
static inline __attribute__((always_inline)) void lane_values(lane_line *line, const float *const *value,
                                                              size_t i, vector *row) {
  for (size_t c = 0; c < 3; c++) row[c] = 0.0f + sum_four(value, i, &line->columns[0][c], 3);
}

/* Their normals; sure: as unit_normals has it. */
static inline __attribute__((always_inline)) crossed
lane_normals(const tw_spline *spline, lane_line *line, size_t i, vector least, vector outward, mask *sure) {
  vector along[3], across[3];
  for (size_t c = 0; c < 3; c++) {
    along[c] = sum_three(spline->slope, i, &line->along[0][c], 3);
    across[c] = sum_four(spline->limit, i, &line->across[0][c], 3);
  }
  return cross_tangents(along, across, least, outward, sure);
}

static inline uint32_t bits_unset(mask m, size_t count) {
  uint32_t bits = 0;
  for (size_t l = 0; l < count && !all_set(m); l++) bits |= m[l] ? 0 : 1u << l;
  return bits;
}

/* A row of each patch, `place` floats behind its first. */
static inline __attribute__((always_inline)) void
store_lanes(const vector *v, size_t width, float *const *rows, size_t count, ptrdiff_t place) {
  apart a = take_apart(v, width);
  if (count < LANES) {
    apart kept = a;
    for (size_t l = 0; l < count; l++) put_one_apart(&kept, width, l, rows[l] + place);
    return;
  }
  for (size_t m = 0; m < LANES / 4; m++)
    for (size_t r = 0; r < 4; r++)
      put_row(rows[4 * m + r] + place, width, four_of(a.rows[r], m), four_of(a.tails[r / 2], m), r % 2);
}

/* Points of a line that are crossed before the first of them becomes a row, as the lines of a group are. */
enum { TOGETHER_LANES = 8 };

/* Patches from `first` on, one a lane; the bits of those that need a closer look. */
static inline __attribute__((always_inline)) uint32_t fill_lanes(const tw_spline_batch *b, size_t first,
                                                                 bool normals) {
  /* Copies, which no row that is stored can be taken to change. */
  const tw_spline spline = *b->spline;
  const float *const *value = b->limit ? spline.limit : spline.point;
  const tw_patch_rect rect = b->rect;
  const ptrdiff_t step = b->step;
  float *rows[LANES];
  vector points[16][3], outward = load(b->outward + first);
  memcpy(rows, b->rows + first, sizeof rows);
  for (size_t p = 0; p < 16; p++)
    for (size_t c = 0; c < 3; c++) points[p][c] = load(b->points[p][c] + first);
  lane_slopes slopes;
  if (normals) find_lane_slopes(points, &slopes);
  size_t count = b->count - first < LANES ? b->count - first : LANES;
  ptrdiff_t place = 0;
  mask sure = first_mask();
  for (size_t j = rect.j0; j <= rect.j1; j++) {
    lane_line line;
    vector least = {0};
    weigh_lane_points(points, value, j, &line);
    if (normals) {
      weigh_lane_slopes(&spline, &slopes, j, &line);
      least = least_lane_square(&line);
    }
    for (size_t i = rect.i0; i <= rect.i1; i += TOGETHER_LANES) {
      crossed crosses[TOGETHER_LANES];
      size_t points = rect.i1 + 1 - i < TOGETHER_LANES ? rect.i1 + 1 - i : TOGETHER_LANES;
      for (size_t p = 0; normals && p < points; p++)
        crosses[p] = lane_normals(&spline, &line, i + p, least, outward, &sure);
      for (size_t p = 0; p < points; p++, place += step) {
        vector row[ROW_MAX];
        lane_values(&line, value, i + p, row);
        if (normals) normalise(&crosses[p], row + 3);
        store_lanes(row, normals ? 6 : 3, rows, count, place);
      }
    }
  }
  return bits_unset(sure, count) << first;
}

static inline __attribute__((always_inline)) uint32_t fill_batch(const tw_spline_batch *batch) {
  uint32_t unsure = 0;
  for (size_t first = 0; first < batch->count; first += LANES)
    unsure |= batch->normals ? fill_lanes(batch, first, true) : fill_lanes(batch, first, false);
  return unsure;
}

#endif
