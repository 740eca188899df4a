// Numbers as text: shortest round trip, no locale. By std::to_chars and std::from_chars; floats of common
// magnitudes by their digits from decimal.h.
#include "decimal.h"
#include "tweend/base.h"

#include <algorithm>
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

// ---- floats of common magnitudes ----
//
// Their digits are found a batch at a time, without branches, and placed without branches as well: what is
// sampled or multiplied has seven digits to nine, at random, and a wrong guess takes longer than all of it.

// Where the parts of a number go. All of them are written over each other, in this order, for every number.
struct layout {
  char start[8];                      // sign, and "0.0" as far as there is any
  uint8_t digits, point, rest, ninth; // places: of the first eight digits, of those behind the point
  uint8_t cut;                        // bits of the digits before the point
  std::array<uint8_t, 8> length;      // by zeros at the end of the first eight, with a comma
};

constexpr size_t KINDS = TW_DECIMAL_ZERO + 1;
constexpr int EIGHT = 8;

constexpr uint8_t byte(int value) {
  return static_cast<uint8_t>(value);
}

constexpr layout make_layout(int kind, bool has_ninth) {
  layout of{};
  for (char &c : of.start) c = '0';
  if (kind == TW_DECIMAL_ZERO) { // all digits go behind the end
    for (uint8_t &length : of.length) length = 2;
    of.digits = of.point = of.rest = of.ninth = EIGHT;
    return of;
  }
  int sign = kind % 2, whole = kind / 2 - 2; // digits before the point; below zero, zeros behind it
  if (sign) of.start[0] = '-';
  int first = whole > 0 ? sign : sign + 2 - whole, point = whole > 0 ? sign + whole : sign + 1;
  of.digits = byte(first);
  of.point = byte(point);
  of.rest = byte(whole > 0 ? point + 1 : first);
  of.ninth = byte(whole > 0 ? first + EIGHT + 1 : first + EIGHT);
  of.cut = byte(whole > 0 ? 8 * whole : 0);
  for (int zeros = 0; zeros < EIGHT; zeros++) {
    int count = has_ninth ? EIGHT + 1 : EIGHT - zeros;
    int end = whole <= 0 ? first + count : sign + (count > whole ? count + 1 : whole);
    of.length[static_cast<size_t>(zeros)] = byte(end + 1);
  }
  return of;
}

// Those without a ninth digit, then those with one.
constexpr std::array<layout, 2 * KINDS> make_layouts() {
  std::array<layout, 2 * KINDS> all{};
  for (size_t i = 0; i < all.size(); i++) all[i] = make_layout(static_cast<int>(i % KINDS), i >= KINDS);
  return all;
}

constexpr std::array<layout, 2 *KINDS> LAYOUTS = make_layouts();

// Eight bytes as a number whose lowest byte is the first, and back.
uint64_t first_lowest(uint64_t word) {
  return __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? __builtin_bswap64(word) : word;
}

void put_eight(char *out, uint64_t digits) {
  uint64_t text = first_lowest(digits | 0x3030303030303030);
  std::memcpy(out, &text, sizeof text);
}

// Rare, and kept out of the way of what is not.
__attribute__((noinline)) char *put_other(char *out, float value) {
  out += print(out, value);
  *out++ = ',';
  return out;
}

// The batch's value i and a comma. Up to TW_FLOAT_TEXT bytes are written, wherever the text ends. Returns the
// end.
__attribute__((always_inline)) inline char *put_decimal(char *out, const tw_decimals &batch, size_t i) {
  uint32_t kind = batch.kinds[i], ninth = batch.ninths[i];
  if (kind == TW_DECIMAL_OTHER) return put_other(out, batch.values[i]);
  const layout &of = LAYOUTS[kind + (ninth != 0 ? KINDS : 0)];
  uint64_t digits = 0;
  std::memcpy(&digits, batch.digits + EIGHT * i, sizeof digits);
  digits = first_lowest(digits);
  std::memcpy(out, of.start, sizeof of.start);
  put_eight(out + of.digits, digits);
  out[of.point] = '.';
  put_eight(out + of.rest, digits >> of.cut);
  out[of.ninth] = static_cast<char>('0' + ninth);
  out += of.length[static_cast<size_t>(__builtin_clzll(digits | 1) / 8)];
  out[-1] = ',';
  return out;
}

char *put_decimals(char *out, const tw_decimals &batch, size_t first, size_t count) {
  for (size_t i = first; i < first + count; i++) out = put_decimal(out, batch, i);
  return out;
}

// Vectors whose numbers a batch holds. Inlined, so that the widths of poses are known where they are copied.
__attribute__((always_inline)) inline char *put_vectors(char *out, const tw_vectors &all, size_t width) {
  size_t most = TW_DECIMALS / width;
  char *start = out;
  for (size_t first = 0; first < all.count; first += most) {
    tw_decimals batch;
    size_t left = std::min(all.count - first, most);
    for (size_t i = 0; i < left; i++)
      std::memcpy(batch.values + i * width, all.values + (first + i) * all.stride, width * sizeof(float));
    tw_decimals_find(&batch, left * width);
    for (size_t i = 0; i < left; i++) {
      *out++ = '[';
      out = put_decimals(out, batch, i * width, width);
      out[-1] = ']';
      *out++ = ',';
      if (all.ends) all.ends[first + i] = static_cast<size_t>(out - start) - 1;
    }
  }
  return out;
}

char *put_wide_vectors(char *out, const tw_vectors &all) {
  char *start = out;
  for (size_t i = 0; i < all.count; i++) {
    *out++ = '[';
    out += tw_print_floats(out, all.values + i * all.stride, all.width);
    *out++ = ']';
    *out++ = ',';
    if (all.ends) all.ends[i] = static_cast<size_t>(out - start) - 1;
  }
  return out;
}

char *put_all_vectors(char *out, const tw_vectors &all) {
  switch (all.width) {
  case 3: return put_vectors(out, all, 3);
  case 4: return put_vectors(out, all, 4);
  case 16: return put_vectors(out, all, 16);
  default:
    return all.width > 0 && all.width <= TW_DECIMALS ? put_vectors(out, all, all.width)
                                                     : put_wide_vectors(out, all);
  }
}

} // namespace

size_t tw_print_float(char *out, float value) {
  tw_decimals batch;
  batch.values[0] = value;
  tw_decimals_find(&batch, 1);
  return static_cast<size_t>(put_decimal(out, batch, 0) - out) - 1;
}

size_t tw_print_floats(char *out, const float *values, size_t count) {
  char *end = out;
  for (size_t first = 0; first < count; first += TW_DECIMALS) {
    tw_decimals batch;
    size_t left = std::min<size_t>(count - first, TW_DECIMALS);
    std::memcpy(batch.values, values + first, left * sizeof *values);
    tw_decimals_find(&batch, left);
    end = put_decimals(end, batch, 0, left);
  }
  return static_cast<size_t>(end - out) - (count > 0 ? 1 : 0);
}

size_t tw_print_vectors(char *out, const tw_vectors *vectors) {
  return static_cast<size_t>(put_all_vectors(out, *vectors) - out) - (vectors->count > 0 ? 1 : 0);
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
