/* What a reader makes of a cage's vertices: what is told of it (tw_find_cage_changes, extras.tweend) against
 * the files, written and read. */
#include <math.h>

#include "edited.h"
#include "random_below.h"
#include "written_glb.h"

enum {
  SIDE = 3,
  GRID_POINTS = (SIDE + 1) * (SIDE + 1),
  QUADS = SIDE * SIDE,
  EXTRA = 5, /* triangles */
  POINTS_MAX = GRID_POINTS + 2 * EXTRA + 4,
  FACES_MAX = QUADS + EXTRA,
  CORNERS_MAX = 4 * QUADS + 3 * EXTRA,
  VALUES = 2 * POINTS_MAX + CORNERS_MAX,
  CREASES = 6,
  TARGETS = 1,
  INFLUENCES = 8,
  CHANNELS = 4
};

/* A bumpy grid with triangles that touch it at points and edges, points apart at one place, creases, and two
 * UV sets, colours and labels of corners, of few different numbers. */
typedef struct rough {
  float positions[POINTS_MAX][3], uvs[2][VALUES][2], colors[VALUES][4], labels[VALUES], sharpness[CREASES];
  float moves[POINTS_MAX][3], weights[POINTS_MAX][INFLUENCES];
  uint16_t joints[POINTS_MAX][INFLUENCES];
  uint32_t point_count, face_count, corner_count, edges[CREASES][2];
  uint32_t offsets[FACES_MAX + 1], corners[CORNERS_MAX], ids[CHANNELS][CORNERS_MAX];
  const float *morphs[TARGETS];
  tw_attribute attributes[2];
  tw_mesh mesh;
} rough;

static uint32_t add_point(rough *r, const float at[3]) {
  memcpy(r->positions[r->point_count], at, 3 * sizeof *at);
  return r->point_count++;
}

static void add_face(rough *r, const uint32_t *points, uint32_t size) {
  bool is_flipped = below(80) == 0;
  for (uint32_t k = 0; k < size; k++) r->corners[r->corner_count++] = points[is_flipped ? size - 1 - k : k];
  r->offsets[++r->face_count] = r->corner_count;
}

static void add_faces(rough *r) {
  for (uint32_t v = 0; v < GRID_POINTS; v++)
    add_point(r, (const float[3]){(float)(v % (SIDE + 1)), (float)(v / (SIDE + 1)), (float)below(100) / 300});
  for (uint32_t f = 0; f < QUADS; f++) {
    uint32_t at = f / SIDE * (SIDE + 1) + f % SIDE;
    add_face(r, (const uint32_t[4]){at, at + 1, at + SIDE + 2, at + SIDE + 1}, 4);
  }
  uint32_t own[3] = {0};
  for (uint32_t i = 0, most = below(2) * below(EXTRA + 1); i < most; i++) {
    const float height = 1 + (float)i;
    uint32_t touched = below(QUADS), k = below(4), first = own[0];
    own[0] = own[1];
    own[1] = first; /* beside the triangle before, across an edge or a diagonal of the grid */
    if (i == 0 || below(2)) {
      own[0] = r->corners[4 * touched + k];
      own[1] = r->corners[4 * touched + (k + 1 + below(2)) % 4];
      if (below(2)) own[1] = add_point(r, (const float[3]){(float)i, -1, height});
    }
    own[2] = add_point(r, (const float[3]){-1, (float)i, height});
    add_face(r, own, 3);
  }
  for (uint32_t i = below(8) / 6; i > 0; i--) { /* the point of one face alone becomes another one */
    uint32_t c = below(r->corner_count);
    r->corners[c] = add_point(r, r->positions[r->corners[c]]);
  }
}

/* Numbers of which some are equal, and some only once v has been turned over or colours are clamped. */
static void make_values(rough *r) {
  const float near[] = {0.1F, nextafterf(0.1F, 1), 0.7F, 0.25F}, bright[] = {1, 1.5F, 0.5F, -1};
  uint32_t palette = 1 + below(4);
  for (uint32_t i = 0; i < VALUES; i++) {
    for (uint32_t set = 0; set < 2; set++) {
      r->uvs[set][i][0] = below(6) ? 0.5F : near[below(2)];
      r->uvs[set][i][1] = near[below(palette)];
    }
    for (uint32_t k = 0; k < 4; k++) r->colors[i][k] = 0.5F;
    r->colors[i][0] = bright[below(palette)];
    r->labels[i] = (float)below(palette);
  }
}

