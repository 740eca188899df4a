/* GLB and glTF answers: their bytes, and that they say what the surfaces hold. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "scene_fixture.h"

/* ---- reading a GLB ------------------------------------------------------------------------------ */

typedef struct glb {
  uint8_t *bytes;
  uint32_t size, json_size, data_size;
  const uint8_t *data;
  cJSON *json;
} glb;

static uint32_t u32_at(const uint8_t *bytes) {
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static tw_gltf_stream *open_stream(const tw_scene *scene, tw_format container) {
  tw_gltf_stream *stream = NULL;
  tw_error error;
  if (tw_gltf_stream_create(scene, container, &stream, &error) != TW_OK) fail_msg("%s", error.detail);
  return stream;
}

static glb write_glb(const tw_scene *scene) {
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

static void free_glb(glb *file) {
  cJSON_Delete(file->json);
  free(file->bytes);
}

static const cJSON *at(const glb *file, const char *array, int index) {
  const cJSON *item = cJSON_GetArrayItem(cJSON_GetObjectItem(file->json, array), index);
  assert_non_null(item);
  return item;
}

static uint64_t number(const cJSON *object, const char *name, uint64_t otherwise) {
  const cJSON *item = cJSON_GetObjectItem(object, name);
  return item ? (uint64_t)item->valuedouble : otherwise;
}

static const cJSON *primitive(const glb *file, int mesh, int index) {
  return cJSON_GetArrayItem(cJSON_GetObjectItem(at(file, "meshes", mesh), "primitives"), index);
}

static int attribute(const glb *file, int mesh, const char *semantic) {
  const cJSON *attributes = cJSON_GetObjectItem(primitive(file, mesh, 0), "attributes");
  return (int)number(attributes, semantic, UINT32_MAX);
}

/* Where an accessor's element lies; checks that it lies inside its view, and that inside the chunk. */
static const uint8_t *element(const glb *file, int accessor, uint64_t index, uint32_t element_size) {
  const cJSON *a = at(file, "accessors", accessor);
  const cJSON *view = at(file, "bufferViews", (int)number(a, "bufferView", UINT32_MAX));
  uint64_t stride = number(view, "byteStride", element_size);
  uint64_t within = number(a, "byteOffset", 0) + index * stride;
  assert_true(index < number(a, "count", 0));
  assert_true(within + element_size <= number(view, "byteLength", 0));
  assert_true(number(view, "byteOffset", 0) + number(view, "byteLength", 0) <= file->data_size);
  return file->data + number(view, "byteOffset", 0) + within;
}

static void read_floats(const glb *file, int accessor, uint64_t index, uint32_t width, float *out) {
  memcpy(out, element(file, accessor, index, 4 * width), 4 * width);
}

static uint32_t read_index(const glb *file, int accessor, uint64_t index) {
  if (number(at(file, "accessors", accessor), "componentType", 0) == 5125)
    return u32_at(element(file, accessor, index, 4));
  const uint8_t *bytes = element(file, accessor, index, 2);
  return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8;
}

/* ---- the container ------------------------------------------------------------------------------ */

static void glb_lengths_add_up(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, patchwork_text);
  for (uint32_t level = 0; level < 4; level++) {
    fixture_refine(&f, level, true);
    glb file = write_glb(&f.scene);
    assert_memory_equal(file.bytes, "glTF", 4);
    assert_int_equal(u32_at(file.bytes + 4), 2);
    assert_int_equal(u32_at(file.bytes + 8), file.size);
    assert_memory_equal(file.bytes + 16, "JSON", 4);
    assert_int_equal(file.json_size % 4, 0);
    assert_memory_equal(file.data - 4, "BIN\0", 4);
    assert_int_equal(file.data_size % 4, 0);
    assert_int_equal(28 + file.json_size + file.data_size, file.size);
    assert_int_equal(number(at(&file, "buffers", 0), "byteLength", 0), file.data_size);
    free_glb(&file);
    for (uint32_t i = 0; i < f.model->mesh_count; i++) tw_surface_destroy(f.surfaces[i]);
    free(f.surfaces);
    f.surfaces = NULL;
  }
  fixture_deinit(&f);
}

static void views_are_aligned_and_do_not_overlap(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_add_clip(&f);
  fixture_refine(&f, 1, true);
  f.scene.clip = &f.model->clips[0];
  glb file = write_glb(&f.scene);
  uint64_t end = 0;
  const cJSON *view;
  cJSON_ArrayForEach(view, cJSON_GetObjectItem(file.json, "bufferViews")) {
    uint64_t offset = number(view, "byteOffset", 0);
    assert_int_equal(offset % 4, 0);
    assert_true(offset >= end && offset < end + 4);
    end = offset + number(view, "byteLength", 0);
  }
  assert_int_equal((end + 3) / 4 * 4, file.data_size);
  free_glb(&file);
  fixture_deinit(&f);
}

static void model_without_meshes_has_no_binary_chunk(void **state) {
  (void)state;
  fixture f = {.model = tw_model_create()};
  assert_non_null(f.model);
  fixture_node(&f, NULL, TW_NO_INDEX, TW_NO_INDEX);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  assert_int_equal(20 + file.json_size, file.size);
  assert_null(cJSON_GetObjectItem(file.json, "buffers"));
  assert_null(cJSON_GetObjectItem(file.json, "meshes"));
  assert_true(cJSON_IsObject(at(&file, "nodes", 0)));
  free_glb(&file);
  fixture_deinit(&f);
}

static void empty_model_is_an_asset_alone(void **state) {
  (void)state;
  fixture f = {.model = tw_model_create()};
  assert_non_null(f.model);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  assert_null(cJSON_GetObjectItem(file.json, "scenes"));
  assert_null(cJSON_GetObjectItem(file.json, "scene"));
  const cJSON *asset = cJSON_GetObjectItem(file.json, "asset");
  assert_string_equal(cJSON_GetObjectItem(asset, "version")->valuestring, "2.0");
  assert_memory_equal(cJSON_GetObjectItem(asset, "generator")->valuestring, "tweend ", 7);
  free_glb(&file);
  fixture_deinit(&f);
}

/* A fixture with images aside, everything: materials, skin, colours, morphs, clip. */
static void everything(fixture *f, uint32_t level) {
  fixture_init(f, patchwork_text);
  fixture_add_skin(f);
  fixture_add_colors(f);
  fixture_add_morphs(f, 3);
  fixture_add_clip(f);
  fixture_refine(f, level, true);
  f->scene.clip = &f->model->clips[0];
}

static void same_bytes_in_blocks_of_any_size(void **state) {
  (void)state;
  static const size_t blocks[] = {1, 3, 7, 64, 1000, 4096, 4099, 16384, 100001};
  fixture f;
  everything(&f, 3);
  for (int container = TW_FORMAT_GLTF; container <= TW_FORMAT_GLB; container++)
    for (int polygons = 0; polygons < 2; polygons++) {
      f.scene.polygons = (tw_polygons)polygons;
      tw_gltf_stream *stream = open_stream(&f.scene, (tw_format)container);
      size_t size = (size_t)tw_gltf_stream_size(stream);
      uint8_t *whole = fixture_read(stream, SIZE_MAX);
      for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) {
        tw_gltf_stream_seek(stream, 0);
        uint8_t *parts = fixture_read(stream, blocks[i]);
        assert_memory_equal(parts, whole, size);
        free(parts);
      }
      free(whole);
      tw_gltf_stream_destroy(stream);
    }
  fixture_deinit(&f);
}

