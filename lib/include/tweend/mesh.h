/* Control meshes: polygons of any size over shared points, with the data that subdivision needs. */
#ifndef TWEEND_MESH_H
#define TWEEND_MESH_H

#include "tweend/base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  TW_UV_SETS_MAX = 4,
  TW_MORPH_TARGETS_MAX = 1024,
  /* The most attributes of a mesh, and the most numbers that they have together for each point. A row of an
   * answer, which has 24 further numbers and the displacements, then stays within TW_VERTEX_STRIDE_MAX. */
  TW_ATTRIBUTES_MAX = 16,
  TW_ATTRIBUTE_COLUMNS_MAX = 36,
  TW_JOINT_SETS_MAX = 8,      /* of four influences each */
  TW_VERTEX_STRIDE_MAX = 252, /* glTF's limit on the bytes of an element */
  TW_CHANNELS_MAX = TW_UV_SETS_MAX + TW_ATTRIBUTES_MAX
};

/* From this sharpness on a feature stays sharp at every level (OpenSubdiv's SHARPNESS_INFINITE). */
#define TW_SHARPNESS_INFINITE 10.0f

/* The greatest coordinate. Beyond it float could overflow while points and normals are computed. */
#define TW_COORDINATE_MAX 1e18f

/* Subdivision options that a file itself may carry; a request's parameters take precedence. */
typedef enum tw_tag { TW_TAG_UNSET = -1 } tw_tag;

/* One face-varying set of texture coordinates. */
typedef struct tw_uv_set {
  uint32_t value_count;
  const float *values;     /* [value_count][2], v up (OBJ's convention; glTF readers flip) */
  const uint32_t *corners; /* [corner_count] of the mesh: index of the value at each face corner */
} tw_uv_set;

/* The normals and tangents that a file gives at face corners. They show the mesh as the file has it without
 * subdivision, and where they differ across an edge it is hard. */
typedef struct tw_corner_normals {
  uint32_t value_count;
  const float *values;     /* [value_count][3], finite, of any length; 0 0 0 means none */
  const float *tangents;   /* [value_count][4] as in glTF, or NULL */
  const uint32_t *corners; /* [corner_count] of the mesh: index of the value there; NULL: no normals */
} tw_corner_normals;

/* What an attribute's numbers are. Whole numbers name things, so they are never mixed: a new vertex takes
 * those of the nearest corner of its face in the control mesh. The types are those of the source. */
typedef enum tw_numbers {
  TW_NUMBERS_REAL,
  TW_NUMBERS_WHOLE, /* in floats */
  TW_NUMBERS_INT8,
  TW_NUMBERS_UINT8,
  TW_NUMBERS_INT16,
  TW_NUMBERS_UINT16
} tw_numbers;

/* Values of points, subdivided as positions are, or of face corners, subdivided as UV sets are. */
typedef struct tw_attribute {
  const char *name;    /* UTF-8; COLOR_0 (linear), or an application's own name, which begins with "_" */
  uint32_t width;      /* 1 to 4; a colour has 4 */
  bool is_color;       /* clamped to 0 to 1 in answers */
  const float *values; /* [value_count][width]; [point_count][width] where corners is NULL */
  uint32_t value_count;
  const uint32_t *corners; /* [corner_count] of the mesh: index of the value there; NULL: values of points */
  tw_numbers numbers;
} tw_attribute;

/* Values at face corners, of a UV set or of an attribute. A view. */
typedef struct tw_channel {
  uint32_t width, value_count;
  const float *values;     /* [value_count][width] */
  const uint32_t *corners; /* [corner_count] of the mesh */
  bool is_whole;           /* whole numbers, which are never mixed */
} tw_channel;

/* Per-point skinning: the joints that move a point, and their weights. */
typedef struct tw_skin_weights {
  uint32_t width;         /* influences of a point, a multiple of 4: glTF's sets of four */
  const uint16_t *joints; /* [point_count][width] indices into the skin's joints */
  const float *weights;   /* [point_count][width], 0 or more, sum 1 */
} tw_skin_weights;

/* Detail sculpted onto a level: how far each of its vertices lies from where subdivision puts it, along the
 * tangent, bitangent and normal there, in units of the mean length of the edges at the vertex. So detail
 * turns and scales with the mesh. */
typedef struct tw_detail {
  uint32_t level; /* from 1 */
  /* All vertices of the level as stepwise refinement makes them, those of holes included, numbered as in
   * lib/refine/catmull_clark.h or loop.h. */
  uint32_t vertex_count;
  const float *offsets; /* [vertex_count][3] */
} tw_detail;

