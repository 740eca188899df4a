/* Mixed clips. They are evaluated by blocks of nodes or times, so that what their layers give stays in the
 * cache and on the stack. */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "clip.h"
#include "mix_time.h"
#include "sine.h"
#include "tweend/mesh.h"

/* Floats of a layer's samples that are on the stack at a time. */
enum { SAMPLES = TW_MORPH_TARGETS_MAX };

/* A layer's part in a track of the mixed clip. */
typedef struct track_part {
  uint32_t layer, track;  /* track: of the layer's clip */
  const float *reference; /* [width] of an additive layer */
} track_part;

/* The nodes of which a layer moves a path, in their order. */
typedef struct moved_nodes {
  uint8_t *places;   /* [moved] in their blocks */
  uint32_t *starts;  /* [blocks + 1] the first of each block */
  float *references; /* [moved][3 or 4] of an additive layer, else NULL */
} moved_nodes;

typedef struct mixing {
  mix_time time;
  moved_nodes (*moved)[TW_WEIGHTS]; /* [layers] of each path of transforms */
  const track_part **parts; /* [tracks + 1] the parts of each track, by layer, up to those of the next */
  const float **rests;      /* [tracks][width] */
} mixing;

static const mixing *mixing_of(const tw_clip *clip) {
  return clip->making;
}

static inline bool is_additive(const mixing *mix, uint32_t layer) {
  return mix->time.layers[layer].mode == TW_LAYER_ADDITIVE;
}

static inline uint32_t width_of(tw_path path) {
  return path == TW_ROTATION ? 4 : 3;
}

typedef float four __attribute__((vector_size(16)));
typedef int32_t four_bits __attribute__((vector_size(16)));

static inline four load_four(const float *from) {
  four value;
  memcpy(&value, from, sizeof value);
  return value;
}

static inline float sum_of(four value) {
  return (value[0] + value[2]) + (value[1] + value[3]);
}

/* What a layer gives of one path, of a block of nodes or times. */
typedef struct layer_values {
  uint32_t count;
  const uint8_t *places; /* [count] in the block; NULL: all of it */
  const float *weights;  /* [TW_POSE_BLOCK], of which `count` are set */
  const float *values;   /* by place */
  size_t step;           /* floats from one value to the next, and from one mean to the next */
} layer_values;

static inline size_t place_of(const layer_values *layer, size_t i) {
  return layer->places ? layer->places[i] : i;
}

/* ---- blending -------------------------------------------------------------------------------- */

/* The means of one path, of a block of nodes or times, while layers are blended. */
typedef struct blend {
  tw_path path;
  uint32_t count, width;
  float *means;
  size_t step;
  bool has_begun;               /* else what is below is not set */
  float totals[TW_POSE_BLOCK];  /* weights so far */
  float lengths[TW_POSE_BLOCK]; /* of the sums of rotations whose directions the means are */
} blend;

/* Sets no arrays: most blends are of paths that no layer moves. */
static void blend_init(blend *b, tw_path path, uint32_t width, float *means, size_t step, uint32_t count) {
  b->path = path;
  b->count = count;
  b->width = width;
  b->means = means;
  b->step = step;
  b->has_begun = false;
}

/* Nothing has a weight so far. */
static void begin(blend *b) {
  for (uint32_t i = 0; i < b->count; i++) b->totals[i] = 0;
  for (uint32_t i = 0; b->path == TW_ROTATION && i < b->count; i++) b->lengths[i] = 1;
  b->has_begun = true;
}

/* Adds the layer's weights to the totals. shares: the part of each value in its mean, 1 where it is the first
 * one with a weight, 0 without weight. */
static void take_shares(blend *b, const layer_values *layer, float *restrict shares) {
  float totals[TW_POSE_BLOCK];
  for (uint32_t i = 0; i < layer->count; i++) totals[i] = b->totals[place_of(layer, i)] + layer->weights[i];
  for (uint32_t i = 0; i < layer->count; i++) {
    float share = layer->weights[i] / totals[i];
    shares[i] = layer->weights[i] > 0 ? share : 0;
  }
  for (uint32_t i = 0; i < layer->count; i++) b->totals[place_of(layer, i)] = totals[i];
}

/* The layer is all that there is so far, or takes the place of what there is. */
static void take_over(blend *b, const layer_values *layer) {
  for (uint32_t i = 0; i < layer->count; i++) b->totals[place_of(layer, i)] = layer->weights[i];
}

/* Moves each sum of rotations by its share toward q or -q, whichever is on its side. What dot products tell
 * is computed in a loop of its own, which is vectorised. */
