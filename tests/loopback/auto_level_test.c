/* level=auto: which levels are chosen, what tells of them, and what is refused. */
#include "loopback.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct fixture {
  loopback *loop;
  char cube[API_ID_TEXT], tank[API_ID_TEXT], pair[API_ID_TEXT];
} fixture;

/* A cube of side 2, and a small one that a node makes ten times larger. */
static const char pair[] =
    "{\"meshes\":[{\"name\":\"large\",\"shape\":{\"kind\":\"box\",\"size\":[2,2,2]}},"
    "{\"name\":\"small\",\"shape\":{\"kind\":\"box\",\"size\":[0.02,0.02,0.02]}}],"
    "\"nodes\":[{\"mesh\":\"large\"},{\"mesh\":\"small\",\"scale\":[10,1,1],\"translation\":[0,3,0]}]}";

static fixture *start(const api_settings *settings) {
  fixture *f = calloc(1, sizeof *f);
  f->loop = loopback_start(settings);
  loopback_upload_sample(f->loop, "model/obj", "cube.obj", f->cube);
  loopback_upload_sample(f->loop, "application/json", "tank.json", f->tank);
  loopback_upload(f->loop, "application/json", pair, f->pair);
  return f;
}

static int setup(void **state) {
  api_settings settings = loopback_settings();
  *state = start(&settings);
  return 0;
}

static double number_in(const cJSON *of, const char *name) {
  const cJSON *value = json_member(of, name);
  assert_true(cJSON_IsNumber(value));
  return value->valuedouble;
}

/* The error that a header tells. */
static double told_error(const reply *r) {
  const char *text = reply_header(r, "X-Tweend-Error");
  double error = 0;
  assert_non_null(text);
  assert_int_equal(sscanf(text, "surface=%lf", &error), 1);
  return error;
}

/* The least level of levels.json within the error. */
static int least_level(const fixture *f, const char *id, double error) {
  cJSON *tree = model_get_json(f->loop, id, "levels.json?clip=none");
  int level = 0;
  const cJSON *of = json_member(tree, "levels")->child;
  while (of && number_in(of, "error") > error) {
    of = of->next;
    level++;
  }
  cJSON_Delete(tree);
  return level;
}

TEST_WITH(each_error_gets_its_least_level_in_every_form, setup, fixture_stop) {
  const fixture *f = *state;
  static const char *const forms[] = {"glb", "gltf", "obj", "stl", "ply", "3mf", "bin"};
  static const double errors[] = {0.5, 0.1, 0.02, 0.004, 0.001};
  int before = -1;
  for (size_t i = 0; i < sizeof errors / sizeof *errors; i++) {
    char rest[120], level[16];
    int least = least_level(f, f->cube, errors[i]);
    assert_true(least > before);
    before = least;
    snprintf(level, sizeof level, "%d", least);
    for (size_t k = 0; k < sizeof forms / sizeof *forms; k++) {
      snprintf(rest, sizeof rest, "surface.%s?level=auto&error=%g", forms[k], errors[i]);
      reply head = model_ask(f->loop, "HEAD", f->cube, rest, NULL), r = model_get_ok(f->loop, f->cube, rest);
      assert_int_equal(head.status, 200);
      assert_string_equal(reply_header(&r, "X-Tweend-Level"), level);
      assert_string_equal(reply_header(&head, "X-Tweend-Level"), level);
      assert_string_equal(reply_header(&head, "ETag"), reply_header(&r, "ETag"));
      assert_true(told_error(&r) <= errors[i] && told_error(&head) == told_error(&r));
      snprintf(rest, sizeof rest, "surface.%s?level=%d", forms[k], least);
      reply fixed = model_get_ok(f->loop, f->cube, rest);
      assert_int_equal(fixed.size, r.size);
      assert_memory_equal(fixed.body, r.body, r.size);
      assert_null(reply_header(&fixed, "X-Tweend-Level"));
      reply_free(&fixed);
      reply_free(&head);
      reply_free(&r);
    }
  }
}

