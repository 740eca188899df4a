/* Models: parsed, cached, described. */
#ifndef API_MODELS_H
#define API_MODELS_H

#include "cache.h"
#include "call.h"
#include "tweend/format.h"
#include "upload.h"

/* The limits on what a document may make, bounded by --max-memory. The service outlives the result. */
api_making api_making_within(const api_service *service);

/* The stored model, parsed, from the cache or the store: *out holds a tw_model and is released by
 * api_entry_release. reading: NULL for the defaults, here and below. 404, 500, 503; a light call
 * stalls where the model is not cached. */
api_outcome api_model_take(api_call *call, const char *id, const api_reading *reading, api_entry **out);

/* The model in the request's body, parsed for this request alone, with the name that the request gives it:
 * *out holds a tw_model. */
api_outcome api_model_of_body(api_call *call, const api_reading *reading, api_entry **out);

/* Reads the body and parses the model in it. The caller owns both after API_DONE. */
api_outcome api_model_read_body(api_call *call, const api_reading *reading, api_upload *upload,
                                tw_model **out);

/* The name that a request gives the model in its body: in the query, in Content-Disposition, or as the file's
 * name in a form. *out: NULL for none; lives as long as the call. */
api_outcome api_model_find_given_name(api_call *call, const api_upload *upload, const char **out);

/* Parses a model after memory for that is granted, in addition to `held`. False: the fault says why. */
bool api_model_read_granted(api_call *call, api_bytes bytes, uint64_t held, tw_format format,
                            api_reading reading, tw_model **out);

/* Caches a model that has just been stored, so that its first reader need not parse it. Takes the model
 * over. */
void api_model_remember(api_service *service, const char *id, tw_model *model);

/* Names the model. name: or NULL. False without memory. */
bool api_model_set_name(tw_model *model, const char *name);

/* Sets told_name of the call to a copy of a model's name. name: or NULL. False without memory. */
bool api_tell_name(api_call *call, const char *name);

/* Prints the description of a model, adds its warnings to the answer's header and tells its name
 * (api_tell_name). False: the call's fault says why. */
bool api_describe(const tw_model *model, const char *id, uint64_t size, tw_text *out, api_call *call);

/* The model's name: its own, or the first one in its meshes, nodes or clips; NULL without any. */
const char *api_model_name(const tw_model *model);

/* Finds the mesh of that name, or mesh_N by its index; NULL: the only one. TW_INVALID. */
tw_status api_mesh_find(const tw_model *model, const char *name, uint32_t *out, tw_error *error);

/* Prints the members that a listing shows: name and format. */
void api_model_print_listed(const tw_model *model, tw_text *out);

/* What TW_CREASES_FILE keeps hard. */
typedef struct api_hard {
  uint64_t edges, corners;
} api_hard;

/* The warning of edges and corners that are kept hard, of which there are some; in the call's arena. NULL
 * without memory. */
const char *api_hard_warning(api_call *call, api_hard hard);

#endif
