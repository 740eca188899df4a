/* Any edits of any mesh that passes its check: what comes out passes it too, or the error has its place. */
#include <stdio.h>

#include "edited.h"
#include "wrapped_memory.h"

static uint32_t seed;

static uint32_t any(uint32_t below) {
  seed = seed * 1664525u + 1013904223u;
  return (uint32_t)((uint64_t)(seed >> 8) * below >> 24);
}

static float any_coordinate(void) {
  static const float some[] = {0, -0.0f, 0, 1, 1, -1, -1, 0.5f, 1e-30f, 1e17f, -1e17f, 3};
  return any(40) ? some[any(9)] : some[any(12)];
}

enum { POINTS = 24, FACES = 30, CORNERS_MAX = 8 * FACES, LIST_MAX = 4, EDITS = 6 };

typedef struct tangle {
  float points[POINTS][3], crease_sharpness[6], point_sharpness[4];
  uint32_t corners[CORNERS_MAX], offsets[FACES + 1], creases[6][2], sharp[4], holes[3];
  dressed dress;
  tw_mesh mesh;
} tangle;

/* Faces over a handful of points: edges of many faces, faces that meet themselves, points at one place. */
static void make_tangle(tangle *t) {
  uint32_t points = 4 + any(POINTS - 3), faces = 1 + any(FACES), corner = 0;
  for (uint32_t p = 0; p < points; p++)
    for (int i = 0; i < 3; i++) t->points[p][i] = any_coordinate();
  for (uint32_t f = 0; f < faces; f++) {
    uint32_t size = any(3) ? 4 : 3 + any(6), begin = corner;
    for (uint32_t i = 0; i < size; i++, corner++) do
        t->corners[corner] = any(points);
      while ((i > 0 && t->corners[corner] == t->corners[corner - 1]) ||
             (i + 1 == size && t->corners[corner] == t->corners[begin]));
    t->offsets[f + 1] = corner;
  }
  t->mesh = mesh_of(t->points[0], points, t->corners, t->offsets, faces);
  dress(&t->mesh, &t->dress);
  for (uint32_t i = 0; i < 6; i++) {
    uint32_t at = any(corner);
    t->creases[i][0] = t->corners[at];
    t->creases[i][1] = any(4) ? t->corners[(at + 1) % corner] : any(points);
    t->crease_sharpness[i] = (float)any(11);
  }
  for (uint32_t i = 0; i < 4; i++) {
    t->sharp[i] = any(points);
    t->point_sharpness[i] = (float)any(11);
  }
  for (uint32_t i = 0; i < 3; i++) t->holes[i] = any(faces);
  t->mesh.crease_count = 6;
  t->mesh.crease_edges = t->creases[0];
  t->mesh.crease_sharpness = t->crease_sharpness;
  t->mesh.sharp_point_count = 4;
  t->mesh.sharp_points = t->sharp;
  t->mesh.point_sharpness = t->point_sharpness;
  t->mesh.hole_count = 3;
  t->mesh.holes = t->holes;
}

static double any_length(void) {
  static const double some[] = {0, 0.1, 0.5, -0.25, 1, 1e18, NAN, INFINITY, -1e300};
  return some[any(any(10) ? 5 : 9)];
}

static void any_vector(double out[3]) {
  for (int i = 0; i < 3; i++) out[i] = any_length();
}

