/* Compressed buffer views: what the library encodes comes back, what breaks a rule is refused. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <meshoptimizer.h>

#include "glb.h"
#include "meshopt_read.h"
#include "test.h"

static const tw_meshopt_view points = {4, 12, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_NONE};
static const float positions[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.5f};
static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};

enum { ROOM = 512 };

static size_t encode_points(uint8_t *out) {
  return meshopt_encodeVertexBuffer(out, ROOM, positions, 4, 12);
}

TEST(views_decode_to_what_was_encoded) {
  uint8_t packed[ROOM];
  float floats[12];
  uint32_t wide[6];
  size_t size = encode_points(packed);
  assert_int_equal(tw_meshopt_decode(&points, packed, size, (uint8_t *)floats, NULL), TW_OK);
  assert_memory_equal(floats, positions, sizeof floats);
  const tw_meshopt_view faces = {6, 4, TW_MESHOPT_TRIANGLES, TW_MESHOPT_NONE};
  size = meshopt_encodeIndexBuffer(packed, ROOM, triangles, 6);
  assert_int_equal(tw_meshopt_decode(&faces, packed, size, (uint8_t *)wide, NULL), TW_OK);
  for (int i = 0; i < 6; i += 3) /* a triangle may begin with another of its corners */
    assert_int_equal(wide[i] + wide[i + 1] + wide[i + 2], triangles[i] + triangles[i + 1] + triangles[i + 2]);
  const tw_meshopt_view indices = {6, 4, TW_MESHOPT_INDICES, TW_MESHOPT_NONE};
  size = meshopt_encodeIndexSequence(packed, ROOM, triangles, 6);
  assert_int_equal(tw_meshopt_decode(&indices, packed, size, (uint8_t *)wide, NULL), TW_OK);
  assert_memory_equal(wide, triangles, sizeof wide);
}

