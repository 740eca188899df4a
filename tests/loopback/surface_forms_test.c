/* Forms of surfaces: how one is chosen, and what it holds, whole and in part. */
#include "cube_and_tank.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

TEST_WITH(forms_follow_the_extension_then_accept, setup, fixture_stop) {
  fixture *f = *state;
  static const struct {
    const char *rest, *accept, *type;
  } cases[] = {{"surface", NULL, "model/gltf-binary"},
               {"surface.gltf", "Accept: model/obj\n", "model/gltf+json"},
               {"surface", "Accept: model/obj\n", "model/obj"},
               {"surface", "Accept: model/*\n", "model/gltf-binary"},
               {"surface", "Accept: application/json, model/obj;q=0.9\n", "application/json"},
               {"surface", "Accept: text/html,*/*;q=0.1\n", "model/gltf-binary"},
               {"surface", "Accept: model/gltf-binary;q=0, */*\n", "model/gltf+json"},
               {"surface", "Accept: application/json;q=0.3, model/*;q=0.2\n", "application/json"},
               {"surface.obj", NULL, "model/obj"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reply r = model_ask(f->loop, "GET", f->cube, cases[i].rest, cases[i].accept);
    assert_int_equal(r.status, 200);
    assert_string_equal(reply_header(&r, "Content-Type"), cases[i].type);
    bool is_negotiated = !strchr(cases[i].rest, '.'); /* else Accept has nothing to choose */
    assert_string_equal(reply_header(&r, "Vary"),
                        is_negotiated ? "Accept, Accept-Encoding" : "Accept-Encoding");
    reply_free(&r);
  }
  assert_problem(model_ask(f->loop, "GET", f->cube, "surface", "Accept: */*;q=0\n"), 406, NULL, NULL);
  reply r = model_ask(f->loop, "GET", f->cube, "surface", "Accept: image/png\n");
  assert_true(r.refused);
  assert_says(&r, "\"model/gltf+json\"");
  assert_problem(r, 406, NULL, NULL);
}

TEST_WITH(obj_keeps_quads, setup, fixture_stop) {
  fixture *f = *state;
  reply r = model_get_ok(f->loop, f->cube, "surface.obj?level=1");
  int points = 0, faces = 0;
  for (const char *line = r.body; line; line = strchr(line, '\n')) {
    if (*line == '\n') line++;
    points += strncmp(line, "v ", 2) == 0;
    faces += strncmp(line, "f ", 2) == 0;
  }
  assert_int_equal(points, 26);
  assert_int_equal(faces, 24);
  assert_true(r.answer.body.size == API_SIZE_UNKNOWN);
  reply_free(&r);
}

/* A joint doubles a triangle and lifts it; the transform of the triangle's own node does not count. */
TEST_WITH(obj_has_skinned_meshes_where_their_joints_put_them, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(
      f->loop, "model/gltf+json",
      "{'asset':{'version':'2.0'},'buffers':[{'byteLength':96,'uri':'data:application/octet-stream;base64,"
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAA"
      "AAAAAAAIA/AAAAAAAAAAAAAAAA"
      "'}],'bufferViews':[{'buffer':0,'byteLength':36},{'buffer':0,'byteOffset':36,'byteLength':12},"
      "{'buffer':0,'byteOffset':48,'byteLength':48}],'accessors':["
      "{'bufferView':0,'componentType':5126,'type':'VEC3','count':3,'min':[0,0,0],'max':[1,1,0]},"
      "{'bufferView':1,'componentType':5121,'type':'VEC4','count':3},"
      "{'bufferView':2,'componentType':5126,'type':'VEC4','count':3}],"
      "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'JOINTS_0':1,'WEIGHTS_0':2}}]}],"
      "'nodes':[{'name':'hip','translation':[0,0,5],'scale':[2,2,2]},"
      "{'name':'body','mesh':0,'skin':0,'translation':[70,0,0]}],'skins':[{'joints':[0]}],"
      "'scenes':[{'nodes':[0,1]}],'scene':0}",
      id);
  reply r = model_get_ok(f->loop, id, "surface.obj?level=0&normals=none");
  if (!strstr(r.body, "o body\nv 0 0 5\nv 2 0 5\nv 0 2 5\nf 1 2 3\n")) fail_msg("%s", r.body);
  reply_free(&r);
}

TEST_WITH(parts_of_a_glb_are_parts_of_the_whole, setup, fixture_stop) {
  fixture *f = *state;
  reply whole = model_get_ok(f->loop, f->tank, "surface.glb?level=2");
  assert_string_equal(reply_header(&whole, "Accept-Ranges"), "bytes");
  static const size_t firsts[] = {0, 5, 1000, 7777};
  for (size_t i = 0; i < sizeof firsts / sizeof *firsts; i++) {
    char header[64];
    snprintf(header, sizeof header, "Range: bytes=%zu-%zu\n", firsts[i], firsts[i] + 4321);
    reply r = model_ask(f->loop, "GET", f->tank, "surface.glb?level=2", header);
    assert_int_equal(r.status, 206);
    assert_int_equal(r.size, 4322);
    assert_memory_equal(r.body, whole.body + firsts[i], r.size);
    reply_free(&r);
  }
  reply r = model_ask(f->loop, "GET", f->tank, "surface.glb?level=2", "Range: bytes=-100\n");
  assert_memory_equal(r.body, whole.body + whole.size - 100, 100);
  reply_free(&r);
  assert_problem(model_ask(f->loop, "GET", f->tank, "surface.glb?level=2", "Range: bytes=999999999-\n"), 416,
                 NULL, NULL);
  r = model_ask(f->loop, "GET", f->tank, "surface.obj", "Range: bytes=0-1\n");
  assert_int_equal(r.status, 200);
  reply_free(&r);
  const struct {
    const char *ranges, *tag;
    int status;
  } conditions[] = {{"0-1,2-9", NULL, 206},
                    {"0-1,5-9", NULL, 200},
                    {"0-9", reply_header(&whole, "ETag"), 206},
                    {"0-9", "\"another\"", 200}};
  for (size_t i = 0; i < sizeof conditions / sizeof *conditions; i++) {
    char headers[160];
    int length = snprintf(headers, sizeof headers, "Range: bytes=%s\n", conditions[i].ranges);
    if (conditions[i].tag)
      snprintf(headers + length, sizeof headers - (size_t)length, "If-Range: %s\n", conditions[i].tag);
    r = model_ask(f->loop, "GET", f->tank, "surface.glb?level=2", headers);
    assert_int_equal(r.status, conditions[i].status);
    assert_int_equal(r.size, r.status == 206 ? 10 : whole.size);
    reply_free(&r);
  }
  reply_free(&whole);
}

TEST_WITH(a_body_is_answered_as_a_stored_model_and_not_kept, setup, fixture_stop) {
  fixture *f = *state;
  char *text = loopback_file("server/samples/tank.json", NULL);
  reply stored = model_get_ok(f->loop, f->tank, "surface.glb?level=2&clip=drive");
  reply given = loopback_post(f->loop, "/v1/surface.glb?level=2&clip=drive", "application/json", text);
  assert_int_equal(given.status, 200);
  assert_int_equal(given.size, stored.size);
  assert_memory_equal(given.body, stored.body, given.size);
  assert_null(reply_header(&given, "ETag"));
  reply_free(&stored);
  reply_free(&given);
  free(text);
  size_t count = loopback_store_count(f->loop);
  given = loopback_post(f->loop, "/v1/surface", "model/obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  assert_int_equal(given.status, 200);
  reply_free(&given);
  assert_int_equal(loopback_store_count(f->loop), count);
  assert_problem(loopback_post(f->loop, "/v1/surface", "model/obj", "f 1 2 3\n"), 422, NULL, NULL);
  assert_problem(
      loopback_post(f->loop, "/v1/surface?at=1", "model/obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), 404,
      NULL, "no clips");
}
