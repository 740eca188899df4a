/* Channels and listeners: who shares, who skips, when it ends. Times are in hundredths of seconds, so that a
 * busy machine does not matter. */
#include "live.h"

#include "fake_api.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "test.h"

enum { TEXT_MAX = 1 << 16, PATIENCE_MS = 30000 };

static atomic_int sources, prints;

static void pause_ms(long ms) {
  nanosleep(&(struct timespec){.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000}, NULL);
}

static bool print_number(void *context, uint64_t index, api_bytes *out) {
  const size_t *padding = context;
  char *text = malloc(32 + *padding);
  int size = snprintf(text, 32, "%llu\n", (unsigned long long)index);
  memset(text + size, '.', *padding);
  *out = (api_bytes){(uint8_t *)text, (size_t)size + *padding};
  atomic_fetch_add(&prints, 1);
  return true;
}

static size_t print_nothing(uint64_t now_ms, char out[API_LIVE_STAMP]) {
  (void)now_ms;
  (void)out;
  return 0;
}

static size_t print_time(uint64_t now_ms, char out[API_LIVE_STAMP]) {
  return (size_t)snprintf(out, API_LIVE_STAMP, "at %llu\n", (unsigned long long)now_ms);
}

static void destroy_source(void *context) {
  free(context);
  atomic_fetch_sub(&sources, 1);
}

/* Numbers as frames, each followed by so many dots. */
static api_live source(const char *key, double fps, uint64_t last, size_t padding) {
  size_t *context = malloc(sizeof *context);
  *context = padding;
  atomic_fetch_add(&sources, 1);
  return (api_live){.key = key,
                    .fps = fps,
                    .last = last,
                    .opening = "open\n",
                    .pulse = ":\n",
                    .closing = "close\n",
                    .context = context,
                    .frame = print_number,
                    .stamp = print_nothing,
                    .destroy = destroy_source};
}

/* A client that waits on a condition for `ready`. */
typedef struct client {
  pthread_mutex_t lock;
  pthread_cond_t wake;
  bool ready, lacked_memory;
  srv_listener *listener;
  char text[TEXT_MAX]; /* all that it has read, terminated */
  size_t size;
} client;

static void on_ready(void *owner) {
  client *c = owner;
  pthread_mutex_lock(&c->lock);
  c->ready = true;
  pthread_cond_signal(&c->wake);
  pthread_mutex_unlock(&c->lock);
}

static client *join(srv_live *live, api_live from) {
  client *c = calloc(1, sizeof *c);
  pthread_mutex_init(&c->lock, NULL);
  pthread_cond_init(&c->wake, NULL);
  c->listener = srv_live_join(live, &from, on_ready, c, &c->lacked_memory);
  assert_null(from.frame);
  return c;
}

static void leave(client *c) {
  srv_listener_leave(c->listener);
  pthread_mutex_destroy(&c->lock);
  pthread_cond_destroy(&c->wake);
  free(c);
}

/* As srv_listener_read, and waits instead of returning 0. */
static int64_t wait_read(client *c, size_t capacity) {
  for (;;) {
    assert_true(c->size + capacity < TEXT_MAX);
    int64_t size = srv_listener_read(c->listener, (uint8_t *)c->text + c->size, capacity);
    if (size > 0) c->size += (size_t)size;
    c->text[c->size] = '\0';
    if (size != 0) return size;
    pthread_mutex_lock(&c->lock);
    while (!c->ready) pthread_cond_wait(&c->wake, &c->lock);
    c->ready = false;
    pthread_mutex_unlock(&c->lock);
  }
}

/* The number in the last whole line, -1 when it is none. */
static long last_number(const client *c) {
  size_t end = c->size;
  while (end > 0 && c->text[end - 1] != '\n') end--;
  size_t start = end > 0 ? end - 1 : 0;
  while (start > 0 && c->text[start - 1] != '\n') start--;
  return c->text[start] >= '0' && c->text[start] <= '9' ? strtol(c->text + start, NULL, 10) : -1;
}

/* Frames may be left out on a busy machine, so it is read up to this one or a later one. */
static void read_up_to(client *c, long number) {
  while (last_number(c) < number) assert_true(wait_read(c, 7) > 0);
}

static void read_all(client *c) {
  while (wait_read(c, 200) > 0) continue;
}

static void *read_in_thread(void *context) {
  read_all(context);
  return NULL;
}