TEST(views_that_break_a_rule_are_refused) {
  static const struct {
    tw_meshopt_view view;
    uint64_t size;
  } cases[] = {{{0, 12, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_NONE}, 0},
               {{4, 0, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_NONE}, 0},
               {{4, 10, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_NONE}, 40},
               {{4, 260, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_NONE}, 1040},
               {{4, 12, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_NONE}, 47},
               {{4, 12, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_OCTAHEDRAL}, 48},
               {{4, 4, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_QUATERNION}, 16},
               {{4, 4, TW_MESHOPT_TRIANGLES, TW_MESHOPT_NONE}, 16},
               {{6, 1, TW_MESHOPT_TRIANGLES, TW_MESHOPT_NONE}, 6},
               {{6, 4, TW_MESHOPT_INDICES, TW_MESHOPT_EXPONENTIAL}, 24},
               {{1ull << 62, 4, TW_MESHOPT_INDICES, TW_MESHOPT_NONE}, 0}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
    assert_int_equal(tw_meshopt_check(&cases[i].view, cases[i].size, NULL), TW_INVALID);
  assert_int_equal(tw_meshopt_check(&points, 48, NULL), TW_OK);
}

TEST(damaged_views_are_refused) {
  uint8_t packed[ROOM], out[48];
  size_t size = encode_points(packed);
  for (size_t cut = 0; cut < size; cut++) {
    uint8_t *exact = malloc(cut + 1);
    memcpy(exact, packed, cut);
    assert_int_equal(tw_meshopt_decode(&points, exact, cut, out, NULL), TW_INVALID);
    free(exact);
  }
}

/* The same points in version 1, as meshoptimizer 1.3 encodes them at level 3: columns without deltas and
 * literal ones, then the tail, whose last bytes are the modes of the channels: exclusive or, pairs of bytes,
 * bytes. */
static const uint8_t points_1[40] = {0xA1, 0xEA, 0xEA, 0xEA, 0, 0x7F, 0, 0x7F, 0, 0,    0x7F, 0, 0, 0,
                                     0,    0x7E, 0,    0,    0, 0,    0, 0,    0, 0,    0,    0, 0, 0,
                                     0,    0,    0,    0,    0, 0,    0, 0,    0, 0x12, 0x01, 0};

TEST(version_1_decodes_and_is_refused_where_damaged) {
  float floats[12];
  uint8_t *out = (uint8_t *)floats;
  assert_int_equal(tw_meshopt_decode(&points, points_1, sizeof points_1, out, NULL), TW_OK);
  assert_memory_equal(floats, positions, sizeof floats);
  for (size_t cut = 0; cut < sizeof points_1; cut++) {
    uint8_t *exact = malloc(cut + 1);
    memcpy(exact, points_1, cut);
    assert_int_equal(tw_meshopt_decode(&points, exact, cut, out, NULL), TW_INVALID);
    free(exact);
  }
  static const uint8_t modes[] = {0x03, 0x10, 0x21, 0xFF}; /* unknown, or turned where nothing is */
  uint8_t packed[sizeof points_1 + 1];
  memcpy(packed, points_1, sizeof points_1);
  for (size_t i = 0; i < sizeof modes; i++) {
    packed[sizeof points_1 - 1] = modes[i];
    assert_int_equal(tw_meshopt_decode(&points, packed, sizeof points_1, out, NULL), TW_INVALID);
  }
  memcpy(packed + 17, points_1 + 16, sizeof points_1 - 16); /* a byte too much before the tail */
  assert_int_equal(tw_meshopt_decode(&points, packed, sizeof packed, out, NULL), TW_INVALID);
}

TEST(colors_are_filtered_whatever_they_say) {
  /* Of meshoptimizer 1.3, with what its decoder makes of them; then nonsense: no range, and far beyond it. */
  static const uint8_t rows[5][4] = {{0x7F, 0x7F, 0, 0xFF},
                                     {0, 0, 0, 0x80},
                                     {0xCF, 0xA1, 0x2F, 0xC0},
                                     {0x10, 0x10, 0x10, 0},
                                     {0xFF, 0x7F, 0x80, 1}};
  static const uint8_t colors[5][4] = {
      {254, 127, 0, 255}, {0, 0, 0, 0}, {65, 254, 255, 128}, {255, 255, 0, 0}, {255, 255, 255, 0}};
  const tw_meshopt_view view = {5, 4, TW_MESHOPT_ATTRIBUTES, TW_MESHOPT_COLOR};
  uint8_t packed[ROOM], out[20];
  size_t size = meshopt_encodeVertexBuffer(packed, ROOM, rows, 5, 4);
  assert_int_equal(tw_meshopt_decode(&view, packed, size, out, NULL), TW_OK);
  assert_memory_equal(out, colors, sizeof out);
}

/* A GLB as gltfpack writes it: the second buffer holds nothing. */
static tw_status read_packed(uint32_t count, tw_model **out, tw_error *error) {
  static const char text[] =
      "{'asset':{'version':'2.0'},'extensionsUsed':['EXT_meshopt_compression'],"
      "'extensionsRequired':['EXT_meshopt_compression'],'meshes':[{'primitives':[{'attributes':{'POSITION':"
      "0},'indices':1}]}],'accessors':[{'bufferView':0,'componentType':5126,'count':4,'type':'VEC3',"
      "'min':[0,0,0],'max':[1,1,0.5]},{'bufferView':1,'componentType':5125,'count':6,'type':'SCALAR'}],"
      "'bufferViews':[{'buffer':1,'byteLength':48,'byteStride':12,'extensions':{'EXT_meshopt_compression':{"
      "'buffer':0,'byteLength':%zu,'byteStride':12,'count':%u,'mode':'ATTRIBUTES'}}},"
      "{'buffer':1,'byteOffset':48,'byteLength':24,'extensions':{'EXT_meshopt_compression':{'buffer':0,"
      "'byteOffset':%zu,'byteLength':%zu,'byteStride':4,'count':6,'mode':'TRIANGLES'}}}],"
      "'buffers':[{'byteLength':%zu},{'byteLength':72,'extensions':{'EXT_meshopt_compression':{'fallback':"
      "true}}}]}";
  uint8_t packed[ROOM];
  size_t first = encode_points(packed);
  size_t second = meshopt_encodeIndexBuffer(packed + first, ROOM - first, triangles, 6);
  char json[sizeof text + 64];
  snprintf(json, sizeof json, text, first, count, first, second, first + second);
  glb_file file = glb_build(json, packed, first + second);
  tw_status status = tw_gltf_read(file.bytes, file.size, TW_QUADS_NGON, TW_WELD_AUTO, 0, out, error);
  free(file.bytes);
  return status;
}

TEST(compressed_meshes_are_read) {
  tw_model *model = NULL;
  tw_error error = {0};
  if (read_packed(4, &model, &error) != TW_OK) fail_msg("%s %s", error.pointer, error.detail);
  assert_int_equal(model->meshes[0].point_count, 4);
  assert_int_equal(model->meshes[0].face_count, 2);
  assert_memory_equal(model->meshes[0].positions, positions, sizeof positions);
  tw_model_destroy(model);
  model = NULL;
  assert_int_equal(read_packed(5, &model, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/bufferViews/0");
}
