/* The layers of a mixed clip over time. */
#include "mix_time.h"
#include "order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- checking ------------------------------------------------------------------------------------------ */

static const double SPEED_MAX = 1000, TIME_MAX = 1e6;
static const float WEIGHT_MAX = 1e6F;

static tw_status refuse(tw_error *error, const char *member, const char *detail) {
  tw_fail(error, TW_INVALID, "%s", detail);
  return tw_error_at(error, "/%s", member);
}

static tw_status check_weight(const tw_layer *layer, uint32_t key, tw_error *error) {
  float weight = layer->weights[key];
  const char *fault = NULL;
  if (!(fabsf(weight) <= WEIGHT_MAX))
    fault = "a weight is a number of at most 1e6";
  else if (weight < 0 && layer->mode != TW_LAYER_ADDITIVE)
    fault = "only additive layers have weights below 0";
  if (!fault) return TW_OK;
  tw_fail(error, TW_INVALID, "%s", fault);
  return layer->weight_times ? tw_error_at(error, "/weight/values/%u", key) : tw_error_at(error, "/weight");
}

tw_status tw_layer_check(const tw_layer *layer, tw_error *error) {
  if (!(fabs(layer->speed) <= SPEED_MAX)) return refuse(error, "speed", "speed is a number of at most 1000");
  if (layer->is_synced && layer->speed <= 0)
    return refuse(error, "speed", "the speed of a synchronised layer is above 0");
  if (!(fabs(layer->offset) <= TIME_MAX)) return refuse(error, "offset", "offset is at most 1e6 seconds");
  if (!(layer->reference >= 0 && layer->reference <= TIME_MAX))
    return refuse(error, "reference", "reference is a time of 0 to 1e6 seconds");
  if (layer->weight_count == 0) return refuse(error, "weight", "a weight needs a key");
  if (layer->weight_count > TW_LAYER_KEYS_MAX) return refuse(error, "weight", "a weight has too many keys");
  for (uint32_t i = 0; i < layer->weight_count; i++) {
    tw_status status = check_weight(layer, i, error);
    if (status != TW_OK) return status;
    if (!layer->weight_times) continue;
    float time = layer->weight_times[i];
    if (time >= 0 && (double)time <= TIME_MAX && (i == 0 || time > layer->weight_times[i - 1])) continue;
    tw_fail(error, TW_INVALID, "the times of weights are 0 to 1e6 seconds, each after the one before");
    return tw_error_at(error, "/weight/times/%u", i);
  }
  return TW_OK;
}

/* ---- weights ------------------------------------------------------------------------------------------- */

/* A weight from a key to the next one. */
typedef struct weight_ramp {
  double start, end, from, slope;
} weight_ramp;

static weight_ramp ramp_after(const tw_layer *layer, uint32_t key) {
  double start = (double)layer->weight_times[key], end = (double)layer->weight_times[key + 1];
  double from = (double)layer->weights[key], to = (double)layer->weights[key + 1];
  return (weight_ramp){start, end, from, (to - from) / (end - start)};
}

static inline double ramp_at(const weight_ramp *ramp, double time) {
  return ramp->from + ramp->slope * (time - ramp->start);
}

/* The weight outside of the keys, and of a layer with one: true where that is all. */
static bool is_constant_at(const tw_layer *layer, double time, double *weight) {
  uint32_t last = layer->weight_count - 1;
  bool is_before = last == 0 || time <= (double)layer->weight_times[0];
  if (!is_before && time < (double)layer->weight_times[last]) return false;
  *weight = (double)layer->weights[is_before ? 0 : last];
  return true;
}

/* The last key at or before a time between the first key and the last. */
static uint32_t find_key(const tw_layer *layer, double time) {
  uint32_t low = 0, high = layer->weight_count - 1;
  while (high - low > 1) {
    uint32_t middle = low + (high - low) / 2;
    if ((double)layer->weight_times[middle] <= time)
      low = middle;
    else
      high = middle;
  }
  return low;
}

