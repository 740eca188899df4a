/* What surfaces show of a clip: keys at given times, fewest keys, the animation alone, meshes moved by skins.
 */
#include "flag.h"
#include "loopback.h"
#include "tweend/anim.h"
#include "tweend/subdiv.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Keys of every kind: eleven of a slerp on one great circle, Euler angles, a step, and a straight way. */
static const char keyed[] =
    "{'nodes':[{'name':'a'},{'name':'b'},{'name':'c'},{'name':'d'}],"
    "'clips':[{'name':'all','tracks':[{'node':'a','path':'rotation',"
    "'times':[0,0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8,0.9,1],'unit':'degrees','interpolation':'slerp',"
    "'eulers':[[0,0,0],[0,0,9],[0,0,18],[0,0,27],[0,0,36],[0,0,45],[0,0,54],[0,0,63],[0,0,72],[0,0,81],"
    "[0,0,90]]},{'node':'b','path':'rotation','times':[0,1],'unit':'degrees','interpolation':'euler',"
    "'eulers':[[-170,0,0],[170,80,30]]},{'node':'c','path':'rotation','times':[0,0.5,1],"
    "'interpolation':'step','quaternions':[[0,0,0,1],[0,0,1,0],[0,1,0,0]]},"
    "{'node':'d','path':'translation','times':[0,0.5,1],'values':[[0,0,0],[1,0,0],[2,0,0]]}]}]}";

#define MOVE(node, time, value)                                                                              \
  "{'node':'" node "','path':'translation','times':[0," time "],'values':[[0,0,0]," value "]}"

/* "walk" and the nameless clip move the same node. */
static const char several[] = "{'nodes':[{'name':'a'},{'name':'b'}],'clips':[{'name':'walk','tracks':[" MOVE(
    "a", "2",
    "[2,0,0]") "]},{'name':'wave','tracks':[" MOVE("b", "1",
                                                   "[0,1,0]") "]},{'tracks':[" MOVE("a", "1",
                                                                                    "[0,0,4]") "]}]}";

/* Names that look like lists. */
static const char odd[] = "{'nodes':[{'name':'a'},{'name':'b'}],'clips':[{'name':'walk','tracks':[" MOVE(
    "a", "1",
    "[1,0,0]") "]},{'name':'none','tracks':[" MOVE("a", "1",
                                                   "[2,0,0]") "]},{'name':'walk,none','tracks':"
                                                              "[" MOVE("a", "1",
                                                                       "[3,0,0]") "]},{'name':'hop,"
                                                                                  "skip','tracks':"
                                                                                  "[" MOVE("b", "1",
                                                                                           "[4,0,"
                                                                                           "0]") "]"
                                                                                                 "}"
                                                                                                 "]"
                                                                                                 "}";

static int reductions;
static int compiled;    /* clips */
static int meshes_read; /* to count or to make a surface: both build a topology */

