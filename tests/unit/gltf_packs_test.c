/* Quantized and compressed answers: what they hold is what float answers hold, in fewer bits. */
#include <math.h>
#include <meshoptimizer.h>
#include <stdio.h>

#include "host.h"
#include "test.h"
#include "wrapped_memory.h"
#include "written_glb.h"

enum { SIDE = 180 }; /* quads; one level makes some 130,000 vertices of them */

static const uint8_t *bytes_of(const glb *file, const cJSON *accessor, uint64_t index, uint64_t size) {
  const cJSON *view = at(file, "bufferViews", (int)number(accessor, "bufferView", UINT32_MAX));
  uint64_t within = number(accessor, "byteOffset", 0) + index * number(view, "byteStride", size);
  assert_true(within + size <= number(view, "byteLength", 0));
  return file->data + number(view, "byteOffset", 0) + within;
}

/* A number of an accessor as glTF defines it. */
static double value_at(const glb *file, int accessor, uint64_t index, int component) {
  const cJSON *a = at(file, "accessors", accessor);
  bool normalized = cJSON_IsTrue(cJSON_GetObjectItem(a, "normalized"));
  int i = component;
  switch (number(a, "componentType", 0)) {
  case 5120: return fmax((double)(int8_t)bytes_of(file, a, index, 4)[i] / (normalized ? 127 : 1), -1);
  case 5121: return (double)bytes_of(file, a, index, 4)[i] / (normalized ? 255 : 1);
  case 5122: {
    int16_t v[4] = {0};
    memcpy(v, bytes_of(file, a, index, 8), 6);
    return fmax((double)v[i] / (normalized ? 32767 : 1), -1);
  }
  case 5123: {
    uint16_t v;
    memcpy(&v, bytes_of(file, a, index, 4) + 2 * i, 2);
    return (double)v / (normalized ? 65535 : 1);
  }
  default: {
    float v;
    memcpy(&v, bytes_of(file, a, index, 4) + 4 * i, 4);
    return (double)v;
  }
  }
}

/* ---- scenes ---------------------------------------------------------------------------------- */

/* Packs of all meshes of a scene. */
typedef struct packed {
  tw_packs *list[4];
  uint32_t count;
} packed;

static void choose_grids(const fixture *f, tw_grid *grids) {
  assert_int_equal(tw_grids_choose(f->model, f->scene.surfaces, NULL, grids), TW_OK);
}

static packed pack(fixture *f, tw_encoding encoding, tw_polygons polygons, bool is_measured) {
  packed out = {.count = f->model->mesh_count};
  tw_grid grids[4];
  tw_error error;
  assert_true(out.count <= 4);
  choose_grids(f, grids);
  for (uint32_t i = 0; i < out.count; i++) {
    const tw_pack_options options = {encoding, polygons, grids[i], is_measured};
    assert_int_equal(
        tw_packs_create(&f->model->meshes[i], f->surfaces[i], &options, NULL, &out.list[i], &error), TW_OK);
  }
  f->scene.polygons = polygons;
  return out;
}

static void show(fixture *f, const packed *packs) {
  f->scene.packs = (const tw_packs *const *)packs->list;
}

static void destroy_packs(packed *packs) {
  for (uint32_t i = 0; i < packs->count; i++) tw_packs_destroy(packs->list[i]);
}

static glb write_packed(fixture *f, tw_encoding encoding, tw_polygons polygons) {
  packed packs = pack(f, encoding, polygons, true);
  show(f, &packs);
  glb file = write_glb(&f->scene);
  f->scene.packs = NULL;
  destroy_packs(&packs);
  return file;
}

