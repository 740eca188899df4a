/* Nodes, scenes, skins, clips and assets out of glTF. */
#include <math.h>

#include "glb.h"

/* Accessors over one BIN chunk: 0 times of 3 keys, 1 three vec4, 2 three vec3, 3 nine vec4, 4 two mat4,
 * 5 three vec4 of normalised shorts, 6 nine scalars, 7 four positions. */
typedef struct scene_bin {
  float times[3];
  float quaternions[3][4];
  float vectors[3][3];
  float splines[9][4];
  float matrices[2][16];
  int16_t shorts[3][4];
  float scalars[9];
  float positions[4][3];
} scene_bin;

#define DATA                                                                                                 \
  "'buffers':[{'byteLength':476}],'bufferViews':[{'buffer':0,'byteLength':476}],'accessors':["               \
  "{'bufferView':0,'byteOffset':0,'componentType':5126,'count':3,'type':'SCALAR'},"                          \
  "{'bufferView':0,'byteOffset':12,'componentType':5126,'count':3,'type':'VEC4'},"                           \
  "{'bufferView':0,'byteOffset':60,'componentType':5126,'count':3,'type':'VEC3'},"                           \
  "{'bufferView':0,'byteOffset':96,'componentType':5126,'count':9,'type':'VEC4'},"                           \
  "{'bufferView':0,'byteOffset':240,'componentType':5126,'count':2,'type':'MAT4'},"                          \
  "{'bufferView':0,'byteOffset':368,'componentType':5122,'normalized':true,'count':3,'type':'VEC4'},"        \
  "{'bufferView':0,'byteOffset':392,'componentType':5126,'count':9,'type':'SCALAR'},"                        \
  "{'bufferView':0,'byteOffset':428,'componentType':5126,'count':4,'type':'VEC3'}]"

static scene_bin make_bin(void) {
  scene_bin bin = {.times = {0, 0.5f, 2}, .vectors = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}};
  for (int i = 0; i < 3; i++) bin.quaternions[i][3] = 1;
  for (int i = 0; i < 9; i++) {
    bin.splines[i][3] = i % 3 == 1 ? 1 : 0;
    bin.scalars[i] = (float)i / 8;
  }
  for (int m = 0; m < 2; m++)
    for (int i = 0; i < 16; i += 5) bin.matrices[m][i] = (float)(m + 1);
  static const int16_t shorts[3][4] = {{0, 0, 0, 32767}, {32767, 0, 0, 0}, {0, -32768, 0, 0}};
  memcpy(bin.shorts, shorts, sizeof shorts);
  static const float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  memcpy(bin.positions, positions, sizeof positions);
  return bin;
}

static const char *with_data(const char *rest) {
  static char text[8192];
  snprintf(text, sizeof text, "{" ASSET "," DATA ",%s}", rest);
  return text;
}

static void assert_refused(const char *rest, tw_status status, const char *pointer) {
  scene_bin bin = make_bin();
  assert_int_equal(sizeof bin, 476);
  glb_refused(with_data(rest), &bin, sizeof bin, status, pointer);
}

static tw_model *read_good(const char *rest) {
  scene_bin bin = make_bin();
  return glb_read(with_data(rest), &bin, sizeof bin);
}

/* ---- nodes ----------------------------------------------------------------------------------- */