static void blend_rotations(blend *b, const layer_values *layer, const float *restrict shares) {
  const layer_values of = *layer; /* may be kept in registers */
  float *restrict means = b->means, dots[TW_POSE_BLOCK], lengths[TW_POSE_BLOCK], keeps[TW_POSE_BLOCK],
                  parts[TW_POSE_BLOCK];
  for (uint32_t i = 0; i < of.count; i++) {
    size_t at = of.step * place_of(&of, i);
    dots[i] = sum_of(load_four(means + at) * load_four(of.values + at));
    lengths[i] = b->lengths[place_of(&of, i)];
  }
  for (uint32_t i = 0; i < of.count; i++) {
    float share = shares[i], held = (1 - share) * lengths[i], side = dots[i] < 0 ? -1.0F : 1.0F,
          square = held * held + share * share + 2 * held * share * side * dots[i], scale = 1 / sqrtf(square);
    keeps[i] = held * scale;
    parts[i] = share * side * scale;
    lengths[i] = square * scale;
  }
  for (uint32_t i = 0; i < of.count; i++) {
    size_t at = of.step * place_of(&of, i);
    four q = load_four(of.values + at), mean = load_four(means + at), moved = mean * keeps[i] + q * parts[i];
    if (shares[i] == 0) moved = mean;
    if (shares[i] == 1) moved = q;
    memcpy(means + at, &moved, sizeof moved);
  }
  for (uint32_t i = 0; i < of.count; i++) b->lengths[place_of(&of, i)] = lengths[i];
}

/* The difference of huge values may exceed the range of float; what lies between them does not. */
static inline float blend_number(float mean, float value, float share) {
  float blended = mean + (value - mean) * share;
  if (fabsf(blended) <= FLT_MAX) return blended;
  return (float)((double)mean + ((double)value - (double)mean) * (double)share);
}

static inline void blend_vectors(blend *b, const layer_values *layer, const float *shares, uint32_t width) {
  for (uint32_t i = 0; i < layer->count; i++) {
    if (shares[i] == 0) continue;
    size_t place = place_of(layer, i);
    float *mean = b->means + b->step * place;
    const float *value = layer->values + layer->step * place;
    for (uint32_t k = 0; k < width; k++)
      mean[k] = shares[i] == 1 ? value[k] : blend_number(mean[k], value[k], shares[i]);
  }
}

/* overrides: the layer takes the place of those before it. The values of the first one are the means already.
 */
static void blend_layer(blend *b, const layer_values *layer, bool overrides) {
  float shares[TW_POSE_BLOCK];
  bool is_first = layer->values == b->means;
  if (!b->has_begun) begin(b);
  if (overrides || is_first)
    take_over(b, layer);
  else
    take_shares(b, layer, shares);
  if (is_first) return;
  for (uint32_t i = 0; overrides && i < layer->count; i++) shares[i] = 1;
  if (b->path == TW_ROTATION)
    blend_rotations(b, layer, shares);
  else if (b->width == 3)
    blend_vectors(b, layer, shares, 3);
  else
    blend_vectors(b, layer, shares, b->width);
}

/* ---- adding ---------------------------------------------------------------------------------- */

/* What an additive layer turns rotations by; each w is 0 or more. What is behind the layer's count has no
 * meaning, so that four are computed at a time. */
typedef struct turns {
  float x[TW_POSE_BLOCK], y[TW_POSE_BLOCK], z[TW_POSE_BLOCK], w[TW_POSE_BLOCK];
} turns;

/* From four quaternions to their x, y, z and w, and back. */
static inline void transpose(four rows[4]) {
  four low = __builtin_shufflevector(rows[0], rows[1], 0, 4, 1, 5),
       high = __builtin_shufflevector(rows[0], rows[1], 2, 6, 3, 7),
       next_low = __builtin_shufflevector(rows[2], rows[3], 0, 4, 1, 5),
       next_high = __builtin_shufflevector(rows[2], rows[3], 2, 6, 3, 7);
  rows[0] = __builtin_shufflevector(low, next_low, 0, 1, 4, 5);
  rows[1] = __builtin_shufflevector(low, next_low, 2, 3, 6, 7);
  rows[2] = __builtin_shufflevector(high, next_high, 0, 1, 4, 5);
  rows[3] = __builtin_shufflevector(high, next_high, 2, 3, 6, 7);
}

