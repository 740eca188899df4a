/* Inverse kinematics of two bones: the knee bends until the foot is as far from the hip as its new place is,
 * then the whole leg swings there. Where a leg would be too short, or nearly straight, the hips are lowered
 * first. */
#include "foot_hold.h"

#include <math.h>
#include <string.h>

#include "tweend/clip_report.h"
#include "vector3.h"
#include "way.h"

enum { UPPER, LOWER, FOOT, JOINTS };
enum { SIDES = 2 };

static const double BLEND = 0.15;   /* seconds in which a foot comes to its place, and leaves it */
static const double STRETCH = 0.99; /* of a leg's length, while its foot is held: straighter knees snap */
static const double SLIGHT = 0.005; /* of a leg's length: feet that are moved less leave knees as they are */
static const double HINGE = 0.05;   /* how much the knee's own axis counts where it is nearly straight */
static const double LOWERED = 0.1;  /* of a leg's length: the most that hips go down */

/* A time in which the foot stands. Places and offsets are x and z. */
typedef struct touch {
  double from, to, place[2];
  double coming[2], leaving[2]; /* from where the clip has the foot, at `from` and `to` */
  double before, after;         /* seconds of blending */
  double strength;              /* 0 where the foot is moved by less than SLIGHT, 1 from twice that on */
} touch;

typedef struct leg {
  uint32_t nodes[JOINTS];
  tw_way way;         /* to the upper leg */
  uint32_t below;     /* nodes below it, to the foot */
  tw_way_node *chain; /* [below] */
  uint32_t lower;     /* of the chain */
  double hinge[3];    /* about which the knee bends, in the upper leg's frame */
  uint32_t touch_count;
  touch *touches; /* [touch_count] by time */
} leg;

typedef struct holding {
  const tw_clip *clip; /* of the target, without this */
  uint32_t leg_count;
  leg legs[SIDES];
  uint32_t hips; /* the node that is lowered, above all legs; or TW_NO_INDEX */
  tw_way hips_way;
  uint32_t lowered_count;
  float *lowered; /* [lowered_count] how far, every so many seconds */
  double lowered_step;
} holding;

/* The joints of a leg in the world, and the frames that they are in. */
typedef struct leg_pose {
  tw_affine frames[JOINTS], joints[JOINTS];
} leg_pose;

static leg_pose pose_at(const tw_clip *clip, const leg *leg, float time) {
  leg_pose out;
  tw_trs local = tw_way_local_at(clip, &leg->way.own, time);
  tw_affine own = tw_affine_of(&local);
  out.frames[UPPER] = tw_way_parent_at(clip, &leg->way, time);
  out.joints[UPPER] = tw_affine_product(&out.frames[UPPER], &own);
  tw_affine world = out.joints[UPPER];
  for (uint32_t i = 0; i < leg->below; i++) {
    local = tw_way_local_at(clip, &leg->chain[i], time);
    own = tw_affine_of(&local);
    int joint = i == leg->lower ? LOWER : FOOT; /* the last one stays */
    out.frames[joint] = world;
    world = tw_affine_product(&world, &own);
    out.joints[joint] = world;
  }
  return out;
}

/* ---- where the foot should be ---------------------------------------------------------------- */

/* 0 to 1, with a slope of 0 at both. */
static double ease(double t) {
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}

/* How far the foot is moved. at: where the clip has it. Returns how much the knee is kept from straightening,
 * 0 to 1. */
static double offset_at(const leg *leg, double time, const double at[3], double out[2]) {
  uint32_t next = 0, end = leg->touch_count; /* the first touch that begins later */
  double kept = 0;
  while (next < end) {
    uint32_t middle = next + (end - next) / 2;
    if (leg->touches[middle].from <= time)
      next = middle + 1;
    else
      end = middle;
  }
  out[0] = out[1] = 0;
  if (next > 0) {
    const touch *last = &leg->touches[next - 1];
    bool stands = time <= last->to;
    double held = stands ? 1 : last->after > 0 ? 1 - ease((time - last->to) / last->after) : 0;
    for (size_t i = 0; i < 2; i++) out[i] += held * (stands ? last->place[i] - at[2 * i] : last->leaving[i]);
    kept = held * last->strength;
    if (stands) return kept;
  }
  if (next == leg->touch_count) return kept;
  const touch *coming = &leg->touches[next];
  double part = coming->before > 0 ? 1 - ease((coming->from - time) / coming->before) : 0;
  for (int i = 0; i < 2; i++) out[i] += part * coming->coming[i];
  return kept + part * coming->strength; /* blends do not overlap */
}

