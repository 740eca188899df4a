/* Limit masks for position and tangents at every kind of vertex. */
#include "limit.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "angle.h"
#include "crease.h"
#include "loop.h"

/* A mask while it is computed. Entry 0 is the vertex itself; then come its ring and, among quads, the far
 * corners of its fan. Among polygons the ring and the fan stand for the edge points and face points of the
 * quads below, until polygon_step; the corners of faces that are not in the ring come between them. */
typedef struct neighbours {
  const tw_topology *t;
  uint32_t vertex, ring_count, further_count, fan_count;
  tw_limit_entry *entries;
} neighbours;

static inline tw_limit_entry *ring_entry(const neighbours *n, uint32_t i) {
  return &n->entries[1 + i % n->ring_count];
}

static inline tw_limit_entry *fan_entry(const neighbours *n, uint32_t i) {
  return &n->entries[1 + n->ring_count + n->further_count + i % n->fan_count];
}

static inline float ring_sharpness(const neighbours *n, uint32_t i) {
  return n->t->edge_sharpness[n->t->ring_edges[n->t->ring_offsets[n->vertex] + i % n->ring_count]];
}

/* ---- Loop's masks ---------------------------------------------------------------------------- */

static void loop_limit_smooth(const neighbours *n) {
  float ring = (float)(1 / (n->ring_count + 3 / (8 * tw_loop_weight(n->ring_count))));
  for (uint32_t i = 0; i < n->ring_count; i++) ring_entry(n, i)->position = ring;
  n->entries[0].position = 1 - (float)n->ring_count * ring;
}

/* Tangents from the subdominant eigenvectors of the subdivision matrix, along edges 0 and 1 of the ring. */
static void loop_tangents_smooth(const neighbours *n) {
  static const float regular[6] = {1, 0.5f, -0.5f, -1, -0.5f, 0.5f};
  uint32_t count = n->ring_count;
  double step = 2 * TW_PI / count;
  for (uint32_t i = 0; i < count; i++) {
    float weight = count == 6 ? regular[i] : (float)cos(i * step);
    ring_entry(n, i)->tangent1 = weight;
    ring_entry(n, i + 1)->tangent2 = weight;
  }
}

/* The tangent across a crease. It has the scale of the tangent along the crease: where the faces share the
 * half turn equally, both have the same length. */
static void loop_tangents_across(const neighbours *n, uint32_t first, uint32_t faces) {
  double step = TW_PI / faces, inner = 2 * sin(step) / faces, ends = -1 / (faces * tan(step / 2)), own = 0;
  if (faces == 2) { /* along the edge between the two faces */
    ends = 0;
    own = -1;
  } else if (faces == 3) { /* as on a regular mesh that is reflected at the crease */
    ends = -inner / 2;
    own = -inner;
  }
  n->entries[0].tangent2 = (float)own;
  ring_entry(n, first)->tangent2 += (float)ends;
  ring_entry(n, first + faces)->tangent2 += (float)ends;
  for (uint32_t i = 1; i < faces; i++)
    ring_entry(n, first + i)->tangent2 += (float)(2 * sin(i * step) / faces);
}

/* ---- capacity -------------------------------------------------------------------------------- */

uint32_t tw_limit_steps(const tw_topology *t, uint32_t vertex) {
  if (t->smooth) return 0;
  float greatest = 0, own = t->vertex_sharpness[vertex];
  if (tw_is_semi_sharp(own)) greatest = own;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    float sharpness = t->edge_sharpness[t->ring_edges[i]];
    if (tw_is_semi_sharp(sharpness) && sharpness > greatest) greatest = sharpness;
  }
  return (uint32_t)ceilf(greatest);
}

/* While a mask is computed, the room behind its entries holds the decay of the vertex's edges. */
enum { DECAY_ENTRIES = sizeof(tw_edge_decay) / sizeof(tw_limit_entry) };
_Static_assert(DECAY_ENTRIES * sizeof(tw_limit_entry) == sizeof(tw_edge_decay), "decays are whole entries");

