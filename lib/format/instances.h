/* EXT_mesh_gpu_instancing: the places at which a node shows its mesh. */
#ifndef TWEEND_INSTANCES_H
#define TWEEND_INSTANCES_H

#include "gltf/gltf.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A view of the model. Attributes are NULL where the node has none of them. */
typedef struct tw_instances {
  uint32_t count;
  const tw_gltf_elements *translation, *rotation, *scale; /* [count] or more */
} tw_instances;

/* False for a node that shows its mesh once, where it is itself. O(what is kept of the node). */
bool tw_instances_find(const tw_model *model, uint32_t node, tw_instances *out);

/* Whether the node's EXT_mesh_gpu_instancing is as its specification says; true for a node without one. */
bool tw_instances_are_fit(const tw_model *model, uint32_t node);

/* Where an instance is, relative to its node. */
void tw_instances_read(const tw_instances *instances, uint32_t index, tw_trs *out);

#ifdef __cplusplus
}
#endif
#endif
