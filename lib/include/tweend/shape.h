/* Shapes to start modelling from: closed or flat cages in closed form. */
#ifndef TWEEND_SHAPE_H
#define TWEEND_SHAPE_H

#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum tw_shape_kind {
  TW_SHAPE_GRID, /* in the xz plane, facing up */
  TW_SHAPE_BOX,
  TW_SHAPE_QUAD_SPHERE, /* a box projected onto a sphere, its lines at equal angles */
  TW_SHAPE_UV_SPHERE,
  TW_SHAPE_ICOSPHERE, /* an icosahedron, each face cut into 4^level parts, projected onto a sphere */
  TW_SHAPE_ELLIPSOID, /* a quad sphere with three radii */
  TW_SHAPE_CYLINDER,
  TW_SHAPE_CONE, /* its apex is up */
  TW_SHAPE_TORUS /* about the y axis */
} tw_shape_kind;
enum { TW_SHAPES = 9 };
extern const char *const tw_shape_names[TW_SHAPES + 1]; /* as in tweend JSON, then NULL */

typedef enum tw_caps { TW_CAPS_NGON, TW_CAPS_FAN, TW_CAPS_NONE } tw_caps;

/* The parameters of all kinds; a kind's function reads only its own. */
typedef struct tw_shape {
  tw_shape_kind kind;
  float size[3];  /* box; grid, which ignores y */
  float radii[3]; /* ellipsoid; other kinds read only the first. Torus: from the axis to the middle of the
                     tube */
  float height;   /* cylinder, cone */
  float tube;     /* torus: radius of the tube, less than the first radius */
  /* Box: along x, y, z. Grid: along x and z, y is ignored. Other kinds read only the first: segments along an
   * edge of the box that becomes round, or round the y axis. */
  uint32_t segments[3];
  uint32_t rings; /* bands from top to bottom: uv sphere, cylinder, cone */
  uint32_t sides; /* torus: round the tube */
  uint32_t level; /* icosphere */
  tw_caps caps;   /* cylinder, cone */
} tw_shape;

/* The defaults of a kind: lengths are 1 and a tube 0.4, as in three.js. */
void tw_shape_init(tw_shape *shape, tw_shape_kind kind);

/* The size of a shape. A count beyond 2^62 is given as 2^62. */
typedef struct tw_shape_counts {
  uint64_t points, faces, corners;
  uint64_t uvs;
} tw_shape_counts;

/* Checks the parameters and counts the elements. TW_INVALID with a pointer in the terms of tweend JSON
 * ("/segments/1"). O(1). */
tw_status tw_shape_count(const tw_shape *shape, tw_shape_counts *out, tw_error *error);

/* Makes a shape: centred on the origin, y up, faces outward (a grid's up), no two points the same, points
 * sorted by y, then z, then x. Faces come in this order: sides +x -x +y -y +z -z; bands from top to bottom (a
 * torus's from its outer equator upwards); then the top and the bottom cap.
 * The mesh has one set of UVs, from 0 to 1 (an icosphere's u exceeds 1 across the seam). Each side of a box,
 * or of the round shapes made from one, covers the whole square. Bands go once round from the seam, which is
 * at -x on spheres, at +z on cylinders and cones, at +x and on the outer equator on a torus. Caps are discs
 * in the square. All but the icosphere's, whose seam is also at -x, are as in three.js.
 * *out: a mesh without a name; its arrays live in the arena. Errors of tw_shape_count; TW_LIMIT over 2^31 - 1
 * corners; TW_NO_MEMORY. O(points log points). */
tw_status tw_shape_make(const tw_shape *shape, tw_arena *arena, tw_mesh *out, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
