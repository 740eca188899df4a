/* Poses: times, forms, nodes, borrowed clips, refusals, validators, streaming. */
#include "loopback.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Two nodes, one turning by 90 degrees about z in a second and moving by (0, 0, 2). */
static const char arm[] =
    "{'nodes':[{'name':'base'},{'name':'arm','parent':'base','translation':[1,0,0]},{'name':'a,b'},{}],"
    "'clips':[{'name':'turn','tracks':[{'node':'base','path':'rotation','times':[0,1],"
    "'unit':'degrees','axis_angles':[[0,0,1,0],[0,0,1,90]]},{'node':'base','path':'translation',"
    "'times':[0,1],'values':[[0,0,0],[0,0,2]]}]},{'tracks':[]}]}";

static int setup(void **state) {
  api_settings settings = loopback_settings();
  settings.limits.max_times = 100000;
  *state = one_model_start(&settings, arm);
  return 0;
}

static reply ask(const one_model *f, const char *rest) {
  return model_get(f->loop, f->id, rest);
}

static cJSON *ask_json(const one_model *f, const char *rest) {
  return model_get_json(f->loop, f->id, rest);
}

static const cJSON *pose(const cJSON *answer, int index) {
  return cJSON_GetArrayItem(json_member(answer, "poses"), index);
}

/* Row `node` of a part equals the numbers, to single precision. */
static void assert_row(const cJSON *pose, const char *part, int node, size_t count, const double *expected) {
  const cJSON *row = cJSON_GetArrayItem(json_member(pose, part), node);
  assert_int_equal(cJSON_GetArraySize(row), count);
  for (size_t i = 0; i < count; i++) {
    double value = cJSON_GetArrayItem(row, (int)i)->valuedouble;
    if (fabs(value - expected[i]) > 1e-6) fail_msg("%s[%zu] is %g, expected %g", part, i, value, expected[i]);
  }
}

TEST_WITH(bad_parameters_are_400, setup, fixture_stop) {
  const char *const bad[] = {"at=",
                             "at=x",
                             "at=1,,2",
                             "at=1,",
                             "at=nan",
                             "at=inf",
                             "at=1e39",
                             "at=1 ,2",
                             "from=0",
                             "to=1",
                             "from=0&to=1",
                             "fps=0",
                             "fps=-1",
                             "fps=x",
                             "fps=nan",
                             "from=2&fps=1",
                             "from=1&to=0&fps=1",
                             "at=0&fps=1",
                             "space=screen",
                             "as=quaternion",
                             "order=XYZ",
                             "unit=degrees",
                             "as=euler&order=XYX",
                             "as=euler&unit=turns",
                             "loop=bounce",
                             "interpolation=cosine",
                             "skinning=yes",
                             "skinning=true",
                             "as=matrix&unit=degrees",
                             "speed=1",
                             "at=0&at=1",
                             "as=matrix&skinning=true&nodes=arm"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char rest[128];
    snprintf(rest, sizeof rest, "pose?%s", bad[i]);
    reply r = ask(*state, rest);
    if (r.status != 400) fail_msg("%s: %d %s", bad[i], r.status, r.body);
    assert_problem(r, 400, NULL, NULL);
  }
}

TEST_WITH(names_that_are_not_there_are_404, setup, fixture_stop) {
  assert_problem(ask(*state, "pose?clip=dance"), 404, NULL, "turn");
  assert_problem(ask(*state, "pose?nodes=arm,leg"), 404, NULL, "\"leg\"");
  assert_problem(ask(*state, "pose?nodes="), 404, NULL, NULL);
  assert_problem(ask(*state, "pose.xml"), 404, NULL, NULL);
  assert_problem(ask(*state, "pose?clip=00000000000000000000000000000000/turn"), 404, NULL, "no model");
  assert_problem(ask(*state, "pose?as=matrix&skinning=true"), 422, NULL, "skin");
}

TEST_WITH(the_answer_has_the_contracts_shape, setup, fixture_stop) {
  cJSON *answer = ask_json(*state, "pose.json?at=0,0.5,1");
  assert_string_equal(json_member(answer, "clip")->valuestring, "turn");
  assert_true(json_member(answer, "duration")->valuedouble == 1);
  assert_string_equal(json_member(answer, "space")->valuestring, "local");
  assert_string_equal(json_member(answer, "as")->valuestring, "trs");
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "nodes")), 4);
  assert_string_equal(cJSON_GetArrayItem(json_member(answer, "nodes"), 3)->valuestring, "node_3");
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "times")), 3);
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "poses")), 3);
  const cJSON *middle = pose(answer, 1);
  assert_true(json_member(middle, "t")->valuedouble == 0.5);
  const double half = sin(atan(1) / 2); /* 45 degrees turn the half-angle by 22.5 */
  assert_row(middle, "rotation", 0, 4, (double[]){0, 0, half, sqrt(1 - half * half)});
  assert_row(middle, "translation", 0, 3, (double[]){0, 0, 1});
  assert_row(middle, "translation", 1, 3, (double[]){1, 0, 0});
  assert_row(middle, "scale", 3, 3, (double[]){1, 1, 1});
  cJSON_Delete(answer);
}

TEST_WITH(world_space_carries_children, setup, fixture_stop) {
  cJSON *answer = ask_json(*state, "pose?at=1&space=world");
  assert_row(pose(answer, 0), "translation", 1, 3, (double[]){0, 1, 2});
  assert_row(pose(answer, 0), "rotation", 1, 4, (double[]){0, 0, sqrt(0.5), sqrt(0.5)});
  cJSON_Delete(answer);
  answer = ask_json(*state, "pose?at=1&space=world&as=matrix&nodes=arm");
  assert_row(pose(answer, 0), "matrix", 0, 16, (double[]){0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 2, 1});
  assert_int_equal(cJSON_GetArraySize(pose(answer, 0)), 2);
  cJSON_Delete(answer);
}

TEST_WITH(rotations_come_in_the_form_asked_for, setup, fixture_stop) {
  cJSON *answer = ask_json(*state, "pose?at=1&as=euler&order=ZYX&unit=degrees&nodes=base");
  assert_row(pose(answer, 0), "euler", 0, 3, (double[]){0, 0, 90});
  assert_null(cJSON_GetObjectItem(pose(answer, 0), "rotation"));
  json_member(pose(answer, 0), "translation");
  cJSON_Delete(answer);
  answer = ask_json(*state, "pose?at=1&as=axis-angle&nodes=base");
  assert_row(pose(answer, 0), "axis_angle", 0, 4, (double[]){0, 0, 1, 2 * atan(1)});
  cJSON_Delete(answer);
}

TEST_WITH(euler_angles_are_continuous_over_the_times, setup, fixture_stop) {
  one_model *f = *state;
  char id[API_ID_TEXT], rest[128];
  loopback_upload(
      f->loop, "application/json",
      "{'nodes':[{'name':'n'}],'clips':[{'name':'c','tracks':[{'node':'n','path':'rotation','times':[0,1],"
      "'unit':'degrees','axis_angles':[[1,0,0,0],[1,0,0,720]]}]}]}",
      id);
  snprintf(rest, sizeof rest, "/v1/models/%s/pose?as=euler&unit=degrees&from=0&to=1&fps=36", id);
  reply r = loopback_get(f->loop, rest);
  cJSON *answer = cJSON_Parse(r.body);
  for (int i = 0; i <= 36; i++) {
    const cJSON *angles = cJSON_GetArrayItem(json_member(pose(answer, i), "euler"), 0);
    assert_true(fabs(angles->child->valuedouble - 20 * i) < 1e-3);
  }
  cJSON_Delete(answer);
  reply_free(&r);
}

TEST_WITH(nodes_are_chosen_by_name_in_the_files_order, setup, fixture_stop) {
  const char *const lists[] = {"arm,base", "base,arm,base", "arm%2Cbase"};
  for (int i = 0; i < 3; i++) {
    char rest[64];
    snprintf(rest, sizeof rest, "pose?nodes=%s", lists[i]);
    cJSON *answer = ask_json(*state, rest);
    assert_int_equal(cJSON_GetArraySize(json_member(answer, "nodes")), 2);
    assert_string_equal(json_member(answer, "nodes")->child->valuestring, "base");
    cJSON_Delete(answer);
  }
  cJSON *answer = ask_json(*state, "pose?nodes=node_3,a,b,arm");
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "nodes")), 3);
  cJSON_Delete(answer);
}

