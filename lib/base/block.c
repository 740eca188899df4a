/* The store of big blocks. Sizes are rounded up to classes, sixteen to a doubling, and each class has a row
 * of places that one atomic exchange fills or empties: no thread ever waits for another, and none looks into
 * a block that it does not own. */
#include "block.h"

#include <stdalign.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/base.h"

enum {
  STEPS = 16, /* classes to a doubling */
  BIG_BITS = 15,
  HUGE_BITS = 24,
  CLASSES = (HUGE_BITS - BIG_BITS) * STEPS,
  NO_CLASS = CLASSES,
  PLACES = 16 /* of a class: a surface has a dozen arrays of a size */
};
_Static_assert(TW_BLOCK_BIG == 1 << BIG_BITS && TW_BLOCK_HUGE == 1 << HUGE_BITS, "bits of the bounds");

/* What lies before every block. */
typedef union header {
  size_t class; /* NO_CLASS: of any size, not kept */
  alignas(max_align_t) unsigned char align[1];
} header;

static const size_t ALL_PLACES = (size_t)CLASSES * PLACES;

static _Atomic(header *) kept[CLASSES * PLACES];
static atomic_size_t kept_size;
static atomic_uint oldest; /* where in kept[] to make room next, all ways round */

/* The least class whose blocks have room for so many bytes. */
static size_t class_of(size_t bytes) {
  if (TW_BLOCKS_KEPT == 0 || bytes <= TW_BLOCK_BIG || bytes > TW_BLOCK_HUGE) return NO_CLASS;
  size_t doubling = 0;
  while ((size_t)TW_BLOCK_BIG << (doubling + 1) < bytes) doubling++;
  size_t start = (size_t)TW_BLOCK_BIG << doubling, step = start / STEPS;
  return doubling * STEPS + (bytes - start + step - 1) / step - 1;
}

static size_t class_size(size_t class) {
  size_t start = (size_t)TW_BLOCK_BIG << class / STEPS;
  return start + start / STEPS * (class % STEPS + 1);
}

/* Takes what is kept in a place; NULL where nothing is. */
static header *take(size_t place) {
  if (!atomic_load_explicit(&kept[place], memory_order_relaxed)) return NULL;
  header *h = atomic_exchange_explicit(&kept[place], NULL, memory_order_acquire);
  if (h) atomic_fetch_sub_explicit(&kept_size, class_size(place / PLACES), memory_order_relaxed);
  return h;
}

static header *take_of_class(size_t class) {
  header *h = NULL;
  for (size_t place = class * PLACES; !h && place < (class + 1) * PLACES; place++) h = take(place);
  return h;
}

/* Lets go of what is kept, place by place, until no more than the bound is claimed. */
static void make_room(void) {
  for (size_t tries = ALL_PLACES;
       tries > 0 && atomic_load_explicit(&kept_size, memory_order_relaxed) > TW_BLOCKS_KEPT; tries--)
    free(take(atomic_fetch_add_explicit(&oldest, 1, memory_order_relaxed) % ALL_PLACES));
}

/* False when the class's places are all taken. */
static bool keep(header *h) {
  size_t class = h->class, size = class_size(class);
  /* Counted before it is there: never are more bytes kept than counted. */
  atomic_fetch_add_explicit(&kept_size, size, memory_order_relaxed);
  make_room();
  for (size_t place = class * PLACES; place < (class + 1) * PLACES; place++) {
    header *none = NULL;
    if (!atomic_load_explicit(&kept[place], memory_order_relaxed) &&
        atomic_compare_exchange_strong_explicit(&kept[place], &none, h, memory_order_release,
                                                memory_order_relaxed))
      return true;
  }
  atomic_fetch_sub_explicit(&kept_size, size, memory_order_relaxed);
  return false;
}

static void *allocate(size_t count, size_t size, bool zero) {
  if (size != 0 && count > SIZE_MAX / 2 / size) return NULL;
  size_t bytes = count * size, class = class_of(bytes), room = class == NO_CLASS ? bytes : class_size(class);
  header *h = class == NO_CLASS ? NULL : take_of_class(class);
  if (h) return zero ? memset(h + 1, 0, bytes) : h + 1;
  h = zero ? calloc(1, sizeof *h + room) : malloc(sizeof *h + room);
  if (!h) return NULL;
  h->class = class;
  return h + 1;
}

void *tw_block_alloc(size_t count, size_t size) {
  return allocate(count, size, false);
}

void *tw_block_alloc_zero(size_t count, size_t size) {
  return allocate(count, size, true);
}

void tw_block_free(void *block) {
  if (!block) return;
  header *h = (header *)block - 1;
  if (h->class == NO_CLASS || !keep(h)) free(h);
}

void tw_blocks_drop(void) {
  for (size_t place = 0; place < ALL_PLACES; place++) free(take(place));
}

size_t tw_blocks_kept(void) {
  return atomic_load_explicit(&kept_size, memory_order_relaxed);
}
