/* Extrude and inset: both separate the selected faces from the others and put walls in the gap. They differ
 * in where the separated faces' points go.
 *
 * Corners of selected faces become one new point where edges between two selected faces connect them. A
 * vertex at which selected faces meet in two fans gets two new points, so that a manifold mesh stays
 * manifold. A vertex inside the selection remains a point. New points are in the order of the corners they
 * come from; walls come after all faces, in the order of their edges' corners. */
#include <math.h>
#include <string.h>

#include "editor.h"
#include "union_find.h"

/* The directions along each of which a point should move by 1: their weighted sum, and the sum of weights.
 * Once settled: the offset, and by how much that misses at most. */
typedef struct pull {
  double sum[3], total;
} pull;

/* Where a point goes whose faces the mean normal does not move by the distance. */
typedef struct aim {
  double spread[3][3]; /* the sum of weight * direction * direction^T */
  double rest[3];      /* the sum of weight * what the offset lacks * direction */
  double better[3];    /* the offset that comes nearest to moving each face by 1 */
  double miss;         /* by how much it moves a face too far, or not far enough, at most */
} aim;

/* Three corners of a face that span its plane. */
typedef struct face_frame {
  uint32_t face, origin, ends[2]; /* face: 1 + its index; 0: there is no frame yet */
  double sides[2][3];             /* from the origin to the ends */
} face_frame;

typedef struct parting {
  tw_editor *editor;
  const tw_topology *t;
  tw_change change;
  const uint8_t *selected;
  bool is_individual, is_inset;
  double (*normals)[3]; /* [face_count] set for selected faces */
  uint8_t *is_rim;      /* [edge_count] a selected face parts from its neighbour there, or has a border */
  uint32_t *fans;       /* [corner_count] union-find: the corners that become one point */
  uint32_t *fan_sizes;  /* [corner_count] at each set's root: its size */
  uint8_t *fan_is_rim;  /* [corner_count] at the root: whether a rim edge meets it */
  pull *pulls;          /* [corner_count] at the root: where its point goes */
  uint32_t *points;     /* [corner_count] at the root: its new point */
  bool is_settled;      /* the pulls are offsets */
  uint32_t wall_count, new_count;
  face_frame frame; /* of the face that was last asked for */
} parting;

/* Where directions diverge, a point moves at most this many times the distance. */
enum { REACH_MAX = 4 };

static bool is_selected(const parting *p, uint32_t corner) {
  return p->selected[tw_corner_face(p->t, corner)];
}

static uint32_t fan_of(parting *p, uint32_t corner) {
  return tw_union_find_root(p->fans, corner);
}

static void side_of(const tw_editor *e, const tw_topology *t, uint32_t corner, double out[3]) {
  tw_side3(tw_editor_point(e, t->corner_vertex[corner]),
           tw_editor_point(e, t->corner_vertex[tw_corner_next(t, corner)]), out);
}

/* The vectors from a corner to the next one and to the previous one. */
static void sides_of(const parting *p, uint32_t corner, double ahead[3], double back[3]) {
  side_of(p->editor, p->t, corner, ahead);
  side_of(p->editor, p->t, tw_corner_previous(p->t, corner), back);
  for (int i = 0; i < 3; i++) back[i] = -back[i];
}

static tw_status begin(parting *p) {
  tw_arena *arena = p->editor->scratch;
  uint32_t corners = p->t->corner_count;
  p->normals = tw_arena_alloc_raw(arena, p->t->face_count, sizeof *p->normals);
  p->is_rim = tw_arena_alloc(arena, p->t->edge_count, 1);
  p->fans = tw_arena_alloc_raw(arena, corners, sizeof *p->fans);
  p->fan_sizes = tw_arena_alloc(arena, corners, sizeof *p->fan_sizes);
  p->fan_is_rim = tw_arena_alloc(arena, corners, 1);
  p->pulls = tw_arena_alloc(arena, corners, sizeof *p->pulls);
  p->points = tw_arena_alloc_raw(arena, corners, sizeof *p->points);
  if (!p->normals || !p->is_rim || !p->fans || !p->fan_sizes || !p->fan_is_rim || !p->pulls || !p->points)
    return tw_editor_no_memory(p->editor);
  for (uint32_t f = 0; f < p->t->face_count; f++)
    if (p->selected[f]) tw_mesh_face_normal(&p->editor->mesh, f, p->normals[f]);
  return TW_OK;
}

