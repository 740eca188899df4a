/* Routes and statuses are few, so a short table under one lock is enough; a request that finds the table
 * full is counted under the route "other". */
#include "metrics.h"

#include <dirent.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum { COUNTERS_MAX = 256, ROUTES_MAX = 32, BUCKET_COUNT = 10 };

static const double BUCKETS_S[BUCKET_COUNT] = {0.0005, 0.001, 0.005, 0.01, 0.05, 0.1, 0.5, 1, 5, 30};

typedef struct counter {
  const char *route;
  int status;
  uint64_t requests;
} counter;

typedef struct histogram {
  const char *route;
  uint64_t buckets[BUCKET_COUNT]; /* each alone; summed up when printed */
  uint64_t requests;
  double sum_s;
} histogram;

struct srv_metrics {
  pthread_mutex_t lock;
  counter counters[COUNTERS_MAX];
  histogram histograms[ROUTES_MAX];
  size_t counter_count, histogram_count;
  uint64_t bytes_in, bytes_out;
  time_t started_s;
};

srv_metrics *srv_metrics_create(void) {
  srv_metrics *metrics = calloc(1, sizeof *metrics);
  if (metrics == NULL) return NULL;
  pthread_mutex_init(&metrics->lock, NULL);
  metrics->started_s = time(NULL);
  return metrics;
}

void srv_metrics_destroy(srv_metrics *metrics) {
  if (metrics == NULL) return;
  pthread_mutex_destroy(&metrics->lock);
  free(metrics);
}

/* Routes are mostly the same text in the same place. */
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
  while (bucket < BUCKET_COUNT && seconds > BUCKETS_S[bucket]) bucket++;
  if (bucket < BUCKET_COUNT) h->buckets[bucket]++;
  h->requests++;
  h->sum_s += seconds;
}

void srv_metrics_request(srv_metrics *metrics, const char *route, int status, double seconds,
                         uint64_t bytes_in, uint64_t bytes_out) {
  pthread_mutex_lock(&metrics->lock);
  count_status(metrics, route, status);
  count_duration(metrics, route, seconds);
  metrics->bytes_in += bytes_in;
  metrics->bytes_out += bytes_out;
  pthread_mutex_unlock(&metrics->lock);
}

static void print_family(FILE *out, const char *name, const char *type, const char *help) {
  fprintf(out, "# HELP tweend_%s %s\n# TYPE tweend_%s %s\n", name, help, name, type);
}

static void print_number(FILE *out, const char *name, const char *type, const char *help, uint64_t value) {
  print_family(out, name, type, help);
  fprintf(out, "tweend_%s %" PRIu64 "\n", name, value);
}

static void print_histogram(FILE *out, const histogram *h) {
  static const char NAME[] = "tweend_http_request_duration_seconds";
  uint64_t below = 0;
  for (size_t i = 0; i < BUCKET_COUNT; i++) {
    below += h->buckets[i];
    fprintf(out, "%s_bucket{route=\"%s\",le=\"%g\"} %" PRIu64 "\n", NAME, h->route, BUCKETS_S[i], below);
  }
  fprintf(out, "%s_bucket{route=\"%s\",le=\"+Inf\"} %" PRIu64 "\n", NAME, h->route, h->requests);
  fprintf(out, "%s_sum{route=\"%s\"} %.9g\n", NAME, h->route, h->sum_s);
  fprintf(out, "%s_count{route=\"%s\"} %" PRIu64 "\n", NAME, h->route, h->requests);
}

/* The second number of statm counts resident pages. */
static uint64_t resident_bytes(void) {
  char text[128] = "";
  FILE *file = fopen("/proc/self/statm", "re");
  if (file == NULL) return 0;
  char *line = fgets(text, sizeof text, file);
  fclose(file);
  if (line == NULL) return 0;
  char *second = text + strcspn(text, " ");
  return strtoull(second, NULL, 10) * (uint64_t)sysconf(_SC_PAGESIZE);
}

static double processor_seconds(void) {
  struct rusage usage;
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) / 1e6;
}

