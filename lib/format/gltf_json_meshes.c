/* Prints the meshes of a glTF answer's JSON. */
#include "gltf_json_writer.h"

#include <string.h>

static const char NGON[] = "FB_ngon_encoding";

/* ---- groups of faces, which glTF does not have. Cutting primitives at them would cost a draw call each, so
 * extras list them as ranges of indices, as three.js does (BufferGeometry.addGroup). */

/* How many triangles lie between the beginnings of two groups. */
static uint64_t triangles_between(const tw_surface_group *from, const tw_surface_group *to) {
  return to->first_corner - from->first_corner - 2 * (to->first_face - from->first_face);
}

/* Whether a face of a primitive is in a group. group: the surface's group in which the primitive begins. */
static bool is_in_groups(const tw_surface *surface, const tw_gltf_primitive *primitive, uint32_t group) {
  uint64_t end = primitive->first_triangle + primitive->triangle_count;
  for (; group < tw_surface_group_count(surface); group++) {
    const tw_surface_group *next = tw_surface_get_group(surface, group);
    if (triangles_between(&primitive->faces, next) >= end) return false;
    if (next->names != TW_NO_INDEX) return true;
  }
  return false;
}

/* The extras of a primitive: {"groups": [{"names": [...], "start": n, "count": n}, ...]}, ranges of its
 * indices, in order, then the members of preserved extras. Faces in no group are in no range; without any
 * range nothing is put. extras: NULL without any. next_group: the surface's group in which the primitive
 * begins; moves past the groups that end in the primitive. */
static void put_group_ranges(tw_gltf_writer *writer, const tw_surface *surface,
                             const tw_gltf_primitive *primitive, const char *extras, uint32_t *next_group) {
  uint64_t begin = primitive->first_triangle, end = begin + primitive->triangle_count, stop = begin;
  bool any = false;
  for (; *next_group < tw_surface_group_count(surface) && stop < end; ++*next_group) {
    const tw_surface_group *group = tw_surface_get_group(surface, *next_group);
    uint64_t start = triangles_between(&primitive->faces, group);
    stop = start + tw_count_triangles(group);
    bool goes_on = stop > end;
    if (group->names != TW_NO_INDEX) {
      if (!any) {
        tw_member_open(writer->text, "extras", "{");
        tw_member_open(writer->text, "groups", "[");
      }
      any = true;
      if (start < begin) start = begin;
      tw_gltf_open_object(writer);
      tw_member_words(writer->text, "names", writer->scene->model->group_names[group->names]);
      tw_member_count(writer->text, "start", 3 * (start - begin));
      tw_member_count(writer->text, "count", 3 * ((goes_on ? end : stop) - start));
      tw_gltf_close_object(writer);
    }
    if (goes_on) break;
  }
  if (!any) return;
  tw_text_add(writer->text, "]");
  if (extras && *extras == '{') tw_gltf_put_members(writer, extras, "groups");
  tw_gltf_close_object(writer);
}

/* ---- meshes ---------------------------------------------------------------------------------- */

/* step: accessors a target. */
static void put_targets(tw_gltf_writer *writer, uint32_t count, uint32_t first, uint32_t step) {
  if (count == 0) return;
  tw_member_open(writer->text, "targets", "[");
  for (uint32_t i = 0; i < count; i++) {
    tw_gltf_open_object(writer);
    tw_member_count(writer->text, "POSITION", first + (uint64_t)step * i);
    if (step == 2) tw_member_count(writer->text, "NORMAL", first + (uint64_t)step * i + 1);
    tw_gltf_close_object(writer);
  }
  tw_text_add(writer->text, "]");
}

/* The extensions of a preserved object, with FB_ngon_encoding added. */
static void put_ngon_extension(tw_gltf_writer *writer, const char *preserved) {
  const char *extensions = tw_json_member(preserved, "extensions");
  tw_member_open(writer->text, "extensions", "{");
  tw_member_open(writer->text, NGON, "{}");
  tw_gltf_note_extension(writer, NGON, sizeof NGON - 1);
  tw_gltf_put_members(writer, extensions, NULL);
  tw_text_add(writer->text, "}");
}

/* The preserved object of the primitives of these faces, or NULL. */
static const char *preserved_of(const tw_model *model, int32_t face_material) {
  uint32_t slot = (uint32_t)face_material - model->material_count;
  return face_material >= 0 && slot < model->slot_count ? model->slots[slot].preserved : NULL;
}

