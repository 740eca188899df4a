/* Shells are found on the base, from which the answer's faces come without new connections: an edge of the
 * base becomes 2^n edges of the answer with the same faces on its sides, and edges between children of one
 * face have two. */
#include "face_shells.h"

#include "open_border.h"
#include "surface.h"
#include "union_find.h"

enum { STEPS_A_CORNER = 4, CORNERS_AT_ONCE = 4096 };

/* ---- the base -------------------------------------------------------------------------------- */

/* The faces that the answer's come from: of a topology, or of the first of the shallow levels. */
typedef struct base {
  const tw_surface *surface;
  const tw_topology *topology;
  const tw_shallow_level *level; /* NULL: the topology counts */
  uint32_t face_count, edge_count, corner_count;
  const tw_topology *rim; /* of the rim of an open border, whose faces and edges come after these; or NULL */
} base;

static bool is_loop(const tw_surface *s) {
  return s->loop_above.face_count > 0;
}

static base base_of(const tw_surface *s) {
  base b = {.surface = s, .topology = is_loop(s) ? &s->loop_above : &s->fields[0].base};
  if (s->levels) b.level = &s->levels[0].at[0];
  b.face_count = b.level ? b.level->face_count : b.topology->face_count;
  b.edge_count = b.level ? b.level->edge_count : b.topology->edge_count;
  b.corner_count = b.level ? b.level->corner_count : b.topology->corner_count;
  if (s->rim) b.rim = &s->rim->fields[0].base;
  return b;
}

/* Faces and edges with those of the rim. */
static uint32_t all_faces(const base *b) {
  return b->face_count + (b->rim ? b->rim->face_count : 0);
}
static uint32_t all_edges(const base *b) {
  return b->edge_count + (b->rim ? b->rim->edge_count : 0);
}

static uint32_t face_of_corner(const base *b, uint32_t corner) {
  return b->level ? tw_shallow_corner_face(b->level, b->level->face_size, corner)
                  : tw_corner_face(b->topology, corner);
}

/* *against: the corner runs against the edge. */
static uint32_t edge_of_corner(const base *b, uint32_t corner, bool *against) {
  if (b->level) {
    *against = b->level->corner_half[corner] & 1;
    return b->level->corner_half[corner] >> 1;
  }
  uint32_t edge = b->topology->corner_edge[corner];
  *against = b->topology->edge_vertices[edge][0] != b->topology->corner_vertex[corner];
  return edge;
}

static uint32_t base_face(const base *b, uint64_t face) {
  const tw_surface *s = b->surface;
  if (s->options.level == 0) return face_of_corner(b, s->cage_step * s->face_first[face]);
  if (is_loop(s)) return tw_base_quad(s, (uint32_t)face) / 4;
  const tw_face_place at = tw_surface_face_place(s, face);
  uint64_t run;
  return (at.part != s ? b->face_count : 0) + tw_surface_base_face(at.part, at.place, &run);
}

/* Marks the faces of the base and of the rim that the answer shows. shown: [all_faces] zeroed. */
static void mark_shown(const base *b, uint8_t *shown) {
  const tw_surface *s = b->surface;
  if (s->options.level == 0) {
    for (uint32_t f = 0; f < s->face_count; f++)
      for (uint64_t c = 0; c < s->corners_before[f + 1] - s->corners_before[f]; c++)
        shown[face_of_corner(b, s->cage_step * (s->face_first[f] + (uint32_t)c))] = 1;
  } else if (s->levels || is_loop(s) || !s->quads) {
    memset(shown, 1, b->face_count);
  } else {
    for (uint32_t q = 0; q < s->quad_count; q++) shown[s->quads[q]] = 1;
  }
  for (uint32_t q = 0; s->rim && q < s->rim->quad_count; q++) shown[b->face_count + s->rim->quads[q]] = 1;
}

/* ---- shells ---------------------------------------------------------------------------------- */

/* What the faces at an edge are: the first one, and how many run along it in either direction, as far as 3.
 */
typedef struct edge_faces {
  uint32_t first;
  uint8_t along, against;
} edge_faces;

static void add_face(edge_faces *edge, bool is_against, uint32_t face, uint32_t *sets) {
  uint8_t *count = is_against ? &edge->against : &edge->along;
  if (edge->along + edge->against == 0) edge->first = face;
  if (*count < 3) ++*count;
  tw_union_find_join(sets, face, edge->first);
}

/* Whether a face of the rim lies at an edge of the rim's mesh, or of the base where its faces are inner ones.
 */
static bool is_at_rim(const base *b, const tw_topology *t, uint32_t edge) {
  uint32_t first = t->edge_corner[edge], corner = first;
  do {
    uint32_t face = tw_corner_face(t, corner);
    if (t == b->rim ? b->surface->rim->inner_faces[face] == UINT32_MAX : tw_open_is_rim(t, face)) return true;
    corner = t->sibling[corner];
  } while (corner != first);
  return false;
}

/* Joins the faces at each edge that has one of the rim. */
static void join_rim(const base *b, const uint8_t *shown, edge_faces *edges, uint32_t *sets) {
  const tw_topology *t = b->rim;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    if (!is_at_rim(b, t, e)) continue;
    uint32_t first = t->edge_corner[e], corner = first;
    do {
      uint32_t own = tw_corner_face(t, corner), inner = b->surface->rim->inner_faces[own],
               face = inner == UINT32_MAX ? b->face_count + own : inner;
      bool is_against = t->edge_vertices[e][0] != t->corner_vertex[corner];
      if (shown[face]) add_face(&edges[b->edge_count + e], is_against, face, sets);
      corner = t->sibling[corner];
    } while (corner != first);
  }
}

