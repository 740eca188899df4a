/* tweend JSON: what is refused, with the place, and what a good document becomes. */
#include "loopback.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "json_in.h"
#include "tweend/json_print.h"
#include "tweend/json_text.h"

/* A document that is refused. */
typedef struct bad_document {
  const char *text;
  int status;
  const char *pointer;
  const char *word; /* of the detail, or NULL */
} bad_document;

#define TRIANGLE       "'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,2]]"
#define MESH(more)     "{'meshes':[{" TRIANGLE more "}]}"
#define TRACK(members) "{'nodes':[{'name':'a'}],'clips':[{'name':'c','tracks':[{'node':'a'," members "}]}]}"
#define TWO_KEYS       "'times':[0,1],'quaternions':[[0,0,0,1],[0,0,1,0]]"

static const bad_document not_json[] = {
    {"{", 400, "", "ends"},
    {"{'meshes':[", 400, "/meshes/0", "ends"},
    {"{'meshes':[{'name':'a", 400, "/meshes/0/name", "end of a string"},
    {"{'nodes':[]} x", 400, "", "behind the end"},
    {"{'nodes':[],}", 400, "", "key"},
    {"{'nodes':[1,]}", 400, "/nodes/1", "value"},
    {"{'nodes' []}", 400, "/nodes", "':'"},
    {"{nodes:[]}", 400, "", "key in quotes"},
    {"{'nodes':[{'name':'\\x'}]}", 400, "/nodes/0/name", "escape"},
    {"{'nodes':[{'name':'\\u12g4'}]}", 400, "/nodes/0/name", "hex"},
    {"{'nodes':[{'name':'a\\u0000b'}]}", 400, "/nodes/0/name", "U+0000"},
    {"{'nodes':[{'name':'\\ud800'}]}", 400, "/nodes/0/name", "surrogate"},
    {"{'nodes':[{'name':'\\udc00'}]}", 400, "/nodes/0/name", "surrogate"},
    {"{'nodes':[{'name':'\\ud800\\u0041'}]}", 400, "/nodes/0/name", "surrogate"},
    {"{'nodes':[{'name':'a\tb'}]}", 400, "/nodes/0/name", "control"},
    {"{'nodes':[{'name':'\xff'}]}", 400, "/nodes/0/name", "UTF-8"},
    {"{'nodes':[{'name':'\xc0\xaf'}]}", 400, "/nodes/0/name", "UTF-8"},
    {"{'nodes':[{'name':'\xed\xa0\x80'}]}", 400, "/nodes/0/name", "UTF-8"},
    {"{'meshes':[{'positions':[[01,0,0]]}]}", 400, "/meshes/0/positions/0/0", "number"},
    {"{'meshes':[{'positions':[[1.,0,0]]}]}", 400, "/meshes/0/positions/0/0", "digit"},
    {"{'meshes':[{'positions':[[.5,0,0]]}]}", 400, "/meshes/0/positions/0/0", "value"},
    {"{'meshes':[{'positions':[[+1,0,0]]}]}", 400, "/meshes/0/positions/0/0", "value"},
    {"{'meshes':[{'positions':[[1e,0,0]]}]}", 400, "/meshes/0/positions/0/0", "digit"},
    {"{'meshes':[{'positions':[[-,0,0]]}]}", 400, "/meshes/0/positions/0/0", "number"},
    {"{'meshes':[{'positions':[[0,NaN,0]]}]}", 400, "/meshes/0/positions/0/1", "value"},
    {"{'meshes':[{'positions':[[0,Infinity,0]]}]}", 400, "/meshes/0/positions/0/1", "value"},
    {"{'meshes':[{'positions':[[0,1e999,0]]}]}", 422, "/meshes/0/positions/0/1", "too large"},
    {"{'a/b~c':[tru]}", 400, "/a~1b~0c/0", "value"},
    {"[1,2]", 400, "", "object"},
    {"7", 400, "", "object"},
    {"", 400, NULL, "empty"},
};

