/* GLB answers: materials, nodes, skins and clips. */
#include <string.h>

#include "test.h"
#include "written_glb.h"

/* ---- materials ------------------------------------------------------------------------------- */

static const char materials_text[] =
    "{\"asset\":{\"version\":\"2.0\",\"copyright\":\"nobody\"},"
    "\"images\":[{\"uri\":\"https://far/away.png\"},"
    "{\"name\":\"near\",\"mimeType\":\"image/png\",\"uri\":\"data:image/png;base64,iVBORw0KGgoBAgME\"},"
    "{\"uri\":\"data:application/octet-stream;base64,UklGRgAAAABXRUJQ\"}],"
    "\"textures\":[{\"source\":1}],\"extensionsUsed\":[\"KHR_materials_unlit\"],"
    "\"materials\":[{\"emissiveTexture\":{\"index\":0},\"extensions\":{\"KHR_materials_unlit\":{}}}]}";

TEST(materials_and_images_go_through) {
  static const uint8_t picture[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n', 1, 2, 3, 4};
  fixture f = {0};
  tw_error error;
  if (tw_gltf_read((const uint8_t *)materials_text, sizeof materials_text - 1, TW_QUADS_NGON, TW_WELD_AUTO, 0,
                   &f.model, &error) != TW_OK)
    fail_msg("%s %s", error.pointer, error.detail);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  assert_string_equal(cJSON_GetObjectItem(at(&file, "images", 0), "uri")->valuestring,
                      "https://far/away.png");
  const cJSON *near = at(&file, "images", 1);
  assert_string_equal(cJSON_GetObjectItem(near, "name")->valuestring, "near");
  assert_string_equal(cJSON_GetObjectItem(near, "mimeType")->valuestring, "image/png");
  assert_false(cJSON_HasObjectItem(near, "uri"));
  const cJSON *untold = at(&file, "images", 2);
  assert_string_equal(cJSON_GetObjectItem(untold, "mimeType")->valuestring, "image/webp");
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

/* ---- nodes, skins, clips --------------------------------------------------------------------- */

TEST(nodes_keep_names_order_and_transforms) {
  fixture f;
  fixture_init(&f, cube_text);
  static const char odd[] = "say \"\xC3\xA4\" \\ /";
  uint32_t child = fixture_node(&f, odd, 0, TW_NO_INDEX);
  uint32_t grandchild = fixture_node(&f, NULL, child, TW_NO_INDEX);
  f.model->nodes[child].rest = (tw_trs){{0, 0.6f, 0, 0.8f}, {1, 2, 0.1f}, {1, 1, 1}};
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

TEST(pose_takes_the_place_of_rest) {
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

TEST(animated_node_gives_up_its_matrix) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_clip(&f);
  fixture_refine(&f, 1, true);
  for (int i = 0; i < 2; i++) {
    f.model->nodes[i].has_matrix = true;
    for (int j = 0; j < 4; j++) f.model->nodes[i].matrix[5 * j] = 1;
  }
  f.scene.clips = f.model->clips;
  f.scene.clip_count = 1;
  glb file = write_glb(&f.scene);
  assert_true(cJSON_HasObjectItem(at(&file, "nodes", 0), "matrix"));
  assert_false(cJSON_HasObjectItem(at(&file, "nodes", 1), "matrix"));
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(skin_stays_with_its_node) {
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

TEST(node_loses_its_skin_where_the_surface_has_no_joints) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_skin(&f);
  f.model->meshes[0].skin = (tw_skin_weights){0}; /* as a baked mesh */
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  assert_false(cJSON_HasObjectItem(at(&file, "nodes", 0), "skin"));
  assert_string_equal(cJSON_GetObjectItem(at(&file, "skins", 0), "name")->valuestring, "leg");
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(clip_becomes_an_animation) {
  static const char *const interpolations[] = {"LINEAR",      "LINEAR", "LINEAR",      "LINEAR",
                                               "CUBICSPLINE", "STEP",   "CUBICSPLINE", "LINEAR"};
  fixture f;
  everything(&f, 1);
  glb file = write_glb(&f.scene);
  const cJSON *animation = at(&file, "animations", 0);
  assert_string_equal(cJSON_GetObjectItem(animation, "name")->valuestring, "aim");
  const tw_clip_keys *clip = f.scene.clips;
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

/* The one in between moves weights that the mesh does not have. */
TEST(clips_become_animations_in_order) {
  static const float times[2] = {0, 1}, moves[2][3] = {{0, 0, 0}, {1, 2, 3}};
  tw_track_keys nudge = value_keys(TW_TRANSLATION, TW_LINEAR, times, moves[0], 2);
  tw_track_keys smile = nudge;
  smile.path = TW_WEIGHTS;
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_clip(&f);
  fixture_refine(&f, 1, true);
  f.model->nodes[0].has_matrix = true;
  for (int j = 0; j < 4; j++) f.model->nodes[0].matrix[5 * j] = 1;
  const tw_clip_keys clips[] = {f.model->clips[0],
                                {.name = "smile", .track_count = 1, .tracks = &smile},
                                {.track_count = 1, .tracks = &nudge}};
  f.scene.clips = clips;
  f.scene.clip_count = 3;
  glb file = write_glb(&f.scene);
  assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(file.json, "animations")), 2);
  assert_string_equal(cJSON_GetObjectItem(at(&file, "animations", 0), "name")->valuestring, "aim");
  const cJSON *last = at(&file, "animations", 1);
  assert_false(cJSON_HasObjectItem(last, "name"));
  const cJSON *channels = cJSON_GetObjectItem(last, "channels"),
              *samplers = cJSON_GetObjectItem(last, "samplers");
  assert_int_equal(cJSON_GetArraySize(channels), 1);
  assert_int_equal(cJSON_GetArraySize(samplers), 1);
  assert_int_equal(number(cJSON_GetArrayItem(channels, 0), "sampler", 99), 0);
  float reached[3];
  read_floats(&file, (int)number(cJSON_GetArrayItem(samplers, 0), "output", UINT32_MAX), 1, 3, reached);
  assert_memory_equal(reached, moves[1], sizeof reached);
  assert_false(cJSON_HasObjectItem(at(&file, "nodes", 0), "matrix"));
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(hundreds_of_tracks_are_written_and_too_many_are_over_the_limit) {
  enum { FEW = 300, MANY = 140000 };
  static const float times[2] = {0, 1}, values[2][3] = {{0, 0, 0}, {1, 2, 3}};
  fixture f;
  fixture_init(&f, cube_text);
  fixture_refine(&f, 1, true);
  tw_track_keys *tracks = fixture_alloc(&f, MANY, sizeof *tracks);
  for (uint32_t i = 0; i < MANY; i++) tracks[i] = value_keys(TW_TRANSLATION, TW_LINEAR, times, values[0], 2);
  tw_clip_keys clip = {.track_count = FEW, .tracks = tracks};
  f.scene.clips = &clip;
  f.scene.clip_count = 1;
  glb file = write_glb(&f.scene);
  const cJSON *samplers = cJSON_GetObjectItem(at(&file, "animations", 0), "samplers");
  assert_int_equal(cJSON_GetArraySize(samplers), FEW);
  float reached[3];
  read_floats(&file, (int)number(cJSON_GetArrayItem(samplers, FEW - 1), "output", UINT32_MAX), 1, 3, reached);
  assert_memory_equal(reached, values[1], sizeof reached);
  free_glb(&file);
  clip.track_count = MANY;
  uint64_t size;
  tw_error error;
  assert_int_equal(tw_gltf_stream_predict(&f.scene, TW_FORMAT_GLB, &size, &error), TW_LIMIT);
  assert_non_null(strstr(error.detail, "over the limit of 262144"));
  fixture_deinit(&f);
}

TEST(weights_go_only_to_meshes_with_as_many_targets) {
  static const float times[2] = {0, 1}, values[2][3] = {{0, 0.5f, 1}, {1, 0.5f, 0}};
  tw_track_keys track = value_keys(TW_WEIGHTS, TW_LINEAR, times, values[0], 2);
  tw_clip_keys clip = {.track_count = 1, .tracks = &track};
  for (uint32_t targets = 2; targets < 4; targets++) {
    fixture f;
    fixture_init(&f, cube_text);
    fixture_add_morphs(&f, targets);
    fixture_refine(&f, 1, true);
    f.scene.clips = &clip;
    f.scene.clip_count = 1;
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
