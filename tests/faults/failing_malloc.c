/* Preloaded into the daemon: from its 20,000th allocation on, one in a thousand fails, by chance but the same
 * each time. Before that the daemon starts. */
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>

/* NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp): glibc's names */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
void *malloc(size_t size);
void *calloc(size_t count, size_t size);
void *realloc(void *memory, size_t size);

static int fails(void) {
  enum { FIRST = 20000, ONE_IN = 1000 };
  static atomic_uint_fast64_t calls;
  uint64_t call = atomic_fetch_add(&calls, 1), hash = call;
  for (int i = 0; i < 3; i++) { /* splitmix64 */
    hash ^= hash >> 30;
    hash *= 0xBF58476D1CE4E5B9u;
  }
  return call >= FIRST && hash % ONE_IN == 0;
}

void *malloc(size_t size) {
  return fails() ? NULL : __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
  return fails() ? NULL : __libc_calloc(count, size);
}

void *realloc(void *memory, size_t size) {
  return fails() ? NULL : __libc_realloc(memory, size);
}
