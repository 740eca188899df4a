/* Finding keys and sampling arcs at many times, in vectors as wide as the compiler may use: each file that
 * includes this is compiled for another instruction set. No product is contracted and every time is treated
 * the same way wherever it lies in a vector, so that all give the same bytes. */
#ifndef TWEEND_TRACK_KERNEL_H
#define TWEEND_TRACK_KERNEL_H

#ifdef __AVX2__
#include <immintrin.h>
#endif

#include "track.h"
#include "wide.h"

static inline __attribute__((always_inline)) bool all_of(mask lanes) {
#ifdef __AVX512F__
  return _mm512_movepi32_mask((__m512i)lanes) == 0xFFFF;
#elif defined __AVX2__
  return _mm256_movemask_ps((__m256)lanes) == 0xFF;
#else
  return (lanes[0] & lanes[1] & lanes[2] & lanes[3]) != 0;
#endif
}

/* ---- keys ----------------------------------------------------------------------------------------- */

static inline __attribute__((always_inline)) vector everywhere(float number) {
  return number - (vector){0}; /* minus, so that -0 stays */
}

static inline __attribute__((always_inline)) vector choose(mask which, vector a, vector b) {
  return (vector)(((mask)a & which) | ((mask)b & ~which));
}

/* Where no time of some vectors is before the first or after the last of them, and few keys are between:
 * clamps them and counts the keys, each for all times at once, so that nothing branches on where a key is.
 * False elsewhere. */
static inline __attribute__((always_inline)) bool find_together(const tw_timeline *line, const float *times,
                                                                size_t vector_count, float *clamped,
                                                                uint32_t *keys) {
  enum { KEYS_FEW = 64, VECTORS_MOST = 4 };
  vector at[VECTORS_MOST], start = everywhere(line->first), end = everywhere(line->last);
  float least = timeline_clamp(line, times[0]), most = timeline_clamp(line, times[vector_count * LANES - 1]);
  uint32_t first = timeline_find(line, least), last = timeline_find(line, most);
  mask are_between = everywhere(least) <= most;
  for (size_t v = 0; v < vector_count; v++) {
    vector time = load(times + v * LANES);
    time = choose(time > start, time, start);
    at[v] = choose(time < end, time, end);
    are_between &= (at[v] >= least) & (at[v] <= most);
  }
  if (!all_of(are_between) || last - first > KEYS_FEW) return false;
  mask found[VECTORS_MOST];
  for (size_t v = 0; v < vector_count; v++) found[v] = (int32_t)first - (mask){0};
  for (uint32_t key = first + 1; key <= last; key++)
    for (size_t v = 0; v < vector_count; v++) found[v] -= at[v] >= line->times[key];
  memcpy(clamped, at, vector_count * sizeof *at);
  memcpy(keys, found, vector_count * sizeof *found);
  return true;
}

static void find_keys(const tw_timeline *timeline, const float *times, size_t count, float *clamped,
                      uint32_t *keys) {
  enum { SOME = 4 * LANES };
  const tw_timeline line = *timeline;
  for (size_t i = 0; i < count;) {
    if (i % SOME == 0 && count - i >= SOME && find_together(&line, times + i, 4, clamped + i, keys + i)) {
      i += SOME;
    } else if (count - i >= LANES && find_together(&line, times + i, 1, clamped + i, keys + i)) {
      i += LANES;
    } else {
      size_t end = count - i < LANES ? count : i + LANES;
      for (; i < end; i++) {
        clamped[i] = timeline_clamp(&line, times[i]);
        keys[i] = timeline_find(&line, clamped[i]);
      }
    }
  }
}

/* ---- arcs ----------------------------------------------------------------------------------------- */

/* Sine and cosine on [0, pi/2], within 3e-8 and 1e-9 before rounding: interpolation at Chebyshev points
 * of (sin v - v) / v^3 and (cos v - 1) / v^2. Exact at 0. */
static inline __attribute__((always_inline)) vector sine(vector v) {
  vector x = v * v;
  return v + v * x * (-0.16666666f + x * (0.008333242f + x * (-0.0001982273f + x * 2.6347257e-06f)));
}

static inline __attribute__((always_inline)) vector cosine(vector v) {
  vector x = v * v;
  return 1 +
         x * (-0.5f + x * (0.04166666f + x * (-0.0013888651f + x * (2.4774566e-05f + x * -2.6297198e-07f))));
}

/* The components of the rotations that lanes have at their times. */
static inline __attribute__((always_inline)) void turn(const vector *numbers, vector times, vector rows[4]) {
  vector angle = (times - numbers[ARC_START]) * numbers[ARC_RATE], c = cosine(angle), s = sine(angle);
  for (size_t i = 0; i < 4; i++) rows[i] = numbers[ARC_FROM + i] * c + numbers[ARC_TOWARD + i] * s;
}

/* ---- the arcs of one track, time after time ---------------------------------------------------------- */

/* Each lane from the numbers of its own arc. */
static inline __attribute__((always_inline)) void evaluate(const vector *numbers, const float *times,
                                                           float *out) {
  vector rows[4];
  turn(numbers, load(times), rows);
  store_rows(rows, 4, LANES, out, 4);
}

#ifdef __AVX2__
/* numbers[places[lane] % LANES] in each lane. */
static inline __attribute__((always_inline)) vector shuffle(vector numbers, mask places) {
#ifdef __AVX512F__
  return (vector)_mm512_permutexvar_ps((__m512i)places, (__m512)numbers);
#else
  return (vector)_mm256_permutevar8x32_ps((__m256)numbers, (__m256i)places);
#endif
}

