/* Poses at one time after the other: what earlier answers left must not show. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kept_answer.h"
#include "service.h"

/* A wheel that turns, an axle that moves, and two nodes that stay as they are. */
static const char cart[] =
    "{\"nodes\":[{\"name\":\"cart\",\"translation\":[0.5,-2,1e-7]},{\"name\":\"wheel\",\"parent\":\"cart\","
    "\"translation\":[0,0.3,0]},{\"name\":\"axle\",\"parent\":\"cart\",\"scale\":[2,1,0.125]},"
    "{\"name\":\"load\",\"parent\":\"axle\"}],\"clips\":[{\"name\":\"turn\",\"tracks\":["
    "{\"node\":\"wheel\",\"path\":\"rotation\",\"times\":[0,1,2],\"quaternions\":[[0,0,0,1],[0.1,0.2,0.9,0.3]"
    ","
    "[0,0,1,0]]},{\"node\":\"axle\",\"path\":\"translation\",\"times\":[0,2],\"values\":[[0,0,0],[1,2,3]]}]}]"
    "}";

static int setup(void **state) {
  *state = one_model_start(NULL, cart);
  return 0;
}

/* query: all but the time. */
static reply ask(const one_model *f, const char *form, const char *query, const char *at) {
  char target[512];
  snprintf(target, sizeof target, "/v1/models/%s/pose.%s?%s&at=%s", f->id, form, query, at);
  return loopback_get(f->loop, target);
}

static uint64_t kept(const one_model *f) {
  return api_kept_answers_size(f->loop->service->answers);
}

