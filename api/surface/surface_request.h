/* A request for a surface: what its answers share. */
#ifndef API_SURFACE_REQUEST_H
#define API_SURFACE_REQUEST_H

#include "package.h"
#include "plans.h"
#include "surface_scene.h"

/* A request: its parameters, and all that its answer holds. Lives in the answer's arena. */
typedef struct api_surface_request {
  const api_surface_form *form;
  api_surface_query query;
  api_surface_scene scene;
  api_entry *model, *plan, *packs; /* references; packs may be NULL */
  tw_gltf_stream *gltf;
  tw_obj_stream *obj;
  tw_flat_stream *flat;
  api_package *package;
  const tw_solid *solids;       /* [meshes] the shells of each mesh, of forms for printers; NULL: not known */
  uint64_t size, position, end; /* of the whole answer; place and end of what is read of it */
  api_service *service;
  uint64_t faces; /* counted so far, see count_faces */
} api_surface_request;

/* Whether the form is for printers and scanners. */
static inline bool api_is_printed(const api_surface_request *request) {
  return request->form->still && request->form->unit;
}

static inline const api_plan *api_plan_of(const api_surface_request *request) {
  return api_entry_value(request->plan);
}

/* The options of a flat answer under the request's parameters. */
tw_flat_options api_surface_flat_options(const api_surface_request *request, tw_flat_form form);

/* One mesh of the scene by itself, at a node without a name, without materials. Lives in the arena; NULL
 * without memory. */
const tw_scene *api_scene_of_mesh(const api_surface_request *request, uint32_t mesh, tw_arena *arena);

/* ---- counts ---- */

/* Prints the members of a level, or of a mesh there. bytes: of a GLB; API_SIZE_UNKNOWN is null. */
void api_surface_print_counts(tw_text *text, uint64_t level, const tw_surface_counts *counts, uint64_t bytes);

/* Prints how far the triangles may be from the limit surface; null where that is not known. */
void api_surface_print_error(tw_text *text, double error);

/* Answers surface.json. bytes: of the GLB. */
api_outcome api_surface_reply_counts(api_call *call, const api_surface_request *request, uint64_t bytes);

#endif
