/* One plan over many positions: the same bytes as a surface of the moved mesh, whatever the options. */
#include <math.h>
#include <string.h>

#include "cube.h"
#include "scene_fixture.h"
#include "test.h"

/* ---- cages ---------------------------------------------------------------------------------- */

/* Triangles with a border, a crease across it and a point that no face uses. */
static const char fan_text[] = "o fan\nv 9 9 9\n"
                               "v 0 0 1\nv 2 0 0\nv 1 2 0.2\nv -1 2 0\nv -2 0 0.3\nv -1 -2 0\nv 1 -2 0.1\n"
                               "v 3 2 0\nv 3 -2 0\n"
                               "f 2 3 4\nf 2 4 5\nf 2 5 6\nf 2 6 7\nf 2 7 8\nf 2 8 3\nf 3 9 4\nf 8 10 3\n";

static const char closed_text[] = "o octahedron\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv -1 0 0\nv 0 -1 0\nv 0 0 -1\n"
                                  "f 1 2 3\nf 2 4 3\nf 4 5 3\nf 5 1 3\nf 2 1 6\nf 4 2 6\nf 5 4 6\nf 1 5 6\n";

/* Two quads that share no points, one of which has a point more than its face: unused points among used. */
static const char quads_text[] = "o sheet\nv 0 0 0\nv 1 0 0\nv 7 7 7\nv 2 0 0\nv 0 1 0\nv 1 1 0.4\nv 2 1 0\n"
                                 "v 0 2 0.2\nv 1 2 0\nv 2 2 0.3\n"
                                 "f 1 2 6 5\nf 2 4 7 6\nf 5 6 9 8\nf 6 7 10 9\n";

/* Tags that reach into every rule: semi-sharp and infinite creases and points, and a hole. */
static void tag(tw_mesh *mesh) {
  static uint32_t edges[4], points[1], holes[1];
  static const float edge_sharpness[2] = {1.6f, TW_SHARPNESS_INFINITE}, point_sharpness[1] = {2.3f};
  for (uint32_t i = 0; i < 2; i++) {
    edges[2 * i] = mesh->corners[i];
    edges[2 * i + 1] = mesh->corners[i + 1];
  }
  points[0] = mesh->corners[mesh->face_offsets[1]];
  holes[0] = mesh->face_count - 1;
  mesh->crease_count = 2;
  mesh->crease_edges = edges;
  mesh->crease_sharpness = edge_sharpness;
  mesh->sharp_point_count = 1;
  mesh->sharp_points = points;
  mesh->point_sharpness = point_sharpness;
  mesh->hole_count = 1;
  mesh->holes = holes;
}

/* Somewhere else for every point. */
static float *displaced(const tw_mesh *mesh, float phase) {
  float *out = malloc((3 * (size_t)mesh->point_count + 1) * sizeof *out);
  assert_non_null(out);
  for (uint32_t i = 0; i < 3 * mesh->point_count; i++)
    out[i] = 1.25f * mesh->positions[i] + sinf(phase + 0.7f * (float)i);
  return out;
}

/* ---- comparing ------------------------------------------------------------------------------ */

static void assert_same_rows(const tw_surface *a, const tw_surface *b, tw_domain domain) {
  size_t count = (size_t)tw_surface_row_count(a, domain), width = 3;
  if (domain == TW_DOMAIN_UVS) width = 2;
  if (domain == TW_DOMAIN_VERTICES) width = tw_surface_get_layout(a)->stride;
  assert_int_equal(tw_surface_row_count(b, domain), count);
  const tw_surface *both[2] = {a, b};
  float *rows[2];
  for (int i = 0; i < 2; i++) {
    rows[i] = malloc((count * width + 1) * sizeof(float));
    tw_surface_reader *reader = tw_surface_reader_create(both[i]);
    assert_non_null(rows[i]);
    assert_non_null(reader);
    tw_surface_read_rows(reader, domain, 0, count, rows[i]);
    tw_surface_reader_destroy(reader);
  }
  assert_memory_equal(rows[0], rows[1], count * width * sizeof(float));
  free(rows[0]);
  free(rows[1]);
}

static void assert_same_faces(const tw_surface *a, const tw_surface *b) {
  const tw_surface_counts *counts = tw_surface_get_counts(a);
  const tw_surface *both[2] = {a, b};
  uint32_t *faces[2];
  for (int i = 0; i < 2; i++) {
    faces[i] = malloc((counts->corners + 1) * sizeof(uint32_t));
    tw_surface_reader *reader = tw_surface_reader_create(both[i]);
    assert_non_null(faces[i]);
    assert_non_null(reader);
    tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, 0, (size_t)counts->faces, NULL, faces[i]);
    tw_surface_reader_destroy(reader);
  }
  assert_memory_equal(faces[0], faces[1], counts->corners * sizeof(uint32_t));
  free(faces[0]);
  free(faces[1]);
}

static void assert_same(const tw_surface *a, const tw_surface *b) {
  for (tw_domain domain = TW_DOMAIN_POINTS; domain <= TW_DOMAIN_VERTICES; domain++)
    assert_same_rows(a, b, domain);
  assert_same_faces(a, b);
  for (int morph = -1; morph < (int)tw_surface_get_layout(a)->morph_count; morph++) {
    float bounds[2][2][3];
    assert_int_equal(tw_surface_bounds(a, morph, bounds[0][0], bounds[0][1]), TW_OK);
    assert_int_equal(tw_surface_bounds(b, morph, bounds[1][0], bounds[1][1]), TW_OK);
    assert_memory_equal(bounds[0], bounds[1], sizeof bounds[0]);
  }
}

