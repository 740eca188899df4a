#include "compute_limit.h"

#include <time.h>

#include "test.h"

static int reads, destroyed;

static int64_t read_slowly(void *context, uint8_t *out, size_t capacity) {
  (void)context;
  (void)capacity;
  nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
  out[0] = (uint8_t)reads++;
  return 1;
}

static void count_destroyed(void *context) {
  (void)context;
  destroyed++;
}

static int count_reads(uint64_t left_ns, int most) {
  api_body body = {7, NULL, read_slowly, count_destroyed, false};
  uint8_t byte;
  reads = destroyed = 0;
  assert_true(srv_compute_limit(&body, left_ns));
  assert_int_equal(body.size, 7);
  while (reads < most && body.read(body.context, &byte, 1) == 1) continue;
  body.destroy(body.context);
  assert_int_equal(destroyed, 1);
  return reads;
}

TEST(a_body_ends_with_an_error_between_two_blocks_once_its_time_is_over) {
  int count = count_reads(12000000, 100);
  assert_in_range(count, 1, 3);
  assert_int_equal(count_reads(UINT64_C(60000000000), 10), 10);
}

TEST(the_time_between_reads_is_not_counted) {
  api_body body = {7, NULL, read_slowly, count_destroyed, false};
  uint8_t byte;
  assert_true(srv_compute_limit(&body, UINT64_C(1000000000)));
  for (int i = 0; i < 2; i++) {
    nanosleep(&(struct timespec){.tv_nsec = 600000000}, NULL);
    assert_int_equal(body.read(body.context, &byte, 1), 1);
  }
  assert_int_equal(body.read(body.context, &byte, 1), 1);
  body.destroy(body.context);
}