static tw_edge_decay *decay_room(const neighbours *m) {
  return (tw_edge_decay *)(void *)(m->entries + 1 + m->ring_count + m->fan_count);
}

bool tw_limit_decays(const tw_topology *topology) {
  const tw_topology *t = topology;
  for (uint32_t v = 0; v < t->vertex_count; v++)
    if (tw_is_semi_sharp(t->vertex_sharpness[v])) return true;
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (tw_is_semi_sharp(t->edge_sharpness[e])) return true;
  return false;
}

/* The corners of polygons at a vertex that are neither the vertex nor in its ring. */
static uint32_t count_further(const tw_topology *t, uint32_t vertex) {
  uint32_t count = 0;
  if (!t->polygonal || t->face_size == 3) return 0;
  for (uint32_t i = t->fan_offsets[vertex]; i < t->fan_offsets[vertex + 1]; i++)
    count += tw_face_size(t, tw_corner_face(t, t->fan_corners[i])) - 3;
  return count;
}

uint32_t tw_limit_capacity(const tw_topology *topology, bool decays, uint32_t vertex) {
  const tw_topology *t = topology;
  uint32_t edge = decays ? 1 + DECAY_ENTRIES : 1;
  return 1 + edge * (t->ring_offsets[vertex + 1] - t->ring_offsets[vertex]) + t->fan_offsets[vertex + 1] -
         t->fan_offsets[vertex] + count_further(t, vertex);
}

uint32_t tw_limit_greatest_capacity(const tw_topology *topology) {
  bool decays = !topology->smooth && tw_limit_decays(topology);
  uint32_t greatest = 0;
  for (uint32_t v = 0; v < topology->vertex_count; v++) {
    uint32_t capacity = tw_limit_capacity(topology, decays, v);
    if (capacity > greatest) greatest = capacity;
  }
  return greatest;
}

/* ---- masks through steps --------------------------------------------------------------------- */

/* Tangents at a vertex with semi-sharp edges, or that is semi-sharp itself, are those of the vertex after all
 * sharpness has decayed, so that both sides of a crease that rounds off in the end have the same normal. A
 * step maps the vertex and its neighbours to the vertex and its neighbours one level down; its transpose
 * takes mask weights from there back to here. The masks of polygons are brought back from the quads below in
 * the same way. */

static void add(tw_limit_entry *entry, float weight, const tw_limit_entry *from) {
  entry->position += weight * from->position;
  entry->tangent1 += weight * from->tangent1;
  entry->tangent2 += weight * from->tangent2;
}

static void scale(tw_limit_entry *entry, float weight) {
  entry->position *= weight;
  entry->tangent1 *= weight;
  entry->tangent2 *= weight;
}

static bool is_empty(const tw_limit_entry *entry) {
  return entry->position == 0 && entry->tangent1 == 0 && entry->tangent2 == 0;
}

/* Scales entry 0 (the vertex one level down) to the weight that stays at the vertex itself, and returns its
 * former weights, which give_to_ring distributes. own: the vertex's weight in its own smooth mask. */
static tw_limit_entry take_vertex(const neighbours *m, const tw_vertex_blend *blend, float own) {
  tw_limit_entry v = m->entries[0];
  scale(&m->entries[0], blend->corner + 0.75f * blend->crease + blend->smooth * own);
  return v;
}

static void give_to_ring(const neighbours *m, const tw_vertex_blend *blend, float smooth,
                         const tw_limit_entry *v) {
  for (uint32_t i = 0; i < m->ring_count; i++) add(ring_entry(m, i), blend->smooth * smooth, v);
  for (int i = 0; blend->crease > 0 && i < 2; i++)
    add(ring_entry(m, blend->ends[i]), 0.125f * blend->crease, v);
}

