/* Sums of stencils, a few points at a time, in vectors as wide as the compiler may use: each file that
 * includes this is compiled for another instruction set. Every point is summed in the same order wherever it
 * lies in a vector and whatever else is asked for, so that all instruction sets give the same bytes. */
#ifndef TWEEND_STENCIL_KERNEL_H
#define TWEEND_STENCIL_KERNEL_H

#include "stencil.h"
#include "unit_normals.h"

/* Held in a register: from memory that might change, it cannot be loaded again for each of its uses, which
 * would take twice as long as all else. */
static inline __attribute__((always_inline)) vector load_once(const float *from) {
  vector held = load(from);
  __asm__ volatile("" ::: "memory");
  return held;
}

/* `width` components of the points from `weights` on: even and odd controls apart, which halves the time that
 * a sum waits for itself. */
static inline __attribute__((always_inline)) void sum_values(const tw_stencil_job *job, const float *weights,
                                                             size_t width, vector out[WIDTH_MAX]) {
  size_t apart = job->stencil->apart, count = job->stencil->control_count;
  vector even[WIDTH_MAX] = {{0}}, odd[WIDTH_MAX] = {{0}};
  for (size_t k = 0; k < count; k += 2) {
    vector one = load_once(weights + k * apart), other = load_once(weights + (k + 1) * apart);
    for (size_t c = 0; c < width; c++) {
      even[c] += one * job->controls[k][c];
      odd[c] += other * job->controls[k + 1][c];
    }
  }
  for (size_t c = 0; c < width; c++) out[c] = job->origin[c] + (even[c] + odd[c]);
}

static inline __attribute__((always_inline)) size_t count_at(const tw_stencil_job *job, size_t place) {
  size_t left = job->count - place;
  return left < LANES ? left : LANES;
}

static inline __attribute__((always_inline)) void stencil_values(const tw_stencil_job *from, size_t width) {
  const tw_stencil_job job = *from; /* which no row that is stored can be taken to change */
  float *out = job.values;
  for (size_t place = 0; place < job.count; place += LANES, out += LANES * job.step) {
    vector sums[WIDTH_MAX];
    sum_values(&job, job.stencil->values + job.first + place, width, sums);
    store_rows(sums, width, count_at(&job, place), out, job.step);
  }
}

/* ---- normals -------------------------------------------------------------------------------- */

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

static inline __attribute__((always_inline)) void sum_tangents(const tw_stencil_job *job, size_t place,
                                                               vector out[2][3]) {
  size_t apart = job->stencil->apart, count = job->stencil->control_count;
  const float *first = job->stencil->tangents[0] + place, *second = job->stencil->tangents[1] + place;
  vector a[3] = {{0}}, b[3] = {{0}};
  for (size_t k = 0; k < count; k++) {
    vector one = load_once(first + k * apart), other = load_once(second + k * apart);
    for (size_t c = 0; c < 3; c++) {
      a[c] += one * job->controls[k][c];
      b[c] += other * job->controls[k][c];
    }
  }
  memcpy(out[0], a, sizeof a);
  memcpy(out[1], b, sizeof b);
}

/* Those of the points from `place` on; sure: which of all so far need no closer look, be that those beyond
 * the last point. */
static inline __attribute__((always_inline)) void normal_sums(const tw_stencil_job *job, size_t place,
                                                              float least, vector *out, mask *sure) {
  vector tangents[2][3], zero = {0};
  mask fits = first_mask();
  sum_tangents(job, job->first + place, tangents);
  unit_normals(tangents[0], tangents[1], zero + least, zero + 1.0f, out, &fits);
  for (size_t l = count_at(job, place); l < LANES; l++) fits[l] = -1;
  *sure &= fits;
}

/* positions: the values as well, and the normals stand next to them. */
static inline __attribute__((always_inline)) bool stencil_normals(const tw_stencil_job *from,
                                                                  bool positions) {
  const tw_stencil_job job = *from;
  const size_t before = positions ? 3 : 0;
  float least = least_stencil_square(&job), *out = positions ? job.values : job.normals;
  mask sure = first_mask();
  for (size_t place = 0; place < job.count; place += LANES, out += LANES * job.step) {
    vector rows[ROW_MAX];
    if (positions) sum_values(&job, job.stencil->values + job.first + place, 3, rows);
    normal_sums(&job, place, least, rows + before, &sure);
    store_rows(rows, before + 3, count_at(&job, place), out, job.step);
  }
  return all_set(sure);
}

static inline bool fill_stencil(const tw_stencil_job *job) {
  if (job->values && job->normals == job->values + 3 && job->width == 3) return stencil_normals(job, true);
  if (job->values && job->width == 3)
    stencil_values(job, 3);
  else if (job->values && job->width == 2)
    stencil_values(job, 2);
  else if (job->values)
    stencil_values(job, 4);
  return !job->normals || stencil_normals(job, false);
}

#endif
