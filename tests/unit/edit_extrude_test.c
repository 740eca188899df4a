/* Extruded and inset faces. */
#include "edited.h"
#include "tweend/shape.h"

static const tw_selection all_faces = {.of = TW_EDIT_FACES, .by = TW_SELECT_ALL};

static tw_edit extrude(tw_selection faces, double distance) {
  return (tw_edit){.kind = TW_EDIT_EXTRUDE, .selection = faces, .name = "deck", .extrude.distance = distance};
}

static tw_edit inset(tw_selection faces, double amount) {
  return (tw_edit){.kind = TW_EDIT_INSET, .selection = faces, .name = "pane", .inset.amount = amount};
}

TEST(lengths_must_be_finite) {
  tw_mesh mesh = cube();
  tw_edit edit = extrude(all_faces, NAN);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/distance");
  edit = inset(all_faces, INFINITY);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/amount");
  edit = extrude((tw_selection)LIST(TW_EDIT_FACES, 1), 2e18);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0");
  edit.extrude.has_by = true;
  edit.extrude.by[1] = NAN;
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0");
}

/* ---- extrude --------------------------------------------------------------------------------- */

TEST(a_face_of_a_cube_gets_walls) {
  tw_mesh mesh = cube();
  edited e = edit_once(&mesh, extrude((tw_selection)LIST(TW_EDIT_FACES, 1), 0.5));
  assert_counts(&e, 12, 20, 10, 0);
  assert_near(volume_of(&e.mesh), 8 + 2);
  /* The face stays in its place, the others as they were; walls come last. */
  assert_memory_equal(e.mesh.corners, cube_corners, 4 * sizeof(uint32_t));
  assert_memory_equal(e.mesh.corners + 8, cube_corners + 8, 16 * sizeof(uint32_t));
  assert_int_equal(e.made[0].face_count, 1);
  assert_int_equal(e.made[0].faces[0], 1);
  for (uint32_t i = 0; i < 4; i++) {
    assert_int_equal(e.made[0].vertices[i], 8 + i);
    assert_true(point_of(&e.mesh, 8 + i)[2] == 1.5f);
  }
  edited_deinit(&e);
}

TEST(a_vector_moves_faces_as_they_are) {
  tw_mesh mesh = cube();
  tw_edit edit_ = extrude((tw_selection)LIST(TW_EDIT_FACES, 1), 0);
  edit_.extrude.has_by = true;
  edit_.extrude.by[0] = 3;
  edit_.extrude.by[2] = 1;
  edited e = edit(&mesh, &edit_, 1);
  assert_near(volume_of(&e.mesh), 8 + 4);
  assert_true(point_of(&e.mesh, 8)[0] == 2 && point_of(&e.mesh, 8)[2] == 2);
  edited_deinit(&e);
}

TEST(neighbours_have_no_wall_between_them) {
  tw_mesh mesh = cube();
  edited e = edit_once(&mesh, extrude((tw_selection)LIST(TW_EDIT_FACES, 1, 4), 0.25));
  assert_counts(&e, 14, 24, 12, 0);
  for (uint32_t p = 8; p < 14; p++) { /* both faces move by the distance */
    const float *at = point_of(&e.mesh, p);
    assert_true(fabsf(at[1] - 1.25f) < 1e-6f || fabsf(at[2] - 1.25f) < 1e-6f);
  }
  assert_near(volume_of(&e.mesh), 2 * 2.25 * 2.25);
  edited_deinit(&e);
}

TEST(a_closed_region_moves_whole) {
  tw_mesh mesh = cube();
  edited e = edit_once(&mesh, extrude(all_faces, 0.5));
  assert_counts(&e, 8, 12, 6, 0);
  assert_memory_equal(e.mesh.corners, cube_corners, sizeof cube_corners);
  assert_near(volume_of(&e.mesh), 27);
  assert_int_equal(e.made[0].vertex_count, 8);
  edited_deinit(&e);
}

TEST(an_open_border_gets_walls) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 3, 3);
  edited e = edit_once(&mesh, extrude(all_faces, 2));
  assert_counts(&e, 16 + 12, 24 + 24, 9 + 12, 12);
  assert_near(area_of(&e.mesh), 9 + 12 * 2);
  assert_true(point_of(&e.mesh, 5)[2] == 2 && point_of(&e.mesh, 0)[2] == 0); /* 5 is inside: it moves */
  edited_deinit(&e);
}