static tw_selection any_selection(const tangle *t, tw_edit_kind kind, uint32_t *list) {
  static const tw_select faces[] = {TW_SELECT_LIST, TW_SELECT_ALL,   TW_SELECT_FACING,   TW_SELECT_INSIDE,
                                    TW_SELECT_MADE, TW_SELECT_GROUP, TW_SELECT_MATERIAL, TW_SELECT_NOTHING},
                         edges[] = {TW_SELECT_LIST,   TW_SELECT_ALL,  TW_SELECT_INSIDE, TW_SELECT_MADE,
                                    TW_SELECT_BORDER, TW_SELECT_LOOP, TW_SELECT_RING,   TW_SELECT_SHARPER},
                         vertices[] = {TW_SELECT_LIST, TW_SELECT_ALL, TW_SELECT_INSIDE, TW_SELECT_MADE};
  bool is_free = !any(20) || kind == TW_EDIT_DELETE || kind == TW_EDIT_MOVE;
  tw_edit_element usual = kind == TW_EDIT_CREASE                            ? TW_EDIT_EDGES
                          : kind == TW_EDIT_CORNER || kind == TW_EDIT_MERGE ? TW_EDIT_VERTICES
                                                                            : TW_EDIT_FACES;
  tw_selection s = {
      .of = is_free ? (tw_edit_element)any(3) : usual, .name = "a", .indices = list, .degrees = any(181)};
  s.by = s.of == TW_EDIT_FACES   ? faces[any(any(4) ? 5 : 8)]
         : s.of == TW_EDIT_EDGES ? edges[any(8)]
                                 : vertices[any(4)];
  s.count = 1 + any(LIST_MAX);
  for (uint32_t i = 0; i < LIST_MAX; i++) {
    uint32_t at = any(t->mesh.corner_count);
    list[2 * i] = s.of == TW_EDIT_FACES ? any(t->mesh.face_count) : t->corners[at];
    list[2 * i + 1] =
        s.of == TW_EDIT_FACES ? any(t->mesh.face_count) : t->corners[(at + 1) % t->mesh.corner_count];
  }
  any_vector(s.direction);
  for (int i = 0; i < 3; i++) {
    s.min[i] = any(2) ? 0 : -1;
    s.max[i] = any(3);
  }
  return s;
}

static tw_edit any_edit(const tangle *t, uint32_t *list) {
  static const double at[4] = {0.1, 0.25, 0.5, 0.9};
  tw_edit e = {.kind = (tw_edit_kind)any(TW_EDIT_KINDS), .is_optional = any(2), .name = any(2) ? "a" : NULL};
  e.selection = any_selection(t, e.kind, list);
  switch (e.kind) {
  case TW_EDIT_EXTRUDE:
    e.extrude.is_individual = any(2);
    e.extrude.has_by = any(2);
    e.extrude.distance = any_length();
    any_vector(e.extrude.by);
    break;
  case TW_EDIT_INSET:
    e.inset.is_individual = any(2);
    e.inset.amount = any_length();
    break;
  case TW_EDIT_LOOP_CUT:
    memcpy(e.loop_cut.edge, list, sizeof e.loop_cut.edge);
    e.loop_cut.cuts = any(5);
    e.loop_cut.at = any(2) ? at : NULL;
    break;
  case TW_EDIT_SUBDIVIDE: e.subdivide.cuts = any(4); break;
  case TW_EDIT_MERGE:
    e.merge.distance = any(2) ? -1 : any_length();
    e.merge.has_to = any(2);
    any_vector(e.merge.to);
    break;
  case TW_EDIT_FILL:
    e.fill.has_border = any(2);
    memcpy(e.fill.border, list, sizeof e.fill.border);
    e.fill.max_edges = any(6);
    e.fill.method = (tw_fill_method)any(3);
    break;
  case TW_EDIT_MIRROR:
    e.mirror.axis = (int)any(4);
    e.mirror.weld = any_length();
    break;
  case TW_EDIT_MOVE: any_vector(e.move.by); break;
  case TW_EDIT_ROTATE:
    any_vector(e.rotate.axis);
    e.rotate.degrees = any_length() * 100;
    e.rotate.has_about = any(2);
    any_vector(e.rotate.about);
    break;
  case TW_EDIT_SCALE:
    any_vector(e.scale.by);
    e.scale.has_about = any(2);
    any_vector(e.scale.about);
    break;
  case TW_EDIT_CREASE:
  case TW_EDIT_CORNER:
  case TW_EDIT_HOLE: e.sharpness = any(12); break;
  case TW_EDIT_DROP_PIECES: e.drop_pieces.faces = any(10); break;
  case TW_EDIT_DESPIKE: e.despike.factor = any_length(); break;
  case TW_EDIT_SMOOTH:
    e.smooth.method = any(2) ? TW_SMOOTH_TAUBIN : TW_SMOOTH_LAPLACIAN;
    e.smooth.iterations = any(4);
    break;
  case TW_EDIT_DELETE:
  case TW_EDIT_FLIP:
  case TW_EDIT_ORIENT:
  case TW_EDIT_TRIANGULATE:
  case TW_EDIT_QUADS: break;
  }
  return e;
}

static bool has_name(const tw_edit *edits, uint32_t count, const char *name) {
  for (uint32_t i = 0; i < count; i++)
    if (edits[i].name && strcmp(edits[i].name, name) == 0) return true;
  return false;
}

