/* Edits that make scans clean: what they take away, and what they leave as it was. */
#include "edited.h"
#include "tweend/shape.h"
#include "wrapped_memory.h"

/* ---- fixtures -------------------------------------------------------------------------------- */

static uint32_t seed;

/* -1 to 1 */
static double any(void) {
  seed = seed * 1664525u + 1013904223u;
  return (double)(seed >> 8) / (1 << 23) - 1;
}

typedef struct scan {
  tw_arena *arena;
  tw_mesh mesh;
  float (*points)[3];
} scan;

/* A ball of radius 1 with 10 * 4^level + 2 points. */
static scan ball(uint32_t level) {
  scan s = {.arena = tw_arena_create()};
  tw_shape shape;
  tw_error error;
  tw_shape_init(&shape, TW_SHAPE_ICOSPHERE);
  shape.radii[0] = 1;
  shape.level = level;
  assert_int_equal(tw_shape_make(&shape, s.arena, &s.mesh, &error), TW_OK);
  s.points = tw_arena_alloc(s.arena, s.mesh.point_count, sizeof *s.points);
  assert_non_null(s.points);
  memcpy(s.points, s.mesh.positions, s.mesh.point_count * sizeof *s.points);
  s.mesh.positions = s.points[0];
  return s;
}

/* The root mean square of how far points are from the ball's surface. */
static double off_ball(const tw_mesh *mesh) {
  double sum = 0;
  for (uint32_t p = 0; p < mesh->point_count; p++) {
    const float *at = point_of(mesh, p);
    double off = sqrt((double)at[0] * at[0] + (double)at[1] * at[1] + (double)at[2] * at[2]) - 1;
    sum += off * off;
  }
  return sqrt(sum / mesh->point_count);
}

/* ---- smooth ---------------------------------------------------------------------------------- */

TEST(iterations_are_bounded) {
  const tw_mesh mesh = cube();
  const tw_edit none = {.kind = TW_EDIT_SMOOTH},
                many = {.kind = TW_EDIT_SMOOTH, .smooth.iterations = TW_EDIT_ITERATIONS_MAX + 1};
  edit_refused(&mesh, &none, 1, TW_INVALID, "/0/iterations");
  edit_refused(&mesh, &many, 1, TW_INVALID, "/0/iterations");
}

/* What is left of the noise are its long waves, which might be the surface's. */
TEST(noise_on_a_ball_falls_to_two_fifths_within_a_percent_of_its_volume) {
  scan clean = ball(4), s = ball(4);
  seed = 1;
  for (uint32_t p = 0; p < s.mesh.point_count; p++) {
    double by = 1 + 0.02 * any();
    for (int i = 0; i < 3; i++) s.points[p][i] = (float)(by * (double)s.points[p][i]);
  }
  const tw_edit taubin = {.kind = TW_EDIT_SMOOTH, .smooth.iterations = 10};
  edited out = edit(&s.mesh, &taubin, 1);
  double before = off_ball(&s.mesh), after = off_ball(&out.mesh);
  if (!(after < before * 0.4)) print_error("%g of %g\n", after, before);
  assert_true(after < before * 0.4);
  assert_true(fabs(volume_of(&out.mesh) / volume_of(&clean.mesh) - 1) < 0.01);
  edited_deinit(&out);
  tw_arena_destroy(clean.arena);
  tw_arena_destroy(s.arena);
}

/* The mean of a corner's neighbours is the corner times 1/3. */
TEST(a_step_takes_the_corners_of_a_cube_towards_their_neighbours) {
  const tw_mesh mesh = cube();
  const tw_edit twice = {.kind = TW_EDIT_SMOOTH, .smooth = {TW_SMOOTH_LAPLACIAN, 2}},
                back = {.kind = TW_EDIT_SMOOTH, .smooth = {TW_SMOOTH_TAUBIN, 1}};
  edited shrunk = edit(&mesh, &twice, 1), same = edit(&mesh, &back, 1);
  for (uint32_t p = 0; p < 8; p++)
    for (uint32_t i = 0; i < 3; i++) {
      assert_near((double)point_of(&shrunk.mesh, p)[i], 4.0 / 9 * (double)cube_points[p][i]);
      assert_near((double)point_of(&same.mesh, p)[i],
                  (1 - 0.6307 * 2 / 3) * (1 + 0.6732 * 2 / 3) * (double)cube_points[p][i]);
    }
  edited_deinit(&shrunk);
  edited_deinit(&same);
}

