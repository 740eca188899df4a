/* Carries what a VRMA moves of a face over to a VRM, as keys of morph weights and of eyes (VRMC_vrm 1.0,
 * "expressions" and "lookAt"; VRMC_vrm_animation 1.0). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "angle.h"
#include "quat.h"
#include "signal_keys.h"
#include "tweend/face.h"

const char *const tw_override_names[] = {"none", "block", "blend", NULL};

enum { LOOKS = 4 };
static const char *const look_names[LOOKS] = {"lookUp", "lookDown", "lookLeft", "lookRight"};

static bool is_among(const char *name, const char *const *names) {
  while (*names && strcmp(*names, name) != 0) names++;
  return *names;
}

tw_face_part tw_face_part_of(const char *name) {
  static const char *const names[TW_FACE_PARTS][6] = {
      {"blink", "blinkLeft", "blinkRight"},
      {"lookUp", "lookDown", "lookLeft", "lookRight"},
      {"aa", "ih", "ou", "ee", "oh"},
  };
  int part = 0;
  while (part < TW_FACE_PARTS && !is_among(name, names[part])) part++;
  return (tw_face_part)part;
}

bool tw_is_preset_expression(const char *name) {
  static const char *const others[] = {"happy", "angry", "sad", "relaxed", "surprised", "neutral", NULL};
  return tw_face_part_of(name) != TW_FACE_PARTS || is_among(name, others);
}

bool tw_face_has_node(const tw_face_nodes *face, uint32_t node) {
  bool has_node = face->gaze == node;
  for (uint32_t i = 0; i < face->expression_count && !has_node; i++)
    has_node = face->expressions[i].node == node;
  return has_node;
}

/* ---- the face at a time ---------------------------------------------------------------------- */

/* An expression that the clip moves. */
typedef struct driven {
  const tw_expression *expression;
  uint32_t track; /* TW_NO_INDEX: by the gaze */
  int look;       /* of look_names where the gaze moves it */
  tw_face_part part;
  double weight;
} driven;

typedef struct acting {
  const tw_face_job *job;
  tw_arena *arena; /* of the result */
  tw_arena *scratch;
  tw_track_keys *tracks; /* [track_count] those of the face */
  uint32_t *indices;     /* [track_count] 0, 1, ... */
  uint32_t track_count;
  uint32_t gaze_track; /* TW_NO_INDEX: the gaze does not move */
  tw_clip *clip;       /* of `tracks` */
  driven *driven;      /* [driven_count] */
  uint32_t driven_count;
  float *times; /* [time_count] where weights bend or jump between keys */
  uint32_t time_count, time_room;
} acting;

static double clamp_weight(double weight) {
  return weight > 0 ? weight < 1 ? weight : 1 : 0;
}

/* The gaze in degrees: to the left, and down. */
static void gaze_at(const acting *a, float time, double *yaw, double *pitch) {
  float rotation[4];
  double q[4], angles[3];
  tw_clip_sample(a->clip, a->gaze_track, &time, 1, rotation);
  quat_widen(rotation, q);
  tw_normalize(q, 4);
  tw_euler_of(q, TW_YXZ, angles);
  *pitch = angles[0] * TW_DEGREES;
  *yaw = angles[1] * TW_DEGREES;
}

static double curve_at(const tw_gaze_range *range, double at) {
  const tw_curve_key *keys = range->keys, *last = &keys[range->key_count - 1];
  if (at <= (double)keys->at) return (double)keys->value;
  if (at >= (double)last->at) return (double)last->value;
  while ((double)keys[1].at <= at) keys++;
  double span = (double)keys[1].at - (double)keys->at, u = (at - (double)keys->at) / span, v = 1 - u;
  double from = (double)keys->value, to = (double)keys[1].value;
  return v * v * ((1 + 2 * u) * from + u * span * (double)keys->out_slope) +
         u * u * ((1 + 2 * v) * to - v * span * (double)keys[1].in_slope);
}

static double map_range(const tw_gaze_range *range, double degrees) {
  double part = fmin(fabs(degrees) / (double)range->most, 1);
  return (range->keys ? curve_at(range, part) : part) * (double)range->scale;
}

static double look_at(const tw_face *face, int look, double yaw, double pitch) {
  switch (look) {
  case 0: return pitch < 0 ? map_range(&face->up, pitch) : 0;
  case 1: return pitch > 0 ? map_range(&face->down, pitch) : 0;
  case 2: return yaw > 0 ? map_range(&face->outer, yaw) : 0;
  default: return yaw < 0 ? map_range(&face->outer, yaw) : 0;
  }
}

