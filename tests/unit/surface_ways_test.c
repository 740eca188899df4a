/* Surfaces are the same to the last bit however they are made and read: moved to their positions, by several
 * threads, with the classes of other surfaces, in memory that held something, in
 * blocks of any size. */
#include <malloc.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cube.h"
#include "host.h"
#include "scene_fixture.h"
#include "test.h"
#include "torus_cage.h"

/* ---- cages ----------------------------------------------------------------------------------- */

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

/* ---- comparing ------------------------------------------------------------------------------- */

/* All rows of a domain, or all faces, in blocks of one to 97. */
static void *read_blocks(const tw_surface *s, tw_domain domain, bool faces, size_t count, size_t width) {
  uint32_t *out = calloc(count * width + 1, sizeof *out); /* or floats */
  tw_surface_reader *reader = tw_surface_reader_create(s);
  assert_non_null(out);
  assert_non_null(reader);
  uint32_t *at = out;
  for (size_t first = 0, block = 1; first < count; first += block, block = block % 97 + 1) {
    if (block > count - first) block = count - first;
    if (faces) {
      at += tw_surface_read_faces(reader, domain, first, block, NULL, at);
    } else {
      tw_surface_read_rows(reader, domain, first, block, (float *)at);
      at += block * width;
    }
  }
  tw_surface_reader_destroy(reader);
  return out;
}

static void assert_same_rows(const tw_surface *a, const tw_surface *b, tw_domain domain) {
  size_t count = (size_t)tw_surface_row_count(a, domain), width = 3;
  if (domain == TW_DOMAIN_UVS) width = 2;
  if (domain == TW_DOMAIN_VERTICES) width = tw_surface_get_layout(a)->stride;
  assert_int_equal(tw_surface_row_count(b, domain), count);
  float *whole = malloc((count * width + 1) * sizeof *whole);
  tw_surface_reader *reader = tw_surface_reader_create(a);
  assert_non_null(whole);
  assert_non_null(reader);
  tw_surface_read_rows(reader, domain, 0, count, whole);
  tw_surface_reader_destroy(reader);
  void *blocks = read_blocks(b, domain, false, count, width);
  assert_memory_equal(whole, blocks, count * width * sizeof *whole);
  free(whole);
  free(blocks);
}

static void assert_same_faces(const tw_surface *a, const tw_surface *b) {
  const tw_surface_counts *counts = tw_surface_get_counts(a);
  uint32_t *whole = malloc((counts->corners + 1) * sizeof *whole);
  tw_surface_reader *reader = tw_surface_reader_create(a);
  assert_non_null(whole);
  assert_non_null(reader);
  tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, 0, (size_t)counts->faces, NULL, whole);
  tw_surface_reader_destroy(reader);
  assert_int_equal(tw_surface_get_counts(b)->corners, counts->corners);
  void *blocks = read_blocks(b, TW_DOMAIN_VERTICES, true, (size_t)counts->faces,
                             counts->faces ? (size_t)(counts->corners / counts->faces + 1) : 0);
  assert_memory_equal(whole, blocks, counts->corners * sizeof *whole);
  free(whole);
  free(blocks);
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

/* ---- ways ------------------------------------------------------------------------------------ */

static const tw_parallel_for backwards = {.run = run_backwards};

/* Made of other positions, and moved to where the mesh is; then moved on, and back. */
static void check_moves(const tw_mesh *mesh, tw_surface_options options, const tw_surface *expected) {
  tw_surface *plan, *moved, *elsewhere, *back;
  float *positions = displaced(mesh, 1);
  tw_mesh other = *mesh;
  other.positions = positions;
  options.movable = true;
  assert_int_equal(tw_surface_create(&other, &options, &plan, NULL), TW_OK);
  assert_int_equal(tw_surface_with_positions_by(plan, mesh->positions, &backwards, &moved), TW_OK);
  assert_same(expected, moved);
  assert_int_equal(tw_surface_with_positions_by(moved, positions, NULL, &elsewhere), TW_OK);
  assert_same(plan, elsewhere);
  assert_int_equal(tw_surface_with_positions_by(elsewhere, mesh->positions, NULL, &back), TW_OK);
  assert_same(expected, back);
  tw_surface_destroy(back);
  tw_surface_destroy(elsewhere);
  tw_surface_destroy(moved);
  tw_surface_destroy(plan);
  free(positions);
}

static void check_way(const tw_mesh *mesh, tw_surface_options options, const tw_parallel_for *parallel,
                      const tw_surface *expected) {
  tw_surface *surface;
  assert_int_equal(tw_surface_create_by(mesh, &options, parallel, &surface, NULL), TW_OK);
  assert_same(expected, surface);
  tw_surface_destroy(surface);
}

