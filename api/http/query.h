/* Query strings, read strictly: nothing unknown, nothing twice, nothing that does not decode. */
#ifndef API_QUERY_H
#define API_QUERY_H

#include "tweend/base.h"

typedef struct api_parameter {
  const char *name, *value; /* decoded UTF-8 without control characters */
} api_parameter;

/* A view into the arena it was read with. */
typedef struct api_query {
  size_t count;
  const api_parameter *parameters;
} api_query;

/* text: as on the wire, without '?'. known: NULL-terminated names; NULL: any may stand.
 * TW_SYNTAX: a bad escape, a name unknown or twice. A '+' is a space, as forms send it. */
tw_status api_query_read(const char *text, const char *const *known, tw_arena *arena, api_query *out,
                         tw_error *error);

/* The value, or NULL when the parameter is absent. */
const char *api_query_get(const api_query *query, const char *name);

/* Each leaves *out alone when the parameter is absent. TW_SYNTAX on a value of another kind. */

/* Digits. */
tw_status api_query_count(const api_query *query, const char *name, uint64_t *out, tw_error *error);
/* A finite number. */
tw_status api_query_number(const api_query *query, const char *name, double *out, tw_error *error);
/* "true" or "false". */
tw_status api_query_flag(const api_query *query, const char *name, bool *out, tw_error *error);
/* One of `choices` (NULL-terminated): its index. */
tw_status api_query_choice(const api_query *query, const char *name, const char *const *choices, int *out,
                           tw_error *error);

/* Whether a character stands for itself in URLs (RFC 3986, section 2.3). */
bool api_is_unreserved(char c);
/* The value of a hex digit, -1 where it is none. */
int api_hex_digit(char c);

/* Reads a finite number that is all of text[0..length); false otherwise. */
bool api_number_read(const char *text, size_t length, double *out);

#endif
