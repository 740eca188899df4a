/* Rows of points and unit normals. Many tangents are found before they are crossed, some at a time, so that
 * roots and quotients overlap. */
#ifndef TWEEND_NORMAL_ROWS_H
#define TWEEND_NORMAL_ROWS_H

#include "point.h"
#include "tweend/base.h"

/* 48 are whole items of one, two, three and four rows. */
enum { TW_NORMAL_BATCH = 48, TW_NORMAL_SPARE = 3, TW_NORMAL_ROW = 6 };

/* Tangents of some rows. */
typedef struct tw_normal_batch {
  tw_point along[2][TW_NORMAL_BATCH + TW_NORMAL_SPARE]; /* the last four may begin at any row */
} tw_normal_batch;

/* Rows [from, to) of a batch, at least one. points: [to][3], of all its rows, and one float more; out:
 * [to - from][6]. False: some of the normals need tw_normal_look_closer. */
bool tw_normal_put_rows(tw_normal_batch *batch, uint32_t from, uint32_t to, const float *points, float *out);

/* The normal of row i. Four points serve where there is no tangent plane. */
void tw_normal_look_closer(const tw_normal_batch *batch, uint32_t i, const float *const quad[4],
                           float normal[3]);

#endif
