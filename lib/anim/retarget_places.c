/* The places of bones that carry the figure. */
#include <string.h>

#include "retarget_carrying.h"
#include "vector3.h"

/* Applies a node's own matrix, which may shear, to a place. */
static void move_by_matrix(const float m[16], double place[3]) {
  const double was[3] = {place[0], place[1], place[2]};
  for (int i = 0; i < 3; i++)
    place[i] =
        (double)m[i] * was[0] + (double)m[4 + i] * was[1] + (double)m[8 + i] * was[2] + (double)m[12 + i];
}

/* The place of a node of the source in the world. */
static void source_place(const tw_carrying *c, uint32_t node, float time, double out[3]) {
  const tw_node *nodes = c->job->source.nodes;
  tw_trs own = tw_carrying_source_at(c, node, time);
  for (int i = 0; i < 3; i++) out[i] = (double)own.translation[i];
  for (node = nodes[node].parent; node != TW_NO_INDEX; node = nodes[node].parent) {
    if (nodes[node].has_matrix && !tw_carrying_moves(c, node)) {
      move_by_matrix(nodes[node].matrix, out);
    } else {
      tw_trs trs = tw_carrying_source_at(c, node, time);
      tw_move_place(&trs, out);
    }
  }
}

/* The place of a bone of the target that carries the figure. */
typedef struct place {
  uint32_t bone;
  double offset[3]; /* in the target's world */
  uint32_t depth;
  const uint32_t *way;           /* [depth] the target's nodes above, from the root down */
  const struct place **carriers; /* [depth] places of those that are carried too; or NULL */
  const bool *has_matrix;        /* [depth] those that stay at rest by their own matrix, which may shear */
  float (*room)[4];
} place;

static void target_world(const tw_carrying *c, const place *place, float time, double out[3]) {
  const tw_fit *fit = &c->fit;
  double back[4];
  quat_conjugate(fit->turned, back);
  source_place(c, fit->bones[place->bone].source, time, out);
  tw_rotation_turn(back, out, out);
  for (int i = 0; i < 3; i++) out[i] = fit->scale * out[i] + place->offset[i];
}

/* A node's transform in the world; a column an axis. */
typedef struct world {
  double axes[3][3], origin[3];
} world;

static void descend(world *at, const double rotation[4], const double translation[3], const float scale[3]) {
  const world above = *at;
  for (int i = 0; i < 3; i++) {
    double axis[3] = {i == 0, i == 1, i == 2};
    tw_rotation_turn(rotation, axis, axis);
    for (int k = 0; k < 3; k++) {
      at->origin[k] += above.axes[i][k] * translation[i];
      at->axes[i][k] = (double)scale[i] *
                       (above.axes[0][k] * axis[0] + above.axes[1][k] * axis[1] + above.axes[2][k] * axis[2]);
    }
  }
}

static void descend_by_matrix(world *at, const float m[16]) {
  const world above = *at;
  for (int column = 0; column < 4; column++) {
    double *out = column < 3 ? at->axes[column] : at->origin;
    for (int k = 0; k < 3; k++) {
      out[k] = column < 3 ? 0 : above.origin[k];
      for (int i = 0; i < 3; i++) out[k] += above.axes[i][k] * (double)m[4 * column + i];
    }
  }
}

/* From the world into a node's frame. Along an axis that a scale of 0 has flattened it is the origin. */
static void into(const world *at, double point[3]) {
  double way[3], determinant = tw_determinant3(at->axes[0], at->axes[1], at->axes[2]);
  for (int i = 0; i < 3; i++) way[i] = point[i] - at->origin[i];
  if (determinant == 0) {
    for (int i = 0; i < 3; i++) {
      double square = tw_dot3(at->axes[i], at->axes[i]);
      point[i] = square > 0 ? tw_dot3(way, at->axes[i]) / square : 0;
    }
    return;
  }
  point[0] = tw_determinant3(way, at->axes[1], at->axes[2]);
  point[1] = tw_determinant3(at->axes[0], way, at->axes[2]);
  point[2] = tw_determinant3(at->axes[0], at->axes[1], way);
  for (int i = 0; i < 3; i++) point[i] /= determinant;
}

bool tw_carries_scale(const tw_fitted_bone *bone) {
  return tw_angle_between(bone->offset, TW_QUAT_IDENTITY) <= TW_REST_LIKE;
}

/* The track of the source that scales a node above the hips, as carry_others in retarget_keys.c carries it
 * over; TW_NO_INDEX where there is none. */
static uint32_t scale_track(const tw_carrying *c, uint32_t node) {
  uint32_t bone = c->fit.bone_of[node];
  if (bone == TW_NO_INDEX || !c->fit.bones[bone].is_carrier || !tw_carries_scale(&c->fit.bones[bone]))
    return TW_NO_INDEX;
  return c->track_of[TW_SCALE][c->fit.bones[bone].source];
}

