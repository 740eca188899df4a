/* Regular triangles: Loop's steps on an array, as all points have valence 6. Each step makes what the next
 * one reads, one row of points around the part that is wanted. */
#include "loop_lattice.h"

#include <string.h>

#include "loop_rows.h"

void tw_lattice_child(uint32_t depth, uint32_t child, uint32_t corners[3][2]) {
  uint32_t at[3][2] = {{0, 0}, {1, 0}, {0, 1}}, out[3][2];
  for (uint32_t level = depth; level-- > 0;) {
    uint32_t which = child >> 2 * level & 3;
    for (uint32_t k = 0; k < 3; k++) {
      /* The middle's corner k is opposite to child k; other children have middles of the sides at `which`. */
      uint32_t a = which == 3 ? (k + 1) % 3 : which, b = which == 3 ? (k + 2) % 3 : k;
      for (int c = 0; c < 2; c++) out[k][c] = at[a][c] + at[b][c];
    }
    memcpy(at, out, sizeof at);
  }
  memcpy(corners, at, sizeof at);
}

/* ---- the points around a triangle ----------------------------------------------------------- */

static bool is_regular_vertex(const tw_topology *t, uint32_t vertex) {
  uint32_t ring = t->ring_offsets[vertex];
  if (t->ring_offsets[vertex + 1] - ring != 6 || t->vertex_flags[vertex]) return false;
  if (t->vertex_sharpness[vertex] > 0) return false;
  for (uint32_t i = ring; i < ring + 6; i++)
    if (t->edge_sharpness[t->ring_edges[i]] > 0) return false;
  return true;
}

bool tw_lattice_is_regular(const tw_topology *topology, uint32_t face) {
  for (uint32_t c = 3 * face; c < 3 * face + 3; c++)
    if (!is_regular_vertex(topology, topology->corner_vertex[c])) return false;
  return true;
}

/* From a point to its six neighbours, counter-clockwise. */
static const int32_t around[6][2] = {{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}};

static size_t place_of(uint32_t stride, int32_t i, int32_t j) {
  return (size_t)(j + 1) * stride + (size_t)(i + 1);
}

static void put_vertex(const tw_lattice_source *source, uint32_t vertex, double *out) {
  size_t width = source->width, first = vertex * width;
  for (size_t k = 0; k < width; k++)
    out[k] = source->exact ? source->exact[first + k] : (double)source->rounded[first + k];
}

/* Puts a corner's vertex at (i, j), and its ring around it. first: the direction of the corner's own edge. */
static void put_ring(const tw_lattice_source *source, uint32_t corner, const int32_t at[2], uint32_t first,
                     uint32_t stride, double *out) {
  const tw_topology *t = source->topology;
  uint32_t vertex = t->corner_vertex[corner], place = 0;
  const uint32_t *fan = t->fan_corners + t->fan_offsets[vertex],
                 *ring = t->ring_edges + t->ring_offsets[vertex];
  while (fan[place] != corner) place++;
  put_vertex(source, vertex, out + source->width * place_of(stride, at[0], at[1]));
  for (uint32_t k = 0; k < 6; k++) {
    const int32_t *to = around[(first + k) % 6];
    uint32_t end = tw_far_end(t, ring[(place + k) % 6], vertex);
    put_vertex(source, end, out + source->width * place_of(stride, at[0] + to[0], at[1] + to[1]));
  }
}

/* ---- steps ---------------------------------------------------------------------------------- */

static int32_t at_most(int32_t a, int32_t b) {
  return a < b ? a : b;
}
static int32_t at_least(int32_t a, int32_t b) {
  return a > b ? a : b;
}

/* The points of the level above that a range of points is made from. */
static int32_t range_start(int32_t start) {
  return at_least(start % 2 == 0 ? start / 2 - 1 : (start - 1) / 2, -1);
}
static int32_t range_end(int32_t end, int32_t side) {
  return at_most(end % 2 == 0 ? end / 2 + 1 : (end + 1) / 2, side + 1);
}

/* Writes a point of the next level; in: where the level has the point at half of its coordinates, rounded
 * down. odd: 1 where i is odd, + 2 where j is. */
static inline __attribute__((always_inline)) void step_point(const double *in, uint32_t odd, size_t width,
                                                             size_t line, double *out) {
  /* The two ends of an edge, and the points across it. */
  const double *a = in, *b = in + width, *c = in + line, *d = in + width - line;
  if (odd == 0) {
    for (size_t k = 0; k < width; k++) {
      const double *p = in + k;
      double ring = (p[width] - *p) + (p[line] - *p) + (*(p + line - width) - *p) + (*(p - width) - *p) +
                    (*(p - line) - *p) + (*(p - line + width) - *p);
      out[k] = *p + 0.0625 * ring;
    }
    return;
  }
  if (odd == 2) {
    b = in + line;
    c = in + width;
    d = in + line - width;
  } else if (odd == 3) {
    a = in + line;
    c = in;
    d = in + line + width;
  }
  for (size_t k = 0; k < width; k++)
    out[k] = a[k] + 0.375 * (b[k] - a[k]) + 0.125 * ((c[k] - a[k]) + (d[k] - a[k]));
}