/* A wavy sheet of two materials. */
static void sheet(fixture *f) {
  size_t capacity = (size_t)48 * (SIDE + 1) * (SIDE + 1) + (size_t)64 * SIDE * SIDE, size = 0;
  char *text = malloc(capacity);
  assert_non_null(text);
  for (int y = 0; y <= SIDE; y++)
    for (int x = 0; x <= SIDE; x++)
      size +=
          (size_t)snprintf(text + size, capacity - size, "v %d %d %.2f\n", x, y, 5 * sin(x * 0.1 + y * 0.07));
  for (int y = 0; y < SIDE; y++)
    for (int x = 0; x < SIDE; x++) {
      int a = 1 + x + y * (SIDE + 1), b = a + SIDE + 1;
      if (x == 0 && (y == 0 || y == SIDE / 3))
        size += (size_t)snprintf(text + size, capacity - size, "usemtl m%d\n", y);
      size += (size_t)snprintf(text + size, capacity - size, "f %d %d %d %d\n", a, a + 1, b + 1, b);
    }
  fixture_init(f, text);
  free(text);
  fixture_refine(f, 1, true);
}

/* ---- tests ----------------------------------------------------------------------------------- */

static int primitive_count(const glb *file, int mesh) {
  return cJSON_GetArraySize(cJSON_GetObjectItem(at(file, "meshes", mesh), "primitives"));
}

static uint32_t next_index(const glb *file, int mesh, int *primitive_index, uint64_t *position) {
  const cJSON *p = primitive(file, mesh, *primitive_index);
  int accessor = (int)number(p, "indices", UINT32_MAX);
  if (*position == number(at(file, "accessors", accessor), "count", 0)) {
    *position = 0;
    ++*primitive_index;
    accessor = (int)number(primitive(file, mesh, *primitive_index), "indices", UINT32_MAX);
  }
  return read_index(file, accessor, (*position)++);
}

static int attribute_of(const glb *file, int mesh, int index, const char *semantic) {
  return (int)number(cJSON_GetObjectItem(primitive(file, mesh, index), "attributes"), semantic, UINT32_MAX);
}

/* Corner by corner the same vertices. undo: of positions; tolerances of positions and normals. */
static void assert_same_corners(const glb *exact, const glb *coded, int mesh, const tw_grid *undo) {
  int p = 0, q = 0;
  uint64_t i = 0, j = 0, corners = 0;
  for (int k = 0; k < primitive_count(exact, mesh); k++)
    corners +=
        number(at(exact, "accessors", (int)number(primitive(exact, mesh, k), "indices", 0)), "count", 0);
  double worst = 0, worst_normal = 0;
  for (uint64_t corner = 0; corner < corners; corner++) {
    uint32_t a = next_index(exact, mesh, &p, &i), b = next_index(coded, mesh, &q, &j);
    for (int axis = 0; axis < 3; axis++) {
      double place = value_at(exact, attribute_of(exact, mesh, p, "POSITION"), a, axis),
             found = value_at(coded, attribute_of(coded, mesh, q, "POSITION"), b, axis);
      worst = fmax(worst, fabs(place - (double)undo->origin[axis] - found * (double)undo->scale));
      worst_normal =
          fmax(worst_normal, fabs(value_at(exact, attribute_of(exact, mesh, p, "NORMAL"), a, axis) -
                                  value_at(coded, attribute_of(coded, mesh, q, "NORMAL"), b, axis)));
    }
  }
  assert_true(worst <= 0.501 / 32767 * (double)undo->scale);
  assert_true(worst_normal <= 0.5001 / 127);
}

