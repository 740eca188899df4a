/* Answers as OBJ: what they have no place for, and their size. */
#ifndef API_OBJ_ANSWER_H
#define API_OBJ_ANSWER_H

#include "call.h"
#include "tweend/format.h"

/* Warns of what the model of a scene has and an OBJ has not. O(corners) where corners have colours. Fails
 * without memory. */
api_outcome api_obj_warn_of_losses(api_call *call, const tw_scene *scene);

/* A bound on the size of an OBJ, in bytes: it is known only at its end. */
tw_status api_obj_bound(api_call *call, const tw_scene *scene, uint64_t *size);

#endif
