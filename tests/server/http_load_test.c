/* The sockets under load and at their end, with a stand-in for api/ behind them. */
#include "fake_api.h"
#include "sockets.h"

#include <poll.h>
#include <stdio.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

/* ---- load ------------------------------------------------------------------------------------ */

/* Until so many requests wait for a thread. */
static void wait_queued(fixture *f, size_t count) {
  size_t waiting = 0, running;
  for (int waited = 0; waited < PATIENCE_MS && waiting != count; waited++) {
    pause_ms(1);
    srv_work_load(f->server.work, &waiting, &running);
  }
  assert_int_equal(waiting, count);
}

TEST_WITH(full_queue_answers_503_at_once, set_up, tear_down) {
  fixture *f = *state;
  enum { BUSY = 4 }; /* two threads, two that wait */
  fake_api_hold();
  size_t before = fake_api_started();
  int busy[BUSY];
  for (int i = 0; i < BUSY; i++) {
    busy[i] = connect_client(f);
    say(busy[i], "GET /heavy HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
    if (i == 1) {
      while (fake_api_started() < before + 2) pause_ms(5);
    }
  }
  wait_queued(f, 2);
  assert_true(ask(f, "GET /heavy HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"));
  assert_int_equal(status(f), 503);
  assert_true(has(f, "Retry-After: "));
  assert_int_equal(fake_api_kept_promises(), 0); /* others would wait until its client has read the refusal */
  assert_true(ask(f, "GET /light HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"));
  assert_int_equal(status(f), 200);
  fake_api_release();
  for (int i = 0; i < BUSY; i++) {
    assert_true(read_all(f, busy[i]));
    assert_int_equal(status(f), 200);
    close(busy[i]);
  }
}

/* A window of watch.c, of 15 s, begins and ends while the daemon owes the client a block. */
TEST_WITH(a_reader_is_not_cut_off_for_waiting_for_the_daemon, set_up, tear_down) {
  fixture *f = *state;
  f->config.min_rate = 1000;
  restart(f);
  fake_api_hold();
  int fd = connect_client(f);
  say(fd, "GET /slow?600000 HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  pause_ms(16500);
  fake_api_release();
  assert_true(read_all(f, fd));
  assert_int_equal(status(f), 200);
  assert_int_equal(body_size(f), 600000);
  close(fd);
}

enum { LIMIT = 64 }; /* --max-connections of the fixture */

static void open_idle(fixture *f, int *clients, int count) {
  for (int i = 0; i < count; i++) {
    clients[i] = connect_client(f);
    say(clients[i], "GET /light HTTP/1.1\r\nHost: x\r\n\r\n");
    read_until(f, clients[i], "\r\n\r\nlight");
  }
}

static void close_all(const int *clients, int count) {
  for (int i = 0; i < count; i++) close(clients[i]);
}

/* Sends a request, ends this side, and reads the answer. */
static void ask_half(fixture *f, const char *request) {
  int fd = connect_client(f);
  say(fd, request);
  shutdown(fd, SHUT_WR);
  assert_true(read_all(f, fd));
  close(fd);
}

TEST_WITH(client_that_ends_its_side_gets_its_answer, set_up, tear_down) {
  enum { OTHERS = 8 }; /* older connections in all loops: the library looks at its oldest one first */
  fixture *f = *state;
  int others[OTHERS];
  open_idle(f, others, OTHERS);
  static const char *const TARGETS[] = {"/light",         "/heavy",   "/pull?3000000",
                                        "/chunks?100000", "/legs?50", "/live?20,3"};
  for (size_t i = 0; i < sizeof TARGETS / sizeof *TARGETS; i++) {
    char request[100];
    snprintf(request, sizeof request, "GET %s HTTP/1.1\r\nHost: x\r\n\r\n", TARGETS[i]);
    ask_half(f, request);
    if (status(f) != 200 || answers(f) != 1) fail_msg("%s gave %.300s", TARGETS[i], f->answer);
  }
  ask_half(f, "POST /echo HTTP/1.1\r\nHost: x\r\nContent-Length: 3\r\n\r\nabc");
  assert_string_equal(body(f), "abc");
  close_all(others, OTHERS);
}

/* By interim answers, which a client that has closed its socket does not take. */
TEST_WITH(who_ended_one_side_is_told_from_who_left, set_up, tear_down) {
  fixture *f = *state;
  f->config.request_timeout = 3000;
  restart(f);
  int half = connect_client(f), gone = connect_client(f);
  say(half, "GET /waits HTTP/1.1\r\nHost: x\r\n\r\n");
  say(gone, "GET /waits HTTP/1.1\r\nHost: x\r\n\r\n");
  wait_in_flight(f, 2);
  shutdown(half, SHUT_WR);
  close(gone);
  wait_in_flight(f, 1);
  assert_true(read_all(f, half));
  assert_memory_equal(f->answer, "HTTP/1.1 100 Continue\r\n\r\n", 25);
  assert_true(has(f, "\r\n\r\nHTTP/1.1 503 ")); /* waited too long */
  close(half);
}

TEST_WITH(queued_request_of_a_client_that_left_is_not_computed, set_up, tear_down) {
  fixture *f = *state;
  fake_api_hold();
  size_t before = fake_api_started();
  int busy[2] = {connect_client(f), connect_client(f)};
  for (int i = 0; i < 2; i++) say(busy[i], "GET /heavy HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  while (fake_api_started() < before + 2) pause_ms(5);
  int gone = connect_client(f);
  say(gone, "GET /heavy HTTP/1.1\r\nHost: x\r\n\r\n");
  wait_queued(f, 1);
  close(gone);
  pause_ms(1500); /* until a reset tells that it has left */
  fake_api_release();
  for (int i = 0; i < 2; i++) {
    assert_true(read_all(f, busy[i]));
    close(busy[i]);
  }
  wait_in_flight(f, 0);
  assert_int_equal(fake_api_started(), before + 2);
}

/* It would keep its place among the few that may wait. */
TEST_WITH(a_request_whose_client_left_does_not_wait_on, set_up, tear_down) {
  fixture *f = *state;
  int gone = connect_client(f);
  say(gone, "GET /waits HTTP/1.1\r\nHost: x\r\n\r\n");
  wait_in_flight(f, 1);
  close(gone);
  wait_in_flight(f, 0);
}

/* Until at most so many are left: those that end take a moment. */
static void await_connections(fixture *f, size_t most) {
  for (int waited = 0; atomic_load(&f->server.connections) > most && waited < PATIENCE_MS; waited += 10)
    pause_ms(10);
  assert_true(atomic_load(&f->server.connections) <= most);
}

TEST_WITH(connection_over_the_limit_is_told_to_come_again, set_up, tear_down) {
  fixture *f = *state;
  int idle[LIMIT];
  open_idle(f, idle, LIMIT);
  assert_refused(f, 503, "GET /light HTTP/1.1\r\nHost: x\r\n\r\n");
  assert_true(has(f, "Retry-After: "));
  close_all(idle, LIMIT);
  await_connections(f, 0);
  assert_true(ask(f, "GET /light HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"));
  assert_int_equal(status(f), 200);
}

/* However many others there are that say nothing, or ask for something else. */
TEST_WITH(health_checks_are_answered_over_the_limit, set_up, tear_down) {
  fixture *f = *state;
  enum { SILENT = 100 };
  int idle[LIMIT], silent[SILENT];
  open_idle(f, idle, LIMIT);
  for (int i = 0; i < SILENT; i++) silent[i] = connect_client(f);
  for (int i = 0; i < 20; i++) {
    assert_true(ask(f, i % 2 ? "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"
                             : "GET /readyz HTTP/1.1\r\nHost: x\r\n\r\n"));
    assert_int_equal(status(f), 200);
    assert_true(has(f, "Connection: close"));
    assert_refused(f, 503, "POST /echo HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\nx");
  }
  await_connections(f, LIMIT + 2 * 8);
  say(idle[0], "GET /light HTTP/1.1\r\nHost: x\r\n\r\n");
  read_until(f, idle[0], "\r\n\r\nlight");
  close_all(idle, LIMIT);
  close_all(silent, SILENT);
}

/* Takes all descriptors but so many. */
static int take_descriptors(int *taken, int count_max, int but) {
  int count = 0;
  while (count < count_max && (taken[count] = dup(STDERR_FILENO)) >= 0) count++;
  assert_true(count < count_max);
  for (; but > 0; but--) close(taken[--count]);
  return count;
}

static size_t count_lines(int file) {
  static char text[1 << 20];
  ssize_t size = pread(file, text, sizeof text, 0);
  size_t lines = 0;
  for (ssize_t i = 0; i < size; i++) lines += text[i] == '\n';
  return lines;
}

static double processor_ms(void) {
  struct timespec used;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return (double)used.tv_sec * 1e3 + (double)used.tv_nsec / 1e6;
}

TEST_WITH(without_descriptors_the_listener_rests_and_fills_no_log, set_up, tear_down) {
  fixture *f = *state;
  enum { MOST = 300 };
  static int taken[MOST];
  struct rlimit before, limit;
  char path[] = "/tmp/tweend-log-XXXXXX";
  int errors = dup(STDERR_FILENO), file = mkstemp(path);
  unlink(path);
  getrlimit(RLIMIT_NOFILE, &before);
  limit = before;
  limit.rlim_cur = 256;
  setrlimit(RLIMIT_NOFILE, &limit);
  dup2(file, STDERR_FILENO);
  int count = take_descriptors(taken, MOST, 1);
  int fd = connect_client(f); /* with the last one */
  say(fd, "GET /light HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  double used = processor_ms();
  pause_ms(2500);
  used = processor_ms() - used;
  size_t lines = count_lines(file);
  close_all(taken, count);
  dup2(errors, STDERR_FILENO);
  setrlimit(RLIMIT_NOFILE, &before);
  bool is_closed = read_all(f, fd);
  close(fd);
  close(file);
  close(errors);
  if (lines < 1 || lines > SRV_LOG_BURST + 6) fail_msg("%zu lines", lines);
  if (used > 500) fail_msg("%.0f ms of the processor", used);
  assert_true(is_closed);
  assert_int_equal(status(f), 200);
}

/* One alone gets large blocks. With many a turn of the loop, for which a new connection waits, would be long.
 */
TEST_WITH(many_readers_get_small_blocks, set_up, tear_down) {
  fixture *f = *state;
  enum { READERS = 60 };
  int readers[READERS];
  f->config.io_threads = 1;
  restart(f);
  for (int i = 0; i < READERS; i++) {
    readers[i] = connect_client(f);
    say(readers[i], "GET /endless HTTP/1.1\r\nHost: x\r\n\r\n");
    read_until(f, readers[i], "\r\n\r\n");
    uint64_t end = clock_ms() + PATIENCE_MS; /* the first block follows the head */
    while (i == 0 && fake_api_block_size() != 256 << 10 && clock_ms() < end) pause_ms(1);
    if (i == 0) assert_int_equal(fake_api_block_size(), 256 << 10);
  }
  size_t least = SIZE_MAX;
  uint64_t end = clock_ms() + PATIENCE_MS;
  while (least > 80 << 10 && clock_ms() < end) {
    for (int i = 0; i < READERS; i++) {
      (void)!recv(readers[i], f->answer, ANSWER_MAX, MSG_DONTWAIT);
      if (fake_api_block_size() < least) least = fake_api_block_size();
    }
  }
  assert_true(least <= 80 << 10);
  close_all(readers, READERS);
}

TEST_WITH(exactly_128_ready_connections_are_all_answered, set_up, tear_down) {
  fixture *f = *state;
  f->config.max_connections = 300;
  f->config.io_threads = 1;
  restart(f);
  static int ready[128];
  for (int i = 0; i < 128; i++) {
    ready[i] = connect_client(f);
    say(ready[i], "GET /light HTTP/1.1\r\nHost: x\r\n\r\n");
    read_until(f, ready[i], "\r\n\r\nlight");
  }
  for (int round = 0; round < 5; round++) {
    for (int i = 0; i < 128; i++) say(ready[i], "GET /light HTTP/1.1\r\nHost: x\r\n\r\n");
    for (int i = 0; i < 128; i++) read_until(f, ready[i], "\r\n\r\nlight");
  }
  for (int i = 0; i < 128; i++) close(ready[i]);
}

TEST_WITH(reader_that_leaves_frees_the_answer, set_up, tear_down) {
  fixture *f = *state;
  int fd = connect_client(f);
  say(fd, "GET /endless HTTP/1.1\r\nHost: x\r\n\r\n");
  read_until(f, fd, "\r\n\r\n");
  assert_int_equal(fake_api_open_bodies(), 1);
  close(fd);
  for (int waited = 0; waited < PATIENCE_MS && fake_api_open_bodies() > 0; waited++) pause_ms(1);
  assert_int_equal(fake_api_open_bodies(), 0);
}

/* ---- the end --------------------------------------------------------------------------------- */

TEST_WITH(connection_that_its_client_has_half_closed_ends_with_the_answer, set_up, tear_down) {
  fixture *f = *state;
  int fd = connect_client(f);
  say(fd, "GET /light HTTP/1.1\r\nHost: a\r\n\r\nGET /light HTTP/1.1\r\nHost: a\r\n\r\n");
  shutdown(fd, SHUT_WR);
  uint64_t begin_ms = clock_ms();
  assert_true(read_all(f, fd));
  assert_int_equal(answers(f), 2);
  assert_true(clock_ms() - begin_ms < 10000); /* where idle ones are closed after a minute */
  close(fd);
}

TEST_WITH(request_whose_client_closed_behind_a_part_of_it_ends_soon, set_up, tear_down) {
  static const char *const PARTS[] = {"GET /light HTTP/1.1\r\nHos",
                                      "POST /light HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\n",
                                      "POST /light HTTP/1.1\r\nHost: a\r\nContent-Length: 100\r\n\r\nabc"};
  fixture *f = *state;
  for (size_t i = 0; i < sizeof PARTS / sizeof *PARTS; i++) {
    int fd = connect_client(f);
    say(fd, PARTS[i]);
    close(fd);
  }
  uint64_t begin_ms = clock_ms(); /* where a request may take a minute */
  pause_ms(500);                  /* by then they have been accepted */
  while (atomic_load(&f->server.connections) > 0 && clock_ms() - begin_ms < 10000) pause_ms(10);
  assert_int_equal(atomic_load(&f->server.connections), 0);
}

TEST_WITH(drain_closes_idle_connections_and_finishes_what_is_under_way, set_up, tear_down) {
  fixture *f = *state;
  fake_api_hold();
  size_t before = fake_api_started();
  int idle = connect_client(f), working = connect_client(f);
  say(idle, "GET /light HTTP/1.1\r\nHost: x\r\n\r\n");
  read_until(f, idle, "\r\n\r\nlight");
  say(working, "GET /heavy HTTP/1.1\r\nHost: x\r\n\r\n");
  while (fake_api_started() == before) pause_ms(5);
  atomic_store(&f->server.draining, true);
  srv_http_drain(f->http);
  assert_true(read_all(f, idle));
  assert_int_equal(f->answer_size, 0);
  assert_true(ask(f, "GET /light HTTP/1.1\r\nHost: x\r\n\r\n"));
  assert_int_equal(status(f), 503);
  assert_true(has(f, "Retry-After: ") && has(f, "Connection: close"));
  assert_true(ask(f, "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n"));
  assert_int_equal(status(f), 200);
  assert_true(atomic_load(&f->server.in_flight) > 0);
  fake_api_release();
  assert_true(read_all(f, working));
  assert_true(status(f) == 200 && has(f, "Connection: close"));
  close(idle);
  close(working);
}

/* A client that does not read what the daemon's kernel takes at once. */
static int ask_and_read_nothing(fixture *f, const char *head) {
  int fd = connect_client(f), window = 4096;
  setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &window, sizeof window);
  say(fd, head);
  struct pollfd begun = {.fd = fd, .events = POLLIN};
  assert_int_equal(poll(&begun, 1, PATIENCE_MS), 1);
  wait_in_flight(f, 0);
  return fd;
}

static void drain(fixture *f) {
  atomic_store(&f->server.draining, true);
  srv_http_drain(f->http);
}

static bool is_drained(const fixture *f, int wait_ms) {
  for (int waited = 0; waited < wait_ms && !srv_http_is_drained(f->http); waited += 10) pause_ms(10);
  return srv_http_is_drained(f->http);
}

/* Whether the connection is still there when the drain begins, or the daemon has closed it before. The
 * client's window lets 8 kB through each 0.2 s. */
TEST_WITH(drain_waits_for_clients_to_take_their_answers, set_up, tear_down) {
  fixture *f = *state;
  for (int closes = 0; closes < 2; closes++) {
    int fd =
        ask_and_read_nothing(f, closes ? "GET /pull?120000 HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"
                                       : "GET /pull?120000 HTTP/1.1\r\nHost: x\r\n\r\n");
    pause_ms(300);
    drain(f);
    assert_false(is_drained(f, 500));
    assert_int_equal(atomic_load(&f->server.unsent), 1);
    assert_true(read_all(f, fd));
    assert_int_equal(body_size(f), 120000);
    assert_true(is_drained(f, PATIENCE_MS));
    close(fd);
    restart(f);
  }
}

TEST_WITH(drain_does_not_wait_for_a_client_that_is_gone, set_up, tear_down) {
  fixture *f = *state;
  int fd = ask_and_read_nothing(f, "GET /pull?300000 HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  drain(f);
  assert_false(is_drained(f, 100));
  close(fd); /* with bytes unread, which resets it */
  assert_true(is_drained(f, PATIENCE_MS));
}

TEST_WITH(drain_without_requests_is_over_at_once, set_up, tear_down) {
  fixture *f = *state;
  assert_true(ask(f, "GET /light HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"));
  assert_false(srv_http_is_drained(f->http));
  drain(f);
  assert_true(is_drained(f, PATIENCE_MS));
}

/* Whatever the moment: blocks are being made ahead, or the reader has had enough of them. */
TEST_WITH(stop_cuts_what_is_being_sent, set_up, tear_down) {
  fixture *f = *state;
  for (int round = 0; round < 8; round++) {
    int fd = connect_client(f);
    say(fd, "GET /endless HTTP/1.1\r\nHost: x\r\n\r\n");
    read_until(f, fd, "\r\n\r\n");
    pause_ms(round);
    assert_true(stop(f));
    assert_int_equal(fake_api_open_bodies(), 0);
    close(fd);
    start(f);
  }
}

/* What was abandoned stays reachable, as it does until a process exits; volatile, or it would be left out. */
static srv_http *volatile abandoned;

TEST_WITH(stop_with_a_request_at_a_compute_thread_frees_nothing_and_says_so, set_up, tear_down) {
  fixture *f = *state;
  fake_api_hold();
  size_t before = fake_api_started();
  int fd = connect_client(f);
  say(fd, "GET /heavy HTTP/1.1\r\nHost: x\r\n\r\n");
  while (fake_api_started() == before) pause_ms(5);
  abandoned = f->http;
  assert_false(srv_http_stop(f->http));
  fake_api_release();
  srv_work_destroy(f->server.work);
  srv_metrics_destroy(f->server.metrics);
  srv_rates_destroy(f->server.rates);
  srv_peers_destroy(f->server.peers);
  close(fd);
  start(f);
}
