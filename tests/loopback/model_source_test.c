/* The bytes of a model as they were uploaded: whole, in parts, with their type. */
#include "call.h"
#include "service.h"
#include "stored_models.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void assert_source(loopback *loop, const char *id, const char *type, const char *extension) {
  char path[80], file[80];
  snprintf(path, sizeof path, "/v1/models/%s/source?download=1", id);
  reply r = loopback_get(loop, path);
  assert_int_equal(r.status, 200);
  assert_string_equal(reply_header(&r, "Content-Type"), type);
  snprintf(file, sizeof file, "model.%s\"", extension);
  assert_non_null(strstr(reply_header(&r, "Content-Disposition"), file));
  reply_free(&r);
}

/* Five facets, more bytes than a look at the beginning takes. */
TEST_WITH(the_source_of_binary_stl_has_its_type, loopback_setup, loopback_teardown) {
  enum { FACETS = 5, SIZE = 84 + 50 * FACETS };
  uint8_t stl[SIZE] = {[80] = FACETS};
  for (size_t f = 0; f < FACETS; f++)
    for (size_t p = 0; p < 3; p++) {
      const float point[3] = {p == 1 ? 1 : 0, p == 2 ? 1 : 0, (float)f};
      memcpy(stl + 84 + 50 * f + 12 * (1 + p), point, sizeof point);
    }
  reply r = loopback_ask(*state, "POST", "/v1/models", "Content-Type: model/stl\n", stl, SIZE);
  assert_says(&r, "'format':'stl'");
  char id[API_ID_TEXT];
  memcpy(id, reply_header(&r, "Location") + strlen("/v1/models/"), sizeof id);
  reply_free(&r);
  assert_source(*state, id, "model/stl", "stl");
  loopback_store_forget_summaries(*state);
  assert_source(*state, id, "model/stl", "stl");
}

TEST_WITH(the_source_comes_back_whole_and_in_parts, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64], header[128];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  reply r = loopback_get(*state, path);
  assert_int_equal(r.status, 200);
  assert_string_equal(r.body, triangle);
  assert_string_equal(reply_header(&r, "Content-Type"), "model/obj");
  assert_string_equal(reply_header(&r, "Accept-Ranges"), "bytes");
  char etag[80];
  strcpy(etag, reply_header(&r, "ETag"));
  reply_free(&r);
  static const struct {
    const char *range;
    size_t first, count;
  } parts[] = {{"0-0", 0, 1},
               {"2-6", 2, 5},
               {"-4", sizeof triangle - 5, 4},
               {"3-", 3, sizeof triangle - 4},
               {"1-9999", 1, sizeof triangle - 2},
               {"-9999", 0, sizeof triangle - 1},
               {"0-1,2-4", 0, 5},
               {"4-5 , 1-3,2-3", 1, 5},
               {"9999-,3-4", 3, 2}};
  for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
    snprintf(header, sizeof header, "Range: bytes=%s\n", parts[i].range);
    r = get_with(*state, path, header);
    assert_int_equal(r.status, 206);
    assert_int_equal(r.size, parts[i].count);
    assert_memory_equal(r.body, triangle + parts[i].first, parts[i].count);
    snprintf(header, sizeof header, "bytes %zu-%zu/%zu", parts[i].first, parts[i].first + parts[i].count - 1,
             sizeof triangle - 1);
    assert_string_equal(reply_header(&r, "Content-Range"), header);
    reply_free(&r);
  }
  const char *const whole[] = {"Range: bytes=5-2\n",
                               "Range: bytes=x\n",
                               "Range: lines=1-2\n",
                               "Range: bytes=-\n",
                               "Range: bytes=0-1,3-4\n",
                               "Range: bytes=0-1,\n",
                               "Range: bytes=0-1,x\n",
                               "Range: bytes=0-1\nIf-Range: \"other\"\n",
                               "Range: bytes=0-1\nIf-Range: Sat, 21 Nov 2026 00:00:00 GMT\n",
                               "Range: bytes=99999999999999999999999-\n"};
  for (size_t i = 0; i < sizeof whole / sizeof *whole; i++) {
    r = get_with(*state, path, whole[i]);
    assert_int_equal(r.status, 200);
    assert_int_equal(r.size, sizeof triangle - 1);
    reply_free(&r);
  }
  snprintf(header, sizeof header, "Range: bytes=0-1\nIf-Range: %s\n", etag);
  r = get_with(*state, path, header);
  assert_int_equal(r.status, 206);
  reply_free(&r);
  r = get_with(*state, path, "Range: bytes=1000-\n");
  snprintf(header, sizeof header, "bytes */%zu", sizeof triangle - 1);
  assert_string_equal(reply_header(&r, "Content-Range"), header);
  assert_problem(r, 416, NULL, NULL);
  assert_problem(get_with(*state, path, "Range: bytes=-0\n"), 416, NULL, NULL);
}

static const char *no_header(void *context, const char *name) {
  (void)context;
  (void)name;
  return NULL;
}