/* ---- what hangs together --------------------------------------------------------------------- */

static void join_at_edge(parting *p, uint32_t edge) {
  const tw_topology *t = p->t;
  uint32_t first = t->edge_corner[edge], count = 0, selected = 0, corner = first;
  do {
    count++;
    selected += is_selected(p, corner);
    corner = t->sibling[corner];
  } while (corner != first);
  p->is_rim[edge] = selected > 0 && (p->is_individual || selected < count || count == 1);
  if (selected == 0 || p->is_rim[edge]) return;
  for (corner = t->sibling[first]; corner != first; corner = t->sibling[corner]) {
    bool is_along = t->corner_vertex[corner] == t->corner_vertex[first];
    uint32_t next = tw_corner_next(t, corner);
    tw_union_find_join(p->fans, first, is_along ? corner : next);
    tw_union_find_join(p->fans, tw_corner_next(t, first), is_along ? next : corner);
  }
}

static void find_fans(parting *p) {
  const tw_topology *t = p->t;
  tw_union_find_init(p->fans, t->corner_count);
  for (uint32_t e = 0; e < t->edge_count; e++) join_at_edge(p, e);
  for (uint32_t c = 0; c < t->corner_count; c++) {
    if (!is_selected(p, c)) continue;
    uint32_t fan = fan_of(p, c);
    bool is_wall = p->is_rim[t->corner_edge[c]];
    p->fan_sizes[fan]++;
    p->wall_count += is_wall;
    if (is_wall || p->is_rim[t->corner_edge[tw_corner_previous(t, c)]]) p->fan_is_rim[fan] = 1;
  }
}

/* Whether a fan keeps its vertex: it contains all the vertex's corners, and no rim. */
static bool keeps_point(const parting *p, uint32_t fan) {
  uint32_t vertex = p->t->corner_vertex[fan];
  return !p->fan_is_rim[fan] &&
         p->fan_sizes[fan] == p->t->fan_offsets[vertex + 1] - p->t->fan_offsets[vertex];
}

static bool is_new_fan(parting *p, uint32_t corner) {
  return is_selected(p, corner) && fan_of(p, corner) == corner && !keeps_point(p, corner);
}

/* ---- where points go ------------------------------------------------------------------------- */

/* A face without an area, and an edge without a length, have no direction and count for nothing. */
static void add_pull(pull *to, const double *direction, double weight) {
  if (tw_dot3(direction, direction) == 0) return;
  for (int i = 0; i < 3; i++) to->sum[i] += weight * direction[i];
  to->total += weight;
}

/* The angle of a face at a corner. */
static double angle_at(const parting *p, uint32_t corner) {
  double ahead[3], back[3];
  sides_of(p, corner, ahead, back);
  return tw_angle3(ahead, back);
}

/* The unit vector into the face, perpendicular to the edge after a corner; 0 0 0 where that edge has no
 * length. */
static void inward(const parting *p, uint32_t corner, double out[3]) {
  double side[3];
  side_of(p->editor, p->t, corner, side);
  tw_cross3(p->normals[tw_corner_face(p->t, corner)], side, out);
  tw_unit3(out);
}

static void add_pulls(parting *p, uint32_t corner) {
  pull *at = &p->pulls[fan_of(p, corner)];
  double direction[3];
  if (!p->is_inset) {
    add_pull(at, p->normals[tw_corner_face(p->t, corner)], angle_at(p, corner));
  } else if (p->is_rim[p->t->corner_edge[corner]]) {
    inward(p, corner, direction);
    add_pull(at, direction, 1);
    add_pull(&p->pulls[fan_of(p, tw_corner_next(p->t, corner))], direction, 1);
  }
}

/* Finds a vector whose mean component along the directions is 1: the unit mean, divided by its mean
 * component. For two directions in a plane, or a box's three normals, all components are 1. */
static void find_offset(const pull *from, double out[3]) {
  memcpy(out, from->sum, sizeof from->sum);
  double length = tw_unit3(out), along = from->total > 0 ? length / from->total : 0;
  double reach = along > 1.0 / REACH_MAX ? 1 / along : REACH_MAX;
  for (int i = 0; i < 3; i++) out[i] *= reach;
}

/* ---- faces of many planes -------------------------------------------------------------------- */

/* How far a corner's face is moved too far, or not far enough; 0 where it has no area. */
static double miss_at(const parting *p, uint32_t corner, const double *offset) {
  const double *normal = p->normals[tw_corner_face(p->t, corner)];
  return tw_dot3(normal, normal) > 0 ? 1 - tw_dot3(normal, offset) : 0;
}

