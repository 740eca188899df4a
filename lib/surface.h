/* Inside of a surface: fields, numberings, and what binds them. */
#ifndef TWEEND_SURFACE_H
#define TWEEND_SURFACE_H

#include <stdatomic.h>

#include "patch.h"
#include "refine.h"
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
  float *cage; /* [cage vertices][width]; only kept for level 0 */
  float *base; /* [base vertices][width] */
} tw_values;

/* A numbering of everything that visible quads have: corners, then the insides of edges, then of
 * quads. Arrays are by base corner; rows of invisible ones are UINT32_MAX. */
typedef struct tw_numbering {
  uint32_t corner_count, edge_count;
  uint32_t *corner_row;  /* [base corners] */
  uint32_t *edge_row;    /* [base corners] 2 x edge, + 1 when the numbering runs against the corner */
  uint32_t *corner_base; /* [corner_count] a base corner that stands for it */
  uint32_t *edge_base;   /* [edge_count] a base corner whose edge stands for it, in its direction */
} tw_numbering;

struct tw_surface {
  tw_surface_options options;
  tw_surface_counts counts;
  tw_surface_layout layout;
  tw_arena *arena;

  uint32_t depth; /* levels between the base and the answer */
  uint32_t side;  /* cells along a patch: 1 << depth */

  uint32_t field_count;
  tw_field fields[1 + TW_UV_SETS_MAX]; /* 0: points */
  tw_values positions, uvs[TW_UV_SETS_MAX], colors;
  uint32_t morph_count;
  tw_values *morphs;

  uint32_t quad_count; /* visible ones */
  uint32_t *quads;     /* [quad_count] base quads, materials together */
  uint32_t group_count;
  tw_surface_group *groups;

  tw_numbering points, uv_points, vertices; /* vertices may share the arrays of points */

  /* Level 0: the visible cage faces in the order of the groups, as runs of base corners (quad c of the
   * base stands for corner c of the cage). */
  uint32_t face_count;
  uint32_t *face_first;                                /* [face_count] first cage corner */
  uint64_t *corners_before;                            /* [face_count + 1] */
  uint32_t cage_points, cage_uv_points, cage_vertices; /* rows of each domain at level 0 */

  atomic_int *bounds_ready; /* [1 + morph_count] */
  float (*bounds)[2][3];
  uint32_t scratch_points, mask_capacity;
};

/* Numbers the vertices and edges that visible quads of one field use, in the field's order. */
tw_status tw_number_field(const tw_topology *base, const uint8_t *visible, tw_arena *arena,
                          tw_numbering *out);

/* Numbers what a GPU has to tell apart: corners with the same point, the same UVs and, when
 * split_normals, on the same side of every sharp edge. uv_bases: [uv_count]. sharp_below: edges of
 * the base with a lower index are sharp whatever their sharpness (bilinear surfaces). */
tw_status tw_number_vertices(const tw_topology *base, const tw_topology *const *uv_bases, uint32_t uv_count,
                             const uint8_t *visible, bool split_normals, uint32_t sharp_below,
                             tw_arena *arena, tw_numbering *out);

/* The connectivity of a UV set of a cage, sharpened by the interpolation rule. cage: the points'
 * topology, sharpened.
 * *values_of: [topology vertices], index of the value of each. */
tw_status tw_uv_topology(const tw_topology *cage, const tw_uv_set *set, tw_uv_rule rule, tw_arena *arena,
                         tw_topology *out, uint32_t **values_of);

#endif