TEST(bad_hierarchies_are_refused) {
  static const struct {
    const char *json, *pointer;
  } cases[] = {
      {"'nodes':[{'children':[1]}]", "/nodes/0/children/0"},
      {"'nodes':[{'children':[-1]}]", "/nodes/0/children/0"},
      {"'nodes':[{'children':[0]}]", "/nodes/0/children"},
      {"'nodes':[{},{'children':[2]},{'children':[1]}]", "/nodes/1/children"},
      {"'nodes':[{'children':[2]},{'children':[2]},{}]", "/nodes/1/children/0"},
      {"'nodes':[{'children':[1,1]},{}]", "/nodes/0/children/1"},
      {"'nodes':[{'mesh':0}]", "/nodes/0/mesh"},
      {"'nodes':[{'mesh':-2}]", "/nodes/0/mesh"},
      {"'nodes':[{'skin':3}]", "/nodes/0/skin"},
      {"'nodes':[{'translation':[1,2]}]", "/nodes/0/translation"},
      {"'nodes':[{'rotation':[0,0,1]}]", "/nodes/0/rotation"},
      {"'nodes':[{'rotation':[0,0,0,0]}]", "/nodes/0/rotation"},
      {"'nodes':[{'scale':[1,1,1,1]}]", "/nodes/0/scale"},
      {"'nodes':[{'scale':[1,1e300,1]}]", "/nodes/0/scale"},
      {"'nodes':[{'translation':[1e39,0,0]}]", "/nodes/0/translation"},
      {"'nodes':[{'matrix':[1,0,0,0]}]", "/nodes/0/matrix"},
      {"'nodes':[{}],'scenes':[{'nodes':[1]}]", "/scenes/0/nodes/0"},
      {"'nodes':[{}],'scenes':[{'nodes':[0]}],'scene':1", "/scene"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_refused(cases[i].json, TW_INVALID, cases[i].pointer);
}

TEST(a_chain_of_fifty_thousand_nodes_is_read) {
  enum { COUNT = 50000 };
  char *json = malloc(40 * COUNT);
  assert_non_null(json);
  char *at = json + sprintf(json, "{" ASSET ",'nodes':[");
  for (int i = 0; i + 1 < COUNT; i++) at += sprintf(at, "{'children':[%d]},", i + 1);
  strcpy(at, "{}]}");
  tw_model *model = glb_read(json, NULL, 0);
  assert_int_equal(model->node_count, COUNT);
  assert_int_equal(model->nodes[COUNT - 1].parent, COUNT - 2);
  assert_int_equal(model->node_order[COUNT - 1], COUNT - 1);
  tw_model_destroy(model);
  free(json);
}

TEST(nodes_keep_name_parent_and_transform) {
  tw_model *model =
      read_good("'nodes':[{'name':'turm\\u00e4\\n','children':[2],'translation':[1,2,3],"
                "'rotation':[0,0,2,0],'scale':[1,2,1]},{'name':''},{'matrix':[1,0,0,0,1,1,0,0,0,0,1,0,5,6,"
                "7,1]}]");
  assert_string_equal(model->nodes[0].name, "turm\xC3\xA4 ");
  assert_null(model->nodes[1].name);
  assert_int_equal(model->nodes[0].parent, TW_NO_INDEX);
  assert_int_equal(model->nodes[2].parent, 0);
  assert_true(model->nodes[0].rest.translation[2] == 3);
  assert_true(model->nodes[0].rest.rotation[2] == 1); /* made unit */
  assert_true(model->nodes[0].rest.scale[1] == 2);
  assert_false(model->nodes[0].has_matrix);
  assert_true(model->nodes[2].has_matrix);
  assert_true(model->nodes[2].matrix[4] == 1);           /* shear */
  assert_true(model->nodes[2].rest.translation[1] == 6); /* its best fit */
  tw_model_destroy(model);
}

TEST(nodes_outside_the_shown_scene_are_hidden) {
  tw_model *model = read_good("'meshes':[{'primitives':[{'attributes':{'POSITION':2}}]}],"
                              "'nodes':[{'mesh':0},{'children':[2]},{'mesh':0}],'scenes':[{'nodes':[0]},"
                              "{'name':'shown','nodes':[1]}],'scene':1");
  assert_string_equal(model->name, "shown");
  assert_true(model->nodes[0].is_hidden);
  assert_false(model->nodes[1].is_hidden);
  assert_false(model->nodes[2].is_hidden);
  assert_int_equal(model->nodes[0].mesh, 0);
  assert_int_equal(glb_warning_count(model), 1);
  assert_non_null(strstr(glb_warning(model, 0), "1 node that is not shown has a mesh that others show"));
  tw_model_destroy(model);
}

TEST(what_is_left_out_is_said) {
  tw_model *model =
      read_good("'nodes':[{'weights':[1]},{'extensions':{'A':{'b':[{'oddAccessor':0}]},"
                "'B':{'accessor':'x'}}},{'extensions':{'A':{'bufferViews':[0]}},'extras':{'bufferView':0}}]");
  assert_int_equal(glb_warning_count(model), 2);
  assert_string_equal(glb_warning(model, 0),
                      "the extension A at /nodes/1 is left out: its data is in buffers, as at 1 more place");
  assert_string_equal(model->nodes[1].preserved, "{\"extensions\":{\"B\":{\"accessor\":\"x\"}}}");
  assert_string_equal(model->nodes[2].preserved, "{\"extras\":{\"bufferView\":0}}");
  tw_model_destroy(model);
}

/* ---- skins ----------------------------------------------------------------------------------- */

TEST(bad_skins_are_refused) {
  static const struct {
    const char *skin, *pointer;
  } cases[] = {
      {"{'joints':[]}", "/skins/0/joints"},
      {"{'joints':[0,2]}", "/skins/0/joints/1"},
      {"{'joints':[-1]}", "/skins/0/joints/0"},
      {"{'joints':[0],'skeleton':2}", "/skins/0/skeleton"},
      {"{'joints':[0],'inverseBindMatrices':99}", "/skins/0/inverseBindMatrices"},
      {"{'joints':[0],'inverseBindMatrices':1}", "/accessors/1/type"},
      {"{'joints':[0,1,0],'inverseBindMatrices':4}", "/accessors/4/count"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char json[512];
    snprintf(json, sizeof json, "'nodes':[{},{}],'skins':[%s]", cases[i].skin);
    assert_refused(json, TW_INVALID, cases[i].pointer);
  }
  /* A mesh that uses joint 1 of a skin with one joint. */
  scene_bin bin = make_bin();
  static const uint8_t joints[12] = {0, 0, 0, 0, 0, 0, 0, 1}; /* all weight is on the fourth */
  memcpy(bin.scalars, joints, sizeof joints);
  const char *json = with_data("'meshes':[{'primitives':[{'attributes':{'POSITION':2,'JOINTS_0':8,"
                               "'WEIGHTS_0':1}}]}],'nodes':[{'mesh':0,'skin':0}],'skins':[{'joints':[0]}]");
  char *with_joints = malloc(strlen(json) + 200);
  assert_non_null(with_joints);
  const char *end = strstr(json, "],'meshes'");
  sprintf(with_joints,
          "%.*s,{'bufferView':0,'byteOffset':392,'componentType':5121,'count':3,'type':'VEC4'}%s",
          (int)(end - json), json, end);
  glb_refused(with_joints, &bin, sizeof bin, TW_INVALID, "/nodes/0/skin");
  free(with_joints);
}

TEST(skins_keep_joints_and_matrices) {
  tw_model *model = read_good("'nodes':[{},{}],'skins':[{'name':'s','joints':[1,0],"
                              "'inverseBindMatrices':4,'skeleton':1},{'joints':[0]}]");
  assert_int_equal(model->skin_count, 2);
  assert_string_equal(model->skins[0].name, "s");
  assert_int_equal(model->skins[0].joint_count, 2);
  assert_int_equal(model->skins[0].joints[0], 1);
  assert_int_equal(model->skins[0].skeleton, 1);
  assert_true(model->skins[0].inverse_bind[21] == 2);
  assert_true(model->skins[1].inverse_bind[5] == 1); /* identity when there is none */
  assert_true(model->skins[1].inverse_bind[1] == 0);
  tw_model_destroy(model);
}

/* ---- clips ----------------------------------------------------------------------------------- */

TEST(bad_animations_are_refused) {
  static const struct {
    const char *sampler, *channel, *pointer;
  } cases[] = {
      {"'input':0,'output':1", "'sampler':1,'target':{'node':0,'path':'rotation'}",
       "/animations/0/channels/0/sampler"},
      {"'input':0,'output':1", "'sampler':0,'target':{'node':5,'path':'rotation'}",
       "/animations/0/channels/0/target/node"},
      {"'input':77,'output':1", "'sampler':0,'target':{'node':0,'path':'rotation'}",
       "/animations/0/samplers/0/input"},
      {"'input':0,'output':77", "'sampler':0,'target':{'node':0,'path':'rotation'}",
       "/animations/0/samplers/0/output"},
      {"'input':2,'output':1", "'sampler':0,'target':{'node':0,'path':'rotation'}", "/accessors/2/type"},
      {"'input':0,'output':2", "'sampler':0,'target':{'node':0,'path':'rotation'}", "/accessors/2/type"},
      {"'input':0,'output':1", "'sampler':0,'target':{'node':0,'path':'scale'}", "/accessors/1/type"},
      {"'input':0,'output':3", "'sampler':0,'target':{'node':0,'path':'rotation'}", "/accessors/3/count"},
      {"'input':0,'output':1,'interpolation':'CUBICSPLINE'",
       "'sampler':0,'target':{'node':0,'path':'rotation'}", "/accessors/1/count"},
      {"'input':0,'output':1,'interpolation':'BEZIER'", "'sampler':0,'target':{'node':0,'path':'rotation'}",
       "/animations/0/samplers/0/interpolation"},
      {"'input':6,'output':3", "'sampler':0,'target':{'node':0,'path':'rotation'}", "/accessors/3"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char json[1024];
    snprintf(json, sizeof json, "'nodes':[{}],'animations':[{'samplers':[{%s}],'channels':[{%s}]}]",
             cases[i].sampler, cases[i].channel);
    assert_refused(json, TW_INVALID, cases[i].pointer);
  }
}

/* Places are those of the document, also behind a channel that animates something else than a node. */
TEST(errors_of_clips_point_into_the_document) {
  static const struct {
    const char *channels, *pointer;
  } cases[] = {
      {"{'sampler':0,'target':{'node':0,'path':'scale'}},{'sampler':0,'target':{'node':0,'path':'scale'}}",
       "/animations/0/channels/1/target/path"},
      {"{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':"
       "'/materials/0/emissiveFactor'}}}},{'sampler':0,'target':{'node':0,'path':'scale'}},"
       "{'sampler':0,'target':{'node':0,'path':'scale'}}",
       "/animations/0/channels/2/target/path"},
      {"{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':"
       "'/materials/0/emissiveFactor'}}}},{'sampler':0,'target':{'node':9,'path':'scale'}}",
       "/animations/0/channels/1/target/node"},
      {"{'sampler':1,'target':{'node':0,'path':'rotation'}}", "/accessors/3"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char json[1024];
    snprintf(json, sizeof json,
             "'materials':[{}],'nodes':[{}],'animations':[{'samplers':[{'input':0,'output':2},{'input':6,"
             "'output':3}],'channels':[%s]}]",
             cases[i].channels);
    assert_refused(json, TW_INVALID, cases[i].pointer);
  }
}

/* A clip moves the targets of a mesh of points alone. */
TEST(meshes_of_points_keep_their_targets) {
  tw_model *model =
      read_good("'meshes':[{'weights':[0.5],'primitives':[{'mode':0,'attributes':{'POSITION':2},"
                "'targets':[{'POSITION':2}]}]}],'nodes':[{'mesh':0,'weights':[0.25]}],"
                "'animations':[{'samplers':[{'input':0,'output':0}],'channels':[{'sampler':0,"
                "'target':{'node':0,'path':'weights'}}]}]");
  assert_int_equal(model->meshes[0].morph_count, 1);
  assert_int_equal(model->meshes[0].point_count, 0);
  assert_float_equal(model->meshes[0].morph_weights[0], 0.5, 0);
  assert_float_equal(model->nodes[0].weights[0], 0.25, 0);
  assert_int_equal(model->clips[0].tracks[0].width, 1);
  assert_int_equal(glb_warning_count(model), 0);
  tw_model_destroy(model);
}

/* KHR_animation_pointer: a node without weights of its own has those of its mesh. */
TEST(a_pointer_to_the_weights_of_a_mesh_moves_nodes_without_weights_of_their_own) {
  static const char channels[] =
      "{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':"
      "'/meshes/0/weights'}}}},{'sampler':0,'target':{'node':3,'path':'weights'}},"
      "{'sampler':1,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':"
      "'/nodes/4/weights'}}}}";
  char json[2048];
  snprintf(json, sizeof json,
           "'meshes':[{'primitives':[{'mode':0,'attributes':{'POSITION':2},'targets':[{'POSITION':2}]}]},"
           "{'primitives':[{'mode':0,'attributes':{'POSITION':2}}]}],"
           "'nodes':[{'mesh':0},{'mesh':0,'weights':[0.25]},{'mesh':0},{'mesh':0},{'mesh':0},{'mesh':1}],"
           "'animations':[{'samplers':[{'input':0,'output':0},{'input':0,'output':0,'interpolation':'STEP'}],"
           "'channels':[%s]}]",
           channels);
  tw_model *model = read_good(json);
  static const uint32_t nodes[] = {3, 4, 0, 2}; /* those of meshes come last */
  assert_int_equal(model->clips[0].track_count, 4);
  assert_null(model->clips[0].loose);
  for (int i = 0; i < 4; i++) {
    const tw_track_keys *track = &model->clips[0].tracks[i];
    assert_int_equal(track->node, nodes[i]);
    assert_int_equal(track->path, TW_WEIGHTS);
    assert_int_equal(track->interpolation, i == 1 ? TW_STEP : TW_LINEAR);
  }
  assert_int_equal(glb_warning_count(model), 0);
  tw_model_destroy(model);
}

#define WEIGHT_CHANNEL(sampler, pointer)                                                                     \
  "{'sampler':" #sampler                                                                                     \
  ",'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':'" pointer "'}}}}"

/* A mesh with two targets at two nodes, of which the first has weights of its own. Accessor 0 counts three.
 */
static tw_model *read_weight_channels(const char *samplers, const char *channels) {
  char json[2048];
  snprintf(json, sizeof json,
           "'meshes':[{'weights':[0.75,0.5],'primitives':[{'mode':0,'attributes':{'POSITION':2},"
           "'targets':[{'POSITION':2},{'POSITION':2}]}]}],"
           "'nodes':[{'mesh':0,'weights':[0.25,0.125]},{'mesh':0}],"
           "'animations':[{'samplers':[%s],'channels':[%s]}]",
           samplers, channels);
  return read_good(json);
}

/* KHR_animation_pointer to one weight: the others stay as they are at rest. */
TEST(pointers_to_single_weights_move_nodes) {
  static const struct {
    const char *channels;
    uint32_t node;
    float others; /* of the weight that has no keys; NAN: both have */
    uint32_t moved;
  } cases[] = {
      {WEIGHT_CHANNEL(0, "/nodes/0/weights/1"), 0, 0.25f, 1},
      {WEIGHT_CHANNEL(0, "/nodes/1/weights/0"), 1, 0.5f, 0},
      {WEIGHT_CHANNEL(0, "/meshes/0/weights/1"), 1, 0.75f, 1},
      {WEIGHT_CHANNEL(0, "/nodes/0/weights/1") "," WEIGHT_CHANNEL(0, "/nodes/0/weights/0"), 0, NAN, 0}};
  scene_bin bin = make_bin();
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    tw_model *model = read_weight_channels("{'input':0,'output':0}", cases[i].channels);
    const tw_track_keys *track = &model->clips[0].tracks[0];
    assert_int_equal(model->clips[0].track_count, 1);
    assert_null(model->clips[0].loose);
    assert_int_equal(track->node, cases[i].node);
    assert_int_equal(track->path, TW_WEIGHTS);
    assert_int_equal(track->width, 2);
    assert_int_equal(track->key_count, 3);
    for (uint32_t key = 0; key < 3; key++)
      for (uint32_t k = 0; k < 2; k++) {
        bool has_keys = isnan(cases[i].others) || k == cases[i].moved;
        assert_float_equal(track->values[2 * key + k], (has_keys ? bin.times[key] : cases[i].others), 0);
      }
    assert_int_equal(glb_warning_count(model), 0);
    tw_model_destroy(model);
  }
}

/* One track of all weights cannot hold them: the channels stay as they are in glTF, which is told. */
TEST(single_weights_of_other_interpolations_are_kept_and_told) {
  static const char samplers[] = "{'input':0,'output':0},{'input':0,'output':0,'interpolation':'STEP'}";
  static const char *const channels[] = {
      WEIGHT_CHANNEL(0, "/nodes/0/weights/0") "," WEIGHT_CHANNEL(1, "/nodes/0/weights/1"),
      WEIGHT_CHANNEL(0, "/nodes/0/weights/0") "," WEIGHT_CHANNEL(0, "/nodes/0/weights/0"),
      WEIGHT_CHANNEL(0, "/nodes/0/weights/0") "," WEIGHT_CHANNEL(0, "/nodes/0/weights/2")};
  for (size_t i = 0; i < sizeof channels / sizeof *channels; i++) {
    /* A sampler that nothing names is told, too. */
    tw_model *model = read_weight_channels(i == 0 ? samplers : "{'input':0,'output':0}", channels[i]);
    assert_int_equal(model->clips[0].track_count, 0);
    assert_non_null(strstr(model->clips[0].loose, "/nodes/0/weights/0"));
    assert_int_equal(glb_warning_count(model), 1);
    tw_model_destroy(model);
  }
}

TEST(key_times_must_not_fall_or_be_negative) {
  static const float times[][3] = {{0, 2, 1}, {0, 0, -1}, {-1, 0, 1}, {0, 1, NAN}, {0, 1, INFINITY}};
  const char *json = with_data("'nodes':[{}],'animations':[{'samplers':[{'input':0,'output':2}],"
                               "'channels':[{'sampler':0,'target':{'node':0,'path':'scale'}}]}]");
  for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
    scene_bin bin = make_bin();
    memcpy(bin.times, times[i], sizeof bin.times);
    glb_refused(json, &bin, sizeof bin, TW_INVALID, "/accessors/0");
  }
}

TEST(key_times_may_repeat) {
  scene_bin bin = make_bin();
  memcpy(bin.times, (float[]){0, 1, 1}, sizeof bin.times);
  tw_model *model =
      glb_read(with_data("'nodes':[{'name':'n'}],'animations':[{'name':'c','samplers':[{'input':0,"
                         "'output':2}],'channels':[{'sampler':0,'target':{'node':0,'path':'scale'}}"
                         ",{'sampler':0,'target':{'node':0,'path':'translation'}}]}]"),
               &bin, sizeof bin);
  for (int i = 0; i < 2; i++) {
    const tw_track_keys *track = &model->clips[0].tracks[i];
    assert_int_equal(track->key_count, 3);
    assert_int_equal(track->duplicate_times, 1);
    assert_true(track->times[1] == nextafterf(1, 0) && track->times[2] == 1);
  }
  assert_int_equal(glb_warning_count(model), 2);
  assert_string_equal(glb_warning(model, 0),
                      "1 key at the time of the one before, where the scale jumps: clip \"c\", node \"n\"");
  tw_model_destroy(model);
}

TEST(clips_keep_their_tracks) {
  tw_model *model = read_good(
      "'nodes':[{},{}],'animations':[{'name':'aim','samplers':[{'input':0,'output':1},"
      "{'input':0,'output':2,'interpolation':'STEP'},{'input':0,'output':3,'interpolation':'CUBICSPLINE'},"
      "{'input':0,'output':5}],'channels':[{'sampler':0,'target':{'node':0,'path':'rotation'}},"
      "{'sampler':1,'target':{'node':0,'path':'translation'}},{'sampler':1,'target':{'node':1,"
      "'path':'scale'}},{'sampler':2,'target':{'node':1,'path':'rotation'}},"
      "{'sampler':0,'target':{'path':'pointer'}}]},{'samplers':[{'input':0,'output':5}],"
      "'channels':[{'sampler':0,'target':{'node':1,'path':'rotation'}}]}]");
  assert_int_equal(model->clip_count, 2);
  const tw_clip_keys *clip = &model->clips[0];
  assert_string_equal(clip->name, "aim");
  assert_null(model->clips[1].name);
  assert_int_equal(clip->track_count, 4);
  assert_int_equal(clip->tracks[0].interpolation, TW_LINEAR);
  assert_int_equal(clip->tracks[0].form, TW_KEY_QUATERNION);
  assert_int_equal(clip->tracks[0].width, 4);
  assert_int_equal(clip->tracks[1].interpolation, TW_STEP);
  assert_int_equal(clip->tracks[1].form, TW_KEY_VALUES);
  assert_int_equal(clip->tracks[1].key_count, 3);
  assert_true(clip->tracks[1].times[2] == 2 && clip->tracks[1].values[8] == 9);
  assert_ptr_equal(clip->tracks[1].values, clip->tracks[2].values); /* a sampler is read once */
  assert_int_equal(clip->tracks[3].interpolation, TW_CUBICSPLINE);
  const float *shorts = model->clips[1].tracks[0].values;
  assert_true(shorts[3] == 1 && shorts[4] == 1 && shorts[9] == -1); /* normalised integers */
  tw_model_destroy(model);
}

TEST(weights_tracks_fit_the_targets) {
  static const char mesh[] =
      "'meshes':[{'primitives':[{'attributes':{'POSITION':7},'mode':5,'targets':[{'POSITION':7},"
      "{'POSITION':7},{'POSITION':7}%s]}]}],'nodes':[{'mesh':0}],'animations':[{'samplers':[{'input':0,"
      "'output':6}],'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}}]}]";
  char json[1024];
  snprintf(json, sizeof json, mesh, "");
  tw_model *model = read_good(json);
  assert_int_equal(model->clips[0].tracks[0].width, 3);
  assert_true(model->clips[0].tracks[0].values[8] == 1);
  tw_model_destroy(model);
  snprintf(json, sizeof json, mesh, ",{'POSITION':7}");
  assert_refused(json, TW_INVALID, "/accessors/6/count");
}

/* Exporters leave tracks of weights behind where they left out the targets or the mesh. The places of errors
 * in the channels behind stay those of the document. */
TEST(weights_tracks_without_targets_are_left_out_with_a_warning) {
  static const char clip[] = "'meshes':[{'primitives':[{'attributes':{'POSITION':7},'mode':5}]}],'nodes':[{'"
                             "mesh':0},{}],'animations':"
                             "[{'samplers':[{'input':0,'output':6},{'input':0,'output':%d}],'channels':[{'"
                             "sampler':0,'target':{'node':"
                             "0,'path':'weights'}},{'sampler':0,'target':{'node':1,'path':'weights'}},{'"
                             "sampler':1,'target':{'node':1,"
                             "'path':'translation'}}]}]";
  char json[1024];
  snprintf(json, sizeof json, clip, 2);
  tw_model *model = read_good(json);
  assert_int_equal(model->clips[0].track_count, 1);
  const tw_track_keys *track = &model->clips[0].tracks[0];
  assert_true(track->path == TW_TRANSLATION && track->node == 1 && track->values[8] == 9);
  assert_true(warns_of(model, "2 channels of morph weights are left out: their nodes show no morph targets"));
  tw_model_destroy(model);
  snprintf(json, sizeof json, clip, 1);
  assert_refused(json, TW_INVALID, "/accessors/1/type");
}

/* Tracks copy their keys when they are compiled: a small file must not ask for millions of copies. */
TEST(samplers_cannot_be_named_without_end) {
  enum { NODES = 3000, KEYS = 2000 };
  float *bin = malloc(KEYS * 16);
  char *json = malloc(NODES * 80 + 1000), *at = json;
  assert_true(bin && json);
  for (int i = 0; i < KEYS * 4; i++) bin[i] = (float)i;
  at += sprintf(
      at, "{" ASSET
          ",'buffers':[{'byteLength':32000}],'bufferViews':[{'buffer':0,'byteLength':32000}],'accessors':["
          "{'bufferView':0,'componentType':5126,'count':2000,'type':'SCALAR'},"
          "{'bufferView':0,'componentType':5126,'count':2000,'type':'VEC3'}],'nodes':[{}");
  for (int i = 1; i < NODES; i++) at += sprintf(at, ",{}");
  at += sprintf(at, "],'animations':[{'samplers':[{'input':0,'output':1}],'channels':[");
  for (int i = 0; i < NODES; i++)
    at += sprintf(at, "%s{'sampler':0,'target':{'node':%d,'path':'scale'}}", i ? "," : "", i);
  strcpy(at, "]}]}");
  glb_refused(json, bin, KEYS * 16, TW_LIMIT, "/animations/0/samplers/0");
  free(json);
  free(bin);
}

/* ---- assets ---------------------------------------------------------------------------------- */

TEST(bad_texture_references_are_refused) {
  static const struct {
    const char *json, *pointer;
  } cases[] = {
      {"'materials':[{'pbrMetallicRoughness':{'baseColorTexture':{'index':0}}}]",
       "/materials/0/pbrMetallicRoughness/baseColorTexture/index"},
      {"'materials':[{'normalTexture':{'index':-2}}]", "/materials/0/normalTexture/index"},
      {"'materials':[{'extensions':{'KHR_materials_clearcoat':{'clearcoatTexture':{'index':4}}}}]",
       "/materials/0/extensions/KHR_materials_clearcoat/clearcoatTexture/index"},
      {"'textures':[{'source':0}]", "/textures/0/source"},
      {"'textures':[{'sampler':0}]", "/textures/0/sampler"},
      {"'textures':[{'extensions':{'EXT_texture_webp':{'source':0}}}]",
       "/textures/0/extensions/EXT_texture_webp/source"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_refused(cases[i].json, TW_INVALID, cases[i].pointer);
}

TEST(materials_and_images_are_kept) {
  tw_model *model = read_good(
      "'materials':[{'name':'a'},{'name':'b'}],'images':[{'bufferView':0,'mimeType':'image/png'},"
      "{'uri':'data:image/png;base64,AAAA'},{'uri':'https://outside.example/a.png'}],'samplers':[{}],"
      "'textures':[{'source':0,'sampler':0}]");
  assert_int_equal(model->material_count, 2);
  assert_string_equal(model->material_names[1], "b");
  assert_non_null(model->assets);
  assert_true(tw_model_size(model) > 476);
  tw_model_destroy(model);
}
