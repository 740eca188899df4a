/* World space at many times against the same times asked for one by one: a pose leaves nothing to the next.
 */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A matrix, a node that turns, a matrix whose last row begins as told, and a skin of two of them. */
static const char format[] =
    "{'asset':{'version':'2.0'},'scene':0,'scenes':[{'nodes':[0]}],'nodes':[{'children':[1],"
    "'matrix':[2,0,0,0,0.5,1,0,0,0,0,1,0,3,4,5,1]},{'children':[2],'translation':[1,0,0],'scale':[1,2,1]},"
    "{'matrix':[1,0,0,%s,0,1,0,0,0,0,1,0,0,1,0,1]}],'skins':[{'joints':[2,1]}],"
    "'buffers':[{'byteLength':40,'uri':'data:application/octet-stream;base64,"
    "AAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAADzBDU/8wQ1Pw=='}],'bufferViews':[{'buffer':0,"
    "'byteLength':8},{'buffer':0,'byteOffset':8,'byteLength':32}],'accessors':[{'bufferView':0,"
    "'componentType':5126,'count':2,'type':'SCALAR','min':[0],'max':[1]},"
    "{'bufferView':1,'componentType':5126,'count':2,'type':'VEC4'}],"
    "'animations':[{'samplers':[{'input':0,'output':1}],'channels':[{'sampler':0,'target':{'node':1,"
    "'path':'rotation'}}]}]}";

enum { FPS = 36 }; /* two blocks of sixteen times and a part of one */

static reply ask(loopback *loop, const char *id, const char *options, const char *times) {
  char target[256];
  snprintf(target, sizeof target, "/v1/models/%s/pose.ndjson?%s&%s", id, options, times);
  reply r = loopback_get(loop, target);
  if (r.status != 200) fail_msg("%s: %s", target, r.body);
  return r;
}

/* Each line of the answer about many times is the answer about its time. */
static void assert_same_one_by_one(const char *last_row, const char *options) {
  api_settings settings = loopback_settings();
  loopback *loop = loopback_start(&settings);
  char document[2048], id[API_ID_TEXT], times[64];
  snprintf(document, sizeof document, format, last_row);
  loopback_upload(loop, "model/gltf+json", document, id);
  snprintf(times, sizeof times, "from=0&to=1&fps=%d", FPS);
  reply all = ask(loop, id, options, times);
  const char *line = all.body;
  for (int i = 0; i <= FPS; i++) {
    const char *end = strchr(line, '\n');
    assert_non_null(end);
    snprintf(times, sizeof times, "at=%.17g", (double)i / FPS);
    reply one = ask(loop, id, options, times);
    assert_int_equal(one.size, end + 1 - line);
    assert_memory_equal(one.body, line, one.size);
    reply_free(&one);
    line = end + 1;
  }
  assert_int_equal(*line, '\0');
  reply_free(&all);
  loopback_stop(loop);
}

TEST(world_matrices_are_those_of_single_poses) {
  assert_same_one_by_one("0", "space=world&as=matrix");
  assert_same_one_by_one("0", "space=world&as=matrix&nodes=node_2");
}

TEST(world_transforms_are_those_of_single_poses) {
  assert_same_one_by_one("0", "space=world");
  assert_same_one_by_one("0", "space=world&as=axis-angle");
}

TEST(joint_matrices_are_those_of_single_poses) {
  assert_same_one_by_one("0", "as=matrix&skinning=true");
}

TEST(a_last_row_is_told_as_of_single_poses) {
  assert_same_one_by_one("0.5", "space=world&as=matrix");
}
