/* Reading cJSON trees with an error that names the place. */
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

/* Who reads: where what was read goes, and where errors go. */
typedef struct api_json {
  tw_arena *arena;
  tw_error *error;
} api_json;

/* Parses text that api_json_check has passed, at most max_values values. *out is freed with
 * cJSON_Delete. */
tw_status api_json_parse(const char *text, size_t size, uint64_t max_values, cJSON **out, tw_error *error);

tw_status api_json_fail(const api_json *json, const api_place *at, tw_status status, const char *format, ...)
    TW_PRINTF(4, 5);
tw_status api_json_no_memory(const api_json *json);

/* Spreads the members of an object: values[i] becomes the member called names[i] or NULL.
 * names: NULL-terminated. TW_SYNTAX for what is no object, a member unknown or twice. */
tw_status api_json_members(const api_json *json, const api_place *at, const cJSON *object,
                           const char *const *names, const cJSON **values);

/* The number of elements. item NULL: 0. TW_SYNTAX for what is no array. */
tw_status api_json_array(const api_json *json, const api_place *at, const cJSON *item, uint32_t *count);

/* A text, copied into the arena. item NULL: leaves *out alone. */
tw_status api_json_text(const api_json *json, const api_place *at, const cJSON *item, const char **out);

/* One of `choices` (NULL-terminated). item NULL: leaves *out alone. */
tw_status api_json_choice(const api_json *json, const api_place *at, const cJSON *item,
                          const char *const *choices, int *out);

tw_status api_json_number(const api_json *json, const api_place *at, const cJSON *item, double *out);
/* A number that a float holds. */
tw_status api_json_float(const api_json *json, const api_place *at, const cJSON *item, float *out);
/* A whole number from 0 to 2^32 - 2. */
tw_status api_json_index(const api_json *json, const api_place *at, const cJSON *item, uint32_t *out);

/* An array of exactly `width` numbers. */
tw_status api_json_floats(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                          float *out);
tw_status api_json_numbers(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                           double *out);

/* [[a, b, …], …]: rows of `width` floats, in the arena. item NULL: no rows. */
tw_status api_json_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                        uint32_t *count, float **out);

#endif
