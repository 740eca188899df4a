/* Reads any rows of a surface: each request is cut into pieces that patches compute. */
#include <stdlib.h>
#include <string.h>

#include "limit.h"
#include "patch_batch.h"
#include "surface_reader.h"

enum { PIECE_ROWS = 2048 };
typedef enum piece_kind { PIECE_CORNERS, PIECE_EDGES, PIECE_QUADS, PIECE_LINES } piece_kind;

/* ---- what a domain consists of -------------------------------------------------------------- */

static uint32_t row_width(const tw_surface *s, tw_domain domain) {
  if (domain == TW_DOMAIN_POINTS) return 3;
  return domain == TW_DOMAIN_UVS ? 2 : s->layout.stride;
}

static bool has_normals(const tw_surface *s, tw_domain domain) {
  return domain == TW_DOMAIN_VERTICES && s->layout.normal != UINT32_MAX;
}

/* Whether rows hold more than points and normals. */
static bool has_attributes(const tw_surface *s, tw_domain domain) {
  return domain == TW_DOMAIN_VERTICES && s->layout.stride > (has_normals(s, domain) ? 6 : 3);
}

static uint64_t rows_inside_edge(const tw_surface *s) {
  return s->side - 1;
}
static uint64_t rows_inside_quad(const tw_surface *s) {
  return (uint64_t)(s->side - 1) * (s->side - 1);
}

uint64_t tw_surface_row_count(const tw_surface *surface, tw_domain domain) {
  const tw_surface *s = surface;
  if (domain == TW_DOMAIN_UVS && s->field_count == 1) return 0;
  if (s->options.level == 0) {
    if (domain == TW_DOMAIN_POINTS) return s->cage_points;
    return domain == TW_DOMAIN_UVS ? s->cage_uv_points : s->cage_vertices;
  }
  const tw_numbering *n = tw_numbering_of(s, domain);
  return n->corner_count + n->edge_count * rows_inside_edge(s) + s->quad_count * rows_inside_quad(s);
}

/* ---- looking ahead -------------------------------------------------------------------------- */

/* The base corner that stands for a row of a corner, or for an edge. */
static uint32_t corner_of(const tw_numbering *n, piece_kind kind, uint32_t item) {
  return kind == PIECE_EDGES ? tw_corner_of_edge(n, item) : tw_corner_of_row(n, item);
}

/* Neighbours in a numbering of corners or edges lie anywhere in memory. Asks for what some of the next ones
 * need for one set of values, of those before `end`, before the one at hand is computed. */
static void look_ahead(const tw_surface *s, const tw_numbering *n, const tw_values *values, piece_kind kind,
                       uint32_t item, uint32_t end) {
  enum { APART = 4, CACHED = 4096 }; /* faces whose patches and values the processor keeps by itself */
  if (s->fields[values->field].base.face_count <= CACHED) return;
  for (uint32_t step = 0; step < TW_FETCH_STEPS; step++) {
    uint32_t next = item + APART * (TW_FETCH_STEPS - step);
    if (next < end)
      tw_patch_fetch(&s->fields[values->field].patches, corner_of(n, kind, next) / 4, step, values->base,
                     values->width);
  }
}

/* Likewise for the UVs of vertices. */
static void look_ahead_uvs(const tw_surface *s, piece_kind kind, uint32_t item, uint32_t end) {
  for (uint32_t i = 0; i < s->layout.uv_count; i++) look_ahead(s, &s->vertices, &s->uvs[i], kind, item, end);
}

/* ---- values at corners ---------------------------------------------------------------------- */

static tw_patch_job job_for(const tw_surface_reader *r, const tw_values *values, float *out, float *normals,
                            uint32_t stride) {
  return (tw_patch_job){.in = values->base,
                        .width = values->width,
                        .limit = r->surface->options.limit,
                        .values = out,
                        .normals = normals,
                        .stride = stride,
                        .scratch = r->scratch};
}

static void evaluate_corner(tw_surface_reader *r, const tw_values *values, uint32_t corner, float *out,
                            float *normal) {
  const tw_surface *s = r->surface;
  if (s->depth == 0) {
    tw_corner_by_mask(r, values, corner, out, normal);
    return;
  }
  tw_patch_job job = job_for(r, values, out, normal, 4);
  tw_patch_evaluate(&s->fields[values->field].patches, corner / 4, &job,
                    tw_patch_corner(s->side, corner % 4));
}

