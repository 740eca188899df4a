/* Clips as LINEAR or STEP keys that any glTF program plays alike: at given times, or as few as a tolerance
 * allows. */
#ifndef TWEEND_BAKE_H
#define TWEEND_BAKE_H

#include "tweend/anim.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Every track of `clip` as keys at exactly these times: rotations as quaternions with continuous signs,
 * LINEAR, but STEP where the track is a STEP one. times: [time_count], at least 1, finite, strictly
 * increasing, not negative; else TW_INVALID with pointer "/times/3". Times outside a track's keys hold its
 * first or last value.
 * out: its name is NULL, for the caller to set; arrays live in the arena, except times, which is the
 * caller's. TW_NO_MEMORY. O(keys of the result). */
tw_status tw_clip_bake(const tw_clip *clip, const float *times, uint32_t time_count, tw_arena *arena,
                       tw_clip_keys *out, tw_error *error);

typedef struct tw_tolerance {
  double angle;    /* radians, at least 1e-6: of rotations */
  double distance; /* metres, above 0: of translations; of scales as they move a point one metre away; of
                      weights as they are */
} tw_tolerance;

/* The clip as few LINEAR keys that stay under the tolerance everywhere, in between keys too. Keys lie on the
 * original path, each as far from the one before as the tolerance allows; a track that stands still has
 * one, or two where it is what gives the clip its duration. STEP tracks and cubic splines stay as they are.
 * keys: what the clip was made of; the result may point into it. A clip made with a forced interpolation is
 * reduced as it moves then.
 * reached: the largest error that is left, measured between keys too; single precision may leave more than
 * a very small tolerance, but no more than 4e-7 of the largest value.
 * max_keys: TW_LIMIT where a track would need more, or where following the whole clip takes more than a
 * million steps and four for each of its keys. out: as in tw_clip_bake. O(keys + total angle /
 * sqrt(tolerance)) but for a logarithm. */
tw_status tw_clip_reduce(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                         uint32_t max_keys, tw_arena *arena, tw_clip_keys *out, tw_tolerance *reached,
                         tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
