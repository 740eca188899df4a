/* Models: uploads in every wrapping, descriptions, lists, sources, validators, deleting. */
#include "call.h"
#include "loopback.h"
#include "service.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>
#include <zstd.h>

static const char triangle[] = "o three\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
/* sha256 of the text above, by sha256sum. */
static const char triangle_id[] = "3cd3dec2128c83a94ef9f007c577d21f";

/* ---- uploads --------------------------------------------------------------------------------- */

TEST_WITH(an_upload_is_described_by_201_and_again_by_200, loopback_setup, loopback_teardown) {
  reply first = loopback_post(*state, "/v1/models", "model/obj", triangle);
  assert_int_equal(first.status, 201);
  char location[64];
  snprintf(location, sizeof location, "/v1/models/%s", triangle_id);
  assert_string_equal(reply_header(&first, "Location"), location);
  reply again = loopback_post(*state, "/v1/models", "text/plain; charset=utf-8", triangle);
  assert_int_equal(again.status, 200);
  assert_string_equal(first.body, again.body);
  assert_string_equal(reply_header(&first, "ETag"), reply_header(&again, "ETag"));
  reply got = loopback_get(*state, location);
  assert_int_equal(got.status, 200);
  assert_string_equal(first.body, got.body);
  assert_string_equal(reply_header(&first, "ETag"), reply_header(&got, "ETag"));
  assert_int_equal(loopback_store_count(*state), 1);
  reply_free(&first);
  reply_free(&again);
  reply_free(&got);
}

TEST_WITH(bodies_are_asked_for_before_they_are_read, loopback_setup, loopback_teardown) {
  reply r = loopback_ask(*state, "POST", "/v1/models", NULL, NULL, 0);
  assert_true(r.refused);
  assert_problem(r, 411, NULL, "Content-Length");
  r = loopback_ask(*state, "POST", "/v1/models", "Content-Length: 1048577\n", "", 0);
  assert_true(r.refused);
  assert_problem(r, 413, NULL, "1048576");
  r = loopback_ask(*state, "POST", "/v1/models", "Content-Length: 99999999999999999999999999\n", "", 0);
  assert_true(r.refused);
  assert_problem(r, 413, NULL, NULL);
  assert_problem(loopback_post(*state, "/v1/models", "model/obj", ""), 400, NULL, "empty");
}

TEST_WITH(types_that_no_model_has_are_415_with_the_list, loopback_setup, loopback_teardown) {
  const char *const types[] = {"image/png",
                               "text/html",
                               "text/xml",
                               "application/pdf",
                               "multipart/mixed; boundary=x",
                               "application/xhtml+xml",
                               "video/mp4",
                               "nonsense"};
  for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
    reply r = loopback_post(*state, "/v1/models", types[i], triangle);
    assert_true(r.refused);
    assert_says(&r, "\"model/gltf-binary\"");
    assert_problem(r, 415, NULL, "model/obj");
  }
}

TEST_WITH(the_bytes_decide_under_types_that_say_nothing, loopback_setup, loopback_teardown) {
  const char *const types[] = {"application/octet-stream", "application/x-www-form-urlencoded",
                               "model/vnd.other", "", "MODEL/OBJ"};
  for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
    reply r = loopback_post(*state, "/v1/models", types[i], triangle);
    assert_in_range(r.status, 200, 201);
    assert_says(&r, "'format':'obj'");
    reply_free(&r);
  }
  reply r = loopback_post_with(*state, "/v1/models", NULL, "{'nodes':[{}]}");
  assert_int_equal(r.status, 201);
  assert_says(&r, "'format':'tweend'");
  reply_free(&r);
}

TEST_WITH(a_type_that_contradicts_the_bytes_is_400, loopback_setup, loopback_teardown) {
  const char *const pairs[][2] = {{"model/gltf-binary", triangle},
                                  {"model/gltf+json", triangle},
                                  {"model/gltf+json", "{'nodes':[]}"},
                                  {"model/obj", "{'nodes':[]}"},
                                  {"text/plain", "glTF\2"},
                                  {"application/json", "glTF\2"},
                                  {"model/gltf-binary", "{'nodes':[]}"},
                                  {"application/json", triangle}};
  for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
    assert_problem(loopback_post(*state, "/v1/models", pairs[i][0], pairs[i][1]), 400, NULL, NULL);
  assert_int_equal(loopback_store_count(*state), 0);
}

TEST_WITH(the_declared_type_is_quoted_as_it_was_sent, loopback_setup, loopback_teardown) {
  assert_problem(loopback_post(*state, "/v1/models", "text/plain; charset=utf-8", "{'nodes':[]}"), 400, NULL,
                 "declared as text/plain, but the bytes look like tweend JSON");
}

TEST_WITH(an_obj_error_bears_its_line, loopback_setup, loopback_teardown) {
  reply r = loopback_post(*state, "/v1/models", "model/obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  assert_says(&r, "'line':4");
  assert_false(reply_says(&r, "\"errors\""));
  assert_problem(r, 422, NULL, NULL);
}

/* Packs with gzip; *size: bytes made. */
static uint8_t *gzip(const void *data, size_t length, size_t *size) {
  z_stream stream = {0};
  assert_int_equal(deflateInit2(&stream, 9, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  uLong bound = deflateBound(&stream, (uLong)length);
  uint8_t *packed = malloc(bound);
  stream.next_in = (Bytef *)data;
  stream.avail_in = (uInt)length;
  stream.next_out = packed;
  stream.avail_out = (uInt)bound;
  assert_int_equal(deflate(&stream, Z_FINISH), Z_STREAM_END);
  *size = stream.total_out;
  deflateEnd(&stream);
  return packed;
}

static void assert_is_the_triangle(reply r) {
  if (r.status != 200 && r.status != 201) fail_msg("%d %s", r.status, r.body);
  assert_says(&r, triangle_id);
  reply_free(&r);
}

TEST_WITH(packed_bodies_are_unpacked, loopback_setup, loopback_teardown) {
  size_t size;
  uint8_t *packed = gzip(triangle, strlen(triangle), &size);
  assert_is_the_triangle(
      loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, size));
  assert_is_the_triangle(
      loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: X-GZIP \n", packed, size));
  for (size_t cut = 0; cut < size; cut += 7)
    assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, cut), 400,
                   NULL, "gzip");
  uint8_t *tail = malloc(size + 1);
  memcpy(tail, packed, size);
  tail[size] = 'x';
  assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", tail, size + 1), 400,
                 NULL, NULL);
  free(tail);
  free(packed);
  uint8_t frames[512];
  size = ZSTD_compress(frames, sizeof frames, triangle, 20, 1);
  size += ZSTD_compress(frames + size, sizeof frames - size, triangle + 20, strlen(triangle) - 20, 1);
  assert_is_the_triangle(
      loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: zstd\n", frames, size));
  for (size_t cut = 0; cut < size - 1; cut += 5) /* the first frame alone is whole, and another text */
    assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: zstd\n", frames, cut), 400,
                   NULL, NULL);
  const char *const unknown[] = {"Content-Encoding: br\n", "Content-Encoding: gzip, gzip\n"};
  for (int i = 0; i < 2; i++) {
    reply r = loopback_ask(*state, "POST", "/v1/models", unknown[i], triangle, strlen(triangle));
    assert_true(r.refused);
    assert_string_equal(reply_header(&r, "Accept-Encoding"), "gzip, zstd");
    assert_problem(r, 415, NULL, "gzip, zstd");
  }
}

