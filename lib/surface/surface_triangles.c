/* Rows of Loop's scheme at levels that would take much memory: the base is a level some steps above, and its
 * triangles are computed when they are read (loop_lattice.h). Of triangles at creases, borders, seams and
 * irregular vertices the values are kept: their part of the answer shrinks with each level of the base.
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

static uint32_t least_base(const tw_surface_builder *b) {
  uint32_t deepest = tw_deepest_detail(&b->surface->details);
  return deepest > BASE_MIN ? deepest : BASE_MIN;
}

/* Tangents, joints and whole numbers are for generic steps. */
static bool fits(const tw_surface_builder *b) {
  const tw_surface *s = b->surface;
  if (s->options.scheme != TW_LOOP || s->counts.faces <= FACES_MIN || b->inner) return false;
  if (tw_builder_has_tangents(b) || b->mesh->skin.joints || b->has_whole_numbers) return false;
  return s->options.level >= least_base(b) + DEPTH_MIN && !tw_builder_crosses_seams(b);
}

/* The deepest level that is small. */
static tw_status start(tw_surface_builder *b, tw_error *error) {
  uint32_t level = b->surface->options.level, least = least_base(b),
           base = level > TW_LATTICE_DEPTH_MAX + least ? level - TW_LATTICE_DEPTH_MAX : least;
  uint64_t faces = (uint64_t)b->cage.topology.face_count << 2 * (base + 1);
  (void)error;
  for (; base + DEPTH_MIN < level && faces <= BASE_FACES_MAX; faces *= 4) base++;
  b->levels = base;
  b->surface->depth = level - base;
  return TW_OK;
}

/* Lists the faces whose values are kept: those that are not regular, among those that are shown. */
static tw_status list_kept(const tw_surface_builder *b, tw_field *field) {
  const tw_topology *t = &field->base;
  field->kept_faces = tw_arena_alloc_raw(b->surface->arena, t->face_count, sizeof *field->kept_faces);
  if (!field->kept_faces) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < t->face_count && !field->linear; f++)
    if ((!b->part || b->part[f]) && !tw_lattice_is_regular(t, f))
      field->kept_faces[field->kept_face_count++] = f;
  return TW_OK;
}

static tw_lattice_source source_of(const tw_surface *s, const tw_values *values) {
  return (tw_lattice_source){&s->fields[values->field].base, values->exact, values->base, values->width};
}

static tw_lattice_job job_for(const tw_surface *s, const tw_values *values, const tw_rules *rules,
                              const tw_parallel_for *parallel) {
  const tw_field *field = &s->fields[values->field];
  return (tw_lattice_job){.source = source_of(s, values),
                          .rules = rules,
                          .faces = field->kept_faces,
                          .count = field->kept_face_count,
                          .depth = s->depth,
                          .limit = s->options.limit,
                          .normals = s->options.normals && values == &s->positions,
                          .parallel = parallel};
}

static size_t kept_size(const tw_surface *s, const tw_lattice_job *job) {
  return tw_lattice_points(s->side) * (size_t)tw_lattice_width(job) * sizeof(float);
}

/* Keeps values that are not positions. */
static tw_status keep(tw_surface_builder *b, tw_values *values) {
  tw_surface *s = b->surface;
  const tw_rules rules = tw_builder_rules(b, values->field);
  const tw_lattice_job job = job_for(s, values, &rules, b->parallel);
  values->kept = tw_arena_alloc_raw(s->arena, job.count, kept_size(s, &job));
  return values->kept ? tw_lattice_steps(&job, values->kept) : TW_NO_MEMORY;
}

static tw_status make(tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  tw_status status = TW_OK;
  (void)error;
  for (uint32_t f = 0; f < s->field_count && status == TW_OK; f++) status = list_kept(b, &s->fields[f]);
  for (uint32_t i = 0; i < b->mesh->uv_set_count && status == TW_OK; i++) status = keep(b, &s->uvs[i]);
  for (uint32_t i = 0; i < tw_smooth_set_count(s) && status == TW_OK; i++) status = keep(b, &s->smooth[i]);
  s->scratch_points = (uint32_t)(tw_lattice_scratch(s->depth) / 4 + 1);
  return status;
}