/* Where a row has its normal; NULL: nowhere. */
static float *normal_in(const tw_surface *s, tw_domain domain, float *row) {
  return has_normals(s, domain) ? row + s->layout.normal : NULL;
}

/* A batch of points and, where vertices have them, normals. */
static void begin_batch(const tw_surface_reader *r, tw_domain domain, tw_patch_piece piece, size_t count,
                        tw_patch_batch *batch) {
  const tw_surface *s = r->surface;
  tw_patch_job job = job_for(r, &s->positions, NULL, NULL, row_width(s, domain));
  bool normals = has_normals(s, domain);
  tw_patch_batch_begin(batch, &s->fields[s->positions.field].patches, &job, normals, piece, count);
}

/* GPUs have v run down. */
static void flip_v(float *uv) {
  uv[1] = 1 - uv[1];
}

/* Sums of weights that are 1 but for rounding may leave the range of a colour. */
static void clamp_color(float *color) {
  for (int c = 0; c < 4; c++) color[c] = color[c] < 0 ? 0 : color[c] > 1 ? 1 : color[c];
}

/* Whether some vertices of a domain share their point. */
static bool is_split(const tw_surface *s, tw_domain domain) {
  return domain == TW_DOMAIN_VERTICES &&
         (s->vertices.same_as != s->points.same_as || s->vertices.corner_row != s->points.corner_row);
}

/* Split vertices share their point to the last bit: it is computed from the corner that stands for the point.
 */
static uint32_t shared_corner(const tw_surface *s, uint32_t corner) {
  return tw_corner_of_row(&s->points, tw_row_of_corner(&s->points, corner));
}

/* Point and normal. */
static void corner_point(tw_surface_reader *r, tw_domain domain, uint32_t corner, float *out) {
  uint32_t shared = domain == TW_DOMAIN_VERTICES ? shared_corner(r->surface, corner) : corner;
  float *normal = normal_in(r->surface, domain, out);
  evaluate_corner(r, &r->surface->positions, shared, out, shared == corner ? normal : NULL);
  if (normal && shared != corner) evaluate_corner(r, &r->surface->positions, corner, NULL, normal);
}

/* Points and normals of many. */
static void corner_points(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count,
                          float *out) {
  const tw_surface *s = r->surface;
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint32_t width = row_width(s, domain);
  bool split = is_split(s, domain);
  tw_patch_batch batch;
  begin_batch(r, domain, TW_PATCH_CORNER, count, &batch);
  for (uint32_t i = 0; i < count; i++, out += width) {
    uint32_t corner = tw_corner_of_row(n, first + i);
    look_ahead(s, n, &s->positions, PIECE_CORNERS, first + i, first + count);
    if (!split || shared_corner(s, corner) == corner)
      tw_patch_batch_add(&batch, corner, out);
    else
      corner_point(r, domain, corner, out);
  }
  tw_patch_batch_end(&batch);
}

static void uv_corners(tw_surface_reader *r, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  for (uint32_t i = 0; i < count; i++, out += 2) {
    if (s->depth > 0) look_ahead(s, &s->uv_points, &s->uvs[0], PIECE_CORNERS, first + i, first + count);
    evaluate_corner(r, &s->uvs[0], tw_corner_of_row(&s->uv_points, first + i), out, NULL);
  }
}

/* All else that a vertex's row holds. */
static void corner_attributes(tw_surface_reader *r, uint32_t row, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  uint32_t corner = tw_corner_of_row(&s->vertices, row), shared = shared_corner(s, corner);
  if (l->tangent != UINT32_MAX) tw_corner_tangent(r, corner, out);
  for (uint32_t i = 0; i < l->uv_count; i++) {
    evaluate_corner(r, &s->uvs[i], corner, out + l->uvs[i], NULL);
    flip_v(out + l->uvs[i]);
  }
  if (l->color != UINT32_MAX) {
    evaluate_corner(r, &s->colors, shared, out + l->color, NULL);
    clamp_color(out + l->color);
  }
  if (l->joints != UINT32_MAX) tw_corner_weights(r, shared, out);
  for (uint32_t m = 0; m < l->morph_count; m++)
    evaluate_corner(r, &s->morphs[m], shared, out + l->morphs + 3 * (size_t)m, NULL);
}