TEST_WITH(times_may_be_spaced_evenly, setup, fixture_stop) {
  cJSON *answer = ask_json(*state, "pose?from=0.25&to=1&fps=4");
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "times")), 4);
  assert_true(cJSON_GetArrayItem(json_member(answer, "times"), 3)->valuedouble == 1);
  cJSON_Delete(answer);
  answer = ask_json(*state, "pose?fps=10"); /* up to the clip's end, rounding notwithstanding */
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "times")), 11);
  cJSON_Delete(answer);
  answer = ask_json(*state, "pose"); /* no time is 0 */
  assert_true(json_member(answer, "times")->child->valuedouble == 0);
  cJSON_Delete(answer);
}

TEST_WITH(looping_folds_times, setup, fixture_stop) {
  cJSON *answer = ask_json(*state, "pose?at=1.5,2.5&loop=repeat&nodes=base");
  assert_row(pose(answer, 0), "translation", 0, 3, (double[]){0, 0, 1});
  assert_true(json_member(pose(answer, 0), "t")->valuedouble == 1.5);
  cJSON_Delete(answer);
  answer = ask_json(*state, "pose?at=1.75&loop=pingpong&nodes=base");
  assert_row(pose(answer, 0), "translation", 0, 3, (double[]){0, 0, 0.5});
  cJSON_Delete(answer);
}

/* Times that no float holds keep their digits, whatever prints them. */
TEST_WITH(times_print_as_they_were_asked_for, setup, fixture_stop) {
  const char *const requests[][2] = {{"pose?at=100000.003", "'times':[100000.003],'poses':[{'t':100000.003,"},
                                     {"pose?from=1&to=1.5&fps=3", "'times':[1,1.3333333333333333],"},
                                     {"pose.ndjson?at=16777217", "{'t':16777217,"},
                                     {"pose.csv?at=0.30000000000000004", "\n0.30000000000000004,arm,"},
                                     {"pose.bin?at=-100000.003,0.1", "'times':[-100000.003,0.1]}"}};
  for (size_t i = 0; i < sizeof requests / sizeof *requests; i++) {
    reply r = ask(*state, requests[i][0]);
    char head[2048]; /* of a binary answer; more than all of a text */
    size_t prefix = i == 4 ? 12 : 0, size = r.size - prefix < sizeof head ? r.size - prefix : sizeof head - 1;
    memcpy(head, r.body + prefix, size);
    head[size] = '\0';
    for (char *c = head; *c; c++)
      if (*c == '"') *c = '\'';
    if (!strstr(head, requests[i][1])) fail_msg("%s: %s", requests[i][0], head);
    reply_free(&r);
  }
}

TEST_WITH(times_are_looped_before_they_become_floats, setup, fixture_stop) {
  one_model *f = *state;
  char id[API_ID_TEXT], target[128];
  loopback_upload(f->loop, "application/json",
                  "{'nodes':[{'name':'n'}],'clips':[{'tracks':[{'node':'n','path':'translation',"
                  "'times':[0,1.2,3],'values':[[0,0,0],[12,0,0],[30,0,0]]}]},{'tracks':[{'node':'n',"
                  "'path':'translation','times':[0,1.2],'values':[[0,0,0],[12,0,0]]}]}]}",
                  id);
  const struct {
    const char *rest;
    double x;
  } asked[] = {{"at=16777217&loop=repeat", 20},
               {"at=16777217&loop=pingpong", 10},
               {"at=100000.003&loop=repeat", 10.03},
               {"clip=clip_1&at=2.4&loop=repeat", 0}, /* the start of a round, not the end of one */
               {"clip=clip_1&at=120000.6&loop=repeat", 6}};
  for (size_t i = 0; i < sizeof asked / sizeof *asked; i++) {
    snprintf(target, sizeof target, "/v1/models/%s/pose?%s", id, asked[i].rest);
    reply r = loopback_get(f->loop, target);
    cJSON *answer = cJSON_Parse(r.body);
    const cJSON *x = cJSON_GetArrayItem(json_member(pose(answer, 0), "translation"), 0)->child;
    if (fabs(x->valuedouble - asked[i].x) > 1e-4) fail_msg("%s: %g", asked[i].rest, x->valuedouble);
    cJSON_Delete(answer);
    reply_free(&r);
  }
}

TEST_WITH(a_clip_without_a_name_goes_by_its_index, setup, fixture_stop) {
  cJSON *answer = ask_json(*state, "pose?clip=clip_1&at=5");
  assert_string_equal(json_member(answer, "clip")->valuestring, "clip_1");
  assert_true(json_member(answer, "duration")->valuedouble == 0);
  cJSON_Delete(answer);
}

TEST_WITH(a_model_without_clips_rests, setup, fixture_stop) {
  one_model *f = *state;
  reply r = loopback_post(f->loop, "/v1/pose", "application/json", "{'nodes':[{'translation':[1,2,3]}]}");
  assert_int_equal(r.status, 200);
  assert_says(&r, "'clip':null");
  assert_says(&r, "'translation':[[1,2,3]]");
  reply_free(&r);
}

TEST_WITH(a_clip_is_borrowed_by_the_names_of_nodes, setup, fixture_stop) {
  one_model *f = *state;
  char id[API_ID_TEXT], target[160];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'other'},{'name':'base'}]}", id);
  snprintf(target, sizeof target, "/v1/models/%s/pose?at=1&clip=%s/turn", id, f->id);
  reply r = loopback_get(f->loop, target);
  cJSON *answer = cJSON_Parse(r.body);
  assert_row(pose(answer, 0), "translation", 1, 3, (double[]){0, 0, 2});
  assert_null(cJSON_GetObjectItem(answer, "warnings"));
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  cJSON_Delete(answer);
  reply_free(&r);
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'other'}]}", id);
  snprintf(target, sizeof target, "/v1/models/%s/pose?at=1&clip=%s/turn", id, f->id);
  r = loopback_get(f->loop, target);
  assert_int_equal(r.status, 200);
  assert_says(&r, "'warnings':['the clip moves a node that the model does not have: base']");
  assert_string_equal(reply_header(&r, "X-Tweend-Warning"),
                      "1; the%20clip%20moves%20a%20node%20that%20the%20model%20does%20not%20have%3A%20base");
  reply_free(&r);
  /* A borrowed clip is as long as it is. */
  snprintf(target, sizeof target, "/v1/models/%s/pose?fps=1&clip=%s/turn", id, f->id);
  r = loopback_get(f->loop, target);
  assert_says(&r, "'duration':1,");
  assert_says(&r, "'times':[0,1]");
  reply_free(&r);
  /* When the lender is deleted, its clips are gone with it. */
  char path[64];
  snprintf(path, sizeof path, "/v1/models/%s", f->id);
  r = loopback_ask(f->loop, "DELETE", path, NULL, NULL, 0);
  reply_free(&r);
  assert_problem(loopback_get(f->loop, target), 404, NULL, f->id);
}

TEST_WITH(a_clip_of_another_skeleton_is_told_to_need_carrying_over, setup, fixture_stop) {
  one_model *f = *state;
  char id[API_ID_TEXT], target[160];
  loopback_upload(f->loop, "application/json",
                  "{'nodes':[{'name':'x'},{'name':'y'}],'clips':[{'name':'c','tracks':[{'node':'x','path':"
                  "'scale','times':[0],'values':[[1,1,1]]},{'node':'y','path':'scale','times':[0],"
                  "'values':[[1,1,1]]}]}]}",
                  id);
  snprintf(target, sizeof target, "pose?clip=%s/c", id);
  reply r = ask(f, target);
  assert_says(&r, "'warnings':['the model has none of the nodes that the clip moves: retarget=auto carries a "
                  "clip over to another skeleton','the clip moves a node that the model does not have: x',");
  reply_free(&r);
}

