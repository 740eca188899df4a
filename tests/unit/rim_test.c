/* Large answers that shrink from an open border, which are made in two parts, and large ones of Loop's
 * scheme: they have the rows and faces of generic steps. Under Chaikin's rule a semi-sharp crease and UVs
 * need generic steps. On the border the crease changes nothing else. */
#include <math.h>
#include <stdlib.h>

#include "built_cage.h"
#include "face_shells.h"
#include "wrapped_memory.h"

enum { LEVEL = 6, UNIT = 16 << LEVEL /* of UVs, in steps of the level */ };

/* ---- a sheet with all that rows hold --------------------------------------------------------- */

typedef struct sheet {
  cage *c;
  tw_uv_set uvs;
  tw_attribute attributes[2];
  float uv[POINTS_MAX][2], color[POINTS_MAX][4], morph[POINTS_MAX][3], weights[POINTS_MAX][4];
  uint16_t joints[POINTS_MAX][4];
  float part[FACES_MAX];
  uint32_t part_of[4 * FACES_MAX];
  int32_t materials[FACES_MAX];
  const float *morphs[1];
} sheet;

static float waves(float x, float y) {
  return 0.4f * sinf(1.3f * x) * cosf(0.9f * y);
}

/* Faces are missing at its border and inside, one is a hole, and two lines of it are sharp. */
static sheet *new_sheet(uint32_t columns, uint32_t rows, bool triangles) {
  static const uint32_t missing[] = {0, 12, 41, 42, 55, 78, 143, UINT32_MAX}, hole = 60;
  sheet *s = calloc(1, sizeof *s);
  assert_non_null(s);
  cage *whole = grid(columns, rows, triangles, waves), *c = s->c = new_cage_over(whole);
  for (uint32_t f = 0, skipped = 0; f < whole->mesh.face_count; f++) {
    if (missing[skipped] == f) {
      skipped++;
      continue;
    }
    s->materials[c->mesh.face_count] = f % columns < 5 ? 0 : f < 90 ? 2 : 1;
    s->part[c->mesh.face_count] = (float)(f % 3);
    for (uint32_t k = 0; k < 4; k++) s->part_of[c->mesh.corner_count + k] = c->mesh.face_count;
    add_face(c, whole->corners + whole->offsets[f], triangles ? 3 : 4);
  }
  free(whole);
  for (uint32_t i = 0; i < c->mesh.point_count; i++) {
    float x = (float)(i % columns), y = (float)(i / columns);
    for (int k = 0; k < 2; k++) s->uv[i][k] = (k ? y : x) / 16;
    for (int k = 0; k < 4; k++) s->color[i][k] = 0.5f + 0.4f * sinf(x + (float)k) * cosf(y);
    for (int k = 0; k < 3; k++) s->morph[i][k] = 0.2f * cosf(x + 2 * y + (float)k);
    for (uint16_t k = 0; k < 4; k++) s->joints[i][k] = (uint16_t)(k + i % 2);
    s->weights[i][0] = 0.25f + 0.5f * (float)(i % 3 == 0);
    s->weights[i][1] = 1 - s->weights[i][0];
  }
  s->uvs = (tw_uv_set){.values = s->uv[0], .value_count = c->mesh.point_count, .corners = c->corners};
  s->attributes[0] = (tw_attribute){.name = "COLOR_0", .width = 4, .is_color = true, .values = s->color[0]};
  s->attributes[1] = (tw_attribute){.name = "_PART",
                                    .width = 1,
                                    .values = s->part,
                                    .value_count = c->mesh.face_count,
                                    .corners = s->part_of,
                                    .numbers = TW_NUMBERS_UINT8};
  s->morphs[0] = s->morph[0];
  c->mesh.uv_sets[0] = s->uvs;
  c->mesh.uv_set_count = 1;
  c->mesh.attributes = s->attributes;
  c->mesh.attribute_count = 2;
  c->mesh.skin = (tw_skin_weights){4, s->joints[0], s->weights[0]};
  c->mesh.morphs = s->morphs;
  c->mesh.morph_count = 1;
  c->mesh.has_tangents = true;
  c->mesh.face_materials = s->materials;
  c->mesh.holes = &hole;
  c->mesh.hole_count = 1;
  const uint32_t sharp[3][2] = {{5 * columns + 5, 5 * columns + 6},
                                {5 * columns + 6, 6 * columns + 6},
                                {3 * columns + 1, 3 * columns + 2}};
  for (uint32_t i = 0; i < 3; i++) {
    memcpy(c->creases[i], sharp[i], sizeof sharp[i]);
    c->sharpness[i] = TW_SHARPNESS_INFINITE;
  }
  c->mesh.crease_edges = c->creases[0];
  c->mesh.crease_sharpness = c->sharpness;
  c->mesh.crease_count = 3;
  return s;
}