/* Loads the x, y, z and w of `lanes` rotations by place from `first` on. */
static inline void load_rotations(const layer_values *layer, const float *rotations, size_t first,
                                  size_t lanes, four out[4]) {
  for (size_t k = 0; k < 4; k++) {
    size_t i = k < lanes ? first + k : first;
    out[k] = load_four(rotations + layer->step * place_of(layer, i));
  }
  transpose(out);
}

/* Finds `lanes` turns from the first on, conjugate(reference) value, and of each the sign that makes w
 * positive. references: as in add_rotations. */
static inline void find_four(turns *restrict all, const layer_values *layer, const float *references,
                             size_t step, size_t first, size_t lanes) {
  four a[4], b[4];
  for (size_t k = 0; k < 4; k++) a[k] = load_four(references + step * (k < lanes ? first + k : first));
  transpose(a);
  load_rotations(layer, layer->values, first, lanes, b);
  four x = a[3] * b[0] - a[0] * b[3] - a[1] * b[2] + a[2] * b[1];
  four y = a[3] * b[1] + a[0] * b[2] - a[1] * b[3] - a[2] * b[0];
  four z = a[3] * b[2] - a[0] * b[1] + a[1] * b[0] - a[2] * b[3];
  four w = a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const four_bits flips = (w < 0) & INT32_MIN;
  x = (four)((four_bits)x ^ flips);
  y = (four)((four_bits)y ^ flips);
  z = (four)((four_bits)z ^ flips);
  w = (four)((four_bits)w ^ flips);
  memcpy(all->x + first, &x, sizeof x);
  memcpy(all->y + first, &y, sizeof y);
  memcpy(all->z + first, &z, sizeof z);
  memcpy(all->w + first, &w, sizeof w);
}

static inline void find_turns(turns *restrict all, const layer_values *layer, const float *references,
                              size_t step) {
  const layer_values of = *layer; /* may be kept in registers */
  size_t i = 0;
  for (; i + 4 <= of.count; i += 4) find_four(all, &of, references, step, i, 4);
  if (i < of.count) find_four(all, &of, references, step, i, of.count - i);
}

/* Of any weight: beyond 1 a turn may go round more than once. */
static void raise_far(turns *all, uint32_t i, float weight) {
  double axis[3] = {(double)all->x[i], (double)all->y[i], (double)all->z[i]};
  double sine = tw_length(axis, 3), part = atan2(sine, (double)all->w[i]) * (double)weight;
  double ratio = sine > 0 ? sin(part) / sine : 0;
  all->x[i] = (float)(axis[0] * ratio);
  all->y[i] = (float)(axis[1] * ratio);
  all->z[i] = (float)(axis[2] * ratio);
  all->w[i] = (float)cos(part);
}

/* Makes each turn slerp(1, turn, weight), without roots and divisions: the cosine tells the angle's square.
 * In two loops: polynomials are long chains of operations, and the shorter a loop's body, the more of its
 * rounds a processor computes at once. */
static void raise_turns(turns *restrict all, const float *restrict weights, uint32_t count) {
  float parts[TW_POSE_BLOCK], squares[TW_POSE_BLOCK];
  int is_far = 0;
  for (uint32_t i = 0; i < count; i++) is_far |= fabsf(weights[i]) > 1;
  for (uint32_t i = 0; is_far && i < count; i++) raise_far(all, i, weights[i]);
  if (is_far) return;
  for (uint32_t i = 0; i < count; i++) {
    float w = all->w[i], part = angle_over_sine(w) * weights[i];
    parts[i] = part;
    squares[i] = part * part * ((1 - w) * (1 + w));
  }
  for (uint32_t i = 0; i < count; i++) {
    float ratio = parts[i] + parts[i] * sine_excess(squares[i]);
    all->x[i] *= ratio;
    all->y[i] *= ratio;
    all->z[i] *= ratio;
    all->w[i] = cosine_of_square(squares[i]);
  }
}

/* Multiplies `lanes` rotations from the first on by the turns. Products are as long as the rotations, which
 * rounding leaves a little off 1: one Newton step for the inverse root corrects that. Where the weight is 0,
 * the rotation stays as it is. */
