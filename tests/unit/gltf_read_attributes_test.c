/* Attributes read from glTF: tangents, joints, colours, texture coordinates, those of an application. */
#include <math.h>

#include "glb.h"
#include "square_and_cube.h"

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
