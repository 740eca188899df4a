/* Content codings of answers: which are chosen, and that they give back the same bytes. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "codings.h"
#include "negotiate.h"
#include "upload.h"

TEST(codings_are_chosen_by_their_weights) {
  static const struct {
    const char *accepted;
    api_coding text, other;
  } cases[] = {
      {NULL, API_CODING_NONE, API_CODING_NONE},
      {"", API_CODING_NONE, API_CODING_NONE},
      {"gzip, deflate, br", API_CODING_GZIP, API_CODING_NONE},
      {"gzip, deflate, br, zstd", API_CODING_ZSTD, API_CODING_NONE},
      {"zstd;q=0.5, gzip;q=0.8", API_CODING_GZIP, API_CODING_NONE},
      {"GZIP;Q=0", API_CODING_NONE, API_CODING_NONE},
      {"*", API_CODING_ZSTD, API_CODING_NONE},
      {"*, zstd;q=0", API_CODING_GZIP, API_CODING_NONE},
      {"identity, gzip;q=0.5", API_CODING_NONE, API_CODING_NONE},
      {"br", API_CODING_NONE, API_CODING_NONE},
      {"gzip, identity;q=0", API_CODING_GZIP, API_CODING_GZIP},
      {"zstd, *;q=0", API_CODING_ZSTD, API_CODING_ZSTD},
      {"identity;q=0", API_CODING_NONE, API_CODING_NONE},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    if (api_coding_accepted(cases[i].accepted, true) != cases[i].text)
      fail_msg("text for %s", cases[i].accepted);
    if (api_coding_accepted(cases[i].accepted, false) != cases[i].other)
      fail_msg("other for %s", cases[i].accepted);
  }
}

static int setup(void **state) {
  char *tank = loopback_file("server/samples/tank.json", NULL);
  *state = one_model_start(NULL, tank);
  free(tank);
  return 0;
}

static reply ask(one_model *f, const char *method, const char *rest, const char *headers) {
  return model_ask(f->loop, method, f->id, rest, headers);
}

/* The same bytes as without a coding, fewer on the way, and another tag. */
static void assert_coded(one_model *f, const char *rest, const char *name, api_coding coding) {
  char headers[64];
  snprintf(headers, sizeof headers, "Accept-Encoding: %s\n", name);
  reply plain = ask(f, "GET", rest, NULL), coded = ask(f, "GET", rest, headers);
  assert_int_equal(plain.status, 200);
  assert_null(reply_header(&plain, "Content-Encoding"));
  assert_string_equal(reply_header(&coded, "Content-Encoding"), name);
  assert_non_null(strstr(reply_header(&coded, "Vary"), "Accept-Encoding"));
  assert_non_null(strstr(reply_header(&plain, "Vary"), "Accept-Encoding"));
  assert_string_not_equal(reply_header(&coded, "ETag"), reply_header(&plain, "ETag"));
  assert_true(coded.size < plain.size);
  uint8_t *out;
  size_t size;
  tw_error error;
  assert_int_equal(
      api_decode(coding, (api_bytes){(uint8_t *)coded.body, coded.size}, 1 << 24, &out, &size, &error),
      TW_OK);
  assert_int_equal(size, plain.size);
  assert_memory_equal(out, plain.body, size);
  char again[160];
  snprintf(again, sizeof again, "%sIf-None-Match: %s\n", headers, reply_header(&coded, "ETag"));
  reply unchanged = ask(f, "GET", rest, again);
  assert_int_equal(unchanged.status, 304);
  reply head = ask(f, "HEAD", rest, headers);
  assert_string_equal(reply_header(&head, "Content-Encoding"), name);
  assert_string_equal(reply_header(&head, "ETag"), reply_header(&coded, "ETag"));
  free(out);
  reply_free(&plain);
  reply_free(&coded);
  reply_free(&unchanged);
  reply_free(&head);
}