/* Finds the weights of expressions, before others hold them back. */
static void find_own_weights(const acting *a, float time) {
  double yaw = 0, pitch = 0;
  if (a->gaze_track != TW_NO_INDEX) gaze_at(a, time, &yaw, &pitch);
  for (uint32_t i = 0; i < a->driven_count; i++) {
    driven *d = &a->driven[i];
    float place[3];
    if (d->track == TW_NO_INDEX) {
      d->weight = look_at(a->job->target, d->look, yaw, pitch);
    } else {
      tw_clip_sample(a->clip, d->track, &time, 1, place);
      d->weight = (double)place[0];
    }
    d->weight = clamp_weight(d->weight);
    if (d->expression->is_binary) d->weight = d->weight > 0.5 ? 1 : 0;
  }
}

/* How much of a part's weights is left. */
static double part_left(const acting *a, tw_face_part part) {
  double held = 0;
  for (uint32_t i = 0; i < a->driven_count; i++) {
    const driven *d = &a->driven[i];
    if (d->part == part) continue;
    if (d->expression->overrides[part] == TW_OVERRIDE_BLOCK) held += d->weight > 0 ? 1 : 0;
    if (d->expression->overrides[part] == TW_OVERRIDE_BLEND) held += d->weight;
  }
  return 1 - clamp_weight(held);
}

static void find_weights(const acting *a, float time) {
  double left[TW_FACE_PARTS];
  find_own_weights(a, time);
  for (int part = 0; part < TW_FACE_PARTS; part++) left[part] = part_left(a, (tw_face_part)part);
  for (uint32_t i = 0; i < a->driven_count; i++) {
    driven *d = &a->driven[i];
    if (d->part == TW_FACE_PARTS) continue;
    d->weight *= d->expression->is_binary && left[d->part] < 1 ? 0 : left[d->part];
  }
}

/* ---- what the clip moves --------------------------------------------------------------------- */

static tw_status no_memory(tw_error *error) {
  return tw_fail(error, TW_NO_MEMORY, "no memory to carry a face over");
}

static uint32_t find_track(const tw_face_job *job, uint32_t node, tw_path path) {
  for (uint32_t i = 0; node != TW_NO_INDEX && i < job->keys->track_count; i++)
    if (job->keys->tracks[i].node == node && job->keys->tracks[i].path == path) return i;
  return TW_NO_INDEX;
}

/* Takes a track of the source among those of the face. TW_NO_INDEX stays. */
static uint32_t take_track(acting *a, uint32_t track) {
  if (track == TW_NO_INDEX) return track;
  a->indices[a->track_count] = a->track_count;
  a->tracks[a->track_count] = a->job->keys->tracks[track];
  a->tracks[a->track_count].preserved = NULL;
  return a->track_count++;
}

static const tw_expression *find_expression(const tw_face *face, const char *name) {
  for (uint32_t i = 0; i < face->expression_count; i++)
    if (strcmp(face->expressions[i].name, name) == 0) return &face->expressions[i];
  return NULL;
}

static void drive(acting *a, const tw_expression *expression, uint32_t track, int look) {
  a->driven[a->driven_count++] = (driven){expression, track, look, tw_face_part_of(expression->name), 0};
}

/* Finds the expressions that the clip moves by nodes of their own. */
static void drive_by_nodes(acting *a, tw_face_carried *out) {
  const tw_face_nodes *source = a->job->source;
  for (uint32_t i = 0; i < source->expression_count; i++) {
    uint32_t track = find_track(a->job, source->expressions[i].node, TW_TRANSLATION);
    const tw_expression *expression = find_expression(a->job->target, source->expressions[i].name);
    if (track == TW_NO_INDEX) continue;
    if (expression)
      drive(a, expression, take_track(a, track), 0);
    else
      out->missing[out->missing_count++] = i;
  }
}

static bool has_eye(const tw_face_job *job) {
  const uint32_t *bones = job->skeleton.humanoid;
  return bones && (bones[TW_BONE_EYE] != TW_NO_INDEX || bones[TW_BONE_EYE + 1] != TW_NO_INDEX);
}

