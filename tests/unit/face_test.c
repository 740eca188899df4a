/* Faces: what VRM 1.0, VRM 0.x and VRMA say of them, and clips carried over. Against three-vrm: tests/node.
 */
#include <math.h>

#include "glb.h"
#include "tweend/face.h"

/* Three morph targets of one vertex on two nodes, 0 and 1; node 2 has none. */
static tw_model *read_face(const char *extension) {
  static const float points[3] = {1, 2, 3};
  char text[4096];
  snprintf(text, sizeof text,
           "{'asset':{'version':'2.0'},'buffers':[{'byteLength':12}],'bufferViews':[{'buffer':0,"
           "'byteLength':12}],'accessors':[{'bufferView':0,'componentType':5126,'count':1,'type':'VEC3',"
           "'min':[1,2,3],'max':[1,2,3]}],'meshes':[{'primitives':[{'mode':0,'attributes':{'POSITION':0},"
           "'targets':[{'POSITION':0},{'POSITION':0},{'POSITION':0}]}]}],"
           "'nodes':[{'mesh':0},{'mesh':0},{'name':'c'}],'extensions':{%s}}",
           extension);
  return glb_read(text, points, sizeof points);
}

static const tw_expression *expression_of(const tw_model *model, const char *name) {
  for (uint32_t i = 0; model->face && i < model->face->expression_count; i++)
    if (strcmp(model->face->expressions[i].name, name) == 0) return &model->face->expressions[i];
  return NULL;
}

TEST(a_face_of_vrm_1_is_read) {
  tw_model *model = read_face(
      "'VRMC_vrm':{'specVersion':'1.0','humanoid':{'humanBones':{'hips':{'node':2}}},'expressions':{"
      "'preset':{'happy':{'isBinary':true,'overrideBlink':'blend','overrideMouth':'block','morphTargetBinds':"
      "[{'node':1,'index':2,'weight':0.5},{'node':0,'index':0}]}},"
      "'custom':{'wink':{'materialColorBinds':[{'material':0}]}}},"
      "'lookAt':{'type':'expression','rangeMapVerticalUp':{'inputMaxValue':0,'outputScale':2}}}");
  assert_int_equal(glb_warning_count(model), 0);
  assert_int_equal(model->face->expression_count, 2);
  const tw_expression *happy = expression_of(model, "happy");
  assert_true(happy->is_binary && !happy->moves_materials);
  assert_int_equal(happy->overrides[TW_FACE_BLINK], TW_OVERRIDE_BLEND);
  assert_int_equal(happy->overrides[TW_FACE_GAZE], TW_OVERRIDE_NONE);
  assert_int_equal(happy->overrides[TW_FACE_MOUTH], TW_OVERRIDE_BLOCK);
  assert_int_equal(happy->bind_count, 2);
  assert_int_equal(happy->binds[0].node, 1);
  assert_int_equal(happy->binds[0].target, 2);
  assert_float_equal(happy->binds[0].weight, 0.5, 0);
  assert_float_equal(happy->binds[1].weight, 1, 0);
  assert_true(expression_of(model, "wink")->moves_materials);
  assert_int_equal(model->face->gaze, TW_GAZE_EXPRESSIONS);
  assert_true(model->face->up.most > 0);
  assert_float_equal(model->face->up.scale, 2, 0);
  assert_float_equal(model->face->down.most, 90, 0);
  assert_float_equal(model->face->down.scale, 1, 0);
  assert_false(model->face->faces_back);
  tw_model_destroy(model);
}

