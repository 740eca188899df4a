/* Bucket tables over key times. */
#include "timeline.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { BUCKETS_MAX = 1 << 24 };

static void fill_buckets(const tw_timeline *timeline, tw_bucket *buckets, uint32_t bucket_count) {
  uint32_t key = 0;
  for (uint32_t i = 0; i < bucket_count + 2; i++) {
    while (key < timeline->key_count && timeline_bucket(timeline, timeline->times[key]) < i) key++;
    buckets[i].first_key = key;
    for (uint32_t j = 0; j < 3; j++)
      buckets[i].times[j] = j < timeline->key_count - key ? timeline->times[key + j] : INFINITY;
  }
}

bool tw_timeline_init(tw_timeline *timeline, tw_arena *arena, const float *times, uint32_t key_count) {
  uint32_t bucket_count = key_count < BUCKETS_MAX ? key_count : BUCKETS_MAX;
  float *copy = tw_arena_alloc(arena, key_count, sizeof *copy);
  tw_bucket *buckets = tw_arena_alloc(arena, (size_t)bucket_count + 2, sizeof *buckets);
  if (!copy || !buckets) return false;
  memcpy(copy, times, key_count * sizeof *copy);
  double span = (double)times[key_count - 1] - (double)times[0];
  double rate = span > 0 ? bucket_count / span : 0;
  *timeline = (tw_timeline){.times = copy,
                            .buckets = buckets,
                            .key_count = key_count,
                            .first = times[0],
                            .last = times[key_count - 1],
                            .last_bucket = (float)bucket_count,
                            .buckets_per_second = (float)fmin(rate, (double)FLT_MAX)};
  fill_buckets(timeline, buckets, bucket_count);
  return true;
}

uint32_t tw_timeline_find_crowded(const tw_timeline *timeline, float clamped, uint32_t bucket) {
  const float *times = timeline->times;
  uint32_t low = timeline->buckets[bucket].first_key, high = timeline->buckets[bucket + 1].first_key;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (times[middle] <= clamped)
      low = middle + 1;
    else
      high = middle;
  }
  return low - 1;
}