static const bad_document not_tweend[] = {
    {"{'mesches':[]}", 400, "", "mesches"},
    {"{'nodes':[],'nodes':[]}", 400, "", "twice"},
    {"{'nodes':{}}", 400, "/nodes", "array"},
    {"{'nodes':[7]}", 400, "/nodes/0", "object"},
    {"{'nodes':[{'name':7}]}", 400, "/nodes/0/name", "text"},
    {"{'nodes':[{'colour':7}]}", 400, "/nodes/0", "colour"},
    {"{'nodes':[{'parent':0}]}", 400, "/nodes/0/parent", "name"},
    {"{'nodes':[{'parent':'b'}]}", 422, "/nodes/0/parent", "\"b\""},
    {"{'nodes':[{'mesh':'b'}]}", 422, "/nodes/0/mesh", "\"b\""},
    {"{'nodes':[{'name':'a'},{'name':'a'},{'parent':'a'}]}", 422, "/nodes/2/parent", "more than one"},
    {"{'nodes':[{'name':'a','parent':'a'}]}", 422, "/nodes/0/parent", NULL},
    {"{'nodes':[{'name':'a','parent':'b'},{'name':'b','parent':'a'}]}", 422, "/nodes/0/parent", "ancestor"},
    {"{'nodes':[{'translation':[0,0]}]}", 400, "/nodes/0/translation", "3"},
    {"{'nodes':[{'translation':[0,0,'1']}]}", 400, "/nodes/0/translation/2", "number"},
    {"{'nodes':[{'scale':[1,1e39,1]}]}", 422, "/nodes/0/scale/1", "float"},
    {"{'nodes':[{'rotation':[0,0,0,0]}]}", 422, "/nodes/0/rotation", NULL},
    {"{'meshes':[{'positions':[[0,0]]}]}", 400, "/meshes/0/positions/0", "3 numbers"},
    {"{'meshes':[{'positions':[0,0,0]}]}", 400, "/meshes/0/positions/0", "array"},
    {"{'meshes':[{'faces':[[0,1,2]]}]}", 422, "/meshes/0/faces/0/0", NULL},
    {"{'meshes':[{'positions':[[0,0,0]],'faces':[0]}]}", 400, "/meshes/0/faces/0", "array"},
    {MESH(",'colour':1"), 400, "/meshes/0", "colour"},
    {"{'meshes':[{'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,3]]}]}", 422, "/meshes/0/faces/0/2",
     NULL},
    {"{'meshes':[{'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,-1]]}]}", 422, "/meshes/0/faces/0/2",
     "-1"},
    {"{'meshes':[{'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,0.5]]}]}", 400, "/meshes/0/faces/0/2",
     "whole"},
    {"{'meshes':[{'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,4294967296]]}]}", 422,
     "/meshes/0/faces/0/2", "range"},
    {"{'meshes':[{'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,1]]}]}", 422, "/meshes/0/faces/0/2",
     NULL},
    {"{'meshes':[{'positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1]]}]}", 422, "/meshes/0/faces/0", NULL},
    {MESH(",'uvs':[[0,0]]"), 422, "/meshes/0/uvs", "as many"},
    {MESH(",'uvs':[[0,0]],'face_uvs':[]"), 422, "/meshes/0/face_uvs", NULL},
    {MESH(",'uvs':[[0,0]],'face_uvs':[[0,0]]"), 422, "/meshes/0/face_uvs/0", "corners"},
    {MESH(",'uvs':[[0,0]],'face_uvs':[[0,0,1]]"), 422, "/meshes/0/face_uvs/0/2", NULL},
    {MESH(",'uvs':[[0,0,0]],'face_uvs':[[0,0,0]]"), 400, "/meshes/0/uvs/0", "2 numbers"},
    {MESH(",'creases':[{'edge':[0,1]}]"), 400, "/meshes/0/creases/0/sharpness", "number"},
    {MESH(",'creases':[{'edge':[0],'sharpness':1}]"), 400, "/meshes/0/creases/0/edge", "two"},
    {MESH(",'creases':[{'edge':[0,1],'sharpness':-1}]"), 422, "/meshes/0/creases/0/sharpness", NULL},
    {MESH(",'creases':[{'edge':[0,9],'sharpness':1}]"), 422, "/meshes/0/creases/0/edge", NULL},
    {MESH(",'creases':[{'verts':[0,1],'sharpness':1}]"), 400, "/meshes/0/creases/0", "verts"},
    {MESH(",'corners':[{'vertex':7,'sharpness':1}]"), 422, "/meshes/0/corners/0/vertex", NULL},
    {MESH(",'corners':[{'vertex':0}]"), 400, "/meshes/0/corners/0/sharpness", NULL},
    {MESH(",'holes':[1]"), 422, "/meshes/0/holes/0", NULL},
    {MESH(",'holes':[true]"), 400, "/meshes/0/holes/0", "number"},
    {MESH(",'color':'red'"), 400, "/meshes/0/color", "array"},
    {MESH(",'color':[1,0]"), 400, "/meshes/0/color", "3 numbers"},
    {MESH(",'color':[1,0,0,1]"), 400, "/meshes/0/color", "3 numbers"},
    {MESH(",'color':[1,0,1.01]"), 400, "/meshes/0/color", "from 0 to 1"},
    {MESH(",'color':[-0.01,0,0]"), 400, "/meshes/0/color", "from 0 to 1"},
};

#define SHAPE(members) "{'meshes':[{'shape':{" members "}}]}"

