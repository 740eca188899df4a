/* POST /v1/models/{id}/edits: makes a new model by editing a mesh of a stored one. */
#include "edited_model.h"
#include "edits_in.h"
#include "handlers.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct edits_request {
  api_edited_model *edited;
  api_edits_done done;
} edits_request;

/* ---- the request ----------------------------------------------------------------------------- */

/* Finds the mesh that the document names. */
static tw_status find_mesh(const api_value *value, edits_request *request) {
  tw_error error;
  if (value->item && !cJSON_IsString(value->item))
    return api_json_fail(value, TW_SYNTAX, "the name of a mesh is expected");
  tw_status status = api_edited_model_choose(request->edited, cJSON_GetStringValue(value->item), &error);
  return status == TW_OK ? TW_OK : api_json_fail(value, status, "%s", error.detail);
}

/* Checks that a face remains that is no hole: a glTF mesh needs something to draw. A hole may be listed
 * twice. */
static tw_status check_faces(const tw_mesh *mesh, const api_value *edits) {
  uint8_t *is_hole = tw_arena_alloc(edits->json->arena, mesh->face_count, 1);
  uint32_t holes = 0;
  if (!is_hole) return api_json_no_memory(edits->json);
  for (uint32_t i = 0; i < mesh->hole_count; i++) {
    holes += !is_hole[mesh->holes[i]];
    is_hole[mesh->holes[i]] = 1;
  }
  if (holes < mesh->face_count) return TW_OK;
  return api_json_fail(edits, TW_INVALID, "they leave no face that is no hole");
}

/* Keeps the details of the mesh's levels if faces and their points are unchanged; else drops them and
 * warns. */
static void keep_details(edits_request *request) {
  static const char *const lost =
      "the edits change faces: what was modelled onto the mesh's levels is left out";
  const tw_mesh *before = &request->edited->model->meshes[request->edited->mesh];
  tw_mesh *after = &request->edited->cage;
  if (before->detail_count == 0) return;
  bool is_same = after->point_count == before->point_count && after->face_count == before->face_count &&
                 memcmp(after->face_offsets, before->face_offsets,
                        ((size_t)before->face_count + 1) * sizeof(uint32_t)) == 0 &&
                 memcmp(after->corners, before->corners, before->corner_count * sizeof(uint32_t)) == 0;
  after->details = before->details;
  after->detail_count = is_same ? before->detail_count : 0;
  if (!is_same) api_call_warn(request->edited->call, &lost, 1);
}

/* Warns where images of points follow the joints of the points: no file tells which joint is on the other
 * side. */
static void warn_of_images(edits_request *request) {
  static const char *const same = "points that mirror made follow the joints of those whose images they are, "
                                  "not joints of the other side";
  if (request->done.has_mirrored && request->edited->cage.skin.joints)
    api_call_warn(request->edited->call, &same, 1);
}

static api_outcome warn_of_losses(const edits_request *request) {
  const tw_edit_losses *losses = &request->done.losses;
  api_call *call = request->edited->call;
  api_outcome outcome = api_call_warn_count(
      call, losses->bent,
      " point was merged with one of other joints, weights or morph targets, and follows this",
      " points were merged with points of other joints, weights or morph targets, and follow these");
  if (outcome != API_DONE) return outcome;
  return api_call_warn_count(
      call, losses->flattened,
      " point on the plane of mirror left it in morph targets, where it would cross its "
      "image: it stays there",
      " points on the plane of mirror left it in morph targets, where they would cross "
      "their images: they stay there");
}

static tw_status read_document(void *context, const api_value *root) {
  enum { MESH, EDITS, MEMBERS };
  static const char *const names[] = {"mesh", "edits", NULL};
  edits_request *request = context;
  api_value values[MEMBERS];
  tw_status status = api_json_members(root, names, values);
  if (status == TW_OK && !values[EDITS].item)
    status = api_json_fail(root, TW_SYNTAX, "edits are missing: a list");
  if (status == TW_OK) status = find_mesh(&values[MESH], request);
  if (status != TW_OK) return status;
  api_edited_model *edited = request->edited;
  const api_making making = api_making_within(edited->call->service);
  const api_edit_call edit = {&edited->source, edited->model, &making};
  status = api_edits_apply(&values[EDITS], &edit, &edited->cage, &request->done);
  if (status != TW_OK) return status;
  keep_details(request);
  warn_of_images(request);
  if (warn_of_losses(request) != API_DONE) return TW_NO_MEMORY;
  return check_faces(&edited->cage, &values[EDITS]);
}

/* ---- the answer ------------------------------------------------------------------------------ */

static void print_list(tw_text *out, const char *name, const uint32_t *list, uint32_t count,
                       const uint32_t *numbers) {
  tw_member_open(out, name, "[");
  for (uint32_t i = 0; i < count; i++) {
    if (numbers && numbers[list[i]] == UINT32_MAX) continue;
    tw_text_element(out);
    tw_text_count(out, numbers ? numbers[list[i]] : list[i]);
  }
  tw_text_add(out, "]");
}

/* The indices of points in the stored model, which leaves out points that no face uses: UINT32_MAX. NULL
 * without memory. */
static const uint32_t *number_points(const tw_mesh *mesh, tw_arena *arena) {
  uint32_t *numbers = tw_arena_alloc(arena, mesh->point_count, sizeof *numbers), used = 0;
  if (!numbers) return NULL;
  for (uint32_t c = 0; c < mesh->corner_count; c++) numbers[mesh->corners[c]] = 1;
  for (uint32_t p = 0; p < mesh->point_count; p++) numbers[p] = numbers[p] ? used++ : UINT32_MAX;
  return numbers;
}

/* Prints what the named edits made; the last of equal names counts. */
static void print_made(void *context, tw_text *out) {
  const edits_request *request = context;
  const uint32_t *numbers = number_points(&request->edited->cage, request->edited->call->arena);
  out->failed |= !numbers;
  tw_member_open(out, "made", "{");
  for (uint32_t i = 0; numbers && i < request->done.made_count; i++) {
    const tw_made *made = &request->done.made[i];
    bool is_last = true;
    for (uint32_t k = i + 1; k < request->done.made_count && is_last; k++)
      is_last = strcmp(made->name, request->done.made[k].name) != 0;
    if (!is_last) continue;
    tw_text_element(out);
    tw_text_string(out, made->name);
    tw_text_add(out, ":{");
    print_list(out, "faces", made->faces, made->face_count, NULL);
    print_list(out, "vertices", made->vertices, made->vertex_count, numbers);
    tw_text_add(out, "}");
  }
  tw_text_add(out, "}");
}

static api_outcome edit(api_edited_model *edited) {
  api_call *call = edited->call;
  edits_request request = {.edited = edited};
  api_outcome outcome = api_upload_json(call, API_JSON_VALUES_MAX, read_document, &request);
  const api_addition made = {print_made, &request};
  return outcome == API_DONE ? api_edited_model_store(edited, &made) : outcome;
}

api_outcome api_post_edits(api_call *call) {
  return api_edited_model_answer(call, edit);
}
