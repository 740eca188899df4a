/* What handlers share: faults, plain replies, and the validators of immutable answers. */
#include "call.h"

#include "routes.h"

#include <nettle/sha2.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

api_outcome api_fail(api_call *call) {
  call->fault.status = api_status_of(call->fault.error.status);
  if (call->fault.status == 503) call->fault.retry_after_s = 1;
  return API_FAILED;
}

api_outcome api_fail_in_document(api_call *call) {
  /* An OBJ error bears a line; every other document is JSON or holds one. */
  call->fault.in_document = call->fault.error.line == 0 && call->fault.error.status != TW_NO_MEMORY;
  return api_fail(call);
}

api_outcome api_fail_with(api_call *call, int status, const char *format, ...) {
  char detail[sizeof call->fault.error.detail];
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(detail, sizeof detail, format, arguments);
  va_end(arguments);
  tw_fail(&call->fault.error, TW_SYNTAX, "%s", detail);
  call->fault.status = status;
  return API_FAILED;
}

api_outcome api_fail_without_memory(api_call *call) {
  tw_fail(&call->fault.error, TW_NO_MEMORY, "out of memory");
  return api_fail(call);
}

const char *api_call_header(const api_call *call, const char *name) {
  return call->request->header(call->request->context, name);
}

api_outcome api_reply(api_call *call, api_text *text) {
  api_answer_text(&call->answer, 200, call->offer->type, text);
  return API_DONE;
}

const char *api_etag(api_call *call, const char *id, const char *representation, const char *canonical) {
  struct sha256_ctx hash;
  uint8_t digest[8];
  sha256_init(&hash);
  sha256_update(&hash, strlen(representation) + 1, (const uint8_t *)representation);
  sha256_update(&hash, strlen(canonical) + 1, (const uint8_t *)canonical);
  /* Another version may print or compute the same answer in other bytes. */
  sha256_update(&hash, strlen(tw_version()), (const uint8_t *)tw_version());
  sha256_digest(&hash, sizeof digest, digest);
  char tag[64];
  int length = snprintf(tag, sizeof tag, "\"%s-", id);
  for (size_t i = 0; i < sizeof digest; i++)
    length += snprintf(tag + length, sizeof tag - (size_t)length, "%02x", digest[i]);
  tag[length++] = '"';
  return tw_arena_text(call->arena, tag, (size_t)length);
}

api_outcome api_validate(api_call *call, const char *canonical) {
  char representation[96];
  snprintf(representation, sizeof representation, "%s.%s", call->route->path, call->offer->extension);
  const char *etag = api_etag(call, call->id, representation, canonical);
  if (!etag) return api_fail_without_memory(call);
  const char *if_match = api_call_header(call, "If-Match");
  if (if_match && !api_etag_matches(if_match, etag, false))
    return api_fail_with(call, 412, "If-Match names another representation than %s", etag);
  api_answer_header(&call->answer, "ETag", etag);
  api_answer_header(&call->answer, "Cache-Control", "public, max-age=31536000, immutable");
  const char *if_none_match = api_call_header(call, "If-None-Match");
  if (!if_none_match || !api_etag_matches(if_none_match, etag, true)) return API_LATER;
  call->answer.status = 304;
  return API_DONE;
}
