/* Hands answers to libmicrohttpd ("the library"), each as one response. */
#include "io_loop.h"
#include "raw_socket.h"
#include "readahead.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

enum {
  TURN_BYTES = 4 << 20, /* of blocks in one turn of the loop, about */
  BLOCK_LEAST = 32 << 10,
  LIVE_BLOCK = 16 << 10,  /* size of a block of a live stream */
  LIVE_BUFFER = 128 << 10 /* send buffer of a live stream: a slow client is at most this far behind */
};

static const unsigned LISTENER_RETRY_S = 5;

/* What a response refers to until the library frees it. */
typedef struct delivery {
  api_answer answer;
  srv_connection *to;
  srv_listener *listener; /* of a live stream, NULL for HEAD */
  srv_readahead *ahead;   /* of a large body, NULL for HEAD; owns the answer when not NULL */
} delivery;

static void free_delivery(void *context) {
  delivery *d = context;
  srv_listener_leave(d->listener);
  if (!d->ahead) api_answer_deinit(&d->answer);
  srv_readahead_leave(d->ahead);
  free(d);
}

/* Suspends the connection until srv_hand_back. */
static ssize_t wait_for_more(srv_connection *c) {
  c->waits = true;
  MHD_suspend_connection(c->mhd);
  return 0;
}

/* ---- blocks ---------------------------------------------------------------------------------- */

/* The size of the next block. With many readers each gets smaller blocks, so that a turn of the loop stays
 * short: new connections and small answers wait for its end. */
static size_t share_turn(srv_loop *l) {
  l->blocks++;
  size_t share = TURN_BYTES / (l->blocks > l->blocks_before ? l->blocks : l->blocks_before);
  return share > BLOCK_LEAST ? share : BLOCK_LEAST;
}

static ssize_t read_block(void *context, uint64_t position, char *out, size_t capacity) {
  (void)position; /* the library asks for blocks in order, each once */
  delivery *d = context;
  srv_loop *l = d->to->owner;
  if (atomic_load(&l->http->stop)) return MHD_CONTENT_READER_END_WITH_ERROR;
  size_t share = share_turn(l);
  if (capacity > share) capacity = share;
  int64_t size = d->ahead ? srv_readahead_read(d->ahead, (uint8_t *)out, capacity)
                          : d->answer.body.read(d->answer.body.context, (uint8_t *)out, capacity);
  if (size == SRV_READAHEAD_LATER) return wait_for_more(d->to);
  if (size < 0) return MHD_CONTENT_READER_END_WITH_ERROR;
  if (size == 0) {
    return d->answer.body.size == API_SIZE_UNKNOWN ? MHD_CONTENT_READER_END_OF_STREAM
                                                   : MHD_CONTENT_READER_END_WITH_ERROR;
  }
  d->to->exchange.bytes_out += (uint64_t)size;
  return (ssize_t)size;
}

/* Reads a live stream. The connection is suspended between two frames. */
static ssize_t read_stream(void *context, uint64_t position, char *out, size_t capacity) {
  (void)position;
  delivery *d = context;
  int64_t size = srv_listener_read(d->listener, (uint8_t *)out, capacity);
  if (size < 0) return MHD_CONTENT_READER_END_OF_STREAM;
  if (size == 0) return wait_for_more(d->to);
  d->to->exchange.bytes_out += (uint64_t)size;
  return (ssize_t)size;
}

static size_t block_size(uint64_t body_size) {
  return body_size < SRV_BLOCK_SIZE ? (size_t)(body_size > 0 ? body_size : 1) : SRV_BLOCK_SIZE;
}

static struct MHD_Response *create_response(delivery *d) {
  const api_answer *answer = &d->answer;
  /* A live stream: for HEAD it is still in the answer, otherwise the listener has taken it over. */
  if (answer->live.frame || d->listener) {
    return MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, LIVE_BLOCK, read_stream, d, free_delivery);
  }
  if (answer->body.read) {
    uint64_t size = answer->body.size == API_SIZE_UNKNOWN ? MHD_SIZE_UNKNOWN : answer->body.size;
    return MHD_create_response_from_callback(size, block_size(size), read_block, d, free_delivery);
  }
  if (answer->status == MHD_HTTP_NOT_MODIFIED) {
    /* Without a length: a cache would take that of the empty body for the length of what it has stored. */
#if MHD_VERSION >= 0x00097701
    struct MHD_Response *response = MHD_create_response_from_callback(0, 1, read_block, d, free_delivery);
    MHD_set_response_options(response, MHD_RF_HEAD_ONLY_RESPONSE, MHD_RO_END);
#else /* this library leaves the length out only where it closes the connection */
    struct MHD_Response *response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, 1, read_block, d, free_delivery);
    MHD_set_response_options(response, MHD_RF_HTTP_1_0_COMPATIBLE_STRICT, MHD_RO_END);
#endif
    return response;
  }
  /* The library's parameter is not const, but the library does not write. */
  return MHD_create_response_from_buffer_with_free_callback_cls(
      answer->bytes.size, (void *)(uintptr_t)answer->bytes.data, free_delivery, d);
}

