/* The pages: stored by gzip and brotli, sent so or plain, open to everybody. */
#include "loopback.h"

#include <stdio.h>
#include <string.h>
#include <zlib.h>

static const char html[] = "<!doctype html><title>page</title>";
static uint8_t stored[200];
static const uint8_t by_brotli[] = "never decoded";

/* The settings of a daemon that has the page above. */
static api_settings with_page(void) {
  z_stream stream = {0};
  assert_int_equal(deflateInit2(&stream, 9, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  stream.next_in = (Bytef *)(uintptr_t)html;
  stream.avail_in = sizeof html - 1;
  stream.next_out = stored;
  stream.avail_out = sizeof stored;
  assert_int_equal(deflate(&stream, Z_FINISH), Z_STREAM_END);
  size_t size = sizeof stored - stream.avail_out;
  deflateEnd(&stream);
  api_settings settings = loopback_settings();
  settings.page = (api_page){{stored, size}, {0}, "0123", "default-src 'none'"};
  settings.docs = (api_page){{stored, size}, {by_brotli, sizeof by_brotli}, "4567", "default-src 'self'"};
  settings.example = (api_page){{stored, size}, {0}, "89ab", "default-src data:"};
  settings.viewer = (api_page){{stored, size}, {0}, "cdef", NULL};
  return settings;
}

static int setup(void **state) {
  api_settings settings = with_page();
  *state = loopback_start(&settings);
  return 0;
}

static reply ask_page(loopback *loop, const char *headers) {
  return loopback_ask(loop, "GET", "/", headers, NULL, 0);
}

TEST_WITH(a_daemon_without_a_page_answers_404, loopback_setup, loopback_teardown) {
  assert_problem(loopback_get(*state, "/"), 404, NULL, "page");
  assert_problem(loopback_get(*state, "/docs"), 404, NULL, "page");
  assert_problem(loopback_get(*state, "/viewer.js"), 404, NULL, "built without npm");
}

TEST_WITH(each_page_has_its_policy_and_tag, setup, loopback_teardown) {
  static const char *const pages[][2] = {
      {"/", "default-src 'none'"}, {"/docs", "default-src 'self'"}, {"/example.html", "default-src data:"}};
  char tags[3][80];
  for (size_t i = 0; i < 3; i++) {
    reply r = loopback_get(*state, pages[i][0]);
    assert_int_equal(r.status, 200);
    assert_string_equal(reply_header(&r, "Content-Security-Policy"), pages[i][1]);
    assert_memory_equal(r.body, html, r.size);
    snprintf(tags[i], sizeof tags[i], "%s", reply_header(&r, "ETag"));
    for (size_t k = 0; k < i; k++) assert_string_not_equal(tags[i], tags[k]);
    reply_free(&r);
  }
}

TEST_WITH(the_viewer_is_a_script_for_pages_of_all_origins, setup, loopback_teardown) {
  reply r = loopback_ask(*state, "GET", "/viewer.js",
                         "Accept-Encoding: gzip\nOrigin: https://elsewhere.example\n", NULL, 0);
  assert_int_equal(r.status, 200);
  assert_string_equal(reply_header(&r, "Content-Type"), "text/javascript");
  assert_string_equal(reply_header(&r, "Access-Control-Allow-Origin"), "*");
  assert_null(reply_header(&r, "Content-Security-Policy"));
  assert_memory_equal(r.body, stored, r.size);
  reply_free(&r);
}

TEST_WITH(clients_of_gzip_get_the_stored_bytes, setup, loopback_teardown) {
  const api_settings settings = with_page();
  static const char *const headers[] = {"Accept-Encoding: gzip\n",
                                        "Accept-Encoding: gzip, deflate, br, zstd\n",
                                        "Accept-Encoding: identity;q=0, *\n"};
  for (size_t i = 0; i < sizeof headers / sizeof *headers; i++) {
    reply r = ask_page(*state, headers[i]);
    assert_int_equal(r.status, 200);
    assert_string_equal(reply_header(&r, "Content-Encoding"), "gzip");
    assert_string_equal(reply_header(&r, "Content-Type"), "text/html");
    assert_string_equal(reply_header(&r, "Content-Security-Policy"), "default-src 'none'");
    assert_string_equal(reply_header(&r, "Cache-Control"), "no-cache");
    assert_non_null(strstr(reply_header(&r, "Vary"), "Accept-Encoding"));
    assert_int_equal(r.size, settings.page.gzip.size);
    assert_memory_equal(r.body, stored, r.size);
    reply_free(&r);
  }
}

TEST_WITH(the_coding_is_the_one_that_is_preferred_of_those_that_are_stored, setup, loopback_teardown) {
  static const struct {
    const char *accepted, *coding;
  } cases[] = {{"br", "br"},
               {"gzip, deflate, br, zstd", "br"},
               {"gzip;q=0.9, br;q=0.5", "gzip"},
               {"br;q=0, gzip", "gzip"},
               {"gzip;q=0, *;q=0.1", "br"},
               {"br;q=0.5, identity", NULL},
               {"zstd, br;q=0.2, identity;q=0.5", NULL},
               {"br;q=0, gzip;q=0", NULL},
               {"identity", NULL}};
  char tags[3][80] = {"", "", ""};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char header[80];
    snprintf(header, sizeof header, "Accept-Encoding: %s\n", cases[i].accepted);
    reply r = loopback_ask(*state, "GET", "/docs", header, NULL, 0);
    const char *coding = reply_header(&r, "Content-Encoding");
    bool is_brotli = coding && strcmp(coding, "br") == 0;
    if (!cases[i].coding)
      assert_null(coding);
    else
      assert_string_equal(coding, cases[i].coding);
    if (is_brotli) assert_int_equal(r.size, sizeof by_brotli);
    if (is_brotli) assert_memory_equal(r.body, by_brotli, r.size);
    snprintf(tags[is_brotli ? 2 : coding ? 1 : 0], sizeof *tags, "%s", reply_header(&r, "ETag"));
    reply_free(&r);
  }
  for (size_t i = 0; i < 3; i++) assert_string_not_equal(tags[i], tags[(i + 1) % 3]);
}

TEST_WITH(other_clients_get_it_plain, setup, loopback_teardown) {
  static const char *const headers[] = {NULL, "Accept-Encoding: identity\n", "Accept-Encoding: gzip;q=0\n",
                                        "Accept-Encoding: zstd\n", /* so short a page is not packed anew */
                                        "Accept-Encoding: gzip;q=0.5, identity\n"};
  for (size_t i = 0; i < sizeof headers / sizeof *headers; i++) {
    reply r = ask_page(*state, headers[i]);
    assert_int_equal(r.status, 200);
    assert_null(reply_header(&r, "Content-Encoding"));
    assert_int_equal(r.size, sizeof html - 1);
    assert_memory_equal(r.body, html, r.size);
    reply_free(&r);
  }
}

TEST_WITH(its_tag_is_strong_and_one_for_each_coding, setup, loopback_teardown) {
  reply plain = ask_page(*state, NULL), coded = ask_page(*state, "Accept-Encoding: gzip\n");
  const char *tag = reply_header(&plain, "ETag");
  assert_int_equal(tag[0], '"');
  assert_string_not_equal(tag, reply_header(&coded, "ETag"));
  char header[80];
  snprintf(header, sizeof header, "If-None-Match: %s\n", tag);
  reply again = ask_page(*state, header);
  assert_int_equal(again.status, 304);
  assert_int_equal(again.size, 0);
  reply_free(&again);
  reply_free(&coded);
  reply_free(&plain);
}

TEST(the_page_is_open_where_keys_are_on) {
  static const api_key keys[] = {{"alpha", ALL_RIGHTS, {0}}};
  api_settings settings = with_page();
  settings.keyring = (api_keyring){.keys = keys, .count = 1};
  loopback *loop = loopback_start(&settings);
  static const char *const pages[] = {"/", "/docs", "/example.html", "/viewer.js"};
  for (size_t i = 0; i < sizeof pages / sizeof *pages; i++) {
    reply r = loopback_get(loop, pages[i]);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  loopback_stop(loop);
}
