/* The bytes of a plan's views. */
#ifndef TWEEND_GLTF_FILL_H
#define TWEEND_GLTF_FILL_H

#include "gltf/gltf.h"

/* Computes elements (rows, triangles, bytes) of views; one stream's own. */
typedef struct tw_gltf_filler tw_gltf_filler;

/* Plan and scene outlive it. NULL without memory. */
tw_gltf_filler *tw_gltf_filler_create(const tw_gltf_plan *plan, const tw_scene *scene);
void tw_gltf_filler_destroy(tw_gltf_filler *filler); /* NULL accepted */

/* Elements [first, first + count) of a view. out: [count][element_size], aligned for floats and 32-bit
 * indices unless the view is memory. */
void tw_gltf_fill(tw_gltf_filler *filler, const tw_gltf_view *view, uint64_t first, size_t count, void *out);

#endif
