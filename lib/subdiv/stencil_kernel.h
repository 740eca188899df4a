/* Sums of stencils, a few points at a time, in vectors as wide as the compiler may use: each file that
 * includes this is compiled for another instruction set. Every point is summed in the same order wherever it
 * lies in a vector and whatever else is asked for, so that all instruction sets give the same bytes. */
#ifndef TWEEND_STENCIL_KERNEL_H
#define TWEEND_STENCIL_KERNEL_H

#include "stencil.h"
#include "unit_normals.h"

enum { BLOCK = TW_STENCIL_BLOCK };

/* ---- sums ----------------------------------------------------------------------------------- */

/* Held in a register: from memory that might change, it cannot be loaded again for each of its uses, which
 * would take twice as long as all else. */
static inline __attribute__((always_inline)) vector load_once(const float *from) {
  vector held = load(from);
  __asm__ volatile("" ::: "memory");
  return held;
}

/* One number in all lanes; what is subtracted leaves it as it is, and costs nothing. */
static inline __attribute__((always_inline)) vector spread(float number) {
  return number - (vector){0};
}

/* Where the weights of the points from `place` on begin, of which every point has `width`. */
static inline const float *weights_at(const tw_stencil *stencil, const float *weights, size_t place,
                                      size_t width) {
  return weights + place / BLOCK * stencil->control_count * width * BLOCK + place % BLOCK;
}

/* `width` components of the points from `place` on: even and odd controls apart, which halves the time that a
 * sum waits for itself. */
static inline __attribute__((always_inline)) void sum_values(const tw_stencil_job *job, size_t place,
                                                             size_t width, vector out[WIDTH_MAX]) {
  const float *weights = weights_at(job->stencil, job->stencil->values, place, 1);
  const float(*controls)[WIDTH_MAX] = job->controls;
  const size_t count = job->stencil->control_count;
  vector even[WIDTH_MAX] = {{0}}, odd[WIDTH_MAX] = {{0}};
  for (size_t k = 0; k < count; k += 2, weights += 2 * (size_t)BLOCK) {
    vector one = load_once(weights), other = load_once(weights + BLOCK);
    for (size_t c = 0; c < width; c++) {
      even[c] += one * controls[k][c];
      odd[c] += other * controls[k + 1][c];
    }
  }
  for (size_t c = 0; c < width; c++) out[c] = job->origin[c] + (even[c] + odd[c]);
}

static inline __attribute__((always_inline)) void sum_tangents(const tw_stencil_job *job, size_t place,
                                                               vector out[2][3]) {
  const float *weights = weights_at(job->stencil, job->stencil->tangents, place, 2);
  const float(*controls)[WIDTH_MAX] = job->controls;
  const size_t count = job->stencil->control_count;
  vector a[3] = {{0}}, b[3] = {{0}};
  for (size_t k = 0; k < count; k++, weights += 2 * (size_t)BLOCK) {
    vector one = load_once(weights), other = load_once(weights + BLOCK);
    for (size_t c = 0; c < 3; c++) {
      a[c] += one * controls[k][c];
      b[c] += other * controls[k][c];
    }
  }
  memcpy(out[0], a, sizeof a);
  memcpy(out[1], b, sizeof b);
}

/* All sums that one control point takes part in. */
static inline __attribute__((always_inline)) void add_control(const float control[WIDTH_MAX],
                                                              const float *value, const float *tangents,
                                                              vector sums[3], vector a[3], vector b[3]) {
  vector weight = load_once(value), one = load_once(tangents), other = load_once(tangents + BLOCK);
  for (size_t c = 0; c < 3; c++) {
    vector component = spread(control[c]);
    sums[c] += weight * component;
    a[c] += one * component;
    b[c] += other * component;
  }
}

/* Values and tangents at once, where there are registers for all their sums: control points are loaded but
 * once. */
static inline __attribute__((always_inline)) void sum_all(const tw_stencil_job *job, size_t place,
                                                          vector values[3], vector tangents[2][3]) {
  const float *value = weights_at(job->stencil, job->stencil->values, place, 1),
              *tangent = weights_at(job->stencil, job->stencil->tangents, place, 2);
  const float(*controls)[WIDTH_MAX] = job->controls;
  const size_t count = job->stencil->control_count;
  vector even[3] = {{0}}, odd[3] = {{0}}, a[3] = {{0}}, b[3] = {{0}};
  for (size_t k = 0; k < count; k += 2, value += 2 * (size_t)BLOCK, tangent += 4 * (size_t)BLOCK) {
    add_control(controls[k], value, tangent, even, a, b);
    add_control(controls[k + 1], value + BLOCK, tangent + 2 * (size_t)BLOCK, odd, a, b);
  }
  for (size_t c = 0; c < 3; c++) values[c] = job->origin[c] + (even[c] + odd[c]);
  memcpy(tangents[0], a, sizeof a);
  memcpy(tangents[1], b, sizeof b);
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
static inline __attribute__((always_inline)) void
sum_rows(const tw_stencil_job *job, row_kind kind, size_t place, float least, vector *rows, mask *sure) {
  enum { REGISTERS_SUFFICE = LANES == 16 };
  vector tangents[2][3];
  bool together = REGISTERS_SUFFICE && kind.values == 3 && kind.normals;
  if (together) sum_all(job, place, rows, tangents);
  if (kind.values && !together) sum_values(job, place, kind.values, rows);
  if (kind.normals && !together) sum_tangents(job, place, tangents);
  if (kind.normals)
    unit_normals(tangents[0], tangents[1], spread(least), spread(1), rows + kind.values, sure);
}

static inline size_t lesser(size_t a, size_t b) {
  return a < b ? a : b;
}

/* Lanes from `count` on, whose weights are not those of a point of the line: they are not looked at, as they
 * are others on another machine. */
static inline mask lanes_from(size_t count) {
  mask lane;
  for (int32_t l = 0; l < LANES; l++) lane[l] = l;
  return lane >= (int32_t)count;
}

static inline __attribute__((always_inline)) void
sum_line(const tw_stencil_job *job, row_kind kind, size_t begin, float least, float *out, mask *sure) {
  size_t end = begin + job->count, count;
  for (size_t place = begin; place < end; place += count, out += (ptrdiff_t)count * job->step) {
    vector rows[ROW_MAX];
    mask fits = first_mask();
    count = lesser(lesser(end - place, LANES), BLOCK - place % BLOCK);
    sum_rows(job, kind, place, least, rows, &fits);
    *sure &= count < LANES ? fits | lanes_from(count) : fits;
    store_rows(rows, width_of(kind), count, out, job->step);
  }
}

static inline float farthest_square(const float (*vectors)[WIDTH_MAX], size_t count) {
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
  mask sure = first_mask();
  size_t begin = job->first;
  for (uint32_t line = 0; line < job->lines; line++, begin += job->apart, out += job->line_step)
    sum_line(job, kind, begin, least, out, &sure);
  return all_set(sure);
}

static inline bool fill_stencil(const tw_stencil_job *job) {
  if (job->values && job->normals == job->values + 3 && job->width == 3)
    return sum_lines(job, (row_kind){3, true});
  if (job->values && job->width == 3)
    sum_lines(job, (row_kind){3, false});
  else if (job->values && job->width == 2)
    sum_lines(job, (row_kind){2, false});
  else if (job->values)
    sum_lines(job, (row_kind){4, false});
  return !job->normals || sum_lines(job, (row_kind){0, true});
}

#endif
