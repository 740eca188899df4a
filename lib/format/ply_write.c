/* Vertices and faces of binary little-endian PLY (Turk 1994), with the properties that MeshLab, Blender and
 * three.js read. Every point is one vertex, so that closed surfaces stay closed; where texture coordinates
 * have seams they are lists of face corners. */
#include "flat.h"

#include <math.h>
#include <string.h>

#include "soup_mesh.h"

/* ---- layout ---------------------------------------------------------------------------------- */

/* Whether texture coordinates differ between faces at some point. Every point has as many of them as differ
 * there, one where none do. */
static bool has_seams(const tw_surface *surface) {
  return tw_surface_row_count(surface, TW_DOMAIN_UVS) > tw_surface_row_count(surface, TW_DOMAIN_POINTS);
}

tw_ply_layout tw_ply_lay_out(const tw_flat_scene *flat) {
  enum { LIST_MOST = 255 };
  tw_ply_layout out = {.is_ngon = flat->scene.polygons == TW_POLYGONS_NGON};
  uint64_t points = 0;
  size_t largest = 3;
  for (uint32_t i = 0; i < flat->part_count; i++) {
    const tw_flat_part *part = &flat->parts[i];
    const tw_surface *surface = part->surface;
    out.has_normals |= tw_surface_get_layout(surface)->normal != UINT32_MAX;
    out.has_colors |= tw_surface_color(surface) != UINT32_MAX;
    bool has_uvs = tw_surface_row_count(surface, TW_DOMAIN_UVS) > 0;
    out.has_uvs |= has_uvs;
    out.has_wedges |= has_seams(surface);
    size_t size = out.is_ngon ? tw_surface_largest_face(surface) : 3;
    if (size > largest) largest = size;
    points += tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  }
  out.has_uvs &= !out.has_wedges;
  out.has_long_lists = (size_t)(out.has_wedges ? 2 : 1) * largest > LIST_MOST;
  out.has_large_indices = points > INT32_MAX;
  uint32_t list = out.has_long_lists ? 4 : 1;
  uint32_t floats = 3 + 3U * out.has_normals + 2U * out.has_uvs;
  out.vertex_size = 4 * (floats + out.has_colors);
  out.face_size = out.has_wedges ? 2 * list : list;
  out.per_edge = out.has_wedges ? 12 : 4;
  return out;
}

static uint64_t count_faces(const tw_flat_scene *flat, bool is_ngon) {
  uint64_t count = 0;
  for (uint32_t i = 0; i < flat->part_count; i++) {
    const tw_surface_group faces = tw_flat_faces(flat->parts[i].surface);
    count += is_ngon ? faces.face_count : tw_count_triangles(&faces);
  }
  return count;
}

bool tw_ply_put_head(const tw_flat_scene *flat, const tw_ply_layout *layout, const char *unit, tw_text *out) {
  uint64_t points = 0;
  for (uint32_t i = 0; i < flat->part_count; i++)
    points += tw_surface_row_count(flat->parts[i].surface, TW_DOMAIN_POINTS);
  tw_text_add(out, "ply\nformat binary_little_endian 1.0\ncomment tweend ");
  tw_text_add(out, tw_version());
  tw_text_add(out, "\ncomment unit ");
  tw_text_add(out, unit);
  if (flat->is_moved) {
    tw_text_add(out, "\ncomment moved by");
    for (int c = 0; c < 3; c++) {
      tw_text_add(out, " ");
      tw_text_double(out, -flat->origin[c]);
    }
  }
  tw_text_add(out, "\nelement vertex ");
  tw_text_count(out, points);
  tw_text_add(out, "\nproperty float x\nproperty float y\nproperty float z\n");
  if (layout->has_normals) tw_text_add(out, "property float nx\nproperty float ny\nproperty float nz\n");
  if (layout->has_uvs) tw_text_add(out, "property float s\nproperty float t\n");
  if (layout->has_colors)
    tw_text_add(out, "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n");
  const char *list = layout->has_long_lists ? "property list int " : "property list uchar ";
  tw_text_add(out, "element face ");
  tw_text_count(out, count_faces(flat, layout->is_ngon));
  tw_text_add(out, "\n");
  tw_text_add(out, list);
  tw_text_add(out, layout->has_large_indices ? "uint vertex_indices\n" : "int vertex_indices\n");
  if (layout->has_wedges) {
    tw_text_add(out, list);
    tw_text_add(out, "float texcoord\n");
  }
  tw_text_add(out, "end_header\n");
  return !out->failed;
}

/* ---- vertices -------------------------------------------------------------------------------- */

