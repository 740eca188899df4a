/* The stages of a request, in the order in which intake.c calls them. */
#include "exchange.h"

#include "compute_limit.h"
#include "log.h"
#include "machine.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* The body of a refused request is read and discarded up to this size, which keeps the connection usable. */
static const uint64_t DROP_MAX = 64 << 10;
static const unsigned RETRY_S = 1, BODY_RETRY_S = 5, DRAIN_RETRY_S = 5;

static double milliseconds(uint64_t from_ns, uint64_t to_ns) {
  return to_ns > from_ns ? (double)(to_ns - from_ns) / 1e6 : 0;
}

char *srv_server_metrics(void *context, size_t *size) {
  srv_server *server = context;
  srv_gauges gauges = {.connections = atomic_load(&server->connections),
                       .requests_in_flight = atomic_load(&server->in_flight),
                       .live = srv_live_look(server->live)};
  srv_work_load(server->work, &gauges.jobs_waiting, &gauges.threads_busy);
  api_service_usage(server->service, &gauges.usage);
  gauges.spool_bytes = atomic_load(&server->spool.used);
  if (server->config->store_limit > 0) gauges.store_bytes = srv_store_fs_used(server->folder);
#ifdef TWEEND_S3
  srv_store_s3_load bucket;
  if (server->bucket) {
    bucket = srv_store_s3_look(server->bucket);
    gauges.bucket = &bucket;
  }
#endif
  return srv_metrics_print(server->metrics, server->config, &gauges, size);
}

/* ---- stages ---------------------------------------------------------------------------------- */

/* Splits the target into host, path and query, in place. The host of the absolute form goes before the Host
 * header (RFC 9112, 3.2.2); it moves one place forward, for its terminator. */
static void split_target(srv_exchange *exchange) {
  char *path = exchange->target;
  if (srv_framing_is_absolute(path)) {
    char *host = strstr(path, "//") + 2;
    size_t size = strcspn(host, "/?");
    path = host + size;
    char *moved = memmove(host - 1, host, size);
    moved[size] = '\0'; /* the host may be empty */
    exchange->request.host = moved;
  }
  char *query = strchr(path, '?');
  if (query) *query++ = '\0';
  api_path_normalize(path);
  exchange->request.path = *path != '\0' ? path : "/";
  exchange->request.query = query ? query : "";
}

bool srv_exchange_begin(srv_exchange *exchange, srv_server *server, const char *target) {
  memset(exchange, 0, offsetof(srv_exchange, answer));
  exchange->server = server;
  exchange->started_ns = srv_now_ns();
  exchange->status = 400;
  exchange->target = strdup(target);
  if (!exchange->target) return false;
  split_target(exchange);
  srv_request_id_make(exchange->id);
  exchange->request.id = exchange->id;
  exchange->request.method = exchange->method;
  exchange->request.keys = api_service_keys(server->service);
  return true;
}

/* Counts the body's memory against --max-memory. */
static void count_body(srv_exchange *exchange) {
  api_service *service = exchange->server->service;
  uint64_t now = exchange->body.capacity;
  if (now > exchange->held) api_service_hold(service, API_HELD_BODY, now - exchange->held);
  if (now < exchange->held) api_service_let_go(service, API_HELD_BODY, exchange->held - now);
  exchange->held = now;
}

/* Frees the body before a slow client reads the answer, which does not refer to the body. */
static void drop_body(srv_exchange *exchange) {
  srv_body_deinit(&exchange->body);
  exchange->request.body = (api_bytes){0};
  count_body(exchange);
}

/* Adds the time since the last call, or since the start of the present api call, to computed_ns. */
static void count_computing(srv_exchange *exchange) {
  uint64_t now_ns = srv_now_ns();
  exchange->computed_ns += now_ns - exchange->leg_ns;
  exchange->leg_ns = now_ns;
}

