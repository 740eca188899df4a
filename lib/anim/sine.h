/* Angles in single precision, as kernels compute them: without branches, so that they are vectorised. */
#ifndef TWEEND_SINE_H
#define TWEEND_SINE_H

/* Sine and cosine on [-pi/2, pi/2], within 3e-8 and 1e-9 before rounding, exact at 0. The polynomials
 * interpolate (sin v - v) / v^3 and (cos v - 1) / v^2 at Chebyshev points. */
static inline float arc_sine(float v) {
  float x = v * v;
  return v + v * x * (-0.16666666f + x * (0.008333242f + x * (-0.0001982273f + x * 2.6347257e-06f)));
}

static inline float arc_cosine(float v) {
  float x = v * v;
  return 1 +
         x * (-0.5f + x * (0.04166666f + x * (-0.0013888651f + x * (2.4774566e-05f + x * -2.6297198e-07f))));
}

/* The angle in [0, pi/2] whose sine and cosine are in proportion to `sine` and `cosine`, which are 0 or more
 * and not both 0; within 1e-7. The polynomial is 4.4.49 of Abramowitz and Stegun's Handbook. */
static inline float arc_angle(float sine, float cosine) {
  float large = sine > cosine ? sine : cosine, small = sine > cosine ? cosine : sine;
  float t = small / large, x = t * t;
  float angle =
      t + t * x *
              (-0.3333314528f +
               x * (0.1999355085f +
                    x * (-0.1420889944f +
                         x * (0.1065626393f +
                              x * (-0.0752896400f +
                                   x * (0.0429096138f + x * (-0.0161657367f + x * 0.0028662257f)))))));
  return sine > cosine ? 1.57079633f - angle : angle;
}

#endif
