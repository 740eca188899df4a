/* Digits of floats in batches: what is told of which floats, one instruction set against another, and texts
 * of whole rows against those of single numbers. */
#include "decimal.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "tweend/base.h"

static uint32_t seed = 1;

static uint32_t noise(void) {
  seed = seed * 1664525u + 1013904223u;
  return seed >> 8;
}

/* Of a pose's magnitudes mostly, some with few digits, some zeros, and some of any bits at all. */
static float any_float(void) {
  uint32_t bits = noise() << 8 ^ noise();
  float value;
  switch (noise() % 8) {
  case 0: return (float)(noise() % 1000) / 100;
  case 1: return noise() % 2 ? 0.0f : -0.0f;
  case 2: memcpy(&value, &bits, sizeof value); return value;
  default: return ldexpf((float)noise() / (float)(1u << 23) - 1, (int)(noise() % 30) - 10);
  }
}

static void find_one(float value, tw_decimals *out) {
  memset(out, 0, sizeof *out);
  out->values[0] = value;
  tw_decimals_find(out, 1);
}

static void floats_beyond_the_plain_range_are_told_apart(void **state) {
  (void)state;
  tw_decimals one;
  const float others[] = {NAN, INFINITY, -INFINITY, 1e5f, -1e5f, 9.999999e-4f, 1e-45f, 3.4e38f};
  for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
    find_one(others[i], &one);
    assert_int_equal(one.kinds[0], TW_DECIMAL_OTHER);
  }
  for (int negative = 0; negative < 2; negative++) {
    find_one(negative ? -0.0f : 0.0f, &one);
    assert_int_equal(one.kinds[0], TW_DECIMAL_ZERO);
  }
}

static void each_decade_has_nine_digits_with_zeros_behind_the_shortest(void **state) {
  (void)state;
  static const float first[] = {1e-3f, 1e-2f, 1e-1f, 1, 10, 100, 1000, 1e4f};
  tw_decimals one;
  for (uint32_t decade = 0; decade < TW_DECIMAL_DECADES; decade++) {
    find_one(-first[decade], &one);
    assert_int_equal(one.kinds[0], 2 * decade + 1);
    assert_memory_equal(one.digits, "\1\0\0\0\0\0\0\0", 8);
    assert_int_equal(one.ninths[0], 0);
  }
  find_one(0.123456789f, &one); /* the ninth and the eighth digit are not needed */
  assert_memory_equal(one.digits, "\1\2\3\4\5\6\7\11", 8);
  find_one(0.251953125f, &one); /* in the middle between two of eight digits: the even one */
  assert_memory_equal(one.digits, "\2\5\1\11\5\3\1\2", 8);
  find_one(12.3456135f, &one); /* eight digits are not enough */
  assert_int_equal(one.ninths[0], 5);
}

static void all_instruction_sets_find_the_same_digits(void **state) {
  (void)state;
  tw_decimals plain, other;
  for (int run = 0; run < 20000; run++) {
    size_t count = noise() % (TW_DECIMALS + 1);
    memset(&plain, 0, sizeof plain);
    for (size_t i = 0; i < count; i++) plain.values[i] = any_float();
    other = plain;
    assert_true(tw_decimals_find_by(0, &plain, count));
    tw_decimals empty = other;
    for (uint32_t set = 1; other = empty, tw_decimals_find_by(set, &other, count); set++)
      assert_memory_equal(&plain, &other, sizeof plain);
    other = empty;
    tw_decimals_find(&other, count); /* few are found one by one */
    assert_memory_equal(plain.kinds, other.kinds, count * sizeof *plain.kinds);
    assert_memory_equal(plain.digits, other.digits, count * 8);
    assert_memory_equal(plain.ninths, other.ninths, count * sizeof *plain.ninths);
  }
}

/* What print_vectors is to print. */
static size_t print_singly(char *out, const tw_vectors *vectors) {
  char *end = out;
  for (size_t i = 0; i < vectors->count; i++) {
    if (i > 0) *end++ = ',';
    *end++ = '[';
    for (size_t c = 0; c < vectors->width; c++) {
      if (c > 0) *end++ = ',';
      end += tw_print_float(end, vectors->values[i * vectors->stride + c]);
    }
    *end++ = ']';
    if (vectors->ends) vectors->ends[i] = (size_t)(end - out);
  }
  return (size_t)(end - out);
}

static void vectors_are_their_numbers_in_brackets_and_keep_to_their_room(void **state) {
  (void)state;
  enum { STRIDE = 150, COUNT = 40, GUARD = 16, ROOM = COUNT * (STRIDE * TW_FLOAT_TEXT + 3) };
  static const size_t widths[] = {0, 1, 2, 3, 4, 5, 16, 63, 64, 65, 150};
  static const char guard[GUARD] = "untouched so far";
  static float values[COUNT * STRIDE];
  static char text[ROOM + GUARD], right[ROOM + GUARD];
  for (size_t run = 0; run < 4 * COUNT; run++)
    for (size_t k = 0; k < sizeof widths / sizeof *widths; k++) {
      size_t width = widths[k], count = run % (COUNT + 1), stride = width + run % (STRIDE - width + 1);
      size_t room = count * (width * TW_FLOAT_TEXT + 3);
      /* The longest that there are every other time. */
      for (size_t i = 0; i < COUNT * STRIDE; i++) values[i] = run % 2 ? any_float() : -1.17549435e-38f;
      memcpy(text + room, guard, GUARD);
      size_t ends[COUNT] = {0}, right_ends[COUNT] = {0};
      tw_vectors vectors = {values, stride, width, count, run % 3 ? ends : NULL};
      size_t size = tw_print_vectors(text, &vectors);
      assert_memory_equal(text + room, guard, GUARD);
      vectors.ends = run % 3 ? right_ends : NULL;
      assert_int_equal(size, print_singly(right, &vectors));
      assert_memory_equal(text, right, size);
      assert_memory_equal(ends, right_ends, sizeof ends);
    }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(floats_beyond_the_plain_range_are_told_apart),
      cmocka_unit_test(each_decade_has_nine_digits_with_zeros_behind_the_shortest),
      cmocka_unit_test(all_instruction_sets_find_the_same_digits),
      cmocka_unit_test(vectors_are_their_numbers_in_brackets_and_keep_to_their_room),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
