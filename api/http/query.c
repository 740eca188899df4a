/* Query strings: percent-decoding and typed values, with errors that name the parameter. */
#include "query.h"

#include "near_names.h"
#include "tweend/json_print.h"

#include <math.h>
#include <string.h>

/* More than any route has. */
enum { PARAMETERS_MAX = 64 };

bool api_is_unreserved(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
         (c && strchr("-._~", c));
}

int api_hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

void api_path_normalize(char *path) {
  char *out = path;
  for (; *path; path++) {
    int high = *path == '%' ? api_hex_digit(path[1]) : -1, low = high >= 0 ? api_hex_digit(path[2]) : -1;
    bool is_needless = low >= 0 && api_is_unreserved((char)(high * 16 + low));
    *out++ = (char)(is_needless ? high * 16 + low : *path);
    path += is_needless ? 2 : 0;
  }
  *out = '\0';
}

/* Decodes text[0..length) into the arena. */
static tw_status decode(const char *text, size_t length, tw_arena *arena, const char **out, tw_error *error) {
  char *decoded = tw_arena_alloc(arena, length + 1, 1);
  if (!decoded) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  size_t size = 0;
  for (size_t i = 0; i < length; i++) {
    char c = (char)(text[i] == '+' ? ' ' : text[i]);
    if (c == '%') {
      int high = length - i > 2 ? api_hex_digit(text[i + 1]) : -1;
      int low = length - i > 2 ? api_hex_digit(text[i + 2]) : -1;
      if (high < 0 || low < 0) return tw_fail(error, TW_SYNTAX, "the query has a '%%' that is no escape");
      c = (char)(high * 16 + low);
      i += 2;
    }
    decoded[size++] = c;
  }
  if (!tw_utf8_is_name(decoded, size))
    return tw_fail(error, TW_SYNTAX, "the query is not UTF-8 text, or holds control characters");
  *out = decoded;
  return TW_OK;
}

static tw_status add(api_parameter *parameters, size_t *count, api_parameter fresh, tw_error *error) {
  for (size_t i = 0; i < *count; i++)
    if (strcmp(parameters[i].name, fresh.name) == 0)
      return tw_fail(error, TW_SYNTAX, "parameter \"%s\" is given twice", fresh.name);
  if (*count == PARAMETERS_MAX) return tw_fail(error, TW_SYNTAX, "too many parameters");
  parameters[(*count)++] = fresh;
  return TW_OK;
}

tw_status api_query_read(const char *text, tw_arena *arena, api_query *out, tw_error *error) {
  size_t room = 1; /* most queries are short */
  for (const char *c = text; *c && room < PARAMETERS_MAX; c++) room += *c == '&';
  api_parameter *parameters = tw_arena_alloc(arena, room, sizeof *parameters);
  if (!parameters) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  size_t count = 0;
  while (*text) {
    size_t length = strcspn(text, "&");
    const char *equals = memchr(text, '=', length);
    size_t name_length = equals ? (size_t)(equals - text) : length;
    size_t value_start = equals ? name_length + 1 : length;
    if (length > 0) {
      api_parameter fresh = {"", ""};
      tw_status status = decode(text, name_length, arena, &fresh.name, error);
      if (status == TW_OK)
        status = decode(text + value_start, length - value_start, arena, &fresh.value, error);
      if (status == TW_OK) status = add(parameters, &count, fresh, error);
      if (status != TW_OK) return status;
    }
    text += length;
    if (*text == '&') text++;
  }
  *out = (api_query){count, parameters};
  return TW_OK;
}

const char *api_query_get(const api_query *query, const char *name) {
  for (size_t i = 0; i < query->count; i++)
    if (strcmp(query->parameters[i].name, name) == 0) return query->parameters[i].value;
  return NULL;
}

tw_status api_query_count(const api_query *query, const char *name, uint64_t *out, tw_error *error) {
  const char *text = api_query_get(query, name);
  if (!text) return TW_OK;
  size_t digits = strspn(text, "0123456789");
  if (digits == 0 || text[digits] != '\0')
    return tw_fail(error, TW_SYNTAX, "%s=%.60s: a whole number of 0 or more is expected", name, text);
  if (digits > 18) return tw_fail(error, TW_SYNTAX, "%s=%.60s: more than 18 digits", name, text);
  uint64_t value = 0;
  for (size_t i = 0; i < digits; i++) value = value * 10 + (uint64_t)(text[i] - '0');
  *out = value;
  return TW_OK;
}

bool api_number_read(const char *text, size_t length, double *out) {
  double value;
  size_t used = tw_read_double(text, length, &value);
  if (used == 0 || used != length || !isfinite(value)) return false;
  *out = value;
  return true;
}

tw_status api_query_number(const api_query *query, const char *name, double *out, tw_error *error) {
  const char *text = api_query_get(query, name);
  if (text && !api_number_read(text, strlen(text), out))
    return tw_fail(error, TW_SYNTAX, "%s=%.60s: a number is expected", name, text);
  return TW_OK;
}

tw_status api_query_flag(const api_query *query, const char *name, bool *out, tw_error *error) {
  static const char *const choices[] = {"false", "true", NULL};
  int choice = *out;
  tw_status status = api_query_choice(query, name, choices, &choice, error);
  *out = choice == 1;
  return status;
}

tw_status api_query_choice(const api_query *query, const char *name, const char *const *choices, int *out,
                           tw_error *error) {
  const char *text = api_query_get(query, name);
  if (!text) return TW_OK;
  for (int i = 0; choices[i]; i++) {
    if (strcmp(text, choices[i]) != 0) continue;
    *out = i;
    return TW_OK;
  }
  char list[200];
  tw_names_join(choices, list, sizeof list);
  return tw_fail(error, TW_SYNTAX, "%s=%.60s:%s expected one of %s", name, text,
                 api_near_of(text, choices).text, list);
}
