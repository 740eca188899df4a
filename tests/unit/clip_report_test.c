/* The report on a clip as a whole, against motions whose measures are known. */
#include <stdlib.h>
#include <string.h>

#include "keys.h"
#include "rotation_reference.h"
#include "tweend/clip_report.h"

enum { KEYS = 121, NODES = 4, HIPS = 0, HEAD = 1, LEFT = 2, RIGHT = 3 };

typedef struct figure {
  tw_arena *arena;
  tw_node nodes[NODES];
  uint32_t order[NODES];
  float times[KEYS];
  tw_clip_report report;
} figure;

static void node_of(figure *f, uint32_t node, const char *name, uint32_t parent, float y) {
  f->nodes[node] = (tw_node){
      .name = name, .parent = parent, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
  f->nodes[node].rest.translation[1] = y;
}

/* A figure 2 high; keys 60 a second. */
static int setup(void **state) {
  figure *f = calloc(1, sizeof *f);
  assert_non_null(f);
  f->arena = tw_arena_create();
  node_of(f, HIPS, "hips", TW_NO_INDEX, 1);
  node_of(f, HEAD, "head", HIPS, 1);
  node_of(f, LEFT, "LeftFoot", TW_NO_INDEX, 0);
  node_of(f, RIGHT, "RightFoot", TW_NO_INDEX, 0);
  assert_int_equal(tw_nodes_order(f->nodes, NODES, f->order, NULL), TW_OK);
  for (int i = 0; i < KEYS; i++) f->times[i] = (float)i / 60;
  *state = f;
  return 0;
}

static int teardown(void **state) {
  figure *f = *state;
  tw_arena_destroy(f->arena);
  free(f);
  return 0;
}

static const tw_clip_report *inspect(figure *f, const tw_track_keys *tracks, uint32_t count,
                                     const uint32_t *feet, uint32_t foot_count) {
  tw_clip_keys keys = {.track_count = count, .tracks = tracks};
  tw_error error = {0};
  const tw_inspect_job job = {.keys = &keys,
                              .nodes = f->nodes,
                              .order = f->order,
                              .node_count = NODES,
                              .foot_count = foot_count,
                              .feet = feet};
  if (tw_clip_inspect(&job, f->arena, &f->report, &error) != TW_OK)
    fail_msg("%s: %s", error.pointer, error.detail);
  return &f->report;
}

static void assert_near(double value, double expected, double tolerance) {
  if (!(fabs(value - expected) <= tolerance)) fail_msg("%.9g is not %.9g", value, expected);
}

static void turn_about(int axis, double angle, float q[4]) {
  q[0] = q[1] = q[2] = 0;
  q[axis] = (float)sin(angle / 2);
  q[3] = (float)cos(angle / 2);
}

static tw_track_keys turning(figure *f, uint32_t node, float (*keys)[4], uint32_t count) {
  tw_track_keys track = quaternion_keys(TW_LINEAR, f->times, keys[0], count);
  track.node = node;
  return track;
}

static tw_track_keys going(figure *f, uint32_t node, float (*keys)[3], uint32_t count) {
  tw_track_keys track = value_keys(TW_TRANSLATION, TW_LINEAR, f->times, keys[0], count);
  track.node = node;
  return track;
}

TEST_WITH(the_seam_is_the_farthest_node_and_the_speeds_that_meet_there, setup, teardown) {
  figure *f = *state;
  float head[KEYS][4], hips[KEYS][3];
  for (int i = 0; i < KEYS; i++) { /* from 0 to 40 degrees at 20 a second: both ends turn alike */
    turn_about(0, 20 * REF_DEGREES * (double)f->times[i], head[i]);
    memcpy(hips[i], (float[3]){0, 1 + 0.25f * f->times[i], 0}, sizeof hips[i]);
  }
  tw_track_keys tracks[] = {turning(f, HEAD, head, KEYS), going(f, HIPS, hips, KEYS)};
  const tw_clip_report *report = inspect(f, tracks, 2, NULL, 0);
  assert_int_equal(report->loop.node, HEAD);
  assert_near(report->loop.angle, 40 * REF_DEGREES, 1e-6);
  assert_near(report->loop.distance, 0.5, 1e-6);
  assert_near(report->loop.speed, 0, 1e-4);
  for (int i = 0; i < KEYS; i++) /* there and back: what meets at the seam turns both ways */
    turn_about(0, 20 * REF_DEGREES * (1 - fabs(1 - (double)f->times[i])), head[i]);
  report = inspect(f, tracks, 1, NULL, 0);
  assert_near(report->loop.angle, 0, 1e-6);
  assert_near(report->loop.speed, 40 * REF_DEGREES, 1e-4);
  report = inspect(f, tracks + 1, 1, NULL, 0);
  assert_int_equal(report->loop.node, HIPS); /* nothing turns */
}

TEST_WITH(the_root_travels_and_turns, setup, teardown) {
  figure *f = *state;
  float hips[KEYS][3], turns[KEYS][4];
  for (int i = 0; i < KEYS;
       i++) { /* once round a circle of radius 3, and half as far again; turned with it */
    double angle = 1.5 * 2 * REF_PI * i / (KEYS - 1);
    memcpy(hips[i], (float[3]){(float)(3 * sin(angle)), 1, (float)(3 * cos(angle))}, sizeof hips[i]);
    turn_about(1, angle, turns[i]);
  }
  tw_track_keys tracks[] = {going(f, HIPS, hips, KEYS), turning(f, HIPS, turns, KEYS)};
  const tw_clip_report *report = inspect(f, tracks, 2, NULL, 0);
  assert_int_equal(report->root.node, HIPS);
  assert_near(report->root.distance, 6, 1e-5);
  assert_near(report->root.speed, 9 * REF_PI / 2, 9 * REF_PI / 2 * 1e-3); /* chords are a little shorter */
  assert_near(report->root.turn, 3 * REF_PI, 1e-4);
  assert_int_equal(report->still_count, 3);
  assert_int_equal(report->still[0], HEAD);
}

TEST_WITH(a_root_turns_as_far_whichever_way_it_rests, setup, teardown) {
  figure *f = *state;
  float turns[KEYS][4];
  for (int axis = 0; axis < 3; axis++) { /* head over heels, turned round, or on its side by half a turn */
    ref_quat rest = {axis == 0, axis == 1, axis == 2, 0};
    for (int i = 0; i < KEYS; i++) {
      ref_quat q = ref_product(ref_axis_angle(0, 1, 0, 3 * REF_PI * i / (KEYS - 1)), rest);
      memcpy(turns[i], (float[4]){(float)q.x, (float)q.y, (float)q.z, (float)q.w}, sizeof turns[i]);
    }
    tw_track_keys track = turning(f, HIPS, turns, KEYS);
    assert_near(inspect(f, &track, 1, NULL, 0)->root.turn, 3 * REF_PI, 1e-4);
  }
}

/* The model's unit is the world's, whatever the scale of an armature. */
TEST_WITH(lengths_are_those_of_the_world, setup, teardown) {
  figure *f = *state;
  float head[KEYS][3];
  for (int i = 0; i < KEYS; i++) memcpy(head[i], (float[3]){0, 100, i % 2 ? 0.5f : 0}, sizeof head[i]);
  head[KEYS - 1][2] = 25;
  for (int i = 0; i < 3; i++) f->nodes[HIPS].rest.scale[i] = 0.01f;
  tw_track_keys track = going(f, HEAD, head, KEYS);
  const tw_clip_report *report = inspect(f, &track, 1, NULL, 0);
  assert_int_equal(report->loop.node, HEAD);
  assert_near(report->loop.distance, 0.25, 1e-6);
  assert_near(report->root.distance, 0.25, 1e-6);
  head[KEYS - 1][2] = 0;
  report = inspect(f, &track, 1, NULL, 0);
  assert_int_equal(report->noise_count, 1);
  assert_near(report->noise[0].rms, 0.0025 * 16 / 21, 1e-5); /* as below */
}

TEST_WITH(what_stands_still_has_no_root_and_no_contacts, setup, teardown) {
  figure *f = *state;
  float hips[2][3] = {{5, 6, 7}, {5, 6, 7}};
  tw_track_keys track = going(f, HIPS, hips, 2);
  const tw_clip_report *report = inspect(f, &track, 1, NULL, 0);
  assert_int_equal(report->still_count, NODES);
  assert_int_equal(report->root.node, TW_NO_INDEX);
  assert_int_equal(report->loop.node, TW_NO_INDEX);
  assert_int_equal(report->contact_count, 0);
  assert_int_equal(report->foot_count, 2);
  assert_int_equal(report->feet[1], RIGHT);
  assert_near(report->height, 2, 1e-6);
  report = inspect(f, NULL, 0, NULL, 0);
  assert_int_equal(report->still_count, NODES);
}

/* A spline whose keys are equal moves by its tangents. */
TEST_WITH(a_spline_between_equal_keys_moves, setup, teardown) {
  figure *f = *state;
  const float values[2][3][3] = {{{0}, {0, 1, 0}, {3, 0, 0}}, {{3, 0, 0}, {0, 1, 0}, {0}}};
  tw_track_keys track = value_keys(TW_TRANSLATION, TW_CUBICSPLINE, f->times, values[0][0], 2);
  assert_int_equal(inspect(f, &track, 1, NULL, 0)->still_count, NODES - 1);
}

/* Half a second on the ground, sliding 0.1 sidewards, half a second in the air. */
static void step(figure *f, double phase, float (*out)[3]) {
  for (int i = 0; i < KEYS; i++) {
    double u = fmod((double)f->times[i] + phase, 1), air = u < 0.5 ? 0 : (u - 0.5) * 2;
    double x = u < 0.5 ? 0.2 * u : 0.1 * (1 - air);
    memcpy(out[i], (float[3]){(float)x, (float)(0.4 * sin(REF_PI * air)), (float)(2 * air)}, sizeof out[i]);
  }
}

TEST_WITH(feet_touch_the_ground_and_slide, setup, teardown) {
  figure *f = *state;
  float left[KEYS][3], right[KEYS][3];
  step(f, 0, left);
  step(f, 0.5, right);
  tw_track_keys tracks[] = {going(f, LEFT, left, KEYS), going(f, RIGHT, right, KEYS)};
  const tw_clip_report *report = inspect(f, tracks, 2, NULL, 0);
  assert_int_equal(report->contact_count, 4);
  uint32_t lefts = 0;
  for (uint32_t i = 0; i < report->contact_count; i++) {
    const tw_contact *contact = &report->contacts[i];
    lefts += contact->node == LEFT;
    double begin = contact->node == LEFT ? floor(contact->from + 0.1) : floor(contact->from - 0.4) + 0.5;
    assert_near(contact->from, begin, 2.01 / 60);
    assert_near(contact->to, begin + 0.5, 2.01 / 60);
    assert_near(contact->slide, 0.1, 0.02);
  }
  assert_int_equal(lefts, 2);
  const uint32_t foot = RIGHT;
  assert_int_equal(inspect(f, tracks, 2, &foot, 1)->contact_count, 2);
  f->nodes[LEFT].name = "left_Ankle";
  f->nodes[RIGHT].name = NULL;
  assert_int_equal(inspect(f, tracks, 2, NULL, 0)->contact_count, 2); /* the ankle's */
  f->nodes[LEFT].name = "left";
  assert_int_equal(inspect(f, tracks, 2, NULL, 0)->foot_count, 0);
}

TEST_WITH(feet_are_bones_not_what_is_called_after_them, setup, teardown) {
  figure *f = *state;
  float left[KEYS][3];
  step(f, 0, left);
  tw_track_keys track = going(f, LEFT, left, KEYS);
  f->nodes[LEFT].name = "foot_l";
  f->nodes[RIGHT].name = "ik_foot_root";
  const tw_clip_report *report = inspect(f, &track, 1, NULL, 0);
  assert_int_equal(report->foot_count, 1);
  assert_int_equal(report->feet[0], LEFT);
  f->nodes[RIGHT].name = "front_foot_l"; /* of a horse */
  assert_int_equal(inspect(f, &track, 1, NULL, 0)->foot_count, 2);
  f->nodes[LEFT].name = "my foot"; /* no bone's usual name */
  assert_int_equal(inspect(f, &track, 1, NULL, 0)->foot_count, 2);
}

/* Heights of a foot at times from 0 to 2 s, in a line from one to the next. */
static void rise_along(figure *f, const float (*stops)[2], float (*out)[3]) {
  for (int i = 0, s = 0; i < KEYS; i++) {
    while (stops[s + 1][0] < f->times[i]) s++;
    float u = (f->times[i] - stops[s][0]) / (stops[s + 1][0] - stops[s][0]);
    memcpy(out[i], (float[3]){0, stops[s][1] + u * (stops[s + 1][1] - stops[s][1]), 0}, sizeof out[i]);
  }
}

TEST_WITH(feet_stand_on_steps_and_not_in_the_air, setup, teardown) {
  /* Two steps up, and two down with little lift; the last way up has none. */
  static const float up[][2] = {{0, 0},        {0.3f, 0},   {0.45f, .45f}, {0.6f, .3f}, {0.9f, .3f},
                                {1.05f, .75f}, {1.2f, .6f}, {1.5f, .6f},   {1.8f, 1},   {2.1f, 1}};
  static const float down[][2] = {{0, .6f},  {0.3f, .6f}, {0.4f, .66f}, {0.6f, .3f}, {0.9f, .3f},
                                  {1, .36f}, {1.2f, 0},   {1.5f, 0},    {1.8f, .6f}, {2.1f, .6f}};
  static const float back[][2] = {{0, .0f},    {0.6f, .0f},  {0.7f, .36f}, {.8f, .3f},
                                  {1.1f, .3f}, {1.3f, .66f}, {1.4f, .6f},  {2.1f, .6f}};
  static const float held[][2] = {{0, 0}, {0.3f, 0}, {0.6f, .6f}, {1.5f, .6f}, {1.8f, 0}, {2.1f, 0}};
  static const struct {
    const float (*stops)[2];
    uint32_t count;
    double from[3]; /* by time */
  } cases[] = {
      {up, 3, {0, 0.6, 1.2}}, {down, 3, {0, 0.6, 1.2}}, {back, 3, {0, 0.8, 1.4}}, {held, 2, {0, 1.8}}};
  figure *f = *state;
  const uint32_t foot = LEFT;
  float places[KEYS][3];
  for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
    rise_along(f, cases[c].stops, places);
    tw_track_keys track = going(f, LEFT, places, KEYS);
    const tw_clip_report *report = inspect(f, &track, 1, &foot, 1);
    assert_int_equal(report->contact_count, cases[c].count);
    for (uint32_t i = 0; i < report->contact_count; i++)
      assert_near(report->contacts[i].from, cases[c].from[i], 2.01 / 60);
  }
  for (int i = 0; i < KEYS; i++) { /* a jump: at its top it is slow for 0.05 s */
    double t = fabs((double)f->times[i] - 1), fall = 1.25 - 4.905 * t * t;
    memcpy(places[i], (float[3]){0, (float)fmax(0, fall), 0}, sizeof places[i]);
  }
  tw_track_keys track = going(f, LEFT, places, KEYS);
  assert_int_equal(inspect(f, &track, 1, &foot, 1)->contact_count, 2);
}

