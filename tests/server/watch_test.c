#include "watch.h"

#include "test.h"

static const srv_patience PATIENCE = {
    .header_ms = 10000, .idle_ms = 60000, .request_ms = 120000, .min_rate = 1000};

/* Expiry in `phase`, entered at 0, looked at once. */
static bool expired(srv_phase phase, bool draining, uint64_t now_ms) {
  srv_watch watch;
  srv_watch_enter(&watch, phase, 0);
  return srv_watch_expired(&watch, &PATIENCE, draining, now_ms, UINT64_C(1) << 40);
}

TEST(headers_have_their_time) {
  assert_false(expired(SRV_PHASE_HEAD, false, 9999));
  assert_true(expired(SRV_PHASE_HEAD, false, 10000));
}

TEST(idle_connections_have_their_time_and_none_when_draining) {
  assert_false(expired(SRV_PHASE_IDLE, false, 59999));
  assert_true(expired(SRV_PHASE_IDLE, false, 60000));
  assert_true(expired(SRV_PHASE_IDLE, true, 0));
}

TEST(requests_have_their_time_however_fast_they_come) {
  assert_false(expired(SRV_PHASE_BODY, true, 119999));
  assert_true(expired(SRV_PHASE_BODY, false, 120000));
}

TEST(work_and_fast_answers_never_expire) {
  assert_false(expired(SRV_PHASE_WORK, true, UINT64_C(1) << 40));
  assert_false(expired(SRV_PHASE_SEND, true, UINT64_C(1) << 30));
}

/* Looks every quarter of a second at a client that moves `rate` bytes a second, for a minute. */
static bool survives(srv_phase phase, uint64_t rate) {
  srv_watch watch;
  srv_watch_enter(&watch, phase, 0);
  for (uint64_t now = 0; now <= 60000; now += 250) {
    if (srv_watch_expired(&watch, &PATIENCE, false, now, rate * now / 1000)) return false;
  }
  return true;
}

TEST(clients_below_the_minimum_rate_are_cut_off) {
  assert_true(survives(SRV_PHASE_SEND, 1001));
  assert_false(survives(SRV_PHASE_SEND, 990));
  assert_true(survives(SRV_PHASE_BODY, 1001));
  assert_false(survives(SRV_PHASE_BODY, 0));
}

TEST(time_in_which_the_daemon_owes_bytes_is_not_the_clients) {
  srv_watch watch;
  srv_watch_enter(&watch, SRV_PHASE_SEND, 0);
  for (uint64_t now = 0; now <= 60000; now += 250) {
    if (now < 40000) srv_watch_rest(&watch);
    /* From 40 s on the client reads nothing: its first window ends 15 s later. */
    assert_int_equal(srv_watch_expired(&watch, &PATIENCE, false, now, 5000), now >= 54750);
    if (now >= 54750) break;
  }
}

TEST(client_that_stops_after_a_burst_is_cut_off) {
  srv_watch watch;
  srv_watch_enter(&watch, SRV_PHASE_SEND, 0);
  bool cut = false;
  for (uint64_t now = 0; now <= 31000; now += 250) {
    cut = cut || srv_watch_expired(&watch, &PATIENCE, false, now, 1000000500);
  }
  assert_true(cut);
}

TEST(count_that_shrinks_is_not_taken_for_slowness) {
  srv_watch watch;
  srv_watch_enter(&watch, SRV_PHASE_SEND, 0);
  assert_false(srv_watch_expired(&watch, &PATIENCE, false, 0, 1000));
  assert_false(srv_watch_expired(&watch, &PATIENCE, false, 20000, 10));
}

TEST(stream_may_be_slow_but_not_stand_still) {
  srv_watch watch;
  srv_watch_enter(&watch, SRV_PHASE_LIVE, 0);
  for (uint64_t now = 0; now <= 600000; now += 15000)
    assert_false(srv_watch_expired(&watch, &PATIENCE, true, now, now / 5000));
  assert_false(srv_watch_expired(&watch, &PATIENCE, false, 640000, 120));
  assert_true(srv_watch_expired(&watch, &PATIENCE, false, 646000, 120));
}
