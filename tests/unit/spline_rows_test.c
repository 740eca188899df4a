/* Rows of regular patches: against the B-spline's own formulas, and one instruction set against another. */
#include "spline_rows.h"

#include <math.h>
#include <string.h>

#include "test.h"

enum { SIDE_MAX = 64, STRIDE = 9, ROOM = (SIDE_MAX + 6) * (SIDE_MAX + 1) * STRIDE };

static const float untouched = -77.5f;

static uint32_t seed = 1;

static float noise(void) {
  seed = seed * 1664525u + 1013904223u;
  return (float)(seed >> 8) / (float)(1u << 23) - 1;
}

/* A bumpy sheet, far enough from flat for every normal to be sure; components beyond the width are 0. */
static void make_points(float points[16][4], uint32_t width) {
  for (int k = 0; k < 16; k++) {
    float value[4] = {(float)(k % 4) + 0.2f * noise(), (float)(k / 4) + 0.2f * noise(), noise(), noise()};
    for (uint32_t c = 0; c < 4; c++) points[k][c] = c < width ? value[c] : 0;
  }
}

/* The cubic B-spline basis and its derivative on the segment between the second and third control point. */
static void basis(double t, double out[4], double slope[4]) {
  double s = 1 - t;
  out[0] = s * s * s / 6;
  out[1] = (3 * t * t * t - 6 * t * t + 4) / 6;
  out[2] = (3 * s * s * s - 6 * s * s + 4) / 6;
  out[3] = t * t * t / 6;
  slope[0] = -s * s / 2;
  slope[1] = (3 * t * t - 4 * t) / 2;
  slope[2] = (4 * s - 3 * s * s) / 2;
  slope[3] = t * t / 2;
}

static double tensor(const float points[16][4], const double along[4], const double across[4], uint32_t c) {
  double sum = 0;
  for (int k = 0; k < 16; k++) sum += along[k % 4] * across[k / 4] * (double)points[k][c];
  return sum;
}

static tw_spline_job whole_job(uint32_t depth, const float points[16][4], uint32_t width) {
  uint32_t side = 1u << depth;
  return (tw_spline_job){.spline = tw_spline_table(depth),
                         .points = points,
                         .width = width,
                         .limit = true,
                         .rect = {0, side, 0, side},
                         .step = STRIDE,
                         .line_step = (ptrdiff_t)STRIDE * (side + 1)};
}

TEST(points_and_normals_are_those_of_the_bicubic_spline) {
  static float out[ROOM];
  for (uint32_t depth = 0; depth <= 6; depth++) {
    float points[16][4];
    make_points(points, 3);
    tw_spline_job job = whole_job(depth, (const float(*)[4])points, 3);
    job.values = out;
    job.normals = out + 3;
    tw_spline_rows(&job);
    uint32_t side = 1u << depth;
    for (uint32_t j = 0; j <= side; j++)
      for (uint32_t i = 0; i <= side; i++) {
        double u[4], du[4], v[4], dv[4], a[3], b[3], n[3];
        basis((double)i / side, u, du);
        basis((double)j / side, v, dv);
        const float *row = out + (size_t)STRIDE * (j * (side + 1) + i);
        for (uint32_t c = 0; c < 3; c++) {
          a[c] = tensor((const float(*)[4])points, du, v, c);
          b[c] = tensor((const float(*)[4])points, u, dv, c);
          assert_true(fabs((double)row[c] - tensor((const float(*)[4])points, u, v, c)) < 2e-6);
        }
        for (int c = 0; c < 3; c++) n[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
        double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int c = 0; c < 3; c++) assert_true(fabs((double)row[3 + c] - n[c] / length) < 2e-6);
      }
  }
}

TEST(derivatives_of_equal_points_are_exactly_zero) {
  static float out[ROOM];
  float points[16][4];
  for (int k = 0; k < 16; k++)
    for (int c = 0; c < 4; c++) points[k][c] = 0.1f;
  tw_spline_job job = whole_job(4, (const float(*)[4])points, 4);
  job.derivatives = out;
  tw_spline_rows(&job);
  for (size_t i = 0; i < (size_t)17 * 17; i++)
    for (size_t c = 0; c < 8; c++) assert_true(out[STRIDE * i + c] == 0);
}

/* A column is computed along itself, which must turn neither normals nor derivatives over. */
TEST(a_column_alone_is_the_column_of_the_whole) {
  static float whole[ROOM], column[ROOM];
  float points[16][4];
  make_points(points, 3);
  for (int normals = 0; normals < 2; normals++) {
    tw_spline_job job = whole_job(5, (const float(*)[4])points, 3);
    *(normals ? &job.normals : &job.derivatives) = whole;
    tw_spline_rows(&job);
    for (uint32_t i = 0; i <= 32; i++) {
      tw_spline_job one = job;
      *(normals ? &one.normals : &one.derivatives) = column;
      one.rect.i0 = one.rect.i1 = i;
      tw_spline_rows(&one);
      for (uint32_t j = 0; j <= 32; j++)
        for (uint32_t c = 0; c < (normals ? 3u : 7u); c++)
          if (c != 3) {
            size_t place = (size_t)STRIDE * 33 * j;
            assert_true(fabsf(column[place + c] - whole[place + STRIDE * i + c]) < 2e-6f);
          }
    }
  }
}

