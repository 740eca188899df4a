/* Reads any rows of a surface: of corners, of the insides of edges and of quads. Each request is cut into
 * pieces that are computed at once. */
#include <stdlib.h>
#include <string.h>

#include "patch.h"
#include "surface_reader.h"

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
  return tw_has_normals(s, domain) ? row + s->layout.normal : NULL;
}

/* A batch of points and, where vertices have them, normals. */
static void begin_batch(const tw_surface_reader *r, tw_domain domain, tw_patch_piece piece, size_t count,
                        tw_patch_batch *batch) {
  const tw_surface *s = r->surface;
  tw_patch_job job = job_for(r, &s->positions, NULL, NULL, tw_row_width(s, domain));
  bool normals = tw_has_normals(s, domain);
  tw_patch_batch_begin(batch, &s->fields[s->positions.field].patches, &job, normals, piece, count);
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
  uint32_t width = tw_row_width(s, domain);
  bool split = is_split(s, domain);
  tw_patch_batch batch;
  begin_batch(r, domain, TW_PATCH_CORNER, count, &batch);
  for (uint32_t i = 0; i < count; i++, out += width) {
    uint32_t corner = tw_corner_of_row(n, first + i);
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
    evaluate_corner(r, &s->uvs[0], tw_corner_of_row(&s->uv_points, first + i), out, NULL);
  }
}

static tw_slope_source slope_source(const tw_surface *s, const tw_values *values) {
  const tw_field *field = &s->fields[values->field];
  return (tw_slope_source){&field->base, &field->patches, field->linear, values->base, values->width};
}

/* The UVs that the tangents of a face follow. */
static const tw_values *tangent_uvs(const tw_surface *s, uint32_t face) {
  return &s->uvs[s->tangent_frames[face] / 2];
}

static void patch_tangents(tw_surface_reader *r, uint32_t quad, tw_patch_rect rect, bool backwards,
                           float *out) {
  const tw_surface *s = r->surface;
  const tw_slope_source points = slope_source(s, &s->positions), uvs = slope_source(s, tangent_uvs(s, quad));
  size_t count = (size_t)(rect.i1 - rect.i0 + 1) * (rect.j1 - rect.j0 + 1);
  tw_patch_slopes(&points, quad, rect, r->scratch, r->slopes[0]);
  tw_patch_slopes(&uvs, quad, rect, r->scratch, r->slopes[1]);
  tw_write_tangents(r->slopes[0], r->slopes[1], count, backwards, s->tangent_frames[quad] % 2,
                    tw_tangent_columns_of(s, out));
}

static void corner_tangent(tw_surface_reader *r, uint32_t corner, float *out) {
  const tw_surface *s = r->surface;
  uint32_t face = tw_corner_face(&s->fields[0].base, corner);
  if (s->depth > 0) {
    patch_tangents(r, face, tw_patch_corner(s->side, corner % 4), false, out);
    return;
  }
  const tw_slope_source points = slope_source(s, &s->positions), uvs = slope_source(s, tangent_uvs(s, face));
  tw_corner_slopes(&points, corner, r->mask, r->slopes[0]);
  tw_corner_slopes(&uvs, corner, r->mask, r->slopes[1]);
  tw_write_tangents(r->slopes[0], r->slopes[1], 1, false, s->tangent_frames[face] % 2,
                    tw_tangent_columns_of(s, out));
}

static void patch_weights(tw_surface_reader *r, uint32_t quad, tw_patch_rect rect, bool backwards,
                          float *out) {
  const tw_surface *s = r->surface;
  const tw_skin_patch patch = {&s->influences, &s->fields[0].patches, quad, rect, s->options.limit, backwards,
                               r->scratch};
  tw_skin_patch_rows(&patch, &r->skin, tw_skin_columns_of(s, out));
}

/* Where no patch covers it, a vertex has its own influences, or those of its limit mask. */
static void corner_weights(tw_surface_reader *r, uint32_t corner, float *out) {
  const tw_surface *s = r->surface;
  const tw_field *field = &s->fields[0];
  if (s->depth > 0) {
    patch_weights(r, corner / 4, tw_patch_corner(s->side, corner % 4), false, out);
  } else if (s->options.limit) {
    uint32_t count = tw_limit_mask(&field->base, field->linear, corner, r->mask);
    tw_skin_mask_row(&s->influences, r->mask, count, &r->skin, tw_skin_columns_of(s, out));
  } else {
    const tw_influences *own = s->cage_influences.offsets ? &s->cage_influences : &s->influences;
    const tw_limit_entry itself = {field->base.corner_vertex[corner], 1, 0, 0};
    tw_skin_mask_row(own, &itself, 1, &r->skin, tw_skin_columns_of(s, out));
  }
}

