/* Finds the cage of a refined mesh by steps back. Each step finds which faces are children of one parent
 * (coarse_faces.h), makes the parents' mesh, and solves for its values (mask_inverse.h). */
#include "tweend/coarsen.h"

#include <math.h>
#include <string.h>

#include "cage.h"
#include "coarse_details.h"
#include "face_varying.h"
#include "mask_inverse.h"
#include "sorted.h"
#include "surface.h"

/* The cage fits as long as the errors of all steps sum up to no more than this share of the mesh's size. */
static const double FITS = 1e-5;

static const uint32_t NONE = UINT32_MAX;

/* One step back: from the child `mesh` to its parents. */
typedef struct coarsening {
  const tw_mesh *mesh;
  const double *positions; /* [point_count][3] */
  tw_surface_options options;
  const tw_parallel_for *parallel;
  tw_rules rules;
  tw_arena *scratch, *arena; /* memory of this step; memory of the result */
  tw_cage child;
  uint8_t *parts, *seen;
  uint32_t *faces;
  uint32_t *number_of; /* [child vertices] the parents' vertex at each; NONE: there is none */
  bool is_ambiguous;
  uint32_t parted;         /* parents whose children differ, as in tw_coarsened */
  uint32_t untagged;       /* as in tw_coarsened */
  uint32_t misfit;         /* a face of the child's where its connectivity is not that of a step */
  double *strays;          /* as in tw_coarsened */
  uint32_t levels;         /* steps taken back before this one */
  const uint32_t *corners; /* from tw_coarse_corners for the steps before; make_mesh adds this step */
} coarsening;

/* The parents of the faces of some pieces. Arrays live in one arena. */
typedef struct parents {
  tw_coarse_faces faces;
  tw_topology topology; /* sharpened */
  uint32_t *vertices;   /* [vertices] the child's vertex at each */
  float *creases;       /* [edges] the tagged sharpness of each; 0 on borders */
} parents;

/* ---- the parents' connectivity --------------------------------------------------------------- */

/* Numbers the parents' vertices in the order of the child's. corners: [faces.corner_count] receives the
 * vertex at each corner. */
static tw_status number_vertices(coarsening *s, parents *p, tw_arena *arena, uint32_t *corners,
                                 uint32_t *count) {
  const tw_topology *t = &s->child.topology;
  p->vertices = tw_arena_alloc_raw(arena, p->faces.corner_count, sizeof *p->vertices);
  if (!p->vertices) return TW_NO_MEMORY;
  *count = 0;
  for (uint32_t c = 0; c < p->faces.corner_count; c++) {
    uint32_t vertex = t->corner_vertex[p->faces.origins[c]];
    if (s->number_of[vertex] != NONE) continue;
    s->number_of[vertex] = 0; /* marks it as seen; numbers follow once all are sorted */
    p->vertices[(*count)++] = vertex;
  }
  tw_status status = tw_sort(p->vertices, *count, sizeof *p->vertices, tw_compare_uint32);
  if (status != TW_OK) return status;
  for (uint32_t v = 0; v < *count; v++) s->number_of[p->vertices[v]] = v;
  for (uint32_t c = 0; c < p->faces.corner_count; c++)
    corners[c] = s->number_of[t->corner_vertex[p->faces.origins[c]]];
  for (uint32_t v = 0; v < *count; v++) s->number_of[p->vertices[v]] = NONE;
  return TW_OK;
}

/* The sharpness that decays to this one in a step. */
static float before_decay(float sharpness) {
  if (!(sharpness > 0)) return 0;
  return tw_is_infinite(sharpness) ? sharpness : fminf(sharpness + 1, nextafterf(TW_SHARPNESS_INFINITE, 0));
}

/* The edges of the child that are the halves of a parent's edge, in the order of its ends. */
static void halves_of(const coarsening *s, const parents *p, uint32_t edge, uint32_t halves[2]) {
  const tw_topology *t = &s->child.topology, *coarse = &p->topology;
  uint32_t corner = coarse->edge_corner[edge], origin = p->faces.origins[corner],
           end = tw_corner_previous(t, p->faces.origins[tw_corner_next(coarse, corner)]);
  bool is_first = coarse->corner_vertex[corner] == coarse->edge_vertices[edge][0];
  halves[is_first ? 0 : 1] = t->corner_edge[origin];
  halves[is_first ? 1 : 0] = t->corner_edge[end];
}

/* The sharpness of the parents' edges, as far as it is solved for from that of their halves (Chaikin's rule).
 */
typedef struct unsharpening {
  const tw_topology *coarse;
  float (*halves)[2]; /* [edges] sharpness of the halves, in the order of edge_vertices */
  float *creases;     /* [edges] */
  uint8_t *is_known;  /* [edges] whether creases has the parent's */
} unsharpening;

