#include "edited_model.h"

#include "clips.h"
#include "file_name.h"
#include "mixed_clips.h"
#include "service.h"
#include "upload.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

api_outcome api_edited_model_answer(api_call *call, api_outcome (*make)(api_edited_model *edited)) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_reading reading = {0};
  if (api_quads_read(&call->query, &reading.quads, &call->fault.error) != TW_OK) return api_fail(call);
  api_entry *entry;
  api_outcome outcome = api_model_take(call, call->id, &reading, &entry);
  if (outcome != API_DONE) return outcome;
  api_edited_model edited = {.call = call, .model = api_entry_value(entry)};
  outcome = make(&edited);
  api_entry_release(entry);
  return outcome;
}

/* The new model has as tags what the old one only shows: its surfaces stay what they are where the mesh is
 * not changed, and edges that are made are soft beside them. */
static tw_status take_source(api_edited_model *edited, tw_error *error) {
  const tw_mesh *mesh = &edited->model->meshes[edited->mesh];
  bool border_corners =
      mesh->tag_boundary == TW_TAG_UNSET || mesh->tag_boundary == TW_BOUNDARY_EDGE_AND_CORNER;
  return tw_mesh_with_creases(mesh, TW_CREASES_FILE, 0, TW_SHARPNESS_INFINITE, border_corners,
                              edited->call->arena, &edited->source, error);
}

tw_status api_edited_model_choose(api_edited_model *edited, const char *name, tw_error *error) {
  tw_status status = api_mesh_find(edited->model, name, &edited->mesh, error);
  return status == TW_OK ? take_source(edited, error) : status;
}

/* ---- mixed clips ----------------------------------------------------------------------------- */

/* Warns that a mixed clip is stored as keys. API_FAILED without memory. */
static api_outcome warn_of_keys(api_call *call, const char *name, const tw_tolerance *reached) {
  char error[96];
  tw_text text = {0};
  tw_text_add(&text, "the mixed clip ");
  tw_text_add(&text, name);
  snprintf(error, sizeof error, " is stored as keys, within %.3g degrees and %.3g m; its layers are not",
           reached->angle * TW_DEGREES, reached->distance);
  tw_text_add(&text, error);
  return api_call_warn_text(call, &text);
}

/* Finds the keys of a mixed clip. API_CONTINUE: its layers' clips are not there. */
static api_outcome find_mixed_keys(api_edited_model *edited, uint32_t index, tw_clip_keys *out) {
  api_call *call = edited->call;
  const api_clip_choice choice = {.index = index};
  const api_clip_choices alone = {.count = 1, .list = &choice};
  char buffer[24];
  const char *name = tw_model_clip_name(edited->model, index, buffer);
  api_entry *entry = NULL;
  api_outcome outcome = api_clip_take(call, edited->model, true, &alone, -1, &entry);
  if (outcome == API_FAILED) return api_mixed_leave_out(call, edited->model, index);
  if (outcome != API_DONE) return outcome;
  const api_clip *clip = api_entry_value(entry);
  tw_tolerance reached;
  tw_status status = api_clip_find_keys(clip->compiled, api_clip_keys_max(call), call->arena, out, &reached,
                                        &call->fault.error);
  api_call_warn(call, clip->warnings, clip->warning_count);
  api_entry_release(entry);
  out->name = edited->model->clips[index].name;
  if (status != TW_OK) return api_fail(call);
  return warn_of_keys(call, name, &reached);
}

/* The clips that the new model's file holds: mixed ones as keys. */
static api_outcome find_clips(api_edited_model *edited) {
  const tw_model *model = edited->model;
  tw_clip_keys *clips = tw_arena_alloc(edited->call->arena, model->clip_count, sizeof *clips);
  if (!clips) return api_fail_without_memory(edited->call);
  edited->clips = clips;
  for (uint32_t i = 0; i < model->clip_count; i++) {
    tw_clip_keys *out = &clips[edited->clip_count];
    *out = model->clips[i];
    api_outcome outcome = out->layer_count > 0 ? find_mixed_keys(edited, i, out) : API_DONE;
    if (outcome != API_DONE && outcome != API_CONTINUE) return outcome;
    edited->clip_count += outcome == API_DONE;
  }
  return API_DONE;
}

/* ---- the new model's bytes ------------------------------------------------------------------- */

/* The scene that is written: all meshes at level 0. */
typedef struct cage_scene {
  tw_model model; /* a view of the stored one, with the new cage */
  tw_arena *arena;
  tw_patch_classes *classes;
  tw_surface **surfaces; /* [model.mesh_count] */
} cage_scene;

