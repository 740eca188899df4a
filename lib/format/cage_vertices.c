/* Reads a cage's vertices as gltf/read_meshes.cpp does in a file without tags: edges along the same places
 * join vertices into points, and along equal values into values. Where these are others than the mesh's, an
 * upload of the file is another cage. */
#include "cage_vertices.h"

#include <string.h>

#include "triangulator.h"
#include "weld.h"

#define NONE UINT32_MAX

/* ---- vertices -------------------------------------------------------------------------------- */

static bool allocate(tw_cage_vertices *v) {
  v->reader = tw_surface_reader_create(v->surface);
  v->corner = tw_alloc(v->count, sizeof *v->corner);
  v->point = tw_alloc(v->count, sizeof *v->point);
  v->offsets = tw_alloc((size_t)v->face_count + 1, sizeof *v->offsets);
  v->corners = tw_alloc(v->corner_count, sizeof *v->corners);
  v->rows = tw_alloc(tw_surface_get_layout(v->surface)->stride, 2 * sizeof *v->rows);
  v->first = tw_alloc(v->mesh->point_count, sizeof *v->first);
  v->is_split = tw_alloc_zero(v->mesh->point_count, sizeof *v->is_split);
  return v->reader && v->corner && v->point && v->offsets && v->corners && v->rows && v->first && v->is_split;
}

tw_status tw_cage_vertices_init(tw_cage_vertices *out, const tw_surface *surface, const tw_mesh *mesh) {
  uint64_t faces = tw_surface_get_counts(surface)->faces;
  tw_cage_vertices *v = out;
  *v = (tw_cage_vertices){.surface = surface,
                          .mesh = mesh,
                          .count = (uint32_t)tw_surface_row_count(surface, TW_DOMAIN_VERTICES),
                          .face_count = (uint32_t)faces,
                          .corner_count = (uint32_t)tw_surface_corners_before(surface, faces)};
  if (!allocate(v)) return TW_NO_MEMORY;
  tw_surface_reader_turn(v->reader, surface, 0, 0);
  tw_surface_read_faces(v->reader, TW_DOMAIN_VERTICES, 0, (size_t)faces, NULL, v->corners);
  for (uint32_t f = 0; f <= v->face_count; f++)
    v->offsets[f] = (uint32_t)tw_surface_corners_before(surface, f);
  for (uint32_t f = 0; f < v->face_count; f++)
    for (uint32_t c = v->offsets[f]; c < v->offsets[f + 1]; c++)
      v->corner[v->corners[c]] = tw_surface_cage_corner(surface, f) + (c - v->offsets[f]);
  for (uint32_t p = 0; p < mesh->point_count; p++) v->first[p] = NONE;
  for (uint32_t i = v->count; i-- > 0;) {
    uint32_t p = v->point[i] = mesh->corners[v->corner[i]];
    v->is_split[p] = v->first[p] != NONE;
    v->first[p] = i;
  }
  return TW_OK;
}

void tw_cage_vertices_deinit(tw_cage_vertices *v) {
  tw_surface_reader_destroy(v->reader);
  tw_free(v->corner);
  tw_free(v->point);
  tw_free(v->offsets);
  tw_free(v->corners);
  tw_free(v->materials);
  tw_free(v->rows);
  tw_free(v->first);
  tw_free(v->is_split);
}

/* ---- faces as they are drawn ------------------------------------------------------------------ */

/* Where the fan that begins at `start` ends, as FB_ngon_encoding has polygons. */
static uint32_t fan_end(const uint32_t *corners, uint32_t start, uint32_t stop) {
  uint32_t end = start + 3;
  while (end < stop && corners[end] == corners[start] && corners[end + 1] == corners[end - 1]) end += 3;
  return end;
}

/* Appends the faces that a reader makes of the triangles of a material, which are kept where corners end:
 * faces have no more corners than their triangles. */
