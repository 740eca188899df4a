/* Boxes of cages and of displacements. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "tweend/format.h"

typedef struct reach {
  float min[3], max[3]; /* of points */
  float most;           /* of displacements */
} reach;

static const reach NOWHERE = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}, 0};

static reach reach_of(const tw_mesh *mesh) {
  reach r = NOWHERE;
  for (uint32_t i = 0; i < mesh->point_count; i++)
    for (int axis = 0; axis < 3; axis++) {
      float value = mesh->positions[3 * (size_t)i + (size_t)axis];
      r.min[axis] = fminf(r.min[axis], value);
      r.max[axis] = fmaxf(r.max[axis], value);
    }
  for (uint32_t target = 0; target < mesh->morph_count; target++)
    for (size_t i = 0; i < 3 * (size_t)mesh->point_count; i++)
      r.most = fmaxf(r.most, fabsf(mesh->morphs[target][i]));
  return r;
}

static void widen(reach *r, const reach *more) {
  for (int axis = 0; axis < 3; axis++) {
    r->min[axis] = fminf(r->min[axis], more->min[axis]);
    r->max[axis] = fmaxf(r->max[axis], more->max[axis]);
  }
  r->most = fmaxf(r->most, more->most);
}

static tw_grid grid_of(const reach *r) {
  tw_grid grid = {.scale = fmaxf(1e-30f, r->most)}; /* all in one point */
  for (int axis = 0; axis < 3 && r->min[0] <= r->max[0]; axis++) {
    grid.origin[axis] = r->min[axis] / 2 + r->max[axis] / 2;
    grid.scale = fmaxf(grid.scale, r->max[axis] - grid.origin[axis]);
    grid.scale = fmaxf(grid.scale, grid.origin[axis] - r->min[axis]);
  }
  return grid;
}

static bool is_skinned(const tw_model *model, const tw_node *node) {
  return node->skin != TW_NO_INDEX && node->mesh != TW_NO_INDEX && model->meshes[node->mesh].skin.joints;
}

static bool is_instanced(const tw_node *node) {
  return node->mesh != TW_NO_INDEX && node->kept && strstr(node->kept, "\"EXT_mesh_gpu_instancing\"");
}

static bool bears_loose(const tw_model *model, const tw_mesh *mesh) {
  return mesh->loose && model->assets;
}

/* Marks the meshes that stay floats, and by a scale below 0 those that skins move. */
static void mark(const tw_model *model, tw_grid *grids) {
  for (uint32_t i = 0; i < model->mesh_count; i++)
    grids[i] = (tw_grid){.is_float = bears_loose(model, &model->meshes[i])};
  for (uint32_t i = 0; i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    if (is_instanced(node)) grids[node->mesh].is_float = true;
    if (is_skinned(model, node)) grids[node->mesh].scale = -1;
  }
}

void tw_grids_choose(const tw_model *model, tw_grid *grids) {
  reach skinned = NOWHERE;
  bool is_float = false;
  mark(model, grids);
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    const reach own = reach_of(&model->meshes[i]);
    if (grids[i].scale < 0) {
      widen(&skinned, &own);
      is_float = is_float || grids[i].is_float;
      continue;
    }
    bool stays_float = grids[i].is_float;
    grids[i] = grid_of(&own);
    grids[i].is_float = stays_float;
  }
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    if (grids[i].scale >= 0) continue;
    grids[i] = grid_of(&skinned);
    grids[i].is_float = is_float;
  }
}
