/* UTF-8 by the table of RFC 3629, section 4. */
#include "utf8.h"

#include <stdint.h>

/* Bytes of the sequence at text, 0 when it is ill-formed or a control character. */
static size_t sequence_length(const unsigned char *text, size_t left) {
  unsigned char lead = text[0];
  if (lead < 0x80) return lead >= 0x20 && lead != 0x7F ? 1 : 0;
  size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || left < length) return 0;
  /* The second byte rules out overlong forms, surrogates and values over U+10FFFF. */
  unsigned char low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
  unsigned char high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
  if (text[1] < low || text[1] > high) return 0;
  for (size_t i = 2; i < length; i++)
    if ((text[i] & 0xC0) != 0x80) return 0;
  return length;
}

bool tw_utf8_is_name(const char *text, size_t length) {
  const unsigned char *bytes = (const unsigned char *)text;
  for (size_t i = 0; i < length;) {
    size_t step = sequence_length(bytes + i, length - i);
    if (step == 0) return false;
    i += step;
  }
  return true;
}