static bool add_field(struct MHD_Response *response, const char *name, const char *value) {
  if (MHD_add_response_header(response, name, value) == MHD_YES) return true;
  srv_log(SRV_LOG_WARN, "field %s of an answer cannot be sent", name);
  return false;
}

/* False without memory: the answer must not be sent then, as a client would misread an answer without one of
 * its fields. */
static bool add_fields(struct MHD_Response *response, const delivery *d, const srv_exchange *exchange,
                       bool close) {
  char timing[SRV_TIMING_SIZE], policy[SRV_RATES_SIZE], left[SRV_RATES_SIZE];
  srv_exchange_timing(exchange, timing);
  bool is_added = !srv_exchange_rates(exchange, policy, left) ||
                  (add_field(response, "RateLimit-Policy", policy) && add_field(response, "RateLimit", left));
  for (size_t i = 0; is_added && i < d->answer.header_count; i++)
    is_added = add_field(response, d->answer.headers[i].name, d->answer.headers[i].value);
  return is_added && add_field(response, "X-Request-Id", exchange->id) &&
         add_field(response, "Server-Timing", timing) &&
         (!close || add_field(response, "Connection", "close"));
}

/* Joins the live stream that the answer is. When there is no place for a listener, the answer becomes a
 * refusal. NULL then, and for other answers. */
static srv_listener *join_stream(srv_connection *c) {
  srv_exchange *exchange = &c->exchange;
  if (!exchange->answer.live.frame || strcmp(exchange->method, "HEAD") == 0) return NULL;
  bool lacks_memory;
  srv_listener *listener =
      srv_live_join(exchange->server->live, &exchange->answer.live, srv_hand_back, c, &lacks_memory);
  if (!listener && lacks_memory) {
    srv_exchange_refuse(exchange, API_REFUSAL_MEMORY, 503, "the memory for live streams is in use by others",
                        LISTENER_RETRY_S);
    return NULL;
  }
  if (!listener) {
    srv_exchange_refuse(exchange, SRV_REFUSAL_LISTENERS, 503,
                        "there are as many listeners as the daemon takes", LISTENER_RETRY_S);
    return NULL;
  }
  exchange->close = true; /* the send buffer set below suits only a stream */
  int buffer = LIVE_BUFFER;
  setsockopt(c->fd, SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  return listener;
}

/* Whether the client may still read the answer, which has begun. Implements srv_reader. */
static bool is_read(void *connection) {
  const srv_connection *c = connection;
  return srv_raw_state_of(c->fd) != SRV_RAW_GONE;
}

/* Creates a readahead for a slow body, or one of more blocks than its ring has. NULL for others, and without
 * memory. */
static srv_readahead *create_readahead(srv_connection *c, const api_answer *answer) {
  const srv_reader reader = {c, srv_hand_back, is_read};
  const api_body *body = &answer->body;
  bool is_large =
      body->read && (body->is_slow || body->size > (uint64_t)SRV_READAHEAD_BLOCKS * SRV_BLOCK_SIZE);
  if (!is_large || strcmp(c->exchange.method, "HEAD") == 0) return NULL;
  return srv_readahead_create(c->exchange.server->work, c->exchange.server->service, answer, &reader);
}

static bool is_sized(const api_answer *answer) {
  return !answer->live.frame && (!answer->body.read || answer->body.size != API_SIZE_UNKNOWN);
}

enum MHD_Result srv_deliver(srv_connection *c) {
  srv_exchange *exchange = &c->exchange;
  delivery *d = malloc(sizeof *d);
  if (!d) return MHD_NO;
  srv_listener *listener = join_stream(c);
  *d = (delivery){exchange->answer, c, listener, create_readahead(c, &exchange->answer)};
  exchange->answer = (api_answer){0};
  exchange->answered = false;
  struct MHD_Response *response = create_response(d);
  if (!response) {
    free_delivery(d);
    return MHD_NO;
  }
  bool is_head = strcmp(exchange->method, "HEAD") == 0;
  /* With chunked coding the library sends a last chunk even after HEAD, which the client would take for the
   * start of the next answer. Without chunks it closes the connection. */
  if (is_head && !is_sized(&d->answer))
    MHD_set_response_options(response, MHD_RF_HTTP_1_0_COMPATIBLE_STRICT, MHD_RO_END);
  bool is_whole = !d->answer.body.read && !listener;
  if (is_whole && !is_head) exchange->bytes_out = d->answer.bytes.size;
  bool close = exchange->close || atomic_load(&exchange->server->draining);
  bool is_queued = add_fields(response, d, exchange, close) &&
                   MHD_queue_response(c->mhd, (unsigned)exchange->status, response) == MHD_YES;
  MHD_destroy_response(response);
  if (!is_queued) exchange->bytes_out = 0;
  srv_enter(c, listener ? SRV_PHASE_LIVE : SRV_PHASE_SEND);
  return is_queued ? MHD_YES : MHD_NO;
}
