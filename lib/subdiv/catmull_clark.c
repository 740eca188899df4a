/* The generic subdivision step. */
#include "catmull_clark.h"

#include <string.h>

#include "child.h"
#include "loop.h"

/* ---- topology ------------------------------------------------------------------------------- */

static tw_status count_child(const tw_topology *p, tw_topology *child) {
  memset(child, 0, sizeof *child);
  uint64_t vertices = (uint64_t)p->vertex_count + p->edge_count + p->face_count;
  uint64_t edges = 2 * (uint64_t)p->edge_count + p->corner_count;
  uint64_t corners = 4 * (uint64_t)p->corner_count;
  if (vertices >= UINT32_MAX || edges >= UINT32_MAX || corners >= UINT32_MAX) return TW_LIMIT;
  child->vertex_count = (uint32_t)vertices;
  child->edge_count = (uint32_t)edges;
  child->face_count = p->corner_count;
  child->face_size = 4;
  child->corner_count = (uint32_t)corners;
  return TW_OK;
}

/* The four corners of each child quad of one face. */
static void split_face(const tw_topology *p, uint32_t face, tw_topology *child) {
  uint32_t begin = tw_face_begin(p, face), size = tw_face_size(p, face);
  uint32_t V = p->vertex_count, E = p->edge_count;
  for (uint32_t i = 0; i < size; i++) {
    uint32_t c = begin + i, previous = i ? c - 1 : begin + size - 1, next = i + 1 < size ? c + 1 : begin;
    uint32_t edge = p->corner_edge[c], before = p->corner_edge[previous], vertex = p->corner_vertex[c];
    uint32_t *corners = child->corner_vertex + 4 * (size_t)c;
    corners[0] = vertex;
    corners[1] = V + edge;
    corners[2] = V + E + face;
    corners[3] = V + before;
    uint32_t *edges = child->corner_edge + 4 * (size_t)c;
    edges[0] = 2 * edge + (p->edge_vertices[edge][0] != vertex);
    edges[1] = 2 * E + c;
    edges[2] = 2 * E + previous;
    edges[3] = 2 * before + (p->edge_vertices[before][0] != vertex);
    child->sibling[4 * (size_t)c + 1] = 4 * next + 2;
    child->sibling[4 * (size_t)next + 2] = 4 * c + 1;
    child->edge_vertices[2 * E + c][0] = V + edge;
    child->edge_vertices[2 * E + c][1] = V + E + face;
    child->edge_corner[2 * E + c] = 4 * c + 1;
  }
}

/* Round the middle of an edge, counter-clockwise from the half that has the edge's first face on its
 * left: that half, the spoke into the first face, the other half, the spoke into the second. */
static void link_edge(tw_child_fans *fans, uint32_t edge) {
  const tw_topology *p = fans->parent;
  uint32_t first = p->edge_corner[edge], corner = first, spokes = 2 * p->edge_count;
  bool manifold = !(p->edge_flags[edge] & TW_EDGE_NONMANIFOLD);
  if (!manifold) {
    tw_put_edge(fans, 2 * edge);
    tw_put_edge(fans, 2 * edge + 1);
  }
  uint32_t half = 2 * edge + 1; /* edge_vertices run as the first corner does */
  do {
    tw_put_corner(fans, 4 * tw_corner_next(p, corner) + 3);
    tw_put_corner(fans, 4 * corner + 1);
    if (manifold) {
      tw_put_edge(fans, half);
      half ^= 1;
    }
    tw_put_edge(fans, spokes + corner);
    corner = p->sibling[corner];
  } while (corner != first);
  if (p->edge_flags[edge] & TW_EDGE_BORDER) tw_put_edge(fans, half);
}

