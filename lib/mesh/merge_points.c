/* Merges points of a mesh within the mesh's own arrays: the result is never larger, but for attributes that
 * differ at points which become one. A reader has just filled
 * the arrays and nothing else refers to them, so casting away their const and overwriting them is safe. */
#include "merge_points.h"

#include <stdlib.h>
#include <string.h>

#include "weld.h"

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "out of memory");
}

/* ---- attributes ------------------------------------------------------------------------------ */

/* Gives an attribute of points values of corners. number: [point_count] scratch; others as in
 * tw_mesh_part_attributes. */
static tw_status part_attribute(const tw_mesh *mesh, const uint32_t *point_of, uint32_t count,
                                tw_arena *arena, uint32_t *number, tw_attribute *attribute, tw_error *error) {
  const tw_soup soup = {.vertex_count = mesh->point_count,
                        .positions = mesh->positions,
                        .face_count = mesh->face_count,
                        .corner_count = mesh->corner_count,
                        .face_offsets = mesh->face_offsets,
                        .corners = mesh->corners};
  uint32_t values_made, width = attribute->width;
  tw_status status =
      tw_weld_values(&soup, point_of, count, attribute->values, width, number, &values_made, error);
  if (status != TW_OK) return status;
  float *values = tw_arena_alloc_raw(arena, values_made, width * sizeof *values);
  uint32_t *corners = tw_arena_alloc_raw(arena, mesh->corner_count, sizeof *corners);
  if (!values || !corners) return no_memory(error);
  for (uint32_t p = mesh->point_count; p-- > 0;)
    memcpy(values + width * (size_t)number[p], attribute->values + width * (size_t)p, width * sizeof *values);
  for (uint32_t c = 0; c < mesh->corner_count; c++) corners[c] = number[mesh->corners[c]];
  attribute->values = values;
  attribute->value_count = values_made;
  attribute->corners = corners;
  return TW_OK;
}

/* first, number: [point_count] scratch. */
static tw_status part_all(tw_mesh *mesh, const uint32_t *point_of, uint32_t count, tw_arena *arena,
                          uint32_t *first, uint32_t *number, bool *parted, tw_error *error) {
  tw_attribute *attributes = tw_arena_alloc(arena, mesh->attribute_count, sizeof *attributes);
  if (!attributes) return no_memory(error);
  for (uint32_t p = mesh->point_count; p-- > 0;) first[point_of[p]] = p;
  for (uint32_t i = 0; i < mesh->attribute_count; i++) {
    tw_attribute *own = &attributes[i];
    *own = mesh->attributes[i];
    parted[i] = !own->corners && tw_values_part(point_of, mesh->point_count, first, own->values, own->width);
    tw_status status = parted[i] ? part_attribute(mesh, point_of, count, arena, number, own, error) : TW_OK;
    if (status != TW_OK) return status;
  }
  mesh->attributes = attributes;
  return TW_OK;
}

tw_status tw_mesh_part_attributes(tw_mesh *mesh, const uint32_t *point_of, uint32_t count, tw_arena *arena,
                                  bool *parted, tw_error *error) {
  if (mesh->attribute_count == 0) return TW_OK;
  uint32_t *first = tw_alloc(mesh->point_count, sizeof *first),
           *number = tw_alloc(mesh->point_count, sizeof *number);
  tw_status status = first && number ? part_all(mesh, point_of, count, arena, first, number, parted, error)
                                     : no_memory(error);
  tw_free(first);
  tw_free(number);
  return status;
}

/* ---- a merge --------------------------------------------------------------------------------- */

/* A merge under way. */
typedef struct merger {
  tw_mesh *mesh;
  const uint32_t *point_of; /* [point_count before] new index of each point */
  uint32_t point_count;     /* after the merge */
  const uint8_t *left_out;  /* [face_count before] faces to drop; NULL: none */
  uint32_t *seen;       /* [point_count after] 1 + the last face that has or had the point; 0: none, but for
                           triangles that stay whole */
  uint32_t *face_of;    /* [face_count before] new index of each face, UINT32_MAX when it is dropped */
  uint32_t shortened;   /* faces that stay with fewer corners */
  const uint8_t *joins; /* [point_count after] whether equal values become one there; NULL: everywhere */
  tw_arena *arena;
  tw_mesh made; /* the mesh with attributes that are right once points are merged */
  uint32_t channel_count;
  tw_channel channels[TW_CHANNELS_MAX]; /* of `made` */
  /* [value_count] of each channel: the first value equal to each; NULL: all of its values stay. */
  uint32_t *equal[TW_CHANNELS_MAX];
} merger;

