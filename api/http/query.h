/* Query strings, read strictly: repeated or undecodable parameters are errors. */
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

/* text: as on the wire, without '?'. TW_SYNTAX: a bad escape, or a repeated name. A '+' is a space, as forms
 * send it. */
tw_status api_query_read(const char *text, tw_arena *arena, api_query *out, tw_error *error);

/* The value, or NULL when the parameter is absent. */
const char *api_query_get(const api_query *query, const char *name);

/* These leave *out alone when the parameter is absent. TW_SYNTAX for a value of another kind. */

/* A whole number of at most 18 digits. */
tw_status api_query_count(const api_query *query, const char *name, uint64_t *out, tw_error *error);
/* A finite number. */
tw_status api_query_number(const api_query *query, const char *name, double *out, tw_error *error);
/* "true" or "false". */
tw_status api_query_flag(const api_query *query, const char *name, bool *out, tw_error *error);
/* One of `choices` (NULL-terminated): its index. */
tw_status api_query_choice(const api_query *query, const char *name, const char *const *choices, int *out,
                           tw_error *error);

/* Whether a character needs no escape in URLs (RFC 3986, section 2.3). */
bool api_is_unreserved(char c);
/* The value of a hex digit, or -1. */
int api_hex_digit(char c);

/* Reads a finite number that takes up all of text[0..length); else false. */
bool api_number_read(const char *text, size_t length, double *out);

#endif