/* ---- lowering the hips ----------------------------------------------------------------------- */

static double distance(const double a[3], const double b[3]) {
  const double way[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return tw_length3(way);
}

/* The longest that a leg may become from hip to foot. now: as the clip has it; kept: as of offset_at. Near a
 * straight leg the knee turns without bound for the way that the foot goes, so that it stays a little bent
 * while the foot is held. */
static double longest(double now, double length, double kept) {
  double soft = STRETCH * length;
  return now > soft ? soft + (1 - kept) * (now - soft) : soft;
}

/* How far the hips have to go down until the leg reaches `goal`, up to LOWERED. */
static double find_need(const leg_pose *pose, const double goal[3], double kept) {
  const double *hip = pose->joints[UPPER].at, *knee = pose->joints[LOWER].at, *ankle = pose->joints[FOOT].at;
  double length = distance(hip, knee) + distance(knee, ankle);
  double most = longest(distance(hip, ankle), length, kept);
  double aside = hypot(goal[0] - hip[0], goal[2] - hip[2]);
  double need = hip[1] - goal[1] - sqrt(fmax(most * most - aside * aside, 0));
  return fmin(fmax(need, 0), LOWERED * length);
}

/* The larger need of the legs whose feet are held. */
static double need_at(const holding *h, float time) {
  double most = 0;
  for (uint32_t l = 0; l < h->leg_count; l++) {
    const leg_pose pose = pose_at(h->clip, &h->legs[l], time);
    double goal[3], offset[2];
    memcpy(goal, pose.joints[FOOT].at, sizeof goal);
    double kept = offset_at(&h->legs[l], (double)time, goal, offset);
    if (kept == 0 && offset[0] == 0 && offset[1] == 0) continue;
    goal[0] += offset[0];
    goal[2] += offset[1];
    most = fmax(most, find_need(&pose, goal, kept));
  }
  return most;
}

/* The most, or the mean, of the values up to `reach` away on either side; the first and the last go on beyond
 * the ends. */
static void spread(const float *values, uint32_t count, uint32_t reach, bool is_mean, float *out) {
  for (uint32_t i = 0; i < count; i++) {
    float most = values[i];
    double sum = 0;
    for (uint32_t k = 0; k <= 2 * reach; k++) {
      uint32_t at = i + k < reach ? 0 : i + k - reach;
      float value = values[at < count ? at : count - 1];
      sum += (double)value;
      if (value > most) most = value;
    }
    out[i] = is_mean ? (float)(sum / (2 * reach + 1)) : most;
  }
}

/* Finds how far the hips are lowered at all times: nowhere less than the legs need, since the running maximum
 * of the need is averaged over as long a time as it is taken. */
static tw_status find_lowering(holding *h, tw_arena *arena, tw_error *error) {
  enum { RATE = 60, SAMPLES_MOST = 1 << 20, LEG_COST = 200 };
  double duration = (double)tw_clip_duration(h->clip);
  h->lowered_step = fmax(1.0 / RATE, duration / SAMPLES_MOST);
  h->lowered_count = (uint32_t)(duration / h->lowered_step) + 2;
  h->lowered = tw_arena_alloc_raw(arena, h->lowered_count, sizeof *h->lowered);
  float *other = tw_arena_alloc_raw(arena, h->lowered_count, sizeof *other);
  if (!h->lowered || !other) return tw_fail(error, TW_NO_MEMORY, "no memory to hold feet");
  uint64_t cost = 0;
  for (uint32_t l = 0; l < h->leg_count; l++)
    cost += LEG_COST * (uint64_t)(h->legs[l].way.count + h->legs[l].below + 1);
  for (uint32_t i = 0; i < h->lowered_count; i++) {
    h->lowered[i] = (float)need_at(h, (float)(i * h->lowered_step));
    if (!tw_work(cost)) return tw_work_status(error);
  }
  uint32_t reach = (uint32_t)(BLEND / h->lowered_step);
  spread(h->lowered, h->lowered_count, reach, false, other);
  spread(other, h->lowered_count, reach / 2, true, h->lowered);
  spread(h->lowered, h->lowered_count, reach - reach / 2, true, other);
  h->lowered = other;
  return TW_OK;
}

static double lowering_at(const holding *h, float time) {
  if (h->hips == TW_NO_INDEX) return 0;
  double at = fmin(fmax((double)time / h->lowered_step, 0), h->lowered_count - 1.0);
  uint32_t i = (uint32_t)fmin(floor(at), h->lowered_count - 2.0);
  double part = at - i;
  return (1 - part) * (double)h->lowered[i] + part * (double)h->lowered[i + 1];
}

/* The place of the hips in their parent. */
static void hips_at(const holding *h, float time, float out[3]) {
  tw_trs local = tw_way_local_at(h->clip, &h->hips_way.own, time);
  const tw_affine parent = tw_way_parent_at(h->clip, &h->hips_way, time);
  double way[3];
  tw_affine_solve(&parent, (const double[3]){0, -lowering_at(h, time), 0}, way);
  for (int i = 0; i < 3; i++) out[i] = (float)((double)local.translation[i] + way[i]);
}

/* ---- bending and swinging -------------------------------------------------------------------- */

/* The shortest turn from one direction to another. */
static void turn_towards(const double from[3], const double to[3], double out[4]) {
  tw_cross3(from, to, out);
  out[3] = tw_dot3(from, to) + tw_length3(from) * tw_length3(to);
  if (!(tw_normalize(out, 4) > 0)) memcpy(out, (const double[4]){0, 0, 0, 1}, 4 * sizeof *out);
}

/* The unit axis about which the knee bends from the thigh (knee to hip) to the shin (knee to foot): that of
 * the pose and a little of its own, as a straight leg has none. */
static bool find_axis(const leg_pose *pose, const leg *leg, const double thigh[3], const double shin[3],
                      double out[3]) {
  double hinge[3], along[3] = {thigh[0], thigh[1], thigh[2]};
  double share = HINGE * tw_length3(thigh) * tw_length3(shin);
  for (int i = 0; i < 3; i++)
    hinge[i] = tw_dot3((const double[3]){pose->joints[UPPER].axes[0][i], pose->joints[UPPER].axes[1][i],
                                         pose->joints[UPPER].axes[2][i]},
                       leg->hinge);
  tw_unit3(hinge);
  tw_unit3(along);
  tw_cross3(thigh, shin, out);
  for (int i = 0; i < 3; i++) out[i] += share * hinge[i];
  double part = tw_dot3(out, along);
  for (int i = 0; i < 3; i++) out[i] -= part * along[i];
  return tw_unit3(out) > 0;
}

/* The turns of the upper leg, then of the lower leg, in the world, that bring the foot to `goal`. */
static void reach(const leg_pose *pose, const leg *leg, const double goal[3], double kept, double swing[4],
                  double bend[4]) {
  double thigh[3], shin[3], axis[3], foot[3], way[3];
  const double *hip = pose->joints[UPPER].at, *knee = pose->joints[LOWER].at, *ankle = pose->joints[FOOT].at;
  for (int i = 0; i < 3; i++) {
    thigh[i] = hip[i] - knee[i];
    shin[i] = ankle[i] - knee[i];
    foot[i] = ankle[i] - hip[i];
    way[i] = goal[i] - hip[i];
  }
  memcpy(bend, (const double[4]){0, 0, 0, 1}, 4 * sizeof *bend);
  if (find_axis(pose, leg, thigh, shin, axis)) {
    double across[3], flat[3], part = tw_dot3(shin, axis), a = tw_length3(thigh), b = tw_length3(shin);
    for (int i = 0; i < 3; i++) flat[i] = shin[i] - part * axis[i];
    tw_cross3(thigh, flat, across);
    double now = atan2(tw_dot3(across, axis), tw_dot3(thigh, flat));
    double far = fmin(tw_length3(way), longest(tw_length3(foot), a + b, kept));
    double cosine = (a * a + b * b - far * far) / (2 * a * tw_length3(flat));
    tw_quat_axis_angle(axis, acos(fmin(fmax(cosine, -1), 1)) - now, bend);
    tw_rotation_turn(bend, shin, shin);
    for (int i = 0; i < 3; i++) foot[i] = shin[i] - thigh[i];
  }
  turn_towards(foot, way, swing);
}

/* The rotation of a joint of the leg, as its track has it. */
static void joint_at(const holding *h, const leg *leg, int joint, float time, float out[4]) {
  leg_pose pose = pose_at(h->clip, leg, time);
  const tw_way_node *node = joint == UPPER   ? &leg->way.own
                            : joint == LOWER ? &leg->chain[leg->lower]
                                             : &leg->chain[leg->below - 1];
  tw_trs local = tw_way_local_at(h->clip, node, time);
  double goal[3], offset[2], swing[4], bend[4], turn[4], inside[4], q[4], result[4];
  memcpy(goal, pose.joints[FOOT].at, sizeof goal);
  double kept = offset_at(leg, (double)time, goal, offset);
  memcpy(out, local.rotation, sizeof local.rotation);
  double lowered = lowering_at(h, time);
  if (kept == 0 && offset[0] == 0 && offset[1] == 0 && lowered == 0) return;
  for (int i = 0; i < JOINTS; i++) pose.joints[i].at[1] -= lowered;
  goal[0] += offset[0];
  goal[2] += offset[1];
  reach(&pose, leg, goal, kept, swing, bend);
  if (joint == UPPER) memcpy(turn, swing, sizeof turn);
  if (joint == LOWER) memcpy(turn, bend, sizeof turn); /* the swing turns its frame as well */
  if (joint == FOOT) {                                 /* stays as it is in the world */
    quat_multiply(swing, bend, turn);
    for (int i = 0; i < 3; i++) turn[i] = -turn[i];
  }
  tw_affine_turn_inside(&pose.frames[joint], turn, inside);
  quat_widen(local.rotation, q);
  quat_multiply(inside, q, result);
  tw_normalize(result, 4);
  quat_narrow(result, out);
}

/* ---- the legs -------------------------------------------------------------------------------- */

/* The nodes of a leg, by their bones. False where the target lacks one, or they are not below each other. */
static bool find_leg(const tw_retarget_job *job, const tw_bone_match *match, uint32_t side, leg *out) {
  static const uint32_t bones[JOINTS] = {TW_BONE_UPPER_LEG, TW_BONE_LOWER_LEG, TW_BONE_FOOT};
  for (int joint = 0; joint < JOINTS; joint++) out->nodes[joint] = TW_NO_INDEX;
  for (uint32_t n = 0; n < job->target.node_count; n++)
    for (int joint = 0; joint < JOINTS; joint++)
      if (match->role[n] == bones[joint] + side && match->source_of[n] != TW_NO_INDEX) out->nodes[joint] = n;
  if (out->nodes[FOOT] == TW_NO_INDEX || out->nodes[UPPER] == TW_NO_INDEX) return false;
  uint32_t node = out->nodes[FOOT], lower = 0;
  out->below = 0;
  while (node != TW_NO_INDEX && node != out->nodes[UPPER]) {
    out->below++;
    if (node == out->nodes[LOWER]) lower = out->below;
    node = job->target.nodes[node].parent;
  }
  out->lower = out->below - lower;
  return node != TW_NO_INDEX && lower > 1;
}

static bool find_ways(const tw_retarget_job *job, const tw_node_tracks *tracks, tw_arena *arena, leg *leg) {
  const tw_node *nodes = job->target.nodes;
  leg->chain = tw_arena_alloc(arena, leg->below, sizeof *leg->chain);
  if (!leg->chain || !tw_way_find(tracks, nodes, leg->nodes[UPPER], arena, &leg->way)) return false;
  uint32_t node = leg->nodes[FOOT];
  for (uint32_t i = leg->below; i-- > 0; node = nodes[node].parent)
    leg->chain[i] = tw_way_node_of(tracks, nodes, node);
  return true;
}

/* Finds the knee's own axis where it is bent most. */
static void find_hinge(const tw_clip *clip, leg *leg) {
  enum { LOOKS = 64 };
  double most = 0;
  for (int i = 0; i < LOOKS; i++) {
    leg_pose pose = pose_at(clip, leg, tw_clip_duration(clip) * (float)i / LOOKS);
    double thigh[3], shin[3], axis[3];
    for (int k = 0; k < 3; k++) {
      thigh[k] = pose.joints[UPPER].at[k] - pose.joints[LOWER].at[k];
      shin[k] = pose.joints[FOOT].at[k] - pose.joints[LOWER].at[k];
    }
    tw_cross3(thigh, shin, axis);
    double bent = tw_length3(axis);
    if (bent <= most) continue;
    most = bent;
    tw_affine_solve(&pose.joints[UPPER], axis, leg->hinge);
    tw_unit3(leg->hinge);
  }
}

/* ---- contacts -------------------------------------------------------------------------------- */

/* Places the foot in the middle of where the clip has it meanwhile. */
static void place_touch(const tw_clip *clip, const leg *leg, touch *out) {
  enum { LOOKS = 8 };
  double sum[2] = {0, 0}, at[LOOKS + 1][2], length = 0, moved = 0;
  for (int i = 0; i <= LOOKS; i++) {
    const leg_pose pose = pose_at(clip, leg, (float)(out->from + (out->to - out->from) * i / LOOKS));
    length = distance(pose.joints[UPPER].at, pose.joints[LOWER].at) +
             distance(pose.joints[LOWER].at, pose.joints[FOOT].at);
    for (size_t k = 0; k < 2; k++) sum[k] += at[i][k] = pose.joints[FOOT].at[2 * k];
  }
  for (int k = 0; k < 2; k++) {
    out->place[k] = sum[k] / (LOOKS + 1);
    out->coming[k] = out->place[k] - at[0][k];
    out->leaving[k] = out->place[k] - at[LOOKS][k];
  }
  for (int i = 0; i <= LOOKS; i++)
    moved = fmax(moved, hypot(at[i][0] - out->place[0], at[i][1] - out->place[1]));
  out->strength = length > 0 ? ease(moved / (SLIGHT * length) - 1) : 0;
}

/* Takes the contacts of a foot of the source. */
static bool take_touches(const tw_clip_report *report, uint32_t foot, tw_arena *arena, leg *leg) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < report->contact_count; i++) count += report->contacts[i].node == foot;
  leg->touches = tw_arena_alloc(arena, count, sizeof *leg->touches);
  for (uint32_t i = 0; leg->touches && i < report->contact_count; i++)
    if (report->contacts[i].node == foot)
      leg->touches[leg->touch_count++] =
          (touch){.from = report->contacts[i].from, .to = report->contacts[i].to};
  return leg->touches;
}

