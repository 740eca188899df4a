/* Rotations, keyframed tracks, poses. Quaternions are x y z w, angles radians, times seconds,
 * matrices column-major, everything right-handed, as in glTF 2.0. */
#ifndef TWEEND_ANIM_H
#define TWEEND_ANIM_H

#include "tweend/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Tait-Bryan orders: TW_XYZ means R = Rx Ry Rz (intrinsic). A triple always holds the angles about x, y and z
 * at its indices 0, 1 and 2, whatever the order. */
typedef enum tw_euler_order { TW_XYZ, TW_XZY, TW_YXZ, TW_YZX, TW_ZXY, TW_ZYX } tw_euler_order;
enum { TW_EULER_ORDERS = 6 };
extern const char *const tw_euler_order_names[TW_EULER_ORDERS + 1]; /* the last is NULL */

typedef enum tw_interpolation {
  TW_STEP,
  TW_LINEAR, /* rotations: slerp the short way */
  TW_CUBICSPLINE,
  TW_NLERP,
  TW_SQUAD,
  TW_EULER /* each Euler angle linearly, on its own */
} tw_interpolation;
extern const char *const tw_interpolation_names[]; /* as in tweend JSON */

typedef enum tw_path { TW_TRANSLATION, TW_ROTATION, TW_SCALE, TW_WEIGHTS } tw_path;
extern const char *const tw_path_names[]; /* as in glTF */

/* The form in which a rotation track's keys are written. */
typedef enum tw_key_form { TW_KEY_VALUES, TW_KEY_QUATERNION, TW_KEY_EULER, TW_KEY_AXIS_ANGLE } tw_key_form;

/* ---- rotation algebra ------------------------------------------------------------------------ */

#define TW_DEGREES 57.295779513082320877 /* in a radian */

void tw_quat_to_axis_angle(const float q[4], float out[4]); /* x y z angle, angle in [0, pi] */
/* Angles in (-pi, pi], the middle angle in [-pi/2, pi/2]; at gimbal lock (within half a microradian) the
 * angle about the order's last axis is 0. */
void tw_quat_to_euler(const float q[4], tw_euler_order order, float out[3]);
/* The triple nearest to `previous` of all that stand for q: its twin (outer angles plus pi, middle angle pi
 * minus itself) and whole turns count, and at gimbal lock every split of the outer angles. */
void tw_quat_to_euler_near(const float q[4], tw_euler_order order, const float previous[3], float out[3]);

/* ---- rotations in any form, in double precision ---------------------------------------------- */

/* The forms of a rotation: quaternion x y z w; axis x y z and angle; the angles about x, y, z; a 3 x 3
 * matrix. */
typedef enum tw_rotation_form {
  TW_AS_QUATERNION,
  TW_AS_AXIS_ANGLE,
  TW_AS_EULER,
  TW_AS_MATRIX,
  TW_ROTATION_FORMS
} tw_rotation_form;
extern const uint32_t tw_rotation_widths[TW_ROTATION_FORMS]; /* how many numbers each form has: 4, 4, 3, 9 */

/* Reads a rotation as a unit quaternion. values: finite, as many as the form has; order: for TW_AS_EULER.
 * TW_INVALID: a zero quaternion or axis, an angle beyond 1e9, a matrix whose columns are off unit length or
 * right angles by more than 1e-3, or that mirrors. A matrix within that tolerance becomes the rotation that
 * fits it best, so that three decimals are enough. */
tw_status tw_rotation_read(tw_rotation_form form, tw_euler_order order, const double *values, double q[4],
                           tw_error *error);
/* Writes a unit quaternion in a form. Axis and angle and Euler angles are as tw_quat_to_axis_angle and
 * tw_quat_to_euler give them. */
void tw_rotation_write(const double q[4], tw_rotation_form form, tw_euler_order order, double *out);

/* On unit quaternions: the product a b, normalised again; slerp the short way, also with u outside 0 to 1;
 * and the vector v rotated by q. out may be a, b or v. */
void tw_rotation_multiply(const double a[4], const double b[4], double out[4]);
void tw_rotation_slerp(const double a[4], const double b[4], double u, double out[4]);
void tw_rotation_turn(const double q[4], const double v[3], double out[3]);

/* |cos| of the order's middle angle: 1 is farthest from gimbal lock, 0 is lock. */
double tw_rotation_cos_middle(const double q[4], tw_euler_order order);

