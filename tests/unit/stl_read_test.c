/* STL: bad input, both forms, and the closed-form counts of welded shapes. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "test.h"
#include "tweend/format.h"

static tw_model *read_text(const char *text) {
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(tw_format_sniff((const uint8_t *)text, strlen(text)), TW_FORMAT_STL);
  tw_status status =
      tw_stl_read((const uint8_t *)text, strlen(text), TW_QUADS_NGON, TW_WELD_AUTO, &model, &error);
  assert_string_equal(status == TW_OK ? "" : error.detail, "");
  return model;
}

static void assert_refused(const char *text, tw_status status, uint64_t line) {
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(
      tw_stl_read((const uint8_t *)text, strlen(text), TW_QUADS_NGON, TW_WELD_AUTO, &model, &error), status);
  assert_int_equal(error.line, line);
  assert_null(model);
}

static const float corners[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                    {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
static const int sides[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

/* A cube of 12 facets in binary, and 20 zero bytes behind it. Returns its bytes, malloc'ed. */
static uint8_t *binary_cube(size_t *size) {
  static const int fan[2][3] = {{0, 1, 2}, {0, 2, 3}};
  *size = 84 + 12 * 50;
  uint8_t *bytes = calloc(*size + 20, 1), *at = bytes + 84;
  memcpy(bytes, "solid by a tool that begins its header like text", 48);
  bytes[80] = 12;
  for (int f = 0; f < 12; f++, at += 50)
    for (int k = 0; k < 3; k++) memcpy(at + 12 + 12 * k, corners[sides[f / 2][fan[f % 2][k]]], 12);
  return bytes;
}

TEST(words_out_of_place_are_refused_with_their_line) {
  assert_refused("solid\nvertex 0 0 0\n", TW_SYNTAX, 2);
  assert_refused("solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n", TW_SYNTAX, 6);
  assert_refused("solid\nouter loop\nvertex 0 0\nendloop", TW_SYNTAX, 4);
  assert_refused("solid\nouter loop\nvertex 0 0 1x\n", TW_SYNTAX, 3);
  assert_refused("solid\nouter loop\nvertex 0 0 1e40\n", TW_INVALID, 3);
  assert_refused("solid\nouter loop\nvertex 0 nan 1\n", TW_INVALID, 3);
  assert_refused("solid\nouter loop\nvertex 0 0 1\n", TW_SYNTAX, 4);
  assert_refused("solid", TW_SYNTAX, 0);
  assert_refused("neither", TW_SYNTAX, 0);
}

/* As some programs of engineers write them: "end loop". */
TEST(ends_may_be_two_words) {
#define TWO_WORDS(name)                                                                                      \
  "solid " name "\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nend loop\n"     \
  "End Facet\nend solid " name "\n"
  tw_model *model = read_text(TWO_WORDS("a part"));
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_string_equal(model->meshes[0].name, "a part");
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
  model = read_text(TWO_WORDS("a") TWO_WORDS("end of b"));
  assert_int_equal(model->meshes[0].face_count, 1); /* listed twice */
  assert_string_equal(model->meshes[0].name, "a");
  tw_model_destroy(model);
  assert_refused("solid\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nend loop\n", TW_SYNTAX, 5);
  assert_refused("solid\nend loop\n", TW_SYNTAX, 2);
}

TEST(a_coordinate_of_binary_that_is_not_finite_is_refused) {
  size_t size;
  uint8_t *bytes = binary_cube(&size);
  const float bad = NAN;
  memcpy(bytes + 84 + 3 * 50 + 12, &bad, sizeof bad);
  tw_model *model = NULL;
  tw_error error;
  assert_int_equal(tw_stl_read(bytes, size, TW_QUADS_NGON, TW_WELD_AUTO, &model, &error), TW_INVALID);
  assert_non_null(strstr(error.detail, "facet 3"));
  free(bytes);
}

TEST(bytes_behind_the_facets_are_read_over_and_facets_cut_off_refused) {
  size_t size;
  uint8_t *bytes = binary_cube(&size);
  tw_model *model = NULL;
  tw_error error;
  bytes[0] = 'S'; /* no word of text */
  bytes[5] = '-';
  assert_int_equal(tw_format_sniff(bytes, size + 20), TW_FORMAT_STL);
  assert_int_equal(tw_stl_read(bytes, size + 20, TW_QUADS_NGON, TW_WELD_AUTO, &model, &error), TW_OK);
  assert_int_equal(model->meshes[0].face_count, 12);
  tw_model_destroy(model);
  model = NULL;
  assert_int_equal(tw_stl_read(bytes, size - 1, TW_QUADS_NGON, TW_WELD_AUTO, &model, &error), TW_SYNTAX);
  assert_null(model);
  free(bytes);
}

