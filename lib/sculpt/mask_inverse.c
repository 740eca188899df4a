/* Conjugate gradients on the normal equations of a step (CGLS; Hestenes and Stiefel 1952, section 10). */
#include "mask_inverse.h"

#include <math.h>
#include <string.h>

#include "refine.h"

enum { ROUNDS_MAX = 500 };

/* Rounds end when the gradient's length is this share of its first length: double has 16 digits, the input
 * 7. */
static const double ENOUGH = 1e-10;

/* The step as a matrix from the parent's vertices to the child's. Rows of edges and vertices also take shares
 * of face points, which are rows themselves: so the rows of face points are evaluated first. */
typedef struct inverse_job {
  const tw_topology *parent;
  uint32_t rows, faces; /* the child's vertices; the first of them that is a face point, or `rows` */
  uint32_t width;
  uint32_t *offsets; /* [rows + 1] */
  tw_share *shares;
} inverse_job;

static tw_status read_masks(inverse_job *s, const tw_rules *rules, tw_arena *arena) {
  const tw_topology *p = s->parent;
  s->faces = p->vertex_count + p->edge_count;
  s->rows = s->faces + tw_refine_face_points(p, rules);
  /* Number of shares: a vertex takes itself, its edges and faces; an edge its ends, and its faces or the
   * corners opposite to it; a face point its corners. tw_refine_mask may write the last mask beyond what it
   * returns, so there is room for one more. */
  uint64_t room = (uint64_t)p->vertex_count + 6 * (uint64_t)p->edge_count + 3 * (uint64_t)p->corner_count +
                  tw_refine_mask_capacity(p);
  if (room > UINT32_MAX) return TW_LIMIT;
  s->offsets = tw_arena_alloc_raw(arena, (size_t)s->rows + 1, sizeof *s->offsets);
  s->shares = tw_arena_alloc_raw(arena, room, sizeof *s->shares);
  if (!s->offsets || !s->shares) return TW_NO_MEMORY;
  uint32_t used = 0;
  for (uint32_t row = 0; row < s->rows; row++) {
    s->offsets[row] = used;
    used += tw_refine_mask(p, rules, row, s->shares + used);
  }
  s->offsets[s->rows] = used;
  return TW_OK;
}

/* ---- the matrix and its transpose ------------------------------------------------------------ */

static void apply_rows(const inverse_job *s, uint32_t first, uint32_t end, const double *in, double *out) {
  for (uint32_t row = first; row < end; row++) {
    double *sum = out + (size_t)row * s->width;
    memset(sum, 0, s->width * sizeof *sum);
    for (uint32_t i = s->offsets[row]; i < s->offsets[row + 1]; i++) {
      uint32_t vertex = s->shares[i].vertex;
      const double *value = (vertex < s->parent->vertex_count ? in : out) + (size_t)vertex * s->width;
      for (uint32_t c = 0; c < s->width; c++) sum[c] += (double)s->shares[i].weight * value[c];
    }
  }
}

/* in: [parent vertices][width], out: [rows][width]. */
static void apply(const inverse_job *s, const double *in, double *out) {
  apply_rows(s, s->faces, s->rows, in, out);
  apply_rows(s, 0, s->faces, in, out);
}

static void transpose_rows(const inverse_job *s, uint32_t first, uint32_t end, double *in, double *out) {
  for (uint32_t row = first; row < end; row++)
    for (uint32_t i = s->offsets[row]; i < s->offsets[row + 1]; i++) {
      uint32_t vertex = s->shares[i].vertex;
      double *sum = (vertex < s->parent->vertex_count ? out : in) + (size_t)vertex * s->width;
      for (uint32_t c = 0; c < s->width; c++)
        sum[c] += (double)s->shares[i].weight * in[(size_t)row * s->width + c];
    }
}

/* in: [rows][width], which it changes; out: [parent vertices][width]. */
static void transpose(const inverse_job *s, double *in, double *out) {
  memset(out, 0, (size_t)s->parent->vertex_count * s->width * sizeof *out);
  transpose_rows(s, 0, s->faces, in, out);
  transpose_rows(s, s->faces, s->rows, in, out);
}

