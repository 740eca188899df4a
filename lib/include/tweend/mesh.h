/* Control meshes: polygons of any size over shared points, with what subdivision needs to know. */
#ifndef TWEEND_MESH_H
#define TWEEND_MESH_H

#include "tweend/base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  TW_UV_SETS_MAX = 4,
  TW_MORPH_TARGETS_MAX = 1024,
  /* Attributes of a mesh, and their numbers a point: a row of an answer, which has 24 numbers beside them and
   * the displacements, stays within the 252 bytes that glTF allows. */
  TW_ATTRIBUTES_MAX = 16,
  TW_ATTRIBUTE_COLUMNS_MAX = 36
};

/* Sharpness from which a feature stays sharp at every level (OpenSubdiv's SHARPNESS_INFINITE). */
#define TW_SHARPNESS_INFINITE 10.0f

/* Greatest coordinate: from here on float could overflow on the way to points and normals. */
#define TW_COORDINATE_MAX 1e18f

/* The subdivision tags that a file itself may carry; a request's parameters win over them. */
typedef enum tw_tag { TW_TAG_UNSET = -1 } tw_tag;

/* One face-varying set of texture coordinates. */
typedef struct tw_uv_set {
  uint32_t value_count;
  const float *values;     /* [value_count][2], v up (OBJ's convention; glTF readers flip) */
  const uint32_t *corners; /* [corner_count] of the mesh: the value at each face corner */
} tw_uv_set;

/* The normals, and tangents, that a file gives at face corners. They say how the file looks without
 * subdivision, and by where they differ which edges are hard. */
typedef struct tw_corner_normals {
  uint32_t value_count;
  const float *values;     /* [value_count][3], finite, of any length; 0 0 0: none */
  const float *tangents;   /* [value_count][4] as glTF has them, or NULL */
  const uint32_t *corners; /* [corner_count] of the mesh: the value at each face corner; NULL: no normals */
} tw_corner_normals;

/* Values of the points that subdivide as positions do. */
typedef struct tw_attribute {
  const char *name; /* as in glTF: COLOR_0, linear, or an application's own, which begins with "_"; UTF-8 */
  uint32_t width;   /* 1 to 4; 4 of a colour */
  bool is_color;    /* in answers from 0 to 1 */
  const float *values; /* [point_count][width] */
} tw_attribute;

/* Per-point skinning: up to four joints. */
typedef struct tw_skin_weights {
  const uint16_t *joints; /* [point_count][4] indices into the skin's joints */
  const float *weights;   /* [point_count][4], sum 1 */
} tw_skin_weights;

/* What is modelled onto a level: how far each of its vertices lies from where subdivision puts it, along the
 * tangent, the bitangent and the normal there, in units of the mean length of the edges at the vertex. So it
 * turns and grows with the mesh. */
typedef struct tw_detail {
  uint32_t level; /* from 1 */
  /* As many as the level has when it is refined step by step, those of holes too: they have the numbers of
   * lib/subdiv/catmull_clark.h, or of loop.h. */
  uint32_t vertex_count;
  const float *offsets; /* [vertex_count][3] */
} tw_detail;

/* A view: owns nothing. Arrays are NULL when their count is 0. */
typedef struct tw_mesh {
  const char *name; /* UTF-8, or NULL */

  uint32_t point_count;
  uint32_t welded_points; /* of the source, that are one with another point here */
  const float *positions; /* [point_count][3], metres */

  uint32_t face_count, corner_count;
  const uint32_t *face_offsets; /* [face_count + 1], first corner of each face; last is corner_count */
  const uint32_t *corners;      /* [corner_count] point indices, counter-clockwise seen from outside */

  uint32_t uv_set_count;
  tw_uv_set uv_sets[TW_UV_SETS_MAX];
  tw_corner_normals normals;
  /* OBJ's smoothing groups: faces of one group have one normal where they meet, those of group 0 none in
   * common with any. UINT32_MAX: the file does not say. NULL: of no face. */
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

  /* Materials: groups of faces. NULL: all faces have material -1 (none). */
  const int32_t *face_materials; /* [face_count] index into the model's materials, then its slots; or -1 */
  /* Groups that the modeller named. A face may be in several: it has a set of them. NULL: no face is in
   * any. */
  const uint32_t *face_groups; /* [face_count] index into the model's sets of groups, or UINT32_MAX */

  uint32_t attribute_count;
  const tw_attribute *attributes; /* [attribute_count], of different names */
  tw_skin_weights skin;           /* joints NULL when the mesh is not skinned */
  uint32_t morph_count;
  const float *const *morphs; /* [morph_count] arrays [point_count][3] of displacements */
  /* [morph_count] arrays [normals.value_count][3], what the file adds to its normals; NULL where it says of
   * no target. */
  const float *const *morph_normals;
  const float *morph_weights; /* [morph_count] defaults, or NULL */
  bool has_tangents;          /* the source bore tangents or a normal map: the answer needs them */
  const uint8_t *tangent_uvs; /* [face_count] UV set that tangents follow, NULL: the first */

  /* A JSON object without blanks: what a glTF file said of the mesh beyond all this (extras, extensions,
   * members that nobody here knows), for answers to bear again. NULL: nothing. */
  const char *kept;
  /* A JSON array of a glTF file's primitives of points and lines, which pass through as they are; or NULL.
   * Their accessors are elements of the model's assets. */
  const char *loose;

  /* The file's own subdivision tags, TW_TAG_UNSET or a value of the enums in subdiv.h. */
  int tag_boundary, tag_uv, tag_creasing, tag_triangles;
} tw_mesh;

/* Everything zero, tags unset. */
void tw_mesh_init(tw_mesh *mesh);

