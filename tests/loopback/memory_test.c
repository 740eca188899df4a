/* Every allocation of a request fails once: the answer is then 503, nothing leaks, nothing is stored,
 * and the next request is answered as ever. What poses allocate does not grow with their number. Linked with
 * malloc, calloc and realloc wrapped. */
#include "flag.h"
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "answer.h"
#include "tweend/base.h"
#include "upload.h"
#include "wrapped_memory.h"

static const char *const key_field[] = {"Authorization", "Bearer k", NULL};
static const api_key keys[] = {{.text = "k", .rights = API_MAY_READ}};
static const api_key url_keys[] = {{.text = "a key that signs"}};
static const api_keyring keyring = {.keys = keys, .count = 1, .url_keys = url_keys, .url_count = 1};

/* For a library that is linked already. */
static int fail_json(void **state) {
  (void)state;
  cJSON_InitHooks(&(cJSON_Hooks){malloc, free});
  return 0;
}

static int mend_json(void **state) {
  (void)state;
  cJSON_InitHooks(NULL);
  return 0;
}

/* context: pairs of names and values, ended by NULL; or NULL. */
static const char *find_field(void *context, const char *name) {
  for (const char *const *pair = context; pair && *pair; pair += 2)
    if (strcasecmp(*pair, name) == 0) return pair[1];
  return strcmp(name, "Content-Length") == 0 ? "100" : NULL;
}

/* Asks with one allocation failing after n others; the body, as far as it comes, is read. Returns the status.
 */
static int ask_failing(api_service *service, api_request *request, size_t n, bool *is_cut_off,
                       bool *has_failed) {
  api_answer answer = {0};
  uint8_t piece[4096];
  *is_cut_off = false;
  test_memory.left = n;
  api_ticket ticket = {0}; /* nobody else asks: it is never woken */
  request->ticket = &ticket;
  if (api_open(service, request, &answer) == API_READ_BODY)
    assert_int_equal(api_handle(service, request, API_HEAVY, &answer), API_ANSWERED);
  int status = answer.status;
  if (status == 503) assert_null(api_answer_find(&answer, "ETag")); /* nor does a cache keep it */
  int64_t count = 0;
  while (answer.body.read && (count = answer.body.read(answer.body.context, piece, sizeof piece)) > 0)
    continue;
  *is_cut_off = count < 0;
  api_answer_deinit(&answer);
  api_ticket_end(service, &ticket);
  *has_failed = test_memory.left == SIZE_MAX;
  test_memory.left = SIZE_MAX;
  return status;
}

/* Fails each allocation of a request in turn (with a stride, others in each call), on a service of its own
 * that has stored one model, or none. */
static void fail_each_with(const char *const *fields, const char *method, const char *path, const char *query,
                           const char *body, const char *stored) {
  const char *type = stored == flag ? "model/gltf+json" : "application/json";
  static size_t called;
  size_t n = called++ % test_stride();
  char *text = body ? quoted(body) : NULL;
  for (bool has_failed = true; has_failed && n < 5000; n += test_stride()) {
    api_settings settings = loopback_settings();
    settings.limits.plan_cache = 0;
    if (fields == key_field) settings.keyring = keyring;
    loopback *loop = loopback_start(&settings);
    char id[API_ID_TEXT] = "", full[128];
    if (stored) loopback_upload(loop, type, stored, id);
    snprintf(full, sizeof full, path, id);
    api_request request = {.method = method,
                           .path = full,
                           .query = query,
                           .id = "request-1",
                           .header = find_field,
                           .context = (void *)fields};
    if (text) request.body = (api_bytes){(const uint8_t *)text, strlen(text)};
    size_t count = loopback_store_count(loop);
    bool is_cut_off, none_failed;
    int status = ask_failing(loop->service, &request, n, &is_cut_off, &has_failed);
    if (has_failed && status != 503 && !is_cut_off && status / 100 != 2)
      fail_msg("%s %s: allocation %zu gives %d", method, full, n, status);
    if (status == 503) assert_int_equal(loopback_store_count(loop), count);
    bool is_gone = status == 204 && strcmp(method, "DELETE") == 0;
    status = ask_failing(loop->service, &request, SIZE_MAX, &is_cut_off, &none_failed);
    if ((is_gone ? status != 404 : status / 100 != 2) || is_cut_off)
      fail_msg("%s %s: afterwards %d", method, full, status);
    loopback_stop(loop);
  }
  free(text);
  print_message("%s %s: %zu allocations\n", method, path, n - 1);
  assert_true(n > 1 && n < 5000);
}

