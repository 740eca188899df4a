/* How long a request's head may be: each limit alone and with others, and what is over them is told so. */
#include "framing.h"
#include "sockets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { REQUEST_MAX = 64 << 10 };

/* A target of `size` bytes with so many arguments. */
static size_t put_target(char *out, size_t size, size_t arguments) {
  size_t used = (size_t)sprintf(out, "/light?");
  memset(out + used, 'v', size - used);
  for (size_t i = 1; i < arguments; i++) out[used + i * (size - used) / arguments] = '&';
  return size;
}

/* Header fields that framing counts as `size` bytes, "Host: x" among them. */
static size_t put_headers(char *out, size_t size, size_t count) {
  size_t used = (size_t)sprintf(out, "Host: x\r\n"), left = size - used;
  for (size_t i = 1; i < count; i++) {
    size_t share = left / (count - i);
    size_t name = (size_t)sprintf(out + used, "X-%zu: ", i);
    memset(out + used + name, 'v', share - name - 2);
    memcpy(out + used + share - 2, "\r\n", 2);
    used += share;
    left -= share;
  }
  return used;
}

/* Status of the answer, 0 without one. */
static int ask_long(fixture *f, size_t target, size_t arguments, size_t header_bytes, size_t headers) {
  char *request = calloc(1, REQUEST_MAX);
  size_t size = (size_t)sprintf(request, "GET ");
  size += put_target(request + size, target, arguments);
  size += (size_t)sprintf(request + size, " HTTP/1.1\r\n");
  size += put_headers(request + size, header_bytes, headers);
  sprintf(request + size, "Connection: close\r\n\r\n");
  ask(f, request);
  free(request);
  return f->answer_size > 0 ? status(f) : 0;
}

static void longest_target_is_answered_with_any_number_of_arguments(void **state) {
  fixture *f = *state;
  assert_int_equal(ask_long(f, SRV_TARGET_MAX, 1, 100, 2), 200);
  assert_int_equal(ask_long(f, SRV_TARGET_MAX, SRV_QUERY_ARGUMENTS_MAX, 400, 9), 200);
  assert_int_equal(ask_long(f, 1000, SRV_QUERY_ARGUMENTS_MAX, 4000, 20), 200);
}

static void most_headers_and_longest_headers_are_answered(void **state) {
  fixture *f = *state;
  size_t longest = SRV_HEADER_BYTES_MAX - strlen("Connection: close\r\n");
  assert_int_equal(ask_long(f, 100, 1, longest, 2), 200);
  assert_int_equal(ask_long(f, 100, 1, longest, SRV_HEADERS_MAX - 1), 200);
}

static void long_target_goes_with_headers_half_as_long_as_they_may_be(void **state) {
  fixture *f = *state;
  assert_int_equal(ask_long(f, SRV_TARGET_MAX, 10, SRV_HEADER_BYTES_MAX / 2, 40), 200);
}

static void what_is_longer_is_told_so(void **state) {
  fixture *f = *state;
  assert_int_equal(ask_long(f, SRV_TARGET_MAX + 1, 1, 100, 2), 414);
  assert_int_equal(ask_long(f, 40000, 1, 100, 2), 414);
  assert_int_equal(ask_long(f, 100, 1, SRV_HEADER_BYTES_MAX + 1, 20), 431);
  assert_int_equal(ask_long(f, 100, 1, 40000, 20), 431);
  assert_int_equal(ask_long(f, 100, 1, 4000, SRV_HEADERS_MAX + 1), 431);
}

static void longest_target_goes_with_longest_headers(void **state) {
  fixture *f = *state;
  size_t longest = SRV_HEADER_BYTES_MAX - strlen("Connection: close\r\n");
  assert_int_equal(ask_long(f, SRV_TARGET_MAX, 1, longest, 2), 200);
  assert_int_equal(ask_long(f, SRV_TARGET_MAX, 1, longest, SRV_HEADERS_MAX - 1), 200);
}

/* Silence, or half a head, is what a client gets when the library has room for a request and none for the
 * answer's fields. */
static void heads_of_all_lengths_are_answered(void **state) {
  fixture *f = *state;
  for (size_t target = 4096; target <= SRV_TARGET_MAX; target += 2048) {
    for (size_t bytes = 8192; bytes < SRV_HEADER_BYTES_MAX - 32; bytes += 511) {
      for (size_t headers = 5; headers < SRV_HEADERS_MAX; headers += 47) {
        assert_int_equal(ask_long(f, target, 1, bytes, headers), 200);
        assert_true(has(f, "\r\n\r\nlight"));
      }
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup_teardown(longest_target_is_answered_with_any_number_of_arguments, set_up,
                                      tear_down),
      cmocka_unit_test_setup_teardown(most_headers_and_longest_headers_are_answered, set_up, tear_down),
      cmocka_unit_test_setup_teardown(long_target_goes_with_headers_half_as_long_as_they_may_be, set_up,
                                      tear_down),
      cmocka_unit_test_setup_teardown(what_is_longer_is_told_so, set_up, tear_down),
      cmocka_unit_test_setup_teardown(longest_target_goes_with_longest_headers, set_up, tear_down),
      cmocka_unit_test_setup_teardown(heads_of_all_lengths_are_answered, set_up, tear_down),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