/* ---- transforms ------------------------------------------------------------------------------ */

/* Ten floats without padding, so that an array of tw_trs is also an array of floats. */
typedef struct tw_trs {
  float rotation[4];
  float translation[3];
  float scale[3];
} tw_trs;

#define TW_TRS_IDENTITY ((tw_trs){{0, 0, 0, 1}, {0, 0, 0}, {1, 1, 1}})

void tw_trs_to_matrix(const tw_trs *trs, float out[16]);
/* Decomposes a finite affine matrix. False when it has shear, a zero axis or a last row other than 0 0 0 1;
 * out is then the best fit. A mirrored matrix gets a negative x scale. */
bool tw_trs_from_matrix(const float m[16], tw_trs *out);
void tw_matrix_multiply(const float a[16], const float b[16], float out[16]); /* out may be a or b */
void tw_matrix_move(const float m[16], float point[3]); /* point = m * point, m affine */

/* ---- hierarchy ------------------------------------------------------------------------------- */

#define TW_NO_INDEX UINT32_MAX

/* One node of a model; a view. */
typedef struct tw_node {
  const char *name;    /* UTF-8, or NULL */
  uint32_t parent;     /* TW_NO_INDEX for a root; need not come before the child */
  uint32_t mesh, skin; /* TW_NO_INDEX when there is none */
  bool has_matrix;     /* the local transform is `matrix`, which may shear; rest is the nearest TRS */
  bool is_hidden;      /* outside the displayed scene, or invisible: part of the hierarchy, but not drawn */
  tw_trs rest;
  float matrix[16];
  const double *place;   /* [3] the exact translation, which `rest` and `matrix` round to floats; NULL where
                            that   moves nothing that can be seen */
  const float *weights;  /* of the mesh's morph targets; NULL: the mesh's own weights */
  const char *preserved; /* as tw_mesh.preserved */
} tw_node;

/* What the exact translation has along an axis beyond that in `rest`. */
static inline double tw_node_fine(const tw_node *node, int axis) {
  return node->place ? node->place[axis] - (double)node->rest.translation[axis] : 0;
}

typedef struct tw_skin {
  const char *name;
  uint32_t joint_count;
  const uint32_t *joints;    /* [joint_count] nodes */
  const float *inverse_bind; /* [joint_count][16] */
  uint32_t skeleton;         /* node or TW_NO_INDEX */
  const char *preserved;     /* as tw_mesh.preserved */
} tw_skin;

/* Fills order[node_count] with the nodes, breadth first: the roots ascending, then the children of each node
 * in `order`, ascending. TW_INVALID with pointer "/nodes/{i}/parent" on a parent out of range or a cycle;
 * TW_NO_MEMORY. O(nodes), no recursion. */
tw_status tw_nodes_order(const tw_node *nodes, uint32_t node_count, uint32_t *order, tw_error *error);

/* ---- clips ----------------------------------------------------------------------------------- */

/* One track as its source wrote it; a view. */
typedef struct tw_track_keys {
  uint32_t node;
  tw_path path;
  tw_interpolation interpolation;
  tw_key_form form;     /* TW_KEY_VALUES for all but rotations */
  tw_euler_order order; /* of TW_KEY_EULER */
  uint32_t width; /* numbers in a value: 3 (Euler angles too), 4 (quaternion, axis-angle x y z angle), morph
                     count */
  uint32_t key_count;
  uint32_t duplicate_times; /* keys that the source had at the time of the key before: see tw_model_finish */
  const float *times;       /* [key_count], strictly increasing */
  const float *values;      /* [key_count][width]; cubicspline: [key_count][3][width] in-tangent, value,
                               out-tangent. NULL for TW_KEY_EULER and TW_KEY_AXIS_ANGLE */
  const double *angles;     /* TW_KEY_EULER [key_count][3], TW_KEY_AXIS_ANGLE [key_count][4]; else NULL */
  /* {"channel": {}, "target": {}, "sampler": {}} or some of these, each as tw_mesh.preserved; or NULL */
  const char *preserved;
} tw_track_keys;

typedef struct tw_clip_keys {
  const char *name; /* UTF-8, or NULL */
  uint32_t track_count;
  const tw_track_keys *tracks;
  uint32_t layer_count;               /* of a mixed clip, which has no tracks; else 0 */
  const struct tw_clip_layer *layers; /* [layer_count], see tweend/mix.h */
  float mixed_duration;  /* seconds of a mixed clip; negative where clips of other models tell it */
  const char *preserved; /* as tw_mesh.preserved */
  /* A JSON array of {"channel": {}, "sampler": {}} that animate something other than nodes; or NULL. Their
   * accessors are indices into the model's assets. */
  const char *loose;
} tw_clip_keys;