/* The scale of a node of the target at a time. */
static void scale_at(const tw_carrying *c, uint32_t node, float time, float out[3]) {
  const float *rest = c->job->target.nodes[node].rest.scale;
  uint32_t track = scale_track(c, node);
  memcpy(out, rest, 3 * sizeof *out);
  if (track == TW_NO_INDEX) return;
  const float *source = c->job->source.nodes[c->fit.bones[c->fit.bone_of[node]].source].rest.scale;
  tw_clip_sample(c->clip, track, &time, 1, out);
  for (int i = 0; i < 3; i++)
    if (source[i] != 0) out[i] = (float)((double)out[i] * ((double)rest[i] / (double)source[i]));
}

/* From the target's world into the frame of the bone's parent, as the nodes above are at this time. */
static void localize(const tw_carrying *c, const place *place, float time, double point[3]) {
  world at = {.axes = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (uint32_t i = 0; i < place->depth; i++) {
    uint32_t node = place->way[i];
    if (place->has_matrix[i]) {
      descend_by_matrix(&at, c->job->target.nodes[node].matrix);
      continue;
    }
    const tw_trs *rest = &c->job->target.nodes[node].rest;
    double rotation[4], translation[3];
    float scale[3];
    scale_at(c, node, time, scale);
    tw_rest_turn(&c->job->target, node, rotation);
    for (int k = 0; k < 3; k++) translation[k] = (double)rest->translation[k];
    if (c->turns[node]) tw_turn_at(c, c->turns[node], time, place->room, rotation);
    descend(&at, rotation, translation, scale);
    if (place->carriers[i]) target_world(c, place->carriers[i], time, at.origin);
  }
  into(&at, point);
}

/* What a signal of a place takes. */
typedef struct place_signal {
  const tw_carrying *carrying;
  const place *place;
} place_signal;

static void signal_place(const void *context, float time, double *out) {
  const place_signal *signal = context;
  target_world(signal->carrying, signal->place, time, out);
  localize(signal->carrying, signal->place, time, out);
}

/* The tracks that a place depends on: those of the source's nodes from the root to its own, and those that
 * turn and scale the target's nodes above. */
static bool find_tracks(const tw_carrying *c, const place *place, uint32_t **tracks, uint32_t *count) {
  const tw_node *nodes = c->job->source.nodes;
  uint32_t source = c->fit.bones[place->bone].source;
  size_t most = 0;
  for (uint32_t node = source; node != TW_NO_INDEX; node = nodes[node].parent) most += 3;
  for (uint32_t i = 0; i < place->depth; i++)
    most += 1 + (c->turns[place->way[i]] ? c->turns[place->way[i]]->path.count : 0);
  *tracks = tw_arena_alloc_raw(c->scratch, most, sizeof **tracks);
  *count = 0;
  if (!*tracks) return false;
  for (uint32_t node = source; node != TW_NO_INDEX; node = nodes[node].parent)
    for (int path = 0; path < TW_WEIGHTS; path++) {
      bool counts = node != source || path == TW_TRANSLATION;
      if (counts && c->track_of[path][node] != TW_NO_INDEX) (*tracks)[(*count)++] = c->track_of[path][node];
    }
  if (*count == 0) return true;
  for (uint32_t i = 0; i < place->depth; i++) {
    const tw_bone_turn *turn = c->turns[place->way[i]];
    uint32_t scale = scale_track(c, place->way[i]);
    if (scale != TW_NO_INDEX) (*tracks)[(*count)++] = scale;
    for (uint32_t k = 0; turn && k < turn->path.count; k++) (*tracks)[(*count)++] = turn->path.steps[k].track;
  }
  return true;
}

/* The affine map from a translation of the source to one of the target. */
typedef struct affine {
  double columns[3][3], origin[3];
} affine;

static void map_translation(const void *context, const double *value, bool is_tangent, double *out) {
  const affine *map = context;
  for (int i = 0; i < 3; i++) {
    out[i] = is_tangent ? 0 : map->origin[i];
    for (int k = 0; k < 3; k++) out[i] += map->columns[k][i] * value[k];
  }
}

/* From a translation of the source's node, with nothing moving above, to the target's. */
static void place_of_translation(const tw_carrying *c, const place *place, const double translation[3],
                                 double out[3]) {
  const tw_fit *fit = &c->fit;
  const tw_node *nodes = c->job->source.nodes;
  double back[4];
  memcpy(out, translation, 3 * sizeof *out);
  for (uint32_t node = nodes[fit->bones[place->bone].source].parent; node != TW_NO_INDEX;
       node = nodes[node].parent) {
    if (nodes[node].has_matrix)
      move_by_matrix(nodes[node].matrix, out);
    else
      tw_move_place(&nodes[node].rest, out);
  }
  quat_conjugate(fit->turned, back);
  tw_rotation_turn(back, out, out);
  for (int i = 0; i < 3; i++) out[i] = fit->scale * out[i] + place->offset[i];
  localize(c, place, 0, out);
}

static tw_status carry_translation(tw_carrying *c, const place *place, uint32_t track, tw_error *error) {
  affine map;
  double zero[3] = {0};
  place_of_translation(c, place, zero, map.origin);
  for (int i = 0; i < 3; i++) {
    double unit[3] = {i == 0, i == 1, i == 2};
    place_of_translation(c, place, unit, map.columns[i]);
    for (int k = 0; k < 3; k++) map.columns[i][k] -= map.origin[k];
  }
  return tw_keys_carry(c, &c->tracks[track], c->fit.bones[place->bone].target, map_translation, &map, error);
}

/* Whether nothing above a bone of the target moves. */
static bool is_fixed_above(const tw_carrying *c, const place *place) {
  for (uint32_t i = 0; i < place->depth; i++)
    if (place->carriers[i] || (c->turns[place->way[i]] && c->turns[place->way[i]]->path.count > 0))
      return false;
  return true;
}

/* has_track: [nodes of the target] in the result so far. */
static tw_status make_place(tw_carrying *c, uint32_t bone, place **places, const bool *has_track,
                            uint64_t *depths, place **out, tw_error *error) {
  enum { DEPTHS_MOST = 1 << 12 }; /* a sample looks at all nodes above */
  const tw_fit *fit = &c->fit;
  const tw_node *nodes = c->job->target.nodes;
  uint32_t target = fit->bones[bone].target, depth = c->depths[1][target] - 1, steps = 1;
  *depths += (uint64_t)depth + c->depths[0][fit->bones[bone].source] - 1;
  if (*depths > DEPTHS_MOST)
    return tw_fail(error, TW_LIMIT, "too many nodes above the hips match to carry a clip over");
  place *made = *out = tw_arena_alloc(c->scratch, 1, sizeof *made);
  uint32_t *way = tw_arena_alloc_raw(c->scratch, depth, sizeof *way);
  const place **carriers = tw_arena_alloc(c->scratch, depth, sizeof(const place *));
  bool *has_matrix = tw_arena_alloc(c->scratch, depth, sizeof *has_matrix);
  if (!made || !way || !carriers || !has_matrix) return tw_carrying_no_memory(error);
  for (uint32_t node = nodes[target].parent, i = depth; node != TW_NO_INDEX; node = nodes[node].parent) {
    way[--i] = node;
    if (fit->bone_of[node] != TW_NO_INDEX) carriers[i] = places[fit->bone_of[node]];
    has_matrix[i] = nodes[node].has_matrix && !has_track[node] && scale_track(c, node) == TW_NO_INDEX;
    if (c->turns[node] && c->turns[node]->path.count > steps) steps = c->turns[node]->path.count;
  }
  *made = (place){.bone = bone,
                  .depth = depth,
                  .way = way,
                  .carriers = carriers,
                  .has_matrix = has_matrix,
                  .room = tw_arena_alloc_raw(c->scratch, steps, sizeof *made->room)};
  if (!made->room) return tw_carrying_no_memory(error);
  if (bone == fit->hips) {
    memcpy(made->offset, fit->hips_offset, sizeof made->offset);
    return TW_OK;
  }
  double back[4], rest[3];
  quat_conjugate(fit->turned, back);
  tw_rotation_turn(back, fit->source.place[fit->bones[bone].source], rest);
  for (int i = 0; i < 3; i++) made->offset[i] = fit->target.place[target][i] - fit->scale * rest[i];
  return TW_OK;
}

tw_status tw_places_carry(tw_carrying *c, tw_error *error) {
  const tw_fit *fit = &c->fit;
  place **places = tw_arena_alloc(c->scratch, fit->bone_count, sizeof(place *));
  bool *has_track = tw_arena_alloc(c->scratch, c->job->target.node_count, sizeof *has_track);
  tw_status status = places && has_track ? TW_OK : tw_carrying_no_memory(error);
  uint64_t depths = 0;
  uint32_t seen = 0; /* tracks of the result */
  for (uint32_t i = 0; i < fit->bone_count && status == TW_OK; i++) {
    if (!fit->bones[i].is_carrier) continue;
    uint32_t *tracks, count;
    place *place = NULL;
    for (; seen < c->out_count; seen++) has_track[c->out[seen].node] = true;
    status = make_place(c, i, places, has_track, &depths, &place, error);
    if (status != TW_OK) break;
    if (!find_tracks(c, place, &tracks, &count)) return tw_carrying_no_memory(error);
    if (count == 0) continue;
    places[i] = place;
    bool is_plain = count == 1 && c->tracks[tracks[0]].path == TW_TRANSLATION &&
                    c->tracks[tracks[0]].node == fit->bones[i].source && is_fixed_above(c, place);
    const place_signal context = {c, place};
    const tw_signal signal = {.indices = tracks,
                              .track_count = count,
                              .path = TW_TRANSLATION,
                              .at = signal_place,
                              .context = &context,
                              .cost = depths + count};
    status = is_plain ? carry_translation(c, place, tracks[0], error)
                      : tw_signal_carry(c, signal, fit->bones[i].target, error);
  }
  return status;
}
