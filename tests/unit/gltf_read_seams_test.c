/* Seams of a glTF: vertices become one point, their values stay apart. */
#include <math.h>

#include "glb.h"
#include "square_and_cube.h"

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
