/* Pieces of header values. */
#include "header_text.h"

#include <string.h>
#include <strings.h>

static bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

static api_span trim(api_span s) {
  while (s.length > 0 && is_blank(s.text[0])) s = (api_span){s.text + 1, s.length - 1};
  while (s.length > 0 && is_blank(s.text[s.length - 1])) s.length--;
  return s;
}

api_span api_span_of(const char *text) {
  return trim((api_span){text, strlen(text)});
}

api_span api_span_cut(api_span *rest, char separator) {
  bool quoted = false;
  size_t i = 0;
  for (; i < rest->length; i++) {
    char c = rest->text[i];
    if (quoted && c == '\\' && i + 1 < rest->length) {
      i++;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == separator && !quoted) {
      break;
    }
  }
  api_span piece = {rest->text, i};
  size_t used = i < rest->length ? i + 1 : i;
  *rest = (api_span){rest->text + used, rest->length - used};
  return trim(piece);
}

bool api_span_is(api_span s, const char *text) {
  return s.length == strlen(text) && strncasecmp(s.text, text, s.length) == 0;
}

bool api_span_starts(api_span s, const char *text) {
  return s.length >= strlen(text) && strncasecmp(s.text, text, strlen(text)) == 0;
}