/* Merges clips into one: the tracks of all, one clip after the other. Where two tracks move the same path of
 * one node, the later clip's stays. out: its name is NULL, for the caller to set; its tracks are an array in
 * the arena, whose keys stay the clips' own. node_count: greater than every track's node. TW_NO_MEMORY.
 * O(tracks + nodes). */
tw_status tw_clip_merge(const tw_clip_keys *clips, uint32_t clip_count, uint32_t node_count, tw_arena *arena,
                        tw_clip_keys *out, tw_error *error);

/* A clip compiled for sampling: immutable, any number of threads may share it. */
typedef struct tw_clip tw_clip;

/* Checks and compiles a clip. Refuses (TW_INVALID, pointer relative to the clip: "/tracks/2/times/5"): no
 * keys; times not finite, negative or not strictly increasing; values not finite; zero quaternions or axes;
 * angles beyond 1e9; a node out of range; a width that does not fit the path; two tracks on one node and
 * path; an interpolation that the path or key form does not have (TW_EULER is for TW_KEY_EULER,
 * TW_CUBICSPLINE for values and quaternions, TW_NLERP and TW_SQUAD for rotations).
 *
 * Rotation keys are normalised (a key within 1e-6 of unit length is kept bit for bit), and each is negated
 * where its dot product with the key before is negative. So a sample at a key's time is the key, up to sign.
 * Cubic splines interpolate keys and tangents as they stand, and normalise the result (glTF 2.0, appendix C):
 * signs and lengths of their quaternions are part of the motion. TW_LINEAR between axis-angle keys turns by
 * the whole angle they give. About one axis the angle is interpolated linearly through all turns. Between two
 * axes the axis follows the great arc to the other axis or its opposite, whichever is nearer, while the angle
 * changes linearly; a key of angle 0 takes its neighbour's axis. TW_SQUAD passes each key at the mean angular
 * velocity of the segments on both sides, which for equally spaced keys gives Shoemake's control points.
 *
 * force: -1 keeps each track's interpolation, else a tw_interpolation for every rotation track
 * (TW_CUBICSPLINE only where all of them have tangents, else TW_INVALID). Forcing converts Euler and
 * axis-angle keys to quaternions first, so turns of more than 180 degrees are lost. TW_EULER is the
 * exception: it leaves Euler keys as they are, and turns all others into XYZ triples, each the one nearest to
 * the triple before it.
 * The keys may be freed after the call. TW_NO_MEMORY. O(keys) but for sorting the tracks. */
tw_status tw_clip_create(const tw_clip_keys *keys, uint32_t node_count, int force, tw_clip **out,
                         tw_error *error);
void tw_clip_destroy(tw_clip *clip); /* NULL accepted */

float tw_clip_duration(const tw_clip *clip);      /* latest key time; 0 for a clip without tracks */
float tw_keys_duration(const tw_clip_keys *keys); /* the same for a clip that is not compiled; O(tracks) */
size_t tw_clip_size(const tw_clip *clip);         /* bytes of memory, for a cache's budget */

typedef enum tw_loop { TW_CLAMP, TW_REPEAT, TW_PINGPONG } tw_loop;

/* Maps a time onto the clip: TW_REPEAT into [0, duration), TW_PINGPONG forth and back. A duration of 0 gives
 * 0. TW_CLAMP returns t itself, as sampling clamps. t is a double because a float is a second or more off
 * after many rounds. duration: the decimal number that tw_print_float prints of the clip's, so that 2.4 is
 * the start of the third round of 1.2 seconds. */
float tw_loop_time(double t, double duration, tw_loop loop);

/* The local transforms of all nodes at one time: a node's rest transform where no track moves it. locals:
 * [node_count]. Any thread, allocates nothing. At key times the values are exactly the keys'. */
void tw_clip_pose(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, float time, tw_trs *locals);

/* Samples one track. track: index as in tw_clip_keys; of a mixed clip, by node, then by path. out:
 * [time_count][tw_clip_width]. Weights can be sampled only here. Any thread, allocates nothing. */
