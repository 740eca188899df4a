/* Models that are made of stored ones: meshes that nobody asked to change come along as they are. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Two faces that are both holes, points in another order than the faces have them; a mesh without faces. */
static const char three_meshes[] =
    "{'meshes':[{'name':'box','shape':{'kind':'box'}},{'name':'holes','positions':[[0,0,1],[0,0,0],[1,0,0],"
    "[1,1,0],[0,1,0]],'faces':[[4,1,2,3],[1,0,2]],'holes':[0,1],'uvs':[[0,0],[1,0],[1,1],[0,1],[0.5,1]],"
    "'creases':[{'edge':[1,2],'sharpness':2}],'corners':[{'vertex':0,'sharpness':3}]},{'name':'nothing'}],"
    "'nodes':[{'mesh':'box'},{'mesh':'holes'},{'mesh':'nothing'}]}";

/* Makes the model under `id` another one, and `id` its. */
static void edit(loopback *loop, char id[API_ID_TEXT], const char *body) {
  char target[64];
  snprintf(target, sizeof target, "/v1/models/%s/edits", id);
  reply r = loopback_post(loop, target, "application/json", body);
  if (r.status != 201) fail_msg("%s\n%d %s", body, r.status, r.body);
  cJSON *tree = cJSON_Parse(r.body);
  snprintf(id, API_ID_TEXT, "%s", json_member(tree, "id")->valuestring);
  cJSON_Delete(tree);
  reply_free(&r);
}

/* What the model's description says of a mesh; but of welding, which stored vertices need. */
static char *mesh_text(loopback *loop, const char *id, int mesh) {
  cJSON *tree = model_get_json(loop, id, ""),
        *of = cJSON_GetArrayItem(cJSON_GetObjectItem(tree, "meshes"), mesh);
  for (const cJSON *warning = json_member(tree, "warnings")->child; warning; warning = warning->next)
    assert_null(strstr(warning->valuestring, "left out"));
  cJSON_DeleteItemFromObject(of, "welded_points");
  char *text = cJSON_PrintUnformatted(of);
  assert_non_null(text);
  cJSON_Delete(tree);
  return text;
}

static const char move_box[] = "{'mesh':'box','edits':[{'edit':'move','vertices':[0],'by':[0,-1,0]}]}";

TEST_WITH(meshes_of_holes_alone_and_of_nothing_outlive_edits_of_another, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], *before[2];
  loopback_upload(loop, "application/json", three_meshes, id);
  for (int i = 0; i < 2; i++) before[i] = mesh_text(loop, id, 1 + i);
  for (int times = 0; times < 2; times++) {
    edit(loop, id, move_box);
    for (int i = 0; i < 2; i++) {
      char *after = mesh_text(loop, id, 1 + i);
      assert_string_equal(after, before[i]);
      free(after);
    }
  }
  for (int i = 0; i < 2; i++) free(before[i]);
}

/* A hole that is filled again has its corners and texture coordinates. */
TEST_WITH(holes_that_a_stored_model_kept_can_be_faces_again, loopback_setup, loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], target[96];
  loopback_upload(loop, "application/json", three_meshes, id);
  edit(loop, id, move_box);
  edit(loop, id,
       "{'mesh':'holes','edits':[{'edit':'hole','faces':[0],'sharpness':0},{'edit':'delete','faces':[1]}]}");
  snprintf(target, sizeof target, "/v1/models/%s/surface.obj?level=0", id);
  reply r = loopback_get(loop, target);
  const char *mesh = strstr(r.body, "o holes");
  static const char *const rows[] = {"\nv 0 0 0\n", "\nv 1 1 0\n", "\nvt 0.5 0\n", "\nvt 1 1\n", "\nf "};
  assert_non_null(mesh);
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
    if (!strstr(mesh, rows[i])) fail_msg("no %s in %s", rows[i], mesh);
  reply_free(&r);
}

/* POSITION, NORMAL, TANGENT and TEXCOORD_0 of a triangle, without a material that would need the tangents. */
static const char tangents[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],'nodes':[{'mesh':0}],'meshes':[{'"
    "primitives':["
    "{'attributes':{'POSITION':0,'NORMAL':1,'TANGENT':2,'TEXCOORD_0':3}}]}],'accessors':["
    "{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3','min':[0,0,0],'max':[1,1,0]},"
    "{'bufferView':0,'byteOffset':36,'componentType':5126,'count':3,'type':'VEC3'},"
    "{'bufferView':0,'byteOffset':72,'componentType':5126,'count':3,'type':'VEC4'},"
    "{'bufferView':0,'byteOffset':120,'componentType':5126,'count':3,'type':'VEC2'}],"
    "'bufferViews':[{'buffer':0,'byteLength':144}],'buffers':[{'byteLength':144,'uri':"
    "'data:application/octet-stream;base64,"
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/"
    "AACAPwAAAAAAAAAAAACAPwAAgD8AAAAAAAAAAAAAgD8AAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/"
    "'}]}";

static void assert_tangents(loopback *loop, const char *id, const char *level) {
  char target[96];
  snprintf(target, sizeof target, "/v1/models/%s/surface.gltf?level=%s", id, level);
  reply r = loopback_get(loop, target);
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(r.body, "\"TANGENT\""));
  reply_free(&r);
}

/* A moved mesh is stored without its normals, and without tangents, which need them. */
TEST_WITH(surfaces_of_edited_meshes_have_tangents_where_the_file_had_some, loopback_setup,
          loopback_teardown) {
  loopback *loop = *state;
  char id[API_ID_TEXT], *text = quoted(tangents);
  loopback_upload(loop, "model/gltf+json", text, id);
  free(text);
  assert_tangents(loop, id, "1");
  for (int times = 0; times < 2; times++) {
    edit(loop, id, "{'edits':[{'edit':'move','vertices':[0],'by':[0,-1,0]}]}");
    assert_tangents(loop, id, "0");
    assert_tangents(loop, id, "1");
  }
}
