/* Normals and tangents of the file, and what its morph targets add to the normals, for the surface of level
 * 0, which is the file's mesh itself. */
#include <math.h>

#include "surface.h"
#include "weld.h"

bool tw_has_own_normals(const tw_mesh *mesh, const tw_surface_options *options) {
  return options->own_normals && options->normals && options->level == 0 && !options->limit &&
         !options->movable && mesh->normals.corners;
}

/* All 0 stays so, and what has no finite length becomes 0. What is unit but for rounding stays as it is. */
static void make_unit(float *v) {
  double length =
      sqrt((double)v[0] * (double)v[0] + (double)v[1] * (double)v[1] + (double)v[2] * (double)v[2]);
  if (fabs(length - 1) < 1e-6) return;
  for (int i = 0; i < 3; i++) v[i] = length > 0 && isfinite(length) ? (float)((double)v[i] / length) : 0;
}

float *tw_own_normals_read(const tw_mesh *mesh, bool tangents, tw_arena *arena, uint32_t *width,
                           uint32_t *equal) {
  const tw_corner_normals *own = &mesh->normals;
  bool has_tangents = tangents && own->tangents;
  *width = has_tangents ? 7 : 3;
  float *rows = tw_arena_alloc_raw(arena, mesh->corner_count, *width * sizeof *rows), *row = rows;
  for (uint32_t c = 0; rows && c < mesh->corner_count; c++, row += *width) {
    memcpy(row, own->values + 3 * (size_t)own->corners[c], 3 * sizeof *row);
    make_unit(row);
    if (!has_tangents) continue;
    memcpy(row + 3, own->tangents + 4 * (size_t)own->corners[c], 4 * sizeof *row);
    make_unit(row + 3);
    row[6] = row[6] < 0 ? -1 : 1;
  }
  if (!rows || tw_find_equal_rows(rows, *width, mesh->corner_count, equal, NULL) != TW_OK) return NULL;
  return rows;
}

/* A target at a time, since all together would take too much memory. */
tw_status tw_own_normals_part(const tw_mesh *mesh, tw_arena *arena, uint32_t *equal) {
  enum { WIDTH = 5, HALF = 1 << 16 };
  float *rows = tw_arena_alloc_raw(arena, mesh->corner_count, WIDTH * sizeof *rows);
  tw_status status = rows ? TW_OK : TW_NO_MEMORY;
  for (uint32_t m = 0; m < mesh->morph_count && status == TW_OK; m++) {
    for (uint32_t c = 0; c < mesh->corner_count; c++) {
      float *row = rows + WIDTH * (size_t)c;
      row[0] = (float)(equal[c] / HALF); /* floats hold half of a number exactly */
      row[1] = (float)(equal[c] % HALF);
      memcpy(row + 2, mesh->morph_normals[m] + 3 * (size_t)mesh->normals.corners[c], 3 * sizeof *row);
    }
    status = tw_find_equal_rows(rows, WIDTH, mesh->corner_count, equal, NULL);
  }
  return status;
}
