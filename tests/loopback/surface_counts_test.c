/* Counts and sizes of surfaces, of one level and of all, also of those over a limit. */
#include "cube_and_tank.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
