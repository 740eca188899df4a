/* Loops that are shared among threads. */
#ifndef TWEEND_PARALLEL_FOR_H
#define TWEEND_PARALLEL_FOR_H

#include "tweend/base.h"

enum {
  TW_PARALLEL_FOR_LEAST = 8192, /* iterations of a few nanoseconds each that are worth another thread */
  TW_PARALLEL_FOR_PARTS_MAX = 16
};

/* How many parts a loop of `count` iterations is cut into, of at least `least` each: 1 where parallel is
 * NULL. */
uint32_t tw_parallel_for_parts(const tw_parallel_for *parallel, uint32_t count, uint32_t least);

/* Iterations [begin, end) of a loop, in part `part` of it. Parts may run at once. */
typedef void tw_parallel_for_body(void *context, uint32_t part, uint32_t begin, uint32_t end);

/* Runs all iterations, in tw_parallel_for_parts parts of equal length but for 1; on the calling thread where
 * that is one part. Allocates nothing. */
void tw_parallel_for_run(const tw_parallel_for *parallel, uint32_t count, uint32_t least,
                         tw_parallel_for_body *body, void *context);

/* Between two steps: TW_CANCELLED where the result is not wanted any more. */
tw_status tw_parallel_for_status(const tw_parallel_for *parallel);

#endif
