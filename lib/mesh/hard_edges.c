/* Finds the hard edges of a mesh. Only an edge of two faces that run along it in opposite directions can be
 * hard: borders and non-manifold edges are sharp already by the rules of subdivision. */
#include "hard_edges.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "angle.h"
#include "union_find.h"
#include "vector3.h"

typedef struct turn {
  double cosine, sine;
} turn;

/* Normals within half a degree are one normal: rounding to 8 bits, or to four digits of text, changes a
 * normal by less. */
static const turn half_degree = {0.99996192306417131, 0.0087265354983739347};

static turn turn_from_degrees(double degrees) {
  double radians = degrees * TW_RADIANS;
  return (turn){cos(radians), sin(radians)};
}

/* What the file says of a piece's edges. */
typedef enum piece_says {
  SAYS_NONE,   /* nothing: no normals and no smoothing groups */
  SAYS_FLAT,   /* all faces are flat-shaded, which says nothing about the shape: angles decide */
  SAYS_SMOOTHS /* some faces are shaded smoothly, so normals and smoothing groups decide */
} piece_says;

typedef struct finder {
  const tw_mesh *mesh;
  const tw_topology *t;
  float (*face_normals)[3]; /* [face_count], of length 1; 0 0 0 of a face without area */
  uint32_t *pieces;         /* [point_count] union-find: points joined by faces are one piece */
  uint8_t *says;            /* [point_count] a piece_says, read at a piece's root */
} finder;

static void finder_deinit(finder *f) {
  tw_free(f->face_normals);
  tw_free(f->pieces);
  tw_free(f->says);
}

/* ---- angles ---------------------------------------------------------------------------------- */

/* Whether the angle between two vectors exceeds `most`, tested as sin(angle - most) > 0, which does not hold
 * for opposite vectors where `most` is 0 degrees. False where one of the vectors is 0. */
static bool turns_by_more(const double *a, const double *b, turn most) {
  double across[3], along = tw_dot3(a, b);
  tw_cross3(a, b, across);
  double area = tw_length3(across);
  if (area == 0) return along < 0 && most.cosine > -1;
  return area * most.cosine - along * most.sine > 0;
}

/* Sums the normals of the triangles fanned from the first corner. This is Newell's normal, computed relative
 * to that corner so that large coordinates do not cancel. */
void tw_mesh_face_normal(const tw_mesh *mesh, uint32_t face, double out[3]) {
  uint32_t begin = mesh->face_offsets[face], end = mesh->face_offsets[face + 1];
  const float *first = mesh->positions + 3 * (size_t)mesh->corners[begin];
  double before[3] = {0}, side[3], part[3];
  out[0] = out[1] = out[2] = 0;
  for (uint32_t c = begin + 1; c < end; c++) {
    tw_side3(first, mesh->positions + 3 * (size_t)mesh->corners[c], side);
    tw_cross3(before, side, part);
    for (int i = 0; i < 3; i++) out[i] += part[i];
    memcpy(before, side, sizeof before);
  }
  tw_unit3(out);
}

static tw_status find_face_normals(finder *f) {
  f->face_normals = tw_alloc(f->mesh->face_count, sizeof *f->face_normals);
  if (!f->face_normals) return TW_NO_MEMORY;
  for (uint32_t face = 0; face < f->mesh->face_count; face++) {
    double normal[3];
    tw_mesh_face_normal(f->mesh, face, normal);
    for (int i = 0; i < 3; i++) f->face_normals[face][i] = (float)normal[i];
  }
  return TW_OK;
}

/* ---- normals of the file --------------------------------------------------------------------- */

/* False where the file gives no normal at this corner. */
static bool find_corner_normal(const tw_mesh *mesh, uint32_t corner, double out[3]) {
  if (!mesh->normals.corners) return false;
  const float *value = mesh->normals.values + 3 * (size_t)mesh->normals.corners[corner];
  for (int i = 0; i < 3; i++) out[i] = (double)value[i];
  return out[0] != 0 || out[1] != 0 || out[2] != 0;
}

/* What the file's normals at two corners say about the edge between them. */
typedef enum verdict { SAYS_NOTHING, SAYS_SMOOTH, SAYS_HARD } verdict;

static verdict compare_corners(const tw_mesh *mesh, uint32_t a, uint32_t b) {
  double p[3], q[3];
  if (!find_corner_normal(mesh, a, p) || !find_corner_normal(mesh, b, q)) return SAYS_NOTHING;
  return turns_by_more(p, q, half_degree) ? SAYS_HARD : SAYS_SMOOTH;
}