/* All else that a vertex's row holds. */
static void corner_attributes(tw_surface_reader *r, uint32_t row, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  uint32_t corner = tw_corner_of_row(&s->vertices, row), shared = shared_corner(s, corner);
  if (l->tangent != UINT32_MAX) corner_tangent(r, corner, out);
  for (uint32_t i = 0; i < l->uv_count; i++) evaluate_corner(r, &s->uvs[i], corner, out + l->uvs[i], NULL);
  for (uint32_t i = 0; i < tw_smooth_count(l); i++)
    evaluate_corner(r, &s->smooth[i], shared, out + tw_smooth_column(l, i), NULL);
  if (l->joints != UINT32_MAX) corner_weights(r, shared, out);
}

static void loop_rows(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  uint32_t stride = tw_row_width(s, domain);
  const double *points = s->positions.exact, *point = points + 3 * (size_t)first;
  for (size_t i = 0; i < count; i++, point += 3)
    for (size_t c = 0; c < 3; c++) out[i * stride + c] = (float)point[c];
  float *normals = normal_in(s, domain, out);
  if (normals) tw_loop_rows_normals(&s->loop_above, points, first, count, r->mask, normals, stride);
}

/* Of rows of level 0 whose mesh has its own. */
static void own_normals(const tw_surface *s, uint32_t first, uint32_t count, float *out) {
  for (uint32_t i = 0; i < count; i++, out += s->layout.stride) {
    const float *own = s->own_normals + 3 * (size_t)(first + i);
    if (own[0] != 0 || own[1] != 0 || own[2] != 0) memcpy(out + s->layout.normal, own, 3 * sizeof *own);
  }
}

static void own_tangents(const tw_surface *s, uint32_t first, uint32_t count, float *out) {
  for (uint32_t i = 0; i < count; i++, out += s->layout.stride) {
    const float *own = s->own_tangents + 4 * (size_t)(first + i);
    if (own[0] != 0 || own[1] != 0 || own[2] != 0) memcpy(out + s->layout.tangent, own, 4 * sizeof *own);
  }
}

