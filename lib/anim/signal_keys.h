/* Keys for what is known as a function of time. */
#ifndef TWEEND_SIGNAL_KEYS_H
#define TWEEND_SIGNAL_KEYS_H

#include "tweend/anim.h"

/* A path of a node as a function of time, which depends on tracks of keys and is smooth between their keys.
 */
typedef struct tw_signal {
  const tw_track_keys *tracks;
  const uint32_t *indices; /* [track_count] of those that it depends on */
  uint32_t track_count;
  uint32_t time_count;
  const float *times; /* [time_count] further times at which it is not smooth, in any order */
  tw_path path;
  uint32_t width;
  void (*at)(const void *context, float time, double *out); /* out: [width] */
  const void *context;
  double tolerance; /* radians of rotations, lengths of translations, of weights the largest difference */
  uint32_t max_keys;
  uint64_t cost; /* nodes that `at` looks at */
} tw_signal;

/* Samples it at the key times of its tracks, and between them as often as the tolerance takes, as LINEAR
 * keys; as STEP keys where all tracks are STEP. The keys live in the arena. TW_LIMIT: more than max_keys;
 * TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_signal_sample(const tw_signal *signal, uint32_t node, tw_arena *arena, tw_track_keys *out,
                           tw_error *error);

/* Makes a track of samples. values: [count][width]. TW_NO_MEMORY. */
tw_status tw_samples_keep(const float *times, const double *values, uint32_t count, uint32_t width,
                          tw_path path, bool is_step, uint32_t node, tw_arena *arena, tw_track_keys *out,
                          tw_error *error);

#endif
