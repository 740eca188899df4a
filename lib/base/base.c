/* The arena, UTF-8. */
#include "tweend/base.h"

#include <stdlib.h>
#include <string.h>

const char *tw_version(void) {
  return TWEEND_VERSION;
}

/* ---- arena ----------------------------------------------------------------------------------- */

/* Blocks double in size from ARENA_FIRST to ARENA_BLOCK, so that small arenas stay small. Their memory is
 * cleared as it is handed out, not as it is allocated: most of a small arena is never used, and calloc
 * bypasses the threads' own free lists. An array larger than ARENA_BLOCK gets a block of its own, from calloc
 * where it has to be zero. */
enum { ARENA_FIRST = 512, ARENA_BLOCK = 64 * 1024, ARENA_ALIGN = 16 };

typedef struct arena_block {
  struct arena_block *next;
  size_t used, capacity;
  _Alignas(ARENA_ALIGN) unsigned char bytes[];
} arena_block;

/* The first block follows in the same allocation. */
struct tw_arena {
  _Alignas(ARENA_ALIGN) arena_block *first;
  size_t size, next_block;
};

static arena_block *first_block(tw_arena *arena) {
  return (arena_block *)(void *)(arena + 1);
}

tw_arena *tw_arena_create(void) {
  tw_arena *arena = tw_alloc(ARENA_FIRST, 1);
  if (!arena) return NULL;
  arena_block *block = first_block(arena);
  *arena = (tw_arena){block, ARENA_FIRST, 2 * (size_t)ARENA_FIRST};
  block->next = NULL;
  block->used = 0;
  block->capacity = ARENA_FIRST - sizeof *arena - sizeof *block;
  return arena;
}

void tw_arena_destroy(tw_arena *arena) {
  if (!arena) return;
  for (arena_block *block = arena->first; block;) {
    arena_block *next = block->next;
    if (block != first_block(arena)) tw_free(block);
    block = next;
  }
  tw_free(arena);
}

/* Adds a block of `whole` bytes. Unless it is for one array alone it becomes the block in use. NULL without
 * memory. */
static arena_block *add_block(tw_arena *arena, size_t whole, bool alone, bool zero) {
  arena_block *fresh = zero ? tw_alloc_zero(whole, 1) : tw_alloc(whole, 1), *block = arena->first;
  if (!fresh) return NULL;
  fresh->used = 0;
  fresh->capacity = whole - sizeof *fresh;
  arena->size += whole;
  if (alone) {
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

/* ---- UTF-8 (RFC 3629, section 4) ------------------------------------------------------------- */

size_t tw_utf8_length(const char *text, size_t length) {
  const unsigned char *bytes = (const unsigned char *)text;
  if (length == 0) return 0;
  unsigned char lead = bytes[0];
  if (lead < 0x80) return 1;
  size_t count = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || length < count) return 0;
  /* The second byte rules out overlong forms, surrogates and values over U+10FFFF. */
  unsigned char low = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
  unsigned char high = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
  if (bytes[1] < low || bytes[1] > high) return 0;
  for (size_t i = 2; i < count; i++)
    if ((bytes[i] & 0xC0) != 0x80) return 0;
  return count;
}

/* Whether the well-formed character of `size` bytes is a control: C0, DEL, C1, the separators of lines and
 * paragraphs (U+2028, U+2029), or one that turns or embeds the direction of the text that follows it (U+202A
 * to U+202E, U+2066 to U+2069). Marks that belong to one word (U+200C to U+200F, U+061C) are none. */
static bool is_control(const char *character, size_t size) {
  const unsigned char *c = (const unsigned char *)character;
  if (size == 1) return c[0] < 0x20 || c[0] == 0x7F;
  if (size == 2) return c[0] == 0xC2 && c[1] < 0xA0;
  if (size != 3 || c[0] != 0xE2) return false;
  return (c[1] == 0x80 && c[2] >= 0xA8 && c[2] <= 0xAE) || (c[1] == 0x81 && c[2] >= 0xA6 && c[2] <= 0xA9);
}

bool tw_utf8_is_name(const char *text, size_t length) {
  for (size_t i = 0; i < length;) {
    size_t count = tw_utf8_length(text + i, length - i);
    if (count == 0 || is_control(text + i, count)) return false;
    i += count;
  }
  return true;
}

static bool is_utf8(const char *text, size_t length) {
  for (size_t i = 0, count; i < length; i += count) {
    count = tw_utf8_length(text + i, length - i);
    if (count == 0) return false;
  }
  return true;
}

char *tw_arena_name(tw_arena *arena, const char *text, size_t length) {
  bool is_latin1 = !is_utf8(text, length);
  size_t most = is_latin1 ? 2 : 1;
  char *name = length < SIZE_MAX / 2 ? tw_arena_alloc(arena, most * length + 1, 1) : NULL, *out = name;
  for (size_t i = 0, count; out && i < length; i += count) {
    unsigned char c = (unsigned char)text[i];
    char latin1[2] = {(char)(0xC0 | c >> 6), (char)(0x80 | (c & 0x3F))};
    bool is_wide = is_latin1 && c >= 0x80;
    const char *character = is_wide ? latin1 : text + i;
    size_t size = is_wide ? 2 : is_latin1 ? 1 : tw_utf8_length(character, length - i);
    count = is_latin1 ? 1 : size;
    if (is_control(character, size)) character = " ", size = 1;
    memcpy(out, character, size);
    out += size;
  }
  return name;
}
