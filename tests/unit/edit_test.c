/* Lists of edits: selections, what moves points, tags, names, limits. */
#include "edited.h"
#include "host.h"
#include "tweend/shape.h"

static const tw_selection all_faces = {.of = TW_EDIT_FACES, .by = TW_SELECT_ALL};
static const tw_selection all_edges = {.of = TW_EDIT_EDGES, .by = TW_SELECT_ALL};
static const tw_selection all_vertices = {.of = TW_EDIT_VERTICES, .by = TW_SELECT_ALL};

/* ---- refused --------------------------------------------------------------------------------- */

#define FACES(how, ...)                                                                                      \
  { .of = TW_EDIT_FACES, .by = how, __VA_ARGS__ }
#define EDGES(how, ...)                                                                                      \
  { .of = TW_EDIT_EDGES, .by = how, __VA_ARGS__ }
#define VERTICES(how, ...)                                                                                   \
  { .of = TW_EDIT_VERTICES, .by = how, __VA_ARGS__ }

TEST(wrong_selections_are_refused_where_they_stand) {
  const struct {
    tw_edit_kind kind;
    tw_selection selection;
    const char *pointer;
  } cases[] = {
      /* out of range */
      {TW_EDIT_MOVE, LIST(TW_EDIT_FACES, 0, 5, 6), "/1/faces/2"},
      {TW_EDIT_MOVE, LIST(TW_EDIT_VERTICES, 8), "/1/vertices/0"},
      {TW_EDIT_CREASE, LIST(TW_EDIT_EDGES, 0, 1, 1, 8), "/1/edges/1/1"},
      {TW_EDIT_CREASE, LIST(TW_EDIT_EDGES, UINT32_MAX, 1), "/1/edges/0/0"},
      /* points that no face joins */
      {TW_EDIT_CREASE, LIST(TW_EDIT_EDGES, 0, 1, 0, 6), "/1/edges/1"},
      {TW_EDIT_CREASE, LIST(TW_EDIT_EDGES, 0, 0), "/1/edges/0"},
      /* empty */
      {TW_EDIT_MOVE, FACES(TW_SELECT_INSIDE, .min = {2, 2, 2}, .max = {3, 3, 3}), "/1/faces"},
      {TW_EDIT_MOVE, VERTICES(TW_SELECT_LIST, .count = 0), "/1/vertices"},
      {TW_EDIT_CREASE, EDGES(TW_SELECT_BORDER, .count = 0), "/1/edges"},
      {TW_EDIT_CREASE, EDGES(TW_SELECT_SHARPER, .degrees = 90), "/1/edges"}, /* reached, not passed */
      {TW_EDIT_MOVE, {.by = TW_SELECT_NOTHING}, "/1"},
      /* names that nothing has */
      {TW_EDIT_MOVE, FACES(TW_SELECT_MADE, .name = "deck"), "/1/faces/made"},
      {TW_EDIT_MOVE, FACES(TW_SELECT_GROUP, .name = "deck"), "/1/faces/group"},
      {TW_EDIT_MOVE, FACES(TW_SELECT_MATERIAL, .count = 0), "/1/faces/material"},
      /* directions and angles */
      {TW_EDIT_MOVE, FACES(TW_SELECT_FACING, .degrees = 10), "/1/faces/facing"},
      {TW_EDIT_MOVE, FACES(TW_SELECT_FACING, .degrees = 10, .direction = {NAN, 0, 0}), "/1/faces/facing"},
      {TW_EDIT_MOVE, FACES(TW_SELECT_FACING, .degrees = 181, .direction = {1, 0, 0}), "/1/faces/within"},
      {TW_EDIT_CREASE, EDGES(TW_SELECT_SHARPER, .degrees = NAN), "/1/edges/sharper_than"},
      /* what an edit is not applied to */
      {TW_EDIT_CREASE, FACES(TW_SELECT_ALL, .count = 0), "/1/faces"},
      {TW_EDIT_CORNER, EDGES(TW_SELECT_ALL, .count = 0), "/1/edges"},
      {TW_EDIT_HOLE, VERTICES(TW_SELECT_ALL, .count = 0), "/1/vertices"},
      {TW_EDIT_MOVE, VERTICES(TW_SELECT_BORDER, .count = 0), "/1/vertices"},
  };
  tw_mesh mesh = cube();
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    const tw_edit edits[2] = {{.kind = TW_EDIT_MOVE, .selection = all_faces},
                              {.kind = cases[i].kind, .selection = cases[i].selection}};
    edit_refused(&mesh, edits, 2, TW_INVALID, cases[i].pointer);
  }
}

