/* A table with a place for each size, and for those that are as much larger as it has places: whoever comes
 * with another size, or other names of fields, takes the place over. Places hold fields; the bytes of many
 * are in one buffer, because hardly ever is more than one of them being sent. */
#include "reply.h"

#include <microhttpd.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

enum {
  PLACES = 256,
  BUFFERS = 4,
  SIZE_MOST = 16 << 10,
  TURNS_MAX = 10 /* of the library, to take a connection over, to read, to send */
};

/* Of PLACES / BUFFERS sizes that follow each other. */
typedef struct buffer {
  bool is_taken; /* one of its replies is being sent */
  uint8_t bytes[SIZE_MOST];
} buffer;

struct srv_reply {
  struct MHD_Response *response;
  buffer *buffer;
  size_t size, field_count;
  api_header fields[SRV_FIELDS_MAX]; /* the caller's names, and the library's copies of the values */
};

struct srv_replies {
  bool rewrites;
  srv_reply *places[PLACES];
  buffer buffers[BUFFERS];
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
  if (MHD_add_response_header(response, "Tag", "before") != MHD_YES) return false;
  if (!is_sent(daemon, client, "\r\nTag: before\r\n")) return false;
  memcpy((char *)(uintptr_t)MHD_get_response_header(response, "Tag"), "behind", strlen("behind"));
  return is_sent(daemon, client, "\r\nTag: behind\r\n");
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

/* ---- table ----------------------------------------------------------------------------------- */

srv_replies *srv_replies_create(bool rewrites) {
  srv_replies *replies = calloc(1, sizeof *replies);
  if (replies != NULL) replies->rewrites = rewrites;
  return replies;
}

static void destroy_reply(srv_reply *reply) {
  if (reply == NULL) return;
  MHD_destroy_response(reply->response);
  free(reply);
}

void srv_replies_destroy(srv_replies *replies) {
  if (replies == NULL) return;
  for (size_t i = 0; i < PLACES; i++) destroy_reply(replies->places[i]);
  free(replies);
}

static srv_reply *create_reply(buffer *buffer, size_t size, size_t field_count) {
  srv_reply *reply = calloc(1, sizeof *reply);
  if (reply == NULL) return NULL;
  *reply = (srv_reply){.buffer = buffer, .size = size, .field_count = field_count};
  reply->response = MHD_create_response_from_buffer(size, buffer->bytes, MHD_RESPMEM_PERSISTENT);
  if (reply->response != NULL) return reply;
  free(reply);
  return NULL;
}

/* Whether the reply has as many bytes, and fields of the same names in the same order. */
static bool is_like(const srv_reply *reply, const api_header *fields, size_t field_count, size_t size) {
  if (reply->size != size || reply->field_count != field_count) return false;
  for (size_t i = 0; i < field_count; i++) {
    const char *name = reply->fields[i].name, *wanted = fields[i].name;
    if (name != wanted && strcmp(name, wanted) != 0) return false;
  }
  return true;
}

/* Whether the library would take it: it refuses what ends a field, or could. */
static bool is_plain(const char *value, size_t size) {
  uint32_t control = 0;
  for (size_t i = 0; i < size; i++) control |= (unsigned char)value[i] < 0x20;
  return control == 0;
}

/* Writes over the library's copy of a value what is as long; false when it is not. */
static bool rewrite(const api_header *field, const char *value) {
  size_t size = strlen(value);
  if (strlen(field->value) != size || !is_plain(value, size)) return false;
  memcpy((char *)(uintptr_t)field->value, value, size); /* see srv_rewrites */
  return true;
}

/* Gives one of the reply's fields its first value, or another one. Two fields of one name are refused: the
 * library would not tell which of them a value is of. */
static bool set_field(srv_reply *reply, api_header *field, const api_header *wanted, bool rewrites) {
  if (field->value != NULL && strcmp(field->value, wanted->value) == 0) return true;
  if (field->value != NULL && rewrites && rewrite(field, wanted->value)) return true;
  if (field->value != NULL) {
    MHD_del_response_header(reply->response, field->name, field->value);
  } else if (MHD_get_response_header(reply->response, wanted->name) != NULL) {
    return false;
  }
  if (MHD_add_response_header(reply->response, wanted->name, wanted->value) != MHD_YES) return false;
  *field = (api_header){wanted->name, MHD_get_response_header(reply->response, wanted->name)};
  return true;
}

/* After a failure the reply is good for nothing. */
static bool fill(srv_reply *reply, const api_header *fields, api_bytes bytes, bool rewrites) {
  for (size_t i = 0; i < reply->field_count; i++) {
    if (!set_field(reply, &reply->fields[i], &fields[i], rewrites)) return false;
  }
  memcpy(reply->buffer->bytes, bytes.data, bytes.size);
  return true;
}

srv_reply *srv_replies_take(srv_replies *replies, const api_header *fields, size_t field_count,
                            api_bytes bytes) {
  if (bytes.size == 0 || bytes.size > SIZE_MOST || field_count > SRV_FIELDS_MAX) return NULL;
  size_t at = bytes.size % PLACES;
  buffer *buffer = &replies->buffers[at / (PLACES / BUFFERS)];
  if (buffer->is_taken) return NULL;
  srv_reply **place = &replies->places[at], *reply = *place;
  if (reply == NULL || !is_like(reply, fields, field_count, bytes.size)) {
    destroy_reply(reply);
    reply = *place = create_reply(buffer, bytes.size, field_count);
  }
  if (reply != NULL && fill(reply, fields, bytes, replies->rewrites)) {
    buffer->is_taken = true;
    return reply;
  }
  destroy_reply(reply);
  *place = NULL;
  return NULL;
}

struct MHD_Response *srv_reply_response(const srv_reply *reply) {
  return reply->response;
}

void srv_reply_give_back(srv_reply *reply) {
  if (reply != NULL) reply->buffer->is_taken = false;
}
