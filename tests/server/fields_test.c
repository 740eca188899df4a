/* Fields that the library has no memory for: an answer goes out with all of its fields, or not at all. Linked
 * with the library's function wrapped. */
#include "sockets.h"

#include <microhttpd.h>
#include <stdatomic.h>
#include <string.h>
#include <unistd.h>

/* The names are those that the linker's --wrap makes. */
/* NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
enum MHD_Result __real_MHD_add_response_header(struct MHD_Response *response, const char *name,
                                               const char *value);
enum MHD_Result __wrap_MHD_add_response_header(struct MHD_Response *response, const char *name,
                                               const char *value);

/* Fields until those fail that follow, and how many do. */
static atomic_int fields_before, fields_failing;

enum MHD_Result __wrap_MHD_add_response_header(struct MHD_Response *response, const char *name,
                                               const char *value) {
  bool fails = atomic_fetch_sub(&fields_before, 1) <= 0 && atomic_fetch_sub(&fields_failing, 1) > 0;
  return fails ? MHD_NO : __real_MHD_add_response_header(response, name, value);
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

static void fail_fields(int before, int count) {
  atomic_store(&fields_before, before);
  atomic_store(&fields_failing, count);
}

enum { FIELDS_MOST = 8 };

static void assert_whole(const fixture *f) {
  assert_int_equal(answers(f), 1);
  assert_true(has(f, "\r\nContent-Type: text/plain\r\n"));
  assert_true(has(f, "\r\nX-Request-Id: "));
  assert_true(has(f, "\r\nServer-Timing: "));
  assert_true(has(f, "\r\nDate: "));
}

TEST_WITH(answer_without_one_of_its_fields_is_not_sent, set_up, tear_down) {
  fixture *f = *state;
  static const char *const REQUESTS[] = {
      "GET /light HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n",
      "POST /missing HTTP/1.1\r\nHost: x\r\nConnection: close\r\nContent-Length: 1\r\n\r\nx"};
  for (size_t i = 0; i < sizeof REQUESTS / sizeof *REQUESTS; i++) {
    for (int before = 0; before < 3; before++) {
      fail_fields(before, 1);
      ask(f, REQUESTS[i]);
      assert_int_equal(f->answer_size, 0);
      fail_fields(0, 0);
      ask(f, REQUESTS[i]);
      assert_whole(f);
    }
  }
}

/* Nor does it leave a listener behind. */
TEST_WITH(stream_without_one_of_its_fields_is_not_sent, set_up, tear_down) {
  fixture *f = *state;
  for (size_t i = 0; i <= f->config.max_listeners; i++) {
    fail_fields(0, FIELDS_MOST);
    ask(f, "GET /live?3 HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
    assert_int_equal(f->answer_size, 0);
  }
  fail_fields(0, 0);
  ask(f, "GET /live?3 HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  assert_int_equal(status(f), 200);
}
