/* Skin weights: which joints move each vertex, and how much. The weights of one joint over all vertices are a
 * function that subdivides as positions do, so a vertex of a refined mesh may have more joints than a row
 * holds; up to TW_INFLUENCES_MAX are kept. */
#ifndef TWEEND_SKIN_WEIGHTS_H
#define TWEEND_SKIN_WEIGHTS_H

#include "patch.h"
#include "shallow_levels.h"

/* Joints that are kept for a vertex, the heaviest ones. On regular meshes a refined vertex has at most 36;
 * the limit bounds what faces of many corners can ask for. */
enum { TW_INFLUENCES_MAX = 64 };

/* The influences of all vertices: joints and their weights. Owns its arrays; a zeroed one may be deinited. */
typedef struct tw_influences {
  uint32_t vertex_count;
  uint32_t joint_count; /* greatest joint + 1 */
  size_t *offsets;      /* [vertex_count + 1] */
  uint16_t *joints;     /* [offsets[vertex_count]], a joint once a vertex at most */
  /* [offsets[vertex_count]], sum 1 a vertex, less what a vertex of over TW_INFLUENCES_MAX joints loses. */
  float *weights;
  size_t capacity;
} tw_influences;

/* Reads the influences of a checked mesh and scales them to sum 1; a point without weights gets joint 0.
 * point_of: [vertex_count] points of the mesh, or NULL when vertices are the points. TW_NO_MEMORY. */
tw_status tw_influences_init(tw_influences *influences, const tw_mesh *mesh, const uint32_t *point_of,
                             uint32_t vertex_count);
void tw_influences_deinit(tw_influences *influences);
size_t tw_influences_size(const tw_influences *influences);

/* Replaces the influences by those of the next level. TW_NO_MEMORY. */
tw_status tw_influences_refine(tw_influences *influences, const tw_topology *parent, const tw_rules *rules);

/* Replaces the influences by those of the vertices listed, no more than there are. TW_NO_MEMORY. */
tw_status tw_influences_keep(tw_influences *influences, const uint32_t *vertices, uint32_t count);

/* ---- rows of patches and of vertices --------------------------------------------------------- */

/* A weighted sum of influences. */
typedef struct tw_joint_sum {
  uint32_t count;
  uint16_t *joints; /* [count] in the order in which they were added */
  float *weights;   /* [count] */
  uint32_t *places; /* [joint_count] 1 + each joint's index in `joints`, 0 when it has not been added */
} tw_joint_sum;

/* Scratch memory of a reader; a zeroed one may be deinited. */
typedef struct tw_skin_scratch {
  tw_joint_sum sum;
  float *controls; /* [vertices][4] weights of four joints at a patch's control points */
  float *values;   /* [rows][4] weights of the four joints at the patch's points */
} tw_skin_scratch;

tw_status tw_skin_scratch_init(tw_skin_scratch *scratch, uint32_t joint_count, uint32_t vertex_count,
                               uint32_t row_count);
void tw_skin_scratch_deinit(tw_skin_scratch *scratch);

/* The columns that joints and weights are written to: the heaviest joints of a point, heaviest first, of
 * equal weights the lower joint first; weights of sum 1; joint 0 where a weight is 0. */
typedef struct tw_skin_columns {
  float *joints, *weights; /* of the first row */
  uint32_t width;          /* joints of a row */
  uint32_t stride;         /* floats from row to row */
} tw_skin_columns;

/* Part of a patch, whose points can be moved by the joints of its control points. */
typedef struct tw_skin_patch {
  const tw_influences *influences;
  const tw_patches *patches;
  uint32_t quad;
  tw_patch_rect rect;
  bool limit, backwards; /* as tw_patch_job has them */
  double *patch_scratch;
} tw_skin_patch;

void tw_skin_patch_rows(const tw_skin_patch *patch, tw_skin_scratch *scratch, tw_skin_columns out);

/* Writes one row: the sum of the mask's vertices, weighted by its position entries. */
void tw_skin_mask_row(const tw_influences *influences, const tw_limit_entry *mask, uint32_t count,
                      tw_skin_scratch *scratch, tw_skin_columns out);

/* ---- rows of a level that is kept whole ------------------------------------------------------ */

enum { TW_SKIN_LEVEL_JOINTS_MAX = 512 };

/* Whether all joints of a checked mesh are below TW_SKIN_LEVEL_JOINTS_MAX, as tw_skin_refine_levels needs. */
bool tw_skin_fits_levels(const tw_mesh *mesh);

/* Computes the joints and weights of all points of the last level, or of their limits. width: joints of a
 * row. *out: [tw_shallow_points][2 x width] joints, then weights, for tw_free. TW_NO_MEMORY, TW_CANCELLED. */
tw_status tw_skin_refine_levels(const tw_shallow *levels, const tw_influences *cage, bool limit,
                                uint32_t width, const tw_parallel_for *parallel, float **out);

/* Bytes of these rows. */
static inline size_t tw_skin_level_size(const tw_shallow *levels, uint32_t width) {
  return 2 * (size_t)tw_shallow_points(levels) * width * sizeof(float);
}

#endif