void tw_clip_sample(const tw_clip *clip, uint32_t track, const float *times, size_t time_count, float *out);
uint32_t tw_clip_width(const tw_clip *clip, uint32_t track); /* numbers in a sample; 4 for rotations */
uint32_t tw_clip_track_count(const tw_clip *clip);
/* The node that a track moves; *path receives which part of it. */
uint32_t tw_clip_target(const tw_clip *clip, uint32_t track, tw_path *path);
/* How many clips of keys posing it asks, at least 1. */
uint32_t tw_clip_cost(const tw_clip *clip);
/* The track that moves a node's path; TW_NO_INDEX where there is none. O(tracks). */
uint32_t tw_clip_find(const tw_clip *clip, uint32_t node, tw_path path);

/* Whether a track moves this node's transform; the node's matrix is then ignored and its TRS counts. */
bool tw_clip_moves(const tw_clip *clip, uint32_t node);

/* Converts local transforms to matrices. A node with has_matrix keeps its matrix unless the clip (or NULL)
 * moves it. locals: [node_count], out: [node_count][16]. */
void tw_pose_locals(const tw_clip *clip, const tw_node *nodes, uint32_t node_count, const tw_trs *locals,
                    float *out);

/* Multiplies local matrices into world matrices; local and world may be the same array. order: from
 * tw_nodes_order. */
void tw_pose_world(const tw_node *nodes, const uint32_t *order, uint32_t node_count, const float *local,
                   float *world);

/* out = determinant * inverse transpose of a matrix's linear part, column-major as the matrix is. Returns the
 * determinant. */
double tw_matrix_cofactors(const float matrix[16], double out[9]);

/* Joint matrices, world * inverse bind. out: [joint_count][16]. */
void tw_skin_matrices(const tw_skin *skin, const float *world, float *out);

/* ---- baking and reduction -------------------------------------------------------------------- */

/* Whether glTF can hold the keys and moves them as the track does: STEP tracks; LINEAR ones but for turns
 * about an axis; cubic splines, of rotations those whose keys are of unit length within 0.005. (Rounding to
 * whole numbers stays within that; scaling the keys of a spline would change the motion.) O(keys). */
bool tw_keys_fit_gltf(const tw_track_keys *track);

/* Both functions turn clips into LINEAR or STEP keys, which every glTF program plays alike: baking at given
 * times, reduction with as few keys as a tolerance allows. */

/* Bakes every track of `clip` to keys at exactly these times: LINEAR, or STEP where the track is STEP;
 * rotations as quaternions with continuous signs. times: [time_count], at least 1, finite, strictly
 * increasing, not negative; else TW_INVALID with pointer "/times/3". Times outside a track's keys hold its
 * first or last value.
 * out: its name is NULL, for the caller to set; its arrays live in the arena, except times, which is the
 * caller's. TW_NO_MEMORY. O(keys of the result). */
tw_status tw_clip_bake(const tw_clip *clip, const float *times, uint32_t time_count, tw_arena *arena,
                       tw_clip_keys *out, tw_error *error);

typedef struct tw_tolerance {
  double angle;    /* radians, at least 1e-6; for rotations */
  double distance; /* above 0; metres for translations, and for scales how far they move a point one metre
                      away; for weights a difference of weights */
} tw_tolerance;

/* The largest error of the keys that tw_clip_bake made of a clip, from the first time to the last, in between
 * keys too; a rotation of 180 degrees between two LINEAR keys counts as an error of 180 degrees, a STEP track
 * that jumps between two keys as one of the whole jump, which the later key makes too late. parallel: asked
 * whether the result is still wanted; or NULL. TW_NO_MEMORY, TW_CANCELLED.
 * O(keys of both), but for tracks that turn over and over, of which at most a million steps are followed. */
tw_status tw_clip_bake_error(const tw_clip *clip, const tw_clip_keys *baked, const tw_parallel_for *parallel,
                             tw_tolerance *reached, tw_error *error);

