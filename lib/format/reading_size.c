/* Bounds the memory that reading a file takes. */
#include <assert.h>

#include "tweend/format.h"

/* per_byte: memory that a byte of small text may become. An object of an OBJ file becomes a mesh and a node,
 * "{}," in tweend JSON likewise, and in glTF tinygltf's struct for a material. A joint of a BVH file takes
 * 7 bytes, "JOINT{}". The readers of OBJ, tweend JSON and STL keep the bound by construction, those of glTF,
 * PLY and BVH by a budget. */
uint64_t tw_reading_size(tw_format format, uint64_t size) {
  static const uint64_t per_byte[] = {
      [TW_FORMAT_OBJ] = 10, [TW_FORMAT_JSON] = 192, [TW_FORMAT_GLTF] = 2400, [TW_FORMAT_GLB] = 2400,
      [TW_FORMAT_STL] = 8,  [TW_FORMAT_PLY] = 32,   [TW_FORMAT_BVH] = 64};
  static_assert(sizeof per_byte == TW_FORMATS * sizeof *per_byte, "each format has a bound");
  const uint64_t base = 1 << 20, most = 64 << 20;
  uint64_t more = size < most ? base + per_byte[format] * size : most;
  return (more < most ? more : most) + 6 * size;
}
