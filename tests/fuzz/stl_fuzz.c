/* Any bytes as an STL file: read or refused, and what was read can be described. */
#include <stdlib.h>

#include "tweend/format.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  tw_model *model = NULL;
  tw_error error;
  tw_format_sniff(bytes, size);
  if (tw_stl_read(bytes, size, &model, &error) != TW_OK) return 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_mesh_stats facts;
    if (tw_mesh_describe(&model->meshes[i], &facts, &error) == TW_OK) tw_mesh_stats_deinit(&facts);
  }
  tw_model_destroy(model);
  return 0;
}
