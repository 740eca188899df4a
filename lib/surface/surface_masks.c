/* Rows of TW_WAY_BASE: values and normals by the limit masks of the base's vertices, and at level 0 the
 * mesh's own normals and tangents. */
#include <string.h>

#include "normal.h"
#include "surface_reader.h"

static double base_value(const tw_values *values, uint32_t vertex, uint32_t component) {
  size_t place = (size_t)vertex * values->width + component;
  return values->exact ? values->exact[place] : (double)values->base[place];
}

static void apply_limit_mask(tw_surface_reader *r, const tw_values *values, uint32_t corner, float *out,
                             float *normal) {
  const tw_surface *s = r->surface;
  const tw_field *field = &s->fields[values->field];
  const tw_topology *base = &field->base;
  uint32_t vertex = base->corner_vertex[corner], width = values->width;
  uint32_t count = tw_limit_mask_after(&r->mask, base, field->linear, corner);
  double limit[4] = {0}, tangents[2][4] = {{0}, {0}};
  for (const tw_limit_entry *e = r->mask.entries; e < r->mask.entries + count; e++)
    for (uint32_t c = 0; c < width; c++) {
      /* Masks sum to 1 (position) and 0 (tangents): differences from the vertex itself keep large terms from
       * cancelling. */
      double offset = base_value(values, e->vertex, c) - base_value(values, vertex, c);
      limit[c] += (double)e->position * offset;
      tangents[0][c] += (double)e->tangent1 * offset;
      tangents[1][c] += (double)e->tangent2 * offset;
    }
  for (uint32_t c = 0; out && s->options.limit && c < width; c++)
    out[c] = (float)(base_value(values, vertex, c) + limit[c]);
  if (!normal) return;
  tw_point along[2] = {{0}, {0}}, quad[4];
  for (int k = 0; k < 2; k++)
    for (int c = 0; c < 3; c++) along[k][c] = (float)tangents[k][c];
  /* A triangle serves as a quad with its last corner twice. */
  uint32_t begin = tw_face_begin(base, tw_corner_face(base, corner));
  for (uint32_t k = 0; k < 4; k++) {
    uint32_t place = k < base->face_size ? k : base->face_size - 1;
    quad[k] = tw_load_values(values->base + (size_t)base->corner_vertex[begin + place] * width, width);
  }
  tw_put_normal(along[0], along[1], quad, normal);
}

/* Computes a value and its normal. out, normal: NULL where not wanted. */
static void evaluate(tw_surface_reader *r, const tw_values *values, uint32_t corner, float *out,
                     float *normal) {
  const tw_surface *s = r->surface;
  uint32_t vertex = s->fields[values->field].base.corner_vertex[corner], width = values->width;
  if (values->at_corners) {
    memcpy(out, values->at_corners + (size_t)tw_nearest_corner(s, corner) * width, width * sizeof *out);
    return;
  }
  const float *at_level = s->options.level == 0 ? values->cage : values->base;
  if (out) memcpy(out, at_level + (size_t)vertex * width, width * sizeof *out);
  if (normal || s->options.limit) apply_limit_mask(r, values, corner, out, normal);
}

/* ---- what a vertex has besides point and normal ------------------------------------------ */

static void tangent(tw_surface_reader *r, uint32_t corner, float *out) {
  const tw_surface *s = r->surface;
  uint8_t frame = s->tangent_frames[tw_corner_face(&s->fields[0].base, corner)];
  const tw_slope_source points = tw_slopes_of(s, &s->positions), uvs = tw_slopes_of(s, &s->uvs[frame / 2]);
  tw_corner_slopes(&points, corner, &r->mask, r->slopes[0]);
  tw_corner_slopes(&uvs, corner, &r->mask, r->slopes[1]);
  tw_write_tangents(r->slopes[0], r->slopes[1], 1, false, frame % 2, tw_tangent_columns_of(s, out));
}

/* Writes joints and weights: the vertex's own influences, or those by its limit mask. */
static void weights(tw_surface_reader *r, uint32_t corner, float *out) {
  const tw_surface *s = r->surface;
  const tw_field *field = &s->fields[0];
  if (s->options.limit) {
    uint32_t count = tw_limit_mask_after(&r->mask, &field->base, field->linear, corner);
    tw_skin_mask_row(&s->influences, r->mask.entries, count, &r->skin, tw_skin_columns_of(s, out));
    return;
  }
  const tw_influences *own = s->cage_influences.offsets ? &s->cage_influences : &s->influences;
  const tw_limit_entry itself = {field->base.corner_vertex[corner], 1, 0, 0};
  tw_skin_mask_row(own, &itself, 1, &r->skin, tw_skin_columns_of(s, out));
}

static void attributes(tw_surface_reader *r, uint32_t row, float *out) {
  const tw_surface *s = r->surface;
  const tw_surface_layout *l = &s->layout;
  uint32_t corner = tw_corner_of_row(&s->vertices, row);
  if (l->tangent != UINT32_MAX) tangent(r, corner, out);
  for (uint32_t i = 0; i < l->uv_count; i++) evaluate(r, &s->uvs[i], corner, out + l->uvs[i], NULL);
  for (uint32_t i = 0; i < tw_smooth_count(l); i++)
    evaluate(r, &s->smooth[i], corner, out + tw_smooth_column(l, i), NULL);
  if (l->joints != UINT32_MAX) weights(r, corner, out);
}

/* Replaces a column by the mesh's own vectors, except where these are 0 0 0. own: [rows of level
 * 0][width]. */
static void put_own(const tw_surface *s, const float *own, uint32_t width, uint32_t column, uint32_t first,
                    uint32_t count, float *out) {
  own += width * (size_t)first;
  for (uint32_t i = 0; i < count; i++, own += width, out += s->layout.stride)
    if (own[0] != 0 || own[1] != 0 || own[2] != 0) memcpy(out + column, own, width * sizeof *own);
}

/* ---- rows ----------------------------------------------------------------------------------- */

void tw_base_read_rows(tw_surface_reader *reader, tw_domain domain, uint32_t first, uint32_t count,
                       float *out) {
  const tw_surface *s = reader->surface;
  const tw_numbering *n = tw_numbering_of(s, domain);
  uint32_t width = tw_row_width(s, domain);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t corner = tw_corner_of_row(n, first + i);
    float *row = out + (size_t)i * width;
    if (domain == TW_DOMAIN_UVS)
      evaluate(reader, &s->uvs[0], corner, row, NULL);
    else /* split vertices have the same point to the last bit: all corners of a vertex have its weights */
      evaluate(reader, &s->positions, corner, row, tw_normal_in(s, domain, row));
  }
  if (domain != TW_DOMAIN_VERTICES) return;
  /* Own normals come first: tangents are made orthogonal to the normal in the row. */
  if (s->own_normals) put_own(s, s->own_normals, 3, s->layout.normal, first, count, out);
  for (uint32_t i = 0; tw_has_attributes(s, domain) && i < count; i++)
    attributes(reader, first + i, out + (size_t)i * width);
  if (s->own_tangents) put_own(s, s->own_tangents, 4, s->layout.tangent, first, count, out);
}
