/* Loop's subdivision step. */
#include "loop.h"

#include <math.h>
#include <string.h>

#include "child.h"
#include "loop.h"

/* ---- topology ------------------------------------------------------------------------------- */

static tw_status count_child(const tw_topology *p, tw_topology *child) {
  memset(child, 0, sizeof *child);
  uint64_t vertices = (uint64_t)p->vertex_count + p->edge_count;
  uint64_t edges = 2 * (uint64_t)p->edge_count + p->corner_count;
  uint64_t faces = 4 * (uint64_t)p->face_count, corners = 3 * faces;
  if (vertices >= UINT32_MAX || edges >= UINT32_MAX || corners >= UINT32_MAX) return TW_LIMIT;
  child->vertex_count = (uint32_t)vertices;
  child->edge_count = (uint32_t)edges;
  child->face_count = (uint32_t)faces;
  child->face_size = 3;
  child->corner_count = (uint32_t)corners;
  return TW_OK;
}

/* The corner of the middle child that lies on the edge of corner c. */
static uint32_t middle_corner(uint32_t c) {
  return 9 * (c / 3 + 1) + tw_triangle_previous(c);
}

/* Vertices of the four children of one face. */
static void split_corners(const tw_topology *p, uint32_t face, tw_topology *child) {
  uint32_t middles[3], *corners = child->corner_vertex + 12 * (size_t)face;
  for (uint32_t i = 0; i < 3; i++) middles[i] = p->vertex_count + p->corner_edge[3 * face + i];
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t next = (i + 1) % 3, previous = (i + 2) % 3;
    corners[3 * i + i] = p->corner_vertex[3 * face + i];
    corners[3 * i + next] = middles[i];
    corners[3 * i + previous] = middles[previous];
    corners[9 + i] = middles[next];
  }
}

/* Edges and inner siblings of the four children of one face. */
static void split_face(const tw_topology *p, uint32_t face, tw_topology *child) {
  uint32_t begin = 3 * face, first = 12 * face, E = p->edge_count;
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t next = (i + 1) % 3, previous = (i + 2) % 3;
    uint32_t c = begin + i, vertex = p->corner_vertex[c], edge = p->corner_edge[c],
             before = p->corner_edge[begin + previous], across = 2 * E + c;
    uint32_t outer = first + 3 * i + next, inner = first + 9 + next;
    child->corner_edge[first + 3 * i + i] = 2 * edge + (p->edge_vertices[edge][0] != vertex);
    child->corner_edge[first + 3 * i + previous] = 2 * before + (p->edge_vertices[before][0] != vertex);
    child->corner_edge[outer] = across;
    child->corner_edge[inner] = across;
    child->sibling[outer] = inner;
    child->sibling[inner] = outer;
    child->edge_corner[across] = outer;
    child->edge_vertices[across][0] = p->vertex_count + edge;
    child->edge_vertices[across][1] = p->vertex_count + before;
  }
}

/* Round the middle of an edge, counter-clockwise from the half that has the edge's first face on its left:
 * that half, two edges across that face, the other half, two edges across the second face. */
static void link_edge(tw_child_fans *fans, uint32_t edge) {
  const tw_topology *p = fans->parent;
  uint32_t first = p->edge_corner[edge], corner = first, across = 2 * p->edge_count;
  bool manifold = !(p->edge_flags[edge] & TW_EDGE_NONMANIFOLD);
  if (!manifold) {
    tw_put_edge(fans, 2 * edge);
    tw_put_edge(fans, 2 * edge + 1);
  }
  uint32_t half = 2 * edge + 1; /* edge_vertices run as the first corner does */
  do {
    uint32_t next = tw_triangle_next(corner);
    tw_put_corner(fans, tw_triangle_previous(4 * next));
    tw_put_corner(fans, middle_corner(corner));
    tw_put_corner(fans, tw_triangle_next(4 * corner));
    if (manifold) {
      tw_put_edge(fans, half);
      half ^= 1;
    }
    tw_put_edge(fans, across + next);
    tw_put_edge(fans, across + corner);
    corner = p->sibling[corner];
  } while (corner != first);
  if (p->edge_flags[edge] & TW_EDGE_BORDER) tw_put_edge(fans, half);
}

static void split_faces(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const tw_child_step *s = context;
  (void)part;
  for (uint32_t f = begin; f < end; f++) {
    split_corners(s->parent, f, s->child);
    split_face(s->parent, f, s->child);
  }
}

tw_status tw_loop_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                           const tw_parallel_for *parallel, tw_topology *child) {
  tw_status status = count_child(parent, child);
  const tw_child_step step = {.parent = parent,
                              .child = child,
                              .middle_corners = 3,
                              .middle_edges = 2,
                              .split_faces = split_faces,
                              .link_edge = link_edge};
  return status == TW_OK ? tw_child_make(&step, rules, arena, parallel) : status;
}

/* ---- values --------------------------------------------------------------------------------- */

double tw_loop_weight(uint32_t valence) {
  static const double turn = 2 * 3.14159265358979323846;
  if (valence == 6) return 0.0625;
  double towards = 0.375 + 0.25 * cos(turn / valence);
  return (0.625 - towards * towards) / valence;
}

/* Ends 3/8 each, and 1/4 for the points that face the edge: one each of two triangles, all in equal parts
 * where the mesh is not manifold. */
