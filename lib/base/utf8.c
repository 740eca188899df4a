/* UTF-8 by the table of RFC 3629, section 4. */
#include "tweend/utf8.h"

size_t tw_utf8_length(const char *text, size_t length) {
  const unsigned char *bytes = (const unsigned char *)text;
  if (length == 0) return 0;
  unsigned char lead = bytes[0];
  if (lead < 0x80) return 1;
  size_t count = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || length < count) return 0;
  /* The second byte rules out overlong forms, surrogates and values over U+10FFFF. */
  unsigned char low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
  unsigned char high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
  if (bytes[1] < low || bytes[1] > high) return 0;
  for (size_t i = 2; i < count; i++)
    if ((bytes[i] & 0xC0) != 0x80) return 0;
  return count;
}

bool tw_utf8_is_name(const char *text, size_t length) {
  for (size_t i = 0; i < length;) {
    unsigned char byte = (unsigned char)text[i];
    size_t count = tw_utf8_length(text + i, length - i);
    if (count == 0 || byte < 0x20 || byte == 0x7F) return false;
    i += count;
  }
  return true;
}
