/* Sums of stencils, a few points at a time, in vectors as wide as the compiler may use: each file that
 * includes this is compiled for another instruction set. Every point is summed in the same order wherever it
 * lies in a vector and whatever else is asked for, so that all instruction sets give the same bytes. */
#ifndef TWEEND_STENCIL_KERNEL_H
#define TWEEND_STENCIL_KERNEL_H

#include "stencil.h"
#include "wide.h"

enum { BLOCK = TW_STENCIL_BLOCK };

/* ---- sums ----------------------------------------------------------------------------------- */

/* Held in a register: from memory that might change, it cannot be loaded again for each of its uses, which
 * would take twice as long as all else. */
static inline __attribute__((always_inline)) tw_vector load_once(const float *from) {
  tw_vector held = tw_load(from);
  __asm__ volatile("" ::: "memory");
  return held;
}

/* Where the weights of the points from `place` on begin, of which every point has `width`. */
static inline const float *weights_at(const tw_stencil *stencil, const float *weights, size_t place,
                                      size_t width) {
  return weights + place / BLOCK * stencil->control_count * width * BLOCK + place % BLOCK;
}

/* `width` components of the points from `place` on: even and odd controls apart, which halves the time that a
 * sum waits for itself. */
static inline __attribute__((always_inline)) void sum_values(const tw_stencil_job *job, size_t place,
                                                             size_t width, tw_vector out[TW_WIDTH_MAX]) {
  const float *weights = weights_at(job->stencil, job->stencil->values, place, 1);
  const float(*controls)[TW_WIDTH_MAX] = job->controls;
  const size_t count = job->stencil->control_count;
  tw_vector even[TW_WIDTH_MAX] = {{0}}, odd[TW_WIDTH_MAX] = {{0}};
  for (size_t k = 0; k < count; k += 2, weights += 2 * (size_t)BLOCK) {
    tw_vector one = load_once(weights), other = load_once(weights + BLOCK);
    for (size_t c = 0; c < width; c++) {
      even[c] += one * controls[k][c];
      odd[c] += other * controls[k + 1][c];
    }
  }
  for (size_t c = 0; c < width; c++) out[c] = job->origin[c] + (even[c] + odd[c]);
}

static inline __attribute__((always_inline)) void sum_tangents(const tw_stencil_job *job, size_t place,
                                                               tw_vector out[2][3]) {
  const float *weights = weights_at(job->stencil, job->stencil->tangents, place, 2);
  const float(*controls)[TW_WIDTH_MAX] = job->controls;
  const size_t count = job->stencil->control_count;
  tw_vector a[3] = {{0}}, b[3] = {{0}};
  for (size_t k = 0; k < count; k++, weights += 2 * (size_t)BLOCK) {
    tw_vector one = load_once(weights), other = load_once(weights + BLOCK);
    for (size_t c = 0; c < 3; c++) {
      a[c] += one * controls[k][c];
      b[c] += other * controls[k][c];
    }
  }
  memcpy(out[0], a, sizeof a);
  memcpy(out[1], b, sizeof b);
}

/* ---- rows ----------------------------------------------------------------------------------- */

/* What is wanted of each point. */
typedef struct row_kind {
  size_t values; /* their width, or 0 */
  bool normals;  /* behind the values */
} row_kind;

static inline size_t width_of(row_kind kind) {
  return kind.values + (kind.normals ? 3 : 0);
}

/* Of LANES points. least: of normals, what the square of a cross product has to exceed; clears lanes of
 * `sure` that need a closer look. */
static inline __attribute__((always_inline)) void sum_rows(const tw_stencil_job *job, row_kind kind,
                                                           size_t place, float least, tw_vector *rows,
                                                           tw_mask *sure) {
  if (kind.values) sum_values(job, place, kind.values, rows);
  if (!kind.normals) return;
  tw_vector tangents[2][3], zero = {0};
  sum_tangents(job, place, tangents);
  tw_crossed crossed = tw_cross_tangents(tangents[0], tangents[1], zero + least, zero + 1.0f, sure);
  tw_normalise(&crossed, rows + kind.values);
}

static inline size_t lesser(size_t a, size_t b) {
  return a < b ? a : b;
}

/* Lanes from `count` on, whose weights are not those of a point of the line: they are not looked at, as they
 * are others on another machine. */
static inline tw_mask lanes_from(size_t count) {
  tw_mask lane;
  for (int32_t l = 0; l < TW_WIDE; l++) lane[l] = l;
  return lane >= (int32_t)count;
}

static inline __attribute__((always_inline)) void
sum_line(const tw_stencil_job *job, row_kind kind, size_t begin, float least, float *out, tw_mask *sure) {
  size_t end = begin + job->count, count;
  for (size_t place = begin; place < end; place += count, out += (ptrdiff_t)count * job->step) {
    tw_vector rows[TW_ROW_MAX];
    tw_mask fits = tw_first_mask();
    count = lesser(lesser(end - place, TW_WIDE), BLOCK - place % BLOCK);
    sum_rows(job, kind, place, least, rows, &fits);
    *sure &= count < TW_WIDE ? fits | lanes_from(count) : fits;
    tw_store_rows(rows, width_of(kind), count, out, job->step);
  }
}

static inline float farthest_square(const float (*vectors)[TW_WIDTH_MAX], size_t count) {
  float farthest = 0;
  for (size_t i = 0; i < count; i++) {
    const float *v = vectors[i];
    float square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    if (square > farthest) farthest = square;
  }
  return farthest;
}

/* The least square of a cross product that needs no closer look: tangents are at most as long as the farthest
 * control point is far. */
static inline float least_stencil_square(const tw_stencil_job *job) {
  float farthest = farthest_square(job->controls, job->stencil->control_count);
  return tw_normal_least_square(10 * farthest * farthest);
}

static inline __attribute__((always_inline)) bool sum_lines(const tw_stencil_job *job, row_kind kind) {
  float least = kind.normals ? least_stencil_square(job) : 0, *out = kind.values ? job->values : job->normals;
  tw_mask sure = tw_first_mask();
  size_t begin = job->first;
  for (uint32_t line = 0; line < job->lines; line++, begin += job->apart, out += job->line_step)
    sum_line(job, kind, begin, least, out, &sure);
  return tw_all_set(sure);
}

static inline bool fill_stencil(const tw_stencil_job *job) {
  if (job->values && job->normals == job->values + 3 && job->width == 3)
    return sum_lines(job, (row_kind){3, true});
  if (job->values && job->width == 3)
    sum_lines(job, (row_kind){3, false});
  else if (job->values && job->width == 2)
    sum_lines(job, (row_kind){2, false});
  else if (job->values && job->width == 1)
    sum_lines(job, (row_kind){1, false});
  else if (job->values)
    sum_lines(job, (row_kind){4, false});
  return !job->normals || sum_lines(job, (row_kind){0, true});
}

#endif
