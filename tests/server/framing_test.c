#include "framing.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static int target_status(const char *target) {
  srv_framing framing = {0};
  srv_framing_target(&framing, target);
  return framing.status;
}

static void add(srv_framing *framing, const char *name, const char *value) {
  srv_framing_header(framing, name, strlen(name), value, strlen(value));
}

/* Judges a request with these headers (NULL: none) beside Host. */
static srv_framing judge(const char *version, const char *name, const char *value, const char *name_2,
                         const char *value_2) {
  srv_framing framing = {0};
  srv_framing_target(&framing, "/");
  srv_framing_version(&framing, version);
  add(&framing, "Host", "x");
  if (name != NULL) add(&framing, name, value);
  if (name_2 != NULL) add(&framing, name_2, value_2);
  srv_framing_end(&framing);
  return framing;
}

static int one(const char *name, const char *value) {
  return judge("HTTP/1.1", name, value, NULL, NULL).status;
}

static int two(const char *name, const char *value, const char *name_2, const char *value_2) {
  return judge("HTTP/1.1", name, value, name_2, value_2).status;
}

static void targets_with_raw_or_broken_bytes_are_400(void **state) {
  (void)state;
  static const char *const BAD[] = {"/a b", "/a\tb", "/a\x01",   "/\xc3\xa4", "/a#b", "/%",      "/%4",
                                    "/%4g", "/%00",  "/a?b=%00", "a",         "",     "ftp://x/"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
    if (target_status(BAD[i]) != 400) fail_msg("'%s' gave %d", BAD[i], target_status(BAD[i]));
  }
}

static void targets_of_every_form_are_fine(void **state) {
  (void)state;
  static const char *const GOOD[] = {"/", "*", "/a%20b?c=d&e", "http://x/y", "HTTPS://x", "/a\"<>{}|"};
  for (size_t i = 0; i < sizeof GOOD / sizeof *GOOD; i++) assert_int_equal(target_status(GOOD[i]), 0);
}

static void target_may_have_8192_bytes_and_100_arguments(void **state) {
  (void)state;
  static char target[SRV_TARGET_MAX + 2];
  memset(target, 'a', SRV_TARGET_MAX);
  target[0] = '/';
  assert_int_equal(target_status(target), 0);
  target[SRV_TARGET_MAX] = 'a';
  assert_int_equal(target_status(target), 414);

  char query[SRV_ARGUMENTS_MAX + 8] = "/?";
  memset(query + 2, '&', SRV_ARGUMENTS_MAX - 1);
  assert_int_equal(target_status(query), 0);
  query[2 + SRV_ARGUMENTS_MAX - 1] = '&';
  assert_int_equal(target_status(query), 400);
}

static void lengths_that_are_not_plain_numbers_are_400(void **state) {
  (void)state;
  static const char *const BAD[] = {"", "+3", "-3", "3, 3", "0x3", "3 ", "1e3", "9999999999999999999"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) assert_int_equal(one("Content-Length", BAD[i]), 400);
}

static void two_framings_are_400(void **state) {
  (void)state;
  assert_int_equal(two("Content-Length", "3", "Content-Length", "4"), 400);
  assert_int_equal(two("Content-Length", "3", "content-length", "3"), 400);
  assert_int_equal(two("Content-Length", "3", "Transfer-Encoding", "chunked"), 400);
  assert_int_equal(two("Transfer-Encoding", "chunked", "Transfer-Encoding", "chunked"), 400);
  assert_int_equal(judge("HTTP/1.0", "Transfer-Encoding", "chunked", NULL, NULL).status, 400);
}

static void other_transfer_codings_are_501(void **state) {
  (void)state;
  assert_int_equal(one("Transfer-Encoding", "cow"), 501);
  assert_int_equal(one("Transfer-Encoding", "gzip, chunked"), 501);
  assert_int_equal(one("Transfer-Encoding", "identity"), 501);
}

static void header_names_are_tokens_and_values_have_no_controls(void **state) {
  (void)state;
  assert_int_equal(one("Content-Length ", "3"), 400);
  assert_int_equal(one("X A", "b"), 400);
  assert_int_equal(one("", "b"), 400);
  assert_int_equal(one("X-A", "a\rb"), 400);
  assert_int_equal(one("X-A", "a\x7f"), 400);
  assert_int_equal(one("X-A", "a\tb \xc3\xa4"), 0);
}

static void expectations_but_one_are_417(void **state) {
  (void)state;
  assert_int_equal(one("Expect", "rain"), 417);
  srv_framing framing = judge("HTTP/1.1", "Expect", "100-Continue", "Content-Length", "5");
  assert_true(framing.status == 0 && framing.continues && framing.has_length && framing.length == 5);
}