/* Both at once: who waits skips frames. */
static void read_both(client *a, client *b) {
  pthread_t thread;
  assert_int_equal(pthread_create(&thread, NULL, read_in_thread, a), 0);
  read_all(b);
  pthread_join(thread, NULL);
}

/* Numbers rise from `first` to `last`, between opening and closing. */
static void assert_whole(const client *c, long first, long last) {
  const char *line = c->text;
  assert_memory_equal(line, "open\n", 5);
  long before = -1;
  for (line += 5; *line >= '0' && *line <= '9'; line = strchr(line, '\n') + 1) {
    long number = strtol(line, NULL, 10);
    if (before < 0) assert_int_equal(number, first);
    assert_true(number > before);
    before = number;
  }
  assert_int_equal(before, last);
  assert_string_equal(line, "close\n");
}

/* Between a read of 0 and `ready` nobody may leave. */
static void end_all(srv_live *live, client **clients, int count) {
  srv_live_end(live);
  for (int i = 0; i < count; i++) {
    read_all(clients[i]);
    leave(clients[i]);
  }
}

static double seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

static int set_up(void **state) {
  atomic_store(&prints, 0);
  *state = srv_live_create(NULL, 3, SRV_LIVE_PULSE_NS);
  return *state != NULL ? 0 : -1;
}

static int tear_down(void **state) {
  srv_live_destroy(*state);
  return atomic_load(&sources) == 0 ? 0 : -1;
}

TEST_WITH(frames_come_in_order_and_the_stream_ends, set_up, tear_down) {
  double start = seconds();
  client *c = join(*state, source("a", 50, 3, 0));
  read_all(c);
  assert_whole(c, 0, 3);
  assert_true(seconds() - start >= 0.06); /* when frame 3 is due */
  leave(c);
}

TEST_WITH(equal_keys_share_what_is_printed, set_up, tear_down) {
  client *a = join(*state, source("a", 50, 20, 0)), *b = join(*state, source("a", 50, 20, 0));
  assert_int_equal(srv_live_look(*state).channels, 1);
  read_both(a, b);
  assert_whole(a, 0, 20);
  assert_whole(b, 0, 20);
  assert_true(atomic_load(&prints) <= 21);
  leave(a);
  leave(b);
}

TEST_WITH(one_who_comes_later_gets_what_is_kept, set_up, tear_down) {
  client *c[2] = {join(*state, source("a", 50, 30, 0))};
  read_up_to(c[0], 3);
  double start = seconds();
  c[1] = join(*state, source("a", 50, 30, 0));
  assert_int_equal(srv_live_look(*state).channels, 1);
  read_both(c[0], c[1]);
  assert_whole(c[0], 0, 30);
  assert_whole(c[1], 0, 30);
  assert_true(seconds() - start >= 0.58);  /* at its own pace, not at once */
  assert_true(atomic_load(&prints) <= 31); /* and not printed again */
  for (int i = 0; i < 2; i++) leave(c[i]);
}

TEST_WITH(one_who_joins_begins_where_the_others_are, set_up, tear_down) {
  client *c[2] = {join(*state, source("a", 50, UINT64_MAX, 0))};
  read_up_to(c[0], 4);
  api_live joining = source("a", 50, UINT64_MAX, 0);
  joining.joins = true;
  c[1] = join(*state, joining);
  read_up_to(c[1], 9);
  assert_int_equal(srv_live_look(*state).channels, 1);
  assert_true(strtol(c[1]->text + strlen("open\n"), NULL, 10) >= 4);
  end_all(*state, c, 2);
}

static double unix_ms(void) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  return (double)now.tv_sec * 1e3 + (double)now.tv_nsec / 1e6;
}

/* 50 frames a second, of which frame 0 is due so many milliseconds from now. */
static api_live starting_in(double ms, uint64_t last) {
  api_live from = source("a", 50, last, 0);
  from.joins = from.has_start = true;
  from.start_ms = unix_ms() + ms;
  return from;
}

static long first_number(const client *c) {
  return strtol(c->text + strlen("open\n"), NULL, 10);
}

TEST_WITH(a_frame_bears_the_time_at_which_it_is_sent, set_up, tear_down) {
  api_live stamped[2] = {source("a", 50, 10, 3), source("a", 50, 10, 3)};
  stamped[0].stamp = stamped[1].stamp = print_time;
  client *c[2] = {join(*state, stamped[0])};
  read_up_to(c[0], 2);
  pause_ms(100);
  double joined = unix_ms();
  c[1] = join(*state, stamped[1]); /* gets frame 0 as it was printed, but now */
  read_both(c[0], c[1]);
  const char *line = strstr(c[1]->text, "0\n...at ");
  assert_ptr_equal(line, c[1]->text + strlen("open\n"));
  double at = strtod(line + strlen("0\n...at "), NULL);
  assert_true(at >= floor(joined) && at <= unix_ms());
  for (int i = 0; i < 2; i++) leave(c[i]);
}

