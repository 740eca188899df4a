#include "use_model.h"

#include <stdlib.h>

/* Reading has checked the keys, so that compiling a clip must not fail but for memory. */
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

void use_model(tw_model *model) {
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_mesh_stats facts;
    if (tw_mesh_describe(&model->meshes[i], &facts, NULL) == TW_OK) tw_mesh_stats_deinit(&facts);
  }
  pose(model);
  tw_model_destroy(model);
}