TEST(faces_that_meet_in_a_point_part_there) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 2, 2);
  edited e = edit_once(&mesh, extrude((tw_selection)LIST(TW_EDIT_FACES, 0, 3), 1));
  assert_counts(&e, 9 + 8, 12 + 16, 4 + 8, 8);
  edited_deinit(&e);
}

TEST(each_face_on_its_own) {
  tw_mesh mesh = cube();
  tw_edit edit_ = extrude(all_faces, 0.5);
  edit_.extrude.is_individual = true;
  edited e = edit(&mesh, &edit_, 1);
  assert_counts(&e, 8 + 24, 12 + 48, 6 + 24, 0);
  assert_near(volume_of(&e.mesh), 8 + 6 * 2);
  edited_deinit(&e);
}

TEST(creases_stay_below_and_go_along) {
  tw_mesh mesh = cube();
  tw_edit edits[4] = {{.kind = TW_EDIT_CREASE, .selection = LIST(TW_EDIT_EDGES, 4, 5), .sharpness = 3},
                      {.kind = TW_EDIT_CORNER, .selection = LIST(TW_EDIT_VERTICES, 4), .sharpness = 3},
                      {.kind = TW_EDIT_HOLE, .selection = LIST(TW_EDIT_FACES, 1), .sharpness = 1},
                      extrude((tw_selection)LIST(TW_EDIT_FACES, 1), 1)};
  edited e = edit(&mesh, edits, 4);
  assert_int_equal(e.stats.creases, 2);
  assert_int_equal(e.stats.sharp_points, 2);
  assert_int_equal(e.stats.holes, 1);
  edited_deinit(&e);
}

/* The face's own texture coordinates are as long as it is. */
TEST(walls_lie_unfolded_in_the_texture) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  edited e = edit_once(&mesh, extrude((tw_selection)LIST(TW_EDIT_FACES, 3), 0.5));
  const tw_uv_set *set = &e.mesh.uv_sets[1];
  for (uint32_t f = 6; f < 10; f++) {
    double area = 0;
    for (uint32_t i = 0; i < 4; i++) {
      const float *a = set->values + 2 * set->corners[e.mesh.face_offsets[f] + i],
                  *b = set->values + 2 * set->corners[e.mesh.face_offsets[f] + (i + 1) % 4];
      area += ((double)a[0] * (double)b[1] - (double)a[1] * (double)b[0]) / 2;
    }
    assert_near(area, 1);
    assert_int_equal(e.mesh.face_materials[f], 3);
  }
  assert_int_equal(set->value_count, 24 + 8);
  edited_deinit(&e);
}

/* Each corner of a moved face is by the distance farther along the face's normal. */
static void moves_all_by(const tw_mesh *mesh, double distance) {
  edited e = edit_once(mesh, extrude(all_faces, distance));
  for (uint32_t f = 0; f < mesh->face_count; f++) {
    double normal[3], length = 0;
    const uint32_t *before = mesh->corners + mesh->face_offsets[f],
                   *after = e.mesh.corners + e.mesh.face_offsets[f];
    const float *a = point_of(mesh, before[0]), *b = point_of(mesh, before[1]),
                *c = point_of(mesh, before[2]);
    for (int i = 0; i < 3; i++) {
      int k = (i + 1) % 3, l = (i + 2) % 3;
      normal[i] = ((double)b[k] - (double)a[k]) * ((double)c[l] - (double)a[l]) -
                  ((double)b[l] - (double)a[l]) * ((double)c[k] - (double)a[k]);
      length += normal[i] * normal[i];
    }
    for (uint32_t i = 0; i < mesh->face_offsets[f + 1] - mesh->face_offsets[f]; i++) {
      double along = 0;
      for (int k = 0; k < 3; k++)
        along += normal[k] * ((double)point_of(&e.mesh, after[i])[k] - (double)point_of(mesh, before[i])[k]);
      assert_near(along / sqrt(length), distance);
    }
  }
  edited_deinit(&e);
}

