/* The lines of a regular patch, a few points at a time, in vectors as wide as the compiler may use: each file
 * that includes this is compiled for another instruction set.
 *
 * Control points are weighted down their columns once a line, then across, component by component, and woven
 * into rows at the end. Derivatives come from the differences of control points: those are nearly exact, and
 * equal points give exactly 0. No product is contracted and no root approximated, and every point is computed
 * the same way wherever it lies in a vector, so that all instruction sets give the same bytes. */
#ifndef TWEEND_SPLINE_KERNEL_H
#define TWEEND_SPLINE_KERNEL_H

#include <math.h>

#include "normal.h"
#include "spline_rows.h"
#include "wide.h"

enum { DERIVATIVE_SECOND = 4 };

/* ---- weights -------------------------------------------------------------------------------- */

/* Four lines of points weighted as at place j. Summed from both ends, so that a mirrored patch gives mirrored
 * points to the last bit. */
static inline __attribute__((always_inline)) void
weigh_four(const float (*lines)[LINE], const float *const table[4], size_t j, float *out) {
  float w0 = table[0][j], w1 = table[1][j], w2 = table[2][j], w3 = table[3][j];
  for (size_t m = 0; m < LINE; m += LANES) {
    vector sum = (w0 * load(lines[0] + m) + w3 * load(lines[3] + m)) +
                 (w1 * load(lines[1] + m) + w2 * load(lines[2] + m));
    memcpy(out + m, &sum, sizeof sum);
  }
}

static inline __attribute__((always_inline)) void
weigh_three(const float (*lines)[LINE], const float *const table[3], size_t j, float *out) {
  float w0 = table[0][j], w1 = table[1][j], w2 = table[2][j];
  for (size_t m = 0; m < LINE; m += LANES) {
    vector sum = (w0 * load(lines[0] + m) + w2 * load(lines[2] + m)) + w1 * load(lines[1] + m);
    memcpy(out + m, &sum, sizeof sum);
  }
}

/* Component c of the points from place i on. */
static inline __attribute__((always_inline)) vector across_four(const float (*columns)[WIDTH_MAX], size_t c,
                                                                const float *const table[4], size_t i) {
  return (load(table[0] + i) * columns[0][c] + load(table[3] + i) * columns[3][c]) +
         (load(table[1] + i) * columns[1][c] + load(table[2] + i) * columns[2][c]);
}

static inline __attribute__((always_inline)) vector across_three(const float (*columns)[WIDTH_MAX], size_t c,
                                                                 const float *const table[3], size_t i) {
  return (load(table[0] + i) * columns[0][c] + load(table[2] + i) * columns[2][c]) +
         load(table[1] + i) * columns[1][c];
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
  k.blocks = (points + LANES - 1) / LANES;
  /* What runs over the end of a line is written again with the lines after it. */
  if (points < LANES && job->line_step == job->step * (ptrdiff_t)points &&
      (end - job->rect.j0) * points >= LANES)
    k.whole_before = end - (LANES - 1) / points;
  return k;
}

static inline __attribute__((always_inline)) block block_at(const kernel_job *k, size_t n, size_t j) {
  const tw_patch_rect *rect = &k->job.rect;
  size_t points = rect->i1 - rect->i0 + 1, first = n * LANES;
  if (points < LANES) return (block){rect->i0, j < k->whole_before ? LANES : points, 0};
  if (first + LANES > points) first = points - LANES;
  return (block){rect->i0 + first, LANES, (ptrdiff_t)first};
}

static inline __attribute__((always_inline)) void
value_lanes(const kernel_job *k, const float (*columns)[WIDTH_MAX], size_t width, size_t i, vector *out) {
  for (size_t c = 0; c < width; c++) out[c] = k->job.origin[c] + across_four(columns, c, k->value, i);
}

static inline __attribute__((always_inline)) void fill_values(const tw_spline_job *job, size_t width) {
  const kernel_job k = start(job);
  float *line = k.job.values;
  for (size_t j = k.job.rect.j0; j <= k.job.rect.j1; j++, line += k.job.line_step) {
    float columns[4][WIDTH_MAX];
    weigh_four((const float(*)[LINE])k.job.points, k.value, j, columns[0]);
    for (size_t n = 0; n < k.blocks; n++) {
      vector values[WIDTH_MAX];
      block b = block_at(&k, n, j);
      value_lanes(&k, (const float(*)[WIDTH_MAX])columns, width, b.i, values);
      store_rows(values, width, b.count, line + b.place * k.job.step, k.job.step);
    }
  }
}