static void add_aim(const parting *p, uint32_t corner, const double *offset, aim *to) {
  const double *normal = p->normals[tw_corner_face(p->t, corner)];
  double weight = angle_at(p, corner), lack = miss_at(p, corner, offset);
  for (int i = 0; i < 3; i++) {
    to->rest[i] += weight * lack * normal[i];
    for (int k = 0; k < 3; k++) to->spread[i][k] += weight * normal[i] * normal[k];
  }
}

/* Finds the vector whose components along the directions are nearest to 1, by least squares. Where the
 * directions do not span space, it differs from the offset within what they span only. */
static void find_better(const double *offset, aim *at) {
  double across[3][3], trace = 0;
  for (int i = 0; i < 3; i++) trace += at->spread[i][i];
  for (int i = 0; i < 3; i++) at->spread[i][i] += 1e-9 * trace;
  for (int i = 0; i < 3; i++) tw_cross3(at->spread[(i + 1) % 3], at->spread[(i + 2) % 3], across[i]);
  double determinant = tw_dot3(at->spread[0], across[0]);
  memcpy(at->better, offset, sizeof at->better);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3 && determinant > 0; k++) at->better[i] += at->rest[k] * across[k][i] / determinant;
}

/* Whether the better offset at least halves what the other one misses, and does not go far aside for it, as
 * it would where planes are nearly parallel to one line. */
static bool is_better(const pull *settled, const aim *at) {
  enum { SLIDE_MAX = 4 }; /* times what the offset misses */
  double by[3];
  tw_difference3(at->better, settled->sum, by);
  return at->miss <= settled->total / 2 && tw_length3(by) <= SLIDE_MAX * settled->total &&
         tw_length3(at->better) <= REACH_MAX;
}

/* Replaces settled offsets by better ones. aim_of: [corner_count] at the root: 1 + the index of its aim; 0:
 * the offset is good enough. */
static void improve(parting *p, const uint32_t *aim_of, aim *aims) {
  uint32_t corners = p->t->corner_count;
  for (uint32_t c = 0; c < corners; c++) {
    uint32_t fan = is_selected(p, c) ? fan_of(p, c) : c;
    if (aim_of[fan] > 0) add_aim(p, c, p->pulls[fan].sum, &aims[aim_of[fan] - 1]);
  }
  for (uint32_t c = 0; c < corners; c++)
    if (aim_of[c] > 0) find_better(p->pulls[c].sum, &aims[aim_of[c] - 1]);
  for (uint32_t c = 0; c < corners; c++) {
    uint32_t fan = is_selected(p, c) ? fan_of(p, c) : c;
    aim *at = aim_of[fan] > 0 ? &aims[aim_of[fan] - 1] : NULL;
    if (at) at->miss = fmax(at->miss, fabs(miss_at(p, c, at->better)));
  }
  for (uint32_t c = 0; c < corners; c++) {
    const aim *at = aim_of[c] > 0 ? &aims[aim_of[c] - 1] : NULL;
    if (at && is_better(&p->pulls[c], at)) memcpy(p->pulls[c].sum, at->better, sizeof at->better);
  }
}

/* Settles the offsets of an extrusion by a distance. Along the mean normal they are exact for planes at right
 * angles with equal shares, and for smooth surfaces hardly any is better; the others are improved.
 * TW_NO_MEMORY.
 */
static tw_status settle_offsets(parting *p) {
  static const double ENOUGH = 1e-3;
  uint32_t corners = p->t->corner_count, count = 0;
  uint32_t *aim_of = tw_arena_alloc(p->editor->scratch, corners, sizeof *aim_of);
  if (!aim_of) return tw_editor_no_memory(p->editor);
  for (uint32_t c = 0; c < corners; c++) {
    double offset[3];
    if (!is_selected(p, c) || fan_of(p, c) != c) continue;
    find_offset(&p->pulls[c], offset);
    memcpy(p->pulls[c].sum, offset, sizeof offset);
    p->pulls[c].total = 0;
  }
  for (uint32_t c = 0; c < corners; c++) {
    if (!is_selected(p, c)) continue;
    pull *settled = &p->pulls[fan_of(p, c)];
    settled->total = fmax(settled->total, fabs(miss_at(p, c, settled->sum)));
  }
  for (uint32_t c = 0; c < corners; c++)
    if (is_selected(p, c) && fan_of(p, c) == c && p->pulls[c].total > ENOUGH) aim_of[c] = ++count;
  aim *aims = tw_arena_alloc(p->editor->scratch, count, sizeof *aims);
  if (!aims) return tw_editor_no_memory(p->editor);
  if (count > 0) improve(p, aim_of, aims);
  p->is_settled = true;
  return TW_OK;
}

