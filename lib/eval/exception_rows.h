/* The rows of exceptions: their points, and the masks of their normals and tangents. */
#ifndef TWEEND_EXCEPTION_ROWS_H
#define TWEEND_EXCEPTION_ROWS_H

#include "feature_mesh.h"

/* Lists the rows that the loops get wrong, by the feature mesh of the last level. TW_LIMIT where they take
 * too long to read; TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_exceptions_list_rows(const tw_exceptions *l, const tw_feature_mesh *s);

#endif
