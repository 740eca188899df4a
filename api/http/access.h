/* Who may ask: API keys and cross-origin requests. */
#ifndef API_ACCESS_H
#define API_ACCESS_H

#include "call.h"
#include "service.h"

/* Whether the request bears a key where one is asked for; fills the fault with 401 or 403. */
bool api_access_allowed(api_call *call);

/* Adds the cross-origin headers that every answer bears. */
void api_cors_headers(const api_service *service, const api_request *request, api_answer *answer);

/* Answers OPTIONS: pre-flight or plain. allow: the path's methods. */
void api_cors_options(api_call *call, const char *allow);

#endif
