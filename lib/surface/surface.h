/* The parts of a surface: fields and values. Private to lib/surface and lib/sculpt. */
#ifndef TWEEND_SURFACE_H
#define TWEEND_SURFACE_H

#include <stdatomic.h>
#include <string.h>

#include "level_detail.h"
#include "loop_rows.h"
#include "numbering.h"
#include "patch.h"
#include "shallow_levels.h"
#include "skin_weights.h"
#include "tweend/subdiv.h"

/* What computes rows and faces: evaluator.h. */
typedef struct tw_evaluator tw_evaluator;

enum { TW_BLOCK_ROWS = 256 }; /* rows that are assembled at once, but for patches */

/* A field: a connectivity with values on it. Field 0 is the points'; then each UV set has its own, in which
 * seams are borders, then each attribute with values of corners, unless it has the seams of a field before
 * it. All fields of a surface have the same faces in the same order. */
typedef struct tw_field {
  tw_topology base;   /* at the base level */
  tw_patches patches; /* with patches, else zeroed */
  bool linear;
  /* Of Loop's triangles: the faces whose values are kept, ascending. */
  uint32_t *kept_faces, kept_face_count;
} tw_field;

/* Values at the vertices of a field. */
typedef struct tw_values {
  uint32_t field, width;
  bool is_sloped; /* tangents are computed from it */
  /* Of whole numbers, which are never mixed: the value at each corner of the cage's faces, [cage
   * corners][width]; `cage` and `base` are not used. Else NULL. */
  float *at_corners;
  float *cage; /* [cage vertices][width]; only kept for level 0 */
  float *base; /* [base vertices][width] */
  /* Unrounded values, or NULL. Once the surface is made, of positions alone: those of the base where normals
   * are computed by limit masks or rows from triangles, and of Loop's rows those of the answer's level. */
  double *exact;
  /* Of Loop's triangles, else NULL: at all points of the field's kept faces, [kept_face_count]
   * [tw_lattice_points][width, of positions 3 more with normals]. */
  float *kept;
  /* Of shallow levels, else NULL: all values of the last level. points: as rows hold them. refined: as
   * normals and tangents are computed from them; a second array only where rows hold limits and such
   * derivatives are needed. */
  tw_point *points, *refined;
  /* Positions in `points` and `refined` are relative to it; not 0 where they are far from 0, as normals need
   * precise differences. */
  tw_point origin;
} tw_values;

/* The points' topology after one generic step from the cage towards the base. */
typedef struct tw_surface_step {
  tw_topology topology;
  const uint32_t *kept; /* the refined vertices that an open border leaves, ascending; NULL: all */
} tw_surface_step;

struct tw_surface {
  tw_surface_options options;
  tw_surface_counts counts;
  tw_surface_layout layout;
  tw_arena *arena;
  /* Holds the cage, the details and the steps' topologies; NULL when no longer needed. */
  tw_arena *points_arena;

  /* The surface whose memory this one borrows, except for positions and bounds; NULL: it owns all of its
   * memory. */
  const tw_surface *plan;

  /* What computing positions from the mesh's needs. Kept until positions are computed, and for good where the
   * surface is movable: */
  const uint32_t *point_of; /* [cage_vertex_count], NULL when all points are used */
  uint32_t step_count;
  tw_surface_step *steps; /* [step_count + 1], the first one is the cage */
  tw_detail_list details;
  uint32_t cage_vertex_count; /* always kept, as is `rules` */
  tw_rules rules;

  const tw_evaluator *evaluator;
  tw_shallow *levels; /* [field_count] */
  tw_shallow_rows level_rows;

  tw_topology loop_above; /* of Loop's rows: the topology of the level above them */

  uint32_t depth; /* levels between the base and the answer */
  uint32_t side;  /* cells along a patch: 1 << depth */

  tw_patch_classes *classes; /* the surface's own cache, where options.classes is NULL */

  uint32_t base_level; /* generic steps from the cage to the base */
  bool is_unmasked;    /* all values at rows are the cage's; the base has polygons of any size */
  /* [base faces] the number that each has where no border is cut off; NULL: its own. Only where there are
   * whole numbers. */
  uint32_t *origins;

  uint32_t field_count;
  tw_field *fields; /* [field_count], 0: points */
  tw_values positions, uvs[TW_UV_SETS_MAX];
  /* Other values: attributes, then displacements of morph targets, which follow the points' topology. */
  uint32_t attribute_count, morph_count;
  tw_values *smooth;        /* [attribute_count + morph_count] */
  tw_values *displacements; /* [morph_count] the part of `smooth` behind the attributes */

  /* Of skinned meshes; else zeroed. */
  tw_influences cage_influences; /* for level 0 only, where the base is not the cage */
  tw_influences influences;      /* at the base level */
  float *skin_rows; /* of all points of shallow levels: [tw_shallow_points][2 x influences]; else NULL */

  /* The tangent frame of each face, where the answer has tangents, else NULL: 2 x UV set, + 1 where its map
   * is mirrored. [faces of the base; of shallow levels those of the cage of `levels`] */
  uint8_t *tangent_frames;

