/* What is on standard error. Linked with srv_now_ms wrapped. */
#include "log.h"

#include "machine.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "test.h"

typedef struct fixture {
  int saved, file; /* what standard error was, and is */
} fixture;

static char text[64 << 10];

static int redirect(void **state) {
  static fixture f;
  char path[] = "/tmp/tweend-log-XXXXXX";
  srv_log_tell_all_hidden(); /* of other tests */
  f = (fixture){.saved = dup(STDERR_FILENO), .file = mkstemp(path)};
  unlink(path);
  dup2(f.file, STDERR_FILENO);
  srv_log_configure(SRV_LOG_INFO, SRV_LOG_JSON);
  *state = &f;
  return 0;
}

static int restore(void **state) {
  fixture *f = *state;
  dup2(f->saved, STDERR_FILENO);
  close(f->saved);
  close(f->file);
  return 0;
}

/* What has been written so far. */
static const char *written(const fixture *f) {
  ssize_t size = pread(f->file, text, sizeof text - 1, 0);
  assert_true(size >= 0);
  text[size] = '\0';
  return text;
}

static void log_request(const char *id, const char *query) {
  srv_log_access(&(srv_log_request){.id = id,
                                    .peer = "unix",
                                    .method = "GET",
                                    .path = "/",
                                    .query = query,
                                    .route = "/",
                                    .traceparent = "",
                                    .status = 200});
}

static size_t count(const char *where, const char *what) {
  size_t found = 0;
  for (const char *at = where; (at = strstr(at, what)) != NULL; at++) found++;
  return found;
}

TEST_WITH(lines_leave_at_once, redirect, restore) {
  log_request("one", "");
  assert_int_equal(count(written(*state), "\"id\":\"one\""), 1);
  srv_log(SRV_LOG_WARN, "careful");
  assert_int_equal(count(written(*state), "careful"), 1);
}

static void complain(const char *what) {
  srv_log(SRV_LOG_ERROR, "no use: %s", what);
}

TEST_WITH(errors_that_repeat_are_counted, redirect, restore) {
  for (int i = 0; i < SRV_LOG_BURST + 25; i++) complain("every time");
  complain("the last one");
  srv_log(SRV_LOG_ERROR, "another kind");
  assert_int_equal(count(written(*state), "every time"), SRV_LOG_BURST);
  assert_int_equal(count(text, "another kind"), 1);
  srv_log_tell_hidden(); /* the second is not over */
  assert_int_equal(count(written(*state), "more of these"), 0);
  usleep(1100000);
  srv_log_tell_hidden();
  assert_int_equal(count(written(*state), "\"message\":\"26 more of these, the last: no use: the last one\""),
                   1);
  srv_log_tell_hidden();
  complain("once more");
  assert_int_equal(count(written(*state), "more of these"), 1);
  assert_int_equal(count(text, "once more"), 1);
}

TEST_WITH(what_was_left_out_is_told_before_the_next_line, redirect, restore) {
  for (int i = 0; i < SRV_LOG_BURST + 1; i++) complain("every time");
  usleep(1100000);
  complain("later");
  const char *told = strstr(written(*state), "1 more of these"), *later = strstr(text, "later");
  assert_true(told != NULL && later != NULL && told < later);
}

static _Thread_local bool is_slow; /* this thread sleeps after it has read the clock */

/* The linker's --wrap gives these names.
 * NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
uint64_t __real_srv_now_ms(void);
uint64_t __wrap_srv_now_ms(void);

uint64_t __wrap_srv_now_ms(void) {
  uint64_t now_ms = __real_srv_now_ms();
  if (is_slow) usleep(1500000);
  return now_ms;
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

static void *complain_slowly(void *context) {
  is_slow = true;
  complain("slow");
  return context;
}

TEST_WITH(thread_that_is_slow_after_it_read_the_clock_adds_no_line, redirect, restore) {
  pthread_t slow;
  for (int i = 0; i < SRV_LOG_BURST; i++) complain("every time");
  assert_int_equal(pthread_create(&slow, NULL, complain_slowly, NULL), 0);
  usleep(1200000);
  for (int i = 0; i < 2; i++) complain("later"); /* one line is due after a second */
  pthread_join(slow, NULL);
  assert_int_equal(count(written(*state), "\"message\":\"no use: later"), 1);
  assert_int_equal(count(text, "\"message\":\"no use: slow"), 0);
  srv_log_tell_all_hidden();
}

