/* Time that no setting of the clock moves. */
#ifndef SRV_CLOCK_H
#define SRV_CLOCK_H

#include <stdint.h>

uint64_t srv_now_ns(void);

/* Cheaper; behind by a tick of the kernel at most, which is some milliseconds. */
uint64_t srv_now_ms(void);

#endif