TEST_WITH(a_bomb_is_413_at_the_limit, loopback_setup, loopback_teardown) {
  size_t length = 50 << 20, size;
  char *blank = malloc(length);
  memset(blank, '\n', length);
  memcpy(blank, triangle, strlen(triangle));
  uint8_t *packed = gzip(blank, length, &size);
  assert_true(size < 1 << 20);
  assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, size), 413,
                 NULL, "1048576");
  free(packed);
  packed = gzip(blank, 1 << 20, &size);
  reply r = loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, size);
  assert_int_equal(r.status, 201);
  reply_free(&r);
  free(packed);
  packed = gzip(blank, (1 << 20) + 1, &size);
  assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: gzip\n", packed, size), 413,
                 NULL, NULL);
  free(packed);
  size_t bound = ZSTD_compressBound(length);
  packed = malloc(bound);
  size = ZSTD_compress(packed, bound, blank, length, 1);
  assert_problem(loopback_ask(*state, "POST", "/v1/models", "Content-Encoding: zstd\n", packed, size), 413,
                 NULL, "1048576");
  free(packed);
  free(blank);
}

static const char part_head[] = "Content-Disposition: form-data; name=\"f\"; filename=\"a;b.obj\"\r\n"
                                "Content-Type: application/x-tgif\r\n\r\n";

static reply post_form(loopback *loop, const char *type, const char *body) {
  return loopback_post(loop, "/v1/models", type, body);
}

TEST_WITH(a_form_gives_its_one_file, loopback_setup, loopback_teardown) {
  const char *type = "multipart/form-data; boundary=\"x y\"";
  char body[1024];
  snprintf(body, sizeof body, "--x y\r\n%s%s\r\n--x y--\r\n", part_head, triangle);
  assert_is_the_triangle(post_form(*state, type, body));
  snprintf(body, sizeof body,
           "preamble\r\n--x y\r\nContent-Disposition: form-data; name=\"submit\"\r\n\r\ngo\r\n"
           "--x y\r\n%s%s\r\n--x y--",
           part_head, triangle);
  assert_is_the_triangle(post_form(*state, type, body));
}

TEST_WITH(broken_forms_are_400, loopback_setup, loopback_teardown) {
  const char *type = "multipart/form-data; boundary=xyz";
  char body[1024];
  assert_problem(post_form(*state, "multipart/form-data", triangle), 400, NULL, "boundary");
  assert_problem(post_form(*state, "multipart/form-data; boundary=\"\"", triangle), 400, NULL, "boundary");
  assert_problem(post_form(*state, type, triangle), 400, NULL, NULL);
  assert_problem(post_form(*state, type, "--xyz--\r\n"), 400, NULL, "no file");
  assert_problem(post_form(*state, type, "--xyz\r\n\r\n\r\n--xyz--\r\n"), 400, NULL, "no file");
  assert_problem(post_form(*state, type, "--xyz"), 400, NULL, NULL);
  assert_problem(post_form(*state, type, "--xyz\r\n"), 400, NULL, NULL);
  snprintf(body, sizeof body, "--xyz\r\n%s%s\r\n--xyz\r\n%s%s\r\n--xyz--\r\n", part_head, triangle, part_head,
           triangle);
  assert_problem(post_form(*state, type, body), 400, NULL, "more than one");
  snprintf(body, sizeof body, "--xyz\r\n%s\r\n--xyz--\r\n", part_head);
  assert_problem(post_form(*state, type, body), 400, NULL, "empty");
  int length = snprintf(body, sizeof body, "--xyz\r\n%s%s\r\n--xyz--", part_head, triangle);
  for (int cut = 0; cut < length; cut++) {
    char *exact = malloc((size_t)cut + 1);
    memcpy(exact, body, (size_t)cut);
    exact[cut] = '\0';
    assert_problem(post_form(*state, type, exact), 400, NULL, NULL);
    free(exact);
  }
  assert_int_equal(loopback_store_count(*state), 0);
}

/* ---- a glTF and the files that it names ------------------------------------------------------ */

static const char scattered[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],"
    "'images':[{'uri':'https://example.com/a.png'},{'name':'skin','uri':'./tex/a%20b.png'},"
    "{'uri':'data:image/png;base64,iVBORw0KGgo='},{'uri':'tex\\/a b.png'}],'textures':[{'source':1}],"
    "'materials':[{'emissiveTexture':{'index':0}}],'meshes':[{'name':'m',"
    "'primitives':[{'attributes':{'POSITION':0},'indices':1,'material':0}]}],"
    "'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3','min':[0,0,0],"
    "'max':[1,1,0]},{'bufferView':1,'componentType':5123,'count':3,'type':'SCALAR'}],"
    "'bufferViews':[{'buffer':1,'byteLength':36},{'buffer':2,'byteOffset':2,'byteLength':6,'name':'i'}],"
    "'buffers':[{'uri':'data:application/octet-stream;base64,AAAA','byteLength':3},"
    "{'uri':'points.bin','byteLength':36},{'uri':'faces.bin','byteLength':8}]}";

typedef struct named_bytes {
  const char *name;
  const void *bytes;
  size_t size;
} named_bytes;

static const float corners[9] = {0, 0, 0, 1, 0, 0, 1, 1, 0};
static const uint8_t faces[9] = {9, 9, 0, 0, 1, 0, 2, 0, 7}; /* from byte 2 on; longer than the glTF says */
static const uint8_t picture[10] = "\x89PNG\r\n\x1A\n1";

/* In the order of scattered_parts: glTF, points, faces, picture. */
static const named_bytes scattered_parts[4] = {{"dir/a.gltf", scattered, sizeof scattered - 1},
                                               {"points.bin", corners, sizeof corners},
                                               {"faces.bin", faces, sizeof faces},
                                               {"a b.png", picture, sizeof picture}};

static reply post_files(loopback *loop, const char *target, const named_bytes *parts, size_t count) {
  char form[8192];
  size_t size = 0;
  for (size_t i = 0; i < count; i++) {
    size += (size_t)sprintf(form + size,
                            "--xyz\r\nContent-Disposition: form-data; name=\"file\"; filename=\"%s\"\r\n\r\n",
                            parts[i].name);
    memcpy(form + size, parts[i].bytes, parts[i].size);
    if (strstr(parts[i].name, "gltf")) quote_bytes(form + size, parts[i].size);
    size += parts[i].size;
    size += (size_t)sprintf(form + size, "\r\n");
  }
  size += (size_t)sprintf(form + size, "--xyz--\r\n");
  return loopback_ask(loop, "POST", target, "Content-Type: multipart/form-data; boundary=xyz\n", form, size);
}

static cJSON *described(reply r, int status) {
  if (r.status != status) fail_msg("%d %s", r.status, r.body);
  cJSON *tree = cJSON_Parse(r.body);
  reply_free(&r);
  return tree;
}