/* The weight at a time. *key: where the search begins, any key but the last; receives the last key at or
 * before the time, so that ascending times are found at once. */
static double weight_near(const tw_layer *layer, double time, uint32_t *key) {
  double weight;
  if (is_constant_at(layer, time, &weight)) return weight;
  if (time < (double)layer->weight_times[*key] || time >= (double)layer->weight_times[*key + 1])
    *key = find_key(layer, time);
  weight_ramp ramp = ramp_after(layer, *key);
  return ramp_at(&ramp, time);
}

/* Whether the layer ever plays. */
static bool plays(const tw_layer *layer) {
  bool does = layer->mode == TW_LAYER_OVERRIDE;
  for (uint32_t i = 0; i < layer->weight_count; i++) does |= layer->weights[i] != 0;
  return does;
}

static double last_weight_time(const tw_layer *layer) {
  return layer->weight_count > 1 ? (double)layer->weight_times[layer->weight_count - 1] : 0;
}

/* ---- the phase ----------------------------------------------------------------------------------------- */

/* The integral of the rate over the x seconds behind a knot where the sum of weights is constant. */
static inline double phase_gained_evenly(const phase_knot *knot, double x) {
  return x * (knot->pace + knot->bend * x * (1.0 / 2));
}

/* The integral of the rate over the x seconds behind a knot. With z = growth x it is
 * x (pace L + bend x K), L = log(1 + z) / z, K = (1 - L) / z. */
static double phase_gained(const phase_knot *knot, double x) {
  if (knot->growth == 0) return phase_gained_evenly(knot, x);
  double z = knot->growth * x, l, k;
  if (z < -1 + 1e-12) z = -1 + 1e-12; /* the weights fade to 0, and the rate's sum with them */
  if (fabs(z) < 1e-3) {
    l = 1 - z * (1.0 / 2 - z * (1.0 / 3 - z * (1.0 / 4 - z / 5)));
    k = 1.0 / 2 - z * (1.0 / 3 - z * (1.0 / 4 - z * (1.0 / 5 - z / 6)));
  } else {
    l = log1p(z) / z;
    k = (1 - l) / z;
  }
  return x * (knot->pace * l + knot->bend * x * k);
}

/* The last knot at or before a time. */
static uint32_t find_knot(const mix_time *mix, double time) {
  uint32_t low = 0, high = mix->knot_count;
  while (high - low > 1) {
    uint32_t middle = low + (high - low) / 2;
    if (mix->knots[middle].time <= time)
      low = middle;
    else
      high = middle;
  }
  return low;
}

static bool do_rise(const float *times, uint32_t count) {
  int falls = 0; /* no bool, of which loops are not vectorised */
  for (uint32_t i = 1; i < count; i++) falls |= times[i] < times[i - 1];
  return !falls;
}

/* The end of the run of times in [start, end) that begins with `first`. rise: none is below one before. */
static uint32_t run_end(const float *times, bool rise, uint32_t first, uint32_t count, double start,
                        double end) {
  if (rise && (double)times[count - 1] < end) return count;
  uint32_t i = first + 1;
  while (i < count && (double)times[i] >= start && (double)times[i] < end) i++;
  return i;
}

/* The phases, of which all those between two knots follow each other in one loop. */
static void fill_phases(const mix_time *mix, mix_moments *at) {
  const float *times = at->times;
  double *phases = at->phases;
  for (uint32_t i = 0; i < at->count;) {
    uint32_t index = find_knot(mix, (double)times[i]);
    const phase_knot knot = mix->knots[index];
    double next = index + 1 < mix->knot_count ? mix->knots[index + 1].time : INFINITY;
    uint32_t end = run_end(times, at->rise, i, at->count, knot.time, next);
    if (knot.growth == 0)
      for (; i < end; i++) phases[i] = knot.phase + phase_gained_evenly(&knot, (double)times[i] - knot.time);
    else
      for (; i < end; i++) phases[i] = knot.phase + phase_gained(&knot, (double)times[i] - knot.time);
  }
}

