/* Loop cuts and subdivided edges and faces. */
#include "edited.h"

static tw_edit loop_cut(uint32_t a, uint32_t b, uint32_t cuts, const double *at) {
  return (tw_edit){.kind = TW_EDIT_LOOP_CUT, .name = "loop", .loop_cut = {{a, b}, cuts, at}};
}

static tw_edit subdivide(tw_selection selection, uint32_t cuts) {
  return (tw_edit){
      .kind = TW_EDIT_SUBDIVIDE, .selection = selection, .name = "parts", .subdivide.cuts = cuts};
}

/* Two poles and three points between: one ring runs over each quad twice. */
static const float trefoil_points[5][3] = {
    {0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {-0.5f, 0, 0.9f}, {-0.5f, 0, -0.9f}};
static const uint32_t trefoil_corners[12] = {0, 2, 1, 3, 0, 3, 1, 4, 0, 4, 1, 2},
                      trefoil_offsets[4] = {0, 4, 8, 12};

static const float prism_points[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {1, 1, 0}, {0, 1, -1}};
static const uint32_t prism_corners[18] = {0, 2, 1, 3, 4, 5, 0, 1, 4, 3, 1, 2, 5, 4, 2, 0, 3, 5};
static const uint32_t prism_offsets[6] = {0, 3, 6, 10, 14, 18};

/* ---- refused --------------------------------------------------------------------------------- */

TEST(loop_cuts_that_cannot_be_are_refused) {
  tw_mesh mesh = cube();
  const double beyond[2] = {0.5, 1}, backwards[2] = {0.5, 0.5}, nothing[1] = {NAN};
  tw_edit edit = loop_cut(0, 6, 1, NULL);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/edge");
  edit = loop_cut(0, 8, 1, NULL);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/edge/1");
  edit = loop_cut(0, 1, 0, NULL);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/cuts");
  edit = loop_cut(0, 1, 1000000000, NULL);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/cuts");
  edit = loop_cut(0, 1, 2, beyond);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/at/1");
  edit = loop_cut(0, 1, 2, backwards);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/at/1");
  edit = loop_cut(0, 1, 1, nothing);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/at/0");
}

TEST(a_loop_needs_a_quad) {
  const uint32_t corners[4] = {0, 1, 4, 3}, offsets[2] = {0, 3};
  tw_mesh mesh = mesh_of(prism_points[0], 4, corners, offsets, 1);
  tw_edit edit = loop_cut(0, 1, 1, NULL);
  edit_refused(&mesh, &edit, 1, TW_INVALID, "/0/edge");
}

TEST(results_over_the_limits_are_refused_before_they_are_made) {
  tw_mesh mesh = cube();
  tw_edit edit = subdivide((tw_selection){.of = TW_EDIT_FACES, .by = TW_SELECT_ALL}, 10000);
  edit_refused(&mesh, &edit, 1, TW_LIMIT, "/0");
}

/* ---- counts ---------------------------------------------------------------------------------- */

TEST(a_loop_round_a_cube) {
  for (uint32_t cuts = 1; cuts <= 5; cuts++) {
    dressed d;
    tw_mesh mesh = dressed_cube(&d);
    edited e = edit_once(&mesh, loop_cut(0, 1, cuts, NULL));
    assert_counts(&e, 8 + 4 * cuts, 12 + 8 * cuts, 6 + 4 * cuts, 0);
    assert_near(volume_of(&e.mesh), 8);
    assert_near(area_of(&e.mesh), 24);
    assert_dressed(&e.mesh);
    assert_int_equal(e.mesh.uv_sets[0].value_count, 8 + 4 * cuts);
    assert_int_equal(e.mesh.uv_sets[1].value_count, 24 + 8 * cuts);
    assert_int_equal(e.made[0].face_count, 4 * (cuts + 1));
    assert_int_equal(e.made[0].vertex_count, 4 * cuts);
    /* The two faces beside the ring are as they were. */
    assert_memory_equal(e.mesh.corners + e.mesh.face_offsets[3], cube_corners + 12, 4 * sizeof(uint32_t));
    edited_deinit(&e);
  }
}

TEST(places_are_counted_from_the_first_vertex_all_along_the_ring) {
  tw_mesh mesh = cube();
  const double at[2] = {0.125, 0.5};
  tw_edit forth = loop_cut(0, 1, 2, at), back = loop_cut(1, 0, 2, at);
  edited e = edit(&mesh, &forth, 1);
  uint32_t found = 0;
  for (uint32_t p = 8; p < 16; p++)
    found += point_of(&e.mesh, p)[0] == -0.75f || point_of(&e.mesh, p)[0] == 0;
  assert_int_equal(found, 8);
  edited_deinit(&e);
  e = edit(&mesh, &back, 1);
  for (uint32_t p = 8; p < 16; p++) found -= point_of(&e.mesh, p)[0] == 0.75f || point_of(&e.mesh, p)[0] == 0;
  assert_int_equal(found, 0);
  edited_deinit(&e);
}

TEST(a_ring_may_cross_itself) {
  for (uint32_t cuts = 1; cuts <= 4; cuts++) {
    tw_mesh mesh = mesh_of(trefoil_points[0], 5, trefoil_corners, trefoil_offsets, 3);
    edited e = edit_once(&mesh, loop_cut(0, 2, cuts, NULL));
    uint32_t v = 5 + 6 * cuts + 3 * cuts * cuts, f = 3 * (cuts + 1) * (cuts + 1);
    assert_counts(&e, v, v + f - 2, f, 0);
    edited_deinit(&e);
  }
}

TEST(a_ring_that_crosses_itself_keeps_its_direction) {
  tw_mesh mesh = mesh_of(trefoil_points[0], 5, trefoil_corners, trefoil_offsets, 3);
  const double at[1] = {0.25};
  edited e = edit_once(&mesh, loop_cut(0, 2, 1, at));
  /* At a quarter from the upper pole, or from the equator to the lower one. */
  for (uint32_t p = 5; p < 11; p++) {
    float y = point_of(&e.mesh, p)[1];
    assert_true(y == 0.75f || y == -0.25f);
  }
  edited_deinit(&e);
}

TEST(rings_end_at_triangles) {
  tw_mesh mesh = mesh_of(prism_points[0], 6, prism_corners, prism_offsets, 5);
  edited e = edit_once(&mesh, loop_cut(0, 1, 2, NULL));
  assert_counts(&e, 10, 15, 7, 0);
  assert_int_equal(e.mesh.face_offsets[1], 5);
  assert_int_equal(e.made[0].face_count, 3);
  edited_deinit(&e);
}

TEST(rings_end_at_borders) {
  enum { A = 3, B = 2 };
  grid_mesh grid;
  tw_mesh mesh = grid_of(&grid, A, B);
  tw_edit edit_ = loop_cut(5, 6, 1, NULL); /* inside */
  edited e = edit(&mesh, &edit_, 1);
  assert_counts(&e, (A + 2) * (B + 1), (A + 1) * (B + 1) + (A + 2) * B, (A + 1) * B, 2 * (A + 1 + B));
  edited_deinit(&e);
}

TEST(all_faces_of_a_cube) {
  for (uint32_t n = 2; n <= 5; n++) {
    dressed d;
    tw_mesh mesh = dressed_cube(&d);
    edited e = edit_once(&mesh, subdivide((tw_selection){.of = TW_EDIT_FACES, .by = TW_SELECT_ALL}, n - 1));
    assert_counts(&e, 6 * n * n + 2, 12 * n * n, 6 * n * n, 0);
    assert_int_equal(e.stats.quads, 6 * n * n);
    assert_near(volume_of(&e.mesh), 8);
    assert_near(area_of(&e.mesh), 24);
    assert_dressed(&e.mesh);
    assert_int_equal(e.mesh.uv_sets[0].value_count, 6 * n * n + 2);
    assert_int_equal(e.mesh.uv_sets[1].value_count, 6 * (n + 1) * (n + 1));
    assert_int_equal(e.made[0].face_count, 6 * n * n);
    edited_deinit(&e);
  }
}

static const float octahedron_points[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                              {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
static const uint32_t octahedron_corners[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                                2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
static const uint32_t octahedron_offsets[9] = {0, 3, 6, 9, 12, 15, 18, 21, 24};

TEST(all_faces_of_an_octahedron) {
  for (uint32_t n = 2; n <= 5; n++) {
    tw_mesh mesh = mesh_of(octahedron_points[0], 6, octahedron_corners, octahedron_offsets, 8);
    dressed d = {0};
    dress(&mesh, &d);
    edited e = edit_once(&mesh, subdivide((tw_selection){.of = TW_EDIT_EDGES, .by = TW_SELECT_ALL}, n - 1));
    assert_counts(&e, 4 * n * n + 2, 12 * n * n, 8 * n * n, 0);
    assert_int_equal(e.stats.triangles, 8 * n * n);
    assert_near(volume_of(&e.mesh), 4.0 / 3);
    assert_near(area_of(&e.mesh), 4 * sqrt(3));
    assert_dressed(&e.mesh);
    edited_deinit(&e);
  }
}

TEST(neighbours_of_a_subdivided_face_stay_joined_to_it) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  edited e = edit_once(&mesh, subdivide((tw_selection)LIST(TW_EDIT_FACES, 1), 2));
  assert_counts(&e, 8 + 8 + 4, 12 + 8 + 12, 5 + 9, 0);
  assert_int_equal(e.stats.ngons, 4);
  assert_int_equal(e.made[0].face_count, 9);
  assert_dressed(&e.mesh);
  edited_deinit(&e);
}

TEST(an_edge_alone_gives_its_faces_more_corners) {
  tw_mesh mesh = cube();
  edited e = edit_once(&mesh, subdivide((tw_selection)LIST(TW_EDIT_EDGES, 0, 1), 3));
  assert_counts(&e, 11, 15, 6, 0);
  edited_deinit(&e);
}

TEST(two_edges_of_a_face_cut_it_across) {
  dressed d;
  tw_mesh mesh = dressed_cube(&d);
  tw_edit beside = subdivide((tw_selection)LIST(TW_EDIT_EDGES, 4, 5, 5, 6), 2),
          across = subdivide((tw_selection)LIST(TW_EDIT_EDGES, 4, 5, 6, 7), 2);
  edited e = edit(&mesh, &beside, 1);
  assert_counts(&e, 12, 12 + 4 + 2, 8, 0);
  assert_int_equal(e.stats.triangles, 1);
  assert_dressed(&e.mesh);
  edited_deinit(&e);
  e = edit(&mesh, &across, 1);
  assert_counts(&e, 12, 12 + 4 + 2, 8, 0);
  assert_int_equal(e.stats.triangles, 0);
  assert_dressed(&e.mesh);
  edited_deinit(&e);
}

/* ---- what goes along ------------------------------------------------------------------------- */

TEST(parts_of_creases_holes_and_names_are_such) {
  tw_mesh mesh = cube();
  const tw_selection made_edges = {.of = TW_EDIT_EDGES, .by = TW_SELECT_MADE, .name = "loop"};
  tw_edit edits[5] = {
      {.kind = TW_EDIT_CREASE, .selection = LIST(TW_EDIT_EDGES, 0, 1, 1, 2), .sharpness = 3, .name = "sharp"},
      {.kind = TW_EDIT_HOLE, .selection = LIST(TW_EDIT_FACES, 2), .sharpness = 1, .name = "hole"},
      {.kind = TW_EDIT_CORNER, .selection = LIST(TW_EDIT_VERTICES, 1), .sharpness = 2},
      loop_cut(0, 1, 2, NULL),
      {.kind = TW_EDIT_CREASE, .selection = made_edges, .sharpness = 1}};
  edited e = edit(&mesh, edits, 4);
  assert_int_equal(e.stats.creases, 4);
  assert_int_equal(e.stats.sharp_points, 1);
  assert_int_equal(e.stats.holes, 3);
  assert_int_equal(e.made_count, 3);
  assert_int_equal(e.made[1].face_count, 3);
  edited_deinit(&e);
  e = edit(&mesh, edits, 5);
  assert_int_equal(e.stats.creases, 4 + 8);
  edited_deinit(&e);
}

TEST(names_follow_what_is_cut) {
  tw_mesh mesh = cube();
  const tw_selection top = LIST(TW_EDIT_FACES, 1),
                     made = {.of = TW_EDIT_FACES, .by = TW_SELECT_MADE, .name = "top"};
  tw_edit edits[3] = {{.kind = TW_EDIT_MOVE, .selection = top, .name = "top"},
                      loop_cut(4, 5, 1, NULL),
                      {.kind = TW_EDIT_MOVE, .selection = made, .move.by = {0, 0, 1}, .name = "top"}};
  edited e = edit(&mesh, edits, 3);
  assert_int_equal(e.made_count, 2);
  assert_string_equal(e.made[1].name, "top");
  assert_int_equal(e.made[1].face_count, 2);
  assert_int_equal(e.made[1].vertex_count, 6);
  assert_near(volume_of(&e.mesh), 12);
  edited_deinit(&e);
}
