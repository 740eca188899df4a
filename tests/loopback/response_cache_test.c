/* Answers that are asked for again. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "service.h"

static const char wheel[] =
    "{'nodes':[{'name':'wheel'}],'clips':[{'name':'turn','tracks':[{'node':'wheel','path':'rotation',"
    "'times':[0,1],'quaternions':[[0,0,0,1],[0,0,1,0]]}]}]}";

/* Too many times for a light call. */
#define MANY "from=0&to=1&fps=3000"

static int setup(void **state) {
  *state = one_model_start(NULL, wheel);
  return 0;
}

static const char *target_of(const one_model *f, const char *rest) {
  static char target[256];
  snprintf(target, sizeof target, "/v1/models/%s/%s", f->id, rest);
  return target;
}

static reply ask(const one_model *f, const char *rest, const char *headers) {
  return loopback_ask(f->loop, "GET", target_of(f, rest), headers, NULL, 0);
}

/* Whether the answer is at hand. */
static bool is_known(const one_model *f, const char *rest) {
  return loopback_is_light(f->loop, target_of(f, rest));
}

static uint64_t cached(const one_model *f) {
  return api_cache_idle_size(f->loop->service->cache);
}

static void ask_times(const one_model *f, const char *rest, int times) {
  for (int i = 0; i < times; i++) {
    reply r = ask(f, rest, NULL);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
}

static void assert_same_header(const reply *a, const reply *b, const char *name) {
  assert_non_null(reply_header(a, name));
  assert_string_equal(reply_header(a, name), reply_header(b, name));
}

TEST_WITH(an_answer_is_remembered_from_the_second_time_on_and_stays_the_same, setup, fixture_stop) {
  one_model *f = *state;
  static const char *const targets[] = {"pose.json?" MANY, "pose.ndjson?" MANY, "pose.bin?" MANY,
                                        "pose.csv?" MANY, "pose.json?as=euler&" MANY};
  for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
    reply first = ask(f, targets[i], NULL);
    uint64_t before = cached(f);
    assert_false(is_known(f, targets[i]));
    ask_times(f, targets[i], 1);
    assert_true(is_known(f, targets[i]));
    assert_in_range(cached(f) - before, first.size, first.size + 1000);
    reply third = ask(f, targets[i], NULL);
    assert_int_equal(third.status, 200);
    assert_int_equal(third.size, first.size);
    assert_memory_equal(third.body, first.body, first.size);
    assert_int_equal(third.answer.header_count, first.answer.header_count);
    for (size_t j = 0; j < first.answer.header_count; j++)
      assert_same_header(&first, &third, first.answer.headers[j].name);
    reply_free(&first);
    reply_free(&third);
  }
}

TEST_WITH(one_request_in_other_words_is_the_same, setup, fixture_stop) {
  one_model *f = *state;
  ask_times(f, "pose.csv?" MANY "&clip=turn", 2);
  uint64_t before = cached(f);
  assert_true(is_known(f, "pose.csv?clip=turn&fps=3e3&to=1.0&from=0&space=local&nodes=wheel"));
  assert_true(is_known(f, "pose.csv?" MANY));
  reply r = ask(f, "pose?" MANY, "Accept: text/csv\n");
  assert_int_equal(r.size, r.answer.body.size);
  reply_free(&r);
  assert_int_equal(cached(f), before);
  static const char *const others[] = {"pose.csv?from=0&to=1&fps=3001",
                                       "pose.csv?from=0.5&to=1.5&fps=3000",
                                       "pose.csv?as=euler&" MANY,
                                       "pose.csv?space=world&" MANY,
                                       "pose.csv?loop=repeat&" MANY,
                                       "pose.csv?interpolation=step&" MANY,
                                       "pose.json?" MANY};
  for (size_t i = 0; i < sizeof others / sizeof *others; i++) assert_false(is_known(f, others[i]));
}

TEST_WITH(what_is_asked_for_once_pushes_nothing_out, setup, fixture_stop) {
  one_model *f = *state;
  ask_times(f, "surface.json?clip=none", 1);
  ask_times(f, "pose.json?at=1", 1); /* the clip */
  uint64_t before = cached(f);
  size_t opens = loopback_store_opens(f->loop);
  for (int i = 0; i < 150; i++) { /* of some 500,000 bytes each, in a cache of 64 MiB */
    char rest[64];
    snprintf(rest, sizeof rest, "pose.json?from=0&to=1&fps=%d", 6000 + i);
    ask_times(f, rest, 1);
  }
  assert_int_equal(cached(f), before);
  assert_true(is_known(f, "surface.json?clip=none"));
  assert_true(is_known(f, "pose.json?at=1"));
  assert_int_equal(loopback_store_opens(f->loop), opens);
}

