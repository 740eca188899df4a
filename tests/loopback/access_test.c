/* Rights of keys, signed URLs, and what pages of other origins may do. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ID "00112233445566778899aabbccddeeff"

static const char triangle[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/* ---- rights ---------------------------------------------------------------------------------- */

static int start_with_keys(void **state) {
  static const api_key keys[] = {{"reader", API_MAY_READ, {0}},
                                 {"writer", API_MAY_WRITE, {0}},
                                 {"remover", API_MAY_DELETE, {0}},
                                 {"twice", API_MAY_WRITE, {7, 60}},
                                 {"twice", API_MAY_READ, {0}}};
  static const api_key url_keys[] = {{.text = "rose"}, {.text = "old"}};
  api_settings settings = loopback_settings();
  settings.keyring = (api_keyring){.keys = keys, .count = 5, .url_keys = url_keys, .url_count = 2};
  loopback *loop = loopback_start(&settings);
  loop->now_s = 1000;
  *state = loop;
  return 0;
}

static int status_of(loopback *loop, const char *method, const char *target, const char *key) {
  char headers[64];
  snprintf(headers, sizeof headers, "X-API-Key: %s\n", key);
  bool has_body = strcmp(method, "POST") == 0;
  reply r = loopback_ask(loop, method, target, headers, has_body ? triangle : NULL,
                         has_body ? strlen(triangle) : 0);
  int status = r.status;
  reply_free(&r);
  return status;
}

TEST_WITH(a_key_does_what_it_has_the_right_to, start_with_keys, loopback_teardown) {
  static const struct {
    const char *method, *target, *key;
    int status;
  } cases[] = {
      {"GET", "/v1/models", "reader", 200},
      {"GET", "/v1/models", "writer", 403},
      {"GET", "/v1/models", "remover", 403},
      {"POST", "/v1/surface.json?level=0", "reader", 200},
      {"POST", "/v1/surface.json?level=0", "writer", 403},
      {"POST", "/v1/models", "writer", 201},
      {"POST", "/v1/models", "reader", 403},
      {"POST", "/v1/models", "remover", 403},
      {"DELETE", "/v1/models/" ID, "remover", 404},
      {"DELETE", "/v1/models/" ID, "writer", 403},
      {"GET", "/metrics", "reader", 200},
      {"GET", "/metrics", "writer", 403},
      {"GET", "/v1/models", "twice", 403},
      {"GET", "/openapi.json", "writer", 200},
      {"GET", "/version", "nobody", 200},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    int status = status_of(*state, cases[i].method, cases[i].target, cases[i].key);
    if (status != cases[i].status)
      fail_msg("%s %s with %s: %d", cases[i].method, cases[i].target, cases[i].key, status);
  }
  assert_problem(loopback_get(*state, "/metrics"), 401, NULL, NULL);
}

static const char *find_rated(void *context, const char *name) {
  return strcmp(name, "X-API-Key") == 0 ? context : NULL;
}

static api_rate rate_of(const loopback *loop, const char *key, uint8_t id[16]) {
  const api_request request = {.header = find_rated, .context = (void *)(uintptr_t)key};
  return api_key_rate(loop->service, &request, id);
}

TEST_WITH(a_rate_is_that_of_its_key, start_with_keys, loopback_teardown) {
  uint8_t id[16];
  api_rate rate = rate_of(*state, "twice", id);
  assert_int_equal(rate.count, 7);
  assert_int_equal(rate.period_s, 60);
  assert_int_equal(rate_of(*state, "reader", id).count, 0);
  assert_int_equal(rate_of(*state, "nobody", id).count, 0);
}

TEST_WITH(answers_behind_keys_are_private, start_with_keys, loopback_teardown) {
  reply r = loopback_ask(*state, "GET", "/v1/models", "X-API-Key: reader\n", NULL, 0);
  assert_string_equal(reply_header(&r, "Cache-Control"), "private, no-cache");
  assert_string_equal(reply_header(&r, "Vary"), "Accept, Accept-Encoding, Authorization, X-API-Key");
  reply_free(&r);
  r = loopback_ask(*state, "POST", "/v1/models", "X-API-Key: writer\n", triangle, strlen(triangle));
  assert_string_equal(reply_header(&r, "Cache-Control"), "private");
  char path[64];
  strcpy(path, reply_header(&r, "Location"));
  reply_free(&r);
  r = loopback_ask(*state, "GET", path, "X-API-Key: reader\n", NULL, 0);
  assert_string_equal(reply_header(&r, "Cache-Control"), "private, max-age=31536000, immutable");
  reply_free(&r);
  r = loopback_get(*state, "/version");
  assert_null(strstr(reply_header(&r, "Vary"), "Authorization"));
  reply_free(&r);
}

