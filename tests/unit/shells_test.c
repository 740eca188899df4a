/* Shells of answers, against a search over all of their faces. */
#include <math.h>
#include <stdio.h>

#include "host.h"
#include "scene_fixture.h"
#include "tweend/shells.h"
#include "wrapped_memory.h"

/* ---- a search over all faces ----------------------------------------------------------------- */

typedef struct side { /* of a face: an edge of the answer, in one direction */
  uint32_t low, high, face;
  bool is_down;
} side;

typedef struct found {
  uint32_t count, *of; /* the shell of each face */
  tw_shell *shells;
} found;

static int compare_sides(const void *left, const void *right) {
  const side *a = left, *b = right;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  return a->high != b->high ? (a->high < b->high ? -1 : 1) : 0;
}

static uint32_t root(const uint32_t *sets, uint32_t item) {
  while (sets[item] != item) item = sets[item];
  return item;
}

static void join(const side *sides, size_t count, uint32_t *sets) {
  for (size_t i = 1; i < count; i++) {
    uint32_t a = root(sets, sides[0].face), b = root(sets, sides[i].face);
    sets[a > b ? a : b] = a > b ? b : a;
  }
}

static void count_edge(const side *sides, size_t count, tw_shell *shell) {
  shell->open_edges += count == 1;
  shell->crowded_edges += count > 2;
  shell->flipped_edges += count == 2 && sides[0].is_down == sides[1].is_down;
}

static void add_face(const float *rows, const uint32_t *corners, uint32_t size, tw_shell *shell) {
  shell->faces++;
  shell->triangles += size - 2;
  for (uint32_t i = 2; i < size; i++) { /* the fan from the first corner */
    double p[3][3], n[3];
    for (int k = 0; k < 3; k++)
      for (int c = 0; c < 3; c++)
        p[k][c] = (double)rows[3 * (size_t)corners[k == 0 ? 0 : i - 2 + (uint32_t)k] + (size_t)c];
    for (int c = 0; c < 3; c++) {
      int d = (c + 1) % 3, e = (c + 2) % 3;
      n[c] = (p[1][d] - p[0][d]) * (p[2][e] - p[0][e]) - (p[1][e] - p[0][e]) * (p[2][d] - p[0][d]);
    }
    shell->area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
    shell->volume += (p[0][0] * n[0] + p[0][1] * n[1] + p[0][2] * n[2]) / 6;
  }
}

/* By brute force. The shells are in the order of their first faces in the answer. */
static found search(const tw_surface *surface) {
  const tw_surface_counts *counts = tw_surface_get_counts(surface);
  uint32_t faces = (uint32_t)counts->faces, sides_count = (uint32_t)counts->corners;
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  float *rows = malloc(counts->vertices * 3 * sizeof *rows + 1);
  uint32_t *corners = malloc(sides_count * sizeof *corners), *sizes = malloc(faces * sizeof *sizes),
           *sets = malloc(faces * sizeof *sets), *number = malloc(faces * sizeof *number);
  side *sides = malloc(sides_count * sizeof *sides);
  found out = {.of = malloc(faces * sizeof *out.of), .shells = calloc(faces, sizeof *out.shells)};
  assert_true(reader && rows && corners && sizes && sets && number && sides && out.of && out.shells);
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, (size_t)counts->vertices, rows);
  tw_surface_read_faces(reader, TW_DOMAIN_POINTS, 0, faces, sizes, corners);
  for (uint32_t f = 0, at = 0; f < faces; at += sizes[f++]) {
    sets[f] = f;
    for (uint32_t i = 0; i < sizes[f]; i++) {
      uint32_t from = corners[at + i], to = corners[at + (i + 1) % sizes[f]];
      sides[at + i] = (side){from < to ? from : to, from < to ? to : from, f, from > to};
    }
  }
  qsort(sides, sides_count, sizeof *sides, compare_sides);
  for (uint32_t i = 0, j; i < sides_count; i = j) {
    for (j = i + 1; j < sides_count && compare_sides(&sides[i], &sides[j]) == 0;) j++;
    join(sides + i, j - i, sets);
  }
  for (uint32_t f = 0, at = 0; f < faces; at += sizes[f++]) {
    if (root(sets, f) == f) number[f] = out.count++;
    out.of[f] = number[root(sets, f)];
    add_face(rows, corners + at, sizes[f], &out.shells[out.of[f]]);
  }
  for (uint32_t i = 0, j; i < sides_count; i = j) {
    for (j = i + 1; j < sides_count && compare_sides(&sides[i], &sides[j]) == 0;) j++;
    count_edge(sides + i, j - i, &out.shells[out.of[sides[i].face]]);
  }
  tw_surface_reader_destroy(reader);
  free(rows);
  free(corners);
  free(sizes);
  free(sets);
  free(number);
  free(sides);
  return out;
}

/* ---- comparison ------------------------------------------------------------------------------ */

static bool is_near(double a, double b) {
  return fabs(a - b) <= 1e-5 * (1 + fabs(a) + fabs(b));
}

