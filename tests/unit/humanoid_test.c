/* Humanoid maps out of VRM 1.0, VRM 0.x and VRMA. */
#include "glb.h"
#include "tweend/retarget.h"

static const char *with_extension(const char *extension) {
  static char text[4096];
  snprintf(text, sizeof text,
           "{'asset':{'version':'2.0'},'nodes':[{'name':'a'},{'name':'b'},{'name':'c'}],"
           "'extensionsUsed':['VRMC_vrm'],'extensions':{%s}}",
           extension);
  return text;
}

static tw_model *read_with(const char *extension) {
  return glb_read(with_extension(extension), NULL, 0);
}

TEST(bad_humanoid_maps_are_refused_with_their_place) {
  static const struct {
    const char *json, *pointer;
  } cases[] = {
      {"'VRMC_vrm':{'humanoid':{'humanBones':{'hips':{'node':3}}}}",
       "/extensions/VRMC_vrm/humanoid/humanBones/hips/node"},
      {"'VRMC_vrm':{'humanoid':{'humanBones':{'hips':{'node':-1}}}}",
       "/extensions/VRMC_vrm/humanoid/humanBones/hips/node"},
      {"'VRMC_vrm':{'humanoid':{'humanBones':{'hips':{'node':1e300}}}}",
       "/extensions/VRMC_vrm/humanoid/humanBones/hips/node"},
      {"'VRMC_vrm':{'humanoid':{'humanBones':{'hips':{}}}}",
       "/extensions/VRMC_vrm/humanoid/humanBones/hips/node"},
      {"'VRMC_vrm':{'humanoid':{'humanBones':{'wing/tip':7}}}",
       "/extensions/VRMC_vrm/humanoid/humanBones/wing~1tip"},
      {"'VRMC_vrm':{'humanoid':{'humanBones':[]}}", "/extensions/VRMC_vrm/humanoid/humanBones"},
      {"'VRMC_vrm_animation':{'humanoid':{'humanBones':{'hips':{'node':0},'head':{'node':0}}}}",
       "/extensions/VRMC_vrm_animation/humanoid/humanBones/head/node"},
      {"'VRM':{'humanoid':{'humanBones':{}}}", "/extensions/VRM/humanoid/humanBones"},
      {"'VRM':{'humanoid':{'humanBones':[7]}}", "/extensions/VRM/humanoid/humanBones/0"},
      {"'VRM':{'humanoid':{'humanBones':[{'node':0}]}}", "/extensions/VRM/humanoid/humanBones/0/bone"},
      {"'VRM':{'humanoid':{'humanBones':[{'bone':'hips','node':0},{'bone':'hips','node':1}]}}",
       "/extensions/VRM/humanoid/humanBones/1/node"},
      {"'VRM':{'humanoid':{'humanBones':[{'bone':'hips','node':9}]}}",
       "/extensions/VRM/humanoid/humanBones/0/node"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    glb_refused(with_extension(cases[i].json), NULL, 0, TW_INVALID, cases[i].pointer);
}

TEST(each_extension_tells_the_bones) {
  static const char *const bones =
      "{'humanoid':{'humanBones':{'hips':{'node':2},'leftThumbProximal':{'node':0}}}}";
  static const char *const names[] = {"VRMC_vrm", "VRMC_vrm_animation"};
  for (size_t i = 0; i < 2; i++) {
    char text[256];
    snprintf(text, sizeof text, "'%s':%s", names[i], bones);
    tw_model *model = read_with(text);
    assert_non_null(model->humanoid);
    assert_int_equal(model->humanoid[TW_BONE_HIPS], 2);
    assert_int_equal(model->humanoid[TW_BONE_THUMB + 2], 0);
    for (uint32_t bone = 0, count = 0; bone < TW_BONES; bone++) {
      count += model->humanoid[bone] != TW_NO_INDEX;
      if (bone + 1 == TW_BONES) assert_int_equal(count, 2);
    }
    tw_model_destroy(model);
  }
}

/* 0.x counts the joints of thumbs as those of other fingers. */
TEST(thumbs_of_older_files_get_their_new_names) {
  tw_model *model =
      read_with("'VRM':{'humanoid':{'humanBones':[{'bone':'rightThumbProximal','node':0},"
                "{'bone':'rightThumbIntermediate','node':1},{'bone':'rightThumbDistal','node':2},"
                "{'bone':'jaw','node':-1}]}}");
  for (uint32_t joint = 0; joint < 3; joint++)
    assert_int_equal(model->humanoid[TW_BONE_THUMB + 2 * joint + 1], joint);
  assert_string_equal(tw_bone_names[TW_BONE_THUMB + 1], "rightThumbMetacarpal");
  assert_int_equal(model->humanoid[TW_BONE_JAW], TW_NO_INDEX);
  tw_model_destroy(model);
}

TEST(the_newer_extension_counts) {
  tw_model *model = read_with("'VRM':{'humanoid':{'humanBones':[{'bone':'hips','node':0}]}},"
                              "'VRMC_vrm':{'humanoid':{'humanBones':{'hips':{'node':1}}}}");
  assert_int_equal(model->humanoid[TW_BONE_HIPS], 1);
  tw_model_destroy(model);
}

TEST(unknown_bones_are_a_warning) {
  tw_model *model = read_with(
      "'VRMC_vrm':{'humanoid':{'humanBones':{'tail':{'node':0},'wing':{'node':1},'hips':{'node':2}}}}");
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "2 bones are left out"));
  assert_non_null(strstr(model->warnings[0], "tail"));
  assert_int_equal(model->humanoid[TW_BONE_HIPS], 2);
  tw_model_destroy(model);
  model = read_with("'VRMC_vrm':{'humanoid':{'humanBones':{}}}");
  assert_null(model->humanoid);
  tw_model_destroy(model);
}

TEST(bones_are_found_by_their_names) {
  for (uint32_t i = 0; i < TW_BONES; i++)
    assert_int_equal(tw_bone_find(tw_bone_names[i], strlen(tw_bone_names[i])), i);
  assert_int_equal(tw_bone_find("leftLittleDistal", 16), TW_BONES - 2);
  assert_int_equal(tw_bone_find("hip", 3), TW_BONES);
  assert_int_equal(tw_bone_find("", 0), TW_BONES);
}