/* Adds the attribute COLOR_0 to a mesh without attributes. colors: [point_count][4], linear; they outlive the
 * mesh. TW_NO_MEMORY. */
tw_status tw_mesh_set_colors(tw_mesh *mesh, const float *colors, tw_arena *arena);

/* Gives the faces of `to` what those of `from` bear: material, groups, smoothing, UVs of tangents. parents:
 * [count] faces of `from`; arrays live in the arena. TW_NO_MEMORY. */
tw_status tw_mesh_take_faces(tw_mesh *to, const tw_mesh *from, const uint32_t *parents, uint32_t count,
                             tw_arena *arena);

/* Checks a mesh from an untrusted source: indices in range, coordinates finite, faces of at least
 * three corners, no point twice in a row, sharpness 0 or more, counts within 32 bits.
 * On failure the error's pointer is relative to the mesh in tweend JSON's words
 * ("/faces/3/1", "/positions/7/0"), and *face (NULL allowed) is the offending face or UINT32_MAX.
 * O(points + corners). */
tw_status tw_mesh_check(const tw_mesh *mesh, tw_error *error, uint32_t *face);

/* Where morph targets, and then joints, move the points of a checked mesh; normals follow from the surface
 * that is made of them.
 * morph_weights: [mesh->morph_count], or NULL for the mesh's own (0 where it has none).
 * joint_matrices: [joint_count][16] from tw_skin_matrices, more than the mesh's greatest joint; they lead
 * from the mesh to the world, so that the node's own transform plays no part. NULL: joints move nothing.
 * A point's weights count relative to their sum; a point without any hangs on joint 0.
 * out: [point_count][3]. With it in place of the positions, and without skin and morphs, the mesh is that of
 * the pose. O(points * (morphs + 4)), allocates nothing.
 * TW_INVALID, pointer "/positions/7/1", where a coordinate leaves TW_COORDINATE_MAX; out is then undefined.
 */
tw_status tw_mesh_deform(const tw_mesh *mesh, const float *morph_weights, const float *joint_matrices,
                         uint32_t joint_count, float *out, tw_error *error);

/* Which edges of a mesh are creases, and its points corners. */
typedef enum tw_creases {
  TW_CREASES_TAGS,    /* those that the file tags */
  TW_CREASES_NORMALS, /* and those where normals part */
  TW_CREASES_ANGLE,   /* and those that are bent */
  TW_CREASES_AUTO, /* and where normals part in pieces that have smooth edges too; in others what is bent */
  TW_CREASES_NONE  /* none, and no corners */
} tw_creases;

/* Bent by how much an edge is hard by TW_CREASES_AUTO where normals do not tell. */
#define TW_HARD_DEGREES 50.0

/* A view of the mesh with the creases that are asked for.
 * Normals part at an edge of two faces where those of its two sides differ at an end by over half a degree;
 * where a side has none, smoothing groups part them. A piece is what hangs together by points; it has smooth
 * edges when a face of it has different normals at its corners, or is in a smoothing group.
 * degrees: of TW_CREASES_ANGLE, 0 to 180; an edge is hard when its faces turn by more.
 * sharpness: 0 to 10, of the edges found; an edge that the file tags keeps its own.
 * The mesh is checked and outlives *out; arrays of new creases live in the arena. O(corners). TW_NO_MEMORY.
 */
tw_status tw_mesh_with_creases(const tw_mesh *mesh, tw_creases creases, double degrees, float sharpness,
                               tw_arena *arena, tw_mesh *out, tw_error *error);

/* How many edges each of these finds beside the file's tags. */
typedef struct tw_hard_edge_counts {
  uint32_t by_normals, by_30_degrees, by_auto;
} tw_hard_edge_counts;

/* How many quads TW_QUADS_AUTO (format.h) would make of pairs of triangles of a checked mesh. O(n log n).
 * TW_NO_MEMORY. */
tw_status tw_mesh_count_quads(const tw_mesh *mesh, uint32_t *out, tw_error *error);

/* What a mesh is, for a person who looks at it. */
typedef struct tw_mesh_stats {
  uint32_t vertices; /* points that a face uses */
  uint32_t unused_points;
  uint32_t edges, faces;
  uint32_t triangles, quads, ngons; /* faces of 3, 4, more corners */
  uint32_t boundary_edges;
  uint32_t boundary_loops; /* two that meet in a mere point are two */
  uint32_t nonmanifold_edges, nonmanifold_vertices;
  uint32_t extraordinary_vertices; /* interior valence other than 4, boundary other than 3 (corners: 2) */
  uint32_t components;             /* without a point in common */
  int64_t euler_characteristic;    /* vertices - edges + faces */
  uint32_t creases, sharp_points, holes; /* edges, points and faces that bear a tag above 0 */
  tw_hard_edge_counts hard_edges;
  /* Borders that lie on each other, by position: seams that are open. */
  uint32_t seam_edges;
  /* Two faces that run along an edge in the same direction, so that one of them is wound the other way round;
   * over two borders it is open, over one edge of both a crease. */
  uint32_t reversed_borders, reversed_edges;
  float min[3], max[3]; /* of the used points; all 0 when there are none */
  /* Allocated by the call, freed by tw_mesh_stats_deinit. */
  uint32_t valence_count;
  uint32_t *valences, *valence_vertices; /* [valence_count]: extraordinary valence, how many */
  uint32_t face_size_count;
  uint32_t *face_sizes, *face_size_faces; /* [face_size_count]: size, how many */
  uint32_t group_count;
  uint32_t *groups, *group_faces;    /* [group_count]: set of the model's named groups, how many faces */
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
