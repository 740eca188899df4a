/* One lock guards everything but a listener's current frame. The lock is not held while a frame is printed or
 * a channel is freed. Only the live thread frees channels, so that it may release the lock in between. */
#include "live.h"

#include "machine.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* A channel keeps frames for listeners with a lag: up to KEPT_MAX frames, as many as fit into KEPT_BYTES. */
enum { KEPT_MAX = 128, KEPT_BYTES = 128 << 10 };

typedef struct channel channel;

typedef struct frame {
  size_t references;
  channel *channel; /* outlives the frame */
  uint64_t number;
  api_bytes bytes;
} frame;

/* One playback of a source, shared by listeners. Step n of its time grid is due at start_ns + n / fps; a
 * listener of lag 0 then sees frame base + n, and one of lag 3, which joined three steps later and sees all
 * frames from the beginning, frame base + n - 3. */
struct channel {
  channel *next;
  api_live source;
  uint64_t held;     /* bytes held of the service; only the live thread changes it */
  uint64_t frames;   /* bytes of its frames, also of those that listeners send */
  uint64_t start_ns; /* when step 0 is due: may be in the future when the source has a start */
  uint64_t base;
  uint64_t due_ns;       /* when the channel needs the live thread next */
  uint32_t depth;        /* capacity in frames; 0: no frame has been printed */
  uint64_t newest;       /* the frame printed last, when depth > 0 */
  frame *kept[KEPT_MAX]; /* [depth], indexed by number modulo depth; entries may be NULL */
  srv_listener *listeners;
};

struct srv_listener {
  srv_live *live;
  channel *channel;
  srv_listener *previous, *next; /* in the channel's list */
  int64_t lag;                   /* frames behind lag 0 */
  uint64_t first;                /* the frame to begin with, even when it is late */
  bool has_shown;
  uint64_t shown; /* the frame offered last, with has_shown */
  uint64_t offered_ns;
  frame *pending; /* offered, not yet read */
  bool pulse;     /* a keep-alive text is due */
  bool finished;  /* the last frame was offered; the closing text follows it */
  bool cut;       /* the stream ends at once */
  bool waiting;   /* the last read returned 0 */
  void (*ready)(void *owner);
  void *owner;

  /* Only the reader touches these: what it is sending. */
  frame *current;
  api_bytes bytes;
  size_t offset;
  char stamp[API_LIVE_STAMP]; /* sent after the frame */
  size_t stamp_size;          /* 0: there is none left to send */
  bool opened, closed;
};

struct srv_live {
  api_service *service;
  pthread_mutex_t lock;
  pthread_cond_t wake;
  pthread_t thread;
  channel *channels;
  size_t max_listeners, listeners;
  uint64_t pulse_ns;
  bool ending, stopping;
  uint64_t printed, sent, skipped;
};

/* ---- frames ---------------------------------------------------------------------------------- */

static void release_frame(frame *f) {
  if (!f || --f->references > 0) return;
  f->channel->frames -= f->bytes.size;
  free((void *)(uintptr_t)f->bytes.data);
  free(f);
}

static frame *hold_frame(frame *f) {
  f->references++;
  return f;
}

static frame *find_frame(const channel *c, uint64_t number) {
  frame *f = c->depth > 0 ? c->kept[number % c->depth] : NULL;
  return f && f->number == number ? f : NULL;
}

/* Takes ownership of the frame. */
static void keep_frame(channel *c, frame *f) {
  if (c->depth == 0) {
    size_t depth = KEPT_BYTES / (f->bytes.size + 1);
    c->depth = depth < 1 ? 1 : depth > KEPT_MAX ? KEPT_MAX : (uint32_t)depth;
  }
  frame **slot = &c->kept[f->number % c->depth];
  release_frame(*slot);
  *slot = f;
  c->newest = f->number;
}

/* What a channel holds at least: with a frame that is sent and one that is printed. */
static uint64_t least_memory(const api_live *source) {
  return sizeof(channel) + source->size + 2 * source->frame_size;
}