static tw_status place(tw_surface *s, double **base, const tw_parallel_for *parallel) {
  tw_values *positions = &s->positions;
  positions->exact = *base;
  *base = NULL;
  const tw_lattice_job job = job_for(s, positions, &s->rules, parallel);
  positions->kept = tw_alloc(job.count, kept_size(s, &job));
  return positions->kept ? tw_lattice_steps(&job, positions->kept) : TW_NO_MEMORY;
}

/* ---- rows ----------------------------------------------------------------------------------- */

/* The place in a face's lattice of point (i, j) of the lattice that begins with another of its corners. */
static uint32_t place_from(uint32_t side, uint32_t turn, uint32_t i, uint32_t j) {
  uint32_t k = side - i - j;
  return turn == 0 ? tw_lattice_place(side, i, j)
                   : tw_lattice_place(side, turn == 1 ? k : j, turn == 1 ? i : k);
}

/* Where values come from: a lattice, or rows that are kept. */
typedef struct triangle {
  tw_lattice_source source;
  const float *kept; /* [tw_lattice_points][width], or NULL */
  tw_lattice lattice;
  uint32_t corner, side, width;
  bool is_linear, limit;
} triangle;

static triangle begin_triangle(const tw_surface_reader *r, const tw_values *values,
                               const tw_patch_place *at) {
  const tw_surface *s = r->surface;
  const tw_field *field = &s->fields[values->field];
  const tw_rules *rules = &s->rules;
  const tw_lattice_job job = job_for(s, values, rules, NULL);
  triangle t = {.source = job.source,
                .corner = at->quad,
                .side = s->side,
                .width = tw_lattice_width(&job),
                .is_linear = field->linear,
                .limit = s->options.limit};
  const tw_lattice_rect wanted = {(int32_t)at->rect.i0, (int32_t)at->rect.i1, (int32_t)at->rect.j0,
                                  (int32_t)at->rect.j1};
  uint32_t kept = tw_lower_bound(field->kept_faces, field->kept_face_count, at->quad / 3);
  if (kept < field->kept_face_count && field->kept_faces[kept] == at->quad / 3)
    t.kept = values->kept + (size_t)kept * tw_lattice_points(s->side) * t.width;
  else if (!t.is_linear)
    t.lattice = tw_lattice_refine(&t.source, at->quad, s->depth, wanted, r->scratch);
  return t;
}

/* Writes the value and the normal at a point. out, normal: NULL where not wanted. */
static void put_row(const triangle *t, uint32_t i, uint32_t j, float *out, float *normal) {
  if (t->kept) {
    const float *row = t->kept + (size_t)place_from(t->side, t->corner % 3, i, j) * t->width;
    if (out) memcpy(out, row, t->source.width * sizeof *out);
    if (normal) memcpy(normal, row + 3, 3 * sizeof *normal);
  } else if (t->is_linear) {
    tw_lattice_linear(&t->source, t->corner, t->side, i, j, out);
  } else {
    if (out) tw_lattice_value(&t->lattice, i, j, t->limit, out);
    if (normal) tw_lattice_normal(&t->lattice, i, j, normal);
  }
}

/* at->quad: the corner that the lattice begins with. at->rect: its points, as far as i + j is less than the
 * side. */
static void evaluate(const tw_surface_reader *r, const tw_values *values, const tw_patch_place *at,
                     float *out, float *normals, uint32_t stride) {
  const tw_patch_rect rect = at->rect;
  const triangle t = begin_triangle(r, values, at);
  for (uint32_t j = rect.j0; j <= rect.j1; j++)
    for (uint32_t i = rect.i0; i <= rect.i1 && i + j < t.side; i++) {
      put_row(&t, at->backwards ? rect.i0 + rect.i1 - i : i, j, out, normals);
      if (out) out += stride;
      if (normals) normals += stride;
    }
}