TEST(faces_of_three_planes_move_by_the_distance) {
  tw_arena *arena = tw_arena_create();
  tw_error error;
  for (uint32_t segments = 3; segments <= 24; segments += 7) {
    tw_shape shape;
    tw_mesh mesh;
    tw_shape_init(&shape, TW_SHAPE_CYLINDER);
    shape.segments[0] = segments;
    assert_int_equal(tw_shape_make(&shape, arena, &mesh, &error), TW_OK);
    moves_all_by(&mesh, 0.125);
    moves_all_by(&mesh, -0.25);
  }
  tw_arena_destroy(arena);
  /* An angle of three quads at each end: three planes meet in its inner corner, one with three quads. */
  static const uint32_t quads[3][4] = {{0, 1, 4, 3}, {1, 2, 5, 4}, {3, 4, 7, 6}},
                        ring[8] = {0, 1, 2, 5, 4, 7, 6, 3};
  float points[16][3];
  uint32_t corners[14][4], offsets[15] = {0};
  for (uint32_t p = 0; p < 16; p++) {
    points[p][0] = (float)(p % 8 % 3);
    points[p][1] = (float)(p % 8 / 3);
    points[p][2] = (float)(p / 8);
  }
  for (uint32_t f = 0; f < 14; f++) {
    offsets[f + 1] = 4 * f + 4;
    for (uint32_t i = 0; i < 4; i++) {
      if (f < 6) corners[f][i] = f < 3 ? 8 + quads[f][i] : quads[f - 3][3 - i];
      if (f >= 6) corners[f][i] = ring[(f - 6 + (i == 1 || i == 2)) % 8] + (i > 1 ? 8 : 0);
    }
  }
  const tw_mesh angle = mesh_of(points[0], 16, corners[0], offsets, 14);
  moves_all_by(&angle, 0.25);
}

/* A roof whose ridge ends in a narrow hip: three planes nearly parallel to one line, which meet far aside
 * when they are moved. */
TEST(points_do_not_go_far_aside) {
  const double steep = 0.17, tilt = -0.0045, up = sqrt(1 - steep * steep), over = sqrt(1 - tilt * tilt);
  const double places[6][3] = {
      {0, 0, 0},        {0, 0, 1},      {up * tilt / steep, tilt, -over}, {-up * tilt / steep, tilt, -over},
      {-up, -steep, 0}, {up, -steep, 0}};
  const uint32_t corners[11] = {0, 2, 4, 1, 0, 1, 5, 3, 0, 3, 2}, offsets[4] = {0, 4, 8, 11};
  float points[6][3];
  for (size_t i = 0; i < 18; i++) points[i / 3][i % 3] = (float)places[i / 3][i % 3];
  tw_mesh mesh = mesh_of(points[0], 6, corners, offsets, 3);
  edited e = edit_once(&mesh, extrude(all_faces, 1));
  const float *at = point_of(&e.mesh, e.mesh.corners[0]);
  assert_true(fabsf(at[0]) < 0.01f && fabsf(at[1] - 1) < 0.02f && fabsf(at[2]) < 0.02f);
  edited_deinit(&e);
}

/* The signed area of a face in the first set of texture coordinates. */
static double texture_area(const tw_mesh *mesh, uint32_t face) {
  const tw_uv_set *set = &mesh->uv_sets[0];
  uint32_t begin = mesh->face_offsets[face], end = mesh->face_offsets[face + 1];
  double area = 0;
  for (uint32_t c = begin; c < end; c++) {
    const float *a = set->values + 2 * (size_t)set->corners[c],
                *b = set->values + 2 * (size_t)set->corners[c + 1 < end ? c + 1 : begin];
    area += ((double)a[0] * (double)b[1] - (double)a[1] * (double)b[0]) / 2;
  }
  return area;
}

TEST(walls_between_two_faces_unfold_to_opposite_sides) {
  grid_mesh grid;
  dressed d = {0};
  tw_mesh mesh = grid_of(&grid, 2, 2);
  dress(&mesh, &d);
  tw_edit edit_ = extrude(all_faces, 0.25);
  edit_.extrude.is_individual = true;
  edited e = edit(&mesh, &edit_, 1);
  assert_int_equal(e.mesh.face_count, 4 + 16);
  for (uint32_t f = 4; f < 20; f++) assert_near(texture_area(&e.mesh, f), 0.25);
  edited_deinit(&e);
}

/* A point in the middle of an edge, where a triangle without an area closes the gap between a face above it
 * and two below. */
static const float seam_points[8][3] = {{0, 0, 0}, {0.5f, 0, 0}, {1, 0, 0},     {1, 1, 0},
                                        {0, 1, 0}, {0, -1, 0},   {0.5f, -1, 0}, {1, -1, 0}};
static const uint32_t seam_corners[15] = {0, 2, 3, 4, 0, 1, 2, 5, 6, 1, 0, 6, 7, 2, 1},
                      seam_offsets[5] = {0, 4, 7, 11, 15};

