/* Answers that are asked for again. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kept_answer.h"
#include "service.h"

static const char wheel[] =
    "{\"nodes\":[{\"name\":\"wheel\"}],\"clips\":[{\"name\":\"turn\",\"tracks\":[{\"node\":\"wheel\","
    "\"path\":\"rotation\",\"times\":[0,1],\"quaternions\":[[0,0,0,1],[0,0,1,0]]}]}]}";

static int setup(void **state) {
  *state = one_model_start(NULL, wheel);
  return 0;
}

static reply ask(const one_model *f, const char *rest, const char *headers) {
  char target[256];
  snprintf(target, sizeof target, "/v1/models/%s/%s", f->id, rest);
  return loopback_ask(f->loop, "GET", target, headers, NULL, 0);
}

static uint64_t kept(const one_model *f) {
  return api_kept_answers_size(f->loop->service->answers);
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

static void an_answer_is_kept_from_the_second_time_on_and_stays_the_same(void **state) {
  one_model *f = *state;
  static const char *const targets[] = {"pose.json?at=0.5", "pose.bin?at=0.5", "pose.csv?at=0.5",
                                        "pose.json?at=0.25"};
  for (size_t i = 0; i < sizeof targets / sizeof *targets; i++) {
    uint64_t before = kept(f);
    reply first = ask(f, targets[i], NULL);
    assert_int_equal(kept(f), before);
    ask_times(f, targets[i], 1);
    assert_true(kept(f) > before);
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

static void a_time_is_the_same_in_other_words_and_another_one_is_not(void **state) {
  one_model *f = *state;
  ask_times(f, "pose.json?at=0.5&space=local", 3);
  uint64_t before = kept(f);
  reply first = ask(f, "pose.json?at=0.5&space=local", NULL);
  reply same = ask(f, "pose.json?at=5e-1&space=local", NULL);
  reply other = ask(f, "pose.json?at=0.50000006&space=local", NULL);
  assert_memory_equal(same.body, first.body, first.size);
  assert_same_header(&first, &same, "ETag");
  assert_non_null(strstr(other.body, "\"times\":[0.50000006]"));
  assert_int_equal(kept(f), before);
  reply_free(&first);
  reply_free(&same);
  reply_free(&other);
  reply broken = ask(f, "pose.json?at=1e99&space=local", NULL);
  assert_problem(broken, 400, NULL, "at");
}

static void conditions_are_judged_on_a_kept_answer(void **state) {
  one_model *f = *state;
  ask_times(f, "pose.json?at=0.5", 3);
  reply r = ask(f, "pose.json?at=0.5", NULL);
  char header[128];
  snprintf(header, sizeof header, "If-None-Match: %s\n", reply_header(&r, "ETag"));
  reply_free(&r);
  r = ask(f, "pose.json?at=0.5", header);
  assert_int_equal(r.status, 304);
  assert_int_equal(r.size, 0);
  reply_free(&r);
  r = ask(f, "pose.json?at=0.5", "If-Match: \"other\"\n");
  assert_problem(r, 412, NULL, "If-Match");
}

static void a_deleted_models_answers_go_with_it(void **state) {
  one_model *f = *state;
  char target[256];
  ask_times(f, "pose.json?at=0.5", 3);
  assert_true(kept(f) > 0);
  snprintf(target, sizeof target, "/v1/models/%s", f->id);
  reply r = loopback_ask(f->loop, "DELETE", target, NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  assert_int_equal(kept(f), 0);
  assert_problem(ask(f, "pose.json?at=0.5", NULL), 404, NULL, NULL);
}

static void what_accept_decides_is_not_kept(void **state) {
  one_model *f = *state;
  ask_times(f, "pose?at=0.5", 3);
  assert_int_equal(kept(f), 0);
}

static void a_body_is_another_question(void **state) {
  one_model *f = *state;
  char target[256];
  ask_times(f, "pose.json?space=local", 3);
  assert_true(kept(f) > 0);
  snprintf(target, sizeof target, "/v1/models/%s/pose.json?space=local", f->id);
  reply r = loopback_post(f->loop, target, "application/json", "{\"times\":[1]}");
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(r.body, "\"times\":[1]"));
  reply_free(&r);
  assert_problem(loopback_ask(f->loop, "POST", target, NULL, "", 0), 400, NULL, "empty");
}

static void long_answers_are_not_kept(void **state) {
  one_model *f = *state;
  ask_times(f, "pose.json?from=0&to=1&fps=1500", 3); /* some 90,000 bytes, printed at once */
  assert_int_equal(kept(f), 0);
}

static void a_clip_that_is_borrowed_goes_with_its_lender(void **state) {
  one_model *f = *state;
  char other[API_ID_TEXT], rest[128], target[256];
  loopback_upload(f->loop, "application/json", "{\"nodes\":[{\"name\":\"wheel\"},{\"name\":\"axle\"}]}",
                  other);
  snprintf(rest, sizeof rest, "pose.json?clip=%s%%2Fturn&at=1", f->id);
  snprintf(target, sizeof target, "/v1/models/%s/%s", other, rest);
  for (int i = 0; i < 3; i++) {
    reply r = loopback_get(f->loop, target);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  assert_int_equal(kept(f), 0);
}

static void a_kept_answer_needs_the_key_too(void **state) {
  (void)state;
  const char *keys[] = {"secret", NULL};
  api_settings settings = loopback_settings();
  settings.api_keys = keys;
  one_model m = {.loop = loopback_start(&settings)};
  const char *key = "X-API-Key: secret\n";
  reply r = loopback_ask(m.loop, "POST", "/v1/models", "X-API-Key: secret\nContent-Type: application/json\n",
                         wheel, strlen(wheel));
  assert_int_equal(r.status, 201);
  const char *id = strstr(r.body, "\"id\":\"");
  assert_non_null(id);
  memcpy(m.id, id + strlen("\"id\":\""), API_ID_TEXT - 1);
  reply_free(&r);
  for (int i = 0; i < 3; i++) {
    r = ask(&m, "pose.json?at=0.5", key);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  assert_true(kept(&m) > 0);
  assert_problem(ask(&m, "pose.json?at=0.5", NULL), 401, NULL, NULL);
  loopback_stop(m.loop);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup_teardown(an_answer_is_kept_from_the_second_time_on_and_stays_the_same, setup,
                                      one_model_stop),
      cmocka_unit_test_setup_teardown(a_time_is_the_same_in_other_words_and_another_one_is_not, setup,
                                      one_model_stop),
      cmocka_unit_test_setup_teardown(conditions_are_judged_on_a_kept_answer, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(a_deleted_models_answers_go_with_it, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(what_accept_decides_is_not_kept, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(a_body_is_another_question, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(long_answers_are_not_kept, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(a_clip_that_is_borrowed_goes_with_its_lender, setup, one_model_stop),
      cmocka_unit_test(a_kept_answer_needs_the_key_too),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
