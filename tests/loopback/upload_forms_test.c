/* Uploads as multipart forms: of one file, and of a glTF with the files that it names. */
#include "stored_models.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
