/* There are few routes and statuses, so a short table under one lock is enough; once it is full, a request of
 * a new route or status is not counted in it. All other counters are arrays indexed by an enum. */
#include "metrics.h"

#include "machine.h"

#include <dirent.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum { COUNTERS_MAX = 256, ROUTES_MAX = 32, BUCKET_COUNT = 10 };

static const double buckets_s[BUCKET_COUNT] = {0.0005, 0.001, 0.005, 0.01, 0.05, 0.1, 0.5, 1, 5, 30};

typedef struct counter {
  const char *route;
  int status;
  uint64_t requests;
} counter;

typedef struct histogram {
  const char *route;
  uint64_t buckets[BUCKET_COUNT]; /* not cumulative; summed when printed */
  uint64_t requests;
  double sum_s;
} histogram;

typedef enum store_operation {
  STORE_PUT,
  STORE_OPEN,
  STORE_LOOK,
  STORE_REMOVE,
  STORE_SUMMARY,
  STORE_LIST,
  STORE_COUNT
} store_operation;

/* Counters of one kind of store operation. */
typedef struct operations {
  atomic_uint_fast64_t count, failed, ns;
} operations;

struct srv_metrics {
  atomic_uint_fast64_t refusals[SRV_REFUSAL_COUNT];
  api_store store; /* the store whose operations are counted */
  operations operations[STORE_COUNT];
  pthread_mutex_t lock; /* guards the members below */
  counter counters[COUNTERS_MAX];
  histogram histograms[ROUTES_MAX];
  size_t counter_count, histogram_count;
  uint64_t aborted, bytes_in, bytes_out;
  time_t started_s;
};

srv_metrics *srv_metrics_create(void) {
  srv_metrics *metrics = calloc(1, sizeof *metrics);
  if (!metrics) return NULL;
  pthread_mutex_init(&metrics->lock, NULL);
  metrics->started_s = time(NULL);
  return metrics;
}

void srv_metrics_destroy(srv_metrics *metrics) {
  if (!metrics) return;
  pthread_mutex_destroy(&metrics->lock);
  free(metrics);
}

/* Compares pointers first: most routes are the same string constant. */
static bool is_same(const char *route, const char *other) {
  return route == other || strcmp(route, other) == 0;
}

static void count_status(srv_metrics *metrics, const char *route, int status) {
  size_t at = 0;
  while (at < metrics->counter_count &&
         (metrics->counters[at].status != status || !is_same(metrics->counters[at].route, route))) {
    at++;
  }
  if (at == COUNTERS_MAX) return;
  if (at == metrics->counter_count) {
    metrics->counter_count++;
    metrics->counters[at] = (counter){.route = route, .status = status};
  }
  metrics->counters[at].requests++;
}

static void count_duration(srv_metrics *metrics, const char *route, double seconds) {
  size_t at = 0;
  while (at < metrics->histogram_count && !is_same(metrics->histograms[at].route, route)) at++;
  if (at == ROUTES_MAX) return;
  histogram *h = &metrics->histograms[at];
  if (at == metrics->histogram_count) {
    metrics->histogram_count++;
    *h = (histogram){.route = route};
  }
  size_t bucket = 0;
  while (bucket < BUCKET_COUNT && seconds > buckets_s[bucket]) bucket++;
  if (bucket < BUCKET_COUNT) h->buckets[bucket]++;
  h->requests++;
  h->sum_s += seconds;
}

void srv_metrics_request(srv_metrics *metrics, const srv_log_request *request) {
  pthread_mutex_lock(&metrics->lock);
  count_status(metrics, request->route, request->status);
  count_duration(metrics, request->route, request->total_ms / 1e3);
  metrics->aborted += request->aborted;
  metrics->bytes_in += request->bytes_in;
  metrics->bytes_out += request->bytes_out;
  pthread_mutex_unlock(&metrics->lock);
}

void srv_metrics_refusal(srv_metrics *metrics, unsigned reason) {
  if (reason != API_REFUSAL_NONE) atomic_fetch_add(&metrics->refusals[reason], 1);
}

/* ---- the store ------------------------------------------------------------------------------- */

