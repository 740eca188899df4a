/* PLY: bad headers and bodies, the three forms, colours and texture coordinates. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"
#include "tweend/format.h"

#define HEADER(format, vertices, faces)                                                                      \
  "ply\nformat " format " 1.0\ncomment any text\nelement vertex " vertices "\nproperty float x\n"            \
  "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"      \
  "element face " faces "\nproperty list uchar int vertex_indices\nend_header\n"

static tw_status read_bytes(const void *bytes, size_t size, tw_model **out, tw_error *error) {
  *out = NULL;
  memset(error, 0, sizeof *error);
  assert_int_equal(tw_format_sniff(bytes, size), TW_FORMAT_PLY);
  return tw_ply_read(bytes, size, TW_WELD_AUTO, out, error);
}

static tw_model *read_text(const char *text) {
  tw_model *model;
  tw_error error;
  tw_status status = read_bytes(text, strlen(text), &model, &error);
  assert_string_equal(status == TW_OK ? "" : error.detail, "");
  return model;
}

static void assert_refused(const char *text, tw_status status, const char *detail) {
  tw_model *model;
  tw_error error;
  assert_int_equal(read_bytes(text, strlen(text), &model, &error), status);
  if (!strstr(error.detail, detail)) fail_msg("%s", error.detail);
}

TEST(bad_headers_are_refused) {
  assert_refused("ply\n", TW_SYNTAX, "ends within its header");
  assert_refused("ply\nend_header\n", TW_SYNTAX, "no format");
  assert_refused("ply\nformat text 1.0\n", TW_SYNTAX, "format is not");
  assert_refused("ply\nproperty float x\n", TW_SYNTAX, "before the first element");
  assert_refused("ply\nelement vertex -1\n", TW_SYNTAX, "count below");
  assert_refused("ply\nelement vertex 1\nproperty quad x\n", TW_SYNTAX, "not known");
  assert_refused("ply\nelement face 1\nproperty list float int a\n", TW_SYNTAX, "not known");
  assert_refused("ply\nformat ascii 1.0\nend_header\n", TW_INVALID, "no element vertex");
}

TEST(bad_rows_are_refused) {
  assert_refused(HEADER("ascii", "4000000000", "0") "0 0 0\n", TW_SYNTAX, "too short");
  assert_refused(HEADER("ascii", "1", "0") "0 0 zero 1 1 1\n", TW_SYNTAX, "malformed");
  assert_refused(HEADER("ascii", "1", "0") "0 0 1e40 1 1 1\n", TW_INVALID, "vertex 0");
  assert_refused(HEADER("ascii", "1", "0") "0 0 nan 1 1 1\n", TW_INVALID, "vertex 0");
  assert_refused(HEADER("ascii", "1", "0") "0 0 -1.#IND 1 1 1\n", TW_INVALID, "vertex 0");
  assert_refused(HEADER("ascii", "1", "1") "0 0 1 1 1 1\n3 0 0 1\n", TW_INVALID, "face 0");
  assert_refused(HEADER("ascii", "1", "1") "0 0 1 1 1 1\n-3 0 0 0\n", TW_SYNTAX, "length of a list");
  assert_refused(HEADER("ascii", "1", "1") "0 0 1 1 1 1\n4000000000 0 0 0\n", TW_SYNTAX, "cut off");
  assert_refused(HEADER("binary_little_endian", "1", "0") "0123456789", TW_SYNTAX, "too short");
}

/* The warning has room for 159 bytes of names: one that would fill it to the last byte is counted, not cut.
 */
TEST(names_of_what_is_left_out_stay_whole) {
  for (int length = 1; length < 160; length++) {
    char text[500], name[160] = {0}, expected[220];
    memset(name, 'p', (size_t)length);
    snprintf(text, sizeof text,
             "ply\nformat ascii 1.0\nelement e 1\nproperty int k\nelement vertex 1\nproperty float x\n"
             "property float y\nproperty float z\nproperty float %s\nend_header\n1\n0 0 0 0\n",
             name);
    snprintf(expected, sizeof expected, ": e, vertex.%s", name);
    tw_model *model = read_text(text);
    const char *names = strstr(model->warnings[0], ": e");
    assert_non_null(names);
    assert_true(strcmp(names, expected) == 0 || strcmp(names, ": e and 1 more") == 0);
    tw_model_destroy(model);
  }
}

