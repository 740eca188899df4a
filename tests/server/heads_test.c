/* How long a request's head may be: what framing admits is answered, whatever comes behind it, and what is
 * longer is told so. */
#include "framing.h"
#include "sockets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { REQUEST_MAX = 128 << 10, BODY = 24 << 10, COOKIE = 50 };

/* Sizes in bytes. Cookies have COOKIE bytes each. */
typedef struct head {
  size_t target, arguments, headers, header_bytes, cookies;
} head;

static char request[REQUEST_MAX];

static size_t put(char *out, const char *text) {
  return (size_t)sprintf(out, "%s", text);
}

static size_t put_many(char *out, char letter, size_t count) {
  memset(out, letter, count);
  return count;
}

/* A target of so many bytes and arguments. */
static size_t put_target(char *out, const char *path, size_t size, size_t arguments) {
  size_t used = put(out, path);
  used += put_many(out + used, 'v', size > used ? size - used : 0);
  for (size_t i = 1; i < arguments; i++) out[used - i] = '&';
  return used;
}

static size_t put_header(char *out, size_t number, size_t value) {
  size_t used = (size_t)sprintf(out, "X-%zu: ", number);
  used += put_many(out + used, 'v', value);
  return used + put(out + used, "\r\n");
}

static size_t put_cookies(char *out, size_t size) {
  size_t used = put(out, "Cookie: ");
  for (size_t i = 0; i < size; i++)
    out[used + i] = "; session=0123456789abcdef0123456789abcdef01234567"[i % COOKIE];
  return used + size + put(out + used + size, "\r\n");
}

/* One that the daemon closes behind, or not. */
static size_t put_request(char *out, const char *line, const head *h, const char *last) {
  size_t used = put(out, line);
  const char *path = strchr(line, '/');
  used += put_target(out + used - strlen(path), path, h->target, h->arguments) - strlen(path);
  used += put(out + used, " HTTP/1.1\r\nHost: x\r\n");
  for (size_t i = 0; i < h->headers; i++) {
    used += put_header(out + used, i, h->header_bytes / h->headers);
  }
  if (h->cookies > 0) used += put_cookies(out + used, h->cookies);
  return used + put(out + used, last);
}

/* What framing says of the request. */
static srv_framing judge(const char *text) {
  srv_framing framing = {0};
  static char target[REQUEST_MAX];
  const char *line = strstr(text, "\r\n") + 2;
  sscanf(text, "%*s %131071s", target);
  srv_framing_target(&framing, target);
  srv_framing_version(&framing, "HTTP/1.1");
  for (const char *end; (end = strstr(line, "\r\n")) != line; line = end + 2) {
    const char *colon = strchr(line, ':');
    srv_framing_header(&framing, line, (size_t)(colon - line), colon + 2, (size_t)(end - colon) - 2);
  }
  srv_framing_end(&framing);
  return framing;
}

/* Refused connections stay until a sweep finds that the client is gone; there may be too many of them. */
static int ask_head(fixture *f, const head *h) {
  put_request(request, "GET /light?", h, "Connection: close\r\n\r\n");
  for (ask(f, request); status(f) == 503; ask(f, request)) pause_ms(100);
  return status(f);
}

/* What framing admits is answered, and what it does not is refused by one of three. Of cookies that the
 * library has no room for, which are more than framing hears of, some versions of it close without a word. */
static void assert_as_framed(fixture *f, const head *h) {
  int got = ask_head(f, h);
  srv_framing framing = judge(request);
  bool is_refused = got == 414 || got == 431 || got == 400;
  bool is_much = h->cookies > 0 && framing.text + framing.records > SRV_HEAD_MAX + (2 << 10);
  bool is_right =
      framing.status == 0 ? got == 200 && has(f, "\r\n\r\nlight") : is_refused || (is_much && got == 0);
  if (!is_right)
    fail_msg("%zu %zu %zu %zu %zu gave %d, not %d, with %zu and %zu bytes", h->target, h->arguments,
             h->headers, h->header_bytes, h->cookies, got, framing.status, framing.text, framing.records);
}

/* ---- what there is in the world -------------------------------------------------------------- */

/* As many headers as browsers send, and about as long. */
enum { BROWSER = 16, BROWSER_BYTES = 1100 };

static void browsers_with_many_cookies_are_answered(void **state) {
  assert_int_equal(ask_head(*state, &(head){200, 1, BROWSER, BROWSER_BYTES, 4096 * 3 / 4}), 200);
}

/* Long ones, as sessions are kept in. */
static void browsers_with_cookies_of_many_kilobytes_are_answered(void **state) {
  fixture *f = *state;
  head h = {200, 1, BROWSER, BROWSER_BYTES, 0};
  for (size_t size = 1000; size <= 7400; size += 400) {
    static char cookies[8192];
    size_t used = put(cookies, "Cookie: a=");
    used += put_many(cookies + used, 'c', size);
    put(cookies + used, "\r\nConnection: close\r\n\r\n");
    put_request(request, "GET /light?", &h, cookies);
    ask(f, request);
    assert_int_equal(status(f), 200);
  }
}

static void browsers_with_the_longest_target_are_answered(void **state) {
  assert_int_equal(ask_head(*state, &(head){SRV_TARGET_MAX, 1, BROWSER, BROWSER_BYTES, 1500}), 200);
  assert_int_equal(ask_head(*state, &(head){SRV_TARGET_MAX, 20, BROWSER, BROWSER_BYTES, 0}), 200);
}

/* ---- each limit ------------------------------------------------------------------------------ */

