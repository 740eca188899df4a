/* The list of models, page by page. */
#include "stored_models.h"

#include <stdio.h>
#include <string.h>

/* Uploads `count` models that differ. */
static void upload_many(loopback *loop, int count) {
  for (int i = 0; i < count; i++) {
    char text[64], id[API_ID_TEXT];
    snprintf(text, sizeof text, "{'nodes':[{'name':'n%d'}]}", i);
    loopback_upload(loop, "application/json", text, id);
  }
}

/* Walks the pages; returns how many models were listed, each with a name like n7. */
static int walk_list(loopback *loop, const char *first) {
  char url[128];
  char last[API_ID_TEXT] = "";
  int seen = 0;
  strcpy(url, first);
  while (url[0]) {
    reply r = loopback_get(loop, url);
    assert_int_equal(r.status, 200);
    cJSON *page = cJSON_Parse(r.body);
    const cJSON *item;
    cJSON_ArrayForEach(item, json_member(page, "models")) {
      const char *id = json_member(item, "id")->valuestring;
      assert_true(strcmp(last, id) < 0);
      strcpy(last, id);
      assert_int_equal(json_member(item, "name")->valuestring[0], 'n');
      assert_string_equal(json_member(item, "format")->valuestring, "tweend");
      assert_true(json_member(item, "bytes")->valueint > 20);
      seen++;
    }
    const cJSON *next = json_member(page, "next");
    assert_int_equal(cJSON_IsString(next), reply_header(&r, "Link") != NULL);
    strcpy(url, cJSON_IsString(next) ? next->valuestring : "");
    cJSON_Delete(page);
    reply_free(&r);
  }
  return seen;
}

TEST_WITH(the_list_is_walked_page_by_page, loopback_setup, loopback_teardown) {
  reply r = loopback_get(*state, "/v1/models");
  assert_body(&r, "{'models':[],'next':null}\n");
  reply_free(&r);
  upload_many(*state, 11);
  assert_int_equal(walk_list(*state, "/v1/models"), 11);
  assert_int_equal(walk_list(*state, "/v1/models?limit=1"), 11);
  assert_int_equal(walk_list(*state, "/v1/models?limit=11"), 11);
  assert_int_equal(walk_list(*state, "/v1/models?limit=4"), 11);
}

TEST_WITH(lost_summaries_are_made_again, loopback_setup, loopback_teardown) {
  upload_many(*state, 3);
  loopback_store_forget_summaries(*state);
  assert_int_equal(walk_list(*state, "/v1/models?limit=2"), 3);
}

TEST_WITH(a_damaged_model_is_left_out_of_a_list_that_must_read_it, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT];
  loopback_upload(loop, "application/json", turning, id);
  upload_many(loop, 2);
  loopback_store_forget_summaries(loop);
  loopback_store_damage(loop, id);
  char path[64];
  snprintf(path, sizeof path, "/v1/models/%s", id);
  assert_problem(loopback_get(loop, path), 500, NULL, NULL);
  assert_int_equal(walk_list(loop, "/v1/models"), 2);
}

TEST_WITH(bad_paging_is_400, loopback_setup, loopback_teardown) {
  const char *const bad[] = {"limit=0",  "limit=1001", "limit=x",
                             "limit=-1", "limit=",     "limit=1&limit=2",
                             "after=x",  "after=",     "after=0123456789ABCDEF0123456789ABCDEF",
                             "before=1"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char target[128];
    snprintf(target, sizeof target, "/v1/models?%s", bad[i]);
    assert_problem(loopback_get(*state, target), 400, NULL, NULL);
  }
}
