/* Who touches whom in a polygon mesh: edges, siblings across edges, fans round vertices.
 *
 * A corner is a place of a vertex in a face, and stands as well for the half-edge from that vertex
 * to the next one of the face. Corners of a face are consecutive. `sibling` links the corners that
 * share an edge into a ring: the twin where the mesh is manifold, the corner itself on a border,
 * three and more where it is not manifold. A face that runs along an edge twice has two edges there, a border
 * each, and a vertex at which a face has two corners is not manifold. */
#ifndef TWEEND_TOPOLOGY_H
#define TWEEND_TOPOLOGY_H

#include "tweend/mesh.h"

enum {
  TW_EDGE_BORDER = 1,      /* one face */
  TW_EDGE_NONMANIFOLD = 2, /* more than two faces, or two that run along it in the same direction */
};

enum {
  TW_VERTEX_BORDER = 1,
  TW_VERTEX_NONMANIFOLD = 2, /* its faces do not form one fan: the fan arrays have no order */
};

/* All arrays live in the arena that built it. */
typedef struct tw_topology {
  uint32_t vertex_count, edge_count, face_count, corner_count;
  uint32_t face_size;           /* corners of every face, 3 or 4; 0 when they differ */
  bool smooth;                  /* known to have nothing sharp: no borders, creases, corners; manifold */
  const uint32_t *face_offsets; /* [face_count + 1]; NULL when face_size is set */

  uint32_t *corner_face;   /* [corner_count]; NULL when face_size is set */
  uint32_t *corner_vertex; /* [corner_count] */
  uint32_t *corner_edge;   /* [corner_count] edge from this corner to the next */
  uint32_t *sibling;       /* [corner_count] */

  uint32_t (*edge_vertices)[2]; /* [edge_count], in the direction of its first corner */
  uint32_t *edge_corner;        /* [edge_count] its first corner */
  float *edge_sharpness;        /* [edge_count], TW_SHARPNESS_INFINITE on borders */
  uint8_t *edge_flags;          /* [edge_count] */

  float *vertex_sharpness; /* [vertex_count] */
  uint8_t *vertex_flags;   /* [vertex_count] */

  /* Fans, counter-clockwise where the vertex is manifold: corner i lies between edges i and i + 1;
   * a border vertex has one edge more than corners and begins at its leading border edge. */
  uint32_t *fan_offsets, *fan_corners; /* [vertex_count + 1], [corner_count] */
  uint32_t *ring_offsets, *ring_edges; /* [vertex_count + 1], [2 edge_count] */

  /* Chaikin's rule: sum and number of the semi-sharp edges at each vertex; NULL for uniform creasing.
   * Kept apart from the edges because a cut-out piece of mesh lacks some of them. */
  float *semi_sum;
  uint32_t *semi_count;
} tw_topology;

/* Builds edges, siblings and fans of faces over `vertex_count` vertices. Sharpness is 0 everywhere
 * afterwards: tw_topology_soften and tw_topology_sharpen come next. The face arrays are kept, not copied.
 * Faces must be checked: indices in range, no vertex twice in a face. face_offsets NULL: all are triangles or
 * all are quads, as the counts tell. O(corners). TW_NO_MEMORY. */
tw_status tw_topology_build(tw_topology *topology, tw_arena *arena, uint32_t vertex_count,
                            uint32_t face_count, const uint32_t *face_offsets, uint32_t corner_count,
                            const uint32_t *corners);

/* The same, but for what is not needed to know the edges: there are no corner_edge, edge_vertices, flags of
 * vertices, fans and rings. Takes a third of the memory. */
tw_status tw_topology_pair(tw_topology *topology, tw_arena *arena, uint32_t vertex_count, uint32_t face_count,
                           const uint32_t *face_offsets, uint32_t corner_count, const uint32_t *corners);

/* Allocates the fan, ring and vertex flag arrays for the counts that are set. */
tw_status tw_topology_allocate_fans(tw_topology *topology, tw_arena *arena);

/* As tw_topology_build, of triangles or quads whose edges are known by a number: known_edges [face_size *
 * face_count], of the edge at each corner. Edges of different numbers stay apart even where they have the
 * same ends, as those inside of two triangles over the same points. */
tw_status tw_topology_build_parted(tw_topology *topology, tw_arena *arena, uint32_t vertex_count,
                                   uint32_t face_count, uint32_t face_size, const uint32_t *corners,
                                   const uint32_t *known_edges);

/* Allocates the sharpness arrays, zeroed. */
tw_status tw_topology_soften(tw_topology *topology, tw_arena *arena);

