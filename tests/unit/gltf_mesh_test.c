/* Meshes out of glTF: accessors first, then the surface that triangles become. */
#include <math.h>

#include "glb.h"

#define ASSET "'asset':{'version':'2.0'}"

/* ACCESSOR(0, 48, U16, 6, SCALAR): view, offset, type, count and kind. */
#define ACCESSOR(view, offset, type, count, kind)                                                            \
  "{'bufferView':" #view ",'byteOffset':" #offset ",'componentType':" type ",'count':" #count                \
  ",'type':'" #kind "'}"
#define I16 "5122"
#define U16 "5123"
#define F32 "5126"

/* A square of two triangles: 4 positions at 0, 6 indices of 16 bits at 48, then 4 spare bytes and
 * 12 more. */
typedef struct square_bin {
  float positions[4][3];
  uint16_t indices[6];
  uint8_t spare[16];
} square_bin;

static const square_bin square = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {0, 1, 2, 0, 2, 3}, {0}};

#define SQUARE_BUFFER                                                                                        \
  "'buffers':[{'byteLength':76}],'bufferViews':[{'buffer':0,'byteLength':48},"                               \
  "{'buffer':0,'byteOffset':48,'byteLength':28}]"
#define POSITIONS ACCESSOR(0, 0, F32, 4, VEC3)
#define INDICES   ACCESSOR(1, 0, U16, 6, SCALAR)
#define PRIMITIVE "{'attributes':{'POSITION':0},'indices':1}"

/* The square's document with these accessors and primitives, and members before. */
static const char *square_json_with(const char *members, const char *accessors, const char *primitives) {
  static char text[4096];
  snprintf(text, sizeof text,
           "{%s" ASSET "," SQUARE_BUFFER ",'accessors':[%s],'meshes':[{'name':'m','primitives':[%s]}]}",
           members, accessors, primitives);
  return text;
}

static const char *square_json(const char *accessors, const char *primitives) {
  return square_json_with("", accessors, primitives);
}

/* The square as it is. */
static tw_model *read_square(const char *accessors, const char *primitives) {
  return glb_read(square_json(accessors, primitives), &square, sizeof square);
}

/* ---- bad documents --------------------------------------------------------------------------- */

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

