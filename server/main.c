/* Starts the parts of the daemon, reloads settings on SIGHUP, and drains and stops on the ending signals. */
#include "compute_limit.h"
#include "config.h"
#include "exchange.h"
#include "healthcheck.h"
#include "http.h"
#include "keyring.h"
#include "listen.h"
#include "log.h"
#include "machine.h"
#include "page.h"
#include "samples.h"
#include "store_fs.h"
#include "store_s3.h"
#include "systemd.h"
#include "tls.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum { STATUS_FAILED = 1, STATUS_USAGE = 2, PLACE_SIZE = 512 };

enum { BODIES_PART = 8 }; /* of --max-memory, for bodies in memory */

typedef struct process {
  srv_config config;
  srv_error error; /* why the daemon does not start */
  srv_address address, admin_address;
  srv_store_fs *folder;
  srv_store_s3 *bucket; /* NULL: models are stored in `folder` */
  srv_server server;
  srv_systemd systemd;
  uint64_t notified_ms;                     /* when the watchdog was last notified */
  srv_http *http, *admin;                   /* admin: NULL without an admin listener */
  srv_listeners listeners, admin_listeners; /* count 0 once http and admin own the sockets */
} process;

/* ---- signals --------------------------------------------------------------------------------- */

static bool is_ending_signal(int number) {
  return number == SIGTERM || number == SIGINT || number == SIGQUIT;
}

/* Blocks all signals in this thread and in those that it will start, so that only the main thread receives
 * them, when it waits for one, and none ends the process by default. Left unblocked: faults, which belong to
 * the thread that caused them; the signals of job control; and those that are ignored by default. */
static void block_signals(sigset_t *taken) {
  static const int other_signals[] = {SIGSEGV, SIGBUS,  SIGFPE,  SIGILL,  SIGABRT, SIGTRAP, SIGSYS,  SIGPIPE,
                                      SIGTSTP, SIGTTIN, SIGTTOU, SIGCONT, SIGCHLD, SIGURG,  SIGWINCH};
  sigfillset(taken);
  for (size_t i = 0; i < sizeof other_signals / sizeof *other_signals; i++)
    sigdelset(taken, other_signals[i]);
  pthread_sigmask(SIG_BLOCK, taken, NULL);
  signal(SIGPIPE, SIG_IGN);
}

/* ---- preparation ----------------------------------------------------------------------------- */

/* Requests that may compute for long beside those that --threads counts, so that short ones need not wait for
 * them; no more than may wait. */
static size_t long_jobs(const srv_config *config) {
  enum { MOST = 8 };
  return config->queue < MOST ? (size_t)config->queue : MOST;
}

static void raise_descriptor_limit(uint64_t connections) {
  /* A connection may hold two descriptors: its socket, and the file of a long body or of a stored model. The
   * 256 are for the store and the I/O loops. */
  rlim_t wanted = (rlim_t)connections * 2 + 256;
  struct rlimit limit;
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= wanted) return;
  limit.rlim_cur = limit.rlim_max < wanted ? limit.rlim_max : wanted;
  if (setrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur < wanted) {
    srv_log(SRV_LOG_WARN, "only %llu open files are allowed, %llu are wanted for --max-connections",
            (unsigned long long)limit.rlim_cur, (unsigned long long)wanted);
  }
}

static bool has_tls(const process *p) {
  return p->config.tls_cert[0] != '\0';
}

static bool has_admin(const process *p) {
  return p->config.admin_listen[0] != '\0';
}

/* Uses the sockets that systemd passed, or else listens at the address. */
static bool listen_at(const srv_address *address, const srv_listeners *passed, srv_listeners *out,
                      srv_error *error) {
  *out = *passed;
  if (passed->count > 0) return true;
  int fd = srv_address_listen(address, error);
  if (fd >= 0) out->fds[out->count++] = fd;
  return fd >= 0;
}

static bool listen_everywhere(process *p) {
  const srv_systemd *systemd = &p->systemd;
  if (systemd->sockets.count > 0)
    srv_log(SRV_LOG_INFO, "serving on the sockets of systemd; --listen is left aside");
  if (systemd->admin_sockets.count > 0 && has_admin(p))
    srv_log(SRV_LOG_INFO, "probes and metrics are on the sockets of systemd; --admin-listen is left aside");
  bool has_admin_listener = has_admin(p) || systemd->admin_sockets.count > 0;
  return listen_at(&p->address, &systemd->sockets, &p->listeners, &p->error) &&
         (!has_admin_listener ||
          listen_at(&p->admin_address, &systemd->admin_sockets, &p->admin_listeners, &p->error));
}

