/* A page is TW_PAGE_ROWS rows that follow each other. The rows of a patch's faces fill their pages; of faces
 * in no order, each may take a page of its own. */
#include "row_pages.h"

#include <stdlib.h>
#include <string.h>

enum { SLOT_BITS = 13, SLOTS = 1 << SLOT_BITS, PAGES_AT_ONCE = 64 };

bool tw_row_pages_init(tw_row_pages *pages, tw_domain domain) {
  uint32_t width = domain == TW_DOMAIN_UVS ? 2 : 3;
  size_t page = (size_t)TW_PAGE_ROWS * width * sizeof(float);
  *pages = (tw_row_pages){.domain = domain,
                          .width = width,
                          .numbers = tw_alloc(TW_PAGES_MAX, sizeof(uint32_t)),
                          .slots = tw_alloc_zero(SLOTS, sizeof(uint32_t)),
                          .order = tw_alloc(TW_PAGES_MAX, sizeof(uint64_t)),
                          .sorted = tw_alloc(TW_PAGES_MAX, sizeof(uint64_t)),
                          .values = tw_alloc(TW_PAGES_MAX, page),
                          .scratch = tw_alloc_zero(PAGES_AT_ONCE, page)};
  tw_row_pages_clear(pages);
  return pages->numbers && pages->slots && pages->order && pages->sorted && pages->values && pages->scratch;
}

void tw_row_pages_deinit(tw_row_pages *pages) {
  tw_free(pages->numbers);
  tw_free(pages->slots);
  tw_free(pages->order);
  tw_free(pages->sorted);
  tw_free(pages->values);
  tw_free(pages->scratch);
}

void tw_row_pages_clear(tw_row_pages *pages) {
  pages->count = 0;
  memset(pages->recent, 0xFF, sizeof pages->recent);
  if (pages->slots) memset(pages->slots, 0, SLOTS * sizeof *pages->slots);
}

/* The table is seeded by its address, as that of vertex_set.c: senders choose rows, and cannot make pages
 * share slots. */
uint32_t tw_row_pages_find(tw_row_pages *pages, uint32_t number) {
  uint32_t seed = (uint32_t)((uint64_t)(uintptr_t)pages->slots * 0x9E3779B97F4A7C15u >> 32) | 1;
  uint32_t slot = number * seed >> (32 - SLOT_BITS), place;
  while (pages->slots[slot] > 0 && pages->numbers[pages->slots[slot] - 1] != number)
    slot = (slot + 1) & (SLOTS - 1);
  if (pages->slots[slot] == 0) {
    if (pages->count == TW_PAGES_MAX) return UINT32_MAX;
    pages->numbers[pages->count] = number;
    pages->slots[slot] = ++pages->count;
  }
  place = pages->slots[slot] - 1;
  pages->recent[number % TW_PAGES_RECENT] = (uint64_t)number << 32 | place;
  return place;
}

/* Fills `order` with all pages by ascending number: number << 32 | place. A radix sort. */
static void sort_pages(tw_row_pages *pages) {
  enum { DIGIT_BITS = 10, DIGITS = 1 << DIGIT_BITS, NUMBER_BITS = 28 };
  for (uint32_t i = 0; i < pages->count; i++) pages->order[i] = (uint64_t)pages->numbers[i] << 32 | i;
  for (int shift = 32; shift < 32 + NUMBER_BITS; shift += DIGIT_BITS) {
    uint32_t starts[DIGITS + 1] = {0};
    for (uint32_t i = 0; i < pages->count; i++) starts[(pages->order[i] >> shift) % DIGITS + 1]++;
    for (uint32_t d = 0; d < DIGITS; d++) starts[d + 1] += starts[d];
    for (uint32_t i = 0; i < pages->count; i++)
      pages->sorted[starts[(pages->order[i] >> shift) % DIGITS]++] = pages->order[i];
    uint64_t *sorted = pages->sorted;
    pages->sorted = pages->order;
    pages->order = sorted;
  }
}

void tw_row_pages_read(tw_row_pages *pages, tw_surface_reader *reader, uint64_t row_count) {
  uint32_t count = pages->count;
  size_t page = (size_t)TW_PAGE_ROWS * pages->width;
  sort_pages(pages);
  for (uint32_t begin = 0, end; begin < count; begin = end) {
    uint64_t number = pages->order[begin] >> 32, first = number * TW_PAGE_ROWS;
    for (end = begin + 1; end < count && end - begin < PAGES_AT_ONCE; end++)
      if (pages->order[end] >> 32 != number + (end - begin)) break;
    uint64_t rows = (uint64_t)(end - begin) * TW_PAGE_ROWS;
    if (rows > row_count - first) rows = row_count - first;
    tw_surface_read_rows(reader, pages->domain, first, (size_t)rows, pages->scratch);
    for (uint32_t i = begin; i < end; i++)
      memcpy(pages->values + (uint32_t)pages->order[i] * page, pages->scratch + (i - begin) * page,
             page * sizeof *pages->values);
  }
}
