/* Reduces clips to few LINEAR keys within a tolerance, and measures the error of keys at given times.
 *
 * A track is first sampled on a grid: at its keys where it is LINEAR already, else in steps so short that
 * each step's chord strays from the path by less than a sixteenth of the tolerance. From each chosen key, the
 * next one is the farthest grid place whose chord stays near the path. Then every chord is measured again,
 * densely, between the keys as they will be written; a chord that fails is halved.
 *
 * Between two keys that are 180 degrees apart, rounding decides which way a player turns. So no chord of
 * rotations turns by nearly as much. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "angle.h"
#include "clip.h"
#include "order.h"
#include "parallel_for.h"

enum {
  STEPS_LEAST = 2,       /* fewest grid steps of a segment that is not LINEAR */
  GRID_PLACES = 64,      /* most grid places, for each key allowed */
  CLIP_PLACES = 1 << 20, /* most steps of a bake's error beside its own */
  OWN_PLACES = 64,       /* grid places for each key of the clip, whatever other clips took */
  SAMPLE_WORK = 32,      /* steps of work in a sample and its distance from a chord */
  PARTS_MEASURED = 4,    /* of each grid step */
  REFINEMENTS = 24,
  CHORDS_REFINED = 256, /* chords of keys at given times whose error is found exactly, not to a sixteenth */
  STEPS_A_BEND = 64,    /* that finding one may take */
  CHORDS_A_STEP = 1024  /* between two questions whether the result is still wanted */
};

static const double STEP_ANGLE = TW_PI / 18;
static const double CHORD_ANGLE = 2.7;     /* the most between two keys: 154.7 degrees */
static const double HALF_TURN_ROOM = 1e-6; /* of half the angle; below it rounding decides the way */
static const double GRID_MARGIN = 16;      /* chords of the grid stray by less than tolerance / GRID_MARGIN */
static const double FLOAT_ROOM = 4e-7;     /* rounding to single precision, relative to the largest value */

/* A growing list of ascending times and the values there. */
typedef struct samples {
  float *times, *values; /* [room], [room][width], of which `count` are used */
  uint32_t count, room, most;
  const char *name; /* what the elements are called in errors */
} samples;

/* The track being reduced. */
typedef struct reduction {
  const tw_clip *clip;
  uint32_t index, width;
  bool rotation;
  uint32_t time_count; /* the path is smooth between these times: its keys, or bends */
  float *own_times;    /* [time_count] bends; NULL: of a track with keys */
  const float *times;  /* [time_count] */
  double tolerance, reached;
  samples grid, keys;
  float *sample, *ends; /* scratch: [width], [2][width] */
} reduction;

static void reduction_deinit(reduction *r) {
  tw_free(r->own_times);
  tw_free(r->grid.times);
  tw_free(r->grid.values);
  tw_free(r->keys.times);
  tw_free(r->keys.values);
  tw_free(r->sample);
  tw_free(r->ends);
}

static tw_status widen(samples *list, uint32_t width, tw_error *error) {
  uint32_t room = list->room > list->most / 2 ? list->most : list->room * 2;
  if (room < 256) room = list->most < 256 ? list->most : 256;
  if (list->count >= room)
    return tw_fail(error, TW_LIMIT, "the clip needs more than %u %s at this tolerance", list->most,
                   list->name);
  size_t row = width * sizeof(float);
  float *times = room <= SIZE_MAX / row ? tw_resize(list->times, room * sizeof *times) : NULL;
  if (times) list->times = times;
  float *values = times ? tw_resize(list->values, room * row) : NULL;
  if (!values) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
  list->values = values;
  list->room = room;
  return TW_OK;
}

static uint64_t sample_work(const reduction *r) {
  return (uint64_t)SAMPLE_WORK * r->clip->cost;
}

/* Adds a time and the track's value there. */
static tw_status append(const reduction *r, samples *list, float time, tw_error *error) {
  tw_status status = list->count < list->room ? TW_OK : widen(list, r->width, error);
  if (status != TW_OK) return status;
  if (!tw_work(sample_work(r))) return tw_work_status(error);
  list->times[list->count] = time;
  tw_clip_sample(r->clip, r->index, &time, 1, list->values + (size_t)list->count * r->width);
  list->count++;
  return TW_OK;
}

/* ---- errors of chords ---------------------------------------------------------------------------------- */

/* The path that a player takes between two keys: slerp or a straight line. */
typedef struct chord {
  double start, seconds;
  const float *from, *to;
  tw_arc arc; /* for rotations */
} chord;

