/* Tangents of single rows of shallow surfaces: those of limit.h, over the ring of neighbours that the cage's
 * connectivity tells. Ring and faces between are passed round the vertex counter-clockwise. */
#ifndef TWEEND_SHALLOW_TANGENTS_H
#define TWEEND_SHALLOW_TANGENTS_H

#include "point.h"
#include "shallow_normals.h"

/* ---- neighbours ----------------------------------------------------------------------------- */

static inline const float *at(const float *points, size_t index) {
  return points + 3 * index;
}

/* The half of a corner's edge that begins and that ends at the end of the corner's side, and at a vertex. An
 * edge runs as the lower of its corners does. */
static inline const float *half_from(const tw_shallow_level *l, size_t corner) {
  return at(l->halves, 2 * (size_t)l->cage.corner_edge[corner] + (l->cage.sibling[corner] < corner));
}
static inline const float *half_to(const tw_shallow_level *l, size_t corner) {
  return at(l->halves, 2 * (size_t)l->cage.corner_edge[corner] + (l->cage.sibling[corner] > corner));
}
static inline const float *half_at(const tw_shallow_level *l, size_t edge, uint32_t vertex) {
  return at(l->halves, 2 * edge + (l->cage.edge_vertices[edge][0] != vertex));
}
static inline const float *edge_at(const tw_shallow_level *l, size_t corner) {
  return at(l->edges, l->cage.corner_edge[corner]);
}

/* A corner with those beside it in the face. */
typedef struct place {
  size_t corner, next, previous, face;
} place;

/* Nobody could guess which of three a corner is: places beside it are read from the bits of a number, 1 2 0
 * and 2 0 1, without a branch. */
static inline place nth_of_triangle(size_t face, size_t n) {
  return (place){3 * face + n, 3 * face + (0x9 >> 2 * n & 3), 3 * face + (0x12 >> 2 * n & 3), face};
}

static inline place place_of(const tw_shallow_level *l, uint32_t corner) {
  const tw_topology *t = &l->cage;
  if (t->face_size == 3) return nth_of_triangle(corner / 3, corner % 3);
  return (place){corner, tw_corner_next(t, corner), tw_corner_previous(t, corner), tw_corner_face(t, corner)};
}

/* ---- looking ahead -------------------------------------------------------------------------- */

/* Neighbours of what is numbered in another order lie anywhere in memory: asks for those of items farther on,
 * of those before `count`. */
enum { AHEAD = 12 };

static inline uint32_t ahead_of(uint32_t item, uint32_t count, uint32_t steps) {
  return item + steps < count ? item + steps : count - 1;
}

/* Of an edge: what is known of its two faces, the second of which its first one has to tell before. */
static inline __attribute__((always_inline)) void fetch_sides(const tw_shallow_level *l, uint32_t edge,
                                                              bool edges, const float *first,
                                                              const float *second, bool by_face) {
  const tw_topology *t = &l->cage;
  uint32_t corners[2] = {t->edge_corner[ahead_of(edge, t->edge_count, AHEAD)]};
  corners[1] = t->sibling[corners[0]];
  __builtin_prefetch(&t->sibling[t->edge_corner[ahead_of(edge, t->edge_count, 2 * AHEAD)]]);
  for (int i = 0; i < 2; i++) {
    size_t index = by_face ? tw_corner_face(t, corners[i]) : corners[i];
    if (edges) __builtin_prefetch(&t->corner_edge[corners[i]]);
    __builtin_prefetch(at(first, index));
    if (second) __builtin_prefetch(at(second, index));
  }
}

/* Of all corners of a triangle: what is known of their edges and vertices. */
static inline __attribute__((always_inline)) void fetch_triangle(const tw_shallow_level *l, uint32_t face) {
  if (l->cage.face_size != 3) return;
  size_t first = 3 * (size_t)ahead_of(face, l->cage.face_count, AHEAD);
  for (size_t corner = first; corner < first + 3; corner++) {
    __builtin_prefetch(edge_at(l, corner));
    __builtin_prefetch(at(l->vertices, l->cage.corner_vertex[corner]));
  }
}

/* ---- tangents ------------------------------------------------------------------------------- */

/* Tangents at a vertex, and a face there: the vertex itself, the end of an edge, the corner across, the end
 * of the next edge. */
typedef struct row {
  tw_point along[2];
  const float *quad[4];
} row;