static float ring_share(const neighbours *m, const tw_vertex_decay *decay, uint32_t i, uint32_t steps) {
  return tw_crease_share_after(decay, i % m->ring_count, steps);
}

/* A step among quads. Weights of face points are gathered first, in the entries of the faces' far corners,
 * and distributed to the four corners of each face in the end. */
static void quad_step(const neighbours *m, const tw_vertex_decay *decay, uint32_t steps) {
  float n = (float)m->fan_count;
  tw_vertex_blend blend = tw_blend_after(decay, steps);
  tw_limit_entry v = take_vertex(m, &blend, (n - 2) / n);
  for (uint32_t i = 0; i < m->fan_count; i++) {
    tw_limit_entry *face = fan_entry(m, i);
    add(face, blend.smooth / (n * n), &v);
    for (uint32_t side = i; side < i + 2; side++)
      add(face, 0.25f * (1 - ring_share(m, decay, side, steps)), ring_entry(m, side));
  }
  for (uint32_t i = 0; i < m->ring_count; i++) {
    tw_limit_entry *edge = ring_entry(m, i);
    scale(edge, 0.25f + 0.25f * ring_share(m, decay, i, steps));
    add(&m->entries[0], 1, edge);
  }
  give_to_ring(m, &blend, 1 / (n * n), &v);
  for (uint32_t i = 0; i < m->fan_count; i++) {
    tw_limit_entry *face = fan_entry(m, i);
    scale(face, 0.25f);
    add(&m->entries[0], 1, face);
    add(ring_entry(m, i), 1, face);
    add(ring_entry(m, i + 1), 1, face);
  }
}

/* A step among triangles. The weights that an edge point gives to the points opposite to its edge go to
 * neighbours in the ring. */
static void triangle_step(const neighbours *m, const tw_vertex_decay *decay, uint32_t steps) {
  tw_vertex_blend blend = tw_blend_after(decay, steps);
  uint32_t count = m->ring_count;
  float weight = blend.smooth > 0 ? (float)tw_loop_weight(count) : 0;
  tw_limit_entry v = take_vertex(m, &blend, 1 - (float)count * weight);
  tw_limit_entry first = *ring_entry(m, 0), before = *ring_entry(m, count - 1);
  for (uint32_t i = 0; i < count; i++) {
    tw_limit_entry *edge = ring_entry(m, i), own = *edge;
    tw_limit_entry after = i + 1 < count ? *ring_entry(m, i + 1) : first;
    float crease = ring_share(m, decay, i, steps);
    float crease_before = ring_share(m, decay, i + count - 1, steps);
    float crease_after = ring_share(m, decay, i + 1, steps);
    scale(edge, 0.375f + 0.125f * crease);
    add(&m->entries[0], 1, edge);
    add(edge, 0.125f * (1 - crease_before), &before);
    add(edge, 0.125f * (1 - crease_after), &after);
    before = own;
  }
  give_to_ring(m, &blend, weight, &v);
}

/* The place of an item that is in the list. */
static uint32_t place_in(const uint32_t *list, uint32_t count, uint32_t item) {
  uint32_t place = 0;
  while (place + 1 < count && list[place] != item) place++;
  return place;
}

static uint32_t ring_place(const neighbours *m, uint32_t edge) {
  return place_in(m->t->ring_edges + m->t->ring_offsets[m->vertex], m->ring_count, edge);
}

static uint32_t fan_corner(const neighbours *m, uint32_t i) {
  return m->t->fan_corners[m->t->fan_offsets[m->vertex] + i];
}

/* The places in the ring of the two sides of a face. */
static void find_sides(const neighbours *m, uint32_t face, uint32_t sides[2]) {
  const tw_topology *t = m->t;
  uint32_t corner = fan_corner(m, face);
  bool ordered = !(t->vertex_flags[m->vertex] & TW_VERTEX_NONMANIFOLD);
  sides[0] = ordered ? face : ring_place(m, t->corner_edge[corner]);
  sides[1] = ordered ? face + 1 : ring_place(m, t->corner_edge[tw_corner_previous(t, corner)]);
}