static inline void apply_four(const turns *restrict all, const layer_values *layer, float *restrict rotations,
                              size_t first, size_t lanes) {
  const four halves = {0.5F, 0.5F, 0.5F, 0.5F};
  four a[4], q[4], x = load_four(all->x + first), y = load_four(all->y + first),
                   z = load_four(all->z + first), w = load_four(all->w + first);
  load_rotations(layer, rotations, first, lanes, a);
  q[0] = a[3] * x + a[0] * w + a[1] * z - a[2] * y;
  q[1] = a[3] * y - a[0] * z + a[1] * w + a[2] * x;
  q[2] = a[3] * z + a[0] * y - a[1] * x + a[2] * w;
  q[3] = a[3] * w - a[0] * x - a[1] * y - a[2] * z;
  four excess = (q[0] * q[0] + q[2] * q[2]) + (q[1] * q[1] + q[3] * q[3]) - 1;
  four scale = 1 - (four)((four_bits)halves & (load_four(layer->weights + first) != 0)) * excess;
  for (uint32_t k = 0; k < 4; k++) q[k] *= scale;
  transpose(q);
  for (size_t k = 0; k < lanes; k++)
    memcpy(rotations + layer->step * place_of(layer, first + k), &q[k], sizeof q[k]);
}

static inline void apply_turns(const turns *restrict all, const layer_values *layer,
                               float *restrict rotations) {
  const layer_values of = *layer;
  size_t i = 0;
  for (; i + 4 <= of.count; i += 4) apply_four(all, &of, rotations, i, 4);
  if (i < of.count) apply_four(all, &of, rotations, i, of.count - i);
}

/* references: [4], `step` floats apart; 0: one for all. */
static void add_rotations(float *rotations, const layer_values *layer, const float *references, size_t step) {
  turns all;
  find_turns(&all, layer, references, step);
  raise_turns(&all, layer->weights, layer->count);
  apply_turns(&all, layer, rotations);
}

/* Adds a weighted difference to a number. The sum is cut off at the range of float, beyond which a large
 * weight may take it. */
static inline float add_number(float number, float value, float reference, float weight) {
  float sum = number + (value - reference) * weight;
  if (fabsf(sum) <= FLT_MAX) return sum;
  double exact = (double)number + ((double)value - (double)reference) * (double)weight;
  return (float)fmax(-(double)FLT_MAX, fmin((double)FLT_MAX, exact));
}

/* references: as in add_rotations. */
static void add_vectors(float *vectors, uint32_t width, const layer_values *layer, const float *references,
                        size_t step) {
  for (uint32_t i = 0; i < layer->count; i++) {
    if (layer->weights[i] == 0) continue;
    size_t place = place_of(layer, i);
    float weight = layer->weights[i], *vector = vectors + layer->step * place;
    const float *value = layer->values + layer->step * place, *reference = references + step * i;
    for (uint32_t k = 0; k < width; k++) vector[k] = add_number(vector[k], value[k], reference[k], weight);
  }
}

/* ---- posing ---------------------------------------------------------------------------------- */

enum { TRS_STEP = sizeof(tw_trs) / sizeof(float) };

/* Floats of a transform before a path. */
static inline size_t floats_before(tw_path path) {
  return (path == TW_TRANSLATION ? offsetof(tw_trs, translation)
          : path == TW_SCALE     ? offsetof(tw_trs, scale)
                                 : offsetof(tw_trs, rotation)) /
         sizeof(float);
}

/* A block of nodes. */
typedef struct pose_block {
  const tw_node *nodes;
  uint32_t first, count;
  tw_trs *locals; /* [count] */
} pose_block;

/* What a layer gives of a path; its count may be 0. weights, poses: [TW_POSE_BLOCK] */
static layer_values values_of(const mixing *mix, uint32_t layer, const pose_block *block, tw_path path,
                              const float *weights, const tw_trs *poses) {
  const moved_nodes *moved = &mix->moved[layer][path];
  const uint32_t *starts = moved->starts + block->first / TW_POSE_BLOCK;
  uint32_t count = starts[1] - starts[0];
  return (layer_values){count, count == block->count ? NULL : moved->places + starts[0], weights,
                        (const float *)poses + floats_before(path), TRS_STEP};
}

/* The pose of the first layer that plays is the block's, with the rest transforms of what it does not move.
 */
