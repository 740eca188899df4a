/* Irregular neighbourhoods that surfaces share: the same rows as with those of their own, found once, and
 * none that is half made. Linked with malloc, calloc and realloc wrapped. */
#include "built_cage.h"
#include "cube.h"
#include "patch_class.h"
#include "wrapped_memory.h"

enum { CAGES = 4 };

static const uint32_t creased_edges[2][2] = {{0, 1}, {1, 2}};
static const float creased_sharpness[2] = {1.5f, 2.5f};

/* A cube, the same with a semi-sharp crease by either rule, and one whose first face is cut in two. */
static tw_mesh cage_of(int kind, cage *cut) {
  tw_mesh mesh = cube();
  if (kind == 1 || kind == 2) {
    mesh.crease_count = 2;
    mesh.crease_edges = creased_edges[0];
    mesh.crease_sharpness = creased_sharpness;
  }
  if (kind < 3) return mesh;
  for (uint32_t p = 0; p < 8; p++) add_point(cut, cube_points[p][0], cube_points[p][1], cube_points[p][2]);
  for (uint32_t f = 0; f < 6; f++) add_quad(cut, cube_corners + 4 * (size_t)f, f == 0);
  return cut->mesh;
}

static tw_surface_options options_of(int kind, uint32_t level, tw_patch_shapes *shapes) {
  return (tw_surface_options){.level = level,
                              .normals = true,
                              .creasing = kind == 2 ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM,
                              .shapes = shapes};
}

static void assert_same_rows(const rows *a, const rows *b) {
  assert_int_equal(a->count, b->count);
  assert_memory_equal(a->values, b->values, a->count * a->layout->stride * sizeof(float));
}

/* Read with the shapes of the others still there, and after they have been deepened. */
TEST(surfaces_that_share_shapes_have_the_rows_of_those_that_do_not) {
  enum { LEVELS = 5 };
  tw_patch_shapes *shapes = tw_patch_shapes_create();
  assert_non_null(shapes);
  rows shared[CAGES][LEVELS];
  for (uint32_t level = 0; level < LEVELS; level++)
    for (int kind = 0; kind < CAGES; kind++) {
      cage *cut = new_cage();
      tw_mesh mesh = cage_of(kind, cut);
      shared[kind][level] = read_rows(&mesh, options_of(kind, level, shapes));
      free(cut);
    }
  for (uint32_t level = 0; level < LEVELS; level++)
    for (int kind = 0; kind < CAGES; kind++) {
      cage *cut = new_cage();
      tw_mesh mesh = cage_of(kind, cut);
      rows own = read_rows(&mesh, options_of(kind, level, NULL));
      assert_same_rows(&own, &shared[kind][level]);
      tw_surface_reader *reader = tw_surface_reader_create(shared[kind][level].surface);
      assert_non_null(reader);
      tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, own.count, shared[kind][level].values);
      tw_surface_reader_destroy(reader);
      assert_same_rows(&own, &shared[kind][level]);
      free_rows(&own);
      free_rows(&shared[kind][level]);
      free(cut);
    }
  tw_patch_shapes_destroy(shapes);
}

TEST(a_second_cube_adds_no_shape) {
  tw_mesh mesh = cube();
  tw_patch_shapes *shapes = tw_patch_shapes_create();
  rows first = read_rows(&mesh, options_of(0, 4, shapes));
  size_t size = tw_patch_shapes_size(shapes);
  rows second = read_rows(&mesh, options_of(0, 4, shapes)), own = read_rows(&mesh, options_of(0, 4, NULL));
  assert_int_equal(tw_patch_shapes_size(shapes), size);
  assert_int_equal(tw_surface_size(first.surface), tw_surface_size(second.surface));
  assert_true(tw_surface_size(second.surface) + size / 2 < tw_surface_size(own.surface));
  assert_same_rows(&first, &second);
  free_rows(&first);
  free_rows(&second);
  free_rows(&own);
  tw_patch_shapes_destroy(shapes);
}

/* Stencils of surfaces that came before may take all the room there is for them. */
TEST(a_surface_that_finds_no_room_for_stencils_makes_its_own) {
  cage *cut = new_cage();
  tw_mesh mesh = cage_of(3, cut);
  tw_surface_options options = options_of(3, 4, NULL);
  rows wanted = read_rows(&mesh, options);
  options.shapes = tw_patch_shapes_create();
  assert_non_null(options.shapes);
  assert_non_null(tw_arena_alloc(tw_patch_shapes_stencils(options.shapes), 1, (size_t)65 << 20));
  rows own = read_rows(&mesh, options);
  assert_same_rows(&wanted, &own);
  free_rows(&wanted);
  free_rows(&own);
  tw_patch_shapes_destroy(options.shapes);
  free(cut);
}

/* Whichever allocation of one surface fails: the next one does not meet what that has left half made. */
TEST(a_surface_that_fails_leaves_no_half_made_shape) {
  tw_mesh mesh = cage_of(1, NULL);
  tw_surface_options options = options_of(1, 4, NULL);
  rows wanted = read_rows(&mesh, options);
  size_t failures = 0;
  bool failed = true;
  for (size_t n = 0; failed; n++) {
    options.shapes = tw_patch_shapes_create();
    assert_non_null(options.shapes);
    tw_surface *surface = NULL;
    test_memory.left = n;
    tw_status status = tw_surface_create(&mesh, &options, &surface, NULL);
    failed = test_memory.left == SIZE_MAX;
    test_memory.left = SIZE_MAX;
    failures += status != TW_OK;
    if (status == TW_OK)
      tw_surface_destroy(surface);
    else
      assert_int_equal(status, TW_NO_MEMORY);
    rows next = read_rows(&mesh, options);
    assert_same_rows(&wanted, &next);
    free_rows(&next);
    tw_patch_shapes_destroy(options.shapes);
  }
  assert_true(failures > 30);
  free_rows(&wanted);
}
