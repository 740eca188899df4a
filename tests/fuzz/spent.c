#include "spent.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#if defined(__has_feature)
#define HAS_FEATURE(name) __has_feature(name)
#else
#define HAS_FEATURE(name) 0
#endif

/* How much longer everything takes that a sanitizer watches. */
#if defined(__SANITIZE_THREAD__) || HAS_FEATURE(thread_sanitizer)
static const double SLOWER = 12;
#elif defined(__SANITIZE_ADDRESS__) || HAS_FEATURE(address_sanitizer)
static const double SLOWER = 6;
#else
static const double SLOWER = 1;
#endif

/* And what libFuzzer watches. */
#if defined(FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION)
static const double WATCHED = 5;
#else
static const double WATCHED = 1;
#endif

static const double MOST = 2, PER_KIB = 0.05, FREE_KIB = 10;

double spent_now(void) {
  struct timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

bool spent_too_much(double seconds, uint64_t bytes) {
  double kib = FREE_KIB + (double)bytes / 1024, most = PER_KIB * kib < MOST ? PER_KIB * kib : MOST;
  return seconds > SLOWER * WATCHED * most;
}

void spent_give_up(double seconds, uint64_t bytes) {
  fprintf(stderr, "%.3f s of processor for %llu bytes sent and answered\n", seconds,
          (unsigned long long)bytes);
  abort();
}
