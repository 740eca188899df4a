/* Edits that take faces away, add them, or wind and cut them otherwise. */
#include "edited.h"

static const tw_selection all_faces = {.of = TW_EDIT_FACES, .by = TW_SELECT_ALL};
static const tw_selection all_vertices = {.of = TW_EDIT_VERTICES, .by = TW_SELECT_ALL};

/* ---- delete ---------------------------------------------------------------------------------- */

static tw_edit delete (tw_selection selection) {
  return (tw_edit){.kind = TW_EDIT_DELETE, .selection = selection, .name = "gone"};
}

TEST(a_deleted_face_leaves_a_hole) {
  tw_mesh mesh = cube();
  edited e = edit_once(&mesh, delete ((tw_selection)LIST(TW_EDIT_FACES, 1)));
  assert_counts(&e, 8, 12, 5, 4);
  assert_memory_equal(e.mesh.corners, cube_corners, 4 * sizeof(uint32_t));
  assert_memory_equal(e.mesh.corners + 4, cube_corners + 8, 16 * sizeof(uint32_t));
  assert_int_equal(e.made[0].face_count + e.made[0].vertex_count, 0);
  edited_deinit(&e);
}

TEST(points_without_a_face_go_with_the_last_one) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 2, 1);
  edited e = edit_once(&mesh, delete ((tw_selection)LIST(TW_EDIT_FACES, 0)));
  assert_counts(&e, 4, 4, 1, 4);
  assert_int_equal(e.mesh.point_count, 4);
  assert_true(point_of(&e.mesh, 0)[0] == 1);
  edited_deinit(&e);
}

TEST(loose_points_stay) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 2, 1);
  mesh.face_count = 1;
  mesh.corner_count = 4;
  tw_edit edit_ = delete ((tw_selection)LIST(TW_EDIT_FACES, 0));
  edited e = edit(&mesh, &edit_, 1);
  assert_int_equal(e.mesh.point_count, 2);
  edited_deinit(&e);
  edit_ = delete (all_vertices);
  e = edit(&mesh, &edit_, 1);
  assert_int_equal(e.mesh.point_count, 0);
  edited_deinit(&e);
}

TEST(edges_and_vertices_take_their_faces_along) {
  tw_mesh mesh = cube();
  tw_edit edge = delete ((tw_selection)LIST(TW_EDIT_EDGES, 0, 1)),
          vertex = delete ((tw_selection)LIST(TW_EDIT_VERTICES, 0));
  edited e = edit(&mesh, &edge, 1);
  assert_counts(&e, 8, 11, 4, 6);
  edited_deinit(&e);
  e = edit(&mesh, &vertex, 1);
  assert_counts(&e, 7, 9, 3, 6);
  edited_deinit(&e);
}

/* ---- merge ----------------------------------------------------------------------------------- */

static tw_edit merge(tw_selection vertices, double distance) {
  return (tw_edit){.kind = TW_EDIT_MERGE, .selection = vertices, .name = "one", .merge.distance = distance};
}

TEST(a_merged_face_is_a_point) {
  tw_mesh mesh = cube();
  tw_edit edit_ = merge((tw_selection)LIST(TW_EDIT_VERTICES, 4, 5, 6, 7), -1);
  edited e = edit(&mesh, &edit_, 1);
  assert_counts(&e, 5, 8, 5, 0); /* a pyramid */
  assert_near(volume_of(&e.mesh), 4 * 2.0 / 3);
  assert_int_equal(e.made[0].vertex_count, 1);
  assert_int_equal(e.made[0].vertices[0], 4);
  assert_true(point_of(&e.mesh, 4)[0] == 0 && point_of(&e.mesh, 4)[2] == 1);
  edited_deinit(&e);
  edit_.merge.has_to = true;
  edit_.merge.to[2] = 5;
  e = edit(&mesh, &edit_, 1);
  assert_near(volume_of(&e.mesh), 4 * 6.0 / 3);
  edited_deinit(&e);
}