static api_store store_api(process *p) {
#ifdef TWEEND_S3
  if (p->bucket) return srv_store_s3_api(p->bucket);
#endif
  return srv_store_fs_api(p->folder);
}

static api_settings settings(process *p, const api_keyring *keyring) {
  const srv_config *config = &p->config;
  const api_store store = store_api(p);
  return (api_settings){.limits = {.max_upload = config->max_upload,
                                   .max_level = (uint32_t)config->max_level,
                                   .max_faces = config->max_faces,
                                   .max_output = config->max_output,
                                   .max_times = config->max_times,
                                   .plan_cache = config->plan_cache,
                                   .max_memory = config->max_memory,
                                   .max_waiting = (size_t)config->queue},
                        .store = srv_metrics_of_store(p->server.metrics, &store),
                        .parallel = {p->server.work, srv_work_parallel_for, srv_compute_is_over},
                        .keyring = *keyring,
                        .metrics = {&p->server, srv_server_metrics},
                        .page = srv_page,
                        .docs = srv_docs,
                        .example = srv_example,
                        .viewer = srv_viewer,
                        .cors_origins = config->cors_origins,
                        .hosts = config->hosts};
}

/* The local folder: it holds the models, or the cached copies of a bucket's models. */
static const char *folder_of(const srv_config *config) {
  return srv_config_is_s3(config) ? config->cache_dir : config->data;
}

static const char *folder_flag(const srv_config *config) {
  return srv_config_is_s3(config) ? "--cache-dir" : "--data";
}

static bool open_store(process *p) {
  p->folder = srv_store_fs_open(folder_flag(&p->config), folder_of(&p->config), &p->error);
  if (!p->folder) return false;
  srv_store_fs_limit(p->folder, p->config.store_limit, p->config.min_free);
#ifdef TWEEND_S3
  if (srv_config_is_s3(&p->config)) p->bucket = srv_store_s3_open(&p->config, p->folder, &p->error);
#endif
  return !srv_config_is_s3(&p->config) || p->bucket;
}

static void close_store(process *p) {
#ifdef TWEEND_S3
  srv_store_s3_close(p->bucket);
#endif
  srv_store_fs_close(p->folder);
}

static bool check_store(process *p) {
  bool is_usable = srv_store_fs_check(folder_flag(&p->config), folder_of(&p->config), &p->error);
#ifdef TWEEND_S3
  if (is_usable && srv_config_is_s3(&p->config)) return srv_store_s3_check(&p->config, &p->error);
#endif
  return is_usable;
}

/* False with one line in error; the caller then frees what was created by calling stop. */
static bool prepare(process *p) {
  if (has_tls(p) && !srv_tls_read(p->config.tls_cert, p->config.tls_key, &p->error)) return false;
  srv_fail(&p->error, "out of memory");
  if (!open_store(p) || !listen_everywhere(p) ||
      !srv_networks_read(p->config.trusted_proxies, &p->server.trusted, &p->error))
    return false;
  srv_fail(&p->error, "out of memory");
  raise_descriptor_limit(p->config.max_connections);
  p->server.config = &p->config;
  p->server.spool.folder = srv_store_fs_temporary(p->folder);
  p->server.spool.limit = p->config.spool_limit;
  p->server.spool.min_free = p->config.min_free;
  p->server.spool.memory_limit = p->config.max_memory / BODIES_PART;
  p->server.metrics = srv_metrics_create();
  if (!p->server.metrics) return false;
  p->server.folder = p->folder;
  p->server.bucket = p->bucket;
  p->server.rates = srv_rates_create();
  p->server.peers = srv_peers_create(p->config.max_connections_per_address);
  p->server.work = srv_work_create((size_t)p->config.threads, (size_t)p->config.queue, long_jobs(&p->config));
  if (!p->server.work)
    return srv_fail(&p->error, "--threads: cannot start %llu compute %s: %s",
                    (unsigned long long)p->config.threads, srv_plural(p->config.threads, "thread", "threads"),
                    strerror(errno));
  srv_keyring keyring;
  if (!srv_keyring_read(&p->config, &keyring, &p->error)) return false;
  api_settings service_settings = settings(p, &keyring.list);
  p->server.service = api_service_create(&service_settings);
  srv_keyring_deinit(&keyring);
  if (!p->server.service) return false;
  p->server.live = srv_live_create(p->server.service, (size_t)p->config.max_listeners, SRV_LIVE_PULSE_NS);
  if (!p->server.live)
    return srv_fail(&p->error, "cannot start the thread of live streams: %s", strerror(errno));
  return p->server.rates && p->server.peers;
}