static void append_faces(tw_cage_vertices *v, uint32_t triangles, tw_polygons polygons, int32_t material) {
  uint32_t *c = v->corners, stop = v->corner_count + 3 * triangles, to = v->corner_count;
  for (uint32_t start = to, end; start < stop; start = end) {
    end = start + 3;
    if (polygons == TW_POLYGONS_NGON)
      end = fan_end(c, start, stop);
    else if (c[start] == c[start + 1] || c[start + 1] == c[start + 2] || c[start + 2] == c[start])
      continue; /* readers leave it out */
    uint32_t size = 2 + (end - start) / 3;
    for (uint32_t k = 0; k < size; k++) c[to + k] = c[k < 3 ? start + k : start + 3 * (k - 2) + 2];
    to += size;
    v->materials[v->face_count++] = material;
    v->offsets[v->face_count] = to;
  }
  v->corner_count = to;
}

/* Replaces the faces by those that are drawn. */
static tw_status draw(tw_cage_vertices *v, tw_polygons polygons) {
  uint32_t triangles = v->corner_count - 2 * v->face_count;
  tw_triangulator cutter;
  tw_free(v->offsets);
  tw_free(v->corners);
  v->offsets = tw_alloc((size_t)triangles + 1, sizeof *v->offsets);
  v->corners = tw_alloc(triangles, 3 * sizeof *v->corners);
  v->materials = tw_alloc(triangles, sizeof *v->materials);
  bool has_memory = tw_triangulator_init(&cutter, &v->surface, 1, polygons, v->reader) && v->offsets &&
                    v->corners && v->materials;
  v->face_count = v->corner_count = 0;
  if (has_memory) v->offsets[0] = 0;
  for (uint32_t i = 0; has_memory && i < tw_surface_group_count(v->surface);) {
    const tw_surface_group faces = tw_take_material(v->surface, &i);
    uint32_t count = (uint32_t)tw_count_triangles(&faces);
    tw_triangulator_read(&cutter, v->surface, &faces, 0, count, v->corners + v->corner_count);
    append_faces(v, count, polygons, faces.material);
  }
  tw_triangulator_deinit(&cutter);
  return has_memory ? TW_OK : TW_NO_MEMORY;
}

static tw_soup soup_of(const tw_cage_vertices *v) {
  return (tw_soup){.vertex_count = v->count,
                   .face_count = v->face_count,
                   .corner_count = v->corner_count,
                   .face_offsets = v->offsets,
                   .corners = v->corners,
                   .face_materials = v->materials};
}

/* ---- what is read ---------------------------------------------------------------------------- */

/* Adds to *joins and *parts whether things that had different numbers have one, and the other way round. was,
 * is: [count], below was_count and count. TW_NO_MEMORY. */
static tw_status compare_numbers(const uint32_t *was, uint32_t was_count, const uint32_t *is, uint32_t count,
                                 bool *joins, bool *parts) {
  uint32_t *first_was = tw_alloc(count, sizeof *first_was), *first_is = tw_alloc(was_count, sizeof *first_is);
  bool has_memory = first_was && first_is;
  for (uint32_t i = 0; has_memory && i < count; i++) first_was[i] = NONE;
  for (uint32_t i = 0; has_memory && i < was_count; i++) first_is[i] = NONE;
  for (uint32_t i = 0; has_memory && i < count; i++) {
    uint32_t *a = &first_was[is[i]], *b = &first_is[was[i]];
    if (*a == NONE) *a = was[i];
    if (*b == NONE) *b = is[i];
    *joins |= *a != was[i];
    *parts |= *b != is[i];
  }
  tw_free(first_was);
  tw_free(first_is);
  return has_memory ? TW_OK : TW_NO_MEMORY;
}

/* ---- values ---------------------------------------------------------------------------------- */

/* A vertex, with the value that a channel has there. */
typedef struct valued_vertex {
  uint32_t point, value, vertex;
} valued_vertex;