/* Counts an operation and returns its status. An absent object is no error of the store. */
static api_store_status count_operation(srv_metrics *metrics, store_operation operation, uint64_t began_ns,
                                        api_store_status status) {
  operations *of = &metrics->operations[operation];
  bool has_failed =
      status == API_STORE_DAMAGED || status == API_STORE_UNAVAILABLE || status == API_STORE_FULL;
  atomic_fetch_add(&of->count, 1);
  atomic_fetch_add(&of->failed, has_failed);
  atomic_fetch_add(&of->ns, srv_now_ns() - began_ns);
  return status;
}

static api_store_status put(void *context, const char *id, api_bytes bytes, const char *summary,
                            bool *existed) {
  srv_metrics *metrics = context;
  uint64_t began_ns = srv_now_ns();
  return count_operation(metrics, STORE_PUT, began_ns,
                         metrics->store.put(metrics->store.context, id, bytes, summary, existed));
}

static api_store_status open_object(void *context, const char *id, api_blob *out) {
  srv_metrics *metrics = context;
  uint64_t began_ns = srv_now_ns();
  return count_operation(metrics, STORE_OPEN, began_ns, metrics->store.open(metrics->store.context, id, out));
}

/* A look that may not wait only recalls an earlier result, so it is not counted. */
static api_store_status look(void *context, const char *id, bool may_wait) {
  srv_metrics *metrics = context;
  uint64_t began_ns = may_wait ? srv_now_ns() : 0;
  api_store_status status = metrics->store.look(metrics->store.context, id, may_wait);
  return may_wait ? count_operation(metrics, STORE_LOOK, began_ns, status) : status;
}

static api_store_status drop(void *context, const char *id) {
  srv_metrics *metrics = context;
  uint64_t began_ns = srv_now_ns();
  return count_operation(metrics, STORE_REMOVE, began_ns, metrics->store.remove(metrics->store.context, id));
}

static char *summary_of(void *context, const char *id) {
  srv_metrics *metrics = context;
  uint64_t began_ns = srv_now_ns();
  char *summary = metrics->store.summary(metrics->store.context, id);
  count_operation(metrics, STORE_SUMMARY, began_ns, API_STORE_OK);
  return summary;
}

static api_store_status list(void *context, const char *after, size_t limit, api_listed *out, size_t *count,
                             bool *more) {
  srv_metrics *metrics = context;
  uint64_t began_ns = srv_now_ns();
  return count_operation(metrics, STORE_LIST, began_ns,
                         metrics->store.list(metrics->store.context, after, limit, out, count, more));
}

/* Not counted: a probe only returns what the store's own thread has found. */
static api_store_status probe(void *context) {
  srv_metrics *metrics = context;
  return metrics->store.probe(metrics->store.context);
}

/* Not counted: it stores nothing. */
static api_store_status room(void *context, uint64_t size) {
  srv_metrics *metrics = context;
  return metrics->store.room ? metrics->store.room(metrics->store.context, size) : API_STORE_OK;
}

api_store srv_metrics_of_store(srv_metrics *metrics, const api_store *store) {
  metrics->store = *store;
  return (api_store){.context = metrics,
                     .put = put,
                     .open = open_object,
                     .look = look,
                     .remove = drop,
                     .summary = summary_of,
                     .list = list,
                     .probe = probe,
                     .room = room};
}

/* ---- printing -------------------------------------------------------------------------------- */

/* A name that ends in "_total" is a counter, any other a gauge. */
static void print_family(FILE *out, const char *name, const char *help) {
  size_t end = strlen("_total"), size = strlen(name);
  bool is_counter = size > end && strcmp(name + size - end, "_total") == 0;
  fprintf(out, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, is_counter ? "counter" : "gauge");
}

static void print_number(FILE *out, const char *name, const char *help, uint64_t value) {
  print_family(out, name, help);
  fprintf(out, "%s %" PRIu64 "\n", name, value);
}

/* Prints one sample of a family with a label. */
static void print_labelled(FILE *out, const char *name, const char *label, const char *value, double number) {
  fprintf(out, "%s{%s=\"%s\"} %.15g\n", name, label, value, number);
}