static void memory_need_not_be_aligned(void **state) {
  (void)state;
  fixture f;
  everything(&f, 4);
  tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
  size_t size = (size_t)tw_gltf_stream_size(stream);
  uint8_t *whole = fixture_read(stream, SIZE_MAX), *shifted = malloc(size + 3);
  assert_non_null(shifted);
  for (size_t shift = 1; shift < 4; shift++) {
    tw_gltf_stream_seek(stream, 0);
    assert_int_equal(tw_gltf_stream_read(stream, shifted + shift, size), size);
    assert_memory_equal(shifted + shift, whole, size);
  }
  free(shifted);
  free(whole);
  tw_gltf_stream_destroy(stream);
  fixture_deinit(&f);
}

static void seek_continues_at_any_offset(void **state) {
  (void)state;
  fixture f;
  everything(&f, 2);
  for (int container = TW_FORMAT_GLTF; container <= TW_FORMAT_GLB; container++) {
    tw_gltf_stream *stream = open_stream(&f.scene, (tw_format)container);
    uint64_t size = tw_gltf_stream_size(stream);
    uint8_t *whole = fixture_read(stream, SIZE_MAX), part[700];
    for (uint64_t step = 0; step < 2000; step++) {
      uint64_t offset = step * 7919 % (size + 1), left = size - offset;
      tw_gltf_stream_seek(stream, offset);
      size_t got = tw_gltf_stream_read(stream, part, 1 + step % sizeof part);
      assert_int_equal(got, left < 1 + step % sizeof part ? left : 1 + step % sizeof part);
      assert_memory_equal(part, whole + offset, got);
    }
    tw_gltf_stream_seek(stream, size + 5);
    assert_int_equal(tw_gltf_stream_read(stream, part, sizeof part), 0);
    free(whole);
    tw_gltf_stream_destroy(stream);
  }
  fixture_deinit(&f);
}

static void prediction_is_the_size(void **state) {
  (void)state;
  fixture f;
  everything(&f, 2);
  for (int container = TW_FORMAT_GLTF; container <= TW_FORMAT_GLB; container++) {
    tw_gltf_stream *stream = open_stream(&f.scene, (tw_format)container);
    uint8_t *bytes = fixture_read(stream, SIZE_MAX), more[1];
    assert_int_equal(tw_gltf_stream_read(stream, more, 1), 0);
    uint64_t size = 0;
    assert_int_equal(tw_gltf_stream_predict(&f.scene, (tw_format)container, &size, NULL), TW_OK);
    assert_int_equal(size, tw_gltf_stream_size(stream));
    free(bytes);
    tw_gltf_stream_destroy(stream);
  }
  fixture_deinit(&f);
}

static void glb_over_four_gibibytes_is_refused(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, cube_text);
  fixture_refine(&f, 12, true); /* 100 million points of 24 bytes, 201 million triangles of 12 */
  uint64_t size = 77;
  tw_error error;
  assert_int_equal(tw_gltf_stream_predict(&f.scene, TW_FORMAT_GLB, &size, &error), TW_LIMIT);
  assert_int_equal(size, 77);
  tw_gltf_stream *stream = NULL;
  assert_int_equal(tw_gltf_stream_create(&f.scene, TW_FORMAT_GLB, &stream, &error), TW_LIMIT);
  assert_null(stream);
  assert_int_equal(tw_gltf_stream_predict(&f.scene, TW_FORMAT_GLTF, &size, &error), TW_OK);
  assert_true(size > UINT64_C(4294967295) / 3 * 4);
  fixture_deinit(&f);
}

