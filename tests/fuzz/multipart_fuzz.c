/* A line with any Content-Type, then any bytes as the form that it declares: the one file in it lies inside
 * them. */
#include <stdlib.h>
#include <string.h>

#include "upload.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  const uint8_t *line_end = size > 0 ? memchr(bytes, '\n', size) : NULL;
  if (!line_end || memchr(bytes, '\0', (size_t)(line_end - bytes))) return 0;
  size_t length = (size_t)(line_end - bytes);
  char *type = malloc(length + 1), boundary[71];
  if (!type) return 0;
  memcpy(type, bytes, length);
  type[length] = '\0';
  api_bytes body = {line_end + 1, size - length - 1}, file = {0};
  tw_error error;
  if (api_multipart_boundary(type, boundary) && api_multipart_file(body, boundary, &file, &error) == TW_OK &&
      (file.data < body.data || file.size > body.size ||
       (size_t)(file.data - body.data) > body.size - file.size))
    abort();
  free(type);
  return 0;
}
