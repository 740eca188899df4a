/* Tracks as glTF can hold them. */
#ifndef TWEEND_GLTF_KEYS_H
#define TWEEND_GLTF_KEYS_H

#include "tweend/anim.h"

typedef struct tw_gltf_keys {
  tw_interpolation interpolation; /* STEP, LINEAR, CUBICSPLINE */
  uint32_t key_count;
  uint32_t width;      /* floats a value has */
  const float *times;  /* [key_count] */
  const float *values; /* [key_count][width], cubicspline [key_count][3][width] */
} tw_gltf_keys;

/* Keys of a track that has passed tw_clip_create; arrays are the track's own or the arena's.
 * Quaternions come out with unit length and continuous signs. A rotation that glTF cannot interpolate
 * as the track does is sampled so densely that it strays less than 0.1 degrees. */
tw_status tw_gltf_keys_of(const tw_track_keys *track, tw_arena *arena, tw_gltf_keys *out, tw_error *error);

#endif
