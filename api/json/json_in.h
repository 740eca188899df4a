/* Reads models from tweend JSON. */
#ifndef API_JSON_IN_H
#define API_JSON_IN_H

#include "edits_in.h"
#include "tweend/model.h"

/* The most values of any kind in one document. */
enum { API_JSON_VALUES_MAX = 10000000 };

/* Reads a document of tweend JSON. *out: a finished model. Errors have a pointer: TW_SYNTAX for text that is
 * no such document, TW_INVALID for one that makes no usable model, TW_LIMIT for too many parts, or for shapes
 * and edits that make too many faces. */
tw_status api_model_from_json(const char *text, size_t size, const api_making *making, tw_model **out,
                              tw_error *error);

#endif
