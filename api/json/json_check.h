/* The guard before cJSON: everything that cJSON lets through and RFC 8259 does not. */
#ifndef API_JSON_CHECK_H
#define API_JSON_CHECK_H

#include "tweend/base.h"

enum { API_JSON_DEPTH_MAX = 64 };

/* Checks one JSON document: grammar, well-formed UTF-8, no control characters, no U+0000 in strings
 * (texts are terminated from here on), numbers within a double's range, depth, and at most max_values
 * values of any kind. TW_SYNTAX, TW_INVALID (a number too large) or TW_LIMIT (too many values), with the
 * pointer of the value at fault, and line and column in the detail. O(size), no allocation. */
tw_status api_json_check(const char *text, size_t size, uint64_t max_values, tw_error *error);

#endif