TEST(packs_hold_all_corners_and_few_vertices) {
  fixture f;
  sheet(&f);
  for (uint32_t polygons = 0; polygons < 2; polygons += test_stride()) {
    f.scene.polygons = (tw_polygons)polygons;
    glb exact = write_glb(&f.scene), coded = write_packed(&f, TW_ENCODING_QUANTIZED, (tw_polygons)polygons);
    assert_int_equal(primitive_count(&exact, 0), 2);
    assert_true(primitive_count(&coded, 0) >= 3);
    for (int i = 0; i < primitive_count(&coded, 0); i++) {
      assert_true(number(at(&coded, "accessors", attribute_of(&coded, 0, i, "POSITION")), "count", 0) <=
                  65534);
      const cJSON *indices = at(&coded, "accessors", (int)number(primitive(&coded, 0, i), "indices", 0));
      assert_int_equal(number(indices, "componentType", 0), 5123);
    }
    tw_grid grid;
    choose_grids(&f, &grid);
    assert_same_corners(&exact, &coded, 0, &grid);
    assert_true(coded.size < exact.size * 7 / 10);
    free_glb(&exact);
    free_glb(&coded);
  }
  fixture_deinit(&f);
}

/* tweend's own reader joins the fans: a polygon that was cut would come back as triangles. */
TEST(polygons_stay_whole) {
  fixture f;
  sheet(&f);
  for (tw_encoding encoding = TW_ENCODING_QUANTIZED; encoding <= TW_ENCODING_MESHOPT; encoding++) {
    glb coded = write_packed(&f, encoding, TW_POLYGONS_NGON);
    tw_model *model = NULL;
    tw_error error;
    assert_int_equal(tw_gltf_read(coded.bytes, coded.size, TW_QUADS_NGON, TW_WELD_AUTO, 0, &model, &error),
                     TW_OK);
    assert_int_equal(model->meshes[0].face_count, 4 * SIDE * SIDE);
    assert_int_equal(model->meshes[0].corner_count, 16 * SIDE * SIDE);
    tw_model_destroy(model);
    free_glb(&coded);
  }
  fixture_deinit(&f);
}

TEST(bounds_are_those_of_what_is_stored) {
  fixture f;
  everything(&f, 2);
  glb coded = write_packed(&f, TW_ENCODING_QUANTIZED, TW_POLYGONS_TRIANGLES);
  int bounded = 0;
  for (int i = 0; i < cJSON_GetArraySize(cJSON_GetObjectItem(coded.json, "accessors")); i++) {
    const cJSON *a = at(&coded, "accessors", i), *min = cJSON_GetObjectItem(a, "min");
    if (number(a, "componentType", 0) != 5122) continue;
    assert_non_null(min);
    bounded++;
    double found[2][3] = {{1e9, 1e9, 1e9}, {-1e9, -1e9, -1e9}};
    for (uint64_t k = 0; k < number(a, "count", 0); k++)
      for (int axis = 0; axis < 3; axis++) {
        int16_t v[3];
        memcpy(v, bytes_of(&coded, a, k, 8), sizeof v);
        found[0][axis] = fmin(found[0][axis], v[axis]);
        found[1][axis] = fmax(found[1][axis], v[axis]);
      }
    for (int axis = 0; axis < 3; axis++) {
      assert_true(cJSON_GetArrayItem(min, axis)->valuedouble == found[0][axis]);
      assert_true(cJSON_GetArrayItem(cJSON_GetObjectItem(a, "max"), axis)->valuedouble == found[1][axis]);
    }
  }
  assert_int_equal(bounded, 3 * (1 + 3)); /* positions and three targets of three materials */
  free_glb(&coded);
  fixture_deinit(&f);
}

