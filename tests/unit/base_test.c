/* Errors, arena, numbers as text. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"
#include "tweend/base.h"

TEST(error_detail_is_cut_between_characters) {
  char text[1000];
  for (size_t i = 0; i + 2 < sizeof text; i += 2) memcpy(text + i, "\xC3\xA4", 2);
  text[998] = '\0';
  tw_error error;
  assert_int_equal(tw_fail(&error, TW_INVALID, "x%s", text), TW_INVALID);
  size_t length = strlen(error.detail);
  assert_true(length < sizeof error.detail);
  assert_int_equal((length - 1) % 2, 0);
}

TEST(a_place_goes_before_the_sentence_which_is_cut_between_characters) {
  tw_error error;
  tw_fail(&error, TW_INVALID, "it is broken");
  tw_error_at(&error, "/clips/%d", 3);
  tw_error_before(&error, "layer %d: ", 2);
  assert_string_equal(error.detail, "layer 2: it is broken");
  assert_string_equal(error.pointer, "/clips/3");
  char text[1000];
  for (size_t i = 0; i + 2 < sizeof text; i += 2) memcpy(text + i, "\xC3\xA4", 2);
  text[998] = '\0';
  for (int places = 0; places < 4; places++) {
    tw_fail(&error, TW_INVALID, "%s", text);
    for (int i = 0; i < places; i++) tw_error_before(&error, "x");
    size_t length = strlen(error.detail);
    assert_true(length < sizeof error.detail && length + 2 >= sizeof error.detail);
    assert_int_equal((length - (size_t)places) % 2, 0);
  }
  tw_error_before(&error, "%s", text);
  assert_int_equal(strlen(error.detail) % 2, 0);
}

typedef struct sorted_item {
  uint32_t key, place;
  uint8_t odd[3];
} sorted_item;

static int compare_items(const void *left, const void *right) {
  const sorted_item *a = left, *b = right;
  return a->key < b->key ? -1 : a->key > b->key;
}

/* Counts how often it is asked, and is over at the third time. */
static bool is_over_soon(void *owner) {
  return ++*(int *)owner > 2;
}

TEST(sorting_keeps_equal_items_in_order_and_ends_with_its_work) {
  static const size_t counts[] = {0, 1, 2, 15, 16, 17, 33, 1000, 4096, 5001};
  static sorted_item items[5001];
  uint32_t seed = 1;
  for (size_t c = 0; c < sizeof counts / sizeof *counts; c++)
    for (uint32_t keys = 1; keys <= 1u << 30; keys = keys < 1u << 30 ? keys << 10 : UINT32_MAX) {
      for (uint32_t i = 0; i < counts[c]; i++) {
        seed = seed * 1664525 + 1013904223;
        items[i] = (sorted_item){(seed >> 1) % keys, i, {(uint8_t)i, 0, 0}};
      }
      assert_int_equal(tw_sort(items, counts[c], sizeof *items, compare_items), TW_OK);
      for (size_t i = 1; i < counts[c]; i++) {
        const sorted_item *a = &items[i - 1], *b = &items[i];
        assert_true(a->key < b->key || (a->key == b->key && a->place < b->place));
        assert_int_equal(b->odd[0], (uint8_t)b->place);
      }
    }
  for (uint32_t i = 0; i < 5001; i++) items[i] = (sorted_item){5001 - i, i, {0}};
  tw_meter meter;
  int asked = 0;
  tw_meter_init(&meter, &(tw_meter_host){.owner = &asked, .is_over = is_over_soon}, UINT64_MAX);
  tw_meter *before = tw_meter_use(&meter);
  tw_status over = tw_sort(items, 5001, sizeof *items, compare_items);
  tw_meter_use(before);
  assert_int_equal(over, TW_CANCELLED);
  tw_meter_init(&meter, &(tw_meter_host){0}, 5001);
  before = tw_meter_use(&meter);
  tw_status poor = tw_sort(items, 5001, sizeof *items, compare_items);
  tw_meter_use(before);
  assert_int_equal(poor, TW_NO_MEMORY);
}

TEST(arena_refuses_an_overflowing_product) {
  tw_arena *arena = tw_arena_create();
  assert_null(tw_arena_alloc(arena, SIZE_MAX / 2, 8));
  assert_non_null(tw_arena_alloc(arena, 0, 8));
  tw_arena_destroy(arena);
}

TEST(arena_memory_is_zeroed_and_separate) {
  tw_arena *arena = tw_arena_create();
  unsigned char *blocks[100];
  for (size_t i = 0; i < 100; i++) {
    blocks[i] = tw_arena_alloc(arena, 1 + i * 317, 1);
    for (size_t j = 0; j < 1 + i * 317; j++) assert_int_equal(blocks[i][j], 0);
    memset(blocks[i], (int)i, 1 + i * 317);
  }
  for (size_t i = 0; i < 100; i++)
    for (size_t j = 0; j < 1 + i * 317; j++) assert_int_equal(blocks[i][j], i);
  tw_arena_destroy(arena);
}

