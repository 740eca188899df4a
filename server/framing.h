/* Whether a request is framed beyond doubt (RFC 9112). The HTTP library is lenient where two readers of
 * the same bytes could disagree on where a request ends; this refuses all of that. */
#ifndef SRV_FRAMING_H
#define SRV_FRAMING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
  SRV_TARGET_MAX = 8192,
  SRV_QUERY_ARGUMENTS_MAX = 200,
  SRV_HEADERS_MAX = 100,
  SRV_HEADER_BYTES_MAX = 16384
};

/* What the headers of one request say, filled by the functions below. */
typedef struct srv_framing {
  int status;         /* 0: fine so far, else the status of the refusal */
  const char *detail; /* of the refusal */
  bool http_10;
  bool many_arguments;                 /* more than the HTTP library can cut apart */
  bool has_length, chunked, continues; /* continues: the client waits for 100 */
  uint64_t length;                     /* with has_length */
  size_t headers, header_bytes, hosts;
} srv_framing;

/* First; target: as on the wire. */
void srv_framing_target(srv_framing *framing, const char *target);

void srv_framing_version(srv_framing *framing, const char *version);

/* Once for each header, in order. */
void srv_framing_header(srv_framing *framing, const char *name, size_t name_size, const char *value,
                        size_t value_size);

/* After the last header: what only shows in their combination. */
void srv_framing_end(srv_framing *framing);

#endif
