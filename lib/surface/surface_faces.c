/* Reads any faces of a surface: of level 0 those of the cage, of other levels what the evaluator computes. */
#include <assert.h>

#include "surface_reader.h"

/* Corners of each face from level 1 on. */
static uint32_t corners_a_face(const tw_surface *s) {
  return s->fields[0].base.face_size;
}

uint64_t tw_surface_corners_before(const tw_surface *surface, uint64_t face) {
  return surface->options.level == 0 ? surface->corners_before[face] : corners_a_face(surface) * face;
}

uint32_t tw_surface_cage_corner(const tw_surface *surface, uint64_t face) {
  return surface->face_first[face];
}

size_t tw_surface_largest_face(const tw_surface *surface) {
  const tw_surface *s = surface;
  uint64_t largest = s->options.level == 0 ? 3 : corners_a_face(s);
  for (uint32_t f = 0; s->options.level == 0 && f < s->face_count; f++)
    if (s->corners_before[f + 1] - s->corners_before[f] > largest)
      largest = s->corners_before[f + 1] - s->corners_before[f];
  return (size_t)largest;
}

static size_t read_cage_faces(const tw_surface *s, const tw_numbering *n, uint64_t first, size_t count,
                              uint32_t *sizes, uint32_t *out) {
  size_t written = 0;
  for (uint64_t f = first; f < first + count; f++) {
    uint32_t size = (uint32_t)(s->corners_before[f + 1] - s->corners_before[f]);
    if (sizes) sizes[f - first] = size;
    for (uint32_t i = 0; i < size; i++)
      out[written++] = tw_row_of_corner(n, s->cage_step * (s->face_first[f] + i));
  }
  return written;
}

uint32_t tw_surface_cage_place(const tw_surface *surface, uint64_t face, uint32_t shift) {
  uint32_t low = 0, high = surface->face_count;
  const uint64_t *before = surface->corners_before;
  uint32_t guess = (uint32_t)((face >> shift) * high / before[high]); /* where all faces are of one size */
  if (before[guess] << shift <= face && face < before[guess + 1] << shift) return guess;
  while (high - low > 1) {
    uint32_t middle = low + (high - low) / 2;
    if (before[middle] << shift <= face)
      low = middle;
    else
      high = middle;
  }
  return low;
}

/* The children of each face of the cage are contiguous, corner by corner. */
uint32_t tw_surface_shallow_face(const tw_surface *surface, uint64_t face, uint64_t *run) {
  const tw_surface *s = surface;
  const tw_shallow_level *level = &s->levels[0].at[0];
  uint32_t below = s->levels[0].level, shift = 2 * (s->options.level - 1);
  bool is_cage = below == s->options.level;
  uint32_t bits = is_cage ? shift : 2 * below;
  uint64_t own = face; /* in the level's own order */
  if (s->face_first) {
    uint32_t place = tw_surface_cage_place(s, face, shift);
    own = ((uint64_t)s->face_first[place] << shift) + (face - (s->corners_before[place] << shift));
  }
  uint32_t at = (uint32_t)(own >> bits), end = at + 1; /* a corner of the cage, or a quad of the base */
  if (is_cage) {
    at = tw_shallow_corner_face(level, level->face_size, at);
    end = tw_shallow_face_end(level, level->face_size, at);
  }
  *run = ((uint64_t)end << bits) - own;
  return at;
}

tw_face_place tw_surface_face_place(const tw_surface *surface, uint64_t face) {
  const tw_surface *s = surface, *rim = s->rim;
  if (!rim) return (tw_face_place){s, face, UINT64_MAX};
  uint32_t g = 0;
  while (face - s->groups[g].first_face >= s->groups[g].face_count) g++;
  uint64_t of_rim = rim->groups[g].face_count, before = rim->groups[g].first_face,
           own = s->groups[g].face_count - of_rim, at = face - s->groups[g].first_face;
  if (at < own) return (tw_face_place){s, face - before, own - at};
  return (tw_face_place){rim, before + (at - own), of_rim - (at - own)};
}

size_t tw_surface_read_faces(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                             uint32_t *sizes, uint32_t *out) {
  const tw_surface *s = reader->surface;
  if (s->options.level == 0) return read_cage_faces(s, tw_numbering_of(s, domain), first, count, sizes, out);
  for (size_t i = 0; sizes && i < count; i++) sizes[i] = corners_a_face(s);
  uint32_t *to = out;
  for (size_t left = count, taken; left > 0; left -= taken, first += taken) {
    const tw_face_place at = tw_surface_face_place(s, first);
    taken = at.run < left ? (size_t)at.run : left;
    at.part->evaluator->faces(at.part, domain, at.place, taken, to);
    to += corners_a_face(s) * taken;
  }
  return corners_a_face(s) * count;
}

/* ---- points ---------------------------------------------------------------------------------- */

void tw_surface_vertices_of_points(const tw_surface *surface, const tw_topology *level, uint32_t *out) {
  const tw_surface *s = surface;
  if (!s->evaluator->row_of_child) {
    for (uint32_t row = 0; row < s->points.corner_count; row++) out[row] = row;
    return;
  }
  for (uint32_t row = 0; s->options.level == 0 && row < s->cage_points; row++)
    out[row] = s->fields[0].base.corner_vertex[tw_corner_of_row(&s->points, row)];
  uint32_t children = s->side * s->side, size = level->face_size;
  for (uint32_t f = 0; f < s->quad_count; f++)
    for (uint32_t child = 0; child < children; child++)
      for (uint32_t k = 0; k < size; k++)
        out[s->evaluator->row_of_child(s, &s->points, f, child, k)] =
            level->corner_vertex[size * (tw_base_quad(s, f) * children + child) + k];
}
