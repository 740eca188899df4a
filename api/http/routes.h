/* The table of routes: every path, what it takes, what it offers, who answers. */
#ifndef API_ROUTES_H
#define API_ROUTES_H

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

#endif
