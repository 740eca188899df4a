/* Loop's subdivision step: the connectivity of the child, and masks. */
#include "loop.h"

#include "angle.h"

#include <math.h>
#include <string.h>

/* ---- topology -------------------------------------------------------------------------------- */

/* The corner of the middle child at the middle of corner c's edge. */
static uint32_t middle_corner(uint32_t c) {
  return 9 * (c / 3 + 1) + tw_triangle_previous(c);
}

/* Writes the vertices of the four children of one face. */
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

/* Writes the edges and inner siblings of the four children of one face. */
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

/* Writes the fan and ring of the middle of an edge, counter-clockwise from the half that has the edge's first
 * face on its left: that half, two edges across that face, the other half, two edges across the second
 * face. */
static void link_edge(tw_child_fans *fans, uint32_t edge) {
  const tw_topology *p = fans->parent;
  uint32_t first = p->edge_corner[edge], corner = first, across = 2 * p->edge_count;
  bool manifold = !(p->edge_flags[edge] & TW_EDGE_NONMANIFOLD);
  if (!manifold) {
    tw_put_edge(fans, 2 * edge);
    tw_put_edge(fans, 2 * edge + 1);
  }
  uint32_t half = 2 * edge + 1; /* the half at the end: the first corner runs along the edge */
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
  uint64_t vertices = (uint64_t)parent->vertex_count + parent->edge_count,
           edges = 2 * (uint64_t)parent->edge_count + parent->corner_count;
  tw_status status = tw_child_count(child, vertices, edges, 4 * (uint64_t)parent->face_count, 3);
  const tw_child_step step = {.parent = parent,
                              .child = child,
                              .middle_corners = 3,
                              .middle_edges = 2,
                              .split_faces = split_faces,
                              .link_edge = link_edge};
  return status == TW_OK ? tw_child_make(&step, rules, arena, parallel) : status;
}

/* ---- masks ----------------------------------------------------------------------------------- */

double tw_loop_weight(uint32_t valence) {
  static const double turn = 2 * TW_PI;
  if (valence == 6) return 0.0625;
  double towards = 0.375 + 0.25 * cos(turn / valence);
  return (0.625 - towards * towards) / valence;
}

static uint32_t edge_mask(const tw_topology *p, const tw_rules *rules, uint32_t edge, tw_share *shares) {
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

static uint32_t vertex_mask(const tw_topology *p, const tw_rules *rules, uint32_t vertex, tw_share *shares) {
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
  if (child < parent->vertex_count) return vertex_mask(parent, rules, child, shares);
  return edge_mask(parent, rules, child - parent->vertex_count, shares);
}