/* Gives the corners at each point one of two values of the point, or values of their own; or the grid one and
 * the triangles another. */
static void part_values(const rough *r, uint32_t *ids) {
  bool parts_triangles = below(4) == 0;
  uint32_t rare = 1 + below(20), rarer = below(2) ? 0 : 2 * rare; /* 0: none */
  for (uint32_t c = 0; c < r->corner_count; c++)
    ids[c] =
        rarer == 0 || below(rarer) ? 2 * r->corners[c] + (rarer > 0 && below(rare) == 0) : 2 * POINTS_MAX + c;
  for (uint32_t c = 0; parts_triangles && c < r->corner_count; c++)
    ids[c] = 2 * r->corners[c] + (c >= 4 * QUADS);
}

/* Points beside the grid follow the joints of those at their place, or another one lightly, or by other
 * weights. */
static void make_skin(rough *r) {
  for (uint32_t v = 0; v < r->point_count; v++) {
    uint32_t kind = v < GRID_POINTS ? 0 : below(3);
    for (uint32_t k = 0; k < INFLUENCES; k++) r->joints[v][k] = (uint16_t)(kind == 1 && k >= 4 ? k + 4 : k);
    for (uint32_t k = 0; k < 5; k++) r->weights[v][k] = k < 4 ? 0.225F : 0.1F;
    if (kind == 2) r->weights[v][0] = 0.5F;
  }
  if (below(2)) r->mesh.skin = (tw_skin_weights){INFLUENCES, r->joints[0], r->weights[0]};
}

static void make_rough(rough *r) {
  static const uint32_t steps[2] = {1, SIDE + 1};
  memset(r, 0, sizeof *r);
  add_faces(r);
  make_values(r);
  for (uint32_t i = 0; i < CHANNELS; i++) part_values(r, r->ids[i]);
  r->mesh = mesh_of(r->positions[0], r->point_count, r->corners, r->offsets, r->face_count);
  r->mesh.uv_set_count = 2;
  for (uint32_t i = 0; i < 2; i++) r->mesh.uv_sets[i] = (tw_uv_set){VALUES, r->uvs[i][0], r->ids[i]};
  r->attributes[0] = (tw_attribute){.name = "COLOR_0",
                                    .width = 4,
                                    .is_color = true,
                                    .values = r->colors[0],
                                    .value_count = VALUES,
                                    .corners = r->ids[2]};
  r->attributes[1] = (tw_attribute){.name = "_LABEL",
                                    .width = 1,
                                    .values = r->labels,
                                    .value_count = VALUES,
                                    .corners = r->ids[3],
                                    .numbers = TW_NUMBERS_UINT8};
  r->mesh.attribute_count = below(3);
  r->mesh.attributes = r->attributes;
  for (uint32_t i = 0; i < CREASES; i++) {
    uint32_t a = below(SIDE) * (SIDE + 1) + below(SIDE);
    r->edges[i][0] = a;
    r->edges[i][1] = a + steps[below(2)];
    r->sharpness[i] = 10;
  }
  r->mesh.crease_count = below(2) * below(CREASES + 1);
  r->mesh.crease_edges = r->edges[0];
  r->mesh.crease_sharpness = r->sharpness;
  for (uint32_t v = 0; v < r->point_count; v++) r->moves[v][0] = (float)(v >= GRID_POINTS && below(2));
  make_skin(r);
  r->morphs[0] = r->moves[0];
  r->mesh.morphs = r->morphs;
  r->mesh.morph_count = below(2);
}

/* ---- files ------------------------------------------------------------------------------------ */

typedef struct round_trip {
  fixture f;
  tw_model *read;
  bool tells_values; /* extras do */
} round_trip;

