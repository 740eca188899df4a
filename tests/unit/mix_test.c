/* Mixed clips against the formulas in double precision, written from API.md and not from the library. */
#include <stdlib.h>
#include <string.h>

#include "keys.h"
#include "rotation_reference.h"
#include "tweend/mix.h"

enum { NODES = 70, KEYS = 5, LAYERS = 5 }; /* more nodes than are posed at a time */

static uint32_t seed;

static double random_in(double from, double to) {
  seed = seed * 1664525 + 1013904223;
  return from + (to - from) * (seed >> 8) / (1 << 24);
}

/* A clip whose tracks move some nodes. */
typedef struct moves {
  float times[KEYS], rotations[NODES][KEYS][4], translations[NODES][KEYS][3];
  tw_track_keys tracks[2 * NODES];
  uint32_t count;
  tw_clip *clip;
  float duration;
} moves;

/* every: each how many-th node is moved. */
static void make_moves(moves *m, uint32_t every, double duration) {
  m->count = 0;
  for (int k = 0; k < KEYS; k++) m->times[k] = (float)(duration * k / (KEYS - 1));
  m->duration = m->times[KEYS - 1];
  for (uint32_t n = 0; n < NODES; n += every) {
    for (int k = 0; k < KEYS; k++) {
      ref_quat q = {random_in(-1, 1), random_in(-1, 1), random_in(-1, 1), random_in(-1, 1)};
      q = ref_unit(q);
      float *key = m->rotations[n][k];
      key[0] = (float)q.x, key[1] = (float)q.y, key[2] = (float)q.z, key[3] = (float)q.w;
      for (int i = 0; i < 3; i++) m->translations[n][k][i] = (float)random_in(-2, 2);
    }
    tw_track_keys turn = quaternion_keys(TW_LINEAR, m->times, m->rotations[n][0], KEYS);
    tw_track_keys go =
        value_keys(n % 3 ? TW_TRANSLATION : TW_SCALE, TW_LINEAR, m->times, m->translations[n][0], KEYS);
    turn.node = go.node = n;
    m->tracks[m->count++] = turn;
    m->tracks[m->count++] = go;
  }
  tw_clip_keys keys = {.track_count = m->count, .tracks = m->tracks};
  assert_int_equal(tw_clip_create(&keys, NODES, -1, &m->clip, NULL), TW_OK);
}

