/* level=auto: the level that an error or a number of faces needs. */
#ifndef API_AUTO_LEVEL_H
#define API_AUTO_LEVEL_H

#include "surface_scene.h"

/* How far each level of the scene's meshes is at most from its limit surface, in the unit of the model: a
 * node's scale counts. */
typedef struct api_level_errors {
  uint32_t levels; /* that are told, from 0 */
  uint32_t count;  /* meshes of the scene */
  double size;     /* the diagonal of the box around the cages as the scene has them */
  double *of_mesh; /* [count][levels]; INFINITY: not known */
} api_level_errors;

/* Finds those of all levels, once for all requests for the same meshes; call after api_scene_pose. *out lives
 * in the call's arena. api_level_choose tells no more of a level. Outcomes as in api_call_take; 422 where
 * levels shrink. */
api_outcome api_level_errors_take(api_call *call, const api_surface_scene *scene, api_level_errors *out);

/* The greatest error of a level. */
double api_level_error_of(const api_level_errors *errors, uint32_t level);

/* Chooses the levels of the scene's query, whose level is `auto`; call after api_scene_pose. Sets
 * X-Tweend-Level and X-Tweend-Error, and warns of an error that is not reached. 422 where an error that was
 * asked for by itself is not reached at --max-level. */
api_outcome api_level_choose(api_call *call, api_surface_scene *scene);

#endif