/* Bowls of triangles around irregular points, of which bounds that are looked at less closely differ. */
static void upload_bumps(const fixture *f, char id[API_ID_TEXT]) {
  enum { SIDE = 7, LINE = 40 };
  char text[2 * SIDE * SIDE * LINE], *end = text;
  for (int y = 0; y < SIDE; y++)
    for (int x = 0; x < SIDE; x++)
      end += sprintf(end, "v %d %g %d\n", x, 0.4 * ((5 * x * x + 3 * y + x * y) % 7), y);
  for (int y = 0; y + 1 < SIDE; y++)
    for (int x = 0; x + 1 < SIDE; x++) {
      int a = 1 + x + SIDE * y, b = a + 1, c = b + SIDE, d = a + SIDE, is_turned = (x * y + x) % 3 == 0;
      end += is_turned ? sprintf(end, "f %d %d %d\nf %d %d %d\n", a, d, c, a, c, b)
                       : sprintf(end, "f %d %d %d\nf %d %d %d\n", a, d, b, b, d, c);
    }
  loopback_upload(f->loop, "model/obj", text, id);
}

/* Whoever reads levels.json and asks for a number that it tells gets that level, or a lower one, and is told
 * no more than that. */
static void compare_numbers(const fixture *f, const char *id, const char *options) {
  char rest[160];
  snprintf(rest, sizeof rest, "levels.json?clip=none%s", options);
  cJSON *tree = model_get_json(f->loop, id, rest);
  const cJSON *levels = json_member(tree, "levels"), *of;
  cJSON_ArrayForEach(of, levels) {
    static const double parts[] = {1, 1.0001, 1.7, 3.5};
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
      double error = number_in(of, "error") * parts[k];
      if (!(error > 0) || cJSON_GetObjectItem(of, "refused")) continue;
      snprintf(rest, sizeof rest, "surface.json?level=auto&error=%.17g%s", error, options);
      reply r = model_ask(f->loop, "HEAD", id, rest, NULL);
      if (r.status != 200) fail_msg("%s: %d", rest, r.status);
      int level = atoi(reply_header(&r, "X-Tweend-Level"));
      const cJSON *chosen = cJSON_GetArrayItem(levels, level);
      assert_true(level <= (int)number_in(of, "level"));
      if (told_error(&r) > number_in(chosen, "error") || told_error(&r) > error)
        fail_msg("%s: level %d is told as %.17g, in levels.json as %.17g", rest, level, told_error(&r),
                 number_in(chosen, "error"));
      reply_free(&r);
    }
  }
  cJSON_Delete(tree);
}

TEST_WITH(levels_tell_what_asking_for_it_gives, setup, fixture_stop) {
  const fixture *f = *state;
  char bumps[API_ID_TEXT];
  upload_bumps(f, bumps);
  compare_numbers(f, f->cube, "");
  compare_numbers(f, f->pair, "");
  compare_numbers(f, f->tank, "");
  compare_numbers(f, bumps, "");
  compare_numbers(f, bumps, "&limit=true");
}

/* The diagonal of the cube is 2 times the root of 3. */
TEST_WITH(shares_are_of_the_diagonal_of_the_scene, setup, fixture_stop) {
  const fixture *f = *state;
  char rest[120];
  snprintf(rest, sizeof rest, "surface.json?level=auto&error=%.17g", 0.01 * sqrt(12));
  cJSON *a = model_get_json(f->loop, f->cube, rest),
        *b = model_get_json(f->loop, f->cube, "surface.json?level=auto&error=1%25");
  assert_true(number_in(a, "level") == number_in(b, "level") && number_in(b, "error") <= 0.01 * sqrt(12));
  assert_int_equal(number_in(b, "level"), least_level(f, f->cube, 0.01 * sqrt(12)));
  cJSON_Delete(a);
  cJSON_Delete(b);
}

