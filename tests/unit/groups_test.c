/* Named groups of faces: from OBJ through every scheme into OBJ and glTF. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "obj.h"
#include "test.h"
#include "written_glb.h"

/* Points (x, y, 0) of 5 x 3, numbered row by row. */
#define GRID                                                                                                 \
  "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\n"                                 \
  "v 3 1 0\nv 4 1 0\nv 0 2 0\nv 1 2 0\nv 2 2 0\nv 3 2 0\nv 4 2 0\n"

/* Groups and materials run across each other; a group comes again; two faces are in none. */
static const char quads_text[] = "o plate\n" GRID "f 1 2 7 6\n"
                                 "g arm  left\nusemtl red\nf 2 3 8 7\n"
                                 "usemtl blue\nf 3 4 9 8\n"
                                 "g leg\nf 4 5 10 9\nf 6 7 12 11\n"
                                 "g arm\tleft\nusemtl red\nf 7 8 13 12\n"
                                 "g\nf 8 9 14 13\n"
                                 "g hand\nf 9 10 15 14\n";
static const char triangles_text[] = "o plate\n" GRID "g arm\nf 1 2 7\nf 1 7 6\ng leg\nf 2 3 8\nf 2 8 7\n"
                                     "g\nf 3 4 9\nf 3 9 8\ng arm\nf 4 5 10\nf 4 10 9\n"
                                     "g leg\nf 6 7 12\nf 6 12 11\nf 7 8 13\nf 7 13 12\n"
                                     "g arm\nf 8 9 14\nf 8 14 13\nf 9 10 15\nf 9 15 14\n";

/* ---- reading --------------------------------------------------------------------------------- */

TEST(faces_have_the_set_of_names_before_them) {
  tw_model *model = read_obj(quads_text);
  static const uint32_t expected[] = {UINT32_MAX, 0, 0, 1, 1, 0, UINT32_MAX, 2};
  assert_int_equal(model->group_count, 3);
  assert_string_equal(model->group_names[0], "arm left");
  assert_string_equal(model->group_names[1], "leg");
  assert_string_equal(model->group_names[2], "hand");
  assert_memory_equal(model->meshes[0].face_groups, expected, sizeof expected);
  tw_model_destroy(model);
}

TEST(default_is_the_group_of_faces_in_none) {
  tw_model *model = read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\ng default\nf 1 2 3\ng\nf 3 2 1\n");
  assert_int_equal(model->group_count, 0);
  assert_null(model->meshes[0].face_groups);
  assert_string_equal(model->meshes[0].name, "default");
  tw_model_destroy(model);
}

TEST(names_go_on_behind_a_backslash) {
  tw_model *model = read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\ng a \\\n  b\\\nc\nf 1 2 3\ng a b c\nf 3 2 1\n");
  assert_int_equal(model->group_count, 1);
  assert_string_equal(model->group_names[0], "a b c");
  assert_int_equal(model->meshes[0].face_count, 2);
  tw_model_destroy(model);
}

TEST(latin1_names_become_utf8) {
  tw_model *model = read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\ng T\xFCr\x01 b\nf 1 2 3\n");
  assert_string_equal(model->group_names[0], "T\xC3\xBCr b");
  tw_model_destroy(model);
}

TEST(names_beyond_a_kilobyte_are_left_out_with_a_warning) {
  char text[4096];
  for (int length = 1024; length <= 1025; length++) {
    char name[1026] = "";
    memset(name, 'x', (size_t)length);
    snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 0 1 0\ng a\nf 1 2 3\ng %s\nf 3 2 1\n", name);
    tw_model *model = read_obj(text);
    bool kept = length == 1024;
    assert_int_equal(model->group_count, 1 + kept);
    assert_int_equal(model->meshes[0].face_groups[1], kept ? 1 : UINT32_MAX);
    assert_int_equal(model->warning_count, !kept);
    tw_model_destroy(model);
  }
}

