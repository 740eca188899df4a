/* Typed values out of cJSON trees. Arrays are walked by child and next: cJSON finds an element by its
 * index in linear time. */
#include "json_value.h"

#include "json_check.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

tw_status api_json_parse(const char *text, size_t size, uint64_t max_values, cJSON **out, tw_error *error) {
  tw_status status = api_json_check(text, size, max_values, error);
  if (status != TW_OK) return status;
  cJSON *tree = cJSON_ParseWithLengthOpts(text, size, NULL, false);
  /* The text is known to be JSON: nothing but memory can be missing. */
  if (!tree) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  *out = tree;
  return TW_OK;
}

/* ---- errors ---------------------------------------------------------------------------------- */

/* Prints the pointer of a place into out, from its end backwards; returns its start. */
static const char *print_place(const api_place *at, char *out, size_t capacity) {
  char *start = out + capacity - 1;
  *start = '\0';
  for (; at; at = at->parent) {
    char number[16];
    const char *token = at->name;
    if (!token) {
      snprintf(number, sizeof number, "%u", at->index);
      token = number;
    }
    size_t length = strlen(token);
    if ((size_t)(start - out) < length + 1) break;
    start -= length;
    memcpy(start, token, length);
    *--start = '/';
  }
  return start;
}

tw_status api_json_fail(const api_json *json, const api_place *at, tw_status status, const char *format,
                        ...) {
  char detail[sizeof json->error->detail], pointer[sizeof json->error->pointer];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(detail, sizeof detail, format, arguments);
  va_end(arguments);
  tw_fail(json->error, status, "%s", detail);
  tw_error_at(json->error, "%s", print_place(at, pointer, sizeof pointer));
  return status;
}

tw_status api_json_no_memory(const api_json *json) {
  return tw_fail(json->error, TW_NO_MEMORY, "out of memory");
}

/* ---- structure ------------------------------------------------------------------------------- */

static tw_status fail_unknown(const api_json *json, const api_place *at, const char *name,
                              const char *const *names) {
  char list[200] = "";
  size_t length = 0;
  for (; *names; names++) {
    int more = snprintf(list + length, sizeof list - length, "%s%s", length ? ", " : "", *names);
    if (more > 0 && (size_t)more < sizeof list - length) length += (size_t)more;
  }
  return api_json_fail(json, at, TW_SYNTAX, "unknown member \"%.60s\"; known: %s", name, list);
}

tw_status api_json_members(const api_json *json, const api_place *at, const cJSON *object,
                           const char *const *names, const cJSON **values) {
  size_t count = 0;
  while (names[count]) values[count++] = NULL;
  if (!cJSON_IsObject(object)) return api_json_fail(json, at, TW_SYNTAX, "an object is expected");
  for (const cJSON *child = object->child; child; child = child->next) {
    size_t i = 0;
    while (names[i] && strcmp(names[i], child->string) != 0) i++;
    if (!names[i]) return fail_unknown(json, at, child->string, names);
    if (values[i]) return api_json_fail(json, at, TW_SYNTAX, "\"%s\" is given twice", names[i]);
    values[i] = child;
  }
  return TW_OK;
}

tw_status api_json_array(const api_json *json, const api_place *at, const cJSON *item, uint32_t *count) {
  *count = 0;
  if (!item) return TW_OK;
  if (!cJSON_IsArray(item)) return api_json_fail(json, at, TW_SYNTAX, "an array is expected");
  /* The check before parsing keeps the number of values far below 2^32. */
  for (const cJSON *child = item->child; child; child = child->next) ++*count;
  return TW_OK;
}

tw_status api_json_text(const api_json *json, const api_place *at, const cJSON *item, const char **out) {
  if (!item) return TW_OK;
  if (!cJSON_IsString(item)) return api_json_fail(json, at, TW_SYNTAX, "a text is expected");
  const char *copy = tw_arena_text(json->arena, item->valuestring, strlen(item->valuestring));
  if (!copy) return api_json_no_memory(json);
  *out = copy;
  return TW_OK;
}

tw_status api_json_choice(const api_json *json, const api_place *at, const cJSON *item,
                          const char *const *choices, int *out) {
  if (!item) return TW_OK;
  char list[200] = "";
  size_t length = 0;
  for (int i = 0; choices[i]; i++) {
    if (cJSON_IsString(item) && strcmp(item->valuestring, choices[i]) == 0) {
      *out = i;
      return TW_OK;
    }
    int more = snprintf(list + length, sizeof list - length, "%s%s", length ? ", " : "", choices[i]);
    if (more > 0 && (size_t)more < sizeof list - length) length += (size_t)more;
  }
  return api_json_fail(json, at, TW_SYNTAX, "expected one of %s", list);
}

/* ---- numbers --------------------------------------------------------------------------------- */

tw_status api_json_number(const api_json *json, const api_place *at, const cJSON *item, double *out) {
  if (!cJSON_IsNumber(item)) return api_json_fail(json, at, TW_SYNTAX, "a number is expected");
  *out = item->valuedouble;
  return TW_OK;
}

tw_status api_json_float(const api_json *json, const api_place *at, const cJSON *item, float *out) {
  double value = 0;
  tw_status status = api_json_number(json, at, item, &value);
  if (status != TW_OK) return status;
  if (!isfinite((float)value))
    return api_json_fail(json, at, TW_INVALID, "the number is too large for a float");
  *out = (float)value;
  return TW_OK;
}

tw_status api_json_index(const api_json *json, const api_place *at, const cJSON *item, uint32_t *out) {
  double value = 0;
  tw_status status = api_json_number(json, at, item, &value);
  if (status != TW_OK) return status;
  if (value != floor(value)) return api_json_fail(json, at, TW_SYNTAX, "a whole number is expected");
  if (value < 0 || value >= (double)UINT32_MAX)
    return api_json_fail(json, at, TW_INVALID, "the index %.0f is out of range", value);
  *out = (uint32_t)value;
  return TW_OK;
}

static tw_status check_width(const api_json *json, const api_place *at, const cJSON *item, uint32_t width) {
  uint32_t count;
  tw_status status = api_json_array(json, at, item, &count);
  if (status != TW_OK || count == width) return status;
  return api_json_fail(json, at, TW_SYNTAX, "%u numbers are expected, not %u", width, count);
}

tw_status api_json_numbers(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                           double *out) {
  tw_status status = check_width(json, at, item, width);
  api_place place = {at, NULL, 0};
  for (const cJSON *child = item ? item->child : NULL; child && status == TW_OK; child = child->next) {
    status = api_json_number(json, &place, child, &out[place.index]);
    place.index++;
  }
  return status;
}

tw_status api_json_floats(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                          float *out) {
  tw_status status = check_width(json, at, item, width);
  api_place place = {at, NULL, 0};
  for (const cJSON *child = item ? item->child : NULL; child && status == TW_OK; child = child->next) {
    status = api_json_float(json, &place, child, &out[place.index]);
    place.index++;
  }
  return status;
}

tw_status api_json_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                        uint32_t *count, float **out) {
  tw_status status = api_json_array(json, at, item, count);
  if (status != TW_OK) return status;
  *out = tw_arena_alloc(json->arena, *count, width * sizeof **out);
  if (!*out) return api_json_no_memory(json);
  uint32_t row = 0;
  for (const cJSON *child = item ? item->child : NULL; child; child = child->next, row++) {
    api_place place = {at, NULL, row};
    status = api_json_floats(json, &place, child, width, *out + (size_t)row * width);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}
