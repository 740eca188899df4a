/* From a refined mesh back to a cage whose surface it is. */
#ifndef TWEEND_COARSEN_H
#define TWEEND_COARSEN_H

#include "tweend/subdiv.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct tw_coarsened {
  tw_mesh mesh;
  uint32_t levels; /* steps back, at least 1 */
  /* The greatest distance between a point of the mesh and the same one of the cage's surface, over all steps
   * taken together at most. */
  double error;
  double size; /* of the mesh's bounds, their longest side */
  /* The error is at most 1e-5 of the size: about what rounding to float and the way back leave. Else the cage
   * has a detail of level `levels`, by which its surface of that level is the mesh. */
  bool fits;
  /* Some of the cage's points could be elsewhere as well: of a closed piece where three edges meet
   * everywhere, what alternates from point to point vanishes in one step. The cage has none of it. */
  bool is_ambiguous;
} tw_coarsened;

/* The cage of which a checked mesh is a refinement, by options->scheme, not bilinear, with a border of edges,
 * or of edges and corners. Takes back up to options->level steps; connectivity says whether there is one, in
 * each piece, and where it allows several cages, positions do. The first step back is taken however far the
 * positions are from a surface; further ones, after one that fits, only
 * where they fit as well. Of the points that stay the cage has what subdivides, solved for: positions,
 * texture coordinates, attributes, displacements; and joints with their weights as they are. Edges and points
 * that are sharp after n steps were sharper by n; what was sharp and is not any more is not known. A face has
 * the material and the groups of its first child. Normals, and what is modelled onto levels of the mesh, do
 * not come along. Arrays of the result live in the arena, or are the mesh's. TW_INVALID: no refinement, which
 * names the first face of the piece; an option that has no way back; a cage that tw_mesh_check refuses, as
 * what it would have is too far away. TW_LIMIT, TW_CANCELLED, TW_NO_MEMORY. parallel: asked whether the
 * result is still wanted; or NULL. O(corners) for each step but for the solving, see subdiv/mask_inverse.h.
 */
tw_status tw_mesh_coarsen(const tw_mesh *mesh, const tw_surface_options *options,
                          const tw_parallel_for *parallel, tw_arena *arena, tw_coarsened *out,
                          tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
