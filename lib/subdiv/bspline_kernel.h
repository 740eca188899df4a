/* The lines of a regular patch, a few points at a time, in vectors as wide as the compiler may use: each file
 * that includes this is compiled for another instruction set.
 *
 * Control points are weighted down their columns once a line, then across, component by component, and woven
 * into rows at the end. Derivatives come from the differences of control points: those are nearly exact, and
 * equal points give exactly 0. No product is contracted and no root approximated, and every point is computed
 * the same way wherever it lies in a vector, so that all instruction sets give the same bytes. */
#ifndef TWEEND_SPLINE_KERNEL_H
#define TWEEND_SPLINE_KERNEL_H

#include "bspline.h"
#include "wide.h"

enum { DERIVATIVE_SECOND = 4 };

/* ---- weights -------------------------------------------------------------------------------- */

/* Four lines of points weighted as at place j. Summed from both ends, so that a mirrored patch gives mirrored
 * points to the last bit. */
static inline __attribute__((always_inline)) void
weigh_four(const float (*lines)[TW_LINE], const float *const table[4], size_t j, float *out) {
  float w0 = table[0][j], w1 = table[1][j], w2 = table[2][j], w3 = table[3][j];
  for (size_t m = 0; m < TW_LINE; m += TW_WIDE) {
    tw_vector sum = (w0 * tw_load(lines[0] + m) + w3 * tw_load(lines[3] + m)) +
                    (w1 * tw_load(lines[1] + m) + w2 * tw_load(lines[2] + m));
    memcpy(out + m, &sum, sizeof sum);
  }
}

static inline __attribute__((always_inline)) void
weigh_three(const float (*lines)[TW_LINE], const float *const table[3], size_t j, float *out) {
  float w0 = table[0][j], w1 = table[1][j], w2 = table[2][j];
  for (size_t m = 0; m < TW_LINE; m += TW_WIDE) {
    tw_vector sum = (w0 * tw_load(lines[0] + m) + w2 * tw_load(lines[2] + m)) + w1 * tw_load(lines[1] + m);
    memcpy(out + m, &sum, sizeof sum);
  }
}

/* Of the points from place i on. */
static inline __attribute__((always_inline)) void load_weights(const float *const *table, size_t count,
                                                               size_t i, tw_vector *out) {
  for (size_t w = 0; w < count; w++) out[w] = tw_load(table[w] + i);
}

/* Component c of points by their weights. */
static inline __attribute__((always_inline)) tw_vector across_four(const float (*columns)[TW_WIDTH_MAX],
                                                                   size_t c, const tw_vector weights[4]) {
  return (weights[0] * columns[0][c] + weights[3] * columns[3][c]) +
         (weights[1] * columns[1][c] + weights[2] * columns[2][c]);
}

static inline __attribute__((always_inline)) tw_vector across_three(const float (*columns)[TW_WIDTH_MAX],
                                                                    size_t c, const tw_vector weights[3]) {
  return (weights[0] * columns[0][c] + weights[2] * columns[2][c]) + weights[1] * columns[1][c];
}

/* ---- values --------------------------------------------------------------------------------- */

/* LANES points or all of a shorter line; the last block of a longer one takes in points of that before. */
typedef struct block {
  size_t i, count;
  ptrdiff_t place; /* of its first point in the line */
} block;

/* A job of one kernel: a copy, which no row that is stored can be taken to change. */
typedef struct kernel_job {
  tw_spline_job job;
  tw_spline spline;
  const float *value[4]; /* weights of values */
  size_t blocks;         /* a line */
  size_t whole_before;   /* shorter lines below this are stored as whole blocks */
} kernel_job;

static inline __attribute__((always_inline)) kernel_job start(const tw_spline_job *job) {
  kernel_job k = {.job = *job, .spline = *job->spline};
  for (int w = 0; w < 4; w++) k.value[w] = job->limit ? k.spline.limit[w] : k.spline.point[w];
  size_t points = job->rect.i1 - job->rect.i0 + 1, end = (size_t)job->rect.j1 + 1;
  k.blocks = (points + TW_WIDE - 1) / TW_WIDE;
  /* What runs over the end of a line is written again with the lines after it. */
  if (points < TW_WIDE && job->line_step == job->step * (ptrdiff_t)points &&
      (end - job->rect.j0) * points >= TW_WIDE)
    k.whole_before = end - (TW_WIDE - 1) / points;
  return k;
}

