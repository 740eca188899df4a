/* Surfaces: counts, forms, sizes, ranges, limits, posed and animated scenes, refusals. */
#include "loopback.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct fixture {
  loopback *loop;
  char cube[API_ID_TEXT], tank[API_ID_TEXT];
} fixture;

static fixture *start(const api_settings *settings) {
  fixture *f = calloc(1, sizeof *f);
  f->loop = loopback_start(settings);
  loopback_upload_sample(f->loop, "model/obj", "cube.obj", f->cube);
  loopback_upload_sample(f->loop, "application/json", "tank.json", f->tank);
  return f;
}

static int setup(void **state) {
  api_settings settings = loopback_settings();
  *state = start(&settings);
  return 0;
}

/* The JSON chunk of a GLB. */
static cJSON *glb_json(const reply *r) {
  assert_true(r->size > 20);
  assert_memory_equal(r->body, "glTF", 4);
  const unsigned char *b = (const unsigned char *)r->body + 12;
  size_t length = b[0] | (size_t)b[1] << 8 | (size_t)b[2] << 16 | (size_t)b[3] << 24;
  cJSON *tree = cJSON_ParseWithLength(r->body + 20, length);
  assert_non_null(tree);
  return tree;
}

TEST_WITH(bad_parameters_are_400, setup, fixture_stop) {
  fixture *f = *state;
  const char *const bad[] = {"level=x",
                             "level=-1",
                             "level=1.5",
                             "level=",
                             "level=1&level=1",
                             "level=%31%",
                             "scheme=doo-sabin",
                             "boundary=",
                             "uv=smooth",
                             "creasing=x",
                             "triangles=x",
                             "quads=yes",
                             "limit=1",
                             "normals=flat",
                             "skin=no",
                             "encoding=x",
                             "polygons=quads",
                             "levl=1",
                             "at=x&clip=drive",
                             "from=0",
                             "at=1&fps=2",
                             "fps=0&clip=drive",
                             "level=1e1",
                             "level=+1",
                             "limit=TRUE",
                             "creases=x",
                             "creases=angle",
                             "creases=angle:",
                             "creases=angle:x",
                             "creases=angle:-1",
                             "creases=angle:181",
                             "weld=x",
                             "weld=0",
                             "weld=-1",
                             "weld=1e19",
                             "weld=",
                             "crease_sharpness=x",
                             "crease_sharpness=-1",
                             "crease_sharpness=10.5"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char rest[128];
    snprintf(rest, sizeof rest, "surface.glb?%s", bad[i]);
    reply r = model_get(f->loop, f->tank, rest);
    if (r.status != 400) fail_msg("%s: %d %s", bad[i], r.status, r.body);
    assert_problem(r, 400, NULL, NULL);
  }
  assert_problem(model_get(f->loop, f->cube, "surface.glb?levl=1"), 400, NULL, "creasing");
}

TEST_WITH(what_this_version_lacks_is_422, setup, fixture_stop) {
  fixture *f = *state;
  assert_problem(model_get(f->loop, f->cube, "surface.obj?scheme=loop"), 422, NULL, "triangles");
}

TEST_WITH(names_that_are_not_there_are_404, setup, fixture_stop) {
  fixture *f = *state;
  assert_problem(model_get(f->loop, f->tank, "surface?clip=dance"), 404, NULL, "drive");
  assert_problem(model_get(f->loop, f->cube, "surface?clip=drive"), 404, NULL, "no clips");
  assert_problem(model_get(f->loop, f->cube, "surface?at=1"), 404, NULL, "no clips");
  assert_problem(model_get(f->loop, f->cube, "surface.fbx"), 404, NULL, NULL);
  assert_problem(model_get(f->loop, "00000000000000000000000000000000", "surface"), 404, NULL, NULL);
}

TEST_WITH(counts_are_exact_and_cost_no_surface, setup, fixture_stop) {
  fixture *f = *state;
  static const int expected[][4] = {
      {0, 8, 12, 6}, {1, 26, 48, 24}, {2, 98, 192, 96}, {10, 6291458, 12582912, 6291456}};
  for (size_t i = 0; i < sizeof expected / sizeof *expected; i++) {
    char rest[64];
    snprintf(rest, sizeof rest, "surface.json?level=%d", expected[i][0]);
    cJSON *counts = model_get_json(f->loop, f->cube, rest);
    const cJSON *both[] = {counts, json_member(counts, "meshes")->child};
    for (int j = 0; j < 2; j++) {
      assert_int_equal(json_member(both[j], "level")->valueint, expected[i][0]);
      assert_int_equal(json_member(both[j], "vertices")->valueint, expected[i][1]);
      assert_int_equal(json_member(both[j], "edges")->valueint, expected[i][2]);
      assert_int_equal(json_member(both[j], "faces")->valueint, expected[i][3]);
      assert_true(json_member(both[j], "bytes")->valuedouble > 0);
    }
    cJSON_Delete(counts);
  }
  cJSON *counts = model_get_json(f->loop, f->tank, "surface.json?level=2");
  assert_int_equal(cJSON_GetArraySize(json_member(counts, "meshes")), 5);
  int faces = 0;
  const cJSON *mesh;
  cJSON_ArrayForEach(mesh, json_member(counts, "meshes")) faces += json_member(mesh, "faces")->valueint;
  assert_int_equal(json_member(counts, "faces")->valueint, faces);
  cJSON_Delete(counts);
}

