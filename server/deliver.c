/* Answers on their way out, as responses of libmicrohttpd: small ones in a response that was sent before,
 * others in one of their own, whose body is pulled out of them. */
#include "ahead.h"
#include "clock.h"
#include "field_block.h"
#include "io_loop.h"

#include <microhttpd.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

enum {
  LIVE_BLOCK = 16 << 10,  /* of a stream */
  LIVE_BUFFER = 128 << 10 /* in the kernel, of a stream: what a slow client is behind at most */
};

static const unsigned LISTENER_RETRY_S = 5;

/* ---- fields ---------------------------------------------------------------------------------- */

/* What an answer's head says beside what the library adds. */
typedef struct field_list {
  size_t count;
  api_header fields[SRV_FIELDS_MAX];
  char timing[SRV_TIMING_SIZE];
} field_list;

static void list_fields(const srv_exchange *exchange, const api_answer *answer, field_list *out) {
  memcpy(out->fields + out->count, answer->headers, answer->header_count * sizeof *out->fields);
  out->count += answer->header_count;
  srv_exchange_timing(exchange, out->timing);
  out->fields[out->count++] = (api_header){"X-Request-Id", exchange->id};
  out->fields[out->count++] = (api_header){"Server-Timing", out->timing};
}

/* ---- responses that are used again ----------------------------------------------------------- */

/* Whether the answer may go out in one: it is whole, and the connection stays. */
static bool has_reply(const srv_exchange *exchange) {
  const api_answer *answer = &exchange->answer;
  bool is_whole = answer->body.read == NULL && answer->live.frame == NULL;
  bool stays = !exchange->close && !atomic_load(&exchange->server->draining);
  return answer->status == MHD_HTTP_OK && is_whole && stays;
}

/* True when the answer is queued. */
static bool queue_reply(srv_connection *c) {
  srv_exchange *exchange = &c->exchange;
  if (!has_reply(exchange)) return false;
  field_list list;
  list.count = 1;
  list.fields[0] = (api_header){"Date", srv_date_now()}; /* else the library makes it for each answer */
  list_fields(exchange, &exchange->answer, &list);
  c->reply = srv_replies_take(c->owner->replies, list.fields, list.count, exchange->answer.bytes);
  if (c->reply == NULL) return false;
  if (MHD_queue_response(c->mhd, MHD_HTTP_OK, srv_reply_response(c->reply)) != MHD_YES) {
    srv_reply_give_back(c->reply);
    c->reply = NULL;
    return false;
  }
  if (strcmp(exchange->method, "HEAD") != 0) exchange->bytes_out = exchange->answer.bytes.size;
  api_answer_deinit(&exchange->answer);
  exchange->answered = false;
  srv_enter(c, SRV_PHASE_SEND);
  return true;
}

/* ---- responses of their own ------------------------------------------------------------------ */

/* What a response of the library refers to until it is freed. */
typedef struct delivery {
  api_answer answer;
  srv_connection *to;
  srv_listener *listener; /* of a stream, NULL for HEAD */
  srv_ahead *ahead;       /* of a large body, NULL for HEAD; then the answer is freed by it */
} delivery;

static void free_delivery(void *context) {
  delivery *d = context;
  srv_listener_leave(d->listener);
  if (d->ahead == NULL) api_answer_deinit(&d->answer);
  srv_ahead_leave(d->ahead);
  free(d);
}

/* Leaves the connection alone until srv_hand_back. */
static ssize_t wait_for_more(srv_connection *c) {
  c->waits = true;
  MHD_suspend_connection(c->mhd);
  return 0;
}

static ssize_t read_block(void *context, uint64_t position, char *out, size_t capacity) {
  (void)position; /* blocks are asked for in order, each once */
  delivery *d = context;
  if (atomic_load(&d->to->owner->http->stop)) return MHD_CONTENT_READER_END_WITH_ERROR;
  int64_t size = d->ahead != NULL ? srv_ahead_read(d->ahead, (uint8_t *)out, capacity)
                                  : d->answer.body.read(d->answer.body.context, (uint8_t *)out, capacity);
  if (size == SRV_AHEAD_LATER) return wait_for_more(d->to);
  if (size < 0) return MHD_CONTENT_READER_END_WITH_ERROR;
  if (size == 0) {
    return d->answer.body.size == API_SIZE_UNKNOWN ? MHD_CONTENT_READER_END_OF_STREAM
                                                   : MHD_CONTENT_READER_END_WITH_ERROR;
  }
  d->to->exchange.bytes_out += (uint64_t)size;
  return (ssize_t)size;
}

/* Between two frames the connection is suspended, until srv_hand_back. */
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
  if (answer->live.frame != NULL || d->listener != NULL) {
    return MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, LIVE_BLOCK, read_stream, d, free_delivery);
  }
  if (answer->body.read != NULL) {
    uint64_t size = answer->body.size == API_SIZE_UNKNOWN ? MHD_SIZE_UNKNOWN : answer->body.size;
    return MHD_create_response_from_callback(size, block_size(size), read_block, d, free_delivery);
  }
  if (answer->status == MHD_HTTP_NOT_MODIFIED) { /* read_block is not called, see is_sized */
    return MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, 1, read_block, d, free_delivery);
  }
  /* The library takes the bytes as writable but does not write. */
  return MHD_create_response_from_buffer_with_free_callback_cls(
      answer->bytes.size, (void *)(uintptr_t)answer->bytes.data, free_delivery, d);
}

