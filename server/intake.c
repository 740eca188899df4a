/* Requests on their way in: the callbacks of libmicrohttpd ("the library"). deliver.c handles the way out. */
#include "io_loop.h"

#include "machine.h"
#include "raw_socket.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>

/* ---- heads that the library accepts too easily ----------------------------------------------- */

/* Before 1.0 the library silently cuts a line off at a zero byte, and adds the further lines of a folded
 * field to the field's name. But it reports the size of the whole head: srv_framing_whole adds up the lines
 * and refuses a head of another size. That needs each field's value to lie after its name in memory, which
 * the library does not promise; if it did not, every request would be refused. The sum does not reveal a line
 * before the request line that begins with a zero byte: the library skips that line. From 1.0 on the library
 * refuses all of these (MHD_OPTION_CLIENT_DISCIPLINE_LVL in http.c). */
static const bool IS_LENIENT = MHD_VERSION < 0x01000000;

/* Before 1.0 the library also takes a bare LF for the end of a line of chunks: what a proxy in front reads as
 * one body may end earlier for the library, and the rest would be a request that the proxy has not seen. So
 * nothing is read behind such a body. The installed library may be older or newer than its header. */
static bool doubts_chunks(void) {
  return IS_LENIENT || strncmp(MHD_get_version(), "0.", 2) == 0;
}

