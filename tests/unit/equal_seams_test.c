/* Seams between equal values: two values of corners at a point that are the same numbers are two all the
 * same, in files written and read again, after edits, and where points elsewhere become one. */
#include "edited.h"
#include "merge_points.h"
#include "random_below.h"
#include "written_glb.h"

enum { SIDE = 4, POINTS = (SIDE + 1) * (SIDE + 1), FACES = SIDE * SIDE, CORNERS = 4 * FACES, CHANNELS = 3 };

/* A bumpy grid with a UV set, colours and labels of corners, of few different numbers. */
typedef struct patch {
  float positions[POINTS][3], uvs[CORNERS][2], colors[CORNERS][4], labels[CORNERS];
  uint32_t offsets[FACES + 1], corners[CORNERS], ids[CHANNELS][CORNERS];
  tw_attribute attributes[2];
  tw_mesh mesh;
} patch;

/* Gives the corners at each point one of two values of the point, or values of their own. */
static void part_values(patch *p, uint32_t *ids) {
  uint32_t by_point[POINTS][2], own = 2 * POINTS, rare = 2 + below(6);
  for (uint32_t v = 0; v < POINTS; v++)
    for (uint32_t k = 0; k < 2; k++) by_point[v][k] = 2 * v + k;
  for (uint32_t c = 0; c < CORNERS; c++)
    ids[c] = below(rare) || own == CORNERS ? by_point[p->corners[c]][below(rare) == 0] : own++;
}

static void make_patch(patch *p) {
  memset(p, 0, sizeof *p);
  for (uint32_t v = 0; v < POINTS; v++) {
    p->positions[v][0] = (float)(v % (SIDE + 1));
    p->positions[v][1] = (float)(v / (SIDE + 1));
    p->positions[v][2] = (float)below(100) / 200;
  }
  for (uint32_t f = 0; f < FACES; f++) {
    uint32_t at = f / SIDE * (SIDE + 1) + f % SIDE, quad[4] = {at, at + 1, at + SIDE + 2, at + SIDE + 1};
    memcpy(p->corners + 4 * f, quad, sizeof quad);
    p->offsets[f + 1] = 4 * f + 4;
  }
  uint32_t palette = 1 + below(3);
  for (uint32_t i = 0; i < CORNERS; i++) {
    p->uvs[i][0] = (float)below(palette) / 4;
    for (uint32_t k = 0; k < 4; k++) p->colors[i][k] = 0.5f;
    p->colors[i][0] = (float)below(palette) / 4;
    p->labels[i] = (float)below(palette);
  }
  for (uint32_t i = 0; i < CHANNELS; i++) part_values(p, p->ids[i]);
  p->attributes[0] = (tw_attribute){.name = "COLOR_0",
                                    .width = 4,
                                    .is_color = true,
                                    .values = p->colors[0],
                                    .value_count = CORNERS,
                                    .corners = p->ids[1]};
  p->attributes[1] = (tw_attribute){.name = "_LABEL",
                                    .width = 1,
                                    .values = p->labels,
                                    .value_count = CORNERS,
                                    .corners = p->ids[2],
                                    .numbers = TW_NUMBERS_UINT8};
  p->mesh = mesh_of(p->positions[0], POINTS, p->corners, p->offsets, FACES);
  p->mesh.uv_set_count = 1;
  p->mesh.uv_sets[0] = (tw_uv_set){CORNERS, p->uvs[0], p->ids[0]};
  p->mesh.attribute_count = 2;
  p->mesh.attributes = p->attributes;
}

/* Whether two corners of a mesh share a value of a channel. */
static bool shares(const tw_mesh *mesh, const tw_channel *channel, uint32_t a, uint32_t b) {
  return mesh->corners[a] == mesh->corners[b] && channel->corners[a] == channel->corners[b];
}

/* Asserts that the first corners of both meshes, with equal points, share values alike and have equal ones.
 */
static void assert_same_values(const tw_mesh *a, const tw_mesh *b, uint32_t channel_count, uint32_t corners) {
  tw_channel own[TW_CHANNELS_MAX], other[TW_CHANNELS_MAX];
  assert_true(tw_mesh_channels(a, own) >= channel_count);
  assert_true(tw_mesh_channels(b, other) >= channel_count);
  for (uint32_t i = 0; i < channel_count; i++)
    for (uint32_t c = 0; c < corners; c++) {
      const float *x = own[i].values + own[i].width * own[i].corners[c],
                  *y = other[i].values + other[i].width * other[i].corners[c];
      for (uint32_t k = 0; k < own[i].width; k++) assert_true(x[k] == y[k]);
      for (uint32_t d = 0; d < c; d++)
        if (shares(a, &own[i], c, d) != shares(b, &other[i], c, d))
          fail_msg("channel %u, corners %u and %u", i, d, c);
    }
}

