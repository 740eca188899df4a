/* Tangents of any rows of a surface, from the derivatives of points and UVs in the same quad. */
#include <string.h>

#include "surface_reader.h"

/* Derivatives of one field into slopes[s]. */
static void evaluate(tw_surface_reader *r, const tw_values *values, int s, uint32_t quad,
                     tw_patch_rect rect) {
  tw_patch_job job = {.in = values->base,
                      .width = values->width,
                      .derivatives = r->slopes[s],
                      .stride = TW_DERIVATIVE_WIDTH,
                      .scratch = r->scratch};
  tw_patch_evaluate(&r->surface->fields[values->field].patches, quad, &job, rect);
}

/* The same at a corner that no patch covers. Both fields take the same directions there: along the
 * corner's own two sides. */
static void evaluate_by_mask(tw_surface_reader *r, const tw_values *values, int s, uint32_t corner) {
  const tw_field *field = &r->surface->fields[values->field];
  const tw_topology *base = &field->base;
  uint32_t width = values->width;
  float *first = r->slopes[s], *second = first + TW_DERIVATIVE_SECOND, frame[2][2];
  const float *own = values->base + (size_t)base->corner_vertex[corner] * width;
  if (!tw_limit_frame(base, field->linear, corner, frame)) {
    const float *next = values->base + (size_t)base->corner_vertex[tw_corner_next(base, corner)] * width;
    const float *previous =
        values->base + (size_t)base->corner_vertex[tw_corner_previous(base, corner)] * width;
    for (uint32_t c = 0; c < width; c++) {
      first[c] = next[c] - own[c];
      second[c] = previous[c] - own[c];
    }
    return;
  }
  uint32_t count = tw_limit_mask(base, field->linear, corner, r->mask);
  memset(first, 0, TW_DERIVATIVE_WIDTH * sizeof *first);
  for (uint32_t e = 0; e < count; e++) {
    const tw_limit_entry *entry = &r->mask[e];
    float along1 = frame[0][0] * entry->tangent1 + frame[0][1] * entry->tangent2;
    float along2 = frame[1][0] * entry->tangent1 + frame[1][1] * entry->tangent2;
    const float *value = values->base + (size_t)entry->vertex * width;
    for (uint32_t c = 0; c < width; c++) {
      first[c] += along1 * (value[c] - own[c]);
      second[c] += along2 * (value[c] - own[c]);
    }
  }
}

/* The UVs that the tangents of a face of the base follow. */
static const tw_values *tangent_uvs(const tw_surface *s, uint32_t face) {
  return &s->uvs[s->tangent_frames[face] / 2];
}

/* From slopes to the tangent column of `count` rows. */
static void write_tangents(const tw_surface_reader *r, uint32_t quad, size_t count, bool backwards,
                           float *out) {
  const tw_surface_layout *l = &r->surface->layout;
  bool mirrored = r->surface->tangent_frames[quad] % 2;
  for (size_t i = 0; i < count; i++, out += l->stride) {
    size_t place = TW_DERIVATIVE_WIDTH * (backwards ? count - 1 - i : i);
    tw_tangent_from_derivatives(out + l->normal, r->slopes[0] + place, r->slopes[1] + place, mirrored,
                                out + l->tangent);
  }
}

void tw_corner_tangent(tw_surface_reader *reader, uint32_t corner, float *out) {
  const tw_surface *s = reader->surface;
  uint32_t face = tw_corner_face(&s->fields[0].base, corner);
  if (s->depth == 0) {
    evaluate_by_mask(reader, &s->positions, 0, corner);
    evaluate_by_mask(reader, tangent_uvs(s, face), 1, corner);
  } else {
    evaluate(reader, &s->positions, 0, face, tw_patch_corner(s->side, corner % 4));
    evaluate(reader, tangent_uvs(s, face), 1, face, tw_patch_corner(s->side, corner % 4));
  }
  write_tangents(reader, face, 1, false, out);
}

void tw_edge_tangents(tw_surface_reader *reader, uint32_t corner, float *out) {
  const tw_surface *s = reader->surface;
  bool backwards;
  tw_patch_rect rect = tw_patch_side(s->side, corner % 4, &backwards);
  evaluate(reader, &s->positions, 0, corner / 4, rect);
  evaluate(reader, tangent_uvs(s, corner / 4), 1, corner / 4, rect);
  write_tangents(reader, corner / 4, s->side - 1, backwards, out);
}

void tw_inside_tangents(tw_surface_reader *reader, uint32_t quad, tw_patch_rect rect, float *out) {
  const tw_surface *s = reader->surface;
  evaluate(reader, &s->positions, 0, quad, rect);
  evaluate(reader, tangent_uvs(s, quad), 1, quad, rect);
  size_t count = (size_t)(rect.i1 - rect.i0 + 1) * (rect.j1 - rect.j0 + 1);
  write_tangents(reader, quad, count, false, out);
}
