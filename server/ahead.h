/* Blocks of an answer that a compute thread makes while those before them are on their way.
 *
 * Reading never waits: it hands out what is there, or computes the next block itself, as it would without
 * this. Only when a core is idle and the client takes blocks fast enough to be held up by their computation
 * does a compute thread go ahead, by SRV_AHEAD_BLOCKS at most; then it leaves. So a slow reader holds no
 * thread, and once it has drained what there is, no memory. Those that stop before that hold the blocks made
 * for them, so SRV_AHEAD_READERS have some at once; the others do without. */
#ifndef SRV_AHEAD_H
#define SRV_AHEAD_H

#include "api.h"
#include "work.h"

enum { SRV_BLOCK_SIZE = 256 << 10, SRV_AHEAD_BLOCKS = 4, SRV_AHEAD_READERS = 64 };

typedef struct srv_ahead srv_ahead;

/* Takes over *answer, which has a body, unless it returns NULL (no memory); headers and texts of the answer
 * stay where they are until srv_ahead_leave. ready(owner): what a read was short of is there; on a compute
 * thread, under a lock, once. It must not call back. */
srv_ahead *srv_ahead_create(srv_work *work, const api_answer *answer, void (*ready)(void *owner),
                            void *owner);

enum { SRV_AHEAD_LATER = -2 }; /* nothing is there yet, `ready` will be called */

/* As the body's read, or SRV_AHEAD_LATER. By one thread at a time. */
int64_t srv_ahead_read(srv_ahead *ahead, uint8_t *out, size_t capacity);

/* Frees it with the answer, at once or as soon as the block is made that is under way. Not between a read
 * that returned SRV_AHEAD_LATER and the call of `ready`. NULL accepted. */
void srv_ahead_leave(srv_ahead *ahead);

#endif