/* Holds memory for a channel with so many bytes of frames. */
static bool hold_for_frames(srv_live *live, channel *c, uint64_t frames) {
  uint64_t least = least_memory(&c->source), needed = sizeof *c + c->source.size + frames;
  if (needed < least) needed = least;
  if (needed > c->held && !api_service_hold_live(live->service, needed - c->held)) return false;
  if (needed < c->held) api_service_let_go(live->service, API_HELD_LIVE, c->held - needed);
  c->held = needed;
  return true;
}

/* NULL without memory. others: bytes of the channel's other frames. */
static frame *create_frame(srv_live *live, channel *c, uint64_t number, uint64_t others) {
  frame *f = malloc(sizeof *f);
  if (!f) return NULL;
  *f = (frame){.references = 1, .channel = c, .number = number};
  if (!c->source.frame(c->source.context, number, &f->bytes)) {
    free(f);
    return NULL;
  }
  if (hold_for_frames(live, c, others + f->bytes.size)) return f;
  free((void *)(uintptr_t)f->bytes.data);
  free(f);
  return NULL;
}

/* Prints a frame, with the lock released meanwhile. */
static void print_frame(srv_live *live, channel *c, uint64_t number) {
  uint64_t others = c->frames; /* listeners may free some of them meanwhile */
  pthread_mutex_unlock(&live->lock);
  frame *f = create_frame(live, c, number, others);
  pthread_mutex_lock(&live->lock);
  if (!f) return; /* without memory the frame is skipped, like one that is too late */
  live->printed++;
  c->frames += f->bytes.size;
  keep_frame(c, f);
}

/* ---- schedule -------------------------------------------------------------------------------- */

/* When a step of the grid is due. Computed from the start, so that errors do not add up. */
static uint64_t step_ns(const channel *c, uint64_t step) {
  return c->start_ns + (uint64_t)ceil((double)step * 1e9 / c->source.fps);
}

static bool has_begun(const channel *c, uint64_t now) {
  return now >= c->start_ns;
}

static uint64_t step_at(const channel *c, uint64_t now) {
  if (!has_begun(c, now)) return 0;
  uint64_t step = (uint64_t)((double)(now - c->start_ns) * c->source.fps / 1e9);
  while (step > 0 && step_ns(c, step) > now) step--;
  while (step_ns(c, step + 1) <= now) step++;
  return step;
}

/* The step that a new listener begins with. In the second half of a step that is the next one, so that the
 * listener's first frame is not replaced at once. */
static uint64_t nearest_step(const channel *c, uint64_t now) {
  uint64_t step = step_at(c, now);
  return step_ns(c, step + 1) - now < now - step_ns(c, step) ? step + 1 : step;
}

/* The frame that a listener of this lag sees at a step, clamped to the first and the last frame. */
static uint64_t frame_at(const channel *c, uint64_t step, int64_t lag) {
  int64_t number = (int64_t)(c->base + step) - lag;
  if (number < 0) return 0;
  return (uint64_t)number < c->source.last ? (uint64_t)number : c->source.last;
}

static int64_t least_lag(const channel *c) {
  int64_t least = INT64_MAX;
  for (const srv_listener *l = c->listeners; l; l = l->next)
    if (l->lag < least) least = l->lag;
  return least;
}

/* ---- the live thread ------------------------------------------------------------------------- */

static void wake_listener(srv_listener *l) {
  if (!l->waiting) return;
  l->waiting = false;
  l->ready(l->owner);
}

static bool is_complete(const srv_listener *l) {
  return l->cut || l->finished;
}

/* Offers the listener frame `number`, in place of one that it has not read yet. The first frame is never
 * skipped, as clients start from it: while it is pending, nothing replaces it; until it has been offered, it
 * is offered as soon as it is kept, even if a later frame is due. */
static void offer(srv_live *live, srv_listener *l, uint64_t number, uint64_t now) {
  if (is_complete(l)) return;
  if (l->pending && l->pending->number == l->first) return;
  if (!l->has_shown && (number < l->first || find_frame(l->channel, l->first))) number = l->first;
  frame *f = l->has_shown && l->shown == number ? NULL : find_frame(l->channel, number);
  if (f) {
    if (l->pending) live->skipped++;
    release_frame(l->pending);
    l->pending = hold_frame(f);
    l->has_shown = true;
    l->shown = number;
    l->finished = number == l->channel->source.last;
  } else if (now - l->offered_ns >= live->pulse_ns) {
    l->pulse = true;
  } else {
    return;
  }
  l->offered_ns = now;
  wake_listener(l);
}