TEST(bad_primitives_are_refused) {
  static const struct {
    const char *primitive, *pointer;
  } cases[] = {
      {"{'attributes':{'POSITION':9},'indices':1}", "/meshes/0/primitives/0/attributes/POSITION"},
      {"{'attributes':{'POSITION':0},'indices':-2}", "/meshes/0/primitives/0/indices"},
      {"{'attributes':{'POSITION':0},'indices':1,'mode':7}", "/meshes/0/primitives/0/mode"},
      {"{'attributes':{'POSITION':0},'indices':1,'material':0}", "/meshes/0/primitives/0/material"},
      {"{'attributes':{'POSITION':0,'TEXCOORD_0':2},'indices':1}",
       "/meshes/0/primitives/0/attributes/TEXCOORD_0"},
      {"{'attributes':{'POSITION':0,'COLOR_0':1},'indices':1}", "/meshes/0/primitives/0/attributes/COLOR_0"},
      {"{'attributes':{'POSITION':0,'_A/~B':2},'indices':1}", "/meshes/0/primitives/0/attributes/_A~1~0B"},
      {"{'attributes':{'POSITION':0,'JOINTS_0':3},'indices':1}", "/meshes/0/primitives/0/attributes"},
      {"{'attributes':{'POSITION':0,'JOINTS_0':4,'WEIGHTS_0':4},'indices':1}", "/accessors/4/componentType"},
      {"{'attributes':{'POSITION':0},'indices':1,'targets':[{'POSITION':2}]}",
       "/meshes/0/primitives/0/targets/0/POSITION"},
      {"{'attributes':{'POSITION':0},'indices':1,'targets':[{}]},{'attributes':{'POSITION':0}}",
       "/meshes/0/primitives/1"},
      {"{'attributes':{'POSITION':0},'indices':1,'targets':[{}]},{'attributes':{'POSITION':0},'indices':1,"
       "'targets':[{},{}]}",
       "/meshes/0/primitives"},
      {"{'attributes':{'POSITION':0},'indices':1,'targets':[{}]},{'attributes':{'POSITION':0},'mode':1}",
       "/meshes/0/primitives"},
  };
  static const char accessors[] =
      POSITIONS "," INDICES ",{'bufferView':0,'componentType':5126,'count':2,'type':'VEC2'},"
                "{'bufferView':0,'componentType':5121,'count':4,'type':'VEC4'},"
                "{'componentType':5126,'count':4,'type':'VEC4'}";
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    glb_refused(square_json(accessors, cases[i].primitive), &square, sizeof square, TW_INVALID,
                cases[i].pointer);
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

/* ---- accessors ------------------------------------------------------------------------------- */

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

/* ---- modes ----------------------------------------------------------------------------------- */

TEST(strips_and_fans_become_triangles) {
  square_bin bin = square;
  static const uint16_t strip[6] = {0, 1, 3, 2, 2, 2};
  memcpy(bin.indices, strip, sizeof strip);
  tw_model *model =
      glb_read(square_json(POSITIONS "," INDICES, "{'attributes':{'POSITION':0},'indices':1,'mode':5}"), &bin,
               sizeof bin);
  static const uint32_t from_strip[] = {0, 1, 2, 1, 3, 2}; /* points by first use: 0 1 3 2 */
  assert_int_equal(model->meshes[0].face_count, 2);
  assert_memory_equal(model->meshes[0].corners, from_strip, sizeof from_strip);
  assert_int_equal(model->warning_count, 1); /* two degenerate triangles */
  tw_model_destroy(model);

  static const uint16_t fan[6] = {0, 1, 2, 3, 0, 0};
  memcpy(bin.indices, fan, sizeof fan);
  model = glb_read(square_json(POSITIONS "," ACCESSOR(1, 0, U16, 4, SCALAR),
                               "{'attributes':{'POSITION':0},'indices':1,'mode':6}"),
                   &bin, sizeof bin);
  static const uint32_t from_fan[] = {0, 1, 2, 1, 3, 2}; /* 1 2 0, 2 3 0: by first use 1 2 0 3 */
  assert_int_equal(model->meshes[0].face_count, 2);
  assert_memory_equal(model->meshes[0].corners, from_fan, sizeof from_fan);
  assert_true(model->meshes[0].positions[0] == 1); /* point 0 is vertex 1 */
  tw_model_destroy(model);
}

TEST(points_and_lines_are_no_faces) {
  tw_model *model = read_square(POSITIONS "," INDICES, "{'attributes':{'POSITION':0},'mode':0},"
                                                       "{'attributes':{'POSITION':0},'indices':1,'mode':3}");
  assert_int_equal(model->mesh_count, 1);
  assert_int_equal(model->meshes[0].face_count, 0);
  assert_non_null(model->meshes[0].loose);
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
}

/* ---- attributes ------------------------------------------------------------------------------ */

TEST(primitives_of_a_mesh_become_one_with_materials) {
  const char *json = square_json_with(
      "'materials':[{'name':'red'},{}],",
      POSITIONS "," ACCESSOR(1, 0, U16, 3, SCALAR) "," ACCESSOR(1, 6, U16, 3, SCALAR),
      "{'attributes':{'POSITION':0},'indices':1,'material':1},{'attributes':{'POSITION':0},'indices':2}");
  tw_model *model = glb_read(json, &square, sizeof square);
  const tw_mesh *mesh = &model->meshes[0];
  static const int32_t materials[] = {1, -1};
  assert_string_equal(mesh->name, "m");
  assert_int_equal(mesh->point_count, 4); /* the diagonal is shared */
  assert_int_equal(mesh->face_count, 2);
  assert_memory_equal(mesh->face_materials, materials, sizeof materials);
  assert_int_equal(model->material_count, 2);
  assert_string_equal(model->material_names[0], "red");
  assert_null(model->material_names[1]);
  tw_model_destroy(model);
}

TEST(a_normal_map_asks_for_tangents) {
  static const struct {
    const char *material;
    bool tangents;
  } cases[] = {
      {"{}", false},
      {"{'normalTexture':{'index':0}}", true},
      {"{'extensions':{'KHR_materials_clearcoat':{'clearcoatNormalTexture':{'index':0}}}}", true},
      {"{'extensions':{'KHR_materials_clearcoat':{'clearcoatTexture':{'index':0}}}}", false},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char members[512];
    snprintf(members, sizeof members, "'textures':[{}],'materials':[%s],", cases[i].material);
    const char *json = square_json_with(members, POSITIONS "," INDICES,
                                        "{'attributes':{'POSITION':0},'indices':1,'material':0}");
    tw_model *model = glb_read(json, &square, sizeof square);
    assert_int_equal(model->meshes[0].has_tangents, cases[i].tangents);
    tw_model_destroy(model);
  }
}

TEST(tangents_follow_the_uv_set_of_the_normal_map) {
#define MOVED "'extensions':{'KHR_texture_transform':{'texCoord':1}}"
  static const struct {
    const char *material;
    uint8_t set;
  } cases[] = {
      {"{'normalTexture':{'index':0}}", 0},
      {"{'normalTexture':{'index':0,'texCoord':1}}", 1},
      {"{'normalTexture':{'index':0,'texCoord':2}}", 0}, /* the mesh has two */
      {"{'normalTexture':{'index':0,'texCoord':-1}}", 0},
      {"{'normalTexture':{'index':0," MOVED "}}", 1},
      {"{'normalTexture':{'index':0,'texCoord':1,'extensions':{'KHR_texture_transform':{}}}}", 1},
      {"{'extensions':{'KHR_materials_clearcoat':{'clearcoatNormalTexture':{'index':0,'texCoord':1}}}}", 1},
      {"{'extensions':{'KHR_materials_clearcoat':{'clearcoatNormalTexture':{'index':0," MOVED "}}}}", 1},
  };
#undef MOVED
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char members[512];
    snprintf(members, sizeof members,
             "'textures':[{}],'extensionsUsed':['KHR_texture_transform','KHR_materials_clearcoat'],"
             "'materials':[{},%s],",
             cases[i].material);
    const char *json = square_json_with(
        members, POSITIONS "," INDICES "," ACCESSOR(0, 0, F32, 4, VEC2),
        "{'attributes':{'POSITION':0,'TEXCOORD_0':2,'TEXCOORD_1':2},'indices':1,'material':1},"
        "{'attributes':{'POSITION':0,'TEXCOORD_0':2,'TEXCOORD_1':2},'indices':1,'material':0}");
    tw_model *model = glb_read(json, &square, sizeof square);
    const tw_mesh *mesh = &model->meshes[0];
    assert_true(mesh->has_tangents);
    assert_int_equal(mesh->face_count, 4);
    assert_int_equal(mesh->tangent_uvs != NULL, cases[i].set != 0);
    for (uint32_t f = 0; mesh->tangent_uvs && f < 4; f++)
      assert_int_equal(mesh->tangent_uvs[f], f < 2 ? cases[i].set : 0);
    tw_model_destroy(model);
  }
}

TEST(only_vertices_in_use_become_points) {
  tw_model *model = read_square(POSITIONS "," ACCESSOR(1, 6, U16, 3, SCALAR), PRIMITIVE);
  assert_int_equal(model->meshes[0].point_count, 3);
  assert_true(model->meshes[0].positions[3] == 1 && model->meshes[0].positions[4] == 1);
  tw_model_destroy(model);
}