static void blend_poses(const tw_clip *clip, const pose_block *block, const layer_state *states) {
  const mixing *mix = mixing_of(clip);
  bool has_started = false;
  tw_trs poses[TW_POSE_BLOCK];
  float weights[TW_POSE_BLOCK];
  blend blends[TW_WEIGHTS];
  for (tw_path path = 0; path < TW_WEIGHTS; path++)
    blend_init(&blends[path], path, width_of(path), (float *)block->locals + floats_before(path), TRS_STEP,
               block->count);
  for (uint32_t l = 0; l < clip->part_count; l++) {
    bool overrides = mix->time.layers[l].mode == TW_LAYER_OVERRIDE;
    if (is_additive(mix, l) || (states[l].weight == 0 && !overrides)) continue;
    if (has_started)
      tw_clip_move_nodes(clip->parts[l], block->nodes, block->first, block->count, states[l].time, poses);
    else
      tw_clip_pose_nodes(clip->parts[l], block->nodes, block->first, block->count, states[l].time,
                         block->locals);
    for (uint32_t i = 0; i < block->count; i++) weights[i] = states[l].weight;
    for (tw_path path = 0; path < TW_WEIGHTS; path++) {
      layer_values values = values_of(mix, l, block, path, weights, has_started ? poses : block->locals);
      if (values.count > 0) blend_layer(&blends[path], &values, overrides);
    }
    has_started = true;
  }
  if (!has_started)
    for (uint32_t i = 0; i < block->count; i++) block->locals[i] = block->nodes[block->first + i].rest;
}

static void add_pose(const tw_clip *clip, uint32_t layer, const pose_block *block, const layer_state *state) {
  const mixing *mix = mixing_of(clip);
  tw_trs poses[TW_POSE_BLOCK];
  float weights[TW_POSE_BLOCK];
  tw_clip_move_nodes(clip->parts[layer], block->nodes, block->first, block->count, state->time, poses);
  for (uint32_t i = 0; i < block->count; i++) weights[i] = state->weight;
  for (tw_path path = 0; path < TW_WEIGHTS; path++) {
    layer_values values = values_of(mix, layer, block, path, weights, poses);
    const moved_nodes *moved = &mix->moved[layer][path];
    const float *references =
        moved->references + (size_t)width_of(path) * moved->starts[block->first / TW_POSE_BLOCK];
    float *locals = (float *)block->locals + floats_before(path);
    if (path == TW_ROTATION)
      add_rotations(locals, &values, references, 4);
    else
      add_vectors(locals, 3, &values, references, 3);
  }
}

static void mixed_pose(const tw_clip *clip, const tw_node *nodes, uint32_t first, uint32_t count, float time,
                       tw_trs *locals) {
  const mixing *mix = mixing_of(clip);
  layer_state states[TW_LAYERS_MAX];
  double clamped = mix_clamp(&mix->time, time), phase = tw_mix_phase(&mix->time, clamped);
  for (uint32_t l = 0; l < clip->part_count; l++) states[l] = tw_layer_at(&mix->time, l, clamped, phase);
  for (uint32_t done = 0; done < count; done += TW_POSE_BLOCK) {
    const pose_block block = {nodes, first + done,
                              count - done < TW_POSE_BLOCK ? count - done : TW_POSE_BLOCK, locals + done};
    blend_poses(clip, &block, states);
    for (uint32_t l = 0; l < clip->part_count; l++)
      if (is_additive(mix, l) && states[l].weight != 0) add_pose(clip, l, &block, &states[l]);
  }
}

/* ---- sampling -------------------------------------------------------------------------------- */

/* Times of a track. */
typedef struct sample_block {
  uint32_t count, width;
  tw_path path;
  mix_moments at;
  float *out; /* [count][width] */
} sample_block;

/* What a layer gives: its weights, then its samples where any weight counts. */
typedef struct part_samples {
  float weights[TW_POSE_BLOCK];
  float locals[TW_POSE_BLOCK], values[SAMPLES];
} part_samples;

static void find_weights(const tw_clip *clip, const track_part *part, const sample_block *block,
                         part_samples *samples) {
  tw_layer_states(&mixing_of(clip)->time, part->layer, &block->at, samples->locals, samples->weights);
}

static void put_rests(const sample_block *block, const float *rest, const float *weights) {
  int has_any = !weights; /* no bool, of which loops are not vectorised */
  for (uint32_t i = 0; weights && i < block->count; i++) has_any |= weights[i] == 0;
  for (uint32_t i = 0; has_any && i < block->count; i++)
    if (!weights || weights[i] == 0)
      memcpy(block->out + (size_t)i * block->width, rest, block->width * sizeof *rest);
}

/* The samples of the first layer are the block's, but where it does not play. */
static void blend_samples(const tw_clip *clip, uint32_t track, const sample_block *block) {
  const mixing *mix = mixing_of(clip);
  part_samples samples;
  blend b;
  bool has_started = false;
  blend_init(&b, block->path, block->width, block->out, block->width, block->count);
  for (const track_part *part = mix->parts[track]; part < mix->parts[track + 1]; part++) {
    if (part->reference) continue;
    bool overrides = mix->time.layers[part->layer].mode == TW_LAYER_OVERRIDE;
    float *out = has_started ? samples.values : block->out;
    find_weights(clip, part, block, &samples);
    tw_clip_sample(clip->parts[part->layer], part->track, samples.locals, block->count, out);
    if (!has_started && !overrides) put_rests(block, mix->rests[track], samples.weights);
    const layer_values values = {block->count, NULL, samples.weights, out, block->width};
    blend_layer(&b, &values, overrides);
    has_started = true;
  }
  if (!has_started) put_rests(block, mix->rests[track], NULL);
}

