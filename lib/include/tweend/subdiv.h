/* Subdivision surfaces: from a control mesh to any block of the refined points and faces. */
#ifndef TWEEND_SUBDIV_H
#define TWEEND_SUBDIV_H

#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { TW_LEVEL_MAX = 16 };

typedef enum tw_scheme { TW_CATMULL_CLARK, TW_LOOP, TW_BILINEAR } tw_scheme;

typedef enum tw_boundary {
  TW_BOUNDARY_EDGE_AND_CORNER,
  TW_BOUNDARY_EDGE_ONLY,
  TW_BOUNDARY_NONE, /* border faces take part in the rules, but are left out of the answer */
  /* A new point exists only where all of its parents do, so each level shrinks from the border of the mesh.
   * Holes are refined like other faces and left out of the answer; the answer does not shrink from them. */
  TW_BOUNDARY_OPEN
} tw_boundary;

/* OpenSubdiv's face-varying linear interpolation rules. */
typedef enum tw_uv_rule {
  TW_UV_CORNERS_ONLY,
  TW_UV_NONE,
  TW_UV_CORNERS_PLUS1,
  TW_UV_CORNERS_PLUS2,
  TW_UV_BOUNDARIES,
  TW_UV_ALL
} tw_uv_rule;

typedef enum tw_creasing { TW_CREASE_UNIFORM, TW_CREASE_CHAIKIN } tw_creasing;
typedef enum tw_triangles { TW_TRIANGLES_CATMULL_CLARK, TW_TRIANGLES_SMOOTH } tw_triangles;

/* A cache of the irregular quad neighbourhoods that surfaces have met. Surfaces that share it refine each
 * neighbourhood once. */
typedef struct tw_patch_classes tw_patch_classes;

tw_patch_classes *tw_patch_classes_create(void);          /* NULL without memory */
void tw_patch_classes_destroy(tw_patch_classes *classes); /* NULL accepted */
size_t tw_patch_classes_size(const tw_patch_classes *classes);

typedef struct tw_surface_options {
  uint32_t level; /* 0 to TW_LEVEL_MAX */
  tw_scheme scheme;
  tw_boundary boundary;
  tw_uv_rule uv;
  tw_creasing creasing;
  tw_triangles triangles;
  bool limit;   /* points on the limit surface */
  bool normals; /* from exact limit tangents; false: no normals */
  /* At level 0: the mesh's own normals and tangents at its face corners, made unit, replace those of the
   * limit surface and split rows as UV seams do. A corner without a normal of its own keeps the limit's.
   * Ignored with limit or movable. */
  bool own_normals;
  /* At level 0 of a mesh without holes: tw_surface_get_tags returns its tags. */
  bool tagged;
  uint32_t influences; /* the most that rows hold, a multiple of 4; 0: as many as the mesh has */
  bool movable;        /* keeps what tw_surface_with_positions_by needs */
  /* Shared by the surfaces of a scene, or NULL: the surface makes its own. It outlives the surfaces. While a
   * surface is being made with it, nothing else may use it or a surface that shares it. */
  tw_patch_classes *classes;
} tw_surface_options;

/* Exact sizes of a surface, known before any of it is computed. */
typedef struct tw_surface_counts {
  uint64_t vertices, edges, faces; /* welded; without holes and other faces that are left out */
  uint64_t corners;                /* sum of the sizes of the counted faces */
} tw_surface_counts;

/* Counts in closed form, 64 bits. O(cage) whatever the level.
 * TW_INVALID: scheme loop on a face that is not a triangle. TW_LIMIT: over 2^32 - 2 vertices, edges or faces;
 * over 2^24 faces, holes included, by scheme loop or with an open border from level 2 on: *out then has the
 * counts that the answer would have. TW_LIMIT also when the level is over TW_LEVEL_MAX, which leaves *out
 * alone. TW_NO_MEMORY. */
tw_status tw_surface_count(const tw_mesh *mesh, const tw_surface_options *options, tw_surface_counts *out,
                           tw_error *error);

/* Which levels tw_surface_errors tells of. */
typedef struct tw_error_wish {
  uint32_t level_max; /* at most TW_LEVEL_MAX */
  double enough; /* errors that are smaller may be told larger, up to this; 0: as small as they can be told */
  uint32_t faces_max; /* of a level that is made at once, from the second on; 0: some 260,000 */
} tw_error_wish;

