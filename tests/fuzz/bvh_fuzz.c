/* Reads any bytes as a BVH file: they are read or refused. */
#include "use_model.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  tw_model *model = NULL;
  tw_format_sniff(bytes, size);
  if (tw_bvh_read(bytes, size, &model, NULL) == TW_OK) use_model(model);
  return 0;
}