static void answered(srv_exchange *exchange, uint64_t now_ns) {
  drop_body(exchange);
  exchange->answered = true;
  exchange->status = exchange->answer.status;
  exchange->refusal = exchange->answer.refusal;
  exchange->route = exchange->answer.route;
  exchange->answered_ns = now_ns;
  if (exchange->worked_ns == 0) exchange->received_ns = exchange->worked_ns = exchange->answered_ns;
}

void srv_exchange_refuse(srv_exchange *exchange, unsigned reason, int status, const char *detail,
                         unsigned retry_after) {
  if (exchange->answered) api_answer_deinit(&exchange->answer);
  exchange->answer = (api_answer){0};
  /* Other requests may wait for a result that this request has promised to make: tell them now, not when the
   * client has read the refusal. */
  if (exchange->request.ticket) api_ticket_end(exchange->server->service, &exchange->ticket);
  if (exchange->opened) {
    api_refuse(exchange->server->service, &exchange->request, status, detail, retry_after, &exchange->answer);
  } else {
    api_problem(status, detail, exchange->id, retry_after, &exchange->answer);
  }
  answered(exchange, srv_now_ns());
  exchange->refusal = reason;
}

static bool is_health_check(const srv_exchange *exchange) {
  return strcmp(exchange->request.path, "/healthz") == 0 || strcmp(exchange->request.path, "/readyz") == 0;
}

/* /metrics is not exempt: keys could be guessed there without limit. */
static bool is_free_of_rates(const srv_exchange *exchange) {
  return exchange->request.is_admin || is_health_check(exchange) ||
         strcmp(exchange->request.path, "/version") == 0;
}

static bool is_served_while_draining(const srv_exchange *exchange) {
  return is_health_check(exchange) || strcmp(exchange->request.path, "/version") == 0 ||
         strcmp(exchange->request.path, "/metrics") == 0;
}

static void refuse_long_body(srv_exchange *exchange) {
  char detail[96];
  snprintf(detail, sizeof detail, "the body is longer than the limit of %llu %s",
           (unsigned long long)exchange->server->config->max_upload,
           srv_plural(exchange->server->config->max_upload, "byte", "bytes"));
  srv_exchange_refuse(exchange, API_REFUSAL_BODY, 413, detail, 0);
}

static void refuse_crowded_body(srv_exchange *exchange) {
  srv_exchange_refuse(exchange, SRV_REFUSAL_SPOOL, 503,
                      "the long bodies under way have as many bytes as the daemon takes", BODY_RETRY_S);
}

static void refuse_roomless_body(srv_exchange *exchange, int status) {
  srv_exchange_refuse(exchange, SRV_REFUSAL_ROOM, status, "there is no room for the body at present",
                      BODY_RETRY_S);
}

/* Refuses the request for its body; not for SRV_BODY_OK. is_disk_full: what FAILED was the disk. */
static void refuse_body(srv_exchange *exchange, srv_body_status status, bool is_disk_full) {
  switch (status) {
  case SRV_BODY_OK: break;
  case SRV_BODY_TOO_LONG: refuse_long_body(exchange); break;
  case SRV_BODY_CROWDED: refuse_crowded_body(exchange); break;
  case SRV_BODY_NO_DISK: refuse_roomless_body(exchange, 507); break;
  case SRV_BODY_FAILED:
    srv_log(SRV_LOG_ERROR, "no memory or disk for a request body");
    refuse_roomless_body(exchange, is_disk_full ? 507 : 503);
    break;
  }
}

static void refuse_late(srv_exchange *exchange) {
  srv_exchange_refuse(exchange, SRV_REFUSAL_WAIT, 503, "the request waited too long for its turn", RETRY_S);
}

static void refuse_gone(srv_exchange *exchange) {
  srv_exchange_refuse(exchange, API_REFUSAL_NONE, 503, "the client is gone", 0);
}

/* Copies the text, truncated to the capacity, with a terminator. */
static void copy_cut(char *out, size_t capacity, const char *text) {
  size_t size = strnlen(text, capacity - 1);
  memcpy(out, text, size);
  out[size] = '\0';
}

/* Takes a token from the bucket of an address or a key. True when the bucket is empty; the request is refused
 * then. */
