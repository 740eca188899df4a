/* The mesh that a list of edits works on, and the change that one edit makes to it.
 *
 * An edit reads the mesh and its topology, describes the new points and faces in terms of the old ones
 * (tw_change), and tw_editor_apply makes the new mesh. Each new point or face corner is an old one or a
 * weighted mean of old ones, and so inherits all data of points and corners. */
#ifndef TWEEND_EDITOR_H
#define TWEEND_EDITOR_H

#include "hard_edges.h"
#include "parallel_for.h"
#include "topology.h"
#include "tweend/edit.h"
#include "vector3.h"

/* What a named edit made; later edits keep it up to date. */
typedef struct tw_named {
  const char *name;
  tw_arena *arena; /* holds the lists; NULL: that of the mesh does */
  uint32_t face_count, point_count, edge_count;
  uint32_t *faces, *points; /* ascending */
  uint32_t (*edges)[2];     /* [edge_count] the two points of each */
} tw_named;

/* Work for holes: triangles compared, steps of fairing counted for each point, and points of fair patches. */
typedef struct tw_hole_work {
  uint64_t triangles, steps, points;
} tw_hole_work;

/* The mesh, its topology and names live in `arena`, which each change of points or faces replaces. What an
 * edit needs besides lives in `scratch`, which each edit and each such change replaces. */
typedef struct tw_editor {
  tw_mesh mesh;
  tw_arena *arena, *scratch;
  tw_arena
      *tags[3];  /* creases, corners and holes that edits have changed since the arena is there; or NULL */
  bool is_loose; /* the positions are the arena's, and may be written */
  bool has_loose_targets; /* so are the displacements of morph targets */
  tw_topology *topology;  /* of the mesh; NULL until tw_editor_need_topology */
  const tw_model *model;  /* or NULL */
  const tw_edit_limits *limits;
  const tw_edit *edit; /* the current edit */
  uint32_t index;      /* the current edit's index */
  uint32_t named_count;
  tw_named *named;        /* room for one for each edit; malloc'ed, as it outlives arenas */
  bool is_named;          /* the current edit's name has been given to what it made */
  tw_hole_work hole_work; /* done so far */
  tw_edit_losses losses;
  tw_error *error;
} tw_editor;

tw_status tw_editor_no_memory(const tw_editor *editor);
/* Fills the error. place: the pointer relative to the edit ("/faces/2"). */
tw_status tw_editor_fail(const tw_editor *editor, tw_status status, const char *place, const char *format,
                         ...) TW_PRINTF(4, 5);

/* TW_CANCELLED, with the error filled, where the result is no longer wanted. */
tw_status tw_editor_go_on(const tw_editor *editor);

/* Builds the topology if there is none yet. O(corners). TW_NO_MEMORY. */
tw_status tw_editor_need_topology(tw_editor *editor);

/* ---- the change ------------------------------------------------------------------------------ */

enum {
  TW_CHANGE_NEW = 1, /* a face that is not part of its parent and only gets its material and groups */
  TW_CHANGE_MADE = 2 /* belongs to what the edit's name refers to */
};

typedef struct tw_term {
  uint32_t index; /* an old point or corner */
  double weight;
} tw_term;

/* Upper bounds on the elements of a change. */
typedef struct tw_change_size {
  uint64_t points, faces, corners;
  uint64_t mixes, terms; /* those of points and those of corners together */
} tw_change_size;

/* A change in the making. "Old" elements are those of the editor's mesh. The parent of a point or corner is
 * an old index, or the count of old points or corners plus the number of a mix. */
typedef struct tw_change {
  const tw_editor *editor;
  uint32_t point_count, face_count, corner_count, mix_count, term_count;
  uint32_t *point_parents;  /* [point_count] */
  uint8_t *point_flags;     /* [point_count] MADE */
  uint32_t *face_offsets;   /* [face_count + 1] */
  uint32_t *face_parents;   /* [face_count] old faces */
  uint8_t *face_flags;      /* [face_count] */
  uint32_t *corners;        /* [corner_count] new points */
  uint32_t *corner_parents; /* [corner_count] */
  uint32_t *corner_edges;   /* [corner_count] the old edge that the new edge after the corner is part of, or
                               UINT32_MAX; creases follow it */
  uint8_t *corner_flags;    /* [corner_count] MADE: of the edge after the corner */
  uint32_t *mix_offsets;    /* [mix_count + 1] */
  tw_term *terms;           /* [term_count] */
  double (*shifts)[3];      /* [point_count] displacement of each new point, or NULL */
  const uint32_t *joins;    /* [old point_count] the new point that has each old one's place, or UINT32_MAX;
                               NULL: no points are merged. Sharpness and names follow it */
} tw_change;

/* Checks the size against the limits and allocates. The editor must have its topology. TW_LIMIT,
 * TW_NO_MEMORY. */
tw_status tw_change_init(tw_change *change, const tw_editor *editor, const tw_change_size *size);

/* Adds a mean of old points or of old corners, with weights that sum to 1, and returns its number. At one new
 * point, means of corners have the same texture coordinate if their first terms had the same one and their
 * last terms too. */
uint32_t tw_change_mix(tw_change *change, const tw_term *terms, uint32_t count);
/* Adds a point and returns it. */
uint32_t tw_change_point(tw_change *change, uint32_t parent, uint8_t flags);
/* Adds a corner to the current face, which tw_change_face ends. */
void tw_change_corner(tw_change *change, uint32_t point, uint32_t parent, uint32_t edge, uint8_t flags);
void tw_change_face(tw_change *change, uint32_t parent, uint8_t flags);

