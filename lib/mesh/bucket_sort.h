/* Sorting the numbers of items, a bucket at a time. */
#ifndef TWEEND_BUCKET_SORT_H
#define TWEEND_BUCKET_SORT_H

#include "tweend/base.h"

/* Whether item a comes before item b: a strict total order. */
typedef bool tw_item_less(const void *context, uint32_t a, uint32_t b);

/* The bucket of an item. */
typedef uint32_t tw_item_bucket(const void *context, uint32_t item);

/* Sorts `count` items in place, or leaves them in any order where the result is no longer wanted. O(count log
 * count); linear where they are in order already. */
void tw_sort_items(uint32_t *items, size_t count, tw_item_less *less, const void *context);

/* Sorts the items 0 to count - 1 by bucket, of which there are `bucket_count`, and within a bucket by `less`.
 * order: [count] receives them. Allocates 4 bytes a bucket while it runs. TW_NO_MEMORY,
 * TW_CANCELLED. */
tw_status tw_sort_in_buckets(tw_item_bucket *bucket_of, uint32_t count, uint32_t bucket_count,
                             tw_item_less *less, const void *context, uint32_t *order, tw_error *error);

/* Lists the items whose hashes share their lowest bits with another's: those that are equal to another, and
 * few more. Only these need sorting where equal items are sought. items: [count] receives them, ascending;
 * *item_count: how many they are. Allocates up to 8 bytes an item while it runs. TW_NO_MEMORY. */
tw_status tw_list_alike(const uint32_t *hashes, uint32_t count, uint32_t *items, uint32_t *item_count,
                        tw_error *error);

#endif
