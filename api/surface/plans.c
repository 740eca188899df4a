/* Builds plans. Limits are checked before anything is built: by a bound where that suffices, else on exact
 * counts. */
#include "plans.h"

#include "service.h"

#include <stdlib.h>
#include <string.h>

static int choose(int asked, int tagged, int fallback) {
  return asked >= 0 ? asked : tagged >= 0 ? tagged : fallback;
}

static uint64_t level_of(const api_surface_query *query, uint32_t index) {
  return query->auto_level.levels ? query->auto_level.levels[index] : query->level;
}

tw_surface_options api_surface_options(const api_surface_query *query, uint32_t index, const tw_mesh *mesh) {
  uint64_t level = level_of(query, index);
  return (tw_surface_options){
      .level = level < UINT32_MAX ? (uint32_t)level : UINT32_MAX,
      .scheme = (tw_scheme)query->scheme,
      .boundary = (tw_boundary)choose(query->boundary, mesh->tag_boundary, TW_BOUNDARY_EDGE_AND_CORNER),
      .uv = (tw_uv_rule)choose(query->uv, mesh->tag_uv, TW_UV_CORNERS_ONLY),
      .creasing = (tw_creasing)choose(query->creasing, mesh->tag_creasing, TW_CREASE_UNIFORM),
      .triangles = (tw_triangles)choose(query->triangles, mesh->tag_triangles, TW_TRIANGLES_CATMULL_CLARK),
      .limit = query->limit,
      .normals = query->normals != API_NORMALS_NONE,
      .own_normals = query->own_normals,
      .tagged = query->tagged,
      .influences = (uint32_t)query->influences,
  };
}

void api_surface_settle(api_surface_query *query, const tw_model *model) {
  api_surface_query silent = *query;
  silent.boundary = silent.uv = silent.creasing = silent.triangles = -1;
  bool boundary = true, uv = true, creasing = true, triangles = true; /* asking for it changes nothing */
  bool influences = true, details = true;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_surface_options asked = api_surface_options(query, 0, &model->meshes[i]),
                       own = api_surface_options(&silent, 0, &model->meshes[i]);
    boundary = boundary && asked.boundary == own.boundary;
    uv = uv && asked.uv == own.uv;
    creasing = creasing && asked.creasing == own.creasing;
    triangles = triangles && asked.triangles == own.triangles;
    details = details && model->meshes[i].detail_count == 0;
    if (query->influences > 0)
      influences = influences && tw_surface_influences(&model->meshes[i], (uint32_t)query->influences) ==
                                     tw_surface_influences(&model->meshes[i], 0);
  }
  if (boundary) query->boundary = -1;
  if (uv) query->uv = -1;
  if (creasing) query->creasing = -1;
  if (triangles) query->triangles = -1;
  if (influences) query->influences = 0;
  if (details) query->details = true;
  const char *only = model->mesh_count == 1 ? model->meshes[0].name : NULL;
  if (query->mesh && only && strcmp(query->mesh, only) == 0) query->mesh = NULL;
  query->reading.quads = tw_quads_of(query->reading.quads, model->format);
}

/* ---- limits ---------------------------------------------------------------------------------- */

typedef struct plan_source {
  api_call *call;
  const api_plan_meshes *meshes;
  const api_surface_query *query;
} plan_source;

/* Adds value * times; saturates at half of UINT64_MAX, far over every limit. */
static void add_times(uint64_t *sum, uint64_t value, uint32_t times) {
  uint64_t room = UINT64_MAX / 2 - *sum;
  *sum = times > 0 && value > room / times ? UINT64_MAX / 2 : *sum + value * times;
}

static void add_counts(tw_surface_counts *total, const tw_surface_counts *more, uint32_t times) {
  add_times(&total->vertices, more->vertices, times);
  add_times(&total->edges, more->edges, times);
  add_times(&total->faces, more->faces, times);
  add_times(&total->corners, more->corners, times);
}

