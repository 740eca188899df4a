/* The layers of a mixed clip over time: weights, the phase that synchronised layers share, local times. */
#ifndef TWEEND_MIX_TIME_H
#define TWEEND_MIX_TIME_H

#include "clip.h"
#include "tweend/mix.h"

/* From this knot to the next one the rate of the phase is (pace + bend x) / (1 + growth x) x seconds later.
 */
typedef struct phase_knot {
  double time, phase;
  double pace, bend, growth;
} phase_knot;

typedef struct mix_time {
  uint32_t layer_count;
  tw_layer *layers;  /* [layer_count] */
  double *durations; /* [layer_count] of the layers' clips */
  double duration;   /* of the mixed clip: a float's */
  uint32_t knot_count;
  phase_knot *knots; /* [knot_count] from time 0 on; none where no layer is synchronised */
} mix_time;

/* A layer at one time. */
typedef struct layer_state {
  float time; /* of the layer's clip */
  float weight;
} layer_state;

/* Copies the layers into the arena and finds the phase and the duration. The layers have passed
 * tw_layer_check. False without memory. */
bool tw_mix_time_init(mix_time *mix, tw_arena *arena, const tw_layer *layers, uint32_t layer_count,
                      const float *durations);

/* Clamps a time to the mixed clip. */
static inline double mix_clamp(const mix_time *mix, float time) {
  double end = mix->duration, t = (double)time < end ? (double)time : end;
  return t > 0 ? t : 0;
}

/* Rounds that synchronised layers have played at a clamped time. */
double tw_mix_phase(const mix_time *mix, double time);

/* Clamped times and the phases at these, which are set only where a layer is synchronised. */
typedef struct mix_moments {
  uint32_t count;
  bool rise; /* no time, and so no phase, is before the one before it: what holds at the last one holds at all
              */
  float times[TW_POSE_BLOCK];
  double phases[TW_POSE_BLOCK];
} mix_moments;

/* count: at most TW_POSE_BLOCK. */
void tw_mix_moments(const mix_time *mix, const float *times, uint32_t count, mix_moments *out);

/* The state of a layer at a clamped time whose phase is given. */
layer_state tw_layer_at(const mix_time *mix, uint32_t index, double time, double phase);

/* The same at many times. locals: [count] times of the layer's clip. weights: [count] */
void tw_layer_states(const mix_time *mix, uint32_t index, const mix_moments *at, float *locals,
                     float *weights);

/* Tells all times, in any order, at which a layer shows a time of its clip; and those at which its weight,
 * its pace or its clip's end bend or break what it shows: there times just beside, too. False where it was
 * stopped. */
bool tw_layer_times(const mix_time *mix, uint32_t layer, double local, const tw_bend_sink *sink);
bool tw_layer_bends(const mix_time *mix, uint32_t layer, const tw_bend_sink *sink);

#endif
