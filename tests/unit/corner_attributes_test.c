/* Attributes with values of corners: welded, split and subdivided as a plain reference says. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "edited.h"
#include "merge_points.h"
#include "random_below.h"
#include "soup_mesh.h"
#include "surface_rows.h"
#include "test.h"
#include "tweend/coarsen.h"

/* ---- random meshes --------------------------------------------------------------------------- */

enum {
  SIDE = 4,
  POINTS = (SIDE + 1) * (SIDE + 1),
  CORNERS = 6 * SIDE * SIDE,
  RANDOM = 5,
  ATTRIBUTES = RANDOM + 2
};
typedef enum shapes { QUADS, TRIANGLES, MIXED } shapes;

/* A bumpy grid. Attributes: the weights of the face's corners, which tell where in its face a point is; the
 * face's number; then random values, of which the last are whole numbers. */
typedef struct patch {
  tw_mesh mesh;
  float positions[POINTS][3];
  uint32_t offsets[2 * SIDE * SIDE + 1], corners[CORNERS];
  float weights[4][4], numbers[2 * SIDE * SIDE], values[RANDOM][CORNERS][3];
  uint32_t weight_corners[CORNERS], number_corners[CORNERS], value_corners[RANDOM][CORNERS];
  float uvs[4][CORNERS][2];
  uint32_t hole;
  tw_attribute attributes[ATTRIBUTES];
} patch;

static void add_face(patch *p, const uint32_t *points, uint32_t size) {
  tw_mesh *m = &p->mesh;
  for (uint32_t k = 0; k < size; k++) {
    p->weight_corners[m->corner_count] = k;
    p->number_corners[m->corner_count] = m->face_count;
    p->corners[m->corner_count++] = points[k];
  }
  p->numbers[m->face_count] = (float)(1000 * m->face_count);
  p->offsets[++m->face_count] = m->corner_count;
}

static void add_faces(patch *p, shapes kind) {
  for (uint32_t cell = 0; cell < SIDE * SIDE; cell++) {
    uint32_t at = cell / SIDE * (SIDE + 1) + cell % SIDE,
             quad[4] = {at, at + 1, at + SIDE + 2, at + SIDE + 1};
    if (kind == QUADS || (kind == MIXED && below(2))) {
      add_face(p, quad, 4);
      continue;
    }
    add_face(p, quad, 3);
    add_face(p, (uint32_t[3]){quad[0], quad[2], quad[3]}, 3);
  }
}

/* Values of points, and at some corners values of their own. */
static void add_values(patch *p, uint32_t i) {
  uint32_t rare = 2 + below(8);
  for (uint32_t v = 0; v < CORNERS; v++)
    for (uint32_t c = 0; c < 3; c++)
      p->values[i][v][c] = i >= RANDOM - 2 ? (float)below(60000) : (float)below(1024) / 1024;
  for (uint32_t c = 0; c < p->mesh.corner_count; c++)
    p->value_corners[i][c] = below(rare) ? p->corners[c] : below(CORNERS);
}

static void make_patch(patch *p, shapes kind) {
  memset(p, 0, sizeof *p);
  tw_mesh_init(&p->mesh);
  add_faces(p, kind);
  for (uint32_t v = 0; v < POINTS; v++) {
    p->positions[v][0] = (float)(v % (SIDE + 1));
    p->positions[v][1] = (float)(v / (SIDE + 1));
    p->positions[v][2] = (float)below(100) / 200;
  }
  for (uint32_t k = 0; k < 4; k++) p->weights[k][k] = 1;
  for (uint32_t i = 0; i < RANDOM; i++) add_values(p, i);
  p->attributes[0] = (tw_attribute){.name = "_WEIGHTS",
                                    .width = 4,
                                    .values = p->weights[0],
                                    .value_count = 4,
                                    .corners = p->weight_corners};
  p->attributes[1] = (tw_attribute){.name = "_FACE",
                                    .width = 1,
                                    .values = p->numbers,
                                    .value_count = p->mesh.face_count,
                                    .corners = p->number_corners,
                                    .numbers = TW_NUMBERS_WHOLE};
  for (uint32_t i = 0; i < RANDOM; i++)
    p->attributes[2 + i] = (tw_attribute){.name = "_RANDOM",
                                          .width = 3,
                                          .values = p->values[i][0],
                                          .value_count = CORNERS,
                                          .corners = p->value_corners[i],
                                          .numbers = i < RANDOM - 2 ? TW_NUMBERS_REAL : TW_NUMBERS_WHOLE};
  /* The last attribute is of points. */
  p->attributes[ATTRIBUTES - 1].corners = NULL;
  p->mesh.point_count = POINTS;
  p->mesh.positions = p->positions[0];
  p->mesh.face_offsets = p->offsets;
  p->mesh.corners = p->corners;
  p->mesh.attribute_count = ATTRIBUTES;
  p->mesh.attributes = p->attributes;
}