static uint32_t base64_value(char letter) {
  if (letter >= 'A' && letter <= 'Z') return (uint32_t)(letter - 'A');
  if (letter >= 'a' && letter <= 'z') return (uint32_t)(letter - 'a') + 26;
  if (letter >= '0' && letter <= '9') return (uint32_t)(letter - '0') + 52;
  assert_true(letter == '+' || letter == '/' || letter == '=');
  return letter == '/' ? 63 : letter == '+' ? 62 : 0;
}

static void gltf_holds_the_same_as_glb(void **state) {
  (void)state;
  fixture f;
  everything(&f, 1);
  glb file = write_glb(&f.scene);
  tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLTF);
  uint8_t *text = fixture_read(stream, 1000);
  cJSON *json = cJSON_ParseWithLength((char *)text, (size_t)tw_gltf_stream_size(stream));
  assert_non_null(json);
  cJSON *buffer = cJSON_GetArrayItem(cJSON_GetObjectItem(json, "buffers"), 0);
  cJSON *uri = cJSON_DetachItemFromObject(buffer, "uri");
  static const char prefix[] = "data:application/octet-stream;base64,";
  assert_memory_equal(uri->valuestring, prefix, sizeof prefix - 1);
  const char *letters = uri->valuestring + sizeof prefix - 1;
  assert_int_equal(strlen(letters), (file.data_size + 2) / 3 * 4);
  for (uint32_t i = 0; i < file.data_size; i++) {
    uint32_t bits = 0;
    for (uint32_t j = 0; j < 4; j++) bits = bits << 6 | base64_value(letters[i / 3 * 4 + j]);
    assert_int_equal(bits >> (16 - i % 3 * 8) & 255, file.data[i]);
  }
  assert_true(cJSON_Compare(json, file.json, true));
  cJSON_Delete(uri);
  cJSON_Delete(json);
  free(text);
  tw_gltf_stream_destroy(stream);
  free_glb(&file);
  fixture_deinit(&f);
}

/* ---- meshes ------------------------------------------------------------------------------------- */

static void vertices_are_the_rows_of_the_surface(void **state) {
  (void)state;
  fixture f;
  everything(&f, 2);
  glb file = write_glb(&f.scene);
  const tw_surface *surface = f.surfaces[0];
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
  assert_int_equal(number(at(&file, "accessors", attribute(&file, 0, "POSITION")), "count", 0), rows);
  float row[64] = {0}, found[4];
  assert_true(layout->stride <= 64);
  const struct {
    const char *semantic;
    uint32_t column, width;
  } attributes[] = {{"POSITION", layout->position, 3},
                    {"NORMAL", layout->normal, 3},
                    {"TEXCOORD_0", layout->uvs[0], 2},
                    {"COLOR_0", layout->color, 4}};
  for (uint64_t i = 0; i < rows; i++) {
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
    for (size_t a = 0; a < sizeof attributes / sizeof *attributes; a++) {
      read_floats(&file, attribute(&file, 0, attributes[a].semantic), i, attributes[a].width, found);
      assert_memory_equal(found, row + attributes[a].column, 4 * attributes[a].width);
    }
    for (uint32_t t = 0; t < 3; t++) {
      const cJSON *targets = cJSON_GetObjectItem(primitive(&file, 0, 0), "targets");
      const cJSON *target = cJSON_GetArrayItem(targets, (int)t);
      read_floats(&file, (int)number(target, "POSITION", UINT32_MAX), i, 3, found);
      assert_memory_equal(found, row + layout->morphs + 3 * t, 12);
    }
  }
  tw_surface_reader_destroy(reader);
  free_glb(&file);
  fixture_deinit(&f);
}

static void joints_travel_as_unsigned_shorts(void **state) {
  (void)state;
  fixture f;
  everything(&f, 2);
  glb file = write_glb(&f.scene);
  const tw_surface_layout *layout = tw_surface_get_layout(f.surfaces[0]);
  tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
  assert_true(layout->joints != UINT32_MAX && layout->stride <= 64);
  uint64_t rows = tw_surface_row_count(f.surfaces[0], TW_DOMAIN_VERTICES);
  for (uint64_t i = 0; i < rows; i++) {
    float row[64] = {0}, found[4] = {0};
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
    read_floats(&file, attribute(&file, 0, "WEIGHTS_0"), i, 4, found);
    assert_memory_equal(found, row + layout->weights, sizeof found);
    const uint8_t *joints = element(&file, attribute(&file, 0, "JOINTS_0"), i, 8);
    for (uint32_t j = 0; j < 4; j++) { /* 0 where the weight is 0 */
      uint32_t joint = found[j] > 0 ? (uint32_t)row[layout->joints + j] : 0;
      assert_int_equal((uint32_t)joints[2 * j] | (uint32_t)joints[2 * j + 1] << 8, joint);
    }
  }
  tw_surface_reader_destroy(reader);
  free_glb(&file);
  fixture_deinit(&f);
}

