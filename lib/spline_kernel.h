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
#include <string.h>

#include "normal.h"
#include "spline_rows.h"

#ifdef __AVX__
enum { LANES = TW_SPLINE_LANES };
#else
enum { LANES = 4 };
#endif
enum { WIDTH_MAX = 4, DERIVATIVE_SECOND = 4 };

typedef float vector __attribute__((vector_size(4 * LANES)));
typedef int32_t mask __attribute__((vector_size(4 * LANES)));
typedef float four __attribute__((vector_size(16)));
typedef double two __attribute__((vector_size(16)));

/* One component of the points of a block. */
typedef float lane[LANES];

static inline vector load(const float *from) {
  vector value;
  memcpy(&value, from, sizeof value);
  return value;
}

static inline four load_four(const float *from) {
  four value;
  memcpy(&value, from, sizeof value);
  return value;
}

/* ---- weights -------------------------------------------------------------------------------- */

/* out[length] = four such lines weighted as at place j. Summed from both ends, so that a mirrored patch gives
 * mirrored points to the last bit. */
static inline __attribute__((always_inline)) void
weigh_four(const float *lines, size_t length, const float *const table[4], size_t j, float *out) {
  float w0 = table[0][j], w1 = table[1][j], w2 = table[2][j], w3 = table[3][j];
  for (size_t m = 0; m < length; m += 4) {
    four sum = (w0 * load_four(lines + m) + w3 * load_four(lines + 3 * length + m)) +
               (w1 * load_four(lines + length + m) + w2 * load_four(lines + 2 * length + m));
    memcpy(out + m, &sum, sizeof sum);
  }
}

