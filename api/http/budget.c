/* One lock, one sum, one queue in order of arrival. Entries are freed and tickets are woken without the
 * lock. */
#include "budget.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

/* Requests of up to a size, for a limit of at least 128 MiB the greater one, may use the last sixteenth of
 * the budget too, so that they are served while large requests fill the rest: to read a document of some
 * kilobytes takes up to some megabytes. */
static const uint64_t SMALL_LEAST = 1 << 20, SMALL_MOST = 4 << 20;

struct api_budget {
  pthread_mutex_t lock;
  uint64_t limit, small, small_granted; /* small_granted: of the tickets whose grants are small */
  atomic_uint_fast64_t used, granted;   /* granted is part of used */
  atomic_size_t waiting;
  size_t waiting_max, computing; /* computing: tickets with a grant whose answer is not finished */
  api_ticket *first, *last;      /* the queue of waiting tickets */
  bool is_serving;               /* a thread runs serve_waiting */
  bool is_poked;                 /* memory may have become idle since that thread last relieved */
  uint64_t (*relieve)(void *context, uint64_t bytes);
  void *relieve_context;
};

api_budget *api_budget_create(uint64_t limit, size_t waiting_max) {
  api_budget *budget = calloc(1, sizeof *budget);
  if (!budget) return NULL;
  if (pthread_mutex_init(&budget->lock, NULL) != 0) {
    free(budget);
    return NULL;
  }
  budget->limit = limit;
  budget->small = limit / 32 < SMALL_LEAST ? SMALL_LEAST : limit / 32 > SMALL_MOST ? SMALL_MOST : limit / 32;
  if (budget->small > limit / 16) budget->small = limit / 16;
  budget->waiting_max = waiting_max;
  return budget;
}

void api_budget_destroy(api_budget *budget) {
  if (!budget) return;
  pthread_mutex_destroy(&budget->lock);
  free(budget);
}

void api_budget_relieved_by(api_budget *budget, uint64_t (*relieve)(void *context, uint64_t bytes),
                            void *context) {
  budget->relieve = relieve;
  budget->relieve_context = context;
}

uint64_t api_budget_most(uint64_t limit) {
  return limit - limit / 16;
}

uint64_t api_budget_used(api_budget *budget) {
  return atomic_load(&budget->used);
}

uint64_t api_budget_granted(api_budget *budget) {
  return atomic_load(&budget->granted);
}

/* ---- grants; under the lock ------------------------------------------------------------------ */

/* Whether a grant is one of a few small ones. They are made whatever others hold: a request counts twice
 * while a model that it has read is in the cache too. */
static bool is_small_enough(const api_budget *budget, const api_ticket *ticket, uint64_t bytes) {
  uint64_t own = ticket->granted <= budget->small ? ticket->granted : 0;
  return bytes <= budget->small && budget->small_granted - own + bytes <= budget->limit / 32;
}

/* What grants of that size may fill: the last sixteenth is for small ones. */
static uint64_t limit_for(const api_budget *budget, uint64_t bytes) {
  return bytes <= budget->small ? budget->limit : api_budget_most(budget->limit);
}

/* By how many bytes raising a grant to `bytes` exceeds the limit. */
static uint64_t shortage(const api_budget *budget, const api_ticket *ticket, uint64_t bytes) {
  uint64_t limit = limit_for(budget, bytes);
  if (is_small_enough(budget, ticket, bytes)) return 0;
  uint64_t used = atomic_load(&budget->used), more = bytes - ticket->granted;
  if (used >= limit) return used - limit + more;
  return more > limit - used ? more - (limit - used) : 0;
}

static bool computes(const api_ticket *ticket) {
  return ticket->granted > 0 && !ticket->is_answered;
}

/* Whether no other request computes, and the answers being read, which may take very long, hold nothing or
 * leave at least seven eighths of the budget. Such a request may have all that is left for its size. */
static bool is_alone(const api_budget *budget, const api_ticket *ticket) {
  uint64_t others = atomic_load(&budget->granted) - ticket->granted,
           used = atomic_load(&budget->used) - ticket->granted;
  return budget->computing == (computes(ticket) ? 1 : 0) && (others == 0 || used <= budget->limit / 8);
}

