/* Walking through OBJ text: blanks, line ends, continuation, numbers. Knows no statement. */
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

/* Moves over spaces, tabs and continuations. */
void obj_skip_blanks(obj_text *text);

/* After blanks: nothing more in this statement (a comment counts as nothing). */
bool obj_statement_ends(obj_text *text);

/* Moves to the beginning of the next line; a statement's continuation lines belong to it. */
void obj_next_statement(obj_text *text);

/* As obj_next_statement, for comments, which do not continue: a path may end with a backslash. */
void obj_next_line(obj_text *text);

/* The characters up to the next blank or line end. */
obj_word obj_read_word(obj_text *text);

/* The rest of the line without blanks at its ends. */
obj_word obj_read_rest(obj_text *text);

/* A number that ends at a blank, line end or comment. False, without moving, when there is none. */
bool obj_read_number(obj_text *text, double *out);

/* A decimal integer, at most 18 digits, that ends where its digits do. False when there is none. */
bool obj_read_integer(obj_text *text, int64_t *out);

bool obj_word_is(obj_word word, const char *text);

#endif
