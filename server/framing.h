/* Whether a request is framed beyond doubt (RFC 9112). The HTTP library is lenient where two readers of
 * the same bytes could disagree on where a request ends; this refuses all of that. */
#ifndef SRV_FRAMING_H
#define SRV_FRAMING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
  SRV_TARGET_MAX = 8192,
  SRV_ARGUMENTS_MAX = 100, /* of the query */
  SRV_HEADERS_MAX = 100,
  /* What a head may take of the HTTP library's memory: in all, and beside its text, where each argument,
   * header and cookie takes a record and cookies are copied. */
  SRV_HEAD_MAX = 18 << 10,
  SRV_RECORDS_MAX = 10 << 10,
  SRV_RECORD_SIZE = 64
};

/* What the headers of one request say, filled by the functions below. */
typedef struct srv_framing {
  int status;         /* 0: fine so far, else the status of the refusal */
  const char *detail; /* of the refusal */
  bool http_10;
  bool many_arguments;                 /* more than the HTTP library can cut apart */
  bool has_length, chunked, continues; /* continues: the client waits for 100 */
  uint64_t length;                     /* with has_length */
  size_t headers, hosts;
  uint32_t initials;    /* a bit for each letter that a header's name begins with */
  size_t text, records; /* bytes that the head takes of the HTTP library's memory */
} srv_framing;

/* First; target: as on the wire. */
void srv_framing_target(srv_framing *framing, const char *target);

void srv_framing_version(srv_framing *framing, const char *version);

/* Once for each header, in order. */
void srv_framing_header(srv_framing *framing, const char *name, size_t name_size, const char *value,
                        size_t value_size);

/* After the last header: what only shows in their combination. */
void srv_framing_end(srv_framing *framing);

/* False when no header has this name, which most requests show by the initials of the few that they have. */
bool srv_framing_may_have(const srv_framing *framing, const char *name);

#endif
