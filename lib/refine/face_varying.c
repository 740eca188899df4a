/* Face-varying connectivity: a UV set, or another set of values at corners, is a mesh of its own, in which
 * every seam is a border. It subdivides by the same rules as the points, once the vertices that OpenSubdiv's
 * interpolation rules fix ("pin") are made sharp. */
#include "face_varying.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "crease.h"
#include "sorted.h"

typedef struct placed_value {
  uint32_t value, corner;
} placed_value;

static int compare_values(const void *left, const void *right) {
  const placed_value *a = left, *b = right;
  if (a->value != b->value) return a->value < b->value ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

/* Gives each distinct value at each point a number, a vertex of the UV mesh. corners: [corner_count] receives
 * the number at each corner; values_of: the value of each number; value_offsets: [points + 1] the first
 * number of each point. */
static tw_status number_values(const tw_topology *cage, const uint32_t *values, uint32_t *corners,
                               uint32_t *values_of, uint32_t *value_offsets) {
  placed_value *fan = NULL;
  uint32_t room = 0, count = 0;
  for (uint32_t v = 0; v < cage->vertex_count; v++) {
    uint32_t first = cage->fan_offsets[v], size = cage->fan_offsets[v + 1] - first;
    value_offsets[v] = count;
    if (size > room) {
      tw_free(fan);
      room = size < 32 ? 32 : size;
      fan = tw_alloc(room, sizeof *fan);
      if (!fan) return TW_NO_MEMORY;
    }
    for (uint32_t i = 0; i < size; i++) {
      uint32_t corner = cage->fan_corners[first + i];
      fan[i] = (placed_value){values[corner], corner};
    }
    tw_small_sort(fan, size, sizeof *fan, compare_values);
    for (uint32_t i = 0; i < size; i++) {
      if (i == 0 || fan[i].value != fan[i - 1].value) values_of[count++] = fan[i].value;
      corners[fan[i].corner] = count - 1;
    }
  }
  value_offsets[cage->vertex_count] = count;
  tw_free(fan);
  return TW_OK;
}

static bool is_corner(const tw_topology *uv, uint32_t v) {
  return uv->fan_offsets[v + 1] - uv->fan_offsets[v] == 1 &&
         uv->ring_offsets[v + 1] - uv->ring_offsets[v] == 2;
}

/* What OpenSubdiv's rules depend on, for the values [first, end) at one cage vertex. */
typedef struct value_facts {
  uint32_t count;
  bool seam, corner, disjoint;
} value_facts;

/* Whether the faces of a value do not form one smooth fan: seams separate them, or an infinitely sharp edge
 * divides them. A value that comes again around a point, in a sector that does not touch its first, is one
 * value, and non-manifold in the UV mesh: it stays as it is, as in OpenSubdiv, which overlooks it only where
 * the second of two values is the one that returns. */
static bool is_disjoint(const tw_topology *uv, uint32_t v) {
  if (uv->vertex_flags[v] & TW_VERTEX_NONMANIFOLD) return true;
  for (uint32_t i = uv->ring_offsets[v]; i < uv->ring_offsets[v + 1]; i++) {
    uint32_t edge = uv->ring_edges[i];
    if (tw_is_infinite(uv->edge_sharpness[edge]) && !(uv->edge_flags[edge] & TW_EDGE_BORDER)) return true;
  }
  return false;
}

static value_facts inspect_values(const tw_topology *uv, uint32_t first, uint32_t end) {
  value_facts facts = {end - first, false, false, false};
  for (uint32_t v = first; v < end; v++) {
    facts.seam |= (uv->vertex_flags[v] & TW_VERTEX_BORDER) != 0;
    facts.corner |= is_corner(uv, v);
    facts.disjoint |= is_disjoint(uv, v);
  }
  return facts;
}

static bool pins_all(const value_facts *facts, tw_uv_rule rule, bool on_border) {
  bool plus = rule == TW_UV_CORNERS_PLUS1 || rule == TW_UV_CORNERS_PLUS2;
  if (rule == TW_UV_BOUNDARIES) return facts->seam;
  if (plus && (facts->count > 2 || (facts->count == 2 && facts->disjoint))) return true;
  if (rule != TW_UV_CORNERS_PLUS2) return false;
  bool dart = facts->seam && facts->count == 1 && !on_border;
  return dart || (facts->count == 2 && facts->corner);
}

/* The semi-sharp edges at a cage vertex with two values: first the inner ones, between faces of one value,
 * then those along the seam. */
typedef struct decaying_edges {
  float *sharpness; /* [count] */
  uint32_t inner_count, count;
} decaying_edges;

static decaying_edges gather_decaying(const tw_topology *cage, uint32_t vertex, const tw_topology *uv,
                                      float *room) {
  decaying_edges edges = {room, 0, 0};
  for (int seam = 0; seam < 2; seam++) {
    for (uint32_t i = cage->ring_offsets[vertex]; i < cage->ring_offsets[vertex + 1]; i++) {
      uint32_t edge = cage->ring_edges[i];
      float sharpness = cage->edge_sharpness[edge];
      bool along_seam = uv->edge_flags[uv->corner_edge[cage->edge_corner[edge]]] & TW_EDGE_BORDER;
      if (tw_is_semi_sharp(sharpness) && along_seam == seam) room[edges.count++] = sharpness;
    }
    if (!seam) edges.inner_count = edges.count;
  }
  return edges;
}

/* Decays the edges by one step. Returns the share of the corner rule in that step: the mean sharpness, at
 * most 1, of the inner edges that vanish in it; 0: none vanishes. */
static float decay_edges(decaying_edges *edges, bool chaikin) {
  float semi_sum = 0, vanished = 0;
  uint32_t semi_count = 0, vanished_count = 0;
  for (uint32_t i = 0; i < edges->count; i++) {
    semi_sum += edges->sharpness[i];
    semi_count += edges->sharpness[i] > 0;
  }
  for (uint32_t i = 0; i < edges->count; i++) {
    float before = edges->sharpness[i], after = tw_decayed_edge(before, chaikin, semi_sum, semi_count);
    edges->sharpness[i] = after;
    if (i >= edges->inner_count || !(before > 0) || after > 0) continue;
    vanished += before;
    vanished_count++;
  }
  float share = vanished_count ? vanished / (float)vanished_count : 0;
  return share > 1 ? 1 : share;
}

static bool any_sharp(const float *sharpness, uint32_t count) {
  uint32_t i = 0;
  while (i < count && !(sharpness[i] > 0)) i++;
  return i < count;
}

/* The vertex sharpness that acts as the inner edges do: the vertex is a corner as long as one of them is
 * sharp, and blends by decay_edges's share in the step in which the last of them vanishes. Where seam edges
 * are still sharp then, OpenSubdiv frees the value one level later and without a blend, which is what a
 * sharpness close to 0 does in that level. 0 without inner edges. */
static float equivalent_sharpness(decaying_edges *edges, bool chaikin) {
  static const float next_to_nothing = 1.0f / (1 << 20);
  if (edges->inner_count == 0) return 0;
  /* The sharpest edge loses at least 1 a step, so the loop ends. */
  uint32_t steps = 0;
  float share = decay_edges(edges, chaikin);
  for (; any_sharp(edges->sharpness, edges->inner_count); steps++) share = decay_edges(edges, chaikin);
  if (any_sharp(edges->sharpness + edges->inner_count, edges->count - edges->inner_count))
    share = 1 + next_to_nothing;
  return fminf((float)steps + share, nextafterf(TW_SHARPNESS_INFINITE, 0));
}

static bool has_semi_sharp(const tw_topology *uv, uint32_t v) {
  for (uint32_t i = uv->ring_offsets[v]; i < uv->ring_offsets[v + 1]; i++)
    if (tw_is_semi_sharp(uv->edge_sharpness[uv->ring_edges[i]])) return true;
  return false;
}

/* Of two values at a vertex, where one has semi-sharp edges and the other has none, pins the other for as
 * long as the first is pinned. */
static void pin_dependent(const tw_topology *cage, uint32_t vertex, uint32_t first, float *room,
                          tw_topology *uv) {
  bool one = has_semi_sharp(uv, first), other = has_semi_sharp(uv, first + 1);
  if (one == other) return;
  uint32_t dependent = one ? first + 1 : first;
  if (uv->vertex_sharpness[dependent] > 0) return;
  decaying_edges edges = gather_decaying(cage, vertex, uv, room);
  uv->vertex_sharpness[dependent] = equivalent_sharpness(&edges, cage->semi_sum != NULL);
}

/* Makes the values that the rule pins sharp. room: one float for each edge at the vertex. */
static void pin_values(const tw_topology *cage, uint32_t vertex, tw_uv_rule rule, uint32_t first,
                       uint32_t end, float *room, tw_topology *uv) {
  value_facts facts = inspect_values(uv, first, end);
  bool all = pins_all(&facts, rule, cage->vertex_flags[vertex] & TW_VERTEX_BORDER) ||
             (facts.count > 1 && (cage->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD));
  bool plus = rule == TW_UV_CORNERS_PLUS1 || rule == TW_UV_CORNERS_PLUS2;
  if (plus && !all && facts.count == 2) pin_dependent(cage, vertex, first, room, uv);
  for (uint32_t v = first; v < end; v++)
    if (all || (rule != TW_UV_NONE && is_corner(uv, v))) uv->vertex_sharpness[v] = TW_SHARPNESS_INFINITE;
}

static uint32_t greatest_ring(const tw_topology *t) {
  uint32_t greatest = 0;
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    uint32_t edges = t->ring_offsets[v + 1] - t->ring_offsets[v];
    if (edges > greatest) greatest = edges;
  }
  return greatest;
}

