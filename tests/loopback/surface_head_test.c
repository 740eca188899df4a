/* HEAD of surfaces. */
#include "cube_and_tank.h"

#include <stdio.h>
#include <string.h>

TEST_WITH(head_tells_the_size_alone, setup, fixture_stop) {
  fixture *f = *state;
  cJSON *counts = model_get_json(f->loop, f->cube, "surface.json?level=10");
  reply head = model_ask(f->loop, "HEAD", f->cube, "surface.glb?level=10", NULL);
  assert_int_equal(head.status, 200);
  assert_true((double)head.answer.body.size == json_member(counts, "bytes")->valuedouble);
  assert_string_equal(reply_header(&head, "Content-Type"), "model/gltf-binary");
  uint8_t byte;
  assert_int_equal(head.answer.body.read(head.answer.body.context, &byte, 1), -1);
  reply_free(&head);
  cJSON_Delete(counts);
}

TEST_WITH(head_of_a_compressed_glb_has_a_length_once_it_is_known, setup, fixture_stop) {
  fixture *f = *state;
  for (int i = 0; i < 2; i++) {
    reply r = model_ask(f->loop, "HEAD", f->cube, "surface.glb?encoding=meshopt", NULL);
    assert_int_equal(r.status, 200);
    assert_int_equal(r.answer.body.size == API_SIZE_UNKNOWN, i == 0);
    reply_free(&r);
    r = model_get_ok(f->loop, f->cube, "surface.json?encoding=meshopt");
    reply_free(&r);
  }
}

/* Nodes take the points beyond floats: what is known without the surface is told to HEAD too. */
TEST_WITH(head_is_refused_as_get_is, setup, fixture_stop) {
  fixture *f = *state;
  static const char *const forms[] = {"obj", "stl", "ply", "3mf", "json?shells=true", "glb", "bin"};
  static const char far[] = "{\"meshes\":[{\"name\":\"m\",\"shape\":{\"kind\":\"box\",\"size\":[2,2,2]}}],"
                            "\"nodes\":[{\"name\":\"a\",\"scale\":[1e30,1e30,1e30]},"
                            "{\"mesh\":\"m\",\"parent\":\"a\",\"scale\":[1e30,1e30,1e30]}]}";
  char id[API_ID_TEXT], rest[64];
  loopback_upload(f->loop, "application/json", far, id);
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    snprintf(rest, sizeof rest, "surface.%s", forms[i]);
    reply get = model_ask(f->loop, "GET", id, rest, NULL), head = model_ask(f->loop, "HEAD", id, rest, NULL);
    if (get.status != head.status) fail_msg("%s: GET %d, HEAD %d", rest, get.status, head.status);
    assert_int_equal(get.status, i < 5 ? 422 : 200);
    reply_free(&get);
    reply_free(&head);
  }
}

/* The open sheet has warnings that are found by looking at all of its faces. */
TEST_WITH(head_warns_as_get_does, setup, fixture_stop) {
  fixture *f = *state;
  static const char *const forms[] = {"obj", "stl", "ply", "3mf", "glb", "gltf", "bin", "json"};
  char id[API_ID_TEXT], rest[64];
  loopback_upload(f->loop, "application/json", turning_sheet, id);
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    snprintf(rest, sizeof rest, "surface.%s", forms[i]);
    reply head = model_ask(f->loop, "HEAD", id, rest, NULL), get = model_ask(f->loop, "GET", id, rest, NULL);
    const char *told = reply_header(&head, "X-Tweend-Warning"),
               *wanted = reply_header(&get, "X-Tweend-Warning");
    assert_int_equal(head.status, 200);
    if (strcmp(told ? told : "", wanted ? wanted : "") != 0) fail_msg("%s: %s, %s", rest, told, wanted);
    if (strcmp(forms[i], "stl") == 0) assert_non_null(strstr(wanted, "not%20closed"));
    reply_free(&get);
    reply_free(&head);
  }
  /* Of more faces than HEAD looks at, warnings that are not all known are left out; GET knows them. */
  reply head = model_ask(f->loop, "HEAD", id, "surface.stl?level=6", NULL);
  assert_null(reply_header(&head, "X-Tweend-Warning"));
  reply_free(&head);
  reply get = model_ask(f->loop, "GET", id, "surface.stl?level=6", NULL);
  head = model_ask(f->loop, "HEAD", id, "surface.stl?level=6", NULL);
  assert_string_equal(reply_header(&head, "X-Tweend-Warning"), reply_header(&get, "X-Tweend-Warning"));
  reply_free(&get);
  reply_free(&head);
}