/* A view: owns nothing. Arrays are NULL when their count is 0. */
typedef struct tw_mesh {
  const char *name; /* UTF-8, or NULL */

  uint32_t point_count;
  uint32_t welded_points; /* how many points of the source were merged into others */
  uint32_t joined_quads;  /* how many faces were made by joining two triangles of the source */
  bool angles_tell; /* the source has no way to say which edges are hard but the angles of faces (STL) */
  const float *positions; /* [point_count][3], metres */
  /* Where a reader has put the frame of the points, which are relative to it; see tw_points_find_frame.
   * tw_model_finish moves the nodes that show the mesh by it, and sets it to 0. */
  double origin[3];

  uint32_t face_count, corner_count;
  const uint32_t *face_offsets; /* [face_count + 1], first corner of each face; last is corner_count */
  const uint32_t *corners;      /* [corner_count] point indices, counter-clockwise seen from outside */

  uint32_t uv_set_count;
  tw_uv_set uv_sets[TW_UV_SETS_MAX];
  tw_corner_normals normals;
  /* OBJ's smoothing groups. Where faces of one group meet they share a normal; faces of group 0 share none.
   * UINT32_MAX: the file gives this face no group. NULL: the file gives no face one. */
  const uint32_t *face_smoothing; /* [face_count] */

  uint32_t crease_count;
  const uint32_t *crease_edges;  /* [crease_count][2] points */
  const float *crease_sharpness; /* [crease_count], 0 to 10 */
  uint32_t sharp_point_count;
  const uint32_t *sharp_points; /* [sharp_point_count] */
  const float *point_sharpness; /* [sharp_point_count] */
  uint32_t hole_count;
  const uint32_t *holes; /* [hole_count] faces */
  uint32_t detail_count;
  const tw_detail *details; /* [detail_count], of ascending levels */

  /* The material of each face. NULL: no face has one. */
  const int32_t *face_materials; /* [face_count] index into the model's materials, then its slots; or -1 */
  /* Named groups. A face may be in several, so it refers to a set of groups. NULL: no face is in any. */
  const uint32_t *face_groups; /* [face_count] index into the model's sets of groups, or UINT32_MAX */

  uint32_t attribute_count;
  const tw_attribute *attributes; /* [attribute_count], with different names */
  tw_skin_weights skin;           /* joints NULL when the mesh is not skinned */
  uint32_t morph_count;
  const float *const *morphs; /* [morph_count] arrays [point_count][3] of displacements */
  /* [morph_count] arrays [normals.value_count][3] that the file adds to its normals; NULL where it gives
   * none. */
  const float *const *morph_normals;
  const float *morph_weights; /* [morph_count] defaults, or NULL */
  bool has_tangents;          /* the source had tangents or a normal map: the answer needs tangents */
  bool has_tangents_alone;    /* and no normal map, which would tell so in a cage without tangents */
  const uint8_t *tangent_uvs; /* [face_count] UV set that tangents follow; NULL: the first */

  /* A JSON object without blanks: everything else that a glTF file gives for the mesh (extras, extensions,
   * unknown members), to be repeated in answers. NULL: nothing. */
  const char *preserved;
  /* A JSON array of a glTF file's point and line primitives, which pass through unchanged; or NULL. Their
   * accessors are indices into the model's assets. */
  const char *loose;
  bool loose_has_joints, loose_has_targets; /* whether some of these primitives have them */

  /* The file's own subdivision options: TW_TAG_UNSET, or a value of the enums in subdiv.h. */
  int tag_boundary, tag_uv, tag_creasing, tag_triangles;
} tw_mesh;

/* Sets everything to zero and the tags to TW_TAG_UNSET. */
void tw_mesh_init(tw_mesh *mesh);

/* Adds the attribute COLOR_0 to a mesh without attributes. colors: [point_count][4], linear; must outlive the
 * mesh. TW_NO_MEMORY. */
tw_status tw_mesh_set_colors(tw_mesh *mesh, const float *colors, tw_arena *arena);

/* As tw_mesh_set_colors, with colours of face corners. colors: [color_count][4]; corners: [corner_count]
 * index of the colour at each corner. Both must outlive the mesh. */
tw_status tw_mesh_set_corner_colors(tw_mesh *mesh, const float *colors, uint32_t color_count,
                                    const uint32_t *corners, tw_arena *arena);

/* Lists what has values at corners: the UV sets, then the attributes with values of corners. Returns how many
 * there are. */
uint32_t tw_mesh_channels(const tw_mesh *mesh, tw_channel out[TW_CHANNELS_MAX]);

