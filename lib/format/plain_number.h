/* Plain decimals, most of the numbers that files and queries hold. */
#ifndef TWEEND_PLAIN_NUMBER_H
#define TWEEND_PLAIN_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

static inline bool tw_is_digit(char c) {
  return c >= '0' && c <= '9';
}

/* Reads a number of up to 15 digits that text begins with: they and the power of ten are exact as doubles, so
 * that one division rounds correctly. Returns its length, 0 for anything else. */
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
  bool goes_on = at < end && (tw_is_digit(*at) || *at == 'e' || *at == 'E');
  if (count == 0 || count > 15 || goes_on) return 0;
  double value = (double)digits / powers[decimals];
  *out = negative ? -value : value;
  return (size_t)(at - text);
}

#endif
