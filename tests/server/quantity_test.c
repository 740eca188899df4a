#include "config.h"

#include "test.h"

typedef bool parse(const char *text, uint64_t *out);

static void assert_refused(parse *p, const char *const *texts, size_t count) {
  for (size_t i = 0; i < count; i++) {
    uint64_t out = 12345;
    if (p(texts[i], &out)) fail_msg("'%s' was taken", texts[i]);
    assert_true(out == 12345);
  }
}

static void assert_value(parse *p, const char *text, uint64_t expected) {
  uint64_t out = expected + 1;
  assert_true(p(text, &out));
  assert_true(out == expected);
}

TEST(what_is_no_quantity_is_refused) {
  static const char *const BAD[] = {"",    " 1",  "1 ",   "-1",  "+1",   "x",
                                    "1.5", "1e3", "0x10", "KiB", "1kib", "1MiBB"};
  enum { COUNT = sizeof BAD / sizeof *BAD };
  assert_refused(srv_parse_size, BAD, COUNT);
  assert_refused(srv_parse_count, BAD, COUNT);
  assert_refused(srv_parse_duration, BAD, COUNT);
}

TEST(units_of_other_kinds_are_refused) {
  assert_refused(srv_parse_size, (const char *const[]){"1s", "1M", "1k"}, 3);
  assert_refused(srv_parse_count, (const char *const[]){"1MiB", "1s", "1m"}, 3);
  assert_refused(srv_parse_duration, (const char *const[]){"10", "1M", "1KiB", "1d"}, 4);
}

TEST(more_than_64_bits_is_refused) {
  assert_value(srv_parse_count, "18446744073709551615", UINT64_MAX);
  assert_refused(srv_parse_count, (const char *const[]){"18446744073709551616", "18446744073709552k"}, 2);
  assert_refused(srv_parse_size, (const char *const[]){"16777216TiB", "99999999999999999999"}, 2);
  assert_value(srv_parse_size, "16777215TiB", UINT64_C(16777215) << 40);
}

TEST(units_multiply) {
  assert_value(srv_parse_size, "0", 0);
  assert_value(srv_parse_size, "7B", 7);
  assert_value(srv_parse_size, "256MiB", 256u << 20);
  assert_value(srv_parse_size, "4GiB", UINT64_C(4) << 30);
  assert_value(srv_parse_size, "5MB", 5000000);
  assert_value(srv_parse_count, "80M", 80000000);
  assert_value(srv_parse_duration, "0", 0);
  assert_value(srv_parse_duration, "500ms", 500);
  assert_value(srv_parse_duration, "10s", 10000);
  assert_value(srv_parse_duration, "2m", 120000);
  assert_value(srv_parse_duration, "1h", 3600000);
}

TEST(a_rate_has_a_count_and_a_unit_of_time) {
  api_rate rate = {0};
  assert_true(srv_parse_rate("1000000000/s", &rate));
  assert_int_equal(rate.count, SRV_RATE_MAX);
  assert_int_equal(rate.period_s, 1);
  assert_true(srv_parse_rate("30/h", &rate));
  static const char *const BAD[] = {"",     "5",    "5/",           "5/d",         "0/s",
                                    "-1/s", "5/s ", "1000000001/s", "4294967295/h"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++)
    if (srv_parse_rate(BAD[i], &rate)) fail_msg("'%s' was taken", BAD[i]);
  assert_int_equal(rate.count, 30);
  assert_int_equal(rate.period_s, 3600);
}
