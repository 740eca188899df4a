/* Writes scenes as GLB files and reads these back. */
#ifndef WRITTEN_GLB_H
#define WRITTEN_GLB_H

#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "scene_fixture.h"

typedef struct glb {
  uint8_t *bytes;
  uint32_t size, json_size, data_size;
  const uint8_t *data;
  cJSON *json;
} glb;

static inline uint32_t u32_at(const uint8_t *bytes) {
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* A scene with everything except images: materials, skin, colours, morphs, clip. */
static inline void everything(fixture *f, uint32_t level) {
  fixture_init(f, patchwork_text);
  fixture_add_skin(f);
  fixture_add_colors(f);
  fixture_add_morphs(f, 3);
  fixture_add_clip(f);
  fixture_refine(f, level, true);
  f->scene.clips = f->model->clips;
  f->scene.clip_count = 1;
}

static inline tw_gltf_stream *open_stream(const tw_scene *scene, tw_format container) {
  tw_gltf_stream *stream = NULL;
  tw_error error;
  if (tw_gltf_stream_create(scene, container, &stream, &error) != TW_OK) fail_msg("%s", error.detail);
  return stream;
}

static inline glb write_glb(const tw_scene *scene) {
  tw_gltf_stream *stream = open_stream(scene, TW_FORMAT_GLB);
  glb file = {.bytes = fixture_read(stream, 1 << 18), .size = (uint32_t)tw_gltf_stream_size(stream)};
  tw_gltf_stream_destroy(stream);
  file.json_size = u32_at(file.bytes + 12);
  file.json = cJSON_ParseWithLength((const char *)file.bytes + 20, file.json_size);
  assert_non_null(file.json);
  uint32_t end = 20 + file.json_size;
  if (end < file.size) {
    file.data_size = u32_at(file.bytes + end);
    file.data = file.bytes + end + 8;
  }
  return file;
}

static inline void free_glb(glb *file) {
  cJSON_Delete(file->json);
  free(file->bytes);
}

static inline const cJSON *at(const glb *file, const char *array, int index) {
  const cJSON *item = cJSON_GetArrayItem(cJSON_GetObjectItem(file->json, array), index);
  assert_non_null(item);
  return item;
}

static inline uint64_t number(const cJSON *object, const char *name, uint64_t otherwise) {
  const cJSON *item = cJSON_GetObjectItem(object, name);
  return item ? (uint64_t)item->valuedouble : otherwise;
}

static inline const cJSON *primitive(const glb *file, int mesh, int index) {
  return cJSON_GetArrayItem(cJSON_GetObjectItem(at(file, "meshes", mesh), "primitives"), index);
}

static inline int attribute(const glb *file, int mesh, const char *semantic) {
  const cJSON *attributes = cJSON_GetObjectItem(primitive(file, mesh, 0), "attributes");
  return (int)number(attributes, semantic, UINT32_MAX);
}

/* The bytes of an accessor's element. Asserts that they lie inside the buffer view, and the view inside the
 * chunk. */
static inline const uint8_t *element(const glb *file, int accessor, uint64_t index, uint32_t element_size) {
  const cJSON *a = at(file, "accessors", accessor);
  const cJSON *view = at(file, "bufferViews", (int)number(a, "bufferView", UINT32_MAX));
  uint64_t stride = number(view, "byteStride", element_size);
  uint64_t within = number(a, "byteOffset", 0) + index * stride;
  assert_true(index < number(a, "count", 0));
  assert_true(within + element_size <= number(view, "byteLength", 0));
  assert_true(number(view, "byteOffset", 0) + number(view, "byteLength", 0) <= file->data_size);
  return file->data + number(view, "byteOffset", 0) + within;
}

static inline void read_floats(const glb *file, int accessor, uint64_t index, uint32_t width, float *out) {
  memcpy(out, element(file, accessor, index, 4 * width), 4 * width);
}

static inline uint32_t read_index(const glb *file, int accessor, uint64_t index) {
  if (number(at(file, "accessors", accessor), "componentType", 0) == 5125)
    return u32_at(element(file, accessor, index, 4));
  const uint8_t *bytes = element(file, accessor, index, 2);
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8;
}

#endif
