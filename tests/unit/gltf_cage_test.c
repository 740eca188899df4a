/* What extras.tweend of a glTF mesh says: read where it fits the mesh, else left out with a warning. */
#include "glb.h"

/* Two quads side by side, (0 1 4 3) and (1 2 5 4), as two fans, then what tags may name. */
enum { POSITIONS_SIZE = 72, INDICES_SIZE = 24, NUMBERS = 6 };

#define ACCESSOR(view, component, count)                                                                     \
  "{'bufferView':" #view ",'componentType':" #component ",'count':" #count ",'type':'SCALAR'}"

static const char document_text[] =
    "{'asset':{'version':'2.0'},'extensionsUsed':['FB_ngon_encoding'],'buffers':[{'byteLength':264}],"
    "'bufferViews':[{'buffer':0,'byteLength':72},{'buffer':0,'byteOffset':72,'byteLength':24},"
    "{'buffer':0,'byteOffset':96,'byteLength':24},{'buffer':0,'byteOffset':120,'byteLength':24},"
    "{'buffer':0,'byteOffset':144,'byteLength':24},{'buffer':0,'byteOffset':168,'byteLength':24},"
    "{'buffer':0,'byteOffset':192,'byteLength':24},{'buffer':0,'byteOffset':216,'byteLength':24},"
    "{'buffer':0,'byteOffset':240,'byteLength':24}],'accessors':[{'bufferView':0,'componentType':5126,"
    "'count':6,'type':'VEC3','min':[0,0,0],'max':[2,1,0]}," ACCESSOR(1, 5123, 12) "," /* 1: the triangles */
    ACCESSOR(2, 5125, 6) ","                                                          /* 2: 0 1 2 3 4 5 */
    ACCESSOR(3, 5125, 6) ","                                                          /* 3: 0 1 2 3 4 9 */
    ACCESSOR(4, 5125, 6) ","                                                          /* 4: 0 0 2 3 4 5 */
    ACCESSOR(5, 5126, 1) ","                                                          /* 5: 2.5 */
    ACCESSOR(6, 5126, 1) ","                                                          /* 6: not a number */
    ACCESSOR(2, 5125, 2) ","                                                          /* 7: 0 1 */
    ACCESSOR(7, 5125, 2) ","                                                          /* 8: 1 0 */
    ACCESSOR(3, 5125, 4) ","                                                          /* 9: 0 1 2 3 */
    ACCESSOR(8, 5125, 2) ","                                                          /* 10: 9 9 */
    ACCESSOR(2, 5125, 1) ","                                                          /* 11: 0 */
    ACCESSOR(4, 5125, 2) ","                                                          /* 12: 0 0 */
    ACCESSOR(
        1, 5123,
        6) "," /* 13: the first quad's triangles */
           "{'bufferView':0,'componentType':5126,'count':6,'type':'VEC2'},"
           "{'bufferView':2,'byteOffset':4,'componentType':5125,'count':2,'type':'SCALAR'}]," /* 14: UVs; 15:
                                                                                                 1 2 */
           "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':14},"
           "'indices':%d,'extensions':{'FB_ngon_encoding':{}}}],"
           "'extras':{'mine':1,'tweend':%s}}],'nodes':[{'mesh':0}]}";

/* indices: accessor of the triangles. tags: the text of extras.tweend. refusal: the pointer of the refusal
 * that is expected; or NULL. */
static tw_model *read_or_be_refused(int indices, const char *tags, const char *refusal) {
  static const float positions[6][3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
  static const uint16_t triangles[12] = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};
  static const uint32_t numbers[7][NUMBERS] = {
      {0, 1, 2, 3, 4, 5}, {0, 1, 2, 3, 4, 9}, {0, 0, 2, 3, 4, 5}, {0x40200000}, {0x7fc00000}, {1, 0}, {9, 9}};
  uint8_t bin[POSITIONS_SIZE + INDICES_SIZE + sizeof numbers];
  memcpy(bin, positions, POSITIONS_SIZE);
  memcpy(bin + POSITIONS_SIZE, triangles, INDICES_SIZE);
  memcpy(bin + POSITIONS_SIZE + INDICES_SIZE, numbers, sizeof numbers);
  char text[8192];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
  assert_true(snprintf(text, sizeof text, document_text, indices, tags) < (int)sizeof text);
#pragma GCC diagnostic pop
  if (!refusal) return glb_read(text, bin, sizeof bin);
  glb_refused(text, bin, sizeof bin, TW_INVALID, refusal);
  return NULL;
}

static tw_model *read_tagged(const char *tags) {
  return read_or_be_refused(1, tags, NULL);
}

TEST(tags_that_fit_make_the_cage) {
  tw_model *model =
      read_tagged("{'points':2,'faces':8,'starts':8,'creases':{'edges':7,'sharpness':5},"
                  "'corners':{'vertices':11,'sharpness':5},'groups':{'names':['a','b c'],'faces':7},"
                  "'rules':{'boundary':1,'creasing':1}}");
  const tw_mesh *mesh = model->meshes;
  const uint32_t corners[8] = {1, 2, 5, 4, 3, 0, 1, 4}; /* the second face, the first from its last corner */
  assert_int_equal(glb_warning_count(model), 0);
  assert_int_equal(mesh->face_count, 2);
  assert_memory_equal(mesh->corners, corners, sizeof corners);
  assert_int_equal(mesh->crease_count, 1);
  assert_int_equal(mesh->crease_edges[0], 0);
  assert_int_equal(mesh->crease_edges[1], 1);
  assert_true(mesh->crease_sharpness[0] == 2.5F);
  assert_int_equal(mesh->sharp_point_count, 1);
  assert_true(mesh->point_sharpness[0] == 2.5F);
  assert_int_equal(model->group_count, 2);
  assert_string_equal(model->group_names[mesh->face_groups[0]], "b c");
  assert_string_equal(model->group_names[mesh->face_groups[1]], "a");
  assert_int_equal(mesh->tag_boundary, 1);
  assert_int_equal(mesh->tag_creasing, 1);
  assert_int_equal(mesh->tag_uv, TW_TAG_UNSET);
  assert_null(strstr(mesh->preserved, "tweend")); /* said anew */
  assert_non_null(strstr(mesh->preserved, "\"mine\""));
  tw_model_destroy(model);
}

