/* Meshes far from the origin: the frame in which float keeps their shape. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "tweend/mesh.h"

/* The share of its size by which rounding may change a mesh. */
static const double loss_max = 1e-6;

typedef struct bounds {
  double low[3], high[3];
} bounds;

static void widen(bounds *b, const double point[3], bool is_first) {
  for (int c = 0; c < 3; c++) {
    if (is_first || point[c] < b->low[c]) b->low[c] = point[c];
    if (is_first || point[c] > b->high[c]) b->high[c] = point[c];
  }
}

static double extent_of(const bounds *b) {
  return fmax(b->high[0] - b->low[0], fmax(b->high[1] - b->low[1], b->high[2] - b->low[2]));
}

/* The most by which rounding to float moves a coordinate up to `most`. */
static double loss_below(double most) {
  int exponent;
  frexp(most, &exponent); /* floats below 2^exponent are up to 2^(exponent - 24) apart */
  return ldexp(0.5, exponent - FLT_MANT_DIG);
}

/* The most by which rounding to float moves a point within the bounds. */
static double loss_of(const bounds *b) {
  double most = 0;
  for (int c = 0; c < 3; c++) most = fmax(most, fmax(fabs(b->low[c]), fabs(b->high[c])));
  return loss_below(most);
}

/* At least the magnitude of each coordinate of the corners' points: that of all points between the first and
 * the last of them. Infinite where these are far more than the corners. */
static double greatest_magnitude(const float *positions, const uint32_t *corners, uint32_t corner_count) {
  uint32_t first = UINT32_MAX, last = 0;
  float most = 0;
  for (uint32_t i = 0; i < corner_count; i++) {
    first = corners[i] < first ? corners[i] : first;
    last = corners[i] > last ? corners[i] : last;
  }
  if (corner_count == 0 || last - first > corner_count) return INFINITY;
  for (size_t i = 3 * (size_t)first; i < 3 * (size_t)last + 3; i++) {
    float value = fabsf(positions[i]);
    most = value > most ? value : most;
  }
  return (double)most;
}

bool tw_points_may_be_far(const float *positions, const uint32_t *corners, uint32_t corner_count) {
  enum { CORNERS = 64 }; /* between two looks at the extent, which only grows */
  bounds b = {{0}, {0}};
  double most = greatest_magnitude(positions, corners, corner_count),
         loss = isfinite(most) ? 2 * loss_below(most) : INFINITY; /* 2: rounding may widen the extent */
  for (uint32_t i = 0; i < corner_count; i++) {
    const float *at = positions + 3 * (size_t)corners[i];
    widen(&b, (const double[3]){(double)at[0], (double)at[1], (double)at[2]}, i == 0);
    if (i % CORNERS == CORNERS - 1 && loss <= loss_max * extent_of(&b)) return false;
  }
  return corner_count > 0 && 2 * loss_of(&b) > loss_max * extent_of(&b);
}

/* A number near the middle of an axis: a multiple of a power of two about the extent, which is a float unless
 * the middle is some 2^24 extents away. */
static double near_middle(double low, double high, double extent) {
  int exponent;
  frexp(extent, &exponent);
  double step = ldexp(0.5, exponent);
  return round((low / 2 + high / 2) / step) * step;
}

bool tw_points_find_frame(const double *exact, const uint32_t *corners, uint32_t corner_count,
                          double origin[3]) {
  bounds b = {{0}, {0}};
  for (uint32_t i = 0; i < corner_count; i++) widen(&b, exact + 3 * (size_t)corners[i], i == 0);
  double extent = extent_of(&b), place[3];
  if (!(extent > 0 && loss_of(&b) > loss_max * extent)) return false;
  for (int c = 0; c < 3; c++) {
    double most = fmax(fabs(b.low[c]), fabs(b.high[c]));
    if (!(most <= (double)TW_COORDINATE_MAX)) return false; /* refused later, with its place */
    place[c] = most > 2 * extent ? near_middle(b.low[c], b.high[c], extent) : 0;
  }
  memcpy(origin, place, sizeof place);
  return true;
}

void tw_points_enter_frame(const double *exact, size_t point_count, const double origin[3],
                           float *positions) {
  for (size_t i = 0; i < 3 * point_count; i++) positions[i] = (float)(exact[i] - origin[i % 3]);
}

bool tw_shows_far(const float world[16], const tw_mesh *mesh) {
  bounds b = {{0}, {0}};
  if (world[12] == 0 && world[13] == 0 && world[14] == 0) return false;
  for (uint32_t i = 0; i < mesh->corner_count; i++) {
    const float *at = mesh->positions + 3 * (size_t)mesh->corners[i];
    double point[3];
    for (int c = 0; c < 3; c++)
      point[c] = (double)world[c] * (double)at[0] + (double)world[4 + c] * (double)at[1] +
                 (double)world[8 + c] * (double)at[2] + (double)world[12 + c];
    widen(&b, point, i == 0);
  }
  double extent = extent_of(&b);
  return extent > 0 && loss_of(&b) > loss_max * extent;
}

double tw_mesh_extent(const tw_mesh *mesh) {
  bounds b = {{0}, {0}};
  for (uint32_t i = 0; i < mesh->corner_count; i++) {
    const float *at = mesh->positions + 3 * (size_t)mesh->corners[i];
    widen(&b, (const double[3]){(double)at[0], (double)at[1], (double)at[2]}, i == 0);
  }
  return extent_of(&b);
}

bool tw_rounding_shows(const double place[3], double extent) {
  double most = 0;
  for (int c = 0; c < 3; c++) most = fmax(most, fabs(place[c] - (double)(float)place[c]));
  return most > loss_max * extent;
}