static void assert_made(const tw_mesh *mesh, const tw_made *made) {
  for (uint32_t i = 0; i < made->face_count; i++)
    assert_true(made->faces[i] < mesh->face_count && (i == 0 || made->faces[i] > made->faces[i - 1]));
  for (uint32_t i = 0; i < made->vertex_count; i++)
    assert_true(made->vertices[i] < mesh->point_count &&
                (i == 0 || made->vertices[i] > made->vertices[i - 1]));
}

TEST(any_edits_of_any_mesh) {
  const tw_edit_limits limits = {.points = 20000, .faces = 20000, .corners = 80000, .work = 400000};
  tangle *t = malloc(sizeof *t);
  uint32_t kinds[TW_EDIT_KINDS] = {0};
  assert_non_null(t);
  for (uint32_t round = 0; round < 20000; round++) {
    uint32_t lists[EDITS][2 * LIST_MAX], made_count;
    tw_edit edits[EDITS];
    tw_made made[EDITS];
    seed = 7919 * round;
    memset(t, 0, sizeof *t);
    make_tangle(t);
    uint32_t count = 1 + any(EDITS);
    assert_int_equal(tw_mesh_check(&t->mesh, NULL, NULL), TW_OK);
    for (uint32_t i = 0; i < count; i++) edits[i] = any_edit(t, lists[i]);
    tw_arena *arena = tw_arena_create();
    tw_mesh out;
    tw_error error = {0};
    tw_status status =
        tw_mesh_edit(&t->mesh, NULL, edits, count, &limits, arena, &out, made, &made_count, NULL, &error);
    if (status == TW_OK) {
      if (tw_mesh_check(&out, &error, NULL) != TW_OK) {
        print_error("round %u: %s: %s\n", round, error.pointer, error.detail);
        for (uint32_t i = 0; i < count; i++) print_error("  %s\n", tw_edit_names[edits[i].kind]);
        fail();
      }
      assert_true(out.point_count <= limits.points && out.face_count <= limits.faces);
      assert_int_equal(made_count, has_name(edits, count, "a"));
      if (made_count > 0) assert_made(&out, &made[0]);
      for (uint32_t i = 0; i < count; i++) kinds[edits[i].kind]++;
    } else {
      assert_true(status == TW_INVALID || status == TW_LIMIT);
      assert_int_equal(error.pointer[0], '/');
      assert_true(error.detail[0] != '\0');
    }
    tw_arena_destroy(arena);
  }
  free(t);
  for (uint32_t i = 0; i < TW_EDIT_KINDS; i++) {
    if (kinds[i] <= 100) print_error("%s: %u\n", tw_edit_names[i], kinds[i]);
    assert_true(kinds[i] > 100);
  }
}

/* Edits that only add to a surface leave it a sphere: closed, manifold, of Euler characteristic 2. */
TEST(spheres_stay_spheres) {
  const tw_edit_kind kinds[] = {TW_EDIT_EXTRUDE,     TW_EDIT_INSET, TW_EDIT_LOOP_CUT, TW_EDIT_SUBDIVIDE,
                                TW_EDIT_TRIANGULATE, TW_EDIT_QUADS, TW_EDIT_ORIENT};
  const tw_edit_limits limits = {.points = 20000, .faces = 20000, .corners = 80000, .work = 400000};
  uint32_t done = 0;
  for (uint32_t round = 0; round < 2000; round++) {
    tw_mesh mesh = cube(), next;
    tw_arena *arena = tw_arena_create();
    seed = 104729 * round;
    for (uint32_t step = 0; step < 6; step++) {
      uint32_t list[6], at = any(mesh.corner_count), face = 0;
      while (mesh.face_offsets[face + 1] <= at) face++;
      for (int i = 0; i < 6; i++) list[i] = any(mesh.face_count);
      tw_edit e = {.kind = kinds[any(7)],
                   .selection = {TW_EDIT_FACES, TW_SELECT_LIST, .count = 1 + any(6), .indices = list}};
      if (e.kind == TW_EDIT_EXTRUDE) {
        e.extrude.distance = 0.1;
        e.extrude.is_individual = any(4) == 0;
      } else if (e.kind == TW_EDIT_INSET) {
        e.inset.amount = 0.01;
        e.inset.is_individual = any(4) == 0;
      } else if (e.kind == TW_EDIT_LOOP_CUT) {
        uint32_t behind = at + 1 < mesh.face_offsets[face + 1] ? at + 1 : mesh.face_offsets[face];
        e.loop_cut.edge[0] = mesh.corners[at];
        e.loop_cut.edge[1] = mesh.corners[behind];
        e.loop_cut.cuts = 1 + any(2);
        e.is_optional = true;
      } else if (e.kind == TW_EDIT_SUBDIVIDE) {
        e.subdivide.cuts = 1 + any(2);
      } else {
        e.selection.by = TW_SELECT_ALL;
      }
      tw_error error = {0};
      tw_status status = tw_mesh_edit(&mesh, NULL, &e, 1, &limits, arena, &next, NULL, NULL, NULL, &error);
      if (status == TW_LIMIT) break;
      assert_int_equal(status, TW_OK);
      assert_int_equal(tw_mesh_check(&next, NULL, NULL), TW_OK);
      tw_mesh_stats stats;
      assert_int_equal(tw_mesh_describe(&next, &stats, NULL), TW_OK);
      uint32_t wrong = stats.nonmanifold_edges + stats.nonmanifold_vertices + stats.boundary_edges +
                       stats.reversed_edges + stats.unused_points + (stats.euler_characteristic != 2);
      if (wrong > 0) print_error("round %u, step %u: %s\n", round, step, tw_edit_names[e.kind]);
      assert_int_equal(wrong, 0);
      tw_mesh_stats_deinit(&stats);
      mesh = next;
      done++;
    }
    tw_arena_destroy(arena);
  }
  assert_true(done > 10000);
}

