/* Pieces of header values: lists, parameters, quoted strings (RFC 9110, section 5.6). */
#ifndef API_HEADER_TEXT_H
#define API_HEADER_TEXT_H

#include <stdbool.h>
#include <stddef.h>

/* A view, not terminated. */
typedef struct api_span {
  const char *text;
  size_t length;
} api_span;

/* Of terminated text, without blanks round it. */
api_span api_span_of(const char *text);

/* Cuts off what stands before the next `separator` outside quotes, without blanks round it; *rest
 * moves behind the separator. */
api_span api_span_cut(api_span *rest, char separator);

/* Equal to, or beginning with, a text of any case. */
bool api_span_is(api_span s, const char *text);
bool api_span_starts(api_span s, const char *text);

#endif
