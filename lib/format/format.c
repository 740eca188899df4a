/* Recognises the format of bytes. */
#include "tweend/format.h"

#include <string.h>

#include "bvh.h"
#include "soup_mesh.h"
#include "tweend/json_text.h"
#include "word.h"

static size_t skip_space(const uint8_t *bytes, size_t size, size_t at) {
  while (at < size && (bytes[at] == ' ' || bytes[at] == '\t' || bytes[at] == '\n' || bytes[at] == '\r')) at++;
  return at;
}

/* Whether a quoted member of the top level is one that glTF has and tweend JSON has not. Some writers leave
 * out the asset that glTF demands. */
static bool is_gltf_key(const uint8_t *quoted, size_t size) {
  static const char *const keys[] = {"\"asset\"", "\"accessors\"", "\"bufferViews\"", "\"buffers\"",
                                     "\"scenes\""};
  for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
    if (size == strlen(keys[i]) && memcmp(quoted, keys[i], size) == 0) return true;
  return false;
}

/* Whether the JSON object that opens at `at` has a member of glTF at its top level. */
static bool has_gltf_key(const uint8_t *bytes, size_t size, size_t at) {
  size_t depth = 0;
  while (at < size) {
    uint8_t c = bytes[at];
    if (c == '"') {
      size_t start = at;
      at += tw_json_string_size((const char *)bytes + at, size - at);
      if (depth != 1 || !is_gltf_key(bytes + start, at - start)) continue;
      size_t next = skip_space(bytes, size, at);
      if (next < size && bytes[next] == ':') return true;
      continue;
    }
    if (c == '{' || c == '[') depth++;
    if ((c == '}' || c == ']') && --depth == 0) return false;
    at++;
  }
  return false;
}

tw_format tw_format_sniff(const uint8_t *bytes, size_t size) {
  if (size >= 4 && memcmp(bytes, "glTF", 4) == 0) return TW_FORMAT_GLB;
  if (tw_is_ply(bytes, size)) return TW_FORMAT_PLY;
  if (tw_is_stl(bytes, size)) return TW_FORMAT_STL;
  if (tw_is_bvh(bytes, size)) return TW_FORMAT_BVH;
  size_t at = tw_byte_order_mark(bytes, size);
  at = skip_space(bytes, size, at);
  if (at == size || bytes[at] != '{') return TW_FORMAT_OBJ;
  return has_gltf_key(bytes, size, at) ? TW_FORMAT_GLTF : TW_FORMAT_JSON;
}