static bool store_samples(process *p) {
  for (size_t i = 0; p->config.sample && i < srv_sample_count; i++) {
    int status = api_seed(p->server.service, srv_samples[i].name, srv_samples[i].bytes, srv_samples[i].size);
    if (status != 200 && status != 201)
      return srv_fail(&p->error, "sample %s cannot be stored: status %d", srv_samples[i].name, status);
    srv_log(SRV_LOG_INFO, "sample %s is stored", srv_samples[i].name);
  }
  return true;
}

/* "http://127.0.0.1:8080, unix:/run/tweend" */
static void print_places(const srv_listeners *listeners, bool tls, char *out, size_t out_size) {
  size_t size = 0;
  for (size_t i = 0; i < listeners->count && size < out_size; i++) {
    const srv_address address = srv_address_of(listeners->fds[i]);
    char place[PLACE_SIZE];
    srv_address_print(&address, tls, place, sizeof place);
    size += (size_t)snprintf(out + size, out_size - size, "%s%s", i > 0 ? ", " : "", place);
  }
}

/* Hands ownership of the listening sockets to the new srv_http. */
static srv_http *serve_on(process *p, srv_listeners *listeners, srv_http_kind kind) {
  const srv_listeners given = *listeners;
  listeners->count = 0;
  return srv_http_start(&p->server, &given, kind, &p->error);
}

static bool serve(process *p) {
  char places[2048], admin_places[2048], state[2112];
  bool has_admin_listener = p->admin_listeners.count > 0;
  print_places(&p->listeners, has_tls(p), places, sizeof places);
  print_places(&p->admin_listeners, false, admin_places, sizeof admin_places);
  if (has_admin_listener) p->admin = serve_on(p, &p->admin_listeners, SRV_HTTP_ADMIN);
  if (has_admin_listener && !p->admin) return false;
  p->http = serve_on(p, &p->listeners, has_tls(p) ? SRV_HTTP_TLS : SRV_HTTP_PLAIN);
  if (!p->http) return false;
  if (has_admin_listener) srv_log(SRV_LOG_INFO, "listening for probes and metrics on %s", admin_places);
  printf("tweend %s listening on %s\n", TWEEND_VERSION, places);
  fflush(stdout);
  srv_log(SRV_LOG_INFO, "listening on %s", places);
  snprintf(state, sizeof state, "READY=1\nSTATUS=listening on %s", places);
  srv_systemd_notify(&p->systemd, state);
  return true;
}

/* Notifies the watchdog, four times in its timeout, as long as all I/O threads are running their loops. */
static void notify_watchdog(process *p) {
  uint64_t now_ms = srv_now_ms();
  if (p->systemd.watchdog_ms == 0 || now_ms - p->notified_ms < p->systemd.watchdog_ms / 4) return;
  p->notified_ms = now_ms;
  bool turns = srv_http_turns(p->http) && (!p->admin || srv_http_turns(p->admin));
  if (turns)
    srv_systemd_notify(&p->systemd, "WATCHDOG=1");
  else
    srv_log(SRV_LOG_ERROR, "a socket thread does not go on: the watchdog is not told that all is well");
}

/* ---- reloading settings ---------------------------------------------------------------------- */

/* Requests in flight keep the keys that were in force when they arrived. */
static bool reload_keys(process *p, srv_error *error) {
  srv_keyring keyring;
  if (!srv_keyring_read(&p->config, &keyring, error)) return false;
  srv_fail(error, "out of memory");
  bool is_set = api_service_set_keys(p->server.service, &keyring.list);
  srv_keyring_deinit(&keyring);
  return is_set;
}

/* Reloads each setting on its own: one that cannot be read keeps its old value, and the others still
 * change. */
