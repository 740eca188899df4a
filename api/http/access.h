/* Access: keys, signed URLs, and pages of other origins. */
#ifndef API_ACCESS_H
#define API_ACCESS_H

#include "handlers.h"

/* Whether the request's host is one that the listener serves; else fills the fault with 421. */
bool api_access_serves_host(api_call *call);

/* Whether the request may use its route; else fills the fault with 401, 403, or 404 on the admin listener. */
bool api_access_allowed(api_call *call);

/* Whether the route needs a key. */
bool api_access_asks(const api_call *call);
/* Whether the answer depends on the request's Origin. */
bool api_access_varies(const api_call *call);

/* Adds the cross-origin headers of an answer. */
void api_access_headers(api_call *call);

/* Answers OPTIONS, pre-flight or plain. allow: the path's methods. */
void api_access_options(api_call *call, const char *allow);

#endif
