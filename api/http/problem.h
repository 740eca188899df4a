/* Problem documents (RFC 9457): the form of every error answer. */
#ifndef API_PROBLEM_H
#define API_PROBLEM_H

#include "api.h"
#include "tweend/base.h"
#include "tweend/subdiv.h"

/* Why a valid request cannot go on now. */
typedef enum api_stall {
  API_STALL_NONE,
  API_STALL_THREAD, /* the work is too heavy for a light call */
  API_STALL_ENTRY,  /* another request builds what it needs: `awaited` */
  API_STALL_MEMORY  /* `needed` bytes are not free at present */
} api_stall;

/* Why a request fails or stalls. A value; owns only the reference `awaited`. */
typedef struct api_fault {
  api_stall stall;           /* unless NONE, `awaited`, `needed` and what is predicted are meaningful */
  struct api_entry *awaited; /* a reference, see api_cache_wait */
  uint64_t needed;
  bool is_measured; /* the request took its grant and needed more; else `needed` is a bound */
  int status;
  api_refusal refusal;    /* where the status does not imply it */
  tw_error error;         /* detail, and the place in the document */
  bool in_document;       /* error.pointer refers to a JSON or glTF document ("" is its root) */
  unsigned retry_after_s; /* 0: no Retry-After */
  const char *allow;      /* methods, for 405 */
  const char *supported;  /* comma-separated types or codings, for 406 and 415 */
  api_header header;      /* one more header of the answer; name NULL: none */
  bool is_predicted;      /* `predicted` holds the sizes that were over a limit */
  tw_surface_counts predicted;
  uint64_t predicted_bytes; /* 0: not known */
} api_fault;

/* All of these return false, so that a failing function can return their result. */

/* Completes a fault whose error is filled: sets its status, and Retry-After for 503. */
bool api_fault_complete(api_fault *fault);
bool api_fault_without_memory(api_fault *fault);
/* Turns the fault of an allocation that the request's meter refused into a stall for that memory; leaves
 * other faults alone. */
bool api_fault_without_grant(api_fault *fault);

/* Fills an answer that is zeroed except for its memory. */
void api_problem_fill(const api_fault *fault, const char *request_id, api_answer *answer);

#endif
