/* A handler that does nothing but answer. */
#include "bare.h"

#include <microhttpd.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

typedef struct bytes {
  uint64_t size;
  char *data;
} bytes;

static enum MHD_Result answer(void *context, struct MHD_Connection *connection, const char *url,
                              const char *method, const char *version, const char *data, size_t *size,
                              void **request) {
  (void)url;
  (void)method;
  (void)version;
  (void)data;
  *size = 0; /* whatever came is taken */
  static int seen;
  if (!*request) { /* headers only: an answer here would close the connection */
    *request = &seen;
    return MHD_YES;
  }
  const bytes *body = context;
  struct MHD_Response *response =
      MHD_create_response_from_buffer(body->size, body->data, MHD_RESPMEM_PERSISTENT);
  if (!response) return MHD_NO;
  enum MHD_Result queued = MHD_queue_response(connection, MHD_HTTP_OK, response);
  MHD_destroy_response(response);
  return queued;
}

static void serve(const bytes *body, int ready) {
  struct MHD_Daemon *daemon = MHD_start_daemon(MHD_USE_EPOLL, 0, NULL, NULL, answer, (void *)(uintptr_t)body,
                                               MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1, MHD_OPTION_END);
  if (!daemon) exit(1);
  uint16_t port = MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_BIND_PORT)->port;
  if (write(ready, &port, sizeof port) != sizeof port) exit(1);
  struct pollfd waiting = {.fd = MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd,
                           .events = POLLIN};
  for (;;) {
    unsigned long long wanted;
    int timeout = MHD_get_timeout(daemon, &wanted) == MHD_YES ? (int)(wanted < 1000 ? wanted : 1000) : 1000;
    poll(&waiting, 1, timeout);
    MHD_run(daemon);
  }
}

pid_t bare_start(uint64_t size, uint16_t *port) {
  int ready[2];
  if (pipe(ready) != 0) exit(1);
  fflush(NULL);
  pid_t process = fork();
  if (process == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    signal(SIGPIPE, SIG_IGN);
    bytes body = {size, calloc(size ? size : 1, 1)};
    if (!body.data) exit(1);
    serve(&body, ready[1]);
  }
  close(ready[1]);
  if (process < 0 || read(ready[0], port, sizeof *port) != sizeof *port) {
    fprintf(stderr, "the bare server did not start\n");
    exit(1);
  }
  close(ready[0]);
  return process;
}

void bare_stop(pid_t process) {
  kill(process, SIGKILL);
  waitpid(process, NULL, 0);
}
