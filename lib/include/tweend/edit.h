/* Edits of a control mesh: an ordered list of them makes another mesh. */
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
  TW_SELECT_NOTHING, /* the edit does not say */
  TW_SELECT_LIST,
  TW_SELECT_ALL,
  TW_SELECT_GROUP,    /* faces in the named group */
  TW_SELECT_MATERIAL, /* faces */
  TW_SELECT_FACING,   /* faces whose normal is within an angle of a direction */
  TW_SELECT_INSIDE,   /* elements whose points are all in a box, its sides included */
  TW_SELECT_MADE,     /* what an earlier edit made, edges: those that were cut or are rims */
  TW_SELECT_BORDER,   /* edges of one face */
  TW_SELECT_LOOP,   /* edges one behind the other, straight on over vertices of four edges; along a border */
  TW_SELECT_RING,   /* edges side by side, over the quads between them */
  TW_SELECT_SHARPER /* edges of two faces that are bent by more than an angle */
} tw_select;

/* A view. Fields that `by` does not need are ignored. */
typedef struct tw_selection {
  tw_edit_element of;
  tw_select by;
  uint32_t count;
  /* LIST: [count] faces or vertices; edges: [count][2] vertices. LOOP, RING: [1][2], an edge. */
  const uint32_t *indices;
  const char *name; /* GROUP, MADE; MATERIAL, or NULL there: by its index */
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

/* What each edit does stands at its parameters; those without any need a selection alone. `all` below: the
 * whole mesh where the selection is TW_SELECT_NOTHING. New faces and points come after those that stay; a
 * face that is cut leaves its first part in its place. */

/* Moves faces away from the others, with walls between: all as one (so that two neighbours have no wall
 * between them), or each. A vertex goes along the mean normal of the faces that move, so far that the
 * faces get by `distance` (at most 4 distances, where they meet in a point), or by `by`. Made: the faces
 * that moved; edges: their rim. */
typedef struct tw_extrude_edit {
  bool is_individual, has_by;
  double distance, by[3];
} tw_extrude_edit;

/* Rims of `amount` inside of faces; faces that share an edge keep it, unless each is on its own. A rim
 * lies in the faces. Made: the inner faces; edges: their rim. */
typedef struct tw_inset_edit {
  bool is_individual;
  double amount;
} tw_inset_edit;

/* Cuts every quad of the ring through `edge`, as TW_SELECT_RING finds it. The selection is not used.
 * at: [cuts] ascending, between 0 and 1, from edge[0] to edge[1]; NULL: evenly. Made: the new points,
 * the pieces of faces, the new edges but those along the ring's. */
typedef struct tw_loop_cut_edit {
  uint32_t edge[2], cuts;
  const double *at;
} tw_loop_cut_edit;

/* Cuts edges, or all edges of faces, evenly. A triangle or quad that is cut all round becomes triangles
 * or quads, a face that is cut at two edges is cut across; any other has more corners. Made: new points,
 * and the parts of faces; edges: the parts of those that were cut. */
typedef struct tw_subdivide_edit {
  uint32_t cuts;
} tw_subdivide_edit;

/* Makes one of vertices: of those within `distance` of a first one (0: at one place) when it is 0 or
 * more; else of all: at `to`, or else at their mean. A face that this leaves with fewer than three points
 * goes. */
typedef struct tw_merge_edit {
  double distance;
  bool has_to;
  double to[3];
} tw_merge_edit;

/* Closes the hole at an edge of one face, or else every hole of at most max_edges edges (0: any): by a
 * face; by the triangles of the least area (of a hole of more than 512 edges, or of many in a small mesh,
 * those of its halves); or FAIR, by triangles as large as those round the hole, bent as the mesh is. The
 * selection is not used. Made: the faces and new points. */
typedef struct tw_fill_edit {
  bool has_border;
  uint32_t border[2], max_edges;
  tw_fill_method method;
} tw_fill_edit;

/* Adds the mirror image, x, y or z (0, 1, 2) times -1. A point that lies nearer to the plane than `weld`
 * (negative: none) goes onto it and is its own image; a face all of whose points do, goes. The selection
 * is not used. Made: the images. */
typedef struct tw_mirror_edit {
  int axis;
  double weld;
} tw_mirror_edit;

typedef struct tw_move_edit {
  double by[3];
} tw_move_edit;

typedef struct tw_rotate_edit {
  double axis[3]; /* of any length but 0 */
  double degrees; /* counter-clockwise seen from the axis's end */
  bool has_about;
  double about[3]; /* else the mean of the vertices */
} tw_rotate_edit;

typedef struct tw_scale_edit {
  double by[3];
  bool has_about;
  double about[3]; /* as of rotate */
} tw_scale_edit;

/* Drops pieces of fewer than `faces` faces, and their points; pieces have no point in common. The
 * selection is not used. Made: nothing. */
typedef struct tw_drop_pieces_edit {
  uint32_t faces;
} tw_drop_pieces_edit;

/* (all) Moves points of three neighbours or more that are farther from the middle of their neighbours
 * than `factor`, above 0, times the distance of these from it, between the neighbours that are not. Made:
 * the points that it moved. */
typedef struct tw_despike_edit {
  double factor;
} tw_despike_edit;

/* (all) Moves points towards the mean of their neighbours; those on a border stay. TAUBIN keeps the
 * volume, LAPLACIAN shrinks. */
typedef struct tw_smooth_edit {
  tw_smooth_method method;
  uint32_t iterations; /* 1 to TW_EDIT_ITERATIONS_MAX */
} tw_smooth_edit;

typedef struct tw_edit {
  tw_edit_kind kind;
  tw_selection selection;
  bool is_optional; /* an empty selection does nothing; else it is an error */
  const char *name; /* of what the edit makes, for later ones; NULL: none. The last of equal names wins. */
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
    /* CREASE (edges), CORNER (vertices), HOLE (faces; any but 0 makes one): 0 takes the tag away. */
    double sharpness;
    tw_drop_pieces_edit drop_pieces;
    tw_despike_edit despike;
    tw_smooth_edit smooth;
  };
  /* DELETE: faces; or edges and vertices, with the faces at them. Points that this leaves without a face go.
   * FLIP (all): turns faces round. ORIENT (all, faces): turns faces round so that neighbours run alike, and
   * pieces that are closed face outward; others as most of the faces did. TRIANGULATE (all): quads along the
   * shorter diagonal inside, larger faces from their ears. QUADS (all): joins pairs of triangles. */
} tw_edit;