TEST(a_binary_cube_has_8_points_and_no_border) {
  size_t size;
  uint8_t *bytes = binary_cube(&size);
  tw_model *model = NULL;
  tw_error error;
  assert_int_equal(tw_format_sniff(bytes, size), TW_FORMAT_STL);
  assert_int_equal(tw_stl_read(bytes, size, TW_QUADS_NGON, TW_WELD_AUTO, &model, &error), TW_OK);
  tw_mesh_stats facts;
  assert_int_equal(tw_mesh_describe(&model->meshes[0], &facts, &error), TW_OK);
  assert_int_equal(facts.vertices, 8);
  assert_int_equal(facts.triangles, 12);
  assert_int_equal(facts.boundary_edges, 0);
  assert_int_equal(facts.euler_characteristic, 2);
  tw_mesh_stats_deinit(&facts);
  tw_model_destroy(model);
  free(bytes);
}

TEST(solids_of_text_are_one_mesh_named_after_the_first) {
  tw_model *model =
      read_text("SOLID two parts \r\n facet normal 0 0 1\r\n outer loop\r\n vertex 0 0 0\r\n"
                " vertex 1 0 0\r\n VERTEX 0 1e0 0\r\n endloop\r\n endfacet\r\nendsolid two parts\r\n"
                "solid\nfacet normal 0 0 1 outer loop vertex 1 0 0 vertex 1 1 0 vertex 0 1 0 "
                "endloop endfacet endsolid");
  assert_int_equal(model->mesh_count, 1);
  assert_string_equal(model->meshes[0].name, "two parts");
  assert_int_equal(model->meshes[0].face_count, 2);
  assert_int_equal(model->meshes[0].point_count, 4);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0], "1 solid is one mesh with the first one, and its name is left out");
  tw_model_destroy(model);
}

TEST(further_solids_are_counted_in_a_warning) {
#define FACET(z)                                                                                             \
  " facet outer loop vertex 0 0 " #z " vertex 1 0 " #z " vertex 0 1 " #z " endloop endfacet\nendsolid\n"
  tw_model *model = read_text(
      "solid T\xFCr\n" FACET(0) "solid left\n" FACET(1) "solid\n" FACET(2) "solid right\n" FACET(3));
  assert_string_equal(model->meshes[0].name, "T\xC3\xBCr");
  assert_int_equal(model->meshes[0].face_count, 4);
  assert_int_equal(model->warning_count, 2);
  assert_string_equal(model->warnings[0], "1 name is not UTF-8: it is read as Latin-1");
  assert_non_null(strstr(model->warnings[1], "3 solids are one mesh with the first"));
  tw_model_destroy(model);
}

TEST(facets_of_fewer_than_three_points_go_with_a_warning) {
  tw_model *model = read_text("solid\nouter loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop\n"
                              "outer loop vertex 1 0 0 vertex 0 0 0 vertex 0 0 0 endloop");
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "1 face"));
  tw_model_destroy(model);
}

TEST(an_empty_solid_is_a_model_without_faces) {
  tw_model *model = read_text("solid nothing\nendsolid nothing\n");
  assert_int_equal(model->meshes[0].face_count, 0);
  tw_model_destroy(model);
}

/* A tetrahedron; one facet is listed again from another corner, and one turned round, which is another face.
 */
TEST(a_facet_that_is_listed_twice_goes_with_a_warning) {
#define A    " vertex 0 0 0"
#define B    " vertex 1 0 0"
#define C    " vertex 0 1 0"
#define D    " vertex 0 0 1"
#define LOOP "outer loop"
#define TETRAHEDRON                                                                                          \
  "solid\n" LOOP A C B " endloop\n" LOOP A B D " endloop\n" LOOP B C D " endloop\n" LOOP C A D " endloop\n"
  tw_model *model = read_text(TETRAHEDRON LOOP D B C " endloop\n");
  tw_mesh_stats facts;
  assert_int_equal(tw_mesh_describe(model->meshes, &facts, NULL), TW_OK);
  assert_int_equal(facts.vertices, 4);
  assert_int_equal(facts.faces, 4);
  assert_int_equal(facts.boundary_edges, 0);
  assert_int_equal(facts.components, 1);
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "listed twice"));
  tw_mesh_stats_deinit(&facts);
  tw_model_destroy(model);
  model = read_text(TETRAHEDRON LOOP D C B " endloop\n");
  assert_int_equal(model->meshes[0].face_count, 5);
  tw_model_destroy(model);
}