TEST(holes_are_faces_behind_the_others) {
  tw_model *model = read_tagged("{'points':2,'holes':[{'indices':13}]}");
  assert_int_equal(glb_warning_count(model), 0);
  assert_int_equal(model->meshes->face_count, 3);
  assert_int_equal(model->meshes->hole_count, 1);
  assert_int_equal(model->meshes->holes[0], 2);
  tw_model_destroy(model);
}

/* The mesh is then what it is without them. */
TEST(tags_that_do_not_fit_are_left_out_with_a_warning) {
  static const char *const bad[] = {
      "{}",
      "{'points':99}",
      "{'points':-1}",
      "{'points':'2'}",
      "{'points':1e300}",
      "{'points':0}",
      "{'points':1}",
      "{'points':3}",
      "{'points':4}",
      "{'points':7}",
      "{'points':5}",
      "{'points':2,'creases':{'edges':7}}",
      "{'points':2,'creases':{'sharpness':5}}",
      "{'points':2,'creases':{'edges':9,'sharpness':5}}",
      "{'points':2,'creases':{'edges':10,'sharpness':5}}",
      "{'points':2,'creases':{'edges':7,'sharpness':6}}",
      "{'points':2,'creases':{'edges':7,'sharpness':2}}",
      "{'points':2,'creases':{'edges':5,'sharpness':5}}",
      "{'points':2,'corners':{'vertices':7,'sharpness':5}}",
      "{'points':2,'faces':2}",
      "{'points':2,'faces':10}",
      "{'points':2,'faces':12}",
      "{'points':2,'starts':2}",
      "{'points':2,'starts':10}",
      "{'points':2,'groups':{'faces':7}}",
      "{'points':2,'groups':{'names':['a'],'faces':7}}",
      "{'points':2,'groups':{'names':[1,2],'faces':7}}",
      "{'points':2,'groups':{'names':['a','b'],'faces':2}}",
      "{'points':2,'holes':[1]}",
      "{'points':2,'holes':[{}]}",
      "{'points':2,'holes':[{'indices':7}]}",
      "{'points':2,'holes':[{'indices':3}]}",
      "{'points':2,'holes':[{'indices':0}]}",
      "{'points':2,'holes':[{'indices':13,'material':5}]}",
      "{'points':2,'values':{'TEXCOORD_0':7}}",
      "{'points':2,'values':{'TEXCOORD_0':5}}",
      "{'points':2,'values':{'TEXCOORD_0':99}}",
      "{'points':2,'values':{'_NONE':'2'}}",
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    tw_model *model = read_tagged(bad[i]);
    if (!warns_of(model, "extras.tweend of mesh 0 are left out")) fail_msg("%s: no warning", bad[i]);
    assert_int_equal(model->meshes->face_count, 2);
    assert_int_equal(model->meshes->crease_count, 0);
    assert_int_equal(model->meshes->sharp_point_count, 0);
    assert_int_equal(model->meshes->hole_count, 0);
    tw_model_destroy(model);
  }
}

TEST(extras_of_another_kind_are_left_out) {
  static const char *const others[] = {"5", "'text'", "[]", "null"};
  for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
    tw_model *model = read_tagged(others[i]);
    assert_true(warns_of(model, "/meshes/0/extras/tweend: left out"));
    assert_int_equal(model->meshes->face_count, 2);
    tw_model_destroy(model);
  }
}

/* The tags number all vertices of the accessor; the triangles use four of six. */
TEST(points_that_no_face_uses_are_refused) {
  read_or_be_refused(13, "{'points':2}", "/meshes/0/extras/tweend/points");
  read_or_be_refused(13, "{'points':2,'creases':{'edges':15,'sharpness':5}}",
                     "/meshes/0/extras/tweend/points");
}

/* Of vertices that share a value but not their point, or not the number itself. */
TEST(values_that_do_not_fit_are_left_out_with_a_warning) {
  static const char *const bad[] = {"{'points':2,'values':{'TEXCOORD_0':4}}",
                                    "{'points':2,'values':{'TEXCOORD_0':3}}"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    tw_model *model = read_tagged(bad[i]);
    assert_true(warns_of(model, "extras.tweend of mesh 0: the values of TEXCOORD_0 are left out"));
    assert_int_equal(model->meshes->uv_sets[0].value_count, 6);
    tw_model_destroy(model);
  }
  tw_model *model = read_tagged("{'points':2,'values':{'TEXCOORD_0':2,'_NONE':2}}");
  assert_int_equal(glb_warning_count(model), 0);
  assert_int_equal(model->meshes->uv_sets[0].value_count, 6);
  tw_model_destroy(model);
}