/* Whether Chaikin's rule tells of the parent's edge: it was semi-sharp if one of its halves still is. */
static bool was_semi_sharp(const unsharpening *u, uint32_t edge) {
  const float *halves = u->halves[edge];
  return tw_is_semi_sharp(fmaxf(halves[0], halves[1]));
}

/* Solves Chaikin's rule at a vertex: the sharpness of a half is 3/4 of its edge's and 1/4 of the mean of the
 * other edges', less 1. The unknowns are the edges whose halves at the vertex are still sharp; edges whose
 * halves there have decayed to 0 must be known. Returns whether an edge's sharpness was found. */
static bool solve_vertex(unsharpening *u, uint32_t vertex) {
  const tw_topology *t = u->coarse;
  double sum = 0, known = 0;
  uint32_t count = 0, there = 0, unknown = 0;
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    uint32_t edge = t->ring_edges[i];
    if (!was_semi_sharp(u, edge)) continue;
    float half = u->halves[edge][t->edge_vertices[edge][0] == vertex ? 0 : 1];
    count++;
    if (!(half > 0) && !u->is_known[edge]) return false;
    there += half > 0;
    unknown += half > 0 && !u->is_known[edge];
    if (half > 0)
      sum += (double)half;
    else
      known += (double)u->creases[edge];
  }
  if (unknown == 0) return false;
  double share = count > 1 ? 0.25 / (count - 1) : 0, own = count > 1 ? 0.75 : 1;
  double all = known + (sum + there - share * there * known) / (own + share * (there - 1.0));
  for (uint32_t i = t->ring_offsets[vertex]; i < t->ring_offsets[vertex + 1]; i++) {
    uint32_t edge = t->ring_edges[i];
    float half = u->halves[edge][t->edge_vertices[edge][0] == vertex ? 0 : 1];
    if (!was_semi_sharp(u, edge) || u->is_known[edge] || !(half > 0)) continue;
    double before = ((double)half + 1 - share * all) / (own - share);
    u->creases[edge] = (float)fmax(0, fmin(before, (double)nextafterf(TW_SHARPNESS_INFINITE, 0)));
    u->is_known[edge] = 1;
  }
  return true;
}

/* Takes Chaikin's rule back. An edge whose sharpness its neighbours leave open keeps what uniform decay says.
 * A pass over the vertices takes a value further by an edge at least. */
static tw_status unsharpen(const coarsening *s, parents *p, float (*halves)[2]) {
  unsharpening u = {&p->topology, halves, p->creases, NULL};
  u.is_known = tw_arena_alloc(s->scratch, p->topology.edge_count, 1);
  if (!u.is_known) return TW_NO_MEMORY;
  enum { PASSES_MAX = 16 };
  bool goes_on = true;
  for (int pass = 0; goes_on && pass < PASSES_MAX; pass++) {
    goes_on = false;
    for (uint32_t v = 0; v < p->topology.vertex_count; v++) goes_on |= solve_vertex(&u, v);
  }
  return TW_OK;
}

/* A crease on the parent's edge makes both halves sharp, but for Chaikin's rule, under which one may have
 * decayed. */
static tw_status sharpen(const coarsening *s, parents *p) {
  tw_topology *coarse = &p->topology;
  const tw_topology *t = &s->child.topology;
  float(*halves)[2] = tw_arena_alloc(s->scratch, coarse->edge_count, sizeof *halves);
  if (!halves) return TW_NO_MEMORY;
  for (uint32_t e = 0; e < coarse->edge_count; e++) {
    uint32_t edges[2];
    if (coarse->edge_flags[e] & TW_EDGE_BORDER) continue;
    halves_of(s, p, e, edges);
    for (int end = 0; end < 2; end++) halves[e][end] = t->edge_sharpness[edges[end]];
    float least = fminf(halves[e][0], halves[e][1]), most = fmaxf(halves[e][0], halves[e][1]);
    p->creases[e] = before_decay(s->rules.chaikin && !(least > 0) && tw_is_semi_sharp(most) ? most : least);
  }
  tw_status status = s->rules.chaikin ? unsharpen(s, p, halves) : TW_OK;
  if (status != TW_OK) return status;
  for (uint32_t e = 0; e < coarse->edge_count; e++)
    if (!(coarse->edge_flags[e] & TW_EDGE_BORDER)) coarse->edge_sharpness[e] = p->creases[e];
  for (uint32_t v = 0; v < coarse->vertex_count; v++)
    coarse->vertex_sharpness[v] = before_decay(t->vertex_sharpness[p->vertices[v]]);
  tw_topology_sharpen(coarse, s->options.boundary == TW_BOUNDARY_EDGE_AND_CORNER);
  return TW_OK;
}

