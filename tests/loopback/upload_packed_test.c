/* Uploads packed with gzip and zstd. */
#include "stored_models.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>
#include <zstd.h>

/* Packs with gzip; *size: bytes made. */
static uint8_t *gzip(const void *data, size_t length, size_t *size) {
  z_stream stream = {0};
  assert_int_equal(deflateInit2(&stream, 9, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  uLong bound = deflateBound(&stream, (uLong)length);
  uint8_t *packed = malloc(bound);
  stream.next_in = (Bytef *)data;
  stream.avail_in = (uInt)length;
  stream.next_out = packed;
  stream.avail_out = (uInt)bound;
  assert_int_equal(deflate(&stream, Z_FINISH), Z_STREAM_END);
  *size = stream.total_out;
  deflateEnd(&stream);
  return packed;
}

TEST_WITH(packed_bodies_are_unpacked, loopback_setup, loopback_teardown) {
  size_t size;
  uint8_t *packed = gzip(triangle, strlen(triangle), &size);
  assert_is_the_triangle(
      loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, size));
  assert_is_the_triangle(
      loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: X-GZIP \n", packed, size));
  for (size_t cut = 0; cut < size; cut += 7)
    assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, cut), 400,
                   NULL, "gzip");
  uint8_t *tail = malloc(size + 1);
  memcpy(tail, packed, size);
  tail[size] = 'x';
  assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", tail, size + 1), 400,
                 NULL, NULL);
  free(tail);
  free(packed);
  uint8_t frames[512];
  size = ZSTD_compress(frames, sizeof frames, triangle, 20, 1);
  size += ZSTD_compress(frames + size, sizeof frames - size, triangle + 20, strlen(triangle) - 20, 1);
  assert_is_the_triangle(
      loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: zstd\n", frames, size));
  for (size_t cut = 0; cut < size - 1; cut += 5) /* the first frame alone is whole, and another text */
    assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: zstd\n", frames, cut), 400,
                   NULL, NULL);
  const char *const unknown[] = {"Content-Encoding: br\n", "Content-Encoding: gzip, gzip\n"};
  for (int i = 0; i < 2; i++) {
    reply r = loopback_ask(*state, "POST", "/v1/models", unknown[i], triangle, strlen(triangle));
    assert_true(r.refused);
    assert_string_equal(reply_header(&r, "Accept-Encoding"), "gzip, zstd");
    assert_problem(r, 415, NULL, "gzip, zstd");
  }
}

TEST_WITH(a_bomb_is_413_at_the_limit, loopback_setup, loopback_teardown) {
  size_t length = 50 << 20, size;
  char *blank = malloc(length);
  memset(blank, '\n', length);
  memcpy(blank, triangle, strlen(triangle));
  uint8_t *packed = gzip(blank, length, &size);
  assert_true(size < 1 << 20);
  assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, size), 413,
                 NULL, "1048576");
  free(packed);
  packed = gzip(blank, 1 << 20, &size);
  reply r = loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, size);
  assert_int_equal(r.status, 201);
  reply_free(&r);
  free(packed);
  packed = gzip(blank, (1 << 20) + 1, &size);
  assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, size), 413,
                 NULL, NULL);
  free(packed);
  size_t bound = ZSTD_compressBound(length);
  packed = malloc(bound);
  size = ZSTD_compress(packed, bound, blank, length, 1);
  assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: zstd\n", packed, size), 413,
                 NULL, "1048576");
  free(packed);
  free(blank);
}
