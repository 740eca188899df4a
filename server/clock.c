/* The kernel's monotonic clocks as integers, and the time of day as HTTP writes it. */
#include "clock.h"

#include <time.h>

static const uint64_t NS_PER_S = 1000000000, NS_PER_MS = 1000000;

enum { DATE_SIZE = 48 };

static uint64_t read_ns(clockid_t id) {
  struct timespec now;
  clock_gettime(id, &now);
  return (uint64_t)now.tv_sec * NS_PER_S + (uint64_t)now.tv_nsec;
}

uint64_t srv_now_ns(void) {
  return read_ns(CLOCK_MONOTONIC);
}

uint64_t srv_now_ms(void) {
  return read_ns(CLOCK_MONOTONIC_COARSE) / NS_PER_MS;
}

const char *srv_date(int64_t second) {
  static _Thread_local int64_t printed;
  static _Thread_local char text[DATE_SIZE];
  if (second == printed && text[0] != '\0') return text;
  const time_t since = (time_t)second;
  struct tm utc;
  strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", gmtime_r(&since, &utc));
  printed = second;
  return text;
}

const char *srv_date_now(void) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME_COARSE, &now);
  return srv_date(now.tv_sec);
}
