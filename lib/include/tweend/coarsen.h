/* From a refined mesh back to the cage that it is a subdivision of. */
#ifndef TWEEND_COARSEN_H
#define TWEEND_COARSEN_H

#include "tweend/subdiv.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct tw_coarsened {
  tw_mesh mesh;
  uint32_t levels; /* steps taken back, at least 1 */
  /* The errors of all steps summed up: an upper bound of the distance between a point of the mesh and the
   * same point of the cage's surface. */
  double error;
  double size; /* longest side of the mesh's bounds */
  /* The greatest distance of a step between texture coordinates, attributes or displacements of morph targets
   * and the refined ones of the cage, as a share of their range. Joints and weights of the cage are those of
   * the mesh at the same points. */
  double strays;
  /* The error is at most 1e-5 of the size, about what rounding to float and the steps back leave. Otherwise
   * the cage has a detail of level `levels`, with which its surface of that level equals the mesh. */
  bool fits;
  /* The cage is not unique: on a closed piece with valence 3 everywhere, an offset that alternates in sign
   * from point to point vanishes in one step. The cage is the one without such an offset. */
  bool is_ambiguous;
  /* Faces of all steps whose children differ in material, groups, smoothing group, or in whether they are
   * holes: they have what their first child has. */
  uint32_t parted;
  /* Tagged edges and points of all steps that refining the cage would give another sharpness, or none: on no
   * edge and at no point of the cage, or an edge whose other half differs. */
  uint32_t untagged;
} tw_coarsened;

/* Finds the cage of which a checked mesh is a refinement, by options->scheme (not bilinear), with
 * options->boundary of edges or of edges and corners. Takes back up to options->level steps.
 * Connectivity tells in each piece whether a step back exists; where it allows several cages, positions
 * decide. The first step is taken however far the positions are from a subdivided surface. After a first step
 * that fits, further steps are taken only as long as they fit too.
 * The cage has, solved for its points: positions, texture coordinates, attributes, displacements. Joints and
 * weights are copied. An edge or point that is sharp after n steps gets its sharpness plus n, or with
 * Chaikin's rule that from which the step makes it; sharpness that has already decayed to 0 cannot be known.
 * A face has the material and the groups of its first child. Normals, and details modelled onto levels of the
 * mesh, are dropped. Arrays of the result live in the arena, or are the mesh's. parallel: asked whether the
 * result is still wanted; or NULL. O(corners) for each step besides the solving, see sculpt/mask_inverse.h.
 * TW_INVALID: the mesh is no refinement (the error names a face of the piece that is none); an option that
 * has no way back; a solved cage that tw_mesh_check refuses, as its points are too far away. TW_LIMIT,
 * TW_CANCELLED, TW_NO_MEMORY. */
tw_status tw_mesh_coarsen(const tw_mesh *mesh, const tw_surface_options *options,
                          const tw_parallel_for *parallel, tw_arena *arena, tw_coarsened *out,
                          tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
