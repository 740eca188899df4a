/* Reading Wavefront OBJ: bad files first, then what good ones say. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"
#include "tweend/format.h"
#include "tweend/subdiv.h"

/* Reads a copy without a terminator, so that the sanitizer sees a read past the end. */
static tw_status read_bytes(const char *text, size_t size, tw_model **model, tw_error *error) {
  uint8_t *bytes = malloc(size ? size : 1);
  assert_non_null(bytes);
  memcpy(bytes, text, size);
  tw_status status = tw_obj_read(bytes, size, TW_WELD_AUTO, model, error);
  free(bytes);
  return status;
}

static tw_model *read_good(const char *text) {
  tw_model *model = NULL;
  tw_error error = {0};
  tw_status status = read_bytes(text, strlen(text), &model, &error);
  if (status != TW_OK) print_error("line %llu: %s\n", (unsigned long long)error.line, error.detail);
  assert_int_equal(status, TW_OK);
  return model;
}

static void assert_refused(const char *text, tw_status expected, uint64_t line) {
  tw_model *untouched = NULL;
  tw_error error = {0};
  tw_status status = read_bytes(text, strlen(text), &untouched, &error);
  if (status != expected || error.line != line)
    print_error("%s\n-> status %d line %llu: %s\n", text, (int)status, (unsigned long long)error.line,
                error.detail);
  assert_int_equal(status, expected);
  assert_int_equal(error.line, line);
  assert_true(error.detail[0] != '\0');
  assert_null(untouched);
}

#define TRIANGLE "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
#define SQUARE   "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"

/* ---- bad files ------------------------------------------------------------------------------- */

TEST(bad_files_are_refused_at_their_line) {
  static const struct {
    const char *text;
    tw_status status;
    uint64_t line;
  } cases[] = {
      {"", TW_SYNTAX, 1},
      {"# nothing\n\n", TW_SYNTAX, 3},
      {"v 0 0\n", TW_SYNTAX, 1},
      {"v\n", TW_SYNTAX, 1},
      {"v 0 0 0 1 1\n", TW_SYNTAX, 1},
      {"v 0 0 zero\n", TW_SYNTAX, 1},
      {"v 0 0 1.0.0\n", TW_SYNTAX, 1},
      {"v 0 0 1e\n", TW_SYNTAX, 1},
      {"v 0 0 0x10\n", TW_SYNTAX, 1},
      {"v 0 0 -\n", TW_SYNTAX, 1},
      {"\nv nan 0 0\n", TW_INVALID, 2},
      {"v 0 -nan(ind) 0\n", TW_INVALID, 1},
      {"v 0 0 1.#IND\n", TW_INVALID, 1}, /* as Microsoft's printf wrote them, and no comments */
      {"v 0 0 -1.#IND00\n", TW_INVALID, 1},
      {"v 1.#QNAN0 0 0\n", TW_INVALID, 1},
      {"v 0 +1.#INF 0\n", TW_INVALID, 1},
      {"v 0 0 1.#J\n", TW_INVALID, 1},
      {"v 0 +Inf 0\n", TW_INVALID, 1},
      {"v nano 0 0\n", TW_SYNTAX, 1},
      {"v 0 nan(ind 0\n", TW_SYNTAX, 1},
      {"v 1e999 0 0\n", TW_INVALID, 1},
      {"v 0 -1e39 0\n", TW_INVALID, 1},
      {"v 0 0 0 1 nan 0\n", TW_INVALID, 1},
      {TRIANGLE "vt\nf 1 2 3\n", TW_SYNTAX, 4},
      {TRIANGLE "vt x\nf 1 2 3\n", TW_SYNTAX, 4},
      {TRIANGLE "f 0 1 2\n", TW_INVALID, 4},
      {TRIANGLE "f 1 2 4\n", TW_INVALID, 4},
      {TRIANGLE "f 1 2 3\nf 1 2 4\nf 1 3 2\n", TW_INVALID, 5},
      {TRIANGLE "f -1 -2 -4\n", TW_INVALID, 4},
      {TRIANGLE "f 1 2 99999999999\n", TW_INVALID, 4},
      {TRIANGLE "f 1 2 9999999999999999999999\n", TW_SYNTAX, 4},
      {TRIANGLE "f 1 2 3.5\n", TW_SYNTAX, 4},
      {TRIANGLE "f 1 2 x\n", TW_SYNTAX, 4},
      {TRIANGLE "f 1 2 3/x\n", TW_SYNTAX, 4},
      {TRIANGLE "vt 0\nvn 0 0 1\nf 1 2 3/1/1/1\n", TW_SYNTAX, 6},
      {TRIANGLE "vt 0 0\nf 1/2 2/1 3/1\n", TW_INVALID, 5},
      {TRIANGLE "vn 0 0 1\nf 1//2 2//1 3//1\n", TW_INVALID, 5},
      {TRIANGLE "vt 0 0\nf 1/0 2/1 3/1\n", TW_INVALID, 5},
      {TRIANGLE "\\\n\\\nf 1 \\\n 2 9\n", TW_INVALID, 7},
      {"\x89PNG\r\n", TW_SYNTAX, 1},
      {"<html>\n", TW_SYNTAX, 1},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_refused(cases[i].text, cases[i].status, cases[i].line);
}

TEST(words_that_are_malformed_are_quoted_with_their_column) {
  static const struct {
    const char *text, *detail;
    uint64_t column;
  } cases[] = {
      {"v 0 1.0f 0\n", "\"1.0f\" is no number", 5},
      {"# one\r\nv 0 0\t0,5 # half\r\n", "\"0,5\" is no number", 7},
      {"v 0 0 \\\n  0x10\n", "\"0x10\" is no number", 3},
      {"g \xC3\xA4\nv \xC3\xA4 0 0\n", "\"??\" is no number", 3},
      {"\xEF\xBB\xBFv - 0 0\n", "\"-\" is no number", 3},
      {TRIANGLE "f 1/ 2/x/3 3\n", "\"2/x/3\" is no corner of a face", 6},
      {TRIANGLE "f 1 2 3.5\n", "\"3.5\" is no corner of a face", 7},
      {"v 0 0 12345678901234567890123456789012345678901234567890x\n",
       "\"1234567890123456789012345678901234567890...\" is no number", 7},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    tw_model *model = NULL;
    tw_error error = {0};
    assert_int_equal(read_bytes(cases[i].text, strlen(cases[i].text), &model, &error), TW_SYNTAX);
    assert_string_equal(error.detail, cases[i].detail);
    assert_int_equal(error.column, cases[i].column);
  }
}

TEST(a_line_without_a_malformed_word_has_no_column) {
  tw_model *model = NULL;
  tw_error error = {.column = 7};
  assert_int_equal(read_bytes("v 0 0\n", 6, &model, &error), TW_SYNTAX);
  assert_int_equal(error.column, 0);
}

TEST(bad_tags_are_refused_at_their_line) {
  static const struct {
    const char *tag;
    tw_status status;
  } cases[] = {
      {"t crease\n", TW_SYNTAX},
      {"t crease 2 0 1 1\n", TW_SYNTAX},
      {"t crease 2/1/0 0 1\n", TW_SYNTAX},
      {"t crease 2/1/0 0 1 nan\n", TW_SYNTAX},
      {"t crease 2/1/0 0 1 1e99\n", TW_SYNTAX},
      {"t crease 3/1/0 0 1 2 1\n", TW_SYNTAX},
      {"t crease 2/0/0 0 1\n", TW_SYNTAX},
      {"t crease 2/1/0 1 1 2\n", TW_SYNTAX},
      {"t crease 2/1/0 0 -1 2\n", TW_SYNTAX},
      {"t crease 2/1/0 0 4 2\n", TW_INVALID},
      {"t crease 99999999999/1/0 0 1 2\n", TW_SYNTAX},
      {"t corner 1/1/0 4 2\n", TW_INVALID},
      {"t corner 2/3/0 0 1 1 2 3\n", TW_SYNTAX},
      {"t hole 1/0/0 1\n", TW_INVALID},
      {"t interpolateboundary 1/0/0 3\n", TW_SYNTAX},
      {"t interpolateboundary 0/0/0\n", TW_SYNTAX},
      {"t facevaryinginterpolateboundary 1/0/0 6\n", TW_SYNTAX},
      {"t creasemethod 0/0/1 sharp\n", TW_SYNTAX},
      {"t creasemethod 0/0/1\n", TW_SYNTAX},
      {"t smoothtriangles 0/0/1 round\n", TW_SYNTAX},
  };
  char text[256];
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    strcpy(text, SQUARE "f 1 2 3 4\n");
    strcat(text, cases[i].tag);
    assert_refused(text, cases[i].status, 6);
  }
}