/* Offers each listener its frame. Prints at most one frame, for the least lag: those that listeners of a
 * greater lag see were printed earlier. */
static void play(srv_live *live, channel *c, uint64_t now) {
  uint64_t step = step_at(c, now);
  uint64_t front = c->depth == 0 ? c->base : frame_at(c, step, least_lag(c));
  if (has_begun(c, now) && (c->depth == 0 || front > c->newest)) print_frame(live, c, front);
  c->due_ns = has_begun(c, now) ? step_ns(c, step + 1) : c->start_ns;
  for (srv_listener *l = c->listeners; l; l = l->next) {
    offer(live, l, frame_at(c, step, l->lag), now);
    uint64_t pulse = l->offered_ns + live->pulse_ns;
    if (!is_complete(l) && pulse < c->due_ns) c->due_ns = pulse;
  }
}

/* Call only when the channel has no listeners. */
static void destroy_channel(srv_live *live, channel *c) {
  for (uint32_t i = 0; i < c->depth; i++) release_frame(c->kept[i]);
  c->source.destroy(c->source.context);
  api_service_let_go(live->service, API_HELD_LIVE, c->held);
  free(c);
}

/* Plays the channels that are due and frees those without listeners. Returns when the next channel is due. */
static uint64_t run_channels(srv_live *live) {
  uint64_t next = UINT64_MAX;
  for (channel **place = &live->channels; *place;) {
    channel *c = *place;
    uint64_t now = srv_now_ns();
    if (c->listeners && c->due_ns <= now) play(live, c, now);
    if (!c->listeners) {
      *place = c->next;
      pthread_mutex_unlock(&live->lock); /* freeing may take long and wake other requests */
      destroy_channel(live, c);
      pthread_mutex_lock(&live->lock);
      continue;
    }
    if (c->due_ns < next) next = c->due_ns;
    place = &c->next;
  }
  return next;
}

static void *run(void *context) {
  srv_live *live = context;
  pthread_mutex_lock(&live->lock);
  while (!live->stopping) {
    uint64_t next = run_channels(live);
    if (live->stopping) break;
    if (next == UINT64_MAX)
      pthread_cond_wait(&live->wake, &live->lock);
    else
      srv_timed_wait(&live->wake, &live->lock, next);
  }
  pthread_mutex_unlock(&live->lock);
  return NULL;
}

/* ---- joining and leaving --------------------------------------------------------------------- */

/* Whether a new listener that wants frame `first` now can share the channel, and with which *lag. A channel
 * prints frames in ascending order, when the listener of the least lag needs them. So a new listener of the
 * same lag sees the frames that are printed next; one of a greater lag needs frames that are still kept; a
 * smaller lag is impossible. A source that joins takes the least lag, as does every listener before the first
 * frame is printed. */
static bool can_share(const channel *c, const api_live *source, uint64_t now, int64_t *lag) {
  if (!c->listeners || strcmp(c->source.key, source->key) != 0) return false;
  int64_t least = least_lag(c);
  bool is_begun = c->depth > 0 || source->first != c->base;
  *lag =
      source->joins || !is_begun ? least : (int64_t)(c->base + nearest_step(c, now)) - (int64_t)source->first;
  if (*lag == least) return true;
  return *lag > least && *lag - least < (int64_t)c->depth && find_frame(c, source->first);
}

/* Makes the frame that is due now step 0 of the grid, or frame 0 when the start is in the future. */
static void begin_at_start(channel *c, uint64_t now) {
  double fps = c->source.fps, passed_s = (double)srv_unix_ns() / 1e9 - c->source.start_ms / 1e3;
  if (passed_s < 0) {
    c->start_ns = now + (uint64_t)(-passed_s * 1e9);
    return;
  }
  double frame = floor(passed_s * fps), late_ns = (passed_s - frame / fps) * 1e9;
  c->base = frame < (double)c->source.last ? (uint64_t)frame : c->source.last;
  if (late_ns > 0 && late_ns < (double)now) c->start_ns = now - (uint64_t)late_ns;
}

