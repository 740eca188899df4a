/* Makes a new model of a stored one by replacing the cage of a mesh. It is written as a GLB that reads back
 * as the same cages, and stored as an upload of that GLB would be. Mixed clips become keys, with a warning.
 */
#ifndef API_EDITED_MODEL_H
#define API_EDITED_MODEL_H

#include "model_store.h"
#include "models.h"

typedef struct api_edited_model {
  api_call *call;
  const tw_model *model; /* the stored one */
  uint32_t mesh;
  tw_mesh source;            /* the mesh, with the hard edges that its surfaces have by default as creases */
  tw_mesh cage;              /* in the arena of the call */
  const tw_clip_keys *clips; /* [clip_count] of the new model's file; api_edited_model_store finds them */
  uint32_t clip_count;
} api_edited_model;

/* Answers a request that makes a new model of the call's, which is read with the query's `quads`:
 * make(edited) fills in mesh and cage and calls api_edited_model_store. API_NEEDS_THREAD in a light call. */
api_outcome api_edited_model_answer(api_call *call, api_outcome (*make)(api_edited_model *edited));

/* Chooses the mesh by name; NULL: the only mesh. Fills in mesh and source. TW_INVALID, TW_NO_MEMORY. */
tw_status api_edited_model_choose(api_edited_model *edited, const char *name, tw_error *error);

/* Stores the new model under the query's name, else the stored model's, and answers as for an upload. */
api_outcome api_edited_model_store(api_edited_model *edited, const api_addition *addition);

#endif
