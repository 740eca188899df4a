/* Levels 1 to 3 of cages of any faces, refined whole: the points of the level asked for are kept, and rows
 * and faces follow from them and from the cage's connectivity by the arithmetic that catmull_clark.h tells
 * of.
 *
 * Each point of a level is the child of a face, of an edge or of a vertex, and each class has one loop. The
 * loops treat every vertex as smooth and interior to a manifold. Exceptions (borders, creases, corners,
 * vertices of two faces, non-manifold places, UV seams) are listed with their generic masks when the plan is
 * made, and recomputed from the list. */
#ifndef TWEEND_IRREGULAR_LEVELS_H
#define TWEEND_IRREGULAR_LEVELS_H

#include "child.h"
#include "limit.h"
#include "simd.h"

enum { TW_LEVELS_MAX = 3 };

/* One level of one field. The last level has no arrays. */
typedef struct tw_level {
  uint32_t vertex_count, edge_count, face_count, corner_count;
  uint32_t face_size;            /* 3 or 4; 0 where faces differ */
  const uint32_t *face_offsets;  /* [face_count + 1]; NULL where face_size is set */
  const uint32_t *corner_face;   /* [corner_count]; likewise */
  const uint32_t *corner_vertex; /* [corner_count] */
  /* [corner_count] 2 x edge, + 1 where the corner runs against it: the half of the edge at the corner */
  const uint32_t *corner_half;
  const uint32_t (*edge_corners)[2]; /* [edge_count] one that runs along it, one against it */
} tw_level;

/* Corners of a level with tables. size: that of the level's faces, where the compiler knows it. */
static inline __attribute__((always_inline)) uint32_t tw_level_corner_face(const tw_level *l, uint32_t size,
                                                                           uint32_t c) {
  return size == 4 ? c / 4 : size == 3 ? c / 3 : l->corner_face[c];
}
static inline __attribute__((always_inline)) uint32_t tw_level_face_begin(const tw_level *l, uint32_t size,
                                                                          uint32_t f) {
  return size ? size * f : l->face_offsets[f];
}
static inline __attribute__((always_inline)) uint32_t tw_level_face_end(const tw_level *l, uint32_t size,
                                                                        uint32_t f) {
  return size ? size * f + size : l->face_offsets[f + 1];
}
/* Of triangles without a branch, which nothing could predict. */
static inline __attribute__((always_inline)) uint32_t tw_level_corner_next(const tw_level *l, uint32_t size,
                                                                           uint32_t c) {
  if (size == 4) return tw_quad_next(c);
  if (size == 3) return c + 1 - 3 * (uint32_t)(c % 3 == 2);
  uint32_t face = l->corner_face[c];
  return c + 1 == l->face_offsets[face + 1] ? l->face_offsets[face] : c + 1;
}
static inline __attribute__((always_inline)) uint32_t tw_level_corner_previous(const tw_level *l,
                                                                               uint32_t size, uint32_t c) {
  if (size == 4) return tw_quad_previous(c);
  if (size == 3) return c - 1 + 3 * (uint32_t)(c % 3 == 0);
  uint32_t face = l->corner_face[c];
  return c == l->face_offsets[face] ? l->face_offsets[face + 1] - 1 : c - 1;
}

/* Vertices of a child by the generic masks. Shares are those of child.h. */
typedef struct tw_level_masks {
  uint32_t count;
  uint32_t *vertices, *first; /* [count], [count + 1] */
  tw_share *shares;
} tw_level_masks;

/* Vertices of the last level by limit masks; entries without a weight are left out. */
typedef struct tw_level_limits {
  uint32_t count;
  uint32_t *vertices, *first; /* [count], [count + 1] */
  tw_limit_entry *entries;
} tw_level_limits;

/* A field: the points, or a UV set. */
typedef struct tw_levels {
  uint32_t level;
  bool linear; /* new values are plain averages */
  tw_level at[TW_LEVELS_MAX + 1];
  const uint32_t *fan_offsets, *fan_corners; /* of the cage */
  /* Tangents of smooth vertices by valence: n weights of neighbours along edges, then n across faces. Where
   * normals are asked for. */
  const uint32_t *weights_of; /* [greatest valence of any field + 1] */
  const float *weights;
  tw_level_masks masks[TW_LEVELS_MAX]; /* of each step */
  tw_level_limits limits;              /* where limits are asked for */
  /* Of a UV set with seams: of the cage's vertices and edges, as far as they are on none; 2 x edge, + 1 where
   * it runs the other way. NULL: numbers are those of the points. */
  const uint32_t *vertex_of, *edge_of;
} tw_levels;

