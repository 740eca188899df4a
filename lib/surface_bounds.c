/* Exact bounds by one pass over the points, which are not kept. */
#include <string.h>

#include "surface.h"

enum { BLOCK_ROWS = 2048 };

static void widen(float bounds[2][3], const float *point, bool first) {
  for (int c = 0; c < 3; c++) {
    if (first || point[c] < bounds[0][c]) bounds[0][c] = point[c];
    if (first || point[c] > bounds[1][c]) bounds[1][c] = point[c];
  }
}

/* Split vertices repeat their points, so the bounds of the points are those of the vertices. The
 * displacements of morph targets stand in the rows of the vertices alone. */
static tw_status compute(const tw_surface *s, int morph, float bounds[2][3]) {
  tw_domain domain = morph < 0 ? TW_DOMAIN_POINTS : TW_DOMAIN_VERTICES;
  uint32_t width = morph < 0 ? 3 : s->layout.stride,
           offset = morph < 0 ? 0 : s->layout.morphs + 3 * (uint32_t)morph;
  tw_arena *arena = tw_arena_create();
  float *block = arena ? tw_arena_alloc(arena, BLOCK_ROWS, width * sizeof *block) : NULL;
  tw_surface_reader *reader = tw_surface_reader_create(s);
  memset(bounds, 0, 2 * sizeof *bounds);
  if (block && reader) {
    uint64_t rows = tw_surface_row_count(s, domain);
    for (uint64_t first = 0; first < rows; first += BLOCK_ROWS) {
      size_t count = rows - first < BLOCK_ROWS ? (size_t)(rows - first) : BLOCK_ROWS;
      tw_surface_read_rows(reader, domain, first, count, block);
      for (size_t i = 0; i < count; i++) widen(bounds, block + i * width + offset, first + i == 0);
    }
  }
  tw_status status = block && reader ? TW_OK : TW_NO_MEMORY;
  tw_surface_reader_destroy(reader);
  tw_arena_destroy(arena);
  return status;
}

enum { BOUNDS_UNKNOWN, BOUNDS_BEING_WRITTEN, BOUNDS_KNOWN };

tw_status tw_surface_bounds(const tw_surface *surface, int morph, float min[3], float max[3]) {
  size_t slot = (size_t)(morph + 1);
  float bounds[2][3];
  if (atomic_load(&surface->bounds_ready[slot]) == BOUNDS_KNOWN) {
    memcpy(bounds, surface->bounds[slot], sizeof bounds);
  } else {
    tw_status status = compute(surface, morph, bounds);
    if (status != TW_OK) return status;
    /* Two threads may both have computed them, with the same result; one of them keeps it. */
    int expected = BOUNDS_UNKNOWN;
    if (atomic_compare_exchange_strong(&surface->bounds_ready[slot], &expected, BOUNDS_BEING_WRITTEN)) {
      memcpy(surface->bounds[slot], bounds, sizeof bounds);
      atomic_store(&surface->bounds_ready[slot], BOUNDS_KNOWN);
    }
  }
  memcpy(min, bounds[0], sizeof bounds[0]);
  memcpy(max, bounds[1], sizeof bounds[1]);
  return TW_OK;
}