/* The share of the crease mask in a point of the ring, where nothing is semi-sharp. */
static float settled_share(const neighbours *m, uint32_t i) {
  return tw_is_infinite(ring_sharpness(m, i)) ? 1 : 0;
}

/* Gives the faces at a point of the ring their parts of its weights. */
static void give_edge_to_faces(const neighbours *m, uint32_t place) {
  const tw_topology *t = m->t;
  uint32_t edge = t->ring_edges[t->ring_offsets[m->vertex] + place];
  const tw_limit_entry *weights = ring_entry(m, place);
  if (settled_share(m, place) == 1 || is_empty(weights)) return;
  if (!(t->vertex_flags[m->vertex] & TW_VERTEX_NONMANIFOLD)) {
    add(fan_entry(m, place), 0.25f, weights);
    add(fan_entry(m, place + m->fan_count - 1), 0.25f, weights);
    return;
  }
  for (uint32_t i = 0; i < m->fan_count; i++) {
    uint32_t corner = fan_corner(m, i);
    if (t->corner_edge[corner] == edge || t->corner_edge[tw_corner_previous(t, corner)] == edge)
      add(fan_entry(m, i), 0.25f, weights);
  }
}

/* Gives the corners of each face their parts of the face's weights. */
static void give_faces(const neighbours *m) {
  tw_limit_entry *further = &m->entries[1 + m->ring_count];
  for (uint32_t i = 0; i < m->fan_count; i++) {
    const tw_limit_entry *face = fan_entry(m, i);
    uint32_t size = tw_face_size(m->t, tw_corner_face(m->t, fan_corner(m, i))), sides[2];
    float weight = 1 / (float)size;
    if (!is_empty(face)) {
      find_sides(m, i, sides);
      add(&m->entries[0], weight, face);
      for (int k = 0; k < 2; k++) add(ring_entry(m, sides[k]), weight, face);
      for (uint32_t k = 0; k + 3 < size; k++) add(&further[k], weight, face);
    }
    further += size - 3;
  }
}

/* A step from polygons to quads in which nothing decays. */
static void polygon_step(const neighbours *m) {
  const tw_rules plain = {0};
  float n = (float)m->fan_count;
  tw_vertex_blend blend = tw_blend_at(m->t, &plain, m->vertex);
  tw_limit_entry v = take_vertex(m, &blend, (n - 2) / n);
  for (uint32_t i = 0; blend.smooth > 0 && i < m->fan_count; i++)
    add(fan_entry(m, i), blend.smooth / (n * n), &v);
  for (uint32_t i = 0; i < m->ring_count; i++) {
    tw_limit_entry *edge = ring_entry(m, i);
    give_edge_to_faces(m, i);
    scale(edge, 0.25f + 0.25f * settled_share(m, i));
    add(&m->entries[0], 1, edge);
  }
  give_to_ring(m, &blend, 1 / (n * n), &v);
  give_faces(m);
}

static void settle_tangents(const neighbours *m) {
  assert(m->ring_count > 0);
  uint32_t steps = tw_limit_steps(m->t, m->vertex);
  if (steps == 0) return;
  tw_vertex_decay decay = tw_decay_at(m->t, m->vertex, steps, decay_room(m));
  while (steps-- > 0) {
    if (m->t->face_size == 3)
      triangle_step(m, &decay, steps);
    else
      quad_step(m, &decay, steps);
  }
}

/* ---- masks ----------------------------------------------------------------------------------- */

/* Whether the mesh is of Loop's scheme, which makes triangles; the other schemes make quads. */
static bool is_loop(const tw_topology *t) {
  return t->face_size == 3 && !t->polygonal;
}

static neighbours neighbours_of(const tw_topology *t, uint32_t vertex, tw_limit_entry *entries) {
  return (neighbours){.t = t,
                      .vertex = vertex,
                      .ring_count = t->ring_offsets[vertex + 1] - t->ring_offsets[vertex],
                      .further_count = count_further(t, vertex),
                      .fan_count = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex],
                      .entries = entries};
}

