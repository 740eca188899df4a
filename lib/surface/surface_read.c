/* Reads any rows of a surface: at corners, on the insides of edges and of quads. Each request is cut into
 * pieces; a piece is computed at once. */
#include <string.h>

#include "surface_reader.h"

enum { PIECE_ROWS = 2048 };

uint64_t tw_own_row_count(const tw_surface *s, tw_domain domain) {
  if (domain == TW_DOMAIN_UVS && s->uvs[0].width == 0) return 0; /* no UV sets */
  if (s->options.level == 0) {
    if (domain == TW_DOMAIN_POINTS) return s->cage_points;
    return domain == TW_DOMAIN_UVS ? s->cage_uv_points : s->cage_vertices;
  }
  const tw_numbering *n = tw_numbering_of(s, domain);
  return n->corner_count + n->edge_count * tw_rows_inside_edge(s) + s->quad_count * tw_rows_inside_face(s);
}

uint64_t tw_surface_row_count(const tw_surface *surface, tw_domain domain) {
  uint64_t own = tw_own_row_count(surface, domain);
  return surface->rim ? own + tw_own_row_count(surface->rim, domain) : own;
}

/* ---- pieces --------------------------------------------------------------------------------- */

static uint32_t at_most(uint64_t a, uint64_t b) {
  return (uint32_t)(a < b ? a : b);
}

/* As many whole items as fit in `wanted` rows, at least one. */
static tw_piece whole_items(tw_piece_kind kind, uint64_t first, uint64_t item, uint64_t rows_an_item,
                            uint64_t items, size_t wanted) {
  uint32_t taken = at_most(wanted / rows_an_item, items - item);
  if (taken == 0) taken = 1;
  return (tw_piece){kind, first, taken * (uint32_t)rows_an_item, (uint32_t)item, taken, 0};
}

/* The piece at a row, when `wanted` rows from there on are asked for. It begins at the row or, where the row
 * is amid an item, at the start of that item and is the item alone. An item is computed the same way whatever
 * piece it is in. */
static tw_piece piece_at(const tw_surface *s, tw_domain domain, uint64_t row, size_t wanted) {
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint64_t corners = s->options.level == 0 ? tw_own_row_count(s, domain) : n->corner_count;
  if (row < corners) return whole_items(TW_PIECE_CORNERS, row, row, 1, corners, wanted);
  uint64_t edge_rows = tw_rows_inside_edge(s), in_edges = row - corners;
  if (in_edges < n->edge_count * edge_rows)
    return whole_items(TW_PIECE_EDGES, row - in_edges % edge_rows, in_edges / edge_rows, edge_rows,
                       n->edge_count, in_edges % edge_rows == 0 ? wanted : 0);
  uint64_t quads_begin = corners + n->edge_count * edge_rows, quad_rows = tw_rows_inside_face(s);
  uint64_t in_quads = row - quads_begin;
  if (quad_rows <= PIECE_ROWS)
    return whole_items(TW_PIECE_QUADS, row - in_quads % quad_rows, in_quads / quad_rows, quad_rows,
                       s->quad_count, in_quads % quad_rows == 0 ? wanted : 0);
  uint32_t quad = (uint32_t)(in_quads / quad_rows), lines = PIECE_ROWS / (uint32_t)edge_rows;
  if (lines == 0) lines = 1;
  uint32_t line = (uint32_t)(in_quads % quad_rows / edge_rows) / lines * lines;
  uint32_t taken = at_most(lines, edge_rows - line);
  uint64_t first = quads_begin + quad * quad_rows + line * edge_rows;
  return (tw_piece){TW_PIECE_LINES, first, taken * (uint32_t)edge_rows, quad, 1, line};
}

/* Returns a piece in the reader's memory, and computes it unless it is there already. */
static const float *keep_piece(tw_surface_reader *r, tw_domain domain, const tw_piece *p) {
  if (r->piece_count == 0 || r->piece_domain != domain || r->piece_first != p->first) {
    tw_read_piece(r, domain, p, r->piece);
    r->piece_domain = domain;
    r->piece_first = p->first;
    r->piece_count = p->count;
  }
  return r->piece;
}

