/* How long computing one answer may take (--compute-timeout). */
#ifndef SRV_COMPUTE_LIMIT_H
#define SRV_COMPUTE_LIMIT_H

#include "api.h"

/* Limits the reads of the body to `left_ns` of computing in all; once they have taken longer, the next read
 * fails. The time between reads, which the client takes, does not count. False without memory; the body is
 * unchanged then. */
bool srv_compute_limit(api_body *body, uint64_t left_ns);

/* Tells for whom this thread computes from now on. end_ns: when its time is over; 0: never. is_wanted:
 * whether the client still waits for the answer, asked a few times a second; NULL: it is not asked. */
void srv_compute_begin(uint64_t end_ns, bool (*is_wanted)(void *context), void *context);
void srv_compute_end(void);

/* Whether the time is over or the client has left. An is_cancelled of api_parallel_for. */
bool srv_compute_is_over(void *owner);

#endif
