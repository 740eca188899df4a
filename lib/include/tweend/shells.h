/* Shells: the pieces of a surface, as a printer makes them. */
#ifndef TWEEND_SHELLS_H
#define TWEEND_SHELLS_H

#include "tweend/format.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A set of faces that edges connect. Its edges, as the answer has them: */
typedef struct tw_shell {
  uint64_t faces, triangles;
  uint64_t open_edges;    /* of one face */
  uint64_t crowded_edges; /* of more than two faces */
  uint64_t flipped_edges; /* of two faces that run along it in the same direction */
  double area;            /* of the triangles, in the square of the model's unit */
  double volume;          /* within the triangles where the shell is closed, else 0; below 0: inside out */
  bool is_closed;         /* every edge is of two faces, which run along it in opposite directions */
} tw_shell;

/* Measures the triangles of a surface as answers have them, cut as in STL. *shells: [*count], freed by the
 * caller with tw_free, in the order of their first faces. The sums do not depend on the number of threads.
 * O(faces of the surface), in memory for the shells and the base. parallel: as for tw_surface_create_by.
 * TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_shells_measure(const tw_surface *surface, const tw_parallel_for *parallel, tw_shell **shells,
                            uint32_t *count, tw_error *error);

/* All shells of a surface, or of a flat answer. */
typedef struct tw_solid {
  uint64_t shells, closed, inverted; /* inverted: closed, with a volume below 0 */
  uint64_t triangles, open_edges, crowded_edges, flipped_edges;
  double area, volume; /* of all triangles; of the closed shells */
} tw_solid;

void tw_solid_add(tw_solid *solid, const tw_shell *shell);

/* Measures what tw_flat_stream_create would answer with this scale: each mesh for each node that shows it. As
 * tw_shells_measure; also TW_LIMIT, as that has. */
tw_status tw_scene_measure(const tw_scene *scene, double scale, const tw_parallel_for *parallel,
                           tw_solid *out, tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
