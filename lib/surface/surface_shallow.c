/* Surfaces that keep all points of the level (shallow_levels.h): the plan from the base on, rows and faces.
 * The columns of a block are computed for all of its rows, then again for the listed exceptions.
 * fields[0].base has the level's counts only. */
#include <math.h>
#include <string.h>

#include "sorted.h"
#include "surface_plan.h"
#include "surface_reader.h"

/* ---- values ---------------------------------------------------------------------------------- */

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

/* Computes the values of all points of the last level from the base's values. */
static tw_status fill(const tw_surface *surface, const tw_parallel_for *parallel, tw_values *values) {
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

/* ---- what is worth it ------------------------------------------------------------------------ */

enum { LEVELS_BYTES_MAX = 128 << 20 };

/* Whether nearly all vertices of a level of quads have valence 4. Then patches are faster from three levels
 * below it on. The irregular vertices of a level come from vertices and faces of the cage. */
static bool is_regular(const tw_cage *cage, uint32_t level) {
  const tw_topology *t = &cage->topology;
  if (level == 0 && t->face_size != 4) return false;
  uint64_t vertices = tw_cage_counts_at(cage, false, level).vertices, irregular = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++) irregular += t->fan_offsets[v + 1] - t->fan_offsets[v] != 4;
  for (uint32_t f = 0; f < t->face_count; f++) irregular += tw_face_size(t, f) != 4;
  return vertices - irregular > vertices / 8 * 7;
}

/* All points of the level fit in memory, and rows can be read from them.
 * Cages with faces that are left out use patches. */
static bool fits(const tw_surface_builder *b) {
  const tw_mesh *m = b->mesh;
  const tw_surface *s = b->surface;
  const tw_surface_options *options = &s->options;
  const tw_topology *cage = &b->cage.topology;
  uint32_t base = tw_deepest_detail(&s->details);
  if (options->scheme != TW_CATMULL_CLARK || options->level <= base || options->level > base + TW_SHALLOW_MAX)
    return false;
  if (m->face_count == 0) return false;
  if (s->rules.smooth_triangles && base == 0 && cage->face_size != 4) return false;
  if (memchr(b->cage.visible, 0, cage->face_count) || tw_cage_shrinks(&b->cage, options)) return false;
  if (m->skin.joints && !tw_skin_fits_levels(m)) return false;
  uint32_t influences = tw_surface_influences(m, options->influences);
  uint32_t uv_copies = options->limit && tw_builder_has_tangents(b) ? 2 : 1;
  uint64_t sets = (options->limit && options->normals ? 2u : 1u) + uv_copies * m->uv_set_count +
                  influences / 2 /* joints and weights, four to a point */ + tw_smooth_set_count(s) +
                  (b->morph_normals ? (options->limit ? 2u : 1u) * m->morph_count : 0u);
  if (s->counts.vertices * sets * sizeof(tw_point) > LEVELS_BYTES_MAX || !tw_shallow_fit(cage)) return false;
  return options->level < base + 3 || !is_regular(&b->cage, base);
}

static tw_status start(tw_surface_builder *b, tw_error *error) {
  (void)error;
  b->levels = tw_deepest_detail(&b->surface->details);
  return TW_OK;
}

/* ---- the plan -------------------------------------------------------------------------------- */

/* Fills all values except positions. The values of the base are not needed any more then. */
static tw_status fill_all(tw_surface_builder *b) {
  tw_surface *s = b->surface;
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < b->mesh->uv_set_count && status == TW_OK; i++) {
    status = fill(s, b->parallel, &s->uvs[i]);
    s->uvs[i].cage = s->uvs[i].base = NULL;
  }
  for (uint32_t i = 0; i < tw_smooth_set_count(s) && status == TW_OK; i++) {
    status =
        s->smooth[i].at_corners ? tw_nearest_fill(s, &s->smooth[i]) : fill(s, b->parallel, &s->smooth[i]);
    s->smooth[i].cage = s->smooth[i].base = NULL;
  }
  if (status == TW_OK && b->mesh->skin.joints)
    status = tw_skin_refine_levels(&s->levels[0], &s->influences, s->options.limit,
                                   tw_surface_influences(b->mesh, s->options.influences), b->parallel,
                                   &s->skin_rows);
  tw_influences_deinit(&s->influences);
  return status;
}

/* The bytes that exceptions may take. From about an eighth of the answer's faces on patches are faster, and
 * they take a fraction of the memory: measured on cages of triangles of which each edge is hard by chance.
 * Short lists are always worth it. */
static uint64_t exceptions_max(const tw_surface_builder *b) {
  enum { SHORT = 64 << 20, LONG = 1 << 30, OF_FACE = 36 };
  uint64_t of_answer = OF_FACE * b->surface->counts.faces;
  if (of_answer > LONG || b->long_lists) return LONG;
  return of_answer > SHORT ? of_answer : SHORT;
}

