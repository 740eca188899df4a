/* Triangles of a Loop mesh that are not regular: generic steps on the faces and those around them. After each
 * step all but these are cut away. Points at the cut are wrong, but no step reads them. */
#include <string.h>

#include "limit.h"
#include "loop_lattice.h"
#include "normal.h"
#include "refine.h"

enum { FACES_AT_ONCE = 1 << 15 }; /* of the last level */

/* Some faces and those around them, at one level. The wanted faces come first. */
typedef struct chunk {
  tw_arena *arena;
  tw_topology topology;
  double *values; /* [vertices][width of the job's values] */
  uint32_t wanted;
} chunk;

/* Lists the corners of the wanted faces, then those of all further faces that touch them; NULL without
 * memory. faces: [wanted]; NULL: the first ones. */
static uint32_t *list_corners(const tw_topology *t, const uint32_t *faces, uint32_t wanted, uint32_t *count) {
  uint8_t *is_listed = tw_alloc_zero(t->face_count, 1);
  uint32_t *corners = is_listed ? tw_alloc(t->corner_count, sizeof *corners) : NULL, written = 0;
  for (uint32_t i = 0; corners && i < wanted; i++) {
    uint32_t face = faces ? faces[i] : i;
    is_listed[face] = 1;
    for (uint32_t k = 0; k < 3; k++) corners[written++] = 3 * face + k;
  }
  for (uint32_t c = 0; corners && c < 3 * wanted; c++) {
    uint32_t vertex = t->corner_vertex[corners[c]];
    for (uint32_t i = t->fan_offsets[vertex]; i < t->fan_offsets[vertex + 1]; i++) {
      uint32_t face = t->fan_corners[i] / 3;
      for (uint32_t k = 0; k < 3 && !is_listed[face]; k++) corners[written++] = 3 * face + k;
      is_listed[face] = 1;
    }
  }
  *count = written;
  tw_free(is_listed);
  return corners;
}

/* Cuts the wanted faces and those around them out of a level. faces: [wanted]; NULL: the first ones. */
static tw_status cut(const tw_lattice_source *from, const tw_rules *rules, const uint32_t *faces,
                     uint32_t wanted, chunk *out) {
  const tw_topology *t = from->topology;
  size_t width = from->width;
  uint32_t count, *vertices, *corners = list_corners(t, faces, wanted, &count);
  *out = (chunk){.arena = tw_arena_create(), .wanted = wanted};
  tw_status status = corners && out->arena ? TW_OK : TW_NO_MEMORY;
  if (status == TW_OK)
    status = tw_topology_cut(t, count / 3, NULL, count, corners, out->arena, &out->topology, &vertices);
  if (status == TW_OK && rules->chaikin) status = tw_topology_sum_semi(&out->topology, out->arena);
  tw_free(corners);
  if (status != TW_OK) return status;
  out->values = tw_arena_alloc_raw(out->arena, out->topology.vertex_count, width * sizeof *out->values);
  for (size_t v = 0; out->values && v < out->topology.vertex_count; v++)
    for (size_t c = 0; c < width; c++) {
      size_t place = vertices[v] * width + c;
      out->values[v * width + c] = from->exact ? from->exact[place] : (double)from->rounded[place];
    }
  return out->values ? TW_OK : TW_NO_MEMORY;
}

/* Makes the next level of a chunk, with all children of its faces. */
static tw_status refine(const tw_lattice_job *job, const chunk *at, chunk *out) {
  uint32_t width = job->source.width;
  *out = (chunk){.arena = tw_arena_create(), .wanted = 4 * at->wanted};
  if (!out->arena) return TW_NO_MEMORY;
  tw_status status = tw_refine_topology(&at->topology, job->rules, out->arena, NULL, &out->topology);
  if (status != TW_OK) return status;
  out->values = tw_arena_alloc_raw(out->arena, out->topology.vertex_count, width * sizeof *out->values);
  if (!out->values) return TW_NO_MEMORY;
  return tw_refine_values(&at->topology, job->rules, width, at->values, NULL, out->values);
}

/* Replaces a chunk by the next level. is_last: no step follows, so that nothing needs to be cut away. */
static tw_status step(const tw_lattice_job *job, bool is_last, chunk *at) {
  chunk child, next;
  tw_status status = refine(job, at, &child);
  tw_arena_destroy(at->arena);
  *at = child;
  if (status != TW_OK || is_last) return status;
  const tw_lattice_source from = {&child.topology, child.values, NULL, job->source.width};
  status = cut(&from, job->rules, NULL, child.wanted, &next);
  tw_arena_destroy(child.arena);
  *at = next;
  return status;
}