TEST_WITH(a_map_means_the_same_in_any_order, setup, fixture_stop) {
  static const char *const maps[] = {"%7B%22a%22:%22x%22,%22b%22:%22y%22,%22c%22:%22z%22%7D",
                                     "%7B%22c%22:%22z%22,%22a%22:%22x%22,%22b%22:%22y%22%7D",
                                     "%7B%22c%22:null,%22a%22:%22x%22,%22b%22:%22y%22%7D"};
  one_model *f = *state;
  char lender[API_ID_TEXT], target[300], tag[128] = "";
  loopback_upload(
      f->loop, "application/json",
      "{'nodes':[{'name':'a'},{'name':'b','parent':'a','translation':[0,1,0]},{'name':'c','parent':"
      "'b','translation':[0,1,0]}],'clips':[{'name':'k','tracks':[{'node':'b','path':'rotation',"
      "'times':[0,1],'quaternions':[[0,0,0,1],[0,0,0.6,0.8]]}]}]}",
      lender);
  loopback_upload(
      f->loop, "application/json",
      "{'nodes':[{'name':'x'},{'name':'y','parent':'x','translation':[0,2,0]},{'name':'z','parent':"
      "'y','translation':[0,2,0]}]}",
      f->id);
  for (int i = 0; i < 3; i++) {
    snprintf(target, sizeof target, "pose?at=1&clip=%s/k&retarget=auto&map=%s", lender, maps[i]);
    reply r = ask(f, target);
    assert_says(&r, "'rotation':[[0,0,0,1],[0,0,0.6,0.8],[0,0,0,1]]");
    assert_int_equal(strcmp(tag, reply_header(&r, "ETag")) == 0, i == 1);
    snprintf(tag, sizeof tag, "%s", reply_header(&r, "ETag"));
    reply_free(&r);
  }
}

/* Uploads two bones and a triangle with morph targets, whose weight a clip moves from 0 to 1 in 2 s. */
static void upload_face(loopback *loop, const char *node, const char *targets, const char *clips,
                        char id[API_ID_TEXT]) {
  char document[1600];
  snprintf(document, sizeof document,
           "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0,2]}],'nodes':[{'name':'hips','children':[1]},"
           "{'name':'head'},{'name':'%s','mesh':0}],"
           "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'targets':[%s]}]}],"
           "'buffers':[{'byteLength':52,'uri':'data:application/octet-stream;base64,"
           "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAEAAAAAAAACAPw=='}],"
           "'bufferViews':[{'buffer':0,'byteLength':36},{'buffer':0,'byteOffset':36,'byteLength':8},"
           "{'buffer':0,'byteOffset':44,'byteLength':8}],'accessors':[{'bufferView':0,'componentType':5126,"
           "'count':3,'type':'VEC3','min':[0,0,0],'max':[1,1,0]},{'bufferView':1,'componentType':5126,"
           "'count':2,'type':'SCALAR','min':[0],'max':[2]},{'bufferView':2,'componentType':5126,'count':2,"
           "'type':'SCALAR'}]%s}",
           node, targets, clips);
  loopback_upload(loop, "model/gltf+json", document, id);
}

TEST_WITH(morph_weights_of_another_model_go_by_names_and_losses_are_told, setup, fixture_stop) {
  static const char clip[] =
      ",'animations':[{'name':'smile','samplers':[{'input':1,'output':2}],'channels':[{"
      "'sampler':0,'target':{'node':2,'path':'weights'}}]}]";
  static const struct {
    const char *node, *targets, *says;
  } cases[] = {
      {"face", "{'POSITION':0}", "'weights':{'face':[0.5]}"},
      {"face", "{'POSITION':0},{'POSITION':0}",
       "'warnings':['the clip moves 1 morph weight of face, which has 2 in the model: left out']"},
      {"mask", "{'POSITION':0}", "'warnings':['the clip moves a node that the model does not have: face']"}};
  one_model *f = *state;
  char lender[API_ID_TEXT], target[200];
  upload_face(f->loop, "face", "{'POSITION':0}", clip, lender);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    static const char *const queries[] = {"", "&retarget=auto"};
    upload_face(f->loop, cases[i].node, cases[i].targets, "", f->id);
    for (int q = 0; q < 2; q++) {
      snprintf(target, sizeof target, "pose?at=1&clip=%s/smile%s", lender, queries[q]);
      reply r = ask(f, target);
      assert_int_equal(r.status, 200);
      assert_says(&r, cases[i].says);
      reply_free(&r);
    }
  }
}

TEST_WITH(clips_that_another_model_lacks_are_told_with_its_id, setup, fixture_stop) {
  static const char hint[] = "a clip of another model is {model id}/{name}, the id in lower case";
  one_model *f = *state;
  char rest[160], word[120];
  snprintf(rest, sizeof rest, "pose?clip=%s/dance", f->id);
  snprintf(word, sizeof word, "no clip of model %s is called \"dance\"; there are: turn", f->id);
  assert_problem(ask(f, rest), 404, NULL, word);
  snprintf(rest, sizeof rest, "pose?clip=%s", f->id);
  assert_problem(ask(f, rest), 404, NULL, hint);
  assert_problem(ask(f, "pose?clip=ABCDEF00000000000000000000000000/turn"), 404, NULL, hint);
}

/* Asserts where the node of a model with one node is at time 1 of a clip. */
static void assert_moved(loopback *loop, const char *id, const char *clip, double x) {
  char rest[160];
  one_model of = {.loop = loop};
  memcpy(of.id, id, sizeof of.id);
  snprintf(rest, sizeof rest, "pose?at=1&clip=%s", clip);
  cJSON *answer = ask_json(&of, rest);
  assert_row(pose(answer, 0), "translation", 0, 3, (double[]){x, 0, 0});
  cJSON_Delete(answer);
}

#define GO_TO(x) "'tracks':[{'node':'n','path':'translation','times':[0,1],'values':[[0,0,0],[" x ",0,0]]}]"

TEST_WITH(layers_name_clips_by_their_place_unless_one_is_called_so, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], other[API_ID_TEXT], text[256];
  loopback_upload(*state, "application/json",
                  "{'nodes':[{'name':'n'}],'clips':[{'name':'go'," GO_TO("1") "},{'name':'go'," GO_TO(
                      "3") "},"
                           "{'name':'second','layers':[{'clip':'clip_1'}]},"
                           "{'name':'both','layers':[{'clip':'clip_0'},{'clip':'clip_1'}]}]}",
                  id);
  assert_moved(*state, id, "second", 3);
  assert_moved(*state, id, "both", 2);
  snprintf(text, sizeof text,
           "{'nodes':[{'name':'n'}],'clips':[{'name':'m','layers':[{'clip':'%s/clip_1'}]}]}", id);
  loopback_upload(*state, "application/json", text, other);
  assert_moved(*state, other, "m", 3);
  loopback_upload(*state, "application/json",
                  "{'nodes':[{'name':'n'}],'clips':[{'name':'clip_1'," GO_TO("5") "},{" GO_TO(
                      "7") "},"
                           "{'name':'m','layers':[{'clip':'clip_1'}]}]}",
                  id);
  assert_moved(*state, id, "m", 5);
  assert_problem(loopback_post(*state, "/v1/models", "application/json",
                               "{'nodes':[{'name':'n'}],'clips':[{'name':'go'," GO_TO(
                                   "1") "},{},{'name':'go',"
                                        "'tracks':[]},{'layers':[{'clip':'go'}]}]}"),
                 422, "/clips/3/layers/0/clip", "clip_0 names the first, clip_2 the second");
  assert_problem(loopback_post(*state, "/v1/models", "application/json",
                               "{'clips':[{'tracks':[]},{'layers':[{'clip':'clip_2'}]}]}"),
                 422, "/clips/1/layers/0/clip", "no clip is called \"clip_2\"");
}

