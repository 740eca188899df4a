/* Bucket tables over key times. */
#include "timeline.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { BUCKETS_MAX = 1 << 24 };

bool tw_timeline_init(tw_timeline *timeline, tw_arena *arena, const float *times, uint32_t key_count) {
  uint32_t bucket_count = key_count < BUCKETS_MAX ? key_count : BUCKETS_MAX;
  float *copy = tw_arena_alloc(arena, key_count, sizeof *copy);
  uint32_t *first_key = tw_arena_alloc(arena, (size_t)bucket_count + 2, sizeof *first_key);
  if (!copy || !first_key) return false;
  memcpy(copy, times, key_count * sizeof *copy);
  double span = (double)times[key_count - 1] - (double)times[0];
  double rate = span > 0 ? bucket_count / span : 0;
  *timeline = (tw_timeline){.times = copy,
                            .first_key = first_key,
                            .key_count = key_count,
                            .bucket_count = bucket_count,
                            .buckets_per_second = (float)fmin(rate, (double)FLT_MAX)};
  uint32_t key = 0;
  for (uint32_t bucket = 0; bucket <= bucket_count; bucket++) {
    while (key < key_count && timeline_bucket(timeline, copy[key]) < bucket) key++;
    first_key[bucket] = key;
  }
  first_key[bucket_count + 1] = key_count;
  return true;
}
