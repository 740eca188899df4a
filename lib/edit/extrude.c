/* Extrude and inset: faces part from the others, with walls in the gap. They differ in where the points of
 * the faces go.
 *
 * Corners of selected faces that edges between two of them join are one new point: a vertex at which such
 * faces meet in two fans gets two, so that what was manifold stays so. A vertex that is all inside stays a
 * point. New points are in the order of the corners that they come from, walls behind all faces in the order
 * of the edges' corners. */
#include <math.h>
#include <string.h>

#include "editor.h"
#include "union_find.h"

/* A point goes along the mean of directions that each want it moved by 1. */
typedef struct pull {
  double sum[3], total;
} pull;

typedef struct parting {
  tw_editor *editor;
  const tw_topology *t;
  tw_change change;
  const uint8_t *selected;
  bool is_individual, is_inset;
  double (*normals)[3]; /* [face_count] of the selected faces */
  uint8_t *is_rim;      /* [edge_count] some but not all of its faces are selected, or it is a border */
  uint32_t *fans;       /* [corner_count] sets of the corners that are one point */
  uint32_t *fan_sizes;  /* [corner_count] of a set's least corner */
  uint8_t *fan_is_rim;  /* the same: an edge of the rim is at it */
  pull *pulls;          /* the same */
  uint32_t *points;     /* the same: its point of the change */
  uint32_t wall_count, new_count;
} parting;

/* Limits how far a point goes where directions are far from each other. */
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

/* From a corner to the next one and to the one before. */
static void sides_of(const parting *p, uint32_t corner, double ahead[3], double back[3]) {
  side_of(p->editor, p->t, corner, ahead);
  side_of(p->editor, p->t, tw_corner_previous(p->t, corner), back);
  for (int i = 0; i < 3; i++) back[i] = -back[i];
}

static tw_status begin(parting *p) {
  tw_arena *arena = p->editor->arena;
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

/* ---- what hangs together ------------------------------------------------------------------------------- */

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

/* A fan all round a vertex keeps the vertex. */
static bool keeps_point(const parting *p, uint32_t fan) {
  uint32_t vertex = p->t->corner_vertex[fan];
  return !p->fan_is_rim[fan] &&
         p->fan_sizes[fan] == p->t->fan_offsets[vertex + 1] - p->t->fan_offsets[vertex];
}

static bool is_new_fan(parting *p, uint32_t corner) {
  return is_selected(p, corner) && fan_of(p, corner) == corner && !keeps_point(p, corner);
}

/* ---- where points go ----------------------------------------------------------------------------------- */

static void add_pull(pull *to, const double *direction, double weight) {
  for (int i = 0; i < 3; i++) to->sum[i] += weight * direction[i];
  to->total += weight;
}

/* The angle of a face at a corner. */
static double angle_at(const parting *p, uint32_t corner) {
  double ahead[3], back[3];
  sides_of(p, corner, ahead, back);
  return tw_angle3(ahead, back);
}

/* Into the face, square to the edge behind a corner; 0 0 0 where that has no length. */
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

/* The vector whose parts along all directions are 1 where there is one (two of them in a plane, three normals
 * of a box), else their mean is: the unit mean, longer by what its parts along them fall short of 1. */
static void settle(const pull *from, double out[3]) {
  memcpy(out, from->sum, sizeof from->sum);
  double length = tw_unit3(out), along = from->total > 0 ? length / from->total : 0;
  double reach = along > 1.0 / REACH_MAX ? 1 / along : REACH_MAX;
  for (int i = 0; i < 3; i++) out[i] *= reach;
}

static void find_shift(const parting *p, uint32_t fan, double out[3]) {
  const tw_edit *edit = p->editor->edit;
  if (!p->is_inset && edit->extrude.has_by) {
    memcpy(out, edit->extrude.by, 3 * sizeof *out);
    return;
  }
  double distance = p->is_inset ? edit->inset.amount : edit->extrude.distance;
  settle(&p->pulls[fan], out);
  for (int i = 0; i < 3; i++) out[i] *= distance;
}

/* ---- texture coordinates ------------------------------------------------------------------------------- */

/* Lengths of a face's sides over which its values still say something. */
#define SLIDE_MAX 1e6

/* The mean of a face's corners whose values are those of the face, taken as flat, at a place off one of its
 * corners. last: the corner that tells such means at one point apart. Returns the parent. */
static uint32_t slide(parting *p, uint32_t corner, uint32_t last, const double *by) {
  const tw_topology *t = p->t;
  double ahead[3], back[3];
  uint32_t next = tw_corner_next(t, corner), previous = tw_corner_previous(t, corner);
  sides_of(p, corner, ahead, back);
  double aa = tw_dot3(ahead, ahead), bb = tw_dot3(back, back), ab = tw_dot3(ahead, back);
  double det = aa * bb - ab * ab, x = tw_dot3(by, ahead), y = tw_dot3(by, back);
  if (!(det > 1e-4 * aa * bb)) return corner;
  double a = (x * bb - y * ab) / det, b = (y * aa - x * ab) / det;
  if (!(fabs(a) <= SLIDE_MAX && fabs(b) <= SLIDE_MAX)) return corner;
  tw_term terms[4] = {{corner, 1 - a - b}, {next, a}, {previous, b}, {last, 0}};
  return t->corner_count + tw_change_mix(&p->change, terms, 4);
}

/* A point of the same mean as a corner, as far as that is one; never the old point itself, whose sharpness
 * stays with it. */
static uint32_t slide_point(parting *p, uint32_t corner, uint32_t parent) {
  const tw_topology *t = p->t;
  tw_term terms[4] = {{corner, 1}};
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

/* ---- the change ---------------------------------------------------------------------------------------- */

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
                               .terms = 4 * mixes};
  tw_status status = tw_change_init(&p->change, p->editor, &size);
  if (status != TW_OK) return status;
  p->change.shifts = tw_arena_alloc(p->editor->arena, size.points, sizeof *p->change.shifts);
  return p->change.shifts ? TW_OK : tw_editor_no_memory(p->editor);
}

