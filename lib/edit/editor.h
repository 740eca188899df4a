/* The mesh under a list of edits, and the change that one edit makes of it.
 *
 * An edit reads the mesh and its topology, tells the new points and faces by those of before (tw_change), and
 * tw_editor_apply makes the mesh of it: a new point or face corner is one of before or a weighted mean of
 * some, by which everything that points and corners bear goes along. */
#ifndef TWEEND_EDITOR_H
#define TWEEND_EDITOR_H

#include "hard_edges.h"
#include "parallel_for.h"
#include "topology.h"
#include "tweend/edit.h"
#include "vector3.h"

/* What an edit with a name made; it follows later edits. */
typedef struct tw_named {
  const char *name;
  uint32_t face_count, point_count, edge_count;
  uint32_t *faces, *points; /* ascending */
  uint32_t (*edges)[2];     /* points */
} tw_named;

/* All arrays live in the arena, which every change of points or faces replaces. */
typedef struct tw_editor {
  tw_mesh mesh;
  tw_arena *arena;
  tw_topology *topology; /* of the mesh; NULL until somebody asks */
  const tw_model *model; /* or NULL */
  const tw_edit_limits *limits;
  const tw_edit *edit; /* under way */
  uint32_t index;      /* of it */
  uint32_t named_count;
  tw_named *named; /* [edits] malloc'ed: outlives arenas */
  bool is_named;   /* the edit's name means what it made already */
  tw_error *error;
} tw_editor;

tw_status tw_editor_no_memory(const tw_editor *editor);
/* Fills the error; the place is relative to the edit ("/faces/2"). */
tw_status tw_editor_fail(const tw_editor *editor, tw_status status, const char *place, const char *format,
                         ...) TW_PRINTF(4, 5);

/* TW_CANCELLED, with the error filled, where nobody wants the result any more. */
tw_status tw_editor_go_on(const tw_editor *editor);

/* Builds the topology where it is not there yet. O(corners). */
tw_status tw_editor_need_topology(tw_editor *editor);

/* ---- the change ---------------------------------------------------------------------------------------- */

enum {
  TW_CHANGE_NEW = 1, /* a face that is no part of its parent, and gets but its material and groups */
  TW_CHANGE_MADE = 2 /* belongs to what the edit's name means */
};

typedef struct tw_term {
  uint32_t index; /* a point or corner of before */
  double weight;
} tw_term;

/* How much there is room for, and in the end is. */
typedef struct tw_change_size {
  uint64_t points, faces, corners;
  uint64_t mixes, terms; /* of points and corners together */
} tw_change_size;

/* A parent is an index of before, or that count and the number of a mix more. */
typedef struct tw_change {
  const tw_editor *editor;
  uint32_t point_count, face_count, corner_count, mix_count, term_count;
  uint32_t *point_parents;  /* [point_count] */
  uint8_t *point_flags;     /* [point_count] MADE */
  uint32_t *face_offsets;   /* [face_count + 1] */
  uint32_t *face_parents;   /* [face_count] faces of before */
  uint8_t *face_flags;      /* [face_count] */
  uint32_t *corners;        /* [corner_count] points of the change */
  uint32_t *corner_parents; /* [corner_count] */
  uint32_t *corner_edges;   /* [corner_count] edge of before that the edge behind the corner is of, or
                               UINT32_MAX: creases follow */
  uint8_t *corner_flags;    /* [corner_count] MADE: the edge behind it */
  uint32_t *mix_offsets;    /* [mix_count + 1] */
  tw_term *terms;           /* [term_count] */
  double (*shifts)[3];      /* [point_count] by how much points are moved, or NULL */
} tw_change;

/* Checks the size against the limits and allocates. The editor has its topology. TW_LIMIT, TW_NO_MEMORY. */
tw_status tw_change_init(tw_change *change, const tw_editor *editor, const tw_change_size *size);