static void free_sheet(sheet *s) {
  free(s->c);
  free(s);
}

/* ---- comparing ------------------------------------------------------------------------------- */

typedef struct place {
  int64_t key;
  uint32_t row;
} place;

/* Where a row is on the sheet, by its UV. */
static int64_t key_of(const rows *r, size_t row) {
  const float *uv = row_of(r, row) + r->layout->uvs[0];
  return llroundf(uv[1] * UNIT) * (UNIT * 4) + llroundf(uv[0] * UNIT);
}

static int compare_places(const void *left, const void *right) {
  const place *a = left, *b = right;
  if (a->key != b->key) return a->key < b->key ? -1 : 1;
  return a->row < b->row ? -1 : a->row > b->row;
}

static place *places_of(const rows *r) {
  place *out = malloc(r->count * sizeof *out);
  assert_non_null(out);
  for (uint32_t row = 0; row < r->count; row++) out[row] = (place){key_of(r, row), row};
  qsort(out, r->count, sizeof *out, compare_places);
  return out;
}

static bool is_near(const rows *a, size_t i, const rows *b, size_t k) {
  const float *left = row_of(a, i), *right = row_of(b, k);
  uint32_t vectors = a->layout->tangent == UINT32_MAX ? 6 : 10; /* normals and tangents come after points */
  for (uint32_t c = 0; c < a->layout->stride; c++)
    if (fabsf(left[c] - right[c]) > (c < 3 || c >= vectors ? 8e-6f : 2e-3f)) return false;
  return true;
}

/* Each row of one has a row of the other at the same place. Rows at a place differ by their normals. */
static void assert_same_rows(const rows *a, const rows *b) {
  place *left = places_of(a), *right = places_of(b);
  assert_int_equal(a->count, b->count);
  for (size_t i = 0, end; i < a->count; i = end) {
    for (end = i; end < a->count && left[end].key == left[i].key; end++)
      assert_int_equal(right[end].key, left[i].key);
    for (size_t k = i; k < end; k++) {
      bool found = false;
      for (size_t other = i; other < end; other++) found |= is_near(a, left[k].row, b, right[other].row);
      assert_true(found);
    }
  }
  free(left);
  free(right);
}

typedef struct face_places {
  int64_t keys[4]; /* of triangles the first one again */
} face_places;

static int compare_faces(const void *left, const void *right) {
  return memcmp(left, right, sizeof(face_places));
}

/* Of each group the faces in the order of their places, each from its least place on. */
static face_places *sorted_faces(const rows *r) {
  const tw_surface_counts *counts = tw_surface_get_counts(r->surface);
  size_t count = (size_t)counts->faces, size = (size_t)(counts->corners / counts->faces);
  face_places *out = malloc(count * sizeof *out);
  uint32_t *faces = faces_of(r, TW_DOMAIN_VERTICES);
  assert_non_null(out);
  for (size_t f = 0; f < count; f++) {
    int64_t keys[4];
    size_t least = 0;
    for (size_t k = 0; k < size; k++) keys[k] = key_of(r, faces[size * f + k]);
    for (size_t k = 1; k < size; k++)
      if (keys[k] < keys[least]) least = k;
    for (size_t k = 0; k < 4; k++) out[f].keys[k] = keys[(least + k) % size];
  }
  for (uint32_t g = 0; g < tw_surface_group_count(r->surface); g++) {
    const tw_surface_group *group = tw_surface_get_group(r->surface, g);
    qsort(out + group->first_face, (size_t)group->face_count, sizeof *out, compare_faces);
  }
  free(faces);
  return out;
}