TEST(numbers_print_shortest_and_read_back) {
  char text[TW_NUMBER_TEXT + 1];
  text[tw_print_float(text, 0.1f)] = '\0';
  assert_string_equal(text, "0.1");
  text[tw_print_float(text, -0.0f)] = '\0';
  assert_string_equal(text, "0");
  double value;
  assert_int_equal(tw_read_double("+.5e1x", 6, &value), 5);
  assert_true(value == 5);
  assert_int_equal(tw_read_double("nan", 3, &value), 0);
  assert_int_equal(tw_read_double("-inf", 4, &value), 0);
  assert_int_equal(tw_read_double("1e999", 5, &value), 5);
  assert_true(value > 1e308);
  assert_int_equal(tw_read_double("1e-999", 6, &value), 6);
  assert_true(value == 0);
}

/* Digits and exponent tell together whether a number is too large or too small. */
TEST(numbers_beyond_doubles_read_as_strtod_reads_them) {
  static const char *const
      starts[] = {"1", "0.", "-0.", ".", "-7", "0"},
      *const ends[] = {
          "",      "1",       "1.5",    "e-10",  "e-500", "1e+10",          "1E-10",
          "1e500", "1.5e-10", "e+9999", "1e390", "1e400", "1e-99999999999", "1e9999999999999999999999"};
  for (size_t zeros = 0; zeros <= 800; zeros += 400)
    for (size_t i = 0; i < sizeof starts / sizeof *starts; i++)
      for (size_t k = 0; k < sizeof ends / sizeof *ends; k++) {
        char text[900], *after;
        int length = snprintf(text, sizeof text, "%s%0*d%s", starts[i], (int)zeros + 1, 0, ends[k]);
        double value, expected = strtod(text, &after);
        assert_int_equal(tw_read_double(text, (size_t)length, &value), after - text);
        assert_memory_equal(&value, &expected, sizeof value);
      }
}

static uint64_t next_random(uint64_t *seed) {
  *seed = *seed * 6364136223846793005u + 1442695040888963407u;
  return *seed >> 33;
}

/* Digits with a point anywhere among them, or without one, and what may follow a number. */
TEST(plain_numbers_read_as_strtod_reads_them) {
  static const char *const tails[] = {"", " ", ".", "x", "e", "e2", "E-3", ",1", "\n7"};
  uint64_t seed = 5;
  for (int i = 0; i < 100000; i++) {
    char text[40], *end = text, *after;
    size_t digits = 1 + next_random(&seed) % 17, point = next_random(&seed) % (digits + 4);
    if (i % 3 == 0) *end++ = '-';
    for (size_t k = 0; k < digits; k++) {
      if (k == point) *end++ = '.';
      *end++ = (char)('0' + next_random(&seed) % 10);
    }
    if (point == digits) *end++ = '.';
    end = stpcpy(end, tails[next_random(&seed) % (sizeof tails / sizeof *tails)]);
    double value, expected = strtod(text, &after);
    assert_int_equal(tw_read_double(text, (size_t)(end - text), &value), after - text);
    assert_memory_equal(&value, &expected, sizeof value);
  }
  double value;
  assert_int_equal(tw_read_double("12345", 2, &value), 2);
  assert_true(value == 12);
  static const char *const none[] = {"", "-", ".", "-.", "-e1", "- 1", "+-1"};
  for (size_t i = 0; i < sizeof none / sizeof *none; i++)
    assert_int_equal(tw_read_double(none[i], strlen(none[i]), &value), 0);
}

TEST(characters_that_break_or_turn_lines_are_no_part_of_a_name) {
  static const char *const controls[] = {"\x01",   "\x7f",   "\xc2\x80", "\xc2\x85", "\xc2\x9f", "\u2028",
                                         "\u2029", "\u202a", "\u202e",   "\u2066",   "\u2069"};
  static const char *const sound[] = {"\u00a0", "\u00e9", "\u061c", "\u200d", "\u200f",    "\u2027",
                                      "\u202f", "\u2065", "\u206a", "\u3128", "\U0001f600"};
  tw_arena *arena = tw_arena_create();
  char text[16];
  for (size_t i = 0; i < sizeof controls / sizeof *controls; i++) {
    snprintf(text, sizeof text, "a%sb", controls[i]);
    assert_false(tw_utf8_is_name(text, strlen(text)));
    assert_string_equal(tw_arena_name(arena, text, strlen(text)), "a b");
  }
  for (size_t i = 0; i < sizeof sound / sizeof *sound; i++) {
    snprintf(text, sizeof text, "a%sb", sound[i]);
    assert_true(tw_utf8_is_name(text, strlen(text)));
    assert_string_equal(tw_arena_name(arena, text, strlen(text)), text);
  }
  assert_string_equal(tw_arena_name(arena, "\x93\xe9\x85", 3), " \u00e9 "); /* Latin-1 */
  tw_arena_destroy(arena);
}
