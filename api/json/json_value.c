/* Reads typed values from JSON. */
#include "json_value.h"

#include "near_names.h"
#include "tweend/json_print.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/json_text.h"

/* More members than any object has that is read; objects that are members stay in the text. */
enum { MEMBERS_MAX = 1024 };

/* ---- errors ---------------------------------------------------------------------------------- */

/* Prints the JSON pointer of a place into out, from its end backwards; returns its start. */
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

/* The text of an object with its arrays and objects emptied, and where these stand in the document. */
typedef struct flat_object {
  char *text; /* of tw_resize: a member may be a text of any length */
  size_t size, capacity;
  const char *containers[MEMBERS_MAX]; /* of each member; NULL for a member of another kind */
} flat_object;

static bool add_flat(flat_object *flat, const char *text, size_t size) {
  if (flat->capacity - flat->size < size) {
    size_t capacity = flat->size + size < 128 ? 256 : 2 * (flat->size + size);
    char *grown = tw_resize(flat->text, capacity);
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
static tw_status flatten(const api_value *value, const char *object, flat_object *flat, const char **end) {
  tw_json_item item;
  size_t count = 0;
  bool is_added = add_flat(flat, "{", 1);
  for (bool more = tw_json_first(object, &item); more && is_added; count++) {
    if (count == MEMBERS_MAX)
      return api_json_fail(value, TW_LIMIT, "the object has more than %d members", MEMBERS_MAX);
    const char *stop = tw_json_skip(item.value);
    is_added = add_member(flat, &item, stop, count);
    more = tw_json_next(stop, &item);
  }
  *end = item.value;
  return is_added && add_flat(flat, "}", 1) ? TW_OK : api_json_no_memory(value->json);
}

/* The text of an array or object. */
static const char *source_of(const api_value *container) {
  return container->json->text + (size_t)container->item->valuedouble;
}

/* Parses the object at `object`, without the content of its arrays and objects. cJSON does not use the number
 * field of such values: it stores their offset in the text. Fills value->item. */
static tw_status parse_object(api_value *value, const char *object, const char **end) {
  const api_json *json = value->json;
  if (*object != '{') return api_json_fail(value, TW_SYNTAX, "an object is expected");
  flat_object flat;
  flat.text = NULL;
  flat.size = flat.capacity = 0;
  tw_status status = flatten(value, object, &flat, end);
  cJSON *tree = status == TW_OK ? cJSON_ParseWithLengthOpts(flat.text, flat.size, NULL, false) : NULL;
  tw_free(flat.text);
  if (status != TW_OK) return status;
  /* The text is valid JSON: only memory can be missing. */
  if (!tree) return api_json_no_memory(json);
  size_t index = 0;
  for (cJSON *child = tree->child; child; child = child->next, index++)
    if (flat.containers[index]) child->valuedouble = (double)(flat.containers[index] - json->text);
  value->item = tree;
  return TW_OK;
}

tw_status api_json_open(api_json *json, const char *text, size_t size, uint64_t values_max, api_value *root) {
  const tw_json_rules rules = {.values_max = values_max, .is_for_cjson = true};
  *root = (api_value){.json = json};
  tw_status status = tw_json_check(text, size, &rules, json->error);
  if (status != TW_OK) return status;
  const char *end;
  json->text = text;
  return parse_object(root, tw_json_root(text, size), &end);
}

void api_json_close(api_value *value) {
  cJSON_Delete((cJSON *)value->item);
  value->item = NULL;
}

static tw_status fail_unknown(const api_value *object, const char *name, const char *const *names) {
  char list[200];
  tw_names_join(names, list, sizeof list);
  return api_json_fail(object, TW_SYNTAX, "unknown member \"%.60s\";%s known: %s", name,
                       api_near_of(name, names).text, list);
}

tw_status api_json_members(const api_value *object, const char *const *names, api_value *values) {
  for (size_t i = 0; names[i]; i++) values[i] = (api_value){object->json, NULL, {&object->at, names[i], 0}};
  for (const cJSON *child = object->item->child; child; child = child->next) {
    size_t i = 0;
    while (names[i] && strcmp(names[i], child->string) != 0) i++;
    if (!names[i]) return fail_unknown(object, child->string, names);
    if (values[i].item) return api_json_fail(object, TW_SYNTAX, "\"%s\" is given twice", names[i]);
    values[i].item = child;
  }
  return TW_OK;
}

tw_status api_json_members_of(const api_value *object, const char *const *names, size_t count,
                              uint32_t members, api_value *values) {
  enum { MOST = 32 };
  const char *known[MOST + 1] = {0};
  api_value found[MOST];
  size_t places[MOST], known_count = 0;
  for (size_t i = 0; i < count; i++) {
    values[i] = (api_value){object->json, NULL, {&object->at, names[i], 0}};
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
  if (!cJSON_IsArray(array->item)) return api_json_fail(array, TW_SYNTAX, "an array is expected");
  uint64_t found = tw_json_count(source_of(array));
  if (found > most)
    return api_json_fail(array, TW_LIMIT, "there are %llu, and at most %u are read",
                         (unsigned long long)found, most);
  *count = (uint32_t)found;
  return TW_OK;
}

/* The place of an array's first element; the caller moves it to the following elements. */
static api_value first_of(const api_value *array) {
  return (api_value){array->json, NULL, {&array->at, NULL, 0}};
}

tw_status api_json_each(const api_value *array, api_json_reader *read, void *context) {
  tw_json_item element;
  tw_status status = TW_OK;
  api_value object = first_of(array);
  bool more = array->item && tw_json_first(source_of(array), &element);
  for (; more && status == TW_OK; object.at.index++) {
    const char *end;
    status = parse_object(&object, element.value, &end);
    if (status != TW_OK) return status;
    status = read(context, &object);
    api_json_close(&object);
    more = tw_json_next(end, &element);
  }
  return status;
}

tw_status api_json_each_text(const api_value *array, api_json_reader *read, void *context) {
  tw_json_item element;
  tw_status status = TW_OK;
  api_value text = first_of(array);
  bool more = array->item && tw_json_first(source_of(array), &element);
  for (; more && status == TW_OK; text.at.index++) {
    if (*element.value != '"') return api_json_fail(&text, TW_SYNTAX, "a text is expected");
    const char *end = tw_json_skip(element.value);
    text.item = cJSON_ParseWithLength(element.value, (size_t)(end - element.value));
    if (!text.item) return api_json_no_memory(array->json);
    status = read(context, &text);
    api_json_close(&text);
    more = tw_json_next(end, &element);
  }
  return status;
}

tw_status api_json_object(const api_value *value, api_json_reader *read, void *context) {
  api_value object = *value;
  const char *end;
  if (!cJSON_IsObject(value->item)) return api_json_fail(value, TW_SYNTAX, "an object is expected");
  tw_status status = parse_object(&object, source_of(value), &end);
  if (status != TW_OK) return status;
  status = read(context, &object);
  api_json_close(&object);
  return status;
}

/* ---- scalars --------------------------------------------------------------------------------- */

tw_status api_json_text(const api_value *value, const char **out) {
  const cJSON *item = value->item;
  if (!item) return TW_OK;
  if (!cJSON_IsString(item)) return api_json_fail(value, TW_SYNTAX, "a text is expected");
  const char *copy = tw_arena_text(value->json->arena, item->valuestring, strlen(item->valuestring));
  if (!copy) return api_json_no_memory(value->json);
  *out = copy;
  return TW_OK;
}

tw_status api_json_name(const api_value *value, const char **out) {
  bool is_long = cJSON_IsString(value->item) && strlen(value->item->valuestring) > TW_NAME_MAX;
  if (is_long) return api_json_fail(value, TW_LIMIT, "the name is longer than %d bytes", TW_NAME_MAX);
  return api_json_text(value, out);
}

tw_status api_json_choice(const api_value *value, const char *const *choices, int *out) {
  const cJSON *item = value->item;
  if (!item) return TW_OK;
  for (int i = 0; cJSON_IsString(item) && choices[i]; i++) {
    if (strcmp(item->valuestring, choices[i]) != 0) continue;
    *out = i;
    return TW_OK;
  }
  char list[200];
  tw_names_join(choices, list, sizeof list);
  if (!cJSON_IsString(item)) return api_json_fail(value, TW_SYNTAX, "expected one of %s", list);
  return api_json_fail(value, TW_SYNTAX, "\"%.60s\":%s expected one of %s", item->valuestring,
                       api_near_of(item->valuestring, choices).text, list);
}

tw_status api_json_kind(const api_value *object, const char *name, const char *const *kinds,
                        const char *missing, int *out) {
  const cJSON *item = cJSON_GetObjectItemCaseSensitive(object->item, name);
  const api_value value = {object->json, item, {&object->at, name, 0}};
  if (item) return api_json_choice(&value, kinds, out);
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
  return cJSON_IsNumber(value->item) ? to_float(value, value->item->valuedouble, out) : fail_number(value);
}

static tw_status to_double(const api_value *at, double number, double *out) {
  if (!isfinite(number)) return api_json_fail(at, TW_INVALID, "the number is too large");
  *out = number;
  return TW_OK;
}

tw_status api_json_double(const api_value *value, double *out) {
  if (!value->item) return TW_OK;
  return cJSON_IsNumber(value->item) ? to_double(value, value->item->valuedouble, out) : fail_number(value);
}

tw_status api_json_flag(const api_value *value, bool *out) {
  if (!value->item) return TW_OK;
  if (!cJSON_IsBool(value->item)) return api_json_fail(value, TW_SYNTAX, "true or false is expected");
  *out = cJSON_IsTrue(value->item);
  return TW_OK;
}

tw_status api_json_index(const api_value *value, uint32_t *out) {
  if (!value->item) return TW_OK;
  return cJSON_IsNumber(value->item) ? to_index(value, value->item->valuedouble, out) : fail_number(value);
}

/* ---- arrays of numbers ----------------------------------------------------------------------- */

/* Receives the numbers of an array in turn: one of the three pointers, by kind. */
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

/* Reads the numbers of the array at `text`. *end: just past it. */
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

/* Fails for a row that is no array of `width` numbers: names a wrong count, or else the first element that is
 * no number. */
static tw_status fail_row(const api_value *row, const char *text, uint32_t width) {
  uint64_t count = tw_json_count(text);
  if (count != width)
    return api_json_fail(row, TW_SYNTAX, "%u %s expected, not %llu", width,
                         tw_plural(width, "number is", "numbers are"), (unsigned long long)count);
  double numbers[4];
  number_sink sink = {.kind = DOUBLES, .doubles = numbers};
  return read_list(row, text, &sink, &text);
}

/* Reads the row of exactly `width` numbers at `text`. *end: just past it. */
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
  if (!cJSON_IsArray(value->item)) return api_json_fail(value, TW_SYNTAX, "an array is expected");
  const char *end;
  return read_row(value, source_of(value), width, &sink, &end);
}

tw_status api_json_floats(const api_value *value, uint32_t width, float *out) {
  return read_numbers(value, width, (number_sink){.kind = FLOATS, .floats = out});
}

tw_status api_json_doubles(const api_value *value, uint32_t width, double *out) {
  return read_numbers(value, width, (number_sink){.kind = DOUBLES, .doubles = out});
}

static tw_status read_whole(const api_value *array, number_sink sink) {
  const char *end;
  return array->item ? read_list(array, source_of(array), &sink, &end) : TW_OK;
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
  return array->item && tw_json_first(source_of(array), &item) && tw_json_is_number(item.value);
}

/* Reads rows of `width` numbers, or of any length for width 0. Row i of floats goes to sink.floats + i *
 * stride. */
static tw_status read_rows(const api_value *array, uint32_t width, size_t stride, number_sink sink) {
  tw_json_item item;
  tw_status status = TW_OK;
  api_value row = first_of(array);
  float *floats = sink.floats;
  bool more = array->item && tw_json_first(source_of(array), &item);
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
  for (bool more = array->item && tw_json_first(source_of(array), &item); more; row.at.index++) {
    if (*item.value != '[') return api_json_fail(&row, TW_SYNTAX, "an array is expected");
    /* api_json_open has limited the number of values to far below 2^32. */
    sum += (uint32_t)tw_json_count(item.value);
    offsets[row.at.index + 1] = sum;
    more = tw_json_next(tw_json_skip(item.value), &item);
  }
  return TW_OK;
}

void *api_json_allocate(const api_json *json, size_t count, size_t size, tw_status *status) {
  if (*status != TW_OK || count == 0) return NULL;
  void *memory = tw_arena_alloc_raw(json->arena, count, size);
  if (!memory) *status = api_json_no_memory(json);
  return memory;
}
