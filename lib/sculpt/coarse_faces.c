/* Walks over the faces of a piece from edge to edge, deriving the part of each from its neighbour's. */
#include "coarse_faces.h"

#include <string.h>

enum { MIDDLE_CHILD = 3, UNSEEN = UINT8_MAX };

typedef enum role { ROLE_STAYS, ROLE_MIDDLE, ROLE_FACE_POINT } role;

static role role_at(const tw_topology *t, uint8_t part, uint32_t i) {
  static const role quad[4] = {ROLE_STAYS, ROLE_MIDDLE, ROLE_FACE_POINT, ROLE_MIDDLE};
  if (t->face_size == 4) return quad[(i - part) & 3];
  return i == part ? ROLE_STAYS : ROLE_MIDDLE;
}

/* The part of the neighbour across edge i of a face that has `part`. j: the neighbour's corner at that
 * edge. */
static uint8_t quad_part_across(uint8_t part, uint32_t i, uint32_t j) {
  switch ((i - part) & 3) {
  case 0: return (uint8_t)((j + 1) & 3); /* edge from the parent's vertex to the middle */
  case 1: return (uint8_t)((j + 2) & 3); /* edge from the middle to the face point */
  case 2: return (uint8_t)((j + 3) & 3); /* edge from the face point to the other middle */
  default: return (uint8_t)j;            /* edge from the other middle to the parent's vertex */
  }
}

static uint8_t triangle_part_across(uint8_t part, uint32_t i, uint32_t j) {
  if (part == MIDDLE_CHILD) return (uint8_t)((j + 2) % 3);
  if (i == part) return (uint8_t)((j + 1) % 3);
  return (uint8_t)(i == (part + 1u) % 3 ? MIDDLE_CHILD : j);
}

static uint8_t part_across(const tw_topology *t, uint8_t part, uint32_t i, uint32_t j) {
  return t->face_size == 4 ? quad_part_across(part, i, j) : triangle_part_across(part, i, j);
}

/* Whether edge i of a face may be a border: it must lie on an edge of the parent, not inside the parent. */
static bool may_end(const tw_topology *t, uint8_t part, uint32_t i) {
  return role_at(t, part, i) == ROLE_STAYS || role_at(t, part, (i + 1) % t->face_size) == ROLE_STAYS;
}

/* Whether the corner's vertex has the number of faces and the flags that its role demands. */
static bool fits(const tw_topology *t, uint8_t part, uint32_t corner) {
  uint32_t vertex = t->corner_vertex[corner], faces = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  uint8_t flags = t->vertex_flags[vertex];
  switch (role_at(t, part, corner % t->face_size)) {
  case ROLE_MIDDLE:
    if (flags & TW_VERTEX_NONMANIFOLD) return false;
    return faces == (flags & TW_VERTEX_BORDER ? 1u : 2u) * (t->face_size == 4 ? 2u : 3u);
  case ROLE_FACE_POINT: return flags == 0 && faces >= 3;
  case ROLE_STAYS: break;
  }
  return true;
}

bool tw_coarse_parts(const tw_topology *t, uint32_t face, uint8_t part, uint8_t *parts, uint32_t *faces,
                     tw_piece *piece) {
  bool is_refined = true;
  uint32_t count = 1;
  faces[0] = face;
  parts[face] = part;
  for (uint32_t done = 0; done < count; done++) {
    uint32_t f = faces[done];
    for (uint32_t i = 0; i < t->face_size; i++) {
      uint32_t corner = t->face_size * f + i, other = t->sibling[corner], g = other / t->face_size;
      is_refined &= fits(t, parts[f], corner);
      if (other == corner) {
        is_refined &= may_end(t, parts[f], i);
        continue;
      }
      uint8_t there = part_across(t, parts[f], i, other % t->face_size);
      if (parts[g] == UNSEEN) {
        parts[g] = there;
        faces[count++] = g;
      }
      is_refined &= parts[g] == there;
    }
  }
  *piece = (tw_piece){count, faces};
  return is_refined;
}

/* ---- parents --------------------------------------------------------------------------------- */

static void add_quads(const tw_topology *t, const uint8_t *parts, uint32_t face, uint8_t *seen,
                      tw_coarse_faces *out) {
  uint32_t inner = 4 * face + ((parts[face] + 2u) & 3), point = t->corner_vertex[inner];
  if (seen[point]) return;
  seen[point] = 1;
  uint32_t first = t->fan_offsets[point], size = t->fan_offsets[point + 1] - first, start = 0;
  while (t->fan_corners[first + start] != inner) start++;
  /* The quad's opposite corner, `^ 2`, is a vertex of the parent. */
  for (uint32_t i = 0; i < size; i++)
    out->origins[out->corner_count++] = t->fan_corners[first + (start + i) % size] ^ 2;
  out->face_offsets[++out->face_count] = out->corner_count;
}

static void add_triangles(const tw_topology *t, const uint8_t *parts, uint32_t face, uint8_t *seen,
                          tw_coarse_faces *out) {
  uint32_t begin = 3 * face; /* a corner of the middle child, where its walk round the others begins */
  if (parts[face] != MIDDLE_CHILD) begin = t->sibling[begin + (parts[face] + 1u) % 3];
  uint32_t middle = begin / 3;
  if (seen[middle]) return;
  seen[middle] = 1;
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t child = t->sibling[3 * middle + (begin + i) % 3] / 3;
    out->origins[out->corner_count++] = 3 * child + parts[child];
  }
  out->face_offsets[++out->face_count] = out->corner_count;
}

void tw_coarse_faces_of(const tw_topology *t, const uint8_t *parts, const tw_piece *piece, uint8_t *seen,
                        tw_coarse_faces *out) {
  out->face_count = out->corner_count = 0;
  out->face_offsets[0] = 0;
  for (uint32_t i = 0; i < piece->face_count; i++)
    if (t->face_size == 4)
      add_quads(t, parts, piece->faces[i], seen, out);
    else
      add_triangles(t, parts, piece->faces[i], seen, out);
}
