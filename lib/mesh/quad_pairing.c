/* Recovers quads from the triangles that an exporter split them into. Exporters write both halves of a quad
 * next to each other and split all quads alike. So a best path along the file's faces tells which neighbours
 * are halves, and how often one pattern occurs tells whether there were quads at all. Triangles left over are
 * paired by shape. */
#include "quad_pairing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "angle.h"
#include "hard_edges.h"
#include "vector3.h"

static const float *corner_position(const tw_mesh *mesh, uint32_t corner) {
  return mesh->positions + 3 * (size_t)mesh->corners[corner];
}

static uint32_t face_size(const tw_mesh *mesh, uint32_t face) {
  return mesh->face_offsets[face + 1] - mesh->face_offsets[face];
}

/* (b - a) x (c - a): twice the triangle's area as a vector. */
static void normal_of(const float *a, const float *b, const float *c, double out[3]) {
  double p[3], q[3];
  tw_side3(a, b, p);
  tw_side3(a, c, q);
  tw_cross3(p, q, out);
}

/* Two triangles that share an edge. */
typedef struct junction {
  uint32_t quad[4]; /* corners of the mesh: the shared edge's end, the first triangle's apex, the edge's
                       start, the other apex */
  uint8_t pattern;  /* 3 * the shared side's index in the first triangle + its index in the second */
} junction;

enum { PATTERNS = 9, NO_PATTERN = PATTERNS };

/* Whether two corners of a point have different texture coordinates or attributes. */
static bool values_part(const tw_mesh *mesh, uint32_t a, uint32_t b) {
  for (uint32_t set = 0; set < mesh->uv_set_count; set++)
    if (mesh->uv_sets[set].corners[a] != mesh->uv_sets[set].corners[b]) return true;
  for (uint32_t i = 0; i < mesh->attribute_count; i++) {
    const uint32_t *corners = mesh->attributes[i].corners;
    if (corners && corners[a] != corners[b]) return true;
  }
  return false;
}

/* Whether directions, or displacements of directions, differ by more than half a degree. */
static bool directions_part(const float *a, const float *b) {
  double p[3];
  tw_side3(a, b, p);
  return tw_dot3(p, p) > 7.6e-5; /* the square of the chord */
}

/* Whether two corners of a point have different tangents, or normals that a morph target displaces
 * differently. */
static bool shading_parts(const tw_mesh *mesh, uint32_t a, uint32_t b) {
  const tw_corner_normals *normals = &mesh->normals;
  if (!normals->corners || normals->corners[a] == normals->corners[b]) return false;
  size_t p = normals->corners[a], q = normals->corners[b];
  if (normals->tangents) {
    const float *one = normals->tangents + 4 * p, *other = normals->tangents + 4 * q;
    if (directions_part(one, other) || (one[3] < 0) != (other[3] < 0)) return true;
  }
  if (!mesh->morph_normals) return false;
  tw_work(mesh->morph_count);
  for (uint32_t m = 0; m < mesh->morph_count; m++)
    if (directions_part(mesh->morph_normals[m] + 3 * p, mesh->morph_normals[m] + 3 * q)) return true;
  return false;
}

/* False when the triangles share no whole edge, or the edge has to stay: it parts materials, UVs, attributes
 * or shading. */
static bool find_junction(const tw_mesh *mesh, uint32_t face, uint32_t other, junction *out) {
  if (face_size(mesh, face) != 3 || face_size(mesh, other) != 3) return false;
  if (mesh->face_materials && mesh->face_materials[face] != mesh->face_materials[other]) return false;
  uint32_t first = mesh->face_offsets[face], second = mesh->face_offsets[other];
  for (uint32_t i = 0; i < 3; i++)
    for (uint32_t j = 0; j < 3; j++) {
      uint32_t a = first + i, b = first + (i + 1) % 3, c = second + j, d = second + (j + 1) % 3;
      if (mesh->corners[a] != mesh->corners[d] || mesh->corners[b] != mesh->corners[c]) continue;
      if (values_part(mesh, a, d) || values_part(mesh, b, c)) return false;
      if (tw_corners_part(mesh, a, d) || tw_corners_part(mesh, b, c)) return false;
      if (shading_parts(mesh, a, d) || shading_parts(mesh, b, c)) return false;
      uint32_t apex = second + (j + 2) % 3;
      if (mesh->corners[apex] == mesh->corners[first + (i + 2) % 3]) return false;
      *out = (junction){{b, first + (i + 2) % 3, a, apex}, (uint8_t)(3 * i + j)};
      return true;
    }
  return false;
}