static void loop_rows(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  uint32_t stride = s->layout.stride;
  const double *kept = s->positions.exact;
  if (!s->loop.normals || domain == TW_DOMAIN_POINTS) {
    tw_loop_rows_points(&s->loop, kept, first, count, out);
    return;
  }
  for (uint32_t i = 0; i < count; i++)
    tw_loop_rows_points(&s->loop, kept, first + i, 1, out + (size_t)i * stride);
  tw_loop_rows_normals(&s->loop, kept, first, count, r->mask, out + s->layout.normal, stride);
}

static void fill_corners(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  uint32_t width = row_width(s, domain);
  if (s->shallow.normals && domain == TW_DOMAIN_VERTICES) {
    tw_shallow_normals(&s->shallow, s->positions.base, first, count, out);
    return;
  }
  if (s->shallow.level > 0) {
    tw_shallow_points(&s->shallow, s->positions.base, first, count, out);
    return;
  }
  if (s->loop.levels > 0) {
    loop_rows(r, domain, first, count, out);
    return;
  }
  if (s->plain) {
    memcpy(out, s->positions.base + 3 * (size_t)first, (size_t)count * 3 * sizeof *out);
    return;
  }
  if (domain == TW_DOMAIN_UVS) {
    uv_corners(r, first, count, out);
    return;
  }
  if (s->depth > 0) {
    corner_points(r, domain, first, count, out);
  } else {
    for (uint32_t i = 0; i < count; i++)
      corner_point(r, domain, tw_corner_of_row(tw_numbering_of(s, domain), first + i),
                   out + (size_t)i * width);
  }
  for (uint32_t i = 0; has_attributes(s, domain) && i < count; i++, out += width) {
    if (s->depth > 0) look_ahead_uvs(s, PIECE_CORNERS, first + i, first + count);
    corner_attributes(r, first + i, out);
  }
}

/* ---- insides of edges ----------------------------------------------------------------------- */

/* The inside of the edge at a base corner, in the corner's direction, or against it. */
static void evaluate_edge(tw_surface_reader *r, const tw_values *values, uint32_t corner, bool against,
                          float *out, float *normals, uint32_t stride) {
  bool backwards;
  tw_patch_rect rect = tw_patch_side(r->surface->side, corner % 4, &backwards);
  tw_patch_job job = job_for(r, values, out, normals, stride);
  job.backwards = backwards != against;
  tw_patch_evaluate(&r->surface->fields[values->field].patches, corner / 4, &job, rect);
}

/* As at corners: the point's own representative, from which an edge may run the other way. */
typedef struct shared_edge {
  uint32_t corner;
  bool against, same; /* same: it is the edge itself */
} shared_edge;

static shared_edge share_edge(const tw_surface *s, uint32_t corner) {
  uint32_t edge = tw_row_of_edge(&s->points, corner), shared = tw_corner_of_edge(&s->points, edge / 2);
  return (shared_edge){shared, edge & 1, shared == corner && (edge & 1) == 0};
}

/* Points and normals. */
static void edge_points(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint32_t width = row_width(s, domain);
  bool split = is_split(s, domain);
  tw_patch_batch batch;
  begin_batch(r, domain, TW_PATCH_SIDE, count, &batch);
  for (uint32_t i = 0; i < count; i++, out += rows_inside_edge(s) * width) {
    uint32_t corner = tw_corner_of_edge(n, first + i);
    look_ahead(s, n, &s->positions, PIECE_EDGES, first + i, first + count);
    shared_edge shared = {corner, false, true};
    if (split) shared = share_edge(s, corner);
    if (shared.same) {
      tw_patch_batch_add(&batch, corner, out);
      continue;
    }
    float *normals = normal_in(s, domain, out);
    evaluate_edge(r, &s->positions, shared.corner, shared.against, out, NULL, width);
    if (normals) evaluate_edge(r, &s->positions, corner, false, NULL, normals, width);
  }
  tw_patch_batch_end(&batch);
}