void tw_mix_moments(const mix_time *mix, const float *times, uint32_t count, mix_moments *out) {
  const float end = (float)mix->duration;
  out->count = count;
  for (uint32_t i = 0; i < count; i++) {
    float time = times[i] < end ? times[i] : end;
    out->times[i] = time > 0 ? time : 0;
  }
  out->rise = do_rise(times, count);
  if (mix->knot_count > 0) fill_phases(mix, out);
}

double tw_mix_phase(const mix_time *mix, double time) {
  if (mix->knot_count == 0) return 0;
  const phase_knot *knot = &mix->knots[find_knot(mix, time)];
  return knot->phase + phase_gained(knot, time - knot->time);
}

/* Whether a layer sets the rate of the phase. */
static bool leads(const mix_time *mix, uint32_t layer, bool has_base) {
  const tw_layer *l = &mix->layers[layer];
  return l->is_synced && mix->durations[layer] > 0 && (l->mode != TW_LAYER_ADDITIVE) == has_base;
}

static bool has_synced_base(const mix_time *mix) {
  bool has_base = false;
  for (uint32_t i = 0; i < mix->layer_count; i++)
    has_base |= mix->layers[i].is_synced && mix->layers[i].mode != TW_LAYER_ADDITIVE;
  return has_base;
}

/* Sums weights, and rates by their weights. Additive layers may have weights below 0. keys: [layers], as in
 * weight_near. */
static void sum_rates(const mix_time *mix, bool has_base, double time, uint32_t *keys, double *weight,
                      double *rate) {
  *weight = *rate = 0;
  for (uint32_t i = 0; i < mix->layer_count; i++) {
    if (!leads(mix, i, has_base)) continue;
    const tw_layer *layer = &mix->layers[i];
    double w = layer->mode == TW_LAYER_OVERRIDE ? 1 : fabs(weight_near(layer, time, &keys[i]));
    *weight += w;
    *rate += w * layer->speed / mix->durations[i];
  }
}

/* The plain mean of the rates, for a time at which all weights are 0. */
static double mean_rate(const mix_time *mix, bool has_base) {
  double sum = 0, count = 0;
  for (uint32_t i = 0; i < mix->layer_count; i++) {
    if (!leads(mix, i, has_base)) continue;
    sum += mix->layers[i].speed / mix->durations[i];
    count++;
  }
  return count > 0 ? sum / count : 0;
}

/* Where weights have the value 0 between two keys of an additive layer, the sums bend: such times count as
 * keys. Fills times, or only counts where it is NULL. */
static uint64_t list_bends(const mix_time *mix, bool has_base, double *times) {
  uint64_t count = 0;
  for (uint32_t i = 0; i < mix->layer_count; i++) {
    const tw_layer *layer = &mix->layers[i];
    if (!leads(mix, i, has_base) || layer->weight_count < 2) continue;
    for (uint32_t k = 0; k < layer->weight_count; k++) {
      if (times) times[count] = (double)layer->weight_times[k];
      count++;
      if (k == 0 || !((layer->weights[k] < 0) ^ (layer->weights[k - 1] < 0))) continue;
      double from = (double)layer->weights[k - 1], to = (double)layer->weights[k];
      double start = (double)layer->weight_times[k - 1], end = (double)layer->weight_times[k];
      if (times) times[count] = start + (end - start) * from / (from - to);
      count++;
    }
  }
  return count;
}

/* Sets a knot's rate by the sums there and their slopes. mean: the rate where all weights are 0. */
static void set_rate(phase_knot *knot, double weight, double rate, double weight_slope, double rate_slope,
                     double mean) {
  if (weight == 0) {
    knot->pace = weight_slope == 0 ? mean : rate_slope / weight_slope;
    return;
  }
  knot->pace = rate / weight;
  knot->bend = rate_slope / weight;
  knot->growth = weight_slope / weight;
}