static tw_status make_parents(coarsening *s, const tw_piece *piece, tw_arena *arena, parents *p) {
  memset(p, 0, sizeof *p);
  p->faces.face_offsets = tw_arena_alloc_raw(arena, (size_t)piece->face_count + 1, sizeof(uint32_t));
  p->faces.origins = tw_arena_alloc_raw(arena, piece->face_count, sizeof(uint32_t));
  uint32_t *corners = tw_arena_alloc_raw(arena, piece->face_count, sizeof *corners), vertex_count;
  if (!p->faces.face_offsets || !p->faces.origins || !corners) return TW_NO_MEMORY;
  tw_coarse_faces_of(&s->child.topology, s->parts, piece, s->seen, &p->faces);
  tw_status status = number_vertices(s, p, arena, corners, &vertex_count);
  if (status == TW_OK)
    status = tw_topology_build(&p->topology, arena, vertex_count, p->faces.face_count, p->faces.face_offsets,
                               p->faces.corner_count, corners);
  if (status == TW_OK) status = tw_topology_soften(&p->topology, arena);
  if (status != TW_OK) return status;
  p->creases = tw_arena_alloc(arena, p->topology.edge_count, sizeof *p->creases);
  if (!p->creases) return TW_NO_MEMORY;
  status = sharpen(s, p);
  if (status != TW_OK) return status;
  return s->rules.chaikin ? tw_topology_sum_semi(&p->topology, arena) : TW_OK;
}

/* ---- values ---------------------------------------------------------------------------------- */

/* Gathers the child's values in the order in which a step numbers the vertices it makes of `coarse`: at the
 * coarse vertices, in the middles of the coarse edges, then (Catmull-Clark) inside the coarse faces.
 * value_at: [child corners] index of the value at each. Returns those indices, [rows]; NULL without memory.
 * *several: a parent whose corners have other values at a vertex than a parent before; NONE: there is none.
 * Starting at the child's corner where the parent's corner is, the child's next corner lies in the middle of
 * the parent's edge, and the one after it inside the parent. */
static uint32_t *gather(const coarsening *s, const parents *p, const tw_topology *coarse,
                        const uint32_t *value_at, tw_arena *arena, uint32_t *several) {
  const tw_topology *t = &s->child.topology;
  uint32_t V = coarse->vertex_count, E = coarse->edge_count, F = s->rules.loop ? 0 : coarse->face_count;
  size_t rows = (size_t)V + E + F;
  uint32_t *values = tw_arena_alloc_raw(arena, rows, sizeof *values);
  if (!values) return NULL;
  memset(values, 0xFF, rows * sizeof *values);
  *several = NONE;
  for (uint32_t f = 0; f < coarse->face_count; f++)
    for (uint32_t c = tw_face_begin(coarse, f); c < tw_face_begin(coarse, f) + tw_face_size(coarse, f); c++) {
      uint32_t corner = p->faces.origins[c];
      const uint32_t places[3] = {coarse->corner_vertex[c], V + coarse->corner_edge[c], V + E + f};
      for (int i = 0; i < (s->rules.loop ? 2 : 3); i++, corner = tw_corner_next(t, corner)) {
        uint32_t *place = &values[places[i]];
        if (*place != NONE && *place != value_at[corner] && *several == NONE) *several = f;
        if (*place == NONE) *place = value_at[corner];
      }
    }
  return values;
}

static uint32_t row_count(const coarsening *s, const tw_topology *coarse) {
  return coarse->vertex_count + coarse->edge_count + (s->rules.loop ? 0 : coarse->face_count);
}

/* The greatest range of a component of values. */
static double range_of(const double *values, size_t rows, uint32_t width) {
  double range = 0;
  for (uint32_t c = 0; c < width; c++) {
    double least = values[c], most = least;
    for (size_t row = 1; row < rows; row++) {
      least = fmin(least, values[row * width + c]);
      most = fmax(most, values[row * width + c]);
    }
    range = fmax(range, most - least);
  }
  return range;
}

/* Solves for coarse values of `width` numbers each. values: [rows] index in `source` of each row's value.
 * *out: [coarse vertices][width], rounded to float. */
static tw_status solve_floats(const coarsening *s, const tw_rules *rules, const tw_topology *coarse,
                              const uint32_t *values, const float *source, uint32_t width,
                              const float **out) {
  size_t rows = row_count(s, coarse), count = (size_t)coarse->vertex_count * width;
  double error, *child = tw_arena_alloc_raw(s->scratch, rows * width, sizeof *child),
                *solved = tw_arena_alloc_raw(s->scratch, count, sizeof *solved);
  float *rounded = tw_arena_alloc_raw(s->arena, count, sizeof *rounded);
  if (!child || !solved || !rounded) return TW_NO_MEMORY;
  for (size_t row = 0; row < rows; row++)
    for (uint32_t c = 0; c < width; c++) child[row * width + c] = source[(size_t)values[row] * width + c];
  tw_status status = tw_invert_masks(coarse, rules, width, child, s->parallel, solved, &error);
  for (size_t i = 0; status == TW_OK && i < count; i++) rounded[i] = (float)solved[i];
  double range = status == TW_OK && rows > 0 ? range_of(child, rows, width) : 0;
  if (range > 0) *s->strays = fmax(*s->strays, error / range);
  *out = rounded;
  return status;
}