/* All else that the rows of vertices hold. */
static void edge_attributes(tw_surface_reader *r, uint32_t edge, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  uint32_t corner = tw_corner_of_edge(&s->vertices, edge);
  shared_edge shared = share_edge(s, corner);
  if (l->tangent != UINT32_MAX) tw_edge_tangents(r, corner, out);
  for (uint32_t i = 0; i < l->uv_count; i++) {
    evaluate_edge(r, &s->uvs[i], corner, false, out + l->uvs[i], NULL, l->stride);
    for (uint32_t k = 0; k + 1 < s->side; k++) flip_v(out + l->uvs[i] + (size_t)k * l->stride);
  }
  if (l->color != UINT32_MAX) {
    evaluate_edge(r, &s->colors, shared.corner, shared.against, out + l->color, NULL, l->stride);
    for (uint32_t k = 0; k + 1 < s->side; k++) clamp_color(out + l->color + (size_t)k * l->stride);
  }
  if (l->joints != UINT32_MAX) tw_edge_weights(r, shared.corner, shared.against, out);
  for (uint32_t m = 0; m < l->morph_count; m++)
    evaluate_edge(r, &s->morphs[m], shared.corner, shared.against, out + l->morphs + 3 * (size_t)m, NULL,
                  l->stride);
}

static void uv_edges(tw_surface_reader *r, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  for (uint32_t i = 0; i < count; i++, out += 2 * rows_inside_edge(s)) {
    look_ahead(s, &s->uv_points, &s->uvs[0], PIECE_EDGES, first + i, first + count);
    evaluate_edge(r, &s->uvs[0], tw_corner_of_edge(&s->uv_points, first + i), false, out, NULL, 2);
  }
}

static void fill_edges(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  if (domain == TW_DOMAIN_UVS) {
    uv_edges(r, first, count, out);
    return;
  }
  edge_points(r, domain, first, count, out);
  size_t step = rows_inside_edge(s) * row_width(s, domain);
  for (uint32_t i = 0; has_attributes(s, domain) && i < count; i++, out += step) {
    look_ahead_uvs(s, PIECE_EDGES, first + i, first + count);
    edge_attributes(r, first + i, out);
  }
}

/* ---- insides of quads ----------------------------------------------------------------------- */

static void evaluate_inside(tw_surface_reader *r, const tw_values *values, uint32_t quad, tw_patch_rect rect,
                            float *out, float *normals, uint32_t stride) {
  tw_patch_job job = job_for(r, values, out, normals, stride);
  tw_patch_evaluate(&r->surface->fields[values->field].patches, quad, &job, rect);
}

/* All else that the rows of vertices hold. */
static void inside_attributes(tw_surface_reader *r, uint32_t quad, tw_patch_rect rect, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  uint32_t width = l->stride;
  if (l->tangent != UINT32_MAX) tw_inside_tangents(r, quad, rect, out);
  size_t rows = (size_t)(rect.j1 - rect.j0 + 1) * (s->side - 1);
  for (uint32_t i = 0; i < l->uv_count; i++) {
    evaluate_inside(r, &s->uvs[i], quad, rect, out + l->uvs[i], NULL, width);
    for (size_t k = 0; k < rows; k++) flip_v(out + l->uvs[i] + k * width);
  }
  if (l->color != UINT32_MAX) {
    evaluate_inside(r, &s->colors, quad, rect, out + l->color, NULL, width);
    for (size_t k = 0; k < rows; k++) clamp_color(out + l->color + k * width);
  }
  if (l->joints != UINT32_MAX) tw_inside_weights(r, quad, rect, out);
  for (uint32_t m = 0; m < l->morph_count; m++)
    evaluate_inside(r, &s->morphs[m], quad, rect, out + l->morphs + 3 * (size_t)m, NULL, width);
}

/* Lines j0 to j1 of the inside of one quad. */
static void fill_lines(tw_surface_reader *r, tw_domain domain, uint32_t visible, uint32_t j0, uint32_t j1,
                       float *out) {
  const tw_surface *s = r->surface;
  const tw_values *values = domain == TW_DOMAIN_UVS ? &s->uvs[0] : &s->positions;
  uint32_t quad = tw_base_quad(s, visible);
  tw_patch_rect rect = {1, s->side - 1, j0, j1};
  evaluate_inside(r, values, quad, rect, out, normal_in(s, domain, out), row_width(s, domain));
  if (domain == TW_DOMAIN_VERTICES) inside_attributes(r, quad, rect, out);
}

