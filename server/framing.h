/* Whether a request's head is framed beyond doubt (RFC 9112). The HTTP library is lenient where two readers
 * of the same bytes could disagree on where a request ends; this refuses all of that. */
#ifndef SRV_FRAMING_H
#define SRV_FRAMING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Public limits. A head that keeps them all fits into the library's memory for a connection. */
enum {
  SRV_TARGET_MAX = 8 << 10,
  SRV_ARGUMENTS_MAX = 32, /* of the query */
  SRV_FIELDS_MAX = 64,    /* each cookie counts as one more */
  SRV_COOKIES_MAX = 4 << 10,
  SRV_HEAD_MAX = 16 << 10 /* in all */
};

/* What a head says, filled by the functions below. A zeroed one is empty. */
typedef struct srv_framing {
  int status;         /* 0: fine so far, else the status of the refusal */
  const char *detail; /* of the refusal */
  bool http_10;
  bool many_arguments;                 /* more than the library can cut apart */
  bool has_length, chunked, continues; /* continues: the client waits for 100 */
  uint64_t length;                     /* with has_length */
  size_t fields, hosts, cookie_bytes;
  size_t seen; /* bytes of the head that the calls have shown */
} srv_framing;

/* First; target: as on the wire. */
void srv_framing_target(srv_framing *framing, const char *target);

/* The rest of the request line. */
void srv_framing_line(srv_framing *framing, const char *method, const char *version);

/* Once for each field, in order. For `seen`, name and value lie in the head as it came, the value behind the
 * name. */
void srv_framing_field(srv_framing *framing, const char *name, size_t name_size, const char *value,
                       size_t value_size);

/* After the last field: what only shows in their combination. head_size: bytes from the method to the empty
 * line, with both. */
void srv_framing_end(srv_framing *framing, size_t head_size);

/* After the end: refuses a head of which the calls have not shown every byte. So a zero byte is found, behind
 * which the library cuts off a line, and a folded field, whose further lines it adds to the name. */
void srv_framing_whole(srv_framing *framing, size_t head_size);

#endif