bool tw_corners_part(const tw_mesh *mesh, uint32_t a, uint32_t b) {
  return compare_corners(mesh, a, b) == SAYS_HARD;
}

static bool groups_part(const tw_mesh *mesh, uint32_t face, uint32_t other) {
  const uint32_t *groups = mesh->face_smoothing;
  return groups && (groups[face] != groups[other] || groups[face] == 0);
}

static bool normals_part(const finder *f, uint32_t edge) {
  const tw_topology *t = f->t;
  uint32_t corner = t->edge_corner[edge], twin = t->sibling[corner];
  verdict begin = compare_corners(f->mesh, corner, tw_corner_next(t, twin)),
          end = compare_corners(f->mesh, tw_corner_next(t, corner), twin);
  /* A crease may end inside a smooth face: one hard end is enough. */
  if (begin == SAYS_HARD || end == SAYS_HARD) return true;
  if (begin == SAYS_SMOOTH || end == SAYS_SMOOTH) return false;
  return groups_part(f->mesh, tw_corner_face(t, corner), tw_corner_face(t, twin));
}

/* Whether the file shades a face smoothly: its corner normals differ, or it has none and is in a smoothing
 * group. */
static bool is_shaded_smooth(const tw_mesh *mesh, uint32_t face) {
  uint32_t begin = mesh->face_offsets[face];
  verdict all = SAYS_NOTHING;
  for (uint32_t c = begin + 1; c < mesh->face_offsets[face + 1]; c++) {
    verdict one = compare_corners(mesh, begin, c);
    if (one == SAYS_HARD) return true;
    if (one == SAYS_SMOOTH) all = one;
  }
  const uint32_t *groups = mesh->face_smoothing;
  return all == SAYS_NOTHING && groups && groups[face] != 0 && groups[face] != UINT32_MAX;
}

static bool is_shaded_flat(const tw_mesh *mesh, uint32_t face) {
  double normal[3];
  if (mesh->angles_tell || (mesh->face_smoothing && mesh->face_smoothing[face] != UINT32_MAX)) return true;
  for (uint32_t c = mesh->face_offsets[face]; c < mesh->face_offsets[face + 1]; c++)
    if (find_corner_normal(mesh, c, normal)) return true;
  return false;
}

/* Finds the pieces, and what the file says of each. */
static tw_status find_pieces(finder *f) {
  const tw_mesh *mesh = f->mesh;
  f->pieces = tw_alloc(mesh->point_count, sizeof *f->pieces);
  f->says = tw_alloc_zero(mesh->point_count, 1);
  if (!f->pieces || !f->says) return TW_NO_MEMORY;
  tw_topology_find_pieces(f->t, f->pieces);
  for (uint32_t face = 0; face < mesh->face_count; face++) {
    uint32_t root = tw_union_find_root(f->pieces, mesh->corners[mesh->face_offsets[face]]);
    if (f->says[root] == SAYS_SMOOTHS) continue;
    if (is_shaded_smooth(mesh, face))
      f->says[root] = SAYS_SMOOTHS;
    else if (is_shaded_flat(mesh, face))
      f->says[root] = SAYS_FLAT;
  }
  return TW_OK;
}

static bool has_tags(const tw_mesh *mesh) {
  return mesh->crease_count > 0 || mesh->sharp_point_count > 0 || mesh->hole_count > 0 ||
         mesh->detail_count > 0 || mesh->tag_boundary != TW_TAG_UNSET || mesh->tag_uv != TW_TAG_UNSET ||
         mesh->tag_creasing != TW_TAG_UNSET || mesh->tag_triangles != TW_TAG_UNSET;
}

bool tw_mesh_tells_hard_edges(const tw_mesh *mesh) {
  return !has_tags(mesh) && (mesh->normals.corners || mesh->face_smoothing || mesh->angles_tell);
}

/* ---- edges ----------------------------------------------------------------------------------- */

/* Computes only what is_hard reads for these creases. */
static tw_status prepare(finder *f, tw_creases creases) {
  tw_status status = TW_OK;
  if (creases != TW_CREASES_NORMALS) status = find_face_normals(f);
  bool by_piece = creases == TW_CREASES_AUTO || creases == TW_CREASES_FILE;
  return by_piece && status == TW_OK ? find_pieces(f) : status;
}

