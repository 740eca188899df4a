/* The shells of a surface: sets of faces that edges connect. */
#ifndef TWEEND_FACE_SHELLS_H
#define TWEEND_FACE_SHELLS_H

#include "tweend/subdiv.h"

/* The edges of a shell, as many as the answer has. */
typedef struct tw_shell_edges {
  uint64_t open, crowded, flipped; /* as in tw_shell */
} tw_shell_edges;

typedef struct tw_face_shells {
  const tw_surface *surface;
  uint32_t count;
  /* [faces of the surface's base, then of its rim's] the shell of each, UINT32_MAX for faces left out. */
  uint32_t *of;
  tw_shell_edges *edges; /* [count] */
} tw_face_shells;

/* Finds the shells of a surface, in the order of their first faces in the base. O(corners of the base).
 * TW_NO_MEMORY, TW_CANCELLED; then too it must be deinited. */
tw_status tw_face_shells_find(const tw_surface *surface, tw_face_shells *out, tw_error *error);
void tw_face_shells_deinit(tw_face_shells *shells);

/* The shell of a face of the answer. */
uint32_t tw_face_shell(const tw_face_shells *shells, uint64_t face);

#endif