TEST_WITH(bytes_are_those_of_the_glb, setup, fixture_stop) {
  fixture *f = *state;
  const char *const options[] = {"",
                                 "?level=0",
                                 "?level=4",
                                 "?normals=none",
                                 "?polygons=ngon",
                                 "?clip=drive",
                                 "?clip=aim&at=1",
                                 "?clip=drive&from=0&fps=10",
                                 "?scheme=bilinear"};
  for (size_t i = 0; i < sizeof options / sizeof *options; i++) {
    char rest[96];
    snprintf(rest, sizeof rest, "surface.json%s", options[i]);
    cJSON *counts = model_get_json(f->loop, f->tank, rest);
    snprintf(rest, sizeof rest, "surface.glb%s", options[i]);
    reply r = model_get_ok(f->loop, f->tank, rest);
    assert_int_equal(r.size, (size_t)json_member(counts, "bytes")->valuedouble);
    assert_int_equal(r.size, r.answer.body.size);
    assert_string_equal(reply_header(&r, "Content-Type"), "model/gltf-binary");
    reply_free(&r);
    cJSON_Delete(counts);
  }
}

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

/* The greatest coordinate of an answer's points. */
static double reach(const fixture *f, const char *rest) {
  reply r = model_get_ok(f->loop, f->cube, rest);
  double greatest = 0;
  for (const char *line = r.body; line; line = strchr(line, '\n')) {
    double p[3];
    if (*line == '\n') line++;
    if (sscanf(line, "v %lf %lf %lf", &p[0], &p[1], &p[2]) != 3) continue;
    for (int i = 0; i < 3; i++) greatest = fmax(greatest, fabs(p[i]));
  }
  reply_free(&r);
  return greatest;
}

TEST_WITH(creases_hold_the_corners_of_a_cube, setup, fixture_stop) {
  fixture *f = *state;
  double smooth = reach(f, "surface.obj?level=3");
  assert_true(smooth < 0.85);
  assert_true(reach(f, "surface.obj?level=3&creases=none") == smooth);
  assert_true(reach(f, "surface.obj?level=3&creases=normals") == smooth); /* the file has none */
  assert_true(reach(f, "surface.obj?level=3&creases=auto") == 1);
  assert_true(reach(f, "surface.obj?level=3&creases=angle:89") == 1);
  assert_true(reach(f, "surface.obj?level=3&creases=angle:91") == smooth);
  double soft = reach(f, "surface.obj?level=3&creases=angle:30&crease_sharpness=0.5");
  assert_true(soft > smooth && soft < 1);
}

/* Two squares that are cut apart, and a third one a hand's breadth away. */
TEST_WITH(welding_joins_what_it_is_told_to, setup, fixture_stop) {
  static const char obj[] =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 2.1 0 0\n"
      "v 3 0 0\nv 3 1 0\nv 2.1 1 0\nv 0 0 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3 4\nf 5 6 7 8\n"
      "f 9 10 11 12\nf 13 14 15\n"; /* the triangle touches in a point */
  static const struct {
    const char *weld;
    int vertices;
  } cases[] = {{"", 13}, {"&weld=auto", 13}, {"&weld=exact", 12}, {"&weld=0.2", 10}, {"&weld=none", 15}};
  fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj", obj, id);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char rest[64];
    snprintf(rest, sizeof rest, "surface.json?level=0%s", cases[i].weld);
    cJSON *counts = model_get_json(f->loop, id, rest);
    assert_int_equal(json_member(counts, "vertices")->valueint, cases[i].vertices);
    cJSON_Delete(counts);
  }
}

/* The same squares, each point with a texture coordinate of its own: points become one, these do not. */
TEST_WITH(welding_leaves_texture_coordinates_of_points, setup, fixture_stop) {
  static const char model[] =
      "{'meshes':[{'positions':[[0,0,0],[1,0,0],[1,1,0],[0,1,0],[1,0,0],[2,0,0],[2,1,0],[1,1,0]],"
      "'faces':[[0,1,2,3],[4,5,6,7]],'uvs':[[0,0],[0.5,0],[0.5,1],[0,1],[0.6,0],[1,0],[1,1],[0.6,1]]}]}";
  fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "application/json", model, id);
  reply r = model_get_ok(f->loop, id, "surface.obj?level=0&weld=exact&normals=none");
  assert_says(&r, "\nf 1/1 2/2 3/4 4/6\nf 2/3 5/7 6/8 3/5\n");
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

static const char turning_sheet[] =
    "{\"meshes\":[{\"name\":\"m\",\"shape\":{\"kind\":\"grid\",\"size\":[2,2],\"segments\":[2,2]}}],"
    "\"nodes\":[{\"name\":\"n\",\"mesh\":\"m\"}],\"clips\":[{\"name\":\"c\",\"tracks\":[{\"node\":\"n\","
    "\"path\":\"translation\",\"times\":[0,1],\"values\":[[0,0,0],[1,0,0]]}]}]}";

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

