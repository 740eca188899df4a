/* Surfaces that keep all points of the level (shallow_levels.h): the plan from the base on, and rows. Rows
 * of points are computed in ranges, then the listed exceptions are recomputed. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sorted.h"
#include "surface_plan.h"
#include "surface_reader.h"

/* ---- values --------------------------------------------------------------------------------- */

/* The middle of the points along each axis on which they are farther from 0 than the extent of all; else
 * 0. */
static tw_point far_origin(const tw_point *points, uint32_t count) {
  tw_point low = points[0], high = points[0], origin = {0};
  float extent = 0;
  for (uint32_t v = 1; v < count; v++)
    for (int c = 0; c < 3; c++) {
      if (points[v][c] < low[c]) low[c] = points[v][c];
      if (points[v][c] > high[c]) high[c] = points[v][c];
    }
  for (int c = 0; c < 3; c++) extent = fmaxf(extent, high[c] - low[c]);
  for (int c = 0; c < 3; c++) {
    float middle = low[c] / 2 + high[c] / 2;
    if (fabsf(middle) > extent) origin[c] = middle;
  }
  return origin;
}

/* The base's values as vectors; NULL without memory. */
static tw_point *widen_base(const tw_shallow *levels, const tw_values *values) {
  uint32_t count = levels->at[0].vertex_count;
  tw_point *base = tw_alloc(count, sizeof *base);
  for (uint32_t v = 0; base && v < count; v++) {
    base[v] = (tw_point){0};
    memcpy(&base[v], values->base + (size_t)values->width * v, values->width * sizeof *values->base);
  }
  return base;
}

tw_status tw_shallow_fill(const tw_surface *surface, const tw_parallel_for *parallel, tw_values *values) {
  const tw_shallow *levels = &surface->levels[values->field];
  bool positions = values == &surface->positions, limit = surface->options.limit;
  /* Normals and tangents are computed from the points before their limits. */
  bool sloped = positions ? surface->options.normals : values->is_sloped;
  tw_point *base = widen_base(levels, values);
  values->refined = tw_alloc(tw_shallow_points(levels), sizeof *values->refined);
  values->points = limit ? tw_alloc(tw_shallow_points(levels), sizeof *values->points) : values->refined;
  tw_status status = base && values->refined && values->points ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK) {
    uint32_t count = levels->at[0].vertex_count;
    values->origin = positions ? far_origin(base, count) : (tw_point){0};
    for (uint32_t v = 0; v < count; v++) base[v] -= values->origin;
    status = tw_shallow_refine(levels, base, parallel, values->refined);
  }
  if (status == TW_OK && limit) tw_shallow_limit(levels, values->refined, parallel, values->points);
  tw_free(base);
  if (status != TW_OK || !limit || sloped) return status;
  tw_free(values->refined);
  values->refined = values->points;
  return TW_OK;
}

/* ---- the plan ------------------------------------------------------------------------------- */

/* Fills all values except positions. The values of the base are not needed any more then. */
static tw_status fill_all(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < b->mesh->uv_set_count && status == TW_OK; i++) {
    status = tw_shallow_fill(s, b->parallel, &s->uvs[i]);
    s->uvs[i].cage = s->uvs[i].base = NULL;
  }
  for (uint32_t i = 0; i < tw_smooth_set_count(s) && status == TW_OK; i++) {
    status = s->smooth[i].at_corners ? tw_nearest_fill(s, &s->smooth[i])
                                     : tw_shallow_fill(s, b->parallel, &s->smooth[i]);
    s->smooth[i].cage = s->smooth[i].base = NULL;
  }
  if (status == TW_OK && b->mesh->skin.joints)
    status =
        tw_skin_refine_levels(&s->levels[0], &s->influences, s->options.limit,
                              tw_mesh_influences(b->mesh, s->options.influences), b->parallel, &s->skin_rows);
  tw_influences_deinit(&s->influences);
  return status;
}

/* The bytes that exceptions may take. From about an eighth of the answer's faces on patches are faster, and
 * they take a fraction of the memory: measured on cages of triangles of which each edge is hard by chance.
 * Short lists are always worth it. */