static bool is_same(const tw_shell *own, const tw_shell *wanted) {
  bool is_closed = wanted->open_edges + wanted->crowded_edges + wanted->flipped_edges == 0;
  return own->faces == wanted->faces && own->triangles == wanted->triangles &&
         own->open_edges == wanted->open_edges && own->crowded_edges == wanted->crowded_edges &&
         own->flipped_edges == wanted->flipped_edges && own->is_closed == is_closed &&
         is_near(own->area, wanted->area) && is_near(own->volume, is_closed ? wanted->volume : 0);
}

/* Every shell is found once, in any order. */
static void assert_shells(const tw_surface *surface, const char *what) {
  tw_shell *shells;
  uint32_t count, level = tw_surface_get_options(surface)->level;
  tw_error error;
  if (tw_shells_measure(surface, NULL, &shells, &count, &error) != TW_OK) fail_msg("%s", error.detail);
  found wanted = search(surface);
  if (count != wanted.count) fail_msg("%s, level %u: %u shells, not %u", what, level, count, wanted.count);
  for (uint32_t i = 0; i < count; i++) {
    uint32_t k = 0;
    while (k < count && !is_same(&shells[i], &wanted.shells[k])) k++;
    if (k == count)
      fail_msg("%s, level %u: shell %u of %lu faces, %lu open edges, area %f, volume %f", what, level, i,
               (unsigned long)shells[i].faces, (unsigned long)shells[i].open_edges, shells[i].area,
               shells[i].volume);
    wanted.shells[k].faces = 0; /* found */
  }
  free(wanted.of);
  free(wanted.shells);
  tw_free(shells);
}

/* Two cubes of triangles and quads that share an edge, one turned inside out, a sheet apart, and three faces
 * at an edge. Points of level 0 are planar in each face, so that any fan has the same area. */
static const char pieces_text[] =
    "o pieces\n"
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "v 4 -1 -1\nv 6 -1 -1\nv 6 1 -1\nv 4 1 -1\nv 4 -1 1\nv 6 -1 1\nv 6 1 1\nv 4 1 1\n"
    "v 0 5 0\nv 1 5 0\nv 2 5 0\nv 0 6 0\nv 1 6 0\nv 2 6 0\nv 1 5 1\nv 1 6 1\n"
    "v 0 9 0\nv 1 9 0\nv 1 10 0\nv 0 10 0\nv 2 9 0\nv 2 10 0\n"
    "usemtl a\n"
    "f 1 4 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6 5\nf 2 3 7 6\n"
    "f 9 10 11 12\nf 13 16 15 14\n"
    "usemtl b\n"
    "f 3 4 8 7\nf 4 1 5 8\n"
    "f 9 13 14 10\nf 10 14 15 11\nf 11 15 16 12\nf 12 16 13 9\n"
    "f 17 18 21 20\nf 18 19 22 21\nf 18 23 24 21\n"
    "usemtl a\n"
    "f 25 26 27 28\nf 26 27 30 29\n";

/* The first cube and the sheet in triangles alone. */
static const char triangles_text[] =
    "o triangles\n"
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "v 4 0 0\nv 5 0 0\nv 5 1 0\nv 4 1 0\n"
    "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 "
    "5 8\n"
    "f 9 10 11\nf 9 11 12\n";

