/* What an error says: names that are near, paths that nearly exist, the word that is malformed. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "near_names.h"

#define MODEL                                                                                                \
  "{'nodes':[{'name':'turret'},{'name':'wheel_left'},{'name':'wheel_right'}],"                               \
  "'clips':[{'name':'drive','tracks':[]},{'name':'aim','tracks':[]}]}"

static int start(void **state) {
  *state = one_model_start(NULL, MODEL);
  return 0;
}

/* Asks for `format`, whose %s is the model's id. detail: NULL for any answer but an error. */
static void ask(const one_model *one, const char *format, int status, const char *detail) {
  char target[256];
  snprintf(target, sizeof target, format, one->id);
  reply r = loopback_get(one->loop, target);
  cJSON *json = cJSON_Parse(r.body);
  const char *said = cJSON_GetStringValue(cJSON_GetObjectItem(json, "detail"));
  if (r.status != status || (detail && (!said || strcmp(said, detail) != 0)))
    fail_msg("%s: %d %s", target, r.status, r.body);
  cJSON_Delete(json);
  reply_free(&r);
}

/* ---- names ----------------------------------------------------------------------------------- */

TEST_WITH(names_that_are_not_there_list_those_that_are_near, start, fixture_stop) {
  ask(*state, "/v1/models/%s/pose?clip=Drvie", 404,
      "no clip is called \"Drvie\"; did you mean drive? there are: drive, aim");
  ask(*state, "/v1/models/%s/pose?clip=swim", 404,
      "no clip is called \"swim\"; did you mean aim? there are: drive, aim");
  ask(*state, "/v1/models/%s/pose?clip=jump", 404, "no clip is called \"jump\"; there are: drive, aim");
  ask(*state, "/v1/models/%s/pose?nodes=wheel_left,turet", 404,
      "no node is called \"turet\"; did you mean turret?");
  ask(*state, "/v1/models/%s/pose?nodes=wheel", 404,
      "no node is called \"wheel\"; did you mean wheel_left, wheel_right?");
  ask(*state, "/v1/models/%s/pose?nodes=barrel", 404, "no node is called \"barrel\"");
}

TEST_WITH(unknown_parameters_and_values_name_the_nearest, start, fixture_stop) {
  ask(*state, "/v1/models/%s/tracks?clp=aim", 400,
      "unknown parameter \"clp\"; did you mean clip? known: clip, retarget, map, feet, root_motion, "
      "root_axes, in_place");
  ask(*state, "/v1/models/%s/tracks?frobnicate=1", 400,
      "unknown parameter \"frobnicate\"; known: clip, retarget, map, feet, root_motion, root_axes, in_place");
  ask(*state, "/v1/models/%s/surface?scheme=catmul-clark", 400,
      "scheme=catmul-clark: did you mean catmull-clark? expected one of catmull-clark, loop, bilinear");
  ask(*state, "/v1/models/%s/surface?scheme=butterfly", 400,
      "scheme=butterfly: expected one of catmull-clark, loop, bilinear");
}

