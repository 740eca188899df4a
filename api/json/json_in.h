/* tweend JSON to models. */
#ifndef API_JSON_IN_H
#define API_JSON_IN_H

#include "json_value.h"
#include "tweend/model.h"

/* Values of any kind in one document: a node of cJSON's tree takes some 80 bytes. */
enum { API_JSON_VALUES_MAX = 10000000 };

/* Reads a document of tweend JSON. *out: a finished model. Errors bear a pointer: TW_SYNTAX for what
 * is no such document, TW_INVALID for one that makes no usable model. */
tw_status api_model_from_json(const char *text, size_t size, tw_model **out, tw_error *error);

/* ---- its parts ---- */

tw_status api_mesh_from_json(const api_json *json, const api_place *at, const cJSON *item, tw_mesh *out);

/* The names of one kind of thing, to find them by. */
typedef struct api_name {
  const char *name;
  uint32_t index;
} api_name;

typedef struct api_names {
  uint32_t count;
  const api_name *sorted;
} api_names;

/* names: [count], terminated. Keeps the pointers. */
tw_status api_names_sort(const api_json *json, const char *const *names, uint32_t count, api_names *out);

/* Reads a name that refers to one of `names`, which are of `kind` ("node"). TW_INVALID when there is none
 * of that name, or more than one. O(log n). */
tw_status api_json_reference(const api_json *json, const api_place *at, const cJSON *item,
                             const api_names *names, const char *kind, uint32_t *out);

tw_status api_clip_from_json(const api_json *json, const api_place *at, const cJSON *item,
                             const api_names *nodes, tw_clip_keys *out);

#endif
