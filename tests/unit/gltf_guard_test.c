/* What never reaches the glTF parser: lying containers, dear or deep JSON, data outside the file. */
#include "glb.h"

/* A byte of buffer 0 is read: a buffer that nothing reads is left out, whatever is wrong with it. */
#define READ_BYTE                                                                                            \
  ",'bufferViews':[{'buffer':0,'byteLength':1}],'accessors':[{'bufferView':0,'componentType':5121,"          \
  "'count':1,'type':'SCALAR'}]"

static tw_status read_bytes(const void *bytes, size_t size, tw_error *error) {
  tw_model *model = NULL;
  tw_status status = gltf_read_bytes(bytes, size, 0, &model, error);
  tw_model_destroy(model);
  return status;
}

static tw_status read_text(const char *json, tw_error *error) {
  tw_model *model = NULL;
  tw_status status = gltf_read(json, 0, &model, error);
  tw_model_destroy(model);
  return status;
}

/* ---- GLB ------------------------------------------------------------------------------------- */

TEST(lying_glb_lengths_are_refused) {
  static const uint8_t bin[4] = {1, 2, 3, 4};
  static const struct {
    size_t at;
    uint32_t value;
  } lies[] = {
      {4, 1},  {4, 3},           {8, 0},           {8, 19}, {8, UINT32_MAX},
      {12, 0}, {12, UINT32_MAX}, {12, 0xFFFFFFEC}, {12, 4}, {16, 0x004E4942},
      {48, 8}, {48, UINT32_MAX}, {52, 0x4E4F534A},
  };
  const char *json = "{" ASSET "}";
  assert_int_equal(strlen(json), 27); /* so that the BIN chunk begins at 48 */
  for (size_t i = 0; i < sizeof lies / sizeof *lies; i++) {
    glb_file file = glb_build(json, bin, 4);
    tw_error error;
    assert_int_equal(read_bytes(file.bytes, file.size, &error), TW_OK);
    glb_put_u32(file.bytes + lies[i].at, lies[i].value);
    tw_status status = read_bytes(file.bytes, file.size, &error);
    free(file.bytes);
    if (status == TW_OK) print_error("%u at %zu was believed\n", lies[i].value, lies[i].at);
    assert_true(status == TW_SYNTAX || status == TW_UNSUPPORTED);
  }
}

/* The end of such a value cannot be found in the text alone, so it must not be looked for. The text ends the
 * allocation. */
TEST(json_that_is_no_object_is_refused) {
  static const char *const texts[] = {"5", "1e3", "true", "null", "\"glTF\"", "[]", "[{}]"};
  tw_error error;
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
    assert_int_equal(read_bytes(texts[i], strlen(texts[i]), &error), TW_SYNTAX);
    glb_file file = glb_build(texts[i], NULL, 0);
    assert_int_equal(read_bytes(file.bytes, file.size, &error), TW_SYNTAX);
    free(file.bytes);
  }
}

TEST(a_glb_cut_anywhere_is_refused) {
  static const uint8_t bin[8] = {0};
  glb_file file = glb_build("{" ASSET ",'buffers':[{'byteLength':8}]" READ_BYTE "}", bin, 8);
  tw_error error;
  assert_int_equal(read_bytes(file.bytes, file.size, &error), TW_OK);
  for (size_t size = 0; size < file.size; size++) {
    glb_put_u32(file.bytes + 8, (uint32_t)size); /* an honest header must not help */
    assert_int_not_equal(read_bytes(file.bytes, size, &error), TW_OK);
  }
  free(file.bytes);
}

/* Blanks belong there. */
TEST(zeros_behind_the_json_text_are_told) {
  static const uint8_t bin[4] = {1, 2, 3, 4};
  for (int length = 1; length <= 4; length++) {
    char json[64];
    snprintf(json, sizeof json, "{" ASSET ",'nodes':[{'name':'%.*s'}]}", length, "long");
    glb_file file = glb_build(json, bin, sizeof bin);
    size_t used = 20 + strlen(json), end = (used + 3) / 4 * 4;
    memset(file.bytes + used, 0, end - used);
    tw_model *model = NULL;
    tw_error error = {0};
    assert_int_equal(gltf_read_bytes(file.bytes, file.size, 0, &model, &error), TW_OK);
    assert_int_equal(model->node_count, 1);
    assert_int_equal(warns_of(model, "behind the JSON text"), end > used);
    tw_model_destroy(model);
    free(file.bytes);
  }
  tw_error error = {0};
  assert_int_equal(read_bytes("{\"asset\":{\"version\":\"2.0\"}}\0\0", 29, &error), TW_OK);
  assert_int_equal(read_bytes("{\"asset\":{\"version\":\"2.0\"}}\0 ", 29, &error), TW_SYNTAX);
  assert_int_equal(read_bytes("\0\0\0\0", 4, &error), TW_SYNTAX);
}