static const char *const refusal_names[SRV_REFUSAL_COUNT] = {
    [API_REFUSAL_ACCESS] = "access",
    [API_REFUSAL_BODY] = "body",
    [API_REFUSAL_MEMORY] = "memory",
    [API_REFUSAL_STORE] = "store",
    [API_REFUSAL_STORE_FULL] = "store_full",
    [SRV_REFUSAL_RATE] = "rate",
    [SRV_REFUSAL_KEY_RATE] = "key_rate",
    [SRV_REFUSAL_CONNECTIONS] = "connections",
    [SRV_REFUSAL_ADDRESS_CONNECTIONS] = "address_connections",
    [SRV_REFUSAL_FRAMING] = "framing",
    [SRV_REFUSAL_SLOW] = "slow",
    [SRV_REFUSAL_ROOM] = "room",
    [SRV_REFUSAL_SPOOL] = "spool",
    [SRV_REFUSAL_QUEUE] = "queue",
    [SRV_REFUSAL_WAIT] = "wait",
    [SRV_REFUSAL_COMPUTE_TIMEOUT] = "compute_timeout",
    [SRV_REFUSAL_LISTENERS] = "listeners",
    [SRV_REFUSAL_DRAIN] = "drain",
};

static void print_refusals(FILE *out, srv_metrics *metrics) {
  static const char metric[] = "tweend_refusals_total";
  print_family(out, metric, "Requests and connections that were turned away, by reason.");
  for (size_t i = API_REFUSAL_NONE + 1; i < SRV_REFUSAL_COUNT; i++)
    print_labelled(out, metric, "reason", refusal_names[i], (double)atomic_load(&metrics->refusals[i]));
}

static const char *const operation_names[STORE_COUNT] = {
    [STORE_PUT] = "put",       [STORE_OPEN] = "open",       [STORE_LOOK] = "look",
    [STORE_REMOVE] = "remove", [STORE_SUMMARY] = "summary", [STORE_LIST] = "list",
};

static void print_bucket(FILE *out, const srv_store_s3_load *bucket) {
  print_number(out, "tweend_store_up", "1 while the object store can be reached, as far as is known.",
               bucket->is_reachable);
  print_number(out, "tweend_store_retries_total", "Requests to it that were tried again.", bucket->retries);
  print_number(out, "tweend_store_cache_bytes", "Disk that copies of models take.", bucket->cache.bytes);
  print_number(out, "tweend_store_cache_limit_bytes", "--cache-size.", bucket->cache.limit);
  print_number(out, "tweend_store_cache_hits_total", "Models read from a copy.", bucket->cache.hits);
  print_number(out, "tweend_store_cache_misses_total", "Models read without one.", bucket->cache.misses);
}

static void print_store(FILE *out, srv_metrics *metrics, const srv_config *config, const srv_gauges *gauges) {
  static const char total_metric[] = "tweend_store_operations_total",
                    error_metric[] = "tweend_store_errors_total", seconds[] = "tweend_store_seconds_total";
  print_family(out, total_metric, "Operations of the store.");
  for (size_t i = 0; i < STORE_COUNT; i++)
    print_labelled(out, total_metric, "operation", operation_names[i],
                   (double)atomic_load(&metrics->operations[i].count));
  print_family(out, error_metric, "Those that failed: not reached, full, or damaged.");
  for (size_t i = 0; i < STORE_COUNT; i++)
    print_labelled(out, error_metric, "operation", operation_names[i],
                   (double)atomic_load(&metrics->operations[i].failed));
  print_family(out, seconds, "What they took.");
  for (size_t i = 0; i < STORE_COUNT; i++)
    print_labelled(out, seconds, "operation", operation_names[i],
                   (double)atomic_load(&metrics->operations[i].ns) / 1e9);
  if (gauges->bucket) print_bucket(out, gauges->bucket);
  if (config->store_limit == 0) return;
  print_number(out, "tweend_store_bytes", "Bytes of stored models, as last counted.", gauges->store_bytes);
  print_number(out, "tweend_store_limit_bytes", "--store-limit.", config->store_limit);
}

static const char *const cached_names[API_CACHED_COUNT] = {
    [API_CACHED_MODEL] = "model",
    [API_CACHED_PLAN] = "plan",
    [API_CACHED_CLIP] = "clip",
    [API_CACHED_ANSWER] = "answer",
};

