/* Reads any bytes as glTF or GLB: they are read or refused. */
#include "use_model.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  tw_model *model = NULL;
  if (tw_gltf_read(bytes, size, (tw_quads)(size % 3), TW_WELD_AUTO, 100000, &model, NULL) == TW_OK)
    use_model(model);
  return 0;
}
