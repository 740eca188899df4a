/* The meshes of a glTF answer's JSON: primitives, the ranges of groups in them, and in extras what a cage
 * says beyond glTF. */
#ifndef TWEEND_GLTF_JSON_MESHES_H
#define TWEEND_GLTF_JSON_MESHES_H

#include "gltf_json_writer.h"

/* The document's member "meshes"; nothing where the model has none. */
void tw_gltf_put_meshes(tw_gltf_writer *writer);

#endif