static void print_cache(FILE *out, const api_usage *usage) {
  static const char hit_metric[] = "tweend_cache_hits_total", miss_metric[] = "tweend_cache_misses_total",
                    evictions[] = "tweend_cache_evictions_total";
  print_family(out, hit_metric, "Values that were there when a request looked for them.");
  for (size_t i = 0; i < API_CACHED_COUNT; i++)
    print_labelled(out, hit_metric, "kind", cached_names[i], (double)usage->cached[i].hits);
  print_family(out, miss_metric, "Values that had to be made.");
  for (size_t i = 0; i < API_CACHED_COUNT; i++)
    print_labelled(out, miss_metric, "kind", cached_names[i], (double)usage->cached[i].misses);
  print_family(out, evictions, "Values that went to make room.");
  for (size_t i = 0; i < API_CACHED_COUNT; i++)
    print_labelled(out, evictions, "kind", cached_names[i], (double)usage->cached[i].evictions);
}

static void print_memory(FILE *out, const srv_config *config, const api_usage *usage) {
  static const char metric[] = "tweend_memory_bytes";
  static const char *const holder_names[API_HELD_COUNT] = {[API_HELD_CONNECTION] = "connection",
                                                           [API_HELD_BODY] = "body",
                                                           [API_HELD_BLOCK] = "block",
                                                           [API_HELD_LIVE] = "live"};
  print_family(out, metric, "What counts against --max-memory.");
  for (size_t i = 0; i < API_CACHED_COUNT; i++)
    print_labelled(out, metric, "kind", cached_names[i], (double)usage->cached[i].bytes);
  for (size_t i = 0; i < API_HELD_COUNT; i++)
    print_labelled(out, metric, "kind", holder_names[i], (double)usage->held[i]);
  print_labelled(out, metric, "kind", "request", (double)usage->granted);
  print_number(out, "tweend_memory_limit_bytes", "--max-memory.", config->max_memory);
}

static const char duration_metric[] = "tweend_http_request_duration_seconds";

static void print_histogram(FILE *out, const histogram *h) {
  uint64_t below = 0;
  for (size_t i = 0; i < BUCKET_COUNT; i++) {
    below += h->buckets[i];
    fprintf(out, "%s_bucket{route=\"%s\",le=\"%g\"} %" PRIu64 "\n", duration_metric, h->route, buckets_s[i],
            below);
  }
  fprintf(out, "%s_bucket{route=\"%s\",le=\"+Inf\"} %" PRIu64 "\n", duration_metric, h->route, h->requests);
  fprintf(out, "%s_sum{route=\"%s\"} %.9g\n", duration_metric, h->route, h->sum_s);
  fprintf(out, "%s_count{route=\"%s\"} %" PRIu64 "\n", duration_metric, h->route, h->requests);
}

/* The second number in /proc/self/statm is the count of resident pages. */
static uint64_t resident_bytes(void) {
  char text[128] = "";
  FILE *file = fopen("/proc/self/statm", "re");
  if (!file) return 0;
  char *line = fgets(text, sizeof text, file);
  fclose(file);
  if (!line) return 0;
  char *second = text + strcspn(text, " ");
  return strtoull(second, NULL, 10) * (uint64_t)sysconf(_SC_PAGESIZE);
}

static double processor_seconds(void) {
  struct rusage usage;
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) / 1e6;
}

/* Counts the entries of a folder except "." and ".."; 0 when it cannot be listed. */
static uint64_t count_entries(const char *folder) {
  DIR *listing = opendir(folder);
  if (!listing) return 0;
  uint64_t count = 0;
  for (struct dirent *entry = readdir(listing); entry; entry = readdir(listing)) count++;
  closedir(listing);
  return count < 2 ? 0 : count - 2;
}

/* Uses the names of Prometheus' own client libraries. Leaves out what /proc does not tell while this process
 * may open no more files. */
static void print_process(FILE *out, time_t started_s) {
  struct rlimit limit = {0};
  getrlimit(RLIMIT_NOFILE, &limit);
  uint64_t resident = resident_bytes(), files = count_entries("/proc/self/fd");
  uint64_t threads = count_entries("/proc/self/task");
  if (resident > 0) print_number(out, "process_resident_memory_bytes", "Resident memory.", resident);
  print_family(out, "process_cpu_seconds_total", "Processor time of all threads.");
  fprintf(out, "process_cpu_seconds_total %.15g\n", processor_seconds());
  if (files > 0) /* one of them is the descriptor of the listing */
    print_number(out, "process_open_fds", "Open files and sockets.", files - 1);
  print_number(out, "process_max_fds", "How many may be open.", limit.rlim_cur);
  if (threads > 0) print_number(out, "process_threads", "Threads.", threads);
  print_number(out, "process_start_time_seconds", "Unix time of the start.", (uint64_t)started_s);
}

