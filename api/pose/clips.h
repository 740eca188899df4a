/* The chosen clips of a request: put on the model's nodes, merged or mixed, compiled, cached. */
#ifndef API_CLIPS_H
#define API_CLIPS_H

#include "clip_choice.h"

/* One or more clips merged and compiled for one model; immutable. */
typedef struct api_clip {
  tw_arena *arena;             /* holds the members below */
  const char *name;            /* the names of all clips, separated by commas */
  const char *node_names;      /* of all nodes of the model, printed by api_node_names_print */
  const tw_clip_keys *carried; /* keys of a single borrowed clip, mapped to the model; else NULL */
  const char *retarget;        /* of a clip that was carried over, how: JSON; else NULL */
  const char *layers;          /* of layers that were carried over, how: JSON; else NULL */
  bool is_made;                /* of other clips, as mixed ones: it has no keys */
  bool has_root;               /* tw_clip_root_at gives its root motion */
  uint32_t root_node;          /* whose motion that is; TW_NO_INDEX: the clip moves none */
  bool root_is_above; /* a node above root_node carries the motion, which the model lacks: its index is
                         the model's node count */
  tw_clip *compiled;
  double duration;        /* seconds, as printed; counts tracks of borrowed clips that move nothing here */
  uint32_t warning_count; /* of nodes that a borrowed clip moves and the model lacks, and the like */
  const char **warnings;  /* [warning_count] sentences */
} api_clip;

/* Merges the clips, at least one, by tw_clip_merge and compiles them: *out holds an api_clip. force: a
 * tw_interpolation for all tracks, or -1. is_stored: the model is call->id in the store, so the clip may be
 * cached; false for a model in the body. */
api_outcome api_clip_take(api_call *call, const tw_model *model, bool is_stored,
                          const api_clip_choices *choices, int force, api_entry **out);

/* The keys of a single clip: those that it was compiled from, which are the model's own where none were
 * carried. NULL where it is made of other clips. clip: NULL where it was not compiled; index: of the model's
 * own. */
const tw_clip_keys *api_clip_keys(const api_clip *clip, const tw_model *model, uint32_t index);

/* The most keys of a track that is made: --max-times. */
uint32_t api_clip_keys_max(const api_call *call);

/* Finds keys that follow a clip which is made of other clips, and so has none. They live in the arena.
 * *reached: how far they are from it at most. TW_NO_MEMORY, TW_LIMIT, TW_CANCELLED. */
tw_status api_clip_find_keys(const tw_clip *made, uint32_t max_keys, tw_arena *arena, tw_clip_keys *out,
                             tw_tolerance *reached, tw_error *error);

/* Whether a clip of a model has layers in place of tracks. */
bool api_clip_is_mixed(const tw_model *model, uint32_t index);

#endif