/* Files of materials are not read: a GLB brings what they say along. */
TEST(materials_in_other_files_are_warned_of) {
  tw_model *model = read_good("mtllib a.mtl\n" SQUARE "usemtl red\nf 1 2 3 4\n");
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0],
                      "of 1 material the name alone is kept: its colours and textures stand in other files");
  tw_model_destroy(model);
  model = read_good("mtllib a.mtl\n" SQUARE "f 1 2 3 4\n");
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0],
                      "the libraries of materials that the file names are left out: no face uses one");
  tw_model_destroy(model);
}

TEST(a_file_cut_anywhere_is_read_or_refused) {
  static const char whole[] = "mtllib a.mtl\no a\n" SQUARE "vt 0 0\nvn 0 0 1\nusemtl red\n"
                              "f 1/1/1 2/1/1 \\\n 3/1/1 4/1/1\nt crease 2/1/0 0 1 2.5\n# end\r\n";
  for (size_t size = 0; size < sizeof whole; size++) {
    tw_model *model = NULL;
    tw_error error;
    if (read_bytes(whole, size, &model, &error) == TW_OK) tw_model_destroy(model);
  }
}

/* ---- numbers and lines ----------------------------------------------------------------------- */

TEST(numbers_of_every_form_are_read) {
  tw_model *model = read_good("v 1.5 -.25 +3\nv 1e2 1.25E-2 -7.\nv 0.1 123456789012345678 1e-60\nf 1 2 3\n");
  static const float expected[9] = {1.5f, -0.25f, 3, 100, 0.0125f, -7, 0.1f, 123456789012345678.0f, 0};
  assert_memory_equal(model->meshes[0].positions, expected, sizeof expected);
  tw_model_destroy(model);
}

