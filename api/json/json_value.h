/* Reads JSON, with errors that name the place. The document is checked as text (tweend/json_text.h), then
 * read object by object: cJSON parses one object at a time, without the content of its arrays and objects,
 * which is read from the text on demand. So no document takes more memory than its largest object without
 * nested content. Numbers in arrays are read directly from the text. */
#ifndef API_JSON_VALUE_H
#define API_JSON_VALUE_H

#include <cjson/cJSON.h>

#include "tweend/base.h"

/* The path from the document's root to a value, one link a level; lives on the stack. */
typedef struct api_place {
  const struct api_place *parent; /* NULL: the root */
  const char *name;               /* member, or NULL for an element */
  uint32_t index;                 /* element */
} api_place;

/* The context of a reading: the arena for results, the error to fill, and the text. */
typedef struct api_json {
  tw_arena *arena;
  tw_error *error;
  const char *text; /* set by api_json_open */
} api_json;

/* A value and its place. item NULL: the member is absent; it counts as an array without elements, and other
 * readers leave *out alone. */
typedef struct api_value {
  const api_json *json;
  const cJSON *item;
  api_place at;
} api_value;

/* Checks a document of at most values_max values, and parses its root object. text: outlives the reading.
 * root->item is freed by api_json_close. */
tw_status api_json_open(api_json *json, const char *text, size_t size, uint64_t values_max, api_value *root);
void api_json_close(api_value *value);

tw_status api_json_fail(const api_value *value, tw_status status, const char *format, ...) TW_PRINTF(3, 4);
/* The same where the library has filled the error, with a pointer relative to the value. */
tw_status api_json_fail_within(const api_value *value, tw_status status);
tw_status api_json_no_memory(const api_json *json);

/* Finds the members of an object: values[i] becomes the member names[i]. names: NULL-terminated; object
 * outlives the values. TW_SYNTAX for an unknown or repeated member. */
tw_status api_json_members(const api_value *object, const char *const *names, api_value *values);

/* The same for an object whose kind determines its members: only names[0..count) whose bit is in `members`
 * are known; the others are absent. count: at most 32. */
tw_status api_json_members_of(const api_value *object, const char *const *names, size_t count,
                              uint32_t members, api_value *values);

/* Reads the member `name` of an object as one of `kinds`; *out: its index. The other members depend on it, so
 * it is required; `missing` begins the error's sentence without it. */
tw_status api_json_kind(const api_value *object, const char *name, const char *const *kinds,
                        const char *missing, int *out);

/* The number of elements. TW_SYNTAX for a value that is no array, TW_LIMIT for more than `most`. */
tw_status api_json_count(const api_value *array, uint32_t most, uint32_t *count);

/* Calls read(context, object) for each element of an array of objects, until a call fails. */
typedef tw_status api_json_reader(void *context, const api_value *object);
tw_status api_json_each(const api_value *array, api_json_reader *read, void *context);

/* Calls read(context, text) for each element of an array of texts, until a call fails. */
tw_status api_json_each_text(const api_value *array, api_json_reader *read, void *context);

/* Calls read(context, object) for a value that must be an object. */
tw_status api_json_object(const api_value *value, api_json_reader *read, void *context);

/* A string, copied into the arena. */
tw_status api_json_text(const api_value *value, const char **out);
/* The same for a name: TW_LIMIT over TW_NAME_MAX bytes. */
tw_status api_json_name(const api_value *value, const char **out);

/* The index of a string among `choices` (NULL-terminated). */
tw_status api_json_choice(const api_value *value, const char *const *choices, int *out);

tw_status api_json_float(const api_value *value, float *out);   /* within the range of a float */
tw_status api_json_double(const api_value *value, double *out); /* finite */
tw_status api_json_flag(const api_value *value, bool *out);
/* A whole number from 0 to 2^32 - 2. */
tw_status api_json_index(const api_value *value, uint32_t *out);

/* An array of exactly `width` numbers, at most 4. */
tw_status api_json_floats(const api_value *value, uint32_t width, float *out);
tw_status api_json_doubles(const api_value *value, uint32_t width, double *out);

/* Whether an array begins with a number, rather than a row of numbers. */
bool api_json_holds_numbers(const api_value *array);

/* ---- arrays of numbers; call api_json_count first -------------------------------------------- */

/* out: [elements]. */
tw_status api_json_float_list(const api_value *array, float *out);
tw_status api_json_double_list(const api_value *array, double *out);
tw_status api_json_index_list(const api_value *array, uint32_t *out);

/* [[a, b, …], …], rows of exactly `width` numbers, at most 4. Row i goes to out + i * stride. */
tw_status api_json_float_rows(const api_value *array, uint32_t width, size_t stride, float *out);
tw_status api_json_double_rows(const api_value *array, uint32_t width, double *out);

/* [[i, j, …], …], rows of any length. offsets: [elements + 1]; row i is out[offsets[i]..offsets[i + 1]). out:
 * [offsets[elements]]. */
tw_status api_json_index_offsets(const api_value *array, uint32_t *offsets);
tw_status api_json_index_rows(const api_value *array, uint32_t *out);

/* [count] elements in the arena. NULL for no elements, or without memory, which sets *status. */
void *api_json_allocate(const api_json *json, size_t count, size_t size, tw_status *status);

#endif