/* Sets the vertices of polygons that are not in the ring. */
static void name_further(const neighbours *m) {
  const tw_topology *t = m->t;
  tw_limit_entry *entry = &m->entries[1 + m->ring_count];
  for (uint32_t i = 0; i < m->fan_count; i++) {
    uint32_t corner = tw_corner_next(t, fan_corner(m, i)), size = tw_face_size(t, tw_corner_face(t, corner));
    for (uint32_t k = 3; k < size; k++) {
      corner = tw_corner_next(t, corner);
      (entry++)->vertex = t->corner_vertex[corner];
    }
  }
}

/* Sets the vertices of the entries, but no weights. */
static void name_entries(const neighbours *m) {
  const tw_topology *t = m->t;
  const uint32_t *ring = t->ring_edges + t->ring_offsets[m->vertex];
  m->entries[0].vertex = m->vertex;
  for (uint32_t i = 0; i < m->ring_count; i++) ring_entry(m, i)->vertex = tw_far_end(t, ring[i], m->vertex);
  if (m->further_count > 0) name_further(m);
  for (uint32_t i = 0; i < m->fan_count && !is_loop(t) && !t->polygonal; i++)
    fan_entry(m, i)->vertex = t->corner_vertex[tw_quad_next(tw_quad_next(fan_corner(m, i)))];
}

/* The number of entries of a finished mask. */
static uint32_t mask_count(const neighbours *m) {
  bool has_fan = !is_loop(m->t) && !m->t->polygonal;
  return 1 + m->ring_count + m->further_count + (has_fan ? m->fan_count : 0);
}

static void position_smooth(const neighbours *m) {
  if (is_loop(m->t)) {
    loop_limit_smooth(m);
    return;
  }
  float n = (float)m->fan_count;
  float face = 1 / (n * (n + 5)), edge = 4 * face;
  for (uint32_t i = 0; i < m->fan_count; i++) fan_entry(m, i)->position = face;
  for (uint32_t i = 0; i < m->ring_count; i++) ring_entry(m, i)->position = edge;
  m->entries[0].position = 1 - n * (edge + face);
}

static void position_crease(const neighbours *m, const uint32_t ends[2]) {
  m->entries[0].position = 2.0f / 3;
  ring_entry(m, ends[0])->position = 1.0f / 6;
  ring_entry(m, ends[1])->position = 1.0f / 6;
}

/* Tangents from the vertex along two edges of its ring. */
static void tangents_along(const neighbours *m, uint32_t first, uint32_t second) {
  m->entries[0].tangent1 = m->entries[0].tangent2 = -1;
  ring_entry(m, first)->tangent1 = 1;
  ring_entry(m, second)->tangent2 = 1;
}

/* Tangents from the subdominant eigenvectors of the subdivision matrix. */
static void tangents_smooth(const neighbours *m) {
  if (is_loop(m->t)) {
    loop_tangents_smooth(m);
    return;
  }
  uint32_t n = m->fan_count;
  double step = 2 * TW_PI / n, cosine = cos(step);
  double lambda = (5 + cosine + cos(step / 2) * sqrt(2 * (9 + cosine))) / 16;
  double face = 1 / (4 * lambda - 1);
  for (uint32_t i = 0; i < n; i++) {
    ring_entry(m, i)->tangent1 = (float)(4 * cos(i * step));
    fan_entry(m, i)->tangent1 = (float)(face * (cos(i * step) + cos((i + 1) * step)));
    ring_entry(m, i + 1)->tangent2 = (float)(4 * cos(i * step));
    fan_entry(m, i + 1)->tangent2 = (float)(face * (cos(i * step) + cos((i + 1) * step)));
  }
}

