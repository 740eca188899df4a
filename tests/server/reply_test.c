/* Responses that are used again: alone, and over sockets, where no answer may show another's fields or bytes.
 */
#include "reply.h"

#include "clock.h"
#include "fake_api.h"
#include "field_block.h"
#include "sockets.h"

#include <microhttpd.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* ---- alone ----------------------------------------------------------------------------------- */

enum { FIELDS = 3 };

static const uint8_t BYTES[20000];

static int create_table(void **state) {
  *state = srv_replies_create(srv_rewrites());
  return *state == NULL;
}

static int destroy_table(void **state) {
  srv_replies_destroy(*state);
  return 0;
}

static srv_reply *take(srv_replies *replies, const char *tag, const char *id, size_t size) {
  const api_header fields[FIELDS] = {{"Vary", "Accept"}, {"ETag", tag}, {"X-Request-Id", id}};
  return srv_replies_take(replies, fields, FIELDS, (api_bytes){BYTES, size});
}

/* All fields as one text, by the first one's name. */
static const char *fields_of(const srv_reply *reply) {
  return MHD_get_response_header(srv_reply_response(reply), "Vary");
}

/* If not, answers are still right, but slower. */
static void library_sends_what_is_written_over_a_value(void **state) {
  (void)state;
  assert_true(srv_rewrites());
}

/* Where the library does not, nothing is taken. */
static void nothing_is_taken_where_the_library_would_not_send_it(void **state) {
  (void)state;
  srv_replies *replies = srv_replies_create(false);
  assert_null(take(replies, "\"a\"", "1", 100));
  srv_replies_destroy(replies);
}

static void replies_have_bytes_of_their_own_until_they_are_given_back(void **state) {
  enum { MOST = 4 };
  srv_reply *taken[MOST];
  for (size_t i = 0; i < MOST; i++) {
    taken[i] = take(*state, "\"a\"", "1", 100 + i / 2);
    assert_non_null(taken[i]);
    for (size_t k = 0; k < i; k++) assert_ptr_not_equal(taken[i], taken[k]);
  }
  assert_null(take(*state, "\"a\"", "1", 100));
  srv_reply_give_back(taken[2]);
  assert_ptr_equal(take(*state, "\"a\"", "1", 101), taken[2]);
  for (size_t i = 0; i < MOST; i++) srv_reply_give_back(taken[i]);
  srv_reply_give_back(NULL);
}

static void assert_fields(const srv_reply *reply, const char *text) {
  assert_non_null(reply);
  assert_string_equal(fields_of(reply), text);
  assert_int_equal(MHD_get_response_headers(srv_reply_response(reply), NULL, NULL), 1);
}

static void fields_stand_behind_the_first_one(void **state) {
  for (int i = 0; i < 100; i++) {
    char tag[16], id[16], text[96];
    snprintf(tag, sizeof tag, "\"%d\"", i / 2);
    snprintf(id, sizeof id, "%d", i * i);
    snprintf(text, sizeof text, "Accept\r\nETag: %s\r\nX-Request-Id: %s", tag, id);
    srv_reply *reply = take(*state, tag, id, 100);
    assert_fields(reply, text);
    srv_reply_give_back(reply);
  }
}

static void fields_as_long_as_before_take_their_place(void **state) {
  srv_reply *reply = take(*state, "\"a\"", "1", 100);
  const char *text = fields_of(reply);
  srv_reply_give_back(reply);
  assert_ptr_equal(take(*state, "\"b\"", "2", 100), reply);
  assert_ptr_equal(fields_of(reply), text);
  assert_fields(reply, "Accept\r\nETag: \"b\"\r\nX-Request-Id: 2");
  srv_reply_give_back(reply);
}

static void other_names_and_numbers_of_fields_are_told_apart(void **state) {
  srv_reply_give_back(take(*state, "\"a\"", "1", 100));
  const api_header fields[FIELDS] = {{"Vary", "Accept"}, {"Link", "\"a\""}, {"X-Request-Id", "1"}};
  srv_reply *reply = srv_replies_take(*state, fields, FIELDS, (api_bytes){BYTES, 100});
  assert_fields(reply, "Accept\r\nLink: \"a\"\r\nX-Request-Id: 1");
  srv_reply_give_back(reply);
  reply = srv_replies_take(*state, fields, 1, (api_bytes){BYTES, 100});
  assert_fields(reply, "Accept");
  srv_reply_give_back(reply);
}

static void field_that_cannot_be_sent_leaves_no_reply_behind(void **state) {
  static const char *const BREAKS[] = {"1\n2", "1\r2", "\n", "1\r\nX: 2", "1\t2"};
  for (size_t i = 0; i < sizeof BREAKS / sizeof *BREAKS; i++) {
    char plain[16] = "1234567";
    plain[strlen(BREAKS[i])] = '\0';
    srv_reply_give_back(take(*state, "\"a\"", plain, 100));
    assert_null(take(*state, "\"a\"", BREAKS[i], 100));
    assert_null(take(*state, "\"a\"", BREAKS[i], 100));
    srv_reply *reply = take(*state, "\"a\"", "1", 100);
    assert_fields(reply, "Accept\r\nETag: \"a\"\r\nX-Request-Id: 1");
    srv_reply_give_back(reply);
  }
}