/* The shape of the quad that joining two triangles gives. */
typedef struct shape {
  double flatness;  /* cosine of the angle between the halves' normals, 0 where a half has no area */
  double quality;   /* 0 for a quad that is not convex, not cut back or bent by more than 60 degrees, up to 1
                       for a rectangle */
  bool is_cut_back; /* cut by its shape, the quad gives the same halves */
  bool is_split;    /* the shared edge is the longest of both halves, as a rectangle's diagonal is */
} shape;

/* Whether a quad is the fan whose halves have these normals, as tw_ear_clipper_is_fan sees it: along the axis
 * in which their sum is longest. */
static bool is_fan(const double one[3], const double other[3]) {
  double sum[3];
  int axis = 0;
  for (int i = 0; i < 3; i++) sum[i] = one[i] + other[i];
  for (int i = 1; i < 3; i++)
    if (fabs(sum[i]) > fabs(sum[axis])) axis = i;
  double sign = sum[axis] < 0 ? -1 : 1, least = -1e-6 * fabs(sum[axis]);
  return sign * one[axis] >= least && sign * other[axis] >= least;
}

static shape find_shape(const tw_mesh *mesh, const uint32_t quad[4]) {
  const float *p[4];
  double turns[4][3], sum[3] = {0, 0, 0}, sides[4], along[3], quality = 1;
  shape out = {0};
  for (int i = 0; i < 4; i++) p[i] = corner_position(mesh, quad[i]);
  for (int i = 0; i < 4; i++) {
    const float *after = p[(i + 1) % 4];
    normal_of(p[i], after, p[(i + 3) % 4], turns[i]);
    tw_side3(p[i], after, along);
    sides[i] = tw_dot3(along, along);
    for (int k = 0; k < 3; k++) sum[k] += turns[i][k];
  }
  tw_side3(p[0], p[2], along);
  double diagonal = tw_dot3(along, along);
  double longest = fmax(fmax(sides[0], sides[1]), fmax(sides[2], sides[3]));
  /* The halves lie at corners 1 and 3: the shared edge joins 0 and 2. */
  double areas = sqrt(tw_dot3(turns[1], turns[1]) * tw_dot3(turns[3], turns[3]));
  out.flatness = areas > 0 ? tw_dot3(turns[1], turns[3]) / areas : 0;
  out.is_cut_back = is_fan(turns[1], turns[3]);
  if (out.flatness < 0.5 || !out.is_cut_back) return out;
  for (int i = 0; i < 4; i++) {
    double turn = tw_dot3(turns[i], sum) /
                  sqrt(tw_dot3(sum, sum) * sides[i] * sides[(i + 3) % 4]); /* sine of the angle */
    if (!(turn > 0.02)) return out;
    quality = fmin(quality, turn);
  }
  out.quality = quality * out.flatness;
  /* The diagonal counts as longest by a margin of 2 %, so that equilateral triangles do not pair. A rectangle
   * of over 5 to 1 misses the margin too; its right angles identify it. */
  out.is_split = diagonal > 1.04 * longest || (diagonal > longest && out.quality > 0.9);
  return out;
}

double tw_pair_quality(const tw_mesh *mesh, uint32_t face, uint32_t other, uint32_t quad[4]) {
  junction j;
  if (!find_junction(mesh, face, other, &j)) return 0;
  memcpy(quad, j.quad, sizeof j.quad);
  return find_shape(mesh, j.quad).quality;
}

/* ---- neighbours in the file ------------------------------------------------------------------- */

/* The pairs chosen so far, and the working data of the choice. */
typedef struct pairing {
  const tw_mesh *mesh;
  uint32_t *partner; /* [face_count] the face that each is paired with, or UINT32_MAX */
  uint8_t *pattern;  /* [face_count] of each face's junction with the next face, or NO_PATTERN */
  double *best;      /* [face_count + 1] best sum of worths over the first so many faces */
  uint8_t usual[2];  /* the exporter's patterns; NO_PATTERN where there is no second */
  double flatness;   /* a pair is flatter */
} pairing;

/* Exporters split all their quads alike, so the exporter's pattern is the one that most pairs have whose
 * shape is a split rectangle. False where such pairs are too few: the model was made of triangles. */
