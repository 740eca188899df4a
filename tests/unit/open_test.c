/* Open borders in all schemes: closed forms, and what the counts foretell against what is built. */
#include "built_cage.h"

#include <stdio.h>

/* ---- counts ---------------------------------------------------------------------------------- */

static int compare_pairs(const void *left, const void *right) {
  return memcmp(left, right, sizeof(uint32_t[2]));
}

static uint64_t count_edges(const uint32_t *faces, uint64_t face_count, uint32_t size) {
  uint64_t count = face_count * size, distinct = 0;
  uint32_t(*pairs)[2] = malloc((count + 1) * sizeof *pairs);
  assert_non_null(pairs);
  for (uint64_t i = 0; i < count; i++) {
    uint32_t a = faces[i], b = faces[i / size * size + (i + 1) % size];
    pairs[i][0] = a < b ? a : b;
    pairs[i][1] = a < b ? b : a;
  }
  qsort(pairs, (size_t)count, sizeof *pairs, compare_pairs);
  for (uint64_t i = 0; i < count; i++) distinct += i == 0 || compare_pairs(pairs[i], pairs[i - 1]) != 0;
  free(pairs);
  return distinct;
}

/* What the counts foretell against what is there. Returns the faces. */
static uint64_t assert_open_counts(const cage *c, tw_scheme scheme, uint32_t level) {
  tw_surface_options options = {.level = level, .scheme = scheme, .boundary = TW_BOUNDARY_OPEN};
  rows r = read_rows(&c->mesh, options);
  const tw_surface_counts *counts = tw_surface_get_counts(r.surface);
  uint64_t built = 0;
  for (uint32_t g = 0; g < tw_surface_group_count(r.surface); g++)
    built += tw_surface_get_group(r.surface, g)->face_count;
  assert_int_equal(built, counts->faces);
  assert_int_equal(tw_surface_row_count(r.surface, TW_DOMAIN_POINTS), counts->vertices);
  uint32_t *faces = faces_of(&r, TW_DOMAIN_POINTS);
  assert_int_equal(count_edges(faces, counts->faces, scheme == TW_LOOP ? 3 : 4), counts->edges);
  free(faces);
  free_rows(&r);
  return built;
}

/* Faces left out so that every kind of border comes up, with points that two borders share. */
static cage *ragged_sheet(bool triangles) {
  static const uint32_t left_out[2][15] = {{0, 7, 11, 12, 28, 39, 40, 60, 61, UINT32_MAX},
                                           {0, 9, 17, 18, 30, 31, 52, 55, 77, 78, 79, 101, 120, 121, 140}};
  enum { COLUMNS = 10, ROWS = 9 };
  cage *whole = grid(COLUMNS, ROWS, triangles, NULL), *c = new_cage_over(whole);
  for (uint32_t f = 0, skipped = 0; f < whole->mesh.face_count; f++) {
    bool skip = skipped < 15 && left_out[triangles][skipped] == f;
    skipped += skip;
    if (!skip) add_face(c, whole->corners + whole->offsets[f], triangles ? 3 : 4);
  }
  free(whole);
  return c;
}

TEST(open_counts_match_what_is_built_on_a_ragged_border) {
  for (int triangles = 0; triangles < 2; triangles++) {
    cage *c = ragged_sheet(triangles);
    for (uint32_t level = 1; level <= 5; level++)
      assert_true(assert_open_counts(c, triangles ? TW_LOOP : TW_CATMULL_CLARK, level) > 0);
    free(c);
  }
}

/* Three half planes that meet on a line. */
static cage *three_sheets(bool triangles) {
  enum { WIDE = 5, LONG = 6 };
  uint32_t names[3][WIDE][LONG];
  cage *c = new_cage();
  for (uint32_t sheet = 0; sheet < 3; sheet++)
    for (uint32_t i = 0; i < WIDE; i++)
      for (uint32_t j = 0; j < LONG; j++) {
        float out = (float)i;
        names[sheet][i][j] = i == 0 && sheet > 0 ? names[0][0][j]
                             : sheet == 0        ? add_point(c, out, (float)j, 0)
                                                 : add_point(c, 0, (float)j, sheet == 1 ? out : -out);
      }
  for (uint32_t sheet = 0; sheet < 3; sheet++)
    for (uint32_t i = 0; i + 1 < WIDE; i++)
      for (uint32_t j = 0; j + 1 < LONG; j++) {
        uint32_t quad[4] = {names[sheet][i][j], names[sheet][i + 1][j], names[sheet][i + 1][j + 1],
                            names[sheet][i][j + 1]};
        add_quad(c, quad, triangles);
      }
  return c;
}