/* The nearest float, as the C library finds it, for numbers of every length. */
TEST(numbers_round_to_the_nearest_float) {
  uint64_t seed = 1;
  for (int i = 0; i < 2000; i++) {
    char number[64], text[256];
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    double value = ((double)(int64_t)seed) / 9.2e18 * pow(10, (int)(seed >> 33) % 12 - 6);
    snprintf(number, sizeof number, "%.*f", (int)(seed >> 40) % 18, value);
    snprintf(text, sizeof text, "v %s 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", number);
    tw_model *model = read_good(text);
    assert_true(model->meshes[0].positions[0] == (float)strtod(number, NULL));
    tw_model_destroy(model);
  }
}

TEST(line_ends_comments_and_continuations_make_no_difference) {
  static const char *const variants[] = {
      TRIANGLE "f 1 2 3\n",
      "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n",
      "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",
      "\xEF\xBB\xBFv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
      "# c:\\files\\\nv 0 0 0 # first\n\n \t\nv\t1 0 0 \n  v 0 1 0\nf 1 2 3#end\n",
      "v \\\n0 0\\\r\n 0\nv 1 0 0\nv 0 1 0\nf 1 2 \\\r 3\n",
      "unknown 1 2 3 \\\n f 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\ns off\nvn 0 0 1\nf 1//1 2//1 3//1\n",
  };
  static const float expected[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  for (size_t i = 0; i < sizeof variants / sizeof *variants; i++) {
    tw_model *model = read_good(variants[i]);
    assert_int_equal(model->mesh_count, 1);
    assert_int_equal(model->meshes[0].point_count, 3);
    assert_memory_equal(model->meshes[0].positions, expected, sizeof expected);
    assert_int_equal(model->meshes[0].face_count, 1);
    tw_model_destroy(model);
  }
}

/* ---- faces ----------------------------------------------------------------------------------- */

TEST(faces_of_every_size_and_form_are_kept) {
  tw_model *model =
      read_good("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 2 0\n"
                "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n"
                "f 1/1 2/2 3/3\nf -5//1 -3//-1 -2//1 -1//1\nf 1/1/1 2/-2/1 3/3/1 4/1/1 5/1/1\n");
  const tw_mesh *mesh = &model->meshes[0];
  static const uint32_t offsets[] = {0, 3, 7, 12}, corners[] = {0, 1, 2, 0, 2, 3, 4, 0, 1, 2, 3, 4};
  static const uint32_t uvs[] = {0, 1, 2, 0, 0, 0, 0, 0, 1, 2, 0, 0}; /* corners without one have 0 0 */
  assert_int_equal(mesh->face_count, 3);
  assert_int_equal(mesh->corner_count, 12);
  assert_memory_equal(mesh->face_offsets, offsets, sizeof offsets);
  assert_memory_equal(mesh->corners, corners, sizeof corners);
  assert_int_equal(mesh->uv_set_count, 1);
  assert_int_equal(mesh->uv_sets[0].value_count, 4);
  assert_memory_equal(mesh->uv_sets[0].corners, uvs, sizeof uvs);
  assert_true(mesh->uv_sets[0].values[5] == 1);
  assert_true(mesh->uv_sets[0].values[6] == 0);
  assert_int_equal(model->warning_count, 1); /* corners without vt */
  tw_model_destroy(model);
}

TEST(faces_may_name_points_that_follow_them) {
  tw_model *model = read_good("f 1 2 3\n" TRIANGLE);
  assert_int_equal(model->meshes[0].face_count, 1);
  tw_model_destroy(model);
}

TEST(a_face_of_a_thousand_corners_is_one_face) {
  char *text = malloc(64 * 1000);
  assert_non_null(text);
  size_t length = 0;
  for (int i = 0; i < 1000; i++) length += (size_t)sprintf(text + length, "v %d %d 0\n", i, i * i);
  text[length++] = 'f';
  for (int i = 0; i < 1000; i++) length += (size_t)sprintf(text + length, " %d", i + 1);
  tw_model *model = read_good(text);
  assert_int_equal(model->meshes[0].corner_count, 1000);
  tw_model_destroy(model);
  strcpy(text + length, " 500\n"); /* a point twice */
  model = read_good(text);
  assert_int_equal(model->meshes[0].corner_count, 1001);
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
  free(text);
}

TEST(files_without_vt_have_no_uvs) {
  tw_model *model = read_good(TRIANGLE "vt 0 0\nf 1 2 3\n");
  assert_int_equal(model->meshes[0].uv_set_count, 0);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0], "1 texture coordinate of no corner is left out");
  tw_model_destroy(model);
}

TEST(texture_coordinates_that_are_not_finite_become_0_with_a_warning) {
  tw_model *model = read_good(TRIANGLE "vt nan 1\nvt 0.5 -nan(ind)\nvt 0.25 1\nf 1/1 2/2 3/3\n");
  assert_int_equal(model->meshes[0].uv_set_count, 1);
  const tw_uv_set *set = &model->meshes[0].uv_sets[0];
  const float expected[3][2] = {{0, 0}, {0, 0}, {0.25f, 1}};
  for (int c = 0; c < 3; c++)
    assert_memory_equal(set->values + 2 * set->corners[c], expected[c], sizeof expected[c]);
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "2 texture coordinates are 0 0"));
  tw_model_destroy(model);
}