static tw_status place_touches(const tw_clip *clip, leg *leg, tw_error *error) {
  for (uint32_t i = 0; i < leg->touch_count; i++) {
    touch *t = &leg->touches[i];
    place_touch(clip, leg, t);
    double since = i > 0 ? (t->from - leg->touches[i - 1].to) / 2 : t->from;
    t->before = fmin(BLEND, since);
    t->after = i + 1 < leg->touch_count ? fmin(BLEND, (leg->touches[i + 1].from - t->to) / 2) : BLEND;
    if (!tw_work(500 * (uint64_t)(leg->way.count + leg->below))) return tw_work_status(error);
  }
  return TW_OK;
}

/* ---- the clip -------------------------------------------------------------------------------- */

static void held_sample(const tw_clip *clip, uint32_t track, const float *times, size_t time_count,
                        float *out) {
  const holding *h = clip->making;
  for (size_t i = 0; i < time_count; i++)
    if (track == h->leg_count * JOINTS)
      hips_at(h, times[i], out + 3 * i);
    else
      joint_at(h, &h->legs[track / JOINTS], (int)(track % JOINTS), times[i], out + 4 * i);
}

static bool leg_bends(const holding *h, const leg *leg, const tw_bend_sink *sink) {
  if (!tw_way_bends(h->clip, &leg->way, sink)) return false;
  for (uint32_t i = 0; i < leg->below; i++)
    if (!tw_way_node_bends(h->clip, &leg->chain[i], sink)) return false;
  for (uint32_t i = 0; i < leg->touch_count; i++) {
    const touch *t = &leg->touches[i];
    const double times[] = {t->from - t->before, t->from, t->to, t->to + t->after};
    for (int k = 0; k < 4; k++)
      if (times[k] < (double)h->clip->duration && !bend_put(sink, times[k], 1)) return false;
  }
  return true;
}

