/* Error reports and the arena. */
#include "tweend/base.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "block.h"

const char *tw_version(void) {
  return TWEEND_VERSION;
}

/* Ends text before the first incomplete UTF-8 sequence that cutting may have left. */
static void trim_partial_character(char *text) {
  size_t length = strlen(text);
  size_t start = length;
  while (start > 0 && ((unsigned char)text[start - 1] & 0xC0) == 0x80) start--;
  if (start == 0) return;
  unsigned char lead = (unsigned char)text[start - 1];
  size_t need = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 1;
  if (length - (start - 1) < need) text[start - 1] = '\0';
}

static tw_status fail(tw_error *error, tw_status status, uint64_t line, const char *format,
                      va_list arguments) {
  if (!error) return status;
  error->status = status;
  error->line = line;
  error->pointer[0] = '\0';
  int length = vsnprintf(error->detail, sizeof error->detail, format, arguments);
  if (length >= (int)sizeof error->detail) trim_partial_character(error->detail);
  return status;
}

tw_status tw_fail(tw_error *error, tw_status status, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  fail(error, status, 0, format, arguments);
  va_end(arguments);
  return status;
}

tw_status tw_fail_line(tw_error *error, tw_status status, uint64_t line, const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  fail(error, status, line, format, arguments);
  va_end(arguments);
  return status;
}

tw_status tw_error_at(tw_error *error, const char *format, ...) {
  if (!error) return TW_INVALID;
  va_list arguments;
  va_start(arguments, format);
  int length = vsnprintf(error->pointer, sizeof error->pointer, format, arguments);
  va_end(arguments);
  if (length >= (int)sizeof error->pointer) {
    char *slash = strrchr(error->pointer, '/');
    if (slash) *slash = '\0';
  }
  return error->status;
}

void *tw_alloc(size_t count, size_t size) {
  if (size != 0 && count > SIZE_MAX / size) return NULL;
  size_t bytes = count * size;
  return malloc(bytes ? bytes : 1);
}

void *tw_alloc_zero(size_t count, size_t size) {
  return calloc(count ? count : 1, size ? size : 1);
}

/* Blocks double from the first to the last of these sizes, so that small arenas stay small. They are cleared
 * as they are handed out: most of a small arena is not, and calloc goes past the threads' own free lists.
 * What is larger has a block to itself. */
enum { ARENA_FIRST = 512, ARENA_BLOCK = 64 * 1024, ARENA_ALIGN = 16 };

typedef struct arena_block {
  struct arena_block *next;
  size_t used, capacity;
  _Alignas(ARENA_ALIGN) unsigned char bytes[];
} arena_block;

/* The first block lies behind it, in one piece of memory. */
struct tw_arena {
  arena_block *first;
  size_t size, next_block;
  void *owned; /* that memory; NULL where it is another's */
};
_Static_assert(sizeof(struct tw_arena) % ARENA_ALIGN == 0, "the block behind it is aligned");

static arena_block *block_behind(tw_arena *arena) {
  return (arena_block *)(void *)(arena + 1);
}

static tw_arena *create_in(void *memory, size_t size, void *owned) {
  tw_arena *arena = memory;
  arena_block *block = block_behind(arena);
  *arena = (tw_arena){block, size, 2 * (size_t)ARENA_FIRST, owned};
  block->next = NULL;
  block->used = 0;
  block->capacity = size - sizeof *arena - sizeof *block;
  return arena;
}

tw_arena *tw_arena_create(void) {
  void *memory = malloc(ARENA_FIRST);
  return memory ? create_in(memory, ARENA_FIRST, memory) : NULL;
}

tw_arena *tw_arena_create_in(void *memory, size_t size) {
  assert(size >= ARENA_FIRST && (uintptr_t)memory % ARENA_ALIGN == 0);
  return create_in(memory, size, NULL);
}

void tw_arena_destroy(tw_arena *arena) {
  if (!arena) return;
  for (arena_block *block = arena->first; block;) {
    arena_block *next = block->next;
    if (block != block_behind(arena)) tw_block_free(block);
    block = next;
  }
  free(arena->owned);
}

/* A block of so many bytes, first in line unless it is for one array alone; NULL without memory. */
static arena_block *add_block(tw_arena *arena, size_t whole, bool alone, bool zero) {
  arena_block *fresh = zero ? tw_block_alloc_zero(whole, 1) : tw_block_alloc(whole, 1), *block = arena->first;
  if (!fresh) return NULL;
  fresh->used = 0;
  fresh->capacity = whole - sizeof *fresh;
  arena->size += whole;
  if (alone) { /* a big one of its own: keep filling the block in use */
    fresh->next = block->next;
    block->next = fresh;
  } else {
    fresh->next = block;
    arena->first = fresh;
  }
  return fresh;
}

static void *allocate(tw_arena *arena, size_t count, size_t size, bool zero) {
  if (size != 0 && count > (SIZE_MAX / 2) / size) return NULL;
  size_t bytes = (count * size + ARENA_ALIGN - 1) / ARENA_ALIGN * ARENA_ALIGN;
  if (bytes == 0) bytes = ARENA_ALIGN;
  arena_block *block = arena->first;
  bool big = bytes > ARENA_BLOCK;
  if (block->capacity - block->used < bytes) {
    bool alone = bytes > arena->next_block / 4;
    block = add_block(arena, alone ? sizeof *block + bytes : arena->next_block, alone, big && zero);
    if (!block) return NULL;
    if (arena->next_block < ARENA_BLOCK) arena->next_block *= 2;
  }
  void *memory = block->bytes + block->used;
  block->used += bytes;
  return big || !zero ? memory : memset(memory, 0, bytes);
}

void *tw_arena_alloc(tw_arena *arena, size_t count, size_t size) {
  return allocate(arena, count, size, true);
}

void *tw_arena_alloc_raw(tw_arena *arena, size_t count, size_t size) {
  return allocate(arena, count, size, false);
}

char *tw_arena_text(tw_arena *arena, const char *text, size_t length) {
  char *copy = length < SIZE_MAX ? tw_arena_alloc(arena, length + 1, 1) : NULL;
  if (copy && length) memcpy(copy, text, length);
  return copy;
}

size_t tw_arena_size(const tw_arena *arena) {
  return arena->size;
}