TEST(open_counts_hold_where_three_sheets_meet) {
  for (int triangles = 0; triangles < 2; triangles++) {
    cage *c = three_sheets(triangles);
    for (uint32_t level = 1; level <= 5; level++)
      assert_true(assert_open_counts(c, triangles ? TW_LOOP : TW_CATMULL_CLARK, level) > 0);
    free(c);
  }
}

TEST(open_border_leaves_nothing_of_a_lone_triangle_fan) {
  cage *c = grid(2, 2, true, NULL);
  assert_int_equal(assert_open_counts(c, TW_LOOP, 1), 0);
  assert_int_equal(assert_open_counts(c, TW_LOOP, 3), 0);
  free(c);
}

static float bumps(float x, float y) {
  return 0.3f * (float)(((int)x * 5 + (int)y * 3) % 7);
}

/* ---- closed forms ---------------------------------------------------------------------------- */

static void assert_counts(const cage *c, uint32_t level, uint64_t vertices, uint64_t edges, uint64_t faces) {
  tw_surface_options options = {.level = level, .boundary = TW_BOUNDARY_OPEN, .normals = true};
  tw_surface_counts counts;
  assert_int_equal(tw_surface_count(&c->mesh, &options, &counts, NULL), TW_OK);
  assert_int_equal(counts.vertices, vertices);
  assert_int_equal(counts.edges, edges);
  assert_int_equal(counts.faces, faces);
  rows r = read_rows(&c->mesh, options);
  assert_int_equal(r.count, vertices);
  free_rows(&r);
}

TEST(open_grid_of_16_points_has_25_then_49) {
  cage *c = grid(4, 4, false, NULL);
  uint64_t side = 5;
  for (uint32_t level = 1; level <= 6; level++, side = 2 * side - 3) {
    assert_counts(c, level, side * side, 2 * side * (side - 1), (side - 1) * (side - 1));
    tw_surface_options options = {.level = level, .boundary = TW_BOUNDARY_OPEN};
    rows r = read_rows(&c->mesh, options);
    float min[3], max[3];
    assert_int_equal(tw_surface_bounds(r.surface, -1, min, max), TW_OK);
    /* The plane stays where it was, and shrinks towards its middle face. */
    assert_float_equal(min[0], 1 - 1 / (float)(1u << level), 1e-5);
    assert_float_equal(max[1], 2 + 1 / (float)(1u << level), 1e-5);
    free_rows(&r);
  }
  free(c);
}

/* Bilinear surfaces have a normal for each face of the cage: vertices are split at its edges alone. */
TEST(open_bilinear_surfaces_are_split_at_edges_of_the_cage) {
  cage *c = grid(6, 6, false, bumps);
  for (uint32_t level = 1; level <= 4; level++) {
    uint32_t line = (1u << level) + 1, inner = 3 * 3, beside = 4 * 3, corners = 4;
    rows r = read_rows(
        &c->mesh, (tw_surface_options){
                      .level = level, .scheme = TW_BILINEAR, .boundary = TW_BOUNDARY_OPEN, .normals = true});
    assert_int_equal(r.count, inner * line * line + beside * 2 * line + corners * 4);
    free_rows(&r);
  }
  free(c);
}

static void set_holes(cage *c, const uint32_t *holes, uint32_t count) {
  c->mesh.holes = holes;
  c->mesh.hole_count = count;
}

/* The hole's part of the answer is missing, and nothing else. */
TEST(open_grid_with_a_hole_amid_lacks_its_inside) {
  static const uint32_t middle = 12;
  cage *c = grid(6, 6, false, NULL);
  set_holes(c, &middle, 1);
  uint64_t side = 9, hole = 2;
  for (uint32_t level = 1; level <= 6; level++, side = 2 * side - 3, hole *= 2)
    assert_counts(c, level, side * side - (hole - 1) * (hole - 1),
                  2 * side * (side - 1) - 2 * hole * (hole - 1), (side - 1) * (side - 1) - hole * hole);
  free(c);
}

