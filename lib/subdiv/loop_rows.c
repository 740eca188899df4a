/* Two levels down is a step over a mesh of which only the points are there (its middles, below). What is
 * sharp in it are the halves of the sharp edges above, and the sharp vertices above. */
#include "loop_rows.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "loop_mask.h"

/* ---- numbers -------------------------------------------------------------------------------- */

/* Sharpness that is over within a number of levels, or never. */
static bool settles(float sharpness, uint32_t levels) {
  return !tw_is_semi_sharp(sharpness) || sharpness <= (float)levels;
}

static bool settles_in(const tw_topology *cage, const tw_rules *rules, uint32_t levels) {
  if (cage->smooth) return true;
  if (rules->chaikin) levels = 0; /* what decays by Chaikin's rule may last a little longer */
  for (uint32_t e = 0; e < cage->edge_count; e++)
    if (!settles(cage->edge_sharpness[e], levels)) return false;
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    if (!settles(cage->vertex_sharpness[v], levels)) return false;
  return true;
}

uint32_t tw_loop_rows_fit(const tw_topology *cage, const tw_rules *rules, uint32_t level) {
  if (level < 2) return level;
  return settles_in(cage, rules, level - 2) ? 2 : 1;
}

bool tw_loop_rows_fit_normals(const tw_topology *cage, const tw_rules *rules, uint32_t level) {
  return settles_in(cage, rules, level < 2 ? 0 : level - 2) && !tw_topology_parts_normals(cage);
}

static tw_topology next_counts(const tw_topology *t) {
  return (tw_topology){.vertex_count = t->vertex_count + t->edge_count,
                       .edge_count = 2 * t->edge_count + t->corner_count,
                       .face_count = 4 * t->face_count,
                       .corner_count = 4 * t->corner_count,
                       .face_size = 3};
}

tw_topology tw_loop_rows_counts(const tw_loop_rows *rows) {
  tw_topology t = next_counts(&rows->above);
  return rows->levels == 1 ? t : next_counts(&t);
}

/* ---- points --------------------------------------------------------------------------------- */

/* The mesh between, as numbers and points. */
typedef struct between {
  const tw_topology *t;
  const double *points, *middles; /* the middles of edges above */
} between;

static const double *vertex_point(const between *b, uint32_t vertex) {
  return b->points + 3 * (size_t)vertex;
}
static const double *middle_point(const between *b, uint32_t edge) {
  return b->middles + 3 * (size_t)edge;
}
/* Of the edge at a corner. */
static const double *middle_at(const between *b, uint32_t corner) {
  return middle_point(b, b->t->corner_edge[corner]);
}

static bool is_sharp(const tw_topology *t, uint32_t edge) {
  return !t->smooth && t->edge_sharpness[edge] > 0;
}

static void smooth_vertex(const between *b, uint32_t vertex, double *restrict row) {
  const tw_topology *t = b->t;
  uint32_t first = t->ring_offsets[vertex], valence = t->ring_offsets[vertex + 1] - first;
  double ring[3] = {0};
  for (uint32_t i = 0; i < valence; i++) tw_loop_add(ring, middle_point(b, t->ring_edges[first + i]), 3);
  tw_loop_smooth(vertex_point(b, vertex), ring, valence, tw_loop_weight(valence), 3, row);
}

static void take_vertices(const between *b, uint32_t begin, uint32_t end, double *restrict out) {
  const tw_topology *t = b->t;
  for (uint32_t v = begin; v < end; v++, out += 3) {
    uint32_t ends[2] = {0, 0};
    tw_vertex_rule rule = t->smooth ? TW_RULE_SMOOTH : tw_vertex_rule_at(t, v, ends);
    const uint32_t *ring = t->ring_edges + t->ring_offsets[v];
    if (rule <= TW_RULE_DART)
      smooth_vertex(b, v, out);
    else if (rule == TW_RULE_CREASE)
      tw_loop_crease(vertex_point(b, v), middle_point(b, ring[ends[0]]), middle_point(b, ring[ends[1]]), 3,
                     out);
    else
      memcpy(out, vertex_point(b, v), 3 * sizeof *out);
  }
}

/* All that shapes the surface near the middle of an edge above that is smooth: its ends, and the middles of
 * the other edges of its two faces, in the faces' order from the edge on. */
typedef struct edge_points {
  const double *ends[2], *middle, *ahead[2], *behind[2];
} edge_points;

