/* Polygons to a mesh: degenerate ones are dropped, then vertices are welded, then attributes follow. */
#include "soup_mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "merge_points.h"

float tw_linear_from_srgb(float value) {
  float c = fminf(fmaxf(value, 0), 1);
  return c <= 0.04045f ? c / 12.92f : powf((c + 0.055f) / 1.055f, 2.4f);
}

float tw_srgb_from_linear(float value) {
  float c = fminf(fmaxf(value, 0), 1);
  return c <= 0.0031308f ? c * 12.92f : 1.055f * powf(c, 1 / 2.4f) - 0.055f;
}

uint64_t tw_polygons_size(uint64_t vertex_count, uint64_t corner_count, uint64_t face_count,
                          uint32_t corner_values) {
  uint64_t vertex = (size_t)(2 * (3 + 4 + 2 + 3)) * sizeof(float) + 3 * sizeof(uint32_t);
  uint64_t values = corner_values > 0 ? (3 * corner_values + 8) * sizeof(float) : 0; /* as read, keys, kept */
  return vertex * vertex_count + (4 * sizeof(uint32_t) + values) * corner_count +
         sizeof(uint32_t) * face_count + tw_weld_size((uint32_t)vertex_count, (uint32_t)corner_count);
}

/* Gathers values of the welded points: each takes that of its first vertex. number: [vertex_count] the point
 * of each vertex; points are numbered by first vertex. */
static float *gather(tw_arena *arena, const float *values, size_t width, const uint32_t *number,
                     uint32_t vertex_count, uint32_t count) {
  float *out = tw_arena_alloc_raw(arena, count, width * sizeof *out);
  uint32_t next = 0;
  for (uint32_t v = 0; out && v < vertex_count; v++)
    if (number[v] == next) memcpy(out + width * next++, values + width * (size_t)v, width * sizeof *out);
  return out;
}

