/* Answers: headers and bodies. An answer's memory is one arena. */
#ifndef API_ANSWER_H
#define API_ANSWER_H

#include "api.h"
#include "tweend/base.h"
#include "tweend/json_print.h"

/* Moves the text into the arena, terminated, and empties it; NULL without memory. */
const char *api_text_move(tw_text *text, tw_arena *arena);

/* Adds a header; the value must live as long as the answer. */
void api_answer_header(api_answer *answer, const char *name, const char *value);
/* Adds a header with a copy of the value; the header is left out without memory. */
void api_answer_header_copy(api_answer *answer, const char *name, const char *value);
/* The value of a header, NULL without it. */
const char *api_answer_find(const api_answer *answer, const char *name);
/* Adds a header with a formatted value of under 512 bytes; left out without memory. */
void api_answer_headerf(api_answer *answer, const char *name, const char *format, ...) TW_PRINTF(3, 4);

/* Sets status, type and a text, which the answer takes over. A failed text becomes an empty 503. */
void api_answer_text(api_answer *answer, int status, const char *type, tw_text *text);

#endif
