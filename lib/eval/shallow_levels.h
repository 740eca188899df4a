/* Levels 1 to 3 of cages of any faces, refined whole: all points of the requested level are kept. Rows and
 * faces follow from these points and from the cage's connectivity by the arithmetic in catmull_clark.h.
 *
 * Each point of a level is the child of a face, of an edge or of a vertex, and each class has one loop. The
 * loops treat every vertex as smooth and interior to a manifold. Exceptions (borders, creases, corners,
 * vertices of two faces, non-manifold vertices, UV seams) are listed with their generic masks when the plan
 * is made; after each loop their points are recomputed from the list. */
#ifndef TWEEND_SHALLOW_LEVELS_H
#define TWEEND_SHALLOW_LEVELS_H

#include "child.h"
#include "limit.h"
#include "simd.h"
#include "tweend/subdiv.h"

enum { TW_SHALLOW_MAX = 3, TW_FIELDS_MAX = 1 + TW_CHANNELS_MAX };

/* The connectivity of one level of one field. The last level has counts only. */
typedef struct tw_shallow_level {
  uint32_t vertex_count, edge_count, face_count, corner_count;
  uint32_t face_size;            /* 3 or 4; 0 where faces differ */
  const uint32_t *face_offsets;  /* [face_count + 1]; NULL where face_size is set */
  const uint32_t *corner_face;   /* [corner_count]; NULL where face_size is set */
  const uint32_t *corner_vertex; /* [corner_count] */
  /* [corner_count] the half of the corner's edge at the corner: 2 x edge, + 1 where the corner runs against
   * the edge */
  const uint32_t *corner_half;
  const uint32_t (*edge_corners)[2]; /* [edge_count] a corner that runs along the edge, one that runs against
                                        it; the same corner twice on a border */
} tw_shallow_level;

/* Corner arithmetic on a level that has tables. size: the level's face_size; a compile-time constant in the
 * loops. */
static inline __attribute__((always_inline)) uint32_t tw_shallow_corner_face(const tw_shallow_level *l,
                                                                             uint32_t size, uint32_t c) {
  return size == 4 ? c / 4 : size == 3 ? c / 3 : l->corner_face[c];
}
static inline __attribute__((always_inline)) uint32_t tw_shallow_face_begin(const tw_shallow_level *l,
                                                                            uint32_t size, uint32_t f) {
  return size ? size * f : l->face_offsets[f];
}
static inline __attribute__((always_inline)) uint32_t tw_shallow_face_end(const tw_shallow_level *l,
                                                                          uint32_t size, uint32_t f) {
  return size ? size * f + size : l->face_offsets[f + 1];
}
/* The triangle case has no branch, because it could not be predicted. */
static inline __attribute__((always_inline)) uint32_t tw_shallow_corner_next(const tw_shallow_level *l,
                                                                             uint32_t size, uint32_t c) {
  if (size == 4) return tw_quad_next(c);
  if (size == 3) return c + 1 - 3 * (uint32_t)(c % 3 == 2);
  uint32_t face = l->corner_face[c];
  return c + 1 == l->face_offsets[face + 1] ? l->face_offsets[face] : c + 1;
}
static inline __attribute__((always_inline)) uint32_t tw_shallow_corner_previous(const tw_shallow_level *l,
                                                                                 uint32_t size, uint32_t c) {
  if (size == 4) return tw_quad_previous(c);
  if (size == 3) return c - 1 + 3 * (uint32_t)(c % 3 == 0);
  uint32_t face = l->corner_face[c];
  return c == l->face_offsets[face] ? l->face_offsets[face + 1] - 1 : c - 1;
}

/* Vertices of a child level that are computed by generic masks. Shares are those of child.h, in the numbers
 * of the whole level. */
typedef struct tw_shallow_masks {
  uint32_t count;
  uint32_t *vertices, *first; /* [count], [count + 1] */
  tw_share *shares;
} tw_shallow_masks;

/* Vertices of the last level whose limits are computed by generic limit masks, in the numbers of the level.
 * Entries of weight 0 are left out. */
typedef struct tw_shallow_limits {
  uint32_t count;
  uint32_t *vertices, *first; /* [count], [count + 1] */
  tw_limit_entry *entries;
} tw_shallow_limits;

/* The levels of one field: the points, a UV set or an attribute of corners, both called a channel. */
typedef struct tw_shallow {
  uint32_t level;
  bool linear; /* new values are plain averages */
  tw_shallow_level at[TW_SHALLOW_MAX + 1];
  const uint32_t *fan_offsets, *fan_corners; /* the cage's fans */
  /* Tangent weights of smooth vertices by valence n: n weights of the neighbours along edges, then n of those
   * across faces. Present where normals are asked for. */
  const uint32_t *weights_of; /* [greatest valence of any field + 1] first weight of each valence */
  const float *weights;
  tw_shallow_masks masks[TW_SHALLOW_MAX]; /* exceptions of each step */
  tw_shallow_limits limits;               /* exceptions of the limits, where limits are asked for */
  /* Of a channel with seams: its vertex and edge at each of the points' cage vertices and edges that lie on
   * no seam. Edges are 2 x edge, + 1 where the channel's edge runs the other way. NULL: the channel has the
   * points' numbers. */
  const uint32_t *vertex_of, *edge_of;
} tw_shallow;

