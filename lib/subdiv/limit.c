/* Limit masks for position and tangents at every kind of vertex. */
#include "limit_mask.h"

#include <math.h>

#include "refine.h"

static const double pi = 3.14159265358979323846;

/* Of the scheme that refines to triangles: the others make quads. */
static bool is_loop(const tw_topology *t) {
  return t->face_size == 3;
}

static tw_limit_neighbours start_mask(const tw_topology *t, uint32_t vertex, tw_limit_entry *entries) {
  uint32_t ring = t->ring_offsets[vertex], fan = t->fan_offsets[vertex];
  tw_limit_neighbours m = {t, vertex, t->ring_offsets[vertex + 1] - ring, t->fan_offsets[vertex + 1] - fan,
                           entries};
  entries[0] = (tw_limit_entry){vertex, 0, 0, 0};
  for (uint32_t i = 0; i < m.ring_count; i++) {
    const uint32_t *ends = t->edge_vertices[t->ring_edges[ring + i]];
    *tw_ring_entry(&m, i) = (tw_limit_entry){ends[ends[0] == vertex], 0, 0, 0};
  }
  for (uint32_t i = 0; i < m.fan_count && !is_loop(t); i++) {
    uint32_t opposite = tw_quad_next(tw_quad_next(t->fan_corners[fan + i]));
    *tw_fan_entry(&m, i) = (tw_limit_entry){t->corner_vertex[opposite], 0, 0, 0};
  }
  return m;
}

static void position_smooth(const tw_limit_neighbours *m) {
  if (is_loop(m->t)) {
    tw_loop_limit_smooth(m);
    return;
  }
  float n = (float)m->fan_count;
  float face = 1 / (n * (n + 5)), edge = 4 * face;
  for (uint32_t i = 0; i < m->fan_count; i++) tw_fan_entry(m, i)->position = face;
  for (uint32_t i = 0; i < m->ring_count; i++) tw_ring_entry(m, i)->position = edge;
  m->entries[0].position = 1 - n * (edge + face);
}

static void position_crease(const tw_limit_neighbours *m, const uint32_t ends[2]) {
  m->entries[0].position = 2.0f / 3;
  tw_ring_entry(m, ends[0])->position = 1.0f / 6;
  tw_ring_entry(m, ends[1])->position = 1.0f / 6;
}

/* From the vertex along two edges of its ring. */
static void tangents_along(const tw_limit_neighbours *m, uint32_t first, uint32_t second) {
  m->entries[0].tangent1 = m->entries[0].tangent2 = -1;
  tw_ring_entry(m, first)->tangent1 = 1;
  tw_ring_entry(m, second)->tangent2 = 1;
}

/* The subdominant eigenvectors of the subdivision matrix. */
static void tangents_smooth(const tw_limit_neighbours *m) {
  if (is_loop(m->t)) {
    tw_loop_tangents_smooth(m);
    return;
  }
  uint32_t n = m->fan_count;
  double step = 2 * pi / n, cosine = cos(step);
  double lambda = (5 + cosine + cos(step / 2) * sqrt(2 * (9 + cosine))) / 16;
  double face = 1 / (4 * lambda - 1);
  for (uint32_t i = 0; i < n; i++) {
    tw_ring_entry(m, i)->tangent1 = (float)(4 * cos(i * step));
    tw_fan_entry(m, i)->tangent1 = (float)(face * (cos(i * step) + cos((i + 1) * step)));
    tw_ring_entry(m, i + 1)->tangent2 = (float)(4 * cos(i * step));
    tw_fan_entry(m, i + 1)->tangent2 = (float)(face * (cos(i * step) + cos((i + 1) * step)));
  }
}

