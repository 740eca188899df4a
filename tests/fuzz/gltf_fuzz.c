/* Any bytes as glTF or GLB: read or refused. */
#include "use_model.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  tw_model *model = NULL;
  tw_read_limits limits = {.json_values = 100000};
  if (tw_gltf_read(bytes, size, (tw_quads)(size % 3), TW_WELD_AUTO, &limits, &model, NULL) == TW_OK)
    use_model(model);
  return 0;
}
