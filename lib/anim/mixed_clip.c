/* Mixed clips. They are evaluated by blocks of nodes or times, so that what their layers give stays in the
 * cache and on the stack. */
#include <math.h>
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

typedef struct mixing {
  mix_time time;
  const tw_trs **references; /* [layers] [nodes] of additive layers, else NULL */
  const track_part **parts;  /* [tracks + 1] the parts of each track, by layer, up to those of the next */
  const float **rests;       /* [tracks][width] */
} mixing;

static const mixing *mixing_of(const tw_clip *clip) {
  return clip->making;
}

/* ---- blending -------------------------------------------------------------------------------- */

typedef float four __attribute__((vector_size(16)));

static inline four load_four(const float *from) {
  four value;
  memcpy(&value, from, sizeof value);
  return value;
}

static inline float sum_of(four value) {
  return (value[0] + value[2]) + (value[1] + value[3]);
}

/* Moves a mean of rotations by a share toward q or -q, whichever is on its side. The mean is not of unit
 * length. */
static inline void blend_rotation(float *mean, const float *q, float share) {
  four m = load_four(mean), other = load_four(q);
  if (sum_of(m * other) < 0) other = -other;
  m += (other - m) * share;
  memcpy(mean, &m, sizeof m);
}

static inline void unit_rotation(float *q) {
  four value = load_four(q);
  value *= 1 / sqrtf(sum_of(value * value));
  memcpy(q, &value, sizeof value);
}

static inline void blend_values(float *mean, const float *values, uint32_t width, float share) {
  for (uint32_t i = 0; i < width; i++) mean[i] += (values[i] - mean[i]) * share;
}

static inline void add_values(float *values, const float *from, const float *reference, uint32_t width,
                              float weight) {
  for (uint32_t i = 0; i < width; i++) values[i] += (from[i] - reference[i]) * weight;
}