TEST(borders_and_flat_points_stay) {
  grid_mesh g;
  tw_mesh mesh = grid_of(&g, 6, 6);
  g.points[24][2] = 1;
  const tw_edit taubin = {.kind = TW_EDIT_SMOOTH, .smooth.iterations = 5};
  edited out = edit(&mesh, &taubin, 1);
  for (uint32_t p = 0; p < 49; p++) {
    bool is_border = p % 7 == 0 || p % 7 == 6 || p < 7 || p >= 42;
    for (uint32_t i = 0; i < (is_border ? 3 : 2); i++)
      assert_near((double)point_of(&out.mesh, p)[i], (double)g.points[p][i]);
  }
  assert_true(fabs((double)point_of(&out.mesh, 24)[2]) < 0.5);
  edited_deinit(&out);
}

TEST(what_is_not_selected_is_not_smoothed) {
  const tw_mesh mesh = cube();
  const tw_edit some = {.kind = TW_EDIT_SMOOTH,
                        .selection = LIST(TW_EDIT_VERTICES, 3),
                        .name = "a",
                        .smooth = {TW_SMOOTH_LAPLACIAN, 1}};
  edited out = edit(&mesh, &some, 1);
  for (uint32_t p = 0; p < 8; p++)
    assert_near((double)point_of(&out.mesh, p)[0], (double)cube_points[p][0] * (p == 3 ? 2.0 / 3 : 1));
  assert_int_equal(out.made[0].vertex_count, 1);
  assert_int_equal(out.made[0].vertices[0], 3);
  edited_deinit(&out);
}

/* ---- despike --------------------------------------------------------------------------------- */

TEST(factors_are_above_0) {
  const tw_mesh mesh = cube();
  static const double wrong[] = {0, -1, NAN, INFINITY};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
    const tw_edit e = {.kind = TW_EDIT_DESPIKE, .despike.factor = wrong[i]};
    edit_refused(&mesh, &e, 1, TW_INVALID, "/0/factor");
  }
}

/* Spikes alone, two side by side and three in a triangle go back; nothing else moves. */
TEST(spikes_go_and_all_else_stays) {
  scan s = ball(3);
  const uint32_t *triangle = s.mesh.corners + 3 * 600, *edge = s.mesh.corners + 3 * 100;
  uint32_t spikes[6] = {s.mesh.corners[0], edge[0], edge[1], triangle[0], triangle[1], triangle[2]};
  for (uint32_t i = 0; i < 6; i++)
    for (uint32_t k = 0; k < 3; k++) s.points[spikes[i]][k] *= i % 2 ? 0.2f : 5;
  const tw_edit despike = {.kind = TW_EDIT_DESPIKE, .name = "a", .despike.factor = 2};
  edited out = edit(&s.mesh, &despike, 1);
  assert_int_equal(out.made[0].vertex_count, 6);
  for (uint32_t i = 0; i < 6; i++) {
    bool is_found = false;
    for (uint32_t k = 0; k < 6; k++) is_found |= out.made[0].vertices[k] == spikes[i];
    assert_true(is_found);
  }
  for (uint32_t p = 0, next = 0; p < s.mesh.point_count; p++) {
    bool is_spike = next < 6 && out.made[0].vertices[next] == p;
    next += is_spike;
    if (!is_spike) assert_memory_equal(point_of(&out.mesh, p), s.points[p], sizeof *s.points);
  }
  assert_true(off_ball(&out.mesh) < 0.002);
  edited_deinit(&out);
  tw_arena_destroy(s.arena);
}