typedef struct skinned_bin {
  float positions[3][3];
  uint8_t joints[2][3][4];
  float weights[2][3][4];
  uint8_t colors[3][4];
} skinned_bin;

TEST(the_four_largest_weights_are_kept_with_sum_1_and_all_for_baking) {
  skinned_bin bin = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                     {{{1, 2, 3, 4}, {0, 0, 0, 0}, {9, 9, 9, 9}}, {{5, 6, 7, 8}, {0, 0, 0, 0}, {9, 9, 9, 9}}},
                     {{{0.1f, 0.2f, 0.05f, 0.15f}, {2, 0, 0, 0}, {0, 0, 0, 0}},
                      {{0.3f, 0.1f, 0.05f, 0.05f}, {0, 0, 0, 0}, {0, 0, 0, 0}}},
                     {{255, 0, 51, 255}, {0, 0, 0, 0}, {0, 0, 0, 255}}};
  const char *json =
      "{" ASSET ",'buffers':[{'byteLength':168}],'bufferViews':[{'buffer':0,'byteLength':168}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':36,'componentType':5121,'count':3,'type':'VEC4'},"
      "{'bufferView':0,'byteOffset':48,'componentType':5121,'count':3,'type':'VEC4'},"
      "{'bufferView':0,'byteOffset':60,'componentType':5126,'count':3,'type':'VEC4'},"
      "{'bufferView':0,'byteOffset':108,'componentType':5126,'count':3,'type':'VEC4'},"
      "{'bufferView':0,'byteOffset':156,'componentType':5121,'normalized':true,'count':3,"
      "'type':'VEC4'}],'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':1,"
      "'JOINTS_1':2,'WEIGHTS_0':3,'WEIGHTS_1':4,'COLOR_0':5,'TANGENT':3}}]}]}";
  assert_int_equal(sizeof bin, 168);
  tw_model *model = glb_read(json, &bin, sizeof bin);
  const tw_mesh *mesh = &model->meshes[0];
  /* Heaviest first; of equal weights the one that the file has first. */
  static const uint16_t joints[24] = {5, 2, 4, 1, 6, 3, 7, 8};
  static const float weights[24] = {0.3f, 0.2f, 0.15f, 0.1f, 0.1f, 0.05f, 0.05f, 0.05f, [8] = 1, [16] = 1};
  assert_int_equal(mesh->skin.width, 8);
  assert_memory_equal(mesh->skin.joints, joints, sizeof joints);
  for (int i = 0; i < 24; i++) assert_true(fabsf(mesh->skin.weights[i] - weights[i]) < 1e-6f);
  /* Baking uses all: joint j lifts by j, so a point rises by the weighted mean of its joints' numbers. */
  float lifts[9][16] = {{0}}, moved[3][3];
  for (int j = 0; j < 9; j++) {
    for (int k = 0; k < 4; k++) lifts[j][5 * k] = 1;
    lifts[j][14] = (float)j;
  }
  assert_int_equal(tw_mesh_deform(mesh, NULL, lifts[0], 9, moved[0], NULL), TW_OK);
  const double rise = 0.1 * 1 + 0.2 * 2 + 0.05 * 3 + 0.15 * 4 + 0.3 * 5 + 0.1 * 6 + 0.05 * 7 + 0.05 * 8;
  assert_true(fabs((double)moved[0][2] - rise) < 1e-6);
  assert_true(moved[1][2] == 0 && moved[2][2] == 0);
  assert_int_equal(model->warning_count, 3); /* one of TANGENT, without texture coordinates */
  assert_true(warns_of(model, "1 point without joint weights follows the first joint"));
  assert_true(warns_of(model, "1 point has joint weights whose sum is not 1: they are scaled to it"));
  const float *colors = mesh->attributes[0].values;
  assert_true(colors[0] == 1 && colors[1] == 0 && fabsf(colors[2] - 0.2f) < 1e-6f);
  assert_true(mesh->has_tangents);
  bin.weights[1][0][0] = -1;
  glb_refused(json, &bin, sizeof bin, TW_INVALID, "/meshes/0");
  tw_model_destroy(model);
}

static const tw_attribute *attribute_called(const tw_mesh *mesh, const char *name) {
  for (uint32_t i = 0; i < mesh->attribute_count; i++)
    if (strcmp(mesh->attributes[i].name, name) == 0) return &mesh->attributes[i];
  fail_msg("no attribute %s", name);
  return NULL;
}