/* Adds all old points unchanged. */
void tw_change_keep_points(tw_change *change);
/* Adds an old face. point_of: [old point_count] new points, NULL: the same. */
void tw_change_keep_face(tw_change *change, uint32_t face, const uint32_t *point_of, uint8_t flags);
/* The same, wound the other way round, still from its first corner. */
void tw_change_turn_face(tw_change *change, uint32_t face, const uint32_t *point_of, uint8_t flags);

/* Makes the mesh that the change describes. Its positions may be written (tw_editor_positions) until the edit
 * is done. TW_NO_MEMORY; TW_INVALID where a shift exceeds TW_COORDINATE_MAX. */
tw_status tw_editor_apply(tw_editor *editor, const tw_change *change);

/* Replaces the scratch. TW_NO_MEMORY. */
tw_status tw_editor_clear_scratch(tw_editor *editor);

/* Frees what the editor holds. */
void tw_editor_deinit(tw_editor *editor);

/* Drops the mesh's normals, which no longer hold once points or faces change. */
void tw_mesh_drop_normals(tw_mesh *mesh);

/* Copies the positions, unless an edit before did, so that they may be written, for edits that change nothing
 * else. TW_NO_MEMORY. */
tw_status tw_editor_loosen(tw_editor *editor);

/* The same for the displacements of morph targets. */
tw_status tw_editor_loosen_targets(tw_editor *editor);

/* Copies the finished mesh, with arrays in another arena. TW_NO_MEMORY. */
tw_status tw_editor_copy(tw_editor *editor, tw_arena *arena, tw_mesh *out);

/* Adds an empty entry for the current edit's name, dropping an earlier entry of that name. Returns it; NULL
 * where the edit has no name. Its lists belong into the mesh's arena. */
tw_named *tw_editor_name(tw_editor *editor);
/* The same, with an empty arena. *named: NULL where the edit has no name. TW_NO_MEMORY. */
tw_status tw_editor_name_own(tw_editor *editor, tw_named **named);

/* The ascending indices of flags that have a bit of the mask; *listed: their count. NULL without memory. */
uint32_t *tw_list_flagged(tw_arena *arena, const uint8_t *flags, uint8_t mask, uint32_t count,
                          uint32_t *listed);

static inline float *tw_editor_positions(tw_editor *editor) {
  return (float *)editor->mesh.positions;
}

/* Stores a position. TW_INVALID beyond TW_COORDINATE_MAX. */
tw_status tw_editor_place(tw_editor *editor, uint32_t point, const double at[3]);
/* Stores a displacement, likewise, after tw_editor_loosen_targets. */
tw_status tw_editor_displace(tw_editor *editor, uint32_t target, uint32_t point, const double by[3]);

/* ---- selections ------------------------------------------------------------------------------ */

/* *flags: [faces, edges of the topology, or points], in the scratch: not 0 where selected; NULL when nothing
 * is and the edit is optional. TW_SELECT_NOTHING selects all. Builds the topology. TW_INVALID with the
 * pointer; TW_NO_MEMORY. */
tw_status tw_editor_select(tw_editor *editor, uint8_t **flags);

/* The same, and *points: [point_count] flags, in the arena, of the points of selected elements. */
tw_status tw_editor_select_points(tw_editor *editor, uint8_t **flags, uint8_t **points);

/* Gives the edit's name, if it has one, to what is selected. TW_NO_MEMORY. */
tw_status tw_editor_name_selected(tw_editor *editor, const uint8_t *selected, const uint8_t *points);

/* Finds the edge between two points that the edit names at `place`; TW_INVALID where there is none. Builds
 * the topology. */
tw_status tw_editor_find_edge(tw_editor *editor, const uint32_t ends[2], const char *place, uint32_t *edge);

/* Flags the ring of edges through one: 1 where an edge's direction (edge_vertices) is that of the first edge,
 * 2 where it is opposite. flags: [edge_count], zeroed. O(ring). */
void tw_find_ring(const tw_topology *topology, uint32_t edge, uint8_t *flags);

/* ---- the edits, a function for each ---------------------------------------------------------- */

tw_status tw_edit_transform(tw_editor *editor); /* move, rotate, scale */
tw_status tw_edit_crease(tw_editor *editor);
tw_status tw_edit_corner(tw_editor *editor);
tw_status tw_edit_hole(tw_editor *editor);
tw_status tw_edit_extrude(tw_editor *editor);
tw_status tw_edit_inset(tw_editor *editor);
tw_status tw_edit_loop_cut(tw_editor *editor);
tw_status tw_edit_subdivide(tw_editor *editor);
tw_status tw_edit_delete(tw_editor *editor);
tw_status tw_edit_merge(tw_editor *editor);
tw_status tw_edit_fill(tw_editor *editor);
tw_status tw_edit_mirror(tw_editor *editor);
tw_status tw_edit_flip(tw_editor *editor);
tw_status tw_edit_orient(tw_editor *editor);
tw_status tw_edit_triangulate(tw_editor *editor);
tw_status tw_edit_quads(tw_editor *editor);
tw_status tw_edit_drop_pieces(tw_editor *editor);
tw_status tw_edit_despike(tw_editor *editor);
tw_status tw_edit_smooth(tw_editor *editor);

/* ---- geometry -------------------------------------------------------------------------------- */

static inline const float *tw_editor_point(const tw_editor *editor, uint32_t point) {
  return editor->mesh.positions + 3 * (size_t)point;
}

#endif
