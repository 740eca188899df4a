/* Sparse joint weights at vertices, refined by the masks of generic steps, and the rows of patches and of
 * whole levels that follow from them. */
#include "skin_weights.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "refine.h"

/* About float's precision at 1. */
static const float negligible = 1e-7f;

/* ---- sums ------------------------------------------------------------------------------------ */

static void joint_sum_deinit(tw_joint_sum *sum) {
  tw_free(sum->joints);
  tw_free(sum->weights);
  tw_free(sum->places);
  memset(sum, 0, sizeof *sum);
}

static tw_status joint_sum_init(tw_joint_sum *sum, uint32_t joint_count) {
  *sum = (tw_joint_sum){0, tw_alloc(joint_count, sizeof *sum->joints),
                        tw_alloc(joint_count, sizeof *sum->weights),
                        tw_alloc_zero(joint_count, sizeof *sum->places)};
  if (sum->joints && sum->weights && sum->places) return TW_OK;
  joint_sum_deinit(sum);
  return TW_NO_MEMORY;
}

static void joint_sum_clear(tw_joint_sum *sum) {
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

static void joint_sum_add(tw_joint_sum *sum, const tw_influences *influences, uint32_t vertex, float share) {
  for (size_t i = influences->offsets[vertex]; i < influences->offsets[vertex + 1]; i++)
    add_joint(sum, influences->joints[i], share * influences->weights[i]);
}

/* ---- the heaviest of a row ------------------------------------------------------------------- */

static void clear_rows(const tw_skin_columns *out, size_t count) {
  for (size_t i = 0; i < count; i++) {
    memset(out->joints + out->stride * i, 0, out->width * sizeof *out->joints);
    memset(out->weights + out->stride * i, 0, out->width * sizeof *out->weights);
  }
}

/* Inserts a joint at its place by weight; the lightest of one too many is dropped, and a negligible weight is
 * ignored. */
static void insert(const tw_skin_columns *out, size_t row, uint16_t joint, float weight) {
  float *joints = out->joints + out->stride * row, *weights = out->weights + out->stride * row;
  if (!(weight > negligible)) return;
  uint32_t place = out->width;
  while (place > 0 &&
         (weights[place - 1] < weight || (weights[place - 1] == weight && joints[place - 1] > (float)joint)))
    place--;
  if (place == out->width) return;
  for (uint32_t i = out->width - 1; i > place; i--) {
    joints[i] = joints[i - 1];
    weights[i] = weights[i - 1];
  }
  joints[place] = (float)joint;
  weights[place] = weight;
}

/* Scales the weights to sum 1; a row without weights gets joint 0. */
static void finish(const tw_skin_columns *out, size_t row) {
  float *weights = out->weights + out->stride * row;
  double sum = 0;
  for (uint32_t i = 0; i < out->width; i++) sum += (double)weights[i];
  if (!(sum > 0)) weights[0] = 1;
  for (uint32_t i = 0; sum > 0 && i < out->width; i++) weights[i] = (float)((double)weights[i] / sum);
}

/* ---- building -------------------------------------------------------------------------------- */

void tw_influences_deinit(tw_influences *influences) {
  tw_free(influences->offsets);
  tw_free(influences->joints);
  tw_free(influences->weights);
  *influences = (tw_influences){0};
}

size_t tw_influences_size(const tw_influences *influences) {
  if (!influences->offsets) return 0;
  return ((size_t)influences->vertex_count + 1) * sizeof *influences->offsets +
         influences->capacity * (sizeof *influences->joints + sizeof *influences->weights);
}

/* Makes empty influences for up to `vertex_count` vertices, with room for `capacity` joints. TW_NO_MEMORY. */
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
  uint16_t *joints = tw_resize(out->joints, capacity * sizeof *joints);
  if (joints) out->joints = joints;
  float *weights = joints ? tw_resize(out->weights, capacity * sizeof *weights) : NULL;
  if (!weights) return false;
  out->weights = weights;
  out->capacity = capacity;
  return true;
}

/* Appends the influences of the next vertex. False without memory. */
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

/* Chooses the TW_INFLUENCES_MAX heaviest joints of a sum that has more. scratch: [count of the sum]. */
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