static void assert_same_faces(const rows *a, const rows *b) {
  face_places *left = sorted_faces(a), *right = sorted_faces(b);
  uint64_t count = tw_surface_get_counts(a->surface)->faces;
  assert_int_equal(tw_surface_group_count(a->surface), tw_surface_group_count(b->surface));
  for (uint32_t g = 0; g < tw_surface_group_count(a->surface); g++)
    assert_memory_equal(tw_surface_get_group(a->surface, g), tw_surface_get_group(b->surface, g),
                        sizeof(tw_surface_group));
  assert_memory_equal(left, right, (size_t)count * sizeof *left);
  free(left);
  free(right);
}

/* Rows of points and of UVs, and faces over them, are where those of vertices are: points to the last bit. */
static void assert_domains_agree(const rows *r) {
  uint32_t *faces = faces_of(r, TW_DOMAIN_VERTICES);
  for (tw_domain domain = TW_DOMAIN_POINTS; domain <= TW_DOMAIN_UVS; domain++) {
    uint32_t *others = faces_of(r, domain), width = domain == TW_DOMAIN_UVS ? 2 : 3,
             column = domain == TW_DOMAIN_UVS ? r->layout->uvs[0] : 0;
    float *values = all_rows(r->surface, domain);
    for (uint64_t c = 0; c < tw_surface_get_counts(r->surface)->corners; c++)
      for (uint32_t k = 0; k < width; k++) {
        float value = values[(size_t)others[c] * width + k];
        if (domain == TW_DOMAIN_UVS && k == 1) value = 1 - value;
        float own = row_of(r, faces[c])[column + k];
        if (domain == TW_DOMAIN_POINTS)
          assert_true(value == own);
        else
          assert_float_equal(value, own, 1e-6f);
      }
    free(others);
    free(values);
  }
  free(faces);
}

/* The same where UVs do not tell the place: there a row is where its point is, along a line. */
static double along_line(const rows *r, size_t row) {
  const float *at = row_of(r, row);
  return (double)at[0] + 0.618034 * (double)at[1] + 0.271828 * (double)at[2];
}

typedef struct along {
  double at;
  size_t row;
} along;

static int compare_along(const void *left, const void *right) {
  const along *a = left, *b = right;
  return a->at < b->at ? -1 : a->at > b->at;
}

static along *sorted_along(const rows *r) {
  along *out = malloc(r->count * sizeof *out);
  assert_non_null(out);
  for (size_t row = 0; row < r->count; row++) out[row] = (along){along_line(r, row), row};
  qsort(out, r->count, sizeof *out, compare_along);
  return out;
}

static void assert_same_rows_along(const rows *a, const rows *b) {
  const double rounding = 2e-5;
  along *left = sorted_along(a), *right = sorted_along(b);
  assert_int_equal(a->count, b->count);
  for (size_t i = 0, first = 0; i < a->count; i++) {
    bool found = false;
    while (right[first].at < left[i].at - rounding) first++;
    for (size_t k = first; !found && k < b->count && right[k].at < left[i].at + rounding; k++)
      found = is_near(a, left[i].row, b, right[k].row);
    assert_true(found);
  }
  free(left);
  free(right);
}