  /* Where targets displace normals: for each target the surface over the positions it makes, whose rows hold
   * position and normal. NULL where no target displaces normals, and where level 0 has the mesh's own
   * normals. */
  tw_surface **morphed; /* [morph_count] */

  /* Of a level 0 with the mesh's own normals, else NULL. A vector 0 0 0 means none. */
  float *own_normals; /* [cage_vertices][3], unit */
  /* [cage_vertices][4], unit, w 1 or -1; NULL also where the mesh has no tangents. */
  float *own_tangents;
  /* [morph_count][cage_vertices][3]; NULL also where no target displaces normals. */
  float *own_morph_normals;

  /* Of the inner part of an answer that shrinks from an open border: the rim, whose rows come after this
   * part's own, and whose faces after those of each group. Its groups are as many as the answer's, with what
   * the rim has of each. NULL: there is but this part. */
  tw_surface *rim;
  /* Of a rim: [base faces] the face of the inner part's base that each comes of; UINT32_MAX: none, it is a
   * face of the rim. */
  uint32_t *inner_faces;

  uint32_t quad_count; /* visible quads of the base */
  uint32_t *quads;     /* [quad_count] base quads in group order; NULL: as in the base */
  uint32_t group_count;
  tw_surface_group *groups;

  tw_numbering points, uv_points, vertices; /* `vertices` may share the arrays of `points` */

  /* The visible cage faces in the order of the groups, for level 0 and shallow levels. face_first is NULL
   * at shallow levels where all faces are one group. Base corner cage_step * c is corner c of the cage. */
  uint32_t cage_step;
  uint32_t face_count;
  uint32_t *face_first;                                /* [face_count] first cage corner */
  uint64_t *corners_before;                            /* [face_count + 1] */
  uint32_t cage_points, cage_uv_points, cage_vertices; /* rows of each domain at level 0 */
  /* Of level 0: the faces that are no fan from their first corner, ascending; see tw_surface_get_cuts. */
  tw_face_cut *cuts;
  uint32_t cut_count;
  uint32_t (*cut_triangles)[3]; /* of all cuts */
  uint64_t cut_triangle_count;
  /* Of other levels of a cage with faces that are not surely convex, else NULL: [base faces] whether quads of
   * the face may be concave. */
  uint8_t *near_concave;
  /* Of a level 0 that was made `tagged`, else NULL. */
  tw_surface_tags *tags;

  atomic_int *bounds_ready; /* [tw_surface_bounds_count] */
  float (*bounds)[2][3];
  uint32_t scratch_points, mask_capacity;
};

/* The base quad at place `visible` in the order of the visible quads. */
static inline uint32_t tw_base_quad(const tw_surface *s, uint32_t visible) {
  return s->quads ? s->quads[visible] : visible;
}

/* Number of sets in `smooth`: attributes and displacements. */
static inline uint32_t tw_smooth_set_count(const tw_surface *s) {
  return s->attribute_count + s->morph_count;
}

/* ---- values --------------------------------------------------------------------------------- */

/* Positions as floats, for tw_free. NULL without memory. */
float *tw_surface_round_positions(const double *positions, size_t vertices);

/* Keeps the base's positions as floats and, where normals are computed by limit masks, as doubles too:
 * normals depend on small differences. As tw_evaluator.place. */
tw_status tw_surface_keep_base(tw_surface *s, double **base, const tw_parallel_for *parallel);

/* Computes the positions of a surface that has none yet. positions: [mesh point_count][3]. TW_NO_MEMORY,
 * TW_CANCELLED. */
tw_status tw_surface_place(tw_surface *surface, const float *positions, const tw_parallel_for *parallel);

/* Finds the faces of a cage below which quads may be concave. *is_near: [faces], which the caller frees;
 * NULL: all faces are surely convex and not folded against each other, so that quads of its levels are
 * convex, but for some in a million. points: [vertices][3]. O(corners). TW_NO_MEMORY. */
tw_status tw_cage_find_concave(const tw_topology *cage, const double *points, uint8_t **is_near);

/* Finds how the faces of level 0 are cut into triangles, once the surface has positions. O(corners), but for
 * polygons that are no fan from their first corner: see tw_ear_clipper_cut. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_surface_cut_faces(tw_surface *surface, const tw_parallel_for *parallel);

/* Sets `near_concave`. is_near: of the cage; NULL where that is the base itself, and not of triangles.
 * points: of the base, [vertices][3]. O(corners). TW_NO_MEMORY. */
tw_status tw_surface_find_concave(tw_surface *surface, const uint8_t *is_near, const double *points);

/* Number of bounds that a surface holds: its own of positions and, where it is no copy of a plan, one of each
 * target's displacements. */
static inline size_t tw_surface_bounds_count(const tw_surface *s) {
  return s->plan ? 1 : 1 + (size_t)s->morph_count;
}
tw_status tw_surface_start_bounds(tw_surface *surface); /* TW_NO_MEMORY */

