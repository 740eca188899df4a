/* What every store keeps of its models: the state in which each was seen last, and whether it was whole. */
#ifndef SRV_STORE_VERDICTS_H
#define SRV_STORE_VERDICTS_H

#include "api.h"

#include <nettle/sha2.h>

bool srv_store_is_id(const char *text);
/* Whether the hash, which ends here, is the one that the id tells. */
bool srv_store_is_hash(struct sha256_ctx *hash, const char *id);

typedef enum srv_wholeness { SRV_UNJUDGED, SRV_WHOLE, SRV_DAMAGED } srv_wholeness;

enum { SRV_STATE_SIZE = 128 };

/* wholeness is that of the content in this state. What is damaged is looked at each time, and logged each
 * time. */
typedef struct srv_verdict {
  char id[API_ID_TEXT];       /* "": of none */
  char state[SRV_STATE_SIZE]; /* tells a content from others, "" from all: an ETag, the facts of a file */
  uint64_t size;
  srv_wholeness wholeness;
  uint64_t seen_ns; /* when the model was found last, and not damaged; 0: it was not */
} srv_verdict;

/* A table of verdicts, of a fixed size: a model's verdict may give way to another model's. Any thread may
 * call the functions. */
typedef struct srv_verdicts srv_verdicts;
srv_verdicts *srv_verdicts_create(void);        /* NULL without memory */
void srv_verdicts_destroy(srv_verdicts *table); /* NULL accepted */

/* A zeroed one where nothing is known. */
srv_verdict srv_verdicts_recall(srv_verdicts *table, const char *id);
/* Whether the model was seen a second ago at most: it need not be looked for. */
bool srv_verdict_is_fresh(const srv_verdict *verdict);
/* The model is there now. */
void srv_verdicts_note(srv_verdicts *table, const char *id, const char *state, uint64_t size,
                       srv_wholeness wholeness);
/* It is not there. */
void srv_verdicts_forget(srv_verdicts *table, const char *id);

#endif
