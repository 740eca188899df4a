/* The table of routes: every path, what it takes, what it offers, and the handler that answers. */
#ifndef API_HANDLERS_H
#define API_HANDLERS_H

#include "rules.h"

typedef enum api_takes {
  API_TAKES_NOTHING,
  API_TAKES_MODEL, /* a model in any format */
  API_TAKES_JSON
} api_takes;

/* Who may use a route. */
typedef enum api_access {
  API_OPEN,      /* everybody */
  API_READS,     /* keys with the right to read */
  API_READS_ALL, /* the same; reveals all models, so pages of other origins are refused */
  API_WRITES,
  API_DELETES
} api_access;

struct api_route {
  const char *method; /* GET routes answer HEAD too */
  const char *path;   /* "{id}" stands for 32 hex digits */
  const char *tail;   /* what follows the id in the path of a model; else NULL */
  api_takes takes;
  api_access access;
  bool has_extensions;        /* the path may end in "." and the extension of an offer */
  const api_offer *offers;    /* the first is the default; ends with a NULL type */
  const api_rule *parameters; /* that the query may have */
  api_outcome (*handle)(api_call *call);
};

/* For the test that compares the table with openapi.json. */
const api_route *api_routes(size_t *count);

api_outcome api_get_health(api_call *call);
api_outcome api_get_ready(api_call *call);
api_outcome api_get_version(api_call *call);
api_outcome api_get_metrics(api_call *call);
api_outcome api_post_sign(api_call *call);

api_outcome api_get_openapi(api_call *call);
api_outcome api_get_client(api_call *call);
api_outcome api_get_page(api_call *call);
api_outcome api_get_docs(api_call *call);
api_outcome api_get_example(api_call *call);
api_outcome api_get_client_types(api_call *call);
api_outcome api_get_viewer(api_call *call);

api_outcome api_post_model(api_call *call);
api_outcome api_list_models(api_call *call);
api_outcome api_get_model(api_call *call);
api_outcome api_get_source(api_call *call);
api_outcome api_delete_model(api_call *call);
api_outcome api_post_edits(api_call *call);

api_outcome api_get_tracks(api_call *call);

api_outcome api_get_surface(api_call *call);
api_outcome api_post_surface(api_call *call);
api_outcome api_get_levels(api_call *call);
api_outcome api_post_coarsen(api_call *call);
api_outcome api_post_detail(api_call *call);

api_outcome api_get_pose(api_call *call);
api_outcome api_get_pose_bvh(api_call *call);
api_outcome api_post_pose_bvh(api_call *call);
api_outcome api_post_times(api_call *call);
api_outcome api_post_pose(api_call *call);

api_outcome api_post_rotations(api_call *call);

api_outcome api_get_live(api_call *call);

#endif
