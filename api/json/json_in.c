/* tweend JSON: the document, its nodes, and names that refer to each other. */
#include "json_in.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- names ----------------------------------------------------------------------------------- */

static int compare_names(const void *a, const void *b) {
  const api_name *left = a, *right = b;
  int order = strcmp(left->name, right->name);
  if (order != 0) return order;
  return left->index < right->index ? -1 : left->index > right->index;
}

tw_status api_names_sort(const api_json *json, const char *const *names, uint32_t count, api_names *out) {
  api_name *sorted = tw_arena_alloc(json->arena, count, sizeof *sorted);
  if (!sorted) return api_json_no_memory(json);
  for (uint32_t i = 0; i < count; i++) sorted[i] = (api_name){names[i], i};
  if (count > 0) qsort(sorted, count, sizeof *sorted, compare_names);
  *out = (api_names){count, sorted};
  return TW_OK;
}

tw_status api_json_reference(const api_json *json, const api_place *at, const cJSON *item,
                             const api_names *names, const char *kind, uint32_t *out) {
  if (!cJSON_IsString(item)) return api_json_fail(json, at, TW_SYNTAX, "the name of a %s is expected", kind);
  const char *name = item->valuestring;
  uint32_t low = 0, high = names->count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (strcmp(names->sorted[middle].name, name) < 0)
      low = middle + 1;
    else
      high = middle;
  }
  if (low == names->count || strcmp(names->sorted[low].name, name) != 0)
    return api_json_fail(json, at, TW_INVALID, "no %s is called \"%.60s\"", kind, name);
  if (low + 1 < names->count && strcmp(names->sorted[low + 1].name, name) == 0)
    return api_json_fail(json, at, TW_INVALID, "more than one %s is called \"%.60s\"", kind, name);
  *out = names->sorted[low].index;
  return TW_OK;
}

/* Reads the names of an array's objects as others may refer to them: one without a name is called
 * kind_index. Whatever else is wrong with an element is for its own reader to say. */
static tw_status read_names(const api_json *json, const cJSON *array, uint32_t count, const char *kind,
                            api_names *out) {
  const char **names = tw_arena_alloc(json->arena, count, sizeof *names);
  if (!names) return api_json_no_memory(json);
  uint32_t i = 0;
  for (const cJSON *child = array ? array->child : NULL; child; child = child->next, i++) {
    const cJSON *name = cJSON_IsObject(child) ? cJSON_GetObjectItemCaseSensitive(child, "name") : NULL;
    char made_up[32];
    snprintf(made_up, sizeof made_up, "%s_%u", kind, i);
    const char *given = cJSON_GetStringValue(name);
    const char *text = given && given[0] ? given : made_up;
    names[i] = tw_arena_text(json->arena, text, strlen(text));
    if (!names[i]) return api_json_no_memory(json);
  }
  return api_names_sort(json, names, count, out);
}

/* ---- nodes ----------------------------------------------------------------------------------- */