TEST_WITH(names_inside_a_document_have_near_ones_too, loopback_setup, loopback_teardown) {
  static const struct {
    const char *text;
    int status;
    const char *pointer, *word;
  } cases[] = {
      {"{'meshes':[{'name':'hull'}],'nodes':[{'mesh':'hulk'}]}", 422, "/nodes/0/mesh",
       "no mesh is called \"hulk\"; did you mean hull?"},
      {"{'nodes':[{'name':'a'},{'parent':'base'}]}", 422, "/nodes/1/parent", "no node is called \"base\""},
      {"{'node':[]}", 400, "", "unknown member \"node\"; did you mean nodes? known: meshes"},
      {"{'nodes':[{'name':'a'}],'clips':[{'tracks':[{'node':'a','path':'rotaton','times':[0]}]}]}", 400,
       "/clips/0/tracks/0/path", "\"rotaton\": did you mean rotation? expected one of"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_problem(loopback_post(*state, "/v1/models", "application/json", cases[i].text), cases[i].status,
                   cases[i].pointer, cases[i].word);
}

TEST(the_distance_counts_edits_and_no_case) {
  assert_int_equal(api_name_distance("", 0, "abc"), 3);
  assert_int_equal(api_name_distance("abc", 3, "abc"), 0);
  assert_int_equal(api_name_distance("ABC", 3, "abd"), 1);
  assert_int_equal(api_name_distance("kitten", 6, "sitting"), 3);
}

TEST(at_most_three_names_are_near_the_nearest_first) {
  const char *const names[] = {"levels", "label", "level", "lever", "level", "bevel", "unit", NULL};
  assert_string_equal(api_near_of("level", names).text, " did you mean level, levels, lever?");
  assert_string_equal(api_near_of("x", names).text, "");
}

TEST(what_is_much_farther_than_the_nearest_is_not_named) {
  const char *const names[] = {"translation", "translate", NULL};
  assert_string_equal(api_near_of("translation", names).text, " did you mean translation?");
  assert_string_equal(api_near_of("translatn", names).text, " did you mean translate, translation?");
}

TEST(long_names_are_near_nothing) {
  char name[API_NEAR_TEXT + 1];
  memset(name, 'a', sizeof name - 1);
  name[sizeof name - 1] = '\0';
  const char *const longs[] = {name, NULL};
  assert_string_equal(api_near_of(name, longs).text, "");
  name[API_NEAR_TEXT - 1] = '\0';
  assert_string_not_equal(api_near_of(name, longs).text, "");
}

TEST_WITH(parameters_that_a_form_has_no_place_for_are_named, start, fixture_stop) {
  static const char *const forms[] = {"stl", "ply", "3mf", "obj", "bin", "json?shells=true"};
  static const char *const wrong[] = {"clip=drive",    "at=0,1",      "from=0", "fps=10",  "tolerance=1",
                                      "tolerance_m=1", "meshes=none", "unit=x", "scale=0", "limit=1"};
  const one_model *one = *state;
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
      char target[200], name[20];
      snprintf(target, sizeof target, "/v1/models/%s/surface.%s%c%s", one->id, forms[i],
               strchr(forms[i], '?') ? '&' : '?', wrong[k]);
      snprintf(name, sizeof name, "%.*s", (int)strcspn(wrong[k], "="), wrong[k]);
      assert_problem(loopback_get(one->loop, target), 400, NULL, name);
    }
}

TEST_WITH(values_of_clips_terms_are_told_as_they_came, start, fixture_stop) {
  ask(*state, "/v1/models/%s/pose?root_motion=auto&root_axes=x,w", 400,
      "root_axes: \"w\" is none of x, y, z and yaw");
  ask(*state, "/v1/models/%s/tracks?feet=hold", 400, "feet=hold goes with retarget=auto");
}

/* ---- numbers --------------------------------------------------------------------------------- */

TEST_WITH(numbers_are_told_as_they_came, start, fixture_stop) {
  ask(*state, "/v1/models/%s/surface.json?level=99999999999", 422,
      "level=99999999999 is over the limit of 10");
  ask(*state, "/v1/models/%s/surface.json?level=999999999999999999", 422,
      "level=999999999999999999 is over the limit of 10");
  ask(*state, "/v1/models/%s/surface.json?level=9999999999999999999", 400,
      "level=9999999999999999999: more than 18 digits");
  ask(*state, "/v1/models/%s/pose?from=1.2345678&to=1.2345671&fps=1", 400,
      "to=1.2345671 is before from=1.2345678");
  ask(*state, "/v1/models/%s/pose?from=9.5&fps=1", 400, "from=9.5 is behind the clip's end at 0");
}

TEST_WITH(numbers_of_a_body_are_told_as_they_came, start, fixture_stop) {
  const one_model *one = *state;
  static const char faces[] = "{'meshes':[{'faces':[[0,1,%s]]}]}";
  static const char *const numbers[] = {"99999999999", "1e+300", "-1", "123456789012345"};
  char text[128], said[64];
  for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
    snprintf(text, sizeof text, faces, numbers[i]);
    snprintf(said, sizeof said, "the number %s is out of range", numbers[i]);
    assert_problem(loopback_post(one->loop, "/v1/models", "application/json", text), 422,
                   "/meshes/0/faces/0/2", said);
  }
}