static chord chord_between(const reduction *r, float start, const float *from, float end, const float *to) {
  chord chord = {.start = (double)start, .seconds = (double)end - (double)start, .from = from, .to = to};
  if (!r->rotation) return chord;
  double a[4], b[4];
  quat_widen(from, a);
  quat_widen(to, b);
  tw_normalize(a, 4);
  tw_normalize(b, 4);
  chord.arc = tw_arc_short(a, b);
  return chord;
}

static bool is_short(const chord *chord) {
  return 2 * chord->arc.angle <= CHORD_ANGLE;
}

/* The distance between a chord and a sample of the path at a time. */
static double stray(const reduction *r, const chord *chord, float time, const float *sample) {
  double u = ((double)time - chord->start) / chord->seconds;
  if (r->rotation) {
    double at[4], q[4];
    tw_arc_at(&chord->arc, u, at);
    quat_widen(sample, q);
    return tw_angle_between(at, q);
  }
  double sum = 0;
  for (uint32_t i = 0; i < r->width; i++) {
    double from = (double)chord->from[i], at = from + u * ((double)chord->to[i] - from);
    sum += ((double)sample[i] - at) * ((double)sample[i] - at);
  }
  return sqrt(sum);
}

static double stray_at(const reduction *r, const chord *chord, float time) {
  tw_clip_sample(r->clip, r->index, &time, 1, r->sample);
  return stray(r, chord, time, r->sample);
}

/* ---- the grid ------------------------------------------------------------------------------------------ */

/* Adds a place unless single precision cannot tell it from the last one. */
static tw_status add_place(reduction *r, float time, tw_error *error) {
  const samples *grid = &r->grid;
  return grid->count > 0 && !(time > grid->times[grid->count - 1]) ? TW_OK : append(r, &r->grid, time, error);
}

/* Seconds of a segment. */
static double seconds_of(const reduction *r, uint32_t segment) {
  return (double)r->times[segment + 1] - (double)r->times[segment];
}

/* The time at `step` of `steps` equal steps of a segment. */
static float step_time(const reduction *r, uint32_t segment, double step, uint32_t steps) {
  return (float)((double)r->times[segment] + step / steps * seconds_of(r, segment));
}

/* Whether the path between two keys is their chord. */
static bool is_linear(const tw_track *track) {
  return track->kind == TRACK_ARC || track->kind == TRACK_VALUES_LINEAR;
}

/* Cuts a segment into `steps` equal steps. Returns the largest stray of their chords, each measured in its
 * middle. *turn: the largest angle of a step. */
static double largest_stray(const reduction *r, uint32_t segment, uint32_t steps, double *turn) {
  double largest = 0;
  float start = r->times[segment], *from = r->ends, *to = r->ends + r->width;
  *turn = 0;
  tw_clip_sample(r->clip, r->index, &start, 1, from);
  for (uint32_t i = 1; i <= steps && tw_work(3 * sample_work(r)); i++) {
    float end = step_time(r, segment, i, steps);
    if (!(end > start)) continue;
    tw_clip_sample(r->clip, r->index, &end, 1, to);
    chord chord = chord_between(r, start, from, end, to);
    largest = fmax(largest, stray_at(r, &chord, step_time(r, segment, i - 0.5, steps)));
    if (r->rotation) *turn = fmax(*turn, 2 * chord.arc.angle);
    memcpy(from, to, r->width * sizeof *from);
    start = end;
  }
  return largest;
}

/* Steps of a segment in which the path bends little, whatever the tolerance. */
static double count_steps(const reduction *r, uint32_t segment) {
  const tw_track *track = &r->clip->tracks[r->index];
  if (track->kind == TRACK_MADE) return STEPS_LEAST;
  double travel = r->rotation ? tw_track_travel(track, segment) : 0;
  if (is_linear(track)) return fmax(1, ceil(travel / CHORD_ANGLE));
  return fmax(STEPS_LEAST, ceil(travel / STEP_ANGLE));
}

static tw_status add_steps(reduction *r, uint32_t segment, uint32_t steps, tw_error *error) {
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < steps && status == TW_OK; i++)
    status = add_place(r, step_time(r, segment, i, steps), error);
  return status;
}