static uint64_t exceptions_max(const tw_surface_builder *b) {
  enum { SHORT = 64 << 20, LONG = 1 << 30, OF_FACE = 36 };
  uint64_t of_answer = OF_FACE * b->surface->counts.faces;
  if (of_answer > LONG || b->attempt == TW_TRY_LARGE_LEVELS) return LONG;
  return of_answer > SHORT ? of_answer : SHORT;
}

tw_status tw_builder_levels(tw_surface_builder *b, bool *is_large) {
  tw_surface *s = b->surface;
  tw_shallow_inputs inputs = {.level = s->options.level - b->levels,
                              .field_count = s->field_count,
                              .rules = s->rules,
                              .limit = s->options.limit,
                              .normals = s->options.normals,
                              .parallel = b->parallel,
                              .grant = s->options.grant,
                              .exceptions_max = exceptions_max(b),
                              .is_large = is_large};
  for (uint32_t f = 0; f < s->field_count; f++) {
    inputs.fields[f] = &b->topologies[f];
    inputs.linear[f] = s->fields[f].linear;
  }
  s->levels = tw_arena_alloc(s->arena, s->field_count, sizeof *s->levels);
  tw_status status = s->levels ? tw_builder_find_frames(b) : TW_NO_MEMORY;
  inputs.frames = s->tangent_frames;
  if (status == TW_OK) status = tw_shallow_plan(&inputs, s->arena, s->levels, &s->level_rows);
  if (status == TW_OK) status = fill_all(b);
  if (status != TW_OK) return status;
  const tw_shallow_level *last = &s->levels[0].at[inputs.level];
  s->fields[0].base = (tw_topology){.vertex_count = last->vertex_count,
                                    .edge_count = last->edge_count,
                                    .face_count = last->face_count,
                                    .corner_count = last->corner_count,
                                    .face_size = 4};
  s->points = (tw_numbering){.corner_count = last->vertex_count};
  s->vertices = (tw_numbering){.corner_count = s->level_rows.row_count};
  if (b->mesh->uv_set_count > 0)
    s->uv_points = (tw_numbering){.corner_count = tw_shallow_points(&s->levels[1])};
  const tw_face_order order = {b->mesh, b->cage.visible, NULL, s->options.level};
  return tw_surface_order(s, &order);
}

/* ---- rows ----------------------------------------------------------------------------------- */

static void copy_positions(const tw_values *positions, uint32_t first, uint32_t count, uint32_t stride,
                           float *out) {
  for (uint32_t i = first; i < first + count; i++, out += stride)
    tw_store_point(positions->points[i] + positions->origin, out);
}

/* Writes what a row holds besides position, normal and tangent. own: the row's vertex in each field. */
static void level_attributes(const tw_surface *s, const uint32_t *own, float *out) {
  const tw_surface_layout *l = &s->layout;
  for (uint32_t i = 0; i < l->uv_count; i++)
    memcpy(out + l->uvs[i], &s->uvs[i].points[own[1 + i]], 2 * sizeof *out);
  for (uint32_t i = 0; i < tw_smooth_count(l); i++) {
    const tw_values *values = &s->smooth[i];
    memcpy(out + tw_smooth_column(l, i), &values->points[own[values->field]], values->width * sizeof *out);
  }
  size_t width = 2 * (size_t)l->influences; /* joints and weights */
  if (s->skin_rows) memcpy(out + l->joints, s->skin_rows + width * own[0], width * sizeof *out);
}

/* Writes the tangent of a row that has its normal, from the slopes of points and UVs. frame: the row's
 * tangent frame. */
static void level_tangent(const tw_surface *s, uint8_t frame, const tw_point points[2], const tw_point uvs[2],
                          float *out) {
  float slopes[2][TW_DERIVATIVE_WIDTH];
  memcpy(slopes[0], points, sizeof slopes[0]);
  memcpy(slopes[1], uvs, sizeof slopes[1]);
  tw_write_tangents(slopes[0], slopes[1], 1, false, frame % 2, tw_tangent_columns_of(s, out));
}

enum { AT_ONCE = 256 };

/* Writes the tangents of the rows of points [first, first + count). channels: for each channel, the vertices
 * of these rows. */