/* What looks like a number that is not finite to Microsoft's printf, and is not. */
TEST(comments_may_stand_right_behind_numbers) {
  static const char *const ends[] = {"#IND", "#a", "#0", "#", "# IND", "#INFO-1", "#ind"};
  for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
    char text[128];
    snprintf(text, sizeof text, "v 0 0 0\nv 1 0 1%s\nv 0 1 1%s%s\nf 1 2 3\n", ends[i], i == 0 ? ".5" : ".",
             ends[i]);
    tw_model *model = read_good(text);
    assert_true(model->meshes[0].positions[5] == 1);
    assert_true(model->meshes[0].positions[8] == (i == 0 ? 1.5f : 1));
    assert_int_equal(model->warning_count, 0);
    tw_model_destroy(model);
  }
  tw_model *model =
      read_good(TRIANGLE "vt 1.#QNAN 1\nvt 0.5 -1.#IND\nvt 0.25 1\nvn 1.#INF 0 0\nf 1/1/1 2/2/1 3/3/1\n");
  const tw_uv_set *set = &model->meshes[0].uv_sets[0];
  const float expected[3][2] = {{0, 0}, {0, 0}, {0.25f, 1}};
  for (int c = 0; c < 3; c++)
    assert_memory_equal(set->values + 2 * set->corners[c], expected[c], sizeof expected[c]);
  assert_int_equal(model->warning_count, 2);
  tw_model_destroy(model);
}

/* How many values of the first set the corners name at a point. */
static uint32_t uvs_at(const tw_mesh *mesh, uint32_t point) {
  uint32_t count = 0, first = 0;
  for (uint32_t c = 0; c < mesh->corner_count; c++) {
    uint32_t value = mesh->uv_sets[0].corners[c];
    if (mesh->corners[c] != point) continue;
    if (count == 0) first = value;
    count = count == 0 ? 1 : value == first ? count : count + 1;
  }
  return count;
}

TEST(texture_coordinates_that_are_written_for_every_corner_have_seams_where_they_differ) {
  static const char points[] = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\n";
  static const char values[] = "vt 0 0\nvt .5 0\nvt .5 1\nvt 0 1\nvt .5 0\nvt 1 0\nvt 1 1\nvt .6 1\n";
  static const char *const rest[] = {"f 1/1 2/2 5/3 4/4\nf 2/5 3/6 6/7 5/8\n",
                                     "v 2 1 0\nf 1/1 2/2 5/3 4/4\nf 2/5 3/6 6/7 5/8\nf 2/5 3/6 7/7\n"};
  for (int i = 0; i < 2; i++) { /* points that are welded, and none */
    char text[512];
    snprintf(text, sizeof text, "%s%s%s", points, values, rest[i]);
    tw_model *model = read_good(text);
    assert_int_equal(uvs_at(&model->meshes[0], 1), 1);
    assert_int_equal(uvs_at(&model->meshes[0], 4), 2);
    tw_model_destroy(model);
  }
}

TEST(lines_points_and_curves_are_left_out_with_one_warning_that_names_the_first) {
  tw_model *model = read_good(TRIANGLE "f 1 2 3\nl 1 2\np 3\ncurv 0 1 1 2 3\n");
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "3 lines"));
  assert_non_null(strstr(model->warnings[0], "in line 5"));
  tw_model_destroy(model);
}

TEST(unknown_statements_are_left_out_with_one_warning_that_names_the_first) {
  tw_model *model = read_good(TRIANGLE "F 1 2 3\nf 1 2 3\nface 1 2 3\nvv 0 0 0\n");
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0],
                      "3 statements are left out, the first in line 4: \"F\" is none that is known");
  tw_model_destroy(model);
}

TEST(statements_without_a_surface_are_no_unknown_ones) {
  tw_model *model =
      read_good("mtllib a.mtl\no a\ng b\ns off\nmg 0\nlod 1\nbevel on\nc_interp off\nd_interp on\n"
                "usemap a\nmaplib a\nshadow_obj a\ntrace_obj a\nctech cparm 1\nstech cparma 1\n"
                "vp 0 0\ncstype bezier\ndeg 3\nbmat u 1\nstep 1\nparm u 0 1\ntrim 0 1 1\n"
                "hole 0 1 1\nscrv 0 1 1\nsp 1\nend\ncon 1 0 1 1 2 0 1 1\n" TRIANGLE
                "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nfo 3/1/1 2/1/1 1/1/1\n");
  assert_int_equal(model->warning_count, 3);
  assert_non_null(strstr(model->warnings[0], "libraries of materials"));
  assert_string_equal(model->warnings[2],
                      "8 statements about display and files are left out, the first in line 6");
  assert_string_equal(model->warnings[1],
                      "15 statements of free-form curves and surfaces are left out, the first in line 5");
  tw_model_destroy(model);
}

TEST(colours_become_linear_and_points_without_one_white) {
  tw_model *model = read_good("v 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0 1\nf 1 2 3\n");
  const float *colors = model->meshes[0].attributes[0].values;
  assert_non_null(colors);
  for (int i = 0; i < 4; i++) assert_true(colors[i] == 1 && colors[8 + i] == 1);
  assert_true(colors[4] == 1 && colors[6] == 0 && colors[7] == 1);
  assert_true(fabsf(colors[5] - 0.21404f) < 1e-4f);
  tw_model_destroy(model);
}