static tw_status lay_segment(reduction *r, uint32_t segment, tw_error *error) {
  double steps = count_steps(r, segment), turn = 0;
  if (!is_linear(&r->clip->tracks[r->index])) {
    /* A chord's error is proportional to the square of its length. */
    double strays = steps < r->grid.most ? largest_stray(r, segment, (uint32_t)steps, &turn) : 0;
    double more = ceil(sqrt(GRID_MARGIN * strays / r->tolerance));
    if (r->own_times && strays > 0) more = fmax(more, ceil(turn / STEP_ANGLE));
    steps *= fmax(1, more);
  }
  if (steps >= r->grid.most)
    return tw_fail(error, TW_LIMIT, "a track turns too often to be followed at this tolerance");
  return add_steps(r, segment, (uint32_t)steps, error);
}

static tw_status lay_grid(reduction *r, tw_error *error) {
  uint32_t last = r->time_count - 1;
  for (uint32_t segment = 0; segment < last; segment++) {
    tw_status status = lay_segment(r, segment, error);
    if (status != TW_OK) return status;
  }
  return add_place(r, r->times[last], error);
}

/* ---- choosing keys ------------------------------------------------------------------------------------- */

static const float *grid_value(const reduction *r, uint32_t place) {
  return r->grid.values + (size_t)place * r->width;
}

/* Whether the chord stays near the places after `from` and before `to`. */
static bool is_near(const reduction *r, const chord *chord, uint32_t from, uint32_t to) {
  double allowed = r->tolerance * (1 - 1 / GRID_MARGIN);
  for (uint32_t i = from + 1; i < to; i++)
    if (stray(r, chord, r->grid.times[i], grid_value(r, i)) > allowed) return false;
  return true;
}

static bool chord_holds(const reduction *r, uint32_t from, uint32_t to) {
  chord chord =
      chord_between(r, r->grid.times[from], grid_value(r, from), r->grid.times[to], grid_value(r, to));
  return tw_work((uint64_t)SAMPLE_WORK * (to - from)) && is_short(&chord) && is_near(r, &chord, from, to);
}

/* The farthest grid place that a chord reaches, found by doubling strides, then bisection. Shorter chords may
 * fail, but the one returned holds. */
static uint32_t farthest(const reduction *r, uint32_t from) {
  uint32_t last = r->grid.count - 1, good = from + 1, stride = 1, bad = last + 1;
  while (good < last) {
    uint32_t next = last - good > stride ? good + stride : last;
    if (!chord_holds(r, from, next)) {
      bad = next;
      break;
    }
    good = next;
    stride *= 2;
  }
  while (bad - good > 1) {
    uint32_t middle = good + (bad - good) / 2;
    if (chord_holds(r, from, middle))
      good = middle;
    else
      bad = middle;
  }
  return good;
}

/* The largest stray of a chord between two times, by golden section. */
static double worst_near(const reduction *r, const chord *chord, double low, double high) {
  static const double GOLDEN = 0.61803398874989485;
  double worst = 0;
  for (int i = 0; i < REFINEMENTS && tw_work(2 * sample_work(r)); i++) {
    double left = high - GOLDEN * (high - low), right = low + GOLDEN * (high - low);
    double at_left = stray_at(r, chord, (float)left), at_right = stray_at(r, chord, (float)right);
    worst = fmax(worst, fmax(at_left, at_right));
    if (at_left > at_right)
      high = right;
    else
      low = left;
  }
  return worst;
}

/* The largest error of a chord up to its end: at several places of each grid step on its way, then about the
 * worst of them if that is more than `least` and at most `most`. place: the first one of the grid after the
 * chord's start. */
static double measure(const reduction *r, const chord *chord, float end, uint32_t place, double least,
                      double most) {
  double worst = 0, low = 0, high = 0, last = chord->start, stop = (double)end;
  bool is_worst = false; /* the last place */
  while (last < stop && tw_work(PARTS_MEASURED * sample_work(r))) {
    bool is_inside = place < r->grid.count && r->grid.times[place] < end;
    double from = last, to = is_inside ? (double)r->grid.times[place++] : stop;
    for (int i = 1; i <= PARTS_MEASURED; i++) {
      double at = i < PARTS_MEASURED ? from + (to - from) * i / PARTS_MEASURED : to;
      double error = stray_at(r, chord, (float)at);
      if (is_worst) high = at;
      is_worst = error > worst;
      if (is_worst) {
        worst = error;
        low = last;
      }
      last = at;
    }
  }
  return worst > least && worst <= most ? fmax(worst, worst_near(r, chord, low, high)) : worst;
}