static void add_samples(const tw_clip *clip, const track_part *part, const sample_block *block) {
  part_samples samples;
  find_weights(clip, part, block, &samples);
  tw_clip_sample(clip->parts[part->layer], part->track, samples.locals, block->count, samples.values);
  const layer_values values = {block->count, NULL, samples.weights, samples.values, block->width};
  if (block->path == TW_ROTATION)
    add_rotations(block->out, &values, part->reference, 0);
  else
    add_vectors(block->out, block->width, &values, part->reference, 0);
}

static void mixed_sample(const tw_clip *clip, uint32_t track, const float *times, size_t time_count,
                         float *out) {
  const mixing *mix = mixing_of(clip);
  uint32_t width = clip->tracks[track].width, most = SAMPLES / width;
  if (most > TW_POSE_BLOCK) most = TW_POSE_BLOCK;
  for (size_t done = 0; done < time_count; done += most) {
    sample_block block;
    block.count = time_count - done < most ? (uint32_t)(time_count - done) : most;
    block.width = width;
    block.path = clip->tracks[track].path;
    block.out = out + done * width;
    tw_mix_moments(&mix->time, times + done, block.count, &block.at);
    blend_samples(clip, track, &block);
    for (const track_part *part = mix->parts[track]; part < mix->parts[track + 1]; part++)
      if (part->reference) add_samples(clip, part, &block);
  }
}

/* ---- bends ----------------------------------------------------------------------------------- */

typedef struct layer_bends {
  const mix_time *mix;
  uint32_t layer;
  const tw_bend_sink *sink;
} layer_bends;

static bool take_of_layer(void *context, double time) {
  const layer_bends *bends = context;
  return tw_layer_times(bends->mix, bends->layer, time, bends->sink);
}

static bool mixed_bends(const tw_clip *clip, uint32_t track, const tw_bend_sink *sink) {
  const mixing *mix = mixing_of(clip);
  for (const track_part *part = mix->parts[track]; part < mix->parts[track + 1]; part++) {
    layer_bends bends = {&mix->time, part->layer, sink};
    const tw_bend_sink below = {take_of_layer, &bends, sink->left};
    if (!tw_layer_bends(&mix->time, part->layer, sink)) return false;
    if (!tw_clip_bends(clip->parts[part->layer], part->track, &below)) return false;
  }
  return true;
}

/* ---- mixing ---------------------------------------------------------------------------------- */

/* A track of a layer, and what it moves. */
typedef struct moved_part {
  uint64_t what; /* node << 2 | path */
  uint32_t layer, track;
} moved_part;

static int compare_parts(const void *a, const void *b) {
  const moved_part *left = a, *right = b;
  if (left->what != right->what) return left->what < right->what ? -1 : 1;
  return left->layer < right->layer ? -1 : left->layer > right->layer;
}

static tw_status check_job(const tw_mix_job *job, tw_error *error) {
  if (job->layer_count == 0 || job->layer_count > TW_LAYERS_MAX)
    return tw_fail(error, TW_LIMIT, "a mixed clip has 1 to %d layers", TW_LAYERS_MAX);
  for (uint32_t i = 0; i < job->layer_count; i++) {
    tw_status status = tw_layer_check(&job->layers[i], error);
    if (status != TW_OK) {
      char inner[sizeof error->pointer];
      if (error) {
        memcpy(inner, error->pointer, sizeof inner);
        tw_error_at(error, "/layers/%u%s", i, inner);
      }
      return status;
    }
    if (job->clips[i]->depth >= TW_LAYER_DEPTH_MAX)
      return tw_fail(error, TW_LIMIT, "mixed clips lie more than %d deep", TW_LAYER_DEPTH_MAX);
  }
  return TW_OK;
}

/* All tracks of all layers, by what they move; a track of morph weights only where its width is that of the
 * first one. NULL without memory. */
