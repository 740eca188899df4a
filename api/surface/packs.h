/* The packs of a plan's surfaces, of which quantized and compressed answers are made. */
#ifndef API_PACKS_H
#define API_PACKS_H

#include "plans.h"

/* Immutable. */
typedef struct api_packs {
  uint32_t count;
  tw_packs **list; /* [count], one for each mesh */
} api_packs;

/* Which packs of the surfaces. */
typedef struct api_packs_query {
  tw_encoding encoding;
  tw_polygons polygons;
  bool is_measured;
} api_packs_query;

/* Takes the packs: *out holds an api_packs. model: its meshes are those of the plan's surfaces. key:
 * of the surfaces and the encoding, so that the packs are cached; NULL: for this request alone. Outcomes as
 * in api_call_take. */
api_outcome api_packs_take(api_call *call, const tw_model *model, const api_plan *plan,
                           const api_packs_query *query, const char *key, api_entry **out);

/* Cached packs of the query, with a reference; or NULL. */
api_entry *api_packs_peek(api_call *call, const api_packs_query *query, const char *key);

/* The bytes that a stream of the packs holds. */
size_t api_packs_reading_size(const api_packs *packs);

#endif
