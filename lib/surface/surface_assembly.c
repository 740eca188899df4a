/* What rows hold and where, and how they are put together. This is the one place that knows all columns; the
 * evaluator computes each of them. */
#include <string.h>

#include "surface_plan.h"
#include "surface_reader.h"

/* ---- the layout ------------------------------------------------------------------------------ */

static const tw_surface_layout no_columns = {.stride = 3,
                                             .normal = UINT32_MAX,
                                             .tangent = UINT32_MAX,
                                             .joints = UINT32_MAX,
                                             .weights = UINT32_MAX,
                                             .morphs = UINT32_MAX,
                                             .morph_width = 3};

static const uint32_t NORMAL = 3, TANGENT = 4, UV = 2; /* floats */

uint32_t tw_surface_influences(const tw_mesh *mesh, uint32_t most) {
  /* Of an element of glTF: the columns that a row may have besides, as floats, and four influences, with
   * joints as short integers. */
  enum { SET = 4 * (sizeof(uint16_t) + sizeof(float)) };
  uint32_t columns = 3 + NORMAL + (mesh->has_tangents ? TANGENT : 0) + UV * mesh->uv_set_count;
  for (uint32_t i = 0; i < mesh->attribute_count; i++) columns += mesh->attributes[i].width;
  size_t used = columns * sizeof(float);
  uint32_t sets = used < TW_VERTEX_STRIDE_MAX ? (uint32_t)(TW_VERTEX_STRIDE_MAX - used) / SET : 0;
  uint32_t width = mesh->skin.joints ? mesh->skin.width : 0;
  if (width > 4 * sets) width = 4 * (sets > 0 ? sets : 1);
  return most > 0 && width > most ? most : width;
}

/* Adds a column of `width` floats at the end of the row. */
static uint32_t add_column(tw_surface_layout *layout, uint32_t width) {
  layout->stride += width;
  return layout->stride - width;
}

/* False without memory. */
static bool add_attribute(tw_surface *s, const tw_attribute *from) {
  tw_surface_layout *l = &s->layout;
  const char *name = tw_arena_text(s->arena, from->name, strlen(from->name));
  l->attributes[l->attribute_count++] =
      (tw_row_attribute){name, add_column(l, from->width), from->width, from->numbers, from->is_color};
  return name != NULL;
}

tw_status tw_builder_lay_out(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  tw_surface_layout *l = &s->layout;
  *l = no_columns;
  if (s->options.normals) l->normal = add_column(l, NORMAL);
  if (s->tangent_frames) l->tangent = add_column(l, TANGENT);
  l->uv_count = b->mesh->uv_set_count;
  for (uint32_t i = 0; i < l->uv_count; i++) l->uvs[i] = add_column(l, UV);
  for (uint32_t i = 0; i < s->attribute_count; i++)
    if (!add_attribute(s, &b->mesh->attributes[i])) return TW_NO_MEMORY;
  l->influences = tw_surface_influences(b->mesh, s->options.influences);
  if (l->influences > 0) {
    l->joints = add_column(l, l->influences);
    l->weights = add_column(l, l->influences);
  }
  l->morph_count = s->morph_count;
  l->morph_width = b->morph_normals ? 6 : 3;
  if (s->morph_count > 0) /* they stand last, so that tw_narrow_rows can take them off the end */
    l->morphs = add_column(l, l->morph_width * s->morph_count);
  return TW_OK;
}

uint32_t tw_surface_color(const tw_surface *surface) {
  const tw_surface_layout *l = &surface->layout;
  for (uint32_t i = 0; i < l->attribute_count; i++)
    if (l->attributes[i].is_color) return i;
  return UINT32_MAX;
}

void tw_surface_bare_rows(tw_surface *surface, bool normals) {
  surface->layout = no_columns;
  if (normals) surface->layout.normal = add_column(&surface->layout, NORMAL);
  surface->own_tangents = NULL;
  surface->tangent_frames = NULL;
  surface->skin_rows = NULL;
}

uint32_t tw_stride_with(const tw_surface_layout *layout, uint32_t targets) {
  return layout->stride - layout->morph_width * layout->morph_count + layout->morph_width * targets;
}

