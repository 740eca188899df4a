/* Reads the text of an OBJ file: its statements one after the other, and the words and numbers of a
 * statement. */
#ifndef TWEEND_OBJ_TEXT_H
#define TWEEND_OBJ_TEXT_H

#include "word.h"

/* The beginning of a word, for messages: bytes that are not printable ASCII become question marks. */
typedef struct tw_obj_quote {
  char text[44];
} tw_obj_quote;

tw_obj_quote tw_obj_quote_word(tw_word word);

/* Lines end with LF, CRLF or a lone CR; a backslash just before a line end is a blank. */
typedef struct tw_obj_text {
  const uint8_t *at, *end;
  uint64_t line;          /* of `at`, from 1 */
  const uint8_t *first;   /* the beginning of the file; NULL for names */
  const uint8_t *charged; /* up to here text has been charged as work; of a file only */
} tw_obj_text;

static inline bool tw_obj_is_line_end(uint8_t c) {
  return c == '\n' || c == '\r';
}

/* Control characters are blanks too: some exporters end lines or the file with a zero byte or Ctrl-Z. */
static inline bool tw_obj_is_blank(uint8_t c) {
  return c <= ' ' && !tw_obj_is_line_end(c);
}

/* ZBrush writes the colours of points as comments. */
#define TW_OBJ_COLORS "#MRGB"

/* Reads the first word of the next statement and moves behind it. Charges what the text takes, some lines at
 * a time. False at the end of the file, and where the result is no longer wanted (tw_work). */
bool tw_obj_next_statement(tw_obj_text *file, tw_word *word);

/* Moves to the line end that ends the statement, over all lines that continue it. Works from anywhere in the
 * statement before a comment. */
void tw_obj_end_statement(tw_obj_text *file);

/* The statement's text from `at` on, for readers that do not stop at comments, or need its end. */
tw_obj_text tw_obj_statement(const tw_obj_text *file);

/* ---- words and numbers. `text`: a file, a statement or a name; nothing here leaves the statement  */

/* At a backslash that continues the line: moves to the next line, and over its blanks and continuations.
 * Otherwise stays. */
void tw_obj_skip_continuations(tw_obj_text *text);

/* Moves over blanks and continuations. */
static inline void tw_obj_skip_blanks(tw_obj_text *text) {
  const uint8_t *at = text->at, *end = text->end;
  while (at < end && tw_obj_is_blank(*at)) at++;
  text->at = at;
  if (at < end && *at == '\\') tw_obj_skip_continuations(text);
}

/* Moves over blanks, then tells whether the statement ends; a comment ends it. */
static inline bool tw_obj_statement_ends(tw_obj_text *text) {
  tw_obj_skip_blanks(text);
  return text->at == text->end || *text->at == '#' || tw_obj_is_line_end(*text->at);
}

/* Moves over blanks and reads the characters up to the next blank or line end. */
tw_word tw_obj_read_word(tw_obj_text *text);

/* Reads a name: the rest of the line without blanks at its ends. In it, # begins no comment and a backslash
 * continues no line. */
tw_word tw_obj_read_line(tw_obj_text *text);

/* Counts the words left in the statement and moves behind them. */
uint64_t tw_obj_count_words(tw_obj_text *text);

/* Moves over blanks and reads a number that ends at a blank or comment. False if there is none. */
bool tw_obj_read_number(tw_obj_text *text, double *out);

/* Reads a decimal integer of at most 18 digits; any character may follow it. False, without moving, if there
 * is none. */
bool tw_obj_read_integer(tw_obj_text *text, int64_t *out);

static inline bool tw_obj_take_slash(tw_obj_text *text) {
  if (text->at == text->end || *text->at != '/') return false;
  text->at++;
  return true;
}

/* Fails with TW_SYNTAX, line and column, because the word around `at` is not a `what`. */
tw_status tw_obj_fail_word(const tw_obj_text *text, const char *what, tw_error *error);

tw_obj_text tw_obj_text_of(tw_word word);

/* The text behind a byte order mark. */
tw_obj_text tw_obj_text_of_file(const uint8_t *bytes, size_t size);

/* Removes the first word from a name and returns it; length 0 if none is left. */
tw_word tw_obj_cut_word(tw_word *name);

#endif
