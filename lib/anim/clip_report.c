/* Judges a clip as a whole. Rotations are compared as rotation vectors: the direction is the axis, the length
 * the angle. */
#include "tweend/clip_report.h"
#include "angle.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "clip.h"
#include "order.h"
#include "retarget_match.h"
#include "tweend/root_motion.h"
#include "vector3.h"
#include "way.h"

static const double FRAMES_A_SECOND = 60;
static const double FRAMES_OF_NODES = 1 << 22; /* frames times nodes */
static const double STILL_ANGLE = 1e-5, STILL_SHARE = 1e-6;
static const double TOUCH_HEIGHT = 0.03, TOUCH_SPEED = 0.25; /* of the figure's height; of that a second */
static const double SIDE_SECONDS = 0.25, SIDE_RISE = 0.01;   /* beside a stand; of the figure's height */
static const double POP_ANGLE = 5 / TW_DEGREES, POP_SECONDS = 0.1, POP_MEDIANS = 8;

enum { TOUCH_FRAMES = 3, FIT_KEYS = 7, NOISE_STEPS = 200, LEAP_STEPS = 100 };

typedef struct inspection {
  const tw_inspect_job *job;
  const tw_clip_keys *keys;
  const tw_clip *clip;
  const tw_node *nodes;
  const uint32_t *order, *feet;
  uint32_t node_count, foot_count, frame_count;
  double start, duration;
  const double *up;  /* [3] */
  tw_trs *locals;    /* [node_count] of one frame */
  float *world;      /* [node_count][16] of one frame */
  bool *moves;       /* [node_count] */
  float *places;     /* [frame_count][foot_count][3] in the world */
  float *root_poses; /* [frame_count][16] */
  tw_arena *arena, *scratch;
  tw_clip_report *report;
} inspection;

static double time_of(const inspection *in, uint32_t frame) {
  return in->start + in->duration * frame / (in->frame_count - 1);
}

/* The rotation vector that leads from a to b the short way. */
static void turn_between(const double a[4], const double b[4], double out[3]) {
  double back[4] = {-a[0], -a[1], -a[2], a[3]}, turn[4];
  quat_multiply(back, b, turn);
  if (turn[3] < 0)
    for (int i = 0; i < 4; i++) turn[i] = -turn[i];
  tw_quat_log(turn, out);
  for (int i = 0; i < 3; i++) out[i] *= 2;
}

