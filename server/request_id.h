/* What requests are called: X-Request-Id, made here or taken from the client, and traceparent. */
#ifndef SRV_REQUEST_ID_H
#define SRV_REQUEST_ID_H

#include <stdbool.h>

enum { SRV_REQUEST_ID_SIZE = 65 };

/* Makes an id that no other request of this process or another has. */
void srv_request_id_make(char out[SRV_REQUEST_ID_SIZE]);

/* Whether a client's id can be taken over: letters, digits and ".", "_", "-". */
bool srv_request_id_is_valid(const char *id);

/* VERSION-TRACE-PARENT-FLAGS in lower-case hex (W3C Trace Context, version 00). */
bool srv_traceparent_is_valid(const char *text);

#endif
