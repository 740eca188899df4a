/* Texts that are there are coded at once, so that their length is known; bodies as they are read, in memory
 * that does not depend on their length. Levels are those at which coding about keeps up with a fast network.
 */
#include "encode.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>
#include <zstd.h>

enum {
  GZIP_LEVEL = 4,
  GZIP_HEAD = 16, /* to zlib: a gzip head, not its own */
  ZSTD_LEVEL = 1,
  ZSTD_WINDOW_LOG = 17,
  LEAST = 1024,        /* bytes of a text worth coding */
  LIGHT = 64 << 10,    /* bytes coded in no time */
  PIECE = 64 << 10,    /* of a body, between its reader and the coder */
  TURN = 256 << 10,    /* of a body, coded by one read: an I/O thread waits for it */
  STATE_COST = 1 << 20 /* of a coder with its piece, at most */
};

/* One of both. */
typedef struct coder {
  ZSTD_CCtx *zstd;
  z_stream gzip;
  bool has_gzip;
} coder;

static bool coder_init(coder *c, api_coding coding) {
  *c = (coder){0};
  if (coding == API_CODING_ZSTD) {
    c->zstd = ZSTD_createCCtx();
    return c->zstd && !ZSTD_isError(ZSTD_CCtx_setParameter(c->zstd, ZSTD_c_compressionLevel, ZSTD_LEVEL)) &&
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

/* Writes out what the coder holds back: at no time, at present, or as nothing follows the input. */
typedef enum flush { FLUSH_NOT, FLUSH_NOW, FLUSH_END } flush;

/* Codes input into output as far as there is room. CODED_ALL: the end is written. Neither holds over 4 GiB.
 */
static coded coder_run(coder *c, ZSTD_inBuffer *input, ZSTD_outBuffer *output, flush how) {
  static const ZSTD_EndDirective ZSTD_WAYS[] = {ZSTD_e_continue, ZSTD_e_flush, ZSTD_e_end};
  static const int GZIP_WAYS[] = {Z_NO_FLUSH, Z_SYNC_FLUSH, Z_FINISH};
  bool is_last = how == FLUSH_END;
  if (c->zstd) {
    size_t left = ZSTD_compressStream2(c->zstd, output, input, ZSTD_WAYS[how]);
    return ZSTD_isError(left) ? CODED_FAILED : is_last && left == 0 ? CODED_ALL : CODED_MORE;
  }
  c->gzip.next_in = (Bytef *)(uintptr_t)input->src + input->pos; /* zlib's interface knows no const here */
  c->gzip.avail_in = (uInt)(input->size - input->pos);
  c->gzip.next_out = (Bytef *)output->dst + output->pos;
  c->gzip.avail_out = (uInt)(output->size - output->pos);
  int result = deflate(&c->gzip, GZIP_WAYS[how]);
  input->pos = input->size - c->gzip.avail_in;
  output->pos = output->size - c->gzip.avail_out;
  return result == Z_STREAM_END ? CODED_ALL : result == Z_STREAM_ERROR ? CODED_FAILED : CODED_MORE;
}

/* ---- texts ------------------------------------------------------------------------------------- */

/* Without memory, or where it would be longer, the text goes as it is. */
static bool encode_text(api_call *call) {
  api_answer *answer = &call->answer;
  coder c;
  uint8_t *bytes = malloc(answer->bytes.size);
  ZSTD_inBuffer input = {answer->bytes.data, answer->bytes.size, 0};
  ZSTD_outBuffer output = {bytes, answer->bytes.size, 0};
  bool is_coded =
      coder_init(&c, call->coding) && bytes && coder_run(&c, &input, &output, FLUSH_END) == CODED_ALL;
  coder_deinit(&c);
  uint8_t *fitting = is_coded ? realloc(bytes, output.pos) : NULL;
  if (!is_coded) {
    free(bytes);
    return false;
  }
  free((void *)(uintptr_t)answer->bytes.data);
  answer->bytes = (api_bytes){fitting ? fitting : bytes, output.pos};
  return true;
}

/* ---- bodies ------------------------------------------------------------------------------------ */

typedef struct coded_body {
  coder coder;
  api_body inner;
  bool is_last, is_done; /* the inner body has ended; so has the coder */
  bool is_flushing;      /* the coder writes out what it holds back */
  ZSTD_inBuffer input;   /* of piece */
  uint8_t piece[PIECE];
} coded_body;

/* Ends a block before it is full where it has taken TURN bytes of input. A flush that has begun is finished
 * before more input is taken, as both coders ask for. Blocks of under 7 bytes would repeat zlib's flush. */
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
    body->is_flushing = false; /* room is left: all is written */
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
  if (!body || !coder_init(&body->coder, call->coding)) {
    if (body) coder_deinit(&body->coder);
    free(body);
    return false;
  }
  body->inner = call->answer.body;
  body->is_last = body->is_done = body->is_flushing = false;
  body->input = (ZSTD_inBuffer){body->piece, 0, 0};
  call->answer.body = (api_body){API_SIZE_UNKNOWN, body, read_coded, destroy_coded};
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