TEST(attributes_of_an_application_are_read_in_the_order_of_the_document) {
  square_bin bin = square;
  memcpy(bin.spare, (const uint8_t[16]){0, 51, 102, 255, 255, 127, 128, 1, 9, 8, 7, 6, 5, 4, 3, 2}, 16);
  const char *accessors = POSITIONS
      "," INDICES ",{'bufferView':1,'byteOffset':12,'componentType':5121,'normalized':true,'count':4,"
      "'type':'SCALAR'},{'bufferView':1,'byteOffset':12,'componentType':5120,'count':4,"
      "'type':'VEC2'},{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'},"
      "{'bufferView':1,'byteOffset':12,'componentType':5121,'count':4,'type':'VEC4'},"
      "{'bufferView':1,'byteOffset':12,'componentType':5121,'count':4,'type':'MAT2'}";
  tw_model *model =
      glb_read(square_json(accessors, "{'attributes':{'_Z':2,'_\\u00e4':3,'POSITION':0,'COLOR_0':4,'_A':5,"
                                      "'_M':6,'_\\n':2},'indices':1},{'attributes':{'_Late':4,'POSITION':0,"
                                      "'_A':2},'indices':1}"),
               &bin, sizeof bin);
  const tw_mesh *mesh = &model->meshes[0];
  static const char *const names[] = {"_Z", "_\xC3\xA4", "COLOR_0", "_A", "_Late"};
  static const uint32_t widths[] = {1, 2, 4, 4, 3};
  assert_int_equal(mesh->attribute_count, 5);
  for (uint32_t i = 0; i < 5; i++) {
    assert_string_equal(mesh->attributes[i].name, names[i]);
    assert_int_equal(mesh->attributes[i].width, widths[i]);
    assert_int_equal(mesh->attributes[i].is_color, i == 2);
  }
  assert_true(fabsf(mesh->attributes[0].values[1] - 0.2f) < 1e-6f && mesh->attributes[0].values[3] == 1);
  const float *pair = mesh->attributes[1].values, *four = mesh->attributes[3].values;
  assert_true(pair[0] == 0 && pair[1] == 51 && pair[2] == 102 && pair[3] == -1 && pair[4] == -1);
  assert_true(four[3] == 255 && four[4] == 255 && four[15] == 2);
  /* Integers are whole numbers, unless some primitive has fractions for them. */
  static const tw_numbers numbers[] = {TW_NUMBERS_REAL, TW_NUMBERS_INT8, TW_NUMBERS_REAL, TW_NUMBERS_REAL,
                                       TW_NUMBERS_REAL};
  for (uint32_t i = 0; i < 5; i++) assert_int_equal(mesh->attributes[i].numbers, numbers[i]);
  static const char *const warnings[] = {
      "the attribute COLOR_0 is white and opaque where a primitive lacks it",
      "the attribute _\n is left out",
      "the attribute _A is filled up with 0 where a primitive has fewer numbers of it",
      "the attribute _Late is 0 where a primitive lacks it",
      "the attribute _M is left out",
      "the attribute _Z is 0 where a primitive lacks it",
      "the attribute _\xC3\xA4 is 0 where a primitive lacks it"};
  assert_int_equal(model->warning_count, 9); /* and that the two lie on each other and become one */
  for (uint32_t i = 0; i < 7; i++) assert_string_equal(model->warnings[i], warnings[i]);
  tw_model_destroy(model);
}

/* Rows of an answer have room for so many. */
TEST(attributes_beyond_those_that_fit_are_warned_of) {
  const char *accessors =
      POSITIONS "," INDICES ",{'bufferView':1,'componentType':5121,'count':4,'type':'VEC4'},"
                "{'bufferView':1,'componentType':5121,'count':4,'type':'SCALAR'},"
                "{'bufferView':1,'componentType':5121,'normalized':true,'count':4,'type':'VEC4'}";
  for (int width = 1; width <= 4; width += 3) {
    char primitive[1024] = "{'attributes':{";
    for (int i = 0; i < 20; i++)
      snprintf(primitive + strlen(primitive), 32, "'_%c':%d,", 'a' + i, width == 4 ? 2 : 3);
    strcat(primitive, "'COLOR_0':4,'POSITION':0},'indices':1}");
    tw_model *model = read_square(accessors, primitive);
    const tw_mesh *mesh = &model->meshes[0];
    uint32_t kept = width == 4 ? 8 : 15;
    assert_int_equal(mesh->attribute_count, kept + 1);
    assert_int_equal(attribute_called(mesh, "COLOR_0")->width, 4);
    assert_string_equal(mesh->attributes[kept - 1].name, width == 4 ? "_h" : "_o");
    assert_int_equal(model->warning_count, 20 - kept + 1); /* and the accessor of the other width */
    assert_string_equal(model->warnings[0],
                        width == 4
                            ? "the attribute _i is left out: a mesh keeps 15 such, of 32 components in all"
                            : "the attribute _p is left out: a mesh keeps 15 such, of 32 components in all");
    tw_model_destroy(model);
  }
}

/* Nothing subdivides there; a file does not fail for an application's own numbers. */
TEST(an_attribute_that_is_no_number_is_0_there) {
  square_bin bin = square;
  const float values[4] = {1, NAN, 2e18f, -3};
  memcpy(bin.spare, values, sizeof values);
  tw_model *model = glb_read(square_json(POSITIONS "," INDICES "," ACCESSOR(1, 12, F32, 4, SCALAR),
                                         "{'attributes':{'POSITION':0,'_T':2},'indices':1}"),
                             &bin, sizeof bin);
  const float *read = model->meshes[0].attributes[0].values;
  assert_true(read[0] == 1 && read[1] == 0 && read[2] == 0 && read[3] == -3);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0], "the attribute _T is 0 where it is no number up to 1e18");
  tw_model_destroy(model);
}

/* As in an OBJ. */
TEST(texture_coordinates_and_colours_that_are_no_numbers_are_told) {
  const struct {
    float positions[4][3], uvs[4][2], colors[4][3];
  } all = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
           {{0.25f, 1}, {NAN, 0.5f}, {0.5f, -INFINITY}, {2e18f, 0}},
           {{0, 0, 0}, {0, NAN, 0}, {0, 0, INFINITY}, {0, 1, 0}}};
  const char *json =
      "{" ASSET ",'buffers':[{'byteLength':128}],'bufferViews':[{'buffer':0,'byteLength':128}],'accessors':["
      "{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':48,'componentType':5126,'count':4,'type':'VEC2'},"
      "{'bufferView':0,'byteOffset':80,'componentType':5126,'count':4,'type':'VEC3'}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':1,'COLOR_0':2},'mode':6}]}]}";
  tw_model *model = glb_read(json, &all, sizeof all);
  const tw_mesh *mesh = &model->meshes[0];
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    uint32_t point = mesh->corners[c];
    const float *at = mesh->positions + 3 * point,
                *uv = mesh->uv_sets[0].values + 2 * mesh->uv_sets[0].corners[c];
    uint32_t vertex = (uint32_t)(at[1] > 0 ? 3 - at[0] : at[0]);                        /* of the file */
    assert_true(vertex == 0 ? uv[0] == 0.25f && uv[1] == 0 : uv[0] == 0 && uv[1] == 1); /* v up */
    const float *color = mesh->attributes[0].values + mesh->attributes[0].width * point;
    static const float expected[4][3] = {{0, 0, 0}, {1, 1, 1}, {1, 1, 1}, {0, 1, 0}};
    assert_memory_equal(color, expected[vertex], sizeof expected[vertex]);
  }
  assert_true(warns_of(model, "3 texture coordinates are 0 0: they are no numbers up to 1e18"));
  assert_true(warns_of(model, "COLOR_0 is white and opaque where it is no number"));
  tw_model_destroy(model);
}