/* ---- attribute bytes ------------------------------------------------------------------------- */

/* Two facets that share an edge, with these attributes and as many bytes behind each as `payload` says.
 * Returns the size. */
static size_t two_facets(uint8_t bytes[256], const char *header, const uint16_t attributes[2],
                         size_t payload) {
  static const float points[2][12] = {{0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0},
                                      {0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 0}};
  memset(bytes, 0, 256);
  memcpy(bytes, header, strlen(header));
  bytes[80] = 2;
  uint8_t *at = bytes + 84;
  for (int f = 0; f < 2; f++) {
    memcpy(at, points[f], sizeof points[f]);
    memcpy(at + 48, &attributes[f], 2);
    memset(at + 50, 'A', payload);
    at += 50 + payload;
  }
  return (size_t)(at - bytes);
}

static tw_model *read_facets(const char *header, uint16_t first, uint16_t second, size_t payload,
                             size_t more) {
  uint8_t bytes[256];
  tw_model *model = NULL;
  tw_error error = {0};
  size_t size = two_facets(bytes, header, (const uint16_t[]){first, second}, payload) + more;
  assert_int_equal(tw_format_sniff(bytes, size), TW_FORMAT_STL);
  assert_int_equal(tw_stl_read(bytes, size, TW_QUADS_NGON, TW_WELD_NONE, &model, &error), TW_OK);
  return model;
}

static void assert_color(const tw_model *model, uint32_t point, float r, float g, float b, float a) {
  const float want[4] = {r, g, b, a};
  assert_int_equal(model->meshes[0].attribute_count, 1);
  for (uint32_t k = 0; k < 4; k++)
    assert_float_equal(model->meshes[0].attributes[0].values[4 * point + k], want[k], 1e-6);
}

/* Linear of 16/31 and of 128/255, as three's STLLoader has them. */
#define HALF_OF_31  0.22927477f
#define HALF_OF_255 0.21586050f

TEST(facets_have_colours_as_viscam_writes_them) {
  tw_model *model = read_facets("", 0x8000 | 31 << 10 | 16, 31, 0, 0);
  assert_color(model, 0, 1, 0, HALF_OF_31, 1);
  assert_color(model, 2, 1, 0, HALF_OF_31, 1);
  assert_color(model, 3, 1, 1, 1, 1); /* without bit 15: none */
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0], "1 facet has attributes that are left out");
  tw_model_destroy(model);
}

TEST(facets_have_colours_as_magics_writes_them) {
  tw_model *model = read_facets("by hand COLOR=\xFF\x80\x01\x33", 16 << 10 | 31, 0x8000 | 31, 0, 0);
  assert_color(model, 0, 1, 0, HALF_OF_31, 0.2f);
  assert_color(model, 5, 1, HALF_OF_255, 0.00030353f, 0.2f); /* the header's: linear of 1/255 */
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
  model = read_facets("COLOR=\xFF\xFF\xFF\xFF,MATERIAL=abcdefghijkl", 31, 31, 0, 0);
  assert_int_equal(model->warning_count, 1);
  assert_non_null(strstr(model->warnings[0], "1 material of the header"));
  tw_model_destroy(model);
}

/* What stands behind the facets is told: bytes that attributes count, facets that the count does not. */
TEST(attributes_that_are_no_colours_are_told) {
  static const float second[] = {1, 0, 0, 1, 1, 0, 0, 1, 0};
  tw_model *model = read_facets("", 5, 5, 5, 0);
  assert_int_equal(model->meshes[0].attribute_count, 0);
  assert_memory_equal(model->meshes[0].positions + 9, second, sizeof second);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0], "2 facets have attributes that are left out");
  tw_model_destroy(model);
  model = read_facets("", 7, 0, 0, 3);
  assert_memory_equal(model->meshes[0].positions + 9, second, sizeof second);
  assert_int_equal(model->warning_count, 2);
  assert_string_equal(model->warnings[0], "1 facet has attributes that are left out");
  assert_string_equal(model->warnings[1], "3 bytes behind the facets are left out");
  tw_model_destroy(model);
}

