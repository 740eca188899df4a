/* Printing floats: one instruction set against another, rows and vectors against single numbers, and the room
 * that is asked for. tests/oracle/number_test.cpp compares with std::to_chars. */
#include "number.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"

enum { WIDEST = 64 }; /* vectors that fit one batch */

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

TEST(vectors_are_their_numbers_in_brackets_and_keep_to_their_room) {
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

/* The longest text with a slot of its own, the longest of all, and others. */
static float long_float(size_t i) {
  static const float longest[] = {-0.0012345671f, -1.17549435e-38f, -0.0098765432f};
  return i % 4 < 3 ? longest[i % 4] : any_float();
}

TEST(all_instruction_sets_print_their_numbers_and_keep_to_their_room) {
  enum { GUARD = 16 };
  static const char guard[GUARD] = "untouched so far";
  static const size_t widths[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 15, 16, 17, 20, 33, WIDEST - 1, WIDEST};
  for (size_t k = 0; k < sizeof widths / sizeof *widths; k++)
    for (size_t count = 0; count < 40; count++) {
      size_t width = widths[k], stride = width + count % 5,
             value_count = count > 0 ? stride * (count - 1) + width : 0;
      size_t room = count * (width * TW_FLOAT_TEXT + 3);
      float *values = malloc(value_count * sizeof *values + 1); /* read to the last, and no further */
      char *text = malloc(room + GUARD), *right = malloc(room + GUARD);
      assert_true(values && text && right);
      for (size_t i = 0; i < value_count; i++)
        values[i] = count % 3 ? long_float(i / (count % 3)) : -0.0012345671f;
      size_t ends[40] = {0}, right_ends[40] = {0};
      tw_vectors vectors = {values, stride, width, count, count % 2 ? right_ends : NULL};
      size_t size = print_singly(right, &vectors);
      vectors.ends = count % 2 ? ends : NULL;
      tw_number_printer *printer;
      for (uint32_t set = 0; (printer = tw_number_printer_at(set)); set++) {
        memset(text, 0, room);
        memcpy(text + room, guard, GUARD);
        assert_int_equal(printer(text, &vectors) - text, count > 0 ? size + 1 : 0);
        assert_memory_equal(text, right, size);
        assert_memory_equal(ends, right_ends, sizeof ends);
        assert_memory_equal(text + room, guard, GUARD);
      }
      free(values);
      free(text);
      free(right);
    }
}