static void meshes_of_a_scene_do_not_mix(void **state) {
  (void)state;
  char text[sizeof cube_text + sizeof patchwork_text + 64];
  snprintf(text, sizeof text, "%so small\nv 0 0 0\nv 1 0 5\nv 0 1 0\nf -3 -2 -1\n", cube_text);
  fixture f;
  fixture_init(&f, text);
  assert_int_equal(f.model->mesh_count, 2);
  fixture_refine(&f, 5, true);
  glb file = write_glb(&f.scene);
  tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
  for (uint32_t step = 0; step < 500; step++) { /* from one mesh to the other and back */
    uint8_t part[5000];
    uint32_t offset = (uint32_t)((uint64_t)step * 27644437 % file.size);
    tw_gltf_stream_seek(stream, offset);
    size_t got = tw_gltf_stream_read(stream, part, sizeof part);
    assert_memory_equal(part, file.bytes + offset, got);
  }
  tw_gltf_stream_destroy(stream);
  for (int mesh = 0; mesh < 2; mesh++) {
    tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[mesh]);
    uint64_t rows = tw_surface_row_count(f.surfaces[mesh], TW_DOMAIN_VERTICES);
    for (uint64_t i = 0; i < rows; i++) {
      float row[6] = {0}, found[3] = {0};
      tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
      read_floats(&file, attribute(&file, mesh, "POSITION"), i, 3, found);
      assert_memory_equal(found, row, sizeof found);
    }
    tw_surface_reader_destroy(reader);
  }
  free_glb(&file);
  fixture_deinit(&f);
}

static void bounds_are_exact(void **state) {
  (void)state;
  fixture f;
  everything(&f, 3);
  glb file = write_glb(&f.scene);
  const cJSON *accessor;
  int index = 0, seen = 0;
  cJSON_ArrayForEach(accessor, cJSON_GetObjectItem(file.json, "accessors")) {
    const cJSON *min = cJSON_GetObjectItem(accessor, "min"), *max = cJSON_GetObjectItem(accessor, "max");
    int width = cJSON_GetArraySize(min);
    assert_int_equal(width, cJSON_GetArraySize(max));
    for (int axis = 0; axis < width; axis++) {
      double low = INFINITY, high = -INFINITY;
      for (uint64_t i = 0; i < number(accessor, "count", 0); i++) {
        float value[3] = {0};
        read_floats(&file, index, i, (uint32_t)width, value);
        low = fmin(low, (double)value[axis]);
        high = fmax(high, (double)value[axis]);
      }
      assert_true(cJSON_GetArrayItem(min, axis)->valuedouble == low);
      assert_true(cJSON_GetArrayItem(max, axis)->valuedouble == high);
      seen++;
    }
    index++;
  }
  assert_true(seen >= 12); /* POSITION and three targets, besides times */
  free_glb(&file);
  fixture_deinit(&f);
}

static void too_many_parts_are_over_a_limit(void **state) {
  (void)state;
  fixture f = {.model = tw_model_create()};
  assert_non_null(f.model);
  fixture_refine(&f, 1, true);
  f.model->node_count = (1 << 18) + 1;
  f.model->nodes = fixture_alloc(&f, f.model->node_count, sizeof *f.model->nodes);
  uint64_t size = 7;
  tw_error error;
  assert_int_equal(tw_gltf_stream_predict(&f.scene, TW_FORMAT_GLB, &size, &error), TW_LIMIT);
  assert_non_null(strstr(error.detail, "262145 nodes, materials, accessors and buffer views"));
  assert_int_equal(size, 7);
  fixture_deinit(&f);
}

static void many_targets_keep_strides_legal(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_morphs(&f, 50);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  const cJSON *view, *targets = cJSON_GetObjectItem(primitive(&file, 0, 0), "targets");
  cJSON_ArrayForEach(view, cJSON_GetObjectItem(file.json, "bufferViews"))
      assert_true(number(view, "byteStride", 4) <= 252);
  assert_int_equal(cJSON_GetArraySize(targets), 50);
  const tw_surface_layout *layout = tw_surface_get_layout(f.surfaces[0]);
  tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
  float row[TW_MORPH_TARGETS_MAX * 3 + 6], found[3];
  for (uint64_t i = 0; i < 26; i++) {
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
    for (int t = 0; t < 50; t++) {
      const cJSON *target = cJSON_GetArrayItem(targets, t);
      read_floats(&file, (int)number(target, "POSITION", UINT32_MAX), i, 3, found);
      assert_memory_equal(found, row + layout->morphs + 3 * t, 12);
    }
  }
  assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(at(&file, "meshes", 0), "weights")), 50);
  tw_surface_reader_destroy(reader);
  free_glb(&file);
  fixture_deinit(&f);
}

