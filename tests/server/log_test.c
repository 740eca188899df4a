/* What is on standard error, and when: lines about requests may wait for each other, others wait for nothing.
 */
#include "log.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

typedef struct fixture {
  int saved, file; /* what standard error was, and is */
  srv_log_lines *lines;
} fixture;

static char text[4 << 20];

static int redirect(void **state) {
  static fixture f;
  char path[] = "/tmp/tweend-log-XXXXXX";
  f = (fixture){.saved = dup(STDERR_FILENO), .file = mkstemp(path), .lines = srv_log_lines_create()};
  unlink(path);
  dup2(f.file, STDERR_FILENO);
  srv_log_configure(SRV_LOG_INFO, SRV_LOG_JSON);
  *state = &f;
  return f.lines == NULL;
}

static int restore(void **state) {
  fixture *f = *state;
  srv_log_release();
  srv_log_lines_destroy(f->lines);
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
  srv_log_access(&(srv_log_request){
      .id = id, .peer = "unix", .method = "GET", .path = "/", .query = query, .status = 200});
}

static size_t count(const char *where, const char *what) {
  size_t found = 0;
  for (const char *at = where; (at = strstr(at, what)) != NULL; at++) found++;
  return found;
}

static void lines_leave_at_once_unless_they_are_held(void **state) {
  log_request("one", "");
  assert_int_equal(count(written(*state), "\"id\":\"one\""), 1);
}

static void held_lines_leave_in_order_when_they_are_released(void **state) {
  fixture *f = *state;
  srv_log_hold(f->lines);
  log_request("one", "");
  log_request("two", "");
  assert_string_equal(written(f), "");
  srv_log_release();
  const char *two = strstr(written(f), "\"id\":\"two\"");
  assert_non_null(two);
  assert_true(strstr(text, "\"id\":\"one\"") < two);
  assert_int_equal(count(text, "}\n{"), 1);
  srv_log_release();
  log_request("three", "");
  assert_int_equal(count(written(f), "\n"), 3);
}

static void warnings_wait_for_nothing_and_follow_what_came_before(void **state) {
  fixture *f = *state;
  srv_log_hold(f->lines);
  log_request("one", "");
  srv_log(SRV_LOG_WARN, "careful");
  const char *warning = strstr(written(f), "careful");
  assert_non_null(warning);
  assert_true(strstr(text, "\"id\":\"one\"") < warning);
  log_request("two", "");
  assert_null(strstr(written(f), "\"id\":\"two\""));
  srv_log_release();
  assert_true(strstr(written(f), "\"id\":\"two\"") > strstr(text, "careful"));
  assert_int_equal(count(text, "\n"), 3);
}

static void more_lines_than_fit_are_all_there_once_and_in_order(void **state) {
  fixture *f = *state;
  static char query[9000];
  srv_log_hold(f->lines);
  for (int i = 0; i < 500; i++) {
    char id[16];
    snprintf(id, sizeof id, "n%03d", i);
    memset(query, 'q', sizeof query - 1);
    query[i % 50 == 0 ? sizeof query - 1 : (size_t)(i * 37 % 1900)] = '\0';
    log_request(id, query);
    query[i * 37 % 1900] = 'q';
  }
  assert_true(strlen(written(f)) > 100000);
  srv_log_release();
  const char *at = written(f);
  assert_int_equal(count(at, "\n"), 500);
  for (int i = 0; i < 500; i++) {
    char id[24];
    snprintf(id, sizeof id, "\"id\":\"n%03d\"", i);
    at = strstr(at, id);
    assert_non_null(at);
  }
}

static void long_target_is_cut_and_leaves_room_for_the_rest(void **state) {
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

/* A process that ends by a signal with one line held; by abort where the number is 0. */
static int die(const fixture *f, int number) {
  pid_t child = fork();
  if (child == 0) {
    setrlimit(RLIMIT_CORE, &(struct rlimit){0});
    /* Those of the test runner, or of a sanitizer. */
    signal(SIGSEGV, SIG_DFL);
    signal(SIGABRT, SIG_DFL);
    srv_log_survive();
    srv_log_hold(f->lines);
    log_request("last", "");
    if (number == 0) abort();
    raise(number);
    _exit(0);
  }
  int status;
  assert_int_equal(waitpid(child, &status, 0), child);
  assert_true(WIFSIGNALED(status));
  return WTERMSIG(status);
}

static void held_lines_outlive_a_fault(void **state) {
  assert_int_equal(die(*state, SIGSEGV), SIGSEGV);
  assert_int_equal(count(written(*state), "\"id\":\"last\""), 1);
  assert_int_equal(die(*state, 0), SIGABRT);
  assert_int_equal(count(written(*state), "\"id\":\"last\""), 2);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup_teardown(lines_leave_at_once_unless_they_are_held, redirect, restore),
      cmocka_unit_test_setup_teardown(held_lines_leave_in_order_when_they_are_released, redirect, restore),
      cmocka_unit_test_setup_teardown(warnings_wait_for_nothing_and_follow_what_came_before, redirect,
                                      restore),
      cmocka_unit_test_setup_teardown(more_lines_than_fit_are_all_there_once_and_in_order, redirect, restore),
      cmocka_unit_test_setup_teardown(long_target_is_cut_and_leaves_room_for_the_rest, redirect, restore),
      cmocka_unit_test_setup_teardown(held_lines_outlive_a_fault, redirect, restore),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