static void make_nodes(tw_node nodes[NODES]) {
  for (uint32_t i = 0; i < NODES; i++) {
    nodes[i] =
        (tw_node){.parent = TW_NO_INDEX, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
    nodes[i].rest.translation[1] = (float)i;
  }
}

static const float one = 1, zero = 0;

static tw_layer layer_of(tw_layer_mode mode, const float *weight) {
  return (tw_layer){.mode = mode, .speed = 1, .weight_count = 1, .weights = weight};
}

typedef struct mixture {
  tw_node nodes[NODES];
  moves *moves[LAYERS];
  tw_layer layers[LAYERS];
  uint32_t count;
  tw_clip *clip;
} mixture;

static mixture *begin(void) {
  mixture *m = calloc(1, sizeof *m);
  assert_non_null(m);
  make_nodes(m->nodes);
  return m;
}

static void add(mixture *m, tw_layer layer, uint32_t every, double duration) {
  m->moves[m->count] = calloc(1, sizeof(moves));
  assert_non_null(m->moves[m->count]);
  make_moves(m->moves[m->count], every, duration);
  m->layers[m->count++] = layer;
}

static tw_status mix_of(mixture *m, tw_error *error) {
  tw_clip *clips[LAYERS];
  float durations[LAYERS];
  for (uint32_t i = 0; i < m->count; i++) {
    clips[i] = m->moves[i]->clip;
    durations[i] = m->moves[i]->duration;
  }
  tw_mix_job job = {m->count, m->layers, clips, durations, m->nodes, NODES, NULL};
  return tw_clip_mix(&job, &m->clip, error);
}

static void mix(mixture *m) {
  tw_error error = {0};
  if (mix_of(m, &error) != TW_OK) fail_msg("%s: %s", error.pointer, error.detail);
}

static void end(mixture *m) {
  if (!m->clip)
    for (uint32_t i = 0; i < m->count; i++) tw_clip_destroy(m->moves[i]->clip);
  tw_clip_destroy(m->clip);
  for (uint32_t i = 0; i < m->count; i++) free(m->moves[i]);
  free(m);
}

/* ---- the formulas ---------------------------------------------------------------------------- */

static double weight_at(const tw_layer *layer, double t) {
  if (layer->weight_count == 1 || t <= (double)layer->weight_times[0]) return (double)layer->weights[0];
  for (uint32_t k = 1; k < layer->weight_count; k++) {
    double a = (double)layer->weight_times[k - 1], b = (double)layer->weight_times[k];
    if (t <= b)
      return (double)layer->weights[k - 1] +
             ((double)layer->weights[k] - (double)layer->weights[k - 1]) * (t - a) / (b - a);
  }
  return (double)layer->weights[layer->weight_count - 1];
}

static double rate_at(const mixture *m, double t) {
  double weights = 0, rates = 0, mean = 0, count = 0;
  for (uint32_t i = 0; i < m->count; i++) {
    if (!m->layers[i].is_synced || m->layers[i].mode == TW_LAYER_ADDITIVE) continue;
    double rate = m->layers[i].speed / (double)m->moves[i]->duration, weight = weight_at(&m->layers[i], t);
    weights += weight, rates += weight * rate, mean += rate, count++;
  }
  return weights > 0 ? rates / weights : count > 0 ? mean / count : 0;
}

/* Midpoint sums of the rate. */
static double phase_at(const mixture *m, double t) {
  enum { STEPS = 20000 };
  double sum = 0;
  for (int i = 0; i < STEPS; i++) sum += rate_at(m, t * (i + 0.5) / STEPS);
  return sum * t / STEPS;
}

static double local_at(const mixture *m, uint32_t i, double t, double phase) {
  const tw_layer *layer = &m->layers[i];
  double duration = (double)m->moves[i]->duration;
  if (!layer->is_synced) return layer->offset + layer->speed * t;
  double rounds = phase + layer->offset / duration;
  return (rounds - floor(rounds)) * duration;
}

static void clip_at(const mixture *m, uint32_t i, uint32_t node, double t, ref_quat *q, double v[3]) {
  tw_trs poses[NODES];
  tw_clip_pose(m->moves[i]->clip, m->nodes, NODES, (float)t, poses);
  *q = ref_of(poses[node].rotation);
  for (int k = 0; k < 3; k++) v[k] = (double)(node % 3 ? poses[node].translation[k] : poses[node].scale[k]);
}

static void expected_at(const mixture *m, uint32_t node, double t, ref_quat *q, double v[3]) {
  double phase = phase_at(m, t), sum = 0;
  ref_quat total = {0};
  double values[3] = {0};
  static const uint32_t every[LAYERS] = {1, 2, 3, 5, 7};
  for (uint32_t i = 0; i < m->count; i++) {
    double weight = weight_at(&m->layers[i], t), vi[3];
    ref_quat qi;
    if (m->layers[i].mode == TW_LAYER_ADDITIVE || node % every[i] || weight == 0) continue;
    clip_at(m, i, node, local_at(m, i, t, phase), &qi, vi);
    total = ref_add(total, 1, ref_toward(qi, total), weight);
    for (int k = 0; k < 3; k++) values[k] += weight * vi[k];
    sum += weight;
  }
  if (sum > 0) {
    *q = ref_unit(total);
    for (int k = 0; k < 3; k++) v[k] = values[k] / sum;
  } else {
    *q = ref_of(m->nodes[node].rest.rotation);
    for (int k = 0; k < 3; k++)
      v[k] = (double)(node % 3 ? m->nodes[node].rest.translation[k] : m->nodes[node].rest.scale[k]);
  }
  const ref_quat identity = {0, 0, 0, 1};
  for (uint32_t i = 0; i < m->count; i++) {
    if (m->layers[i].mode != TW_LAYER_ADDITIVE || node % every[i]) continue;
    double weight = weight_at(&m->layers[i], t), vi[3], vr[3];
    ref_quat qi, reference;
    clip_at(m, i, node, local_at(m, i, t, phase), &qi, vi);
    clip_at(m, i, node, m->layers[i].reference, &reference, vr);
    ref_quat turn = ref_toward(ref_product(ref_inverse(reference), qi), identity);
    *q = ref_product(*q, ref_slerp(identity, turn, weight));
    for (int k = 0; k < 3; k++) v[k] += weight * (vi[k] - vr[k]);
  }
}

/* Compares poses, and samples of each track, at a time. */
static void assert_as_formulas(const mixture *m, double t) {
  tw_trs poses[NODES];
  tw_clip_pose(m->clip, m->nodes, NODES, (float)t, poses);
  for (uint32_t n = 0; n < NODES; n += 3 - n % 2) {
    ref_quat q;
    double v[3];
    expected_at(m, n, (double)(float)t, &q, v);
    double off = ref_angle(ref_of(poses[n].rotation), q);
    if (!(off < 2e-6)) fail_msg("node %u at %.9g: %.9g radians off", n, t, off);
    for (int k = 0; k < 3; k++) {
      double value = (double)(n % 3 ? poses[n].translation[k] : poses[n].scale[k]);
      if (!(fabs(value - v[k]) < 1e-5)) fail_msg("node %u at %.9g: %.9g is not %.9g", n, t, value, v[k]);
    }
    assert_true(fabs(ref_dot(ref_of(poses[n].rotation), ref_of(poses[n].rotation)) - 1) < 1e-6);
  }
}

/* Poses and samples have the same bits, whatever else is sampled with them. */
static void assert_samples_are_poses(const mixture *m) {
  enum { TIMES = 150 };
  static float times[TIMES], samples[TIMES * 4];
  for (int i = 0; i < TIMES; i++) times[i] = (float)random_in(-0.5, 4);
  for (uint32_t track = 0; track < tw_clip_track_count(m->clip); track++) {
    tw_path path;
    uint32_t node = tw_clip_target(m->clip, track, &path), width = tw_clip_width(m->clip, track);
    tw_clip_sample(m->clip, track, times, TIMES, samples);
    for (uint32_t i = 0; i < TIMES; i += 13) {
      tw_trs poses[NODES];
      tw_clip_pose(m->clip, m->nodes, NODES, times[i], poses);
      const float *pose = path == TW_ROTATION      ? poses[node].rotation
                          : path == TW_TRANSLATION ? poses[node].translation
                                                   : poses[node].scale;
      assert_memory_equal(samples + (size_t)i * width, pose, width * sizeof *pose);
    }
  }
}

/* ---- tests ----------------------------------------------------------------------------------- */

static void assert_layer_refused(tw_layer layer, const char *pointer) {
  mixture *m = begin();
  tw_error error = {0};
  add(m, layer_of(TW_LAYER_REPLACE, &one), 1, 1);
  add(m, layer, 2, 1);
  assert_int_equal(mix_of(m, &error), TW_INVALID);
  assert_string_equal(error.pointer, pointer);
  assert_true(error.detail[0] != '\0');
  end(m);
}

TEST(a_layer_that_cannot_be_played_is_refused_by_its_place) {
  static const float bad_times[][2] = {{0, 0}, {-1, 1}, {1, NAN}, {1, INFINITY}};
  static const float pair[2] = {1, 0}, negative = -1, huge = 2e6F, bad[2] = {1, NAN};
  tw_layer layer = layer_of(TW_LAYER_REPLACE, &one);
  for (int i = 0; i < 4; i++) {
    layer.weight_count = 2, layer.weights = pair, layer.weight_times = bad_times[i];
    assert_layer_refused(layer, i == 1 ? "/layers/1/weight/times/0" : "/layers/1/weight/times/1");
  }
  layer.weights = bad, layer.weight_times = (const float[]){0, 1};
  assert_layer_refused(layer, "/layers/1/weight/values/1");
  assert_layer_refused(layer_of(TW_LAYER_REPLACE, &negative), "/layers/1/weight");
  assert_layer_refused(layer_of(TW_LAYER_ADDITIVE, &huge), "/layers/1/weight");
  layer = layer_of(TW_LAYER_REPLACE, &one);
  layer.speed = NAN;
  assert_layer_refused(layer, "/layers/1/speed");
  layer.speed = 0, layer.is_synced = true;
  assert_layer_refused(layer, "/layers/1/speed");
  layer = layer_of(TW_LAYER_REPLACE, &one);
  layer.offset = INFINITY;
  assert_layer_refused(layer, "/layers/1/offset");
  layer = layer_of(TW_LAYER_ADDITIVE, &one);
  layer.reference = -1;
  assert_layer_refused(layer, "/layers/1/reference");
}

/* Tracks of a clip that others have too are the same, bit for bit, at many times at once. */
static void assert_sampled_alike(const tw_clip *clip, const tw_clip *alone) {
  enum { COUNT = 150 };
  float times[COUNT], found[COUNT * 4], wanted[COUNT * 4];
  uint32_t compared = 0;
  for (int i = 0; i < COUNT; i++) times[i] = (float)i * tw_clip_duration(alone) / COUNT;
  for (uint32_t i = 0; i < tw_clip_track_count(alone); i++) {
    tw_path path;
    uint32_t node = tw_clip_target(alone, i, &path), width = tw_clip_width(alone, i);
    if (width > 4) continue;
    tw_clip_sample(alone, i, times, COUNT, wanted);
    tw_clip_sample(clip, tw_clip_find(clip, node, path), times, COUNT, found);
    assert_memory_equal(found, wanted, COUNT * width * sizeof *found);
    compared++;
  }
  assert_true(compared > 0);
}

TEST(weights_of_0_and_1_leave_clips_untouched_to_the_last_bit) {
  seed = 1;
  static const float faded[2] = {0, 0}, times[2] = {0, 1};
  for (int form = 0; form < 4; form++) {
    mixture *m = begin();
    tw_layer whole = layer_of(TW_LAYER_REPLACE, &one), none = layer_of(TW_LAYER_REPLACE, &zero),
             added = layer_of(TW_LAYER_ADDITIVE, &zero);
    whole.is_synced = none.is_synced = form & 1;
    if (form & 2) none.weight_count = 2, none.weights = faded, none.weight_times = times;
    add(m, none, 1, 1.7);
    add(m, whole, 1, 1.3);
    add(m, none, 2, 0.9);
    add(m, added, 1, 1);
    mix(m);
    assert_true(tw_clip_duration(m->clip) == m->moves[1]->duration);
    for (int i = 0; i < 200; i++) {
      float time = i == 199 ? m->moves[1]->duration : (float)random_in(0, 1.3);
      tw_trs poses[NODES], alone[NODES];
      tw_clip_pose(m->clip, m->nodes, NODES, time, poses);
      tw_clip_pose(m->moves[1]->clip, m->nodes, NODES, time, alone);
      assert_memory_equal(poses, alone, sizeof poses);
    }
    assert_sampled_alike(m->clip, m->moves[1]->clip);
    end(m);
  }
}

TEST(replacing_layers_are_blended_by_weights_over_their_sum) {
  seed = 2;
  static const float weights[] = {0.7F, 0.2F, 3, 0.01F};
  mixture *m = begin();
  for (uint32_t i = 0; i < 4; i++)
    add(m, layer_of(TW_LAYER_REPLACE, &weights[i]), (uint32_t[]){1, 2, 3, 5}[i], 1 + i);
  m->layers[1].speed = 1.5, m->layers[2].offset = 0.3, m->layers[3].speed = -1, m->layers[3].offset = 4;
  mix(m);
  for (int i = 0; i < 20; i++) assert_as_formulas(m, random_in(0, 4));
  assert_samples_are_poses(m);
  end(m);
}

TEST(additive_layers_turn_on_in_order) {
  seed = 3;
  static const float weights[] = {1, 0.4F, -0.7F, 2.5F, 1};
  mixture *m = begin();
  for (uint32_t i = 0; i < 5; i++)
    add(m, layer_of(i ? TW_LAYER_ADDITIVE : TW_LAYER_REPLACE, &weights[i]), (uint32_t[]){1, 2, 3, 5, 7}[i],
        2);
  m->layers[2].reference = 1.1;
  mix(m);
  for (int i = 0; i < 20; i++) assert_as_formulas(m, random_in(0, 2));
  assert_samples_are_poses(m);
  end(m);
}

TEST(keyed_weights_fade_from_one_clip_to_the_next_in_one_phase) {
  seed = 4;
  static const float times[] = {0.5F, 1.5F, 2}, out[] = {1, 0, 0.25F}, in[] = {0, 1, 0};
  mixture *m = begin();
  add(m, layer_of(TW_LAYER_REPLACE, out), 1, 1.1);
  add(m, layer_of(TW_LAYER_REPLACE, in), 2, 0.6);
  add(m, layer_of(TW_LAYER_ADDITIVE, &one), 3, 0.8);
  for (int i = 0; i < 3; i++) m->layers[i].is_synced = true;
  for (int i = 0; i < 2; i++) m->layers[i].weight_count = 3, m->layers[i].weight_times = times;
  m->layers[1].speed = 1.2, m->layers[1].offset = 0.1;
  mix(m);
  double duration = (double)tw_clip_duration(m->clip), rounds = phase_at(m, duration);
  assert_true(duration >= 2 && fabs(rounds - round(rounds)) < 1e-6);
  for (int i = 0; i < 12; i++) assert_as_formulas(m, random_in(0, duration - 1e-3));
  assert_samples_are_poses(m);
  end(m);
}

TEST(layers_that_all_fade_out_are_blended_up_to_their_end) {
  static const float weights[2][2] = {{2, 0}, {1, 0}}, times[2][2] = {{2.7F, 109.7F}, {4.17F, 109.7F}};
  seed = 6;
  mixture *m = begin();
  for (int i = 0; i < 2; i++) {
    tw_layer layer = layer_of(TW_LAYER_REPLACE, &one);
    layer.weight_count = 2, layer.weights = weights[i], layer.weight_times = times[i];
    add(m, layer, 1, 120);
  }
  mix(m);
  float time = 109.7F;
  for (int i = 0; i < 40; i++) { /* ever farther from the end */
    tw_trs locals[NODES];
    float found[4];
    for (int step = 0; step < i * i; step++) time = nextafterf(time, 0);
    tw_clip_pose(m->clip, m->nodes, NODES, time, locals);
    tw_clip_sample(m->clip, tw_clip_find(m->clip, 1, TW_TRANSLATION), &time, 1, found);
    assert_memory_equal(found, locals[1].translation, sizeof locals[1].translation);
  }
  assert_samples_are_poses(m);
  end(m);
}

/* Values that differ by more than floats hold: the mean of two, and a part of their difference added. */
TEST(what_lies_between_huge_values_is_found) {
  static const float half = 0.5F, quarter = 0.25F;
  static const float *const weights[] = {&half, &quarter};
  static const float huge[2][3] = {{3e38F, -3e38F, 2e38F}, {-3e38F, 3e38F, 1e38F}};
  for (int is_added = 0; is_added < 2; is_added++) {
    seed = 10;
    mixture *m = begin();
    for (int i = 0; i < 2; i++) {
      add(m, layer_of(is_added && i ? TW_LAYER_ADDITIVE : TW_LAYER_REPLACE, weights[i]), 1, 1);
      for (uint32_t n = 0; n < NODES; n++)
        for (int k = 0; k < KEYS; k++)
          for (int axis = 0; axis < 3; axis++)
            m->moves[i]->translations[n][k][axis] = (k == 0 && i ? -1 : 1) * huge[i][axis];
      tw_clip_destroy(m->moves[i]->clip);
      tw_clip_keys keys = {.track_count = m->moves[i]->count, .tracks = m->moves[i]->tracks};
      assert_int_equal(tw_clip_create(&keys, NODES, -1, &m->moves[i]->clip, NULL), TW_OK);
    }
    mix(m);
    tw_trs locals[NODES];
    tw_clip_pose(m->clip, m->nodes, NODES, 1, locals);
    for (uint32_t n = 0; n < NODES; n++)
      for (int k = 0; k < 3; k++) {
        double first = (double)huge[0][k], second = (double)huge[1][k];
        double expected = is_added ? first + 2 * second / 4 : (2 * first + second) / 3;
        double found = (double)(n % 3 ? locals[n].translation : locals[n].scale)[k];
        assert_true(fabs(found - expected) < 1e-6 * 3e38);
      }
    assert_samples_are_poses(m);
    end(m);
  }
}

TEST(what_weights_take_beyond_the_range_of_floats_ends_there) {
  static const float most = 1e6F;
  seed = 9;
  mixture *m = begin();
  for (int i = 0; i < 2; i++) {
    tw_layer layer = layer_of(TW_LAYER_ADDITIVE, &most);
    layer.reference = i; /* one way, then the other */
    add(m, layer, 1, 1);
    for (uint32_t n = 0; n < NODES; n++)
      for (int k = 0; k < KEYS; k++)
        for (int axis = 0; axis < 3; axis++) m->moves[i]->translations[n][k][axis] = 1e38F * (float)(k - 2);
    tw_clip_destroy(m->moves[i]->clip);
    tw_clip_keys keys = {.track_count = m->moves[i]->count, .tracks = m->moves[i]->tracks};
    assert_int_equal(tw_clip_create(&keys, NODES, -1, &m->moves[i]->clip, NULL), TW_OK);
  }
  mix(m);
  for (int i = 0; i <= 20; i++) {
    tw_trs locals[NODES];
    tw_clip_pose(m->clip, m->nodes, NODES, (float)i / 20, locals);
    for (uint32_t n = 0; n < NODES; n++)
      for (int k = 0; k < 3; k++)
        assert_true(isfinite(locals[n].translation[k]) && isfinite(locals[n].scale[k]));
  }
  end(m);
}

TEST(without_weight_the_rest_pose_stands) {
  mixture *m = begin();
  static const float times[] = {0, 1, 2}, fade[] = {1, 0, 0};
  add(m, layer_of(TW_LAYER_REPLACE, fade), 1, 1);
  m->layers[0].weight_count = 3, m->layers[0].weight_times = times;
  mix(m);
  tw_trs poses[NODES];
  tw_clip_pose(m->clip, m->nodes, NODES, 1.5F, poses);
  for (uint32_t i = 0; i < NODES; i++) assert_memory_equal(&poses[i], &m->nodes[i].rest, sizeof *poses);
  assert_samples_are_poses(m);
  end(m);
}

TEST(an_overriding_layer_takes_what_it_moves) {
  seed = 5;
  mixture *m = begin();
  add(m, layer_of(TW_LAYER_OVERRIDE, &one), 1, 1);
  add(m, layer_of(TW_LAYER_OVERRIDE, &one), 2, 2);
  mix(m);
  tw_trs poses[NODES], alone[2][NODES];
  tw_clip_pose(m->clip, m->nodes, NODES, 0.6F, poses);
  for (int i = 0; i < 2; i++) tw_clip_pose(m->moves[i]->clip, m->nodes, NODES, 0.6F, alone[i]);
  for (uint32_t n = 0; n < NODES; n++)
    assert_memory_equal(&poses[n], &alone[n % 2 ? 0 : 1][n], sizeof *poses);
  assert_samples_are_poses(m);
  end(m);
}

TEST(a_looping_layer_shows_its_end_and_then_begins_again) {
  seed = 6;
  mixture *m = begin();
  add(m, layer_of(TW_LAYER_REPLACE, &one), 7, 4);
  add(m, layer_of(TW_LAYER_REPLACE, &one), 1, 1);
  m->layers[1].loop = TW_REPEAT;
  mix(m);
  assert_true(tw_clip_duration(m->clip) == 4);
  tw_trs poses[NODES], end_pose[NODES], inside[NODES];
  tw_clip_pose(m->moves[1]->clip, m->nodes, NODES, 1, end_pose);
  tw_clip_pose(m->moves[1]->clip, m->nodes, NODES, 0.25F, inside);
  tw_clip_pose(m->clip, m->nodes, NODES, 3, poses);
  assert_memory_equal(&poses[1], &end_pose[1], sizeof *poses);
  tw_clip_pose(m->clip, m->nodes, NODES, 2.25F, poses);
  assert_memory_equal(&poses[1], &inside[1], sizeof *poses);
  end(m);
}

TEST(a_loop_that_plays_backwards_ends_at_its_beginning) {
  seed = 13;
  for (int i = 0; i < 32; i++) { /* of many durations, of which some are rounded up */
    mixture *m = begin();
    add(m, layer_of(TW_LAYER_REPLACE, &one), 1, random_in(0.3, 3));
    m->layers[0].loop = TW_REPEAT, m->layers[0].speed = -random_in(0.3, 2);
    mix(m);
    tw_trs poses[NODES], first[NODES];
    tw_clip_pose(m->moves[0]->clip, m->nodes, NODES, 0, first);
    tw_clip_pose(m->clip, m->nodes, NODES, tw_clip_duration(m->clip), poses);
    for (int k = 0; k < 3; k++)
      assert_true(fabs((double)poses[1].translation[k] - (double)first[1].translation[k]) < 1e-4);
    end(m);
  }
}

TEST(mixed_clips_are_mixed_again_up_to_a_depth) {
  seed = 7;
  mixture *m = begin();
  add(m, layer_of(TW_LAYER_REPLACE, &one), 1, 1.5);
  mix(m);
  tw_clip *outer = m->clip;
  tw_error error = {0};
  for (int depth = 2;; depth++) {
    tw_clip *next = NULL;
    float duration = 1.5F;
    tw_mix_job job = {1, m->layers, &outer, &duration, m->nodes, NODES, NULL};
    tw_status status = tw_clip_mix(&job, &next, &error);
    if (status == TW_LIMIT) {
      assert_int_equal(depth, TW_LAYER_DEPTH_MAX + 1);
      break;
    }
    assert_int_equal(status, TW_OK);
    outer = next;
  }
  tw_trs poses[NODES], alone[NODES];
  tw_clip_pose(outer, m->nodes, NODES, 0.7F, poses);
  tw_clip_pose(m->moves[0]->clip, m->nodes, NODES, 0.7F, alone);
  assert_memory_equal(poses, alone, sizeof poses);
  m->clip = outer;
  assert_true(tw_clip_size(outer) > tw_clip_size(m->moves[0]->clip));
  end(m);
}

/* ---- keys of mixed clips --------------------------------------------------------------------- */

/* Reduces the mixed clip to keys, and returns them compiled. */
static tw_clip *reduced_of(const mixture *m, double degrees, double metres, tw_arena *arena,
                           tw_clip_keys *keys, tw_tolerance *reached) {
  const tw_tolerance tolerance = {degrees * REF_DEGREES, metres};
  uint64_t steps = TW_REDUCTION_STEPS;
  tw_clip *plain = NULL;
  tw_error error = {0};
  if (tw_clip_reduce(m->clip, NULL, tolerance, 1000000, &steps, arena, keys, reached, &error) != TW_OK)
    fail_msg("%s", error.detail);
  assert_int_equal(tw_clip_create(keys, NODES, -1, &plain, NULL), TW_OK);
  return plain;
}

/* The largest differences between the mixed clip and its keys, in radians and metres, at random times that
 * are more than `room` seconds from each of `breaks`. */
static void largest_errors(const mixture *m, const tw_clip *plain, const double *breaks, int break_count,
                           double out[2]) {
  const double room = 2e-4;
  out[0] = out[1] = 0;
  for (int i = 0; i < 4000; i++) {
    double at = random_in(0, (double)tw_clip_duration(m->clip));
    bool is_near = false;
    for (int b = 0; b < break_count; b++) is_near |= fabs(at - breaks[b]) < room;
    if (is_near) continue;
    tw_trs poses[NODES], others[NODES];
    tw_clip_pose(m->clip, m->nodes, NODES, (float)at, poses);
    tw_clip_pose(plain, m->nodes, NODES, (float)at, others);
    for (uint32_t n = 0; n < NODES; n++) {
      out[0] = fmax(out[0], ref_angle(ref_of(poses[n].rotation), ref_of(others[n].rotation)));
      double square = 0;
      for (int k = 0; k < 3; k++)
        square += pow((double)poses[n].translation[k] - (double)others[n].translation[k], 2);
      out[1] = fmax(out[1], sqrt(square));
    }
  }
}

TEST(keys_of_a_mixed_clip_stay_within_the_tolerance) {
  seed = 8;
  static const float times[] = {0.5F, 1.5F}, out_of[] = {1, 0.25F}, some = 0.3F;
  mixture *m = begin();
  add(m, layer_of(TW_LAYER_REPLACE, out_of), 1, 1.1);
  add(m, layer_of(TW_LAYER_REPLACE, &one), 2, 2.3);
  add(m, layer_of(TW_LAYER_ADDITIVE, &some), 3, 2);
  m->layers[0].weight_count = 2, m->layers[0].weight_times = times;
  m->layers[1].speed = 0.8, m->layers[1].offset = -0.2;
  mix(m);
  tw_arena *arena = tw_arena_create();
  tw_clip_keys keys;
  tw_tolerance reached;
  tw_clip *plain = reduced_of(m, 0.1, 1e-3, arena, &keys, &reached);
  double errors[2];
  largest_errors(m, plain, NULL, 0, errors);
  /* Rotations of random keys jump where the sum changes its hemisphere: those are told. */
  assert_true(errors[0] <= reached.angle + 1e-5 && errors[1] <= 1e-3 + 1e-5 && reached.distance <= 1e-3);
  assert_true(tw_clip_duration(plain) == tw_clip_duration(m->clip));
  tw_clip_destroy(plain);
  tw_arena_destroy(arena);
  end(m);
}

/* One node that turns from 0 to 0.6 radians in a second. */
static void add_turn_of(mixture *m, tw_layer layer, tw_interpolation interpolation) {
  moves *made = m->moves[m->count] = calloc(1, sizeof(moves));
  assert_non_null(made);
  for (int k = 0; k < KEYS; k++) {
    made->times[k] = (float)k / (KEYS - 1);
    double half = 0.3 * k / (KEYS - 1);
    float *key = made->rotations[0][k];
    key[0] = key[2] = 0, key[1] = (float)sin(half), key[3] = (float)cos(half);
  }
  made->duration = 1;
  made->tracks[0] = quaternion_keys(interpolation, made->times, made->rotations[0][0], KEYS);
  tw_clip_keys keys = {.track_count = 1, .tracks = made->tracks};
  assert_int_equal(tw_clip_create(&keys, NODES, -1, &made->clip, NULL), TW_OK);
  m->layers[m->count++] = layer;
}

TEST(keys_of_a_layer_reach_its_end_however_its_times_are_rounded) {
  seed = 11;
  for (int i = 0; i < 16; i++) {
    mixture *m = begin();
    add(m, layer_of(TW_LAYER_REPLACE, &one), 1, 1.96);
    m->layers[0].offset = -0.061 * i, m->layers[0].speed = 1 + 0.037 * i;
    mix(m);
    tw_arena *arena = tw_arena_create();
    tw_clip_keys keys;
    tw_tolerance reached;
    tw_clip *plain = reduced_of(m, 0.1, 1e-3, arena, &keys, &reached);
    tw_trs poses[NODES], others[NODES];
    tw_clip_pose(m->clip, m->nodes, NODES, tw_clip_duration(m->clip), poses);
    tw_clip_pose(plain, m->nodes, NODES, tw_clip_duration(m->clip), others);
    for (uint32_t n = 0; n < NODES; n++)
      assert_true(ref_angle(ref_of(poses[n].rotation), ref_of(others[n].rotation)) <=
                  0.1 * REF_DEGREES + 1e-6);
    tw_clip_destroy(plain);
    tw_arena_destroy(arena);
    end(m);
  }
}

/* A clip of these tracks. */
static void add_tracks(mixture *m, tw_layer layer, const tw_track_keys *tracks, uint32_t count) {
  moves *made = m->moves[m->count] = calloc(1, sizeof(moves));
  assert_non_null(made);
  tw_clip_keys keys = {.track_count = count, .tracks = tracks};
  assert_int_equal(tw_clip_create(&keys, NODES, -1, &made->clip, NULL), TW_OK);
  made->duration = tw_clip_duration(made->clip);
  m->layers[m->count++] = layer;
}

TEST(keys_show_the_last_jump_however_its_time_is_rounded) {
  static const float ends[] = {0, 3}, turns[] = {0, 0, 0, 1, 1, 0, 0, 0};
  static const float jumps[] = {0, 0.7F, 1.84F}, steps[] = {0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0};
  tw_track_keys tracks[2] = {quaternion_keys(TW_LINEAR, ends, turns, 2),
                             quaternion_keys(TW_LINEAR, ends, turns, 1)};
  tw_track_keys step = quaternion_keys(TW_STEP, jumps, steps, 3);
  tracks[1].node = step.node = 1;
  for (int i = 0; i < 16; i++) {
    mixture *m = begin();
    add_tracks(m, layer_of(TW_LAYER_REPLACE, &one), tracks, 2);
    add_tracks(m, layer_of(TW_LAYER_ADDITIVE, &one), &step, 1);
    m->layers[1].offset = -0.061 * i, m->layers[1].speed = 1 + 0.037 * i;
    mix(m);
    tw_arena *arena = tw_arena_create();
    tw_clip_keys keys;
    tw_tolerance reached;
    tw_clip *plain = reduced_of(m, 0.1, 1e-3, arena, &keys, &reached);
    tw_trs pose[NODES];
    tw_clip_pose(plain, m->nodes, NODES, 3, pose);
    assert_true(ref_angle(ref_of(pose[1].rotation), (ref_quat){0, 1, 0, 0}) < 1e-6);
    tw_clip_destroy(plain);
    tw_arena_destroy(arena);
    end(m);
  }
}

TEST(keys_of_steps_jump_where_clips_below_clips_do) {
  enum { JUMPS = 24 };
  static float times[JUMPS], turns[JUMPS][4];
  static const float ends[] = {0, 12}, still[] = {0, 0, 0, 1, 0, 0, 0, 1};
  for (int k = 0; k < JUMPS; k++) times[k] = 0.37F * (float)k, turns[k][k % 3] = 1;
  tw_track_keys tracks[2] = {quaternion_keys(TW_LINEAR, ends, still, 2),
                             quaternion_keys(TW_STEP, times, turns[0], JUMPS)};
  tracks[1].node = 1;
  for (int i = 0; i < 16; i++) {
    mixture *inner = begin(), *outer = begin();
    add_tracks(inner, layer_of(TW_LAYER_REPLACE, &one), tracks, 2);
    inner->layers[0].offset = -8 - 0.017 * i, inner->layers[0].speed = 1.7;
    mix(inner);
    outer->moves[0] = calloc(1, sizeof(moves));
    assert_non_null(outer->moves[0]);
    outer->moves[0]->clip = inner->clip, outer->moves[0]->duration = tw_clip_duration(inner->clip);
    outer->layers[outer->count++] = layer_of(TW_LAYER_REPLACE, &one);
    outer->layers[0].offset = 5 + 0.013 * i, outer->layers[0].speed = 0.83;
    mix(outer);
    tw_arena *arena = tw_arena_create();
    tw_clip_keys keys;
    tw_tolerance reached;
    tw_clip *plain = reduced_of(outer, 0.1, 1e-3, arena, &keys, &reached);
    for (int k = 0; k + 1 < JUMPS; k++) { /* between two jumps */
      double local = (0.37 * (k + 0.5) - inner->layers[0].offset) / 1.7,
             at = (local - outer->layers[0].offset) / 0.83;
      tw_trs pose[NODES];
      if (local < 0 || at < 0) continue;
      tw_clip_pose(plain, outer->nodes, NODES, (float)at, pose);
      assert_true(fabs((double)fabsf(pose[1].rotation[k % 3]) - 1) < 1e-6);
    }
    tw_clip_destroy(plain);
    tw_arena_destroy(arena);
    free(inner->moves[0]);
    free(inner);
    end(outer);
  }
}

TEST(keys_of_a_loop_jump_where_it_begins_again) {
  mixture *m = begin();
  add_turn_of(m, layer_of(TW_LAYER_REPLACE, &one), TW_LINEAR);
  add_turn_of(m, layer_of(TW_LAYER_REPLACE, &one), TW_LINEAR);
  m->layers[0].loop = TW_REPEAT, m->layers[0].speed = 4, m->layers[1].speed = 0.25;
  mix(m);
  assert_true(tw_clip_duration(m->clip) == 4);
  tw_arena *arena = tw_arena_create();
  tw_clip_keys keys;
  tw_tolerance reached;
  tw_clip *plain = reduced_of(m, 0.1, 1e-3, arena, &keys, &reached);
  double breaks[16], errors[2];
  for (int i = 0; i < 16; i++) breaks[i] = (i + 1) / 4.0;
  largest_errors(m, plain, breaks, 16, errors);
  assert_true(errors[0] <= 0.1 * REF_DEGREES + 1e-6);
  assert_true(keys.tracks[0].key_count < 200);
  tw_clip_destroy(plain);
  tw_arena_destroy(arena);
  end(m);
}

/* A loop of one second, mixed with a clip that ends between two keys of its second round. */
static void mix_cut_loop(mixture *m) {
  add(m, layer_of(TW_LAYER_REPLACE, &one), 1, 1);
  m->layers[0].loop = TW_REPEAT;
  add(m, layer_of(TW_LAYER_REPLACE, &one), NODES, 1);
  static const float times[] = {0, 1.1F}, tiny[] = {1e-6F, 1e-6F};
  m->layers[1].weight_count = 2, m->layers[1].weight_times = times, m->layers[1].weights = tiny;
  mix(m);
}

/* Holds keys against the mixed clip, except near 1 and `jump`, where its loop begins again. */
static void expect_near_keys(const mixture *m, double jump) {
  tw_arena *arena = tw_arena_create();
  tw_clip_keys keys;
  tw_tolerance reached;
  tw_clip *plain = reduced_of(m, 0.1, 1e-3, arena, &keys, &reached);
  const double breaks[] = {1, jump};
  double errors[2];
  largest_errors(m, plain, breaks, 2, errors);
  assert_true(errors[0] <= 0.1 * REF_DEGREES + 1e-6 && errors[1] <= 1e-3 + 1e-6);
  tw_clip_destroy(plain);
  tw_arena_destroy(arena);
}

TEST(keys_of_a_loop_go_on_until_the_clip_ends) {
  seed = 9;
  mixture *m = begin();
  mix_cut_loop(m);
  assert_true(tw_clip_duration(m->clip) == 1.1F);
  expect_near_keys(m, 1);
  end(m);
}

TEST(keys_of_a_clip_that_ends_in_a_loop_hold_its_ends) {
  seed = 10;
  mixture *inner = begin(), *outer = begin();
  mix_cut_loop(inner);
  outer->moves[0] = calloc(1, sizeof(moves));
  assert_non_null(outer->moves[0]);
  outer->moves[0]->clip = inner->clip, outer->moves[0]->duration = 1.1F;
  outer->layers[outer->count++] = layer_of(TW_LAYER_REPLACE, &one);
  outer->layers[0].offset = -0.3;
  add(outer, layer_of(TW_LAYER_ADDITIVE, &one), 2, 3);
  mix(outer);
  expect_near_keys(outer, 1.3);
  for (uint32_t i = 0; i < inner->count; i++) free(inner->moves[i]);
  free(inner);
  end(outer);
}

TEST(keys_of_a_step_track_are_its_own) {
  for (int form = 0; form < 3; form++) {
    static const float fade[] = {1, 0}, times[] = {0, 1};
    mixture *m = begin();
    add_turn_of(m, layer_of(TW_LAYER_REPLACE, &one), TW_STEP);
    if (form == 1) m->layers[0].speed = 0.7;
    if (form == 2)
      m->layers[0].weight_count = 2, m->layers[0].weights = fade, m->layers[0].weight_times = times;
    mix(m);
    tw_arena *arena = tw_arena_create();
    tw_clip_keys keys;
    tw_tolerance reached;
    tw_clip *plain = reduced_of(m, 0.1, 1e-3, arena, &keys, &reached);
    if (form < 2) assert_true(keys.tracks[0].interpolation == TW_STEP && keys.tracks[0].key_count == KEYS);
    double breaks[KEYS], errors[2];
    for (int k = 0; k < KEYS; k++) breaks[k] = k / (KEYS - 1.0) / m->layers[0].speed;
    largest_errors(m, plain, breaks, KEYS, errors);
    assert_true(errors[0] <= (form < 2 ? 1e-6 : 0.1 * REF_DEGREES + 1e-6));
    tw_clip_destroy(plain);
    tw_arena_destroy(arena);
    end(m);
  }
}

TEST(loops_without_number_are_refused) {
  mixture *m = begin();
  add_turn_of(m, layer_of(TW_LAYER_REPLACE, &one), TW_LINEAR);
  add_turn_of(m, layer_of(TW_LAYER_REPLACE, &one), TW_LINEAR);
  m->layers[0].loop = TW_REPEAT, m->layers[0].speed = 1000, m->layers[1].speed = 1e-6;
  mix(m);
  tw_arena *arena = tw_arena_create();
  tw_clip_keys keys;
  tw_tolerance reached, tolerance = {1e-3, 1e-3};
  uint64_t steps = TW_REDUCTION_STEPS;
  assert_int_equal(tw_clip_reduce(m->clip, NULL, tolerance, 1000000, &steps, arena, &keys, &reached, NULL),
                   TW_LIMIT);
  tw_arena_destroy(arena);
  end(m);
}

TEST(the_error_of_baked_keys_of_a_mixed_clip_is_found) {
  mixture *m = begin();
  add_turn_of(m, layer_of(TW_LAYER_REPLACE, &one), TW_LINEAR);
  add_turn_of(m, layer_of(TW_LAYER_REPLACE, &one), TW_LINEAR);
  m->layers[0].speed = 2;
  mix(m);
  /* Half of 0.6 t and of what stands at 0.6 from half a second on: at 0.5 it is 0.45, between 0 and 1 0.3. */
  static const float times[] = {0, 1};
  tw_arena *arena = tw_arena_create();
  tw_clip_keys baked;
  tw_tolerance reached;
  assert_int_equal(tw_clip_bake(m->clip, times, 2, arena, &baked, NULL), TW_OK);
  assert_int_equal(tw_clip_bake_error(m->clip, &baked, NULL, &reached, NULL), TW_OK);
  assert_true(fabs(reached.angle - 0.15) < 1e-4);
  tw_arena_destroy(arena);
  end(m);
}