static void set_grant(api_budget *budget, api_ticket *ticket, uint64_t bytes, bool is_answered) {
  bool did_compute = computes(ticket);
  ticket->is_answered = is_answered;
  budget->computing += (size_t)(bytes > 0 && !is_answered) - (size_t)did_compute;
  if (ticket->granted <= budget->small) budget->small_granted -= ticket->granted;
  if (bytes <= budget->small) budget->small_granted += bytes;
  atomic_fetch_add(&budget->used, bytes - ticket->granted);
  atomic_fetch_add(&budget->granted, bytes - ticket->granted);
  ticket->granted = bytes;
}

/* Sets the grant to `bytes`, or, for a request that is alone, to as many of them as are left. */
static void set_fitting(api_budget *budget, api_ticket *ticket, uint64_t bytes) {
  uint64_t others = atomic_load(&budget->used) - ticket->granted, limit = limit_for(budget, bytes),
           left = limit > others ? limit - others : 0;
  if (is_small_enough(budget, ticket, bytes)) left = bytes;
  if (bytes > left) bytes = left > ticket->granted ? left : ticket->granted;
  set_grant(budget, ticket, bytes, false);
}

static void link_last(api_budget *budget, api_ticket *ticket) {
  ticket->previous = budget->last;
  ticket->next = NULL;
  *(budget->last ? &budget->last->next : &budget->first) = ticket;
  budget->last = ticket;
  ticket->is_waiting_for_memory = true;
  atomic_fetch_add(&budget->waiting, 1);
}

static void unlink_ticket(api_budget *budget, api_ticket *ticket) {
  *(ticket->previous ? &ticket->previous->next : &budget->first) = ticket->next;
  *(ticket->next ? &ticket->next->previous : &budget->last) = ticket->previous;
  ticket->previous = ticket->next = NULL;
  ticket->is_waiting_for_memory = false;
  atomic_fetch_sub(&budget->waiting, 1);
}

/* Frees idle memory, releasing the lock meanwhile. False when there was none. */
static bool relieve(api_budget *budget, uint64_t bytes) {
  if (!budget->relieve) return false;
  pthread_mutex_unlock(&budget->lock);
  uint64_t freed = budget->relieve(budget->relieve_context, bytes);
  pthread_mutex_lock(&budget->lock);
  return freed > 0;
}

/* The waiting ticket to grant next, NULL where none fits. A ticket behind the first may pass it if it needs
 * no more than what is small, or if nobody computes: then the first waits for clients to read their answers,
 * which may take very long. */
static api_ticket *find_next(const api_budget *budget) {
  for (api_ticket *ticket = budget->first; ticket; ticket = ticket->next) {
    bool has_turn = ticket == budget->first || ticket->needed <= budget->small || budget->computing == 0;
    if (has_turn && (shortage(budget, ticket, ticket->needed) == 0 || is_alone(budget, ticket)))
      return ticket;
  }
  return NULL;
}

/* Raises the grant if it fits. A grant that grows beyond small queues behind waiting tickets, unless these
 * wait only for clients to read. */
static bool raise_grant(api_budget *budget, api_ticket *ticket, uint64_t bytes) {
  uint64_t missing;
  bool others_wait = budget->first && (budget->computing > 0 || find_next(budget));
  if (others_wait && bytes > budget->small && ticket->granted <= budget->small) return false;
  while ((missing = shortage(budget, ticket, bytes)) > 0)
    if (!relieve(budget, missing)) break;
  if (missing > 0 && !is_alone(budget, ticket)) return false;
  set_fitting(budget, ticket, bytes);
  return true;
}

/* ---- waiting --------------------------------------------------------------------------------- */

/* Grants memory to waiting tickets and wakes them, as long as any fits. Freeing entries calls this function
 * again, so only one thread at a time runs the loop; others set is_poked, and the loop looks again. */