static inline void blend_edge(const tw_topology *p, uint32_t edge, double crease, uint32_t width,
                              const double *in, double *restrict out) {
  const double *a = in + (size_t)p->edge_vertices[edge][0] * width,
               *b = in + (size_t)p->edge_vertices[edge][1] * width;
  double facing[TW_LOOP_WIDTH_MAX] = {0};
  uint32_t faces = 0, first = p->edge_corner[edge], c = first;
  do {
    tw_loop_add(facing, in + (size_t)p->corner_vertex[tw_triangle_previous(c)] * width, width);
    faces++;
    c = p->sibling[c];
  } while (c != first);
  double end_weight = 0.375 + 0.125 * crease, facing_weight = 0.25 * (1 - crease) / faces;
  for (uint32_t i = 0; i < width; i++) out[i] = end_weight * (a[i] + b[i]) + facing_weight * facing[i];
}

static inline void refine_edges(const tw_topology *p, const tw_rules *rules, uint32_t width, const double *in,
                                uint32_t begin, uint32_t end, double *restrict out) {
  for (uint32_t e = begin; e < end; e++, out += width) {
    const double *a = in + (size_t)p->edge_vertices[e][0] * width,
                 *b = in + (size_t)p->edge_vertices[e][1] * width;
    uint32_t corner = p->edge_corner[e], other = p->sibling[corner];
    double crease = (double)tw_crease_share(p, rules, e);
    if (crease == 1)
      tw_loop_sharp_middle(a, b, width, out);
    else if (crease == 0 && corner != other && p->sibling[other] == corner)
      tw_loop_smooth_middle(a, b, in + (size_t)p->corner_vertex[tw_triangle_previous(corner)] * width,
                            in + (size_t)p->corner_vertex[tw_triangle_previous(other)] * width, width, out);
    else
      blend_edge(p, e, crease, width, in, out);
  }
}

static inline const double *neighbour(const tw_topology *p, uint32_t vertex, uint32_t place, uint32_t width,
                                      const double *in) {
  uint32_t edge = p->ring_edges[p->ring_offsets[vertex] + place];
  return in + (size_t)tw_far_end(p, edge, vertex) * width;
}

static inline void smooth_vertex(const tw_topology *p, uint32_t vertex, uint32_t width, const double *in,
                                 double *restrict out) {
  uint32_t valence = p->ring_offsets[vertex + 1] - p->ring_offsets[vertex];
  double ring[TW_LOOP_WIDTH_MAX] = {0};
  for (uint32_t i = 0; i < valence; i++) tw_loop_add(ring, neighbour(p, vertex, i, width, in), width);
  tw_loop_smooth(in + (size_t)vertex * width, ring, valence, tw_loop_weight(valence), width, out);
}

static inline void crease_vertex(const tw_topology *p, uint32_t vertex, const uint32_t ends[2],
                                 uint32_t width, const double *in, double *restrict out) {
  tw_loop_crease(in + (size_t)vertex * width, neighbour(p, vertex, ends[0], width, in),
                 neighbour(p, vertex, ends[1], width, in), width, out);
}

static inline void blend_vertex(const tw_topology *p, uint32_t vertex, const tw_vertex_blend *blend,
                                uint32_t width, const double *in, double *restrict out) {
  const double *own = in + (size_t)vertex * width;
  double smooth[TW_LOOP_WIDTH_MAX] = {0}, crease[TW_LOOP_WIDTH_MAX] = {0};
  if (blend->smooth > 0) smooth_vertex(p, vertex, width, in, smooth);
  if (blend->crease > 0) crease_vertex(p, vertex, blend->ends, width, in, crease);
  for (uint32_t i = 0; i < width; i++)
    out[i] = (double)blend->corner * own[i] + (double)blend->crease * crease[i] +
             (double)blend->smooth * smooth[i];
}

static inline void refine_vertices(const tw_topology *p, const tw_rules *rules, uint32_t width,
                                   const double *in, uint32_t begin, uint32_t end, double *restrict out) {
  for (uint32_t v = begin; v < end; v++, out += width) {
    tw_vertex_blend blend = {1, 0, 0, {0, 0}};
    if (!p->smooth || rules->linear) blend = tw_blend_at(p, rules, v);
    if (blend.smooth == 1)
      smooth_vertex(p, v, width, in, out);
    else if (blend.crease == 1)
      crease_vertex(p, v, blend.ends, width, in, out);
    else if (blend.corner == 1)
      memcpy(out, in + (size_t)v * width, width * sizeof *out);
    else
      blend_vertex(p, v, &blend, width, in, out);
  }
}

static inline void refine(const tw_topology *p, const tw_rules *rules, uint32_t width, const double *in,
                          uint32_t begin, uint32_t end, double *out) {
  uint32_t vertices = p->vertex_count, stop = end < vertices ? end : vertices;
  if (begin < stop) {
    refine_vertices(p, rules, width, in, begin, stop, out);
    out += (size_t)(stop - begin) * width;
    begin = stop;
  }
  if (begin < end) refine_edges(p, rules, width, in, begin - vertices, end - vertices, out);
}

void tw_loop_some_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                         uint32_t first, uint32_t count, double *out) {
  if (width == 3) /* points; a known width lets the compiler unroll */
    refine(parent, rules, 3, in, first, first + count, out);
  else
    refine(parent, rules, width, in, first, first + count, out);
}

typedef struct values_job {
  const tw_topology *parent;
  const tw_rules *rules;
  uint32_t width;
  const double *in;
  double *out;
} values_job;

static void compute_values(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const values_job *j = context;
  (void)part;
  tw_loop_some_values(j->parent, j->rules, j->width, j->in, begin, end - begin,
                      j->out + (size_t)begin * j->width);
}

void tw_loop_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                    const tw_parallel_for *parallel, double *out) {
  values_job job = {parent, rules, width, in, out};
  tw_parallel_for_run(parallel, parent->vertex_count + parent->edge_count, TW_PARALLEL_FOR_LEAST,
                      compute_values, &job);
}