/* A mesh of some faces of another, with their tags' sharpness. face_offsets: [face_count + 1], or NULL where
 * all are of one size; then edges of the other mesh stay apart even where they have the same ends. from:
 * [corner_count] the corners of `full` that theirs are. *vertices: [out->vertex_count] the vertex of `full`
 * that each was, ascending. TW_NO_MEMORY. */
tw_status tw_topology_cut(const tw_topology *full, uint32_t face_count, const uint32_t *face_offsets,
                          uint32_t corner_count, const uint32_t *from, tw_arena *arena, tw_topology *out,
                          uint32_t **vertices);

/* OpenSubdiv's sharpening: border and non-manifold edges become infinitely sharp; vertices of one
 * face when `corners`; non-manifold vertices, save those on a plain non-manifold crease. */
void tw_topology_sharpen(tw_topology *topology, bool corners);

/* Sums for Chaikin's rule, after sharpening. */
tw_status tw_topology_sum_semi(tw_topology *topology, tw_arena *arena);

/* Takes the sums from a topology with the same faces over the same corners: a UV set sees only the edges
 * of its own side of a seam. */
tw_status tw_topology_copy_semi(tw_topology *topology, const tw_topology *from, tw_arena *arena);

/* Edge between two vertices of a topology that tw_topology_build or tw_topology_pair made, or UINT32_MAX.
 * O(log edges). */
uint32_t tw_topology_find_edge(const tw_topology *topology, uint32_t a, uint32_t b);

/* Whether one of some faces is at a vertex, or at an edge. faces: [face_count] flags, NULL for all. */
bool tw_topology_touches_vertex(const tw_topology *topology, const uint8_t *faces, uint32_t vertex);
bool tw_topology_touches_edge(const tw_topology *topology, const uint8_t *faces, uint32_t edge);

/* Whether some point of the smooth surface has more than one normal: at an edge between faces that is sharp
 * for ever, or where faces meet in a point alone. */
bool tw_topology_parts_normals(const tw_topology *topology);

static inline uint32_t tw_face_begin(const tw_topology *t, uint32_t face) {
  return t->face_offsets ? t->face_offsets[face] : t->face_size * face;
}
static inline uint32_t tw_face_size(const tw_topology *t, uint32_t face) {
  return t->face_offsets ? t->face_offsets[face + 1] - t->face_offsets[face] : t->face_size;
}
static inline bool tw_is_semi_sharp(float sharpness) {
  return sharpness > 0 && sharpness < TW_SHARPNESS_INFINITE;
}
static inline bool tw_is_infinite(float sharpness) {
  return sharpness >= TW_SHARPNESS_INFINITE;
}

static inline uint32_t tw_far_end(const tw_topology *t, uint32_t edge, uint32_t vertex) {
  return t->edge_vertices[edge][t->edge_vertices[edge][0] == vertex];
}

/* Where all faces are of one size, neighbours in the face need no look-up. */
static inline uint32_t tw_quad_next(uint32_t corner) {
  return (corner & ~3u) | ((corner + 1) & 3u);
}
static inline uint32_t tw_quad_previous(uint32_t corner) {
  return (corner & ~3u) | ((corner + 3) & 3u);
}
static inline uint32_t tw_triangle_next(uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}
static inline uint32_t tw_triangle_previous(uint32_t corner) {
  return corner % 3 == 0 ? corner + 2 : corner - 1;
}

static inline uint32_t tw_corner_face(const tw_topology *t, uint32_t corner) {
  if (t->face_size == 4) return corner / 4;
  return t->face_size == 3 ? corner / 3 : t->corner_face[corner];
}
static inline uint32_t tw_corner_next(const tw_topology *t, uint32_t corner) {
  if (t->face_size == 4) return tw_quad_next(corner);
  if (t->face_size == 3) return tw_triangle_next(corner);
  uint32_t face = t->corner_face[corner];
  return corner + 1 == t->face_offsets[face + 1] ? t->face_offsets[face] : corner + 1;
}
static inline uint32_t tw_corner_previous(const tw_topology *t, uint32_t corner) {
  if (t->face_size == 4) return tw_quad_previous(corner);
  if (t->face_size == 3) return tw_triangle_previous(corner);
  uint32_t face = t->corner_face[corner];
  return (corner == t->face_offsets[face] ? t->face_offsets[face + 1] : corner) - 1;
}

/* The two ends of an edge, also of a topology without edge_vertices (tw_topology_pair). */
static inline uint32_t tw_edge_start(const tw_topology *t, uint32_t edge) {
  return t->corner_vertex[t->edge_corner[edge]];
}
static inline uint32_t tw_edge_stop(const tw_topology *t, uint32_t edge) {
  return t->corner_vertex[tw_corner_next(t, t->edge_corner[edge])];
}

#endif