/* ---- derivatives ---------------------------------------------------------------------------- */

/* Differences of neighbouring control points: along i three in each of four lines, along j four in each of
 * three. */
typedef struct slopes {
  _Alignas(LINE * sizeof(float)) float along[4][LINE];
  float across[3][LINE];
} slopes;

static inline void find_slopes(const float (*points)[WIDTH_MAX], slopes *out) {
  four at[16];
  memcpy(at, points, sizeof at);
  for (size_t r = 0; r < 4; r++)
    for (size_t k = 0; k < 4; k++) {
      four along = k < 3 ? at[4 * r + k + 1] - at[4 * r + k] : (four){0};
      put(out->along[r] + k * WIDTH_MAX, along);
      if (r < 3) put(out->across[r] + k * WIDTH_MAX, at[4 * r + k + 4] - at[4 * r + k]);
    }
}

/* The slopes weighted down for one line. */
typedef struct line_slopes {
  float along[4][WIDTH_MAX], across[4][WIDTH_MAX];
} line_slopes;

static inline __attribute__((always_inline)) void weigh_slopes(const slopes *s, const tw_spline *spline,
                                                               size_t j, line_slopes *out) {
  weigh_four(s->along, spline->limit, j, out->along[0]);
  weigh_three(s->across, spline->slope, j, out->across[0]);
}

static inline __attribute__((always_inline)) vector tangent_along(const tw_spline *spline,
                                                                  const line_slopes *s, size_t c, size_t i) {
  return across_three((const float(*)[WIDTH_MAX])s->along, c, spline->slope, i);
}

static inline __attribute__((always_inline)) vector tangent_across(const tw_spline *spline,
                                                                   const line_slopes *s, size_t c, size_t i) {
  return across_four((const float(*)[WIDTH_MAX])s->across, c, spline->limit, i);
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
      vector tangents[2][WIDTH_MAX];
      block b = block_at(&k, n, j);
      for (size_t c = 0; c < width; c++) {
        tangents[0][c] = tangent_along(&k.spline, &at_line, c, b.i);
        tangents[1][c] = tangent_across(&k.spline, &at_line, c, b.i);
      }
      float *out = line + b.place * k.job.step;
      store_rows(tangents[0], width, b.count, out + along, k.job.step);
      store_rows(tangents[1], width, b.count, out + DERIVATIVE_SECOND - along, k.job.step);
    }
  }
}

/* ---- normals -------------------------------------------------------------------------------- */

static inline __attribute__((always_inline)) vector greater(vector a, vector b) {
  mask more = a > b;
  return (vector)(((mask)a & more) | ((mask)b & ~more));
}

/* At least the greatest square of some lines of vectors: that of the greatest components. */
static inline __attribute__((always_inline)) float greatest_square(const float (*lines)[LINE], size_t count) {
  vector most = {0};
  for (size_t i = 0; i < count; i++)
    for (size_t m = 0; m < LINE; m += LANES) {
      vector slope = load(lines[i] + m);
      most = greater(slope * slope, most);
    }
  four greatest = four_of(most, 0);
  for (size_t m = 1; m < LANES / 4; m++) {
    four square = four_of(most, m);
    four_mask more = square > greatest;
    greatest = (four)(((four_mask)square & more) | ((four_mask)greatest & ~more));
  }
  return greatest[0] + greatest[1] + greatest[2];
}

/* The least square of a cross product of the patch that needs no closer look. */
static inline float least_square(const slopes *s) {
  /* Tangents are convex combinations of slopes. */
  return tw_normal_least_square(greatest_square(s->along, 4) * greatest_square(s->across, 3));
}

static inline vector root(vector square) {
  vector out;
  for (int l = 0; l < LANES; l++) out[l] = sqrtf(square[l]);
  return out;
}

static inline __attribute__((always_inline)) bool all_set(mask m) {
  four_mask all = (four_mask)four_of((vector)m, 0);
  for (size_t n = 1; n < LANES / 4; n++) all &= (four_mask)four_of((vector)m, n);
  uint64_t halves[2];
  memcpy(halves, &all, sizeof halves);
  return (halves[0] & halves[1]) == UINT64_MAX;
}

