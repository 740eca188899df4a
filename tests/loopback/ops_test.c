/* Routing, methods, negotiation, cross-origin headers and the operations' endpoints. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

TEST_WITH(unknown_path_is_404, loopback_setup, loopback_teardown) {
  assert_problem(loopback_get(*state, "/nothing"), 404, NULL, NULL);
  assert_problem(loopback_get(*state, "/healthz/"), 404, NULL, NULL);
  assert_problem(loopback_get(*state, "/healthz.json"), 404, NULL, NULL);
  assert_problem(loopback_get(*state, ""), 404, NULL, NULL);
}

TEST_WITH(wrong_method_is_405_with_allow, loopback_setup, loopback_teardown) {
  reply r = loopback_ask(*state, "POST", "/healthz", NULL, "x", 1);
  assert_true(r.refused);
  assert_string_equal(reply_header(&r, "Allow"), "GET, HEAD, OPTIONS");
  assert_problem(r, 405, NULL, "GET");
}

TEST_WITH(unknown_parameter_is_400, loopback_setup, loopback_teardown) {
  assert_problem(loopback_get(*state, "/healthz?deep=1"), 400, NULL, "deep");
  assert_problem(loopback_get(*state, "/healthz?%zz=1"), 400, NULL, NULL);
  assert_problem(loopback_get(*state, "/healthz?%00=1"), 400, NULL, NULL);
  assert_problem(loopback_get(*state, "/healthz?a%"), 400, NULL, NULL);
  assert_problem(loopback_get(*state, "/healthz?%ff=1"), 400, NULL, "UTF-8");
}

TEST_WITH(unacceptable_type_is_406_with_the_list, loopback_setup, loopback_teardown) {
  reply r = loopback_ask(*state, "GET", "/version", "Accept: image/png, application/json;q=0\n", NULL, 0);
  assert_says(&r, "'supported':['application/json']");
  assert_problem(r, 406, NULL, "application/json");
}

TEST_WITH(accept_with_quality_is_understood, loopback_setup, loopback_teardown) {
  const char *const good[] = {"Accept: */*\n", "Accept: application/*;q=0.1\n", "Accept: \n",
                              "Accept: text/html;x=\"a,b\", application/json;q=0.5\n",
                              "Accept: */*;q=0, application/json\n"};
  for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
    reply r = loopback_ask(*state, "GET", "/version", good[i], NULL, 0);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  const char *const bad[] = {"Accept: application/json;q=2\n", "Accept: app/json\n", "Accept: */*;q=0\n",
                             "Accept: application/json;q=0, */*\n"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
    assert_problem(loopback_ask(*state, "GET", "/version", bad[i], NULL, 0), 406, NULL, NULL);
}

TEST_WITH(files_of_the_build_are_asked_for_anew_by_their_tags, loopback_setup, loopback_teardown) {
  static const char *const files[][2] = {{"/openapi.json", "application/json"},
                                         {"/tweend.js", "text/javascript"},
                                         {"/tweend.d.ts", "application/typescript"}};
  for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
    reply r = loopback_ask(*state, "GET", files[i][0], "Origin: https://elsewhere.example\n", NULL, 0);
    assert_int_equal(r.status, 200);
    assert_string_equal(reply_header(&r, "Content-Type"), files[i][1]);
    assert_string_equal(reply_header(&r, "Cache-Control"), "no-cache");
    assert_string_equal(reply_header(&r, "Access-Control-Allow-Origin"), "*");
    const char *tag = reply_header(&r, "ETag");
    assert_int_equal(tag[0], '"');
    char headers[96];
    snprintf(headers, sizeof headers, "If-None-Match: %s\n", tag);
    reply again = loopback_ask(*state, "GET", files[i][0], headers, NULL, 0);
    assert_int_equal(again.status, 304);
    assert_string_equal(reply_header(&again, "ETag"), tag);
    reply_free(&again);
    reply coded = loopback_ask(*state, "GET", files[i][0], "Accept-Encoding: gzip\n", NULL, 0);
    assert_string_equal(reply_header(&coded, "Content-Encoding"), "gzip");
    assert_string_not_equal(reply_header(&coded, "ETag"), tag);
    reply_free(&coded);
    reply_free(&r);
  }
}