TEST(cubes_and_balls_have_no_spikes) {
  scan s = ball(2);
  const tw_mesh meshes[] = {cube(), s.mesh};
  const tw_edit despike = {.kind = TW_EDIT_DESPIKE, .name = "a", .despike.factor = 1};
  for (int i = 0; i < 2; i++) {
    edited out = edit(&meshes[i], &despike, 1);
    assert_int_equal(out.made[0].vertex_count, 0);
    assert_memory_equal(out.mesh.positions, meshes[i].positions, meshes[i].point_count * sizeof(float[3]));
    edited_deinit(&out);
  }
  tw_arena_destroy(s.arena);
}

/* ---- drop_pieces ----------------------------------------------------------------------------- */

/* A cube; a triangle and a quad with a point in common; a triangle. */
TEST(small_pieces_go_with_their_points) {
  float points[8 + 6 + 3 + 1][3];
  uint32_t corners[24 + 3 + 4 + 3], offsets[10];
  memcpy(points, cube_points, sizeof cube_points);
  memcpy(corners, cube_corners, sizeof cube_corners);
  memcpy(offsets, cube_offsets, sizeof cube_offsets);
  for (uint32_t p = 8; p < 18; p++)
    for (uint32_t i = 0; i < 3; i++) points[p][i] = (float)(p * (i + 1) % 7);
  const uint32_t more[] = {8, 9, 10, 10, 11, 12, 13, 14, 15, 16};
  memcpy(corners + 24, more, sizeof more);
  offsets[7] = 27;
  offsets[8] = 31;
  offsets[9] = 34;
  const tw_mesh mesh = mesh_of(points[0], 18, corners, offsets, 9);
  static const uint32_t least[] = {0, 1, 2, 3, 6, 7}, faces[] = {9, 9, 8, 6, 6, 0},
                        left[] = {18, 18, 15, 9, 9, 1}; /* point 17 was without a face before */
  for (int i = 0; i < 6; i++) {
    const tw_edit drop = {.kind = TW_EDIT_DROP_PIECES, .drop_pieces.faces = least[i]};
    edited out = edit(&mesh, &drop, 1);
    assert_int_equal(out.mesh.face_count, faces[i]);
    assert_int_equal(out.mesh.point_count, left[i]);
    edited_deinit(&out);
  }
}

/* ---- fill ------------------------------------------------------------------------------------ */

/* A cap of a cylinder is a polygon that lies flat: any cover has its area, and as many triangles. */
TEST(caps_of_a_tube_are_covered) {
  static const uint32_t segments[] = {3, 4, 64, 700};
  for (int i = 0; i < 4; i++) {
    const uint32_t n = segments[i];
    tw_arena *arena = tw_arena_create();
    tw_mesh tube;
    tw_shape shape;
    tw_error error;
    tw_shape_init(&shape, TW_SHAPE_CYLINDER);
    shape.segments[0] = n;
    shape.rings = 1;
    shape.caps = TW_CAPS_NONE;
    assert_int_equal(tw_shape_make(&shape, arena, &tube, &error), TW_OK);
    const tw_edit fill = {.kind = TW_EDIT_FILL, .name = "a", .fill.method = TW_FILL_TRIANGLES};
    edited out = edit(&tube, &fill, 1);
    assert_counts(&out, 2 * n, 3 * n + 2 * (n - 3), n + 2 * (n - 2), 0);
    assert_int_equal(out.stats.euler_characteristic, 2);
    assert_int_equal(out.made[0].face_count, 2 * (n - 2));
    double slice = sin(2 * 3.14159265358979323846 / n) / 2 * n;
    assert_true(fabs(volume_of(&out.mesh) / (slice * (double)shape.height) - 1) < 1e-5);
    edited_deinit(&out);
    tw_arena_destroy(arena);
  }
}

