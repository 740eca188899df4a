/* Polygons that the triangles of a glTF were. */
#include "glb.h"
#include "square_and_cube.h"

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