static void merger_deinit(merger *m) {
  tw_free(m->seen);
  tw_free(m->face_of);
  for (uint32_t i = 0; i < TW_CHANNELS_MAX; i++) tw_free(m->equal[i]);
}

/* Finds equal values of the channels that the mesh has. Values of attributes that were parted are welded
 * already. */
static tw_status find_equal(merger *m, const bool *parted, tw_error *error) {
  m->channel_count = tw_mesh_channels(&m->made, m->channels);
  tw_status status = TW_OK;
  for (uint32_t i = 0, a = 0; i < m->channel_count && status == TW_OK; i++) {
    const tw_channel *channel = &m->channels[i];
    if (i >= m->made.uv_set_count) {
      while (!m->made.attributes[a].corners) a++;
      if (parted[a++]) continue;
    }
    m->equal[i] = tw_alloc(channel->value_count, sizeof *m->equal[i]);
    if (!m->equal[i]) return no_memory(error);
    status = tw_find_equal_rows(channel->values, channel->width, channel->value_count, m->equal[i], error);
  }
  return status;
}

/* Does everything that can fail, before the mesh is touched. */
static tw_status merger_init(merger *m, tw_error *error) {
  const tw_mesh *mesh = m->mesh;
  bool parted[TW_ATTRIBUTES_MAX];
  m->made = *mesh;
  m->seen = tw_alloc_zero(m->point_count, sizeof *m->seen);
  m->face_of = tw_alloc(mesh->face_count, sizeof *m->face_of);
  if (!m->seen || !m->face_of) return no_memory(error);
  tw_status status = tw_mesh_part_attributes(&m->made, m->point_of, m->point_count, m->arena, parted, error);
  return status == TW_OK ? find_equal(m, parted, error) : status;
}

/* ---- points ---------------------------------------------------------------------------------- */

/* Which of the mesh's points remain. point_of: [point_count] the new index of each point; a row is that of
 * the first point with its index. */
typedef struct point_order {
  const uint32_t *point_of;
  uint32_t point_count;
} point_order;

/* Keeps each remaining point's row, in order. rows: [point_count] rows of `size` bytes, or NULL. */
static void keep_rows(point_order order, const void *rows, size_t size) {
  uint32_t next = 0;
  for (uint32_t p = 0; rows && p < order.point_count; p++)
    if (order.point_of[p] == next) memmove((char *)rows + size * next++, (const char *)rows + size * p, size);
}

static void keep_points(const tw_mesh *mesh, const uint32_t *point_of) {
  const point_order order = {point_of, mesh->point_count};
  keep_rows(order, mesh->positions, 3 * sizeof(float));
  for (uint32_t i = 0; i < mesh->attribute_count; i++)
    if (!mesh->attributes[i].corners)
      keep_rows(order, mesh->attributes[i].values, mesh->attributes[i].width * sizeof(float));
  keep_rows(order, mesh->skin.joints, mesh->skin.width * sizeof(uint16_t));
  keep_rows(order, mesh->skin.weights, mesh->skin.width * sizeof(float));
  for (uint32_t t = 0; t < mesh->morph_count; t++) keep_rows(order, mesh->morphs[t], 3 * sizeof(float));
}

static void renumber(const uint32_t *values, size_t count, const uint32_t *number) {
  for (size_t i = 0; i < count; i++) ((uint32_t *)values)[i] = number[values[i]];
}

void tw_mesh_drop_points(tw_mesh *mesh, uint32_t *had_face) {
  enum { STAYS, GOES };
  uint32_t *number = had_face, kept = 0;
  for (uint32_t p = 0; p < mesh->point_count; p++) number[p] = had_face[p] ? GOES : STAYS;
  for (uint32_t c = 0; c < mesh->corner_count; c++) number[mesh->corners[c]] = STAYS;
  for (size_t i = 0; i < 2 * (size_t)mesh->crease_count; i++) number[mesh->crease_edges[i]] = STAYS;
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++) number[mesh->sharp_points[i]] = STAYS;
  for (uint32_t p = 0; p < mesh->point_count; p++) number[p] = number[p] == STAYS ? kept++ : UINT32_MAX;
  if (kept == mesh->point_count) return;
  keep_points(mesh, number);
  renumber(mesh->corners, mesh->corner_count, number);
  renumber(mesh->crease_edges, 2 * (size_t)mesh->crease_count, number);
  renumber(mesh->sharp_points, mesh->sharp_point_count, number);
  mesh->point_count = kept;
}

/* ---- faces ----------------------------------------------------------------------------------- */