/* The answers differ in nothing else: what is remembered of one must not speak for the other. */
TEST_WITH(carrying_over_what_is_not_borrowed_is_told, setup, fixture_stop) {
  static const struct {
    const char *rest;
    bool is_told;
  } cases[] = {{"tracks?retarget=auto", true},
               {"tracks", false},
               {"pose?clip=turn&retarget=auto&feet=hold", true},
               {"pose?clip=turn&retarget=none", false},
               {"surface.glb?retarget=auto", true},
               {"surface.glb", false},
               {"live?loop=clamp&retarget=auto", true}};
  one_model *f = *state;
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reply r = ask(f, cases[i].rest);
    assert_int_equal(r.status, 200);
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    if ((warning && strstr(warning, "retarget%3Dauto")) != cases[i].is_told) fail_msg("%s", cases[i].rest);
    reply_free(&r);
  }
  char rest[128];
  snprintf(rest, sizeof rest, "pose?clip=%s/turn&retarget=auto", f->id);
  reply r = ask(f, rest);
  assert_int_equal(r.status, 200);
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
}

/* Layers of a clip below the one that is asked for count too; those that go by names do not. */
TEST_WITH(tracks_of_a_mixed_clip_tell_how_its_layers_were_carried_over, loopback_setup, loopback_teardown) {
  char lender[API_ID_TEXT], id[API_ID_TEXT], text[1024];
  loopback_upload(
      *state, "application/json",
      "{'nodes':[{'name':'spine'},{'name':'neck','parent':'spine','translation':[0,1,0]}],'clips':"
      "[{'name':'nod','tracks':[{'node':'neck','path':'rotation','times':[0,1],'quaternions':"
      "[[0,0,0,1],[1,0,0,1]]}]}]}",
      lender);
  snprintf(text, sizeof text,
           "{'nodes':[{'name':'spine'},{'name':'neck','parent':'spine','translation':[0,2,0]}],'clips':["
           "{'name':'own','layers':[{'clip':'%s/nod'},{'clip':'%s/nod','retarget':'auto'}]},"
           "{'name':'both','layers':[{'clip':'own'}]},"
           "{'name':'plain','layers':[{'clip':'%s/nod'}]}]}",
           lender, lender, lender);
  loopback_upload(*state, "application/json", text, id);
  static const char *const names[] = {"own", "both"};
  for (int i = 0; i < 2; i++) {
    snprintf(text, sizeof text, "tracks?clip=%s", names[i]);
    cJSON *answer = model_get_json(*state, id, text);
    const cJSON *layers = json_member(answer, "layers");
    assert_int_equal(cJSON_GetArraySize(layers), 1);
    assert_string_equal(json_member(layers->child, "clip")->valuestring, "own");
    assert_float_equal(json_member(layers->child, "layer")->valuedouble, 1, 0);
    snprintf(text, sizeof text, "%s/nod", lender);
    assert_string_equal(json_member(layers->child, "plays")->valuestring, text);
    const cJSON *retarget = json_member(layers->child, "retarget");
    assert_int_equal(cJSON_GetArraySize(json_member(retarget, "bones")), 2);
    cJSON_Delete(answer);
  }
  cJSON *answer = model_get_json(*state, id, "tracks?clip=plain");
  assert_null(cJSON_GetObjectItem(answer, "layers"));
  cJSON_Delete(answer);
}

/* The hips go over a foot that stands. */
TEST_WITH(a_foot_that_stands_does_so_without_the_root_motion_too, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT];
  loopback_upload(*state, "application/json",
                  "{'nodes':[{'name':'hips','translation':[0,1,0]},{'name':'foot','parent':'hips',"
                  "'translation':[0,-1,0]}],'clips':[{'name':'walk','tracks':[{'node':'hips','path':"
                  "'translation','times':[0,1],'values':[[0,1,0],[1,1,0]]},{'node':'foot','path':"
                  "'translation','times':[0,1],'values':[[0,-1,0],[-1,-1,0]]}]}]}",
                  id);
  static const char *const queries[] = {"tracks", "tracks?root_motion=hips", "tracks?in_place=true"};
  for (int i = 0; i < 3; i++) {
    cJSON *answer = model_get_json(*state, id, queries[i]);
    const cJSON *contacts = json_member(json_member(answer, "report"), "contacts");
    assert_int_equal(cJSON_GetArraySize(contacts), 1);
    assert_float_equal(json_member(contacts->child, "from")->valuedouble, 0, 0);
    assert_float_equal(json_member(contacts->child, "to")->valuedouble, 1, 0);
    assert_float_equal(json_member(contacts->child, "slide")->valuedouble, 0, 1e-3);
    cJSON_Delete(answer);
  }
}

/* A name of 100 characters, six bytes each when encoded. */
TEST_WITH(a_long_warning_is_cut_between_characters, setup, fixture_stop) {
  one_model *f = *state;
  char name[201] = "", text[1200], lender[API_ID_TEXT], target[128];
  for (int i = 0; i < 200; i += 2) memcpy(name + i, "\xC3\xA4", 3);
  snprintf(
      text, sizeof text,
      "{'nodes':[{'name':'%s'},{'name':'%s2'},{'name':'arm'}],'clips':[{'name':'c','tracks':[{'node':'%s',"
      "'path':'scale','times':[0],'values':[[1,1,1]]},{'node':'%s2','path':'scale','times':[0],"
      "'values':[[1,1,1]]},{'node':'arm','path':'scale','times':[0],'values':[[1,1,1]]}]}]}",
      name, name, name, name);
  loopback_upload(f->loop, "application/json", text, lender);
  snprintf(target, sizeof target, "/v1/models/%s/pose?at=1&clip=%s/c", f->id, lender);
  reply r = loopback_get(f->loop, target);
  const char *warning = reply_header(&r, "X-Tweend-Warning"), *end = strstr(warning, "%E2%80%A6");
  assert_memory_equal(warning, "2; the%20clip", 13);
  assert_non_null(end);
  assert_memory_equal(end - 6, "%C3%A4", 6);
  assert_int_equal(end[9], '\0');
  assert_in_range(strlen(warning), 380, 400);
  reply_free(&r);
}

TEST(own_clips_survive_their_model_in_the_cache) {
  api_settings settings = loopback_settings();
  settings.limits.plan_cache = 0; /* nothing stays that nobody holds */
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT], target[96];
  loopback_upload(loop, "application/json", arm, id);
  snprintf(target, sizeof target, "/v1/models/%s/pose?at=1", id);
  for (int i = 0; i < 2; i++) {
    reply r = loopback_get(loop, target);
    assert_int_equal(r.status, 200);
    assert_false(loopback_is_light(loop, target));
    reply_free(&r);
  }
  loopback_stop(loop);
}

/* ---- bodies of times ------------------------------------------------------------------------- */

static reply post_times(const one_model *f, const char *query, const char *body) {
  char target[128];
  snprintf(target, sizeof target, "/v1/models/%s/pose%s", f->id, query);
  return loopback_post(f->loop, target, "application/json", body);
}

TEST_WITH(times_may_come_in_a_body, setup, fixture_stop) {
  reply r = post_times(*state, "?nodes=base", "{'times':[0,0.5,2]}");
  cJSON *answer = cJSON_Parse(r.body);
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "poses")), 3);
  assert_row(pose(answer, 2), "translation", 0, 3, (double[]){0, 0, 2});
  assert_null(reply_header(&r, "ETag"));
  cJSON_Delete(answer);
  reply_free(&r);
  r = post_times(*state, ".csv?nodes=base", "{'times':[0]}");
  assert_string_equal(reply_header(&r, "Content-Type"), "text/csv");
  reply_free(&r);
}

