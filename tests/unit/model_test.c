/* The checks that every reader ends with, names as clients see them, warnings, formats by their bytes. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cube.h"
#include "keys.h"
#include "tweend/format.h"

/* A triangle, two nodes, a skin of one joint and a clip of one track. */
static const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
static const uint32_t corners[3] = {0, 1, 2}, offsets[2] = {0, 3}, joint_nodes[1] = {1};
static const float times[2] = {0, 1}, translations[6] = {0, 0, 0, 1, 2, 3};
static const float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

static tw_node make_node(const char *name, uint32_t parent) {
  return (tw_node){
      .name = name, .parent = parent, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
}

typedef struct fixture {
  tw_model *model;
  tw_mesh mesh;
  tw_node nodes[2];
  tw_skin skin;
  tw_track_keys track;
  tw_clip_keys clip;
} fixture;

static void fill(fixture *f) {
  f->model = tw_model_create();
  assert_non_null(f->model);
  f->mesh = mesh_of(positions, 3, corners, offsets, 1);
  f->nodes[0] = make_node("root", TW_NO_INDEX);
  f->nodes[0].mesh = 0;
  f->nodes[1] = make_node(NULL, 0);
  f->skin =
      (tw_skin){.joint_count = 1, .joints = joint_nodes, .inverse_bind = identity, .skeleton = TW_NO_INDEX};
  f->track = value_keys(TW_TRANSLATION, TW_LINEAR, times, translations, 2);
  f->track.node = 1;
  f->clip = (tw_clip_keys){.name = "move", .track_count = 1, .tracks = &f->track};
  tw_model *model = f->model;
  model->mesh_count = 1;
  model->meshes = &f->mesh;
  model->node_count = 2;
  model->nodes = f->nodes;
  model->skin_count = 1;
  model->skins = &f->skin;
  model->clip_count = 1;
  model->clips = &f->clip;
}

static void assert_refused_at(fixture *f, const char *pointer) {
  tw_error error = {0};
  assert_int_equal(tw_model_finish(f->model, &error), TW_INVALID);
  assert_string_equal(error.pointer, pointer);
  assert_true(error.detail[0] != '\0');
  tw_model_destroy(f->model);
  fill(f);
}

TEST(a_broken_part_is_refused_at_its_place) {
  fixture f;
  static const uint32_t bad_corners[3] = {0, 1, 3}, no_joint[1] = {2};
  static const int32_t material[1] = {0};
  static const float not_finite[16] = {NAN};
  fill(&f);
  f.mesh.corners = bad_corners;
  assert_refused_at(&f, "/meshes/0/faces/0/2");
  f.mesh.face_materials = material;
  assert_refused_at(&f, "/meshes/0/materials");
  f.mesh.name = "\xFF";
  assert_refused_at(&f, "/meshes/0/name");
  f.nodes[0].name = "a\nb";
  assert_refused_at(&f, "/nodes/0/name");
  f.nodes[0].mesh = 1;
  assert_refused_at(&f, "/nodes/0/mesh");
  f.nodes[1].skin = 1;
  assert_refused_at(&f, "/nodes/1/skin");
  f.nodes[1].parent = 1;
  assert_refused_at(&f, "/nodes/1/parent");
  f.nodes[1].parent = 2;
  assert_refused_at(&f, "/nodes/1/parent");
  f.nodes[1].rest.rotation[3] = 0;
  assert_refused_at(&f, "/nodes/1/rotation");
  f.nodes[1].rest.rotation[0] = NAN;
  assert_refused_at(&f, "/nodes/1/rotation");
  f.nodes[1].rest.translation[1] = INFINITY;
  assert_refused_at(&f, "/nodes/1/translation");
  f.nodes[1].rest.scale[1] = NAN;
  assert_refused_at(&f, "/nodes/1/scale");
  f.nodes[1].has_matrix = true;
  memcpy(f.nodes[1].matrix, not_finite, sizeof not_finite);
  assert_refused_at(&f, "/nodes/1/matrix");
  f.skin.joints = no_joint;
  assert_refused_at(&f, "/skins/0/joints");
  f.skin.joint_count = 0;
  assert_refused_at(&f, "/skins/0/joints");
  f.skin.inverse_bind = not_finite;
  assert_refused_at(&f, "/skins/0/inverseBindMatrices");
  f.skin.skeleton = 2;
  assert_refused_at(&f, "/skins/0/skeleton");
  f.track.path = TW_WEIGHTS;
  f.track.node = 0;
  assert_refused_at(&f, "/clips/0/tracks/0");
  tw_model_destroy(f.model);
}

TEST(a_clip_error_bears_the_clip) {
  fixture f;
  static const float falling[2] = {1, 0};
  fill(&f);
  f.track.times = falling;
  assert_refused_at(&f, "/clips/0/tracks/0/times/1");
  tw_model_destroy(f.model);
}

TEST(joints_beyond_the_skin_are_refused) {
  fixture f;
  static const uint16_t joints[12] = {[9] = 1};
  static const float weights[12] = {1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0};
  fill(&f);
  f.mesh.skin = (tw_skin_weights){.width = 4, .joints = joints, .weights = weights};
  assert_int_equal(tw_model_finish(f.model, NULL), TW_OK); /* no node skins it */
  f.nodes[0].skin = 0;
  assert_refused_at(&f, "/nodes/0/skin");
  tw_model_destroy(f.model);
}

TEST(finishing_orders_nodes_and_makes_rotations_unit) {
  fixture f;
  fill(&f);
  f.nodes[0].parent = 1;
  f.nodes[1].parent = TW_NO_INDEX;
  f.nodes[0].rest.rotation[3] = -2;
  assert_int_equal(tw_model_finish(f.model, NULL), TW_OK);
  assert_int_equal(f.model->node_order[0], 1);
  assert_int_equal(f.model->node_order[1], 0);
  assert_true(f.nodes[0].rest.rotation[3] == -1);
  tw_model_destroy(f.model);
}

TEST(a_model_without_nodes_gets_one_a_mesh) {
  fixture f;
  fill(&f);
  f.mesh.name = "hull";
  f.model->node_count = f.model->clip_count = f.model->skin_count = 0;
  assert_int_equal(tw_model_finish(f.model, NULL), TW_OK);
  assert_int_equal(f.model->node_count, 1);
  assert_string_equal(f.model->nodes[0].name, "hull");
  assert_int_equal(f.model->nodes[0].mesh, 0);
  tw_model_destroy(f.model);
}

TEST(an_empty_model_is_a_model) {
  tw_model *model = tw_model_create();
  assert_int_equal(tw_model_finish(model, NULL), TW_OK);
  tw_model_destroy(model);
  tw_model_destroy(NULL);
}

/* ---- names ----------------------------------------------------------------------------------- */

TEST(nameless_nodes_and_clips_are_found_by_number) {
  fixture f;
  char buffer[24];
  fill(&f);
  f.nodes[0].name = "";
  f.clip.name = NULL;
  assert_int_equal(tw_model_finish(f.model, NULL), TW_OK);
  assert_string_equal(tw_model_node_name(f.model, 0, buffer), "node_0");
  assert_int_equal(tw_model_find_node(f.model, "node_1 and more", 6), 1);
  assert_int_equal(tw_model_find_node(f.model, "node_2", 6), TW_NO_INDEX);
  assert_int_equal(tw_model_find_node(f.model, "", 0), TW_NO_INDEX);
  assert_int_equal(tw_model_find_clip(f.model, "clip_0", 6), 0);
  assert_int_equal(tw_model_find_clip(f.model, "clip_00", 7), TW_NO_INDEX);
  assert_int_equal(tw_model_find_node(f.model, "node_", 5), TW_NO_INDEX);
  assert_int_equal(tw_model_find_node(f.model, "node_01", 7), TW_NO_INDEX);
  assert_int_equal(tw_model_find_node(f.model, "node_-1", 7), TW_NO_INDEX);
  assert_int_equal(tw_model_find_node(f.model, "node_4294967296", 15), TW_NO_INDEX);
  tw_model_destroy(f.model);
}

TEST(the_first_of_equal_names_is_found) {
  fixture f;
  fill(&f);
  f.nodes[1].name = "root";
  assert_int_equal(tw_model_finish(f.model, NULL), TW_OK);
  assert_int_equal(tw_model_find_node(f.model, "root", 4), 0);
  assert_int_equal(tw_model_find_clip(f.model, "move", 4), 0);
  tw_model_destroy(f.model);
}

TEST(warnings_end_with_a_word_that_there_are_more) {
  tw_model *model = tw_model_create();
  for (int i = 0; i < 64; i++) tw_model_warn(model, "warning %d", i);
  assert_int_equal(model->warning_count, 64);
  assert_string_equal(model->warnings[63], "warning 63");
  tw_model_warn(model, "one more");
  assert_int_equal(model->warning_count, 64);
  assert_string_equal(model->warnings[63], "there are more warnings");
  tw_model_destroy(model);
}

/* ---- formats --------------------------------------------------------------------------------- */

TEST(bytes_tell_their_format) {
  static const struct {
    const char *text;
    tw_format format;
  } cases[] = {
      {"", TW_FORMAT_OBJ},
      {"v 0 0 0", TW_FORMAT_OBJ},
      {"# {", TW_FORMAT_OBJ},
      {"glT", TW_FORMAT_OBJ},
      {"glTF", TW_FORMAT_GLB},
      {"{}", TW_FORMAT_JSON},
      {" \r\n\t{\"meshes\": []}", TW_FORMAT_JSON},
      {"\xEF\xBB\xBF{\"asset\" : {}}", TW_FORMAT_GLTF},
      {"{\"asset\":", TW_FORMAT_GLTF},
      {"{\"meshes\":[{\"name\":\"\\\"asset\\\":\"}],\"asset\":{}}", TW_FORMAT_GLTF},
      {"{\"meshes\":[{\"asset\":1}]}", TW_FORMAT_JSON},
      {"{\"name\":\"asset\"}", TW_FORMAT_JSON},
      {"{\"name\":\"a\\", TW_FORMAT_JSON},
      {"{\"a\":1}{\"asset\":1}", TW_FORMAT_JSON},
      {"{]]]\"asset\":1", TW_FORMAT_JSON},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_int_equal(tw_format_sniff((const uint8_t *)cases[i].text, strlen(cases[i].text)), cases[i].format);
}

TEST(a_name_has_at_most_a_kilobyte) {
  static char name[TW_NAME_MAX + 2];
  fixture f;
  fill(&f);
  memset(name, 'x', TW_NAME_MAX);
  f.nodes[1].name = name;
  assert_int_equal(tw_model_finish(f.model, NULL), TW_OK);
  name[TW_NAME_MAX] = 'x';
  assert_refused_at(&f, "/nodes/1/name");
  f.mesh.name = name;
  assert_refused_at(&f, "/meshes/0/name");
  f.clip.name = name;
  assert_refused_at(&f, "/clips/0/name");
  tw_model_destroy(f.model);
}

TEST(clips_of_one_name_are_found_by_their_places) {
  fixture f;
  fill(&f);
  tw_clip_keys clips[3] = {f.clip, f.clip, f.clip};
  clips[2].name = "clip_0";
  f.model->clips = clips;
  f.model->clip_count = 3;
  assert_int_equal(tw_model_finish(f.model, NULL), TW_OK);
  assert_int_equal(tw_model_find_clip(f.model, "move", 4), 0);
  assert_int_equal(tw_model_find_clip(f.model, "clip_1", 6), 1);
  assert_int_equal(tw_model_find_clip(f.model, "clip_0", 6), 2); /* which is called so */
  assert_int_equal(tw_model_find_clip(f.model, "clip_3", 6), TW_NO_INDEX);
  assert_int_equal(f.model->warning_count, 1);
  assert_non_null(strstr(f.model->warnings[0], "clip_1"));
  tw_model_destroy(f.model);
}