/* Vertex-buffer rows that the loops get wrong, ascending. Row i below the point count is that of point i;
 * further rows of split points follow. */
typedef struct tw_level_rows {
  uint32_t row_count; /* all */
  uint32_t count;
  uint32_t *rows, *points;                       /* [count] */
  uint32_t *uvs[TW_UV_SETS_MAX];                 /* [count] vertex of each UV set */
  uint32_t *first_entry, *end_entry, (*quad)[4]; /* [count] tangents, and a face of the point; with normals */
  /* Where tangents are asked for: the frame, and derivative masks: entries slopes[0] to [1] of points, to
   * [2] of the frame's UV set. */
  uint8_t *frames;       /* [count] */
  uint32_t (*slopes)[3]; /* [count] */
  tw_limit_entry *entries;
  uint32_t corner_count;
  uint32_t *corners, *corner_rows; /* [corner_count] corners of the last level whose row is not their point */
} tw_level_rows;

/* What a plan is made from. fields: of the cage, sharpened; [0] the points. */
typedef struct tw_levels_inputs {
  uint32_t level, field_count;
  const tw_topology *fields[1 + TW_UV_SETS_MAX];
  bool linear[1 + TW_UV_SETS_MAX];
  tw_rules rules;
  bool limit, normals;
  const uint8_t *frames; /* of tangents, or NULL: [cage faces] 2 x UV set, + 1 where its map is mirrored */
  const tw_parallel_for *parallel;
} tw_levels_inputs;

/* Whether all valences and face sizes are low enough for tables by valence: 4,096 at most. */
bool tw_levels_fit(const tw_topology *cage);

/* out: [field_count]; lives in `arena`. TW_NO_MEMORY. */
tw_status tw_levels_plan(const tw_levels_inputs *inputs, tw_arena *arena, tw_levels *out,
                         tw_level_rows *rows);

/* Lists all that is not smooth: the last part of tw_levels_plan. */
tw_status tw_levels_list_exceptions(const tw_levels_inputs *inputs, tw_arena *arena, tw_levels *out,
                                    tw_level_rows *rows);

static inline uint32_t tw_levels_points(const tw_levels *levels) {
  return levels->at[levels->level].vertex_count;
}

/* Points of the last level from those of the cage. out: [tw_levels_points]. TW_NO_MEMORY. */
tw_status tw_levels_refine(const tw_levels *levels, const tw_point *cage, const tw_parallel_for *parallel,
                           tw_point *out);

/* Their limits. out: [tw_levels_points]. */
void tw_levels_limit(const tw_levels *levels, const tw_point *points, const tw_parallel_for *parallel,
                     tw_point *out);

/* Points of the last level as rows are made of them. */
typedef struct tw_level_points {
  const tw_point *refined;   /* relative to `origin` */
  const tw_point *positions; /* the same, or their limits */
  tw_point origin;
} tw_level_points;

/* Rows [first, first + count) of the points: position, then unit normal of the limit surface, `stride` floats
 * apart. Those of `tw_level_rows` mean nothing. */
void tw_levels_normals(const tw_levels *levels, const tw_level_points *points, uint32_t first, uint32_t count,
                       uint32_t stride, float *out);

/* Derivatives at vertices [first, first + count), along two directions and at a scale that all fields share.
 * points: of the field. Values at points of `tw_level_rows` are invalid. out: [count][2]. */
void tw_levels_slopes(const tw_levels *levels, const tw_point *points, uint32_t first, uint32_t count,
                      tw_point *out);

/* Derivatives at the nth listed row: of the points and of its frame's UV set. */
void tw_levels_row_slopes(const tw_level_rows *rows, uint32_t n, const tw_point *points, const tw_point *uvs,
                          tw_point points_out[2], tw_point uvs_out[2]);

/* The normal of the nth of the rows. */
void tw_levels_row_normal(const tw_level_rows *rows, uint32_t n, const tw_point *points, float normal[3]);

/* Vertices [first, first + count) of a UV set from those of the points; those of `rows` mean nothing. */
void tw_levels_uv_vertices(const tw_levels *points, const tw_levels *set, uint32_t first, uint32_t count,
                           uint32_t *out);

/* For each of vertices [first, first + count) of the last level, a cage face that has it. */
void tw_levels_cage_faces(const tw_levels *levels, uint32_t first, uint32_t count, uint32_t *out);

/* Corners of faces [first, first + count). out: [count][4]. */
void tw_levels_faces(const tw_levels *levels, uint32_t first, uint32_t count, uint32_t *out);

#endif
