/* What a glTF file says beyond geometry and motion is found again in an answer. */
#include <stdio.h>

#include "glb.h"
#include "gltf/gltf.h"
#include "tweend/json_print.h"
#include "tweend/json_text.h"
#include "written_glb.h"

/* A tetrahedron: 4 positions, 12 indices (16 bits); times 0 and 1 with a translation each. */
#define DATA                                                                                                 \
  "'asset':{'version':'2.0'%s},'buffers':[{'byteLength':104,'uri':'data:application/octet-stream;base64,"    \
  "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAACAAEAAAABAAMAAQACAAMAAgAAAAMAAAAAAAAA" \
  "gD8AAAAAAAAAAAAAAAAAAIA/AAAAQAAAQEA='}],'bufferViews':[{'buffer':0,'byteLength':48},"                     \
  "{'buffer':0,'byteOffset':48,'byteLength':24},{'buffer':0,'byteOffset':72,'byteLength':8},"                \
  "{'buffer':0,'byteOffset':80,'byteLength':24}],'accessors':[{'bufferView':0,'componentType':5126,"         \
  "'count':4,'type':'VEC3','min':[0,0,0],'max':[1,1,1]},{'bufferView':1,'componentType':5123,'count':12,"    \
  "'type':'SCALAR'},{'bufferView':2,'componentType':5126,'count':2,'type':'SCALAR','min':[0],'max':[1]},"    \
  "{'bufferView':3,'componentType':5126,'count':2,'type':'VEC3'}]"

/* The answer of a document at a level, with all clips. */
typedef struct answer {
  fixture f;
  glb file;
} answer;

static answer answer_of(const char *document, size_t size, uint32_t level) {
  answer out = {0};
  tw_error error = {0};
  if (tw_gltf_read((const uint8_t *)document, size, TW_QUADS_NGON, TW_WELD_AUTO, 0, &out.f.model, &error) !=
      TW_OK)
    fail_msg("%s %s\n%.*s", error.pointer, error.detail, (int)size, document);
  fixture_refine(&out.f, level, true);
  out.f.scene.clips = out.f.model->clips;
  out.f.scene.clip_count = out.f.model->clip_count;
  out.file = write_glb(&out.f.scene);
  return out;
}

static void answer_deinit(answer *a) {
  free_glb(&a->file);
  fixture_deinit(&a->f);
}

/* Of a document made of DATA, with more of its asset, and the rest. */
static answer answer_with(const char *asset, const char *rest) {
  size_t size = sizeof DATA + strlen(asset) + strlen(rest) + 8;
  char *document = malloc(size);
  assert_non_null(document);
  snprintf(document, size, "{" DATA "%s}", asset, rest);
  answer out = answer_of(quote(document), strlen(document), 1);
  free(document);
  return out;
}

/* The value at a path like "nodes/3/extras"; "" is the root. */
static const cJSON *find(const cJSON *json, const char *path) {
  for (const char *part = path; json && *part;) {
    char name[64];
    size_t length = strcspn(part, "/");
    assert_true(length < sizeof name);
    memcpy(name, part, length);
    name[length] = '\0';
    json = cJSON_IsArray(json) ? cJSON_GetArrayItem(json, atoi(name))
                               : cJSON_GetObjectItemCaseSensitive(json, name);
    part += length + (part[length] == '/');
  }
  return json;
}

static void assert_says(const answer *a, const char *path, const char *expected) {
  const cJSON *found = find(a->file.json, path);
  char *text = found ? cJSON_PrintUnformatted(found) : NULL, *wanted = quoted(expected);
  if (!text || strcmp(text, wanted) != 0) print_error("%s: %s\n", path, text ? text : "nothing");
  assert_non_null(text);
  assert_string_equal(text, wanted);
  cJSON_free(text);
  free(wanted);
}

/* ---- random documents ------------------------------------------------------------------------ */

enum { SAYINGS_MAX = 4096, EXTENSIONS = 12 };

/* Something that an object of the document says: a member, and where. */
typedef struct saying {
  char path[64];
  size_t start, end; /* of `"name":value` in the document */
} saying;

typedef struct random_document {
  uint64_t state;
  tw_text text;
  saying sayings[SAYINGS_MAX];
  uint32_t saying_count, token;
  bool occurs[EXTENSIONS];
} random_document;