TEST(more_chunks_may_follow_when_they_fit) {
  static const uint8_t bin[16] = {0};
  glb_file file = glb_build("{" ASSET "}", bin, 16);
  /* Splits the BIN chunk of 16 bytes into one of 4 and an unknown one of 4. */
  tw_error error;
  glb_put_u32(file.bytes + 48, 4);
  glb_put_u32(file.bytes + 60, 4);
  memcpy(file.bytes + 64, "MORE", 4);
  assert_int_equal(read_bytes(file.bytes, file.size, &error), TW_OK);
  glb_put_u32(file.bytes + 60, 8);
  assert_int_equal(read_bytes(file.bytes, file.size, &error), TW_SYNTAX);
  free(file.bytes);
}

/* ---- JSON ------------------------------------------------------------------------------------ */

TEST(malformed_json_is_a_syntax_error) {
  static const char *const texts[] = {
      "",
      "  ",
      "[]",
      "{",
      "{'asset'",
      "{" ASSET,
      "{" ASSET "}}",
      "{" ASSET "} x",
      "{" ASSET ",}",
      "{" ASSET ",'a' 1}",
      "{" ASSET ",'a':}",
      "{" ASSET ",'a':[1,]}",
      "{" ASSET ",'a':[1 2]}",
      "{" ASSET ",'a':'x}",
      "{" ASSET ",'a':'\\",
      "{" ASSET ",'a':'\n'}",
      "{" ASSET ",'a':tru}",
      "{" ASSET ",'a':nul",
      "{" ASSET ",'buffers':[],'buffers':[]}",
      "{" ASSET ",a:1}",
      "{" ASSET ",'a':'\xFF'}",
      "{" ASSET ",'a':'\\x'}",
      "{" ASSET ",'a':-}",
      "{" ASSET ",'a':01}",
  };
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
    tw_error error = {0};
    tw_status status = read_text(texts[i], &error);
    if (status != TW_SYNTAX) print_error("%s\n-> %d\n", texts[i], (int)status);
    assert_int_equal(status, TW_SYNTAX);
    assert_true(error.detail[0] != '\0');
  }
  tw_error error;
  assert_int_equal(read_bytes("{'asset':1}", 11, &error), TW_SYNTAX);
}

TEST(what_only_the_parser_notices_is_refused_too) {
  static const char *const texts[] = {
      "{'asset':{}}",
      "{'asset':{'version':2.0}}",
      "{" ASSET ",'a':1e999}",
      "{" ASSET ",'nodes':[1]}",
  };
  for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
    tw_error error = {0};
    tw_status status = read_text(texts[i], &error);
    if (status != TW_INVALID) print_error("%s\n-> %d\n", texts[i], (int)status);
    assert_int_equal(status, TW_INVALID);
    assert_true(error.detail[0] != '\0');
  }
}

TEST(nesting_is_bounded) {
  enum { DEPTH = 100000 };
  char *text = malloc(2 * DEPTH + 100);
  assert_non_null(text);
  for (int depth = 1; depth <= DEPTH; depth = depth < 80 ? depth + 1 : DEPTH + (depth == DEPTH)) {
    size_t length = (size_t)sprintf(text, "{" ASSET ",'extras':");
    memset(text + length, '[', (size_t)depth);
    memset(text + length + depth, ']', (size_t)depth);
    strcpy(text + length + 2 * depth, "}");
    tw_error error;
    assert_int_equal(read_text(text, &error), depth < 64 ? TW_OK : TW_SYNTAX);
  }
  free(text);
}

TEST(the_number_of_values_is_limited_where_asked) {
  const char *text = "{" ASSET ",'extras':[1,2,3]}";
  tw_model *model = NULL;
  tw_error error;
  assert_int_equal(gltf_read(text, 7, &model, &error), TW_OK);
  tw_model_destroy(model);
  assert_int_equal(gltf_read(text, 6, &model, &error), TW_LIMIT);
}

