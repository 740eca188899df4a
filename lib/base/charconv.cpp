// Single numbers as text by std::to_chars and std::from_chars: shortest round trip, no locale. Rows of floats
// are printed by base/number.c.
#include "number.h"
#include "tweend/base.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <system_error>

namespace {

template <typename Number> size_t print(char *out, Number value) {
  if (!std::isfinite(value)) {
    std::memcpy(out, "null", 4);
    return 4;
  }
  if (value == 0) value = 0; // no -0
  return static_cast<size_t>(std::to_chars(out, out + TW_NUMBER_TEXT, value).ptr - out);
}

// Whether a number whose magnitude is no double is too small, not too large: its first digit that is not 0
// stands for a negative power of ten. text: without a sign.
bool is_too_small(const char *text, const char *end) {
  int64_t power = 0;
  int exponent = 0; // no text is so long that one beyond does not decide
  bool has_begun = false, is_fraction = false;
  const char *at = text;
  for (; at < end && (tw_is_digit(*at) || *at == '.'); at++) {
    is_fraction |= *at == '.';
    if (*at == '.') continue;
    has_begun |= *at != '0';
    power += has_begun && !is_fraction;
    power -= !has_begun && is_fraction;
  }
  if (at == end) return power <= 0;
  at++; // the e
  bool is_negative = *at == '-';
  if (*at == '+') at++;
  if (std::from_chars(at, end, exponent).ec == std::errc::result_out_of_range) return is_negative;
  return power + exponent <= 0;
}

} // namespace

size_t tw_print_float(char *out, float value) {
  return print(out, value);
}

size_t tw_print_double(char *out, double value) {
  return print(out, value);
}

size_t tw_read_double(const char *text, size_t length, double *out) {
  size_t plain = tw_read_plain(text, length, out);
  if (plain > 0) return plain;
  const char *end = text + length;
  const char *start = text;
  if (start < end && *start == '+') start++;
  const char *digits = start;
  if (digits < end && *digits == '-' && start == text) digits++;
  // from_chars also takes "inf" and "nan"; a number begins with a digit or a point.
  if (digits == end || !(tw_is_digit(*digits) || *digits == '.')) return 0;
  double value = 0;
  std::from_chars_result result = std::from_chars(start, end, value);
  if (result.ec == std::errc::invalid_argument) return 0;
  if (result.ec == std::errc::result_out_of_range) { // of overflow and of underflow
    value = is_too_small(digits, result.ptr) ? 0 : std::numeric_limits<double>::infinity();
    if (*start == '-') value = -value;
  }
  *out = value;
  return static_cast<size_t>(result.ptr - text);
}
