/* Any text as a request to a service that stores one model: a line with the target, path and query, in which
 * "{id}" stands for the model; lines behind it are the body of a POST. It is answered, and the answer can be
 * read. Models, surfaces and poses in all their parameters. */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

static const char model[] =
    "{\"meshes\":[{\"name\":\"m\",\"positions\":[[0,0,0],[1,0,0],[1,1,0],[0,1,0],[2,0,1]],"
    "\"faces\":[[0,1,2,3],[1,4,2]],\"creases\":[{\"edge\":[1,2],\"sharpness\":1.5}],\"holes\":[1]}],"
    "\"nodes\":[{\"name\":\"a\",\"mesh\":\"m\"},{\"name\":\"b\",\"parent\":\"a\"}],"
    "\"clips\":[{\"name\":\"c\",\"tracks\":[{\"node\":\"a\",\"path\":\"rotation\",\"times\":[0,1],"
    "\"quaternions\":[[0,0,0,1],[0,0,1,0]]},{\"node\":\"b\",\"path\":\"translation\",\"times\":[0],"
    "\"values\":[[1,2,3]]}]}]}";

static loopback *start(char id[API_ID_TEXT]) {
  api_settings settings = loopback_settings();
  settings.limits.max_upload = 1 << 16;
  settings.limits.max_level = 3;
  settings.limits.max_faces = 10000;
  settings.limits.max_output = 1 << 20;
  settings.limits.max_times = 1000;
  loopback *loop = loopback_start(&settings);
  loopback_upload(loop, "application/json", model, id);
  return loop;
}

static void read_first_frames(const api_live *live) {
  for (uint64_t i = 0; live->frame && i < 3; i++) {
    api_bytes frame = {0};
    char stamp[API_LIVE_STAMP];
    if (live->frame(live->context, live->first + i, &frame)) free((void *)frame.data);
    live->stamp(i, stamp);
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  enum { LINE_MAX = 1000 };
  static loopback *loop;
  static char id[API_ID_TEXT];
  if (!loop) loop = start(id);
  const uint8_t *body = memchr(bytes, '\n', size);
  size_t length = body ? (size_t)(body++ - bytes) : size;
  if (length > LINE_MAX || memchr(bytes, '\0', length)) return 0;
  char line[LINE_MAX + 1] = "", target[LINE_MAX + API_ID_TEXT];
  memcpy(line, bytes, length);
  const char *mark = strstr(line, "{id}");
  if (mark)
    snprintf(target, sizeof target, "%.*s%s%s", (int)(mark - line), line, id, mark + strlen("{id}"));
  else
    strcpy(target, line);
  reply r =
      loopback_ask(loop, body ? "POST" : "GET", target, body ? "Content-Type: application/json\n" : NULL,
                   body, body ? size - length - 1 : 0);
  if (r.status < 200 || r.status > 599) abort();
  read_first_frames(&r.answer.live);
  reply_free(&r);
  if (body) { /* else the store would grow */
    loopback_stop(loop);
    loop = NULL;
  }
  return 0;
}
