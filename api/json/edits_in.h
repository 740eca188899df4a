/* Reads and applies edits in tweend JSON. */
#ifndef API_EDITS_IN_H
#define API_EDITS_IN_H

#include "json_value.h"
#include "tweend/edit.h"

/* Limits on what the shapes and edits of a document make. */
typedef struct api_making {
  uint64_t faces_max;              /* of all shapes together, and of each mesh that edits make */
  uint64_t bytes_max;              /* that the edits of one mesh may hold at a time */
  const tw_parallel_for *parallel; /* asked whether the edits are cancelled; or NULL */
} api_making;

/* What edits are applied to, and within which limits. */
typedef struct api_edit_call {
  const tw_mesh *mesh;   /* checked */
  const tw_model *model; /* as for tw_mesh_edit */
  const api_making *making;
} api_edit_call;

/* What edits did besides. */
typedef struct api_edits_done {
  const tw_made *made; /* [made_count] what the named edits made */
  uint32_t made_count;
  bool has_mirrored; /* one of them was a mirror */
  tw_edit_losses losses;
} api_edits_done;

/* Reads a list of edits and applies it. *out, and what done has: in the arena of the array's reader. done: or
 * NULL. Errors have a pointer into the list. */
tw_status api_edits_apply(const api_value *array, const api_edit_call *call, tw_mesh *out,
                          api_edits_done *done);

#endif