static inline __attribute__((always_inline)) void
weigh_three(const float *lines, size_t length, const float *const table[3], size_t j, float *out) {
  float w0 = table[0][j], w1 = table[1][j], w2 = table[2][j];
  for (size_t m = 0; m < length; m += 4) {
    four sum = (w0 * load_four(lines + m) + w2 * load_four(lines + 2 * length + m)) +
               w1 * load_four(lines + length + m);
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

/* ---- rows ----------------------------------------------------------------------------------- */

static inline __attribute__((always_inline)) void put(float *out, four row) {
  memcpy(out, &row, sizeof row);
}

/* Half of a vector, as one number. */
static inline __attribute__((always_inline)) void put_half(float *out, four row, int half) {
  double pair = ((two)row)[half];
  memcpy(out, &pair, sizeof pair);
}

/* Four rows of three, next to each other. */
static inline __attribute__((always_inline)) void put_packed(float *out, four x, four y, four z) {
  four xxyy = __builtin_shufflevector(x, y, 0, 2, 4, 6), yyzz = __builtin_shufflevector(y, z, 1, 3, 5, 7),
       zzxx = __builtin_shufflevector(z, x, 0, 2, 5, 7);
  put(out, __builtin_shufflevector(xxyy, zzxx, 0, 2, 4, 6));
  put(out + 4, __builtin_shufflevector(yyzz, xxyy, 0, 2, 5, 7));
  put(out + 8, __builtin_shufflevector(zzxx, yyzz, 1, 3, 5, 7));
}

/* `width` components, 2 to 4, of four points; the first lie at components, the next `apart` farther. */
static inline __attribute__((always_inline)) void store_four_rows(const float *components, size_t apart,
                                                                  size_t width, float *out, ptrdiff_t step) {
  float *out1 = out + step, *out2 = out1 + step, *out3 = out2 + step;
  four x = load_four(components), y = load_four(components + apart);
  if (width == 3 && step == 3) {
    put_packed(out, x, y, load_four(components + 2 * apart));
    return;
  }
  four xy_low = __builtin_shufflevector(x, y, 0, 4, 1, 5),
       xy_high = __builtin_shufflevector(x, y, 2, 6, 3, 7);
  if (width == 4) {
    four z = load_four(components + 2 * apart), w = load_four(components + 3 * apart);
    four zw_low = __builtin_shufflevector(z, w, 0, 4, 1, 5),
         zw_high = __builtin_shufflevector(z, w, 2, 6, 3, 7);
    put(out, __builtin_shufflevector(xy_low, zw_low, 0, 1, 4, 5));
    put(out1, __builtin_shufflevector(xy_low, zw_low, 2, 3, 6, 7));
    put(out2, __builtin_shufflevector(xy_high, zw_high, 0, 1, 4, 5));
    put(out3, __builtin_shufflevector(xy_high, zw_high, 2, 3, 6, 7));
    return;
  }
  put_half(out, xy_low, 0);
  put_half(out1, xy_low, 1);
  put_half(out2, xy_high, 0);
  put_half(out3, xy_high, 1);
  if (width == 2) return;
  const float *z = components + 2 * apart;
  out[2] = z[0];
  out1[2] = z[1];
  out2[2] = z[2];
  out3[2] = z[3];
}

/* The same of the first `count` points. */
static inline __attribute__((always_inline)) void
store_rows(const float *components, size_t apart, size_t width, size_t count, float *out, ptrdiff_t step) {
  if (count == LANES) {
    for (size_t l = 0; l < LANES; l += 4, out += 4 * step)
      store_four_rows(components + l, apart, width, out, step);
    return;
  }
  if (count >= 4) { /* some of them once more */
    for (size_t l = 0; l + 4 < count; l += 4)
      store_four_rows(components + l, apart, width, out + (ptrdiff_t)l * step, step);
    size_t last = count - 4;
    store_four_rows(components + last, apart, width, out + (ptrdiff_t)last * step, step);
    return;
  }
  for (size_t l = 0; l < count; l++, out += step)
    for (size_t c = 0; c < width; c++) out[c] = components[c * apart + l];
}

/* ---- values --------------------------------------------------------------------------------- */

/* LANES points or what a line has left: the last block of a longer line takes in points of the one before. */
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
} kernel_job;

static inline __attribute__((always_inline)) kernel_job start(const tw_spline_job *job) {
  kernel_job k = {.job = *job, .spline = *job->spline};
  for (int w = 0; w < 4; w++) k.value[w] = job->limit ? k.spline.limit[w] : k.spline.point[w];
  k.blocks = (job->rect.i1 - job->rect.i0 + LANES) / LANES;
  return k;
}

static inline __attribute__((always_inline)) block block_at(const tw_spline_job *job, size_t n) {
  size_t points = job->rect.i1 - job->rect.i0 + 1, first = n * LANES;
  if (points < LANES) return (block){job->rect.i0, points, 0};
  if (first + LANES > points) first = points - LANES;
  return (block){job->rect.i0 + first, LANES, (ptrdiff_t)first};
}

static inline __attribute__((always_inline)) void value_lanes(const kernel_job *k,
                                                              const float (*columns)[WIDTH_MAX], size_t width,
                                                              size_t i, float *out, size_t apart) {
  for (size_t c = 0; c < width; c++) {
    vector value = k->job.origin[c] + across_four(columns, c, k->value, i);
    memcpy(out + c * apart, &value, sizeof value);
  }
}

static inline __attribute__((always_inline)) void fill_values(const tw_spline_job *job, size_t width) {
  const kernel_job k = start(job);
  float *line = k.job.values;
  for (size_t j = k.job.rect.j0; j <= k.job.rect.j1; j++, line += k.job.line_step) {
    float columns[4][WIDTH_MAX];
    weigh_four(k.job.points[0], 16, k.value, j, columns[0]);
    for (size_t n = 0; n < k.blocks; n++) {
      lane values[WIDTH_MAX];
      block b = block_at(&k.job, n);
      value_lanes(&k, (const float(*)[WIDTH_MAX])columns, width, b.i, values[0], LANES);
      store_rows(values[0], LANES, width, b.count, line + b.place * k.job.step, k.job.step);
    }
  }
}

/* ---- derivatives ---------------------------------------------------------------------------- */

/* Differences of neighbouring control points: along i in each of four lines, along j in three. */
typedef struct slopes {
  float along[4][3][WIDTH_MAX], across[3][4][WIDTH_MAX];
} slopes;

static inline void find_slopes(const float (*points)[WIDTH_MAX], slopes *out) {
  four at[16];
  memcpy(at, points, sizeof at);
  for (int r = 0; r < 4; r++)
    for (int k = 0; k < 3; k++) {
      four along = at[4 * r + k + 1] - at[4 * r + k], across = at[4 * k + r + 4] - at[4 * k + r];
      memcpy(out->along[r][k], &along, sizeof along);
      memcpy(out->across[k][r], &across, sizeof across);
    }
}

/* The slopes weighted down for one line. */
typedef struct line_slopes {
  float along[3][WIDTH_MAX], across[4][WIDTH_MAX];
} line_slopes;

static inline __attribute__((always_inline)) void weigh_slopes(const slopes *s, const tw_spline *spline,
                                                               size_t j, line_slopes *out) {
  weigh_four(s->along[0][0], sizeof out->along / sizeof(float), spline->limit, j, out->along[0]);
  weigh_three(s->across[0][0], sizeof out->across / sizeof(float), spline->slope, j, out->across[0]);
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
      lane tangents[2][WIDTH_MAX];
      block b = block_at(&k.job, n);
      for (size_t c = 0; c < width; c++) {
        vector tangent1 = tangent_along(&k.spline, &at_line, c, b.i),
               tangent2 = tangent_across(&k.spline, &at_line, c, b.i);
        memcpy(tangents[0][c], &tangent1, sizeof tangent1);
        memcpy(tangents[1][c], &tangent2, sizeof tangent2);
      }
      float *out = line + b.place * k.job.step;
      store_rows(tangents[0][0], LANES, width, b.count, out + along, k.job.step);
      store_rows(tangents[1][0], LANES, width, b.count, out + DERIVATIVE_SECOND - along, k.job.step);
    }
  }
}

/* ---- normals -------------------------------------------------------------------------------- */

static inline float greatest_square(const float (*vectors)[WIDTH_MAX], size_t count) {
  float greatest = 0;
  for (size_t i = 0; i < count; i++) {
    const float *v = vectors[i];
    float square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    if (square > greatest) greatest = square;
  }
  return greatest;
}