static double length_of(const double v[3]) {
  return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static double distance_between(const float a[3], const float b[3]) {
  double d[3];
  for (int i = 0; i < 3; i++) d[i] = (double)b[i] - (double)a[i];
  return length_of(d);
}

/* ---- which nodes move ------------------------------------------------------------------------ */

/* What samples of a track tell of whether it moves. */
typedef struct movement {
  tw_path path;
  uint32_t width;
  const float *first; /* [width] the first sample */
  double largest, apart;
} movement;

/* Whether the samples up to these differ from the first by more than rounding. */
static bool is_moving(movement *m, const float *samples, uint32_t count) {
  if (m->path == TW_ROTATION) {
    double first[4], other[4];
    quat_widen(m->first, first);
    for (uint32_t i = 0; i < count; i++) {
      quat_widen(samples + 4 * (size_t)i, other);
      if (tw_angle_between(first, other) > STILL_ANGLE) return true;
    }
    return false;
  }
  for (size_t i = 0; i < (size_t)count * m->width; i++) {
    m->largest = fmax(m->largest, fabs((double)samples[i]));
    m->apart = fmax(m->apart, fabs((double)samples[i] - (double)m->first[i % m->width]));
  }
  return m->apart > STILL_SHARE * m->largest;
}

/* The key times and two between each pair: a cubic between equal keys is still at one of them at most. NULL
 * without memory. */
static float *look_at_times(const tw_track_keys *track, tw_arena *arena, uint32_t *count) {
  *count = 3 * track->key_count - 2;
  float *times = tw_arena_alloc_raw(arena, *count, sizeof *times);
  for (uint32_t i = 0; times && i < *count; i++) {
    float from = track->times[i / 3], to = i % 3 ? track->times[i / 3 + 1] : from;
    times[i] = from + (to - from) * (float)(i % 3) / 3;
  }
  return times;
}

/* Samples a track piece by piece until it moves. */
static tw_status note_move(inspection *in, uint32_t t, tw_arena *scratch) {
  enum { PIECE = 64, STEPS = 20 };
  const tw_track_keys *track = &in->keys->tracks[t];
  if (track->path == TW_WEIGHTS || in->moves[track->node]) return TW_OK;
  uint32_t count, width = tw_clip_width(in->clip, t);
  float *times = look_at_times(track, scratch, &count);
  float *samples = tw_arena_alloc_raw(scratch, PIECE + 1, width * sizeof *samples);
  if (!times || !samples) return TW_NO_MEMORY;
  movement m = {.path = track->path, .width = width, .first = samples + PIECE * (size_t)width};
  tw_clip_sample(in->clip, t, times, 1, samples + PIECE * (size_t)width);
  for (uint32_t done = 0; done < count && !in->moves[track->node]; done += PIECE) {
    uint32_t piece = count - done < PIECE ? count - done : PIECE;
    tw_clip_sample(in->clip, t, times + done, piece, samples);
    in->moves[track->node] = is_moving(&m, samples, piece);
    if (!tw_work(STEPS * (uint64_t)piece)) return TW_CANCELLED;
  }
  return TW_OK;
}

/* Calls a function for each track, with memory that it has for itself. */
static tw_status for_tracks(inspection *in,
                            tw_status (*judge)(inspection *in, uint32_t track, tw_arena *scratch)) {
  tw_status status = TW_OK;
  for (uint32_t t = 0; t < in->keys->track_count && status == TW_OK; t++) {
    tw_arena *scratch = tw_arena_create();
    status = scratch ? judge(in, t, scratch) : TW_NO_MEMORY;
    tw_arena_destroy(scratch);
  }
  return status;
}

static tw_status note_moves(inspection *in) {
  tw_status status = for_tracks(in, note_move);
  if (status != TW_OK) return status;
  tw_clip_report *report = in->report;
  report->still = tw_arena_alloc_raw(in->arena, in->node_count, sizeof *report->still);
  for (uint32_t n = 0; report->still && n < in->node_count; n++)
    if (!in->moves[n]) report->still[report->still_count++] = n;
  return report->still ? TW_OK : TW_NO_MEMORY;
}

/* ---- the world ------------------------------------------------------------------------------- */

static void find_world(inspection *in, const tw_clip *clip) {
  tw_pose_locals(clip, in->nodes, in->node_count, in->locals, in->world);
  tw_pose_world(in->nodes, in->order, in->node_count, in->world, in->world);
}

/* Poses the world at the clip's start. */
static void find_first_world(inspection *in) {
  tw_clip_pose(in->clip, in->nodes, in->node_count, (float)in->start, in->locals);
  find_world(in, in->clip);
}

/* Takes a way of a node, which is relative to its parent, into the world. */
static void take_into_world(const inspection *in, uint32_t node, double way[3]) {
  uint32_t parent = in->nodes[node].parent;
  if (parent == TW_NO_INDEX) return;
  const float *m = in->world + 16 * (size_t)parent;
  const double own[3] = {way[0], way[1], way[2]};
  for (int i = 0; i < 3; i++)
    way[i] = (double)m[i] * own[0] + (double)m[4 + i] * own[1] + (double)m[8 + i] * own[2];
}

/* ---- the seam -------------------------------------------------------------------------------- */

/* Angular velocities of all nodes over a frame from `time` on. */
static void find_speeds(const inspection *in, double time, double step, double (*out)[3], tw_trs *scratch) {
  tw_clip_pose(in->clip, in->nodes, in->node_count, (float)time, in->locals);
  tw_clip_pose(in->clip, in->nodes, in->node_count, (float)(time + step), scratch);
  for (uint32_t n = 0; n < in->node_count; n++) {
    double a[4], b[4];
    quat_widen(in->locals[n].rotation, a);
    quat_widen(scratch[n].rotation, b);
    turn_between(a, b, out[n]);
    for (int i = 0; i < 3; i++) out[n][i] /= step;
  }
}

static tw_status inspect_seam(inspection *in) {
  tw_clip_seam *seam = &in->report->loop;
  seam->node = TW_NO_INDEX;
  tw_trs *last = tw_arena_alloc_raw(in->scratch, in->node_count, sizeof *last);
  double(*before)[3] = tw_arena_alloc_raw(in->scratch, in->node_count, sizeof *before);
  double(*after)[3] = tw_arena_alloc_raw(in->scratch, in->node_count, sizeof *after);
  if (!last || !before || !after) return TW_NO_MEMORY;
  double end = in->start + in->duration, step = fmin(1 / FRAMES_A_SECOND, in->duration);
  if (step > 0) {
    find_speeds(in, in->start, step, after, last);
    find_speeds(in, end - step, step, before, last);
  }
  find_first_world(in);
  tw_clip_pose(in->clip, in->nodes, in->node_count, (float)end, last);
  uint32_t farthest = TW_NO_INDEX;
  for (uint32_t n = 0; n < in->node_count; n++) {
    double a[4], b[4], turn[3], way[3];
    quat_widen(in->locals[n].rotation, a);
    quat_widen(last[n].rotation, b);
    turn_between(a, b, turn);
    for (int i = 0; i < 3; i++)
      way[i] = (double)last[n].translation[i] - (double)in->locals[n].translation[i];
    take_into_world(in, n, way);
    double angle = length_of(turn), distance = length_of(way);
    if (angle > seam->angle) seam->node = n, seam->angle = angle;
    if (distance > seam->distance) farthest = n, seam->distance = distance;
    if (step > 0) {
      for (int i = 0; i < 3; i++) turn[i] = after[n][i] - before[n][i];
      seam->speed = fmax(seam->speed, length_of(turn));
    }
  }
  if (seam->angle < STILL_ANGLE) seam->node = farthest;
  return tw_work(20 * (uint64_t)in->node_count) ? TW_OK : TW_CANCELLED;
}

/* ---- frames: the root and the feet ----------------------------------------------------------- */

static uint32_t find_root(const inspection *in) {
  for (uint32_t i = 0; i < in->node_count; i++)
    if (in->moves[in->order[i]]) return in->order[i];
  return TW_NO_INDEX;
}

static bool has_word(const char *name, const char *word) {
  size_t length = strlen(word);
  for (; name && *name; name++) {
    size_t i = 0;
    while (i < length && tolower((unsigned char)name[i]) == word[i]) i++;
    if (i == length) return true;
  }
  return false;
}

/* Whether a node's name tells a foot of an animal with more than two. */
static bool is_of_four(const char *name) {
  static const char *const places[] = {"front", "fore", "hind", "rear"};
  bool found = false;
  for (int i = 0; i < 4; i++) found |= has_word(name, places[i]) && has_word(name, "foot");
  return found;
}

/* Finds the feet by usual names of figures, else by words in their names. */
static tw_status find_feet(inspection *in) {
  static const char *const words[] = {"foot", "ankle"};
  bool has_four = false;
  const tw_skeleton skeleton = {.nodes = in->nodes, .order = in->order, .node_count = in->node_count};
  uint32_t *feet = tw_arena_alloc_raw(in->arena, in->node_count, sizeof *feet), bones[TW_BONES];
  bool *is_bone = tw_arena_alloc_raw(in->scratch, in->node_count, sizeof *is_bone);
  tw_spine spine;
  if (!feet || !is_bone) return TW_NO_MEMORY;
  memset(is_bone, true, in->node_count * sizeof *is_bone);
  if (!tw_bones_guess(&skeleton, is_bone, in->scratch, bones, &spine)) return TW_NO_MEMORY;
  for (uint32_t n = 0; n < in->node_count; n++) has_four |= is_of_four(in->nodes[n].name);
  for (int side = 0; side < 2 && !has_four; side++)
    if (bones[TW_BONE_FOOT + side] != TW_NO_INDEX) feet[in->foot_count++] = bones[TW_BONE_FOOT + side];
  for (int w = 0; w < 2 && in->foot_count == 0; w++)
    for (uint32_t n = 0; n < in->node_count; n++)
      if (has_word(in->nodes[n].name, words[w])) feet[in->foot_count++] = n;
  in->feet = feet;
  return TW_OK;
}

static double along_up(const inspection *in, const float place[3]) {
  const double at[3] = {(double)place[0], (double)place[1], (double)place[2]};
  return tw_dot3(at, in->up);
}

/* How high the nodes reach at rest, from the lowest to the highest. */
static double find_height(inspection *in) {
  double lowest = INFINITY, highest = -INFINITY;
  for (uint32_t n = 0; n < in->node_count; n++) in->locals[n] = in->nodes[n].rest;
  find_world(in, NULL);
  for (uint32_t n = 0; n < in->node_count; n++) {
    double height = along_up(in, in->world + 16 * (size_t)n + 12);
    lowest = fmin(lowest, height);
    highest = fmax(highest, height);
  }
  return in->node_count ? highest - lowest : 0;
}

static bool is_below(const inspection *in, uint32_t node, uint32_t above) {
  while (node != TW_NO_INDEX && node != above) node = in->nodes[node].parent;
  return node == above;
}

/* Puts the root's motion back on the feet that go with it. places: [foot_count][3] of a frame. */
static void put_back(const inspection *in, uint32_t frame, float *places) {
  tw_trs root;
  if (!in->job->without_root) return;
  tw_clip_root_at(in->job->without_root, (float)time_of(in, frame), &root);
  const tw_affine motion = tw_affine_of(&root);
  for (uint32_t i = 0; i < in->foot_count; i++) {
    double place[3];
    if (!is_below(in, in->feet[i], in->job->root)) continue;
    for (int c = 0; c < 3; c++) place[c] = (double)places[3 * (size_t)i + (size_t)c];
    tw_affine_move(&motion, place, place);
    for (int c = 0; c < 3; c++) places[3 * (size_t)i + (size_t)c] = (float)place[c];
  }
}

/* Keeps where the root and the feet are at each frame. */
static tw_status follow(inspection *in, uint32_t root) {
  for (uint32_t f = 0; f < in->frame_count; f++) {
    tw_clip_pose(in->clip, in->nodes, in->node_count, (float)time_of(in, f), in->locals);
    find_world(in, in->clip);
    memcpy(in->root_poses + 16 * (size_t)f, in->world + 16 * (size_t)root, 16 * sizeof *in->world);
    for (uint32_t i = 0; i < in->foot_count; i++)
      memcpy(in->places + 3 * ((size_t)f * in->foot_count + i), in->world + 16 * (size_t)in->feet[i] + 12,
             3 * sizeof *in->places);
    put_back(in, f, in->places + 3 * (size_t)f * in->foot_count);
    if (!tw_work(50 * (uint64_t)in->node_count)) return TW_CANCELLED;
  }
  return TW_OK;
}

/* The angle in radians about the up axis from a node's first pose, of which `back` is the inverse rotation,
 * to another pose, whichever way the first one faces. */
static double yaw_between(const inspection *in, const double back[4], const float matrix[16]) {
  tw_trs to;
  double q[4], turn[4];
  tw_trs_from_matrix(matrix, &to);
  quat_widen(to.rotation, q);
  quat_multiply(q, back, turn);
  return 2 * atan2(tw_dot3(turn, in->up), turn[3]);
}

static tw_status judge_travel(const inspection *in, uint32_t root) {
  enum { STEPS_A_FRAME = 400 };
  tw_clip_travel *travel = &in->report->root;
  const float *poses = in->root_poses;
  double path = 0, yaw = 0, back[4];
  tw_trs first;
  tw_trs_from_matrix(poses, &first);
  quat_widen(first.rotation, back);
  for (int i = 0; i < 3; i++) back[i] = -back[i];
  for (uint32_t f = 1; f < in->frame_count; f++) {
    const float *pose = poses + 16 * (size_t)f;
    path += distance_between(pose - 16 + 12, pose + 12);
    double next = yaw_between(in, back, pose);
    travel->turn += remainder(next - yaw, 2 * TW_PI);
    yaw = next;
    if (!tw_work(STEPS_A_FRAME)) return TW_CANCELLED;
  }
  travel->node = root;
  travel->distance = distance_between(poses + 12, poses + 16 * (size_t)(in->frame_count - 1) + 12);
  travel->speed = in->duration > 0 ? path / in->duration : 0;
  return TW_OK;
}

/* ---- contacts -------------------------------------------------------------------------------- */

static const float *place_of(const inspection *in, uint32_t foot, uint32_t frame) {
  return in->places + 3 * ((size_t)frame * in->foot_count + foot);
}

static double height_of(const inspection *in, uint32_t foot, uint32_t frame) {
  return along_up(in, place_of(in, foot, frame));
}

static bool is_slow(const inspection *in, uint32_t foot, uint32_t frame) {
  uint32_t before = frame > 0 ? frame - 1 : 0, after = frame + 1 < in->frame_count ? frame + 1 : frame;
  double seconds = time_of(in, after) - time_of(in, before);
  double moved = distance_between(place_of(in, foot, before), place_of(in, foot, after));
  return moved < TOUCH_SPEED * in->report->height * seconds;
}

/* The least height in the frames from `from` up to `end`. */
static double lowest_of(const inspection *in, uint32_t foot, uint32_t from, uint32_t end) {
  double lowest = INFINITY;
  for (uint32_t f = from; f < end; f++) {
    double height = height_of(in, foot, f);
    lowest = height < lowest ? height : lowest; /* fmin in this loop ends gcc 12 for arm64 */
  }
  return lowest;
}

/* How far a foot is above a height in some frames, in the mean. */
static double rise_of(const inspection *in, uint32_t foot, uint32_t from, uint32_t end, double height) {
  double sum = 0;
  for (uint32_t f = from; f < end; f++) sum += height_of(in, foot, f) - height;
  return from < end ? sum / (end - from) : 0;
}

/* How far a foot is above the straight way from one frame to another, in the mean. */
static double lift_of(const inspection *in, uint32_t foot, uint32_t from, uint32_t to) {
  double low = height_of(in, foot, from), high = height_of(in, foot, to), sum = 0;
  for (uint32_t f = from; f < to; f++)
    sum += height_of(in, foot, f) - low - (high - low) * (f - from) / (to - from);
  return from < to ? sum / (to - from) : 0;
}

/* Whether a foot that is slow from the clip's first frame on lifts on its way to where it is slow next; or
 * one that is slow up to the last frame, on its way there. A foot that is held up goes down straight. */
static bool steps_away(const inspection *in, uint32_t foot, uint32_t from, uint32_t end) {
  double lift = 0;
  if (from == 0) {
    uint32_t next = end;
    while (next < in->frame_count && !is_slow(in, foot, next)) next++;
    if (next < in->frame_count) lift = lift_of(in, foot, end - 1, next);
  } else {
    uint32_t last = from - 1;
    while (last > 0 && !is_slow(in, foot, last)) last--;
    if (is_slow(in, foot, last)) lift = lift_of(in, foot, last, from);
  }
  return lift > SIDE_RISE * in->report->height;
}

/* Whether the foot comes down to where it is slow and goes up from there, as on a step or a slope. What it
 * climbs or descends meanwhile is below one side and above the other, and cancels out; a foot that is held up
 * is above both. */
static bool stands_higher(const inspection *in, uint32_t foot, uint32_t from, uint32_t end, double level) {
  if (from == 0 || end == in->frame_count) return steps_away(in, foot, from, end);
  double step = in->duration / (in->frame_count - 1);
  uint32_t side = (uint32_t)fmin(ceil(SIDE_SECONDS / step), in->frame_count);
  double rise = rise_of(in, foot, from > side ? from - side : 0, from, level) +
                rise_of(in, foot, end, end + side < in->frame_count ? end + side : in->frame_count, level);
  return rise > SIDE_RISE * in->report->height;
}

static double slide_of(const inspection *in, uint32_t foot, uint32_t from, uint32_t end) {
  const float *first = place_of(in, foot, from);
  double slide = 0;
  for (uint32_t f = from; f < end; f++) {
    double way[3];
    tw_side3(first, place_of(in, foot, f), way);
    double rise = tw_dot3(way, in->up);
    for (int i = 0; i < 3; i++) way[i] -= rise * in->up[i];
    slide = fmax(slide, hypot(hypot(way[0], way[1]), way[2]));
  }
  return slide;
}

/* Adds the contacts in frames in which a foot is slow. lowest: of all frames. */
static void add_contacts(inspection *in, uint32_t foot, uint32_t from, uint32_t end, double lowest) {
  tw_clip_report *report = in->report;
  double room = TOUCH_HEIGHT * report->height, ground = lowest_of(in, foot, from, end);
  if (end - from < TOUCH_FRAMES) return;
  if (ground - lowest < room)
    ground = lowest;
  else if (!stands_higher(in, foot, from, end, ground))
    return;
  for (uint32_t f = from; f < end; f++) {
    uint32_t first = f;
    while (f < end && height_of(in, foot, f) - ground < room) f++;
    if (f - first >= TOUCH_FRAMES)
      report->contacts[report->contact_count++] =
          (tw_contact){in->feet[foot], time_of(in, first), time_of(in, f - 1), slide_of(in, foot, first, f)};
  }
}

static void find_contacts_of(inspection *in, uint32_t foot) {
  double lowest = lowest_of(in, foot, 0, in->frame_count);
  for (uint32_t f = 0; f < in->frame_count; f++) {
    uint32_t from = f;
    while (f < in->frame_count && is_slow(in, foot, f)) f++;
    if (f > from) add_contacts(in, foot, from, f, lowest);
  }
}

static tw_status find_contacts(inspection *in) {
  size_t most = (size_t)in->foot_count * (in->frame_count / TOUCH_FRAMES);
  in->report->contacts = tw_arena_alloc_raw(in->arena, most, sizeof *in->report->contacts);
  if (!in->report->contacts) return TW_NO_MEMORY;
  for (uint32_t i = 0; in->report->height > 0 && i < in->foot_count; i++) {
    find_contacts_of(in, i);
    if (!tw_work(40 * (uint64_t)in->frame_count)) return TW_CANCELLED;
  }
  return TW_OK;
}

static tw_status inspect_frames(inspection *in) {
  tw_status status = in->feet ? TW_OK : find_feet(in);
  if (status != TW_OK) return status;
  in->report->feet = in->feet;
  in->report->foot_count = in->foot_count;
  in->report->height = find_height(in);
  uint32_t root = find_root(in);
  in->report->root.node = root;
  if (root == TW_NO_INDEX) return TW_OK;
  in->root_poses = tw_arena_alloc_raw(in->scratch, in->frame_count, 16 * sizeof *in->root_poses);
  in->places =
      tw_arena_alloc_raw(in->scratch, in->frame_count, 3 * (size_t)in->foot_count * sizeof *in->places);
  if (!in->root_poses || !in->places) return TW_NO_MEMORY;
  status = follow(in, root);
  if (status != TW_OK) return status;
  status = judge_travel(in, root);
  return status == TW_OK ? find_contacts(in) : status;
}

/* ---- tracks: noise and pops ------------------------------------------------------------------ */

/* A track's keys as samples. */
typedef struct samples {
  const tw_track_keys *track;
  uint32_t width;
  const float *values; /* [key_count][width] */
} samples;

/* Sets out to the value of a key relative to another one's: a rotation vector, or a difference. */
static void relate(const samples *s, uint32_t from, uint32_t to, double *out) {
  const float *a = s->values + (size_t)from * s->width, *b = s->values + (size_t)to * s->width;
  if (s->track->path != TW_ROTATION) {
    for (uint32_t c = 0; c < s->width; c++) out[c] = (double)b[c] - (double)a[c];
    return;
  }
  double first[4], second[4];
  quat_widen(a, first);
  quat_widen(b, second);
  turn_between(first, second, out);
}

/* The weights by which values at seven times sum to the least-squares parabola at the middle time. False
 * where the times are so uneven that they count as one or two, through which all parabolas lead. */
static bool fit_middle(const float *times, double weights[FIT_KEYS]) {
  static const double SINGULAR = 1e-14; /* of the pivots, the first of which is FIT_KEYS */
  double m[3][4] = {{0, 0, 0, 1}}, u[FIT_KEYS], middle = (double)times[FIT_KEYS / 2];
  double reach = fmax((double)times[FIT_KEYS - 1] - middle, middle - (double)times[0]);
  for (int k = 0; k < FIT_KEYS; k++) {
    u[k] = ((double)times[k] - middle) / reach;
    double powers[3] = {1, u[k], u[k] * u[k]};
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) m[i][j] += powers[i] * powers[j];
  }
  for (int i = 0; i < 3; i++) { /* Gauss: the matrix is positive definite, but for rounding */
    if (!(m[i][i] > SINGULAR)) return false;
    for (int row = 0; row < 3; row++) {
      if (row == i) continue;
      double factor = m[row][i] / m[i][i];
      for (int j = i; j < 4; j++) m[row][j] -= factor * m[i][j];
    }
  }
  for (int k = 0; k < FIT_KEYS; k++)
    weights[k] = m[0][3] / m[0][0] + m[1][3] / m[1][1] * u[k] + m[2][3] / m[2][2] * u[k] * u[k];
  return true;
}