TEST_WITH(what_is_no_error_is_never_left_out, redirect, restore) {
  for (int i = 0; i < 10 * SRV_LOG_BURST; i++) srv_log(SRV_LOG_INFO, "listening");
  assert_int_equal(count(written(*state), "listening"), 10 * SRV_LOG_BURST);
}

TEST_WITH(level_changes_at_any_time, redirect, restore) {
  srv_log_set_level(SRV_LOG_WARN);
  log_request("one", "");
  srv_log(SRV_LOG_INFO, "quiet");
  assert_string_equal(written(*state), "");
  srv_log_set_level(SRV_LOG_INFO);
  log_request("two", "");
  assert_int_equal(count(written(*state), "\n"), 1);
}

TEST_WITH(long_target_is_cut_and_leaves_room_for_the_rest, redirect, restore) {
  static char query[9000];
  memset(query, 'q', sizeof query - 1);
  for (int format = SRV_LOG_TEXT; format <= SRV_LOG_JSON; format++) {
    srv_log_configure(SRV_LOG_INFO, (srv_log_format)format);
    log_request("rest", query);
  }
  const char *lines = written(*state);
  assert_int_equal(count(lines, "peer=unix id=rest\n"), 1);
  assert_int_equal(count(lines, "\"total_ms\":0.000}\n"), 1);
  assert_int_equal(count(lines, "\n"), 2);
}

TEST_WITH(signatures_of_urls_are_cut, redirect, restore) {
  for (int format = SRV_LOG_TEXT; format <= SRV_LOG_JSON; format++) {
    srv_log_configure(SRV_LOG_INFO, (srv_log_format)format);
    log_request("first", "sig=s3cret&level=2");
    log_request("last", "exp=1&sig=s3cret");
    log_request("other", "design=1&sig=&&signal=2");
    log_request("case", "SIG=s3cret&Sig=s3cret&s%69g=s3cret&%53%49%47=s3cret&si%");
  }
  const char *lines = written(*state);
  assert_int_equal(count(lines, "s3cret"), 0);
  assert_int_equal(count(lines, "/?sig=...&level=2"), 2);
  assert_int_equal(count(lines, "/?exp=1&sig=..."), 2);
  assert_int_equal(count(lines, "/?sig=...&sig=...&sig=...&sig=...&si%"), 2);
  assert_int_equal(count(lines, "/?design=1&sig=...&&signal=2"), 2);
}

TEST_WITH(who_does_not_read_the_log_stops_nobody, redirect, restore) {
  int ends[2];
  char query[6000];
  memset(query, 'q', sizeof query - 1);
  query[sizeof query - 1] = '\0';
  assert_int_equal(pipe(ends), 0);
  assert_true(fcntl(ends[1], F_SETPIPE_SZ, 16384) >= 16384);
  dup2(ends[1], STDERR_FILENO);
  close(ends[1]);
  for (int i = 0; i < 100; i++) log_request("first", query);
  ssize_t size = read(ends[0], text, 32 << 10);
  assert_in_range(size, 1, 16384);
  log_request("found", "");
  size += read(ends[0], text + size, 32 << 10);
  text[size] = '\0';
  close(ends[0]);
  assert_in_range(count(text, "\"id\":\"first\""), 1, 3);
  assert_int_equal(count(text, "\"id\":\"found\""), 1);
  assert_non_null(strstr(text, "standard error was not read: "));
  /* The last of the first ones may lack its end, but no other begins on its line. */
  assert_int_equal(count(text, "{\"time\""), count(text, "\n{\"time\"") + 1);
}
