/* Reads any bytes as an STL file: they are read or refused. */
#include "use_model.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  tw_model *model = NULL;
  tw_format_sniff(bytes, size);
  if (tw_stl_read(bytes, size, TW_QUADS_NGON, TW_WELD_AUTO, &model, NULL) == TW_OK) use_model(model);
  return 0;
}
