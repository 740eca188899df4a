/* Reads any text as a request's head, split as the HTTP library splits it: a head that passes states once,
 * and unambiguously, where its body ends. */
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "framing.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

/* Terminates and returns the text up to a separator; moves *at behind it. */
static char *cut(char **at, char separator) {
  char *part = *at, *end = strchr(part, separator);
  *at = end ? end + 1 : part + strlen(part);
  if (end) *end = '\0';
  return part;
}

/* What the lines say of the body, counted independently of framing.c. */
typedef struct body_lines {
  size_t lengths, codings;
  uint64_t length;
} body_lines;

static void note(body_lines *lines, const char *name, const char *value) {
  if (strcasecmp(name, "Transfer-Encoding") == 0) lines->codings++;
  if (strcasecmp(name, "Content-Length") != 0) return;
  lines->lengths++;
  lines->length = strtoull(value, NULL, 10);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  if (size > 2 * SRV_HEAD_MAX) return 0;
  char *head = malloc(size + 1), *at = head;
  if (!head) return 0;
  memcpy(head, bytes, size);
  head[size] = '\0';

  srv_framing framing = {0};
  body_lines lines = {0};
  char *line = cut(&at, '\n'), *method = cut(&line, ' '), *target = cut(&line, ' ');
  srv_framing_target(&framing, target);
  srv_framing_line(&framing, method, cut(&line, '\r'));
  while (*at != '\0') {
    line = cut(&at, '\n');
    char *name = cut(&line, ':');
    char *value = cut(&line, '\r');
    value += strspn(value, " \t");
    note(&lines, name, value);
    srv_framing_field(&framing, name, strlen(name), value, strlen(value));
  }
  srv_framing_end(&framing, size);
  srv_framing_whole(&framing, size);

  if (framing.status == 0 &&
      (lines.lengths + lines.codings > 1 || framing.has_length != (lines.lengths == 1) ||
       framing.chunked != (lines.codings == 1) || (framing.has_length && framing.length != lines.length) ||
       framing.hosts > 1 || framing.fields > SRV_FIELDS_MAX))
    abort();
  if (framing.status != 0 && (framing.status < 400 || framing.status > 599 || !framing.detail)) abort();
  free(head);
  return 0;
}
