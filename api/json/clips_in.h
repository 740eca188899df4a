/* Reads the clips of tweend JSON: their tracks, or the layers of mixed clips. */
#ifndef API_CLIPS_IN_H
#define API_CLIPS_IN_H

#include "names_in.h"
#include "tweend/model.h"

/* Whether a clip's name says that it is another model's: "{model id}/{name}". */
bool api_clip_is_borrowed(const char *name, size_t length);

/* What reading the clips of a model needs. */
typedef struct api_clips_reader {
  const api_names *nodes, *clips;
  tw_model *model;
  uint32_t track_count; /* of all clips so far */
} api_clips_reader;

/* Reads a clip into the model's clip of the same index. context: an api_clips_reader. The values of keys are
 * checked by tw_model_finish. TW_SYNTAX, TW_INVALID, TW_LIMIT, TW_NO_MEMORY. */
tw_status api_clip_in(void *context, const api_value *object);

#endif
