/* What the reader of BVH shares with the recognition of formats. */
#ifndef TWEEND_BVH_H
#define TWEEND_BVH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Whether the first word of bytes is HIERARCHY, in either case. */
bool tw_is_bvh(const uint8_t *bytes, size_t size);

#endif
