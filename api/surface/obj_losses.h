/* Tells what a model has that an OBJ of it has no place for. */
#ifndef API_OBJ_LOSSES_H
#define API_OBJ_LOSSES_H

#include "call.h"
#include "tweend/model.h"

/* Adds the warnings to the call. O(corners) where corners have colours. Fails without memory. */
api_outcome api_obj_losses_warn(api_call *call, const tw_model *model);

#endif