/* What a joint's matrix makes of a short is what it made of the point. */
TEST(skins_undo_the_grid) {
  fixture f;
  everything(&f, 0);
  glb exact = write_glb(&f.scene), coded = write_packed(&f, TW_ENCODING_QUANTIZED, TW_POLYGONS_TRIANGLES);
  tw_grid grids[4];
  choose_grids(&f, grids);
  const cJSON *skin[2] = {at(&exact, "skins", 0), at(&coded, "skins", 0)};
  for (uint64_t joint = 0; joint < 2; joint++)
    for (int row = 0; row < 3; row++) {
      const double point[3] = {0.5, -0.25, 2};
      double sum[2];
      for (int i = 0; i < 2; i++) {
        const glb *file = i == 0 ? &exact : &coded;
        float m[16];
        read_floats(file, (int)number(skin[i], "inverseBindMatrices", 0), joint, 16, m);
        sum[i] = (double)m[12 + row];
        for (int axis = 0; axis < 3; axis++) {
          double stored = (point[axis] - (double)grids[0].origin[axis]) / (double)grids[0].scale;
          sum[i] += (double)m[4 * axis + row] * (i == 0 ? point[axis] : stored);
        }
      }
      assert_true(fabs(sum[0] - sum[1]) < 1e-6);
    }
  assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(coded.json, "nodes")),
                   cJSON_GetArraySize(cJSON_GetObjectItem(exact.json, "nodes")));
  free_glb(&exact);
  free_glb(&coded);
  fixture_deinit(&f);
}

TEST(a_child_undoes_the_grid_of_a_mesh_that_no_skin_moves) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_refine(&f, 2, true);
  glb coded = write_packed(&f, TW_ENCODING_QUANTIZED, TW_POLYGONS_TRIANGLES);
  const cJSON *node = at(&coded, "nodes", 0), *child = at(&coded, "nodes", 1);
  assert_null(cJSON_GetObjectItem(node, "mesh"));
  assert_int_equal(cJSON_GetArrayItem(cJSON_GetObjectItem(node, "children"), 0)->valueint, 1);
  assert_int_equal(number(child, "mesh", 9), 0);
  assert_true(cJSON_GetArrayItem(cJSON_GetObjectItem(child, "scale"), 0)->valuedouble == 1);
  free_glb(&coded);
  fixture_deinit(&f);
}

/* Triangles by their sorted places, so that order and rotation play no part. */
typedef struct triangle {
  uint64_t corners[3];
} triangle;

static int compare_u64(const void *a, const void *b) {
  uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
  return x < y ? -1 : x > y;
}

static int compare_triangles(const void *a, const void *b) {
  return memcmp(a, b, sizeof(triangle));
}

static triangle *sorted_triangles(const uint8_t *vertices, size_t stride, const uint16_t *indices,
                                  size_t count) {
  triangle *out = malloc(count / 3 * sizeof *out);
  assert_non_null(out);
  for (size_t i = 0; i < count; i++)
    memcpy(&out[i / 3].corners[i % 3], vertices + indices[i] * stride, sizeof(uint64_t)); /* the position */
  for (size_t i = 0; i < count / 3; i++) qsort(out[i].corners, 3, sizeof(uint64_t), compare_u64);
  qsort(out, count / 3, sizeof *out, compare_triangles);
  return out;
}

static const cJSON *compression(const glb *file, int view) {
  const cJSON *extensions = cJSON_GetObjectItem(at(file, "bufferViews", view), "extensions");
  return cJSON_GetObjectItem(extensions, "EXT_meshopt_compression");
}