TEST(optional_edits_may_find_nothing) {
  tw_mesh mesh = cube();
  tw_edit move = {.kind = TW_EDIT_MOVE,
                  .selection = {.of = TW_EDIT_EDGES, .by = TW_SELECT_BORDER},
                  .is_optional = true,
                  .name = "rim",
                  .move.by = {1, 0, 0}};
  edited e = edit(&mesh, &move, 1);
  assert_memory_equal(e.mesh.positions, mesh.positions, 24 * sizeof(float));
  assert_int_equal(e.made_count, 1);
  assert_int_equal(e.made[0].face_count + e.made[0].vertex_count, 0);
  edited_deinit(&e);
}

TEST(points_stay_where_float_can_hold_them) {
  tw_mesh mesh = cube();
  tw_edit move = {.kind = TW_EDIT_MOVE, .selection = all_faces, .move.by = {0, 2e18, 0}};
  edit_refused(&mesh, &move, 1, TW_INVALID, "/0");
  move.move.by[1] = NAN;
  edit_refused(&mesh, &move, 1, TW_INVALID, "/0");
  tw_edit turn = {.kind = TW_EDIT_ROTATE, .selection = all_faces, .rotate.degrees = 30};
  edit_refused(&mesh, &turn, 1, TW_INVALID, "/0/axis");
  tw_edit crease = {.kind = TW_EDIT_CREASE, .selection = all_edges, .sharpness = 11};
  edit_refused(&mesh, &crease, 1, TW_INVALID, "/0/sharpness");
}

TEST(too_much_work_is_refused) {
  tw_mesh mesh = cube(), out;
  tw_edit edits[4];
  tw_arena *arena = tw_arena_create();
  tw_error error = {0};
  const tw_edit_limits limits = {.points = 100, .faces = 100, .corners = 100, .work = 3 * 32};
  for (int i = 0; i < 4; i++) edits[i] = (tw_edit){.kind = TW_EDIT_MOVE, .selection = all_faces};
  assert_int_equal(tw_mesh_edit(&mesh, NULL, edits, 3, &limits, arena, &out, NULL, NULL, NULL, &error),
                   TW_OK);
  assert_int_equal(tw_mesh_edit(&mesh, NULL, edits, 4, &limits, arena, &out, NULL, NULL, NULL, &error),
                   TW_LIMIT);
  assert_string_equal(error.pointer, "/3");
  tw_edit smooth = {.kind = TW_EDIT_SMOOTH, .smooth.iterations = 29};
  assert_int_equal(tw_mesh_edit(&mesh, NULL, &smooth, 1, &limits, arena, &out, NULL, NULL, NULL, &error),
                   TW_OK);
  smooth.smooth.iterations = 30;
  assert_int_equal(tw_mesh_edit(&mesh, NULL, &smooth, 1, &limits, arena, &out, NULL, NULL, NULL, &error),
                   TW_LIMIT);
  tw_arena_destroy(arena);
}

/* Asserts that the edits ask that often whether the result is still wanted, and end where it is not. */
static void asks(const tw_mesh *mesh, const tw_edit *edits, uint32_t count, uint32_t times) {
  for (uint32_t wanted = 0; wanted <= times; wanted++) {
    uint32_t left = wanted;
    const tw_parallel_for parallel = {.owner = &left, .is_cancelled = wants_no_more};
    tw_edit_limits limits = roomy;
    limits.parallel = &parallel;
    tw_mesh out;
    tw_error error = {0};
    tw_arena *arena = tw_arena_create();
    tw_status status = tw_mesh_edit(mesh, NULL, edits, count, &limits, arena, &out, NULL, NULL, NULL, &error);
    assert_int_equal(status, wanted < times ? TW_CANCELLED : TW_OK);
    assert_int_equal(error.status, status);
    tw_arena_destroy(arena);
  }
}

TEST(edits_that_nobody_wants_any_more_end) {
  const tw_mesh mesh = cube();
  const uint32_t face = 0;
  const tw_edit move = {.kind = TW_EDIT_MOVE, .selection = all_faces}, moves[] = {move, move, move};
  const tw_edit smooth = {.kind = TW_EDIT_SMOOTH, .smooth.iterations = 4};
  const tw_edit close[] = {
      {.kind = TW_EDIT_DELETE,
       .selection = {.of = TW_EDIT_FACES, .by = TW_SELECT_LIST, .count = 1, .indices = &face}},
      {.kind = TW_EDIT_FILL, .fill.method = TW_FILL_TRIANGLES}};
  asks(&mesh, moves, 3, 3);
  asks(&mesh, &smooth, 1, 5); /* before the edit, and before each round */
  asks(&mesh, close, 2, 3);   /* before each edit, and before the hole */
}