tw_status tw_channel_topology(const tw_topology *cage, const uint32_t *values, tw_uv_rule rule,
                              tw_arena *arena, tw_topology *out, uint32_t **values_of) {
  uint32_t *corners = tw_arena_alloc(arena, cage->corner_count, sizeof *corners);
  uint32_t *offsets = tw_arena_alloc(arena, (size_t)cage->vertex_count + 1, sizeof *offsets);
  *values_of = tw_arena_alloc(arena, cage->corner_count, sizeof **values_of);
  if (!corners || !offsets || !*values_of) return TW_NO_MEMORY;
  tw_status status = number_values(cage, values, corners, *values_of, offsets);
  if (status == TW_OK)
    status = tw_topology_build(out, arena, offsets[cage->vertex_count], cage->face_count, cage->face_offsets,
                               cage->corner_count, corners);
  if (status == TW_OK) status = tw_topology_soften(out, arena);
  if (status != TW_OK) return status;
  for (uint32_t c = 0; c < cage->corner_count; c++)
    out->edge_sharpness[out->corner_edge[c]] = cage->edge_sharpness[cage->corner_edge[c]];
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    for (uint32_t i = offsets[v]; i < offsets[v + 1]; i++)
      out->vertex_sharpness[i] = cage->vertex_sharpness[v];
  tw_topology_sharpen(out, false);
  float *room = tw_alloc(greatest_ring(cage), sizeof *room);
  for (uint32_t v = 0; room && v < cage->vertex_count; v++)
    pin_values(cage, v, rule, offsets[v], offsets[v + 1], room, out);
  tw_free(room);
  return room ? TW_OK : TW_NO_MEMORY;
}