/* Reads rows of reader->surface, but for its rim. */
static void read_rows(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count, float *out) {
  const tw_surface *s = reader->surface;
  uint32_t width = tw_row_width(s, domain);
  while (count > 0) {
    size_t wanted = s->morphed && count > reader->piece_capacity ? reader->piece_capacity : count;
    tw_piece p = piece_at(s, domain, first, wanted);
    size_t skip = (size_t)(first - p.first), take = p.count - skip;
    if (take > count) take = count;
    if (take == p.count)
      tw_read_piece(reader, domain, &p, out);
    else
      memcpy(out, keep_piece(reader, domain, &p) + skip * width, take * width * sizeof *out);
    out += take * width;
    first += take;
    count -= take;
  }
}

/* Of rows of the rim that are split from rows of the inner part, takes the points from there, so that they
 * are the same to the last bit. */
static void share_points(tw_surface_reader *reader, uint64_t first, size_t count, float *out) {
  const tw_surface *s = reader->surface, *rim = s->rim;
  uint64_t own = tw_own_row_count(s, TW_DOMAIN_POINTS);
  for (size_t i = 0; i < count; i++, out += s->layout.stride) {
    uint32_t corner = tw_corner_of_row(&rim->vertices, (uint32_t)(first + i)),
             row = tw_row_of_corner(&rim->points, corner);
    if (row < own) read_rows(reader, TW_DOMAIN_POINTS, row, 1, out);
  }
}

void tw_surface_read_rows(tw_surface_reader *reader, tw_domain domain, uint64_t first, size_t count,
                          float *out) {
  const tw_surface *s = reader->surface;
  uint64_t own = tw_own_row_count(s, domain), end = first + count;
  if (first < own) read_rows(reader, domain, first, end <= own ? count : (size_t)(own - first), out);
  if (end <= own) return;
  size_t skipped = first < own ? (size_t)(own - first) : 0;
  first += skipped - own;
  count -= skipped;
  out += skipped * tw_row_width(s, domain);
  reader->surface = s->rim;
  read_rows(reader, domain, first, count, out);
  reader->surface = s;
  if (domain == TW_DOMAIN_VERTICES) share_points(reader, first, count, out);
}

/* ---- reader --------------------------------------------------------------------------------- */

static uint32_t larger(uint32_t a, uint32_t b) {
  return a > b ? a : b;
}

static uint32_t piece_capacity(const tw_surface *surface) {
  return larger(surface->side, PIECE_ROWS);
}

/* The memory that the most demanding of several surfaces needs. */
typedef struct reader_needs {
  uint32_t points, masks, slopes;            /* slopes: rows that have tangents */
  uint32_t joints, skin_vertices, skin_rows; /* of skinned surfaces */
  size_t piece, moved;                       /* floats */
  size_t quads;                              /* 0 or 1 */
} reader_needs;

static void need(reader_needs *n, const tw_surface *s, uint32_t displacements_max) {
  if (s->rim) need(n, s->rim, displacements_max);
  uint32_t rows = piece_capacity(s), all = s->layout.morph_count;
  /* A target has one displacement (width 3) or two (6). */
  uint32_t most = displacements_max * 3 / s->layout.morph_width;
  uint32_t stride = tw_stride_with(&s->layout, all < most ? all : most);
  if (s->morphed && most > 0) n->moved = TW_MOVED_WIDTH * (size_t)rows;
  size_t piece = (size_t)rows * larger(stride, 4); /* at least 4 floats a row: bare points are read too */
  n->points = larger(n->points, s->scratch_points);
  n->masks = larger(n->masks, s->mask_capacity);
  if (piece > n->piece) n->piece = piece;
  if (s->near_concave) n->quads = 1;
  if (s->tangent_frames) n->slopes = larger(n->slopes, rows);
  if (s->layout.joints == UINT32_MAX || s->skin_rows) return;
  n->joints = larger(n->joints, s->influences.joint_count);
  n->skin_vertices = larger(n->skin_vertices, s->influences.vertex_count);
  n->skin_rows = larger(n->skin_rows, rows);
}

