/* The state of one request, which the stages of routes.c pass to the handlers. */
#ifndef API_CALL_H
#define API_CALL_H

#include "answer.h"
#include "api.h"
#include "cache.h"
#include "negotiate.h"
#include "problem.h"
#include "query.h"

/* The outcome of a request, of one of its stages, or of a step within a handler. */
typedef enum api_outcome {
  API_DONE,        /* the result is there; from a handler or a stage: the answer is filled */
  API_FAILED,      /* the fault is filled: an error, or a stall */
  API_CONTINUE,    /* from a stage: no answer yet, go on with the next stage */
  API_NEEDS_LOOK,  /* call again with API_LOOK */
  API_NEEDS_THREAD /* too much for a light call: call again with API_HEAVY */
} api_outcome;

typedef struct api_route api_route;

typedef struct api_call {
  api_service *service;
  const api_request *request;
  api_effort effort;
  const api_route *route;
  /* Finds the route of another path, which may end in an extension; NULL: none. */
  const api_route *(*find_route)(const char *method, const char *path);
  bool is_head;
  bool has_one_form;    /* by the path's extension, or the route has one form: ignore Accept */
  char id[API_ID_TEXT]; /* of the model in the path; "" without one */
  const api_offer *offer;
  api_coding coding; /* of the answer; BROTLI: of a page alone */
  bool is_page;      /* the answer is a page: what few clients ask for, and may take longer to encode */
  api_query query;
  uint32_t warning_count;
  const char *first_warning; /* percent-encoded */
  bool leaves_warnings;      /* some are not known, so that X-Tweend-Warning is left out */
  const char *told_name;     /* the model's name in a description, which the entity tag depends on; or NULL */
  uint64_t
      held; /* bytes that the answer's body holds while it is read, without the arena and cache entries */
  tw_arena *arena;   /* the answer's arena; lives as long as the answer */
  api_answer answer; /* filled in by the stages and the handler */
  api_fault fault;
} api_call;

/* Fails with the library's error in fault.error, whose status is filled in. */
api_outcome api_fail(api_call *call);
/* The same for an error in the document that the body holds. */
api_outcome api_fail_in_document(api_call *call);
/* Goes on, or fails where the library did. */
api_outcome api_outcome_of(api_call *call, tw_status status);
/* Fails with an HTTP status. */
api_outcome api_fail_with(api_call *call, int status, const char *format, ...) TW_PRINTF(3, 4);
api_outcome api_fail_without_memory(api_call *call);

/* The entry of a key, from the cache or built by this call; a light call stalls where it is missing. key
 * NULL: built for this call alone. */
api_outcome api_call_take(api_call *call, const char *key, api_build build, void *context, api_entry **out);

/* Bytes that a running request may hold without a grant: most light ones take less. */
enum { API_UNGRANTED = 256 << 10 };

/* Sets the memory granted to the request to what the call's arena holds and `bytes` more, for what it does
 * next, in the arena or elsewhere; but not below what it has waited for: after a wait the request begins
 * anew, and two requests that released that memory on the way would take it from each other for ever; and not
 * above --max-memory, since `bytes` is a bound. What the request really takes is metered. False: the fault
 * stalls. */
bool api_grant(api_call *call, uint64_t bytes);

/* The header's value, see api_request; NULL when absent. */
const char *api_call_header(const api_call *call, const char *name);

/* Answers 200 with a printed text of the offer's type. */
api_outcome api_reply(api_call *call, tw_text *text);

/* Adds [count] sentences to the answer's X-Tweend-Warning, which tells their number and the first of them. */
void api_call_warn(api_call *call, const char *const *sentences, uint32_t count);
/* Adds the text as one sentence, and frees it. */
api_outcome api_call_warn_text(api_call *call, tw_text *text);
/* Adds a count and what follows it as one sentence; none for 0. one, many: begin with a blank. */
api_outcome api_call_warn_count(api_call *call, uint64_t count, const char *one, const char *many);

/* ---- answers about immutable models ---------------------------------------------------------- */

/* The entity tag, quoted, of a representation ("pose.json") of a model. canonical: all parameters, with
 * defaults filled in. NULL without memory. */
const char *api_etag(api_call *call, const char *id, const char *representation, const char *canonical);

/* Sets the caching headers and the entity tag, then evaluates If-None-Match and If-Match: API_DONE when the
 * answer is 304, API_FAILED for 412, API_CONTINUE to go on. */
api_outcome api_validate(api_call *call, const char *representation, const char *canonical);

/* The same for an answer that lacks what other models would give it, if they were stored: clients revalidate
 * it each time. canonical: as the answer is. */
api_outcome api_validate_partial(api_call *call, const char *representation, const char *canonical);

/* The same for a file embedded in the daemon, whose bytes `hash` identifies; clients revalidate it each
 * time. */
api_outcome api_validate_file(api_call *call, const char *hash);

/* For a request that changes what is at the URL: API_FAILED for 412 where If-Match names none of the
 * representation's entity tags in any content coding, or If-None-Match one of them, else API_CONTINUE. */
api_outcome api_check_conditions(api_call *call, const char *representation, const char *canonical);

/* A byte range of a representation. */
typedef struct api_range {
  uint64_t first, count;
} api_range;

/* Evaluates Range and If-Range for a representation of `size` bytes, after api_validate: sets status 200 or
 * 206, the headers, and *range. API_CONTINUE to go on, API_FAILED for 416. */
api_outcome api_range_answer(api_call *call, uint64_t size, api_range *range);

/* Lower-case hex: out [2 count], not terminated. */
void api_hex(const uint8_t *bytes, size_t count, char *out);

#endif
