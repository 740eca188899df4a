// Numbers as text: shortest round trip, no locale. By std::to_chars and std::from_chars; floats of common
// magnitudes by Dragonbox where they have few digits, and without branches where they have many.
#include "tweend/base.h"

#include <dragonbox/dragonbox.h>

#include <array>
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

// ---- numbers with many digits ----
//
// What is sampled or multiplied has seven digits to nine, at random, and branches that depend on them are
// guessed wrong so often that it takes longer than all the arithmetic. In the plain range that is exact in 64
// bits: with m the 24 bits of the float and 10^k what gives it nine digits before the point, it stands for
// what lies between (2m - 1) 10^k and (2m + 1) 10^k, in units of 2^-unit. The shortest decimal in there is a
// multiple of the largest power of ten that has one there; and as the interval is symmetric, that is the
// nearest one.

constexpr int NINE = 9;          // digits, which are always enough
constexpr int LEAST_FIELD = 117; // exponent field of PLAIN_LEAST
constexpr int FIELDS = 27;       // up to that of PLAIN_LIMIT
constexpr uint32_t MANTISSA = 0x7FFFFF;

// Of the floats of one exponent: those with `higher` or more as their 24 bits have one digit more in front.
struct binade {
  uint32_t higher;
  int scale; // k of the others
};

constexpr std::array<binade, FIELDS> make_binades() {
  std::array<binade, FIELDS> all{};
  for (int i = 0; i < FIELDS; i++) {
    int shift = 150 - LEAST_FIELD - i; // a float is m 2^-shift
    int scale = DECIMALS_MAX;
    while ((uint64_t{MANTISSA + 1} * POWERS[scale]) >> shift >= POWERS[NINE]) scale--;
    uint64_t limit = POWERS[NINE] << shift;
    all[static_cast<size_t>(i)] = {static_cast<uint32_t>((limit + POWERS[scale] - 1) / POWERS[scale]), scale};
  }
  return all;
}

constexpr std::array<binade, FIELDS> BINADES = make_binades();

struct candidate {
  uint32_t digits;
  uint32_t is_inside; // 0 or 1: nearer than the reach
};

// a where the choice is 0, b where it is 1; compilers make branches of the shorter way to say it.
uint32_t choose(uint32_t choice, uint32_t a, uint32_t b) {
  return a ^ ((a ^ b) & (0 - choice));
}

// The multiple of 10^zeros nearest to a number in units of 2^-unit; of two as near, the even one.
template <int zeros> candidate nearest(uint64_t number, int unit, uint64_t reach) {
  constexpr uint32_t power = static_cast<uint32_t>(POWERS[zeros]);
  uint32_t below = static_cast<uint32_t>(number >> unit) / power;
  uint64_t step = uint64_t{power} << unit;
  uint64_t rest = number - below * step;
  uint64_t missing = step - rest;
  uint32_t up = static_cast<uint32_t>(rest + (below & 1) > missing);
  uint32_t is_inside = static_cast<uint32_t>(rest < reach) | static_cast<uint32_t>(missing < reach);
  return {(below + up) * power, is_inside};
}

// The eight decimal digits of a number below 10^8 as text: halves, pairs and digits are split side by side
// (after Paul Khuong, "How to print integers really fast").
void put_eight(char *out, uint32_t value) {
  uint64_t halves = value / 10000 | uint64_t{value % 10000} << 32;
  uint64_t hundreds = (halves * 10486 >> 20) & 0x7F0000007F; // exact below 10^4
  uint64_t pairs = hundreds | (halves - 100 * hundreds) << 16;
  uint64_t tens = (pairs * 103 >> 10) & 0x000F000F000F000F; // exact below 100
  uint64_t text = (tens | (pairs - 10 * tens) << 8) + 0x3030303030303030;
  if constexpr (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__) text = __builtin_bswap64(text);
  std::memcpy(out, &text, sizeof text);
}

void put_nine(char *out, uint32_t value) {
  uint32_t first = value / 100000000;
  *out = static_cast<char>('0' + first);
  put_eight(out + 1, value - first * 100000000);
}

// magnitude: in [PLAIN_LEAST, PLAIN_LIMIT). NULL for a number of five digits or less, and for a power of two,
// whose interval is not symmetric. Returns the end; up to DECIMALS_MAX bytes behind it are written.
char *print_long(char *out, float magnitude) {
  uint32_t bits = 0;
  std::memcpy(&bits, &magnitude, sizeof bits);
  int field = static_cast<int>(bits >> 23);
  uint32_t mantissa = (bits & MANTISSA) | (MANTISSA + 1);
  binade of = BINADES[static_cast<size_t>(field - LEAST_FIELD)];
  int scale = of.scale - (mantissa >= of.higher ? 1 : 0), unit = 151 - field;
  uint64_t half = POWERS[scale], number = 2 * mantissa * half;
  uint64_t reach = half + (mantissa % 2 == 0 ? 1 : 0); // even ones take the ends of the interval too
  candidate nine = nearest<0>(number, unit, reach), eight = nearest<1>(number, unit, reach),
            seven = nearest<2>(number, unit, reach), six = nearest<3>(number, unit, reach),
            five = nearest<4>(number, unit, reach);
  if (five.is_inside != 0 || (bits & MANTISSA) == 0) return nullptr;
  uint32_t digits = choose(eight.is_inside, nine.digits, eight.digits);
  digits = choose(seven.is_inside, digits, seven.digits);
  digits = choose(six.is_inside, digits, six.digits);
  int count = NINE - static_cast<int>(eight.is_inside + seven.is_inside + six.is_inside);
  int places = scale; // behind the point, of nine digits
  if (magnitude < 1) {
    std::memcpy(out, "0.00", 4);
    out += 2 + places - NINE;
    put_nine(out, digits);
    return out + count;
  }
  int whole = NINE - places;
  char text[NINE + 8] = {};
  put_nine(text, digits);
  std::memcpy(out, text, 8);
  out[whole] = '.';
  std::memcpy(out + whole + 1, text + whole, 8);
  return out + count + 1;
}

char *print_float(char *out, float value) {
  float magnitude = std::fabs(value);
  if (!(magnitude >= PLAIN_LEAST && magnitude < PLAIN_LIMIT)) return out + print(out, value);
  *out = '-';
  out += value < 0 ? 1 : 0;
  char *end = print_long(out, magnitude);
  return end ? end : print_plain(out, magnitude);
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