/* Whole insides of some quads. Short lines are computed in many patches at once. */
static void fill_quads(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count, float *out) {
  enum { SHORT_SIDE = 8 };
  const tw_surface *s = r->surface;
  size_t step = rows_inside_quad(s) * row_width(s, domain);
  if (domain == TW_DOMAIN_UVS || s->side > SHORT_SIDE) {
    for (uint32_t i = 0; i < count; i++) fill_lines(r, domain, first + i, 1, s->side - 1, out + i * step);
    return;
  }
  tw_patch_batch batch;
  begin_batch(r, domain, TW_PATCH_INSIDE, count, &batch);
  for (uint32_t i = 0; i < count; i++)
    tw_patch_batch_add(&batch, 4 * tw_base_quad(s, first + i), out + i * step);
  tw_patch_batch_end(&batch);
  tw_patch_rect rect = {1, s->side - 1, 1, s->side - 1};
  for (uint32_t i = 0; has_attributes(s, domain) && i < count; i++)
    inside_attributes(r, tw_base_quad(s, first + i), rect, out + i * step);
}

/* ---- pieces --------------------------------------------------------------------------------- */

/* A run of rows that is computed at once. */
typedef struct piece {
  piece_kind kind;
  uint64_t first;       /* row */
  uint32_t count;       /* rows */
  uint32_t item, items; /* corners, edges or visible quads; of PIECE_LINES the quad and the first line */
} piece;

static uint32_t at_most(uint64_t a, uint64_t b) {
  return (uint32_t)(a < b ? a : b);
}

/* As many whole items as are wanted, one if only part of it is. */
static piece whole_items(piece_kind kind, uint64_t first, uint64_t item, uint64_t rows_an_item,
                         uint64_t items, size_t wanted) {
  uint32_t taken = at_most(wanted / rows_an_item, items - item);
  if (taken == 0) taken = 1;
  return (piece){kind, first, taken * (uint32_t)rows_an_item, (uint32_t)item, taken};
}

/* The piece at a row of which `wanted` are asked for: it begins at the row, or before it where the row is
 * amid an item. An item is computed the same way whatever the piece. */
static piece piece_at(const tw_surface *s, tw_domain domain, uint64_t row, size_t wanted) {
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint64_t corners = s->options.level == 0 ? tw_surface_row_count(s, domain) : n->corner_count;
  if (row < corners) return whole_items(PIECE_CORNERS, row, row, 1, corners, wanted);
  uint64_t edge_rows = rows_inside_edge(s), in_edges = row - corners;
  if (in_edges < n->edge_count * edge_rows)
    return whole_items(PIECE_EDGES, row - in_edges % edge_rows, in_edges / edge_rows, edge_rows,
                       n->edge_count, in_edges % edge_rows == 0 ? wanted : 0);
  uint64_t quads_begin = corners + n->edge_count * edge_rows, quad_rows = rows_inside_quad(s);
  uint64_t in_quads = row - quads_begin;
  if (quad_rows <= PIECE_ROWS)
    return whole_items(PIECE_QUADS, row - in_quads % quad_rows, in_quads / quad_rows, quad_rows,
                       s->quad_count, in_quads % quad_rows == 0 ? wanted : 0);
  uint32_t quad = (uint32_t)(in_quads / quad_rows), lines = PIECE_ROWS / (uint32_t)edge_rows;
  if (lines == 0) lines = 1;
  uint32_t line = (uint32_t)(in_quads % quad_rows / edge_rows) / lines * lines;
  uint32_t taken = at_most(lines, edge_rows - line);
  uint64_t first = quads_begin + quad * quad_rows + line * edge_rows;
  return (piece){PIECE_LINES, first, taken * (uint32_t)edge_rows, quad, line};
}

static void compute_piece(tw_surface_reader *r, tw_domain domain, const piece *p, float *out) {
  const tw_surface *s = r->surface;
  uint32_t last_line = s->side - 1;
  if (p->kind == PIECE_CORNERS) {
    fill_corners(r, domain, p->item, p->items, out);
  } else if (p->kind == PIECE_EDGES) {
    fill_edges(r, domain, p->item, p->items, out);
  } else if (p->kind == PIECE_QUADS) {
    fill_quads(r, domain, p->item, p->items, out);
  } else {
    uint32_t first_line = 1 + p->items, lines = p->count / last_line;
    fill_lines(r, domain, p->item, first_line, first_line + lines - 1, out);
  }
}