static int compare_valued(const void *left, const void *right) {
  const valued_vertex *a = left, *b = right;
  if (a->point != b->point) return a->point < b->point ? -1 : 1;
  if (a->value != b->value) return a->value < b->value ? -1 : 1;
  return a->vertex < b->vertex ? -1 : a->vertex > b->vertex;
}

/* Numbers the values of the vertices: one for each different value at each point, in the order of their first
 * vertices. Only the vertices of points with several are sorted. */
static tw_status number_values(const tw_cage_vertices *v, const tw_channel *channel, uint32_t *number) {
  uint32_t several = 0, numbers = 0;
  for (uint32_t i = 0; i < v->count; i++) several += v->is_split[v->point[i]];
  valued_vertex *valued = tw_alloc(several, sizeof *valued);
  if (!valued) return TW_NO_MEMORY;
  for (uint32_t i = 0, k = 0; i < v->count; i++) {
    number[i] = i;
    if (v->is_split[v->point[i]])
      valued[k++] = (valued_vertex){v->point[i], channel->corners[v->corner[i]], i};
  }
  tw_status status = tw_sort(valued, several, sizeof *valued, compare_valued);
  for (uint32_t k = 0, first = 0; k < several && status == TW_OK; k++) {
    const valued_vertex *own = &valued[k];
    if (k == 0 || own->point != own[-1].point || own->value != own[-1].value) first = own->vertex;
    number[own->vertex] = first;
  }
  for (uint32_t i = 0; i < v->count && status == TW_OK; i++)
    number[i] = number[i] == i ? numbers++ : number[number[i]];
  tw_free(valued);
  return status;
}

/* The values of the vertices as they are read back. attribute: NULL of a UV set. rows: [count][width]. */
static void read_values(const tw_cage_vertices *v, const tw_channel *channel, const tw_attribute *attribute,
                        float *rows) {
  uint32_t width = channel->width;
  for (uint32_t i = 0; i < v->count; i++)
    memcpy(rows + (size_t)width * i, channel->values + (size_t)width * channel->corners[v->corner[i]],
           width * sizeof *rows);
  if (attribute && attribute->is_color) tw_finish_colors(rows, v->count, width);
  if (attribute) return;
  tw_turn_v(rows, v->count, width);
  tw_turn_v(rows, v->count, width); /* as a reader does: 1 - (1 - v) is v but for rounding */
}

/* read: [count] receives the number of the value that a reader finds at each vertex. */
static tw_status weld_values(const tw_cage_vertices *v, const float *rows, uint32_t width, bool is_map,
                             uint32_t *read) {
  const tw_soup soup = soup_of(v);
  uint32_t ignored;
  /* An attribute whose values are equal at each point becomes one of points. */
  if (is_map || tw_values_part(v->point, v->count, v->first, rows, width))
    return tw_weld_values(&soup, v->point, v->mesh->point_count, rows, width, read, &ignored, NULL);
  for (uint32_t i = 0; i < v->count; i++) read[i] = v->first[v->point[i]];
  return TW_OK;
}

tw_status tw_cage_vertices_number(const tw_cage_vertices *vertices, uint32_t channel, uint32_t *number,
                                  tw_cage_changes *changes) {
  const tw_cage_vertices *v = vertices;
  const tw_attribute *attribute = tw_channel_attribute(v->mesh, channel);
  tw_channel channels[TW_CHANNELS_MAX];
  tw_mesh_channels(v->mesh, channels);
  const tw_channel *own = &channels[channel];
  uint32_t *read = tw_alloc(v->count, sizeof *read);
  float *rows = tw_alloc(v->count, own->width * sizeof *rows);
  tw_status status = read && rows ? number_values(v, own, number) : TW_NO_MEMORY;
  if (status == TW_OK) {
    read_values(v, own, attribute, rows);
    status = weld_values(v, rows, own->width, !attribute, read);
  }
  if (status == TW_OK)
    status =
        compare_numbers(number, v->count, read, v->count, &changes->joins_values, &changes->parts_values);
  tw_free(read);
  tw_free(rows);
  return status;
}

