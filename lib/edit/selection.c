/* Selections: the faces, edges or vertices that an edit applies to, as flags. */
#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "angle.h"
#include "editor.h"

const char *const tw_edit_element_names[3] = {"faces", "edges", "vertices"};

typedef struct picker {
  tw_editor *editor;
  const tw_selection *selection;
  uint32_t count; /* of all faces, edges or vertices */
  uint8_t *flags; /* [count] */
} picker;

static const char *element_name(const picker *p) {
  return tw_edit_element_names[p->selection->of];
}

static const char *element_noun(const picker *p) {
  static const char *const ones[] = {"face", "edge", "vertex"};
  return tw_plural(p->count, ones[p->selection->of], element_name(p));
}

/* place: the pointer below the selection's ("/group"). */
static tw_status refuse(const picker *p, const char *place, const char *detail) {
  char at[64];
  snprintf(at, sizeof at, "/%s%s", element_name(p), place);
  return tw_editor_fail(p->editor, TW_INVALID, at, "%s", detail);
}

/* ---- lists ----------------------------------------------------------------------------------- */

tw_status tw_editor_find_edge(tw_editor *editor, const uint32_t ends[2], const char *place, uint32_t *edge) {
  tw_status status = tw_editor_need_topology(editor);
  if (status != TW_OK) return status;
  for (int i = 0; i < 2; i++)
    if (ends[i] >= editor->mesh.point_count) {
      char at[64];
      snprintf(at, sizeof at, "%s/%d", place, i);
      return tw_editor_fail(editor, TW_INVALID, at, "index %u is out of range: there %s %u %s", ends[i],
                            tw_plural(editor->mesh.point_count, "is", "are"), editor->mesh.point_count,
                            tw_plural(editor->mesh.point_count, "point", "points"));
    }
  *edge = tw_topology_find_edge(editor->topology, ends[0], ends[1]);
  if (*edge != UINT32_MAX) return TW_OK;
  return tw_editor_fail(editor, TW_INVALID, place, "no face has an edge from point %u to point %u", ends[0],
                        ends[1]);
}

static tw_status pick_list(picker *p) {
  const tw_selection *s = p->selection;
  for (uint32_t i = 0; i < s->count; i++) {
    char place[64];
    uint32_t index;
    snprintf(place, sizeof place, "/%s/%u", element_name(p), i);
    if (s->of == TW_EDIT_EDGES) {
      tw_status status = tw_editor_find_edge(p->editor, s->indices + 2 * (size_t)i, place, &index);
      if (status != TW_OK) return status;
    } else {
      index = s->indices[i];
    }
    if (index >= p->count)
      return tw_editor_fail(p->editor, TW_INVALID, place, "index %u is out of range: there %s %u %s", index,
                            tw_plural(p->count, "is", "are"), p->count, element_noun(p));
    p->flags[index] = 1;
  }
  return TW_OK;
}

/* ---- groups and materials -------------------------------------------------------------------- */

/* Whether a set of groups, written as names with blanks between, contains a name. */
static bool set_has(const char *set, const char *name) {
  size_t length = strlen(name);
  for (const char *at = set; at; at = strchr(at, ' '), at = at ? at + 1 : NULL)
    if (strncmp(at, name, length) == 0 && (at[length] == ' ' || at[length] == '\0')) return true;
  return false;
}

static tw_status pick_group(picker *p) {
  const tw_mesh *mesh = &p->editor->mesh;
  const tw_model *model = p->editor->model;
  uint32_t count = model ? model->group_count : 0;
  uint8_t *is_in = tw_arena_alloc(p->editor->scratch, count, 1);
  bool is_known = false;
  if (!is_in) return tw_editor_no_memory(p->editor);
  for (uint32_t g = 0; g < count; g++) {
    is_in[g] = set_has(model->group_names[g], p->selection->name);
    is_known |= is_in[g];
  }
  if (!is_known) return refuse(p, "/group", "the model has no such group");
  for (uint32_t f = 0; mesh->face_groups && f < p->count; f++)
    p->flags[f] = mesh->face_groups[f] < count && is_in[mesh->face_groups[f]];
  return TW_OK;
}

static int32_t material_of(const picker *p, uint32_t face) {
  const tw_mesh *mesh = &p->editor->mesh;
  int32_t material = mesh->face_materials ? mesh->face_materials[face] : -1;
  return p->editor->model ? tw_model_material(p->editor->model, material) : material;
}