TEST_WITH(bad_bodies_of_times_are_refused_with_their_place, setup, fixture_stop) {
  static const struct {
    const char *body;
    int status;
    const char *pointer;
  } bad[] = {{"{}", 400, ""},
             {"[]", 400, ""},
             {"{'times':[]}", 400, "/times"},
             {"{'times':1}", 400, "/times"},
             {"{'times':[0,'1']}", 400, "/times/1"},
             {"{'times':[0,1e999]}", 422, "/times/1"},
             {"{'times':[0,1e39]}", 422, "/times/1"},
             {"{'times':[0],'at':1}", 400, ""},
             {"{'times':[0]", 400, "/times"},
             {"", 400, NULL}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
    assert_problem(post_times(*state, "", bad[i].body), bad[i].status, bad[i].pointer, NULL);
  assert_problem(post_times(*state, "?at=1", "{'times':[0]}"), 400, NULL, "body");
  assert_problem(post_times(*state, "?fps=1", "{'times':[0]}"), 400, NULL, "body");
  one_model *f = *state;
  char target[96];
  snprintf(target, sizeof target, "/v1/models/%s/pose", f->id);
  reply r = loopback_post(f->loop, target, "model/obj", "{'times':[0]}");
  assert_says(&r, "'supported':['application/json']");
  assert_problem(r, 415, NULL, NULL);
}

TEST_WITH(too_many_times_are_422, setup, fixture_stop) {
  assert_problem(ask(*state, "pose?from=0&to=100000&fps=1"), 422, NULL, "100001 times");
  assert_problem(ask(*state, "pose?from=0&to=1e30&fps=1e30"), 422, NULL, "limit of 100000");
  assert_problem(ask(*state, "pose?fps=100000"), 422, NULL, "limit of 100000");
  api_settings settings = loopback_settings();
  settings.limits.max_times = 3;
  loopback *loop = loopback_start(&settings);
  one_model small = {.loop = loop};
  loopback_upload(loop, "application/json", arm, small.id);
  assert_problem(ask(&small, "pose?at=1,2,3,4"), 422, NULL, "4 times");
  assert_problem(post_times(&small, "", "{'times':[1,2,3,4,5,6,7,8]}"), 422, NULL,
                 "8 times are over the limit of 3");
  assert_problem(post_times(&small, "", "{'times':[0,1,2,3]}"), 422, NULL, "4 times");
  reply r = post_times(&small, "", "{'times':[0,1,2]}");
  assert_int_equal(r.status, 200);
  reply_free(&r);
  loopback_stop(loop);
}

TEST(too_large_an_answer_is_422) {
  api_settings settings = loopback_settings();
  settings.limits.max_output = 1600; /* ten poses of four nodes and ten floats */
  one_model f = {.loop = loopback_start(&settings)};
  loopback_upload(f.loop, "application/json", arm, f.id);
  reply r = ask(&f, "pose.bin?from=0&to=9&fps=1");
  assert_int_equal(r.status, 200);
  reply_free(&r);
  assert_problem(ask(&f, "pose.bin?from=0&to=10&fps=1"), 422, NULL, "11 poses");
  assert_problem(ask(&f, "pose.json?from=0&to=9&fps=1"), 422, NULL, "10 poses");
  loopback_stop(f.loop);
}

TEST(names_in_lines_count) {
  api_settings settings = loopback_settings();
  settings.limits.max_output = 12000; /* ten poses of a name of 1,000 bytes and ten floats */
  one_model f = {.loop = loopback_start(&settings)};
  char text[3000];
  snprintf(text, sizeof text, "{'nodes':[{'name':'%01000d'}]}", 0);
  loopback_upload(f.loop, "application/json", text, f.id);
  reply r = ask(&f, "pose.csv?from=0&to=9&fps=1");
  assert_int_equal(r.status, 200);
  assert_in_range(r.size, 10000, 12000);
  reply_free(&r);
  assert_problem(ask(&f, "pose.csv?from=0&to=10&fps=1"), 422, NULL, "11 poses with 1000 bytes of names");
  r = ask(&f, "pose.json?from=0&to=100&fps=1"); /* which names the nodes once */
  assert_int_equal(r.status, 200);
  reply_free(&r);
  loopback_stop(f.loop);
}

TEST(morph_weights_count) {
  enum { TARGETS = 100 };
  api_settings settings = loopback_settings();
  settings.limits.max_output = 11500; /* ten poses of ten floats, 100 weights and a name */
  one_model f = {.loop = loopback_start(&settings)};
  char text[5000], *end = text;
  end = stpcpy(end, "{'asset':{'version':'2.0'},'accessors':["
                    "{'componentType':5126,'count':3,'type':'VEC3','min':[0,0,0],'max':[0,0,0]},"
                    "{'componentType':5126,'count':1,'type':'SCALAR','min':[0],'max':[0]},"
                    "{'componentType':5126,'count':100,'type':'SCALAR'}],"
                    "'nodes':[{'mesh':0}],'animations':[{'samplers':[{'input':1,'output':2}],"
                    "'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}}]}],"
                    "'meshes':[{'primitives':[{'mode':0,'attributes':{'POSITION':0},'targets':[");
  for (int i = 0; i < TARGETS; i++) end = stpcpy(end, i ? ",{'POSITION':0}" : "{'POSITION':0}");
  strcpy(end, "]}]}]}");
  loopback_upload(f.loop, "model/gltf+json", text, f.id);
  reply r = ask(&f, "pose.json?from=0&to=9&fps=1");
  assert_int_equal(r.status, 200);
  reply_free(&r);
  assert_problem(ask(&f, "pose.json?from=0&to=10&fps=1"), 422, NULL, "11 poses");
  r = ask(&f, "pose.bin?from=0&to=25&fps=1"); /* 26 rows of 440 bytes */
  assert_int_equal(r.status, 200);
  reply_free(&r);
  assert_problem(ask(&f, "pose.bin?from=0&to=26&fps=1"), 422, NULL, "27 poses");
  loopback_stop(f.loop);
}

/* Each pose takes all nodes, however few are asked for. */
TEST(poses_of_large_models_are_slow_to_read_and_too_large_ones_are_422) {
  enum { NODES = 140000, LAYERS = 64, DEPTH = 4 };
  const api_settings settings = loopback_settings();
  one_model f = {.loop = loopback_start(&settings)};
  char *text = malloc(NODES * 3 + LAYERS * 20 * DEPTH + 1000), *end = stpcpy(text, "{'nodes':[{}");
  for (int i = 1; i < NODES; i++) end = stpcpy(end, ",{}");
  end = stpcpy(end, "],'clips':[{'name':'c','tracks':[]},{'name':'m','layers':[{'clip':'c'}]}");
  for (int i = 0; i < DEPTH; i++) {
    end += sprintf(end, ",{'name':'%d','layers':[", i);
    for (int k = 0; k < LAYERS; k++) end = stpcpy(end, k ? ",{'clip':'m'}" : "{'clip':'m'}");
    end = stpcpy(end, "]}");
  }
  end = stpcpy(end, ",{'name':'all','layers':[");
  for (int i = 0; i < DEPTH; i++) end += sprintf(end, "%s{'clip':'%d'}", i ? "," : "", i);
  strcpy(end, "]}]}");
  loopback_upload(f.loop, "application/json", text, f.id);
  free(text);
  reply r = post_times(&f, "?clip=c&nodes=node_7", "{'times':[0,1,2]}");
  assert_int_equal(r.status, 200);
  assert_true(r.answer.body.is_slow);
  reply_free(&r);
  assert_problem(post_times(&f, "?clip=all&nodes=node_7", "{'times':[0]}"), 422, NULL, "transforms");
  assert_problem(ask(&f, "pose.bvh?clip=all&nodes=node_7"), 422, NULL, "transforms");
  loopback_stop(f.loop);
}

TEST(times_of_a_model_without_nodes_count) {
  api_settings settings = loopback_settings();
  settings.limits.max_times = 100000;
  settings.limits.max_output = 500000;
  one_model f = {.loop = loopback_start(&settings)};
  char target[128];
  loopback_upload(f.loop, "model/gltf+json", "{'asset':{'version':'2.0'}}", f.id);
  snprintf(target, sizeof target, "/v1/models/%s/pose?from=0&to=10&fps=1", f.id);
  assert_true(loopback_is_light(f.loop, target));
  snprintf(target, sizeof target, "/v1/models/%s/pose?from=0&to=30000&fps=1", f.id);
  assert_false(loopback_is_light(f.loop, target));
  assert_problem(ask(&f, "pose.json?from=0&to=50000&fps=1"), 422, NULL, "50001 poses");
  loopback_stop(f.loop);
}

/* ---- forms ----------------------------------------------------------------------------------- */

TEST_WITH(lines_are_the_poses_of_the_json, setup, fixture_stop) {
  cJSON *answer = ask_json(*state, "pose.json?from=0&to=1&fps=20");
  reply r = ask(*state, "pose.ndjson?from=0&to=1&fps=20");
  assert_string_equal(reply_header(&r, "Content-Type"), "application/x-ndjson");
  char *line = r.body;
  const cJSON *item;
  cJSON_ArrayForEach(item, json_member(answer, "poses")) {
    char *end = strchr(line, '\n');
    assert_non_null(end);
    *end = '\0';
    cJSON *parsed = cJSON_Parse(line);
    assert_true(cJSON_Compare(parsed, item, true));
    cJSON_Delete(parsed);
    line = end + 1;
  }
  assert_int_equal(*line, '\0');
  cJSON_Delete(answer);
  reply_free(&r);
}

TEST_WITH(csv_has_a_line_a_time_and_node, setup, fixture_stop) {
  reply r = ask(*state, "pose.csv?at=0,1&nodes=base,a,b");
  assert_string_equal(r.body,
                      "t,node,rotation_x,rotation_y,rotation_z,rotation_w,translation_x,translation_y,"
                      "translation_z,scale_x,scale_y,scale_z\r\n"
                      "0,base,0,0,0,1,0,0,0,1,1,1\r\n"
                      "0,\"a,b\",0,0,0,1,0,0,0,1,1,1\r\n"
                      "1,base,0,0,0.70710677,0.70710677,0,0,2,1,1,1\r\n"
                      "1,\"a,b\",0,0,0,1,0,0,0,1,1,1\r\n");
  reply_free(&r);
}

static uint32_t read_u32(const char *bytes) {
  const unsigned char *b = (const unsigned char *)bytes;
  return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static float read_f32(const char *bytes) {
  uint32_t bits = read_u32(bytes);
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

/* Numbers of the binary form equal those of a list. */
static void assert_floats(const char *at, const cJSON *list) {
  for (const cJSON *number = list->child; number; number = number->next, at += 4)
    assert_true(read_f32(at) == (float)number->valuedouble);
}

/* Morph weights of a binary row equal those of the JSON, and each names its node. */
static void compare_weights(const cJSON *header, const cJSON *pose, const char *row) {
  const cJSON *told = cJSON_GetObjectItem(pose, "weights"), *layout = cJSON_GetObjectItem(header, "weights");
  assert_int_equal(cJSON_GetArraySize(told), cJSON_GetArraySize(layout));
  for (const cJSON *part = layout ? layout->child : NULL; part; part = part->next) {
    const cJSON *weights = json_member(told, json_member(part, "name")->valuestring);
    assert_int_equal(cJSON_GetArraySize(weights), json_member(part, "components")->valueint);
    assert_non_null(cJSON_GetArrayItem(json_member(header, "nodes"), json_member(part, "node")->valueint));
    assert_floats(row + json_member(part, "byte_offset")->valueint, weights);
  }
}

/* The root motion of a binary row equals that of the JSON. */
static void compare_root(const cJSON *header, const cJSON *pose, const char *row) {
  const cJSON *told = cJSON_GetObjectItem(pose, "root"), *layout = cJSON_GetObjectItem(header, "root");
  assert_true(!told == !layout);
  for (const cJSON *part = layout ? layout->child : NULL; part; part = part->next)
    assert_floats(row + json_member(part, "byte_offset")->valueint,
                  json_member(told, json_member(part, "name")->valuestring));
}

/* Rows of the binary form equal those of the JSON, number by number. */
static void compare_binary(const one_model *f, const char *query, const char *const *parts) {
  char rest[128];
  snprintf(rest, sizeof rest, "pose.json?%s", query);
  cJSON *answer = ask_json(f, rest);
  snprintf(rest, sizeof rest, "pose.bin?%s", query);
  reply r = ask(f, rest);
  assert_memory_equal(r.body, "TWPB", 4);
  assert_int_equal(read_u32(r.body + 4), 1);
  uint32_t length = read_u32(r.body + 8);
  assert_int_equal(length % 4, 0);
  cJSON *header = cJSON_ParseWithLength(r.body + 12, length);
  assert_true(cJSON_Compare(json_member(header, "times"), json_member(answer, "times"), true));
  assert_true(cJSON_Compare(json_member(header, "nodes"), json_member(answer, "nodes"), true));
  int poses = json_member(header, "poses")->valueint, stride = json_member(header, "stride")->valueint;
  int node_stride = json_member(header, "node_stride")->valueint;
  assert_int_equal(poses, cJSON_GetArraySize(json_member(answer, "poses")));
  assert_int_equal(r.size, 12 + length + (size_t)poses * (size_t)stride * 4);
  const cJSON *layout = json_member(header, "layout")->child;
  for (; *parts; parts++, layout = layout->next) {
    assert_string_equal(json_member(layout, "name")->valuestring, *parts);
    int offset = json_member(layout, "offset")->valueint;
    assert_int_equal(json_member(layout, "byte_offset")->valueint, offset * 4);
    for (int p = 0; p < poses; p++) {
      const cJSON *row = json_member(pose(answer, p), *parts)->child;
      for (int n = 0; row; row = row->next, n++)
        assert_floats(r.body + 12 + length + (p * stride + n * node_stride + offset) * 4, row);
    }
  }
  assert_null(layout);
  for (int p = 0; p < poses; p++) {
    compare_weights(header, pose(answer, p), r.body + 12 + length + p * stride * 4);
    compare_root(header, pose(answer, p), r.body + 12 + length + p * stride * 4);
  }
  cJSON_Delete(header);
  cJSON_Delete(answer);
  reply_free(&r);
}

TEST_WITH(binary_rows_are_those_of_the_json, setup, fixture_stop) {
  compare_binary(*state, "from=0&to=1&fps=7",
                 (const char *const[]){"rotation", "translation", "scale", NULL});
  compare_binary(*state, "at=0.1,3,0.25&as=matrix&space=world", (const char *const[]){"matrix", NULL});
  compare_binary(*state, "at=0.1&as=euler&order=YZX",
                 (const char *const[]){"euler", "translation", "scale", NULL});
  compare_binary(*state, "at=1&as=axis-angle&nodes=arm",
                 (const char *const[]){"axis_angle", "translation", "scale", NULL});
}

TEST_WITH(a_large_answer_is_streamed_and_the_same, setup, fixture_stop) {
  one_model *f = *state;
  reply r = ask(f, "pose.json?from=0&to=1&fps=5000&nodes=base");
  assert_non_null(r.answer.body.read);
  assert_false(r.answer.body.is_slow);
  cJSON *answer = cJSON_Parse(r.body);
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "poses")), 5001);
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "times")), 5001);
  const cJSON *item;
  int i = 0;
  cJSON_ArrayForEach(item, json_member(answer, "poses")) {
    assert_true((float)json_member(item, "t")->valuedouble == (float)(i / 5000.0));
    assert_row(item, "translation", 0, 3, (double[]){0, 0, 2 * i++ / 5000.0});
  }
  cJSON_Delete(answer);
  reply_free(&r);
  r = ask(f, "pose.bin?from=0&to=1&fps=90000");
  assert_true(r.answer.body.size != API_SIZE_UNKNOWN);
  assert_int_equal(r.size, r.answer.body.size);
  reply_free(&r);
}