TEST(a_line_of_text_is_named) {
  const char *text = HEADER("ascii", "1", "0") "0 0 zero 1 1 1\n";
  tw_model *model;
  tw_error error;
  assert_int_equal(read_bytes(text, strlen(text), &model, &error), TW_SYNTAX);
  assert_int_equal(error.line, 14);
}

/* Two triangles over five vertices, of which two stand at the same place in two colours, and a vertex that
 * none uses. */
static const char square[] = HEADER(
    "ascii", "6", "3") "0 0 0 255 0 0\n1 0 0 0 255 0\r\n1 1 0 0 0 255\n1 1 0 9 9 9\n0 1 0 188 188 188\n"
                       "5 5 5 0 0 0\n3 0 1 2\n4 0 3 4 4\n2 0 1\n";

static void assert_square(const tw_model *model) {
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->face_count, 2);
  assert_int_equal(mesh->corner_count, 6);
  assert_int_equal(mesh->point_count, 5);
  assert_int_equal(mesh->corners[2], mesh->corners[4]);
  assert_int_equal(model->warning_count, 3); /* an unused point, a face of two points, a doubled corner */
  const tw_attribute *color = mesh->attributes;
  assert_non_null(color->corners);
  assert_float_equal(color->values[4 * color->corners[0]], 1, 0);
  assert_float_equal(color->values[4 * color->corners[2] + 2], 1, 0);
  assert_float_equal(color->values[4 * color->corners[4]], 0.002731743, 1e-7); /* linear of 9 / 255 */
  assert_float_equal(color->values[4 * color->corners[5]], 0.5028865, 1e-6);   /* and of 188 / 255 */
  assert_float_equal(color->values[3], 1, 0);
  assert_int_equal(color->corners[0], color->corners[3]);
}

TEST(text_is_welded_and_degenerate_faces_go) {
  tw_model *model = read_text(square);
  assert_square(model);
  tw_model_destroy(model);
}

/* As of OBJ, STL and BVH: some editors put one before UTF-8. */
TEST(text_may_begin_with_a_byte_order_mark) {
  char text[sizeof square + 3] = "\xEF\xBB\xBF";
  strcat(text, square);
  tw_model *model = read_text(text);
  assert_square(model);
  tw_model_destroy(model);
}

static uint8_t *put(uint8_t *out, const void *value, size_t size, bool reverse) {
  const uint8_t *bytes = value;
  for (size_t i = 0; i < size; i++) *out++ = bytes[reverse ? size - 1 - i : i];
  return out;
}

/* The rows of the square in binary. */
static size_t binary_square(uint8_t *out, bool big) {
  static const char *const headers[] = {HEADER("binary_little_endian", "6", "3"),
                                        HEADER("binary_big_endian", "6", "3")};
  static const float points[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 0}, {0, 1, 0}, {5, 5, 5}};
  static const uint8_t colors[6][3] = {{255}, {0, 255}, {0, 0, 255}, {9, 9, 9}, {188, 188, 188}, {0}};
  static const int32_t faces[3][5] = {{3, 0, 1, 2}, {4, 0, 3, 4, 4}, {2, 0, 1}};
  uint8_t *at = put(out, headers[big], strlen(headers[big]), false);
  for (int v = 0; v < 6; v++) {
    for (int c = 0; c < 3; c++) at = put(at, &points[v][c], 4, big);
    at = put(at, colors[v], 3, false);
  }
  for (int f = 0; f < 3; f++) {
    *at++ = (uint8_t)faces[f][0];
    for (int k = 1; k <= faces[f][0]; k++) at = put(at, &faces[f][k], 4, big);
  }
  return (size_t)(at - out);
}

TEST(both_byte_orders_read_as_text_does) {
  uint8_t bytes[2000];
  for (int big = 0; big < 2; big++) {
    tw_model *model;
    tw_error error;
    size_t size = binary_square(bytes, big);
    assert_int_equal(read_bytes(bytes, size, &model, &error), TW_OK);
    assert_square(model);
    tw_model_destroy(model);
    for (size_t cut = 1; cut < 40; cut++)
      assert_int_equal(read_bytes(bytes, size - cut, &model, &error), TW_SYNTAX);
  }
}