/* The square of what the parabola leaves of the middle one of seven keys. off: [width] scratch, as sum. */
static double leave(const samples *s, uint32_t first, double *off, double *sum) {
  uint32_t numbers = s->track->path == TW_ROTATION ? 3 : s->width;
  double weights[FIT_KEYS], square = 0;
  if (!fit_middle(s->track->times + first, weights)) return 0;
  memset(sum, 0, numbers * sizeof *sum);
  for (uint32_t k = 0; k < FIT_KEYS; k++) {
    if (k == FIT_KEYS / 2) continue; /* 0 */
    relate(s, first + FIT_KEYS / 2, first + k, off);
    for (uint32_t c = 0; c < numbers; c++) sum[c] += weights[k] * off[c];
  }
  for (uint32_t c = 0; c < numbers; c++) square += sum[c] * sum[c];
  return square;
}

static tw_status find_noise(inspection *in, const samples *s, uint32_t track, tw_arena *arena) {
  uint32_t count = s->track->key_count;
  if (count < FIT_KEYS || s->track->interpolation == TW_STEP) return TW_OK;
  double *scratch = tw_arena_alloc_raw(arena, 2 * (size_t)s->width, sizeof *scratch), square = 0;
  if (!scratch) return TW_NO_MEMORY;
  for (uint32_t first = 0; first + FIT_KEYS <= count; first++) {
    square += leave(s, first, scratch, scratch + s->width);
    if (!tw_work(NOISE_STEPS + FIT_KEYS * (uint64_t)s->width)) return TW_CANCELLED;
  }
  in->report->noise[in->report->noise_count++] =
      (tw_track_noise){track, sqrt(square / (count - FIT_KEYS + 1))};
  return TW_OK;
}

