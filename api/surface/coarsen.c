/* POST /v1/models/{id}/coarsen: makes a new model by replacing a refined mesh of a stored one by its cage. */
#include "tweend/coarsen.h"
#include "handlers.h"
#include "plans.h"
#include "remade.h"
#include "service.h"

#include <string.h>

static tw_status read_levels(const api_query *query, uint32_t *out, tw_error *error) {
  const char *text = api_query_get(query, "levels");
  uint64_t levels = TW_LEVEL_MAX;
  tw_status status =
      text && strcmp(text, "max") != 0 ? api_query_count(query, "levels", &levels, NULL) : TW_OK;
  if (status != TW_OK || levels < 1 || levels > TW_LEVEL_MAX)
    return tw_fail(error, TW_SYNTAX, "levels=%.60s: expected max, or 1 to %d", text, TW_LEVEL_MAX);
  *out = (uint32_t)levels;
  return TW_OK;
}

/* Finds the cage and checks it: of the mesh as it is tagged, else with the hard edges that the file shows,
 * which a refined mesh has where its cage had creases. */
static tw_status find_cage(const api_remade *remade, const tw_surface_options *options, tw_coarsened *found,
                           tw_error *error) {
  const tw_mesh *mesh = &remade->model->meshes[remade->mesh];
  const tw_parallel_for *parallel = &remade->call->service->parallel;
  tw_status status = tw_mesh_coarsen(mesh, options, parallel, remade->call->arena, found, error);
  bool is_shown = remade->source.crease_count > mesh->crease_count;
  if (status == TW_INVALID && is_shown)
    status = tw_mesh_coarsen(&remade->source, options, parallel, remade->call->arena, found, error);
  if (status != TW_OK) return status;
  return tw_mesh_check(&found->mesh, error, NULL);
}

static void print_levels(void *context, tw_text *out) {
  const tw_coarsened *found = context;
  tw_member_count(out, "levels", found->levels);
}

static api_outcome coarsen(api_remade *remade) {
  api_call *call = remade->call;
  tw_error *error = &call->fault.error;
  api_surface_query query;
  uint32_t levels = 0;
  if (api_surface_query_read(call, &query) != API_DONE) return API_FAILED;
  tw_status status = read_levels(&call->query, &levels, error);
  if (status == TW_OK) status = api_remade_choose(remade, api_query_get(&call->query, "mesh"), error);
  if (status != TW_OK) return api_fail(call);
  const tw_mesh *mesh = &remade->model->meshes[remade->mesh];
  query.level = levels;
  query.normals = API_NORMALS_NONE;
  const tw_surface_options options = api_surface_options(&query, 0, mesh);
  tw_coarsened found;
  if (find_cage(remade, &options, &found, error) != TW_OK) return api_fail(call);
  if (mesh->detail_count > 0) {
    static const char *const lost = "what was modelled onto the levels of the mesh is left out";
    api_call_warn(call, &lost, 1);
  }
  if (found.is_ambiguous) {
    static const char *const ambiguous =
        "points where three edges meet may have alternated about the cage's: that vanishes in one step";
    api_call_warn(call, &ambiguous, 1);
  }
  remade->cage = found.mesh;
  const api_addition told = {print_levels, &found};
  return api_remade_store(remade, &told);
}

api_outcome api_post_coarsen(api_call *call) {
  return api_remade_answer(call, coarsen);
}
