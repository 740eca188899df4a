/* GLB and glTF answers: their bytes, in blocks of any size. */
#include <stdlib.h>
#include <string.h>

#include "test.h"
#include "written_glb.h"

TEST(glb_lengths_add_up) {
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

TEST(views_are_aligned_and_do_not_overlap) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_add_clip(&f);
  fixture_refine(&f, 1, true);
  f.scene.clips = f.model->clips;
  f.scene.clip_count = 1;
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

TEST(model_without_meshes_has_no_binary_chunk) {
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

TEST(empty_model_is_an_asset_alone) {
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

TEST(same_bytes_in_blocks_of_any_size) {
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

TEST(memory_need_not_be_aligned) {
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

TEST(seek_continues_at_any_offset) {
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

TEST(prediction_is_the_size) {
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

TEST(glb_over_four_gibibytes_is_refused) {
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

TEST(gltf_holds_the_same_as_glb) {
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
