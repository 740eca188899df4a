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

/* A page's plain bytes. False without memory. */
static bool decode_page(const api_page *page, tw_text *out) {
  enum { PAGE_MOST = 16 << 20 };
  uint8_t *bytes;
  size_t size;
  if (api_decode(API_CODING_GZIP, page->gzip, PAGE_MOST, &bytes, &size, NULL) != TW_OK) return false;
  *out = (tw_text){.data = (char *)bytes, .size = size, .capacity = size};
  return true;
}

/* Sends a page as it is stored to every client that takes one of these codings, even if it prefers another,
 * which would have to be computed; else decoded, for api_encode. */
static api_outcome reply_page(api_call *call, const api_page *page) {
  if (page->gzip.size == 0)
    return api_fail_with(call, 404, "this daemon has no page here: it was built without npm");
  api_coding stored = api_coding_stored(api_call_header(call, "Accept-Encoding"), page->brotli.size > 0);
  if (stored != API_CODING_NONE) call->coding = stored;
  call->is_page = true;
  if (page->policy) api_answer_header(&call->answer, "Content-Security-Policy", page->policy);
  api_outcome outcome = api_validate_file(call, page->hash);
  if (outcome != API_CONTINUE) return outcome;
  tw_text text = {0};
  if (stored == API_CODING_NONE) {
    if (!decode_page(page, &text)) return api_fail_without_memory(call);
  } else {
    bool is_brotli = stored == API_CODING_BROTLI;
    api_bytes bytes = is_brotli ? page->brotli : page->gzip;
    tw_text_bytes(&text, (const char *)bytes.data, bytes.size);
    api_answer_header(&call->answer, "Content-Encoding", is_brotli ? "br" : "gzip");
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