/* The faces of a primitive that its triangles say: fans from the first corner, rotated as they are. */
static void triangles_are_the_faces(const glb *file, fixture *f, bool ngons) {
  const tw_surface *surface = f->surfaces[0];
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  int written = 0;
  for (uint32_t g = 0; g < tw_surface_group_count(surface); g++) {
    const tw_surface_group *group = tw_surface_get_group(surface, g);
    const cJSON *faces = primitive(file, 0, written++);
    int indices = (int)number(faces, "indices", UINT32_MAX);
    assert_int_equal((int32_t)number(faces, "material", UINT32_MAX), group->material);
    uint64_t next = 0;
    uint32_t before = UINT32_MAX;
    for (uint64_t face = group->first_face; face < group->first_face + group->face_count; face++) {
      uint32_t corners[16], size = 0, start = 0;
      tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, face, 1, &size, corners);
      uint32_t apex = read_index(file, indices, next);
      while (start < size && corners[start] != apex) start++;
      assert_true(start < size);
      if (!ngons) assert_int_equal(start, 0);
      if (ngons) assert_int_not_equal(apex, before);
      before = apex;
      for (uint32_t t = 0; t + 2 < size; t++) {
        assert_int_equal(read_index(file, indices, next++), apex);
        assert_int_equal(read_index(file, indices, next++), corners[(start + t + 1) % size]);
        assert_int_equal(read_index(file, indices, next++), corners[(start + t + 2) % size]);
      }
    }
    assert_int_equal(number(at(file, "accessors", indices), "count", 0), next);
  }
  tw_surface_reader_destroy(reader);
}

static void faces_become_fans_by_material(void **state) {
  (void)state;
  for (uint32_t level = 0; level < 4; level++)
    for (int ngons = 0; ngons < 2; ngons++) {
      fixture f;
      fixture_init(&f, patchwork_text);
      fixture_refine(&f, level, true);
      f.scene.polygons = ngons ? TW_POLYGONS_NGON : TW_POLYGONS_TRIANGLES;
      glb file = write_glb(&f.scene);
      assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(at(&file, "meshes", 0), "primitives")), 3);
      triangles_are_the_faces(&file, &f, ngons);
      const cJSON *used = cJSON_GetObjectItem(file.json, "extensionsUsed");
      const cJSON *declared = cJSON_GetObjectItem(primitive(&file, 0, 2), "extensions");
      assert_int_equal(cJSON_GetArraySize(used), ngons);
      assert_int_equal(cJSON_HasObjectItem(declared, "FB_ngon_encoding"), ngons);
      assert_string_equal(cJSON_GetObjectItem(at(&file, "materials", 1), "name")->valuestring, "green");
      free_glb(&file);
      fixture_deinit(&f);
    }
}

