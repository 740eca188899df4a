/* Shapes to model from: closed or flat cages in closed form. */
#ifndef TWEEND_SHAPE_H
#define TWEEND_SHAPE_H

#include "tweend/mesh.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum tw_shape_kind {
  TW_SHAPE_GRID, /* in the plane of x and z, facing up */
  TW_SHAPE_BOX,
  TW_SHAPE_QUAD_SPHERE, /* a box of equal angles between its lines, made round */
  TW_SHAPE_UV_SPHERE,
  TW_SHAPE_ICOSPHERE, /* an icosahedron's faces in 4^level parts, made round */
  TW_SHAPE_ELLIPSOID, /* a quad sphere with three radii */
  TW_SHAPE_CYLINDER,
  TW_SHAPE_CONE, /* its point is up */
  TW_SHAPE_TORUS /* about the y axis */
} tw_shape_kind;
enum { TW_SHAPES = 9 };
extern const char *const tw_shape_names[TW_SHAPES + 1]; /* as in tweend JSON; NULL behind the last */

typedef enum tw_caps { TW_CAPS_NGON, TW_CAPS_FAN, TW_CAPS_NONE } tw_caps;

/* The parameters of all kinds; those that a kind does not have are not read. */
typedef struct tw_shape {
  tw_shape_kind kind;
  float size[3];  /* grid, without y; box */
  float radii[3]; /* ellipsoid; of the others the first alone is read. Torus: to the middle of the tube */
  float height;   /* cylinder, cone */
  float tube;     /* torus: radius of the tube, less than the first radius */
  /* Along x, y, z of a box; along x and z of a grid, without y; of the others the first alone is read: along
   * an edge of the box that becomes round, or about the y axis. */
  uint32_t segments[3];
  uint32_t rings; /* bands from top to bottom: uv sphere, cylinder, cone */
  uint32_t sides; /* torus: about the tube */
  uint32_t level; /* icosphere */
  tw_caps caps;   /* cylinder, cone */
} tw_shape;

/* The defaults of a kind: lengths are 1 and a tube 0.4, as in three.js. */
void tw_shape_init(tw_shape *shape, tw_shape_kind kind);

/* What a shape takes; a number beyond 2^62 is 2^62. */
typedef struct tw_shape_counts {
  uint64_t points, faces, corners;
  uint64_t uvs;
  uint64_t bytes; /* that making it holds at most, the mesh included */
} tw_shape_counts;

/* Checks the parameters and counts. TW_INVALID with a pointer in tweend JSON's words ("/segments/1"). O(1).
 */
tw_status tw_shape_count(const tw_shape *shape, tw_shape_counts *out, tw_error *error);

/* Makes a shape that tw_shape_count accepts: centred on the origin, y up, faces outward (a grid's up), no two
 * points the same, points by y, then z, then x. Sides follow each other as +x -x +y -y +z -z, bands from top
 * to bottom (a torus's from its outer equator upwards), then a top and a bottom.
 * It has one set of UVs, from 0 to 1: each side of a box (or of what a box becomes) is the whole square;
 * bands go once round from the seam, which is at -x of spheres, at +z of cylinders and cones, at +x and on
 * the outer equator of a torus; caps are discs in the square. All but the icosphere's, whose seam is at -x
 * too, are those of three.js. *out: a mesh without a name, its arrays live in the arena. TW_LIMIT over 2^31
 * corners, TW_NO_MEMORY. O(points log points). */
tw_status tw_shape_make(const tw_shape *shape, tw_arena *arena, tw_mesh *out, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