TEST(texture_coordinates_stay_split_where_points_are_welded) {
  tw_model *model =
      read_text("ply\nformat ascii 1.0\nelement vertex 6\nproperty double x\nproperty double y\n"
                "property double z\nproperty float s\nproperty float t\n"
                "property list uchar float others\nelement face 2\n"
                "property uchar flags\nproperty list uchar uint vertex_index\n"
                "element edge 1\nproperty int a\nend_header\n"
                "0 0 0 0 0 0\n1 0 0 1 0 2 7 7\n0 1 0 0 1 0\n1 0 0 0.5 0 0\n1 1 0 1 1 0\n0 1 0 0 1 0\n"
                "1 3 0 1 2\n1 3 3 4 5\n1\n");
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->point_count, 4);
  assert_int_equal(mesh->uv_set_count, 1);
  assert_int_equal(mesh->uv_sets[0].value_count, 6);
  assert_float_equal(mesh->uv_sets[0].values[2 * mesh->uv_sets[0].corners[3]], 0.5, 0);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0],
                      "elements and properties that are left out: vertex.others, face.flags, edge");
  tw_model_destroy(model);
}

/* Every type of index and count, normals, colours of 16 bits with alpha, in all three forms. */
TEST(indices_of_every_type_normals_and_alpha_are_read) {
  static const struct {
    const char *name;
    size_t size;
  } types[] = {{"char", 1}, {"uint8", 1}, {"int16", 2}, {"ushort", 2}, {"int32", 4}, {"uint", 4}};
  static const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  static const double points[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  static const float up[3] = {0, 0, 1};
  static const uint16_t color[4] = {65535, 0, 0, 13107};
  for (size_t type = 0; type < 6; type++)
    for (int form = 0; form < 3; form++) {
      uint8_t bytes[2000], *at = bytes;
      bool big = form == 2;
      at += sprintf((char *)at,
                    "ply \r\nformat %s 1.0\r\nelement vertex 3\r\nproperty double x\r\nproperty double y\r\n"
                    "property double z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\n"
                    "property ushort red\r\nproperty ushort green\r\nproperty ushort blue\r\n"
                    "property ushort alpha\r\nelement face 1\r\nproperty list %s %s vertex_index\r\n"
                    "end_header\r\n",
                    formats[form], types[type].name, types[5 - type].name);
      for (int v = 0; v < 3 && form > 0; v++) {
        for (int c = 0; c < 3; c++) at = put(at, &points[v][c], 8, big);
        for (int c = 0; c < 3; c++) at = put(at, &up[c], 4, big);
        for (int c = 0; c < 4; c++) at = put(at, &color[c], 2, big);
      }
      for (uint32_t i = 0, row[4] = {3, 0, 1, 2}; i < 4 && form > 0; i++) {
        size_t size = types[i == 0 ? type : 5 - type].size;
        for (size_t k = 0; k < size; k++) *at++ = (uint8_t)(row[i] >> 8 * (big ? size - 1 - k : k));
      }
      for (int v = 0; v < 3 && form == 0; v++)
        at += sprintf((char *)at, "%g %g %g 0 0 1 65535 0 0 13107\r\n", points[v][0], points[v][1],
                      points[v][2]);
      if (form == 0) at += sprintf((char *)at, "3 0 1 2");
      tw_model *model;
      tw_error error;
      assert_int_equal(read_bytes(bytes, (size_t)(at - bytes), &model, &error), TW_OK);
      const tw_mesh *mesh = &model->meshes[0];
      assert_int_equal(mesh->face_count, 1);
      assert_float_equal(mesh->positions[3], 1, 0);
      assert_float_equal(mesh->normals.values[2], 1, 0);
      assert_float_equal(mesh->attributes[0].values[0], 1, 0);
      assert_float_equal(mesh->attributes[0].values[3], 0.2, 1e-6);
      assert_int_equal(model->warning_count, 0);
      tw_model_destroy(model);
    }
}

TEST(points_alone_are_a_model_without_faces) {
  tw_model *model = read_text(HEADER("ascii", "2", "0") "0 0 0 1 1 1\n1 2 3 1 1 1\n");
  assert_int_equal(model->meshes[0].face_count, 0);
  assert_int_equal(model->meshes[0].point_count, 2);
  tw_model_destroy(model);
}

#define PLACES(count)                                                                                        \
  "ply\nformat ascii 1.0\nelement vertex " count "\nproperty float x\nproperty float y\nproperty float z\n"

/* MeshLab's texture coordinates of wedges: two numbers for each corner, before or behind the corners, and in
 * place of those of vertices. */
TEST(texture_coordinates_of_corners_are_read) {
  static const float wanted[7][2] = {{0, 0}, {1, 0}, {1, 1}, {0.5f, 0}, {1, 0.5f}, {1, 1}, {0, 1}};
  for (int order = 0; order < 2; order++) {
    char text[1000];
    snprintf(text, sizeof text,
             PLACES("5") "property float s\nproperty float t\nelement face 2\nproperty list uchar %s\n"
                         "property list uchar %s\nend_header\n"
                         "0 0 0 9 9\n1 0 0 9 9\n1 1 0 9 9\n0 1 0 9 9\n2 0 0 9 9\n%s\n%s\n",
             order ? "float texcoord" : "int vertex_indices", order ? "int vertex_indices" : "float texcoord",
             order ? "6 0 0 1 0 1 1 3 0 1 2" : "3 0 1 2 6 0 0 1 0 1 1",
             order ? "8 0.5 0 1 0.5 1 1 0 1 4 0 2 3 4" : "4 0 2 3 4 8 0.5 0 1 0.5 1 1 0 1");
    tw_model *model = read_text(text);
    const tw_uv_set *set = &model->meshes[0].uv_sets[0];
    assert_int_equal(model->meshes[0].uv_set_count, 1);
    assert_int_equal(set->value_count, 7); /* 1 1 at two points is two values */
    for (int c = 0; c < 7; c++)
      assert_memory_equal(set->values + 2 * (size_t)set->corners[c], wanted[c], sizeof wanted[c]);
    assert_int_equal(model->warning_count, 1);
    assert_string_equal(model->warnings[0], "elements and properties that are left out: vertex.s, vertex.t");
    tw_model_destroy(model);
  }
}

/* A face without its two numbers a corner has 0 0, however many numbers it has. */
TEST(faces_with_other_numbers_of_texture_coordinates_have_0_0) {
  static const char *const lists[] = {"0", "2 5 5", "8 5 5 5 5 5 5 5 5", "13 5 5 5 5 5 5 5 5 5 5 5 5 5"};
  for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
    char text[1000];
    snprintf(text, sizeof text,
             PLACES("3") "element face 2\nproperty list uchar float texcoord\nproperty list uchar int "
                         "vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n%s 3 0 1 2\n6 0 0 1 0 0 1 3 0 2 1\n",
             lists[i]);
    tw_model *model = read_text(text);
    const tw_uv_set *set = &model->meshes[0].uv_sets[0];
    for (int c = 0; c < 3; c++) {
      assert_float_equal(set->values[2 * (size_t)set->corners[c]], 0, 0);
      assert_float_equal(set->values[2 * (size_t)set->corners[c] + 1], 0, 0);
    }
    assert_float_equal(set->values[2 * (size_t)set->corners[4]], 1, 0);
    assert_int_equal(model->warning_count, 1);
    assert_string_equal(model->warnings[0],
                        "1 face has texture coordinates 0 0: it has not two numbers a corner");
    tw_model_destroy(model);
  }
}