/* Tangents along and across a crease that bounds `faces` faces and begins at ring edge `first`. */
static void tangents_crease(const neighbours *m, uint32_t first, uint32_t faces) {
  ring_entry(m, first)->tangent1 += 0.5f;
  ring_entry(m, first + faces)->tangent1 -= 0.5f;
  if (faces == 1) { /* across: the mean of the two edges */
    m->entries[0].tangent2 = -6;
    ring_entry(m, first)->tangent2 += 3;
    ring_entry(m, first + 1)->tangent2 += 3;
    return;
  }
  if (is_loop(m->t)) {
    loop_tangents_across(m, first, faces);
    return;
  }
  double step = TW_PI / faces, cosine = cos(step), sine = sin(step);
  double scale = 1 / (faces * (3 + cosine)), r = (cosine + 1) / sine;
  m->entries[0].tangent2 = (float)(scale * 4 * r * (cosine - 1));
  ring_entry(m, first)->tangent2 -= (float)(scale * r * (1 + 2 * cosine));
  ring_entry(m, first + faces)->tangent2 -= (float)(scale * r * (1 + 2 * cosine));
  for (uint32_t i = 0; i < faces; i++) {
    if (i > 0) ring_entry(m, first + i)->tangent2 += (float)(scale * 4 * sin(i * step));
    fan_entry(m, first + i)->tangent2 = (float)(scale * (sin(i * step) + sin((i + 1) * step)));
  }
}

/* A sector: the faces between infinitely sharp edges on both sides of a corner. */
typedef struct sector {
  uint32_t first, faces; /* first ring edge and number of faces */
  bool bounded;          /* two different edges bound it */
} sector;

static sector find_sector(const neighbours *m, uint32_t place) {
  uint32_t n = m->fan_count;
  bool border = m->ring_count > n;
  uint32_t back = 0, ahead = 1;
  while (back < n - 1 && !tw_is_infinite(ring_sharpness(m, place + m->ring_count - back)) &&
         !(border && back == place))
    back++;
  bool begins = tw_is_infinite(ring_sharpness(m, place + m->ring_count - back));
  while (ahead < n && !tw_is_infinite(ring_sharpness(m, place + ahead))) ahead++;
  bool ends = tw_is_infinite(ring_sharpness(m, place + ahead));
  uint32_t faces = back + ahead;
  if (!begins || !ends || (!border && faces >= n)) return (sector){0, n, false};
  return (sector){(place + m->ring_count - back) % m->ring_count, faces, true};
}

static uint32_t fan_place(const neighbours *m, uint32_t corner) {
  return place_in(m->t->fan_corners + m->t->fan_offsets[m->vertex], m->fan_count, corner);
}

static void tangents_of_face(const neighbours *m, uint32_t corner) {
  tangents_along(m, ring_place(m, m->t->corner_edge[corner]),
                 ring_place(m, m->t->corner_edge[tw_corner_previous(m->t, corner)]));
}

static bool is_smooth(tw_vertex_rule rule) {
  return rule == TW_RULE_SMOOTH || rule == TW_RULE_DART;
}

/* The corner rule in place of a smooth rule that has no mask: among quads, smooth masks begin at valence
 * 3. */
static tw_vertex_rule with_mask(const neighbours *m, tw_vertex_rule rule) {
  return is_smooth(rule) && m->fan_count == 2 && !is_loop(m->t) ? TW_RULE_CORNER : rule;
}

/* The rule that the tangents follow; ends as in tw_vertex_rule_at. */
static tw_vertex_rule tangent_rule(const neighbours *m, bool linear, uint32_t ends[2]) {
  return linear ? TW_RULE_CORNER : with_mask(m, tw_settled_rule_at(m->t, m->vertex, ends));
}

/* Whether the tangents are those of one face: where there are several tangent planes, or none, as between two
 * faces back to back. */
static bool has_face_tangents(const neighbours *m, bool linear, tw_vertex_rule rule) {
  if (linear || (m->t->vertex_flags[m->vertex] & TW_VERTEX_NONMANIFOLD)) return true;
  return is_smooth(rule) && m->fan_count == 2;
}