TEST_WITH(sizes_are_told_of_forms_that_answer, setup, fixture_stop) {
  fixture *f = *state;
  static const char *const queries[] = {"clip=none", "clip=c",      "clip=c&at=1", "at=0,1",
                                        "at=1",      "fps=3",       "tolerance=1", "skin=bake&at=1",
                                        "scale=1",   "meshes=none", "limit=true",  "skin=bake&clip=none"};
  static const char *const forms[] = {"stl", "ply", "glb", "gltf", "bin"};
  char id[API_ID_TEXT], rest[96];
  loopback_upload(f->loop, "application/json", turning_sheet, id);
  for (size_t q = 0; q < 2 * sizeof queries / sizeof *queries; q++) {
    const char *query = queries[q / 2];
    bool has_scale = strcmp(query, "scale=1") == 0, has_shells = q % 2 == 1;
    snprintf(rest, sizeof rest, "surface.json?%s%s", query, has_shells ? "&shells=true" : "");
    reply counts = model_ask(f->loop, "GET", id, rest, NULL);
    cJSON *json = cJSON_ParseWithLength(counts.body, counts.size), *told = cJSON_GetObjectItem(json, "forms");
    for (size_t i = 0; counts.status == 200 && i < sizeof forms / sizeof *forms; i++) {
      if (has_scale && i > 1) continue;
      if (has_shells && (i == 2 || i == 3)) continue; /* these are told without clips */
      snprintf(rest, sizeof rest, "surface.%s?%s", forms[i], query);
      reply r = model_ask(f->loop, "GET", id, rest, NULL);
      const cJSON *size = cJSON_GetObjectItem(told, forms[i]);
      if ((r.status == 200) != (size != NULL)) fail_msg("%s: %d", rest, r.status);
      if (size) assert_true(size->valuedouble == (double)r.size);
      reply_free(&r);
    }
    if (!has_shells) assert_int_equal(counts.status, 200);
    cJSON_Delete(json);
    reply_free(&counts);
  }
}

TEST_WITH(equal_questions_have_one_tag_and_one_answer, setup, fixture_stop) {
  fixture *f = *state;
  static const struct {
    const char *one, *other;
    bool is_same;
  } pairs[] = {
      {"surface", "surface.glb?level=1&scheme=catmull-clark&limit=false&quads=ngon&polygons=triangles", true},
      {"surface", "surface?boundary=edge-and-corner&uv=corners-only&creasing=uniform&triangles=catmull-clark",
       true},
      {"surface", "surface?creasing=chaikin", false},
      {"levels.json", "levels.json?boundary=edge-and-corner&quads=ngon", true},
      {"levels.json", "levels.json?boundary=edge-only", false},
      {"levels.json", "levels.json?clip=drive,aim", true},
      {"levels.json", "levels.json?clip=drive", false},
      {"levels.json", "levels.json?clip=none", false},
      {"levels.json?clip=drive", "levels.json?clip=aim", false},
      {"levels.json?root_motion=hull", "levels.json?root_motion=turret", false},
      {"surface.ply", "surface.ply?unit=m&scale=1", true},
      {"surface?level=auto", "surface?level=auto&error=0.1%25&faces=200000", true},
      {"surface?level=auto", "surface?level=auto&error=0.1%25", false},
      {"surface?level=auto&faces=200000", "surface?level=auto", false},
      {"surface", "surface?influences=4&details=false", true},
      {"surface.stl", "surface.stl?uv=corners-only", true},
      {"surface?clip=drive&at=1", "surface?at=1.0", true},
      {"surface?level=01", "surface?level=1", true},
      {"surface", "surface?level=2", false},
      {"surface", "surface.gltf", false},
      {"surface", "surface?clip=drive", false},
      {"surface?clip=drive", "surface?clip=aim", false},
      {"surface?clip=drive&at=1", "surface?clip=drive&at=2", false},
      {"surface?normals=auto", "surface?normals=limit", true},
      {"surface?level=0&normals=auto", "surface?level=0", true},
      {"surface?level=0&limit=true", "surface?level=0&limit=true&normals=limit", true},
      {"surface?level=0", "surface?level=0&normals=limit", false},
      {"surface", "surface?creases=file&crease_sharpness=infinite", true},
      {"surface?creases=tags", "surface?creases=tags&crease_sharpness=2", true},
      {"surface?creases=auto", "surface?crease_sharpness=infinite&creases=auto", true},
      {"surface?creases=auto&crease_sharpness=10", "surface?creases=auto", true},
      {"surface", "surface?weld=auto", true},
      {"surface?weld=0.5", "surface?weld=0.50", true},
      {"surface?weld=exact", "surface?weld=none", false},
      {"surface?weld=0.5", "surface?weld=0.25", false},
      {"surface", "surface?creases=none", false},
      {"surface?creases=auto", "surface?creases=normals", false},
      {"surface?creases=angle:30", "surface?creases=angle:31", false},
      {"surface?creases=auto", "surface?creases=auto&crease_sharpness=2", false},
      {"surface", "surface?normals=none", false}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++) {
    reply a = model_get_ok(f->loop, f->tank, pairs[i].one),
          b = model_get_ok(f->loop, f->tank, pairs[i].other);
    bool is_same = strcmp(reply_header(&a, "ETag"), reply_header(&b, "ETag")) == 0;
    if (is_same != pairs[i].is_same) fail_msg("%s, %s", pairs[i].one, pairs[i].other);
    if (is_same) {
      assert_int_equal(a.size, b.size);
      assert_memory_equal(a.body, b.body, a.size);
    }
    char header[128];
    snprintf(header, sizeof header, "If-None-Match: %s\n", reply_header(&a, "ETag"));
    reply c = model_ask(f->loop, "GET", f->tank, pairs[i].one, header);
    assert_int_equal(c.status, 304);
    assert_int_equal(c.size, 0);
    reply_free(&a);
    reply_free(&b);
    reply_free(&c);
  }
}

