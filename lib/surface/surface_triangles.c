/* Rows of Loop's scheme that hold points and normals alone, at levels that would take much memory: the base
 * is a level some steps above, and its triangles are computed when they are read (loop_lattice.h). Triangles
 * at creases, borders and irregular vertices are kept: their part of the answer shrinks with each level of
 * the base.
 *
 * Rows are at corners, along the insides of edges, over the insides of triangles, there by j, then i. */
#include <string.h>

#include "loop_lattice.h"
#include "sorted.h"
#include "surface_plan.h"
#include "surface_reader.h"

/* Fewer faces take some tens of MB by generic steps. With fewer levels to go on from the base, a triangle
 * takes longer to begin with than generic steps take for it; on a base above the second level most triangles
 * are beside something irregular. */
enum { FACES_MIN = 1 << 20, BASE_FACES_MAX = 1 << 16, BASE_MIN = 2, DEPTH_MIN = 3 };

/* ---- the plan ------------------------------------------------------------------------------- */

static bool fits(const tw_surface_builder *b) {
  return b->surface->counts.faces > FACES_MIN && b->surface->options.level >= BASE_MIN + DEPTH_MIN &&
         tw_loop_evaluator.fits(b);
}

/* The deepest level that is small. */
static tw_status start(tw_surface_builder *b, tw_error *error) {
  uint32_t level = b->surface->options.level,
           base = level > TW_LATTICE_DEPTH_MAX + BASE_MIN ? level - TW_LATTICE_DEPTH_MAX : BASE_MIN;
  uint64_t faces = (uint64_t)b->cage.topology.face_count << 2 * (base + 1);
  (void)error;
  for (; base + DEPTH_MIN < level && faces <= BASE_FACES_MAX; faces *= 4) base++;
  b->levels = base;
  b->surface->depth = level - base;
  return TW_OK;
}

/* Lists the faces that are not regular. */
static tw_status make(tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  const tw_topology *t = &s->fields[0].base;
  (void)error;
  s->kept_faces = tw_arena_alloc_raw(s->arena, t->face_count, sizeof *s->kept_faces);
  if (!s->kept_faces) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < t->face_count; f++)
    if (!tw_lattice_is_regular(t, f)) s->kept_faces[s->kept_face_count++] = f;
  s->scratch_points = (uint32_t)(tw_lattice_scratch(s->depth) / 4 + 1);
  return TW_OK;
}

static uint32_t kept_width(const tw_surface *s) {
  return s->options.normals ? 6 : 3;
}

static tw_status place(tw_surface *s, double **base, const tw_parallel_for *parallel) {
  const tw_lattice_job job = {.topology = &s->fields[0].base,
                              .rules = &s->rules,
                              .positions = *base,
                              .faces = s->kept_faces,
                              .count = s->kept_face_count,
                              .depth = s->depth,
                              .width = kept_width(s),
                              .parallel = parallel};
  s->positions.kept = tw_alloc(s->kept_face_count, tw_lattice_points(s->side) * job.width * sizeof(float));
  if (!s->positions.kept) return TW_NO_MEMORY;
  tw_status status = tw_lattice_steps(&job, s->positions.kept);
  s->positions.exact = *base;
  *base = NULL;
  return status;
}

/* ---- rows ----------------------------------------------------------------------------------- */

/* The place in a face's lattice of point (i, j) of the lattice that begins with another of its corners. */
static uint32_t place_from(uint32_t side, uint32_t turn, uint32_t i, uint32_t j) {
  uint32_t k = side - i - j;
  return turn == 0 ? tw_lattice_place(side, i, j)
                   : tw_lattice_place(side, turn == 1 ? k : j, turn == 1 ? i : k);
}

/* own.quad: the corner that the lattice begins with. own.rect: its points, as far as i + j is less than the
 * side. */
static void points(tw_surface_reader *r, const tw_block *block, float *out, float *normals, uint32_t stride) {
  const tw_surface *s = r->surface;
  const tw_patch_rect rect = block->own.rect;
  uint32_t corner = block->own.quad, side = s->side, width = kept_width(s),
           kept = tw_lower_bound(s->kept_faces, s->kept_face_count, corner / 3);
  bool is_kept = kept < s->kept_face_count && s->kept_faces[kept] == corner / 3;
  const float *rows = s->positions.kept + (size_t)kept * tw_lattice_points(side) * width;
  const tw_lattice_rect wanted = {(int32_t)rect.i0, (int32_t)rect.i1, (int32_t)rect.j0, (int32_t)rect.j1};
  tw_lattice lattice = {NULL, 0};
  if (!is_kept)
    lattice = tw_lattice_refine(&s->fields[0].base, s->positions.exact, corner, s->depth, wanted, r->scratch);
  for (uint32_t j = rect.j0; j <= rect.j1; j++)
    for (uint32_t i = rect.i0; i <= rect.i1 && i + j < side; i++, out += stride) {
      if (!is_kept) {
        tw_lattice_row(&lattice, i, j, out, normals);
      } else {
        const float *row = rows + (size_t)place_from(side, corner % 3, i, j) * width;
        memcpy(out, row, 3 * sizeof *out);
        if (normals) memcpy(normals, row + 3, 3 * sizeof *out);
      }
      if (normals) normals += stride;
    }
}

