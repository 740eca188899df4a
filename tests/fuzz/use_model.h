/* Uses a model as the api may use every model that was read. */
#ifndef USE_MODEL_H
#define USE_MODEL_H

#include "tweend/format.h"

/* Describes and poses the model. If it is small: writes answers in every encoding, its cages and its clips as
 * BVH, which are read back; cleans its meshes, coarsens them and their first levels, and sculpts the latter.
 * Destroys the model. */
void use_model(tw_model *model);

#endif