static void find_shift(const parting *p, uint32_t fan, double out[3]) {
  const tw_edit *edit = p->editor->edit;
  if (!p->is_inset && edit->extrude.has_by) {
    memcpy(out, edit->extrude.by, 3 * sizeof *out);
    return;
  }
  double distance = p->is_inset ? edit->inset.amount : edit->extrude.distance;
  if (p->is_settled)
    memcpy(out, p->pulls[fan].sum, sizeof p->pulls[fan].sum);
  else
    find_offset(&p->pulls[fan], out);
  for (int i = 0; i < 3; i++) out[i] *= distance;
}

/* ---- texture coordinates --------------------------------------------------------------------- */

/* Beyond this many side lengths a face's values mean nothing. */
#define EXTRAPOLATION_MAX 1e6

enum { TERMS_MAX = 6 }; /* of the mean of extrapolate_corner */

/* Finds the shares of two sides that sum up to a vector. least: of the square of the sine between the sides,
 * for which they span a plane. False where they do not, or the vector is too long. */
static bool find_shares(const double one[3], const double other[3], double least, const double *by,
                        double out[2]) {
  double aa = tw_dot3(one, one), bb = tw_dot3(other, other), ab = tw_dot3(one, other);
  double det = aa * bb - ab * ab, x = tw_dot3(by, one), y = tw_dot3(by, other);
  if (!(det > least * aa * bb)) return false;
  out[0] = (x * bb - y * ab) / det;
  out[1] = (y * aa - x * ab) / det;
  return fabs(out[0]) <= EXTRAPOLATION_MAX && fabs(out[1]) <= EXTRAPOLATION_MAX;
}

/* Finds the frame of a face: from its first corner to the farthest one, and to that which makes the largest
 * triangle with both. O(corners), once for all corners of the face. */
static const face_frame *find_frame(parting *p, uint32_t face) {
  face_frame *frame = &p->frame;
  if (frame->face == face + 1) return frame;
  uint32_t begin = tw_face_begin(p->t, face), size = tw_face_size(p->t, face);
  *frame = (face_frame){.face = face + 1, .origin = begin, .ends = {begin, begin}};
  for (int i = 0; i < 2; i++) {
    double most = 0, side[3], across[3];
    for (uint32_t c = begin + 1; c < begin + size; c++) {
      tw_side3(tw_editor_point(p->editor, p->t->corner_vertex[begin]),
               tw_editor_point(p->editor, p->t->corner_vertex[c]), side);
      tw_cross3(frame->sides[0], side, across);
      double square = i == 0 ? tw_dot3(side, side) : tw_dot3(across, across);
      if (!(square > most)) continue;
      most = square;
      frame->ends[i] = c;
      memcpy(frame->sides[i], side, sizeof side);
    }
  }
  return frame;
}

/* Mixes a face's corners so that the mean has the values of the face, extended as a plane, at the offset `by`
 * from a corner. first, last: the corners that distinguish such means at one point (tw_change_mix). Returns
 * the parent; the corner itself where the offset cannot be expressed. */
static uint32_t extrapolate_corner(parting *p, uint32_t corner, uint32_t first, uint32_t last,
                                   const double *by) {
  const tw_topology *t = p->t;
  double ahead[3], back[3], shares[2];
  tw_term terms[TERMS_MAX] = {{first, 0}};
  uint32_t count = first != corner;
  sides_of(p, corner, ahead, back);
  if (find_shares(ahead, back, 1e-4, by, shares)) {
    terms[count++] = (tw_term){corner, 1 - shares[0] - shares[1]};
    terms[count++] = (tw_term){tw_corner_next(t, corner), shares[0]};
    terms[count++] = (tw_term){tw_corner_previous(t, corner), shares[1]};
  } else { /* the corner is straight, or nearly */
    const face_frame *frame = find_frame(p, tw_corner_face(t, corner));
    if (!find_shares(frame->sides[0], frame->sides[1], 1e-12, by, shares)) return corner;
    terms[count++] = (tw_term){corner, 1};
    terms[count++] = (tw_term){frame->origin, -shares[0] - shares[1]};
    for (int i = 0; i < 2; i++) terms[count++] = (tw_term){frame->ends[i], shares[i]};
  }
  terms[count++] = (tw_term){last, 0};
  return t->corner_count + tw_change_mix(&p->change, terms, count);
}