static void serve_waiting(api_budget *budget) {
  pthread_mutex_lock(&budget->lock);
  budget->is_poked = true;
  if (budget->is_serving) {
    pthread_mutex_unlock(&budget->lock);
    return;
  }
  budget->is_serving = true;
  while (budget->first) {
    api_ticket *ticket = find_next(budget);
    if (!ticket && !budget->is_poked) break;
    if (!ticket) {
      budget->is_poked = false; /* cleared first: an entry that becomes idle meanwhile sets it again */
      relieve(budget, shortage(budget, budget->first, budget->first->needed));
      continue;
    }
    set_fitting(budget, ticket, ticket->needed);
    unlink_ticket(budget, ticket);
    pthread_mutex_unlock(&budget->lock);
    ticket->wake(ticket);
    pthread_mutex_lock(&budget->lock);
  }
  budget->is_serving = false;
  pthread_mutex_unlock(&budget->lock);
}

void api_budget_poke(api_budget *budget) {
  if (atomic_load(&budget->waiting) > 0) serve_waiting(budget);
}

void api_budget_add(api_budget *budget, uint64_t bytes) {
  atomic_fetch_add(&budget->used, bytes);
}

void api_budget_subtract(api_budget *budget, uint64_t bytes) {
  atomic_fetch_sub(&budget->used, bytes);
  api_budget_poke(budget);
}

bool api_budget_try_add(api_budget *budget, uint64_t bytes) {
  pthread_mutex_lock(&budget->lock);
  uint64_t limit = api_budget_most(budget->limit);
  bool fits = !budget->first && atomic_load(&budget->used) + bytes <= limit;
  if (fits) atomic_fetch_add(&budget->used, bytes);
  pthread_mutex_unlock(&budget->lock);
  return fits;
}

bool api_budget_add_evicting(api_budget *budget, uint64_t bytes) {
  uint64_t limit = api_budget_most(budget->limit);
  pthread_mutex_lock(&budget->lock);
  bool has_turn = !budget->first || bytes <= budget->small;
  while (has_turn && atomic_load(&budget->used) + bytes > limit)
    if (!relieve(budget, atomic_load(&budget->used) + bytes - limit)) break;
  bool fits = has_turn && atomic_load(&budget->used) + bytes <= limit;
  if (fits) atomic_fetch_add(&budget->used, bytes);
  pthread_mutex_unlock(&budget->lock);
  return fits;
}

bool api_budget_grant(api_budget *budget, api_ticket *ticket, uint64_t bytes) {
  if (bytes == ticket->granted) return true;
  bool is_less = bytes < ticket->granted, is_granted = true;
  pthread_mutex_lock(&budget->lock);
  if (is_less)
    set_grant(budget, ticket, bytes, false);
  else
    is_granted = raise_grant(budget, ticket, bytes);
  pthread_mutex_unlock(&budget->lock);
  if (is_less) api_budget_poke(budget);
  return is_granted;
}

bool api_budget_retain(api_budget *budget, api_ticket *ticket, uint64_t bytes) {
  if (!api_budget_grant(budget, ticket, bytes)) return false;
  pthread_mutex_lock(&budget->lock);
  set_grant(budget, ticket, bytes < ticket->granted ? bytes : ticket->granted, true);
  pthread_mutex_unlock(&budget->lock);
  api_budget_poke(budget); /* the queue's first may be alone now */
  return true;
}

api_wait api_budget_wait(api_budget *budget, api_ticket *ticket, uint64_t bytes) {
  pthread_mutex_lock(&budget->lock);
  if (ticket->granted > 0)
    set_grant(budget, ticket, 0, false); /* tickets that wait while they hold grants could deadlock */
  api_wait result = API_WAIT_BEGUN;
  if (raise_grant(budget, ticket, bytes))
    result = API_WAIT_OVER;
  else if (atomic_load(&budget->waiting) >= budget->waiting_max)
    result = API_WAIT_CROWDED;
  ticket->needed = bytes;
  if (result == API_WAIT_BEGUN) link_last(budget, ticket);
  pthread_mutex_unlock(&budget->lock);
  /* Earlier tickets may fit into the grant just released; and memory freed before this ticket was queued has
   * not woken it. */
  if (result != API_WAIT_OVER) api_budget_poke(budget);
  return result;
}

bool api_budget_cancel(api_budget *budget, api_ticket *ticket) {
  pthread_mutex_lock(&budget->lock);
  bool waited = ticket->is_waiting_for_memory;
  if (waited) unlink_ticket(budget, ticket);
  pthread_mutex_unlock(&budget->lock);
  if (waited) api_budget_poke(budget); /* tickets behind it may fit */
  return waited;
}
