/* Descriptions of models. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

TEST_WITH(the_tank_is_described_in_full, loopback_setup, loopback_teardown) {
  char *text = loopback_file("server/samples/tank.json", NULL);
  reply r = loopback_post(*state, "/v1/models", "application/json", text);
  cJSON *tank = cJSON_Parse(r.body);
  assert_string_equal(json_member(tank, "format")->valuestring, "tweend");
  assert_string_equal(json_member(tank, "name")->valuestring, "hull");
  assert_int_equal(json_member(tank, "bytes")->valueint, strlen(text));
  assert_int_equal(cJSON_GetArraySize(json_member(tank, "meshes")), 5);
  const cJSON *hull = json_member(tank, "meshes")->child;
  assert_int_equal(json_member(hull, "vertices")->valueint, 48);
  assert_int_equal(json_member(hull, "faces")->valueint, 46);
  assert_int_equal(json_member(hull, "edges")->valueint, 92);
  assert_int_equal(json_member(json_member(hull, "face_sizes"), "4")->valueint, 46);
  assert_int_equal(json_member(hull, "euler_characteristic")->valueint, 2);
  assert_int_equal(cJSON_GetArraySize(json_member(json_member(hull, "bounds"), "max")), 3);
  const cJSON *wheel = json_member(tank, "nodes")->child->next;
  assert_string_equal(json_member(wheel, "name")->valuestring, "wheel_front_left");
  assert_string_equal(json_member(wheel, "parent")->valuestring, "hull");
  assert_int_equal(cJSON_GetArraySize(json_member(json_member(wheel, "rest"), "rotation")), 4);
  const cJSON *drive = json_member(tank, "clips")->child;
  assert_string_equal(json_member(drive, "name")->valuestring, "drive");
  assert_true(json_member(drive, "duration")->valuedouble == 4);
  assert_true(json_member(drive, "tracks")->valueint > 5 && json_member(drive, "keys")->valueint > 20);
  cJSON_Delete(tank);
  reply_free(&r);
  free(text);
}

/* Uploads it; the facts of its first mesh, in text, with ' for ". Freed by the caller. */
static char *facts_of(loopback *loop, const char *type, const void *body, size_t size) {
  char headers[64];
  snprintf(headers, sizeof headers, "Content-Type: %s\n", type);
  reply r = loopback_ask(loop, "POST", "/v1/models", headers, body, size);
  assert_int_equal(r.status, 201);
  cJSON *model = cJSON_Parse(r.body);
  char *text = cJSON_PrintUnformatted(json_member(model, "meshes")->child);
  cJSON_Delete(model);
  reply_free(&r);
  return unquote(text);
}

TEST_WITH(a_cube_is_the_same_in_every_format, loopback_setup, loopback_teardown) {
  static const char obj[] = "o cube\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\n"
                            "v 1 1 1\nv -1 1 1\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\n"
                            "f 4 1 5 8\n";
  static const char json[] =
      "{'meshes':[{'name':'cube','positions':[[-1,-1,-1],[1,-1,-1],[1,1,-1],[-1,1,-1],[-1,-1,1],[1,-1,1],"
      "[1,1,1],[-1,1,1]],'faces':[[0,3,2,1],[4,5,6,7],[0,1,5,4],[1,2,6,5],[2,3,7,6],[3,0,4,7]]}]}";
  static const char expected[] =
      "{'name':'cube','vertices':8,'edges':12,'faces':6,'face_sizes':{'4':6},"
      "'boundary_edges':0,'boundary_loops':0,'nonmanifold_edges':0,'nonmanifold_vertices':0,"
      "'welded_points':0,'seam_edges':0,'reversed_edges':0,'extraordinary_vertices':8,"
      "'extraordinary_valences':{'3':8},'components':1,'euler_characteristic':2,'bounds':{'min':[-1,-1,-1],"
      "'max':[1,1,1]},'unused_points':0,'creases':0,'corners':0,'holes':0,'hard_edges':{'tags':0,"
      "'normals':0,'angle_30':12,'auto':12,'file':0},'paired_quads':0,'group_count':0,'groups':[],"
      "'uv_sets':0,'morph_targets':0,'details':[],'skinned':false}";
  static const char *const forms[] = {"glb", "gltf"};
  static const char *const types[] = {"model/gltf-binary", "model/gltf+json"};
  char *facts = facts_of(*state, "model/obj", obj, strlen(obj));
  assert_string_equal(facts, expected);
  free(facts);
  char *text = quoted(json);
  facts = facts_of(*state, "application/json", text, strlen(text));
  free(text);
  assert_string_equal(facts, expected);
  free(facts);
  for (int i = 0; i < 2; i++) {
    char target[80];
    snprintf(target, sizeof target, "/v1/surface.%s?level=0&polygons=ngon", forms[i]);
    reply cube = loopback_post(*state, target, "model/obj", obj);
    facts = facts_of(*state, types[i], cube.body, cube.size);
    assert_string_equal(facts, expected);
    free(facts);
    reply_free(&cube);
  }
}