/* classes: of the surfaces before. */
static void check_ways(const tw_mesh *mesh, tw_surface_options options, tw_patch_classes *classes) {
  tw_surface *expected;
  assert_int_equal(tw_mesh_check(mesh, NULL, NULL), TW_OK);
  assert_int_equal(tw_surface_create(mesh, &options, &expected, NULL), TW_OK);
  check_moves(mesh, options, expected);
  check_way(mesh, options, &backwards, expected);
  mallopt(M_PERTURB, 0xB4); /* what fresh memory is filled with */
  check_way(mesh, options, NULL, expected);
  mallopt(M_PERTURB, 0);
  options.classes = classes;
  check_way(mesh, options, NULL, expected);
  tw_surface_destroy(expected);
}

/* bits: one combination of everything that has two sides. */
static tw_surface_options options_of(uint32_t bits) {
  return (tw_surface_options){.limit = bits & 1,
                              .normals = bits & 2,
                              .creasing = bits & 4 ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM,
                              .triangles = bits & 8 ? TW_TRIANGLES_SMOOTH : TW_TRIANGLES_CATMULL_CLARK};
}

static void check_all_options(const tw_mesh *mesh, bool loop) {
  tw_patch_classes *classes = tw_patch_classes_create();
  assert_non_null(classes);
  for (uint32_t bits = 0; bits < 16; bits += test_stride())
    for (tw_boundary boundary = TW_BOUNDARY_EDGE_AND_CORNER; boundary <= TW_BOUNDARY_OPEN; boundary++)
      for (uint32_t level = 0; level <= 3; level++) {
        tw_surface_options options = options_of(bits);
        options.level = level;
        options.boundary = boundary;
        options.uv = level % 2 ? TW_UV_CORNERS_ONLY : TW_UV_ALL;
        for (tw_scheme scheme = TW_CATMULL_CLARK; scheme <= TW_BILINEAR; scheme++) {
          options.scheme = scheme;
          bool known = options.triangles == TW_TRIANGLES_CATMULL_CLARK || scheme == TW_CATMULL_CLARK;
          if (known && (scheme != TW_LOOP || loop)) check_ways(mesh, options, classes);
        }
      }
  tw_patch_classes_destroy(classes);
}

static void check_cage(const char *obj, bool loop) {
  fixture f;
  fixture_init(&f, obj);
  check_all_options(&f.model->meshes[0], loop);
  tag(&f.model->meshes[0]);
  check_all_options(&f.model->meshes[0], loop);
  fixture_deinit(&f);
}

/* ---- tests ----------------------------------------------------------------------------------- */

TEST(quads_are_the_same) {
  check_cage(cube_text, false);
  check_cage(quads_text, false);
}

TEST(triangles_are_the_same_in_all_schemes) {
  check_cage(fan_text, true);
  check_cage(closed_text, true);
}

/* Seams, materials, tangents, colours, joints and displacements stay with the plan. */
TEST(polygons_are_the_same_with_all_that_they_bear) {
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

/* Of many valences, with borders that touch, with edges of three faces, creased or not. */
TEST(large_cages_are_the_same) {
  tw_patch_classes *classes = tw_patch_classes_create();
  assert_non_null(classes);
  for (uint32_t i = 0; i < 4 * 3 * 4; i++) {
    torus_faces faces = (torus_faces)(i % 4);
    cage *c = torus(faces, (torus_gaps)(i / 4 % 3), i % 5 == 0);
    if (i % 3 == 0) crease_some(c, i % 2 ? 1.5f : TW_SHARPNESS_INFINITE);
    tw_surface_options options = options_of(i / 3);
    options.triangles = TW_TRIANGLES_CATMULL_CLARK;
    options.level = 1 + i / 12;
    check_ways(&c->mesh, options, classes);
    options.scheme = TW_LOOP;
    if (faces <= TORUS_TURNED_TRIANGLES) check_ways(&c->mesh, options, classes);
    free(c);
  }
  tw_patch_classes_destroy(classes);
}

static float bumps(float x, float y) {
  return sinf(2 * x + y) + 0.3f * cosf(3 * y);
}

/* Deep enough for whole blocks of every kernel; with points that coincide, some normals need a closer look.
 */
TEST(deep_levels_are_the_same) {
  tw_patch_classes *classes = tw_patch_classes_create();
  assert_non_null(classes);
  for (int cut = 0; cut < 2; cut++)
    for (int flat = 0; flat < 2; flat++)
      for (uint32_t level = 4; level <= 6; level++) {
        cage *c = grid(5, 5, cut, bumps);
        if (flat) memcpy(c->points[12], c->points[13], sizeof c->points[12]);
        crease_some(c, flat ? 0 : 1.5f);
        check_ways(&c->mesh, (tw_surface_options){.level = level, .limit = level % 2, .normals = true},
                   classes);
        free(c);
      }
  tw_patch_classes_destroy(classes);
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
        assert_int_equal(tw_surface_with_positions_by(surface, cube_points[0], NULL, &moved), TW_OK);
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
  assert_int_equal(tw_surface_with_positions_by(plan, cube_points[0], NULL, &moved), TW_OK);
  assert_in_range(tw_surface_size(moved), sizeof cube_points, sizeof cube_points + 4096);
  tw_surface_destroy(moved);
  tw_surface_destroy(plan);
}
