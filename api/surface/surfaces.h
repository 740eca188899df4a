/* The stages of a request for a surface, which levels.json goes through for each level. */
#ifndef API_SURFACES_H
#define API_SURFACES_H

#include "surface_request.h"

/* Begins a request, without parameters. Lives in the call's arena; NULL without memory. */
api_surface_request *api_surface_begin(api_call *call, const api_surface_form *form);

/* Fills in the scene of the request's model under its parameters, and takes the plan of its surfaces. */
api_outcome api_surface_prepare(api_call *call, api_surface_request *request, bool is_stored);

/* Takes the packs of a quantized or compressed answer. A body needs measured ones, as does the size of a
 * compressed answer; for the size of a quantized one unmeasured packs suffice. HEAD of a compressed answer
 * uses them if they are cached, and is answered without a size else. */
api_outcome api_surface_take_packs(api_call *call, api_surface_request *request, bool is_stored);

#endif
