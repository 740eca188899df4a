/* The kernel's monotonic clocks as integers. */
#include "clock.h"

#include <time.h>

static const uint64_t NS_PER_S = 1000000000, NS_PER_MS = 1000000;

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
