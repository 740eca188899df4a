/* The description of the interface, and the module that web clients load. A file changes with the daemon, so
 * that clients ask each time whether theirs is the present one. */
#include "files.h"

#include "handlers.h"

static api_outcome reply_file(api_call *call, const api_file *file) {
  api_outcome outcome = api_validate_file(call, file->hash);
  if (outcome != API_CONTINUE) return outcome;
  tw_text text = {0};
  tw_text_bytes(&text, (const char *)file->bytes, file->size);
  return api_reply(call, &text);
}

api_outcome api_get_openapi(api_call *call) {
  return reply_file(call, &api_openapi);
}

api_outcome api_get_client(api_call *call) {
  return reply_file(call, &api_client);
}

api_outcome api_get_client_types(api_call *call) {
  return reply_file(call, &api_client_types);
}