static round_trip write_and_read(const tw_mesh *mesh, tw_polygons polygons, bool tagged) {
  round_trip out = {.f.model = tw_model_create()};
  tw_error error;
  assert_non_null(out.f.model);
  out.f.model->meshes = fixture_alloc(&out.f, 1, sizeof *out.f.model->meshes);
  out.f.model->meshes[0] = *mesh;
  out.f.model->mesh_count = 1;
  fixture_node(&out.f, "node", TW_NO_INDEX, 0);
  fixture_refine_by(&out.f,
                    &(tw_surface_options){.tagged = tagged, .normals = below(2), .influences = 4 * below(2)});
  out.f.scene.polygons = polygons;
  glb file = write_glb(&out.f.scene);
  /* Triangles are not to be paired: they stay as they are written. */
  tw_quads quads = polygons == TW_POLYGONS_NGON ? TW_QUADS_USUAL : TW_QUADS_OFF;
  out.tells_values = strstr((const char *)file.bytes + 20, "\"values\"");
  if (tw_gltf_read(file.bytes, file.size, quads, TW_WELD_AUTO, 1 << 20, &out.read, &error) != TW_OK)
    fail_msg("%s", error.detail);
  free_glb(&file);
  return out;
}

static void round_trip_deinit(round_trip *trip) {
  tw_model_destroy(trip->read);
  fixture_deinit(&trip->f);
}

/* ---- comparison ------------------------------------------------------------------------------- */

/* Numbers of points or values at the corners of what was read, and at the same corners of the mesh. */
typedef struct numbers {
  uint32_t count, was[3 * CORNERS_MAX], is[3 * CORNERS_MAX];
} numbers;

/* The corner of a face of the mesh that is at this place: a face has each place once. */
static uint32_t corner_at(const tw_mesh *mesh, uint32_t face, const float *place) {
  for (uint32_t c = mesh->face_offsets[face]; c < mesh->face_offsets[face + 1]; c++)
    if (memcmp(mesh->positions + 3 * mesh->corners[c], place, 3 * sizeof *place) == 0) return c;
  fail_msg("face %u has no such corner", face);
  return 0;
}

/* The corner of the mesh for each corner of what was read, whose faces are the mesh's or their triangles.
 * False where a reader has left out or split faces. */
static bool match_corners(const tw_mesh *mesh, const tw_mesh *read, bool is_triangles, uint32_t *corners) {
  uint32_t expected = is_triangles ? mesh->corner_count - 2 * mesh->face_count : mesh->face_count;
  if (read->face_count != expected) return false;
  for (uint32_t f = 0, g = 0; f < mesh->face_count; f++) {
    uint32_t parts = is_triangles ? mesh->face_offsets[f + 1] - mesh->face_offsets[f] - 2 : 1;
    for (; parts > 0; parts--, g++)
      for (uint32_t c = read->face_offsets[g]; c < read->face_offsets[g + 1]; c++)
        corners[c] = corner_at(mesh, f, read->positions + 3 * read->corners[c]);
  }
  return true;
}

static bool differ(const uint32_t *a, const uint32_t *b, uint32_t count) {
  for (uint32_t i = 0; i < count; i++)
    for (uint32_t k = 0; k < i; k++)
      if (a[i] == a[k] && b[i] != b[k]) return true;
  return false;
}

/* The numbers of a channel's values, together with those of points; of an attribute that has become one of
 * points, of these alone. */
static void number_channel(const tw_mesh *mesh, const char *name, const uint32_t *corners, uint32_t count,
                           uint32_t *out) {
  const uint32_t *values = NULL;
  if (strncmp(name, "TEXCOORD_", 9) == 0) values = mesh->uv_sets[name[9] - '0'].corners;
  for (uint32_t i = 0; i < mesh->attribute_count; i++)
    if (strcmp(mesh->attributes[i].name, name) == 0) values = mesh->attributes[i].corners;
  for (uint32_t i = 0; i < count; i++) {
    uint32_t c = corners ? corners[i] : i;
    out[i] = mesh->corners[c] * (VALUES + 1) + (values ? values[c] : 0);
  }
}