/* ---- bad selections -------------------------------------------------------------------------- */

/* Of each kind one that a cube, or a cube without a face, can have done to all that it is applied to. */
static tw_edit sound_edit(tw_edit_kind kind) {
  tw_edit e = {.kind = kind};
  switch (kind) {
  case TW_EDIT_EXTRUDE: e.extrude.distance = 0.5; break;
  case TW_EDIT_INSET: e.inset.amount = 0.25; break;
  case TW_EDIT_LOOP_CUT:
    e.loop_cut.cuts = 1;
    e.loop_cut.edge[1] = 1;
    break;
  case TW_EDIT_SUBDIVIDE: e.subdivide.cuts = 1; break;
  case TW_EDIT_ROTATE: e.rotate.axis[0] = 1; break;
  case TW_EDIT_CREASE:
  case TW_EDIT_CORNER:
  case TW_EDIT_HOLE: e.sharpness = 1; break;
  case TW_EDIT_DESPIKE: e.despike.factor = 2; break;
  case TW_EDIT_SMOOTH: e.smooth.iterations = 1; break;
  default: break;
  }
  return e;
}

/* counts: of vertices, edges and faces of what comes out. */
static tw_status try_edit(const tw_mesh *mesh, const tw_edit *e, uint32_t counts[3], tw_error *error) {
  tw_arena *arena = tw_arena_create();
  tw_mesh out;
  *error = (tw_error){0};
  tw_status status = tw_mesh_edit(mesh, NULL, e, 1, &roomy, arena, &out, NULL, NULL, NULL, error);
  if (status == TW_OK) {
    tw_mesh_stats stats;
    assert_int_equal(tw_mesh_check(&out, NULL, NULL), TW_OK);
    assert_int_equal(tw_mesh_describe(&out, &stats, NULL), TW_OK);
    counts[0] = stats.vertices;
    counts[1] = stats.edges;
    counts[2] = stats.faces;
    tw_mesh_stats_deinit(&stats);
  }
  tw_arena_destroy(arena);
  return status;
}

static bool uses_selection(tw_edit_kind kind) {
  return kind != TW_EDIT_LOOP_CUT && kind != TW_EDIT_FILL && kind != TW_EDIT_MIRROR &&
         kind != TW_EDIT_DROP_PIECES;
}

/* Whether the kind is applied to such elements at all. */
static bool is_applied_to(const tw_mesh *mesh, tw_edit_kind kind, tw_edit_element of) {
  tw_edit e = sound_edit(kind);
  uint32_t counts[3];
  tw_error error;
  e.selection = (tw_selection){.of = of, .by = TW_SELECT_ALL};
  return try_edit(mesh, &e, counts, &error) == TW_OK;
}

