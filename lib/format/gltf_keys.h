/* Tracks as glTF can hold them. */
#ifndef TWEEND_GLTF_KEYS_H
#define TWEEND_GLTF_KEYS_H

#include "tweend/anim.h"

/* The track with STEP, LINEAR or CUBICSPLINE keys and quaternions of unit length and continuous signs for
 * rotations; a spline has at least two keys. A rotation that glTF does not interpolate as the track does
 * gets as few LINEAR keys as keep it nearer than 0.1 degrees, and no more than max_keys, else TW_LIMIT.
 * The track must have passed tw_clip_create. Arrays of the result are the track's own or the arena's. */
tw_status tw_gltf_keys_of(const tw_track_keys *track, uint32_t max_keys, tw_arena *arena, tw_track_keys *out,
                          tw_error *error);

#endif
