/* The handlers that the table of routes names. */
#ifndef API_HANDLERS_H
#define API_HANDLERS_H

#include "call.h"

api_outcome api_get_health(api_call *call);
api_outcome api_get_ready(api_call *call);
api_outcome api_get_version(api_call *call);
api_outcome api_get_openapi(api_call *call);

api_outcome api_post_model(api_call *call);
api_outcome api_list_models(api_call *call);
api_outcome api_get_model(api_call *call);
api_outcome api_get_source(api_call *call);
api_outcome api_delete_model(api_call *call);

api_outcome api_get_tracks(api_call *call);

api_outcome api_get_surface(api_call *call);
api_outcome api_post_surface(api_call *call);

api_outcome api_get_pose(api_call *call);
api_outcome api_post_times(api_call *call);
api_outcome api_post_pose(api_call *call);

api_outcome api_get_live(api_call *call);

#endif
