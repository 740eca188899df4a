/* What handlers share: faults, plain replies, validators of immutable answers, and ranges. */
#include "call.h"

#include "service.h"

#include <nettle/sha2.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

api_outcome api_fail(api_call *call) {
  api_fault_complete(&call->fault);
  return API_FAILED;
}

api_outcome api_fail_in_document(api_call *call) {
  /* OBJ errors have a line; every other document is JSON or contains JSON. */
  call->fault.in_document = call->fault.error.line == 0 && call->fault.error.status != TW_NO_MEMORY;
  return api_fail(call);
}

api_outcome api_outcome_of(api_call *call, tw_status status) {
  return status == TW_OK ? API_DONE : api_fail(call);
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
  api_fault_without_memory(&call->fault);
  return API_FAILED;
}

static api_outcome build_own(api_call *call, api_build build, void *context, api_entry **out) {
  api_built built;
  if (!build(context, &built, &call->fault)) return API_FAILED;
  *out = api_cache_own(call->service->cache, &built);
  return *out ? API_DONE : api_fail_without_memory(call);
}

api_outcome api_call_take(api_call *call, const char *key, api_build build, void *context, api_entry **out) {
  if (!key) return build_own(call, build, context, out);
  *out = api_cache_take(call->service->cache, key, call->request->ticket, call->effort, build, context,
                        &call->fault);
  return *out ? API_DONE : API_FAILED;
}

bool api_grant(api_call *call, uint64_t bytes) {
  api_ticket *ticket = call->request->ticket;
  tw_meter *meter = tw_meter_current();
  int64_t held = meter ? atomic_load(&meter->held) : 0;
  bytes += tw_arena_size(call->arena);
  if (bytes < ticket->needed) bytes = ticket->needed;
  if (held > 0 && bytes < (uint64_t)held) bytes = (uint64_t)held;
  if (bytes > call->service->limits.max_memory) bytes = call->service->limits.max_memory;
  bool is_granted = api_budget_grant(call->service->budget, ticket, bytes);
  if (meter) atomic_store(&meter->limit, ticket->granted + API_UNGRANTED);
  if (is_granted) return true;
  call->fault = (api_fault){.stall = API_STALL_MEMORY, .needed = bytes};
  return false;
}

const char *api_call_header(const api_call *call, const char *name) {
  return call->request->header(call->request->context, name);
}

/* ---- warnings -------------------------------------------------------------------------------- */

enum { WARNING_SIZE = 388 }; /* 400 together with the count in front */

/* Percent-encodes (RFC 3986) as many whole characters as fit; cut text ends in U+2026. text: UTF-8. NULL
 * without memory. */
static const char *encode_warning(tw_arena *arena, const char *text) {
  static const char ellipsis[] = "%E2%80%A6";
  char out[WARNING_SIZE];
  size_t size = 0, left = strlen(text), length;
  for (; (length = tw_utf8_length(text, left)) > 0; text += length, left -= length) {
    char c = *text;
    bool is_plain = api_is_unreserved(c);
    size_t more = is_plain ? 1 : 3 * length;
    if (size + more + sizeof ellipsis > sizeof out) {
      memcpy(out + size, ellipsis, sizeof ellipsis - 1);
      size += sizeof ellipsis - 1;
      break;
    }
    if (is_plain)
      out[size++] = c;
    else
      for (size_t i = 0; i < length; i++)
        size += (size_t)snprintf(out + size, 4, "%%%02X", (unsigned)(unsigned char)text[i]);
  }
  return tw_arena_text(arena, out, size);
}

void api_call_warn(api_call *call, const char *const *sentences, uint32_t count) {
  if (call->warning_count == 0 && count > 0) call->first_warning = encode_warning(call->arena, sentences[0]);
  call->warning_count += count;
}

api_outcome api_call_warn_text(api_call *call, tw_text *text) {
  const char *sentence = api_text_move(text, call->arena);
  if (!sentence) return api_fail_without_memory(call);
  api_call_warn(call, &sentence, 1);
  return API_DONE;
}

api_outcome api_call_warn_count(api_call *call, uint64_t count, const char *one, const char *many) {
  tw_text text = {0};
  if (count == 0) return API_DONE;
  tw_text_count(&text, count);
  tw_text_add(&text, tw_plural(count, one, many));
  return api_call_warn_text(call, &text);
}

/* ---- plain replies --------------------------------------------------------------------------- */

api_outcome api_reply(api_call *call, tw_text *text) {
  api_answer_text(&call->answer, 200, call->offer->type, text);
  return API_DONE;
}

