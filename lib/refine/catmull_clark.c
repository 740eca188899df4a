/* Catmull and Clark's subdivision step: the connectivity of the child, and masks. */
#include "catmull_clark.h"

#include <string.h>

/* ---- topology -------------------------------------------------------------------------------- */

/* Writes the corners, edges and inner siblings of the child quads of one face. */
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

/* Writes the fan and ring of the middle of an edge, counter-clockwise from the half that has the edge's first
 * face on its left: that half, the spoke into the first face, the other half, the spoke into the second face.
 * A spoke is the edge from there to a face point. */
static void link_edge(tw_child_fans *fans, uint32_t edge) {
  const tw_topology *p = fans->parent;
  uint32_t first = p->edge_corner[edge], corner = first, spokes = 2 * p->edge_count;
  bool manifold = !(p->edge_flags[edge] & TW_EDGE_NONMANIFOLD);
  if (!manifold) {
    tw_put_edge(fans, 2 * edge);
    tw_put_edge(fans, 2 * edge + 1);
  }
  uint32_t half = 2 * edge + 1; /* the half at the end: the first corner runs along the edge */
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

tw_status tw_catmull_clark_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                                    const tw_parallel_for *parallel, tw_topology *child) {
  uint64_t vertices = (uint64_t)parent->vertex_count + parent->edge_count + parent->face_count,
           edges = 2 * (uint64_t)parent->edge_count + parent->corner_count;
  tw_status status = tw_child_count(child, vertices, edges, parent->corner_count, 4);
  const tw_child_step step = {.parent = parent,
                              .child = child,
                              .middle_corners = 2,
                              .middle_edges = 1,
                              .split_faces = split_faces,
                              .link_edge = link_edge,
                              .link_faces = link_faces};
  return status == TW_OK ? tw_child_make(&step, rules, arena, parallel) : status;
}

/* ---- masks ----------------------------------------------------------------------------------- */

static uint32_t face_mask(const tw_topology *p, uint32_t face, tw_share *shares) {
  uint32_t begin = tw_face_begin(p, face), size = tw_face_size(p, face);
  for (uint32_t i = 0; i < size; i++) shares[i] = (tw_share){p->corner_vertex[begin + i], 1 / (float)size};
  return size;
}

/* The weight of each face point in a smooth edge point. faces: at the edge; triangles: how many of them are
 * triangles, for which OpenSubdiv's 0.47 is used when asked for. */
static float face_weight_of(const tw_rules *rules, uint32_t faces, uint32_t triangles) {
  if (faces != 2) return 0.5f / (float)faces;
  if (!rules->smooth_triangles || triangles == 0) return 0.25f;
  return triangles == 2 ? 0.47f : 0.5f * (0.47f + 0.25f);
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
  float face_weight = face_weight_of(rules, faces, triangles);
  float end_weight = (1 - crease) * 0.5f * (1 - face_weight * (float)faces) + crease * 0.5f;
  for (uint32_t i = 0; i < 2; i++) shares[i] = (tw_share){p->edge_vertices[edge][i], end_weight};
  if (crease == 1) return 2;
  for (uint32_t i = 2; i < count; i++) shares[i].weight = (1 - crease) * face_weight;
  return count;
}

/* ((n - 2) P + mean of neighbours + mean of face points) / n: the textbook's (F + 2E + (n - 3) P) / n with
 * the edge midpoints E written out. */
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

uint32_t tw_catmull_clark_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child,
                               tw_share *shares) {
  if (child < parent->vertex_count) return vertex_mask(parent, rules, child, shares);
  child -= parent->vertex_count;
  if (child < parent->edge_count) return edge_mask(parent, rules, child, shares);
  return face_mask(parent, child - parent->edge_count, shares);
}