/* One quarter of a face at a corner goes on, at every level. */
TEST(open_grid_with_a_hole_at_its_corner_lacks_one_quad) {
  static const uint32_t corner = 0;
  cage *c = grid(6, 6, false, NULL);
  set_holes(c, &corner, 1);
  uint64_t side = 9;
  for (uint32_t level = 1; level <= 6; level++, side = 2 * side - 3)
    assert_counts(c, level, side * side - 1, 2 * side * (side - 1) - 2, (side - 1) * (side - 1) - 1);
  free(c);
}

TEST(open_mesh_of_holes_alone_is_empty) {
  static const uint32_t all[9] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  cage *c = grid(4, 4, false, NULL);
  set_holes(c, all, 9);
  for (uint32_t level = 0; level <= 4; level++) assert_counts(c, level, 0, 0, 0);
  free(c);
}

/* ---- holes ----------------------------------------------------------------------------------- */

enum { SCATTERS = 8 };

/* Faces here and there, a third of all, alone and together, at the border and within. */
static uint32_t scatter_holes(const cage *c, uint32_t seed, uint32_t *holes) {
  uint32_t count = 0;
  for (uint32_t f = 0; f < c->mesh.face_count; f++)
    if (((f + 1) * 2654435761u + seed * 40503u) % 97 < 32) holes[count++] = f;
  return count;
}

TEST(open_counts_hold_with_holes_anywhere) {
  uint32_t holes[FACES_MAX];
  for (int triangles = 0; triangles < 2; triangles++)
    for (uint32_t seed = 0; seed < SCATTERS; seed++) {
      cage *c = seed % 2 ? three_sheets(triangles) : ragged_sheet(triangles);
      set_holes(c, holes, scatter_holes(c, seed, holes));
      assert_true(c->mesh.hole_count > 10);
      for (uint32_t level = 1; level <= 4; level++)
        assert_true(assert_open_counts(c, triangles ? TW_LOOP : TW_CATMULL_CLARK, level) > 0);
      free(c);
    }
}

/* The holes as a material of their own, which comes last: the faces before it are the answer with holes. */
static void assert_same_without_holes(cage *c, tw_surface_options options) {
  static int32_t materials[FACES_MAX];
  memset(materials, 0, sizeof materials);
  for (uint32_t i = 0; i < c->mesh.hole_count; i++) materials[c->mesh.holes[i]] = 1;
  rows holed = read_rows(&c->mesh, options);
  tw_mesh full_mesh = c->mesh;
  full_mesh.hole_count = 0;
  full_mesh.face_materials = materials;
  rows full = read_rows(&full_mesh, options);
  uint32_t *few = faces_of(&holed, TW_DOMAIN_VERTICES), *all = faces_of(&full, TW_DOMAIN_VERTICES);
  uint64_t corners = tw_surface_get_counts(holed.surface)->corners;
  assert_true(corners > 0);
  assert_int_equal(corners, tw_surface_get_group(full.surface, 0)->corner_count);
  for (uint64_t i = 0; i < corners; i++)
    assert_memory_equal(row_of(&holed, few[i]), row_of(&full, all[i]), sizeof(float[3]));
  free(few);
  free(all);
  free_rows(&holed);
  free_rows(&full);
}

TEST(open_holes_leave_the_other_points_where_they_are) {
  uint32_t holes[FACES_MAX];
  for (int scheme = TW_CATMULL_CLARK; scheme <= TW_BILINEAR; scheme++)
    for (uint32_t seed = 0; seed < SCATTERS; seed++) {
      cage *c = grid(9, 8, scheme == TW_LOOP, bumps);
      set_holes(c, holes, scatter_holes(c, seed, holes));
      for (uint32_t level = 1; level <= 3; level++)
        assert_same_without_holes(c, (tw_surface_options){.level = level,
                                                          .scheme = (tw_scheme)scheme,
                                                          .boundary = TW_BOUNDARY_OPEN,
                                                          .limit = seed & 1});
      free(c);
    }
}

/* Were the hole taken away, the faces round it would shrink back from it. */
TEST(open_holes_take_part_in_the_rules) {
  static const uint32_t middle = 12;
  cage *c = grid(6, 6, false, bumps);
  set_holes(c, &middle, 1);
  tw_surface_options options = {.level = 2, .boundary = TW_BOUNDARY_OPEN};
  tw_surface_counts held, shrunk;
  assert_int_equal(tw_surface_count(&c->mesh, &options, &held, NULL), TW_OK);
  cage *without = new_cage_over(c);
  for (uint32_t f = 0; f < c->mesh.face_count; f++)
    if (f != middle) add_face(without, c->corners + c->offsets[f], 4);
  assert_int_equal(tw_surface_count(&without->mesh, &options, &shrunk, NULL), TW_OK);
  assert_true(shrunk.faces < held.faces);
  free(without);
  free(c);
}

