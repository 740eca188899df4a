#include "use_model.h"

#include "tweend/coarsen.h"
#include "tweend/detail.h"
#include "tweend/edit.h"

#include <stdlib.h>
#include <string.h>

/* The reader has checked the keys, so compiling a clip may fail only without memory. */
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

/* Writes each clip as BVH; the text must read back with as many frames. */
static void write_bvh(const tw_model *model) {
  enum { FRAMES = 3, ROOM = 1 << 20 };
  for (uint32_t i = 0; i < model->clip_count; i++) {
    tw_clip *clip = NULL;
    tw_bvh_stream *stream = NULL;
    tw_model *back = NULL;
    if (tw_clip_create(&model->clips[i], model->node_count, -1, &clip, NULL) != TW_OK) abort();
    const tw_bvh_options options = {
        .model = model, .clip = clip, .order = -1, .fps = 24, .frame_count = FRAMES};
    uint8_t *text = malloc(ROOM);
    if (text && tw_bvh_stream_create(&options, &stream, NULL) == TW_OK) {
      size_t size = 0;
      int64_t count;
      while ((count = tw_bvh_stream_read(stream, text + size, ROOM - size)) > 0) size += (size_t)count;
      if (size < ROOM && (tw_bvh_read(text, size, &back, NULL) != TW_OK || back->clip_count != 1 ||
                          back->clips[0].tracks[0].key_count != FRAMES))
        abort();
    }
    tw_model_destroy(back);
    tw_bvh_stream_destroy(stream);
    free(text);
    tw_clip_destroy(clip);
  }
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

/* STL and PLY: each must have the size that it stated. */
static void write_flat(const tw_scene *scene) {
  static const tw_flat_options forms[] = {{.form = TW_FLAT_STL, .scale = 1000, .unit = "mm"},
                                          {.form = TW_FLAT_PLY, .scale = 1, .unit = "m"}};
  for (int i = 0; i < 2; i++) {
    tw_flat_stream *stream = NULL;
    uint8_t block[4096];
    if (tw_flat_stream_create(scene, &forms[i], &stream, NULL) != TW_OK) continue;
    uint64_t size = tw_flat_stream_size(stream), read = 0;
    for (size_t count = 1; count > 0; read += count) count = tw_flat_stream_read(stream, block, sizeof block);
    if (read != size) abort();
    tw_flat_stream_destroy(stream);
  }
}

/* 3MF must not be larger than it stated. */
static void write_3mf(const tw_scene *scene) {
  tw_3mf_stream *stream = NULL;
  uint8_t block[4096];
  if (tw_3mf_stream_create(scene, &(tw_3mf_options){.scale = 1000, .unit = "millimeter"}, &stream, NULL) !=
      TW_OK)
    return;
  uint64_t bound = tw_3mf_stream_bound(stream), read = 0;
  for (int64_t count = 1; count > 0; read += (uint64_t)count)
    if ((count = tw_3mf_stream_read(stream, block, sizeof block)) < 0) abort();
  if (read > bound) abort();
  tw_3mf_stream_destroy(stream);
}

static void write_packed(const tw_model *model, tw_scene *scene, tw_encoding encoding) {
  tw_grid grids[MESHES];
  tw_packs *packs[MESHES] = {NULL};
  if (tw_grids_choose(model, scene->surfaces, NULL, grids) != TW_OK) return;
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

/* Writes the whole model in every encoding; each answer must have the size that it stated. */
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
    write_flat(&scene);
    write_3mf(&scene);
    write_packed(model, &scene, TW_ENCODING_QUANTIZED);
    write_packed(model, &scene, TW_ENCODING_MESHOPT);
  }
  while (count > 0) tw_surface_destroy(surfaces[--count]);
}

