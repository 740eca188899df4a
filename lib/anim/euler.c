/* Euler angles: all six Tait-Bryan orders by one formula over permuted axes.
 *
 * With R = Ri(a) Rj(b) Rk(c) and axes in even order, the products of half angles give
 *   qw + qj = (cos b/2 + sin b/2) cos (a+c)/2    qi + qk = (cos b/2 + sin b/2) sin (a+c)/2
 *   qw - qj = (cos b/2 - sin b/2) cos (a-c)/2    qi - qk = (cos b/2 - sin b/2) sin (a-c)/2
 * so two arctangents give the sum and the difference of the outer angles. They stay exact up to gimbal lock,
 * where one of the pairs vanishes. An odd order is an even one with the innermost axis reversed. */
#include "angle.h"
#include "quat.h"

#include <math.h>

const char *const tw_euler_order_names[TW_EULER_ORDERS + 1] = {"XYZ", "XZY", "YXZ", "YZX",
                                                               "ZXY", "ZYX", NULL};
const unsigned char tw_euler_axes[TW_EULER_ORDERS][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                                         {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};

/* A pair of a length below this is rounding error of single precision: the middle angle is within half a
 * microradian of 90 degrees. */
static const double LOCK = 3e-7;

/* Wraps an angle into (-pi, pi]. */
static double wrap(double angle) {
  double turned = angle - 2 * TW_PI * ceil((angle - TW_PI) / (2 * TW_PI));
  return turned > -TW_PI ? turned : TW_PI;
}

void tw_quat_euler(const double angles[3], tw_euler_order order, double out[4]) {
  double product[4] = {0, 0, 0, 1};
  for (int i = 0; i < 3; i++) {
    int axis = tw_euler_axes[order][i];
    double turn[4] = {0, 0, 0, cos(angles[axis] / 2)};
    turn[axis] = sin(angles[axis] / 2);
    quat_multiply(product, turn, product);
  }
  for (int i = 0; i < 4; i++) out[i] = product[i];
}

/* The angles of the even form: the middle one, and half the sum and half the difference of the outer ones. At
 * gimbal lock one of these halves is not known. */
typedef struct euler_parts {
  double middle, half_sum, half_difference;
  bool sum_known, difference_known;
} euler_parts;

static euler_parts split(const double q[4], tw_euler_order order) {
  const unsigned char *axes = tw_euler_axes[order];
  double i = q[axes[0]], j = q[axes[1]], k = euler_sign(order) * q[axes[2]], w = q[3];
  double plus = hypot(w + j, i + k), minus = hypot(w - j, i - k);
  euler_parts parts = {.middle = 2 * atan2(plus, minus) - TW_PI / 2,
                       .half_sum = atan2(i + k, w + j),
                       .half_difference = atan2(i - k, w - j),
                       .sum_known = plus > LOCK,
                       .difference_known = minus > LOCK};
  if (!parts.difference_known) parts.middle = TW_PI / 2;
  if (!parts.sum_known) parts.middle = -TW_PI / 2;
  return parts;
}

static void join(const euler_parts *parts, tw_euler_order order, double out[3]) {
  const unsigned char *axes = tw_euler_axes[order];
  out[axes[0]] = wrap(parts->half_sum + parts->half_difference);
  out[axes[1]] = parts->middle;
  out[axes[2]] = wrap(euler_sign(order) * (parts->half_sum - parts->half_difference));
}

void tw_euler_of(const double q[4], tw_euler_order order, double out[3]) {
  euler_parts parts = split(q, order);
  if (!parts.difference_known) parts.half_difference = parts.half_sum;
  if (!parts.sum_known) parts.half_sum = parts.half_difference;
  join(&parts, order, out);
  if (!parts.difference_known || !parts.sum_known) out[tw_euler_axes[order][2]] = 0;
}

/* The product of the two pairs' lengths is |cos b|. */
double tw_euler_cos_middle(const double q[4], tw_euler_order order) {
  const unsigned char *axes = tw_euler_axes[order];
  double i = q[axes[0]], j = q[axes[1]], k = euler_sign(order) * q[axes[2]], w = q[3];
  return sqrt(((w + j) * (w + j) + (i + k) * (i + k)) * ((w - j) * (w - j) + (i - k) * (i - k))) /
         quat_dot(q, q);
}

/* Adds whole turns until each angle is within half a turn of the previous one. Returns the squared distance
 * of the triples. */
static double approach(const double previous[3], double angles[3]) {
  double distance = 0;
  for (int i = 0; i < 3; i++) {
    angles[i] += 2 * TW_PI * nearbyint((previous[i] - angles[i]) / (2 * TW_PI));
    distance += (angles[i] - previous[i]) * (angles[i] - previous[i]);
  }
  return distance;
}

void tw_euler_near(const double q[4], tw_euler_order order, const double previous[3], double out[3]) {
  const unsigned char *axes = tw_euler_axes[order];
  euler_parts parts = split(q, order);
  /* At lock the unknown half is free: taking the previous triple's keeps both outer angles nearest to it. */
  double outer = previous[axes[0]], inner = euler_sign(order) * previous[axes[2]];
  if (!parts.difference_known) parts.half_difference = (outer - inner) / 2;
  if (!parts.sum_known) parts.half_sum = (outer + inner) / 2;
  double twin[3] = {0, 0, 0};
  join(&parts, order, out);
  twin[axes[0]] = out[axes[0]] + TW_PI;
  twin[axes[1]] = TW_PI - out[axes[1]];
  twin[axes[2]] = out[axes[2]] + TW_PI;
  if (approach(previous, twin) < approach(previous, out))
    for (int i = 0; i < 3; i++) out[i] = twin[i];
}

void tw_quat_to_euler(const float q[4], tw_euler_order order, float out[3]) {
  double p[4], angles[3] = {0, 0, 0};
  quat_widen(q, p);
  tw_euler_of(p, order, angles);
  for (int i = 0; i < 3; i++) out[i] = (float)angles[i];
}

void tw_quat_to_euler_near(const float q[4], tw_euler_order order, const float previous[3], float out[3]) {
  double p[4], angles[3] = {0, 0, 0},
               before[3] = {(double)previous[0], (double)previous[1], (double)previous[2]};
  quat_widen(q, p);
  tw_euler_near(p, order, before, angles);
  for (int i = 0; i < 3; i++) out[i] = (float)angles[i];
}