static tw_status pick_material(picker *p) {
  const tw_model *model = p->editor->model;
  const char *name = p->selection->name;
  uint32_t count = model ? model->material_count : 0;
  uint8_t *is_it = tw_arena_alloc(p->editor->scratch, count, 1);
  bool is_known = false;
  if (!is_it) return tw_editor_no_memory(p->editor);
  for (uint32_t m = 0; m < count; m++) {
    is_it[m] = name ? model->material_names[m] && strcmp(model->material_names[m], name) == 0
                    : m == p->selection->material;
    is_known |= is_it[m];
  }
  if (!is_known) return refuse(p, "/material", "the model has no such material");
  for (uint32_t f = 0; f < p->count; f++) {
    int32_t material = material_of(p, f);
    p->flags[f] = material >= 0 && (uint32_t)material < count && is_it[material];
  }
  return TW_OK;
}

/* ---- by where things are --------------------------------------------------------------------- */

static bool is_angle(double degrees) {
  return degrees >= 0 && degrees <= 180;
}

/* In radians: rounding must not decide about a face exactly at the angle. */
#define SLACK 1e-6

static tw_status pick_facing(picker *p) {
  double direction[3], normal[3];
  memcpy(direction, p->selection->direction, sizeof direction);
  if (tw_unit3(direction) == 0) return refuse(p, "/facing", "the direction has no length");
  if (!is_angle(p->selection->degrees)) return refuse(p, "/within", "an angle is from 0 to 180 degrees");
  for (uint32_t f = 0; f < p->count; f++) {
    tw_mesh_face_normal(&p->editor->mesh, f, normal);
    p->flags[f] = tw_dot3(normal, normal) > 0 &&
                  tw_angle3(normal, direction) <= p->selection->degrees * TW_RADIANS + SLACK;
  }
  return TW_OK;
}

/* Compares floats: a point at 0.1 is 0.10000000149, and on the side of a box that ends at 0.1. */
static bool is_inside(const picker *p, uint32_t point) {
  const float *at = tw_editor_point(p->editor, point);
  for (int i = 0; i < 3; i++)
    if (!(at[i] >= (float)p->selection->min[i] && at[i] <= (float)p->selection->max[i])) return false;
  return true;
}

static tw_status pick_inside(picker *p) {
  const tw_mesh *mesh = &p->editor->mesh;
  const tw_topology *t = p->editor->topology;
  for (uint32_t i = 0; i < p->count; i++) {
    bool inside = true;
    switch (p->selection->of) {
    case TW_EDIT_FACES:
      for (uint32_t c = mesh->face_offsets[i]; inside && c < mesh->face_offsets[i + 1]; c++)
        inside = is_inside(p, mesh->corners[c]);
      break;
    case TW_EDIT_EDGES:
      inside = is_inside(p, t->edge_vertices[i][0]) && is_inside(p, t->edge_vertices[i][1]);
      break;
    case TW_EDIT_VERTICES: inside = is_inside(p, i); break;
    }
    p->flags[i] = inside;
  }
  return TW_OK;
}

static tw_status pick_sharper(picker *p) {
  const tw_topology *t = p->editor->topology;
  if (!is_angle(p->selection->degrees))
    return refuse(p, "/sharper_than", "an angle is from 0 to 180 degrees");
  double(*normals)[3] = tw_arena_alloc_raw(p->editor->scratch, t->face_count, sizeof *normals);
  if (!normals) return tw_editor_no_memory(p->editor);
  for (uint32_t f = 0; f < t->face_count; f++) tw_mesh_face_normal(&p->editor->mesh, f, normals[f]);
  for (uint32_t e = 0; e < p->count; e++) {
    if (t->edge_flags[e]) continue;
    const double *a = normals[tw_corner_face(t, t->edge_corner[e])];
    const double *b = normals[tw_corner_face(t, t->sibling[t->edge_corner[e]])];
    bool has_angle = tw_dot3(a, a) > 0 && tw_dot3(b, b) > 0;
    p->flags[e] = has_angle && tw_angle3(a, b) > p->selection->degrees * TW_RADIANS + SLACK;
  }
  return TW_OK;
}

/* ---- what hangs together --------------------------------------------------------------------- */

