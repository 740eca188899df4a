/* Limits that hold for a request as a whole. */
#include "sockets.h"

#include <sys/socket.h>
#include <unistd.h>

static const char END[] = " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";

static int get(fixture *f, const char *target) {
  char request[128];
  snprintf(request, sizeof request, "GET %s%s", target, END);
  assert_true(ask(f, request));
  return status(f);
}

TEST_WITH(metrics_count_against_the_rate_and_probes_do_not, set_up, tear_down) {
  fixture *f = *state;
  f->config.rate_limit = (api_rate){1, 3600};
  restart(f);
  assert_int_equal(get(f, "/metrics"), 200);
  assert_int_equal(get(f, "/metrics"), 429);
  assert_true(has(f, "Retry-After: "));
  assert_int_equal(get(f, "/healthz"), 200);
  assert_int_equal(get(f, "/readyz"), 200);
  assert_int_equal(get(f, "/version"), 200);
}

TEST_WITH(bodies_of_light_answers_are_cut_off_at_the_compute_timeout, set_up, tear_down) {
  fixture *f = *state;
  f->config.compute_timeout = 1;
  restart(f);
  int fd = connect_client(f);
  say(fd, "GET /endless HTTP/1.1\r\nHost: x\r\n\r\n");
  read_until(f, fd, "\r\n\r\n");
  assert_int_equal(status(f), 200);
  uint64_t end = clock_ms() + PATIENCE_MS;
  ssize_t got = 1;
  while (got > 0 && clock_ms() < end) got = recv(fd, f->answer, ANSWER_MAX, 0);
  assert_true(got <= 0);
  close(fd);
}

TEST_WITH(computing_before_and_after_waits_counts_together, set_up, tear_down) {
  fixture *f = *state;
  f->config.compute_timeout = 200;
  restart(f);
  assert_int_equal(get(f, "/legs?80"), 503);
  assert_true(has(f, "computing the answer") && has(f, "Retry-After: "));
  f->config.compute_timeout = 60000;
  restart(f);
  assert_int_equal(get(f, "/legs?80"), 200);
}

TEST(times_are_told_in_milliseconds_with_three_decimals) {
  (void)state;
  static srv_exchange exchange;
  char timing[SRV_TIMING_SIZE];
  exchange.received_ns = 7005400;
  exchange.worked_ns = exchange.received_ns + 1234567890;
  exchange.answered_ns = exchange.worked_ns + 499;
  srv_exchange_timing(&exchange, timing);
  assert_string_equal(timing, "receive;dur=7.005, queue;dur=1234.568, work;dur=0.000");
  exchange.answered_ns = 1; /* clocks of two threads */
  srv_exchange_timing(&exchange, timing);
  assert_string_equal(timing, "receive;dur=7.005, queue;dur=1234.568, work;dur=0.000");
  exchange.received_ns = exchange.worked_ns = 0;
  exchange.answered_ns = UINT64_MAX - 500;
  srv_exchange_timing(&exchange, timing);
  assert_string_equal(timing, "receive;dur=0.000, queue;dur=0.000, work;dur=18446744073709.551");
}
