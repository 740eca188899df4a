#include "use_model.h"

#include <stdlib.h>
#include <string.h>

/* Reading has checked the keys, so that compiling a clip must not fail but for memory. */
static void pose(const tw_model *model) {
  tw_trs *locals = calloc(model->node_count + 1, sizeof *locals);
  for (uint32_t i = 0; locals && i < model->clip_count; i++) {
    tw_clip *clip = NULL;
    if (tw_clip_create(&model->clips[i], model->node_count, -1, &clip, NULL) != TW_OK) abort();
    tw_clip_pose(clip, model->nodes, model->node_count, 0.5f, locals);
    tw_clip_destroy(clip);
  }
  free(locals);
}

enum { MESHES = 8, CORNERS = 4096, NODES = 64 };

static bool is_small(const tw_model *model) {
  uint64_t size = 0;
  if (model->mesh_count > MESHES || model->node_count > NODES) return false;
  for (uint32_t i = 0; i < model->mesh_count; i++)
    size += (uint64_t)model->meshes[i].corner_count * (1 + model->meshes[i].morph_count);
  return size <= CORNERS;
}

static void write_answer(const tw_scene *scene) {
  tw_gltf_stream *stream = NULL;
  if (tw_gltf_stream_create(scene, TW_FORMAT_GLB, &stream, NULL) != TW_OK) return;
  uint8_t block[4096];
  uint64_t size = tw_gltf_stream_size(stream), read = 0;
  for (size_t count = 1; count > 0; read += count) count = tw_gltf_stream_read(stream, block, sizeof block);
  if (read != size) abort();
  tw_gltf_stream_destroy(stream);
}

static void write_packed(const tw_model *model, tw_scene *scene, tw_encoding encoding) {
  tw_grid grids[MESHES];
  tw_packs *packs[MESHES] = {NULL};
  if (tw_grids_choose(model, grids) != TW_OK) return;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const tw_pack_options options = {encoding, scene->polygons, grids[i], true};
    if (tw_packs_create(&model->meshes[i], scene->surfaces[i], &options, NULL, &packs[i], NULL) != TW_OK)
      abort();
  }
  scene->packs = (const tw_packs *const *)packs;
  write_answer(scene);
  scene->packs = NULL;
  for (uint32_t i = 0; i < model->mesh_count; i++) tw_packs_destroy(packs[i]);
}

/* An answer of the whole model in every encoding, its size as told. */
static void draw(const tw_model *model) {
  static const tw_surface_options options = {.level = 1, .normals = true};
  tw_surface *surfaces[MESHES] = {NULL};
  uint32_t count = 0;
  while (count < model->mesh_count &&
         tw_surface_create(&model->meshes[count], &options, &surfaces[count], NULL) == TW_OK)
    count++;
  if (count == model->mesh_count) {
    tw_scene scene = {.model = model,
                      .surfaces = (const tw_surface *const *)surfaces,
                      .clips = model->clips,
                      .clip_count = model->clip_count,
                      .polygons = (tw_polygons)(model->node_count % 2)};
    write_answer(&scene);
    write_packed(model, &scene, TW_ENCODING_QUANTIZED);
    write_packed(model, &scene, TW_ENCODING_MESHOPT);
  }
  while (count > 0) tw_surface_destroy(surfaces[--count]);
}

/* The file must be read, and what it says of the cages must fit. */
static void check_read(const uint8_t *bytes, size_t size) {
  static const tw_read_limits limits = {.json_values = 100000};
  tw_model *back = NULL;
  tw_error error = {0};
  tw_status status = tw_gltf_read(bytes, size, TW_QUADS_NGON, TW_WELD_AUTO, &limits, &back, &error);
  if (status == TW_LIMIT || status == TW_NO_MEMORY) return;
  if (status != TW_OK) abort();
  for (uint32_t i = 0; i < back->warning_count; i++)
    if (strncmp(back->warnings[i], "extras.tweend", 13) == 0) abort();
  tw_model_destroy(back);
}

static void read_back(const tw_scene *scene) {
  tw_gltf_stream *stream = NULL;
  if (tw_gltf_stream_create(scene, TW_FORMAT_GLB, &stream, NULL) != TW_OK) return;
  size_t size = (size_t)tw_gltf_stream_size(stream);
  uint8_t *bytes = malloc(size);
  if (!bytes || tw_gltf_stream_read(stream, bytes, size) != size) abort();
  check_read(bytes, size);
  tw_gltf_stream_destroy(stream);
  free(bytes);
}

static bool has_but_holes(const tw_mesh *mesh) {
  bool is_hole[CORNERS] = {false};
  uint32_t holes = 0;
  for (uint32_t i = 0; i < mesh->hole_count; i++) {
    holes += !is_hole[mesh->holes[i]];
    is_hole[mesh->holes[i]] = true;
  }
  return holes > 0 && holes == mesh->face_count;
}

/* The cages as GLB. */
static void store(const tw_model *model) {
  tw_surface *surfaces[MESHES] = {NULL};
  tw_arena *arena = tw_arena_create();
  uint32_t count = 0;
  for (; arena && count < model->mesh_count; count++) {
    tw_mesh open;
    if (has_but_holes(&model->meshes[count])) break; /* glTF draws something of each mesh */
    const tw_surface_options options = {.tagged = true};
    if (tw_mesh_open_holes(&model->meshes[count], arena, &open) != TW_OK ||
        tw_surface_create(&open, &options, &surfaces[count], NULL) != TW_OK)
      break;
  }
  if (arena && count == model->mesh_count) {
    const tw_scene scene = {.model = model,
                            .surfaces = (const tw_surface *const *)surfaces,
                            .clips = model->clips,
                            .clip_count = model->clip_count,
                            .polygons = TW_POLYGONS_NGON};
    read_back(&scene);
  }
  while (count > 0) tw_surface_destroy(surfaces[--count]);
  tw_arena_destroy(arena);
}

void use_model(tw_model *model) {
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_mesh_stats facts;
    if (tw_mesh_describe(&model->meshes[i], &facts, NULL) == TW_OK) tw_mesh_stats_deinit(&facts);
  }
  pose(model);
  if (is_small(model)) {
    draw(model);
    store(model);
  }
  tw_model_destroy(model);
}
