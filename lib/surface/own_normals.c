/* The file's normals and tangents, and its morph targets' displacements of normals, for the surface of level
 * 0, which is the file's mesh itself. */
#include <math.h>
#include <string.h>

#include "surface.h"
#include "weld.h"

/* False with details: they move the points, and the file's normals no longer fit. */
bool tw_has_own_normals(const tw_mesh *mesh, const tw_surface_options *options) {
  return mesh->detail_count == 0 && options->own_normals && options->normals && options->level == 0 &&
         !options->limit && !options->movable && mesh->normals.corners;
}

/* Makes a vector unit. A zero vector stays 0, and a vector of no finite length becomes 0. A vector that is
 * unit up to rounding stays as it is. */
static void make_unit(float *v) {
  double length =
      sqrt((double)v[0] * (double)v[0] + (double)v[1] * (double)v[1] + (double)v[2] * (double)v[2]);
  if (fabs(length - 1) < 1e-6) return;
  for (int i = 0; i < 3; i++) v[i] = length > 0 && isfinite(length) ? (float)((double)v[i] / length) : 0;
}

bool tw_has_all_normals(const tw_mesh *mesh, const tw_surface_options *options) {
  if (!tw_has_own_normals(mesh, options)) return false;
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    float normal[3];
    memcpy(normal, mesh->normals.values + 3 * (size_t)mesh->normals.corners[c], sizeof normal);
    make_unit(normal);
    if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0) return false;
  }
  return true;
}

/* Reads unit normals and, where width is 7, tangents. row: [mesh corners][width]. */
static void read_rows(const tw_mesh *mesh, uint32_t width, float *row) {
  const tw_corner_normals *own = &mesh->normals;
  for (uint32_t c = 0; c < mesh->corner_count; c++, row += width) {
    memcpy(row, own->values + 3 * (size_t)own->corners[c], 3 * sizeof *row);
    make_unit(row);
    if (width == 3) continue;
    memcpy(row + 3, own->tangents + 4 * (size_t)own->corners[c], 4 * sizeof *row);
    make_unit(row + 3);
    row[6] = row[6] < 0 ? -1 : 1;
  }
}

/* Splits the sets of equal rows further where a target displaces normals differently. equal: [mesh corners]
 * the first corner with an equal row; updated. Works on one target at a time, since rows of all targets would
 * take too much memory. */
static tw_status part_by_morphs(const tw_mesh *mesh, tw_arena *arena, uint32_t *equal) {
  enum { WIDTH = 5, HALF = 1 << 16 };
  float *rows = tw_arena_alloc_raw(arena, mesh->corner_count, WIDTH * sizeof *rows);
  tw_status status = rows ? TW_OK : TW_NO_MEMORY;
  for (uint32_t m = 0; m < mesh->morph_count && status == TW_OK; m++) {
    for (uint32_t c = 0; c < mesh->corner_count; c++) {
      float *row = rows + WIDTH * (size_t)c;
      /* Two floats hold the halves of the number exactly. */
      uint32_t high = equal[c] / HALF, low = equal[c] % HALF;
      row[0] = (float)high;
      row[1] = (float)low;
      memcpy(row + 2, mesh->morph_normals[m] + 3 * (size_t)mesh->normals.corners[c], 3 * sizeof *row);
    }
    status = tw_find_equal_rows(rows, WIDTH, mesh->corner_count, equal, NULL);
  }
  return status;
}

tw_status tw_own_normals_read(const tw_surface *surface, const tw_mesh *mesh, tw_arena *arena,
                              tw_own_normals *own) {
  uint32_t count = mesh->corner_count, width = own->tangents && mesh->normals.tangents ? 7 : 3;
  uint32_t *equal = tw_arena_alloc_raw(arena, count, sizeof *equal);
  float *row = tw_arena_alloc_raw(arena, count, width * sizeof *row);
  own->width = width;
  own->rows = row;
  own->splits = tw_arena_alloc(arena, surface->fields[0].base.corner_count, sizeof *own->splits);
  if (!equal || !row || !own->splits) return TW_NO_MEMORY;
  read_rows(mesh, width, row);
  tw_status status = tw_find_equal_rows(row, width, count, equal, NULL);
  if (status == TW_OK && own->morphs) status = part_by_morphs(mesh, arena, equal);
  own->is_whole = true;
  for (uint32_t c = 0; c < count && status == TW_OK; c++, row += width) {
    own->is_whole &= row[0] != 0 || row[1] != 0 || row[2] != 0;
    own->splits[(size_t)surface->cage_step * c] = equal[c];
  }
  return status;
}

static tw_status keep_morphs(tw_surface *s, const tw_mesh *mesh, uint32_t rows) {
  float *out = tw_arena_alloc_raw(s->arena, (size_t)mesh->morph_count * rows, 3 * sizeof *out);
  s->own_morph_normals = out;
  for (uint32_t m = 0; out && m < mesh->morph_count; m++)
    for (uint32_t row = 0; row < rows; row++, out += 3) {
      uint32_t corner = s->vertices.corner_base[row] / s->cage_step;
      memcpy(out, mesh->morph_normals[m] + 3 * (size_t)mesh->normals.corners[corner], 3 * sizeof *out);
    }
  return s->own_morph_normals ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_own_normals_keep(tw_surface *surface, const tw_mesh *mesh, const tw_own_normals *own,
                              uint32_t rows) {
  tw_surface *s = surface;
  s->own_normals = tw_arena_alloc_raw(s->arena, rows, 3 * sizeof *s->own_normals);
  if (own->width > 3) s->own_tangents = tw_arena_alloc_raw(s->arena, rows, 4 * sizeof *s->own_tangents);
  if (!s->own_normals || (own->width > 3 && !s->own_tangents)) return TW_NO_MEMORY;
  for (uint32_t row = 0; row < rows; row++) {
    const float *from = own->rows + (size_t)own->width * (s->vertices.corner_base[row] / s->cage_step);
    memcpy(s->own_normals + 3 * (size_t)row, from, 3 * sizeof *from);
    if (s->own_tangents) memcpy(s->own_tangents + 4 * (size_t)row, from + 3, 4 * sizeof *from);
  }
  return own->morphs ? keep_morphs(s, mesh, rows) : TW_OK;
}