/* Counts, rows and faces of a Loop mesh with an open border; returns the counts. */
static tw_surface_counts loop_counts(const cage *c, uint32_t level) {
  rows r = read_rows(&c->mesh,
                     (tw_surface_options){.level = level, .scheme = TW_LOOP, .boundary = TW_BOUNDARY_OPEN});
  tw_surface_counts counts = *tw_surface_get_counts(r.surface);
  uint64_t built = 0;
  for (uint32_t g = 0; g < tw_surface_group_count(r.surface); g++)
    built += tw_surface_get_group(r.surface, g)->face_count;
  assert_int_equal(built, counts.faces);
  assert_int_equal(tw_surface_row_count(r.surface, TW_DOMAIN_POINTS), counts.vertices);
  free_rows(&r);
  return counts;
}

/* The middles of two triangles over the same points are over the same points too, and share no edge. Each
 * corner of these has a neighbour with a border. */
TEST(open_triangles_back_to_back_leave_their_middles_apart) {
  static const uint32_t faces[5][3] = {{0, 1, 2}, {0, 2, 1}, {0, 3, 4}, {1, 5, 6}, {2, 7, 8}};
  cage *c = new_cage();
  c->mesh.point_count = 9;
  for (uint32_t f = 0; f < 5; f++) add_face(c, faces[f], 3);
  tw_surface_counts counts = loop_counts(c, 1);
  assert_int_equal(counts.faces, 2);
  assert_int_equal(counts.edges, 6);
  assert_int_equal(counts.vertices, 3);
  for (uint32_t level = 2; level <= 4; level++) assert_int_equal(loop_counts(c, level).faces, 0);
  free(c);
}

TEST(open_counts_hold_where_a_triangle_is_there_twice) {
  for (uint32_t turn = 0; turn < 2; turn++) {
    cage *c = grid(5, 5, true, bumps);
    const uint32_t *inner = c->corners + c->offsets[10]; /* no point of it lies on the border */
    uint64_t without = loop_counts(c, 4).faces;
    add_face(c, (uint32_t[]){inner[0], inner[turn ? 2 : 1], inner[turn ? 1 : 2]}, 3);
    for (uint32_t level = 1; level <= 3; level++) loop_counts(c, level);
    assert_int_equal(loop_counts(c, 4).faces, without + 256);
    free(c);
  }
}

/* ---- random cages ---------------------------------------------------------------------------- */

enum { RANDOM_CAGES = 150 };

static uint32_t next_random(uint32_t *state) {
  *state = *state * 1664525u + 1013904223u;
  return *state >> 8;
}

/* Whether some face has all three points; also where two of them are the same. Two triangles over the same
 * points have inner edges that count_edges cannot tell apart. */
static bool has_face_over(const cage *c, const uint32_t points[3]) {
  if (points[0] == points[2] || points[1] == points[2]) return true;
  for (uint32_t f = 0; f < c->mesh.face_count; f++) {
    uint32_t found = 0;
    for (uint32_t i = c->offsets[f]; i < c->offsets[f + 1]; i++)
      for (uint32_t k = 0; k < 3; k++) found += c->corners[i] == points[k];
    if (found == 3) return true;
  }
  return false;
}

/* A sheet, or a sheet rolled into a tube or a torus, that lacks faces at random, has polygons of five corners
 * beside those of three, and faces between points that are far apart, of which edges get a third face. */