TEST(faces_without_an_area_pull_nowhere) {
  tw_mesh mesh = mesh_of(seam_points[0], 8, seam_corners, seam_offsets, 4);
  edited e = edit_once(&mesh, extrude(all_faces, 0.5));
  assert_int_equal(e.made[0].vertex_count, 8);
  for (uint32_t i = 0; i < 8; i++) assert_true(point_of(&e.mesh, e.made[0].vertices[i])[2] == 0.5f);
  edited_deinit(&e);
  const uint32_t corners[7] = {0, 2, 3, 4, 0, 1, 2}, offsets[3] = {0, 4, 7};
  mesh = mesh_of(seam_points[0], 5, corners, offsets, 2);
  e = edit_once(&mesh, inset(all_faces, 0.25));
  for (uint32_t i = 0; i < e.made[0].vertex_count; i++) {
    const float *at = point_of(&e.mesh, e.made[0].vertices[i]);
    assert_true(at[0] == 0.25f || at[0] == 0.5f || at[0] == 0.75f);
  }
  edited_deinit(&e);
}

/* ---- inset ----------------------------------------------------------------------------------- */

TEST(a_rim_lies_in_its_face) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  edited e = edit_once(&mesh, inset((tw_selection)LIST(TW_EDIT_FACES, 1), 0.25));
  assert_counts(&e, 12, 20, 10, 0);
  assert_near(volume_of(&e.mesh), 8);
  assert_near(area_of(&e.mesh), 24);
  for (uint32_t p = 8; p < 12; p++)
    for (int i = 0; i < 2; i++) assert_true(fabsf(fabsf(point_of(&e.mesh, p)[i]) - 0.75f) < 1e-6f);
  assert_dressed(&e.mesh);
  assert_int_equal(e.mesh.uv_sets[0].value_count, 12);
  assert_int_equal(e.mesh.uv_sets[1].value_count, 28);
  edited_deinit(&e);
}

TEST(neighbours_keep_their_edge) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 4, 4);
  for (uint32_t p = 0; p < 25; p++)
    for (int i = 0; i < 2; i++) grid.points[p][i] = grid.points[p][i] / 2 - 1;
  dressed d = {0};
  dress(&mesh, &d);
  edited e = edit_once(&mesh, inset((tw_selection)LIST(TW_EDIT_FACES, 5, 6, 9, 10), 0.125));
  assert_counts(&e, 25 + 8, 40 + 16, 16 + 8, 16);
  assert_near(area_of(&e.mesh), 4);
  double area = 0;
  for (uint32_t i = 0; i < 4; i++) {
    tw_mesh face = e.mesh;
    face.face_offsets += e.made[0].faces[i];
    face.face_count = 1;
    area += area_of(&face);
  }
  assert_near(area, 0.75 * 0.75);
  assert_dressed(&e.mesh);
  assert_int_equal(e.mesh.uv_sets[0].value_count, 33);
  edited_deinit(&e);
}

TEST(points_amid_a_side_go_with_all_that_they_bear) {
  const float points[6][3] = {{0, 0, 0}, {0.5f, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.25f, 1, 0}, {0, 1, 0}};
  const uint32_t corners[6] = {1, 2, 3, 4, 5, 0}, offsets[2] = {0, 6};
  tw_mesh mesh = mesh_of(points[0], 6, corners, offsets, 1);
  dressed d = {0};
  dress(&mesh, &d);
  /* In the plane of the face the sum of all weights stays 1; values of corners that are no texture
   * coordinates do not go beyond what the face has. */
  mesh.attribute_count = 2;
  edited e = edit_once(&mesh, inset(all_faces, 0.125));
  assert_near(area_of(&e.mesh), 1);
  for (uint32_t i = 0; i < e.made[0].vertex_count; i++) {
    uint32_t p = e.made[0].vertices[i];
    const float *at = point_of(&e.mesh, p);
    assert_true(at[1] == 0.125f || at[1] == 0.875f);
    assert_near((double)e.mesh.attributes[0].values[p], weight_at(at));
    assert_near((double)e.mesh.morphs[0][3 * p], (double)at[1]);
  }
  for (uint32_t c = 0; c < e.mesh.corner_count; c++) {
    const float *at = point_of(&e.mesh, e.mesh.corners[c]);
    const float *uv = e.mesh.uv_sets[0].values + 2 * e.mesh.uv_sets[0].corners[c];
    assert_near((double)uv[0], (double)at[0]);
    assert_near((double)uv[1], (double)at[1]);
  }
  edited_deinit(&e);
}