/* Linked with --wrap, which gives these names.
 * NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
tw_status __real_tw_surface_create_by(const tw_mesh *mesh, const tw_surface_options *options,
                                      const tw_parallel_for *parallel, tw_surface **out, tw_error *error);
tw_status __real_tw_surface_count(const tw_mesh *mesh, const tw_surface_options *options,
                                  tw_surface_counts *out, tw_error *error);
tw_status __wrap_tw_surface_create_by(const tw_mesh *mesh, const tw_surface_options *options,
                                      const tw_parallel_for *parallel, tw_surface **out, tw_error *error);
tw_status __wrap_tw_surface_count(const tw_mesh *mesh, const tw_surface_options *options,
                                  tw_surface_counts *out, tw_error *error);
tw_status __real_tw_clip_reduce(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                                uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                                tw_tolerance *reached, tw_error *error);
tw_status __wrap_tw_clip_reduce(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                                uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                                tw_tolerance *reached, tw_error *error);
tw_status __real_tw_clip_express(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                                 uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                                 tw_tolerance *reached, tw_error *error);
tw_status __wrap_tw_clip_express(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                                 uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                                 tw_tolerance *reached, tw_error *error);
tw_status __real_tw_clip_create(const tw_clip_keys *keys, uint32_t node_count, int force, tw_clip **out,
                                tw_error *error);
tw_status __wrap_tw_clip_create(const tw_clip_keys *keys, uint32_t node_count, int force, tw_clip **out,
                                tw_error *error);

tw_status __wrap_tw_clip_create(const tw_clip_keys *keys, uint32_t node_count, int force, tw_clip **out,
                                tw_error *error) {
  compiled++;
  return __real_tw_clip_create(keys, node_count, force, out, error);
}

tw_status __wrap_tw_clip_reduce(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                                uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                                tw_tolerance *reached, tw_error *error) {
  reductions++;
  return __real_tw_clip_reduce(clip, keys, tolerance, max_keys, steps, arena, out, reached, error);
}

tw_status __wrap_tw_clip_express(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                                 uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                                 tw_tolerance *reached, tw_error *error) {
  reductions++;
  return __real_tw_clip_express(clip, keys, tolerance, max_keys, steps, arena, out, reached, error);
}

tw_status __wrap_tw_surface_create_by(const tw_mesh *mesh, const tw_surface_options *options,
                                      const tw_parallel_for *parallel, tw_surface **out, tw_error *error) {
  meshes_read++;
  return __real_tw_surface_create_by(mesh, options, parallel, out, error);
}

tw_status __wrap_tw_surface_count(const tw_mesh *mesh, const tw_surface_options *options,
                                  tw_surface_counts *out, tw_error *error) {
  meshes_read++;
  return __real_tw_surface_count(mesh, options, out, error);
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

typedef struct fixture {
  loopback *loop;
  char flag[API_ID_TEXT], keyed[API_ID_TEXT], several[API_ID_TEXT], odd[API_ID_TEXT];
} fixture;

static int setup(void **state) {
  fixture *f = calloc(1, sizeof *f);
  api_settings settings = loopback_settings();
  f->loop = loopback_start(&settings);
  loopback_upload(f->loop, "model/gltf+json", flag, f->flag);
  loopback_upload(f->loop, "application/json", keyed, f->keyed);
  loopback_upload(f->loop, "application/json", several, f->several);
  loopback_upload(f->loop, "application/json", odd, f->odd);
  *state = f;
  return 0;
}

static const cJSON *sampler(const cJSON *document, int track) {
  return cJSON_GetArrayItem(
      json_member(cJSON_GetArrayItem(json_member(document, "animations"), 0), "samplers"), track);
}

static int key_count(const cJSON *document, int track) {
  int input = json_member(sampler(document, track), "input")->valueint;
  return json_member(cJSON_GetArrayItem(json_member(document, "accessors"), input), "count")->valueint;
}

static void assert_kind(const cJSON *document, int track, const char *kind) {
  const cJSON *said = cJSON_GetObjectItem(sampler(document, track), "interpolation");
  assert_string_equal(said ? said->valuestring : "LINEAR", kind);
}

/* X-Tweend-Error of an answer. */
static void read_error(const fixture *f, const char *rest, double *degrees, double *metres) {
  reply r = model_get(f->loop, f->keyed, rest);
  const char *text = reply_header(&r, "X-Tweend-Error");
  assert_non_null(text);
  assert_int_equal(sscanf(text, "degrees=%lf, metres=%lf", degrees, metres), 2);
  reply_free(&r);
}

/* The n-th "v x y z" line of an OBJ answer. */
static void assert_point(const reply *r, int n, double x, double y, double z) {
  const char *line = r->body;
  for (int i = -1;; line++) {
    line = strstr(line, "v ");
    assert_non_null(line);
    if ((line == r->body || line[-1] == '\n') && ++i == n) break;
  }
  double found[3];
  assert_int_equal(sscanf(line, "v %lf %lf %lf", &found[0], &found[1], &found[2]), 3);
  if (fabs(found[0] - x) + fabs(found[1] - y) + fabs(found[2] - z) > 1e-5)
    fail_msg("point %d is at %g %g %g", n, found[0], found[1], found[2]);
}

TEST_WITH(parameters_that_do_not_fit_are_400, setup, fixture_stop) {
  const fixture *f = *state;
  const char *const bad[] = {
      "skin=bake",        "skin=bake&clip=wave",   "skin=bake&at=0,1",          "skin=bake&at=1&meshes=none",
      "meshes=some",      "clip=none&at=1",        "clip=none&fps=2",           "clip=wave,wave",
      "at=1&tolerance=1", "clip=wave&tolerance=0", "clip=wave&tolerance=181",   "clip=wave&tolerance_m=0",
      "influences=5",     "influences=8",          "clip=wave&tolerance_m=nan", "clip=wave&at=1&tolerance=1"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char rest[128];
    snprintf(rest, sizeof rest, "surface.glb?%s", bad[i]);
    reply r = model_get(f->loop, f->flag, rest);
    if (r.status != 400) fail_msg("%s: %d %s", bad[i], r.status, r.body);
    assert_problem(r, 400, NULL, NULL);
  }
}

/* ---- which clips ----------------------------------------------------------------------------- */