static uint32_t point_of(const coarsening *s, uint32_t vertex) {
  return s->child.point_of ? s->child.point_of[vertex] : vertex;
}

/* Solves for the parents' points. *out: [vertices][3]. *points: [rows] the mesh's point of each row.
 * TW_INVALID: the parents have doubled edges, so that the child's connectivity is not that of a step;
 * s->misfit is a face there. */
static tw_status solve_points(coarsening *s, const parents *p, tw_arena *arena, double **out,
                              uint32_t **points, double *error) {
  uint32_t several;
  *points = gather(s, p, &p->topology, s->child.topology.corner_vertex, arena, &several);
  uint32_t rows = row_count(s, &p->topology);
  double *child = tw_arena_alloc_raw(arena, rows, 3 * sizeof *child);
  *out = tw_arena_alloc_raw(arena, p->topology.vertex_count, 3 * sizeof **out);
  if (!*points || !child || !*out) return TW_NO_MEMORY;
  if (several != NONE) {
    s->misfit = p->faces.origins[p->faces.face_offsets[several]] / s->child.topology.face_size;
    return TW_INVALID;
  }
  for (size_t row = 0; row < rows; row++) {
    (*points)[row] = point_of(s, (*points)[row]);
    memcpy(child + 3 * row, s->positions + 3 * (size_t)(*points)[row], 3 * sizeof *child);
  }
  return tw_invert_masks(&p->topology, &s->rules, 3, child, s->parallel, *out, error);
}

/* ---- which cage ------------------------------------------------------------------------------ */

static void clear_parts(coarsening *s, const tw_piece *piece) {
  for (uint32_t i = 0; i < piece->face_count; i++) s->parts[piece->faces[i]] = UINT8_MAX;
}

/* Clears the marks that tw_coarse_faces_of left, so that it can be called again for these faces. */
static void clear_seen(coarsening *s, const tw_piece *piece) {
  const tw_topology *t = &s->child.topology;
  for (uint32_t i = 0; i < piece->face_count; i++)
    for (uint32_t c = 0; c < t->face_size; c++)
      s->seen[s->rules.loop ? piece->faces[i] : t->corner_vertex[t->face_size * piece->faces[i] + c]] = 0;
}

/* Measures how far a piece is from the surface of its parents. *error: INFINITY where the parents cannot be
 * solved for. */
static tw_status measure(coarsening *s, const tw_piece *piece, double *error) {
  tw_arena *arena = tw_arena_create();
  parents p;
  double *solved;
  uint32_t *points;
  *error = INFINITY;
  tw_status status = arena ? make_parents(s, piece, arena, &p) : TW_NO_MEMORY;
  if (status == TW_OK) status = solve_points(s, &p, arena, &solved, &points, error);
  clear_seen(s, piece);
  tw_arena_destroy(arena);
  return status == TW_INVALID ? TW_OK : status;
}

/* Chooses the parts of the faces of the piece that `face` is in, by trying all parts of `face`. Where several
 * are possible, the one whose parents' surface has the least error is chosen. The part of `face` stays
 * UINT8_MAX where the piece is no refinement. */
static tw_status choose_parts(coarsening *s, uint32_t face, tw_piece *piece) {
  bool fits[TW_PARTS];
  int count = 0, best = 0;
  for (int part = 0; part < TW_PARTS; part++) {
    fits[part] = tw_coarse_parts(&s->child.topology, face, (uint8_t)part, s->parts, s->faces, piece);
    clear_parts(s, piece);
    if (fits[part]) best = part;
    count += fits[part];
  }
  double least = INFINITY;
  for (int part = 0; count > 1 && part < TW_PARTS; part++) {
    if (!fits[part]) continue;
    double error;
    tw_coarse_parts(&s->child.topology, face, (uint8_t)part, s->parts, s->faces, piece);
    tw_status status = measure(s, piece, &error);
    clear_parts(s, piece);
    if (status != TW_OK) return status;
    if (error < least) best = part;
    least = fmin(error, least);
  }
  if (count > 0 && (count == 1 || least < INFINITY))
    tw_coarse_parts(&s->child.topology, face, (uint8_t)best, s->parts, s->faces, piece);
  return TW_OK;
}

static tw_status fail_at(uint32_t face, tw_error *error) {
  tw_fail(error, TW_INVALID,
          "the mesh is no refinement: the piece that face %u is in is not made of children of faces", face);
  return tw_error_at(error, "/faces/%u", face);
}

static tw_status choose_all(coarsening *s, tw_error *error) {
  const tw_topology *t = &s->child.topology;
  for (uint32_t e = 0; e < t->edge_count; e++)
    if (t->edge_flags[e] & TW_EDGE_NONMANIFOLD) return fail_at(t->edge_corner[e] / t->face_size, error);
  for (uint32_t f = 0; f < t->face_count; f++) {
    tw_piece piece;
    if (s->parts[f] != UINT8_MAX) continue;
    tw_status status = choose_parts(s, f, &piece);
    if (status != TW_OK) return status;
    if (s->parts[f] == UINT8_MAX) return fail_at(f, error);
  }
  return TW_OK;
}