static inline __attribute__((always_inline)) block block_at(const kernel_job *k, size_t n, size_t j) {
  const tw_patch_rect *rect = &k->job.rect;
  size_t points = rect->i1 - rect->i0 + 1, first = n * TW_WIDE;
  if (points < TW_WIDE) return (block){rect->i0, j < k->whole_before ? TW_WIDE : points, 0};
  if (first + TW_WIDE > points) first = points - TW_WIDE;
  return (block){rect->i0 + first, TW_WIDE, (ptrdiff_t)first};
}

static inline __attribute__((always_inline)) void value_lanes(const kernel_job *k,
                                                              const float (*columns)[TW_WIDTH_MAX],
                                                              size_t width, const tw_vector weights[4],
                                                              tw_vector *out) {
  for (size_t c = 0; c < width; c++) out[c] = k->job.origin[c] + across_four(columns, c, weights);
}

static inline __attribute__((always_inline)) void fill_values(const tw_spline_job *job, size_t width) {
  const kernel_job k = start(job);
  float *line = k.job.values;
  for (size_t j = k.job.rect.j0; j <= k.job.rect.j1; j++, line += k.job.line_step) {
    float columns[4][TW_WIDTH_MAX];
    weigh_four((const float(*)[TW_LINE])k.job.points, k.value, j, columns[0]);
    for (size_t n = 0; n < k.blocks; n++) {
      tw_vector weights[4], values[TW_WIDTH_MAX];
      block b = block_at(&k, n, j);
      load_weights(k.value, 4, b.i, weights);
      value_lanes(&k, (const float(*)[TW_WIDTH_MAX])columns, width, weights, values);
      tw_store_rows(values, width, b.count, line + b.place * k.job.step, k.job.step);
    }
  }
}

/* ---- derivatives ---------------------------------------------------------------------------- */

/* Differences of neighbouring control points: along i three in each of four lines, along j four in each of
 * three. */
typedef struct slopes {
  _Alignas(TW_LINE * sizeof(float)) float along[4][TW_LINE];
  float across[3][TW_LINE];
} slopes;

static inline void find_slopes(const float (*points)[TW_WIDTH_MAX], slopes *out) {
  static const int32_t three_fours[TW_LINE] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
  for (size_t r = 0; r < 4; r++)
    for (size_t m = 0; m < TW_LINE; m += TW_WIDE) {
      const float *row = points[4 * r];
      tw_mask kept;
      memcpy(&kept, three_fours + m, sizeof kept);
      tw_vector at = tw_load(row + m), next = tw_four_on(at, tw_load(row + (m + TW_WIDE) % TW_LINE)) - at;
      tw_put_all(out->along[r] + m, (tw_vector)((tw_mask)next & kept));
      if (r < 3) tw_put_all(out->across[r] + m, tw_load(row + TW_LINE + m) - at);
    }
}

/* The slopes weighted down for one line. */
typedef struct line_slopes {
  float along[4][TW_WIDTH_MAX], across[4][TW_WIDTH_MAX];
} line_slopes;

static inline __attribute__((always_inline)) void weigh_slopes(const slopes *s, const tw_spline *spline,
                                                               size_t j, line_slopes *out) {
  weigh_four(s->along, spline->limit, j, out->along[0]);
  weigh_three(s->across, spline->slope, j, out->across[0]);
}

/* Weights of slopes along a line and across it. */
typedef struct slope_weights {
  tw_vector along[3], across[4];
} slope_weights;

static inline __attribute__((always_inline)) void load_slope_weights(const tw_spline *spline, size_t i,
                                                                     slope_weights *out) {
  load_weights(spline->slope, 3, i, out->along);
  load_weights(spline->limit, 4, i, out->across);
}

/* Tangents of points of a line. */
static inline __attribute__((always_inline)) void tangent_lanes(const line_slopes *s, const slope_weights *w,
                                                                size_t width, tw_vector *along,
                                                                tw_vector *across) {
  for (size_t c = 0; c < width; c++) {
    along[c] = across_three((const float(*)[TW_WIDTH_MAX])s->along, c, w->along);
    across[c] = across_four((const float(*)[TW_WIDTH_MAX])s->across, c, w->across);
  }
}

/* transposed: the job's i is j of the patch, so that its first tangent is the patch's second. */
static inline __attribute__((always_inline)) void fill_derivatives(const tw_spline_job *job, bool transposed,
                                                                   size_t width) {
  const kernel_job k = start(job);
  slopes slopes;
  find_slopes(k.job.points, &slopes);
  size_t along = transposed ? DERIVATIVE_SECOND : 0;
  float *line = k.job.derivatives;
  for (size_t j = k.job.rect.j0; j <= k.job.rect.j1; j++, line += k.job.line_step) {
    line_slopes at_line;
    weigh_slopes(&slopes, &k.spline, j, &at_line);
    for (size_t n = 0; n < k.blocks; n++) {
      slope_weights weights;
      tw_vector tangents[2][TW_WIDTH_MAX];
      block b = block_at(&k, n, j);
      load_slope_weights(&k.spline, b.i, &weights);
      tangent_lanes(&at_line, &weights, width, tangents[0], tangents[1]);
      float *out = line + b.place * k.job.step;
      tw_store_rows(tangents[0], width, b.count, out + along, k.job.step);
      tw_store_rows(tangents[1], width, b.count, out + DERIVATIVE_SECOND - along, k.job.step);
    }
  }
}

