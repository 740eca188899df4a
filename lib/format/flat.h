/* Flat answers: the meshes of a scene in world space, without hierarchy, as STL and PLY hold them, or points
 * alone. The bytes are elements of known sizes in segments, so that any of them can be computed alone. */
#ifndef TWEEND_FLAT_H
#define TWEEND_FLAT_H

#include "row_pages.h"
#include "triangulator.h"
#include "tweend/json_print.h"

/* A mesh with faces where a node, or an instance of one, shows it. */
typedef struct tw_flat_part {
  const tw_surface *surface;
  uint32_t node, mesh;
  double matrix[12];  /* three rows of four: from the mesh to the answer's coordinates */
  double cofactor[9]; /* of the linear part, columns first: turns normals */
  bool is_mirrored;   /* faces turn round */
  uint64_t first_point;
} tw_flat_part;

typedef struct tw_flat_scene {
  tw_scene scene;
  uint32_t part_count;
  tw_flat_part *parts;
  /* Where a part lies too far from the origin for floats, all parts are moved by minus the origin, which is
   * in the model's unit; else 0. */
  bool is_moved;
  double origin[3];
  uint32_t far_count; /* parts that lie too far for floats even then */
  bool is_beyond;     /* floats cannot hold some coordinate, see tw_flat_check */
} tw_flat_scene;

/* Places what a scene shows. scale: of coordinates in the answer's unit. False without memory; then too it
 * must be deinited. */
bool tw_flat_place(const tw_scene *scene, double scale, tw_flat_scene *out);
void tw_flat_deinit(tw_flat_scene *flat);

/* TW_LIMIT where floats cannot hold a coordinate of the answer. */
tw_status tw_flat_check(const tw_flat_scene *flat, tw_error *error);

/* All faces of a surface, whatever their material. */
tw_surface_group tw_flat_faces(const tw_surface *surface);

/* point: 3 floats of the mesh; out: 3 floats of the answer, none of them -0. */
static inline void tw_flat_move(const tw_flat_part *part, const float *point, float *out) {
  const double x = (double)point[0], y = (double)point[1], z = (double)point[2], *m = part->matrix;
  out[0] = (float)(m[0] * x + m[1] * y + m[2] * z + m[3]) + 0.0f;
  out[1] = (float)(m[4] * x + m[5] * y + m[6] * z + m[7]) + 0.0f;
  out[2] = (float)(m[8] * x + m[9] * y + m[10] * z + m[11]) + 0.0f;
}

/* Turns a unit normal; one that a flat transform leaves without direction stays as it is. */
void tw_flat_turn(const tw_flat_part *part, const float normal[3], float out[3]);

/* What the elements of a flat answer are computed with. */
typedef struct tw_flat_tools {
  tw_surface_reader *reader;
  tw_triangulator triangles;
  tw_row_pages points, uvs; /* zeroed where they are not needed */
  uint32_t *corners[2];     /* [corner_capacity] of points and of UVs, as rows */
  uint32_t *places[2];      /* [corner_capacity] as places in the pages */
  uint32_t *sizes;          /* [TW_FLAT_FACES] */
  float *rows;              /* [TW_FLAT_ROWS][TW_FLAT_ROW] */
  float levels[256];        /* the least linear colour of each byte of sRGB */
  size_t corner_capacity;
} tw_flat_tools;

/* TW_FLAT_ROW: the most floats of a row: position, normal, texture coordinates, colour. */
enum { TW_FLAT_FACES = 4096, TW_FLAT_ROWS = 1024, TW_FLAT_ROW = 12 };

/* Makes the tools that tw_flat_read_triangles needs, for any of the surfaces; the others stay zeroed. False
 * without memory; then too they must be deinited. */
bool tw_flat_tools_init(tw_flat_tools *tools, const tw_surface *const *surfaces, uint32_t count);
void tw_flat_tools_deinit(tw_flat_tools *tools); /* zeroed ones are fine */

/* Reads triangles from `first` on, at most `most` and TW_FLAT_FACES: their corners as places of points in
 * tools->points, which then holds the moved points. Returns how many. */
uint32_t tw_flat_read_triangles(tw_flat_tools *tools, const tw_flat_part *part, uint64_t first,
                                uint64_t most);

/* ---- the formats ----------------------------------------------------------------------------- */

enum { TW_STL_HEAD = 84, TW_STL_FACET = 50 };

/* out: [TW_STL_HEAD]. */
void tw_stl_put_head(const tw_flat_scene *flat, const char *unit, uint64_t triangles, uint8_t *out);
/* Writes facets from `first` on, at most `most`; returns how many. out: [TW_FLAT_FACES][TW_STL_FACET]. */
uint32_t tw_stl_put_facets(tw_flat_tools *tools, const tw_flat_part *part, uint64_t first, uint64_t most,
                           uint8_t *out);

/* What a PLY has for each vertex and each face. Points are the vertices of a PLY without faces and colours.
 */
typedef struct tw_ply_layout {
  bool has_normals, has_colors;
  bool has_uvs, has_wedges;     /* texture coordinates of vertices, or of corners */
  bool is_v_down;               /* of vertices */
  bool is_ngon;                 /* faces are polygons, not triangles */
  bool has_long_lists;          /* counts take 4 bytes */
  bool has_large_indices;       /* "uint", as "int" would not hold them */
  uint32_t vertex_size;         /* bytes */
  uint32_t face_size, per_edge; /* a face of n corners takes face_size + n * per_edge bytes */
} tw_ply_layout;

tw_ply_layout tw_ply_lay_out(const tw_flat_scene *flat);
tw_ply_layout tw_points_lay_out(bool has_normals, bool has_uvs);
/* False without memory. */
bool tw_points_put_head(const tw_flat_scene *flat, const tw_ply_layout *layout, tw_text *out);
/* False without memory. */
bool tw_ply_put_head(const tw_flat_scene *flat, const tw_ply_layout *layout, const char *unit, tw_text *out);
/* Fills tools->levels. */
void tw_ply_find_levels(tw_flat_tools *tools);
/* As tw_stl_put_facets. out: [TW_FLAT_ROWS][vertex_size]. */
uint32_t tw_ply_put_vertices(tw_flat_tools *tools, const tw_flat_part *part, const tw_ply_layout *layout,
                             uint64_t first, uint64_t most, uint8_t *out);
/* As tw_stl_put_facets. out: room for TW_FLAT_FACES triangles, or for polygons of corner_capacity corners in
 * all. */
uint32_t tw_ply_put_faces(tw_flat_tools *tools, const tw_flat_part *part, const tw_ply_layout *layout,
                          uint64_t first, uint64_t most, uint8_t *out);

#endif