static void begin_scene(fixture *f, const tw_mesh *mesh) {
  *f = (fixture){.model = tw_model_create()};
  assert_non_null(f->model);
  f->model->meshes = fixture_alloc(f, 1, sizeof *f->model->meshes);
  f->model->meshes[0] = *mesh;
  f->model->mesh_count = 1;
  fixture_node(f, "node", TW_NO_INDEX, 0);
  fixture_refine_tagged(f);
  f->scene.polygons = TW_POLYGONS_NGON;
}

static tw_model *read_back(const tw_mesh *mesh) {
  fixture f;
  tw_model *model = NULL;
  tw_error error;
  begin_scene(&f, mesh);
  glb file = write_glb(&f.scene);
  if (tw_gltf_read(file.bytes, file.size, TW_QUADS_USUAL, TW_WELD_AUTO, 1 << 20, &model, &error) != TW_OK)
    fail_msg("%s", error.detail);
  free_glb(&file);
  fixture_deinit(&f);
  return model;
}

TEST(a_cage_as_gltf_keeps_them) {
  patch *p = malloc(sizeof *p);
  assert_non_null(p);
  for (int round = 0; round < 60; round++) {
    make_patch(p);
    tw_model *model = read_back(&p->mesh);
    assert_memory_equal(model->meshes->corners, p->corners, sizeof p->corners);
    assert_same_values(&p->mesh, model->meshes, CHANNELS, CORNERS);
    tw_model_destroy(model);
  }
  free(p);
}

/* What values tell of themselves needs no word. */
TEST(a_cage_without_them_says_nothing_of_values) {
  patch *p = malloc(sizeof *p);
  fixture f;
  assert_non_null(p);
  make_patch(p);
  for (uint32_t i = 0; i < CHANNELS; i++) memcpy(p->ids[i], p->corners, sizeof p->corners);
  begin_scene(&f, &p->mesh);
  glb file = write_glb(&f.scene);
  assert_null(strstr((const char *)file.bytes + 20, "\"values\""));
  free_glb(&file);
  fixture_deinit(&f);
  free(p);
}

TEST(a_cage_as_obj_keeps_them) {
  patch *p = malloc(sizeof *p);
  assert_non_null(p);
  for (int round = 0; round < 40; round++) {
    fixture f;
    tw_obj_stream *stream = NULL;
    tw_model *model = NULL;
    tw_error error;
    static uint8_t text[1 << 18];
    make_patch(p);
    begin_scene(&f, &p->mesh);
    assert_int_equal(tw_obj_stream_create(&f.scene, &stream, &error), TW_OK);
    size_t size = tw_obj_stream_read(stream, text, sizeof text);
    assert_true(size < sizeof text);
    assert_int_equal(tw_obj_read(text, size, TW_WELD_AUTO, &model, &error), TW_OK);
    assert_same_values(&p->mesh, model->meshes, 1, CORNERS);
    tw_obj_stream_destroy(stream);
    tw_model_destroy(model);
    fixture_deinit(&f);
  }
  free(p);
}

/* The last face alone is edited; the others keep their values. */
TEST(edits_keep_them_and_files_made_of_edits_too) {
  const tw_edit edits[] = {
      {.kind = TW_EDIT_EXTRUDE, .selection = LIST(TW_EDIT_FACES, FACES - 1), .extrude = {.distance = 1}},
      {.kind = TW_EDIT_MERGE,
       .selection = {.of = TW_EDIT_VERTICES, .by = TW_SELECT_ALL},
       .merge = {.distance = 1e-6}},
      {.kind = TW_EDIT_DELETE, .selection = LIST(TW_EDIT_FACES, FACES - 1)},
      {.kind = TW_EDIT_TRIANGULATE, .selection = LIST(TW_EDIT_FACES, FACES - 1)},
      {.kind = TW_EDIT_HOLE, .selection = LIST(TW_EDIT_FACES, FACES - 1)}};
  patch *p = malloc(sizeof *p);
  assert_non_null(p);
  for (uint32_t round = 0; round < 40; round++) {
    make_patch(p);
    edited e = edit_once(&p->mesh, edits[round % (sizeof edits / sizeof *edits)]);
    assert_same_values(&p->mesh, &e.mesh, CHANNELS, CORNERS - 4);
    tw_model *model = read_back(&e.mesh);
    assert_same_values(&e.mesh, model->meshes, CHANNELS, e.mesh.corner_count);
    tw_model_destroy(model);
    edited_deinit(&e);
  }
  free(p);
}

