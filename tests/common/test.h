/* Every test file includes this: cmocka, and macros for tests that register themselves. */
#ifndef TEST_H
#define TEST_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

typedef struct test_entry {
  struct CMUnitTest test;
  const char *file;
  struct test_entry *next;
} test_entry;

/* Registers a test; called before main. entry: lives as long as the program. */
void test_enter(test_entry *entry);

/* Under a sanitizer, which makes code ten times slower and sees enough in smaller cases. */
static inline bool is_sanitized(void) {
  return getenv("TESTED_SANITIZED") != NULL;
}

/* The step of a loop over many like cases: 1, or 7 under a sanitizer, which makes each case ten times slower
 * and sees enough in a seventh of them. */
static inline uint32_t test_stride(void) {
  return is_sanitized() ? 7 : 1;
}

/* TEST(cube_has_8_vertices) { ... } defines a test; TEST_WITH adds cmocka fixtures, which pass it `state`.
 * The tests of a file run in the order of their definition. */
#define TEST(name) TEST_WITH(name, NULL, NULL)
#define TEST_WITH(name, setup, teardown)                                                                     \
  static void name(void **state);                                                                            \
  __attribute__((constructor)) static void enter_##name(void) {                                              \
    static test_entry entry = {cmocka_unit_test_setup_teardown(name, setup, teardown), __FILE__, NULL};      \
    test_enter(&entry);                                                                                      \
  }                                                                                                          \
  static void name(__attribute__((unused)) void **state)

#endif
