/* Chooses the evaluator that computes a surface's rows, and asks for the memory of the steps to its base. */
#include "surface_plan.h"

/* ---- what can be done ----------------------------------------------------------------------- */

/* Whether the answer has all faces in the order of the cage. An open border removes faces; then only a single
 * group is sure to keep its order. */
static bool is_whole(const tw_surface_builder *b) {
  if (b->mesh->tangent_uvs) return false; /* the source of each face must be known */
  uint32_t groups = tw_ordered_groups(b->mesh, b->cage.visible);
  return groups == 1 || (groups > 1 && !tw_cage_shrinks(&b->cage, &b->surface->options));
}

/* ---- memory --------------------------------------------------------------------------------- */

/* An upper bound, in bytes, of what generic steps need. Levels that have details are not counted here: the
 * caller counts them. The constants are bytes for each face of the last level, measured on cages of
 * triangles. */
static uint64_t steps_size(const tw_surface_builder *b) {
  enum { LOOP_ROWS = 56, LOOP = 180, CATMULL_CLARK = 420 };
  const tw_surface *s = b->surface;
  const tw_mesh *m = b->mesh;
  uint32_t below = s->evaluator->levels_below, levels = b->levels + below;
  if (levels < 2 || levels <= tw_deepest_detail(&s->details)) return 0;
  uint64_t topology = s->rules.loop ? LOOP : CATMULL_CLARK, values = tw_smooth_set_count(s);
  if (below > 0) topology = LOOP_ROWS;
  if (m->skin.joints) values += m->skin.width;
  return tw_cage_counts_at(&b->cage, s->rules.loop, levels).faces * (topology * s->field_count + 32 * values);
}

/* What the topologies of the last level take at least, in bytes. */
static uint64_t least_steps_size(const tw_surface_builder *b) {
  enum { CORNER = 4 * 4, EDGE = 8 + 8 + 4 + 4 + 1, VERTEX = 3 * 4 + 1 }; /* the arrays of tw_topology */
  const tw_surface_counts *c = &b->surface->counts;
  uint64_t last = CORNER * c->corners + EDGE * c->edges + VERTEX * c->vertices;
  return b->surface->field_count * (b->surface->evaluator->levels_below > 0 ? last / 4 : last);
}

/* Asks for the memory of the generic steps. */
static tw_status ask_for_steps(const tw_surface_builder *b, tw_error *error) {
  const tw_grant *grant = b->surface->options.grant;
  uint64_t bytes = steps_size(b), least = bytes > 0 ? least_steps_size(b) : 0;
  if (bytes == 0 || !grant) return TW_OK;
  if (grant->most > 0 && least > grant->most)
    return tw_fail(error, TW_LIMIT,
                   "the surface has %llu faces, made step by step, which takes %llu bytes at least, over the "
                   "limit of %llu (%s)",
                   (unsigned long long)b->surface->counts.faces, (unsigned long long)least,
                   (unsigned long long)grant->most, grant->most_name);
  return grant->take(grant->context, bytes) ? TW_OK : TW_NO_MEMORY;
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
    {&tw_shallow_evaluator, false, false},
    {&tw_loop_evaluator, false, false},
    {&tw_patch_evaluator, false, false},
    {&tw_patch_evaluator, true, false}, /* the shared cache may be full */
    {&tw_shallow_evaluator, false, true},
    {&tw_steps_evaluator, false, false}};

static bool fits(const tw_surface_builder *b, const preference *p) {
  if (p->own_classes && !b->surface->options.classes) return false;
  /* Long lists are for what short ones, and then patches, were too small for. */
  if (p->long_lists && !tw_patch_evaluator.fits(b)) return false;
  return p->evaluator->fits(b);
}

tw_status tw_builder_choose(tw_surface_builder *b, tw_error *error) {
  tw_surface *s = b->surface;
  b->whole = is_whole(b);
  while (!fits(b, &preferences[b->preference])) b->preference++; /* generic steps always fit */
  const preference *chosen = &preferences[b->preference];
  if (chosen->own_classes) s->options.classes = NULL;
  b->long_lists = chosen->long_lists;
  s->evaluator = chosen->evaluator;
  tw_status status = s->evaluator->start(b, error);
  s->side = 1u << s->depth;
  s->cage_step = b->levels == 0 ? 1 : 4;
  if (status == TW_OK) status = ask_for_steps(b, error);
  if (status != TW_OK) return status;
  s->steps = tw_arena_alloc(s->arena, (size_t)b->levels + 1, sizeof *s->steps);
  return s->steps ? TW_OK : TW_NO_MEMORY;
}