/* ---- points that become one ------------------------------------------------------------------ */

/* Two pairs of quads: those of a pair share an edge, with a seam between equal values; the pairs meet at
 * doubled points, where values are equal at the first `equal` of the three. */
typedef struct pairs {
  float positions[12][3], uvs[16][2];
  uint32_t offsets[5], corners[16], ids[16];
  tw_mesh mesh;
} pairs;

static void make_pairs(pairs *p, uint32_t equal) {
  memset(p, 0, sizeof *p);
  for (uint32_t v = 0; v < 12; v++) {
    uint32_t row = v / 3;
    p->positions[v][0] = (float)(v % 3);
    p->positions[v][1] = (float)(row - (row >= 2));
  }
  for (uint32_t f = 0; f < 4; f++) {
    uint32_t at = f / 2 * 6 + f % 2, quad[4] = {at, at + 1, at + 4, at + 3};
    memcpy(p->corners + 4 * f, quad, sizeof quad);
    p->offsets[f + 1] = 4 * f + 4;
  }
  for (uint32_t c = 0; c < 16; c++) {
    uint32_t v = p->corners[c];
    p->ids[c] = c;
    p->uvs[c][0] = p->positions[v][0];
    p->uvs[c][1] = p->positions[v][1] + (v >= 6 && v < 9 && v - 6 >= equal ? 5.0F : 0.0F);
  }
  p->mesh = mesh_of(p->positions[0], 12, p->corners, p->offsets, 4);
  p->mesh.uv_set_count = 1;
  p->mesh.uv_sets[0] = (tw_uv_set){16, p->uvs[0], p->ids};
}

/* Corners 2, 3 and 6, 7 are the upper ones of the lower quads, 8, 9 and 12, 13 the lower ones of the upper
 * quads; those named one after the other are at one point. */
static void assert_joined(const tw_mesh *mesh, uint32_t equal) {
  const uint32_t *values = mesh->uv_sets[0].corners;
  assert_int_equal(mesh->point_count, 9);
  assert_int_equal(values[3] == values[8], equal >= 2);
  assert_int_equal(values[2] == values[9], equal >= 2);
  assert_int_equal(values[7] == values[12], equal >= 3);
  assert_int_equal(values[6] == values[13], equal >= 3);
  assert_true(values[1] != values[4] && values[10] != values[15]); /* seams of the pairs */
  assert_true(values[2] != values[7] && values[9] != values[12]);
}

TEST(edges_that_an_edit_makes_one_join_equal_values_and_no_other_seam) {
  const tw_edit weld = {.kind = TW_EDIT_MERGE,
                        .selection = {.of = TW_EDIT_VERTICES, .by = TW_SELECT_ALL},
                        .merge = {.distance = 1e-6}};
  for (uint32_t equal = 0; equal <= 3; equal++) {
    pairs p;
    make_pairs(&p, equal);
    edited e = edit_once(&p.mesh, weld);
    assert_joined(&e.mesh, equal);
    edited_deinit(&e);
  }
}

TEST(a_distance_joins_equal_values_only_where_points_become_one) {
  pairs p;
  tw_merged merged;
  make_pairs(&p, 3);
  tw_arena *arena = tw_arena_create();
  assert_non_null(arena);
  assert_int_equal(tw_mesh_merge_within(&p.mesh, 1e-6, arena, &merged, NULL), TW_OK);
  assert_int_equal(p.mesh.point_count, 9);
  assert_true(p.ids[3] == p.ids[8] && p.ids[6] == p.ids[13]);
  assert_true(p.ids[1] != p.ids[4] && p.ids[10] != p.ids[15]);
  make_pairs(&p, 3);
  assert_int_equal(tw_mesh_merge_within(&p.mesh, 1e-12, arena, &merged, NULL), TW_OK);
  tw_arena_destroy(arena);
}
