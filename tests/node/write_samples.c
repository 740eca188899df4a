/* Writes a GLB and a glTF file of every kind of scene into the folder given, and beside each the facts
 * that a reader must find in them, from libtweend itself. Only this folder's tests run it. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rotation_reference.h"
#include "scene_fixture.h"

static const char textured_text[] =
    "{\"asset\":{\"version\":\"2.0\",\"copyright\":\"nobody\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
    "\"nodes\":[{\"mesh\":0,\"name\":\"tile\"}],\"meshes\":[{\"primitives\":[{\"attributes\":"
    "{\"POSITION\":0,\"TEXCOORD_0\":1},\"indices\":2,\"material\":0}]}],"
    "\"materials\":[{\"name\":\"bricks\",\"doubleSided\":true,\"pbrMetallicRoughness\":{\"metallicFactor\":0,"
    "\"baseColorTexture\":{\"index\":0,\"extensions\":{\"KHR_texture_transform\":{\"scale\":[2,2]}}}},"
    "\"extensions\":{\"KHR_materials_unlit\":{}}}],"
    "\"extensionsUsed\":[\"KHR_materials_unlit\",\"KHR_texture_transform\"],"
    "\"textures\":[{\"source\":0,\"sampler\":0}],\"samplers\":[{\"magFilter\":9728,\"wrapS\":33071}],"
    "\"images\":[{\"mimeType\":\"image/png\",\"uri\":\"data:image/png;base64,"
    "iVBORw0KGgoAAAANSUhEUgAAAAQAAAAECAIAAAAmkwkpAAAAHklEQVR4nGM4wSACRwwnjETgiOFEiggcMZyYJgJHALgbEnGcAso2AAAA"
    "AElFTkSuQmCC\"}],"
    "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\","
    "\"min\":[-1,0,-1],\"max\":[1,0,1]},"
    "{\"bufferView\":1,\"componentType\":5126,\"count\":4,\"type\":\"VEC2\"},"
    "{\"bufferView\":2,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"}],"
    "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength\":32},"
    "{\"buffer\":0,\"byteOffset\":80,\"byteLength\":12}],"
    "\"buffers\":[{\"byteLength\":92,\"uri\":\"data:application/octet-stream;base64,"
    "AACAvwAAAAAAAIC/AACAPwAAAAAAAIC/AACAPwAAAAAAAIA/AACAvwAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAAAAA"
    "gD8AAAIAAQAAAAMAAgA=\"}]}";

/* Three materials with a normal map, and nothing else. */
static const char mapped_text[] =
    "{\"asset\":{\"version\":\"2.0\"},\"materials\":[{\"name\":\"red\",\"normalTexture\":{\"index\":0}},"
    "{\"name\":\"green\",\"normalTexture\":{\"index\":0,\"scale\":0.5}},{\"name\":\"blue\",\"normalTexture\":"
    "{\"index\":0}}],\"textures\":[{\"source\":0}],\"images\":[{\"mimeType\":\"image/png\",\"uri\":"
    "\"data:image/"
    "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAQAAAAECAIAAAAmkwkpAAAAHklEQVR4nGM4wSACRwwnjETgiOFEiggcMZyYJgJHA"
    "LgbEnGcAso2AAAAAElFTkSuQmCC\"}]}";

static const char *folder;

static FILE *open_file(const char *name, const char *suffix) {
  char path[4096];
  snprintf(path, sizeof path, "%s/%s%s", folder, name, suffix);
  FILE *file = fopen(path, "wb");
  if (!file) abort();
  return file;
}

static void write_container(const tw_scene *scene, tw_format container, const char *name,
                            const char *suffix) {
  tw_gltf_stream *stream = NULL;
  tw_error error;
  if (tw_gltf_stream_create(scene, container, &stream, &error) != TW_OK) {
    fprintf(stderr, "%s%s: %s\n", name, suffix, error.detail);
    exit(1);
  }
  uint8_t *bytes = fixture_read(stream, 1 << 18);
  FILE *file = open_file(name, suffix);
  fwrite(bytes, 1, (size_t)tw_gltf_stream_size(stream), file);
  fclose(file);
  free(bytes);
  tw_gltf_stream_destroy(stream);
}

static void print_floats(FILE *file, const float *values, size_t count) {
  fprintf(file, "[");
  for (size_t i = 0; i < count; i++) fprintf(file, "%s%.9g", i ? "," : "", (double)values[i]);
  fprintf(file, "]");
}