TEST_WITH(asking_for_what_tags_say_is_not_asking, setup, fixture_stop) {
  fixture *f = *state;
  static const char *const queries[] = {"surface.glb", "surface.glb?boundary=edge-only",
                                        "surface.glb?boundary=none"};
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 2 5 6 3\n"
                  "t interpolateboundary 1/0/0 2\n",
                  id);
  reply replies[3];
  for (int i = 0; i < 3; i++) replies[i] = model_get_ok(f->loop, id, queries[i]);
  assert_string_equal(reply_header(&replies[0], "ETag"), reply_header(&replies[1], "ETag"));
  assert_string_not_equal(reply_header(&replies[0], "ETag"), reply_header(&replies[2], "ETag"));
  for (int i = 0; i < 3; i++) reply_free(&replies[i]);
}

TEST_WITH(what_is_built_is_answered_lightly, setup, fixture_stop) {
  fixture *f = *state;
  char target[96];
  snprintf(target, sizeof target, "/v1/models/%s/surface.glb?level=3", f->cube);
  assert_false(loopback_is_light(f->loop, target));
  reply r = loopback_get(f->loop, target);
  reply_free(&r);
  assert_true(loopback_is_light(f->loop, target));
  r = model_ask(f->loop, "DELETE", f->cube, "", NULL);
  reply_free(&r);
  assert_problem(loopback_get(f->loop, target), 404, NULL, NULL);
}

/* ---- clips ----------------------------------------------------------------------------------------- */

static const cJSON *find_named(const cJSON *array, const char *name) {
  const cJSON *item;
  cJSON_ArrayForEach(item, array) {
    const char *found = cJSON_GetStringValue(cJSON_GetObjectItem(item, "name"));
    if (found && strcmp(found, name) == 0) return item;
  }
  fail_msg("nothing is called %s", name);
  return NULL;
}

TEST_WITH(one_time_poses_the_nodes, setup, fixture_stop) {
  fixture *f = *state;
  cJSON *poses = model_get_json(f->loop, f->tank, "pose?clip=drive&at=1.7&nodes=turret");
  reply r = model_get_ok(f->loop, f->tank, "surface.glb?clip=drive&at=1.7&level=0");
  cJSON *scene = glb_json(&r);
  assert_null(cJSON_GetObjectItem(scene, "animations"));
  const cJSON *turret = find_named(json_member(scene, "nodes"), "turret");
  const cJSON *expected = json_member(json_member(poses, "poses")->child, "rotation")->child;
  for (int i = 0; i < 4; i++)
    assert_true(fabs(cJSON_GetArrayItem(json_member(turret, "rotation"), i)->valuedouble -
                     cJSON_GetArrayItem(expected, i)->valuedouble) < 1e-6);
  cJSON_Delete(scene);
  cJSON_Delete(poses);
  reply_free(&r);
}

TEST_WITH(a_clip_alone_is_kept_as_animation, setup, fixture_stop) {
  fixture *f = *state;
  reply r = model_get_ok(f->loop, f->tank, "surface.glb?clip=aim&level=0");
  cJSON *scene = glb_json(&r);
  const cJSON *animation = json_member(scene, "animations")->child;
  assert_string_equal(json_member(animation, "name")->valuestring, "aim");
  assert_null(animation->next);
  cJSON_Delete(scene);
  reply_free(&r);
}

TEST_WITH(several_times_are_the_keys_of_the_animation, setup, fixture_stop) {
  fixture *f = *state;
  const char *const queries[] = {"clip=aim&at=0,0.5,2", "clip=aim&from=0&to=1&fps=2"};
  for (int i = 0; i < 2; i++) {
    char rest[96];
    snprintf(rest, sizeof rest, "surface.glb?level=0&%s", queries[i]);
    reply r = model_get_ok(f->loop, f->tank, rest);
    cJSON *scene = glb_json(&r);
    const cJSON *animation = json_member(scene, "animations")->child;
    assert_string_equal(json_member(animation, "name")->valuestring, "aim");
    int input = json_member(json_member(animation, "samplers")->child, "input")->valueint;
    const cJSON *accessor = cJSON_GetArrayItem(json_member(scene, "accessors"), input);
    assert_int_equal(json_member(accessor, "count")->valueint, 3);
    cJSON_Delete(scene);
    reply_free(&r);
  }
  assert_problem(model_get(f->loop, f->tank, "surface.glb?clip=aim&at=1,0"), 422, NULL, NULL);
}