/* ---- normals -------------------------------------------------------------------------------- */

/* At least the greatest square of some lines of vectors: that of the greatest components. */
static inline __attribute__((always_inline)) float greatest_square(const float (*lines)[TW_LINE],
                                                                   size_t count) {
  tw_vector most = {0};
  for (size_t i = 0; i < count; i++)
    for (size_t m = 0; m < TW_LINE; m += TW_WIDE) {
      tw_vector slope = tw_load(lines[i] + m);
      most = tw_greater(slope * slope, most);
    }
  tw_four greatest = tw_four_of(most, 0);
  for (size_t m = 1; m < TW_WIDE / 4; m++) {
    tw_four square = tw_four_of(most, m);
    tw_four_mask more = square > greatest;
    greatest = (tw_four)(((tw_four_mask)square & more) | ((tw_four_mask)greatest & ~more));
  }
  return greatest[0] + greatest[1] + greatest[2];
}

/* The least square of a cross product of the patch that needs no closer look. */
static inline float least_square(const slopes *s) {
  /* Tangents are convex combinations of slopes. */
  return tw_normal_least_square(greatest_square(s->along, 4) * greatest_square(s->across, 3));
}

static inline __attribute__((always_inline)) tw_crossed
cross_lanes(const line_slopes *s, const slope_weights *w, float least, tw_vector outward, tw_mask *sure) {
  tw_vector along[3], across[3], zero = {0};
  tangent_lanes(s, w, 3, along, across);
  return tw_cross_tangents(along, across, zero + least, outward, sure);
}

/* positions: the values as well, which are those of points, and the normals stand next to them. */
static inline __attribute__((always_inline)) void fill_normals(const tw_spline_job *job, bool positions,
                                                               bool transposed) {
  const kernel_job k = start(job);
  const size_t before = positions ? 3 : 0, points = job->rect.i1 - job->rect.i0 + 1;
  slopes slopes;
  find_slopes(k.job.points, &slopes);
  float least = least_square(&slopes), *line = positions ? k.job.values : k.job.normals;
  tw_vector zero = {0}, outward = zero + (transposed ? -1.0f : 1.0f);
  for (size_t j = k.job.rect.j0; j <= k.job.rect.j1; j++, line += k.job.line_step) {
    float columns[4][TW_WIDTH_MAX];
    line_slopes at_line;
    tw_mask sure = tw_first_mask();
    if (positions) weigh_four((const float(*)[TW_LINE])k.job.points, k.value, j, columns[0]);
    weigh_slopes(&slopes, &k.spline, j, &at_line);
    for (size_t n = 0; n < k.blocks; n++) {
      tw_vector weights[4], rows[TW_ROW_MAX];
      slope_weights slope_weights;
      block b = block_at(&k, n, j);
      load_slope_weights(&k.spline, b.i, &slope_weights);
      tw_crossed normals = cross_lanes(&at_line, &slope_weights, least, outward, &sure);
      load_weights(k.value, 4, b.i, weights);
      if (positions) value_lanes(&k, (const float(*)[TW_WIDTH_MAX])columns, 3, weights, rows);
      tw_normalise(&normals, rows + before);
      tw_store_rows(rows, before + 3, b.count, line + b.place * k.job.step, k.job.step);
    }
    if (!tw_all_set(sure)) tw_spline_look_closer(&k.job, k.job.rect.i0, points, j, transposed, line + before);
  }
}

/* All of a job. */
static inline void fill_job(const tw_spline_job *job, bool transposed) {
  if (job->values && job->normals == job->values + 3 && job->width == 3) {
    fill_normals(job, true, transposed);
  } else {
    if (job->values && job->width == 3)
      fill_values(job, 3);
    else if (job->values && job->width == 2)
      fill_values(job, 2);
    else if (job->values && job->width == 1)
      fill_values(job, 1);
    else if (job->values)
      fill_values(job, 4);
    if (job->normals) fill_normals(job, false, transposed);
  }
  if (job->derivatives && job->width == 2)
    fill_derivatives(job, transposed, 2);
  else if (job->derivatives)
    fill_derivatives(job, transposed, TW_WIDTH_MAX);
}

#endif