TEST(merged_points_go_exactly_to_the_place) {
  const float points[4][3] = {{1e7f, 0, 0}, {12345679, 1, 0}, {0, 0, 0}, {5, 5, 5}}; /* of no float's mean */
  const uint32_t corners[6] = {0, 2, 3, 1, 3, 2}, offsets[3] = {0, 3, 6};
  tw_mesh mesh = mesh_of(points[0], 4, corners, offsets, 2);
  tw_edit edit_ = merge((tw_selection)LIST(TW_EDIT_VERTICES, 0, 1), -1);
  edit_.merge.has_to = true;
  const double to[3] = {0.1, 0.3, 0.7};
  memcpy(edit_.merge.to, to, sizeof to);
  edited e = edit(&mesh, &edit_, 1);
  for (int i = 0; i < 3; i++) assert_true(point_of(&e.mesh, 0)[i] == (float)to[i]);
  edited_deinit(&e);
}

TEST(points_of_tiny_meshes_are_merged_within_the_distance_alone) {
  const double distances[4] = {1e-300, 1e-16, 2e-15, 1e-12};
  const uint32_t left[4] = {9, 9, 8, 0};
  for (size_t i = 0; i < 4; i++) {
    float points[9][3];
    uint32_t corners[24];
    memcpy(points, cube_points, sizeof cube_points);
    memcpy(points[8], cube_points[6], sizeof points[8]);
    memcpy(corners, cube_corners, sizeof corners);
    corners[6] = 8; /* of one face, a hundredth of an edge away */
    points[8][0] = 1.02f;
    for (size_t k = 0; k < 27; k++) points[k / 3][k % 3] *= 5e-14f;
    tw_mesh mesh = mesh_of(points[0], 9, corners, cube_offsets, 6);
    edited e =
        edit_once(&mesh, merge((tw_selection){.of = TW_EDIT_VERTICES, .by = TW_SELECT_ALL}, distances[i]));
    assert_int_equal(e.stats.vertices, left[i]);
    edited_deinit(&e);
  }
}

TEST(loose_quads_become_one_surface_by_distance) {
  float points[24][3];
  uint32_t corners[24];
  for (uint32_t c = 0; c < 24; c++) {
    memcpy(points[c], cube_points[cube_corners[c]], sizeof points[c]);
    corners[c] = c;
  }
  tw_mesh mesh = mesh_of(points[0], 24, corners, cube_offsets, 6);
  tw_edit edit_ = merge(all_vertices, 0);
  edited e = edit(&mesh, &edit_, 1);
  assert_counts(&e, 8, 12, 6, 0);
  edited_deinit(&e);
  points[3][0] += 1e-3f;
  e = edit(&mesh, &edit_, 1);
  assert_int_equal(e.mesh.point_count, 9);
  edited_deinit(&e);
  edit_.merge.distance = 1e-2;
  e = edit(&mesh, &edit_, 1);
  assert_counts(&e, 8, 12, 6, 0);
  edited_deinit(&e);
  edit_.merge.distance = 1e-300;
  e = edit(&mesh, &edit_, 1);
  assert_int_equal(e.mesh.point_count, 9);
  edited_deinit(&e);
  edit_.merge.distance = NAN;
  edit_refused(&mesh, &edit_, 1, TW_INVALID, "/0/distance");
}

TEST(a_crease_stays_where_its_ends_do) {
  tw_mesh mesh = cube();
  tw_edit edits[2] = {
      {.kind = TW_EDIT_CREASE, .selection = LIST(TW_EDIT_EDGES, 0, 4, 1, 5, 4, 5, 0, 1), .sharpness = 1},
      merge((tw_selection)LIST(TW_EDIT_VERTICES, 4, 5), -1)};
  edited e = edit(&mesh, edits, 2);
  assert_counts(&e, 7, 11, 6, 0);
  assert_int_equal(e.stats.creases, 3);
  edited_deinit(&e);
}

/* The same rule as for creases that become one: the greatest sharpness stays, whichever point is the first.
 */
TEST(a_sharp_point_stays_sharp_where_it_is_merged) {
  tw_mesh mesh = cube();
  for (uint32_t sharper = 4; sharper <= 5; sharper++) {
    tw_edit edits[3] = {
        {.kind = TW_EDIT_CORNER, .selection = LIST(TW_EDIT_VERTICES, 4, 5), .sharpness = 1},
        {.kind = TW_EDIT_CORNER, .selection = LIST(TW_EDIT_VERTICES, sharper), .sharpness = 3},
        merge((tw_selection)LIST(TW_EDIT_VERTICES, 4, 5), -1)};
    for (int by_distance = 0; by_distance < 2; by_distance++) {
      edits[2].merge.distance = by_distance ? 2 : -1;
      edited e = edit(&mesh, edits, 3);
      assert_counts(&e, 7, 11, 6, 0);
      assert_int_equal(e.mesh.sharp_point_count, 1);
      assert_int_equal(e.mesh.sharp_points[0], 4);
      assert_true(e.mesh.point_sharpness[0] == 3);
      edited_deinit(&e);
    }
  }
}

