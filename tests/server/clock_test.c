/* Dates as RFC 9110 writes them, also when the clock is set. */
#include "clock.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static void dates_are_those_of_the_standard(void **state) {
  (void)state;
  assert_string_equal(srv_date(0), "Thu, 01 Jan 1970 00:00:00 GMT");
  assert_string_equal(srv_date(784111777), "Sun, 06 Nov 1994 08:49:37 GMT");
  assert_string_equal(srv_date(1709164799), "Wed, 28 Feb 2024 23:59:59 GMT");
  assert_string_equal(srv_date(1709164800), "Thu, 29 Feb 2024 00:00:00 GMT");
}

static void clock_that_is_set_back_has_its_dates_again(void **state) {
  (void)state;
  assert_string_equal(srv_date(784111777), "Sun, 06 Nov 1994 08:49:37 GMT");
  assert_string_equal(srv_date(784111778), "Sun, 06 Nov 1994 08:49:38 GMT");
  assert_string_equal(srv_date(784111777), "Sun, 06 Nov 1994 08:49:37 GMT");
}

static void date_of_now_is_of_now(void **state) {
  (void)state;
  int64_t before = (int64_t)time(NULL) - 1; /* a coarse clock is a tick behind */
  char text[64];
  snprintf(text, sizeof text, "%s", srv_date_now());
  int64_t after = (int64_t)time(NULL);
  bool is_found = false;
  for (int64_t second = before; second <= after; second++) is_found |= strcmp(text, srv_date(second)) == 0;
  assert_true(is_found);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(dates_are_those_of_the_standard),
      cmocka_unit_test(clock_that_is_set_back_has_its_dates_again),
      cmocka_unit_test(date_of_now_is_of_now),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
