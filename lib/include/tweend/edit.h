/* Edits of a control mesh: an ordered list of edits makes a new mesh. */
#ifndef TWEEND_EDIT_H
#define TWEEND_EDIT_H

#include "tweend/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The most new points that one edit may make along an edge. */
enum { TW_EDIT_CUTS_MAX = 10000 };
/* The most times that one edit may smooth a mesh. */
enum { TW_EDIT_ITERATIONS_MAX = 100 };

typedef enum tw_edit_element { TW_EDIT_FACES, TW_EDIT_EDGES, TW_EDIT_VERTICES } tw_edit_element;
extern const char *const tw_edit_element_names[3]; /* "faces", "edges", "vertices" */

typedef enum tw_select {
  TW_SELECT_NOTHING, /* the edit has no selection */
  TW_SELECT_LIST,
  TW_SELECT_ALL,
  TW_SELECT_GROUP,    /* faces in the named group */
  TW_SELECT_MATERIAL, /* faces */
  TW_SELECT_FACING,   /* faces whose normal is within an angle of a direction */
  TW_SELECT_INSIDE,   /* elements whose points are all in a box, its sides included */
  TW_SELECT_MADE,     /* what an earlier edit made; edges: those that were cut, or are rims */
  TW_SELECT_BORDER,   /* edges of one face */
  TW_SELECT_LOOP,     /* edges end to end, straight across vertices of four edges, or along a border */
  TW_SELECT_RING,     /* edges side by side, across the quads between them */
  TW_SELECT_SHARPER   /* edges of two faces whose normals differ by more than an angle */
} tw_select;

/* A view. Fields that `by` does not need are ignored. */
typedef struct tw_selection {
  tw_edit_element of;
  tw_select by;
  uint32_t count;
  /* LIST: [count] faces or vertices, or [count][2] vertices for edges. LOOP, RING: [1][2], an edge. */
  const uint32_t *indices;
  const char *name; /* GROUP, MADE, MATERIAL; MATERIAL uses the index below where it is NULL */
  uint32_t material;
  double direction[3];   /* FACING, of any length but 0 */
  double degrees;        /* FACING, SHARPER: 0 to 180 */
  double min[3], max[3]; /* INSIDE */
} tw_selection;

typedef enum tw_edit_kind {
  TW_EDIT_EXTRUDE,
  TW_EDIT_INSET,
  TW_EDIT_LOOP_CUT,
  TW_EDIT_SUBDIVIDE,
  TW_EDIT_DELETE,
  TW_EDIT_MERGE,
  TW_EDIT_FILL,
  TW_EDIT_MIRROR,
  TW_EDIT_MOVE,
  TW_EDIT_ROTATE,
  TW_EDIT_SCALE,
  TW_EDIT_CREASE,
  TW_EDIT_CORNER,
  TW_EDIT_HOLE,
  TW_EDIT_FLIP,
  TW_EDIT_ORIENT,
  TW_EDIT_TRIANGULATE,
  TW_EDIT_QUADS,
  TW_EDIT_DROP_PIECES,
  TW_EDIT_DESPIKE,
  TW_EDIT_SMOOTH
} tw_edit_kind;
enum { TW_EDIT_KINDS = TW_EDIT_SMOOTH + 1 };
extern const char *const tw_edit_names[TW_EDIT_KINDS]; /* "extrude", "inset", "loop_cut", ... */

typedef enum tw_fill_method { TW_FILL_NGON, TW_FILL_TRIANGLES, TW_FILL_FAIR } tw_fill_method;
typedef enum tw_smooth_method { TW_SMOOTH_TAUBIN, TW_SMOOTH_LAPLACIAN } tw_smooth_method;

/* The parameters of each edit say what the edit does; edits without parameters are described at the end of
 * tw_edit. "(all)" marks an edit that applies to the whole mesh where the selection is TW_SELECT_NOTHING. New
 * faces and points come after those that stay. A face that is cut leaves its first part in its place. */

