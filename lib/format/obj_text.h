/* The text of an OBJ file: its statements one after the other, and the words and numbers of one. */
#ifndef TWEEND_OBJ_TEXT_H
#define TWEEND_OBJ_TEXT_H

#include "word.h"

/* The beginning of a word for a sentence: printable characters, all others as question marks. */
typedef struct tw_obj_quote {
  char text[44];
} tw_obj_quote;

tw_obj_quote tw_obj_quote_word(tw_word word);

/* Lines end with LF, CRLF or a lone CR; a backslash just before a line end is a blank. */
typedef struct tw_obj_text {
  const uint8_t *at, *end;
  uint64_t line;        /* of `at`, from 1 */
  const uint8_t *first; /* of the file; NULL for names */
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

/* Moves behind the first word of the next statement. False at the end of the file. */
bool tw_obj_next_statement(tw_obj_text *file, tw_word *word);

/* Moves to the line end of the statement, or of the last line that continues it: the same one from wherever
 * in the statement, before a comment, `at` is. */
void tw_obj_end_statement(tw_obj_text *file);

/* The text from `at` to where the statement ends: for what reads comments, or into the next line. */
tw_obj_text tw_obj_statement(const tw_obj_text *file);

/* ---- the rest takes the text of a file, a statement or a name, and stays in one statement
 * -------------------- */

/* At a backslash: moves over it, when it continues the line, and over what tw_obj_skip_blanks goes over. */
void tw_obj_skip_continuations(tw_obj_text *text);

/* Moves over blanks and continuations. */
static inline void tw_obj_skip_blanks(tw_obj_text *text) {
  const uint8_t *at = text->at, *end = text->end;
  while (at < end && tw_obj_is_blank(*at)) at++;
  text->at = at;
  if (at < end && *at == '\\') tw_obj_skip_continuations(text);
}

/* After blanks: nothing more in this statement (a comment counts as nothing). */
static inline bool tw_obj_statement_ends(tw_obj_text *text) {
  tw_obj_skip_blanks(text);
  return text->at == text->end || *text->at == '#' || tw_obj_is_line_end(*text->at);
}

/* The characters up to the next blank or line end. */
tw_word tw_obj_read_word(tw_obj_text *text);

/* The rest of the line, whatever it is, without blanks at its ends: a name, which no line continues. */
tw_word tw_obj_read_line(tw_obj_text *text);

/* How many are left; moves over them. */
uint64_t tw_obj_count_words(tw_obj_text *text);

/* A number that ends at a blank or comment. False, without moving, when there is none. */
bool tw_obj_read_number(tw_obj_text *text, double *out);

/* A decimal integer, at most 18 digits, that ends where its digits do. False when there is none. */
bool tw_obj_read_integer(tw_obj_text *text, int64_t *out);

static inline bool tw_obj_take_slash(tw_obj_text *text) {
  if (text->at == text->end || *text->at != '/') return false;
  text->at++;
  return true;
}

/* The word round `at` is not what is expected there: TW_SYNTAX, with line and column. */
tw_status tw_obj_fail_word(const tw_obj_text *text, const char *what, tw_error *error);

tw_obj_text tw_obj_text_of(tw_word word);

/* The first word of a name, which goes from it; of length 0 at its end. */
tw_word tw_obj_cut_word(tw_word *name);

#endif