/* Matrices of all nodes, local and world, at a time of the clip or (NULL) at rest. */
static void print_matrices(FILE *file, const tw_scene *scene, const tw_clip *clip, float time) {
  const tw_model *model = scene->model;
  tw_trs *locals = tw_alloc(model->node_count, sizeof *locals);
  float *matrices = tw_alloc(model->node_count, 16 * sizeof *matrices);
  if (!locals || !matrices) abort();
  for (uint32_t i = 0; i < model->node_count; i++)
    locals[i] = scene->pose ? scene->pose[i] : model->nodes[i].rest;
  if (clip) tw_clip_pose(clip, model->nodes, model->node_count, time, locals);
  tw_pose_locals(clip, model->nodes, model->node_count, locals, matrices);
  fprintf(file, "\"local\":");
  print_floats(file, matrices, (size_t)model->node_count * 16);
  tw_pose_world(model->nodes, model->node_order, model->node_count, matrices, matrices);
  fprintf(file, ",\"world\":");
  print_floats(file, matrices, (size_t)model->node_count * 16);
  free(matrices);
  free(locals);
}

static void print_meshes(FILE *file, const tw_scene *scene) {
  bool first = true;
  fprintf(file, "\"meshes\":[");
  for (uint32_t i = 0; i < scene->model->mesh_count; i++) {
    const tw_surface *surface = scene->surfaces[i];
    const tw_surface_counts *counts = tw_surface_get_counts(surface);
    if (counts->faces == 0) continue;
    float min[3], max[3];
    tw_surface_bounds(surface, -1, min, max);
    fprintf(file, "%s{\"vertices\":%llu,\"triangles\":%llu,\"min\":", first ? "" : ",",
            (unsigned long long)tw_surface_row_count(surface, TW_DOMAIN_VERTICES),
            (unsigned long long)(counts->corners - 2 * counts->faces));
    print_floats(file, min, 3);
    fprintf(file, ",\"max\":");
    print_floats(file, max, 3);
    fprintf(file, "}");
    first = false;
  }
  fprintf(file, "],\n");
}

/* A row as the joints and morph targets of the first node put it. joints: [][16]. */
static void move_row(const tw_scene *scene, const float *row, const float *joints, float out[3]) {
  const tw_mesh *mesh = &scene->model->meshes[0];
  const tw_surface_layout *layout = tw_surface_get_layout(scene->surfaces[0]);
  float point[3];
  memcpy(point, row, sizeof point);
  for (uint32_t m = 0; m < layout->morph_count; m++)
    for (uint32_t c = 0; c < 3; c++) point[c] += mesh->morph_weights[m] * row[layout->morphs + 3 * m + c];
  memset(out, 0, 3 * sizeof *out);
  for (uint32_t k = 0; k < 4; k++) {
    const float *matrix = joints + 16 * (size_t)row[layout->joints + k];
    for (uint32_t c = 0; c < 3; c++)
      out[c] += row[layout->weights + k] *
                (matrix[c] * point[0] + matrix[4 + c] * point[1] + matrix[8 + c] * point[2] + matrix[12 + c]);
  }
}

/* Where every vertex of the first node, which is skinned, is in the world. */
static void print_skinned(FILE *file, const tw_scene *scene) {
  const tw_model *model = scene->model;
  const tw_surface_layout *layout = tw_surface_get_layout(scene->surfaces[0]);
  uint64_t count = tw_surface_row_count(scene->surfaces[0], TW_DOMAIN_VERTICES);
  float *world = tw_alloc(model->node_count, 16 * sizeof *world);
  float *joints = tw_alloc(model->skins[0].joint_count, 16 * sizeof *joints);
  float *row = tw_alloc(layout->stride, sizeof *row);
  tw_surface_reader *reader = tw_surface_reader_create(scene->surfaces[0]);
  if (!world || !joints || !row || !reader) abort();
  tw_pose_locals(scene->posed_by, model->nodes, model->node_count, scene->pose, world);
  tw_pose_world(model->nodes, model->node_order, model->node_count, world, world);
  tw_skin_matrices(&model->skins[0], world, joints);
  fprintf(file, ",\n\"skinned\":[");
  for (uint64_t i = 0; i < count; i++) {
    float moved[3];
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
    move_row(scene, row, joints, moved);
    fprintf(file, "%s", i ? "," : "");
    print_floats(file, moved, 3);
  }
  fprintf(file, "]");
  tw_surface_reader_destroy(reader);
  free(row);
  free(joints);
  free(world);
}

