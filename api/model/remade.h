/* A new model: a stored one with another cage in place of one of its meshes. It is written as GLB that reads
 * back as the same cages, and stored as an upload of these bytes would be. */
#ifndef API_REMADE_H
#define API_REMADE_H

#include "models.h"

typedef struct api_remade {
  api_call *call;
  const tw_model *model; /* as it is stored */
  api_maker maker;
  uint32_t mesh;
  tw_mesh cage; /* in the arena of the call */
} api_remade;

/* Answers a request for a model that is made of the call's, read as the query's `quads` says: make(remade)
 * finds the cage and stores it. API_NEEDS_THREAD in a light call. */
api_outcome api_remade_answer(api_call *call, api_outcome (*make)(api_remade *remade));

/* Chooses the mesh of a name; NULL: the only one. TW_INVALID. */
tw_status api_remade_choose(api_remade *remade, const char *name, tw_error *error);

/* Stores the new model, by the name of the query, else that of the model it is made of; answers as for an
 * upload. */
api_outcome api_remade_store(api_remade *remade, const api_addition *addition);

#endif
