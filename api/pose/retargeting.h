/* How borrowed clips are carried over to a model's own skeleton: the parameters, and the work. */
#ifndef API_RETARGETING_H
#define API_RETARGETING_H

#include "call.h"
#include "json_value.h"
#include "tweend/model.h"
#include "tweend/retarget.h"

/* Reads `retarget`, `map` and `feet=hold` from the query. names_feet: other values of `feet` are the names of
 * nodes, and not read here. 400. */
api_outcome api_retarget_read(api_call *call, bool names_feet, tw_retarget_wish *out);

/* API_FAILED with 400 for a map or feet=hold without retarget=auto. */
api_outcome api_retarget_check(api_call *call, const tw_retarget_wish *retarget);

/* Prints the parameters for keys and entity tags; nothing for clips that stay as they are. */
void api_retarget_print(const tw_retarget_wish *retarget, tw_text *text);

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
                       const tw_retarget_wish *retarget, uint32_t max_keys, tw_arena *arena, api_carried *out,
                       api_fault *fault);

#endif