/* Nodes whose rotation glTF cannot interpolate as the clip does. */
static void print_sampled_nodes(FILE *file, const tw_clip_keys *clip) {
  fprintf(file, ",\n\"sampled\":[");
  bool first = true;
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    bool sampled = track->interpolation == TW_EULER || track->interpolation == TW_NLERP ||
                   track->interpolation == TW_SQUAD || track->form == TW_KEY_AXIS_ANGLE;
    if (!sampled) continue;
    fprintf(file, "%s%u", first ? "" : ",", track->node);
    first = false;
  }
  fprintf(file, "]");
}

static void print_poses(FILE *file, const tw_scene *scene) {
  tw_clip *clip = NULL;
  tw_error error;
  if (tw_clip_create(scene->clips, scene->model->node_count, -1, &clip, &error) != TW_OK) abort();
  fprintf(file, ",\n\"poses\":[");
  for (int i = 0; i <= 40; i++) {
    float time = tw_clip_duration(clip) * (float)i / 40;
    fprintf(file, "%s\n{\"t\":%.9g,", i ? "," : "", (double)time);
    print_matrices(file, scene, clip, time);
    fprintf(file, "}");
  }
  fprintf(file, "]");
  tw_clip_destroy(clip);
}

static void write_facts(const tw_scene *scene, const char *name) {
  FILE *file = open_file(name, ".json");
  fprintf(file, "{");
  print_meshes(file, scene);
  fprintf(file, "\"nodes\":%u,", scene->model->node_count);
  print_matrices(file, scene, NULL, 0);
  if (scene->pose && scene->model->skin_count > 0) print_skinned(file, scene);
  if (scene->clip_count > 0) {
    print_sampled_nodes(file, scene->clips);
    print_poses(file, scene);
  }
  fprintf(file, "}\n");
  fclose(file);
}

static void write_sample(fixture *f, const char *name) {
  write_container(&f->scene, TW_FORMAT_GLB, name, ".glb");
  write_container(&f->scene, TW_FORMAT_GLTF, name, ".gltf");
  write_facts(&f->scene, name);
  fixture_deinit(f);
}

static void write_plain(void) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_refine(&f, 3, true);
  write_sample(&f, "cube");
  fixture_init(&f, cube_text);
  fixture_refine(&f, 1, false);
  write_sample(&f, "cube_without_normals");
  fixture_init(&f, cube_text);
  fixture_refine(&f, 7, true);
  write_sample(&f, "cube_with_wide_indices");
  f = (fixture){.model = tw_model_create()};
  fixture_refine(&f, 1, true);
  write_sample(&f, "empty");
}

static void write_polygons(void) {
  for (uint32_t level = 0; level < 3; level++) {
    fixture f;
    char name[40];
    snprintf(name, sizeof name, "patchwork_ngon_%u", level);
    fixture_init(&f, patchwork_text);
    fixture_refine(&f, level, true);
    f.scene.polygons = TW_POLYGONS_NGON;
    write_sample(&f, name);
    snprintf(name, sizeof name, "patchwork_%u", level);
    fixture_init(&f, patchwork_text);
    fixture_refine(&f, level, true);
    write_sample(&f, name);
  }
}

static void write_attributes(void) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_add_colors(&f);
  fixture_add_morphs(&f, 3);
  fixture_refine(&f, 2, true);
  write_sample(&f, "colours_and_morphs");
  fixture_init(&f, cube_text);
  fixture_add_morphs(&f, 40);
  fixture_refine(&f, 2, true);
  write_sample(&f, "forty_morphs");
  fixture_init(&f, cube_text);
  fixture_add_skin(&f);
  fixture_refine(&f, 2, true);
  write_sample(&f, "skinned");
}