/* Creates a channel for a source that cannot share one, and takes over the source and what is *held for it.
 * NULL without memory. */
static channel *create_channel(srv_live *live, api_live *source, uint64_t now, uint64_t *held) {
  channel *c = calloc(1, sizeof *c);
  if (!c) return NULL;
  c->held = *held;
  *held = 0;
  c->source = *source;
  *source = (api_live){0};
  c->start_ns = now;
  c->base = c->source.first;
  if (c->source.has_start) begin_at_start(c, now);
  channel **place = &live->channels; /* append: find_channel prefers the oldest */
  while (*place) place = &(*place)->next;
  *place = c;
  return c;
}

static channel *find_channel(const srv_live *live, const api_live *source, uint64_t now, int64_t *lag) {
  for (channel *c = live->channels; c; c = c->next)
    if (can_share(c, source, now, lag)) return c;
  *lag = 0;
  return NULL;
}

static void link_listener(channel *c, srv_listener *l) {
  l->channel = c;
  l->next = c->listeners;
  if (l->next) l->next->previous = l;
  c->listeners = l;
  c->due_ns = 0; /* the listener's first frame is due now */
}

/* Lets the listener join the channel; now: what find_channel was given. */
static void enter(srv_live *live, srv_listener *l, channel *c, uint64_t first, bool joins, uint64_t now) {
  uint64_t present = frame_at(c, step_at(c, now), l->lag);
  /* A source that joins begins with the present frame. But a client that asks for the frame after it (a
   * client that reconnects) has already seen the present frame, and waits for the next. */
  bool has_seen_present = first == present + 1;
  l->first = joins && !has_seen_present ? present : first;
  l->live = live;
  l->offered_ns = now;
  link_listener(c, l);
  live->listeners++;
  pthread_cond_signal(&live->wake);
}

/* Lets the listener join a channel that it can share, or, with memory *held for it, one of its own. False
 * where there is none, or no place: *may_create tells whether memory would help. */
static bool try_join(srv_live *live, srv_listener *l, api_live *source, uint64_t *held, bool *may_create) {
  uint64_t first = source->first;
  bool joins = source->joins;
  pthread_mutex_lock(&live->lock);
  *may_create = !live->ending && live->listeners < live->max_listeners;
  uint64_t now = srv_now_ns();
  channel *c = *may_create ? find_channel(live, source, now, &l->lag) : NULL;
  if (!c && *may_create && *held > 0) c = create_channel(live, source, now, held);
  if (c) enter(live, l, c, first, joins, now);
  pthread_mutex_unlock(&live->lock);
  return c != NULL;
}

srv_listener *srv_live_join(srv_live *live, api_live *source, void (*ready)(void *owner), void *owner,
                            bool *lacks_memory) {
  srv_listener *l = calloc(1, sizeof *l);
  uint64_t held = 0;
  bool has_joined = false, may_create = false;
  if (l) {
    l->ready = ready;
    l->owner = owner;
    has_joined = try_join(live, l, source, &held, &may_create);
  }
  /* Memory is held without the lock, since it may have to be freed first. */
  if (!has_joined && may_create && api_service_hold_live(live->service, least_memory(source))) {
    held = least_memory(source);
    has_joined = try_join(live, l, source, &held, &may_create);
  }
  *lacks_memory = !has_joined && (!l || may_create);
  if (held > 0) api_service_let_go(live->service, API_HELD_LIVE, held); /* another made a channel to share */
  if (source->destroy) source->destroy(source->context);
  *source = (api_live){0};
  if (has_joined) return l;
  free(l);
  return NULL;
}

void srv_listener_leave(srv_listener *l) {
  if (!l) return;
  srv_live *live = l->live;
  pthread_mutex_lock(&live->lock);
  if (l->previous) {
    l->previous->next = l->next;
  } else {
    l->channel->listeners = l->next;
  }
  if (l->next) l->next->previous = l->previous;
  release_frame(l->pending);
  release_frame(l->current);
  live->listeners--;
  if (!l->channel->listeners) pthread_cond_signal(&live->wake);
  pthread_mutex_unlock(&live->lock);
  free(l);
}

