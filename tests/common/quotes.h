/* JSON text in tests uses ' in place of ", which C would have to escape. */
#ifndef QUOTES_H
#define QUOTES_H

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"

/* Replaces each ' by ", in place; returns the bytes. */
static inline void *quote_bytes(void *bytes, size_t size) {
  for (char *c = bytes, *end = c + size; c < end; c++)
    if (*c == '\'') *c = '"';
  return bytes;
}

static inline char *quote(char *text) {
  return quote_bytes(text, strlen(text));
}

/* The reverse: replaces each " by '. */
static inline char *unquote(char *text) {
  for (char *c = text; *c; c++)
    if (*c == '"') *c = '\'';
  return text;
}

/* A copy of the text with ' replaced by "; the caller frees it. */
static inline char *quoted(const char *text) {
  char *copy = strdup(text);
  assert_non_null(copy);
  return quote(copy);
}

/* Whether the text contains `wanted`, written with ' in place of ". */
static inline bool says(const char *text, const char *wanted) {
  char *copy = quoted(wanted);
  bool found = strstr(text, copy) != NULL;
  free(copy);
  return found;
}

#endif