/* The names of the answer's animations, each with a bar behind it. */
static void assert_animations(const fixture *f, const char *id, const char *rest, const char *wanted) {
  char names[128] = "";
  cJSON *document = model_get_json(f->loop, id, rest);
  const cJSON *animation;
  cJSON_ArrayForEach(animation, cJSON_GetObjectItem(document, "animations")) {
    const cJSON *name = cJSON_GetObjectItem(animation, "name");
    size_t length = strlen(names);
    snprintf(names + length, sizeof names - length, "%s|", name ? name->valuestring : "");
  }
  assert_string_equal(names, wanted);
  cJSON_Delete(document);
}

TEST_WITH(clips_are_kept_as_the_parameter_says, setup, fixture_stop) {
  const fixture *f = *state;
  static const struct {
    bool is_odd;
    const char *rest, *names;
  } cases[] = {
      {false, "surface.gltf", "walk|wave||"},
      {false, "surface.gltf?clip=none", ""},
      {false, "surface.gltf?clip=wave", "wave|"},
      {false, "surface.gltf?clip=wave,walk", "wave|walk|"},
      {false, "surface.gltf?clip=clip_2,wave", "|wave|"},
      {false, "surface.gltf?clip=walk,wave&fps=2", "walk,wave|"},
      {false, "surface.gltf?fps=2", "walk|"},
      {false, "surface.gltf?at=0,1", "walk|"},
      {false, "surface.gltf?at=1", ""},
      {false, "surface.gltf?clip=walk,wave&at=1", ""},
      {false, "surface.gltf?meshes=none", "walk|wave||"},
      {true, "surface.gltf", "walk|none|walk,none|hop,skip|"},
      {true, "surface.gltf?clip=none", "none|"},
      {true, "surface.gltf?clip=walk,none", "walk,none|"},
      {true, "surface.gltf?clip=none,walk", "none|walk|"},
      {true, "surface.gltf?clip=hop,skip", "hop,skip|"},
      {true, "surface.gltf?clip=hop,skip,none", "hop,skip|none|"},
      {true, "surface.gltf?clip=walk,hop,skip", "walk|hop,skip|"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_animations(f, cases[i].is_odd ? f->odd : f->several, cases[i].rest, cases[i].names);
  char rest[128];
  snprintf(rest, sizeof rest, "surface.gltf?clip=none,%s/wave,walk", f->several);
  assert_animations(f, f->odd, rest, "none|wave|walk|");
}

TEST_WITH(a_model_without_clips_keeps_none, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'bone'}]}", id);
  assert_animations(f, id, "surface.gltf", "");
  assert_animations(f, id, "surface.gltf?clip=none&tolerance=1", "");
  assert_problem(model_get(f->loop, id, "surface.gltf?clip=walk"), 404, NULL, "the model has no clips");
  assert_problem(model_get(f->loop, id, "surface.gltf?at=1"), 404, NULL, "the model has no clips");
}

TEST_WITH(a_name_of_a_list_that_is_none_is_told, setup, fixture_stop) {
  const fixture *f = *state;
  assert_problem(model_get(f->loop, f->several, "surface.gltf?clip=walk,run,wave"), 404, NULL,
                 "no clip is called \"run\"; there are: walk, wave");
  assert_problem(model_get(f->loop, f->several, "surface.gltf?clip=walk,"), 404, NULL,
                 "no clip is called \"\"");
  assert_problem(model_get(f->loop, f->several, "surface.gltf?clip=walk,none"), 404, NULL, "\"none\"");
  assert_problem(model_get(f->loop, f->several, "surface.gltf?clip=walk,wave,walk"), 400, NULL,
                 "\"walk\" is in the list");
  char rest[2048] = "surface.gltf?clip=";
  for (size_t length = strlen(rest); length < sizeof rest - 2; length += 2) memcpy(rest + length, "x,", 3);
  assert_problem(model_get(f->loop, f->several, rest), 400, NULL, "more than 256");
}

/* half turns half round, which is worth a warning. */
TEST_WITH(warnings_of_clips_are_those_of_the_clips_in_the_answer, loopback_setup, loopback_teardown) {
  static const struct {
    const char *rest;
    bool is_told;
  } cases[] = {{"surface.glb", true},
               {"surface.glb?clip=calm", false},
               {"surface.glb?clip=half", true},
               {"surface.glb?clip=calm,half", true},
               {"surface.glb?clip=none", false},
               {"surface.glb?clip=mixed", true},
               {"surface.glb?clip=both", true},
               {"surface.glb?clip=still", false},
               {"surface.glb?at=0", false},
               {"surface.glb?at=0&clip=half", true}};
  char id[API_ID_TEXT];
  loopback_upload(*state, "application/json",
                  "{'nodes':[{'name':'a'}],'clips':[{'name':'calm','tracks':[{'node':'a','path':'rotation',"
                  "'times':[0,1],'quaternions':[[0,0,0,1],[1,0,0,1]]}]},{'name':'half','tracks':[{'node':'a',"
                  "'path':'rotation','times':[0,1],'quaternions':[[0,0,0,1],[1,0,0,0]]}]},"
                  "{'name':'mixed','layers':[{'clip':'half'}]},{'name':'both','layers':[{'clip':'mixed'}]},"
                  "{'name':'still','layers':[{'clip':'calm'}]}]}",
                  id);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reply r = model_get_ok(*state, id, cases[i].rest);
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    bool is_told = warning && strstr(warning, "exactly%20180%20degrees");
    if (is_told != cases[i].is_told) fail_msg("%s: %s", cases[i].rest, warning ? warning : "nothing");
    reply_free(&r);
  }
}

