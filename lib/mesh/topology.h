/* The connectivity of a polygon mesh: edges, siblings across edges, fans round vertices.
 *
 * A corner is a vertex's place in a face. It also stands for the half-edge from that vertex to the next one
 * of the face. Corners of a face are consecutive. `sibling` links the corners that share an edge into a ring:
 * in a manifold mesh the twin, on a border the corner itself, at a non-manifold edge three corners or more. A
 * face that runs along an edge twice has two edges there, each a border. A vertex at which one face has two
 * corners is not manifold. */
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

/* All arrays live in the arena it was built in, but for the face arrays, which are the caller's. */
typedef struct tw_topology {
  uint32_t vertex_count, edge_count, face_count, corner_count;
  uint32_t face_size;           /* corners of every face, 3 or 4; 0 when they differ */
  bool smooth;                  /* known to have nothing sharp: no borders, creases, corners; manifold */
  const uint32_t *face_offsets; /* [face_count + 1]; NULL when face_size is set */

  uint32_t *corner_face;   /* [corner_count]; NULL when face_size is set */
  uint32_t *corner_vertex; /* [corner_count] */
  uint32_t *corner_edge;   /* [corner_count] edge from this corner to the next */
  uint32_t *sibling;       /* [corner_count] */

  uint32_t (*edge_vertices)[2]; /* [edge_count] in the direction of edge_corner's half-edge */
  uint32_t *edge_corner;        /* [edge_count] first corner of the edge's ring of siblings */
  float *edge_sharpness;        /* [edge_count], TW_SHARPNESS_INFINITE on borders */
  uint8_t *edge_flags;          /* [edge_count] */

  float *vertex_sharpness; /* [vertex_count] */
  uint8_t *vertex_flags;   /* [vertex_count] */

  /* Fans. Where the vertex is manifold they run counter-clockwise, and corner i lies between edges i and i +
   * 1. A border vertex has one edge more than corners, and its fan begins at the leading border edge. */
  uint32_t *fan_offsets, *fan_corners; /* [vertex_count + 1], [corner_count] */
  uint32_t *ring_offsets, *ring_edges; /* [vertex_count + 1], [2 edge_count] */

  /* For Chaikin's rule: the sum and number of the semi-sharp edges at each vertex; NULL for uniform creasing.
   * Stored apart from the edges because a part cut out of a mesh lacks some of them. */
  float *semi_sum;
  uint32_t *semi_count;

  /* Limit masks (limit.h) are Catmull and Clark's over faces of any size, else over quads; of triangles they
   * are Loop's. Only without semi-sharp edges and vertices. */
  bool polygonal;
} tw_topology;

/* Builds edges, siblings and fans of faces over `vertex_count` vertices. The sharpness arrays are NULL
 * afterwards: tw_topology_soften and tw_topology_sharpen come next. The face arrays are kept, not copied.
 * Indices must be in range, and no face may have a vertex at two corners in a row. face_offsets NULL: all
 * faces are triangles or all are quads, as the counts tell. Linear but for sorting the edges of vertices that
 * have many. TW_NO_MEMORY. */
tw_status tw_topology_build(tw_topology *topology, tw_arena *arena, uint32_t vertex_count,
                            uint32_t face_count, const uint32_t *face_offsets, uint32_t corner_count,
                            const uint32_t *corners);

/* As tw_topology_build, but without corner_edge, edge_vertices, vertex flags, fans and rings. Takes a third
 * of the memory. */
tw_status tw_topology_pair(tw_topology *topology, tw_arena *arena, uint32_t vertex_count, uint32_t face_count,
                           const uint32_t *face_offsets, uint32_t corner_count, const uint32_t *corners);

/* Allocates the fan, ring and vertex flag arrays for the counts that are set. */
tw_status tw_topology_allocate_fans(tw_topology *topology, tw_arena *arena);

/* Allocates the sharpness arrays, zeroed. */
tw_status tw_topology_soften(tw_topology *topology, tw_arena *arena);

/* Cuts some faces out of a mesh, with the sharpness of their edges and vertices. face_offsets: [face_count +
 * 1]; or NULL where all faces are of full->face_size, and then edges of the full mesh stay apart even where
 * they have the same ends. from: [corner_count] for each new corner the corner of `full`. *vertices:
 * [out->vertex_count] the vertex of `full` for each new vertex, ascending. TW_NO_MEMORY. */
tw_status tw_topology_cut(const tw_topology *full, uint32_t face_count, const uint32_t *face_offsets,
                          uint32_t corner_count, const uint32_t *from, tw_arena *arena, tw_topology *out,
                          uint32_t **vertices);

/* Sharpens as OpenSubdiv does. Infinitely sharp become: border and non-manifold edges; with `corners`,
 * vertices of one face; and non-manifold vertices, except those on a plain non-manifold crease. */
void tw_topology_sharpen(tw_topology *topology, bool corners);

/* Fills the sums for Chaikin's rule; call it after sharpening. */
tw_status tw_topology_sum_semi(tw_topology *topology, tw_arena *arena);

/* Copies the sums from a topology with the same faces: by itself the topology of a UV set sees only the edges
 * on its own side of a seam. */
tw_status tw_topology_copy_semi(tw_topology *topology, const tw_topology *from, tw_arena *arena);

/* The edge between two vertices, or UINT32_MAX. Only for topologies from tw_topology_build or
 * tw_topology_pair. O(log edges). */
uint32_t tw_topology_find_edge(const tw_topology *topology, uint32_t a, uint32_t b);

/* Joins the vertices that edges connect. pieces: [vertex_count] receives disjoint sets (union_find.h). */
void tw_topology_find_pieces(const tw_topology *topology, uint32_t *pieces);

/* Whether any of some faces touches a vertex, or an edge. faces: [face_count] flags, NULL for all. */
bool tw_topology_touches_vertex(const tw_topology *topology, const uint8_t *faces, uint32_t vertex);
bool tw_topology_touches_edge(const tw_topology *topology, const uint8_t *faces, uint32_t edge);

/* Whether the limit surface has several normals at some point: at an infinitely sharp edge that is not a
 * border, or where faces meet only in a vertex. */
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

/* In a mesh of one face size the next and previous corner of a face need no look-up. */
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