/* How far a key is from the slerp of its neighbours. */
static double leap_of(const samples *s, uint32_t key) {
  const float *times = s->track->times;
  double before[4], at[4], after[4], lead[4];
  quat_widen(s->values + 4 * (size_t)(key - 1), before);
  quat_widen(s->values + 4 * (size_t)key, at);
  quat_widen(s->values + 4 * (size_t)(key + 1), after);
  tw_arc arc = tw_arc_short(before, after);
  double whole = (double)times[key + 1] - (double)times[key - 1];
  tw_arc_at(&arc, ((double)times[key] - (double)times[key - 1]) / whole, lead);
  return tw_angle_between(lead, at);
}

/* Of keys that leap beside each other, because one of them is off, the farthest counts. */
static bool is_pop(const samples *s, const double *leaps, uint32_t key, double median) {
  const float *times = s->track->times;
  uint32_t count = s->track->key_count;
  bool is_short = (double)times[key + 1] - (double)times[key - 1] <= POP_SECONDS;
  bool is_peak =
      (key < 2 || leaps[key] >= leaps[key - 1]) && (key + 2 >= count || leaps[key] > leaps[key + 1]);
  return is_short && is_peak && leaps[key] > POP_ANGLE && leaps[key] > POP_MEDIANS * median;
}

