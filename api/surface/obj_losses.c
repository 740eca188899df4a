/* OBJ has points with a colour each, one set of texture coordinates, and names of materials. */
#include "obj_losses.h"

#include <string.h>

#include "tweend/format.h"

/* What the meshes and nodes of a model have, and an OBJ has no place for. */
typedef struct obj_losses {
  uint64_t parted_points; /* at which faces have different colours */
  uint64_t instances;
  uint32_t clear, attributes, uv_sets, loose; /* meshes that have alpha, ... */
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

api_outcome api_obj_losses_warn(api_call *call, const tw_model *model) {
  obj_losses losses = {0};
  bool is_counted = true;
  for (uint32_t i = 0; i < model->mesh_count && is_counted; i++)
    is_counted = count_losses(&model->meshes[i], &losses);
  if (!is_counted) return api_fail_without_memory(call);
  for (uint32_t n = 0; n < model->node_count; n++)
    if (!model->nodes[n].is_hidden) losses.instances += tw_gltf_instance_count(model, n);
  uint32_t materials = model->assets || model->material_colors ? model->material_count : 0;
  tw_text text = {0};
  list(&text, losses.instances, "the ", " instances of EXT_mesh_gpu_instancing");
  list(&text, losses.parted_points, "the further colours of ",
       " control points where faces differ (it has one a point)");
  list(&text, losses.clear, "alpha", NULL);
  list(&text, losses.attributes, "attributes of the application", NULL);
  list(&text, losses.uv_sets, "texture coordinates behind the first set", NULL);
  list(&text, losses.loose, "points and lines", NULL);
  list(&text, materials, "all of ", " materials but their names");
  if (text.size == 0) return API_DONE;
  return api_call_warn_text(call, &text);
}
