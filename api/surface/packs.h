/* The packs of a plan's surfaces: what quantized and compressed answers are made of. */
#ifndef API_PACKS_H
#define API_PACKS_H

#include "plans.h"

/* Immutable. */
typedef struct api_packs {
  uint32_t count;
  tw_packs **list; /* [count], one a mesh */
} api_packs;

/* Which ones. */
typedef struct api_packs_query {
  tw_encoding encoding;
  tw_polygons polygons;
  bool is_measured;
} api_packs_query;

/* Prints the encoding for keys and entity tags, with the version of the codec, which may change bytes. */
void api_encoding_print(tw_encoding encoding, tw_text *text);

/* The packs: *out holds an api_packs. model: whose meshes the plan's surfaces are. key: of the surfaces, for
 * packs that stay for others; NULL: of this request alone. As api_call_take. */
api_outcome api_packs_take(api_call *call, const tw_model *model, const api_plan *plan,
                           const api_packs_query *query, const char *key, api_entry **out);

/* Measured packs that are there already, with a reference; or NULL. */
api_entry *api_packs_peek(api_call *call, const api_packs_query *query, const char *key);

/* What a stream of them holds. */
size_t api_packs_reading_size(const api_packs *packs);

#endif