static tw_status read_node(const api_json *json, const api_place *at, const cJSON *item,
                           const api_names *meshes, const api_names *nodes, tw_node *out) {
  enum { NAME, PARENT, MESH, TRANSLATION, ROTATION, SCALE, MEMBERS };
  static const char *const names[] = {"name", "parent", "mesh", "translation", "rotation", "scale", NULL};
  const cJSON *values[MEMBERS];
  *out = (tw_node){.parent = TW_NO_INDEX, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
  tw_status status = api_json_members(json, at, item, names, values);
  api_place places[MEMBERS];
  for (int i = 0; i < MEMBERS; i++) places[i] = (api_place){at, names[i], 0};
  if (status == TW_OK) status = api_json_text(json, &places[NAME], values[NAME], &out->name);
  if (status == TW_OK && values[PARENT])
    status = api_json_reference(json, &places[PARENT], values[PARENT], nodes, "node", &out->parent);
  if (status == TW_OK && values[MESH])
    status = api_json_reference(json, &places[MESH], values[MESH], meshes, "mesh", &out->mesh);
  if (status == TW_OK && values[TRANSLATION])
    status = api_json_floats(json, &places[TRANSLATION], values[TRANSLATION], 3, out->rest.translation);
  if (status == TW_OK && values[ROTATION])
    status = api_json_floats(json, &places[ROTATION], values[ROTATION], 4, out->rest.rotation);
  if (status == TW_OK && values[SCALE])
    status = api_json_floats(json, &places[SCALE], values[SCALE], 3, out->rest.scale);
  return status;
}

/* ---- document -------------------------------------------------------------------------------- */

enum { MESHES, NODES, CLIPS, DOCUMENT_MEMBERS };
static const char *const document_members[] = {"meshes", "nodes", "clips", NULL};

typedef struct document {
  const cJSON *values[DOCUMENT_MEMBERS];
  api_place places[DOCUMENT_MEMBERS];
  api_names meshes, nodes;
} document;

static tw_status read_meshes(const api_json *json, const document *doc, tw_model *model) {
  model->meshes = tw_arena_alloc(json->arena, model->mesh_count, sizeof *model->meshes);
  if (!model->meshes) return api_json_no_memory(json);
  uint32_t i = 0;
  for (const cJSON *item = model->mesh_count ? doc->values[MESHES]->child : NULL; item;
       item = item->next, i++) {
    api_place place = {&doc->places[MESHES], NULL, i};
    tw_status status = api_mesh_from_json(json, &place, item, &model->meshes[i]);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

static tw_status read_nodes(const api_json *json, const document *doc, tw_model *model) {
  model->nodes = tw_arena_alloc(json->arena, model->node_count, sizeof *model->nodes);
  if (!model->nodes) return api_json_no_memory(json);
  uint32_t i = 0;
  for (const cJSON *item = model->node_count ? doc->values[NODES]->child : NULL; item;
       item = item->next, i++) {
    api_place place = {&doc->places[NODES], NULL, i};
    tw_status status = read_node(json, &place, item, &doc->meshes, &doc->nodes, &model->nodes[i]);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

static tw_status read_clips(const api_json *json, const document *doc, tw_model *model) {
  model->clips = tw_arena_alloc(json->arena, model->clip_count, sizeof *model->clips);
  if (!model->clips) return api_json_no_memory(json);
  uint32_t i = 0;
  for (const cJSON *item = model->clip_count ? doc->values[CLIPS]->child : NULL; item;
       item = item->next, i++) {
    api_place place = {&doc->places[CLIPS], NULL, i};
    tw_status status = api_clip_from_json(json, &place, item, &doc->nodes, &model->clips[i]);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

static tw_status read_document(const api_json *json, const cJSON *tree, tw_model *model) {
  document doc;
  uint32_t *const counts[] = {&model->mesh_count, &model->node_count, &model->clip_count};
  tw_status status = api_json_members(json, NULL, tree, document_members, doc.values);
  for (int i = 0; i < DOCUMENT_MEMBERS && status == TW_OK; i++) {
    doc.places[i] = (api_place){NULL, document_members[i], 0};
    status = api_json_array(json, &doc.places[i], doc.values[i], counts[i]);
  }
  if (status == TW_OK) status = read_names(json, doc.values[MESHES], model->mesh_count, "mesh", &doc.meshes);
  if (status == TW_OK) status = read_names(json, doc.values[NODES], model->node_count, "node", &doc.nodes);
  if (status == TW_OK && model->node_count == 0) {
    /* The nodes that tw_model_finish makes are called like their meshes. */
    status = read_names(json, doc.values[MESHES], model->mesh_count, "node", &doc.nodes);
  }
  if (status == TW_OK) status = read_meshes(json, &doc, model);
  if (status == TW_OK) status = read_nodes(json, &doc, model);
  if (status == TW_OK) status = read_clips(json, &doc, model);
  return status;
}

tw_status api_model_from_json(const char *text, size_t size, tw_model **out, tw_error *error) {
  cJSON *tree = NULL;
  tw_status status = api_json_parse(text, size, API_JSON_VALUES_MAX, &tree, error);
  if (status != TW_OK) return status;
  tw_model *model = tw_model_create();
  if (!model) {
    cJSON_Delete(tree);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  model->format = TW_FORMAT_JSON;
  api_json json = {model->arena, error};
  status = read_document(&json, tree, model);
  cJSON_Delete(tree); /* before the checks: the tree is the larger part of the memory */
  if (status == TW_OK) status = tw_model_finish(model, error);
  if (status != TW_OK) {
    tw_model_destroy(model);
    return status;
  }
  *out = model;
  return TW_OK;
}