static void host_is_there_once(void **state) {
  (void)state;
  assert_int_equal(one("Host", "y"), 400);
  srv_framing framing = {0};
  srv_framing_version(&framing, "HTTP/1.1");
  srv_framing_end(&framing);
  assert_int_equal(framing.status, 400);
  framing = (srv_framing){0};
  srv_framing_version(&framing, "HTTP/1.0");
  srv_framing_end(&framing);
  assert_int_equal(framing.status, 0);
}

static void versions_but_two_are_505(void **state) {
  (void)state;
  static const char *const others[] = {"HTTP/2.0", "HTTP/1.2", "HTTP/1.10", "HTTP/1.1 ", "http/1.1", ""};
  for (size_t i = 0; i < sizeof others / sizeof *others; i++)
    assert_int_equal(judge(others[i], NULL, NULL, NULL, NULL).status, 505);
}

static void a_hundred_headers_are_the_most(void **state) {
  (void)state;
  srv_framing framing = {0};
  add(&framing, "Host", "x");
  for (int i = 1; i < SRV_HEADERS_MAX; i++) add(&framing, "a", "b");
  srv_framing_end(&framing);
  assert_int_equal(framing.status, 0);
  add(&framing, "a", "b");
  assert_int_equal(framing.status, 431);
}

/* One header of this name with so many bytes, each of which is the letter. */
static int long_one(const char *name, char letter, size_t size) {
  static char value[SRV_HEAD_MAX + 1];
  memset(value, letter, size);
  value[size] = '\0';
  return one(name, value);
}

static void head_is_measured_with_its_records(void **state) {
  (void)state;
  size_t others = strlen("/") + strlen("Host: x\r\n") + strlen("Long: \r\n") + 3 * SRV_RECORD_SIZE;
  assert_int_equal(long_one("Long", 'v', SRV_HEAD_MAX - others), 0);
  assert_int_equal(long_one("Long", 'v', SRV_HEAD_MAX - others + 1), 431);
}

static void cookies_are_measured_twice_and_each_by_itself(void **state) {
  (void)state;
  size_t others = strlen("/") + strlen("Host: x\r\n") + strlen("Cookie: \r\n") + 4 * SRV_RECORD_SIZE + 1;
  size_t most = (SRV_HEAD_MAX - others) / 2;
  assert_int_equal(long_one("cookie", 'v', most), 0);
  assert_int_equal(long_one("COOKIE", 'v', most + 1), 431);
  size_t records = SRV_RECORDS_MAX - 4 * SRV_RECORD_SIZE - 1;
  assert_int_equal(long_one("Cookie", ';', records / (SRV_RECORD_SIZE + 1)), 0);
  assert_int_equal(long_one("Cookie", ',', records / (SRV_RECORD_SIZE + 1) + 1), 431);
}

static void first_refusal_stays(void **state) {
  (void)state;
  assert_int_equal(two("Transfer-Encoding", "cow", "X A", "b"), 501);
}

static void names_are_ruled_out_by_their_initials(void **state) {
  (void)state;
  srv_framing framing = judge("HTTP/1.1", "if-match", "*", "X-API-Key", "k");
  assert_true(srv_framing_may_have(&framing, "If-Match"));
  assert_true(srv_framing_may_have(&framing, "IF-NONE-MATCH"));
  assert_true(srv_framing_may_have(&framing, "x-api-key"));
  assert_true(srv_framing_may_have(&framing, "Host"));
  assert_false(srv_framing_may_have(&framing, "Authorization"));
  assert_false(srv_framing_may_have(&framing, "Range"));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(targets_with_raw_or_broken_bytes_are_400),
      cmocka_unit_test(targets_of_every_form_are_fine),
      cmocka_unit_test(target_may_have_8192_bytes_and_100_arguments),
      cmocka_unit_test(lengths_that_are_not_plain_numbers_are_400),
      cmocka_unit_test(two_framings_are_400),
      cmocka_unit_test(other_transfer_codings_are_501),
      cmocka_unit_test(header_names_are_tokens_and_values_have_no_controls),
      cmocka_unit_test(expectations_but_one_are_417),
      cmocka_unit_test(host_is_there_once),
      cmocka_unit_test(versions_but_two_are_505),
      cmocka_unit_test(a_hundred_headers_are_the_most),
      cmocka_unit_test(head_is_measured_with_its_records),
      cmocka_unit_test(cookies_are_measured_twice_and_each_by_itself),
      cmocka_unit_test(first_refusal_stays),
      cmocka_unit_test(names_are_ruled_out_by_their_initials),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