static const bad_document bad_shapes[] = {
    {"{'meshes':[{'shape':'box'}]}", 400, "/meshes/0/shape", "object"},
    {SHAPE(""), 400, "/meshes/0/shape", "grid, box"},
    {SHAPE("'kind':7"), 400, "/meshes/0/shape/kind", "torus"},
    {SHAPE("'kind':'boks'"), 400, "/meshes/0/shape/kind", "did you mean box"},
    {SHAPE("'kind':'box','radius':1"), 400, "/meshes/0/shape", "known: kind, size, segments"},
    {SHAPE("'kind':'box','sizes':[1,1,1]"), 400, "/meshes/0/shape", "did you mean size"},
    {SHAPE("'kind':'box','size':[1,1]"), 400, "/meshes/0/shape/size", "3 numbers"},
    {SHAPE("'kind':'box','size':[1,0,1]"), 422, "/meshes/0/shape/size/1", "above 0"},
    {SHAPE("'kind':'box','size':2"), 400, "/meshes/0/shape/size", "array"},
    {SHAPE("'kind':'box','segments':[1,1]"), 400, "/meshes/0/shape/segments", "3 numbers"},
    {SHAPE("'kind':'box','segments':[1,1,0]"), 422, "/meshes/0/shape/segments/2", "at least 1"},
    {SHAPE("'kind':'box','segments':[1,1.5,1]"), 400, "/meshes/0/shape/segments/1", "whole"},
    {SHAPE("'kind':'box','segments':[1000000000,1000000000,1000000000]"), 422, "/meshes/0/shape", "faces"},
    {SHAPE("'kind':'grid','size':[1,1,1]"), 400, "/meshes/0/shape/size", "2 numbers"},
    {SHAPE("'kind':'icosphere','level':4000000000"), 422, "/meshes/0/shape", "faces"},
    {SHAPE("'kind':'uv_sphere','segments':[3,4]"), 400, "/meshes/0/shape/segments", "number"},
    {SHAPE("'kind':'uv_sphere','rings':1"), 422, "/meshes/0/shape/rings", "at least 2"},
    {SHAPE("'kind':'torus','tube':1"), 422, "/meshes/0/shape/tube", "less than"},
    {SHAPE("'kind':'cone','caps':'open'"), 400, "/meshes/0/shape/caps", "none"},
    {"{'meshes':[{'positions':[],'shape':{'kind':'box'}}]}", 400, "/meshes/0/positions", "shape"},
    {"{'meshes':[{'shape':{'kind':'box'},'faces':[]}]}", 400, "/meshes/0/faces", "shape"},
    {"{'meshes':[{'shape':{'kind':'box'},'holes':[6]}]}", 422, "/meshes/0/holes/0", NULL},
};

#define EDITED(edits) "{'meshes':[{},{'shape':{'kind':'box'},'edits':[" edits "]}]}"
#define FACING_UP     "'faces':{'facing':[0,1,0],'within':10}"

