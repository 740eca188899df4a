/* What tw_model_finish (model_finish.c) is made of. */
#ifndef TWEEND_MODEL_CHECKS_H
#define TWEEND_MODEL_CHECKS_H

#include <math.h>

#include "tweend/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* TW_INVALID at "/array/index" and the rest. */
tw_status tw_model_fail_at(tw_error *error, const char *array, uint32_t index, const char *rest,
                           const char *detail);

/* Puts "/array/index" before the pointer of an error that is relative to that element. */
void tw_model_prefix(tw_error *error, const char *array, uint32_t index);

/* An empty name becomes NULL. */
tw_status tw_model_check_name(const char **name, const char *array, uint32_t index, tw_error *error);

/* Whether a quaternion is off unit length by more than rounding: numbers of bytes are within this. */
static inline bool tw_is_off_unit(double length) {
  return fabs(length - 1) > 0.01;
}

/* Sorts the names of nodes, for tw_model_find_node. */
tw_status tw_model_sort_names(tw_model *model, tw_error *error);

/* Gives the frames of far meshes to the nodes that show them, and keeps exact translations where they show.
 */
tw_status tw_model_place_far_meshes(tw_model *model, tw_error *error);

/* Clips, the layers of mixed ones, and clips of one name. */
tw_status tw_model_check_clips(tw_model *model, tw_error *error);

#ifdef __cplusplus
}
#endif

#endif
