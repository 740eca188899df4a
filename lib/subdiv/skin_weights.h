/* Which joints move each vertex, and how much. The weights of one joint over all vertices are a function that
 * subdivides as positions do. So a vertex of a refined mesh may have more joints than the four that
 * a row holds; up to TW_INFLUENCES_MAX are kept. */
#ifndef TWEEND_SKIN_WEIGHTS_H
#define TWEEND_SKIN_WEIGHTS_H

#include "irregular_levels.h"
#include "patch.h"

/* Joints kept a vertex, the heaviest ones. Regular meshes have at most 36 a refined vertex; this bounds what
 * great polygons can ask for. */
enum { TW_INFLUENCES_MAX = 64 };

/* Owns its arrays; a zeroed one may be deinited. */
typedef struct tw_influences {
  uint32_t vertex_count;
  uint32_t joint_count; /* greatest joint + 1 */
  size_t *offsets;      /* [vertex_count + 1] */
  uint16_t *joints;     /* [offsets[vertex_count]], no joint twice a vertex */
  float *weights;       /* sum 1 a vertex, but for what a vertex of over TW_INFLUENCES_MAX joints loses */
  size_t capacity;
} tw_influences;

/* Those of a checked mesh, brought to sum 1; a point without weights hangs on joint 0.
 * point_of: [vertex_count] points of the mesh, or NULL when they are the vertices. TW_NO_MEMORY. */
tw_status tw_influences_init(tw_influences *influences, const tw_mesh *mesh, const uint32_t *point_of,
                             uint32_t vertex_count);
void tw_influences_deinit(tw_influences *influences);
size_t tw_influences_size(const tw_influences *influences);

/* Replaces them by those of the next level. */
tw_status tw_influences_refine(tw_influences *influences, const tw_topology *parent, const tw_rules *rules);

/* Replaces them by those of some of the vertices. */
tw_status tw_influences_keep(tw_influences *influences, const uint32_t *vertices, uint32_t count);

/* ---- rows of patches and of vertices ---------------------------------------------------------- */

/* A weighted sum of influences. */
typedef struct tw_joint_sum {
  uint32_t count;
  uint16_t *joints; /* [count] in the order they came */
  float *weights;   /* [count] */
  uint32_t *places; /* [joint_count] 1 + place of each joint, 0 when it has not come */
} tw_joint_sum;

/* The four heaviest joints of a point, heaviest first, of equal ones the lower. */
typedef struct tw_skin_row {
  uint16_t joints[4];
  float weights[4]; /* sum 1 */
} tw_skin_row;

/* Scratch memory of a reader; a zeroed one may be deinited. */
typedef struct tw_skin_scratch {
  tw_joint_sum sum;
  float *controls;   /* [vertices][4] weights of four joints at the control points of a patch */
  float *values;     /* [rows][4] and at its points */
  tw_skin_row *rows; /* [rows] */
} tw_skin_scratch;

tw_status tw_skin_scratch_init(tw_skin_scratch *scratch, uint32_t joint_count, uint32_t vertex_count,
                               uint32_t row_count);
void tw_skin_scratch_deinit(tw_skin_scratch *scratch);

/* Where rows get their joints and weights. */
typedef struct tw_skin_columns {
  float *joints, *weights; /* of the first row */
  uint32_t stride;         /* floats from row to row */
} tw_skin_columns;

void tw_skin_write_rows(const tw_skin_row *rows, size_t count, tw_skin_columns out);

/* Part of a patch. A patch hangs on the joints of its control points. */
typedef struct tw_skin_patch {
  const tw_influences *influences;
  const tw_patches *patches;
  uint32_t quad;
  tw_patch_rect rect;
  bool limit, backwards; /* as tw_patch_job has them */
  double *patch_scratch;
} tw_skin_patch;

void tw_skin_patch_rows(const tw_skin_patch *patch, tw_skin_scratch *scratch, tw_skin_columns out);

/* One row: a sum of vertices by the positions of a limit mask. */
void tw_skin_mask_row(const tw_influences *influences, const tw_limit_entry *mask, uint32_t count,
                      tw_skin_scratch *scratch, tw_skin_columns out);

/* ---- rows of a level that is kept whole ------------------------------------------------------- */

enum { TW_SKIN_LEVEL_JOINTS_MAX = 512 };

/* Whether tw_skin_refine_levels can take a checked mesh's joints. */
bool tw_skin_fits_levels(const tw_mesh *mesh);

/* Rows of all points of the last level, or of their limits. out: [tw_levels_points], to be freed.
 * TW_NO_MEMORY. */
tw_status tw_skin_refine_levels(const tw_levels *levels, const tw_influences *cage, bool limit,
                                const tw_parallel_for *parallel, tw_skin_row **out);

#endif