/* Finds whether other parents have the same surface: on a closed piece with valence 3 everywhere, offsets
 * that alternate in sign along every edge are mapped to 0 by the masks. That needs vertices which can be
 * signed so that every edge joins a plus and a minus. */
static tw_status find_ambiguity(coarsening *s, const tw_topology *t) {
  int8_t *signs = tw_arena_alloc(s->scratch, t->vertex_count, 1);
  uint32_t *stack = tw_arena_alloc_raw(s->scratch, t->vertex_count, sizeof *stack);
  if (!signs || !stack) return TW_NO_MEMORY;
  for (uint32_t first = 0; first < t->vertex_count; first++) {
    if (signs[first]) continue;
    uint32_t count = 0;
    bool alternates = true;
    signs[stack[count++] = first] = 1;
    while (count > 0) {
      uint32_t v = stack[--count];
      alternates &=
          t->ring_offsets[v + 1] - t->ring_offsets[v] == 3 && tw_vertex_rule_at(t, v, NULL) <= TW_RULE_DART;
      for (uint32_t i = t->ring_offsets[v]; i < t->ring_offsets[v + 1]; i++) {
        uint32_t next = tw_far_end(t, t->ring_edges[i], v);
        alternates &= signs[next] != signs[v];
        if (signs[next] == 0) signs[stack[count++] = next] = (int8_t)-signs[v];
      }
    }
    s->is_ambiguous |= alternates && !s->rules.loop;
  }
  return TW_OK;
}

/* ---- the mesh -------------------------------------------------------------------------------- */

/* Whether two faces of the mesh are alike in all that a parent has once. is_hole: [faces]. */
static bool is_alike(const tw_mesh *mesh, const uint8_t *is_hole, uint32_t a, uint32_t b) {
  return is_hole[a] == is_hole[b] &&
         (!mesh->face_materials || mesh->face_materials[a] == mesh->face_materials[b]) &&
         (!mesh->face_groups || mesh->face_groups[a] == mesh->face_groups[b]) &&
         (!mesh->face_smoothing || mesh->face_smoothing[a] == mesh->face_smoothing[b]);
}

/* Whether a parent's children are alike. The middle one of a triangle's lies across the edge of the first one
 * that joins the middles of the parent's edges. */
static bool has_one_face(const coarsening *s, const parents *p, const uint8_t *is_hole, uint32_t parent) {
  const tw_topology *t = &s->child.topology;
  const uint32_t *origins = p->faces.origins;
  uint32_t begin = p->faces.face_offsets[parent], first = origins[begin] / t->face_size;
  for (uint32_t c = begin + 1; c < p->faces.face_offsets[parent + 1]; c++)
    if (!is_alike(s->mesh, is_hole, first, origins[c] / t->face_size)) return false;
  return t->face_size == 4 ||
         is_alike(s->mesh, is_hole, first, t->sibling[tw_triangle_next(origins[begin])] / t->face_size);
}

static bool make_faces(coarsening *s, const parents *p, tw_mesh *out) {
  const tw_topology *t = &p->topology;
  uint32_t *first = tw_arena_alloc_raw(s->scratch, t->face_count, sizeof *first);
  uint8_t *is_hole = tw_arena_alloc(s->scratch, s->mesh->face_count, 1);
  uint32_t *holes = tw_arena_alloc_raw(s->arena, t->face_count, sizeof *holes);
  if (!first || !is_hole || !holes) return false;
  for (uint32_t i = 0; i < s->mesh->hole_count; i++) is_hole[s->mesh->holes[i]] = 1;
  for (uint32_t f = 0; f < t->face_count; f++) {
    first[f] = p->faces.origins[p->faces.face_offsets[f]] / s->child.topology.face_size;
    if (is_hole[first[f]]) holes[out->hole_count++] = f;
    s->parted += !has_one_face(s, p, is_hole, f);
  }
  out->holes = holes;
  return tw_mesh_take_faces(out, s->mesh, first, t->face_count, s->arena) == TW_OK;
}

/* Sharpness that is solved for is rounded: a step may then give a half that is off by so much. */
static const float SHARPNESS_ROUNDED = 1e-3f;

static bool is_as_sharp(float a, float b) {
  return tw_is_infinite(a) || tw_is_infinite(b) ? tw_is_infinite(a) == tw_is_infinite(b)
                                                : fabsf(a - b) <= SHARPNESS_ROUNDED;
}

/* Counts the child's tagged edges and points that refining the parents would not make as sharp: those that
 * lie inside the parents' faces or edges, and halves of an edge whose other half has another sharpness. */
