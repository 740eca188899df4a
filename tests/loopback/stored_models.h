/* Models that tests of /v1/models store. */
#ifndef STORED_MODELS_H
#define STORED_MODELS_H

#include "loopback.h"

#include <string.h>

static const char triangle[] = "o three\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
/* sha256 of the text above, by sha256sum. */
static const char triangle_id[] = "3cd3dec2128c83a94ef9f007c577d21f";

/* With the clip that poses and tracks are about. */
static const char turning[] =
    "{'meshes':[{'name':'tip','positions':[[0,0,0],[1,0,0],[0,1,0]],'faces':[[0,1,2]]}],"
    "'nodes':[{'name':'tip','mesh':'tip'}],'clips':[{'name':'turn','tracks':[{'node':'tip',"
    "'path':'rotation','times':[0,1],'quaternions':[[0,0,0,1],[0,1,0,0]]}]}]}";

static inline void assert_is_the_triangle(reply r) {
  if (r.status != 200 && r.status != 201) fail_msg("%d %s", r.status, r.body);
  assert_says(&r, triangle_id);
  reply_free(&r);
}

static inline reply get_with(loopback *loop, const char *path, const char *headers) {
  return loopback_ask(loop, "GET", path, headers, NULL, 0);
}

#endif