/* The same of the chord from the last key to a time. A chord near half a turn may stray by as much. */
static double measure_to(const reduction *r, float end, uint32_t place, double most) {
  size_t last = r->keys.count - 1;
  tw_clip_sample(r->clip, r->index, &end, 1, r->ends);
  chord chord = chord_between(r, r->keys.times[last], r->keys.values + last * r->width, end, r->ends);
  return is_short(&chord) ? measure(r, &chord, end, place, 0, most) : TW_PI;
}

/* Adds the key at grid place `to`, after the one at `from`. Where the chord to it strays too far, first adds
 * keys half way. */
static tw_status reach(reduction *r, uint32_t from, uint32_t to, tw_error *error) {
  tw_status status = TW_OK;
  uint32_t place = from;
  float start = r->grid.times[from], goal = r->grid.times[to];
  while (status == TW_OK && start < goal) {
    float end = goal;
    while (r->grid.times[place] <= start) place++;
    double strays = measure_to(r, end, place, r->tolerance);
    while (strays > r->tolerance) {
      float middle = (float)((double)start + ((double)end - (double)start) / 2);
      bool is_between = middle > start && middle < end; /* else no float is: the chord stays */
      if (is_between) end = middle;
      strays = measure_to(r, end, place, is_between ? r->tolerance : INFINITY);
      if (!is_between) break;
    }
    r->reached = fmax(r->reached, strays);
    status = append(r, &r->keys, end, error);
    start = end;
  }
  return status;
}

/* Whether the path stays near its first place, so that one key is enough. */
static bool stays(reduction *r) {
  uint32_t count = r->grid.count;
  float start = r->grid.times[0], end = r->grid.times[count - 1];
  chord still = chord_between(r, start, grid_value(r, 0), end, grid_value(r, 0));
  if (!is_near(r, &still, 0, count)) return false;
  double strays = measure(r, &still, end, 1, 0, r->tolerance);
  if (strays <= r->tolerance) r->reached = strays;
  return strays <= r->tolerance;
}

static tw_status choose_keys(reduction *r, tw_error *error) {
  tw_status status = append(r, &r->keys, r->grid.times[0], error);
  bool gives_duration = r->grid.times[r->grid.count - 1] == r->clip->duration;
  if (!gives_duration && stays(r)) return status;
  for (uint32_t place = 0; status == TW_OK && place + 1 < r->grid.count;) {
    uint32_t next = farthest(r, place);
    status = reach(r, place, next, error);
    place = next;
  }
  return status;
}

/* ---- clips --------------------------------------------------------------------------------------------- */

/* The track's tolerance; for values at least what single precision resolves, for rotations at most
 * CHORD_ANGLE. */
static double effective_tolerance(const reduction *r, tw_tolerance tolerance) {
  if (r->rotation) return fmin(tolerance.angle, CHORD_ANGLE);
  float largest = 0;
  for (uint32_t i = 0; i < r->time_count && tw_work(sample_work(r)); i++) {
    tw_clip_sample(r->clip, r->index, &r->times[i], 1, r->sample);
    for (uint32_t i = 0; i < r->width; i++) largest = fmaxf(largest, fabsf(r->sample[i]));
  }
  return fmax(tolerance.distance, FLOAT_ROOM * (double)largest);
}

/* Copies the chosen keys to the arena. */
static tw_status deliver(const reduction *r, tw_arena *arena, tw_track_keys *out, tw_error *error) {
  const samples *keys = &r->keys;
  float *times = tw_arena_alloc(arena, keys->count, sizeof *times);
  float *values = tw_arena_alloc(arena, (size_t)keys->count * r->width, sizeof *values);
  if (!times || !values) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
  memcpy(times, keys->times, keys->count * sizeof *times);
  memcpy(values, keys->values, (size_t)keys->count * r->width * sizeof *values);
  *out = tw_track_as_keys(&r->clip->tracks[r->index], times, values, keys->count);
  return TW_OK;
}

/* Of a clip that is made of others a place takes as many steps as there are clips to ask. */
static uint32_t grid_most(const tw_clip *clip, uint32_t max_keys, uint64_t places) {
  uint64_t most = (uint64_t)max_keys * GRID_PLACES;
  places /= clip->cost;
  if (places < most) most = places;
  return most < UINT32_MAX ? (uint32_t)most : UINT32_MAX;
}

static void spend(const tw_clip *clip, uint64_t count, uint64_t *places) {
  uint64_t steps = count * clip->cost;
  *places -= steps < *places ? steps : *places;
}

