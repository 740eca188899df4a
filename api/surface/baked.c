/* Baking has two parts. Which meshes move, and how they look without skins and targets, depends on the model
 * alone: the plan is made of these meshes, one plan for all times. The positions at a time are applied to
 * it. */
#include "baked.h"

#include "service.h"

#include <string.h>

tw_model *api_copy_nodes(tw_arena *arena, const tw_model *model, uint32_t more) {
  tw_model *copy = tw_arena_alloc(arena, 1, sizeof *copy);
  size_t nodes = (size_t)model->node_count + more;
  tw_node *node = tw_arena_alloc(arena, nodes, sizeof *node);
  uint32_t *order = tw_arena_alloc(arena, nodes, sizeof *order);
  if (!copy || !node || !order) return NULL;
  if (model->node_count) memcpy(node, model->nodes, model->node_count * sizeof *node);
  if (model->node_count) memcpy(order, model->node_order, model->node_count * sizeof *order);
  *copy = *model;
  copy->nodes = node;
  copy->node_order = order;
  return copy;
}

/* ---- what moves ------------------------------------------------------------------------------ */

static bool is_moved(const tw_model *model, const tw_node *node) {
  return node->mesh != TW_NO_INDEX &&
         (tw_node_is_skinned(model, node) || model->meshes[node->mesh].morph_count);
}

bool api_bakes(const tw_model *model) {
  for (uint32_t i = 0; i < model->node_count; i++)
    if (is_moved(model, &model->nodes[i])) return true;
  return false;
}

/* The moved meshes, once for each node that shows them, and their points. */
typedef struct moved_counts {
  uint32_t meshes;
  uint64_t points;
} moved_counts;

/* Counts what moves, and checks that an answer can hold it. */
static api_outcome count_moved(api_call *call, const tw_model *model, moved_counts *out) {
  uint64_t limit = call->service->limits.max_output / (3 * sizeof(float));
  for (uint32_t i = 0; i < model->node_count; i++) {
    if (!is_moved(model, &model->nodes[i])) continue;
    out->points += model->meshes[model->nodes[i].mesh].point_count;
    out->meshes++;
  }
  if (out->points <= limit && out->meshes < UINT32_MAX - model->node_count &&
      out->meshes < UINT32_MAX - model->mesh_count)
    return API_DONE;
  return api_fail_with(call, 422, "skin=bake would move %llu points, over the limit of %llu",
                       (unsigned long long)out->points, (unsigned long long)limit);
}

/* The meshes of the plan, and the place of each mesh of the model among them. */
typedef struct plan_layout {
  tw_mesh *meshes;  /* the still meshes, then the moved ones, each once */
  uint32_t *uses;   /* how often each is in the answer */
  uint32_t *still;  /* [model meshes] place of the still mesh; TW_NO_INDEX where only moved nodes show it */
  uint32_t *moving; /* [model meshes] place of the moved mesh, else TW_NO_INDEX */
  uint32_t still_count, count;
} plan_layout;

static bool create_layout(tw_arena *arena, uint32_t mesh_count, plan_layout *layout) {
  layout->meshes = tw_arena_alloc(arena, 2 * (size_t)mesh_count, sizeof *layout->meshes);
  layout->uses = tw_arena_alloc(arena, 2 * (size_t)mesh_count, sizeof *layout->uses);
  layout->still = tw_arena_alloc(arena, mesh_count, sizeof *layout->still);
  layout->moving = tw_arena_alloc(arena, mesh_count, sizeof *layout->moving);
  return layout->meshes && layout->uses && layout->still && layout->moving;
}

static tw_mesh without_deformers(const tw_mesh *mesh) {
  tw_mesh bare = *mesh;
  bare.skin = (tw_skin_weights){0};
  bare.morph_count = 0;
  bare.morphs = NULL;
  bare.morph_weights = NULL;
  return bare;
}