static void drive_by_gaze(acting *a, tw_face_carried *out) {
  const tw_face *target = a->job->target;
  uint32_t track = find_track(a->job, a->job->source->gaze, TW_ROTATION), before = a->driven_count;
  a->gaze_track = TW_NO_INDEX;
  out->has_gaze = track != TW_NO_INDEX;
  for (int look = 0; out->has_gaze && target->gaze == TW_GAZE_EXPRESSIONS && look < LOOKS; look++) {
    const tw_expression *expression = find_expression(target, look_names[look]);
    if (expression) drive(a, expression, TW_NO_INDEX, look);
  }
  out->moves_gaze =
      out->has_gaze && (a->driven_count > before || (target->gaze == TW_GAZE_BONES && has_eye(a->job)));
  if (out->moves_gaze) a->gaze_track = take_track(a, track);
}

static tw_status find_driven(acting *a, tw_face_carried *out, tw_error *error) {
  uint32_t count = a->job->source->expression_count;
  a->tracks = tw_arena_alloc_raw(a->scratch, (size_t)count + 1, sizeof *a->tracks);
  a->indices = tw_arena_alloc_raw(a->scratch, (size_t)count + 1, sizeof *a->indices);
  a->driven = tw_arena_alloc_raw(a->scratch, (size_t)count + LOOKS, sizeof *a->driven);
  out->missing = tw_arena_alloc_raw(a->arena, count, sizeof *out->missing);
  out->materials = tw_arena_alloc_raw(a->arena, (size_t)count + LOOKS, sizeof *out->materials);
  if (!a->tracks || !a->indices || !a->driven || !out->missing || !out->materials) return no_memory(error);
  drive_by_nodes(a, out);
  drive_by_gaze(a, out);
  for (uint32_t i = 0; i < a->driven_count; i++)
    if (a->driven[i].expression->moves_materials)
      out->materials[out->material_count++] =
          (uint32_t)(a->driven[i].expression - a->job->target->expressions);
  const tw_clip_keys all = {.track_count = a->track_count, .tracks = a->tracks};
  return tw_clip_create(&all, a->job->source_node_count, -1, &a->clip, error);
}

/* ---- bends between keys ---------------------------------------------------------------------- */

static tw_status add_time(acting *a, float time, tw_error *error) {
  if (a->time_count == a->time_room) {
    uint32_t room = a->time_room < UINT32_MAX / 4 ? 2 * a->time_room + 64 : 0;
    float *times = room ? tw_resize(a->times, room * sizeof *times) : NULL;
    if (!times) return no_memory(error);
    a->times = times;
    a->time_room = room;
  }
  a->times[a->time_count++] = time;
  return TW_OK;
}

/* Adds the time at which a LINEAR weight comes to a level between two keys. jumps: what depends on it jumps
 * there, so the times around it count too. */
static tw_status add_crossing(acting *a, const tw_track_keys *track, uint32_t key, double level, bool jumps,
                              tw_error *error) {
  double from = (double)track->values[3 * (size_t)key] - level,
         to = (double)track->values[3 * (size_t)key + 3] - level;
  float start = track->times[key], end = track->times[key + 1];
  if (from == to || from * to > 0 || (!jumps && from * to == 0)) return TW_OK;
  float time = (float)((double)start + from / (from - to) * ((double)end - (double)start));
  const float around[] = {nextafterf(time, start), time, nextafterf(time, end)};
  tw_status status = TW_OK;
  for (int i = jumps ? 0 : 1; i < (jumps ? 3 : 2) && status == TW_OK; i++)
    if (around[i] > start && around[i] < end) status = add_time(a, around[i], error);
  return status;
}

/* Adds the times at which weights of expressions are clamped, and at which binary ones and those that block
 * others jump. Elsewhere the tolerance decides. */
static tw_status find_bends(acting *a, tw_error *error) {
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < a->driven_count; i++) {
    const driven *d = &a->driven[i];
    bool is_binary = d->expression->is_binary, blocks = false;
    for (int part = 0; part < TW_FACE_PARTS; part++)
      blocks |= d->expression->overrides[part] == TW_OVERRIDE_BLOCK;
    const tw_track_keys *track = d->track == TW_NO_INDEX ? NULL : &a->tracks[d->track];
    if (!track || track->interpolation != TW_LINEAR) continue;
    for (uint32_t key = 0; key + 1 < track->key_count && status == TW_OK; key++) {
      if (is_binary)
        status = add_crossing(a, track, key, 0.5, true, error);
      else
        status = add_crossing(a, track, key, 0, blocks, error);
      if (status == TW_OK && !is_binary) status = add_crossing(a, track, key, 1, false, error);
    }
  }
  return status;
}

/* ---- morph weights --------------------------------------------------------------------------- */

/* A bind of a driven expression. */
typedef struct bound {
  uint32_t driven, target;
  double weight;
} bound;