/* Over four points that do not lie flat one diagonal makes less area than the other one. */
TEST(the_cover_of_the_least_area_is_taken) {
  static const float points[][3] = {{0, 0, 0}, {4, 0, 0}, {4, 1, 0}, {0, 1, 3}};
  static const uint32_t corners[] = {0, 1, 2, 3}, offsets[] = {0, 4};
  const tw_mesh mesh = mesh_of(points[0], 4, corners, offsets, 1);
  const tw_edit fill = {.kind = TW_EDIT_FILL, .fill.method = TW_FILL_TRIANGLES};
  const uint32_t covers[2][6] = {{0, 1, 2, 0, 2, 3}, {0, 1, 3, 1, 2, 3}};
  static const uint32_t halves[] = {0, 3, 6};
  edited out = edit(&mesh, &fill, 1);
  double volume, front, cover[2], whole;
  measure(&mesh, &volume, &front);
  measure(&out.mesh, &volume, &whole);
  for (int i = 0; i < 2; i++) {
    const tw_mesh two = mesh_of(points[0], 4, covers[i], halves, 2);
    measure(&two, &volume, &cover[i]);
  }
  assert_true(fabs(cover[0] - cover[1]) > 1e-3);
  assert_near(whole - front, fmin(cover[0], cover[1]));
  edited_deinit(&out);
}

/* Of two diagonals of a gap one is an edge on the other side: a second one there would join four faces. */
TEST(a_cover_has_no_edge_that_the_mesh_has) {
  static const float points[][3] = {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {0, 1, 0}, {1, 0.5f, -1}, {2, 0.5f, -1}};
  /* The gap is 0 1 2 3; 1 and 3 are joined by a bridge beneath. */
  static const uint32_t corners[] = {1, 0, 4, 0, 3, 4, 3, 1, 4, 1, 3, 5, 3, 2, 5, 2, 1, 5},
                        offsets[] = {0, 3, 6, 9, 12, 15, 18};
  const tw_mesh mesh = mesh_of(points[0], 6, corners, offsets, 6);
  const tw_edit fill = {.kind = TW_EDIT_FILL, .fill.method = TW_FILL_TRIANGLES};
  edited out = edit(&mesh, &fill, 1);
  assert_counts(&out, 6, 12, 8, 0);
  assert_int_equal(out.stats.euler_characteristic, 2);
  edited_deinit(&out);
}

static void assert_closes(tw_fill_method method) {
  for (uint32_t round = 0; round < 60; round++) {
    scan s = ball(3);
    uint32_t list[24], count = 1 + round % 24;
    seed = round;
    for (uint32_t i = 0; i < count; i++) list[i] = (uint32_t)((any() + 1) / 2 * s.mesh.point_count);
    const tw_edit edits[] = {
        {.kind = TW_EDIT_DELETE,
         .selection = {TW_EDIT_VERTICES, TW_SELECT_LIST, .count = count, .indices = list}},
        {.kind = TW_EDIT_FILL, .name = "a", .fill.method = method}};
    edited cut = edit(&s.mesh, edits, 1), out = edit(&s.mesh, edits, 2);
    uint32_t points = out.mesh.point_count;
    assert_true(method == TW_FILL_FAIR || points == cut.mesh.point_count);
    assert_int_equal(out.made[0].vertex_count, points - cut.mesh.point_count);
    assert_counts(&out, points, 3 * points - 6, 2 * points - 4, 0);
    assert_int_equal(out.stats.euler_characteristic, 2);
    assert_true(fabs(volume_of(&out.mesh) / volume_of(&s.mesh) - 1) < 0.02);
    edited_deinit(&cut);
    edited_deinit(&out);
    tw_arena_destroy(s.arena);
  }
}

TEST(holes_cut_into_a_ball_close_to_a_ball) {
  assert_closes(TW_FILL_TRIANGLES);
  assert_closes(TW_FILL_FAIR);
}

/* Two gaps of four sides that meet in two points, across which the shorter diagonal of both is: one takes it.
 */