/* Of every mesh on the way. */
typedef struct tw_edit_limits {
  uint64_t points, faces, corners;
  /* The sum of points and corners of the meshes that the edits find, once more for ten rounds of smoothing.
   */
  uint64_t work;
  /* Asked between edits, rounds of smoothing, holes and steps of filling these whether the result is still
   * wanted; or NULL. */
  const tw_parallel_for *parallel;
} tw_edit_limits;

/* What an edit with a name made, as the finished mesh has it. */
typedef struct tw_made {
  const char *name;
  uint32_t face_count, vertex_count;
  const uint32_t *faces, *vertices; /* ascending */
} tw_made;

/* Applies edits one after the other; the indices of each are those of the mesh that it finds.
 * mesh: checked. What is not of its points and faces (names, kept, loose, morph_weights, normals) is shared
 * with *out. model: whose groups and materials the mesh's faces are in, only its names are read; NULL: of
 * none. *out: a checked mesh in the arena; a view of `mesh` where there are no edits. UVs, groups, materials,
 * smoothing, creases, corners, holes, attributes, skin weights and morph targets go along; normals go where
 * an edit is more than a tag.
 * made: [edit_count] at most, in the arena, or NULL; *made_count.
 * Each edit is O(n log n) in what it finds and leaves. On failure the pointer is relative to the list of
 * edits ("/3/edge", "/3/faces/2"): TW_INVALID: an edit that cannot be done; TW_LIMIT, with the counts that
 * there would be; TW_UNSUPPORTED; TW_CANCELLED; TW_NO_MEMORY. Any thread. */
tw_status tw_mesh_edit(const tw_mesh *mesh, const tw_model *model, const tw_edit *edits, uint32_t edit_count,
                       const tw_edit_limits *limits, tw_arena *arena, tw_mesh *out, tw_made *made,
                       uint32_t *made_count, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
