/* The handlers that the table of routes names. */
#ifndef API_HANDLERS_H
#define API_HANDLERS_H

#include "call.h"

api_outcome api_get_health(api_call *call);
api_outcome api_get_ready(api_call *call);
api_outcome api_get_version(api_call *call);
api_outcome api_get_openapi(api_call *call);

#endif
