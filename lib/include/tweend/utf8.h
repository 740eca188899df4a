/* UTF-8 as names and documents must be. */
#ifndef TWEEND_UTF8_H
#define TWEEND_UTF8_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Bytes of the character at the start of text[0..length), 0 when it is not well-formed (RFC 3629: no
 * overlong forms, no surrogates, nothing over U+10FFFF) or length is 0. */
size_t tw_utf8_length(const char *text, size_t length);

/* Well-formed UTF-8 without control characters. */
bool tw_utf8_is_name(const char *text, size_t length);

#ifdef __cplusplus
}
#endif
#endif