static uint64_t count_keys(const tw_clip *clip) {
  uint64_t keys = 0;
  for (uint32_t i = 0; i < clip->part_count; i++) keys += count_keys(clip->parts[i]);
  for (uint32_t i = 0; !clip->kind && i < clip->track_count; i++) keys += clip->tracks[i].timeline->key_count;
  return keys;
}

/* ---- bends of tracks without keys -----------------------------------------------------------------------
 */

/* A growing list of times, in any order. */
typedef struct bends {
  float *times;
  uint32_t count, room, most;
  float end; /* of the clip */
  bool has_end;
  bool is_doubled; /* each time is followed by the next float: there a value that jumps has changed */
  bool is_full;
} bends;

static bool add_bend(bends *list, float time) {
  if (list->count == list->room) {
    uint32_t room = list->room > list->most / 2 || list->most < 64 ? list->most
                    : list->room                                   ? list->room * 2
                                                                   : 64;
    float *times = room > list->room ? tw_resize(list->times, room * sizeof *times) : NULL;
    list->is_full = room == list->room;
    if (!times) return false;
    list->times = times;
    list->room = room;
  }
  list->times[list->count++] = time;
  return tw_work(SAMPLE_WORK);
}

/* What bends behind the clip's end, if only by rounding, still moves there. */
static bool take_bend(void *context, double time) {
  bends *list = context;
  bool is_end = time >= (double)list->end;
  if (!(time >= 0) || (is_end && list->has_end)) return true;
  if (is_end) time = (double)list->end, list->has_end = true;
  float at = (float)time;
  return add_bend(list, at) && (!list->is_doubled || add_bend(list, nextafterf(at, INFINITY)));
}

/* Replaces bends that are too many by as many equal steps. */
static void step_evenly(bends *list) {
  for (uint32_t i = 0; i < list->count; i++)
    list->times[i] = (float)((double)list->end * i / (list->count - 1));
}

/* Whether the clip's end shows something else than the last bend, as after a jump that comes a rounding
 * later. */
static bool changes_after(const reduction *r, const bends *list) {
  float times[] = {0, list->end};
  for (uint32_t i = 0; i < list->count; i++) times[0] = fmaxf(times[0], list->times[i]);
  tw_clip_sample(r->clip, r->index, times, 2, r->ends);
  return memcmp(r->ends, r->ends + r->width, r->width * sizeof *r->ends) != 0;
}

/* Finds the bends of a track, with the clip's end where no other track tells it: that is the first one's.
 * may_skip: more than `most` of them are replaced by equal steps. */
static tw_status find_bends(reduction *r, uint32_t most, bool may_skip, tw_error *error) {
  const tw_track *track = &r->clip->tracks[r->index];
  bends list = {.most = most, .end = r->clip->duration, .is_doubled = track->holds};
  uint64_t left = (uint64_t)STEPS_A_BEND * most;
  const tw_bend_sink sink = {take_bend, &list, &left};
  bool is_whole = add_bend(&list, 0) && (r->index > 0 || add_bend(&list, list.end)) &&
                  tw_clip_bends(r->clip, r->index, &sink) &&
                  (!changes_after(r, &list) || add_bend(&list, list.end));
  r->own_times = list.times;
  if (!is_whole && !list.is_full && left > STEPS_A_BEND) {
    tw_status status = tw_work_status(error);
    return status != TW_OK ? status : tw_fail(error, TW_NO_MEMORY, "no memory for the bends of a track");
  }
  if (!is_whole && !may_skip)
    return tw_fail(error, TW_LIMIT, "the clip bends more than %u %s", most, tw_plural(most, "time", "times"));
  if (!is_whole && list.count > 1) step_evenly(&list);
  tw_status sorted = tw_sort(list.times, list.count, sizeof *list.times, tw_order_floats);
  if (sorted != TW_OK) return tw_fail(error, sorted, "the bends of a track cannot be sorted");
  uint32_t count = 1;
  for (uint32_t i = 1; i < list.count; i++)
    if (list.times[i] > list.times[count - 1] && list.times[i] <= list.end)
      list.times[count++] = list.times[i];
  r->times = list.times;
  r->time_count = count;
  return TW_OK;
}

/* ---- tracks -------------------------------------------------------------------------------------------- */

/* Begins with an empty grid of at most grid_most places. may_skip: as in find_bends. To be deinited even
 * where this fails. */