static void add_uvs(patch *p) {
  p->mesh.uv_set_count = 4;
  for (uint32_t s = 0; s < 4; s++) {
    for (uint32_t i = 0; i < CORNERS; i++)
      for (int c = 0; c < 2; c++) p->uvs[s][i][c] = (float)below(64) / 64;
    p->mesh.uv_sets[s] = (tw_uv_set){CORNERS, p->uvs[s][0], p->value_corners[s % 3]};
  }
}

/* ---- the reference --------------------------------------------------------------------------- */

/* The value of an attribute at a corner. */
static const float *at_corner(const tw_mesh *mesh, uint32_t attribute, uint32_t corner) {
  const tw_attribute *a = &mesh->attributes[attribute];
  return a->values + a->width * (size_t)(a->corners ? a->corners[corner] : mesh->corners[corner]);
}

/* Whether a row has the mean of the corners' values by their weights. */
static void assert_mean(const tw_mesh *mesh, uint32_t attribute, uint32_t first, uint32_t size,
                        const float *weights, const float *value) {
  for (uint32_t c = 0; c < 3; c++) {
    double sum = 0;
    for (uint32_t k = 0; k < size; k++)
      sum += (double)weights[k] * (double)at_corner(mesh, attribute, first + k)[c];
    assert_float_equal(value[c], sum, 2e-6);
  }
}

/* Whether a row has exactly the value of one of the corners with the greatest weight. */
static void assert_nearest(const tw_mesh *mesh, uint32_t attribute, uint32_t first, uint32_t size,
                           const float *weights, const float *value) {
  float greatest = 0;
  bool found = false;
  for (uint32_t k = 0; k < size; k++) greatest = fmaxf(greatest, weights[k]);
  for (uint32_t k = 0; k < size; k++)
    found |= weights[k] > greatest - 1e-5f &&
             memcmp(at_corner(mesh, attribute, first + k), value, 3 * sizeof *value) == 0;
  assert_true(found);
}

/* Checks a row's values by its face and the weights of the face's corners. By the rule `all` every value is
 * such a mean. */
static void assert_row(const tw_mesh *mesh, const tw_surface_layout *layout, const float *row) {
  const float *weights = row + layout->attributes[0].column;
  uint32_t face = (uint32_t)row[layout->attributes[1].column] / 1000;
  assert_true(face < mesh->face_count && row[layout->attributes[1].column] == (float)(1000 * face));
  uint32_t first = mesh->face_offsets[face], size = mesh->face_offsets[face + 1] - first;
  assert_float_equal(weights[0] + weights[1] + weights[2] + weights[3], 1, 1e-5);
  if (size == 4) assert_float_equal(weights[0] * weights[2], weights[1] * weights[3], 1e-6);
  for (uint32_t i = 2; i < ATTRIBUTES; i++) {
    const float *value = row + layout->attributes[i].column;
    if (mesh->attributes[i].numbers == TW_NUMBERS_REAL)
      assert_mean(mesh, i, first, size, weights, value);
    else
      assert_nearest(mesh, i, first, size, weights, value);
  }
}

static void assert_surface(const tw_mesh *mesh, tw_surface_options options) {
  rows r = read_rows(mesh, options);
  for (size_t i = 0; i < r.count; i++) assert_row(mesh, r.layout, row_of(&r, i));
  assert_same_in_blocks(&r);
  free_rows(&r);
}