static moved_part *list_parts(const tw_mix_job *job, uint32_t *count) {
  uint64_t all = 0;
  for (uint32_t l = 0; l < job->layer_count; l++) all += job->clips[l]->track_count;
  moved_part *parts = all < UINT32_MAX ? tw_alloc((size_t)all, sizeof *parts) : NULL;
  *count = 0;
  for (uint32_t l = 0; parts && l < job->layer_count; l++)
    for (uint32_t t = 0; t < job->clips[l]->track_count; t++) {
      const tw_track *track = &job->clips[l]->tracks[t];
      if (track->width > SAMPLES) continue; /* of weights on a node without a mesh: they move nothing */
      parts[(*count)++] = (moved_part){(uint64_t)track->node << 2 | (uint64_t)track->path, l, t};
    }
  if (parts && tw_sort(parts, *count, sizeof *parts, compare_parts) == TW_OK) return parts;
  tw_free(parts);
  return NULL;
}

/* The track that a mixed clip has of what `parts` move. holds: where one STEP track alone moves it, whose
 * weight does not change. */
static tw_track track_of(const tw_mix_job *job, const moved_part *part, uint32_t part_count) {
  const tw_track *first = &job->clips[part->layer]->tracks[part->track];
  bool is_alone = part_count == 1 && job->layers[part->layer].weight_count == 1;
  return (tw_track){.kind = TRACK_MADE,
                    .node = first->node,
                    .path = first->path,
                    .holds = is_alone && first->holds,
                    .width = first->width};
}

/* The values at rest of what a track moves. NULL without memory. */
static const float *rest_of(const tw_mix_job *job, const tw_track *track, tw_arena *arena) {
  float *rest = tw_arena_alloc(arena, track->width, sizeof *rest);
  if (!rest) return NULL;
  const tw_node *node = &job->nodes[track->node];
  const float *weights = job->weights ? job->weights[track->node] : NULL;
  const float *from = track->path == TW_TRANSLATION ? node->rest.translation
                      : track->path == TW_SCALE     ? node->rest.scale
                      : track->path == TW_ROTATION  ? node->rest.rotation
                                                    : weights;
  if (from) memcpy(rest, from, track->width * sizeof *rest);
  return rest;
}

static const float *reference_of(const tw_mix_job *job, const moved_part *part, uint32_t width,
                                 tw_arena *arena) {
  float *value = tw_arena_alloc(arena, width, sizeof *value),
        time = (float)job->layers[part->layer].reference;
  if (value) tw_clip_sample(job->clips[part->layer], part->track, &time, 1, value);
  return value;
}

static bool build_mixed_tracks(const tw_mix_job *job, const moved_part *moved, uint32_t count, tw_clip *clip,
                               mixing *mix) {
  tw_arena *arena = clip->arena;
  uint32_t track_count = 0;
  for (uint32_t i = 0; i < count; i++) track_count += i == 0 || moved[i].what != moved[i - 1].what;
  track_part *parts = tw_arena_alloc(arena, count, sizeof *parts), *next = parts;
  clip->tracks = tw_arena_alloc(arena, track_count, sizeof *clip->tracks);
  mix->parts = tw_arena_alloc(arena, (size_t)track_count + 1, sizeof *mix->parts);
  mix->rests = tw_arena_alloc(arena, track_count, sizeof *mix->rests);
  if (!parts || !clip->tracks || !mix->parts || !mix->rests) return false;
  for (uint32_t first = 0, end; first < count; first = end) {
    for (end = first + 1; end < count && moved[end].what == moved[first].what;) end++;
    tw_track *track = &clip->tracks[clip->track_count];
    *track = track_of(job, &moved[first], end - first);
    mix->parts[clip->track_count] = next;
    mix->rests[clip->track_count] = rest_of(job, track, arena);
    if (!mix->rests[clip->track_count++]) return false;
    clip->moves[track->node] |= (uint8_t)(1u << track->path);
    for (uint32_t i = first; i < end; i++) {
      const tw_clip *layer = job->clips[moved[i].layer];
      if (layer->tracks[moved[i].track].width != track->width) continue;
      bool adds = job->layers[moved[i].layer].mode == TW_LAYER_ADDITIVE;
      const float *reference = adds ? reference_of(job, &moved[i], track->width, arena) : NULL;
      if (adds && !reference) return false;
      *next++ = (track_part){moved[i].layer, moved[i].track, reference};
    }
  }
  mix->parts[clip->track_count] = next;
  return true;
}

