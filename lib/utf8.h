/* UTF-8 as names must be. */
#ifndef TWEEND_UTF8_H
#define TWEEND_UTF8_H

#include <stdbool.h>
#include <stddef.h>

/* Well-formed UTF-8 (RFC 3629) without control characters. */
bool tw_utf8_is_name(const char *text, size_t length);

#endif