TEST_WITH(noise_is_what_a_parabola_leaves, setup, teardown) {
  figure *f = *state;
  float smooth[KEYS][3], rough[KEYS][3], head[KEYS][4];
  double shake = 0.01;
  for (int i = 0; i < KEYS; i++) {
    double t = (double)f->times[i], sign = i % 2 ? 1 : -1;
    memcpy(smooth[i], (float[3]){(float)(t * t), (float)(1 - t), 0}, sizeof smooth[i]);
    memcpy(rough[i], (float[3]){(float)(t * t), (float)(1 + sign * shake), 0}, sizeof rough[i]);
    turn_about(2, t + sign * shake, head[i]);
  }
  /* Of alternating +1 and -1 the parabola through seven keys (weights -2 3 6 7 6 3 -2 by 21) keeps 5/21 at
   * the middle. */
  double left = shake * (1 - (7 - 2 * 6 + 2 * 3 + 2 * 2) / 21.0);
  tw_track_keys tracks[] = {going(f, HIPS, smooth, KEYS), going(f, LEFT, rough, KEYS),
                            turning(f, HEAD, head, KEYS), going(f, RIGHT, rough, 6)};
  const tw_clip_report *report = inspect(f, tracks, 4, NULL, 0);
  assert_int_equal(report->noise_count, 3); /* six keys are too few */
  assert_near(report->noise[0].rms, 0, 1e-6);
  assert_near(report->noise[1].rms, left, 1e-6);
  assert_int_equal(report->noise[2].track, 2);
  assert_near(report->noise[2].rms, left, 1e-6);
}

