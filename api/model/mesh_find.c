/* Finds the mesh that a request names. */
#include "models.h"
#include "near_names.h"

#include <stdio.h>
#include <string.h>

enum { MESH_NAME = 24 }; /* of a made-up name */

/* A mesh without a name is called mesh_0 by its index. */
static const char *mesh_name(const tw_model *model, uint32_t i, char buffer[MESH_NAME]) {
  if (model->meshes[i].name) return model->meshes[i].name;
  snprintf(buffer, MESH_NAME, "mesh_%u", i);
  return buffer;
}

/* Fails where no mesh is named but there are several, or none: lists as many as fit. */
static tw_status fail_unnamed(const tw_model *model, tw_error *error) {
  if (model->mesh_count == 0) return tw_fail(error, TW_INVALID, "the model has no mesh");
  char list[96] = "", buffer[MESH_NAME];
  size_t used = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    int more = snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", mesh_name(model, i, buffer));
    if (more < 0 || (size_t)more >= sizeof list - used) break;
    used += (size_t)more;
  }
  list[used] = '\0';
  return tw_fail(error, TW_INVALID, "the model has %u meshes: name one of them as mesh; there are: %s",
                 model->mesh_count, list);
}

tw_status api_mesh_find(const tw_model *model, const char *name, uint32_t *out, tw_error *error) {
  *out = 0;
  if (!name && model->mesh_count == 1) return TW_OK;
  if (!name) return fail_unnamed(model, error);
  api_near near = {.name = name, .length = strlen(name)};
  uint32_t found = 0;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    char buffer[MESH_NAME];
    const char *own = mesh_name(model, i, buffer);
    api_near_consider(&near, own);
    if (strcmp(own, name) != 0) continue;
    found++;
    *out = i;
  }
  if (found > 1) return tw_fail(error, TW_INVALID, "more than one mesh is called \"%.60s\"", name);
  if (found == 1) return TW_OK;
  return tw_fail(error, TW_INVALID, "no mesh is called \"%.60s\"%s", name, api_near_print(&near, "; ").text);
}
