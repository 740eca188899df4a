/* Sorts in buckets. A hash may choose the bucket: no input takes longer than n log n, and the order does not
 * depend on the hash. */
#include "bucket_sort.h"

static void sift_down(uint32_t *heap, size_t root, size_t count, tw_item_less *less, const void *context) {
  for (;;) {
    size_t child = 2 * root + 1;
    if (child >= count) return;
    if (child + 1 < count && less(context, heap[child], heap[child + 1])) child++;
    if (!less(context, heap[root], heap[child])) return;
    uint32_t moved = heap[root];
    heap[root] = heap[child];
    heap[child] = moved;
    root = child;
  }
}

void tw_sort_items(uint32_t *items, size_t count, tw_item_less *less, const void *context) {
  enum { SMALL = 12, STEPS = 64 };
  if (count <= SMALL) {
    for (size_t i = 1; i < count; i++) {
      uint32_t item = items[i];
      size_t at = i;
      for (; at > 0 && less(context, item, items[at - 1]); at--) items[at] = items[at - 1];
      items[at] = item;
    }
    return;
  }
  /* Equal items, of which hostile files have millions, come in order. */
  size_t ordered = 1;
  while (ordered < count && !less(context, items[ordered], items[ordered - 1])) ordered++;
  if (ordered == count) return;
  for (size_t root = count / 2; root-- > 0 && tw_work(STEPS);) sift_down(items, root, count, less, context);
  for (size_t end = count - 1; end > 0 && tw_work(STEPS); end--) {
    uint32_t greatest = items[0];
    items[0] = items[end];
    items[end] = greatest;
    sift_down(items, 0, end, less, context);
  }
}

tw_status tw_sort_in_buckets(tw_item_bucket *bucket_of, uint32_t count, uint32_t bucket_count,
                             tw_item_less *less, const void *context, uint32_t *order, tw_error *error) {
  enum { BUCKETS = 256, STEPS = 8 * BUCKETS }; /* charged at once, and what they take */
  uint32_t *starts = tw_alloc_zero((size_t)bucket_count + 1, sizeof *starts);
  if (!starts) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < count; i++) starts[bucket_of(context, i) + 1]++;
  for (uint32_t b = 0; b < bucket_count; b++) starts[b + 1] += starts[b];
  for (uint32_t i = 0; i < count; i++) order[starts[bucket_of(context, i)]++] = i;
  /* Each start has moved to its bucket's end. */
  for (uint32_t b = 0, begin = 0; b < bucket_count; begin = starts[b++]) {
    if (b % BUCKETS == 0 && !tw_work(STEPS)) break;
    if (starts[b] - begin > 1) tw_sort_items(order + begin, starts[b] - begin, less, context);
  }
  tw_free(starts);
  return tw_work_status(error);
}

tw_status tw_list_alike(const uint32_t *hashes, uint32_t count, uint32_t *items, uint32_t *item_count,
                        tw_error *error) {
  enum { BITS = 64, ITEMS_A_WORD = 4 };
  typedef struct bits {
    uint64_t once, twice;
  } bits;
  uint32_t words = 1, alike = 0;
  while (words < count / ITEMS_A_WORD) words *= 2;
  bits *seen = tw_alloc_zero(words, sizeof *seen);
  if (!seen) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (uint32_t i = 0; i < count; i++) {
    bits *word = &seen[hashes[i] / BITS & (words - 1)];
    uint64_t bit = UINT64_C(1) << hashes[i] % BITS;
    word->twice |= word->once & bit;
    word->once |= bit;
  }
  for (uint32_t i = 0; i < count; i++) {
    items[alike] = i;
    alike += (uint32_t)(seen[hashes[i] / BITS & (words - 1)].twice >> hashes[i] % BITS & 1);
  }
  tw_free(seen);
  *item_count = alike;
  return TW_OK;
}
