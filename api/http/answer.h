/* Answers: their headers and bodies. An answer's memory is one arena. */
#ifndef API_ANSWER_H
#define API_ANSWER_H

#include "api.h"
#include "tweend/base.h"
#include "tweend/json_print.h"

/* The text in the arena, terminated; NULL without memory. Empties the text. */
const char *api_text_keep(tw_text *text, tw_arena *arena);

/* Adds a header; the value must live as long as the answer. */
void api_answer_header(api_answer *answer, const char *name, const char *value);
/* The same with a copy of the value; lost without memory. */
void api_answer_header_copy(api_answer *answer, const char *name, const char *value);
/* The value of a header, NULL when the answer does not bear it. */
const char *api_answer_find(const api_answer *answer, const char *name);
/* Adds a printed header; lost without memory. */
void api_answer_headerf(api_answer *answer, const char *name, const char *format, ...) TW_PRINTF(3, 4);

/* Status, type and a text that the answer takes over (an incomplete one becomes an empty 503). */
void api_answer_text(api_answer *answer, int status, const char *type, tw_text *text);

#endif
