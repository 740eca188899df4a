/* Reads any bytes as tweend JSON: they are read or refused. */
#include "upload.h"
#include "use_model.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  tw_model *model = NULL;
  api_fault fault = {0};
  const api_making making = {.faces_max = 4096, .bytes_max = 1 << 22};
  if (api_model_read((api_bytes){bytes, size}, TW_FORMAT_JSON, (api_reading){.weld = TW_WELD_EXACT}, &making,
                     &model, &fault))
    use_model(model);
  return 0;
}
