/* Makes packs once for all requests for the same surfaces. */
#include "packs.h"

#include "service.h"

#include <stdlib.h>

typedef struct packs_source {
  api_call *call;
  const tw_model *model;
  const api_plan *plan;
  const api_packs_query *query;
} packs_source;

static void destroy_packs(void *value) {
  api_packs *packs = value;
  for (uint32_t i = 0; i < packs->count; i++) tw_packs_destroy(packs->list[i]);
  free(packs->list);
  free(packs);
}

static size_t packs_size(const api_packs *packs) {
  size_t size = sizeof *packs + packs->count * sizeof *packs->list;
  for (uint32_t i = 0; i < packs->count; i++) size += tw_packs_size(packs->list[i]);
  return size;
}

static tw_status create_list(const packs_source *source, api_packs *packs, tw_error *error) {
  const tw_parallel_for *parallel = &source->call->service->parallel;
  const tw_surface *const *surfaces = (const tw_surface *const *)source->plan->surfaces;
  tw_grid *grids = tw_alloc(source->plan->count, sizeof *grids);
  packs->list = tw_alloc_zero(source->plan->count, sizeof *packs->list);
  tw_status status = grids && packs->list ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK) status = tw_grids_choose(source->model, surfaces, parallel, grids);
  if (status != TW_OK)
    tw_fail(error, status,
            status == TW_CANCELLED ? "the packs are not wanted any more"
                                   : "no memory for the packs of a model");
  for (uint32_t i = 0; status == TW_OK && i < source->plan->count; i++) {
    const tw_pack_options options = {source->query->encoding, source->query->polygons, grids[i],
                                     source->query->is_measured};
    status =
        tw_packs_create(&source->model->meshes[i], surfaces[i], &options, parallel, &packs->list[i], error);
    packs->count += status == TW_OK;
  }
  free(grids);
  return status;
}

static bool build_packs(void *context, api_built *out, api_fault *fault) {
  const packs_source *source = context;
  api_packs *packs = tw_alloc_zero(1, sizeof *packs);
  if (!packs) return api_fault_without_memory(fault);
  if (create_list(source, packs, &fault->error) != TW_OK) {
    destroy_packs(packs);
    return api_fault_complete(fault);
  }
  *out = (api_built){packs, packs_size(packs), destroy_packs, API_CACHED_PLAN};
  return true;
}

/* Unmeasured packs are others. NULL without memory. */
static const char *make_key(api_call *call, const api_packs_query *query, const char *key) {
  tw_text text = {0};
  tw_text_add(&text, key);
  tw_text_add(&text, query->is_measured ? "&measured" : "");
  return api_text_move(&text, call->arena);
}

api_outcome api_packs_take(api_call *call, const tw_model *model, const api_plan *plan,
                           const api_packs_query *query, const char *key, api_entry **out) {
  packs_source source = {call, model, plan, query};
  const char *kept = key ? make_key(call, query, key) : NULL;
  if (key && !kept) return api_fail_without_memory(call);
  return api_call_take(call, kept, build_packs, &source, out);
}

api_entry *api_packs_peek(api_call *call, const api_packs_query *query, const char *key) {
  const char *kept = key ? make_key(call, query, key) : NULL;
  return kept ? api_cache_peek(call->service->cache, kept) : NULL;
}

size_t api_packs_reading_size(const api_packs *packs) {
  size_t most = 0;
  for (uint32_t i = 0; i < packs->count; i++) {
    size_t size = tw_packs_reading_size(packs->list[i]);
    if (size > most) most = size;
  }
  return most;
}