static void point_tangents(const tw_surface *s, uint32_t first, uint32_t count,
                           uint32_t (*const channels)[AT_ONCE], float *out) {
  uint32_t faces[AT_ONCE];
  tw_point slopes[AT_ONCE][2], uv_slopes[2];
  tw_shallow_cage_faces(&s->levels[0], first, count, faces);
  tw_shallow_slopes(&s->levels[0], s->positions.refined, first, count, slopes[0]);
  for (uint32_t i = 0; i < count; i++, out += s->layout.stride) {
    uint8_t frame = s->tangent_frames[faces[i]];
    const tw_values *set = &s->uvs[frame / 2];
    tw_shallow_slopes(&s->levels[set->field], set->refined, channels[frame / 2][i], 1, uv_slopes);
    level_tangent(s, frame, slopes[i], uv_slopes, out);
  }
}

/* The number of channels that rows are read from. */
static uint32_t channels_read(const tw_surface *s) {
  return s->layout.uv_count + s->layout.attribute_count > 0 ? s->field_count - 1 : 0;
}

/* Writes the attributes of the rows of points [first, first + count). */
static void point_attributes(const tw_surface *s, uint32_t first, uint32_t count, float *out) {
  uint32_t vertices[TW_CHANNELS_MAX][AT_ONCE], own[TW_FIELDS_MAX], channels = channels_read(s);
  for (uint32_t taken; count > 0; first += taken, count -= taken) {
    taken = count < AT_ONCE ? count : AT_ONCE;
    for (uint32_t i = 0; i < channels; i++)
      tw_shallow_channel_vertices(&s->levels[0], &s->levels[1 + i], first, taken, vertices[i]);
    if (s->tangent_frames) point_tangents(s, first, taken, vertices, out);
    for (uint32_t k = 0; k < taken; k++, out += s->layout.stride) {
      own[0] = first + k;
      for (uint32_t i = 0; i < channels; i++) own[1 + i] = vertices[i][k];
      level_attributes(s, own, out);
    }
  }
}

/* Recomputes those of the rows [first, first + count) that are listed exceptions. */
static void listed_rows(const tw_surface *s, uint32_t first, uint32_t count, float *out) {
  const tw_shallow_rows *rows = &s->level_rows;
  uint32_t own[TW_FIELDS_MAX], channels = channels_read(s),
                               n = tw_lower_bound(rows->rows, rows->count, first);
  for (; n < rows->count && rows->rows[n] - first < count; n++) {
    float *row = out + (size_t)(rows->rows[n] - first) * s->layout.stride;
    copy_positions(&s->positions, rows->points[n], 1, 3, row);
    if (s->layout.normal != UINT32_MAX)
      tw_shallow_row_normal(rows, n, s->positions.refined, row + s->layout.normal);
    own[0] = rows->points[n];
    for (uint32_t i = 0; i < channels; i++) own[1 + i] = rows->channels[i][n];
    level_attributes(s, own, row);
    if (!s->tangent_frames) continue;
    tw_point points[2], uvs[2];
    tw_shallow_row_slopes(rows, n, s->positions.refined, s->uvs[rows->frames[n] / 2].refined, points, uvs);
    level_tangent(s, rows->frames[n], points, uvs, row);
  }
}

void tw_shallow_read_rows(const tw_surface *surface, tw_domain domain, uint32_t first, uint32_t count,
                          float *out) {
  const tw_surface *s = surface;
  const tw_values *positions = &s->positions;
  uint32_t points = s->points.corner_count, stride = s->layout.stride;
  if (domain == TW_DOMAIN_UVS) {
    for (uint32_t i = 0; i < count; i++)
      memcpy(out + 2 * (size_t)i, &s->uvs[0].points[first + i], 2 * sizeof *out);
    return;
  }
  if (domain == TW_DOMAIN_POINTS) {
    copy_positions(positions, first, count, 3, out);
    return;
  }
  uint32_t own = first < points ? points - first < count ? points - first : count : 0;
  const tw_shallow_positions made = {positions->refined, positions->points, positions->origin};
  if (tw_has_normals(s, domain))
    tw_shallow_normals(&s->levels[0], &made, first, own, stride, out);
  else
    copy_positions(positions, first, own, stride, out);
  if (tw_has_attributes(s, domain)) point_attributes(s, first, own, out);
  listed_rows(s, first, count, out);
}