api_plan_meshes api_plan_all(const tw_model *model) {
  return (api_plan_meshes){
      .count = model->mesh_count, .meshes = model->meshes, .still_count = model->mesh_count};
}

/* Counts all meshes exactly. TW_LIMIT if a count of a mesh is over 32 bits; the counts are complete all the
 * same. */
static tw_status count_all(const plan_source *source, tw_surface_counts *total, tw_error *error) {
  tw_status result = TW_OK;
  *total = (tw_surface_counts){0};
  const api_plan_meshes *all = source->meshes;
  for (uint32_t i = 0; i < all->count; i++) {
    tw_surface_options options = api_surface_options(source->query, i, &all->meshes[i]);
    tw_surface_counts counts = {0};
    tw_status status = tw_surface_count(&all->meshes[i], &options, &counts, error);
    if (status != TW_OK && status != TW_LIMIT) return status;
    if (status == TW_LIMIT) result = status;
    add_counts(total, &counts, all->uses ? all->uses[i] : 1);
  }
  return result;
}

/* Whether a bound shows that no limit is reached, so that counting is unnecessary: level 1 of a mesh has at
 * most as many faces as the mesh has corners and faces together, each further level four times as many. */
static bool is_surely_within(const plan_source *source) {
  uint64_t level = source->query->level;
  if (level > source->call->service->limits.max_level || level > TW_LEVEL_MAX) return false;
  const api_plan_meshes *all = source->meshes;
  uint64_t most = 0;
  for (uint32_t i = 0; i < all->count; i++) {
    uint64_t first = (uint64_t)all->meshes[i].corner_count + all->meshes[i].face_count,
             own = level_of(source->query, i);
    add_times(&most, first << 2 * (own > 0 ? own - 1 : 0), all->uses ? all->uses[i] : 1);
  }
  return most <= source->call->service->limits.max_faces;
}

tw_status api_plan_check(api_call *call, uint64_t level, const tw_surface_counts *counts, tw_status status) {
  const api_limits *limits = &call->service->limits;
  tw_error *error = &call->fault.error;
  if (status != TW_OK && status != TW_LIMIT) return status;
  if (level > limits->max_level)
    status = tw_fail(error, TW_LIMIT, "level=%llu is over the limit of %u", (unsigned long long)level,
                     limits->max_level);
  else if (counts->faces > limits->max_faces)
    status = tw_fail(error, TW_LIMIT, "the surface would have %llu faces, over the limit of %llu",
                     (unsigned long long)counts->faces, (unsigned long long)limits->max_faces);
  call->fault.is_predicted = status == TW_LIMIT && counts->faces > 0;
  call->fault.predicted = *counts;
  return status;
}

/* Counts first, so that the error tells the counts. */
static tw_status count_and_check(const plan_source *source) {
  tw_surface_counts total;
  tw_status status = count_all(source, &total, &source->call->fault.error);
  return api_plan_check(source->call, source->query->level, &total, status);
}

tw_status api_plan_count(api_call *call, const api_plan_meshes *meshes, const api_surface_query *query,
                         tw_surface_counts *total) {
  const plan_source source = {call, meshes, query};
  return count_all(&source, total, &call->fault.error);
}

tw_status api_plan_admit(api_call *call, const api_plan_meshes *meshes, const api_surface_query *query) {
  const plan_source source = {call, meshes, query};
  return is_surely_within(&source) ? TW_OK : count_and_check(&source);
}

/* ---- building -------------------------------------------------------------------------------- */

static void destroy_plan(void *value) {
  api_plan *plan = value;
  for (uint32_t i = 0; i < plan->count; i++)
    if (!plan->borrows || !plan->borrows[i]) tw_surface_destroy(plan->surfaces[i]);
  tw_patch_classes_destroy(plan->classes);
  free(plan->surfaces);
  free(plan->borrows);
  tw_free(plan->solids);
  api_entry_release(plan->source);
  free(plan);
}