/* Along and across a crease that bounds `faces` faces, beginning at ring edge `first`. */
static void tangents_crease(const tw_limit_neighbours *m, uint32_t first, uint32_t faces) {
  tw_ring_entry(m, first)->tangent1 += 0.5f;
  tw_ring_entry(m, first + faces)->tangent1 -= 0.5f;
  if (faces == 1) { /* the mean of the two edges */
    m->entries[0].tangent2 = -6;
    tw_ring_entry(m, first)->tangent2 += 3;
    tw_ring_entry(m, first + 1)->tangent2 += 3;
    return;
  }
  if (is_loop(m->t)) {
    tw_loop_tangents_across(m, first, faces);
    return;
  }
  double step = pi / faces, cosine = cos(step), sine = sin(step);
  double scale = 1 / (faces * (3 + cosine)), r = (cosine + 1) / sine;
  m->entries[0].tangent2 = (float)(scale * 4 * r * (cosine - 1));
  tw_ring_entry(m, first)->tangent2 -= (float)(scale * r * (1 + 2 * cosine));
  tw_ring_entry(m, first + faces)->tangent2 -= (float)(scale * r * (1 + 2 * cosine));
  for (uint32_t i = 0; i < faces; i++) {
    if (i > 0) tw_ring_entry(m, first + i)->tangent2 += (float)(scale * 4 * sin(i * step));
    tw_fan_entry(m, first + i)->tangent2 = (float)(scale * (sin(i * step) + sin((i + 1) * step)));
  }
}

/* The run of faces between infinitely sharp edges round fan place `place`. */
typedef struct sector {
  uint32_t first, faces; /* first ring edge and number of faces */
  bool bounded;          /* by two different edges */
} sector;

static sector find_sector(const tw_limit_neighbours *m, uint32_t place) {
  uint32_t n = m->fan_count;
  bool border = m->ring_count > n;
  uint32_t back = 0, ahead = 1;
  while (back < n - 1 && !tw_is_infinite(tw_ring_sharpness(m, place + m->ring_count - back)) &&
         !(border && back == place))
    back++;
  bool begins = tw_is_infinite(tw_ring_sharpness(m, place + m->ring_count - back));
  while (ahead < n && !tw_is_infinite(tw_ring_sharpness(m, place + ahead))) ahead++;
  bool ends = tw_is_infinite(tw_ring_sharpness(m, place + ahead));
  uint32_t faces = back + ahead;
  if (!begins || !ends || (!border && faces >= n)) return (sector){0, n, false};
  return (sector){(place + m->ring_count - back) % m->ring_count, faces, true};
}

static uint32_t fan_place(const tw_limit_neighbours *m, uint32_t corner) {
  const uint32_t *fan = m->t->fan_corners + m->t->fan_offsets[m->vertex];
  uint32_t place = 0;
  while (place + 1 < m->fan_count && fan[place] != corner) place++;
  return place;
}

static uint32_t ring_place(const tw_limit_neighbours *m, uint32_t edge) {
  const uint32_t *ring = m->t->ring_edges + m->t->ring_offsets[m->vertex];
  uint32_t place = 0;
  while (place + 1 < m->ring_count && ring[place] != edge) place++;
  return place;
}

static void tangents_of_face(const tw_limit_neighbours *m, uint32_t corner) {
  tangents_along(m, ring_place(m, m->t->corner_edge[corner]),
                 ring_place(m, m->t->corner_edge[tw_corner_previous(m->t, corner)]));
}

static bool is_smooth(tw_vertex_rule rule) {
  return rule == TW_RULE_SMOOTH || rule == TW_RULE_DART;
}

/* Among quads the smooth masks begin at valence 3. */
static tw_vertex_rule with_mask(const tw_limit_neighbours *m, tw_vertex_rule rule) {
  return is_smooth(rule) && m->fan_count == 2 && !is_loop(m->t) ? TW_RULE_CORNER : rule;
}

/* The rules that position and tangents follow; ends as in tw_vertex_rule_at. */
static tw_vertex_rule position_rule(const tw_limit_neighbours *m, bool linear, uint32_t ends[2]) {
  return linear ? TW_RULE_CORNER : with_mask(m, tw_vertex_rule_at(m->t, m->vertex, ends));
}
static tw_vertex_rule tangent_rule(const tw_limit_neighbours *m, bool linear, uint32_t ends[2]) {
  return linear ? TW_RULE_CORNER : with_mask(m, tw_settled_rule_at(m->t, m->vertex, ends));
}