static void link_face(tw_child_fans *fans, uint32_t face) {
  const tw_topology *p = fans->parent;
  uint32_t begin = tw_face_begin(p, face), size = tw_face_size(p, face), spokes = 2 * p->edge_count;
  for (uint32_t i = 0; i < size; i++) {
    tw_put_corner(fans, 4 * (begin + i) + 2);
    tw_put_edge(fans, spokes + begin + (i ? i : size) - 1);
  }
}

static void split_faces(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const tw_child_step *s = context;
  (void)part;
  for (uint32_t f = begin; f < end; f++) split_face(s->parent, f, s->child);
}

static void link_faces(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const tw_child_step *s = context;
  uint32_t first = s->parent->vertex_count + s->parent->edge_count;
  tw_child_fans fans = tw_start_fans(s, first + begin);
  (void)part;
  for (uint32_t f = begin; f < end; f++) {
    link_face(&fans, f);
    s->child->vertex_flags[first + f] = 0;
  }
}

tw_status tw_refine_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                             const tw_parallel_for *parallel, tw_topology *child) {
  tw_status status = count_child(parent, child);
  const tw_child_step step = {.parent = parent,
                              .child = child,
                              .middle_corners = 2,
                              .middle_edges = 1,
                              .split_faces = split_faces,
                              .link_edge = link_edge,
                              .link_faces = link_faces};
  return status == TW_OK ? tw_child_make(&step, rules, arena, parallel) : status;
}

/* ---- values --------------------------------------------------------------------------------- */

static inline void add_scaled(float *restrict out, const float *restrict in, float weight, uint32_t width) {
  for (uint32_t i = 0; i < width; i++) out[i] += weight * in[i];
}

static inline void refine_faces(const tw_topology *p, uint32_t width, const float *restrict in,
                                uint32_t begin_face, uint32_t end_face, float *restrict face_points) {
  for (uint32_t f = begin_face; f < end_face; f++) {
    uint32_t begin = tw_face_begin(p, f), size = tw_face_size(p, f);
    float *point = face_points + (size_t)f * width;
    memcpy(point, in + (size_t)p->corner_vertex[begin] * width, width * sizeof *point);
    for (uint32_t i = 1; i < size; i++)
      add_scaled(point, in + (size_t)p->corner_vertex[begin + i] * width, 1, width);
    for (uint32_t i = 0; i < width; i++) point[i] /= (float)size;
  }
}

/* OpenSubdiv's 0.47 for triangles when asked for. */
float tw_smooth_face_weight(const tw_rules *rules, uint32_t faces, uint32_t triangles) {
  if (faces != 2) return 0.5f / (float)faces;
  if (!rules->smooth_triangles || triangles == 0) return 0.25f;
  return triangles == 2 ? 0.47f : 0.5f * (0.47f + 0.25f);
}

/* Where nothing is sharp all edges have two faces. */
static inline void refine_smooth_edge(const tw_topology *p, uint32_t edge, uint32_t width, const float *a,
                                      const float *b, const float *face_points, float *restrict point) {
  uint32_t corner = p->edge_corner[edge];
  const float *left = face_points + (size_t)tw_corner_face(p, corner) * width,
              *right = face_points + (size_t)tw_corner_face(p, p->sibling[corner]) * width;
  for (uint32_t i = 0; i < width; i++) point[i] = 0.25f * (a[i] + b[i]) + 0.25f * (left[i] + right[i]);
}