TEST_WITH(places_that_are_not_manifold_are_named, loopback_setup, loopback_teardown) {
  static const char obj[] = "v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n"
                            "t crease 2/1/0 0 2 3\nt corner 1/1/0 4 1\nt hole 1/0/0 2\n";
  char *facts = facts_of(*state, "model/obj", obj, strlen(obj));
  assert_non_null(strstr(facts, "'nonmanifold_edges':1,'nonmanifold_vertices':2,"
                                "'nonmanifold':{'edges':[[0,1]],'vertices':[0,1]}"));
  assert_non_null(strstr(facts, "'creases':1,'corners':1,'holes':1,"));
  free(facts);
}

TEST_WITH(neighbours_wound_against_each_other_are_named, loopback_setup, loopback_teardown) {
  static const char shared[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n",
                    apart[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 4 5 6\n";
  reply r = loopback_post(*state, "/v1/models", "model/obj", shared);
  assert_says(&r, "'seam_edges':0,'reversed_edges':1,'reversed':[[1,2]],");
  assert_says(&r, "'warnings':['1 edge is a crease: its two");
  reply_free(&r);
  r = loopback_post(*state, "/v1/models", "model/obj", apart);
  assert_says(&r, "'seam_edges':2,'reversed_edges':1,'reversed':[[1,2]],");
  assert_says(&r, "'warnings':['1 edge is between faces");
  reply_free(&r);
}

TEST_WITH(groups_are_listed_with_their_faces, loopback_setup, loopback_teardown) {
  static const char obj[] = "v 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\ng arm left\nf 1 2 4\nf 3 2 1\n"
                            "g \"leg\"\nf 2 3 4\n";
  char *facts = facts_of(*state, "model/obj", obj, strlen(obj));
  assert_non_null(strstr(facts, "'group_count':2,'groups':[{'names':['arm','left'],'faces':2},"
                                "{'names':['\\'leg\\''],'faces':1}]"));
  free(facts);
  char many[8192] = "v 0 0 0\nv 0 1 0\nv 1 0 0\n", *at = many + strlen(many);
  for (int i = 0; i < 65; i++) at += sprintf(at, "v %d 1 1\ng part%d\nf 1 2 -1\n", i, i);
  facts = facts_of(*state, "model/obj", many, strlen(many));
  assert_non_null(strstr(facts, "'group_count':65,"));
  assert_non_null(strstr(facts, "{'names':['part63'],'faces':1}]"));
  free(facts);
}

TEST_WITH(nameless_things_are_called_by_their_index, loopback_setup, loopback_teardown) {
  char id[API_ID_TEXT], path[64];
  loopback_upload(*state, "application/json", "{'nodes':[{},{'parent':'node_0'}],'clips':[{'tracks':[]}]}",
                  id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  reply r = loopback_get(*state, path);
  assert_says(&r, "'name':'node_1','parent':'node_0'");
  assert_says(&r, "'name':'clip_0','duration':0");
  assert_says(&r, "'name':null,'format':'tweend'");
  reply_free(&r);
}

/* Sends it; the X-Tweend-Warning of the answer, or "". */
static void read_warning(loopback *loop, const char *method, const char *path, const char *body, int status,
                         char out[401]) {
  reply r = loopback_ask(loop, method, path, NULL, body, body ? strlen(body) : 0);
  assert_int_equal(r.status, status);
  const char *warning = reply_header(&r, "X-Tweend-Warning");
  strcpy(out, warning ? warning : "");
  reply_free(&r);
}

/* A face that is left out, and two that are wound against each other. */
TEST_WITH(every_answer_that_describes_a_model_says_the_first_warning, loopback_setup, loopback_teardown) {
  static const char odd[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nf 1 2 3\nf 1 2 4\nf 1 1 2\n",
                    plain[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
                    said[] = "2; 1%20face%20with%20fewer%20than%20three";
  char warning[401], id[API_ID_TEXT], path[64], edits[80], headers[128];
  read_warning(*state, "POST", "/v1/models", odd, 201, warning);
  assert_memory_equal(warning, said, strlen(said));
  read_warning(*state, "POST", "/v1/models", odd, 200, warning);
  assert_memory_equal(warning, said, strlen(said));
  loopback_upload(*state, "model/obj", odd, id);
  snprintf(path, sizeof path, "/v1/models/%s", id);
  for (int i = 0; i < 2; i++) { /* printed, then from the cache */
    read_warning(*state, i ? "HEAD" : "GET", path, NULL, 200, warning);
    assert_memory_equal(warning, said, strlen(said));
  }
  snprintf(edits, sizeof edits, "%s/edits", path);
  read_warning(*state, "POST", edits, "{\"edits\":[{\"edit\":\"flip\",\"faces\":\"all\"}]}", 201, warning);
  assert_non_null(strstr(warning, "1; 1%20edge%20is%20a%20crease"));
  reply r = loopback_get(*state, path);
  snprintf(headers, sizeof headers, "If-None-Match: %s\n", reply_header(&r, "ETag"));
  reply_free(&r);
  r = loopback_ask(*state, "GET", path, headers, NULL, 0);
  assert_int_equal(r.status, 304);
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
  read_warning(*state, "POST", "/v1/models", plain, 201, warning);
  assert_string_equal(warning, "");
}

/* A square's diagonal is no edge; neither is one of its points and one that no face has. Of several tags in
 * one place the last counts. */
TEST_WITH(tags_that_do_not_count_are_told, loopback_setup, loopback_teardown) {
  static const struct {
    const char *type, *text, *warnings;
  } cases[] = {
      {"application/json",
       "{'meshes':[{'shape':{'kind':'box'}},{'positions':[[0,0,0],[1,0,0],[1,1,0],[0,1,0],[2,2,2]],"
       "'faces':[[0,1,2,3]],'creases':[{'edge':[0,1],'sharpness':1},{'edge':[3,1],'sharpness':2},"
       "{'edge':[1,3],'sharpness':0},{'edge':[0,4],'sharpness':1}]}]}",
       "'warnings':['1 point is in no face: answers leave it out',"
       "'2 creases are left out: no edge joins points 3 and 1 of mesh 1, for the first']"},
      {"model/obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nt crease 2/1/0 0 2 3\n",
       "'warnings':['1 crease is left out: no edge joins points 0 and 2 of mesh 0']"},
      {"model/obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nt crease 2/1/0 0 3 3\n", "'warnings':[]"},
      {"application/json",
       "{'meshes':[{'positions':[[0,0,0],[1,0,0],[1,1,0],[0,1,0]],'faces':[[0,1,2,3]],"
       "'creases':[{'edge':[0,1],'sharpness':1},{'edge':[1,0],'sharpness':2},{'edge':[1,2],'sharpness':1},"
       "{'edge':[1,2],'sharpness':1}],'corners':[{'vertex':0,'sharpness':3},{'vertex':0,'sharpness':0}]}]}",
       "'warnings':['2 creases or corners are left out: an edge or a point has another one with another "
       "sharpness behind it','1 crease, corner or hole is listed again: it counts once']"},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    reply r = loopback_post(*state, "/v1/models", cases[i].type, cases[i].text);
    assert_int_equal(r.status, 201);
    assert_says(&r, cases[i].warnings);
    reply_free(&r);
  }
}
