#include "framing.h"

#include <ctype.h>
#include <string.h>

#include "test.h"

static int target_status(const char *target) {
  srv_framing framing = {0};
  srv_framing_target(&framing, target);
  return framing.status;
}

/* As the library hands a field out: where it lies in the head. */
static void add(srv_framing *framing, const char *name, const char *value) {
  static char line[SRV_HEAD_MAX + 64];
  size_t name_size = strlen(name), value_size = strlen(value);
  memcpy(line, name, name_size + 1);
  memcpy(line + name_size + 2, value, value_size + 1);
  srv_framing_field(framing, line, name_size, line + name_size + 2, value_size);
}

/* Judges a request with these fields (NULL: none) beside Host. */
static srv_framing judge(const char *version, const char *name, const char *value, const char *name_2,
                         const char *value_2) {
  srv_framing framing = {0};
  srv_framing_target(&framing, "/");
  srv_framing_line(&framing, "GET", version);
  add(&framing, "Host", "x");
  if (name != NULL) add(&framing, name, value);
  if (name_2 != NULL) add(&framing, name_2, value_2);
  srv_framing_end(&framing, 100);
  return framing;
}

static int one(const char *name, const char *value) {
  return judge("HTTP/1.1", name, value, NULL, NULL).status;
}

static int two(const char *name, const char *value, const char *name_2, const char *value_2) {
  return judge("HTTP/1.1", name, value, name_2, value_2).status;
}

TEST(targets_with_raw_or_broken_bytes_are_400) {
  static const char *const BAD[] = {"/a b", "/a\tb", "/a\x01",   "/\xc3\xa4", "/a#b", "/%",      "/%4",
                                    "/%4g", "/%00",  "/a?b=%00", "a",         "",     "ftp://x/"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
    if (target_status(BAD[i]) != 400) fail_msg("'%s' gave %d", BAD[i], target_status(BAD[i]));
  }
}

TEST(targets_of_every_form_are_fine) {
  static const char *const GOOD[] = {"/", "*", "/a%20b?c=d&e", "http://x/y", "HTTPS://x", "/a\"<>{}|"};
  for (size_t i = 0; i < sizeof GOOD / sizeof *GOOD; i++) assert_int_equal(target_status(GOOD[i]), 0);
}