static inline void refine_edges(const tw_topology *p, const tw_rules *rules, uint32_t width,
                                const float *restrict in, const float *restrict face_points, uint32_t begin,
                                uint32_t end, float *restrict out) {
  bool smooth = p->smooth && !rules->linear && !rules->smooth_triangles;
  for (uint32_t e = begin; e < end; e++) {
    float *point = out + (size_t)(e - begin) * width;
    const float *a = in + (size_t)p->edge_vertices[e][0] * width,
                *b = in + (size_t)p->edge_vertices[e][1] * width;
    if (smooth) {
      refine_smooth_edge(p, e, width, a, b, face_points, point);
      continue;
    }
    float crease = tw_crease_share(p, rules, e);
    if (crease == 1) {
      for (uint32_t i = 0; i < width; i++) point[i] = 0.5f * (a[i] + b[i]);
      continue;
    }
    uint32_t faces = 0, triangles = 0, first = p->edge_corner[e], c = first;
    memset(point, 0, width * sizeof *point);
    do {
      uint32_t face = tw_corner_face(p, c);
      add_scaled(point, face_points + (size_t)face * width, 1, width);
      triangles += tw_face_size(p, face) == 3;
      faces++;
      c = p->sibling[c];
    } while (c != first);
    float face_weight = tw_smooth_face_weight(rules, faces, triangles);
    float end_weight = (1 - crease) * 0.5f * (1 - face_weight * (float)faces) + crease * 0.5f;
    for (uint32_t i = 0; i < width; i++)
      point[i] = end_weight * (a[i] + b[i]) + (1 - crease) * face_weight * point[i];
  }
}

/* ((n - 2) v + mean of neighbours + mean of face points) / n, the textbook's (F + 2E + (n - 3) P) / n
 * with the edge midpoints written out. Faces and neighbours are summed up side by side, a few values at a
 * time. */
static inline void add_smooth(const tw_topology *p, uint32_t vertex, float share, uint32_t width,
                              const float *restrict in, const float *restrict face_points,
                              float *restrict point) {
  uint32_t first = p->fan_offsets[vertex], end = p->fan_offsets[vertex + 1];
  float n = (float)(end - first), weight = share / (n * n);
  for (uint32_t at = 0; at < width; at += 4) {
    uint32_t part = width - at < 4 ? width - at : 4;
    float faces[4] = {0}, edges[4] = {0};
    for (uint32_t i = first; i < end; i++)
      add_scaled(faces, face_points + (size_t)tw_corner_face(p, p->fan_corners[i]) * width + at, 1, part);
    for (uint32_t i = p->ring_offsets[vertex]; i < p->ring_offsets[vertex + 1]; i++)
      add_scaled(edges, in + (size_t)tw_far_end(p, p->ring_edges[i], vertex) * width + at, 1, part);
    const float *own = in + (size_t)vertex * width + at;
    for (uint32_t i = 0; i < part; i++)
      point[at + i] += (faces[i] + edges[i]) * weight + share * (n - 2) / n * own[i];
  }
}

static inline void refine_vertices(const tw_topology *p, const tw_rules *rules, uint32_t width,
                                   const float *restrict in, const float *restrict face_points,
                                   uint32_t begin, uint32_t end, float *restrict out) {
  bool smooth = p->smooth && !rules->linear;
  for (uint32_t v = begin; v < end; v++) {
    float *point = out + (size_t)(v - begin) * width, sum[4] = {0};
    const float *own = in + (size_t)v * width;
    if (smooth && width <= 4) { /* summed up in registers */
      add_smooth(p, v, 1, width, in, face_points, sum);
      memcpy(point, sum, width * sizeof *point);
      continue;
    }
    tw_vertex_blend blend = tw_blend_at(p, rules, v);
    if (blend.corner == 1 || p->fan_offsets[v] == p->fan_offsets[v + 1]) {
      memcpy(point, own, width * sizeof *point);
      continue;
    }
    memset(point, 0, width * sizeof *point);
    if (blend.smooth > 0) add_smooth(p, v, blend.smooth, width, in, face_points, point);
    if (blend.crease > 0) {
      const uint32_t *ring = p->ring_edges + p->ring_offsets[v];
      for (int i = 0; i < 2; i++)
        add_scaled(point, in + (size_t)tw_far_end(p, ring[blend.ends[i]], v) * width, 0.125f * blend.crease,
                   width);
      add_scaled(point, own, 0.75f * blend.crease, width);
    }
    if (blend.corner > 0) add_scaled(point, own, blend.corner, width);
  }
}

