/* Places meshes in world space. Translations are also summed up as doubles: far from the origin floats would
 * move the parts of a model against each other. */
#include "placement.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "instances.h"

typedef struct world_nodes {
  float *matrices;      /* [node_count][16] */
  double (*origins)[3]; /* [node_count] exact translations */
} world_nodes;

/* origin = the parent's origin + its linear part * a translation below it. */
static void sum_up(const float parent[16], const double above[3], const double below[3], double origin[3]) {
  for (int row = 0; row < 3; row++) {
    origin[row] = above[row];
    for (int column = 0; column < 3; column++)
      origin[row] += (double)parent[4 * column + row] * below[column];
  }
}

/* Makes origins of the translations of `locals`, the local matrices; both by node. */
static void find_origins(const tw_model *model, const float *locals, world_nodes *world) {
  for (uint32_t i = 0; i < model->node_count; i++) {
    uint32_t node = model->node_order[i], parent = model->nodes[node].parent;
    double local[3];
    for (int c = 0; c < 3; c++)
      local[c] = (double)locals[16 * (size_t)node + 12 + (size_t)c] + tw_node_fine(&model->nodes[node], c);
    if (parent == TW_NO_INDEX)
      memcpy(world->origins[node], local, sizeof local);
    else
      sum_up(world->matrices + 16 * (size_t)parent, world->origins[parent], local, world->origins[node]);
  }
}

/* False without memory. */
static bool find_world(const tw_scene *scene, world_nodes *out) {
  const tw_model *model = scene->model;
  tw_trs *poses = tw_alloc(model->node_count, sizeof *poses);
  float *locals = tw_alloc(model->node_count, 16 * sizeof *locals);
  out->matrices = tw_alloc(model->node_count, 16 * sizeof *out->matrices);
  out->origins = tw_alloc(model->node_count, sizeof *out->origins);
  bool has_memory = poses && locals && out->matrices && out->origins;
  for (uint32_t i = 0; has_memory && i < model->node_count; i++)
    poses[i] = scene->pose ? scene->pose[i] : model->nodes[i].rest;
  if (has_memory) {
    tw_pose_locals(scene->posed_by, model->nodes, model->node_count, poses, locals);
    tw_pose_world(model->nodes, model->node_order, model->node_count, locals, out->matrices);
    find_origins(model, locals, out);
  }
  tw_free(poses);
  tw_free(locals);
  return has_memory;
}

/* The corners of the box round a mesh, which stands for it where it is shown many times. */
static void find_box(const tw_mesh *mesh, float box[8][3]) {
  float low[3] = {0}, high[3] = {0};
  for (uint32_t i = 0; i < mesh->corner_count; i++) {
    const float *at = mesh->positions + 3 * (size_t)mesh->corners[i];
    for (int c = 0; c < 3; c++) {
      if (i == 0 || at[c] < low[c]) low[c] = at[c];
      if (i == 0 || at[c] > high[c]) high[c] = at[c];
    }
  }
  for (int corner = 0; corner < 8; corner++)
    for (int c = 0; c < 3; c++) box[corner][c] = corner >> c & 1 ? high[c] : low[c];
}

static const uint32_t box_corners[8] = {0, 1, 2, 3, 4, 5, 6, 7};

/* Places the first `count` instances of a node. */
static void place_instances(const tw_scene *scene, const world_nodes *world, uint32_t node,
                            const tw_instances *instances, uint32_t count, tw_placement *out) {
  const uint32_t mesh = scene->model->nodes[node].mesh;
  const float *above = world->matrices + 16 * (size_t)node;
  float box[8][3];
  find_box(&scene->model->meshes[mesh], box);
  const tw_mesh stand_in = {.positions = *box, .point_count = 8, .corners = box_corners, .corner_count = 8};
  for (uint32_t i = 0; i < count; i++, out++) {
    tw_trs local;
    float matrix[16];
    *out = (tw_placement){.node = node, .mesh = mesh};
    tw_instances_read(instances, i, &local);
    tw_trs_to_matrix(&local, matrix);
    tw_matrix_multiply(above, matrix, out->world);
    sum_up(above, world->origins[node],
           (const double[3]){(double)matrix[12], (double)matrix[13], (double)matrix[14]}, out->origin);
    out->is_far = tw_shows_far(out->world, &stand_in);
  }
}

