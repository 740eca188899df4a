/* Problem documents (RFC 9457): the one form of every error answer. */
#ifndef API_PROBLEM_H
#define API_PROBLEM_H

#include "api.h"
#include "tweend/base.h"
#include "tweend/subdiv.h"

/* Why a request cannot go on now although nothing is wrong with it. */
typedef enum api_stall {
  API_STALL_NONE,
  API_STALL_THREAD, /* the work is too heavy for a light call */
  API_STALL_ENTRY,  /* another request makes what it needs: `awaited` */
  API_STALL_MEMORY  /* `needed` bytes are not to be had at present */
} api_stall;

/* Why a request fails, or stalls. A value that owns nothing but `awaited`. */
typedef struct api_fault {
  api_stall stall;           /* not NONE: the rest but the next two says nothing */
  struct api_entry *awaited; /* held, see api_cache_wait */
  uint64_t needed;
  int status;
  api_refusal refusal;    /* where the status does not tell */
  tw_error error;         /* detail, and the place in the document */
  bool in_document;       /* the error's pointer points into a JSON or glTF document ("" is its root) */
  unsigned retry_after_s; /* 0: no such header */
  const char *allow;      /* methods, for 405 */
  const char *supported;  /* comma-separated types or codings, for 406 and 415 */
  api_header header;      /* one more header of the answer; name NULL: none */
  bool is_predicted;      /* the sizes that were over a limit */
  tw_surface_counts predicted;
  uint64_t predicted_bytes; /* 0: not known */
} api_fault;

/* All of these return false, as whoever fails does. */

/* Completes a fault whose error is filled: its status, and Retry-After for 503. */
bool api_fault_complete(api_fault *fault);
bool api_fault_without_memory(api_fault *fault);

/* Fills a zeroed answer but for its memory, which is kept. */
void api_problem_fill(const api_fault *fault, const char *request_id, api_answer *answer);

#endif