typedef struct values_job {
  const tw_topology *parent;
  const tw_rules *rules;
  uint32_t width;
  const float *in;
  float *out, *edge_points, *face_points;
} values_job;

static void compute_faces(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const values_job *j = context;
  (void)part;
  if (j->width == 3) /* points; a known width lets the compiler unroll */
    refine_faces(j->parent, 3, j->in, begin, end, j->face_points);
  else
    refine_faces(j->parent, j->width, j->in, begin, end, j->face_points);
}

static void compute_edges(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const values_job *j = context;
  float *out = j->edge_points + (size_t)begin * j->width;
  (void)part;
  if (j->width == 3)
    refine_edges(j->parent, j->rules, 3, j->in, j->face_points, begin, end, out);
  else
    refine_edges(j->parent, j->rules, j->width, j->in, j->face_points, begin, end, out);
}

static void compute_vertices(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const values_job *j = context;
  float *out = j->out + (size_t)begin * j->width;
  (void)part;
  if (j->width == 3)
    refine_vertices(j->parent, j->rules, 3, j->in, j->face_points, begin, end, out);
  else
    refine_vertices(j->parent, j->rules, j->width, j->in, j->face_points, begin, end, out);
}

void tw_refine_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const float *in,
                      const tw_parallel_for *parallel, float *out) {
  const tw_topology *p = parent;
  float *edge_points = out + (size_t)p->vertex_count * width;
  values_job job = {p, rules, width, in, out, edge_points, edge_points + (size_t)p->edge_count * width};
  tw_parallel_for_run(parallel, p->face_count, TW_PARALLEL_FOR_LEAST, compute_faces, &job);
  tw_parallel_for_run(parallel, p->edge_count, TW_PARALLEL_FOR_LEAST, compute_edges, &job);
  tw_parallel_for_run(parallel, p->vertex_count, TW_PARALLEL_FOR_LEAST, compute_vertices, &job);
}

/* ---- masks -------------------------------------------------------------------------------------- */

/* Masks of the generic step, one vertex at a time. */

static uint32_t larger(uint32_t a, uint32_t b) {
  return a > b ? a : b;
}

uint32_t tw_refine_mask_capacity(const tw_topology *p) {
  uint32_t capacity = 1;
  for (uint32_t f = 0; f < p->face_count; f++) capacity = larger(capacity, tw_face_size(p, f));
  for (uint32_t v = 0; v < p->vertex_count; v++)
    capacity = larger(capacity, 1 + p->ring_offsets[v + 1] - p->ring_offsets[v] + p->fan_offsets[v + 1] -
                                    p->fan_offsets[v]);
  /* The faces of an edge are among those of its ends, and an edge has two ends itself. */
  return capacity + 2;
}

static uint32_t face_mask(const tw_topology *p, uint32_t face, tw_share *shares) {
  uint32_t begin = tw_face_begin(p, face), size = tw_face_size(p, face);
  for (uint32_t i = 0; i < size; i++) shares[i] = (tw_share){p->corner_vertex[begin + i], 1 / (float)size};
  return size;
}

static uint32_t edge_mask(const tw_topology *p, const tw_rules *rules, uint32_t edge, tw_share *shares) {
  float crease = tw_crease_share(p, rules, edge);
  uint32_t count = 2, triangles = 0, first = p->edge_corner[edge], c = first;
  do {
    uint32_t face = tw_corner_face(p, c);
    shares[count++].vertex = p->vertex_count + p->edge_count + face;
    triangles += tw_face_size(p, face) == 3;
    c = p->sibling[c];
  } while (c != first);
  uint32_t faces = count - 2;
  float face_weight = tw_smooth_face_weight(rules, faces, triangles);
  float end_weight = (1 - crease) * 0.5f * (1 - face_weight * (float)faces) + crease * 0.5f;
  for (uint32_t i = 0; i < 2; i++) shares[i] = (tw_share){p->edge_vertices[edge][i], end_weight};
  if (crease == 1) return 2;
  for (uint32_t i = 2; i < count; i++) shares[i].weight = (1 - crease) * face_weight;
  return count;
}