/* Moves the selected faces away from the others and adds walls in the gap. They move together, without walls
 * between neighbours, or each on its own. A vertex moves by `by`; or else so that its moving faces move by
 * `distance`: exactly where they are of up to three planes, else in the mean, along the mean normal (but at
 * most 4 distances, where they meet in a point). Made: the faces that moved; edges: their rim. */
typedef struct tw_extrude_edit {
  bool is_individual, has_by;
  double distance, by[3];
} tw_extrude_edit;

/* Insets the selected faces by `amount`, with a rim of new faces round them in the plane of each face. Faces
 * that share an edge are inset together, unless is_individual. Made: the inner faces; edges: their rim. */
typedef struct tw_inset_edit {
  bool is_individual;
  double amount;
} tw_inset_edit;

/* Cuts every quad of the ring through `edge`, as TW_SELECT_RING finds it. The selection is not used. at:
 * [cuts] fractions between 0 and 1, ascending, from edge[0] to edge[1]; NULL: evenly spaced. Made: the new
 * points, the parts of cut faces, and the new edges across them, not the parts of the ring's edges. */
typedef struct tw_loop_cut_edit {
  uint32_t edge[2], cuts;
  const double *at;
} tw_loop_cut_edit;

/* Cuts the selected edges, or all edges of the selected faces, evenly. A triangle or quad whose edges are all
 * cut becomes triangles or quads. A face with two cut edges is cut across. Any other face gets more corners.
 * Made: the new points and the parts of faces; edges: the parts of cut edges. */
typedef struct tw_subdivide_edit {
  uint32_t cuts;
} tw_subdivide_edit;

/* Merges vertices. With a `distance` of 0 or more: each with those within that distance of the first of them
 * (0: at the same place), whose joints and displacements stay. With a negative one: all into one, at `to`, or
 * else at their mean. Faces left with fewer than three points are removed. */
typedef struct tw_merge_edit {
  double distance;
  bool has_to;
  double to[3];
} tw_merge_edit;

/* Closes the hole at an edge of one face, or else every hole; always only holes of at most max_edges edges
 * (0: any). NGON: by one face. TRIANGLES: by the triangles of least area; a hole of more than 512 edges, or
 * one of many in a small mesh, is halved first. FAIR: by triangles as large as those round the hole, curved
 * as the mesh is. The selection is not used. Made: the faces and new points. */
typedef struct tw_fill_edit {
  bool has_border;
  uint32_t border[2], max_edges;
  tw_fill_method method;
} tw_fill_edit;

/* Adds the mirror image of the mesh, with x, y or z (axis 0, 1, 2) negated. A point within `weld` of the
 * plane (negative: none) moves onto it and is its own image; a face whose points are all on the plane is
 * removed. Displacements of such a point stay in the plane. The selection is not used. Made: the images. */
typedef struct tw_mirror_edit {
  int axis;
  double weld;
} tw_mirror_edit;

typedef struct tw_move_edit {
  double by[3];
} tw_move_edit;

typedef struct tw_rotate_edit {
  double axis[3]; /* of any length but 0 */
  double degrees; /* counter-clockwise seen from the axis's tip */
  bool has_about;
  double about[3]; /* used with has_about; else the mean of the vertices */
} tw_rotate_edit;

typedef struct tw_scale_edit {
  double by[3];
  bool has_about;
  double about[3]; /* as in rotate */
} tw_scale_edit;

/* Removes pieces of fewer than `faces` faces, with their points; pieces have no common point. The selection
 * is not used. Made: nothing. */
typedef struct tw_drop_pieces_edit {
  uint32_t faces;
} tw_drop_pieces_edit;

/* (all) Moves spikes back among their neighbours. A spike is a point with three neighbours or more whose
 * distance from their middle exceeds `factor` (above 0) times the neighbours' own median distance from it.
 * Made: the points that moved. */
typedef struct tw_despike_edit {
  double factor;
} tw_despike_edit;

/* (all) Moves points towards the mean of their neighbours; points on a border stay. LAPLACIAN shrinks. TAUBIN
 * about keeps the volume of closed meshes as fine as scans; a coarse cage collapses. */
