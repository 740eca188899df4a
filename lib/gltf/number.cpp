// Numbers as text by Dragonbox, std::to_chars and std::from_chars: shortest round trip, no locale.
#include "tweend/base.h"

#include <dragonbox/dragonbox.h>

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

// Between these magnitudes std::to_chars never writes an exponent, because that would be longer, and every
// whole number is exact. There the digits come from Dragonbox, which finds the same ones in less than half
// the time; anything else is rare in a pose.
constexpr float PLAIN_LEAST = 1e-3F;
constexpr float PLAIN_LIMIT = 1e5F;

// The most that such a number has: nine digits, the first of them in the third place.
constexpr int DECIMALS_MAX = 12;
constexpr uint64_t POWERS[DECIMALS_MAX + 1] = {1,           10,           100,          1000,      10000,
                                               100000,      1000000,      10000000,     100000000, 1000000000,
                                               10000000000, 100000000000, 1000000000000};

void put_pair(char *out, uint32_t value) {
  static const char pairs[] = "0001020304050607080910111213141516171819202122232425262728293031323334"
                              "3536373839404142434445464748495051525354555657585960616263646566676869"
                              "707172737475767778798081828384858687888990919293949596979899";
  std::memcpy(out, pairs + 2 * size_t{value}, 2);
}

void put_four(char *out, uint32_t value) {
  put_pair(out, value / 100);
  put_pair(out + 2, value % 100);
}

// decimals of 10^-12, all of them, with the zeros in front.
void put_decimals(char *out, uint64_t decimals) {
  uint32_t last = static_cast<uint32_t>(decimals % 100000000);
  put_four(out, static_cast<uint32_t>(decimals / 100000000));
  put_four(out + 4, last / 10000);
  put_four(out + 8, last % 10000);
}

// magnitude: in [PLAIN_LEAST, PLAIN_LIMIT). Returns the end; up to DECIMALS_MAX bytes behind it are written.
char *print_plain(char *out, float magnitude) {
  namespace policy = jkj::dragonbox::policy;
  auto number = jkj::dragonbox::to_decimal(magnitude, policy::sign::ignore, policy::trailing_zero::ignore);
  int places = number.exponent < 0 ? -number.exponent : 0;
  uint64_t scale = POWERS[places];
  uint64_t digits = number.exponent < 0 ? number.significand : number.significand * POWERS[number.exponent];
  uint64_t whole = digits / scale;
  uint64_t decimals = digits - whole * scale;
  if (whole < 10)
    *out++ = static_cast<char>('0' + whole);
  else
    out = std::to_chars(out, out + TW_NUMBER_TEXT, whole).ptr;
  if (decimals == 0) return out;
  *out++ = '.';
  put_decimals(out, decimals * POWERS[DECIMALS_MAX - places]);
  out += places;
  while (out[-1] == '0') out--;
  return out;
}

char *print_float(char *out, float value) {
  float magnitude = std::fabs(value);
  if (!(magnitude >= PLAIN_LEAST && magnitude < PLAIN_LIMIT)) return out + print(out, value);
  if (value < 0) *out++ = '-';
  return print_plain(out, magnitude);
}

} // namespace

size_t tw_print_float(char *out, float value) {
  return static_cast<size_t>(print_float(out, value) - out);
}

size_t tw_print_floats(char *out, const float *values, size_t count) {
  char *end = out;
  for (size_t i = 0; i < count; i++) {
    if (i > 0) *end++ = ',';
    // Most of a pose's translations and scales.
    if (values[i] == 0 || values[i] == 1)
      *end++ = values[i] == 0 ? '0' : '1';
    else
      end = print_float(end, values[i]);
  }
  return static_cast<size_t>(end - out);
}

size_t tw_print_double(char *out, double value) {
  return print(out, value);
}

size_t tw_read_double(const char *text, size_t length, double *out) {
  const char *end = text + length;
  const char *start = text;
  if (start < end && *start == '+') start++;
  const char *digits = start;
  if (digits < end && *digits == '-' && start == text) digits++;
  // from_chars also takes "inf" and "nan"; a number begins with a digit or a point.
  if (digits == end || !((*digits >= '0' && *digits <= '9') || *digits == '.')) return 0;
  double value = 0;
  std::from_chars_result result = std::from_chars(start, end, value);
  if (result.ec == std::errc::invalid_argument) return 0;
  if (result.ec == std::errc::result_out_of_range) {
    // Overflow and underflow share this code; a negative exponent tells them apart.
    const void *exponent = std::memchr(start, 'e', static_cast<size_t>(result.ptr - start));
    if (!exponent) exponent = std::memchr(start, 'E', static_cast<size_t>(result.ptr - start));
    const char *sign = static_cast<const char *>(exponent);
    bool tiny = sign ? sign[1] == '-' : *digits == '0' || *digits == '.';
    value = tiny ? 0 : std::numeric_limits<double>::infinity();
    if (*start == '-') value = -value;
  }
  *out = value;
  return static_cast<size_t>(result.ptr - text);
}
