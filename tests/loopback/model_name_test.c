/* Names of models: which one an upload gets, and as which file answers are saved. */
#include "loopback.h"

#include <stdio.h>
#include <string.h>

static void assert_named(loopback *loop, const char *target, const char *headers, const char *body,
                         const char *name) {
  reply r = loopback_ask(loop, "POST", target, headers, body, strlen(body));
  assert_true(r.status == 201 || r.status == 200);
  char expected[300], path[64];
  snprintf(expected, sizeof expected, "'name':'%s',", name);
  assert_says(&r, expected);
  strcpy(path, reply_header(&r, "Location"));
  reply_free(&r);
  r = loopback_get(loop, path);
  assert_says(&r, expected);
  reply_free(&r);
  r = loopback_get(loop, "/v1/models");
  assert_says(&r, expected);
  reply_free(&r);
}

#define NAMED_FACE(mesh) "o " mesh "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

TEST_WITH(a_name_is_that_of_the_query_the_request_or_the_file, loopback_setup, loopback_teardown) {
  static const char disposition[] = "Content-Disposition: attachment; filename=\"from header.obj\"\n";
  static const char form[] = "Content-Type: multipart/form-data; boundary=x\n";
  static const char both[] =
      "Content-Type: multipart/form-data; boundary=x\n"
      "Content-Disposition: attachment; filename*=UTF-8''na%C3%AFve%zz.obj; filename=\"no\"\n";
#define PART(mesh)                                                                                           \
  "--x\r\nContent-Disposition: form-data; name=\"file\"; "                                                   \
  "filename=\"C:\\\\models/part.obj\"\r\n\r\n" NAMED_FACE(mesh) "\r\n--x--"
  assert_named(*state, "/v1/models?name=%C3%A4%20b", disposition, NAMED_FACE("a"), "ä b");
  assert_named(*state, "/v1/models", disposition, NAMED_FACE("b"), "from header.obj");
  assert_named(*state, "/v1/models", form, PART("c"), "part.obj");
  assert_named(*state, "/v1/models", both, PART("d"), "naïve%zz.obj");
  assert_named(*state, "/v1/models?name=../../e", form, PART("e"), "e");
  assert_named(*state, "/v1/models", NULL, NAMED_FACE("f"), "f");
  assert_named(*state, "/v1/models?name=", NULL, NAMED_FACE("g"), "g");
  assert_named(*state, "/v1/models", "Content-Disposition: inline; filename=\"caf\xE9.obj\"\n",
               NAMED_FACE("h"), "café.obj");
  assert_named(*state, "/v1/models", "Content-Disposition: inline; filename*=ISO-8859-1''caf%E9.obj\n",
               NAMED_FACE("i"), "café.obj");
}

TEST_WITH(the_name_of_the_first_upload_stays, loopback_setup, loopback_teardown) {
  assert_named(*state, "/v1/models?name=first", NULL, NAMED_FACE("a"), "first");
  assert_named(*state, "/v1/models?name=second", NULL, NAMED_FACE("a"), "first");
  assert_named(*state, "/v1/models", NULL, NAMED_FACE("b"), "b");
  assert_named(*state, "/v1/models?name=later", NULL, NAMED_FACE("b"), "b");
}

TEST_WITH(a_long_name_is_cut_at_a_character, loopback_setup, loopback_teardown) {
  char target[1200] = "/v1/models?name=a", name[256] = "a";
  for (int i = 0; i < 150; i++) strcat(target, "%C3%A4");
  for (int i = 0; i < 127; i++) strcat(name, "ä");
  assert_named(*state, target, NULL, NAMED_FACE("a"), name);
}

static void assert_suggested(loopback *loop, const char *id, const char *rest, const char *expected) {
  reply r = model_get_ok(loop, id, rest);
  assert_string_equal(reply_header(&r, "Content-Disposition"), expected);
  reply_free(&r);
}

TEST_WITH(answers_suggest_the_name_as_a_file, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT];
  reply r = loopback_post(*state, "/v1/models?name=na%C3%AFve%20%22x%22.obj", "model/obj", NAMED_FACE("a"));
  assert_int_equal(r.status, 201);
  memcpy(id, strrchr(reply_header(&r, "Location"), '/') + 1, API_ID_TEXT);
  reply_free(&r);
  assert_suggested(*state, id, "surface.glb?level=0",
                   "inline; filename=\"na__ve _x_.glb\"; filename*=UTF-8''na%c3%afve%20%22x%22.glb");
  assert_suggested(*state, id, "surface.obj?level=0&download=1",
                   "attachment; filename=\"na__ve _x_.obj\"; filename*=UTF-8''na%c3%afve%20%22x%22.obj");
  assert_suggested(*state, id, "source?download=1",
                   "attachment; filename=\"na__ve _x_.obj\"; filename*=UTF-8''na%c3%afve%20%22x%22.obj");
  char target[96];
  snprintf(target, sizeof target, "/v1/models/%s/source?download=yes", id);
  assert_problem(loopback_get(*state, target), 400, NULL, "download");
}

TEST_WITH(suggested_names_have_one_extension, loopback_setup, loopback_teardown) {
  static const char *const names[] = {"a.bvh", "a.BVH", "a.vrm", "a.vrma", "a.3mf", "a.glb", "a.json"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    char target[64], text[128], id[API_ID_TEXT];
    snprintf(target, sizeof target, "/v1/models?name=%s", names[i]);
    snprintf(text, sizeof text, "HIERARCHY ROOT r%zu { OFFSET 0 0 0 }", i);
    reply r = loopback_post(*state, target, "model/x-bvh", text);
    assert_int_equal(r.status, 201);
    memcpy(id, strrchr(reply_header(&r, "Location"), '/') + 1, API_ID_TEXT);
    reply_free(&r);
    assert_suggested(*state, id, "source", "inline; filename=\"a.bvh\"; filename*=UTF-8''a.bvh");
    assert_suggested(*state, id, "surface.glb", "inline; filename=\"a.glb\"; filename*=UTF-8''a.glb");
  }
}

/* The name of a mesh may be long, and stands in the header twice. */
TEST_WITH(a_suggested_name_is_cut_at_a_character, loopback_setup, loopback_teardown) {
  enum { LETTERS = 500, KEPT = 127 };
  char name[2 * LETTERS + 1] = "", text[2 * LETTERS + 200], expected[2048] = "inline; filename=\"a",
                          id[API_ID_TEXT];
  for (int i = 0; i < LETTERS; i++) memcpy(name + 2 * i, "\xC3\xA4", 3);
  snprintf(text, sizeof text,
           "{'meshes':[{'name':'a%s','positions':[[0,0,0],[1,0,0],[1,1,0]],'faces':[[0,1,2]]}]}", name);
  loopback_upload(*state, "application/json", text, id);
  for (int i = 0; i < KEPT; i++) strcat(expected, "__");
  strcat(expected, ".obj\"; filename*=UTF-8''a");
  for (int i = 0; i < KEPT; i++) strcat(expected, "%c3%a4");
  strcat(expected, ".obj");
  assert_suggested(*state, id, "surface.obj?level=0", expected);
}