TEST(cutting_large_faces_asks_on_its_way) {
  tw_shape tube;
  tw_mesh mesh;
  tw_arena *arena = tw_arena_create();
  const tw_edit cut = {.kind = TW_EDIT_TRIANGULATE};
  tw_shape_init(&tube, TW_SHAPE_CYLINDER);
  tube.segments[0] = 1500;
  tube.caps = TW_CAPS_NGON;
  assert_int_equal(tw_shape_make(&tube, arena, &mesh, NULL), TW_OK);
  asks(&mesh, &cut, 1, 1 + 2 * 2); /* before the edit, and for each cap before the first ear and the 1024th */
  tw_arena_destroy(arena);
}

/* How often somebody asks who goes on wanting. */
static uint32_t count_questions(const tw_mesh *mesh, const tw_edit *edits, uint32_t count) {
  uint32_t left = UINT32_MAX, made_count;
  const tw_parallel_for parallel = {.owner = &left, .is_cancelled = wants_no_more};
  const tw_edit_limits limits = {20000, 20000, 80000, 800000, &parallel};
  tw_mesh out;
  tw_made made[2];
  tw_error error = {0};
  tw_arena *arena = tw_arena_create();
  if (tw_mesh_edit(mesh, NULL, edits, count, &limits, arena, &out, made, &made_count, NULL, &error) != TW_OK)
    fail_msg("%s", error.detail);
  tw_arena_destroy(arena);
  return UINT32_MAX - left;
}

/* A tube with two borders. Each hole is covered in halves of halves; or it is refined in rounds, and bent in
 * steps. */
TEST(filling_a_great_hole_asks_on_its_way) {
  tw_shape tube;
  tw_mesh mesh;
  tw_arena *arena = tw_arena_create();
  tw_shape_init(&tube, TW_SHAPE_CYLINDER);
  tube.segments[0] = 1500;
  tube.caps = TW_CAPS_NONE;
  tube.height = 0.01F;
  assert_int_equal(tw_shape_make(&tube, arena, &mesh, NULL), TW_OK);
  tw_edit fill = {.kind = TW_EDIT_FILL, .fill.method = TW_FILL_TRIANGLES};
  assert_true(count_questions(&mesh, &fill, 1) >= 1 + 2 * (1 + 7));
  tube.segments[0] = 40;
  tube.height = 0.2F;
  assert_int_equal(tw_shape_make(&tube, arena, &mesh, NULL), TW_OK);
  fill.fill.method = TW_FILL_FAIR;
  assert_true(count_questions(&mesh, &fill, 1) > 1 + 2 * (1 + 1 + 3 + 20));
  tw_arena_destroy(arena);
}

/* ---- selections ------------------------------------------------------------------------------ */

/* What a name then means of a selection's. */
TEST(selections_of_a_cube) {
  const uint32_t edge[2] = {0, 1};
  const struct {
    tw_selection selection;
    uint32_t faces, vertices;
  } cases[] = {{all_faces, 6, 8},
               {all_edges, 0, 8},
               {all_vertices, 0, 8},
               {LIST(TW_EDIT_FACES, 2, 2), 1, 4},
               {FACES(TW_SELECT_FACING, .direction = {0, 3, 0}), 1, 4},
               {FACES(TW_SELECT_FACING, .direction = {0, 1, 0}, .degrees = 90), 5, 8},
               {FACES(TW_SELECT_INSIDE, .min = {-1, 1, -1}, .max = {1, 1, 1}), 1, 4},
               {EDGES(TW_SELECT_INSIDE, .min = {-1, 1, 1}, .max = {1, 1, 1}), 0, 2},
               {EDGES(TW_SELECT_SHARPER, .degrees = 89), 0, 8},
               {EDGES(TW_SELECT_RING, .indices = edge), 0, 8},
               {EDGES(TW_SELECT_LOOP, .indices = edge), 0, 2}};
  tw_mesh mesh = cube();
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    edited e =
        edit_once(&mesh, (tw_edit){.kind = TW_EDIT_MOVE, .selection = cases[i].selection, .name = "it"});
    assert_int_equal(e.made_count, 1);
    assert_string_equal(e.made[0].name, "it");
    assert_int_equal(e.made[0].face_count, cases[i].faces);
    assert_int_equal(e.made[0].vertex_count, cases[i].vertices);
    edited_deinit(&e);
  }
}

