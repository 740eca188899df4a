/* Each line is composed in a buffer and leaves in one write, so that threads cannot interleave. Text
 * from outside is cut where it would leave no room for the rest of the line: JSON stays well-formed. */
#include "log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { LINE_SIZE = 8192, LINE_RESERVE = 1024 };

typedef struct line {
  char text[LINE_SIZE];
  size_t size;
} line;

static srv_log_level threshold = SRV_LOG_WARN;
static bool as_json = false;

static const char *const LEVEL_NAMES[] = {"error", "warn", "info", "debug"};

void srv_log_configure(srv_log_level level, srv_log_format format) {
  threshold = level;
  as_json = format == SRV_LOG_JSON || (format == SRV_LOG_AUTO && isatty(STDERR_FILENO) == 0);
}

/* For the program's own words and numbers, which are short. */
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

/* For text from outside: control bytes, quotes and backslashes cannot break the line. */
static void append_escaped(line *l, const char *text) {
  for (const char *at = text; *at != '\0' && l->size < LINE_SIZE - LINE_RESERVE; at++) {
    unsigned char c = (unsigned char)*at;
    if (c == '"' || c == '\\') {
      append(l, "\\%c", c);
    } else if (c < 0x20 || c >= 0x7f) {
      append(l, "\\u%04x", c);
    } else {
      l->text[l->size++] = (char)c;
    }
  }
}

static void append_field(line *l, const char *name, const char *text) {
  append(l, ",\"%s\":\"", name);
  append_escaped(l, text);
  append(l, "\"");
}

static void begin(line *l, srv_log_level level) {
  struct timespec now;
  struct tm utc;
  char stamp[32];
  clock_gettime(CLOCK_REALTIME, &now);
  gmtime_r(&now.tv_sec, &utc);
  strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
  l->size = 0;
  append(l, as_json ? "{\"time\":\"%s.%03ldZ\",\"level\":\"%s\"" : "%s.%03ldZ %-5s ", stamp,
         now.tv_nsec / 1000000, LEVEL_NAMES[level]);
}

static void finish(line *l) {
  append(l, as_json ? "}\n" : "\n");
  /* Where standard error is gone there is nobody to tell. */
  ssize_t written = write(STDERR_FILENO, l->text, l->size);
  (void)written;
}

void srv_log(srv_log_level level, const char *format, ...) {
  if (level > threshold) return;
  char message[1024];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(message, sizeof message, format, arguments);
  va_end(arguments);
  line l;
  begin(&l, level);
  if (as_json) {
    append_field(&l, "message", message);
  } else {
    append_escaped(&l, message);
  }
  finish(&l);
}

static void append_target(line *l, const srv_log_request *request) {
  append_escaped(l, request->path);
  if (request->query[0] != '\0') append(l, "?");
  append_escaped(l, request->query);
}

void srv_log_access(const srv_log_request *request) {
  if (SRV_LOG_INFO > threshold) return;
  line l;
  begin(&l, SRV_LOG_INFO);
  if (as_json) {
    append_field(&l, "message", "request");
    append_field(&l, "id", request->id);
    append_field(&l, "peer", request->peer);
    append_field(&l, "method", request->method);
    append(&l, ",\"target\":\"");
    append_target(&l, request);
    append(&l, "\"");
    append(&l,
           ",\"status\":%d,\"aborted\":%s,\"bytes_in\":%llu,\"bytes_out\":%llu,"
           "\"queue_ms\":%.3f,\"work_ms\":%.3f,\"total_ms\":%.3f",
           request->status, request->aborted ? "true" : "false", (unsigned long long)request->bytes_in,
           (unsigned long long)request->bytes_out, request->queue_ms, request->work_ms, request->total_ms);
  } else {
    append(&l, "%d ", request->status);
    append_escaped(&l, request->method);
    append(&l, " ");
    append_target(&l, request);
    append(&l, " in=%llu out=%llu ms=%.1f%s peer=", (unsigned long long)request->bytes_in,
           (unsigned long long)request->bytes_out, request->total_ms, request->aborted ? " aborted" : "");
    append_escaped(&l, request->peer);
    append(&l, " id=");
    append_escaped(&l, request->id);
  }
  finish(&l);
}