static bool same_point(const float a[3], const float b[3]) {
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Whether two faces have the same corners in the same order, from wherever they begin. */
static bool same_face(const float (*a)[3], const float (*b)[3], uint32_t size) {
  for (uint32_t start = 0; start < size; start++) {
    uint32_t i = 0;
    while (i < size && same_point(a[i], b[(start + i) % size])) i++;
    if (i == size) return true;
  }
  return false;
}

static void polygons_read_back_as_they_were(void **state) {
  (void)state;
  for (uint32_t level = 0; level < 3; level++) {
    fixture f;
    fixture_init(&f, patchwork_text);
    fixture_refine(&f, level, true);
    f.scene.polygons = TW_POLYGONS_NGON;
    glb file = write_glb(&f.scene);
    tw_model *model = NULL;
    tw_error error;
    const tw_read_limits limits = {0};
    if (tw_gltf_read(file.bytes, file.size, TW_QUADS_NGON, &limits, &model, &error) != TW_OK)
      fail_msg("%s %s", error.pointer, error.detail);
    const tw_mesh *mesh = &model->meshes[0];
    assert_int_equal(mesh->face_count, tw_surface_get_counts(f.surfaces[0])->faces);
    tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
    for (uint32_t face = 0; face < mesh->face_count; face++) {
      uint32_t corners[16], size = 0, first = mesh->face_offsets[face];
      float wanted[16][3], found[16][3];
      tw_surface_read_faces(reader, TW_DOMAIN_POINTS, face, 1, &size, corners);
      assert_int_equal(mesh->face_offsets[face + 1] - first, size);
      for (uint32_t i = 0; i < size; i++) {
        tw_surface_read_rows(reader, TW_DOMAIN_POINTS, corners[i], 1, wanted[i]);
        memcpy(found[i], mesh->positions + 3 * (size_t)mesh->corners[first + i], sizeof found[i]);
      }
      assert_true(same_face((const float(*)[3])wanted, (const float(*)[3])found, size));
    }
    tw_surface_reader_destroy(reader);
    tw_model_destroy(model);
    free_glb(&file);
    fixture_deinit(&f);
  }
}

/* `count` polygons of `size` corners each, one over the other. */
static void init_polygons(fixture *f, uint32_t count, uint32_t size) {
  char *text = malloc((size_t)count * size * 64 + 16), *end = text;
  assert_non_null(text);
  for (uint32_t i = 0; i < count * size; i++) {
    double angle = 6.283185307179586 * i / size;
    end += sprintf(end, "v %.9g %.9g %u\n", cos(angle), sin(angle), i / size);
  }
  for (uint32_t i = 0; i < count * size; i++) end += sprintf(end, "%s %u", i % size ? "" : "\nf", i + 1);
  sprintf(end, "\n");
  fixture_init(f, text);
  free(text);
}

static void polygon_larger_than_any_block_is_a_fan(void **state) {
  (void)state;
  fixture f;
  init_polygons(&f, 1, 40000);
  fixture_refine(&f, 0, false);
  tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
  uint8_t *small = fixture_read(stream, 100);
  glb file = write_glb(&f.scene);
  assert_memory_equal(small, file.bytes, file.size);
  for (uint32_t t = 0; t < 39998; t++) {
    assert_int_equal(read_index(&file, 1, 3 * t), 0);
    assert_int_equal(read_index(&file, 1, 3 * t + 1), t + 1);
    assert_int_equal(read_index(&file, 1, 3 * t + 2), t + 2);
  }
  free(small);
  tw_gltf_stream_destroy(stream);
  free_glb(&file);
  fixture_deinit(&f);
}

static void polygons_larger_than_any_block_stand_side_by_side(void **state) {
  (void)state;
  fixture f;
  init_polygons(&f, 4, 3000);
  fixture_refine(&f, 0, false);
  f.scene.polygons = TW_POLYGONS_NGON;
  tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
  uint8_t *small = fixture_read(stream, 5000);
  glb file = write_glb(&f.scene);
  assert_memory_equal(small, file.bytes, file.size);
  for (uint32_t t = 0; t < 4 * 2998; t++) assert_int_equal(read_index(&file, 1, 3 * t), t / 2998 * 3000);
  free(small);
  tw_gltf_stream_destroy(stream);
  free_glb(&file);
  fixture_deinit(&f);
}

/* Faces that begin at the same point in twos (the first alone when `shift` is 1) or all. */
static void init_common_starts(fixture *f, int shift, int together) {
  enum { FACES = 5001 };
  char *text = malloc((size_t)FACES * 200), *end = text;
  assert_non_null(text);
  for (int i = 0; i < 3 * FACES; i++) end += sprintf(end, "v %d %d 0\n", i, i * i % 1009);
  for (int i = 0; i < FACES; i++)
    end += sprintf(end, "f %d %d %d\n", (i + shift) / together + 1, FACES + 2 * i + 1, FACES + 2 * i + 2);
  fixture_init(f, text);
  free(text);
}

static void neighbours_never_start_from_one_vertex(void **state) {
  (void)state;
  static const int kinds[3][2] = {{0, 2}, {1, 2}, {0, 10000}};
  for (int kind = 0; kind < 3; kind++) {
    fixture f;
    init_common_starts(&f, kinds[kind][0], kinds[kind][1]);
    fixture_refine(&f, 0, false);
    f.scene.polygons = TW_POLYGONS_NGON;
    glb file = write_glb(&f.scene);
    triangles_are_the_faces(&file, &f, true);
    tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
    for (size_t block = 6; block < 20000; block = block * 3 + 6) {
      tw_gltf_stream_seek(stream, 0);
      uint8_t *parts = fixture_read(stream, block);
      assert_memory_equal(parts, file.bytes, file.size);
      free(parts);
    }
    tw_gltf_stream_destroy(stream);
    free_glb(&file);
    fixture_deinit(&f);
  }
}

static void indices_are_short_up_to_65535_vertices(void **state) {
  (void)state;
  for (uint32_t size = 65534; size < 65538; size++) {
    fixture f;
    init_polygons(&f, 1, size);
    fixture_refine(&f, 0, false);
    glb file = write_glb(&f.scene);
    assert_int_equal(number(at(&file, "accessors", 0), "count", 0), size);
    assert_int_equal(number(at(&file, "accessors", 1), "componentType", 0), size <= 65535 ? 5123 : 5125);
    assert_int_equal(read_index(&file, 1, 3 * (size - 2) - 1), size - 1);
    free_glb(&file);
    fixture_deinit(&f);
  }
}

static void mesh_without_faces_is_left_out(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, cube_text);
  tw_mesh *meshes = fixture_alloc(&f, 2, sizeof *meshes);
  tw_mesh_init(&meshes[0]);
  meshes[0].face_offsets = fixture_alloc(&f, 1, sizeof(uint32_t));
  meshes[1] = f.model->meshes[0];
  f.model->meshes = meshes;
  f.model->mesh_count = 2;
  fixture_node(&f, "full", TW_NO_INDEX, 1);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(file.json, "meshes")), 1);
  assert_false(cJSON_HasObjectItem(at(&file, "nodes", 0), "mesh"));
  assert_int_equal(number(at(&file, "nodes", 1), "mesh", 9), 0);
  free_glb(&file);
  fixture_deinit(&f);
}

/* ---- materials ---------------------------------------------------------------------------------- */

static const char materials_text[] =
    "{\"asset\":{\"version\":\"2.0\",\"copyright\":\"nobody\"},"
    "\"images\":[{\"uri\":\"far/away.png\"},"
    "{\"name\":\"near\",\"mimeType\":\"image/png\",\"uri\":\"data:image/png;base64,iVBORw0KGgoBAgME\"}],"
    "\"textures\":[{\"source\":1}],\"extensionsUsed\":[\"KHR_materials_unlit\"],"
    "\"materials\":[{\"emissiveTexture\":{\"index\":0},\"extensions\":{\"KHR_materials_unlit\":{}}}]}";