static bool count_untagged(coarsening *s, const parents *p) {
  const tw_topology *t = &s->child.topology, *coarse = &p->topology;
  uint8_t *edges = tw_arena_alloc(s->scratch, t->edge_count, 1);
  uint8_t *points = tw_arena_alloc(s->scratch, t->vertex_count, 1);
  if (!edges || !points) return false;
  for (uint32_t e = 0; e < coarse->edge_count; e++) {
    uint32_t halves[2];
    halves_of(s, p, e, halves);
    for (int end = 0; end < 2; end++) {
      uint32_t vertex = coarse->edge_vertices[e][end];
      bool sums = coarse->semi_sum != NULL;
      float left = tw_decayed_edge(coarse->edge_sharpness[e], sums, sums ? coarse->semi_sum[vertex] : 0,
                                   sums ? coarse->semi_count[vertex] : 0);
      edges[halves[end]] = is_as_sharp(left, t->edge_sharpness[halves[end]]);
    }
  }
  for (uint32_t v = 0; v < coarse->vertex_count; v++) points[p->vertices[v]] = 1;
  for (uint32_t e = 0; e < t->edge_count; e++)
    s->untagged +=
        t->edge_sharpness[e] > 0 && !edges[e] && !(t->edge_flags[e] & (TW_EDGE_BORDER | TW_EDGE_NONMANIFOLD));
  for (uint32_t v = 0; v < t->vertex_count; v++)
    s->untagged += t->vertex_sharpness[v] > 0 && !points[v] && !(t->vertex_flags[v] & TW_VERTEX_NONMANIFOLD);
  return true;
}

static bool make_tags(coarsening *s, const parents *p, tw_mesh *out) {
  const tw_topology *t = &p->topology;
  if (!count_untagged(s, p)) return false;
  uint32_t *edges = tw_arena_alloc_raw(s->arena, t->edge_count, 2 * sizeof *edges);
  float *edge_sharpness = tw_arena_alloc_raw(s->arena, t->edge_count, sizeof *edge_sharpness);
  uint32_t *points = tw_arena_alloc_raw(s->arena, t->vertex_count, sizeof *points);
  float *point_sharpness = tw_arena_alloc_raw(s->arena, t->vertex_count, sizeof *point_sharpness);
  if (!edges || !edge_sharpness || !points || !point_sharpness) return false;
  for (uint32_t e = 0; e < t->edge_count; e++) {
    if (!(p->creases[e] > 0)) continue;
    memcpy(edges + 2 * (size_t)out->crease_count, t->edge_vertices[e], 2 * sizeof *edges);
    edge_sharpness[out->crease_count++] = p->creases[e];
  }
  for (uint32_t v = 0; v < t->vertex_count; v++) {
    float sharpness = before_decay(s->child.topology.vertex_sharpness[p->vertices[v]]);
    if (!(sharpness > 0) || (t->vertex_flags[v] & TW_VERTEX_NONMANIFOLD)) continue;
    points[out->sharp_point_count] = v;
    point_sharpness[out->sharp_point_count++] = sharpness;
  }
  out->crease_edges = edges;
  out->crease_sharpness = edge_sharpness;
  out->sharp_points = points;
  out->point_sharpness = point_sharpness;
  return true;
}

static tw_status make_channel(const coarsening *s, const parents *p, const tw_channel *from, tw_channel *to) {
  uint32_t *corners = tw_arena_alloc_raw(from->is_whole ? s->arena : s->scratch, p->faces.corner_count,
                                         sizeof *corners),
           *values_of;
  if (!corners) return TW_NO_MEMORY;
  for (uint32_t c = 0; c < p->faces.corner_count; c++) corners[c] = from->corners[p->faces.origins[c]];
  *to = *from;
  to->corners = corners;
  if (from->is_whole) return TW_OK;
  tw_topology t;
  tw_status status = tw_channel_topology(&p->topology, corners, s->options.uv, s->arena, &t, &values_of);
  if (status == TW_OK && s->rules.chaikin) status = tw_topology_copy_semi(&t, &p->topology, s->arena);
  if (status != TW_OK) return status;
  tw_rules rules = s->rules;
  rules.linear = s->options.uv == TW_UV_ALL;
  uint32_t several;
  uint32_t *values = gather(s, p, &t, from->corners, s->scratch, &several);
  if (!values) return TW_NO_MEMORY;
  to->value_count = t.vertex_count;
  to->corners = t.corner_vertex;
  return solve_floats(s, &rules, &t, values, from->values, from->width, &to->values);
}

static tw_status make_channels(const coarsening *s, const parents *p, tw_attribute *attributes,
                               tw_mesh *out) {
  tw_channel channels[TW_CHANNELS_MAX], made[TW_CHANNELS_MAX];
  uint32_t count = tw_mesh_channels(s->mesh, channels);
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < count && status == TW_OK; i++) status = make_channel(s, p, &channels[i], &made[i]);
  if (status == TW_OK) tw_mesh_set_channels(out, made, attributes);
  return status;
}