TEST(target_has_8192_bytes_and_32_arguments_at_most) {
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

TEST(lengths_that_are_not_plain_numbers_are_400) {
  static const char *const BAD[] = {
      "", "+3", "-3", "3, 3", "3,3", "3 3", "0x3", "1e3", "9999999999999999999"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) assert_int_equal(one("Content-Length", BAD[i]), 400);
}

TEST(blanks_behind_a_length_are_trimmed) {
  srv_framing framing = judge("HTTP/1.1", "Content-Length", "35 \t ", NULL, NULL);
  assert_true(framing.status == 0 && framing.length == 35);
}

TEST(two_framings_are_400) {
  assert_int_equal(two("Content-Length", "3", "Content-Length", "4"), 400);
  assert_int_equal(two("Content-Length", "3", "content-length", "3"), 400);
  assert_int_equal(two("Content-Length", "3", "Transfer-Encoding", "chunked"), 400);
  assert_int_equal(two("Transfer-Encoding", "chunked", "Transfer-Encoding", "chunked"), 400);
  assert_int_equal(judge("HTTP/1.0", "Transfer-Encoding", "chunked", NULL, NULL).status, 400);
}

TEST(other_transfer_codings_are_501) {
  assert_int_equal(one("Transfer-Encoding", "cow"), 501);
  assert_int_equal(one("Transfer-Encoding", "gzip, chunked"), 501);
  assert_int_equal(one("Transfer-Encoding", "identity"), 501);
  assert_int_equal(one("Transfer-Encoding", "chunked "), 501); /* the library would not decode it */
}

TEST(names_of_fields_are_tokens_and_values_have_no_controls) {
  assert_int_equal(one("Content-Length ", "3"), 400);
  assert_int_equal(one("X A", "b"), 400);
  assert_int_equal(one("", "b"), 400);
  assert_int_equal(one("X-A", "a\rb"), 400);
  assert_int_equal(one("X-A", "a\x7f"), 400);
  assert_int_equal(one("X-A", "a\tb \xc3\xa4"), 0);
}

TEST(bytes_of_names_and_values_are_judged_at_every_place) {
  static const char marks[] = "!#$%&'*+-.^_`|~"; /* RFC 9110, section 5.6.2 */
  for (int c = 1; c < 256; c++) {
    bool in_name = (c < 128 && isalnum(c)) || strchr(marks, c);
    bool in_value = c == '\t' || (c >= ' ' && c != 127);
    for (size_t at = 0; at < 36; at++) {
      char text[] = "X-A-field-of-bytes-of-which-one-vari";
      text[at] = (char)c;
      assert_int_equal(one(text, "b"), in_name ? 0 : 400);
      assert_int_equal(one("X-A", text), in_value ? 0 : 400);
    }
  }
}

TEST(expectations_but_one_are_417) {
  assert_int_equal(one("Expect", "rain"), 417);
  srv_framing framing = judge("HTTP/1.1", "Expect", "100-Continue", "Content-Length", "5");
  assert_true(framing.status == 0 && framing.continues && framing.has_length && framing.length == 5);
}

TEST(host_is_there_once) {
  assert_int_equal(one("Host", "y"), 400);
  srv_framing framing = {0};
  srv_framing_line(&framing, "GET", "HTTP/1.1");
  srv_framing_end(&framing, 100);
  assert_int_equal(framing.status, 400);
  framing = (srv_framing){0};
  srv_framing_line(&framing, "GET", "HTTP/1.0");
  srv_framing_end(&framing, 100);
  assert_int_equal(framing.status, 0);
}

TEST(versions_but_two_are_505) {
  static const char *const others[] = {"HTTP/2.0", "HTTP/1.2", "HTTP/1.10", "HTTP/1.1 ", "http/1.1", ""};
  for (size_t i = 0; i < sizeof others / sizeof *others; i++)
    assert_int_equal(judge(others[i], NULL, NULL, NULL, NULL).status, 505);
}

static int status_of_fields(int others, const char *cookies, size_t head_size) {
  srv_framing framing = {0};
  add(&framing, "Host", "x");
  for (int i = 0; i < others; i++) add(&framing, "a", "b");
  if (cookies != NULL) add(&framing, "cookie", cookies);
  srv_framing_end(&framing, head_size);
  return framing.status;
}

TEST(sixty_four_fields_and_cookies_are_the_most) {
  assert_int_equal(status_of_fields(SRV_FIELDS_MAX - 1, NULL, 1000), 0);
  assert_int_equal(status_of_fields(SRV_FIELDS_MAX, NULL, 1000), 431);
  assert_int_equal(status_of_fields(SRV_FIELDS_MAX - 5, "a=1; b; c", 1000), 0);
  assert_int_equal(status_of_fields(SRV_FIELDS_MAX - 5, "a=1; b; c,d", 1000), 431);
}

TEST(four_kilobytes_of_cookies_are_the_most) {
  static char cookies[SRV_COOKIES_MAX + 2];
  memset(cookies, 'c', SRV_COOKIES_MAX);
  assert_int_equal(status_of_fields(0, cookies, 5000), 0);
  cookies[SRV_COOKIES_MAX] = 'c';
  assert_int_equal(status_of_fields(0, cookies, 5000), 431);
}

TEST(sixteen_kilobytes_are_the_longest_head) {
  assert_int_equal(status_of_fields(0, NULL, SRV_HEAD_MAX), 0);
  assert_int_equal(status_of_fields(0, NULL, SRV_HEAD_MAX + 1), 431);
}

static int whole_status(size_t head_size) {
  srv_framing framing = judge("HTTP/1.1", "X-A", "b", NULL, NULL);
  srv_framing_whole(&framing, head_size);
  return framing.status;
}

TEST(head_of_which_a_byte_is_not_shown_is_400) {
  size_t size = strlen("GET / HTTP/1.1\r\nHost: x\r\nX-A: b\r\n\r\n");
  assert_int_equal(whole_status(size), 0);
  assert_int_equal(whole_status(size + 1), 400); /* X-A: b\0 */
  assert_int_equal(whole_status(size - 1), 400); /* a line without its CR */
}

TEST(first_refusal_stays) {
  assert_int_equal(two("Transfer-Encoding", "cow", "X A", "b"), 501);
}

static int host_status(const char *host) {
  srv_framing framing = {0};
  srv_framing_target(&framing, "/");
  srv_framing_line(&framing, "GET", "HTTP/1.1");
  add(&framing, "Host", host);
  srv_framing_end(&framing, 100);
  return framing.status;
}

TEST(host_is_a_name_or_an_address_with_or_without_a_port) {
  static const char *const BAD[] = {"",         "a b/@:x", " ",      "a/b",     "user@host", "a:x",
                                    ":80",      "a:80:90", "[::1",   "[]",      "[::1]x",    "[::1]:x",
                                    "::1",      "a?b",     "a#b",    "a\\b",    "a\"b",      "a%41",
                                    "http://a", "a, b",    "[g::1]", "\xc3\xa4"};
  static const char *const GOOD[] = {"localhost",     "a.example:8080", "127.0.0.1:1", "[::1]",
                                     "[fd00::1]:443", "a_b-c.example.", "a:",          "A",
                                     "x~y!z"};
  for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++)
    if (host_status(BAD[i]) != 400) fail_msg("'%s' gave %d", BAD[i], host_status(BAD[i]));
  for (size_t i = 0; i < sizeof GOOD / sizeof *GOOD; i++)
    if (host_status(GOOD[i]) != 0) fail_msg("'%s' gave %d", GOOD[i], host_status(GOOD[i]));
}
