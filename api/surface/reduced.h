/* Clips with as few LINEAR keys as a tolerance allows, kept between requests. */
#ifndef API_REDUCED_H
#define API_REDUCED_H

#include "clips.h"
#include "tweend/bake.h"

typedef struct api_reduction {
  bool is_wide; /* LINEAR tracks get fewer keys too, not only those that glTF does not have */
  tw_tolerance tolerance;
} api_reduction;

/* The tracks of a clip that a reduction changes; immutable. */
typedef struct api_reduced {
  tw_arena *arena; /* of what follows */
  uint32_t track_count;
  const uint32_t *places; /* [track_count] in the clip, ascending */
  const tw_track_keys *tracks;
  tw_tolerance reached; /* the largest error that is left */
} api_reduced;

/* The reduced tracks of a taken clip, whose keys are given: *out holds an api_reduced. is_stored as in
 * api_clip_take. Not for a light call. */
api_outcome api_reduced_take(api_call *call, const tw_model *model, bool is_stored,
                             const api_clip_choice *choice, const tw_clip_keys *keys,
                             const api_reduction *reduction, api_entry **out);

#endif