/* A piece in the reader's memory, computed unless it is there already. */
static const float *keep_piece(tw_surface_reader *r, tw_domain domain, const piece *p) {
  if (r->piece_count == 0 || r->piece_domain != domain || r->piece_first != p->first) {
    compute_piece(r, domain, p, r->piece);
    r->piece_domain = domain;
    r->piece_first = p->first;
    r->piece_count = p->count;
  }
  return r->piece;
}

void tw_surface_read_rows(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                          float *out) {
  const tw_surface *s = reader->surface;
  uint32_t width = row_width(s, domain);
  while (count > 0) {
    piece p = piece_at(s, domain, first, count);
    size_t skip = (size_t)(first - p.first), take = p.count - skip;
    if (take > count) take = count;
    if (take == p.count)
      compute_piece(reader, domain, &p, out);
    else
      memcpy(out, keep_piece(reader, domain, &p) + skip * width, take * width * sizeof *out);
    out += take * width;
    first += take;
    count -= take;
  }
}

/* ---- reader --------------------------------------------------------------------------------- */

static uint32_t larger(uint32_t a, uint32_t b) {
  return a > b ? a : b;
}

static uint32_t piece_capacity(const tw_surface *surface) {
  return larger(surface->side, PIECE_ROWS);
}

/* The most of everything that any of several surfaces needs. */
typedef struct reader_needs {
  uint32_t points, masks, slopes;              /* slopes: rows with tangents */
  uint32_t joints, joint_controls, joint_rows; /* of skinned surfaces */
  size_t piece;                                /* floats */
} reader_needs;

static void need(reader_needs *n, const tw_surface *s) {
  uint32_t rows = piece_capacity(s);
  size_t piece = (size_t)rows * larger(s->layout.stride, 4);
  n->points = larger(n->points, s->scratch_points);
  n->masks = larger(n->masks, s->mask_capacity);
  if (piece > n->piece) n->piece = piece;
  if (s->tangent_frames) n->slopes = larger(n->slopes, rows);
  if (s->layout.joints == UINT32_MAX) return;
  n->joints = larger(n->joints, s->influences.joint_count);
  n->joint_controls = larger(n->joint_controls, s->influences.vertex_count);
  n->joint_rows = larger(n->joint_rows, rows);
}

static bool allocate_reader(tw_surface_reader *r, const reader_needs *n) {
  r->scratch = tw_alloc((size_t)n->points + 1, 4 * sizeof *r->scratch);
  r->mask = tw_alloc((size_t)n->masks + 1, sizeof *r->mask);
  r->piece = tw_alloc(n->piece, sizeof(float));
  r->joint_controls = tw_alloc(n->joint_controls, 4 * sizeof(float));
  r->joint_rows = tw_alloc(n->joint_rows, 4 * sizeof(float));
  bool complete = r->scratch && r->mask && r->piece && r->joint_controls && r->joint_rows;
  for (int i = 0; i < 2; i++) {
    r->slopes[i] = tw_alloc(n->slopes, TW_DERIVATIVE_WIDTH * sizeof(float));
    complete = complete && r->slopes[i];
  }
  return complete && tw_joint_sum_init(&r->joints, n->joints) == TW_OK;
}

tw_surface_reader *tw_surface_reader_create_shared(const tw_surface *const *surfaces, size_t count) {
  reader_needs needs = {0};
  for (size_t i = 0; i < count; i++) need(&needs, surfaces[i]);
  tw_surface_reader *r = tw_alloc_zero(1, sizeof *r);
  if (!r || allocate_reader(r, &needs)) return r;
  tw_surface_reader_destroy(r);
  return NULL;
}

void tw_surface_reader_turn(tw_surface_reader *reader, const tw_surface *surface) {
  if (reader->surface == surface) return;
  reader->surface = surface;
  reader->piece_capacity = piece_capacity(surface);
  reader->piece_count = 0;
}

tw_surface_reader *tw_surface_reader_create(const tw_surface *surface) {
  tw_surface_reader *reader = tw_surface_reader_create_shared(&surface, 1);
  if (reader) tw_surface_reader_turn(reader, surface);
  return reader;
}

void tw_surface_reader_destroy(tw_surface_reader *reader) {
  if (!reader) return;
  free(reader->scratch);
  free(reader->mask);
  free(reader->piece);
  for (int i = 0; i < 2; i++) free(reader->slopes[i]);
  free(reader->joint_controls);
  free(reader->joint_rows);
  tw_joint_sum_deinit(&reader->joints);
  free(reader);
}
