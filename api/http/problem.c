/* Problem documents (RFC 9457), and the one place where library errors become HTTP statuses. */
#include "problem.h"

#include "answer.h"
#include "tweend/json_print.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static int status_of(tw_status status) {
  switch (status) {
  case TW_SYNTAX: return 400;
  case TW_INVALID:
  case TW_UNSUPPORTED:
  case TW_LIMIT: return 422;
  case TW_NO_MEMORY:
  case TW_CANCELLED: return 503;
  case TW_OK: break; /* a success reported as a failure is a bug */
  }
  return 500;
}

bool api_fault_complete(api_fault *fault) {
  fault->status = status_of(fault->error.status);
  if (fault->status == 503) fault->retry_after_s = 1;
  return false;
}

bool api_fault_without_memory(api_fault *fault) {
  tw_fail(&fault->error, TW_NO_MEMORY, "out of memory");
  return api_fault_complete(fault);
}

bool api_fault_without_grant(api_fault *fault) {
  tw_meter *meter = tw_meter_current();
  uint64_t missing = meter ? atomic_exchange(&meter->missing, 0) : 0;
  if (meter && atomic_load(&meter->is_over) && fault->error.status == TW_NO_MEMORY) {
    tw_work_status(&fault->error);
    return api_fault_complete(fault);
  }
  if (missing == 0 || fault->stall != API_STALL_NONE || fault->error.status != TW_NO_MEMORY) return false;
  *fault = (api_fault){.stall = API_STALL_MEMORY,
                       .needed = missing + missing / 2,
                       .is_measured = true,
                       .is_predicted = fault->is_predicted,
                       .predicted = fault->predicted};
  return false;
}

typedef struct problem_kind {
  int status;
  const char *name, *title;
} problem_kind;

static const problem_kind kinds[] = {
    {400, "bad-request", "Bad request"},
    {401, "key-missing", "API key missing"},
    {403, "not-allowed", "Not allowed"},
    {404, "not-found", "Not found"},
    {405, "method-not-allowed", "Method not allowed"},
    {406, "not-acceptable", "No acceptable representation"},
    {408, "timeout", "Request timed out"},
    {411, "length-required", "Length required"},
    {412, "precondition-failed", "Precondition failed"},
    {413, "too-large", "Body too large"},
    {414, "uri-too-long", "URI too long"},
    {415, "unsupported-type", "Unsupported type"},
    {416, "range-not-satisfiable", "Range not satisfiable"},
    {417, "expectation-failed", "Expectation failed"},
    {421, "misdirected-request", "Misdirected request"},
    {422, "not-usable", "Well-formed but not usable"},
    {429, "too-many-requests", "Too many requests"},
    {431, "headers-too-large", "Headers too large"},
    {501, "not-implemented", "Not implemented"},
    {503, "unavailable", "Service unavailable"},
    {505, "version-not-supported", "HTTP version not supported"},
    {507, "store-full", "Store full"},
};

static const problem_kind *kind_of(int status) {
  static const problem_kind other = {500, "internal", "Internal error"};
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
    if (kinds[i].status == status) return &kinds[i];
  assert(status == other.status);
  return &other;
}

/* "a, b" as ["a","b"]. */
static void print_list(tw_text *text, const char *list) {
  tw_text_add(text, "[");
  while (*list) {
    size_t length = strcspn(list, ", ");
    if (length > 0) {
      tw_text_element(text);
      tw_text_add(text, "\"");
      tw_text_bytes(text, list, length);
      tw_text_add(text, "\"");
    }
    list += length;
    list += strspn(list, ", ");
  }
  tw_text_add(text, "]");
}

static void print_predicted(tw_text *text, const api_fault *fault) {
  tw_member_open(text, "predicted", "{");
  tw_member_count(text, "vertices", fault->predicted.vertices);
  tw_member_count(text, "edges", fault->predicted.edges);
  tw_member_count(text, "faces", fault->predicted.faces);
  if (fault->predicted_bytes) tw_member_count(text, "bytes", fault->predicted_bytes);
  tw_text_add(text, "}");
}

static void print_place(tw_text *text, const api_fault *fault) {
  if (fault->error.line) tw_member_count(text, "line", fault->error.line);
  if (fault->error.column) tw_member_count(text, "column", fault->error.column);
  if (!fault->in_document) return;
  tw_member_open(text, "errors", "[{");
  tw_member_string(text, "pointer", fault->error.pointer);
  tw_member_string(text, "detail", fault->error.detail);
  tw_text_add(text, "}]");
}

/* Prints the detail with its place in front: not every client looks at `errors` and `line`. */
static void print_detail(tw_text *text, const api_fault *fault) {
  const tw_error *error = &fault->error;
  char place[sizeof error->pointer] = "", detail[sizeof place + sizeof error->detail + 2];
  if (fault->in_document)
    strcpy(place, error->pointer);
  else if (error->column)
    snprintf(place, sizeof place, "line %" PRIu64 ", column %" PRIu64, error->line, error->column);
  else if (error->line)
    snprintf(place, sizeof place, "line %" PRIu64, error->line);
  snprintf(detail, sizeof detail, "%s%s%s", place, place[0] ? ": " : "", error->detail);
  tw_member_string(text, "detail", detail);
}

static void print_problem(tw_text *text, const api_fault *fault, const char *request_id) {
  const problem_kind *kind = kind_of(fault->status);
  tw_text_add(text, "{");
  tw_text_member(text, "type");
  tw_text_add(text, "\"urn:tweend:problem:");
  tw_text_add(text, kind->name);
  tw_text_add(text, "\"");
  tw_member_string(text, "title", kind->title);
  tw_member_count(text, "status", (uint64_t)fault->status);
  print_detail(text, fault);
  tw_member_string(text, "instance", request_id);
  print_place(text, fault);
  if (fault->is_predicted) print_predicted(text, fault);
  if (fault->supported) {
    tw_text_member(text, "supported");
    print_list(text, fault->supported);
  }
  tw_text_add(text, "}\n");
}

static api_refusal refusal_of(const api_fault *fault) {
  if (fault->error.status == TW_NO_MEMORY) return API_REFUSAL_MEMORY;
  switch (fault->status) {
  case 401:
  case 403:
  case 421: return API_REFUSAL_ACCESS;
  case 413: return API_REFUSAL_BODY;
  case 507: return API_REFUSAL_STORE_FULL;
  default: return fault->refusal;
  }
}

void api_problem_fill(const api_fault *fault, const char *request_id, api_answer *answer) {
  answer->refusal = refusal_of(fault);
  tw_text text = {0};
  print_problem(&text, fault, request_id);
  api_answer_text(answer, fault->status, "application/problem+json", &text);
  api_answer_header(answer, "Cache-Control", "no-store");
  if (fault->header.name) api_answer_header(answer, fault->header.name, fault->header.value);
  if (fault->allow) api_answer_header(answer, "Allow", fault->allow);
  if (fault->retry_after_s) api_answer_headerf(answer, "Retry-After", "%u", fault->retry_after_s);
}

void api_problem(int status, const char *detail, const char *request_id, unsigned retry_after,
                 api_answer *answer) {
  api_fault fault = {.status = status, .retry_after_s = retry_after};
  tw_fail(&fault.error, TW_SYNTAX, "%s", detail);
  *answer = (api_answer){.memory = tw_arena_create()};
  api_problem_fill(&fault, request_id, answer);
  api_answer_header(answer, "Access-Control-Allow-Origin", "*"); /* the request's own headers are not known */
}
