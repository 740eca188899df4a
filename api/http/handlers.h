/* The table of routes: every path, what it takes, what it offers, and the handler that answers. */
#ifndef API_HANDLERS_H
#define API_HANDLERS_H

#include "call.h"

typedef enum api_takes {
  API_TAKES_NOTHING,
  API_TAKES_MODEL, /* a model in any format */
  API_TAKES_JSON
} api_takes;

struct api_route {
  const char *method; /* GET answers HEAD too */
  const char *path;   /* "{id}" stands for 32 hex digits */
  const char *tail;   /* of a path of a model: what follows the id; else NULL */
  api_takes takes;
  bool is_open;                  /* asks for no API key */
  bool has_extensions;           /* the path may end in "." and an offer's extension */
  const api_offer *offers;       /* the first is the default; ends with a NULL type */
  const char *const *parameters; /* NULL-terminated names that the query may bear */
  api_outcome (*handle)(api_call *call);
};

/* For the test that keeps the table and openapi.json equal. */
const api_route *api_routes(size_t *count);

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

/* api/openapi.json, embedded by the build. */
extern const unsigned char api_openapi[];
extern const size_t api_openapi_size;

#endif