/* Some tools write bytes. Other numbers beyond 1 are no colours, and a last digit more is none's fault. */
TEST(colours_beyond_one_are_bytes_or_told) {
  static const struct {
    const char *text, *warning;
    float green; /* of the second point */
  } cases[] = {
      {"v 0 0 0 255 0 0\nv 1 0 0 255 128 0\nv 0 1 0 0 0 1\nf 1 2 3\n",
       "3 colours of points are divided by 255: all are whole numbers, some over 1", 0.2158605f},
      {"v 0 0 0 255 0 0\nv 1 0 0 255 .5 0\nv 0 1 0 0 0 1\nf 1 2 3\n", "2 colours are brought into 0 to 1",
       0.2140411f},
      {"v 0 0 0 1 0 0\nv 1 0 0 1 300 0\nv 0 1 0 -1 0 1\nf 1 2 3\n", "2 colours are brought into 0 to 1", 1},
      {"v 0 0 0 1 0 0\nv 1 0 0 1 1.0001 0\nv 0 1 0 0 0 1\nf 1 2 3\n", NULL, 1},
      {"v 0 0 0 1 0 0\nv 1 0 0 1 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n", NULL, 1}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    tw_model *model = read_good(cases[i].text);
    assert_float_equal(model->meshes[0].attributes[0].values[5], cases[i].green, 1e-6);
    assert_int_equal(model->warning_count, cases[i].warning != NULL);
    if (cases[i].warning) assert_string_equal(model->warnings[0], cases[i].warning);
    tw_model_destroy(model);
  }
}

TEST(an_object_without_colours_does_not_take_those_of_another) {
  tw_model *model = read_good("o red\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n"
                              "o plain\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 4 5 6\n");
  assert_int_equal(model->mesh_count, 2);
  assert_int_equal(model->meshes[0].attribute_count, 1);
  assert_int_equal(model->meshes[1].attribute_count, 0);
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
}

TEST(colours_in_comments_of_zbrush_are_those_of_the_points_in_turn) {
  tw_model *model =
      read_good("#Vertex Count 4\n" SQUARE "#MRGB ffff0000ff0080FF\n#MRGB 00000000zz\n# End of MRGB\n"
                "f 1 2 3 4\n");
  const float *colors = model->meshes[0].attributes[0].values;
  static const float expected[16] = {1, 0, 0, 1, 0, 0.2158605f, 1, 1, 0, 0, 0, 1, 1, 1, 1, 1};
  for (int i = 0; i < 16; i++) assert_float_equal(colors[i], expected[i], 1e-6);
  assert_int_equal(model->warning_count, 3);
  assert_string_equal(model->warnings[0], "1 mask of a point is left out, in line 7");
  assert_non_null(strstr(model->warnings[1], "1 line of colours (#MRGB) is not read to its end, in line 7"));
  assert_string_equal(model->warnings[2], "1 point has no colour: it is white beside those that have one");
  tw_model_destroy(model);
  model = read_good(SQUARE "#MRGBffff0000\n#MRGB\n#MRGB xyzxyzxyz\nf 1 2 3 4 #MRGB ffff0000\n");
  assert_int_equal(model->meshes[0].attribute_count, 0);
  assert_int_equal(model->warning_count, 1);
  tw_model_destroy(model);
  model = read_good(TRIANGLE
                    "#MRGB ffff0000ffff0000ffff0000ffff0000\nf 1 2 3\n"); /* more than there are points */
  assert_float_equal(model->meshes[0].attributes[0].values[9], 0, 0);
  assert_int_equal(model->warning_count, 1);
  tw_model_destroy(model);
}

/* ---- dialects -------------------------------------------------------------------------------- */

TEST(a_file_as_3ds_max_writes_it_is_read) {
  tw_model *model =
      read_good("# 3ds Max Wavefront OBJ Exporter\r\n\r\n#\r\n# object Box\r\n#\r\n\r\n"
                "v  0.0000 0.0000 0.0000\r\nv  1.0000 0.0000 0.0000\r\nv  1.0000 1.0000 0.0000\r\n"
                "v  0.0000 1.0000 0.0000\r\n# 4 vertices\r\n\r\nvn 0.0000 0.0000 1.0000\r\n\r\n"
                "vt 0.2500 0.5000 0.7500\r\n\r\ng Box\r\nusemtl 01 - Default\r\ns off\r\n"
                "f 1/1/1 2/1/1 3/1/1 4/1/1 \r\ng\r\ns 2\r\nf 4/1/1 3/1/1 1/1/1 \r\n");
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->face_count, 2);
  assert_int_equal(mesh->corner_count, 7);
  assert_string_equal(mesh->name, "Box");
  assert_string_equal(model->material_names[0], "01 - Default");
  assert_int_equal(mesh->face_groups[0], 0);
  assert_int_equal(mesh->face_groups[1], UINT32_MAX);
  assert_int_equal(mesh->face_smoothing[0], 0);
  assert_int_equal(mesh->face_smoothing[1], 2);
  assert_float_equal(mesh->uv_sets[0].values[0], 0.25, 0);
  assert_float_equal(mesh->uv_sets[0].values[1], 0.5, 0);
  tw_model_destroy(model);
}

TEST(corners_with_slashes_alone_and_faces_by_an_older_name_are_read) {
  tw_model *model = read_good("o Model:Mesh\r\n" TRIANGLE "f 1// 2// 3//\r\nfo 3/ 2/ 1/\r\n");
  assert_string_equal(model->meshes[0].name, "Model:Mesh");
  assert_int_equal(model->meshes[0].face_count, 2);
  assert_null(model->meshes[0].normals.corners);
  tw_model_destroy(model);
}

