/* What a printer asks of a surface: which shells it has, whether they are closed, and how much they hold. */
#ifndef API_PRINTABILITY_H
#define API_PRINTABILITY_H

#include "surface_request.h"

/* Warns of shells that are open or inside out, and of edges of more than two faces; measures the shells of
 * the plan, unless they are known. A HEAD request warns where they are known. Sets request->solids. */
api_outcome api_warn_of_shells(api_call *call, api_surface_request *request);

/* Whether measuring is so little work that a light call may do it. */
bool api_shells_are_light(const api_plan *plan);

/* Prints the member "solid", all shells of a flat answer in the request's unit. */
tw_status api_print_solid(api_call *call, const api_surface_request *request, tw_text *text);

/* Prints the members "shell_count" and "shells" of a mesh. */
tw_status api_print_shells(api_call *call, const api_surface_request *request, uint32_t mesh, tw_text *text);

#endif