static bool fill_knots(mix_time *mix, bool has_base, const double *times, uint32_t count) {
  double mean = mean_rate(mix, has_base), phase = 0, weight, rate, next_weight, next_rate;
  uint32_t keys[TW_LAYERS_MAX] = {0};
  sum_rates(mix, has_base, times[0], keys, &weight, &rate);
  for (uint32_t i = 0; i < count; i++) {
    phase_knot *knot = &mix->knots[i];
    *knot = (phase_knot){.time = times[i], .phase = phase};
    double seconds = i + 1 < count ? times[i + 1] - times[i] : 1;
    next_weight = weight, next_rate = rate;
    if (i + 1 < count) sum_rates(mix, has_base, times[i + 1], keys, &next_weight, &next_rate);
    set_rate(knot, weight, rate, (next_weight - weight) / seconds, (next_rate - rate) / seconds, mean);
    if (i + 1 < count) phase += phase_gained(knot, seconds);
    weight = next_weight, rate = next_rate;
    if (!tw_work(4 * (uint64_t)mix->layer_count)) return false;
  }
  return true;
}

static bool make_knots(mix_time *mix, tw_arena *arena) {
  bool has_base = has_synced_base(mix), is_synced = has_base;
  for (uint32_t i = 0; i < mix->layer_count; i++) is_synced |= mix->layers[i].is_synced;
  if (!is_synced) return true;
  uint64_t all = list_bends(mix, has_base, NULL) + 1;
  double *times = all < UINT32_MAX ? tw_alloc((size_t)all, sizeof *times) : NULL;
  if (!times) return false;
  times[0] = 0;
  list_bends(mix, has_base, times + 1);
  bool is_sorted = tw_sort(times, (size_t)all, sizeof *times, tw_order_doubles) == TW_OK;
  uint32_t count = 1;
  for (uint64_t i = 1; i < all && is_sorted; i++)
    if (times[i] > times[count - 1]) times[count++] = times[i];
  mix->knots = is_sorted ? tw_arena_alloc(arena, count, sizeof *mix->knots) : NULL;
  mix->knot_count = mix->knots ? count : 0;
  bool is_filled = mix->knots && fill_knots(mix, has_base, times, count);
  tw_free(times);
  return is_filled;
}

/* ---- local times --------------------------------------------------------------------------------------- */

/* What rounding may add to a whole number of rounds. */
static const double ROUND_SLACK = 1e-6;

/* The part of a round that has been played; the end of a round is 1, not 0. rounds: played so far; last: when
 * this round ends. */
static inline double part_until(double rounds, double last) {
  double part = rounds - last + 1;
  return part < 1 ? part : 1;
}

/* Like the function above, but finds the round, too. *last: the end of some round; receives that of the round
 * found, so that further times in this round need no search. */
static inline double part_of_round(double rounds, double *last) {
  if (rounds <= 0) return rounds - floor(rounds);
  double early = rounds - ROUND_SLACK;
  if (!(early > *last - 1 && early <= *last)) *last = ceil(early);
  return part_until(rounds, *last);
}

/* The same of a clip that plays backwards: its rounds end at its beginning. */
static inline double part_backwards(double rounds) {
  double part = rounds - floor(rounds + ROUND_SLACK);
  return part > 0 ? part : 0;
}

/* The time of a layer's clip within its ends, unless it is clamped there later. last: as in part_of_round. */
static inline double looped(const tw_layer *layer, double time, double duration, double *last) {
  if (layer->loop == TW_CLAMP || (time >= 0 && time <= duration)) return time;
  if (duration <= 0) return 0;
  double rounds = time / duration;
  if (layer->loop == TW_REPEAT)
    return (layer->speed < 0 ? part_backwards(rounds) : part_of_round(rounds, last)) * duration;
  double phase = fmod(fabs(time), 2 * duration);
  return phase > duration ? 2 * duration - phase : phase;
}

