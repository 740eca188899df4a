/* Reading JSON with errors that name the place. A document is checked as text (tweend/json_text.h) and then
 * read object by object: cJSON parses one object at a time, whose arrays and objects stay in the text until
 * they are asked for, so that no document takes more memory than its largest object without them. Numbers in
 * arrays are read straight from the text. */
#ifndef API_JSON_VALUE_H
#define API_JSON_VALUE_H

#include <cjson/cJSON.h>

#include "tweend/base.h"

/* The way from the document's root to a value, one link a level; lives on the stack. */
typedef struct api_place {
  const struct api_place *parent; /* NULL: the root */
  const char *name;               /* member, or NULL for an element */
  uint32_t index;                 /* element */
} api_place;

/* Who reads: where what was read goes, where errors go, and the text. */
typedef struct api_json {
  tw_arena *arena;
  tw_error *error;
  const char *text; /* set by api_json_open */
} api_json;

/* Checks a document of at most values_max values, and parses its root object. text: outlives the reading.
 * *root is freed with cJSON_Delete. */
tw_status api_json_open(api_json *json, const char *text, size_t size, uint64_t values_max, cJSON **root);

tw_status api_json_fail(const api_json *json, const api_place *at, tw_status status, const char *format, ...)
    TW_PRINTF(4, 5);
tw_status api_json_no_memory(const api_json *json);

/* Spreads the members of an object: values[i] becomes the member called names[i] or NULL.
 * names: NULL-terminated. TW_SYNTAX for a member that is unknown or given twice. */
tw_status api_json_members(const api_json *json, const api_place *at, const cJSON *object,
                           const char *const *names, const cJSON **values);

/* The number of elements. item NULL: 0. TW_SYNTAX for what is no array. */
tw_status api_json_array(const api_json *json, const api_place *at, const cJSON *item, uint32_t *count);
/* The same, refused (TW_LIMIT) where there are more than `most`. */
tw_status api_json_array_of(const api_json *json, const api_place *at, const cJSON *item, uint32_t most,
                            uint32_t *count);

/* Calls read(context, json, place, object, index) for each element of an array of objects, until one fails.
 * item NULL: for none. */
typedef tw_status api_json_reader(void *context, const api_json *json, const api_place *at,
                                  const cJSON *object, uint32_t index);
tw_status api_json_each(const api_json *json, const api_place *at, const cJSON *item, api_json_reader *read,
                        void *context);

/* A text, copied into the arena. item NULL: leaves *out alone. */
tw_status api_json_text(const api_json *json, const api_place *at, const cJSON *item, const char **out);

/* One of `choices` (NULL-terminated). item NULL: leaves *out alone. */
tw_status api_json_choice(const api_json *json, const api_place *at, const cJSON *item,
                          const char *const *choices, int *out);

/* A number that a float holds. */
tw_status api_json_float(const api_json *json, const api_place *at, const cJSON *item, float *out);
/* A whole number from 0 to 2^32 - 2. */
tw_status api_json_index(const api_json *json, const api_place *at, const cJSON *item, uint32_t *out);

/* ---- arrays of numbers; each item is an array already found to be one, or NULL, which has no elements ----
 */

/* An array of exactly `width` numbers, at most 4. item may be any value. */
tw_status api_json_floats(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                          float *out);

/* out: [elements]. */
tw_status api_json_float_list(const api_json *json, const api_place *at, const cJSON *item, float *out);
tw_status api_json_index_list(const api_json *json, const api_place *at, const cJSON *item, uint32_t *out);

/* [[a, b, …], …], rows of exactly `width` numbers, at most 4. Row i goes to out + i stride. */
tw_status api_json_float_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                              size_t stride, float *out);
tw_status api_json_double_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                               double *out);

/* [[i, j, …], …], rows of any length. offsets: [elements + 1], row i from offsets[i] up to offsets[i + 1];
 * then the indices themselves, out: [offsets[elements]]. */
tw_status api_json_index_offsets(const api_json *json, const api_place *at, const cJSON *item,
                                 uint32_t *offsets);
tw_status api_json_index_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t *out);

#endif