void tw_ply_find_levels(tw_flat_tools *tools) {
  for (int byte = 0; byte < 256; byte++)
    tools->levels[byte] = tw_linear_from_srgb(((float)byte - 0.5f) / 255);
  tools->levels[0] = -1;
}

/* A linear colour as a byte of sRGB. */
static uint8_t byte_of_color(const float levels[256], float linear) {
  uint32_t byte = 0;
  for (uint32_t step = 128; step > 0; step /= 2)
    if (linear >= levels[byte + step]) byte += step;
  return (uint8_t)byte;
}

static uint8_t byte_of_share(float share) {
  return (uint8_t)(255 * fminf(fmaxf(share, 0), 1) + 0.5f);
}

/* row: of the reader, which is turned to unsplit rows. columns: of such rows. */
static void put_vertex(const tw_flat_tools *tools, const tw_flat_part *part, const tw_ply_layout *layout,
                       const tw_surface_layout *columns, const float *row, uint8_t *out) {
  float values[8] = {0};
  size_t count = 3;
  tw_flat_move(part, row, values);
  if (layout->has_normals) {
    if (columns->normal != UINT32_MAX) tw_flat_turn(part, row + columns->normal, values + count);
    count += 3;
  }
  if (layout->has_uvs) { /* rows have v down */
    const float *uv = columns->uv_count > 0 ? row + columns->uvs[0] : NULL;
    if (uv) values[count] = uv[0];
    if (uv) values[count + 1] = layout->is_v_down ? uv[1] : 1 - uv[1];
    count += 2;
  }
  memcpy(out, values, count * sizeof *values);
  if (!layout->has_colors) return;
  uint8_t color[4] = {UINT8_MAX, UINT8_MAX, UINT8_MAX, UINT8_MAX};
  const float *own = row + columns->attributes[0].column;
  for (int c = 0; columns->attribute_count > 0 && c < 3; c++) color[c] = byte_of_color(tools->levels, own[c]);
  if (columns->attribute_count > 0) color[3] = byte_of_share(own[3]);
  memcpy(out + count * sizeof *values, color, sizeof color);
}

uint32_t tw_ply_put_vertices(tw_flat_tools *tools, const tw_flat_part *part, const tw_ply_layout *layout,
                             uint64_t first, uint64_t most, uint8_t *out) {
  const tw_surface *surface = part->surface;
  const tw_point_columns wanted = {layout->has_normals &&
                                       tw_surface_get_layout(surface)->normal != UINT32_MAX,
                                   layout->has_uvs && tw_surface_row_count(surface, TW_DOMAIN_UVS) > 0,
                                   layout->has_colors ? tw_surface_color(surface) : UINT32_MAX};
  tw_surface_reader_turn_to_unsplit(tools->reader, surface, &wanted);
  const tw_surface_layout *columns = tw_surface_reader_layout(tools->reader);
  uint32_t count = (uint32_t)tw_least(most, TW_FLAT_ROWS);
  tw_surface_read_rows(tools->reader, TW_DOMAIN_VERTICES, first, count, tools->rows);
  for (uint32_t i = 0; i < count; i++, out += layout->vertex_size)
    put_vertex(tools, part, layout, columns, tools->rows + (size_t)i * columns->stride, out);
  return count;
}

/* ---- faces ----------------------------------------------------------------------------------- */

static uint8_t *put_length(const tw_ply_layout *layout, uint32_t length, uint8_t *out) {
  uint8_t byte = (uint8_t)length;
  size_t size = layout->has_long_lists ? sizeof length : sizeof byte;
  memcpy(out, layout->has_long_lists ? (const void *)&length : &byte, size);
  return out + size;
}

/* Notes the UVs of `count` corners; false where there is no room for all. */
static bool note_wedges(tw_flat_tools *tools, size_t corner, uint32_t count) {
  for (size_t i = corner; i < corner + count; i++) {
    tools->places[1][i] = tw_row_pages_add(&tools->uvs, tools->corners[1][i]);
    if (tools->places[1][i] == UINT32_MAX) return false;
  }
  return true;
}

/* The place of corner i of a face that may turn round. */
static inline uint32_t turned(const tw_flat_part *part, uint32_t i, uint32_t size) {
  return part->is_mirrored && i > 0 ? size - i : i;
}

static uint8_t *put_face(const tw_flat_tools *tools, const tw_flat_part *part, const tw_ply_layout *layout,
                         bool has_uvs, size_t corner, uint32_t size, uint8_t *out) {
  const uint32_t *rows = tools->corners[0] + corner, *places = tools->places[1] + corner;
  out = put_length(layout, size, out);
  for (uint32_t i = 0; i < size; i++, out += 4) {
    uint32_t index = (uint32_t)(part->first_point + rows[turned(part, i, size)]);
    memcpy(out, &index, sizeof index);
  }
  if (!layout->has_wedges) return out;
  out = put_length(layout, 2 * size, out);
  for (uint32_t i = 0; i < size; i++, out += 8) {
    const float none[2] = {0}, *uv = none;
    if (has_uvs) uv = tools->uvs.values + 2 * (size_t)places[turned(part, i, size)];
    memcpy(out, uv, sizeof none);
  }
  return out;
}

