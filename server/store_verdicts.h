/* What a store remembers of its models: the state in which each was last seen, and whether it was whole. */
#ifndef SRV_STORE_VERDICTS_H
#define SRV_STORE_VERDICTS_H

#include "api.h"

#include <nettle/sha2.h>

bool srv_store_is_id(const char *text);
/* Finishes the hash; whether it equals the id. */
bool srv_store_is_hash(struct sha256_ctx *hash, const char *id);

typedef enum srv_wholeness { SRV_UNJUDGED, SRV_WHOLE, SRV_DAMAGED } srv_wholeness;

enum { SRV_STATE_SIZE = 128 };

/* What is known of a model. wholeness: of the content in this state. A damaged model is checked, and logged,
 * on each access. */
typedef struct srv_verdict {
  char id[API_ID_TEXT];       /* "": unused */
  char state[SRV_STATE_SIZE]; /* an ETag or the facts of a file, equal only for equal content; "": unknown */
  uint64_t size;
  srv_wholeness wholeness;
  uint64_t seen_ns; /* when the model was last found undamaged; 0: it was not */
} srv_verdict;

/* A table of verdicts of fixed size: the verdict of one model may replace that of another. Any thread may
 * call the functions. */
typedef struct srv_verdicts srv_verdicts;
srv_verdicts *srv_verdicts_create(void);        /* NULL without memory */
void srv_verdicts_destroy(srv_verdicts *table); /* NULL accepted */

/* The verdict on a model; zeroed when nothing is known. */
srv_verdict srv_verdicts_recall(srv_verdicts *table, const char *id);
/* Whether the model was seen at most a second ago, so that it need not be looked for. */
bool srv_verdict_is_fresh(const srv_verdict *verdict);
/* Whether the verdict is on the content in this state; never when the state is unknown. */
bool srv_verdict_is_of(const srv_verdict *verdict, const char *state);
/* Notes that the model exists now. */
void srv_verdicts_note(srv_verdicts *table, const char *id, const char *state, uint64_t size,
                       srv_wholeness wholeness);
/* Notes that the model does not exist. */
void srv_verdicts_forget(srv_verdicts *table, const char *id);

#endif
