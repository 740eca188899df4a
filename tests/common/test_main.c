/* Runs the tests of one file after another, with TAP output when CMOCKA_MESSAGE_OUTPUT asks for it.
 * Usage: PROGRAM [FILE...]    FILE: a name such as surface_test; without one, all files run.
 * TESTED_ONLY: a pattern of names of tests, with * and ?; others are left out. */
#include "test.h"

#include <stdio.h>
#include <string.h>

static test_entry *entries, **end = &entries;

void test_enter(test_entry *entry) {
  *end = entry;
  end = &entry->next;
}

/* The file name of the path, without its extension. */
static void name_of(const char *path, char *name, size_t size) {
  const char *slash = strrchr(path, '/'), *base = slash ? slash + 1 : path;
  snprintf(name, size, "%.*s", (int)strcspn(base, "."), base);
}

/* Runs the tests of a file, which are adjacent in the list. Returns how many failed, or -1 when the file has
 * none. */
static int run_file(const char *file) {
  size_t count = 0;
  char name[256];
  const test_entry *first = NULL;
  for (const test_entry *at = entries; at; at = at->next) {
    name_of(at->file, name, sizeof name);
    if (strcmp(name, file) != 0) continue;
    if (count++ == 0) first = at;
  }
  if (count == 0) return -1;
  struct CMUnitTest tests[count];
  for (size_t i = 0; i < count; i++, first = first->next) tests[i] = first->test;
  return cmocka_run_group_tests_name(file, tests, NULL, NULL);
}

int main(int argc, char **argv) {
  const char *only = getenv("TESTED_ONLY");
  if (only) cmocka_set_test_filter(only);
  int failed = 0;
  for (int i = 1; i < argc; i++) {
    int status = run_file(argv[i]);
    if (status < 0) fprintf(stderr, "%s: no tests of %s\n", argv[0], argv[i]);
    failed += status != 0;
  }
  const char *last = "";
  for (const test_entry *at = entries; argc == 1 && at; at = at->next) {
    if (strcmp(at->file, last) == 0) continue;
    last = at->file;
    char name[256];
    name_of(last, name, sizeof name);
    failed += run_file(name) != 0;
  }
  return failed > 0;
}