TEST(a_hundred_thousand_groups_of_one_face_are_kept) {
  enum { GROUPS = 100000 };
  char *text = malloc(GROUPS * 48 + 64), *end = text;
  end += sprintf(end, TRIANGLE);
  for (int i = 0; i < GROUPS; i++)
    end += sprintf(end, "v %d 1 1\ng Group%d\nf %d 2 -1\n", i, i, i % 2 ? 1 : 3);
  tw_model *model = read_good(text);
  assert_int_equal(model->group_count, GROUPS);
  assert_int_equal(model->meshes[0].face_groups[GROUPS - 1], GROUPS - 1);
  assert_string_equal(model->group_names[GROUPS - 1], "Group99999");
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
  free(text);
}

/* ---- names, materials, objects --------------------------------------------------------------- */

TEST(the_first_name_names_mesh_and_node) {
  tw_model *model = read_good("g  left side \n" TRIANGLE "f 1 2 3\ng right\nf 1 3 2\n");
  assert_int_equal(model->mesh_count, 1);
  assert_string_equal(model->meshes[0].name, "left side");
  assert_int_equal(model->node_count, 1);
  assert_string_equal(model->nodes[0].name, "left side");
  assert_int_equal(model->nodes[0].mesh, 0);
  tw_model_destroy(model);
}

TEST(latin1_names_become_utf8) {
  tw_model *model = read_good("o T\xFCr\x01links\n" TRIANGLE "usemtl M\xF6"
                              "bel\ng Gr\xFCn\nf 1 2 3\n");
  assert_string_equal(model->meshes[0].name, "T\xC3\xBCr links");
  assert_string_equal(model->material_names[0], "M\xC3\xB6"
                                                "bel");
  assert_string_equal(model->group_names[0], "Gr\xC3\xBCn");
  tw_model_destroy(model);
}

TEST(materials_are_numbered_by_first_use) {
  tw_model *model =
      read_good(TRIANGLE "f 1 2 3\nusemtl red\nf 1 3 2\nusemtl blue\nf 2 3 1\nusemtl red\nf 3 1 2\n");
  static const int32_t expected[] = {-1, 0, 1, 0};
  assert_memory_equal(model->meshes[0].face_materials, expected, sizeof expected);
  assert_int_equal(model->material_count, 2);
  assert_string_equal(model->material_names[0], "red");
  assert_string_equal(model->material_names[1], "blue");
  tw_model_destroy(model);
}

TEST(a_thousand_materials_keep_their_names) {
  char *text = malloc(64 * 2000);
  assert_non_null(text);
  size_t length = (size_t)sprintf(text, TRIANGLE);
  for (int i = 0; i < 2000; i++)
    length += (size_t)sprintf(text + length, "usemtl m%d\nf 1 2 3\n", (i * 7) % 1000);
  tw_model *model = read_good(text);
  assert_int_equal(model->material_count, 1000);
  for (int i = 0; i < 2000; i++) {
    char name[16];
    sprintf(name, "m%d", (i * 7) % 1000);
    assert_string_equal(model->material_names[model->meshes[0].face_materials[i]], name);
  }
  tw_model_destroy(model);
  free(text);
}

TEST(more_materials_than_are_read_are_refused) {
  char *text = malloc(32 * (TW_MATERIALS_MAX + 1) + 100);
  assert_non_null(text);
  size_t length = (size_t)sprintf(text, TRIANGLE "f 1 2 3\n");
  for (int i = 0; i < TW_MATERIALS_MAX; i++) length += (size_t)sprintf(text + length, "usemtl m%d\n", i);
  sprintf(text + length, "usemtl m0\n");
  tw_model *model = read_good(text);
  assert_int_equal(model->material_count, TW_MATERIALS_MAX);
  tw_model_destroy(model);
  sprintf(text + length, "usemtl one\n");
  assert_refused(text, TW_LIMIT, TW_MATERIALS_MAX + 5);
  free(text);
}

/* The low bits of FNV-1a, by which the reader begins to look for a name, over the name and a blank. */
static uint32_t place_of(const char *name) {
  uint64_t value = 14695981039346656037u;
  for (const char *c = name; *c; c++) value = (value ^ (uint8_t)*c) * 1099511628211u;
  value = (value ^ ' ') * 1099511628211u;
  return (uint32_t)(value ^ value >> 32) & 1023;
}

TEST(names_that_were_made_to_collide_are_refused) {
  char text[257 * 24 + 100], name[16];
  size_t length = (size_t)sprintf(text, TRIANGLE "f 1 2 3\n"), count = 0;
  for (int i = 0; count < 257; i++) {
    sprintf(name, "m%d", i);
    if (place_of(name) != 7) continue;
    if (count++ == 256) {
      tw_model *model = read_good(text);
      assert_int_equal(model->material_count, 256);
      tw_model_destroy(model);
    }
    length += (size_t)sprintf(text + length, "usemtl %s\n", name);
  }
  assert_refused(text, TW_LIMIT, 0);
}

#define SECOND "v 5 0 0\nv 6 0 0\nv 5 1 0\n"