static bool refuse_over(srv_exchange *exchange, size_t which, const uint8_t id[16], api_rate rate,
                        const char *detail) {
  if (rate.count == 0) return false;
  srv_allowance *allowance = &exchange->allowances[which];
  *allowance = srv_rates_take(exchange->server->rates, id, rate, exchange->started_ns);
  if (allowance->retry_s == 0) return false;
  unsigned reason = which == 0 ? SRV_REFUSAL_RATE : SRV_REFUSAL_KEY_RATE;
  srv_exchange_refuse(exchange, reason, 429, detail, allowance->retry_s);
  return true;
}

/* Refuses the request where its address or its key has had too many. True when it was refused. */
static bool refuse_over_rate(srv_exchange *exchange) {
  srv_server *server = exchange->server;
  srv_client group = srv_client_group(&exchange->client);
  if (refuse_over(exchange, 0, group.address, server->config->rate_limit,
                  "the address has had as many requests as it may"))
    return true;
  uint8_t id[16];
  api_rate rate = api_key_rate(server->service, &exchange->request, id);
  return refuse_over(exchange, 1, id, rate, "the API key has had as many requests as its rate allows");
}

/* Refuses the request where its headers alone allow that. True when it was refused. */
static bool refused(srv_exchange *exchange, const srv_framing *framing) {
  const srv_config *config = exchange->server->config;
  if (framing->status != 0) {
    srv_exchange_refuse(exchange, SRV_REFUSAL_FRAMING, framing->status, framing->detail, 0);
    exchange->close = true;
  } else if (exchange->is_reserve && !is_health_check(exchange)) {
    srv_exchange_refuse(exchange, SRV_REFUSAL_CONNECTIONS, 503,
                        "there are as many connections as the daemon takes", RETRY_S);
  } else if (atomic_load(&exchange->server->draining) && !is_served_while_draining(exchange)) {
    srv_exchange_refuse(exchange, SRV_REFUSAL_DRAIN, 503, "the server is shutting down", DRAIN_RETRY_S);
  } else if (!is_free_of_rates(exchange) && refuse_over_rate(exchange)) {
    return true;
  } else if (framing->has_length && framing->length > config->max_upload) {
    refuse_long_body(exchange);
  } else if ((framing->chunked || framing->length > 0) &&
             api_open(exchange->server->service, &exchange->request, &exchange->answer) == API_REFUSED) {
    answered(exchange, srv_now_ns());
  } else if (framing->has_length) {
    refuse_body(exchange, srv_body_expect(&exchange->body, framing->length), false);
  }
  return exchange->answered;
}

srv_exchange_step srv_exchange_open(srv_exchange *exchange, const char *method, const srv_framing *framing,
                                    const char *(*header)(void *context, const char *name), void *context) {
  exchange->opened = true;
  exchange->close = exchange->is_reserve; /* frees the reserved place for others */
  atomic_fetch_add(&exchange->server->in_flight, 1);
  copy_cut(exchange->method, sizeof exchange->method, method);
  exchange->request.now_s = (uint64_t)time(NULL);
  exchange->request.header = header;
  exchange->request.context = context;
  if (!exchange->request.host) exchange->request.host = header(context, "Host");
  const char *trace = header(context, "traceparent");
  if (trace && srv_traceparent_is_valid(trace))
    copy_cut(exchange->traceparent, sizeof exchange->traceparent, trace);
  const char *id = header(context, "X-Request-Id");
  if (id && srv_request_id_is_valid(id)) copy_cut(exchange->id, sizeof exchange->id, id);
  srv_body_init(&exchange->body, exchange->server->config->max_upload, &exchange->server->spool);
  if (!refused(exchange, framing)) return SRV_EXCHANGE_MORE;
  bool droppable = !framing->chunked && !framing->continues && framing->length <= DROP_MAX;
  if (exchange->close || !droppable) {
    exchange->close = true;
    return SRV_EXCHANGE_NOW;
  }
  return SRV_EXCHANGE_MORE;
}

