/* OBJ answers. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "obj.h"
#include "scene_fixture.h"

/* The whole text, terminated, read in blocks. Freed by the caller. */
static char *write_obj(const tw_scene *scene, size_t block) {
  tw_obj_stream *stream = NULL;
  tw_error error;
  if (tw_obj_stream_create(scene, &stream, &error) != TW_OK) fail_msg("%s", error.detail);
  size_t size = 0, capacity = 1 << 16, got;
  uint8_t *text = malloc(capacity);
  assert_non_null(text);
  do {
    if (capacity - size <= block) {
      capacity = 2 * capacity + block;
      text = realloc(text, capacity);
      assert_non_null(text);
    }
    got = tw_obj_stream_read(stream, text + size, block);
    size += got;
  } while (got > 0);
  assert_int_equal(tw_obj_stream_read(stream, text + size, block), 0);
  text[size] = '\0';
  tw_obj_stream_destroy(stream);
  return (char *)text;
}

/* A fixture of an OBJ at level 0, and what it is written as. */
typedef struct written {
  fixture f;
  char *text;
} written;

static written begin(const char *obj) {
  written w;
  fixture_init(&w.f, obj);
  return w;
}

static char *write(written *w, bool normals) {
  const tw_trs *pose = w->f.scene.pose;
  fixture_refine(&w->f, 0, normals);
  w->f.scene.pose = pose;
  return w->text = write_obj(&w->f.scene, 1 << 18);
}

static void end(written *w) {
  free(w->text);
  fixture_deinit(&w->f);
}

/* The text after the first line, which names the program. */
static const char *body(const char *text) {
  assert_memory_equal(text, "# tweend ", 9);
  return strchr(text, '\n') + 1;
}

static const char triangle_text[] = "o flat\nv 0 0 0\nv 0.1 0 0\nv 0 0 -2.5\nvt 0.25 0.5\nf 1 2 3\n";

TEST(model_without_meshes_is_a_comment) {
  fixture f = {.model = tw_model_create()};
  assert_non_null(f.model);
  fixture_refine(&f, 1, true);
  char *text = write_obj(&f.scene, 10);
  assert_string_equal(body(text), "");
  free(text);
  fixture_deinit(&f);
}

TEST(triangle_is_written_as_it_came) {
  written w = begin(triangle_text);
  assert_string_equal(body(write(&w, false)), "o flat\nv 0 0 0\nv 0.1 0 0\nv 0 0 -2.5\nf 1 2 3\n");
  end(&w);
}

