/* What a body is that is no model, for the answer that says so. */
#ifndef API_FOREIGN_H
#define API_FOREIGN_H

#include "api.h"

/* In words that go on with "the body looks like". */
typedef struct api_foreign {
  const char *name;   /* "PNG"; NULL: it may be a model */
  const char *advice; /* what to do about it, or NULL */
} api_foreign;

/* By the marks of formats that are often sent by mistake. O(size). */
api_foreign api_foreign_known(api_bytes bytes);

/* Of bytes without such marks that nothing but an OBJ could be: text or data without any line of an OBJ.
 * O(size).
 */
api_foreign api_foreign_other(api_bytes bytes);

#endif