/* What was named 4, 5 and 6 is, as 4 and 5 are one, 4 and 5. */
TEST(points_that_move_otherwise_are_counted_where_they_are_merged) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  tw_edit edit_ = merge((tw_selection)LIST(TW_EDIT_VERTICES, 4, 5, 6, 7), 10);
  edited e = edit_once(&mesh, edit_);
  assert_int_equal(e.losses.bent, 3); /* dress gives all corners of the cube weights of their own */
  edited_deinit(&e);
  for (uint32_t p = 0; p < 8; p++) {
    memcpy(d.joints[p], d.joints[4], sizeof d.joints[4]);
    memcpy(d.pulls[p], d.pulls[4], sizeof d.pulls[4]);
    memcpy(d.morph[p], d.morph[4], sizeof d.morph[4]);
  }
  e = edit_once(&mesh, edit_);
  assert_int_equal(e.losses.bent, 0);
  edited_deinit(&e);
  d.morph[6][2] += 1;
  e = edit_once(&mesh, edit_);
  assert_int_equal(e.losses.bent, 1);
  edited_deinit(&e);
}

TEST(names_follow_points_that_are_merged) {
  tw_mesh mesh = cube();
  tw_edit edits[2] = {
      {.kind = TW_EDIT_MOVE, .selection = LIST(TW_EDIT_VERTICES, 4, 5, 6), .name = "moved", .move.by = {0}},
      merge((tw_selection)LIST(TW_EDIT_VERTICES, 4, 5), -1)};
  for (int by_distance = 0; by_distance < 2; by_distance++) {
    edits[1].merge.distance = by_distance ? 2 : -1;
    edited e = edit(&mesh, edits, 2);
    assert_string_equal(e.made[0].name, "moved");
    assert_int_equal(e.made[0].vertex_count, 2);
    assert_int_equal(e.made[0].vertices[0], 4);
    assert_int_equal(e.made[0].vertices[1], 5);
    edited_deinit(&e);
  }
}

TEST(all_of_one_point_leave_nothing) {
  tw_mesh mesh = cube();
  edited e = edit_once(&mesh, merge(all_vertices, -1));
  assert_int_equal(e.mesh.face_count, 0);
  edited_deinit(&e);
}

/* ---- fill ------------------------------------------------------------------------------------ */

TEST(deleted_faces_are_filled_again) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  tw_edit edits[2] = {delete ((tw_selection)LIST(TW_EDIT_FACES, 1, 2)),
                      {.kind = TW_EDIT_FILL, .name = "lid"}};
  edited e = edit(&mesh, edits, 2);
  assert_counts(&e, 8, 11, 5, 0); /* the two faces' hole is one of six edges */
  assert_int_equal(e.made_count, 2);
  assert_int_equal(e.made[1].face_count, 1);
  assert_int_equal(e.made[1].faces[0], 4);
  edited_deinit(&e);
  edits[1].fill.max_edges = 5;
  edit_refused(&mesh, edits, 2, TW_INVALID, "/1");
  edits[1].is_optional = true;
  e = edit(&mesh, edits, 2);
  assert_int_equal(e.mesh.face_count, 4);
  edited_deinit(&e);
}

TEST(a_filled_hole_is_as_the_face_was) {
  tw_mesh mesh = cube();
  tw_edit edits[2] = {delete ((tw_selection)LIST(TW_EDIT_FACES, 1)), {.kind = TW_EDIT_FILL}};
  edited e = edit(&mesh, edits, 2);
  assert_counts(&e, 8, 12, 6, 0);
  assert_near(volume_of(&e.mesh), 8);
  edited_deinit(&e);
}

