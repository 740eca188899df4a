/* Models that edits make: what is answered and stored, that the cage reads back the same, and refusals. */
#include "flag.h"
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static reply post_edits(loopback *loop, const char *id, const char *body) {
  char target[64];
  snprintf(target, sizeof target, "/v1/models/%s/edits", id);
  return loopback_post(loop, target, "application/json", body);
}

/* id_out: of the model that was made. */
static cJSON *edit(loopback *loop, const char *id, const char *body, char id_out[API_ID_TEXT]) {
  reply r = post_edits(loop, id, body);
  if (r.status != 201 && r.status != 200) fail_msg("%s\n%d %s", body, r.status, r.body);
  cJSON *tree = cJSON_Parse(r.body);
  assert_non_null(tree);
  snprintf(id_out, API_ID_TEXT, "%s", json_member(tree, "id")->valuestring);
  reply_free(&r);
  return tree;
}

static const cJSON *mesh_of(const cJSON *description, int mesh) {
  return cJSON_GetArrayItem(json_member(description, "meshes"), mesh);
}

static void assert_count(const cJSON *object, const char *name, int count) {
  if (json_member(object, name)->valueint != count)
    fail_msg("%s: %d", name, json_member(object, name)->valueint);
}

/* ---- cages as GLB ---------------------------------------------------------------------------- */

#define GRID                                                                                                 \
  "v 0 0 0\nv 1 0 .5\nv 2 0 0\nv 3 0 .1\nv 4 0 0\nv 0 1 .3\nv 1 1 0\nv 2 1 1\n"                              \
  "v 3 1 0\nv 4 1 .7\nv 0 2 0\nv 1 2 .2\nv 2 2 0\nv 3 2 .9\nv 4 2 0\n"

/* Polygons of three to five corners whose neighbours begin at the same point, materials and groups across
 * each other and out of order, every tag. */
static const char tagged[] = "o plate\n" GRID "usemtl red\ng arm\nf 1 2 7\nf 1 7 6\nusemtl blue\nf 2 3 8 7\n"
                             "g leg top\nusemtl red\nf 3 4 9 8\ng\nusemtl blue\nf 4 5 10 9\n"
                             "usemtl red\nf 6 7 8 13 12\nf 6 12 11\ng arm\nf 8 9 14 13\nf 9 10 15 14\n"
                             "t crease 2/1/0 1 6 2.5\nt crease 4/2/0 6 7 7 8 10 .5\nt corner 1/1/0 7 1.5\n"
                             "t corner 1/1/0 14 10\nt hole 1/0/0 3\nt hole 1/0/0 7\n"
                             "t interpolateboundary 1/0/0 2\nt creasemethod 0/0/1 chaikin\n";
/* Points that lie in one place and are two; a point of no face; a bow-tie. */
static const char apart[] =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 9 9 9\nv 1 0 0\nv 2 0 1\nv 2 1 1\nv 1 1 0\n"
    "v 2 2 2\nv 2 3 2\nf 1 2 3 4\nf 6 7 8 9\nf 3 10 11\n";
static const char shapes[] =
    "{'meshes':[{'name':'a','shape':{'kind':'cylinder','segments':7},"
    "'edits':[{'edit':'crease','edges':{'sharper_than':60},'sharpness':1.5},{'edit':'hole','faces':[1]}]},"
    "{'name':'b','shape':{'kind':'icosphere','level':1}}],'nodes':[{'name':'n','mesh':'a'},"
    "{'name':'m','mesh':'b','parent':'n'}]}";

static void assert_same(loopback *loop, const char *id, const char *other, const char *rest) {
  reply a = model_get_ok(loop, id, rest), b = model_get_ok(loop, other, rest);
  if (a.size != b.size || memcmp(a.body, b.body, a.size) != 0) {
    size_t at = 0;
    while (at < a.size && a.body[at] == b.body[at]) at++;
    fail_msg("%s: at %zu of %zu, %zu: %.40s", rest, at, a.size, b.size, b.body + at);
  }
  reply_free(&a);
  reply_free(&b);
}

/* The next line that tells of a point or a face, its numbers of texture coordinates left out; NULL: there is
 * none. at: behind it. */
