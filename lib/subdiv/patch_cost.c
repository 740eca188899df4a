/* Counts quads by what makes them dear: all of those that surround one are of one class, and what a class and
 * its patches cost depends on what is irregular about it. */
#include "patch_cost.h"

#include <string.h>

#include "neighbourhood.h"

/* In quads that the generic step makes meanwhile. */
enum { COST_QUAD = 25, COST_COMMON = 15, COST_MIXED = 90, COST_CLASS = 1000, COST_SHARP = 1300 };

enum { REGULAR_FACES = 4, COMMON_FACES_MAX = 8, SEEN_BITS = 1024 };

/* What a quad's corner is: the faces of a smooth vertex, or one of these. */
enum { CORNER_REGULAR = REGULAR_FACES, CORNER_SHARP = 0 };

typedef struct tally {
  uint64_t quads, common, mixed, classes, sharp;
  uint8_t seen[SEEN_BITS / 8]; /* classes of smooth quads */
} tally;

/* Whether what is sharp at a vertex is a border or a crease that the regular rule knows. */
static bool is_regular_crease(const tw_topology *t, uint32_t vertex) {
  uint32_t faces = t->fan_offsets[vertex + 1] - t->fan_offsets[vertex], first = t->ring_offsets[vertex],
           sharp = 0, ends[2] = {0, 0};
  bool border = t->vertex_flags[vertex] & TW_VERTEX_BORDER;
  if (faces > REGULAR_FACES) return false; /* a pole is asked for by each of its faces */
  if (t->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD) return false;
  for (uint32_t i = first; i < t->ring_offsets[vertex + 1]; i++) {
    float sharpness = t->edge_sharpness[t->ring_edges[i]];
    if (!(sharpness > 0)) continue;
    if (tw_is_semi_sharp(sharpness) || sharp == 2) return false;
    ends[sharp++] = i - first;
  }
  if (border && faces == 1) return tw_is_infinite(t->vertex_sharpness[vertex]);
  if (sharp != 2 || t->vertex_sharpness[vertex] > 0) return false;
  return border ? faces == 2 : faces == REGULAR_FACES && ends[1] - ends[0] == 2;
}

static uint32_t corner_kind(const tw_topology *t, uint32_t vertex) {
  uint8_t faces = tw_vertex_smooth_faces(t, vertex);
  if (faces > 0) return faces;
  return is_regular_crease(t, vertex) ? CORNER_REGULAR : CORNER_SHARP;
}

/* One more smooth quad of this class. */
static void see_class(tally *sum, uint32_t key) {
  uint32_t bit = (key ^ key >> 7 ^ key >> 14 ^ key >> 21) % SEEN_BITS;
  uint8_t mask = (uint8_t)(1u << bit % 8);
  sum->classes += !(sum->seen[bit / 8] & mask);
  sum->seen[bit / 8] |= mask;
}

static void add_quad(tally *sum, const uint32_t kinds[4]) {
  uint32_t odd = 0, key = 0, most = 0;
  bool sharp = false;
  for (int k = 0; k < 4; k++) {
    odd += kinds[k] != CORNER_REGULAR;
    sharp |= kinds[k] == CORNER_SHARP;
    key = key << 8 | kinds[k];
    if (kinds[k] > most) most = kinds[k];
  }
  sum->quads++;
  if (sharp) {
    sum->sharp++;
  } else if (odd == 1 && most <= COMMON_FACES_MAX) {
    sum->common++;
  } else if (odd > 0) {
    sum->mixed++;
    see_class(sum, key);
  }
}

/* The middle of an edge is regular unless the edge is semi-sharp. */
static uint32_t middle_kind(const tw_topology *t, uint32_t corner) {
  uint32_t edge = t->corner_edge[corner];
  return tw_is_semi_sharp(t->edge_sharpness[edge]) || (t->edge_flags[edge] & TW_EDGE_NONMANIFOLD)
             ? CORNER_SHARP
             : CORNER_REGULAR;
}

/* The quad of a corner at the first level. */
static void add_corner(tally *sum, const tw_topology *t, uint32_t corner) {
  uint32_t size = tw_face_size(t, tw_corner_face(t, corner));
  const uint32_t kinds[4] = {corner_kind(t, t->corner_vertex[corner]), middle_kind(t, corner), size,
                             middle_kind(t, tw_corner_previous(t, corner))};
  add_quad(sum, kinds);
}

static void add_face(tally *sum, const tw_topology *t, uint32_t face) {
  uint32_t kinds[4];
  for (uint32_t k = 0; k < 4; k++) kinds[k] = corner_kind(t, t->corner_vertex[4 * face + k]);
  add_quad(sum, kinds);
}

uint64_t tw_patch_cost(const tw_topology *cage) {
  tally sum = {0};
  if (cage->face_size == 4)
    for (uint32_t f = 0; f < cage->face_count; f++) add_face(&sum, cage, f);
  else
    for (uint32_t c = 0; c < cage->corner_count; c++) add_corner(&sum, cage, c);
  return COST_QUAD * sum.quads + COST_COMMON * sum.common + COST_MIXED * sum.mixed +
         COST_CLASS * sum.classes + COST_SHARP * sum.sharp;
}