/* Corners have their new points already. */
static void copy_corner(const merger *m, uint32_t from, uint32_t to) {
  tw_mesh *mesh = m->mesh;
  ((uint32_t *)mesh->corners)[to] = mesh->corners[from];
  if (mesh->normals.corners) ((uint32_t *)mesh->normals.corners)[to] = mesh->normals.corners[from];
  bool joins = !m->joins || m->joins[mesh->corners[from]];
  for (uint32_t i = 0; i < m->channel_count; i++) {
    uint32_t *corners = (uint32_t *)m->channels[i].corners, value = corners[from];
    corners[to] = m->equal[i] && joins ? m->equal[i][value] : value;
  }
}

static bool is_whole_triangle(const uint32_t *corners) {
  return corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0];
}

/* Moves a face's corners to `start`, dropping each whose point equals the corner's before it. Returns where
 * they end, or `start` for a face left with fewer than three different points. */
static uint32_t keep_corners(merger *m, uint32_t face, uint32_t begin, uint32_t end, uint32_t start) {
  const uint32_t *corners = m->mesh->corners;
  if (end - begin == 3 && is_whole_triangle(corners + begin)) {
    if (start == begin && m->channel_count == 0) return end; /* they stay where they are */
    for (uint32_t c = begin; c < end; c++) copy_corner(m, c, start++);
    return start;
  }
  uint32_t kept = start, different = 0, before = corners[end - 1];
  for (uint32_t c = begin; c < end; c++) {
    uint32_t point = corners[c];
    if (point != before) {
      different += m->seen[point] != face + 1;
      m->seen[point] = face + 1;
      copy_corner(m, c, kept++);
    }
    before = point;
  }
  m->seen[before] = face + 1; /* the only one of a face whose corners are one point */
  m->shortened += different >= 3 && kept - start < end - begin;
  return different < 3 ? start : kept;
}

static void see_face(const merger *m, uint32_t face, uint32_t begin, uint32_t end) {
  for (uint32_t c = begin; c < end; c++) m->seen[m->mesh->corners[c]] = face + 1;
}

static void copy_face(tw_mesh *mesh, uint32_t from, uint32_t to) {
  if (mesh->face_materials) ((int32_t *)mesh->face_materials)[to] = mesh->face_materials[from];
  if (mesh->face_groups) ((uint32_t *)mesh->face_groups)[to] = mesh->face_groups[from];
  if (mesh->face_smoothing) ((uint32_t *)mesh->face_smoothing)[to] = mesh->face_smoothing[from];
  if (mesh->tangent_uvs) ((uint8_t *)mesh->tangent_uvs)[to] = mesh->tangent_uvs[from];
}

static void keep_faces(merger *m) {
  tw_mesh *mesh = m->mesh;
  uint32_t *offsets = (uint32_t *)mesh->face_offsets, faces = 0, corners = 0;
  renumber(mesh->corners, mesh->corner_count, m->point_of);
  for (uint32_t f = 0, begin = 0; f < mesh->face_count; f++) {
    uint32_t end = offsets[f + 1];
    bool is_left_out = m->left_out && m->left_out[f];
    if (is_left_out) see_face(m, f, begin, end);
    uint32_t stop = is_left_out ? corners : keep_corners(m, f, begin, end, corners);
    m->face_of[f] = stop > corners ? faces : UINT32_MAX;
    if (stop > corners) {
      copy_face(mesh, f, faces++);
      offsets[faces] = corners = stop;
    }
    begin = end;
  }
  mesh->face_count = faces;
  mesh->corner_count = corners;
}

/* ---- tags ------------------------------------------------------------------------------------ */

static void keep_tags(const merger *m) {
  tw_mesh *mesh = m->mesh;
  uint32_t *edges = (uint32_t *)mesh->crease_edges, *points = (uint32_t *)mesh->sharp_points,
           *holes = (uint32_t *)mesh->holes, kept = 0;
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    uint32_t a = m->point_of[edges[2 * (size_t)i]], b = m->point_of[edges[2 * (size_t)i + 1]];
    if (a == b) continue;
    edges[2 * (size_t)kept] = a;
    edges[2 * (size_t)kept + 1] = b;
    ((float *)mesh->crease_sharpness)[kept++] = mesh->crease_sharpness[i];
  }
  mesh->crease_count = kept;
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++) points[i] = m->point_of[points[i]];
  kept = 0;
  for (uint32_t i = 0; i < mesh->hole_count; i++)
    if (m->face_of[holes[i]] != UINT32_MAX) holes[kept++] = m->face_of[holes[i]];
  mesh->hole_count = kept;
}

