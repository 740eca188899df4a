/* Accessors read from glTF: bad ones first, then every kind of good ones. */
#include <math.h>

#include "glb.h"
#include "square_and_cube.h"

TEST(accessors_that_lie_are_refused) {
  static const struct {
    const char *accessors, *pointer;
  } cases[] = {
      {ACCESSOR(0, 0, F32, 5, VEC3), "/accessors/0"},
      {ACCESSOR(0, 0, F32, 4294967294, VEC3), "/accessors/0"},
      {ACCESSOR(0, 0, F32, 4294967295, VEC3), "/accessors/0/count"},
      {ACCESSOR(0, 0, F32, 18446744073709551615, VEC3), "/accessors/0/count"},
      {ACCESSOR(0, 0, F32, 0, VEC3), "/accessors/0/count"},
      {ACCESSOR(0, 4, F32, 4, VEC3), "/accessors/0"},
      {ACCESSOR(0, 18446744073709551612, F32, 4, VEC3), "/accessors/0"},
      {ACCESSOR(7, 0, F32, 4, VEC3), "/accessors/0/bufferView"},
      {"{'bufferView':0,'componentType':5130,'count':1,'type':'VEC3'}", "/accessors/0/componentType"},
      {"{'bufferView':0,'componentType':5126,'normalized':true,'count':4,'type':'VEC3'}",
       "/accessors/0/normalized"},
      {ACCESSOR(0, 0, F32, 4, VEC2), "/accessors/0/type"},
      {ACCESSOR(0, 0, F32, 2, VEC3), "/accessors/1"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char accessors[1024];
    snprintf(accessors, sizeof accessors, "%s," INDICES, cases[i].accessors);
    glb_refused(square_json(accessors, PRIMITIVE), &square, sizeof square, TW_INVALID, cases[i].pointer);
  }
  glb_refused(square_json("{'componentType':5126,'count':99999999,'type':'VEC3'}," INDICES, PRIMITIVE),
              &square, sizeof square, TW_LIMIT, "/accessors/0/count");
}

TEST(bad_indices_are_refused) {
  static const struct {
    const char *accessor, *pointer;
  } cases[] = {
      {ACCESSOR(1, 0, F32, 6, SCALAR), "/accessors/1/componentType"},
      {ACCESSOR(1, 0, I16, 6, SCALAR), "/accessors/1/componentType"},
      {ACCESSOR(1, 0, U16, 6, VEC2), "/accessors/1/type"},
      {ACCESSOR(1, 0, U16, 5, SCALAR), "/meshes/0/primitives/0"},
      {ACCESSOR(1, 0, U16, 2, SCALAR), "/meshes/0/primitives/0"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char accessors[1024];
    snprintf(accessors, sizeof accessors, POSITIONS ",%s", cases[i].accessor);
    glb_refused(square_json(accessors, PRIMITIVE), &square, sizeof square, TW_INVALID, cases[i].pointer);
  }
  square_bin wrong = square;
  wrong.indices[4] = 4;
  glb_refused(square_json(POSITIONS "," INDICES, PRIMITIVE), &wrong, sizeof wrong, TW_INVALID,
              "/accessors/1");
  wrong.indices[3] = 5; /* of two in one triangle the first is named, by every compiler */
  glb_file file = glb_build(square_json(POSITIONS "," INDICES, PRIMITIVE), &wrong, sizeof wrong);
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(gltf_read_bytes(file.bytes, file.size, 0, &model, &error), TW_INVALID);
  assert_string_equal(error.detail, "index 5 at 3 is out of range: there are 4 vertices");
  free(file.bytes);
}

TEST(numbers_that_are_not_finite_are_refused) {
  static const float bad[] = {NAN, INFINITY, -INFINITY};
  for (int i = 0; i < 3; i++) {
    square_bin wrong = square;
    wrong.positions[2][1] = bad[i];
    glb_refused(square_json(POSITIONS "," INDICES, PRIMITIVE), &wrong, sizeof wrong, TW_INVALID,
                "/accessors/0");
  }
}

TEST(sparse_accessors_that_lie_are_refused) {
  static const struct {
    const char *sparse, *pointer;
  } cases[] = {
      {"'count':0,'indices':{'bufferView':1,'componentType':5123},'values':{'bufferView':0}",
       "/accessors/0/sparse/count"},
      {"'count':5,'indices':{'bufferView':1,'componentType':5123},'values':{'bufferView':0}",
       "/accessors/0/sparse/count"},
      {"'count':2,'indices':{'bufferView':1,'componentType':5122},'values':{'bufferView':0}",
       "/accessors/0/sparse/indices/componentType"},
      {"'count':2,'indices':{'bufferView':9,'componentType':5123},'values':{'bufferView':0}",
       "/accessors/0/sparse/indices/bufferView"},
      {"'count':2,'indices':{'bufferView':1,'byteOffset':26,'componentType':5123},'values':{'bufferView':0}",
       "/accessors/0/sparse/indices"},
      {"'count':4,'indices':{'bufferView':1,'componentType':5123},'values':{'bufferView':0}",
       "/accessors/0/sparse/indices"}, /* 0 1 2 0 does not ascend */
      {"'count':1,'indices':{'bufferView':0,'byteOffset':14,'componentType':5123},'values':{'bufferView':0}",
       "/accessors/0/sparse/indices"}, /* out of range */
      {"'count':2,'indices':{'bufferView':1,'componentType':5123},'values':{'bufferView':1,'byteOffset':8}",
       "/accessors/0/sparse/values"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char accessors[1024];
    snprintf(accessors, sizeof accessors,
             "{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3','sparse':{%s}}," INDICES,
             cases[i].sparse);
    glb_refused(square_json(accessors, PRIMITIVE), &square, sizeof square, TW_INVALID, cases[i].pointer);
  }
}

/* tinygltf 2.8 reads it as 0. */
TEST(a_negative_sparse_offset_is_refused_or_0) {
  glb_file file = glb_build(
      square_json("{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3','sparse':{'count':1,"
                  "'indices':{'bufferView':1,'byteOffset':-2,'componentType':5123},"
                  "'values':{'bufferView':0,'byteOffset':12}}}," INDICES,
                  PRIMITIVE),
      &square, sizeof square);
  tw_model *model = NULL;
  tw_error error = {0};
  tw_status status = tw_gltf_read(file.bytes, file.size, TW_QUADS_NGON, TW_WELD_AUTO, 0, &model, &error);
  free(file.bytes);
  if (status == TW_OK) {
    assert_memory_equal(model->meshes[0].positions, square.positions[1], sizeof square.positions[1]);
  } else {
    assert_int_equal(status, TW_INVALID);
    assert_string_equal(error.pointer, "/accessors/0/sparse");
  }
  tw_model_destroy(model);
}

/* Many meshes over the same few bytes must not become a model of gigabytes. */
TEST(a_small_file_cannot_become_a_large_model) {
  enum { SIDE = 1000, MESHES = 300 };
  uint8_t *bin = calloc(SIDE * SIDE, 3);
  char *json = malloc(200 * MESHES + 1000);
  assert_non_null(bin);
  assert_non_null(json);
  char *at = json;
  at += sprintf(at, "{" ASSET ",'buffers':[{'byteLength':3000000}],'bufferViews':[{'buffer':0,"
                    "'byteLength':3000000}],'accessors':[{'bufferView':0,'componentType':5121,"
                    "'count':3000000,'type':'SCALAR'},{'bufferView':0,'componentType':5126,"
                    "'count':3,'type':'VEC3'}],'meshes':[");
  for (int i = 0; i < MESHES; i++)
    at += sprintf(at, "%s{'primitives':[{'attributes':{'POSITION':1},'indices':0}]}", i ? "," : "");
  strcpy(at, "]}");
  glb_refused(json, bin, 3000000, TW_LIMIT, "/meshes/3/primitives/0");
  free(json);
  free(bin);
}

TEST(a_square_is_read_as_it_is) {
  tw_model *model = read_square(POSITIONS "," INDICES, PRIMITIVE);
  const tw_mesh *mesh = &model->meshes[0];
  static const uint32_t corners[] = {0, 1, 2, 0, 2, 3};
  assert_int_equal(model->format, TW_FORMAT_GLB);
  assert_int_equal(mesh->point_count, 4);
  assert_int_equal(mesh->face_count, 2);
  assert_memory_equal(mesh->corners, corners, sizeof corners);
  assert_memory_equal(mesh->positions, square.positions, sizeof square.positions);
  assert_null(mesh->face_materials);
  assert_int_equal(mesh->uv_set_count, 0);
  assert_int_equal(model->node_count, 1); /* a model without nodes gets one a mesh */
  tw_model_destroy(model);
}

TEST(sparse_values_replace_elements) {
  square_bin bin = square;
  static const float moved[3] = {5, 6, 7};
  bin.spare[0] = 2;
  memcpy(bin.spare + 4, moved, sizeof moved);
  const char *json = square_json(
      "{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3','sparse':{'count':1,"
      "'indices':{'bufferView':1,'byteOffset':12,'componentType':5121},"
      "'values':{'bufferView':1,'byteOffset':16}}}," INDICES
      ",{'componentType':5126,'count':4,'type':'VEC3','sparse':{'count':1,'indices':{'bufferView':1,"
      "'byteOffset':12,'componentType':5121},'values':{'bufferView':1,'byteOffset':16}}}",
      "{'attributes':{'POSITION':0},'indices':1,'targets':[{'POSITION':2}]}");
  tw_model *model = glb_read(json, &bin, sizeof bin);
  const tw_mesh *mesh = &model->meshes[0];
  static const float morph[12] = {0, 0, 0, 0, 0, 0, 5, 6, 7, 0, 0, 0};
  assert_memory_equal(mesh->positions + 6, moved, sizeof moved);
  assert_memory_equal(mesh->positions + 9, square.positions[3], 12);
  assert_int_equal(mesh->morph_count, 1);
  assert_memory_equal(mesh->morphs[0], morph, sizeof morph);
  tw_model_destroy(model);
}

/* All component types of KHR_mesh_quantization, with a stride, against the equations of the spec. */
TEST(quantised_positions_are_read) {
  static const struct {
    int type, normalized;
    uint8_t bytes[6];
    float expected[3];
  } cases[] = {
      {5120, 0, {0x80, 0x7F, 0xFF}, {-128, 127, -1}},
      {5120, 1, {0x80, 0x7F, 0x00}, {-1, 1, 0}},
      {5121, 0, {0xFF, 0x01, 0x00}, {255, 1, 0}},
      {5121, 1, {0xFF, 0x33, 0x00}, {1, 0.2f, 0}},
      {5122, 0, {0x00, 0x80, 0xFF, 0x7F, 0xFF, 0xFF}, {-32768, 32767, -1}},
      {5122, 1, {0x00, 0x80, 0xFF, 0x7F, 0x00, 0x00}, {-1, 1, 0}},
      {5123, 0, {0xFF, 0xFF, 0x01, 0x00, 0x00, 0x00}, {65535, 1, 0}},
      {5123, 1, {0xFF, 0xFF, 0x33, 0x33, 0x00, 0x00}, {1, 0.2f, 0}},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    uint8_t bin[36] = {0};
    /* Three vertices with a stride of 12; the last one is the case's. */
    bin[0] = 1;
    bin[12] = 2;
    memcpy(bin + 24, cases[i].bytes, 6);
    char json[1024];
    snprintf(json, sizeof json,
             "{" ASSET ",'extensionsUsed':['KHR_mesh_quantization'],'extensionsRequired':["
             "'KHR_mesh_quantization'],'buffers':[{'byteLength':36}],"
             "'bufferViews':[{'buffer':0,'byteLength':36,'byteStride':12}],"
             "'accessors':[{'bufferView':0,'componentType':%d,'normalized':%s,'count':3,"
             "'type':'VEC3'}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}",
             cases[i].type, cases[i].normalized ? "true" : "false");
    tw_model *model = glb_read(json, bin, sizeof bin);
    for (int c = 0; c < 3; c++)
      assert_true(fabsf(model->meshes[0].positions[6 + c] - cases[i].expected[c]) < 1e-6f);
    tw_model_destroy(model);
  }
}

TEST(json_files_hold_their_buffer_as_a_data_uri) {
  /* Base64 of the bytes 0 to 8: a triangle of unsigned bytes. */
  const char *json =
      "{" ASSET ",'buffers':[{'byteLength':9,'uri':'data:application/octet-stream;base64,AAECAwQFBgcI'}],"
      "'bufferViews':[{'buffer':0,'byteLength':9}],'accessors':[{'bufferView':0,"
      "'componentType':5121,'count':3,'type':'VEC3'}],'meshes':[{'primitives':[{'attributes':{"
      "'POSITION':0}}]}]}";
  tw_model *model = NULL;
  tw_error error;
  assert_int_equal(gltf_read(json, 0, &model, &error), TW_OK);
  assert_int_equal(model->format, TW_FORMAT_GLTF);
  for (int i = 0; i < 9; i++) assert_true(model->meshes[0].positions[i] == (float)i);
  tw_model_destroy(model);
}