static const bad_document bad_edits[] = {
    {EDITED("7"), 400, "/meshes/1/edits/0", "object"},
    {EDITED("{}"), 400, "/meshes/1/edits/0", "extrude"},
    {EDITED("{'edit':'extrud'}"), 400, "/meshes/1/edits/0/edit", "did you mean extrude"},
    {EDITED("{'edit':7}"), 400, "/meshes/1/edits/0/edit", "expected one of"},
    {EDITED("{'edit':'smooth','iterations':101}"), 422, "/meshes/1/edits/0/iterations", "100"},
    {EDITED("{'edit':'move','faces':'all'}"), 400, "/meshes/1/edits/0/by", "needs by"},
    {EDITED("{'edit':'move','by':[0,1,0]}"), 422, "/meshes/1/edits/0", "applied to"},
    {EDITED("{'edit':'move','faces':'all','by':[0,1]}"), 400, "/meshes/1/edits/0/by", "3 numbers"},
    {EDITED("{'edit':'move','faces':'all','by':[0,1e999,0]}"), 422, "/meshes/1/edits/0/by/1", "too large"},
    {EDITED("{'edit':'move','faces':[6],'by':[0,1,0]}"), 422, "/meshes/1/edits/0/faces/0", NULL},
    {EDITED("{'edit':'move','faces':[0.5],'by':[0,1,0]}"), 400, "/meshes/1/edits/0/faces/0", "whole"},
    {EDITED("{'edit':'move','faces':[],'by':[0,1,0]}"), 422, "/meshes/1/edits/0/faces", NULL},
    {EDITED("{'edit':'move','faces':'al','by':[0,1,0]}"), 400, "/meshes/1/edits/0/faces", "did you mean all"},
    {EDITED("{'edit':'move','faces':7,'by':[0,1,0]}"), 400, "/meshes/1/edits/0/faces", "all"},
    {EDITED("{'edit':'move','faces':'all','edges':'all','by':[0,1,0]}"), 400, "/meshes/1/edits/0/edges",
     "faces are given already"},
    {EDITED("{'edit':'move','faces':{},'by':[0,1,0]}"), 400, "/meshes/1/edits/0/faces", "selected by"},
    {EDITED("{'edit':'move','faces':{'loop':[0,1]},'by':[0,1,0]}"), 400, "/meshes/1/edits/0/faces",
     "known: group"},
    {EDITED("{'edit':'move','faces':{'within':3},'by':[0,1,0]}"), 400, "/meshes/1/edits/0/faces/within",
     "facing"},
    {EDITED("{'edit':'move','faces':{'facing':[0,1,0],'made':'a'},'by':[0,1,0]}"), 400,
     "/meshes/1/edits/0/faces/made", "one thing"},
    {EDITED("{'edit':'move','faces':{'facing':[0,0,0]},'by':[0,1,0]}"), 422, "/meshes/1/edits/0/faces/facing",
     "length 0"},
    {EDITED("{'edit':'move','faces':{'facing':[0,1,0],'within':181},'by':[0,1,0]}"), 422,
     "/meshes/1/edits/0/faces/within", "180"},
    {EDITED("{'edit':'move','vertices':{'inside':{'min':[0,0,0]}},'by':[0,1,0]}"), 400,
     "/meshes/1/edits/0/vertices/inside", "min and max"},
    {EDITED("{'edit':'move','edges':[[0,1],[0,1,2]],'by':[0,1,0]}"), 400, "/meshes/1/edits/0/edges/1",
     "two vertices"},
    {EDITED("{'edit':'move','edges':[[0,7]],'by':[0,1,0]}"), 422, "/meshes/1/edits/0/edges/0", NULL},
    {EDITED("{'edit':'move','faces':{'made':'a'},'by':[0,1,0]}"), 422, "/meshes/1/edits/0/faces/made", NULL},
    {EDITED("{'edit':'crease','faces':'all'}"), 400, "/meshes/1/edits/0",
     "known: edit, name, optional, edges, sharpness"},
    {EDITED("{'edit':'crease','edges':'all','sharpness':-1}"), 422, "/meshes/1/edits/0/sharpness",
     "0 or more"},
    {EDITED("{'edit':'flip','optional':1}"), 400, "/meshes/1/edits/0/optional", "true or false"},
    {EDITED("{'edit':'extrude'," FACING_UP "}"), 400, "/meshes/1/edits/0/distance", "needs distance"},
    {EDITED("{'edit':'extrude'," FACING_UP ",'distance':1,'by':[0,1,0]}"), 400, "/meshes/1/edits/0/distance",
     "or by a vector"},
    {EDITED("{'edit':'inset'," FACING_UP "}"), 400, "/meshes/1/edits/0/amount", "needs amount"},
    {EDITED("{'edit':'loop_cut'}"), 400, "/meshes/1/edits/0/edge", "needs edge"},
    {EDITED("{'edit':'loop_cut','edge':[0]}"), 400, "/meshes/1/edits/0/edge", "two vertices"},
    {EDITED("{'edit':'loop_cut','edge':[0,7]}"), 422, "/meshes/1/edits/0/edge", NULL},
    {EDITED("{'edit':'loop_cut','edge':[0,1],'cuts':2,'at':[0.5]}"), 422, "/meshes/1/edits/0/at",
     "there is 1 place for 2 cuts"},
    {EDITED("{'edit':'loop_cut','edge':[0,1],'at':[]}"), 422, "/meshes/1/edits/0/at",
     "an edge is cut 1 to 10000 times"},
    {EDITED("{'edit':'loop_cut','edge':[0,1],'cuts':4000000000}"), 422, "/meshes/1/edits/0/cuts", NULL},
    {EDITED("{'edit':'subdivide','faces':'all','cuts':9999}"), 422, "/meshes/1/edits/0", NULL},
    {EDITED("{'edit':'fill','method':'fair'}"), 422, "/meshes/1/edits/0", "no hole to fill"},
    {EDITED("{'edit':'merge','vertices':'all','distance':1,'to':[0,0,0]}"), 400, "/meshes/1/edits/0/to",
     "or to a point"},
    {EDITED("{'edit':'merge','vertices':'all','distance':-1}"), 422, "/meshes/1/edits/0/distance",
     "0 or more"},
    {EDITED("{'edit':'mirror','axis':'w'}"), 400, "/meshes/1/edits/0/axis", "x, y, z"},
    {EDITED("{'edit':'rotate','faces':'all','axis':[0,0,0],'degrees':1}"), 422, "/meshes/1/edits/0/axis",
     "length 0"},
    {EDITED("{'edit':'rotate','faces':'all','axis':'y'}"), 400, "/meshes/1/edits/0/degrees", "needs degrees"},
    {EDITED("{'edit':'scale','faces':'all','by':'2'}"), 400, "/meshes/1/edits/0/by", "array"},
    {EDITED("{'edit':'move','faces':'all','by':[0,0,0]},{'edit':'move','vertices':[9],'by':[0,0,0]}"), 422,
     "/meshes/1/edits/1/vertices/0", NULL},
    {"{'meshes':[{'positions':[[0,0,0]],'faces':[[0,1,2]],'edits':[]}]}", 422, "/meshes/0/faces/0/1", NULL},
};