/* Makes equal values of corners one value, in a mesh whose points and faces stay: seams are where values
 * differ, however often a file writes them. */
static tw_status join_values(tw_mesh *mesh, tw_error *error) {
  static const bool parted[TW_ATTRIBUTES_MAX];
  merger m = {.mesh = mesh, .made = *mesh};
  tw_status status = find_equal(&m, parted, error);
  for (uint32_t i = 0; i < m.channel_count && status == TW_OK; i++)
    renumber(m.channels[i].corners, mesh->corner_count, m.equal[i]);
  merger_deinit(&m);
  return status;
}

/* ---- seams between equal values -------------------------------------------------------------- */

#define NO_VALUE UINT32_MAX
#define SEVERAL  (UINT32_MAX - 1)

/* A corner's value, by its point. */
typedef struct seam_value {
  uint32_t point, value, width;
  const float *row; /* [width] */
} seam_value;

static int compare_seam_values(const void *left, const void *right) {
  const seam_value *a = left, *b = right;
  if (a->point != b->point) return a->point < b->point ? -1 : 1;
  int order = tw_compare_floats(a->row, b->row, a->width);
  if (order != 0) return order;
  return a->value < b->value ? -1 : a->value > b->value;
}

/* Finds the points whose corners have several values of a channel. value_at: [point_count] receives SEVERAL
 * for these. Returns how many corners such points have. */
static uint32_t mark_seams(const tw_mesh *mesh, const tw_channel *channel, uint32_t *value_at) {
  uint32_t count = 0;
  for (uint32_t p = 0; p < mesh->point_count; p++) value_at[p] = NO_VALUE;
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    uint32_t *value = &value_at[mesh->corners[c]];
    if (*value == NO_VALUE) *value = channel->corners[c];
    if (*value != channel->corners[c]) *value = SEVERAL;
  }
  for (uint32_t c = 0; c < mesh->corner_count; c++) count += value_at[mesh->corners[c]] == SEVERAL;
  return count;
}

tw_status tw_mesh_has_equal_seams(const tw_mesh *mesh, const tw_channel *channel, bool *out) {
  uint32_t *value_at = tw_alloc(mesh->point_count, sizeof *value_at), count = 0;
  if (!value_at) return TW_NO_MEMORY;
  uint32_t corners = mark_seams(mesh, channel, value_at);
  seam_value *placed = tw_alloc(corners, sizeof *placed);
  for (uint32_t c = 0; placed && c < mesh->corner_count; c++) {
    uint32_t value = channel->corners[c];
    if (value_at[mesh->corners[c]] == SEVERAL)
      placed[count++] = (seam_value){mesh->corners[c], value, channel->width,
                                     channel->values + (size_t)channel->width * value};
  }
  tw_status status = placed ? tw_sort(placed, count, sizeof *placed, compare_seam_values) : TW_NO_MEMORY;
  *out = false;
  for (uint32_t c = 1; status == TW_OK && c < count; c++)
    *out |= placed[c].point == placed[c - 1].point && placed[c].value != placed[c - 1].value &&
            tw_compare_floats(placed[c].row, placed[c - 1].row, channel->width) == 0;
  tw_free(value_at);
  tw_free(placed);
  return status;
}

/* ---- merging --------------------------------------------------------------------------------- */

/* point_of: [point_count] the new index of each point; the `count` new points are numbered by their first old
 * point. left_out: [face_count] faces to drop, or NULL. joins: as in merger. */
static tw_status merge(tw_mesh *mesh, const uint32_t *point_of, uint32_t count, const uint8_t *left_out,
                       const uint8_t *joins, tw_arena *arena, tw_merged *out, tw_error *error) {
  *out = (tw_merged){0};
  if (count == mesh->point_count && !left_out) return joins ? TW_OK : join_values(mesh, error);
  merger m = {.mesh = mesh,
              .point_of = point_of,
              .point_count = count,
              .left_out = left_out,
              .joins = joins,
              .arena = arena};
  tw_status status = merger_init(&m, error);
  if (status == TW_OK) {
    uint32_t faces = mesh->face_count;
    mesh->attributes = m.made.attributes;
    keep_faces(&m);
    keep_tags(&m);
    keep_points(mesh, point_of);
    *out = (tw_merged){
        .points = mesh->point_count - count, .faces = faces - mesh->face_count, .shortened = m.shortened};
    mesh->welded_points += out->points;
    mesh->point_count = count;
    if (out->faces > 0) tw_mesh_drop_points(mesh, m.seen);
  }
  merger_deinit(&m);
  return status;
}