TEST_WITH(bytes_that_cannot_be_read_on_end_the_answer, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], path[64];
  loopback_upload(loop, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  api_ticket ticket = {0}; /* nobody else asks: it is never woken */
  const api_request request = {
      .method = "GET", .path = path, .query = "", .id = "request-1", .header = no_header, .ticket = &ticket};
  api_answer answer = {0};
  assert_int_equal(api_handle(loop->service, &request, API_HEAVY, &answer), API_ANSWERED);
  assert_int_equal(answer.status, 200);
  uint8_t piece[4];
  assert_int_equal(answer.body.read(answer.body.context, piece, sizeof piece), sizeof piece);
  loopback_store_cut(loop, true);
  assert_int_equal(answer.body.read(answer.body.context, piece, sizeof piece), -1);
  api_answer_deinit(&answer);
  api_ticket_end(loop->service, &ticket);
  loopback_store_forget_summaries(loop); /* so that the bytes are read for their format */
  reply r = loopback_get(loop, path);
  assert_int_equal(r.answer.refusal, API_REFUSAL_STORE);
  assert_non_null(reply_header(&r, "Retry-After"));
  assert_problem(r, 503, NULL, "cannot be reached"); /* nothing says that the bytes are damaged */
  loopback_store_cut(loop, false);
  r = loopback_get(loop, path);
  assert_int_equal(r.status, 200);
  reply_free(&r);
}

TEST_WITH(the_source_has_the_type_of_its_format_however_it_begins, loopback_setup, loopback_teardown) {
  static const struct {
    const char *begin;
    size_t blanks;
    const char *end, *type;
  } cases[] = {
      {"", 0, triangle, "model/obj"},
      {"", 300, triangle, "model/obj"},
      {"", 300, turning, "application/json"},
      {"{", 300, "'nodes':[{}],'asset':{'version':'2.0'}}", "model/gltf+json"},
      {"{'asset':{'version':'2.0'},", 300, "'nodes':[{}]}", "model/gltf+json"},
      {"{", 300, "'nodes':[{'name':'asset'}]}", "application/json"},
  };
  enum { CASES = sizeof cases / sizeof *cases };
  for (size_t i = 0; i < 2 * CASES; i++) {
    if (i == CASES) loopback_store_forget_summaries(*state);
    char text[1024], id[API_ID_TEXT], path[64];
    snprintf(text, sizeof text, "%s%*s%s", cases[i % CASES].begin, (int)cases[i % CASES].blanks, "",
             cases[i % CASES].end);
    loopback_upload(*state, "application/octet-stream", text, id);
    snprintf(path, sizeof path, "/v1/models/%s/source", id);
    reply r = loopback_get(*state, path);
    assert_int_equal(r.status, 200);
    assert_body(&r, text);
    assert_string_equal(reply_header(&r, "Content-Type"), cases[i % CASES].type);
    reply_free(&r);
  }
}

/* All is read to tell the format where no summary does. */
TEST_WITH(a_source_without_summary_waits_for_the_memory_to_read_it, loopback_setup, loopback_teardown) {
  enum { SMALL = 16 }; /* requests that take what large ones leave */
  loopback *loop = *state;
  const api_progress expected[] = {API_ANSWERED, API_WAITS};
  char id[API_ID_TEXT], path[64], *text = malloc(2 * API_UNGRANTED);
  assert_non_null(text);
  snprintf(text, 2 * API_UNGRANTED, "%s#%*s\n", triangle, API_UNGRANTED, "");
  loopback_upload(loop, "model/obj", text, id);
  free(text);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  for (size_t i = 0; i < 2; i++) {
    if (i == 1) loopback_store_forget_summaries(loop);
    loopback_ticket *owner = loopback_ticket_create(), *asker = loopback_ticket_create();
    api_ticket small[SMALL] = {0};
    assert_true(api_budget_grant(loop->service->budget, &owner->ticket, loop->settings.limits.max_memory));
    for (int k = 0; k < SMALL; k++) api_budget_grant(loop->service->budget, &small[k], 4 << 20);
    const api_request request = {.method = "GET",
                                 .path = path,
                                 .query = "",
                                 .id = "request-1",
                                 .header = no_header,
                                 .ticket = &asker->ticket};
    api_answer answer = {0};
    assert_int_equal(api_handle(loop->service, &request, API_HEAVY, &answer), expected[i]);
    for (int k = 0; k < SMALL; k++) api_budget_grant(loop->service->budget, &small[k], 0);
    api_budget_grant(loop->service->budget, &owner->ticket, 0);
    if (expected[i] == API_WAITS) {
      loopback_ticket_await(asker);
      assert_int_equal(api_handle(loop->service, &request, API_HEAVY, &answer), API_ANSWERED);
    }
    assert_int_equal(answer.status, 200);
    api_answer_deinit(&answer);
    loopback_ticket_destroy(loop, owner);
    loopback_ticket_destroy(loop, asker);
  }
}