/* The morph weights of a node. */
typedef struct node_weights {
  const acting *acting;
  const bound *binds; /* [bind_count] */
  uint32_t bind_count, width;
  const float *rest; /* [width] weights that nothing moves; 0 where an expression binds */
} node_weights;

static void weights_at(const void *context, float time, double *out) {
  const node_weights *node = context;
  find_weights(node->acting, time);
  for (uint32_t i = 0; i < node->width; i++) out[i] = (double)node->rest[i];
  for (uint32_t i = 0; i < node->bind_count; i++)
    out[node->binds[i].target] += node->acting->driven[node->binds[i].driven].weight * node->binds[i].weight;
}

/* The binds of driven expressions by node: those of node i from starts[i] to starts[i + 1]. */
typedef struct node_binds {
  uint32_t *starts; /* [nodes + 1] */
  bound *all;
} node_binds;

static bool sort_binds(const acting *a, node_binds *out) {
  uint32_t count = a->job->skeleton.node_count;
  size_t total = 0;
  out->starts = tw_arena_alloc(a->scratch, (size_t)count + 2, sizeof *out->starts);
  if (!out->starts) return false;
  uint32_t *next = out->starts + 1; /* of the node before, while binds are put */
  for (uint32_t i = 0; i < a->driven_count; i++) {
    const tw_expression *expression = a->driven[i].expression;
    total += expression->bind_count;
    for (uint32_t k = 0; k < expression->bind_count; k++) next[expression->binds[k].node + 1]++;
  }
  for (uint32_t i = 0; i < count; i++) next[i + 1] += next[i];
  out->all = tw_arena_alloc_raw(a->scratch, total, sizeof *out->all);
  if (!out->all) return false;
  for (uint32_t i = 0; i < a->driven_count; i++) {
    const tw_expression *expression = a->driven[i].expression;
    for (uint32_t k = 0; k < expression->bind_count; k++) {
      const tw_morph_bind *bind = &expression->binds[k];
      out->all[next[bind->node]++] = (bound){i, bind->target, (double)bind->weight};
    }
  }
  return true;
}

/* The weights at rest of nodes with driven binds; 0 where an expression of the face binds. NULL for other
 * nodes. */
static bool find_rests(const acting *a, const node_binds *binds, float **rests) {
  const tw_face_job *job = a->job;
  for (uint32_t i = 0; i < job->skeleton.node_count; i++) {
    if (binds->starts[i] == binds->starts[i + 1]) continue;
    const float *rest = job->rest_weights[i];
    rests[i] = tw_arena_alloc(a->scratch, job->morph_counts[i], sizeof **rests);
    if (!rests[i]) return false;
    if (rest) memcpy(rests[i], rest, job->morph_counts[i] * sizeof *rest);
  }
  for (uint32_t i = 0; i < job->target->expression_count; i++) {
    const tw_expression *expression = &job->target->expressions[i];
    for (uint32_t k = 0; k < expression->bind_count; k++)
      if (rests[expression->binds[k].node]) rests[expression->binds[k].node][expression->binds[k].target] = 0;
  }
  return true;
}

static tw_signal signal_of(const acting *a, tw_path path, uint32_t width) {
  const tw_tolerance *tolerance = &a->job->tolerance;
  return (tw_signal){.tracks = a->tracks,
                     .indices = a->indices,
                     .track_count = a->track_count,
                     .path = path,
                     .width = width,
                     .tolerance = path == TW_ROTATION ? tolerance->angle : tolerance->distance,
                     .max_keys = a->job->max_keys,
                     .cost = a->driven_count};
}

static tw_status carry_weights(acting *a, tw_track_keys *tracks, uint32_t *track_count, tw_error *error) {
  uint32_t count = a->job->skeleton.node_count;
  node_binds binds;
  float **rests = tw_arena_alloc(a->scratch, count, sizeof *rests);
  if (!rests || !sort_binds(a, &binds) || !find_rests(a, &binds, rests)) return no_memory(error);
  tw_status status = find_bends(a, error);
  for (uint32_t node = 0; node < count && status == TW_OK; node++) {
    if (!rests[node]) continue;
    node_weights context = {.acting = a,
                            .binds = binds.all + binds.starts[node],
                            .bind_count = binds.starts[node + 1] - binds.starts[node],
                            .width = a->job->morph_counts[node],
                            .rest = rests[node]};
    tw_signal signal = signal_of(a, TW_WEIGHTS, context.width);
    signal.at = weights_at;
    signal.context = &context;
    signal.times = a->times;
    signal.time_count = a->time_count;
    signal.cost += context.bind_count;
    status = tw_signal_sample(&signal, node, a->arena, &tracks[*track_count], error);
    *track_count += status == TW_OK;
  }
  return status;
}