static int compare_points(const void *context, uint32_t a, uint32_t b) {
  const tw_mesh *mesh = context;
  const tw_skin_weights *skin = &mesh->skin;
  size_t width = skin->width;
  int order = 0;
  for (size_t k = 0; skin->joints && k < width && order == 0; k++)
    order = skin->joints[width * a + k] - skin->joints[width * b + k];
  if (skin->joints && order == 0)
    order = tw_compare_floats(skin->weights + width * a, skin->weights + width * b, width);
  for (uint32_t t = 0; t < mesh->morph_count && order == 0; t++)
    order = tw_compare_floats(mesh->morphs[t] + 3 * (size_t)a, mesh->morphs[t] + 3 * (size_t)b, 3);
  return order;
}

bool tw_mesh_points_move_alike(const tw_mesh *mesh, uint32_t a, uint32_t b) {
  return compare_points(mesh, a, b) == 0;
}

static tw_soup soup_of(const tw_mesh *mesh) {
  return (tw_soup){.vertex_count = mesh->point_count,
                   .positions = mesh->positions,
                   .face_count = mesh->face_count,
                   .corner_count = mesh->corner_count,
                   .face_offsets = mesh->face_offsets,
                   .corners = mesh->corners,
                   .compare = compare_points,
                   .context = mesh,
                   .face_materials = mesh->face_materials};
}

/* points: [point_count] and left_out: [face_count], scratch. */
static tw_status close_seams(tw_mesh *mesh, uint32_t *points, uint8_t *left_out, tw_arena *arena,
                             tw_merged *out, tw_welded *welded, tw_error *error) {
  const tw_soup soup = soup_of(mesh);
  tw_status status = tw_weld_points(&soup, points, left_out, welded, error);
  uint32_t dropped = welded->collapsed + welded->doubled + welded->slivers;
  if (status == TW_OK)
    status = merge(mesh, points, welded->point_count, dropped > 0 ? left_out : NULL, NULL, arena, out, error);
  if (status == TW_OK) out->faces -= welded->doubled + welded->slivers;
  return status;
}

tw_status tw_mesh_close_seams(tw_mesh *mesh, tw_arena *arena, tw_merged *out, tw_welded *welded,
                              tw_error *error) {
  uint32_t *points = tw_alloc(mesh->point_count, sizeof *points);
  uint8_t *left_out = tw_alloc(mesh->face_count, 1);
  tw_status status =
      points && left_out ? close_seams(mesh, points, left_out, arena, out, welded, error) : no_memory(error);
  tw_free(points);
  tw_free(left_out);
  return status;
}

/* Counts the points that move otherwise than the first point with their new index, whose joints and
 * displacements stay. first: [point_count] scratch. */
static uint32_t count_bent(const tw_mesh *mesh, const uint32_t *point_of, uint32_t *first) {
  uint32_t bent = 0;
  if (!mesh->skin.joints && mesh->morph_count == 0) return 0;
  for (uint32_t p = mesh->point_count; p-- > 0;) first[point_of[p]] = p;
  for (uint32_t p = 0; p < mesh->point_count; p++)
    bent += !tw_mesh_points_move_alike(mesh, p, first[point_of[p]]);
  return bent;
}

/* Flags each new point that is made of several old ones. first: [point_count] scratch. joins: zeroed. */
static void flag_merged(const uint32_t *point_of, uint32_t point_count, uint32_t *first, uint8_t *joins) {
  for (uint32_t p = point_count; p-- > 0;) first[point_of[p]] = p;
  for (uint32_t p = 0; p < point_count; p++) joins[point_of[p]] |= first[point_of[p]] != p;
}

tw_status tw_mesh_merge_within(tw_mesh *mesh, double distance, tw_arena *arena, tw_merged *out,
                               tw_error *error) {
  uint32_t *point_of = tw_alloc(mesh->point_count, 2 * sizeof *point_of), count = 0, bent = 0;
  uint8_t *joins = tw_alloc_zero(mesh->point_count, 1);
  tw_status status = point_of && joins ? tw_weld_within(mesh->positions, mesh->point_count, distance,
                                                        point_of, &count, error)
                                       : no_memory(error);
  if (status == TW_OK) {
    bent = count_bent(mesh, point_of, point_of + mesh->point_count);
    flag_merged(point_of, mesh->point_count, point_of + mesh->point_count, joins);
    status = merge(mesh, point_of, count, NULL, joins, arena, out, error);
  }
  if (status == TW_OK) out->bent = bent;
  tw_free(joins);
  tw_free(point_of);
  return status;
}
