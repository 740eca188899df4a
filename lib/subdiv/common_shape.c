/* Makes common classes and their stencils, and publishes them. */
#include "common_shape.h"

#include <assert.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "stencil.h"

/* Vertices of more faces are rare. */
enum { FACES_MIN = 3, FACES_MAX = 8, PLACES = (FACES_MAX - FACES_MIN + 1) * 4 };

typedef struct stencil_set {
  tw_arena *arena;
  tw_stencil of_depth[TW_STENCIL_DEPTH_MAX + 1];
} stencil_set;

struct tw_common_shape {
  tw_patch_shapes *shapes;
  tw_patch_class *shape;
  _Atomic(stencil_set *) sets[2][2]; /* of limits, with normals */
};

static _Atomic(tw_common_shape *) places[PLACES];

/* ---- classes -------------------------------------------------------------------------------- */

static bool is_smooth(const tw_neighbourhood *n) {
  if (n->chaikin) return false;
  for (uint32_t f = 0; f < n->face_count; f++)
    for (int i = 0; i < 4; i++)
      if (n->sharpness[f][i] > 0) return false;
  for (int k = 0; k < 4; k++)
    if (n->vertex_sharpness[k] > 0) return false;
  return true;
}

/* PLACES where there is none. Whoever comes first decides what all share, so that no more than one key may
 * have a place: smooth corners lie inside a manifold, where so many faces and points leave one way to be
 * joined. */
static uint32_t place_of(const tw_neighbourhood *n) {
  uint32_t faces[4] = {0}, odd = 0;
  for (uint32_t f = 0; f < n->face_count; f++)
    for (int i = 0; i < 4; i++)
      if (n->quads[f][i] < 4) faces[n->quads[f][i]]++;
  while (odd < 3 && faces[odd] == 4) odd++;
  for (uint32_t k = 0; k < 4; k++)
    if (k != odd && faces[k] != 4) return PLACES;
  uint32_t count = faces[odd];
  bool fits = count >= FACES_MIN && count <= FACES_MAX && count != 4 && n->face_count == count + 5 &&
              n->point_count == 2 * count + 8;
  return fits && is_smooth(n) ? (count - FACES_MIN) * 4 + odd : PLACES;
}

static void destroy(tw_common_shape *common) {
  tw_patch_shapes_destroy(common->shapes);
  free(common);
}

static tw_status make(const tw_neighbourhood *n, tw_common_shape **out) {
  tw_common_shape *common = tw_alloc_zero(1, sizeof *common);
  if (!common) return TW_NO_MEMORY;
  tw_status status = tw_patch_shapes_of(n, &common->shapes, &common->shape);
  if (status != TW_OK) {
    destroy(common);
    return status;
  }
  for (uint32_t k = 0; k < 4; k++)
    assert(!common->shape->parts[k].shape || common->shape->parts[k].shape == common->shape);
  *out = common;
  return TW_OK;
}

tw_status tw_common_find(const tw_neighbourhood *neighbourhood, tw_common_shape **out) {
  const tw_neighbourhood *n = neighbourhood;
  uint32_t place = place_of(n);
  *out = NULL;
  if (place == PLACES) return TW_OK;
  tw_common_shape *found = atomic_load(&places[place]);
  if (!found) {
    tw_common_shape *made;
    tw_status status = make(n, &made);
    if (status != TW_OK) return status;
    if (atomic_compare_exchange_strong(&places[place], &found, made))
      found = made;
    else
      destroy(made); /* another thread was first */
  }
  const tw_neighbourhood *own = &found->shape->local;
  if (own->key_size == n->key_size && memcmp(own->quads, n->quads, n->key_size) == 0) *out = found;
  return TW_OK;
}

const tw_patch_class *tw_common_class(tw_common_shape *common) {
  return common->shape;
}

/* ---- stencils ------------------------------------------------------------------------------- */

static void destroy_set(stencil_set *set) {
  tw_arena_destroy(set->arena);
  free(set);
}

/* NULL without memory. */
static stencil_set *make_set(tw_common_shape *common, bool limit, bool normals) {
  stencil_set *set = tw_alloc_zero(1, sizeof *set);
  if (!set) return NULL;
  set->arena = tw_arena_create();
  tw_status status = set->arena && tw_spline_table(0) ? TW_OK : TW_NO_MEMORY;
  for (uint32_t depth = 1; depth <= TW_STENCIL_DEPTH_MAX && status == TW_OK; depth++) {
    tw_stencil_wish wish = {depth, tw_patch_shapes_scratch(common->shapes), limit, normals};
    status = tw_spline_table(depth) ? tw_stencil_make(common->shape, &wish, set->arena, &set->of_depth[depth])
                                    : TW_NO_MEMORY;
  }
  if (status == TW_OK) return set;
  destroy_set(set);
  return NULL;
}

/* Those with normals serve without them as well: the points are the same. */
static const stencil_set *stencils_of(tw_common_shape *common, bool limit, bool normals) {
  stencil_set *found = atomic_load(&common->sets[limit][true]);
  if (!found && !normals) found = atomic_load(&common->sets[limit][false]);
  if (found) return found;
  stencil_set *made = make_set(common, limit, normals);
  if (!made || atomic_compare_exchange_strong(&common->sets[limit][normals], &found, made)) return made;
  destroy_set(made);
  return found;
}

tw_status tw_common_stencils(tw_patch_shapes *shapes, bool limit, bool normals) {
  for (tw_patch_class *copy = tw_patch_shapes_commons(shapes); copy; copy = copy->next_common) {
    const tw_stencil **own = copy->stencils[limit];
    if (own[1] && (!normals || own[1]->tangents)) continue;
    const stencil_set *set = stencils_of(copy->common, limit, normals);
    if (!set) return TW_NO_MEMORY;
    for (uint32_t depth = 1; depth <= TW_STENCIL_DEPTH_MAX; depth++) own[depth] = &set->of_depth[depth];
  }
  return TW_OK;
}
