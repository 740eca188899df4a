/* meshoptimizer allocates here by operator new, whose exceptions end in this file. */
#include <meshoptimizer.h>

#include <new>

#include "pack_reader.h"

bool tw_order_triangles(uint32_t *indices, size_t count, uint32_t vertex_count) {
  try {
    meshopt_optimizeVertexCacheStrip(indices, indices, count, vertex_count);
    return true;
  } catch (const std::bad_alloc &) {
    return false;
  }
}