static void fill_layout(const tw_model *model, plan_layout *layout) {
  uint32_t *moved = layout->moving, *shown = layout->still; /* at first: number of nodes that show the mesh */
  for (uint32_t i = 0; i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    if (node->mesh != TW_NO_INDEX) (is_moved(model, node) ? moved : shown)[node->mesh]++;
  }
  for (uint32_t m = 0; m < model->mesh_count; m++) {
    bool stays = shown[m] || !moved[m]; /* a mesh that no node shows stays too */
    layout->still[m] = stays ? layout->count : TW_NO_INDEX;
    if (!stays) continue;
    layout->meshes[layout->count] = model->meshes[m];
    layout->uses[layout->count++] = 1;
  }
  layout->still_count = layout->count;
  for (uint32_t m = 0; m < model->mesh_count; m++) {
    uint32_t uses = moved[m];
    layout->moving[m] = uses ? layout->count : TW_NO_INDEX;
    if (!uses) continue;
    layout->meshes[layout->count] = without_deformers(&model->meshes[m]);
    layout->uses[layout->count++] = uses;
  }
}

/* ---- deformation ----------------------------------------------------------------------------- */

/* What deforming needs besides the model. */
typedef struct deformer {
  const tw_clip *clip; /* NULL: at rest */
  float time;
  tw_trs *locals;  /* [nodes + moved meshes] */
  float *matrices; /* [nodes][16], world matrices */
  float *weights;  /* [TW_MORPH_TARGETS_MAX] */
  float *joints;   /* [joints of the largest skin][16] */
} deformer;

static bool create_deformer(tw_arena *arena, const tw_model *model, uint32_t moved, deformer *d) {
  uint32_t joints = 0;
  for (uint32_t i = 0; i < model->skin_count; i++)
    if (model->skins[i].joint_count > joints) joints = model->skins[i].joint_count;
  d->locals = tw_arena_alloc(arena, (size_t)model->node_count + moved, sizeof *d->locals);
  d->matrices = tw_arena_alloc(arena, model->node_count, 16 * sizeof *d->matrices);
  d->weights = tw_arena_alloc(arena, TW_MORPH_TARGETS_MAX, sizeof *d->weights);
  d->joints = tw_arena_alloc(arena, joints, 16 * sizeof *d->joints);
  return d->locals && d->matrices && d->weights && d->joints;
}

static void pose_nodes(const tw_model *model, deformer *d) {
  for (uint32_t i = 0; i < model->node_count; i++) d->locals[i] = model->nodes[i].rest;
  if (d->clip) tw_clip_pose(d->clip, model->nodes, model->node_count, d->time, d->locals);
  tw_pose_locals(d->clip, model->nodes, model->node_count, d->locals, d->matrices);
  tw_pose_world(model->nodes, model->node_order, model->node_count, d->matrices, d->matrices);
}

/* Computes the points of a node's mesh as morph weights and joints move them. */
static tw_status deform_mesh(tw_arena *arena, const tw_model *model, const deformer *d, uint32_t index,
                             float **out, tw_error *error) {
  const tw_node *node = &model->nodes[index];
  const tw_mesh *mesh = &model->meshes[node->mesh];
  uint32_t track = d->clip ? tw_clip_find(d->clip, index, TW_WEIGHTS) : TW_NO_INDEX, joint_count = 0;
  bool has_weights = track != TW_NO_INDEX && tw_clip_width(d->clip, track) == mesh->morph_count;
  *out = tw_arena_alloc(arena, mesh->point_count, 3 * sizeof **out);
  if (!*out) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (has_weights) tw_clip_sample(d->clip, track, &d->time, 1, d->weights);
  if (tw_node_is_skinned(model, node)) {
    tw_skin_matrices(&model->skins[node->skin], d->matrices, d->joints);
    joint_count = model->skins[node->skin].joint_count;
  }
  return tw_mesh_deform(mesh, has_weights ? d->weights : node->weights, joint_count ? d->joints : NULL,
                        joint_count, *out, error);
}

/* ---- the scene ------------------------------------------------------------------------------- */

/* The meshes of the answer: the still ones of the plan, then one for each moved node. */
typedef struct answer_meshes {
  tw_mesh *meshes;
  uint32_t *of;
  const float **positions;
  uint32_t count;
} answer_meshes;

static bool create_meshes(tw_arena *arena, const plan_layout *layout, uint32_t moved, answer_meshes *out) {
  size_t most = (size_t)layout->still_count + moved;
  out->meshes = tw_arena_alloc(arena, most, sizeof *out->meshes);
  out->of = tw_arena_alloc(arena, most, sizeof *out->of);
  out->positions = tw_arena_alloc(arena, most, sizeof *out->positions);
  if (!out->meshes || !out->of || !out->positions) return false;
  for (; out->count < layout->still_count; out->count++) {
    out->meshes[out->count] = layout->meshes[out->count];
    out->of[out->count] = out->count;
  }
  return true;
}