TEST(the_hole_at_an_edge_alone_is_filled) {
  tw_mesh mesh = cube();
  tw_edit edits[2] = {delete ((tw_selection)LIST(TW_EDIT_FACES, 0, 1)),
                      {.kind = TW_EDIT_FILL, .fill = {.has_border = true, .border = {4, 5}}}};
  edited e = edit(&mesh, edits, 2);
  assert_counts(&e, 8, 12, 5, 4);
  edited_deinit(&e);
  edits[1].fill.border[1] = 0;
  edit_refused(&mesh, edits, 2, TW_INVALID, "/1/border");
  edits[1].fill.border[1] = 6;
  edit_refused(&mesh, edits, 2, TW_INVALID, "/1/border");
}

/* Two squares with a point in common. */
TEST(borders_that_meet_in_a_point_are_two) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 4, 4);
  tw_edit edits[2] = {delete ((tw_selection)LIST(TW_EDIT_FACES, 5, 10)),
                      {.kind = TW_EDIT_FILL, .fill.max_edges = 4}};
  edited e = edit(&mesh, edits, 2);
  assert_counts(&e, 25, 40, 16, 16);
  edited_deinit(&e);
}

/* ---- mirror ---------------------------------------------------------------------------------- */

TEST(half_a_box_becomes_whole) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  tw_edit edits[3] = {
      {.kind = TW_EDIT_MOVE, .selection = all_faces, .move.by = {1.0001, 0, 0}, .name = "all"},
      {.kind = TW_EDIT_CREASE, .selection = LIST(TW_EDIT_EDGES, 1, 2), .sharpness = 2},
      {.kind = TW_EDIT_MIRROR, .mirror = {.axis = 0, .weld = 1e-3}, .name = "image"}};
  edited e = edit(&mesh, edits, 3);
  assert_counts(&e, 12, 20, 10, 0);
  assert_near(volume_of(&e.mesh), 8 * 2.0001);
  assert_int_equal(e.stats.creases, 2);
  assert_int_equal(e.made[0].face_count, 10);
  assert_int_equal(e.made[1].face_count, 5);
  assert_int_equal(e.made[1].vertex_count, 4);
  const float *displacement = e.mesh.morphs[0] + 3 * e.made[1].vertices[0];
  assert_true(displacement[0] == -d.morph[1][0] && displacement[1] == d.morph[1][1]);
  edited_deinit(&e);
}

/* A target is as symmetric as the mesh: each point has one where its mirror image is. */
TEST(points_on_the_plane_of_a_mirror_stay_there_in_morph_targets) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  tw_edit edits[2] = {{.kind = TW_EDIT_MOVE, .selection = all_faces, .move.by = {0, 1, 0}},
                      {.kind = TW_EDIT_MIRROR, .mirror = {.axis = 1, .weld = 1e-6}}};
  edited e = edit(&mesh, edits, 2);
  uint32_t on = 0;
  assert_int_equal(e.mesh.point_count, 12);
  for (uint32_t p = 0; p < 12; p++) {
    float to[2][3], nearest = INFINITY;
    for (uint32_t i = 0; i < 3; i++) to[0][i] = point_of(&e.mesh, p)[i] + e.mesh.morphs[0][3 * p + i];
    for (uint32_t q = 0; q < 12; q++) {
      float distance = 0;
      for (uint32_t i = 0; i < 3; i++) {
        to[1][i] = point_of(&e.mesh, q)[i] + e.mesh.morphs[0][3 * q + i];
        distance += fabsf((i == 1 ? -to[1][i] : to[1][i]) - to[0][i]);
      }
      nearest = fminf(nearest, distance);
    }
    assert_true(nearest == 0);
    on += point_of(&e.mesh, p)[1] == 0;
  }
  assert_int_equal(on, 4);
  assert_int_equal(e.losses.flattened, 4); /* all of them have z = 1 or -1, which dress displaces y by */
  edited_deinit(&e);
  edits[1].mirror.weld = -1;
  e = edit(&mesh, edits, 2);
  for (uint32_t p = 0; p < 8; p++) assert_true(e.mesh.morphs[0][3 * p + 1] == d.morph[p][1]);
  assert_int_equal(e.losses.flattened, 0);
  edited_deinit(&e);
}

