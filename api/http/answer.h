/* Answers: their headers, bodies, validators and ranges. An answer's memory is one arena. */
#ifndef API_ANSWER_H
#define API_ANSWER_H

#include "api.h"
#include "json_out.h"
#include "tweend/base.h"

/* The arena that lives as long as the answer; NULL without memory. */
tw_arena *api_answer_arena(const api_answer *answer);

/* Adds a header; the value must live as long as the answer. */
void api_answer_header(api_answer *answer, const char *name, const char *value);
/* The value of a header, NULL when the answer does not bear it. */
const char *api_answer_find(const api_answer *answer, const char *name);
/* Adds a printed header; lost without memory. */
void api_answer_headerf(api_answer *answer, const char *name, const char *format, ...) TW_PRINTF(3, 4);

/* Status, type and a text that the answer takes over (an incomplete one becomes an empty 503). */
void api_answer_text(api_answer *answer, int status, const char *type, api_text *text);

/* A part of the representation. */
typedef struct api_range {
  uint64_t first, count;
} api_range;

typedef enum api_range_kind {
  API_RANGE_ALL,          /* no range, or one that may be ignored */
  API_RANGE_PART,         /* 206 */
  API_RANGE_UNSATISFIABLE /* 416 */
} api_range_kind;

/* Reads a Range header (RFC 9110, section 14) for a representation of `size` bytes. text: NULL
 * allowed. Several ranges at once count as none. */
api_range_kind api_range_read(const char *text, uint64_t size, api_range *out);

/* Whether the list of an If-None-Match or If-Match header holds the tag, or is "*".
 * weak: W/ before a listed tag does not matter. */
bool api_etag_matches(const char *list, const char *etag, bool weak);

#endif