/* The point parent with the same mean as a corner's parent. Always a mix, never the old point itself: the old
 * point's sharpness stays with the old point. */
static uint32_t extrapolate_point(parting *p, uint32_t corner, uint32_t parent) {
  const tw_topology *t = p->t;
  tw_term terms[TERMS_MAX] = {{corner, 1}};
  uint32_t count = 1;
  if (parent >= t->corner_count) {
    const tw_change *c = &p->change;
    uint32_t offset = c->mix_offsets[parent - t->corner_count];
    count = c->mix_offsets[parent - t->corner_count + 1] - offset;
    memcpy(terms, c->terms + offset, count * sizeof *terms);
  }
  for (uint32_t i = 0; i < count; i++) terms[i].index = t->corner_vertex[terms[i].index];
  return t->vertex_count + tw_change_mix(&p->change, terms, count);
}

/* ---- the change ------------------------------------------------------------------------------ */

static tw_status begin_change(parting *p) {
  const tw_topology *t = p->t;
  uint64_t mixes = 2 * (uint64_t)p->wall_count;
  for (uint32_t c = 0; c < t->corner_count; c++) {
    p->new_count += is_new_fan(p, c);
    mixes += 2 * (uint64_t)(p->is_inset && is_selected(p, c));
  }
  const tw_change_size size = {.points = (uint64_t)t->vertex_count + p->new_count,
                               .faces = (uint64_t)t->face_count + p->wall_count,
                               .corners = (uint64_t)t->corner_count + 4 * (uint64_t)p->wall_count,
                               .mixes = mixes,
                               .terms = TERMS_MAX * mixes};
  tw_status status = tw_change_init(&p->change, p->editor, &size);
  if (status != TW_OK) return status;
  p->change.shifts = tw_arena_alloc(p->editor->scratch, size.points, sizeof *p->change.shifts);
  return p->change.shifts ? TW_OK : tw_editor_no_memory(p->editor);
}

static tw_status aim_points(parting *p) {
  for (uint32_t c = 0; c < p->t->corner_count; c++)
    if (is_selected(p, c)) add_pulls(p, c);
  bool is_by_distance = !p->is_inset && !p->editor->edit->extrude.has_by;
  return is_by_distance ? settle_offsets(p) : TW_OK;
}

/* Adds the points of all fans. parents: [corner_count] receives the parents of the selected faces'
 * corners. */
static void put_points(parting *p, uint32_t *parents) {
  const tw_topology *t = p->t;
  double shift[3];
  tw_change_keep_points(&p->change);
  for (uint32_t c = 0; c < t->corner_count; c++) {
    if (!is_selected(p, c)) continue;
    uint32_t fan = fan_of(p, c);
    find_shift(p, fan, shift);
    bool is_still = !p->is_inset || keeps_point(p, fan);
    parents[c] = is_still ? c : extrapolate_corner(p, c, c, c, shift);
    if (fan != c) continue; /* a fan's root is its least corner, so it comes first */
    if (keeps_point(p, c)) {
      p->points[c] = t->corner_vertex[c];
      p->change.point_flags[p->points[c]] = TW_CHANGE_MADE;
    } else {
      uint32_t parent = p->is_inset ? extrapolate_point(p, c, parents[c]) : t->corner_vertex[c];
      p->points[c] = tw_change_point(&p->change, parent, TW_CHANGE_MADE);
    }
    memcpy(p->change.shifts[p->points[c]], shift, sizeof shift);
  }
}

/* The means already place inset points within the face's plane: subtracts that part, so that the shift is the
 * remainder. */
static void subtract_extrapolation(parting *p) {
  for (uint32_t point = p->t->vertex_count; p->is_inset && point < p->change.point_count; point++) {
    const tw_change *c = &p->change;
    uint32_t mix = c->point_parents[point] - p->t->vertex_count, first = c->mix_offsets[mix];
    const float *from = tw_editor_point(p->editor, c->terms[first].index);
    for (uint32_t i = first + 1; i < c->mix_offsets[mix + 1]; i++)
      for (int k = 0; k < 3; k++)
        c->shifts[point][k] -=
            c->terms[i].weight * ((double)tw_editor_point(p->editor, c->terms[i].index)[k] - (double)from[k]);
  }
}