TEST(an_image_without_a_weld_stands_alone) {
  tw_mesh mesh = cube();
  tw_edit edit_ = {.kind = TW_EDIT_MIRROR, .mirror = {.axis = 1, .weld = -1}};
  edited e = edit(&mesh, &edit_, 1);
  assert_counts(&e, 16, 24, 12, 0);
  assert_near(volume_of(&e.mesh), 16);
  edited_deinit(&e);
  edit_.mirror.axis = 3;
  edit_refused(&mesh, &edit_, 1, TW_INVALID, "/0/axis");
  edit_.mirror.axis = 0;
  edit_.mirror.weld = NAN;
  edit_refused(&mesh, &edit_, 1, TW_INVALID, "/0/weld");
}

/* ---- flip and orient ------------------------------------------------------------------------- */

TEST(a_flipped_mesh_is_inside_out) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  edited e = edit_once(&mesh, (tw_edit){.kind = TW_EDIT_FLIP});
  assert_counts(&e, 8, 12, 6, 0);
  assert_near(volume_of(&e.mesh), -8);
  assert_dressed(&e.mesh);
  edited_deinit(&e);
}

TEST(faces_are_turned_outward) {
  tw_mesh mesh = cube();
  for (uint32_t mask = 0; mask < 64; mask++) {
    uint32_t faces[6], count = 0;
    for (uint32_t f = 0; f < 6; f++)
      if (mask >> f & 1) faces[count++] = f;
    tw_edit edits[2] = {{.kind = TW_EDIT_FLIP,
                         .selection = {TW_EDIT_FACES, TW_SELECT_LIST, .count = count, .indices = faces},
                         .is_optional = true},
                        {.kind = TW_EDIT_ORIENT}};
    edited e = edit(&mesh, edits, 2);
    assert_counts(&e, 8, 12, 6, 0);
    assert_near(volume_of(&e.mesh), 8);
    edited_deinit(&e);
  }
}

TEST(open_pieces_face_as_most_of_their_faces_did) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 3, 1);
  tw_edit edits[2] = {{.kind = TW_EDIT_FLIP, .selection = LIST(TW_EDIT_FACES, 0)}, {.kind = TW_EDIT_ORIENT}};
  edited e = edit(&mesh, edits, 2);
  assert_counts(&e, 8, 10, 3, 8);
  assert_memory_equal(e.mesh.corners, mesh.corners, 4 * sizeof(uint32_t));
  edited_deinit(&e);
}

/* ---- triangulate and quads ------------------------------------------------------------------- */

TEST(quads_are_cut_along_the_shorter_diagonal) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  tw_edit edit_ = {.kind = TW_EDIT_TRIANGULATE, .name = "halves"};
  edited e = edit(&mesh, &edit_, 1);
  assert_counts(&e, 8, 18, 12, 0);
  assert_near(volume_of(&e.mesh), 8);
  assert_dressed(&e.mesh);
  assert_int_equal(e.mesh.uv_sets[1].value_count, 24);
  edited_deinit(&e);
  const float points[4][3] = {{-3, 0, 0}, {0, -1, 0}, {3, 0, 0}, {0, 1, 0}},
              arrow[4][3] = {{0, 0, 0}, {-1, -3, 0}, {0, -1, 0}, {1, -3, 0}};
  const uint32_t corners[4] = {0, 1, 2, 3}, offsets[2] = {0, 4};
  mesh = mesh_of(points[0], 4, corners, offsets, 1);
  e = edit(&mesh, &edit_, 1);
  assert_memory_equal(e.mesh.corners, ((uint32_t[]){0, 1, 3, 1, 2, 3}), 6 * sizeof(uint32_t));
  edited_deinit(&e);
  mesh.positions = arrow[0]; /* its longer diagonal would be outside */
  e = edit(&mesh, &edit_, 1);
  assert_memory_equal(e.mesh.corners, ((uint32_t[]){0, 1, 2, 0, 2, 3}), 6 * sizeof(uint32_t));
  edited_deinit(&e);
}