TEST_WITH(light_answers_are_not_remembered, setup, fixture_stop) {
  one_model *f = *state;
  ask_times(f, "pose.json?at=0.5", 1);
  uint64_t before = cached(f);
  ask_times(f, "pose.json?at=0.5", 3);
  assert_int_equal(cached(f), before);
}

TEST_WITH(larger_answers_than_four_megabytes_are_not_remembered, setup, fixture_stop) {
  one_model *f = *state;
  static const char large[] = "pose.bin?from=0&to=1&fps=120000";
  ask_times(f, large, 3); /* 4.8 MB of numbers */
  assert_false(is_known(f, large));
  ask_times(f, "pose.bin?from=0&to=1&fps=90000", 2); /* 3.6 MB */
  assert_true(is_known(f, "pose.bin?from=0&to=1&fps=90000"));
  assert_true(cached(f) < 6 << 20);
}

/* Each line of CSV bears its node's name. */
TEST_WITH(long_names_count, setup, fixture_stop) {
  one_model *f = *state;
  enum { NODES = 100, NAME = 1000 };
  char *model = malloc(NODES * (NAME + 32)), *end = model + sprintf(model, "{'nodes':[");
  for (int i = 0; i < NODES; i++) end += sprintf(end, "%s{'name':'%0*d'}", i > 0 ? "," : "", NAME, i);
  strcpy(end, "]}");
  loopback_upload(f->loop, "application/json", model, f->id);
  free(model);
  static const char lines[] = "pose.csv?from=0&to=1&fps=100";
  ask_times(f, lines, 3);
  assert_false(is_known(f, lines));
  assert_true(is_known(f, "pose.json?from=0&to=1&fps=10"));
  assert_true(cached(f) < 1 << 20);
}

TEST_WITH(conditions_are_judged_before_an_answer_is_made, setup, fixture_stop) {
  one_model *f = *state;
  reply r = ask(f, "pose.json?" MANY, NULL);
  char header[128];
  snprintf(header, sizeof header, "If-None-Match: %s\n", reply_header(&r, "ETag"));
  reply_free(&r);
  for (int i = 0; i < 2; i++) { /* missing, and remembered */
    r = ask(f, "pose.json?" MANY, header);
    assert_int_equal(r.status, 304);
    assert_int_equal(r.size, 0);
    reply_free(&r);
    r = ask(f, "pose.json?" MANY, "If-Match: \"other\"\n");
    assert_problem(r, 412, NULL, "If-Match");
    assert_int_equal(is_known(f, "pose.json?" MANY), i);
    ask_times(f, "pose.json?" MANY, 1);
  }
}

TEST_WITH(head_tells_the_size, setup, fixture_stop) {
  one_model *f = *state;
  ask_times(f, "pose.json?" MANY, 2);
  reply r = ask(f, "pose.json?" MANY, NULL);
  reply head = loopback_ask(f->loop, "HEAD", target_of(f, "pose.json?" MANY), NULL, NULL, 0);
  assert_int_equal(head.answer.body.size, r.size);
  assert_same_header(&r, &head, "ETag");
  reply_free(&r);
  reply_free(&head);
}

TEST_WITH(a_deleted_models_answers_go_with_it, setup, fixture_stop) {
  one_model *f = *state;
  ask_times(f, "pose.json?" MANY, 2);
  char target[128];
  snprintf(target, sizeof target, "/v1/models/%s", f->id);
  reply r = loopback_ask(f->loop, "DELETE", target, NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  assert_int_equal(cached(f), 0);
  assert_problem(ask(f, "pose.json?" MANY, NULL), 404, NULL, NULL);
}

TEST_WITH(a_borrowed_clips_answers_go_with_its_lender, setup, fixture_stop) {
  one_model *f = *state;
  one_model borrower = {.loop = f->loop};
  char rest[128], target[64];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'wheel'},{'name':'axle'}]}", borrower.id);
  snprintf(rest, sizeof rest, "pose.json?clip=%s%%2Fturn&" MANY, f->id);
  ask_times(&borrower, rest, 2);
  assert_true(is_known(&borrower, rest));
  snprintf(target, sizeof target, "/v1/models/%s", f->id);
  reply r = loopback_ask(f->loop, "DELETE", target, NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  assert_problem(ask(&borrower, rest, NULL), 404, NULL, NULL);
}

/* As another daemon on the same store does it. */
static void delete_behind(const one_model *f, const char *id) {
  const api_store *store = &f->loop->settings.store;
  assert_int_equal(store->remove(store->context, id), API_STORE_OK);
}