TEST_WITH(equal_choices_of_clips_have_one_tag, setup, fixture_stop) {
  const fixture *f = *state;
  static const struct {
    const char *a, *b;
    bool is_same;
  } pairs[] = {{"surface.glb", "surface.glb?clip=walk,wave,clip_2", true},
               {"surface.glb?at=1", "surface.glb?at=1.0&clip=walk", true},
               {"surface.glb", "surface.glb?clip=none", false},
               {"surface.glb", "surface.glb?clip=walk,wave", false},
               {"surface.glb?clip=walk,wave", "surface.glb?clip=wave,walk", false},
               {"surface.glb?clip=walk", "surface.glb?at=1", false},
               {"pose?at=1", "pose?clip=walk&at=1", true},
               {"pose?clip=walk,wave&at=1", "pose?clip=wave,walk&at=1", false},
               {"pose?clip=none&at=1", "pose?at=1", false}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
    reply a = model_get(f->loop, f->several, pairs[i].a), b = model_get(f->loop, f->several, pairs[i].b);
    assert_int_equal(a.status, 200);
    assert_int_equal(b.status, 200);
    bool is_same = strcmp(reply_header(&a, "ETag"), reply_header(&b, "ETag")) == 0;
    if (is_same != pairs[i].is_same) fail_msg("%s and %s", pairs[i].a, pairs[i].b);
    if (is_same) {
      assert_int_equal(a.size, b.size);
      assert_memory_equal(a.body, b.body, a.size);
    }
    reply_free(&a);
    reply_free(&b);
  }
}

static double number_at(const cJSON *array, int index) {
  return cJSON_GetArrayItem(array, index)->valuedouble;
}

TEST_WITH(clips_move_together_and_later_ones_win, setup, fixture_stop) {
  const fixture *f = *state;
  static const struct {
    const char *clips;
    double a[3], b, duration;
  } cases[] = {{"walk,wave", {1, 0, 0}, 1, 2},
               {"wave,walk", {1, 0, 0}, 1, 2},
               {"walk,clip_2", {0, 0, 4}, 0, 1},
               {"clip_2,wave,walk", {1, 0, 0}, 1, 2}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char rest[64];
    snprintf(rest, sizeof rest, "surface.gltf?clip=%s&at=1", cases[i].clips);
    cJSON *document = model_get_json(f->loop, f->several, rest);
    const cJSON *nodes = json_member(document, "nodes");
    const cJSON *moved = json_member(cJSON_GetArrayItem(nodes, 0), "translation");
    for (int j = 0; j < 3; j++) assert_true(number_at(moved, j) == cases[i].a[j]);
    const cJSON *other = cJSON_GetObjectItem(cJSON_GetArrayItem(nodes, 1), "translation");
    assert_true(cases[i].b == (cases[i].b > 0 ? number_at(other, 1) : 0));
    cJSON_Delete(document);
    snprintf(rest, sizeof rest, "pose.json?clip=%s&at=1", cases[i].clips);
    document = model_get_json(f->loop, f->several, rest);
    assert_string_equal(json_member(document, "clip")->valuestring, cases[i].clips);
    assert_true(json_member(document, "duration")->valuedouble == cases[i].duration);
    const cJSON *pose = cJSON_GetArrayItem(json_member(document, "poses"), 0);
    moved = json_member(pose, "translation");
    for (int j = 0; j < 3; j++) assert_true(number_at(cJSON_GetArrayItem(moved, 0), j) == cases[i].a[j]);
    assert_true(number_at(cJSON_GetArrayItem(moved, 1), 1) == cases[i].b);
    cJSON_Delete(document);
  }
}

TEST_WITH(clips_are_baked_into_one, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *document = model_get_json(f->loop, f->several, "surface.gltf?clip=walk,wave&fps=4");
  assert_int_equal(key_count(document, 0), 9); /* up to the end of the longest */
  assert_int_equal(key_count(document, 1), 9);
  cJSON_Delete(document);
}