/* meshoptimizer's decoder finds the bytes of the quantized answer, in another order of triangles. */
TEST(compressed_packs_decode_to_the_quantized_ones) {
  fixture f;
  sheet(&f);
  glb coded = write_packed(&f, TW_ENCODING_QUANTIZED, TW_POLYGONS_TRIANGLES),
      pressed = write_packed(&f, TW_ENCODING_MESHOPT, TW_POLYGONS_TRIANGLES);
  assert_true(pressed.size < coded.size / 2);
  assert_int_equal(primitive_count(&coded, 0), primitive_count(&pressed, 0));
  for (int i = 0; i < primitive_count(&coded, 0); i++) {
    const cJSON *position = at(&coded, "accessors", attribute_of(&coded, 0, i, "POSITION")),
                *indices = at(&coded, "accessors", (int)number(primitive(&coded, 0, i), "indices", 0));
    int views[2] = {(int)number(position, "bufferView", 0), (int)number(indices, "bufferView", 0)};
    size_t count = number(position, "count", 0), index_count = number(indices, "count", 0);
    const cJSON *attributes = compression(&pressed, views[0]), *triangles = compression(&pressed, views[1]);
    size_t stride = number(attributes, "byteStride", 0);
    assert_int_equal(stride, number(at(&coded, "bufferViews", views[0]), "byteStride", 0));
    assert_string_equal(cJSON_GetObjectItem(triangles, "mode")->valuestring, "TRIANGLES");
    uint8_t *vertices = malloc(count * stride);
    uint16_t *decoded = malloc(index_count * sizeof *decoded);
    assert_true(vertices && decoded);
    assert_int_equal(meshopt_decodeVertexBuffer(vertices, count, stride,
                                                pressed.data + number(attributes, "byteOffset", 0),
                                                number(attributes, "byteLength", 0)),
                     0);
    assert_int_equal(meshopt_decodeIndexBuffer(decoded, index_count, 2,
                                               pressed.data + number(triangles, "byteOffset", 0),
                                               number(triangles, "byteLength", 0)),
                     0);
    triangle *found = sorted_triangles(vertices, stride, decoded, index_count);
    triangle *wanted =
        sorted_triangles(bytes_of(&coded, position, 0, 8), stride,
                         (const uint16_t *)(const void *)bytes_of(&coded, indices, 0, 2), index_count);
    assert_memory_equal(found, wanted, index_count / 3 * sizeof *found);
    free(found);
    free(wanted);
    free(vertices);
    free(decoded);
  }
  free_glb(&coded);
  free_glb(&pressed);
  fixture_deinit(&f);
}

TEST(packed_streams_give_the_same_bytes_in_any_blocks_and_tell_their_size) {
  static const size_t blocks[] = {1, 7, 4096, 5000, 100001};
  fixture f;
  everything(&f, 2);
  for (tw_encoding encoding = TW_ENCODING_QUANTIZED; encoding <= TW_ENCODING_MESHOPT; encoding++)
    for (int container = TW_FORMAT_GLTF; container <= TW_FORMAT_GLB; container++) {
      packed measured = pack(&f, encoding, TW_POLYGONS_TRIANGLES, true);
      show(&f, &measured);
      tw_gltf_stream *stream = open_stream(&f.scene, (tw_format)container);
      uint64_t size = tw_gltf_stream_size(stream), predicted = 0;
      uint8_t *whole = fixture_read(stream, SIZE_MAX), part[700];
      for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) {
        tw_gltf_stream_seek(stream, 0);
        uint8_t *parts = fixture_read(stream, blocks[i]);
        assert_memory_equal(parts, whole, (size_t)size);
        free(parts);
      }
      for (uint64_t step = 0; step < 300; step++) {
        uint64_t offset = step * 7919 % size;
        tw_gltf_stream_seek(stream, offset);
        size_t got = tw_gltf_stream_read(stream, part, sizeof part);
        assert_memory_equal(part, whole + offset, got);
      }
      packed cut = pack(&f, encoding, TW_POLYGONS_TRIANGLES, false);
      if (encoding == TW_ENCODING_QUANTIZED) show(&f, &cut);
      assert_int_equal(tw_gltf_stream_predict(&f.scene, (tw_format)container, &predicted, NULL), TW_OK);
      assert_int_equal(predicted, size);
      f.scene.packs = NULL;
      free(whole);
      tw_gltf_stream_destroy(stream);
      destroy_packs(&cut);
      destroy_packs(&measured);
    }
  fixture_deinit(&f);
}

