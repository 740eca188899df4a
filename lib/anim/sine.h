/* Angles in single precision, as kernels compute them: without branches, so that they are vectorised. */
#ifndef TWEEND_SINE_H
#define TWEEND_SINE_H

/* Sine and cosine on [-pi/2, pi/2], within 3e-8 and 1e-9 before rounding, exact at 0. The polynomials
 * interpolate (sin v - v) / v^3 and (cos v - 1) / v^2 at Chebyshev points; x: v^2 */
static inline float sine_excess(float x) {
  return x * (-0.16666666f + x * (0.008333242f + x * (-0.0001982273f + x * 2.6347257e-06f)));
}

static inline float cosine_of_square(float x) {
  return 1 +
         x * (-0.5f + x * (0.04166666f + x * (-0.0013888651f + x * (2.4774566e-05f + x * -2.6297198e-07f))));
}

static inline float arc_sine(float v) {
  return v + v * sine_excess(v * v);
}

static inline float arc_cosine(float v) {
  return cosine_of_square(v * v);
}

/* An angle over its sine, from its cosine in [0, 1], within 1e-7; exact at 1. It hardly changes near there,
 * so that rounding of the cosine does no harm. Interpolated at Chebyshev points, too. */
static inline float angle_over_sine(float cosine) {
  float u = 1 - cosine, square = u * u;
  float low = 0.3333333637f + u * 0.1333284358f + square * (0.05727148323f + u * 0.02411409888f);
  float high = 0.01784092271f - u * 0.01161207318f + square * (0.02821458834f - u * 0.01994595728f) +
               square * square * 0.008251405879f;
  return 1 + u * (low + square * square * high);
}

#endif
