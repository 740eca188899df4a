/* Joints and weights of any rows of a surface. A patch hangs on the joints of its control points; their
 * weights are evaluated four joints at a time, as one value of four numbers, and each row keeps the
 * heaviest. */
#include <string.h>

#include "surface_reader.h"

enum { TOGETHER = 4 };

/* The patch at hand and the rows that are written from it. */
typedef struct skin_job {
  tw_surface_reader *reader;
  uint32_t quad;
  tw_patch_rect rect;
  size_t count; /* of rows */
  bool backwards;
  float *joints, *weights; /* columns of the first row */
} skin_job;

static skin_job job_for(tw_surface_reader *r, uint32_t quad, tw_patch_rect rect, float *out) {
  const tw_surface_layout *l = &r->surface->layout;
  size_t count = (size_t)(rect.i1 - rect.i0 + 1) * (rect.j1 - rect.j0 + 1);
  return (skin_job){r, quad, rect, count, false, out + l->joints, out + l->weights};
}

static void clear_rows(const skin_job *job) {
  uint32_t stride = job->reader->surface->layout.stride;
  for (size_t i = 0; i < job->count; i++) {
    memset(job->joints + i * stride, 0, 4 * sizeof(float));
    memset(job->weights + i * stride, 0, 4 * sizeof(float));
  }
}

/* Weights of the joints from place `first` on, at the control points. */
static void load_controls(const skin_job *job, const uint32_t *controls, uint32_t count, uint32_t first) {
  const tw_influences *in = &job->reader->surface->influences;
  const uint32_t *places = job->reader->joints.places;
  for (uint32_t i = 0; i < count; i++) {
    float *row = job->reader->joint_controls + 4 * (size_t)controls[i];
    memset(row, 0, 4 * sizeof *row);
    for (size_t e = in->offsets[controls[i]]; e < in->offsets[controls[i] + 1]; e++) {
      uint32_t place = places[in->joints[e]] - 1;
      if (place >= first && place < first + TOGETHER) row[place - first] = in->weights[e];
    }
  }
}

/* Evaluates what load_controls has set, and offers it to the rows. */
static void offer(const skin_job *job, uint32_t first) {
  tw_surface_reader *r = job->reader;
  uint32_t stride = r->surface->layout.stride, left = r->joints.count - first;
  tw_patch_job patch = {.in = r->joint_controls,
                        .width = TOGETHER,
                        .limit = r->surface->options.limit,
                        .values = r->joint_rows,
                        .stride = TOGETHER,
                        .scratch = r->scratch};
  tw_patch_evaluate(&r->surface->fields[0].patches, job->quad, &patch, job->rect);
  for (size_t i = 0; i < job->count; i++) {
    const float *row = r->joint_rows + TOGETHER * (job->backwards ? job->count - 1 - i : i);
    for (uint32_t k = 0; k < TOGETHER && k < left; k++)
      tw_four_insert(job->joints + i * stride, job->weights + i * stride, r->joints.joints[first + k],
                     row[k]);
  }
}

static void write_rows(const skin_job *job) {
  tw_surface_reader *r = job->reader;
  const tw_surface *s = r->surface;
  uint32_t count, stride = s->layout.stride;
  const uint32_t *controls = tw_patch_controls(&s->fields[0].patches, job->quad, &count);
  tw_joint_sum_clear(&r->joints);
  for (uint32_t i = 0; i < count; i++) tw_joint_sum_add(&r->joints, &s->influences, controls[i], 1);
  clear_rows(job);
  if (r->joints.count == 1) { /* nothing to weigh it against */
    for (size_t i = 0; i < job->count; i++)
      tw_four_insert(job->joints + i * stride, job->weights + i * stride, r->joints.joints[0], 1);
    return;
  }
  for (uint32_t first = 0; first < r->joints.count; first += TOGETHER) {
    load_controls(job, controls, count, first);
    offer(job, first);
  }
  for (size_t i = 0; i < job->count; i++) tw_four_finish(job->joints + i * stride, job->weights + i * stride);
}

/* Where no patch covers it, a vertex has its own influences, or those of its limit mask. */
static void write_by_mask(const skin_job *job, uint32_t corner) {
  tw_surface_reader *r = job->reader;
  const tw_surface *s = r->surface;
  const tw_field *field = &s->fields[0];
  tw_joint_sum_clear(&r->joints);
  if (s->options.limit) {
    uint32_t count = tw_limit_mask(&field->base, field->linear, corner, r->mask);
    for (uint32_t e = 0; e < count; e++)
      if (r->mask[e].position != 0)
        tw_joint_sum_add(&r->joints, &s->influences, r->mask[e].vertex, r->mask[e].position);
  } else {
    const tw_influences *own = s->cage_influences.offsets ? &s->cage_influences : &s->influences;
    tw_joint_sum_add(&r->joints, own, field->base.corner_vertex[corner], 1);
  }
  clear_rows(job);
  for (uint32_t i = 0; i < r->joints.count; i++)
    tw_four_insert(job->joints, job->weights, r->joints.joints[i], r->joints.weights[i]);
  tw_four_finish(job->joints, job->weights);
}

void tw_corner_weights(tw_surface_reader *reader, uint32_t corner, float *out) {
  skin_job job = job_for(reader, corner / 4, tw_patch_corner(reader->surface->side, corner % 4), out);
  if (reader->surface->depth == 0)
    write_by_mask(&job, corner);
  else
    write_rows(&job);
}

void tw_edge_weights(tw_surface_reader *reader, uint32_t corner, bool against, float *out) {
  bool backwards;
  tw_patch_rect rect = tw_patch_side(reader->surface->side, corner % 4, &backwards);
  skin_job job = job_for(reader, corner / 4, rect, out);
  job.backwards = backwards != against;
  write_rows(&job);
}

void tw_inside_weights(tw_surface_reader *reader, uint32_t quad, tw_patch_rect rect, float *out) {
  skin_job job = job_for(reader, quad, rect, out);
  write_rows(&job);
}
