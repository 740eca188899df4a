/* Answers as OBJ, which has points with a colour each, one set of texture coordinates, and names of
 * materials. */
#include "obj_answer.h"

#include <string.h>

#include "service.h"

/* ---- losses ---- */

/* What the meshes and nodes of a model have, and an OBJ has no place for. */
typedef struct obj_losses {
  uint64_t parted_points;                          /* at which faces have different colours */
  uint64_t instances;                              /* of nodes whose mesh their joints have taken elsewhere */
  uint32_t clear, attributes, uvs, uv_sets, loose; /* meshes that have alpha, ... */
  uint32_t holed; /* meshes with holes at level 0, whose tags are left out, as the faces are not there */
} obj_losses;

/* *parted: points at whose corners the colours differ. */
static bool count_parted_points(const tw_mesh *mesh, const tw_attribute *colors, uint64_t *parted) {
  static const uint32_t NONE = 0, PARTED = UINT32_MAX;
  uint32_t *first = tw_alloc_zero(mesh->point_count, sizeof *first); /* 1 + the value at the first corner */
  if (!first) return false;
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    uint32_t *of_point = &first[mesh->corners[c]], value = colors->corners[c];
    size_t width = colors->width;
    if (*of_point == NONE) *of_point = value + 1;
    if (*of_point == PARTED || *of_point == value + 1) continue;
    size_t rgb = 3 * sizeof *colors->values;
    if (memcmp(colors->values + width * (*of_point - 1), colors->values + width * value, rgb) == 0) continue;
    *of_point = PARTED;
    ++*parted;
  }
  tw_free(first);
  return true;
}

static bool is_clear(const tw_mesh *mesh, const tw_attribute *colors) {
  uint32_t count = colors->corners ? colors->value_count : mesh->point_count;
  for (uint32_t v = 0; v < count; v++)
    if (colors->values[(size_t)colors->width * v + 3] < 1) return true;
  return false;
}

static bool count_losses(const tw_mesh *mesh, obj_losses *losses) {
  bool is_counted = true, has_attributes = false;
  for (uint32_t k = 0; k < mesh->attribute_count && is_counted; k++) {
    const tw_attribute *attribute = &mesh->attributes[k];
    has_attributes |= !attribute->is_color;
    if (!attribute->is_color) continue;
    losses->clear += is_clear(mesh, attribute);
    if (attribute->corners) is_counted = count_parted_points(mesh, attribute, &losses->parted_points);
  }
  losses->attributes += has_attributes;
  losses->uvs += mesh->uv_set_count > 0;
  losses->uv_sets += mesh->uv_set_count > 1;
  losses->loose += mesh->loose != NULL;
  return is_counted;
}

/* Adds to a list of what an OBJ is without. */
static void list(tw_text *text, uint64_t count, const char *before, const char *behind) {
  if (count == 0) return;
  if (text->size > 0) tw_text_add(text, ", ");
  tw_text_add(text, text->size > 0 ? "" : "surface.obj is without ");
  tw_text_add(text, before);
  if (!behind) return;
  tw_text_count(text, count);
  tw_text_add(text, behind);
}