static char *repeat(const char *head, const char *part, size_t count, const char *tail) {
  size_t length = strlen(part);
  char *text = malloc(strlen(head) + count * length + strlen(tail) + 1);
  assert_non_null(text);
  char *at = stpcpy(text, head);
  for (size_t i = 0; i < count; i++, at += length) memcpy(at, part, length);
  strcpy(at, tail);
  return text;
}

TEST(json_that_is_dear_to_parse_is_refused_at_its_place) {
  static const struct {
    const char *head, *part, *tail, *pointer;
    size_t count;
  } cases[] = {
      {"'materials':[", "{},", "{}]", "/materials", 300000},
      {"'nodes':[", "{},", "{}]", "/nodes", 300000},
      {"'nodes':[", "{},", "{}]", NULL, 200000},
      {"'meshes':[{'primitives':[", "{'attributes':{}},", "{}]}]", "/meshes/0", 200000},
      {"'animations':[{'samplers':[],'channels':[", "{},", "{}]}]", "/animations/0/channels", 300000},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char head[128], tail[32];
    snprintf(head, sizeof head, "{" ASSET ",%s", cases[i].head);
    snprintf(tail, sizeof tail, "%s}", cases[i].tail);
    char *text = repeat(head, cases[i].part, cases[i].count, tail);
    tw_error error = {0};
    tw_status status = read_text(text, &error);
    free(text);
    if (status != TW_LIMIT) print_error("%s %d %s\n", cases[i].head, (int)status, error.detail);
    assert_int_equal(status, TW_LIMIT);
    if (cases[i].pointer) assert_string_equal(error.pointer, cases[i].pointer);
  }
}

TEST(what_is_not_read_costs_nothing) {
  tw_error error;
  char *numbers = repeat("[", "1,", 400000, "1]"), *text = malloc(strlen(numbers) + 200);
  assert_non_null(text);
  static const char *const places[] = {"'extras':%s", "'nodes':[{'extras':%s}]",
                                       "'materials':[{'extras':%s}]",
                                       ("'animations':[{'extensions':{'a':{'b':%s}},'channels':[],"
                                        "'samplers':[]}]")};
  for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
    size_t length = (size_t)sprintf(text, "{" ASSET ",");
    length +=
        (size_t)sprintf(text + length, places[i], numbers); /* NOLINT(clang-diagnostic-format-nonliteral) */
    strcpy(text + length, "}");
    assert_int_equal(read_text(text, &error), TW_OK);
  }
  free(text);
  free(numbers);
}

/* ---- data outside the file ------------------------------------------------------------------- */

TEST(nothing_outside_the_file_is_opened) {
  static const char *const uris[] = {"data.bin",
                                     "/etc/hostname",
                                     "file:///etc/hostname",
                                     "../../etc/hostname",
                                     "http://127.0.0.1/",
                                     "",
                                     "data:",
                                     "data:application/octet-stream,AAAA",
                                     "d\\u0061ta.bin"};
  for (size_t i = 0; i < sizeof uris / sizeof *uris; i++) {
    char text[512];
    snprintf(text, sizeof text, "{" ASSET ",'buffers':[{'byteLength':3,'uri':'%s'}]" READ_BYTE "}", uris[i]);
    tw_error error = {0};
    assert_int_equal(read_text(text, &error), TW_UNSUPPORTED);
    assert_string_equal(error.pointer, "/buffers/0/uri");
    glb_refused(text, "abc", 3, TW_UNSUPPORTED, "/buffers/0/uri");
  }
}

TEST(images_are_inside_the_file_or_on_the_web) {
  static const struct {
    const char *uri;
    tw_status status;
  } cases[] = {{"/etc/hostname", TW_UNSUPPORTED}, {"a%20b.png", TW_UNSUPPORTED}, {"", TW_UNSUPPORTED},
               {"file:///a.png", TW_UNSUPPORTED}, {"httpx://a", TW_UNSUPPORTED}, {"http://a/b.png", TW_OK},
               {"https:\\/\\/a\\/b.png", TW_OK}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char text[128];
    snprintf(text, sizeof text, "{" ASSET ",'images':[{'uri':'%s'}]}", cases[i].uri);
    tw_error error = {0};
    assert_int_equal(read_text(text, &error), cases[i].status);
    assert_string_equal(error.pointer, cases[i].status == TW_OK ? "" : "/images/0/uri");
  }
  tw_error error = {0};
  assert_int_equal(read_text("{" ASSET ",'images':[{'uri':{}}]}", &error), TW_UNSUPPORTED);
  assert_string_equal(error.pointer, "/images/0/uri");
}