TEST(objects_that_share_no_point_become_meshes) {
  tw_model *model = read_good("o a\n" TRIANGLE "v 9 9 9\nvt 0 0\nvt 1 0\nf 1/2 2/2 3/1\no empty\no b\n" SECOND
                              "f 5/2 6/2 7/2\no last\n");
  assert_int_equal(model->mesh_count, 2);
  assert_int_equal(model->node_count, 2);
  assert_string_equal(model->meshes[0].name, "a");
  assert_string_equal(model->meshes[1].name, "b");
  const tw_mesh *mesh = &model->meshes[1];
  static const float positions[] = {5, 0, 0, 6, 0, 0, 5, 1, 0};
  static const uint32_t corners[] = {0, 1, 2}, uvs[] = {0, 0, 0};
  assert_int_equal(mesh->point_count, 3);
  assert_memory_equal(mesh->positions, positions, sizeof positions);
  assert_memory_equal(mesh->corners, corners, sizeof corners);
  assert_int_equal(mesh->uv_sets[0].value_count, 1);
  assert_memory_equal(mesh->uv_sets[0].corners, uvs, sizeof uvs);
  assert_true(mesh->uv_sets[0].values[0] == 1);
  tw_model_destroy(model);
}

TEST(points_that_objects_name_in_any_order_stay_in_the_files_order) {
  tw_model *model = read_good("v 0 0 0 1 0 0\nv 9 9 9\nv 5 0 0\nv 1 0 0\nv 6 0 0\nv 5 1 0 0 1 0\nv 0 1 0\n"
                              "o a\nf 7 4 1\no b\nf 3 6 5\n");
  static const float positions[2][9] = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {5, 0, 0, 6, 0, 0, 5, 1, 0}};
  static const uint32_t corners[2][3] = {{2, 1, 0}, {0, 2, 1}};
  assert_int_equal(model->mesh_count, 2);
  for (int i = 0; i < 2; i++) {
    assert_int_equal(model->meshes[i].point_count, 3);
    assert_memory_equal(model->meshes[i].positions, positions[i], sizeof positions[i]);
    assert_memory_equal(model->meshes[i].corners, corners[i], sizeof corners[i]);
  }
  assert_true(model->meshes[0].attributes[0].values[0] == 1 && model->meshes[0].attributes[0].values[1] == 0);
  assert_true(model->meshes[1].attributes[0].values[8] == 0 && model->meshes[1].attributes[0].values[9] == 1);
  assert_true(model->meshes[1].attributes[0].values[0] == 1 && model->meshes[1].attributes[0].values[1] == 1);
  tw_model_destroy(model);
}

TEST(objects_have_the_texture_of_their_own_faces) {
  tw_model *model =
      read_good("o a\n" TRIANGLE SECOND "v 7 7 7\nvt 0.1\nvt 0.2\nvt 0.3\nf 1/3 2 3/1\nf 3/1 2/3 1\n"
                "o b\nf 4 5 6\nf 4 6 7\n");
  assert_int_equal(model->mesh_count, 2);
  const tw_uv_set *set = &model->meshes[0].uv_sets[0];
  static const uint32_t corners[] = {0, 2, 1, 1, 0, 2}, offsets[] = {0, 3, 6};
  assert_int_equal(set->value_count, 3);
  assert_memory_equal(set->corners, corners, sizeof corners);
  assert_true(set->values[0] == 0.3f && set->values[2] == 0.1f && set->values[4] == 0);
  for (int i = 0; i < 2; i++) assert_memory_equal(model->meshes[i].face_offsets, offsets, sizeof offsets);
  assert_int_equal(model->meshes[1].uv_set_count, 0);
  tw_model_destroy(model);
}

TEST(objects_that_share_a_point_stay_one_mesh) {
  tw_model *model = read_good("o a\n" TRIANGLE "f 1 2 3\no b\n" SECOND "f 3 4 5\n");
  assert_int_equal(model->mesh_count, 1);
  assert_string_equal(model->meshes[0].name, "a");
  assert_int_equal(model->meshes[0].point_count, 6);
  tw_model_destroy(model);
}

TEST(tagged_files_stay_one_mesh) {
  tw_model *model = read_good("o a\n" TRIANGLE "f 1 2 3\no b\n" SECOND "f 4 5 6\nt corner 1/1/0 4 2\n");
  assert_int_equal(model->mesh_count, 1);
  assert_int_equal(model->meshes[0].sharp_points[0], 4);
  tw_model_destroy(model);
}

/* ---- tags ------------------------------------------------------------------------------------ */

TEST(tags_reach_the_mesh) {
  tw_model *model =
      read_good(SQUARE "f 1 2 3 4\nt crease 2/1/0 0 1 2.5\nt crease 4/2/0 1 2 2 3 1 20\n"
                       "t corner 2/1/0 0 1 -3\nt hole 1/0/0 0\nt interpolateboundary 1/0/0 2\n"
                       "t facevaryinginterpolateboundary 1/0/0 5\nt creasemethod 0/0/1 chaikin\n"
                       "t smoothtriangles 0/0/1 smooth\nt vertexedit 1/1/1 0 1 a\n");
  const tw_mesh *mesh = &model->meshes[0];
  static const uint32_t edges[] = {0, 1, 1, 2, 2, 3};
  static const float sharpness[] = {2.5f, 1, 10};
  assert_int_equal(mesh->crease_count, 3);
  assert_memory_equal(mesh->crease_edges, edges, sizeof edges);
  assert_memory_equal(mesh->crease_sharpness, sharpness, sizeof sharpness);
  assert_int_equal(mesh->sharp_point_count, 2);
  assert_int_equal(mesh->sharp_points[1], 1);
  assert_true(mesh->point_sharpness[1] == 0);
  assert_int_equal(mesh->hole_count, 1);
  assert_int_equal(mesh->holes[0], 0);
  assert_int_equal(mesh->tag_boundary, TW_BOUNDARY_EDGE_ONLY);
  assert_int_equal(mesh->tag_uv, TW_UV_ALL);
  assert_int_equal(mesh->tag_creasing, TW_CREASE_CHAIKIN);
  assert_int_equal(mesh->tag_triangles, TW_TRIANGLES_SMOOTH);
  assert_int_equal(model->warning_count, 2); /* and vertexedit */
  assert_string_equal(model->warnings[0], "1 crease or corner has a sharpness below 0, in line 8: it is 0");
  tw_model_destroy(model);
}

