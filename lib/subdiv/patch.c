/* Plans the patches of a mesh of quads. */
#include "patch.h"

#include <stdlib.h>
#include <string.h>

#include "shape.h"

/* ---- planning ------------------------------------------------------------------------------- */

/* Control points grow as patches are met: most take 16. */
typedef struct control_list {
  uint32_t *points;
  uint32_t count, capacity;
} control_list;

static tw_status append_controls(control_list *list, const uint32_t *points, uint32_t count) {
  uint64_t need = (uint64_t)list->count + count;
  if (need > list->capacity) {
    uint64_t capacity = need + need / 2;
    if (need > UINT32_MAX) return TW_NO_MEMORY;
    if (capacity > UINT32_MAX) capacity = UINT32_MAX;
    uint32_t *grown = tw_alloc((size_t)capacity, sizeof *grown);
    if (!grown) return TW_NO_MEMORY;
    memcpy(grown, list->points, list->count * sizeof *grown);
    free(list->points);
    list->points = grown;
    list->capacity = (uint32_t)capacity;
  }
  memcpy(list->points + list->count, points, count * sizeof *points);
  list->count += count;
  return TW_OK;
}

/* Classes of quads whose corners are all smooth, by the faces at these. */
enum { SMOOTH_CLASSES = 1024 };

typedef struct smooth_class {
  uint32_t faces; /* at the four corners, a byte each; 0: none */
  tw_patch_class *shape;
} smooth_class;

/* Patches on their way. */
typedef struct plan {
  tw_patches *patches;
  tw_patch_shapes *shapes;
  uint8_t *smooth_faces; /* [vertices] tw_vertex_smooth_faces */
  tw_collector *collector;
  control_list controls;
  smooth_class smooth[SMOOTH_CLASSES];
} plan;

/* Faces at the corners of a quad, a byte each; 0 where one is not smooth. */
static uint32_t smooth_key(const plan *p, uint32_t quad) {
  const uint32_t *corners = p->patches->base->corner_vertex + 4 * (size_t)quad;
  uint32_t key = 0;
  for (int k = 0; k < 4; k++) {
    uint8_t faces = p->smooth_faces[corners[k]];
    if (!faces) return 0;
    key = key << 8 | faces;
  }
  return key;
}

static tw_status classify(plan *p, uint32_t quad, tw_patch_class **shape, const uint32_t **points) {
  tw_patches *all = p->patches;
  tw_status status = tw_patch_classify(p->shapes, p->collector, 4 * quad, all->depth, shape, points);
  if (status == TW_OK) all->scratch_points = tw_patch_shapes_scratch(p->shapes);
  return status;
}

/* Where no point comes up twice, the faces at the corners tell the class; where one does, what is known of
 * such a quad serves just as well. */
static tw_status plan_smooth(plan *p, uint32_t quad, uint32_t key, tw_patch_class **shape,
                             const uint32_t **points, uint32_t buffer[TW_SMOOTH_POINTS_MAX]) {
  uint32_t count = tw_patch_smooth_points(p->patches->base, 4 * quad, p->smooth_faces, buffer);
  smooth_class *known = &p->smooth[(key ^ key >> 7 ^ key >> 14 ^ key >> 21) % SMOOTH_CLASSES];
  if (known->faces == key) {
    *shape = known->shape;
    *points = buffer;
    return TW_OK;
  }
  tw_status status = classify(p, quad, shape, points);
  if (status == TW_OK && (*shape)->point_count == count) *known = (smooth_class){key, *shape};
  return status;
}

static tw_status plan_patch(plan *p, uint32_t quad) {
  const tw_topology *base = p->patches->base;
  tw_patch *patch = &p->patches->patches[quad];
  patch->first_control = p->controls.count;
  uint32_t buffer[TW_SMOOTH_POINTS_MAX], count = 16;
  const uint32_t *points = buffer;
  if (p->patches->linear) return append_controls(&p->controls, base->corner_vertex + 4 * (size_t)quad, 4);
  uint32_t key = smooth_key(p, quad);
  bool irregular = key ? key != 0x04040404 : false;
  if (irregular || !tw_patch_regular(base, 4 * quad, p->smooth_faces, buffer, &patch->reflected)) {
    tw_status status = irregular ? plan_smooth(p, quad, key, &patch->shape, &points, buffer)
                                 : classify(p, quad, &patch->shape, &points);
    if (status != TW_OK) return status;
    count = patch->shape->point_count;
  }
  return append_controls(&p->controls, points, count);
}

/* TW_NO_MEMORY. */
static tw_status start_plan(plan *p, const tw_rules *rules) {
  tw_patches *all = p->patches;
  const tw_topology *base = all->base;
  for (uint32_t depth = 0; depth <= all->depth; depth++)
    if (!tw_spline_table(depth)) return TW_NO_MEMORY;
  all->patches = tw_alloc_zero(base->face_count, sizeof *all->patches);
  p->collector = tw_collector_create(base, rules->chaikin);
  p->smooth_faces = tw_alloc(base->vertex_count, 1);
  uint64_t capacity = (uint64_t)base->face_count * 16 + 16;
  p->controls.capacity = capacity > UINT32_MAX ? UINT32_MAX : (uint32_t)capacity;
  p->controls.points = tw_alloc(p->controls.capacity, sizeof *p->controls.points);
  if (!all->patches || !p->collector || !p->smooth_faces || !p->controls.points) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < base->vertex_count; v++) p->smooth_faces[v] = tw_vertex_smooth_faces(base, v);
  return TW_OK;
}

static tw_status plan_all(plan *p, const tw_rules *rules) {
  tw_patches *all = p->patches;
  tw_status status = start_plan(p, rules);
  for (uint32_t quad = 0; status == TW_OK && quad < all->base->face_count; quad++)
    status = plan_patch(p, quad);
  all->controls = p->controls.points;
  free(p->smooth_faces);
  tw_collector_destroy(p->collector);
  if (status == TW_OK)
    all->size = all->base->face_count * sizeof *all->patches + p->controls.capacity * sizeof *all->controls;
  return status;
}

tw_status tw_patches_create(tw_patches *patches, const tw_topology *base, const tw_rules *rules,
                            uint32_t depth, tw_patch_shapes *shapes) {
  memset(patches, 0, sizeof *patches);
  patches->base = base;
  patches->depth = depth;
  patches->linear = rules->linear;
  plan p = {.patches = patches, .shapes = shapes};
  tw_status status = plan_all(&p, rules);
  if (status != TW_OK) tw_patches_deinit(patches);
  return status;
}

void tw_patches_deinit(tw_patches *patches) {
  free(patches->patches);
  free(patches->controls);
  memset(patches, 0, sizeof *patches);
}

/* ---- what is known of a patch --------------------------------------------------------------- */

const uint32_t *tw_patch_controls(const tw_patches *patches, uint32_t quad, uint32_t *count) {
  const tw_patch *patch = &patches->patches[quad];
  *count = patches->linear ? 4 : patch->shape ? patch->shape->point_count : 16;
  return patches->controls + patch->first_control;
}

void tw_patch_fetch(const tw_patches *patches, uint32_t quad, uint32_t step, const float *in,
                    uint32_t width) {
  if (step == 0) {
    __builtin_prefetch(&patches->patches[quad]);
    return;
  }
  uint32_t count;
  const uint32_t *controls = tw_patch_controls(patches, quad, &count);
  for (uint32_t i = 0; step == 1 && i < count; i += 16) __builtin_prefetch(controls + i);
  for (uint32_t i = 0; step == 2 && i < count; i++) __builtin_prefetch(in + (size_t)controls[i] * width);
}
