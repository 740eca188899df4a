/* Uploads: what their types and bytes say, and how they are answered. */
#include "stored_models.h"

#include <stdio.h>
#include <string.h>

TEST_WITH(an_upload_is_described_by_201_and_again_by_200, loopback_setup, loopback_teardown) {
  reply first = loopback_post(*state, "/v1/models", "model/obj", triangle);
  assert_int_equal(first.status, 201);
  char location[64];
  snprintf(location, sizeof location, "/v1/models/%s", triangle_id);
  assert_string_equal(reply_header(&first, "Location"), location);
  reply again = loopback_post(*state, "/v1/models", "text/plain; charset=utf-8", triangle);
  assert_int_equal(again.status, 200);
  assert_string_equal(first.body, again.body);
  assert_string_equal(reply_header(&first, "ETag"), reply_header(&again, "ETag"));
  reply got = loopback_get(*state, location);
  assert_int_equal(got.status, 200);
  assert_string_equal(first.body, got.body);
  assert_string_equal(reply_header(&first, "ETag"), reply_header(&got, "ETag"));
  assert_int_equal(loopback_store_count(*state), 1);
  reply_free(&first);
  reply_free(&again);
  reply_free(&got);
}

TEST_WITH(bodies_are_asked_for_before_they_are_read, loopback_setup, loopback_teardown) {
  reply r = loopback_ask(*state, "POST", "/v1/models", NULL, NULL, 0);
  assert_true(r.refused);
  assert_problem(r, 411, NULL, "Content-Length");
  r = loopback_ask(*state, "POST", "/v1/models", "Content-Length: 1048577\n", "", 0);
  assert_true(r.refused);
  assert_problem(r, 413, NULL, "1048576");
  r = loopback_ask(*state, "POST", "/v1/models", "Content-Length: 99999999999999999999999999\n", "", 0);
  assert_true(r.refused);
  assert_problem(r, 413, NULL, NULL);
  assert_problem(loopback_post(*state, "/v1/models", "model/obj", ""), 400, NULL, "empty");
}

TEST_WITH(types_that_no_model_has_are_415_with_the_list, loopback_setup, loopback_teardown) {
  const char *const types[] = {"image/png",
                               "text/html",
                               "text/xml",
                               "application/pdf",
                               "multipart/mixed; boundary=x",
                               "application/xhtml+xml",
                               "video/mp4",
                               "nonsense"};
  for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
    reply r = loopback_post(*state, "/v1/models", types[i], triangle);
    assert_true(r.refused);
    assert_says(&r, "\"model/gltf-binary\"");
    assert_problem(r, 415, NULL, "model/obj");
  }
}

TEST_WITH(the_bytes_decide_under_types_that_say_nothing, loopback_setup, loopback_teardown) {
  const char *const types[] = {"application/octet-stream", "application/x-www-form-urlencoded",
                               "model/vnd.other", "", "MODEL/OBJ"};
  for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
    reply r = loopback_post(*state, "/v1/models", types[i], triangle);
    assert_in_range(r.status, 200, 201);
    assert_says(&r, "'format':'obj'");
    reply_free(&r);
  }
  reply r = loopback_post_with(*state, "/v1/models", NULL, "{'nodes':[{}]}");
  assert_int_equal(r.status, 201);
  assert_says(&r, "'format':'tweend'");
  reply_free(&r);
}

TEST_WITH(a_type_that_contradicts_the_bytes_is_400, loopback_setup, loopback_teardown) {
  const char *const pairs[][2] = {{"model/gltf-binary", triangle},
                                  {"model/gltf+json", triangle},
                                  {"model/gltf+json", "{'nodes':[]}"},
                                  {"model/obj", "{'nodes':[]}"},
                                  {"text/plain", "glTF\2"},
                                  {"application/json", "glTF\2"},
                                  {"model/gltf-binary", "{'nodes':[]}"},
                                  {"application/json", triangle}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
    assert_problem(loopback_post(*state, "/v1/models", pairs[i][0], pairs[i][1]), 400, NULL, NULL);
  assert_int_equal(loopback_store_count(*state), 0);
}

TEST_WITH(the_declared_type_is_quoted_as_it_was_sent, loopback_setup, loopback_teardown) {
  assert_problem(loopback_post(*state, "/v1/models", "text/plain; charset=utf-8", "{'nodes':[]}"), 400, NULL,
                 "declared as text/plain, but the bytes look like tweend JSON");
}

TEST_WITH(an_obj_error_bears_its_line, loopback_setup, loopback_teardown) {
  reply r = loopback_post(*state, "/v1/models", "model/obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  assert_says(&r, "'line':4");
  assert_false(reply_says(&r, "\"errors\""));
  assert_problem(r, 422, NULL, NULL);
}

TEST_WITH(seeding_is_storing, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  assert_int_equal(api_seed(loop->service, "seed.obj", (const uint8_t *)triangle, strlen(triangle)), 201);
  assert_int_equal(api_seed(loop->service, "seed.obj", (const uint8_t *)triangle, strlen(triangle)), 200);
  assert_int_equal(api_seed(loop->service, "seed.obj", (const uint8_t *)"{\"nodes\":7}", 11), 400);
  assert_int_equal(loopback_store_count(loop), 1);
}