TEST(points_on_the_sides_of_a_box_are_inside) {
  tw_mesh mesh = cube();
  float points[24];
  for (int i = 0; i < 24; i++) points[i] = mesh.positions[i] > 0 ? 0.1F : -0.7F; /* neither is a double's */
  mesh.positions = points;
  edited e = edit_once(&mesh, (tw_edit){.kind = TW_EDIT_MOVE,
                                        .selection = FACES(TW_SELECT_INSIDE, .min = {-0.7, -0.7, -0.7},
                                                           .max = {0.1, 0.1, 0.1}),
                                        .name = "it"});
  assert_int_equal(e.made[0].face_count, 6);
  edited_deinit(&e);
}

TEST(groups_and_materials_are_found_by_their_names) {
  tw_mesh mesh = cube();
  const uint32_t groups[6] = {0, 1, 2, UINT32_MAX, 1, 1};
  const int32_t materials[6] = {0, 1, -1, 2, 1, 1};
  const char *group_names[3] = {"hull", "hull deck", "hul"}, *material_names[2] = {"steel", "steel"};
  const tw_material_slot slot = {.material = 0};
  const tw_model model = {.group_count = 3,
                          .group_names = group_names,
                          .material_count = 2,
                          .material_names = material_names,
                          .slot_count = 1,
                          .slots = &slot};
  mesh.face_groups = groups;
  mesh.face_materials = materials;
  const struct {
    tw_selection selection;
    uint32_t faces;
  } cases[] = {{{.of = TW_EDIT_FACES, .by = TW_SELECT_GROUP, .name = "hull"}, 4},
               {{.of = TW_EDIT_FACES, .by = TW_SELECT_GROUP, .name = "deck"}, 3},
               {{.of = TW_EDIT_FACES, .by = TW_SELECT_GROUP, .name = "hul"}, 1},
               {{.of = TW_EDIT_FACES, .by = TW_SELECT_MATERIAL, .name = "steel"}, 5},
               {{.of = TW_EDIT_FACES, .by = TW_SELECT_MATERIAL, .material = 0}, 2}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    tw_edit move = {.kind = TW_EDIT_MOVE, .selection = cases[i].selection, .name = "it"};
    edited e = edit_with(&mesh, &model, &move, 1);
    assert_int_equal(e.made[0].face_count, cases[i].faces);
    edited_deinit(&e);
  }
}

/* ---- moved points ---------------------------------------------------------------------------- */

TEST(a_quarter_turn_takes_x_to_y) {
  tw_mesh mesh = cube();
  tw_edit turn = {.kind = TW_EDIT_ROTATE,
                  .selection = all_vertices,
                  .rotate = {.axis = {0, 0, 7}, .degrees = 90, .has_about = true, .about = {1, -1, 0}}};
  edited e = edit(&mesh, &turn, 1);
  for (uint32_t p = 0; p < 8; p++) {
    const float *from = point_of(&mesh, p), *to = point_of(&e.mesh, p);
    assert_true(fabsf(to[0] - (1 - (from[1] + 1))) < 1e-6f);
    assert_true(fabsf(to[1] - (-1 + (from[0] - 1))) < 1e-6f);
    assert_true(to[2] == from[2]);
  }
  edited_deinit(&e);
}

TEST(scale_is_about_the_mean_of_the_vertices) {
  tw_mesh mesh = cube();
  tw_edit edits[2] = {{.kind = TW_EDIT_MOVE, .selection = all_faces, .move.by = {5, 6, 7}},
                      {.kind = TW_EDIT_SCALE, .selection = all_faces, .scale.by = {2, 3, -1}}};
  edited e = edit(&mesh, edits, 2);
  for (uint32_t p = 0; p < 8; p++) {
    const float *from = point_of(&mesh, p), *to = point_of(&e.mesh, p);
    assert_true(to[0] == 5 + 2 * from[0] && to[1] == 6 + 3 * from[1] && to[2] == 7 - from[2]);
  }
  edited_deinit(&e);
}