static void put_face(parting *p, uint32_t face, const uint32_t *parents) {
  const tw_topology *t = p->t;
  for (uint32_t c = tw_face_begin(t, face); c < tw_face_begin(t, face) + tw_face_size(t, face); c++) {
    uint32_t edge = t->corner_edge[c];
    bool is_rim = p->is_rim[edge];
    tw_change_corner(&p->change, p->points[fan_of(p, c)], parents[c],
                     p->is_inset && is_rim ? UINT32_MAX : edge, is_rim ? TW_CHANGE_MADE : 0);
  }
  tw_change_face(&p->change, face, TW_CHANGE_MADE);
}

/* Adds the wall between an edge and the same edge of the moved face. An extruded face's walls have UVs as if
 * unfolded round the face; an inset rim's UVs are the face's. Where both faces at an edge have a wall there,
 * these are unfolded to opposite sides: the face's corners off the edge distinguish them. */
static void put_wall(parting *p, uint32_t corner, const uint32_t *parents) {
  const tw_topology *t = p->t;
  uint32_t next = tw_corner_next(t, corner), edge = t->corner_edge[corner], foot[2] = {corner, next};
  uint32_t top[2] = {p->points[fan_of(p, corner)], p->points[fan_of(p, next)]};
  for (int i = 0; i < 2 && !p->is_inset && p->editor->mesh.uv_set_count > 0; i++) {
    double out[3];
    inward(p, corner, out);
    double height = tw_length3(p->change.shifts[top[i]]);
    for (int k = 0; k < 3; k++) out[k] *= -height;
    uint32_t off = i == 0 ? tw_corner_previous(t, corner) : tw_corner_next(t, next);
    foot[i] = extrapolate_corner(p, foot[i], off, i == 0 ? next : corner, out);
  }
  tw_change_corner(&p->change, t->corner_vertex[corner], foot[0], edge, 0);
  tw_change_corner(&p->change, t->corner_vertex[next], foot[1], UINT32_MAX, 0);
  tw_change_corner(&p->change, top[1], parents[next], p->is_inset ? UINT32_MAX : edge, 0);
  tw_change_corner(&p->change, top[0], parents[corner], UINT32_MAX, 0);
  tw_change_face(&p->change, tw_corner_face(t, corner), TW_CHANGE_NEW);
}

static tw_status separate_faces(parting *p) {
  uint8_t *selected;
  tw_status status = tw_editor_select(p->editor, &selected);
  if (status != TW_OK || !selected) return status;
  p->selected = selected;
  p->t = p->editor->topology;
  uint32_t *parents = tw_arena_alloc_raw(p->editor->scratch, p->t->corner_count, sizeof *parents);
  if (!parents) return tw_editor_no_memory(p->editor);
  status = begin(p);
  if (status == TW_OK) find_fans(p);
  if (status == TW_OK) status = begin_change(p);
  if (status == TW_OK) status = aim_points(p);
  if (status != TW_OK) return status;
  put_points(p, parents);
  subtract_extrapolation(p);
  for (uint32_t f = 0; f < p->t->face_count; f++)
    if (p->selected[f])
      put_face(p, f, parents);
    else
      tw_change_keep_face(&p->change, f, NULL, 0);
  for (uint32_t c = 0; c < p->t->corner_count; c++)
    if (is_selected(p, c) && p->is_rim[p->t->corner_edge[c]]) put_wall(p, c, parents);
  return tw_editor_apply(p->editor, &p->change);
}

tw_status tw_edit_extrude(tw_editor *editor) {
  const tw_edit *edit = editor->edit;
  parting p = {.editor = editor, .is_individual = edit->extrude.is_individual};
  if (!edit->extrude.has_by && !isfinite(edit->extrude.distance))
    return tw_editor_fail(editor, TW_INVALID, "/distance", "the distance is not a finite number");
  return separate_faces(&p);
}

tw_status tw_edit_inset(tw_editor *editor) {
  const tw_edit *edit = editor->edit;
  parting p = {.editor = editor, .is_individual = edit->inset.is_individual, .is_inset = true};
  if (!isfinite(edit->inset.amount))
    return tw_editor_fail(editor, TW_INVALID, "/amount", "the amount is not a finite number");
  return separate_faces(&p);
}