TEST(two_covers_do_not_share_an_edge) {
  static const float points[][3] = {{0, 0, 1},     {0, 0, -1},     {3, 0.2f, 0}, {3, -0.2f, 0},
                                    {-3, 0.2f, 0}, {-3, -0.2f, 0}, {0, 4, 0},    {0, -4, 0}};
  /* Gaps 0 2 1 3 and 0 5 1 4; the rest is a shell round 6 in front and 7 behind. */
  static const uint32_t corners[] = {0, 2, 6, 2, 1, 6, 1, 4, 6, 4, 0, 6, 3, 0, 7, 1, 3, 7, 5, 1, 7, 0, 5, 7},
                        offsets[] = {0, 3, 6, 9, 12, 15, 18, 21, 24};
  const tw_mesh mesh = mesh_of(points[0], 8, corners, offsets, 8);
  for (int method = TW_FILL_TRIANGLES; method <= TW_FILL_FAIR; method++) {
    const tw_edit fill = {.kind = TW_EDIT_FILL, .fill = {.max_edges = 4, .method = (tw_fill_method)method}};
    edited out = edit(&mesh, &fill, 1);
    assert_int_equal(out.stats.nonmanifold_edges, 0);
    assert_int_equal(out.stats.boundary_edges, 0);
    edited_deinit(&out);
  }
}

/* So many that what is left hangs together by points: holes share points, and edges across them. */
TEST(edges_of_many_holes_have_two_faces_each) {
  for (uint32_t round = 0; round < 80; round++) {
    scan s = ball(3);
    uint32_t list[400], count = 5 * (round + 1);
    seed = round;
    for (uint32_t i = 0; i < count; i++) list[i] = (uint32_t)((any() + 1) / 2 * s.mesh.point_count);
    const tw_edit edits[] = {
        {.kind = TW_EDIT_DELETE,
         .selection = {TW_EDIT_VERTICES, TW_SELECT_LIST, .count = count, .indices = list}},
        {.kind = TW_EDIT_FILL, .fill.method = round % 2 ? TW_FILL_TRIANGLES : TW_FILL_FAIR}};
    edited out = edit(&s.mesh, edits, 2);
    assert_int_equal(out.stats.nonmanifold_edges, 0);
    assert_int_equal(out.stats.boundary_edges, 0);
    edited_deinit(&out);
    tw_arena_destroy(s.arena);
  }
}

/* A cap of 30 degrees: a lid of least area lies up to 13 % below the ball, a fair one goes on as the ball. */
TEST(fair_patches_are_bent_as_what_is_round_them) {
  scan s = ball(4);
  const tw_edit edits[] = {
      {.kind = TW_EDIT_DELETE,
       .selection = {TW_EDIT_FACES, TW_SELECT_FACING, .direction = {0.3, 1, 0.2}, .degrees = 30}},
      {.kind = TW_EDIT_FILL, .name = "a", .fill.method = TW_FILL_FAIR}};
  edited cut = edit(&s.mesh, edits, 1), out = edit(&s.mesh, edits, 2);
  uint32_t before = cut.mesh.point_count, missing = s.mesh.point_count - before;
  assert_int_equal(out.stats.euler_characteristic, 2);
  assert_int_equal(out.made[0].vertex_count, out.mesh.point_count - before);
  assert_true(out.made[0].vertex_count > missing * 2 / 3 && out.made[0].vertex_count < missing * 3 / 2);
  assert_memory_equal(out.mesh.positions, cut.mesh.positions, before * sizeof(float[3]));
  for (uint32_t p = before; p < out.mesh.point_count; p++) {
    const float *at = point_of(&out.mesh, p);
    double radius = sqrt((double)at[0] * at[0] + (double)at[1] * at[1] + (double)at[2] * at[2]);
    if (!(radius > 0.985 && radius < 1.005)) print_error("%g\n", radius);
    assert_true(radius > 0.985 && radius < 1.005);
  }
  assert_true(fabs(volume_of(&out.mesh) / volume_of(&s.mesh) - 1) < 0.003);
  edited_deinit(&cut);
  edited_deinit(&out);
  tw_arena_destroy(s.arena);
}