TEST_WITH(a_gltf_and_its_files_are_one_glb_in_any_order, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT] = "", target[64];
  for (size_t turn = 0; turn < 4; turn++) {
    named_bytes parts[4];
    for (size_t i = 0; i < 4; i++) parts[i] = scattered_parts[(i + turn) % 4];
    cJSON *tree = described(post_files(*state, "/v1/models", parts, 4), turn ? 200 : 201);
    assert_string_equal(json_member(tree, "format")->valuestring, "glb");
    if (turn > 0) assert_string_equal(json_member(tree, "id")->valuestring, id);
    snprintf(id, sizeof id, "%s", json_member(tree, "id")->valuestring);
    assert_int_equal(json_member(cJSON_GetArrayItem(json_member(tree, "meshes"), 0), "faces")->valueint, 1);
    cJSON_Delete(tree);
  }
  assert_int_equal(loopback_store_count(*state), 1);
  snprintf(target, sizeof target, "/v1/models/%s/source", id);
  reply r = loopback_get(*state, target);
  assert_int_equal(r.status, 200);
  cJSON *document = cJSON_Parse(r.body + 20);
  const cJSON *buffers = json_member(document, "buffers"), *views = json_member(document, "bufferViews");
  assert_int_equal(cJSON_GetArraySize(buffers), 2); /* the chunk, and the data URI */
  assert_int_equal(json_member(buffers->child, "byteLength")->valueint, 36 + 12 + 12);
  assert_int_equal(cJSON_GetArraySize(views), 3); /* both images are one file */
  assert_int_equal(json_member(cJSON_GetArrayItem(views, 1), "byteOffset")->valueint, 38);
  assert_string_equal(json_member(cJSON_GetArrayItem(views, 1), "name")->valuestring, "i");
  const cJSON *images = json_member(document, "images");
  assert_string_equal(json_member(images->child, "uri")->valuestring, "https://example.com/a.png");
  for (int i = 1; i < 4; i += 2) {
    const cJSON *image = cJSON_GetArrayItem(images, i);
    assert_int_equal(json_member(image, "bufferView")->valueint, 2);
    assert_string_equal(json_member(image, "mimeType")->valuestring, "image/png");
    assert_null(cJSON_GetObjectItem(image, "uri"));
  }
  int at = json_member(cJSON_GetArrayItem(views, 2), "byteOffset")->valueint;
  assert_int_equal(at, 48);
  assert_memory_equal(r.body + r.size - 12, picture, sizeof picture);
  cJSON_Delete(document);
  reply_free(&r);
}

/* A GLB of one triangle whose picture and faces are other files, and with bytes behind its end. *size: its
 * bytes, malloc'ed. */
static uint8_t *scattered_glb(size_t *size) {
  static const char json[] =
      "{'asset':{'version':'2.0'},'images':[{'uri':'tex/a%20b.png'}],'textures':[{'source':0}],"
      "'materials':[{'emissiveTexture':{'index':0}}],'meshes':[{'primitives':[{'attributes':{'POSITION':0},"
      "'indices':1,'material':0}]}],'accessors':[{'bufferView':0,'componentType':5126,'count':3,"
      "'type':'VEC3'},{'bufferView':1,'componentType':5123,'count':3,'type':'SCALAR'}],"
      "'bufferViews':[{'buffer':0,'byteLength':36},{'buffer':1,'byteOffset':2,'byteLength':6}],"
      "'buffers':[{'byteLength':36,'extras':7},{'uri':'faces.bin','byteLength':8}]}";
  uint32_t json_size = (uint32_t)(sizeof json - 1 + 3) / 4 * 4;
  const uint32_t head[5] = {0x46546C67, 2, 28 + json_size + 36, json_size, 0x4E4F534A},
                 bin[2] = {36, 0x004E4942};
  *size = head[2] + 6;
  uint8_t *glb = malloc(*size);
  assert_non_null(glb);
  memcpy(glb, head, sizeof head);
  memset(glb + 20, ' ', json_size);
  memcpy(glb + 20, json, sizeof json - 1);
  quote_bytes(glb + 20, json_size);
  memcpy(glb + 20 + json_size, bin, sizeof bin);
  memcpy(glb + 28 + json_size, corners, sizeof corners);
  memcpy(glb + *size - 6, "behind", 6);
  return glb;
}

TEST_WITH(a_glb_comes_with_the_files_that_it_names, loopback_setup, loopback_teardown) {
  size_t size;
  uint8_t *glb = scattered_glb(&size);
  const named_bytes parts[] = {{"tex/a b.png", picture, 9}, {"a.glb", glb, size}, {"faces.bin", faces, 9}};
  assert_problem(post_files(*state, "/v1/models", parts, 2), 422, "/buffers/1/uri", "faces.bin");
  reply r = post_files(*state, "/v1/models", parts, 3);
  assert_int_equal(r.status, 201);
  assert_says(&r, "'faces':1,");
  assert_says(&r, "6 bytes behind the GLB are left out");
  cJSON *tree = cJSON_Parse(r.body);
  char target[API_ID_TEXT + 40];
  snprintf(target, sizeof target, "/v1/models/%s/source", json_member(tree, "id")->valuestring);
  cJSON_Delete(tree);
  reply_free(&r);
  r = loopback_get(*state, target);
  cJSON *document = cJSON_Parse(r.body + 20);
  const cJSON *views = json_member(document, "bufferViews");
  assert_int_equal(cJSON_GetArraySize(json_member(document, "buffers")), 1);
  assert_int_equal(cJSON_GetArraySize(views), 3);
  assert_int_equal(json_member(views->child, "byteOffset")->valueint, 0);
  assert_int_equal(json_member(views->child->next, "byteOffset")->valueint, 36 + 2);
  assert_int_equal(json_member(json_member(document, "images")->child, "bufferView")->valueint, 2);
  assert_memory_equal(r.body + r.size - 6, "behind", 6);
  assert_memory_equal(r.body + r.size - 6 - 12 - 12 - 36, corners, sizeof corners);
  cJSON_Delete(document);
  reply_free(&r);
  free(glb);
}

TEST_WITH(surfaces_and_poses_take_a_gltf_and_its_files, loopback_setup, loopback_teardown) {
  cJSON *tree = described(post_files(*state, "/v1/surface.json", scattered_parts, 4), 200);
  assert_int_equal(json_member(tree, "faces")->valueint, 3);
  cJSON_Delete(tree);
  cJSON_Delete(described(post_files(*state, "/v1/pose.json", scattered_parts, 4), 200));
  assert_int_equal(loopback_store_count(*state), 0);
}

TEST_WITH(a_file_that_was_not_sent_is_named, loopback_setup, loopback_teardown) {
  const named_bytes *all = scattered_parts;
  const named_bytes no_points[] = {all[0], all[2], all[3]}, no_picture[] = {all[0], all[1], all[2]};
  assert_problem(post_files(*state, "/v1/models", no_points, 3), 422, "/buffers/1/uri", "points.bin");
  assert_problem(post_files(*state, "/v1/models", no_picture, 3), 422, "/images/1/uri", "tex/a b.png");
  assert_problem(post_files(*state, "/v1/models", all, 1), 422, NULL, "was not sent");
  const named_bytes twice[] = {all[0], all[1], all[2], {"x/a b.png", picture, 9}, {"y/a b.png", picture, 9}};
  assert_problem(post_files(*state, "/v1/models", twice, 5), 422, "/images/1/uri", "several files");
  const named_bytes by_path[] = {
      all[0], all[1], all[2], {"tex/a b.png", picture, 9}, {"y/a b.png", picture, 9}};
  reply r = post_files(*state, "/v1/models", by_path, 5);
  assert_int_equal(r.status, 201);
  assert_string_equal(reply_header(&r, "X-Tweend-Warning"),
                      "4; the%20glTF%20does%20not%20name%20the%20file%20y%2Fa%20b.png");
  reply_free(&r);
  assert_int_equal(loopback_store_count(*state), 1);
}