static void reload(process *p) {
  char state[64];
  srv_error error;
  snprintf(state, sizeof state, "RELOADING=1\nMONOTONIC_USEC=%llu", (unsigned long long)srv_now_ns() / 1000);
  srv_systemd_notify(&p->systemd, state);
  srv_log_level level;
  bool has_level = srv_config_log_level(&p->config, &level, &error);
  if (has_level) srv_log_set_level(level);
  if (!has_level) srv_log(SRV_LOG_ERROR, "%s; the log level stays", error.text);
  if (!reload_keys(p, &error)) srv_log(SRV_LOG_ERROR, "%s; the API keys stay", error.text);
  if (has_tls(p) && !srv_tls_read(p->config.tls_cert, p->config.tls_key, &error))
    srv_log(SRV_LOG_ERROR, "%s; the certificate stays", error.text);
  srv_log(SRV_LOG_INFO, "files of settings were read again");
  srv_systemd_notify(&p->systemd, "READY=1");
}

/* ---- shutdown -------------------------------------------------------------------------------- */

/* Sleeps 10 ms. True when a further ending signal arrives meanwhile. */
static bool sleep_or_signal(process *p) {
  static const struct timespec STEP = {.tv_nsec = 10000000};
  sigset_t ending;
  notify_watchdog(p);
  sigemptyset(&ending);
  for (int number = 1; number < NSIG; number++)
    if (is_ending_signal(number)) sigaddset(&ending, number);
  return sigtimedwait(&ending, NULL, &STEP) > 0;
}

/* Whether no request is in flight and all clients have received their answers. */
static bool is_drained(const process *p) {
  return srv_http_is_drained(p->http) && (!p->admin || srv_http_is_drained(p->admin));
}

/* Waits --drain-delay, so that load balancers see that /readyz fails, then for the requests in flight, until
 * --drain-timeout is over. A second signal cuts either wait short. */
static void drain(process *p) {
  srv_systemd_notify(&p->systemd, "STOPPING=1\nSTATUS=draining");
  api_service_drain(p->server.service);
  uint64_t begin_ms = srv_now_ms() + p->config.drain_delay;
  while (srv_now_ms() < begin_ms)
    if (sleep_or_signal(p)) break;
  atomic_store(&p->server.draining, true);
  srv_live_end(p->server.live);
  srv_http_drain(p->http);
  if (p->admin) srv_http_drain(p->admin);
  uint64_t end_ms = srv_now_ms() + p->config.drain_timeout;
  while (!is_drained(p) && srv_now_ms() < end_ms)
    if (sleep_or_signal(p)) return;
}

/* False when compute threads still work on requests: then nothing may be freed. */
static bool stop(process *p) {
  atomic_store(&p->server.stopping, true);
  if (p->http && !srv_http_stop(p->http)) return false;
  if (p->admin && !srv_http_stop(p->admin)) return false;
  srv_live_destroy(p->server.live);
  srv_work_destroy(p->server.work);
  api_service_destroy(p->server.service);
  srv_metrics_destroy(p->server.metrics);
  srv_rates_destroy(p->server.rates);
  srv_peers_destroy(p->server.peers);
  srv_networks_deinit(&p->server.trusted);
  close_store(p);
  srv_listeners_close(&p->listeners);
  srv_listeners_close(&p->admin_listeners);
  srv_tls_forget();
  return true;
}

/* Waits for an ending signal. Meanwhile reloads settings on SIGHUP, notifies the watchdog and, every few
 * seconds when requests have been served, gives free memory back to the system. */
static void await_end(process *p, const sigset_t *taken) {
  enum { STEP_MS = 5000 };
  uint64_t trimmed_at = 0, quarter_ms = p->systemd.watchdog_ms / 4;
  long step_ms = quarter_ms > 0 && quarter_ms < STEP_MS ? (long)quarter_ms : STEP_MS;
  const struct timespec step = {.tv_sec = step_ms / 1000, .tv_nsec = step_ms % 1000 * 1000000};
  for (;;) {
    int number = sigtimedwait(taken, NULL, &step);
    notify_watchdog(p);
    srv_log_tell_hidden();
    uint64_t ended = atomic_load(&p->server.ended);
    if (number > 0 && is_ending_signal(number)) {
      srv_log(SRV_LOG_INFO, "signal %d: draining", number);
      return;
    }
    if (number == SIGHUP) {
      reload(p);
    } else if (number > 0) {
      srv_log(SRV_LOG_WARN, "signal %d means nothing to the daemon", number);
    } else if (ended != trimmed_at) {
      trimmed_at = ended;
      srv_machine_trim();
    }
  }
}