TEST_WITH(shapes_beyond_all_numbers_say_so, loopback_setup, loopback_teardown) {
  static const char shape[] =
      "{\"meshes\":[{\"shape\":{\"kind\":\"uv_sphere\",\"segments\":4000000000,\"rings\":4000000000}}]}";
  assert_problem(
      loopback_post(*state, "/v1/models", "application/json", shape), 422, "/meshes/0/shape",
      "would have over 4611686018427387904 points and over 4611686018427387904 faces; shapes may have ");
}

/* ---- parameters that the form has no use for ------------------------------------------------- */

TEST_WITH(obj_holds_no_clip, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], target[128];
  loopback_upload_sample(*state, "application/json", "tank.json", id);
  const char *const refused[] = {"clip=drive", "at=0,1", "fps=10", "clip=none&tolerance=1",
                                 "clip=aim&at=1,2"};
  const char *const answered[] = {"clip=none", "at=1",      "clip=aim&at=1",
                                  "level=0",   "skin=keep", "encoding=quantized"};
  for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
    snprintf(target, sizeof target, "/v1/models/%s/surface.obj?%s", id, refused[i]);
    assert_problem(loopback_get(*state, target), 400, NULL,
                   "OBJ holds no clip: at=T shows the model at one time");
    snprintf(target, sizeof target, "/v1/models/%s/surface?%s", id, refused[i]);
    assert_problem(loopback_ask(*state, "GET", target, "Accept: model/obj\n", NULL, 0), 400, NULL,
                   "OBJ holds no clip");
    snprintf(target, sizeof target, "/v1/models/%s/surface.json?%s", id, refused[i]);
    reply r = loopback_get(*state, target);
    assert_false(reply_says(&r, "OBJ"));
    reply_free(&r);
  }
  for (size_t i = 0; i < sizeof answered / sizeof *answered; i++) {
    snprintf(target, sizeof target, "/v1/models/%s/surface.obj?%s", id, answered[i]);
    reply r = loopback_get(*state, target);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  snprintf(target, sizeof target, "/v1/models/%s/surface.obj?meshes=none", id);
  assert_problem(loopback_get(*state, target), 400, NULL, "meshes=none leaves nothing of an answer as OBJ");
}

/* ---- paths ----------------------------------------------------------------------------------- */