static inline edge_points points_at(const between *b, uint32_t edge) {
  const tw_topology *t = b->t;
  uint32_t corners[2] = {t->edge_corner[edge], t->sibling[t->edge_corner[edge]]};
  edge_points p = {.middle = middle_point(b, edge)};
  for (int i = 0; i < 2; i++) {
    p.ends[i] = vertex_point(b, t->edge_vertices[edge][i]);
    p.ahead[i] = middle_at(b, tw_triangle_next(corners[i]));
    p.behind[i] = middle_at(b, tw_triangle_previous(corners[i]));
  }
  return p;
}

static void take_middles(const between *b, uint32_t begin, uint32_t end, double *restrict out) {
  for (uint32_t e = begin; e < end; e++, out += 3) {
    double ring[3] = {0};
    if (is_sharp(b->t, e)) {
      const uint32_t *ends = b->t->edge_vertices[e];
      tw_loop_crease(middle_point(b, e), vertex_point(b, ends[0]), vertex_point(b, ends[1]), 3, out);
    } else {
      edge_points p = points_at(b, e);
      for (int i = 0; i < 2; i++) { /* counter-clockwise */
        tw_loop_add(ring, p.ends[1 - i], 3);
        tw_loop_add(ring, p.ahead[i], 3);
        tw_loop_add(ring, p.behind[i], 3);
      }
      tw_loop_smooth(p.middle, ring, 6, 0.0625, 3, out);
    }
  }
}

/* Halves of edges above. */
static void take_halves(const between *b, uint32_t begin, uint32_t end, double *restrict out) {
  for (uint32_t half = begin; half < end; half++, out += 3) {
    uint32_t edge = half / 2, at = half % 2;
    if (is_sharp(b->t, edge)) {
      tw_loop_sharp_middle(vertex_point(b, b->t->edge_vertices[edge][at]), middle_point(b, edge), 3, out);
    } else {
      edge_points p = points_at(b, edge);
      tw_loop_smooth_middle(p.ends[at], p.middle, p.behind[at], p.ahead[1 - at], 3, out);
    }
  }
}

/* Edges between the middles of a face's edges. */
static void take_across(const between *b, uint32_t begin, uint32_t end, double *restrict out) {
  for (uint32_t c = begin; c < end; c++, out += 3) {
    tw_loop_smooth_middle(middle_at(b, c), middle_at(b, tw_triangle_previous(c)),
                          vertex_point(b, b->t->corner_vertex[c]), middle_at(b, tw_triangle_next(c)), 3, out);
  }
}

static uint32_t least(uint32_t a, uint32_t b) {
  return a < b ? a : b;
}

static void points_two_down(const between *b, uint32_t first, uint32_t count, double *out) {
  const tw_topology *t = b->t;
  uint32_t end = first + count, middles = t->vertex_count, halves = middles + t->edge_count,
           across = halves + 2 * t->edge_count;
  assert(first < end);
  while (first < end) {
    uint32_t stop = end;
    if (first < middles)
      take_vertices(b, first, stop = least(end, middles), out);
    else if (first < halves)
      take_middles(b, first - middles, (stop = least(end, halves)) - middles, out);
    else if (first < across)
      take_halves(b, first - halves, (stop = least(end, across)) - halves, out);
    else
      take_across(b, first - across, end - across, out);
    out += 3 * (size_t)(stop - first);
    first = stop;
  }
}

/* Rows from the points of the level above them. */
static void compute(const tw_loop_rows *rows, const double *points, uint32_t first, uint32_t count,
                    double *out) {
  const tw_topology *t = &rows->above;
  between b = {t, points, points + 3 * (size_t)t->vertex_count};
  if (rows->levels == 1)
    tw_loop_some_values(t, &rows->rules, 3, points, first, count, out);
  else
    points_two_down(&b, first, count, out);
}

static void round_rows(const double *in, uint32_t count, float *out) {
  for (size_t i = 0; i < 3 * (size_t)count; i++) out[i] = (float)in[i];
}

void tw_loop_rows_points(const tw_loop_rows *rows, const double *kept, uint32_t first, uint32_t count,
                         float *out) {
  enum { BLOCK = 256 }; /* stays in cache until it is rounded */
  double block[3 * BLOCK];
  if (rows->normals) {
    round_rows(kept + 3 * (size_t)first, count, out);
    return;
  }
  for (uint32_t done = 0; done < count; done += BLOCK, out += 3 * (size_t)BLOCK) {
    uint32_t taken = least(count - done, BLOCK);
    compute(rows, kept, first + done, taken, block);
    round_rows(block, taken, out);
  }
}

/* ---- what is kept --------------------------------------------------------------------------- */

