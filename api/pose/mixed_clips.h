/* Mixed clips: the clips of their layers, found in this and other models, put on one model's nodes, and
 * mixed. */
#ifndef API_MIXED_CLIPS_H
#define API_MIXED_CLIPS_H

#include "borrowed_clips.h"
#include "tweend/mix.h"

/* A clip and, where it is mixed, those of its layers. Names are found in the model that holds the clip. */
typedef struct api_bound_clip {
  const tw_model *model; /* holds the clip */
  uint32_t index;
  api_entry *entry;              /* a reference to `model`; NULL: the one above holds it */
  uint32_t layer_count;          /* 0: a plain clip */
  struct api_bound_clip *layers; /* [layer_count], in the call's arena */
} api_bound_clip;

/* Finds the clips of the layers of a clip, and takes the models that they are borrowed from. id: of `model`,
 * "" for that of the request. 404 with the layer's place where a model or clip is not there, 422 where more
 * than TW_LAYER_CLIPS_MAX clips lie below or deeper than TW_LAYER_DEPTH_MAX; a light call stalls where a
 * model is not cached. Release *out in any case. */
api_outcome api_mixed_bind(api_call *call, const tw_model *model, const char *id, uint32_t index,
                           api_bound_clip *out);
void api_mixed_release(api_bound_clip *bound);

/* After a mixed clip of the model could not be taken: where that is because a model or clip of its layers is
 * not there, takes the fault back, warns that the clip is left out, and returns API_CONTINUE. Else
 * API_FAILED. */
api_outcome api_mixed_leave_out(api_call *call, const tw_model *model, uint32_t index);

/* What clips are mixed for. */
typedef struct api_mixing {
  const tw_model *model;            /* whose nodes they move */
  int force;                        /* as in api_clip_take */
  uint32_t max_keys;                /* of a track that is carried over */
  const tw_retarget_wish *retarget; /* how clips of other models come to `model` */
  api_notes *notes;
  const char *report; /* receives that of a clip that is carried over, as of api_clip_carry */
  const char *layers; /* receives those of layers that are carried over, a JSON array; NULL: of none */
} api_mixing;

/* Compiles one clip, or several of which each overrides those before it. False: the fault says why. */
bool api_mixed_compile(api_mixing *mixing, const api_bound_clip *bound, uint32_t count, tw_clip **out,
                       api_fault *fault);

#endif