/* ---- validators ------------------------------------------------------------------------------ */

TEST_WITH(equal_questions_have_one_tag, setup, fixture_stop) {
  static const struct {
    const char *one, *other;
    bool is_same;
  } pairs[] = {{"pose", "pose.json?clip=turn&at=0&as=trs&loop=clamp&space=local", true},
               {"pose?at=0,1", "pose?at=0.0,1e0", true},
               {"pose?nodes=arm,base", "pose?nodes=base,arm", true},
               {"pose?interpolation=linear", "pose?interpolation=slerp", true},
               {"pose", "pose?at=0.5", false},
               {"pose?at=0.5", "pose?at=0.50000006", false},
               {"pose?at=0.5", "pose?at=0.5,0.5", false},
               {"pose?at=0,1", "pose?at=0,1.5", false},
               {"pose?from=0&to=1&fps=2", "pose?from=0&to=1&fps=4", false},
               {"pose", "pose.csv", false},
               {"pose", "pose?nodes=base", false},
               {"pose", "pose?clip=clip_1", false},
               {"pose?as=euler", "pose?as=euler&unit=degrees", false}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
    reply a = ask(*state, pairs[i].one), b = ask(*state, pairs[i].other);
    assert_int_equal(strcmp(reply_header(&a, "ETag"), reply_header(&b, "ETag")) == 0, pairs[i].is_same);
    reply_free(&a);
    reply_free(&b);
  }
}