void api_hex(const uint8_t *bytes, size_t count, char *out) {
  static const char digits[] = "0123456789abcdef";
  for (size_t i = 0; i < count; i++) {
    *out++ = digits[bytes[i] >> 4];
    *out++ = digits[bytes[i] & 15];
  }
}

/* ---- validators ------------------------------------------------------------------------------ */

/* The tag depends on the coding: coded bytes differ. */
static const char *coded_etag(api_call *call, const char *id, const char *representation, api_coding coding,
                              const char *canonical) {
  enum { DIGEST = 8, HEX = 2 * DIGEST };
  static const char *const suffixes[] = {[API_CODING_NONE] = "",
                                         [API_CODING_GZIP] = "+gzip",
                                         [API_CODING_ZSTD] = "+zstd",
                                         [API_CODING_BROTLI] = "+br"};
  struct sha256_ctx hash;
  uint8_t digest[DIGEST];
  sha256_init(&hash);
  sha256_update(&hash, strlen(representation), (const uint8_t *)representation);
  sha256_update(&hash, strlen(suffixes[coding]) + 1, (const uint8_t *)suffixes[coding]);
  sha256_update(&hash, strlen(canonical) + 1, (const uint8_t *)canonical);
  /* Another version may produce other bytes for the same request. */
  sha256_update(&hash, strlen(tw_version()), (const uint8_t *)tw_version());
  sha256_digest(&hash, sizeof digest, digest);
  char *tag = tw_arena_alloc_raw(call->arena, strlen(id) + HEX + sizeof "\"-\"", 1), *end = tag;
  if (!tag) return NULL;
  *end++ = '"';
  end = stpcpy(end, id);
  *end++ = '-';
  api_hex(digest, DIGEST, end);
  strcpy(end + HEX, "\"");
  return tag;
}

const char *api_etag(api_call *call, const char *id, const char *representation, const char *canonical) {
  return coded_etag(call, id, representation, API_CODING_NONE, canonical);
}

/* Whether the list of an If-None-Match or If-Match header contains the tag, or is "*". weak: ignore W/ before
 * a listed tag. */
static bool etag_matches(const char *list, const char *etag, bool weak) {
  size_t length = strlen(etag);
  list += strspn(list, " \t");
  if (*list == '*') return true;
  while (*list) {
    list += strspn(list, ", \t");
    bool is_weak = strncmp(list, "W/", 2) == 0;
    if (is_weak) list += 2;
    if (*list != '"') return false;
    size_t tag = strcspn(list + 1, "\"") + 2;
    if (tag == length && memcmp(list, etag, length) == 0 && (weak || !is_weak)) return true;
    if (list[tag - 1] != '"') return false;
    list += tag;
  }
  return false;
}

api_outcome api_check_conditions(api_call *call, const char *representation, const char *canonical) {
  const char *if_match = api_call_header(call, "If-Match"),
             *if_none_match = api_call_header(call, "If-None-Match");
  bool is_match = !if_match;
  for (api_coding coding = API_CODING_NONE; coding <= API_CODING_ZSTD; coding++) {
    const char *etag = coded_etag(call, call->id, representation, coding, canonical);
    if (!etag) return api_fail_without_memory(call);
    is_match = is_match || etag_matches(if_match, etag, false);
    if (if_none_match && etag_matches(if_none_match, etag, true))
      return api_fail_with(call, 412, "If-None-Match names a representation that this URL has: %s", etag);
  }
  return is_match ? API_CONTINUE
                  : api_fail_with(call, 412, "If-Match names no representation that this URL has");
}

static api_outcome validate(api_call *call, const char *representation, const char *canonical,
                            const char *cache_control) {
  const char *etag = coded_etag(call, call->id, representation, call->coding, canonical);
  if (!etag) return api_fail_without_memory(call);
  const char *if_match = api_call_header(call, "If-Match");
  if (if_match && !etag_matches(if_match, etag, false))
    return api_fail_with(call, 412, "If-Match names another representation than %s", etag);
  api_answer_header(&call->answer, "ETag", etag);
  api_answer_header(&call->answer, "Cache-Control", cache_control);
  const char *if_none_match = api_call_header(call, "If-None-Match");
  if (!if_none_match || !etag_matches(if_none_match, etag, true)) return API_CONTINUE;
  call->answer.status = 304;
  return API_DONE;
}

api_outcome api_validate(api_call *call, const char *representation, const char *canonical) {
  return validate(call, representation, canonical, "public, max-age=31536000, immutable");
}

api_outcome api_validate_partial(api_call *call, const char *representation, const char *canonical) {
  return validate(call, representation, canonical, "no-cache");
}

api_outcome api_validate_file(api_call *call, const char *hash) {
  return validate(call, "file", hash, "no-cache");
}

/* ---- ranges ---------------------------------------------------------------------------------- */

