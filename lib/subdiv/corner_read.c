/* Values and normals at the vertices of a base that no patch covers: by their limit masks. */
#include <string.h>

#include "normal.h"
#include "surface_reader.h"

static double base_value(const tw_values *values, uint32_t vertex, uint32_t component) {
  size_t place = (size_t)vertex * values->width + component;
  return values->exact ? values->exact[place] : (double)values->base[place];
}

/* ---- any vertex ----------------------------------------------------------------------------- */

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

/* ---- smooth vertices inside a mesh of quads ------------------------------------------------- */

static bool is_smooth(const tw_topology *t, uint32_t vertex) {
  if (t->smooth) return true;
  if (t->vertex_flags[vertex] || t->vertex_sharpness[vertex] > 0) return false;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++)
    if (t->edge_sharpness[t->ring_edges[i]] > 0) return false;
  return true;
}

/* The masks of a valence are made for the first vertex that has it. */
static const tw_limit_entry *smooth_mask(tw_surface_reader *r, const tw_topology *t, uint32_t corner,
                                         uint32_t valence) {
  tw_limit_entry *entries = r->smooth_masks[valence];
  if (entries[0].position == 0) tw_limit_mask(t, false, corner, entries);
  return entries;
}

/* The fan has all neighbours: each of its quads the end of one edge and the corner across. In double where
 * the values are. */
static inline __attribute__((always_inline)) void sum_fan(const tw_topology *t, const tw_values *values,
                                                          bool exact, uint32_t width, uint32_t vertex,
                                                          const tw_limit_entry *mask, double sums[3][4]) {
  uint32_t first = t->fan_offsets[vertex], valence = t->fan_offsets[vertex + 1] - first;
  for (uint32_t i = 0; i < valence; i++) {
    uint32_t next = tw_quad_next(t->fan_corners[first + i]), across = tw_quad_next(next);
    const tw_limit_entry *entries[2] = {&mask[1 + i], &mask[1 + valence + i]};
    size_t own = (size_t)vertex * width,
           places[2] = {(size_t)t->corner_vertex[next] * width, (size_t)t->corner_vertex[across] * width};
    for (int k = 0; k < 2; k++)
      for (uint32_t c = 0; c < width; c++) {
        double offset = exact ? values->exact[places[k] + c] - values->exact[own + c]
                              : (double)(values->base[places[k] + c] - values->base[own + c]);
        sums[0][c] += (double)entries[k]->position * offset;
        sums[1][c] += (double)entries[k]->tangent1 * offset;
        sums[2][c] += (double)entries[k]->tangent2 * offset;
      }
  }
}

/* False where a vertex needs more than this. */
static bool by_smooth_mask(tw_surface_reader *r, const tw_values *values, uint32_t corner, float *out,
                           float *normal) {
  const tw_field *field = &r->surface->fields[values->field];
  const tw_topology *t = &field->base;
  uint32_t vertex = t->corner_vertex[corner], width = values->width;
  uint32_t valence = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex];
  if (t->face_size != 4 || field->linear || valence < 3 || valence > TW_SMOOTH_VALENCE_MAX ||
      !is_smooth(t, vertex))
    return false;
  const tw_limit_entry *mask = smooth_mask(r, t, corner, valence);
  double sums[3][4] = {{0}};
  if (values->exact)
    sum_fan(t, values, true, 3, vertex, mask, sums);
  else if (width == 3) /* most of all; known numbers let the compiler unroll */
    sum_fan(t, values, false, 3, vertex, mask, sums);
  else
    sum_fan(t, values, false, width, vertex, mask, sums);
  /* The base's own, which is not the cage's at level 0. */
  for (uint32_t c = 0; out && r->surface->options.limit && c < width; c++)
    out[c] = (float)(base_value(values, vertex, c) + sums[0][c]);
  if (!normal) return true;
  float tangent1[4], tangent2[4];
  for (int c = 0; c < 4; c++) {
    tangent1[c] = (float)sums[1][c];
    tangent2[c] = (float)sums[2][c];
  }
  const float *quad[4];
  for (uint32_t k = 0; k < 4; k++)
    quad[k] = values->base + (size_t)t->corner_vertex[(corner & ~3u) + k] * width;
  tw_normal_from_tangents(tangent1, tangent2, quad, normal);
  return true;
}

void tw_corner_by_mask(tw_surface_reader *reader, const tw_values *values, uint32_t corner, float *out,
                       float *normal) {
  const tw_surface *s = reader->surface;
  uint32_t vertex = s->fields[values->field].base.corner_vertex[corner], width = values->width;
  const float *at_level = s->options.level == 0 ? values->cage : values->base;
  if (out) memcpy(out, at_level + (size_t)vertex * width, width * sizeof *out);
  if (!normal && !s->options.limit) return;
  if (!by_smooth_mask(reader, values, corner, out, normal)) by_mask(reader, values, corner, out, normal);
}
