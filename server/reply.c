/* A table with a place for each size, and for those that are as much larger as it has places: whoever comes
 * with another size, or other names of fields, takes the place over. Only fields whose value has changed are
 * made anew. */
#include "reply.h"

#include <microhttpd.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 64, SIZE_MOST = 16 << 10 };

struct srv_reply {
  struct MHD_Response *response;
  bool is_taken;
  size_t size, field_count;
  api_header fields[SRV_FIELDS_MAX]; /* the caller's names, and the library's copies of the values */
  uint8_t bytes[];
};

struct srv_replies {
  srv_reply *places[PLACES];
};

srv_replies *srv_replies_create(void) {
  return calloc(1, sizeof(srv_replies));
}

static void destroy_reply(srv_reply *reply) {
  if (reply == NULL) return;
  if (reply->response != NULL) MHD_destroy_response(reply->response);
  free(reply);
}

void srv_replies_destroy(srv_replies *replies) {
  if (replies == NULL) return;
  for (size_t i = 0; i < PLACES; i++) destroy_reply(replies->places[i]);
  free(replies);
}

static srv_reply *create_reply(size_t size, size_t field_count) {
  srv_reply *reply = calloc(1, sizeof *reply + size);
  if (reply == NULL) return NULL;
  reply->size = size;
  reply->field_count = field_count;
  reply->response = MHD_create_response_from_buffer(size, reply->bytes, MHD_RESPMEM_PERSISTENT);
  if (reply->response != NULL) return reply;
  free(reply);
  return NULL;
}

/* Whether the reply has as many bytes, and fields of the same names in the same order. */
static bool is_like(const srv_reply *reply, const api_header *fields, size_t field_count, size_t size) {
  if (reply->size != size || reply->field_count != field_count) return false;
  for (size_t i = 0; i < field_count; i++) {
    if (strcmp(reply->fields[i].name, fields[i].name) != 0) return false;
  }
  return true;
}

/* Gives one of the reply's fields its first value, or another one. Two fields of one name are refused: the
 * library would not tell which of them a value is of. */
static bool set_field(srv_reply *reply, api_header *field, const api_header *wanted) {
  if (field->value != NULL && strcmp(field->value, wanted->value) == 0) return true;
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
static bool fill(srv_reply *reply, const api_header *fields, api_bytes bytes) {
  for (size_t i = 0; i < reply->field_count; i++) {
    if (!set_field(reply, &reply->fields[i], &fields[i])) return false;
  }
  memcpy(reply->bytes, bytes.data, bytes.size);
  return true;
}

srv_reply *srv_replies_take(srv_replies *replies, const api_header *fields, size_t field_count,
                            api_bytes bytes) {
  if (bytes.size == 0 || bytes.size > SIZE_MOST || field_count > SRV_FIELDS_MAX) return NULL;
  srv_reply **place = &replies->places[bytes.size % PLACES], *reply = *place;
  if (reply != NULL && reply->is_taken) return NULL;
  if (reply == NULL || !is_like(reply, fields, field_count, bytes.size)) {
    destroy_reply(reply);
    reply = *place = create_reply(bytes.size, field_count);
  }
  if (reply != NULL && fill(reply, fields, bytes)) {
    reply->is_taken = true;
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
  if (reply != NULL) reply->is_taken = false;
}
