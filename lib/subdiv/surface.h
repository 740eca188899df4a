/* Inside of a surface: fields, numberings, and what binds them. */
#ifndef TWEEND_SURFACE_H
#define TWEEND_SURFACE_H

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "irregular_levels.h"
#include "level_detail.h"
#include "loop_rows.h"
#include "patch.h"
#include "skin_weights.h"
#include "tweend/subdiv.h"

/* A connectivity with the values that live on it: the points' own, or that of one UV set, in which
 * seams are borders. All fields of a surface have the same quads in the same order. */
typedef struct tw_field {
  tw_topology base;   /* at the base level */
  tw_patches patches; /* when levels are left below the base */
  bool linear;
} tw_field;

/* Values on the vertices of a field. */
typedef struct tw_values {
  uint32_t field, width;
  bool is_color; /* rows hold it from 0 to 1 */
  float *cage;   /* [cage vertices][width]; only kept for level 0 */
  float *base;   /* [base vertices][width] */
  /* Unrounded, else NULL: of positions the base, where normals are of limit masks, and all of the level of
   * Loop's rows. */
  double *exact;
  /* Of levels that are read whole, else NULL: all of the last level as rows hold them, and, of positions, as
   * normals are computed from them: the same unless rows hold limits. */
  tw_point *points, *refined;
  tw_point origin; /* that positions far from 0 are relative to there: normals live on differences */
} tw_values;

/* A numbering of everything that visible quads have: corners, then the insides of edges, then of quads.
 * Where all of a field is visible and nothing is split, its own numbers serve and nothing is stored;
 * else arrays by base corner, in which rows of invisible ones are UINT32_MAX. */
