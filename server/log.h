/* Lines on standard error: for people on a terminal, as JSON elsewhere. Where nobody reads it, lines are left
 * out and counted: the daemon goes on. */
#ifndef SRV_LOG_H
#define SRV_LOG_H

#include <stdbool.h>
#include <stdint.h>

typedef enum srv_log_level { SRV_LOG_ERROR, SRV_LOG_WARN, SRV_LOG_INFO, SRV_LOG_DEBUG } srv_log_level;
typedef enum srv_log_format { SRV_LOG_AUTO, SRV_LOG_TEXT, SRV_LOG_JSON } srv_log_format;

/* Call once, before other threads start. Until then: warnings and worse, as text. */
void srv_log_configure(srv_log_level level, srv_log_format format);

/* At any time. */
void srv_log_set_level(srv_log_level level);

/* One event, written at once. Any thread; lines never mix. Of errors and warnings of one format SRV_LOG_BURST
 * are written at once, and then one a second, which tells how many were left out. */
enum { SRV_LOG_BURST = 10 };
void srv_log(srv_log_level level, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Tells of the lines that were left out, a second after the last that was written: call it now and then. Any
 * thread. */
void srv_log_tell_hidden(void);
/* The same of all. */
void srv_log_tell_all_hidden(void);

/* One finished request; logged as information. Text may hold anything, it is escaped. */
typedef struct srv_log_request {
  const char *id, *peer, *method, *path, *query;
  const char *route;       /* of the path, as metrics name it */
  const char *traceparent; /* W3C Trace Context, "" without one */
  int status;
  bool aborted; /* the answer was not delivered completely */
  uint64_t bytes_in, bytes_out;
  double receive_ms, queue_ms, work_ms, total_ms;
} srv_log_request;

void srv_log_access(const srv_log_request *request);

#endif