static void materials_and_images_go_through(void **state) {
  (void)state;
  static const uint8_t picture[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n', 1, 2, 3, 4};
  fixture f = {0};
  tw_error error;
  const tw_read_limits limits = {0};
  if (tw_gltf_read((const uint8_t *)materials_text, sizeof materials_text - 1, TW_QUADS_NGON, &limits,
                   &f.model, &error) != TW_OK)
    fail_msg("%s %s", error.pointer, error.detail);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  assert_string_equal(cJSON_GetObjectItem(at(&file, "images", 0), "uri")->valuestring, "far/away.png");
  const cJSON *near = at(&file, "images", 1);
  assert_string_equal(cJSON_GetObjectItem(near, "name")->valuestring, "near");
  assert_string_equal(cJSON_GetObjectItem(near, "mimeType")->valuestring, "image/png");
  assert_false(cJSON_HasObjectItem(near, "uri"));
  const cJSON *view = at(&file, "bufferViews", (int)number(near, "bufferView", 99));
  assert_int_equal(number(view, "byteLength", 0), sizeof picture);
  assert_memory_equal(file.data + number(view, "byteOffset", 0), picture, sizeof picture);
  assert_int_equal(number(at(&file, "textures", 0), "source", 99), 1);
  assert_true(cJSON_HasObjectItem(cJSON_GetObjectItem(at(&file, "materials", 0), "extensions"),
                                  "KHR_materials_unlit"));
  assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(file.json, "extensionsUsed")), 1);
  const cJSON *asset = cJSON_GetObjectItem(file.json, "asset");
  assert_string_equal(cJSON_GetObjectItem(asset, "copyright")->valuestring, "nobody");
  free_glb(&file);
  fixture_deinit(&f);
}

/* ---- nodes, skins, clips ------------------------------------------------------------------------ */

static void nodes_keep_names_order_and_transforms(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, cube_text);
  static const char odd[] = "say \"\xC3\xA4\" \\ /";
  uint32_t child = fixture_node(&f, odd, 0, TW_NO_INDEX);
  uint32_t grandchild = fixture_node(&f, NULL, child, TW_NO_INDEX);
  f.model->nodes[child].rest = (tw_trs){{1, 2, 0.1f}, {0, 0.6f, 0, 0.8f}, {1, 1, 1}};
  f.model->nodes[grandchild].has_matrix = true;
  static const float sheared[16] = {1, 0, 0, 0, 0.5f, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1};
  memcpy(f.model->nodes[grandchild].matrix, sheared, sizeof sheared);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  const cJSON *node = at(&file, "nodes", (int)child);
  assert_string_equal(cJSON_GetObjectItem(node, "name")->valuestring, odd);
  const cJSON *translation = cJSON_GetObjectItem(node, "translation");
  assert_true((float)cJSON_GetArrayItem(translation, 2)->valuedouble == 0.1f);
  assert_true((float)cJSON_GetArrayItem(cJSON_GetObjectItem(node, "rotation"), 1)->valuedouble == 0.6f);
  assert_false(cJSON_HasObjectItem(node, "scale"));
  assert_int_equal(cJSON_GetArrayItem(cJSON_GetObjectItem(node, "children"), 0)->valueint, grandchild);
  const cJSON *last = at(&file, "nodes", (int)grandchild);
  assert_false(cJSON_HasObjectItem(last, "children"));
  assert_true(cJSON_GetArrayItem(cJSON_GetObjectItem(last, "matrix"), 4)->valuedouble == 0.5);
  const cJSON *roots = cJSON_GetObjectItem(at(&file, "scenes", 0), "nodes");
  assert_int_equal(cJSON_GetArraySize(roots), 1);
  free_glb(&file);
  fixture_deinit(&f);
}

static void pose_takes_the_place_of_rest(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, cube_text);
  fixture_refine(&f, 1, true);
  tw_trs pose = TW_TRS_IDENTITY;
  pose.translation[1] = 4;
  f.scene.pose = &pose;
  glb file = write_glb(&f.scene);
  const cJSON *translation = cJSON_GetObjectItem(at(&file, "nodes", 0), "translation");
  assert_true(cJSON_GetArrayItem(translation, 1)->valuedouble == 4);
  free_glb(&file);
  fixture_deinit(&f);
}

static void animated_node_gives_up_its_matrix(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_clip(&f);
  fixture_refine(&f, 1, true);
  for (int i = 0; i < 2; i++) {
    f.model->nodes[i].has_matrix = true;
    for (int j = 0; j < 4; j++) f.model->nodes[i].matrix[5 * j] = 1;
  }
  f.scene.clip = &f.model->clips[0];
  glb file = write_glb(&f.scene);
  assert_true(cJSON_HasObjectItem(at(&file, "nodes", 0), "matrix"));
  assert_false(cJSON_HasObjectItem(at(&file, "nodes", 1), "matrix"));
  free_glb(&file);
  fixture_deinit(&f);
}

static void skin_stays_with_its_node(void **state) {
  (void)state;
  fixture f;
  everything(&f, 1);
  glb file = write_glb(&f.scene);
  const cJSON *skin = at(&file, "skins", 0);
  assert_int_equal(number(at(&file, "nodes", 0), "skin", 9), 0);
  assert_int_equal(number(skin, "skeleton", 99), 1);
  assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(skin, "joints")), 2);
  float matrix[16] = {0};
  read_floats(&file, (int)number(skin, "inverseBindMatrices", UINT32_MAX), 1, 16, matrix);
  assert_memory_equal(matrix, f.model->skins[0].inverse_bind + 16, sizeof matrix);
  free_glb(&file);
  fixture_deinit(&f);
}

static void skin_goes_where_the_surface_has_no_joints(void **state) {
  (void)state;
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_skin(&f);
  f.model->meshes[0].skin = (tw_skin_weights){0}; /* as a baked mesh */
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  assert_false(cJSON_HasObjectItem(at(&file, "nodes", 0), "skin"));
  assert_false(cJSON_HasObjectItem(file.json, "skins"));
  free_glb(&file);
  fixture_deinit(&f);
}