static uint32_t draw(random_document *d, uint32_t below) {
  d->state ^= d->state << 13;
  d->state ^= d->state >> 7;
  d->state ^= d->state << 17;
  return (uint32_t)(d->state >> 33) % below;
}

static void put(random_document *d, const char *text) {
  tw_text_add(&d->text, text);
}

static void put_value(random_document *d, uint32_t depth) {
  static const char *const scalars[] = {"70",
                                        "-12345678901234567890",
                                        "1.50e-3",
                                        "''",
                                        "'a \\'b\\\\ \\u00e4\\n'",
                                        "'\xC3\xA4  {}[],:'",
                                        "true",
                                        "null",
                                        "{}",
                                        "[]"};
  uint32_t kind = draw(d, depth ? 14 : 10);
  if (kind < 10) {
    put(d, scalars[kind]);
    return;
  }
  bool is_object = kind % 2;
  put(d, is_object ? "{" : "[");
  for (uint32_t i = draw(d, 4); i > 0; i--) {
    tw_text_element(&d->text);
    if (is_object) {
      static const char *const keys[] = {"'extras':", "'name':", "'x y':", "'index':", "'':"};
      put(d, keys[draw(d, 5)]);
    }
    put_value(d, depth - 1);
  }
  put(d, is_object ? "}" : "]");
}

/* A member of a value that no other has. */
static void say(random_document *d, const char *path, const char *name) {
  tw_text_element(&d->text);
  assert_true(d->saying_count < SAYINGS_MAX);
  saying *s = &d->sayings[d->saying_count++];
  snprintf(s->path, sizeof s->path, "%s%s%s", path, *path ? "/" : "", name);
  s->start = d->text.size;
  const char *last = strrchr(name, '/');
  put(d, "'");
  put(d, last ? last + 1 : name);
  put(d, "':{'token':");
  tw_text_count(&d->text, d->token++);
  put(d, ",'v':");
  put_value(d, 3);
  put(d, "}");
  s->end = d->text.size;
}

/* Some or all of what an object may say, behind its members. */
static void say_more(random_document *d, const char *path) {
  if (draw(d, 2)) say(d, path, "extras");
  if (draw(d, 3) == 0) say(d, path, "whim");
  uint32_t some = draw(d, 1u << EXTENSIONS);
  for (int i = 0; i < 2; i++) some &= draw(d, 1u << EXTENSIONS); /* few */
  if (!some) return;
  tw_member_open(&d->text, "extensions", "{");
  for (uint32_t i = 0; i < EXTENSIONS; i++) {
    if (!(some >> i & 1)) continue;
    char name[32];
    snprintf(name, sizeof name, "extensions/EXT_random_%u", i);
    say(d, path, name);
    d->occurs[i] = true;
  }
  put(d, "}");
}

/* `"name":[{first, more},{second, more}]`: objects, NULL behind the last. */
static void put_array(random_document *d, const char *name, const char *const *objects) {
  tw_member_open(&d->text, name, "[");
  for (uint32_t i = 0; objects[i]; i++) {
    char path[64];
    snprintf(path, sizeof path, "%s/%u", name, i);
    tw_text_element(&d->text);
    put(d, "{");
    put(d, objects[i]);
    say_more(d, path);
    put(d, "}");
  }
  put(d, "]");
}

static void put_meshes(random_document *d) {
  static const char *const primitives[2][2] = {
      {"'attributes':{'POSITION':0},'indices':1", "'attributes':{'POSITION':0},'mode':0"},
      {"'attributes':{'POSITION':0},'indices':1,'material':1",
       "'attributes':{'POSITION':0},'indices':1,'mode':3,'material':2"}};
  put(d, ",'meshes':[");
  for (uint32_t mesh = 0; mesh < 2; mesh++) {
    char path[64];
    put(d, mesh ? ",{'primitives':[" : "{'name':'unused','primitives':[");
    for (uint32_t i = 0; i < 2; i++) {
      snprintf(path, sizeof path, "meshes/%u/primitives/%u", mesh, i);
      put(d, i ? ",{" : "{");
      put(d, primitives[mesh][i]);
      say_more(d, path);
      put(d, "}");
    }
    put(d, "]");
    *strchr(path + 7, '/') = '\0';
    say_more(d, path);
    put(d, "}");
  }
  put(d, "]");
}