/* ---- conjugate gradients --------------------------------------------------------------------- */

static double square(const double *values, size_t count) {
  double sum = 0;
  for (size_t i = 0; i < count; i++) sum += values[i] * values[i];
  return sum;
}

static void add(double *to, double factor, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) to[i] += factor * values[i];
}

typedef struct vectors {
  double *answer, *gradient, *direction; /* [parent vertices][width] */
  double *residual, *image, *scratch;    /* [rows][width]: the residual, the direction's image, scratch */
} vectors;

static tw_status descend(const inverse_job *s, const tw_parallel_for *parallel, const vectors *v) {
  size_t columns = (size_t)s->parent->vertex_count * s->width, rows = (size_t)s->rows * s->width;
  memcpy(v->scratch, v->residual, rows * sizeof *v->scratch);
  transpose(s, v->scratch, v->gradient);
  memcpy(v->direction, v->gradient, columns * sizeof *v->direction);
  double size = square(v->gradient, columns), enough = size * ENOUGH * ENOUGH;
  for (uint32_t round = 0; round < ROUNDS_MAX && size > enough; round++) {
    tw_status status = tw_parallel_for_status(parallel);
    if (status != TW_OK) return status;
    apply(s, v->direction, v->image);
    double length = size / square(v->image, rows);
    if (!isfinite(length)) break; /* the step maps the direction to 0 */
    add(v->answer, length, v->direction, columns);
    add(v->residual, -length, v->image, rows);
    memcpy(v->scratch, v->residual, rows * sizeof *v->scratch);
    transpose(s, v->scratch, v->gradient);
    double next = square(v->gradient, columns), share = next / size;
    for (size_t i = 0; i < columns; i++) v->direction[i] = v->gradient[i] + share * v->direction[i];
    size = next;
  }
  return TW_OK;
}

/* Masks sum to 1, so a step commutes with translation. The mean is subtracted before solving: the solution of
 * least norm is then the one nearest to the mean. */
static void take_mean(const inverse_job *s, const double *values, double mean[4]) {
  memset(mean, 0, 4 * sizeof *mean);
  for (uint32_t row = 0; row < s->rows; row++)
    for (uint32_t c = 0; c < s->width; c++) mean[c] += values[(size_t)row * s->width + c] / s->rows;
}

static double greatest_distance(const inverse_job *s, const double *residual) {
  double greatest = 0;
  for (uint32_t row = 0; row < s->rows; row++)
    greatest = fmax(greatest, square(residual + (size_t)row * s->width, s->width));
  return sqrt(greatest);
}

tw_status tw_invert_masks(const tw_topology *parent, const tw_rules *rules, uint32_t width,
                          const double *child, const tw_parallel_for *parallel, double *out, double *error) {
  tw_arena *arena = tw_arena_create();
  if (!arena) return TW_NO_MEMORY;
  inverse_job s = {.parent = parent, .width = width};
  tw_status status = read_masks(&s, rules, arena);
  size_t columns = (size_t)parent->vertex_count * width, rows = (size_t)s.rows * width;
  vectors v = {.answer = out};
  if (status == TW_OK) {
    v.gradient = tw_arena_alloc_raw(arena, columns, sizeof(double));
    v.direction = tw_arena_alloc_raw(arena, columns, sizeof(double));
    v.residual = tw_arena_alloc_raw(arena, rows, sizeof(double));
    v.image = tw_arena_alloc_raw(arena, rows, sizeof(double));
    v.scratch = tw_arena_alloc_raw(arena, rows, sizeof(double));
    if (!v.gradient || !v.direction || !v.residual || !v.image || !v.scratch) status = TW_NO_MEMORY;
  }
  if (status == TW_OK) {
    double mean[4];
    take_mean(&s, child, mean);
    for (size_t i = 0; i < rows; i++) v.residual[i] = child[i] - mean[i % width];
    memset(out, 0, columns * sizeof *out);
    status = descend(&s, parallel, &v);
    for (size_t i = 0; i < columns; i++) out[i] += mean[i % width];
    *error = greatest_distance(&s, v.residual);
  }
  tw_arena_destroy(arena);
  return status;
}
