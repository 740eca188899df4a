/* Grids for 16-bit positions: each covers the box of a cage, with what its surface has beyond, and its scale
 * the largest displacement. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/format.h"
#include "tweend/json_text.h"
#include "union_find.h"

typedef struct extent {
  float min[3], max[3];   /* of points */
  float displacement_max; /* the largest coordinate of a displacement */
} extent;

static const extent NOWHERE = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}, 0};

static extent extent_of(const tw_mesh *mesh) {
  extent r = NOWHERE;
  for (uint32_t i = 0; i < mesh->point_count; i++)
    for (int axis = 0; axis < 3; axis++) {
      float value = mesh->positions[3 * (size_t)i + (size_t)axis];
      r.min[axis] = fminf(r.min[axis], value);
      r.max[axis] = fmaxf(r.max[axis], value);
    }
  for (uint32_t target = 0; target < mesh->morph_count; target++)
    for (size_t i = 0; i < 3 * (size_t)mesh->point_count; i++)
      r.displacement_max = fmaxf(r.displacement_max, fabsf(mesh->morphs[target][i]));
  return r;
}

static void widen(extent *r, const extent *more) {
  for (int axis = 0; axis < 3; axis++) {
    r->min[axis] = fminf(r->min[axis], more->min[axis]);
    r->max[axis] = fmaxf(r->max[axis], more->max[axis]);
  }
  r->displacement_max = fmaxf(r->displacement_max, more->displacement_max);
}

/* Widens an extent by the points of a surface that may lie outside of the hull of its cage: details move
 * them, and masks of Chaikin's rule are not always convex, for displacements neither. */
static tw_status widen_by_surface(extent *r, const tw_mesh *mesh, const tw_surface *surface,
                                  const tw_parallel_for *parallel) {
  bool is_convex = tw_surface_get_options(surface)->creasing != TW_CREASE_CHAIKIN;
  int targets = is_convex ? 0 : (int)tw_surface_get_layout(surface)->morph_count;
  extent points = NOWHERE;
  if (is_convex && mesh->detail_count == 0) return TW_OK;
  tw_status status = tw_surface_bounds_by(surface, -1, parallel, points.min, points.max);
  for (int target = 0; target < targets && status == TW_OK; target++) {
    float min[3], max[3];
    status = tw_surface_bounds_by(surface, target, parallel, min, max);
    for (int axis = 0; axis < 3 && status == TW_OK; axis++)
      points.displacement_max = fmaxf(points.displacement_max, fmaxf(-min[axis], max[axis]));
  }
  if (status == TW_OK) widen(r, &points);
  return status;
}

static tw_grid grid_of(const extent *r) {
  tw_grid grid = {.scale = fmaxf(1e-30f, r->displacement_max)}; /* not 0 if all points are one */
  for (int axis = 0; axis < 3 && r->min[0] <= r->max[0]; axis++) {
    grid.origin[axis] = r->min[axis] / 2 + r->max[axis] / 2;
    grid.scale = fmaxf(grid.scale, r->max[axis] - grid.origin[axis]);
    grid.scale = fmaxf(grid.scale, grid.origin[axis] - r->min[axis]);
  }
  return grid;
}

static bool is_instanced(const tw_node *node) {
  return node->mesh != TW_NO_INDEX && node->preserved &&
         strstr(node->preserved, "\"EXT_mesh_gpu_instancing\"");
}

static bool bears_loose(const tw_model *model, const tw_mesh *mesh) {
  return mesh->loose && model->assets;
}

/* The node whose weights a JSON pointer names, or one of them; else TW_NO_INDEX. written: a JSON string. */
static uint32_t find_weights(const char *written) {
  static const char nodes[] = "/nodes/", weights[] = "/weights";
  char pointer[256], *end; /* a pointer to weights is shorter, escapes included */
  size_t size = (size_t)(tw_json_skip(written) - written) - 2;
  if (size >= sizeof pointer) return TW_NO_INDEX;
  *tw_json_unescape(written + 1, size, pointer) = '\0';
  if (strncmp(pointer, nodes, strlen(nodes)) != 0) return TW_NO_INDEX;
  unsigned long node = strtoul(pointer + strlen(nodes), &end, 10);
  bool is_weights = strncmp(end, weights, strlen(weights)) == 0 && strchr("/", end[strlen(weights)]);
  return is_weights && node < TW_NO_INDEX ? (uint32_t)node : TW_NO_INDEX;
}