static void put_animation(random_document *d) {
  put(d, ",'animations':[{'name':'walk','channels':[");
  for (uint32_t i = 0; i < 2; i++) {
    char path[64];
    snprintf(path, sizeof path, "animations/0/channels/%u/target", i);
    put(d, i ? ",{'sampler':1,'target':{'node':2,'path':'scale'"
             : "{'sampler':0,'target':{'node':1,'path':'translation'");
    say_more(d, path);
    put(d, "}");
    *strrchr(path, '/') = '\0';
    say_more(d, path);
    put(d, "}");
  }
  put(d, "],'samplers':[");
  for (uint32_t i = 0; i < 2; i++) {
    char path[64];
    snprintf(path, sizeof path, "animations/0/samplers/%u", i);
    put(d, i ? ",{'input':2,'output':3" : "{'input':2,'output':3");
    say_more(d, path);
    put(d, "}");
  }
  put(d, "]");
  say_more(d, "animations/0");
  put(d, "}]");
}

static void put_asset(random_document *d) {
  char data[sizeof DATA + 8];
  static const char version[] = "'version':'2.0'";
  snprintf(data, sizeof data, DATA, "");
  const char *rest = strstr(data, version) + sizeof version - 1;
  put(d, "{");
  tw_text_bytes(&d->text, data, (size_t)(rest - data));
  say_more(d, "asset");
  put(d, rest);
}

static void put_document(random_document *d) {
  static const char *const nodes[] = {"'name':'root','children':[1,2,3]", "'mesh':0", "'mesh':1", "",
                                      "'name':'elsewhere','camera':0",    NULL};
  static const char *const materials[] = {
      "'name':'red'", "'pbrMetallicRoughness':{'baseColorTexture':{'index':0}}", "", NULL};
  static const char *const textures[] = {"'source':1,'sampler':0", "", NULL};
  static const char *const images[] = {"'uri':'data:image/jpeg;base64,/9j/'",
                                       "'uri':'data:image/png;base64,AAAA'",
                                       "'bufferView':2,'mimeType':'image/png'", NULL};
  static const char *const samplers[] = {"'magFilter':9729", NULL};
  static const char *const cameras[] = {"'type':'perspective','perspective':{'yfov':1,'znear':0.1}", NULL};
  static const char *const skins[] = {"'joints':[0,1]", "'joints':[2]", NULL};
  static const char *const scenes[] = {"'name':'first','nodes':[4]", "'nodes':[0]", NULL};
  put_asset(d);
  put_array(d, "nodes", nodes);
  put_meshes(d);
  put_array(d, "materials", materials);
  put_array(d, "textures", textures);
  put_array(d, "images", images);
  put_array(d, "samplers", samplers);
  put_array(d, "cameras", cameras);
  put_array(d, "skins", skins);
  put_array(d, "scenes", scenes);
  put_animation(d);
  put(d, ",'scene':1,'extensionsRequired':['KHR_mesh_quantization'],'extensionsUsed':['EXT_nowhere'");
  for (uint32_t i = 0; i < EXTENSIONS; i++) {
    char name[32];
    snprintf(name, sizeof name, ",'EXT_random_%u'", i * 5 % EXTENSIONS);
    put(d, name);
  }
  put(d, "]");
  say_more(d, "");
  put(d, "}");
  assert_false(d->text.failed);
  quote_bytes(d->text.data, d->text.size);
}

/* Every saying is in the answer as it was written, and where. */
static void assert_said(const random_document *d, const answer *a) {
  char *json = calloc(a->file.json_size + 1, 1), *text = malloc(d->text.size);
  assert_non_null(json);
  assert_non_null(text);
  memcpy(json, a->file.bytes + 20, a->file.json_size);
  for (uint32_t i = 0; i < d->saying_count; i++) {
    const saying *s = &d->sayings[i];
    memcpy(text, d->text.data + s->start, s->end - s->start);
    text[s->end - s->start] = '\0';
    const char *token = strstr(text, "\"token\":") + 8;
    const cJSON *found = find(a->file.json, s->path);
    if (!found || number(found, "token", UINT32_MAX) != strtoul(token, NULL, 10) || !strstr(json, text))
      fail_msg("%s: %s\n%.*s\n%s", s->path, text, (int)d->text.size, d->text.data, json);
  }
  free(json);
  free(text);
}

