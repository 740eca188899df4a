/* Reads any faces of a surface: their rows follow from where a face is, by arithmetic. */
#include <assert.h>
#include <string.h>

#include "surface_reader.h"

/* Above level 0. */
static uint32_t corners_a_face(const tw_surface *s) {
  return s->fields[0].base.face_size;
}

uint64_t tw_surface_corners_before(const tw_surface *surface, uint64_t face) {
  return surface->options.level == 0 ? surface->corners_before[face] : corners_a_face(surface) * face;
}

/* A run of rows along a side of a quad. */
typedef struct side_rows {
  uint32_t first, step; /* step: 1, or -1 modulo 2^32 */
} side_rows;

/* What the rows of a quad's grid follow from. */
typedef struct quad_rows {
  uint32_t corners[4], inside;
  side_rows low, right, high, left; /* along i and j */
} quad_rows;

/* opposed: the side's corner comes last along i or j. */
static side_rows rows_of_side(const tw_surface *s, const tw_numbering *n, uint32_t corner, bool opposed) {
  uint32_t edge = tw_row_of_edge(n, corner), inside = s->side - 1;
  uint32_t begin = n->corner_count + (edge >> 1) * inside;
  bool backwards = ((edge & 1) != 0) != opposed;
  return backwards ? (side_rows){begin + inside - 1, UINT32_MAX} : (side_rows){begin, 1};
}

static quad_rows rows_of_quad(const tw_surface *s, const tw_numbering *n, uint32_t visible) {
  uint32_t corner = 4 * tw_base_quad(s, visible), inside = s->side - 1;
  quad_rows q = {.low = rows_of_side(s, n, corner, false),
                 .right = rows_of_side(s, n, corner + 1, false),
                 .high = rows_of_side(s, n, corner + 2, true),
                 .left = rows_of_side(s, n, corner + 3, true)};
  for (uint32_t k = 0; k < 4; k++) q.corners[k] = tw_row_of_corner(n, corner + k);
  q.inside = n->corner_count + n->edge_count * inside + visible * inside * inside;
  return q;
}

/* Rows of line j of a quad's grid: out[side + 1]. */
static void index_line(const quad_rows *q, uint32_t side, uint32_t j, uint32_t *out) {
  side_rows run = {q->inside + (j - 1) * (side - 1), 1};
  if (j == 0) {
    run = q->low;
    out[0] = q->corners[0];
    out[side] = q->corners[1];
  } else if (j == side) {
    run = q->high;
    out[0] = q->corners[3];
    out[side] = q->corners[2];
  } else {
    out[0] = q->left.first + (j - 1) * q->left.step;
    out[side] = q->right.first + (j - 1) * q->right.step;
  }
  for (uint32_t i = 1; i < side; i++) out[i] = run.first + (i - 1) * run.step;
}

/* Faces i0 to i1 - 1 of the line between two rows of indices. */
static void emit_line(const uint32_t *low, const uint32_t *high, uint32_t i0, uint32_t i1, uint32_t *out) {
  for (uint32_t i = i0; i < i1; i++, out += 4) {
    out[0] = low[i];
    out[1] = low[i + 1];
    out[2] = high[i + 1];
    out[3] = high[i];
  }
}

static size_t read_quads(tw_surface_reader *r, const tw_numbering *n, uint64_t first, size_t count,
                         uint32_t *out) {
  const tw_surface *s = r->surface;
  uint32_t side = s->side;
  assert(side > 0);
  uint64_t face = first, end = first + count;
  quad_rows quad = {.inside = 0};
  while (face < end) {
    uint32_t visible = (uint32_t)(face / ((uint64_t)side * side)),
             cell = (uint32_t)(face % ((uint64_t)side * side));
    uint32_t j = cell / side, i0 = cell % side, i1 = side;
    if (i0 + (end - face) < side) i1 = i0 + (uint32_t)(end - face);
    if (cell == 0 || face == first) quad = rows_of_quad(s, n, visible);
    if (i0 == 0 && j > 0 && face > first) {
      uint32_t *swap = r->index_rows[0];
      r->index_rows[0] = r->index_rows[1];
      r->index_rows[1] = swap;
    } else {
      index_line(&quad, side, j, r->index_rows[0]);
    }
    index_line(&quad, side, j + 1, r->index_rows[1]);
    emit_line(r->index_rows[0], r->index_rows[1], i0, i1, out);
    out += 4 * (size_t)(i1 - i0);
    face += i1 - i0;
  }
  return 4 * count;
}

/* Where the base is the answer. */
static size_t read_base_faces(const tw_surface *s, const tw_numbering *n, uint64_t first, size_t count,
                              uint32_t *out) {
  uint32_t size = corners_a_face(s);
  if (s->shallow.level > 0) {
    tw_shallow_quads(&s->shallow, (uint32_t)first, (uint32_t)count, out);
    return size * count;
  }
  if (s->loop.levels > 0) {
    tw_loop_rows_triangles(&s->loop, (uint32_t)first, (uint32_t)count, out);
    return size * count;
  }
  if (s->plain) {
    memcpy(out, s->fields[0].base.corner_vertex + size * (size_t)first, count * size * sizeof *out);
    return size * count;
  }
  for (size_t i = 0; i < count; i++) {
    uint32_t corner = size * tw_base_quad(s, (uint32_t)(first + i));
    for (uint32_t k = 0; k < size; k++) *out++ = tw_row_of_corner(n, corner + k);
  }
  return size * count;
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

size_t tw_surface_read_faces(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                             uint32_t *sizes, uint32_t *out) {
  const tw_surface *s = reader->surface;
  const tw_numbering *n = tw_numbering_of(s, domain);
  if (s->options.level == 0) return read_cage_faces(s, n, first, count, sizes, out);
  for (size_t i = 0; sizes && i < count; i++) sizes[i] = corners_a_face(s);
  if (s->depth == 0) return read_base_faces(s, n, first, count, out);
  return read_quads(reader, n, first, count, out);
}