/* Reduces the clip to few LINEAR keys that stay within the tolerance everywhere, between keys too. Keys lie
 * on the original path, each as far from the one before as the tolerance allows, but rotations less than 155
 * degrees, so that every player turns the same way. A track that stands still gets one key, or two where it
 * sets the clip's duration. STEP tracks and cubic splines that glTF can hold stay as they are.
 * keys: what the clip was made of; the result may point into it. NULL where there are none any more, and for
 * a clip that is made of other clips (tw_clip_mix); where the values of such a one jump, a ramp of 1e-4 s or
 * less is left, and told as an error. A clip made with a forced interpolation is reduced as that
 * interpolation moves it.
 * reached: the largest remaining errors, measured between keys too. Single precision may leave more than a
 * very small tolerance, but no more than 4e-7 of the largest value.
 * max_keys: TW_LIMIT where a track would need more, or where following the whole clip takes more steps than
 * 64 for each of its keys and *steps, from which those are taken that exceed the former: so all clips of an
 * answer take no more than in proportion to their keys, and TW_REDUCTION_STEPS. out: as in tw_clip_bake.
 * TW_CANCELLED. O(keys + total angle / sqrt(tolerance)), times a logarithm. */
enum { TW_REDUCTION_STEPS = 1 << 20 }; /* a second or two */
tw_status tw_clip_reduce(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                         uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                         tw_tolerance *reached, tw_error *error);

/* The same, but a track of Euler angles keeps its own keys, exactly, and gets no more than max_keys between
 * them, where slerp would leave the path of the angles by more than the tolerance, or turn another way. Of
 * such tracks `reached` has a bound. */
tw_status tw_clip_express(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                          uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                          tw_tolerance *reached, tw_error *error);

/* ---- diagnostics ----------------------------------------------------------------------------- */

/* Diagnoses a rotation track: how far and how fast it turns, which keys are doubtful, and how near it comes
 * to gimbal lock in each Euler order. Angles in radians, times in seconds. */

/* The point of a path nearest to gimbal lock in one Euler order. */
typedef struct tw_gimbal {
  double time;
  double cos_middle;    /* |cos| of the order's middle angle: 1 is farthest from lock, 0 is lock */
  double amplification; /* 1 / cos_middle: outer angles' rate over the rotation's; INFINITY at lock */
} tw_gimbal;

enum { TW_TRACK_WARNINGS = 8, TW_TRACK_WARNING_SIZE = 200 };

typedef struct tw_track_report {
  uint32_t key_count;
  double start, duration; /* time of the first key; time from it to the last */

  double total_angle;   /* along the path as it is interpolated; STEP jumps count */
  double largest_step;  /* the largest angle travelled from one key to the next */
  uint32_t largest_key; /* the key at which that step starts */
  double peak_velocity; /* radians a second; 0 for STEP, which only jumps */
  double peak_time;

  uint32_t sign_flips;    /* quaternion keys with a negative dot product with the key before: q and -q are one
                             rotation */
  uint32_t non_unit_keys; /* quaternion keys whose length is off 1 by more than 1e-5 */
  uint32_t duplicate_times; /* as in the track's keys */
  uint32_t half_turns;      /* steps of exactly 180 degrees: which way slerp turns is arbitrary */
  uint32_t long_steps;      /* steps over 180 degrees: quaternions would turn the shorter way */
  uint32_t euler_wraps;     /* Euler keys with an angle more than 180 degrees away from the key before's */

  tw_euler_order order;               /* the track's own order where its keys are Euler angles, else XYZ */
  tw_gimbal gimbals[TW_EULER_ORDERS]; /* for each order the least cos_middle along the whole path, not only at
                                         keys */
  tw_euler_order best_order;          /* the order whose worst point is farthest from lock */
  int lost_axis; /* 0 x, 1 y, 2 z: the last axis of `order`, which at lock turns the same way as the first */

  bool has_stray;     /* the track interpolates Euler angles; the two fields below are set */
  double stray_angle; /* the most that interpolating each angle strays from slerp between the keys */
  double stray_time;

  uint32_t warning_count;
  char warnings[TW_TRACK_WARNINGS][TW_TRACK_WARNING_SIZE]; /* sentences */
} tw_track_report;

/* A steps_most for tw_track_inspect that is enough for any track. */
enum { TW_TRACK_STEPS = 512 };

/* Inspects one rotation track. keys: as for tw_clip_create, whose errors are returned with pointers from
 * "/tracks/0". Slerp, nlerp and turns about one axis are evaluated exactly. Other paths are followed in steps
 * of at most 5 degrees, as long as no segment takes more than steps_most steps (at least 1), and are refined
 * where they may come nearest to lock: cos_middle is then exact to about 1e-7. O(keys * steps).
 * TW_CANCELLED. */
tw_status tw_track_inspect(const tw_track_keys *keys, uint32_t steps_most, tw_track_report *out,
                           tw_error *error);

#ifdef __cplusplus
}
#endif
#endif