static void assert_declared(const random_document *d, const answer *a) {
  const cJSON *used = cJSON_GetObjectItem(a->file.json, "extensionsUsed");
  int next = 0;
  for (uint32_t i = 0; i < EXTENSIONS; i++) {
    uint32_t index = i * 5 % EXTENSIONS;
    char name[32];
    if (!d->occurs[index]) continue;
    snprintf(name, sizeof name, "EXT_random_%u", index);
    assert_string_equal(cJSON_GetArrayItem(used, next++)->valuestring, name);
  }
  assert_int_equal(cJSON_GetArraySize(used), next);
  assert_false(cJSON_HasObjectItem(a->file.json, "extensionsRequired"));
}

TEST(every_saying_of_a_random_document_is_found_again) {
  random_document *d = malloc(sizeof *d);
  assert_non_null(d);
  for (uint64_t seed = 1; seed <= 200; seed++) {
    /* No token is an accessor: an unknown extension of a primitive with such a number is left out. */
    *d = (random_document){.state = seed * 0x9E3779B97F4A7C15, .token = 100};
    put_document(d);
    for (uint32_t level = 0; level < 2; level++) {
      answer a = answer_of(d->text.data, d->text.size, level);
      assert_int_equal(glb_warning_count(a.f.model), 0);
      assert_said(d, &a);
      assert_declared(d, &a);
      answer_deinit(&a);
    }
    tw_text_deinit(&d->text);
  }
  free(d);
}

/* ---- by hand --------------------------------------------------------------------------------- */

TEST(kept_text_has_no_blanks_and_strings_keep_theirs) {
  answer a = answer_with(",\n 'copyright' : 'two  words' , 'generator':'other'", "");
  assert_says(&a, "asset/copyright", "'two  words'");
  assert_non_null(strstr(find(a.file.json, "asset/generator")->valuestring, "tweend"));
  assert_string_equal(a.f.model->assets->asset, "{\"copyright\":\"two  words\"}");
  answer_deinit(&a);
}

TEST(without_parts_the_asset_still_says_its_licence) {
  answer a = answer_with(",'copyright':'CC0','extras':{'author':'Ann'}",
                         ",'materials':[{'name':'red'}],'extensions':{'EXT_of':{'mesh':0}}");
  tw_model bare = *a.f.model;
  bare.mesh_count = bare.material_count = 0;
  bare.assets = tw_gltf_assets_bare(a.f.model->arena, a.f.model->assets);
  assert_null(tw_gltf_assets_bare(a.f.model->arena, NULL));
  const tw_scene scene = {.model = &bare};
  answer out = {.file = write_glb(&scene)};
  assert_says(&out, "asset/copyright", "'CC0'");
  assert_says(&out, "asset/extras", "{'author':'Ann'}");
  assert_null(find(out.file.json, "materials"));
  assert_null(find(out.file.json, "extensions"));
  free_glb(&out.file);
  answer_deinit(&a);
}

TEST(attributes_that_are_not_read_are_warned_of) {
  answer a = answer_with("", ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'_HEAT':0,'COLOR_1':0},"
                             "'indices':1,'targets':[{'POSITION':0,'TANGENT':0}]}]}]");
  assert_int_equal(glb_warning_count(a.f.model), 2);
  assert_string_equal(glb_warning(a.f.model, 0), "the attribute COLOR_1 is left out");
  assert_string_equal(glb_warning(a.f.model, 1), "the attribute TANGENT of morph targets is left out");
  answer_deinit(&a);
}

/* The root's sounds are in buffers; what plays them would refer to nothing. */
TEST(extensions_without_their_part_of_the_root_are_left_out) {
  answer a =
      answer_with("", ",'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}],"
                      "'extensionsUsed':['KHR_audio_emitter','ACME_other'],"
                      "'extensions':{'KHR_audio_emitter':{'audio':[{'bufferView':1}],'emitters':[{}]}},"
                      "'nodes':[{'mesh':0,'extensions':{'KHR_audio_emitter':{'emitter':0},'ACME_other':{}}}],"
                      "'scenes':[{'nodes':[0],'extensions':{'KHR_audio_emitter':{'emitters':[0]}}}]");
  assert_null(find(a.file.json, "extensions"));
  assert_null(find(a.file.json, "scenes/0/extensions"));
  assert_null(find(a.file.json, "nodes/0/extensions/KHR_audio_emitter"));
  assert_non_null(find(a.file.json, "nodes/0/extensions/ACME_other"));
  assert_int_equal(cJSON_GetArraySize(find(a.file.json, "extensionsUsed")), 1);
  assert_string_equal(glb_warning(a.f.model, 0),
                      "the extension KHR_audio_emitter at the root is left out: its "
                      "data is in buffers, as at 2 more places");
  answer_deinit(&a);
}

