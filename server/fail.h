/* The reason for a failure, as one line for a person. */
#ifndef SRV_FAIL_H
#define SRV_FAIL_H

#include <stdbool.h>
#include <stdint.h>

typedef struct srv_error {
  char text[512];
} srv_error;

/* What stands behind a count: `one` behind 1, else `many`, as tw_plural of lib. */
const char *srv_plural(uint64_t count, const char *one, const char *many);

/* Sets the reason. Returns false, so that a caller can return the result. */
bool srv_fail(srv_error *error, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
