/* Chooses the evaluator that computes a surface's rows. */
#include "surface_plan.h"

/* ---- what can be done ----------------------------------------------------------------------- */

/* Whether the answer has all faces in the order of the cage. An open border removes faces; then only a single
 * group is sure to keep its order. */
static bool keeps_all_faces(const tw_surface_builder *b) {
  bool shrinks = tw_builder_shrinks(b);
  /* The source of each face must be known. */
  if (b->mesh->tangent_uvs || (shrinks && b->surface->rules.linear)) return false;
  uint32_t groups = tw_ordered_groups(b->mesh, b->cage.visible);
  return groups == 1 || (groups > 1 && !shrinks);
}

/* ---- memory --------------------------------------------------------------------------------- */

/* What the topologies of the last level take at least, in bytes: the second half of the bound of a surface,
 * whose first half (api_surface_bound) does not know the evaluator. */
static uint64_t least_steps_size(const tw_surface_builder *b) {
  enum { CORNER = 4 * 4, EDGE = 8 + 8 + 4 + 4 + 1, VERTEX = 3 * 4 + 1 }; /* the arrays of tw_topology */
  const tw_surface_counts *c = &b->surface->counts;
  uint64_t last = CORNER * c->corners + EDGE * c->edges + VERTEX * c->vertices;
  uint32_t below = b->surface->evaluator->levels_below + b->surface->depth;
  return b->surface->field_count * (last >> 2 * below);
}

/* Whether generic steps make all of a level that can be large. Up to the deepest detail the level has points
 * that somebody has sent. */
static bool takes_steps(const tw_surface_builder *b) {
  const tw_surface *s = b->surface;
  uint32_t levels = b->levels + s->evaluator->levels_below;
  return levels >= 2 && levels > tw_deepest_detail(&s->details);
}

/* Refuses generic steps for what is left to them by patches that have declined, where it is large. */
static tw_status check_regularity(const tw_surface_builder *b, tw_error *error) {
  if (b->surface->evaluator != &tw_steps_evaluator || b->cage.refined_faces <= TW_GENERIC_FACES_MAX ||
      !tw_patch_evaluator.fits(b))
    return TW_OK;
  return tw_fail(error, TW_LIMIT,
                 "the mesh is too irregular for level %u: very many faces meet in one of its points, or it "
                 "has thousands of different sharpness values",
                 b->surface->options.level);
}

/* Asks the meter for what the steps are sure to hold, so that steps that cannot be finished are not begun. */
static tw_status reserve_steps(const tw_surface_builder *b, tw_error *error) {
  uint64_t least = takes_steps(b) ? least_steps_size(b) : 0;
  if (!tw_meter_take(least)) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_meter_give_back(least);
  return TW_OK;
}

/* ---- the choice ----------------------------------------------------------------------------- */

/* An evaluator, and how it is to be used. */
typedef struct preference {
  const tw_evaluator *evaluator;
  bool own_classes; /* with a cache of patch classes of the surface's own */
  bool long_lists;  /* of exceptions of shallow levels */
} preference;

/* In order: the first one that fits is used; where it declines, the next one that fits. */
static const preference preferences[] = {
    {&tw_shallow_evaluator, false, false}, {&tw_triangle_evaluator, false, false},
    {&tw_loop_evaluator, false, false},    {&tw_patch_evaluator, false, false},
    {&tw_patch_evaluator, true, false}, /* the shared cache may be full */
    {&tw_shallow_evaluator, false, true},  {&tw_steps_evaluator, false, false}};

static bool fits(const tw_surface_builder *b, const preference *p) {
  if (b->inner) return p->evaluator == &tw_steps_evaluator;
  if (p->own_classes && !b->surface->options.classes) return false;
  /* Long lists are for what short ones, and then patches, were too small for. */
  if (p->long_lists && !tw_patch_evaluator.fits(b)) return false;
  return p->evaluator->fits(b);
}

tw_status tw_builder_choose(tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  b->keeps_all_faces = keeps_all_faces(b);
  while (!fits(b, &preferences[b->preference])) b->preference++; /* generic steps always fit */
  const preference *chosen = &preferences[b->preference];
  if (chosen->own_classes) s->options.classes = NULL;
  b->long_lists = chosen->long_lists;
  s->evaluator = chosen->evaluator;
  tw_status status = check_regularity(b, error);
  if (status == TW_OK) status = s->evaluator->start(b, error);
  s->side = 1u << s->depth;
  s->cage_step = b->levels == 0 ? 1 : 4;
  b->has_rim = s->depth > 0 && tw_builder_shrinks(b);
  if (b->has_rim || b->inner) b->keeps_all_faces = false; /* which faces belong to a part has to be known */
  if (status == TW_OK && !b->inner) status = reserve_steps(b, error);
  if (status != TW_OK) return status;
  s->steps = tw_arena_alloc(s->arena, (size_t)b->levels + 1, sizeof *s->steps);
  return s->steps ? TW_OK : TW_NO_MEMORY;
}
