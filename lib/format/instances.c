/* Reads the attributes of EXT_mesh_gpu_instancing: TRANSLATION and SCALE are floats, ROTATION is floats or
 * normalized integers with a sign. Attributes of applications place nothing. */
#include "instances.h"

#include <math.h>
#include <string.h>

#include "tweend/format.h"
#include "tweend/json_text.h"

enum { BYTE = 5120, SHORT = 5122 };

/* The elements with the number `value`, of the type that they must have; NULL where it is another, or none.
 */
static const tw_gltf_elements *open_attribute(const tw_model *model, const char *value, const char *type,
                                              bool may_be_small) {
  double number;
  if (!value || !tw_json_is_number(value)) return NULL;
  tw_json_number(value, &number);
  if (!(number >= 0 && number < (double)model->assets->element_count)) return NULL;
  const tw_gltf_elements *elements = &model->assets->elements[(uint32_t)number];
  bool is_small = elements->normalized && (elements->component == BYTE || elements->component == SHORT);
  bool is_known = elements->component == TW_GLTF_FLOAT || (may_be_small && is_small);
  return is_known && strcmp(elements->type, type) == 0 ? elements : NULL;
}

/* What a node says of instances; NULL where it says nothing. */
static const char *find_extension(const tw_model *model, uint32_t node) {
  const char *extensions = tw_json_member(model->nodes[node].preserved, "extensions");
  return model->assets ? tw_json_member(extensions, "EXT_mesh_gpu_instancing") : NULL;
}

bool tw_instances_are_fit(const tw_model *model, uint32_t node) {
  const char *extension = find_extension(model, node), *attributes = tw_json_member(extension, "attributes");
  uint32_t count = UINT32_MAX;
  tw_json_item item;
  if (!extension) return true;
  if (!attributes || *attributes != '{') return false;
  for (bool more = tw_json_first(attributes, &item); more;
       more = tw_json_next(tw_json_skip(item.value), &item)) {
    if (item.key_size > 0 && item.key[0] == '_') continue;
    bool is_rotation = tw_json_key_is(&item, "ROTATION");
    if (!is_rotation && !tw_json_key_is(&item, "TRANSLATION") && !tw_json_key_is(&item, "SCALE"))
      return false;
    const tw_gltf_elements *elements =
        open_attribute(model, item.value, is_rotation ? "VEC4" : "VEC3", is_rotation);
    if (!elements || (count < UINT32_MAX && elements->count != count)) return false;
    count = elements->count;
  }
  return true;
}

static void take_count(const tw_gltf_elements *elements, uint32_t *count) {
  if (elements && elements->count < *count) *count = elements->count;
}

bool tw_instances_find(const tw_model *model, uint32_t node, tw_instances *out) {
  const char *value = tw_json_member(find_extension(model, node), "attributes");
  if (!value || *value != '{') return false;
  *out = (tw_instances){.count = UINT32_MAX,
                        .translation =
                            open_attribute(model, tw_json_member(value, "TRANSLATION"), "VEC3", false),
                        .rotation = open_attribute(model, tw_json_member(value, "ROTATION"), "VEC4", true),
                        .scale = open_attribute(model, tw_json_member(value, "SCALE"), "VEC3", false)};
  take_count(out->translation, &out->count);
  take_count(out->rotation, &out->count);
  take_count(out->scale, &out->count);
  return out->count < UINT32_MAX;
}

uint64_t tw_node_times_shown(const tw_model *model, uint32_t node) {
  if (model->nodes[node].mesh == TW_NO_INDEX || model->nodes[node].is_hidden) return 0;
  tw_instances instances;
  return tw_instances_find(model, node, &instances) ? instances.count : 1;
}

uint64_t tw_node_lost_instances(const tw_model *model, uint32_t node) {
  const tw_node *n = &model->nodes[node];
  tw_instances instances;
  bool is_lost = n->mesh == TW_NO_INDEX || (n->skin != TW_NO_INDEX && model->meshes[n->mesh].skin.joints);
  return is_lost && !n->is_hidden && tw_instances_find(model, node, &instances) ? instances.count : 0;
}

/* width: at most 4. */
static void read_element(const tw_gltf_elements *elements, uint32_t index, uint32_t width, float *out) {
  const uint8_t *from = elements->bytes + (size_t)index * elements->stride;
  int8_t bytes[4];
  int16_t shorts[4];
  switch (elements->component) {
  case BYTE:
    memcpy(bytes, from, width);
    for (uint32_t i = 0; i < width; i++) out[i] = fmaxf((float)bytes[i] / INT8_MAX, -1);
    return;
  case SHORT:
    memcpy(shorts, from, width * sizeof *shorts);
    for (uint32_t i = 0; i < width; i++) out[i] = fmaxf((float)shorts[i] / INT16_MAX, -1);
    return;
  default: memcpy(out, from, width * sizeof *out);
  }
}

void tw_instances_read(const tw_instances *instances, uint32_t index, tw_trs *out) {
  *out = TW_TRS_IDENTITY;
  if (instances->translation) read_element(instances->translation, index, 3, out->translation);
  if (instances->scale) read_element(instances->scale, index, 3, out->scale);
  if (!instances->rotation) return;
  float q[4], square = 0;
  read_element(instances->rotation, index, 4, q);
  for (int i = 0; i < 4; i++) square += q[i] * q[i];
  for (int i = 0; i < 4 && square > 0; i++) out->rotation[i] = q[i] / sqrtf(square);
}

void tw_node_places(const tw_model *model, uint32_t node, const float world[16], uint32_t first,
                    uint32_t count, float (*out)[16]) {
  tw_instances instances;
  if (!tw_instances_find(model, node, &instances)) {
    for (uint32_t i = 0; i < count; i++) memcpy(out[i], world, sizeof out[i]);
    return;
  }
  for (uint32_t i = 0; i < count; i++) {
    tw_trs local;
    float matrix[16];
    tw_instances_read(&instances, first + i, &local);
    tw_trs_to_matrix(&local, matrix);
    tw_matrix_multiply(world, matrix, out[i]);
  }
}