/* Places a node that shows its mesh `count` times. */
static void place_node(const tw_scene *scene, const world_nodes *world, uint32_t node, uint32_t count,
                       tw_placement *out) {
  tw_instances instances;
  if (tw_instances_find(scene->model, node, &instances)) {
    place_instances(scene, world, node, &instances, count, out);
    return;
  }
  *out = (tw_placement){.node = node, .mesh = scene->model->nodes[node].mesh};
  memcpy(out->world, world->matrices + 16 * (size_t)node, sizeof out->world);
  memcpy(out->origin, world->origins[node], sizeof out->origin);
  out->is_far = tw_shows_far(out->world, &scene->model->meshes[out->mesh]);
}

static void free_world(world_nodes *world) {
  tw_free(world->matrices);
  tw_free(world->origins);
}

/* How often a node shows a mesh with faces. */
static uint64_t count_places(const tw_scene *scene, uint32_t node) {
  uint64_t times = tw_node_times_shown(scene->model, node);
  if (times == 0) return 0;
  const tw_surface *surface = scene->surfaces[scene->model->nodes[node].mesh];
  return tw_surface_get_counts(surface)->faces > 0 ? times : 0;
}

bool tw_placements_find(const tw_scene *scene, tw_placements *out) {
  const tw_model *model = scene->model;
  enum { STEPS_A_PLACE = 32 };
  uint64_t count = 0;
  world_nodes world = {0};
  *out = (tw_placements){0};
  for (uint32_t i = 0; i < model->node_count; i++) count += count_places(scene, i);
  if (count < UINT32_MAX && tw_work(count * STEPS_A_PLACE))
    out->items = tw_alloc((size_t)count, sizeof *out->items);
  bool has_memory = out->items && find_world(scene, &world);
  for (uint32_t i = 0; has_memory && i < model->node_count; i++) {
    uint32_t places = (uint32_t)count_places(scene, i);
    if (places > 0) place_node(scene, &world, i, places, out->items + out->count);
    out->count += places;
  }
  free_world(&world);
  return has_memory;
}

bool tw_node_first_place(const tw_model *model, uint32_t node, tw_placement *out) {
  const tw_scene rest = {.model = model};
  world_nodes world = {0};
  bool has_memory = find_world(&rest, &world);
  if (has_memory) place_node(&rest, &world, node, 1, out);
  free_world(&world);
  return has_memory;
}

uint32_t tw_placements_count_far(const tw_scene *scene, const tw_placements *places, const double origin[3]) {
  uint32_t count = 0;
  float box[8][3];
  const tw_mesh stand_in = {.positions = *box, .point_count = 8, .corners = box_corners, .corner_count = 8};
  for (uint32_t i = 0; i < places->count; i++) {
    const tw_placement *place = &places->items[i];
    float world[16];
    if (i == 0 || place->mesh != place[-1].mesh) find_box(&scene->model->meshes[place->mesh], box);
    memcpy(world, place->world, sizeof world);
    for (int c = 0; c < 3; c++) world[12 + c] = (float)(place->origin[c] - origin[c]);
    count += tw_shows_far(world, &stand_in);
  }
  return count;
}

/* Whether the corners of a box have places in floats. */
static bool is_box_beyond(const float world[16], float box[8][3], double scale) {
  for (int corner = 0; corner < 8; corner++)
    for (int row = 0; row < 3; row++) {
      double at = (double)world[12 + row];
      for (int c = 0; c < 3; c++) at += (double)world[4 * c + row] * (double)box[corner][c];
      if (!(fabs(scale * at) <= (double)FLT_MAX)) return true;
    }
  return false;
}

bool tw_placements_are_beyond(const tw_scene *scene, const tw_placements *places, double scale) {
  /* No coordinate can exceed the sum of four parts of this. */
  const double plain = (double)FLT_MAX / 4 / (scale * (double)TW_COORDINATE_MAX);
  for (uint32_t i = 0; i < places->count; i++) {
    const tw_placement *place = &places->items[i];
    bool is_plain = true;
    float box[8][3];
    for (int k = 0; k < 16; k++) is_plain &= fabs((double)place->world[k]) <= plain;
    if (is_plain) continue;
    find_box(&scene->model->meshes[place->mesh], box);
    if (is_box_beyond(place->world, box, scale)) return true;
  }
  return false;
}

void tw_placements_deinit(tw_placements *placements) {
  tw_free(placements->items);
}