srv_exchange_step srv_exchange_take(srv_exchange *exchange, const void *data, size_t size) {
  if (exchange->answered) return SRV_EXCHANGE_MORE;
  exchange->bytes_in += size;
  srv_body_status status = srv_body_append(&exchange->body, data, size);
  bool is_disk_full = errno == ENOSPC || errno == EDQUOT;
  if (status == SRV_BODY_OK) {
    count_body(exchange);
    return SRV_EXCHANGE_MORE;
  }
  refuse_body(exchange, status, is_disk_full);
  exchange->close = true;
  return SRV_EXCHANGE_NOW;
}

static bool is_late(const srv_exchange *exchange, uint64_t now_ns) {
  return milliseconds(exchange->started_ns, now_ns) > (double)exchange->server->config->request_timeout;
}

/* Applies --compute-timeout to a new answer. A body that is computed while it is read gets the time that is
 * left; with none left, the answer is refused. An answer without such a body is complete and is sent however
 * long it took, since what the request has stored stays stored. When the api gives up because the time is
 * over (srv_compute_is_over), its 503 has no reason: the refusal here gives it the reason. */
static void limit_computing(srv_exchange *exchange) {
  uint64_t limit_ns = exchange->server->config->compute_timeout * 1000000;
  bool is_over = exchange->computed_ns >= limit_ns, is_given_up = is_over && exchange->answer.status == 503;
  if (limit_ns == 0 || (!exchange->answer.body.read && !is_given_up)) return;
  if (!is_over && srv_compute_limit(&exchange->answer.body, limit_ns - exchange->computed_ns)) return;
  srv_exchange_refuse(exchange, SRV_REFUSAL_COMPUTE_TIMEOUT, 503,
                      "computing the answer takes longer than the daemon allows", RETRY_S);
}

static bool is_wanted(void *context) {
  srv_exchange *exchange = context;
  return exchange->wanted(exchange);
}

/* Makes one api call. After API_WAITS the exchange belongs to the thread that will wake its ticket: do not
 * touch it. */
static api_progress handle(srv_exchange *exchange, api_effort effort) {
  uint64_t limit_ns = exchange->server->config->compute_timeout * 1000000;
  exchange->leg_ns = exchange->worked_ns;
  /* Only compute threads ask for the client: on its I/O thread a request is answered at once. */
  srv_compute_begin(limit_ns == 0 ? 0 : exchange->leg_ns + limit_ns - exchange->computed_ns,
                    effort == API_HEAVY ? is_wanted : NULL, exchange);
  api_progress progress =
      api_handle(exchange->server->service, &exchange->request, effort, &exchange->answer);
  srv_compute_end();
  if (progress == API_WAITS) return progress;
  count_computing(exchange);
  if (progress != API_ANSWERED) return progress;
  answered(exchange, exchange->leg_ns);
  limit_computing(exchange);
  return progress;
}

/* Runs the heavy stage of a request, on a compute thread. */
static void run(srv_job *job) {
  srv_exchange *exchange = (srv_exchange *)(void *)job;
  exchange->worked_ns = srv_now_ns();
  if (!exchange->wanted(exchange)) {
    refuse_gone(exchange);
  } else if (is_late(exchange, exchange->worked_ns)) {
    refuse_late(exchange);
  } else if (handle(exchange, API_HEAVY) == API_WAITS) {
    return;
  } else if (!exchange->answered) {
    srv_exchange_refuse(exchange, API_REFUSAL_NONE, 500, "the request was not answered", 0);
  }
  exchange->ready(exchange);
}

/* Queues the heavy stage for a compute thread. False: refused, as the queue is full. */
static bool submit(srv_exchange *exchange) {
  srv_server *server = exchange->server;
  exchange->job.run = run;
  if (!atomic_load(&server->stopping) && srv_work_submit(server->work, &exchange->job)) return true;
  srv_exchange_refuse(exchange, SRV_REFUSAL_QUEUE, 503, "too many requests are waiting", RETRY_S);
  return false;
}

/* Runs the short stage API_LOOK on a compute thread. It takes no place in the queue, as this short call
 * answers most requests. */
