/* Key times, and the key before a time in constant time. Tracks with equal times share one. */
#ifndef TWEEND_TIMELINE_H
#define TWEEND_TIMELINE_H

#include "tweend/base.h"

/* The span of the keys is cut into equal buckets; first_key[b] is the first key in bucket b or a later
 * one. Rounding keeps order, so keys of lower buckets are never after a time in b, those of higher ones
 * never before or at it: only the keys of b itself are compared. Where many crowd into one bucket they
 * are bisected. Immutable. */
typedef struct tw_timeline {
  const float *times;        /* [key_count], strictly increasing */
  const uint32_t *first_key; /* [bucket_count + 2] */
  uint32_t key_count, bucket_count;
  float buckets_per_second;
} tw_timeline;

/* Copies times[0..key_count) into the arena; they are finite and strictly increasing, and key_count is
 * at least 1. False without memory. */
bool tw_timeline_init(tw_timeline *timeline, tw_arena *arena, const float *times, uint32_t key_count);

/* A time outside the keys becomes the first or last one. */
static inline float timeline_clamp(const tw_timeline *timeline, float time) {
  float first = timeline->times[0], last = timeline->times[timeline->key_count - 1];
  time = time > first ? time : first;
  return time < last ? time : last;
}

static inline uint32_t timeline_bucket(const tw_timeline *timeline, float clamped) {
  uint32_t bucket = (uint32_t)(int32_t)((clamped - timeline->times[0]) * timeline->buckets_per_second);
  return bucket < timeline->bucket_count ? bucket : timeline->bucket_count;
}

/* The last key at or before a clamped time. */
static inline uint32_t timeline_find(const tw_timeline *timeline, float clamped) {
  const float *times = timeline->times;
  uint32_t bucket = timeline_bucket(timeline, clamped);
  uint32_t low = timeline->first_key[bucket], high = timeline->first_key[bucket + 1];
  while (high - low > 8) {
    uint32_t middle = low + (high - low) / 2;
    if (times[middle] <= clamped)
      low = middle + 1;
    else
      high = middle;
  }
  while (low < high && times[low] <= clamped) low++;
  return low - 1;
}

/* The same, quick when the time is in the segment of `hint` or in the next one. */
static inline uint32_t timeline_find_near(const tw_timeline *timeline, float clamped, uint32_t hint) {
  const float *times = timeline->times;
  if (clamped >= times[hint]) {
    if (hint + 1 >= timeline->key_count || clamped < times[hint + 1]) return hint;
    if (hint + 2 >= timeline->key_count || clamped < times[hint + 2]) return hint + 1;
  }
  return timeline_find(timeline, clamped);
}

#endif