TEST(colours_of_faces_are_read) {
  tw_model *model = read_text(PLACES("6") "element face 2\nproperty uchar red\nproperty list uchar int "
                                          "vertex_indices\nproperty uchar green\nproperty uchar blue\n"
                                          "end_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 1\n0 1 1\n"
                                          "255 3 0 1 2 0 0\n0 3 3 4 5 188 255\n");
  static const float wanted[2][4] = {{1, 0, 0, 1}, {0, 0.5028865f, 1, 1}};
  const tw_mesh *mesh = &model->meshes[0];
  assert_int_equal(mesh->attribute_count, 1);
  for (uint32_t c = 0; c < 6; c++)
    for (uint32_t k = 0; k < 4; k++)
      assert_float_equal(mesh->attributes[0].values[4 * mesh->corners[c] + k], wanted[c / 3][k], 1e-6);
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
}

TEST(colours_beyond_one_are_told) {
  tw_model *model =
      read_text(PLACES("3") "property float red\nproperty float green\nproperty float blue\n"
                            "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                            "0 0 0 2 0 0\n1 0 0 0 -1 1\n0 1 0 1 1 1\n3 0 1 2\n");
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0], "2 numbers of colours are brought into 0 to 1");
  tw_model_destroy(model);
}

/* Floats that are whole and not all 0 or 1 are of 255: of vertices; of faces, beside a strip, which is white.
 */