/* KHR_animation_pointer may name the weights of a node, which must then keep its mesh: its positions stay
 * floats. channels: a JSON value. Ends early where the result is no longer wanted. */
static void mark_pointed(const tw_model *model, const char *channels, tw_grid *grids) {
  tw_json_item item;
  uint32_t node = *channels == '"' ? find_weights(channels) : TW_NO_INDEX;
  uint32_t mesh = node < model->node_count ? model->nodes[node].mesh : TW_NO_INDEX;
  if (mesh != TW_NO_INDEX) grids[mesh].is_float = true;
  if (*channels != '{' && *channels != '[') return;
  for (bool more = tw_json_first(channels, &item); more && tw_work(1);
       more = tw_json_next(tw_json_skip(item.value), &item))
    mark_pointed(model, item.value, grids);
}

/* Joins the meshes of each skin into a set, and marks meshes that stay floats. first: [skin_count]
 * scratch. */
static void find_sets(const tw_model *model, uint32_t *sets, uint32_t *first, tw_grid *grids) {
  tw_union_find_init(sets, model->mesh_count);
  for (uint32_t i = 0; i < model->skin_count; i++) first[i] = TW_NO_INDEX;
  for (uint32_t i = 0; i < model->mesh_count; i++)
    grids[i] = (tw_grid){.is_float = bears_loose(model, &model->meshes[i])};
  for (uint32_t i = 0; i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    if (is_instanced(node)) grids[node->mesh].is_float = true;
    if (!tw_node_is_skinned(model, node)) continue;
    if (first[node->skin] == TW_NO_INDEX) first[node->skin] = node->mesh;
    tw_union_find_join(sets, first[node->skin], node->mesh);
  }
  for (uint32_t i = 0; i < model->clip_count; i++)
    if (model->clips[i].loose) mark_pointed(model, model->clips[i].loose, grids);
}

static tw_status choose(const tw_model *model, const tw_surface *const *surfaces,
                        const tw_parallel_for *parallel, uint32_t *sets, extent *extents, tw_grid *grids) {
  for (uint32_t i = 0; i < model->mesh_count; i++) extents[i] = NOWHERE;
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    uint32_t set = tw_union_find_root(sets, i);
    const extent own = extent_of(&model->meshes[i]);
    tw_status status = widen_by_surface(&extents[set], &model->meshes[i], surfaces[i], parallel);
    if (status != TW_OK) return status;
    widen(&extents[set], &own);
    grids[set].is_float = grids[set].is_float || grids[i].is_float;
  }
  for (uint32_t i = 0; i < model->mesh_count; i++) {
    uint32_t set = tw_union_find_root(sets, i);
    bool is_float = grids[set].is_float;
    grids[i] = grid_of(&extents[set]);
    grids[i].is_float = is_float;
  }
  return TW_OK;
}

tw_status tw_grids_choose(const tw_model *model, const tw_surface *const *surfaces,
                          const tw_parallel_for *parallel, tw_grid *grids) {
  uint32_t *sets = tw_alloc(model->mesh_count, sizeof *sets),
           *first = tw_alloc(model->skin_count, sizeof *first);
  extent *extents = tw_alloc(model->mesh_count, sizeof *extents);
  tw_status status = TW_NO_MEMORY;
  if (sets && first && extents) {
    find_sets(model, sets, first, grids);
    status = tw_work_status(NULL);
    if (status == TW_OK) status = choose(model, surfaces, parallel, sets, extents, grids);
  }
  tw_free(sets);
  tw_free(first);
  tw_free(extents);
  return status;
}
