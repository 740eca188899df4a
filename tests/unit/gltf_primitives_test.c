/* GLB answers: vertices, joints, bounds and indices say what the surfaces hold. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"
#include "written_glb.h"

TEST(vertices_are_the_rows_of_the_surface) {
  fixture f;
  everything(&f, 2);
  glb file = write_glb(&f.scene);
  const tw_surface *surface = f.surfaces[0];
  const tw_surface_layout *layout = tw_surface_get_layout(surface);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
  assert_int_equal(number(at(&file, "accessors", attribute(&file, 0, "POSITION")), "count", 0), rows);
  float row[64] = {0}, found[4];
  assert_true(layout->stride <= 64);
  const struct {
    const char *semantic;
    uint32_t column, width;
  } attributes[] = {{"POSITION", layout->position, 3},
                    {"NORMAL", layout->normal, 3},
                    {"TEXCOORD_0", layout->uvs[0], 2},
                    {"COLOR_0", layout->attributes[0].column, 4}};
  for (uint64_t i = 0; i < rows; i++) {
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
    for (size_t a = 0; a < sizeof attributes / sizeof *attributes; a++) {
      read_floats(&file, attribute(&file, 0, attributes[a].semantic), i, attributes[a].width, found);
      assert_memory_equal(found, row + attributes[a].column, 4 * attributes[a].width);
    }
    for (uint32_t t = 0; t < 3; t++) {
      const cJSON *targets = cJSON_GetObjectItem(primitive(&file, 0, 0), "targets");
      const cJSON *target = cJSON_GetArrayItem(targets, (int)t);
      read_floats(&file, (int)number(target, "POSITION", UINT32_MAX), i, 3, found);
      assert_memory_equal(found, row + layout->morphs + 3 * t, 12);
    }
  }
  tw_surface_reader_destroy(reader);
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(attributes_keep_their_names_and_widths) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_add_colors(&f);
  tw_mesh *mesh = &f.model->meshes[0];
  static const char *const types[] = {"VEC4", "SCALAR", "VEC3"};
  tw_attribute three[3] = {mesh->attributes[0],
                           {.name = "_B \"\xC3\xA4\"", .width = 1, .values = mesh->positions},
                           {.name = "_A", .width = 3, .values = mesh->positions}};
  mesh->attributes = three;
  mesh->attribute_count = 3;
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  const tw_surface_layout *layout = tw_surface_get_layout(f.surfaces[0]);
  tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
  const cJSON *written = cJSON_GetObjectItem(primitive(&file, 0, 0), "attributes");
  assert_string_equal(cJSON_GetArrayItem(written, 3)->string, "COLOR_0");
  assert_string_equal(cJSON_GetArrayItem(written, 4)->string, three[1].name);
  assert_string_equal(cJSON_GetArrayItem(written, 5)->string, "_A");
  for (uint32_t a = 0; a < 3; a++) {
    int accessor = attribute(&file, 0, three[a].name);
    assert_string_equal(cJSON_GetObjectItem(at(&file, "accessors", accessor), "type")->valuestring, types[a]);
    for (uint64_t i = 0; i < tw_surface_row_count(f.surfaces[0], TW_DOMAIN_VERTICES); i++) {
      float row[64], found[4];
      tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
      read_floats(&file, accessor, i, three[a].width, found);
      assert_memory_equal(found, row + layout->attributes[a].column, three[a].width * sizeof *found);
    }
  }
  tw_surface_reader_destroy(reader);
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(joints_travel_as_unsigned_shorts) {
  fixture f;
  everything(&f, 2);
  glb file = write_glb(&f.scene);
  const tw_surface_layout *layout = tw_surface_get_layout(f.surfaces[0]);
  tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
  assert_true(layout->joints != UINT32_MAX && layout->stride <= 64);
  uint64_t rows = tw_surface_row_count(f.surfaces[0], TW_DOMAIN_VERTICES);
  for (uint64_t i = 0; i < rows; i++) {
    float row[64] = {0}, found[4] = {0};
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
    read_floats(&file, attribute(&file, 0, "WEIGHTS_0"), i, 4, found);
    assert_memory_equal(found, row + layout->weights, sizeof found);
    const uint8_t *joints = element(&file, attribute(&file, 0, "JOINTS_0"), i, 8);
    for (uint32_t j = 0; j < 4; j++) { /* 0 where the weight is 0 */
      uint32_t joint = found[j] > 0 ? (uint32_t)row[layout->joints + j] : 0;
      assert_int_equal((uint32_t)joints[2 * j] | (uint32_t)joints[2 * j + 1] << 8, joint);
    }
  }
  tw_surface_reader_destroy(reader);
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(meshes_of_a_scene_do_not_mix) {
  char text[sizeof cube_text + sizeof patchwork_text + 64];
  snprintf(text, sizeof text, "%so small\nv 0 0 0\nv 1 0 5\nv 0 1 0\nf -3 -2 -1\n", cube_text);
  fixture f;
  fixture_init(&f, text);
  assert_int_equal(f.model->mesh_count, 2);
  fixture_refine(&f, 5, true);
  glb file = write_glb(&f.scene);
  tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
  for (uint32_t step = 0; step < 500; step++) { /* from one mesh to the other and back */
    uint8_t part[5000];
    uint32_t offset = (uint32_t)((uint64_t)step * 27644437 % file.size);
    tw_gltf_stream_seek(stream, offset);
    size_t got = tw_gltf_stream_read(stream, part, sizeof part);
    assert_memory_equal(part, file.bytes + offset, got);
  }
  tw_gltf_stream_destroy(stream);
  for (int mesh = 0; mesh < 2; mesh++) {
    tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[mesh]);
    uint64_t rows = tw_surface_row_count(f.surfaces[mesh], TW_DOMAIN_VERTICES);
    for (uint64_t i = 0; i < rows; i++) {
      float row[6] = {0}, found[3] = {0};
      tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
      read_floats(&file, attribute(&file, mesh, "POSITION"), i, 3, found);
      assert_memory_equal(found, row, sizeof found);
    }
    tw_surface_reader_destroy(reader);
  }
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(bounds_are_exact) {
  fixture f;
  everything(&f, 3);
  glb file = write_glb(&f.scene);
  const cJSON *accessor;
  int index = 0, seen = 0;
  cJSON_ArrayForEach(accessor, cJSON_GetObjectItem(file.json, "accessors")) {
    const cJSON *min = cJSON_GetObjectItem(accessor, "min"), *max = cJSON_GetObjectItem(accessor, "max");
    int width = cJSON_GetArraySize(min);
    assert_int_equal(width, cJSON_GetArraySize(max));
    for (int axis = 0; axis < width; axis++) {
      double low = INFINITY, high = -INFINITY;
      for (uint64_t i = 0; i < number(accessor, "count", 0); i++) {
        float value[3] = {0};
        read_floats(&file, index, i, (uint32_t)width, value);
        low = fmin(low, (double)value[axis]);
        high = fmax(high, (double)value[axis]);
      }
      assert_true(cJSON_GetArrayItem(min, axis)->valuedouble == low);
      assert_true(cJSON_GetArrayItem(max, axis)->valuedouble == high);
      seen++;
    }
    index++;
  }
  assert_true(seen >= 12); /* POSITION and three targets, besides times */
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(too_many_parts_are_over_a_limit) {
  fixture f = {.model = tw_model_create()};
  assert_non_null(f.model);
  fixture_refine(&f, 1, true);
  f.model->node_count = (1 << 18) + 1;
  f.model->nodes = fixture_alloc(&f, f.model->node_count, sizeof *f.model->nodes);
  uint64_t size = 7;
  tw_error error;
  assert_int_equal(tw_gltf_stream_predict(&f.scene, TW_FORMAT_GLB, &size, &error), TW_LIMIT);
  assert_non_null(strstr(error.detail, "262145 nodes, materials, accessors and buffer views"));
  assert_int_equal(size, 7);
  fixture_deinit(&f);
}

static void check_targets(uint32_t count, bool normals) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_morphs(&f, count);
  if (normals) fixture_add_morph_normals(&f);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  const cJSON *view, *targets = cJSON_GetObjectItem(primitive(&file, 0, 0), "targets");
  cJSON_ArrayForEach(view, cJSON_GetObjectItem(file.json, "bufferViews"))
      assert_true(number(view, "byteStride", 4) <= 252);
  assert_int_equal(cJSON_GetArraySize(targets), count);
  const tw_surface_layout *layout = tw_surface_get_layout(f.surfaces[0]);
  tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
  const uint32_t width = normals ? 6 : 3;
  assert_int_equal(layout->morph_width, width);
  float row[TW_MORPH_TARGETS_MAX * 6 + 6], found[3];
  for (uint64_t i = 0; i < 26; i++) {
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, 1, row);
    for (int t = 0; t < (int)count; t++) {
      const cJSON *target = cJSON_GetArrayItem(targets, t);
      read_floats(&file, (int)number(target, "POSITION", UINT32_MAX), i, 3, found);
      assert_memory_equal(found, row + layout->morphs + width * (uint32_t)t, 12);
      assert_true(normals == cJSON_HasObjectItem(target, "NORMAL"));
      if (!normals) continue;
      read_floats(&file, (int)number(target, "NORMAL", UINT32_MAX), i, 3, found);
      assert_memory_equal(found, row + layout->morphs + width * (uint32_t)t + 3, 12);
    }
  }
  assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(at(&file, "meshes", 0), "weights")), count);
  tw_surface_reader_destroy(reader);
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(many_targets_keep_strides_legal) {
  for (int normals = 0; normals < 2; normals++) {
    check_targets(3, normals);
    check_targets(50, normals);
    check_targets(TW_MORPH_TARGETS_MAX, normals);
  }
}