/* A share of no size would be an error that no level reaches. */
TEST_WITH(what_has_no_size_stays_as_it_is, setup, fixture_stop) {
  const fixture *f = *state;
  static const char *const queries[] = {"level=auto", "level=auto&error=1%25",
                                        "level=auto&error=1%25&faces=50"};
  char id[API_ID_TEXT];
  loopback_upload(f->loop, "application/json",
                  "{\"meshes\":[{\"name\":\"dot\",\"positions\":[[1,2,3],[1,2,3],[1,2,3],[1,2,3]],\"faces\":["
                  "[0,1,2,3]]}],"
                  "\"nodes\":[{\"mesh\":\"dot\"}]}",
                  id);
  for (size_t i = 0; i < sizeof queries / sizeof *queries; i++) {
    char rest[120];
    snprintf(rest, sizeof rest, "surface.glb?%s", queries[i]);
    reply r = model_get_ok(f->loop, id, rest);
    assert_string_equal(reply_header(&r, "X-Tweend-Level"), "0");
    assert_null(reply_header(&r, "X-Tweend-Warning"));
    reply_free(&r);
  }
}

/* The small cube is a tenth as large as the large one, as its node shows it: it needs fewer levels. */
TEST_WITH(each_mesh_has_its_level, setup, fixture_stop) {
  const fixture *f = *state;
  reply r = model_get_ok(f->loop, f->pair, "surface.json?level=auto&error=0.01");
  cJSON *tree = cJSON_Parse(r.body);
  const cJSON *large = json_member(tree, "meshes")->child, *small = large->next;
  char level[16];
  assert_true(number_in(large, "level") > number_in(small, "level"));
  assert_true(number_in(tree, "level") == number_in(large, "level"));
  assert_true(number_in(large, "error") <= 0.01 && number_in(small, "error") <= 0.01);
  assert_true(number_in(tree, "error") == fmax(number_in(large, "error"), number_in(small, "error")));
  snprintf(level, sizeof level, "%d-%d", (int)number_in(small, "level"), (int)number_in(large, "level"));
  assert_string_equal(reply_header(&r, "X-Tweend-Level"), level);
  assert_true(number_in(tree, "faces") == number_in(large, "faces") + number_in(small, "faces"));
  cJSON_Delete(tree);
  reply_free(&r);
  static const char *const forms[] = {"glb?level=auto&error=0.01&polygons=ngon",
                                      "glb?level=auto&error=0.01&encoding=meshopt",
                                      "stl?level=auto&error=0.01", "obj?level=auto&error=0.4"};
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    char rest[120];
    snprintf(rest, sizeof rest, "surface.%s", forms[i]);
    r = model_get_ok(f->loop, f->pair, rest);
    assert_true(r.size > 1000);
    reply_free(&r);
  }
}

/* The cube as glTF, drawn at its size and ten times as long. */
static void upload_instances(const fixture *f, char id[API_ID_TEXT]) {
  static const char extension[] = "{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"SCALE\":%d}}}",
                    buffer[] = "{\"byteLength\":24,\"uri\":\"data:application/octet-stream;base64,"
                               "AACAPwAAgD8AAIA/AAAgQQAAgD8AAIA/\"}";
  char text[200];
  cJSON *tree = model_get_json(f->loop, f->cube, "surface.gltf?level=0"),
        *accessors = cJSON_GetObjectItem(tree, "accessors"),
        *views = cJSON_GetObjectItem(tree, "bufferViews"), *buffers = cJSON_GetObjectItem(tree, "buffers");
  snprintf(text, sizeof text, extension, cJSON_GetArraySize(accessors));
  cJSON_AddItemToObject(cJSON_GetObjectItem(tree, "nodes")->child, "extensions", cJSON_Parse(text));
  snprintf(text, sizeof text, "{\"bufferView\":%d,\"componentType\":5126,\"count\":2,\"type\":\"VEC3\"}",
           cJSON_GetArraySize(views));
  cJSON_AddItemToArray(accessors, cJSON_Parse(text));
  snprintf(text, sizeof text, "{\"buffer\":%d,\"byteLength\":24}", cJSON_GetArraySize(buffers));
  cJSON_AddItemToArray(views, cJSON_Parse(text));
  cJSON_AddItemToArray(buffers, cJSON_Parse(buffer));
  cJSON_AddItemToObject(tree, "extensionsUsed", cJSON_Parse("[\"EXT_mesh_gpu_instancing\"]"));
  char *printed = cJSON_PrintUnformatted(tree);
  loopback_upload(f->loop, "model/gltf+json", printed, id);
  free(printed);
  cJSON_Delete(tree);
}