static tw_status find_pops(inspection *in, const samples *s, tw_arena *scratch) {
  uint32_t count = s->track->key_count;
  if (count < 5 || s->track->path != TW_ROTATION || s->track->interpolation == TW_STEP) return TW_OK;
  double *leaps = tw_arena_alloc_raw(scratch, count, sizeof *leaps);
  double *sorted = tw_arena_alloc_raw(scratch, count, sizeof *sorted);
  if (!leaps || !sorted) return TW_NO_MEMORY;
  for (uint32_t key = 1; key + 1 < count; key++) {
    leaps[key] = leap_of(s, key);
    if (!tw_work(LEAP_STEPS)) return TW_CANCELLED;
  }
  memcpy(sorted, leaps + 1, (count - 2) * sizeof *sorted);
  tw_status status = tw_sort(sorted, count - 2, sizeof *sorted, tw_order_doubles);
  if (status != TW_OK) return status;
  double median = sorted[(count - 2) / 2];
  tw_clip_report *report = in->report;
  for (uint32_t key = 1; key + 1 < count; key++)
    if (is_pop(s, leaps, key, median))
      report->pops[report->pop_count++] = (tw_pop){s->track->node, (double)s->track->times[key], leaps[key]};
  return TW_OK;
}

/* Takes translations into the world, in which lengths are told. */
static void take_values_into_world(const inspection *in, uint32_t node, uint32_t count, float *values) {
  for (uint32_t i = 0; i < count; i++, values += 3) {
    double way[3] = {(double)values[0], (double)values[1], (double)values[2]};
    take_into_world(in, node, way);
    for (int c = 0; c < 3; c++) values[c] = (float)way[c];
  }
}