static inline tw_point from_to(const float *from, const float *to) {
  return tw_load_point(to) - tw_load_point(from);
}

/* Between four faces: the ends of the edges and, of the face behind each, the corner across. */
static inline __attribute__((always_inline)) row
tangents_of_four(const float *own, const float *const edges[4], const float *const faces[4]) {
  tw_point rising = from_to(faces[2], faces[0]), falling = from_to(faces[1], faces[3]);
  return (row){{4 * from_to(edges[2], edges[0]) + (rising + falling),
                4 * from_to(edges[3], edges[1]) + (rising - falling)},
               {own, edges[0], faces[0], edges[1]}};
}

/* Between three likewise, as differences of what the weights, each against that across, make of the edges. */
static inline __attribute__((always_inline)) row tangents_of_three(const tw_shallow_level *l,
                                                                   const float *own,
                                                                   const float *const edges[3],
                                                                   const float *const faces[3]) {
  float face = l->weights->faces[3][1];
  return (row){{4 * from_to(edges[0], edges[1]) + face * from_to(faces[1], faces[2]),
                4 * from_to(edges[0], edges[2]) + face * from_to(faces[1], faces[0])},
               {own, edges[0], faces[0], edges[1]}};
}

/* Between any number, of which the nth is told likewise. In a cage of triangles the corners across tell
 * nothing new: what the weights make of them is a multiple of what they make of the edges. */
typedef struct neighbour {
  const float *edge, *face;
} neighbour;

typedef neighbour neighbour_of(const tw_shallow_level *l, uint32_t index, uint32_t n);

static inline __attribute__((always_inline)) row tangents_of_many(const tw_shallow_level *l, const float *own,
                                                                  uint32_t index, uint32_t count,
                                                                  bool edges_alone, neighbour_of *find) {
  bool common = count < TW_COMMON_VALENCES;
  if (common && !l->weights->known[count]) tw_shallow_learn(l->weights, count);
  const float *edges = l->weights->edges[common ? count : 0], *faces = l->weights->faces[common ? count : 0];
  tw_point centre = tw_load_point(own);
  float edge2 = common ? edges[count - 1] : (float)tw_shallow_edge_weight(count - 1, count),
        face2 = common ? faces[count - 1] : (float)tw_shallow_face_weight(count - 1, count);
  row r = {{{0}, {0}}, {own, find(l, index, 0).edge, find(l, index, 0).face, find(l, index, 1).edge}};
  for (uint32_t i = 0; i < count; i++) {
    float edge1 = common ? edges[i] : (float)tw_shallow_edge_weight(i, count),
          face1 = common ? faces[i] : (float)tw_shallow_face_weight(i, count);
    neighbour n = find(l, index, i);
    tw_point to_edge = tw_load_point(n.edge) - centre;
    r.along[0] += edge1 * to_edge;
    r.along[1] += edge2 * to_edge;
    edge2 = edge1;
    if (edges_alone) continue;
    tw_point to_face = tw_load_point(n.face) - centre;
    r.along[0] += face1 * to_face;
    r.along[1] += face2 * to_face;
    face2 = face1;
  }
  return r;
}

/* ---- vertices of the cage ------------------------------------------------------------------- */

/* Where a vertex's neighbours begin: in fan_corners and ring_edges alike, as nothing has a border. */
static inline uint32_t fan_begin(const tw_shallow_level *l, uint32_t vertex) {
  return l->cage.fan_offsets[vertex];
}
static inline uint32_t fan_size(const tw_shallow_level *l, uint32_t vertex) {
  return l->cage.fan_offsets[vertex + 1] - l->cage.fan_offsets[vertex];
}

static inline __attribute__((always_inline)) neighbour level_1_at_vertex(const tw_shallow_level *l,
                                                                         uint32_t vertex, uint32_t n) {
  size_t i = fan_begin(l, vertex) + n;
  return (neighbour){at(l->edges, l->cage.ring_edges[i]),
                     at(l->faces, tw_corner_face(&l->cage, l->cage.fan_corners[i]))};
}
static inline __attribute__((always_inline)) neighbour level_2_at_vertex(const tw_shallow_level *l,
                                                                         uint32_t vertex, uint32_t n) {
  size_t i = fan_begin(l, vertex) + n;
  return (neighbour){half_at(l, l->cage.ring_edges[i], vertex), at(l->centres, l->cage.fan_corners[i])};
}

