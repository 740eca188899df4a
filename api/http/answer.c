/* Answers: headers, text bodies, and the matching of ranges and entity tags (RFC 9110). */
#include "answer.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

tw_arena *api_answer_arena(const api_answer *answer) {
  return answer->memory;
}

void api_answer_deinit(api_answer *answer) {
  if (answer->body.destroy) answer->body.destroy(answer->body.context);
  if (answer->live.destroy) answer->live.destroy(answer->live.context);
  free((void *)answer->bytes.data);
  tw_arena_destroy(answer->memory);
  *answer = (api_answer){0};
}

void api_answer_header(api_answer *answer, const char *name, const char *value) {
  assert(answer->header_count < API_HEADERS_MAX);
  answer->headers[answer->header_count++] = (api_header){name, value};
}

const char *api_answer_find(const api_answer *answer, const char *name) {
  for (size_t i = 0; i < answer->header_count; i++)
    if (strcmp(answer->headers[i].name, name) == 0) return answer->headers[i].value;
  return NULL;
}

void api_answer_headerf(api_answer *answer, const char *name, const char *format, ...) {
  char value[512];
  va_list arguments;
  va_start(arguments, format);
  int length = vsnprintf(value, sizeof value, format, arguments);
  va_end(arguments);
  assert(length >= 0 && (size_t)length < sizeof value);
  char *copy = answer->memory ? tw_arena_text(answer->memory, value, (size_t)length) : NULL;
  if (copy) api_answer_header(answer, name, copy);
}

void api_answer_text(api_answer *answer, int status, const char *type, api_text *text) {
  if (text->failed) {
    api_text_deinit(text);
    answer->status = 503;
    answer->header_count = 0; /* those of the answer that did not come about would let it be cached */
    api_answer_header(answer, "Retry-After", "1");
    return;
  }
  answer->status = status;
  api_answer_header(answer, "Content-Type", type);
  answer->bytes = (api_bytes){(const uint8_t *)text->data, text->size};
  *text = (api_text){0};
}

/* Digits to a number; false when there are none or too many. *text moves behind them. */
static bool read_position(const char **text, uint64_t *out) {
  uint64_t value = 0;
  size_t digits = 0;
  for (; **text >= '0' && **text <= '9'; (*text)++, digits++) {
    if (digits == 18) return false;
    value = value * 10 + (uint64_t)(**text - '0');
  }
  *out = value;
  return digits > 0;
}

api_range_kind api_range_read(const char *text, uint64_t size, api_range *out) {
  if (!text || strncmp(text, "bytes=", 6) != 0) return API_RANGE_ALL;
  text += 6;
  uint64_t first = 0, last = 0;
  bool has_first = read_position(&text, &first);
  if (*text != '-') return API_RANGE_ALL;
  text++;
  bool has_last = read_position(&text, &last);
  if (*text != '\0' || (!has_first && !has_last)) return API_RANGE_ALL;
  if (has_first && has_last && last < first) return API_RANGE_ALL;
  if (!has_first) { /* the last `last` bytes */
    if (last == 0 || size == 0) return API_RANGE_UNSATISFIABLE;
    first = last < size ? size - last : 0;
    last = size - 1;
  }
  if (first >= size) return API_RANGE_UNSATISFIABLE;
  if (!has_last || last >= size) last = size - 1;
  *out = (api_range){first, last - first + 1};
  return API_RANGE_PART;
}

bool api_etag_matches(const char *list, const char *etag, bool weak) {
  size_t length = strlen(etag);
  while (*list) {
    list += strspn(list, ", \t");
    if (*list == '*') return true;
    bool is_weak = strncmp(list, "W/", 2) == 0;
    if (is_weak) list += 2;
    if (*list != '"') return false;
    size_t tag = strcspn(list + 1, "\"") + 2;
    if (tag == length && memcmp(list, etag, length) == 0 && (weak || !is_weak)) return true;
    if (list[tag - 1] != '"') return false;
    list += tag;
  }
  return false;
}