typedef enum range_kind {
  RANGE_ALL,          /* no range, or one to be ignored */
  RANGE_PART,         /* 206 */
  RANGE_UNSATISFIABLE /* 416 */
} range_kind;

/* Reads digits as a number and moves *text behind them; false where there are none or too many. */
static bool read_position(const char **text, uint64_t *out) {
  uint64_t value = 0;
  size_t digits = 0;
  for (; **text >= '0' && **text <= '9'; (*text)++, digits++) {
    if (digits == 18) return false;
    value = value * 10 + (uint64_t)(**text - '0');
  }
  *out = value;
  return digits > 0;
}

/* Reads one range of a list: "first-last", "first-" or "-count". RANGE_ALL: malformed. */
static range_kind read_one(const char **text, uint64_t size, api_range *out) {
  uint64_t first = 0, last = 0;
  bool has_first = read_position(text, &first);
  if (**text != '-') return RANGE_ALL;
  (*text)++;
  bool has_last = read_position(text, &last);
  if ((!has_first && !has_last) || (has_first && has_last && last < first)) return RANGE_ALL;
  if (!has_first) { /* the last `last` bytes */
    if (last == 0 || size == 0) return RANGE_UNSATISFIABLE;
    first = last < size ? size - last : 0;
    last = size - 1;
  }
  if (first >= size) return RANGE_UNSATISFIABLE;
  if (!has_last || last >= size) last = size - 1;
  *out = (api_range){first, last - first + 1};
  return RANGE_PART;
}

/* Merges `other` into *range if they overlap or touch; else false. */
static bool join_ranges(api_range *range, const api_range *other) {
  uint64_t end = range->first + range->count, other_end = other->first + other->count;
  if (other->first > end || range->first > other_end) return false;
  uint64_t first = range->first < other->first ? range->first : other->first;
  *range = (api_range){first, (end > other_end ? end : other_end) - first};
  return true;
}

/* Reads a Range header (RFC 9110, section 14) for a representation of `size` bytes. text: NULL allowed.
 * Several ranges count if each of them extends those before it to one range; else the header is ignored. */
static range_kind read_range(const char *text, uint64_t size, api_range *out) {
  if (!text || strncasecmp(text, "bytes=", 6) != 0) return RANGE_ALL;
  range_kind kind = RANGE_UNSATISFIABLE;
  api_range whole = {0};
  for (text += 6;; text++) {
    text += strspn(text, " \t");
    api_range range = {0};
    range_kind next = read_one(&text, size, &range);
    text += strspn(text, " \t");
    if (next == RANGE_ALL || (*text != ',' && *text != '\0')) return RANGE_ALL;
    if (next == RANGE_PART && kind == RANGE_PART && !join_ranges(&whole, &range)) return RANGE_ALL;
    if (next == RANGE_PART && kind != RANGE_PART) whole = range;
    if (next == RANGE_PART) kind = RANGE_PART;
    if (*text != '\0') continue;
    if (kind == RANGE_PART) *out = whole;
    return kind;
  }
}

/* Whether the Range header counts: If-Range is absent, or has our tag (dates never match). */
static bool range_counts(const api_call *call) {
  const char *if_range = api_call_header(call, "If-Range");
  if (!if_range) return true;
  const char *etag = api_answer_find(&call->answer, "ETag");
  return etag && strcmp(if_range, etag) == 0;
}

api_outcome api_range_answer(api_call *call, uint64_t size, api_range *range) {
  call->answer.status = 200;
  *range = (api_range){0, size};
  if (call->coding != API_CODING_NONE) return API_CONTINUE; /* ranges would refer to the coded bytes */
  api_answer_header(&call->answer, "Accept-Ranges", "bytes");
  const char *text = call->is_head || !range_counts(call) ? NULL : api_call_header(call, "Range");
  switch (read_range(text, size, range)) {
  case RANGE_ALL: return API_CONTINUE;
  case RANGE_PART: break;
  case RANGE_UNSATISFIABLE: {
    char total[40];
    int length = snprintf(total, sizeof total, "bytes */%llu", (unsigned long long)size);
    const char *value = tw_arena_text(call->arena, total, (size_t)length);
    if (value) call->fault.header = (api_header){"Content-Range", value};
    return api_fail_with(call, 416, "the representation has %llu %s", (unsigned long long)size,
                         tw_plural(size, "byte", "bytes"));
  }
  }
  call->answer.status = 206;
  api_answer_headerf(&call->answer, "Content-Range", "bytes %llu-%llu/%llu", (unsigned long long)range->first,
                     (unsigned long long)(range->first + range->count - 1), (unsigned long long)size);
  return API_CONTINUE;
}