TEST(normals_of_targets_displace_those_of_the_file_alone) {
  const char *both = "{'attributes':{'POSITION':0,'NORMAL':0},'indices':1,'targets':[{'POSITION':0},"
                     "{'POSITION':0,'NORMAL':0}]}",
             *bare = "{'attributes':{'POSITION':0},'indices':1,'targets':[{'NORMAL':0}]}";
  tw_model *model = read_square(POSITIONS "," INDICES, both);
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->normals.value_count, 4);
  for (int i = 0; i < 12; i++) assert_true(mesh->morph_normals[0][i] == 0);
  assert_memory_equal(mesh->morph_normals[1], square.positions, sizeof square.positions);
  assert_int_equal(model->warning_count, 2); /* positions are no unit normals, and one is 0 */
  tw_model_destroy(model);
  model = read_square(POSITIONS "," INDICES, bare);
  assert_null(model->meshes[0].morph_normals);
  assert_string_equal(model->warnings[0],
                      "the attribute NORMAL of morph targets is left out: there is nothing to displace");
  tw_model_destroy(model);
}

/* The second has a number beyond 1e18, the third none. */
TEST(normals_of_targets_that_are_no_numbers_are_told) {
  struct {
    float positions[4][3], normals[4][3], displaced[4][3];
  } all = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
           {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}},
           {{1, 0, 0}, {0, 2e18f, 0}, {0, NAN, 1}, {0, 1, 0}}};
  const char *json =
      "{" ASSET ",'buffers':[{'byteLength':144}],'bufferViews':[{'buffer':0,'byteLength':144}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':48,'componentType':5126,'count':4,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':96,'componentType':5126,'count':4,'type':'VEC3'}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1},'mode':6,"
      "'targets':[{'POSITION':1,'NORMAL':2}]}]}]}";
  tw_model *model = glb_read(json, &all, sizeof all);
  const tw_mesh *mesh = &model->meshes[0];
  static const float expected[4][3] = {{1, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 1, 0}};
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    const float *at = mesh->positions + 3 * mesh->corners[c];
    uint32_t vertex = (uint32_t)(at[1] > 0 ? 3 - at[0] : at[0]); /* of the file */
    assert_memory_equal(mesh->morph_normals[0] + 3 * mesh->normals.corners[c], expected[vertex],
                        sizeof expected[vertex]);
  }
  assert_true(warns_of(model, "2 NORMALs of morph targets are 0 0 0: they are no numbers up to 1e18"));
  tw_model_destroy(model);
}

/* Each holds as many bytes as the mesh has corners, twelve times. */
TEST(normals_of_too_many_targets_are_warned_of) {
  enum { CORNERS = 12288, VERTICES = 32 };
  static struct {
    float positions[VERTICES][3];
    uint16_t indices[CORNERS];
  } bin;
  static char json[1 << 16];
  for (int v = 0; v < VERTICES; v++) bin.positions[v][0] = (float)v, bin.positions[v][1] = (float)(v * v);
  for (int a = 0, next = 0; a < VERTICES; a++) /* triangles that differ */
    for (int b = a + 1; b < VERTICES; b++)
      for (int c = b + 1; c < VERTICES && next < CORNERS; c++) {
        bin.indices[next++] = (uint16_t)a;
        bin.indices[next++] = (uint16_t)b;
        bin.indices[next++] = (uint16_t)c;
      }
  for (int targets = 900; targets <= 920; targets += 20) {
    size_t size = (size_t)snprintf(
        json, sizeof json,
        "{" ASSET ",'buffers':[{'byteLength':%zu}],'bufferViews':[{'buffer':0,'byteLength':%d},"
        "{'buffer':0,'byteOffset':%d,'byteLength':%d}],'accessors':["
        "{'bufferView':0,'componentType':5126,'count':%d,'type':'VEC3'},"
        "{'bufferView':1,'componentType':5123,'count':%d,'type':'SCALAR'}],"
        "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':0},'indices':1,'targets':[",
        sizeof bin, 12 * VERTICES, 12 * VERTICES, 2 * CORNERS, VERTICES, CORNERS);
    for (int i = 0; i < targets; i++)
      size += (size_t)snprintf(json + size, sizeof json - size, "%s{'POSITION':0,'NORMAL':0}", i ? "," : "");
    snprintf(json + size, sizeof json - size, "]}]}]}");
    tw_model *model = glb_read(json, &bin, sizeof bin);
    assert_int_equal(model->meshes[0].morph_count, targets);
    bool is_within = targets == 900;
    assert_true(is_within == (model->meshes[0].morph_normals != NULL));
    assert_int_equal(model->warning_count, is_within ? 2 : 3); /* positions are no unit normals */
    if (!is_within)
      assert_string_equal(model->warnings[0],
                          "the attribute NORMAL of morph targets is left out: there are too many");
    tw_model_destroy(model);
  }
}