TEST_WITH(paths_that_nearly_exist_name_the_one_that_does, start, fixture_stop) {
  static const char nothing[] = "nothing is at this path";
  static const struct {
    const char *target, *near;
  } cases[] = {
      {"/v1/model", "/v1/models"},
      {"/models", "/v1/models"},
      {"/v1/models/", "/v1/models"},
      {"/v1/models/%s/", "/v1/models/{id}"},
      {"/v1/models/%s/poses", "/v1/models/{id}/pose"},
      {"/v1/models/%s/pose.jsn", "/v1/models/{id}/pose.json"},
      {"/v1/models/%s/surface.gbl", "/v1/models/{id}/surface.glb"},
      {"/v1/Models/%s/tracks", "/v1/models/{id}/tracks"},
      {"/health", "/healthz"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char detail[160];
    snprintf(detail, sizeof detail, "%s; did you mean %s", nothing, cases[i].near);
    char target[96];
    snprintf(target, sizeof target, cases[i].target, ((const one_model *)*state)->id);
    assert_problem(loopback_get(((const one_model *)*state)->loop, target), 404, NULL, detail);
  }
  ask(*state, "/frobnicate", 404, nothing);
  ask(*state, "/v1/models/%s/frobnicate", 404, nothing);
  ask(*state, "/v1/models/ABC/pose", 404,
      "nothing is at this path: a model's id is 32 hex digits, in lower case");
}

/* ---- OBJ ------------------------------------------------------------------------------------- */

TEST_WITH(a_malformed_number_is_quoted_with_line_and_column, loopback_setup, loopback_teardown) {
  reply r = loopback_post(*state, "/v1/models", "model/obj", "v 0 0 0\nv 1 0 1.0f\n");
  assert_int_equal(r.status, 400);
  cJSON *json = cJSON_Parse(r.body);
  assert_string_equal(json_member(json, "detail")->valuestring, "line 2, column 7: \"1.0f\" is no number");
  assert_int_equal(json_member(json, "line")->valueint, 2);
  assert_int_equal(json_member(json, "column")->valueint, 7);
  cJSON_Delete(json);
  reply_free(&r);
}

TEST_WITH(a_line_without_a_column_stands_before_the_sentence, loopback_setup, loopback_teardown) {
  reply r = loopback_post(*state, "/v1/models", "model/obj", "v 0 0 0\nf 1 1 9\n");
  cJSON *json = cJSON_Parse(r.body);
  assert_string_equal(json_member(json, "detail")->valuestring,
                      "line 2: index 9 is out of range: the file has 1 point");
  assert_null(cJSON_GetObjectItem(json, "column"));
  cJSON_Delete(json);
  reply_free(&r);
}

/* ---- formats that are not read --------------------------------------------------------------- */

#define BYTES(text) text, sizeof(text) - 1

static const struct {
  const char *bytes;
  size_t size;
  const char *looks; /* in the detail; NULL: it is read, or refused by the reader of its format */
} bodies[] = {
    {BYTES("Kaydara FBX Binary  \0\x1A\0"), "FBX (binary): export it as GLB"},
    {BYTES("; FBX 7.7.0 project file\n"), "FBX (text)"},
    {BYTES("BLENDER-v402"), "Blender's own format"},
    {BYTES("\x1F\x8B\x08\0\0\0\0\0\x02\xFF\x73\xF2\x71\xF5\x73\x71\x0D\xD2\x2D\x33\x31\x30\x02\0"),
     "Blender's own format, packed"},
    {BYTES("\x28\xB5\x2F\xFD\x04\x58\x61\0\0"
           "BLENDER-v402"),
     "Blender's own format, packed"},
    {BYTES("\x1F\x8B\x08\0"), "gzip: send it with Content-Encoding: gzip"},
    {BYTES("\x28\xB5\x2F\xFD\0"), "zstd: send it with Content-Encoding: zstd"},
    {BYTES("PK\3\4\x0A\0\0\0\0\0\0\0\0\0model.usdc"), "USDZ"},
    {BYTES("PK\3\4\x0A\0\0\0\0\0\0\0\0\0"
           "3D/3dmodel.model"),
     "3MF"},
    {BYTES("PK\3\4\x0A\0\0\0\0\0\0\0\0\0model.obj"), "ZIP"},
    {BYTES("PXR-USDC\0"), "USD (binary)"},
    {BYTES("#usda 1.0\n"), "USD (text)"},
    {BYTES("\x89PNG\r\n\x1A\n"), "PNG;"},
    {BYTES("\xFF\xD8\xFF\xE0"), "JPEG"},
    {BYTES("RIFF\x24\0\0\0WEBPVP8 "), "WebP"},
    {BYTES("MM\x10\0\0\0\x02\0\x0A\0\0\0\3\0\0\0"), "3DS"},
    {BYTES("<?xml version=\"1.0\"?>\n<COLLADA version=\"1.4.1\">"), "COLLADA"},
    {BYTES("<?xml version=\"1.0\"?>\n<svg>"), "XML"},
    {BYTES("\n<!doctype html>\n<title>Not found</title>"), "a web page"},
    {BYTES("newmtl stone\nKd 1 1 1\n"), "MTL"},
    {BYTES("# Blender MTL File\r\n\r\n# 1\nnewmtl stone\nKd 1 1 1\n"), "MTL"},
    {BYTES("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "OFF"},
    {BYTES("version https://git-lfs.github.com/spec/v1\n"), "a pointer of Git LFS"},
    {BYTES("\xFF\xFEv\0 \0"
           "0\0"),
     "text in UTF-16: save it as UTF-8"},
    {BYTES("\xFE\xFF\0v\0 "), "text in UTF-16"},
    {BYTES("v\0 \0"
           "0\0 \0"),
     "text in UTF-16"},
    {BYTES("# cubev 0 0 0v 1 0 0v 0 1 0f 1 2 3"),
     "an OBJ without its line ends: curl -d drops them, --data-binary keeps"},
    {BYTES("v 0 0 0v -1 0 0v 0 .1 0f 1 2 3"), "an OBJ without its line ends"},
    {BYTES("plyformat ascii 1.0element vertex 3"), "a PLY without its line ends"},
    {BYTES("glTF\2\xB8\x09JSON{"), "a GLB without its zero bytes"},
    {BYTES("hello, world\n"), "text that is no OBJ"},
    {BYTES("V 0 0 0\nF 1 2 3\n"), "text that is no OBJ"},
    {BYTES("\1\2\3\0\5"), "data of an unknown kind"},
    {BYTES("\xEF\xBB\xBF# by hand\r\n\r\n  v 0 0 0\r\n"), NULL},
    {BYTES("o a\rv 0 0 0\r"), NULL},
    {BYTES("v 0 0 0"), NULL},
    {BYTES("f 1 2 3\n"), NULL},
    {BYTES("{\"nodes\":[{\"name\":\"<html\"}]}"), NULL},
    {BYTES("glTF\2\0\0\0"), NULL},
    {BYTES("solid a\nendsolid a\n"), NULL},
};

TEST_WITH(bodies_of_no_known_format_are_415_with_what_they_look_like, loopback_setup, loopback_teardown) {
  for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++) {
    reply r = loopback_ask(*state, "POST", "/v1/models", "Content-Type: application/octet-stream\n",
                           bodies[i].bytes, bodies[i].size);
    cJSON *json = cJSON_Parse(r.body);
    const char *detail = cJSON_GetStringValue(cJSON_GetObjectItem(json, "detail"));
    bool is_foreign = r.status == 415,
         is_named = is_foreign && bodies[i].looks && strstr(detail, bodies[i].looks);
    if (is_foreign != (bodies[i].looks != NULL) || is_foreign != is_named)
      fail_msg("%.20s: %d %s", bodies[i].bytes, r.status, r.body);
    if (is_foreign) assert_int_equal(cJSON_GetArraySize(json_member(json, "supported")), 9);
    cJSON_Delete(json);
    reply_free(&r);
  }
}

TEST_WITH(a_declared_type_does_not_hide_what_the_bytes_are, loopback_setup, loopback_teardown) {
  const char *const types[] = {"model/obj", "model/stl", "application/json", "model/gltf-binary"};
  for (size_t i = 0; i < sizeof types / sizeof *types; i++)
    assert_problem(loopback_post(*state, "/v1/surface.glb", types[i], "\x89PNG\r\n"), 400, NULL,
                   "but the bytes look like PNG");
  assert_problem(loopback_post(*state, "/v1/surface.glb", "text/plain", "\x89PNG\r\n"), 415, NULL,
                 "looks like PNG");
}

/* Bytes of no known format, declared as one: 415 is for types. */
TEST_WITH(what_is_declared_as_a_model_has_the_error_of_its_reader, loopback_setup, loopback_teardown) {
  static const struct {
    const char *type, *bytes;
    size_t size;
    const char *word;
  } cases[] = {
      {"model/obj", BYTES("# nothing\n"), "no point and no face"},
      {"model/obj", BYTES("\1\2\3\0\5"), "no point and no face"},
      {"model/obj", BYTES("v 0 0 0v -1 0 0v 0 .1 0f 1 2 3"), "an OBJ without its line ends: curl -d"},
      {"model/stl", BYTES("\1\2\3\0\5"), "nor binary with all of its facets"},
      /* which would be OBJ once it is stored */
      {"model/stl", BYTES("a solid b\nloop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endsolid\n"),
       "neither text with a solid"},
      {"model/stl", BYTES("v 0 0 0\n"), "look like OBJ"},
      {"model/ply", BYTES("pl\nformat ascii 1.0\nend_header\n"), "look like text that is no OBJ"},
      {"model/gltf-binary", BYTES("\1\2\3\0\5"), "look like data of an unknown kind"},
      {"model/gltf+json", BYTES("hello"), "a value is expected"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char headers[64];
    snprintf(headers, sizeof headers, "Content-Type: %s\n", cases[i].type);
    assert_problem(loopback_ask(*state, "POST", "/v1/models", headers, cases[i].bytes, cases[i].size), 400,
                   NULL, cases[i].word);
  }
  assert_int_equal(loopback_store_count(*state), 0);
}

TEST_WITH(what_is_declared_as_json_is_left_to_its_reader, loopback_setup, loopback_teardown) {
  assert_problem(loopback_post(*state, "/v1/models", "application/json", "[1, 2]"), 400, "", NULL);
}