/* Asks twice, each time for another time: the second answer is prepared from. */
static void prepare(const one_model *f, const char *form, const char *query) {
  uint64_t before = kept(f);
  for (int i = 0; i < 2; i++) {
    assert_int_equal(kept(f), before);
    reply r = ask(f, form, query, i ? "0.75" : "0.5");
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  assert_true(kept(f) > before);
}

/* Compares with the answer to the same question in other words, which is read from the beginning. */
static void assert_same_answer(const one_model *f, const char *form, const char *query, const char *at) {
  char escaped[64];
  snprintf(escaped, sizeof escaped, "%%%02X%s", at[0], at + 1);
  reply r = ask(f, form, query, at), whole = ask(f, form, query, escaped);
  assert_int_equal(r.status, 200);
  assert_int_equal(whole.status, 200);
  assert_int_equal(r.size, whole.size);
  assert_memory_equal(r.body, whole.body, r.size);
  assert_int_equal(r.answer.header_count, whole.answer.header_count);
  for (size_t i = 0; i < r.answer.header_count; i++) {
    assert_string_equal(r.answer.headers[i].name, whole.answer.headers[i].name);
    assert_string_equal(r.answer.headers[i].value, whole.answer.headers[i].value);
  }
  reply_free(&r);
  reply_free(&whole);
}

static void an_answer_at_another_time_is_what_it_is_from_the_beginning(void **state) {
  one_model *f = *state;
  static const char *const forms[] = {"json", "ndjson", "bin", "csv"};
  static const char *const queries[] = {"clip=turn",
                                        "as=matrix",
                                        "as=matrix&space=world",
                                        "space=world",
                                        "as=euler&unit=degrees&order=ZYX",
                                        "as=axis-angle&loop=pingpong",
                                        "interpolation=step&loop=repeat",
                                        "nodes=load,wheel",
                                        "nodes=cart"};
  static const char *const times[] = {"0",  "1",    "2",    "0.3", "1.2345678",
                                      "-1", "99.5", "1e-9", "2.",  "12345678"};
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
    for (size_t j = 0; j < sizeof queries / sizeof *queries; j++) {
      prepare(f, forms[i], queries[j]);
      for (size_t k = 0; k < sizeof times / sizeof *times; k++)
        assert_same_answer(f, forms[i], queries[j], times[k]);
    }
}

static void a_model_without_clips_rests_at_any_time(void **state) {
  one_model *f = *state;
  loopback_upload(f->loop, "application/json", "{\"nodes\":[{\"name\":\"a\"},{\"name\":\"b\"}]}", f->id);
  prepare(f, "json", "as=trs");
  assert_same_answer(f, "json", "as=trs", "7.5");
}

/* Nodes that hang on each other by sixes, of which a few move: what stays between those is printed once. */
static void still_nodes_stay_between_moving_ones(void **state) {
  one_model *f = *state;
  enum { NODES = 30 };
  char model[8192], *end = model + sprintf(model, "{\"nodes\":[");
  for (int i = 0; i < NODES; i++) {
    end += sprintf(end, "%s{\"name\":\"n%d\",\"translation\":[%d,0.25,0]", i ? "," : "", i, i);
    end += i % 6 ? sprintf(end, ",\"parent\":\"n%d\"}", i - 1) : sprintf(end, "}");
  }
  enum { CLIPS = 2, TURNING = 7 };
  static const char *const clips[CLIPS] = {"far", "near"};
  static const int turning[CLIPS][TURNING] = {{0, 8, 14, 15, 16, 22, 29}, {0, 8, 14, 15, 17, 22, 27}};
  end += sprintf(end, "],\"clips\":[");
  for (int c = 0; c < CLIPS; c++) {
    end += sprintf(end, "%s{\"name\":\"%s\",\"tracks\":[", c ? "," : "", clips[c]);
    for (int i = 0; i < TURNING; i++)
      end += sprintf(end,
                     "{\"node\":\"n%d\",\"path\":\"rotation\",\"times\":[0,2],\"quaternions\":[[0,0,0,1],"
                     "[0,0.6,0,0.8]]},",
                     turning[c][i]);
    end += sprintf(end, "{\"node\":\"n20\",\"path\":\"translation\",\"times\":[0,1],\"values\":[[0,0,0],"
                        "[1,2,3]]},{\"node\":\"n9\",\"path\":\"scale\",\"times\":[0,1],\"values\":[[1,1,1],"
                        "[1,2,3]]}]}");
  }
  sprintf(end, "]}");
  loopback_upload(f->loop, "application/json", model, f->id);
  static const char *const queries[] = {
      "as=trs",        "clip=near",   "clip=near&as=euler",    "as=euler",
      "as=matrix",     "space=world", "space=world&as=matrix", "nodes=n1,n2,n3,n4,n5,n6,n22",
      "nodes=n1,n2,n3"};
  for (size_t i = 0; i < sizeof queries / sizeof *queries; i++) {
    prepare(f, "json", queries[i]);
    prepare(f, "ndjson", queries[i]);
    for (int at = 0; at < 20; at++) {
      char time[8];
      snprintf(time, sizeof time, "%.2f", at * 0.11);
      assert_same_answer(f, "json", queries[i], time);
      assert_same_answer(f, "ndjson", queries[i], time);
    }
  }
}

static void a_time_that_is_none_is_told_as_ever(void **state) {
  one_model *f = *state;
  static const char *const bad[] = {"",    "1e99", "-",      "1.2.3",    "1e",
                                    "0x1", "nan",  "1&at=2", "1&from=0", "1&x=1"};
  prepare(f, "json", "clip=turn");
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
    assert_problem(ask(f, "json", "clip=turn", bad[i]), 400, NULL, NULL);
  assert_problem(ask(f, "json", "at=1&clip=turn", "1"), 400, NULL, "twice");
}

static void several_times_are_another_question(void **state) {
  one_model *f = *state;
  prepare(f, "json", "clip=turn");
  reply r = ask(f, "json", "clip=turn", "1,2");
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(r.body, "\"times\":[1,2]"));
  reply_free(&r);
}

static void conditions_are_judged_at_another_time(void **state) {
  one_model *f = *state;
  prepare(f, "bin", "clip=turn");
  char header[128], target[128];
  reply r = ask(f, "bin", "clip=turn", "1.5");
  snprintf(header, sizeof header, "If-None-Match: %s\n", reply_header(&r, "ETag"));
  reply_free(&r);
  snprintf(target, sizeof target, "/v1/models/%s/pose.bin?clip=turn&at=1.5", f->id);
  r = loopback_ask(f->loop, "GET", target, header, NULL, 0);
  assert_int_equal(r.status, 304);
  assert_int_equal(r.size, 0);
  reply_free(&r);
  assert_problem(loopback_ask(f->loop, "GET", target, "If-Match: \"other\"\n", NULL, 0), 412, NULL,
                 "If-Match");
}