/* *is_large: exceptions take more than they may. */
static tw_status plan(tw_surface_builder *b, bool *is_large) {
  tw_surface *s = b->surface;
  tw_shallow_inputs inputs = {.level = s->options.level - b->levels,
                              .field_count = s->field_count,
                              .rules = s->rules,
                              .limit = s->options.limit,
                              .normals = s->options.normals,
                              .parallel = b->parallel,
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
  const tw_face_order order = {b->mesh, b->cage.visible, NULL, s->options.level, NULL};
  return tw_surface_order(s, &order);
}

static tw_status make(tw_surface_builder *b, tw_error *error) {
  tw_status status = plan(b, &b->declined);
  return status == TW_LIMIT && !b->declined ? tw_builder_fail_fans(error) : status;
}

static tw_status place(tw_surface *s, double **base, const tw_parallel_for *parallel) {
  s->positions.base = tw_surface_round_positions(*base, s->levels[0].at[0].vertex_count);
  tw_status status = s->positions.base ? fill(s, parallel, &s->positions) : TW_NO_MEMORY;
  tw_free(s->positions.base);
  s->positions.base = NULL;
  return status;
}

/* ---- columns --------------------------------------------------------------------------------- */

static void copy_positions(const tw_values *positions, uint32_t first, uint32_t count, uint32_t stride,
                           float *out) {
  for (uint32_t i = first; i < first + count; i++, out += stride)
    tw_store_point(positions->points[i] + positions->origin, out);
}

/* The rows of a block that are rows of points of the same number; further rows are listed. */
static uint32_t rows_of_points(const tw_surface *s, const tw_block *block) {
  uint32_t points = s->points.corner_count;
  if (block->first >= points) return 0;
  return points - block->first < block->count ? points - block->first : block->count;
}

static void points(tw_surface_reader *r, const tw_block *block, float *out, float *normals, uint32_t stride) {
  const tw_surface *s = r->surface;
  const tw_values *positions = &s->positions;
  uint32_t own = rows_of_points(s, block);
  const tw_shallow_positions made = {positions->refined, positions->points, positions->origin};
  if (normals) /* they follow the position */
    tw_shallow_normals(&s->levels[0], &made, block->first, own, stride, out);
  else
    copy_positions(positions, block->first, own, stride, out);
  for (uint32_t n = block->listed; n < block->listed_end; n++) {
    size_t place = (size_t)(s->level_rows.rows[n] - block->first) * stride;
    copy_positions(positions, s->level_rows.points[n], 1, stride, out + place);
    if (normals) tw_shallow_row_normal(&s->level_rows, n, positions->refined, normals + place);
  }
}

static void values(tw_surface_reader *r, const tw_values *values, const tw_block *block, float *out,
                   uint32_t stride) {
  (void)r;
  const uint32_t *vertices = block->vertices[values->field];
  const tw_point *at = values->points;
  size_t size = values->width * sizeof *out;
  if (values->width == 2)
    for (uint32_t k = 0; k < block->count; k++, out += stride) memcpy(out, &at[vertices[k]], 2 * sizeof *out);
  else
    for (uint32_t k = 0; k < block->count; k++, out += stride) memcpy(out, &at[vertices[k]], size);
}

static void put_slopes(tw_surface_reader *r, uint32_t k, uint8_t frame, const tw_point points[2],
                       const tw_point uvs[2]) {
  memcpy(r->slopes[0] + TW_DERIVATIVE_WIDTH * (size_t)k, points, 2 * sizeof *points);
  memcpy(r->slopes[1] + TW_DERIVATIVE_WIDTH * (size_t)k, uvs, 2 * sizeof *uvs);
  r->frames[k] = frame;
}

static void slopes(tw_surface_reader *r, const tw_block *block) {
  const tw_surface *s = r->surface;
  const tw_shallow_rows *rows = &s->level_rows;
  uint32_t faces[TW_BLOCK_ROWS], own = rows_of_points(s, block);
  tw_point points[TW_BLOCK_ROWS][2], uvs[2];
  tw_shallow_cage_faces(&s->levels[0], block->first, own, faces);
  tw_shallow_slopes(&s->levels[0], s->positions.refined, block->first, own, points[0]);
  for (uint32_t k = 0; k < own; k++) {
    uint8_t frame = s->tangent_frames[faces[k]];
    const tw_values *set = &s->uvs[frame / 2];
    tw_shallow_slopes(&s->levels[set->field], set->refined, block->vertices[set->field][k], 1, uvs);
    put_slopes(r, k, frame, points[k], uvs);
  }
  for (uint32_t n = block->listed; n < block->listed_end; n++) {
    const tw_values *set = &s->uvs[rows->frames[n] / 2];
    tw_shallow_row_slopes(rows, n, s->positions.refined, set->refined, points[0], uvs);
    put_slopes(r, rows->rows[n] - block->first, rows->frames[n], points[0], uvs);
  }
}

static void influences(tw_surface_reader *r, const tw_block *block, float *row) {
  const tw_surface_layout *l = &r->surface->layout;
  size_t width = 2 * (size_t)l->influences; /* joints and weights */
  for (uint32_t k = 0; k < block->count; k++, row += l->stride)
    memcpy(row + l->joints, r->surface->skin_rows + width * block->vertices[0][k], width * sizeof *row);
}

/* ---- rows and faces -------------------------------------------------------------------------- */

/* Finds the vertices of a block's rows in each field that they have columns of, and the listed rows. */
static void find_vertices(const tw_surface *s, tw_domain domain, tw_block *block) {
  const tw_shallow_rows *rows = &s->level_rows;
  uint32_t first = block->first, field = domain == TW_DOMAIN_UVS ? 1 : 0;
  if (domain == TW_DOMAIN_POINTS) return;
  if (domain == TW_DOMAIN_UVS || tw_has_attributes(s, domain))
    for (uint32_t k = 0; k < block->count; k++) block->vertices[field][k] = first + k;
  if (domain != TW_DOMAIN_VERTICES) return;
  bool has_channels = s->layout.uv_count + s->layout.attribute_count > 0;
  uint32_t channels = has_channels ? s->field_count - 1 : 0, own = rows_of_points(s, block);
  for (uint32_t i = 0; i < channels; i++)
    tw_shallow_channel_vertices(&s->levels[0], &s->levels[1 + i], first, own, block->vertices[1 + i]);
  uint32_t n = block->listed = tw_lower_bound(rows->rows, rows->count, first);
  for (; n < rows->count && rows->rows[n] - first < block->count; n++) {
    uint32_t k = rows->rows[n] - first;
    block->vertices[0][k] = rows->points[n];
    for (uint32_t i = 0; i < channels; i++) block->vertices[1 + i][k] = rows->channels[i][n];
  }
  block->listed_end = n;
}

static void read(tw_surface_reader *r, tw_domain domain, const tw_piece *piece, float *out) {
  uint32_t vertices[TW_FIELDS_MAX][TW_BLOCK_ROWS], width = tw_row_width(r->surface, domain);
  for (uint32_t taken, done = 0; done < piece->items; done += taken) {
    taken = piece->items - done < TW_BLOCK_ROWS ? piece->items - done : TW_BLOCK_ROWS;
    tw_block block = {.first = piece->item + done, .count = taken, .vertices = vertices};
    find_vertices(r->surface, domain, &block);
    tw_assemble_rows(r, domain, &block, out + (size_t)done * width);
  }
}

/* Reads faces [first, first + count) of a level that is kept whole, in the level's own order. */
static void read_run(const tw_surface *s, tw_domain domain, uint32_t first, uint32_t count, uint32_t *out) {
  tw_shallow_faces(&s->levels[domain == TW_DOMAIN_UVS ? 1 : 0], first, count, out);
  const tw_shallow_rows *rows = &s->level_rows;
  if (domain != TW_DOMAIN_VERTICES) return;
  uint32_t i = tw_lower_bound(rows->corners, rows->corner_count, 4 * first);
  for (; i < rows->corner_count && rows->corners[i] - 4 * first < 4 * count; i++)
    out[rows->corners[i] - 4 * first] = rows->corner_rows[i];
}

/* The children of each corner of the cage are contiguous; the cage's faces are in the order of the groups. */
static void faces(const tw_surface *s, tw_domain domain, uint64_t first, size_t count, uint32_t *out) {
  uint32_t shift = 2 * (s->options.level - 1);
  if (!s->face_first) {
    read_run(s, domain, (uint32_t)first, (uint32_t)count, out);
    return;
  }
  uint32_t place = tw_surface_cage_place(s, first, shift);
  for (uint64_t face = first, last = first + count; face < last; place++) {
    uint64_t begin = s->corners_before[place] << shift, stop = s->corners_before[place + 1] << shift;
    if (stop > last) stop = last;
    uint32_t taken = (uint32_t)(stop - face);
    read_run(s, domain, (s->face_first[place] << shift) + (uint32_t)(face - begin), taken, out);
    out += 4 * (size_t)taken;
    face = stop;
  }
}

const tw_evaluator tw_shallow_evaluator = {.fits = fits,
                                           .start = start,
                                           .make = make,
                                           .place = place,
                                           .read = read,
                                           .points = points,
                                           .values = values,
                                           .slopes = slopes,
                                           .influences = influences,
                                           .faces = faces};