/* next_group: as of put_group_ranges. */
static void put_primitive(tw_gltf_writer *writer, const tw_gltf_mesh *mesh,
                          const tw_gltf_primitive *primitive, const tw_surface *surface,
                          uint32_t *next_group) {
  static const char *const added[2][2] = {{NULL, "extras"}, {"extensions", "extensions extras"}};
  const tw_model *model = writer->scene->model;
  tw_member_open(writer->text, "attributes", "{");
  for (uint32_t i = 0; i < mesh->field_count; i++) {
    tw_text_element(writer->text);
    tw_text_string(writer->text, mesh->fields[i].semantic);
    tw_text_add(writer->text, ":");
    tw_text_count(writer->text, primitive->first_attribute + (uint64_t)i);
  }
  tw_gltf_close_object(writer);
  tw_member_count(writer->text, "indices", primitive->indices);
  const int32_t material = tw_model_material(model, primitive->faces.material);
  if (material >= 0) tw_member_count(writer->text, "material", (uint64_t)material);
  put_targets(writer, mesh->target_count, primitive->first_target, mesh->target_step);
  const char *preserved = preserved_of(model, primitive->faces.material);
  bool bears_ngons = writer->scene->polygons == TW_POLYGONS_NGON,
       bears_groups = writer->plan->names_groups && is_in_groups(surface, primitive, *next_group);
  if (bears_ngons) put_ngon_extension(writer, preserved);
  tw_gltf_put_preserved(writer, preserved, added[bears_ngons][bears_groups]);
  if (writer->plan->names_groups)
    put_group_ranges(writer, surface, primitive, tw_json_member(preserved, "extras"), next_group);
}

static void put_primitives(tw_gltf_writer *writer, uint32_t index) {
  const tw_gltf_mesh *mesh = &writer->plan->meshes[index];
  const tw_surface *surface = writer->scene->surfaces[index];
  uint32_t group = 0;
  for (uint32_t i = 0; i < mesh->primitive_count; i++) {
    tw_gltf_open_object(writer);
    put_primitive(writer, mesh, &mesh->primitives[i], surface, &group);
    tw_gltf_close_object(writer);
  }
}

/* Primitives of points and lines as the file has them; without their targets if the mesh was baked. */
static void put_loose(tw_gltf_writer *writer, const tw_mesh *mesh) {
  tw_json_item item;
  for (bool more = tw_json_first(mesh->loose, &item); more; more = tw_gltf_next_item(writer, &item)) {
    tw_gltf_open_object(writer);
    tw_gltf_put_preserved(writer, item.value, mesh->morph_count > 0 ? NULL : "targets");
    tw_gltf_close_object(writer);
  }
}

/* A primitive without area for a mesh without faces, so that meshes keep their numbers. */
static void put_nothing(tw_gltf_writer *writer, const tw_gltf_mesh *mesh) {
  tw_gltf_open_object(writer);
  tw_member_open(writer->text, "attributes", "{");
  tw_member_count(writer->text, "POSITION", writer->plan->nothing);
  tw_gltf_close_object(writer);
  put_targets(writer, mesh->target_count, writer->plan->nothing, 0);
  tw_gltf_close_object(writer);
}

/* Adds tags to the extras of a preserved object. Extras that are no object have no room for them and are
 * dropped. */
static void put_preserved_and_tags(tw_gltf_writer *writer, const char *tags, const tw_mesh *source) {
  const char *extras = tw_json_member(source->preserved, "extras");
  tw_member_open(writer->text, "extras", "{");
  tw_member_open(writer->text, "tweend", tags);
  if (extras && *extras == '{') tw_gltf_put_members(writer, extras, NULL);
  tw_gltf_close_object(writer);
  tw_gltf_put_preserved(writer, source->preserved, "extras");
}

void tw_gltf_put_meshes(tw_gltf_writer *writer) {
  const tw_model *model = writer->scene->model;
  if (model->mesh_count == 0) return;
  tw_member_open(writer->text, "meshes", "[");
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_gltf_mesh *mesh = &writer->plan->meshes[i];
    const tw_mesh *source = &model->meshes[i];
    tw_gltf_open_object(writer);
    tw_gltf_put_name(writer, source->name);
    tw_member_open(writer->text, "primitives", "[");
    put_primitives(writer, i);
    if (source->loose && model->assets)
      put_loose(writer, source);
    else if (mesh->primitive_count == 0)
      put_nothing(writer, mesh);
    tw_text_add(writer->text, "]");
    if (mesh->target_count && source->morph_weights)
      tw_member_floats(writer->text, "weights", source->morph_weights, mesh->target_count);
    if (mesh->tags)
      put_preserved_and_tags(writer, mesh->tags, source);
    else
      tw_gltf_put_preserved(writer, source->preserved, NULL);
    tw_gltf_close_object(writer);
  }
  tw_text_add(writer->text, "]");
}