static tw_status reduction_init(reduction *r, const tw_clip *clip, uint32_t index, uint32_t grid_most,
                                bool may_skip, tw_error *error) {
  const tw_track *track = &clip->tracks[index];
  *r = (reduction){.clip = clip,
                   .index = index,
                   .width = track->width,
                   .rotation = track->path == TW_ROTATION,
                   .grid = {.most = grid_most, .name = "steps"},
                   .sample = tw_alloc(track->width, sizeof *r->sample),
                   .ends = tw_alloc(track->width, 2 * sizeof *r->ends)};
  if (!r->sample || !r->ends) return tw_fail(error, TW_NO_MEMORY, "no memory for the keys of a track");
  if (track->kind == TRACK_MADE) {
    uint32_t most = CLIP_PLACES / clip->cost / (may_skip ? STEPS_LEAST * PARTS_MEASURED : 1);
    return find_bends(r, grid_most < most ? grid_most : most, may_skip, error);
  }
  r->times = track->timeline->times;
  r->time_count = track->timeline->key_count;
  return TW_OK;
}

/* places: how many are left for this track and those after it. */
static tw_status reduce_track(const tw_clip *clip, uint32_t index, tw_tolerance tolerance, uint32_t max_keys,
                              uint64_t *places, tw_arena *arena, tw_track_keys *out, double *reached,
                              tw_error *error) {
  reduction r;
  tw_status status = reduction_init(&r, clip, index, grid_most(clip, max_keys, *places), false, error);
  r.keys = (samples){.most = max_keys, .name = "keys"};
  if (status == TW_OK) {
    r.tolerance = effective_tolerance(&r, tolerance);
    status = lay_grid(&r, error);
  }
  if (status == TW_OK) status = choose_keys(&r, error);
  if (status == TW_OK) status = deliver(&r, arena, out, error);
  *reached = fmax(*reached, r.reached);
  spend(clip, r.grid.count, places);
  reduction_deinit(&r);
  return status;
}

/* ---- keys at given times -------------------------------------------------------------------- */

/* The error between a key and the next one; within one step of a LINEAR track there is none. place: as in
 * measure. */
static double measure_step(const reduction *r, const tw_track_keys *keys, uint32_t key, uint32_t place,
                           double least) {
  float start = keys->times[key], end = keys->times[key + 1];
  bool bends = place < r->grid.count && r->grid.times[place] < end;
  if (is_linear(&r->clip->tracks[r->index]) && !bends) return 0;
  const float *from = keys->values + (size_t)key * r->width;
  chord chord = chord_between(r, start, from, end, from + r->width);
  if (r->rotation && chord.arc.angle > TW_PI / 2 - HALF_TURN_ROOM) return TW_PI;
  return measure(r, &chord, end, place, least, INFINITY);
}

/* Adds steps of a segment for measuring, of which each is measured at several places. */
static tw_status lay_coarse(reduction *r, uint32_t key, double most, tw_error *error) {
  const tw_track *track = &r->clip->tracks[r->index];
  double steps = count_steps(r, key);
  if (!is_linear(track)) steps = fmax(STEPS_LEAST, ceil(steps / PARTS_MEASURED));
  return add_steps(r, key, (uint32_t)fmin(steps, most), error);
}

/* Measures a track against its keys at given times. */
static tw_status measure_track(reduction *r, const tw_track_keys *keys, double steps_most,
                               const tw_parallel_for *parallel, tw_error *error) {
  uint32_t last = r->time_count - 1, place = 0, refined = 0;
  tw_status status = TW_OK;
  for (uint32_t key = 0; key < last && status == TW_OK; key++) status = lay_coarse(r, key, steps_most, error);
  if (status == TW_OK) status = add_place(r, r->times[last], error);
  for (uint32_t key = 0; key + 1 < keys->key_count && status == TW_OK; key++) {
    if (key % CHORDS_A_STEP == 0 && tw_parallel_for_status(parallel) != TW_OK)
      return tw_fail(error, TW_CANCELLED, "the error of the keys is not wanted any more");
    while (place < r->grid.count && r->grid.times[place] <= keys->times[key]) place++;
    double least = refined < CHORDS_REFINED ? r->reached * (1 - 1 / GRID_MARGIN) : r->reached;
    double strays = measure_step(r, keys, key, place, least);
    refined += strays > least;
    r->reached = fmax(r->reached, strays);
  }
  return status;
}

/* Measures a track of steps, which jumps where the clip says so, against keys at given times, which hold
 * until the next one. */