static uint64_t open_descriptors(void) {
  DIR *listing = opendir("/proc/self/fd");
  if (listing == NULL) return 0;
  uint64_t count = 0;
  for (struct dirent *entry = readdir(listing); entry != NULL; entry = readdir(listing)) count++;
  closedir(listing);
  return count < 3 ? 0 : count - 3; /* but ".", ".." and that of the listing */
}

static void print_of_process(FILE *out, const char *name, const char *type, const char *help, double value) {
  fprintf(out, "# HELP process_%s %s\n# TYPE process_%s %s\nprocess_%s %.15g\n", name, help, name, type, name,
          value);
}

/* By the names that Prometheus' own clients give them. */
static void print_process(FILE *out, double started_s) {
  struct rlimit limit = {0};
  getrlimit(RLIMIT_NOFILE, &limit);
  print_of_process(out, "resident_memory_bytes", "gauge", "Resident memory.", (double)resident_bytes());
  print_of_process(out, "cpu_seconds_total", "counter", "Processor time of all threads.",
                   processor_seconds());
  print_of_process(out, "open_fds", "gauge", "Open files and sockets.", (double)open_descriptors());
  print_of_process(out, "max_fds", "gauge", "How many may be open.", (double)limit.rlim_cur);
  print_of_process(out, "start_time_seconds", "gauge", "Unix time of the start.", started_s);
}

static void print_requests(FILE *out, const srv_metrics *metrics) {
  print_family(out, "http_requests_total", "counter", "Finished requests.");
  for (size_t i = 0; i < metrics->counter_count; i++) {
    const counter *c = &metrics->counters[i];
    fprintf(out, "tweend_http_requests_total{route=\"%s\",status=\"%d\"} %" PRIu64 "\n", c->route, c->status,
            c->requests);
  }
  print_family(out, "http_request_duration_seconds", "histogram",
               "From the request line to the answer's end.");
  for (size_t i = 0; i < metrics->histogram_count; i++) print_histogram(out, &metrics->histograms[i]);
  print_number(out, "http_received_bytes_total", "counter", "Bytes of request bodies.", metrics->bytes_in);
  print_number(out, "http_sent_bytes_total", "counter", "Bytes of answer bodies.", metrics->bytes_out);
}

char *srv_metrics_print(srv_metrics *metrics, const srv_gauges *gauges, size_t *size) {
  char *text = NULL;
  FILE *out = open_memstream(&text, size);
  if (out == NULL) return NULL;
  print_family(out, "build_info", "gauge", "The version as a label.");
  fputs("tweend_build_info{version=\"" TWEEND_VERSION "\"} 1\n", out);
  pthread_mutex_lock(&metrics->lock);
  print_requests(out, metrics);
  pthread_mutex_unlock(&metrics->lock);
  print_number(out, "http_connections", "gauge", "Open connections.", gauges->connections);
  print_number(out, "http_requests_in_flight", "gauge", "Requests being answered.",
               gauges->requests_in_flight);
  print_number(out, "jobs_waiting", "gauge", "Heavy requests waiting for a thread.", gauges->jobs_waiting);
  print_number(out, "jobs_running", "gauge", "Heavy requests on a thread.", gauges->jobs_running);
  print_number(out, "compute_threads", "gauge", "Threads for heavy requests.", gauges->threads);
  print_number(out, "queue_capacity", "gauge", "Heavy requests that may wait.", gauges->queue_capacity);
  print_number(out, "live_listeners", "gauge", "Open live streams.", gauges->live.listeners);
  print_number(out, "live_channels", "gauge", "What live streams share: equal frames at equal times.",
               gauges->live.channels);
  print_number(out, "live_frames_printed_total", "counter", "Frames evaluated and printed for live streams.",
               gauges->live.printed);
  print_number(out, "live_frames_sent_total", "counter", "Frames sent to listeners.", gauges->live.sent);
  print_number(out, "live_frames_skipped_total", "counter", "Frames that slow listeners did not get.",
               gauges->live.skipped);
  print_process(out, (double)metrics->started_s);
  if (fclose(out) == 0) return text;
  free(text);
  return NULL;
}