TEST(weights_that_a_pointer_moves_keep_the_mesh_on_its_node) {
  fixture f;
  tw_grid grids[4];
  tw_clip_keys clip = {.loose =
                           "[{\"pointer\":\"/nodes/1/translation\"},{\"pointer\":\"/nodes/99/weights\"}]"};
  fixture_init(&f, cube_text);
  fixture_node(&f, "other", TW_NO_INDEX, TW_NO_INDEX);
  f.model->clips = &clip;
  f.model->clip_count = 1;
  fixture_refine(&f, 1, false);
  choose_grids(&f, grids);
  assert_false(grids[0].is_float);
  static const char *const channels[] = {
      "[{\"pointer\":\"/nodes/1/weights\"},{\"pointer\":\"/nodes/0/weights\"}]",
      "[{\"pointer\":\"/nodes/0/weights/2\"}]", "[{\"pointer\":\"\\/nodes\\u002f0\\/weights\"}]"};
  for (size_t i = 0; i < sizeof channels / sizeof *channels; i++) {
    clip.loose = channels[i];
    choose_grids(&f, grids);
    assert_true(grids[0].is_float);
  }
  fixture_deinit(&f);
}

TEST(what_shows_a_mesh_decides_its_grid) {
  fixture f;
  tw_grid grids[4];
  fixture_init(&f, cube_text);
  fixture_node(&f, "crowd", TW_NO_INDEX, 0);
  fixture_refine(&f, 1, false);
  choose_grids(&f, grids);
  assert_false(grids[0].is_float);
  assert_true(grids[0].scale == 1 && grids[0].origin[0] == 0);
  f.model->nodes[1].preserved = "{\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{}}}}";
  choose_grids(&f, grids);
  assert_true(grids[0].is_float);
  fixture_deinit(&f);
}

TEST(meshes_of_one_skin_share_a_grid) {
  fixture f;
  tw_grid grids[4];
  char two[sizeof cube_text + 200];
  snprintf(two, sizeof two, "%so far\nv 8 0 0\nv 9 0 0\nv 9 1 0\nf 9 10 11\n", cube_text);
  fixture_init(&f, two);
  fixture_add_skin(&f);
  fixture_refine(&f, 1, false);
  choose_grids(&f, grids);
  assert_true(grids[0].scale == 1 && grids[1].scale == 0.5f);
  f.model->meshes[1].skin = f.model->meshes[0].skin;
  f.model->nodes[1].skin = 0;
  choose_grids(&f, grids);
  for (int i = 0; i < 2; i++) {
    assert_true(grids[i].scale == 5 && grids[i].origin[0] == 4);
    assert_false(grids[i].is_float);
  }
  f.model->nodes[1].preserved = "{\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{}}}}";
  choose_grids(&f, grids);
  assert_true(grids[0].is_float && grids[1].is_float);
  fixture_deinit(&f);
}

/* Quantized answers of a cube of levels 0 to 3 hold the corners of the float answers. edited: its details and
 * creases. */
static void assert_grids_cover(const tw_mesh *edited, tw_creasing creasing) {
  for (uint32_t level = 0; level < 4; level++) {
    fixture f;
    fixture_init(&f, cube_text);
    tw_mesh *mesh = &f.model->meshes[0];
    mesh->detail_count = edited->detail_count;
    mesh->details = edited->details;
    mesh->crease_count = edited->crease_count;
    mesh->crease_edges = edited->crease_edges;
    mesh->crease_sharpness = edited->crease_sharpness;
    tw_surface *surface = NULL;
    const tw_surface_options options = {.level = level, .normals = true, .creasing = creasing};
    assert_int_equal(tw_surface_create(mesh, &options, &surface, NULL), TW_OK);
    f.surfaces = &surface;
    f.scene = (tw_scene){.model = f.model, .surfaces = (const tw_surface *const *)f.surfaces};
    glb exact = write_glb(&f.scene), coded = write_packed(&f, TW_ENCODING_QUANTIZED, TW_POLYGONS_TRIANGLES);
    tw_grid grid;
    choose_grids(&f, &grid);
    assert_same_corners(&exact, &coded, 0, &grid);
    free_glb(&exact);
    free_glb(&coded);
    tw_surface_destroy(surface);
    f.surfaces = NULL;
    fixture_deinit(&f);
  }
}

