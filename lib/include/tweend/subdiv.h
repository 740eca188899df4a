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
  TW_BOUNDARY_NONE, /* faces at the border take part in the rules and are left out of the answer */
  /* New points only where every parent exists: the answer shrinks from the border of the mesh. Holes are
   * faces like all others here, and left out of the answer: it does not shrink from them. */
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

/* The irregular neighbourhoods of quads that surfaces have met, each refined once for all of them. */
typedef struct tw_patch_shapes tw_patch_shapes;

tw_patch_shapes *tw_patch_shapes_create(void);         /* NULL without memory */
void tw_patch_shapes_destroy(tw_patch_shapes *shapes); /* NULL accepted */
size_t tw_patch_shapes_size(const tw_patch_shapes *shapes);

/* Whether so many bytes, beside those that the cage takes in any case, may be taken. */
typedef struct tw_grant {
  void *context;
  bool (*take)(void *context, uint64_t bytes);
} tw_grant;

typedef struct tw_surface_options {
  uint32_t level; /* 0 to TW_LEVEL_MAX */
  tw_scheme scheme;
  tw_boundary boundary;
  tw_uv_rule uv;
  tw_creasing creasing;
  tw_triangles triangles;
  bool limit;   /* points on the limit surface */
  bool normals; /* from exact limit tangents; false: none */
  /* At level 0 the normals, and tangents, that the mesh has at its corners, made unit, in place of those;
   * they split rows as seams do. Where a corner has none, those of the limit. Not with limit or movable. */
  bool own_normals;
  /* At level 0 of a mesh without holes: tw_surface_get_tags tells its tags. */
  bool tagged;
  bool movable; /* keeps what tw_surface_with_positions_by needs */
  /* Shared by surfaces of a scene, or NULL: one of the surface's own. It outlives the surfaces, and while one
   * is made with it nothing else uses it or them. */
  tw_patch_shapes *shapes;
  /* Asked once before levels are made step by step, which takes memory in proportion to the answer: by loop,
   * with an open border, and where a cage is too irregular for patches. A refusal is TW_NO_MEMORY. NULL: any
   * size may be taken. It need not outlive the call. */
  const tw_grant *grant;
} tw_surface_options;

/* Exact sizes of a surface, known before any of it is computed. */
typedef struct tw_surface_counts {
  uint64_t vertices, edges, faces; /* welded; holes and left-out faces not counted */
  uint64_t corners;                /* sum of the sizes of the counted faces */
} tw_surface_counts;

/* Counts in closed form, 64 bits. O(cage) whatever the level.
 * TW_INVALID: loop on a face that is not a triangle. TW_LIMIT: over 2^32 - 2 of anything, or over 2^24
 * faces, holes included, by loop or with an open border from level 2 on; *out then tells of how many the
 * answer would have, or is all 0 when the level itself is over TW_LEVEL_MAX. */
tw_status tw_surface_count(const tw_mesh *mesh, const tw_surface_options *options, tw_surface_counts *out,
                           tw_error *error);

/* A surface ready to be read: immutable, any number of threads. It holds memory in proportion to
 * the cage, not to the answer, but where options.grant says otherwise. */
typedef struct tw_surface tw_surface;

/* The mesh must have passed tw_mesh_check. It may be freed after the call.
 * Errors as tw_surface_count; TW_LIMIT also where limits of thousands of rows at vertices of thousands of
 * faces are asked for; TW_NO_MEMORY. */
tw_status tw_surface_create(const tw_mesh *mesh, const tw_surface_options *options, tw_surface **out,
                            tw_error *error);

/* As tw_surface_create, its longer loops shared among threads. The same surface. parallel NULL: the calling
 * thread does it alone; it is not kept after the call. TW_CANCELLED as well. */
tw_status tw_surface_create_by(const tw_mesh *mesh, const tw_surface_options *options,
                               const tw_parallel_for *parallel, tw_surface **out, tw_error *error);