typedef struct tw_numbering {
  uint32_t corner_count, edge_count;
  const tw_topology *same_as; /* whose numbers these are, or NULL */
  uint32_t *corner_row;       /* [base corners] */
  uint32_t *edge_row;         /* [base corners] 2 x edge, + 1 when the numbering runs against the corner */
  uint32_t *corner_base;      /* [corner_count] a base corner that stands for it */
  uint32_t *edge_base;        /* [edge_count] a base corner whose edge stands for it, in its direction */
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

/* By what the rows and faces of a surface are computed. */
typedef enum tw_way {
  TW_WAY_BASE,    /* from the base itself: its values, and limit masks at its vertices */
  TW_WAY_PATCHES, /* patches of the base's quads */
  TW_WAY_LEVELS,  /* from all points of the last level; of the base only counts are there */
  TW_WAY_LOOP     /* from all points of the level, and what is above it; of the base only counts are there */
} tw_way;

/* The points' level after a generic step, on the way from the cage to the base. */
typedef struct tw_surface_step {
  tw_topology topology;
  const uint32_t *kept; /* vertices of those refined that an open border leaves, ascending; NULL: all */
} tw_surface_step;

struct tw_surface {
  tw_surface_options options;
  tw_surface_counts counts;
  tw_surface_layout layout;
  tw_arena *arena;
  tw_arena *points_arena; /* the cage, details and the steps' topologies; NULL where nothing needs them */

  /* From whose memory everything but positions and bounds is borrowed; NULL: all is its own. */
  const tw_surface *plan;

  /* How positions come from the mesh to the base. Until there are some, and where it is movable: */
  const uint32_t *point_of; /* [cage_vertex_count], NULL when all points are used */
  uint32_t step_count;
  tw_surface_step *steps; /* [step_count + 1], the first is the cage */
  tw_detail_list details;
  uint32_t cage_vertex_count; /* and at any time these */
  tw_rules rules;

  tw_way way;
  tw_levels *levels; /* [field_count] */
  tw_level_rows level_rows;

  tw_topology loop_above; /* of TW_WAY_LOOP: the level above the rows */

  uint32_t depth; /* levels between the base and the answer */
  uint32_t side;  /* cells along a patch: 1 << depth */

  tw_patch_shapes *shapes; /* its own, where it shares none */

  uint32_t field_count;
  tw_field fields[1 + TW_UV_SETS_MAX]; /* 0: points */
  tw_values positions, uvs[TW_UV_SETS_MAX];
  /* Other values of the points: attributes, then displacements of morph targets. */
  uint32_t attribute_count, morph_count;
  tw_values *smooth; /* [attribute_count + morph_count] */

  /* Of skinned meshes; else zeroed. */
  tw_influences cage_influences; /* only for level 0, unless the base is the cage */
  tw_influences influences;      /* at the base level */
  tw_skin_row *skin_rows;        /* of all points where levels are read whole, else NULL */

  /* Where the answer has tangents, else NULL. [faces of the base, or of the cage of levels]: 2 x UV set, + 1
   * where its map is mirrored. */
  uint8_t *tangent_frames;

  /* Where targets displace normals: the surface that each makes, whose rows hold position and normal. NULL
   * where they do not, and with normals of its own. */
  tw_surface **morphed; /* [morph_count] */

  /* Of a level 0 with normals of its own, else NULL; 0 0 0 for none. */
  float *own_normals;       /* [cage_vertices][3], unit */
  float *own_tangents;      /* [cage_vertices][4], unit, w 1 or -1; NULL also where the mesh has none */
  float *own_morph_normals; /* [morph_count][cage_vertices][3]; NULL also where no target displaces them */

  uint32_t quad_count; /* visible ones */
  uint32_t *quads;     /* [quad_count] base quads, groups together */
  uint32_t group_count;
  tw_surface_group *groups;

  tw_numbering points, uv_points, vertices; /* vertices may share the arrays of points */

  /* Level 0: the visible cage faces in the order of the groups. Base corner cage_step x c stands for corner
   * c of the cage. */
  uint32_t cage_step;
  uint32_t face_count;
  uint32_t *face_first;                                /* [face_count] first cage corner */
  uint64_t *corners_before;                            /* [face_count + 1] */
  uint32_t cage_points, cage_uv_points, cage_vertices; /* rows of each domain at level 0 */
  tw_surface_tags *tags;                               /* where a level 0 keeps them, else NULL */

  atomic_int *bounds_ready; /* [tw_surface_bounds_count] */
  float (*bounds)[2][3];
  uint32_t scratch_points, mask_capacity;
};

/* Base quad of the nth visible one. */
static inline uint32_t tw_base_quad(const tw_surface *s, uint32_t visible) {
  return s->quads ? s->quads[visible] : visible;
}

/* Attributes and displacements. */
static inline uint32_t tw_smooth_set_count(const tw_surface *s) {
  return s->attribute_count + s->morph_count;
}

/* ---- values --------------------------------------------------------------------------------- */

/* Of TW_WAY_LEVELS: all points of the level from the base's values. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_levels_fill(const tw_surface *surface, const tw_parallel_for *parallel, tw_values *values);

/* Positions, of all points of the mesh, for a surface that has none. Errors likewise. */
tw_status tw_surface_place(tw_surface *surface, const float *positions, const tw_parallel_for *parallel);
void tw_surface_free_positions(tw_surface *surface);
size_t tw_surface_positions_size(const tw_surface *surface);

static inline void tw_values_free_points(tw_values *values) {
  if (values->points != values->refined) free(values->points);
  free(values->refined);
}
static inline size_t tw_values_points_size(const tw_surface *s, const tw_values *values) {
  size_t size = values->refined ? tw_levels_points(&s->levels[values->field]) * sizeof *values->points : 0;
  return values->points != values->refined ? 2 * size : size;
}

/* Bounds of positions, which each surface has its own of, and of displacements, which its plan has. */
static inline size_t tw_surface_bounds_count(const tw_surface *s) {
  return s->plan ? 1 : 1 + (size_t)s->morph_count;
}
tw_status tw_surface_start_bounds(tw_surface *surface); /* TW_NO_MEMORY */

/* Leaves the position in its rows, and the normal where that is wanted. */
void tw_surface_bare_rows(tw_surface *surface, bool normals);

/* Makes what its targets' normals are read from; TW_NO_MEMORY. */
tw_status tw_surface_morph(tw_surface *surface, const tw_mesh *mesh, const tw_parallel_for *parallel);

/* Some rows of `size` bytes, the first ones where indices is NULL. Ascending indices may be gathered in
 * place. */
static inline void tw_gather_rows(const void *in, const uint32_t *indices, uint32_t count, size_t size,
                                  void *out) {
  if (!indices && count > 0) memcpy(out, in, count * size);
  for (uint32_t i = 0; indices && i < count; i++)
    memmove((char *)out + i * size, (const char *)in + indices[i] * size, size);
}

static inline void *tw_arena_gather(tw_arena *arena, const void *in, const uint32_t *indices, uint32_t count,
                                    size_t size) {
  void *out = tw_arena_alloc_raw(arena, count, size);
  if (out) tw_gather_rows(in, indices, count, size, out);
  return out;
}

/* ---- numbers -------------------------------------------------------------------------------- */

/* How many groups the mesh's faces make where all are visible and stand in the order of an answer; else 0. */
uint32_t tw_ordered_groups(const tw_mesh *mesh, const uint8_t *visible);

/* What a surface's faces come from. */
typedef struct tw_face_order {
  const tw_mesh *mesh;
  const uint8_t *visible;  /* [faces of the mesh] */
  const uint32_t *sources; /* [base faces] face of the mesh; NULL: they stand as tw_ordered_groups found */
  uint32_t levels;         /* from the mesh to the base */
} tw_face_order;

/* Fills groups, and quads or faces, of a surface with its base. With an open border that eats into the mesh
 * there are sources, or one group. TW_NO_MEMORY. */
tw_status tw_surface_order(tw_surface *surface, const tw_face_order *from);

/* Numbers the vertices and edges that visible quads of one field use, in the field's order. visible NULL:
 * all are; `base` then has to outlive the numbering. */
tw_status tw_number_field(const tw_topology *base, const uint8_t *visible, tw_arena *arena,
                          tw_numbering *out);

/* Numbers the vertices of one field by these rows: vertices[row], each once. Others have no row, edges and
 * insides neither. TW_NO_MEMORY. */
tw_status tw_number_vertices_as(const tw_topology *base, const uint32_t *vertices, uint32_t rows,
                                tw_arena *arena, tw_numbering *out);

/* What parts the vertices of a GPU that are one point of the surface. */
typedef struct tw_splits {
  uint32_t uv_count;
  const tw_topology *uv_bases[TW_UV_SETS_MAX]; /* other UVs */
  bool normals;                                /* the other side of a sharp edge */
  uint32_t sharp_below;          /* edges of the base with a lower index are sharp whatever their sharpness
                                    (bilinear surfaces) */
  const uint8_t *tangent_frames; /* [faces] of the base, or NULL: other tangents */
  const uint32_t *own_normals;   /* [corners] of the base, or NULL: other values */
} tw_splits;

/* The normals that the mesh itself has at the corners of a level 0. */
bool tw_has_own_normals(const tw_mesh *mesh, const tw_surface_options *options);
typedef struct tw_own_normals {
  bool tangents, morphs; /* whether the answer has tangents, and targets that displace normals */
  uint32_t width;
  const float *rows; /* [mesh corners][width], unit: the normal, then the tangent where the mesh has them */
  uint32_t *splits;  /* [base corners] how they split the vertices */
  bool is_whole;     /* every corner has a normal */
} tw_own_normals;
/* Of a surface that has its base; lives in `arena`. TW_NO_MEMORY. */
tw_status tw_own_normals_read(const tw_surface *surface, const tw_mesh *mesh, tw_arena *arena,
                              tw_own_normals *own);
/* Keeps them for the first `rows` vertices, once these are numbered. TW_NO_MEMORY. */
tw_status tw_own_normals_keep(tw_surface *surface, const tw_mesh *mesh, const tw_own_normals *own,
                              uint32_t rows);

/* The vertex of each row of TW_DOMAIN_POINTS, in the numbers of the surface's level refined step by step,
 * whose topology `level` is. Not with an open border. out: [rows]. */
void tw_surface_vertices_of_points(const tw_surface *surface, const tw_topology *level, uint32_t *out);

/* Numbers what a GPU has to tell apart. */
tw_status tw_number_vertices(const tw_topology *base, const tw_splits *splits, const uint8_t *visible,
                             tw_arena *arena, tw_numbering *out);

/* Corners alone, those at some vertices; chosen: [vertices]. What is not of them means nothing. */
tw_status tw_number_corners(const tw_topology *base, const tw_splits *splits, const uint8_t *chosen,
                            tw_arena *arena, tw_numbering *out);

/* The connectivity of a UV set of a cage, sharpened by the interpolation rule. cage: the points'
 * topology, sharpened.
 * *values_of: [topology vertices], index of the value of each. */
tw_status tw_uv_topology(const tw_topology *cage, const tw_uv_set *set, tw_uv_rule rule, tw_arena *arena,
                         tw_topology *out, uint32_t **values_of);

#endif