/* out = conjugate(a) b */
static inline void difference(const float *a, const float *b, float *out) {
  out[0] = a[3] * b[0] - a[0] * b[3] - a[1] * b[2] + a[2] * b[1];
  out[1] = a[3] * b[1] + a[0] * b[2] - a[1] * b[3] - a[2] * b[0];
  out[2] = a[3] * b[2] - a[0] * b[1] + a[1] * b[0] - a[2] * b[3];
  out[3] = a[3] * b[3] + a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* a = a b, at unit length */
static inline void turn_by(float *a, const float *b) {
  float q[4] = {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
                a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
                a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
                a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
  unit_rotation(q);
  memcpy(a, q, sizeof q);
}

/* Differences of rotations in an additive layer, one a node or time. */
typedef struct turns {
  uint32_t count;
  uint32_t of[TW_POSE_BLOCK]; /* which rotation each turns */
  float x[TW_POSE_BLOCK], y[TW_POSE_BLOCK], z[TW_POSE_BLOCK], w[TW_POSE_BLOCK];
  float weights[TW_POSE_BLOCK];
} turns;

static inline void add_turn(turns *all, uint32_t of, const float *reference, const float *q, float weight) {
  float turn[4];
  difference(reference, q, turn);
  float sign = turn[3] < 0 ? -1 : 1;
  uint32_t i = all->count++;
  all->of[i] = of;
  all->x[i] = sign * turn[0];
  all->y[i] = sign * turn[1];
  all->z[i] = sign * turn[2];
  all->w[i] = sign * turn[3];
  all->weights[i] = weight;
}

/* Replaces each turn by slerp(1, turn, weight), for weights of -1 to 1. */
static void raise_turns(turns *all) {
  for (uint32_t i = 0; i < all->count; i++) {
    float x = all->x[i], y = all->y[i], z = all->z[i], weight = all->weights[i];
    float sine = sqrtf(x * x + y * y + z * z), part = arc_angle(sine, all->w[i]) * fabsf(weight);
    float ratio = (weight < 0 ? -1.0f : 1.0f) * arc_sine(part) / (sine > 0 ? sine : 1.0f);
    all->x[i] = x * ratio;
    all->y[i] = y * ratio;
    all->z[i] = z * ratio;
    all->w[i] = arc_cosine(part);
  }
}

/* The same for a weight beyond 1, which may turn round more than once. */
static void raise_far(turns *all, uint32_t i) {
  double axis[3] = {(double)all->x[i], (double)all->y[i], (double)all->z[i]};
  double sine = tw_length(axis, 3), part = atan2(sine, (double)all->w[i]) * (double)all->weights[i];
  double ratio = sine > 0 ? sin(part) / sine : 0;
  all->x[i] = (float)(axis[0] * ratio);
  all->y[i] = (float)(axis[1] * ratio);
  all->z[i] = (float)(axis[2] * ratio);
  all->w[i] = (float)cos(part);
}

/* Applies the turns to rotations that lie `step` floats apart. */
static void apply_turns(turns *all, float *rotations, size_t step) {
  turns raised = *all;
  raise_turns(&raised);
  for (uint32_t i = 0; i < all->count; i++) {
    if (fabsf(all->weights[i]) > 1) {
      raise_far(all, i);
      raised.x[i] = all->x[i], raised.y[i] = all->y[i], raised.z[i] = all->z[i], raised.w[i] = all->w[i];
    }
    const float turn[4] = {raised.x[i], raised.y[i], raised.z[i], raised.w[i]};
    turn_by(rotations + step * all->of[i], turn);
  }
}

/* The part of a value in the mean to which it is added. */
static inline float share_of(double weight, double *total) {
  *total += weight;
  return (float)(weight / *total);
}

/* ---- posing ---------------------------------------------------------------------------------- */

/* A block of nodes while layers are blended. */
typedef struct pose_block {
  const tw_node *nodes;
  uint32_t first, count;
  tw_trs *locals;                  /* [count] */
  double totals[TW_POSE_BLOCK][3]; /* weights so far, by path */
  bool is_mean[TW_POSE_BLOCK];     /* the rotation is a mean, not of unit length */
} pose_block;

static inline float *place_in(tw_trs *trs, tw_path path) {
  return path == TW_TRANSLATION ? trs->translation : path == TW_SCALE ? trs->scale : trs->rotation;
}

/* The first layer that plays: its pose is the block's. */
static void start_block(pose_block *block, const tw_clip *clip, const layer_state *state) {
  tw_clip_pose_nodes(clip, block->nodes, block->first, block->count, state->time, block->locals);
  for (uint32_t i = 0; i < block->count; i++)
    for (int path = 0; path < 3; path++)
      block->totals[i][path] = clip->moves[block->first + i] & 1u << path ? state->weight : 0;
}

/* Gives a path what a layer that overrides, or plays alone so far, has. */
static void take_path(pose_block *block, uint32_t i, tw_path path, tw_trs *from, double weight) {
  memcpy(place_in(&block->locals[i], path), place_in(from, path),
         (path == TW_ROTATION ? 4 : 3) * sizeof(float));
  block->totals[i][path] = weight;
  if (path == TW_ROTATION) block->is_mean[i] = false;
}

static void blend_block(pose_block *block, const tw_clip *clip, const layer_state *state, bool overrides) {
  tw_trs poses[TW_POSE_BLOCK];
  double last_total = 0; /* most nodes have equal totals */
  float last_share = 1;
  tw_clip_pose_nodes(clip, block->nodes, block->first, block->count, state->time, poses);
  for (uint32_t i = 0; i < block->count; i++) {
    unsigned moves = clip->moves[block->first + i] & 7u;
    for (tw_path path = TW_TRANSLATION; moves >> path; path++) {
      double *total = &block->totals[i][path];
      if (!(moves & 1u << path)) continue;
      if (*total == 0 || overrides) {
        take_path(block, i, path, &poses[i], state->weight);
        continue;
      }
      if (*total != last_total) {
        double sum = last_total = *total;
        last_share = share_of(state->weight, &sum);
      }
      *total += state->weight;
      float *mean = place_in(&block->locals[i], path);
      if (path == TW_ROTATION) {
        blend_rotation(mean, poses[i].rotation, last_share);
        block->is_mean[i] = true;
      } else {
        blend_values(mean, place_in(&poses[i], path), 3, last_share);
      }
    }
  }
}

static void end_means(pose_block *block) {
  for (uint32_t i = 0; i < block->count; i++)
    if (block->is_mean[i]) unit_rotation(block->locals[i].rotation);
}

static void add_to_block(pose_block *block, const tw_clip *clip, const tw_trs *references,
                         const layer_state *state) {
  tw_trs poses[TW_POSE_BLOCK];
  turns all;
  all.count = 0;
  float weight = (float)state->weight;
  tw_clip_pose_nodes(clip, block->nodes, block->first, block->count, state->time, poses);
  for (uint32_t i = 0; i < block->count; i++) {
    unsigned moves = clip->moves[block->first + i];
    const tw_trs *reference = &references[block->first + i];
    if (moves & 1u << TW_TRANSLATION)
      add_values(block->locals[i].translation, poses[i].translation, reference->translation, 3, weight);
    if (moves & 1u << TW_SCALE)
      add_values(block->locals[i].scale, poses[i].scale, reference->scale, 3, weight);
    if (moves & 1u << TW_ROTATION) add_turn(&all, i, reference->rotation, poses[i].rotation, weight);
  }
  if (all.count) apply_turns(&all, block->locals[0].rotation, sizeof *block->locals / sizeof(float));
}

static void pose_mixed(const tw_clip *clip, pose_block *block, const layer_state *states) {
  const mixing *mix = mixing_of(clip);
  bool has_started = false;
  memset(block->is_mean, 0, sizeof block->is_mean);
  for (uint32_t l = 0; l < clip->part_count; l++) {
    bool overrides = mix->time.layers[l].mode == TW_LAYER_OVERRIDE;
    if (mix->references[l] || (states[l].weight == 0 && !overrides)) continue;
    if (has_started)
      blend_block(block, clip->parts[l], &states[l], overrides);
    else
      start_block(block, clip->parts[l], &states[l]);
    has_started = true;
  }
  if (!has_started)
    for (uint32_t i = 0; i < block->count; i++) block->locals[i] = block->nodes[block->first + i].rest;
  end_means(block);
  for (uint32_t l = 0; l < clip->part_count; l++)
    if (mix->references[l] && states[l].weight != 0)
      add_to_block(block, clip->parts[l], mix->references[l], &states[l]);
}

static void mixed_pose(const tw_clip *clip, const tw_node *nodes, uint32_t first, uint32_t count, float time,
                       tw_trs *locals) {
  const mix_time *mix = &mixing_of(clip)->time;
  layer_state states[TW_LAYERS_MAX];
  double clamped = mix_clamp(mix, time), phase = tw_mix_phase(mix, clamped);
  for (uint32_t l = 0; l < clip->part_count; l++) states[l] = tw_layer_at(mix, l, clamped, phase);
  for (uint32_t done = 0; done < count; done += TW_POSE_BLOCK) {
    pose_block block;
    block.nodes = nodes;
    block.first = first + done;
    block.count = count - done < TW_POSE_BLOCK ? count - done : TW_POSE_BLOCK;
    block.locals = locals + done;
    pose_mixed(clip, &block, states);
  }
}

/* ---- sampling -------------------------------------------------------------------------------- */

/* Times of a track while layers are blended. */
typedef struct sample_block {
  uint32_t count, width;
  tw_path path;
  double times[TW_POSE_BLOCK], phases[TW_POSE_BLOCK], totals[TW_POSE_BLOCK];
  bool is_mean[TW_POSE_BLOCK];
  float *out; /* [count][width] */
} sample_block;

static void blend_part(sample_block *block, const double *weights, const float *samples, bool overrides) {
  uint32_t width = block->width;
  double last_weight = 0, last_total = 0; /* most times have the weights of the time before */
  float share = 1;
  for (uint32_t i = 0; i < block->count; i++) {
    float *mean = block->out + (size_t)i * width;
    const float *sample = samples + (size_t)i * width;
    if (weights[i] == 0 && !overrides) continue;
    if (block->totals[i] == 0 || overrides) {
      memcpy(mean, sample, width * sizeof *mean);
      block->totals[i] = weights[i];
      block->is_mean[i] = false;
      continue;
    }
    if (weights[i] != last_weight || block->totals[i] != last_total) {
      double total = last_total = block->totals[i];
      share = share_of(last_weight = weights[i], &total);
    }
    block->totals[i] += weights[i];
    if (block->path == TW_ROTATION)
      blend_rotation(mean, sample, share);
    else
      blend_values(mean, sample, width, share);
    block->is_mean[i] = true;
  }
}

static void add_part(sample_block *block, const double *weights, const float *samples,
                     const float *reference) {
  uint32_t width = block->width;
  turns all;
  all.count = 0;
  for (uint32_t i = 0; i < block->count; i++) {
    if (weights[i] == 0) continue;
    const float *sample = samples + (size_t)i * width;
    if (block->path == TW_ROTATION)
      add_turn(&all, i, reference, sample, (float)weights[i]);
    else
      add_values(block->out + (size_t)i * width, sample, reference, width, (float)weights[i]);
  }
  if (all.count) apply_turns(&all, block->out, 4);
}

static void sample_part(const tw_clip *clip, const track_part *part, sample_block *block) {
  float local[TW_POSE_BLOCK], samples[SAMPLES];
  double weights[TW_POSE_BLOCK];
  bool overrides = mixing_of(clip)->time.layers[part->layer].mode == TW_LAYER_OVERRIDE;
  tw_layer_states(&mixing_of(clip)->time, part->layer, block->times, block->phases, block->count, local,
                  weights);
  tw_clip_sample(clip->parts[part->layer], part->track, local, block->count, samples);
  if (part->reference)
    add_part(block, weights, samples, part->reference);
  else
    blend_part(block, weights, samples, overrides);
}

/* Means of rotations become of unit length: in loops of their own, so that roots and divisions overlap. */
static void end_samples(sample_block *block) {
  float scales[TW_POSE_BLOCK];
  for (uint32_t i = 0; i < block->count; i++) {
    four value = load_four(block->out + 4 * (size_t)i);
    scales[i] = sum_of(value * value);
  }
  for (uint32_t i = 0; i < block->count; i++) scales[i] = 1 / sqrtf(scales[i]);
  for (uint32_t i = 0; i < block->count; i++) {
    if (!block->is_mean[i]) continue;
    four value = load_four(block->out + 4 * (size_t)i) * scales[i];
    memcpy(block->out + 4 * (size_t)i, &value, sizeof value);
  }
}

static void sample_mixed(const tw_clip *clip, uint32_t track, sample_block *block) {
  const track_part *begin = mixing_of(clip)->parts[track], *end = mixing_of(clip)->parts[track + 1];
  memset(block->totals, 0, sizeof block->totals);
  memset(block->is_mean, 0, sizeof block->is_mean);
  for (uint32_t i = 0; i < block->count; i++)
    memcpy(block->out + (size_t)i * block->width, mixing_of(clip)->rests[track],
           block->width * sizeof *block->out);
  for (const track_part *part = begin; part < end; part++)
    if (!part->reference) sample_part(clip, part, block);
  if (block->path == TW_ROTATION) end_samples(block);
  for (const track_part *part = begin; part < end; part++)
    if (part->reference) sample_part(clip, part, block);
}

static void mixed_sample(const tw_clip *clip, uint32_t track, const float *times, size_t time_count,
                         float *out) {
  const mix_time *mix = &mixing_of(clip)->time;
  uint32_t width = clip->tracks[track].width, most = SAMPLES / width;
  if (most > TW_POSE_BLOCK) most = TW_POSE_BLOCK;
  for (size_t done = 0; done < time_count; done += most) {
    sample_block block = {.count = time_count - done < most ? (uint32_t)(time_count - done) : most,
                          .width = width,
                          .path = clip->tracks[track].path,
                          .out = out + done * width};
    for (uint32_t i = 0; i < block.count; i++) {
      block.times[i] = mix_clamp(mix, times[done + i]);
      if (mix->knot_count > 0) block.phases[i] = tw_mix_phase(mix, block.times[i]);
    }
    sample_mixed(clip, track, &block);
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
      bool is_additive = job->layers[moved[i].layer].mode == TW_LAYER_ADDITIVE;
      const float *reference = is_additive ? reference_of(job, &moved[i], track->width, arena) : NULL;
      if (is_additive && !reference) return false;
      *next++ = (track_part){moved[i].layer, moved[i].track, reference};
    }
  }
  mix->parts[clip->track_count] = next;
  return true;
}

static bool build_references(const tw_mix_job *job, tw_arena *arena, mixing *mix) {
  mix->references = tw_arena_alloc(arena, job->layer_count, sizeof *mix->references);
  for (uint32_t l = 0; mix->references && l < job->layer_count; l++) {
    if (job->layers[l].mode != TW_LAYER_ADDITIVE) continue;
    tw_trs *poses = tw_arena_alloc(arena, job->node_count, sizeof *poses);
    if (!poses) return false;
    tw_clip_pose(job->clips[l], job->nodes, job->node_count, (float)job->layers[l].reference, poses);
    mix->references[l] = poses;
  }
  return mix->references != NULL;
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
  bool is_built =
      moved && build_mixed_tracks(job, moved, count, clip, mix) && build_references(job, arena, mix);
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
