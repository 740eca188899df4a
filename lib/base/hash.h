/* FNV-1a, in which values may be wider than bytes. Senders can make keys collide: whoever uses it bounds
 * that. */
#ifndef TWEEND_HASH_H
#define TWEEND_HASH_H

#include <stdint.h>

static const uint64_t TW_HASH_BEGIN = 14695981039346656037u;

static inline uint64_t tw_hash_add(uint64_t hash, uint64_t value) {
  return (hash ^ value) * 1099511628211u;
}

/* The low bits of a product depend on few of its factors' bits: the high ones join them. */
static inline uint64_t tw_hash_end(uint64_t hash) {
  return hash ^ hash >> 32;
}

#endif