layer_state tw_layer_at(const mix_time *mix, uint32_t index, double time, double phase) {
  const tw_layer *layer = &mix->layers[index];
  double duration = mix->durations[index], local, last = 1;
  uint32_t key = 0;
  if (!layer->is_synced)
    local = looped(layer, layer->offset + layer->speed * time, duration, &last);
  else
    local = duration > 0 ? part_of_round(phase + layer->offset / duration, &last) * duration : 0;
  return (layer_state){(float)local, (float)weight_near(layer, time, &key)};
}

/* The weights at many times, of which all those between two keys follow each other in one loop. */
static void fill_weights(const tw_layer *layer, const mix_moments *at, float *restrict weights) {
  const float *times = at->times;
  for (uint32_t i = 0; i < at->count;) {
    double constant;
    if (is_constant_at(layer, (double)times[i], &constant)) {
      weights[i++] = (float)constant;
      continue;
    }
    const weight_ramp ramp = ramp_after(layer, find_key(layer, (double)times[i]));
    uint32_t end = run_end(times, at->rise, i, at->count, ramp.start, ramp.end);
    /* In double precision: just before layers fade out, their mean goes by what is left of the weights. */
    for (; i < end; i++) weights[i] = (float)ramp_at(&ramp, (double)times[i]);
  }
}

/* The times of a synchronised layer, of which all those in one round follow each other in one loop. start:
 * the rounds at phase 0 */
static void fill_rounds(const mix_moments *at, double start, double duration, float *restrict locals) {
  const double *phases = at->phases;
  double last = 1, most = phases[at->count - 1] + start - ROUND_SLACK;
  for (uint32_t i = 0, end; i < at->count;) {
    double rounds = phases[i] + start;
    locals[i++] = (float)(part_of_round(rounds, &last) * duration);
    end = at->rise && rounds > 0 && most <= last ? at->count : i;
    const double round = last; /* has no address, so that it is kept in a register */
    for (; i < end; i++) {
      double local = (phases[i] + start - round + 1) * duration;
      locals[i] = (float)(local < duration ? local : duration);
    }
  }
}

void tw_layer_states(const mix_time *mix, uint32_t index, const mix_moments *at, float *restrict locals,
                     float *restrict weights) {
  const tw_layer *layer = &mix->layers[index];
  double duration = mix->durations[index], offset = layer->offset, speed = layer->speed, last = 1;
  const float *times = at->times;
  uint32_t count = at->count;
  if (layer->is_synced && duration > 0)
    fill_rounds(at, offset / duration, duration, locals);
  else if (layer->is_synced)
    for (uint32_t i = 0; i < count; i++) locals[i] = 0;
  else if (layer->loop == TW_CLAMP)
    for (uint32_t i = 0; i < count; i++) locals[i] = (float)(offset + speed * (double)times[i]);
  else
    for (uint32_t i = 0; i < count; i++)
      locals[i] = (float)looped(layer, offset + speed * (double)times[i], duration, &last);
  if (layer->weight_count == 1)
    for (uint32_t i = 0; i < count; i++) weights[i] = layer->weights[0];
  else
    fill_weights(layer, at, weights);
}

/* The clamped time at which the phase is given, the first one; the duration where it is never reached. */
static double time_of_phase(const mix_time *mix, double phase) {
  uint32_t low_knot = 0, high_knot = mix->knot_count;
  if (high_knot == 0 || tw_mix_phase(mix, mix->duration) <= phase) return mix->duration;
  while (high_knot - low_knot > 1) {
    uint32_t middle = low_knot + (high_knot - low_knot) / 2;
    if (mix->knots[middle].phase < phase)
      low_knot = middle;
    else
      high_knot = middle;
  }
  const phase_knot *knot = &mix->knots[low_knot];
  double end = high_knot < mix->knot_count ? mix->knots[high_knot].time : mix->duration;
  double gained = phase - knot->phase, low = 0, high = fmax(end - knot->time, 0);
  if (knot->growth == 0 && knot->bend == 0 && knot->pace > 0)
    return knot->time + fmin(fmax(gained / knot->pace, 0), high);
  for (int i = 0; i < 60 && high - low > 1e-12 * (1 + end); i++) {
    double middle = low + (high - low) / 2;
    if (phase_gained(knot, middle) < gained)
      low = middle;
    else
      high = middle;
  }
  return knot->time + high;
}