static tw_status inspect_track(inspection *in, uint32_t t, tw_arena *scratch) {
  const tw_track_keys *track = &in->keys->tracks[t];
  samples s = {track, tw_clip_width(in->clip, t), NULL};
  float *values = tw_arena_alloc_raw(scratch, track->key_count, s.width * sizeof *values);
  if (!values) return TW_NO_MEMORY;
  tw_clip_sample(in->clip, t, track->times, track->key_count, values);
  if (track->path == TW_TRANSLATION) take_values_into_world(in, track->node, track->key_count, values);
  s.values = values;
  tw_status status = find_noise(in, &s, t, scratch);
  return status == TW_OK ? find_pops(in, &s, scratch) : status;
}

static tw_status inspect_tracks(inspection *in) {
  uint64_t keys = 0;
  for (uint32_t t = 0; t < in->keys->track_count; t++) keys += in->keys->tracks[t].key_count;
  find_first_world(in);
  in->report->noise = tw_arena_alloc_raw(in->arena, in->keys->track_count, sizeof *in->report->noise);
  in->report->pops = tw_arena_alloc_raw(in->arena, (size_t)keys / 2, sizeof *in->report->pops);
  return in->report->noise && in->report->pops ? for_tracks(in, inspect_track) : TW_NO_MEMORY;
}