/* points: from solve_points; the points at the coarse vertices come first. */
static tw_status make_attributes(const coarsening *s, const parents *p, const uint32_t *points,
                                 tw_mesh *out) {
  const tw_topology *t = &p->topology;
  tw_attribute *attributes = tw_arena_alloc(s->arena, s->mesh->attribute_count, sizeof *attributes);
  const float **morphs = tw_arena_alloc(s->arena, s->mesh->morph_count, sizeof *morphs);
  tw_status status = attributes && morphs ? TW_OK : TW_NO_MEMORY;
  for (uint32_t a = 0; status == TW_OK && a < s->mesh->attribute_count; a++) {
    const tw_attribute *from = &s->mesh->attributes[a];
    attributes[a] = *from;
    if (from->corners) continue;
    if (from->numbers == TW_NUMBERS_REAL) {
      status = solve_floats(s, &s->rules, t, points, from->values, from->width, &attributes[a].values);
      continue;
    }
    attributes[a].values =
        tw_arena_gather(s->arena, from->values, points, t->vertex_count, from->width * sizeof *from->values);
    if (!attributes[a].values) status = TW_NO_MEMORY;
  }
  for (uint32_t m = 0; status == TW_OK && m < s->mesh->morph_count; m++)
    status = solve_floats(s, &s->rules, t, points, s->mesh->morphs[m], 3, &morphs[m]);
  if (status == TW_OK) status = make_channels(s, p, attributes, out);
  if (status != TW_OK) return status;
  out->morphs = morphs;
  const tw_skin_weights *skin = &s->mesh->skin;
  if (!skin->joints) return TW_OK;
  out->skin.joints =
      tw_arena_gather(s->arena, skin->joints, points, t->vertex_count, skin->width * sizeof(uint16_t));
  out->skin.weights =
      tw_arena_gather(s->arena, skin->weights, points, t->vertex_count, skin->width * sizeof(float));
  return out->skin.joints && out->skin.weights ? TW_OK : TW_NO_MEMORY;
}

/* Makes the mesh of the parents of all faces. *positions: [points][3], before they are rounded to float. */
static tw_status make_mesh(coarsening *s, tw_mesh *out, double **positions, double *error) {
  const tw_topology *t = &s->child.topology;
  for (uint32_t f = 0; f < t->face_count; f++) s->faces[f] = f;
  const tw_piece all = {t->face_count, s->faces};
  parents p;
  tw_status status = make_parents(s, &all, s->arena, &p);
  uint32_t *points;
  if (status == TW_OK) status = solve_points(s, &p, s->arena, positions, &points, error);
  if (status == TW_OK) status = find_ambiguity(s, &p.topology);
  if (status == TW_OK)
    status = tw_coarse_corners(&s->child.topology, &p.faces, s->corners, s->levels, s->arena, &s->corners);
  if (status != TW_OK) return status;
  float *rounded = tw_arena_alloc_raw(s->arena, p.topology.vertex_count, 3 * sizeof *rounded);
  if (!rounded) return TW_NO_MEMORY;
  for (size_t i = 0; i < 3 * (size_t)p.topology.vertex_count; i++) rounded[i] = (float)(*positions)[i];
  *out = *s->mesh;
  out->point_count = p.topology.vertex_count;
  out->welded_points = out->crease_count = out->sharp_point_count = out->hole_count = 0;
  out->positions = rounded;
  out->face_count = p.faces.face_count;
  out->corner_count = p.faces.corner_count;
  out->face_offsets = p.faces.face_offsets;
  out->corners = p.topology.corner_vertex;
  out->normals = (tw_corner_normals){0};
  out->morph_normals = NULL;
  out->detail_count = 0;
  out->details = NULL;
  if (!make_faces(s, &p, out) || !make_tags(s, &p, out)) return TW_NO_MEMORY;
  return make_attributes(s, &p, points, out);
}

/* ---- steps ----------------------------------------------------------------------------------- */

static tw_status take_step(coarsening *s, tw_mesh *out, double **positions, double *miss, tw_error *error) {
  /* Reads the mesh with only border edges sharpened, so that all other sharpness comes from tags. */
  tw_surface_options reading = {.boundary = TW_BOUNDARY_EDGE_ONLY, .creasing = s->options.creasing};
  tw_status status = tw_cage_read(s->mesh, &reading, s->scratch, &s->child);
  const tw_topology *t = &s->child.topology;
  if (status != TW_OK) return status;
  if (t->face_count == 0) return tw_fail(error, TW_INVALID, "the mesh has no faces");
  uint32_t size = s->rules.loop ? 3 : 4, other = 0;
  while (t->face_size == 0 && tw_face_size(t, other) == size) other++; /* faces differ in size */
  if (t->face_size != size) return fail_at(other, error);
  s->parts = tw_arena_alloc_raw(s->scratch, t->face_count, 1);
  s->faces = tw_arena_alloc_raw(s->scratch, t->face_count, sizeof *s->faces);
  s->seen = tw_arena_alloc(s->scratch, s->rules.loop ? t->face_count : t->vertex_count, 1);
  s->number_of = tw_arena_alloc_raw(s->scratch, t->vertex_count, sizeof *s->number_of);
  if (!s->parts || !s->faces || !s->seen || !s->number_of) return TW_NO_MEMORY;
  memset(s->parts, 0xFF, t->face_count);
  memset(s->number_of, 0xFF, t->vertex_count * sizeof *s->number_of);
  status = choose_all(s, error);
  if (status != TW_OK) return status;
  status = make_mesh(s, out, positions, miss);
  return status == TW_INVALID ? fail_at(s->misfit, error) : status;
}

