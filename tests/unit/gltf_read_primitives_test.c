/* Primitives read from glTF: their modes, and the one mesh that they become. */
#include "glb.h"
#include "square_and_cube.h"

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

TEST(only_vertices_in_use_become_points) {
  tw_model *model = read_square(POSITIONS "," ACCESSOR(1, 6, U16, 3, SCALAR), PRIMITIVE);
  assert_int_equal(model->meshes[0].point_count, 3);
  assert_true(model->meshes[0].positions[3] == 1 && model->meshes[0].positions[4] == 1);
  tw_model_destroy(model);
}