TEST_WITH(instances_scale_the_error, setup, fixture_stop) {
  const fixture *f = *state;
  char id[API_ID_TEXT];
  upload_instances(f, id);
  cJSON *one = model_get_json(f->loop, f->cube, "surface.json?level=auto&faces=100"),
        *many = model_get_json(f->loop, id, "surface.json?level=auto&faces=100");
  assert_true(fabs(number_in(many, "error") - 10 * number_in(one, "error")) < 1e-6);
  cJSON_Delete(one);
  cJSON_Delete(many);
  /* The diagonal is of all instances: 20 by 2 by 2. */
  reply r = model_get_ok(f->loop, id, "surface.glb?level=auto&error=1%25");
  assert_true(told_error(&r) <= 0.01 * sqrt(408) && told_error(&r) > 0.01 * sqrt(12));
  reply_free(&r);
}

TEST_WITH(faces_cap_the_level, setup, fixture_stop) {
  const fixture *f = *state;
  cJSON *tree = model_get_json(f->loop, f->cube, "surface.json?level=auto&faces=400");
  assert_int_equal(number_in(tree, "faces"), 384);
  cJSON_Delete(tree);
  tree = model_get_json(f->loop, f->cube, "surface.json?level=auto&faces=384");
  assert_int_equal(number_in(tree, "faces"), 384);
  cJSON_Delete(tree);
  tree = model_get_json(f->loop, f->cube, "surface.json?level=auto&faces=383");
  assert_int_equal(number_in(tree, "faces"), 96);
  cJSON_Delete(tree);
  reply r = model_get_ok(f->loop, f->cube, "surface.glb?level=auto&faces=2");
  assert_string_equal(reply_header(&r, "X-Tweend-Level"), "0");
  reply_free(&r);
  /* With both, the lower level; where that is by faces, a warning tells of the error. */
  r = model_get_ok(f->loop, f->cube, "surface.glb?level=auto&faces=400&error=0.5");
  assert_string_equal(reply_header(&r, "X-Tweend-Level"), "1");
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
  r = model_get_ok(f->loop, f->cube, "surface.glb?level=auto&faces=400&error=0.0001");
  assert_string_equal(reply_header(&r, "X-Tweend-Level"), "3");
  assert_true(told_error(&r) > 0.0001);
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "needs%20more%20faces"));
  reply_free(&r);
  r = model_get_ok(f->loop, f->cube, "surface.glb?level=auto");
  assert_true(told_error(&r) <= 0.001 * sqrt(12));
  reply_free(&r);
}

/* What was asked for is in the tag, as JSON and warnings tell of it; what was chosen too. */
TEST_WITH(tags_and_caches_hold_what_was_chosen, setup, fixture_stop) {
  const fixture *f = *state;
  reply a = model_get_ok(f->loop, f->cube, "surface.glb?level=auto&error=0.1"),
        b = model_get_ok(f->loop, f->cube, "surface.glb?level=auto&error=0.02");
  assert_string_not_equal(reply_header(&a, "ETag"), reply_header(&b, "ETag"));
  char header[120];
  snprintf(header, sizeof header, "If-None-Match: %s\n", reply_header(&a, "ETag"));
  reply again = model_ask(f->loop, "GET", f->cube, "surface.glb?level=auto&error=0.1", header);
  assert_int_equal(again.status, 304);
  reply_free(&again);
  reply_free(&a);
  reply_free(&b);
}