TEST_WITH(every_kept_clip_is_reduced, setup, fixture_stop) {
  const fixture *f = *state;
  char rest[128];
  snprintf(rest, sizeof rest, "surface.gltf?clip=%s/all,walk&tolerance=0.05&tolerance_m=0.01", f->keyed);
  cJSON *document = model_get_json(f->loop, f->several, rest);
  assert_int_equal(key_count(document, 0), 2); /* eleven before */
  cJSON_Delete(document);
  assert_int_equal(
      key_count(document = model_get_json(f->loop, f->keyed, "surface.gltf?tolerance=0.05&tolerance_m=1"), 3),
      2);
  cJSON_Delete(document);
  reply r = model_get(f->loop, f->several, "surface.gltf");
  assert_null(reply_header(&r, "X-Tweend-Error")); /* all keys are as they were */
  reply_free(&r);
}

TEST_WITH(none_is_the_rest_pose, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *document = model_get_json(f->loop, f->several, "pose.json?clip=none&at=1");
  assert_true(cJSON_IsNull(json_member(document, "clip")));
  const cJSON *pose = cJSON_GetArrayItem(json_member(document, "poses"), 0);
  assert_true(number_at(cJSON_GetArrayItem(json_member(pose, "translation"), 0), 0) == 0);
  cJSON_Delete(document);
}

/* Keys that glTF has as they are go from the file to the answer. */
TEST_WITH(a_thousand_clips_are_kept_without_compiling_any, setup, fixture_stop) {
  const fixture *f = *state;
  enum { CLIPS = 1000 };
  static const char clip[] =
      "{'name':'c%d','tracks':[{'node':'a','path':'rotation','times':[0,1],'quaternions':[[0,0,0,1],"
      "[0,0.6,0,0.8]]}," MOVE("a", "1", "[1,0,0]") "]}%s";
  char *text = malloc((sizeof clip + 16) * CLIPS);
  size_t size = (size_t)sprintf(text, "{'nodes':[{'name':'a'}],'clips':[");
  for (int i = 0; i < CLIPS; i++) size += (size_t)sprintf(text + size, clip, i, i + 1 < CLIPS ? "," : "]}");
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "application/json", text, id);
  free(text);
  compiled = 0;
  cJSON *document = model_get_json(f->loop, id, "surface.gltf");
  assert_int_equal(cJSON_GetArraySize(json_member(document, "animations")), CLIPS);
  assert_int_equal(compiled, 0);
  cJSON_Delete(document);
}

TEST_WITH(times_that_fall_or_are_negative_cannot_be_baked, setup, fixture_stop) {
  const fixture *f = *state;
  assert_problem(model_get(f->loop, f->keyed, "surface.glb?at=1,0.5"), 422, NULL, NULL);
  assert_problem(model_get(f->loop, f->keyed, "surface.glb?at=-1,0.5"), 422, NULL, NULL);
}

TEST_WITH(more_baked_keys_than_an_upload_may_have_bytes_are_422, setup, fixture_stop) {
  api_settings settings = loopback_settings();
  settings.limits.max_upload = 4096;
  fixture f = {.loop = loopback_start(&settings)};
  loopback_upload(f.loop, "application/json", keyed, f.keyed);
  /* Three rotations and a translation: 15 numbers a time. */
  reply r = model_get(f.loop, f.keyed, "surface.glb?from=0&to=0.67&fps=100");
  assert_int_equal(r.status, 200);
  reply_free(&r);
  assert_problem(model_get(f.loop, f.keyed, "surface.glb?from=0&to=0.68&fps=100"), 422, NULL,
                 "69 keys of 15 numbers");
  loopback_stop(f.loop);
}

TEST_WITH(baked_keys_stand_at_the_times_asked_for, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *document = model_get_json(f->loop, f->keyed, "surface.gltf?clip=all&at=0,0.25,0.375,2");
  for (int track = 0; track < 4; track++) {
    assert_int_equal(key_count(document, track), 4);
    assert_kind(document, track, track == 2 ? "STEP" : "LINEAR");
  }
  cJSON_Delete(document);
  document = model_get_json(f->loop, f->keyed, "surface.gltf?from=0&to=1&fps=8");
  assert_int_equal(key_count(document, 1), 9);
  cJSON_Delete(document);
}

TEST_WITH(a_kept_clip_keeps_the_keys_that_gltf_has, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *document = model_get_json(f->loop, f->keyed, "surface.gltf?clip=all");
  assert_int_equal(key_count(document, 0), 11);
  assert_int_equal(key_count(document, 2), 3);
  assert_int_equal(key_count(document, 3), 3);
  assert_true(key_count(document, 1) > 2); /* Euler angles are made of slerps */
  assert_kind(document, 1, "LINEAR");
  assert_kind(document, 2, "STEP");
  cJSON_Delete(document);
  double degrees, metres;
  read_error(f, "surface.gltf?clip=all", &degrees, &metres);
  assert_true(degrees > 0 && degrees <= 0.1 && metres == 0);
}

