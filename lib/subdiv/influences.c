/* Sparse weights of joints on vertices, refined by the masks of the generic step. */
#include "influences.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "refine_mask.h"

/* Beside a sum of 1 float cannot tell less. */
static const float negligible = 1e-7f;

/* ---- sums ----------------------------------------------------------------------------------- */

tw_status tw_joint_sum_init(tw_joint_sum *sum, uint32_t joint_count) {
  *sum = (tw_joint_sum){0, tw_alloc(joint_count, sizeof *sum->joints),
                        tw_alloc(joint_count, sizeof *sum->weights),
                        tw_alloc_zero(joint_count, sizeof *sum->places)};
  if (sum->joints && sum->weights && sum->places) return TW_OK;
  tw_joint_sum_deinit(sum);
  return TW_NO_MEMORY;
}

void tw_joint_sum_deinit(tw_joint_sum *sum) {
  free(sum->joints);
  free(sum->weights);
  free(sum->places);
  memset(sum, 0, sizeof *sum);
}

void tw_joint_sum_clear(tw_joint_sum *sum) {
  for (uint32_t i = 0; i < sum->count; i++) sum->places[sum->joints[i]] = 0;
  sum->count = 0;
}

static void add_joint(tw_joint_sum *sum, uint16_t joint, float weight) {
  uint32_t place = sum->places[joint];
  if (place == 0) {
    sum->joints[sum->count] = joint;
    sum->weights[sum->count] = weight;
    sum->places[joint] = ++sum->count;
  } else {
    sum->weights[place - 1] += weight;
  }
}

void tw_joint_sum_add(tw_joint_sum *sum, const tw_influences *influences, uint32_t vertex, float share) {
  for (size_t i = influences->offsets[vertex]; i < influences->offsets[vertex + 1]; i++)
    add_joint(sum, influences->joints[i], share * influences->weights[i]);
}

/* ---- four of them --------------------------------------------------------------------------- */

void tw_four_insert(float joints[4], float weights[4], uint16_t joint, float weight) {
  if (!(weight > negligible)) return;
  int place = 4;
  while (place > 0 &&
         (weights[place - 1] < weight || (weights[place - 1] == weight && joints[place - 1] > (float)joint)))
    place--;
  for (int i = 3; i > place; i--) {
    joints[i] = joints[i - 1];
    weights[i] = weights[i - 1];
  }
  if (place == 4) return;
  joints[place] = (float)joint;
  weights[place] = weight;
}

void tw_four_finish(float joints[4], float weights[4]) {
  double sum = 0;
  for (int i = 0; i < 4; i++) sum += (double)weights[i];
  if (!(sum > 0)) {
    joints[0] = 0;
    weights[0] = 1;
    return;
  }
  for (int i = 0; i < 4; i++) weights[i] = (float)((double)weights[i] / sum);
}

/* ---- building ------------------------------------------------------------------------------- */

void tw_influences_deinit(tw_influences *influences) {
  free(influences->offsets);
  free(influences->joints);
  free(influences->weights);
  *influences = (tw_influences){0};
}

size_t tw_influences_size(const tw_influences *influences) {
  if (!influences->offsets) return 0;
  return ((size_t)influences->vertex_count + 1) * sizeof *influences->offsets +
         influences->capacity * (sizeof *influences->joints + sizeof *influences->weights);
}

/* Empty ones for `vertex_count` vertices, with room for `capacity`. */
static tw_status start(tw_influences *out, uint32_t vertex_count, uint32_t joint_count, size_t capacity) {
  *out = (tw_influences){.joint_count = joint_count, .capacity = capacity};
  out->offsets = tw_alloc_zero((size_t)vertex_count + 1, sizeof *out->offsets);
  out->joints = tw_alloc(capacity, sizeof *out->joints);
  out->weights = tw_alloc(capacity, sizeof *out->weights);
  if (out->offsets && out->joints && out->weights) return TW_OK;
  tw_influences_deinit(out);
  return TW_NO_MEMORY;
}