TEST(colours_of_floats_up_to_255_are_divided) {
  tw_model *model =
      read_text(PLACES("3") "property float red\nproperty float green\nproperty float blue\n"
                            "property float alpha\nelement face 1\nproperty list uchar int vertex_indices\n"
                            "end_header\n0 0 0 255 188 0 255\n1 0 0 255 188 0 255\n0 1 0 255 188 0 255\n"
                            "3 0 1 2\n");
  static const float wanted[4] = {1, 0.5028865f, 0, 1};
  for (uint32_t k = 0; k < 4; k++)
    assert_float_equal(model->meshes[0].attributes[0].values[k], wanted[k], 1e-6);
  assert_int_equal(model->warning_count, 1);
  assert_string_equal(model->warnings[0],
                      "12 numbers of colours are divided by 255: all are whole, some over 1");
  tw_model_destroy(model);
  model = read_text(PLACES("6") "element face 1\nproperty list uchar int vertex_indices\nproperty float red\n"
                                "property float green\nproperty float blue\nelement tristrips 1\n"
                                "property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
                                "0 0 1\n1 0 1\n0 1 1\n3 0 1 2 255 188 0\n3 3 4 5\n");
  const tw_mesh *mesh = &model->meshes[0];
  for (uint32_t c = 0; c < 6; c++)
    for (uint32_t k = 0; k < 4; k++)
      assert_float_equal(mesh->attributes[0].values[4 * mesh->corners[c] + k], c < 3 ? wanted[k] : 1, 1e-6);
  tw_model_destroy(model);
}

/* Strips turn each second triangle round; -1 begins another strip, and triangles without area join two. All
 * of a flat grid look up. */
TEST(strips_become_triangles) {
  tw_model *model =
      read_text(PLACES("6") "element tristrips 2\nproperty list int int vertex_indices\nend_header\n"
                            "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n"
                            "7 0 1 2 3 -1 2 3\n6 2 2 2 3 4 4\n");
  const tw_mesh *mesh = &model->meshes[0];
  static const uint32_t wanted[][3] = {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}};
  assert_int_equal(mesh->face_count, 3);
  for (uint32_t f = 0; f < 3; f++) {
    uint32_t of[3];
    for (int k = 0; k < 3; k++) {
      const float *p = mesh->positions + 3 * (size_t)mesh->corners[3 * f + (uint32_t)k];
      of[k] = (uint32_t)(p[0] + 2 * p[1]);
    }
    uint32_t turn = of[0] == wanted[f][0] ? 0 : of[1] == wanted[f][0] ? 1 : 2;
    for (uint32_t k = 0; k < 3; k++) assert_int_equal(of[(turn + k) % 3], wanted[f][k]);
  }
  tw_model_destroy(model);
}

TEST(what_a_ply_holds_beside_is_told) {
  tw_model *model =
      read_text("ply\nformat ascii 1.0\ncomment plain\ncomment TextureFile a.png\nobj_info by hand\n"
                "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
                "property uchar red\nproperty uchar alpha\nproperty float u\nelement face 1\n"
                "property list uchar int vertex_indices\nproperty uchar blue\nend_header\n"
                "0 0 0 1 2 3 4\n1 0 0 1 2 3 4\n0 1 0 1 2 3 4\n3 0 1 2 9\nmore");
  assert_int_equal(model->warning_count, 3);
  assert_string_equal(model->warnings[0], "elements and properties that are left out: vertex.nx, vertex.red, "
                                          "vertex.alpha, vertex.u, face.blue");
  assert_string_equal(model->warnings[1],
                      "2 lines of the header are left out, the first in line 4: pictures are other files");
  assert_string_equal(model->warnings[2], "4 bytes behind the last element are left out");
  tw_model_destroy(model);
}

/* Lines that end with CR alone, and data that begins with a byte that ends other lines. */
TEST(a_line_feed_behind_a_header_of_returns_is_data) {
  static const char header[] =
      "ply\rformat binary_little_endian 1.0\relement vertex 3\rproperty uchar x\r"
      "property uchar y\rproperty uchar z\relement face 1\rproperty list uchar uchar "
      "vertex_indices\rend_header\r";
  static const uint8_t rows[] = {10, 0, 0, 1, 0, 0, 0, 1, 0, 3, 0, 1, 2};
  uint8_t bytes[sizeof header - 1 + sizeof rows];
  memcpy(bytes, header, sizeof header - 1);
  memcpy(bytes + sizeof header - 1, rows, sizeof rows);
  tw_model *model;
  tw_error error;
  assert_int_equal(read_bytes(bytes, sizeof bytes, &model, &error), TW_OK);
  const float expected[9] = {10, 0, 0, 1, 0, 0, 0, 1, 0};
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_memory_equal(model->meshes[0].positions, expected, sizeof expected);
  assert_int_equal(model->warning_count, 0);
  tw_model_destroy(model);
}