/* ---- rows ----------------------------------------------------------------------------------- */

/* Writes a row from the limit mask of a corner. */
static void put_limit(const tw_lattice_job *job, const chunk *at, uint32_t corner, tw_limit_entry *mask,
                      float *row) {
  const tw_topology *t = &at->topology;
  size_t width = job->source.width;
  const double *own = at->values + width * t->corner_vertex[corner];
  uint32_t count = tw_limit_mask(t, job->rules->linear, corner, mask);
  double limit[4] = {0}, along[2][4] = {{0}, {0}};
  for (const tw_limit_entry *e = mask; e < mask + count; e++) {
    const double *to = at->values + width * e->vertex;
    for (size_t c = 0; c < width; c++) {
      limit[c] += (double)e->position * (to[c] - own[c]);
      along[0][c] += (double)e->tangent1 * (to[c] - own[c]);
      along[1][c] += (double)e->tangent2 * (to[c] - own[c]);
    }
  }
  for (size_t c = 0; job->limit && c < width; c++) row[c] = (float)(own[c] + limit[c]);
  if (!job->normals) return;
  tw_point tangents[2] = {{0}, {0}}, quad[4] = {{0}, {0}, {0}, {0}};
  for (size_t c = 0; c < 3; c++) {
    for (int k = 0; k < 2; k++) tangents[k][c] = (float)along[k][c];
    for (uint32_t k = 0; k < 4; k++) {
      uint32_t vertex = t->corner_vertex[corner / 3 * 3 + (k < 3 ? k : 2)];
      quad[k][c] = (float)at->values[3 * (size_t)vertex + c];
    }
  }
  tw_put_normal(tangents[0], tangents[1], quad, row + 3);
}

/* Writes the lattices of the wanted faces. written: [tw_lattice_points] room for marks. */
static void put_rows(const tw_lattice_job *job, const chunk *at, uint32_t faces, tw_limit_entry *mask,
                     uint8_t *written, float *out) {
  uint32_t side = 1u << job->depth, points = tw_lattice_points(side), children = side * side,
           width = tw_lattice_width(job), own = job->source.width;
  for (uint32_t f = 0; f < faces; f++, out += (size_t)points * width) {
    memset(written, 0, points);
    for (uint32_t child = 0; child < children; child++) {
      uint32_t corners[3][2];
      tw_lattice_child(job->depth, child, corners);
      for (uint32_t k = 0; k < 3; k++) {
        uint32_t corner = 3 * (f * children + child) + k,
                 place = tw_lattice_place(side, corners[k][0], corners[k][1]);
        const double *value = at->values + own * (size_t)at->topology.corner_vertex[corner];
        float *row = out + (size_t)place * width;
        if (written[place]) continue;
        written[place] = 1;
        for (uint32_t c = 0; c < own; c++) row[c] = (float)value[c];
        if (job->limit || job->normals) put_limit(job, at, corner, mask, row);
      }
    }
  }
}

static tw_status step_faces(const tw_lattice_job *job, uint32_t first, uint32_t count, float *out) {
  chunk at;
  tw_status status = cut(&job->source, job->rules, job->faces + first, count, &at);
  for (uint32_t level = 0; level < job->depth && status == TW_OK; level++)
    status = step(job, level + 1 == job->depth, &at);
  tw_limit_entry *mask =
      status == TW_OK ? tw_alloc(tw_limit_greatest_capacity(&at.topology), sizeof *mask) : NULL;
  uint8_t *written = tw_alloc(tw_lattice_points(1u << job->depth), 1);
  if (status == TW_OK && !(mask && written)) status = TW_NO_MEMORY;
  if (status == TW_OK) put_rows(job, &at, count, mask, written, out);
  tw_free(mask);
  tw_free(written);
  tw_arena_destroy(at.arena);
  return status;
}

tw_status tw_lattice_steps(const tw_lattice_job *job, float *out) {
  uint32_t most = FACES_AT_ONCE >> 2 * job->depth;
  size_t size = (size_t)tw_lattice_points(1u << job->depth) * tw_lattice_width(job);
  if (most == 0) most = 1;
  tw_status status = TW_OK;
  for (uint32_t first = 0, taken; first < job->count && status == TW_OK; first += taken) {
    taken = job->count - first < most ? job->count - first : most;
    status = tw_parallel_for_status(job->parallel);
    if (status == TW_OK) status = step_faces(job, first, taken, out + first * size);
  }
  return status;
}