/* False without memory: an answer that lacks one of its fields would be kept and read as what it is not. */
static bool add_fields(struct MHD_Response *response, const delivery *d, const srv_exchange *exchange,
                       bool close) {
  field_list list;
  list.count = 0;
  list_fields(exchange, &d->answer, &list);
  if (close) list.fields[list.count++] = (api_header){"Connection", "close"};
  for (size_t i = 0; i < list.count; i++) {
    const api_header *field = &list.fields[i];
    if (MHD_add_response_header(response, field->name, field->value) == MHD_YES) continue;
    srv_log(SRV_LOG_WARN, "header %s of request %s cannot be sent", field->name, exchange->id);
    return false;
  }
  return true;
}

/* Joins a stream that is the answer; without a place in it the answer becomes a refusal. */
static srv_listener *join_stream(srv_connection *c) {
  srv_exchange *exchange = &c->exchange;
  if (exchange->answer.live.frame == NULL || strcmp(exchange->method, "HEAD") == 0) return NULL;
  srv_listener *listener = srv_live_join(exchange->server->live, &exchange->answer.live, srv_hand_back, c);
  if (listener == NULL) {
    srv_exchange_refuse(exchange, 503, "there are as many listeners as the daemon takes", LISTENER_RETRY_S);
    return NULL;
  }
  exchange->close = true; /* the buffer below suits nothing else */
  int buffer = LIVE_BUFFER;
  setsockopt(c->fd, SOL_SOCKET, SO_SNDBUF, &buffer, sizeof buffer);
  return listener;
}

/* Only what has some blocks to come; without memory it goes without. */
static srv_ahead *go_ahead(srv_connection *c, const api_answer *answer) {
  bool is_large =
      answer->body.read != NULL && answer->body.size > (uint64_t)SRV_AHEAD_BLOCKS * SRV_BLOCK_SIZE;
  if (!is_large || strcmp(c->exchange.method, "HEAD") == 0) return NULL;
  return srv_ahead_create(c->exchange.server->work, answer, srv_hand_back, c);
}

/* Whether the library may tell a length. In 304 it would be that of the representation, which is not known.
 */
static bool is_sized(const api_answer *answer) {
  if (answer->status == MHD_HTTP_NOT_MODIFIED) return false;
  return answer->live.frame == NULL && (answer->body.read == NULL || answer->body.size != API_SIZE_UNKNOWN);
}

/* Moves the bytes out of the room, which the next request has. */
static bool leave_room(api_answer *answer) {
  if (!answer->in_room) return true;
  uint8_t *bytes = malloc(answer->bytes.size + 1);
  if (bytes == NULL) return false;
  memcpy(bytes, answer->bytes.data, answer->bytes.size);
  answer->bytes.data = bytes;
  answer->in_room = false;
  return true;
}

/* True when the answer is queued. */
static bool queue_own(srv_connection *c) {
  srv_exchange *exchange = &c->exchange;
  if (!leave_room(&exchange->answer)) return false;
  delivery *d = malloc(sizeof *d);
  if (d == NULL) return false;
  srv_listener *listener = join_stream(c);
  *d = (delivery){exchange->answer, c, listener, go_ahead(c, &exchange->answer)};
  exchange->answer = (api_answer){0};
  exchange->answered = false;
  struct MHD_Response *response = create_response(d);
  if (response == NULL) {
    free_delivery(d);
    return false;
  }
  bool is_head = strcmp(exchange->method, "HEAD") == 0;
  /* In chunks the library ends even what has no body with a last chunk, which the client would take for the
   * beginning of the next answer. Without, it closes the connection. */
  if ((is_head || d->answer.status == MHD_HTTP_NOT_MODIFIED) && !is_sized(&d->answer))
    MHD_set_response_options(response, MHD_RF_HTTP_1_0_COMPATIBLE_STRICT, MHD_RO_END);
  bool is_whole = d->answer.body.read == NULL && listener == NULL;
  if (is_whole && !is_head) exchange->bytes_out = d->answer.bytes.size;
  bool close = exchange->close || atomic_load(&exchange->server->draining);
  bool is_queued = add_fields(response, d, exchange, close) &&
                   MHD_queue_response(c->mhd, (unsigned)exchange->status, response) == MHD_YES;
  MHD_destroy_response(response);
  if (!is_queued) exchange->bytes_out = 0;
  srv_enter(c, listener != NULL ? SRV_PHASE_LIVE : SRV_PHASE_SEND);
  return is_queued;
}

bool srv_deliver(srv_connection *c) {
  return queue_reply(c) || queue_own(c);
}