TEST(shells_are_those_of_the_answered_faces) {
  static const struct {
    const char *what, *text;
    tw_surface_options options;
  } cases[] = {
      {"pieces", pieces_text, {.normals = true}},
      {"pieces without normals", pieces_text, {.limit = true}},
      {"bilinear pieces", pieces_text, {.scheme = TW_BILINEAR}},
      {"pieces without borders", pieces_text, {.boundary = TW_BOUNDARY_NONE}},
      {"triangles by Loop", triangles_text, {.scheme = TW_LOOP, .normals = true}},
      {"limit by Loop", triangles_text, {.scheme = TW_LOOP, .limit = true}},
      {"cube", cube_text, {.normals = true}},
      {"patchwork", patchwork_text, {.boundary = TW_BOUNDARY_EDGE_ONLY}},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    for (uint32_t level = 0; level < 5; level++) {
      if (level == 0 && cases[i].text == patchwork_text)
        continue; /* its polygons are no fans from any corner */
      fixture f;
      tw_surface_options options = cases[i].options;
      options.level = level;
      fixture_init(&f, cases[i].text);
      fixture_refine_by(&f, &options);
      for (uint32_t m = 0; m < f.model->mesh_count; m++) assert_shells(f.surfaces[m], cases[i].what);
      fixture_deinit(&f);
    }
}

TEST(a_shrinking_border_opens_other_edges) {
  char text[4096], *end = text;
  for (int y = 0; y < 6; y++)
    for (int x = 0; x < 6; x++) end += sprintf(end, "v %d %d %d\n", x, y, x * y % 3);
  for (int y = 0; y < 5; y++)
    for (int x = 1; x < 6; x++)
      end += sprintf(end, "f %d %d %d %d\n", 6 * y + x, 6 * y + x + 1, 6 * y + x + 7, 6 * y + x + 6);
  for (uint32_t level = 1; level < 4; level++) {
    fixture f;
    fixture_init(&f, text);
    fixture_refine_by(&f, &(tw_surface_options){.level = level, .boundary = TW_BOUNDARY_OPEN});
    assert_shells(f.surfaces[0], "open border");
    fixture_deinit(&f);
  }
}

/* A box of 2 x 2 x 2 shown by three nodes: as it is, mirrored, and twice as large along one axis. */
TEST(a_solid_is_measured_in_the_world) {
  fixture f;
  fixture_init(&f, cube_text);
  uint32_t mirrored = fixture_node(&f, "mirrored", TW_NO_INDEX, 0),
           longer = fixture_node(&f, "longer", TW_NO_INDEX, 0);
  f.model->nodes[mirrored].rest.scale[0] = -1;
  f.model->nodes[longer].rest.scale[1] = 2;
  fixture_refine(&f, 0, false);
  tw_solid solid;
  assert_int_equal(tw_scene_measure(&f.scene, 10, NULL, &solid, NULL), TW_OK);
  assert_int_equal(solid.shells, 3);
  assert_int_equal(solid.closed, 3);
  assert_int_equal(solid.inverted, 0);
  assert_int_equal(solid.triangles, 36);
  assert_true(is_near(solid.volume, 1000 * (8 + 8 + 16)));
  assert_true(is_near(solid.area, 100 * (24 + 24 + 40)));
  fixture_deinit(&f);
}

/* A plate with a hole: polygons of ten corners go round both borders of its top and bottom, and twice along
 * the edge between these. */
TEST(an_edge_with_one_face_on_both_sides_is_not_open) {
  static const char plate[] = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 3 1 0\nv 3 3 0\nv 1 3 0\n"
                              "v 0 0 1\nv 4 0 1\nv 4 4 1\nv 0 4 1\nv 1 1 1\nv 3 1 1\nv 3 3 1\nv 1 3 1\n"
                              "f 9 10 11 12 9 13 16 15 14 13\nf 1 5 6 7 8 5 1 4 3 2\n"
                              "f 1 2 10 9\nf 2 3 11 10\nf 3 4 12 11\nf 4 1 9 12\n"
                              "f 6 5 13 14\nf 7 6 14 15\nf 8 7 15 16\nf 5 8 16 13\n";
  fixture f;
  fixture_init(&f, plate);
  fixture_refine(&f, 0, false);
  tw_solid solid;
  assert_int_equal(tw_scene_measure(&f.scene, 1, NULL, &solid, NULL), TW_OK);
  assert_int_equal(solid.shells, 1);
  assert_int_equal(solid.closed, 1);
  assert_int_equal(solid.open_edges, 0);
  assert_true(is_near(solid.volume, 16 - 4));
  assert_true(is_near(solid.area, 2 * (16 - 4) + 16 + 8));
  fixture_deinit(&f);
  fixture_init(&f, plate); /* steps keep the two sides of the edge apart */
  fixture_refine(&f, 1, false);
  assert_shells(f.surfaces[0], "plate");
  assert_int_equal(tw_scene_measure(&f.scene, 1, NULL, &solid, NULL), TW_OK);
  assert_int_equal(solid.open_edges, 8);
  fixture_deinit(&f);
}

TEST(sums_are_the_same_in_any_order_of_parts) {
  const tw_parallel_for parallel = {.run = run_backwards};
  fixture f;
  fixture_init(&f, pieces_text);
  fixture_refine(&f, 5, false);
  tw_shell *alone, *parted;
  uint32_t count, again;
  assert_int_equal(tw_shells_measure(f.surfaces[0], NULL, &alone, &count, NULL), TW_OK);
  assert_int_equal(tw_shells_measure(f.surfaces[0], &parallel, &parted, &again, NULL), TW_OK);
  assert_int_equal(count, again);
  for (uint32_t i = 0; i < count; i++) {
    assert_true(alone[i].area == parted[i].area && alone[i].volume == parted[i].volume);
    assert_int_equal(alone[i].triangles, parted[i].triangles);
  }
  tw_free(alone);
  tw_free(parted);
  fixture_deinit(&f);
}

TEST(measuring_survives_every_failure) {
  fixture f;
  fixture_init(&f, pieces_text);
  fixture_refine(&f, 2, false);
  tw_status status = TW_NO_MEMORY;
  for (size_t failures = 0; status != TW_OK; failures++) {
    tw_shell *shells = NULL;
    uint32_t count = 0;
    test_memory.left = failures;
    status = tw_shells_measure(f.surfaces[0], NULL, &shells, &count, NULL);
    test_memory.left = SIZE_MAX;
    assert_true(status == TW_OK ? shells && failures > 8 : status == TW_NO_MEMORY && !shells);
    tw_free(shells);
  }
  fixture_deinit(&f);
}