TEST_WITH(files_that_do_not_fit_a_gltf_are_refused, loopback_setup, loopback_teardown) {
  const named_bytes *all = scattered_parts;
  const named_bytes narrow[] = {all[0], {"points.bin", corners, 35}, all[2], all[3]};
  assert_problem(post_files(*state, "/v1/models", narrow, 4), 422, "/buffers/1/byteLength", "35 bytes");
  const named_bytes text[] = {all[0], all[1], all[2], {"a b.png", "no picture", 10}};
  assert_problem(post_files(*state, "/v1/models", text, 4), 422, "/images/1/uri", "neither PNG");
  const named_bytes two[] = {all[0], all[1], all[2], all[3], all[0]};
  assert_problem(post_files(*state, "/v1/models", two, 5), 400, NULL, "more than one file");
  static const char past[] = "{'asset':{'version':'2.0'},'buffers':[{'uri':'a','byteLength':4},"
                             "{'uri':'b','byteLength':4}],'bufferViews':[{'buffer':0,'byteLength':5}]}";
  const named_bytes beyond[] = {{"x.gltf", past, sizeof past - 1}, {"a", "1234", 4}, {"b", "5678", 4}};
  assert_problem(post_files(*state, "/v1/models", beyond, 3), 422, "/bufferViews/0", "within a buffer");
  assert_int_equal(loopback_store_count(*state), 0);
}

TEST_WITH(a_plain_gltf_must_not_name_files, loopback_setup, loopback_teardown) {
  static const char with_link[] =
      "{'asset':{'version':'2.0'},'images':[{'uri':'https://example.com/a.png'}]}",
                    with_file[] = "{'asset':{'version':'2.0'},'images':[{'uri':'..\\/a.png'}]}";
  assert_problem(loopback_post(*state, "/v1/models", "model/gltf+json", with_file), 422, "/images/0/uri",
                 "../a.png");
  cJSON *tree = described(loopback_post(*state, "/v1/models", "model/gltf+json", with_link), 201);
  assert_int_equal(cJSON_GetArraySize(json_member(tree, "warnings")), 1);
  cJSON_Delete(tree);
}

/* ---- lists ----------------------------------------------------------------------------------- */

/* Uploads `count` models that differ. */
static void upload_many(loopback *loop, int count) {
  for (int i = 0; i < count; i++) {
    char text[64], id[API_ID_TEXT];
    snprintf(text, sizeof text, "{'nodes':[{'name':'n%d'}]}", i);
    loopback_upload(loop, "application/json", text, id);
  }
}

/* Walks the pages; returns how many models were listed, each with a name like n7. */
static int walk_list(loopback *loop, const char *first) {
  char url[128];
  char last[API_ID_TEXT] = "";
  int seen = 0;
  strcpy(url, first);
  while (url[0]) {
    reply r = loopback_get(loop, url);
    assert_int_equal(r.status, 200);
    cJSON *page = cJSON_Parse(r.body);
    const cJSON *item;
    cJSON_ArrayForEach(item, json_member(page, "models")) {
      const char *id = json_member(item, "id")->valuestring;
      assert_true(strcmp(last, id) < 0);
      strcpy(last, id);
      assert_int_equal(json_member(item, "name")->valuestring[0], 'n');
      assert_string_equal(json_member(item, "format")->valuestring, "tweend");
      assert_true(json_member(item, "bytes")->valueint > 20);
      seen++;
    }
    const cJSON *next = json_member(page, "next");
    assert_int_equal(cJSON_IsString(next), reply_header(&r, "Link") != NULL);
    strcpy(url, cJSON_IsString(next) ? next->valuestring : "");
    cJSON_Delete(page);
    reply_free(&r);
  }
  return seen;
}

TEST_WITH(the_list_is_walked_page_by_page, loopback_setup, loopback_teardown) {
  reply r = loopback_get(*state, "/v1/models");
  assert_body(&r, "{'models':[],'next':null}\n");
  reply_free(&r);
  upload_many(*state, 11);
  assert_int_equal(walk_list(*state, "/v1/models"), 11);
  assert_int_equal(walk_list(*state, "/v1/models?limit=1"), 11);
  assert_int_equal(walk_list(*state, "/v1/models?limit=11"), 11);
  assert_int_equal(walk_list(*state, "/v1/models?limit=4"), 11);
}

TEST_WITH(lost_summaries_are_made_again, loopback_setup, loopback_teardown) {
  upload_many(*state, 3);
  loopback_store_forget_summaries(*state);
  assert_int_equal(walk_list(*state, "/v1/models?limit=2"), 3);
}

TEST_WITH(bad_paging_is_400, loopback_setup, loopback_teardown) {
  const char *const bad[] = {"limit=0",  "limit=1001", "limit=x",
                             "limit=-1", "limit=",     "limit=1&limit=2",
                             "after=x",  "after=",     "after=0123456789ABCDEF0123456789ABCDEF",
                             "before=1"};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char target[128];
    snprintf(target, sizeof target, "/v1/models?%s", bad[i]);
    assert_problem(loopback_get(*state, target), 400, NULL, NULL);
  }
}

/* ---- sources, validators --------------------------------------------------------------------- */

static void assert_source(loopback *loop, const char *id, const char *type, const char *extension) {
  char path[80], file[80];
  snprintf(path, sizeof path, "/v1/models/%s/source?download=1", id);
  reply r = loopback_get(loop, path);
  assert_int_equal(r.status, 200);
  assert_string_equal(reply_header(&r, "Content-Type"), type);
  snprintf(file, sizeof file, "model.%s\"", extension);
  assert_non_null(strstr(reply_header(&r, "Content-Disposition"), file));
  reply_free(&r);
}

/* Five facets, more bytes than a look at the beginning takes. */
TEST_WITH(the_source_of_binary_stl_has_its_type, loopback_setup, loopback_teardown) {
  enum { FACETS = 5, SIZE = 84 + 50 * FACETS };
  uint8_t stl[SIZE] = {[80] = FACETS};
  for (size_t f = 0; f < FACETS; f++)
    for (size_t p = 0; p < 3; p++) {
      const float point[3] = {p == 1 ? 1 : 0, p == 2 ? 1 : 0, (float)f};
      memcpy(stl + 84 + 50 * f + 12 * (1 + p), point, sizeof point);
    }
  reply r = loopback_ask(*state, "POST", "/v1/models", "Content-Type: model/stl\n", stl, SIZE);
  assert_says(&r, "'format':'stl'");
  char id[API_ID_TEXT];
  memcpy(id, reply_header(&r, "Location") + strlen("/v1/models/"), sizeof id);
  reply_free(&r);
  assert_source(*state, id, "model/stl", "stl");
  loopback_store_forget_summaries(*state);
  assert_source(*state, id, "model/stl", "stl");
}

static reply get_with(loopback *loop, const char *path, const char *headers) {
  return loopback_ask(loop, "GET", path, headers, NULL, 0);
}