/* The faces of a primitive that its triangles say: fans from the first corner, rotated as they are. */
static void triangles_are_the_faces(const glb *file, fixture *f, bool ngons) {
  const tw_surface *surface = f->surfaces[0];
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  int written = 0;
  for (uint32_t g = 0; g < tw_surface_group_count(surface); g++) {
    const tw_surface_group *group = tw_surface_get_group(surface, g);
    const cJSON *faces = primitive(file, 0, written++);
    int indices = (int)number(faces, "indices", UINT32_MAX);
    assert_int_equal((int32_t)number(faces, "material", UINT32_MAX), group->material);
    uint64_t next = 0;
    uint32_t before = UINT32_MAX;
    for (uint64_t face = group->first_face; face < group->first_face + group->face_count; face++) {
      uint32_t corners[16], size = 0, start = 0;
      tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, face, 1, &size, corners);
      uint32_t apex = read_index(file, indices, next);
      while (start < size && corners[start] != apex) start++;
      assert_true(start < size);
      if (!ngons) assert_int_equal(start, 0);
      if (ngons) assert_int_not_equal(apex, before);
      before = apex;
      for (uint32_t t = 0; t + 2 < size; t++) {
        assert_int_equal(read_index(file, indices, next++), apex);
        assert_int_equal(read_index(file, indices, next++), corners[(start + t + 1) % size]);
        assert_int_equal(read_index(file, indices, next++), corners[(start + t + 2) % size]);
      }
    }
    assert_int_equal(number(at(file, "accessors", indices), "count", 0), next);
  }
  tw_surface_reader_destroy(reader);
}