static bool held_bends(const tw_clip *clip, uint32_t track, const tw_bend_sink *sink) {
  const holding *h = clip->making;
  bool is_hips = track == h->leg_count * JOINTS;
  for (uint32_t l = 0; l < h->leg_count; l++)
    if ((is_hips || track / JOINTS == l) && !leg_bends(h, &h->legs[l], sink)) return false;
  double duration = (double)clip->duration, step = fmax(BLEND, h->lowered_step);
  for (double time = step; h->hips != TW_NO_INDEX && time < duration; time += step)
    if (!bend_put(sink, time, 1)) return false;
  return bend_put(sink, duration, 1); /* legs and hips may move until then */
}

/* The rotations of the legs, and the place of the hips, alone, as a clip that is sampled and reduced. It
 * lives in the arena. */
static tw_clip *make_clip(holding *h, tw_arena *arena) {
  static const tw_clip_kind kind = {.sample = held_sample, .bends = held_bends};
  tw_clip *clip = tw_arena_alloc(arena, 1, sizeof *clip);
  tw_track *tracks = tw_arena_alloc(arena, SIDES * JOINTS + 1, sizeof *tracks);
  if (!clip || !tracks) return NULL;
  *clip = (tw_clip){.node_count = h->clip->node_count,
                    .tracks = tracks,
                    .duration = h->clip->duration,
                    .kind = &kind,
                    .making = h,
                    .leaves = 1};
  for (uint32_t l = 0; l < h->leg_count; l++) {
    for (int joint = 0; joint < JOINTS; joint++)
      tracks[clip->track_count++] =
          (tw_track){.kind = TRACK_MADE, .node = h->legs[l].nodes[joint], .path = TW_ROTATION, .width = 4};
    clip->cost += 4 * (h->legs[l].way.count + h->legs[l].below + 1);
  }
  if (h->hips != TW_NO_INDEX)
    tracks[clip->track_count++] =
        (tw_track){.kind = TRACK_MADE, .node = h->hips, .path = TW_TRANSLATION, .width = 3};
  return clip;
}

