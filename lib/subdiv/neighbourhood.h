/* Neighbourhoods of quads: regular ones as 16 control points, irregular ones as what tells them apart. */
#ifndef TWEEND_NEIGHBOURHOOD_H
#define TWEEND_NEIGHBOURHOOD_H

#include "topology.h"

/* A quad with all faces that touch it, in canonical order: faces counter-clockwise round corner 0, then
 * 1, 2, 3; each face begins at that corner; points are numbered as they are met. */
typedef struct tw_neighbourhood {
  uint32_t point_count, face_count;
  bool chaikin; /* the rule of its creases */
  size_t key_size;
  uint32_t hash;
  /* The key: what tells neighbourhoods apart. */
  uint32_t (*quads)[4];    /* [face_count] */
  float (*sharpness)[4];   /* [face_count], of the edges that touch the quad's corners, else 0 */
  float *vertex_sharpness; /* [4] */
  float *semi_sum;         /* [point_count] at the ends of those edges, else 0 (Chaikin only) */
  uint32_t *semi_count;    /* [point_count] */
} tw_neighbourhood;

/* Lays the arrays of a neighbourhood out over `key`, which has as many bytes as its key_size says. */
tw_neighbourhood tw_neighbourhood_lay_out(void *key, uint32_t points, uint32_t faces, bool chaikin);

/* The 16 control points round the quad that begins at `corner`, rows of four from (-1, -1); places
 * beyond reflected sides repeat the quad's first corner. False when the quad is not regular. */
bool tw_patch_regular(const tw_topology *topology, uint32_t corner, uint32_t points[16], uint8_t *reflected);

/* What the neighbourhoods of one topology are collected with. */
typedef struct tw_collector tw_collector;

/* topology outlives it. NULL without memory. */
tw_collector *tw_collector_create(const tw_topology *topology, bool chaikin);
void tw_collector_destroy(tw_collector *collector);

/* The neighbourhood of the quad that begins at `corner`, and its points in the topology; both are valid until
 * the collector's next call. NULL when it has more faces or points than is worth looking at. */
const tw_neighbourhood *tw_collector_find(tw_collector *collector, uint32_t corner, const uint32_t **points);

#endif
