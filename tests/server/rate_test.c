#include "rate.h"

#include "config.h"

#include <string.h>

#include "test.h"

enum { SECOND = 1000000000 };

static const uint64_t START = UINT64_C(1000) * SECOND;

static int set_up(void **state) {
  *state = srv_rates_create();
  return *state == NULL;
}

static int tear_down(void **state) {
  srv_rates_destroy(*state);
  return 0;
}

static srv_allowance take(srv_rates *rates, uint32_t client, uint64_t at_ns) {
  uint8_t id[16] = {0};
  memcpy(id, &client, sizeof client);
  return srv_rates_take(rates, id, (api_rate){4, 2}, START + at_ns);
}

TEST_WITH(a_bucket_gives_its_count_and_then_fills_up_again, set_up, tear_down) {
  srv_rates *rates = *state;
  for (uint32_t i = 0; i < 4; i++) {
    srv_allowance got = take(rates, 1, 0);
    assert_int_equal(got.retry_s, 0);
    assert_int_equal(got.left, 3 - i);
  }
  srv_allowance refused = take(rates, 1, 0);
  assert_int_equal(refused.retry_s, 1);
  assert_int_equal(refused.reset_s, 2);
  assert_int_equal(take(rates, 1, SECOND / 2 - 1).retry_s, 1);
  assert_int_equal(take(rates, 1, SECOND / 2).retry_s, 0); /* a token each half second */
  assert_int_equal(take(rates, 1, SECOND / 2).retry_s, 1);
  assert_int_equal(take(rates, 1, 10 * (uint64_t)SECOND).left, 3);
}

TEST_WITH(the_highest_rate_gives_a_request_a_nanosecond, set_up, tear_down) {
  static const uint8_t ID[16] = {1};
  srv_allowance got = srv_rates_take(*state, ID, (api_rate){SRV_RATE_MAX, 1}, START);
  assert_int_equal(got.retry_s, 0);
  assert_int_equal(got.left, SRV_RATE_MAX - 1);
}

TEST_WITH(buckets_are_apart, set_up, tear_down) {
  srv_rates *rates = *state;
  for (uint32_t i = 0; i < 5; i++) take(rates, 1, 0);
  assert_int_equal(take(rates, 1, 0).retry_s, 1);
  assert_int_equal(take(rates, 2, 0).left, 3);
}

/* Many clients of one request each drive out each other, not the one that has used its rate up. */
TEST_WITH(where_buckets_are_too_many_the_fullest_are_forgotten, set_up, tear_down) {
  srv_rates *rates = *state;
  for (uint32_t i = 0; i < 4; i++) take(rates, 1, 0);
  for (uint32_t client = 2; client < 300000; client++) take(rates, client, 0);
  assert_int_equal(take(rates, 1, 0).retry_s, 1);
}