TEST_WITH(the_source_comes_back_whole_and_in_parts, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64], header[128];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  reply r = loopback_get(*state, path);
  assert_int_equal(r.status, 200);
  assert_string_equal(r.body, triangle);
  assert_string_equal(reply_header(&r, "Content-Type"), "model/obj");
  assert_string_equal(reply_header(&r, "Accept-Ranges"), "bytes");
  char etag[80];
  strcpy(etag, reply_header(&r, "ETag"));
  reply_free(&r);
  static const struct {
    const char *range;
    size_t first, count;
  } parts[] = {{"0-0", 0, 1},
               {"2-6", 2, 5},
               {"-4", sizeof triangle - 5, 4},
               {"3-", 3, sizeof triangle - 4},
               {"1-9999", 1, sizeof triangle - 2},
               {"-9999", 0, sizeof triangle - 1},
               {"0-1,2-4", 0, 5},
               {"4-5 , 1-3,2-3", 1, 5},
               {"9999-,3-4", 3, 2}};
  for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
    snprintf(header, sizeof header, "Range: bytes=%s\n", parts[i].range);
    r = get_with(*state, path, header);
    assert_int_equal(r.status, 206);
    assert_int_equal(r.size, parts[i].count);
    assert_memory_equal(r.body, triangle + parts[i].first, parts[i].count);
    snprintf(header, sizeof header, "bytes %zu-%zu/%zu", parts[i].first, parts[i].first + parts[i].count - 1,
             sizeof triangle - 1);
    assert_string_equal(reply_header(&r, "Content-Range"), header);
    reply_free(&r);
  }
  const char *const whole[] = {"Range: bytes=5-2\n",
                               "Range: bytes=x\n",
                               "Range: lines=1-2\n",
                               "Range: bytes=-\n",
                               "Range: bytes=0-1,3-4\n",
                               "Range: bytes=0-1,\n",
                               "Range: bytes=0-1,x\n",
                               "Range: bytes=0-1\nIf-Range: \"other\"\n",
                               "Range: bytes=0-1\nIf-Range: Sat, 21 Nov 2026 00:00:00 GMT\n",
                               "Range: bytes=99999999999999999999999-\n"};
  for (size_t i = 0; i < sizeof whole / sizeof *whole; i++) {
    r = get_with(*state, path, whole[i]);
    assert_int_equal(r.status, 200);
    assert_int_equal(r.size, sizeof triangle - 1);
    reply_free(&r);
  }
  snprintf(header, sizeof header, "Range: bytes=0-1\nIf-Range: %s\n", etag);
  r = get_with(*state, path, header);
  assert_int_equal(r.status, 206);
  reply_free(&r);
  r = get_with(*state, path, "Range: bytes=1000-\n");
  snprintf(header, sizeof header, "bytes */%zu", sizeof triangle - 1);
  assert_string_equal(reply_header(&r, "Content-Range"), header);
  assert_problem(r, 416, NULL, NULL);
  assert_problem(get_with(*state, path, "Range: bytes=-0\n"), 416, NULL, NULL);
}

TEST_WITH(validators_save_sending, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], paths[2][64], headers[256];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(paths[0], sizeof paths[0], "/v1/models/%s", id);
  snprintf(paths[1], sizeof paths[1], "/v1/models/%s/source", id);
  for (int i = 0; i < 2; i++) {
    reply r = loopback_get(*state, paths[i]);
    char etag[80];
    strcpy(etag, reply_header(&r, "ETag"));
    assert_string_equal(reply_header(&r, "Cache-Control"), "public, max-age=31536000, immutable");
    const char *vary = i == 0 ? "Accept, Accept-Encoding" : "Accept-Encoding"; /* a source has one type */
    assert_string_equal(reply_header(&r, "Vary"), vary);
    reply_free(&r);
    const char *const hits[] = {"If-None-Match: %s\n", "If-None-Match: \"a\", W/%s\n", "If-None-Match:  * \n",
                                "If-None-Match: \"x,y\" ,%s , \"b\"\n"};
    for (size_t j = 0; j < sizeof hits / sizeof *hits; j++) {
      snprintf(headers, sizeof headers, hits[j], etag);
      r = get_with(*state, paths[i], headers);
      assert_int_equal(r.status, 304);
      assert_int_equal(r.size, 0);
      assert_string_equal(reply_header(&r, "ETag"), etag);
      assert_string_equal(reply_header(&r, "Vary"), vary);
      assert_null(reply_header(&r, "Content-Type"));
      reply_free(&r);
    }
    const char *const misses[] = {"If-None-Match: \"a\"\n", "If-None-Match: a\n", "If-Match: %s\n"};
    for (size_t j = 0; j < sizeof misses / sizeof *misses; j++) {
      snprintf(headers, sizeof headers, misses[j], etag);
      r = get_with(*state, paths[i], headers);
      assert_int_equal(r.status, 200);
      reply_free(&r);
    }
    assert_problem(get_with(*state, paths[i], "If-Match: \"a\"\n"), 412, NULL, NULL);
    snprintf(headers, sizeof headers, "If-Match: W/%s\n", etag);
    assert_problem(get_with(*state, paths[i], headers), 412, NULL, NULL);
  }
}

TEST_WITH(head_has_the_headers_of_get, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply get = loopback_get(*state, path);
  reply head = loopback_ask(*state, "HEAD", path, NULL, NULL, 0);
  assert_int_equal(head.status, 200);
  assert_int_equal(head.answer.bytes.size, get.answer.bytes.size);
  assert_string_equal(reply_header(&head, "ETag"), reply_header(&get, "ETag"));
  reply_free(&head);
  reply_free(&get);
}

/* ---- deleting, absence, the store ------------------------------------------------------------ */

TEST_WITH(deleting_forgets_the_model_at_once, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply r = loopback_get(*state, path);
  assert_int_equal(r.status, 200);
  assert_true(loopback_is_light(*state, path));
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  assert_int_equal(r.size, 0);
  reply_free(&r);
  assert_problem(loopback_get(*state, path), 404, NULL, id);
  assert_problem(loopback_ask(*state, "DELETE", path, NULL, NULL, 0), 404, NULL, NULL);
  strcat(path, "/source");
  assert_problem(loopback_get(*state, path), 404, NULL, NULL);
  r = loopback_post(*state, "/v1/models", "model/obj", triangle);
  assert_int_equal(r.status, 201);
  reply_free(&r);
}

TEST_WITH(what_if_none_match_names_is_not_deleted, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64], headers[160];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply plain = loopback_get(*state, path);
  const char *const hits[] = {"If-None-Match: *\n", "If-None-Match: \"a\", %s\n", "If-None-Match: W/%s\n"};
  for (size_t i = 0; i < sizeof hits / sizeof *hits; i++) {
    snprintf(headers, sizeof headers, hits[i], reply_header(&plain, "ETag"));
    assert_problem(loopback_ask(*state, "DELETE", path, headers, NULL, 0), 412, NULL, "If-None-Match");
  }
  reply_free(&plain);
  assert_int_equal(loopback_store_count(*state), 1);
  reply r = loopback_ask(*state, "DELETE", path, "If-None-Match: \"a\", *\n", NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  const char *const conditions[] = {"If-None-Match: *\n", "If-Match: \"a\"\n"};
  for (size_t i = 0; i < sizeof conditions / sizeof *conditions; i++) /* nothing is there to be judged */
    assert_problem(loopback_ask(*state, "DELETE", path, conditions[i], NULL, 0), 404, NULL, NULL);
}

TEST_WITH(what_if_match_does_not_name_is_not_deleted, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64], headers[160];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply packed = get_with(*state, path, "Accept-Encoding: gzip\n");
  const char *const misses[] = {"If-Match: \"a\"\n", "If-Match: W/%s\n"};
  for (size_t i = 0; i < sizeof misses / sizeof *misses; i++) {
    snprintf(headers, sizeof headers, misses[i], reply_header(&packed, "ETag"));
    assert_problem(loopback_ask(*state, "DELETE", path, headers, NULL, 0), 412, NULL, "If-Match");
  }
  assert_int_equal(loopback_store_count(*state), 1);
  snprintf(headers, sizeof headers, "If-Match: \"a\", %s\n", reply_header(&packed, "ETag"));
  reply_free(&packed);
  reply r = loopback_ask(*state, "DELETE", path, headers, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  assert_problem(loopback_ask(*state, "DELETE", path, "If-Match: *\n", NULL, 0), 404, NULL, NULL);
}

