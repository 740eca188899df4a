/* Typed values out of JSON. */
#include "json_value.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/json_text.h"

/* No object of any document that is read has more members; objects of objects stay in the text. */
enum { MEMBERS_MAX = 1024 };

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

/* ---- objects --------------------------------------------------------------------------------- */

/* An object's text with its arrays and objects empty, and where those stand. */
typedef struct flat_object {
  char *text; /* malloc'ed */
  size_t size, capacity;
  const char *containers[MEMBERS_MAX]; /* of each member; NULL for another value */
} flat_object;

static bool add_flat(flat_object *flat, const char *text, size_t size) {
  if (flat->capacity - flat->size < size) {
    size_t capacity = flat->size + size < 128 ? 256 : 2 * (flat->size + size);
    char *grown = realloc(flat->text, capacity);
    if (!grown) return false;
    flat->text = grown;
    flat->capacity = capacity;
  }
  memcpy(flat->text + flat->size, text, size);
  flat->size += size;
  return true;
}

static bool add_member(flat_object *flat, const tw_json_item *item, const char *end, size_t index) {
  bool is_array = *item->value == '[', is_container = is_array || *item->value == '{';
  flat->containers[index] = is_container ? item->value : NULL;
  return add_flat(flat, ",", index > 0) && add_flat(flat, item->key - 1, item->key_size + 2) &&
         add_flat(flat, ":", 1) &&
         (is_container ? add_flat(flat, is_array ? "[]" : "{}", 2)
                       : add_flat(flat, item->value, (size_t)(end - item->value)));
}

/* *end: just past the object. */
static tw_status flatten(const api_json *json, const api_place *at, const char *object, flat_object *flat,
                         const char **end) {
  tw_json_item item;
  size_t count = 0;
  bool is_added = add_flat(flat, "{", 1);
  for (bool more = tw_json_first(object, &item); more && is_added; count++) {
    if (count == MEMBERS_MAX)
      return api_json_fail(json, at, TW_LIMIT, "the object has more than %d members", MEMBERS_MAX);
    const char *stop = tw_json_skip(item.value);
    is_added = add_member(flat, &item, stop, count);
    more = tw_json_next(stop, &item);
  }
  *end = item.value;
  return is_added && add_flat(flat, "}", 1) ? TW_OK : api_json_no_memory(json);
}

static const char *source_of(const api_json *json, const cJSON *container) {
  return json->text + (size_t)container->valuedouble;
}

/* Parses the object that stands at `object`, without what is in its arrays and objects: cJSON has no use for
 * the number of such a value, which becomes its place in the text. */
static tw_status parse_object(const api_json *json, const api_place *at, const char *object, cJSON **out,
                              const char **end) {
  if (*object != '{') return api_json_fail(json, at, TW_SYNTAX, "an object is expected");
  flat_object flat;
  flat.text = NULL;
  flat.size = flat.capacity = 0;
  tw_status status = flatten(json, at, object, &flat, end);
  cJSON *tree = status == TW_OK ? cJSON_ParseWithLengthOpts(flat.text, flat.size, NULL, false) : NULL;
  free(flat.text);
  if (status != TW_OK) return status;
  /* The text is known to be JSON: nothing but memory can be missing. */
  if (!tree) return api_json_no_memory(json);
  size_t index = 0;
  for (cJSON *child = tree->child; child; child = child->next, index++)
    if (flat.containers[index]) child->valuedouble = (double)(flat.containers[index] - json->text);
  *out = tree;
  return TW_OK;
}

tw_status api_json_open(api_json *json, const char *text, size_t size, uint64_t values_max, cJSON **root) {
  const tw_json_rules rules = {.values_max = values_max, .is_for_cjson = true};
  tw_status status = tw_json_check(text, size, &rules, json->error);
  if (status != TW_OK) return status;
  const char *end;
  json->text = text;
  return parse_object(json, NULL, tw_json_root(text, size), root, &end);
}

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
  for (const cJSON *child = object->child; child; child = child->next) {
    size_t i = 0;
    while (names[i] && strcmp(names[i], child->string) != 0) i++;
    if (!names[i]) return fail_unknown(json, at, child->string, names);
    if (values[i]) return api_json_fail(json, at, TW_SYNTAX, "\"%s\" is given twice", names[i]);
    values[i] = child;
  }
  return TW_OK;
}