/* ---- from a clip's times back -------------------------------------------------------------------------- */

/* Takes the times at which a looping layer has played `rounds` rounds, or that and a multiple of `step`. */
static bool take_rounds(const mix_time *mix, uint32_t index, double rounds, double step,
                        const tw_bend_sink *sink) {
  enum { SYNCED_STEPS = 32 }; /* the phase is searched for */
  const tw_layer *layer = &mix->layers[index];
  double duration = mix->durations[index], first = layer->offset / duration, last;
  if (layer->is_synced)
    last = first + tw_mix_phase(mix, mix->duration);
  else
    last = (layer->offset + layer->speed * mix->duration) / duration;
  double low = fmin(first, last), high = fmax(first, last);
  for (double k = ceil((low - rounds) / step - ROUND_SLACK); rounds + k * step <= high + ROUND_SLACK; k++) {
    double way = rounds + k * step - first;
    double time = layer->is_synced ? time_of_phase(mix, way) : way * duration / layer->speed;
    if (!bend_put(sink, time, layer->is_synced ? SYNCED_STEPS : 1)) return false;
    if (low + k * step == low + (k + 1) * step) break; /* rounds beyond what doubles count */
  }
  return true;
}

bool tw_layer_times(const mix_time *mix, uint32_t index, double local, const tw_bend_sink *sink) {
  const tw_layer *layer = &mix->layers[index];
  double duration = mix->durations[index];
  if (!layer->is_synced && layer->speed == 0) return true;
  if (!layer->is_synced && layer->loop == TW_CLAMP)
    return bend_put(sink, (local - layer->offset) / layer->speed, 1);
  if (!(duration > 0)) return true;
  if (layer->is_synced || layer->loop == TW_REPEAT) return take_rounds(mix, index, local / duration, 1, sink);
  return take_rounds(mix, index, local / duration, 2, sink) &&
         take_rounds(mix, index, -local / duration, 2, sink);
}

/* A time and those just beside it. after: seconds. */
static bool take_break(double time, double after, const tw_bend_sink *sink) {
  return bend_put(sink, (double)nextafterf((float)time, -1), 1) && bend_put(sink, time, 1) &&
         bend_put(sink, fmax(time + after, (double)nextafterf((float)time, INFINITY)), 1);
}

/* What take_wrap needs. */
typedef struct wrap {
  const tw_bend_sink *sink;
  double slack; /* seconds for which the end of a round still shows the clip's end */
} wrap;

static bool take_wrap(void *context, double time) {
  const wrap *w = context;
  return take_break(time, w->slack, w->sink);
}

bool tw_layer_bends(const mix_time *mix, uint32_t index, const tw_bend_sink *sink) {
  const tw_layer *layer = &mix->layers[index];
  double duration = mix->durations[index];
  for (uint32_t i = 0; layer->weight_count > 1 && i < layer->weight_count; i++)
    if (!take_break((double)layer->weight_times[i], 0, sink)) return false;
  for (uint32_t i = 0; layer->is_synced && i < mix->knot_count; i++)
    if (!bend_put(sink, mix->knots[i].time, 1)) return false;
  /* Before its beginning and behind its end the mixed clip holds what a layer shows, even midway. Layers that
   * do not loop have come to their ends by then. */
  bool loops = layer->is_synced || (layer->loop != TW_CLAMP && layer->speed != 0);
  if (!bend_put(sink, 0, 1) || (loops && !bend_put(sink, mix->duration, 1))) return false;
  bool wraps = layer->is_synced || (layer->loop == TW_REPEAT && layer->speed != 0);
  if (!wraps || !(duration > 0)) return true;
  double pace = fmax(fabs(layer->speed), 1e-3);
  wrap w = {sink, 2 * ROUND_SLACK * duration / pace};
  const tw_bend_sink wraps_sink = {take_wrap, &w, sink->left};
  return take_rounds(mix, index, 0, 1, &wraps_sink);
}

