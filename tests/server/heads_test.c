/* How long a request's head may be: what framing admits is answered, whatever comes behind it, and what is
 * longer is told so. */
#include "framing.h"
#include "sockets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { REQUEST_MAX = 128 << 10, BODY = 24 << 10 };

/* Of one request: bytes of the target and its arguments, fields beside Host, cookies and their bytes, and the
 * bytes of the head in all, to which the first field is filled up; 0: no more than needed. */
typedef struct head {
  size_t target, arguments, fields, cookies, cookie_bytes, size;
} head;

static char request[REQUEST_MAX];

static size_t put(char *out, const char *text) {
  return (size_t)sprintf(out, "%s", text);
}

static size_t put_many(char *out, char letter, size_t count) {
  memset(out, letter, count);
  return count;
}

/* From the path on. */
static size_t put_target(char *out, const char *path, size_t size, size_t arguments) {
  size_t used = put(out, path);
  used += put(out + used, "?");
  used += put_many(out + used, 'v', size > used ? size - used : 0);
  for (size_t i = 1; i < arguments; i++) out[used - i] = '&';
  return used;
}

static size_t put_cookies(char *out, size_t cookies, size_t bytes) {
  size_t used = put(out, "Cookie: ");
  size_t start = used;
  used += put_many(out + used, 'c', bytes);
  for (size_t i = 1; i < cookies; i++) out[start + i * 2 - 1] = ';';
  return used + put(out + used, "\r\n");
}

/* Returns the size of the request's head. */
static size_t put_request(char *out, const char *method, const char *path, const head *h, const char *last) {
  size_t used = (size_t)sprintf(out, "%s ", method);
  used += put_target(out + used, path, h->target, h->arguments);
  used += put(out + used, " HTTP/1.1\r\nHost: x\r\n");
  if (h->cookies > 0) used += put_cookies(out + used, h->cookies, h->cookie_bytes);
  for (size_t i = 1; i < h->fields; i++) used += put(out + used, "A:\r\n");
  size_t rest = used + strlen("Fill: \r\n") + strlen(last);
  if (h->fields > 0) {
    used += put(out + used, "Fill: ");
    used += put_many(out + used, 'v', h->size > rest ? h->size - rest : 0);
    used += put(out + used, "\r\n");
  }
  used += put(out + used, last);
  return used;
}

static int ask_head(fixture *f, const head *h) {
  put_request(request, "GET", "/wide", h, "Connection: close\r\n\r\n");
  assert_true(ask(f, request));
  return status(f);
}

static void assert_answered(fixture *f, const head *h) {
  int got = ask_head(f, h);
  if (got != 200 || !has(f, "\r\n\r\nwide"))
    fail_msg("%zu %zu %zu %zu %zu %zu gave %d", h->target, h->arguments, h->fields, h->cookies,
             h->cookie_bytes, h->size, got);
}

/* Host and Connection are two more. */
enum { FIELDS = SRV_FIELDS_MAX - 2 };

/* All limits at once, in all ways to share the fields with the cookies. */
static const head FULL[] = {
    {SRV_TARGET_MAX, SRV_ARGUMENTS_MAX, FIELDS, 0, 0, SRV_HEAD_MAX},
    {SRV_TARGET_MAX, SRV_ARGUMENTS_MAX, FIELDS - 2, 1, SRV_COOKIES_MAX, SRV_HEAD_MAX},
    {SRV_TARGET_MAX, SRV_ARGUMENTS_MAX, 30, FIELDS - 31, SRV_COOKIES_MAX, SRV_HEAD_MAX},
    {SRV_TARGET_MAX, SRV_ARGUMENTS_MAX, 1, FIELDS - 2, SRV_COOKIES_MAX, SRV_HEAD_MAX},
    {100, 1, FIELDS, 0, 0, SRV_HEAD_MAX},
    {100, SRV_ARGUMENTS_MAX, 1, FIELDS - 2, SRV_COOKIES_MAX, SRV_HEAD_MAX},
};
enum { FULL_COUNT = sizeof FULL / sizeof *FULL };

TEST_WITH(heads_at_all_limits_are_answered, set_up, tear_down) {
  for (size_t i = 0; i < FULL_COUNT; i++) assert_answered(*state, &FULL[i]);
}

