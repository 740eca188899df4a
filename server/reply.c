/* A table with a place for each size, and for those that are as much larger as it has places: whoever comes
 * with another size, of the bytes or of the fields, takes the place over. The library knows one field only,
 * the first; in its value the others follow, written over what the library was given, which takes a line's
 * end from nobody: so it copies them in one piece. The bytes of a table are in one buffer, which stays in the
 * processor's cache; hardly ever is more than one of them being sent, and then the next table serves. */
#include "reply.h"

#include "field_block.h"

#include <microhttpd.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum {
  PLACES = 256,
  TABLES = 4,
  SIZE_MOST = 16 << 10,
  TURNS_MAX = 10 /* of the library, to take a connection over, to read, to send */
};

typedef struct table table;

struct srv_reply {
  struct MHD_Response *response; /* NULL: a free place */
  table *table;
  char *fields; /* the library's copy of the first one's value, and the others behind it */
  size_t size, fields_size;
};

struct table {
  bool is_taken; /* one of its replies is being sent */
  srv_reply places[PLACES];
  _Alignas(max_align_t) uint8_t bytes[SIZE_MOST];
};

struct srv_replies {
  bool rewrites;
  srv_field_block block; /* of the last answer */
  table tables[TABLES];
};

/* ---- what the library sends ------------------------------------------------------------------ */

static enum MHD_Result answer(void *context, struct MHD_Connection *connection, const char *url,
                              const char *method, const char *version, const char *data, size_t *size,
                              void **request) {
  (void)url;
  (void)method;
  (void)version;
  (void)data;
  (void)size;
  bool is_whole = *request != NULL; /* an answer to headers alone would close the connection */
  *request = context;
  return is_whole ? MHD_queue_response(connection, MHD_HTTP_OK, context) : MHD_YES;
}

/* Whether the next answer bears the field. */
static bool is_sent(struct MHD_Daemon *daemon, int client, const char *field) {
  static const char REQUEST[] = "GET / HTTP/1.1\r\nHost: x\r\n\r\n";
  char text[1024] = "";
  ssize_t got = send(client, REQUEST, sizeof REQUEST - 1, MSG_NOSIGNAL) > 0 ? -1 : 0;
  for (int i = 0; i < TURNS_MAX && got < 0; i++) {
    MHD_run(daemon);
    got = recv(client, text, sizeof text - 1, 0);
  }
  return strstr(text, field) != NULL;
}

static bool sends_what_is_written(struct MHD_Daemon *daemon, int client, struct MHD_Response *response) {
  static const char BEFORE[] = "one is there", BEHIND[] = "1\r\nTwo: is 2";
  if (MHD_add_response_header(response, "Tag", BEFORE) != MHD_YES) return false;
  if (!is_sent(daemon, client, "\r\nTag: one is there\r\n")) return false;
  _Static_assert(sizeof BEFORE == sizeof BEHIND, "takes its place");
  memcpy((char *)(uintptr_t)MHD_get_response_header(response, "Tag"), BEHIND, sizeof BEHIND - 1);
  return is_sent(daemon, client, "\r\nTag: 1\r\nTwo: is 2\r\n");
}

/* Asks it, over a pair of sockets: it sends one response twice, and in between a value is written over. */
bool srv_rewrites(void) {
  int pair[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) != 0) return false;
  static char body[] = "x";
  struct MHD_Response *response = MHD_create_response_from_buffer(1, body, MHD_RESPMEM_PERSISTENT);
  struct MHD_Daemon *daemon =
      MHD_start_daemon(MHD_USE_EPOLL | MHD_USE_NO_LISTEN_SOCKET, 0, NULL, NULL, answer, response,
                       MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1, MHD_OPTION_END);
  const struct sockaddr peer = {.sa_family = AF_UNIX};
  bool is_ready = response != NULL && daemon != NULL;
  bool is_taken = is_ready && MHD_add_connection(daemon, pair[1], &peer, sizeof peer) == MHD_YES;
  bool rewrites = is_taken && sends_what_is_written(daemon, pair[0], response);
  if (daemon != NULL) MHD_stop_daemon(daemon);
  if (response != NULL) MHD_destroy_response(response);
  if (!is_ready) close(pair[1]); /* else the library has */
  close(pair[0]);
  return rewrites;
}

/* ---- tables ---------------------------------------------------------------------------------- */

srv_replies *srv_replies_create(bool rewrites) {
  srv_replies *replies = calloc(1, sizeof *replies);
  if (replies != NULL) replies->rewrites = rewrites;
  return replies;
}

/* Leaves a free place. */
static void clear_place(srv_reply *place) {
  if (place->response != NULL) MHD_destroy_response(place->response);
  *place = (srv_reply){0};
}

void srv_replies_destroy(srv_replies *replies) {
  if (replies == NULL) return;
  for (size_t i = 0; i < TABLES; i++)
    for (size_t k = 0; k < PLACES; k++) clear_place(&replies->tables[i].places[k]);
  free(replies);
}

/* Makes a place's reply for so many bytes of a body, and for fields as long as these. */
static bool fill_place(srv_reply *place, table *owner, const char *name, size_t size, size_t fields_size) {
  clear_place(place);
  char filler[SRV_FIELDS_SIZE_MAX + 1];
  memset(filler, '-', fields_size);
  filler[fields_size] = '\0';
  struct MHD_Response *response = MHD_create_response_from_buffer(size, owner->bytes, MHD_RESPMEM_PERSISTENT);
  if (response == NULL) return false;
  if (MHD_add_response_header(response, name, filler) != MHD_YES) {
    MHD_destroy_response(response);
    return false;
  }
  char *fields = (char *)(uintptr_t)MHD_get_response_header(response, name); /* see srv_rewrites */
  *place = (srv_reply){response, owner, fields, size, fields_size};
  return true;
}

static table *find_table(srv_replies *replies) {
  for (size_t i = 0; replies->rewrites && i < TABLES; i++)
    if (!replies->tables[i].is_taken) return &replies->tables[i];
  return NULL;
}

api_room srv_replies_room(srv_replies *replies) {
  table *table = find_table(replies);
  return table != NULL ? (api_room){table->bytes, sizeof table->bytes} : (api_room){0};
}

/* Has what is needed of a reply fetched into the processor's cache, where little of so many stays. */
static void fetch(const srv_reply *place) {
  __builtin_prefetch(place->response);
  __builtin_prefetch(place->fields, 1);
}

srv_reply *srv_replies_take(srv_replies *replies, const api_header *fields, size_t field_count,
                            api_bytes bytes) {
  table *table = find_table(replies);
  if (table == NULL || bytes.size == 0 || bytes.size > SIZE_MOST) return NULL;
  srv_reply *place = &table->places[bytes.size % PLACES];
  fetch(place);
  srv_field_block *block = &replies->block;
  if (!srv_field_block_set(block, fields, field_count)) return NULL;
  bool is_like = place->size == bytes.size && place->fields_size == block->size;
  if (!is_like && !fill_place(place, table, fields[0].name, bytes.size, block->size)) return NULL;
  memcpy(place->fields, block->text, block->size);
  if (bytes.data != table->bytes) memcpy(table->bytes, bytes.data, bytes.size);
  table->is_taken = true;
  return place;
}

struct MHD_Response *srv_reply_response(const srv_reply *reply) {
  return reply->response;
}

void srv_reply_give_back(srv_reply *reply) {
  if (reply != NULL) reply->table->is_taken = false;
}