/* A mean of points, or of corners; returns its number. Weights sum to 1. Means of corners at one new point
 * have one texture coordinate where their first and their last terms had. */
uint32_t tw_change_mix(tw_change *change, const tw_term *terms, uint32_t count);
/* Returns the new point. */
uint32_t tw_change_point(tw_change *change, uint32_t parent, uint8_t flags);
/* A corner of the face under way, which tw_change_face ends. */
void tw_change_corner(tw_change *change, uint32_t point, uint32_t parent, uint32_t edge, uint8_t flags);
void tw_change_face(tw_change *change, uint32_t parent, uint8_t flags);

/* All points of before, as they are. */
void tw_change_keep_points(tw_change *change);
/* A face of before; point_of: [point_count before] points of the change, NULL: the same. */
void tw_change_keep_face(tw_change *change, uint32_t face, const uint32_t *point_of, uint8_t flags);
/* The same from its first corner the other way round. */
void tw_change_turn_face(tw_change *change, uint32_t face, const uint32_t *point_of, uint8_t flags);

/* Makes the mesh that the change tells; its positions may be written (tw_editor_positions) until the edit is
 * done. TW_NO_MEMORY. */
tw_status tw_editor_apply(tw_editor *editor, const tw_change *change);

/* Normals of the mesh say nothing where points or faces change. */
void tw_mesh_drop_normals(tw_mesh *mesh);

/* Lets positions be written where nothing else changes. TW_NO_MEMORY. */
tw_status tw_editor_loosen(tw_editor *editor);

/* The finished mesh, of arrays in another arena. TW_NO_MEMORY. */
tw_status tw_editor_copy(tw_editor *editor, tw_arena *arena, tw_mesh *out);

/* The last of what is named, which the edit's name means from now on; NULL where it has none. */
tw_named *tw_editor_name(tw_editor *editor);

/* The indices of flags that have a bit of the mask, ascending. NULL without memory. */
uint32_t *tw_list_flagged(tw_arena *arena, const uint8_t *flags, uint8_t mask, uint32_t count,
                          uint32_t *listed);

static inline float *tw_editor_positions(tw_editor *editor) {
  return (float *)editor->mesh.positions;
}

/* Stores a position. TW_INVALID beyond TW_COORDINATE_MAX. */
tw_status tw_editor_place(tw_editor *editor, uint32_t point, const double at[3]);

/* ---- selections ---------------------------------------------------------------------------------------- */

/* *flags: [faces, edges of the topology, or points], not 0 where it is selected, in the arena; NULL when that
 * is nothing and the edit is optional. TW_SELECT_NOTHING: all. TW_INVALID with the pointer; TW_NO_MEMORY. */
tw_status tw_editor_select(tw_editor *editor, uint8_t **flags);

/* The same, and the points of what is selected: *points [point_count], in the arena. */
tw_status tw_editor_select_points(tw_editor *editor, uint8_t **flags, uint8_t **points);

/* Lets the edit's name, where it has one, mean what is selected. TW_NO_MEMORY. */
tw_status tw_editor_name_selected(tw_editor *editor, const uint8_t *selected, const uint8_t *points);

/* The edge between two points that the edit names at `place`; TW_INVALID where there is none. */
tw_status tw_editor_find_edge(tw_editor *editor, const uint32_t ends[2], const char *place, uint32_t *edge);

/* Flags the edges side by side with one, over the quads between them: 1 where the edge's direction
 * (edge_vertices) is that of the first, 2 where it is against it. flags: [edge_count], zeroed. O(ring). */
void tw_find_ring(const tw_topology *topology, uint32_t edge, uint8_t *flags);

/* ---- edits, one a function ----------------------------------------------------------------------------- */

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

/* ---- geometry ------------------------------------------------------------------------------------------ */

static inline const float *tw_editor_point(const tw_editor *editor, uint32_t point) {
  return editor->mesh.positions + 3 * (size_t)point;
}

#endif
