/* What one piece of work takes. The meter of the running work is a variable of the thread, so that the
 * hundreds of places that allocate need no further parameter. */
#include <malloc.h>
#include <stdlib.h>

#include "tweend/base.h"

static _Thread_local tw_meter *current;
static _Thread_local uint64_t steps_unasked; /* steps of this thread since it last asked is_over */

enum { STEPS_BETWEEN = 1 << 16 }; /* some tenths of a millisecond */

void tw_meter_init(tw_meter *meter, const tw_meter_host *host, uint64_t limit) {
  meter->host = *host;
  atomic_init(&meter->held, 0);
  atomic_init(&meter->peak, 0);
  atomic_init(&meter->limit, limit);
  atomic_init(&meter->missing, 0);
  atomic_init(&meter->steps, 0);
  atomic_init(&meter->is_over, false);
}

tw_meter *tw_meter_use(tw_meter *meter) {
  tw_meter *before = current;
  current = meter;
  steps_unasked = STEPS_BETWEEN; /* the first step asks */
  return before;
}

tw_meter *tw_meter_current(void) {
  return current;
}

/* ---- memory ---------------------------------------------------------------------------------- */

bool tw_meter_take(uint64_t bytes) {
  tw_meter *meter = current;
  if (!meter) return true;
  int64_t held = atomic_fetch_add(&meter->held, (int64_t)bytes) + (int64_t)bytes,
          peak = atomic_load(&meter->peak);
  if (held > 0 && (uint64_t)held > atomic_load(&meter->limit)) {
    uint64_t limit = meter->host.grant ? meter->host.grant(meter->host.owner, (uint64_t)held) : 0;
    if (limit < (uint64_t)held) {
      atomic_fetch_sub(&meter->held, (int64_t)bytes);
      atomic_store(&meter->missing, (uint64_t)held);
      return false;
    }
    atomic_store(&meter->limit, limit);
  }
  while (held > peak && !atomic_compare_exchange_weak(&meter->peak, &peak, held)) {
  }
  return true;
}

void tw_meter_give_back(uint64_t bytes) {
  if (current) atomic_fetch_sub(&current->held, (int64_t)bytes);
}

/* Charges memory that was just allocated; frees it where it may not be held. */
static void *charged(void *memory) {
  if (!current || !memory || tw_meter_take(malloc_usable_size(memory))) return memory;
  free(memory);
  return NULL;
}

/* Whether that much may be held at all: asked before large blocks, whose pages the system would clear. An
 * allocation is also a step of work, and fails where the result is no longer wanted: so work ends there whose
 * loops do not ask. */
static bool may_hold(size_t bytes) {
  enum { LARGE = 1 << 20, BYTES_A_STEP = 64 };
  if (!tw_work(1 + bytes / BYTES_A_STEP)) return false;
  if (bytes < LARGE) return true;
  if (!tw_meter_take(bytes)) return false;
  tw_meter_give_back(bytes);
  return true;
}

void *tw_alloc(size_t count, size_t size) {
  if (size != 0 && count > SIZE_MAX / size) return NULL;
  size_t bytes = count * size;
  return may_hold(bytes) ? charged(malloc(bytes ? bytes : 1)) : NULL;
}

void *tw_alloc_zero(size_t count, size_t size) {
  if (size != 0 && count > SIZE_MAX / size) return NULL;
  size_t bytes = count * size;
  return may_hold(bytes) ? charged(calloc(bytes ? bytes : 1, 1)) : NULL;
}

void *tw_resize(void *memory, size_t bytes) {
  size_t before = current && memory ? malloc_usable_size(memory) : 0;
  if (bytes > before && !may_hold(bytes - before)) return NULL;
  void *resized = realloc(memory, bytes ? bytes : 1);
  if (!resized || !current) return resized;
  size_t after = malloc_usable_size(resized);
  tw_meter_give_back(before);
  /* The old block is gone, so the new one has to stay: what is too much fails the next allocation. */
  atomic_fetch_add(&current->held, (int64_t)after);
  return resized;
}

void tw_free(void *memory) {
  if (current && memory) tw_meter_give_back(malloc_usable_size(memory));
  free(memory);
}

/* ---- work ------------------------------------------------------------------------------------ */

bool tw_work(uint64_t steps) {
  tw_meter *meter = current;
  if (!meter) return true;
  steps_unasked += steps;
  if (steps_unasked < STEPS_BETWEEN) return !atomic_load_explicit(&meter->is_over, memory_order_relaxed);
  atomic_fetch_add(&meter->steps, steps_unasked);
  steps_unasked = 0;
  if (!atomic_load(&meter->is_over) && meter->host.is_over && meter->host.is_over(meter->host.owner))
    atomic_store(&meter->is_over, true);
  return !atomic_load(&meter->is_over);
}

tw_status tw_work_status(tw_error *error) {
  if (!current || !atomic_load(&current->is_over)) return TW_OK;
  return tw_fail(error, TW_CANCELLED, "the result is not wanted any more");
}