/* Adds the difference between the mesh and the cage's surface to the cage, as a detail of the level that the
 * mesh is. */
static tw_status keep_rest(const tw_mesh *mesh, const uint32_t *corners, const tw_surface_options *options,
                           const tw_parallel_for *parallel, tw_arena *arena, tw_coarsened *out,
                           tw_error *error) {
  tw_surface_options level = *options;
  level.level = out->levels;
  tw_status status = tw_coarse_detail(mesh, corners, &level, parallel, arena, &out->mesh, error);
  if (status == TW_CANCELLED) return tw_fail(error, status, "the cage is not wanted any more");
  return status == TW_NO_MEMORY ? tw_fail(error, status, "out of memory") : status;
}

static double size_of(const tw_mesh *mesh) {
  double size = 0;
  for (int axis = 0; axis < 3; axis++) {
    float least = mesh->point_count ? mesh->positions[axis] : 0, most = least;
    for (size_t i = 0; i < mesh->point_count; i++) {
      least = fminf(least, mesh->positions[3 * i + (size_t)axis]);
      most = fmaxf(most, mesh->positions[3 * i + (size_t)axis]);
    }
    size = fmax(size, (double)most - (double)least);
  }
  return size;
}

tw_status tw_mesh_coarsen(const tw_mesh *mesh, const tw_surface_options *options,
                          const tw_parallel_for *parallel, tw_arena *arena, tw_coarsened *out,
                          tw_error *error) {
  if (options->scheme == TW_BILINEAR)
    return tw_fail(error, TW_INVALID, "scheme bilinear has no way back: its surfaces are their own cages");
  if (options->boundary == TW_BOUNDARY_NONE || options->boundary == TW_BOUNDARY_OPEN)
    return tw_fail(error, TW_INVALID,
                   "boundary none and open leave out faces, without which there is no way back");
  double *positions = tw_arena_alloc_raw(arena, mesh->point_count, 3 * sizeof *positions);
  if (!positions) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  for (size_t i = 0; i < 3 * (size_t)mesh->point_count; i++) positions[i] = mesh->positions[i];
  *out = (tw_coarsened){.mesh = *mesh, .size = size_of(mesh), .fits = true};
  const uint32_t *corners = NULL;
  while (out->levels < options->level) {
    double strays = 0;
    coarsening s = {.mesh = &out->mesh,
                    .positions = positions,
                    .options = *options,
                    .parallel = parallel,
                    .arena = arena,
                    .strays = &strays,
                    .levels = out->levels,
                    .corners = corners};
    s.rules = tw_rules_of(options);
    s.scratch = tw_arena_create();
    tw_mesh next;
    double miss;
    tw_status status = s.scratch ? take_step(&s, &next, &positions, &miss, error) : TW_NO_MEMORY;
    tw_arena_destroy(s.scratch);
    /* The mesh at hand is no refinement: it is the cage. */
    if (status == TW_INVALID && out->levels > 0) break;
    if (status == TW_NO_MEMORY) return tw_fail(error, status, "out of memory");
    if (status == TW_CANCELLED) return tw_fail(error, status, "the cage is not wanted any more");
    if (status == TW_LIMIT) return tw_fail(error, status, "the cage would be over what 32 bits number");
    if (status != TW_OK) return status;
    /* The first step is always taken. If all steps so far fit and this one would not, stop before it. If the
     * first step did not fit, go on: a detail will keep the difference. */
    bool fits = out->fits && out->error + miss <= FITS * out->size;
    if (out->levels > 0 && out->fits && !fits) break;
    out->fits = fits;
    out->mesh = next;
    out->levels++;
    corners = s.corners;
    out->error += miss;
    out->strays = fmax(out->strays, strays);
    out->is_ambiguous |= s.is_ambiguous;
    out->parted += s.parted;
    out->untagged += s.untagged;
  }
  tw_status status = tw_mesh_check(&out->mesh, error, NULL); /* solved points may be too far away */
  if (status != TW_OK || out->fits) return status;
  return keep_rest(mesh, corners, options, parallel, arena, out, error);
}