/* Adds the weights of one point to an empty sum: each joint once, weights over 0 alone, scaled to sum 1. */
static void start_point(tw_joint_sum *sum, const tw_skin_weights *skin, uint32_t point) {
  const size_t begin = skin->width * (size_t)point, end = begin + skin->width;
  double total = 0;
  for (size_t i = begin; i < end; i++)
    if (skin->weights[i] > 0) total += (double)skin->weights[i];
  for (size_t i = begin; i < end; i++)
    if (skin->weights[i] > 0) add_joint(sum, skin->joints[i], (float)((double)skin->weights[i] / total));
  if (sum->count == 0) add_joint(sum, 0, 1);
}

tw_status tw_influences_init(tw_influences *influences, const tw_mesh *mesh, const uint32_t *point_of,
                             uint32_t vertex_count) {
  uint32_t joint_count = 1;
  for (size_t i = 0; i < mesh->skin.width * (size_t)mesh->point_count; i++)
    if (mesh->skin.joints[i] >= joint_count) joint_count = (uint32_t)mesh->skin.joints[i] + 1;
  tw_joint_sum sum = {0};
  tw_status status = start(influences, vertex_count, joint_count, 4 * (size_t)vertex_count);
  if (status == TW_OK) status = joint_sum_init(&sum, joint_count);
  for (uint32_t v = 0; v < vertex_count && status == TW_OK; v++) {
    start_point(&sum, &mesh->skin, point_of ? point_of[v] : v);
    if (!append(influences, sum.joints, sum.weights, sum.count)) status = TW_NO_MEMORY;
    joint_sum_clear(&sum);
  }
  joint_sum_deinit(&sum);
  if (status != TW_OK) tw_influences_deinit(influences);
  return status;
}

/* ---- refining -------------------------------------------------------------------------------- */

typedef struct influence_step {
  const tw_topology *parent;
  const tw_rules *rules;
  const tw_influences *in;
  tw_influences faces; /* influences of the face points: last in `out`, but needed first */
  tw_influences out;
  tw_share *shares;
  tw_joint_sum sum;
  entry *scratch;
} influence_step;

static tw_status start_step(influence_step *s) {
  const tw_topology *p = s->parent;
  uint32_t faces = tw_refine_face_points(p, s->rules);
  uint32_t joints = s->in->joint_count, children = p->vertex_count + p->edge_count + faces;
  tw_status status = start(&s->faces, faces, joints, 4 * (size_t)faces);
  if (status == TW_OK) status = start(&s->out, children, joints, 4 * (size_t)children);
  if (status == TW_OK) status = joint_sum_init(&s->sum, joints);
  s->shares = tw_alloc(tw_refine_mask_capacity(p), sizeof *s->shares);
  s->scratch = tw_alloc(joints, sizeof *s->scratch);
  return status == TW_OK && s->shares && s->scratch ? TW_OK : TW_NO_MEMORY;
}

