/* A table of names in an OBJ file. */
#ifndef TWEEND_OBJ_NAMES_H
#define TWEEND_OBJ_NAMES_H

#include "obj_scan.h"

/* A zeroed one is empty. */
typedef struct obj_names {
  obj_word *names; /* [count], in the text, as first written */
  size_t count, capacity;
  uint32_t *slots; /* [2 x capacity], hash table of numbers + 1 */
} obj_names;

/* The number of a name, a new one where it is new. Names are lists of words: what is between two does not
 * matter. TW_NO_MEMORY, TW_LIMIT. */
tw_status obj_number_name(obj_names *names, obj_word name, uint32_t *out, tw_error *error);
void obj_names_deinit(obj_names *names);

#endif
