/* Flip and orient: reverse the winding of faces. */
#include <string.h>

#include "editor.h"

/* Reverses the flagged faces; each keeps its first corner. */
static tw_status turn(tw_editor *e, const uint8_t *is_turned, const uint8_t *selected) {
  const tw_topology *t = e->topology;
  const tw_change_size size = {.points = t->vertex_count, .faces = t->face_count, .corners = t->corner_count};
  tw_change change;
  tw_status status = tw_change_init(&change, e, &size);
  if (status != TW_OK) return status;
  tw_change_keep_points(&change);
  for (uint32_t f = 0; f < t->face_count; f++) {
    uint8_t made = selected[f] ? TW_CHANGE_MADE : 0;
    if (is_turned[f])
      tw_change_turn_face(&change, f, NULL, made);
    else
      tw_change_keep_face(&change, f, NULL, made);
  }
  return tw_editor_apply(e, &change);
}

tw_status tw_edit_flip(tw_editor *editor) {
  uint8_t *selected;
  tw_status status = tw_editor_select(editor, &selected);
  return status != TW_OK || !selected ? status : turn(editor, selected, selected);
}

/* ---- orient ---------------------------------------------------------------------------------- */

/* Faces connected across edges of two faces. */
typedef struct piece {
  uint32_t begin, end; /* its range of the queue */
  bool is_closed;
} piece;

typedef struct orienter {
  const tw_editor *editor;
  const tw_topology *t;
  const uint8_t *selected;
  uint8_t *is_reached, *is_turned; /* [face_count] */
  uint32_t *queue;                 /* [face_count] */
  uint32_t queued;
} orienter;

/* Reaches the face across an edge, flagged as turned so that the two then run along the edge in opposite
 * directions. */
static void reach_over(orienter *o, uint32_t corner, piece *p) {
  const tw_topology *t = o->t;
  uint32_t other = t->sibling[corner], face = tw_corner_face(t, corner), beyond = tw_corner_face(t, other);
  if (other == corner || t->sibling[other] != corner || !o->selected[beyond]) {
    p->is_closed = false;
    return;
  }
  if (o->is_reached[beyond]) return;
  bool is_reversed = t->corner_vertex[corner] == t->corner_vertex[other];
  o->is_reached[beyond] = 1;
  o->is_turned[beyond] = o->is_turned[face] != is_reversed;
  o->queue[o->queued++] = beyond;
}

static piece reach(orienter *o, uint32_t first) {
  piece p = {o->queued, 0, true};
  o->is_reached[first] = 1;
  o->queue[o->queued++] = first;
  for (uint32_t i = p.begin; i < o->queued; i++) {
    uint32_t face = o->queue[i], begin = tw_face_begin(o->t, face);
    for (uint32_t c = begin; c < begin + tw_face_size(o->t, face); c++) reach_over(o, c, &p);
  }
  p.end = o->queued;
  return p;
}

/* Six times the signed volume between a face and a point. */
static double volume_of(const orienter *o, uint32_t face, const float *from) {
  const tw_mesh *mesh = &o->editor->mesh;
  uint32_t begin = mesh->face_offsets[face], end = mesh->face_offsets[face + 1];
  double sides[3][3], across[3], sum = 0;
  for (uint32_t c = begin + 1; c + 1 < end; c++) {
    const uint32_t corners[3] = {begin, c, c + 1};
    for (int k = 0; k < 3; k++)
      tw_side3(from, tw_editor_point(o->editor, mesh->corners[corners[k]]), sides[k]);
    tw_cross3(sides[1], sides[2], across);
    sum += tw_dot3(sides[0], across);
  }
  return o->is_turned[face] ? -sum : sum;
}

/* Turns a closed piece so that it faces outward, and another one so that most of its faces keep their
 * winding. */
static void settle(orienter *o, const piece *p) {
  const tw_mesh *mesh = &o->editor->mesh;
  const float *from = tw_editor_point(o->editor, mesh->corners[mesh->face_offsets[o->queue[p->begin]]]);
  uint32_t turned = 0;
  double volume = 0;
  for (uint32_t i = p->begin; i < p->end; i++) {
    turned += o->is_turned[o->queue[i]];
    volume += volume_of(o, o->queue[i], from);
  }
  bool is_inside_out = p->is_closed && volume != 0 ? volume < 0 : turned > (p->end - p->begin) / 2;
  for (uint32_t i = p->begin; is_inside_out && i < p->end; i++) o->is_turned[o->queue[i]] ^= 1;
}

tw_status tw_edit_orient(tw_editor *editor) {
  uint8_t *selected;
  tw_status status = tw_editor_select(editor, &selected);
  if (status != TW_OK || !selected) return status;
  const tw_topology *t = editor->topology;
  orienter o = {.editor = editor, .t = t, .selected = selected};
  o.is_reached = tw_arena_alloc(editor->scratch, t->face_count, 1);
  o.is_turned = tw_arena_alloc(editor->scratch, t->face_count, 1);
  o.queue = tw_arena_alloc_raw(editor->scratch, t->face_count, sizeof *o.queue);
  if (!o.is_reached || !o.is_turned || !o.queue) return tw_editor_no_memory(editor);
  for (uint32_t f = 0; f < t->face_count; f++) {
    if (!selected[f] || o.is_reached[f]) continue;
    piece p = reach(&o, f);
    settle(&o, &p);
  }
  return turn(editor, o.is_turned, selected);
}
