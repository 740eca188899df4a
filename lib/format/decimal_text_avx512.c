/* Vectors of floats as text on machines with AVX-512 that squeeze bytes (VBMI2): of four numbers at once in
 * slots of one form, what is not wanted is squeezed out. The last block of a vector may have fewer; those
 * that it has live. */
#include "decimal.h"
#include "decimal_slots.h"

#include <immintrin.h>
#include <string.h>

enum { BRACKETS = 3 }; /* bytes that a vector has beyond its numbers */

/* What is printed, and the room for it. */
typedef struct page {
  const tw_vectors *all;
  bool in_brackets;
  char *start, *limit;
} page;

/* Fewer than a block may be fewer than can be read. */
static inline __m128 load_block(const float *values, size_t live) {
  return live == TW_BLOCK ? _mm_loadu_ps(values) : _mm_maskz_loadu_ps((__mmask8)((1U << live) - 1), values);
}

/* All 64 bytes where there is room for them, and no more than the block's own otherwise; behind the text are
 * commas. */
static inline char *put_block(const page *p, char *out, const char *slots, uint64_t kept, size_t live) {
  __m512i text = _mm512_mask_compress_epi8(_mm512_set1_epi8(','), kept, _mm512_load_si512(slots));
  if (live == TW_BLOCK || p->limit - out >= (ptrdiff_t)TW_BLOCK * TW_SLOT)
    _mm512_storeu_si512(out, text);
  else
    _mm512_mask_storeu_epi32(out, (__mmask16)((1U << TW_BLOCK * live) - 1), text);
  return out + _mm_popcnt_u64(kept);
}

static inline uint64_t live_bits(size_t live) {
  return live == TW_BLOCK ? UINT64_MAX : (1ULL << TW_SLOT * live) - 1;
}

/* A block where some numbers are not in their slots, one by one. */
static __attribute__((noinline)) char *put_slowly(char *out, const tw_decimal_slots *slots, size_t block,
                                                  uint64_t kept) {
  __m512i text = _mm512_load_si512(slots->text[block]);
  for (size_t i = 0; i < TW_BLOCK && kept >> TW_SLOT * i != 0; i++) {
    uint64_t bits = kept & 0xFFFFULL << TW_SLOT * i;
    if (slots->others >> (TW_BLOCK * block + i) & 1) {
      if (bits >> TW_SLOT * i & 1) *out++ = '[';
      out += tw_print_any_float(out, slots->values[block * slots->stride + i]);
      *out++ = ',';
    } else {
      _mm_storeu_si128((__m128i *)out, _mm512_castsi512_si128(_mm512_maskz_compress_epi8(bits, text)));
      out += _mm_popcnt_u64(bits);
    }
  }
  return out;
}

static inline char *close_bracket(char *out) {
  memcpy(out - 1, "],", 2);
  return out + 1;
}

static inline bool has_others(const tw_decimal_slots *slots, size_t block) {
  return slots->others >> TW_BLOCK * block & 0xF;
}

/* copies: of so many blocks, with room for all that slots take. */
static inline void find_copies(tw_decimal_slots *slots, float *copies, size_t count, size_t closed) {
  for (; !tw_decimal_slots_take(count); count++) _mm_store_ps(copies + TW_BLOCK * count, _mm_setzero_ps());
  slots->values = copies;
  slots->stride = TW_BLOCK;
  tw_decimal_slots_find(slots, count, closed);
}

/* Whole blocks are read where they are, if they are as many as slots take. */
static inline __attribute__((always_inline)) void find_narrow(tw_decimal_slots *slots, float *copies,
                                                              const tw_vectors *all, size_t first,
                                                              size_t count, size_t width) {
  const float *values = all->values + first * all->stride;
  if (width == TW_BLOCK && tw_decimal_slots_take(count)) {
    slots->values = values;
    slots->stride = all->stride;
    tw_decimal_slots_find(slots, count, width - 1);
    return;
  }
  for (size_t i = 0; i < count; i++)
    _mm_store_ps(copies + TW_BLOCK * i, load_block(values + i * all->stride, width));
  find_copies(slots, copies, count, width - 1);
}