static void assert_place(const tw_edit *e, const tw_error *error) {
  char begin[32];
  snprintf(begin, sizeof begin, "/0/%s", tw_edit_element_names[e->selection.of]);
  if (strncmp(error->pointer, begin, strlen(begin)) != 0 && strcmp(error->pointer, "/0/within") != 0)
    print_error("%s: %s: %s\n", tw_edit_names[e->kind], error->pointer, error->detail);
  assert_true(strncmp(error->pointer, begin, strlen(begin)) == 0 || strcmp(error->pointer, "/0/within") == 0);
  assert_true(error->detail[0] != '\0');
}

#define BAD(element, how, ...)                                                                               \
  { .of = element, .by = how, .name = "none", __VA_ARGS__ }
#define FACE(how, ...)   BAD(TW_EDIT_FACES, how, __VA_ARGS__)
#define EDGE(how, ...)   BAD(TW_EDIT_EDGES, how, __VA_ARGS__)
#define VERTEX(how, ...) BAD(TW_EDIT_VERTICES, how, __VA_ARGS__)

/* Points 0 and 6 of the cube are opposite corners. */
static const uint32_t no_edges[][2] = {{0, 6}, {0, 0}, {8, 0}, {0, 8}, {UINT32_MAX, UINT32_MAX}};

TEST(no_edit_takes_a_wrong_selection) {
  const tw_selection wrong[] = {LIST(TW_EDIT_FACES, 6),
                                LIST(TW_EDIT_FACES, 0, UINT32_MAX),
                                LIST(TW_EDIT_EDGES, 0, 6),
                                LIST(TW_EDIT_EDGES, 0, 1, 0, 0),
                                LIST(TW_EDIT_EDGES, 0, 1, UINT32_MAX, 0),
                                LIST(TW_EDIT_VERTICES, 8),
                                LIST(TW_EDIT_VERTICES, 0, UINT32_MAX),
                                FACE(TW_SELECT_MADE, .count = 0),
                                EDGE(TW_SELECT_MADE, .count = 0),
                                VERTEX(TW_SELECT_MADE, .count = 0),
                                FACE(TW_SELECT_GROUP, .count = 0),
                                FACE(TW_SELECT_MATERIAL, .count = 0),
                                {.of = TW_EDIT_FACES, .by = TW_SELECT_MATERIAL, .material = UINT32_MAX},
                                FACE(TW_SELECT_FACING, .degrees = 45),
                                FACE(TW_SELECT_FACING, .degrees = 45, .direction = {NAN, 0, 0}),
                                FACE(TW_SELECT_FACING, .degrees = 45, .direction = {INFINITY, 0, 0}),
                                FACE(TW_SELECT_FACING, .degrees = -1, .direction = {1, 0, 0}),
                                FACE(TW_SELECT_FACING, .degrees = 181, .direction = {1, 0, 0}),
                                FACE(TW_SELECT_FACING, .degrees = NAN, .direction = {1, 0, 0}),
                                EDGE(TW_SELECT_SHARPER, .degrees = -1),
                                EDGE(TW_SELECT_SHARPER, .degrees = INFINITY),
                                EDGE(TW_SELECT_SHARPER, .degrees = NAN),
                                EDGE(TW_SELECT_LOOP, .count = 1, .indices = no_edges[0]),
                                EDGE(TW_SELECT_LOOP, .count = 1, .indices = no_edges[2]),
                                EDGE(TW_SELECT_LOOP, .count = 1, .indices = no_edges[4]),
                                EDGE(TW_SELECT_RING, .count = 1, .indices = no_edges[1]),
                                EDGE(TW_SELECT_RING, .count = 1, .indices = no_edges[3]),
                                EDGE(TW_SELECT_RING, .count = 1, .indices = no_edges[4]),
                                /* By what such elements do not have. */
                                FACE(TW_SELECT_BORDER, .count = 0),
                                FACE(TW_SELECT_SHARPER, .degrees = 45),
                                FACE(TW_SELECT_LOOP, .count = 1, .indices = no_edges[0]),
                                FACE(TW_SELECT_RING, .count = 1, .indices = no_edges[0]),
                                EDGE(TW_SELECT_GROUP, .count = 0),
                                EDGE(TW_SELECT_MATERIAL, .count = 0),
                                EDGE(TW_SELECT_FACING, .degrees = 45, .direction = {1, 0, 0}),
                                VERTEX(TW_SELECT_GROUP, .count = 0),
                                VERTEX(TW_SELECT_MATERIAL, .count = 0),
                                VERTEX(TW_SELECT_FACING, .degrees = 45, .direction = {1, 0, 0}),
                                VERTEX(TW_SELECT_BORDER, .count = 0),
                                VERTEX(TW_SELECT_SHARPER, .degrees = 45),
                                VERTEX(TW_SELECT_LOOP, .count = 1, .indices = no_edges[0]),
                                VERTEX(TW_SELECT_RING, .count = 1, .indices = no_edges[0])};
  const tw_mesh mesh = cube();
  uint32_t counts[3];
  tw_error error;
  for (int kind = 0; kind < TW_EDIT_KINDS; kind++)
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
      for (int is_optional = 0; is_optional < 2; is_optional++) {
        tw_edit e = sound_edit((tw_edit_kind)kind);
        if (!uses_selection(e.kind)) continue;
        e.selection = wrong[i];
        e.is_optional = is_optional;
        tw_status status = try_edit(&mesh, &e, counts, &error);
        if (status != TW_INVALID) print_error("%s: selection %zu\n", tw_edit_names[kind], i);
        assert_int_equal(status, TW_INVALID);
        assert_place(&e, &error);
      }
}