static const bad_document bad_tracks[] = {
    {"{'clips':[{'tracks':[{'path':'rotation'}]}]}", 400, "/clips/0/tracks/0", "node"},
    {"{'clips':[{'tracks':[{'node':'a','path':'rotation'}]}]}", 422, "/clips/0/tracks/0/node", "\"a\""},
    {"{'clips':[{'loop':true}]}", 400, "/clips/0", "loop"},
    {TRACK("'path':'weights','times':[0]"), 400, "/clips/0/tracks/0/path", "translation"},
    {TRACK("'path':'rotation'," TWO_KEYS ",'speed':1"), 400, "/clips/0/tracks/0", "speed"},
    {TRACK("'path':'rotation','times':[0,1]"), 400, "/clips/0/tracks/0", "quaternions"},
    {TRACK("'path':'rotation','quaternions':[[0,0,0,1]]"), 400, "/clips/0/tracks/0", "times"},
    {TRACK("'path':'rotation','times':[],'quaternions':[]"), 422, "/clips/0/tracks/0/times", "key"},
    {TRACK("'path':'rotation','times':[0],'values':[[0,0,0]]"), 400, "/clips/0/tracks/0/values", NULL},
    {TRACK("'path':'scale','times':[0],'quaternions':[[0,0,0,1]]"), 400, "/clips/0/tracks/0/quaternions",
     NULL},
    {TRACK("'path':'rotation'," TWO_KEYS ",'eulers':[]"), 400, "/clips/0/tracks/0/eulers", "quaternions"},
    {TRACK("'path':'rotation'," TWO_KEYS ",'order':'XYZ'"), 400, "/clips/0/tracks/0/order", NULL},
    {TRACK("'path':'rotation'," TWO_KEYS ",'unit':'degrees'"), 400, "/clips/0/tracks/0/unit", NULL},
    {TRACK("'path':'rotation'," TWO_KEYS ",'interpolation':'fast'"), 400, "/clips/0/tracks/0/interpolation",
     "slerp"},
    {TRACK("'path':'rotation'," TWO_KEYS ",'in_tangents':[]"), 400, "/clips/0/tracks/0/in_tangents", NULL},
    {TRACK("'path':'rotation'," TWO_KEYS ",'interpolation':'cubicspline'"), 400, "/clips/0/tracks/0",
     "in_tangents"},
    {TRACK("'path':'translation','interpolation':'slerp','times':[0],'values':[[0,0,0]]"), 422,
     "/clips/0/tracks/0/interpolation", NULL},
    {TRACK("'path':'rotation','times':[1,0],'quaternions':[[0,0,0,1],[0,0,1,0]]"), 422,
     "/clips/0/tracks/0/times/1", NULL},
    {TRACK("'path':'rotation','times':[0,0,1,0.5],'quaternions':[[0,0,0,1],[0,0,1,0],[0,0,0,1],[0,0,1,0]]"),
     422, "/clips/0/tracks/0/times/3", NULL},
    {TRACK("'path':'rotation','times':[-1,0],'quaternions':[[0,0,0,1],[0,0,1,0]]"), 422,
     "/clips/0/tracks/0/times/0", NULL},
    {TRACK("'path':'rotation','times':[0,1e40],'quaternions':[[0,0,0,1],[0,0,1,0]]"), 422,
     "/clips/0/tracks/0/times/1", "float"},
    {TRACK("'path':'rotation','times':[0],'quaternions':[[0,0,0,1],[0,0,1,0]]"), 422,
     "/clips/0/tracks/0/quaternions", "2 keys for 1"},
    {TRACK("'path':'rotation','times':[0],'quaternions':[[0,0,0,0]]"), 422, "/clips/0/tracks/0/quaternions/0",
     NULL},
    {TRACK("'path':'rotation','times':[0],'axis_angles':[[0,0,0,1]]"), 422, "/clips/0/tracks/0/axis_angles/0",
     NULL},
    {TRACK("'path':'rotation','times':[0],'eulers':[[0,0]]"), 400, "/clips/0/tracks/0/eulers/0", "3"},
    {TRACK("'path':'rotation','times':[0],'eulers':[[0,0,0]],'order':'XYX'"), 400, "/clips/0/tracks/0/order",
     "ZYX"},
    {TRACK("'path':'rotation'," TWO_KEYS "},{'node':'a','path':'rotation'," TWO_KEYS), 422,
     "/clips/0/tracks/1/path", NULL},
};

static void refuse_all(loopback *loop, const bad_document *documents, size_t count) {
  for (size_t i = 0; i < count; i++) {
    reply r = loopback_post(loop, "/v1/models", "application/json", documents[i].text);
    if (r.status != documents[i].status) print_error("%s\n", documents[i].text);
    assert_problem(r, documents[i].status, documents[i].pointer, documents[i].word);
    assert_int_equal(loopback_store_count(loop), 0);
  }
}

TEST_WITH(what_is_no_json_is_refused_with_its_place, loopback_setup, loopback_teardown) {
  refuse_all(*state, not_json, sizeof not_json / sizeof *not_json);
}

TEST_WITH(what_is_no_model_is_refused_with_its_place, loopback_setup, loopback_teardown) {
  refuse_all(*state, not_tweend, sizeof not_tweend / sizeof *not_tweend);
}

TEST_WITH(bad_shapes_are_refused_with_their_place, loopback_setup, loopback_teardown) {
  refuse_all(*state, bad_shapes, sizeof bad_shapes / sizeof *bad_shapes);
}

TEST_WITH(bad_edits_are_refused_with_their_place, loopback_setup, loopback_teardown) {
  refuse_all(*state, bad_edits, sizeof bad_edits / sizeof *bad_edits);
}

