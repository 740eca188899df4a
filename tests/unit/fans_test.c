/* Vertices of thousands of faces, and cages all of whose vertices are exceptions. */
#include <math.h>
#include <string.h>
#include <time.h>

#include "evaluator.h"
#include "host.h"
#include "surface_rows.h"

/* Cones of triangles, each with UVs of its own in every set. */
typedef struct cones {
  tw_mesh mesh;
  float (*points)[3], (*uvs)[2], *sharpness;
  uint32_t *offsets, *corners, *uv_corners, (*spokes)[2];
} cones;

static cones make_cones(uint32_t count, uint32_t faces_each, uint32_t uv_sets) {
  uint32_t faces = count * faces_each, points = count * (faces_each + 1);
  cones c = {.points = calloc(points, sizeof *c.points),
             .uvs = calloc(3 * (size_t)faces, sizeof *c.uvs),
             .sharpness = calloc(faces, sizeof *c.sharpness),
             .offsets = calloc((size_t)faces + 1, sizeof *c.offsets),
             .corners = calloc(3 * (size_t)faces, sizeof *c.corners),
             .uv_corners = calloc(3 * (size_t)faces, sizeof *c.uv_corners),
             .spokes = calloc(faces, sizeof *c.spokes)};
  assert_true(c.points && c.uvs && c.sharpness && c.offsets && c.corners && c.uv_corners && c.spokes);
  for (uint32_t f = 0; f < faces; f++) {
    uint32_t i = f % faces_each, tip = f / faces_each * (faces_each + 1), *face = c.corners + 3 * (size_t)f;
    double angle = 2 * 3.14159265 * i / faces_each;
    c.points[tip][2] = 1;
    c.points[tip + 1 + i][0] = (float)cos(angle);
    c.points[tip + 1 + i][1] = (float)sin(angle);
    face[0] = c.spokes[f][0] = tip;
    face[1] = c.spokes[f][1] = tip + 1 + i;
    face[2] = tip + 1 + (i + 1) % faces_each;
    c.sharpness[f] = 9.5F - 0.1F * (float)(f % 7);
    c.offsets[f + 1] = 3 * (f + 1);
    for (uint32_t k = 0; k < 3; k++) c.uv_corners[3 * f + k] = 3 * f + k;
    c.uvs[3 * f + 1][0] = c.uvs[3 * f + 2][1] = 1;
  }
  tw_mesh_init(&c.mesh);
  c.mesh.point_count = points;
  c.mesh.positions = c.points[0];
  c.mesh.face_count = faces;
  c.mesh.corner_count = 3 * faces;
  c.mesh.face_offsets = c.offsets;
  c.mesh.corners = c.corners;
  c.mesh.uv_set_count = uv_sets;
  for (uint32_t s = 0; s < uv_sets; s++) c.mesh.uv_sets[s] = (tw_uv_set){3 * faces, c.uvs[0], c.uv_corners};
  c.mesh.has_tangents = uv_sets > 0;
  return c;
}

static void crease_spokes(cones *c) {
  c->mesh.crease_count = c->mesh.face_count;
  c->mesh.crease_edges = c->spokes[0];
  c->mesh.crease_sharpness = c->sharpness;
}

static void free_cones(cones *c) {
  free(c->points);
  free(c->uvs);
  free(c->sharpness);
  free(c->offsets);
  free(c->corners);
  free(c->uv_corners);
  free(c->spokes);
}

/* All rows of a tip have the tip's mask: one for each row would take 500 MB. */
TEST(rows_of_a_tip_share_its_mask) {
  cones c = make_cones(1, 4000, 1);
  rows r = read_rows(&c.mesh, (tw_surface_options){.level = 1, .normals = true});
  assert_int_equal(r.count, 7 * 4000);
  assert_true(tw_surface_size(r.surface) < 16 << 20);
  for (size_t i = 0; i < r.count; i++) {
    const float *row = row_of(&r, i);
    if (row[0] == 0 && row[1] == 0) assert_true(row[r.layout->normal + 2] > 0.999F);
  }
  free_rows(&r);
  free_cones(&c);
}

/* Computed step by step from the cage for each row, the decay of the spokes would take minutes. */
TEST(a_tip_all_of_whose_spokes_decay_is_read_in_seconds) {
  cones c = make_cones(1, 2000, 1);
  crease_spokes(&c);
  for (uint32_t level = 0; level < 2; level++) {
    clock_t begin = clock();
    rows r = read_rows(&c.mesh,
                       (tw_surface_options){.level = level, .creasing = TW_CREASE_CHAIKIN, .normals = true});
    assert_true((double)(clock() - begin) / CLOCKS_PER_SEC < 15);
    free_rows(&r);
  }
  free_cones(&c);
}