/* Whether a GLB was made before or not; the same for the whole and for the only mesh. */
TEST_WITH(counts_have_the_bytes_of_the_glb_in_every_encoding, setup, fixture_stop) {
  fixture *f = *state;
  static const char *const options[] = {"encoding=meshopt", "encoding=quantized", "encoding=float",
                                        "encoding=meshopt&polygons=ngon&level=2"};
  for (size_t i = 0; i < sizeof options / sizeof *options; i++) {
    char counts[80], glb[80];
    snprintf(counts, sizeof counts, "surface.json?%s", options[i]);
    snprintf(glb, sizeof glb, "surface.glb?%s", options[i]);
    reply early = model_get_ok(f->loop, f->tank, counts), whole = model_get_ok(f->loop, f->tank, glb),
          late = model_get_ok(f->loop, f->tank, counts);
    assert_string_equal(early.body, late.body);
    assert_string_equal(reply_header(&early, "ETag"), reply_header(&late, "ETag"));
    cJSON *tree = cJSON_Parse(early.body);
    assert_int_equal(json_member(tree, "bytes")->valueint, whole.size);
    assert_true(json_member(json_member(tree, "meshes")->child, "bytes")->valueint > 0);
    cJSON_Delete(tree);
    reply given = loopback_post(f->loop, i ? "/v1/surface.json" : "/v1/surface.json?encoding=meshopt",
                                "model/obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_int_equal(given.status, 200);
    assert_false(reply_says(&given, "null,'meshes'"));
    reply_free(&given);
    reply_free(&early);
    reply_free(&whole);
    reply_free(&late);
  }
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

TEST_WITH(a_borrowed_clip_animates_what_it_can, setup, fixture_stop) {
  fixture *f = *state;
  char rest[128];
  snprintf(rest, sizeof rest, "surface.glb?clip=%s/aim&level=0", f->tank);
  reply r = model_get_ok(f->loop, f->cube, rest);
  assert_non_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
}

/* The file has one, and the borrowed clip moves two nodes that are not there. */
TEST_WITH(a_surface_tells_the_warnings_of_its_model, setup, fixture_stop) {
  fixture *f = *state;
  static const char text[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 1 2\n";
  char id[API_ID_TEXT], rest[128];
  loopback_upload(f->loop, "model/obj", text, id);
  static const char *const forms[] = {"surface.glb", "surface.gltf", "surface.obj", "surface.json"};
  char first[400];
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    reply r = model_get_ok(f->loop, id, forms[i]);
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    assert_memory_equal(warning, "1; ", 3);
    snprintf(first, sizeof first, "%s", warning + 3);
    reply_free(&r);
  }
  reply given = loopback_post(f->loop, "/v1/surface.glb", "model/obj", text);
  assert_string_equal(reply_header(&given, "X-Tweend-Warning") + 3, first);
  reply_free(&given);
  snprintf(rest, sizeof rest, "surface.glb?clip=%s/aim&level=0", f->tank);
  reply r = model_get_ok(f->loop, id, rest);
  int count = atoi(reply_header(&r, "X-Tweend-Warning"));
  assert_true(count > 1);
  assert_string_equal(strchr(reply_header(&r, "X-Tweend-Warning"), ' ') + 1, first);
  reply_free(&r);
}

/* ---- bodies, tags, limits --------------------------------------------------------------------------- */

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

TEST_WITH(a_tag_counts_until_the_query_says_otherwise, setup, fixture_stop) {
  fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nt interpolateboundary 1/0/0 2\n", id);
  reply tagged = model_get_ok(f->loop, id, "surface.obj?level=1");
  reply same = model_get_ok(f->loop, id, "surface.obj?level=1&boundary=edge-only");
  reply other = model_get_ok(f->loop, id, "surface.obj?level=1&boundary=edge-and-corner");
  assert_string_equal(tagged.body, same.body);
  assert_string_not_equal(tagged.body, other.body);
  assert_says(&other, "v 0 0 0\n");
  reply_free(&tagged);
  reply_free(&same);
  reply_free(&other);
}

static void assert_predicted(reply r, int faces, bool has_bytes) {
  cJSON *problem = cJSON_Parse(r.body);
  const cJSON *predicted = json_member(problem, "predicted");
  assert_int_equal(json_member(predicted, "faces")->valueint, faces);
  assert_int_equal(json_member(predicted, "edges")->valueint, 2 * faces);
  assert_int_equal(json_member(predicted, "vertices")->valueint, faces + 2);
  assert_int_equal(cJSON_GetObjectItem(predicted, "bytes") != NULL, has_bytes);
  cJSON_Delete(problem);
  assert_problem(r, 422, NULL, NULL);
}

/* ---- tags of an OBJ of level 0 ---- */

static const char tagged_scene[] =
    "{'meshes': [{'name': 'box', 'positions': [[9,9,9], [-1,-1,-1], [1,-1,-1], [1,1,-1], [-1,1,-1], [-1,-1,"
    "1], [1,-1,1], [1,1,1], [-1,1,1]], 'faces': [[1,4,3,2], [5,6,7,8], [1,2,6,5], [2,3,7,6], [3,4,8,7], [4,"
    "1,5,8]], 'creases': [{'edge': [1,2], 'sharpness': 2.5}, {'edge': [6,5], 'sharpness': 10}],"
    " 'corners': [{'vertex': 7, 'sharpness': 1.25}]},{'name': 'sheet', 'positions': [[5,0,0], [6,0,0], [7,"
    "0,0], [5,1,0], [6,1,0.5], [7,1,0], [5,2,0], [6,2,1], [7,2,0]], 'faces': [[0,1,4,3], [1,2,5,4], [3,4,7,"
    "6], [4,5,8,7]], 'creases': [{'edge': [4,1], 'sharpness': 1.5}]}],"
    "'nodes': [{'mesh': 'sheet', 'translation': [-5,0,2]}, {'mesh': 'box', 'rotation': [0.5,0.5,0.5,0.5]},"
    " {'mesh': 'box', 'translation': [0,2,0], 'scale': [1,1,-1]}]}";

/* The next line of a text that begins so, from its line feed on. (A sanitizer measures the rest of the text
 * at each strstr.) */
static const char *find_line(const char *at, const char *begin) {
  while ((at = strchr(at, '\n')) && strncmp(at + 1, begin, strlen(begin)) != 0) at++;
  return at;
}

/* The points of an OBJ; freed by the caller. */
static size_t obj_points(const char *text, double (**out)[3]) {
  size_t count = 0;
  *out = malloc((strlen(text) / 8 + 1) * sizeof **out);
  assert_non_null(*out);
  for (const char *line = text; (line = find_line(line, "v ")); line++) {
    char *at = (char *)(uintptr_t)line + 2;
    for (int c = 0; c < 3; c++) (*out)[count][c] = strtod(at, &at);
    count++;
  }
  return count;
}

static size_t count_lines(const char *text, const char *begin) {
  size_t count = 0;
  for (const char *line = text; (line = find_line(line, begin)); line++) count++;
  return count;
}

static int compare_x(const void *left, const void *right) {
  const double *a = left, *b = right;
  return (a[0] > b[0]) - (a[0] < b[0]);
}

/* Each point has one of the other text where it is, within 1e-6 of the model's size: nodes round points.
 * Several meshes come back as one: their order may differ.
 */
static void assert_same_points(const char *left, const char *right) {
  double(*a)[3], (*b)[3];
  size_t count = obj_points(left, &a);
  assert_int_equal(count, obj_points(right, &b));
  const double rounding = 2e-6;
  qsort(a, count, sizeof *a, compare_x);
  qsort(b, count, sizeof *b, compare_x);
  for (size_t i = 0, first = 0; i < count; i++) {
    bool found = false;
    while (first < count && b[first][0] < a[i][0] - rounding) first++;
    for (size_t k = first; !found && k < count && b[k][0] <= a[i][0] + rounding; k++)
      found = fabs(a[i][1] - b[k][1]) <= rounding && fabs(a[i][2] - b[k][2]) <= rounding;
    if (!found) fail_msg("no point is at %g %g %g", a[i][0], a[i][1], a[i][2]);
  }
  free(a);
  free(b);
}

/* The cage under a query, uploaded again, has the surface that the query gives the model. */
static void assert_comes_back(const fixture *f, const char *id, const char *query) {
  static const char *const levels[] = {"level=1", "level=2", "level=2&limit=true"};
  char target[256], again[API_ID_TEXT];
  snprintf(target, sizeof target, "surface.obj?level=0&normals=none%s", query);
  reply cage = model_get_ok(f->loop, id, target);
  loopback_upload(f->loop, "model/obj", cage.body, again);
  reply_free(&cage);
  for (size_t i = 0; i < sizeof levels / sizeof *levels; i++) {
    snprintf(target, sizeof target, "surface.obj?%s&normals=none%s", levels[i], query);
    reply wanted = model_get_ok(f->loop, id, target);
    snprintf(target, sizeof target, "surface.obj?%s&normals=none", levels[i]);
    reply got = model_get_ok(f->loop, again, target);
    assert_int_equal(count_lines(wanted.body, "f "), count_lines(got.body, "f "));
    assert_same_points(wanted.body, got.body);
    reply_free(&wanted);
    reply_free(&got);
  }
}

TEST_WITH(a_cage_with_tags_comes_back_as_obj, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "application/json", tagged_scene, id);
  assert_comes_back(f, id, "");
  assert_comes_back(f, id, "&boundary=edge-only");
  assert_comes_back(f, id, "&boundary=none");
  assert_comes_back(f, id, "&creasing=chaikin");
  assert_comes_back(f, id, "&creases=none");
  assert_comes_back(f, id, "&creases=angle:20&crease_sharpness=1.5");
  assert_comes_back(f, f->cube, "&creases=auto");
  assert_comes_back(f, f->tank, "");
}

TEST_WITH(a_smooth_triangle_comes_back, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n", id);
  assert_comes_back(f, id, "&triangles=smooth");
}

TEST_WITH(tags_are_of_level_0_alone_and_of_what_is_tagged, setup, fixture_stop) {
  const fixture *f = *state;
  static const struct {
    const char *query;
    size_t creases;
  } cases[] = {{"level=0", 0},
               {"level=0&creases=auto", 12},
               {"level=0&creases=angle:100", 0},
               {"level=1&creases=auto", 0},
               {"level=0&limit=true&creases=auto", 0}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char target[128];
    snprintf(target, sizeof target, "surface.obj?%s", cases[i].query);
    reply r = model_get_ok(f->loop, f->cube, target);
    assert_int_equal(count_lines(r.body, "t "), cases[i].creases);
    assert_int_equal(count_lines(r.body, "t crease 2/1/0 "), cases[i].creases);
    reply_free(&r);
  }
}

TEST(results_over_the_limits_are_422_with_the_counts) {
  api_settings settings = loopback_settings();
  settings.limits.max_level = 5;
  settings.limits.max_faces = 384;
  settings.limits.max_output = 10000;
  fixture *f = start(&settings);
  assert_predicted(model_get(f->loop, f->cube, "surface.glb?level=6"), 6 << 12, false);
  assert_predicted(model_get(f->loop, f->cube, "surface.json?level=6"), 6 << 12, false);
  assert_predicted(model_get(f->loop, f->cube, "surface.glb?level=4"), 6 << 8, false);
  assert_predicted(model_get(f->loop, f->cube, "surface.glb?level=3"), 384, true);
  assert_predicted(model_get(f->loop, f->cube, "surface.obj?level=3"), 384, true);
  assert_predicted(model_get(f->loop, f->cube, "surface.3mf?level=3"), 384, true);
  char target[128];
  snprintf(target, sizeof target, "/v1/models/%s/detail?level=4", f->cube);
  assert_predicted(loopback_post(f->loop, target, "model/obj", "v 0 0 0\n"), 6 << 8, false);
  snprintf(target, sizeof target, "/v1/models/%s/detail?level=6", f->cube);
  assert_predicted(loopback_post(f->loop, target, "model/obj", "v 0 0 0\n"), 6 << 12, false);
  assert_problem(model_get(f->loop, f->cube, "surface.glb?level=99"), 422, NULL, "limit of 5");
  assert_problem(model_get(f->loop, f->cube, "surface.glb?level=999999999999"), 422, NULL, "limit of 5");
  reply r = model_get(f->loop, f->cube, "surface.glb?level=2");
  assert_int_equal(r.status, 200);
  reply_free(&r);
  loopback_stop(f->loop);
  free(f);
}

/* The first warning of an answer; "" without. */
static void read_warning(const reply *r, char *out, size_t size) {
  const char *text = reply_header(r, "X-Tweend-Warning");
  size_t count = 0;
  unsigned byte;
  while (text && *text && count + 1 < size) {
    bool is_coded = *text == '%' && sscanf(text + 1, "%2x", &byte) == 1;
    out[count++] = (char)(is_coded ? (int)byte : *text);
    text += is_coded ? 3 : 1;
  }
  out[count] = 0;
}

/* A parameter that a form has no use for is told, unless its value says what the form does anyway. */
TEST_WITH(what_a_form_cannot_follow_is_told, setup, fixture_stop) {
  const fixture *f = *state;
  static const struct {
    const char *form, *query, *idle;
  } cases[] = {
      {"stl", "unit=mm&encoding=meshopt", "encoding=meshopt"},
      {"3mf", "encoding=quantized", "encoding=quantized"},
      {"ply", "encoding=meshopt&influences=4", "encoding=meshopt, influences=4"},
      {"obj", "encoding=meshopt&polygons=triangles", "encoding=meshopt, polygons=triangles"},
      {"bin", "encoding=quantized&polygons=ngon&normals=limit&uv=all",
       "encoding=quantized, polygons=ngon, normals=limit, uv=all"},
      {"bin", "normals=limit&with=normals", NULL},
      {"stl", "unit=mm&polygons=ngon&normals=none&uv=all&skin=keep",
       "polygons=ngon, normals=none, uv=all, skin=keep"},
      {"stl", "unit=mm&encoding=float&polygons=triangles&normals=auto&influences=all&skin=bake&clip=none",
       NULL},
      {"obj", "polygons=ngon&normals=none&uv=all&skin=bake", NULL},
      {"ply", "polygons=ngon&normals=limit&uv=all", NULL},
      {"json", "scale=2", "scale=2"},
      {"json", "unit=mm&scale=2&shells=true", NULL},
      {"obj", "in_place=true", "in_place=true"},
      {"bin", "root_motion=auto", "root_motion=auto"},
      {"json", "encoding=meshopt&polygons=ngon&influences=4", NULL},
      {"glb", "encoding=meshopt&normals=none&uv=all", NULL},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char rest[200], target[240], wanted[200], told[400];
    snprintf(rest, sizeof rest, "surface.%s?%s", cases[i].form, cases[i].query);
    reply r = model_get_ok(f->loop, f->cube, rest);
    snprintf(target, sizeof target, "surface.%s%s", cases[i].form,
             strcmp(cases[i].form, "stl") == 0 ? "?unit=mm" : "");
    reply plain = model_get_ok(f->loop, f->cube, target);
    read_warning(&r, told, sizeof told);
    snprintf(wanted, sizeof wanted, "1; surface.%s is the same without %s", cases[i].form, cases[i].idle);
    if (strcmp(told, cases[i].idle ? wanted : "") != 0) fail_msg("%s: %s", rest, told);
    if (cases[i].idle) {
      assert_int_equal(plain.size, r.size);
      assert_memory_equal(plain.body, r.body, r.size);
      assert_string_not_equal(reply_header(&r, "ETag"), reply_header(&plain, "ETag"));
    }
    reply_free(&r);
    reply_free(&plain);
  }
}

/* A hole is no face of an OBJ, and tags beside it would make another surface. Deeper levels are no cages. */
TEST_WITH(holes_that_an_obj_is_without_are_told, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT], told[400];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nf 1 2 5 4\nf 2 3 6 5\n"
                  "t crease 2/1/0 0 1 2\nt hole 1/0/0 1\n",
                  id);
  for (int level = 0; level < 2; level++) {
    char rest[40];
    snprintf(rest, sizeof rest, "surface.obj?level=%d", level);
    reply r = model_get_ok(f->loop, id, rest);
    read_warning(&r, told, sizeof told);
    assert_string_equal(told, level == 0
                                  ? "1; surface.obj is without the holes, creases and corners of 1 mesh "
                                    "that has holes"
                                  : "");
    assert_null(strstr(r.body, "t crease"));
    reply_free(&r);
  }
}

