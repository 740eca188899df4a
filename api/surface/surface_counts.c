/* surface.json: what an answer would have, without computing it. */
#include "baked.h"
#include "printability.h"

#include <math.h>

void api_surface_print_counts(tw_text *text, uint64_t level, const tw_surface_counts *counts,
                              uint64_t bytes) {
  tw_member_count(text, "level", level);
  tw_member_count(text, "vertices", counts->vertices);
  tw_member_count(text, "edges", counts->edges);
  tw_member_count(text, "faces", counts->faces);
  if (bytes == API_SIZE_UNKNOWN)
    tw_text_add(text, ",\"bytes\":null");
  else
    tw_member_count(text, "bytes", bytes);
}

void api_surface_print_error(tw_text *text, double error) {
  tw_text_add(text, ",\"error\":");
  if (isfinite(error))
    tw_text_double(text, error);
  else
    tw_text_add(text, "null");
}

const tw_scene *api_scene_of_mesh(const api_surface_request *request, uint32_t mesh, tw_arena *arena) {
  typedef struct lone_mesh {
    tw_scene scene;
    tw_model model;
    tw_node node;
    uint32_t order;
  } lone_mesh;
  const tw_scene *all = &request->scene.content;
  lone_mesh *lone = tw_arena_alloc(arena, 1, sizeof *lone);
  if (!lone) return NULL;
  lone->node = (tw_node){.parent = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
  lone->model = (tw_model){.format = TW_FORMAT_JSON,
                           .mesh_count = 1,
                           .meshes = &all->model->meshes[mesh],
                           .group_count = all->model->group_count,
                           .group_names = all->model->group_names,
                           .node_count = 1,
                           .nodes = &lone->node,
                           .node_order = &lone->order};
  lone->scene = (tw_scene){.model = &lone->model,
                           .surfaces = all->surfaces + mesh,
                           .polygons = (tw_polygons)request->query.polygons,
                           .packs = all->packs ? all->packs + mesh : NULL,
                           .is_without_details = all->is_without_details};
  return &lone->scene;
}

tw_flat_options api_surface_flat_options(const api_surface_request *request, tw_flat_form form) {
  const api_flat_query *flat = &request->query.flat;
  return (tw_flat_options){.form = form, .scale = api_flat_scale(flat), .unit = flat->unit->name};
}

/* Whether holes of the model are faces of the surface. */
static bool shows_holes(const api_surface_request *request) {
  const tw_model *model = request->scene.content.model;
  uint32_t mesh = 0;
  while (mesh < model->mesh_count && model->meshes[mesh].hole_count == 0) mesh++;
  return request->query.with_holes && mesh < model->mesh_count;
}

/* Whether there is an answer as STL or PLY, whose size follows from what is counted here. They have no holes,
 * and are baked: then level=auto chooses their levels by the moved meshes, and PLY's head tells where these
 * are moved from. */
static bool is_flat_known(const api_surface_request *request, tw_flat_form form) {
  bool moves = request->query.skin != API_SKIN_BAKE && api_bakes(request->scene.content.model);
  if (!api_surface_has_still(&request->query)) return false;
  return !shows_holes(request) && !(moves && (request->query.auto_level.is_on || form == TW_FLAT_PLY));
}

/* Prints the size of surface.bin with the positions of the only mesh. */
static tw_status print_points(api_call *call, const api_surface_request *request, tw_text *text) {
  const tw_flat_options options = {.form = TW_FLAT_POINTS, .scale = 1};
  const tw_scene *alone = api_scene_of_mesh(request, 0, call->arena);
  uint64_t size;
  if (!alone) return tw_fail(&call->fault.error, TW_NO_MEMORY, "out of memory");
  tw_status status = tw_flat_stream_predict(alone, &options, &size, &call->fault.error);
  if (status == TW_OK) tw_member_count(text, "bin", size);
  return status == TW_LIMIT ? TW_OK : status;
}

/* Prints the size of each form that has a size before it is streamed, and whose size is within the limits. */
static tw_status print_forms(api_call *call, const api_surface_request *request, uint64_t glb,
                             tw_text *text) {
  static const char *const flat[] = {[TW_FLAT_STL] = "stl", [TW_FLAT_PLY] = "ply"};
  const tw_scene *scene = &request->scene.content;
  uint64_t size = 0;
  tw_status status = TW_OK;
  tw_member_open(text, "forms", "{");
  tw_member_count(text, "glb", glb);
  if (request->query.encoding == TW_ENCODING_FLOAT) {
    status = tw_gltf_stream_predict(scene, TW_FORMAT_GLTF, &size, &call->fault.error);
    if (status == TW_OK) tw_member_count(text, "gltf", size);
  }
  for (int form = TW_FLAT_STL; form <= TW_FLAT_PLY; form++) {
    if (!is_flat_known(request, (tw_flat_form)form)) continue;
    if (status != TW_OK && status != TW_LIMIT) return status;
    const tw_flat_options options = api_surface_flat_options(request, (tw_flat_form)form);
    status = tw_flat_stream_predict(scene, &options, &size, &call->fault.error);
    if (status == TW_OK) tw_member_count(text, flat[form], size);
  }
  if (status == TW_LIMIT) status = TW_OK;
  bool has_points = scene->model->mesh_count == 1 && request->query.has_points;
  if (status == TW_OK && has_points) status = print_points(call, request, text);
  tw_text_add(text, "}");
  return status;
}

/* Prints a mesh's element of "meshes". */
static tw_status print_mesh(api_call *call, const api_surface_request *request, uint32_t mesh,
                            tw_text *text) {
  const tw_surface *surface = api_plan_of(request)->surfaces[mesh];
  const api_auto_level *chosen = &request->query.auto_level;
  uint64_t size;
  const tw_scene *alone = api_scene_of_mesh(request, mesh, call->arena);
  if (!alone) return tw_fail(&call->fault.error, TW_NO_MEMORY, "out of memory");
  tw_status status = tw_gltf_stream_predict(alone, TW_FORMAT_GLB, &size, &call->fault.error);
  if (status != TW_OK) return status;
  tw_text_element(text);
  tw_text_add(text, "{");
  tw_member_string(text, "name", request->scene.content.model->meshes[mesh].name);
  api_surface_print_counts(text, tw_surface_get_options(surface)->level, tw_surface_get_counts(surface),
                           size);
  if (chosen->errors) api_surface_print_error(text, chosen->errors[mesh]);
  if (request->query.with_shells) status = api_print_shells(call, request, mesh, text);
  tw_text_add(text, "}");
  return status;
}

api_outcome api_surface_reply_counts(api_call *call, const api_surface_request *request, uint64_t bytes) {
  const api_plan *plan = api_plan_of(request);
  tw_text text = {0};
  tw_text_add(&text, "{");
  api_surface_print_counts(&text, request->query.level, &plan->total, bytes);
  if (request->query.auto_level.errors) api_surface_print_error(&text, request->query.auto_level.reached);
  tw_status status = print_forms(call, request, bytes, &text);
  if (status == TW_OK && request->query.with_shells) status = api_print_solid(call, request, &text);
  tw_member_open(&text, "meshes", "[");
  for (uint32_t i = 0; i < plan->count && status == TW_OK; i++) status = print_mesh(call, request, i, &text);
  tw_text_add(&text, "]}\n");
  if (status == TW_OK) return api_reply(call, &text);
  tw_text_deinit(&text);
  return api_fail(call);
}