/* Of a grid without its middle, deleted by this. */
static tw_edit middle(void) {
  return (tw_edit){.kind = TW_EDIT_DELETE,
                   .selection = {TW_EDIT_VERTICES, TW_SELECT_INSIDE, .min = {4, 4, -1}, .max = {12, 12, 1}}};
}

TEST(a_fair_patch_in_a_plane_is_flat_and_has_its_texture) {
  grid_mesh g;
  tw_mesh mesh = grid_of(&g, 16, 16);
  float uvs[17 * 17][2];
  for (uint32_t p = 0; p < 17 * 17; p++) memcpy(uvs[p], g.points[p], sizeof uvs[p]);
  mesh.uv_set_count = 1;
  mesh.uv_sets[0] = (tw_uv_set){17 * 17, uvs[0], mesh.corners};
  const tw_edit edits[] = {
      middle(),
      {.kind = TW_EDIT_FILL,
       .name = "a",
       .fill = {.has_border = true, .border = {6 * 17 + 3, 7 * 17 + 3}, .method = TW_FILL_FAIR}}};
  const uint32_t gone = 9 * 9;
  tw_edit fill = edits[1];
  edited cut = edit(&mesh, edits, 1);
  for (int i = 0; i < 2; i++) /* the hole's left side */
    for (uint32_t p = 0; p < cut.mesh.point_count; p++)
      if (point_of(&cut.mesh, p)[0] == 3 && point_of(&cut.mesh, p)[1] == (float)(6 + i))
        fill.fill.border[i] = p;
  edited out = edit(&cut.mesh, &fill, 1);
  double volume, whole, area;
  measure(&mesh, &volume, &whole);
  measure(&out.mesh, &volume, &area);
  assert_near(area, whole);
  assert_int_equal(out.stats.euler_characteristic, 1);
  assert_int_equal(out.stats.boundary_edges, 4 * 16);
  assert_true(out.made[0].vertex_count > gone / 2 && out.made[0].vertex_count < 2 * gone);
  for (uint32_t c = 0; c < out.mesh.corner_count; c++) {
    const float *at = point_of(&out.mesh, out.mesh.corners[c]);
    const float *uv = out.mesh.uv_sets[0].values + 2 * out.mesh.uv_sets[0].corners[c];
    assert_near((double)at[2], 0);
    for (int i = 0; i < 2; i++) assert_true(fabs((double)at[i] - (double)uv[i]) < 4);
  }
  /* One value a point: a patch has no seams. */
  assert_int_equal(out.mesh.uv_sets[0].value_count, out.mesh.point_count);
  edited_deinit(&cut);
  edited_deinit(&out);
}

TEST(patches_of_too_many_points_are_refused) {
  grid_mesh g;
  const tw_mesh mesh = grid_of(&g, 16, 16);
  const tw_edit edits[] = {middle(),
                           {.kind = TW_EDIT_FILL, .fill = {.max_edges = 40, .method = TW_FILL_FAIR}}};
  const tw_edit_limits limits = {.points = 400, .faces = 1 << 20, .corners = 1 << 20, .work = 1 << 20},
                       few = {.points = 17 * 17, .faces = 1 << 20, .corners = 1 << 20, .work = 1 << 20};
  tw_mesh out;
  tw_error error;
  tw_arena *arena = tw_arena_create();
  assert_int_equal(tw_mesh_edit(&mesh, NULL, edits, 2, &limits, arena, &out, NULL, NULL, NULL, &error),
                   TW_OK);
  assert_true(out.point_count <= limits.points);
  assert_int_equal(tw_mesh_edit(&mesh, NULL, edits, 2, &few, arena, &out, NULL, NULL, NULL, &error),
                   TW_LIMIT);
  assert_string_equal(error.pointer, "/1");
  tw_arena_destroy(arena);
}