TEST_WITH(other_keys_count_once_they_are_set, start_with_keys, loopback_teardown) {
  loopback *loop = *state;
  static const api_key fresh[] = {{"fresh", API_MAY_READ, {0}}};
  assert_true(api_service_set_keys(loop->service, &(api_keyring){.keys = fresh, .count = 1}));
  assert_int_equal(status_of(loop, "GET", "/v1/models", "fresh"), 200);
  assert_int_equal(status_of(loop, "GET", "/v1/models", "reader"), 403);
  const api_keys *before = api_service_keys(loop->service);
  assert_true(api_service_set_keys(loop->service, &(api_keyring){.keys = fresh, .count = 1}));
  assert_ptr_equal(api_service_keys(loop->service), before);
}

/* ---- signed URLs ----------------------------------------------------------------------------- */

/* Signatures by Python's hmac. */
#define LISTED "after=" ID "&limit=5&exp=2000"
#define GOOD   "VI8x3l4PcDiOkYFTqwfaF172LBZw4HLJHtQFZKtHKFs"
#define OLD    "pm3oFHy3Qi7lbOSbdBmUf2nYXvn8k35CswKcNV6SbKY"

TEST_WITH(a_signed_url_may_be_read, start_with_keys, loopback_teardown) {
  static const char *const good[] = {"/v1/models?" LISTED "&sig=" GOOD, "/v1/models?sig=" GOOD "&" LISTED,
                                     "/v1/models?exp=2000&limit=%35&after=" ID "&sig=" GOOD,
                                     "/v1/models?" LISTED "&sig=" OLD};
  for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
    reply r = loopback_get(*state, good[i]);
    if (r.status != 200) fail_msg("%s: %s", good[i], r.body);
    assert_string_equal(reply_header(&r, "Cache-Control"), "private, no-cache");
    reply_free(&r);
    r = loopback_ask(*state, "HEAD", good[i], NULL, NULL, 0);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  /* Not found, but asked for. */
  assert_problem(loopback_get(*state, "/v1/models/" ID "/pose?clip=w%c3%a4lk+%2b%26=~&exp=2000&sig="
                                      "okYh7qGMCGT5uVPa0zkjQV231-JBABukgTN9IG4z1TU"),
                 404, NULL, NULL);
  reply r = loopback_post(*state,
                          "/v1/surface.json?level=0&exp=2000&sig=SjBfutqSB1vlucCLTTujBsX93UpF_NNhASrhcIQAkMc",
                          "model/obj", triangle);
  assert_int_equal(r.status, 200);
  reply_free(&r);
}