/* Makes the points of `rect` of a lattice, and those beside the triangle that lie in it, from the level
 * above. side: of the new level. */
static inline __attribute__((always_inline)) void step_rect(const double *in, size_t width, uint32_t stride,
                                                            int32_t side, tw_lattice_rect rect, double *out) {
  for (int32_t j = rect.j0; j <= rect.j1; j++) {
    int32_t end = at_most(rect.i1, side + 1 - j);
    for (int32_t i = at_least(rect.i0, -1 - j); i <= end; i++) {
      uint32_t odd = (uint32_t)(i & 1) + 2 * (uint32_t)(j & 1);
      const double *from = in + width * place_of(stride, (i - (i & 1)) / 2, (j - (j & 1)) / 2);
      step_point(from, odd, width, width * stride, out + width * place_of(stride, i, j));
    }
  }
}

static void step(const double *in, size_t width, uint32_t stride, int32_t side, tw_lattice_rect rect,
                 double *out) {
  if (width == 3) /* points; a known width lets the compiler unroll */
    step_rect(in, 3, stride, side, rect, out);
  else
    step_rect(in, width, stride, side, rect, out);
}

enum { WIDTH_MAX = 4 };

static uint32_t stride_of(uint32_t depth) {
  return (1u << depth) + 4;
}

size_t tw_lattice_scratch(uint32_t depth) {
  size_t stride = stride_of(depth);
  return stride * stride * 2 * WIDTH_MAX;
}

tw_lattice tw_lattice_refine(const tw_lattice_source *source, uint32_t corner, uint32_t depth,
                             tw_lattice_rect rect, double *scratch) {
  static const int32_t corners[3][2] = {{0, 0}, {1, 0}, {0, 1}};
  uint32_t stride = stride_of(depth), at = corner;
  double *in = scratch, *out = scratch + tw_lattice_scratch(depth) / 2;
  tw_lattice_rect rects[TW_LATTICE_DEPTH_MAX + 1];
  rects[depth] = (tw_lattice_rect){rect.i0 - 1, rect.i1 + 1, rect.j0 - 1, rect.j1 + 1};
  for (uint32_t level = depth; level-- > 1;) {
    const tw_lattice_rect *below = &rects[level + 1];
    int32_t side = 1 << level;
    rects[level] = (tw_lattice_rect){range_start(below->i0), range_end(below->i1, side),
                                     range_start(below->j0), range_end(below->j1, side)};
  }
  for (uint32_t k = 0; k < 3; k++, at = tw_triangle_next(at))
    put_ring(source, at, corners[k], 2 * k, stride, in);
  for (uint32_t level = 1; level <= depth; level++) {
    step(in, source->width, stride, 1 << level, rects[level], out);
    double *swap = in;
    in = out;
    out = swap;
  }
  return (tw_lattice){in, stride, source->width};
}

/* ---- rows ----------------------------------------------------------------------------------- */

static const double *value_at(const tw_lattice *l, uint32_t i, uint32_t j, const double *ring[6]) {
  for (int k = 0; k < 6; k++)
    ring[k] =
        l->values + l->width * place_of(l->stride, (int32_t)i + around[k][0], (int32_t)j + around[k][1]);
  return l->values + l->width * place_of(l->stride, (int32_t)i, (int32_t)j);
}

void tw_lattice_value(const tw_lattice *lattice, uint32_t i, uint32_t j, bool limit, float *out) {
  const double *ring[6], *own = value_at(lattice, i, j, ring);
  for (uint32_t c = 0; c < lattice->width; c++) {
    double sum = 0;
    for (int k = 0; limit && k < 6; k++) sum += ring[k][c] - own[c];
    out[c] = (float)(limit ? own[c] + sum / 12 : own[c]);
  }
}

void tw_lattice_normal(const tw_lattice *lattice, uint32_t i, uint32_t j, float *out) {
  const double *ring[6], *own = value_at(lattice, i, j, ring);
  tw_loop_regular_normal(own, ring, out);
}

void tw_lattice_linear(const tw_lattice_source *source, uint32_t corner, uint32_t side, uint32_t i,
                       uint32_t j, float *out) {
  const uint32_t *vertices = source->topology->corner_vertex;
  double at[3][WIDTH_MAX];
  uint32_t next = tw_triangle_next(corner);
  put_vertex(source, vertices[corner], at[0]);
  put_vertex(source, vertices[next], at[1]);
  put_vertex(source, vertices[tw_triangle_next(next)], at[2]);
  for (uint32_t c = 0; c < source->width; c++)
    out[c] = (float)(at[0][c] + (i * (at[1][c] - at[0][c]) + j * (at[2][c] - at[0][c])) / side);
}
