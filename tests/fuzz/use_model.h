/* What every model that was read must be good for. */
#ifndef USE_MODEL_H
#define USE_MODEL_H

#include "tweend/format.h"

/* Describes and poses the model; writes answers of a small one in every encoding and its cages, which are
 * read back; cleans its meshes as scans, looks for cages of them and of their first levels, and models onto
 * these; destroys it.
 */
void use_model(tw_model *model);

#endif