/* Where there is no tangent plane to choose from, or, between two triangles back to back, none at all. */
static bool has_face_tangents(const tw_limit_neighbours *m, bool linear, tw_vertex_rule rule) {
  if (linear || (m->t->vertex_flags[m->vertex] & TW_VERTEX_NONMANIFOLD)) return true;
  return is_smooth(rule) && m->fan_count == 2;
}

/* The side of a crease that its tangents are taken from. */
static sector crease_side(const tw_limit_neighbours *m, uint32_t corner, const uint32_t ends[2]) {
  sector s = find_sector(m, fan_place(m, corner));
  return s.bounded ? s : (sector){ends[0], ends[1] - ends[0], false};
}

static void fill_position(const tw_limit_neighbours *m, bool linear) {
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = position_rule(m, linear, ends);
  if (rule == TW_RULE_CORNER)
    m->entries[0].position = 1;
  else if (rule == TW_RULE_CREASE)
    position_crease(m, ends);
  else
    position_smooth(m);
}

static void fill_tangents(const tw_limit_neighbours *m, bool linear, uint32_t corner) {
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = tangent_rule(m, linear, ends);
  if (has_face_tangents(m, linear, rule)) {
    tangents_of_face(m, corner);
  } else if (rule == TW_RULE_CORNER) {
    sector s = find_sector(m, fan_place(m, corner));
    tangents_along(m, s.first, s.first + 1);
  } else {
    if (rule == TW_RULE_CREASE) {
      sector s = crease_side(m, corner, ends);
      tangents_crease(m, s.first, s.faces);
    } else {
      tangents_smooth(m);
    }
    tw_limit_settle(m);
  }
}

uint32_t tw_limit_mask(const tw_topology *topology, bool linear, uint32_t corner, tw_limit_entry *entries) {
  tw_limit_neighbours m = start_mask(topology, topology->corner_vertex[corner], entries);
  fill_position(&m, linear);
  fill_tangents(&m, linear, corner);
  return 1 + m.ring_count + (is_loop(topology) ? 0 : m.fan_count);
}

/* The tangents of tangents_smooth lie along edges 0 and 1 of the ring. */
static void frame_smooth(const tw_limit_neighbours *m, uint32_t place, float frame[2][2]) {
  double step = 2 * pi / m->fan_count;
  for (uint32_t i = 0; i < 2; i++) {
    frame[i][0] = (float)(sin((1 - (double)(place + i)) * step) / sin(step));
    frame[i][1] = (float)(sin((place + i) * step) / sin(step));
  }
}

/* Those of tangents_crease lie along the crease and, once the faces of a side share its half turn, at a
 * right angle to it. A face that has a side for itself has no inner edge to measure that by. */
static bool frame_crease(const tw_limit_neighbours *m, uint32_t place, sector s, float frame[2][2]) {
  uint32_t n = m->fan_count, index = (place + n - s.first) % n, faces = s.faces;
  double begin = 0;
  if (index >= faces) {
    begin = pi;
    index -= faces;
    faces = n - faces;
  }
  if (faces == 1) return false;
  for (uint32_t i = 0; i < 2; i++) {
    frame[i][0] = (float)cos(begin + (index + i) * pi / faces);
    frame[i][1] = (float)sin(begin + (index + i) * pi / faces);
  }
  return true;
}

bool tw_limit_frame(const tw_topology *topology, bool linear, uint32_t corner, float frame[2][2]) {
  uint32_t v = topology->corner_vertex[corner];
  tw_limit_neighbours m = {topology, v, topology->ring_offsets[v + 1] - topology->ring_offsets[v],
                           topology->fan_offsets[v + 1] - topology->fan_offsets[v], NULL};
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = tangent_rule(&m, linear, ends);
  if (has_face_tangents(&m, linear, rule) || rule == TW_RULE_CORNER) return false;
  if (rule == TW_RULE_CREASE)
    return frame_crease(&m, fan_place(&m, corner), crease_side(&m, corner, ends), frame);
  frame_smooth(&m, fan_place(&m, corner), frame);
  return true;
}