static void fail_each(const char *method, const char *path, const char *query, const char *body,
                      const char *stored) {
  fail_each_with(NULL, method, path, query, body, stored);
}

static const char model[] =
    "{'meshes':[{'name':'m','positions':[[0,0,0],[1,0,0],[1,1,0],[0,1,0]],'faces':[[0,1,2,3]],'uvs':[[0,0],"
    "[1,0],[1,1],[0,1]],'creases':[{'edge':[0,1],'sharpness':2}],'corners':[{'vertex':0,'sharpness':1}]}],"
    "'nodes':[{'name':'n','mesh':'m'}],'clips':[{'name':'c','tracks':[{'node':'n','path':'rotation',"
    "'times':[0,1],'interpolation':'euler','eulers':[[0,0,0],[0,1,0]]}]}]}";

/* Five triangles round a crease that decays. */
static const char fan[] =
    "{'meshes':[{'name':'m','positions':[[0,0,1],[1,0,0],[0,1,0],[-1,0,0],[0,-1,0],[2,2,0]],"
    "'faces':[[0,1,2],[0,2,3],[0,3,4],[0,4,1],[1,5,2]],'creases':[{'edge':[0,1],'sharpness':1}]}]}";

/* A quad of four children, with texture coordinates, a crease and a corner. */
static const char refined[] =
    "{'meshes':[{'name':'m','positions':[[0,0,0],[2,0,0],[2,0,2],[0,0,2],[1,0,0],[2,0,1],[1,0,2],[0,0,1],"
    "[1,0,1]],'faces':[[0,4,8,7],[1,5,8,4],[2,6,8,5],[3,7,8,6]],'uvs':[[0,0],[1,0],[1,1],[0,1],[0.5,0],"
    "[1,0.5],[0.5,1],[0,0.5],[0.5,0.5]],'creases':[{'edge':[0,4],'sharpness':2},{'edge':[4,1],"
    "'sharpness':2}],'corners':[{'vertex':0,'sharpness':1}]}]}";

/* The same, and no surface of its parent. */
static const char dented[] =
    "{'meshes':[{'positions':[[0,0,0],[2,0,0],[2,0,2],[0,0,2],[1,0,0],[2,0,1],[1,0,2],[0,0,1],[1,1,1]],"
    "'faces':[[0,4,8,7],[1,5,8,4],[2,6,8,5],[3,7,8,6]]}]}";