/* ---- arrays ---------------------------------------------------------------------------------- */

tw_status api_json_array(const api_json *json, const api_place *at, const cJSON *item, uint32_t *count) {
  return api_json_array_of(json, at, item, UINT32_MAX, count);
}

tw_status api_json_array_of(const api_json *json, const api_place *at, const cJSON *item, uint32_t most,
                            uint32_t *count) {
  *count = 0;
  if (!item) return TW_OK;
  if (!cJSON_IsArray(item)) return api_json_fail(json, at, TW_SYNTAX, "an array is expected");
  uint64_t found = tw_json_count(source_of(json, item));
  if (found > most)
    return api_json_fail(json, at, TW_LIMIT, "there are %llu, and at most %u are read",
                         (unsigned long long)found, most);
  *count = (uint32_t)found;
  return TW_OK;
}

tw_status api_json_each(const api_json *json, const api_place *at, const cJSON *item, api_json_reader *read,
                        void *context) {
  tw_json_item element;
  tw_status status = TW_OK;
  api_place place = {at, NULL, 0};
  bool more = item && tw_json_first(source_of(json, item), &element);
  for (; more && status == TW_OK; place.index++) {
    cJSON *object;
    const char *end;
    status = parse_object(json, &place, element.value, &object, &end);
    if (status != TW_OK) return status;
    status = read(context, json, &place, object, place.index);
    cJSON_Delete(object);
    more = tw_json_next(end, &element);
  }
  return status;
}

/* ---- scalars --------------------------------------------------------------------------------- */

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

static tw_status fail_number(const api_json *json, const api_place *at) {
  return api_json_fail(json, at, TW_SYNTAX, "a number is expected");
}

static tw_status to_float(const api_json *json, const api_place *at, double value, float *out) {
  if (!isfinite((float)value))
    return api_json_fail(json, at, TW_INVALID, "the number is too large for a float");
  *out = (float)value;
  return TW_OK;
}

static tw_status to_index(const api_json *json, const api_place *at, double value, uint32_t *out) {
  if (value != floor(value)) return api_json_fail(json, at, TW_SYNTAX, "a whole number is expected");
  if (value < 0 || value >= (double)UINT32_MAX)
    return api_json_fail(json, at, TW_INVALID, "the index %.0f is out of range", value);
  *out = (uint32_t)value;
  return TW_OK;
}

tw_status api_json_float(const api_json *json, const api_place *at, const cJSON *item, float *out) {
  return cJSON_IsNumber(item) ? to_float(json, at, item->valuedouble, out) : fail_number(json, at);
}

tw_status api_json_index(const api_json *json, const api_place *at, const cJSON *item, uint32_t *out) {
  return cJSON_IsNumber(item) ? to_index(json, at, item->valuedouble, out) : fail_number(json, at);
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

static tw_status put_number(const api_json *json, const api_place *at, double value, number_sink *sink) {
  switch (sink->kind) {
  case FLOATS: return to_float(json, at, value, sink->floats++);
  case INDICES: return to_index(json, at, value, sink->indices++);
  case DOUBLES: *sink->doubles++ = value; break;
  }
  return TW_OK;
}

/* Reads the numbers of the array that stands at `array`. *end: just past it. */
static tw_status read_list(const api_json *json, const api_place *at, const char *array, number_sink *sink,
                           const char **end) {
  tw_json_item item;
  api_place place = {at, NULL, 0};
  for (bool more = tw_json_first(array, &item); more; place.index++) {
    double value;
    if (!tw_json_is_number(item.value)) return fail_number(json, &place);
    const char *stop = tw_json_number(item.value, &value);
    tw_status status = put_number(json, &place, value, sink);
    if (status != TW_OK) return status;
    more = tw_json_next(stop, &item);
  }
  *end = item.value;
  return TW_OK;
}

/* The fault of a row that is no array of `width` numbers, be it how many they are or what. */
static tw_status fail_row(const api_json *json, const api_place *at, const char *row, uint32_t width) {
  uint64_t count = tw_json_count(row);
  if (count != width)
    return api_json_fail(json, at, TW_SYNTAX, "%u numbers are expected, not %llu", width,
                         (unsigned long long)count);
  double values[4];
  number_sink sink = {.kind = DOUBLES, .doubles = values};
  return read_list(json, at, row, &sink, &row);
}

/* Reads a row of exactly `width` numbers. *end: just past it. */
static tw_status read_row(const api_json *json, const api_place *at, const char *row, uint32_t width,
                          number_sink *sink, const char **end) {
  if (*row != '[') return api_json_fail(json, at, TW_SYNTAX, "an array is expected");
  double values[4];
  uint32_t count = 0;
  tw_json_item item;
  bool more = tw_json_first(row, &item);
  for (; more && count < width && tw_json_is_number(item.value); count++)
    more = tw_json_next(tw_json_number(item.value, &values[count]), &item);
  if (more || count < width) return fail_row(json, at, row, width);
  *end = item.value;
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < width && status == TW_OK; i++) {
    api_place place = {at, NULL, i};
    status = put_number(json, &place, values[i], sink);
  }
  return status;
}