api_outcome api_obj_warn_of_losses(api_call *call, const tw_scene *scene) {
  const tw_model *model = scene->model;
  obj_losses losses = {0};
  bool is_counted = true;
  for (uint32_t i = 0; i < model->mesh_count && is_counted; i++) {
    is_counted = count_losses(&model->meshes[i], &losses);
    bool is_cage = tw_surface_get_options(scene->surfaces[i])->level == 0;
    losses.holed += is_cage && model->meshes[i].hole_count > 0;
  }
  if (!is_counted) return api_fail_without_memory(call);
  for (uint32_t n = 0; n < model->node_count; n++) losses.instances += tw_node_lost_instances(model, n);
  uint32_t materials = model->assets || model->material_colors ? model->material_count : 0;
  tw_text text = {0};
  list(&text, losses.instances, "the ",
       tw_plural(losses.instances, " instance of EXT_mesh_gpu_instancing",
                 " instances of EXT_mesh_gpu_instancing"));
  list(&text, losses.holed, "the holes, creases and corners of ",
       tw_plural(losses.holed, " mesh that has holes", " meshes that have holes"));
  list(&text, losses.parted_points, "the further colours of ",
       tw_plural(losses.parted_points, " control point where faces differ (it has one a point)",
                 " control points where faces differ (it has one a point)"));
  list(&text, losses.clear, "alpha", NULL);
  list(&text, losses.attributes, "attributes of the application", NULL);
  list(&text, losses.uv_sets, "texture coordinates behind the first set", NULL);
  list(&text, losses.uvs ? tw_gltf_moved_textures(model->assets) : 0,
       "the transforms of texture coordinates (KHR_texture_transform)", NULL);
  list(&text, losses.loose, "points and lines", NULL);
  list(&text, materials, "all of ",
       tw_plural(materials, " material but its name", " materials but their names"));
  if (text.size == 0) return API_DONE;
  return api_call_warn_text(call, &text);
}

/* ---- bytes ---- */

static uint64_t line_size(const char *name) {
  enum { KEYWORD = 32 }; /* bytes; includes a made-up name */
  return KEYWORD + (name ? strlen(name) : 0);
}

/* A bound on the names of materials and groups, which repeat with each group of the surface. Stops soon after
 * `limit`. */
static uint64_t obj_names_bound(const tw_model *model, const tw_surface *surface, uint64_t limit) {
  uint64_t size = 0;
  for (uint32_t g = 0; g < tw_surface_group_count(surface) && size <= limit; g++) {
    const tw_surface_group *group = tw_surface_get_group(surface, g);
    int32_t material = tw_model_material(model, group->material);
    size += line_size(material < 0 ? NULL : model->material_names[material]);
    size += line_size(group->names == TW_NO_INDEX ? NULL : model->group_names[group->names]);
  }
  return size;
}

/* A bound on the tags: each has three numbers of at most 17 characters. */
static uint64_t obj_tags_bound(const tw_surface *surface) {
  enum { TAG = 72 };
  const tw_surface_tags *tags = tw_surface_get_tags(surface);
  return tags ? TAG * ((uint64_t)tags->crease_count + tags->sharp_point_count) : 0;
}

/* A bound on the size of an OBJ, which is known only at its end: 17 characters a number, 25 of a point far
 * from the origin, 9 of a colour, and 11 an index, of which a corner has three. Stops soon after the limit.
 */
tw_status api_obj_bound(api_call *call, const tw_scene *scene, uint64_t *size) {
  const tw_model *model = scene->model;
  uint64_t limit = call->service->limits.max_output;
  uint64_t *of_mesh = tw_arena_alloc(call->arena, model->mesh_count, sizeof *of_mesh);
  if (!of_mesh) return tw_fail(&call->fault.error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_surface *surface = scene->surfaces[i];
    uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
    of_mesh[i] = rows * (3 * 25 + 3 * 9 + 5 * 17) + tw_surface_get_counts(surface)->corners * 3 * 11 +
                 obj_names_bound(model, surface, limit) + obj_tags_bound(surface);
  }
  *size = 0;
  for (uint32_t n = 0; n < model->node_count && *size <= limit; n++) {
    enum { SUFFIX = 16 };
    const tw_node *node = &model->nodes[n];
    uint64_t times = tw_node_times_shown(model, n);
    if (times == 0) continue;
    uint64_t names = line_size(node->name) + line_size(model->meshes[node->mesh].name);
    uint64_t each = names + SUFFIX + of_mesh[node->mesh];
    *size = each > (UINT64_MAX - *size) / times ? UINT64_MAX : *size + each * times;
  }
  return TW_OK;
}
