/* Holds the processor time of an input against its size, so that a fuzzer finds what a short request can make
 * long. */
#ifndef SPENT_H
#define SPENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Processor time of the calling thread so far, in seconds. */
double spent_now(void);

/* Whether that is too much for so many bytes, sent and answered: over 2 seconds, or over 50 ms for each KiB
 * and ten more, since a short request may ask for a shape of as many faces as the limits allow. Sanitizers
 * may take several times as long. */
bool spent_too_much(double seconds, uint64_t bytes);

/* Aborts with a line that tells the time. */
void spent_give_up(double seconds, uint64_t bytes);

#endif