/* Points of all fans; parents: [corner_count] of the corners of selected faces. */
static void put_points(parting *p, uint32_t *parents) {
  const tw_topology *t = p->t;
  double shift[3];
  tw_change_keep_points(&p->change);
  for (uint32_t c = 0; c < t->corner_count; c++)
    if (is_selected(p, c)) add_pulls(p, c);
  for (uint32_t c = 0; c < t->corner_count; c++) {
    if (!is_selected(p, c)) continue;
    uint32_t fan = fan_of(p, c);
    find_shift(p, fan, shift);
    bool is_still = !p->is_inset || keeps_point(p, fan);
    parents[c] = is_still ? c : slide(p, c, c, shift);
    if (fan != c) continue; /* the least corner of a fan comes first */
    if (keeps_point(p, c)) {
      p->points[c] = t->corner_vertex[c];
      p->change.point_flags[p->points[c]] = TW_CHANGE_MADE;
    } else {
      uint32_t parent = p->is_inset ? slide_point(p, c, parents[c]) : t->corner_vertex[c];
      p->points[c] = tw_change_point(&p->change, parent, TW_CHANGE_MADE);
    }
    memcpy(p->change.shifts[p->points[c]], shift, sizeof shift);
  }
}

/* Of points that slide, means already are where they belong but for what leaves the face's plane. */
static void settle_shifts(parting *p) {
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

/* Between an edge and where the face has gone. Texture coordinates of an extruded face's walls are as if they
 * lay unfolded round it; those of a rim are the face's. */
static void put_wall(parting *p, uint32_t corner, const uint32_t *parents) {
  const tw_topology *t = p->t;
  uint32_t next = tw_corner_next(t, corner), edge = t->corner_edge[corner], foot[2] = {corner, next};
  uint32_t top[2] = {p->points[fan_of(p, corner)], p->points[fan_of(p, next)]};
  for (int i = 0; i < 2 && !p->is_inset && p->editor->mesh.uv_set_count > 0; i++) {
    double out[3];
    inward(p, corner, out);
    double height = tw_length3(p->change.shifts[top[i]]);
    for (int k = 0; k < 3; k++) out[k] *= -height;
    foot[i] = slide(p, foot[i], i == 0 ? next : corner, out);
  }
  tw_change_corner(&p->change, t->corner_vertex[corner], foot[0], edge, 0);
  tw_change_corner(&p->change, t->corner_vertex[next], foot[1], UINT32_MAX, 0);
  tw_change_corner(&p->change, top[1], parents[next], p->is_inset ? UINT32_MAX : edge, 0);
  tw_change_corner(&p->change, top[0], parents[corner], UINT32_MAX, 0);
  tw_change_face(&p->change, tw_corner_face(t, corner), TW_CHANGE_NEW);
}

static tw_status part(parting *p) {
  uint8_t *selected;
  tw_status status = tw_editor_select(p->editor, &selected);
  if (status != TW_OK || !selected) return status;
  p->selected = selected;
  p->t = p->editor->topology;
  uint32_t *parents = tw_arena_alloc_raw(p->editor->arena, p->t->corner_count, sizeof *parents);
  if (!parents) return tw_editor_no_memory(p->editor);
  status = begin(p);
  if (status == TW_OK) find_fans(p);
  if (status == TW_OK) status = begin_change(p);
  if (status != TW_OK) return status;
  put_points(p, parents);
  settle_shifts(p);
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
  return part(&p);
}

tw_status tw_edit_inset(tw_editor *editor) {
  const tw_edit *edit = editor->edit;
  parting p = {.editor = editor, .is_individual = edit->inset.is_individual, .is_inset = true};
  if (!isfinite(edit->inset.amount))
    return tw_editor_fail(editor, TW_INVALID, "/amount", "the amount is not a finite number");
  return part(&p);
}