void tw_narrow_rows(tw_surface *s, uint32_t first_target, uint32_t target_count, bool points_alone) {
  tw_surface_layout *l = &s->layout;
  const tw_surface_layout whole = *l;
  if (target_count == 0) {
    l->stride = tw_stride_with(&whole, 0);
    l->morph_count = 0;
    return;
  }
  bool normals = whole.morph_width == 6 && !points_alone;
  tw_surface_bare_rows(s, normals);
  if (!normals) s->own_normals = NULL;
  if (s->morphed) s->morphed += first_target;
  if (s->own_morph_normals) s->own_morph_normals += 3 * (size_t)first_target * s->cage_vertices;
  s->displacements += first_target;
  l->morph_count = target_count;
  l->morph_width = normals ? 6 : 3;
  l->morphs = add_column(l, l->morph_width * target_count);
}

void tw_unsplit_rows(tw_surface *s, const tw_point_columns *columns) {
  const tw_surface_layout whole = s->layout;
  tw_surface_bare_rows(s, columns->normal);
  if (!columns->normal) s->own_normals = NULL;
  s->morphed = NULL;
  if (columns->uv) {
    s->layout.uv_count = 1;
    s->layout.uvs[0] = add_column(&s->layout, UV);
  }
  if (columns->attribute != UINT32_MAX) {
    s->smooth += columns->attribute;
    s->layout.attribute_count = 1;
    s->layout.attributes[0] = whole.attributes[columns->attribute];
    s->layout.attributes[0].column = add_column(&s->layout, s->smooth->width);
  }
  s->vertices = s->points;
  s->cage_vertices = s->cage_points;
}

/* ---- a block --------------------------------------------------------------------------------- */

/* The row of TW_DOMAIN_VERTICES that shows row `row` of level 0: the same, but where rows are of points. */
static uint32_t split_row(const tw_surface_reader *r, uint32_t row) {
  if (!r->is_unsplit) return row;
  return tw_row_of_corner(&r->chosen->vertices, tw_corner_of_row(&r->chosen->points, row));
}

/* Replaces a column by the mesh's own vectors, except where these are 0 0 0. own: [rows of TW_DOMAIN_VERTICES
 * at level 0][width]. */
static void put_own(const tw_surface_reader *r, const float *own, uint32_t width, uint32_t column,
                    const tw_block *block, float *out) {
  for (uint32_t i = 0; i < block->count; i++, out += r->surface->layout.stride) {
    const float *vector = own + width * (size_t)split_row(r, block->first + i);
    if (vector[0] != 0 || vector[1] != 0 || vector[2] != 0)
      memcpy(out + column, vector, width * sizeof *vector);
  }
}

static void write_tangents(tw_surface_reader *r, const tw_block *block, float *out) {
  const tw_surface *s = r->surface;
  s->evaluator->slopes(r, block);
  const tw_tangent_columns columns = {out + s->layout.normal, out + s->layout.tangent, s->layout.stride};
  tw_write_tangents(r->slopes[0], r->slopes[1], r->frames, block->count, columns);
}

/* Writes what a vertex has besides point and normal. */
static void write_attributes(tw_surface_reader *r, const tw_block *block, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  const tw_evaluator *e = s->evaluator;
  if (l->tangent != UINT32_MAX) write_tangents(r, block, out);
  for (uint32_t i = 0; i < l->uv_count; i++) e->values(r, &s->uvs[i], block, out + l->uvs[i], l->stride);
  for (uint32_t i = 0; i < l->attribute_count; i++)
    e->values(r, &s->smooth[i], block, out + l->attributes[i].column, l->stride);
  for (uint32_t m = 0; m < l->morph_count; m++)
    e->values(r, &s->displacements[m], block, out + l->morphs + (size_t)l->morph_width * m, l->stride);
  if (l->joints != UINT32_MAX) e->influences(r, block, out);
}