TEST(normals_and_uvs_have_their_places) {
  static const char plain[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  static const char mapped[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 0.5 0.75\nvt 0 1\nf 1/1 2/2 3/3\n";
  static const struct {
    const char *obj;
    bool normals;
    const char *found;
  } cases[] = {{plain, true, "vn 0 0 1\nf 1//1 2//2 3//3\n"},
               {mapped, false, "vt 0 0\nvt 0.5 0.75\nvt 0 1\nf 1/1 2/2 3/3\n"},
               {mapped, true, "f 1/1/1 2/2/2 3/3/3\n"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    written w = begin(cases[i].obj);
    assert_non_null(strstr(write(&w, cases[i].normals), cases[i].found));
    end(&w);
  }
}

TEST(same_text_in_blocks_of_any_size) {
  static const size_t blocks[] = {1, 2, 7, 333, 4096, 65537};
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_refine(&f, 4, true);
  char *whole = write_obj(&f.scene, 1 << 22);
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) {
    char *parts = write_obj(&f.scene, blocks[i]);
    assert_string_equal(parts, whole);
    free(parts);
  }
  free(whole);
  fixture_deinit(&f);
}

/* Reading gives the surface again: points and UVs bit for bit, faces with their sizes. */
TEST(text_reads_back_as_the_surface) {
  for (uint32_t level = 0; level < 3; level++) {
    fixture f;
    fixture_init(&f, patchwork_text);
    fixture_refine(&f, level, true);
    char *text = write_obj(&f.scene, 1000);
    tw_model *model = read_obj(text);
    const tw_mesh *mesh = &model->meshes[0];
    const tw_surface_counts *counts = tw_surface_get_counts(f.surfaces[0]);
    assert_string_equal(mesh->name, "patchwork");
    assert_int_equal(mesh->point_count, counts->vertices);
    assert_int_equal(mesh->face_count, counts->faces);
    assert_int_equal(mesh->corner_count, counts->corners);
    tw_surface_reader *reader = tw_surface_reader_create(f.surfaces[0]);
    float *points = tw_alloc(mesh->point_count, 12), *uvs = tw_alloc(mesh->uv_sets[0].value_count, 8);
    uint32_t *corners = tw_alloc(mesh->corner_count, 4), *sizes = tw_alloc(mesh->face_count, 4);
    assert_true(points && uvs && corners && sizes);
    tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, mesh->point_count, points);
    assert_memory_equal(points, mesh->positions, (size_t)mesh->point_count * 12);
    tw_surface_read_faces(reader, TW_DOMAIN_POINTS, 0, mesh->face_count, sizes, corners);
    assert_memory_equal(corners, mesh->corners, (size_t)mesh->corner_count * 4);
    for (uint32_t i = 0; i < mesh->face_count; i++)
      assert_int_equal(mesh->face_offsets[i + 1] - mesh->face_offsets[i], sizes[i]);
    assert_int_equal(mesh->uv_sets[0].value_count, tw_surface_row_count(f.surfaces[0], TW_DOMAIN_UVS));
    tw_surface_read_rows(reader, TW_DOMAIN_UVS, 0, mesh->uv_sets[0].value_count, uvs);
    assert_memory_equal(uvs, mesh->uv_sets[0].values, (size_t)mesh->uv_sets[0].value_count * 8);
    for (uint32_t g = 0; g < tw_surface_group_count(f.surfaces[0]); g++) {
      const tw_surface_group *group = tw_surface_get_group(f.surfaces[0], g);
      const char *wanted = f.model->material_names[group->material];
      for (uint64_t face = group->first_face; face < group->first_face + group->face_count; face++)
        assert_string_equal(model->material_names[mesh->face_materials[face]], wanted);
    }
    free(points);
    free(uvs);
    free(corners);
    free(sizes);
    tw_surface_reader_destroy(reader);
    tw_model_destroy(model);
    free(text);
    fixture_deinit(&f);
  }
}

TEST(each_node_shows_its_mesh_in_world_space) {
  written w = begin(triangle_text);
  w.f.model->meshes[0].name = NULL;
  uint32_t arm = fixture_node(&w.f, "arm", 0, TW_NO_INDEX), hand = fixture_node(&w.f, "hand", arm, 0);
  w.f.model->nodes[0].rest.translation[0] = 10;
  w.f.model->nodes[arm].rest.scale[2] = 2;
  w.f.model->nodes[hand].rest.translation[2] = 1;
  const char *text = write(&w, false);
  assert_string_equal(body(text), "o flat\nv 10 0 0\nv 10.1 0 0\nv 10 0 -2.5\nf 1 2 3\n"
                                  "o hand\nv 10 0 2\nv 10.1 0 2\nv 10 0 -3\nf 4 5 6\n");
  end(&w);
}

TEST(pose_moves_nodes) {
  written w = begin(triangle_text);
  tw_trs pose = TW_TRS_IDENTITY;
  pose.translation[1] = 3;
  w.f.scene.pose = &pose;
  assert_non_null(strstr(write(&w, false), "v 0 3 0\nv 0.1 3 0\nv 0 3 -2.5\n"));
  end(&w);
}

TEST(mirror_turns_faces_round) {
  written w = begin("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  w.f.model->nodes[0].rest.scale[2] = -1;
  assert_non_null(strstr(write(&w, true), "vn 0 0 -1\nf 1//1 4//4 3//3 2//2\n"));
  end(&w);
}

TEST(normals_go_by_the_inverse_transpose) {
  written w = begin("v 0 0 0\nv 1 0 -1\nv 1 1 -1\nv 0 1 0\nf 1 2 3 4\n"); /* normal (1, 0, 1) */
  w.f.model->nodes[0].rest.scale[0] = 3;
  const char *text = write(&w, true);
  float normal[3];
  const char *number = strstr(text, "vn ") + 2;
  for (int i = 0; i < 3; i++) {
    char *end;
    normal[i] = strtof(number, &end);
    number = end;
  }
  assert_true(fabsf(normal[0] - 1 / sqrtf(10)) < 1e-6f && fabsf(normal[2] - 3 / sqrtf(10)) < 1e-6f);
  assert_true(normal[1] == 0);
  end(&w);
}

TEST(flattened_node_still_has_normals) {
  written w = begin("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  for (int i = 0; i < 3; i++) w.f.model->nodes[0].rest.scale[i] = 0;
  assert_non_null(strstr(write(&w, true), "v 0 0 0\nvn 0 0 1\n"));
  end(&w);
}

TEST(objects_have_the_names_of_nodes_each_once) {
  written w = begin(triangle_text);
  static const char *const names[] = {"arm", "arm", "arm_2", "arm"};
  for (int i = 0; i < 4; i++) fixture_node(&w.f, names[i], TW_NO_INDEX, 0);
  const char *text = write(&w, false),
             *wanted[] = {"\no flat\n", "\no arm\n", "\no arm_3\n", "\no arm_2\n", "\no arm_4\n"};
  for (int i = 0; i < 5; i++) {
    text = strstr(text, wanted[i]);
    if (!text) fail_msg("no %s in its place", wanted[i]);
  }
  end(&w);
}

TEST(names_cannot_break_lines) {
  written w = begin("o flat\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl red\nf 1 2 3\n");
  w.f.model->material_names[0] = "re\nd\t\\";
  assert_non_null(strstr(write(&w, false), "\nusemtl re_d__\nf "));
  end(&w);
}

TEST(material_lasts_until_another) {
  written w = begin("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nusemtl red\nf 1 3 4\n");
  fixture_node(&w.f, "again", TW_NO_INDEX, 0);
  w.f.model->material_names[0] = NULL;
  char *text = write(&w, false), *second = strstr(text, "o again");
  assert_non_null(second);
  assert_non_null(strstr(second, "f 5 6 7\nusemtl material_0\nf 5 7 8\n"));
  assert_non_null(strstr(second, "usemtl none\nf 5 6 7\n")); /* the red of the first node ends */
  *second = '\0';
  assert_null(strstr(text, "usemtl none"));
  end(&w);
}

/* ---- tags ------------------------------------------------------------------------------------ */

static char *write_tagged(written *w) {
  fixture_refine_tagged(&w->f);
  return w->text = write_obj(&w->f.scene, 1 << 18);
}

/* A cube with tags. */
static written begin_tagged(const char *tags) {
  char text[2 * sizeof cube_text];
  snprintf(text, sizeof text, "%s%s", cube_text, tags);
  return begin(text);
}

TEST(tags_are_written_as_they_are_read) {
  written w = begin_tagged("t crease 4/2/0 0 1 4 5 2.5 99\nt corner 1/1/0 6 1.25\n");
  char *text = write_tagged(&w);
  assert_string_equal(strstr(text, "f 4 1 5 8\n"),
                      "f 4 1 5 8\nt crease 2/1/0 1 0 2.5\nt crease 2/1/0 4 5 10\n"
                      "t corner 1/1/0 6 1.25\n");
  end(&w);
}

TEST(tags_number_the_points_of_the_file) {
  written w = begin_tagged("t crease 2/1/0 0 3 1\nt corner 1/1/0 7 2\n");
  fixture_node(&w.f, "again", TW_NO_INDEX, 0);
  char *text = write_tagged(&w);
  assert_non_null(strstr(text, "\nt crease 2/1/0 0 3 1\nt corner 1/1/0 7 2\n"));
  assert_non_null(strstr(text, "\nt crease 2/1/0 8 11 1\nt corner 1/1/0 15 2\n"));
  end(&w);
}

TEST(of_two_tags_the_later_holds_and_none_of_what_is_not_there) {
  written w = begin_tagged("t crease 2/1/0 0 3 1\nt crease 2/1/0 3 0 2\nt crease 2/1/0 0 6 4\n"
                           "t crease 2/1/0 1 2 3\nt crease 2/1/0 1 2 0\n");
  char *text = write_tagged(&w);
  assert_string_equal(strstr(text, "f 4 1 5 8\n"), "f 4 1 5 8\nt crease 2/1/0 0 3 2\n");
  end(&w);
}

/* What is left out of the answer would be a border of what comes back: such a cage has no tags. */
TEST(mesh_with_a_hole_has_no_tags) {
  written w = begin_tagged("t crease 2/1/0 0 3 1\nt hole 1/0/0 5\n");
  char *text = write_tagged(&w);
  assert_null(strstr(text, "\nt "));
  end(&w);
}

/* Points that no face uses are not written, and faces stand by material: the numbers of the file change. */
TEST(tags_follow_what_the_answer_numbers_anew) {
  written w = begin("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n"
                    "usemtl b\nf 2 3 4 5\nusemtl a\nf 3 6 7 4\nusemtl b\nf 2 3 7\n"
                    "t crease 2/1/0 2 3 1.5\nt corner 1/1/0 6 3\n");
  char *text = write_tagged(&w);
  assert_non_null(strstr(text, "v 2 1 0\nusemtl b\nf 1 2 3 4\nf 1 2 6\nusemtl a\nf 2 5 6 3\n"
                               "t crease 2/1/0 1 2 1.5\nt corner 1/1/0 5 3\n"));
  end(&w);
}

TEST(tags_in_blocks_of_any_size) {
  static const size_t blocks[] = {1, 7, 333};
  fixture f;
  uint32_t edges[2 * 12];
  float sharpness[12];
  fixture_init(&f, cube_text);
  tw_mesh *mesh = &f.model->meshes[0];
  for (uint32_t e = 0; e < 12; e++) { /* the cube's bottom and top rows, then its columns */
    uint32_t at = e % 4, ring = e / 4 % 2 * 4;
    edges[2 * e] = e < 8 ? ring + at : at;
    edges[2 * e + 1] = e < 8 ? ring + (at + 1) % 4 : at + 4;
    sharpness[e] = 0.1234567f + (float)e / 7;
  }
  mesh->crease_count = 12;
  mesh->crease_edges = edges;
  mesh->crease_sharpness = sharpness;
  for (uint32_t i = 0; i < 60; i++) fixture_node(&f, "again", TW_NO_INDEX, 0);
  fixture_refine_tagged(&f);
  char *whole = write_obj(&f.scene, 1 << 20);
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) {
    char *parts = write_obj(&f.scene, blocks[i]);
    assert_string_equal(parts, whole);
    free(parts);
  }
  tw_model *model = read_obj(whole);
  assert_int_equal(model->meshes[0].crease_count, 61 * 12);
  tw_model_destroy(model);
  free(whole);
  fixture_deinit(&f);
}

/* As objects of one name do. A file of glTF may have such materials, and readers of OBJ know them by their
 * names. */
TEST(materials_of_one_name_are_told_apart) {
  written w = begin("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 2 2 0\n"
                    "usemtl a\nf 1 2 3\nusemtl b\nf 3 2 4\nusemtl c\nf 4 2 5\nusemtl d\nf 4 5 6\n");
  tw_model *model = w.f.model;
  assert_int_equal(model->material_count, 4);
  const char *names[4] = {"x", "x", NULL, "material_2"};
  model->material_names = names;
  write(&w, false);
  const char *at = w.text;
  static const char *const expected[] = {"x", "x_2", "material_2", "material_2_2"};
  for (int i = 0; i < 4; i++) {
    char line[40];
    snprintf(line, sizeof line, "usemtl %s\nf ", expected[i]);
    at = strstr(at, line);
    assert_non_null(at);
    at++;
  }
  end(&w);
  w = begin("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 3 2 4\n"
            "usemtl c\nf 4 2 5\n");
  const char *taken[3] = {"x", "x", "x_2"};
  w.f.model->material_names = taken;
  write(&w, false);
  assert_non_null(strstr(w.text, "usemtl x_3\nf "));
  end(&w);
}
