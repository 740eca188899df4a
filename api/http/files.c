/* The API description, the module for web clients with its types, its viewer, and the pages. A file changes
 * with the daemon's version, so clients revalidate it each time. */
#include "files.h"

#include "codings.h"
#include "handlers.h"
#include "service.h"
#include "upload.h"

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

/* Whether to send a page as stored, compressed by gzip: to every client that takes gzip, even if it prefers
 * another coding, which would have to be computed. */
static bool sends_stored(const api_call *call) {
  return call->coding != API_CODING_NONE &&
         api_coding_allowed(api_call_header(call, "Accept-Encoding"), "gzip");
}

/* A page's bytes: as stored, or decoded for api_encode. False without memory. */
static bool copy_page(const api_page *page, bool is_stored, tw_text *out) {
  enum { PAGE_MOST = 16 << 20 };
  uint8_t *bytes;
  size_t size;
  if (is_stored) {
    tw_text_bytes(out, (const char *)page->gzip.data, page->gzip.size);
    return true;
  }
  if (api_decode(API_CODING_GZIP, page->gzip, PAGE_MOST, &bytes, &size, NULL) != TW_OK) return false;
  *out = (tw_text){.data = (char *)bytes, .size = size, .capacity = size};
  return true;
}

static api_outcome reply_page(api_call *call, const api_page *page) {
  if (page->gzip.size == 0)
    return api_fail_with(call, 404, "this daemon has no page here: it was built without npm");
  bool is_stored = sends_stored(call);
  if (is_stored) call->coding = API_CODING_GZIP;
  if (page->policy) api_answer_header(&call->answer, "Content-Security-Policy", page->policy);
  api_outcome outcome = api_validate_file(call, page->hash);
  if (outcome != API_CONTINUE) return outcome;
  tw_text text = {0};
  if (!copy_page(page, is_stored, &text)) return api_fail_without_memory(call);
  if (is_stored) {
    api_answer_header(&call->answer, "Content-Encoding", "gzip");
    call->coding = API_CODING_NONE; /* encoded already */
  }
  return api_reply(call, &text);
}

api_outcome api_get_page(api_call *call) {
  return reply_page(call, &call->service->page);
}

api_outcome api_get_docs(api_call *call) {
  return reply_page(call, &call->service->docs);
}

api_outcome api_get_example(api_call *call) {
  return reply_page(call, &call->service->example);
}

api_outcome api_get_viewer(api_call *call) {
  return reply_page(call, &call->service->viewer);
}