/* Bytes of the head; 0 while it is incomplete. */
static size_t head_size(const srv_connection *c) {
  const union MHD_ConnectionInfo *info =
      MHD_get_connection_info(c->mhd, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
  return info ? info->header_size : 0;
}

static enum MHD_Result take_field(void *context, enum MHD_ValueKind kind, const char *name, size_t name_size,
                                  const char *value, size_t value_size) {
  (void)kind;
  srv_framing_field(context, name, name_size, value ? value : "", value ? value_size : 0);
  return MHD_YES;
}

static void judge_fields(const srv_connection *c, srv_framing *framing) {
  MHD_get_connection_values_n(c->mhd, MHD_HEADER_KIND, take_field, framing);
  srv_framing_end(framing, head_size(c));
}

/* The connection whose head the library is checking, or NULL. The library calls back for each complete head
 * at once, so at most one connection has a complete head and is not opened. */
static srv_connection *find_judged(const srv_loop *l) {
  for (srv_connection *c = l->connections; c; c = c->next) {
    bool is_begun = c->exchange.target && !c->exchange.opened && c->watch.phase == SRV_PHASE_HEAD;
    if (is_begun && head_size(c) > 0) return c;
  }
  return NULL;
}

/* The library itself refuses a malformed Content-Length and too many cookies; before 1.0 that answer has two
 * heads. It logs before it answers: this function answers first and shuts the socket down. */
void srv_intake_complaint(srv_loop *l) {
  srv_connection *c = find_judged(l);
  if (!c) return;
  srv_framing framing = c->framing;
  judge_fields(c, &framing);
  if (framing.status != 0) {
    srv_exchange_refuse(&c->exchange, SRV_REFUSAL_FRAMING, framing.status, framing.detail, 0);
  } else if (IS_LENIENT) { /* blanks after a length, which the library does not trim */
    srv_exchange_refuse(&c->exchange, SRV_REFUSAL_FRAMING, 400, "Content-Length is not a plain number", 0);
  } else {
    return; /* a complaint about cookies, which the library then ignores */
  }
  srv_intake_refuse(c);
}

/* ---- refusals sent without the library ------------------------------------------------------- */

void srv_intake_refuse(srv_connection *c) {
  const char *reason = MHD_get_reason_phrase_for((unsigned)c->exchange.status);
  size_t size = 0;
  char *text = c->owner->http->tls ? NULL : srv_exchange_print(&c->exchange, reason, &size);
  bool is_sent = text && srv_raw_send(c->fd, text, size);
  free(text);
  shutdown(c->fd, is_sent ? SHUT_WR : SHUT_RDWR);
  c->is_unread = true;
  srv_enter(c, SRV_PHASE_LINGER);
}

/* ---- header fields --------------------------------------------------------------------------- */

struct srv_trimmed {
  srv_trimmed *next;
  char text[];
};

static bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

/* Room for a value of `size` bytes and its terminator, until the request ends; NULL without memory. */
static char *keep_value(srv_connection *c, size_t size) {
  srv_trimmed *copy = malloc(sizeof *copy + size + 1);
  if (!copy) return NULL;
  copy->next = c->trimmed;
  c->trimmed = copy;
  copy->text[size] = '\0';
  return copy->text;
}

static void forget_trimmed(srv_connection *c) {
  while (c->trimmed) {
    srv_trimmed *next = c->trimmed->next;
    free(c->trimmed);
    c->trimmed = next;
  }
}

/* The lines of a field that have been found so far, as one value. */
typedef struct sought {
  srv_connection *connection;
  const char *name;
  size_t name_size;
  const char *value; /* [size]; NULL: none */
  size_t size;
} sought;

static enum MHD_Result take_line(void *context, enum MHD_ValueKind kind, const char *name, size_t name_size,
                                 const char *value, size_t size) {
  (void)kind;
  sought *s = context;
  if (name_size != s->name_size || strncasecmp(name, s->name, name_size) != 0) return MHD_YES;
  if (!value) value = "";
  bool is_trimmed = size == 0 || !is_blank(value[size - 1]);
  while (size > 0 && is_blank(value[size - 1])) size--;
  size_t before = s->value ? s->size + strlen(", ") : 0;
  char *joined = before > 0 || !is_trimmed ? keep_value(s->connection, before + size) : NULL;
  if (joined && before > 0) memcpy(mempcpy(joined, s->value, s->size), ", ", strlen(", "));
  if (joined) memcpy(joined + before, value, size);
  s->value = joined ? joined : value;
  s->size = joined ? before + size : size;
  return MHD_YES;
}

/* The value of a field, trimmed at its end, which the library does not do (RFC 9112, 5.1). A field over
 * several lines is one list (RFC 9110, 5.3); where a field is no list, that is no value that means anything.
 */
static const char *find_header(void *context, const char *name) {
  sought s = {.connection = context, .name = name, .name_size = strlen(name)};
  MHD_get_connection_values_n(s.connection->mhd, MHD_HEADER_KIND, take_line, &s);
  return s.value;
}

/* ---- stages ---------------------------------------------------------------------------------- */

void *srv_intake_begin(void *context, const char *target, struct MHD_Connection *mhd) {
  (void)context;
  const union MHD_ConnectionInfo *info = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
  srv_connection *c = info ? info->socket_context : NULL;
  if (!c || c->watch.phase == SRV_PHASE_LINGER) return c;
  if (!srv_exchange_begin(&c->exchange, c->owner->http->server, target)) return NULL;
  srv_enter(c, SRV_PHASE_HEAD);
  c->exchange.is_reserve = c->is_reserve;
  c->framing = (srv_framing){0};
  srv_framing_target(&c->framing, target);
  if (c->framing.many_arguments) { /* the library would hang on so many arguments */
    srv_exchange_refuse(&c->exchange, SRV_REFUSAL_FRAMING, c->framing.status, c->framing.detail, 0);
    srv_intake_refuse(c);
  }
  return c;
}

/* Whether the client may still read the answer, which has not begun. A client that has only ended its own
 * side may, and one that has closed the socket looks the same, until something is sent to it: so after a
 * while it is sent an interim answer, which any client of HTTP/1.1 passes over (RFC 9110, 15.2) and to which
 * a closed socket responds with a reset. Over TLS, whose end has a message of its own, and with HTTP/1.0
 * nothing can be sent. */
static bool is_client_connected(srv_exchange *exchange) {
  static const char interim_head[] = "HTTP/1.1 100 Continue\r\n\r\n";
  static const uint64_t PATIENCE_NS = 500000000;
  srv_connection *c = (srv_connection *)(void *)exchange;
  srv_raw_state state = srv_raw_state_of(c->fd);
  if (state != SRV_RAW_HALF || c->owner->http->tls) return state == SRV_RAW_OPEN;
  uint64_t now_ns = srv_now_ns(), ended_ns = 0;
  if (atomic_compare_exchange_strong(&c->half_ns, &ended_ns, now_ns) || c->framing.http_10) return true;
  bool is_due = now_ns > ended_ns && now_ns - ended_ns >= PATIENCE_NS;
  /* Again after the same time, as the client may leave later; and only where all of it fits. */
  if (is_due && atomic_compare_exchange_strong(&c->half_ns, &ended_ns, now_ns) && srv_raw_unsent(c->fd) == 0)
    return srv_raw_send(c->fd, interim_head, sizeof interim_head - 1);
  return true;
}

/* The last values of X-Forwarded-For, which the nearest proxies wrote. */
typedef struct forwarded {
  const char *values[8];
  size_t count;
} forwarded;

static enum MHD_Result take_forwarded(void *context, enum MHD_ValueKind kind, const char *name,
                                      const char *value) {
  (void)kind;
  forwarded *f = context;
  enum { MOST = sizeof f->values / sizeof *f->values };
  if (strcasecmp(name, "X-Forwarded-For") != 0 || !value) return MHD_YES;
  if (f->count == MOST) memmove(f->values, f->values + 1, --f->count * sizeof *f->values);
  f->values[f->count++] = value;
  return MHD_YES;
}

static srv_client find_client(const srv_connection *c) {
  const srv_networks *trusted = &c->owner->http->server->trusted;
  if (!srv_networks_hold(trusted, &c->client)) return c->client;
  forwarded f = {.count = 0};
  MHD_get_connection_values(c->mhd, MHD_HEADER_KIND, take_forwarded, &f);
  return srv_client_forwarded(trusted, c->client, f.values, f.count);
}

static enum MHD_Result open_request(srv_connection *c, const char *method, const char *version) {
  srv_framing *framing = &c->framing;
  srv_framing_line(framing, method, version);
  judge_fields(c, framing);
  if (IS_LENIENT) srv_framing_whole(framing, head_size(c));
  c->exchange.client = find_client(c);
  c->exchange.is_forwarded = memcmp(&c->exchange.client, &c->client, sizeof c->client) != 0;
  c->exchange.request.is_admin = c->owner->http->is_admin;
  c->exchange.request.is_local = c->is_local;
  c->exchange.wanted = is_client_connected;
  atomic_init(&c->half_ns, 0);
  c->exchange.ready = srv_hand_back;
  if (srv_exchange_open(&c->exchange, method, framing, find_header, c) == SRV_EXCHANGE_NOW) {
    c->is_unread = true;
    return srv_deliver(c); /* the library then closes the connection */
  }
  if (framing->chunked && doubts_chunks()) c->exchange.close = c->is_unread = true;
  srv_enter(c, SRV_PHASE_BODY);
  return MHD_YES;
}

static enum MHD_Result take_body(srv_connection *c, const char *data, size_t *size) {
  size_t piece = *size;
  *size = 0;
  /* Over TLS the rest of the body is read first, and then the answer is sent. */
  if (srv_exchange_take(&c->exchange, data, piece) == SRV_EXCHANGE_MORE || c->owner->http->tls)
    return MHD_YES;
  srv_intake_refuse(c);
  return MHD_NO;
}

/* Which of the library's lists the connection is in. Connections with a timeout of their own get their turn
 * before sockets are read, others after it. A resumed connection whose client has ended its side would be
 * read, and closed at the end, before its answer is queued. */
static void set_first_in_turn(srv_connection *c, bool is_first) {
  static const unsigned NEVER_S = 30 * 24 * 3600, NO_TIMEOUT = 0;
  MHD_set_connection_option(c->mhd, MHD_CONNECTION_OPTION_TIMEOUT, is_first ? NEVER_S : NO_TIMEOUT);
}

static enum MHD_Result finish_request(srv_connection *c) {
  bool was_suspended = c->watch.phase == SRV_PHASE_WORK;
  if (srv_exchange_finish(&c->exchange) == SRV_EXCHANGE_NOW) {
    if (was_suspended) set_first_in_turn(c, false);
    return srv_deliver(c);
  }
  if (!was_suspended) set_first_in_turn(c, true);
  srv_enter(c, SRV_PHASE_WORK);
  MHD_suspend_connection(c->mhd);
  return MHD_YES;
}

enum MHD_Result srv_intake_take(void *context, struct MHD_Connection *mhd, const char *url,
                                const char *method, const char *version, const char *data, size_t *size,
                                void **request) {
  (void)context;
  (void)url; /* decoded and cut at %00; the exchange has the raw target */
  srv_connection *c = *request;
  if (!c || c->watch.phase == SRV_PHASE_LINGER) return MHD_NO;
  c->mhd = mhd;
  if (!c->exchange.opened) return open_request(c, method, version);
  return *size > 0 ? take_body(c, data, size) : finish_request(c);
}

void srv_intake_end(void *context, struct MHD_Connection *mhd, void **request,
                    enum MHD_RequestTerminationCode how) {
  (void)context;
  (void)mhd;
  srv_connection *c = *request;
  if (!c) return;
  bool is_refused = c->watch.phase == SRV_PHASE_LINGER;
  /* In these phases only the library itself can have answered. */
  if (c->watch.phase == SRV_PHASE_HEAD || c->watch.phase == SRV_PHASE_BODY) c->is_unread = true;
  if (atomic_load(&c->owner->http->server->draining))
    srv_note_unsent(c); /* before the request leaves in_flight */
  srv_exchange_end(&c->exchange, c->peer, how != MHD_REQUEST_TERMINATED_COMPLETED_OK && !is_refused);
  forget_trimmed(c);
  *request = NULL;
  if (!is_refused) srv_enter(c, SRV_PHASE_IDLE);
}