static char *next_line(char **at, char *out, size_t room) {
  while (**at) {
    char *line = *at, *end = strchr(line, '\n');
    size_t length = 0;
    bool is_skipped = false;
    *at = end ? end + 1 : line + strlen(line);
    if (strncmp(line, "v ", 2) != 0 && strncmp(line, "f ", 2) != 0) continue;
    for (; line < *at && length + 1 < room; line++) {
      if (*line == ' ' || *line == '/') is_skipped = *line == '/';
      if (!is_skipped) out[length++] = *line;
    }
    out[length] = '\0';
    return out;
  }
  return NULL;
}

/* Of models whose texture coordinates have other numbers. */
static void assert_same_faces(loopback *loop, const char *id, const char *other, const char *rest) {
  reply a = model_get_ok(loop, id, rest), b = model_get_ok(loop, other, rest);
  char line[256], other_line[256], *at = a.body, *other_at = b.body;
  size_t lines = 0;
  while (next_line(&at, line, sizeof line)) {
    assert_non_null(next_line(&other_at, other_line, sizeof other_line));
    assert_string_equal(line, other_line);
    lines++;
  }
  assert_null(next_line(&other_at, other_line, sizeof other_line));
  assert_true(lines > 20);
  reply_free(&a);
  reply_free(&b);
}

/* Stores the level 0 as GLB. */
static void upload_cage(loopback *loop, const char *id, char back[API_ID_TEXT]) {
  reply cage = model_get_ok(loop, id, "surface.glb?level=0&polygons=ngon");
  reply r =
      loopback_ask(loop, "POST", "/v1/models", "Content-Type: model/gltf-binary\n", cage.body, cage.size);
  assert_int_equal(r.status, 201);
  assert_says(&r, "'warnings':[]");
  cJSON *tree = cJSON_Parse(r.body);
  snprintf(back, API_ID_TEXT, "%s", json_member(tree, "id")->valuestring);
  cJSON_Delete(tree);
  reply_free(&r);
  reply_free(&cage);
}

TEST_WITH(a_cage_as_glb_reads_back_with_the_same_surfaces, loopback_setup, loopback_teardown) {
  static const char *const cages[] = {tagged, apart};
  static const char *const forms[] = {
      "surface.obj?level=0",        "surface.obj?level=1",
      "surface.obj?level=2",        "surface.obj?level=3",
      "surface.glb?level=2",        "surface.obj?level=2&boundary=open&normals=none",
      "surface.glb?level=3",        "surface.obj?level=2&limit=true",
      "surface.obj?scheme=bilinear"};
  char id[API_ID_TEXT], back[API_ID_TEXT];
  for (size_t i = 0; i < sizeof cages / sizeof *cages; i++) {
    loopback_upload(*state, "model/obj", cages[i], id);
    upload_cage(*state, id, back);
    for (size_t k = 0; k < sizeof forms / sizeof *forms; k++) assert_same(*state, id, back, forms[k]);
  }
}

/* glTF's v runs down the picture: 1 - v is rounded once. */
TEST_WITH(a_cage_with_texture_coordinates_reads_back, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], back[API_ID_TEXT], again[API_ID_TEXT], rest[64];
  loopback_upload(*state, "application/json", shapes, id);
  upload_cage(*state, id, back);
  for (int level = 0; level <= 3; level++) {
    snprintf(rest, sizeof rest, "surface.obj?level=%d", level);
    assert_same_faces(*state, id, back, rest);
  }
  upload_cage(*state, back, again);
  assert_same(*state, back, again, "surface.obj?level=2");
}

TEST_WITH(only_a_cage_of_floats_bears_tags, loopback_setup, loopback_teardown) {
  static const char *const others[] = {"surface.gltf?level=0", "surface.gltf?level=1&polygons=ngon",
                                       "surface.gltf?level=0&polygons=ngon&limit=true",
                                       "surface.gltf?level=0&polygons=ngon&encoding=quantized"};
  char id[API_ID_TEXT];
  loopback_upload(*state, "model/obj", tagged, id);
  reply r = model_get_ok(*state, id, "surface.gltf?level=0&polygons=ngon");
  assert_says(&r, "'extras':{'tweend':{'points':");
  reply_free(&r);
  for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
    r = model_get_ok(*state, id, others[i]);
    assert_false(reply_says(&r, "'tweend':{"));
    reply_free(&r);
  }
}

/* ---- edits ----------------------------------------------------------------------------------- */

static const char box[] =
    "{'meshes':[{'name':'hull','shape':{'kind':'box','size':[2,1,4],'segments':[2,1,3]}}]}";