static uint32_t add_moved(answer_meshes *out, const plan_layout *layout, uint32_t place,
                          const float *positions) {
  out->meshes[out->count] = layout->meshes[place];
  out->meshes[out->count].positions = positions;
  out->of[out->count] = place;
  out->positions[out->count] = positions;
  return out->count++;
}

/* Attaches a moved mesh to its node. */
static void attach_mesh(tw_model *baked, uint32_t index, uint32_t mesh) {
  baked->nodes[index].skin = TW_NO_INDEX;
  baked->nodes[index].mesh = mesh;
}

/* Attaches a skinned mesh, whose joints lead to the world, to a new root node in place of its own. That had
 * no part in where the points are, but where it mirrors, faces are seen from the other side
 * (glTF 2.0, 3.7.4): then the new node mirrors too, and the points are mirrored before. */
static void attach_skinned(tw_model *baked, uint32_t index, uint32_t mesh, bool is_mirrored, tw_trs *locals) {
  tw_node *node = &baked->nodes[index];
  tw_trs place = TW_TRS_IDENTITY;
  node->skin = node->mesh = TW_NO_INDEX;
  if (is_mirrored) place.scale[0] = -1;
  uint32_t added = baked->node_count++;
  baked->nodes[added] = (tw_node){.name = node->name,
                                  .parent = TW_NO_INDEX,
                                  .mesh = mesh,
                                  .skin = TW_NO_INDEX,
                                  .rest = place,
                                  .is_hidden = node->is_hidden};
  baked->node_order[added] = added;
  locals[added] = place;
}

static tw_status place_meshes(tw_arena *arena, const tw_model *model, const deformer *d,
                              const plan_layout *layout, tw_model *baked, answer_meshes *out,
                              tw_error *error) {
  for (uint32_t i = 0; i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    if (node->mesh == TW_NO_INDEX) continue;
    if (!is_moved(model, node)) {
      baked->nodes[i].mesh = layout->still[node->mesh];
      continue;
    }
    float *positions;
    tw_status status = deform_mesh(arena, model, d, i, &positions, error);
    if (status != TW_OK) return status;
    uint32_t mesh = add_moved(out, layout, layout->moving[node->mesh], positions);
    if (!tw_node_is_skinned(model, node)) {
      attach_mesh(baked, i, mesh);
      continue;
    }
    double ignored[9];
    bool is_mirrored = tw_matrix_cofactors(d->matrices + 16 * (size_t)i, ignored) < 0;
    for (uint32_t p = 0; is_mirrored && p < out->meshes[mesh].point_count; p++)
      positions[3 * (size_t)p] = -positions[3 * (size_t)p];
    attach_skinned(baked, i, mesh, is_mirrored, d->locals);
  }
  return TW_OK;
}

api_outcome api_bake(api_call *call, const tw_model *model, const tw_clip *clip, float time,
                     const api_surface_query *query, api_baked *out) {
  deformer d = {.clip = clip, .time = time};
  plan_layout layout = {0};
  answer_meshes all = {0};
  moved_counts moved = {0};
  api_outcome outcome = count_moved(call, model, &moved);
  if (outcome != API_DONE) return outcome;
  tw_model *baked = api_copy_nodes(call->arena, model, moved.meshes);
  if (!baked || !create_deformer(call->arena, model, moved.meshes, &d) ||
      !create_layout(call->arena, model->mesh_count, &layout))
    return api_fail_without_memory(call);
  fill_layout(model, &layout);
  if (!create_meshes(call->arena, &layout, moved.meshes, &all)) return api_fail_without_memory(call);
  *out = (api_baked){baked, d.locals, api_plan_all(model), {0}};
  if (moved.meshes > 0)
    out->meshes = (api_plan_meshes){layout.count, layout.meshes, layout.still_count, layout.uses};
  if (api_plan_admit(call, &out->meshes, query) != TW_OK) return api_fail(call);
  pose_nodes(model, &d);
  if (place_meshes(call->arena, model, &d, &layout, baked, &all, &call->fault.error) != TW_OK)
    return api_fail(call);
  baked->meshes = all.meshes;
  baked->mesh_count = all.count;
  baked->skin_count = 0;
  if (moved.meshes > 0) out->moves = (api_plan_moves){all.count, all.of, all.positions};
  return API_DONE;
}