/* Bounds how far each level's triangles lie from the limit surface, and the limit surface from them,
 * whichever way quads and polygons are cut (proved in surface_error.c). options->level is not used. out:
 * [wish->level_max + 1] distances in the mesh's space, rounding to float included; INFINITY where none is
 * known, at level 0 alone. Details belong to the limit surface. O(cage and two levels), and more where it is
 * irregular, in memory for wish->faces_max faces beside the cage's first level. parallel: as in
 * tw_surface_create_by. TW_INVALID as tw_surface_count. TW_UNSUPPORTED: a border of TW_BOUNDARY_OPEN.
 * TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_surface_errors(const tw_mesh *mesh, const tw_surface_options *options, const tw_error_wish *wish,
                            const tw_parallel_for *parallel, double *out, tw_error *error);

/* A surface ready to be read: immutable, read by any number of threads. It holds memory in proportion to the
 * cage, not to the answer, except where generic steps refine the whole answer: by Loop's scheme up to level 4
 * or some 10^6 faces or with tangents, joints or whole numbers, with an open border up to some 10^5 faces,
 * with semi-sharp creases and UVs under Chaikin's rule, and where a cage is too irregular for patches. */
typedef struct tw_surface tw_surface;

/* The mesh must have passed tw_mesh_check. It may be freed after the call.
 * Errors as tw_surface_count. TW_LIMIT also for limit points or normals of thousands of rows at vertices of
 * thousands of faces, whose cost is the product and would be more than some seconds. TW_NO_MEMORY. */
tw_status tw_surface_create(const tw_mesh *mesh, const tw_surface_options *options, tw_surface **out,
                            tw_error *error);

/* As tw_surface_create, with its longer loops shared among threads; the surface is the same. parallel NULL:
 * the calling thread runs the loops alone. parallel is not kept after the call. TW_CANCELLED as well. */
tw_status tw_surface_create_by(const tw_mesh *mesh, const tw_surface_options *options,
                               const tw_parallel_for *parallel, tw_surface **out, tw_error *error);

/* The plan's surface over other positions. It borrows topology, patches and numbering from the plan, which
 * was made with `movable` (or is itself the result of this call) and outlives *out. Only the points of the
 * base are computed; bounds are computed anew when asked for. The rows have the same bytes as those of a
 * surface made from the mesh with these positions.
 * positions: [point_count][3] of the mesh that the plan was made from, each at most TW_COORDINATE_MAX.
 * O(points of the cage) where the cage is all quads, and of its first level or two where it is not. Where
 * patches would not pay (up to 3 levels below the cage or the deepest detail), by Loop's scheme and with open
 * borders: up to O(points of the answer). Any thread, many at once on one plan. parallel: as in
 * tw_surface_create_by. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_surface_with_positions_by(const tw_surface *plan, const float *positions,
                                       const tw_parallel_for *parallel, tw_surface **out);

void tw_surface_destroy(tw_surface *surface);      /* NULL accepted */
size_t tw_surface_size(const tw_surface *surface); /* bytes held, without those borrowed from a plan */

/* Three numberings of the rows of one surface. */
typedef enum tw_domain {
  TW_DOMAIN_POINTS,  /* welded points:               rows of 3 floats, position */
  TW_DOMAIN_UVS,     /* UV set 0, welded in UV space: rows of 2 floats */
  TW_DOMAIN_VERTICES /* what a GPU draws: points split at UV seams and infinitely sharp creases; rows as
                        tw_surface_layout says */
} tw_domain;

/* An attribute of rows: one of the mesh. It belongs to the point, so all rows that a seam splits the point
 * into have the same values, unless the mesh has values of corners. */
typedef struct tw_row_attribute {
  const char *name; /* UTF-8, glTF's; as long as the surface lives */
  uint32_t column, width;
  tw_numbers numbers;
  bool is_color; /* from 0 to 1 */
} tw_row_attribute;

/* Rows of TW_DOMAIN_VERTICES: interleaved floats. Offsets are in floats; UINT32_MAX when absent.
 * Normals are those of the limit surface. At an infinitely sharp crease or a border a row has the normal of
 * its own side; at a semi-sharp crease, that of the surface after all sharpness has decayed. Where the
 * surface has no tangent plane (at a corner, a sharp point, a point of two faces back to back, a non-manifold
 * point) the normal is that of one face of the level at the point. Where that face has no area, the cross
 * product of its diagonals serves, and +Y where the face lies on a line or in a point.
 * Tangents are present where the source had some and the answer has normals and UVs. x y z has unit length,
 * is orthogonal to the normal and points along growing u of the UV set that the face uses for tangents, on
 * the limit surface: the direction in which v is constant; where v does not vary, a direction in which u
 * grows; where UVs do not vary at all, the face's first side. w, 1 or -1, is the handedness of the cage
 * face's UV map (glTF's: w (normal x tangent) points along growing v, v up). Points are split where the
 * handedness changes, and where faces use different UV sets.
 * Joints and weights: the weights of each joint subdivide as positions do, limit included. A row has as many
 * influences as a point of the mesh, or fewer (tw_surface_influences by options.influences): the heaviest
 * joints, heaviest first, with weights of sum 1, and joint 0 where a weight is 0. Displacements of normals
 * are present where the mesh has some, the answer has normals and the surface is not movable. Each is the
 * row's normal on the surface with that target at weight 1, minus the normal in the row. Where level 0 has
 * the mesh's own normals, the displacements are the mesh's own as well, and 0 where it has none. */
