/* Sends any text, an HTTP head and a body, as a request to a service that stores one model; "{id}" stands for
 * the model's id. It must be answered, in time that what is sent and answered explains, and the answer must
 * be readable. Covers models, surfaces and poses with all their parameters and header fields. */
#include "loopback.h"
#include "spent.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

enum { LINE_MAX = 1000, FIELDS_MAX = 3000 };

static const char model[] =
    "{\"meshes\":[{\"name\":\"m\",\"positions\":[[0,0,0],[1,0,0],[1,1,0],[0,1,0],[2,0,1]],"
    "\"faces\":[[0,1,2,3],[1,4,2]],\"creases\":[{\"edge\":[1,2],\"sharpness\":1.5}],\"holes\":[1]},"
    "{\"name\":\"refined\",\"shape\":{\"kind\":\"grid\",\"segments\":[4,2]}}],"
    "\"nodes\":[{\"name\":\"a\",\"mesh\":\"m\"},{\"name\":\"b\",\"parent\":\"a\"}],"
    "\"clips\":[{\"name\":\"c\",\"tracks\":[{\"node\":\"a\",\"path\":\"rotation\",\"times\":[0,1],"
    "\"quaternions\":[[0,0,0,1],[0,0,1,0]]},{\"node\":\"b\",\"path\":\"translation\",\"times\":[0],"
    "\"values\":[[1,2,3]]}]},"
    "{\"name\":\"x\",\"layers\":[{\"clip\":\"c\",\"weight\":{\"times\":[0,1],\"values\":[1,0]}},"
    "{\"clip\":\"c\",\"mode\":\"additive\",\"loop\":\"repeat\",\"speed\":3}]}]}";

static loopback *start(char id[API_ID_TEXT]) {
  api_settings settings = loopback_settings();
  settings.limits.max_upload = 1 << 16;
  settings.limits.max_level = 3;
  settings.limits.max_faces = 10000;
  settings.limits.max_output = 1 << 20;
  settings.limits.max_times = 1000;
  settings.limits.max_memory = 96 << 20; /* edits do work in proportion to it */
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

/* Terminates and returns the line at *at; moves *at behind it. */
static char *take_line(char **at) {
  char *line = *at;
  size_t length = strcspn(line, "\n");
  *at = line + length + (line[length] == '\n');
  line[length] = '\0';
  if (length > 0 && line[length - 1] == '\r') line[length - 1] = '\0';
  return line;
}

/* Splits "METHOD TARGET HTTP/1.1": leaves the method in `line`, copies the target with "{id}" replaced. NULL
 * when there is no target. */
static char *cut_target(char *line, const char *id, char target[LINE_MAX + API_ID_TEXT]) {
  char *from = strchr(line, ' ');
  if (!from || strlen(from) > LINE_MAX) return NULL;
  *from++ = '\0';
  from[strcspn(from, " ")] = '\0';
  const char *mark = strstr(from, "{id}");
  if (mark)
    snprintf(target, LINE_MAX + API_ID_TEXT, "%.*s%s%s", (int)(mark - from), from, id, mark + strlen("{id}"));
  else
    strcpy(target, from);
  return target;
}

/* Reads the fields up to an empty line, in the form of loopback_ask. Skips Content-Length and transfer
 * codings, which the server checks. */
static void take_fields(char **at, char fields[FIELDS_MAX]) {
  size_t length = 0;
  for (int count = 0; **at; count++) {
    const char *line = take_line(at), *colon = strstr(line, ": ");
    if (!*line) return;
    bool fits = colon && colon != line && count < 12 && length + strlen(line) + 2 < FIELDS_MAX;
    if (!fits || strncasecmp(line, "Content-Length", 14) == 0 || strncasecmp(line, "Transfer-", 9) == 0)
      continue;
    length += (size_t)sprintf(fields + length, "%s\n", line);
  }
}

/* Sends the text, which is overwritten, and reads the answer. Returns the bytes of both. */
static uint64_t ask(loopback *loop, const char *id, char *text, size_t size) {
  char *at = text, target[LINE_MAX + API_ID_TEXT], fields[FIELDS_MAX] = "";
  char *method = take_line(&at);
  if (!cut_target(method, id, target)) return size;
  take_fields(&at, fields);
  size_t head = (size_t)(at - text);
  reply r = loopback_ask(loop, method, target, fields, size > head ? at : NULL, size - head);
  if (r.status < 200 || r.status > 599) abort();
  read_first_frames(&r.answer.live);
  uint64_t bytes = size + r.size;
  reply_free(&r);
  return bytes;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  enum { ATTEMPTS = 3 }; /* the time of one may be that of a busy machine */
  static loopback *loop;
  static char id[API_ID_TEXT];
  char *text = malloc(size + 1);
  for (int attempt = 1; text; attempt++) {
    if (!loop) loop = start(id);
    memcpy(text, bytes, size);
    text[size] = '\0';
    double began = spent_now();
    uint64_t both = ask(loop, id, text, size);
    double spent = spent_now() - began;
    bool is_slow = spent_too_much(spent, both);
    if (is_slow && attempt == ATTEMPTS) spent_give_up(spent, both);
    /* Start again when the model was deleted, the store has grown, or what was computed is in the cache. */
    if (is_slow || loopback_store_count(loop) != 1) {
      loopback_stop(loop);
      loop = NULL;
    }
    if (!is_slow) break;
  }
  free(text);
  return 0;
}
