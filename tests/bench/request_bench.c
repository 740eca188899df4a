/* Requests a second of pose.json and pose.bin, each for another time, compared with a bare libmicrohttpd
 * handler that gets the same requests and sends as many bytes. Each server and the client have one thread, so
 * the rate is that of the busier of the two. usage: request_bench TWEEND [JSON] */
#include "bare.h"
#include "bench_model.h"
#include "load.h"
#include "report.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { CONNECTIONS = 16, KEYS = 100 };

static const double RUN_SECONDS = 0.2;

static void fail(const char *what) {
  fprintf(stderr, "request_bench: %s\n", what);
  exit(1);
}

/* ---- the daemon ------------------------------------------------------------------------------ */

typedef struct daemon_process {
  pid_t process;
  uint16_t port;
  char folder[64];
} daemon_process;

static void run_daemon(const char *program, const char *folder, int out) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  dup2(out, STDOUT_FILENO);
  execl(program, program, "--listen", "127.0.0.1:0", "--data", folder, "--io-threads", "1", "--threads", "1",
        "--log-level", "warn", (char *)NULL);
  _exit(127);
}

static daemon_process start_daemon(const char *program) {
  daemon_process daemon = {.folder = "/tmp/tweend-bench-XXXXXX"};
  int out[2];
  if (!mkdtemp(daemon.folder) || pipe(out) != 0) fail("no folder");
  fflush(NULL);
  daemon.process = fork();
  if (daemon.process == 0) run_daemon(program, daemon.folder, out[1]);
  close(out[1]);
  char line[256] = "";
  FILE *ready = fdopen(out[0], "r");
  if (!ready || !fgets(line, sizeof line, ready) || !strrchr(line, ':')) fail("the daemon did not start");
  fclose(ready);
  daemon.port = (uint16_t)atoi(strrchr(line, ':') + 1);
  return daemon;
}

static void stop_daemon(const daemon_process *daemon) {
  kill(daemon->process, SIGTERM);
  waitpid(daemon->process, NULL, 0);
  pid_t removal = fork();
  if (removal == 0) {
    execlp("rm", "rm", "-r", daemon->folder, (char *)NULL);
    _exit(127);
  }
  waitpid(removal, NULL, 0);
}

/* Processor seconds of all threads of a process. */
static double cpu_seconds(pid_t process) {
  clockid_t clock;
  struct timespec spent;
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &spent) != 0) fail("no clock");
  return (double)spent.tv_sec + (double)spent.tv_nsec * 1e-9;
}

/* ---- the model ------------------------------------------------------------------------------- */

/* Uploads the model; id receives its id. */
static void upload(uint16_t port, const char *model, size_t size, char id[33]) {
  char head[256], answer[64 << 10];
  int fd = load_connect(port);
  int length = snprintf(head, sizeof head,
                        "POST /v1/models HTTP/1.1\r\nHost: bench\r\nContent-Type: application/json\r\n"
                        "Connection: close\r\nContent-Length: %zu\r\n\r\n",
                        size);
  if (send(fd, head, (size_t)length, 0) != length || send(fd, model, size, MSG_WAITALL) != (ssize_t)size)
    fail("no upload");
  size_t got = 0;
  ssize_t piece;
  while ((piece = recv(fd, answer + got, sizeof answer - 1 - got, 0)) > 0) got += (size_t)piece;
  answer[got] = '\0';
  close(fd);
  const char *found = strstr(answer, "\"id\":\"");
  if (!found || sscanf(found, "\"id\":\"%32[0-9a-f]\"", id) != 1) fail(answer);
}

/* ---- measuring ------------------------------------------------------------------------------- */

typedef struct pose_target {
  const char *id, *form;
  bool again; /* true: the same time in every request */
} pose_target;

static size_t pose_request(const void *context, uint64_t n, char out[LOAD_REQUEST_SIZE]) {
  const pose_target *target = context;
  double time = target->again ? 1.25 : (double)(n * 7919 % 1000000) * 1e-5;
  return (size_t)snprintf(out, LOAD_REQUEST_SIZE,
                          "GET /v1/models/%s/pose.%s?at=%.5f HTTP/1.1\r\nHost: bench\r\n\r\n", target->id,
                          target->form, time);
}

/* One of the servers that are measured in turn. */
typedef struct server {
  load load;
  pid_t process;
  double rates[BENCH_RUNS], cpu_us[BENCH_RUNS]; /* cpu_us: microseconds per request */
} server;

static void run_by_turns(server *servers, int count) {
  for (int i = 0; i < count; i++) load_run(&servers[i].load, 2, 0.01);
  for (int run = 0; run < BENCH_RUNS; run++)
    for (int i = 0; i < count; i++) {
      server *s = &servers[i];
      uint64_t first = s->load.sent;
      double before = cpu_seconds(s->process);
      s->rates[run] = load_run(&s->load, CONNECTIONS, RUN_SECONDS);
      s->cpu_us[run] = (cpu_seconds(s->process) - before) * 1e6 / (double)(s->load.sent - first);
    }
}

static void bench_requests(bench_report *report, const daemon_process *daemon, const char *id,
                           const char *form) {
  const pose_target other = {id, form, false}, same = {id, form, true};
  server servers[4] = {{.process = daemon->process, .load = {daemon->port, pose_request, &other, 0, 0, ""}},
                       {.process = daemon->process, .load = {daemon->port, pose_request, &same, 0, 0, ""}},
                       {.load = {.request = pose_request, .context = &other}},
                       {.load = {.request = pose_request, .context = &other}}};
  load *asked = &servers[0].load;
  load_run(asked, 1, 0.01);
  uint64_t body = asked->answer_size - strlen(asked->head) - strlen("\r\n");
  servers[2].process = bare_start(body, asked->head, &servers[2].load.port);
  servers[3].process = bare_start(body, "", &servers[3].load.port);
  run_by_turns(servers, 4);
  bare_stop(servers[2].process);
  bare_stop(servers[3].process);
  static const char *const names[] = {"another time each", "the same time again", NULL,
                                      "bare without fields"};
  bench_timing bare = bench_summary(servers[2].rates), bare_cpu = bench_summary(servers[2].cpu_us);
  for (int i = 0; i < 4; i++) {
    char name[64];
    if (i == 2) continue;
    snprintf(name, sizeof name, "pose.%s, %s", form, names[i]);
    bench_row(report, name, "requests/s", bench_summary(servers[i].rates), "bare handler", bare, true);
    snprintf(name, sizeof name, "pose.%s, %s, cpu", form, names[i]);
    bench_row(report, name, "us a request", bench_summary(servers[i].cpu_us), "bare handler", bare_cpu,
              false);
  }
}

int main(int argc, char **argv) {
  static const int joints[] = {1, 24, 100};
  if (argc < 2) fail("usage: request_bench TWEEND [JSON]");
  bench_report report;
  bench_open(&report, argc > 2 ? argv[2] : NULL);
  daemon_process daemon = start_daemon(argv[1]);
  for (int i = 0; i < 3; i++) {
    size_t size;
    char id[33];
    char *model = bench_model(joints[i], KEYS, &size);
    upload(daemon.port, model, size, id);
    free(model);
    bench_scene(&report, "%d joints, one pose a request", joints[i]);
    bench_requests(&report, &daemon, id, "json");
    bench_requests(&report, &daemon, id, "bin");
  }
  stop_daemon(&daemon);
  bench_close(&report);
  return 0;
}
