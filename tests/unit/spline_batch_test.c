/* Several regular patches at once: the bytes of each of them alone, by every instruction set. */
#include "spline_batch.h"

#include <string.h>

#include "test.h"

enum { LANES = TW_SPLINE_LANES, SIDE_MAX = 16, STRIDE_MAX = 8, ROOM = SIDE_MAX * SIDE_MAX * STRIDE_MAX };

static const float untouched = -77.5f;

static uint32_t seed = 1;

static float noise(void) {
  seed = seed * 1664525u + 1013904223u;
  return (float)(seed >> 8) / (float)(1u << 23) - 1;
}

/* Bumpy sheets; those of the given lanes are one point. */
static void make_points(tw_spline_batch *batch, uint32_t collapsed) {
  for (size_t l = 0; l < LANES; l++)
    for (size_t k = 0; k < 16; k++) {
      float point[3] = {(float)(k % 4) + 0.2f * noise(), (float)(k / 4) + 0.2f * noise(), noise()};
      for (size_t c = 0; c < 3; c++) batch->points[k][c][l] = collapsed >> l & 1 ? 0.5f : point[c];
    }
}

/* Each patch by itself, mirrored back. */
static void fill_alone(const tw_spline_batch *batch, float out[LANES][ROOM]) {
  for (uint32_t l = 0; l < batch->count; l++) {
    bool mirrored = batch->outward[l] < 0;
    uint32_t last = batch->rect.i1 - batch->rect.i0, end = 1u << 4;
    float points[16][4] = {{0}};
    for (size_t k = 0; k < 16; k++)
      for (size_t c = 0; c < 3; c++) points[mirrored ? k ^ 3 : k][c] = batch->points[k][c][l];
    tw_patch_rect rect = batch->rect;
    if (mirrored) rect = (tw_patch_rect){end - rect.i1, end - rect.i0, rect.j0, rect.j1};
    ptrdiff_t lines = batch->step * (ptrdiff_t)(last + 1), step = mirrored ? -batch->step : batch->step;
    float *first = out[l] + (mirrored ? batch->step * (ptrdiff_t)last : 0);
    tw_spline_job job = {.spline = batch->spline,
                         .points = (const float(*)[4])points,
                         .width = 3,
                         .limit = batch->limit,
                         .rect = rect,
                         .values = first,
                         .normals = batch->normals ? first + 3 : NULL,
                         .step = step,
                         .line_step = lines};
    tw_spline_rows(&job);
  }
}

static void clear(float out[LANES][ROOM]) {
  for (size_t l = 0; l < LANES; l++)
    for (size_t i = 0; i < ROOM; i++) out[l][i] = untouched;
}

TEST(every_patch_has_the_bytes_that_it_has_alone) {
  static float alone[LANES][ROOM], together[LANES][ROOM];
  static const tw_patch_rect rects[] = {{0, 0, 0, 0}, {1, 15, 0, 0}, {1, 15, 1, 15}, {3, 9, 2, 4}};
  for (uint32_t count = 1; count <= LANES; count++)
    for (size_t r = 0; r < sizeof rects / sizeof *rects; r++)
      for (uint32_t kind = 0; kind < 8; kind++) {
        bool normals = kind & 1;
        tw_spline_batch batch = {.spline = tw_spline_table(4),
                                 .limit = kind & 2,
                                 .normals = normals,
                                 .rect = rects[r],
                                 .step = kind & 4  ? STRIDE_MAX
                                         : normals ? 6
                                                   : 3,
                                 .count = count};
        make_points(&batch, 0);
        for (uint32_t l = 0; l < LANES; l++) {
          batch.outward[l] = l % 3 == 1 ? -1.0f : 1.0f;
          batch.rows[l] = together[l];
        }
        clear(alone);
        fill_alone(&batch, alone);
        uint32_t unsure = 1;
        for (uint32_t set = 0; clear(together), tw_spline_batch_rows_by(set, &batch, &unsure); set++) {
          assert_memory_equal(together, alone, sizeof alone);
          assert_int_equal(unsure, 0);
        }
      }
}

TEST(patches_without_a_normal_are_named) {
  static float out[LANES][ROOM];
  static const uint32_t collapsed[] = {0, 1, 0x8000, 0x1248, 0xffff};
  for (size_t i = 0; i < sizeof collapsed / sizeof *collapsed; i++)
    for (uint32_t count = 1; count <= LANES; count++) {
      tw_spline_batch batch = {.spline = tw_spline_table(4),
                               .limit = true,
                               .normals = true,
                               .rect = {1, 15, 1, 15},
                               .step = 6,
                               .count = count};
      make_points(&batch, collapsed[i]);
      for (uint32_t l = 0; l < LANES; l++) batch.outward[l] = 1, batch.rows[l] = out[l];
      uint32_t unsure = 0;
      for (uint32_t set = 0; tw_spline_batch_rows_by(set, &batch, &unsure); set++)
        assert_int_equal(unsure, collapsed[i] & ((1u << count) - 1));
    }
}
