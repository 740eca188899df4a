/* Answers: headers and text bodies. */
#include "answer.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void api_answer_deinit(api_answer *answer) {
  if (answer->body.destroy) answer->body.destroy(answer->body.context);
  if (answer->live.destroy) answer->live.destroy(answer->live.context);
  free((void *)answer->bytes.data);
  tw_arena_destroy(answer->memory);
  *answer = (api_answer){0};
}

const char *api_text_move(tw_text *text, tw_arena *arena) {
  const char *kept = text->failed ? NULL : tw_arena_text(arena, text->data, text->size);
  tw_text_deinit(text);
  return kept;
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

static void add_copy(api_answer *answer, const char *name, const char *value, size_t length) {
  char *copy = answer->memory ? tw_arena_text(answer->memory, value, length) : NULL;
  if (copy) api_answer_header(answer, name, copy);
}

void api_answer_header_copy(api_answer *answer, const char *name, const char *value) {
  add_copy(answer, name, value, strlen(value));
}

void api_answer_headerf(api_answer *answer, const char *name, const char *format, ...) {
  char value[512];
  va_list arguments;
  va_start(arguments, format);
  int length = vsnprintf(value, sizeof value, format, arguments);
  va_end(arguments);
  assert(length >= 0 && (size_t)length < sizeof value);
  add_copy(answer, name, value, (size_t)length);
}

void api_answer_text(api_answer *answer, int status, const char *type, tw_text *text) {
  if (text->failed) {
    tw_text_deinit(text);
    answer->status = 503;
    answer->header_count = 0; /* the failed answer's headers would let this one be cached */
    api_answer_header(answer, "Retry-After", "1");
    return;
  }
  answer->status = status;
  api_answer_header(answer, "Content-Type", type);
  answer->bytes = (api_bytes){(const uint8_t *)text->data, text->size};
  *text = (tw_text){0};
}