/* Each level as surface.json has it, and with its error; the last one is over the limit. */
TEST(all_levels_are_told_at_once) {
  api_settings settings = loopback_settings();
  settings.limits.max_faces = 5000;
  fixture *f = start(&settings);
  static const char *const options[] = {"", "clip=drive&from=0&to=1&fps=3", "encoding=quantized",
                                        "clip=none&limit=true"};
  for (size_t i = 0; i < sizeof options / sizeof *options; i++) {
    char rest[80];
    snprintf(rest, sizeof rest, "levels.json?%s", options[i]);
    reply r = model_get_ok(f->loop, f->tank, rest);
    cJSON *tree = cJSON_Parse(r.body), *level = json_member(tree, "levels")->child;
    for (int n = 0; n < 3; n++, level = level->next) {
      snprintf(rest, sizeof rest, "surface.json?level=%d&%s", n, options[i]);
      reply alone = model_get_ok(f->loop, f->tank, rest);
      cJSON *wanted = cJSON_Parse(alone.body);
      cJSON_DeleteItemFromObject(wanted, "forms");
      cJSON_DeleteItemFromObject(wanted, "meshes");
      assert_true(cJSON_IsNumber(json_member(level, "error")));
      cJSON_DeleteItemFromObject(level, "error");
      assert_true(cJSON_Compare(level, wanted, true));
      cJSON_Delete(wanted);
      reply_free(&alone);
    }
    assert_true(cJSON_IsNull(json_member(level, "bytes")));
    assert_int_equal(json_member(level, "faces")->valueint, 14080);
    assert_non_null(strstr(json_member(level, "refused")->valuestring, "limit of 5000"));
    assert_null(level->next);
    cJSON_Delete(tree);
    char header[80];
    snprintf(header, sizeof header, "If-None-Match: %s\n", reply_header(&r, "ETag"));
    snprintf(rest, sizeof rest, "levels.json?%s", options[i]);
    reply again = model_ask(f->loop, "GET", f->tank, rest, header);
    assert_int_equal(again.status, 304);
    reply_free(&again);
    reply_free(&r);
  }
  assert_problem(model_get(f->loop, f->tank, "levels.json?level=1"), 400, NULL, "level");
  assert_problem(model_get(f->loop, f->tank, "levels.json?mesh=hull"), 400, NULL, "mesh");
  assert_problem(model_get(f->loop, f->tank, "levels.json?shells=true"), 400, NULL, "shells");
  assert_problem(model_get(f->loop, f->tank, "levels.json?at=1&clip=nothing"), 404, NULL, NULL);
  loopback_stop(f->loop);
  free(f);
}

