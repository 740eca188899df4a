/* Request bodies: decoding, the files of a form, and the format of a model. */
#ifndef API_UPLOAD_H
#define API_UPLOAD_H

#include "call.h"
#include "json_in.h"
#include "json_value.h"
#include "tweend/format.h"

/* A value: zeroed is empty, api_upload_deinit frees. */
typedef struct api_upload {
  api_bytes bytes;  /* the decoded body, the file in a form, or the GLB made of several files */
  uint8_t *decoded; /* malloc'ed memory of `bytes`, or NULL: they lie in the request's body */
  const char *name; /* the file's name in a form, else NULL */
} api_upload;

/* Reads the content of the request's body. 400, 413. */
api_outcome api_upload_read(api_call *call, api_upload *out);
void api_upload_deinit(api_upload *upload);

/* Parses one JSON document of at most values_max values and calls read(context, root). 400, 422 with the
 * pointer. */
api_outcome api_json_read(api_call *call, api_bytes bytes, uint64_t values_max, api_json_reader *read,
                          void *context);

/* The same for the request's body. 400, 413, 422 with the pointer. */
api_outcome api_upload_json(api_call *call, uint64_t values_max, api_json_reader *read, void *context);

/* The format to read the bytes as: their own, or the one that the Content-Type names where they have none.
 * 400 where the two disagree; 415 where neither is that of a model. */
api_outcome api_upload_format(api_call *call, api_bytes bytes, tw_format *out);

/* How a model is read from its bytes. Zeroed: the defaults. */
typedef struct api_reading {
  tw_quads quads;
  tw_weld weld;
  double distance; /* of TW_WELD_DISTANCE, else 0 */
} api_reading;

/* Reads the query's `quads`: how a glTF's triangles become polygons. */
tw_status api_quads_read(const api_query *query, tw_quads *out, tw_error *error);

/* Reads a model. Only bytes of `format` are read without an error, so that stored bytes read back the same.
 * False: the fault says why. */
bool api_model_read(api_bytes bytes, tw_format format, api_reading reading, const api_making *making,
                    tw_model **out, api_fault *fault);

/* A bound on the bytes held at one time from decoding a body to the finished model, including the decoded
 * body of `size` bytes and the model, but not the body as received. At most 64 MiB + 6 x size. */
uint64_t api_reading_cost(api_upload_type type, api_coding coding, uint64_t size);

/* The files of a form. */
typedef struct api_form {
  uint32_t count;
  tw_named_file *files; /* [count], with bytes in the body */
} api_form;

/* Reads the files of a multipart/form-data body, at least one: the parts that have a filename. TW_SYNTAX with
 * a reason. */
tw_status api_form_read(api_bytes body, const char *boundary, tw_arena *arena, api_form *out,
                        tw_error *error);

#endif