static tw_status measure_holds(reduction *r, const tw_track_keys *keys, const tw_parallel_for *parallel,
                               tw_error *error) {
  uint32_t jump = 0;
  for (uint32_t key = 0; key + 1 < keys->key_count; key++) {
    if (key % CHORDS_A_STEP == 0 && tw_parallel_for_status(parallel) != TW_OK)
      return tw_fail(error, TW_CANCELLED, "the error of the keys is not wanted any more");
    const float *held = keys->values + (size_t)key * r->width;
    float start = keys->times[key], end = keys->times[key + 1];
    chord still = chord_between(r, start, held, end, held);
    while (jump < r->time_count && r->times[jump] <= start) jump++;
    for (; jump < r->time_count && r->times[jump] < end && tw_work(sample_work(r)); jump++)
      r->reached = fmax(r->reached, stray_at(r, &still, r->times[jump]));
  }
  return tw_work_status(error);
}

tw_status tw_clip_bake_error(const tw_clip *clip, const tw_clip_keys *baked, const tw_parallel_for *parallel,
                             tw_tolerance *reached, tw_error *error) {
  tw_tolerance most = {0, 0};
  double steps_most = (double)CLIP_PLACES / ((double)count_keys(clip) + 1) + OWN_PLACES;
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track_keys *keys = &baked->tracks[i];
    reduction r;
    tw_status status = reduction_init(&r, clip, i, UINT32_MAX, true, error);
    if (status == TW_OK)
      status = clip->tracks[i].holds ? measure_holds(&r, keys, parallel, error)
                                     : measure_track(&r, keys, steps_most, parallel, error);
    double *told = r.rotation ? &most.angle : &most.distance;
    *told = fmax(*told, r.reached);
    reduction_deinit(&r);
    if (status != TW_OK) return status;
  }
  *reached = most;
  return TW_OK;
}

/* ---- clips ---------------------------------------------------------------------------------- */

static tw_status copy_steps(const tw_clip *clip, uint32_t index, tw_arena *arena, tw_track_keys *out,
                            tw_error *error) {
  const tw_timeline *timeline = clip->tracks[index].timeline;
  float *times = tw_arena_alloc(arena, timeline->key_count, sizeof *times);
  if (!times) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
  memcpy(times, timeline->times, timeline->key_count * sizeof *times);
  return tw_track_bake(clip, index, times, timeline->key_count, arena, out, error);
}

/* Whether a track of steps shows something else at a time than at its last key. */
static bool has_stepped(const reduction *r, float time) {
  const float *last = r->keys.values + (size_t)(r->keys.count - 1) * r->width;
  tw_clip_sample(r->clip, r->index, &time, 1, r->sample);
  return memcmp(last, r->sample, r->width * sizeof *last) != 0;
}

/* Adds keys where a track of steps changes between two bends, up to the second one. Rounding moves jumps away
 * from their bends, the farther the more clips lie below one another. */
static tw_status step_until(reduction *r, float from, float to, tw_error *error) {
  tw_status status = TW_OK;
  while (status == TW_OK && has_stepped(r, to)) {
    float low = from, high = to, middle = nextafterf(to, from);
    while (middle > low && middle < high) {
      if (!tw_work(sample_work(r))) return tw_work_status(error);
      if (has_stepped(r, middle))
        high = middle;
      else
        low = middle;
      middle = (float)((double)low + ((double)high - (double)low) / 2);
    }
    status = append(r, &r->keys, high, error);
    from = high;
  }
  return status;
}

/* Steps of a track without keys, where its value changes; those of the first track also at the clip's end, to
 * tell the duration. places: as in reduce_track. */
static tw_status find_steps(const tw_clip *clip, uint32_t index, uint32_t max_keys, uint64_t *places,
                            tw_arena *arena, tw_track_keys *out, tw_error *error) {
  reduction r;
  tw_status status = reduction_init(&r, clip, index, grid_most(clip, max_keys, *places), false, error);
  r.keys = (samples){.most = max_keys, .name = "keys"};
  if (status == TW_OK) status = append(&r, &r.keys, r.times[0], error);
  for (uint32_t i = 1; i < r.time_count && status == TW_OK; i++)
    status = step_until(&r, r.times[i - 1], r.times[i], error);
  if (status == TW_OK && index == 0 && r.keys.times[r.keys.count - 1] < clip->duration)
    status = append(&r, &r.keys, clip->duration, error);
  if (status == TW_OK) status = deliver(&r, arena, out, error);
  spend(clip, r.time_count, places);
  reduction_deinit(&r);
  return status;
}