/* Puts tracks in the place of those that move the same. */
static bool replace_tracks(const tw_clip_keys *held, tw_arena *arena, tw_clip_keys *keys) {
  tw_track_keys *tracks =
      tw_arena_alloc_raw(arena, (size_t)keys->track_count + held->track_count, sizeof *tracks);
  if (!tracks) return false;
  if (keys->track_count > 0) memcpy(tracks, keys->tracks, keys->track_count * sizeof *tracks);
  for (uint32_t i = 0; i < held->track_count; i++) {
    uint32_t at = 0;
    while (at < keys->track_count &&
           (tracks[at].node != held->tracks[i].node || tracks[at].path != held->tracks[i].path))
      at++;
    if (at == keys->track_count) keys->track_count++;
    tracks[at] = held->tracks[i];
  }
  keys->tracks = tracks;
  return true;
}

/* Finds the hips, where they are above all legs. False without memory. */
static bool find_hips(const tw_retarget_job *job, const tw_bone_match *match, const tw_node_tracks *tracks,
                      tw_arena *arena, holding *h) {
  uint32_t count = 0;
  h->hips = TW_NO_INDEX;
  for (uint32_t n = 0; n < job->target.node_count; n++)
    if (match->role[n] == TW_BONE_HIPS && match->source_of[n] != TW_NO_INDEX) h->hips = n;
  for (uint32_t l = 0; l < h->leg_count; l++) {
    uint32_t node = h->legs[l].nodes[UPPER];
    while (node != TW_NO_INDEX && node != h->hips) node = job->target.nodes[node].parent;
    count += node != TW_NO_INDEX;
  }
  if (count < h->leg_count) h->hips = TW_NO_INDEX;
  return h->hips == TW_NO_INDEX || tw_way_find(tracks, job->target.nodes, h->hips, arena, &h->hips_way);
}