/* The attribute that a channel of tw_mesh_channels is of; NULL: it is a UV set. */
const tw_attribute *tw_channel_attribute(const tw_mesh *mesh, uint32_t channel);

/* Replaces the values that tw_mesh_channels lists, in its order. attributes: [mesh->attribute_count] the
 * mesh's, which may be written to. */
void tw_mesh_set_channels(tw_mesh *mesh, const tw_channel *channels, tw_attribute *attributes);

/* Copies the material, groups, smoothing group and tangent UV set of faces of `from` to the faces of `to`.
 * parents: [count] for each face of `to` the face of `from`. Arrays live in the arena. TW_NO_MEMORY. */
tw_status tw_mesh_take_faces(tw_mesh *to, const tw_mesh *from, const uint32_t *parents, uint32_t count,
                             tw_arena *arena);

/* ---- far from the origin --------------------------------------------------------------------- */

/* Whether the points of these corners may be far, as tw_points_find_frame finds. positions: rounded to float.
 * O(corners). */
bool tw_points_may_be_far(const float *positions, const uint32_t *corners, uint32_t corner_count);

/* Whether the points of these corners lie so far from the origin that rounding to float can move one by more
 * than 1e-6 of their largest extent. Then *origin becomes a point near their middle, along the axes on which
 * they are far from 0: floats, unless it is some 2^24 extents away. False also for points without an
 * extent, and where a coordinate exceeds TW_COORDINATE_MAX. exact: [points][3] as the file has them.
 * O(corners). */
bool tw_points_find_frame(const double *exact, const uint32_t *corners, uint32_t corner_count,
                          double origin[3]);

/* positions: [point_count][3] relative to the origin. */
void tw_points_enter_frame(const double *exact, size_t point_count, const double origin[3], float *positions);

/* Whether a node shows the mesh so far from the origin that its surface, in floats, would lose its shape.
 * world: the node's matrix. O(corners). */
bool tw_shows_far(const float world[16], const tw_mesh *mesh);

/* The largest extent of the points that faces use, along an axis. O(corners). */
double tw_mesh_extent(const tw_mesh *mesh);
/* Whether rounding a place to floats moves a mesh of that extent by more than 1e-6 of it. */
bool tw_rounding_shows(const double place[3], double extent);

/* Checks a mesh from an untrusted source: indices in range, coordinates finite and at most TW_COORDINATE_MAX,
 * faces of at least three corners, no point at two corners of a face in a row, sharpness 0 or more, fewer
 * than UINT32_MAX faces. face_offsets themselves are trusted.
 * On failure the error's pointer is relative to the mesh, in the terms of tweend JSON ("/faces/3/1",
 * "/positions/7/0"), and *face (NULL allowed) is the offending face or UINT32_MAX. TW_INVALID, TW_LIMIT.
 * O(points + corners). */
tw_status tw_mesh_check(const tw_mesh *mesh, tw_error *error, uint32_t *face);

/* Moves the points of a checked mesh by morph targets and then by joints. Normals are not computed: they
 * follow from the surface made of the moved points.
 * morph_weights: [mesh->morph_count], or NULL for the mesh's own weights (0 where it has none).
 * joint_matrices: [joint_count][16] from tw_skin_matrices; joint_count exceeds every joint index of the mesh.
 * They lead from the mesh to the world, so the node's own transform is not used. NULL: joints move nothing.
 * A point's joint weights count relative to their sum; a point without weights follows joint 0.
 * out: [point_count][3]. With `out` as its positions, and without skin and morphs, the mesh is in that pose.
 * O(points * (morphs + 4)), allocates nothing.
 * TW_INVALID, pointer "/positions/7/1", where a coordinate exceeds TW_COORDINATE_MAX; out is then
 * undefined. */
tw_status tw_mesh_deform(const tw_mesh *mesh, const float *morph_weights, const float *joint_matrices,
                         uint32_t joint_count, float *out, tw_error *error);

/* Which edges of a mesh are creases, and whether its points may be corners. */
typedef enum tw_creases {
  TW_CREASES_TAGS,    /* edges that the file tags */
  TW_CREASES_NORMALS, /* also edges where normals part */
  TW_CREASES_ANGLE,   /* also edges bent by more than an angle */
  TW_CREASES_AUTO,    /* also edges where normals part; bent edges in pieces without smooth edges */
  TW_CREASES_NONE,    /* no creases and no corners */
  /* What the file says: where the mesh has a tag of subdivision, as TAGS; else as AUTO, in pieces with
   * normals or smoothing groups, and in a mesh that only angles can tell of (angles_tell); else none. */
  TW_CREASES_FILE
} tw_creases;