static bool same_place(const float *positions, uint32_t a, uint32_t b) {
  const float *p = positions + 3 * (size_t)a, *q = positions + 3 * (size_t)b;
  return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

static bool has_three_places(const tw_polygons_read *read, uint32_t first, uint32_t end) {
  uint32_t places[2], count = 0; /* vertices at the places found */
  for (uint32_t c = first; c < end; c++) {
    uint32_t vertex = read->corners[c], known = 0;
    while (known < count && !same_place(read->positions, places[known], vertex)) known++;
    if (known == 2) return true;
    if (known == count) places[count++] = vertex;
  }
  return false;
}

/* Moves a corner with its values to a place before it, or leaves it where it is. */
static void move_corner(tw_polygons_read *read, uint32_t from, uint32_t to) {
  read->corners[to] = read->corners[from];
  if (read->corner_uvs && from != to)
    memcpy(read->corner_uvs + 2 * (size_t)to, read->corner_uvs + 2 * (size_t)from, 2 * sizeof(float));
  if (read->corner_colors && from != to)
    memcpy(read->corner_colors + 4 * (size_t)to, read->corner_colors + 4 * (size_t)from, 4 * sizeof(float));
}

/* Drops corners and faces in place, as welding could not see across an edge without length. */
static void drop_degenerate(tw_polygons_read *read, tw_losses *losses) {
  uint32_t faces = 0, kept = 0, *corners = read->corners, doubled = 0;
  for (uint32_t f = 0, first = 0; f < read->face_count; f++) {
    uint32_t end = read->face_offsets[f + 1], start = kept;
    bool is_face = has_three_places(read, first, end);
    for (uint32_t c = first, before = is_face ? corners[end - 1] : 0; is_face && c < end; c++) {
      uint32_t vertex = corners[c];
      if (!same_place(read->positions, vertex, before)) move_corner(read, c, kept++);
      before = vertex;
    }
    if (is_face) read->face_offsets[faces++] = start;
    doubled += is_face && kept - start < end - first;
    first = end;
  }
  tw_lose(losses, TW_COLLAPSED_FACE, TW_COLLAPSED_FACES, read->face_count - faces, 0);
  tw_lose_doubled_corners(losses, doubled);
  read->face_offsets[faces] = kept;
  read->face_count = faces;
  read->corner_count = kept;
}

/* Removes the faces left out, and corners at the point of the corner before them. points: [vertex_count].
 * Returns how many faces stay with fewer corners. */
static uint32_t drop_marked(tw_polygons_read *read, const uint32_t *points, const uint8_t *left_out) {
  uint32_t faces = 0, kept = 0, shortened = 0;
  for (uint32_t f = 0, first = 0; f < read->face_count; f++) {
    uint32_t end = read->face_offsets[f + 1], start = kept, before = points[read->corners[end - 1]];
    for (uint32_t c = first; c < end && !left_out[f]; c++) {
      uint32_t vertex = read->corners[c];
      if (points[vertex] != before) move_corner(read, c, kept++);
      before = points[vertex];
    }
    if (!left_out[f]) read->face_offsets[++faces] = kept;
    shortened += !left_out[f] && kept - start < end - first;
    first = end;
  }
  read->face_count = faces;
  read->corner_count = kept;
  return shortened;
}

/* Makes the values of corners of what vertices have. points: [vertex_count] the point of each vertex, of
 * `point_count` points. */
static tw_status weld_values(const tw_soup *soup, const float *rows, uint32_t width, const uint32_t *points,
                             uint32_t point_count, tw_arena *arena, tw_channel *out, tw_error *error) {
  uint32_t *number = tw_alloc(soup->vertex_count, sizeof *number), count = 0;
  uint32_t *corners = tw_arena_alloc_raw(arena, soup->corner_count, sizeof *corners);
  tw_status status = number && corners
                         ? tw_weld_values(soup, points, point_count, rows, width, number, &count, error)
                         : tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK) {
    for (uint32_t c = 0; c < soup->corner_count; c++) corners[c] = number[soup->corners[c]];
    float *values = gather(arena, rows, width, number, soup->vertex_count, count);
    *out = (tw_channel){width, count, values, corners, false};
    if (!values) status = tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  tw_free(number);
  return status;
}

/* Makes the values of corners of what a file gives for each: corners at one point with equal values share
 * one. points: the point of each vertex. rows: [corner_count][width]. */
static tw_status share_values(const tw_polygons_read *read, const uint32_t *points, const float *rows,
                              uint32_t width, tw_arena *arena, tw_channel *out, tw_error *error) {
  uint32_t corners = read->corner_count, wide = width + 2;
  float *keys = tw_alloc(corners, wide * sizeof *keys);
  uint32_t *numbers = tw_arena_alloc_raw(arena, corners, sizeof *numbers), count = 0;
  for (uint32_t c = 0; keys && c < corners; c++) {
    float *key = keys + (size_t)wide * c;
    uint32_t point = points[read->corners[c]];
    key[0] = (float)(point & 0xFFFF); /* a float holds each half */
    key[1] = (float)(point >> 16);
    memcpy(key + 2, rows + (size_t)width * c, width * sizeof *key);
  }
  tw_status status = keys && numbers ? tw_find_equal_rows(keys, wide, corners, numbers, error)
                                     : tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_free(keys);
  if (status != TW_OK) return status;
  for (uint32_t c = 0; c < corners; c++) /* the first corner with the values comes before the others */
    numbers[c] = numbers[c] == c ? count++ : numbers[numbers[c]];
  *out = (tw_channel){width, count, gather(arena, rows, width, numbers, corners, count), numbers, false};
  return out->values ? TW_OK : tw_fail(error, TW_NO_MEMORY, "out of memory");
}

static tw_status add_uvs(const tw_polygons_read *read, const tw_soup *soup, const uint32_t *points,
                         tw_arena *arena, tw_mesh *mesh, tw_error *error) {
  tw_channel uvs;
  if (!read->uvs && !read->corner_uvs) return TW_OK;
  tw_status status = read->corner_uvs
                         ? share_values(read, points, read->corner_uvs, 2, arena, &uvs, error)
                         : weld_values(soup, read->uvs, 2, points, mesh->point_count, arena, &uvs, error);
  if (status != TW_OK) return status;
  mesh->uv_sets[0] = (tw_uv_set){uvs.value_count, uvs.values, uvs.corners};
  mesh->uv_set_count = 1;
  return TW_OK;
}

static tw_status set_corner_colors(tw_mesh *mesh, const tw_channel *colors, tw_arena *arena,
                                   tw_error *error) {
  tw_status status =
      tw_mesh_set_corner_colors(mesh, colors->values, colors->value_count, colors->corners, arena);
  return status == TW_OK ? status : tw_fail(error, status, "out of memory");
}

/* Colours are of points, unless corners at one point have several. Points without a face are white. */
static tw_status share_colors(const tw_polygons_read *read, const uint32_t *points, tw_arena *arena,
                              tw_mesh *mesh, tw_error *error) {
  float *of_points = tw_arena_alloc_raw(arena, mesh->point_count, 4 * sizeof *of_points);
  if (!of_points) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (size_t i = 0; i < 4 * (size_t)mesh->point_count; i++) of_points[i] = 1;
  for (uint32_t c = read->corner_count; c-- > 0;)
    memcpy(of_points + 4 * (size_t)points[read->corners[c]], read->corner_colors + 4 * (size_t)c,
           4 * sizeof *of_points);
  bool parted = false;
  for (uint32_t c = 0; c < read->corner_count && !parted; c++)
    parted = tw_compare_floats(of_points + 4 * (size_t)points[read->corners[c]],
                               read->corner_colors + 4 * (size_t)c, 4) != 0;
  tw_channel colors;
  if (!parted)
    return tw_mesh_set_colors(mesh, of_points, arena) == TW_OK
               ? TW_OK
               : tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status = share_values(read, points, read->corner_colors, 4, arena, &colors, error);
  return status == TW_OK ? set_corner_colors(mesh, &colors, arena, error) : status;
}

/* Colours are of points, unless vertices of one point have several. */
static tw_status add_colors(const tw_polygons_read *read, const tw_soup *soup, const uint32_t *points,
                            tw_arena *arena, tw_mesh *mesh, tw_error *error) {
  if (read->corner_colors) return share_colors(read, points, arena, mesh, error);
  if (!read->colors) return TW_OK;
  uint32_t count = mesh->point_count, *first = tw_alloc(count, sizeof *first);
  if (!first) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t v = read->vertex_count; v-- > 0;) first[points[v]] = v;
  bool parted = tw_values_part(points, read->vertex_count, first, read->colors, 4);
  tw_free(first);
  if (parted) {
    tw_channel colors;
    tw_status status = weld_values(soup, read->colors, 4, points, count, arena, &colors, error);
    return status == TW_OK ? set_corner_colors(mesh, &colors, arena, error) : status;
  }
  const float *colors = gather(arena, read->colors, 4, points, read->vertex_count, count);
  if (colors && tw_mesh_set_colors(mesh, colors, arena) == TW_OK) return TW_OK;
  return tw_fail(error, TW_NO_MEMORY, "out of memory");
}

