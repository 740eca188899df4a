/* How long computing one answer may take (--compute-timeout). */
#ifndef SRV_COMPUTE_LIMIT_H
#define SRV_COMPUTE_LIMIT_H

#include "api.h"

/* Limits the reads of the body to `left_ns` of computing in all; once they have taken longer, the next read
 * fails. The time between reads, which the client takes, does not count. False without memory; the body is
 * unchanged then. */
bool srv_compute_limit(api_body *body, uint64_t left_ns);

/* Sets the end of the time that this thread may work on its present request; 0: no limit. */
void srv_compute_until(uint64_t end_ns);

/* Whether that time is over. An is_cancelled of api_parallel_for. */
bool srv_compute_is_over(void *owner);

#endif