typedef struct tw_smooth_edit {
  tw_smooth_method method;
  uint32_t iterations; /* 1 to TW_EDIT_ITERATIONS_MAX */
} tw_smooth_edit;

typedef struct tw_edit {
  tw_edit_kind kind;
  tw_selection selection;
  bool is_optional; /* an empty selection does nothing instead of being an error */
  const char *name; /* names what the edit makes, for later edits; or NULL. The last of equal names counts. */
  union {
    tw_extrude_edit extrude;
    tw_inset_edit inset;
    tw_loop_cut_edit loop_cut;
    tw_subdivide_edit subdivide;
    tw_merge_edit merge;
    tw_fill_edit fill;
    tw_mirror_edit mirror;
    tw_move_edit move;
    tw_rotate_edit rotate;
    tw_scale_edit scale;
    /* CREASE (edges), CORNER (vertices), HOLE (faces; any value but 0 tags them). 0 removes the tag. */
    double sharpness;
    tw_drop_pieces_edit drop_pieces;
    tw_despike_edit despike;
    tw_smooth_edit smooth;
  };
  /* Edits without parameters:
   * DELETE: removes the selected faces, or the selected edges or vertices with their faces, and points left
   * without a face.
   * FLIP (all): reverses faces.
   * ORIENT (all, faces): reverses faces so that neighbours are wound alike, and closed pieces face outward;
   * other pieces face as most of their faces did.
   * TRIANGULATE (all): cuts quads along the shorter diagonal that lies inside, and larger faces by ear
   * clipping.
   * QUADS (all): joins pairs of triangles. */
} tw_edit;

/* Limits on every intermediate mesh. */
typedef struct tw_edit_limits {
  uint64_t points, faces, corners;
  /* The limit on the sum of points and corners of the meshes that the edits find, counted once more for each
   * ten rounds of smoothing; and for each edit, four for each earlier name and the elements that it names. */
  uint64_t work;
  /* Asked between edits, rounds of smoothing, holes and steps of filling them whether the result is still
   * wanted; or NULL. */
  const tw_parallel_for *parallel;
} tw_edit_limits;

/* What a named edit made, by indices of the finished mesh. */
typedef struct tw_made {
  const char *name;
  uint32_t face_count, vertex_count;
  const uint32_t *faces, *vertices; /* ascending */
} tw_made;

/* What edits take from the mesh without anybody asking for it. */
typedef struct tw_edit_losses {
  /* Points that a merge within a distance joined with one of other joints, weights or displacements: they
   * have that one's. */
  uint64_t bent;
  /* Points on the plane of a mirror whose displacements led off it: that part is 0, or the two sides would
   * cross or part there. */
  uint64_t flattened;
} tw_edit_losses;

/* Applies edits one after the other; the indices in each edit are those of the mesh that it finds.
 * mesh: checked. Data that belongs to neither points nor faces (names, kept, loose, morph_weights, normals)
 * is shared with *out. model: the model of the mesh, read for the names of groups and materials only; NULL:
 * there are none. *out: a checked mesh in the arena; with no edits a view of `mesh`. UVs, groups, materials,
 * smoothing groups, creases, corners, holes, attributes, skin weights and morph targets follow the edits.
 * Normals are dropped by every edit that does more than tag.
 * made: room for [edit_count], its arrays in the arena; or NULL. *made_count: how many are filled.
 * *losses: those of all edits together; or NULL.
 * Each edit is O(n log n) in the size of the meshes it finds and leaves. On failure the pointer is relative
 * to the list of edits ("/3/edge", "/3/faces/2"). TW_INVALID: an edit that cannot be done; TW_LIMIT, with the
 * counts that there would be; TW_CANCELLED; TW_NO_MEMORY. Any thread. */
tw_status tw_mesh_edit(const tw_mesh *mesh, const tw_model *model, const tw_edit *edits, uint32_t edit_count,
                       const tw_edit_limits *limits, tw_arena *arena, tw_mesh *out, tw_made *made,
                       uint32_t *made_count, tw_edit_losses *losses, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