/* A name is no part of the bytes that the id is made of: once the model is deleted, another may be given. */
TEST_WITH(the_tag_of_a_description_is_of_its_name, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64], first[160], headers[192];
  reply r = loopback_post(*state, "/v1/models?name=one", "model/obj", triangle);
  snprintf(first, sizeof first, "%s", reply_header(&r, "ETag"));
  reply_free(&r);
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  r = loopback_get(*state, path);
  assert_string_equal(reply_header(&r, "ETag"), first);
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
  r = loopback_post(*state, "/v1/models?name=two", "model/obj", triangle);
  assert_string_not_equal(reply_header(&r, "ETag"), first);
  reply_free(&r);
  snprintf(headers, sizeof headers, "If-None-Match: %s\n", first);
  r = get_with(*state, path, headers);
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(r.body, "\"two\""));
  assert_string_not_equal(reply_header(&r, "ETag"), first);
  snprintf(headers, sizeof headers, "If-Match: %s\n", first);
  assert_problem(loopback_ask(*state, "DELETE", path, headers, NULL, 0), 412, NULL, "If-Match");
  snprintf(headers, sizeof headers, "If-Match: %s\n", reply_header(&r, "ETag"));
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, headers, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
}

TEST_WITH(who_stores_a_model_second_is_told_the_first_ones_name, loopback_setup, loopback_teardown) {
  char path[64], headers[192];
  loopback_store_come_second(*state, "{\"name\":\"first\",\"format\":\"obj\"}");
  reply r = loopback_post(*state, "/v1/models?name=second", "model/obj", triangle);
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(r.body, "\"name\":\"first\""));
  assert_null(strstr(r.body, "second"));
  snprintf(path, sizeof path, "%s", reply_header(&r, "Location"));
  snprintf(headers, sizeof headers, "If-Match: %s\n", reply_header(&r, "ETag"));
  reply described = loopback_get(*state, path);
  assert_string_equal(described.body, r.body);
  assert_string_equal(reply_header(&described, "ETag"), reply_header(&r, "ETag"));
  reply_free(&described);
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, headers, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
}

TEST_WITH(a_warning_is_told_once_by_who_stores_a_model_second, loopback_setup, loopback_teardown) {
  static const char reversed[] =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nf 1 2 3 4\nf 2 3 6 5\n";
  reply r = loopback_post(*state, "/v1/models?name=alone", "model/obj", reversed);
  assert_int_equal(r.status, 201);
  char alone[512], path[64];
  snprintf(path, sizeof path, "%s", reply_header(&r, "Location"));
  snprintf(alone, sizeof alone, "%s", reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
  r = loopback_ask(*state, "DELETE", path, NULL, NULL, 0);
  reply_free(&r);
  loopback_store_come_second(*state, "{\"name\":\"first\",\"format\":\"obj\"}");
  r = loopback_post(*state, "/v1/models?name=second", "model/obj", reversed);
  assert_non_null(strstr(r.body, "\"name\":\"first\""));
  assert_string_equal(reply_header(&r, "X-Tweend-Warning"), alone);
  reply_free(&r);
}

TEST_WITH(ids_that_cannot_be_are_404, loopback_setup, loopback_teardown) {
  const char *const ids[] = {"x",
                             "0123456789ABCDEF0123456789ABCDEF",
                             "0123456789abcdef0123456789abcde",
                             "0123456789abcdef0123456789abcdef0",
                             "..",
                             "%2e%2e",
                             ""};
  for (size_t i = 0; i < sizeof ids / sizeof *ids; i++) {
    char path[96];
    snprintf(path, sizeof path, "/v1/models/%s", ids[i]);
    assert_problem(loopback_get(*state, path), 404, NULL, NULL);
    assert_string_equal(api_route_name(path), "other");
  }
  assert_string_equal(api_route_name("/v1/models/0123456789abcdef0123456789abcdef/source"),
                      "/v1/models/{id}/source");
}

TEST_WITH(an_unreachable_store_is_503_and_nothing_is_remembered, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "application/json", "{'nodes':[{}]}", id);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  loopback_store_fail(*state, true);
  reply r = loopback_post(*state, "/v1/models", "model/obj", triangle);
  assert_non_null(reply_header(&r, "Retry-After"));
  assert_problem(r, 503, NULL, "store");
  assert_problem(loopback_get(*state, path), 503, NULL, "store");
  assert_problem(loopback_get(*state, "/v1/models"), 503, NULL, "store");
  path[strlen(path) - strlen("/source")] = '\0';
  assert_problem(loopback_ask(*state, "DELETE", path, NULL, NULL, 0), 503, NULL, "store");
  loopback_store_fail(*state, false);
  char triangle_path[64];
  snprintf(triangle_path, sizeof triangle_path, "/v1/models/%s", triangle_id);
  assert_problem(loopback_get(*state, triangle_path), 404, NULL, NULL);
}

/* With the clip that poses and tracks are about. */
static const char turning[] =
    "{'meshes':[{'name':'tip','positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,2]]}],"
    "'nodes':[{'name':'tip','mesh':'tip'}],'clips':[{'name':'turn','tracks':[{'node':'tip',"
    "'path':'rotation','times':[0,1],'quaternions':[[0,0,0,1],[0,1,0,0]]}]}]}";

static const char *const tails[] = {"",
                                    "/source",
                                    "/surface.obj?level=1",
                                    "/surface.json?level=3",
                                    "/pose.json?at=0.5",
                                    "/tracks",
                                    "/live?fps=10&loop=clamp"};

/* Asks for all that there is of a model, each afresh. */
static void assert_all_damaged(loopback *loop, const char *id) {
  for (size_t i = 0; i < sizeof tails / sizeof *tails; i++) {
    char path[128];
    snprintf(path, sizeof path, "/v1/models/%s%s", id, tails[i]);
    assert_problem(loopback_get(loop, path), 500, NULL, "the stored bytes are damaged; upload them again");
  }
}

TEST_WITH(a_damaged_model_is_500_until_it_is_uploaded_again, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], path[128];
  loopback_upload(loop, "application/json", turning, id);
  loopback_store_damage(loop, id);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  /* The model is in the cache: the first to read the store says so for all. */
  assert_problem(loopback_get(loop, path), 500, NULL, "damaged");
  assert_all_damaged(loop, id);
  reply r = loopback_post(loop, "/v1/models", "application/json", turning);
  assert_int_equal(r.status, 201);
  reply_free(&r);
  for (size_t i = 0; i < sizeof tails / sizeof *tails; i++) {
    snprintf(path, sizeof path, "/v1/models/%s%s", id, tails[i]);
    if (strstr(path, "/live")) continue; /* its frames are for live_poses_test */
    r = loopback_get(loop, path);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
}

TEST_WITH(a_description_is_not_told_of_a_damaged_model, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], path[64];
  loopback_upload(loop, "application/json", turning, id); /* which leaves the model in the cache */
  loopback_store_damage(loop, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  assert_problem(loopback_get(loop, path), 500, NULL, "damaged");
}

TEST_WITH(a_damaged_model_is_left_out_of_a_list_that_must_read_it, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT];
  loopback_upload(loop, "application/json", turning, id);
  upload_many(loop, 2);
  loopback_store_forget_summaries(loop);
  loopback_store_damage(loop, id);
  char path[64];
  snprintf(path, sizeof path, "/v1/models/%s", id);
  assert_problem(loopback_get(loop, path), 500, NULL, NULL);
  assert_int_equal(walk_list(loop, "/v1/models"), 2);
}

static const char *no_header(void *context, const char *name) {
  (void)context;
  (void)name;
  return NULL;
}