static void print_requests(FILE *out, const srv_metrics *metrics) {
  print_family(out, "tweend_http_requests_total", "Finished requests.");
  for (size_t i = 0; i < metrics->counter_count; i++) {
    const counter *c = &metrics->counters[i];
    fprintf(out, "tweend_http_requests_total{route=\"%s\",status=\"%d\"} %" PRIu64 "\n", c->route, c->status,
            c->requests);
  }
  fprintf(out, "# HELP %s From the request line to the answer's end.\n# TYPE %s histogram\n", duration_metric,
          duration_metric);
  for (size_t i = 0; i < metrics->histogram_count; i++) print_histogram(out, &metrics->histograms[i]);
  print_number(out, "tweend_http_aborted_total", "Requests whose answer was not delivered completely.",
               metrics->aborted);
  print_number(out, "tweend_http_received_bytes_total", "Bytes of request bodies.", metrics->bytes_in);
  print_number(out, "tweend_http_sent_bytes_total", "Bytes of answer bodies.", metrics->bytes_out);
}

static void print_load(FILE *out, const srv_config *config, const srv_gauges *gauges) {
  print_number(out, "tweend_http_connections", "Open connections.", gauges->connections);
  print_number(out, "tweend_http_connections_limit", "--max-connections.", config->max_connections);
  print_number(out, "tweend_http_requests_in_flight", "Requests being answered.", gauges->requests_in_flight);
  print_number(out, "tweend_spool_bytes", "Bytes on disk of request bodies under way, announced ones too.",
               gauges->spool_bytes);
  if (config->spool_limit > 0)
    print_number(out, "tweend_spool_limit_bytes", "--spool-limit.", config->spool_limit);
  print_number(out, "tweend_io_threads", "Socket threads.", config->io_threads);
  print_number(out, "tweend_compute_threads", "Threads for heavy requests.", config->threads);
  print_number(out, "tweend_compute_threads_busy", "Those at work.", gauges->threads_busy);
  print_number(out, "tweend_jobs_waiting", "Heavy requests waiting for a thread.", gauges->jobs_waiting);
  print_number(out, "tweend_queue_capacity", "Heavy requests that may wait.", config->queue);
  print_number(out, "tweend_faces_computed_total", "Faces of surfaces, as far as answers were read.",
               gauges->usage.faces);
  print_number(out, "tweend_joint_times_computed_total", "Nodes of poses and live frames, each at one time.",
               gauges->usage.joint_times);
}

static void print_live(FILE *out, const srv_live_load *live, uint64_t limit) {
  print_number(out, "tweend_live_listeners", "Open live streams.", live->listeners);
  print_number(out, "tweend_live_listeners_limit", "--max-listeners.", limit);
  print_number(out, "tweend_live_channels", "What live streams share: equal frames at equal times.",
               live->channels);
  print_number(out, "tweend_live_frames_printed_total", "Frames evaluated and printed for live streams.",
               live->printed);
  print_number(out, "tweend_live_frames_sent_total", "Frames sent to listeners.", live->sent);
  print_number(out, "tweend_live_frames_skipped_total", "Frames that slow listeners did not get.",
               live->skipped);
}

char *srv_metrics_print(srv_metrics *metrics, const srv_config *config, const srv_gauges *gauges,
                        size_t *size) {
  char *text = NULL;
  FILE *out = open_memstream(&text, size);
  if (!out) return NULL;
  print_family(out, "tweend_build_info", "The version as a label.");
  fputs("tweend_build_info{version=\"" TWEEND_VERSION "\"} 1\n", out);
  pthread_mutex_lock(&metrics->lock);
  print_requests(out, metrics);
  pthread_mutex_unlock(&metrics->lock);
  print_refusals(out, metrics);
  print_load(out, config, gauges);
  print_live(out, &gauges->live, config->max_listeners);
  print_cache(out, &gauges->usage);
  print_memory(out, config, &gauges->usage);
  print_store(out, metrics, config, gauges);
  print_process(out, metrics->started_s);
  if (fclose(out) == 0) return text;
  free(text);
  return NULL;
}
