/* The forms of a surface's answer, by a table: a row says all that differs between them. */
#ifndef API_SURFACE_FORMS_H
#define API_SURFACE_FORMS_H

#include "surface_request.h"

/* The form at a place of the route's offers. */
const api_surface_form *api_surface_form_at(size_t offer);

/* The size of the answer, or a bound where it is known only at the end; checked against --max-output.
 * API_SIZE_UNKNOWN for HEAD of a compressed answer without packs. */
api_outcome api_surface_predict(api_call *call, const api_surface_request *request, uint64_t *size);

/* Fills the answer. Its body takes over the request; an answer without a body leaves it to the caller. */
api_outcome api_surface_reply(api_call *call, api_surface_request *request);

/* Releases what a request holds, not the request, which lives in the call's arena. */
void api_surface_release(api_surface_request *request);

#endif
