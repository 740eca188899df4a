/* Key times, and the key before a time in constant time. Tracks with equal times share one. */
#ifndef TWEEND_TIMELINE_H
#define TWEEND_TIMELINE_H

#include "tweend/base.h"

/* The first key in a bucket or in a later one, and its time and those of the two keys after it: what a search
 * needs, in one place in memory. */
typedef struct tw_bucket {
  float times[3]; /* infinity beyond the last key */
  uint32_t first_key;
} tw_bucket;

/* The span of the keys is cut into as many equal buckets as there are keys. Rounding keeps order, so keys of
 * lower buckets are never after a time in a bucket, those of higher ones never before or at it: only the
 * bucket's own keys are compared. They are seldom more than two; where many crowd they are bisected.
 * Immutable. */
typedef struct tw_timeline {
  const float *times;       /* [key_count], strictly increasing */
  const tw_bucket *buckets; /* [last_bucket + 2] */
  uint32_t key_count;
  float first, last; /* key time */
  float last_bucket, buckets_per_second;
} tw_timeline;

/* Copies times[0..key_count) into the arena; they are finite and strictly increasing, and key_count is
 * at least 1. False without memory. */
bool tw_timeline_init(tw_timeline *timeline, tw_arena *arena, const float *times, uint32_t key_count);

/* A time outside the keys becomes the first or last one. */
static inline float timeline_clamp(const tw_timeline *timeline, float time) {
  time = time > timeline->first ? time : timeline->first;
  return time < timeline->last ? time : timeline->last;
}

static inline uint32_t timeline_bucket(const tw_timeline *timeline, float clamped) {
  float place = (clamped - timeline->first) * timeline->buckets_per_second;
  return (uint32_t)(int32_t)(place < timeline->last_bucket ? place : timeline->last_bucket);
}

/* The last key at or before a clamped time, when the bucket's times are all at or before it. */
uint32_t tw_timeline_find_crowded(const tw_timeline *timeline, float clamped, uint32_t bucket);

/* The last key at or before a clamped time. */
static inline uint32_t timeline_find(const tw_timeline *timeline, float clamped) {
  uint32_t bucket = timeline_bucket(timeline, clamped);
  const tw_bucket *found = timeline->buckets + bucket;
  uint32_t passed = (uint32_t)(found->times[0] <= clamped) + (uint32_t)(found->times[1] <= clamped) +
                    (uint32_t)(found->times[2] <= clamped);
  return passed < 3 ? found->first_key + passed - 1 : tw_timeline_find_crowded(timeline, clamped, bucket);
}

/* For [count] times in any order, ascending ones being quicker: each one clamped, and the last key at or
 * before it. The arrays are apart. */
void tw_timeline_find_all(const tw_timeline *timeline, const float *times, size_t count, float *clamped,
                          uint32_t *keys);

#endif