static bool is_bent(const finder *f, uint32_t edge, turn most) {
  uint32_t corner = f->t->edge_corner[edge], twin = f->t->sibling[corner];
  const float *a = f->face_normals[tw_corner_face(f->t, corner)],
              *b = f->face_normals[tw_corner_face(f->t, twin)];
  return turns_by_more((double[]){(double)a[0], (double)a[1], (double)a[2]},
                       (double[]){(double)b[0], (double)b[1], (double)b[2]}, most);
}

static bool is_hard(const finder *f, uint32_t edge, tw_creases creases, turn most) {
  if (f->t->edge_flags[edge] != 0) return false;
  if (creases == TW_CREASES_AUTO || creases == TW_CREASES_FILE) {
    uint8_t says = f->says[tw_union_find_root(f->pieces, tw_edge_start(f->t, edge))];
    if (creases == TW_CREASES_FILE && says == SAYS_NONE) return false;
    creases = says == SAYS_SMOOTHS ? TW_CREASES_NORMALS : TW_CREASES_ANGLE;
  }
  return creases == TW_CREASES_NORMALS ? normals_part(f, edge) : is_bent(f, edge, most);
}

/* ---- a mesh with other creases --------------------------------------------------------------- */

/* Marks the hard edges that the file does not tag itself. is_found: [edge_count]. Returns how many are
 * marked. */
static uint32_t mark_hard(const finder *f, tw_creases creases, double degrees, uint8_t *is_found) {
  const tw_mesh *mesh = f->mesh;
  turn most = turn_from_degrees(creases == TW_CREASES_ANGLE ? degrees : TW_HARD_DEGREES);
  uint32_t count = 0;
  for (uint32_t edge = 0; edge < f->t->edge_count; edge++) is_found[edge] = is_hard(f, edge, creases, most);
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    const uint32_t *ends = mesh->crease_edges + 2 * (size_t)i;
    uint32_t edge = tw_topology_find_edge(f->t, ends[0], ends[1]);
    if (edge != UINT32_MAX) is_found[edge] = 0;
  }
  for (uint32_t edge = 0; edge < f->t->edge_count; edge++) count += is_found[edge];
  return count;
}

/* Writes the file's creases, then those found. */
static tw_status add_creases(const finder *f, const uint8_t *is_found, uint32_t count, float sharpness,
                             tw_arena *arena, tw_mesh *out) {
  const tw_mesh *mesh = f->mesh;
  size_t all = (size_t)mesh->crease_count + count;
  if (all > UINT32_MAX) return TW_NO_MEMORY;
  uint32_t *edges = tw_arena_alloc_raw(arena, all, 2 * sizeof *edges);
  float *sharp = tw_arena_alloc_raw(arena, all, sizeof *sharp);
  if (!edges || !sharp) return TW_NO_MEMORY;
  if (mesh->crease_count > 0) {
    memcpy(edges, mesh->crease_edges, (size_t)mesh->crease_count * 2 * sizeof *edges);
    memcpy(sharp, mesh->crease_sharpness, mesh->crease_count * sizeof *sharp);
  }
  size_t next = mesh->crease_count;
  for (uint32_t edge = 0; edge < f->t->edge_count; edge++) {
    if (!is_found[edge]) continue;
    edges[2 * next] = tw_edge_start(f->t, edge);
    edges[2 * next + 1] = tw_edge_stop(f->t, edge);
    sharp[next++] = sharpness;
  }
  out->crease_count = (uint32_t)all;
  out->crease_edges = edges;
  out->crease_sharpness = sharp;
  return TW_OK;
}

/* ---- corners --------------------------------------------------------------------------------- */

/* The sharp edges at a point: their number, and the first two. */
typedef struct sharp_edges {
  uint32_t count, edges[2];
} sharp_edges;

static void add_sharp(sharp_edges *at, uint32_t edge) {
  if (at->count < 2) at->edges[at->count] = edge;
  at->count++;
}

/* Lists the sharp edges of all points: those found, those that the file tags, and what is no edge of two
 * faces. out: [point_count], zeros. */