/* Points come from the place that represents them, normals from the rows' own place. */
static void points(tw_surface_reader *r, const tw_block *block, float *out, float *normals, uint32_t stride) {
  const tw_patch_place *own = &block->own, *shared = &block->shared;
  bool apart = own->quad != shared->quad || own->backwards != shared->backwards;
  evaluate(r, &r->surface->positions, shared, out, apart ? NULL : normals, stride);
  if (apart && normals) evaluate(r, &r->surface->positions, own, NULL, normals, stride);
}

/* Values of points are shared by the rows of a point. */
static void values(tw_surface_reader *r, const tw_values *values, const tw_block *block, float *out,
                   uint32_t stride) {
  evaluate(r, values, values->field > 0 ? &block->own : &block->shared, out, NULL, stride);
}

/* The lattice of a corner, of the edge that begins there or of a triangle, and the part of it that has rows
 * there. */
static tw_patch_place place_of(const tw_surface *s, tw_piece_kind kind, uint32_t corner, bool backwards) {
  uint32_t last = s->side - 1;
  if (kind == TW_PIECE_CORNERS) return (tw_patch_place){corner, {0, 0, 0, 0}, false};
  if (kind == TW_PIECE_EDGES) return (tw_patch_place){corner, {1, last, 0, 0}, backwards};
  return (tw_patch_place){corner, {1, last, 1, last}, false};
}

static uint32_t corner_of(const tw_surface *s, const tw_numbering *n, tw_piece_kind kind, uint32_t item) {
  if (kind == TW_PIECE_CORNERS) return tw_corner_of_row(n, item);
  return kind == TW_PIECE_EDGES ? tw_corner_of_edge(n, item) : 3 * tw_base_quad(s, item);
}

static void read(tw_surface_reader *r, tw_domain domain, const tw_piece *piece, float *out) {
  const tw_surface *s = r->surface;
  uint32_t rows = piece->count / piece->items;
  size_t size = (size_t)rows * tw_row_width(s, domain);
  bool splits = tw_is_split(s, domain) && piece->kind <= TW_PIECE_EDGES, against = false;
  for (uint32_t i = 0; i < piece->items; i++, out += size) {
    uint32_t corner = corner_of(s, tw_numbering_of(s, domain), piece->kind, piece->item + i), shared = corner;
    if (splits) shared = tw_shared_corner(s, piece->kind == TW_PIECE_EDGES, corner, &against);
    const tw_block block = {.first = piece->item + i,
                            .count = rows,
                            .own = place_of(s, piece->kind, corner, false),
                            .shared = place_of(s, piece->kind, shared, against)};
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

/* By the points around the triangle, from which Loop's scheme makes all points of it. */
static void widen_box(const tw_surface *s, uint32_t face, tw_point box[2]) {
  const tw_topology *t = &s->fields[0].base;
  for (uint32_t k = 0; k < 3; k++) {
    uint32_t vertex = t->corner_vertex[3 * face + k];
    for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++)
      for (uint32_t end = 0; end < 2; end++) {
        const double *at = s->positions.exact + 3 * (size_t)t->edge_vertices[t->ring_edges[i]][end];
        tw_box_widen(box, (tw_point){(float)at[0], (float)at[1], (float)at[2]});
      }
  }
}

/* Rows have no tangents, joints or weights. */
const tw_evaluator tw_triangle_evaluator = {.fits = fits,
                                            .start = start,
                                            .make = make,
                                            .place = place,
                                            .reads_base = true,
                                            .read = read,
                                            .points = points,
                                            .values = values,
                                            .widen_box = widen_box,
                                            .faces = faces,
                                            .row_of_child = row_of_child};
