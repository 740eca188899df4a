/* The step of either scheme. Values of face points are computed first, because edges and vertices take shares
 * of them. */
#include "refine.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "catmull_clark.h"
#include "loop.h"

tw_status tw_refine_topology(const tw_topology *parent, const tw_rules *rules, tw_arena *arena,
                             const tw_parallel_for *parallel, tw_topology *child) {
  return rules->loop ? tw_loop_topology(parent, rules, arena, parallel, child)
                     : tw_catmull_clark_topology(parent, rules, arena, parallel, child);
}

uint32_t tw_refine_mask(const tw_topology *parent, const tw_rules *rules, uint32_t child, tw_share *shares) {
  return rules->loop ? tw_loop_mask(parent, rules, child, shares)
                     : tw_catmull_clark_mask(parent, rules, child, shares);
}

static uint32_t larger(uint32_t a, uint32_t b) {
  return a > b ? a : b;
}

uint32_t tw_refine_mask_capacity(const tw_topology *p) {
  uint32_t capacity = 1;
  for (uint32_t f = 0; f < p->face_count; f++) capacity = larger(capacity, tw_face_size(p, f));
  for (uint32_t v = 0; v < p->vertex_count; v++)
    capacity = larger(capacity, 1 + p->ring_offsets[v + 1] - p->ring_offsets[v] + p->fan_offsets[v + 1] -
                                    p->fan_offsets[v]);
  /* An edge's mask is no larger: its faces are among those of its ends, and its two ends come on top. */
  return capacity + 2;
}

/* ---- values ---------------------------------------------------------------------------------- */

enum { WIDTH_MAX = 4 };

typedef struct values_job {
  const tw_topology *parent;
  const tw_rules *rules;
  uint32_t width, capacity; /* capacity: shares of the largest mask */
  uint32_t first;           /* the child's vertex that the loop begins with */
  const double *in;
  double *out;
  atomic_bool failed;
} values_job;

/* Sums a mask relative to the first share's value: masks sum to 1, so no large terms cancel. */
static inline void sum_shares(const values_job *j, const tw_share *shares, uint32_t count, uint32_t width,
                              double *out) {
  const double *first = j->in + (size_t)shares[0].vertex * width;
  double sum[WIDTH_MAX] = {0};
  for (uint32_t i = 1; i < count; i++) {
    uint32_t vertex = shares[i].vertex;
    const double *value = (vertex < j->parent->vertex_count ? j->in : j->out) + (size_t)vertex * width;
    for (uint32_t c = 0; c < width; c++) sum[c] += (double)shares[i].weight * (value[c] - first[c]);
  }
  for (uint32_t c = 0; c < width; c++) out[c] = first[c] + sum[c];
}

static void sum_masks(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  values_job *j = context;
  tw_share *shares = tw_alloc(j->capacity, sizeof *shares);
  (void)part;
  if (!shares) atomic_store(&j->failed, true);
  for (uint32_t child = j->first + begin; shares && child < j->first + end; child++) {
    uint32_t count = tw_refine_mask(j->parent, j->rules, child, shares);
    double *out = j->out + (size_t)child * j->width;
    if (j->width == 3) /* points; a known width lets the compiler unroll */
      sum_shares(j, shares, count, 3, out);
    else
      sum_shares(j, shares, count, j->width, out);
  }
  tw_free(shares);
}

tw_status tw_refine_values(const tw_topology *parent, const tw_rules *rules, uint32_t width, const double *in,
                           const tw_parallel_for *parallel, double *out) {
  uint32_t others = parent->vertex_count + parent->edge_count, faces = tw_refine_face_points(parent, rules);
  values_job job = {.parent = parent, .rules = rules, .width = width, .first = others, .in = in, .out = out};
  job.capacity = tw_refine_mask_capacity(parent);
  tw_parallel_for_run(parallel, faces, TW_PARALLEL_FOR_LEAST, sum_masks, &job);
  job.first = 0;
  tw_parallel_for_run(parallel, others, TW_PARALLEL_FOR_LEAST, sum_masks, &job);
  return atomic_load(&job.failed) ? TW_NO_MEMORY : TW_OK;
}