/* Triangles without texture coordinates, which most faces are. */
static void put_bare_triangles(const tw_flat_tools *tools, const tw_flat_part *part, uint32_t count,
                               uint8_t *out) {
  const uint32_t *rows = tools->corners[0], second = turned(part, 1, 3), base = (uint32_t)part->first_point;
  for (uint32_t i = 0; i < count; i++, rows += 3, out += 13) {
    const uint32_t indices[3] = {base + rows[0], base + rows[second], base + rows[3 - second]};
    out[0] = 3;
    memcpy(out + 1, indices, sizeof indices);
  }
}

/* Reads the corners of faces, or of triangles, in a domain. Fills tools->sizes with polygons. Returns how
 * many faces were read. */
static uint32_t read_corners(tw_flat_tools *tools, const tw_surface *surface, const tw_ply_layout *layout,
                             tw_domain domain, uint64_t first, uint64_t most, uint32_t *out) {
  uint32_t count = (uint32_t)tw_least(most, TW_FLAT_FACES);
  if (!layout->is_ngon) {
    const tw_surface_group faces = tw_flat_faces(surface);
    tools->triangles.domain = domain;
    tw_triangulator_read(&tools->triangles, surface, &faces, first, count, out);
    return count;
  }
  uint64_t before = tw_surface_corners_before(surface, first);
  while (tw_surface_corners_before(surface, first + count) - before > tools->corner_capacity)
    count = (count + 1) / 2; /* one always fits */
  tw_surface_reader_turn(tools->reader, surface, 0, 0);
  tw_surface_read_faces(tools->reader, domain, first, count, tools->sizes, out);
  return count;
}

/* The faces whose UVs have room in the pages, which are read: at least one, but for a polygon of more corners
 * than there are pages. */
static uint32_t read_wedges(tw_flat_tools *tools, const tw_surface *surface, const tw_ply_layout *layout,
                            uint32_t count) {
  uint32_t face = 0;
  size_t corner = 0;
  tw_row_pages_clear(&tools->uvs);
  for (; face < count; face++) {
    uint32_t size = layout->is_ngon ? tools->sizes[face] : 3;
    if (!note_wedges(tools, corner, size)) break;
    corner += size;
  }
  tw_row_pages_read(&tools->uvs, tools->reader, tw_surface_row_count(surface, TW_DOMAIN_UVS));
  return face;
}

/* A polygon whose UVs do not fit the pages: they are read one by one. */
static void put_great_face(tw_flat_tools *tools, const tw_flat_part *part, const tw_ply_layout *layout,
                           uint32_t size, uint8_t *out) {
  out = put_face(tools, part, layout, false, 0, size, out) - 8 * (size_t)size;
  for (uint32_t i = 0; i < size; i++, out += 8) {
    float uv[2];
    tw_surface_read_rows(tools->reader, TW_DOMAIN_UVS, tools->corners[1][turned(part, i, size)], 1, uv);
    memcpy(out, uv, sizeof uv);
  }
}

uint32_t tw_ply_put_faces(tw_flat_tools *tools, const tw_flat_part *part, const tw_ply_layout *layout,
                          uint64_t first, uint64_t most, uint8_t *out) {
  const tw_surface *surface = part->surface;
  bool has_uvs = layout->has_wedges && tw_surface_row_count(surface, TW_DOMAIN_UVS) > 0;
  uint32_t count = read_corners(tools, surface, layout, TW_DOMAIN_POINTS, first, most, tools->corners[0]);
  if (!layout->is_ngon && !layout->has_wedges) {
    put_bare_triangles(tools, part, count, out);
    return count;
  }
  uint32_t fit = count;
  if (has_uvs) {
    read_corners(tools, surface, layout, TW_DOMAIN_UVS, first, count, tools->corners[1]);
    fit = read_wedges(tools, surface, layout, count);
  }
  if (fit == 0) {
    put_great_face(tools, part, layout, tools->sizes[0], out);
    return 1;
  }
  size_t corner = 0;
  for (uint32_t face = 0; face < fit; face++) {
    uint32_t size = layout->is_ngon ? tools->sizes[face] : 3;
    out = put_face(tools, part, layout, has_uvs, corner, size, out);
    corner += size;
  }
  return fit;
}
