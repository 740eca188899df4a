/* How long computing one answer may take (--compute-timeout). */
#ifndef SRV_COMPUTE_LIMIT_H
#define SRV_COMPUTE_LIMIT_H

#include "api.h"

/* Lets the reads of the body take `left_ns` in all, over which it ends with an error: the time that a client
 * takes is not counted. False without memory: then the body is as before. */
bool srv_compute_limit(api_body *body, uint64_t left_ns);

/* Until when this thread works on its present request; 0: as long as it takes. */
void srv_compute_until(uint64_t end_ns);

/* Whether that is over, as api_parallel_for has it. */
bool srv_compute_is_over(void *owner);

#endif