/* The same surface over other positions: topology, patches and numbering are the plan's, which was made with
 * `movable` (or is the result of this call) and outlives *out; only the points of the base are computed, and
 * bounds are known anew. The same bytes as those of a surface made of the mesh with these positions.
 * positions: [mesh point_count][3] of the mesh that the plan was made of, each at most TW_COORDINATE_MAX.
 * O(points of the cage) where the cage is all quads, and of the first level or two where it is not; to level
 * 4, where patches would not pay, of the level above the answer; of the answer for loop and open borders. Any
 * thread, many at once on one plan. parallel: as in tw_surface_create_by. TW_NO_MEMORY. */
tw_status tw_surface_with_positions_by(const tw_surface *plan, const float *positions,
                                       const tw_parallel_for *parallel, tw_surface **out);

void tw_surface_destroy(tw_surface *surface);      /* NULL accepted */
size_t tw_surface_size(const tw_surface *surface); /* bytes held; of a plan's none */
/* Bytes that a surface over other positions holds, or a few more. */
size_t tw_surface_moved_size(const tw_surface *plan);

/* Three numberings of the same surface. */
typedef enum tw_domain {
  TW_DOMAIN_POINTS,  /* welded points:               rows of 3 floats, position */
  TW_DOMAIN_UVS,     /* UV set 0, welded in UV space: rows of 2 floats */
  TW_DOMAIN_VERTICES /* what a GPU draws: points split where a UV seam or an infinitely sharp
                        crease asks for it: rows as tw_surface_layout says */
} tw_domain;

/* Rows of TW_DOMAIN_VERTICES: interleaved floats. Offsets are in floats; UINT32_MAX when absent.
 * Normals are those of the limit surface. At an infinitely sharp crease or a border they are those of the
 * row's own side; at what is semi-sharp, of the surface after all decay.
 * Where the surface has no tangent plane they are those of a face of the level at the point: a corner, a
 * sharp point, a point of two faces back to back, one that is not manifold. Where that face has no area,
 * along its diagonals, and +Y where it lies on a line or in a point. Tangents come where the source bore some
 * and the answer has normals and UVs: x y z of unit length, orthogonal to the normal, along growing u of the
 * face's UV set for them on the limit surface; w, 1 or -1, is the handedness of the cage face's map (glTF's:
 * w (normal x tangent) lies along growing v, v up). Where v does not grow, they lie along growing u; where
 * UVs do not grow at all, along the first side of the face. Points are split where a map turns over, and
 * where faces differ in their set. Joints and weights: the weights of each joint subdivide as positions do,
 * limit included; a row has the four heaviest, heaviest first, sum 1, joint 0 where a weight is 0.
 * Displacements of normals come where the mesh has some, the answer has normals and is not movable: the row's
 * normal on the surface with that target at weight 1, less the one that stands in the row. Where level 0 has
 * the mesh's own normals, they are the mesh's own as well, and 0 where it has none. */
typedef struct tw_surface_layout {
  uint32_t stride;                        /* floats a row */
  uint32_t position;                      /* always 0 */
  uint32_t normal;                        /* 3 floats, unit length, never zero */
  uint32_t tangent;                       /* 4 floats */
  uint32_t uv_count, uvs[TW_UV_SETS_MAX]; /* 2 floats each, v down as glTF wants it */
  /* The mesh's attributes, as wide as there, colours from 0 to 1. They follow the point: rows that seams
   * split have the same. */
  uint32_t attribute_count, attributes[TW_ATTRIBUTES_MAX];
  uint32_t joints, weights; /* 4 floats each; joints are whole numbers */
  /* morph_count x morph_width floats, one target after the other: the displacement of the point, and where
   * the width is 6, that of the normal. */
  uint32_t morph_count, morph_width, morphs;
} tw_surface_layout;

/* Faces of one material and one set of named groups, next to each other in face order: by ascending
 * material, then set. Each pair occurs once. */
typedef struct tw_surface_group {
  int32_t material; /* of the cage's faces, -1 for none */
  uint32_t names;   /* their set of named groups, UINT32_MAX for none (it comes last) */
  uint64_t first_face, face_count;
  uint64_t first_corner, corner_count;
} tw_surface_group;

const tw_surface_counts *tw_surface_get_counts(const tw_surface *surface);
const tw_surface_layout *tw_surface_get_layout(const tw_surface *surface);
uint32_t tw_surface_group_count(const tw_surface *surface);
const tw_surface_group *tw_surface_get_group(const tw_surface *surface, uint32_t group);

