/* What clips of a VRMA move of a face: expressions and gaze, for VRM characters (tweend/face.h). */
#ifndef API_BORROWED_FACES_H
#define API_BORROWED_FACES_H

#include "borrowed_clips.h"

/* A clip of another model, in two parts. */
typedef struct api_face_split {
  tw_clip_keys others; /* of the lender: without what moves its face, where the model has one. A view */
  tw_clip_keys face;   /* of the model; all of it lives in the notes' arena */
} api_face_split;

/* Splits the clip. Notes what the model's face does not show of it. max_keys: of a track. False: the fault
 * says why. */
bool api_face_split_off(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                        uint32_t max_keys, api_notes *notes, api_face_split *out, api_fault *fault);

/* Adds the tracks of a face to *keys, whose own tracks of the same parts they replace. Both move nodes of one
 * model, which has node_count. False without memory. */
bool api_face_add(const tw_clip_keys *face, uint32_t node_count, tw_arena *arena, tw_clip_keys *keys);

/* The morph weights of the model's nodes at rest, [nodes]; NULL in it: 0. NULL without memory. */
const float **api_rest_weights(const tw_model *model, tw_arena *arena);

#endif