TEST_WITH(a_start_in_the_past_begins_with_the_frame_that_is_due, set_up, tear_down) {
  double now = unix_ms();
  client *c = join(*state, starting_in(-1e6, UINT64_MAX));
  read_up_to(c, 50010);
  long first = first_number(c);
  assert_true(first >= 50000 && (double)first <= 50000 + (unix_ms() - now) / 20);
  assert_true(unix_ms() - now >= 199); /* frame 50,010 is not due before */
  end_all(*state, &c, 1);
}

TEST_WITH(a_start_to_come_is_waited_for, set_up, tear_down) {
  double now = unix_ms();
  api_live from = starting_in(1500, 5), same = starting_in(0, 5); /* later than a busy machine comes to it */
  same.start_ms = from.start_ms;
  client *c[2] = {join(*state, from)};
  pause_ms(100);
  c[1] = join(*state, same);
  assert_int_equal(srv_live_look(*state).channels, 1);
  pause_ms(100);
  assert_int_equal(srv_live_look(*state).printed, 0);
  read_up_to(c[0], 0);
  assert_true(unix_ms() - now >= 1499);
  read_both(c[0], c[1]);
  for (int i = 0; i < 2; i++) {
    assert_whole(c[i], 0, 5);
    leave(c[i]);
  }
}

TEST_WITH(a_start_whose_clip_is_over_shows_its_last_frame, set_up, tear_down) {
  client *c = join(*state, starting_in(-1e6, 7));
  read_all(c);
  assert_whole(c, 7, 7);
  leave(c);
}

TEST_WITH(who_comes_again_to_a_start_does_not_see_the_present_frame_twice, set_up, tear_down) {
  api_live from = starting_in(-1e6, UINT64_MAX), again = from, late = from;
  from.fps = again.fps = late.fps = 0.5; /* frame 500 is the present one */
  again.context = malloc(sizeof(size_t));
  late.context = malloc(sizeof(size_t));
  *(size_t *)again.context = *(size_t *)late.context = 0;
  atomic_fetch_add(&sources, 2);
  again.first = 501;
  late.first = 400;
  client *c[3] = {join(*state, from), join(*state, again), join(*state, late)};
  for (int i = 0; i < 3; i++) read_up_to(c[i], 500);
  assert_int_equal(first_number(c[0]), 500);
  assert_int_equal(first_number(c[1]), 501);
  assert_int_equal(first_number(c[2]), 500);
  end_all(*state, c, 3);
}

TEST_WITH(what_cannot_be_shared_has_its_own_channel, set_up, tear_down) {
  client *c[3] = {join(*state, source("a", 50, UINT64_MAX, 0)), join(*state, source("b", 50, UINT64_MAX, 0))};
  api_live ahead = source("a", 50, UINT64_MAX, 0);
  ahead.first = 1000000;
  c[2] = join(*state, ahead);
  assert_int_equal(srv_live_look(*state).channels, 3);
  read_up_to(c[2], 1000002);
  assert_memory_equal(c[2]->text, "open\n1000000\n", 13);
  end_all(*state, c, 3);
}

TEST_WITH(a_channel_without_listeners_is_freed, set_up, tear_down) {
  client *c = join(*state, source("a", 0.01, 0, 0));
  read_all(c);
  leave(c);
  for (int waited = 0; waited < PATIENCE_MS && atomic_load(&sources) > 0; waited += 10) pause_ms(10);
  assert_int_equal(atomic_load(&sources), 0);
  assert_int_equal(srv_live_look(*state).channels, 0);
}

TEST_WITH(more_listeners_than_allowed_are_refused, set_up, tear_down) {
  client *c[4];
  for (int i = 0; i < 4; i++) c[i] = join(*state, source("a", 50, 0, 0));
  assert_non_null(c[2]->listener);
  assert_null(c[3]->listener);
  for (int i = 0; i < 4; i++) leave(c[i]);
}

