/* Each line is composed in a buffer and written under a lock, so that the lines of threads do not mix. Text
 * from outside is truncated where it would leave no room for the rest of the line, so that JSON stays
 * well-formed. */
#include "log.h"

#include "fail.h"
#include "machine.h"

#include <ctype.h>
#include <limits.h>
#include <poll.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Long text is truncated at FIELD_END, which leaves room for all short text; short text is truncated at
 * SHORT_END. */
enum { LINE_SIZE = 8192, FIELD_END = LINE_SIZE - 1024, SHORT_END = LINE_SIZE - 16 };

typedef struct line {
  char text[LINE_SIZE];
  size_t size;
} line;

static _Atomic srv_log_level threshold = SRV_LOG_WARN;
static bool as_json = false;

static const char *const level_names[] = {"error", "warn", "info", "debug"};

void srv_log_set_level(srv_log_level level) {
  atomic_store(&threshold, level);
}

void srv_log_configure(srv_log_level level, srv_log_format format) {
  srv_log_set_level(level);
  as_json = format == SRV_LOG_JSON || (format == SRV_LOG_AUTO && isatty(STDERR_FILENO) == 0);
}

/* Appends the program's own words and numbers, which are short. */
static void append(line *l, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void append(line *l, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  int printed = vsnprintf(l->text + l->size, LINE_SIZE - l->size, format, arguments);
  va_end(arguments);
  if (printed < 0) return;
  size_t room = LINE_SIZE - 1 - l->size;
  l->size += (size_t)printed < room ? (size_t)printed : room;
}

/* Appends text unchanged. */
static void append_text(line *l, const char *text) {
  size_t size = strnlen(text, LINE_SIZE - 1 - l->size);
  memcpy(l->text + l->size, text, size);
  l->size += size;
}

/* Appends text from outside with control bytes, quotes and backslashes escaped. end: offset in the line at
 * which the text is truncated. */
static void append_escaped_bytes(line *l, const char *text, size_t size, size_t end) {
  for (size_t i = 0; i < size && l->size < end; i++) {
    unsigned char c = (unsigned char)text[i];
    if (c == '"' || c == '\\') {
      append(l, "\\%c", c);
    } else if (c < 0x20 || c >= 0x7f) {
      append(l, "\\u%04x", c);
    } else {
      l->text[l->size++] = (char)c;
    }
  }
}

static void append_escaped(line *l, const char *text, size_t end) {
  append_escaped_bytes(l, text, strlen(text), end);
}

static void append_field(line *l, const char *name, const char *text) {
  append_text(l, ",\"");
  append_text(l, name);
  append_text(l, "\":\"");
  append_escaped(l, text, FIELD_END);
  append_text(l, "\"");
}

static void begin(line *l, srv_log_level level) {
  struct timespec now;
  struct tm utc;
  char second[32];
  clock_gettime(CLOCK_REALTIME, &now);
  strftime(second, sizeof second, "%Y-%m-%dT%H:%M:%S", gmtime_r(&now.tv_sec, &utc));
  l->size = 0;
  append(l, as_json ? "{\"time\":\"%s.%03ldZ\",\"level\":\"%s\"" : "%s.%03ldZ %-5s ", second,
         now.tv_nsec / 1000000, level_names[level]);
}

/* ---- standard error -------------------------------------------------------------------------- */

/* The reader of standard error may stop reading: a pager, a paused terminal, a collector that hangs. After
 * PATIENCE_MS lines are dropped, so that no thread waits for the reader. */
enum { PATIENCE_MS = 100 };

static pthread_mutex_t output_lock = PTHREAD_MUTEX_INITIALIZER; /* guards stderr and the variables below */
static bool is_full;                                            /* whether the last write found no room */
static bool is_torn;                                            /* the last line was written in part */
static uint64_t lost;                                           /* lines dropped since the last report */

/* Writes at most PIPE_BUF bytes: poll reports a pipe writable only when it has room for these. */
static bool write_piece(const char *text, size_t size) {
  struct pollfd output = {.fd = STDERR_FILENO, .events = POLLOUT};
  is_full = poll(&output, 1, is_full ? 0 : PATIENCE_MS) == 0;
  ssize_t written = is_full ? 0 : write(STDERR_FILENO, text, size);
  (void)written; /* when standard error is closed, nobody can be told */
  return !is_full;
}

/* Call with output_lock held. False: the line was dropped, or written in part. */
static bool write_line(const line *l) {
  if (is_torn && !write_piece("\n", 1)) return false;
  is_torn = false;
  for (size_t at = 0; at < l->size; at += PIPE_BUF) {
    size_t left = l->size - at;
    if (write_piece(l->text + at, left < PIPE_BUF ? left : PIPE_BUF)) continue;
    is_torn = at > 0;
    return false;
  }
  return true;
}

static void write_message(srv_log_level level, const char *message);

static void finish(line *l) {
  char message[80];
  append_text(l, as_json ? "}\n" : "\n");
  pthread_mutex_lock(&output_lock);
  bool is_written = write_line(l);
  uint64_t told = is_written ? lost : 0;
  lost = is_written ? 0 : lost + 1;
  pthread_mutex_unlock(&output_lock);
  if (told == 0) return;
  snprintf(message, sizeof message, "standard error was not read: %llu %s left out", (unsigned long long)told,
           srv_plural(told, "line is", "lines are"));
  write_message(SRV_LOG_WARN, message);
}

static void write_message(srv_log_level level, const char *message) {
  line l;
  begin(&l, level);
  if (as_json) {
    append_field(&l, "message", message);
  } else {
    append_escaped(&l, message, FIELD_END);
  }
  finish(&l);
}

/* ---- lines that repeat ----------------------------------------------------------------------- */

enum { MESSAGE_SIZE = 1024, KINDS_MAX = 128 }; /* the program has fewer than 128 messages */
static const uint64_t SECOND_MS = 1000;

typedef struct kind {
  const char *format; /* identifies the kind; NULL: unused entry */
  srv_log_level level;
  uint64_t written; /* lines written, less one for each second up to settled_ms */
  uint64_t settled_ms;
  uint64_t hidden;         /* lines suppressed since the last report */
  char last[MESSAGE_SIZE]; /* the last suppressed line */
} kind;

static pthread_mutex_t kinds_lock = PTHREAD_MUTEX_INITIALIZER; /* guards kinds */
static kind kinds[KINDS_MAX];

static void report_hidden(kind *k) {
  char message[MESSAGE_SIZE + 64];
  if (k->hidden == 0) return;
  snprintf(message, sizeof message, "%llu more of these, the last: %s", (unsigned long long)k->hidden,
           k->last);
  write_message(k->level, message);
  k->hidden = 0;
}

static kind *find_kind(const char *format) {
  size_t i = 0;
  while (i < KINDS_MAX && kinds[i].format && kinds[i].format != format) i++;
  return i < KINDS_MAX ? &kinds[i] : NULL;
}

/* Subtracts one line for each whole second since settled_ms. */
static void settle(kind *k, uint64_t now_ms) {
  uint64_t seconds = (now_ms - k->settled_ms) / SECOND_MS;
  k->written -= k->written < seconds ? k->written : seconds;
  k->settled_ms += seconds * SECOND_MS;
}

/* Whether a line may be written now; otherwise counts it as suppressed. */
static bool admit(srv_log_level level, const char *format, const char *message) {
  if (level > SRV_LOG_WARN) return true;
  pthread_mutex_lock(&kinds_lock);
  uint64_t now_ms = srv_now_ms(); /* with the lock held: at least the settled_ms of each kind */
  kind *k = find_kind(format);
  if (k && !k->format) *k = (kind){.format = format, .level = level, .settled_ms = now_ms};
  if (k) settle(k, now_ms);
  bool is_admitted = !k || k->written < SRV_LOG_BURST;
  if (k && is_admitted) {
    report_hidden(k);
    k->written++;
  } else if (!is_admitted) {
    k->hidden++;
    strcpy(k->last, message);
  }
  pthread_mutex_unlock(&kinds_lock);
  return is_admitted;
}

static void report_hidden_older(uint64_t age_ms) {
  pthread_mutex_lock(&kinds_lock);
  uint64_t now_ms = srv_now_ms();
  for (size_t i = 0; i < KINDS_MAX && kinds[i].format; i++)
    if (now_ms - kinds[i].settled_ms >= age_ms) report_hidden(&kinds[i]);
  pthread_mutex_unlock(&kinds_lock);
}

void srv_log_tell_hidden(void) {
  report_hidden_older(SECOND_MS);
}

void srv_log_tell_all_hidden(void) {
  report_hidden_older(0);
}

void srv_log(srv_log_level level, const char *format, ...) {
  if (level > atomic_load(&threshold)) return;
  char message[MESSAGE_SIZE];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  if (admit(level, format, message)) write_message(level, message);
}

/* ---- requests -------------------------------------------------------------------------------- */

/* The next character, with its percent-encoding undone; moves *at behind it. */
static int next_character(const char **at) {
  int value = (unsigned char)**at;
  char digits[3] = "";
  if (**at == '%') strncpy(digits, *at + 1, 2);
  bool is_escaped = isxdigit((unsigned char)digits[0]) && isxdigit((unsigned char)digits[1]);
  if (is_escaped) value = (int)strtol(digits, NULL, 16);
  *at += is_escaped ? 3 : 1;
  return value;
}

/* Whether the argument's name is "sig", in any case, percent-encoded or not. */
static bool is_signature(const char *argument) {
  static const char parameter[] = "sig=";
  for (size_t i = 0; parameter[i] != '\0'; i++)
    if (tolower(next_character(&argument)) != parameter[i]) return false;
  return true;
}

/* Appends the query without the signature of a signed URL: a reader of the log could use the URL until it
 * expires. */
static void append_query(line *l, const char *query) {
  for (const char *at = query; *at != '\0' && l->size < FIELD_END;) {
    size_t size = strcspn(at, "&");
    if (is_signature(at)) {
      append_text(l, "sig=...");
    } else {
      append_escaped_bytes(l, at, size, FIELD_END);
    }
    at += size;
    if (*at == '&') {
      append_text(l, "&");
      at++;
    }
  }
}

static void append_target(line *l, const srv_log_request *request) {
  append_escaped(l, request->path, FIELD_END);
  if (request->query[0] != '\0') append_text(l, "?");
  append_query(l, request->query);
}

void srv_log_access(const srv_log_request *request) {
  if (SRV_LOG_INFO > atomic_load(&threshold)) return;
  line l;
  begin(&l, SRV_LOG_INFO);
  if (as_json) {
    append_field(&l, "message", "request");
    append_field(&l, "id", request->id);
    append_field(&l, "peer", request->peer);
    if (request->traceparent[0] != '\0') append_field(&l, "traceparent", request->traceparent);
    append_field(&l, "method", request->method);
    append_field(&l, "route", request->route);
    append_text(&l, ",\"target\":\"");
    append_target(&l, request);
    append_text(&l, "\"");
    append(&l,
           ",\"status\":%d,\"aborted\":%s,\"bytes_in\":%llu,\"bytes_out\":%llu,"
           "\"receive_ms\":%.3f,\"queue_ms\":%.3f,\"work_ms\":%.3f,\"total_ms\":%.3f",
           request->status, request->aborted ? "true" : "false", (unsigned long long)request->bytes_in,
           (unsigned long long)request->bytes_out, request->receive_ms, request->queue_ms, request->work_ms,
           request->total_ms);
  } else {
    append(&l, "%d ", request->status);
    append_escaped(&l, request->method, SHORT_END);
    append_text(&l, " ");
    append_target(&l, request);
    append(&l, " in=%llu out=%llu ms=%.1f%s peer=", (unsigned long long)request->bytes_in,
           (unsigned long long)request->bytes_out, request->total_ms, request->aborted ? " aborted" : "");
    append_escaped(&l, request->peer, SHORT_END);
    append_text(&l, " id=");
    append_escaped(&l, request->id, SHORT_END);
  }
  finish(&l);
}