typedef struct tw_surface_layout {
  uint32_t stride;                        /* floats a row */
  uint32_t position;                      /* always 0 */
  uint32_t normal;                        /* 3 floats, unit length, never zero */
  uint32_t tangent;                       /* 4 floats */
  uint32_t uv_count, uvs[TW_UV_SETS_MAX]; /* 2 floats each, v down as glTF wants it */
  uint32_t attribute_count;
  tw_row_attribute attributes[TW_ATTRIBUTES_MAX]; /* as the mesh lists them */
  /* `influences` floats each, weights behind joints; joints are whole numbers. 0 without joints. */
  uint32_t influences, joints, weights;
  /* morph_count x morph_width floats, one target after the other: the displacement of the point and, where
   * the width is 6, that of the normal. */
  uint32_t morph_count, morph_width, morphs;
} tw_surface_layout;

/* Influences that rows of the mesh's surfaces hold: its width, a multiple of 4, or 0 without a skin. Fewer
 * where more than `most` (0: no limit), or where an element of glTF would exceed TW_VERTEX_STRIDE_MAX beside
 * the other columns. */
uint32_t tw_surface_influences(const tw_mesh *mesh, uint32_t most);

/* The faces of one material and one set of named groups, contiguous in face order. Groups are sorted by
 * material, then by set; each pair occurs once. */
typedef struct tw_surface_group {
  int32_t material; /* of the cage's faces, -1 for none */
  uint32_t names;   /* the faces' set of named groups; UINT32_MAX for none, which sorts last */
  uint64_t first_face, face_count;
  uint64_t first_corner, corner_count;
} tw_surface_group;

const tw_surface_counts *tw_surface_get_counts(const tw_surface *surface);
const tw_surface_layout *tw_surface_get_layout(const tw_surface *surface);
/* The attribute of rows that is their colour; UINT32_MAX: they have none. */
uint32_t tw_surface_color(const tw_surface *surface);
uint32_t tw_surface_group_count(const tw_surface *surface);
const tw_surface_group *tw_surface_get_group(const tw_surface *surface, uint32_t group);

/* Tags of a level 0. Points are numbered as rows of TW_DOMAIN_POINTS: the mesh's points that a face uses, in
 * their order. Where a mesh tags an edge or point twice, the later tag counts. Tags of edges and points that
 * no face has are left out, as are those of sharpness 0. */
typedef struct tw_surface_tags {
  const uint32_t *faces; /* [faces] the mesh's face at each place of the answer */
  uint32_t crease_count;
  const uint32_t *crease_edges;  /* [crease_count][2] rows */
  const float *crease_sharpness; /* [crease_count], over 0, to 10 */
  uint32_t sharp_point_count;
  const uint32_t *sharp_points; /* [sharp_point_count] rows, ascending */
  const float *point_sharpness; /* [sharp_point_count], over 0, to 10 */
} tw_surface_tags;

/* NULL unless the surface is a level 0 that was made with `tagged`, from a mesh without holes. */
const tw_surface_tags *tw_surface_get_tags(const tw_surface *surface);
/* The options that the surface was made with. */
const tw_surface_options *tw_surface_get_options(const tw_surface *surface);

/* At level 0: the corner of the mesh that a face of the answer begins with. Its other corners follow. */
uint32_t tw_surface_cage_corner(const tw_surface *surface, uint64_t face);

/* Rows of a domain; 0 for TW_DOMAIN_UVS of a mesh without UVs. */
uint64_t tw_surface_row_count(const tw_surface *surface, tw_domain domain);

/* Exact minimum and maximum of the positions in the rows of TW_DOMAIN_VERTICES, which glTF wants for
 * POSITION. morph: -1 for positions; m >= 0 for the displacements of target m. The first call computes them
 * in one pass, later calls return the remembered result; any thread. All 0 without points. TW_NO_MEMORY. */
tw_status tw_surface_bounds(const tw_surface *surface, int morph, float min[3], float max[3]);

/* As tw_surface_bounds, with its pass shared among threads; the values are the same. parallel NULL: the
 * calling thread does it alone. TW_CANCELLED as well. */