TEST(values_of_corners_are_means_of_their_face_by_every_way) {
  static const tw_boundary boundaries[] = {TW_BOUNDARY_EDGE_AND_CORNER, TW_BOUNDARY_NONE, TW_BOUNDARY_OPEN};
  patch *p = malloc(sizeof *p);
  assert_non_null(p);
  uint32_t number = 0;
  for (int kind = 0; kind < 6; kind++)
    for (uint32_t level = 0; level <= 5; level++)
      for (uint32_t flags = 0; flags < 12; flags++) {
        if (number++ % test_stride() != 0) continue;
        make_patch(p, (shapes)(kind % 3));
        if (flags & 1) add_uvs(p);
        p->hole = below(p->mesh.face_count);
        p->mesh.holes = &p->hole;
        p->mesh.hole_count = flags & 2 ? 1 : 0;
        tw_surface_options options = {.level = level,
                                      .uv = TW_UV_ALL,
                                      .boundary = boundaries[flags / 4],
                                      .scheme =
                                          kind % 3 == TRIANGLES && kind >= 3 ? TW_LOOP : TW_CATMULL_CLARK,
                                      .normals = kind >= 3};
        assert_surface(&p->mesh, options);
      }
  free(p);
}

/* ---- rows ------------------------------------------------------------------------------------ */

static bool same_values(const tw_mesh *mesh, uint32_t a, uint32_t b) {
  if (mesh->corners[a] != mesh->corners[b]) return false;
  for (uint32_t i = 0; i < mesh->attribute_count; i++) {
    const uint32_t *corners = mesh->attributes[i].corners;
    if (corners && corners[a] != corners[b]) return false;
  }
  for (uint32_t s = 0; s < mesh->uv_set_count; s++)
    if (mesh->uv_sets[s].corners[a] != mesh->uv_sets[s].corners[b]) return false;
  return true;
}

/* More channels than a row's first key has room for. */
TEST(points_have_as_many_rows_as_different_values) {
  patch *p = malloc(sizeof *p);
  assert_non_null(p);
  for (int round = 0; round < 20; round++) {
    make_patch(p, MIXED);
    if (round % 2) add_uvs(p);
    /* Without the channels that differ at every corner. */
    p->mesh.attributes += 2;
    p->mesh.attribute_count -= 2;
    uint32_t expected = 0;
    for (uint32_t c = 0; c < p->mesh.corner_count; c++) {
      bool is_first = true;
      for (uint32_t b = 0; b < c; b++) is_first &= !same_values(&p->mesh, b, c);
      expected += is_first;
    }
    rows r = read_rows(&p->mesh, (tw_surface_options){.level = 0});
    assert_int_equal(r.count, expected);
    free_rows(&r);
  }
  free(p);
}

/* Values that do not differ at any point are those of points. */
TEST(values_of_corners_without_seams_are_refined_as_those_of_points) {
  patch *p = malloc(sizeof *p);
  assert_non_null(p);
  for (uint32_t level = 0; level <= 5; level++)
    for (int kind = 0; kind < 3; kind++) {
      make_patch(p, (shapes)kind);
      p->mesh.attributes += 2;
      p->mesh.attribute_count = 2;
      p->attributes[2].corners = p->corners;
      p->attributes[3].corners = NULL;
      p->attributes[3].values = p->attributes[2].values;
      rows r = read_rows(&p->mesh, (tw_surface_options){
                                       .level = level, .uv = TW_UV_NONE, .boundary = TW_BOUNDARY_EDGE_ONLY});
      for (size_t i = 0; i < r.count; i++)
        for (uint32_t c = 0; c < 3; c++)
          assert_float_equal(row_of(&r, i)[r.layout->attributes[0].column + c],
                             row_of(&r, i)[r.layout->attributes[1].column + c], 1e-6);
      free_rows(&r);
    }
  free(p);
}

/* ---- welding --------------------------------------------------------------------------------- */

/* Faces with vertices of their own, as an exporter writes them, or some of them shared. */
typedef struct soup {
  float positions[CORNERS][3], colors[CORNERS][4];
  uint32_t offsets[2 * SIDE * SIDE + 1], corners[CORNERS], vertex_count;
} soup;