TEST_WITH(a_tolerance_leaves_the_fewest_keys, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *document =
      model_get_json(f->loop, f->keyed, "surface.gltf?clip=all&tolerance=0.05&tolerance_m=0.01");
  assert_int_equal(key_count(document, 0), 2); /* one great circle at one speed */
  assert_int_equal(key_count(document, 2), 3);
  assert_int_equal(key_count(document, 3), 2);
  int fine = key_count(document, 1);
  cJSON_Delete(document);
  document = model_get_json(f->loop, f->keyed, "surface.gltf?clip=all&tolerance=5");
  assert_true(key_count(document, 1) < fine);
  cJSON_Delete(document);
  double degrees, metres;
  read_error(f, "surface.gltf?clip=all&tolerance=0.05", &degrees, &metres);
  assert_true(degrees > 0 && degrees <= 0.05 && metres < 0.001);
}

TEST_WITH(the_error_between_baked_keys_is_told, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT], target[160];
  loopback_upload(
      f->loop, "application/json",
      "{'nodes':[{'name':'n'}],'clips':[{'tracks':[{'node':'n','path':'rotation','unit':'degrees',"
      "'times':[0,1,2],'axis_angles':[[0,0,1,0],[0,0,1,60],[0,0,1,0]]},{'node':'n',"
      "'path':'translation','times':[0,1,2],'values':[[0,0,0],[0,3,4],[0,0,0]]}]}]}",
      id);
  const struct {
    const char *rest, *error;
  } asked[] = {{"at=0,2", "degrees=60.0000"},
               {"at=0,2", ", metres=5.0000000"},
               {"at=0.5,1.5", "degrees=30.0000"},
               {"at=0,0.5,1,2", "degrees=0.0000"},
               {"from=0&to=2&fps=4", ", metres=0.0000000"},
               {"at=0,2,4", ", metres=5.0000000"},
               {"at=1", NULL}};
  for (size_t i = 0; i < sizeof asked / sizeof *asked; i++) {
    snprintf(target, sizeof target, "/v1/models/%s/surface.glb?%s", id, asked[i].rest);
    reply r = loopback_get(f->loop, target);
    assert_int_equal(r.status, 200);
    const char *told = reply_header(&r, "X-Tweend-Error");
    if (!asked[i].error != !told || (told && !strstr(told, asked[i].error)))
      fail_msg("%s: %s", asked[i].rest, told ? told : "nothing");
    reply_free(&r);
  }
}

TEST_WITH(a_clip_is_reduced_once_for_equal_requests, setup, fixture_stop) {
  const fixture *f = *state;
  static const struct {
    const char *rest;
    int reductions;
  } requests[] = {{"surface.gltf?clip=all&tolerance=0.05", 1},
                  {"surface.glb?clip=all&tolerance=0.05&meshes=none", 1},
                  {"surface.gltf?clip=all&tolerance=0.06", 2},
                  {"surface.gltf?clip=all", 3}, /* the same tolerance as given, but for fewer tracks */
                  {"surface.gltf?clip=all&tolerance=0.1", 4},
                  {"surface.gltf?clip=all&tolerance=0.05", 4}};
  reductions = 0;
  for (size_t i = 0; i < sizeof requests / sizeof *requests; i++) {
    reply r = model_get(f->loop, f->keyed, requests[i].rest);
    assert_int_equal(r.status, 200);
    assert_int_equal(reductions, requests[i].reductions);
    reply_free(&r);
  }
  reply r = model_ask(f->loop, "DELETE", f->keyed, "", NULL);
  reply_free(&r);
  assert_problem(model_get(f->loop, f->keyed, requests[0].rest), 404, NULL, NULL);
}

TEST_WITH(without_meshes_the_tree_and_the_animation_are_left, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *document = model_get_json(f->loop, f->flag, "surface.gltf?clip=wave&meshes=none");
  assert_int_equal(cJSON_GetArraySize(json_member(document, "nodes")), 3);
  assert_null(cJSON_GetObjectItem(document, "meshes"));
  assert_null(cJSON_GetObjectItem(document, "skins"));
  assert_int_equal(
      cJSON_GetArraySize(json_member(cJSON_GetArrayItem(json_member(document, "animations"), 0), "channels")),
      1); /* weights need a mesh */
  assert_int_equal(key_count(document, 0), 2);
  cJSON_Delete(document);
  /* Nothing is subdivided, so no level is too deep. */
  document = model_get_json(f->loop, f->flag, "surface.gltf?meshes=none&at=1");
  const cJSON *bone = cJSON_GetArrayItem(json_member(document, "nodes"), 0);
  assert_true(fabs(cJSON_GetArrayItem(json_member(bone, "rotation"), 2)->valuedouble - sqrt(0.5)) < 1e-6);
  cJSON_Delete(document);
}