tw_status tw_surface_bounds_by(const tw_surface *surface, int morph, const tw_parallel_for *parallel,
                               float min[3], float max[3]);

/* Scratch memory of one reader; not shared between threads. */
typedef struct tw_surface_reader tw_surface_reader;
tw_surface_reader *tw_surface_reader_create(const tw_surface *surface); /* NULL without memory */
void tw_surface_reader_destroy(tw_surface_reader *reader);              /* NULL accepted */

/* A reader for any of several surfaces, with memory for the most demanding of them and for rows with at most
 * displacements_max displacements, of points and normals together. Call tw_surface_reader_turn before it
 * reads. NULL without memory. */
tw_surface_reader *tw_surface_reader_create_shared(const tw_surface *const *surfaces, size_t count,
                                                   uint32_t displacements_max);
/* Makes the reader read `surface`, one of those that it was created for, from now on. The targets
 * [first_target, first_target + target_count) decide the columns of its rows:
 * - all morph targets: all columns;
 * - no target: all columns but displacements;
 * - some targets: the position, the normal where targets displace it, and the displacements of these targets.
 *   So a thousand targets can be read some at a time. */
void tw_surface_reader_turn(tw_surface_reader *reader, const tw_surface *surface, uint32_t first_target,
                            uint32_t target_count);
/* What rows of points hold behind the position. */
typedef struct tw_point_columns {
  bool normal, uv;    /* the layout has a normal; the first UV set */
  uint32_t attribute; /* UINT32_MAX: none */
} tw_point_columns;

/* Makes the reader read rows of TW_DOMAIN_VERTICES that are not split: one for each row of TW_DOMAIN_POINTS,
 * in their order, with the position and these columns alone. Where faces have different values or normals at
 * a point, the row has those of one of them. */
void tw_surface_reader_turn_to_unsplit(tw_surface_reader *reader, const tw_surface *surface,
                                       const tw_point_columns *columns);
/* The columns of the rows that the reader reads now. */
const tw_surface_layout *tw_surface_reader_layout(const tw_surface_reader *reader);

/* Reads rows [first, first + count) of a domain. out: [count][row width]. Reading rows in ascending order is
 * cheap. The bytes do not depend on how the rows are cut into calls. */
void tw_surface_read_rows(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                          float *out);

/* Reads faces [first, first + count): the row of each corner in the domain, one face after the other. Every
 * face has 4 corners (loop: 3) from level 1 on; at level 0 a face has the size of its cage face.
 * sizes: [count] or NULL. out: room for all corners. Returns the number of corners written. */
size_t tw_surface_read_faces(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                             uint32_t *sizes, uint32_t *out);

/* What rows have of a mesh's values at level 0: v runs down, and colours are clamped to 0 to 1. The first
 * value is at `uv` or `color`, the next `stride` floats behind; a colour has four. Turned twice, v is what
 * readers of glTF make of it. */
void tw_turn_v(float *uv, size_t count, uint32_t stride);
void tw_finish_colors(float *color, size_t count, uint32_t stride);

/* Number of corners of the faces before this one. Cut into triangles, those faces make 2 fewer triangles each
 * than they have corners. */
uint64_t tw_surface_corners_before(const tw_surface *surface, uint64_t face);
/* How a face is cut into triangles that, seen along its normal, lie side by side as the face does. A face
 * without a cut is the fan from its first corner: convex ones, those whose sides cross, and at levels 1 and
 * deeper all faces of cages without a concave one. The shape is that of the rows of TW_DOMAIN_POINTS. */
typedef struct tw_face_cut {
  uint64_t face;
  uint32_t size;
  uint32_t fan_count; /* corners from which a fan is right: the first three of them; 0 to 3, not 0 of quads of
                       * levels 1 and deeper */
  uint32_t fans[3];
  const uint32_t (*triangles)[3]; /* [size - 2] corners of the face: the fan from fans[0] if there is one */
} tw_face_cut;

/* The cuts of level 0 in ascending order of faces: [cut_count]. None at other levels. */
uint32_t tw_surface_cut_count(const tw_surface *surface);
const tw_face_cut *tw_surface_get_cuts(const tw_surface *surface);

/* Finds the cuts of faces [first, first + count) at any level, ascending. At levels 1 and deeper it reads the
 * points of the faces that may be concave. out: room for `count`. Returns how many there are. */
size_t tw_surface_read_cuts(tw_surface_reader *reader, uint64_t first, size_t count, tw_face_cut *out);

/* Number of corners of the largest face, at least 3. O(faces) at level 0. */
size_t tw_surface_largest_face(const tw_surface *surface);

#ifdef __cplusplus
}
#endif
#endif