static void make_soup(const patch *p, uint32_t palette, soup *s) {
  uint32_t by_point[POINTS][2];
  memset(s, 0, sizeof *s);
  memset(by_point, 0xFF, sizeof by_point);
  memcpy(s->offsets, p->offsets, sizeof s->offsets);
  for (uint32_t c = 0; c < p->mesh.corner_count; c++) {
    uint32_t point = p->corners[c], color = below(3) ? 0 : below(palette), which = color == 0 ? 0 : 1;
    if (which == 0 && by_point[point][0] != UINT32_MAX && below(2)) {
      s->corners[c] = by_point[point][0];
      continue;
    }
    uint32_t v = s->corners[c] = s->vertex_count++;
    if (which == 0) by_point[point][0] = v;
    memcpy(s->positions[v], p->positions[point], sizeof s->positions[v]);
    for (uint32_t k = 0; k < 4; k++) s->colors[v][k] = (float)(color + point % 2) / 8;
  }
}

/* Values of a point are one where faces join across edges with equal values at both ends: joins until nothing
 * changes. group: [corners]. */
static void group_corners(const tw_mesh *mesh, const soup *s, const uint32_t *vertices, uint32_t *group) {
  uint32_t count = mesh->corner_count;
  for (uint32_t c = 0; c < count; c++) group[c] = c;
  for (bool changed = true; changed;) {
    changed = false;
    for (uint32_t f = 0; f < mesh->face_count; f++)
      for (uint32_t g = 0; g < mesh->face_count; g++)
        for (uint32_t a = mesh->face_offsets[f]; a < mesh->face_offsets[f + 1]; a++)
          for (uint32_t b = mesh->face_offsets[g]; b < mesh->face_offsets[g + 1]; b++) {
            uint32_t next = a + 1 < mesh->face_offsets[f + 1] ? a + 1 : mesh->face_offsets[f],
                     last = b > mesh->face_offsets[g] ? b - 1 : mesh->face_offsets[g + 1] - 1;
            bool joined = vertices[a] == vertices[b];
            if (mesh->corners[a] == mesh->corners[b] && mesh->corners[next] == mesh->corners[last])
              joined |= memcmp(s->colors[vertices[a]], s->colors[vertices[b]], sizeof *s->colors) == 0 &&
                        memcmp(s->colors[vertices[next]], s->colors[vertices[last]], sizeof *s->colors) == 0;
            if (!joined || group[a] == group[b]) continue;
            uint32_t low = group[a] < group[b] ? group[a] : group[b], high = group[a] ^ group[b] ^ low;
            for (uint32_t c = 0; c < count; c++)
              if (group[c] == high) group[c] = low;
            changed = true;
          }
  }
}

/* Compares the colours of a welded mesh with those of the vertices that its corners were. */
static void assert_welded(const tw_mesh *mesh, const soup *s, const uint32_t *vertices) {
  const tw_attribute *color = mesh->attributes;
  uint32_t group[CORNERS];
  bool differs = false;
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    for (uint32_t b = 0; b < c; b++)
      differs |= mesh->corners[b] == mesh->corners[c] &&
                 memcmp(s->colors[vertices[b]], s->colors[vertices[c]], sizeof *s->colors) != 0;
    assert_memory_equal(at_corner(mesh, 0, c), s->colors[vertices[c]], sizeof *s->colors);
  }
  assert_int_equal(mesh->attribute_count, 1);
  assert_int_equal(color->corners != NULL, differs);
  if (!differs) return;
  group_corners(mesh, s, vertices, group);
  for (uint32_t c = 0; c < mesh->corner_count; c++)
    for (uint32_t b = 0; b < c; b++)
      assert_int_equal(color->corners[b] == color->corners[c], group[b] == group[c]);
}

TEST(random_colours_are_welded_as_a_plain_search_does) {
  patch *p = malloc(sizeof *p);
  soup *s = malloc(sizeof *s);
  assert_true(p && s);
  for (uint32_t round = 0; round < 60; round++) {
    uint32_t vertices[CORNERS];
    make_patch(p, (shapes)(round % 3));
    make_soup(p, 1 + round % 4, s);
    memcpy(vertices, s->corners, sizeof vertices);
    tw_polygons_read read = {.vertex_count = s->vertex_count,
                             .positions = s->positions[0],
                             .colors = s->colors[0],
                             .face_count = p->mesh.face_count,
                             .corner_count = p->mesh.corner_count,
                             .face_offsets = s->offsets,
                             .corners = s->corners};
    tw_losses losses = {0};
    tw_model *model = tw_model_create();
    assert_non_null(model);
    assert_int_equal(tw_model_of_polygons(&read, TW_WELD_AUTO, model, &losses, NULL), TW_OK);
    assert_int_equal(model->meshes->point_count, POINTS);
    assert_welded(model->meshes, s, vertices);
    tw_model_destroy(model);
  }
  free(p);
  free(s);
}

