/* Reads a line with any Content-Type, then any bytes as the form that it declares. The files in the form must
 * lie inside the bytes, and may make a GLB. */
#include <stdlib.h>
#include <string.h>

#include "upload.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

static void check_inside(const tw_named_file *file, api_bytes body) {
  if (file->bytes < body.data || file->size > body.size ||
      (size_t)(file->bytes - body.data) > body.size - file->size)
    abort();
}

/* Bundles the first file as a glTF with the files that it names. */
static void join(const tw_named_file *gltf, const api_form *form) {
  uint8_t *glb;
  size_t size;
  tw_model *model = NULL;
  if (tw_gltf_bundle(gltf->bytes, gltf->size, form->files, form->count, 10000, 1 << 20, &glb, &size, NULL) !=
          TW_OK ||
      !glb)
    return;
  if (tw_format_sniff(glb, size) != TW_FORMAT_GLB) abort();
  tw_gltf_read(glb, size, TW_QUADS_NGON, TW_WELD_AUTO, 10000, &model, NULL);
  tw_model_destroy(model);
  free(glb);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  const uint8_t *line_end = size > 0 ? memchr(bytes, '\n', size) : NULL;
  if (!line_end || memchr(bytes, '\0', (size_t)(line_end - bytes))) return 0;
  size_t length = (size_t)(line_end - bytes);
  char *type = malloc(length + 1), boundary[71];
  if (!type) return 0;
  memcpy(type, bytes, length);
  type[length] = '\0';
  api_bytes body = {line_end + 1, size - length - 1};
  tw_arena *arena = tw_arena_create();
  api_form form;
  tw_error error;
  if (arena && api_multipart_boundary(type, boundary) &&
      api_form_read(body, boundary, arena, &form, &error) == TW_OK) {
    for (uint32_t i = 0; i < form.count; i++) check_inside(&form.files[i], body);
    join(&form.files[0], &form);
  }
  tw_arena_destroy(arena);
  free(type);
  return 0;
}
