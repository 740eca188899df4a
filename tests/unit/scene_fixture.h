/* Small scenes with everything that an answer can hold, for the tests of the writers. */
#ifndef SCENE_FIXTURE_H
#define SCENE_FIXTURE_H

#include <stdlib.h>
#include <string.h>

#include "keys.h"
#include "tweend/format.h"

typedef struct fixture {
  tw_model *model;
  tw_surface **surfaces;
  tw_scene scene;
} fixture;

static const char cube_text[] = "o cube\n"
                                "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\n"
                                "v -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
                                "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/* Faces of 3 to 6 corners, three materials, a UV seam down the middle. */
static const char patchwork_text[] =
    "o patchwork\n"
    "v 0 0 0\nv 1 0 0.1\nv 2 0 0\nv 3 0 0.3\n"
    "v 0 1 0.2\nv 1 1 0\nv 2 1 0.5\nv 3 1 0\n"
    "v 0 2 0\nv 1 2 0.3\nv 2 2 0\nv 3 2 0.1\nv 1.5 3 0.2\n"
    "vt 0 0\nvt 0.3 0\nvt 0 0.5\nvt 0.3 0.5\nvt 0 1\nvt 0.3 1\n"
    "vt 0.4 0\nvt 0.7 0\nvt 1 0\nvt 0.4 0.5\nvt 0.7 0.5\nvt 1 0.5\nvt 0.4 1\nvt 0.7 1\nvt 1 1\nvt 0.5 1.2\n"
    "usemtl red\nf 1/1 2/2 6/4 5/3\nf 5/3 6/4 10/6 9/5\n"
    "usemtl green\nf 2/7 3/8 7/11\nf 2/7 7/11 6/10\nf 3/8 4/9 8/12 7/11\n"
    "usemtl red\nf 6/10 7/11 11/14 13/16 10/13\n"
    "usemtl blue\nf 7/11 8/12 12/15 11/14\n";

/* Aborts without memory: the test could not tell anything then. */
static inline void *fixture_alloc(fixture *f, size_t count, size_t size) {
  void *memory = tw_arena_alloc(f->model->arena, count, size);
  if (!memory) abort();
  return memory;
}

static inline void fixture_init(fixture *f, const char *obj) {
  *f = (fixture){0};
  tw_error error;
  if (tw_obj_read((const uint8_t *)obj, strlen(obj), TW_WELD_AUTO, &f->model, &error) != TW_OK) abort();
}

/* Makes the surfaces of all meshes and sets up the scene. */
static inline void fixture_refine_by(fixture *f, const tw_surface_options *options) {
  tw_error error;
  f->surfaces = tw_alloc_zero(f->model->mesh_count, sizeof(tw_surface *));
  for (uint32_t i = 0; i < f->model->mesh_count; i++)
    if (tw_surface_create(&f->model->meshes[i], options, &f->surfaces[i], &error) != TW_OK) abort();
  f->scene = (tw_scene){.model = f->model, .surfaces = (const tw_surface *const *)f->surfaces};
}

static inline void fixture_refine(fixture *f, uint32_t level, bool normals) {
  fixture_refine_by(f, &(tw_surface_options){.level = level, .normals = normals});
}

/* Level 0 with its tags. */
static inline void fixture_refine_tagged(fixture *f) {
  fixture_refine_by(f, &(tw_surface_options){.tagged = true});
}

static inline void fixture_deinit(fixture *f) {
  for (uint32_t i = 0; f->surfaces && i < f->model->mesh_count; i++) tw_surface_destroy(f->surfaces[i]);
  free(f->surfaces);
  tw_model_destroy(f->model);
}