/* As OBJ is read: the points of a mesh are merged, which has its attributes already. */
TEST(random_colours_stay_where_points_are_merged) {
  patch *p = malloc(sizeof *p);
  soup *s = malloc(sizeof *s);
  assert_true(p && s);
  for (uint32_t round = 0; round < 60; round++) {
    uint32_t vertices[CORNERS];
    tw_welded welded;
    tw_merged merged;
    make_patch(p, (shapes)(round % 3));
    make_soup(p, 1 + round % 4, s);
    memcpy(vertices, s->corners, sizeof vertices);
    tw_attribute color = {.name = "COLOR_0", .width = 4, .is_color = true, .values = s->colors[0]};
    tw_mesh mesh = p->mesh;
    mesh.point_count = s->vertex_count;
    mesh.positions = s->positions[0];
    mesh.face_offsets = s->offsets;
    mesh.corners = s->corners;
    mesh.attributes = &color;
    mesh.attribute_count = 1;
    soup before = *s;
    tw_arena *arena = tw_arena_create();
    assert_non_null(arena);
    if (round % 2)
      assert_int_equal(tw_mesh_close_seams(&mesh, arena, &merged, &welded, NULL), TW_OK);
    else
      assert_int_equal(tw_mesh_merge_within(&mesh, 1e-3, arena, &merged, NULL), TW_OK);
    assert_int_equal(mesh.point_count, POINTS);
    assert_welded(&mesh, &before, vertices);
    tw_arena_destroy(arena);
  }
  free(p);
  free(s);
}

/* ---- the way back ---------------------------------------------------------------------------- */

/* A level as a mesh: every row of its vertex buffer is a value of corners. */
typedef struct fine_mesh {
  tw_mesh mesh;
  rows r;
  float *positions, *values[ATTRIBUTES];
  uint32_t *faces[2], *offsets;
  tw_attribute attributes[ATTRIBUTES];
} fine_mesh;

static void refine_mesh(const tw_mesh *mesh, tw_surface_options options, fine_mesh *fine) {
  *fine = (fine_mesh){.r = read_rows(mesh, options)};
  const tw_surface_counts *counts = tw_surface_get_counts(fine->r.surface);
  fine->positions = all_rows(fine->r.surface, TW_DOMAIN_POINTS);
  fine->faces[0] = faces_of(&fine->r, TW_DOMAIN_POINTS);
  fine->faces[1] = faces_of(&fine->r, TW_DOMAIN_VERTICES);
  fine->offsets = malloc((counts->faces + 1) * sizeof *fine->offsets);
  assert_non_null(fine->offsets);
  for (uint32_t f = 0; f <= counts->faces; f++) fine->offsets[f] = 4 * f;
  tw_mesh_init(&fine->mesh);
  fine->mesh.point_count = (uint32_t)counts->vertices;
  fine->mesh.positions = fine->positions;
  fine->mesh.face_count = (uint32_t)counts->faces;
  fine->mesh.corner_count = (uint32_t)counts->corners;
  fine->mesh.face_offsets = fine->offsets;
  fine->mesh.corners = fine->faces[0];
  fine->mesh.attribute_count = mesh->attribute_count;
  fine->mesh.attributes = fine->attributes;
  for (uint32_t a = 0; a < mesh->attribute_count; a++) {
    uint32_t width = mesh->attributes[a].width;
    fine->values[a] = malloc(fine->r.count * width * sizeof(float));
    assert_non_null(fine->values[a]);
    for (size_t i = 0; i < fine->r.count; i++)
      memcpy(fine->values[a] + width * i, row_of(&fine->r, i) + fine->r.layout->attributes[a].column,
             width * sizeof(float));
    fine->attributes[a] = mesh->attributes[a];
    fine->attributes[a].values = fine->values[a];
    fine->attributes[a].value_count = (uint32_t)fine->r.count;
    fine->attributes[a].corners = fine->faces[1];
  }
}

static void free_fine(fine_mesh *fine) {
  for (uint32_t a = 0; a < ATTRIBUTES; a++) free(fine->values[a]);
  for (int d = 0; d < 2; d++) free(fine->faces[d]);
  free(fine->positions);
  free(fine->offsets);
  free_rows(&fine->r);
}