static tw_status hold(const tw_retarget_job *job, const tw_bone_match *match, double size, holding *h,
                      tw_arena *arena, tw_arena *scratch, tw_clip_keys *keys, tw_error *error) {
  const tw_node_tracks *tracks = tw_way_list_tracks(h->clip, scratch);
  bool has_room = tracks && find_hips(job, match, tracks, scratch, h);
  tw_status status = TW_OK;
  for (uint32_t l = 0; l < h->leg_count && has_room && status == TW_OK; l++) {
    has_room = find_ways(job, tracks, scratch, &h->legs[l]);
    if (!has_room) break;
    find_hinge(h->clip, &h->legs[l]);
    status = place_touches(h->clip, &h->legs[l], error);
  }
  if (status == TW_OK && has_room && h->hips != TW_NO_INDEX) status = find_lowering(h, scratch, error);
  if (status != TW_OK) return status;
  tw_clip *clip = has_room ? make_clip(h, scratch) : NULL;
  uint64_t steps = TW_REDUCTION_STEPS;
  const tw_tolerance tolerance = {job->tolerance.angle, job->tolerance.distance * size};
  tw_clip_keys held;
  tw_tolerance reached;
  if (!clip) return tw_fail(error, TW_NO_MEMORY, "no memory to hold feet");
  status = tw_clip_reduce(clip, NULL, tolerance, job->max_keys, &steps, arena, &held, &reached, error);
  if (status != TW_OK) return status;
  return replace_tracks(&held, arena, keys) ? TW_OK : tw_fail(error, TW_NO_MEMORY, "no memory to hold feet");
}