static bool find_usual(pairing *p) {
  enum { A, B, C }; /* sides of a triangle */
  enum { STEPS = 32 };
  uint32_t counts[PATTERNS] = {0}, last[PATTERNS], triangles = 0, best = 0;
  memset(last, 0xFF, sizeof last);
  for (uint32_t f = 0; f < p->mesh->face_count; f++) {
    junction j;
    if (!tw_work(STEPS)) return false;
    p->pattern[f] = NO_PATTERN;
    triangles += face_size(p->mesh, f) == 3;
    if (f + 1 == p->mesh->face_count || !find_junction(p->mesh, f, f + 1, &j)) continue;
    p->pattern[f] = j.pattern;
    shape s = find_shape(p->mesh, j.quad);
    if (s.quality == 0 || !s.is_split || last[j.pattern] == f) continue;
    counts[j.pattern]++;
    last[j.pattern] = f + 1; /* in use: the next pair of this pattern cannot start with it */
  }
  for (uint32_t i = 1; i < PATTERNS; i++)
    if (counts[i] > counts[best]) best = i;
  p->usual[0] = (uint8_t)best;
  /* An exporter that splits quads a b c d into a b c and a c d splits those that are concave there into a b d
   * and b c d. */
  p->usual[1] = best == 3 * C + A ? 3 * B + C : NO_PATTERN;
  return counts[best] > 0 && 16 * (uint64_t)counts[best] >= triangles;
}

/* Whether neither neighbouring pair has the pattern of faces f and f + 1: a longer run of one pattern is a
 * fan round a point. */
static bool is_alone(const pairing *p, uint32_t f) {
  uint8_t pattern = p->pattern[f];
  return (f == 0 || p->pattern[f - 1] != pattern) && p->pattern[f + 1] != pattern;
}

/* The worth of joining faces f and f + 1; 0 when they cannot be joined. The exporter's pattern is worth more
 * than any shape: such a pair may be concave, and bent by up to 120 degrees, where level 0 still shows the
 * file's triangles. */
static double pair_worth(const pairing *p, uint32_t f) {
  junction j;
  if (p->pattern[f] == NO_PATTERN || !find_junction(p->mesh, f, f + 1, &j)) return 0;
  bool is_usual = j.pattern == p->usual[0] || j.pattern == p->usual[1];
  shape s = find_shape(p->mesh, j.quad);
  if (s.flatness <= p->flatness || !s.is_cut_back) return 0;
  if (is_usual && s.flatness != 0 && is_alone(p, f)) return 2 + s.quality;
  return s.quality > 0 && s.is_split ? s.quality + (is_usual ? 2 : 1) : 0;
}

/* Chooses, of all ways to pair neighbours, the one with the largest sum of worths, by dynamic programming.
 * Forward, partner[f] records whether the best way through the first f + 2 faces ends with the pair f, f + 1;
 * backward, only the pairs on the best way through all faces stay. */
static void pair_neighbours(pairing *p) {
  enum { STEPS = 32 };
  p->best[0] = 0;
  for (uint32_t end = 1; end <= p->mesh->face_count; end++) {
    p->best[end] = p->best[end - 1];
    p->partner[end - 1] = UINT32_MAX;
    double worth = end > 1 && tw_work(STEPS) ? pair_worth(p, end - 2) : 0;
    if (worth == 0 || p->best[end - 2] + worth <= p->best[end]) continue;
    p->best[end] = p->best[end - 2] + worth;
    p->partner[end - 2] = end - 1;
  }
  for (uint32_t end = p->mesh->face_count; end > 0;) {
    bool is_pair = end > 1 && p->partner[end - 2] == end - 1;
    p->partner[end - 1] = is_pair ? end - 2 : UINT32_MAX;
    end -= is_pair ? 2 : 1;
  }
}

/* ---- what is left ----------------------------------------------------------------------------- */

/* An edge of a triangle without a partner. */
typedef struct free_edge {
  uint32_t low, high, face;
} free_edge;

static int compare_edges(const void *left, const void *right) {
  const free_edge *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  if (a->high != b->high) return a->high < b->high ? -1 : 1;
  return a->face < b->face ? -1 : a->face > b->face;
}

/* Two triangles that may become a pair. */
typedef struct candidate {
  uint32_t face, other;
  float quality;
} candidate;

static int compare_candidates(const void *left, const void *right) {
  const candidate *a = left, *b = right;
  if (a->quality != b->quality) return a->quality > b->quality ? -1 : 1;
  if (a->face != b->face) return a->face < b->face ? -1 : 1;
  return a->other < b->other ? -1 : a->other > b->other;
}