static inline mask first_mask(void) {
  return (mask){0} == 0;
}

/* What one line weighs its places' points and slopes with. */
typedef struct line_weights {
  _Alignas(LINE * sizeof(float)) float columns[4][WIDTH_MAX];
  line_slopes slopes;
} line_weights;

static inline __attribute__((always_inline)) void weigh_line(const kernel_job *k, const slopes *s,
                                                             bool positions, size_t j, line_weights *out) {
  if (positions) weigh_four((const float(*)[LINE])k->job.points, k->value, j, out->columns[0]);
  weigh_slopes(s, &k->spline, j, &out->slopes);
}

/* Lets the compiler keep nothing of a line in registers: there are fewer than numbers, and lines are too
 * short to pay for filling them. */
static inline void take_from_memory(void) {
  __asm__ volatile("" ::: "memory");
}

/* Unit normals of tangents, with no zero below 0: a patch has the same ones turned round. outward: 1, or -1
 * to turn them over; sure: which of all so far need no closer look. */
static inline __attribute__((always_inline)) void
unit_normals(const vector a[3], const vector b[3], vector least, vector outward, vector *out, mask *sure) {
  for (size_t c = 0; c < 3; c++) out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
  vector square = out[0] * out[0] + out[1] * out[1] + out[2] * out[2];
  *sure &= (square > least) & (square < TW_NORMAL_SQUARE_MAX);
  vector scale = outward / root(square);
  for (size_t c = 0; c < 3; c++) out[c] = out[c] * scale + 0.0f;
}

/* Normals from place i on. */
static inline __attribute__((always_inline)) void normal_lanes(const tw_spline *spline, const line_slopes *s,
                                                               size_t i, bool transposed, float least,
                                                               vector *out, mask *sure) {
  vector a[3], b[3];
  for (size_t c = 0; c < 3; c++) {
    a[c] = tangent_along(spline, s, c, i);
    b[c] = tangent_across(spline, s, c, i);
  }
  vector zero = {0};
  unit_normals(a, b, zero + least, zero + (transposed ? -1.0f : 1.0f), out, sure);
}

/* Asks for memory that rows farther on will be written to, be they of this patch or not: the processor sees
 * them coming too late. An address beyond the end does no harm. */
static inline __attribute__((always_inline)) void prepare_rows(const float *out, size_t width) {
  enum { AHEAD = 1024, CACHE_LINE = 64 };
  for (size_t at = 0; at < width * LANES * sizeof *out; at += CACHE_LINE)
    __builtin_prefetch((const void *)((uintptr_t)out + AHEAD + at), 1, 3);
}

/* positions: the values as well, which are those of points, and the normals stand next to them. */
static inline __attribute__((always_inline)) void fill_normals(const tw_spline_job *job, bool positions,
                                                               bool transposed) {
  const kernel_job k = start(job);
  slopes slopes;
  find_slopes(k.job.points, &slopes);
  size_t before = positions ? 3 : 0, width = before + 3;
  float least = least_square(&slopes), *line = positions ? k.job.values : k.job.normals;
  for (size_t j = k.job.rect.j0; j <= k.job.rect.j1; j++, line += k.job.line_step) {
    line_weights weights;
    weigh_line(&k, &slopes, positions, j, &weights);
    mask sure = first_mask();
    for (size_t n = 0; n < k.blocks; n++) {
      take_from_memory();
      vector rows[ROW_MAX];
      block b = block_at(&k, n, j);
      float *out = line + b.place * k.job.step;
      if (k.job.step == (ptrdiff_t)width) prepare_rows(out, width);
      if (positions) value_lanes(&k, (const float(*)[WIDTH_MAX])weights.columns, 3, b.i, rows);
      normal_lanes(&k.spline, &weights.slopes, b.i, transposed, least, rows + before, &sure);
      store_rows(rows, width, b.count, out, k.job.step);
    }
    if (!all_set(sure))
      tw_spline_look_closer(&k.job, k.job.rect.i0, k.job.rect.i1 - k.job.rect.i0 + 1, j, transposed,
                            line + before);
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
    else if (job->values)
      fill_values(job, 4);
    if (job->normals) fill_normals(job, false, transposed);
  }
  if (job->derivatives && job->width == 2)
    fill_derivatives(job, transposed, 2);
  else if (job->derivatives)
    fill_derivatives(job, transposed, WIDTH_MAX);
}

#endif
