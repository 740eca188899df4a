/* Puts pieces of regular patches next to each other, turned so that their rows are computed alike. */
#include "patch_batch.h"

#include <string.h>

enum { WORTH_IT = 5 }; /* patches; a batch, however full, costs about as much as so many one by one */

/* Which control point comes to place `at`, so that the piece at corner k lies as that at corner 0. A corner
 * takes a mirror image, a side is turned, which both keep the order of sums. */
static inline uint32_t moved_from(tw_patch_piece piece, uint32_t k, uint32_t at) {
  static const uint8_t flips[4] = {0, 3, 15, 12};
  if (piece == TW_PATCH_INSIDE) return at;
  if (piece == TW_PATCH_SIDE && k % 2 == 1) at = at / 4 + at % 4 * 4;
  return at ^ flips[k];
}

void tw_patch_batch_begin(tw_patch_batch *batch, const tw_patches *patches, const tw_patch_job *job,
                          bool normals, tw_patch_piece piece, size_t count) {
  batch->patches = patches;
  batch->job = *job;
  batch->normals = normals;
  batch->piece = piece;
  batch->together = count >= WORTH_IT && !patches->linear;
  if (!batch->together) return;
  uint32_t inside = (1u << patches->depth) - 1;
  tw_patch_rect rects[] = {{0, 0, 0, 0}, {1, inside, 0, 0}, {1, inside, 1, inside}};
  batch->lanes = (tw_spline_batch){.spline = tw_spline_table(patches->depth),
                                   .limit = job->limit,
                                   .normals = normals,
                                   .rect = rects[piece],
                                   .step = (ptrdiff_t)job->stride};
  batch->points = piece == TW_PATCH_INSIDE ? 16 : 12;
  for (uint32_t k = 0; k < 4; k++)
    for (uint32_t i = 0; i < batch->points; i++) batch->from[k][i] = (uint8_t)moved_from(piece, k, i);
}

static void evaluate_alone(tw_patch_batch *batch, uint32_t corner, float *values) {
  tw_patch_job job = batch->job;
  uint32_t side = 1u << batch->patches->depth;
  tw_patch_rect rect = {1, side - 1, 1, side - 1};
  if (batch->piece == TW_PATCH_CORNER) rect = tw_patch_corner(side, corner % 4);
  if (batch->piece == TW_PATCH_SIDE) rect = tw_patch_side(side, corner % 4, &job.backwards);
  job.values = values;
  if (batch->normals) job.normals = values + 3;
  tw_patch_evaluate(batch->patches, corner / 4, &job, rect);
}

static void put_points(tw_patch_batch *batch, uint32_t corner, uint32_t lane) {
  const tw_patches *patches = batch->patches;
  const float *in = batch->job.in;
  const uint8_t *from = batch->from[corner % 4];
  uint32_t count;
  const uint32_t *controls = tw_patch_controls(patches, corner / 4, &count);
  float reflected[16][4];
  bool direct = patches->patches[corner / 4].reflected == 0;
  if (!direct) tw_patch_regular_points(patches, corner / 4, in, 3, reflected);
  for (uint32_t i = 0; i < batch->points; i++) {
    const float *point = direct ? in + 3 * (size_t)controls[from[i]] : reflected[from[i]];
    for (uint32_t c = 0; c < 3; c++) batch->lanes.points[i][c][lane] = point[c];
  }
}

static void put_in_lane(tw_patch_batch *batch, uint32_t corner, float *values) {
  tw_spline_batch *lanes = &batch->lanes;
  uint32_t lane = lanes->count++;
  put_points(batch, corner, lane);
  lanes->outward[lane] = batch->piece == TW_PATCH_CORNER && corner % 2 ? -1.0f : 1.0f;
  lanes->rows[lane] = values;
  batch->corners[lane] = corner;
}

static void flush(tw_patch_batch *batch) {
  tw_spline_batch *lanes = &batch->lanes;
  uint32_t alone = lanes->count < WORTH_IT ? (1u << lanes->count) - 1 : tw_spline_batch_rows(lanes);
  for (uint32_t l = 0; alone >> l; l++)
    if (alone >> l & 1) evaluate_alone(batch, batch->corners[l], lanes->rows[l]);
  lanes->count = 0;
}

void tw_patch_batch_add(tw_patch_batch *batch, uint32_t corner, float *values) {
  if (!batch->together || batch->patches->patches[corner / 4].shape) {
    evaluate_alone(batch, corner, values);
    return;
  }
  put_in_lane(batch, corner, values);
  if (batch->lanes.count == TW_SPLINE_LANES) flush(batch);
}

void tw_patch_batch_end(tw_patch_batch *batch) {
  if (batch->together && batch->lanes.count > 0) flush(batch);
}
