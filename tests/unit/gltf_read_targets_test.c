/* Morph targets read from glTF: their normals and weights. */
#include <math.h>

#include "glb.h"
#include "square_and_cube.h"

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
