/* The times of a request: a list, or evenly spaced. Each fits a float, but keeps its digits: it is looped and
 * printed as it was asked for. */
#ifndef API_TIMES_H
#define API_TIMES_H

#include "call.h"
#include "tweend/json_print.h"
#include "tweend/retarget.h"

/* A view into the arena it was read with. */
typedef struct api_times {
  bool is_given; /* false: the request names no time */
  uint64_t count;
  const double *list; /* [count]; or NULL: time i is from + i / fps */
  double from, to, fps;
  bool has_to; /* false: `to` is the clip's end */
} api_times;

/* Reads `at`, or `from`, `to` and `fps`, from the query. TW_SYNTAX for malformed or contradictory values;
 * TW_LIMIT over max_times. */
tw_status api_times_read(const api_query *query, uint64_t max_times, tw_arena *arena, api_times *out,
                         tw_error *error);

/* Reads `from`, `to` and `fps` alone, each of which has a default: 0, the clip's end, usual_fps. Errors as
 * api_times_read. */
tw_status api_times_read_steps(const api_query *query, double usual_fps, uint64_t max_times, api_times *out,
                               tw_error *error);

/* Reads {"times": [...], "map": {...}} from the body, of which either may be left out, but not both. 400,
 * 413, 422. */
api_outcome api_times_of_body(api_call *call, api_times *out, tw_retarget_wish *retarget);

/* Completes evenly spaced times without `to` by the clip's end. TW_SYNTAX when that is before `from`;
 * TW_LIMIT. */
tw_status api_times_complete(api_times *times, double duration, uint64_t max_times, tw_error *error);

double api_times_get(const api_times *times, uint64_t index);

/* Prints the times for keys and entity tags: equal texts mean equal times. */
void api_times_print(const api_times *times, tw_text *text);

#endif
