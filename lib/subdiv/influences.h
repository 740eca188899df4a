/* Which joints move each vertex, and how much. The weights of one joint over all vertices are a function that
 * subdivides as positions do. So a vertex of a refined mesh may hang on more joints than the four that
 * an answer shows; all are kept until a row is written. */
#ifndef TWEEND_INFLUENCES_H
#define TWEEND_INFLUENCES_H

#include "refine.h"

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

/* Replaces them by those of the next level; loop: of Loop's scheme. */
tw_status tw_influences_refine(tw_influences *influences, const tw_topology *parent, const tw_rules *rules,
                               bool loop);

/* Replaces them by those of some of the vertices. */
tw_status tw_influences_keep(tw_influences *influences, const uint32_t *vertices, uint32_t count);

/* A weighted sum of influences. */
typedef struct tw_joint_sum {
  uint32_t count;
  uint16_t *joints; /* [count] in the order they came */
  float *weights;   /* [count] */
  uint32_t *places; /* [joint_count] 1 + place of each joint, 0 when it has not come */
} tw_joint_sum;

tw_status tw_joint_sum_init(tw_joint_sum *sum, uint32_t joint_count);
void tw_joint_sum_deinit(tw_joint_sum *sum);
void tw_joint_sum_clear(tw_joint_sum *sum);
void tw_joint_sum_add(tw_joint_sum *sum, const tw_influences *influences, uint32_t vertex, float share);

/* The four heaviest joints of a row, heaviest first, of equal ones the lower. Weights start as 0. */
void tw_four_insert(float joints[4], float weights[4], uint16_t joint, float weight);
/* Brings their sum to 1. */
void tw_four_finish(float joints[4], float weights[4]);

#endif
