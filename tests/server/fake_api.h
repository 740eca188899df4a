/* Stands in for api/ in tests of the sockets: answers of every shape, on request.
 *
 *   /light        "light" at once
 *   /heavy        "heavy" on a compute thread; waits until fake_api_release when it is held
 *   /stuck        "stuck" like that, on an I/O thread
 *   /echo         the body's bytes, on a compute thread
 *   /pull?N       N bytes, pulled; byte i is i % 251
 *   /legs?MS      10 bytes, pulled, after three calls of so many milliseconds each, between which it waits
 *   /waits        waits for memory that never comes
 *   /slow?N       the same, of a slow body, each block of which waits like /heavy
 *   /endless      pulled until somebody stops reading
 *   /chunks?N     N bytes of unknown size
 *   /broken?N     claims 1,000,000 bytes, fails after N
 *   /header?NAME the value of this field, as handlers get it
 *   /wide         "wide" with fields of 2 KiB
 *   /nothing      204
 *   /unchanged    304
 *   /live?N,M     a stream, 100 frames a second up to number N, each followed by M letters
 *   else          refused with 404 on the headers */
#ifndef FAKE_API_H
#define FAKE_API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api.h"

/* Heavy requests, and stuck ones, wait from here on; release lets them go. */
void fake_api_hold(void);
void fake_api_release(void);

void fake_api_fill_memory(bool is_full); /* nothing that may be refused fits from here on */

uint64_t fake_api_held(api_held what); /* bytes */

size_t fake_api_started(void);     /* of these that a thread has begun */
size_t fake_api_block_size(void);  /* bytes that were asked for last of a pulled body */
size_t fake_api_open_bodies(void); /* pulled bodies that are not destroyed yet */
/* Refusals of requests that had others still wait for what they had promised to make. */
size_t fake_api_kept_promises(void);

#endif