/* Shells, and the edges at which they are open. */
static void assert_same_shells(const rows *a, const rows *b) {
  tw_face_shells left, right;
  assert_int_equal(tw_face_shells_find(a->surface, &left, NULL), TW_OK);
  assert_int_equal(tw_face_shells_find(b->surface, &right, NULL), TW_OK);
  uint64_t faces = tw_surface_get_counts(a->surface)->faces, open[2] = {0, 0};
  assert_int_equal(left.count, right.count);
  for (uint32_t i = 0; i < left.count; i++) {
    open[0] += left.edges[i].open;
    open[1] += right.edges[i].open;
    assert_int_equal(left.edges[i].crowded + left.edges[i].flipped, 0);
  }
  assert_true(open[0] > 1000);
  assert_int_equal(open[0], open[1]);
  for (uint64_t f = 0; f < faces; f++) assert_true(tw_face_shell(&left, f) < left.count);
  tw_face_shells_deinit(&left);
  tw_face_shells_deinit(&right);
}

static void compare_with_steps(sheet *s, tw_surface_options options) {
  cage *c = s->c;
  const uint32_t border[2] = {1, 2};
  rows r = read_rows(&c->mesh, options);
  memcpy(c->creases[3], border, sizeof border);
  c->sharpness[3] = 0.5f;
  c->mesh.crease_count = 4;
  options.creasing = TW_CREASE_CHAIKIN;
  rows steps = read_rows(&c->mesh, options);
  c->mesh.crease_count = 3;
  assert_true(tw_surface_size(r.surface) < tw_surface_size(steps.surface) / 8);
  if (options.uv == TW_UV_ALL) {
    assert_same_rows(&r, &steps);
    assert_same_faces(&r, &steps);
  } else {
    assert_same_rows_along(&r, &steps);
  }
  assert_same_shells(&r, &steps);
  assert_domains_agree(&r);
  assert_exact_bounds(&r);
  assert_same_in_blocks(&r);
  free_rows(&r);
  free_rows(&steps);
}

/* A sanitizer makes these ten times slower. One test of quads and one of triangles take the same ways through
 * the library as the others. */
static void need_no_sanitizer(void) {
  if (is_sanitized()) skip();
}

TEST(open_answers_in_two_parts_have_the_rows_of_generic_steps) {
  sheet *s = new_sheet(14, 12, false);
  compare_with_steps(s, (tw_surface_options){
                            .level = LEVEL, .boundary = TW_BOUNDARY_OPEN, .uv = TW_UV_ALL, .normals = true});
  free_sheet(s);
}

TEST(open_limits_in_two_parts_are_those_of_generic_steps) {
  need_no_sanitizer();
  sheet *s = new_sheet(14, 12, false);
  s->c->mesh.has_tangents = false;
  compare_with_steps(
      s, (tw_surface_options){
             .level = LEVEL, .boundary = TW_BOUNDARY_OPEN, .uv = TW_UV_ALL, .normals = true, .limit = true});
  free_sheet(s);
}

TEST(open_bilinear_answers_in_two_parts_have_the_rows_of_generic_steps) {
  need_no_sanitizer();
  sheet *s = new_sheet(14, 12, false);
  compare_with_steps(s, (tw_surface_options){.level = LEVEL,
                                             .boundary = TW_BOUNDARY_OPEN,
                                             .uv = TW_UV_ALL,
                                             .scheme = TW_BILINEAR,
                                             .normals = true});
  free_sheet(s);
}

/* Models something onto a level of Loop's scheme. The caller frees what it returns. */
static float *add_detail(cage *c, uint32_t level) {
  static tw_detail detail;
  tw_mesh whole = c->mesh;
  tw_surface_counts counts;
  whole.hole_count = 0;
  const tw_surface_options options = {.level = level, .scheme = TW_LOOP};
  assert_int_equal(tw_surface_count(&whole, &options, &counts, NULL), TW_OK);
  float *offsets = calloc(counts.vertices, sizeof(float[3]));
  assert_non_null(offsets);
  for (size_t v = 0; v < counts.vertices; v += 7)
    for (size_t k = 0; k < 3; k++) offsets[3 * v + k] = 0.1f * sinf((float)(v + k));
  detail = (tw_detail){.level = level, .vertex_count = (uint32_t)counts.vertices, .offsets = offsets};
  c->mesh.details = &detail;
  c->mesh.detail_count = 1;
  return offsets;
}

