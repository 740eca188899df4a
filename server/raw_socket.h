/* What is done to a connection's socket beside the HTTP library, because the library has no call for it: it
 * answers only whole requests, it closes over bytes that nobody has read, which resets the connection under
 * the answer, and it knows neither a client that has left nor bytes that the client has not taken yet. */
#ifndef SRV_RAW_SOCKET_H
#define SRV_RAW_SOCKET_H

#include <stdbool.h>
#include <stddef.h>

/* Sends a whole answer at once, or nothing that counts. Only while the library has nothing to send. */
bool srv_raw_send(int fd, const char *text, size_t size);

/* Reads what has come and forgets it. False when the client has closed. */
bool srv_raw_discard(int fd);

/* Whether the client is still there, as far as the kernel knows. */
bool srv_raw_is_open(int fd);

/* Whether the client has closed, and all that it sent has been read. */
bool srv_raw_is_read_out(int fd);

/* Bytes sent that the client's kernel has not acknowledged; 0 where that is not known. */
size_t srv_raw_unsent(int fd);

#endif
