/* Quantities as people write them on a command line: 256MiB, 80M, 500ms. */
#ifndef SRV_QUANTITY_H
#define SRV_QUANTITY_H

#include <stdbool.h>
#include <stdint.h>

/* Each reads the whole text or returns false and leaves *out alone: no sign, no space, no fraction,
 * nothing over 64 bits. */

/* Plain bytes or with B, KiB, MiB, GiB, TiB (powers of 1024), kB, MB, GB, TB (powers of 1000). */
bool srv_parse_size(const char *text, uint64_t *out);

/* A plain number or with k, M, G (powers of 1000). */
bool srv_parse_count(const char *text, uint64_t *out);

/* Needs a unit: ms, s, m or h; a bare 0 is fine. Milliseconds. */
bool srv_parse_duration(const char *text, uint64_t *out);

#endif