/* Appends the influences of child vertices [first, end) to `out`. */
static bool refine_range(influence_step *s, uint32_t first, uint32_t end, tw_influences *out) {
  uint32_t first_face = s->parent->vertex_count + s->parent->edge_count;
  for (uint32_t child = first; child < end; child++) {
    uint32_t count = tw_refine_mask(s->parent, s->rules, child, s->shares);
    for (uint32_t i = 0; i < count; i++) {
      uint32_t vertex = s->shares[i].vertex;
      if (vertex < first_face)
        joint_sum_add(&s->sum, s->in, vertex, s->shares[i].weight);
      else
        joint_sum_add(&s->sum, &s->faces, vertex - first_face, s->shares[i].weight);
    }
    bool added = append_sum(out, &s->sum, s->scratch);
    joint_sum_clear(&s->sum);
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

/* Frees unused capacity. */
static void trim(tw_influences *out) {
  size_t count = out->offsets[out->vertex_count];
  if (count == 0) return;
  uint16_t *joints = tw_resize(out->joints, count * sizeof *joints);
  if (joints) out->joints = joints;
  float *weights = tw_resize(out->weights, count * sizeof *weights);
  if (weights) out->weights = weights;
  out->capacity = count;
}

tw_status tw_influences_refine(tw_influences *influences, const tw_topology *parent, const tw_rules *rules) {
  influence_step s = {.parent = parent, .rules = rules, .in = influences};
  uint32_t first_face = parent->vertex_count + parent->edge_count,
           faces = tw_refine_face_points(parent, rules);
  tw_status status = start_step(&s);
  bool complete = status == TW_OK && refine_range(&s, first_face, first_face + faces, &s.faces) &&
                  refine_range(&s, 0, first_face, &s.out) && append_all(&s.out, &s.faces);
  tw_free(s.shares);
  tw_free(s.scratch);
  joint_sum_deinit(&s.sum);
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
  for (uint32_t i = 0; i < count; i++) { /* no more than before: there is room */
    size_t begin = influences->offsets[vertices[i]];
    append(&kept, influences->joints + begin, influences->weights + begin,
           influences->offsets[vertices[i] + 1] - begin);
  }
  tw_influences_deinit(influences);
  *influences = kept;
  return TW_OK;
}

/* ---- rows of patches and of vertices --------------------------------------------------------- */

enum { TOGETHER = 4 }; /* joints whose weights are evaluated as one value */

tw_status tw_skin_scratch_init(tw_skin_scratch *scratch, uint32_t joint_count, uint32_t vertex_count,
                               uint32_t row_count) {
  *scratch = (tw_skin_scratch){.controls = tw_alloc(vertex_count, TOGETHER * sizeof(float)),
                               .values = tw_alloc(row_count, TOGETHER * sizeof(float))};
  bool complete = scratch->controls && scratch->values;
  if (complete && joint_sum_init(&scratch->sum, joint_count) == TW_OK) return TW_OK;
  tw_skin_scratch_deinit(scratch);
  return TW_NO_MEMORY;
}

void tw_skin_scratch_deinit(tw_skin_scratch *scratch) {
  joint_sum_deinit(&scratch->sum);
  tw_free(scratch->controls);
  tw_free(scratch->values);
  *scratch = (tw_skin_scratch){0};
}

/* Loads the weights that four joints, from index `first` of the sum on, have at the control points. */
static void load_controls(const tw_skin_patch *patch, tw_skin_scratch *scratch, const uint32_t *controls,
                          uint32_t count, uint32_t first) {
  const tw_influences *in = patch->influences;
  for (uint32_t i = 0; i < count; i++) {
    float *row = scratch->controls + TOGETHER * (size_t)controls[i];
    memset(row, 0, TOGETHER * sizeof *row);
    for (size_t e = in->offsets[controls[i]]; e < in->offsets[controls[i] + 1]; e++) {
      uint32_t place = scratch->sum.places[in->joints[e]] - 1;
      if (place >= first && place < first + TOGETHER) row[place - first] = in->weights[e];
    }
  }
}

/* Evaluates the patch for the weights that load_controls has loaded, and inserts them into the rows. */
static void evaluate_together(const tw_skin_patch *patch, tw_skin_scratch *scratch, size_t row_count,
                              uint32_t first, const tw_skin_columns *out) {
  const tw_joint_sum *sum = &scratch->sum;
  tw_patch_job job = {.in = scratch->controls,
                      .width = TOGETHER,
                      .limit = patch->limit,
                      .backwards = patch->backwards,
                      .values = scratch->values,
                      .stride = TOGETHER,
                      .scratch = patch->patch_scratch};
  tw_patch_evaluate(patch->patches, patch->quad, &job, patch->rect);
  for (size_t i = 0; i < row_count; i++)
    for (uint32_t k = 0; k < TOGETHER && first + k < sum->count; k++)
      insert(out, i, sum->joints[first + k], scratch->values[TOGETHER * i + k]);
}

void tw_skin_patch_rows(const tw_skin_patch *patch, tw_skin_scratch *scratch, tw_skin_columns out) {
  tw_patch_rect rect = patch->rect;
  size_t row_count = (size_t)(rect.i1 - rect.i0 + 1) * (rect.j1 - rect.j0 + 1);
  tw_joint_sum *sum = &scratch->sum;
  uint32_t count;
  const uint32_t *controls = tw_patch_controls(patch->patches, patch->quad, &count);
  joint_sum_clear(sum);
  for (uint32_t i = 0; i < count; i++) joint_sum_add(sum, patch->influences, controls[i], 1);
  clear_rows(&out, row_count);
  if (sum->count == 1) { /* the only joint has weight 1 */
    for (size_t i = 0; i < row_count; i++) insert(&out, i, sum->joints[0], 1);
  } else {
    for (uint32_t first = 0; first < sum->count; first += TOGETHER) {
      load_controls(patch, scratch, controls, count, first);
      evaluate_together(patch, scratch, row_count, first, &out);
    }
    for (size_t i = 0; i < row_count; i++) finish(&out, i);
  }
}

void tw_skin_mask_row(const tw_influences *influences, const tw_limit_entry *mask, uint32_t count,
                      tw_skin_scratch *scratch, tw_skin_columns out) {
  tw_joint_sum *sum = &scratch->sum;
  clear_rows(&out, 1);
  joint_sum_clear(sum);
  for (uint32_t e = 0; e < count; e++)
    if (mask[e].position != 0) joint_sum_add(sum, influences, mask[e].vertex, mask[e].position);
  for (uint32_t i = 0; i < sum->count; i++) insert(&out, 0, sum->joints[i], sum->weights[i]);
  finish(&out, 0);
}

/* ---- rows of a level that is kept whole ------------------------------------------------------ */

enum { WORD = 64, WORDS_MAX = TW_SKIN_LEVEL_JOINTS_MAX / WORD, LANES = 4 };

/* Graph colouring of joints. Joints that never weigh on points of the same cage face may share a channel, and
 * a channel is refined as one function. Few channels serve many joints, since a joint is near few others. */
typedef struct channels {
  const tw_shallow *levels;
  uint32_t joint_count, words, count;
  uint64_t *near; /* [cage faces][words] bit set of the joints that can weigh on points of the face */
  uint16_t of[TW_SKIN_LEVEL_JOINTS_MAX];
} channels;

bool tw_skin_fits_levels(const tw_mesh *mesh) {
  for (size_t i = 0; i < mesh->skin.width * (size_t)mesh->point_count; i++)
    if (mesh->skin.joints[i] >= TW_SKIN_LEVEL_JOINTS_MAX) return false;
  return true;
}

static void unite(uint64_t *set, const uint64_t *other, uint32_t words) {
  for (uint32_t w = 0; w < words; w++) set[w] |= other[w];
}

/* Unites the sets of vertices into those of their faces, or the sets of faces into those of their
 * vertices. */
static void spread(const tw_shallow_level *cage, uint32_t words, bool to_faces, uint64_t *vertices,
                   uint64_t *faces) {
  for (uint32_t f = 0; f < cage->face_count; f++) {
    uint32_t size = cage->face_size, end = tw_shallow_face_end(cage, size, f);
    for (uint32_t c = tw_shallow_face_begin(cage, size, f); c < end; c++) {
      uint64_t *vertex = vertices + (size_t)words * cage->corner_vertex[c], *face = faces + (size_t)words * f;
      unite(to_faces ? face : vertex, to_faces ? vertex : face, words);
    }
  }
}

/* The lowest joint in `left`, which is word `word` of a set and not 0. */
static uint32_t lowest_joint(uint32_t word, uint64_t left) {
  return WORD * word + (uint32_t)__builtin_ctzll(left);
}

/* Fills `near`. A point of a face depends on the vertices of the faces that touch the face. */
static tw_status find_near(channels *c, const tw_influences *cage) {
  const tw_shallow_level *l = &c->levels->at[0];
  uint64_t *vertices = tw_alloc_zero(l->vertex_count, c->words * sizeof *vertices);
  c->near = tw_alloc_zero(l->face_count, c->words * sizeof *c->near);
  if (vertices && c->near) {
    for (uint32_t v = 0; v < l->vertex_count; v++)
      for (size_t e = cage->offsets[v]; e < cage->offsets[v + 1]; e++)
        vertices[(size_t)c->words * v + cage->joints[e] / WORD] |= UINT64_C(1) << cage->joints[e] % WORD;
    spread(l, c->words, true, vertices, c->near);
    spread(l, c->words, false, vertices, c->near);
    spread(l, c->words, true, vertices, c->near);
  }
  tw_free(vertices);
  return vertices && c->near ? TW_OK : TW_NO_MEMORY;
}

/* Gives each joint the first channel that no joint near it has. */
static tw_status choose_channels(channels *c) {
  uint64_t(*conflicts)[WORDS_MAX] = tw_alloc_zero(c->joint_count, sizeof *conflicts);
  if (!conflicts) return TW_NO_MEMORY;
  for (uint32_t f = 0; f < c->levels->at[0].face_count; f++) {
    const uint64_t *near = c->near + (size_t)c->words * f;
    if (f > 0 && memcmp(near, near - c->words, c->words * sizeof *near) == 0) continue;
    for (uint32_t w = 0; w < c->words; w++)
      for (uint64_t left = near[w]; left != 0; left &= left - 1)
        unite(conflicts[lowest_joint(w, left)], near, c->words);
  }
  for (uint32_t joint = 0; joint < c->joint_count; joint++) {
    bool taken[TW_SKIN_LEVEL_JOINTS_MAX] = {false};
    for (uint32_t w = 0; w < c->words; w++)
      for (uint64_t left = conflicts[joint][w]; left != 0; left &= left - 1)
        if (lowest_joint(w, left) < joint) taken[c->of[lowest_joint(w, left)]] = true;
    while (taken[c->of[joint]]) c->of[joint]++;
    if (c->of[joint] >= c->count) c->count = c->of[joint] + 1u;
  }
  tw_free(conflicts);
  return TW_OK;
}

/* Four channels, which are refined together as the components of points. */
typedef struct channel_job {
  const channels *channels;
  const tw_point *points;
  uint32_t first;              /* channel */
  uint64_t members[WORDS_MAX]; /* bit set of the joints in the four channels */
  tw_skin_columns rows;
} channel_job;

static void choose_members(channel_job *job) {
  const channels *c = job->channels;
  memset(job->members, 0, sizeof job->members);
  for (uint32_t joint = 0; joint < c->joint_count; joint++)
    if (c->of[joint] - job->first < LANES) job->members[joint / WORD] |= UINT64_C(1) << joint % WORD;
}

static void insert_channels(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  enum { AT_ONCE = 256 };
  const channel_job *job = context;
  const channels *c = job->channels;
  uint32_t faces[AT_ONCE];
  (void)part;
  for (uint32_t i = begin; i < end; i++) {
    uint32_t place = (i - begin) % AT_ONCE;
    if (place == 0) tw_shallow_cage_faces(c->levels, i, end - i < AT_ONCE ? end - i : AT_ONCE, faces);
    const uint64_t *near = c->near + (size_t)c->words * faces[place];
    for (uint32_t w = 0; w < c->words; w++)
      for (uint64_t left = near[w] & job->members[w]; left != 0; left &= left - 1) {
        uint32_t joint = lowest_joint(w, left);
        insert(&job->rows, i, (uint16_t)joint, job->points[i][c->of[joint] - job->first]);
      }
  }
}

static void finish_rows(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const channel_job *job = context;
  (void)part;
  for (uint32_t i = begin; i < end; i++) finish(&job->rows, i);
}

static void load_channels(const channels *c, const tw_influences *cage, uint32_t first, tw_point *out) {
  for (uint32_t v = 0; v < cage->vertex_count; v++) {
    out[v] = (tw_point){0};
    for (size_t e = cage->offsets[v]; e < cage->offsets[v + 1]; e++) {
      uint32_t lane = c->of[cage->joints[e]] - first;
      if (lane < LANES) out[v][lane] = cage->weights[e];
    }
  }
}

static tw_status refine_channels(const channels *c, const tw_influences *cage, bool limit,
                                 const tw_parallel_for *parallel, tw_skin_columns rows) {
  uint32_t count = tw_shallow_points(c->levels);
  tw_point *in = tw_alloc(cage->vertex_count, sizeof *in), *points = tw_alloc(count, sizeof *points),
           *limits = limit ? tw_alloc(count, sizeof *limits) : points;
  tw_status status = in && points && limits ? TW_OK : TW_NO_MEMORY;
  channel_job job = {.channels = c, .points = limits, .rows = rows};
  for (; status == TW_OK && job.first < c->count; job.first += LANES) {
    load_channels(c, cage, job.first, in);
    status = tw_shallow_refine(c->levels, in, parallel, points);
    if (status != TW_OK) break;
    if (limit) tw_shallow_limit(c->levels, points, parallel, limits);
    choose_members(&job);
    tw_parallel_for_run(parallel, count, TW_PARALLEL_FOR_LEAST, insert_channels, &job);
  }
  if (status == TW_OK) tw_parallel_for_run(parallel, count, TW_PARALLEL_FOR_LEAST, finish_rows, &job);
  if (limit) tw_free(limits);
  tw_free(points);
  tw_free(in);
  return status;
}

tw_status tw_skin_refine_levels(const tw_shallow *levels, const tw_influences *cage, bool limit,
                                uint32_t width, const tw_parallel_for *parallel, float **out) {
  channels c = {.levels = levels, .joint_count = cage->joint_count};
  c.words = (c.joint_count + WORD - 1) / WORD;
  float *rows = tw_alloc_zero(tw_shallow_points(levels), 2 * (size_t)width * sizeof *rows);
  tw_status status = rows ? find_near(&c, cage) : TW_NO_MEMORY;
  if (status == TW_OK) status = choose_channels(&c);
  const tw_skin_columns columns = {rows, rows ? rows + width : NULL, width, 2 * width};
  if (status == TW_OK) status = refine_channels(&c, cage, limit, parallel, columns);
  tw_free(c.near);
  if (status == TW_OK)
    *out = rows;
  else
    tw_free(rows);
  return status;
}