TEST_WITH(what_another_daemon_deleted_is_not_answered_from_memory, setup, fixture_stop) {
  one_model *f = *state;
  static const char *const targets[] = {("pose.json?" MANY),    "live?fps=1", "tracks", "source",
                                        "surface.json?level=0", "pose?at=0"};
  char model[64];
  snprintf(model, sizeof model, "/v1/models/%s", f->id);
  for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
    ask_times(f, targets[i], 3);
  }
  reply r = loopback_get(f->loop, model);
  assert_int_equal(r.status, 200);
  reply_free(&r);
  delete_behind(f, f->id);
  for (size_t i = 0; i < sizeof targets / sizeof *targets; i++)
    assert_problem(ask(f, targets[i], NULL), 404, NULL, f->id);
  assert_problem(ask(f, targets[0], "If-None-Match: *\n"), 404, NULL, f->id);
  assert_problem(loopback_get(f->loop, model), 404, NULL, f->id);
  assert_int_equal(cached(f), 0);
}

TEST_WITH(a_clip_is_not_borrowed_from_what_another_daemon_deleted, setup, fixture_stop) {
  one_model *f = *state;
  one_model borrower = {.loop = f->loop};
  char rest[128];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'wheel'},{'name':'axle'}]}", borrower.id);
  snprintf(rest, sizeof rest, "pose.json?clip=%s%%2Fturn&" MANY, f->id);
  ask_times(&borrower, rest, 2);
  delete_behind(f, f->id);
  assert_problem(ask(&borrower, rest, NULL), 404, NULL, f->id);
  snprintf(rest, sizeof rest, "live?fps=1&clip=%s%%2Fturn", f->id);
  assert_problem(ask(&borrower, rest, NULL), 404, NULL, f->id);
}

static api_store_status (*plain_look)(void *context, const char *id, bool may_wait);
static api_service *forgetting;
static int looks_left; /* before one that drops the model from the cache */

static api_store_status look_and_forget(void *context, const char *id, bool may_wait) {
  if (--looks_left == 0) api_cache_forget(forgetting->cache, id);
  return plain_look(context, id, may_wait);
}

TEST_WITH(a_lender_may_leave_the_cache_before_any_look_for_its_clip, setup, fixture_stop) {
  enum { LOOKS = 6 };
  one_model *f = *state;
  one_model borrower = {.loop = f->loop};
  api_settings settings = f->loop->settings;
  char absent[128], detail[128];
  loopback_upload(f->loop, "application/json", "{'nodes':[{'name':'wheel'}]}", borrower.id);
  plain_look = settings.store.look;
  settings.store.look = look_and_forget;
  api_service_destroy(f->loop->service);
  forgetting = f->loop->service = api_service_create(&settings);
  snprintf(absent, sizeof absent, "pose.json?at=1&clip=%s%%2Fno,ne", f->id);
  snprintf(detail, sizeof detail, "is called \"no\"; there are: turn");
  for (int looks = 1; looks < LOOKS; looks++) {
    looks_left = 0; /* both models are cached */
    assert_problem(ask(&borrower, absent, NULL), 404, NULL, detail);
    looks_left = looks;
    assert_problem(ask(&borrower, absent, NULL), 404, NULL, detail);
  }
  assert_true(looks_left > 0); /* more looks than there are were tried */
}

TEST_WITH(times_in_a_body_are_another_request, setup, fixture_stop) {
  one_model *f = *state;
  ask_times(f, "pose.json?" MANY, 2);
  reply r = loopback_post(f->loop, target_of(f, "pose.json"), "application/json", "{'times':[1]}");
  assert_int_equal(r.status, 200);
  assert_says(&r, "'times':[1]");
  assert_null(reply_header(&r, "ETag"));
  reply_free(&r);
}

TEST(a_remembered_answer_needs_the_key_too) {
  const api_key keys[] = {{"secret", ALL_RIGHTS, {0}}};
  api_settings settings = loopback_settings();
  settings.keyring = (api_keyring){.keys = keys, .count = 1};
  one_model m = {.loop = loopback_start(&settings)};
  const char *key = "X-API-Key: secret\n";
  reply r =
      loopback_post_with(m.loop, "/v1/models", "X-API-Key: secret\nContent-Type: application/json\n", wheel);
  assert_int_equal(r.status, 201);
  memcpy(m.id, strrchr(reply_header(&r, "Location"), '/') + 1, API_ID_TEXT);
  reply_free(&r);
  for (int i = 0; i < 3; i++) {
    r = ask(&m, "pose.json?" MANY, key);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  assert_problem(ask(&m, "pose.json?" MANY, NULL), 401, NULL, NULL);
  loopback_stop(m.loop);
}
