/* The head of a mesh's points in binary form, and what their rows hold. */
#include "flat.h"

#include <string.h>

enum { PREFIX = 12, LENGTH_AT = 8 };

tw_ply_layout tw_points_lay_out(bool has_normals, bool has_uvs) {
  tw_ply_layout out = {.has_normals = has_normals, .has_uvs = has_uvs, .is_v_down = true};
  out.vertex_size = 4 * (3 + 3U * has_normals + 2U * has_uvs);
  return out;
}

static void put_part(tw_text *text, const char *name, uint32_t components, uint32_t *offset) {
  tw_text_element(text);
  tw_text_add(text, "{");
  tw_member_string(text, "name", name);
  tw_member_count(text, "offset", *offset);
  tw_member_count(text, "byte_offset", *offset * sizeof(float));
  tw_member_count(text, "components", components);
  tw_text_add(text, "}");
  *offset += components;
}

bool tw_points_put_head(const tw_flat_scene *flat, const tw_ply_layout *layout, tw_text *out) {
  const tw_surface *surface = flat->scene.surfaces[0];
  uint64_t points = flat->part_count > 0 ? tw_surface_row_count(surface, TW_DOMAIN_POINTS) : 0;
  uint32_t offset = 0, length;
  tw_text_bytes(out, "TWSB\1\0\0\0\0\0\0\0", PREFIX);
  tw_text_add(out, "{");
  tw_member_string(out, "mesh", flat->scene.model->meshes[0].name);
  tw_member_count(out, "level", tw_surface_get_options(surface)->level);
  tw_member_count(out, "points", points);
  tw_member_count(out, "stride", layout->vertex_size / sizeof(float));
  tw_member_open(out, "layout", "[");
  put_part(out, "position", 3, &offset);
  if (layout->has_normals) put_part(out, "normal", 3, &offset);
  if (layout->has_uvs) put_part(out, "uv", 2, &offset);
  tw_text_add(out, "]}");
  while (out->size % 4 != 0 && !out->failed) tw_text_add(out, " ");
  if (out->failed) return false;
  length = (uint32_t)(out->size - PREFIX);
  memcpy(out->data + LENGTH_AT, &length, sizeof length);
  return true;
}
