/* Texts are encoded whole, so that their length is known; bodies are encoded while they are read, in memory
 * that does not depend on their length. The compression levels are those that about keep up with a fast
 * network. */
#include "codings.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>
#include <zstd.h>
#include <zstd_errors.h>

enum {
  GZIP_LEVEL = 4,
  GZIP_HEAD = 16, /* tells zlib to write a gzip header in place of its own */
  ZSTD_LEVEL = 1,
  ZSTD_PAGE_LEVEL = 6, /* a sixth shorter in two and a half times the time */
  ZSTD_WINDOW_LOG = 17,
  LEAST = 1024,        /* bytes from which encoding a text pays */
  LIGHT = 64 << 10,    /* bytes that a light call may encode */
  PIECE = 64 << 10,    /* of a body, between its reader and the encoder */
  TURN = 256 << 10,    /* of a body, encoded at most by one read, as an I/O thread waits for it */
  STATE_COST = 1 << 20 /* of an encoder with its piece, at most */
};

/* An encoder: zstd, or gzip. */
typedef struct coder {
  ZSTD_CCtx *zstd;
  z_stream gzip;
  bool has_gzip;
} coder;

static bool coder_init(coder *c, const api_call *call) {
  *c = (coder){0};
  if (call->coding == API_CODING_ZSTD) {
    int level = call->is_page ? ZSTD_PAGE_LEVEL : ZSTD_LEVEL;
    c->zstd = ZSTD_createCCtx();
    return c->zstd && !ZSTD_isError(ZSTD_CCtx_setParameter(c->zstd, ZSTD_c_compressionLevel, level)) &&
           !ZSTD_isError(ZSTD_CCtx_setParameter(c->zstd, ZSTD_c_windowLog, ZSTD_WINDOW_LOG));
  }
  c->has_gzip =
      deflateInit2(&c->gzip, GZIP_LEVEL, Z_DEFLATED, MAX_WBITS + GZIP_HEAD, 8, Z_DEFAULT_STRATEGY) == Z_OK;
  return c->has_gzip;
}

static void coder_deinit(coder *c) {
  ZSTD_freeCCtx(c->zstd);
  if (c->has_gzip) deflateEnd(&c->gzip);
  *c = (coder){0};
}

typedef enum coded { CODED_MORE, CODED_ALL, CODED_FAILED } coded;

/* Whether the encoder writes out what it has buffered: no, now, or because the input ends. */
typedef enum flush { FLUSH_NOT, FLUSH_NOW, FLUSH_END } flush;

/* Encodes input into output as far as there is room. CODED_ALL: the end is written. Neither buffer may hold
 * over 4 GiB. */
static coded coder_run(coder *c, ZSTD_inBuffer *input, ZSTD_outBuffer *output, flush how) {
  static const ZSTD_EndDirective ZSTD_WAYS[] = {ZSTD_e_continue, ZSTD_e_flush, ZSTD_e_end};
  static const int GZIP_WAYS[] = {Z_NO_FLUSH, Z_SYNC_FLUSH, Z_FINISH};
  bool is_last = how == FLUSH_END;
  if (c->zstd) {
    size_t left = ZSTD_compressStream2(c->zstd, output, input, ZSTD_WAYS[how]);
    return ZSTD_isError(left) ? CODED_FAILED : is_last && left == 0 ? CODED_ALL : CODED_MORE;
  }
  c->gzip.next_in = (Bytef *)(uintptr_t)input->src + input->pos; /* zlib's interface lacks const here */
  c->gzip.avail_in = (uInt)(input->size - input->pos);
  c->gzip.next_out = (Bytef *)output->dst + output->pos;
  c->gzip.avail_out = (uInt)(output->size - output->pos);
  int result = deflate(&c->gzip, GZIP_WAYS[how]);
  input->pos = input->size - c->gzip.avail_in;
  output->pos = output->size - c->gzip.avail_out;
  return result == Z_STREAM_END ? CODED_ALL : result == Z_STREAM_ERROR ? CODED_FAILED : CODED_MORE;
}