static void end_scene(cage_scene *scene) {
  for (uint32_t i = 0; scene->surfaces && i < scene->model.mesh_count; i++)
    tw_surface_destroy(scene->surfaces[i]);
  free(scene->surfaces);
  tw_patch_classes_destroy(scene->classes);
  tw_arena_destroy(scene->arena);
}

static tw_status make_surface(cage_scene *scene, uint32_t i, tw_error *error) {
  tw_mesh mesh;
  const tw_mesh *source = &scene->model.meshes[i];
  if (tw_mesh_open_holes(source, scene->arena, &mesh) != TW_OK)
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  mesh.detail_count = 0; /* the file has the details in extras */
  const tw_surface_options options = {
      .normals = source->normals.corners, .own_normals = true, .tagged = true, .classes = scene->classes};
  return tw_surface_create(&mesh, &options, &scene->surfaces[i], error);
}

/* The caller ends the scene by end_scene, even on failure. */
static tw_status begin_scene(const api_edited_model *edited, cage_scene *scene, tw_error *error) {
  *scene =
      (cage_scene){.model = *edited->model, .arena = tw_arena_create(), .classes = tw_patch_classes_create()};
  uint32_t count = scene->model.mesh_count;
  scene->surfaces = tw_alloc_zero(count, sizeof *scene->surfaces);
  tw_mesh *meshes = scene->arena ? tw_arena_alloc(scene->arena, count, sizeof *meshes) : NULL;
  if (!meshes || !scene->classes || !scene->surfaces) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  memcpy(meshes, edited->model->meshes, count * sizeof *meshes);
  meshes[edited->mesh] = edited->cage;
  scene->model.meshes = meshes;
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < count && status == TW_OK; i++) status = make_surface(scene, i, error);
  return status;
}

/* Writes the model as GLB. Returns its *size bytes, which tw_free frees; NULL: the fault says why. */
static uint8_t *write_glb(api_edited_model *edited, const cage_scene *scene, size_t *size) {
  api_call *call = edited->call;
  const tw_scene content = {.model = &scene->model,
                            .surfaces = (const tw_surface *const *)scene->surfaces,
                            .clips = edited->clips,
                            .clip_count = edited->clip_count,
                            .polygons = TW_POLYGONS_NGON};
  tw_gltf_stream *stream;
  if (tw_gltf_stream_create(&content, TW_FORMAT_GLB, &stream, &call->fault.error) != TW_OK) {
    api_fail(call);
    return NULL;
  }
  uint8_t *bytes = NULL;
  uint64_t whole = tw_gltf_stream_size(stream), most = call->service->limits.max_upload;
  if (whole > most) {
    api_fail_with(call, 422, "the model would have %llu bytes, over the limit of %llu",
                  (unsigned long long)whole, (unsigned long long)most);
  } else {
    bytes = tw_alloc(1, (size_t)whole);
    *size = (size_t)whole;
    if (!bytes || tw_gltf_stream_read(stream, bytes, *size) < *size) {
      tw_free(bytes);
      bytes = NULL;
      api_fail_without_memory(call);
    }
  }
  tw_gltf_stream_destroy(stream);
  return bytes;
}

static uint8_t *make_glb(api_edited_model *edited, size_t *size) {
  cage_scene scene;
  uint8_t *bytes = NULL;
  if (begin_scene(edited, &scene, &edited->call->fault.error) == TW_OK)
    bytes = write_glb(edited, &scene, size);
  else
    api_fail(edited->call);
  end_scene(&scene);
  return bytes;
}

api_outcome api_edited_model_store(api_edited_model *edited, const api_addition *addition) {
  static const char *const lost =
      "the normals of morph targets are left out: those at rest stay where a target moves its points";
  if (edited->model->meshes[edited->mesh].morph_normals && !edited->cage.morph_normals)
    api_call_warn(edited->call, &lost, 1);
  size_t size;
  api_outcome found = find_clips(edited);
  if (found != API_DONE) return found;
  uint8_t *bytes = make_glb(edited, &size);
  if (!bytes) return API_FAILED;
  api_call *call = edited->call;
  const char *given = api_query_get(&call->query, "name"),
             *name = given ? api_file_name_title(given, call->arena) : edited->model->name;
  api_outcome outcome = api_model_store(call, (api_bytes){bytes, size}, name, addition);
  tw_free(bytes);
  return outcome;
}