/* Of seven keys six are at one time, as far as numbers tell: a parabola leads through whatever they have. */
TEST_WITH(times_that_count_as_two_have_no_noise, setup, teardown) {
  figure *f = *state;
  float places[7][3];
  for (int i = 0; i < 7; i++) {
    f->times[i] = i < 6 ? 1e-30F * (float)i : 1;
    for (int c = 0; c < 3; c++) places[i][c] = (float)(i * i % 5 + c);
  }
  tw_track_keys track = going(f, HIPS, places, 7);
  const tw_clip_report *report = inspect(f, &track, 1, NULL, 0);
  assert_int_equal(report->noise_count, 1);
  assert_near(report->noise[0].rms, 0, 0);
}

TEST_WITH(a_key_that_leaps_out_and_back_is_a_pop, setup, teardown) {
  figure *f = *state;
  float head[KEYS][4];
  for (int i = 0; i < KEYS; i++) turn_about(0, (double)f->times[i], head[i]);
  turn_about(0, (double)f->times[40] + 20 * REF_DEGREES, head[40]);
  tw_track_keys track = turning(f, HEAD, head, KEYS);
  const tw_clip_report *report = inspect(f, &track, 1, NULL, 0);
  assert_int_equal(report->pop_count, 1);
  assert_near(report->pops[0].time, 40 / 60.0, 1e-6);
  assert_near(report->pops[0].angle, 20 * REF_DEGREES, 1e-5);
  /* Keys half a second apart are poses of an animator, who may want the leap. */
  for (int i = 0; i < KEYS; i++) f->times[i] *= 30;
  assert_int_equal(inspect(f, &track, 1, NULL, 0)->pop_count, 0);
}

TEST_WITH(a_clip_that_cannot_be_played_is_not_inspected, setup, teardown) {
  figure *f = *state;
  float hips[2][3] = {{0}, {NAN}};
  tw_track_keys track = going(f, HIPS, hips, 2);
  tw_clip_keys keys = {.track_count = 1, .tracks = &track};
  tw_error error = {0};
  const tw_inspect_job job = {.keys = &keys, .nodes = f->nodes, .order = f->order, .node_count = NODES};
  assert_int_equal(tw_clip_inspect(&job, f->arena, &f->report, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/tracks/0/values/1");
}