static const char steps[] =
    "[{'edit':'extrude','faces':{'facing':[0,1,0],'within':10},'distance':0.4,'name':'deck'},"
    "{'edit':'inset','faces':{'made':'deck'},'amount':0.2},{'edit':'loop_cut','edge':[0,1],"
    "'cuts':2,'at':[0.1,0.9]},{'edit':'crease','edges':{'sharper_than':60},'sharpness':2}]";

/* The box has 24 points and 22 faces; walls add 10 of both, the rim as many, two cuts through 12 quads 24. */
TEST_WITH(edits_make_a_model_that_is_like_any_other, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], made[API_ID_TEXT], again[API_ID_TEXT], body[1024], location[64];
  loopback_upload(*state, "application/json", box, id);
  snprintf(body, sizeof body, "{'mesh':'hull','edits':%s}", steps);
  reply r = post_edits(*state, id, body);
  assert_int_equal(r.status, 201);
  cJSON *tree = cJSON_Parse(r.body);
  snprintf(made, sizeof made, "%s", json_member(tree, "id")->valuestring);
  snprintf(location, sizeof location, "/v1/models/%s", made);
  assert_string_equal(reply_header(&r, "Location"), location);
  assert_string_equal(json_member(tree, "format")->valuestring, "glb");
  assert_string_equal(json_member(tree, "name")->valuestring, "hull");
  assert_int_equal(cJSON_GetArraySize(json_member(tree, "warnings")), 0);
  const cJSON *mesh = mesh_of(tree, 0);
  assert_count(mesh, "vertices", 68);
  assert_count(mesh, "faces", 66);
  assert_count(mesh, "euler_characteristic", 2);
  assert_count(mesh, "boundary_edges", 0);
  assert_true(json_member(mesh, "creases")->valueint > 0);
  reply got = loopback_get(*state, location);
  assert_int_equal(got.status, 200);
  /* The description is the answer but for what was made. */
  assert_memory_equal(got.body, r.body, got.size - 3);
  reply_free(&got);
  reply_free(&r);
  /* The same request makes the same bytes. */
  r = post_edits(*state, id, body);
  assert_int_equal(r.status, 200);
  reply_free(&r);
  assert_int_equal(loopback_store_count(*state), 2);
  /* As the same edits in a document do. */
  snprintf(body, sizeof body,
           "{'meshes':[{'name':'hull','shape':{'kind':'box','size':[2,1,4],'segments':[2,1,3]},"
           "'edits':%s}]}",
           steps);
  loopback_upload(*state, "application/json", body, again);
  assert_same_faces(*state, made, again, "surface.obj?level=0");
  assert_same_faces(*state, made, again, "surface.obj?level=2");
  cJSON_Delete(tree);
}

/* Triangles that an exporter split are joined in the new model, which is called as the query says. */
TEST_WITH(edits_are_of_quads_where_these_are_asked_for, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT];
  reply r = loopback_post(*state, "/v1/models", "model/obj",
                          "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 1 1\nv 1 1 1\n"
                          "f 1 2 3 4\nf 4 3 6 5\n");
  cJSON *tree = cJSON_Parse(r.body);
  snprintf(id, sizeof id, "%s", json_member(tree, "id")->valuestring);
  cJSON_Delete(tree);
  reply_free(&r);
  reply glb = model_get_ok(*state, id, "surface.glb?level=0&normals=none");
  r = loopback_ask(*state, "POST", "/v1/models", "Content-Type: model/gltf-binary\n", glb.body, glb.size);
  tree = cJSON_Parse(r.body);
  snprintf(id, sizeof id, "%s", json_member(tree, "id")->valuestring);
  assert_count(mesh_of(tree, 0), "faces", 2);
  assert_count(mesh_of(tree, 0), "paired_quads", 2);
  cJSON_Delete(tree);
  reply_free(&glb);
  reply_free(&r);
  static const struct {
    const char *query, *name;
    int faces;
  } cases[] = {
      {"?quads=auto&name=folder%2Fsheet.glb", "sheet.glb", 2}, {"?", NULL, 2}, {"?quads=off", NULL, 4}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    char target[128];
    snprintf(target, sizeof target, "/v1/models/%s/edits%s", id, cases[i].query);
    r = loopback_post(*state, target, "application/json",
                      "{\"edits\":[{\"edit\":\"move\",\"faces\":[0],\"by\":[0,0,0.5]}]}");
    if (r.status != (i == 1 ? 200 : 201)) /* by default as by auto: the same model */
      fail_msg("%s: %d %s", cases[i].query, r.status, r.body);
    tree = cJSON_Parse(r.body);
    assert_count(mesh_of(tree, 0), "faces", cases[i].faces);
    if (cases[i].name) assert_string_equal(json_member(tree, "name")->valuestring, cases[i].name);
    cJSON_Delete(tree);
    reply_free(&r);
  }
  char target[128];
  snprintf(target, sizeof target, "/v1/models/%s/edits?quads=all", id);
  r = loopback_post(*state, target, "application/json", "{\"edits\":[]}");
  assert_int_equal(r.status, 400);
  reply_free(&r);
}