static void more_fields_than_fit_are_not_for_replies(void **state) {
  static char value[SRV_FIELDS_SIZE_MAX + 1];
  size_t others = strlen("Accept\r\nETag: \r\nX-Request-Id: 1");
  memset(value, 'v', sizeof value - 1);
  value[SRV_FIELDS_SIZE_MAX - others] = '\0';
  srv_reply *reply = take(*state, value, "1", 100);
  assert_non_null(reply);
  assert_int_equal(strlen(fields_of(reply)), SRV_FIELDS_SIZE_MAX);
  srv_reply_give_back(reply);
  assert_null(take(*state, value, "12", 100));
  assert_null(srv_replies_take(*state, NULL, 0, (api_bytes){BYTES, 100}));
}

static void nothing_and_much_are_not_for_replies(void **state) {
  assert_null(take(*state, "\"a\"", "1", 0));
  assert_null(take(*state, "\"a\"", "1", sizeof BYTES));
}

/* ---- over sockets ---------------------------------------------------------------------------- */

static size_t count_text(const fixture *f, const char *text) {
  size_t count = 0;
  for (const char *at = f->answer; (at = strstr(at, text)) != NULL; at++) count++;
  return count;
}

static void answers_of_one_size_bear_their_own_fields_and_bytes(void **state) {
  fixture *f = *state;
  static const char *const PATHS[] = {"light", "heavy", "echo1", "plain"};
  int fd = connect_client(f);
  for (int i = 0; i < 200; i++) {
    char request[160], id[48], end[16];
    const char *word = PATHS[i * 7 % 11 % 4];
    bool is_tagged = i % 5 == 0;
    snprintf(id, sizeof id, "X-Request-Id: %d.id\r\n", i * i);
    snprintf(request, sizeof request, "GET /word?%s%s HTTP/1.1\r\nHost: x\r\n%s\r\n", word,
             is_tagged ? ",\"t\"" : "", id);
    snprintf(end, sizeof end, "\r\n\r\n%s", word);
    say(fd, request);
    read_until(f, fd, end);
    assert_int_equal(status(f), 200);
    assert_int_equal(count_text(f, id), 1);
    assert_int_equal(count_text(f, "X-Request-Id: "), 1);
    assert_int_equal(count_text(f, "Server-Timing: "), 1);
    assert_int_equal(count_text(f, "Content-Type: text/plain\r\n"), 1);
    assert_int_equal(count_text(f, "ETag: \"t\"\r\n"), is_tagged);
    assert_true(has(f, "Content-Length: 5\r\n"));
    assert_int_equal(body_size(f), 5);
  }
  close(fd);
}