TEST_WITH(a_slow_listener_skips_frames_and_delays_nobody, set_up, tear_down) {
  client *slow = join(*state, source("a", 50, 40, 20)), *quick = join(*state, source("a", 50, 40, 20));
  read_up_to(slow, 0); /* and a part of its dots */
  read_all(quick);     /* to the end, whatever the other does */
  read_all(slow);
  assert_string_equal(slow->text, "open\n0\n....................40\n....................close\n");
  assert_true(srv_live_look(*state).sent > 2 + 4);
  assert_true(srv_live_look(*state).skipped > 0);
  leave(slow);
  leave(quick);
}

TEST_WITH(silent_streams_send_a_sign_of_life, set_up, tear_down) {
  const double PULSE_S = 1.5;
  srv_live *live = srv_live_create(NULL, 2, (uint64_t)(PULSE_S * 1e9));
  double start = seconds();
  client *c[2] = {join(live, source("a", 0.01, UINT64_MAX, 0))};
  read_up_to(c[0], 0);
  pause_ms(750);
  double joined = seconds();
  c[1] = join(live, source("a", 0.01, UINT64_MAX, 0)); /* does not put the other one's off */
  assert_int_equal(srv_live_look(live).channels, 1);
  assert_true(wait_read(c[0], 7) > 0);
  double now = seconds();
  assert_string_equal(c[0]->text, "open\n0\n:\n");
  assert_true(now - start >= PULSE_S && now - joined < PULSE_S);
  while (strstr(c[1]->text, ":\n:\n") == NULL) assert_true(wait_read(c[1], 7) > 0);
  end_all(live, c, 2);
  srv_live_destroy(live);
}

/* Reads what there is; true at the end. */
static bool read_some(client *c) {
  pthread_mutex_lock(&c->lock);
  bool ready = c->ready;
  c->ready = false;
  pthread_mutex_unlock(&c->lock);
  int64_t size = ready ? 1 : 0;
  while (size > 0) {
    size = srv_listener_read(c->listener, (uint8_t *)c->text + c->size, 64);
    if (size > 0) c->size += (size_t)size;
  }
  return size < 0;
}

/* Reads what there is for each; returns how many are at the end. */
static int sweep(client **clients, bool *over, int count) {
  int ended = 0;
  for (int i = 0; i < count; i++) {
    if (!over[i]) over[i] = read_some(clients[i]);
    ended += over[i];
  }
  return ended;
}

TEST_WITH(a_thousand_listeners_cost_one_evaluation_a_frame, set_up, tear_down) {
  enum { LISTENERS = 1000 };
  static client *c[LISTENERS];
  static bool over[LISTENERS];
  srv_live *live = srv_live_create(NULL, LISTENERS, SRV_LIVE_PULSE_NS);
  double start = seconds();
  for (int i = 0; i < LISTENERS; i++) {
    while (seconds() - start < 0.0003 * i) pause_ms(1); /* they start apart, over six frames */
    c[i] = join(live, source("a", 20, 20, 0));
    c[i]->ready = true;
    if (i % 20 == 19) sweep(c, over, i + 1);
  }
  assert_int_equal(srv_live_look(live).channels, 1);
  while (sweep(c, over, LISTENERS) < LISTENERS) pause_ms(1);
  assert_true(atomic_load(&prints) <= 21);
  for (int i = 0; i < LISTENERS; i++) {
    /* Read in turns, a listener may skip a frame. */
    assert_whole(c[i], strtol(c[i]->text + strlen("open\n"), NULL, 10), 20);
    leave(c[i]);
  }
  srv_live_destroy(live);
}

static srv_live *others;

static void destroy_beside_others(void *context) {
  srv_live_look(others); /* which waits for ever where they wait for this */
  destroy_source(context);
}

TEST_WITH(nobody_waits_while_a_channel_is_freed, set_up, tear_down) {
  others = *state;
  api_live freed = source("a", 20, UINT64_MAX, 0);
  freed.destroy = destroy_beside_others;
  client *c = join(*state, freed);
  read_up_to(c, 0);
  leave(c);
  for (int waited = 0; waited < PATIENCE_MS && atomic_load(&sources) > 0; waited++) pause_ms(1);
  assert_int_equal(atomic_load(&sources), 0);
}

/* Of bytes that live streams hold, within the time that a busy machine takes. */
static void await_held(uint64_t least, uint64_t most) {
  for (int waited = 0; waited < PATIENCE_MS; waited++) {
    uint64_t held = fake_api_held(API_HELD_LIVE);
    if (held >= least && held <= most) return;
    pause_ms(1);
  }
  fail_msg("live streams hold %llu bytes, not from %llu to %llu",
           (unsigned long long)fake_api_held(API_HELD_LIVE), (unsigned long long)least,
           (unsigned long long)most);
}

