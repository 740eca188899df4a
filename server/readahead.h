/* Computes the next blocks of an answer on a compute thread while earlier blocks are being sent.
 *
 * A read never waits: it returns bytes that are ready, or computes the next block itself. A compute thread
 * fills the ring, at most SRV_READAHEAD_BLOCKS blocks, only while a core is idle and the client reads so fast
 * that computing would hold it up. So a slow reader occupies no thread and, once it has read the ring empty,
 * no memory. The ring counts in the memory budget; a reader for which there is no room goes without.
 *
 * Slow bodies (api_body.is_slow) are read by compute threads alone, a block at a time, after all other jobs
 * (srv_work_give_way).
 */
#ifndef SRV_READAHEAD_H
#define SRV_READAHEAD_H

#include "api.h"
#include "work.h"

enum { SRV_BLOCK_SIZE = 256 << 10, SRV_READAHEAD_BLOCKS = 4 };

typedef struct srv_readahead srv_readahead;

/* Whom a readahead is for. */
typedef struct srv_reader {
  void *owner;
  /* Called once after a read returned SRV_READAHEAD_LATER, when there is something to read, on a compute
   * thread, under a lock; it must not call functions of this file. */
  void (*ready)(void *owner);
  /* Whether the owner still wants the body; asked before a slow one is read, on a compute thread. */
  bool (*is_wanted)(void *owner);
} srv_reader;

/* Takes over *answer, which must have a body, unless it returns NULL (no memory). The answer's headers and
 * texts stay where they are until srv_readahead_leave. */
srv_readahead *srv_readahead_create(srv_work *work, api_service *service, const api_answer *answer,
                                    const srv_reader *reader);

enum { SRV_READAHEAD_LATER = -2 }; /* nothing is ready; `ready` will be called */

/* Like api_body.read, or SRV_READAHEAD_LATER. One thread at a time. */
int64_t srv_readahead_read(srv_readahead *ahead, uint8_t *out, size_t capacity);

/* Frees the readahead and its answer, at once or when the block that is being computed is done. Must not be
 * called between a read that returned SRV_READAHEAD_LATER and the call of `ready`. NULL accepted. */
void srv_readahead_leave(srv_readahead *ahead);

#endif
