/* Numbers of the rows of corners and edges. */
#ifndef TWEEND_NUMBERING_H
#define TWEEND_NUMBERING_H

#include "topology.h"
#include "tweend/mesh.h"

/* A numbering of the rows of visible faces: corners first, then the insides of edges, then the insides of
 * quads. Where all of a field is visible and nothing is split, the field's own numbers serve and no array is
 * stored. Else the arrays are indexed by corners of the base, and entries at invisible corners are
 * UINT32_MAX. */
typedef struct tw_numbering {
  uint32_t corner_count, edge_count;
  const tw_topology *same_as; /* the topology whose vertex and edge numbers these are, or NULL */
  uint32_t *corner_row;       /* [base corners] */
  /* [base corners] 2 x edge, + 1 when the edge's rows run against the corner. */
  uint32_t *edge_row;
  uint32_t *corner_base; /* [corner_count] the base corner that represents the row */
  /* [edge_count] the base corner whose edge represents the edge, in its direction. */
  uint32_t *edge_base;
} tw_numbering;

static inline uint32_t tw_row_of_corner(const tw_numbering *n, uint32_t corner) {
  return n->same_as ? n->same_as->corner_vertex[corner] : n->corner_row[corner];
}
static inline uint32_t tw_row_of_edge(const tw_numbering *n, uint32_t corner) {
  const tw_topology *t = n->same_as;
  if (!t) return n->edge_row[corner];
  uint32_t edge = t->corner_edge[corner];
  return 2 * edge + (t->edge_vertices[edge][0] != t->corner_vertex[corner]);
}
static inline uint32_t tw_corner_of_row(const tw_numbering *n, uint32_t row) {
  return n->same_as ? n->same_as->fan_corners[n->same_as->fan_offsets[row]] : n->corner_base[row];
}
static inline uint32_t tw_corner_of_edge(const tw_numbering *n, uint32_t edge) {
  return n->same_as ? n->same_as->edge_corner[edge] : n->edge_base[edge];
}

/* Numbers the vertices and edges that visible quads of one field use, in the field's order. visible NULL: all
 * quads are visible, and `base` has to outlive the numbering. TW_NO_MEMORY. */
tw_status tw_number_field(const tw_topology *base, const uint8_t *visible, tw_arena *arena,
                          tw_numbering *out);

/* Gives row i to vertices[i]; vertices: [rows], no vertex twice. Vertices that are not listed, edges and
 * insides get no rows. TW_NO_MEMORY. */
tw_status tw_number_vertices_as(const tw_topology *base, const uint32_t *vertices, uint32_t rows,
                                tw_arena *arena, tw_numbering *out);

/* What splits a point of the surface into several GPU vertices. */
typedef struct tw_splits {
  uint32_t channel_count;
  const tw_topology *channels[TW_CHANNELS_MAX]; /* splits where values of corners differ */
  bool normals;                                 /* splits at infinitely sharp edges */
  /* Edges of the base below this index count as sharp (bilinear surfaces), and with `sources`, [faces of the
   * base], those between faces of different sources (where an open border has cut the base). */
  uint32_t sharp_below;
  const uint32_t *sources;
  const uint8_t *tangent_frames; /* [faces of the base], or NULL: splits where tangent frames differ */
  const uint32_t *own_normals;   /* [corners of the base], or NULL: splits where values differ */
} tw_splits;

/* Numbers the vertices of a GPU: points split as `splits` says. TW_NO_MEMORY. */
tw_status tw_number_vertices(const tw_topology *base, const tw_splits *splits, const uint8_t *visible,
                             tw_arena *arena, tw_numbering *out);

/* Numbers corners alone, at the vertices chosen: [vertices] flags. Entries of other corners are undefined;
 * edges get no numbers. TW_NO_MEMORY. */
tw_status tw_number_corners(const tw_topology *base, const tw_splits *splits, const uint8_t *chosen,
                            tw_arena *arena, tw_numbering *out);

/* Whether the rows of vertices that are split among thousands can be read in a few seconds: each mask of a
 * row takes time in proportion to the faces at its vertex. masks: for each row. O(rows). */
bool tw_is_quickly_read(const tw_topology *base, const tw_numbering *numbering, uint32_t masks);

#endif