static void assert_list(const cJSON *object, const char *name, const int *numbers, int count) {
  const cJSON *list = json_member(object, name);
  assert_int_equal(cJSON_GetArraySize(list), count);
  for (int i = 0; i < count; i++) assert_int_equal(cJSON_GetArrayItem(list, i)->valueint, numbers[i]);
}

/* What is named follows later edits, and is numbered as in the finished model. */
TEST_WITH(what_named_edits_made_is_told, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], made[API_ID_TEXT], body[512];
  loopback_upload(*state, "application/json", "{'meshes':[{'shape':{'kind':'box'}}]}", id);
  cJSON *tree = edit(*state, id,
                     "{'edits':[{'edit':'extrude','faces':[0],'distance':1,'name':'a'},"
                     "{'edit':'inset','faces':[1],'amount':0.1,'name':'b'},{'edit':'inset','faces':[2],"
                     "'amount':0.1,'name':'b'},{'edit':'delete','faces':[3],'optional':true}]}",
                     made);
  const cJSON *all = json_member(tree, "made");
  assert_int_equal(cJSON_GetArraySize(all), 2); /* the last of equal names */
  assert_list(json_member(all, "a"), "faces", (int[]){0}, 1);
  assert_list(json_member(all, "b"), "faces", (int[]){2}, 1);
  assert_int_equal(cJSON_GetArraySize(json_member(json_member(all, "a"), "vertices")), 4);
  int vertices[4];
  for (int i = 0; i < 4; i++)
    vertices[i] = cJSON_GetArrayItem(json_member(json_member(all, "b"), "vertices"), i)->valueint;
  cJSON_Delete(tree);
  /* The next request finds them under these numbers: the four points are the face's. */
  snprintf(body, sizeof body, "{'edits':[{'edit':'merge','vertices':[%d,%d,%d,%d],'name':'tip'}]}",
           vertices[0], vertices[1], vertices[2], vertices[3]);
  tree = edit(*state, made, body, made);
  assert_count(mesh_of(tree, 0), "faces", 5 + 4 + 4 + 3);
  assert_int_equal(cJSON_GetArraySize(json_member(json_member(json_member(tree, "made"), "tip"), "vertices")),
                   1);
  cJSON_Delete(tree);
}

/* Points that no face uses are not part of the model, nor counted. */
TEST_WITH(vertices_are_numbered_as_the_model_has_them, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], made[API_ID_TEXT];
  loopback_upload(*state, "model/obj", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 2 3 4 5\n", id);
  cJSON *tree =
      edit(*state, id, "{'edits':[{'edit':'move','vertices':[0,4],'by':[0,0,1],'name':'one'}]}", made);
  assert_list(json_member(json_member(tree, "made"), "one"), "vertices", (int[]){3}, 1);
  assert_list(json_member(json_member(tree, "made"), "one"), "faces", NULL, 0);
  cJSON_Delete(tree);
}

TEST_WITH(one_of_several_meshes_is_edited, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], made[API_ID_TEXT];
  loopback_upload(*state, "application/json", shapes, id);
  cJSON *tree = edit(*state, id, "{'mesh':'b','edits':[{'edit':'delete','faces':[0]}]}", made);
  assert_count(mesh_of(tree, 0), "holes", 1);
  assert_count(mesh_of(tree, 0), "faces", 9);
  assert_count(mesh_of(tree, 1), "faces", 79);
  assert_string_equal(json_member(cJSON_GetArrayItem(json_member(tree, "nodes"), 1), "parent")->valuestring,
                      "n");
  cJSON_Delete(tree);
  assert_problem(post_edits(*state, id, "{'edits':[]}"), 422, "/mesh",
                 "2 meshes: name one of them as mesh; there are: a, b");
  assert_problem(post_edits(*state, id, "{'mesh':'c','edits':[]}"), 422, "/mesh", "\"c\"");
}