TEST_WITH(posed_and_baked_models_have_levels_too, setup, fixture_stop) {
  const fixture *f = *state;
  static const char *const queries[] = {"surface.glb?level=auto&error=1%25&clip=drive&at=1",
                                        "surface.stl?level=auto&error=1%25&clip=drive&at=1",
                                        "surface.glb?level=auto&error=1%25&skin=bake&clip=none",
                                        "surface.glb?level=auto&error=1%25&meshes=none",
                                        "surface.glb?level=auto&error=1%25&limit=true",
                                        "surface.glb?level=auto&error=1%25&scheme=bilinear"};
  for (size_t i = 0; i < sizeof queries / sizeof *queries; i++) {
    reply r = model_get_ok(f->loop, f->tank, queries[i]);
    assert_non_null(reply_header(&r, "X-Tweend-Level"));
    reply_free(&r);
  }
  char *text = loopback_file("server/samples/cube.obj", NULL);
  reply posted = loopback_post(f->loop, "/v1/surface.stl?level=auto&error=0.02", "model/obj", text),
        stored = model_get_ok(f->loop, f->cube, "surface.stl?level=auto&error=0.02");
  assert_int_equal(posted.status, 200);
  assert_string_equal(reply_header(&posted, "X-Tweend-Level"), reply_header(&stored, "X-Tweend-Level"));
  assert_int_equal(posted.size, stored.size);
  reply_free(&posted);
  reply_free(&stored);
  free(text);
}

TEST_WITH(what_cannot_be_kept_is_refused, setup, fixture_stop) {
  const fixture *f = *state;
  static const char *const bad[] = {
      "level=auto&error=0",       "level=auto&error=-1", "level=auto&error=x", "level=auto&error=%25",
      "level=auto&error=1%25%25", "level=auto&faces=0",  "level=auto&faces=x", "level=Auto",
      "level=2&error=1",          "faces=100",           "error=1%25"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char rest[120];
    snprintf(rest, sizeof rest, "surface.glb?%s", bad[i]);
    assert_problem(model_get(f->loop, f->cube, rest), 400, NULL, NULL);
  }
  assert_problem(model_get(f->loop, f->cube, "surface.glb?level=auto&error=1e-9"), 422, NULL, "level=auto");
  char target[200];
  snprintf(target, sizeof target, "/v1/models/%s/detail?level=auto", f->cube);
  assert_problem(loopback_post(f->loop, target, "model/obj", "v 0 0 0\n"), 400, NULL, "level=auto");
  char open[API_ID_TEXT];
  loopback_upload(f->loop, "model/obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", open);
  assert_problem(model_get(f->loop, open, "surface.glb?level=auto&boundary=open"), 422, NULL,
                 "boundary=open");
  reply r = model_get_ok(f->loop, f->cube, "surface.glb?level=auto&boundary=open");
  reply_free(&r);
}

TEST(limits_hold_for_chosen_levels) {
  api_settings settings = loopback_settings();
  settings.limits.max_level = 3;
  settings.limits.max_faces = 100;
  fixture *f = start(&settings);
  assert_problem(model_get(f->loop, f->cube, "surface.glb?level=auto&error=0.0001"), 422, NULL, "level 3");
  assert_problem(model_get(f->loop, f->cube, "surface.glb?level=auto&error=0.02"), 422, NULL, "limit of 100");
  reply r = model_get_ok(f->loop, f->cube, "surface.glb?level=auto&faces=1000");
  assert_string_equal(reply_header(&r, "X-Tweend-Level"), "2");
  reply_free(&r);
  r = model_get_ok(f->loop, f->cube, "surface.glb?level=auto");
  assert_string_equal(reply_header(&r, "X-Tweend-Level"), "2");
  assert_non_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
  loopback_stop(f->loop);
  free(f);
}