TEST(tips_whose_rows_would_take_long_are_refused) {
  cones c = make_cones(6, 4000, 1);
  for (uint32_t level = 0; level < 3; level++) {
    const tw_surface_options options = {.level = level, .normals = true}, bare = {.level = level};
    tw_surface *surface;
    tw_error error;
    assert_int_equal(tw_surface_create(&c.mesh, &options, &surface, &error), TW_LIMIT);
    assert_non_null(strstr(error.detail, "thousands of faces"));
    if (level > 1) continue;
    assert_int_equal(tw_surface_create(&c.mesh, &bare, &surface, &error), TW_OK);
    tw_surface_destroy(surface);
  }
  free_cones(&c);
}

/* ---- memory ---------------------------------------------------------------------------------- */

/* Makes a surface under a meter that allows `limit` bytes, and expects `expected`. evaluator: the one that it
 * must have; NULL: any. Returns the most bytes that were held at a time. */
static uint64_t make_within(const tw_mesh *mesh, uint32_t level, uint64_t limit, tw_status expected,
                            const tw_evaluator *evaluator) {
  const tw_surface_options options = {.level = level, .normals = true};
  const tw_meter_host host = {NULL, NULL, NULL};
  tw_meter meter;
  tw_surface *surface = NULL;
  tw_meter_init(&meter, &host, limit);
  tw_meter *before = tw_meter_use(&meter);
  assert_int_equal(tw_surface_create(mesh, &options, &surface, NULL), expected);
  if (evaluator) assert_ptr_equal(surface->evaluator, evaluator);
  tw_surface_destroy(surface);
  tw_meter_use(before);
  assert_int_equal(atomic_load(&meter.held), 0);
  return (uint64_t)atomic_load(&meter.peak);
}

TEST(a_surface_whose_exceptions_take_too_much_is_not_made) {
  cones c = make_cones(200, 6, 1);
  for (uint32_t level = 1; level <= 3; level++) {
    uint64_t most = make_within(&c.mesh, level, UINT64_MAX, TW_OK, NULL);
    make_within(&c.mesh, level, most + most / 16, TW_OK, NULL); /* malloc may give a block a little more */
    make_within(&c.mesh, level, most / 2, TW_NO_MEMORY, NULL);
  }
  free_cones(&c);
}

/* Exceptions everywhere take many times what the points take: patches do without. */
TEST(a_cage_of_exceptions_is_made_of_patches) {
  cones c = make_cones(2000, 6, TW_UV_SETS_MAX);
  make_within(&c.mesh, 3, 192 << 20, TW_OK, &tw_patch_evaluator);
  free_cones(&c);
}

/* So do exceptions at a third of the answer, which would take twice the answer's memory. */
TEST(a_cage_of_many_exceptions_is_made_of_patches) {
  cones c = make_cones(1500, 6, 1);
  crease_spokes(&c);
  for (uint32_t level = 2; level <= 3; level++)
    make_within(&c.mesh, level, 64 << 20, TW_OK, &tw_patch_evaluator);
  free_cones(&c);
}

/* ---- cancelling ------------------------------------------------------------------------------ */

static bool is_unwanted(void *owner) {
  uint32_t *left = owner;
  return *left == 0 || --*left == 0;
}

/* Makes a surface that is not wanted any more when it asks for the nth time. Returns how often it asked. */
static uint32_t ask(const tw_mesh *mesh, uint32_t nth, tw_status expected) {
  const tw_surface_options options = {.level = 2, .normals = true};
  uint32_t left = nth;
  const tw_parallel_for parallel = {&left, run_in_order, is_unwanted};
  tw_surface *surface = NULL;
  assert_int_equal(tw_surface_create_by(mesh, &options, &parallel, &surface, NULL), expected);
  tw_surface_destroy(surface);
  return nth - left;
}

TEST(listing_exceptions_asks_whether_they_are_wanted) {
  cones few = make_cones(1, 6, 1), many = make_cones(600, 6, 1);
  uint32_t times = ask(&many.mesh, UINT32_MAX, TW_OK);
  assert_true(times > ask(&few.mesh, UINT32_MAX, TW_OK) + 20);
  for (uint32_t nth = 1; nth <= times; nth += times / 4) ask(&many.mesh, nth, TW_CANCELLED);
  free_cones(&few);
  free_cones(&many);
}