TEST_WITH(a_stream_holds_its_source_and_its_frames, set_up, tear_down) {
  enum { SOURCE = 1000000, FRAME = 50000, SLACK = 4096 };
  api_live large = source("a", 50, UINT64_MAX, FRAME), other = source("b", 0.01, UINT64_MAX, 10);
  large.size = SOURCE;
  large.frame_size = 1000; /* only about */
  other.size = 7000000;
  client *c = join(*state, large);
  assert_true(fake_api_held(API_HELD_LIVE) >= SOURCE + 2 * 1000);
  for (int i = 0; i < 100 && srv_live_look(*state).printed < 6; i++) pause_ms(20);
  /* 128 KiB of frames are kept: two of these, and the first, which waits for the reader. */
  await_held(SOURCE + 2 * FRAME, SOURCE + 4 * FRAME + SLACK);
  client *more = join(*state, other);
  await_held(SOURCE + 7000000 + 2 * FRAME, SOURCE + 7000000 + 4 * FRAME + SLACK);
  leave(more);
  await_held(SOURCE + 2 * FRAME, SOURCE + 4 * FRAME + SLACK);
  leave(c);
  await_held(0, 0);
}

TEST_WITH(without_memory_streams_are_refused_that_nobody_shares, set_up, tear_down) {
  client *first = join(*state, source("a", 0.01, UINT64_MAX, 10));
  read_up_to(first, 0);
  fake_api_fill_memory(true);
  client *same = join(*state, source("a", 0.01, UINT64_MAX, 10)),
         *other = join(*state, source("b", 0.01, UINT64_MAX, 10));
  fake_api_fill_memory(false);
  assert_non_null(same->listener);
  assert_null(other->listener);
  assert_true(other->lacked_memory);
  client *late = join(*state, source("b", 0.01, UINT64_MAX, 10)),
         *beyond = join(*state, source("c", 0.01, UINT64_MAX, 10));
  assert_non_null(late->listener);
  assert_null(beyond->listener); /* the fourth of three */
  assert_false(beyond->lacked_memory);
  client *all[] = {first, same, late};
  end_all(*state, all, 3);
  leave(other);
  leave(beyond);
  await_held(0, 0);
}

TEST_WITH(frames_that_find_no_memory_are_skipped, set_up, tear_down) {
  api_live from = starting_in(300, 1000);
  *(size_t *)from.context = 1000; /* bytes of a frame, more than its source told */
  client *c = join(*state, from);
  fake_api_fill_memory(true);
  pause_ms(600);
  assert_true(atomic_load(&prints) > 0);
  assert_int_equal(srv_live_look(*state).printed, 0);
  fake_api_fill_memory(false);
  for (int waited = 0; waited < PATIENCE_MS && srv_live_look(*state).printed == 0; waited++) pause_ms(1);
  assert_true(srv_live_look(*state).printed > 0);
  end_all(*state, &c, 1);
}

TEST_WITH(the_end_cuts_streams_and_refuses_new_ones, set_up, tear_down) {
  client *c = join(*state, source("a", 0.01, UINT64_MAX, 0));
  read_up_to(c, 0);
  srv_live_end(*state);
  assert_int_equal(wait_read(c, 100), -1);
  assert_null(strstr(c->text, "close"));
  leave(c);
  client *late = join(*state, source("a", 1, UINT64_MAX, 0));
  assert_null(late->listener);
  leave(late);
}

TEST_WITH(ten_seconds_at_sixty_frames_drift_less_than_a_frame, set_up, tear_down) {
  client *c = join(*state, source("a", 60, 600, 0));
  double late[601], first = 1e9;
  int seen = 0;
  memset(late, 0, sizeof late);
  double start = seconds();
  while (wait_read(c, 100) > 0) {
    double now = seconds() - start;
    const char *line = c->text;
    c->size = 0;
    if (*line < '0' || *line > '9') continue;
    long number = strtol(line, NULL, 10);
    late[seen++] = now - (double)number / 60;
  }
  assert_true(seen > 100);
  /* The least delay is what the machine's other work did not touch. */
  double last = 1e9;
  for (int i = 0; i < seen / 4; i++) {
    if (late[i] < first) first = late[i];
    if (late[seen - 1 - i] < last) last = late[seen - 1 - i];
  }
  print_message("%d of 601 frames in time, drift %.3f ms\n", seen, (last - first) * 1e3);
  assert_true(last - first < 1.0 / 60 && first - last < 1.0 / 60);
  leave(c);
}