TEST(coarsened_meshes_have_the_values_of_their_corners_again) {
  patch *p = malloc(sizeof *p);
  assert_non_null(p);
  for (uint32_t round = 0; round < 24; round++) {
    make_patch(p, (shapes)(round % 3));
    /* Without what differs at every corner, and without what would give all others its seams. */
    p->mesh.attributes += 2 + round % RANDOM;
    p->mesh.attribute_count = 1;
    const tw_surface_options options = {.level = 1 + round % 2, .uv = (tw_uv_rule)(round / 4 % 6)};
    fine_mesh fine;
    refine_mesh(&p->mesh, options, &fine);
    tw_surface_options back = options;
    back.level = TW_LEVEL_MAX;
    tw_coarsened found;
    tw_arena *arena = tw_arena_create();
    assert_non_null(arena);
    assert_int_equal(tw_mesh_coarsen(&fine.mesh, &back, NULL, arena, &found, NULL), TW_OK);
    assert_int_equal(found.levels, options.level);
    assert_int_equal(found.mesh.corner_count, p->mesh.corner_count);
    bool is_whole = p->mesh.attributes->numbers != TW_NUMBERS_REAL;
    for (uint32_t c = 0; c < p->mesh.corner_count; c++)
      for (uint32_t k = 0; k < 3; k++)
        assert_true(fabsf(at_corner(&found.mesh, 0, c)[k] - at_corner(&p->mesh, 0, c)[k]) <=
                    (is_whole ? 0.0F : 2e-4F));
    tw_arena_destroy(arena);
    free_fine(&fine);
  }
  free(p);
}

/* ---- edits ----------------------------------------------------------------------------------- */

/* Points at one place keep their colours when an edit merges them; a face that is extruded keeps its colours
 * on its walls, which its map leads beyond its edges. */
TEST(merged_and_extruded_faces_keep_the_colours_of_their_corners) {
  const float positions[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                 {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}};
  const uint32_t corners[8] = {0, 1, 2, 3, 4, 5, 6, 7}, offsets[3] = {0, 4, 8};
  float colors[8][4], uvs[8][2];
  for (int v = 0; v < 8; v++) {
    for (int k = 0; k < 4; k++) colors[v][k] = k < 3 ? (float)(v < 4) : 1;
    memcpy(uvs[v], positions[v], sizeof uvs[v]);
  }
  const tw_attribute color = {.name = "COLOR_0", .width = 4, .is_color = true, .values = colors[0]};
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  mesh.point_count = 8;
  mesh.positions = positions[0];
  mesh.face_count = 2;
  mesh.corner_count = 8;
  mesh.face_offsets = offsets;
  mesh.corners = corners;
  mesh.attribute_count = 1;
  mesh.attributes = &color;
  mesh.uv_set_count = 1;
  mesh.uv_sets[0] = (tw_uv_set){8, uvs[0], corners};
  const tw_edit edits[2] = {{.kind = TW_EDIT_MERGE,
                             .selection = {.of = TW_EDIT_VERTICES, .by = TW_SELECT_ALL},
                             .merge.distance = 0},
                            {.kind = TW_EDIT_EXTRUDE,
                             .selection = {.of = TW_EDIT_FACES, .by = TW_SELECT_ALL},
                             .extrude = {.distance = 5, .is_individual = true}}};
  edited merged = edit(&mesh, edits, 1);
  assert_int_equal(merged.mesh.point_count, 6);
  assert_non_null(merged.mesh.attributes[0].corners);
  for (uint32_t c = 0; c < 8; c++)
    assert_memory_equal(at_corner(&merged.mesh, 0, c), colors[c], sizeof colors[c]);
  edited walls = edit(&mesh, edits, 2);
  assert_int_equal(walls.mesh.face_count, 10);
  for (uint32_t f = 0; f < walls.mesh.face_count; f++) {
    const float *first = at_corner(&walls.mesh, 0, walls.mesh.face_offsets[f]);
    assert_true(first[0] == 0 || first[0] == 1);
    for (uint32_t c = walls.mesh.face_offsets[f]; c < walls.mesh.face_offsets[f + 1]; c++)
      assert_memory_equal(at_corner(&walls.mesh, 0, c), first, sizeof colors[0]);
  }
  edited_deinit(&walls);
  edited_deinit(&merged);
}