/* The side of a crease whose tangents the corner has. */
static sector crease_side(const neighbours *m, uint32_t corner, const uint32_t ends[2]) {
  sector s = find_sector(m, fan_place(m, corner));
  return s.bounded ? s : (sector){ends[0], ends[1] - ends[0], false};
}

static void fill_position(const neighbours *m) {
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = with_mask(m, tw_vertex_rule_at(m->t, m->vertex, ends));
  if (rule == TW_RULE_CORNER)
    m->entries[0].position = 1;
  else if (rule == TW_RULE_CREASE)
    position_crease(m, ends);
  else
    position_smooth(m);
}

static void fill_tangents(const neighbours *m, uint32_t corner) {
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = tangent_rule(m, false, ends);
  if (has_face_tangents(m, false, rule)) {
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
    settle_tangents(m);
  }
}

/* The mask of a linear mesh: the vertex, and the tangents of the corner's own face. */
static uint32_t linear_mask(const tw_topology *t, uint32_t corner, tw_limit_entry *entries) {
  uint32_t next = tw_corner_next(t, corner), before = tw_corner_previous(t, corner);
  entries[0] = (tw_limit_entry){t->corner_vertex[corner], 1, -1, -1};
  entries[1] = (tw_limit_entry){t->corner_vertex[next], 0, 1, 0};
  entries[2] = (tw_limit_entry){t->corner_vertex[before], 0, 0, 1};
  return 3;
}

uint32_t tw_limit_mask(const tw_topology *topology, bool linear, uint32_t corner, tw_limit_entry *entries) {
  if (linear) return linear_mask(topology, corner, entries);
  neighbours m = neighbours_of(topology, topology->corner_vertex[corner], entries);
  memset(entries, 0, (1 + (size_t)m.ring_count + m.further_count + m.fan_count) * sizeof *entries);
  name_entries(&m);
  fill_tangents(&m, corner); /* first: its steps carry all weights */
  fill_position(&m);
  if (topology->polygonal) polygon_step(&m);
  return mask_count(&m);
}

uint32_t tw_limit_corner(const tw_topology *topology, bool linear, uint32_t corner) {
  neighbours m = neighbours_of(topology, topology->corner_vertex[corner], NULL);
  const uint32_t *fan = topology->fan_corners + topology->fan_offsets[m.vertex];
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = tangent_rule(&m, linear, ends);
  if (has_face_tangents(&m, linear, rule)) return corner;
  if (is_smooth(rule)) return fan[0];
  sector s = rule == TW_RULE_CREASE ? crease_side(&m, corner, ends) : find_sector(&m, fan_place(&m, corner));
  return fan[s.first];
}

/* Whether the weights depend on the valence alone, which has a wheel. In a mesh of faces of several sizes
 * wheels are of quads. */
static bool is_wheel(const neighbours *m, bool linear) {
  const tw_topology *t = m->t;
  uint32_t n = m->fan_count;
  if (linear || t->vertex_flags[m->vertex] || n < 3 || n > TW_WHEEL_MAX) return false;
  for (uint32_t i = 0; t->face_size == 0 && i < n; i++)
    if (tw_face_size(t, tw_corner_face(t, fan_corner(m, i))) != 4) return false;
  if (t->smooth) return true;
  if (t->vertex_sharpness[m->vertex] > 0) return false;
  for (uint32_t i = 0; i < n; i++)
    if (ring_sharpness(m, i) > 0) return false;
  return true;
}