TEST(morph_weights_must_fit_the_targets) {
  static char json[2048];
  for (int count = 1; count <= 3; count++) {
    static const char *const weights[] = {"0.5", "0.5,1", "0.5,1,0"};
    snprintf(json, sizeof json,
             "{" ASSET "," SQUARE_BUFFER ",'accessors':[" POSITIONS "," INDICES
             "],'meshes':[{'weights':[%s],'primitives':[{'attributes':{'POSITION':0},"
             "'indices':1,'targets':[{'POSITION':0},{'NORMAL':0}]}]}]}",
             weights[count - 1]);
    if (count != 2) {
      glb_refused(json, &square, sizeof square, TW_INVALID, "/meshes/0/weights");
      continue;
    }
    tw_model *model = glb_read(json, &square, sizeof square);
    const tw_mesh *mesh = &model->meshes[0];
    assert_int_equal(mesh->morph_count, 2);
    assert_memory_equal(mesh->morphs[0], square.positions, sizeof square.positions);
    for (int i = 0; i < 12; i++) assert_true(mesh->morphs[1][i] == 0);
    assert_true(mesh->morph_weights[0] == 0.5f && mesh->morph_weights[1] == 1);
    tw_model_destroy(model);
  }
}

TEST(a_mesh_without_targets_needs_no_weights) {
  char json[1024];
  snprintf(json, sizeof json,
           "{" ASSET "," SQUARE_BUFFER ",'accessors':[" POSITIONS "," INDICES
           "],'meshes':[{'weights':[0.5],'primitives':[" PRIMITIVE "]}]}");
  tw_model *model = glb_read(json, &square, sizeof square);
  assert_int_equal(model->meshes[0].morph_count, 0);
  assert_null(model->meshes[0].morph_weights);
  assert_true(warns_of(model, "1 mesh has morph weights and no targets: they are left out"));
  tw_model_destroy(model);
}

/* The second triangle has points and a material of its own. */
TEST(a_primitive_without_targets_stays_where_others_are_moved) {
  static const char primitives[] =
      "{'attributes':{'POSITION':0},'indices':2},{'attributes':{'POSITION':0},'indices':1,'targets':[{},"
      "{'POSITION':0}]}";
  square_bin bin = square;
  const uint16_t triangle[3] = {2, 1, 0};
  memcpy(bin.spare, triangle, sizeof triangle);
  char json[1024];
  snprintf(json, sizeof json,
           "{" ASSET "," SQUARE_BUFFER ",'accessors':[" POSITIONS "," INDICES
           "," ACCESSOR(1, 12, U16, 3, SCALAR) "],'meshes':[{'weights':[0,1],'primitives':[%s]}]}",
           primitives);
  tw_model *model = glb_read(json, &bin, sizeof bin);
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->morph_count, 2);
  assert_int_equal(mesh->face_count, 3);
  for (uint32_t c = 0; c < mesh->corner_count; c++)
    for (int k = 0; k < 3; k++) {
      const uint32_t at = 3 * mesh->corners[c] + (uint32_t)k;
      assert_true(mesh->morphs[0][at] == 0);
      assert_true(mesh->morphs[1][at] == (c < 3 ? 0 : mesh->positions[at]));
    }
  assert_true(warns_of(model, "1 primitive has no morph targets beside others of its mesh"));
  tw_model_destroy(model);
}

/* ---- surfaces -------------------------------------------------------------------------------- */

/* A cube as a renderer wants it: 24 vertices, each face with its own four and its own texture. */
typedef struct cube_bin {
  float positions[24][3];
  float uvs[24][2];
  uint16_t indices[36];
} cube_bin;

