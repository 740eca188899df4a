/* POST /v1/models/{id}/coarsen: makes a new model by replacing a refined mesh of a stored one by its cage. */
#include "tweend/coarsen.h"
#include "edited_model.h"
#include "handlers.h"
#include "plans.h"
#include "service.h"

#include <stdio.h>
#include <string.h>

/* A share of the range of values that rounding to float, and to bytes of colours, may leave. */
static const double STRAYS = 0.004;

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

/* Finds the cage and checks it: of the mesh as it is tagged; where that does not fit, with the hard edges and
 * corners that the file shows, which a refined mesh has where its cage had creases; then with the edges
 * alone, as a crease that turns sharply at one of its points looks like a corner there. */
static tw_status find_cage(const api_edited_model *edited, const tw_surface_options *options,
                           tw_coarsened *found, tw_error *error) {
  const tw_mesh *mesh = &edited->model->meshes[edited->mesh], *source = &edited->source;
  const tw_parallel_for *parallel = &edited->call->service->parallel;
  tw_arena *arena = edited->call->arena;
  tw_mesh edges = *source;
  edges.sharp_point_count = mesh->sharp_point_count;
  edges.sharp_points = mesh->sharp_points;
  edges.point_sharpness = mesh->point_sharpness;
  bool shows_edges = source->crease_count > mesh->crease_count,
       shows_corners = source->sharp_point_count > mesh->sharp_point_count;
  const tw_mesh *shown[2] = {shows_edges || shows_corners ? source : NULL,
                             shows_edges && shows_corners ? &edges : NULL};
  tw_status status = tw_mesh_coarsen(mesh, options, parallel, arena, found, error);
  for (int i = 0; i < 2 && shown[i]; i++) {
    if (status != TW_INVALID && (status != TW_OK || found->fits)) break;
    tw_coarsened next;
    tw_status then = tw_mesh_coarsen(shown[i], options, parallel, arena, &next, error);
    if (status != TW_INVALID && (then != TW_OK || !next.fits)) continue;
    *found = next;
    status = then;
  }
  if (status != TW_OK) return status;
  return tw_mesh_check(&found->mesh, error, NULL);
}

/* Warns of faces whose children were not alike, and of tags that the cage cannot have. */
static api_outcome warn_of_losses(api_call *call, const tw_coarsened *found) {
#define CHILDREN                                                                                             \
  " of the cage had children of several materials, groups or smoothing groups, or holes among them: the "    \
  "first child's are taken"
#define TAGS                                                                                                 \
  " of the mesh or of a level between cannot come from creases and corners of the cage: its surfaces have "  \
  "other sharpness there, or none"
  api_outcome outcome = api_call_warn_count(call, found->parted, " face" CHILDREN, " faces" CHILDREN);
  if (outcome != API_DONE) return outcome;
  return api_call_warn_count(call, found->untagged, " crease or corner" TAGS, " creases or corners" TAGS);
#undef CHILDREN
#undef TAGS
}

/* Warns of what the new model's surfaces have otherwise than the mesh, but for its points. */
static api_outcome warn_of_strays(api_call *call, const tw_mesh *mesh, const tw_coarsened *found) {
  static const char *const smoother =
      "joints and weights of the cage are the mesh's at its points: its surfaces blend them further";
  if (mesh->skin.joints) api_call_warn(call, &smoother, 1);
  if (warn_of_losses(call, found) != API_DONE) return API_FAILED;
  if (found->strays <= STRAYS) return API_DONE;
  char share[32];
  snprintf(share, sizeof share, "%.2g %%", 100 * found->strays);
  tw_text text = {0};
  tw_text_add(&text,
              "texture coordinates, attributes or morph targets of the cage's surfaces differ from the "
              "mesh's by up to ");
  tw_text_add(&text, share);
  tw_text_add(&text, " of their range");
  return api_call_warn_text(call, &text);
}

static void print_levels(void *context, tw_text *out) {
  const tw_coarsened *found = context;
  tw_member_count(out, "levels", found->levels);
}

static api_outcome coarsen(api_edited_model *edited) {
  api_call *call = edited->call;
  tw_error *error = &call->fault.error;
  api_surface_query query;
  uint32_t levels = 0;
  if (api_surface_query_read(call, &query) != API_DONE) return API_FAILED;
  tw_status status = read_levels(&call->query, &levels, error);
  if (status == TW_OK) status = api_edited_model_choose(edited, api_query_get(&call->query, "mesh"), error);
  if (status != TW_OK) return api_fail(call);
  const tw_mesh *mesh = &edited->model->meshes[edited->mesh];
  query.level = levels;
  query.normals = API_NORMALS_NONE;
  const tw_surface_options options = api_surface_options(&query, 0, mesh);
  tw_coarsened found;
  if (find_cage(edited, &options, &found, error) != TW_OK) return api_fail(call);
  if (mesh->detail_count > 0) {
    static const char *const lost = "what was modelled onto the levels of the mesh is left out";
    api_call_warn(call, &lost, 1);
  }
  if (found.is_ambiguous) {
    static const char *const ambiguous =
        "points where three edges meet may have alternated about the cage's: that vanishes in one step";
    api_call_warn(call, &ambiguous, 1);
  }
  if (warn_of_strays(call, mesh, &found) != API_DONE) return API_FAILED;
  edited->cage = found.mesh;
  const api_addition told = {print_levels, &found};
  return api_edited_model_store(edited, &told);
}

api_outcome api_post_coarsen(api_call *call) {
  return api_edited_model_answer(call, coarsen);
}