TEST(counts_beyond_32_bits_are_told_exactly) {
  api_settings settings = loopback_settings();
  settings.limits.max_level = 16;
  fixture *f = start(&settings);
  reply r = model_get(f->loop, f->cube, "surface.glb?level=16");
  assert_says(&r, "'vertices':25769803778,'edges':51539607552,'faces':25769803776");
  assert_problem(r, 422, NULL, "25769803776");
  loopback_stop(f->loop);
  free(f);
}

/* ---- threads --------------------------------------------------------------------------------------- */

static void count_parts(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                        void *context) {
  *(uint32_t *)owner += count;
  for (uint32_t i = 0; i < count; i++) part(context, i);
}

TEST(bounds_are_shared_out_once) {
  uint32_t parts = 0;
  api_settings settings = loopback_settings();
  settings.parallel = (api_parallel_for){.owner = &parts, .run = count_parts};
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT], target[96];
  loopback_upload_sample(loop, "model/obj", "cube.obj", id);
  snprintf(target, sizeof target, "/v1/models/%s/surface.glb?level=7", id);
  for (int i = 0; i < 2; i++) {
    parts = 0;
    reply r = loopback_get(loop, target);
    assert_int_equal(r.status, 200);
    assert_true((parts > 1) == (i == 0));
    reply_free(&r);
  }
  loopback_stop(loop);
}

TEST_WITH(polygons_without_a_fan_are_told, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj",
                  "v 0 0 0\nv 6 0 0\nv 5 4 0\nv 4 1 0\nv 3 4 0\nv 2 1 0\nv 1 4 0\nf 1 2 3 4 5 6 7\n", id);
  const struct {
    const char *rest, *says;
  } cases[] = {{"surface.glb?level=0&polygons=ngon", "joined%20when%20the%20file"},
               {"surface.glb?level=0&polygons=ngon&encoding=quantized", "split%20into%20triangles"},
               {"surface.glb?level=0", NULL},
               {"surface.glb?level=1&polygons=ngon", NULL}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reply r = model_get_ok(f->loop, id, cases[i].rest);
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    if (cases[i].says)
      assert_true(warning && strstr(warning, "1%20concave%20polygon%20is") && strstr(warning, cases[i].says));
    else
      assert_null(warning);
    reply_free(&r);
  }
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