TEST_WITH(what_is_cached_of_a_damaged_model_is_not_answered, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], path[96];
  loopback_upload(loop, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s/surface.glb", id);
  reply r = loopback_get(loop, path);
  assert_int_equal(r.status, 200);
  reply_free(&r);
  assert_true(loopback_is_light(loop, path));
  loopback_store_damage(loop, id);
  assert_problem(loopback_get(loop, path), 500, NULL, "damaged");
  r = loopback_post(loop, "/v1/models", "model/obj", triangle);
  assert_int_equal(r.status, 201);
  reply_free(&r);
  r = loopback_get(loop, path);
  assert_int_equal(r.status, 200);
  reply_free(&r);
}

TEST_WITH(bytes_that_cannot_be_read_on_end_the_answer, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], path[64];
  loopback_upload(loop, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  api_ticket ticket = {0}; /* nobody else asks: it is never woken */
  const api_request request = {
      .method = "GET", .path = path, .query = "", .id = "request-1", .header = no_header, .ticket = &ticket};
  api_answer answer = {0};
  assert_int_equal(api_handle(loop->service, &request, API_HEAVY, &answer), API_ANSWERED);
  assert_int_equal(answer.status, 200);
  uint8_t piece[4];
  assert_int_equal(answer.body.read(answer.body.context, piece, sizeof piece), sizeof piece);
  loopback_store_cut(loop, true);
  assert_int_equal(answer.body.read(answer.body.context, piece, sizeof piece), -1);
  api_answer_deinit(&answer);
  api_ticket_end(loop->service, &ticket);
  loopback_store_forget_summaries(loop); /* so that the bytes are read for their format */
  reply r = loopback_get(loop, path);
  assert_int_equal(r.answer.refusal, API_REFUSAL_STORE);
  assert_non_null(reply_header(&r, "Retry-After"));
  assert_problem(r, 503, NULL, "cannot be reached"); /* nothing says that the bytes are damaged */
  loopback_store_cut(loop, false);
  r = loopback_get(loop, path);
  assert_int_equal(r.status, 200);
  reply_free(&r);
}

TEST_WITH(the_source_has_the_type_of_its_format_however_it_begins, loopback_setup, loopback_teardown) {
  static const struct {
    const char *begin;
    size_t blanks;
    const char *end, *type;
  } cases[] = {
      {"", 0, triangle, "model/obj"},
      {"", 300, triangle, "model/obj"},
      {"", 300, turning, "application/json"},
      {"{", 300, "'nodes':[{}],'asset':{'version':'2.0'}}", "model/gltf+json"},
      {"{'asset':{'version':'2.0'},", 300, "'nodes':[{}]}", "model/gltf+json"},
      {"{", 300, "'nodes':[{'name':'asset'}]}", "application/json"},
  };
  enum { CASES = sizeof cases / sizeof *cases };
  for (size_t i = 0; i < 2 * CASES; i++) {
    if (i == CASES) loopback_store_forget_summaries(*state);
    char text[1024], id[API_ID_TEXT], path[64];
    snprintf(text, sizeof text, "%s%*s%s", cases[i % CASES].begin, (int)cases[i % CASES].blanks, "",
             cases[i % CASES].end);
    loopback_upload(*state, "application/octet-stream", text, id);
    snprintf(path, sizeof path, "/v1/models/%s/source", id);
    reply r = loopback_get(*state, path);
    assert_int_equal(r.status, 200);
    assert_body(&r, text);
    assert_string_equal(reply_header(&r, "Content-Type"), cases[i % CASES].type);
    reply_free(&r);
  }
}

/* All is read to tell the format where no summary does. */
TEST_WITH(a_source_without_summary_waits_for_the_memory_to_read_it, loopback_setup, loopback_teardown) {
  enum { SMALL = 16 }; /* requests that take what large ones leave */
  loopback *loop = *state;
  const api_progress expected[] = {API_ANSWERED, API_WAITS};
  char id[API_ID_TEXT], path[64], *text = malloc(2 * API_UNGRANTED);
  assert_non_null(text);
  snprintf(text, 2 * API_UNGRANTED, "%s#%*s\n", triangle, API_UNGRANTED, "");
  loopback_upload(loop, "model/obj", text, id);
  free(text);
  snprintf(path, sizeof path, "/v1/models/%s/source", id);
  for (size_t i = 0; i < 2; i++) {
    if (i == 1) loopback_store_forget_summaries(loop);
    loopback_ticket *owner = loopback_ticket_create(), *asker = loopback_ticket_create();
    api_ticket small[SMALL] = {0};
    assert_true(api_budget_grant(loop->service->budget, &owner->ticket, loop->settings.limits.max_memory));
    for (int k = 0; k < SMALL; k++) api_budget_grant(loop->service->budget, &small[k], 4 << 20);
    const api_request request = {.method = "GET",
                                 .path = path,
                                 .query = "",
                                 .id = "request-1",
                                 .header = no_header,
                                 .ticket = &asker->ticket};
    api_answer answer = {0};
    assert_int_equal(api_handle(loop->service, &request, API_HEAVY, &answer), expected[i]);
    for (int k = 0; k < SMALL; k++) api_budget_grant(loop->service->budget, &small[k], 0);
    api_budget_grant(loop->service->budget, &owner->ticket, 0);
    if (expected[i] == API_WAITS) {
      loopback_ticket_await(asker);
      assert_int_equal(api_handle(loop->service, &request, API_HEAVY, &answer), API_ANSWERED);
    }
    assert_int_equal(answer.status, 200);
    api_answer_deinit(&answer);
    loopback_ticket_destroy(loop, owner);
    loopback_ticket_destroy(loop, asker);
  }
}

TEST_WITH(a_known_model_is_answered_without_the_store, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "model/obj", triangle, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  assert_false(loopback_is_light(*state, path));
  reply r = loopback_get(*state, path);
  reply_free(&r);
  size_t opens = loopback_store_opens(*state);
  assert_true(loopback_is_light(*state, path));
  assert_int_equal(loopback_store_opens(*state), opens);
}

TEST_WITH(seeding_is_storing, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  assert_int_equal(api_seed(loop->service, "seed.obj", (const uint8_t *)triangle, strlen(triangle)), 201);
  assert_int_equal(api_seed(loop->service, "seed.obj", (const uint8_t *)triangle, strlen(triangle)), 200);
  assert_int_equal(api_seed(loop->service, "seed.obj", (const uint8_t *)"{\"nodes\":7}", 11), 400);
  assert_int_equal(loopback_store_count(loop), 1);
}

/* ---- keys ------------------------------------------------------------------------------------ */

static int start_with_keys(void **state) {
  static const api_key keys[] = {{"alpha", ALL_RIGHTS, {0}}, {"beta", ALL_RIGHTS, {0}}};
  api_settings settings = loopback_settings();
  settings.keyring = (api_keyring){.keys = keys, .count = 2};
  *state = loopback_start(&settings);
  return 0;
}

TEST_WITH(models_ask_for_a_key_where_keys_are_configured, start_with_keys, loopback_teardown) {
  reply r = loopback_get(*state, "/v1/models");
  assert_true(r.refused);
  assert_string_equal(reply_header(&r, "WWW-Authenticate"), "Bearer realm=\"tweend\"");
  assert_problem(r, 401, NULL, NULL);
  const char *const wrong[] = {"X-API-Key: alph\n", "X-API-Key: alphaa\n", "X-API-Key: \n",
                               "Authorization: Bearer gamma\n"};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
    assert_problem(get_with(*state, "/v1/models", wrong[i]), 403, NULL, NULL);
  assert_problem(get_with(*state, "/v1/models", "Authorization: Basic YWxwaGE=\n"), 401, NULL, NULL);
  const char *const right[] = {"X-API-Key: alpha\n", "Authorization: bearer beta\n", "X-API-Key: beta\n"};
  for (size_t i = 0; i < sizeof right / sizeof *right; i++) {
    r = get_with(*state, "/v1/models", right[i]);
    assert_int_equal(r.status, 200);
    reply_free(&r);
  }
  r = loopback_ask(*state, "OPTIONS", "/v1/models", NULL, NULL, 0);
  assert_int_equal(r.status, 204);
  reply_free(&r);
}