/* ---- reading --------------------------------------------------------------------------------- */

static void send_text(srv_listener *l, const char *text) {
  l->bytes = (api_bytes){(const uint8_t *)text, strlen(text)};
}

/* Chooses what to send next. 1: it is in `bytes`; 0: nothing is due; -1: the stream has ended. */
static int take_next(srv_listener *l) {
  const api_live *source = &l->channel->source;
  release_frame(l->current);
  l->current = NULL;
  l->offset = 0;
  if (l->cut || l->closed) return -1;
  if (!l->opened) {
    l->opened = true;
    send_text(l, source->opening);
  } else if (l->pending) {
    l->current = l->pending;
    l->pending = NULL;
    l->bytes = l->current->bytes;
    l->stamp_size = source->stamp(srv_unix_ns() / 1000000, l->stamp);
    l->live->sent++;
  } else if (l->finished) {
    l->closed = true;
    send_text(l, source->closing);
  } else if (l->pulse) {
    send_text(l, source->pulse);
  } else {
    l->waiting = true;
    return 0;
  }
  l->pulse = false;
  return 1;
}

static size_t copy_bytes(srv_listener *l, uint8_t *out, size_t capacity) {
  size_t left = l->bytes.size - l->offset, size = left < capacity ? left : capacity;
  memcpy(out, l->bytes.data + l->offset, size);
  l->offset += size;
  return size;
}

int64_t srv_listener_read(srv_listener *l, uint8_t *out, size_t capacity) {
  if (l->offset == l->bytes.size && l->stamp_size == 0) {
    pthread_mutex_lock(&l->live->lock);
    int taken = take_next(l);
    pthread_mutex_unlock(&l->live->lock);
    if (taken <= 0) {
      l->bytes.size = 0;
      return taken;
    }
  }
  size_t size = copy_bytes(l, out, capacity);
  if (l->offset < l->bytes.size || l->stamp_size == 0) return (int64_t)size;
  l->bytes = (api_bytes){(const uint8_t *)l->stamp, l->stamp_size};
  l->offset = l->stamp_size = 0;
  return (int64_t)(size + copy_bytes(l, out + size, capacity - size));
}

/* ---- all of them ----------------------------------------------------------------------------- */

srv_live *srv_live_create(api_service *service, size_t max_listeners, uint64_t pulse_ns) {
  srv_live *live = calloc(1, sizeof *live);
  if (!live) return NULL;
  live->service = service;
  live->max_listeners = max_listeners;
  live->pulse_ns = pulse_ns;
  srv_timed_init(&live->wake);
  pthread_mutex_init(&live->lock, NULL);
  int reason = pthread_create(&live->thread, NULL, run, live);
  if (reason == 0) return live;
  pthread_cond_destroy(&live->wake);
  pthread_mutex_destroy(&live->lock);
  free(live);
  errno = reason;
  return NULL;
}

void srv_live_end(srv_live *live) {
  if (!live) return;
  pthread_mutex_lock(&live->lock);
  live->ending = true;
  for (channel *c = live->channels; c; c = c->next) {
    for (srv_listener *l = c->listeners; l; l = l->next) {
      l->cut = true;
      wake_listener(l);
    }
  }
  pthread_mutex_unlock(&live->lock);
}

void srv_live_destroy(srv_live *live) {
  if (!live) return;
  pthread_mutex_lock(&live->lock);
  live->stopping = true;
  pthread_cond_signal(&live->wake);
  pthread_mutex_unlock(&live->lock);
  pthread_join(live->thread, NULL);
  while (live->channels) {
    channel *c = live->channels;
    live->channels = c->next;
    destroy_channel(live, c);
  }
  pthread_cond_destroy(&live->wake);
  pthread_mutex_destroy(&live->lock);
  free(live);
}

srv_live_load srv_live_look(srv_live *live) {
  srv_live_load load = {0};
  if (!live) return load;
  pthread_mutex_lock(&live->lock);
  load = (srv_live_load){
      .listeners = live->listeners, .printed = live->printed, .sent = live->sent, .skipped = live->skipped};
  for (const channel *c = live->channels; c; c = c->next) load.channels++;
  pthread_mutex_unlock(&live->lock);
  return load;
}