/* Lists the nodes of which a layer's clip moves a path. */
static bool list_moved(const tw_clip *layer, tw_path path, tw_arena *arena, moved_nodes *out) {
  uint32_t count = 0, block_count = layer->node_count / TW_POSE_BLOCK + 1;
  for (uint32_t n = 0; n < layer->node_count; n++) count += layer->moves[n] >> path & 1u;
  out->places = tw_arena_alloc_raw(arena, count, sizeof *out->places);
  out->starts = tw_arena_alloc(arena, (size_t)block_count + 1, sizeof *out->starts);
  if (!out->places || !out->starts) return false;
  count = 0;
  for (uint32_t n = 0; n < layer->node_count; n++) {
    if (layer->moves[n] >> path & 1u) out->places[count++] = (uint8_t)(n % TW_POSE_BLOCK);
    out->starts[n / TW_POSE_BLOCK + 1] = count;
  }
  return true;
}

static bool build_moved(const tw_mix_job *job, tw_arena *arena, mixing *mix) {
  mix->moved = tw_arena_alloc(arena, job->layer_count, sizeof *mix->moved);
  bool has_room = mix->moved != NULL;
  for (uint32_t l = 0; has_room && l < job->layer_count; l++)
    for (tw_path path = 0; has_room && path < TW_WEIGHTS; path++)
      has_room = list_moved(job->clips[l], path, arena, &mix->moved[l][path]);
  return has_room;
}

static bool list_references(const tw_clip *layer, tw_path path, const tw_trs *poses, tw_arena *arena,
                            moved_nodes *moved) {
  uint32_t width = width_of(path), count = moved->starts[layer->node_count / TW_POSE_BLOCK + 1];
  float *next = moved->references = tw_arena_alloc_raw(arena, count, width * sizeof *next);
  if (!next) return false;
  for (uint32_t n = 0; n < layer->node_count; n++) {
    if (!(layer->moves[n] >> path & 1u)) continue;
    memcpy(next, (const float *)&poses[n] + floats_before(path), width * sizeof *next);
    next += width;
  }
  return true;
}

static bool build_references(const tw_mix_job *job, tw_arena *arena, mixing *mix) {
  tw_trs *poses = tw_alloc(job->node_count, sizeof *poses);
  bool has_room = poses != NULL;
  for (uint32_t l = 0; has_room && l < job->layer_count; l++) {
    if (!is_additive(mix, l)) continue;
    tw_clip_pose(job->clips[l], job->nodes, job->node_count, (float)job->layers[l].reference, poses);
    for (tw_path path = 0; has_room && path < TW_WEIGHTS; path++)
      has_room = list_references(job->clips[l], path, poses, arena, &mix->moved[l][path]);
  }
  tw_free(poses);
  return has_room;
}

static bool build_mixed(const tw_mix_job *job, tw_clip *clip) {
  static const tw_clip_kind kind = {mixed_pose, mixed_sample, mixed_bends};
  tw_arena *arena = clip->arena;
  mixing *mix = tw_arena_alloc(arena, 1, sizeof *mix);
  tw_clip **parts = tw_arena_alloc(arena, job->layer_count, sizeof *parts);
  clip->node_count = job->node_count;
  clip->moves = tw_arena_alloc(arena, job->node_count, sizeof *clip->moves);
  if (!mix || !parts || !clip->moves) return false;
  if (!tw_mix_time_init(&mix->time, arena, job->layers, job->layer_count, job->durations)) return false;
  uint32_t count;
  moved_part *moved = list_parts(job, &count);
  bool is_built = moved && build_mixed_tracks(job, moved, count, clip, mix) && build_moved(job, arena, mix) &&
                  build_references(job, arena, mix);
  tw_free(moved);
  if (!is_built) return false;
  for (uint32_t l = 0; l < job->layer_count; l++) {
    parts[l] = job->clips[l];
    if (parts[l]->depth >= clip->depth) clip->depth = parts[l]->depth + 1;
    clip->cost += parts[l]->cost;
    clip->leaves += parts[l]->leaves;
  }
  clip->kind = &kind;
  clip->making = mix;
  clip->duration = (float)mix->time.duration;
  clip->parts = parts;
  clip->part_count = job->layer_count; /* from here on the clip owns them */
  return true;
}

tw_status tw_clip_mix(const tw_mix_job *job, tw_clip **out, tw_error *error) {
  tw_status status = check_job(job, error);
  if (status != TW_OK) return status;
  tw_arena *arena = tw_arena_create();
  tw_clip *clip = arena ? tw_arena_alloc(arena, 1, sizeof *clip) : NULL;
  if (clip) clip->arena = arena;
  if (!clip || !build_mixed(job, clip)) {
    tw_arena_destroy(arena);
    return tw_fail(error, TW_NO_MEMORY, "no memory for a mixed clip");
  }
  *out = clip;
  return TW_OK;
}
