/* Content codings, undone under a limit on what comes out: a small bomb stays small. The buffer grows by a
 * half, so that it never takes more than two and a half times what comes out, and is cut to size at the end.
 */
#include "upload.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>
#include <zstd.h>
#include <zstd_errors.h>

/* Members of a gzip file, or frames of a zstd file: programs that write several put megabytes into each, and
 * one without anything in it costs time all the same. */
enum { PARTS_MAX = 65536 };

/* A buffer that grows up to a limit, and one byte over it, which tells that there is more. */
typedef struct sink {
  uint8_t *data;
  size_t size, capacity;
  uint64_t limit;
} sink;

/* Room for at least one more byte; false without memory. The caller stops over the limit. */
static bool sink_grow(sink *out) {
  if (out->size < out->capacity) return true;
  uint64_t most = out->limit < SIZE_MAX ? out->limit + 1 : SIZE_MAX;
  uint64_t capacity = out->capacity ? (uint64_t)out->capacity + out->capacity / 2 : 65536;
  if (capacity > most) capacity = most;
  uint8_t *data = realloc(out->data, (size_t)capacity);
  if (!data) return false;
  out->data = data;
  out->capacity = (size_t)capacity;
  return true;
}

static tw_status fail_damaged(tw_error *error, const char *coding) {
  return tw_fail(error, TW_SYNTAX, "the body is not %s, or is cut off", coding);
}

static tw_status fail_parts(tw_error *error, const char *coding) {
  return tw_fail(error, TW_LIMIT, "the body is %s in more than %d pieces", coding, PARTS_MAX);
}

static tw_status fail_limit(tw_error *error, uint64_t limit) {
  return tw_fail(error, TW_LIMIT, "the decoded body is over the limit of %llu bytes",
                 (unsigned long long)limit);
}

/* Inflates the members of a gzip file, one after the other. */
static tw_status inflate_members(z_stream *stream, api_bytes bytes, sink *out, tw_error *error) {
  size_t left = bytes.size, parts = 0;
  stream->next_in = (Bytef *)bytes.data; /* zlib's interface knows no const here, and reads only */
  for (;;) {
    if (!sink_grow(out)) return tw_fail(error, TW_NO_MEMORY, "out of memory");
    uInt room = (uInt)(out->capacity - out->size < UINT_MAX ? out->capacity - out->size : UINT_MAX);
    uInt given = (uInt)(left < UINT_MAX ? left : UINT_MAX);
    stream->next_out = out->data + out->size;
    stream->avail_out = room;
    stream->avail_in = given;
    int result = inflate(stream, Z_NO_FLUSH);
    size_t used = given - stream->avail_in, made = room - stream->avail_out;
    left -= used;
    out->size += made;
    if (out->size > out->limit) return fail_limit(error, out->limit);
    if (result == Z_STREAM_END) {
      if (left == 0) return TW_OK;
      if (++parts == PARTS_MAX) return fail_parts(error, "gzip");
      inflateReset(stream);
    } else if (result == Z_MEM_ERROR) {
      return tw_fail(error, TW_NO_MEMORY, "out of memory");
    } else if (result != Z_OK || (used == 0 && made == 0)) {
      return fail_damaged(error, "gzip");
    }
  }
}

static tw_status decode_gzip(api_bytes bytes, sink *out, tw_error *error) {
  enum { GZIP_ALONE = 16 };
  z_stream stream = {0};
  if (inflateInit2(&stream, MAX_WBITS + GZIP_ALONE) != Z_OK)
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status = inflate_members(&stream, bytes, out, error);
  inflateEnd(&stream);
  return status;
}

static tw_status decode_frames(ZSTD_DStream *stream, api_bytes bytes, sink *out, tw_error *error) {
  ZSTD_inBuffer input = {bytes.data, bytes.size, 0};
  size_t parts = 0;
  for (;;) {
    if (!sink_grow(out)) return tw_fail(error, TW_NO_MEMORY, "out of memory");
    ZSTD_outBuffer output = {out->data, out->capacity, out->size};
    size_t before = input.pos;
    size_t hint = ZSTD_decompressStream(stream, &output, &input);
    bool stands = output.pos == out->size && input.pos == before;
    out->size = output.pos;
    if (ZSTD_getErrorCode(hint) == ZSTD_error_frameParameter_windowTooLarge)
      return tw_fail(error, TW_UNSUPPORTED,
                     "the body is zstd with a window of over %d MiB (RFC 9659): compress it at level 19 or "
                     "less, without --long",
                     (1 << API_ZSTD_WINDOW_LOG) >> 20);
    if (ZSTD_getErrorCode(hint) == ZSTD_error_memory_allocation)
      return tw_fail(error, TW_NO_MEMORY, "out of memory");
    if (ZSTD_isError(hint)) return fail_damaged(error, "zstd");
    if (out->size > out->limit) return fail_limit(error, out->limit);
    if (hint == 0 && input.pos == input.size) return TW_OK;
    if (hint == 0 && ++parts == PARTS_MAX) return fail_parts(error, "zstd");
    if (stands) return fail_damaged(error, "zstd");
  }
}

static tw_status decode_zstd(api_bytes bytes, sink *out, tw_error *error) {
  ZSTD_DStream *stream = ZSTD_createDStream();
  if (!stream) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  ZSTD_DCtx_setParameter(stream, ZSTD_d_windowLogMax, API_ZSTD_WINDOW_LOG);
  tw_status status = decode_frames(stream, bytes, out, error);
  ZSTD_freeDStream(stream);
  return status;
}

tw_status api_decode(api_coding coding, api_bytes bytes, uint64_t limit, uint8_t **out, size_t *size,
                     tw_error *error) {
  sink decoded = {.limit = limit};
  tw_status status =
      coding == API_CODING_GZIP ? decode_gzip(bytes, &decoded, error) : decode_zstd(bytes, &decoded, error);
  if (status != TW_OK) {
    free(decoded.data);
    return status;
  }
  uint8_t *cut = realloc(decoded.data, decoded.size ? decoded.size : 1);
  *out = cut ? cut : decoded.data;
  *size = decoded.size;
  return TW_OK;
}