tw_status api_json_floats(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                          float *out) {
  if (!cJSON_IsArray(item)) return api_json_fail(json, at, TW_SYNTAX, "an array is expected");
  const char *end;
  number_sink sink = {.kind = FLOATS, .floats = out};
  return read_row(json, at, source_of(json, item), width, &sink, &end);
}

static tw_status read_whole(const api_json *json, const api_place *at, const cJSON *item, number_sink *sink) {
  const char *end;
  return item ? read_list(json, at, source_of(json, item), sink, &end) : TW_OK;
}

tw_status api_json_float_list(const api_json *json, const api_place *at, const cJSON *item, float *out) {
  return read_whole(json, at, item, &(number_sink){.kind = FLOATS, .floats = out});
}

tw_status api_json_index_list(const api_json *json, const api_place *at, const cJSON *item, uint32_t *out) {
  return read_whole(json, at, item, &(number_sink){.kind = INDICES, .indices = out});
}

/* Rows of `width` numbers, of any number of them for width 0. Row i of floats goes to sink->floats + i
 * stride. */
static tw_status read_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                           size_t stride, number_sink sink) {
  tw_json_item row;
  tw_status status = TW_OK;
  api_place place = {at, NULL, 0};
  float *floats = sink.floats;
  bool more = item && tw_json_first(source_of(json, item), &row);
  for (; more && status == TW_OK; place.index++) {
    const char *end;
    if (floats) sink.floats = floats + place.index * stride;
    status = width > 0 ? read_row(json, &place, row.value, width, &sink, &end)
                       : read_list(json, &place, row.value, &sink, &end);
    more = status == TW_OK && tw_json_next(end, &row);
  }
  return status;
}

tw_status api_json_float_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                              size_t stride, float *out) {
  return read_rows(json, at, item, width, stride, (number_sink){.kind = FLOATS, .floats = out});
}

tw_status api_json_double_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t width,
                               double *out) {
  return read_rows(json, at, item, width, width, (number_sink){.kind = DOUBLES, .doubles = out});
}

tw_status api_json_index_offsets(const api_json *json, const api_place *at, const cJSON *item,
                                 uint32_t *offsets) {
  tw_json_item row;
  api_place place = {at, NULL, 0};
  uint32_t sum = 0;
  offsets[0] = 0;
  for (bool more = item && tw_json_first(source_of(json, item), &row); more; place.index++) {
    if (*row.value != '[') return api_json_fail(json, &place, TW_SYNTAX, "an array is expected");
    /* The check keeps the number of values far below 2^32. */
    sum += (uint32_t)tw_json_count(row.value);
    offsets[place.index + 1] = sum;
    more = tw_json_next(tw_json_skip(row.value), &row);
  }
  return TW_OK;
}

tw_status api_json_index_rows(const api_json *json, const api_place *at, const cJSON *item, uint32_t *out) {
  return read_rows(json, at, item, 0, 0, (number_sink){.kind = INDICES, .indices = out});
}