static const char triangle[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nt crease 2/1/0 0 1 2\n";

TEST_WITH(storing_survives, fail_json, mend_json) {
  static const char *const form[] = {"Content-Type", "multipart/form-data; boundary=x", NULL};
  fail_each("POST", "/v1/models", "", model, NULL);
  fail_each("POST", "/v1/models", "", flag, NULL);
  fail_each("POST", "/v1/models", "name=a", triangle, NULL);
  fail_each("POST", "/v1/models", "",
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
            "endfacet\nendsolid\n",
            NULL);
  fail_each(
      "POST", "/v1/models", "",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
      NULL);
  fail_each_with(form, "POST", "/v1/models", "",
                 "--x\r\nContent-Disposition: form-data; name=\"file\"; filename=\"a.obj\"\r\n\r\n"
                 "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\r\n--x--\r\n",
                 NULL);
  fail_each_with(
      form, "POST", "/v1/models", "",
      "--x\r\nContent-Disposition: form-data; name='a'; filename='a.gltf'\r\n\r\n{'asset':{'version':"
      "'2.0'},'buffers':[{'uri':'a.bin','byteLength':4}]}\r\n--x\r\nContent-Disposition:"
      " form-data; name='b'; filename='a.bin'\r\n\r\nabcd\r\n--x--\r\n",
      NULL);
}

TEST_WITH(deleting_and_handing_back_survive, fail_json, mend_json) {
  fail_each("DELETE", "/v1/models/%s", "", NULL, model);
  fail_each("GET", "/v1/models/%s/source", "", NULL, model);
  fail_each("OPTIONS", "/v1/models", "", NULL, NULL);
}

TEST_WITH(operations_survive, fail_json, mend_json) {
  static const char *const packed[] = {"Accept-Encoding", "gzip", NULL};
  static const char *const zstd[] = {"Accept-Encoding", "zstd", NULL};
  fail_each("GET", "/version", "", NULL, NULL);
  fail_each("GET", "/openapi.json", "", NULL, NULL);
  fail_each_with(packed, "GET", "/openapi.json", "", NULL, NULL);
  fail_each_with(zstd, "GET", "/openapi.json", "", NULL, NULL);
  fail_each_with(key_field, "POST", "/v1/sign", "", "{'url':'/v1/models?limit=1'}", NULL);
}

TEST_WITH(describing_survives, fail_json, mend_json) {
  fail_each("GET", "/v1/models/%s", "", NULL, model);
  fail_each("GET", "/v1/models", "", NULL, model);
  fail_each("GET", "/v1/models/%s/tracks", "", NULL, model);
}

TEST_WITH(surfaces_survive, fail_json, mend_json) {
  fail_each("GET", "/v1/models/%s/surface.json", "", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.obj", "at=1", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.glb", "clip=c&tolerance=1", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.obj", "at=1&skin=bake", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.glb", "at=1&skin=bake&level=3", NULL, flag);
  fail_each("GET", "/v1/models/%s/surface.gltf", "at=1&meshes=none", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.glb", "level=2&encoding=quantized", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.glb", "level=1&encoding=meshopt", NULL, flag);
  fail_each("GET", "/v1/models/%s/surface.glb", "level=1&polygons=ngon&creases=auto&weld=auto", NULL, flag);
  fail_each("GET", "/v1/models/%s/levels.json", "clip=c", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.stl", "at=1", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.ply", "polygons=ngon", NULL, flag);
  fail_each("GET", "/v1/models/%s/surface.3mf", "at=1", NULL, model);
  fail_each("GET", "/v1/models/%s/surface.bin", "with=normals,uvs", NULL, model);
  fail_each("POST", "/v1/surface.obj", "level=2", model, NULL);
  fail_each("POST", "/v1/surface.obj", "scheme=loop&level=4&normals=none", fan, NULL);
  fail_each("POST", "/v1/surface.obj", "scheme=loop&level=2&normals=none", fan, NULL);
  fail_each("POST", "/v1/surface.obj", "scheme=loop&level=3", fan, NULL);
}

TEST_WITH(poses_survive, fail_json, mend_json) {
  fail_each("GET", "/v1/models/%s/pose.json", "at=0,1&as=euler", NULL, model);
  fail_each("GET", "/v1/models/%s/pose.bin", "fps=10000&nodes=n", NULL, model);
  fail_each("GET", "/v1/models/%s/live", "as=euler", NULL, model);
  fail_each("POST", "/v1/models/%s/pose.csv", "", "{'times':[0,1,2]}", model);
  fail_each("GET", "/v1/models/%s/pose.bvh", "fps=10", NULL, model);
}

TEST_WITH(editing_survives, fail_json, mend_json) {
  fail_each("POST", "/v1/models/%s/edits", "",
            "{'mesh':'m','edits':[{'edit':'extrude','faces':[0],'distance':1,'name':'a'},"
            "{'edit':'hole','faces':{'made':'a'}}]}",
            model);
  fail_each("POST", "/v1/models/%s/coarsen", "", "", refined);
  fail_each("POST", "/v1/models/%s/detail", "level=1",
            "{'positions':[[0,0,0],[1,0,0],[1,1,0],[0,1,0],[0,0,1],[1,0,1],[1,1,1],[0,1,1],[0.5,0.5,2]]}",
            model);
  fail_each("POST", "/v1/models/%s/detail", "level=1", "{'indices':[0],'positions':[0,0.1,0]}", model);
  fail_each("POST", "/v1/models/%s/detail", "level=0", "{'positions':[0,0,0,1,0,0,1,1,0,0,1,0]}", model);
  fail_each("POST", "/v1/models/%s/coarsen", "", "", dented);
  fail_each("GET", "/v1/models/%s/surface.glb", "level=0&polygons=ngon", NULL, model);
}

TEST_WITH(rotations_survive, fail_json, mend_json) {
  fail_each("POST", "/v1/rotations", "",
            "{'rotations':[{'euler':[0,1,0]},{'quaternion':[0,0,0,1]}],'points':[[1,0,0]],'slerp':[0.5]}",
            NULL);
}

TEST_WITH(seeding_survives, fail_json, mend_json) {
  static char name[1 << 17]; /* too long for what the model's arena has left */
  int status = 0;
  memset(name, 'a', sizeof name - 1);
  for (size_t n = 0; status != 201; n++) {
    api_settings settings = loopback_settings();
    loopback *loop = loopback_start(&settings);
    test_memory.left = n;
    status = api_seed(loop->service, name, (const uint8_t *)triangle, strlen(triangle));
    test_memory.left = SIZE_MAX;
    assert_true(status == 201 || status == 503);
    assert_int_equal(loopback_store_count(loop), status == 201);
    loopback_stop(loop);
  }
}

TEST_WITH(a_model_that_is_not_read_is_left_alone, fail_json, mend_json) {
  const api_reading reading = {.weld = TW_WELD_EXACT};
  const api_bytes bytes = {(const uint8_t *)triangle, strlen(triangle)};
  tw_model *model = NULL;
  bool is_read = false;
  for (size_t n = 0; !is_read; n++) {
    api_fault fault = {0};
    test_memory.left = n;
    is_read = api_model_read(bytes, TW_FORMAT_OBJ, reading, NULL, &model, &fault);
    test_memory.left = SIZE_MAX;
    assert_true(is_read ? model != NULL : !model && fault.status == 503);
  }
  tw_model_destroy(model);
}

/* A refusal takes memory as well: the answer is the refusal, or 503. */
TEST_WITH(refusing_survives, fail_json, mend_json) {
  static const char *const documents[] = {
      "{'asset':{'version':'2.0'},'nodes':[{'name':'no short name at all','children':[7]}]}",
      "{'asset':{'version':'2.0'},'nodes':[{'children':{}}],'meshes':[1]}",
      "{'meshes':[{'positions':[[0,0]]}]}", "v 0 0 0\nf 1 2 3\n"};
  for (size_t i = 0; i < sizeof documents / sizeof *documents; i++) {
    bool has_failed = true;
    char *text = quoted(documents[i]);
    for (size_t n = 0; has_failed; n++) {
      api_settings settings = loopback_settings();
      loopback *loop = loopback_start(&settings);
      api_request request = {.method = "POST",
                             .path = "/v1/models",
                             .query = "",
                             .id = "request-1",
                             .header = find_field,
                             .body = {(const uint8_t *)text, strlen(text)}};
      bool is_cut_off;
      int status = ask_failing(loop->service, &request, n, &is_cut_off, &has_failed);
      if (has_failed ? status != 400 && status != 422 && status != 503 : status != 400 && status != 422)
        fail_msg("%s: allocation %zu gives %d", documents[i], n, status);
      assert_int_equal(loopback_store_count(loop), 0);
      loopback_stop(loop);
    }
    free(text);
  }
}

/* Bytes that a request asks for in all until its answer is read, once the model is known. */
static size_t allocation_of(loopback *loop, const char *path, const char *query) {
  api_request request = {
      .method = "GET", .path = path, .query = query, .id = "request-1", .header = find_field};
  bool is_cut_off, has_failed;
  size_t before = test_memory.asked;
  assert_int_equal(ask_failing(loop->service, &request, SIZE_MAX, &is_cut_off, &has_failed), 200);
  assert_false(is_cut_off);
  return test_memory.asked - before;
}

TEST_WITH(many_poses_allocate_no_more_than_some, fail_json, mend_json) {
  static const char *const forms[] = {"json", "ndjson", "csv", "bin"};
  api_settings settings = loopback_settings();
  settings.limits.max_times = 1000000;
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT], path[64];
  loopback_upload(loop, "application/json", model, id);
  for (int i = 0; i < 4; i++) {
    snprintf(path, sizeof path, "/v1/models/%s/pose.%s", id, forms[i]);
    allocation_of(loop, path, "from=0&to=1&fps=1000");
    size_t some = allocation_of(loop, path, "from=0&to=1&fps=30000&space=world");
    size_t many = allocation_of(loop, path, "from=0&to=1&fps=300000&space=world");
    print_message("pose.%s: %zu bytes for 30,001 poses, %zu for 300,001\n", forms[i], some, many);
    assert_true(some > 0 && many < some + 1024);
  }
  loopback_stop(loop);
}