/* A mesh's bind is one on each node that shows it; weights are percentages. */
TEST(a_face_of_vrm_0_is_read_by_the_names_of_1) {
  tw_model *model = read_face(
      "'VRM':{'blendShapeMaster':{'blendShapeGroups':[{'name':'Joy','presetName':'joy','binds':[{'mesh':0,"
      "'index':1,'weight':40}]},{'name':'Grin','presetName':'unknown','isBinary':true,'materialValues':[5]},"
      "{'presetName':'joy','name':'again'}]},'firstPerson':{'lookAtTypeName':'Bone','lookAtVerticalUp':"
      "{'curve':[0,0,0,0,1,1,0,0],'xRange':45,'yRange':8},'lookAtVerticalDown':{'curve':[0,0,0,1,1,1,1,0]}}"
      "}");
  assert_int_equal(model->face->expression_count, 2);
  const tw_expression *happy = expression_of(model, "happy");
  assert_int_equal(happy->bind_count, 2);
  for (uint32_t i = 0; i < 2; i++) {
    assert_int_equal(happy->binds[i].node, i);
    assert_int_equal(happy->binds[i].target, 1);
    assert_float_equal(happy->binds[i].weight, 0.4, 1e-7);
  }
  assert_true(expression_of(model, "Grin")->is_binary && expression_of(model, "Grin")->moves_materials);
  assert_int_equal(model->face->gaze, TW_GAZE_BONES);
  assert_true(model->face->faces_back);
  assert_float_equal(model->face->up.most, 45, 0);
  assert_float_equal(model->face->inner.scale, 10, 0);
  assert_int_equal(model->face->up.key_count, 2);
  assert_float_equal(model->face->up.keys[1].value, 1, 0);
  assert_null(model->face->down.keys);
  assert_true(warns_of(model, "it has the name of one before"));
  tw_model_destroy(model);
}

TEST(nodes_of_a_vrma_stand_for_expressions_and_the_gaze) {
  tw_model *model = read_face("'VRMC_vrm_animation':{'specVersion':'1.0','humanoid':{'humanBones':{'hips':"
                              "{'node':0}}},'expressions':{'preset':{'blink':{'node':1}},'custom':{'wink':"
                              "{'node':2}}},'lookAt':{'node':1}}");
  assert_null(model->face);
  assert_int_equal(model->face_nodes->expression_count, 2);
  assert_string_equal(model->face_nodes->expressions[1].name, "wink");
  assert_int_equal(model->face_nodes->expressions[1].node, 2);
  assert_int_equal(model->face_nodes->gaze, 1);
  assert_true(tw_face_has_node(model->face_nodes, 2));
  assert_false(tw_face_has_node(model->face_nodes, 0));
  assert_int_equal(glb_warning_count(model), 0);
  tw_model_destroy(model);
}

