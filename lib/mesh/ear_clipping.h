/* Cuts polygons into triangles by their shape. */
#ifndef TWEEND_EAR_CLIPPING_H
#define TWEEND_EAR_CLIPPING_H

#include "parallel_for.h"
#include "tweend/base.h"

typedef struct tw_ear_corner {
  double at[2]; /* in the plane of the polygon, which runs counter-clockwise there */
  uint32_t next, previous;
  uint32_t place; /* among the corners in the order of at[0] */
  bool is_reflex; /* not yet cut off, and not convex */
} tw_ear_corner;

/* Scratch for polygons of up to `most` corners. */
typedef struct tw_ear_clipper {
  tw_ear_corner *corners;
  uint32_t *order; /* corners by at[0] */
  double area;     /* twice the polygon's */
  uint32_t size;
} tw_ear_clipper;

/* False without memory. */
bool tw_ear_clipper_init(tw_ear_clipper *clipper, tw_arena *arena, uint32_t most);

/* Takes a polygon, projected along the axis nearest to its normal. points: [size] pointers to three floats.
 */
void tw_ear_clipper_take(tw_ear_clipper *clipper, const float *const *points, uint32_t size);

/* Whether the fan of triangles from a corner is the polygon: none of its triangles lies the other way round,
 * but for a millionth of the polygon's area. Always true of a polygon without area. *looks: the triangles
 * that it may look at; those that it did are taken off, and false is returned when none are left. */
bool tw_ear_clipper_is_fan(const tw_ear_clipper *clipper, uint32_t start, uint64_t *looks);

/* Cuts ears off the polygon, one after the other, moving round it so that they do not all share a corner.
 * names: [size], equal where corners are one point: no side joins a point to itself. out: [size - 2]
 * triangles, as corners. *count: of the triangles; 0 where a polygon that has a point twice cannot be cut up.
 * A simple polygon is cut exactly, unless corners of thousands lie so that more than 256 of them, on average,
 * stand beside each ear; the rest is then cut without a test. O(size * 256) at most. TW_CANCELLED. */
tw_status tw_ear_clipper_cut(tw_ear_clipper *clipper, const uint32_t *names, const tw_parallel_for *parallel,
                             uint32_t (*out)[3], uint32_t *count);

#endif
