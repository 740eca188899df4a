/* What passes between the daemon and a client past the HTTP library. */
#ifndef SRV_BYPASS_H
#define SRV_BYPASS_H

#include <stdbool.h>
#include <stddef.h>

/* Sends it all at once, or nothing that counts. Nobody else has sent on this socket for a while. */
bool srv_bypass_say(int fd, const char *text, size_t size);

/* Throws away what has come. False when the client has closed. */
bool srv_bypass_discard(int fd);

/* Whether the client is still there, as far as its kernel has told. */
bool srv_bypass_waits(int fd);

#endif