TEST(faces_become_fans_by_material) {
  for (uint32_t level = 0; level < 4; level++)
    for (int ngons = 0; ngons < 2; ngons++) {
      fixture f;
      fixture_init(&f, patchwork_text);
      fixture_refine(&f, level, true);
      f.scene.polygons = ngons ? TW_POLYGONS_NGON : TW_POLYGONS_TRIANGLES;
      glb file = write_glb(&f.scene);
      assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(at(&file, "meshes", 0), "primitives")), 3);
      triangles_are_the_faces(&file, &f, ngons);
      const cJSON *used = cJSON_GetObjectItem(file.json, "extensionsUsed");
      const cJSON *declared = cJSON_GetObjectItem(primitive(&file, 0, 2), "extensions");
      assert_int_equal(cJSON_GetArraySize(used), ngons);
      assert_int_equal(cJSON_HasObjectItem(declared, "FB_ngon_encoding"), ngons);
      assert_string_equal(cJSON_GetObjectItem(at(&file, "materials", 1), "name")->valuestring, "green");
      const cJSON *look = cJSON_GetObjectItem(at(&file, "materials", 1), "pbrMetallicRoughness");
      assert_int_equal(cJSON_GetObjectItem(look, "metallicFactor")->valueint,
                       0); /* 1 is black without surroundings */
      free_glb(&file);
      fixture_deinit(&f);
    }
}

