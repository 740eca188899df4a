/* One request under way: what the stages of routes.c hand to the handlers. */
#ifndef API_CALL_H
#define API_CALL_H

#include "answer.h"
#include "api.h"
#include "cache.h"
#include "negotiate.h"
#include "problem.h"
#include "query.h"

/* What has become of a request, or of a part of it. */
typedef enum api_outcome {
  API_DONE,        /* what was asked for is there: of a handler or a stage the answer is filled */
  API_FAILED,      /* the fault is filled: a failure, or a stall */
  API_CONTINUE,    /* of a stage: the answer is for the next one to give */
  API_NEEDS_LOOK,  /* come back with API_LOOK */
  API_NEEDS_THREAD /* too much for a light call: come back with API_HEAVY */
} api_outcome;

typedef struct api_route api_route;

typedef struct api_call {
  api_service *service;
  const api_request *request;
  api_effort effort;
  const api_route *route;
  bool is_head;
  bool has_one_form;    /* Accept has no say: the path's extension names the form, or there is one alone */
  char id[API_ID_TEXT]; /* of the path; "" when the path bears none */
  const api_offer *offer;
  api_coding coding; /* of the answer: NONE, GZIP or ZSTD */
  api_query query;
  uint32_t warning_count;
  const char *first_warning; /* percent-encoded */
  uint64_t held;             /* bytes that the answer's body holds while it is read, beside entries */
  tw_arena *arena;           /* the answer's: lives as long as it does */
  api_answer answer;         /* being filled */
  api_fault fault;
} api_call;

/* Fails with a status of the library, which fault.error already bears (its status included). */
api_outcome api_fail(api_call *call);
/* The same for an error in the document of the body. */
api_outcome api_fail_in_document(api_call *call);
/* Fails with an HTTP status of its own. */
api_outcome api_fail_with(api_call *call, int status, const char *format, ...) TW_PRINTF(3, 4);
api_outcome api_fail_without_memory(api_call *call);

/* The entry of the key, out of the cache or built by this call; API_NEEDS_THREAD in a light call where it is
 * missing. key NULL: built for this call alone. */
api_outcome api_call_take(api_call *call, const char *key, api_build build, void *context, api_entry **out);

/* Grants the request `bytes` in all for what it does next, but no less than it has waited for: it goes on
 * from its beginning then, and two that gave that back on the way would take it from each other for ever.
 * False: the fault stalls. */
bool api_grant(api_call *call, uint64_t bytes);

/* The header's first value, NULL when absent. */
const char *api_call_header(const api_call *call, const char *name);

/* Answers 200 with a printed text of the offer's type. */
api_outcome api_reply(api_call *call, tw_text *text);

/* Adds [count] sentences to what X-Tweend-Warning of the answer tells: how many there are, and the first. */
void api_call_warn(api_call *call, const char *const *sentences, uint32_t count);

/* ---- answers about immutable models ---- */

/* The entity tag, quoted, of a representation ("pose.json") of a model. canonical: all parameters with their
 * defaults filled in. NULL without memory. */
const char *api_etag(api_call *call, const char *id, const char *representation, const char *canonical);

/* Sets the caching headers and the entity tag. Then judges If-None-Match and If-Match: API_DONE when the
 * answer is 304 already, API_FAILED for 412, API_CONTINUE to go on. */
api_outcome api_validate(api_call *call, const char *representation, const char *canonical);

/* The same for a file of the daemon's own, of which `hash` tells the bytes: clients ask for it anew each
 * time. */
api_outcome api_validate_file(api_call *call, const char *hash);

/* For a request that changes what the URL has: API_FAILED for 412 where If-Match names none of the entity
 * tags that the representation has in any content coding, else API_CONTINUE. */
api_outcome api_check_if_match(api_call *call, const char *representation);

/* A part of the representation. */
typedef struct api_range {
  uint64_t first, count;
} api_range;

/* Judges Range and If-Range for a representation of `size` bytes, after api_validate: sets status 200 or
 * 206 and the headers, and *range; API_CONTINUE to go on, API_FAILED for 416. */
api_outcome api_range_answer(api_call *call, uint64_t size, api_range *range);

/* Lower-case hex: out [2 count], not terminated. */
void api_hex(const uint8_t *bytes, size_t count, char *out);

#endif