static bool make_room(tw_influences *out, size_t count) {
  size_t need = out->offsets[out->vertex_count] + count;
  if (need <= out->capacity) return true;
  size_t capacity = need + need / 2;
  if (capacity > SIZE_MAX / sizeof *out->weights) return false;
  uint16_t *joints = realloc(out->joints, capacity * sizeof *joints);
  if (joints) out->joints = joints;
  float *weights = joints ? realloc(out->weights, capacity * sizeof *weights) : NULL;
  if (!weights) return false;
  out->weights = weights;
  out->capacity = capacity;
  return true;
}

/* Adds the next vertex. */
static bool append(tw_influences *out, const uint16_t *joints, const float *weights, size_t count) {
  if (!make_room(out, count)) return false;
  size_t place = out->offsets[out->vertex_count];
  memcpy(out->joints + place, joints, count * sizeof *joints);
  memcpy(out->weights + place, weights, count * sizeof *weights);
  out->offsets[++out->vertex_count] = place + count;
  return true;
}

typedef struct entry {
  uint16_t joint;
  float weight;
} entry;

static int compare_entries(const void *left, const void *right) {
  const entry *a = left, *b = right;
  if (a->weight != b->weight) return a->weight > b->weight ? -1 : 1;
  return a->joint < b->joint ? -1 : a->joint > b->joint;
}

/* The heaviest of a sum with too many joints. scratch: [count of the sum]. */
static void choose(const tw_joint_sum *sum, entry *scratch, uint16_t *joints, float *weights) {
  for (uint32_t i = 0; i < sum->count; i++) scratch[i] = (entry){sum->joints[i], sum->weights[i]};
  qsort(scratch, sum->count, sizeof *scratch, compare_entries);
  for (uint32_t i = 0; i < TW_INFLUENCES_MAX; i++) {
    joints[i] = scratch[i].joint;
    weights[i] = scratch[i].weight;
  }
}

static bool append_sum(tw_influences *out, const tw_joint_sum *sum, entry *scratch) {
  uint16_t joints[TW_INFLUENCES_MAX];
  float weights[TW_INFLUENCES_MAX];
  if (sum->count > TW_INFLUENCES_MAX) {
    choose(sum, scratch, joints, weights);
    return append(out, joints, weights, TW_INFLUENCES_MAX);
  }
  uint32_t count = 0;
  for (uint32_t i = 0; i < sum->count; i++) {
    if (fabsf(sum->weights[i]) <= negligible) continue;
    joints[count] = sum->joints[i];
    weights[count++] = sum->weights[i];
  }
  return append(out, joints, weights, count);
}

/* The weights of one point: each joint once, none below 0, sum 1. */
static void start_point(tw_joint_sum *sum, const tw_skin_weights *skin, uint32_t point) {
  double total = 0;
  for (size_t i = 4 * (size_t)point; i < 4 * (size_t)point + 4; i++)
    if (skin->weights[i] > 0) total += (double)skin->weights[i];
  for (size_t i = 4 * (size_t)point; i < 4 * (size_t)point + 4; i++)
    if (skin->weights[i] > 0) add_joint(sum, skin->joints[i], (float)((double)skin->weights[i] / total));
  if (sum->count == 0) add_joint(sum, 0, 1);
}

tw_status tw_influences_init(tw_influences *influences, const tw_mesh *mesh, const uint32_t *point_of,
                             uint32_t vertex_count) {
  uint32_t joint_count = 1;
  for (size_t i = 0; i < 4 * (size_t)mesh->point_count; i++)
    if (mesh->skin.joints[i] >= joint_count) joint_count = (uint32_t)mesh->skin.joints[i] + 1;
  tw_joint_sum sum = {0};
  tw_status status = start(influences, vertex_count, joint_count, 4 * (size_t)vertex_count);
  if (status == TW_OK) status = tw_joint_sum_init(&sum, joint_count);
  for (uint32_t v = 0; v < vertex_count && status == TW_OK; v++) {
    start_point(&sum, &mesh->skin, point_of ? point_of[v] : v);
    if (!append(influences, sum.joints, sum.weights, sum.count)) status = TW_NO_MEMORY;
    tw_joint_sum_clear(&sum);
  }
  tw_joint_sum_deinit(&sum);
  if (status != TW_OK) tw_influences_deinit(influences);
  return status;
}

/* ---- refining ------------------------------------------------------------------------------- */

