/* Makes a mesh of polygons as scanners and slicers write them: each triangle with points of its own, or
 * vertices that are split along seams. */
#ifndef TWEEND_SOUP_MESH_H
#define TWEEND_SOUP_MESH_H

#include "losses.h"
#include "weld.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Polygons as a file has them. Vertex arrays come from malloc and stay the caller's; face arrays lie in the
 * model's arena and become the mesh's. */
typedef struct tw_polygons_read {
  uint32_t vertex_count;
  float *positions; /* [vertex_count][3], finite */
  double origin[3]; /* of the frame that positions are in: see tw_polygons_enter_frame */
  float *colors;    /* [vertex_count][4] linear, or NULL */
  float *uvs;       /* [vertex_count][2], v up, or NULL */
  float *normals;   /* [vertex_count][3], finite, 0 0 0 for none; or NULL */
  uint32_t face_count, corner_count;
  uint32_t *face_offsets; /* [face_count + 1] */
  uint32_t *corners;      /* [corner_count] vertices, in range */
  /* Values of corners, in place of those of vertices; from malloc, the caller's, NULL without any. */
  float *corner_uvs;    /* [corner_count][2], v up */
  float *corner_colors; /* [corner_count][4] linear */
} tw_polygons_read;

/* Makes the only mesh of the model. Drops corners that are at the place of the corner before them, and faces
 * left with fewer than three different places; then welds vertices as tw_weld_points does, unless `weld` is
 * TW_WELD_NONE. Points that only faces left out had go with them. Notes or warns of what is left out and
 * stays open. Where vertices or corners at one point have different colours, the mesh has colours of corners.
 * TW_NO_MEMORY. */
tw_status tw_model_of_polygons(tw_polygons_read *read, tw_weld weld, tw_model *model, tw_losses *losses,
                               tw_error *error);

/* Reads the coordinates of all vertices again, in double; their number is known by now. */
typedef void tw_read_exact(void *file, double *out);

/* Gives polygons that lie far from the origin a frame of their own, see tw_points_find_frame. read_exact is
 * called where this may be; NULL: the file has floats. TW_NO_MEMORY. */
tw_status tw_polygons_enter_frame(tw_polygons_read *read, tw_read_exact *read_exact, void *file,
                                  tw_error *error);

/* Warns of the faces that welding left out and of the seams that it left open; not of collapsed faces, whose
 * warning differs between formats. */
void tw_warn_of_welding(tw_model *model, const tw_welded *welded);

/* Warns of the quads that were made by joining triangles. */
void tw_warn_of_quads(tw_model *model);

/* Adds the counts of another mesh, but for its points. */
void tw_add_welded(tw_welded *total, const tw_welded *more);

/* The most bytes that reading so many vertices, corners and faces holds, the model included. corner_values:
 * how many numbers each corner has. */
uint64_t tw_polygons_size(uint64_t vertex_count, uint64_t corner_count, uint64_t face_count,
                          uint32_t corner_values);

/* Colours in mesh files are sRGB (as Blender, MeshLab and three.js write and read them), those of meshes
 * linear: IEC 61966-2-1. */
float tw_linear_from_srgb(float value);

/* Whether a number of a colour is within 0 to 1, but for rounding. */
static inline bool tw_is_color(float value) {
  return value >= -0.001f && value <= 1.001f;
}
float tw_srgb_from_linear(float value);

/* Whether bytes are STL or PLY, by their beginning; binary STL by its size. */
bool tw_is_stl(const uint8_t *bytes, size_t size);
bool tw_is_ply(const uint8_t *bytes, size_t size);

#ifdef __cplusplus
}
#endif
#endif
