/* Any bytes as glTF or GLB: read or refused, and what was read can be described and posed. */
#include <stdlib.h>

#include "tweend/format.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

/* Finishing compiled every clip once, so that compiling it again must not fail but for memory. */
static void pose(const tw_model *model) {
  tw_trs *locals = calloc(model->node_count + 1, sizeof *locals);
  for (uint32_t i = 0; locals && i < model->clip_count; i++) {
    tw_clip *clip = NULL;
    if (tw_clip_create(&model->clips[i], model->node_count, -1, &clip, NULL) != TW_OK) abort();
    tw_clip_pose(clip, model->nodes, model->node_count, 0.5f, locals);
    tw_clip_destroy(clip);
  }
  free(locals);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  tw_model *model = NULL;
  tw_error error;
  tw_read_limits limits = {.json_values = 100000};
  if (tw_gltf_read(bytes, size, (tw_quads)(size % 3), &limits, &model, &error) != TW_OK) return 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_mesh_facts facts;
    if (tw_mesh_describe(&model->meshes[i], &facts, &error) == TW_OK) tw_mesh_facts_deinit(&facts);
  }
  pose(model);
  tw_model_destroy(model);
  return 0;
}