static void what_is_longer_is_told_so(void **state) {
  fixture *f = *state;
  assert_int_equal(ask_head(f, &(head){SRV_TARGET_MAX + 1, 1, 2, 100, 0}), 414);
  assert_int_equal(ask_head(f, &(head){40000, 1, 2, 100, 0}), 414);
  assert_int_equal(ask_head(f, &(head){1000, SRV_ARGUMENTS_MAX, 2, 100, 0}), 200);
  assert_int_equal(ask_head(f, &(head){1000, SRV_ARGUMENTS_MAX + 1, 2, 100, 0}), 400);
  assert_int_equal(ask_head(f, &(head){100, 1, SRV_HEADERS_MAX - 2, 4000, 0}), 200);
  assert_int_equal(ask_head(f, &(head){100, 1, SRV_HEADERS_MAX - 1, 4000, 0}), 431);
  assert_int_equal(ask_head(f, &(head){100, 1, 20, SRV_HEAD_MAX, 0}), 431);
  assert_int_equal(ask_head(f, &(head){100, 1, 20, 60000, 0}), 431);
  assert_int_equal(ask_head(f, &(head){100, 1, 20, 100, 40000}), 431);
}

static void refusal_is_a_problem_that_tells_the_limit(void **state) {
  fixture *f = *state;
  assert_int_equal(ask_head(f, &(head){100, 1, 20, SRV_HEAD_MAX - 1500, 0}), 431);
  assert_true(has(f, "18432 bytes"));
  assert_int_equal(ask_head(f, &(head){100, 1, 90, 900, 3000}), 431);
  assert_true(has(f, "10240 of them"));
}

/* ---- all together ---------------------------------------------------------------------------- */

/* To the byte, of a head that is mostly text and one that is mostly records. */
static void limits_are_met_to_the_byte(void **state) {
  fixture *f = *state;
  const head most[] = {{SRV_TARGET_MAX, 1, 1, 0, 0},   {100, 1, 1, 0, 0},
                       {SRV_TARGET_MAX, 90, 1, 0, 0},  {100, 1, 60, 0, 0},
                       {2000, 50, 50, 0, 0},           {100, 1, 1, 0, 2000},
                       {SRV_TARGET_MAX, 1, 1, 0, 800}, {4000, 80, 20, 0, 200}};
  for (size_t i = 0; i < sizeof most / sizeof *most; i++) {
    head h = most[i];
    put_request(request, "GET /light?", &h, "Connection: close\r\n\r\n");
    srv_framing framing = judge(request);
    assert_int_equal(framing.status, 0);
    size_t left = SRV_HEAD_MAX - framing.text - framing.records;
    h.header_bytes = left / h.headers * h.headers; /* shared out evenly */
    assert_as_framed(f, &h);
    assert_int_equal(status(f), 200);
    h.header_bytes += h.headers;
    assert_as_framed(f, &h);
    assert_int_equal(status(f), 431);
  }
}

/* Silence, or half a head, is what a client gets when the library has room for a request and none for the
 * answer's fields. */
static void heads_of_all_shapes_are_answered_or_refused(void **state) {
  fixture *f = *state;
  for (size_t target = 300; target <= SRV_TARGET_MAX; target += 2023) {
    for (size_t arguments = 1; arguments <= SRV_ARGUMENTS_MAX; arguments += 33) {
      for (size_t headers = 5; headers < SRV_HEADERS_MAX; headers += 31) {
        for (size_t bytes = 2000; bytes < 40000; bytes += 3011) {
          assert_as_framed(f, &(head){target, arguments, headers, bytes, 0});
          assert_as_framed(f, &(head){target, arguments, headers, 2000, bytes / 8});
        }
      }
    }
  }
}

/* With a body and another request behind it in one piece, which take of the memory in which the records have
 * to be. */
static void assert_taken_with_what_follows(fixture *f, const head *h) {
  char last[64];
  const head next = {100, 1, 1, 10, 0};
  snprintf(last, sizeof last, "Content-Length: %d\r\n\r\n", BODY);
  size_t used = put_request(request, "POST /echo?", h, last);
  if (judge(request).status != 0) return;
  used += put_many(request + used, 'b', BODY);
  put_request(request + used, "GET /light?", &next, "Connection: close\r\n\r\n");
  ask(f, request);
  assert_int_equal(status(f), 200);
  assert_int_equal(answers(f), 2);
  assert_true(has(f, "\r\n\r\nlight"));
}

static void bodies_and_requests_behind_heads_of_all_shapes_are_taken(void **state) {
  for (size_t target = 100; target <= SRV_TARGET_MAX; target += 2023) {
    for (size_t headers = 5; headers < SRV_HEADERS_MAX; headers += 29) {
      for (size_t bytes = 0; bytes < SRV_HEAD_MAX; bytes += 1511) {
        assert_taken_with_what_follows(*state, &(head){target, 1, headers, bytes, bytes / 10});
        assert_taken_with_what_follows(*state, &(head){target, 1, headers, 0, bytes / 4});
      }
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup_teardown(browsers_with_many_cookies_are_answered, set_up, tear_down),
      cmocka_unit_test_setup_teardown(browsers_with_cookies_of_many_kilobytes_are_answered, set_up,
                                      tear_down),
      cmocka_unit_test_setup_teardown(browsers_with_the_longest_target_are_answered, set_up, tear_down),
      cmocka_unit_test_setup_teardown(what_is_longer_is_told_so, set_up, tear_down),
      cmocka_unit_test_setup_teardown(refusal_is_a_problem_that_tells_the_limit, set_up, tear_down),
      cmocka_unit_test_setup_teardown(limits_are_met_to_the_byte, set_up, tear_down),
      cmocka_unit_test_setup_teardown(heads_of_all_shapes_are_answered_or_refused, set_up, tear_down),
      cmocka_unit_test_setup_teardown(bodies_and_requests_behind_heads_of_all_shapes_are_taken, set_up,
                                      tear_down),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
