/* Log lines on standard error: as text on a terminal, as JSON elsewhere. When nobody reads them, lines are
 * dropped and counted, and the daemon goes on. */
#ifndef SRV_LOG_H
#define SRV_LOG_H

#include <stdbool.h>
#include <stdint.h>

typedef enum srv_log_level { SRV_LOG_ERROR, SRV_LOG_WARN, SRV_LOG_INFO, SRV_LOG_DEBUG } srv_log_level;
typedef enum srv_log_format { SRV_LOG_AUTO, SRV_LOG_TEXT, SRV_LOG_JSON } srv_log_format;

/* Call once, before other threads start. Until then: warnings and worse, as text. */
void srv_log_configure(srv_log_level level, srv_log_format format);

/* Any thread, at any time. */
void srv_log_set_level(srv_log_level level);

/* Logs one event. Any thread; lines never mix. Of the errors and warnings with one format, the first
 * SRV_LOG_BURST are written, then one a second, which says how many were suppressed. format: identifies the
 * message by its address, so it must be a literal. */
enum { SRV_LOG_BURST = 10 };
void srv_log(srv_log_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Reports the suppressed lines of messages that have been silent for a second. Call it now and then. Any
 * thread. */
void srv_log_tell_hidden(void);
/* Reports all suppressed lines. */
void srv_log_tell_all_hidden(void);

/* A finished request, logged at level info. Its texts may hold anything; they are escaped. */
typedef struct srv_log_request {
  const char *id, *peer, *method, *path, *query;
  const char *route;       /* name of the path's route, as in metrics */
  const char *traceparent; /* W3C Trace Context, "" without one */
  int status;
  bool aborted; /* the answer was not delivered completely */
  uint64_t bytes_in, bytes_out;
  double receive_ms, queue_ms, work_ms, total_ms;
} srv_log_request;

void srv_log_access(const srv_log_request *request);

#endif