TEST(grids_cover_details_that_leave_the_hull_of_the_cage) {
  float offsets[26][3] = {{0}}, deeper[98][3] = {{0}};
  for (int i = 0; i < 26; i++) offsets[i][2] = i == 3 ? 5 : 1;
  for (int i = 0; i < 98; i++) deeper[i][0] = i == 60 ? -7 : 0;
  const tw_detail details[2] = {{1, 26, offsets[0]}, {2, 98, deeper[0]}};
  const tw_mesh edited = {.detail_count = 2, .details = details};
  assert_grids_cover(&edited, TW_CREASE_UNIFORM);
}

/* The midpoint of an edge of sharpness 1.3 between smoother ones takes 1.3 of the crease, and -0.3 of what
 * lies inside. */
TEST(grids_cover_what_the_rule_of_chaikin_puts_outside_of_the_hull) {
  static const uint32_t edges[5][2] = {{0, 1}, {0, 3}, {1, 2}, {0, 4}, {1, 5}};
  static const float sharpness[5] = {1.3f, 0.1f, 0.1f, 0.1f, 0.1f};
  const tw_mesh edited = {.crease_count = 5, .crease_edges = edges[0], .crease_sharpness = sharpness};
  assert_grids_cover(&edited, TW_CREASE_CHAIKIN);
}

/* Each allocation of cutting, measuring and opening a stream fails once. */
TEST(packs_survive_every_failure) {
  fixture f;
  everything(&f, 1);
  tw_grid grids[4];
  choose_grids(&f, grids);
  size_t failures = 0;
  for (size_t n = 0;; n++) {
    const tw_pack_options options = {TW_ENCODING_MESHOPT, TW_POLYGONS_TRIANGLES, grids[0], true};
    tw_packs *packs = NULL;
    tw_gltf_stream *stream = NULL;
    test_memory.left = n;
    tw_status status = tw_packs_create(&f.model->meshes[0], f.surfaces[0], &options, NULL, &packs, NULL);
    f.scene.packs = (const tw_packs *const *)&packs;
    if (status == TW_OK) status = tw_gltf_stream_create(&f.scene, TW_FORMAT_GLB, &stream, NULL);
    bool failed = test_memory.left == SIZE_MAX;
    test_memory.left = SIZE_MAX;
    tw_gltf_stream_destroy(stream);
    tw_packs_destroy(packs);
    if (status == TW_OK && !failed) break;
    assert_int_equal(status, TW_NO_MEMORY);
    failures++;
  }
  f.scene.packs = NULL;
  assert_true(failures > 20);
  fixture_deinit(&f);
}

/* How often somebody asks is counted down. */
static bool is_unwanted(void *owner) {
  uint32_t *left = owner;
  return *left == 0 || --*left == 0;
}

/* Somebody asks before each of the 3 packs is cut, and before they are measured. */
TEST(packs_that_nobody_wants_any_more_are_given_up) {
  enum { ASKED = 4 };
  fixture f;
  everything(&f, 3);
  tw_grid grids[4];
  choose_grids(&f, grids);
  for (uint32_t wanted = 0; wanted <= ASKED; wanted++) {
    const tw_pack_options options = {TW_ENCODING_MESHOPT, TW_POLYGONS_TRIANGLES, grids[0], true};
    uint32_t left = 1 + wanted;
    const tw_parallel_for parallel = {&left, run_in_order, is_unwanted};
    tw_packs *packs = NULL;
    tw_error error = {0};
    size_t held = test_memory.held;
    tw_status status =
        tw_packs_create(&f.model->meshes[0], f.surfaces[0], &options, &parallel, &packs, &error);
    assert_int_equal(status, wanted == ASKED ? TW_OK : TW_CANCELLED);
    assert_int_equal(error.status, status);
    tw_packs_destroy(packs);
    assert_int_equal(test_memory.held, held);
  }
  fixture_deinit(&f);
}
