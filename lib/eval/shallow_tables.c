/* The connectivity of levels: tables of all levels but the last, each made from the one above, and numbers
 * that follow from the tables. */
#include "angle.h"
#include "shallow_levels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

/* ---- numbers --------------------------------------------------------------------------------- */

/* The UV set's edge at the points' `edge` of `level`, which lies on no seam. The numbers of edges inside
 * faces come after those of parts of cage edges, in the same order in both. */
static uint32_t channel_edge(const tw_shallow *points, const tw_shallow *set, uint32_t level, uint32_t edge) {
  uint32_t outer = points->at[0].edge_count << level;
  if (edge >= outer) return edge - outer + (set->at[0].edge_count << level);
  uint32_t of = set->edge_of[edge >> level], last = (1u << level) - 1, place = edge & last;
  return ((of >> 1) << level) + (of & 1 ? last - place : place);
}

static uint32_t channel_vertex(const tw_shallow *points, const tw_shallow *set, uint32_t vertex) {
  uint32_t level = points->level;
  while (level > 0 && vertex < points->at[level - 1].vertex_count) level--;
  if (level == 0) return set->vertex_of[vertex];
  const tw_shallow_level *from = &points->at[level - 1], *to = &set->at[level - 1];
  vertex -= from->vertex_count;
  if (vertex >= from->edge_count) return to->vertex_count + to->edge_count + (vertex - from->edge_count);
  return to->vertex_count + channel_edge(points, set, level - 1, vertex);
}

void tw_shallow_channel_vertices(const tw_shallow *points, const tw_shallow *channel, uint32_t first,
                                 uint32_t count, uint32_t *out) {
  for (uint32_t i = 0; i < count; i++)
    out[i] = channel->vertex_of ? channel_vertex(points, channel, first + i) : first + i;
}

/* The cage face that a corner of `level` lies in. */
static uint32_t corner_cage_face(const tw_shallow *levels, uint32_t level, uint32_t corner) {
  return tw_shallow_corner_face(&levels->at[0], levels->at[0].face_size, corner >> 2 * level);
}

/* A cage face that the edge lies in. */
static uint32_t edge_cage_face(const tw_shallow *levels, uint32_t level, uint32_t edge) {
  for (; level > 0; level--, edge /= 2) {
    uint32_t outer = 2 * levels->at[level - 1].edge_count;
    if (edge >= outer) return corner_cage_face(levels, level - 1, edge - outer);
  }
  return corner_cage_face(levels, 0, levels->at[0].edge_corners[edge][0]);
}

static uint32_t vertex_cage_face(const tw_shallow *levels, uint32_t vertex) {
  uint32_t level = levels->level;
  while (level > 0 && vertex < levels->at[level - 1].vertex_count) level--;
  if (level == 0) return corner_cage_face(levels, 0, levels->fan_corners[levels->fan_offsets[vertex]]);
  const tw_shallow_level *l = &levels->at[--level];
  vertex -= l->vertex_count;
  if (vertex < l->edge_count) return edge_cage_face(levels, level, vertex);
  vertex -= l->edge_count;
  return level == 0 ? vertex : corner_cage_face(levels, level - 1, vertex);
}

void tw_shallow_cage_faces(const tw_shallow *levels, uint32_t first, uint32_t count, uint32_t *out) {
  for (uint32_t i = 0; i < count; i++) out[i] = vertex_cage_face(levels, first + i);
}

INLINE void faces_by_size(const tw_shallow_level *level, uint32_t size, uint32_t first, uint32_t end,
                          uint32_t *out) {
  const tw_shallow_level l = *level; /* of its own, so that writing to out does not seem to change it */
  for (uint32_t c = first; c < end; c++, out += 4) {
    out[0] = l.corner_vertex[c];
    out[1] = l.vertex_count + l.corner_half[c] / 2;
    out[2] = l.vertex_count + l.edge_count + tw_shallow_corner_face(&l, size, c);
    out[3] = l.vertex_count + l.corner_half[tw_shallow_corner_previous(&l, size, c)] / 2;
  }
}

void tw_shallow_faces(const tw_shallow *levels, uint32_t first, uint32_t count, uint32_t *out) {
  const tw_shallow_level *l = &levels->at[levels->level - 1];
  if (l->face_size == 4)
    faces_by_size(l, 4, first, first + count, out);
  else if (l->face_size == 3)
    faces_by_size(l, 3, first, first + count, out);
  else
    faces_by_size(l, 0, first, first + count, out);
}

