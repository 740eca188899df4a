/* Recognises bodies that are no model, for the error that says what they are. */
#ifndef API_FOREIGN_H
#define API_FOREIGN_H

#include "api.h"

/* Words that continue "the body looks like". */
typedef struct api_foreign {
  const char *name;   /* "PNG"; NULL: it may be a model */
  const char *advice; /* what to do about it, or NULL */
} api_foreign;

/* Recognises formats that are often sent by mistake, by their signatures. O(size). */
api_foreign api_foreign_known(api_bytes bytes);

/* For bytes without such a signature that could only be an OBJ: names text or data that has no line of an
 * OBJ. O(size). */
api_foreign api_foreign_other(api_bytes bytes);

#endif