/* Materials, images, clips and what is not read stay; a clip's keys become those of glTF. */
TEST_WITH(the_rest_of_the_model_stays, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], made[API_ID_TEXT];
  loopback_upload_sample(*state, "application/json", "tank.json", id);
  reply before = model_get_ok(*state, id, "");
  cJSON *old = cJSON_Parse(before.body);
  const char *name = json_member(mesh_of(old, 0), "name")->valuestring;
  char body[256];
  snprintf(body, sizeof body, "{'mesh':'%s','edits':[{'edit':'move','faces':'all','by':[0,1,0]}]}", name);
  cJSON *tree = edit(*state, id, body, made);
  assert_int_equal(cJSON_GetArraySize(json_member(tree, "nodes")),
                   cJSON_GetArraySize(json_member(old, "nodes")));
  assert_int_equal(cJSON_GetArraySize(json_member(tree, "clips")),
                   cJSON_GetArraySize(json_member(old, "clips")));
  assert_same(*state, id, made, "pose.csv?at=0.5&nodes=turret");
  cJSON_Delete(tree);
  cJSON_Delete(old);
  reply_free(&before);
}

/* A cube without its last side: each side has points of its own, the fifth is turned round; a crumb of one
 * triangle lies beside it. */
static const char scan[] =
    "{'meshes':[{'positions':[[-1,-1,-1],[-1,1,-1],[1,1,-1],[1,-1,-1],[-1,-1,1],[1,-1,1],[1,1,1],[-1,1,1],"
    "[-1,-1,-1],[1,-1,-1],[1,-1,1],[-1,-1,1],[1,-1,-1],[1,1,-1],[1,1,1],[1,-1,1],[-1,1,1],[1,1,1],[1,1,-1],"
    "[-1,1,-1],[5,0,0],[6,0,0],[5,1,0]],'faces':[[0,1,2,3],[4,5,6,7],[8,9,10,11],[12,13,14,15],"
    "[16,17,18,19],[20,21,22]]}]}";

TEST_WITH(scans_are_made_clean, loopback_setup, loopback_teardown) {
  static const char *const methods[] = {"ngon", "triangles", "fair"};
  static const int faces[] = {6, 7, 7};
  char id[API_ID_TEXT], made[API_ID_TEXT], body[512];
  loopback_upload(*state, "application/json", scan, id);
  for (int i = 0; i < 3; i++) {
    snprintf(body, sizeof body,
             "{'edits':[{'edit':'weld'},{'edit':'drop_pieces','faces':2},{'edit':'orient'},"
             "{'edit':'fill','method':'%s','name':'lid'},{'edit':'despike'},"
             "{'edit':'smooth','iterations':1}]}",
             methods[i]);
    cJSON *tree = edit(*state, id, body, made);
    const cJSON *mesh = mesh_of(tree, 0), *lid = json_member(json_member(tree, "made"), "lid");
    assert_count(mesh, "vertices", 8);
    assert_count(mesh, "faces", faces[i]);
    assert_count(mesh, "boundary_edges", 0);
    assert_count(mesh, "reversed_edges", 0);
    assert_count(mesh, "components", 1);
    assert_count(mesh, "euler_characteristic", 2);
    assert_int_equal(cJSON_GetArraySize(json_member(lid, "faces")), faces[i] - 5);
    cJSON_Delete(tree);
  }
}

/* ---- refusals -------------------------------------------------------------------------------- */