TEST_WITH(a_clip_is_borrowed_by_the_names_of_nodes, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT], rest[128];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'bone'}]}", id);
  snprintf(rest, sizeof rest, "surface.gltf?clip=%s/wave", f->flag);
  reply r = model_get(f->loop, id, rest);
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "skinned"));
  reply_free(&r);
  cJSON *document = model_get_json(f->loop, id, rest);
  assert_int_equal(key_count(document, 0), 2);
  cJSON_Delete(document);
}

TEST_WITH(a_moment_bears_the_clips_morph_weights, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *document = model_get_json(f->loop, f->flag, "surface.gltf?at=0.5");
  const cJSON *nodes = json_member(document, "nodes");
  const cJSON *weights = json_member(cJSON_GetArrayItem(nodes, 1), "weights");
  assert_int_equal(cJSON_GetArraySize(weights), 1);
  assert_true(weights->child->valuedouble == 0.25);
  /* Another node shows the same mesh, which no track moves. */
  assert_null(cJSON_GetObjectItem(cJSON_GetArrayItem(nodes, 2), "weights"));
  assert_null(cJSON_GetObjectItem(document, "animations"));
  cJSON_Delete(document);
  document = model_get_json(f->loop, f->flag, "surface.gltf?at=0.5&meshes=none");
  assert_null(cJSON_GetObjectItem(cJSON_GetArrayItem(json_member(document, "nodes"), 1), "weights"));
  cJSON_Delete(document);
}

/* (x, y, z) of the cage goes to (-y, x, z) where the bone has turned, after the half morph has lifted it. */
TEST_WITH(baked_skins_are_where_the_joints_put_them, setup, fixture_stop) {
  const fixture *f = *state;
  reply r = model_get(f->loop, f->flag, "surface.obj?level=0&at=1&skin=bake&normals=none");
  if (r.status != 200) fail_msg("%d %s", r.status, r.body);
  /* "shown" comes first, by the mesh's own weights (0) and moved by (10, 0, 0); the skinned one's own node
   * plays no part. */
  assert_point(&r, 0, 10, 0, 0);
  assert_point(&r, 1, 12, 0, 0);
  assert_point(&r, 4, 0, 0, 0.5);
  assert_point(&r, 5, 0, 2, 0.5);
  assert_point(&r, 6, -1, 2, 0.5);
  assert_point(&r, 7, -1, 0, 0.5);
  reply_free(&r);
}

TEST_WITH(skins_are_baked_at_rest_without_a_clip, setup, fixture_stop) {
  const fixture *f = *state;
  char text[sizeof flag], id[API_ID_TEXT];
  snprintf(text, sizeof text, "%s", flag);
  char *cut = strstr(text, "'animations':["), *end = strstr(text, "'accessors'");
  memmove(cut, end, strlen(end) + 1);
  char *bone = strstr(text, "{'name':'bone'}"); /* turned by 180 degrees about z in a model without clips */
  char turned[2 * sizeof flag];
  snprintf(turned, sizeof turned, "%.*s{'name':'bone','rotation':[0,0,1,0]}%s", (int)(bone - text), text,
           bone + strlen("{'name':'bone'}"));
  loopback_upload(f->loop, "model/gltf+json", turned, id);
  const char *const ids[] = {id, f->flag};
  for (int i = 0; i < 2; i++) {
    reply r = model_get_ok(f->loop, ids[i], "surface.obj?level=0&clip=none&skin=bake&normals=none");
    assert_point(&r, 1, 12, 0, 0);
    assert_point(&r, 5, i == 0 ? -2 : 2, 0, 0);
    reply_free(&r);
  }
  assert_problem(model_get(f->loop, id, "surface.glb?skin=bake&at=0"), 404, NULL, "clip=none");
  assert_problem(model_get(f->loop, id, "surface.glb?skin=bake"), 400, NULL, "clip=none");
  assert_problem(model_get(f->loop, f->flag, "surface.glb?skin=bake&clip=none&fps=2"), 400, NULL, "one time");
  cJSON *document = model_get_json(f->loop, id, "surface.gltf?level=1&clip=none&skin=bake");
  assert_null(cJSON_GetObjectItem(document, "skins"));
  assert_int_equal(cJSON_GetArraySize(json_member(document, "meshes")), 2);
  cJSON_Delete(document);
}

