/* Big blocks that are given back come again, to one owner at a time, and no more are kept than promised. The
 * address sanitizer has none kept: what is about keeping passes without a look then. */
#include "block.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "tweend/base.h"

enum { BIG = 3 * TW_BLOCK_BIG, MEGABYTE = 1 << 20 };

static int drop_all(void **state) {
  (void)state;
  tw_blocks_drop();
  return 0;
}

static void an_overflowing_product_is_refused(void **state) {
  (void)state;
  assert_null(tw_block_alloc(SIZE_MAX / 4, 8));
  assert_null(tw_block_alloc_zero(SIZE_MAX, SIZE_MAX));
  assert_null(tw_block_alloc_zero(SIZE_MAX / 2 + 1, 1));
  void *nothing = tw_block_alloc(0, 8);
  assert_non_null(nothing);
  tw_block_free(nothing);
  tw_block_free(NULL);
}

static void a_big_block_comes_again(void **state) {
  (void)state;
  if (TW_BLOCKS_KEPT == 0) return;
  void *first = tw_block_alloc(BIG, 1);
  tw_block_free(first);
  assert_in_range(tw_blocks_kept(), BIG, BIG + BIG / 16);
  void *second = tw_block_alloc(BIG - BIG / 64, 1), *third = tw_block_alloc(BIG, 1);
  assert_ptr_equal(second, first);
  assert_ptr_not_equal(third, first);
  assert_int_equal(tw_blocks_kept(), 0);
  tw_block_free(second);
  tw_block_free(third);
}

static void a_block_that_comes_again_is_zeroed_where_that_is_asked_for(void **state) {
  (void)state;
  unsigned char *dirty = tw_block_alloc(BIG, 1);
  memset(dirty, 0xA5, BIG);
  tw_block_free(dirty);
  unsigned char *clean = tw_block_alloc_zero(BIG, 1);
  for (size_t i = 0; i < BIG; i++) assert_int_equal(clean[i], 0);
  memset(clean, 0xA5, BIG);
  tw_block_free(clean);
  tw_arena *arena = tw_arena_create();
  for (int i = 0; i < 3; i++) {
    clean = tw_arena_alloc(arena, BIG - 64, 1);
    for (size_t k = 0; k < BIG - 64; k++) assert_int_equal(clean[k], 0);
    memset(clean, 0xA5, BIG - 64);
    tw_arena_destroy(arena);
    arena = tw_arena_create();
  }
  tw_arena_destroy(arena);
}

static void small_and_huge_blocks_are_not_kept(void **state) {
  (void)state;
  tw_block_free(tw_block_alloc(TW_BLOCK_BIG, 1));
  tw_block_free(tw_block_alloc(TW_BLOCK_HUGE + 1, 1));
  assert_int_equal(tw_blocks_kept(), 0);
}

static void a_block_is_a_sixteenth_too_large_at_most(void **state) {
  (void)state;
  for (size_t bytes = 1; bytes < 3 * (size_t)TW_BLOCK_HUGE; bytes += bytes / 50 + 1) {
    unsigned char *block = tw_block_alloc(bytes, 1);
    block[0] = block[bytes - 1] = 1; /* the sanitizer looks */
    tw_block_free(block);
    assert_true(tw_blocks_kept() <= bytes + bytes / 16);
    tw_blocks_drop();
  }
}

static void no_more_is_kept_than_promised_and_the_newest_is(void **state) {
  (void)state;
  enum { COUNT = 40 };
  void *blocks[2][COUNT];
  for (int half = 0; half < 2; half++) {
    size_t size = half ? MEGABYTE : MEGABYTE + MEGABYTE / 2;
    for (int i = 0; i < COUNT; i++) blocks[half][i] = tw_block_alloc(size, 1);
  }
  for (int half = 0; half < 2; half++)
    for (int i = 0; i < COUNT; i++) {
      tw_block_free(blocks[half][i]);
      assert_true(tw_blocks_kept() <= TW_BLOCKS_KEPT);
    }
  if (TW_BLOCKS_KEPT == 0) return;
  assert_in_range(tw_blocks_kept(), MEGABYTE, TW_BLOCKS_KEPT);
  for (int i = 0; i < 100; i++) { /* sizes that nobody asks for any more make room */
    size_t kept = tw_blocks_kept();
    void *fresh = tw_block_alloc(5 * MEGABYTE, 1);
    assert_true(i == 0 || tw_blocks_kept() < kept);
    tw_block_free(fresh);
    assert_true(tw_blocks_kept() <= TW_BLOCKS_KEPT);
  }
  tw_blocks_drop();
  assert_int_equal(tw_blocks_kept(), 0);
}

/* Marks blocks as its own, and finds that nobody else has. */
static void *hammer(void *context) {
  uint32_t seed = *(const uint32_t *)context, failures = 0;
  enum { HELD = 8 };
  size_t *held[HELD] = {NULL}, sizes[HELD] = {0};
  for (uint32_t round = 0; round < 20000; round++) {
    seed = seed * 1664525u + 1013904223u;
    uint32_t i = seed >> 8 & (HELD - 1), words = ((seed >> 12 & 15) + 1) * (TW_BLOCK_BIG / 16);
    if (held[i]) failures += held[i][0] != (size_t)context + i || held[i][sizes[i] - 1] != (size_t)context;
    tw_block_free(held[i]);
    sizes[i] = words;
    held[i] = tw_block_alloc(words, sizeof *held[i]);
    held[i][0] = (size_t)context + i;
    held[i][words - 1] = (size_t)context;
  }
  for (int i = 0; i < HELD; i++) tw_block_free(held[i]);
  return (void *)(size_t)failures;
}

static void a_block_has_one_owner_at_a_time(void **state) {
  (void)state;
  enum { THREADS = 4 };
  pthread_t threads[THREADS];
  uint32_t seeds[THREADS] = {1, 2, 3, 4};
  for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, hammer, &seeds[i]), 0);
  for (int i = 0; i < THREADS; i++) {
    void *failures;
    pthread_join(threads[i], &failures);
    assert_null(failures);
  }
  assert_true(tw_blocks_kept() <= TW_BLOCKS_KEPT);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup(an_overflowing_product_is_refused, drop_all),
      cmocka_unit_test_setup(a_big_block_comes_again, drop_all),
      cmocka_unit_test_setup(a_block_that_comes_again_is_zeroed_where_that_is_asked_for, drop_all),
      cmocka_unit_test_setup(small_and_huge_blocks_are_not_kept, drop_all),
      cmocka_unit_test_setup(a_block_is_a_sixteenth_too_large_at_most, drop_all),
      cmocka_unit_test_setup(no_more_is_kept_than_promised_and_the_newest_is, drop_all),
      cmocka_unit_test_setup(a_block_has_one_owner_at_a_time, drop_all),
  };
  return cmocka_run_group_tests(tests, drop_all, drop_all);
}