static tw_status find_values(const tw_cage_vertices *v, tw_cage_changes *changes) {
  tw_channel channels[TW_CHANNELS_MAX];
  uint32_t count = tw_mesh_channels(v->mesh, channels), *number = tw_alloc(v->count, sizeof *number);
  tw_status status = number ? TW_OK : TW_NO_MEMORY;
  for (uint32_t i = 0; i < count && status == TW_OK; i++)
    status = tw_cage_vertices_number(v, i, number, changes);
  tw_free(number);
  return status;
}

/* ---- points ---------------------------------------------------------------------------------- */

/* Orders vertices by what moves them: joints and weights as rows have them, and displacements. */
static int compare_motion(const void *context, uint32_t a, uint32_t b) {
  const tw_cage_vertices *v = context;
  const tw_surface_layout *layout = tw_surface_reader_layout(v->reader);
  uint32_t p = v->point[a], q = v->point[b], width = layout->influences;
  if (p == q) return 0;
  int order = 0;
  if (width > 0) {
    float *own = v->rows, *other = v->rows + layout->stride;
    tw_surface_read_rows(v->reader, TW_DOMAIN_VERTICES, a, 1, own);
    tw_surface_read_rows(v->reader, TW_DOMAIN_VERTICES, b, 1, other);
    order = tw_compare_floats(own + layout->joints, other + layout->joints, 2 * (size_t)width);
  }
  for (uint32_t t = 0; t < v->mesh->morph_count && order == 0; t++)
    order = tw_compare_floats(v->mesh->morphs[t] + 3 * (size_t)p, v->mesh->morphs[t] + 3 * (size_t)q, 3);
  return order;
}

/* positions: [count][3]. */
static tw_status find_points(tw_cage_vertices *v, const float *positions, tw_cage_changes *changes) {
  uint32_t *read = tw_alloc(v->count, sizeof *read);
  uint8_t *left_out = tw_alloc(v->face_count, 1);
  tw_welded welded;
  tw_soup soup = soup_of(v);
  soup.positions = positions;
  soup.compare = compare_motion;
  soup.context = v;
  tw_status status = read && left_out ? tw_weld_points(&soup, read, left_out, &welded, NULL) : TW_NO_MEMORY;
  if (status == TW_OK)
    status = compare_numbers(v->point, v->mesh->point_count, read, v->count, &changes->joins_points,
                             &changes->parts_points);
  tw_free(read);
  tw_free(left_out);
  return status;
}

static tw_status find_changes(tw_cage_vertices *v, tw_polygons polygons, tw_cage_changes *out) {
  /* Where no point is split, none has several values; where its place is its own, it stays. */
  bool has_split = v->count > tw_surface_row_count(v->surface, TW_DOMAIN_POINTS), has_shared = has_split;
  float *positions = tw_alloc(v->count, 3 * sizeof *positions);
  tw_status status = positions ? TW_OK : TW_NO_MEMORY;
  for (uint32_t i = 0; i < v->count && status == TW_OK; i++)
    memcpy(positions + 3 * (size_t)i, v->mesh->positions + 3 * (size_t)v->point[i], 3 * sizeof *positions);
  tw_soup whole = soup_of(v);
  whole.positions = positions;
  if (status == TW_OK && !has_split) status = tw_share_places(&whole, &has_shared);
  if (status == TW_OK && has_shared) status = draw(v, polygons);
  if (status == TW_OK && has_shared) status = find_points(v, positions, out);
  if (status == TW_OK && has_split) status = find_values(v, out);
  tw_free(positions);
  return status;
}

tw_status tw_find_cage_changes(const tw_surface *surface, const tw_mesh *mesh, tw_polygons polygons,
                               tw_cage_changes *out) {
  tw_cage_vertices v;
  *out = (tw_cage_changes){0};
  tw_status status = tw_cage_vertices_init(&v, surface, mesh);
  if (status == TW_OK) status = find_changes(&v, polygons, out);
  tw_cage_vertices_deinit(&v);
  return status;
}
