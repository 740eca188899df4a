#include "wrapped_memory.h"

#include <malloc.h>

/* The linker's --wrap gives these names.
 * NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t size);
void __real_free(void *memory);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *memory, size_t size);
void __wrap_free(void *memory);

_Thread_local wrapped_memory test_memory = {.left = SIZE_MAX};

bool test_memory_fails(size_t size) {
  test_memory.asked += size;
  return !test_memory.is_spared && test_memory.left != SIZE_MAX && test_memory.left-- == 0;
}

static void *counted(void *memory) {
  test_memory.held += malloc_usable_size(memory);
  if (test_memory.held > test_memory.most) test_memory.most = test_memory.held;
  return memory;
}

void *__wrap_malloc(size_t size) {
  return test_memory_fails(size) ? NULL : counted(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size) {
  return test_memory_fails(count * size) ? NULL : counted(__real_calloc(count, size));
}

void *__wrap_realloc(void *memory, size_t size) {
  if (test_memory_fails(size)) return NULL;
  test_memory.held -= malloc_usable_size(memory);
  return counted(__real_realloc(memory, size));
}

void __wrap_free(void *memory) {
  test_memory.held -= malloc_usable_size(memory);
  __real_free(memory);
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