static void fill_corners(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  uint32_t width = tw_row_width(s, domain);
  if (s->way == TW_WAY_LEVELS) {
    tw_level_read_rows(s, domain, first, count, out);
    return;
  }
  if (s->way == TW_WAY_LOOP) {
    loop_rows(r, domain, first, count, out);
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
  bool is_own = s->own_normals && domain == TW_DOMAIN_VERTICES;
  if (is_own) own_normals(s, first, count, out); /* tangents are orthogonal to them */
  for (uint32_t i = 0; tw_has_attributes(s, domain) && i < count; i++)
    corner_attributes(r, first + i, out + (size_t)i * width);
  if (is_own && s->own_tangents) own_tangents(s, first, count, out);
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
  uint32_t width = tw_row_width(s, domain);
  bool split = is_split(s, domain);
  tw_patch_batch batch;
  begin_batch(r, domain, TW_PATCH_SIDE, count, &batch);
  for (uint32_t i = 0; i < count; i++, out += tw_rows_inside_edge(s) * width) {
    uint32_t corner = tw_corner_of_edge(n, first + i);
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
  if (l->tangent != UINT32_MAX) {
    bool backwards;
    tw_patch_rect rect = tw_patch_side(s->side, corner % 4, &backwards);
    patch_tangents(r, corner / 4, rect, backwards, out);
  }
  for (uint32_t i = 0; i < l->uv_count; i++)
    evaluate_edge(r, &s->uvs[i], corner, false, out + l->uvs[i], NULL, l->stride);
  for (uint32_t i = 0; i < tw_smooth_count(l); i++) {
    float *column = out + tw_smooth_column(l, i);
    evaluate_edge(r, &s->smooth[i], shared.corner, shared.against, column, NULL, l->stride);
  }
  if (l->joints != UINT32_MAX) {
    bool backwards;
    tw_patch_rect rect = tw_patch_side(s->side, shared.corner % 4, &backwards);
    patch_weights(r, shared.corner / 4, rect, backwards != shared.against, out);
  }
}

static void uv_edges(tw_surface_reader *r, uint32_t first, uint32_t count, float *out) {
  const tw_surface *s = r->surface;
  for (uint32_t i = 0; i < count; i++, out += 2 * tw_rows_inside_edge(s)) {
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
  size_t step = tw_rows_inside_edge(s) * tw_row_width(s, domain);
  for (uint32_t i = 0; tw_has_attributes(s, domain) && i < count; i++, out += step) {
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
  if (l->tangent != UINT32_MAX) patch_tangents(r, quad, rect, false, out);
  for (uint32_t i = 0; i < l->uv_count; i++)
    evaluate_inside(r, &s->uvs[i], quad, rect, out + l->uvs[i], NULL, width);
  for (uint32_t i = 0; i < tw_smooth_count(l); i++)
    evaluate_inside(r, &s->smooth[i], quad, rect, out + tw_smooth_column(l, i), NULL, width);
  if (l->joints != UINT32_MAX) patch_weights(r, quad, rect, false, out);
}

/* Lines j0 to j1 of the inside of one quad. */
static void fill_lines(tw_surface_reader *r, tw_domain domain, uint32_t visible, uint32_t j0, uint32_t j1,
                       float *out) {
  const tw_surface *s = r->surface;
  const tw_values *values = domain == TW_DOMAIN_UVS ? &s->uvs[0] : &s->positions;
  uint32_t quad = tw_base_quad(s, visible);
  tw_patch_rect rect = {1, s->side - 1, j0, j1};
  evaluate_inside(r, values, quad, rect, out, normal_in(s, domain, out), tw_row_width(s, domain));
  if (domain == TW_DOMAIN_VERTICES) inside_attributes(r, quad, rect, out);
}

/* Whole insides of some quads. Short lines are computed in many patches at once. */
static void fill_quads(tw_surface_reader *r, tw_domain domain, uint32_t first, uint32_t count, float *out) {
  enum { SHORT_SIDE = 8 };
  const tw_surface *s = r->surface;
  size_t step = tw_rows_inside_quad(s) * tw_row_width(s, domain);
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
  for (uint32_t i = 0; tw_has_attributes(s, domain) && i < count; i++)
    inside_attributes(r, tw_base_quad(s, first + i), rect, out + i * step);
}

enum { PIECE_ROWS = 2048, MOVED_WIDTH = 6 };
typedef enum piece_kind { PIECE_CORNERS, PIECE_EDGES, PIECE_QUADS, PIECE_LINES } piece_kind;

uint64_t tw_surface_row_count(const tw_surface *surface, tw_domain domain) {
  const tw_surface *s = surface;
  if (domain == TW_DOMAIN_UVS && s->field_count == 1) return 0;
  if (s->options.level == 0) {
    if (domain == TW_DOMAIN_POINTS) return s->cage_points;
    return domain == TW_DOMAIN_UVS ? s->cage_uv_points : s->cage_vertices;
  }
  const tw_numbering *n = tw_numbering_of(s, domain);
  return n->corner_count + n->edge_count * tw_rows_inside_edge(s) + s->quad_count * tw_rows_inside_quad(s);
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
  uint64_t edge_rows = tw_rows_inside_edge(s), in_edges = row - corners;
  if (in_edges < n->edge_count * edge_rows)
    return whole_items(PIECE_EDGES, row - in_edges % edge_rows, in_edges / edge_rows, edge_rows,
                       n->edge_count, in_edges % edge_rows == 0 ? wanted : 0);
  uint64_t quads_begin = corners + n->edge_count * edge_rows, quad_rows = tw_rows_inside_quad(s);
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

/* GPUs have v run down. Sums of weights that are 1 but for rounding may leave the range of a colour. */
static void finish_rows(const tw_surface *s, uint32_t count, float *row) {
  const tw_surface_layout *l = &s->layout;
  for (; count > 0; count--, row += l->stride) {
    for (uint32_t i = 0; i < l->uv_count; i++) row[l->uvs[i] + 1] = 1 - row[l->uvs[i] + 1];
    for (uint32_t i = 0; i < l->attribute_count; i++) {
      float *color = row + l->attributes[i], *end = color + s->smooth[i].width;
      for (; s->smooth[i].is_color && color < end; color++) *color = *color < 0 ? 0 : *color > 1 ? 1 : *color;
    }
  }
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
  if (tw_has_attributes(s, domain)) finish_rows(s, p->count, out);
}

/* The displacements of normals by morph targets, of rows that hold all else. */
static void displace_normals(tw_surface_reader *r, const piece *p, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  for (uint32_t m = 0; m < l->morph_count; m++) {
    float *row = out;
    const float *own = s->own_morph_normals;
    if (own) {
      own += 3 * ((size_t)m * s->cage_vertices + (size_t)p->first);
    } else {
      r->surface = s->morphed[m];
      compute_piece(r, TW_DOMAIN_VERTICES, p, r->moved);
      r->surface = s;
    }
    for (uint32_t k = 0; k < p->count; k++, row += l->stride)
      for (uint32_t c = 0; c < 3; c++) {
        float *to = row + l->morphs + 6 * m + 3 + c;
        *to = own ? own[3 * k + c] : r->moved[MOVED_WIDTH * k + 3 + c] - row[l->normal + c];
      }
  }
}

static void compute_rows(tw_surface_reader *r, tw_domain domain, const piece *p, float *out) {
  compute_piece(r, domain, p, out);
  if (domain == TW_DOMAIN_VERTICES && r->surface->layout.morph_width == 6) displace_normals(r, p, out);
}

/* A piece in the reader's memory, computed unless it is there already. */
static const float *keep_piece(tw_surface_reader *r, tw_domain domain, const piece *p) {
  if (r->piece_count == 0 || r->piece_domain != domain || r->piece_first != p->first) {
    compute_rows(r, domain, p, r->piece);
    r->piece_domain = domain;
    r->piece_first = p->first;
    r->piece_count = p->count;
  }
  return r->piece;
}

void tw_surface_read_rows(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                          float *out) {
  const tw_surface *s = reader->surface;
  uint32_t width = tw_row_width(s, domain);
  while (count > 0) {
    size_t wanted = s->morphed && count > reader->piece_capacity ? reader->piece_capacity : count;
    piece p = piece_at(s, domain, first, wanted);
    size_t skip = (size_t)(first - p.first), take = p.count - skip;
    if (take > count) take = count;
    if (take == p.count)
      compute_rows(reader, domain, &p, out);
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
  uint32_t points, masks, slopes;            /* slopes: rows with tangents */
  uint32_t joints, skin_vertices, skin_rows; /* of skinned surfaces */
  size_t piece, moved;                       /* floats */
} reader_needs;

/* Of the layout with so many morph targets. */
static uint32_t stride_with(const tw_surface_layout *layout, uint32_t targets) {
  return layout->stride - layout->morph_width * layout->morph_count + layout->morph_width * targets;
}

static void need(reader_needs *n, const tw_surface *s, uint32_t displacements_max) {
  uint32_t rows = piece_capacity(s), all = s->layout.morph_count;
  uint32_t most = displacements_max * 3 / s->layout.morph_width;
  uint32_t stride = stride_with(&s->layout, all < most ? all : most);
  if (s->morphed && most > 0) n->moved = MOVED_WIDTH * (size_t)rows;
  size_t piece = (size_t)rows * larger(stride, 4);
  n->points = larger(n->points, s->scratch_points);
  n->masks = larger(n->masks, s->mask_capacity);
  if (piece > n->piece) n->piece = piece;
  if (s->tangent_frames && s->way != TW_WAY_LEVELS) n->slopes = larger(n->slopes, rows);
  if (s->layout.joints == UINT32_MAX || s->skin_rows) return;
  n->joints = larger(n->joints, s->influences.joint_count);
  n->skin_vertices = larger(n->skin_vertices, s->influences.vertex_count);
  n->skin_rows = larger(n->skin_rows, rows);
}

static bool allocate_reader(tw_surface_reader *r, const reader_needs *n) {
  r->scratch = tw_alloc((size_t)n->points + 1, 4 * sizeof *r->scratch);
  r->mask = tw_alloc((size_t)n->masks + 1, sizeof *r->mask);
  r->piece = tw_alloc(n->piece, sizeof(float));
  r->moved = tw_alloc(n->moved, sizeof(float));
  bool complete = r->scratch && r->mask && r->piece && r->moved;
  for (int i = 0; i < 2; i++) {
    r->slopes[i] = tw_alloc(n->slopes, TW_DERIVATIVE_WIDTH * sizeof(float));
    complete = complete && r->slopes[i];
  }
  return complete && tw_skin_scratch_init(&r->skin, n->joints, n->skin_vertices, n->skin_rows) == TW_OK;
}

tw_surface_reader *tw_surface_reader_create_shared(const tw_surface *const *surfaces, size_t count,
                                                   uint32_t displacements_max) {
  reader_needs needs = {0};
  for (size_t i = 0; i < count; i++) need(&needs, surfaces[i], displacements_max);
  tw_surface_reader *r = tw_alloc_zero(1, sizeof *r);
  if (!r || allocate_reader(r, &needs)) return r;
  tw_surface_reader_destroy(r);
  return NULL;
}

void tw_surface_bare_rows(tw_surface *surface, bool normals) {
  const uint32_t none = UINT32_MAX;
  surface->layout = (tw_surface_layout){.stride = normals ? 6 : 3,
                                        .normal = normals ? 3 : none,
                                        .tangent = none,
                                        .joints = none,
                                        .weights = none,
                                        .morphs = none,
                                        .morph_width = 3};
  surface->own_tangents = NULL;
  surface->tangent_frames = NULL;
  surface->skin_rows = NULL;
}

/* Leaves out columns as tw_surface_reader_turn tells; of the normals, where points alone are wanted. */
static void narrow(tw_surface *s, uint32_t first_target, uint32_t target_count, bool points_alone) {
  tw_surface_layout *l = &s->layout;
  const tw_surface_layout whole = *l;
  if (target_count == 0) {
    l->stride = stride_with(&whole, 0);
    l->morph_count = 0;
    return;
  }
  bool normals = whole.morph_width == 6 && !points_alone;
  tw_surface_bare_rows(s, normals);
  if (!normals) s->own_normals = NULL;
  if (s->morphed) s->morphed += first_target;
  if (s->own_morph_normals) s->own_morph_normals += 3 * (size_t)first_target * s->cage_vertices;
  s->smooth += whole.attribute_count + first_target;
  l->morph_count = target_count;
  l->morph_width = normals ? 6 : 3;
  l->morphs = l->stride;
  l->stride += l->morph_width * target_count;
}

const tw_surface_layout *tw_surface_reader_layout(const tw_surface_reader *reader) {
  return &reader->surface->layout;
}

static void turn(tw_surface_reader *reader, const tw_surface *surface, uint32_t first_target,
                 uint32_t target_count, bool points_alone) {
  if (reader->whole == surface && reader->first_target == first_target &&
      reader->target_count == target_count && reader->points_alone == points_alone)
    return;
  reader->whole = reader->surface = surface;
  reader->first_target = first_target;
  reader->target_count = target_count;
  reader->points_alone = points_alone;
  if (target_count < surface->layout.morph_count || points_alone) {
    reader->narrowed = *surface;
    reader->surface = &reader->narrowed;
    narrow(&reader->narrowed, first_target, target_count, points_alone);
  }
  reader->piece_capacity = piece_capacity(surface);
  reader->piece_count = 0;
}

void tw_surface_reader_turn(tw_surface_reader *reader, const tw_surface *surface, uint32_t first_target,
                            uint32_t target_count) {
  turn(reader, surface, first_target, target_count, false);
}

void tw_turn_to_points(tw_surface_reader *reader, const tw_surface *surface, int target) {
  turn(reader, surface, target < 0 ? 0 : (uint32_t)target, target >= 0, true);
}

tw_surface_reader *tw_surface_reader_create(const tw_surface *surface) {
  uint32_t targets = surface->layout.morph_count;
  tw_surface_reader *reader = tw_surface_reader_create_shared(&surface, 1, 2 * targets);
  if (reader) tw_surface_reader_turn(reader, surface, 0, targets);
  return reader;
}

void tw_surface_reader_destroy(tw_surface_reader *reader) {
  if (!reader) return;
  free(reader->scratch);
  free(reader->mask);
  free(reader->piece);
  free(reader->moved);
  for (int i = 0; i < 2; i++) free(reader->slopes[i]);
  tw_skin_scratch_deinit(&reader->skin);
  free(reader);
}
