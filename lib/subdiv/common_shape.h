/* Irregular neighbourhoods that most meshes have: all smooth, one corner of the quad at an extraordinary
 * vertex of few faces. They are their own quarters. Their classes and stencils are made when first asked for
 * and kept from then on, shared by all threads, as the tables of splines are. */
#ifndef TWEEND_COMMON_SHAPE_H
#define TWEEND_COMMON_SHAPE_H

#include "shape.h"

typedef struct tw_common_shape tw_common_shape;

/* *out: NULL where the neighbourhood is none of these. TW_NO_MEMORY. */
tw_status tw_common_find(const tw_neighbourhood *neighbourhood, tw_common_shape **out);

/* Good for every depth; its irregular quarter is itself. It has no stencils. */
const tw_patch_class *tw_common_class(tw_common_shape *common);

/* Gives all copies of common classes their stencils for every depth that there are stencils for, of points or
 * of limits. TW_NO_MEMORY. */
tw_status tw_common_stencils(tw_patch_shapes *shapes, bool limit, bool normals);

#endif