TEST_WITH(baked_answers_have_no_skins_and_no_targets, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *document = model_get_json(f->loop, f->flag, "surface.gltf?level=1&at=0.5&skin=bake");
  assert_null(cJSON_GetObjectItem(document, "skins"));
  assert_null(cJSON_GetObjectItem(document, "animations"));
  assert_int_equal(cJSON_GetArraySize(json_member(document, "meshes")), 2);
  const cJSON *mesh = cJSON_GetArrayItem(json_member(document, "meshes"), 1);
  const cJSON *primitive = cJSON_GetArrayItem(json_member(mesh, "primitives"), 0);
  assert_null(cJSON_GetObjectItem(primitive, "targets"));
  assert_null(cJSON_GetObjectItem(json_member(primitive, "attributes"), "JOINTS_0"));
  assert_int_equal(cJSON_GetArraySize(json_member(document, "nodes")), 4);
  cJSON_Delete(document);
}

TEST_WITH(a_bake_at_another_time_builds_no_topology, setup, fixture_stop) {
  const fixture *f = *state;
  const char *const forms[] = {"surface.glb?level=3", "surface.obj?level=2&normals=none"};
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    char rest[64];
    reply replies[3];
    for (int n = 0; n < 3; n++) { /* the last one asks again for the first */
      snprintf(rest, sizeof rest, "%s&skin=bake&at=0.%d", forms[i], n % 2 ? 7 : 4);
      meshes_read = 0;
      replies[n] = model_get(f->loop, f->flag, rest);
      assert_int_equal(replies[n].status, 200);
      assert_true((meshes_read > 0) == (n == 0));
    }
    assert_int_equal(replies[0].size, replies[2].size);
    assert_memory_equal(replies[0].body, replies[2].body, replies[0].size);
    assert_true(replies[0].size != replies[1].size ||
                memcmp(replies[0].body, replies[1].body, replies[0].size) != 0);
    for (int n = 0; n < 3; n++) reply_free(&replies[n]);
  }
}

static bool is_cancelled(void *steps_left) {
  uint32_t *left = steps_left;
  if (*left == 0) return true;
  --*left;
  return false;
}

/* At each step in turn; the host has no threads. */
TEST(a_cancelled_bake_is_503_and_no_lack_of_memory) {
  uint32_t left = UINT32_MAX, cancelled = 0;
  api_settings settings = loopback_settings();
  settings.parallel = (api_parallel_for){.owner = &left, .is_cancelled = is_cancelled};
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT], target[128];
  loopback_upload(loop, "model/gltf+json", flag, id);
  snprintf(target, sizeof target, "/v1/models/%s/surface.glb?level=3&skin=bake&at=1", id);
  reply r = loopback_get(loop, target); /* from here on the plan is cached, and only moved */
  assert_int_equal(r.status, 200);
  do {
    reply_free(&r);
    left = cancelled;
    r = loopback_get(loop, target);
    if (r.status == 200) continue;
    cancelled++;
    assert_int_equal(r.status, 503);
    assert_int_equal(r.answer.refusal, API_REFUSAL_NONE);
    assert_says(&r, "not wanted any more");
  } while (r.status != 200);
  reply_free(&r);
  assert_true(cancelled > 1);
  loopback_stop(loop);
}

TEST_WITH(what_a_bake_would_move_is_limited, setup, fixture_stop) {
  api_settings settings = loopback_settings();
  settings.limits.max_output = 50;
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT];
  loopback_upload(loop, "model/gltf+json", flag, id);
  assert_problem(model_get(loop, id, "surface.glb?at=1&skin=bake"), 422, NULL, "8 points");
  loopback_stop(loop);
}

TEST_WITH(every_choice_has_its_own_tag, setup, fixture_stop) {
  const fixture *f = *state;
  const char *const choices[] = {"clip=wave",
                                 "clip=wave&tolerance=0.1",
                                 "clip=wave&tolerance=0.2",
                                 "clip=wave&tolerance_m=0.1",
                                 "clip=wave&meshes=none",
                                 "clip=wave&root_motion=auto",
                                 "clip=wave&root_motion=auto&root_axes=x",
                                 "clip=wave&in_place=true",
                                 "at=1",
                                 "at=1&skin=bake",
                                 "clip=none",
                                 "clip=none&skin=bake"};
  enum { COUNT = sizeof choices / sizeof *choices };
  char tags[COUNT][128], rest[128];
  for (int i = 0; i < COUNT; i++) {
    snprintf(rest, sizeof rest, "surface.glb?%s", choices[i]);
    reply r = model_get(f->loop, f->flag, rest);
    snprintf(tags[i], sizeof tags[i], "%s", reply_header(&r, "ETag"));
    reply_free(&r);
    for (int j = 0; j < i; j++) assert_string_not_equal(tags[i], tags[j]);
  }
}