TEST_WITH(texts_are_coded_and_come_out_the_same, setup, fixture_stop) {
  static const char *const rest[] = {"",
                                     "surface.obj?level=3",
                                     "pose.json?from=0&to=2&fps=200",
                                     "pose.ndjson?from=0&to=2&fps=200",
                                     "pose.csv?from=0&to=2&fps=200",
                                     "pose.json?from=0&to=2&fps=10"};
  for (size_t i = 0; i < sizeof rest / sizeof *rest; i++) {
    assert_coded(*state, rest[i], "gzip", API_CODING_GZIP);
    assert_coded(*state, rest[i], "zstd", API_CODING_ZSTD);
  }
}

TEST_WITH(what_is_no_text_comes_as_it_is_unless_that_is_refused, setup, fixture_stop) {
  static const char *const rest[] = {"surface.glb?level=1", "pose.bin?from=0&to=2&fps=20", "source"};
  for (size_t i = 0; i < 3; i++) {
    reply r = ask(*state, "GET", rest[i], "Accept-Encoding: gzip, deflate, br, zstd\n");
    assert_int_equal(r.status, 200);
    assert_null(reply_header(&r, "Content-Encoding"));
    reply_free(&r);
    r = ask(*state, "GET", rest[i], "Accept-Encoding: gzip, identity;q=0\nRange: bytes=0-3\n");
    assert_int_equal(r.status, 200);
    assert_string_equal(reply_header(&r, "Content-Encoding"), "gzip");
    assert_null(reply_header(&r, "Accept-Ranges"));
    reply_free(&r);
  }
}

TEST_WITH(short_answers_and_errors_are_not_coded, setup, fixture_stop) {
  one_model *f = *state;
  reply r = loopback_ask(f->loop, "GET", "/healthz", "Accept-Encoding: gzip\n", NULL, 0);
  assert_null(reply_header(&r, "Content-Encoding"));
  assert_int_equal(r.body[0], '{');
  reply_free(&r);
  r = ask(f, "GET", "surface.obj?level=99", "Accept-Encoding: gzip\n");
  assert_null(reply_header(&r, "Content-Encoding"));
  assert_problem(r, 422, NULL, NULL);
}

enum { LONG = 8 << 20 };

static int64_t read_zeros(void *context, uint8_t *out, size_t capacity) {
  size_t *given = context, size = capacity < LONG - *given ? capacity : LONG - *given;
  memset(out, 0, size);
  *given += size;
  return (int64_t)size;
}

/* Zeros come out a thousand times as short: without a turn one block would take them all. capacity: of a
 * block, of which small ones break flushes up. */
static void assert_turns(api_coding coding, size_t capacity) {
  size_t given = 0, before = 0, size = 0, decoded_size;
  api_call *call = calloc(1, sizeof *call);
  uint8_t *coded = malloc(1 << 20), *decoded;
  call->coding = coding;
  call->answer = (api_answer){.status = 200, .body = {.size = LONG, .context = &given, .read = read_zeros}};
  assert_int_equal(api_encode(call), API_DONE);
  api_body *body = &call->answer.body;
  for (int64_t got; (got = body->read(body->context, coded + size, capacity)) != 0; size += (size_t)got) {
    assert_true(got > 0);
    assert_true(given - before <= 320 << 10);
    before = given;
  }
  tw_error error;
  assert_int_equal(api_decode(coding, (api_bytes){coded, size}, LONG, &decoded, &decoded_size, &error),
                   TW_OK);
  assert_int_equal(decoded_size, LONG);
  for (size_t i = 0; i < LONG; i++)
    if (decoded[i] != 0) fail_msg("byte %zu", i);
  body->destroy(body->context);
  free(decoded);
  free(coded);
  free(call);
}

TEST(a_block_takes_a_bounded_piece_of_a_body) {
  static const size_t capacities[] = {64, 301, 256 << 10};
  for (size_t i = 0; i < sizeof capacities / sizeof *capacities; i++) {
    assert_turns(API_CODING_ZSTD, capacities[i]);
    assert_turns(API_CODING_GZIP, capacities[i]);
  }
}