TEST(buffers_and_views_must_lie_in_their_data) {
  static const struct {
    const char *json, *pointer;
    tw_status status;
  } cases[] = {
      {"'buffers':[{'byteLength':9}]" READ_BYTE, "/buffers/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':0}]" READ_BYTE, "/buffers/0/byteLength", TW_INVALID},
      {"'buffers':[{}]" READ_BYTE, "/buffers/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':-1}]", "/buffers/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':1.5}]", "/buffers/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':99999999999999999999}]", "/buffers/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':'8'}]", "/buffers/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':8,'byteLength':4}]", "/buffers/0/byteLength", TW_SYNTAX},
      {"'buffers':[{'byteLengt\\u0068':8}]", "/buffers/0", TW_UNSUPPORTED},
      {"'buffer\\u0073':[{'byteLength':8}]", "", TW_UNSUPPORTED},
      {"'buffers':[{'byteLength':8},{'byteLength':8}],'bufferViews':[{'buffer':1,'byteLength':8}],"
       "'accessors':[{'bufferView':0,'componentType':5121,'count':1,'type':'SCALAR'}]",
       "/buffers/1", TW_INVALID},
      {"'buffers':[{'byteLength':4,'uri':'data:application/octet-stream;base64,AAAA'}]" READ_BYTE,
       "/buffers/0/byteLength", TW_INVALID},
      {"'buffers':[3]", "/buffers/0", TW_INVALID},
      {"'buffers':{}", "/buffers", TW_INVALID},
      {"'meshes':[{'primitives':{}}]", "/meshes/0/primitives", TW_INVALID},
      {"'extensionsRequired':[1]", "/extensionsRequired/0", TW_INVALID},
      {"'bufferViews':[{'buffer':0,'byteLength':8}]", "/bufferViews/0/buffer", TW_INVALID},
      {"'buffers':[{'byteLength':8}],'bufferViews':[{'buffer':1,'byteLength':8}]", "/bufferViews/0/buffer",
       TW_INVALID},
      {"'buffers':[{'byteLength':8}],'bufferViews':[{'buffer':0,'byteLength':9}]",
       "/bufferViews/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':8}],'bufferViews':[{'buffer':0,'byteOffset':5,'byteLength':4}]",
       "/bufferViews/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':8}],'bufferViews':[{'buffer':0,'byteOffset':9007199254740991,"
       "'byteLength':9007199254740991}]",
       "/bufferViews/0/byteLength", TW_INVALID},
      {"'buffers':[{'byteLength':8}],'bufferViews':[{'buffer':0,'byteLength':8}],"
       "'images':[{'bufferView':1,'mimeType':'image/png'}]",
       "/images/0/bufferView", TW_INVALID},
      {"'images':[{'bufferView':99999999999}]", "/images/0/bufferView", TW_INVALID},
      {"'accessors':[{'bufferView':0,'componentType':5123,'count':3,'type':'SCALAR'}]",
       "/accessors/0/bufferView", TW_INVALID},
      {"'meshes':[{'primitives':[{'attributes':{}},{'attributes':{},'indices':0}]}]",
       "/meshes/0/primitives/1/indices", TW_INVALID},
      {"'accessors':[{'componentType':5123,'count':3,'type':'SCALAR'}],"
       "'meshes':[{'primitives':[{'attributes':{},'indices':0}]}]",
       "/accessors/0", TW_INVALID},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char text[1024];
    snprintf(text, sizeof text, "{" ASSET ",%s}", cases[i].json);
    glb_refused(text, "abcdefgh", 8, cases[i].status, cases[i].pointer);
  }
}

TEST(a_json_file_has_no_bin_chunk) {
  tw_error error = {0};
  assert_int_equal(read_text("{" ASSET ",'buffers':[{'byteLength':8}]" READ_BYTE "}", &error), TW_INVALID);
  assert_string_equal(error.pointer, "/buffers/0");
}

TEST(a_slash_in_a_data_uri_may_be_escaped) {
  tw_error error = {0};
  assert_int_equal(read_text("{" ASSET ",'buffers':[{'byteLength':3,'uri':'data:application\\/octet-stream;"
                             "base64,A\\/\\/A'}]}",
                             &error),
                   TW_OK);
}