static void head_has_the_length_and_the_next_answer_its_bytes(void **state) {
  fixture *f = *state;
  for (int i = 0; i < 3; i++) {
    ask(f, "HEAD /light HTTP/1.1\r\nHost: x\r\n\r\n"
           "GET /light HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
    assert_int_equal(answers(f), 2);
    assert_int_equal(count_text(f, "Content-Length: 5\r\n"), 2);
    assert_int_equal(count_text(f, "light"), 1);
    assert_int_equal(count_text(f, "Connection: close"), 1);
  }
}

static void old_clients_are_answered_like_new_ones(void **state) {
  fixture *f = *state;
  for (int i = 0; i < 3; i++) {
    assert_true(ask(f, "GET /light HTTP/1.0\r\n\r\n"));
    assert_true(has(f, "Connection: close\r\n"));
    assert_string_equal(body(f), "light");
    int fd = connect_client(f);
    say(fd, "GET /light HTTP/1.1\r\nHost: x\r\n\r\n");
    read_until(f, fd, "\r\n\r\nlight");
    assert_false(has(f, "Connection: close"));
    close(fd);
  }
}

/* The second that the last answer says it is of. */
static int64_t dated(const fixture *f) {
  char text[64] = "";
  assert_int_equal(count_text(f, "\r\nDate: "), 1);
  assert_int_equal(sscanf(strstr(f->answer, "\r\nDate: ") + 8, "%63[^\r]", text), 1);
  for (int64_t second = (int64_t)time(NULL) - 5; second < (int64_t)time(NULL) + 5; second++)
    if (strcmp(srv_date(second), text) == 0) return second;
  fail_msg("%s is not a date of now", text);
  return 0;
}

static void dates_of_answers_go_on(void **state) {
  fixture *f = *state;
  static const char *const ENDS[] = {
      "/light HTTP/1.1\r\nHost: x\r\n\r\n", /* in a reply, from its second on */
      "/nothing HTTP/1.1\r\nHost: x\r\n\r\n"};
  for (int round = 0; round < 3; round++) {
    for (int i = 0; i < 4; i++) {
      char request[128];
      snprintf(request, sizeof request, "GET %s", ENDS[i % 2]);
      int64_t before = (int64_t)time(NULL);
      int fd = connect_client(f);
      say(fd, request);
      read_until(f, fd, "\r\n\r\n");
      close(fd);
      assert_in_range(dated(f), before - 1, (int64_t)time(NULL));
    }
    pause_ms(1100);
  }
}

/* As much as it takes until the daemon cannot send any more, all of one size. tag: bytes of the ETag. */
static void crowd(int fd, int tag) {
  char request[2 * SRV_FIELDS_SIZE_MAX], letters[SRV_FIELDS_SIZE_MAX + 1] = "";
  memset(letters, 't', (size_t)tag);
  int size = snprintf(request, sizeof request, "GET /pad?4000%s%.*s HTTP/1.1\r\nHost: x\r\n\r\n",
                      tag > 0 ? "," : "", tag, letters);
  for (int i = 0; i < 4000; i++)
    if (send(fd, request, (size_t)size, MSG_NOSIGNAL | MSG_DONTWAIT) < 0) return;
}

static char letter(size_t size) {
  return (char)('A' + size % 26);
}

/* Reads until nothing comes any more: of bodies there are only such of this letter. */
static void read_one_letter(int fd, char own) {
  static char text[1 << 16];
  struct pollfd event = {.fd = fd, .events = POLLIN};
  size_t found = 0;
  while (poll(&event, 1, 300) > 0) {
    ssize_t got = recv(fd, text, sizeof text, 0);
    assert_true(got > 0);
    for (ssize_t i = 3; i < got; i++) {
      bool is_body = text[i] >= 'A' && text[i] <= 'Z' && strncmp(&text[i - 3], &text[i - 2], 3) == 0;
      if (is_body) assert_int_equal(text[i], own);
      found += is_body;
    }
  }
  assert_true(found > 4000);
}

/* tag: with all of SRV_FIELDS_SIZE_MAX the answers are none for replies, but lie in the room at first. */
static void assert_undisturbed(fixture *f, int tag) {
  for (int round = 0; round < 3; round++) {
    int stuck = connect_client(f);
    crowd(stuck, tag);
    pause_ms(100);
    for (int i = 0; i < 20; i++) {
      size_t size = (size_t)(3990 + i); /* also such as share a place for bytes with what is stuck */
      char request[128];
      snprintf(request, sizeof request,
               "GET /pad?%zu HTTP/1.1\r\nHost: x\r\nX-Request-Id: mine\r\nConnection: close\r\n\r\n", size);
      ask(f, request);
      assert_true(has(f, "X-Request-Id: mine\r\n"));
      assert_int_equal(body_size(f), size);
      assert_int_equal(strspn(body(f), (char[]){letter(size), '\0'}), size);
    }
    if (round == 0) read_one_letter(stuck, letter(4000));
    close(stuck);
  }
}

static void client_that_does_not_read_and_leaves_disturbs_no_other(void **state) {
  assert_undisturbed(*state, 0);
  assert_undisturbed(*state, SRV_FIELDS_SIZE_MAX);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(library_sends_what_is_written_over_a_value),
      cmocka_unit_test(nothing_is_taken_where_the_library_would_not_send_it),
      cmocka_unit_test_setup_teardown(replies_have_bytes_of_their_own_until_they_are_given_back, create_table,
                                      destroy_table),
      cmocka_unit_test_setup_teardown(fields_stand_behind_the_first_one, create_table, destroy_table),
      cmocka_unit_test_setup_teardown(fields_as_long_as_before_take_their_place, create_table, destroy_table),
      cmocka_unit_test_setup_teardown(other_names_and_numbers_of_fields_are_told_apart, create_table,
                                      destroy_table),
      cmocka_unit_test_setup_teardown(field_that_cannot_be_sent_leaves_no_reply_behind, create_table,
                                      destroy_table),
      cmocka_unit_test_setup_teardown(more_fields_than_fit_are_not_for_replies, create_table, destroy_table),
      cmocka_unit_test_setup_teardown(dates_of_answers_go_on, set_up, tear_down),
      cmocka_unit_test_setup_teardown(nothing_and_much_are_not_for_replies, create_table, destroy_table),
      cmocka_unit_test_setup_teardown(answers_of_one_size_bear_their_own_fields_and_bytes, set_up, tear_down),
      cmocka_unit_test_setup_teardown(head_has_the_length_and_the_next_answer_its_bytes, set_up, tear_down),
      cmocka_unit_test_setup_teardown(old_clients_are_answered_like_new_ones, set_up, tear_down),
      cmocka_unit_test_setup_teardown(client_that_does_not_read_and_leaves_disturbs_no_other, set_up,
                                      tear_down),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