static cube_bin make_cube(void) {
  static const uint8_t faces[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                      {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  static const float points[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                     {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  static const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  cube_bin bin;
  for (uint16_t face = 0; face < 6; face++) {
    for (uint16_t k = 0; k < 4; k++) {
      memcpy(bin.positions[4 * face + k], points[faces[face][k]], 12);
      memcpy(bin.uvs[4 * face + k], corners[k], 8);
    }
    static const uint16_t split[6] = {0, 1, 2, 0, 2, 3};
    for (int k = 0; k < 6; k++) bin.indices[6 * face + k] = (uint16_t)(4 * face + split[k]);
  }
  return bin;
}

static const char *cube_json(const char *extension) {
  static char json[2048];
  snprintf(json, sizeof json,
           "{" ASSET "%s,'buffers':[{'byteLength':552}],'bufferViews':[{'buffer':0,'byteLength':552}],"
           "'accessors':[{'bufferView':0,'componentType':5126,'count':24,'type':'VEC3'},"
           "{'bufferView':0,'byteOffset':288,'componentType':5126,'count':24,'type':'VEC2'},"
           "{'bufferView':0,'byteOffset':480,'componentType':5123,'count':36,'type':'SCALAR'}],"
           "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':1},'indices':2}]}]}",
           extension);
  return json;
}

#define NGON ",'extensionsUsed':['FB_ngon_encoding']"

TEST(a_cube_of_24_vertices_has_8_points) {
  cube_bin bin = make_cube();
  tw_model *model = glb_read(cube_json(""), &bin, sizeof bin);
  const tw_mesh *mesh = &model->meshes[0];
  tw_mesh_stats facts;
  assert_int_equal(mesh->point_count, 8);
  assert_int_equal(mesh->face_count, 12);
  assert_int_equal(mesh->uv_sets[0].value_count, 24);
  assert_int_equal(tw_mesh_describe(mesh, &facts, NULL), TW_OK);
  assert_int_equal(facts.boundary_edges, 0);
  assert_int_equal(facts.euler_characteristic, 2);
  tw_mesh_stats_deinit(&facts);
  tw_model_destroy(model);
}

static void assert_quads_of(const cube_bin *cube, const tw_mesh *mesh) {
  assert_int_equal(mesh->face_count, 6);
  assert_int_equal(mesh->corner_count, 24);
  for (uint32_t c = 0; c < 24; c++) {
    const float *uv = mesh->uv_sets[0].values + 2 * (size_t)mesh->uv_sets[0].corners[c];
    assert_true(uv[0] == cube->uvs[c][0] && uv[1] == 1 - cube->uvs[c][1]); /* v up */
  }
}

TEST(ngon_encoding_gives_the_quads_back) {
  cube_bin bin = make_cube();
  tw_model *model = glb_read(cube_json(NGON), &bin, sizeof bin);
  const tw_mesh *mesh = &model->meshes[0];
  static const uint32_t first[] = {0, 1, 2, 3};
  assert_memory_equal(mesh->corners, first, sizeof first);
  assert_quads_of(&bin, mesh);
  tw_model_destroy(model);
  model = glb_read_with(cube_json(NGON), &bin, sizeof bin, TW_QUADS_OFF);
  assert_int_equal(model->meshes[0].face_count, 12);
  tw_model_destroy(model);
}

TEST(auto_gives_the_quads_back_without_being_told) {
  cube_bin bin = make_cube();
  tw_model *model = glb_read_with(cube_json(""), &bin, sizeof bin, TW_QUADS_AUTO);
  assert_quads_of(&bin, &model->meshes[0]);
  tw_model_destroy(model);
}

/* Fans of 3, 5 and 4 corners round a point, as the encoding stores them. */
TEST(ngons_of_several_sizes_are_told_apart) {
  struct {
    float positions[9][3];
    uint16_t indices[18];
  } bin = {
      {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 1, 0}, {2, 2, 0}, {0, 2, 0}, {-1, 1, 0}, {-1, 3, 0}, {1, 3, 0}},
      {0, 1, 5,                   /* triangle */
       1, 2, 3, 1, 3, 4, 1, 4, 5, /* pentagon */
       5, 4, 8, 5, 8, 7 /* quad */}};
  const char *json =
      "{" ASSET NGON ",'buffers':[{'byteLength':144}],'bufferViews':[{'buffer':0,'byteLength':144}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':9,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':108,'componentType':5123,'count':18,'type':'SCALAR'}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0},"
      "'indices':1,'extensions':{'FB_ngon_encoding':{}}}]}]}";
  assert_int_equal(sizeof bin, 144);
  static const uint32_t offsets[] = {0, 3, 8, 12};
  for (int quads = TW_QUADS_NGON; quads <= TW_QUADS_AUTO; quads++) {
    tw_model *model = glb_read_with(json, &bin, sizeof bin, (tw_quads)quads);
    assert_int_equal(model->meshes[0].face_count, 3);
    assert_memory_equal(model->meshes[0].face_offsets, offsets, sizeof offsets);
    tw_model_destroy(model);
  }
}

/* Faces that come to a point twice: two triangles joined at a corner, and a fan that closes round its first
 * one. Then one with a corner doubled, and one of two points alone. */
TEST(an_ngon_may_come_to_a_point_twice) {
  struct {
    float positions[5][3];
    uint16_t indices[24];
  } bin = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}},
           {0, 1, 2, 0, 2, 0, 0, 0, 3, 0, 3, 4, /* 0 1 2 0 3 4 */
            1, 2, 0, 1, 0, 2,                   /* 1 2 0 2 */
            3, 3, 4, 3, 4, 0}};                 /* 3 3 4 0 */
  const char *json =
      "{" ASSET NGON ",'buffers':[{'byteLength':108}],'bufferViews':[{'buffer':0,'byteLength':108}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':5,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':60,'componentType':5123,'count':24,'type':'SCALAR'}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}]}";
  assert_int_equal(sizeof bin, 108);
  static const uint32_t offsets[] = {0, 6, 10, 13}, corners[] = {0, 1, 2, 0, 3, 4, 1, 2, 0, 2, 3, 4, 0};
  tw_model *model = glb_read(json, &bin, sizeof bin);
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->face_count, 3);
  assert_memory_equal(mesh->face_offsets, offsets, sizeof offsets);
  assert_memory_equal(mesh->corners, corners, sizeof corners);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0], "1 face names a point twice in a row: it keeps it once");
  tw_model_destroy(model);
}

/* Two triangles that are told to be two: the second begins from another vertex. */
TEST(triangles_that_the_encoding_keeps_apart_stay_apart) {
  square_bin bin = square;
  static const uint16_t apart[6] = {0, 1, 2, 2, 3, 0};
  memcpy(bin.indices, apart, sizeof apart);
  const char *json =
      square_json_with("'extensionsUsed':['FB_ngon_encoding'],", POSITIONS "," INDICES, PRIMITIVE);
  tw_model *model = glb_read_with(json, &bin, sizeof bin, TW_QUADS_AUTO);
  assert_int_equal(model->meshes[0].face_count, 2);
  tw_model_destroy(model);
}

/* Six vertices of the same square bent along its diagonal. */
TEST(normals_and_tangents_stay_those_of_the_vertices) {
  struct {
    float positions[6][3], normals[6][3], tangents[6][4];
  } bin = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 1}, {0, 0, 0}, {1, 1, 1}, {0, 1, 0}},
           {{0, 0, 2}, {0, 0, 1}, {0, 0, 1}, {0, 1, 0}, {0, 1, 0}, {0, NAN, 0}},
           {{1, 0, 0, 1}, {1, 0, 0, 1}, {1, 0, 0, 1}, {1, 0, 0, -1}, {1, 0, 0, -1}, {NAN, 0, 0, 1}}};
  tw_model *model =
      glb_read("{" ASSET ",'buffers':[{'byteLength':240}],'bufferViews':[{'buffer':0,'byteLength':240}],"
               "'accessors':[{'bufferView':0,'componentType':5126,'count':6,'type':'VEC3'},"
               "{'bufferView':0,'byteOffset':72,'componentType':5126,'count':6,'type':'VEC3'},"
               "{'bufferView':0,'byteOffset':144,'componentType':5126,'count':6,'type':'VEC4'}],"
               "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1,'TANGENT':2}}]}]}",
               &bin, sizeof bin);
  const tw_mesh *mesh = model->meshes;
  assert_int_equal(mesh->point_count, 4);
  assert_int_equal(mesh->normals.value_count, 6);
  memset(bin.normals[5], 0, sizeof bin.normals[5]); /* what is not finite is none */
  memset(bin.tangents[5], 0, sizeof bin.tangents[5]);
  assert_memory_equal(mesh->normals.values, bin.normals, sizeof bin.normals);
  assert_memory_equal(mesh->normals.tangents, bin.tangents, sizeof bin.tangents);
  for (uint32_t c = 0; c < 6; c++) assert_int_equal(mesh->normals.corners[c], c);
  tw_mesh_stats stats;
  assert_int_equal(tw_mesh_describe(mesh, &stats, NULL), TW_OK);
  assert_int_equal(stats.hard_edges.by_normals, 1);
  tw_mesh_stats_deinit(&stats);
  tw_model_destroy(model);
}