static bool allocate_reader(tw_surface_reader *r, const reader_needs *n) {
  r->scratch = tw_alloc((size_t)n->points + 1, 4 * sizeof *r->scratch);
  r->mask.entries = tw_alloc((size_t)n->masks + 1, sizeof *r->mask.entries);
  r->piece = tw_alloc(n->piece, sizeof(float));
  r->moved = tw_alloc(n->moved, sizeof(float));
  r->frames = tw_alloc(n->slopes, sizeof *r->frames);
  r->quads = tw_alloc(n->quads, sizeof *r->quads);
  bool complete = r->scratch && r->mask.entries && r->piece && r->moved && r->frames && r->quads;
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

const tw_surface_layout *tw_surface_reader_layout(const tw_surface_reader *reader) {
  return &reader->surface->layout;
}

/* Makes the reader read all columns of this surface. Empties the caches. */
static void begin(tw_surface_reader *reader, const tw_surface *surface) {
  reader->chosen = reader->surface = surface;
  reader->is_unsplit = false;
  reader->piece_capacity = piece_capacity(surface);
  reader->piece_count = 0;
  reader->mask.topology = NULL;
}

/* Makes the reader read a copy, from which columns can be taken away. */
static void take_copy(tw_surface_reader *reader, const tw_surface *surface) {
  reader->narrowed = *surface;
  reader->surface = &reader->narrowed;
  if (!surface->rim) return;
  reader->narrowed_rim = *surface->rim;
  reader->narrowed.rim = &reader->narrowed_rim;
}

/* Makes the reader read this surface, or a narrowed copy where not all columns are wanted. */
static void turn(tw_surface_reader *reader, const tw_surface *surface, uint32_t first_target,
                 uint32_t target_count, bool points_alone) {
  if (reader->chosen == surface && !reader->is_unsplit && reader->first_target == first_target &&
      reader->target_count == target_count && reader->points_alone == points_alone)
    return;
  begin(reader, surface);
  reader->first_target = first_target;
  reader->target_count = target_count;
  reader->points_alone = points_alone;
  if (target_count < surface->layout.morph_count || points_alone) {
    take_copy(reader, surface);
    tw_narrow_rows(&reader->narrowed, first_target, target_count, points_alone);
    if (surface->rim) tw_narrow_rows(&reader->narrowed_rim, first_target, target_count, points_alone);
  }
}

void tw_surface_reader_turn(tw_surface_reader *reader, const tw_surface *surface, uint32_t first_target,
                            uint32_t target_count) {
  turn(reader, surface, first_target, target_count, false);
}

void tw_turn_to_points(tw_surface_reader *reader, const tw_surface *surface, int target) {
  uint32_t first = target < 0 ? 0 : (uint32_t)target, count = target < 0 ? 0 : 1;
  turn(reader, surface, first, count, true);
}

static bool has_columns(const tw_surface_reader *reader, const tw_point_columns *columns) {
  const tw_point_columns *own = &reader->columns;
  return reader->is_unsplit && own->normal == columns->normal && own->uv == columns->uv &&
         own->attribute == columns->attribute;
}

void tw_surface_reader_turn_to_unsplit(tw_surface_reader *reader, const tw_surface *surface,
                                       const tw_point_columns *columns) {
  if (reader->chosen == surface && has_columns(reader, columns)) return;
  begin(reader, surface);
  reader->is_unsplit = true;
  reader->columns = *columns;
  take_copy(reader, surface);
  tw_unsplit_rows(&reader->narrowed, columns);
  if (surface->rim) tw_unsplit_rows(&reader->narrowed_rim, columns);
}

tw_surface_reader *tw_surface_reader_create(const tw_surface *surface) {
  uint32_t targets = surface->layout.morph_count;
  tw_surface_reader *reader = tw_surface_reader_create_shared(&surface, 1, 2 * targets);
  if (reader) tw_surface_reader_turn(reader, surface, 0, targets);
  return reader;
}

void tw_surface_reader_destroy(tw_surface_reader *reader) {
  if (!reader) return;
  tw_free(reader->scratch);
  tw_free(reader->mask.entries);
  tw_free(reader->piece);
  tw_free(reader->moved);
  tw_free(reader->frames);
  tw_free(reader->quads);
  for (int i = 0; i < 2; i++) tw_free(reader->slopes[i]);
  tw_skin_scratch_deinit(&reader->skin);
  tw_free(reader);
}
