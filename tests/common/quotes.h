/* JSON in tests is written with ' for ", which C would have to escape. */
#ifndef QUOTES_H
#define QUOTES_H

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"

/* Turns each ' into ", in place; returns the bytes. */
static inline void *quote_bytes(void *bytes, size_t size) {
  for (char *c = bytes, *end = c + size; c < end; c++)
    if (*c == '\'') *c = '"';
  return bytes;
}

static inline char *quote(char *text) {
  return quote_bytes(text, strlen(text));
}

/* The way back. */
static inline char *unquote(char *text) {
  for (char *c = text; *c; c++)
    if (*c == '"') *c = '\'';
  return text;
}

/* A copy, freed by the caller. */
static inline char *quoted(const char *text) {
  char *copy = strdup(text);
  assert_non_null(copy);
  return quote(copy);
}

/* Whether `wanted`, with ' for ", stands in the text. */
static inline bool says(const char *text, const char *wanted) {
  char *copy = quoted(wanted);
  bool found = strstr(text, copy) != NULL;
  free(copy);
  return found;
}

#endif
