/* Puts the parts together, and takes them apart again on a signal. */
#include "config.h"
#include "disk.h"
#include "exchange.h"
#include "healthcheck.h"
#include "http.h"
#include "listen.h"
#include "log.h"
#include "machine.h"
#include "samples.h"
#include "store_fs.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum { STATUS_FAILED = 1, STATUS_USAGE = 2, ERROR_SIZE = 512, PEM_MAX = 1 << 20 };

typedef struct process {
  srv_config config;
  srv_address address;
  char *certificate, *key; /* PEM text, NULL without TLS */
  srv_store_fs *store;
  srv_server server;
  srv_http *http;
  int listener; /* -1 once http owns it */
} process;

/* ---- preparation ----------------------------------------------------------------------------- */

/* Signals are taken by the main thread alone, when it waits for them. */
static void block_signals(sigset_t *ending) {
  sigemptyset(ending);
  sigaddset(ending, SIGTERM);
  sigaddset(ending, SIGINT);
  pthread_sigmask(SIG_BLOCK, ending, NULL);
  signal(SIGPIPE, SIG_IGN);
}

static void raise_descriptor_limit(uint64_t connections) {
  /* A connection may hold its socket and a file, a long body or a stored model; the rest is for the store and
   * the loops. */
  rlim_t wanted = (rlim_t)connections * 2 + 256;
  struct rlimit limit;
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted) return;
  limit.rlim_cur = limit.rlim_max < wanted ? limit.rlim_max : wanted;
  if (setrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur < wanted) {
    srv_log(SRV_LOG_WARN, "only %llu open files are allowed, %llu are wanted for --max-connections",
            (unsigned long long)limit.rlim_cur, (unsigned long long)wanted);
  }
}

/* NULL with one line in error. */
static char *read_pem(const char *path, char *error) {
  char *text = srv_read_text(path, PEM_MAX);
  if (text == NULL) snprintf(error, ERROR_SIZE, "cannot read '%s': %s", path, strerror(errno));
  return text;
}

static bool read_tls(process *p, char *error) {
  if (p->config.tls_cert[0] == '\0') return true;
  p->certificate = read_pem(p->config.tls_cert, error);
  p->key = p->certificate != NULL ? read_pem(p->config.tls_key, error) : NULL;
  return p->key != NULL;
}

static void share_out(void *owner, uint32_t count, void (*part)(void *context, uint32_t index),
                      void *context) {
  srv_work_share(owner, count, part, context);
}

static api_settings settings(const process *p) {
  const srv_config *config = &p->config;
  return (api_settings){.limits = {.max_upload = config->max_upload,
                                   .max_level = (uint32_t)config->max_level,
                                   .max_faces = config->max_faces,
                                   .max_output = config->max_output,
                                   .max_times = config->max_times,
                                   .plan_cache = config->plan_cache,
                                   .max_memory = config->max_memory,
                                   .max_waiting = (size_t)config->queue},
                        .store = srv_store_fs_api(p->store),
                        .crew = {p->server.work, share_out},
                        .api_keys = (const char *const *)config->api_keys,
                        .cors_origins = config->cors_origins};
}

/* False with one line in error; what was made is left to stop. */
static bool prepare(process *p, char *error) {
  snprintf(error, ERROR_SIZE, "out of memory");
  if (!read_tls(p, error)) return false;
  p->store = srv_store_fs_open(p->config.data, error, ERROR_SIZE);
  if (p->store == NULL) return false;
  p->listener = srv_address_listen(&p->address, error, ERROR_SIZE);
  if (p->listener < 0) return false;
  raise_descriptor_limit(p->config.max_connections);
  p->server.config = &p->config;
  p->server.temporary = srv_store_fs_temporary(p->store);
  p->server.metrics = srv_metrics_create();
  p->server.work = srv_work_create((size_t)p->config.threads, (size_t)p->config.queue);
  if (p->server.work == NULL) return false;
  api_settings service_settings = settings(p);
  p->server.service = api_service_create(&service_settings);
  p->server.live = srv_live_create((size_t)p->config.max_listeners, SRV_LIVE_PULSE_NS);
  return p->server.metrics != NULL && p->server.service != NULL && p->server.live != NULL;
}

static bool store_samples(process *p, char *error) {
  for (size_t i = 0; p->config.sample && i < srv_sample_count; i++) {
    int status = api_seed(p->server.service, srv_samples[i].bytes, srv_samples[i].size);
    if (status != 200 && status != 201) {
      snprintf(error, ERROR_SIZE, "sample %s cannot be stored: status %d", srv_samples[i].name, status);
      return false;
    }
    srv_log(SRV_LOG_INFO, "sample %s is stored", srv_samples[i].name);
  }
  return true;
}

