/* Requests on their way in, as the library calls for them; deliver.c has the way out. */
#include "intake.h"

#include "bypass.h"
#include "io_loop.h"

#include <stdlib.h>
#include <sys/socket.h>

/* ---- refusals in the middle ------------------------------------------------------------------ */

/* Closes the sending side alone, because closing with bytes unread would reset the connection under the
 * answer. */
enum MHD_Result srv_intake_refuse(srv_connection *c) {
  const char *reason = MHD_get_reason_phrase_for((unsigned)c->exchange.status);
  size_t size = 0;
  char *text = c->owner->http->tls ? NULL : srv_exchange_print(&c->exchange, reason, &size);
  bool sent = text != NULL && srv_bypass_say(c->fd, text, size);
  free(text);
  shutdown(c->fd, sent ? SHUT_WR : SHUT_RDWR);
  srv_enter(c, SRV_PHASE_LINGER);
  return MHD_YES;
}

/* The request is over and was refused: the library stops reading, sweeps throw away what comes. */
static enum MHD_Result discard_rest(srv_connection *c) {
  if (c->watch.phase != SRV_PHASE_LINGER) return MHD_NO;
  c->watch.phase = SRV_PHASE_DISCARD;
  MHD_suspend_connection(c->mhd);
  return MHD_YES;
}

/* ---- stages ---------------------------------------------------------------------------------- */

void *srv_intake_begin(void *context, const char *target, struct MHD_Connection *mhd) {
  (void)context;
  const union MHD_ConnectionInfo *info = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
  srv_connection *c = info != NULL ? info->socket_context : NULL;
  if (c == NULL || !srv_exchange_begin(&c->exchange, c->owner->http->server, target)) return NULL;
  srv_enter(c, SRV_PHASE_HEAD);
  c->begun = c->owner->turns;
  c->framing = (srv_framing){0};
  srv_framing_target(&c->framing, target);
  if (c->framing.many_arguments) {
    srv_exchange_refuse(&c->exchange, c->framing.status, c->framing.detail, 0);
    srv_intake_refuse(c);
  }
  return c;
}

static enum MHD_Result take_header(void *context, enum MHD_ValueKind kind, const char *name, size_t name_size,
                                   const char *value, size_t value_size) {
  (void)kind;
  srv_framing_header(context, name, name_size, value != NULL ? value : "", value != NULL ? value_size : 0);
  return MHD_YES;
}

static const char *find_header(void *context, const char *name) {
  const srv_connection *c = context;
  if (!srv_framing_may_have(&c->framing, name)) return NULL;
  return MHD_lookup_connection_value(c->mhd, MHD_HEADER_KIND, name);
}

static bool client_waits(srv_exchange *exchange) {
  return srv_bypass_waits(((srv_connection *)(void *)exchange)->fd);
}

/* On a compute thread. The connection may be resumed, and freed, as soon as it is back. */
static void come_back(srv_exchange *exchange) {
  srv_hand_back(exchange);
}

static enum MHD_Result deliver(srv_connection *c) {
  return srv_deliver(c) ? MHD_YES : MHD_NO;
}

static enum MHD_Result open_request(srv_connection *c, const char *method, const char *version) {
  srv_framing *framing = &c->framing;
  srv_framing_version(framing, version);
  MHD_get_connection_values_n(c->mhd, MHD_HEADER_KIND, take_header, framing);
  srv_framing_end(framing);
  c->exchange.wanted = client_waits;
  c->exchange.ready = come_back;
  if (srv_exchange_open(&c->exchange, method, framing, find_header, c) == SRV_EXCHANGE_NOW) {
    /* The library would close with the body unread, which resets the connection under the answer. */
    return framing->continues || c->owner->http->tls ? deliver(c) : srv_intake_refuse(c);
  }
  srv_enter(c, SRV_PHASE_BODY);
  return MHD_YES;
}

static enum MHD_Result take_body(srv_connection *c, const char *data, size_t *size) {
  size_t piece = *size;
  *size = 0;
  if (srv_exchange_take(&c->exchange, data, piece) == SRV_EXCHANGE_MORE) return MHD_YES;
  /* Over TLS the rest is read, and the answer follows it. */
  return c->owner->http->tls ? MHD_YES : srv_intake_refuse(c);
}

static enum MHD_Result finish_request(srv_connection *c) {
  c->exchange.request.room = srv_replies_room(c->owner->replies); /* deliver is next to take from there */
  if (srv_exchange_finish(&c->exchange, c->begun == c->owner->turns) == SRV_EXCHANGE_NOW) return deliver(c);
  srv_enter(c, SRV_PHASE_WORK);
  MHD_suspend_connection(c->mhd);
  return MHD_YES;
}

enum MHD_Result srv_intake_take(void *context, struct MHD_Connection *mhd, const char *url,
                                const char *method, const char *version, const char *data, size_t *size,
                                void **request) {
  (void)context;
  (void)url; /* decoded and cut at %00; the exchange has it as it came */
  srv_connection *c = *request;
  if (c == NULL) return MHD_NO;
  c->mhd = mhd;
  bool refused = c->watch.phase >= SRV_PHASE_LINGER;
  if (*size > 0 && refused) {
    *size = 0;
    return MHD_YES;
  }
  if (refused) return discard_rest(c);
  if (!c->exchange.opened) return open_request(c, method, version);
  return *size > 0 ? take_body(c, data, size) : finish_request(c);
}

void srv_intake_end(void *context, struct MHD_Connection *mhd, void **request,
                    enum MHD_RequestTerminationCode how) {
  (void)context;
  (void)mhd;
  srv_connection *c = *request;
  if (c == NULL) return;
  bool refused = c->watch.phase >= SRV_PHASE_LINGER;
  srv_exchange_end(&c->exchange, c->peer, how != MHD_REQUEST_TERMINATED_COMPLETED_OK && !refused);
  *request = NULL;
  srv_reply_give_back(c->reply);
  c->reply = NULL;
  if (!refused) srv_enter(c, SRV_PHASE_IDLE);
}
