/* Loops that are split among threads. */
#ifndef TWEEND_PARALLEL_FOR_H
#define TWEEND_PARALLEL_FOR_H

#include "tweend/base.h"

enum {
  TW_PARALLEL_FOR_LEAST = 8192, /* the fewest iterations of a few nanoseconds that are worth another thread */
  TW_PARALLEL_FOR_PARTS_MAX = 16
};

/* The number of parts that a loop of `count` iterations is split into, each of at least `least`, which is 1
 * or more; 1 where parallel is NULL. */
uint32_t tw_parallel_for_parts(const tw_parallel_for *parallel, uint32_t count, uint32_t least);

/* Runs iterations [begin, end) of a loop, which are its part `part`. Parts may run at the same time. */
typedef void tw_parallel_for_body(void *context, uint32_t part, uint32_t begin, uint32_t end);

/* Runs all iterations in tw_parallel_for_parts parts, whose lengths differ by 1 at most. A single part runs
 * on the calling thread. Allocates nothing. */
void tw_parallel_for_run(const tw_parallel_for *parallel, uint32_t count, uint32_t least,
                         tw_parallel_for_body *body, void *context);

/* TW_CANCELLED where the result is no longer wanted; call it between the steps of long operations. TW_OK for
 * NULL. */
tw_status tw_parallel_for_status(const tw_parallel_for *parallel);

#endif