TEST(scenes_and_the_default_one_stay) {
  answer a = answer_with("", ",'nodes':[{},{'name':'b'}],'scenes':[{'nodes':[1]},{'name':'s','nodes':[0]},"
                             "{}],'scene':1");
  assert_says(&a, "scenes", "[{'nodes':[1]},{'nodes':[0],'name':'s'},{}]");
  assert_says(&a, "scene", "1");
  answer_deinit(&a);
}

TEST(nodes_have_their_own_morph_weights) {
  answer a = answer_with(
      "", ",'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1,'targets':[{'POSITION':0},"
          "{}]}],'weights':[0.5,0],'extras':{'targetNames':['smile','blink']}}],"
          "'nodes':[{'mesh':0,'weights':[0.25,1]},{'mesh':0}]");
  assert_says(&a, "nodes", "[{'mesh':0,'weights':[0.25,1]},{'mesh':0}]");
  assert_says(&a, "meshes/0/weights", "[0.5,0]");
  assert_says(&a, "meshes/0/extras", "{'targetNames':['smile','blink']}");
  answer_deinit(&a);
}

TEST(what_is_written_with_escapes_stands_only_once) {
  answer a = answer_with("", ",'nodes':[{'n\\u0061me':'a','ext\\u0065nsions':{'X':{}},'\\u0061':1}]");
  assert_says(&a, "nodes/0", "{'name':'a','a':1}");
  answer_deinit(&a);
}

static void assert_refused(const char *document, const char *pointer) {
  tw_model *model = NULL;
  tw_error error = {0};
  assert_int_equal(gltf_read(document, 0, &model, &error), TW_INVALID);
  assert_string_equal(error.pointer, pointer);
}

TEST(primitives_that_the_parser_skips_are_refused) {
  static const char rest[] = ",'meshes':[{'primitives':[{},{'attributes':{'POSITION':0},'mode':0}]}]}";
  char document[2048];
  snprintf(document, sizeof document, "{" DATA "%s", "", rest);
  assert_refused(document, "/meshes/0/primitives");
}

TEST(elements_that_are_no_objects_are_refused) {
  static const char *const parts[] = {"materials", "textures", "samplers", "cameras", "images"};
  for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
    char document[128], pointer[32];
    snprintf(document, sizeof document, "{'asset':{'version':'2.0'},'%s':[{},7]}", parts[i]);
    snprintf(pointer, sizeof pointer, "/%s/1", parts[i]);
    assert_refused(document, pointer);
  }
}

TEST(primitives_that_say_more_than_their_material_stay_apart) {
  answer a = answer_with(
      "",
      ",'materials':[{},{}],'meshes':[{'primitives':[{'attributes':{'POSITION':0},"
      "'indices':1,'material':1,'extras':1},{'attributes':{'POSITION':0},'indices':1,'material':1},"
      "{'attributes':{'POSITION':0},'indices':1,'material':0,'extras':1},{'attributes':{'POSITION':0},"
      "'indices':1,'material':1,'extras':1},{'attributes':{'POSITION':0},'indices':1,'extensions':{'X':{},"
      "'FB_ngon_encoding':{}}}]}]");
  assert_int_equal(a.f.model->material_count, 2);
  assert_int_equal(a.f.model->slot_count, 3);
  assert_int_equal(cJSON_GetArraySize(find(a.file.json, "meshes/0/primitives")), 4);
  assert_says(&a, "meshes/0/primitives/0/material", "1");
  assert_null(find(a.file.json, "meshes/0/primitives/0/extras"));
  assert_says(&a, "meshes/0/primitives/1/material", "1");
  assert_says(&a, "meshes/0/primitives/1/extras", "1");
  assert_says(&a, "meshes/0/primitives/2/material", "0");
  assert_says(&a, "meshes/0/primitives/2/extras", "1");
  assert_null(find(a.file.json, "meshes/0/primitives/3/material"));
  assert_says(&a, "meshes/0/primitives/3/extensions", "{'X':{}}");
  assert_says(&a, "extensionsUsed", "['X']");
  free_glb(&a.file);
  a.f.scene.polygons = TW_POLYGONS_NGON;
  a.file = write_glb(&a.f.scene);
  assert_says(&a, "meshes/0/primitives/3/extensions", "{'FB_ngon_encoding':{},'X':{}}");
  assert_says(&a, "meshes/0/primitives/1/extensions", "{'FB_ngon_encoding':{}}");
  assert_says(&a, "extensionsUsed", "['FB_ngon_encoding','X']");
  answer_deinit(&a);
}

