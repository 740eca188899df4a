/* Live streams over sockets. */
#include "fake_api.h"
#include "sockets.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

TEST_WITH(streams_come_in_their_time_and_outlive_other_timeouts, set_up, tear_down) {
  fixture *f = *state;
  f->config.header_timeout = f->config.idle_timeout = 600;
  f->config.request_timeout = 1500;
  restart(f);
  uint64_t start = clock_ms(), frames = f->config.request_timeout / 10 + 30;
  char request[64], last[32];
  snprintf(request, sizeof request, "GET /live?%d HTTP/1.1\r\nHost: x\r\n\r\n", (int)frames);
  snprintf(last, sizeof last, "frame %d\n", (int)frames);
  assert_true(ask(f, request));
  assert_true(clock_ms() - start >= frames * 10);
  assert_true(has(f, "Transfer-Encoding: chunked") && has(f, "Connection: close"));
  assert_true(has(f, "opening\n") && has(f, "frame 0\n") && has(f, last) && has(f, "closing\n"));
  assert_true(has(f, "\r\n0\r\n\r\n")); /* a whole answer */
}

TEST_WITH(head_of_unknown_size_has_no_last_chunk, set_up, tear_down) {
  fixture *f = *state;
  assert_true(ask(f, "HEAD /chunks?100 HTTP/1.1\r\nHost: x\r\n\r\n"));
  assert_int_equal(status(f), 200);
  assert_int_equal(body_size(f), 0);
}

TEST_WITH(head_of_a_stream_joins_nothing, set_up, tear_down) {
  fixture *f = *state;
  assert_true(ask(f, "HEAD /live?5 HTTP/1.1\r\nHost: x\r\n\r\n"));
  assert_int_equal(status(f), 200);
  assert_int_equal(body_size(f), 0);
  assert_true(has(f, "text/event-stream"));
  assert_int_equal(srv_live_look(f->server.live).printed, 0);
}

TEST_WITH(one_listener_too_many_is_told_to_come_again, set_up, tear_down) {
  fixture *f = *state;
  int fd[2];
  for (int i = 0; i < 2; i++) {
    fd[i] = connect_client(f);
    say(fd[i], "GET /live?1000000 HTTP/1.1\r\nHost: x\r\n\r\n");
    read_until(f, fd[i], "frame 0");
  }
  assert_true(ask(f, "GET /live?5 HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"));
  assert_true(status(f) == 503 && has(f, "Retry-After: "));
  close(fd[0]);
  /* The next frame finds nobody. */
  for (int waited = 0; srv_live_look(f->server.live).listeners > 1 && waited < PATIENCE_MS; waited += 10)
    pause_ms(10);
  assert_int_equal(srv_live_look(f->server.live).listeners, 1);
  close(fd[1]);
}

TEST_WITH(a_stream_that_nobody_reads_skips_what_it_missed, set_up, tear_down) {
  fixture *f = *state;
  int fd = connect_client(f), window = 4096;
  setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &window, sizeof window);
  say(fd, "GET /live?150,60000 HTTP/1.1\r\nHost: x\r\n\r\n");
  pause_ms(2000); /* when the last frame is due */
  assert_true(srv_live_look(f->server.live).skipped > 20);
  assert_true(read_all(f, fd));
  assert_true(has(f, "frame 0\n") && has(f, "frame 150\n") && has(f, "closing\n"));
  assert_true(f->answer_size < 40 * 60000);
  close(fd);
}

TEST_WITH(stop_ends_streams_between_two_frames, set_up, tear_down) {
  fixture *f = *state;
  int fd = connect_client(f);
  say(fd, "GET /live?1000000 HTTP/1.1\r\nHost: x\r\n\r\n");
  read_until(f, fd, "frame 0\n"); /* a busy machine may skip any later one */
  assert_true(stop(f));
  assert_true(read_all(f, fd));
  assert_false(has(f, "closing"));
  assert_int_equal(fake_api_open_bodies(), 0);
  close(fd);
  start(f);
}