/* ---- texts ----------------------------------------------------------------------------------- */

/* Encodes the text in place. False without memory, or if it would become longer: the text is sent as it
 * is. */
static bool encode_text(api_call *call) {
  api_answer *answer = &call->answer;
  coder c;
  uint8_t *bytes = tw_alloc(answer->bytes.size, 1);
  ZSTD_inBuffer input = {answer->bytes.data, answer->bytes.size, 0};
  ZSTD_outBuffer output = {bytes, answer->bytes.size, 0};
  bool is_coded = coder_init(&c, call) && bytes && coder_run(&c, &input, &output, FLUSH_END) == CODED_ALL;
  coder_deinit(&c);
  uint8_t *fitting = is_coded ? tw_resize(bytes, output.pos) : NULL;
  if (!is_coded) {
    tw_free(bytes);
    return false;
  }
  tw_free((void *)(uintptr_t)answer->bytes.data);
  answer->bytes = (api_bytes){fitting ? fitting : bytes, output.pos};
  return true;
}

/* ---- bodies ---------------------------------------------------------------------------------- */

typedef struct coded_body {
  coder coder;
  api_body inner;
  bool is_last, is_done; /* the inner body has ended; the encoder too */
  bool is_flushing;      /* the encoder is writing out what it has buffered */
  ZSTD_inBuffer input;   /* the unread part of piece */
  uint8_t piece[PIECE];
} coded_body;

/* Returns early once it has read TURN bytes of input. A flush in progress is finished before more input is
 * read, as both encoders require. A capacity of under 7 bytes would make zlib repeat its flush. */
static int64_t read_coded(void *context, uint8_t *out, size_t capacity) {
  coded_body *body = context;
  ZSTD_outBuffer output = {out, capacity < INT32_MAX ? capacity : INT32_MAX, 0};
  size_t taken = 0;
  while (!body->is_done && output.pos < output.size) {
    if (body->input.pos == body->input.size && !body->is_last && !body->is_flushing) {
      int64_t size = body->inner.read(body->inner.context, body->piece, PIECE);
      if (size < 0) return -1;
      body->input = (ZSTD_inBuffer){body->piece, (size_t)size, 0};
      body->is_last = size == 0;
      taken += (size_t)size;
      body->is_flushing = !body->is_last && taken >= TURN;
    }
    flush how = body->is_last ? FLUSH_END : body->is_flushing ? FLUSH_NOW : FLUSH_NOT;
    coded result = coder_run(&body->coder, &body->input, &output, how);
    if (result == CODED_FAILED) return -1;
    body->is_done = result == CODED_ALL;
    if (!body->is_flushing || output.pos == output.size) continue;
    body->is_flushing = false; /* room is left, so the flush is complete */
    if (output.pos > 0) break;
  }
  return (int64_t)output.pos;
}

static void destroy_coded(void *context) {
  coded_body *body = context;
  coder_deinit(&body->coder);
  if (body->inner.destroy) body->inner.destroy(body->inner.context);
  free(body);
}

static bool encode_body(api_call *call) {
  coded_body *body = malloc(sizeof *body);
  if (!body || !coder_init(&body->coder, call)) {
    if (body) coder_deinit(&body->coder);
    free(body);
    return false;
  }
  body->inner = call->answer.body;
  body->is_last = body->is_done = body->is_flushing = false;
  body->input = (ZSTD_inBuffer){body->piece, 0, 0};
  call->answer.body = (api_body){API_SIZE_UNKNOWN, body, read_coded, destroy_coded, body->inner.is_slow};
  call->held += call->is_head ? 0 : STATE_COST;
  return true;
}