/* ---- the whole ------------------------------------------------------------------------------- */

static void find_frames(inspection *in) {
  float first = INFINITY, last = tw_clip_duration(in->clip);
  for (uint32_t t = 0; t < in->keys->track_count; t++) first = fminf(first, in->keys->tracks[t].times[0]);
  in->start = in->keys->track_count ? (double)first : 0;
  in->duration = (double)last - in->start;
  double most = FRAMES_OF_NODES / (in->node_count + 1.0), frames = in->duration * FRAMES_A_SECOND + 1;
  in->frame_count = (uint32_t)fmax(2, ceil(fmin(frames, most)));
}

static tw_status inspect(inspection *in) {
  in->locals = tw_arena_alloc_raw(in->scratch, in->node_count, sizeof *in->locals);
  in->world = tw_arena_alloc_raw(in->scratch, in->node_count, 16 * sizeof *in->world);
  in->moves = tw_arena_alloc(in->scratch, in->node_count, sizeof *in->moves);
  if (!in->locals || !in->world || !in->moves) return TW_NO_MEMORY;
  find_frames(in);
  tw_status status = note_moves(in);
  if (status == TW_OK) status = inspect_seam(in);
  if (status == TW_OK) status = inspect_frames(in);
  return status == TW_OK ? inspect_tracks(in) : status;
}

tw_status tw_clip_inspect(const tw_inspect_job *job, tw_arena *arena, tw_clip_report *out, tw_error *error) {
  *out = (tw_clip_report){0};
  tw_clip *clip;
  tw_status status = tw_clip_create(job->keys, job->node_count, -1, &clip, error);
  if (status != TW_OK) return status;
  static const double Y[3] = {0, 1, 0};
  inspection in = {.job = job,
                   .up = job->up ? job->up : Y,
                   .keys = job->keys,
                   .clip = clip,
                   .nodes = job->nodes,
                   .order = job->order,
                   .feet = job->feet,
                   .node_count = job->node_count,
                   .foot_count = job->feet ? job->foot_count : 0,
                   .arena = arena,
                   .scratch = tw_arena_create(),
                   .report = out};
  status = in.scratch ? inspect(&in) : TW_NO_MEMORY;
  tw_arena_destroy(in.scratch);
  tw_clip_destroy(clip);
  if (status == TW_NO_MEMORY) return tw_fail(error, status, "no memory for the report of a clip");
  return status == TW_CANCELLED ? tw_work_status(error) : status;
}
