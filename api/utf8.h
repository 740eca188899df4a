/* Well-formed UTF-8 (RFC 3629: no overlong forms, no surrogates, nothing over U+10FFFF). */
#ifndef API_UTF8_H
#define API_UTF8_H

#include <stdbool.h>
#include <stddef.h>

/* Bytes of the character at the start of text[0..length), 0 when there is none. */
size_t api_utf8_width(const char *text, size_t length);

/* Whether all of it is UTF-8 without control characters. */
bool api_utf8_is_plain(const char *text, size_t length);

#endif
