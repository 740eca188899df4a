/* Entity tags of models: what they save, and what they keep from being deleted. */
#include "stored_models.h"

#include <stdio.h>
#include <string.h>

TEST_WITH(validators_save_sending, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], paths[2][64], headers[256];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(paths[0], sizeof paths[0], "/v1/models/%s", id);
  snprintf(paths[1], sizeof paths[1], "/v1/models/%s/source", id);
  for (int i = 0; i < 2; i++) {
    reply r = loopback_get(*state, paths[i]);
    char etag[80];
    strcpy(etag, reply_header(&r, "ETag"));
    assert_string_equal(reply_header(&r, "Cache-Control"), "public, max-age=31536000, immutable");
    const char *vary = i == 0 ? "Accept, Accept-Encoding" : "Accept-Encoding"; /* a source has one type */
    assert_string_equal(reply_header(&r, "Vary"), vary);
    reply_free(&r);
    const char *const hits[] = {"If-None-Match: %s\n", "If-None-Match: \"a\", W/%s\n", "If-None-Match:  * \n",
                                "If-None-Match: \"x,y\" ,%s , \"b\"\n"};
    for (size_t j = 0; j < sizeof hits / sizeof *hits; j++) {
      snprintf(headers, sizeof headers, hits[j], etag);
      r = get_with(*state, paths[i], headers);
      assert_int_equal(r.status, 304);
      assert_int_equal(r.size, 0);
      assert_string_equal(reply_header(&r, "ETag"), etag);
      assert_string_equal(reply_header(&r, "Vary"), vary);
      assert_null(reply_header(&r, "Content-Type"));
      reply_free(&r);
    }
    const char *const misses[] = {"If-None-Match: \"a\"\n", "If-None-Match: a\n", "If-Match: %s\n"};
    for (size_t j = 0; j < sizeof misses / sizeof *misses; j++) {
      snprintf(headers, sizeof headers, misses[j], etag);
      r = get_with(*state, paths[i], headers);
      assert_int_equal(r.status, 200);
      reply_free(&r);
    }
    assert_problem(get_with(*state, paths[i], "If-Match: \"a\"\n"), 412, NULL, NULL);
    snprintf(headers, sizeof headers, "If-Match: W/%s\n", etag);
    assert_problem(get_with(*state, paths[i], headers), 412, NULL, NULL);
  }
}

TEST_WITH(head_has_the_headers_of_get, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply get = loopback_get(*state, path);
  reply head = loopback_ask(*state, "HEAD", path, NULL, NULL, 0);
  assert_int_equal(head.status, 200);
  assert_int_equal(head.answer.bytes.size, get.answer.bytes.size);
  assert_string_equal(reply_header(&head, "ETag"), reply_header(&get, "ETag"));
  reply_free(&head);
  reply_free(&get);
}

TEST_WITH(what_if_none_match_names_is_not_deleted, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64], headers[160];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply plain = loopback_get(*state, path);
  const char *const hits[] = {"If-None-Match: *\n", "If-None-Match: \"a\", %s\n", "If-None-Match: W/%s\n"};
  for (size_t i = 0; i < sizeof hits / sizeof *hits; i++) {
    snprintf(headers, sizeof headers, hits[i], reply_header(&plain, "ETag"));
    assert_problem(loopback_ask(*state, "DELETE", path, headers, NULL, 0), 412, NULL, "If-None-Match");
  }
  reply_free(&plain);
  assert_int_equal(loopback_store_count(*state), 1);
  reply r = loopback_ask(*state, "DELETE", path, "If-None-Match: \"a\", *\n", NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  const char *const conditions[] = {"If-None-Match: *\n", "If-Match: \"a\"\n"};
  for (size_t i = 0; i < sizeof conditions / sizeof *conditions; i++) /* nothing is there to be judged */
    assert_problem(loopback_ask(*state, "DELETE", path, conditions[i], NULL, 0), 404, NULL, NULL);
}

TEST_WITH(what_if_match_does_not_name_is_not_deleted, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64], headers[160];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply packed = get_with(*state, path, "Accept-Encoding: gzip\n");
  const char *const misses[] = {"If-Match: \"a\"\n", "If-Match: W/%s\n"};
  for (size_t i = 0; i < sizeof misses / sizeof *misses; i++) {
    snprintf(headers, sizeof headers, misses[i], reply_header(&packed, "ETag"));
    assert_problem(loopback_ask(*state, "DELETE", path, headers, NULL, 0), 412, NULL, "If-Match");
  }
  assert_int_equal(loopback_store_count(*state), 1);
  snprintf(headers, sizeof headers, "If-Match: \"a\", %s\n", reply_header(&packed, "ETag"));
  reply_free(&packed);
  reply r = loopback_ask(*state, "DELETE", path, headers, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  assert_problem(loopback_ask(*state, "DELETE", path, "If-Match: *\n", NULL, 0), 404, NULL, NULL);
}

/* A name is no part of the bytes that the id is made of: once the model is deleted, another may be given. */
TEST_WITH(the_tag_of_a_description_is_of_its_name, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64], first[160], headers[192];
  reply r = loopback_post(*state, "/v1/models?name=one", "model/obj", triangle);
  snprintf(first, sizeof first, "%s", reply_header(&r, "ETag"));
  reply_free(&r);
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  r = loopback_get(*state, path);
  assert_string_equal(reply_header(&r, "ETag"), first);
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  r = loopback_post(*state, "/v1/models?name=two", "model/obj", triangle);
  assert_string_not_equal(reply_header(&r, "ETag"), first);
  reply_free(&r);
  snprintf(headers, sizeof headers, "If-None-Match: %s\n", first);
  r = get_with(*state, path, headers);
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(r.body, "\"two\""));
  assert_string_not_equal(reply_header(&r, "ETag"), first);
  snprintf(headers, sizeof headers, "If-Match: %s\n", first);
  assert_problem(loopback_ask(*state, "DELETE", path, headers, NULL, 0), 412, NULL, "If-Match");
  snprintf(headers, sizeof headers, "If-Match: %s\n", reply_header(&r, "ETag"));
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, headers, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
}