/* Behind the first one the library begins with what has already come of the next. */
TEST_WITH(heads_at_all_limits_follow_each_other, set_up, tear_down) {
  fixture *f = *state;
  for (size_t i = 0; i < FULL_COUNT; i++) {
    size_t used = put_request(request, "GET", "/wide", &FULL[i], "Connection: x\r\n\r\n");
    used += put_request(request + used, "GET", "/wide", &FULL[FULL_COUNT - 1 - i], "Connection: x\r\n\r\n");
    put_request(request + used, "GET", "/wide", &FULL[i], "Connection: close\r\n\r\n");
    assert_true(ask(f, request));
    assert_int_equal(answers(f), 3);
    assert_string_equal(f->answer + f->answer_size - 4, "wide");
  }
}

TEST_WITH(bodies_behind_heads_at_all_limits_are_taken, set_up, tear_down) {
  fixture *f = *state;
  for (size_t i = 0; i < FULL_COUNT; i++) {
    char last[64];
    head h = FULL[i];
    h.fields--;
    snprintf(last, sizeof last, "Connection: x\r\nContent-Length: %d\r\n\r\n", BODY);
    size_t used = put_request(request, "POST", "/echo", &h, last);
    used += put_many(request + used, 'b', BODY);
    put_request(request + used, "GET", "/wide", &FULL[i], "Connection: close\r\n\r\n");
    assert_true(ask(f, request));
    assert_int_equal(status(f), 200);
    assert_int_equal(answers(f), 2);
    assert_string_equal(f->answer + f->answer_size - 4, "wide");
  }
}

/* However its bytes are cut on the way. */
TEST_WITH(head_at_all_limits_comes_in_pieces, set_up, tear_down) {
  fixture *f = *state;
  for (size_t piece = 1000; piece < SRV_HEAD_MAX; piece = piece * 3 / 2) {
    size_t size = put_request(request, "GET", "/wide", &FULL[2], "Connection: close\r\n\r\n");
    int fd = connect_client(f);
    for (size_t at = 0; at < size; at += piece) {
      (void)!send(fd, request + at, size - at < piece ? size - at : piece, MSG_NOSIGNAL);
      pause_ms(5);
    }
    assert_true(read_all(f, fd));
    assert_int_equal(status(f), 200);
    close(fd);
  }
}

static void assert_head_refused(fixture *f, int expected, const char *detail, const head *h) {
  assert_int_equal(ask_head(f, h), expected);
  assert_int_equal(answers(f), 1);
  assert_true(has(f, "Connection: close"));
  if (!has(f, detail)) fail_msg("'%s' is not in %s", detail, f->answer);
}

TEST_WITH(what_is_one_over_a_limit_is_told_which, set_up, tear_down) {
  fixture *f = *state;
  assert_head_refused(f, 414, "8192 bytes", &(head){.target = SRV_TARGET_MAX + 1, .arguments = 1});
  assert_head_refused(f, 400, "32 arguments", &(head){.target = 1000, .arguments = SRV_ARGUMENTS_MAX + 1});
  assert_head_refused(f, 431, "64 fields", &(head){.target = 100, .fields = FIELDS + 1});
  assert_head_refused(f, 431, "64 fields",
                      &(head){.target = 100, .fields = 30, .cookies = FIELDS - 30, .cookie_bytes = 1000});
  assert_head_refused(f, 431, "4096 bytes",
                      &(head){.target = 100, .cookies = 1, .cookie_bytes = SRV_COOKIES_MAX + 1});
  assert_head_refused(f, 431, "16384 bytes", &(head){.target = 100, .fields = 1, .size = SRV_HEAD_MAX + 1});
}

/* The library itself may answer these, or refuses them so that a refusal of ours comes before its own. */
TEST_WITH(what_is_far_over_a_limit_is_refused, set_up, tear_down) {
  fixture *f = *state;
  assert_head_refused(f, 414, "", &(head){.target = 60000, .arguments = 1});
  assert_head_refused(f, 400, "32 arguments", &(head){.target = 8000, .arguments = 4000});
  assert_head_refused(f, 431, "", &(head){.target = 100, .fields = 5000});
  assert_head_refused(f, 431, "", &(head){.target = 100, .fields = 1, .size = 60000});
  assert_head_refused(f, 431, "4096 bytes", &(head){.target = 100, .cookies = 1, .cookie_bytes = 12000});
  assert_head_refused(f, 431, "", &(head){.target = 100, .cookies = 4000, .cookie_bytes = 12000});
}