/* What has become of the mesh. corners: from match_corners. */
static tw_cage_changes look(const tw_mesh *mesh, const tw_mesh *read, const uint32_t *corners) {
  static const char *const names[CHANNELS] = {"TEXCOORD_0", "TEXCOORD_1", "COLOR_0", "_LABEL"};
  static numbers n;
  tw_cage_changes out = {0};
  n.count = read->corner_count;
  for (uint32_t i = 0; i < n.count; i++) {
    n.was[i] = mesh->corners[corners[i]];
    n.is[i] = read->corners[i];
  }
  out.joins_points = differ(n.is, n.was, n.count);
  out.parts_points = differ(n.was, n.is, n.count);
  for (uint32_t i = 0; i < 2 + mesh->attribute_count; i++) {
    number_channel(mesh, names[i], corners, n.count, n.was);
    number_channel(read, names[i], NULL, n.count, n.is);
    out.joins_values |= differ(n.is, n.was, n.count);
    out.parts_values |= differ(n.was, n.is, n.count);
  }
  return out;
}

/* ---- tests ------------------------------------------------------------------------------------ */

TEST(what_a_file_without_tags_makes_of_a_cage_is_told) {
  const uint32_t rounds = 4000 / test_stride();
  rough *r = malloc(sizeof *r);
  uint32_t told[4] = {0}, same = 0, compared = 0;
  assert_non_null(r);
  for (uint32_t round = 0; round < rounds; round++) {
    static uint32_t corners[3 * CORNERS_MAX];
    tw_polygons polygons = round % 2 ? TW_POLYGONS_NGON : TW_POLYGONS_TRIANGLES;
    tw_cage_changes said;
    make_rough(r);
    round_trip trip = write_and_read(&r->mesh, polygons, false);
    const tw_mesh *read = trip.read->meshes;
    assert_false(trip.tells_values);
    assert_int_equal(tw_find_cage_changes(trip.f.surfaces[0], &r->mesh, polygons, &said), TW_OK);
    if (match_corners(&r->mesh, read, polygons == TW_POLYGONS_TRIANGLES, corners)) {
      tw_cage_changes seen = look(&r->mesh, read, corners);
      bool has_points = !seen.joins_points && !seen.parts_points;
      compared++;
      if (seen.joins_points != said.joins_points || seen.parts_points != said.parts_points)
        fail_msg("round %u: points", round);
      if (has_points && (seen.joins_values != said.joins_values || seen.parts_values != said.parts_values))
        fail_msg("round %u: values", round);
      same += has_points && !seen.joins_values && !seen.parts_values;
      told[0] += has_points && said.joins_values;
      told[1] += has_points && said.parts_values;
      told[2] += said.joins_points;
      told[3] += said.parts_points;
    }
    round_trip_deinit(&trip);
  }
  assert_true(compared > rounds / 2 && same > rounds / 100);
  for (uint32_t i = 0; i < 4; i++) assert_true(told[i] > rounds / 100);
  free(r);
}

TEST(a_file_with_tags_keeps_a_cage) {
  const uint32_t rounds = 2000 / test_stride();
  rough *r = malloc(sizeof *r);
  uint32_t told = 0;
  assert_non_null(r);
  for (uint32_t round = 0; round < rounds; round++) {
    uint32_t corners[CORNERS_MAX];
    make_rough(r);
    round_trip trip = write_and_read(&r->mesh, TW_POLYGONS_NGON, true);
    const tw_mesh *read = trip.read->meshes;
    assert_int_equal(read->corner_count, r->corner_count);
    for (uint32_t c = 0; c < r->corner_count; c++) corners[c] = c;
    tw_cage_changes seen = look(&r->mesh, read, corners);
    if (seen.joins_points || seen.parts_points) fail_msg("round %u: points", round);
    if (seen.joins_values || seen.parts_values) fail_msg("round %u: values", round);
    told += trip.tells_values;
    round_trip_deinit(&trip);
  }
  assert_true(told > rounds / 100 && told < rounds);
  free(r);
}
