/* JSON in tests is written with ' for ", which C would have to escape. */
#ifndef QUOTES_H
#define QUOTES_H

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

/* A copy, freed by the caller. */
static inline char *quoted(const char *text) {
  char *copy = strdup(text);
  assert_non_null(copy);
  return quote(copy);
}

#endif