/* Two triangles of a square with vertices of their own; their colours differ along the diagonal, or not. */
TEST(colours_that_differ_at_a_joined_point_are_those_of_corners) {
  struct {
    float positions[6][3];
    uint8_t colors[6][4];
  } bin = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0}}};
  const char *json =
      "{" ASSET ",'buffers':[{'byteLength':96}],'bufferViews':[{'buffer':0,'byteLength':96}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':6,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':72,'componentType':5121,'normalized':true,'count':6,'type':'VEC4'}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'COLOR_0':1}}]}]}";
  for (int differ = 0; differ < 2; differ++) {
    for (int v = 0; v < 6; v++) bin.colors[v][0] = differ && v >= 3 ? 255 : 0;
    tw_model *model = glb_read(json, &bin, sizeof bin);
    assert_int_equal(model->meshes[0].point_count, 4);
    assert_int_equal(model->warning_count, 0);
    const tw_attribute *color = model->meshes[0].attributes;
    assert_int_equal(color->value_count, differ ? 6 : 0);
    assert_true((color->corners != NULL) == differ);
    for (uint32_t c = 0; differ && c < 6; c++) assert_true(color->values[4 * color->corners[c]] == (c >= 3));
    tw_model_destroy(model);
  }
}

TEST(colours_beyond_one_are_told) {
  struct {
    float positions[3][3], colors[3][3];
  } bin = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, {{1, 0, 0.5f}}};
  const char *json = "{" ASSET ",'buffers':[{'byteLength':72}],'bufferViews':[{'buffer':0,'byteLength':72}],"
                     "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'},"
                     "{'bufferView':0,'byteOffset':36,'componentType':5126,'count':3,'type':'VEC3'}],"
                     "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'COLOR_0':1}}]}]}";
  static const float numbers[] = {1.0001f, 2, -0.5f};
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    bin.colors[1][1] = numbers[i];
    tw_model *model = glb_read(json, &bin, sizeof bin);
    assert_int_equal(model->warning_count, i > 0);
    if (i > 0) assert_non_null(strstr(model->warnings[0], "COLOR_0 is brought into 0 to 1"));
    tw_model_destroy(model);
  }
}

/* Two triangles of a square with vertices of their own, whose joints at the diagonal are written in two ways.
 */
TEST(seams_close_where_joints_are_the_same_however_they_are_written) {
  static const struct {
    uint8_t joints[2][4];
    float weights[2][4];
    uint32_t points;
  } ways[] = {{{{1, 2, 0, 0}, {1, 2, 0, 0}}, {{0.5f, 0.5f, 0, 0}, {0.5f, 0.5f, 0, 0}}, 4},
              {{{1, 2, 0, 0}, {2, 1, 0, 0}}, {{0.25f, 0.75f, 0, 0}, {0.75f, 0.25f, 0, 0}}, 4},
              {{{1, 0, 0, 0}, {1, 7, 7, 7}}, {{1, 0, 0, 0}, {1, 0, 0, 0}}, 4},
              {{{1, 2, 0, 0}, {1, 2, 0, 0}}, {{0.5f, 0.5f, 0, 0}, {1, 1, 0, 0}}, 4},
              {{{1, 1, 0, 0}, {1, 0, 0, 0}}, {{0.5f, 0.5f, 0, 0}, {1, 0, 0, 0}}, 4},
              {{{1, 2, 0, 0}, {1, 3, 0, 0}}, {{0.5f, 0.5f, 0, 0}, {0.5f, 0.5f, 0, 0}}, 6},
              {{{1, 2, 0, 0}, {1, 2, 0, 0}}, {{0.5f, 0.5f, 0, 0}, {0.25f, 0.75f, 0, 0}}, 6}};
  struct {
    float positions[6][3];
    uint8_t joints[6][4];
    float weights[6][4];
  } bin = {.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
  const char *json =
      "{" ASSET ",'buffers':[{'byteLength':192}],'bufferViews':[{'buffer':0,'byteLength':192}],"
      "'accessors':[{'bufferView':0,'componentType':5126,'count':6,'type':'VEC3'},"
      "{'bufferView':0,'byteOffset':72,'componentType':5121,'count':6,'type':'VEC4'},"
      "{'bufferView':0,'byteOffset':96,'componentType':5126,'count':6,'type':'VEC4'}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':1,'WEIGHTS_0':2}}]}]}";
  for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
    for (int v = 0; v < 6; v++) {
      memcpy(bin.joints[v], ways[i].joints[v / 3], sizeof bin.joints[v]);
      memcpy(bin.weights[v], ways[i].weights[v / 3], sizeof bin.weights[v]);
    }
    tw_model *model = glb_read(json, &bin, sizeof bin);
    if (model->meshes[0].point_count != ways[i].points)
      fail_msg("way %zu: %u points", i, model->meshes[0].point_count);
    tw_model_destroy(model);
  }
}