api_outcome api_encode(api_call *call) {
  const api_answer *answer = &call->answer;
  bool has_body = answer->body.read, is_whole = answer->status == 200 || answer->status == 201;
  if (call->coding == API_CODING_NONE || !is_whole || answer->live.frame) return API_DONE;
  if (!has_body && answer->bytes.size < LEAST) return API_DONE;
  if (!has_body && answer->bytes.size > LIGHT && call->effort != API_HEAVY) return API_NEEDS_THREAD;
  if (has_body ? encode_body(call) : encode_text(call))
    api_answer_header(&call->answer, "Content-Encoding", call->coding == API_CODING_ZSTD ? "zstd" : "gzip");
  return API_DONE;
}

/* ---- decoding -------------------------------------------------------------------------------- */

/* The limit on the decoded size keeps a small bomb small. The buffer grows by a half, so that it takes at
 * most two and a half times the decoded size, and is cut to size at the end. */

/* The most members of a gzip file, or frames of a zstd file. Programs that write several put megabytes into
 * each, and an empty one takes time too. */
enum { PARTS_MAX = 65536 };

/* A buffer that grows to at most one byte over its limit; that byte tells that there is more. */
typedef struct sink {
  uint8_t *data;
  size_t size, capacity;
  uint64_t limit;
} sink;

/* Makes room for at least one more byte; false without memory. The caller stops when the size is over the
 * limit. */
static bool sink_grow(sink *out) {
  if (out->size < out->capacity) return true;
  uint64_t most = out->limit < SIZE_MAX ? out->limit + 1 : SIZE_MAX;
  uint64_t capacity = out->capacity ? (uint64_t)out->capacity + out->capacity / 2 : 65536;
  if (capacity > most) capacity = most;
  uint8_t *data = tw_resize(out->data, (size_t)capacity);
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
  return tw_fail(error, TW_LIMIT, "the decoded body is over the limit of %llu %s", (unsigned long long)limit,
                 tw_plural(limit, "byte", "bytes"));
}

/* Inflates the members of a gzip file, one after the other, until the input ends. */
static tw_status inflate_members(z_stream *stream, api_bytes bytes, sink *out, tw_error *error) {
  size_t left = bytes.size, parts = 0;
  stream->next_in = (Bytef *)bytes.data; /* zlib's interface lacks const here; it only reads */
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
  const uint64_t window = 1 << API_ZSTD_WINDOW_LOG; /* libzstd allocates it */
  ZSTD_DStream *stream = tw_meter_take(window) ? ZSTD_createDStream() : NULL;
  if (!stream) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  ZSTD_DCtx_setParameter(stream, ZSTD_d_windowLogMax, API_ZSTD_WINDOW_LOG);
  tw_status status = decode_frames(stream, bytes, out, error);
  ZSTD_freeDStream(stream);
  tw_meter_give_back(window);
  return status;
}

tw_status api_decode(api_coding coding, api_bytes bytes, uint64_t limit, uint8_t **out, size_t *size,
                     tw_error *error) {
  sink decoded = {.limit = limit};
  tw_status status =
      coding == API_CODING_GZIP ? decode_gzip(bytes, &decoded, error) : decode_zstd(bytes, &decoded, error);
  if (status != TW_OK) {
    tw_free(decoded.data);
    return status;
  }
  uint8_t *cut = tw_resize(decoded.data, decoded.size ? decoded.size : 1);
  *out = cut ? cut : decoded.data;
  *size = decoded.size;
  return TW_OK;
}

bool api_decodes_to(api_coding coding, api_bytes bytes, const char *beginning) {
  size_t size = strlen(beginning);
  sink first = {.limit = size};
  tw_error unread;
  if (coding == API_CODING_GZIP)
    decode_gzip(bytes, &first, &unread);
  else
    decode_zstd(bytes, &first, &unread);
  bool is_same = first.size >= size && memcmp(first.data, beginning, size) == 0;
  tw_free(first.data);
  return is_same;
}