TEST(a_data_uri_may_be_in_upper_case) {
  static const char *const heads[] = {"DATA:application/octet-stream;base64",
                                      "Data:Application/Octet-Stream;base64",
                                      "data:APPLICATION/GLTF-BUFFER;BASE64"};
  for (size_t i = 0; i < sizeof heads / sizeof *heads; i++) {
    char text[256];
    snprintf(text, sizeof text, "{" ASSET ",'buffers':[{'byteLength':3,'uri':'%s,A//A'}]}", heads[i]);
    tw_error error = {0};
    if (read_text(text, &error) != TW_OK) fail_msg("%s: %s", heads[i], error.detail);
  }
}

/* ---- extensions and versions ----------------------------------------------------------------- */

TEST(required_extensions_are_refused_by_name) {
  static const char *const names[] = {"KHR_draco_mesh_compression", "EXT_structural_metadata", "X_unknown"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    char text[512];
    snprintf(text, sizeof text, "{" ASSET ",'extensionsUsed':['%s'],'extensionsRequired':['%s']}", names[i],
             names[i]);
    tw_error error = {0};
    assert_int_equal(read_text(text, &error), TW_UNSUPPORTED);
    assert_string_equal(error.pointer, "/extensionsRequired/0");
    assert_non_null(strstr(error.detail, names[i]));
    if (i == 0) assert_non_null(strstr(error.detail, "gltf-transform copy"));
  }
  /* Compressed meshes have accessors without data: the extension is the reason to give. */
  tw_error error = {0};
  assert_int_equal(read_text("{" ASSET ",'accessors':[{'componentType':5123,'count':3,'type':'SCALAR'}],"
                             "'meshes':[{'primitives':[{'attributes':{},'indices':0}]}],"
                             "'extensionsRequired':['KHR_draco_mesh_compression']}",
                             &error),
                   TW_UNSUPPORTED);
  assert_int_equal(read_text("{" ASSET ",'extensionsUsed':['X_unknown']}", &error), TW_OK);
  assert_int_equal(read_text("{" ASSET ",'extensionsRequired':['KHR_mesh_quantization',"
                             "'KHR_materials_unlit']}",
                             &error),
                   TW_OK);
  assert_int_equal(read_text("{" ASSET ",'extensionsRequired':['VRM','VRMC_vrm','VRMC_vrm_animation',"
                             "'VRMC_materials_mtoon','KHR_xmp_json_ld']}",
                             &error),
                   TW_OK);
}

TEST(a_name_that_is_no_text_does_not_reach_the_answer) {
  tw_error error = {0};
  assert_int_equal(read_text("{" ASSET ",'extensionsRequired':['X_\x7F\xC3\xA4']}", &error), TW_UNSUPPORTED);
  for (const char *c = error.detail; *c; c++) assert_true(*c >= 0x20 && *c < 0x7F);
}

TEST(only_version_2_is_read) {
  tw_error error = {0};
  assert_int_equal(read_text("{'asset':{'version':'1.0'}}", &error), TW_UNSUPPORTED);
  assert_string_equal(error.pointer, "/asset/version");
  assert_int_equal(read_text("{'asset':{'version':'1.0'},'accessors':{}}", &error), TW_INVALID);
  assert_non_null(strstr(error.detail, "glTF 1 is not read"));
  assert_int_equal(read_text("{'asset':{'version':'2.1','minVersion':'2.1'}}", &error), TW_UNSUPPORTED);
  assert_int_equal(read_text("{'asset':{'version':'2.1','minVersion':'2.0'}}", &error), TW_OK);
}

/* ---- what is written wrong, and plain -------------------------------------------------------- */

#define TRIANGLE                                                                                             \
  "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'}],'meshes':[{'primitives':[{'"  \
  "attributes':{'POSITION':0}}]}]"
#define BASE64 "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"
#define URI    "data:application/octet-stream;base64," BASE64

