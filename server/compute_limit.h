/* How long computing one answer may take (--compute-timeout). */
#ifndef SRV_COMPUTE_LIMIT_H
#define SRV_COMPUTE_LIMIT_H

#include "api.h"

/* Lets the reads of the body take `left_ns` in all, over which it ends with an error: the time that a client
 * takes is not counted. False without memory: then the body is as before. */
bool srv_compute_limit(api_body *body, uint64_t left_ns);

#endif