TEST(every_failed_allocation_of_a_fair_patch_is_told) {
  grid_mesh g;
  const tw_mesh mesh = grid_of(&g, 16, 16);
  const tw_edit edits[] = {middle(),
                           {.kind = TW_EDIT_FILL, .fill = {.max_edges = 40, .method = TW_FILL_FAIR}}};
  size_t failures = 0;
  for (tw_status status = TW_NO_MEMORY; status != TW_OK; failures++) {
    tw_arena *arena = tw_arena_create();
    tw_mesh out = {0};
    test_memory.left = failures;
    status = tw_mesh_edit(&mesh, NULL, edits, 2, &roomy, arena, &out, NULL, NULL, NULL, NULL);
    test_memory.left = SIZE_MAX;
    assert_true(status == TW_OK || (status == TW_NO_MEMORY && out.point_count == 0));
    tw_arena_destroy(arena);
  }
  assert_true(failures > 40);
}

/* A regular polygon of unit edges, a face whose other side is a hole. */
static scan polygon(uint32_t count) {
  const double turn = 2 * 3.14159265358979323846 / count;
  scan s = {.arena = tw_arena_create()};
  uint32_t *offsets = tw_arena_alloc(s.arena, 2, sizeof *offsets);
  uint32_t *corners = tw_arena_alloc(s.arena, count, sizeof *corners);
  s.points = tw_arena_alloc(s.arena, count, sizeof *s.points);
  assert_true(offsets && corners && s.points);
  offsets[1] = count;
  for (uint32_t i = 0; i < count; i++) {
    corners[i] = i;
    s.points[i][0] = (float)(cos(turn * i) / turn);
    s.points[i][1] = (float)(sin(turn * i) / turn);
  }
  tw_mesh_init(&s.mesh);
  s.mesh.point_count = s.mesh.corner_count = count;
  s.mesh.positions = s.points[0];
  s.mesh.face_count = 1;
  s.mesh.face_offsets = offsets;
  s.mesh.corners = corners;
  return s;
}

/* Applies edits to a polygon. Returns the faces that there are then, 0 where TW_INVALID refuses them; steps:
 * of work. */
static uint32_t edit_polygon(uint32_t count, const tw_edit *edits, uint32_t edit_count, uint64_t *steps,
                             tw_error *error) {
  scan s = polygon(count);
  tw_mesh out;
  tw_meter meter;
  tw_meter_init(&meter, &(tw_meter_host){0}, UINT64_MAX);
  tw_meter *before = tw_meter_use(&meter);
  tw_status status =
      tw_mesh_edit(&s.mesh, NULL, edits, edit_count, &roomy, s.arena, &out, NULL, NULL, NULL, error);
  tw_meter_use(before);
  assert_true(status == TW_OK || status == TW_INVALID);
  *steps = atomic_load(&meter.steps);
  uint32_t faces = status == TW_OK ? out.face_count : 0;
  tw_arena_destroy(s.arena);
  return faces;
}

/* A polygon of n unit edges has an area of about n^2 / 4 pi: fair triangles of half a unit would be millions
 * here. */
TEST(fair_patches_of_huge_holes_are_refused_before_they_are_made) {
  const double pi = 3.14159265358979323846;
  const tw_edit fair = {.kind = TW_EDIT_FILL, .fill.method = TW_FILL_FAIR},
                flat = {.kind = TW_EDIT_FILL, .fill.method = TW_FILL_TRIANGLES};
  uint64_t small_steps, steps;
  tw_error error;
  uint32_t faces = edit_polygon(100, &fair, 1, &small_steps, &error);
  assert_true(faces > 1 + 100 * 100 / (4 * pi) && faces < 1 + 4 * 100 * 100 / (4 * pi));
  assert_int_equal(edit_polygon(3000, &fair, 1, &steps, &error), 0);
  assert_non_null(strstr(error.detail, "250000 points"));
  assert_true(steps < 250000 * 400ull); /* less than making that many points takes */
  assert_int_equal(edit_polygon(3000, &flat, 1, &steps, &error), 1 + 3000 - 2);
}