TEST(weights_of_joints_go_on_beyond_a_face) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 2, 2);
  for (uint32_t p = 0; p < 9; p++)
    for (int i = 0; i < 2; i++) grid.points[p][i] -= 1;
  dressed d = {0};
  dress(&mesh, &d);
  /* The middle point moves into face 3, past the sides of face 1, whose plane its mean is of. */
  edited e = edit_once(&mesh, inset((tw_selection)LIST(TW_EDIT_FACES, 1, 2, 3), 0.25));
  for (uint32_t p = 0; p < e.mesh.point_count; p++) {
    double sum = 0;
    for (uint32_t i = 8 * p; i < 8 * p + 8; i++)
      if (e.mesh.skin.joints[i] == 3) sum += (double)e.mesh.skin.weights[i];
    assert_near(sum, share_at(point_of(&e.mesh, p)));
  }
  edited_deinit(&e);
}

/* Values of corners that are one at a point stay one: where a face has the point within, its mean is all
 * faces'. */
TEST(colours_of_corners_have_no_seam_at_concave_corners) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 2, 2);
  const tw_attribute joined = {.name = "_JOINED",
                               .width = 3,
                               .values = mesh.positions,
                               .value_count = mesh.point_count,
                               .corners = mesh.corners};
  mesh.attribute_count = 1;
  mesh.attributes = &joined;
  edited e = edit_once(&mesh, inset((tw_selection)LIST(TW_EDIT_FACES, 1, 2, 3), 0.25));
  uint32_t corners = 0;
  for (uint32_t c = 0; c < e.mesh.corner_count; c++) {
    const float *at = point_of(&e.mesh, e.mesh.corners[c]);
    if (at[0] != 1.25f || at[1] != 1.25f) continue;
    const tw_attribute *own = &e.mesh.attributes[0];
    for (uint32_t i = 0; i < 3; i++) assert_near((double)own->values[3 * own->corners[c] + i], (double)at[i]);
    corners++;
  }
  assert_int_equal(corners, 5); /* of three inner faces and two of the rim */
  edited_deinit(&e);
}

TEST(a_rim_runs_over_the_edges_of_a_box) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  edited e = edit_once(&mesh, inset((tw_selection)LIST(TW_EDIT_FACES, 1, 4), 0.25));
  assert_counts(&e, 14, 24, 12, 0);
  assert_near(volume_of(&e.mesh), 8);
  assert_near(area_of(&e.mesh), 24);
  assert_dressed(&e.mesh);
  assert_int_equal(e.mesh.uv_sets[0].value_count, 14);
  edited_deinit(&e);
}

TEST(rims_of_each_face) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  tw_edit edit_ = inset(all_faces, 0.5);
  edit_.inset.is_individual = true;
  edited e = edit(&mesh, &edit_, 1);
  assert_counts(&e, 8 + 24, 12 + 48, 6 + 24, 0);
  assert_near(area_of(&e.mesh), 24);
  assert_dressed(&e.mesh);
  edited_deinit(&e);
}

TEST(made_faces_and_rims_have_the_name) {
  tw_mesh mesh = cube();
  const tw_selection deck = {.of = TW_EDIT_FACES, .by = TW_SELECT_MADE, .name = "deck"},
                     rim = {.of = TW_EDIT_EDGES, .by = TW_SELECT_MADE, .name = "pane"};
  tw_edit edits[4] = {extrude((tw_selection)LIST(TW_EDIT_FACES, 1), 0.5),
                      inset(deck, 0.25),
                      extrude(deck, -0.25),
                      {.kind = TW_EDIT_CREASE, .selection = rim, .sharpness = 2}};
  edited e = edit(&mesh, edits, 4);
  assert_counts(&e, 20, 36, 18, 0);
  assert_near(volume_of(&e.mesh), 8 + 2 - 1.5 * 1.5 * 0.25);
  assert_int_equal(e.stats.creases, 8); /* the rim of the pane, above and below its walls */
  edited_deinit(&e);
}

TEST(an_inset_of_all_that_is_closed_changes_nothing) {
  tw_mesh mesh = cube();
  edited e = edit_once(&mesh, inset(all_faces, 0.5));
  assert_counts(&e, 8, 12, 6, 0);
  assert_memory_equal(e.mesh.positions, mesh.positions, 24 * sizeof(float));
  edited_deinit(&e);
}
