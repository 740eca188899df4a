#include "use_model.h"

#include <stdlib.h>

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

void use_model(tw_model *model) {
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_mesh_stats facts;
    if (tw_mesh_describe(&model->meshes[i], &facts, NULL) == TW_OK) tw_mesh_stats_deinit(&facts);
  }
  pose(model);
  if (is_small(model)) draw(model);
  tw_model_destroy(model);
}