/* A mask of derivatives: entries `first` to `end`, and the frame of tw_slope_frame. */
typedef struct tw_shallow_slope_mask {
  uint32_t first, end;
  float frame[2][2];
} tw_shallow_slope_mask;

/* The vertex-buffer rows that the loops get wrong, ascending. Row i below the point count is the row of point
 * i; the further rows of split points follow. */
typedef struct tw_shallow_rows {
  uint32_t row_count; /* all rows, exceptions or not */
  uint32_t count;
  uint32_t *rows, *points;                       /* [count] */
  uint32_t *channels[TW_CHANNELS_MAX];           /* [count] the row's vertex in each channel */
  uint32_t *first_entry, *end_entry, (*quad)[4]; /* [count] with normals: the range of the tangent mask in
                                                    `entries`, and the vertices of a face at the point */
  /* Where tangents are asked for: each row's tangent frame (see tw_shallow_inputs), and its derivatives, of
   * the points and of the frame's UV set. */
  uint8_t *frames;                    /* [count] */
  tw_shallow_slope_mask (*slopes)[2]; /* [count] */
  tw_limit_entry *entries;            /* rows of a point share masks where these are the same */
  uint32_t corner_count;
  uint32_t *corners, *corner_rows; /* [corner_count] corners of the last level whose row is not that of their
                                      point, ascending, and their rows */
} tw_shallow_rows;

/* What a plan is made from. fields: the topologies of the cage, sharpened; fields[0] is the points'. */
typedef struct tw_shallow_inputs {
  uint32_t level, field_count;
  const tw_topology *fields[TW_FIELDS_MAX];
  bool linear[TW_FIELDS_MAX];
  tw_rules rules;
  bool limit, normals;
  const uint8_t *frames; /* tangent frames, or NULL: [cage faces] 2 x UV set, + 1 where its map is mirrored */
  const tw_parallel_for *parallel;
  uint64_t exceptions_max; /* bytes that exceptions may take */
  bool *is_large;          /* set where they take more */
} tw_shallow_inputs;

/* Whether all valences and face sizes are low enough for tables by valence: 4,096 at most. */
bool tw_shallow_fit(const tw_topology *cage);

/* Makes the connectivity, the weights and the lists of exceptions. out: [field_count]; arrays live in
 * `arena`. TW_LIMIT where exceptions take more than exceptions_max (*is_large) or take too long to read;
 * TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_shallow_plan(const tw_shallow_inputs *inputs, tw_arena *arena, tw_shallow *out,
                          tw_shallow_rows *rows);

/* Lists the exceptions: the last part of tw_shallow_plan, with its errors. */
tw_status tw_shallow_list_exceptions(const tw_shallow_inputs *inputs, tw_arena *arena, tw_shallow *out,
                                     tw_shallow_rows *rows);

static inline uint32_t tw_shallow_points(const tw_shallow *levels) {
  return levels->at[levels->level].vertex_count;
}

/* Refines the points of the cage to those of the last level. out: [tw_shallow_points]. TW_NO_MEMORY,
 * TW_CANCELLED. */
tw_status tw_shallow_refine(const tw_shallow *levels, const tw_point *cage, const tw_parallel_for *parallel,
                            tw_point *out);

/* The limits of the last level's points. out: [tw_shallow_points]. */
void tw_shallow_limit(const tw_shallow *levels, const tw_point *points, const tw_parallel_for *parallel,
                      tw_point *out);

/* The points of the last level that rows are made from. */
typedef struct tw_shallow_positions {
  const tw_point *refined;   /* relative to `origin` */
  const tw_point *positions; /* the refined points or their limits, relative to `origin` */
  tw_point origin;
} tw_shallow_positions;

/* Rows of the points [first, first + count): position, then unit normal of the limit surface. Rows are
 * `stride` floats apart. The normals of rows listed in `tw_shallow_rows` are invalid. */
void tw_shallow_normals(const tw_shallow *levels, const tw_shallow_positions *points, uint32_t first,
                        uint32_t count, uint32_t stride, float *out);

/* Derivatives at vertices [first, first + count), along two directions and at a scale that all fields share.
 * points: the field's points. Derivatives at vertices listed in `tw_shallow_rows` are invalid. out:
 * [count][2]. */
void tw_shallow_slopes(const tw_shallow *levels, const tw_point *points, uint32_t first, uint32_t count,
                       tw_point *out);

/* Derivatives at the nth listed row: of the points and of the UV set of its tangent frame. */
void tw_shallow_row_slopes(const tw_shallow_rows *rows, uint32_t n, const tw_point *points,
                           const tw_point *uvs, tw_point points_out[2], tw_point uvs_out[2]);

/* The unit normal of the nth listed row. */
void tw_shallow_row_normal(const tw_shallow_rows *rows, uint32_t n, const tw_point *points, float normal[3]);

/* The channel's vertices at points [first, first + count). Those at points listed in `tw_shallow_rows` are
 * invalid. */
void tw_shallow_channel_vertices(const tw_shallow *points, const tw_shallow *channel, uint32_t first,
                                 uint32_t count, uint32_t *out);

/* For each of vertices [first, first + count) of the last level, a cage face that has it. */
void tw_shallow_cage_faces(const tw_shallow *levels, uint32_t first, uint32_t count, uint32_t *out);

/* Corners of faces [first, first + count). out: [count][4]. */
void tw_shallow_faces(const tw_shallow *levels, uint32_t first, uint32_t count, uint32_t *out);

#endif