TEST(bent_quads_have_the_same_diagonal_as_ngons) {
  /* As triangles, both quads begin at the same vertex. FB_ngon_encoding does not allow that of neighbours. */
  fixture f;
  fixture_init(&f, "v 0 0 0\nv 1 0 0\nv 1 1 .5\nv 0 1 0\nv -1 1 .7\nv -1 0 0\nf 1 2 3 4\nf 1 4 5 6\n");
  fixture_refine(&f, 0, false);
  for (int ngons = 0; ngons < 2; ngons++) {
    f.scene.polygons = ngons ? TW_POLYGONS_NGON : TW_POLYGONS_TRIANGLES;
    glb file = write_glb(&f.scene);
    int indices = (int)number(primitive(&file, 0, 0), "indices", UINT32_MAX);
    const uint32_t triangles[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5}, fans[] = {4, 5, 0, 4, 0, 3};
    for (uint32_t i = 0; i < 12; i++)
      assert_int_equal(read_index(&file, indices, i), ngons && i >= 6 ? fans[i - 6] : triangles[i]);
    free_glb(&file);
  }
  fixture_deinit(&f);
}

static bool same_point(const float a[3], const float b[3]) {
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Whether two faces have the same corners in the same order, from wherever they begin. */
static bool same_face(const float (*a)[3], const float (*b)[3], uint32_t size) {
  for (uint32_t start = 0; start < size; start++) {
    uint32_t i = 0;
    while (i < size && same_point(a[i], b[(start + i) % size])) i++;
    if (i == size) return true;
  }
  return false;
}

TEST(polygons_read_back_as_they_were) {
  for (uint32_t level = 0; level < 3; level++) {
    fixture f;
    fixture_init(&f, patchwork_text);
    fixture_refine(&f, level, true);
    f.scene.polygons = TW_POLYGONS_NGON;
    glb file = write_glb(&f.scene);
    tw_model *model = NULL;
    tw_error error;
    if (tw_gltf_read(file.bytes, file.size, TW_QUADS_NGON, TW_WELD_AUTO, 0, &model, &error) != TW_OK)
      fail_msg("%s %s", error.pointer, error.detail);
    const tw_mesh *mesh = &model->meshes[0];
    assert_int_equal(mesh->face_count, tw_surface_get_counts(f.surfaces[0])->faces);
    tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
    for (uint32_t face = 0; face < mesh->face_count; face++) {
      uint32_t corners[16], size = 0, first = mesh->face_offsets[face];
      float wanted[16][3], found[16][3];
      tw_surface_read_faces(reader, TW_DOMAIN_POINTS, face, 1, &size, corners);
      assert_int_equal(mesh->face_offsets[face + 1] - first, size);
      for (uint32_t i = 0; i < size; i++) {
        tw_surface_read_rows(reader, TW_DOMAIN_POINTS, corners[i], 1, wanted[i]);
        memcpy(found[i], mesh->positions + 3 * (size_t)mesh->corners[first + i], sizeof found[i]);
      }
      assert_true(same_face((const float(*)[3])wanted, (const float(*)[3])found, size));
    }
    tw_surface_reader_destroy(reader);
    tw_model_destroy(model);
    free_glb(&file);
    fixture_deinit(&f);
  }
}

/* `count` polygons of `size` corners each, one over the other. */
static void init_polygons(fixture *f, uint32_t count, uint32_t size) {
  char *text = malloc((size_t)count * size * 64 + 16), *end = text;
  assert_non_null(text);
  for (uint32_t i = 0; i < count * size; i++) {
    double angle = 6.283185307179586 * i / size;
    end += sprintf(end, "v %.9g %.9g %u\n", cos(angle), sin(angle), i / size);
  }
  for (uint32_t i = 0; i < count * size; i++) end += sprintf(end, "%s %u", i % size ? "" : "\nf", i + 1);
  sprintf(end, "\n");
  fixture_init(f, text);
  free(text);
}

TEST(polygon_larger_than_any_block_is_a_fan) {
  fixture f;
  init_polygons(&f, 1, 40000);
  fixture_refine(&f, 0, false);
  tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
  uint8_t *small = fixture_read(stream, 100);
  glb file = write_glb(&f.scene);
  assert_memory_equal(small, file.bytes, file.size);
  for (uint32_t t = 0; t < 39998; t++) {
    assert_int_equal(read_index(&file, 1, 3 * t), 0);
    assert_int_equal(read_index(&file, 1, 3 * t + 1), t + 1);
    assert_int_equal(read_index(&file, 1, 3 * t + 2), t + 2);
  }
  free(small);
  tw_gltf_stream_destroy(stream);
  free_glb(&file);
  fixture_deinit(&f);
}

TEST(polygons_larger_than_any_block_stand_side_by_side) {
  fixture f;
  init_polygons(&f, 4, 3000);
  fixture_refine(&f, 0, false);
  f.scene.polygons = TW_POLYGONS_NGON;
  tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
  uint8_t *small = fixture_read(stream, 5000);
  glb file = write_glb(&f.scene);
  assert_memory_equal(small, file.bytes, file.size);
  for (uint32_t t = 0; t < 4 * 2998; t++) assert_int_equal(read_index(&file, 1, 3 * t), t / 2998 * 3000);
  free(small);
  tw_gltf_stream_destroy(stream);
  free_glb(&file);
  fixture_deinit(&f);
}

/* Faces that begin at the same point in twos (the first alone when `shift` is 1) or all. */
static void init_common_starts(fixture *f, int shift, int together) {
  enum { FACES = 5001 };
  char *text = malloc((size_t)FACES * 200), *end = text;
  assert_non_null(text);
  for (int i = 0; i < 3 * FACES; i++) end += sprintf(end, "v %d %d 0\n", i, i * i % 1009);
  for (int i = 0; i < FACES; i++)
    end += sprintf(end, "f %d %d %d\n", (i + shift) / together + 1, FACES + 2 * i + 1, FACES + 2 * i + 2);
  fixture_init(f, text);
  free(text);
}

TEST(neighbours_never_start_from_one_vertex) {
  static const int kinds[3][2] = {{0, 2}, {1, 2}, {0, 10000}};
  for (int kind = 0; kind < 3; kind++) {
    fixture f;
    init_common_starts(&f, kinds[kind][0], kinds[kind][1]);
    fixture_refine(&f, 0, false);
    f.scene.polygons = TW_POLYGONS_NGON;
    glb file = write_glb(&f.scene);
    triangles_are_the_faces(&file, &f, true);
    tw_gltf_stream *stream = open_stream(&f.scene, TW_FORMAT_GLB);
    for (size_t block = 6; block < 20000; block = block * 3 + 6) {
      tw_gltf_stream_seek(stream, 0);
      uint8_t *parts = fixture_read(stream, block);
      assert_memory_equal(parts, file.bytes, file.size);
      free(parts);
    }
    tw_gltf_stream_destroy(stream);
    free_glb(&file);
    fixture_deinit(&f);
  }
}

TEST(indices_are_short_up_to_65535_vertices) {
  for (uint32_t size = 65534; size < 65538; size++) {
    fixture f;
    init_polygons(&f, 1, size);
    fixture_refine(&f, 0, false);
    glb file = write_glb(&f.scene);
    assert_int_equal(number(at(&file, "accessors", 0), "count", 0), size);
    assert_int_equal(number(at(&file, "accessors", 1), "componentType", 0), size <= 65535 ? 5123 : 5125);
    assert_int_equal(read_index(&file, 1, 3 * (size - 2) - 1), size - 1);
    free_glb(&file);
    fixture_deinit(&f);
  }
}

TEST(mesh_without_faces_keeps_its_number_and_draws_nothing) {
  fixture f;
  fixture_init(&f, cube_text);
  tw_mesh *meshes = fixture_alloc(&f, 2, sizeof *meshes);
  tw_mesh_init(&meshes[0]);
  meshes[0].face_offsets = fixture_alloc(&f, 1, sizeof(uint32_t));
  meshes[1] = f.model->meshes[0];
  f.model->meshes = meshes;
  f.model->mesh_count = 2;
  fixture_node(&f, "full", TW_NO_INDEX, 1);
  fixture_refine(&f, 1, true);
  glb file = write_glb(&f.scene);
  assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(file.json, "meshes")), 2);
  assert_int_equal(number(at(&file, "nodes", 0), "mesh", 9), 0);
  assert_int_equal(number(at(&file, "nodes", 1), "mesh", 9), 1);
  const cJSON *points = at(&file, "accessors", attribute(&file, 0, "POSITION"));
  assert_int_equal(number(points, "count", 0), 3);
  assert_false(cJSON_HasObjectItem(points, "bufferView"));
  assert_false(cJSON_HasObjectItem(primitive(&file, 0, 0), "indices"));
  free_glb(&file);
  fixture_deinit(&f);
}