/* The edge that continues an edge straight across one of its ends, or UINT32_MAX. */
static uint32_t straight_on(const tw_topology *t, uint32_t edge, uint32_t vertex) {
  const uint32_t *ring = t->ring_edges + t->ring_offsets[vertex];
  uint32_t count = t->ring_offsets[vertex + 1] - t->ring_offsets[vertex], at = 0;
  if (t->vertex_flags[vertex] & TW_VERTEX_NONMANIFOLD) return UINT32_MAX;
  while (ring[at] != edge) at++;
  if (t->edge_flags[edge] & TW_EDGE_BORDER) return ring[at == 0 ? count - 1 : 0];
  bool is_crossing = count == 4 && !(t->vertex_flags[vertex] & TW_VERTEX_BORDER);
  return is_crossing ? ring[(at + 2) % 4] : UINT32_MAX;
}

/* Passes each vertex of high valence at most once, so that its ring is not searched again and again: a
 * border's two edges are the ends of the ring, and other loops continue only across vertices of four
 * edges. */
static void find_loop(const tw_topology *t, uint32_t first, uint8_t *flags) {
  flags[first] = 1;
  for (int end = 0; end < 2; end++) {
    uint32_t edge = first, vertex = t->edge_vertices[first][end];
    while ((edge = straight_on(t, edge, vertex)) != UINT32_MAX && !flags[edge]) {
      flags[edge] = 1;
      vertex = tw_far_end(t, edge, vertex);
    }
  }
}

/* Follows a ring of edges from a corner across its face. is_along: the corner's half-edge has the direction
 * of the ring's first edge. */
static void follow_ring(const tw_topology *t, uint32_t corner, bool is_along, uint8_t *flags) {
  while (tw_face_size(t, tw_corner_face(t, corner)) == 4) {
    uint32_t across = tw_corner_next(t, tw_corner_next(t, corner)), edge = t->corner_edge[across];
    if (flags[edge]) return;
    /* The half-edge on the opposite side of the quad runs the other way. */
    bool is_across_along = !is_along;
    flags[edge] = (t->edge_vertices[edge][0] == t->corner_vertex[across]) == is_across_along ? 1 : 2;
    uint32_t next = t->sibling[across];
    if (next == across || (t->edge_flags[edge] & TW_EDGE_NONMANIFOLD)) return;
    corner = next;
  }
}

void tw_find_ring(const tw_topology *topology, uint32_t edge, uint8_t *flags) {
  const tw_topology *t = topology;
  uint32_t corner = t->edge_corner[edge];
  flags[edge] = 1;
  if (t->edge_flags[edge] & TW_EDGE_NONMANIFOLD) return;
  follow_ring(t, corner, true, flags);
  if (t->sibling[corner] != corner) follow_ring(t, t->sibling[corner], false, flags);
}

static tw_status pick_from_edge(picker *p) {
  const char *place = p->selection->by == TW_SELECT_LOOP ? "/edges/loop" : "/edges/ring";
  uint32_t edge;
  tw_status status = tw_editor_find_edge(p->editor, p->selection->indices, place, &edge);
  if (status != TW_OK) return status;
  if (p->selection->by == TW_SELECT_LOOP)
    find_loop(p->editor->topology, edge, p->flags);
  else
    tw_find_ring(p->editor->topology, edge, p->flags);
  return TW_OK;
}

/* ---- any selection --------------------------------------------------------------------------- */

static tw_status pick_made(picker *p) {
  const tw_editor *e = p->editor;
  const tw_named *named = NULL;
  for (uint32_t i = 0; i < e->named_count; i++)
    if (strcmp(e->named[i].name, p->selection->name) == 0) named = &e->named[i];
  if (!named) return refuse(p, "/made", "no edit before has this name");
  switch (p->selection->of) {
  case TW_EDIT_FACES:
    for (uint32_t i = 0; i < named->face_count; i++) p->flags[named->faces[i]] = 1;
    break;
  case TW_EDIT_EDGES:
    for (uint32_t i = 0; i < named->edge_count; i++) {
      uint32_t edge = tw_topology_find_edge(e->topology, named->edges[i][0], named->edges[i][1]);
      if (edge != UINT32_MAX) p->flags[edge] = 1;
    }
    break;
  case TW_EDIT_VERTICES:
    for (uint32_t i = 0; i < named->point_count; i++) p->flags[named->points[i]] = 1;
    break;
  }
  return TW_OK;
}

