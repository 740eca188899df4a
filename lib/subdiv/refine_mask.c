/* Masks of the generic step, one vertex at a time. */
#include "refine_mask.h"

#include <stdlib.h>

#include "loop.h"

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

/* Against its first share's vertex, which is the parent's, so that weights in float cost no more than the
 * distances are worth. */
static void add_shares(const tw_topology *p, const tw_share *shares, uint32_t count, uint32_t width,
                       const double *in, const double *children, double *out) {
  const double *origin = in + (size_t)shares[0].vertex * width;
  for (uint32_t i = 0; i < width; i++) out[i] = origin[i];
  for (uint32_t s = 1; s < count; s++) {
    bool child = shares[s].vertex >= p->vertex_count;
    const double *value = (child ? children : in) + (size_t)shares[s].vertex * width;
    for (uint32_t i = 0; i < width; i++) out[i] += (double)shares[s].weight * (value[i] - origin[i]);
  }
}

typedef struct exact_job {
  const tw_topology *parent;
  const tw_rules *rules;
  uint32_t width, first; /* child */
  const double *in;
  double *out;
  tw_share *shares; /* of each part */
  size_t capacity;
} exact_job;

static void compute_exactly(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const exact_job *j = context;
  tw_share *shares = j->shares + part * j->capacity;
  for (uint32_t child = j->first + begin; child < j->first + end; child++) {
    uint32_t count = tw_refine_mask(j->parent, j->rules, child, shares);
    add_shares(j->parent, shares, count, j->width, j->in, j->out, j->out + (size_t)child * j->width);
  }
}

tw_status tw_refine_exact(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                          const tw_parallel_for *parallel, double *out) {
  enum { LEAST = TW_PARALLEL_FOR_LEAST / 4 }; /* masks cost more than values */
  uint32_t faces_begin = parent->vertex_count + parent->edge_count,
           parts = tw_parallel_for_parts(parallel, faces_begin + parent->face_count, LEAST);
  size_t capacity = tw_refine_mask_capacity(parent);
  exact_job job = {parent, rules, width, faces_begin, in, out, NULL, capacity};
  if (capacity > SIZE_MAX / parts) return TW_NO_MEMORY;
  job.shares = tw_alloc(parts * capacity, sizeof *job.shares);
  if (!job.shares) return TW_NO_MEMORY;
  /* Face points come last and are what the others are made of. */
  tw_parallel_for_run(parallel, parent->face_count, LEAST, compute_exactly, &job);
  job.first = 0;
  tw_parallel_for_run(parallel, faces_begin, LEAST, compute_exactly, &job);
  free(job.shares);
  return TW_OK;
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