/* Everything that a vertex can bear, with a bent knee. */
static void write_mapped(uint32_t level) {
  fixture f;
  char name[40];
  tw_error error;
  tw_model *materials = NULL;
  snprintf(name, sizeof name, "skinned_and_mapped_%u", level);
  fixture_init(&f, patchwork_text);
  if (tw_gltf_read((const uint8_t *)mapped_text, strlen(mapped_text), TW_QUADS_AUTO, TW_WELD_AUTO, 0,
                   &materials, &error) != TW_OK)
    abort();
  f.model->assets = materials->assets;
  fixture_add_colors(&f);
  fixture_add_morphs(&f, 3);
  fixture_add_skin(&f);
  f.model->meshes[0].has_tangents = true;
  fixture_refine(&f, level, true);
  tw_trs *pose = fixture_alloc(&f, f.model->node_count, sizeof *pose);
  for (uint32_t i = 0; i < f.model->node_count; i++) pose[i] = f.model->nodes[i].rest;
  pose[f.model->skins[0].joints[0]].translation[0] = 0.5f;
  ref_narrow(ref_axis_angle(1, 2, 3, 0.9), pose[f.model->skins[0].joints[1]].rotation);
  f.scene.pose = pose;
  write_sample(&f, name);
  tw_model_destroy(materials);
}

/* The second UV set is the first one turned; normal maps of half the faces lie on it. */
static void write_two_maps(void) {
  fixture f;
  fixture_init(&f, patchwork_text);
  tw_mesh *mesh = &f.model->meshes[0];
  const tw_uv_set *first = &mesh->uv_sets[0];
  float *turned = fixture_alloc(&f, first->value_count, 2 * sizeof *turned);
  uint8_t *sets = fixture_alloc(&f, mesh->face_count, 1);
  for (uint32_t i = 0; i < first->value_count; i++) {
    turned[2 * i] = 1 - first->values[2 * i + 1];
    turned[2 * i + 1] = first->values[2 * i];
  }
  for (uint32_t face = 0; face < mesh->face_count; face++) sets[face] = face % 2;
  mesh->uv_sets[1] = (tw_uv_set){first->value_count, turned, first->corners};
  mesh->uv_set_count = 2;
  mesh->has_tangents = true;
  mesh->tangent_uvs = sets;
  fixture_refine(&f, 2, true);
  write_sample(&f, "two_maps");
}

static void write_textured(void) {
  fixture f = {0};
  tw_error error;
  if (tw_gltf_read((const uint8_t *)textured_text, strlen(textured_text), TW_QUADS_AUTO, TW_WELD_AUTO, 0,
                   &f.model, &error) != TW_OK) {
    fprintf(stderr, "textured: %s %s\n", error.pointer, error.detail);
    exit(1);
  }
  fixture_refine(&f, 3, true);
  write_sample(&f, "textured");
}

static void write_hierarchy(void) {
  fixture f;
  fixture_init(&f, cube_text);
  uint32_t arm = fixture_node(&f, NULL, 0, TW_NO_INDEX),
           hand = fixture_node(&f, "hand \"\xC3\xA9\" \\", arm, 0);
  fixture_node(&f, NULL, hand, TW_NO_INDEX);
  f.model->nodes[0].rest = (tw_trs){{0.5f, 0.5f, 0.5f, 0.5f}, {1, 2, 3}, {1, 2, 0.5f}};
  f.model->nodes[arm].has_matrix = true;
  static const float turned[16] = {0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1};
  memcpy(f.model->nodes[arm].matrix, turned, sizeof turned);
  f.model->nodes[hand].rest.translation[0] = 0.1f;
  fixture_refine(&f, 1, true);
  write_sample(&f, "hierarchy");

  fixture_init(&f, cube_text);
  fixture_add_clip(&f);
  fixture_refine(&f, 1, true);
  f.scene.clips = f.model->clips;
  f.scene.clip_count = 1;
  write_sample(&f, "animated");

  fixture_init(&f, cube_text);
  fixture_add_clip(&f);
  fixture_refine(&f, 1, true);
  tw_clip *clip = NULL;
  tw_error error;
  tw_trs *pose = fixture_alloc(&f, f.model->node_count, sizeof *pose);
  if (tw_clip_create(&f.model->clips[0], f.model->node_count, -1, &clip, &error) != TW_OK) abort();
  tw_clip_pose(clip, f.model->nodes, f.model->node_count, 1.1f, pose);
  tw_clip_destroy(clip);
  f.scene.pose = pose;
  write_sample(&f, "posed");
}

int main(int count, char **arguments) {
  if (count != 2) {
    fprintf(stderr, "usage: write_samples FOLDER\n");
    return 2;
  }
  folder = arguments[1];
  write_plain();
  write_polygons();
  write_attributes();
  for (uint32_t level = 0; level < 4; level++) write_mapped(level);
  write_two_maps();
  write_textured();
  write_hierarchy();
  return 0;
}
