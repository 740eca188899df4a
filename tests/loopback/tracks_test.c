/* What is told of the tracks of a clip, and of the clip as a whole. */
#include "arm.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