static int run(process *p) {
  sigset_t taken;
  srv_log_level level = SRV_LOG_INFO;
  srv_machine_set_malloc();
  block_signals(&taken);
  bool has_level = srv_config_log_level(&p->config, &level, &p->error);
  srv_log_configure(level, (srv_log_format)p->config.log_format);
  srv_config_warn(environ);
  bool serving = has_level && srv_systemd_read(&p->systemd, getenv, &p->error) && prepare(p) &&
                 store_samples(p) && serve(p);
  if (!serving) {
    fprintf(stderr, "tweend: %s\n", p->error.text);
    stop(p);
    return STATUS_FAILED;
  }
  await_end(p, &taken);
  drain(p);
  if (!p->listeners.is_passed) srv_address_unlink(&p->address);
  if (has_admin(p) && !p->admin_listeners.is_passed) srv_address_unlink(&p->admin_address);
  size_t left = atomic_load(&p->server.in_flight), unsent = atomic_load(&p->server.unsent);
  if (left > 0)
    srv_log(SRV_LOG_WARN, "%zu %s in flight %s cut off", left, srv_plural(left, "request", "requests"),
            srv_plural(left, "is", "are"));
  if (unsent > 0)
    srv_log(SRV_LOG_WARN, "%zu %s answers", unsent,
            srv_plural(unsent, "client has not taken all of its", "clients have not taken all of their"));
  bool freed = stop(p);
  srv_log_tell_all_hidden();
  srv_log(SRV_LOG_INFO, "stopped");
  /* The store needs no closing: its files are consistent at any moment. */
  if (!freed) _exit(EXIT_SUCCESS);
  return EXIT_SUCCESS;
}

/* Checks the addresses to listen at. Skips an address when systemd passes sockets in its place. */
static bool check_addresses(process *p) {
  const srv_address *const addresses[] = {
      p->systemd.sockets.count > 0 ? NULL : &p->address,
      p->systemd.admin_sockets.count > 0 || !has_admin(p) ? NULL : &p->admin_address};
  for (size_t i = 0; i < 2; i++) {
    bool is_used = false;
    if (!addresses[i]) continue;
    if (!srv_address_check(addresses[i], &is_used, &p->error)) return false;
    char place[PLACE_SIZE];
    srv_address_print(addresses[i], false, place, sizeof place);
    if (is_used) printf("%s is in use at present, by a daemon that runs or by another program\n", place);
  }
  return true;
}

/* Reads and checks what a start would use, and leaves nothing behind. Does not listen: the daemon may be
 * running. */
static bool check(process *p) {
  srv_keyring keyring;
  srv_config_warn(environ);
  bool starts = srv_systemd_read(&p->systemd, getenv, &p->error) &&
                (!has_tls(p) || srv_tls_read(p->config.tls_cert, p->config.tls_key, &p->error)) &&
                srv_networks_read(p->config.trusted_proxies, &p->server.trusted, &p->error) &&
                srv_keyring_read(&p->config, &keyring, &p->error);
  if (starts) srv_keyring_deinit(&keyring);
  srv_networks_deinit(&p->server.trusted);
  srv_tls_forget();
  starts = starts && check_store(p) && check_addresses(p);
  if (starts) {
    puts("the daemon would start with these settings");
  } else {
    fprintf(stderr, "tweend: %s\n", p->error.text);
  }
  return starts;
}

static bool parse_address(const char *flag, const char *text, srv_address *out, srv_error *error) {
  srv_error reason;
  return srv_address_parse(text, out, &reason) || srv_fail(error, "%s: %s", flag, reason.text);
}

int main(int argc, char **argv) {
  static process p; /* static: compute threads may outlive main's frame, see stop */
  int status = STATUS_USAGE;
  srv_config_status read = srv_config_read(&p.config, argc, argv, getenv, stdout, &p.error);
  bool usable =
      read == SRV_CONFIG_RUN && parse_address("--listen", p.config.listen, &p.address, &p.error) &&
      (!has_admin(&p) || parse_address("--admin-listen", p.config.admin_listen, &p.admin_address, &p.error));
  if (read == SRV_CONFIG_DONE) {
    status = EXIT_SUCCESS;
  } else if (!usable) {
    fprintf(stderr, "tweend: %s\n", p.error.text);
  } else if (p.config.check) {
    status = check(&p) ? EXIT_SUCCESS : STATUS_FAILED;
  } else if (p.config.healthcheck) {
    status = srv_healthcheck(&p.address, p.config.tls_cert[0] != '\0') ? EXIT_SUCCESS : STATUS_FAILED;
  } else {
    status = run(&p);
  }
  srv_config_deinit(&p.config);
  return status;
}