/* ---- the plan -------------------------------------------------------------------------------- */

enum { VALENCE_MAX = 4096 };

bool tw_shallow_fit(const tw_topology *cage) {
  const tw_topology *t = cage;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    if (t->fan_offsets[v + 1] - t->fan_offsets[v] > VALENCE_MAX) return false;
  for (uint32_t f = 0; t->face_offsets && f < t->face_count; f++)
    if (tw_face_size(t, f) > VALENCE_MAX) return false;
  return true;
}

static void *copy(tw_arena *arena, const void *from, size_t count, size_t size) {
  void *to = tw_arena_alloc_raw(arena, count, size);
  if (to && count > 0) memcpy(to, from, count * size);
  return to;
}

typedef struct table_job {
  const tw_topology *cage;       /* the cage, for tables of level 0; else */
  const tw_shallow_level *above; /* the level above the one that tables are made for */
  uint32_t *corner_vertex, *corner_half, (*edge_corners)[2];
} table_job;

static void fill_cage_corners(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const table_job *j = context;
  const tw_topology t = *j->cage;
  uint32_t *out = j->corner_half;
  (void)part;
  for (uint32_t c = begin; c < end; c++) {
    uint32_t edge = t.corner_edge[c];
    out[c] = 2 * edge + (t.edge_vertices[edge][0] != t.corner_vertex[c]);
  }
}

static void fill_cage_edges(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const table_job *j = context;
  const tw_topology *t = j->cage;
  (void)part;
  for (uint32_t e = begin; e < end; e++) {
    j->edge_corners[e][0] = t->edge_corner[e];
    j->edge_corners[e][1] = t->sibling[t->edge_corner[e]];
  }
}

static tw_status make_cage_tables(const tw_topology *t, const tw_parallel_for *parallel, tw_arena *arena,
                                  tw_shallow *out) {
  tw_shallow_level *l = &out->at[0];
  *l = (tw_shallow_level){.vertex_count = t->vertex_count,
                          .edge_count = t->edge_count,
                          .face_count = t->face_count,
                          .corner_count = t->corner_count,
                          .face_size = t->face_size};
  table_job job = {.cage = t,
                   .corner_half = tw_arena_alloc_raw(arena, t->corner_count, sizeof(uint32_t)),
                   .edge_corners = tw_arena_alloc_raw(arena, t->edge_count, sizeof(uint32_t[2]))};
  l->corner_vertex = copy(arena, t->corner_vertex, t->corner_count, sizeof(uint32_t));
  out->fan_offsets = copy(arena, t->fan_offsets, (size_t)t->vertex_count + 1, sizeof(uint32_t));
  out->fan_corners = copy(arena, t->fan_corners, t->corner_count, sizeof(uint32_t));
  bool complete =
      job.corner_half && job.edge_corners && l->corner_vertex && out->fan_offsets && out->fan_corners;
  if (t->face_offsets) {
    l->face_offsets = copy(arena, t->face_offsets, (size_t)t->face_count + 1, sizeof(uint32_t));
    l->corner_face = copy(arena, t->corner_face, t->corner_count, sizeof(uint32_t));
    complete = complete && l->face_offsets && l->corner_face;
  }
  if (!complete) return TW_NO_MEMORY;
  tw_parallel_for_run(parallel, t->corner_count, TW_PARALLEL_FOR_LEAST, fill_cage_corners, &job);
  tw_parallel_for_run(parallel, t->edge_count, TW_PARALLEL_FOR_LEAST, fill_cage_edges, &job);
  l->corner_half = job.corner_half;
  l->edge_corners = (const uint32_t(*)[2])job.edge_corners;
  return TW_OK;
}

static tw_shallow_level next_counts(const tw_shallow_level *l) {
  return (tw_shallow_level){.vertex_count = l->vertex_count + l->edge_count + l->face_count,
                            .edge_count = 2 * l->edge_count + l->corner_count,
                            .face_count = l->corner_count,
                            .corner_count = 4 * l->corner_count,
                            .face_size = 4};
}