/* Turning and scaling after a morph target, or before it, is the same. */
TEST(morph_targets_turn_and_scale_with_their_points) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d), posed = mesh;
  float points[8][3];
  const tw_edit edits[2] = {
      {.kind = TW_EDIT_ROTATE,
       .selection = LIST(TW_EDIT_VERTICES, 0, 1, 2, 3, 6),
       .rotate = {.axis = {1, 2, 3}, .degrees = 50, .has_about = true, .about = {1, -1, 0}}},
      {.kind = TW_EDIT_SCALE,
       .selection = LIST(TW_EDIT_VERTICES, 1, 4, 6),
       .scale = {.by = {2, -0.5, 3}, .has_about = true, .about = {3, 1, 2}}}};
  for (uint32_t p = 0; p < 8; p++)
    for (int i = 0; i < 3; i++) points[p][i] = cube_points[p][i] + d.morph[p][i];
  posed.positions = points[0];
  edited before = edit(&mesh, edits, 2), after = edit(&posed, edits, 2);
  for (uint32_t p = 0; p < 8; p++)
    for (int i = 0; i < 3; i++)
      assert_near((double)(point_of(&before.mesh, p)[i] + before.mesh.morphs[0][3 * p + (uint32_t)i]),
                  (double)point_of(&after.mesh, p)[i]);
  assert_memory_equal(d.morph[5], before.mesh.morphs[0] + 15, 3 * sizeof(float));
  edited_deinit(&before);
  edited_deinit(&after);
  const tw_edit far[1] = {{.kind = TW_EDIT_SCALE, .selection = all_vertices, .scale.by = {1e30, 1, 1}}};
  for (uint32_t p = 0; p < 8; p++) points[p][0] = 0; /* the displacements alone go too far */
  edit_refused(&posed, far, 1, TW_INVALID, "/0");
}

TEST(moved_points_have_no_normals_of_before) {
  tw_mesh mesh = cube();
  const float normal[3] = {0, 0, 1};
  const uint32_t corners[24] = {0};
  mesh.normals = (tw_corner_normals){.value_count = 1, .values = normal, .corners = corners};
  tw_edit edits[2] = {{.kind = TW_EDIT_CREASE, .selection = all_edges, .sharpness = 1},
                      {.kind = TW_EDIT_MOVE, .selection = all_faces, .move.by = {1, 1, 1}}};
  edited e = edit(&mesh, edits, 1);
  assert_non_null(e.mesh.normals.corners);
  edited_deinit(&e);
  e = edit(&mesh, edits, 2);
  assert_null(e.mesh.normals.corners);
  edited_deinit(&e);
}

/* ---- tags ------------------------------------------------------------------------------------ */

TEST(tags_replace_those_of_before) {
  tw_mesh mesh = cube();
  const uint32_t creases[4] = {0, 1, 6, 7}, sharp[1] = {3}, holes[1] = {5};
  const float crease_sharpness[2] = {1, 2}, point_sharpness[1] = {4};
  mesh.crease_count = 2;
  mesh.crease_edges = creases;
  mesh.crease_sharpness = crease_sharpness;
  mesh.sharp_point_count = mesh.hole_count = 1;
  mesh.sharp_points = sharp;
  mesh.point_sharpness = point_sharpness;
  mesh.holes = holes;
  tw_edit edits[3] = {
      {.kind = TW_EDIT_CREASE, .selection = LIST(TW_EDIT_EDGES, 1, 0, 1, 2), .sharpness = 2.5},
      {.kind = TW_EDIT_CORNER, .selection = LIST(TW_EDIT_VERTICES, 3, 5), .sharpness = 3},
      {.kind = TW_EDIT_HOLE, .selection = LIST(TW_EDIT_FACES, 2), .sharpness = 10}};
  edited e = edit(&mesh, edits, 3);
  assert_int_equal(e.mesh.crease_count, 3);
  for (uint32_t i = 0; i < 3; i++) {
    const uint32_t *ends = e.mesh.crease_edges + 2 * i;
    assert_true(e.mesh.crease_sharpness[i] == (ends[0] == 6 ? 2 : 2.5f));
  }
  assert_int_equal(e.mesh.sharp_point_count, 2);
  assert_true(e.mesh.point_sharpness[0] == 3 && e.mesh.point_sharpness[1] == 3);
  assert_int_equal(e.mesh.hole_count, 2);
  edited_deinit(&e);
  for (int i = 0; i < 3; i++) edits[i].sharpness = 0;
  e = edit(&mesh, edits, 3);
  assert_int_equal(e.mesh.crease_count, 1);
  assert_int_equal(e.mesh.sharp_point_count, 0);
  assert_int_equal(e.mesh.hole_count, 1);
  edited_deinit(&e);
}

TEST(no_edits_leave_the_mesh_as_it_is) {
  tw_mesh mesh = cube();
  edited e = edit(&mesh, NULL, 0);
  assert_ptr_equal(e.mesh.positions, mesh.positions);
  edited_deinit(&e);
}
