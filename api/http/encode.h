/* Content codings of answers. */
#ifndef API_ENCODE_H
#define API_ENCODE_H

#include "call.h"

/* Codes the answer of the call as call->coding says, where it is long enough to gain by it. API_NEEDS_THREAD
 * in a light call where that takes time. */
api_outcome api_encode(api_call *call);

#endif