TEST(objects_have_the_groups_of_their_own_faces) {
  tw_model *model = read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\n"
                             "o a\ng one\nf 1 2 3\no b\nf 4 5 6\ng two\nf 6 5 4\n");
  assert_int_equal(model->mesh_count, 2);
  assert_int_equal(model->meshes[0].face_groups[0], 0);
  assert_int_equal(model->meshes[1].face_groups[0], 0); /* an object does not end a group */
  assert_int_equal(model->meshes[1].face_groups[1], 1);
  tw_model_destroy(model);
}

TEST(a_hundred_thousand_groups_keep_their_names) {
  enum { COUNT = 100000 };
  char *text = malloc(COUNT * 24 + 100), name[16];
  assert_non_null(text);
  size_t length = (size_t)sprintf(text, "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  for (int i = 0; i < COUNT; i++) length += (size_t)sprintf(text + length, "g g%d\nf 1 2 3\n", i * 7 % COUNT);
  tw_model *model = read_obj(text);
  assert_int_equal(model->group_count, COUNT);
  for (int i = 0; i < COUNT; i++) {
    sprintf(name, "g%d", i * 7 % COUNT);
    assert_string_equal(model->group_names[model->meshes[0].face_groups[i]], name);
  }
  tw_model_destroy(model);
  free(text);
}

TEST(a_group_that_does_not_exist_is_refused) {
  tw_model *model = read_obj(quads_text);
  uint32_t groups[8] = {0, 1, 2, 3, 0, 0, 0, 0};
  tw_error error;
  model->meshes[0].face_groups = groups;
  assert_int_equal(tw_model_finish(model, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/meshes/0/groups");
  tw_model_destroy(model);
}

/* ---- surfaces -------------------------------------------------------------------------------- */

static bool lies_in(const tw_mesh *mesh, uint32_t face, const float point[2]) {
  uint32_t begin = mesh->face_offsets[face], size = mesh->face_offsets[face + 1] - begin;
  for (uint32_t i = 0; i < size; i++) {
    const float *a = mesh->positions + 3 * (size_t)mesh->corners[begin + i],
                *b = mesh->positions + 3 * (size_t)mesh->corners[begin + (i + 1) % size];
    if ((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) < 0) return false;
  }
  return true;
}

static uint32_t cage_face_at(const tw_mesh *mesh, const float point[2]) {
  uint32_t face = 0;
  while (face < mesh->face_count && !lies_in(mesh, face, point)) face++;
  assert_true(face < mesh->face_count);
  return face;
}

/* Every face of a flat grid's surface lies in the cage face that it comes from. */
static void faces_are_in_the_groups_of_their_cage_face(const tw_mesh *mesh, tw_surface_options options) {
  tw_surface *surface = NULL;
  tw_error error;
  if (tw_surface_create(mesh, &options, &surface, &error) != TW_OK) fail_msg("%s", error.detail);
  size_t rows = (size_t)tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  float *points = malloc(rows * 3 * sizeof *points);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  assert_true(points && reader);
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, rows, points);
  uint64_t face = 0, corners_before = 0;
  for (uint32_t g = 0; g < tw_surface_group_count(surface); g++) {
    const tw_surface_group *group = tw_surface_get_group(surface, g);
    if (g > 0) {
      const tw_surface_group *before = group - 1;
      assert_true(before->material < group->material ||
                  (before->material == group->material && before->names < group->names));
    }
    assert_int_equal(group->first_face, face);
    assert_int_equal(group->first_corner, corners_before);
    assert_true(group->face_count > 0);
    for (; face < group->first_face + group->face_count; face++) {
      uint32_t corners[4], size;
      float centre[2] = {0, 0};
      corners_before += tw_surface_read_faces(reader, TW_DOMAIN_POINTS, face, 1, &size, corners);
      for (uint32_t i = 0; i < size; i++)
        for (uint32_t c = 0; c < 2; c++) centre[c] += points[3 * corners[i] + c] / (float)size;
      uint32_t source = cage_face_at(mesh, centre);
      assert_int_equal(group->names, mesh->face_groups[source]);
      assert_int_equal(group->material, mesh->face_materials ? mesh->face_materials[source] : -1);
    }
    assert_int_equal(corners_before - group->first_corner, group->corner_count);
  }
  assert_int_equal(face, tw_surface_get_counts(surface)->faces);
  tw_surface_reader_destroy(reader);
  free(points);
  tw_surface_destroy(surface);
}

TEST(children_are_in_the_groups_of_their_parents) {
  static const uint32_t holes[] = {1, 4};
  static const uint32_t in_order[] = {0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, UINT32_MAX, UINT32_MAX};
  tw_model *quads = read_obj(quads_text), *triangles = read_obj(triangles_text);
  for (int i = 0; i < 2; i++) {
    tw_mesh mesh = quads->meshes[0], parted = triangles->meshes[0];
    if (i == 1) { /* as many files have them */
      mesh.face_materials = NULL;
      mesh.face_groups = parted.face_groups = in_order;
    }
    for (uint32_t level = 0; level <= 4; level++)
      for (int cut = 0; cut < 2; cut++) {
        mesh.holes = holes;
        mesh.hole_count = cut ? 2 : 0;
        faces_are_in_the_groups_of_their_cage_face(&mesh, (tw_surface_options){.level = level});
        faces_are_in_the_groups_of_their_cage_face(
            &mesh, (tw_surface_options){.level = level, .scheme = TW_BILINEAR, .normals = true});
        faces_are_in_the_groups_of_their_cage_face(&parted,
                                                   (tw_surface_options){.level = level, .scheme = TW_LOOP});
        faces_are_in_the_groups_of_their_cage_face(
            &parted, (tw_surface_options){.level = level, .scheme = TW_BILINEAR});
      }
    mesh.hole_count = 0;
    faces_are_in_the_groups_of_their_cage_face(
        &mesh, (tw_surface_options){.level = 2, .boundary = TW_BOUNDARY_OPEN});
  }
  tw_model_destroy(quads);
  tw_model_destroy(triangles);
}

/* ---- OBJ ------------------------------------------------------------------------------------- */

static char *write_obj(const tw_scene *scene) {
  tw_obj_stream *stream = NULL;
  tw_error error;
  if (tw_obj_stream_create(scene, &stream, &error) != TW_OK) fail_msg("%s", error.detail);
  enum { CAPACITY = 1 << 20 };
  char *text = malloc(CAPACITY);
  assert_non_null(text);
  size_t size = tw_obj_stream_read(stream, (uint8_t *)text, CAPACITY);
  assert_true(size < CAPACITY);
  text[size] = '\0';
  tw_obj_stream_destroy(stream);
  return text;
}

TEST(obj_answers_name_groups_within_materials) {
  fixture f;
  fixture_init(&f, quads_text);
  fixture_refine(&f, 0, false);
  char *text = write_obj(&f.scene);
  assert_non_null(strstr(text, "v 4 2 0\nf 1 2 7 6\n" /* no material and no group: as before the first */
                               "usemtl red\ng arm left\nf 2 3 8 7\nf 7 8 13 12\n"
                               "g hand\nf 9 10 15 14\ng default\nf 8 9 14 13\n"
                               "usemtl blue\ng arm left\nf 3 4 9 8\ng leg\nf 4 5 10 9\nf 6 7 12 11\n"));
  free(text);
  fixture_deinit(&f);
}

TEST(groups_come_back_from_an_obj_answer) {
  for (uint32_t level = 0; level < 3; level++) {
    fixture f;
    fixture_init(&f, quads_text);
    fixture_refine(&f, level, true);
    char *text = write_obj(&f.scene);
    tw_model *model = read_obj(text);
    const tw_mesh *mesh = &model->meshes[0];
    for (uint32_t g = 0; g < tw_surface_group_count(f.surfaces[0]); g++) {
      const tw_surface_group *group = tw_surface_get_group(f.surfaces[0], g);
      for (uint64_t face = group->first_face; face < group->first_face + group->face_count; face++) {
        uint32_t names = mesh->face_groups[face];
        assert_int_equal(names == UINT32_MAX, group->names == UINT32_MAX);
        if (names != UINT32_MAX)
          assert_string_equal(model->group_names[names], f.model->group_names[group->names]);
      }
    }
    tw_model_destroy(model);
    free(text);
    fixture_deinit(&f);
  }
}

TEST(groups_end_where_another_node_has_none) {
  fixture f;
  fixture_init(&f, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\n"
                   "o a\ng one\nf 1 2 3\no b\ng\nf 4 5 6\n");
  fixture_refine(&f, 0, false);
  char *text = write_obj(&f.scene);
  assert_non_null(strstr(text, "g one\nf 1 2 3\no b\n"));
  assert_non_null(strstr(text, "g default\nf 4 5 6\n"));
  free(text);
  fixture_deinit(&f);
}

/* ---- glTF ------------------------------------------------------------------------------------ */

/* The JSON of the scene's glTF file. */
static cJSON *write_gltf(const tw_scene *scene) {
  tw_gltf_stream *stream = NULL;
  tw_error error;
  if (tw_gltf_stream_create(scene, TW_FORMAT_GLTF, &stream, &error) != TW_OK) fail_msg("%s", error.detail);
  uint8_t *bytes = fixture_read(stream, 1 << 16);
  cJSON *json = cJSON_ParseWithLength((const char *)bytes, (size_t)tw_gltf_stream_size(stream));
  assert_non_null(json);
  free(bytes);
  tw_gltf_stream_destroy(stream);
  return json;
}

static const cJSON *primitive_of(const cJSON *file, int primitive) {
  const cJSON *mesh = cJSON_GetArrayItem(cJSON_GetObjectItem(file, "meshes"), 0);
  const cJSON *one = cJSON_GetArrayItem(cJSON_GetObjectItem(mesh, "primitives"), primitive);
  assert_non_null(one);
  return one;
}

static const cJSON *groups_of(const cJSON *file, int primitive) {
  return cJSON_GetObjectItem(cJSON_GetObjectItem(primitive_of(file, primitive), "extras"), "groups");
}

static void assert_range(const cJSON *groups, int index, const char *names, int start, int count) {
  const cJSON *range = cJSON_GetArrayItem(groups, index);
  char *printed = cJSON_PrintUnformatted(cJSON_GetObjectItem(range, "names"));
  assert_string_equal(printed, names);
  assert_int_equal(cJSON_GetObjectItem(range, "start")->valueint, start);
  assert_int_equal(cJSON_GetObjectItem(range, "count")->valueint, count);
  free(printed);
}

TEST(gltf_primitives_tell_ranges_of_their_indices) {
  for (uint32_t level = 0; level < 3; level++) {
    fixture f;
    fixture_init(&f, quads_text);
    fixture_refine(&f, level, true);
    cJSON *file = write_gltf(&f.scene);
    int face = 6 << 2 * level; /* indices that a cage face becomes */
    assert_null(groups_of(file, 0));
    assert_int_equal(cJSON_GetArraySize(groups_of(file, 1)), 2);
    assert_range(groups_of(file, 1), 0, "[\"arm\",\"left\"]", 0, 2 * face);
    assert_range(groups_of(file, 1), 1, "[\"hand\"]", 2 * face, face);
    assert_int_equal(cJSON_GetArraySize(groups_of(file, 2)), 2);
    assert_range(groups_of(file, 2), 0, "[\"arm\",\"left\"]", 0, face);
    assert_range(groups_of(file, 2), 1, "[\"leg\"]", face, 2 * face);
    cJSON_Delete(file);
    fixture_deinit(&f);
  }
}

static void assert_names(const glb *file, int mesh, const char *names) {
  const cJSON *extras = cJSON_GetObjectItem(at(file, "meshes", mesh), "extras");
  const cJSON *groups = cJSON_GetObjectItem(cJSON_GetObjectItem(extras, "tweend"), "groups");
  char *printed = cJSON_PrintUnformatted(cJSON_GetObjectItem(groups, "names"));
  assert_string_equal(printed ? printed : "", names);
  free(printed);
}

/* Names of every group in every mesh would be text that grows with the square of the model. */
TEST(a_cage_names_the_groups_of_its_own_faces) {
  fixture f;
  fixture_init(&f,
               GRID "o a\ng arm\nf 1 2 6\ng leg\nf 6 2 7\n"
                    "o b\ng hand\nusemtl red\nf 3 4 8\ng leg\nf 8 4 9\nusemtl blue\nf 8 9 13\ng\nf 13 9 14\n"
                    "o c\nf 5 10 15\n");
  fixture_refine_tagged(&f);
  f.scene.polygons = TW_POLYGONS_NGON;
  glb file = write_glb(&f.scene);
  assert_names(&file, 0, "[\"arm\",\"leg\"]");
  assert_names(&file, 1, "[\"leg\",\"hand\"]"); /* in the order of the model */
  assert_names(&file, 2, "");
  tw_model *model = NULL;
  tw_error error;
  if (tw_gltf_read(file.bytes, file.size, TW_QUADS_NGON, TW_WELD_AUTO, 0, &model, &error) != TW_OK)
    fail_msg("%s", error.detail);
  assert_int_equal(model->warning_count, 0);
  assert_int_equal(model->group_count, f.model->group_count); /* meshes share the sets of one name */
  for (uint32_t i = 0; i < model->group_count; i++)
    assert_string_equal(model->group_names[i], f.model->group_names[i]);
  for (int i = 0; i < 2; i++)
    assert_memory_equal(model->meshes[i].face_groups, f.model->meshes[i].face_groups,
                        model->meshes[i].face_count * sizeof(uint32_t));
  assert_null(model->meshes[2].face_groups);
  tw_model_destroy(model);
  free_glb(&file);
  fixture_deinit(&f);
}

/* One object of both: a JSON object may not have a member twice. */
TEST(gltf_primitives_keep_their_extras_beside_groups) {
  static const char *const kept[] = {"{\"extras\":{\"note\":1,\"groups\":2},\"extensions\":{\"X\":{}}}",
                                     "{\"extras\":3}", NULL};
  for (int polygons = 0; polygons < 2; polygons++)
    for (int i = 0; i < 3; i++) {
      fixture f;
      fixture_init(&f, quads_text);
      const tw_mesh *mesh = &f.model->meshes[0];
      tw_material_slot slots[1] = {{.material = -1, .preserved = kept[i]}};
      int32_t *materials = fixture_alloc(&f, mesh->face_count, sizeof *materials);
      for (uint32_t face = 0; face < mesh->face_count; face++)
        materials[face] = (int32_t)f.model->material_count;
      f.model->meshes[0].face_materials = materials;
      f.model->slots = slots;
      f.model->slot_count = 1;
      fixture_refine(&f, 0, true);
      f.scene.polygons = (tw_polygons)polygons;
      cJSON *file = write_gltf(&f.scene);
      const cJSON *primitive = primitive_of(file, 0), *extras = cJSON_GetObjectItem(primitive, "extras");
      int count = 0;
      for (const cJSON *at = primitive->child; at; at = at->next) count += strcmp(at->string, "extras") == 0;
      assert_int_equal(count, 1);
      assert_true(cJSON_IsArray(cJSON_GetObjectItem(extras, "groups")));
      assert_int_equal(cJSON_GetArraySize(extras), i == 0 ? 2 : 1);
      assert_int_equal(cJSON_HasObjectItem(extras, "note"), i == 0);
      const cJSON *extensions = cJSON_GetObjectItem(primitive, "extensions");
      assert_int_equal(cJSON_GetArraySize(extensions), (i == 0) + polygons);
      cJSON_Delete(file);
      fixture_deinit(&f);
    }
}

TEST(gltf_leaves_out_groups_beyond_thousands) {
  for (int count = 16384; count <= 16385; count++) {
    char *text = malloc((size_t)count * 40 + 100);
    assert_non_null(text);
    size_t length = (size_t)sprintf(text, "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    for (int i = 0; i < count; i++)
      length += (size_t)sprintf(text + length, "v %d 1 1\ng g%d\nf 1 2 -1\n", i, i);
    fixture f;
    fixture_init(&f, text);
    fixture_refine(&f, 0, false);
    cJSON *file = write_gltf(&f.scene);
    assert_int_equal(cJSON_GetArraySize(groups_of(file, 0)), count == 16384 ? count : 0);
    cJSON_Delete(file);
    fixture_deinit(&f);
    free(text);
  }
}