static void assert_triangle(const uint8_t *bytes, size_t size, const char *warning) {
  static const float points[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  tw_model *model = NULL;
  tw_error error = {0};
  tw_status status = gltf_read_bytes(bytes, size, 0, &model, &error);
  if (status != TW_OK) fail_msg("%s: %s", warning, error.detail);
  assert_memory_equal(model->meshes[0].positions, points, sizeof points);
  assert_int_equal(model->meshes[0].face_count, 1);
  assert_int_equal(model->warning_count, 1);
  if (!strstr(model->warnings[0], warning)) fail_msg("%s: %s", warning, model->warnings[0]);
  tw_model_destroy(model);
}

TEST(what_is_plain_is_read_with_a_warning) {
  static const char *const documents[][2] = {
      {"{" ASSET ",'buffers':[{'byteLength':36.0,'uri':'" URI
       "'}],'bufferViews':[{'buffer':0,'byteLength':3.6e1,"
       "'byteOffset':0.00}],'accessors':[{'bufferView':0.0,'componentType':5126.0,'count':3.0,'type':'VEC3'}]"
       ","
       "'meshes':[{'primitives':[{'attributes':{'POSITION':0.0},'mode':4.0}]}],'nodes':[{'mesh':0.0,"
       "'extras':{'count':1.0}}]}",
       "9 integers are written"},
      {"{'buffers':[{'byteLength':36,'uri':'" URI "'}],'bufferViews':[{'buffer':0,'byteLength':36}]," TRIANGLE
       "}",
       "1 asset is missing: the document is read as glTF 2.0"},
      {"{" ASSET ",'buffers':[{'byteLength':36,'uri':'data:;base64," BASE64 "'}],'bufferViews':[{'buffer':0,"
       "'byteLength':36}]," TRIANGLE "}",
       "another type"},
      {"{" ASSET ",'buffers':[{'byteLength':36,'uri':'data:model/x;base64," BASE64
       "'}],'bufferViews':[{'buffer':0,"
       "'byteLength':36}]," TRIANGLE "}",
       "another type"},
      {"{" ASSET ",'buffers':[{'byteLength':36,'uri':'" URI
       "'},{'byteLength':9,'uri':'absent.bin'}],'bufferViews':[{'buffer':0,"
       "'byteLength':36}]," TRIANGLE "}",
       "1 buffer is left out"},
      {"{" ASSET ",'buffers':[{'byteLength':36,'uri':'" URI "'},{'byteLength':0}],'bufferViews':[{'buffer':0,"
       "'byteLength':36}]," TRIANGLE "}",
       "1 buffer is left out"},
      {"{" ASSET ",'buffers':[{'byteLength':36,'uri':'" URI "'}],'bufferViews':[{'buffer':0,'byteLength':36},"
       "{'buffer':0,'byteOffset':36,'byteLength':0}]," TRIANGLE "}",
       "1 buffer view has no bytes"}};
  for (size_t i = 0; i < sizeof documents / sizeof *documents; i++) {
    char *text = quoted(documents[i][0]);
    assert_int_equal(tw_format_sniff((const uint8_t *)text, strlen(text)), TW_FORMAT_GLTF);
    assert_triangle((const uint8_t *)text, strlen(text), documents[i][1]);
    free(text);
  }
}

/* Chunks whose length is no multiple of 4, with the next one at once or behind padding; and bytes behind. */
TEST(a_glb_of_any_lengths_is_read_with_a_warning) {
  static const float points[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  char *json = quoted(
      "{" ASSET ",'buffers':[{'byteLength':36}],'bufferViews':[{'buffer':0,'byteLength':36}]," TRIANGLE "}");
  for (size_t more = 0; more < 8; more++) {
    uint8_t bytes[1024] = "glTF\2";
    bool is_padded = more >= 4;
    size_t size = strlen(json) / 4 * 4 + more % 4, padding = is_padded ? (4 - size % 4) % 4 : 0;
    if (size < strlen(json)) size += 4;
    memset(bytes + 20, ' ', size);
    memcpy(bytes + 20, json, strlen(json));
    glb_put_u32(bytes + 12, (uint32_t)size);
    memcpy(bytes + 16, "JSON", 4);
    uint8_t *bin = bytes + 20 + size + padding;
    glb_put_u32(bin, 36);
    memcpy(bin + 4, "BIN", 4);
    memcpy(bin + 8, points, 36);
    glb_put_u32(bytes + 8, (uint32_t)(28 + size + padding + 36));
    size_t end = 28 + size + padding + 36, behind = size % 4 == 0 ? 3 : 0;
    assert_triangle(bytes, end + behind, behind ? "3 bytes behind the GLB" : "no multiple of 4");
  }
  free(json);
}
