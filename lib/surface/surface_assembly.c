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

void tw_builder_lay_out(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  tw_surface_layout *l = &s->layout;
  *l = no_columns;
  uint32_t stride = l->stride;
  if (s->options.normals) {
    l->normal = stride;
    stride += 3;
  }
  if (s->tangent_frames) {
    l->tangent = stride;
    stride += 4;
  }
  l->uv_count = b->mesh->uv_set_count;
  for (uint32_t i = 0; i < l->uv_count; i++, stride += 2) l->uvs[i] = stride;
  l->attribute_count = s->attribute_count;
  for (uint32_t i = 0; i < l->attribute_count; stride += s->smooth[i++].width) l->attributes[i] = stride;
  l->influences = tw_mesh_influences(b->mesh, s->options.influences);
  if (l->influences > 0) {
    l->joints = stride;
    l->weights = stride + l->influences;
    stride += 2 * l->influences;
  }
  l->morph_count = s->morph_count;
  l->morph_width = b->morph_normals ? 6 : 3;
  if (s->morph_count > 0) { /* they stand last, so that tw_narrow_rows can take them off the end */
    l->morphs = stride;
    stride += l->morph_width * s->morph_count;
  }
  l->stride = stride;
}

void tw_surface_bare_rows(tw_surface *surface, bool normals) {
  surface->layout = no_columns;
  if (normals) {
    surface->layout.normal = 3;
    surface->layout.stride = 6;
  }
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
  s->smooth += whole.attribute_count + first_target;
  l->morph_count = target_count;
  l->morph_width = normals ? 6 : 3;
  l->morphs = l->stride;
  l->stride += l->morph_width * target_count;
}

void tw_unsplit_rows(tw_surface *s, const tw_point_columns *columns) {
  tw_surface_bare_rows(s, columns->normal);
  if (!columns->normal) s->own_normals = NULL;
  s->morphed = NULL;
  if (columns->uv) {
    s->layout.uv_count = 1;
    s->layout.uvs[0] = s->layout.stride;
    s->layout.stride += 2;
  }
  if (columns->attribute != UINT32_MAX) {
    s->smooth += columns->attribute;
    s->layout.attribute_count = 1;
    s->layout.attributes[0] = s->layout.stride;
    s->layout.stride += s->smooth->width;
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

/* Number and columns of the attributes and displacements in a row. */
static uint32_t smooth_count(const tw_surface_layout *l) {
  return l->attribute_count + l->morph_count;
}
static uint32_t smooth_column(const tw_surface_layout *l, uint32_t i) {
  return i < l->attribute_count ? l->attributes[i] : l->morphs + l->morph_width * (i - l->attribute_count);
}

/* Writes what a vertex has besides point and normal. */
static void write_attributes(tw_surface_reader *r, const tw_block *block, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  const tw_evaluator *e = s->evaluator;
  if (l->tangent != UINT32_MAX) write_tangents(r, block, out);
  for (uint32_t i = 0; i < l->uv_count; i++) e->values(r, &s->uvs[i], block, out + l->uvs[i], l->stride);
  for (uint32_t i = 0; i < smooth_count(l); i++)
    e->values(r, &s->smooth[i], block, out + smooth_column(l, i), l->stride);
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

/* Clamps the colours of `count` rows. All four numbers at once: a colour has four. */
static void clamp_colors(float *color, uint32_t count, uint32_t stride) {
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

/* Finishes rows: v runs down on GPUs, and colours are clamped, because rounding may take sums of weights out
 * of their range. */
static void finish_rows(const tw_surface *s, uint32_t count, float *rows) {
  const tw_surface_layout *l = &s->layout;
  for (uint32_t i = 0; i < l->uv_count; i++) {
    float *v = rows + l->uvs[i] + 1;
    for (uint32_t row = 0; row < count; row++, v += l->stride) *v = 1 - *v;
  }
  for (uint32_t i = 0; i < l->attribute_count; i++)
    if (s->smooth[i].is_color) clamp_colors(rows + l->attributes[i], count, l->stride);
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
