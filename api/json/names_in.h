/* References by name in tweend JSON. */
#ifndef API_NAMES_IN_H
#define API_NAMES_IN_H

#include "json_value.h"
#include "tweend/retarget.h"

typedef struct api_names_entry {
  const char *text;
  uint32_t index;
} api_names_entry;

/* The names of all elements of one kind, for finding these. An element without a name is called
 * kind_index; where any may be named by its place, so is each, unless another one bears that name. */
typedef struct api_names {
  const char *kind; /* "node" */
  bool has_places;  /* any may be named by its place */
  tw_arena *arena;  /* of the arrays below */
  uint32_t count, sorted_count;
  const char **texts;      /* [count], NULL where there is none */
  api_names_entry *sorted; /* [sorted_count] the names that are there, by text, then index */
} api_names;

/* Reads the names of the `count` elements of an array, which has objects. arena: outlives *out. TW_NO_MEMORY.
 */
tw_status api_names_read(const api_value *array, uint32_t count, const char *kind, tw_arena *arena,
                         api_names *out);

/* Reads a reference by name to one of `all`; an absent member leaves *out alone. O(log n). TW_SYNTAX,
 * TW_INVALID. */
tw_status api_name_find(const api_value *value, const api_names *all, uint32_t *out);

/* Reads {"source node": "target node" or null} into the map of a tw_retarget_wish, the context. TW_LIMIT. */
tw_status api_bone_map_read(void *context, const api_value *object);

#endif