void tw_assemble_points(tw_surface_reader *reader, tw_domain domain, const tw_block *block, float *out) {
  const tw_surface *s = reader->surface;
  const tw_evaluator *e = s->evaluator;
  uint32_t stride = tw_row_width(s, domain);
  bool has_normals = domain == TW_DOMAIN_VERTICES && s->layout.normal != UINT32_MAX;
  if (domain == TW_DOMAIN_UVS)
    e->values(reader, &s->uvs[0], block, out, stride);
  else
    e->points(reader, block, out, has_normals ? out + s->layout.normal : NULL, stride);
}

void tw_assemble_attributes(tw_surface_reader *reader, tw_domain domain, const tw_block *block, float *out) {
  const tw_surface *s = reader->surface;
  if (domain != TW_DOMAIN_VERTICES) return;
  /* Own normals come first: tangents are made orthogonal to the normal in the row. */
  if (s->own_normals) put_own(reader, s->own_normals, 3, s->layout.normal, block, out);
  if (tw_has_attributes(s, domain)) write_attributes(reader, block, out);
  if (s->own_tangents) put_own(reader, s->own_tangents, 4, s->layout.tangent, block, out);
}

void tw_assemble_rows(tw_surface_reader *reader, tw_domain domain, const tw_block *block, float *out) {
  tw_assemble_points(reader, domain, block, out);
  tw_assemble_attributes(reader, domain, block, out);
}

/* ---- a piece --------------------------------------------------------------------------------- */

void tw_finish_colors(float *color, size_t count, uint32_t stride) {
  typedef int32_t lanes __attribute__((vector_size(16)));
  const tw_point none = {0}, full = {1, 1, 1, 1};
  for (; count > 0; count--, color += stride) {
    tw_point c;
    memcpy(&c, color, sizeof c);
    c = (tw_point)((lanes)c & ~(c < none));
    const lanes over = c > full;
    c = (tw_point)(((lanes)c & ~over) | ((lanes)full & over));
    memcpy(color, &c, sizeof c);
  }
}

void tw_turn_v(float *uv, size_t count, uint32_t stride) {
  for (float *v = uv + 1; count > 0; count--, v += stride) *v = 1 - *v;
}

/* Finishes rows: v runs down on GPUs, and colours are clamped, because rounding may take sums of weights out
 * of their range. */
static void finish_rows(const tw_surface *s, uint32_t count, float *rows) {
  const tw_surface_layout *l = &s->layout;
  for (uint32_t i = 0; i < l->uv_count; i++) tw_turn_v(rows + l->uvs[i], count, l->stride);
  for (uint32_t i = 0; i < l->attribute_count; i++)
    if (l->attributes[i].is_color) tw_finish_colors(rows + l->attributes[i].column, count, l->stride);
}

/* Computes all columns but what targets displace normals by. */
static void read_columns(tw_surface_reader *reader, tw_domain domain, const tw_piece *piece, float *out) {
  const tw_surface *s = reader->surface;
  s->evaluator->read(reader, domain, piece, out);
  if (tw_has_attributes(s, domain)) finish_rows(s, piece->count, out);
}

/* Writes the displacements of normals by morph targets into rows that have all other columns. */
static void displace_normals(tw_surface_reader *r, const tw_piece *p, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  for (uint32_t m = 0; m < l->morph_count; m++) {
    float *row = out;
    const float *own = s->own_morph_normals;
    if (own) {
      own += 3 * ((size_t)m * s->cage_vertices + (size_t)p->first);
    } else {
      r->surface = s->morphed[m];
      read_columns(r, TW_DOMAIN_VERTICES, p, r->moved);
      r->surface = s;
    }
    for (uint32_t k = 0; k < p->count; k++, row += l->stride)
      for (uint32_t c = 0; c < 3; c++) {
        float *to = row + l->morphs + 6 * (size_t)m + 3 + c;
        *to = own ? own[3 * k + c] : r->moved[TW_MOVED_WIDTH * k + 3 + c] - row[l->normal + c];
      }
  }
}

void tw_read_piece(tw_surface_reader *reader, tw_domain domain, const tw_piece *piece, float *out) {
  read_columns(reader, domain, piece, out);
  if (domain == TW_DOMAIN_VERTICES && reader->surface->layout.morph_width == 6)
    displace_normals(reader, piece, out);
}