/* Joins the faces at each edge. sets: [all_faces]. False where the result is no longer wanted. */
static bool join_faces(const base *b, const uint8_t *shown, edge_faces *edges, uint32_t *sets) {
  tw_union_find_init(sets, all_faces(b));
  for (uint32_t c = 0; c < b->corner_count; c++) {
    if (c % CORNERS_AT_ONCE == 0 && !tw_work((uint64_t)CORNERS_AT_ONCE * STEPS_A_CORNER)) return false;
    uint32_t face = face_of_corner(b, c);
    if (!shown[face]) continue;
    bool is_against;
    uint32_t edge = edge_of_corner(b, c, &is_against);
    if (!b->rim || !is_at_rim(b, b->topology, edge)) add_face(&edges[edge], is_against, face, sets);
  }
  if (!b->rim) return true;
  join_rim(b, shown, edges, sets);
  return tw_work((uint64_t)b->rim->corner_count * STEPS_A_CORNER);
}

/* A face that comes to two points twice has an edge there for each time, one after the other. Of level 0 they
 * are one edge of the answer: the second one's faces are added to the first. */
static void join_folds(const base *b, edge_faces *edges, uint32_t *sets) {
  const tw_topology *t = b->topology;
  uint32_t first = 0;
  for (uint32_t e = 1; !b->level && e < b->edge_count; e++) {
    const uint32_t *own = t->edge_vertices[e], *to = t->edge_vertices[first];
    bool is_turned = own[0] == to[1] && own[1] == to[0];
    if (!is_turned && (own[0] != to[0] || own[1] != to[1])) {
      first = e;
      continue;
    }
    for (uint8_t i = 0; i < edges[e].along; i++) add_face(&edges[first], is_turned, edges[e].first, sets);
    for (uint8_t i = 0; i < edges[e].against; i++) add_face(&edges[first], !is_turned, edges[e].first, sets);
    edges[e] = (edge_faces){0};
  }
}

/* Numbers the sets: in place of its root each face gets the number of its shell. Roots come first. */
static uint32_t number_shells(const base *b, const uint8_t *shown, uint32_t *sets) {
  uint32_t count = 0;
  for (uint32_t f = 0; f < all_faces(b); f++)
    if (!shown[f])
      sets[f] = UINT32_MAX;
    else
      sets[f] = sets[f] == f ? count++ : sets[sets[f]];
  return count;
}

/* Flattens the sets so that each face's parent is its root. */
static void find_roots(uint32_t face_count, uint32_t *sets) {
  for (uint32_t f = 0; f < face_count; f++) sets[f] = tw_union_find_root(sets, f);
}

/* Edges of the answer for one of the base's. At level 0 the base may be level 1, with two for one. */
static uint64_t scale_count(const tw_surface *s, uint64_t count) {
  uint32_t level = s->options.level, base_level = s->base_level;
  return level >= base_level ? count << (level - base_level) : count >> (base_level - level);
}

static void count_edge(const edge_faces *edge, tw_face_shells *out) {
  uint32_t count = edge->along + edge->against;
  if (count == 0) return;
  tw_shell_edges *shell = &out->edges[out->of[edge->first]];
  shell->open += count == 1;
  shell->crowded += count > 2;
  shell->flipped += count == 2 && edge->along != 1;
}

static void count_edges(const base *b, const edge_faces *edges, tw_face_shells *out) {
  for (uint32_t e = 0; e < b->edge_count; e++) count_edge(&edges[e], out);
  for (uint32_t i = 0; i < out->count; i++) {
    tw_shell_edges *shell = &out->edges[i];
    *shell =
        (tw_shell_edges){scale_count(out->surface, shell->open), scale_count(out->surface, shell->crowded),
                         scale_count(out->surface, shell->flipped)};
  }
  for (uint32_t e = b->edge_count; e < all_edges(b); e++) count_edge(&edges[e], out);
}

static tw_status find(const base *b, uint8_t *shown, edge_faces *edges, tw_face_shells *out) {
  out->of = tw_alloc(all_faces(b), sizeof *out->of);
  if (!shown || !edges || !out->of) return TW_NO_MEMORY;
  mark_shown(b, shown);
  if (!join_faces(b, shown, edges, out->of)) return TW_CANCELLED;
  if (out->surface->options.level == 0) join_folds(b, edges, out->of);
  find_roots(all_faces(b), out->of);
  out->count = number_shells(b, shown, out->of);
  out->edges = tw_alloc_zero(out->count, sizeof *out->edges);
  if (!out->edges) return TW_NO_MEMORY;
  count_edges(b, edges, out);
  return TW_OK;
}

tw_status tw_face_shells_find(const tw_surface *surface, tw_face_shells *out, tw_error *error) {
  const base b = base_of(surface);
  *out = (tw_face_shells){.surface = surface};
  uint8_t *shown = tw_alloc_zero(all_faces(&b), 1);
  edge_faces *edges = tw_alloc_zero(all_edges(&b), sizeof *edges);
  tw_status status = find(&b, shown, edges, out);
  tw_free(shown);
  tw_free(edges);
  if (status == TW_CANCELLED) return tw_fail(error, status, "the shells are not wanted any more");
  return status == TW_OK ? status : tw_fail(error, status, "out of memory");
}

void tw_face_shells_deinit(tw_face_shells *shells) {
  tw_free(shells->of);
  tw_free(shells->edges);
}

uint32_t tw_face_shell(const tw_face_shells *shells, uint64_t face) {
  const base b = base_of(shells->surface);
  return shells->of[base_face(&b, face)];
}
