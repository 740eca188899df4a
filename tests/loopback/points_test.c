/* surface.bin: the points of a mesh as bytes, and what detail makes of them when they come back. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char two_meshes[] =
    "{'meshes':[{'name':'box','shape':{'kind':'box'}},{'name':'tetra','positions':[[0,0,0],[1,0,0],[0,1,0],"
    "[0,0,1]],'faces':[[0,2,1],[0,1,3],[1,2,3],[2,0,3]]}],'nodes':[{'mesh':'box','translation':[5,0,0],"
    "'scale':[2,-1,1]},{'mesh':'tetra'}]}";

static int setup(void **state) {
  *state = one_model_start(NULL, two_meshes);
  return 0;
}

static reply get(const one_model *f, const char *rest) {
  return model_get(f->loop, f->id, rest);
}

static reply post(const one_model *f, const char *query, const char *type, const void *body, size_t size) {
  char target[160], header[80];
  snprintf(target, sizeof target, "/v1/models/%s/detail?%s", f->id, query);
  snprintf(header, sizeof header, "Content-Type: %s\n", type);
  return loopback_ask(f->loop, "POST", target, header, body, size);
}

static uint32_t u32_at(const reply *r, size_t offset) {
  uint32_t value;
  memcpy(&value, r->body + offset, sizeof value);
  return value;
}

static size_t rows_at(const reply *r) {
  return 12 + u32_at(r, 8);
}

static void move_first(const reply *r, float by) {
  float y;
  memcpy(&y, r->body + rows_at(r) + 4, sizeof y);
  y += by;
  memcpy((char *)r->body + rows_at(r) + 4, &y, sizeof y);
}

/* The id that the reply tells; frees the reply. */
static void take_id(reply r, int status, char out[API_ID_TEXT]) {
  if (r.status != status) fail_msg("%d %s", r.status, r.body);
  cJSON *tree = cJSON_Parse(r.body);
  snprintf(out, API_ID_TEXT, "%s", json_member(tree, "id")->valuestring);
  cJSON_Delete(tree);
  reply_free(&r);
}

TEST_WITH(an_answer_has_a_head_and_rows, setup, fixture_stop) {
  static const struct {
    const char *rest;
    uint32_t stride;
  } cases[] = {{"surface.bin?mesh=box&level=2", 3},
               {"surface.bin?mesh=box&level=2&with=positions", 3},
               {"surface.bin?mesh=box&level=2&with=normals", 6},
               {"surface.bin?mesh=box&level=2&normals=none", 3}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reply r = get(*state, cases[i].rest);
    assert_int_equal(r.status, 200);
    assert_string_equal(reply_header(&r, "Content-Type"), "application/octet-stream");
    assert_string_equal(reply_header(&r, "Accept-Ranges"), "bytes");
    assert_memory_equal(r.body, "TWSB\1\0\0\0", 8);
    assert_int_equal(u32_at(&r, 8) % 4, 0);
    assert_int_equal(r.size, rows_at(&r) + (size_t)98 * cases[i].stride * sizeof(float));
    assert_null(reply_header(&r, "X-Tweend-Warning"));
    reply_free(&r);
  }
}

TEST_WITH(what_is_no_mesh_s_own_is_refused, setup, fixture_stop) {
  const one_model *f = *state;
  assert_problem(get(f, "surface.bin"), 422, NULL, "name one of them as mesh; there are: box, tetra");
  assert_problem(get(f, "surface.bin?mesh=tetr"), 422, NULL, "tetra");
  assert_problem(get(f, "surface.bin?mesh=tetra&with=uvs"), 422, NULL, "no texture coordinates");
  static const char *const bad[] = {"at=1",       "clip=a",      "skin=bake", "meshes=none",
                                    "unit=mm",    "tolerance=1", "with=all",  "with=normals&normals=none",
                                    "shells=true"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char rest[80];
    snprintf(rest, sizeof rest, "surface.bin?mesh=box&%s", bad[i]);
    assert_problem(get(f, rest), 400, NULL, NULL);
  }
  assert_problem(get(f, "surface.glb?mesh=box"), 400, NULL, ".bin");
  assert_problem(get(f, "surface.ply?with=normals"), 400, NULL, ".bin");
}

