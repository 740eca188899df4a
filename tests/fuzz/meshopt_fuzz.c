/* Decodes any bytes as a compressed view; the first four are its mode, filter, stride and count. */
#include <stdlib.h>

#include "meshopt_read.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  if (size < 4) return 0;
  const tw_meshopt_view view = {.mode = (tw_meshopt_mode)(bytes[0] % 3),
                                .filter = (tw_meshopt_filter)(bytes[1] % 5),
                                .stride = (uint64_t)bytes[2] + 1,
                                .count = bytes[3]};
  if (tw_meshopt_check(&view, view.count * view.stride, NULL) != TW_OK) return 0;
  uint8_t *packed = malloc(size - 4 + 1), *out = malloc((size_t)(view.count * view.stride));
  if (packed && out) {
    for (size_t i = 4; i < size; i++) packed[i - 4] = bytes[i];
    tw_meshopt_decode(&view, packed, size - 4, out, NULL);
  }
  free(packed);
  free(out);
  return 0;
}