TEST_WITH(what_is_known_is_answered_lightly, setup, fixture_stop) {
  one_model *f = *state;
  char target[128];
  snprintf(target, sizeof target, "/v1/models/%s/pose?at=0.5", f->id);
  assert_false(loopback_is_light(f->loop, target));
  reply r = loopback_get(f->loop, target);
  char header[128];
  snprintf(header, sizeof header, "If-None-Match: %s\n", reply_header(&r, "ETag"));
  reply_free(&r);
  assert_true(loopback_is_light(f->loop, target));
  r = loopback_ask(f->loop, "GET", target, header, NULL, 0);
  assert_int_equal(r.status, 304);
  reply_free(&r);
  snprintf(target, sizeof target, "/v1/models/%s/pose?from=0&to=1&fps=99999", f->id);
  assert_false(loopback_is_light(f->loop, target));
}

/* 16,384 nodes against 16 names of the last one and of one before it. */
TEST(long_lists_of_names_in_large_models_are_not_searched_lightly) {
  enum { NODES = 1 << 14, NODE_TEXT = 24 };
  api_settings settings = loopback_settings();
  one_model f = {.loop = loopback_start(&settings)};
  char *model = calloc(NODES + 4, NODE_TEXT), target[256];
  size_t length = (size_t)sprintf(model, "{'nodes':[");
  for (int i = 0; i < NODES; i++)
    length += (size_t)sprintf(model + length, "%s{'name':'%d'}", i > 0 ? "," : "", i);
  sprintf(model + length, "]}");
  loopback_upload(f.loop, "application/json", model, f.id);
  free(model);
  size_t base = (size_t)snprintf(target, sizeof target, "/v1/models/%s/pose.csv?nodes=7", f.id);
  for (int i = 0; i < 15; i++) strcat(target, ",16383");
  assert_true(loopback_is_light(f.loop, target));
  strcat(target, ",8");
  assert_false(loopback_is_light(f.loop, target));
  reply r = loopback_get(f.loop, target);
  assert_int_equal(r.status, 200);
  assert_says(&r, "\r\n0,7,0,0,0,1");
  assert_says(&r, "\r\n0,8,0,0,0,1");
  assert_says(&r, "\r\n0,16383,0,0,0,1");
  reply_free(&r);
  target[base] = '\0';
  assert_true(loopback_is_light(f.loop, target));
  loopback_stop(f.loop);
}

/* ---- skins ----------------------------------------------------------------------------------- */

/* Two joints whose inverse bind matrices are the identity, as glTF with its buffer inside. */
static const char skinned[] =
    "{'asset':{'version':'2.0'},'nodes':[{'name':'j0','translation':[1,0,0],'children':[1]},"
    "{'name':'j1','translation':[0,2,0]}],'skins':[{'joints':[1,0]}]}";

TEST_WITH(joint_matrices_are_world_times_inverse_bind, setup, fixture_stop) {
  one_model *f = *state;
  reply r = loopback_post(f->loop, "/v1/pose?as=matrix&skinning=true", "model/gltf+json", skinned);
  if (r.status != 200) fail_msg("%s", r.body);
  cJSON *answer = cJSON_Parse(r.body);
  assert_string_equal(json_member(answer, "nodes")->child->valuestring, "j1");
  assert_row(pose(answer, 0), "matrix", 0, 16, (double[]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 0, 1});
  assert_row(pose(answer, 0), "matrix", 1, 16, (double[]){1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1});
  assert_int_equal(json_member(json_member(answer, "skins")->child, "count")->valueint, 2);
  cJSON_Delete(answer);
  reply_free(&r);
}

/* ---- tracks ---------------------------------------------------------------------------------- */

TEST_WITH(tracks_are_reported, setup, fixture_stop) {
  one_model *f = *state;
  cJSON *answer = ask_json(f, "tracks");
  assert_string_equal(json_member(answer, "clip")->valuestring, "turn");
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "tracks")), 1); /* the rotation alone */
  const cJSON *track = json_member(answer, "tracks")->child;
  assert_string_equal(json_member(track, "node")->valuestring, "base");
  assert_string_equal(json_member(track, "kind")->valuestring, "axis-angle");
  assert_int_equal(json_member(track, "keys")->valueint, 2);
  const cJSON *times = json_member(track, "times");
  assert_int_equal(cJSON_GetArraySize(times), 2);
  assert_true(times->child->valuedouble < times->child->next->valuedouble);
  assert_true(fabs(json_member(track, "total_degrees")->valuedouble - 90) < 1e-3);
  const cJSON *gimbal = json_member(track, "gimbal");
  assert_true(json_member(gimbal, "cos_middle")->valuedouble > 0.999);
  assert_int_equal(cJSON_GetArraySize(json_member(track, "orders")), 6);
  json_member(track, "best_order");
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "other_tracks")), 1);
  const cJSON *other = json_member(answer, "other_tracks")->child;
  assert_string_equal(json_member(other, "node")->valuestring, "base");
  assert_string_equal(json_member(other, "path")->valuestring, "translation");
  assert_string_equal(json_member(other, "interpolation")->valuestring, "linear");
  assert_int_equal(json_member(other, "keys")->valueint, 2);
  assert_true(json_member(other, "times")->child->next->valuedouble == 1);
  assert_false(cJSON_HasObjectItem(other, "kind") || cJSON_HasObjectItem(other, "gimbal"));
  cJSON_Delete(answer);
  assert_problem(ask(f, "tracks?clip=dance"), 404, NULL, "dance");
  assert_problem(ask(f, "tracks?at=1"), 400, NULL, "at");
  reply r = ask(f, "tracks?clip=turn");
  char target[64];
  snprintf(target, sizeof target, "/v1/models/%s/tracks", f->id);
  assert_true(loopback_is_light(f->loop, target));
  reply_free(&r);
}

TEST_WITH(the_clip_is_reported_as_a_whole, setup, fixture_stop) {
  one_model *f = *state;
  cJSON *answer = ask_json(f, "tracks");
  const cJSON *report = json_member(answer, "report"), *loop = json_member(report, "loop");
  assert_true(fabs(json_member(loop, "angle")->valuedouble - 90) < 1e-3);
  assert_true(json_member(loop, "distance")->valuedouble == 2);
  assert_string_equal(json_member(loop, "node")->valuestring, "base");
  const cJSON *root = json_member(report, "root");
  assert_string_equal(json_member(root, "node")->valuestring, "base");
  assert_true(fabs(json_member(root, "distance")->valuedouble - 2) < 1e-5);
  assert_true(fabs(json_member(root, "speed")->valuedouble - 2) < 1e-5);
  assert_int_equal(cJSON_GetArraySize(json_member(report, "noise")), 0);
  assert_int_equal(cJSON_GetArraySize(json_member(report, "pops")), 0);
  int still = cJSON_GetArraySize(json_member(report, "still"));
  assert_int_equal(cJSON_GetArraySize(json_member(report, "feet")), 0);
  assert_int_equal(cJSON_GetArraySize(json_member(report, "warnings")), 1);
  assert_non_null(strstr(json_member(report, "warnings")->child->valuestring, "feet= names them"));
  cJSON_Delete(answer);
  answer = ask_json(f, "tracks?feet=base");
  report = json_member(answer, "report");
  assert_int_equal(cJSON_GetArraySize(json_member(report, "still")), still);
  assert_int_equal(cJSON_GetArraySize(json_member(report, "feet")), 1);
  assert_string_equal(json_member(report, "feet")->child->valuestring, "base");
  assert_int_equal(cJSON_GetArraySize(json_member(report, "warnings")), 1);
  assert_non_null(strstr(json_member(report, "warnings")->child->valuestring, "at one height"));
  cJSON_Delete(answer);
  assert_problem(ask(f, "tracks?feet=bass"), 404, NULL, "did you mean base");
}