TEST_WITH(refusals_bear_the_place_and_store_nothing, loopback_setup, loopback_teardown) {
  static const struct {
    const char *body;
    int status;
    const char *pointer, *word;
  } cases[] = {
      {"[", 400, NULL, "JSON"},
      {"[]", 400, "", "object"},
      {"{}", 400, "", "edits"},
      {"{'edits':{}}", 400, "/edits", "array"},
      {"{'mesh':0,'edits':[]}", 400, "/mesh", "name"},
      {"{'mesh':'hul','edits':[]}", 422, "/mesh", "did you mean hull"},
      {"{'mesh':'hull','edits':[],'level':1}", 400, "", "known: mesh, edits"},
      {"{'edits':[{'edit':'bevel'}]}", 400, "/edits/0/edit", "extrude"},
      {"{'edits':[{'edit':'orient'},{'edit':'flip'},{'edit':'quads'},{'edit':'loop_cut','edge':[0,23]}]}",
       422, "/edits/3/edge", NULL},
      {"{'edits':[{'edit':'delete','faces':[0,22]}]}", 422, "/edits/0/faces/1", "22"},
      {"{'edits':[{'edit':'delete','faces':{'group':'x'}}]}", 422, "/edits/0/faces/group", NULL},
      {"{'edits':[{'edit':'move','faces':'all','by':[1e300,0,0]}]}", 422, NULL, NULL},
      {"{'edits':[{'edit':'subdivide','faces':'all','cuts':9999}]}", 422, "/edits/0", "2200000000"},
      {"{'edits':[{'edit':'delete','faces':'all'}]}", 422, "/edits", "no face"},
      {"{'edits':[{'edit':'hole','faces':'all'}]}", 422, "/edits", "no face"},
      {"{'edits':[{'edit':'drop_pieces'}]}", 400, "/edits/0/faces", "needs"},
      {"{'edits':[{'edit':'drop_pieces','faces':'all'}]}", 400, "/edits/0/faces", "number"},
      {"{'edits':[{'edit':'drop_pieces','faces':23}]}", 422, "/edits", "no face"},
      {"{'edits':[{'edit':'weld','distance':-1}]}", 422, "/edits/0/distance", NULL},
      {"{'edits':[{'edit':'despike','factor':0}]}", 422, "/edits/0/factor", NULL},
      {"{'edits':[{'edit':'smooth','iterations':101}]}", 422, "/edits/0/iterations", "100"},
      {"{'edits':[{'edit':'smooth','method':'fair'}]}", 400, "/edits/0/method", "taubin"},
      {"{'edits':[{'edit':'fill','method':'taubin'}]}", 400, "/edits/0/method", "fair"},
  };
  char id[API_ID_TEXT];
  loopback_upload(*state, "application/json", box, id);
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    print_message("%s\n", cases[i].body);
    assert_problem(post_edits(*state, id, cases[i].body), cases[i].status, cases[i].pointer, cases[i].word);
    assert_int_equal(loopback_store_count(*state), 1);
  }
  assert_problem(post_edits(*state, "00000000000000000000000000000000", "{'edits':[]}"), 404, NULL, NULL);
  reply r = loopback_post(*state, "/v1/models", "application/json", "{'nodes':[{}]}");
  cJSON *tree = cJSON_Parse(r.body);
  snprintf(id, sizeof id, "%s", json_member(tree, "id")->valuestring);
  assert_problem(post_edits(*state, id, "{'edits':[]}"), 422, "/mesh", "no mesh");
  cJSON_Delete(tree);
  reply_free(&r);
  loopback_upload(*state, "application/json", "{'meshes':[{}]}", id);
  assert_problem(post_edits(*state, id, "{'edits':[]}"), 422, "/edits", "no face");
}

TEST(limits_hold_for_what_edits_make) {
  api_settings settings = loopback_settings();
  settings.limits.max_faces = 1000;
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT];
  loopback_upload(loop, "application/json", box, id);
  assert_problem(post_edits(loop, id, "{'edits':[{'edit':'subdivide','faces':'all','cuts':6}]}"), 422,
                 "/edits/0", "1078 faces");
  loopback_stop(loop);
  settings = loopback_settings();
  settings.limits.max_upload = 20000;
  loop = loopback_start(&settings);
  loopback_upload(loop, "application/json", box, id);
  assert_problem(post_edits(loop, id, "{'edits':[{'edit':'subdivide','faces':'all','cuts':6}]}"), 422, NULL,
                 "20000");
  assert_int_equal(loopback_store_count(loop), 1);
  loopback_stop(loop);
}

/* The memory has room for 32,768 points and corners; the mesh has 18,121. */
TEST(a_list_of_edits_takes_no_more_memory_than_one) {
  static const char grid[] = "{'meshes':[{'shape':{'kind':'grid','segments':[60,60]}}]}",
                    move[] = "{'edit':'move','faces':[0],'by':[0,1,0]}";
  api_settings settings = loopback_settings();
  settings.limits.max_memory = 8 << 20;
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT], made[API_ID_TEXT], body[4096] = "{'edits':[";
  loopback_upload(loop, "application/json", grid, id);
  for (int i = 0; i < 20; i++) sprintf(body + strlen(body), "%s%s", i ? "," : "", move);
  strcat(body, "]}");
  cJSON_Delete(edit(loop, id, body, made));
  body[strlen(body) - 2] = '\0';
  for (int i = 0; i < 20; i++) sprintf(body + strlen(body), ",%s", move);
  strcat(body, "]}");
  assert_problem(post_edits(loop, id, body), 422, "/edits/28", "too many edits");
  loopback_stop(loop);
}

