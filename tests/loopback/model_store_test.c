/* Models in the store: deleted, stored a second time, absent, out of reach. */
#include "stored_models.h"

#include <stdio.h>
#include <string.h>

TEST_WITH(deleting_forgets_the_model_at_once, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply r = loopback_get(*state, path);
  assert_int_equal(r.status, 200);
  assert_true(loopback_is_light(*state, path));
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  assert_int_equal(r.size, 0);
  reply_free(&r);
  assert_problem(loopback_get(*state, path), 404, NULL, id);
  assert_problem(loopback_ask(*state, "DELETE", path, NULL, NULL, 0), 404, NULL, NULL);
  strcat(path, "/source");
  assert_problem(loopback_get(*state, path), 404, NULL, NULL);
  r = loopback_post(*state, "/v1/models", "model/obj", triangle);
  assert_int_equal(r.status, 201);
  reply_free(&r);
}

TEST_WITH(who_stores_a_model_second_is_told_the_first_ones_name, loopback_setup, loopback_teardown) {
  char path[64], headers[192];
  loopback_store_come_second(*state, "{\"name\":\"first\",\"format\":\"obj\"}");
  reply r = loopback_post(*state, "/v1/models?name=second", "model/obj", triangle);
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(r.body, "\"name\":\"first\""));
  assert_null(strstr(r.body, "second"));
  snprintf(path, sizeof path, "%s", reply_header(&r, "Location"));
  snprintf(headers, sizeof headers, "If-Match: %s\n", reply_header(&r, "ETag"));
  reply described = loopback_get(*state, path);
  assert_string_equal(described.body, r.body);
  assert_string_equal(reply_header(&described, "ETag"), reply_header(&r, "ETag"));
  reply_free(&described);
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, headers, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
}

TEST_WITH(a_warning_is_told_once_by_who_stores_a_model_second, loopback_setup, loopback_teardown) {
  static const char reversed[] =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 2 3 6 5\n";
  reply r = loopback_post(*state, "/v1/models?name=alone", "model/obj", reversed);
  assert_int_equal(r.status, 201);
  char alone[512], path[64];
  snprintf(path, sizeof path, "%s", reply_header(&r, "Location"));
  snprintf(alone, sizeof alone, "%s", reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, NULL, NULL, 0);
  reply_free(&r);
  loopback_store_come_second(*state, "{\"name\":\"first\",\"format\":\"obj\"}");
  r = loopback_post(*state, "/v1/models?name=second", "model/obj", reversed);
  assert_non_null(strstr(r.body, "\"name\":\"first\""));
  assert_string_equal(reply_header(&r, "X-Tweend-Warning"), alone);
  reply_free(&r);
}

TEST_WITH(ids_that_cannot_be_are_404, loopback_setup, loopback_teardown) {
  const char *const ids[] = {"x",
                             "0123456789ABCDEF0123456789ABCDEF",
                             "0123456789abcdef0123456789abcde",
                             "0123456789abcdef0123456789abcdef0",
                             "..",
                             "%2e%2e",
                             ""};
  for (size_t i = 0; i < sizeof ids / sizeof *ids; i++) {
    char path[96];
    snprintf(path, sizeof path, "/v1/models/%s", ids[i]);
    assert_problem(loopback_get(*state, path), 404, NULL, NULL);
    assert_string_equal(api_route_name(path), "other");
  }
  assert_string_equal(api_route_name("/v1/models/0123456789abcdef0123456789abcdef/source"),
                      "/v1/models/{id}/source");
}

TEST_WITH(an_unreachable_store_is_503_and_nothing_is_remembered, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "application/json", "{'nodes':[{}]}", id);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  loopback_store_fail(*state, true);
  reply r = loopback_post(*state, "/v1/models", "model/obj", triangle);
  assert_non_null(reply_header(&r, "Retry-After"));
  assert_problem(r, 503, NULL, "store");
  assert_problem(loopback_get(*state, path), 503, NULL, "store");
  assert_problem(loopback_get(*state, "/v1/models"), 503, NULL, "store");
  path[strlen(path) - strlen("/source")] = '\0';
  assert_problem(loopback_ask(*state, "DELETE", path, NULL, NULL, 0), 503, NULL, "store");
  loopback_store_fail(*state, false);
  char triangle_path[64];
  snprintf(triangle_path, sizeof triangle_path, "/v1/models/%s", triangle_id);
  assert_problem(loopback_get(*state, triangle_path), 404, NULL, NULL);
}

TEST_WITH(a_known_model_is_answered_without_the_store, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  assert_false(loopback_is_light(*state, path));
  reply r = loopback_get(*state, path);
  reply_free(&r);
  size_t opens = loopback_store_opens(*state);
  assert_true(loopback_is_light(*state, path));
  assert_int_equal(loopback_store_opens(*state), opens);
}