/* With TW_CREASES_AUTO an edge bent by more than this is hard where normals do not decide. */
#define TW_HARD_DEGREES 50.0

/* Whether TW_CREASES_FILE looks for hard edges in the mesh: it has no tags, and something else that tells. */
bool tw_mesh_tells_hard_edges(const tw_mesh *mesh);

/* Makes a view of the mesh with the requested creases.
 * Normals part at an edge of two faces where those on its two sides differ by over half a degree at either
 * end; where a side has no normals, smoothing groups decide. A piece is a set of faces connected by points.
 * It has smooth edges when one of its faces has different normals at its corners, or has none and is in a
 * smoothing group.
 * degrees: for TW_CREASES_ANGLE, 0 to 180; an edge is hard when its faces' normals differ by more. sharpness:
 * 0 to 10, for the edges found; an edge that the file tags keeps its own.
 * With TW_CREASES_AUTO, points with two sharp edges at which the line turns by more than TW_HARD_DEGREES are
 * corners: where both edges are found, of the same sharpness; where both are borders, infinitely sharp and
 * only with `border_corners`.
 * The mesh is checked and must outlive *out; arrays of new creases live in the arena. O(corners).
 * TW_NO_MEMORY. */
tw_status tw_mesh_with_creases(const tw_mesh *mesh, tw_creases creases, double degrees, float sharpness,
                               bool border_corners, tw_arena *arena, tw_mesh *out, tw_error *error);

/* How many edges each method finds, whether the file tags them or not. corners_by_file: where such edges, or
 * borders, turn sharply. */
typedef struct tw_hard_edge_counts {
  uint32_t by_normals, by_30_degrees, by_auto, by_file, corners_by_file;
} tw_hard_edge_counts;

/* A description of a mesh for a person. */
typedef struct tw_mesh_stats {
  uint32_t vertices; /* points that a face uses */
  uint32_t unused_points;
  uint32_t edges, faces;
  uint32_t triangles, quads, ngons; /* faces of 3, of 4, and of more corners */
  uint32_t boundary_edges;
  uint32_t boundary_loops; /* loops that only share a point count separately */
  uint32_t nonmanifold_edges, nonmanifold_vertices;
  uint32_t extraordinary_vertices; /* interior valence other than 4, boundary other than 3 (corners: 2) */
  uint32_t components;             /* pieces without a common point */
  int64_t euler_characteristic;    /* vertices - edges + faces */
  uint32_t creases, sharp_points, holes; /* with a sharpness above 0; faces that are holes */
  uint32_t lost_creases;                 /* with a sharpness above 0, of two points that no edge joins */
  uint32_t lost_crease[2];               /* the points of the first one */
  uint32_t overruled_tags; /* creases and corners with another sharpness than a later one in the same place */
  uint32_t repeated_tags;  /* creases, corners and holes that say what another one has said */
  tw_hard_edge_counts hard_edges;
  /* Border edges between the same two positions as another one: open seams. */
  uint32_t seam_edges;
  uint32_t folded_edges; /* of these, both sides of one face, which comes to their points twice */
  /* Pairs of faces that run along an edge in the same direction: one of them is wound the wrong way round.
   * reversed_borders: the faces have two border edges at the same positions, so the surface is open there;
   * reversed_edges: they share one edge, which is then a crease. */
  uint32_t reversed_borders, reversed_edges;
  float min[3], max[3]; /* of the used points; 0 when there are none */
  /* Allocated by the call, freed by tw_mesh_stats_deinit. */
  uint32_t valence_count;
  uint32_t *valences, *valence_vertices; /* [valence_count] extraordinary valences, vertices of each */
  uint32_t face_size_count;
  uint32_t *face_sizes, *face_size_faces; /* [face_size_count] face sizes, faces of each */
  uint32_t group_count;
  uint32_t *groups, *group_faces;    /* [group_count] sets of named groups, faces of each */
  uint32_t listed_nonmanifold_edges; /* at most 64 */
  uint32_t (*nonmanifold_edge_points)[2];
  uint32_t listed_nonmanifold_vertices; /* at most 64 */
  uint32_t *nonmanifold_vertex_points;
  uint32_t listed_reversed_edges; /* at most 64, of both kinds */
  uint32_t (*reversed_edge_points)[2];
} tw_mesh_stats;

/* Describes a checked mesh. O(n log n). Errors: TW_NO_MEMORY. */
tw_status tw_mesh_describe(const tw_mesh *mesh, tw_mesh_stats *facts, tw_error *error);
void tw_mesh_stats_deinit(tw_mesh_stats *facts);

#ifdef __cplusplus
}
#endif
#endif