static tw_status pick(picker *p) {
  const tw_selection *s = p->selection;
  bool is_faces = s->of == TW_EDIT_FACES, is_edges = s->of == TW_EDIT_EDGES;
  switch (s->by) {
  case TW_SELECT_NOTHING:
  case TW_SELECT_ALL: memset(p->flags, 1, p->count); return TW_OK;
  case TW_SELECT_LIST: return pick_list(p);
  case TW_SELECT_INSIDE: return pick_inside(p);
  case TW_SELECT_MADE: return pick_made(p);
  case TW_SELECT_GROUP:
    if (is_faces) return pick_group(p);
    break;
  case TW_SELECT_MATERIAL:
    if (is_faces) return pick_material(p);
    break;
  case TW_SELECT_FACING:
    if (is_faces) return pick_facing(p);
    break;
  case TW_SELECT_BORDER:
    for (uint32_t e = 0; is_edges && e < p->count; e++)
      p->flags[e] = (p->editor->topology->edge_flags[e] & TW_EDGE_BORDER) != 0;
    if (is_edges) return TW_OK;
    break;
  case TW_SELECT_LOOP:
  case TW_SELECT_RING:
    if (is_edges) return pick_from_edge(p);
    break;
  case TW_SELECT_SHARPER:
    if (is_edges) return pick_sharper(p);
    break;
  }
  return refuse(p, "", "these cannot be selected so");
}

tw_status tw_editor_select(tw_editor *editor, uint8_t **flags) {
  const tw_selection *s = &editor->edit->selection;
  tw_status status = tw_editor_need_topology(editor);
  *flags = NULL;
  if (status != TW_OK) return status;
  const uint32_t counts[] = {editor->mesh.face_count, editor->topology->edge_count, editor->mesh.point_count};
  picker p = {editor, s, counts[s->of], tw_arena_alloc(editor->scratch, counts[s->of], 1)};
  if (!p.flags) return tw_editor_no_memory(editor);
  status = pick(&p);
  if (status != TW_OK) return status;
  if (memchr(p.flags, 1, p.count)) {
    *flags = p.flags;
    return TW_OK;
  }
  return editor->edit->is_optional ? TW_OK : refuse(&p, "", "the selection is empty");
}

tw_status tw_editor_select_points(tw_editor *editor, uint8_t **flags, uint8_t **points) {
  tw_status status = tw_editor_select(editor, flags);
  if (status != TW_OK || !*flags) return status;
  const tw_topology *t = editor->topology;
  const tw_edit_element of = editor->edit->selection.of;
  const uint8_t *selected = *flags;
  *points = of == TW_EDIT_VERTICES ? *flags : tw_arena_alloc(editor->scratch, t->vertex_count, 1);
  if (!*points) return tw_editor_no_memory(editor);
  for (uint32_t c = 0; of == TW_EDIT_FACES && c < t->corner_count; c++)
    if (selected[t->corner_face[c]]) (*points)[t->corner_vertex[c]] = 1;
  for (uint32_t e = 0; of == TW_EDIT_EDGES && e < t->edge_count; e++)
    if (selected[e]) (*points)[t->edge_vertices[e][0]] = (*points)[t->edge_vertices[e][1]] = 1;
  return TW_OK;
}

/* ---- names of selections --------------------------------------------------------------------- */

tw_status tw_editor_name_selected(tw_editor *editor, const uint8_t *selected, const uint8_t *points) {
  const tw_topology *t = editor->topology;
  const tw_edit_element of = editor->edit->selection.of;
  tw_named *named;
  uint32_t edge_count = 0, *edges = NULL;
  tw_status status = tw_editor_name_own(editor, &named);
  if (status != TW_OK || !named) return status;
  bool has_room = true;
  if (of == TW_EDIT_FACES) {
    named->faces = tw_list_flagged(named->arena, selected, 0xFF, t->face_count, &named->face_count);
    has_room = named->faces != NULL;
  } else if (of == TW_EDIT_EDGES) {
    edges = tw_list_flagged(editor->scratch, selected, 0xFF, t->edge_count, &edge_count);
    named->edges = tw_arena_alloc_raw(named->arena, edge_count, sizeof *named->edges);
    has_room = edges && named->edges;
  }
  for (uint32_t i = 0; has_room && i < edge_count; i++)
    memcpy(named->edges[i], t->edge_vertices[edges[i]], sizeof *named->edges);
  named->edge_count = has_room ? edge_count : 0;
  named->points = tw_list_flagged(named->arena, points, 0xFF, t->vertex_count, &named->point_count);
  return has_room && named->points ? TW_OK : tw_editor_no_memory(editor);
}
