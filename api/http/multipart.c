/* multipart/form-data (RFC 7578) with one file in it. */
#include "header_text.h"
#include "upload.h"

#include <stdio.h>
#include <string.h>

/* The head of a part, and parts: more is no form that a browser sends. */
enum { PART_HEAD_MAX = 16384, PARTS_MAX = 4096 };

/* The place of `mark`, of two bytes at least, in bytes[from..); size when it is not there. Byte by byte: what
 * a body repeats to be slow costs no more than anything else. */
static size_t find_mark(api_bytes bytes, size_t from, const char *mark) {
  const uint8_t *data = bytes.data, first = (uint8_t)mark[0], second = (uint8_t)mark[1];
  size_t length = strlen(mark);
  for (; bytes.size - from >= length; from++)
    if (data[from] == first && data[from + 1] == second && memcmp(data + from, mark, length) == 0)
      return from;
  return bytes.size;
}

/* Whether a head says that its part is a file: Content-Disposition has a filename. */
static bool is_file(api_bytes head) {
  for (size_t at = 0; at < head.size;) {
    size_t end = find_mark(head, at, "\r\n");
    api_span line = {(const char *)head.data + at, end - at};
    at = end + 2;
    api_span name = api_span_cut(&line, ':');
    if (!api_span_is(name, "Content-Disposition")) continue;
    while (line.length > 0) {
      api_span parameter = api_span_cut(&line, ';');
      if (api_span_starts(parameter, "filename=") || api_span_starts(parameter, "filename*=")) return true;
    }
  }
  return false;
}

static tw_status fail_form(tw_error *error, const char *detail) {
  return tw_fail(error, TW_SYNTAX, "the form %s", detail);
}

tw_status api_multipart_file(api_bytes body, const char *boundary, api_bytes *out, tw_error *error) {
  char mark[80];
  size_t length = (size_t)snprintf(mark, sizeof mark, "\r\n--%.70s", boundary);
  bool found = false;
  /* The first mark may stand at the very beginning, without its line break. */
  bool at_start = body.size >= length - 2 && memcmp(body.data, mark + 2, length - 2) == 0;
  size_t at = at_start ? length - 2 : find_mark(body, 0, mark) + length;
  for (int part = 0;; part++) {
    if (at > body.size || body.size - at < 2) return fail_form(error, "does not end with its boundary");
    if (memcmp(body.data + at, "--", 2) == 0) break;
    if (part == PARTS_MAX) return fail_form(error, "has more than 4096 parts");
    size_t head_end = find_mark(body, at, "\r\n\r\n");
    if (memcmp(body.data + at, "\r\n", 2) != 0 || head_end == body.size || head_end - at > PART_HEAD_MAX)
      return fail_form(error, "has a part without a head");
    api_bytes head = {body.data + at + 2, head_end > at ? head_end - at - 2 : 0};
    size_t start = head_end + 4;
    /* A part without content: the break before its boundary is the end of its head. */
    size_t end = find_mark(body, start - 2, mark);
    if (end == body.size) return fail_form(error, "does not end with its boundary");
    if (is_file(head)) {
      if (found) return fail_form(error, "has more than one file");
      found = true;
      *out = (api_bytes){body.data + start, end > start ? end - start : 0};
    }
    at = end + length;
  }
  return found ? TW_OK : fail_form(error, "has no file: a part with a filename is expected");
}
