/* How borrowed clips are carried over to a model's own skeleton: the parameters, and the work. */
#ifndef API_RETARGETING_H
#define API_RETARGETING_H

#include "call.h"
#include "json_value.h"
#include "tweend/model.h"
#include "tweend/retarget.h"

/* A pair of nodes that a client names. */
typedef struct api_map_pair {
  const char *source, *target; /* target NULL: the source's node moves nothing */
} api_map_pair;

/* A view into the call's arena. */
typedef struct api_retarget {
  bool is_auto; /* false: clips are borrowed by the names of nodes, as they are */
  bool holds_feet;
  bool has_map;
  uint32_t pair_count;
  const api_map_pair *pairs; /* [pair_count] */
} api_retarget;

/* Reads `retarget`, `map` and `feet=hold` from the query. names_feet: other values of `feet` are the names of
 * nodes, and not read here. 400. */
api_outcome api_retarget_read(api_call *call, bool names_feet, api_retarget *out);

/* Reads {"source node": "target node" or null} into an api_retarget. */
tw_status api_map_read(void *retarget, const api_value *object);

/* API_FAILED with 400 for a map or feet=hold without retarget=auto. */
api_outcome api_retarget_check(api_call *call, const api_retarget *retarget);

/* Prints the parameters for keys and entity tags; nothing for clips that stay as they are. */
void api_retarget_print(const api_retarget *retarget, tw_text *text);

/* A clip that was carried over. Lives in the arena. */
typedef struct api_carried {
  tw_clip_keys keys;  /* without a name */
  const char *report; /* the JSON of `retarget` in the answer to /tracks */
  uint32_t warning_count;
  const char *warnings[3]; /* [warning_count] */
} api_carried;

/* Carries keys of the lender over. max_keys: of a track. False: the fault says why: 422 for a map that names
 * other nodes, and for skeletons that do not match. */
bool api_clip_retarget(const tw_model *lender, const tw_clip_keys *keys, const tw_model *model,
                       const api_retarget *retarget, uint32_t max_keys, tw_arena *arena, api_carried *out,
                       api_fault *fault);

#endif