/* Writes the quads of corners [begin, end), and the corners of their spokes. */
INLINE void split_corners(const table_job *j, uint32_t size, uint32_t begin, uint32_t end) {
  const tw_shallow_level *l = j->above;
  uint32_t V = l->vertex_count, E = l->edge_count;
  for (uint32_t c = begin; c < end; c++) {
    uint32_t before = tw_shallow_corner_previous(l, size, c), half = l->corner_half[c],
             other = l->corner_half[before];
    uint32_t *vertices = j->corner_vertex + 4 * (size_t)c, *ends = j->corner_half + 4 * (size_t)c;
    vertices[0] = l->corner_vertex[c];
    vertices[1] = V + half / 2;
    vertices[2] = V + E + tw_shallow_corner_face(l, size, c);
    vertices[3] = V + other / 2;
    ends[0] = 2 * half + half % 2;
    ends[1] = 2 * (2 * E + c);
    ends[2] = 2 * (2 * E + before) + 1;
    ends[3] = 2 * (other ^ 1) + other % 2;
    j->edge_corners[2 * E + c][0] = 4 * c + 1;
    j->edge_corners[2 * E + c][1] = 4 * tw_shallow_corner_next(l, size, c) + 2;
  }
}

static void split_all_corners(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const table_job *j = context;
  (void)part;
  if (j->above->face_size == 4)
    split_corners(j, 4, begin, end);
  else if (j->above->face_size == 3)
    split_corners(j, 3, begin, end);
  else
    split_corners(j, 0, begin, end);
}

static void split_edges(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const table_job *j = context;
  const tw_shallow_level *l = j->above;
  (void)part;
  for (uint32_t e = begin; e < end; e++)
    for (uint32_t k = 0; k < 2; k++) {
      uint32_t along = l->edge_corners[e][k], against = l->edge_corners[e][1 - k];
      /* Half 2e + k lies at the start of `along`. Halves run in the direction of the edge, so that `along`
       * runs against the second half. */
      j->edge_corners[2 * e + k][k] = 4 * along;
      j->edge_corners[2 * e + k][1 - k] = 4 * tw_shallow_corner_next(l, l->face_size, against) + 3;
    }
}

static tw_status make_child_tables(const tw_shallow_level *above, const tw_parallel_for *parallel,
                                   tw_arena *arena, tw_shallow_level *l) {
  table_job job = {.above = above,
                   .corner_vertex = tw_arena_alloc_raw(arena, l->corner_count, sizeof(uint32_t)),
                   .corner_half = tw_arena_alloc_raw(arena, l->corner_count, sizeof(uint32_t)),
                   .edge_corners = tw_arena_alloc_raw(arena, l->edge_count, sizeof(uint32_t[2]))};
  if (!job.corner_vertex || !job.corner_half || !job.edge_corners) return TW_NO_MEMORY;
  tw_parallel_for_run(parallel, above->corner_count, TW_PARALLEL_FOR_LEAST, split_all_corners, &job);
  tw_parallel_for_run(parallel, above->edge_count, TW_PARALLEL_FOR_LEAST, split_edges, &job);
  l->corner_vertex = job.corner_vertex;
  l->corner_half = job.corner_half;
  l->edge_corners = (const uint32_t(*)[2])job.edge_corners;
  return TW_OK;
}

static tw_status make_tables(const tw_shallow_inputs *inputs, uint32_t field, tw_arena *arena,
                             tw_shallow *out) {
  const tw_topology *cage = inputs->fields[field], *points = inputs->fields[0];
  tw_shallow *levels = &out[field];
  if (field > 0 && cage->vertex_count == points->vertex_count && cage->edge_count == points->edge_count) {
    memcpy(levels->at, out[0].at, sizeof levels->at); /* without a seam all numbers are the points' */
    levels->fan_offsets = out[0].fan_offsets;
    levels->fan_corners = out[0].fan_corners;
    return TW_OK;
  }
  tw_status status = make_cage_tables(cage, inputs->parallel, arena, levels);
  for (uint32_t p = 1; p <= inputs->level; p++) {
    levels->at[p] = next_counts(&levels->at[p - 1]);
    if (status == TW_OK) status = tw_parallel_for_status(inputs->parallel);
    if (status == TW_OK && p < inputs->level)
      status = make_child_tables(&levels->at[p - 1], inputs->parallel, arena, &levels->at[p]);
  }
  return status;
}

/* Writes the tangent weights of valence n. They are exactly 0 at a quarter turn: cos() leaves a residue
 * there, which coincident points would not cancel and which would pass for a tangent. */
static void fill_weights(uint32_t n, float *out) {
  double step = 2 * TW_PI / n, cosine = cos(step);
  double lambda = (5 + cosine + cos(step / 2) * sqrt(2 * (9 + cosine))) / 16, face = 1 / (4 * lambda - 1);
  for (uint32_t i = 0; i < n; i++) {
    bool quarter = 4 * i == n || 4 * i == 3 * n;
    out[i] = quarter ? 0 : (float)(4 * cos(i * step));
    out[n + i] = (float)(face * (cos(i * step) + cos((i + 1) * step)));
  }
}