static cage *random_cage(bool triangles, uint32_t seed) {
  enum { WIDE = 9, LONG = 8 };
  uint32_t state = seed, rolled = next_random(&state) % 3, missing = next_random(&state) % 12;
  uint32_t columns = WIDE - (rolled > 0), rows = LONG - (rolled > 1);
  cage *whole = grid(WIDE, LONG, false, NULL), *c = new_cage_over(whole);
  for (uint32_t f = 0; f < whole->mesh.face_count; f++) {
    uint32_t quad[4], kind = next_random(&state) % 8;
    for (uint32_t i = 0; i < 4; i++) {
      uint32_t at = whole->corners[4 * f + i];
      quad[i] = at / WIDE % rows * WIDE + at % WIDE % columns;
    }
    if (next_random(&state) % 60 < missing) continue;
    if (triangles || kind == 0) {
      add_quad(c, quad, true);
    } else if (kind == 1 &&
               c->mesh.point_count < c->points_max) { /* a point amid: a triangle and a pentagon */
      uint32_t amid = add_point(c, 0, 0, 1);
      add_face(c, (uint32_t[]){quad[0], quad[1], amid}, 3);
      add_face(c, (uint32_t[]){quad[1], quad[2], quad[3], quad[0], amid}, 5);
    } else {
      add_face(c, quad, 4);
    }
  }
  for (uint32_t extra = next_random(&state) % 4; extra > 0; extra--) {
    uint32_t f = next_random(&state) % c->mesh.face_count, first = c->offsets[f],
             apex = next_random(&state) % (rows * WIDE);
    const uint32_t triangle[3] = {c->corners[first + 1], c->corners[first], apex};
    if (apex % WIDE < columns && !has_face_over(c, triangle)) add_face(c, triangle, 3);
  }
  free(whole);
  return c;
}

TEST(open_counts_of_random_cages_are_those_of_the_levels_made) {
  static uint32_t holes[FACES_MAX];
  uint64_t faces = 0;
  for (int triangles = 0; triangles < 2; triangles++)
    for (uint32_t seed = 0; seed < RANDOM_CAGES; seed += test_stride()) {
      cage *c = random_cage(triangles, seed);
      if (seed % 3 == 0) set_holes(c, holes, scatter_holes(c, seed, holes));
      for (uint32_t level = 1; level <= 4; level++) {
        faces += assert_open_counts(c, TW_CATMULL_CLARK, level);
        if (triangles) faces += assert_open_counts(c, TW_LOOP, level);
      }
      free(c);
    }
  assert_true(faces > 1000000 / test_stride());
}

/* Nothing is made of what is counted: of a level with more faces than there are numbers too. */
TEST(open_counts_tell_more_than_32_bits) {
  cage *c = grid(4, 4, false, NULL);
  tw_surface_options options = {.level = TW_LEVEL_MAX, .boundary = TW_BOUNDARY_OPEN};
  tw_surface_counts counts = {0, 0, 0, 0};
  assert_int_equal(tw_surface_count(&c->mesh, &options, &counts, NULL), TW_LIMIT);
  uint64_t side = 5;
  for (uint32_t level = 1; level < TW_LEVEL_MAX; level++) side = 2 * side - 3;
  assert_int_equal(counts.faces, (side - 1) * (side - 1));
  assert_int_equal(counts.vertices, side * side);
  free(c);
}

/* ---- memory ---------------------------------------------------------------------------------- */

/* What is asked for is never more than what is held, and not so little that nothing is refused. */
TEST(steps_that_take_more_memory_than_there_is_are_not_begun) {
  for (int scheme = TW_CATMULL_CLARK; scheme <= TW_LOOP; scheme++) {
    cage *c = grid(9, 8, scheme == TW_LOOP, bumps);
    const tw_surface_options options = {
        .level = 5, .scheme = (tw_scheme)scheme, .boundary = TW_BOUNDARY_OPEN, .normals = true};
    const tw_meter_host alone = {0};
    tw_meter all, enough, less;
    tw_surface *surface = NULL, *within = NULL;
    tw_meter_init(&all, &alone, UINT64_MAX);
    tw_meter *before = tw_meter_use(&all);
    assert_int_equal(tw_surface_create(&c->mesh, &options, &surface, NULL), TW_OK);
    const uint64_t size = tw_surface_size(surface), most = (uint64_t)atomic_load(&all.peak);
    tw_surface_destroy(surface);
    tw_meter_init(&enough, &alone, most);
    tw_meter_use(&enough);
    assert_int_equal(tw_surface_create(&c->mesh, &options, &within, NULL), TW_OK);
    tw_surface_destroy(within);
    tw_meter_init(&less, &alone, size / 3);
    tw_meter_use(&less);
    assert_int_equal(tw_surface_create(&c->mesh, &options, &within, NULL), TW_NO_MEMORY);
    tw_meter_use(before);
    assert_true((uint64_t)atomic_load(&less.peak) < size / 10);
    free(c);
  }
}