TEST(no_edit_takes_an_empty_selection_unless_it_may) {
  const double far[3] = {2, 2, 2}, near[3] = {3, 3, 3}, no[3] = {NAN, NAN, NAN};
  const tw_mesh mesh = cube();
  uint32_t counts[3];
  tw_error error;
  for (int kind = 0; kind < TW_EDIT_KINDS; kind++)
    for (int of = 0; of < 3; of++) {
      if (!uses_selection((tw_edit_kind)kind) ||
          !is_applied_to(&mesh, (tw_edit_kind)kind, (tw_edit_element)of))
        continue;
      tw_selection empty[6];
      for (int i = 0; i < 6; i++)
        empty[i] = (tw_selection){.of = (tw_edit_element)of, .by = TW_SELECT_INSIDE};
      memcpy(empty[0].min, far, sizeof far); /* away from the cube */
      memcpy(empty[0].max, near, sizeof near);
      memcpy(empty[1].min, near, sizeof near); /* upside down */
      memcpy(empty[1].max, far, sizeof far);
      memcpy(empty[2].min, no, sizeof no);
      memcpy(empty[3].max, no, sizeof no);
      empty[4].by = TW_SELECT_LIST;
      empty[5].by = of == TW_EDIT_EDGES ? TW_SELECT_BORDER : TW_SELECT_LIST;
      for (int i = 0; i < 6; i++) {
        tw_edit e = sound_edit((tw_edit_kind)kind);
        e.selection = empty[i];
        assert_int_equal(try_edit(&mesh, &e, counts, &error), TW_INVALID);
        assert_place(&e, &error);
        e.is_optional = true;
        assert_int_equal(try_edit(&mesh, &e, counts, &error), TW_OK);
        assert_memory_equal(counts, ((uint32_t[3]){8, 12, 6}), sizeof counts);
      }
    }
}

/* What is named twice is selected once. */
TEST(elements_may_be_listed_again) {
  const tw_selection lists[3][2] = {
      {LIST(TW_EDIT_FACES, 1, 4), LIST(TW_EDIT_FACES, 4, 1, 1, 4, 1)},
      {LIST(TW_EDIT_EDGES, 0, 1, 1, 2), LIST(TW_EDIT_EDGES, 2, 1, 1, 0, 0, 1, 1, 2)},
      {LIST(TW_EDIT_VERTICES, 1, 6), LIST(TW_EDIT_VERTICES, 6, 1, 6, 6, 1)}};
  const tw_mesh mesh = cube();
  uint32_t tried = 0;
  for (int kind = 0; kind < TW_EDIT_KINDS; kind++)
    for (int of = 0; of < 3; of++) {
      uint32_t once[3], again[3];
      tw_error error;
      tw_edit e = sound_edit((tw_edit_kind)kind);
      e.selection = lists[of][0];
      tw_status status = try_edit(&mesh, &e, once, &error);
      e.selection = lists[of][1];
      assert_int_equal(try_edit(&mesh, &e, again, &error), status);
      if (status != TW_OK) continue;
      assert_memory_equal(once, again, sizeof once);
      tried++;
    }
  assert_true(tried > TW_EDIT_KINDS);
}