TEST_WITH(keys_of_scales_and_morph_weights_are_told, setup, fixture_stop) {
  one_model *f = *state;
  /* A triangle with one morph target, in two nodes of one name: three points, three offsets, times 0 and 2,
   * weights 0 and 1. */
  loopback_upload(
      f->loop, "model/gltf+json",
      "{'asset':{'version':'2.0'},'scenes':[{'nodes':[0]}],'nodes':[{'name':'face','mesh':0},{'name':'ear'},"
      "{'name':'face','mesh':0}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0},'targets':[{'POSITION':0}]}]}],"
      "'buffers':[{'byteLength':68,'uri':'data:application/octet-stream;base64,"
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAEAAAIA/AACAPwAAgD8AAIA/AACAPwAAgD8='}],"
      "'bufferViews':[{'buffer':0,'byteLength':36},{'buffer':0,'byteOffset':36,'byteLength':8},"
      "{'buffer':0,'byteOffset':36,'byteLength':24}],'accessors':[{'bufferView':0,'componentType':5126,"
      "'count':3,'type':'VEC3','min':[0,0,0],'max':[1,1,0]},{'bufferView':1,'componentType':5126,'count':2,"
      "'type':'SCALAR','min':[0],'max':[2]},{'bufferView':2,'componentType':5126,'count':2,'type':'VEC3'}],"
      "'animations':[{'samplers':[{'input':1,'output':1,'interpolation':'STEP'},{'input':1,'output':2}],"
      "'channels':[{'sampler':0,'target':{'node':0,'path':'weights'}},"
      "{'sampler':1,'target':{'node':0,'path':'scale'}},{'sampler':0,'target':{'node':2,'path':'weights'}}]}]"
      "}",
      f->id);
  cJSON *answer = ask_json(f, "tracks");
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "tracks")), 0);
  const cJSON *weights = json_member(answer, "other_tracks")->child;
  assert_string_equal(json_member(weights, "path")->valuestring, "weights");
  assert_string_equal(json_member(weights, "interpolation")->valuestring, "step");
  assert_int_equal(json_member(weights, "keys")->valueint, 2);
  assert_true(json_member(weights, "times")->child->next->valuedouble == 2);
  assert_string_equal(json_member(weights->next, "path")->valuestring, "scale");
  assert_null(weights->next->next->next);
  cJSON_Delete(answer);
  answer = ask_json(f, "pose?at=1,2");
  const cJSON *pose = json_member(answer, "poses")->child;
  assert_true(json_member(json_member(pose, "weights"), "face")->child->valuedouble == 0); /* it steps */
  assert_true(json_member(json_member(pose->next, "weights"), "face")->child->valuedouble == 2);
  assert_true(json_member(json_member(pose->next, "weights"), "node_2")->child->valuedouble == 2);
  cJSON_Delete(answer);
  const char *const parts[] = {"rotation", "translation", "scale", NULL};
  compare_binary(f, "at=2,1", parts);
  compare_binary(f, "at=2&nodes=face&root_motion=face&root_axes=x", parts);
  compare_binary(f, "at=2&nodes=ear", parts);
  reply r = ask(f, "pose.bin?nodes=face");
  assert_non_null(strstr(r.body + 12,
                         "\"weights\":[{\"name\":\"face\",\"node\":0,\"offset\":20,"
                         "\"byte_offset\":80,\"components\":1},{\"name\":\"node_2\",\"node\":1,"));
  reply_free(&r);
  static const struct {
    const char *rest;
    bool is_told;
  } forms[] = {{"pose.bin?at=1", false},  {"pose.csv?at=1", true},     {"pose.bvh?nodes=all", true},
               {"pose.json?at=1", false}, {"pose.ndjson?at=1", false}, {"pose.csv?at=1&nodes=ear", false}};
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    r = ask(f, forms[i].rest);
    assert_int_equal(r.status, 200);
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    assert_int_equal(warning && strstr(warning, "morph%20weights"), forms[i].is_told);
    reply_free(&r);
  }
}

TEST_WITH(a_list_that_is_the_name_of_a_node_means_that_node, setup, fixture_stop) {
  one_model *f = *state;
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'a,b'},{'name':'a'},{'name':'b'}]}", f->id);
  static const struct {
    const char *rest, *nodes;
  } cases[] = {{"pose?nodes=a,b", "['a,b']"},
               {"pose?nodes=b,a", "['a','b']"},
               {"pose?nodes=a", "['a']"},
               {"pose?nodes=a,b,a", "['a','b']"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    cJSON *answer = ask_json(f, cases[i].rest);
    char *nodes = cJSON_PrintUnformatted(json_member(answer, "nodes"));
    for (char *c = nodes; *c; c++)
      if (*c == '"') *c = '\'';
    assert_string_equal(nodes, cases[i].nodes);
    free(nodes);
    cJSON_Delete(answer);
  }
}

TEST_WITH(a_speed_that_fits_no_float_is_a_number_all_the_same, setup, fixture_stop) {
  one_model *f = *state;
  loopback_upload(
      f->loop, "application/json",
      "{'nodes':[{'name':'arm'}],'clips':[{'name':'turn','tracks':[{'node':'arm','path':'rotation',"
      "'times':[0,1e-40],'quaternions':[[0,0,0,1],[0.6,0,0,0.8]]}]}]}",
      f->id);
  cJSON *answer = ask_json(f, "tracks");
  const cJSON *track = json_member(answer, "tracks")->child;
  assert_true(json_member(track, "peak_degrees_per_second")->valuedouble > 3.4e38);
  cJSON_Delete(answer);
}

/* The description that a model's storing answers with. */
static void assert_warning(const one_model *f, const char *track, const char *warning) {
  char body[512];
  snprintf(body, sizeof body,
           "{'nodes':[{'name':'arm'}],'clips':[{'name':'wave','tracks':[{'node':'arm',"
           "'path':'rotation',%s'times':[0,1,2],%s}]}]}",
           strstr(track, "quaternions") ? "" : "'unit':'degrees',", track);
  reply r = loopback_post(f->loop, "/v1/models", "application/json", body);
  cJSON *answer = cJSON_Parse(r.body);
  const cJSON *warnings = json_member(answer, "warnings");
  assert_int_equal(cJSON_GetArraySize(warnings), warning ? 1 : 0);
  if (warning) assert_non_null(strstr(warnings->child->valuestring, warning));
  if (warning) assert_non_null(strstr(warnings->child->valuestring, ": clip \"wave\", node \"arm\""));
  cJSON_Delete(answer);
  reply_free(&r);
}

/* Angles turn as far as they say, so nothing is lost; only a half turn between quaternions has no way. */
TEST_WITH(half_turns_without_a_way_are_warned_of_when_they_are_stored, setup, fixture_stop) {
  assert_warning(*state, "'eulers':[[0,0,0],[0,170,0],[0,300,0]]", NULL);
  assert_warning(*state, "'eulers':[[0,0,0],[0,180,0],[0,360,0]]", "2 steps of exactly 180 degrees");
  assert_warning(*state, "'interpolation':'step','eulers':[[0,0,0],[0,180,0],[0,0,0]]", NULL);
  assert_warning(*state, "'interpolation':'euler','eulers':[[-170,0,0],[170,0,0],[171,0,0]]", NULL);
  assert_warning(*state, "'axis_angles':[[0,0,1,0],[0,0,1,180],[0,0,1,900]]", NULL);
  assert_warning(*state, "'quaternions':[[0,0,0,1],[1,0,0,0],[1,0,0,0]]", "1 step of exactly 180 degrees");
}