static uint32_t vertex_mask(const tw_topology *p, const tw_rules *rules, uint32_t vertex, tw_share *shares) {
  uint32_t ring = p->ring_offsets[vertex], edges = p->ring_offsets[vertex + 1] - ring;
  uint32_t fan = p->fan_offsets[vertex], faces = p->fan_offsets[vertex + 1] - fan;
  shares[0] = (tw_share){vertex, 1};
  if (faces == 0) return 1;
  tw_vertex_blend blend = tw_blend_at(p, rules, vertex);
  float n = (float)faces, smooth = blend.smooth / (n * n);
  shares[0].weight = blend.corner + 0.75f * blend.crease + blend.smooth * (n - 2) / n;
  if (blend.corner == 1) return 1;
  for (uint32_t i = 0; i < edges; i++)
    shares[1 + i] = (tw_share){tw_far_end(p, p->ring_edges[ring + i], vertex), smooth};
  if (blend.crease > 0)
    for (int i = 0; i < 2; i++) shares[1 + blend.ends[i]].weight += 0.125f * blend.crease;
  for (uint32_t i = 0; i < faces; i++)
    shares[1 + edges + i] =
        (tw_share){p->vertex_count + p->edge_count + tw_corner_face(p, p->fan_corners[fan + i]), smooth};
  return 1 + edges + faces;
}

uint32_t tw_refine_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares) {
  if (child < parent->vertex_count) return vertex_mask(parent, rules, child, shares);
  child -= parent->vertex_count;
  if (child < parent->edge_count) return edge_mask(parent, rules, child, shares);
  return face_mask(parent, child - parent->edge_count, shares);
}

/* ---- Loop ----------------------------------------------------------------------------------- */

static uint32_t loop_edge_mask(const tw_topology *p, const tw_rules *rules, uint32_t edge, tw_share *shares) {
  float crease = tw_crease_share(p, rules, edge), end_weight = (1 - crease) * 0.375f + crease * 0.5f;
  uint32_t count = 2, first = p->edge_corner[edge], c = first;
  for (uint32_t i = 0; i < 2; i++) shares[i] = (tw_share){p->edge_vertices[edge][i], end_weight};
  if (crease == 1) return 2;
  do {
    shares[count++].vertex = p->corner_vertex[tw_triangle_previous(c)];
    c = p->sibling[c];
  } while (c != first);
  for (uint32_t i = 2; i < count; i++) shares[i].weight = (1 - crease) * 0.25f / (float)(count - 2);
  return count;
}

static uint32_t loop_vertex_mask(const tw_topology *p, const tw_rules *rules, uint32_t vertex,
                                 tw_share *shares) {
  tw_vertex_blend blend = tw_blend_at(p, rules, vertex);
  uint32_t ring = p->ring_offsets[vertex], valence = p->ring_offsets[vertex + 1] - ring;
  double weight = blend.smooth > 0 ? tw_loop_weight(valence) : 0;
  float own = blend.corner + 0.75f * blend.crease + blend.smooth * (float)(1 - valence * weight);
  shares[0] = (tw_share){vertex, own};
  if (blend.corner == 1) return 1;
  for (uint32_t i = 0; i < valence; i++)
    shares[1 + i] = (tw_share){tw_far_end(p, p->ring_edges[ring + i], vertex), blend.smooth * (float)weight};
  if (blend.crease > 0)
    for (int i = 0; i < 2; i++) shares[1 + blend.ends[i]].weight += 0.125f * blend.crease;
  return 1 + valence;
}

uint32_t tw_loop_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares) {
  if (child < parent->vertex_count) return loop_vertex_mask(parent, rules, child, shares);
  return loop_edge_mask(parent, rules, child - parent->vertex_count, shares);
}
