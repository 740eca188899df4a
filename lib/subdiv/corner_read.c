/* Values and normals at the vertices of a base that no patch covers: by their limit masks. */
#include <string.h>

#include "normal.h"
#include "surface_reader.h"

static double base_value(const tw_values *values, uint32_t vertex, uint32_t component) {
  size_t place = (size_t)vertex * values->width + component;
  return values->exact ? values->exact[place] : (double)values->base[place];
}

static void by_mask(tw_surface_reader *r, const tw_values *values, uint32_t corner, float *out,
                    float *normal) {
  const tw_surface *s = r->surface;
  const tw_field *field = &s->fields[values->field];
  const tw_topology *base = &field->base;
  uint32_t vertex = base->corner_vertex[corner], width = values->width;
  uint32_t count = tw_limit_mask(base, field->linear, corner, r->mask);
  double limit[4] = {0}, tangents[2][4] = {{0}, {0}};
  for (uint32_t e = 0; e < count; e++)
    for (uint32_t c = 0; c < width; c++) {
      /* Masks sum to 1 and 0: against the vertex itself nothing large cancels. */
      double offset = base_value(values, r->mask[e].vertex, c) - base_value(values, vertex, c);
      limit[c] += (double)r->mask[e].position * offset;
      tangents[0][c] += (double)r->mask[e].tangent1 * offset;
      tangents[1][c] += (double)r->mask[e].tangent2 * offset;
    }
  for (uint32_t c = 0; out && s->options.limit && c < width; c++)
    out[c] = (float)(base_value(values, vertex, c) + limit[c]);
  if (!normal) return;
  float tangent1[4], tangent2[4];
  for (int c = 0; c < 4; c++) {
    tangent1[c] = (float)tangents[0][c];
    tangent2[c] = (float)tangents[1][c];
  }
  /* A triangle is a quad with its last corner twice. */
  const float *quad[4];
  uint32_t begin = tw_face_begin(base, tw_corner_face(base, corner));
  for (uint32_t k = 0; k < 4; k++) {
    uint32_t place = k < base->face_size ? k : base->face_size - 1;
    quad[k] = values->base + (size_t)base->corner_vertex[begin + place] * width;
  }
  tw_normal_from_tangents(tangent1, tangent2, quad, normal);
}

void tw_corner_by_mask(tw_surface_reader *reader, const tw_values *values, uint32_t corner, float *out,
                       float *normal) {
  const tw_surface *s = reader->surface;
  uint32_t vertex = s->fields[values->field].base.corner_vertex[corner], width = values->width;
  const float *at_level = s->options.level == 0 ? values->cage : values->base;
  if (out) memcpy(out, at_level + (size_t)vertex * width, width * sizeof *out);
  if (!normal && !s->options.limit) return;
  by_mask(reader, values, corner, out, normal);
}
