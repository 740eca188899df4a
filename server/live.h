/* Streams in real time. One thread keeps the time of all of them: when a frame is due it has it printed, once
 * for all listeners that see the same, and hands it to each. The schedule is absolute, so delays do not add
 * up, and a frame that comes too late is left out.
 *
 * A channel is what listeners share: equal frames on one grid of time. Listeners that are some frames behind
 * the first share as well, as long as those frames are kept. A listener holds the frame it is sending and at
 * most one more: the newer one replaces the older, so a slow listener skips frames and delays nobody. */
#ifndef SRV_LIVE_H
#define SRV_LIVE_H

#include "api.h"

typedef struct srv_live srv_live;
typedef struct srv_listener srv_listener;

/* Proxies close streams that are silent for half a minute or more. */
#define SRV_LIVE_PULSE_NS UINT64_C(15000000000)

/* pulse_ns: a listener that gets nothing for so long gets a sign of life, which also finds those that have
 * gone. NULL without memory or thread. */
srv_live *srv_live_create(size_t max_listeners, uint64_t pulse_ns);
void srv_live_destroy(srv_live *live); /* NULL accepted; all listeners have left */

/* Ends all streams, and refuses new ones. NULL accepted. */
void srv_live_end(srv_live *live);

/* Takes over *source, in any case. NULL: too many listeners, at the end, or without memory.
 * ready(owner) is called when srv_listener_read has returned 0 and would not any more: on any thread, under
 * a lock, once. It must not call back. */
srv_listener *srv_live_join(srv_live *live, api_live *source, void (*ready)(void *owner), void *owner);

/* The next bytes, at most `capacity`. 0: nothing is due, `ready` will be called; -1: the end. */
int64_t srv_listener_read(srv_listener *listener, uint8_t *out, size_t capacity);

/* Not between a read that returned 0 and the call of `ready`. NULL accepted. */
void srv_listener_leave(srv_listener *listener);

/* For /metrics. */
typedef struct srv_live_load {
  uint64_t listeners, channels;
  uint64_t printed, sent, skipped; /* frames, since the start */
} srv_live_load;
srv_live_load srv_live_look(srv_live *live); /* NULL accepted: zeros */

#endif
