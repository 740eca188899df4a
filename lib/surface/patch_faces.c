/* Faces of patches. The rows of a face follow from its number by arithmetic. */
#include <string.h>

#include "surface_reader.h"

/* The rows of the inside of a side of a quad. */
typedef struct side_rows {
  uint32_t first, step; /* step: 1, or -1 modulo 2^32 */
} side_rows;

/* The rows from which all rows of a quad's grid follow. */
typedef struct quad_rows {
  uint32_t corners[4], inside;
  side_rows low, right, high, left; /* insides of the sides, each in the direction of growing i or j */
} quad_rows;

/* opposed: the side's first corner is at the end with the greater i or j. */
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

/* The rows of a line of a quad's grid: its ends, and those between them. */
typedef struct line_rows {
  uint32_t left, right;
  side_rows between;
} line_rows;

static line_rows rows_of_line(const quad_rows *q, uint32_t side, uint32_t j) {
  if (j == 0) return (line_rows){q->corners[0], q->corners[1], q->low};
  if (j == side) return (line_rows){q->corners[3], q->corners[2], q->high};
  uint32_t before = j - 1;
  side_rows inside = {q->inside + before * (side - 1), 1};
  return (line_rows){q->left.first + before * q->left.step, q->right.first + before * q->right.step, inside};
}

/* The rows of a face's four corners. */
typedef uint32_t face_rows __attribute__((vector_size(16)));

static inline uint32_t *put_face(face_rows face, uint32_t *out) {
  memcpy(out, &face, sizeof face);
  return out + 4;
}

/* Writes faces i0 to i1 - 1 between two lines of a grid of `side` cells; side is 2 or more. */
static uint32_t *emit_line(const line_rows *below, const line_rows *above, uint32_t side, uint32_t i0,
                           uint32_t i1, uint32_t *out) {
  side_rows low = below->between, high = above->between;
  if (i0 == 0) out = put_face((face_rows){below->left, low.first, high.first, above->left}, out);
  uint32_t i = i0 > 1 ? i0 : 1, last = side - 1;
  const face_rows step = {low.step, low.step, high.step, high.step};
  face_rows face = {low.first, low.first + low.step, high.first + high.step, high.first};
  if (i > 1) face += (i - 1) * step;
  for (; i < i1 && i < last; i++, face += step) out = put_face(face, out);
  if (i1 <= last) return out;
  return put_face((face_rows){face[0], below->right, above->right, face[3]}, out);
}

/* Writes faces `first` to end - 1 of one quad. */
static void emit_quad(const quad_rows *q, uint32_t side, uint32_t first, uint32_t end, uint32_t *out) {
  uint32_t j = first / side;
  line_rows below = rows_of_line(q, side, j);
  for (uint32_t i = first % side, left = end - j * side; left > 0; j++, i = 0) {
    uint32_t i1 = left < side ? left : side;
    line_rows above = rows_of_line(q, side, j + 1);
    out = emit_line(&below, &above, side, i, i1, out);
    below = above;
    left -= i1;
  }
}

void tw_patch_faces(const tw_surface *s, tw_domain domain, uint64_t first, size_t count, uint32_t *out) {
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint64_t cells = (uint64_t)s->side * s->side, face = first, last = first + count;
  while (face < last) {
    uint32_t visible = (uint32_t)(face / cells);
    uint64_t begin = visible * cells, end = begin + cells < last ? begin + cells : last;
    quad_rows quad = rows_of_quad(s, n, visible);
    emit_quad(&quad, s->side, (uint32_t)(face - begin), (uint32_t)(end - begin), out);
    out += 4 * (size_t)(end - face);
    face = end;
  }
}

/* ---- children -------------------------------------------------------------------------------- */

/* The row of point (i, j) of a quad's grid. */
static uint32_t row_at(const quad_rows *q, uint32_t side, uint32_t i, uint32_t j) {
  const line_rows line = rows_of_line(q, side, j);
  if (i == 0) return line.left;
  return i == side ? line.right : line.between.first + (i - 1) * line.between.step;
}

/* A child of a face has its first corner at the face's corner. turn: the first corner of the face, among the
 * corners of its cell of the grid, which are counted from the one with the least i and j. */
uint32_t tw_patch_row_of_child(const tw_surface *s, const tw_numbering *n, uint32_t visible, uint32_t child,
                               uint32_t corner) {
  uint32_t i = 0, j = 0, turn = 0;
  for (uint32_t level = s->depth; level-- > 0;) {
    turn = ((child >> 2 * level) + turn) & 3;
    i = 2 * i + (turn == 1 || turn == 2);
    j = 2 * j + (turn >= 2);
  }
  const quad_rows quad = rows_of_quad(s, n, visible);
  uint32_t at = (corner + turn) & 3;
  return row_at(&quad, s->side, i + (at == 1 || at == 2), j + (at >= 2));
}
