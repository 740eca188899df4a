/* Loops that a crew shares out. */
#ifndef TWEEND_CREW_H
#define TWEEND_CREW_H

#include "tweend/subdiv.h"

enum {
  TW_CREW_LEAST = 8192, /* rounds of a loop that are worth another thread, each of some nanoseconds */
  TW_CREW_PARTS_MAX = 16
};

/* Parts that a loop of so many rounds is cut into: 1 without a crew. Of `least` rounds each, or more. */
uint32_t tw_crew_parts(const tw_crew *crew, uint32_t count, uint32_t least);

/* Rounds [begin, end) of a loop, in part `part` of it. Parts may run at once. */
typedef void tw_crew_body(void *context, uint32_t part, uint32_t begin, uint32_t end);

/* Runs all rounds in tw_crew_parts parts; alone where that is one. It allocates nothing. */
void tw_crew_loop(const tw_crew *crew, uint32_t count, uint32_t least, tw_crew_body *body, void *context);

#endif
