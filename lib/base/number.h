/* Numbers as text: reading plain decimals, and the printer's variants for its tests. */
#ifndef TWEEND_NUMBER_H
#define TWEEND_NUMBER_H

#include <string.h>

#include "tweend/base.h"

#ifdef __cplusplus
extern "C" {
#endif

static inline bool tw_is_digit(char c) {
  return c >= '0' && c <= '9';
}

/* Reads a number of up to 15 digits from the start of text[0..length). Its digits and power of ten are exact
 * as doubles, so one division rounds correctly (Clinger 1990). Returns the bytes used; 0 for any other text,
 * such as a number with an exponent. */
static inline size_t tw_read_plain(const char *text, size_t length, double *out) {
  static const double powers[16] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                    1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const char *at = text, *end = text + length;
  bool negative = at < end && *at == '-';
  if (negative) at++;
  const char *start = at, *stop = end - at > 16 ? at + 16 : end; /* 15 digits and a point */
  uint64_t digits = 0;
  while (at < stop && tw_is_digit(*at)) digits = digits * 10 + (uint64_t)(*at++ - '0');
  size_t count = (size_t)(at - start), decimals = 0;
  if (at < stop && *at == '.') {
    const char *point = at++;
    while (at < stop && tw_is_digit(*at)) digits = digits * 10 + (uint64_t)(*at++ - '0');
    decimals = (size_t)(at - point) - 1;
    count += decimals;
  }
  bool continues = at < end && (tw_is_digit(*at) || *at == 'e' || *at == 'E');
  if (count == 0 || count > 15 || continues) return 0;
  double value = (double)digits / powers[decimals];
  *out = negative ? -value : value;
  return (size_t)(at - text);
}

/* Writes a whole number, at most 20 digits. Returns the end. */
static inline char *tw_print_count(char *out, uint64_t value) {
  char digits[20], *first = digits + sizeof digits;
  do {
    *--first = (char)('0' + value % 10);
    value /= 10;
  } while (value > 0);
  size_t length = (size_t)(digits + sizeof digits - first);
  memcpy(out, first, length);
  return out + length;
}

/* tw_print_vectors on one instruction set, with a comma after each vector. Returns the end. */
typedef char *tw_number_printer(char *out, const tw_vectors *vectors);

/* variant: 0 is the compiler's baseline, 1 is AVX2; NULL where the processor lacks it. All variants print the
 * same bytes. */
tw_number_printer *tw_number_printer_at(uint32_t variant);

#ifdef __cplusplus
}
#endif
#endif