/* Vectors of a block each, in brackets. */
static inline __attribute__((always_inline)) char *put_narrow(const page *p, size_t width) {
  const tw_vectors *all = p->all;
  uint64_t live = live_bits(width);
  char *out = p->start;
  for (size_t first = 0; first < all->count; first += TW_SLOT_BLOCKS) {
    tw_decimal_slots slots;
    alignas(64) float copies[TW_SLOTS];
    size_t count = all->count - first < TW_SLOT_BLOCKS ? all->count - first : TW_SLOT_BLOCKS;
    find_narrow(&slots, copies, all, first, count, width);
    if (slots.others == 0 && !all->ends) {
      for (size_t i = 0; i < count; i++)
        out = put_block(p, out, slots.text[i], slots.kept[i] & live, width) + 1;
      continue;
    }
    for (size_t i = 0; i < count; i++) {
      uint64_t kept = slots.kept[i] & live;
      out = close_bracket(has_others(&slots, i) ? put_slowly(out, &slots, i, kept)
                                                : put_block(p, out, slots.text[i], kept, width));
      if (all->ends) all->ends[first + i] = (size_t)(out - p->start) - 1;
    }
  }
  return out;
}

/* A block of a vector. */
typedef struct place {
  size_t vector, column;
} place;

static inline size_t live_numbers(size_t width, place at) {
  return width - at.column < TW_BLOCK ? width - at.column : TW_BLOCK;
}

static inline place next_block(size_t width, place at) {
  bool is_last = width - at.column <= TW_BLOCK;
  return (place){at.vector + is_last, is_last ? 0 : at.column + TW_BLOCK};
}

/* Vectors of several blocks, which begin with one of their own. Inlined, so that the width of matrices is
 * known. */
static inline __attribute__((always_inline)) char *put_wide(const page *p, size_t width) {
  const tw_vectors *all = p->all;
  char *out = p->start;
  for (place from = {0, 0}, to = {0, 0}; to.vector < all->count;) {
    tw_decimal_slots slots;
    alignas(64) float copies[TW_SLOTS];
    size_t count = 0;
    for (; count < TW_SLOT_BLOCKS && from.vector < all->count; count++, from = next_block(width, from))
      _mm_store_ps(
          copies + TW_BLOCK * count,
          load_block(all->values + from.vector * all->stride + from.column, live_numbers(width, from)));
    find_copies(&slots, copies, count, TW_BLOCK);
    for (size_t i = 0; i < count; i++) {
      size_t live = live_numbers(width, to);
      uint64_t kept = slots.kept[i] & live_bits(live);
      if (to.column != 0 || !p->in_brackets) kept &= ~1ULL;
      out = has_others(&slots, i) ? put_slowly(out, &slots, i, kept)
                                  : put_block(p, out, slots.text[i], kept, live);
      place next = next_block(width, to);
      if (next.column == 0 && p->in_brackets) {
        out = close_bracket(out);
        if (all->ends) all->ends[to.vector] = (size_t)(out - p->start) - 1;
      }
      to = next;
    }
  }
  return out;
}

static char *print_row(char *out, const float *values, size_t count) {
  const tw_vectors all = {values, count, count, count > 0, NULL};
  return put_wide(&(page){&all, false, out, out + count * TW_FLOAT_TEXT}, count);
}

static char *print_vectors(char *out, const tw_vectors *all) {
  const page p = {all, true, out, out + all->count * (all->width * TW_FLOAT_TEXT + BRACKETS)};
  switch (all->width) {
  case 3: return put_narrow(&p, 3);
  case 4: return put_narrow(&p, 4);
  case 16: return put_wide(&p, 16);
  default: return put_wide(&p, all->width);
  }
}

const tw_decimal_kernels tw_decimal_kernels_vbmi2 = {NULL, print_row, print_vectors};