/* The memory allows work on 524,288 points, corners and names in all; each edit carries all names along. */
TEST(names_of_nothing_take_work_too) {
  enum { EDITS = 700 };
  api_settings settings = loopback_settings();
  settings.limits.max_memory = 8 << 20;
  loopback *loop = loopback_start(&settings);
  char id[API_ID_TEXT], made[API_ID_TEXT], *body = malloc(EDITS * 80), *end = stpcpy(body, "{'edits':[");
  loopback_upload(loop, "application/json", box, id);
  for (int i = 0; i < EDITS; i++)
    end += sprintf(end, "%s{'edit':'flip','faces':[],'optional':true,'name':'a%d'}", i ? "," : "", i);
  strcpy(end, "]}");
  assert_problem(post_edits(loop, id, body), 422, "/edits/485", "too many names");
  end = strstr(body, ",{'edit':'flip','faces':[],'optional':true,'name':'a450'}");
  strcpy(end, "]}");
  cJSON_Delete(edit(loop, id, body, made));
  free(body);
  loopback_stop(loop);
}

TEST_WITH(images_that_follow_the_joints_of_the_other_side_are_told, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT];
  loopback_upload(*state, "model/gltf+json", flag, id);
  reply r = post_edits(*state, id, "{'edits':[{'edit':'flip'},{'edit':'mirror','axis':'x'}]}");
  assert_int_equal(r.status, 201);
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "mirror"));
  reply_free(&r);
  r = post_edits(*state, id, "{'edits':[{'edit':'flip'}]}");
  assert_int_equal(r.status, 201);
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
  loopback_upload(*state, "application/json", box, id);
  r = post_edits(*state, id, "{'edits':[{'edit':'mirror','axis':'y'}]}");
  assert_int_equal(r.status, 201);
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
}

TEST_WITH(merged_points_that_move_otherwise_are_told, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], other[sizeof flag];
  memcpy(other, flag, sizeof flag);
  char *target = strstr(other, "'targets':[{'POSITION':4");
  assert_non_null(target);
  target[strlen("'targets':[{'POSITION':")] = '0'; /* displaced by as much as the points' coordinates */
  loopback_upload(*state, "model/gltf+json", other, id);
  reply r = post_edits(*state, id, "{'edits':[{'edit':'merge','vertices':[0,1],'distance':10}]}");
  assert_int_equal(r.status, 201);
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "merged%20with%20one%20of%20other%20joints"));
  reply_free(&r);
}

TEST_WITH(a_store_that_fails_is_503, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT];
  loopback_upload(*state, "application/json", box, id);
  reply r = model_get_ok(*state, id, "surface.json"); /* the model is known from now on */
  reply_free(&r);
  loopback_store_fail(*state, true);
  assert_problem(post_edits(*state, id, "{'edits':[]}"), 503, NULL, NULL);
}

TEST(only_who_may_write_may_edit) {
  static const api_key keys[] = {{.text = "reader", .rights = API_MAY_READ},
                                 {.text = "writer", .rights = API_MAY_READ | API_MAY_WRITE}};
  api_settings settings = loopback_settings();
  settings.keyring = (api_keyring){.keys = keys, .count = 2};
  loopback *loop = loopback_start(&settings);
  static const char reader[] = "Content-Type: application/json\nAuthorization: Bearer reader\n",
                    writer[] = "Content-Type: application/json\nAuthorization: Bearer writer\n",
                    edits[] = "{'edits':[]}";
  reply r = loopback_post_with(loop, "/v1/models", writer, box);
  assert_int_equal(r.status, 201);
  char target[64];
  snprintf(target, sizeof target, "%s/edits", reply_header(&r, "Location"));
  reply_free(&r);
  assert_problem(loopback_post(loop, target, "application/json", edits), 401, NULL, NULL);
  assert_problem(loopback_post_with(loop, target, reader, edits), 403, NULL, NULL);
  r = loopback_post_with(loop, target, writer, edits);
  assert_int_equal(r.status, 201);
  reply_free(&r);
  loopback_stop(loop);
}