/* The lattice of a corner, an edge or a triangle, and the part of it that has rows there. */
static tw_patch_place place_of(const tw_surface *s, const tw_numbering *n, tw_piece_kind kind,
                               uint32_t item) {
  uint32_t last = s->side - 1;
  if (kind == TW_PIECE_CORNERS) return (tw_patch_place){tw_corner_of_row(n, item), {0, 0, 0, 0}, false};
  if (kind == TW_PIECE_EDGES) return (tw_patch_place){tw_corner_of_edge(n, item), {1, last, 0, 0}, false};
  return (tw_patch_place){3 * tw_base_quad(s, item), {1, last, 1, last}, false};
}

static void read(tw_surface_reader *r, tw_domain domain, const tw_piece *piece, float *out) {
  const tw_surface *s = r->surface;
  uint32_t rows = piece->count / piece->items;
  size_t size = (size_t)rows * tw_row_width(s, domain);
  for (uint32_t i = 0; i < piece->items; i++, out += size) {
    const tw_patch_place at = place_of(s, tw_numbering_of(s, domain), piece->kind, piece->item + i);
    const tw_block block = {.first = piece->item + i, .count = rows, .own = at, .shared = at};
    tw_assemble_rows(r, domain, &block, out);
  }
}

/* ---- faces ---------------------------------------------------------------------------------- */

/* The row of a point inside an edge: `along` counts from the corner on. */
static uint32_t row_in_edge(const tw_surface *s, const tw_numbering *n, uint32_t corner, uint32_t along) {
  uint32_t edge = tw_row_of_edge(n, corner), inside = s->side - 1;
  uint32_t first = n->corner_count + (edge >> 1) * inside;
  return first + (edge & 1 ? inside - along : along - 1);
}

static uint32_t row_of_point(const tw_surface *s, const tw_numbering *n, uint32_t visible, uint32_t i,
                             uint32_t j) {
  uint32_t side = s->side, k = side - i - j, corner = 3 * tw_base_quad(s, visible);
  if (i == side || j == side || k == side)
    return tw_row_of_corner(n, corner + (i == side ? 1 : j == side ? 2 : 0));
  if (j == 0) return row_in_edge(s, n, corner, i);
  if (k == 0) return row_in_edge(s, n, corner + 1, j);
  if (i == 0) return row_in_edge(s, n, corner + 2, k);
  uint32_t first = n->corner_count + n->edge_count * (side - 1) + visible * (uint32_t)tw_rows_inside_face(s);
  return first + (j - 1) * (side - 1) - j * (j - 1) / 2 + i - 1;
}

/* The corners of a face of the lattice: a line of faces between j and j + 1 has two of them for each i, but
 * for the last one. */
static void corners_of_face(uint32_t side, uint32_t face, uint32_t corners[3][2]) {
  uint32_t j = 0;
  while (face >= 2 * (side - j) - 1) face -= 2 * (side - j++) - 1;
  uint32_t i = face / 2, turned = face % 2;
  const uint32_t at[3][2] = {{i + turned, j}, {i + 1, j + turned}, {i, j + 1}};
  memcpy(corners, at, sizeof at);
}

static void faces(const tw_surface *s, tw_domain domain, uint64_t first, size_t count, uint32_t *out) {
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint64_t each = (uint64_t)s->side * s->side;
  for (uint64_t face = first; face < first + count; face++) {
    uint32_t corners[3][2];
    corners_of_face(s->side, (uint32_t)(face % each), corners);
    for (int k = 0; k < 3; k++)
      *out++ = row_of_point(s, n, (uint32_t)(face / each), corners[k][0], corners[k][1]);
  }
}

static uint32_t row_of_child(const tw_surface *s, const tw_numbering *n, uint32_t visible, uint32_t child,
                             uint32_t corner) {
  uint32_t corners[3][2];
  tw_lattice_child(s->depth, child, corners);
  return row_of_point(s, n, visible, corners[corner][0], corners[corner][1]);
}

/* Rows have no other columns. */
const tw_evaluator tw_triangle_evaluator = {.fits = fits,
                                            .start = start,
                                            .make = make,
                                            .place = place,
                                            .reads_base = true,
                                            .read = read,
                                            .points = points,
                                            .faces = faces,
                                            .row_of_child = row_of_child};