/* ---- names ----------------------------------------------------------------------------------- */

static void assert_named(loopback *loop, const char *target, const char *headers, const char *body,
                         const char *name) {
  reply r = loopback_ask(loop, "POST", target, headers, body, strlen(body));
  assert_true(r.status == 201 || r.status == 200);
  char expected[300], path[64];
  snprintf(expected, sizeof expected, "'name':'%s',", name);
  assert_says(&r, expected);
  strcpy(path, reply_header(&r, "Location"));
  reply_free(&r);
  r = loopback_get(loop, path);
  assert_says(&r, expected);
  reply_free(&r);
  r = loopback_get(loop, "/v1/models");
  assert_says(&r, expected);
  reply_free(&r);
}

#define NAMED_FACE(mesh) "o " mesh "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

TEST_WITH(a_name_is_that_of_the_query_the_request_or_the_file, loopback_setup, loopback_teardown) {
  static const char disposition[] = "Content-Disposition: attachment; filename=\"from header.obj\"\n";
  static const char form[] = "Content-Type: multipart/form-data; boundary=x\n";
  static const char both[] =
      "Content-Type: multipart/form-data; boundary=x\n"
      "Content-Disposition: attachment; filename*=UTF-8''na%C3%AFve%zz.obj; filename=\"no\"\n";
#define PART(mesh)                                                                                           \
  "--x\r\nContent-Disposition: form-data; name=\"file\"; "                                                   \
  "filename=\"C:\\\\models/part.obj\"\r\n\r\n" NAMED_FACE(mesh) "\r\n--x--"
  assert_named(*state, "/v1/models?name=%C3%A4%20b", disposition, NAMED_FACE("a"), "ä b");
  assert_named(*state, "/v1/models", disposition, NAMED_FACE("b"), "from header.obj");
  assert_named(*state, "/v1/models", form, PART("c"), "part.obj");
  assert_named(*state, "/v1/models", both, PART("d"), "naïve%zz.obj");
  assert_named(*state, "/v1/models?name=../../e", form, PART("e"), "e");
  assert_named(*state, "/v1/models", NULL, NAMED_FACE("f"), "f");
  assert_named(*state, "/v1/models?name=", NULL, NAMED_FACE("g"), "g");
  assert_named(*state, "/v1/models", "Content-Disposition: inline; filename=\"caf\xE9.obj\"\n",
               NAMED_FACE("h"), "café.obj");
  assert_named(*state, "/v1/models", "Content-Disposition: inline; filename*=ISO-8859-1''caf%E9.obj\n",
               NAMED_FACE("i"), "café.obj");
}

TEST_WITH(the_name_of_the_first_upload_stays, loopback_setup, loopback_teardown) {
  assert_named(*state, "/v1/models?name=first", NULL, NAMED_FACE("a"), "first");
  assert_named(*state, "/v1/models?name=second", NULL, NAMED_FACE("a"), "first");
  assert_named(*state, "/v1/models", NULL, NAMED_FACE("b"), "b");
  assert_named(*state, "/v1/models?name=later", NULL, NAMED_FACE("b"), "b");
}

TEST_WITH(a_long_name_is_cut_at_a_character, loopback_setup, loopback_teardown) {
  char target[1200] = "/v1/models?name=a", name[256] = "a";
  for (int i = 0; i < 150; i++) strcat(target, "%C3%A4");
  for (int i = 0; i < 127; i++) strcat(name, "ä");
  assert_named(*state, target, NULL, NAMED_FACE("a"), name);
}

static void assert_suggested(loopback *loop, const char *id, const char *rest, const char *expected) {
  reply r = model_get_ok(loop, id, rest);
  assert_string_equal(reply_header(&r, "Content-Disposition"), expected);
  reply_free(&r);
}

TEST_WITH(answers_suggest_the_name_as_a_file, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT];
  reply r = loopback_post(*state, "/v1/models?name=na%C3%AFve%20%22x%22.obj", "model/obj", NAMED_FACE("a"));
  assert_int_equal(r.status, 201);
  memcpy(id, strrchr(reply_header(&r, "Location"), '/') + 1, API_ID_TEXT);
  reply_free(&r);
  assert_suggested(*state, id, "surface.glb?level=0",
                   "inline; filename=\"na__ve _x_.glb\"; filename*=UTF-8''na%c3%afve%20%22x%22.glb");
  assert_suggested(*state, id, "surface.obj?level=0&download=1",
                   "attachment; filename=\"na__ve _x_.obj\"; filename*=UTF-8''na%c3%afve%20%22x%22.obj");
  assert_suggested(*state, id, "source?download=1",
                   "attachment; filename=\"na__ve _x_.obj\"; filename*=UTF-8''na%c3%afve%20%22x%22.obj");
  char target[96];
  snprintf(target, sizeof target, "/v1/models/%s/source?download=yes", id);
  assert_problem(loopback_get(*state, target), 400, NULL, "download");
}

TEST_WITH(suggested_names_have_one_extension, loopback_setup, loopback_teardown) {
  static const char *const names[] = {"a.bvh", "a.BVH", "a.vrm", "a.vrma", "a.3mf", "a.glb", "a.json"};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
    char target[64], text[128], id[API_ID_TEXT];
    snprintf(target, sizeof target, "/v1/models?name=%s", names[i]);
    snprintf(text, sizeof text, "HIERARCHY ROOT r%zu { OFFSET 0 0 0 }", i);
    reply r = loopback_post(*state, target, "model/x-bvh", text);
    assert_int_equal(r.status, 201);
    memcpy(id, strrchr(reply_header(&r, "Location"), '/') + 1, API_ID_TEXT);
    reply_free(&r);
    assert_suggested(*state, id, "source", "inline; filename=\"a.bvh\"; filename*=UTF-8''a.bvh");
    assert_suggested(*state, id, "surface.glb", "inline; filename=\"a.glb\"; filename*=UTF-8''a.glb");
  }
}

/* The name of a mesh may be long, and stands in the header twice. */
TEST_WITH(a_suggested_name_is_cut_at_a_character, loopback_setup, loopback_teardown) {
  enum { LETTERS = 500, KEPT = 127 };
  char name[2 * LETTERS + 1] = "", text[2 * LETTERS + 200], expected[2048] = "inline; filename=\"a",
                          id[API_ID_TEXT];
  for (int i = 0; i < LETTERS; i++) memcpy(name + 2 * i, "\xC3\xA4", 3);
  snprintf(text, sizeof text,
           "{'meshes':[{'name':'a%s','positions':[[0,0,0],[1,0,0],[1,1,0]],'faces':[[0,1,2]]}]}", name);
  loopback_upload(*state, "application/json", text, id);
  for (int i = 0; i < KEPT; i++) strcat(expected, "__");
  strcat(expected, ".obj\"; filename*=UTF-8''a");
  for (int i = 0; i < KEPT; i++) strcat(expected, "%c3%a4");
  strcat(expected, ".obj");
  assert_suggested(*state, id, "surface.obj?level=0", expected);
}
