/* Puts rows together. This is the one place that knows what a row holds and where; the evaluator computes
 * each column. */
#include <string.h>

#include "surface_reader.h"

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
  tw_write_tangents(r->slopes[0], r->slopes[1], r->frames, block->count, tw_tangent_columns_of(s, out));
}

/* Writes what a vertex has besides point and normal. */
static void write_attributes(tw_surface_reader *r, const tw_block *block, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  const tw_evaluator *e = s->evaluator;
  if (l->tangent != UINT32_MAX) write_tangents(r, block, out);
  for (uint32_t i = 0; i < l->uv_count; i++) e->values(r, &s->uvs[i], block, out + l->uvs[i], l->stride);
  for (uint32_t i = 0; i < tw_smooth_count(l); i++)
    e->values(r, &s->smooth[i], block, out + tw_smooth_column(l, i), l->stride);
  if (l->joints != UINT32_MAX) e->influences(r, block, out);
}

void tw_assemble_points(tw_surface_reader *reader, tw_domain domain, const tw_block *block, float *out) {
  const tw_surface *s = reader->surface;
  const tw_evaluator *e = s->evaluator;
  uint32_t stride = tw_row_width(s, domain);
  if (domain == TW_DOMAIN_UVS)
    e->values(reader, &s->uvs[0], block, out, stride);
  else
    e->points(reader, block, out, tw_normal_in(s, domain, out), stride);
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

void tw_read_piece(tw_surface_reader *reader, tw_domain domain, const tw_piece *piece, float *out) {
  const tw_surface *s = reader->surface;
  s->evaluator->read(reader, domain, piece, out);
  if (tw_has_attributes(s, domain)) finish_rows(s, piece->count, out);
}