TEST_WITH(detail_takes_the_bytes_back, setup, fixture_stop) {
  const one_model *f = *state;
  char same[API_ID_TEXT], all[API_ID_TEXT], listed[API_ID_TEXT], world[API_ID_TEXT];
  reply r = get(f, "surface.bin?mesh=box&level=2");
  take_id(post(f, "mesh=box&level=2", "application/octet-stream", r.body, r.size), 200, same);
  assert_string_equal(same, f->id);
  reply_free(&r);
  for (int i = 0; i < 2; i++) { /* further columns are not read */
    r = get(f, i ? "surface.bin?mesh=box&level=2&with=normals" : "surface.bin?mesh=box&level=2");
    float first[3];
    move_first(&r, 0.25f);
    memcpy(first, r.body + rows_at(&r), sizeof first);
    take_id(post(f, "mesh=box&level=2", "application/octet-stream", r.body, r.size), i ? 200 : 201, all);
    char list[200];
    snprintf(list, sizeof list, "{\"space\":\"mesh\",\"indices\":[0],\"positions\":[[%.9g,%.9g,%.9g]]}",
             (double)first[0], (double)first[1], (double)first[2]);
    take_id(post(f, "mesh=box&level=2", "application/json", list, strlen(list)), 200, listed);
    assert_string_equal(listed, all);
    /* The node of the box is moved, and scaled by powers of 2. */
    snprintf(list, sizeof list, "{\"indices\":[3,0,0],\"positions\":[[0,0,0],[9,9,9],[%.9g,%.9g,%.9g]]}",
             2 * (double)first[0] + 5, -(double)first[1], (double)first[2]);
    take_id(post(f, "mesh=box&level=2", "application/json", list, strlen(list)), i ? 200 : 201, world);
    assert_string_not_equal(world, all);
    reply_free(&r);
  }
}

/* Replaces bytes of a good body. */
static void assert_bad(const one_model *f, const char *head, size_t rows, int status, const char *word) {
  uint8_t body[400] = "TWSB\1\0\0\0";
  uint32_t length = (uint32_t)strlen(head);
  memcpy(body + 8, &length, sizeof length);
  memcpy(body + 12, head, length);
  assert_problem(post(f, "mesh=box&level=0", "application/octet-stream", body, 12 + length + rows), status,
                 NULL, word);
}

TEST_WITH(bodies_that_do_not_fit_are_refused, setup, fixture_stop) {
  const one_model *f = *state;
  assert_bad(f, "{\"points\":8,\"stride\":3}", 95, 400, "95 bytes are there");
  assert_bad(f, "{\"points\":8,\"stride\":3}", 100, 400, "100 bytes are there");
  assert_bad(f, "{\"points\":4294967294,\"stride\":64}", 0, 400, "0 bytes are there");
  assert_bad(f, "{\"points\":7,\"stride\":3}", 84, 422, "7 points");
  assert_bad(f, "{\"points\":16,\"stride\":3}", 192, 422, "16 points");
  assert_bad(f, "{\"points\":8,\"stride\":2}", 64, 422, "from 3 to 64");
  assert_bad(f, "{\"points\":8,\"stride\":65}", 64, 422, "from 3 to 64");
  assert_bad(f, "{\"points\":8}", 96, 400, "stride");
  assert_bad(f, "{\"points\":-1,\"stride\":3}", 96, 422, NULL);
  assert_bad(f, "{\"points\":8,\"stride\":3,\"x\":1}", 96, 400, NULL);
  assert_bad(f, "[", 96, 400, NULL);
  assert_bad(f, "", 96, 400, NULL);
  assert_problem(post(f, "mesh=box&level=0", "application/octet-stream", "TWSB\1\0\0\0\xFF\xFF\xFF\xFF", 12),
                 400, NULL, "ends within its head");
  assert_problem(post(f, "mesh=box&level=0", "application/octet-stream", "TWSB\2\0\0\0\0\0\0\0", 12), 400,
                 NULL, "version 2");
  reply r = get(f, "surface.bin?mesh=box&level=0");
  move_first(&r, 2e18f);
  assert_problem(post(f, "mesh=box&level=0", "application/octet-stream", r.body, r.size), 422,
                 "/positions/0/1", NULL);
  assert_problem(post(f, "mesh=box&level=0", "model/obj", r.body, r.size), 400, NULL, NULL);
  reply_free(&r);
}

TEST_WITH(lists_that_do_not_fit_are_refused, setup, fixture_stop) {
  static const struct {
    const char *body, *pointer;
    int status;
  } cases[] = {
      {"{\"indices\":[0],\"positions\":[]}", "/indices", 422},
      {"{\"indices\":[0,98],\"positions\":[[0,0,0],[0,0,0]]}", "/indices/1", 422},
      {"{\"indices\":[-1],\"positions\":[[0,0,0]]}", "/indices/0", 422},
      {"{\"indices\":0,\"positions\":[[0,0,0]]}", "/indices", 400},
      {"{\"indices\":[0],\"positions\":[[0,0,0]],\"space\":\"node\"}", "/space", 400},
      {"{\"indices\":[90,7],\"positions\":[0,0,0,0,0,2e18],\"space\":\"mesh\"}", "/positions/1/2", 422}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_problem(post(*state, "mesh=box&level=2", "application/json", cases[i].body, strlen(cases[i].body)),
                   cases[i].status, cases[i].pointer, NULL);
}
