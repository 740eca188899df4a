/* Typed values out of JSON. */
#include "json_value.h"

#include "near_names.h"
#include "tweend/json_print.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/json_text.h"

/* ---- errors ---------------------------------------------------------------------------------- */

/* Prints the pointer of a place into out, from its end backwards; returns its start. */
static const char *print_place(const api_place *at, char *out, size_t capacity) {
  char *start = out + capacity - 1;
  *start = '\0';
  for (; at->parent; at = at->parent) {
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

tw_status api_json_fail(const api_value *value, tw_status status, const char *format, ...) {
  tw_error *error = value->json->error;
  char detail[sizeof error->detail], pointer[sizeof error->pointer];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(detail, sizeof detail, format, arguments);
  va_end(arguments);
  tw_fail(error, status, "%s", detail);
  tw_error_at(error, "%s", print_place(&value->at, pointer, sizeof pointer));
  return status;
}

tw_status api_json_fail_within(const api_value *value, tw_status status) {
  tw_error *error = value->json->error;
  char place[sizeof error->pointer], pointer[sizeof error->pointer];
  memcpy(pointer, error->pointer, sizeof pointer);
  tw_error_at(error, "%s%s", print_place(&value->at, place, sizeof place), pointer);
  return status;
}

tw_status api_json_no_memory(const api_json *json) {
  return tw_fail(json->error, TW_NO_MEMORY, "out of memory");
}

/* ---- objects --------------------------------------------------------------------------------- */

tw_status api_json_open(const api_json *json, const char *text, size_t size, uint64_t values_max,
                        api_value *root) {
  const tw_json_rules rules = {.values_max = values_max, .is_for_c_texts = true};
  *root = (api_value){.json = json};
  tw_status status = tw_json_check(text, size, &rules, json->error);
  if (status != TW_OK) return status;
  root->item = tw_json_root(text, size);
  return *root->item == '{' ? TW_OK : api_json_fail(root, TW_SYNTAX, "an object is expected");
}

/* Whether a member is called so, however its key is written. */
static bool is_called(const tw_json_item *item, const char *name) {
  char key[256];
  if (!memchr(item->key, '\\', item->key_size)) return tw_json_key_is(item, name);
  if (item->key_size > sizeof key) return false; /* more than any name takes in escapes */
  size_t size = (size_t)(tw_json_unescape(item->key, item->key_size, key) - key);
  return size == strlen(name) && memcmp(key, name, size) == 0;
}

static tw_status fail_unknown(const api_value *object, const tw_json_item *item, const char *const *names) {
  char list[200], *name = tw_arena_alloc(object->json->arena, item->key_size + 1, 1);
  if (!name) return api_json_no_memory(object->json);
  *tw_json_unescape(item->key, item->key_size, name) = '\0';
  tw_names_join(names, list, sizeof list);
  return api_json_fail(object, TW_SYNTAX, "unknown member \"%.60s\";%s known: %s", name,
                       api_near_of(name, names).text, list);
}

tw_status api_json_members(const api_value *object, const char *const *names, api_value *values) {
  tw_json_item item;
  for (size_t i = 0; names[i]; i++)
    values[i] = (api_value){object->json, NULL, {&object->at, names[i], 0}, NULL};
  bool more = tw_json_first(object->item, &item);
  while (more) {
    size_t i = 0;
    while (names[i] && !is_called(&item, names[i])) i++;
    if (!names[i]) return fail_unknown(object, &item, names);
    if (values[i].item) return api_json_fail(object, TW_SYNTAX, "\"%s\" is given twice", names[i]);
    values[i].item = item.value;
    more = tw_json_next(tw_json_skip(item.value), &item);
  }
  if (object->end) *object->end = item.value;
  return TW_OK;
}

api_value api_json_member(const api_value *object, const char *name) {
  tw_json_item item;
  api_value value = {object->json, NULL, {&object->at, name, 0}, NULL};
  bool more = tw_json_first(object->item, &item);
  while (more && !is_called(&item, name)) more = tw_json_next(tw_json_skip(item.value), &item);
  if (more) value.item = item.value;
  return value;
}

tw_status api_json_members_of(const api_value *object, const char *const *names, size_t count,
                              uint32_t members, api_value *values) {
  enum { MOST = 32 };
  const char *known[MOST + 1] = {0};
  api_value found[MOST];
  size_t places[MOST], known_count = 0;
  for (size_t i = 0; i < count; i++) {
    values[i] = (api_value){object->json, NULL, {&object->at, names[i], 0}, NULL};
    if (!(members >> i & 1)) continue;
    places[known_count] = i;
    known[known_count++] = names[i];
  }
  tw_status status = api_json_members(object, known, found);
  for (size_t i = 0; i < known_count && status == TW_OK; i++) values[places[i]] = found[i];
  return status;
}

/* ---- arrays ---------------------------------------------------------------------------------- */

tw_status api_json_count(const api_value *array, uint32_t most, uint32_t *count) {
  *count = 0;
  if (!array->item) return TW_OK;
  if (!api_json_is(array, API_JSON_ARRAY)) return api_json_fail(array, TW_SYNTAX, "an array is expected");
  uint64_t found = tw_json_count(array->item);
  if (found > most)
    return api_json_fail(array, TW_LIMIT, "there are %llu, and at most %u are read",
                         (unsigned long long)found, most);
  *count = (uint32_t)found;
  return TW_OK;
}

/* The place of an array's first element; the caller moves it from element to element. */
static api_value first_of(const api_value *array) {
  return (api_value){array->json, NULL, {&array->at, NULL, 0}, NULL};
}

tw_status api_json_each(const api_value *array, api_json_reader *read, void *context) {
  tw_json_item element;
  tw_status status = TW_OK;
  api_value object = first_of(array);
  bool more = array->item && tw_json_first(array->item, &element);
  for (; more && status == TW_OK; object.at.index++) {
    const char *end = NULL;
    object.item = element.value;
    object.end = &end;
    status = api_json_object(&object, read, context);
    more = status == TW_OK && tw_json_next(end ? end : tw_json_skip(element.value), &element);
  }
  return status;
}

tw_status api_json_object(const api_value *value, api_json_reader *read, void *context) {
  if (!api_json_is(value, API_JSON_OBJECT)) return api_json_fail(value, TW_SYNTAX, "an object is expected");
  return read(context, value);
}

/* ---- scalars --------------------------------------------------------------------------------- */

bool api_json_is(const api_value *value, api_json_kind_of kind) {
  char first = (char)(value->item ? *value->item : '\0');
  switch (kind) {
  case API_JSON_OBJECT: return first == '{';
  case API_JSON_ARRAY: return first == '[';
  case API_JSON_TEXT: return first == '"';
  case API_JSON_NUMBER: return value->item && tw_json_is_number(value->item);
  case API_JSON_FLAG: return first == 't' || first == 'f';
  }
  return false;
}

tw_status api_json_text(const api_value *value, const char **out) {
  if (!value->item) return TW_OK;
  if (!api_json_is(value, API_JSON_TEXT)) return api_json_fail(value, TW_SYNTAX, "a text is expected");
  size_t size = (size_t)(tw_json_skip(value->item) - value->item) - strlen("\"\"");
  char *copy = tw_arena_alloc_raw(value->json->arena, size + 1, 1);
  if (!copy) return api_json_no_memory(value->json);
  *tw_json_unescape(value->item + 1, size, copy) = '\0';
  *out = copy;
  return TW_OK;
}

tw_status api_json_choice(const api_value *value, const char *const *choices, int *out) {
  const char *text = NULL;
  char list[200];
  if (!value->item) return TW_OK;
  tw_names_join(choices, list, sizeof list);
  if (!api_json_is(value, API_JSON_TEXT)) return api_json_fail(value, TW_SYNTAX, "expected one of %s", list);
  tw_status status = api_json_text(value, &text);
  if (status != TW_OK) return status;
  for (int i = 0; choices[i]; i++) {
    if (strcmp(text, choices[i]) != 0) continue;
    *out = i;
    return TW_OK;
  }
  return api_json_fail(value, TW_SYNTAX, "\"%.60s\":%s expected one of %s", text,
                       api_near_of(text, choices).text, list);
}

tw_status api_json_kind(const api_value *object, const char *name, const char *const *kinds,
                        const char *missing, int *out) {
  const api_value value = api_json_member(object, name);
  if (value.item) return api_json_choice(&value, kinds, out);
  char list[280];
  tw_names_join(kinds, list, sizeof list);
  return api_json_fail(object, TW_SYNTAX, "%s: %s", missing, list);
}

static tw_status fail_number(const api_value *value) {
  return api_json_fail(value, TW_SYNTAX, "a number is expected");
}

static tw_status to_float(const api_value *at, double number, float *out) {
  if (!isfinite((float)number)) return api_json_fail(at, TW_INVALID, "the number is too large for a float");
  *out = (float)number;
  return TW_OK;
}

static tw_status to_index(const api_value *at, double number, uint32_t *out) {
  if (number != floor(number)) return api_json_fail(at, TW_SYNTAX, "a whole number is expected");
  if (number < 0 || number >= (double)UINT32_MAX)
    return api_json_fail(at, TW_INVALID, "the number %.15g is out of range", number);
  *out = (uint32_t)number;
  return TW_OK;
}

tw_status api_json_float(const api_value *value, float *out) {
  if (!value->item) return TW_OK;
  double number;
  if (!api_json_is(value, API_JSON_NUMBER)) return fail_number(value);
  tw_json_number(value->item, &number);
  return to_float(value, number, out);
}

static tw_status to_double(const api_value *at, double number, double *out) {
  if (!isfinite(number)) return api_json_fail(at, TW_INVALID, "the number is too large");
  *out = number;
  return TW_OK;
}

tw_status api_json_double(const api_value *value, double *out) {
  if (!value->item) return TW_OK;
  double number;
  if (!api_json_is(value, API_JSON_NUMBER)) return fail_number(value);
  tw_json_number(value->item, &number);
  return to_double(value, number, out);
}

tw_status api_json_flag(const api_value *value, bool *out) {
  if (!value->item) return TW_OK;
  if (!api_json_is(value, API_JSON_FLAG)) return api_json_fail(value, TW_SYNTAX, "true or false is expected");
  *out = *value->item == 't';
  return TW_OK;
}

tw_status api_json_index(const api_value *value, uint32_t *out) {
  if (!value->item) return TW_OK;
  double number;
  if (!api_json_is(value, API_JSON_NUMBER)) return fail_number(value);
  tw_json_number(value->item, &number);
  return to_index(value, number, out);
}

/* ---- arrays of numbers ------------------------------------------------------------------------ */

/* What takes the numbers of an array in turn: to.floats, to.doubles or to.indices. */
typedef enum number_kind { FLOATS, DOUBLES, INDICES } number_kind;

typedef struct number_sink {
  number_kind kind;
  float *floats;
  double *doubles;
  uint32_t *indices;
} number_sink;

static tw_status put_number(const api_value *at, double number, number_sink *sink) {
  switch (sink->kind) {
  case FLOATS: return to_float(at, number, sink->floats++);
  case INDICES: return to_index(at, number, sink->indices++);
  case DOUBLES: return to_double(at, number, sink->doubles++);
  }
  return TW_OK;
}

/* Reads the numbers of the array that stands at `text`. *end: just past it. */
static tw_status read_list(const api_value *array, const char *text, number_sink *sink, const char **end) {
  tw_json_item item;
  api_value element = first_of(array);
  for (bool more = tw_json_first(text, &item); more; element.at.index++) {
    double number;
    if (!tw_json_is_number(item.value)) return fail_number(&element);
    const char *stop = tw_json_number(item.value, &number);
    tw_status status = put_number(&element, number, sink);
    if (status != TW_OK) return status;
    more = tw_json_next(stop, &item);
  }
  *end = item.value;
  return TW_OK;
}

/* The fault of a row that is no array of `width` numbers, be it how many they are or what. */
static tw_status fail_row(const api_value *row, const char *text, uint32_t width) {
  uint64_t count = tw_json_count(text);
  if (count != width)
    return api_json_fail(row, TW_SYNTAX, "%u numbers are expected, not %llu", width,
                         (unsigned long long)count);
  double numbers[4];
  number_sink sink = {.kind = DOUBLES, .doubles = numbers};
  return read_list(row, text, &sink, &text);
}

/* Reads the row of exactly `width` numbers that stands at `text`. *end: just past it. */
static tw_status read_row(const api_value *row, const char *text, uint32_t width, number_sink *sink,
                          const char **end) {
  if (*text != '[') return api_json_fail(row, TW_SYNTAX, "an array is expected");
  double numbers[4];
  uint32_t count = 0;
  tw_json_item item;
  bool more = tw_json_first(text, &item);
  for (; more && count < width && tw_json_is_number(item.value); count++)
    more = tw_json_next(tw_json_number(item.value, &numbers[count]), &item);
  if (more || count < width) return fail_row(row, text, width);
  *end = item.value;
  tw_status status = TW_OK;
  for (api_value element = first_of(row); element.at.index < width && status == TW_OK; element.at.index++)
    status = put_number(&element, numbers[element.at.index], sink);
  return status;
}

static tw_status read_numbers(const api_value *value, uint32_t width, number_sink sink) {
  if (!value->item) return TW_OK;
  if (!api_json_is(value, API_JSON_ARRAY)) return api_json_fail(value, TW_SYNTAX, "an array is expected");
  const char *end;
  return read_row(value, value->item, width, &sink, &end);
}

tw_status api_json_floats(const api_value *value, uint32_t width, float *out) {
  return read_numbers(value, width, (number_sink){.kind = FLOATS, .floats = out});
}

tw_status api_json_doubles(const api_value *value, uint32_t width, double *out) {
  return read_numbers(value, width, (number_sink){.kind = DOUBLES, .doubles = out});
}

static tw_status read_whole(const api_value *array, number_sink sink) {
  const char *end;
  return array->item ? read_list(array, array->item, &sink, &end) : TW_OK;
}

tw_status api_json_float_list(const api_value *array, float *out) {
  return read_whole(array, (number_sink){.kind = FLOATS, .floats = out});
}

tw_status api_json_double_list(const api_value *array, double *out) {
  return read_whole(array, (number_sink){.kind = DOUBLES, .doubles = out});
}

tw_status api_json_index_list(const api_value *array, uint32_t *out) {
  return read_whole(array, (number_sink){.kind = INDICES, .indices = out});
}

bool api_json_holds_numbers(const api_value *array) {
  tw_json_item item;
  return array->item && tw_json_first(array->item, &item) && tw_json_is_number(item.value);
}

/* Rows of `width` numbers, of any number of them for width 0. Row i of floats goes to sink.floats + i stride.
 */
static tw_status read_rows(const api_value *array, uint32_t width, size_t stride, number_sink sink) {
  tw_json_item item;
  tw_status status = TW_OK;
  api_value row = first_of(array);
  float *floats = sink.floats;
  bool more = array->item && tw_json_first(array->item, &item);
  for (; more && status == TW_OK; row.at.index++) {
    const char *end;
    if (floats) sink.floats = floats + row.at.index * stride;
    status =
        width > 0 ? read_row(&row, item.value, width, &sink, &end) : read_list(&row, item.value, &sink, &end);
    more = status == TW_OK && tw_json_next(end, &item);
  }
  return status;
}

tw_status api_json_float_rows(const api_value *array, uint32_t width, size_t stride, float *out) {
  return read_rows(array, width, stride, (number_sink){.kind = FLOATS, .floats = out});
}

tw_status api_json_double_rows(const api_value *array, uint32_t width, double *out) {
  return read_rows(array, width, width, (number_sink){.kind = DOUBLES, .doubles = out});
}

tw_status api_json_index_rows(const api_value *array, uint32_t *out) {
  return read_rows(array, 0, 0, (number_sink){.kind = INDICES, .indices = out});
}

tw_status api_json_index_offsets(const api_value *array, uint32_t *offsets) {
  tw_json_item item;
  api_value row = first_of(array);
  uint32_t sum = 0;
  offsets[0] = 0;
  for (bool more = array->item && tw_json_first(array->item, &item); more; row.at.index++) {
    if (*item.value != '[') return api_json_fail(&row, TW_SYNTAX, "an array is expected");
    /* The check keeps the number of values far below 2^32. */
    sum += (uint32_t)tw_json_count(item.value);
    offsets[row.at.index + 1] = sum;
    more = tw_json_next(tw_json_skip(item.value), &item);
  }
  return TW_OK;
}