/* Computes a mask or takes its weights from a wheel. */
static uint32_t make_mask(tw_last_mask *last, const tw_topology *topology, bool linear, uint32_t corner) {
  neighbours m = neighbours_of(topology, topology->corner_vertex[corner], last->entries);
  if (!is_wheel(&m, linear)) return tw_limit_mask(topology, linear, corner, last->entries);
  uint32_t *count = &last->wheel_counts[m.fan_count];
  tw_limit_entry *wheel = last->wheels[m.fan_count];
  if (*count > 0) {
    memcpy(last->entries, wheel, *count * sizeof *wheel);
    name_entries(&m);
    return *count;
  }
  *count = tw_limit_mask(topology, linear, corner, last->entries);
  memcpy(wheel, last->entries, *count * sizeof *wheel);
  return *count;
}

uint32_t tw_limit_mask_after(tw_last_mask *last, const tw_topology *topology, bool linear, uint32_t corner) {
  const uint32_t *vertex = topology->corner_vertex;
  if (last->topology == topology &&
      (last->corner == corner ||
       (!linear && vertex[last->corner] == vertex[corner] &&
        tw_limit_corner(topology, false, last->corner) == tw_limit_corner(topology, false, corner))))
    return last->count;
  bool of_triangles = topology->face_size == 3, of_polygons = topology->polygonal;
  if (last->of_triangles != of_triangles || last->of_polygons != of_polygons)
    memset(last->wheel_counts, 0, sizeof last->wheel_counts);
  last->of_triangles = of_triangles;
  last->of_polygons = of_polygons;
  last->count = make_mask(last, topology, linear, corner);
  last->topology = topology;
  last->corner = corner;
  return last->count;
}

/* The frame for the tangents of tangents_smooth, which lie along edges 0 and 1 of the ring. */
static void frame_smooth(const neighbours *m, uint32_t place, float frame[2][2]) {
  double step = 2 * TW_PI / m->fan_count;
  for (uint32_t i = 0; i < 2; i++) {
    frame[i][0] = (float)(sin((1 - (double)(place + i)) * step) / sin(step));
    frame[i][1] = (float)(sin((place + i) * step) / sin(step));
  }
}

/* The frame for the tangents of tangents_crease. They lie along the crease and at a right angle to it, where
 * the faces of a side share its half turn equally. False for a single face on a side, which has no inner edge
 * to measure by. */
static bool frame_crease(const neighbours *m, uint32_t place, sector s, float frame[2][2]) {
  uint32_t n = m->fan_count, index = (place + n - s.first) % n, faces = s.faces;
  double begin = 0;
  if (index >= faces) {
    begin = TW_PI;
    index -= faces;
    faces = n - faces;
  }
  if (faces == 1) return false;
  for (uint32_t i = 0; i < 2; i++) {
    frame[i][0] = (float)cos(begin + (index + i) * TW_PI / faces);
    frame[i][1] = (float)sin(begin + (index + i) * TW_PI / faces);
  }
  return true;
}

bool tw_limit_frame(const tw_topology *topology, bool linear, uint32_t corner, float frame[2][2]) {
  neighbours m = neighbours_of(topology, topology->corner_vertex[corner], NULL);
  uint32_t ends[2] = {0, 0};
  tw_vertex_rule rule = tangent_rule(&m, linear, ends);
  if (has_face_tangents(&m, linear, rule) || rule == TW_RULE_CORNER) return false;
  if (rule == TW_RULE_CREASE)
    return frame_crease(&m, fan_place(&m, corner), crease_side(&m, corner, ends), frame);
  frame_smooth(&m, fan_place(&m, corner), frame);
  return true;
}

bool tw_slope_frame(const tw_topology *topology, bool linear, uint32_t corner, float frame[2][2],
                    tw_limit_entry sides[2]) {
  if (tw_limit_frame(topology, linear, corner, frame)) return true;
  frame[0][0] = frame[1][1] = 1;
  frame[0][1] = frame[1][0] = 0;
  sides[0] = (tw_limit_entry){topology->corner_vertex[tw_corner_next(topology, corner)], 0, 1, 0};
  sides[1] = (tw_limit_entry){topology->corner_vertex[tw_corner_previous(topology, corner)], 0, 0, 1};
  return false;
}