static tw_status collect_edges(const pairing *p, free_edge *edges, uint32_t *count) {
  const tw_mesh *mesh = p->mesh;
  for (uint32_t f = 0; f < mesh->face_count; f++)
    for (uint32_t i = 0; i < 3 && face_size(mesh, f) == 3 && p->partner[f] == UINT32_MAX; i++) {
      const uint32_t *corners = mesh->corners + mesh->face_offsets[f];
      uint32_t a = corners[i], b = corners[(i + 1) % 3];
      edges[(*count)++] = a < b ? (free_edge){a, b, f} : (free_edge){b, a, f};
    }
  return tw_sort(edges, *count, sizeof *edges, compare_edges);
}

/* If more than one face in LEFT_AT_MOST is an unpaired triangle, these were not halves of quads. */
enum { LEFT_AT_MOST = 4 };

/* Pairs left-over triangles that look like a split rectangle, the best first. */
static tw_status pair_others(pairing *p) {
  enum { LEAST = 2 }; /* least quality: 1 / LEAST */
  uint32_t free_count = 0, edge_count = 0, count = 0;
  for (uint32_t f = 0; f < p->mesh->face_count; f++)
    free_count += p->partner[f] == UINT32_MAX && face_size(p->mesh, f) == 3;
  if (free_count > p->mesh->face_count / LEFT_AT_MOST) return TW_OK;
  free_edge *edges = tw_alloc(free_count, 3 * sizeof *edges);
  candidate *candidates = tw_alloc(free_count, 3 * sizeof *candidates);
  tw_status status = edges && candidates ? collect_edges(p, edges, &edge_count) : TW_NO_MEMORY;
  for (uint32_t i = 1; i < edge_count && status == TW_OK; i++) {
    const free_edge *a = &edges[i - 1], *b = &edges[i];
    junction j;
    if (a->low != b->low || a->high != b->high || !find_junction(p->mesh, a->face, b->face, &j)) continue;
    shape s = find_shape(p->mesh, j.quad);
    if (s.is_split && LEAST * s.quality > 1)
      candidates[count++] = (candidate){a->face, b->face, (float)s.quality};
  }
  if (status == TW_OK) status = tw_sort(candidates, count, sizeof *candidates, compare_candidates);
  for (uint32_t i = 0; i < count && status == TW_OK; i++) {
    const candidate *c = &candidates[i];
    if (p->partner[c->face] != UINT32_MAX || p->partner[c->other] != UINT32_MAX) continue;
    p->partner[c->face] = c->other;
    p->partner[c->other] = c->face;
  }
  tw_free(edges);
  tw_free(candidates);
  return status;
}

/* Where angles alone tell hard edges, a pair has none. */
static double least_flatness(const tw_mesh *mesh) {
  return mesh->angles_tell ? cos(TW_HARD_DEGREES * TW_RADIANS) : -0.5;
}

/* *count: the number of pairs chosen. */
static tw_status choose_pairs(pairing *p, uint32_t *count) {
  p->flatness = least_flatness(p->mesh);
  size_t faces = p->mesh->face_count;
  p->partner = tw_alloc(faces, sizeof *p->partner);
  p->pattern = tw_alloc(faces, sizeof *p->pattern);
  p->best = tw_alloc(faces + 1, sizeof *p->best);
  *count = 0;
  if (!p->partner || !p->pattern || !p->best) return TW_NO_MEMORY;
  if (!find_usual(p)) return tw_work_status(NULL);
  pair_neighbours(p);
  tw_status status = pair_others(p);
  if (status == TW_OK) status = tw_work_status(NULL);
  for (uint32_t f = 0; f < faces; f++) *count += p->partner[f] != UINT32_MAX && p->partner[f] > f;
  return status;
}

static void pairing_deinit(pairing *p) {
  tw_free(p->partner);
  tw_free(p->pattern);
  tw_free(p->best);
}

/* ---- joining ---------------------------------------------------------------------------------- */

/* The faces after joining; each array has exactly the room that they need. */
typedef struct joined_faces {
  uint32_t face_count, corner_count;
  uint32_t *offsets, *corners, *normals, *values[TW_CHANNELS_MAX];
  int32_t *materials;
  uint32_t channel_count;
  tw_channel channels[TW_CHANNELS_MAX]; /* of the mesh */
} joined_faces;

static void add_corner(const tw_mesh *mesh, joined_faces *out, uint32_t corner) {
  for (uint32_t i = 0; i < out->channel_count; i++)
    out->values[i][out->corner_count] = out->channels[i].corners[corner];
  if (mesh->normals.corners) out->normals[out->corner_count] = mesh->normals.corners[corner];
  out->corners[out->corner_count++] = mesh->corners[corner];
}