/* Tags of a level 0 in its own numbers, rows of TW_DOMAIN_POINTS: the mesh's points that a face uses, in
 * their order. Where a mesh tags an edge or point twice, the later tag; only what its faces have, and what is
 * sharp. */
typedef struct tw_surface_tags {
  const uint32_t *faces; /* [faces] of the mesh, in the order of the answer */
  uint32_t crease_count;
  const uint32_t *crease_edges;  /* [crease_count][2] rows */
  const float *crease_sharpness; /* [crease_count], over 0, to 10 */
  uint32_t sharp_point_count;
  const uint32_t *sharp_points; /* [sharp_point_count] rows, ascending */
  const float *point_sharpness; /* [sharp_point_count], over 0, to 10 */
} tw_surface_tags;

/* NULL unless the surface is a level 0 that was made `tagged`, of a mesh without holes. */
const tw_surface_tags *tw_surface_get_tags(const tw_surface *surface);
/* As the surface was made. */
const tw_surface_options *tw_surface_get_options(const tw_surface *surface);

/* Rows of a domain; 0 for TW_DOMAIN_UVS of a mesh without UVs. */
uint64_t tw_surface_row_count(const tw_surface *surface, tw_domain domain);

/* Exact minimum and maximum of all positions of TW_DOMAIN_VERTICES as its rows hold them (the
 * quantity glTF wants for POSITION); morph m >= 0: of that target's displacements; position: -1.
 * Computed by one pass at the first call, then remembered; any thread. All 0 without points.
 * TW_NO_MEMORY. */
tw_status tw_surface_bounds(const tw_surface *surface, int morph, float min[3], float max[3]);

/* As tw_surface_bounds, its pass shared among threads. The same values. parallel NULL: the calling thread
 * does it alone. TW_CANCELLED as well. */
tw_status tw_surface_bounds_by(const tw_surface *surface, int morph, const tw_parallel_for *parallel,
                               float min[3], float max[3]);

/* Scratch memory of one reader; not shared between threads. */
typedef struct tw_surface_reader tw_surface_reader;
tw_surface_reader *tw_surface_reader_create(const tw_surface *surface); /* NULL without memory */
void tw_surface_reader_destroy(tw_surface_reader *reader);              /* NULL accepted */

/* One for any of several surfaces, as large as the most demanding asks for, and for rows of at most so many
 * displacements, of points and of normals. It reads none before tw_surface_reader_turn. NULL without memory.
 */
tw_surface_reader *tw_surface_reader_create_shared(const tw_surface *const *surfaces, size_t count,
                                                   uint32_t displacements_max);
/* From here on it reads this one of its surfaces. Its rows hold all columns where these are all morph
 * targets, all but displacements where they are none, and else the position, the normal where targets move
 * it, and the displacements of targets [first_target, first_target + target_count) alone: a thousand targets
 * are read some at a time. */
void tw_surface_reader_turn(tw_surface_reader *reader, const tw_surface *surface, uint32_t first_target,
                            uint32_t target_count);
/* The columns of such rows. */
const tw_surface_layout *tw_surface_reader_layout(const tw_surface_reader *reader);

/* Rows [first, first + count) of a domain. out: [count][row width]. Neighbouring calls are cheap.
 * The same bytes whatever the blocks asked for. */
void tw_surface_read_rows(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                          float *out);

/* Faces [first, first + count) as rows of the domain: corner indices one after the other.
 * Every face has 4 corners (loop: 3) from level 1 on; at level 0 the cage's sizes.
 * sizes: [count] or NULL. out: room for all corners. Returns the number of corners written. */
size_t tw_surface_read_faces(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                             uint32_t *sizes, uint32_t *out);

/* Corners before this face, in face order (a face's triangles: corners - 2 a face). */
uint64_t tw_surface_corners_before(const tw_surface *surface, uint64_t face);
/* Corners of its largest face, at least 3. O(faces) at level 0. */
size_t tw_surface_largest_face(const tw_surface *surface);

#ifdef __cplusplus
}
#endif
#endif