static size_t plan_size(const api_plan *plan) {
  size_t size = sizeof *plan + plan->count * (sizeof(void *) + sizeof *plan->solids);
  for (uint32_t i = 0; i < plan->count; i++)
    if (!plan->borrows || !plan->borrows[i]) size += tw_surface_size(plan->surfaces[i]);
  if (plan->classes) size += tw_patch_classes_size(plan->classes);
  return size;
}

tw_status api_plan_cage(const api_surface_query *query, const tw_mesh *mesh, tw_arena *scratch, tw_mesh *out,
                        api_hard *hard, tw_error *error) {
  tw_status status = tw_mesh_with_creases(
      mesh, query->creases, query->crease_degrees, query->crease_sharpness,
      api_surface_options(query, 0, mesh).boundary == TW_BOUNDARY_EDGE_AND_CORNER, scratch, out, error);
  if (status == TW_OK && query->creases == TW_CREASES_FILE) {
    hard->edges += out->crease_count - mesh->crease_count;
    hard->corners += out->sharp_point_count - mesh->sharp_point_count;
  }
  if (status == TW_OK && query->with_holes) {
    const tw_mesh closed = *out;
    if (tw_mesh_open_holes(&closed, scratch, out) != TW_OK)
      status = tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  if (status == TW_OK && (!query->details || query->with_holes)) out->detail_count = 0;
  return status;
}

static tw_status create_surface(const plan_source *source, api_plan *plan, tw_arena *scratch,
                                tw_error *error) {
  tw_mesh mesh;
  tw_status status =
      api_plan_cage(source->query, &source->meshes->meshes[plan->count], scratch, &mesh, &plan->hard, error);
  if (status != TW_OK) return status;
  tw_surface_options options = api_surface_options(source->query, plan->count, &mesh);
  options.movable = plan->count >= source->meshes->still_count;
  options.classes = plan->classes;
  return tw_surface_create_by(&mesh, &options, &source->call->service->parallel, &plan->surfaces[plan->count],
                              error);
}

static tw_status create_surfaces(const plan_source *source, api_plan *plan) {
  const api_plan_meshes *all = source->meshes;
  tw_error *error = &source->call->fault.error;
  plan->surfaces = tw_alloc_zero(all->count, sizeof(tw_surface *));
  plan->classes = tw_patch_classes_create();
  plan->solids = tw_alloc_zero(all->count, sizeof *plan->solids);
  if (!plan->surfaces || !plan->classes || !plan->solids)
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_arena *scratch = tw_arena_create(); /* holds the creases until their surface is made */
  if (!scratch) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status = TW_OK;
  for (; plan->count < all->count && status == TW_OK; plan->count += status == TW_OK)
    status = create_surface(source, plan, scratch, error);
  tw_arena_destroy(scratch);
  return status;
}

/* NULL: the fault's error or stall says why. */
static api_plan *create_plan(const plan_source *source) {
  api_plan *plan = tw_alloc_zero(1, sizeof *plan);
  if (!plan) {
    tw_fail(&source->call->fault.error, TW_NO_MEMORY, "out of memory");
    return NULL;
  }
  atomic_init(&plan->is_warm, false);
  for (int i = 0; i <= TW_POLYGONS_NGON; i++) atomic_init(&plan->changes[i], 0);
  atomic_init(&plan->shells, API_SHELLS_UNKNOWN);
  if (create_surfaces(source, plan) != TW_OK) {
    destroy_plan(plan);
    return NULL;
  }
  for (uint32_t i = 0; i < plan->count; i++)
    add_counts(&plan->total, tw_surface_get_counts(plan->surfaces[i]),
               source->meshes->uses ? source->meshes->uses[i] : 1);
  return plan;
}

/* Nothing is built over a limit. A refusal tells the counts, also that of a plan that takes too much memory.
 */
static api_plan *count_and_create(const plan_source *source) {
  api_fault *fault = &source->call->fault;
  tw_surface_counts total;
  tw_status status = count_all(source, &total, &fault->error);
  status = api_plan_check(source->call, source->query->level, &total, status);
  api_plan *plan = status == TW_OK ? create_plan(source) : NULL;
  bool is_too_large = fault->error.status == TW_LIMIT || fault->error.status == TW_NO_MEMORY;
  fault->is_predicted |= !plan && is_too_large && total.faces > 0;
  if (!plan && fault->stall == API_STALL_NONE) api_fault_complete(fault);
  return plan;
}

uint64_t api_surface_bound(const tw_mesh *mesh, uint64_t level) {
  /* Bytes a corner by level, the largest measured for cages of triangles and of quads. Levels deeper than 3
   * take no more, as they are computed while they are read. Nor do so many values that patches compute
   * them. */
  static const uint64_t per_corner[] = {64, 112, 368, 656};
  enum { VALUES = 256, VALUES_MOST = 192 << 20 };
  uint64_t corners = mesh->corner_count, sets = (uint64_t)mesh->uv_set_count + mesh->attribute_count +
                                                mesh->morph_count + (mesh->skin.joints ? 1 : 0);
  if (mesh->detail_count > 0) corners += mesh->details[mesh->detail_count - 1].vertex_count;
  uint64_t values = VALUES * sets * corners;
  return corners * per_corner[level < 3 ? level : 3] + (values < VALUES_MOST ? values : VALUES_MOST);
}

static uint64_t bound_plan(const plan_source *source) {
  uint64_t bytes = 0;
  for (uint32_t i = 0; i < source->meshes->count; i++)
    bytes += api_surface_bound(&source->meshes->meshes[i], level_of(source->query, i));
  return bytes;
}

/* fault: the call's. */
static bool build_plan(void *context, api_built *out, api_fault *fault) {
  const plan_source *source = context;
  if (!api_grant(source->call, bound_plan(source))) return false;
  api_plan *plan = is_surely_within(source) ? create_plan(source) : NULL;
  if (!plan && fault->stall == API_STALL_NONE) plan = count_and_create(source);
  if (!plan) return false;
  *out = (api_built){plan, plan_size(plan), destroy_plan, API_CACHED_PLAN};
  return true;
}

/* Takes the plan of the meshes where they are: cached for a stored model, else of this request alone. */
static api_outcome take_source(api_call *call, const api_plan_meshes *meshes, bool is_stored,
                               const api_surface_query *query, api_entry **out) {
  plan_source source = {call, meshes, query};
  const char *head = meshes->uses ? "/surface?skin=bake" : "/surface?";
  const char *key = api_surface_key_print(call, query, API_KEY_PLAN, head);
  if (!key) return api_fail_without_memory(call);
  return api_call_take(call, is_stored ? key : NULL, build_plan, &source, out);
}

/* ---- moving ---------------------------------------------------------------------------------- */

static tw_status move_surfaces(const api_plan *source, const api_plan_moves *moves,
                               const tw_parallel_for *parallel, api_plan *plan) {
  plan->surfaces = tw_alloc_zero(moves->count, sizeof(tw_surface *));
  plan->borrows = tw_alloc_zero(moves->count, sizeof *plan->borrows);
  plan->solids = tw_alloc_zero(moves->count, sizeof *plan->solids);
  if (!plan->surfaces || !plan->borrows || !plan->solids) return TW_NO_MEMORY;
  for (; plan->count < moves->count; plan->count++) {
    uint32_t i = plan->count;
    tw_surface *surface = source->surfaces[moves->of[i]];
    plan->borrows[i] = !moves->positions[i];
    plan->surfaces[i] = surface;
    if (plan->borrows[i]) continue;
    tw_status status =
        tw_surface_with_positions_by(surface, moves->positions[i], parallel, &plan->surfaces[i]);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

/* Moves a plan's surfaces; takes over the reference to the source. */
static api_outcome move_plan(api_call *call, api_entry *source, const api_plan_moves *moves,
                             api_entry **out) {
  const api_plan *still = api_entry_value(source);
  api_plan *plan = tw_alloc_zero(1, sizeof *plan);
  if (!plan) {
    api_entry_release(source);
    return api_fail_without_memory(call);
  }
  plan->source = source;
  plan->total = still->total;
  plan->hard = still->hard;
  atomic_init(&plan->is_warm, false);
  for (int i = 0; i <= TW_POLYGONS_NGON; i++) /* of the cages, which do not move */
    atomic_init(&plan->changes[i], atomic_load(&still->changes[i]));
  atomic_init(&plan->shells, API_SHELLS_UNKNOWN);
  tw_status status = move_surfaces(still, moves, &call->service->parallel, plan);
  if (status != TW_OK) {
    destroy_plan(plan);
    tw_fail(&call->fault.error, status,
            status == TW_CANCELLED ? "the surface is not wanted any more" : "out of memory");
    return api_fail(call);
  }
  const api_built built = {plan, plan_size(plan), destroy_plan, API_CACHED_PLAN};
  *out = api_cache_own(call->service->cache, &built);
  return *out ? API_DONE : api_fail_without_memory(call);
}

api_outcome api_plan_take(api_call *call, const api_plan_meshes *meshes, const api_plan_moves *moves,
                          bool is_stored, const api_surface_query *query, api_entry **out) {
  api_outcome outcome = take_source(call, meshes, is_stored, query, out);
  if (outcome != API_DONE || moves->count == 0) return outcome;
  api_entry *source = *out;
  *out = NULL;
  return move_plan(call, source, moves, out);
}

tw_status api_plan_warm(api_plan *plan, const tw_parallel_for *parallel, tw_error *error) {
  if (atomic_load(&plan->is_warm)) return TW_OK;
  for (uint32_t i = 0; i < plan->count; i++) {
    float min[3], max[3];
    uint32_t morphs = tw_surface_get_layout(plan->surfaces[i])->morph_count;
    for (int morph = -1; morph < (int)morphs; morph++) {
      tw_status status = tw_surface_bounds_by(plan->surfaces[i], morph, parallel, min, max);
      if (status == TW_CANCELLED) return tw_fail(error, status, "the bounds are not wanted any more");
      if (status != TW_OK) return tw_fail(error, status, "out of memory");
    }
  }
  atomic_store(&plan->is_warm, true);
  return TW_OK;
}

bool api_plan_knows_shells(const api_plan *plan) {
  return atomic_load(&plan->shells) == API_SHELLS_KNOWN;
}

tw_status api_plan_shells(api_plan *plan, const tw_parallel_for *parallel, tw_solid *solids,
                          tw_error *error) {
  size_t size = plan->count * sizeof *solids;
  bool is_known = api_plan_knows_shells(plan);
  if (plan->count > 0) memset(solids, 0, size);
  if (is_known && plan->count > 0) memcpy(solids, plan->solids, size);
  for (uint32_t i = 0; i < plan->count && !is_known; i++) {
    tw_shell *shells;
    uint32_t count;
    tw_status status = tw_shells_measure(plan->surfaces[i], parallel, &shells, &count, error);
    if (status != TW_OK) return status;
    for (uint32_t k = 0; k < count; k++) tw_solid_add(&solids[i], &shells[k]);
    tw_free(shells);
  }
  /* Two threads may both have measured the same shells; one of them stores its result. */
  int expected = API_SHELLS_UNKNOWN;
  if (!is_known && atomic_compare_exchange_strong(&plan->shells, &expected, API_SHELLS_BEING_WRITTEN)) {
    if (plan->count > 0) memcpy(plan->solids, solids, size);
    atomic_store(&plan->shells, API_SHELLS_KNOWN);
  }
  return TW_OK;
}