/* ---- the duration -------------------------------------------------------------------------------------- */

/* Seconds from the start until a layer has come to its end. */
static double length_of(const tw_layer *layer, double duration) {
  double speed = fabs(layer->speed);
  if (speed == 0) return 0;
  if (layer->loop != TW_CLAMP) return (layer->loop == TW_PINGPONG ? 2 : 1) * duration / speed;
  double way = layer->speed > 0 ? duration - layer->offset : layer->offset;
  return way > 0 ? way / speed : 0;
}

/* The first time with a whole phase from the last knot on, where weights are constant. */
static double round_end(const mix_time *mix) {
  const phase_knot *last = &mix->knots[mix->knot_count - 1];
  double rounds = ceil(last->phase - ROUND_SLACK);
  if (!(last->pace > 0)) return last->time;
  if (rounds < 1) rounds = 1;
  double end = last->time + (rounds - last->phase) / last->pace;
  return end > last->time ? end : last->time;
}

static void find_duration(mix_time *mix) {
  bool is_synced = false;
  for (uint32_t i = 0; i < mix->layer_count; i++) {
    const tw_layer *layer = &mix->layers[i];
    if (!plays(layer)) continue;
    double length = layer->is_synced ? 0 : length_of(layer, mix->durations[i]);
    is_synced |= layer->is_synced;
    mix->duration = fmax(mix->duration, fmax(length, last_weight_time(layer)));
  }
  if (is_synced) mix->duration = fmax(mix->duration, round_end(mix));
  mix->duration = (double)(float)fmin(mix->duration, 1e9);
}

bool tw_mix_time_init(mix_time *mix, tw_arena *arena, const tw_layer *layers, uint32_t layer_count,
                      const float *durations) {
  *mix = (mix_time){.layer_count = layer_count};
  mix->layers = tw_arena_alloc(arena, layer_count, sizeof *mix->layers);
  mix->durations = tw_arena_alloc(arena, layer_count, sizeof *mix->durations);
  if (!mix->layers || !mix->durations) return false;
  for (uint32_t i = 0; i < layer_count; i++) {
    tw_layer *layer = &mix->layers[i];
    *layer = layers[i];
    mix->durations[i] = (double)durations[i];
    float *weights = tw_arena_alloc_raw(arena, layer->weight_count, sizeof *weights);
    float *times = tw_arena_alloc_raw(arena, layer->weight_count, sizeof *times);
    if (!weights || !times) return false;
    memcpy(weights, layers[i].weights, layer->weight_count * sizeof *weights);
    if (layers[i].weight_times) memcpy(times, layers[i].weight_times, layer->weight_count * sizeof *times);
    layer->weights = weights;
    layer->weight_times = layers[i].weight_times ? times : NULL;
  }
  if (!make_knots(mix, arena)) return false;
  find_duration(mix);
  return true;
}

tw_status tw_mix_duration(const tw_layer *layers, const float *durations, uint32_t layer_count, float *out,
                          tw_error *error) {
  tw_arena *arena = tw_arena_create();
  mix_time mix;
  bool is_whole = arena && tw_mix_time_init(&mix, arena, layers, layer_count, durations);
  if (is_whole) *out = (float)mix.duration;
  tw_arena_destroy(arena);
  return is_whole ? TW_OK : tw_fail(error, TW_NO_MEMORY, "no memory for a mixed clip");
}