TEST_WITH(bad_tracks_are_refused_with_their_place, loopback_setup, loopback_teardown) {
  refuse_all(*state, bad_tracks, sizeof bad_tracks / sizeof *bad_tracks);
}

TEST(nesting_of_64_is_accepted_and_65_is_not) {
  char text[200];
  for (int depth = 64; depth <= 65; depth++) {
    memset(text, '[', (size_t)depth);
    memset(text + depth, ']', (size_t)depth);
    tw_error error;
    tw_status status = tw_json_check(text, 2 * (size_t)depth, &(tw_json_rules){0}, &error);
    assert_int_equal(status, depth == 64 ? TW_OK : TW_SYNTAX);
  }
}

TEST(values_are_counted) {
  char text[] = "[1,[2],{'a':3}]";
  tw_error error;
  quote(text);
  assert_int_equal(tw_json_check(text, 15, &(tw_json_rules){.values_max = 6}, &error), TW_OK);
  assert_int_equal(tw_json_check(text, 15, &(tw_json_rules){.values_max = 5}, &error), TW_LIMIT);
  assert_string_equal(error.pointer, "/2/a");
}

TEST(cut_anywhere_a_document_is_refused) {
  char text[] = "{'a':[1,-2.5e3,true,null,'x\\u00e4\\n\xc3\xa4'],'b':{}}";
  tw_error error;
  quote(text);
  assert_int_equal(tw_json_check(text, strlen(text), &(tw_json_rules){0}, &error), TW_OK);
  for (size_t size = 0; size < strlen(text); size++) {
    /* A copy of exactly this size, so that a sanitizer sees a byte too far. */
    char *cut = malloc(size ? size : 1);
    memcpy(cut, text, size);
    assert_int_equal(tw_json_check(cut, size, &(tw_json_rules){0}, &error), TW_SYNTAX);
    free(cut);
  }
}

TEST_WITH(line_and_column_are_told, loopback_setup, loopback_teardown) {
  assert_problem(loopback_post(*state, "/v1/models", "application/json", "{\n 'nodes':\n  [7,\n   x]}"), 400,
                 "/nodes/1", "line 4, column 4");
}

static tw_status read_within(const char *json, uint64_t faces_max, tw_model **model, tw_error *error) {
  char *text = quoted(json);
  const api_making making = {.faces_max = faces_max, .bytes_max = 1 << 24};
  tw_status status = api_model_from_json(text, strlen(text), &making, model, error);
  free(text);
  return status;
}

static tw_model *read_model(const char *json) {
  tw_model *model = NULL;
  tw_error error;
  if (read_within(json, 1000, &model, &error) != TW_OK) fail_msg("%s: %s", error.pointer, error.detail);
  return model;
}

TEST(an_empty_document_is_an_empty_model) {
  tw_model *model = read_model(" {} ");
  assert_int_equal(model->mesh_count + model->node_count + model->clip_count, 0);
  tw_model_destroy(model);
}

TEST(a_mesh_comes_with_all_its_parts) {
  tw_model *model =
      read_model("{'meshes':[{'name':'q\xc3\xa4','positions':[[0,0,0],[1,0,0],[1,1,0],[0,1,0.5]],"
                 "'faces':[[0,1,2,3],[0,2,1]],'uvs':[[0,0.25],[1,1]],'face_uvs':[[0,1,0,1],[1,1,0]],"
                 "'creases':[{'edge':[1,2],'sharpness':2.5},{'sharpness':99,'edge':[0,1]}],"
                 "'corners':[{'vertex':3,'sharpness':10}],'holes':[1]}]}");
  const tw_mesh *mesh = &model->meshes[0];
  assert_string_equal(mesh->name, "q\xc3\xa4");
  assert_int_equal(mesh->point_count, 4);
  assert_true(mesh->positions[11] == 0.5f);
  assert_int_equal(mesh->face_count, 2);
  assert_int_equal(mesh->corner_count, 7);
  assert_int_equal(mesh->face_offsets[1], 4);
  assert_int_equal(mesh->corners[5], 2);
  assert_true(mesh->uv_sets[0].values[1] == 0.75f); /* v up inside */
  assert_int_equal(mesh->uv_sets[0].corners[4], 1);
  assert_int_equal(mesh->crease_count, 2);
  assert_int_equal(mesh->crease_edges[1], 2);
  assert_true(mesh->crease_sharpness[0] == 2.5f);
  assert_true(mesh->crease_sharpness[1] == TW_SHARPNESS_INFINITE);
  assert_int_equal(mesh->sharp_points[0], 3);
  assert_int_equal(mesh->holes[0], 1);
  assert_int_equal(model->node_count, 1); /* made for the mesh */
  tw_model_destroy(model);
}

