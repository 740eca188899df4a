/* Bounds the memory that reading a file takes. */
#include "tweend/format.h"

/* per_byte: memory that a byte of small text may become. An object of an OBJ file becomes a mesh and a node,
 * "{}," in tweend JSON likewise, and in glTF tinygltf's struct for a material. A joint of a BVH file takes
 * 7 bytes, "JOINT{}". The readers of OBJ, tweend JSON and STL keep the bound by construction, those of glTF,
 * PLY and BVH by a budget. */
uint64_t tw_reading_size(tw_format format, uint64_t size) {
  static const uint64_t per_byte[TW_FORMATS] = {10, 192, 2400, 2400, 8, 32, 64}, base = 1 << 20,
                        most = 64 << 20;
  uint64_t more = size < most ? base + per_byte[format] * size : most;
  return (more < most ? more : most) + 6 * size;
}