static void a_deleted_model_has_no_more_poses(void **state) {
  one_model *f = *state;
  char target[128];
  prepare(f, "json", "clip=turn");
  snprintf(target, sizeof target, "/v1/models/%s", f->id);
  reply r = loopback_ask(f->loop, "DELETE", target, NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  assert_int_equal(kept(f), 0);
  assert_problem(ask(f, "json", "clip=turn", "1"), 404, NULL, NULL);
}

static void a_model_that_fell_out_of_the_cache_is_read_again(void **state) {
  one_model *f = *state;
  prepare(f, "json", "clip=turn");
  api_cache_forget(f->loop->service->cache, "/clip");
  assert_same_answer(f, "json", "clip=turn", "1.5");
  size_t gets = loopback_store_gets(f->loop);
  api_cache_forget(f->loop->service->cache, f->id);
  assert_same_answer(f, "json", "clip=turn", "1.75");
  assert_int_equal(loopback_store_gets(f->loop), gets + 1);
}

static void ask_at_three_times(one_model *f, const char *form, const char *query) {
  static const char *const times[] = {"0", "1", "2"};
  for (int i = 0; i < 3; i++) {
    reply r = ask(f, form, query, times[i]);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
}

static void large_poses_are_not_prepared(void **state) {
  one_model *f = *state;
  enum { NODES = 500 };
  char *model = malloc(NODES * 32 + 64), *end = model + sprintf(model, "{\"nodes\":[");
  for (int i = 0; i < NODES; i++) end += sprintf(end, "%s{\"name\":\"n%d\"}", i ? "," : "", i);
  strcpy(end, "]}");
  loopback_upload(f->loop, "application/json", model, f->id);
  free(model);
  ask_at_three_times(f, "bin", "as=trs");
  assert_int_equal(kept(f), 0);
}

/* Answers of less than ROOM bytes. */
static void an_answer_goes_into_a_room_as_far_as_it_fits(void **state) {
  enum { ROOM = 4096, GUARD = 0xA5 };
  one_model *f = *state;
  _Alignas(max_align_t) static uint8_t room[ROOM + 1];
  static const char *const forms[] = {"json", "ndjson", "bin", "csv"};
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    prepare(f, forms[i], "clip=turn");
    size_t moved = 0;
    for (size_t capacity = 1; capacity <= ROOM; capacity += 5) {
      char at[16];
      snprintf(at, sizeof at, "1.%zu", capacity);
      memset(room, GUARD, sizeof room);
      loopback_room = (api_room){room, capacity};
      assert_same_answer(f, forms[i], "clip=turn", at);
      snprintf(at, sizeof at, "1.1%zu", capacity);
      reply r = ask(f, forms[i], "clip=turn", at);
      assert_int_equal(r.answer.in_room, r.answer.bytes.data == room);
      assert_true(!r.answer.in_room || r.answer.bytes.size <= capacity);
      moved += !r.answer.in_room;
      for (size_t k = capacity; k < sizeof room; k++) assert_int_equal(room[k], GUARD);
      reply_free(&r);
    }
    loopback_room = (api_room){0};
    assert_in_range(moved, 2, ROOM / 5 - 2);
  }
}

static void a_node_among_many_is_left_to_heavy_calls(void **state) {
  one_model *f = *state;
  enum { NODES = 20001 };
  char target[128], *model = malloc(NODES * 4 + 64), *end = model + sprintf(model, "{\"nodes\":[");
  for (int i = 0; i < NODES; i++) end += sprintf(end, "%s", i ? ",{}" : "{\"name\":\"n\"}");
  strcpy(end, "]}");
  loopback_upload(f->loop, "application/json", model, f->id);
  free(model);
  ask_at_three_times(f, "json", "nodes=n");
  snprintf(target, sizeof target, "/v1/models/%s/pose.json?nodes=n&at=3", f->id);
  assert_false(loopback_is_light(f->loop, target));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup_teardown(an_answer_at_another_time_is_what_it_is_from_the_beginning, setup,
                                      one_model_stop),
      cmocka_unit_test_setup_teardown(a_model_without_clips_rests_at_any_time, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(still_nodes_stay_between_moving_ones, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(a_time_that_is_none_is_told_as_ever, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(several_times_are_another_question, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(conditions_are_judged_at_another_time, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(a_deleted_model_has_no_more_poses, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(a_model_that_fell_out_of_the_cache_is_read_again, setup,
                                      one_model_stop),
      cmocka_unit_test_setup_teardown(large_poses_are_not_prepared, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(an_answer_goes_into_a_room_as_far_as_it_fits, setup, one_model_stop),
      cmocka_unit_test_setup_teardown(a_node_among_many_is_left_to_heavy_calls, setup, one_model_stop),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