TEST(no_edit_begins_at_what_is_no_edge) {
  const tw_mesh mesh = cube();
  uint32_t counts[3];
  tw_error error;
  for (size_t i = 0; i < sizeof no_edges / sizeof *no_edges; i++)
    for (int is_optional = 0; is_optional < 2; is_optional++) {
      tw_edit cut = sound_edit(TW_EDIT_LOOP_CUT), fill = sound_edit(TW_EDIT_FILL);
      memcpy(cut.loop_cut.edge, no_edges[i], sizeof no_edges[i]);
      memcpy(fill.fill.border, no_edges[i], sizeof no_edges[i]);
      fill.fill.has_border = true;
      cut.is_optional = fill.is_optional = is_optional;
      assert_int_equal(try_edit(&mesh, &cut, counts, &error), TW_INVALID);
      assert_memory_equal(error.pointer, "/0/edge", 7);
      assert_int_equal(try_edit(&mesh, &fill, counts, &error), TW_INVALID);
      assert_memory_equal(error.pointer, "/0/border", 9);
    }
}

/* One of each kind, on a mesh that bears all there is. */
TEST(every_failed_allocation_is_told) {
  tw_mesh mesh = cube(), out = {0};
  dressed d = {0};
  dress(&mesh, &d);
  const tw_selection made = {.of = TW_EDIT_FACES, .by = TW_SELECT_MADE, .name = "a"},
                     some = {.of = TW_EDIT_EDGES, .by = TW_SELECT_SHARPER, .degrees = 80};
  const tw_edit edits[] = {
      {.kind = TW_EDIT_CREASE, .selection = some, .sharpness = 2, .name = "b"},
      {.kind = TW_EDIT_CORNER, .selection = LIST(TW_EDIT_VERTICES, 0), .sharpness = 2},
      {.kind = TW_EDIT_HOLE, .selection = LIST(TW_EDIT_FACES, 0), .sharpness = 2},
      {.kind = TW_EDIT_EXTRUDE, .selection = LIST(TW_EDIT_FACES, 1), .name = "a", .extrude.distance = 1},
      {.kind = TW_EDIT_INSET, .selection = made, .name = "a", .inset.amount = 0.25},
      {.kind = TW_EDIT_LOOP_CUT, .loop_cut = {{0, 1}, 1, NULL}},
      {.kind = TW_EDIT_SUBDIVIDE, .selection = made, .subdivide.cuts = 1},
      {.kind = TW_EDIT_MOVE, .selection = made, .move.by = {1, 0, 0}},
      {.kind = TW_EDIT_DELETE, .selection = LIST(TW_EDIT_FACES, 5)},
      {.kind = TW_EDIT_FILL, .fill.method = TW_FILL_TRIANGLES},
      {.kind = TW_EDIT_MERGE, .selection = LIST(TW_EDIT_VERTICES, 0, 1), .merge.distance = -1},
      {.kind = TW_EDIT_MERGE, .selection = {.of = TW_EDIT_VERTICES, .by = TW_SELECT_ALL}},
      {.kind = TW_EDIT_MIRROR, .mirror.weld = 0.1},
      {.kind = TW_EDIT_FLIP},
      {.kind = TW_EDIT_ORIENT},
      {.kind = TW_EDIT_TRIANGULATE},
      {.kind = TW_EDIT_QUADS},
      {.kind = TW_EDIT_DROP_PIECES, .drop_pieces.faces = 2},
      {.kind = TW_EDIT_DESPIKE, .name = "c", .despike.factor = 0.1},
      {.kind = TW_EDIT_SMOOTH, .smooth.iterations = 2}};
  enum { COUNT = sizeof edits / sizeof *edits };
  tw_made names[COUNT];
  uint32_t name_count;
  size_t failures = 0;
  for (tw_status status = TW_NO_MEMORY; status != TW_OK; failures++) {
    tw_arena *arena = tw_arena_create();
    test_memory.left = failures;
    status = tw_mesh_edit(&mesh, NULL, edits, COUNT, &roomy, arena, &out, names, &name_count, NULL, NULL);
    test_memory.left = SIZE_MAX;
    assert_true(status == TW_OK || (status == TW_NO_MEMORY && out.point_count == 0));
    tw_arena_destroy(arena);
  }
  assert_true(failures > 100);
}
