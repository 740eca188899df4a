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

/* What the kernel knows of the client. HALF: it has ended its side; whether it still reads is not known.
 * GONE: the connection was reset, or both sides have ended. */
typedef enum srv_raw_state { SRV_RAW_OPEN, SRV_RAW_HALF, SRV_RAW_GONE } srv_raw_state;
srv_raw_state srv_raw_state_of(int fd);

/* Whether the client has closed and all its input has been read. */
bool srv_raw_is_read_out(int fd);

/* Bytes sent that the client's kernel has not acknowledged; 0 when unknown. */
size_t srv_raw_unsent(int fd);

#endif