TEST(a_shape_takes_name_and_tags_like_any_mesh) {
  tw_model *model = read_model("{'meshes':[{'name':'b','shape':{'kind':'box','size':[2,1,4],"
                               "'segments':[2,1,3]},'creases':[{'edge':[0,1],'sharpness':2}],"
                               "'corners':[{'vertex':0,'sharpness':10}],'holes':[21]},"
                               "{'shape':{'kind':'grid','size':[6,2],'segments':[3,1]}}]}");
  const tw_mesh *box = &model->meshes[0], *grid = &model->meshes[1];
  assert_string_equal(box->name, "b");
  assert_int_equal(box->point_count, 24);
  assert_int_equal(box->face_count, 22);
  assert_int_equal(box->crease_count + box->sharp_point_count + box->hole_count, 3);
  assert_int_equal(grid->face_count, 3);
  assert_true(grid->positions[0] == -3 && grid->positions[2] == -1);
  assert_int_equal(model->node_count, 2); /* made for the meshes */
  tw_model_destroy(model);
}

TEST(edits_are_applied_in_order) {
  tw_model *model =
      read_model(EDITED("{'edit':'extrude'," FACING_UP ",'distance':0.4,'name':'deck'},{'edit':'move',"
                        "'faces':{'made':'deck'},'by':[0,0.1,0]},"
                        "{'edit':'rotate','vertices':'all','axis':'y','degrees':90,"
                        "'about':[0,0,0]},{'edit':'scale','edges':{'inside':{'min':"
                        "[-9,0.9,-9],'max':[9,9,9]}},'by':2},"
                        "{'edit':'crease','edges':{'sharper_than':60},"
                        "'sharpness':2},{'edit':'corner','vertices':[0]},"
                        "{'edit':'hole','faces':[0]},{'edit':'move',"
                        "'edges':'border','by':[1,0,0],'optional':true}"));
  const tw_mesh *mesh = &model->meshes[1];
  assert_int_equal(mesh->point_count, 12);
  assert_int_equal(mesh->face_count, 10);
  assert_int_equal(mesh->sharp_point_count, 1);
  assert_int_equal(mesh->hole_count, 1);
  assert_true(mesh->crease_count >= 12);
  float top = 0, wide = 0;
  for (uint32_t i = 0; i < 12; i++) {
    top = fmaxf(top, mesh->positions[3 * i + 1]);
    wide = fmaxf(wide, mesh->positions[3 * i]);
  }
  assert_true(fabsf(top - 1) < 1e-6f && fabsf(wide - 1) < 1e-6f);
  tw_model_destroy(model);
}

TEST(the_faces_of_all_shapes_together_are_limited) {
  static const char text[] = "{'meshes':[{'shape':{'kind':'grid','segments':[10,10]}},"
                             "{'shape':{'kind':'grid','segments':[10,11]}}]}";
  tw_model *model = NULL;
  tw_error error;
  assert_int_equal(read_within(text, 209, &model, &error), TW_LIMIT);
  assert_int_equal(read_within(text, 210, &model, &error), TW_OK);
  tw_model_destroy(model);
}

TEST_WITH(sixty_bytes_make_a_surface, loopback_setup, loopback_teardown) {
  reply r = loopback_post(*state, "/v1/surface.json?level=2", "application/json", SHAPE("'kind':'box'"));
  assert_int_equal(r.status, 200);
  assert_says(&r, "'vertices':98,");
  reply_free(&r);
  r = loopback_post(*state, "/v1/surface.glb", "application/json", SHAPE("'kind':'torus'"));
  assert_int_equal(r.status, 200);
  reply_free(&r);
}

#define COLORED                                                                                              \
  "{'meshes':[{'shape':{'kind':'grid'}},{'name':'red','shape':{'kind':'box'},'color':[1,0.25,0]},"           \
  "{'shape':{'kind':'box'},'color':[0,0,0.5],'edits':[{'edit':'extrude','faces':[0],'distance':1}]}]}"

TEST(a_color_is_of_all_faces_of_its_mesh) {
  tw_model *model = read_model(COLORED);
  assert_int_equal(model->material_count, 2);
  assert_string_equal(model->material_names[0], "red");
  assert_null(model->material_names[1]);
  assert_null(model->meshes[0].face_materials);
  for (uint32_t mesh = 1; mesh < 3; mesh++) {
    assert_int_equal(model->meshes[mesh].face_count, mesh == 1 ? 6 : 10);
    for (uint32_t face = 0; face < model->meshes[mesh].face_count; face++)
      assert_int_equal(model->meshes[mesh].face_materials[face], mesh - 1);
  }
  static const float colors[] = {1, 0.25f, 0, 0, 0, 0.5f};
  assert_memory_equal(model->material_colors, colors, sizeof colors);
  tw_model_destroy(model);
}

TEST_WITH(a_color_is_that_of_a_material_without_metal, loopback_setup, loopback_teardown) {
  reply r = loopback_post(*state, "/v1/surface.gltf?level=1", "application/json", COLORED);
  assert_int_equal(r.status, 200);
  assert_says(&r, "'materials':[{'name':'red','pbrMetallicRoughness':{'baseColorFactor':[1,0.25,0,1],"
                  "'metallicFactor':0}},{'pbrMetallicRoughness':{'baseColorFactor':[0,0,0.5,1],"
                  "'metallicFactor':0}}]");
  assert_says(&r, "'material':0");
  assert_says(&r, "'material':1");
  reply_free(&r);
  r = loopback_post(*state, "/v1/surface.obj?level=0", "application/json", COLORED);
  assert_says(&r, "usemtl red\n");
  reply_free(&r);
  r = loopback_post(*state, "/v1/surface.gltf", "application/json", SHAPE("'kind':'box'"));
  assert_null(strstr((const char *)r.body, "materials")); /* as ever */
  reply_free(&r);
}

