/* Blocks of memory, of which the big ones that are given back are kept for who asks next: the system hands
 * out pages that have to be mapped and cleared first, which takes ten times as long as clearing pages that
 * are there. No clock lets go of what is kept: its bound is all that an idle process holds, and within it the
 * oldest makes room for the newest. Any thread. tw_blocks_drop (base.h) lets go of all. */
#ifndef TWEEND_BLOCK_H
#define TWEEND_BLOCK_H

#include <stddef.h>

#if defined(__has_feature)
#define TW_HAS_FEATURE(name) __has_feature(name)
#else
#define TW_HAS_FEATURE(name) 0
#endif

enum {
  TW_BLOCK_BIG = 32 * 1024,         /* blocks over this are kept */
  TW_BLOCK_HUGE = 16 * 1024 * 1024, /* blocks over that are not */
/* Bytes that are kept at most. The address sanitizer has to see who uses what is given back. */
#if defined(__SANITIZE_ADDRESS__) || TW_HAS_FEATURE(address_sanitizer)
  TW_BLOCKS_KEPT = 0
#else
  TW_BLOCKS_KEPT = 32 * 1024 * 1024
#endif
};

/* [count] elements of `size` bytes with anything in them, aligned for any type; NULL on overflow or without
 * memory. count 0 gives a valid pointer to nothing. A big block may take up a sixteenth more. */
void *tw_block_alloc(size_t count, size_t size);
/* The same, zeroed. */
void *tw_block_alloc_zero(size_t count, size_t size);

/* NULL accepted. */
void tw_block_free(void *block);

/* Bytes that are kept now. */
size_t tw_blocks_kept(void);

#endif