static void list_sharp(const finder *f, const uint8_t *is_found, sharp_edges *out) {
  const tw_mesh *mesh = f->mesh;
  for (uint32_t edge = 0; edge < f->t->edge_count; edge++) {
    if (!is_found[edge] && f->t->edge_flags[edge] == 0) continue;
    add_sharp(&out[tw_edge_start(f->t, edge)], edge);
    add_sharp(&out[tw_edge_stop(f->t, edge)], edge);
  }
  for (uint32_t i = 0; i < mesh->crease_count; i++) {
    const uint32_t *ends = mesh->crease_edges + 2 * (size_t)i;
    uint32_t edge = tw_topology_find_edge(f->t, ends[0], ends[1]);
    if (edge == UINT32_MAX || !(mesh->crease_sharpness[i] > 0)) continue;
    add_sharp(&out[ends[0]], edge);
    add_sharp(&out[ends[1]], edge);
  }
  /* The file's own corners stay as they are. */
  for (uint32_t i = 0; i < mesh->sharp_point_count; i++) out[mesh->sharp_points[i]].count = UINT32_MAX;
}

/* Whether the line along the two sharp edges of a point turns sharply there. */
static bool turns_sharply(const finder *f, uint32_t point, const sharp_edges *at) {
  double along[2][3];
  for (int i = 0; i < 2; i++) {
    uint32_t start = tw_edge_start(f->t, at->edges[i]), stop = tw_edge_stop(f->t, at->edges[i]);
    uint32_t other = start == point ? stop : start, ends[2] = {i ? point : other, i ? other : point};
    tw_side3(f->mesh->positions + 3 * (size_t)ends[0], f->mesh->positions + 3 * (size_t)ends[1], along[i]);
    tw_unit3(along[i]); /* tiny and huge edges alike */
  }
  return turns_by_more(along[0], along[1], turn_from_degrees(TW_HARD_DEGREES));
}

/* The sharpness of a point where the line of its two sharp edges turns sharply; else 0. */
static float corner_sharpness(const finder *f, const uint8_t *is_found, uint32_t point, const sharp_edges *at,
                              float sharpness, bool border_corners) {
  if (at->count != 2) return 0;
  uint32_t a = at->edges[0], b = at->edges[1];
  bool are_found = is_found[a] && is_found[b];
  bool are_borders = (f->t->edge_flags[a] & TW_EDGE_BORDER) && (f->t->edge_flags[b] & TW_EDGE_BORDER);
  /* A point of one face is a corner by the rule for borders. */
  if (are_borders)
    are_borders = border_corners &&
                  tw_corner_face(f->t, f->t->edge_corner[a]) != tw_corner_face(f->t, f->t->edge_corner[b]);
  if ((!are_found && !are_borders) || !turns_sharply(f, point, at)) return 0;
  return are_found ? sharpness : TW_SHARPNESS_INFINITE;
}

/* Adds corners to those of the file. of_point: [point_count] scratch. */
static tw_status add_corners(const finder *f, const uint8_t *is_found, float sharpness, bool border_corners,
                             const sharp_edges *sharp, float *of_point, tw_arena *arena, tw_mesh *out) {
  const tw_mesh *mesh = f->mesh;
  uint32_t count = 0;
  for (uint32_t p = 0; p < mesh->point_count; p++) {
    of_point[p] = corner_sharpness(f, is_found, p, &sharp[p], sharpness, border_corners);
    count += of_point[p] > 0;
  }
  if (count == 0) return TW_OK;
  size_t next = mesh->sharp_point_count, all = next + count;
  uint32_t *points = tw_arena_alloc_raw(arena, all, sizeof *points);
  float *values = tw_arena_alloc_raw(arena, all, sizeof *values);
  if (!points || !values) return TW_NO_MEMORY;
  if (next > 0) {
    memcpy(points, mesh->sharp_points, next * sizeof *points);
    memcpy(values, mesh->point_sharpness, next * sizeof *values);
  }
  for (uint32_t p = 0; p < mesh->point_count; p++) {
    if (!(of_point[p] > 0)) continue;
    points[next] = p;
    values[next++] = of_point[p];
  }
  out->sharp_point_count = (uint32_t)all;
  out->sharp_points = points;
  out->point_sharpness = values;
  return TW_OK;
}

static tw_status find_corners(const finder *f, const uint8_t *is_found, float sharpness, bool border_corners,
                              tw_arena *arena, tw_mesh *out) {
  sharp_edges *sharp = tw_alloc_zero(f->mesh->point_count, sizeof *sharp);
  float *of_point = tw_alloc(f->mesh->point_count, sizeof *of_point);
  tw_status status = TW_NO_MEMORY;
  if (sharp && of_point) {
    list_sharp(f, is_found, sharp);
    status = add_corners(f, is_found, sharpness, border_corners, sharp, of_point, arena, out);
  }
  tw_free(sharp);
  tw_free(of_point);
  return status;
}