/* Keeps a normal for each vertex: normals are not welded. */
static tw_status keep_normals(const tw_polygons_read *read, tw_arena *arena, tw_corner_normals *out,
                              tw_error *error) {
  float *values = tw_arena_alloc_raw(arena, read->vertex_count, 3 * sizeof *values);
  uint32_t *corners = tw_arena_alloc_raw(arena, read->corner_count, sizeof *corners);
  if (!values || !corners) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  memcpy(values, read->normals, (size_t)read->vertex_count * 3 * sizeof *values);
  memcpy(corners, read->corners, read->corner_count * sizeof *corners);
  *out = (tw_corner_normals){.value_count = read->vertex_count, .values = values, .corners = corners};
  return TW_OK;
}

/* points: [vertex_count] the point of each vertex, of `count` points. */
static tw_status fill_mesh(const tw_polygons_read *read, const tw_soup *soup, const uint32_t *points,
                           uint32_t count, tw_model *model, tw_error *error) {
  tw_mesh *mesh = model->meshes;
  mesh->point_count = count;
  mesh->positions = gather(model->arena, read->positions, 3, points, read->vertex_count, count);
  if (!mesh->positions) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status = add_colors(read, soup, points, model->arena, mesh, error);
  if (status == TW_OK) status = add_uvs(read, soup, points, model->arena, mesh, error);
  if (status == TW_OK && read->normals && read->corner_count > 0)
    status = keep_normals(read, model->arena, &mesh->normals, error);
  if (status != TW_OK) return status;
  for (uint32_t c = 0; c < read->corner_count; c++) read->corners[c] = points[read->corners[c]];
  mesh->face_count = read->face_count;
  mesh->corner_count = read->corner_count;
  mesh->face_offsets = read->face_offsets;
  mesh->corners = read->corners;
  return TW_OK;
}

static tw_soup view_soup(const tw_polygons_read *read) {
  return (tw_soup){.vertex_count = read->vertex_count,
                   .positions = read->positions,
                   .face_count = read->face_count,
                   .corner_count = read->corner_count,
                   .face_offsets = read->face_offsets,
                   .corners = read->corners};
}

/* As tw_weld_points, and drops the faces that it leaves out; with TW_WELD_NONE every vertex is a point. */
static tw_status number_points(tw_polygons_read *read, tw_weld weld, uint32_t *points, tw_welded *out,
                               tw_losses *losses, tw_error *error) {
  *out = (tw_welded){.point_count = read->vertex_count};
  for (uint32_t v = 0; v < read->vertex_count; v++) points[v] = v;
  if (weld == TW_WELD_NONE) return TW_OK;
  uint8_t *left_out = tw_alloc(read->face_count, 1);
  const tw_soup soup = view_soup(read);
  tw_status status = left_out ? tw_weld_points(&soup, points, left_out, out, error)
                              : tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK) tw_lose_doubled_corners(losses, drop_marked(read, points, left_out));
  tw_free(left_out);
  return status;
}

