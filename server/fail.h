/* The reason for a failure, as one line for a person. */
#ifndef SRV_FAIL_H
#define SRV_FAIL_H

#include <stdbool.h>

typedef struct srv_error {
  char text[512];
} srv_error;

/* Sets the reason. Returns false, so that a caller can return the result. */
bool srv_fail(srv_error *error, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
