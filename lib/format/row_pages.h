/* Rows of a surface in any order: faces name them scattered, a reader is cheap in ascending order. Rows are
 * noted first, then all are read at once, in pages of neighbours. */
#ifndef TWEEND_ROW_PAGES_H
#define TWEEND_ROW_PAGES_H

#include "tweend/subdiv.h"

enum { TW_PAGE_ROWS = 16, TW_PAGES_MAX = 2048, TW_PAGES_RECENT = 64 };

typedef struct tw_row_pages {
  tw_domain domain; /* TW_DOMAIN_POINTS or TW_DOMAIN_UVS */
  uint32_t width;   /* floats a row: 3 or 2 */
  uint32_t count;
  uint32_t *numbers, *slots;        /* [TW_PAGES_MAX]; hash table: place + 1, or 0 */
  uint64_t recent[TW_PAGES_RECENT]; /* number << 32 | place, by number */
  uint64_t *order, *sorted;         /* [TW_PAGES_MAX] */
  float *values;                    /* [TW_PAGES_MAX][TW_PAGE_ROWS][width] */
  float *scratch;
} tw_row_pages;

bool tw_row_pages_init(tw_row_pages *pages, tw_domain domain); /* false without memory; then too deinit it */
void tw_row_pages_deinit(tw_row_pages *pages);                 /* a zeroed one is fine */
void tw_row_pages_clear(tw_row_pages *pages);

/* Notes the page of a row, and returns its place in `values`, in pages; UINT32_MAX: there is no room. */
uint32_t tw_row_pages_find(tw_row_pages *pages, uint32_t number);

/* Notes a row. Returns its place in `values`, in rows; UINT32_MAX: there is no room. */
static inline uint32_t tw_row_pages_add(tw_row_pages *pages, uint32_t row) {
  uint32_t number = row / TW_PAGE_ROWS;
  uint64_t recent = pages->recent[number % TW_PAGES_RECENT];
  uint32_t place = recent >> 32 == number ? (uint32_t)recent : tw_row_pages_find(pages, number);
  return place == UINT32_MAX ? place : place * TW_PAGE_ROWS + row % TW_PAGE_ROWS;
}

/* Reads all noted rows, and some of their neighbours. reader: turned to the surface. */
void tw_row_pages_read(tw_row_pages *pages, tw_surface_reader *reader, uint64_t row_count);

#endif
