/* Sorting by merging. qsort of the C library may take as much memory again, and cannot be stopped. */
#include <string.h>

#include "tweend/base.h"

typedef int comparison(const void *, const void *);

enum { RUN = 16, STEPS = 8 };

/* Sorts few items. spare: of one. */
static void insert(char *items, size_t count, size_t size, comparison *compare, char *spare) {
  for (size_t i = 1; i < count; i++) {
    size_t at = i;
    while (at > 0 && compare(items + (at - 1) * size, items + i * size) > 0) at--;
    if (at == i) continue;
    memcpy(spare, items + i * size, size);
    memmove(items + (at + 1) * size, items + at * size, (i - at) * size);
    memcpy(items + at * size, spare, size);
  }
}

/* Merges two sorted runs, of which one follows the other, into `out`. */
static void merge(const char *left, size_t left_count, size_t right_count, size_t size, comparison *compare,
                  char *out) {
  const char *middle = left + left_count * size, *right = middle, *end = middle + right_count * size;
  while (left < middle && right < end) {
    const char **first = compare(left, right) <= 0 ? &left : &right;
    memcpy(out, *first, size);
    *first += size;
    out += size;
  }
  memcpy(out, left, (size_t)(middle - left));
  memcpy(out + (middle - left), right, (size_t)(end - right));
}

/* Merges neighbouring runs of a length. */
static bool merge_all(const char *from, size_t count, size_t size, size_t run, comparison *compare,
                      char *to) {
  for (size_t at = 0; at < count; at += 2 * run) {
    size_t left = count - at < run ? count - at : run;
    size_t rest = count - at - left, right = rest < run ? rest : run;
    if (!tw_work(STEPS * (uint64_t)(left + right))) return false;
    merge(from + at * size, left, right, size, compare, to + at * size);
  }
  return true;
}

tw_status tw_sort(void *items, size_t count, size_t size, comparison *compare) {
  size_t ordered = 1;
  while (ordered < count &&
         compare((char *)items + (ordered - 1) * size, (char *)items + ordered * size) <= 0)
    ordered++;
  if (ordered >= count) return TW_OK;
  char *spare = tw_alloc(count, size), *from = items, *to = spare;
  if (!spare) return TW_NO_MEMORY;
  bool is_wanted = true;
  for (size_t at = 0; at < count && is_wanted; at += RUN) {
    insert(from + at * size, count - at < RUN ? count - at : RUN, size, compare, spare);
    is_wanted = tw_work((uint64_t)STEPS * RUN);
  }
  for (size_t run = RUN; run < count && is_wanted; run *= 2) {
    is_wanted = merge_all(from, count, size, run, compare, to);
    char *swapped = from;
    from = to;
    to = swapped;
  }
  if (from == spare && is_wanted) memcpy(items, spare, count * size);
  tw_free(spare);
  return is_wanted ? TW_OK : TW_CANCELLED;
}