/* ---- eyes ------------------------------------------------------------------------------------ */

typedef struct eye {
  const acting *acting;
  bool is_left;
  double before[4], after[4]; /* local = before * turn * after */
} eye;

static void eye_at(const void *context, float time, double *out) {
  const eye *eye = context;
  const tw_face *face = eye->acting->job->target;
  double yaw, pitch, turn[4];
  gaze_at(eye->acting, time, &yaw, &pitch);
  double sideways = map_range((yaw > 0) == eye->is_left ? &face->outer : &face->inner, yaw),
         upright = map_range(pitch > 0 ? &face->down : &face->up, pitch);
  const double angles[3] = {copysign(1, pitch) * upright / TW_DEGREES,
                            copysign(1, yaw) * sideways / TW_DEGREES, 0};
  tw_quat_euler(angles, TW_YXZ, turn);
  quat_multiply(eye->before, turn, out);
  quat_multiply(out, eye->after, out);
}

static void rest_turn(const tw_skeleton *skeleton, uint32_t node, double out[4]) {
  quat_widen(skeleton->nodes[node].rest.rotation, out);
  tw_normalize(out, 4);
}

/* In the world the eye turns by F turn F^-1 from its rest pose, where F turns +z to the face's front. */
static eye eye_of(const acting *a, uint32_t node, bool is_left) {
  static const double back[4] = {0, 1, 0, 0};
  const tw_skeleton *skeleton = &a->job->skeleton;
  const double *front = a->job->target->faces_back ? back : TW_QUAT_IDENTITY;
  double above[4] = {0, 0, 0, 1}, rest[4];
  for (uint32_t i = skeleton->nodes[node].parent; i != TW_NO_INDEX; i = skeleton->nodes[i].parent) {
    rest_turn(skeleton, i, rest);
    quat_multiply(rest, above, above);
  }
  rest_turn(skeleton, node, rest);
  eye out = {.acting = a, .is_left = is_left};
  quat_conjugate(front, out.after);
  quat_multiply(out.after, above, out.after);
  quat_multiply(out.after, rest, out.after);
  quat_conjugate(above, above);
  quat_multiply(above, front, out.before);
  return out;
}

static tw_status carry_eyes(acting *a, tw_track_keys *tracks, uint32_t *track_count, tw_error *error) {
  const uint32_t *bones = a->job->skeleton.humanoid;
  tw_status status = TW_OK;
  for (uint32_t side = 0; side < 2 && status == TW_OK; side++) {
    uint32_t node = bones[TW_BONE_EYE + side];
    if (node == TW_NO_INDEX) continue;
    eye context = eye_of(a, node, side == 0);
    tw_signal signal = signal_of(a, TW_ROTATION, 4);
    signal.indices = &a->indices[a->gaze_track];
    signal.track_count = 1;
    signal.at = eye_at;
    signal.context = &context;
    signal.tolerance /= 4; /* the ranges end in kinks, which lie between the probes */
    status = tw_signal_sample(&signal, node, a->arena, &tracks[*track_count], error);
    *track_count += status == TW_OK;
  }
  return status;
}

/* ---- the job --------------------------------------------------------------------------------- */

static tw_status carry(acting *a, tw_face_carried *out, tw_error *error) {
  tw_status status = find_driven(a, out, error);
  if (status != TW_OK) return status;
  tw_track_keys *tracks =
      tw_arena_alloc_raw(a->arena, (size_t)a->job->skeleton.node_count + 2, sizeof *tracks);
  if (!tracks) return no_memory(error);
  out->keys = (tw_clip_keys){.tracks = tracks};
  if (a->driven_count > 0) status = carry_weights(a, tracks, &out->keys.track_count, error);
  if (status == TW_OK && out->moves_gaze && a->job->target->gaze == TW_GAZE_BONES)
    status = carry_eyes(a, tracks, &out->keys.track_count, error);
  return status;
}

tw_status tw_face_carry(const tw_face_job *job, tw_arena *arena, tw_face_carried *out, tw_error *error) {
  acting a = {.job = job, .arena = arena, .scratch = tw_arena_create()};
  tw_face_carried made = {0};
  tw_status status = a.scratch ? carry(&a, &made, error) : no_memory(error);
  tw_clip_destroy(a.clip);
  tw_free(a.times);
  tw_arena_destroy(a.scratch);
  if (status == TW_OK) *out = made;
  return status;
}
