/* Shortest decimal digits in plain loops that compilers make vectors of: each file that includes this is
 * compiled for another instruction set.
 *
 * In the eight decades from 1e-3 to 1e5 all of it is exact in doubles: a float times the power of ten that
 * gives it nine digits before the point has no more than 24 + 26 bits (5^11 has 26), and half the distance to
 * its neighbours times that power has 26. What lies within that reach reads back as the float; nothing of
 * nine digits lies at its end, since the middle between two such floats has 13 digits and more. The reach is
 * between 2.9 and 49, so of nine digits the nearest will always do; the nearest multiple of ten is shorter
 * where it is inside; and of the multiples of a hundred no more than one is inside, which is then the
 * shortest: that it may end in yet more zeros is seen in the text. The interval is narrower below a power of
 * two, but those are multiples of a hundred themselves. */
#ifndef TWEEND_DECIMAL_KERNEL_H
#define TWEEND_DECIMAL_KERNEL_H

#include "decimal.h"

#include <math.h>
#include <string.h>

/* Of a float: the bits of its exponent, and how much less they say of half its last place. */
enum { EXPONENT = 0x7F800000, TO_HALF_PLACE = 24 << 23 };

static inline uint32_t bits_of(float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return bits;
}

static inline float float_of(uint32_t bits) {
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

/* Below 2^51, ties to even: there is no room behind the point of 2^52. */
static inline double nearest(double x) {
  return (x + 0x1p52) - 0x1p52;
}

/* The nine digits of a value as one number. */
static inline uint32_t find_nine(float value, uint32_t *kind) {
  uint32_t sign = bits_of(value) >> 31;
  float magnitude = fabsf(value);
  bool is_plain = magnitude >= 1e-3F && magnitude < 1e5F;
  float v = is_plain ? magnitude : 1;
  /* Each is the float nearest to a power of ten, and prints as that. */
  uint32_t decade = (uint32_t)(v >= 1e-2F) + (uint32_t)(v >= 1e-1F) + (uint32_t)(v >= 1) +
                    (uint32_t)(v >= 10) + (uint32_t)(v >= 100) + (uint32_t)(v >= 1000) +
                    (uint32_t)(v >= 1e4F);
  float scale = v >= 1e-2F ? 1e6F : 1e7F;
  scale = v >= 1e-1F ? 1e5F : scale;
  scale = v >= 1 ? 1e4F : scale;
  scale = v >= 10 ? 1e3F : scale;
  scale = v >= 100 ? 1e2F : scale;
  scale = v >= 1000 ? 1e1F : scale;
  scale = v >= 1e4F ? 1 : scale;
  *kind = is_plain ? 2 * decade + sign : magnitude == 0 ? TW_DECIMAL_ZERO : TW_DECIMAL_OTHER;

  uint32_t bits = bits_of(v);
  float half_place = float_of((bits & EXPONENT) - TO_HALF_PLACE);
  double power = (double)scale * 1e4;
  double number = (double)v * power, reach = (double)half_place * power;
  /* A tenth is not exact, but off by less than any float is from a tie, and ties stay ties. */
  double nine = nearest(number), eight = 10 * nearest(number * 0.1), seven = 100 * nearest(number * 0.01);
  nine = fabs(number - eight) < reach ? eight : nine;
  nine = fabs(number - seven) < reach ? seven : nine;
  return (uint32_t)(int32_t)nine; /* signed ones are converted by more instruction sets */
}

/* count: of the batch, rounded up to what loops of vectors like. Nine digits are split into a ninth and two
 * fours, those into pairs, those into digits, each in a loop of its own for vectors of one width. */
static inline __attribute__((always_inline)) void find_decimals(tw_decimals *restrict batch, size_t count) {
  uint32_t nines[TW_DECIMALS];
  uint16_t fours[2 * TW_DECIMALS], pairs[4 * TW_DECIMALS];
  for (size_t i = 0; i < count; i++) nines[i] = find_nine(batch->values[i], &batch->kinds[i]);
  for (size_t i = 0; i < count; i++) {
    uint32_t eight = nines[i] / 10, four = eight / 10000;
    batch->ninths[i] = nines[i] - 10 * eight;
    fours[2 * i] = (uint16_t)four;
    fours[2 * i + 1] = (uint16_t)(eight - 10000 * four);
  }
  for (size_t i = 0; i < 2 * count; i++) {
    uint16_t pair = (uint16_t)(fours[i] / 100);
    pairs[2 * i] = pair;
    pairs[2 * i + 1] = (uint16_t)(fours[i] - 100 * pair);
  }
  for (size_t i = 0; i < 4 * count; i++) {
    uint16_t ten = (uint16_t)(pairs[i] / 10);
    batch->digits[2 * i] = (uint8_t)ten;
    batch->digits[2 * i + 1] = (uint8_t)(pairs[i] - 10 * ten);
  }
}

#endif
