/* Direct calls on a connection's socket, for what the HTTP library has no call for. The library answers only
 * whole requests; it closes sockets with unread input, which resets the connection before the client has read
 * the answer; it does not report that a client has left, or bytes that the client has not received yet. */
#ifndef SRV_RAW_SOCKET_H
#define SRV_RAW_SOCKET_H

#include <stdbool.h>
#include <stddef.h>

/* Sends a whole answer at once; false when only a part of it, or nothing, could be sent. Call only while the
 * library has nothing to send. */
bool srv_raw_send(int fd, const char *text, size_t size);

/* Reads and drops the input that has arrived. False when the client has closed. */
bool srv_raw_discard(int fd);

/* Whether the client is still connected, as far as the kernel knows. */
bool srv_raw_is_open(int fd);

/* Whether the client has closed and all its input has been read. */
bool srv_raw_is_read_out(int fd);

/* Bytes sent that the client's kernel has not acknowledged; 0 when unknown. */
size_t srv_raw_unsent(int fd);

#endif
