/* Blocks of an answer that a compute thread makes while those before them are on their way.
 *
 * Reading never waits: it hands out what is there, or computes the next block itself, as it would without
 * this. Only when a core is idle and the client takes blocks fast enough to be held up by their computation
 * does a compute thread go ahead, by SRV_READAHEAD_BLOCKS at most; then it leaves. So a slow reader holds no
 * thread, and once it has drained what there is, no memory. Blocks count in the budget for memory: a reader
 * for whom there is no room does without. */
#ifndef SRV_READAHEAD_H
#define SRV_READAHEAD_H

#include "api.h"
#include "work.h"

enum { SRV_BLOCK_SIZE = 256 << 10, SRV_READAHEAD_BLOCKS = 4 };

typedef struct srv_readahead srv_readahead;

/* Takes over *answer, which has a body, unless it returns NULL (no memory); headers and texts of the answer
 * stay where they are until srv_readahead_leave. ready(owner): what a read was short of is there; on a
 * compute thread, under a lock, once. It must not call back. */
srv_readahead *srv_readahead_create(srv_work *work, api_service *service, const api_answer *answer,
                                    void (*ready)(void *owner), void *owner);

enum { SRV_READAHEAD_LATER = -2 }; /* nothing is there yet, `ready` will be called */

/* As the body's read, or SRV_READAHEAD_LATER. By one thread at a time. */
int64_t srv_readahead_read(srv_readahead *ahead, uint8_t *out, size_t capacity);

/* Frees it with the answer, at once or as soon as the block is made that is under way. Not between a read
 * that returned SRV_READAHEAD_LATER and the call of `ready`. NULL accepted. */
void srv_readahead_leave(srv_readahead *ahead);

#endif