/* A file is a model without a face too. */
TEST(what_does_not_fit_a_face_is_passed_over_and_told) {
  static const char *const faces[] = {
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'expressions':{'preset':{'smile':{}}}}",
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'expressions':{'preset':{'happy':5}}}",
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'expressions':{'custom':{'happy':{}}}}",
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'expressions':{'preset':[7]}}",
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'lookAt':3}",
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'lookAt':{'rangeMapVerticalUp':{'outputScale':'x'}}}",
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'expressions':{'preset':{'sad':{'morphTargetBinds':"
      "[{'node':9,'index':0}]}}}}",
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'expressions':{'preset':{'sad':{'morphTargetBinds':"
      "[{'node':0,'index':3}]}}}}",
      "'VRMC_vrm':{'humanoid':{'humanBones':{}},'expressions':{'preset':{'sad':{'morphTargetBinds':"
      "[{'node':0,'index':0,'weight':1e30}]}}}}",
      "'VRM':{'blendShapeMaster':{'blendShapeGroups':[5]}}",
      "'VRM':{'blendShapeMaster':{'blendShapeGroups':[{'presetName':'unknown'}]}}",
      "'VRM':{'blendShapeMaster':{'blendShapeGroups':[{'presetName':'joy','binds':[{'mesh':1,'index':0}]}]}}",
      "'VRM':{'firstPerson':{'lookAtVerticalUp':{'curve':[0,0,0,1,1,1,1]}}}",
      "'VRM':{'firstPerson':{'lookAtVerticalUp':{'curve':[0,0,0,1,0,1,1,0]}}}",
      "'VRM':{'firstPerson':{'lookAtVerticalUp':{'curve':[0,0,0,1,1,'1',1,0]}}}",
      "'VRM':{'firstPerson':{'lookAtVerticalUp':{'curve':[]}}}",
      "'VRMC_vrm_animation':{'expressions':{'preset':{'blink':{'node':3}}}}",
      "'VRMC_vrm_animation':{'expressions':{'preset':{'lookUp':{'node':1}}}}",
      "'VRMC_vrm_animation':{'expressions':{'custom':{'':{'node':1}}}}",
      "'VRMC_vrm_animation':{'humanoid':{'humanBones':{'hips':{'node':1}}},'lookAt':{'node':1}}"};
  for (size_t i = 0; i < sizeof faces / sizeof *faces; i++) {
    tw_model *model = read_face(faces[i]);
    if (!warns_of(model, "not as the extension's specification says")) fail_msg("in silence: %s", faces[i]);
    assert_null(model->face_nodes);
    for (uint32_t k = 0; model->face && k < model->face->expression_count; k++)
      assert_int_equal(model->face->expressions[k].bind_count, 0);
    tw_model_destroy(model);
  }
}

TEST(no_more_expressions_are_read_than_can_be_looked_up) {
  enum { MOST = 1024, MANY = MOST + 2, ROOM = 64 };
  static char groups[MANY * ROOM + 1024];
  size_t used = (size_t)sprintf(groups, "{'asset':{'version':'2.0'},'extensions':{'VRM':{'blendShapeMaster':"
                                        "{'blendShapeGroups':[");
  for (int i = 0; i < MANY; i++) used += (size_t)sprintf(groups + used, "%s{'name':'e%d'}", i ? "," : "", i);
  sprintf(groups + used, "]}}}}");
  tw_model *model = glb_read(groups, NULL, 0);
  assert_int_equal(model->face->expression_count, MOST);
  assert_true(warns_of(model, "2 expressions are left out: there are too many"));
  tw_model_destroy(model);
}

/* An expression of VRM 0.x binds the target of a mesh, which means one bind for each node that shows it.
 * Targets that are not there are told once for each bind of the file, not for each node. */
TEST(no_more_binds_are_read_than_have_room) {
  enum { NODES = 2000, BINDS = 140, KEPT = (1 << 18) / NODES, ROOM = 32 };
  static char document[(NODES + 2 * BINDS) * ROOM + 1024];
  char *end =
      stpcpy(document, "{'asset':{'version':'2.0'},'meshes':[{'primitives':[{'attributes':{'POSITION':0},"
                       "'targets':[{'POSITION':0}]}]}],'accessors':[{'componentType':5126,'count':3,"
                       "'type':'VEC3','min':[0,0,0],'max':[0,0,0]}],'nodes':[");
  for (int i = 0; i < NODES; i++) end = stpcpy(end, i ? ",{'mesh':0}" : "{'mesh':0}");
  end = stpcpy(end, "],'extensions':{'VRM':{'blendShapeMaster':{'blendShapeGroups':[{'name':'e','binds':[");
  for (int i = 0; i < BINDS; i++) end = stpcpy(end, "{'mesh':0,'index':0},{'mesh':0,'index':1},");
  strcpy(end - 1, "]}]}}}}");
  tw_model *model = glb_read(document, NULL, 0);
  char told[96];
  snprintf(told, sizeof told, "%d binds of expressions are left out: there are too many",
           (BINDS - KEPT) * NODES);
  assert_int_equal(model->face->expressions[0].bind_count, KEPT * NODES);
  assert_true(warns_of(model, told));
  snprintf(told, sizeof told, "%d more", BINDS - 1);
  assert_true(warns_of(model, "not as the extension's specification says"));
  assert_true(warns_of(model, told));
  tw_model_destroy(model);
}

/* ---- carried over ---------------------------------------------------------------------------- */

enum { NODES = 3, TARGETS = 2 };

/* Two expressions on node 0 of the target; nodes 0 and 1 of the source move them. */
typedef struct scene {
  tw_arena *arena;
  tw_node nodes[NODES];
  uint32_t order[NODES];
  tw_expression expressions[2];
  tw_face face;
  uint32_t gaze; /* the node of the source */
  tw_face_carried out;
} scene;

static const tw_morph_bind first_bind = {0, 0, 0.5F}, second_bind = {0, 1, 1};

static int setup(void **state) {
  scene *s = calloc(1, sizeof *s);
  s->arena = tw_arena_create();
  for (uint32_t i = 0; i < NODES; i++) {
    s->nodes[i] = (tw_node){.parent = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
    s->order[i] = i;
  }
  s->expressions[0] = (tw_expression){.name = "happy", .bind_count = 1, .binds = &first_bind};
  s->expressions[1] = (tw_expression){.name = "blink", .bind_count = 1, .binds = &second_bind};
  s->face = (tw_face){.expression_count = 2, .expressions = s->expressions};
  s->gaze = TW_NO_INDEX;
  *state = s;
  return 0;
}

static int teardown(void **state) {
  scene *s = *state;
  tw_arena_destroy(s->arena);
  free(s);
  return 0;
}

static tw_track_keys moving(uint32_t node, tw_interpolation interpolation, uint32_t count, const float *times,
                            const float (*values)[3]) {
  return (tw_track_keys){.node = node,
                         .path = TW_TRANSLATION,
                         .interpolation = interpolation,
                         .width = 3,
                         .key_count = count,
                         .times = times,
                         .values = values[0]};
}

static tw_status carry(scene *s, const tw_track_keys *tracks, uint32_t count, uint32_t max_keys) {
  static const tw_expression_node nodes[] = {{"happy", 0}, {"blink", 1}, {"wink", 2}};
  const tw_face_nodes source = {3, nodes, s->gaze};
  static const uint32_t counts[NODES] = {TARGETS};
  static const float rest[TARGETS] = {0.75F, 0.5F};
  static const float *const rests[NODES] = {rest};
  const tw_clip_keys keys = {.track_count = count, .tracks = tracks};
  const tw_face_job job = {.keys = &keys,
                           .source_node_count = NODES,
                           .source = &source,
                           .target = &s->face,
                           .skeleton = {.nodes = s->nodes, .order = s->order, .node_count = NODES},
                           .morph_counts = counts,
                           .rest_weights = rests,
                           .tolerance = {1e-3, 1e-4},
                           .max_keys = max_keys};
  tw_error error = {0};
  return tw_face_carry(&job, s->arena, &s->out, &error);
}

static void assert_near(double value, double expected, double tolerance) {
  if (!(fabs(value - expected) <= tolerance)) fail_msg("%.9g is not %.9g", value, expected);
}

/* The weight of a target at a time, as LINEAR or STEP keys have it. */
static double weight_at(const scene *s, uint32_t target, double time) {
  const tw_track_keys *track = &s->out.keys.tracks[0];
  uint32_t key = 0;
  while (key + 1 < track->key_count && (double)track->times[key + 1] <= time) key++;
  double from = (double)track->values[TARGETS * key + target];
  if (key + 1 == track->key_count || track->interpolation == TW_STEP) return from;
  double u = (time - (double)track->times[key]) / ((double)track->times[key + 1] - (double)track->times[key]);
  return from + u * ((double)track->values[TARGETS * (key + 1) + target] - from);
}

/* Targets that an expression binds count from 0, whatever they rest at; the keys are the union of the
 * source's. */
TEST_WITH(linear_weights_keep_their_keys_exactly, setup, teardown) {
  scene *s = *state;
  static const float times[] = {0, 1, 2}, others[] = {0.5F, 1.5F};
  static const float values[][3] = {{0, 9, 9}, {1, 9, 9}, {0.25F, 9, 9}}, more[][3] = {{0.125F}, {0.625F}};
  const tw_track_keys tracks[] = {moving(0, TW_LINEAR, 3, times, values),
                                  moving(1, TW_LINEAR, 2, others, more)};
  assert_int_equal(carry(s, tracks, 2, 1000), TW_OK);
  assert_int_equal(s->out.keys.track_count, 1);
  const tw_track_keys *track = &s->out.keys.tracks[0];
  static const float expected[][TARGETS] = {
      {0, 0.125F}, {0.25F, 0.125F}, {0.5F, 0.375F}, {0.3125F, 0.625F}, {0.125F, 0.625F}};
  assert_int_equal(track->path, TW_WEIGHTS);
  assert_int_equal(track->key_count, 5);
  assert_memory_equal(track->values, expected, sizeof expected);
}

TEST_WITH(steps_stay_steps, setup, teardown) {
  scene *s = *state;
  static const float times[] = {0, 1}, values[][3] = {{1}, {0.5F}};
  const tw_track_keys track = moving(1, TW_STEP, 2, times, values);
  assert_int_equal(carry(s, &track, 1, 1000), TW_OK);
  assert_int_equal(s->out.keys.tracks[0].interpolation, TW_STEP);
  assert_int_equal(s->out.keys.tracks[0].key_count, 2);
  assert_near(weight_at(s, 1, 0.99), 1, 0);
}

/* blink (1 - happy), both linear: a parabola, followed within the tolerance. */
TEST_WITH(an_expression_holds_another_back_as_it_grows, setup, teardown) {
  scene *s = *state;
  static const float times[] = {0, 1}, values[][3] = {{0}, {1}};
  const tw_track_keys tracks[] = {moving(0, TW_LINEAR, 2, times, values),
                                  moving(1, TW_LINEAR, 2, times, values)};
  s->expressions[0].overrides[TW_FACE_BLINK] = TW_OVERRIDE_BLEND;
  s->expressions[1].overrides[TW_FACE_BLINK] = TW_OVERRIDE_BLOCK; /* not its own part */
  assert_int_equal(carry(s, tracks, 2, 1000), TW_OK);
  for (int i = 0; i <= 100; i++) assert_near(weight_at(s, 1, i * 0.01), i * 0.01 * (1 - i * 0.01), 1.2e-4);
  s->expressions[0].overrides[TW_FACE_BLINK] = TW_OVERRIDE_BLOCK; /* from the first moment on */
  assert_int_equal(carry(s, tracks, 2, 1000), TW_OK);
  for (int i = 1; i <= 100; i++) assert_near(weight_at(s, 1, i * 0.01), 0, 0);
  s->expressions[0].overrides[TW_FACE_BLINK] = TW_OVERRIDE_BLEND;
  assert_int_equal(carry(s, tracks, 2, 2), TW_LIMIT);
}

TEST_WITH(a_binary_expression_is_held_back_wholly, setup, teardown) {
  scene *s = *state;
  static const float times[] = {0, 1}, rises[][3] = {{-1}, {1}}, whole[][3] = {{1}, {1}};
  const tw_track_keys tracks[] = {moving(0, TW_LINEAR, 2, times, rises),
                                  moving(1, TW_LINEAR, 2, times, whole)};
  s->expressions[0].overrides[TW_FACE_BLINK] = TW_OVERRIDE_BLEND;
  s->expressions[1].is_binary = true;
  assert_int_equal(carry(s, tracks, 2, 1000), TW_OK);
  assert_near(weight_at(s, 1, 0.499), 1, 0); /* happy is 0 until 0.5 */
  assert_near(weight_at(s, 1, 0.51), 0, 0);
  assert_near(weight_at(s, 0, 0.75), 0.25, 1e-6);
}

/* A curve of three keys: two cubics whose slopes at the ends and in the middle are given, the second one
 * going down. */
TEST_WITH(a_range_may_be_a_curve, setup, teardown) {
  scene *s = *state;
  static const tw_curve_key keys[] = {{0, 0, 9, 0}, {0.5F, 0.9F, 1, -0.5F}, {0.9F, 0.6F, 0.25F, 9}};
  static const float times[] = {0, 1}, up[][4] = {{0, 0, 0, 1}, {-0.38268343F, 0, 0, 0.92387953F}};
  const tw_track_keys track = {.node = 2,
                               .path = TW_ROTATION,
                               .interpolation = TW_LINEAR,
                               .form = TW_KEY_QUATERNION,
                               .width = 4,
                               .key_count = 2,
                               .times = times,
                               .values = up[0]};
  s->expressions[0].name = "lookUp";
  s->gaze = 2;
  s->face.gaze = TW_GAZE_EXPRESSIONS;
  s->face.up = (tw_gaze_range){40, 2, 3, keys};
  assert_int_equal(carry(s, &track, 1, 1000), TW_OK);
  for (int i = 0; i <= 100; i++) {
    double at = fmin(i * 0.45 / 40, 1), value = 0.6, u, span;
    if (at < 0.5) {
      u = at / 0.5, span = 0.5;
      value = 0.9 * (3 * u * u - 2 * u * u * u) + span * (u * u * u - u * u);
    } else if (at < 0.9) {
      u = (at - 0.5) / 0.4, span = 0.4;
      value = 0.9 - 0.3 * (3 * u * u - 2 * u * u * u) + span * -0.5 * (u * u * u - 2 * u * u + u) +
              span * 0.25 * (u * u * u - u * u);
    }
    assert_near(weight_at(s, 0, i * 0.01), 0.5 * fmin(2 * value, 1), 2e-3);
  }
}

TEST_WITH(expressions_that_the_face_lacks_are_told, setup, teardown) {
  scene *s = *state;
  static const float times[] = {0}, values[][3] = {{1}};
  const tw_track_keys tracks[] = {moving(0, TW_LINEAR, 1, times, values),
                                  moving(2, TW_LINEAR, 1, times, values)};
  s->expressions[0].moves_materials = true;
  s->expressions[1].moves_materials = true; /* which the clip does not move */
  assert_int_equal(carry(s, tracks, 2, 1000), TW_OK);
  assert_int_equal(s->out.missing_count, 1);
  assert_int_equal(s->out.missing[0], 2);
  assert_int_equal(s->out.material_count, 1);
  assert_int_equal(s->out.materials[0], 0);
  assert_false(s->out.has_gaze);
}