static void clip_becomes_an_animation(void **state) {
  (void)state;
  static const char *const interpolations[] = {"LINEAR",      "LINEAR", "LINEAR",      "LINEAR",
                                               "CUBICSPLINE", "STEP",   "CUBICSPLINE", "LINEAR"};
  fixture f;
  everything(&f, 1);
  glb file = write_glb(&f.scene);
  const cJSON *animation = at(&file, "animations", 0);
  assert_string_equal(cJSON_GetObjectItem(animation, "name")->valuestring, "aim");
  const tw_clip_keys *clip = f.scene.clip;
  for (int i = 0; i < (int)clip->track_count; i++) {
    const tw_track_keys *track = &clip->tracks[i];
    const cJSON *channel = cJSON_GetArrayItem(cJSON_GetObjectItem(animation, "channels"), i);
    const cJSON *sampler =
        cJSON_GetArrayItem(cJSON_GetObjectItem(animation, "samplers"), (int)number(channel, "sampler", 99));
    assert_int_equal(number(cJSON_GetObjectItem(channel, "target"), "node", 99), track->node);
    assert_string_equal(cJSON_GetObjectItem(sampler, "interpolation")->valuestring, interpolations[i]);
    int input = (int)number(sampler, "input", UINT32_MAX),
        output = (int)number(sampler, "output", UINT32_MAX);
    uint64_t keys = number(at(&file, "accessors", input), "count", 0);
    uint64_t values = number(at(&file, "accessors", output), "count", 0);
    assert_int_equal(values, track->interpolation == TW_CUBICSPLINE ? 3 * keys : keys);
    float first, last;
    read_floats(&file, input, 0, 1, &first);
    read_floats(&file, input, keys - 1, 1, &last);
    assert_true(first == track->times[0] && last == track->times[track->key_count - 1]);
  }
  free_glb(&file);
  fixture_deinit(&f);
}

static void weights_go_only_to_meshes_with_as_many_targets(void **state) {
  (void)state;
  static const float times[2] = {0, 1}, values[2][3] = {{0, 0.5f, 1}, {1, 0.5f, 0}};
  tw_track_keys track = {.node = 0,
                         .path = TW_WEIGHTS,
                         .interpolation = TW_LINEAR,
                         .width = 3,
                         .key_count = 2,
                         .times = times,
                         .values = values[0]};
  tw_clip_keys clip = {.track_count = 1, .tracks = &track};
  for (uint32_t targets = 2; targets < 4; targets++) {
    fixture f;
    fixture_init(&f, cube_text);
    fixture_add_morphs(&f, targets);
    fixture_refine(&f, 1, true);
    f.scene.clip = &clip;
    glb file = write_glb(&f.scene);
    assert_int_equal(cJSON_HasObjectItem(file.json, "animations"), targets == 3);
    if (targets == 3) {
      const cJSON *samplers = cJSON_GetObjectItem(at(&file, "animations", 0), "samplers");
      int output = (int)number(cJSON_GetArrayItem(samplers, 0), "output", UINT32_MAX);
      assert_int_equal(number(at(&file, "accessors", output), "count", 0), 6);
      assert_string_equal(cJSON_GetObjectItem(at(&file, "accessors", output), "type")->valuestring, "SCALAR");
    }
    free_glb(&file);
    fixture_deinit(&f);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(glb_over_four_gibibytes_is_refused),
      cmocka_unit_test(glb_lengths_add_up),
      cmocka_unit_test(views_are_aligned_and_do_not_overlap),
      cmocka_unit_test(model_without_meshes_has_no_binary_chunk),
      cmocka_unit_test(empty_model_is_an_asset_alone),
      cmocka_unit_test(same_bytes_in_blocks_of_any_size),
      cmocka_unit_test(memory_need_not_be_aligned),
      cmocka_unit_test(seek_continues_at_any_offset),
      cmocka_unit_test(prediction_is_the_size),
      cmocka_unit_test(gltf_holds_the_same_as_glb),
      cmocka_unit_test(vertices_are_the_rows_of_the_surface),
      cmocka_unit_test(joints_travel_as_unsigned_shorts),
      cmocka_unit_test(meshes_of_a_scene_do_not_mix),
      cmocka_unit_test(bounds_are_exact),
      cmocka_unit_test(too_many_parts_are_over_a_limit),
      cmocka_unit_test(many_targets_keep_strides_legal),
      cmocka_unit_test(faces_become_fans_by_material),
      cmocka_unit_test(polygons_read_back_as_they_were),
      cmocka_unit_test(polygon_larger_than_any_block_is_a_fan),
      cmocka_unit_test(polygons_larger_than_any_block_stand_side_by_side),
      cmocka_unit_test(neighbours_never_start_from_one_vertex),
      cmocka_unit_test(indices_are_short_up_to_65535_vertices),
      cmocka_unit_test(mesh_without_faces_is_left_out),
      cmocka_unit_test(materials_and_images_go_through),
      cmocka_unit_test(nodes_keep_names_order_and_transforms),
      cmocka_unit_test(pose_takes_the_place_of_rest),
      cmocka_unit_test(animated_node_gives_up_its_matrix),
      cmocka_unit_test(skin_stays_with_its_node),
      cmocka_unit_test(skin_goes_where_the_surface_has_no_joints),
      cmocka_unit_test(clip_becomes_an_animation),
      cmocka_unit_test(weights_go_only_to_meshes_with_as_many_targets),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
