/* A bucket is one number: the time at which it will be full again. A request adds the time that a token takes
 * to refill, and is refused when the bucket would then take more than a whole period to fill. This is the
 * generic cell rate algorithm (ITU-T I.371) with a burst of `count`. */
#include "rate.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

enum { SETS = 8192, WAYS = 8 };

static const uint64_t SECOND_NS = 1000000000;

typedef struct bucket {
  uint8_t id[16];
  uint64_t full_ns; /* 0: unused */
} bucket;

struct srv_rates {
  pthread_mutex_t lock;
  uint64_t seed; /* so that clients cannot choose their set */
  bucket buckets[SETS][WAYS];
};

srv_rates *srv_rates_create(void) {
  srv_rates *rates = calloc(1, sizeof *rates);
  if (!rates) return NULL;
  pthread_mutex_init(&rates->lock, NULL);
  if (getrandom(&rates->seed, sizeof rates->seed, GRND_NONBLOCK) < 0) rates->seed = (uintptr_t)rates;
  return rates;
}

void srv_rates_destroy(srv_rates *rates) {
  if (!rates) return;
  pthread_mutex_destroy(&rates->lock);
  free(rates);
}

static size_t set_of(const srv_rates *rates, const uint8_t id[16]) {
  uint64_t halves[2];
  memcpy(halves, id, sizeof halves);
  uint64_t hash = rates->seed;
  for (size_t i = 0; i < 2; i++) { /* finalizer of splitmix64 */
    hash = (hash ^ halves[i]) * UINT64_C(0xbf58476d1ce4e5b9);
    hash = (hash ^ hash >> 27) * UINT64_C(0x94d049bb133111eb);
    hash ^= hash >> 31;
  }
  return hash % SETS;
}

/* The bucket of the id. An id without one takes the place of the fullest bucket of its set. */
static bucket *find(srv_rates *rates, const uint8_t id[16]) {
  bucket *set = rates->buckets[set_of(rates, id)], *fullest = set;
  for (size_t i = 0; i < WAYS; i++) {
    if (set[i].full_ns != 0 && memcmp(set[i].id, id, sizeof set[i].id) == 0) return &set[i];
    if (set[i].full_ns < fullest->full_ns) fullest = &set[i];
  }
  *fullest = (bucket){0};
  memcpy(fullest->id, id, sizeof fullest->id);
  return fullest;
}

static uint32_t whole_seconds(uint64_t ns) {
  return (uint32_t)((ns + SECOND_NS - 1) / SECOND_NS);
}

srv_allowance srv_rates_take(srv_rates *rates, const uint8_t id[16], api_rate rate, uint64_t now_ns) {
  uint64_t period_ns = rate.period_s * SECOND_NS, token_ns = period_ns / rate.count;
  pthread_mutex_lock(&rates->lock);
  bucket *b = find(rates, id);
  uint64_t full_ns = (b->full_ns > now_ns ? b->full_ns : now_ns) + token_ns;
  uint64_t behind_ns = full_ns - now_ns;
  bool is_over = behind_ns > period_ns;
  if (!is_over) b->full_ns = full_ns;
  pthread_mutex_unlock(&rates->lock);
  if (is_over)
    return (srv_allowance){.rate = rate,
                           .reset_s = whole_seconds(behind_ns - token_ns),
                           .retry_s = whole_seconds(behind_ns - period_ns)};
  return (srv_allowance){.rate = rate,
                         .left = (uint32_t)((period_ns - behind_ns) / token_ns),
                         .reset_s = whole_seconds(behind_ns)};
}
