/* Neighbourhoods of quads: regular ones as 16 control points, irregular ones as a key under which equal ones
 * are found. */
#ifndef TWEEND_NEIGHBOURHOOD_H
#define TWEEND_NEIGHBOURHOOD_H

#include "topology.h"

/* A quad with all faces that touch it, in canonical order: first the quad, then the faces counter-clockwise
 * round its corners 0, 1, 2, 3. Each face begins at the corner at which it is met; points are numbered in the
 * order in which they are met. */
typedef struct tw_neighbourhood {
  uint32_t point_count, face_count;
  bool chaikin; /* its creases decay by Chaikin's rule */
  size_t key_size;
  uint32_t hash;
  /* The key: two neighbourhoods are the same when their keys are equal. */
  uint32_t (*quads)[4];    /* [face_count] */
  float (*sharpness)[4];   /* [face_count], of the edges that touch the quad's corners; 0 for others */
  float *vertex_sharpness; /* [4] */
  /* As in tw_topology, at the ends of those edges that are semi-sharp, else 0. NULL: not Chaikin's rule. */
  float *semi_sum;      /* [point_count] */
  uint32_t *semi_count; /* [point_count] */
} tw_neighbourhood;

/* Points the arrays of a neighbourhood into `key`, which has the size that the result's key_size says. */
tw_neighbourhood tw_neighbourhood_lay_out(void *key, uint32_t points, uint32_t faces, bool chaikin);

/* Finds the 16 control points of the quad that begins at `corner`, rows of four from (-1, -1). Places beyond
 * reflected sides repeat the quad's first corner. *reflected: bit s is set where side s is a border or
 * infinitely sharp. False when the quad is not regular. */
bool tw_patch_regular(const tw_topology *topology, uint32_t corner, uint32_t points[16], uint8_t *reflected);

/* Collects neighbourhoods of quads of one topology, one at a time. */
typedef struct tw_collector tw_collector;

/* The topology outlives the collector. NULL without memory. */
tw_collector *tw_collector_create(const tw_topology *topology, bool chaikin);
void tw_collector_destroy(tw_collector *collector);

/* Collects the neighbourhood of the quad that begins at `corner`. The result and *points, the topology's
 * vertices of its points, are valid until the collector's next call. NULL when it has over 1,024 faces or
 * points, which is more than a class pays for. */
const tw_neighbourhood *tw_collector_find(tw_collector *collector, uint32_t corner, const uint32_t **points);

#endif
