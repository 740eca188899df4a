/* Edits in tweend JSON. */
#ifndef API_EDITS_IN_H
#define API_EDITS_IN_H

#include "json_value.h"
#include "tweend/edit.h"

/* What the shapes and edits of a document may make, and the memory for it. */
typedef struct api_making {
  uint64_t faces_max; /* of what all shapes make, and of each mesh that edits make */
  uint64_t bytes_max; /* that the edits of a mesh may hold on the way */
  /* Grants `bytes` in all beside what reading the text takes; false ends the reading with TW_NO_MEMORY. NULL:
   * there is memory. */
  bool (*grant)(void *context, uint64_t bytes);
  void *context;
  const tw_parallel_for *parallel; /* asked whether the edits are still wanted; or NULL */
} api_making;

/* What edits are applied to, and how far they may go. */
typedef struct api_edit_call {
  const tw_mesh *mesh;   /* checked */
  const tw_model *model; /* as of tw_mesh_edit */
  const api_making *making;
  uint64_t granted; /* beside what the edits take */
} api_edit_call;

/* Reads the list and applies it. *out: in the arena of the array's reader. made: NULL, or what the named ones
 * made: *made [*made_count]. Errors bear a pointer into the list. */
tw_status api_edits_apply(const api_value *array, const api_edit_call *call, tw_mesh *out, tw_made **made,
                          uint32_t *made_count);

#endif