/* A comb of teeth: concave everywhere. */
TEST(large_faces_are_cut_from_their_ears) {
  enum { TEETH = 20, CORNERS = 4 * TEETH + 2 };
  float points[CORNERS][3];
  uint32_t corners[CORNERS], offsets[2] = {0, CORNERS}, n = 0;
  for (uint32_t i = 0; i < TEETH; i++)
    for (uint32_t k = 0; k < 4; k++) {
      points[n][0] = (float)(2 * i + (k >= 2));
      points[n][1] = 0;
      points[n++][2] = k == 1 || k == 2 ? -5 : -1;
    }
  memcpy(points[n++], ((float[]){2 * TEETH - 1, 0, 0}), sizeof points[0]);
  memcpy(points[n++], ((float[]){0, 0, 0}), sizeof points[0]);
  for (uint32_t i = 0; i < CORNERS; i++) corners[i] = i;
  tw_mesh mesh = mesh_of(points[0], CORNERS, corners, offsets, 1);
  edited e = edit_once(&mesh, (tw_edit){.kind = TW_EDIT_TRIANGULATE});
  assert_counts(&e, CORNERS, 2 * CORNERS - 3, CORNERS - 2, CORNERS);
  assert_near(area_of(&e.mesh), area_of(&mesh)); /* nothing is covered twice */
  edited_deinit(&e);
}

/* Walking past corners whose two neighbours are one point takes most of the face for each ear. */
TEST(long_faces_that_run_to_and_fro_stay_whole) {
  enum { CORNERS = 20001, SHORT = 101 };
  static uint32_t corners[CORNERS];
  const float points[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  uint32_t offsets[2] = {0, CORNERS};
  for (uint32_t i = 0; i < CORNERS; i++) corners[i] = i % 2;
  corners[CORNERS - 1] = 2;
  tw_mesh mesh = mesh_of(points[0], 3, corners, offsets, 1);
  edited e = edit_once(&mesh, (tw_edit){.kind = TW_EDIT_TRIANGULATE});
  assert_int_equal(e.mesh.face_count, 1);
  assert_memory_equal(e.mesh.corners, corners, sizeof corners);
  edited_deinit(&e);
  corners[SHORT - 1] = 2;
  offsets[1] = SHORT;
  mesh = mesh_of(points[0], 3, corners, offsets, 1);
  e = edit_once(&mesh, (tw_edit){.kind = TW_EDIT_TRIANGULATE});
  assert_int_equal(e.mesh.face_count, SHORT - 2);
  edited_deinit(&e);
}

TEST(halves_become_quads_again) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  tw_edit edits[3] = {
      {.kind = TW_EDIT_CREASE, .selection = {.of = TW_EDIT_EDGES, .by = TW_SELECT_ALL}, .sharpness = 2},
      {.kind = TW_EDIT_TRIANGULATE},
      {.kind = TW_EDIT_QUADS}};
  edited e = edit(&mesh, edits, 3);
  assert_counts(&e, 8, 12, 6, 0);
  assert_int_equal(e.stats.quads, 6);
  assert_int_equal(e.stats.creases, 12);
  assert_dressed(&e.mesh);
  edited_deinit(&e);
}

TEST(creases_keep_triangles_apart) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 1, 1);
  tw_edit edits[3] = {{.kind = TW_EDIT_TRIANGULATE},
                      {.kind = TW_EDIT_CREASE, .selection = LIST(TW_EDIT_EDGES, 0, 3), .sharpness = 1},
                      {.kind = TW_EDIT_QUADS}};
  edited e = edit(&mesh, edits, 3);
  assert_counts(&e, 4, 5, 2, 4);
  edited_deinit(&e);
}

/* A quad of both would hide the surface of one half or give the other one to it. */
TEST(holes_keep_triangles_apart) {
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, 1, 1);
  for (uint32_t hole = 0; hole < 2; hole++) {
    tw_edit edits[3] = {{.kind = TW_EDIT_TRIANGULATE},
                        {.kind = TW_EDIT_HOLE, .selection = LIST(TW_EDIT_FACES, hole), .sharpness = 1},
                        {.kind = TW_EDIT_QUADS}};
    edited e = edit(&mesh, edits, 3);
    assert_counts(&e, 4, 5, 2, 4);
    assert_int_equal(e.mesh.hole_count, 1);
    assert_int_equal(e.mesh.holes[0], hole);
    edited_deinit(&e);
  }
  tw_edit both[3] = {{.kind = TW_EDIT_TRIANGULATE},
                     {.kind = TW_EDIT_HOLE, .selection = LIST(TW_EDIT_FACES, 0, 1), .sharpness = 1},
                     {.kind = TW_EDIT_QUADS}};
  edited e = edit(&mesh, both, 3);
  assert_counts(&e, 4, 4, 1, 4);
  assert_int_equal(e.stats.holes, 1);
  edited_deinit(&e);
}
