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

/* ZBrush writes the colours of points as comments. */
#define TW_OBJ_COLORS "#MRGB"

/* The next statement of the file: its first word, and the text behind that up to its end. False at the end of
 * the file, where the statement is empty. */
bool tw_obj_next_statement(tw_obj_text *file, tw_word *word, tw_obj_text *statement);

/* ---- the rest takes the text of one statement, or of a name -------------------------------------------- */

/* Moves over blanks and continuations. */
void tw_obj_skip_blanks(tw_obj_text *text);

/* After blanks: nothing more in this statement (a comment counts as nothing). */
bool tw_obj_statement_ends(tw_obj_text *text);

/* The characters up to the next blank or line end. */
tw_word tw_obj_read_word(tw_obj_text *text);

/* The rest of the text without blanks at its ends. */
tw_word tw_obj_read_rest(tw_obj_text *text);

/* How many are left; moves over them. */
uint64_t tw_obj_count_words(tw_obj_text *text);

/* A number that ends at a blank or comment. False, without moving, when there is none. */
bool tw_obj_read_number(tw_obj_text *text, double *out);

/* A decimal integer, at most 18 digits, that ends where its digits do. False when there is none. */
bool tw_obj_read_integer(tw_obj_text *text, int64_t *out);

bool tw_obj_take_slash(tw_obj_text *text);

/* The word round `at` is not what is expected there: TW_SYNTAX, with line and column. */
tw_status tw_obj_fail_word(const tw_obj_text *text, const char *what, tw_error *error);

tw_obj_text tw_obj_text_of(tw_word word);

/* The first word of a name, which goes from it; of length 0 at its end. */
tw_word tw_obj_cut_word(tw_word *name);

#endif