static inline __attribute__((always_inline)) void level_1_vertex(const tw_shallow_level *l, uint32_t vertex,
                                                                 row *rows) {
  rows[0] = tangents_of_many(l, at(l->vertices, vertex), vertex, fan_size(l, vertex), l->cage.face_size == 3,
                             level_1_at_vertex);
}
static inline __attribute__((always_inline)) void level_2_vertex(const tw_shallow_level *l, uint32_t vertex,
                                                                 row *rows) {
  rows[0] = tangents_of_many(l, at(l->vertices, vertex), vertex, fan_size(l, vertex), l->cage.face_size == 3,
                             level_2_at_vertex);
}

/* A face at a vertex of a level 2 that is remade, as rows have it. */
static inline void remake_quad(const tw_shallow_level *l, uint32_t vertex, float quad[4][3]) {
  const uint32_t *corners = l->cage.fan_corners + fan_begin(l, vertex);
  const uint32_t *edges = l->cage.ring_edges + fan_begin(l, vertex);
  const uint32_t sides[2][2] = {{corners[fan_size(l, vertex) - 1], corners[0]}, {corners[0], corners[1]}};
  memcpy(quad[0], at(l->remade, vertex), sizeof quad[0]);
  memcpy(quad[2], at(l->centres, corners[0]), sizeof quad[2]);
  for (size_t i = 0; i < 2; i++) {
    const float *one = at(l->vertices, vertex), *other = at(l->edges, edges[i]),
                *before = at(l->centres, sides[i][0]), *behind = at(l->centres, sides[i][1]);
    for (size_t c = 0; c < 3; c++)
      quad[1 + 2 * i][c] = 0.25f * (one[c] + other[c]) + 0.25f * (before[c] + behind[c]);
  }
}

/* ---- faces of the cage ---------------------------------------------------------------------- */

/* The nth corner of a face, and that before it. */
static inline size_t corner_at(const tw_shallow_level *l, size_t face, size_t n) {
  return (l->cage.face_offsets ? l->cage.face_offsets[face] : l->cage.face_size * face) + n;
}
static inline size_t corner_before(const tw_shallow_level *l, uint32_t face, uint32_t n) {
  return corner_at(l, face, n ? n : tw_face_size(&l->cage, face)) - 1;
}

static inline __attribute__((always_inline)) neighbour level_1_at_face(const tw_shallow_level *l,
                                                                       uint32_t face, uint32_t n) {
  return (neighbour){edge_at(l, corner_before(l, face, n)),
                     at(l->vertices, l->cage.corner_vertex[corner_at(l, face, n)])};
}
static inline __attribute__((always_inline)) neighbour level_2_at_face(const tw_shallow_level *l,
                                                                       uint32_t face, uint32_t n) {
  return (neighbour){at(l->spokes, corner_before(l, face, n)), at(l->centres, corner_at(l, face, n))};
}

static inline __attribute__((always_inline)) row face_row(const tw_shallow_level *l, uint32_t face,
                                                          neighbour_of *find) {
  const float *own = at(l->faces, face), *edges[3], *faces[3];
  if (l->cage.face_size != 3)
    return tangents_of_many(l, own, face, tw_face_size(&l->cage, face), false, find);
  for (uint32_t i = 0; i < 3; i++) {
    edges[i] = find(l, face, i).edge;
    faces[i] = find(l, face, i).face;
  }
  return tangents_of_three(l, own, edges, faces);
}

static inline __attribute__((always_inline)) void level_1_face(const tw_shallow_level *l, uint32_t face,
                                                               row *rows) {
  fetch_triangle(l, face);
  rows[0] = face_row(l, face, level_1_at_face);
}
static inline __attribute__((always_inline)) void level_2_face(const tw_shallow_level *l, uint32_t face,
                                                               row *rows) {
  rows[0] = face_row(l, face, level_2_at_face);
}

/* ---- edges of the cage ---------------------------------------------------------------------- */