TEST_WITH(operations_answer_json, loopback_setup, loopback_teardown) {
  const char *const paths[] = {"/healthz", "/readyz", "/version", "/openapi.json"};
  for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
    reply r = loopback_get(*state, paths[i]);
    assert_int_equal(r.status, 200);
    assert_string_equal(reply_header(&r, "Content-Type"), "application/json");
    assert_int_equal(r.body[0], '{');
    reply_free(&r);
    assert_true(loopback_is_light(*state, paths[i]));
    assert_string_equal(api_route_name(paths[i]), paths[i]);
  }
}

TEST_WITH(draining_shows_in_readyz_alone, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  api_service_drain(loop->service);
  reply r = loopback_get(loop, "/readyz");
  assert_non_null(reply_header(&r, "Retry-After"));
  assert_problem(r, 503, NULL, "draining");
  r = loopback_get(loop, "/healthz");
  assert_int_equal(r.status, 200);
  reply_free(&r);
}

TEST_WITH(a_store_that_fails_shows_in_readyz_alone, loopback_setup, loopback_teardown) {
  loopback_store_fail(*state, true);
  reply r = loopback_get(*state, "/readyz");
  assert_non_null(reply_header(&r, "Retry-After"));
  assert_problem(r, 503, NULL, "store");
  r = loopback_get(*state, "/healthz");
  assert_int_equal(r.status, 200);
  reply_free(&r);
  loopback_store_fail(*state, false);
  r = loopback_get(*state, "/readyz");
  assert_int_equal(r.status, 200);
  reply_free(&r);
}

TEST_WITH(options_answers_allow_and_preflight, loopback_setup, loopback_teardown) {
  reply r = loopback_ask(*state, "OPTIONS", "/healthz", NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  assert_string_equal(reply_header(&r, "Allow"), "GET, HEAD, OPTIONS");
  assert_null(reply_header(&r, "Access-Control-Allow-Methods"));
  assert_string_equal(reply_header(&r, "Access-Control-Allow-Origin"), "*");
  reply_free(&r);
  r = loopback_ask(*state, "OPTIONS", "/healthz",
                   "Origin: https://a.example\nAccess-Control-Request-Method: GET\n", NULL, 0);
  assert_int_equal(r.status, 204);
  assert_string_equal(reply_header(&r, "Access-Control-Allow-Methods"), "GET, HEAD, OPTIONS");
  assert_non_null(strstr(reply_header(&r, "Access-Control-Allow-Headers"), "If-None-Match"));
  reply_free(&r);
  assert_problem(loopback_ask(*state, "OPTIONS", "/nothing", NULL, NULL, 0), 404, NULL, NULL);
}

TEST(origins_of_a_list_are_echoed) {
  api_settings settings = loopback_settings();
  settings.cors_origins = "https://a.example, https://b.example";
  loopback *loop = loopback_start(&settings);
  reply r = loopback_ask(loop, "GET", "/healthz", "Origin: https://b.example\n", NULL, 0);
  assert_string_equal(reply_header(&r, "Access-Control-Allow-Origin"), "https://b.example");
  assert_non_null(strstr(reply_header(&r, "Vary"), "Origin"));
  reply_free(&r);
  r = loopback_ask(loop, "GET", "/healthz", "Origin: https://b.example.evil\n", NULL, 0);
  assert_null(reply_header(&r, "Access-Control-Allow-Origin"));
  assert_non_null(strstr(reply_header(&r, "Vary"), "Origin"));
  reply_free(&r);
  loopback_stop(loop);
}

TEST(problems_of_the_server_have_the_form) {
  reply r = {0};
  api_problem(503, "the queue is full, \"sorry\"", "request-1", 2, &r.answer);
  r.status = r.answer.status;
  r.body = calloc(r.answer.bytes.size + 1, 1);
  memcpy(r.body, r.answer.bytes.data, r.answer.bytes.size);
  assert_string_equal(reply_header(&r, "Retry-After"), "2");
  assert_problem(r, 503, NULL, "\"sorry\"");
}