static void look(srv_job *job) {
  srv_exchange *exchange = (srv_exchange *)(void *)job;
  exchange->worked_ns = srv_now_ns();
  api_progress progress = handle(exchange, API_LOOK);
  if (progress == API_WAITS || (progress != API_ANSWERED && submit(exchange))) return;
  exchange->ready(exchange);
}

static srv_exchange *exchange_of(api_ticket *ticket) {
  return (srv_exchange *)(void *)((char *)ticket - offsetof(srv_exchange, ticket));
}

/* Called when the request is about to wait: waiting does not count as computing. */
static void pauses(api_ticket *ticket) {
  count_computing(exchange_of(ticket));
}

/* Called when the ticket has what it waited for. The request was admitted earlier, so it needs no place in
 * the queue. */
static void woken(api_ticket *ticket) {
  srv_exchange *exchange = exchange_of(ticket);
  exchange->job.run = run;
  srv_work_resume(exchange->server->work, &exchange->job);
}

bool srv_exchange_give_up(srv_exchange *exchange) {
  bool has_time = !is_late(exchange, srv_now_ns());
  if (has_time && exchange->wanted(exchange)) return false;
  if (!api_ticket_cancel(exchange->server->service, &exchange->ticket)) return false;
  if (has_time)
    refuse_gone(exchange);
  else
    refuse_late(exchange);
  return true;
}

srv_exchange_step srv_exchange_finish(srv_exchange *exchange) {
  if (exchange->answered) return SRV_EXCHANGE_NOW;
  srv_server *server = exchange->server;
  exchange->received_ns = exchange->worked_ns = srv_now_ns();
  exchange->ticket.wake = woken;
  exchange->ticket.pauses = pauses;
  exchange->request.ticket = &exchange->ticket;
  exchange->request.is_body_mapped = exchange->body.spooled;
  if (srv_body_view(&exchange->body, &exchange->request.body) != SRV_BODY_OK) {
    refuse_roomless_body(exchange, 503);
  } else {
    switch (handle(exchange, API_LIGHT)) {
    case API_ANSWERED: break;
    case API_WAITS: return SRV_EXCHANGE_LATER;
    case API_LOOK_ON_THREAD:
      exchange->job.run = look;
      srv_work_resume(server->work, &exchange->job);
      return SRV_EXCHANGE_LATER;
    case API_AGAIN_ON_THREAD: return submit(exchange) ? SRV_EXCHANGE_LATER : SRV_EXCHANGE_NOW;
    }
  }
  return SRV_EXCHANGE_NOW;
}

/* ---- output and end -------------------------------------------------------------------------- */

/* Prints milliseconds with three decimals; returns the end. Not by snprintf, which takes seven times as long:
 * every answer has three of these. */
static char *print_milliseconds(char *out, uint64_t from_ns, uint64_t to_ns) {
  uint64_t us = to_ns > from_ns ? (to_ns - from_ns + 500) / 1000 : 0;
  char digits[24], *first = digits + sizeof digits;
  for (size_t count = 0; count < 4 || us > 0; count++, us /= 10) {
    if (count == 3) *--first = '.';
    *--first = (char)('0' + us % 10);
  }
  return mempcpy(out, first, (size_t)(digits + sizeof digits - first));
}

void srv_exchange_timing(const srv_exchange *exchange, char out[SRV_TIMING_SIZE]) {
  char *end = stpcpy(out, "receive;dur=");
  end = print_milliseconds(end, exchange->started_ns, exchange->received_ns);
  end = print_milliseconds(stpcpy(end, ", queue;dur="), exchange->received_ns, exchange->worked_ns);
  end = print_milliseconds(stpcpy(end, ", work;dur="), exchange->worked_ns, exchange->answered_ns);
  *end = '\0';
}