TEST(uvs_without_faces_belong_to_the_points) {
  tw_model *model = read_model(MESH(",'uvs':[[0,0],[1,0],[0,1]]"));
  assert_int_equal(model->meshes[0].uv_sets[0].value_count, 3);
  assert_int_equal(model->meshes[0].uv_sets[0].corners[2], 2);
  tw_model_destroy(model);
}

TEST(nodes_refer_to_each_other_by_name) {
  tw_model *model = read_model("{'meshes':[{'name':'m'}],'nodes':[{'name':'b','parent':'a','mesh':'m'},"
                               "{'name':'a','translation':[1,2,3],'scale':[2,2,2]},{'parent':'node_3'},{}]}");
  assert_int_equal(model->nodes[0].parent, 1);
  assert_int_equal(model->nodes[0].mesh, 0);
  assert_int_equal(model->nodes[2].parent, 3);
  assert_true(model->nodes[1].rest.translation[2] == 3 && model->nodes[1].rest.scale[0] == 2);
  assert_true(model->nodes[1].rest.rotation[3] == 1);
  tw_model_destroy(model);
}

TEST(tracks_keep_form_order_and_unit) {
  tw_model *model =
      read_model(TRACK("'path':'rotation','interpolation':'euler','order':'ZXY','unit':'degrees',"
                       "'times':[0,1],'eulers':[[-170,0,0],[170,0,90]]"));
  const tw_track_keys *track = &model->clips[0].tracks[0];
  assert_int_equal(track->form, TW_KEY_EULER);
  assert_int_equal(track->interpolation, TW_EULER);
  assert_int_equal(track->order, TW_ZXY);
  assert_true(track->angles[5] > 1.5707963 && track->angles[5] < 1.5707964);
  tw_model_destroy(model);
  model = read_model(TRACK("'path':'rotation','times':[0,2],'unit':'degrees','axis_angles':[[1,0,0,0],"
                           "[1,0,0,720]]"));
  track = &model->clips[0].tracks[0];
  assert_int_equal(track->form, TW_KEY_AXIS_ANGLE);
  assert_true(track->angles[4] == 1 && track->angles[7] > 12.566370 && track->angles[7] < 12.566371);
  tw_model_destroy(model);
}

TEST(spline_keys_are_interleaved_as_in_gltf) {
  tw_model *model =
      read_model(TRACK("'path':'translation','interpolation':'cubicspline','times':[0,1],"
                       "'in_tangents':[[1,1,1],[4,4,4]],'values':[[2,2,2],[5,5,5]],'out_tangents':[[3,3,3],"
                       "[6,6,6]]"));
  const float *values = model->clips[0].tracks[0].values;
  for (int i = 0; i < 18; i++) {
    int part = i / 3;
    assert_true(values[i] == (float)(1 + part));
  }
  tw_model_destroy(model);
}

TEST(the_tank_is_read) {
  size_t size;
  char *text = loopback_file("server/samples/tank.json", &size);
  tw_model *model = read_model(text);
  assert_int_equal(model->mesh_count, 5);
  assert_int_equal(model->node_count, 9);
  assert_int_equal(model->clip_count, 2);
  tw_model_destroy(model);
  free(text);
}

TEST(strings_are_read_as_they_are_meant) {
  static const char written[] = "a\\\"\\\\\\/\\b\\f\\n\\r\\t \\u0041\\u00E9\\u20ac\\ud83D\\uDE00.";
  static const char meant[] = "a\"\\/\b\f\n\r\t A\303\251\342\202\254\360\237\230\200.";
  char out[sizeof written];
  const char *end = tw_json_unescape(written, strlen(written), out);
  assert_int_equal(end - out, strlen(meant));
  assert_memory_equal(out, meant, strlen(meant));
}

TEST(vectors_are_the_same_whatever_room_there_is) {
  enum { COUNT = 40, WIDTH = 3, EACH = WIDTH * TW_FLOAT_TEXT + 3 };
  float values[COUNT * WIDTH];
  for (int i = 0; i < COUNT * WIDTH; i++) values[i] = 1.0f / (float)(i + 1);
  tw_text whole = {0};
  tw_text_reserve(&whole, COUNT * EACH + 1);
  tw_text_vectors(&whole, values, WIDTH, WIDTH, COUNT);
  for (size_t capacity = 0; capacity <= COUNT * EACH + 1; capacity += capacity % EACH < 2 ? 1 : EACH - 2) {
    tw_text text = {.data = malloc(capacity ? capacity : 1), .capacity = capacity};
    tw_text_vectors(&text, values, WIDTH, WIDTH, COUNT);
    assert_int_equal(text.size, whole.size);
    assert_memory_equal(text.data, whole.data, whole.size);
    tw_text_deinit(&text);
  }
  tw_text_deinit(&whole);
}
