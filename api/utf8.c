/* UTF-8 by the table of RFC 3629, section 4. */
#include "utf8.h"

static bool is_within(unsigned char byte, unsigned char low, unsigned char high) {
  return byte >= low && byte <= high;
}

size_t api_utf8_width(const char *text, size_t length) {
  const unsigned char *bytes = (const unsigned char *)text;
  if (length == 0) return 0;
  unsigned char lead = bytes[0];
  if (lead < 0x80) return 1;
  size_t width = is_within(lead, 0xC2, 0xDF) ? 2 : is_within(lead, 0xE0, 0xEF) ? 3 : 4;
  if (lead < 0xC2 || lead > 0xF4 || length < width) return 0;
  /* The second byte bears the limits that rule out overlong forms and surrogates. */
  unsigned char low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
  unsigned char high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
  if (!is_within(bytes[1], low, high)) return 0;
  for (size_t i = 2; i < width; i++)
    if (!is_within(bytes[i], 0x80, 0xBF)) return 0;
  return width;
}

bool api_utf8_is_plain(const char *text, size_t length) {
  for (size_t i = 0; i < length;) {
    size_t width = api_utf8_width(text + i, length - i);
    unsigned char byte = (unsigned char)text[i];
    if (width == 0 || byte < 0x20 || byte == 0x7F) return false;
    i += width;
  }
  return true;
}