/* With a second UV set, in which some faces are apart from the others. */
static void compare_triangles(tw_surface_options options, bool detailed) {
  static float uv[2 * POINTS_MAX][2];
  static uint32_t corners[4 * FACES_MAX];
  sheet *s = new_sheet(16, 15, true);
  cage *c = s->c;
  for (uint32_t i = 0; i < 2 * c->mesh.point_count; i++)
    for (int k = 0; k < 2; k++) uv[i][k] = 0.5f * s->uv[i / 2][k] + 0.05f * waves((float)i, (float)k);
  for (uint32_t i = 0; i < c->mesh.corner_count; i++)
    corners[i] = 2 * c->corners[i] + (i / 3 >= 200 && i / 3 < 256);
  c->mesh.uv_sets[1] =
      (tw_uv_set){.values = uv[0], .value_count = 2 * c->mesh.point_count, .corners = corners};
  c->mesh.uv_set_count = 2;
  c->mesh.has_tangents = false;
  c->mesh.skin = (tw_skin_weights){0};
  c->mesh.attribute_count = 1;
  options.level = LEVEL;
  options.scheme = TW_LOOP;
  options.normals = true;
  float *offsets = detailed ? add_detail(c, 3) : NULL;
  compare_with_steps(s, options);
  free(offsets);
  free_sheet(s);
}

TEST(loop_rows_of_all_columns_are_those_of_generic_steps) {
  need_no_sanitizer();
  compare_triangles((tw_surface_options){.boundary = TW_BOUNDARY_EDGE_ONLY, .uv = TW_UV_CORNERS_PLUS1}, true);
}

TEST(open_loop_limits_in_two_parts_are_those_of_generic_steps) {
  compare_triangles((tw_surface_options){.boundary = TW_BOUNDARY_OPEN, .uv = TW_UV_ALL, .limit = true},
                    false);
}

TEST(open_answers_in_two_parts_survive_failing_allocations) {
  cage *c = grid(4, 4, false, waves);
  const tw_surface_options options = {
      .level = 9, .boundary = TW_BOUNDARY_OPEN, .normals = true, .movable = true};
  tw_surface *surface = NULL;
  tw_status status = TW_NO_MEMORY;
  uint32_t failures = 0;
  for (uint32_t left = 0; status != TW_OK; failures++, left += 1 + left / 8) {
    size_t held = test_memory.held;
    test_memory.left = left;
    status = tw_surface_create(&c->mesh, &options, &surface, NULL);
    test_memory.left = SIZE_MAX;
    assert_true(status == TW_OK || status == TW_NO_MEMORY);
    if (status != TW_OK) assert_int_equal(test_memory.held, held);
  }
  assert_true(failures > 20);
  tw_surface_destroy(surface);
  free(c);
}

/* A plan moved to other positions is the surface over these. */
TEST(open_answers_in_two_parts_move) {
  cage *c = grid(4, 4, false, waves);
  const tw_surface_options options = {
      .level = 9, .boundary = TW_BOUNDARY_OPEN, .normals = true, .movable = true};
  rows still = read_rows(&c->mesh, options);
  for (uint32_t i = 0; i < c->mesh.point_count; i++) c->points[i][2] += 0.1f * (float)(i * i % 5);
  rows moved = read_rows(&c->mesh, options), by_plan = still;
  assert_int_equal(tw_surface_with_positions_by(still.surface, c->points[0], NULL, &by_plan.surface), TW_OK);
  by_plan.values = all_rows(by_plan.surface, TW_DOMAIN_VERTICES);
  assert_memory_equal(by_plan.values, moved.values, moved.count * moved.layout->stride * sizeof(float));
  assert_exact_bounds(&by_plan);
  free_rows(&by_plan);
  free_rows(&moved);
  free_rows(&still);
  free(c);
}
