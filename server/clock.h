/* Time that no setting of the clock moves. */
#ifndef SRV_CLOCK_H
#define SRV_CLOCK_H

#include <stdint.h>

uint64_t srv_now_ns(void);

/* Cheaper; behind by a tick of the kernel at most, which is some milliseconds. */
uint64_t srv_now_ms(void);

/* The second since 1970 as in the Date header. Of this thread, until it asks for another second. */
const char *srv_date(int64_t second);

/* The same of the present second, by the clock of the day, however it is set. */
const char *srv_date_now(void);

#endif
