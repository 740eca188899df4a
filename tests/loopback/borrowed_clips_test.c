/* Clips of other models and mixed ones: found, put on nodes, carried over; what is told of that. */
#include "arm.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

/* A clip that moves two nodes called a to x = 1 and x = 2. */
static const char namesakes[] =
    "{'asset':{'version':'2.0'},'nodes':[{'name':'top','children':[1,2]},{'name':'a'},{'name':'a'}],"
    "'scene':0,'scenes':[{'nodes':[0]}],'buffers':[{'byteLength':28,'uri':"
    "'data:application/"
    "octet-stream;base64,AAAAAAAAgD8AAAAAAAAAAAAAAEAAAAAAAAAAAA=='}],'bufferViews':[{'buffer':0,'byteLength':"
    "28}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':1,'type':'SCALAR','min':[0],'max':[0]},"
    "{'bufferView':0,'byteOffset':4,'componentType':5126,'count':1,'type':'VEC3'},"
    "{'bufferView':0,'byteOffset':16,'componentType':5126,'count':1,'type':'VEC3'}],"
    "'animations':[{'name':'c','samplers':[{'input':0,'output':1},{'input':0,'output':2}],'channels':["
    "{'sampler':0,'target':{'node':1,'path':'translation'}},"
    "{'sampler':1,'target':{'node':2,'path':'translation'}}]}]}";

TEST_WITH(nodes_of_one_name_are_those_at_the_same_places, setup, fixture_stop) {
  static const struct {
    const char *nodes, *translations;
    bool is_told;
  } models[] = {
      {"{'name':'a'},{'name':'b'},{'name':'a'},{'name':'a'}", "[[1,0,0],[0,0,0],[2,0,0],[0,0,0]]", false},
      {"{'name':'b'},{'name':'a'}", "[[0,0,0],[1,0,0]]", true}};
  one_model *f = *state;
  char lender[API_ID_TEXT], mixer[API_ID_TEXT], text[400], target[160], translation[80];
  loopback_upload(f->loop, "model/gltf+json", namesakes, lender);
  for (size_t i = 0; i < 2; i++) {
    snprintf(text, sizeof text, "{'nodes':[%s],'clips':[{'name':'m','layers':[{'clip':'%s/c'}]}]}",
             models[i].nodes, lender);
    loopback_upload(f->loop, "application/json", text, mixer);
    snprintf(translation, sizeof translation, "'translation':%s", models[i].translations);
    for (int is_mixed = 0; is_mixed < 2; is_mixed++) {
      snprintf(target, sizeof target, "/v1/models/%s/pose?clip=%s%s", mixer, is_mixed ? "" : lender,
               is_mixed ? "m" : "/c");
      reply r = loopback_get(f->loop, target);
      assert_int_equal(r.status, 200);
      assert_says(&r, translation);
      assert_int_equal(reply_header(&r, "X-Tweend-Warning") != NULL, models[i].is_told);
      if (models[i].is_told)
        assert_says(&r, "'warnings':['the clip moves more nodes of one name than the model has: a']");
      reply_free(&r);
    }
  }
  snprintf(target, sizeof target, "/v1/models/%s/pose?clip=%s/c", lender, lender);
  reply r = loopback_get(f->loop, target);
  assert_says(&r, "'translation':[[0,0,0],[1,0,0],[2,0,0]]");
  reply_free(&r);
}

/* Of a clip of 2 s the model has the node alone whose track ends after 1 s. */
TEST_WITH(a_borrowed_clip_lasts_as_long_whatever_of_it_is_left, setup, fixture_stop) {
  static const char *const keys[] = {
      "'interpolation':'step','values':[[0,0,0],[1,0,0]]",
      "'interpolation':'cubicspline','values':[[0,0,0],[1,0,0]],'in_tangents':[[0,0,0],[5,0,0]],"
      "'out_tangents':[[0,0,0],[5,0,0]]"};
  one_model *f = *state;
  char model[API_ID_TEXT], lender[API_ID_TEXT], text[500], target[160];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'a'}]}", model);
  for (size_t i = 0; i < 2; i++) {
    snprintf(text, sizeof text,
             "{'nodes':[{'name':'a'},{'name':'b'}],'clips':[{'name':'c','tracks':[{'node':'a','path':"
             "'translation','times':[0,1],%s},{'node':'b','path':'scale','times':[2],'values':[[1,1,1]]}]}]}",
             keys[i]);
    loopback_upload(f->loop, "application/json", text, lender);
    snprintf(target, sizeof target, "/v1/models/%s/pose?clip=%s/c&at=1,1.5,2", model, lender);
    reply r = loopback_get(f->loop, target);
    assert_says(&r, "'duration':2,");
    cJSON *answer = cJSON_Parse(r.body);
    for (int k = 0; k < 3; k++) assert_row(pose(answer, k), "translation", 0, 3, (double[]){1, 0, 0});
    cJSON_Delete(answer);
    reply_free(&r);
    snprintf(target, sizeof target, "/v1/models/%s/surface.gltf?clip=%s/c", model, lender);
    r = loopback_get(f->loop, target);
    assert_says(&r, "'max':[2]");
    reply_free(&r);
  }
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