/* Finds the legs, and when the source's feet touch the ground. held: the feet that do. */
static tw_status find_contacts(const tw_retarget_job *job, const tw_bone_match *match, const double up[3],
                               tw_arena *scratch, holding *h, uint32_t *held, tw_error *error) {
  const tw_skeleton *source = &job->source;
  uint32_t feet[SIDES];
  for (uint32_t side = 0; side < SIDES; side++) {
    leg *leg = &h->legs[h->leg_count];
    if (!find_leg(job, match, side, leg)) continue;
    feet[h->leg_count++] = match->source_of[leg->nodes[FOOT]];
  }
  *held = 0;
  if (h->leg_count == 0) return TW_OK;
  tw_clip_report report;
  const tw_inspect_job inspection = {.keys = job->keys,
                                     .nodes = source->nodes,
                                     .order = source->order,
                                     .node_count = source->node_count,
                                     .foot_count = h->leg_count,
                                     .feet = feet,
                                     .up = up};
  tw_status status = tw_clip_inspect(&inspection, scratch, &report, error);
  for (uint32_t l = 0; l < h->leg_count && status == TW_OK; l++) {
    leg *leg = &h->legs[l];
    if (!take_touches(&report, feet[l], scratch, leg)) status = tw_fail(error, TW_NO_MEMORY, "out of memory");
    *held += leg->touch_count > 0;
  }
  return status;
}

tw_status tw_feet_hold(const tw_retarget_job *job, const tw_bone_match *match, const double up[3],
                       double size, tw_arena *arena, tw_clip_keys *keys, uint32_t *held, tw_error *error) {
  tw_arena *scratch = tw_arena_create();
  if (!scratch) return tw_fail(error, TW_NO_MEMORY, "no memory to hold feet");
  holding h = {0};
  tw_clip *clip = NULL;
  tw_status status = find_contacts(job, match, up, scratch, &h, held, error);
  if (status == TW_OK && *held > 0) status = tw_clip_create(keys, job->target.node_count, -1, &clip, error);
  h.clip = clip;
  if (status == TW_OK && clip) status = hold(job, match, size, &h, arena, scratch, keys, error);
  tw_clip_destroy(clip);
  tw_arena_destroy(scratch);
  return status;
}