/* Adds a node and rebuilds the model's node order. Add parents before their children. */
static inline uint32_t fixture_node(fixture *f, const char *name, uint32_t parent, uint32_t mesh) {
  tw_model *model = f->model;
  tw_node *nodes = fixture_alloc(f, model->node_count + 1, sizeof *nodes);
  if (model->node_count) memcpy(nodes, model->nodes, model->node_count * sizeof *nodes);
  nodes[model->node_count] =
      (tw_node){.name = name, .parent = parent, .mesh = mesh, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
  model->nodes = nodes;
  model->node_count++;
  model->node_order = fixture_alloc(f, model->node_count, sizeof(uint32_t));
  for (uint32_t i = 0; i < model->node_count; i++) model->node_order[i] = i;
  return model->node_count - 1;
}

/* Adds a skin of two joints, one above the other, whose weights on the first mesh depend on the height. */
static inline void fixture_add_skin(fixture *f) {
  tw_model *model = f->model;
  tw_mesh *mesh = &model->meshes[0];
  uint16_t *joints = fixture_alloc(f, mesh->point_count, 4 * sizeof *joints);
  float *weights = fixture_alloc(f, mesh->point_count, 4 * sizeof *weights);
  for (uint32_t i = 0; i < mesh->point_count; i++) {
    bool high = mesh->positions[3 * i + 1] > 0;
    joints[4 * i] = high;
    joints[4 * i + 1] = !high;
    weights[4 * i] = 0.75f;
    weights[4 * i + 1] = 0.25f;
  }
  mesh->skin = (tw_skin_weights){.width = 4, .joints = joints, .weights = weights};
  uint32_t *nodes = fixture_alloc(f, 2, sizeof *nodes);
  nodes[0] = fixture_node(f, "hip", TW_NO_INDEX, TW_NO_INDEX);
  nodes[1] = fixture_node(f, "knee", nodes[0], TW_NO_INDEX);
  model->nodes[nodes[1]].rest.translation[1] = 1;
  float(*bind)[16] = fixture_alloc(f, 2, sizeof *bind);
  for (int joint = 0; joint < 2; joint++)
    for (int i = 0; i < 4; i++) bind[joint][5 * i] = 1;
  bind[1][13] = -1;
  model->skins = fixture_alloc(f, 1, sizeof *model->skins);
  model->skins[0] = (tw_skin){
      .name = "leg", .joint_count = 2, .joints = nodes, .inverse_bind = bind[0], .skeleton = nodes[0]};
  model->skin_count = 1;
  model->nodes[0].skin = 0;
}

/* Adds `count` morph targets to the first mesh; target t moves point p by (t + 1, p, -t) tenths. */
static inline void fixture_add_morphs(fixture *f, uint32_t count) {
  tw_mesh *mesh = &f->model->meshes[0];
  const float **morphs = fixture_alloc(f, count, sizeof *morphs);
  float *weights = fixture_alloc(f, count, sizeof *weights);
  for (uint32_t t = 0; t < count; t++) {
    float *values = fixture_alloc(f, mesh->point_count, 3 * sizeof *values);
    for (uint32_t p = 0; p < mesh->point_count; p++) {
      values[3 * p] = (float)(t + 1) / 10;
      values[3 * p + 1] = (float)p / 10;
      values[3 * p + 2] = -(float)t / 10;
    }
    morphs[t] = values;
    weights[t] = (float)t / (float)(2 * count);
  }
  mesh->morph_count = count;
  mesh->morphs = morphs;
  mesh->morph_weights = weights;
}

/* Adds normals of the file, one a corner, and what each morph target adds to them. */
static inline void fixture_add_morph_normals(fixture *f) {
  tw_mesh *mesh = &f->model->meshes[0];
  uint32_t count = mesh->corner_count, *corners = fixture_alloc(f, count, sizeof *corners);
  float *values = fixture_alloc(f, count, 3 * sizeof *values);
  const float **morph_normals = fixture_alloc(f, mesh->morph_count, sizeof *morph_normals);
  for (uint32_t t = 0; t < mesh->morph_count; t++) {
    float *added = fixture_alloc(f, count, 3 * sizeof *added);
    for (uint32_t i = 0; i < 3 * count; i++) added[i] = (float)((i + t) % 5) / 4;
    morph_normals[t] = added;
  }
  for (uint32_t c = 0; c < count; c++) {
    corners[c] = c;
    values[3 * c + 2] = 1;
  }
  mesh->normals = (tw_corner_normals){.value_count = count, .values = values, .corners = corners};
  mesh->morph_normals = morph_normals;
}

static inline void fixture_add_colors(fixture *f) {
  tw_mesh *mesh = &f->model->meshes[0];
  float *colors = fixture_alloc(f, mesh->point_count, 4 * sizeof *colors);
  for (uint32_t i = 0; i < 4 * mesh->point_count; i++) colors[i] = i % 4 == 3 ? 1 : (float)(i % 7) / 6;
  tw_mesh_set_colors(mesh, colors, f->model->arena);
}

/* Adds a clip with every kind of track, on a chain of nodes below the first one. */
static inline void fixture_add_clip(fixture *f) {
  static const float times[4] = {0, 0.4f, 1.7f, 2};
  static const float quaternions[4][4] = {
      {0, 0, 0, 1}, {0, 0.6f, 0, 0.8f}, {0, -0.6f, 0, -0.8f}, {0.5f, 0.5f, 0.5f, 0.5f}};
  static const double eulers[2][3] = {{-2.9670597283903604, 0, 0.5}, {2.9670597283903604, 0.3, -1}};
  static const double turns[2][4] = {{1, 0, 0, 0}, {1, 0, 0, 12.566370614359172}};
  static const float moves[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 2, 0}, {0, 0, 3}};
  static const float scales[2][3][3] = {{{0, 0, 0}, {1, 1, 1}, {1, 0, 0}}, {{0, 1, 0}, {2, 1, 1}, {0, 0, 0}}};
  static const float spline[2][3][4] = {{{0, 0, 0, 0}, {0, 0, 0, 1}, {1, 0, 0, 0}},
                                        {{0, 1, 0, 0}, {0.6f, 0, 0, 0.8f}, {0, 0, 0, 0}}};
  enum { TRACKS = 8 };
  tw_track_keys *tracks = fixture_alloc(f, TRACKS, sizeof *tracks);
  uint32_t nodes[TRACKS];
  static const char *const names[TRACKS] = {
      "turret", "euler", "wheel", "moved", "scaled", "step", "splined \"q\" \xC3\xA4", "squad"};
  for (uint32_t i = 0; i < TRACKS; i++)
    nodes[i] = fixture_node(f, names[i], i ? nodes[i - 1] : 0, TW_NO_INDEX);
  tracks[0] = quaternion_keys(TW_LINEAR, times, quaternions[0], 4);
  tracks[1] = euler_keys(TW_XYZ, times, eulers[0], 2);
  tracks[2] = axis_angle_keys(times + 2, turns[0], 2);
  tracks[3] = value_keys(TW_TRANSLATION, TW_LINEAR, times, moves[0], 4);
  tracks[4] = value_keys(TW_SCALE, TW_CUBICSPLINE, times, scales[0][0], 2);
  tracks[5] = quaternion_keys(TW_STEP, times, quaternions[0], 4);
  tracks[6] = quaternion_keys(TW_CUBICSPLINE, times, spline[0][0], 2);
  tracks[7] = quaternion_keys(TW_SQUAD, times, quaternions[0], 4);
  for (uint32_t i = 0; i < TRACKS; i++) tracks[i].node = nodes[i];
  f->model->clips = fixture_alloc(f, 1, sizeof *f->model->clips);
  f->model->clips[0] = (tw_clip_keys){.name = "aim", .track_count = TRACKS, .tracks = tracks};
  f->model->clip_count = 1;
}

/* Reads all bytes of a stream, in blocks. The caller frees them. */
static inline uint8_t *fixture_read(tw_gltf_stream *stream, size_t block) {
  size_t size = (size_t)tw_gltf_stream_size(stream), done = 0, got = 1;
  uint8_t *bytes = calloc(size + 1, 1);
  if (!bytes) abort();
  for (; done < size && got > 0; done += got)
    got = tw_gltf_stream_read(stream, bytes + done, block < size - done ? block : size - done);
  return bytes;
}

#endif
