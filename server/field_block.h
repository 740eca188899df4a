/* Fields of an answer as one text, as they go over the wire. Most answers differ from the one before in few
 * fields, whose values are as long as before: only those are written anew. */
#ifndef SRV_FIELD_BLOCK_H
#define SRV_FIELD_BLOCK_H

#include "api.h"

enum { SRV_FIELDS_MAX = API_HEADERS_MAX + 3, SRV_FIELDS_SIZE_MAX = 2 << 10 }; /* of one answer */

/* A value; zeroed it is empty. */
typedef struct srv_field_block {
  size_t count, size;
  struct {
    const char *name;
    size_t at, size; /* of the value in the text */
  } fields[SRV_FIELDS_MAX];
  char text[SRV_FIELDS_SIZE_MAX]; /* the first field's value and behind it the others, without the last line's
                                     end; not terminated */
} srv_field_block;

/* Makes the block hold these fields, at least one. Names live as long as the program. False, and an empty
 * block, when they are too many or too long, or when a value holds what ends a field, or could. */
bool srv_field_block_set(srv_field_block *block, const api_header *fields, size_t count);

#endif
