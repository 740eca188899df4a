/* The same piece of many patches: those that are regular are computed several at once. */
#ifndef TWEEND_PATCH_BATCH_H
#define TWEEND_PATCH_BATCH_H

#include "patch.h"
#include "spline_batch.h"

/* A corner, the inside of the side that begins there, or the inside of the whole patch. */
typedef enum tw_patch_piece { TW_PATCH_CORNER, TW_PATCH_SIDE, TW_PATCH_INSIDE } tw_patch_piece;

/* Patches that wait for more of their kind. */
typedef struct tw_patch_batch {
  const tw_patches *patches;
  tw_patch_job job;
  tw_patch_piece piece;
  bool normals, together;
  uint32_t corners[TW_SPLINE_LANES];
  /* How many control points a piece is made of, those of the first lines, and which of a patch these are when
   * the piece is that at corner k. What lies beyond the line of a corner or side weighs 0 there. */
  uint32_t points;
  uint8_t from[4][16];
  tw_spline_batch lanes;
} tw_patch_batch;

/* job: as of one patch, of width 3; its values and normals count for nothing, and it has no derivatives.
 * normals: wanted, next to the points. count: how many patches are likely to come. */
void tw_patch_batch_begin(tw_patch_batch *batch, const tw_patches *patches, const tw_patch_job *job,
                          bool normals, tw_patch_piece piece, size_t count);

/* The piece at a corner of the base goes to `values`, by the time that the batch ends, as tw_patch_evaluate
 * would have it to the last bit. A side runs from its corner on. */
void tw_patch_batch_add(tw_patch_batch *batch, uint32_t corner, float *values);
void tw_patch_batch_end(tw_patch_batch *batch);

#endif