/* The least square of a cross product of the patch that needs no closer look. */
static inline float least_square(const slopes *s) {
  /* Tangents are convex combinations of slopes. */
  return tw_normal_least_square(greatest_square((const float(*)[WIDTH_MAX])s->along[0], 12) *
                                greatest_square((const float(*)[WIDTH_MAX])s->across[0], 12));
}

static inline vector root(vector square) {
  vector out;
  for (int l = 0; l < LANES; l++) out[l] = sqrtf(square[l]);
  return out;
}

/* Blocks of normals on their way: roots and quotients take long, so that many of them have to overlap. */
enum { BATCH = 128 };

typedef struct slot {
  float *out; /* row of its first point */
  size_t i, j, count;
} slot;

typedef struct batch {
  float at[6][BATCH]; /* positions where they are wanted, then cross products */
  float square[BATCH];
  slot slots[BATCH / LANES];
  size_t count;
} batch;

/* Cross products of the tangents from place i on, and their squares. */
static inline __attribute__((always_inline)) void cross_lanes(const tw_spline *spline, const line_slopes *s,
                                                              size_t i, float *out, size_t apart,
                                                              float *squares) {
  vector a[3], b[3];
  for (size_t c = 0; c < 3; c++) {
    a[c] = tangent_along(spline, s, c, i);
    b[c] = tangent_across(spline, s, c, i);
  }
  vector x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
  vector square = x * x + y * y + z * z;
  memcpy(out, &x, sizeof x);
  memcpy(out + apart, &y, sizeof y);
  memcpy(out + 2 * apart, &z, sizeof z);
  memcpy(squares, &square, sizeof square);
}

static inline bool all_set(const mask *m) {
  int32_t all = -1;
  for (int l = 0; l < LANES; l++) all &= (*m)[l];
  return all != 0;
}

static inline mask first_mask(void) {
  mask m;
  for (int l = 0; l < LANES; l++) m[l] = -1;
  return m;
}

/* Whether no point needs a closer look. */
static inline __attribute__((always_inline)) bool normalise(batch *b, float (*cross)[BATCH], bool transposed,
                                                            float least) {
  mask sure = first_mask();
  for (size_t l = 0; l < b->count * LANES; l += LANES) {
    vector square = load(b->square + l), scale = (transposed ? -1.0f : 1.0f) / root(square);
    sure &= (square > least) & (square < TW_NORMAL_SQUARE_MAX);
    for (size_t c = 0; c < 3; c++) {
      vector normal = load(cross[c] + l) * scale;
      memcpy(cross[c] + l, &normal, sizeof normal);
    }
  }
  return all_set(&sure);
}

/* Writes the rows of a batch, which is empty then. positions: they come before the normals. */
static inline __attribute__((always_inline)) void flush(batch *b, const tw_spline_job *job, bool positions,
                                                        bool transposed, float least) {
  float(*cross)[BATCH] = b->at + (positions ? 3 : 0);
  bool sure = normalise(b, cross, transposed, least);
  for (size_t n = 0; n < b->count; n++) {
    const slot *s = &b->slots[n];
    size_t l = n * LANES;
    store_rows(b->at[0] + l, BATCH, positions ? 4 : 3, s->count, s->out, job->step);
    if (positions) store_rows(b->at[4] + l, BATCH, 2, s->count, s->out + 4, job->step);
  }
  for (size_t n = 0; n < b->count && !sure; n++) {
    const slot *s = &b->slots[n];
    tw_spline_look_closer(job, s->i, s->count, s->j, transposed, s->out + (positions ? 3 : 0));
  }
  b->count = 0;
}

/* positions: the values as well, which are those of points, and the normals stand next to them. */
static inline __attribute__((always_inline)) void fill_normals(const tw_spline_job *job, bool positions,
                                                               bool transposed) {
  const kernel_job k = start(job);
  slopes slopes;
  find_slopes(k.job.points, &slopes);
  float least = least_square(&slopes), *line = positions ? k.job.values : k.job.normals;
  batch batch;
  batch.count = 0;
  for (size_t j = k.job.rect.j0; j <= k.job.rect.j1; j++, line += k.job.line_step) {
    float columns[4][WIDTH_MAX];
    line_slopes at_line;
    if (positions) weigh_four(k.job.points[0], 16, k.value, j, columns[0]);
    weigh_slopes(&slopes, &k.spline, j, &at_line);
    for (size_t n = 0; n < k.blocks; n++) {
      block b = block_at(&k.job, n);
      size_t l = batch.count * LANES;
      batch.slots[batch.count++] = (slot){line + b.place * k.job.step, b.i, j, b.count};
      if (positions) value_lanes(&k, (const float(*)[WIDTH_MAX])columns, 3, b.i, batch.at[0] + l, BATCH);
      cross_lanes(&k.spline, &at_line, b.i, batch.at[positions ? 3 : 0] + l, BATCH, batch.square + l);
      if (batch.count == BATCH / LANES) flush(&batch, &k.job, positions, transposed, least);
    }
  }
  flush(&batch, &k.job, positions, transposed, least);
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
