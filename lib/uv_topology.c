/* Face-varying connectivity: a UV set is a mesh of its own, in which every seam is a border. With the
 * vertices that OpenSubdiv's interpolation rules pin down made sharp, it subdivides by the same rules
 * as the points do. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "surface.h"

typedef struct placed_value {
  uint32_t value, corner;
} placed_value;

static int compare_values(const void *left, const void *right) {
  const placed_value *a = left, *b = right;
  if (a->value != b->value) return a->value < b->value ? -1 : 1;
  return a->corner < b->corner ? -1 : a->corner > b->corner;
}

/* Numbers the distinct values round each point: corners [corner_count] receives the numbers, values_of
 * the value of each, value_offsets [points + 1] the first number of each point. */
static tw_status number_values(const tw_topology *cage, const tw_uv_set *set, uint32_t *corners,
                               uint32_t *values_of, uint32_t *value_offsets) {
  placed_value *fan = NULL;
  uint32_t room = 0, count = 0;
  for (uint32_t v = 0; v < cage->vertex_count; v++) {
    uint32_t first = cage->fan_offsets[v], size = cage->fan_offsets[v + 1] - first;
    value_offsets[v] = count;
    if (size > room) {
      free(fan);
      room = size < 32 ? 32 : size;
      fan = tw_alloc(room, sizeof *fan);
      if (!fan) return TW_NO_MEMORY;
    }
    for (uint32_t i = 0; i < size; i++) {
      uint32_t corner = cage->fan_corners[first + i];
      fan[i] = (placed_value){set->corners[corner], corner};
    }
    if (size > 1) qsort(fan, size, sizeof *fan, compare_values);
    for (uint32_t i = 0; i < size; i++) {
      if (i == 0 || fan[i].value != fan[i - 1].value) values_of[count++] = fan[i].value;
      corners[fan[i].corner] = count - 1;
    }
  }
  value_offsets[cage->vertex_count] = count;
  free(fan);
  return TW_OK;
}

static bool is_corner(const tw_topology *uv, uint32_t v) {
  return uv->fan_offsets[v + 1] - uv->fan_offsets[v] == 1 &&
         uv->ring_offsets[v + 1] - uv->ring_offsets[v] == 2;
}

/* What OpenSubdiv's rules look at in the values [first, end) round one cage vertex. */
typedef struct value_facts {
  uint32_t count;
  bool seam, corner, disjoint;
} value_facts;

/* A value whose faces do not form one smooth fan: parted by a seam, or by an infinitely sharp edge. */
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

/* How long semi-sharp edges keep a value a corner, and how much of one it is in the step in which the
 * last of them vanish, written as one sharpness. 0: none is semi-sharp. */
static float equivalent_sharpness(const tw_topology *uv, uint32_t v) {
  float greatest = 0, sum = 0;
  uint32_t count = 0;
  for (uint32_t i = uv->ring_offsets[v]; i < uv->ring_offsets[v + 1]; i++) {
    float sharpness = uv->edge_sharpness[uv->ring_edges[i]];
    if (tw_is_semi_sharp(sharpness) && sharpness > greatest) greatest = sharpness;
  }
  float steps = ceilf(greatest) - 1;
  for (uint32_t i = uv->ring_offsets[v]; i < uv->ring_offsets[v + 1]; i++) {
    float sharpness = uv->edge_sharpness[uv->ring_edges[i]];
    if (!tw_is_semi_sharp(sharpness) || sharpness <= steps) continue;
    sum += sharpness;
    count++;
  }
  return count ? sum / (float)count : 0;
}

/* Of two values, one beside semi-sharp edges and one not, the second is held as long as the first. */
static void pin_dependent(tw_topology *uv, uint32_t first) {
  float one = equivalent_sharpness(uv, first), other = equivalent_sharpness(uv, first + 1);
  if ((one > 0) == (other > 0)) return;
  uint32_t dependent = one > 0 ? first + 1 : first;
  float sharpness = one > 0 ? one : other;
  if (!(uv->vertex_sharpness[dependent] > 0)) uv->vertex_sharpness[dependent] = sharpness;
}

static void pin_values(const tw_topology *cage, uint32_t vertex, tw_uv_rule rule, uint32_t first,
                       uint32_t end, tw_topology *uv) {
  value_facts facts = inspect_values(uv, first, end);
  bool all = pins_all(&facts, rule, cage->vertex_flags[vertex] & TW_VERTEX_BORDER) ||
             (facts.count > 1 && (cage->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD));
  bool plus = rule == TW_UV_CORNERS_PLUS1 || rule == TW_UV_CORNERS_PLUS2;
  if (plus && !all && facts.count == 2) pin_dependent(uv, first);
  for (uint32_t v = first; v < end; v++)
    if (all || (rule != TW_UV_NONE && is_corner(uv, v))) uv->vertex_sharpness[v] = TW_SHARPNESS_INFINITE;
}

tw_status tw_uv_topology(const tw_topology *cage, const tw_uv_set *set, tw_uv_rule rule, tw_arena *arena,
                         tw_topology *out, uint32_t **values_of) {
  uint32_t *corners = tw_arena_alloc(arena, cage->corner_count, sizeof *corners);
  uint32_t *offsets = tw_arena_alloc(arena, (size_t)cage->vertex_count + 1, sizeof *offsets);
  *values_of = tw_arena_alloc(arena, cage->corner_count, sizeof **values_of);
  if (!corners || !offsets || !*values_of) return TW_NO_MEMORY;
  tw_status status = number_values(cage, set, corners, *values_of, offsets);
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
  for (uint32_t v = 0; v < cage->vertex_count; v++)
    pin_values(cage, v, rule, offsets[v], offsets[v + 1], out);
  return TW_OK;
}