/* Finds the valences and the sizes of faces. used: [greatest + 1] flags to set, or NULL: only *greatest is
 * found. */
static void note_valences(const tw_topology *t, uint8_t *used, uint32_t *greatest) {
  for (uint32_t i = 0; i < t->vertex_count + (t->face_offsets ? t->face_count : 0); i++) {
    uint32_t n = i < t->vertex_count ? t->fan_offsets[i + 1] - t->fan_offsets[i]
                                     : tw_face_size(t, i - t->vertex_count);
    if (used) used[n] = 1;
    if (n > *greatest) *greatest = n;
  }
}

/* Makes the tangent weights for the valences of all fields. A UV set can have valences that the points do not
 * have: refining an edge of n faces makes a vertex of 2 n, and where faces run along an edge twice, vertices
 * of a UV set can have more faces than the points'. */
static tw_status make_weights(const tw_shallow_inputs *inputs, tw_arena *arena, tw_shallow *out) {
  uint32_t greatest = 4, size = 0, at = 0;
  for (uint32_t f = 0; f < inputs->field_count; f++) note_valences(inputs->fields[f], NULL, &greatest);
  uint8_t *used = tw_alloc_zero((size_t)greatest + 1, 1);
  if (!used) return TW_NO_MEMORY;
  used[3] = used[4] = 1;
  for (uint32_t f = 0; f < inputs->field_count; f++) note_valences(inputs->fields[f], used, &greatest);
  for (uint32_t n = 1; n <= greatest; n++) size += used[n] ? 2 * n : 0;
  uint32_t *weights_of = tw_arena_alloc(arena, (size_t)greatest + 1, sizeof *weights_of);
  float *weights = tw_arena_alloc(arena, size, sizeof *weights);
  for (uint32_t n = 1; weights_of && weights && n <= greatest; n++) {
    if (!used[n]) continue;
    weights_of[n] = at;
    fill_weights(n, weights + at);
    at += 2 * n;
  }
  tw_free(used);
  out->weights_of = weights_of;
  out->weights = weights;
  return weights_of && weights ? TW_OK : TW_NO_MEMORY;
}

/* Maps vertices and edges of the points to those of a channel. */
static tw_status map_channel(const tw_topology *points, const tw_topology *set, tw_arena *arena,
                             tw_shallow *out) {
  if (set->vertex_count == points->vertex_count && set->edge_count == points->edge_count) return TW_OK;
  uint32_t *vertex_of = tw_arena_alloc_raw(arena, points->vertex_count, sizeof *vertex_of),
           *edge_of = tw_arena_alloc_raw(arena, points->edge_count, sizeof *edge_of);
  if (!vertex_of || !edge_of) return TW_NO_MEMORY;
  for (uint32_t v = 0; v < points->vertex_count; v++)
    vertex_of[v] = set->corner_vertex[points->fan_corners[points->fan_offsets[v]]];
  for (uint32_t e = 0; e < points->edge_count; e++) {
    uint32_t corner = points->edge_corner[e], edge = set->corner_edge[corner];
    edge_of[e] = 2 * edge + (set->edge_vertices[edge][0] != set->corner_vertex[corner]);
  }
  out->vertex_of = vertex_of;
  out->edge_of = edge_of;
  return TW_OK;
}

tw_status tw_shallow_plan(const tw_shallow_inputs *inputs, tw_arena *arena, tw_shallow *out,
                          tw_shallow_rows *rows) {
  tw_status status = TW_OK;
  for (uint32_t f = 0; f < inputs->field_count && status == TW_OK; f++) {
    out[f] = (tw_shallow){.level = inputs->level, .linear = inputs->linear[f]};
    status = make_tables(inputs, f, arena, out);
    if (status == TW_OK && f > 0) status = map_channel(inputs->fields[0], inputs->fields[f], arena, &out[f]);
  }
  if (status == TW_OK && inputs->normals) status = make_weights(inputs, arena, &out[0]);
  for (uint32_t f = 1; f < inputs->field_count; f++) {
    out[f].weights_of = out[0].weights_of;
    out[f].weights = out[0].weights;
  }
  return status == TW_OK ? tw_shallow_list_exceptions(inputs, arena, out, rows) : status;
}
