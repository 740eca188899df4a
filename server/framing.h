/* Checks that a request's head is framed unambiguously (RFC 9112). The HTTP library is lenient where two
 * readers of the same bytes could disagree on where a request ends; these functions refuse such heads. */
#ifndef SRV_FRAMING_H
#define SRV_FRAMING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Documented limits. A head within all of them fits into the library's memory for a connection. */
enum {
  SRV_TARGET_MAX = 8 << 10,
  SRV_ARGUMENTS_MAX = 32, /* in the query */
  SRV_FIELDS_MAX = 64,    /* each cookie counts as one more field */
  SRV_COOKIES_MAX = 4 << 10,
  SRV_HEAD_MAX = 16 << 10 /* the whole head */
};

/* The state of the check, filled by the functions below. A zeroed one is the start. */
typedef struct srv_framing {
  int status;         /* 0: accepted so far, else the status of the refusal */
  const char *detail; /* of the refusal */
  bool http_10;
  bool many_arguments;                 /* more than the library can split */
  bool has_length, chunked, continues; /* continues: the client waits for 100 Continue */
  uint64_t length;                     /* with has_length */
  size_t fields, hosts, cookie_bytes;
  size_t seen; /* bytes of the head that have been passed so far */
} srv_framing;

/* Whether the target has the absolute form, as "http://HOST/PATH". */
bool srv_framing_is_absolute(const char *target);

/* Call first. target: as on the wire. */
void srv_framing_target(srv_framing *framing, const char *target);

/* The rest of the request line. */
void srv_framing_line(srv_framing *framing, const char *method, const char *version);

/* Call for each field, in order. `seen` counts the bytes from name to the value's end, so both must point
 * into the head as received, the value after the name. */
void srv_framing_field(srv_framing *framing, const char *name, size_t name_size, const char *value,
                       size_t value_size);

/* Call after the last field: checks how the fields combine. head_size: bytes from the method through the
 * empty line. */
void srv_framing_end(srv_framing *framing, size_t head_size);

/* Call last: refuses a head of which not every byte was passed. That finds a zero byte, at which the library
 * cuts the line off, and a folded field, whose further lines the library adds to the name. */
void srv_framing_whole(srv_framing *framing, size_t head_size);

#endif