/* The bytes of an accessor of the answer. */
static const uint8_t *bytes_of(const answer *a, const char *path, uint32_t size) {
  const cJSON *found = find(a->file.json, path);
  assert_non_null(found);
  return element(&a->file, (int)found->valuedouble, 0, size);
}

TEST(points_and_lines_pass_through) {
  answer a = answer_with("", ",'materials':[{}],'meshes':[{'primitives':[{'attributes':{'POSITION':0},"
                             "'indices':1,'mode':1,'material':0,'extras':{'a':1},'targets':[{'POSITION':0}]},"
                             "{'attributes':{'POSITION':0},'indices':1,'targets':[{'POSITION':0}]}]},"
                             "{'primitives':[{'attributes':{'POSITION':0},'mode':0}]}]");
  assert_int_equal(glb_warning_count(a.f.model), 0);
  assert_says(&a, "meshes/0/primitives/1",
              "{'attributes':{'POSITION':0},'indices':1,'material':0,'mode':1,'targets':[{'POSITION':0}],"
              "'extras':{'a':1}}");
  assert_says(&a, "meshes/1/primitives", "[{'attributes':{'POSITION':0},'mode':0}]");
  static const float positions[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  assert_memory_equal(bytes_of(&a, "meshes/1/primitives/0/attributes/POSITION", sizeof positions), positions,
                      sizeof positions);
  assert_says(&a, "accessors/0/max", "[1,1,1]");
  assert_says(&a, "bufferViews/0/byteStride", "12");
  assert_says(&a, "bufferViews/1/byteLength", "24");
  answer_deinit(&a);
}

TEST(bad_points_and_lines_are_refused) {
  static const struct {
    const char *primitive, *pointer;
  } cases[] = {
      {"{'attributes':{'POSITION':9},'mode':0}", "/meshes/0/primitives/0/attributes/POSITION"},
      {"{'attributes':{'POSITION':1},'mode':0}", "/accessors/1/type"},
      {"{'attributes':{'POSITION':0,'COLOR_0':3},'mode':0}", "/meshes/0/primitives/0/attributes/COLOR_0"},
      {"{'attributes':{'POSITION':0,'_A/~B':3},'mode':0}", "/meshes/0/primitives/0/attributes/_A~1~0B"},
      {"{'attributes':{'POSITION':0,'_A/~B':9},'mode':0}", "/meshes/0/primitives/0/attributes/_A~1~0B"},
      {"{'attributes':{'POSITION':0},'mode':0,'targets':[{'POSITION':0},{'POSITION':3}]}",
       "/meshes/0/primitives/0/targets/1/POSITION"},
      {"{'attributes':{'POSITION':0},'mode':0,'targets':[{'POSITION':0},{'POSITION':9}]}",
       "/meshes/0/primitives/0/targets/1/POSITION"},
      {"{'attributes':{'POSITION':3},'indices':1,'mode':1}", "/accessors/1"},
      {"{'attributes':{'POSITION':0},'material':0,'mode':1}", "/meshes/0/primitives/0/material"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char document[2048];
    snprintf(document, sizeof document, "{" DATA ",'meshes':[{'primitives':[%s]}]}", "", cases[i].primitive);
    assert_refused(document, cases[i].pointer);
  }
}

TEST(instances_keep_their_attributes) {
  answer a = answer_with(
      "",
      ",'extensionsUsed':['EXT_mesh_gpu_instancing'],'extensionsRequired':['EXT_mesh_gpu_instancing'],"
      "'nodes':[{'mesh':0,'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':3,'_ID':2},"
      "'extras':7}}}],'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':1}]}]");
  static const float moves[6] = {0, 0, 0, 1, 2, 3};
  static const char path[] = "nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/TRANSLATION";
  assert_memory_equal(bytes_of(&a, path, sizeof moves), moves, sizeof moves);
  assert_says(&a, "nodes/0/extensions/EXT_mesh_gpu_instancing/extras", "7");
  assert_says(&a, "extensionsRequired", "['EXT_mesh_gpu_instancing']");
  answer_deinit(&a);
}

TEST(channels_of_something_else_than_nodes_stay_with_their_keys) {
  answer a = answer_with(
      "",
      ",'extensionsUsed':['KHR_animation_pointer'],'materials':[{}],'nodes':[{}],'animations':[{'channels':[{"
      "'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':"
      "'/materials/0/emissiveFactor'}}},'extras':5},{'sampler':0,'target':{'node':0,"
      "'path':'translation'}}],'samplers':[{'input':2,'output':3,'interpolation':'STEP','extras':6}]}]");
  assert_int_equal(glb_warning_count(a.f.model), 0);
  assert_says(&a, "animations/0/channels",
              "[{'sampler':0,'target':{'node':0,'path':'translation'}},"
              "{'sampler':1,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':"
              "'/materials/0/emissiveFactor'}}},'extras':5}]");
  assert_says(&a, "animations/0/samplers/1", "{'input':0,'interpolation':'STEP','output':1,'extras':6}");
  assert_says(&a, "accessors/0",
              "{'bufferView':0,'componentType':5126,'count':2,'type':'SCALAR','max':[1],'min':[0]}");
  assert_says(&a, "extensionsUsed", "['KHR_animation_pointer']");
  answer_deinit(&a);
}

/* Channels 0 and 2 point at the node; the node's translation is moved already, so 2 stays. */
TEST(pointers_to_transforms_of_nodes_are_tracks) {
  answer a = answer_with(
      "",
      ",'extensionsUsed':['KHR_animation_pointer'],'materials':[{}],'nodes':[{}],'animations':[{'channels':[{"
      "'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':"
      "'\\/nodes\\/0\\/scale'}}},'extras':5},{'sampler':0,'target':{'node':0,'path':'translation'}},"
      "{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{'pointer':"
      "'/nodes/0/translation'}}}}],'samplers':[{'input':2,'output':3,'interpolation':'STEP'}]}]");
  const tw_clip_keys *clip = a.f.model->clips;
  assert_int_equal(clip->track_count, 2);
  assert_int_equal(clip->tracks[1].path, TW_SCALE);
  assert_int_equal(clip->tracks[1].node, 0);
  assert_int_equal(clip->tracks[1].interpolation, TW_STEP);
  assert_memory_equal(clip->tracks[1].values, clip->tracks[0].values, 6 * sizeof(float));
  assert_int_equal(glb_warning_count(a.f.model), 1);
  assert_non_null(strstr(glb_warning(a.f.model, 0), "/animations/0/channels/2: another channel"));
  assert_says(&a, "animations/0/channels/1", "{'sampler':1,'target':{'node':0,'path':'scale'},'extras':5}");
  assert_says(&a, "animations/0/channels/2/target/path", "'pointer'");
  answer_deinit(&a);
}

/* Other pointers, and those to what is not there, stay as they are. */
TEST(pointers_to_anything_else_stay) {
  static const char *const pointers[] = {
      "/nodes/1/scale",  "/nodes/0/weights",        "/nodes/0/scale/0",  "/nodes/0", "nodes/0/scale",
      "/nodes/-1/scale", "/nodes/0000000000/scale", "/meshes/0/weights", ""};
  for (size_t i = 0; i < sizeof pointers / sizeof *pointers; i++) {
    char rest[512];
    snprintf(rest, sizeof rest,
             ",'nodes':[{}],'animations':[{'channels':[{'sampler':0,'target':{'path':'pointer','extensions':"
             "{'KHR_animation_pointer':{'pointer':'%s'}}}}],'samplers':[{'input':2,'output':3}]}]",
             pointers[i]);
    answer a = answer_with("", rest);
    assert_int_equal(a.f.model->clips[0].track_count, 0);
    assert_non_null(a.f.model->clips[0].loose);
    answer_deinit(&a);
  }
}

/* "mesh" and "skin" are read one by one; a list of words has no word of two. */
TEST(members_whose_names_are_words_with_blanks_are_kept) {
  answer a = answer_with("", ",'nodes':[{'mesh skin':1}]");
  assert_says(&a, "nodes/0/mesh skin", "1");
  answer_deinit(&a);
  static const char rest[] = ",'animations':[{'channels':[{'sampler':0,'target':{'path':'pointer'}}],"
                             "'samplers':[{'input':2,'output':3,'interpolation':'LINEAR STEP'}]}]}";
  char document[2048];
  snprintf(document, sizeof document, "{" DATA "%s", "", rest);
  assert_refused(document, "/animations/0/channels/0");
}