/* The GLB must be readable, without warnings about its extras.tweend. */
static void check_read(const uint8_t *bytes, size_t size) {
  tw_model *back = NULL;
  tw_error error = {0};
  tw_status status = tw_gltf_read(bytes, size, TW_QUADS_NGON, TW_WELD_AUTO, 100000, &back, &error);
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

/* Writes the cages as GLB and reads them back. */
static void store(const tw_model *model) {
  tw_surface *surfaces[MESHES] = {NULL};
  tw_arena *arena = tw_arena_create();
  uint32_t count = 0;
  for (; arena && count < model->mesh_count; count++) {
    tw_mesh open;
    const tw_surface_options options = {.tagged = true};
    if (tw_mesh_open_holes(&model->meshes[count], arena, &open) != TW_OK) break;
    open.detail_count = 0; /* the file stores details beside the cage */
    if (tw_surface_create(&open, &options, &surfaces[count], NULL) != TW_OK) break;
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

/* A mesh made by an edit, sculpting or coarsening must be valid. */
static void check_made(const tw_mesh *mesh, tw_scheme scheme, uint32_t level, tw_surface_counts *counts) {
  const tw_surface_options options = {.level = level, .scheme = scheme};
  if (tw_mesh_check(mesh, NULL, NULL) != TW_OK || tw_surface_count(mesh, &options, counts, NULL) != TW_OK)
    abort();
}

/* Cleans a mesh with the edits for scans. An edit that fails leaves the mesh as it is. */
static void clean(const tw_model *model, tw_mesh mesh, tw_arena *arena) {
  static const tw_edit edits[] = {
      {.kind = TW_EDIT_MERGE,
       .selection = {.by = TW_SELECT_ALL, .of = TW_EDIT_VERTICES},
       .merge.distance = 0.01},
      {.kind = TW_EDIT_ORIENT},
      {.kind = TW_EDIT_DROP_PIECES, .drop_pieces.faces = 2},
      {.kind = TW_EDIT_DESPIKE, .despike.factor = 1.5},
      {.kind = TW_EDIT_FILL, .fill = {.max_edges = 4, .method = TW_FILL_NGON}},
      {.kind = TW_EDIT_FILL, .fill = {.max_edges = 16, .method = TW_FILL_TRIANGLES}},
      {.kind = TW_EDIT_FILL, .fill.method = TW_FILL_FAIR},
      {.kind = TW_EDIT_SMOOTH, .smooth = {TW_SMOOTH_TAUBIN, 3}},
      {.kind = TW_EDIT_TRIANGULATE},
      {.kind = TW_EDIT_SMOOTH, .smooth = {TW_SMOOTH_LAPLACIAN, 2}},
      {.kind = TW_EDIT_QUADS},
  };
  static const tw_edit_limits limits = {1 << 16, 1 << 16, 1 << 18, 1 << 22, NULL};
  for (size_t i = 0; i < sizeof edits / sizeof *edits; i++) {
    tw_mesh next;
    tw_made made;
    uint32_t made_count = 0;
    tw_surface_counts counts;
    if (tw_mesh_edit(&mesh, model, &edits[i], 1, &limits, arena, &next, &made, &made_count, NULL, NULL) !=
        TW_OK)
      continue;
    check_made(&next, TW_CATMULL_CLARK, 1, &counts);
    mesh = next;
  }
}

/* If the mesh can be coarsened, its cage must have as many faces at that level. */
static void coarsen(const tw_mesh *mesh, tw_scheme scheme, tw_boundary boundary, tw_arena *arena) {
  const tw_surface_options options = {.level = 3, .scheme = scheme, .boundary = boundary};
  tw_coarsened found;
  tw_surface_counts fine;
  if (tw_mesh_coarsen(mesh, &options, NULL, arena, &found, NULL) != TW_OK) return;
  if (found.levels < 1 || found.levels > options.level) abort();
  check_made(&found.mesh, scheme, found.levels, &fine);
  if (fine.faces + mesh->hole_count < mesh->face_count || fine.faces > mesh->face_count) abort();
}

/* The first level of a mesh as a mesh; false when its points are too far away. */
static bool refine(const tw_mesh *mesh, tw_scheme scheme, tw_arena *arena, tw_mesh *out) {
  const tw_surface_options options = {.level = 1, .scheme = scheme};
  tw_surface *surface;
  if (tw_surface_create(mesh, &options, &surface, NULL) != TW_OK) return false;
  const tw_surface_counts *counts = tw_surface_get_counts(surface);
  uint32_t *offsets = tw_arena_alloc(arena, counts->faces + 1, sizeof *offsets);
  uint32_t *corners = tw_arena_alloc(arena, counts->corners, sizeof *corners);
  float *positions = tw_arena_alloc(arena, counts->vertices, 3 * sizeof *positions);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  bool has_memory = offsets && corners && positions && reader;
  if (has_memory) {
    tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, counts->vertices, positions);
    tw_surface_read_faces(reader, TW_DOMAIN_POINTS, 0, counts->faces, NULL, corners);
    for (uint32_t f = 0; f <= counts->faces; f++) offsets[f] = f * (scheme == TW_LOOP ? 3 : 4);
    tw_mesh_init(out);
    out->positions = positions;
    out->point_count = (uint32_t)counts->vertices;
    out->face_offsets = offsets;
    out->face_count = (uint32_t)counts->faces;
    out->corners = corners;
    out->corner_count = (uint32_t)counts->corners;
  }
  tw_surface_reader_destroy(reader);
  tw_surface_destroy(surface);
  return has_memory && tw_mesh_check(out, NULL, NULL) == TW_OK;
}

/* Sculpts the first level of a mesh; sculpting it to the same points again must change nothing, and files
 * must keep the details. */
static void sculpt(const tw_model *model, uint32_t mesh, tw_scheme scheme, tw_mesh *fine, tw_arena *arena) {
  const tw_surface_options options = {.level = 1, .scheme = scheme};
  tw_mesh sculpted, again, meshes[MESHES];
  tw_surface_counts counts;
  float *positions = (float *)fine->positions;
  for (size_t i = 0; i < 3 * (size_t)fine->point_count; i += 2) positions[i] = 0.5f * positions[i] + 1;
  if (tw_mesh_sculpt(&model->meshes[mesh], &options, positions, NULL, NULL, arena, &sculpted, NULL) != TW_OK)
    return;
  check_made(&sculpted, scheme, 2, &counts);
  memcpy(meshes, model->meshes, model->mesh_count * sizeof *meshes);
  meshes[mesh] = sculpted;
  tw_model changed = *model;
  changed.meshes = meshes;
  draw(&changed);
  store(&changed);
  if (!refine(&sculpted, scheme, arena, fine)) return;
  if (tw_mesh_sculpt(&sculpted, &options, fine->positions, NULL, NULL, arena, &again, NULL) != TW_OK ||
      again.details != sculpted.details || again.positions != sculpted.positions)
    abort();
}

/* Cleans and coarsens each mesh, and coarsens and sculpts its first level. */
static void remake(const tw_model *model) {
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    tw_arena *arena = tw_arena_create();
    if (!arena) return;
    const tw_mesh *mesh = &model->meshes[i];
    tw_mesh fine;
    clean(model, *mesh, arena);
    for (int scheme = TW_CATMULL_CLARK; scheme <= TW_LOOP; scheme++) {
      coarsen(mesh, (tw_scheme)scheme, TW_BOUNDARY_EDGE_AND_CORNER, arena);
      if (!refine(mesh, (tw_scheme)scheme, arena, &fine)) continue;
      coarsen(&fine, (tw_scheme)scheme, TW_BOUNDARY_EDGE_ONLY, arena);
      sculpt(model, i, (tw_scheme)scheme, &fine, arena);
    }
    tw_arena_destroy(arena);
  }
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
    remake(model);
    write_bvh(model);
  }
  tw_model_destroy(model);
}