static bool serve(process *p, char *error) {
  int listener = p->listener;
  p->listener = -1;
  p->http = srv_http_start(&p->server, listener, p->certificate, p->key, error, ERROR_SIZE);
  if (p->http == NULL) return false;
  char place[ERROR_SIZE];
  srv_address_print(&p->address, listener, p->certificate != NULL, place, sizeof place);
  printf("tweend %s listening on %s\n", TWEEND_VERSION, place);
  fflush(stdout);
  srv_log(SRV_LOG_INFO, "listening on %s", place);
  return true;
}

/* ---- the end --------------------------------------------------------------------------------- */

/* Waits until no request is in flight, the time is over, or a second signal says that it is. */
static void drain(process *p, const sigset_t *ending) {
  static const struct timespec STEP = {.tv_nsec = 10000000};
  atomic_store(&p->server.draining, true);
  api_service_drain(p->server.service);
  srv_live_end(p->server.live);
  srv_http_drain(p->http);
  for (uint64_t waited_ms = 0; waited_ms < p->config.drain_timeout; waited_ms += 10) {
    if (atomic_load(&p->server.in_flight) == 0) return;
    if (sigtimedwait(ending, NULL, &STEP) > 0) return;
  }
}

/* False when compute threads are still at work: then nothing may be freed. */
static bool stop(process *p) {
  atomic_store(&p->server.stopping, true);
  if (p->http != NULL && !srv_http_stop(p->http)) return false;
  srv_live_destroy(p->server.live);
  srv_work_destroy(p->server.work);
  api_service_destroy(p->server.service);
  srv_metrics_destroy(p->server.metrics);
  srv_store_fs_close(p->store);
  if (p->listener >= 0) close(p->listener);
  free(p->certificate);
  free(p->key);
  return true;
}

/* Waits for a signal, and after load gives memory back, every few seconds: threads that are idle do not. */
static int await_signal(process *p, const sigset_t *ending) {
  static const struct timespec STEP = {.tv_sec = 5};
  uint64_t trimmed_at = 0;
  for (;;) {
    int number = sigtimedwait(ending, NULL, &STEP);
    if (number > 0) return number;
    uint64_t ended = atomic_load(&p->server.ended);
    if (ended == trimmed_at) continue;
    trimmed_at = ended;
    srv_machine_trim();
  }
}

static int run(process *p) {
  char error[ERROR_SIZE];
  sigset_t ending;
  int signal_number;
  block_signals(&ending);
  srv_log_configure((srv_log_level)p->config.log_level, (srv_log_format)p->config.log_format);
  srv_log_survive();
  bool serving = prepare(p, error) && store_samples(p, error) && serve(p, error);
  if (!serving) {
    fprintf(stderr, "tweend: %s\n", error);
    stop(p);
    return STATUS_FAILED;
  }
  signal_number = await_signal(p, &ending);
  srv_log(SRV_LOG_INFO, "signal %d: draining", signal_number);
  drain(p, &ending);
  srv_address_unlink(&p->address);
  size_t left = atomic_load(&p->server.in_flight);
  if (left > 0) srv_log(SRV_LOG_WARN, "%zu requests in flight are cut off", left);
  bool freed = stop(p);
  srv_log(SRV_LOG_INFO, "stopped");
  /* The store needs no farewell: it is whole at any moment. */
  if (!freed) _exit(EXIT_SUCCESS);
  return EXIT_SUCCESS;
}

int main(int argc, char **argv) {
  static process p = {.listener = -1}; /* static: compute threads may outlive main's frame, see stop */
  char error[ERROR_SIZE];
  int status = STATUS_USAGE;
  srv_config_status read = srv_config_read(&p.config, argc, argv, getenv, stdout, error, sizeof error);
  bool usable = read == SRV_CONFIG_RUN && srv_address_parse(p.config.listen, &p.address, error, sizeof error);
  if (read == SRV_CONFIG_DONE) {
    status = EXIT_SUCCESS;
  } else if (!usable) {
    fprintf(stderr, "tweend: %s\n", error);
  } else if (p.config.healthcheck) {
    status = srv_healthcheck(&p.address, p.config.tls_cert[0] != '\0') ? EXIT_SUCCESS : STATUS_FAILED;
  } else {
    status = run(&p);
  }
  srv_config_deinit(&p.config);
  return status;
}
