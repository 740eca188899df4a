/* Mixed clips: clips blended by weights, and others added on top. */
#ifndef TWEEND_MIX_H
#define TWEEND_MIX_H

#include "tweend/retarget.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
  TW_LAYERS_MAX = 64,       /* layers of one mixed clip */
  TW_LAYER_DEPTH_MAX = 8,   /* mixed clips below one another */
  TW_LAYER_CLIPS_MAX = 256, /* plain clips that a mixed one plays in the end */
  TW_LAYER_NODES_MAX = 4096,
  TW_LAYER_KEYS_MAX = 65536 /* of a weight */
};

typedef enum tw_layer_mode {
  TW_LAYER_REPLACE,  /* blended with the other layers of this mode by its weight */
  TW_LAYER_ADDITIVE, /* its difference from the reference pose is added to what the others give */
  TW_LAYER_OVERRIDE  /* takes the place of the layers before it, whatever its weight */
} tw_layer_mode;

/* When and how much a layer plays; a view. Times are those of the mixed clip, unless they are said to be the
 * layer's clip's. */
typedef struct tw_layer {
  tw_layer_mode mode;
  bool is_synced;   /* plays in one phase with the other layers that are */
  tw_loop loop;     /* beyond its clip's ends; TW_CLAMP where is_synced, which repeats */
  double speed;     /* seconds of the layer's clip in a second; above 0 where is_synced */
  double offset;    /* the time of the layer's clip at time 0, seconds; negative: it starts later */
  double reference; /* of TW_LAYER_ADDITIVE: the time of its clip's pose that adds nothing, seconds */
  uint32_t weight_count;
  const float *weight_times; /* [weight_count] strictly increasing, not negative; NULL where weight_count
                                is 1 */
  const float *weights;      /* [weight_count] linear between their times, constant outside; not negative
                                unless TW_LAYER_ADDITIVE, at most 1e6 */
} tw_layer;

/* A layer as its source names it. */
typedef struct tw_clip_layer {
  const char *clip; /* the name of a clip of the same model, or of another's: then `own` is TW_NO_INDEX */
  uint32_t own;     /* clip of the same model */
  tw_layer layer;
  uint32_t node_count;       /* 0: the layer moves all nodes of its clip */
  const uint32_t *nodes;     /* [node_count] roots of the subtrees that it moves */
  tw_retarget_wish retarget; /* for clips of other models */
} tw_clip_layer;

/* Checks times, weights, speed and the like. TW_INVALID with a pointer relative to the layer:
 * "/weight/times/2". */
tw_status tw_layer_check(const tw_layer *layer, tw_error *error);

typedef struct tw_mix_job {
  uint32_t layer_count; /* 1 to TW_LAYERS_MAX */
  const tw_layer *layers;
  tw_clip *const *clips;  /* [layer_count], compiled for the nodes below */
  const float *durations; /* [layer_count] seconds that the clips take, not less than tw_clip_duration */
  const tw_node *nodes;   /* [node_count] whose rest transforms move where no layer plays */
  uint32_t node_count;
  const float *const *weights; /* [node_count] morph weights at rest; NULL, or NULL in it: 0 */
} tw_mix_job;

/* Mixes clips into one that is posed and sampled like any other. What a node's path takes:
 *
 * From layers that replace and move it, those with a weight above 0: their mean, weighted by the weights over
 * their sum. Of rotations that is the sum of the quaternions, each with the sign that makes its dot product
 * with the sum before it positive, at unit length; of translations, scales and morph weights the plain mean.
 * So a layer that alone has a weight above 0 plays as it is, bit for bit. Where all weights are 0, or none
 * of them moves it: the rest transform.
 * Then additive layers that move it, in order: a rotation q becomes q slerp(1, reference^-1 clip, weight),
 * the short way; all else value + weight (clip - reference).
 *
 * Times. A layer shows its clip at offset + speed t, held or looped beyond the ends. Synchronised layers have
 * one phase, which counts rounds: it rises by the mean of speed / duration of those that replace (or of the
 * additive ones, where there are no others), weighted by the weights over their sum at that time, and each
 * shows its clip at offset + phase duration, repeated. Wherever a clip repeats, the end of a round shows the
 * clip's end, or its beginning where it plays backwards.
 * The duration is the longest of what the layers with a weight above 0 take to come to their end (a round of
 * those that loop, two for TW_PINGPONG; nothing where speed is 0), of the last key times of weights, and of
 * the first time at which the synchronised phase is whole and their weights are constant. Outside of it the
 * first or the last pose holds.
 *
 * The layers are copied. *out: owns the clips after TW_OK. TW_INVALID as tw_layer_check, with "/layers/2" in
 * front; TW_LIMIT for TW_LAYERS_MAX and TW_LAYER_DEPTH_MAX, TW_NO_MEMORY. O(tracks log tracks). */
tw_status tw_clip_mix(const tw_mix_job *job, tw_clip **out, tw_error *error);

/* The duration of clips of these durations, mixed. layers: [layer_count] that have passed tw_layer_check.
 * TW_NO_MEMORY. */
tw_status tw_mix_duration(const tw_layer *layers, const float *durations, uint32_t layer_count, float *out,
                          tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