bool srv_exchange_rates(const srv_exchange *exchange, char policy[SRV_RATES_SIZE],
                        char left[SRV_RATES_SIZE]) {
  static const char *const names[] = {"address", "key"};
  int policy_size = 0, left_size = 0;
  for (size_t i = 0; i < 2; i++) {
    const srv_allowance *a = &exchange->allowances[i];
    if (a->rate.count == 0) continue;
    const char *comma = policy_size > 0 ? ", " : "";
    policy_size += snprintf(policy + policy_size, SRV_RATES_SIZE - (size_t)policy_size, "%s\"%s\";q=%u;w=%u",
                            comma, names[i], a->rate.count, a->rate.period_s);
    left_size += snprintf(left + left_size, SRV_RATES_SIZE - (size_t)left_size, "%s\"%s\";r=%u;t=%u", comma,
                          names[i], a->left, a->reset_s);
  }
  return policy_size > 0;
}

char *srv_exchange_print(const srv_exchange *exchange, const char *reason, size_t *size) {
  const api_answer *answer = &exchange->answer;
  char timing[SRV_TIMING_SIZE], *text = NULL;
  srv_exchange_timing(exchange, timing);
  FILE *out = open_memstream(&text, size);
  if (!out) return NULL;
  char date[40];
  const time_t now = time(NULL);
  struct tm utc;
  strftime(date, sizeof date, "%a, %d %b %Y %H:%M:%S GMT", gmtime_r(&now, &utc));
  fprintf(out, "HTTP/1.1 %d %s\r\nDate: %s\r\nConnection: close\r\n", answer->status, reason, date);
  fprintf(out, "X-Request-Id: %s\r\nServer-Timing: %s\r\n", exchange->id, timing);
  char policy[SRV_RATES_SIZE], left[SRV_RATES_SIZE];
  if (srv_exchange_rates(exchange, policy, left))
    fprintf(out, "RateLimit-Policy: %s\r\nRateLimit: %s\r\n", policy, left);
  for (size_t i = 0; i < answer->header_count; i++) {
    fprintf(out, "%s: %s\r\n", answer->headers[i].name, answer->headers[i].value);
  }
  fprintf(out, "Content-Length: %zu\r\n\r\n", answer->bytes.size);
  if (strcmp(exchange->method, "HEAD") != 0) fwrite(answer->bytes.data, 1, answer->bytes.size, out);
  if (fclose(out) == 0) return text;
  free(text);
  return NULL;
}

void srv_exchange_end(srv_exchange *exchange, const char *peer, bool aborted) {
  if (!exchange->target) return;
  char client[SRV_CLIENT_TEXT];
  if (exchange->is_forwarded) srv_client_print(&exchange->client, client);
  const char *route = exchange->route ? exchange->route : api_route_name(exchange->request.path);
  const srv_log_request request = {.id = exchange->id,
                                   .peer = exchange->is_forwarded ? client : peer,
                                   .method = exchange->method,
                                   .path = exchange->request.path,
                                   .query = exchange->request.query,
                                   .route = route,
                                   .traceparent = exchange->traceparent,
                                   .status = exchange->status,
                                   .aborted = aborted,
                                   .bytes_in = exchange->bytes_in,
                                   .bytes_out = exchange->bytes_out,
                                   .receive_ms = milliseconds(exchange->started_ns, exchange->received_ns),
                                   .queue_ms = milliseconds(exchange->received_ns, exchange->worked_ns),
                                   .work_ms = milliseconds(exchange->worked_ns, exchange->answered_ns),
                                   .total_ms = milliseconds(exchange->started_ns, srv_now_ns())};
  srv_log_access(&request);
  srv_metrics_refusal(exchange->server->metrics, exchange->refusal);
  srv_metrics_request(exchange->server->metrics, &request);
  if (exchange->opened) atomic_fetch_sub(&exchange->server->in_flight, 1);
  atomic_fetch_add(&exchange->server->ended, 1);
  if (exchange->answered) api_answer_deinit(&exchange->answer);
  if (exchange->request.ticket) api_ticket_end(exchange->server->service, &exchange->ticket);
  drop_body(exchange);
  free(exchange->target);
  exchange->target = NULL;
  exchange->opened = exchange->answered = false;
  exchange->bytes_out = 0;
}