typedef struct step {
  const tw_topology *parent;
  const tw_rules *rules;
  bool loop;
  const tw_influences *in;
  tw_influences faces; /* of the face points, which come last and are needed first */
  tw_influences out;
  tw_share *shares;
  tw_joint_sum sum;
  entry *scratch;
} step;

static tw_status start_step(step *s) {
  const tw_topology *p = s->parent;
  uint32_t faces = s->loop ? 0 : p->face_count; /* Loop has no face points */
  uint32_t joints = s->in->joint_count, children = p->vertex_count + p->edge_count + faces;
  tw_status status = start(&s->faces, faces, joints, 4 * (size_t)faces);
  if (status == TW_OK) status = start(&s->out, children, joints, 4 * (size_t)children);
  if (status == TW_OK) status = tw_joint_sum_init(&s->sum, joints);
  s->shares = tw_alloc(tw_refine_mask_capacity(p), sizeof *s->shares);
  s->scratch = tw_alloc(joints, sizeof *s->scratch);
  return status == TW_OK && s->shares && s->scratch ? TW_OK : TW_NO_MEMORY;
}

/* Adds child vertices [first, end) to `out`. */
static bool refine_range(step *s, uint32_t first, uint32_t end, tw_influences *out) {
  uint32_t first_face = s->parent->vertex_count + s->parent->edge_count;
  for (uint32_t child = first; child < end; child++) {
    uint32_t count = s->loop ? tw_loop_mask(s->parent, s->rules, child, s->shares)
                             : tw_refine_mask(s->parent, s->rules, child, s->shares);
    for (uint32_t i = 0; i < count; i++) {
      uint32_t vertex = s->shares[i].vertex;
      if (vertex < first_face)
        tw_joint_sum_add(&s->sum, s->in, vertex, s->shares[i].weight);
      else
        tw_joint_sum_add(&s->sum, &s->faces, vertex - first_face, s->shares[i].weight);
    }
    bool added = append_sum(out, &s->sum, s->scratch);
    tw_joint_sum_clear(&s->sum);
    if (!added) return false;
  }
  return true;
}

static bool append_all(tw_influences *out, const tw_influences *from) {
  for (uint32_t v = 0; v < from->vertex_count; v++) {
    size_t begin = from->offsets[v], count = from->offsets[v + 1] - begin;
    if (!append(out, from->joints + begin, from->weights + begin, count)) return false;
  }
  return true;
}

/* Gives back the room that nothing came to. */
static void trim(tw_influences *out) {
  size_t count = out->offsets[out->vertex_count];
  if (count == 0) return;
  uint16_t *joints = realloc(out->joints, count * sizeof *joints);
  if (joints) out->joints = joints;
  float *weights = realloc(out->weights, count * sizeof *weights);
  if (weights) out->weights = weights;
  out->capacity = count;
}

tw_status tw_influences_refine(tw_influences *influences, const tw_topology *parent, const tw_rules *rules,
                               bool loop) {
  step s = {.parent = parent, .rules = rules, .loop = loop, .in = influences};
  uint32_t first_face = parent->vertex_count + parent->edge_count, faces = loop ? 0 : parent->face_count;
  tw_status status = start_step(&s);
  bool complete = status == TW_OK && refine_range(&s, first_face, first_face + faces, &s.faces) &&
                  refine_range(&s, 0, first_face, &s.out) && append_all(&s.out, &s.faces);
  free(s.shares);
  free(s.scratch);
  tw_joint_sum_deinit(&s.sum);
  tw_influences_deinit(&s.faces);
  if (complete) {
    trim(&s.out);
    tw_influences_deinit(influences);
    *influences = s.out;
    return TW_OK;
  }
  tw_influences_deinit(&s.out);
  return TW_NO_MEMORY;
}

tw_status tw_influences_keep(tw_influences *influences, const uint32_t *vertices, uint32_t count) {
  tw_influences kept;
  tw_status status = start(&kept, count, influences->joint_count, influences->capacity);
  if (status != TW_OK) return status;
  for (uint32_t i = 0; i < count; i++) { /* fewer than before: there is room */
    size_t begin = influences->offsets[vertices[i]];
    append(&kept, influences->joints + begin, influences->weights + begin,
           influences->offsets[vertices[i] + 1] - begin);
  }
  tw_influences_deinit(influences);
  *influences = kept;
  return TW_OK;
}