TEST_WITH(a_signature_fits_one_url_for_a_time, start_with_keys, loopback_teardown) {
  static const char *const bad[] = {
      "/v1/models?after=" ID "&limit=6&exp=2000&sig=" GOOD,
      "/v1/models?after=" ID "&limit=5&exp=3000&sig=" GOOD,
      "/v1/models?limit=5&exp=2000&sig=" GOOD,
      "/v1/models/" ID "?" LISTED "&sig=" GOOD,
      "/v1/models?" LISTED "&sig=" GOOD "=",
      "/v1/models?" LISTED "&sig=",
      "/v1/models?sig=ozCmsXvlgRsjLBxbln9vE20CuLh3HCMkdbK1Z_EA90Y",
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
    assert_problem(loopback_get(*state, bad[i]), 403, NULL, "signature");
  loopback *loop = *state;
  loop->now_s = 2000;
  assert_problem(loopback_get(loop, "/v1/models?" LISTED "&sig=" GOOD), 403, NULL, "over");
}

TEST_WITH(a_signature_gives_the_right_to_read_alone, start_with_keys, loopback_teardown) {
  reply r = loopback_ask(*state, "DELETE",
                         "/v1/models/" ID "?exp=2000&sig=nSZUNNpx5TKZ7tc7ah-bcse7AZce5S1TYb71tbkvz_w", NULL,
                         NULL, 0);
  assert_problem(r, 401, NULL, NULL);
}

static reply order(loopback *loop, const char *document) {
  return loopback_post_with(loop, "/v1/sign", "X-API-Key: reader\nContent-Type: application/json\n",
                            document);
}

TEST_WITH(the_daemon_signs_for_those_who_may_read, start_with_keys, loopback_teardown) {
  loopback *loop = *state;
  reply r = order(loop, "{'url':'/v1/models?after=" ID "&limit=5','seconds':1000}");
  assert_int_equal(r.status, 200);
  assert_body(&r, "{'url':'/v1/models?after=" ID "&limit=5&exp=2000&sig=" GOOD "'}\n");
  reply_free(&r);
  r = order(loop, "{'url':'http://here:1/v1/models'}");
  assert_int_equal(r.status, 200);
  char *url = r.body + strlen("{'url':'");
  *strchr(url, '"') = '\0';
  assert_memory_equal(url, "http://here:1/v1/models?exp=4600&sig=", 37);
  reply got = loopback_get(loop, url + strlen("http://here:1"));
  assert_int_equal(got.status, 200);
  reply_free(&got);
  reply_free(&r);
  assert_int_equal(status_of(loop, "POST", "/v1/sign", "writer"), 403);
}

TEST_WITH(orders_that_cannot_be_signed_are_refused, start_with_keys, loopback_teardown) {
  static const struct {
    const char *document, *pointer;
    int status;
  } cases[] = {
      {"{}", "", 400},
      {"{'url':7}", "/url", 400},
      {"{'url':'/v1/models','seconds':604801}", "/seconds", 422},
      {"{'url':'/v1/models','seconds':0}", "/seconds", 422},
      {"{'url':'/v1/models','forever':true}", NULL, 400},
      {"{'url':'/nothing'}", "/url", 422},
      {"{'url':'models'}", "/url", 422},
      {"{'url':'/v1/surface'}", "/url", 422},
      {"{'url':'/v1/models#a'}", "/url", 422},
      {"{'url':'/v1/models?after=a b'}", "/url", 422},
      {"{'url':'/v1/models?after=\\u007f'}", "/url", 422},
      {"{'url':'/v1/models?after=\xC3\xBC'}", "/url", 422},
      {"{'url':'http://h\xC3\xB6st/v1/models'}", "/url", 422},
      {"{'url':'http:///v1/models'}", "/url", 422},
      {"{'url':'//host/v1/models'}", "/url", 422},
      {"{'url':'ftp://host/v1/models'}", "/url", 422},
      {"{'url':'/v1/models?far=1'}", "/url", 400},
      {"{'url':'/v1/models?exp=1'}", "/url", 422},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_problem(order(*state, cases[i].document), cases[i].status, cases[i].pointer, NULL);
}

TEST_WITH(nothing_is_signed_without_keys_for_it, loopback_setup, loopback_teardown) {
  assert_problem(order(*state, "{'url':'/v1/models'}"), 404, NULL, "--url-keys");
}

/* ---- origins --------------------------------------------------------------------------------- */

static reply from(loopback *loop, const char *method, const char *target, const char *headers) {
  bool has_body = strcmp(method, "POST") == 0;
  return loopback_ask(loop, method, target, headers, has_body ? triangle : NULL,
                      has_body ? strlen(triangle) : 0);
}

/* The value of Access-Control-Allow-Origin of an answer with this status. */
static void assert_origin(reply r, int status, const char *origin) {
  assert_int_equal(r.status, status);
  const char *allowed = reply_header(&r, "Access-Control-Allow-Origin");
  const char *timing = reply_header(&r, "Timing-Allow-Origin");
  if (!origin) assert_null(allowed);
  if (origin) assert_string_equal(allowed, origin);
  if (origin) assert_string_equal(timing, origin);
  reply_free(&r);
}

static const char far[] = "Origin: https://far.example\nHost: here:8080\n";
static const char own[] = "Origin: http://here:8080\nHost: here:8080\n";

TEST_WITH(pages_elsewhere_use_models_and_neither_list_nor_delete, loopback_setup, loopback_teardown) {
  assert_origin(from(*state, "POST", "/v1/models", far), 201, "*");
  assert_origin(from(*state, "GET", "/v1/models/" ID, far), 404, "*");
  assert_origin(from(*state, "GET", "/v1/models", far), 403, "*");
  assert_origin(from(*state, "GET", "/v1/models", "Origin: null\n"), 403, "*");
  assert_origin(from(*state, "GET", "/metrics", far), 403, "*");
  assert_origin(from(*state, "DELETE", "/v1/models/" ID, far), 403, "*");
  assert_origin(from(*state, "GET", "/v1/models", own), 200, NULL);
  assert_origin(from(*state, "DELETE", "/v1/models/" ID, own), 404, NULL);
  assert_origin(
      from(*state, "DELETE", "/v1/models/" ID, "Origin: https://out\nSec-Fetch-Site: same-origin\n"), 404,
      NULL);
  assert_origin(from(*state, "GET", "/v1/models", NULL), 200, NULL);
  assert_origin(from(*state, "DELETE", "/v1/models/" ID, NULL), 404, NULL);
  reply r = from(*state, "GET", "/v1/models", own);
  assert_string_equal(reply_header(&r, "Vary"), "Accept, Accept-Encoding, Origin");
  reply_free(&r);
  r = from(*state, "OPTIONS", "/v1/models/" ID,
           "Origin: https://far.example\nAccess-Control-Request-Method: DELETE\n");
  assert_string_equal(reply_header(&r, "Access-Control-Allow-Methods"), "GET, HEAD, DELETE, OPTIONS");
  assert_string_equal(reply_header(&r, "Allow"), "GET, HEAD, DELETE, OPTIONS");
  reply_free(&r);
}

TEST(named_origins_do_all) {
  api_settings settings = loopback_settings();
  settings.cors_origins = "*, https://far.example";
  loopback *loop = loopback_start(&settings);
  assert_origin(from(loop, "GET", "/v1/models", far), 200, "https://far.example");
  assert_origin(from(loop, "DELETE", "/v1/models/" ID, far), 404, "https://far.example");
  assert_origin(from(loop, "GET", "/v1/models", "Origin: https://further.example\n"), 403, "*");
  reply r = from(loop, "OPTIONS", "/v1/models/" ID,
                 "Origin: https://far.example\nAccess-Control-Request-Method: DELETE\n");
  assert_non_null(strstr(reply_header(&r, "Access-Control-Allow-Methods"), "DELETE"));
  reply_free(&r);
  loopback_stop(loop);
}

TEST_WITH(with_keys_the_key_decides_for_every_origin, start_with_keys, loopback_teardown) {
  char headers[128];
  snprintf(headers, sizeof headers, "%sX-API-Key: reader\n", far);
  assert_origin(from(*state, "GET", "/v1/models", headers), 200, "*");
  assert_origin(from(*state, "GET", "/v1/models", far), 401, "*");
  reply r = from(*state, "OPTIONS", "/v1/models/" ID,
                 "Origin: https://far.example\nAccess-Control-Request-Method: DELETE\n");
  assert_non_null(strstr(reply_header(&r, "Access-Control-Allow-Methods"), "DELETE"));
  reply_free(&r);
}

/* ---- a loopback listener --------------------------------------------------------------------- */

static loopback *start_local(const char *origins, const char *hosts, const api_keyring *keyring) {
  api_settings settings = loopback_settings();
  settings.cors_origins = origins;
  settings.hosts = hosts;
  if (keyring) settings.keyring = *keyring;
  loopback *loop = loopback_start(&settings);
  loop->is_local = true;
  return loop;
}

static int set_up_local(void **state) {
  *state = start_local("*", NULL, NULL);
  return 0;
}

/* The status of a request with a Host header; NULL: without one. */
static int at_host(loopback *loop, const char *method, const char *target, const char *host) {
  char headers[200];
  if (host) snprintf(headers, sizeof headers, "Host: %s\n", host);
  reply r = from(loop, method, target, host ? headers : NULL);
  int code = r.status;
  if (code == 421) assert_string_equal(reply_header(&r, "Access-Control-Allow-Origin"), "*");
  if (code == 421) assert_string_equal(reply_header(&r, "Content-Type"), "application/problem+json");
  if (code == 421) assert_int_equal(r.answer.refusal, API_REFUSAL_ACCESS);
  reply_free(&r);
  return code;
}

TEST_WITH(a_loopback_listener_serves_the_hosts_of_this_machine, set_up_local, loopback_teardown) {
  static const char *const own[] = {"localhost", "localhost:8080", "LocalHost:1", "127.0.0.1", "127.0.0.1:80",
                                    "[::1]",     "[::1]:8080",     "localhost:",  NULL};
  static const char *const others[] = {"evil.example",
                                       "evil.example:8080",
                                       "localhost.evil.example",
                                       "::1",
                                       "127.0.0.2",
                                       "localhost:8080x",
                                       "[::1]x",
                                       "[::1",
                                       "0.0.0.0:8080",
                                       "*"};
  for (size_t i = 0; i < sizeof own / sizeof *own; i++) {
    assert_int_equal(at_host(*state, "GET", "/v1/models", own[i]), 200);
    assert_int_equal(at_host(*state, "POST", "/v1/models", own[i]) / 100, 2);
  }
  for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
    static const char *const targets[] = {"/", "/healthz", "/v1/models", "/v1/models/" ID "/surface",
                                          "/none"};
    for (size_t j = 0; j < sizeof targets / sizeof *targets; j++)
      assert_int_equal(at_host(*state, "GET", targets[j], others[i]), 421);
    assert_int_equal(at_host(*state, "POST", "/v1/models", others[i]), 421);
    assert_int_equal(at_host(*state, "DELETE", "/v1/models/" ID, others[i]), 421);
    assert_int_equal(at_host(*state, "OPTIONS", "/v1/models", others[i]), 421);
  }
}

TEST_WITH(other_listeners_serve_every_host, loopback_setup, loopback_teardown) {
  assert_int_equal(at_host(*state, "GET", "/v1/models", "tweend.example"), 200);
}

TEST(hosts_names_further_hosts) {
  loopback *loop = start_local("*", "tweend.example, [fd00::1]", NULL);
  assert_int_equal(at_host(loop, "GET", "/version", "Tweend.example:443"), 200);
  assert_int_equal(at_host(loop, "GET", "/version", "[fd00::1]:8080"), 200);
  assert_int_equal(at_host(loop, "GET", "/version", "localhost"), 200);
  assert_int_equal(at_host(loop, "GET", "/version", "example"), 421);
  loopback_stop(loop);
  loop = start_local("*", "*", NULL);
  assert_int_equal(at_host(loop, "GET", "/version", "evil.example"), 200);
  loopback_stop(loop);
}

TEST(keys_guard_a_loopback_listener_better_than_hosts) {
  const api_keyring keyring = {.keys = (const api_key[]){{"key", ALL_RIGHTS, {0, 0}}}, .count = 1};
  loopback *loop = start_local("*", NULL, &keyring);
  assert_int_equal(at_host(loop, "GET", "/version", "tweend.example"), 200);
  assert_origin(from(loop, "POST", "/v1/models", "X-API-Key: key\nOrigin: https://far.example\n"), 201, "*");
  loop->is_admin = true; /* this listener asks for no key */
  assert_int_equal(at_host(loop, "GET", "/metrics", "evil.example"), 421);
  assert_int_equal(at_host(loop, "GET", "/metrics", "localhost:9000"), 200);
  loopback_stop(loop);
}

TEST_WITH(pages_of_this_machine_alone_store_in_a_daemon_on_it, set_up_local, loopback_teardown) {
  static const char *const near[] = {"Origin: http://localhost:5173\n",
                                     "Origin: https://localhost\n",
                                     "Origin: http://app.localhost:3000\n",
                                     "Origin: http://127.0.0.1:9999\n",
                                     "Origin: http://127.8.9.10\n",
                                     "Origin: http://[::1]:80\n",
                                     "Origin: null\nSec-Fetch-Site: same-origin\n",
                                     "Sec-Fetch-Site: none\n",
                                     "Sec-Fetch-Site: same-origin\n",
                                     "Host: localhost\n"};
  static const char *const elsewhere[] = {"Origin: https://far.example\n",
                                          "Origin: null\n",
                                          "Origin: http://localhost.evil.example\n",
                                          "Origin: http://127.0.0.1.evil.example\n",
                                          "Origin: http://notlocalhost\n",
                                          "Origin: http://.localhost.evil\n",
                                          "Origin: ftp://localhost\n",
                                          "Origin: http://localhost:80@evil.example\n",
                                          "Origin: http://[::1].evil\n",
                                          "Origin: http://192.168.0.1\n",
                                          "Origin: *\n",
                                          "Origin: localhost\n",
                                          "Sec-Fetch-Site: cross-site\n",
                                          "Sec-Fetch-Site: same-site\n",
                                          "Origin: \n"};
  static const char *const targets[] = {"/v1/models", "/v1/models/" ID "/edits",
                                        "/v1/models/" ID "/detail?mesh=0&level=1",
                                        "/v1/models/" ID "/coarsen"};
  for (size_t i = 0; i < sizeof elsewhere / sizeof *elsewhere; i++) {
    for (size_t j = 0; j < sizeof targets / sizeof *targets; j++) {
      reply r = from(*state, "POST", targets[j], elsewhere[i]);
      assert_true(r.refused);
      assert_int_equal(r.answer.refusal, API_REFUSAL_ACCESS);
      assert_origin(r, 403, "*");
    }
  }
  assert_int_equal(loopback_store_count(*state), 0);
  for (size_t i = 0; i < sizeof near / sizeof *near; i++) {
    reply r = from(*state, "POST", "/v1/models", near[i]);
    assert_int_equal(r.status, i == 0 ? 201 : 200);
    const char *origin = reply_header(&r, "Access-Control-Allow-Origin");
    if (strstr(near[i], "://")) assert_string_equal(origin, "*");
    reply_free(&r);
  }
}

TEST_WITH(pages_of_all_origins_use_what_stores_nothing, set_up_local, loopback_teardown) {
  char id[API_ID_TEXT], target[100];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(target, sizeof target, "/v1/models/%s/surface.obj", id);
  assert_origin(from(*state, "GET", target, "Origin: https://far.example\n"), 200, "*");
  assert_origin(from(*state, "POST", "/v1/surface", "Origin: null\nAccept: model/obj\n"), 200, "*");
}

TEST(named_origins_store_in_a_daemon_on_this_machine) {
  loopback *loop = start_local("https://far.example", NULL, NULL);
  assert_origin(from(loop, "POST", "/v1/models", "Origin: https://far.example\n"), 201,
                "https://far.example");
  assert_origin(from(loop, "POST", "/v1/models", "Origin: https://further.example\n"), 403, "*");
  loopback_stop(loop);
}

TEST_WITH(a_preflight_lets_a_page_read_why_it_is_refused, set_up_local, loopback_teardown) {
  reply r = from(*state, "OPTIONS", "/v1/models",
                 "Origin: https://far.example\nAccess-Control-Request-Method: POST\n");
  assert_string_equal(reply_header(&r, "Access-Control-Allow-Methods"), "POST, GET, HEAD, OPTIONS");
  assert_string_equal(reply_header(&r, "Access-Control-Allow-Origin"), "*");
  reply_free(&r);
}

TEST(refusals_alone_are_read_by_origins_that_are_not_named) {
  api_settings settings = loopback_settings();
  settings.cors_origins = "https://near.example";
  settings.limits.max_upload = 10;
  loopback *loop = loopback_start(&settings);
  assert_origin(from(loop, "POST", "/v1/models", far), 413, "*");
  assert_origin(from(loop, "GET", "/v1/models/" ID, far), 404, NULL);
  assert_origin(from(loop, "GET", "/version", far), 200, NULL);
  loopback_stop(loop);
}

TEST_WITH(a_body_that_the_store_has_no_room_for_is_refused_unread, loopback_setup, loopback_teardown) {
  loopback_store_narrow(*state, strlen(triangle) - 1);
  reply r = from(*state, "POST", "/v1/models", far);
  assert_true(r.refused);
  assert_says(&r, "--min-free");
  assert_int_equal(r.answer.refusal, API_REFUSAL_STORE_FULL);
  assert_origin(r, 507, "*");
  r = from(*state, "POST", "/v1/surface", "Accept: model/obj\n");
  assert_int_equal(r.status, 200); /* stores nothing */
  reply_free(&r);
  loopback_store_narrow(*state, strlen(triangle));
  assert_origin(from(*state, "POST", "/v1/models", far), 201, "*");
}