void tw_warn_of_welding(tw_model *model, const tw_welded *welded) {
  tw_model_warn_count(model, welded->doubled, "face is left out: it is listed twice",
                      "faces are left out: they are listed twice");
  tw_model_warn_count(model, welded->slivers,
                      "sliver is left out: it lies between two faces that belong together, flatter than a "
                      "millionth of the mesh",
                      "slivers are left out: they lie between two faces that belong together, flatter than a "
                      "millionth of the mesh");
  tw_model_warn_count(
      model, welded->reversed_edges,
      "edge is between faces that are wound the other way round: the surface is open there",
      "edges are between faces that are wound the other way round: the surface is open there");
  tw_model_warn_count(model, welded->open_edges,
                      "edge lies on another and stays an open seam: more than two faces meet there",
                      "edges lie on one another and stay open seams: more than two faces meet there");
  model->warns_of_seams |= welded->open_edges > 0;
}

void tw_warn_of_quads(tw_model *model) {
  uint64_t quads = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) quads += model->meshes[i].joined_quads;
  tw_model_warn_count(model, quads, "pair of triangles is joined into a quad: quads=ngon keeps the triangles",
                      "pairs of triangles are joined into quads: quads=ngon keeps the triangles");
}

void tw_add_welded(tw_welded *total, const tw_welded *more) {
  total->collapsed += more->collapsed;
  total->doubled += more->doubled;
  total->slivers += more->slivers;
  total->reversed_edges += more->reversed_edges;
  total->open_edges += more->open_edges;
}

tw_status tw_polygons_enter_frame(tw_polygons_read *read, tw_read_exact *read_exact, void *file,
                                  tw_error *error) {
  if (!tw_points_may_be_far(read->positions, read->corners, read->corner_count)) return TW_OK;
  double *exact = tw_alloc(read->vertex_count, 3 * sizeof *exact);
  if (!exact) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (size_t i = 0; !read_exact && i < 3 * (size_t)read->vertex_count; i++)
    exact[i] = (double)read->positions[i];
  if (read_exact) read_exact(file, exact);
  tw_status status = tw_work_status(error); /* else not all of them are read */
  if (status == TW_OK && tw_points_find_frame(exact, read->corners, read->corner_count, read->origin))
    tw_points_enter_frame(exact, read->vertex_count, read->origin, read->positions);
  tw_free(exact);
  return status;
}

/* Marks the vertices that faces have. had_face: [vertex_count], zeroed. */
static void mark_faces(const tw_polygons_read *read, uint32_t *had_face) {
  for (uint32_t c = 0; c < read->corner_count; c++) had_face[read->corners[c]] = 1;
}

/* Turns marks of vertices into marks of their points, in place: points are numbered by their first vertex. */
static void mark_points(uint32_t *had_face, const uint32_t *points, uint32_t vertex_count) {
  for (uint32_t v = 0, next = 0; v < vertex_count; v++) {
    uint32_t had = had_face[v];
    if (points[v] == next)
      had_face[next++] = had;
    else
      had_face[points[v]] |= had;
  }
}

/* points, had_face: [vertex_count] scratch, had_face zeroed. */
static tw_status make_mesh(tw_polygons_read *read, tw_weld weld, tw_model *model, tw_losses *losses,
                           uint32_t *points, uint32_t *had_face, tw_error *error) {
  uint32_t faces = read->face_count;
  tw_welded welded = {0};
  mark_faces(read, had_face);
  drop_degenerate(read, losses);
  tw_status status = number_points(read, weld, points, &welded, losses, error);
  if (status != TW_OK) return status;
  model->mesh_count = 1;
  tw_mesh_init(model->meshes);
  memcpy(model->meshes->origin, read->origin, sizeof read->origin);
  model->meshes->welded_points = read->vertex_count - welded.point_count;
  tw_lose(losses, TW_COLLAPSED_FACE, TW_COLLAPSED_FACES, welded.collapsed, 0);
  tw_warn_of_welding(model, &welded);
  const tw_soup soup = view_soup(read);
  status = fill_mesh(read, &soup, points, welded.point_count, model, error);
  if (status != TW_OK || read->face_count == faces) return status;
  mark_points(had_face, points, read->vertex_count);
  tw_mesh_drop_points(model->meshes, had_face);
  return TW_OK;
}

tw_status tw_model_of_polygons(tw_polygons_read *read, tw_weld weld, tw_model *model, tw_losses *losses,
                               tw_error *error) {
  uint32_t *points = tw_alloc(read->vertex_count, sizeof *points);
  uint32_t *had_face = tw_alloc_zero(read->vertex_count, sizeof *had_face);
  model->meshes = tw_arena_alloc(model->arena, 1, sizeof *model->meshes);
  tw_status status = points && had_face && model->meshes
                         ? make_mesh(read, weld, model, losses, points, had_face, error)
                         : tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_free(points);
  tw_free(had_face);
  return status;
}