/* Reduces the surface's rows to the position and, if asked for, the normal. */
void tw_surface_bare_rows(tw_surface *surface, bool normals);

/* Makes the surfaces from which displacements of normals are read (`morphed`). TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_surface_morph(tw_surface *surface, const tw_mesh *mesh, const tw_parallel_for *parallel);

/* Copies the rows of `size` bytes that `indices` lists; NULL: the first `count` rows. Where indices ascend,
 * out may be `in`. */
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

/* The number of groups of the mesh's faces where all faces are visible and already stand in the order of an
 * answer; else 0. */
uint32_t tw_ordered_groups(const tw_mesh *mesh, const uint8_t *visible);

/* Where a surface's faces come from. */
typedef struct tw_face_order {
  const tw_mesh *mesh;
  const uint8_t *visible; /* [faces of the mesh] */
  /* [base faces] face of the mesh of each. NULL: all faces are visible and, unless shallow levels read them
   * by `face_first`, in the order of the groups. */
  const uint32_t *sources;
  uint32_t levels;     /* levels from the mesh to the base */
  const uint8_t *part; /* [base faces] flags of those that there are; NULL: all. Only with sources */
} tw_face_order;

/* Sets the groups of a surface that has its base, and its quads or faces in their order. With an open border
 * that shrinks the mesh, `from` has sources or the mesh has one group. TW_NO_MEMORY. */
tw_status tw_surface_order(tw_surface *surface, const tw_face_order *from);

/* Whether a surface with these options has the mesh's own normals, at the corners of level 0. */
bool tw_has_own_normals(const tw_mesh *mesh, const tw_surface_options *options);
/* Whether they are normals of all corners: none is 0 0 0. */
bool tw_has_all_normals(const tw_mesh *mesh, const tw_surface_options *options);
typedef struct tw_own_normals {
  bool tangents, morphs; /* inputs: the answer has tangents; targets displace normals */
  uint32_t width;
  const float *rows; /* [mesh corners][width], unit: the normal and, where width is 7, the tangent */
  uint32_t *splits;  /* [base corners] value for tw_splits.own_normals */
  bool is_whole;     /* every corner has a normal */
} tw_own_normals;
/* Reads the mesh's normals for a surface that has its base. Arrays live in `arena`. TW_NO_MEMORY. */
tw_status tw_own_normals_read(const tw_surface *surface, const tw_mesh *mesh, tw_arena *arena,
                              tw_own_normals *own);
/* Stores the normals of the first `rows` vertices in the surface, once vertices are numbered.
 * TW_NO_MEMORY. */
tw_status tw_own_normals_keep(tw_surface *surface, const tw_mesh *mesh, const tw_own_normals *own,
                              uint32_t rows);

/* Where a face of a level of 1 or more is: in which part of the answer, at which place, and how many faces of
 * the answer from this one on are of that part. O(groups). */
typedef struct tw_face_place {
  const tw_surface *part;
  uint64_t place, run;
} tw_face_place;
tw_face_place tw_surface_face_place(const tw_surface *surface, uint64_t face);

/* As tw_surface_base_face, of shallow levels: the face of the cage of `levels`. */
uint32_t tw_surface_shallow_face(const tw_surface *surface, uint64_t face, uint64_t *run);

/* The face of the base that a face of a part comes of, at a level of 1 or more and not of Loop's rows. *run:
 * how many faces from this one on come of it. */
static inline uint32_t tw_surface_base_face(const tw_surface *part, uint64_t place, uint64_t *run) {
  if (part->levels) return tw_surface_shallow_face(part, place, run);
  uint64_t faces = (uint64_t)part->side * part->side;
  *run = faces - place % faces;
  return tw_base_quad(part, (uint32_t)(place / faces));
}

/* The place in `face_first` of the cage's face that a face of the answer comes of, where each corner of the
 * cage makes 1 << shift faces. O(log cage faces). */
uint32_t tw_surface_cage_place(const tw_surface *surface, uint64_t face, uint32_t shift);

/* Finds the vertex of each row of TW_DOMAIN_POINTS, as the surface's level numbers it when it is refined by
 * generic steps. level: the topology of that level. Not for open borders that shrink the mesh. out:
 * [rows]. */
void tw_surface_vertices_of_points(const tw_surface *surface, const tw_topology *level, uint32_t *out);

/* ---- whole numbers: nearest_corner.c ------------------------------------------------------------ */

/* The corner of the cage that is nearest to a corner of the base, among those of the cage's face. */
uint32_t tw_nearest_corner(const tw_surface *surface, uint32_t base_corner);

/* Writes values at points of a patch, placed as tw_patch_evaluate places them. */
void tw_nearest_values(const tw_surface *surface, const tw_values *values, uint32_t quad, tw_patch_rect rect,
                       bool backwards, float *out, uint32_t stride);

/* Fills in the values of all points of the last of the shallow levels. TW_NO_MEMORY. */
tw_status tw_nearest_fill(const tw_surface *surface, tw_values *values);

#endif