TEST(files_without_tags_leave_them_unset) {
  tw_model *model = read_good(TRIANGLE "f 1 2 3\n");
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->tag_boundary, TW_TAG_UNSET);
  assert_int_equal(mesh->tag_uv, TW_TAG_UNSET);
  assert_int_equal(mesh->tag_creasing, TW_TAG_UNSET);
  assert_int_equal(mesh->tag_triangles, TW_TAG_UNSET);
  tw_model_destroy(model);
}

TEST(corners_at_the_same_point_go_and_so_do_faces_without_three) {
  tw_model *model = read_good("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
                              "f 1 1 2\nf 1/1 2/2 2/1 3/3\nf 1 2 1\nf 1 2 3 4\nf 4 4 4 4\n"
                              "t hole 3/0/0 0 1 3\n");
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->face_count, 2);
  assert_int_equal(mesh->corner_count, 7);
  assert_int_equal(mesh->uv_sets[0].corners[2], 2); /* the doubled corner's went with it */
  assert_int_equal(mesh->hole_count, 2);
  assert_int_equal(mesh->holes[0], 0);
  assert_int_equal(mesh->holes[1], 1);
  assert_int_equal(model->warning_count, 3); /* and corners without a texture coordinate */
  assert_non_null(strstr(model->warnings[0], "3 faces with fewer than three"));
  assert_string_equal(model->warnings[1], "1 face names a point twice in a row: it keeps it once");
  tw_model_destroy(model);
}

/* A face of two corners, or of none, is as one of two points: left out, and it keeps its number for tags. */
TEST(faces_of_fewer_than_three_corners_are_left_out) {
  tw_model *model = read_good(SQUARE "f 1 2\nf 1 2 3\nf\nf 1 3 4\nt hole 1/0/0 3\n");
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->face_count, 2);
  assert_int_equal(mesh->corner_count, 6);
  assert_int_equal(mesh->hole_count, 1);
  assert_int_equal(mesh->holes[0], 1);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0], "2 faces with fewer than three different points are left out");
  tw_model_destroy(model);
}

TEST(control_characters_are_blanks) {
  static const char text[] = "o box\0\nv\t0 0 0\0\n\0\nv 1 0 0\nv 0\v1 0\nf 1 2 3\0\n\x1A";
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(read_bytes(text, sizeof text - 1, &model, &error), TW_OK);
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_string_equal(model->meshes[0].name, "box");
  tw_model_destroy(model);
}

TEST(points_without_faces_and_zero_bytes_at_the_end_are_read) {
  static const char text[] = "v 0 0 0\nv 1 0 0\nl 1 2\n\0\0\0";
  tw_model *model = NULL;
  tw_error error;
  assert_int_equal(tw_obj_read((const uint8_t *)text, sizeof text, TW_WELD_AUTO, &model, &error), TW_OK);
  assert_int_equal(model->meshes[0].point_count, 2);
  assert_int_equal(model->meshes[0].face_count, 0);
  tw_model_destroy(model);
}

/* Of eight corners without a texture coordinate one gets 0 0: the others are doubled, of a face that is
 * dropped, or of a mesh that has none. */
TEST(corners_that_get_0_0_for_a_texture_coordinate_are_counted) {
  tw_model *model =
      read_good("o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1/1 3 3 2/1\nf 1 1 2\n"
                "o b\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 4 5 6\n");
  assert_int_equal(model->warning_count, 3); /* a doubled corner, a face of two points */
  assert_string_equal(model->warnings[2], "1 face corner has no texture coordinate and gets 0 0");
  tw_model_destroy(model);
}

TEST(indices_of_values_that_a_file_has_none_of_are_left_out) {
  tw_model *model = read_good("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1 2/2/2 3/3\n");
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_int_equal(model->meshes[0].uv_set_count, 0);
  assert_int_equal(model->warning_count, 2);
  assert_string_equal(model->warnings[0],
                      "3 face corners name a texture coordinate, but the file has no vt: left out");
  assert_string_equal(model->warnings[1], "2 face corners name a normal, but the file has no vn: left out");
  tw_model_destroy(model);
}

TEST(points_of_a_bad_file_leave_the_outputs_alone) {
  float own = 1, *points = &own;
  uint32_t count = 7;
  tw_arena *arena = tw_arena_create();
  tw_error error;
  static const char text[] = "v 0 0 0\nv 1 0 0\nf 1 2 3\n";
  assert_int_equal(tw_obj_read_points((const uint8_t *)text, sizeof text - 1, (double[3]){0}, arena, &points,
                                      &count, &error),
                   TW_INVALID);
  assert_ptr_equal(points, &own);
  assert_int_equal(count, 7);
  assert_int_equal(
      tw_obj_read_points((const uint8_t *)text, 16, (double[3]){0}, arena, &points, &count, &error), TW_OK);
  assert_int_equal(count, 2);
  assert_float_equal(points[3], 1, 0);
  tw_arena_destroy(arena);
}