/* Where the lanes take arcs that are close together: as many as there are lanes are loaded at once, and each
 * lane picks the numbers of its own; none is idle and nothing branches where arcs meet. */
static inline __attribute__((always_inline)) bool
sample_near(const float *arcs, size_t arc_count, const uint32_t *which, const float *times, float *out) {
  enum { REACH_MOST = 8 * LANES };
  uint32_t reach = which[LANES - 1] - which[0];
  mask steps;
  memcpy(&steps, which, sizeof steps);
  steps -= (int32_t)which[0];
  if (reach >= REACH_MOST || !all_of((steps >= 0) & (steps <= (int32_t)reach))) return false;
  vector numbers[ARC_NUMBERS];
  arcs += which[0];
  for (size_t i = 0; i < ARC_NUMBERS; i++) numbers[i] = shuffle(load(arcs + i * arc_count), steps);
  for (uint32_t first = LANES; first <= reach; first += LANES) {
    mask are_farther = steps >= (int32_t)first;
    arcs += LANES;
    for (size_t i = 0; i < ARC_NUMBERS; i++)
      numbers[i] = choose(are_farther, shuffle(load(arcs + i * arc_count), steps), numbers[i]);
  }
  evaluate(numbers, times, out);
  return true;
}
#endif

static __attribute__((noinline)) void sample_far(const float *arcs, size_t arc_count, const uint32_t *which,
                                                 const float *times, float *out) {
  vector numbers[ARC_NUMBERS];
  for (size_t i = 0; i < ARC_NUMBERS; i++, arcs += arc_count)
    for (size_t lane = 0; lane < LANES; lane++) numbers[i][lane] = arcs[which[lane]];
  evaluate(numbers, times, out);
}

static __attribute__((noinline)) void sample_lanes(const float *arcs, size_t arc_count, const uint32_t *which,
                                                   const float *times, float *out) {
#ifdef __AVX2__
  if (sample_near(arcs, arc_count, which, times, out)) return;
#endif
  sample_far(arcs, arc_count, which, times, out);
}

static void sample_arcs(const float *arcs, size_t arc_count, const uint32_t *which, const float *times,
                        size_t count, float *out) {
  for (; count >= LANES; count -= LANES, which += LANES, times += LANES, out += 4 * (size_t)LANES)
    sample_lanes(arcs, arc_count, which, times, out);
  if (count == 0) return;
  uint32_t last_arcs[LANES];
  float last_times[LANES], last[4 * LANES];
  for (size_t i = 0; i < LANES; i++) {
    last_arcs[i] = which[i < count ? i : 0];
    last_times[i] = times[i < count ? i : 0];
  }
  sample_lanes(arcs, arc_count, last_arcs, last_times, last);
  memcpy(out, last, 4 * count * sizeof *out);
}

/* ---- the arcs of many tracks at one time -------------------------------------------------------------- */

/* A bit for each lane. */
static inline __attribute__((always_inline)) uint32_t bits_of(mask lanes) {
#ifdef __AVX512F__
  return _mm512_movepi32_mask((__m512i)lanes);
#elif defined __AVX2__
  return (uint32_t)_mm256_movemask_ps((__m256)lanes);
#else
  return (uint32_t)((lanes[0] & 1) | (lanes[1] & 2) | (lanes[2] & 4) | (lanes[3] & 8));
#endif
}

/* How many arcs of a block have begun before the first that has not. */
static inline __attribute__((always_inline)) size_t count_begun(const arc_block *block, float time) {
  uint32_t later = 1u << ARC_BLOCK;
  for (size_t first = 0; first < ARC_BLOCK; first += LANES)
    later |= bits_of(load(block->numbers[ARC_START] + first) > time) << first;
  return (size_t)__builtin_ctz(later);
}

/* Some lanes of a block, the arcs of which have begun. */
static inline __attribute__((always_inline)) apart turn_lanes(const arc_block *block, size_t first,
                                                              float time) {
  vector numbers[ARC_NUMBERS], rows[4];
  for (size_t i = 0; i < ARC_NUMBERS; i++) numbers[i] = load(block->numbers[i] + first);
  turn(numbers, everywhere(time), rows);
  return take_apart(rows, 4);
}

static inline __attribute__((always_inline)) void pose_block(const arc_block *block, float time,
                                                             tw_trs *locals) {
  const uint32_t *nodes = block->nodes;
  for (size_t first = 0; first < ARC_BLOCK; first += LANES) {
    const apart turned = turn_lanes(block, first, time);
    for (size_t m = 0; m < LANES / 4; m++)
      for (size_t r = 0; r < 4; r++, nodes++) put(locals[*nodes].rotation, four_of(turned.rows[r], m));
  }
}

static void pose_arcs(const arc_block *blocks, size_t window, size_t block, float time, tw_trs *locals) {
  size_t begun;
  while ((begun = count_begun(&blocks[block], time)) == ARC_BLOCK) block++;
  for (size_t i = block > window ? block - window : 0; i < block; i++) pose_block(&blocks[i], time, locals);
  for (size_t first = 0; first < begun; first += LANES) {
    const apart turned = turn_lanes(&blocks[block], first, time);
    const uint32_t *nodes = blocks[block].nodes + first;
    for (size_t lane = 0; lane < LANES && first + lane < begun; lane++)
      put_one_apart(&turned, 4, lane, locals[nodes[lane]].rotation);
  }
}

#endif
