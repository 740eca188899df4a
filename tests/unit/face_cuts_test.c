/* Polygons of level 0 as triangles: their areas add up to the polygon's, which the shoelace formula gives.
 * Triangles that together wind round each place as the polygon does, and whose areas add up without signs,
 * have no part outside it. */
#include <math.h>
#include <stdio.h>

#include "rotation_reference.h"
#include "written_glb.h"

typedef struct polygon {
  uint32_t size;
  double at[600][2];
} polygon;

static double shoelace(const polygon *p) {
  double twice = 0;
  for (uint32_t i = 0; i < p->size; i++) {
    const double *a = p->at[i], *b = p->at[(i + 1) % p->size];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return twice / 2;
}

/* A polygon whose lower and upper side are random curves over x, from 0 to `size`, its first corner anywhere.
 * Few of these have a corner that sees all others. */
static void random_polygon(polygon *p, uint32_t size, uint64_t *seed) {
  uint32_t below = 1 + (uint32_t)(ref_random(seed) * (size - 3)), above = size - 2 - below;
  uint32_t first = (uint32_t)(ref_random(seed) * size), count = 0;
  double corners[600][2];
  corners[count][0] = 0;
  corners[count++][1] = ref_between(seed, -1, 1);
  for (uint32_t i = 0; i < below; i++) {
    corners[count][0] = size * (i + ref_between(seed, 0.1, 0.9)) / below;
    corners[count++][1] = ref_between(seed, -9, -1.5);
  }
  corners[count][0] = size;
  corners[count++][1] = ref_between(seed, -1, 1);
  for (uint32_t i = above; i-- > 0;) {
    corners[count][0] = size * (i + ref_between(seed, 0.1, 0.9)) / above;
    corners[count++][1] = ref_between(seed, 1.5, 9);
  }
  p->size = size;
  for (uint32_t i = 0; i < size; i++) memcpy(p->at[i], corners[(first + i) % size], sizeof p->at[i]);
}

/* An OBJ of polygons, one over the other, all turned by a rotation. */
static char *obj_of(const polygon *polygons, uint32_t count, ref_matrix m) {
  size_t corners = 0;
  for (uint32_t i = 0; i < count; i++) corners += polygons[i].size;
  char *text = malloc(corners * 80 + 100), *end = text;
  assert_non_null(text);
  for (uint32_t i = 0; i < count; i++)
    for (uint32_t k = 0; k < polygons[i].size; k++) {
      double p[3] = {polygons[i].at[k][0], polygons[i].at[k][1], 3.0 * i}, q[3];
      for (int j = 0; j < 3; j++) q[j] = m.at[j][0] * p[0] + m.at[j][1] * p[1] + m.at[j][2] * p[2];
      end += sprintf(end, "v %.9g %.9g %.9g\n", q[0], q[1], q[2]);
    }
  for (uint32_t i = 0, point = 1; i < count; i++) {
    end += sprintf(end, "f");
    for (uint32_t k = 0; k < polygons[i].size; k++) end += sprintf(end, " %u", point++);
    end += sprintf(end, "\n");
  }
  return text;
}

static double area_of(const glb *file, int positions, const uint32_t *triangle) {
  float at[3][3];
  double a[3], b[3], cross = 0;
  for (int i = 0; i < 3; i++) read_floats(file, positions, triangle[i], 3, at[i]);
  for (int i = 0; i < 3; i++) {
    a[i] = (double)at[1][i] - (double)at[0][i];
    b[i] = (double)at[2][i] - (double)at[0][i];
  }
  for (int i = 0; i < 3; i++) {
    double c = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    cross += c * c;
  }
  return sqrt(cross) / 2;
}

/* Asserts that the triangles of each polygon have its area. Returns how many polygons FB_ngon_encoding reads.
 */
static uint32_t assert_areas(fixture *f, const polygon *polygons, uint32_t count) {
  glb file = write_glb(&f->scene);
  const cJSON *faces = primitive(&file, 0, 0);
  int indices = (int)number(faces, "indices", UINT32_MAX);
  int positions = (int)number(cJSON_GetObjectItem(faces, "attributes"), "POSITION", UINT32_MAX);
  uint32_t next = 0, before = UINT32_MAX, read = 0;
  for (uint32_t i = 0; i < count; i++) {
    double area = 0;
    for (uint32_t t = 2; t < polygons[i].size; t++, next += 3) {
      uint32_t triangle[3];
      for (uint32_t k = 0; k < 3; k++) triangle[k] = read_index(&file, indices, next + k);
      if (t == 2) assert_int_not_equal(triangle[0], before); /* polygons have no vertex in common here */
      read += triangle[0] != before;
      before = triangle[0];
      area += area_of(&file, positions, triangle);
    }
    assert_true(fabs(area - shoelace(&polygons[i])) < 1e-5 * polygons[i].size);
  }
  assert_int_equal(number(at(&file, "accessors", indices), "count", 0), next);
  free_glb(&file);
  return read;
}

static uint32_t assert_areas_of(const polygon *polygons, uint32_t count, ref_matrix m, tw_polygons form) {
  fixture f;
  char *text = obj_of(polygons, count, m);
  fixture_init(&f, text);
  fixture_refine(&f, 0, false);
  f.scene.polygons = form;
  uint32_t read = assert_areas(&f, polygons, count);
  fixture_deinit(&f);
  free(text);
  return read;
}

static const ref_matrix as_it_is = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

TEST(an_arrowhead_is_cut_from_its_notch) {
  polygon arrow = {4, {{0, 0}, {2, 1}, {0, 2}, {1, 1}}};
  for (uint32_t first = 0; first < 4; first++) {
    polygon turned = {.size = 4};
    for (uint32_t i = 0; i < 4; i++) memcpy(turned.at[i], arrow.at[(first + i) % 4], sizeof turned.at[i]);
    assert_areas_of(&turned, 1, as_it_is, TW_POLYGONS_TRIANGLES);
    assert_int_equal(assert_areas_of(&turned, 1, as_it_is, TW_POLYGONS_NGON), 1);
  }
}

TEST(random_polygons_keep_their_areas) {
  static polygon polygons[5];
  uint64_t seed = 71;
  for (int n = 0; n < 300; n++) {
    uint32_t most = n % 10 == 0 ? 600 : n % 2 ? 8 : 40, count = 1 + (uint32_t)n % 5;
    for (uint32_t i = 0; i < count; i++)
      random_polygon(&polygons[i], 4 + (uint32_t)(ref_random(&seed) * (most - 3)), &seed);
    ref_matrix m = ref_matrix_of(ref_random_unit(&seed));
    assert_areas_of(polygons, count, m, TW_POLYGONS_TRIANGLES);
    assert_areas_of(polygons, count, m, TW_POLYGONS_NGON);
  }
}

/* A comb has no corner that sees all others. */
static const polygon comb = {7, {{0, 0}, {6, 0}, {5, 4}, {4, 1}, {3, 4}, {2, 1}, {1, 4}}};

TEST(a_polygon_without_a_fan_is_polygons_of_three) {
  assert_int_equal(assert_areas_of(&comb, 1, as_it_is, TW_POLYGONS_NGON), 5);
}

TEST(a_cage_keeps_its_polygons_whatever_their_shape) {
  fixture f;
  char *text = obj_of(&comb, 1, as_it_is);
  fixture_init(&f, text);
  fixture_refine_by(&f, &(tw_surface_options){.tagged = true});
  f.scene.polygons = TW_POLYGONS_NGON;
  glb file = write_glb(&f.scene);
  tw_model *model = NULL;
  assert_int_equal(tw_gltf_read(file.bytes, file.size, TW_QUADS_NGON, TW_WELD_AUTO, 0, &model, NULL), TW_OK);
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_int_equal(model->meshes[0].corner_count, 7);
  tw_model_destroy(model);
  free_glb(&file);
  fixture_deinit(&f);
  free(text);
}

TEST(pieces_of_an_answer_are_those_of_the_whole) {
  static polygon polygons[5];
  uint64_t seed = 72;
  for (uint32_t i = 0; i < 5; i++) random_polygon(&polygons[i], 30 + 7 * i, &seed);
  for (int form = 0; form < 2; form++) {
    fixture f;
    char *text = obj_of(polygons, 5, as_it_is);
    fixture_init(&f, text);
    fixture_refine(&f, 0, false);
    f.scene.polygons = (tw_polygons)form;
    tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
    uint8_t *small = fixture_read(stream, 6);
    glb file = write_glb(&f.scene);
    assert_memory_equal(small, file.bytes, file.size);
    free(small);
    tw_gltf_stream_destroy(stream);
    free_glb(&file);
    fixture_deinit(&f);
    free(text);
  }
}

/* ---- quads of levels ------------------------------------------------------------------------- */

typedef struct quad {
  double at[4][2];
} quad;

static double turn(const double *a, const double *b, const double *c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Whether sides a b and c d have an inner point in common. */
static bool cross_each_other(const double *a, const double *b, const double *c, const double *d) {
  return turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0;
}

static bool is_simple(const quad *q) {
  return !cross_each_other(q->at[0], q->at[1], q->at[2], q->at[3]) &&
         !cross_each_other(q->at[1], q->at[2], q->at[3], q->at[0]);
}

/* Whether a diagonal between the first and the third corner lies outside. */
static bool needs_other_diagonal(const quad *q) {
  return turn(q->at[0], q->at[1], q->at[2]) * turn(q->at[0], q->at[2], q->at[3]) < 0;
}

/* What was compared: quads whose sides do not cross, and those of them that are no fan from their first
 * corner. */
typedef struct compared_quads {
  uint32_t all, turned;
} compared_quads;

/* Compares the two triangles of each quad in a GLB with the quad, which the surface's faces tell. */
static void compare_quads(const fixture *f, compared_quads *compared) {
  glb file = write_glb(&f->scene);
  const cJSON *faces = primitive(&file, 0, 0);
  int indices = (int)number(faces, "indices", UINT32_MAX);
  int positions = (int)number(cJSON_GetObjectItem(faces, "attributes"), "POSITION", UINT32_MAX);
  const tw_surface_counts *counts = tw_surface_get_counts(f->surfaces[0]);
  tw_surface_reader *reader = tw_surface_reader_create(f->surfaces[0]);
  uint32_t *corners = malloc(counts->corners * sizeof *corners);
  assert_true(reader && corners);
  assert_int_equal(counts->corners, 4 * counts->faces);
  tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, 0, (size_t)counts->faces, NULL, corners);
  for (uint32_t i = 0; i < counts->faces; i++) {
    quad q;
    double areas = 0;
    for (uint32_t k = 0; k < 4; k++) {
      float at[3];
      read_floats(&file, positions, corners[4 * i + k], 3, at);
      for (int c = 0; c < 2; c++) q.at[k][c] = (double)at[c];
    }
    double area = fabs(turn(q.at[0], q.at[1], q.at[2]) + turn(q.at[0], q.at[2], q.at[3])) / 2;
    for (uint32_t t = 0; t < 2; t++) {
      uint32_t triangle[3];
      for (uint32_t k = 0; k < 3; k++) triangle[k] = read_index(&file, indices, 6 * i + 3 * t + k);
      areas += area_of(&file, positions, triangle);
    }
    if (!is_simple(&q) || area < 1e-3) continue;
    assert_true(fabs(areas - area) < 1e-4 * area);
    compared->all++;
    compared->turned += needs_other_diagonal(&q);
  }
  free(corners);
  tw_surface_reader_destroy(reader);
  free_glb(&file);
}

TEST(concave_quads_of_levels_are_cut_by_their_shape) {
  static polygon p;
  compared_quads compared = {0};
  uint64_t seed = 73;
  for (int n = 0; n < 60; n++) {
    fixture f;
    random_polygon(&p, 4 + (uint32_t)(ref_random(&seed) * 12), &seed);
    char *text = obj_of(&p, 1, as_it_is);
    fixture_init(&f, text);
    fixture_refine_by(&f, &(tw_surface_options){.level = 1 + (uint32_t)n % 3,
                                                .scheme = n % 2 ? TW_BILINEAR : TW_CATMULL_CLARK,
                                                .limit = n % 5 == 0});
    for (int form = 0; form < 2; form++) {
      f.scene.polygons = (tw_polygons)form;
      compare_quads(&f, &compared);
    }
    fixture_deinit(&f);
    free(text);
  }
  assert_true(compared.all > 5000 && compared.turned > 200);
}

static void compare_large(char *text, const tw_surface_options *options, tw_polygons form) {
  fixture f;
  compared_quads compared = {0};
  fixture_init(&f, text);
  fixture_refine_by(&f, options);
  assert_true(tw_surface_get_counts(f.surfaces[0])->faces > 1 << 18);
  f.scene.polygons = form;
  compare_quads(&f, &compared);
  assert_true(compared.all > 200000 && compared.turned > 50);
  fixture_deinit(&f);
  free(text);
}

TEST(concave_quads_of_large_levels_are_cut_by_their_shape) {
  polygon large = comb;
  for (uint32_t i = 0; i < large.size; i++)
    for (int c = 0; c < 2; c++) large.at[i][c] *= 1000;
  compare_large(obj_of(&large, 1, as_it_is), &(tw_surface_options){.level = 9}, TW_POLYGONS_NGON);
  compare_large(obj_of(&large, 1, as_it_is), &(tw_surface_options){.level = 9, .scheme = TW_BILINEAR},
                TW_POLYGONS_TRIANGLES);
}

/* A grid of seven by seven quads, two of which are one hexagon with a notch. */
static char *grid_with_notch(void) {
  char *text = malloc(10000), *end = text;
  assert_non_null(text);
  for (int j = 0; j < 8; j++)
    for (int i = 0; i < 8; i++)
      end += sprintf(end, "v %d %d 0\n", 1000 * i, 1000 * j - (i == 4 && j == 4 ? 800 : 0));
  for (int j = 0; j < 7; j++)
    for (int i = 1; i < 8; i++)
      if (j != 3 || i < 4 || i > 5)
        end += sprintf(end, "f %d %d %d %d\n", 8 * j + i, 8 * j + i + 1, 8 * j + i + 9, 8 * j + i + 8);
  sprintf(end, "f 28 29 30 38 37 36\n");
  return text;
}

TEST(concave_quads_inside_an_open_border_are_cut_by_their_shape) {
  compare_large(grid_with_notch(),
                &(tw_surface_options){.level = 7, .scheme = TW_BILINEAR, .boundary = TW_BOUNDARY_OPEN},
                TW_POLYGONS_TRIANGLES);
}

enum { SHEET = 5 }; /* points along a side */

/* columns: the places of the columns before points were moved. */
static bool has_convex_quads(double at[SHEET * SHEET][2], const double *columns) {
  for (int v = 0; v < SHEET * (SHEET - 1); v++) {
    if (v % SHEET == SHEET - 1) continue;
    const double *quad[4] = {at[v], at[v + 1], at[v + SHEET + 1], at[v + SHEET]};
    double side = columns[v % SHEET + 1] > columns[v % SHEET] ? 1 : -1;
    for (int k = 0; k < 4; k++)
      if (side * turn(quad[k], quad[(k + 1) % 4], quad[(k + 2) % 4]) < 1e-3) return false;
  }
  return true;
}

/* A sheet of convex quads whose points are moved about, with random creases. Where columns run back, it is
 * folded. */
static char *convex_sheet(uint64_t *seed, const double columns[SHEET]) {
  double at[SHEET * SHEET][2];
  char *text = malloc(10000), *end = text;
  assert_non_null(text);
  for (int v = 0; v < SHEET * SHEET; v++) {
    at[v][0] = columns[v % SHEET];
    at[v][1] = v / SHEET;
  }
  for (int n = 0; n < 500; n++) {
    double *moved = at[(int)(ref_random(seed) * SHEET * SHEET)], before[2] = {moved[0], moved[1]};
    for (int c = 0; c < 2; c++) moved[c] += ref_between(seed, -0.5, 0.5);
    if (!has_convex_quads(at, columns)) memcpy(moved, before, sizeof before);
  }
  for (int v = 0; v < SHEET * SHEET; v++) end += sprintf(end, "v %.9g %.9g 0\n", at[v][0], at[v][1]);
  for (int v = 1; v < SHEET * (SHEET - 1); v++)
    if (v % SHEET != 0) end += sprintf(end, "f %d %d %d %d\n", v, v + 1, v + SHEET + 1, v + SHEET);
  for (int v = 1; v < SHEET * (SHEET - 1); v++)
    if (v % SHEET != 0 && ref_random(seed) < 0.3)
      end += sprintf(end, "t crease 2/1/0 %d %d 5\n", v, ref_random(seed) < 0.5 ? v + 1 : v + SHEET);
  return text;
}

static compared_quads compare_sheets(const double columns[SHEET], int count) {
  compared_quads compared = {0};
  uint64_t seed = 74;
  for (int n = 0; n < count; n++) {
    fixture f;
    char *text = convex_sheet(&seed, columns);
    fixture_init(&f, text);
    fixture_refine_by(&f, &(tw_surface_options){.level = 1 + (uint32_t)n % 2});
    compare_quads(&f, &compared);
    fixture_deinit(&f);
    free(text);
  }
  return compared;
}

TEST(concave_quads_of_convex_faces_are_cut_by_their_shape) {
  static const double columns[SHEET] = {0, 1, 2, 3, 4};
  compared_quads compared = compare_sheets(columns, 200);
  assert_true(compared.all > 5000 && compared.turned > 10);
}

TEST(concave_quads_beside_folds_are_cut_by_their_shape) {
  static const double columns[SHEET] = {0, 2, 1.2, 3, 1.5};
  compared_quads compared = compare_sheets(columns, 200);
  assert_true(compared.all > 5000 && compared.turned > 10);
}

/* A sheet of triangles, each pair of them in a square, whose columns are folded over each other. The points
 * are moved by less than what would turn a triangle over. */
static char *triangle_sheet(uint64_t *seed) {
  static const double columns[SHEET] = {0, 2, 1, 3.2, 1.7};
  char *text = malloc(10000), *end = text;
  assert_non_null(text);
  for (int v = 0; v < SHEET * SHEET; v++)
    end += sprintf(end, "v %.9g %.9g 0\n", columns[v % SHEET] + ref_between(seed, -0.15, 0.15),
                   v / SHEET + ref_between(seed, -0.15, 0.15));
  for (int v = 1; v < SHEET * (SHEET - 1); v++) {
    if (v % SHEET == 0) continue;
    if (ref_random(seed) < 0.5)
      end += sprintf(end, "f %d %d %d\nf %d %d %d\n", v, v + 1, v + SHEET, v + 1, v + SHEET + 1, v + SHEET);
    else
      end += sprintf(end, "f %d %d %d\nf %d %d %d\n", v, v + 1, v + SHEET + 1, v, v + SHEET + 1, v + SHEET);
  }
  return text;
}

TEST(concave_quads_beside_folds_of_triangles_are_cut_by_their_shape) {
  compared_quads compared = {0};
  uint64_t seed = 75;
  for (int n = 0; n < 200; n++) {
    fixture f;
    char *text = triangle_sheet(&seed);
    fixture_init(&f, text);
    fixture_refine_by(&f, &(tw_surface_options){.level = 1 + (uint32_t)n % 3});
    compare_quads(&f, &compared);
    fixture_deinit(&f);
    free(text);
  }
  assert_true(compared.all > 50000 && compared.turned > 100);
}

TEST(levels_of_convex_faces_are_fans) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_refine(&f, 2, false);
  tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
  tw_face_cut cuts[96];
  assert_int_equal(tw_surface_read_cuts(reader, 0, 96, cuts), 0);
  tw_surface_reader_destroy(reader);
  fixture_deinit(&f);
}