TEST(nothing_is_read_behind_the_bytes) {
  enum { SIZE = 1 << 16, MOST = 2000 };
  const size_t page = (size_t)sysconf(_SC_PAGESIZE);
  void *memory;
  assert_int_equal(posix_memalign(&memory, page, SIZE + page), 0);
  memset(memory, 0, SIZE);
  uint8_t *end = (uint8_t *)memory + SIZE;
  assert_int_equal(mprotect(end, page, PROT_NONE), 0); /* reading it ends the program */
  for (size_t size = 0; size < MOST; size++)
    for (uint8_t count = 0; count < 3; count++) {
      if (size > 84) end[80 - (ptrdiff_t)size] = count;
      (void)tw_format_sniff(end - size, size);
      if (size > 84) end[80 - (ptrdiff_t)size] = 0;
    }
  assert_int_equal(mprotect(end, page, PROT_READ | PROT_WRITE), 0);
  free(memory);
}

TEST(facets_behind_a_count_too_small_are_told) {
  size_t size;
  uint8_t *bytes = binary_cube(&size);
  tw_model *model = NULL;
  tw_error error;
  bytes[0] = 'S';
  for (uint8_t count = 0; count < 12; count++) {
    bytes[80] = count;
    assert_int_equal(tw_format_sniff(bytes, size), TW_FORMAT_STL);
    assert_int_equal(tw_stl_read(bytes, size, TW_QUADS_NGON, TW_WELD_NONE, &model, &error), TW_OK);
    assert_int_equal(model->meshes[0].face_count, count);
    assert_int_equal(model->warning_count, 1);
    assert_int_equal(atoi(model->warnings[0]), 12 - count);
    assert_non_null(strstr(model->warnings[0], "behind those that the file counts"));
    tw_model_destroy(model);
  }
  free(bytes);
}

TEST(normals_against_the_corners_and_words_that_stl_has_not_are_told) {
  tw_model *model =
      read_text("solid\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                "endloop\nendfacet\ncolor 1 0 0\nendsolid\n");
  assert_int_equal(model->warning_count, 2);
  assert_string_equal(model->warnings[0],
                      "1 normal of a facet points against the order of its corners, in line 7: "
                      "the order counts");
  assert_string_equal(model->warnings[1], "4 words are left out, the first in line 9: STL has none such");
  tw_model_destroy(model);
}

/* An L of two squares, each of two triangles as an exporter writes them: quads and the hard edge come back.
 */
TEST(facets_become_quads_with_hard_edges_where_they_are_bent) {
  static const float p[6][3] = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}, {0, 1, 1}, {2, 1, 1}};
  static const int facets[4][3] = {{0, 1, 2}, {0, 2, 3}, {3, 2, 5}, {3, 5, 4}};
  char text[1024], *at = text;
  at += sprintf(at, "solid s\n");
  for (int f = 0; f < 4; f++) {
    at += sprintf(at, "facet normal 0 0 0\nouter loop\n");
    for (int k = 0; k < 3; k++)
      at += sprintf(at, "vertex %g %g %g\n", (double)p[facets[f][k]][0], (double)p[facets[f][k]][1],
                    (double)p[facets[f][k]][2]);
    at += sprintf(at, "endloop\nendfacet\n");
  }
  strcpy(at, "endsolid s\n");
  for (int quads = TW_QUADS_USUAL; quads <= TW_QUADS_OFF; quads++) {
    tw_model *model = NULL;
    const uint8_t *bytes = (const uint8_t *)text;
    assert_int_equal(tw_stl_read(bytes, strlen(text), (tw_quads)quads, TW_WELD_AUTO, &model, NULL), TW_OK);
    bool is_joined = quads == TW_QUADS_USUAL || quads == TW_QUADS_AUTO;
    assert_int_equal(model->meshes->face_count, is_joined ? 2 : 4);
    assert_int_equal(model->meshes->joined_quads, is_joined ? 2 : 0);
    assert_int_equal(model->warning_count, is_joined);
    if (is_joined)
      assert_string_equal(model->warnings[0],
                          "2 pairs of triangles are joined into quads: quads=ngon keeps the triangles");
    tw_mesh_stats stats;
    assert_int_equal(tw_mesh_describe(model->meshes, &stats, NULL), TW_OK);
    assert_int_equal(stats.hard_edges.by_file, 1);
    tw_mesh_stats_deinit(&stats);
    tw_model_destroy(model);
  }
}