/* All control points of the first two columns in one: no tangent along i there. */
TEST(where_tangents_vanish_the_quad_says_the_normal) {
  static float out[ROOM];
  float points[16][4] = {{0}};
  for (int k = 0; k < 16; k++) points[k][1] = (float)(k / 4), points[k][0] = 0;
  points[6][0] = points[10][0] = 1; /* the quad has an area, its first tangent is nothing at (0, 0) */
  tw_spline_job job = whole_job(3, (const float(*)[4])points, 3);
  job.normals = out;
  tw_spline_rows(&job);
  for (size_t i = 0; i < 81; i++) {
    const float *n = out + STRIDE * i;
    float square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    assert_true(fabsf(square - 1) < 1e-5f);
  }
  for (int k = 0; k < 16; k++)
    for (int c = 0; c < 3; c++) points[k][c] = 0;
  tw_spline_rows(&job);
  for (size_t i = 0; i < 81; i++) assert_true(out[STRIDE * i + 1] == 1);
}

/* Lines are computed many together; where tangents vanish at one corner, some of these need a closer look. */
TEST(a_line_among_others_is_the_line_alone) {
  static float whole[ROOM], alone[ROOM];
  for (uint32_t depth = 0; depth <= 6; depth++)
    for (int kind = 0; kind < 8; kind++) {
      uint32_t side = 1u << depth, corner = kind & 1 ? 5 : 0, first = kind & 4 ? 0 : 3;
      float points[16][4];
      make_points(points, 3);
      for (uint32_t k = 0; k < 9; k++)
        if (kind & 2) memcpy(points[corner + k / 3 * 4 + k % 3], points[corner], sizeof points[0]);
      tw_spline_job job = whole_job(depth, (const float(*)[4])points, 3);
      job.step = 6;
      job.line_step = (ptrdiff_t)job.step * (side + 1);
      job.limit = false;
      job.values = kind & 4 ? whole : NULL;
      job.normals = whole + 3;
      for (uint32_t set = 0; tw_spline_rows_by(set, &job); set++)
        for (uint32_t j = 0; j <= side; j++) {
          tw_spline_job line = job;
          line.rect.j0 = line.rect.j1 = j;
          line.values = kind & 4 ? alone : NULL;
          line.normals = alone + 3;
          tw_spline_rows_by(set, &line);
          for (uint32_t i = 0; i <= side; i++)
            assert_memory_equal(alone + 6 * (size_t)i + first,
                                whole + 6 * ((size_t)j * (side + 1) + i) + first,
                                (6 - first) * sizeof(float));
        }
    }
}

typedef struct choice {
  uint32_t width;
  bool values, normals, derivatives, backwards;
  ptrdiff_t stride;
  uint32_t gap; /* rows between lines that are somebody else's */
} choice;

/* Every float that a job by one instruction set leaves behind. */
static bool run_by(uint32_t instruction_set, tw_spline_job job, choice c, float *out) {
  for (size_t i = 0; i < ROOM; i++) out[i] = untouched;
  size_t line = job.rect.i1 - job.rect.i0 + 1 + c.gap, rows = line * (job.rect.j1 - job.rect.j0 + 1);
  float *first = out + (c.backwards ? (rows - 1) * (size_t)c.stride : 0);
  job.step = c.backwards ? -c.stride : c.stride;
  job.line_step = job.step * (ptrdiff_t)line;
  job.values = c.values ? first : NULL;
  job.normals = c.normals ? first + 3 : NULL;
  job.derivatives = c.derivatives ? first : NULL;
  return tw_spline_rows_by(instruction_set, &job);
}

static bool is_written(const choice *c, size_t place, tw_patch_rect rect) {
  size_t column = place % (size_t)c->stride, row = place / (size_t)c->stride;
  size_t points = rect.i1 - rect.i0 + 1, line = points + c->gap, lines = rect.j1 - rect.j0 + 1;
  if (row >= lines * line) return false;
  if ((c->backwards ? line - 1 - row % line : row % line) >= points) return false;
  if (c->derivatives) return column % 4 < (c->width == 2 ? 2u : 4u) && column < 8;
  return (c->values && column < c->width) || (c->normals && column >= 3 && column < 6);
}

TEST(all_instruction_sets_write_the_same_bytes_and_only_their_own) {
  static float plain[ROOM], other[ROOM];
  static const choice choices[] = {
      {3, true, false, false, false, 3, 0}, {3, true, false, false, true, 3, 0},
      {3, true, false, false, false, 8, 0}, {2, true, false, false, false, 7, 0},
      {4, true, false, false, true, 4, 0},  {3, true, true, false, false, 6, 0},
      {3, true, true, false, false, 6, 5},  {3, true, true, false, true, 6, 2},
      {3, true, true, false, true, 8, 0},   {3, false, true, false, false, 6, 0},
      {3, true, false, false, false, 3, 1}, {3, false, false, true, false, 8, 0},
      {2, false, false, true, true, 8, 1},
  };
  for (uint32_t depth = 0; depth <= 6; depth++)
    for (size_t k = 0; k < sizeof choices / sizeof *choices; k++) {
      uint32_t side = 1u << depth;
      tw_patch_rect rects[] = {{0, side, 0, side},
                               {0, side / 2, side, side},
                               {side, side, 0, side},
                               {side / 2, side / 2, side / 2, side / 2},
                               {side / 3, side, side / 2, side}};
      for (size_t r = 0; r < sizeof rects / sizeof *rects; r++) {
        float points[16][4];
        make_points(points, choices[k].width);
        if (r == 0) memcpy(points[1], points[0], sizeof points[0]); /* some normals need a closer look */
        tw_spline_job job = whole_job(depth, (const float(*)[4])points, choices[k].width);
        job.rect = rects[r];
        job.limit = k % 2;
        assert_true(run_by(0, job, choices[k], plain));
        for (size_t i = 0; i < ROOM; i++)
          assert_true((plain[i] != untouched) == is_written(&choices[k], i, job.rect));
        for (uint32_t set = 1; run_by(set, job, choices[k], other); set++)
          assert_memory_equal(plain, other, sizeof plain);
      }
    }
}
