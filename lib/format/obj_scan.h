/* Walking through OBJ text: blanks, line ends, continuation, numbers. Knows no statement. What every
 * character of a large file passes through is inline. */
#ifndef TWEEND_OBJ_SCAN_H
#define TWEEND_OBJ_SCAN_H

#include "tweend/base.h"

/* Lines end with LF, CRLF or a lone CR; a backslash just before a line end is a blank. */
typedef struct obj_text {
  const uint8_t *at, *end;
  uint64_t line; /* of `at`, from 1 */
} obj_text;

/* A piece of the text. */
typedef struct obj_word {
  const char *text;
  size_t length;
} obj_word;

static inline bool obj_is_line_end(uint8_t c) {
  return c == '\n' || c == '\r';
}

/* Bytes of the line end at `at`: 2 for CRLF. */
static inline size_t obj_line_end_length(const uint8_t *at, const uint8_t *end) {
  return at[0] == '\r' && end - at > 1 && at[1] == '\n' ? 2 : 1;
}

/* Moves over spaces, tabs and continuations. */
static inline void obj_skip_blanks(obj_text *text) {
  const uint8_t *at = text->at, *end = text->end;
  for (; at < end; at++) {
    if (*at == ' ' || *at == '\t') continue;
    if (*at != '\\' || end - at < 2 || !obj_is_line_end(at[1])) break;
    at += obj_line_end_length(at + 1, end);
    text->line++;
  }
  text->at = at;
}

/* After blanks: nothing more in this statement (a comment counts as nothing). */
static inline bool obj_statement_ends(obj_text *text) {
  obj_skip_blanks(text);
  return text->at == text->end || obj_is_line_end(*text->at) || *text->at == '#';
}

static inline obj_text obj_text_of(obj_word word) {
  const uint8_t *start = (const uint8_t *)word.text;
  return (obj_text){start, start + word.length, 0};
}

/* Moves to the beginning of the next line; a statement's continuation lines belong to it. */
void obj_next_statement(obj_text *text);

/* As obj_next_statement, for comments, which do not continue: a path may end with a backslash. */
void obj_next_line(obj_text *text);

/* The characters up to the next blank or line end. */
obj_word obj_read_word(obj_text *text);

/* The rest of the line without blanks at its ends. */
obj_word obj_read_rest(obj_text *text);

/* The words up to the end of the statement as one piece of the text, continued lines and all. */
obj_word obj_read_words(obj_text *text);

/* A number that ends at a blank, line end or comment. False, without moving, when there is none. */
bool obj_read_number(obj_text *text, double *out);

static inline bool obj_is_digit(uint8_t c) {
  return (uint8_t)(c - '0') < 10;
}

/* A decimal integer, at most 18 digits, that ends where its digits do. False when there is none. */
static inline bool obj_read_integer(obj_text *text, int64_t *out) {
  const uint8_t *at = text->at, *end = text->end;
  bool negative = at < end && *at == '-';
  if (at < end && (*at == '-' || *at == '+')) at++;
  const uint8_t *start = at;
  int64_t value = 0;
  while (at < end && obj_is_digit(*at) && at - start < 18) value = value * 10 + (*at++ - '0');
  if (at == start || (at < end && obj_is_digit(*at))) return false;
  *out = negative ? -value : value;
  text->at = at;
  return true;
}

bool obj_word_is(obj_word word, const char *text);

#endif