size_t tw_loop_rows_kept_count(const tw_loop_rows *rows) {
  const tw_topology *t = &rows->above;
  if (rows->normals) return tw_loop_rows_counts(rows).vertex_count;
  return rows->levels == 1 ? t->vertex_count : (size_t)t->vertex_count + t->edge_count;
}

typedef struct keep_job {
  const tw_loop_rows *rows;
  const double *points;
  double *kept;
} keep_job;

static void keep_rows(void *context, uint32_t part, uint32_t begin, uint32_t end) {
  const keep_job *j = context;
  (void)part;
  compute(j->rows, j->points, begin, end - begin, j->kept + 3 * (size_t)begin);
}

tw_status tw_loop_rows_keep(const tw_loop_rows *rows, const double *points, const tw_parallel_for *parallel,
                            double *kept) {
  const tw_topology *t = &rows->above;
  size_t above = (size_t)t->vertex_count + (rows->levels == 1 ? 0 : t->edge_count);
  double *middle = NULL;
  const double *from = points;
  if (rows->levels == 2) {
    middle = rows->normals ? tw_alloc(above, 3 * sizeof *middle) : kept;
    if (!middle) return TW_NO_MEMORY;
    tw_loop_values(t, &rows->rules, 3, points, parallel, middle);
    from = middle;
  }
  if (rows->normals)
    tw_parallel_for_run(parallel, tw_loop_rows_counts(rows).vertex_count, TW_PARALLEL_FOR_LEAST, keep_rows,
                        &(keep_job){rows, from, kept});
  else if (rows->levels == 1)
    memcpy(kept, points, 3 * above * sizeof *kept);
  if (middle != kept) free(middle);
  return TW_OK;
}

/* ---- triangles ------------------------------------------------------------------------------ */

/* A triangle's vertices, and the edges after each. */
typedef struct triangle {
  uint32_t vertices[3], edges[3];
} triangle;

static triangle triangle_above(const tw_topology *t, uint32_t face) {
  triangle all;
  memcpy(all.vertices, t->corner_vertex + 3 * (size_t)face, sizeof all.vertices);
  memcpy(all.edges, t->corner_edge + 3 * (size_t)face, sizeof all.edges);
  return all;
}

/* The children of a triangle of a mesh with this many vertices. */
static inline void split(const triangle *parent, uint32_t vertices, uint32_t *restrict out) {
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t next = (i + 1) % 3, previous = (i + 2) % 3;
    out[3 * i + i] = parent->vertices[i];
    out[3 * i + next] = vertices + parent->edges[i];
    out[3 * i + previous] = vertices + parent->edges[previous];
    out[9 + i] = vertices + parent->edges[next];
  }
}

/* Those with their edges. */
static inline void split_whole(const tw_topology *t, uint32_t face, triangle children[4]) {
  triangle parent = triangle_above(t, face);
  uint32_t corners[12], across = 2 * t->edge_count + 3 * face;
  split(&parent, t->vertex_count, corners);
  for (uint32_t child = 0; child < 4; child++)
    memcpy(children[child].vertices, corners + 3 * (size_t)child, sizeof children[child].vertices);
  for (uint32_t i = 0; i < 3; i++) {
    uint32_t next = (i + 1) % 3, previous = (i + 2) % 3, edge = parent.edges[i],
             before = parent.edges[previous], vertex = parent.vertices[i];
    children[i].edges[i] = 2 * edge + (t->edge_vertices[edge][0] != vertex);
    children[i].edges[next] = across + i;
    children[i].edges[previous] = 2 * before + (t->edge_vertices[before][0] != vertex);
    children[3].edges[next] = across + i;
  }
}

/* A triangle above after the other: all its rows, or those that are asked for. */
void tw_loop_rows_triangles(const tw_loop_rows *rows, uint32_t first, uint32_t count, uint32_t *out) {
  const tw_topology *t = &rows->above;
  uint32_t each = rows->levels == 1 ? 4 : 16, end = first + count;
  while (first < end) {
    uint32_t face = first / each, skip = first % each, taken = least(each - skip, end - first);
    uint32_t all[48], *corners = taken == each ? out : all;
    if (rows->levels == 1) {
      triangle parent = triangle_above(t, face);
      split(&parent, t->vertex_count, corners);
    } else {
      triangle children[4];
      split_whole(t, face, children);
      for (uint32_t i = 0; i < 4; i++)
        split(&children[i], t->vertex_count + t->edge_count, corners + 12 * (size_t)i);
    }
    if (taken < each) memcpy(out, all + 3 * (size_t)skip, 3 * (size_t)taken * sizeof *out);
    out += 3 * (size_t)taken;
    first += taken;
  }
}
