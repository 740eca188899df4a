/* Bodies: decoding, the files of a form, and the format of what is in them. */
#ifndef API_UPLOAD_H
#define API_UPLOAD_H

#include "call.h"
#include "json_in.h"
#include "json_value.h"
#include "tweend/format.h"

/* A value: zeroed is empty, deinit frees. */
typedef struct api_upload {
  api_bytes bytes;  /* decoded, the file alone, or the GLB of several */
  uint8_t *decoded; /* what the upload owns, or NULL: bytes lie in the request's body */
  const char *name; /* of the file in a form, else NULL */
} api_upload;

/* The content of the request's body. 400, 413. */
api_outcome api_upload_read(api_call *call, api_upload *out);
void api_upload_deinit(api_upload *upload);

/* Reads one JSON document of at most values_max values: read(context, root). 400, 422 with the pointer. */
api_outcome api_json_read(api_call *call, api_bytes bytes, uint64_t values_max, api_json_reader *read,
                          void *context);

/* Reads a body that is one JSON document of at most values_max values: read(context, root). 400, 413, 422
 * with the pointer. */
api_outcome api_upload_json(api_call *call, uint64_t values_max, api_json_reader *read, void *context);

/* What the bytes are, against what the Content-Type declares. 400 where the two disagree. */
api_outcome api_upload_format(api_call *call, api_bytes bytes, tw_format *out);

/* How a model is read from its bytes. Zeroed: by the defaults. */
typedef struct api_reading {
  tw_quads quads;
  tw_weld weld;
  double distance; /* of TW_WELD_DISTANCE, else 0 */
} api_reading;

/* The query's `quads`: how a glTF's triangles become polygons. */
tw_status api_quads_read(const api_query *query, tw_quads *out, tw_error *error);

/* The model that the bytes make. Its format is theirs alone: stored bytes read back the same.
 * False: the fault says why; it stalls where making->grant had it stall. */
bool api_model_read(api_bytes bytes, tw_format format, api_reading reading, const api_making *making,
                    tw_model **out, api_fault *fault);

/* The most bytes that a body takes at a time, from its decoding to the model made of it, the decoded body of
 * `size` bytes and the model included; not the body as it came. Never over 64 MiB and six times the size. */
uint64_t api_reading_cost(api_upload_type type, api_coding coding, uint64_t size);

/* The files of a form. */
typedef struct api_form {
  uint32_t count;
  tw_named_file *files; /* [count], their bytes lie in the body */
} api_form;

/* The files of a multipart/form-data body, at least one: its parts with a filename. TW_SYNTAX with a reason.
 */
tw_status api_form_read(api_bytes body, const char *boundary, tw_arena *arena, api_form *out,
                        tw_error *error);

#endif