/* A quad takes the place of the first of its halves. */
static void write_faces(const pairing *p, joined_faces *out) {
  const tw_mesh *mesh = p->mesh;
  for (uint32_t face = 0; face < mesh->face_count; face++) {
    junction j;
    bool is_half = p->partner[face] != UINT32_MAX;
    if (is_half && p->partner[face] < face) continue;
    if (mesh->face_materials) out->materials[out->face_count] = mesh->face_materials[face];
    if (is_half && find_junction(mesh, face, p->partner[face], &j)) {
      for (int i = 0; i < 4; i++) add_corner(mesh, out, j.quad[i]);
    } else {
      for (uint32_t c = mesh->face_offsets[face]; c < mesh->face_offsets[face + 1]; c++)
        add_corner(mesh, out, c);
    }
    out->offsets[++out->face_count] = out->corner_count;
  }
}

static tw_status reserve_faces(const tw_mesh *mesh, tw_arena *arena, uint32_t pair_count, joined_faces *out,
                               tw_error *error) {
  size_t faces = mesh->face_count - pair_count, corners = mesh->corner_count - 2 * (size_t)pair_count;
  bool enough = true;
  out->offsets = tw_arena_alloc(arena, faces + 1, sizeof *out->offsets);
  out->corners = tw_arena_alloc(arena, corners, sizeof *out->corners);
  out->channel_count = tw_mesh_channels(mesh, out->channels);
  for (uint32_t i = 0; i < out->channel_count; i++) {
    out->values[i] = tw_arena_alloc(arena, corners, sizeof *out->values[i]);
    enough &= out->values[i] != NULL;
  }
  out->normals = tw_arena_alloc(arena, mesh->normals.corners ? corners : 0, sizeof *out->normals);
  out->materials = tw_arena_alloc(arena, mesh->face_materials ? faces : 0, sizeof *out->materials);
  enough &= out->offsets && out->corners && out->normals && out->materials;
  return enough ? TW_OK : tw_fail(error, TW_NO_MEMORY, "out of memory");
}

static tw_status join_pairs(tw_mesh *mesh, const pairing *p, uint32_t pair_count, tw_arena *arena,
                            tw_error *error) {
  joined_faces out = {0};
  tw_status status = reserve_faces(mesh, arena, pair_count, &out, error);
  tw_attribute *attributes = tw_arena_alloc(arena, mesh->attribute_count, sizeof *attributes);
  if (status == TW_OK && !attributes) status = tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status != TW_OK) return status;
  if (mesh->attribute_count > 0)
    memcpy(attributes, mesh->attributes, mesh->attribute_count * sizeof *attributes);
  write_faces(p, &out);
  mesh->joined_quads = pair_count;
  mesh->face_count = out.face_count;
  mesh->corner_count = out.corner_count;
  mesh->face_offsets = out.offsets;
  mesh->corners = out.corners;
  for (uint32_t i = 0; i < out.channel_count; i++) out.channels[i].corners = out.values[i];
  tw_mesh_set_channels(mesh, out.channels, attributes);
  if (mesh->normals.corners) mesh->normals.corners = out.normals;
  if (mesh->face_materials) mesh->face_materials = out.materials;
  return TW_OK;
}

tw_status tw_pair_triangles(tw_mesh *mesh, tw_arena *arena, tw_error *error) {
  pairing p = {.mesh = mesh};
  uint32_t count;
  tw_status status = choose_pairs(&p, &count);
  if (status != TW_OK) tw_fail(error, status, "out of memory");
  if (status == TW_OK && count > 0) status = join_pairs(mesh, &p, count, arena, error);
  pairing_deinit(&p);
  return status;
}

size_t tw_pair_size(const tw_mesh *mesh) {
  size_t faces = mesh->face_count, corners = mesh->corner_count;
  size_t choosing =
      sizeof(double) + sizeof(uint32_t) + 1 + 3 * (sizeof(free_edge) + sizeof(candidate)) / LEFT_AT_MOST;
  tw_channel channels[TW_CHANNELS_MAX];
  size_t sets = 1 + tw_mesh_channels(mesh, channels) + (mesh->normals.corners ? 1 : 0);
  return faces * (choosing + 2 * sizeof(uint32_t)) + corners * sets * sizeof(uint32_t) +
         mesh->attribute_count * sizeof(tw_attribute) + 256;
}
