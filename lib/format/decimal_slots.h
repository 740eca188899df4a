/* Floats as texts of one form, and which of their bytes are not wanted. */
#ifndef TWEEND_DECIMAL_SLOTS_H
#define TWEEND_DECIMAL_SLOTS_H

#include <stdalign.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A number has a slot: '[', '-', what is from its first digit on, and ','. A block of numbers is squeezed at
 * once, and the digits of a group are found at once. */
enum { TW_SLOT = 16, TW_BLOCK = 4, TW_GROUP = 16, TW_SLOTS = 64, TW_SLOT_BLOCKS = TW_SLOTS / TW_BLOCK };

typedef struct tw_decimal_slots {
  const float *values; /* given, as is the next: whole blocks, each so many numbers behind the last one */
  size_t stride;
  alignas(64) char text[TW_SLOT_BLOCKS][TW_BLOCK * TW_SLOT];
  uint64_t kept[TW_SLOT_BLOCKS]; /* the bytes that are wanted, the first in the lowest bit; of each block the
                                    first '[' */
  uint64_t others;               /* the numbers whose slots say nothing, the first in the lowest bit */
} tw_decimal_slots;

/* As many blocks as find takes. */
static inline bool tw_decimal_slots_take(size_t blocks) {
  return blocks == TW_SLOT_BLOCKS || blocks == TW_SLOT_BLOCKS / 2 || blocks == TW_GROUP / TW_BLOCK;
}

/* Finds what so many blocks print as. Behind number `closed` of each block stands ']' in place of ',';
 * TW_BLOCK: behind none. For machines with VBMI2. */
void tw_decimal_slots_find(tw_decimal_slots *slots, size_t blocks, size_t closed);

#endif