static inline __attribute__((always_inline)) void level_1_middle(const tw_shallow_level *l, uint32_t edge,
                                                                 row *rows) {
  fetch_sides(l, edge, true, l->faces, NULL, true);
  const tw_topology *t = &l->cage;
  place one = place_of(l, t->edge_corner[edge]), other = place_of(l, t->sibling[one.corner]);
  rows[0] = tangents_of_four(
      at(l->edges, edge),
      (const float *const[4]){at(l->vertices, t->edge_vertices[edge][1]), at(l->faces, one.face),
                              at(l->vertices, t->edge_vertices[edge][0]), at(l->faces, other.face)},
      (const float *const[4]){edge_at(l, one.next), edge_at(l, one.previous), edge_at(l, other.next),
                              edge_at(l, other.previous)});
}

static inline __attribute__((always_inline)) void level_2_middle(const tw_shallow_level *l, uint32_t edge,
                                                                 row *rows) {
  fetch_sides(l, edge, false, l->spokes, l->centres, false);
  const tw_topology *t = &l->cage;
  place one = place_of(l, t->edge_corner[edge]), other = place_of(l, t->sibling[one.corner]);
  const float *half = at(l->halves, 2 * (size_t)edge);
  rows[0] = tangents_of_four(
      at(l->edges, edge),
      (const float *const[4]){half + 3, at(l->spokes, one.corner), half, at(l->spokes, other.corner)},
      (const float *const[4]){at(l->centres, one.next), at(l->centres, one.corner),
                              at(l->centres, other.next), at(l->centres, other.corner)});
}

/* Both halves of an edge, each along the quads of its two faces. The first face runs along the edge, the
 * second one against it. */
static inline __attribute__((always_inline)) void level_2_halves(const tw_shallow_level *l, uint32_t edge,
                                                                 row *rows) {
  fetch_sides(l, edge, true, l->spokes, l->centres, false);
  const tw_topology *t = &l->cage;
  place one = place_of(l, t->edge_corner[edge]), other = place_of(l, t->sibling[one.corner]);
  uint32_t start = t->edge_vertices[edge][0], end = t->edge_vertices[edge][1];
  const float *own = at(l->edges, edge), *half = at(l->halves, 2 * (size_t)edge),
              *left = at(l->spokes, one.corner), *right = at(l->spokes, other.corner);
  rows[0] = tangents_of_four(half,
                             (const float *const[4]){own, at(l->centres, one.corner), at(l->vertices, start),
                                                     at(l->centres, other.next)},
                             (const float *const[4]){left, half_at(l, t->corner_edge[one.previous], start),
                                                     half_at(l, t->corner_edge[other.next], start), right});
  rows[1] = tangents_of_four(half + 3,
                             (const float *const[4]){at(l->vertices, end), at(l->centres, one.next), own,
                                                     at(l->centres, other.corner)},
                             (const float *const[4]){half_at(l, t->corner_edge[one.next], end), left, right,
                                                     half_at(l, t->corner_edge[other.previous], end)});
}

/* ---- corners of the cage -------------------------------------------------------------------- */

static inline __attribute__((always_inline)) row spoke_row(const tw_shallow_level *l, place p) {
  return tangents_of_four(at(l->spokes, p.corner),
                          (const float *const[4]){at(l->faces, p.face), at(l->centres, p.corner),
                                                  edge_at(l, p.corner), at(l->centres, p.next)},
                          (const float *const[4]){at(l->spokes, p.previous), half_from(l, p.corner),
                                                  half_to(l, p.corner), at(l->spokes, p.next)});
}

static inline __attribute__((always_inline)) row centre_row(const tw_shallow_level *l, place p) {
  return tangents_of_four(at(l->centres, p.corner),
                          (const float *const[4]){half_from(l, p.corner), at(l->spokes, p.corner),
                                                  at(l->spokes, p.previous), half_to(l, p.previous)},
                          (const float *const[4]){edge_at(l, p.corner), at(l->faces, p.face),
                                                  edge_at(l, p.previous),
                                                  at(l->vertices, l->cage.corner_vertex[p.corner])});
}

static inline __attribute__((always_inline)) void level_2_spoke(const tw_shallow_level *l, uint32_t corner,
                                                                row *rows) {
  rows[0] = spoke_row(l, place_of(l, corner));
}
static inline __attribute__((always_inline)) void level_2_centre(const tw_shallow_level *l, uint32_t corner,
                                                                 row *rows) {
  rows[0] = centre_row(l, place_of(l, corner));
}

/* ---- items ---------------------------------------------------------------------------------- */

/* The rows of an item: of an edge, a face, a vertex, or of what lies at them. */
typedef void rows_of(const tw_shallow_level *l, uint32_t item, row *rows);

#endif