/* ---- counts ---------------------------------------------------------------------------------- */

/* Counts what TW_CREASES_FILE finds in a mesh that tells hard edges. */
static tw_status count_by_file(const finder *f, tw_hard_edge_counts *out) {
  const turn most = turn_from_degrees(TW_HARD_DEGREES);
  uint32_t points = f->mesh->point_count;
  uint8_t *is_found = tw_alloc(f->t->edge_count, 1);
  sharp_edges *sharp = tw_alloc_zero(points, sizeof *sharp);
  bool has_memory = is_found && sharp;
  for (uint32_t edge = 0; has_memory && edge < f->t->edge_count; edge++)
    out->by_file += is_found[edge] = is_hard(f, edge, TW_CREASES_FILE, most);
  if (has_memory) list_sharp(f, is_found, sharp);
  for (uint32_t p = 0; has_memory && p < points; p++)
    out->corners_by_file += corner_sharpness(f, is_found, p, &sharp[p], 1, true) > 0;
  tw_free(is_found);
  tw_free(sharp);
  return has_memory ? TW_OK : TW_NO_MEMORY;
}

tw_status tw_hard_edges_count(const tw_mesh *mesh, const tw_topology *topology, tw_hard_edge_counts *out) {
  finder f = {.mesh = mesh, .t = topology};
  const turn thirty = turn_from_degrees(30), most = turn_from_degrees(TW_HARD_DEGREES);
  tw_status status = prepare(&f, TW_CREASES_AUTO);
  *out = (tw_hard_edge_counts){0};
  for (uint32_t edge = 0; edge < topology->edge_count && status == TW_OK; edge++) {
    out->by_normals += is_hard(&f, edge, TW_CREASES_NORMALS, most);
    out->by_30_degrees += is_hard(&f, edge, TW_CREASES_ANGLE, thirty);
    out->by_auto += is_hard(&f, edge, TW_CREASES_AUTO, most);
  }
  if (status == TW_OK && tw_mesh_tells_hard_edges(mesh)) status = count_by_file(&f, out);
  finder_deinit(&f);
  return status;
}

/* ---- both ------------------------------------------------------------------------------------ */

/* What is asked for. */
typedef struct asked {
  tw_creases creases;
  double degrees;
  float sharpness;
  bool border_corners;
} asked;

static tw_status find_and_add(const tw_mesh *mesh, const asked *how, tw_arena *scratch, tw_arena *arena,
                              tw_mesh *out) {
  tw_topology topology;
  tw_status status = tw_topology_pair(&topology, scratch, mesh->point_count, mesh->face_count,
                                      mesh->face_offsets, mesh->corner_count, mesh->corners);
  if (status != TW_OK) return status;
  finder f = {.mesh = mesh, .t = &topology};
  uint8_t *is_found = tw_arena_alloc(scratch, topology.edge_count, 1);
  status = is_found ? prepare(&f, how->creases) : TW_NO_MEMORY;
  if (status == TW_OK) {
    uint32_t count = mark_hard(&f, how->creases, how->degrees, is_found);
    status = count > 0 ? add_creases(&f, is_found, count, how->sharpness, arena, out) : TW_OK;
  }
  bool with_corners = how->creases == TW_CREASES_AUTO || how->creases == TW_CREASES_FILE;
  if (status == TW_OK && with_corners)
    status = find_corners(&f, is_found, how->sharpness, how->border_corners, arena, out);
  finder_deinit(&f);
  return status;
}

tw_status tw_mesh_with_creases(const tw_mesh *mesh, tw_creases creases, double degrees, float sharpness,
                               bool border_corners, tw_arena *arena, tw_mesh *out, tw_error *error) {
  const asked how = {creases, degrees, sharpness, border_corners};
  tw_mesh view = *mesh;
  tw_status status = TW_OK;
  if (creases == TW_CREASES_FILE && !tw_mesh_tells_hard_edges(mesh)) creases = TW_CREASES_TAGS;
  if (creases == TW_CREASES_NONE) {
    view.crease_count = view.sharp_point_count = 0;
  } else if (creases != TW_CREASES_TAGS) {
    tw_arena *scratch = tw_arena_create();
    status = scratch ? find_and_add(mesh, &how, scratch, arena, &view) : TW_NO_MEMORY;
    tw_arena_destroy(scratch);
  }
  if (status != TW_OK) return tw_fail(error, status, "out of memory");
  *out = view;
  return TW_OK;
}