/* A copy of key times in the arena: the last one again where the times are the same array, as tracks of one
 * file share it. NULL without memory. */
typedef struct times_copy {
  const float *of, *copy;
  uint32_t count;
} times_copy;

static const float *copy_times(times_copy *last, const tw_track_keys *track, tw_arena *arena) {
  if (last->of == track->times && last->count == track->key_count) return last->copy;
  float *copy = tw_arena_alloc_raw(arena, track->key_count, sizeof *copy);
  if (!copy) return NULL;
  memcpy(copy, track->times, track->key_count * sizeof *copy);
  *last = (times_copy){track->times, copy, track->key_count};
  return copy;
}

/* places: as in reduce_track; the keys that are added count. */
static tw_status keep_eulers(const tw_track_keys *track, tw_tolerance tolerance, uint32_t max_keys,
                             uint64_t *places, times_copy *last, tw_arena *arena, tw_track_keys *out,
                             double *reached, tw_error *error) {
  uint32_t most = max_keys < *places ? max_keys : (uint32_t)*places;
  tw_status status = tw_euler_keys(track, tolerance.angle, most, arena, out, reached, error);
  if (status != TW_OK) return status;
  *places -= out->key_count - track->key_count;
  if (out->times != track->times) return TW_OK;
  out->times = copy_times(last, track, arena);
  return out->times ? TW_OK : tw_fail(error, TW_NO_MEMORY, "no memory for a reduced track");
}

/* Whether the track interpolates the angles of its keys. */
static bool says_angles(const tw_track *track, const tw_track_keys *keys) {
  return track->kind == TRACK_EULER && keys->form == TW_KEY_EULER;
}

static tw_status convert(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                         uint32_t max_keys, uint64_t *steps, bool keeps_eulers, tw_arena *arena,
                         tw_clip_keys *out, tw_tolerance *reached, tw_error *error) {
  if (!(tolerance.angle >= 1e-6) || !(tolerance.distance > 0))
    return tw_fail(error, TW_INVALID, "a tolerance is at least 1e-6 radians and more than 0 metres");
  tw_track_keys *tracks = tw_arena_alloc(arena, clip->track_count, sizeof *tracks);
  if (!tracks) return tw_fail(error, TW_NO_MEMORY, "no memory for a reduced clip");
  tw_tolerance most = {0, 0};
  uint64_t own = OWN_PLACES * count_keys(clip), places = own + *steps;
  times_copy times = {0};
  for (uint32_t i = 0; i < clip->track_count; i++) {
    const tw_track *track = &clip->tracks[i];
    tw_status status = TW_OK;
    bool is_spline = track->kind == TRACK_HERMITE || track->kind == TRACK_VALUES_HERMITE;
    bool is_made = track->kind == TRACK_MADE;
    if (is_made && track->holds)
      status = find_steps(clip, i, max_keys, &places, arena, &tracks[i], error);
    else if (keys && is_spline && tw_keys_fit_gltf(&keys->tracks[i]))
      tracks[i] = keys->tracks[i];
    else if (keys && keeps_eulers && says_angles(track, &keys->tracks[i]))
      status = keep_eulers(&keys->tracks[i], tolerance, max_keys, &places, &times, arena, &tracks[i],
                           &most.angle, error);
    else if (track->holds)
      status = copy_steps(clip, i, arena, &tracks[i], error);
    else
      status = reduce_track(clip, i, tolerance, max_keys, &places, arena, &tracks[i],
                            track->path == TW_ROTATION ? &most.angle : &most.distance, error);
    if (status != TW_OK) return status;
  }
  if (places < *steps) *steps = places;
  *out = (tw_clip_keys){.track_count = clip->track_count, .tracks = tracks};
  *reached = most;
  return TW_OK;
}

tw_status tw_clip_reduce(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                         uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                         tw_tolerance *reached, tw_error *error) {
  return convert(clip, keys, tolerance, max_keys, steps, false, arena, out, reached, error);
}

tw_status tw_clip_express(const tw_clip *clip, const tw_clip_keys *keys, tw_tolerance tolerance,
                          uint32_t max_keys, uint64_t *steps, tw_arena *arena, tw_clip_keys *out,
                          tw_tolerance *reached, tw_error *error) {
  return convert(clip, keys, tolerance, max_keys, steps, true, arena, out, reached, error);
}