/* A plan of the mesh, moved twice, the second time from what the first gave. */
static void check_moves(const tw_mesh *mesh, tw_surface_options options) {
  tw_surface *plan, *moved, *again, *fresh;
  tw_error error;
  options.movable = true;
  tw_status status = tw_surface_create(mesh, &options, &plan, &error);
  if (status == TW_UNSUPPORTED || status == TW_INVALID) return; /* a border that shrinks, with holes */
  assert_int_equal(status, TW_OK);
  options.movable = false;
  float *first = displaced(mesh, 1), *second = displaced(mesh, 2);
  assert_int_equal(tw_surface_with_positions(plan, first, &moved), TW_OK);
  assert_int_equal(tw_surface_with_positions(moved, second, &again), TW_OK);
  tw_mesh other = *mesh;
  other.positions = first;
  assert_int_equal(tw_surface_create(&other, &options, &fresh, &error), TW_OK);
  assert_same(moved, fresh);
  tw_surface_destroy(moved);
  tw_surface_destroy(fresh);
  other.positions = second;
  assert_int_equal(tw_surface_create(&other, &options, &fresh, &error), TW_OK);
  assert_same(again, fresh);
  tw_surface_destroy(fresh);
  tw_surface_destroy(again);
  free(first);
  free(second);
  assert_int_equal(tw_surface_create(mesh, &options, &fresh, &error), TW_OK);
  assert_same(plan, fresh);
  tw_surface_destroy(fresh);
  tw_surface_destroy(plan);
}

/* bits: one combination of everything that has two sides. */
static tw_surface_options options_of(uint32_t bits) {
  return (tw_surface_options){.limit = bits & 1,
                              .normals = bits & 2,
                              .creasing = bits & 4 ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM,
                              .triangles = bits & 8 ? TW_TRIANGLES_SMOOTH : TW_TRIANGLES_CATMULL_CLARK};
}

static void check_all_options(const tw_mesh *mesh, bool loop) {
  for (uint32_t bits = 0; bits < 16; bits++)
    for (tw_boundary boundary = TW_BOUNDARY_EDGE_AND_CORNER; boundary <= TW_BOUNDARY_OPEN; boundary++)
      for (uint32_t level = 0; level <= 3; level++) {
        tw_surface_options options = options_of(bits);
        options.level = level;
        options.boundary = boundary;
        options.uv = level % 2 ? TW_UV_CORNERS_ONLY : TW_UV_ALL;
        for (tw_scheme scheme = TW_CATMULL_CLARK; scheme <= TW_BILINEAR; scheme++) {
          options.scheme = scheme;
          bool known = options.triangles == TW_TRIANGLES_CATMULL_CLARK || scheme == TW_CATMULL_CLARK;
          if (known && (scheme != TW_LOOP || loop)) check_moves(mesh, options);
        }
      }
}

static void check_cage(const char *obj, bool loop) {
  fixture f;
  fixture_init(&f, obj);
  check_all_options(&f.model->meshes[0], loop);
  tag(&f.model->meshes[0]);
  check_all_options(&f.model->meshes[0], loop);
  fixture_deinit(&f);
}

/* ---- tests ---------------------------------------------------------------------------------- */

TEST(quads_move) {
  check_cage(cube_text, false);
  check_cage(quads_text, false);
}

TEST(triangles_move_in_all_schemes) {
  check_cage(fan_text, true);
  check_cage(closed_text, true);
}

/* Seams, materials, tangents, colours, joints and displacements stay with the plan. */
TEST(polygons_move_with_all_that_they_bear) {
  check_cage(patchwork_text, false);
  fixture f;
  fixture_init(&f, patchwork_text);
  f.model->meshes[0].has_tangents = true;
  fixture_add_morphs(&f, 2);
  fixture_add_colors(&f);
  fixture_add_skin(&f);
  check_all_options(&f.model->meshes[0], false);
  fixture_deinit(&f);
}

/* What a caller hands over need not live on. */
TEST(a_surface_outlives_its_mesh) {
  for (uint32_t level = 0; level < 3; level++)
    for (int movable = 0; movable < 2; movable++) {
      tw_surface_options options = {.level = level, .normals = true, .movable = movable};
      tw_mesh mesh = cube();
      uint32_t corners[24];
      float points[24];
      memcpy(corners, cube_corners, sizeof corners);
      memcpy(points, cube_points, sizeof points);
      mesh.corners = corners;
      mesh.positions = points;
      tw_surface *surface, *moved, *fresh;
      assert_int_equal(tw_surface_create(&mesh, &options, &surface, NULL), TW_OK);
      memset(corners, 0, sizeof corners);
      memset(points, 0, sizeof points);
      mesh = cube();
      options.movable = false;
      assert_int_equal(tw_surface_create(&mesh, &options, &fresh, NULL), TW_OK);
      assert_same(surface, fresh);
      if (movable) {
        assert_int_equal(tw_surface_with_positions(surface, cube_points[0], &moved), TW_OK);
        assert_same(moved, fresh);
        tw_surface_destroy(moved);
      }
      tw_surface_destroy(fresh);
      tw_surface_destroy(surface);
    }
}

/* The base of a cube is its 8 points, at any level. */
TEST(a_moved_surface_holds_little_more_than_its_points) {
  tw_mesh mesh = cube();
  const tw_surface_options options = {.level = 6, .movable = true};
  tw_surface *plan, *moved;
  assert_int_equal(tw_surface_create(&mesh, &options, &plan, NULL), TW_OK);
  assert_int_equal(tw_surface_with_positions(plan, cube_points[0], &moved), TW_OK);
  assert_in_range(tw_surface_size(moved), sizeof cube_points, sizeof cube_points + 4096);
  tw_surface_destroy(moved);
  tw_surface_destroy(plan);
}