/* The best cover of a hole compares n^3 / 6 triangles, which a list of edits does not repeat without end. */
TEST(fills_and_deletes_by_turns_share_their_work) {
  enum { TURNS = 64, EDGES = 300 };
  tw_edit edits[2 * TURNS];
  for (uint32_t i = 0; i < TURNS; i++) {
    edits[2 * i] = (tw_edit){.kind = TW_EDIT_FILL, .name = "lid", .fill.method = TW_FILL_TRIANGLES};
    edits[2 * i + 1] =
        (tw_edit){.kind = TW_EDIT_DELETE, .selection = {TW_EDIT_FACES, TW_SELECT_MADE, .name = "lid"}};
  }
  uint64_t once, often;
  tw_error error;
  assert_int_equal(edit_polygon(EDGES, edits, 1, &once, &error), 1 + EDGES - 2);
  assert_int_equal(edit_polygon(EDGES, edits, 2 * TURNS - 1, &often, &error), 1 + EDGES - 2);
  assert_true(often < TURNS / 4 * once);
}

/* Edits that change no faces: what one needs is freed before the next, and what it replaces, too. */
TEST(many_edits_hold_no_more_than_one) {
  enum { EDITS = 64, CELLS = 40 };
  static const tw_edit_kind kinds[] = {TW_EDIT_CREASE, TW_EDIT_CORNER,  TW_EDIT_HOLE, TW_EDIT_MOVE,
                                       TW_EDIT_SMOOTH, TW_EDIT_DESPIKE, TW_EDIT_FLIP};
  static const tw_edit_element of[] = {TW_EDIT_EDGES,    TW_EDIT_VERTICES, TW_EDIT_FACES, TW_EDIT_FACES,
                                       TW_EDIT_VERTICES, TW_EDIT_VERTICES, TW_EDIT_FACES};
  tw_arena *arena = tw_arena_create();
  tw_shape shape;
  tw_mesh grid, out;
  tw_error error;
  tw_shape_init(&shape, TW_SHAPE_GRID);
  shape.segments[0] = shape.segments[2] = CELLS;
  assert_int_equal(tw_shape_make(&shape, arena, &grid, &error), TW_OK);
  for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
    tw_edit edits[EDITS],
        edit = {.kind = kinds[k], .name = "it", .selection = {.of = of[k], .by = TW_SELECT_ALL}};
    int64_t peaks[2];
    if (edit.kind <= TW_EDIT_HOLE && edit.kind >= TW_EDIT_CREASE) edit.sharpness = 2;
    if (edit.kind == TW_EDIT_DESPIKE) edit.despike.factor = 2;
    if (edit.kind == TW_EDIT_SMOOTH) edit.smooth.iterations = 1;
    for (uint32_t i = 0; i < EDITS; i++) edits[i] = edit;
    for (int many = 0; many < 2; many++) {
      tw_arena *own = tw_arena_create();
      tw_meter meter;
      tw_meter_init(&meter, &(tw_meter_host){0}, UINT64_MAX);
      tw_meter *before = tw_meter_use(&meter);
      tw_status status =
          tw_mesh_edit(&grid, NULL, edits, many ? EDITS : 2, &roomy, own, &out, NULL, NULL, NULL, &error);
      tw_meter_use(before);
      if (status != TW_OK) fail_msg("%s: %s", tw_edit_names[edit.kind], error.detail);
      peaks[many] = atomic_load(&meter.peak);
      tw_arena_destroy(own);
    }
    if (peaks[1] > peaks[0] * 5 / 4)
      fail_msg("%s: %lld bytes, %lld for two", tw_edit_names[edit.kind], (long long)peaks[1],
               (long long)peaks[0]);
  }
  tw_arena_destroy(arena);
}
