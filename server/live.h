/* Live streams: frames sent in real time. One thread keeps the schedule of all streams: when a frame is due,
 * it has the frame printed once for all listeners that see it, and hands it to each. The schedule is
 * absolute, so that delays do not add up; a frame that would be too late is skipped.
 *
 * Listeners share a channel: the same frames on one time grid. A listener may lag some frames behind the
 * first, as long as the channel keeps those frames. A listener holds the frame that it is sending and at most
 * one more, which a newer frame replaces: a slow listener skips frames and delays nobody. */
#ifndef SRV_LIVE_H
#define SRV_LIVE_H

#include "api.h"

typedef struct srv_live srv_live;
typedef struct srv_listener srv_listener;

/* Keep-alive interval: proxies close streams that are silent for 30 seconds or more. */
#define SRV_LIVE_PULSE_NS UINT64_C(15000000000)

/* service: what streams hold counts as its API_HELD_LIVE; outlives the streams. pulse_ns: a listener that has
 * got nothing for this long gets a keep-alive text, which also reveals clients that have gone. NULL with
 * errno. */
srv_live *srv_live_create(api_service *service, size_t max_listeners, uint64_t pulse_ns);
void srv_live_destroy(srv_live *live); /* NULL accepted. All listeners must have left */

/* Ends all streams, and refuses new ones. NULL accepted. */
void srv_live_end(srv_live *live);

/* Takes over *source in any case. NULL: too many listeners, after srv_live_end, or without memory, which
 * *lacks_memory tells: then there may be room for streams that hold less, or later.
 * ready(owner): called once when srv_listener_read has returned 0 and has something to read again, on any
 * thread, under a lock; it must not call functions of this file. */
srv_listener *srv_live_join(srv_live *live, api_live *source, void (*ready)(void *owner), void *owner,
                            bool *lacks_memory);

/* Reads the next bytes, at most `capacity`. 0: nothing is due, `ready` will be called; -1: the stream has
 * ended. */
int64_t srv_listener_read(srv_listener *listener, uint8_t *out, size_t capacity);

/* Must not be called between a read that returned 0 and the call of `ready`. NULL accepted. */
void srv_listener_leave(srv_listener *listener);

/* For /metrics. */
typedef struct srv_live_load {
  uint64_t listeners, channels;
  uint64_t printed, sent, skipped; /* frames, since the start */
} srv_live_load;
srv_live_load srv_live_look(srv_live *live); /* NULL accepted: zeros */

#endif
