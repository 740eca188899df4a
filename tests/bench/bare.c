/* A libmicrohttpd handler that does nothing but answer. */
#include "bare.h"

#include <microhttpd.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

enum { FIELDS_MAX = 24 };

/* The answer to every request. */
typedef struct bare {
  uint64_t size;
  char *data;
  size_t field_count;
  char *names[FIELDS_MAX], *values[FIELDS_MAX];
} bare;

static enum MHD_Result answer(void *context, struct MHD_Connection *connection, const char *url,
                              const char *method, const char *version, const char *data, size_t *size,
                              void **request) {
  (void)url;
  (void)method;
  (void)version;
  (void)data;
  *size = 0; /* takes all input */
  static int seen;
  if (!*request) { /* first call, with the headers only: answering now would close the connection */
    *request = &seen;
    return MHD_YES;
  }
  const bare *body = context;
  struct MHD_Response *response =
      MHD_create_response_from_buffer(body->size, body->data, MHD_RESPMEM_PERSISTENT);
  if (!response) return MHD_NO;
  for (size_t i = 0; i < body->field_count; i++)
    MHD_add_response_header(response, body->names[i], body->values[i]);
  enum MHD_Result queued = MHD_queue_response(connection, MHD_HTTP_OK, response);
  MHD_destroy_response(response);
  return queued;
}

static _Noreturn void serve(const bare *body, int ready) {
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

/* Reads the fields of a head; cuts it in place. */
static void take_fields(bare *body, char *head) {
  char *rest = NULL;
  strtok_r(head, "\r\n", &rest); /* the status */
  for (char *line; (line = strtok_r(NULL, "\r\n", &rest)) && body->field_count < FIELDS_MAX;) {
    char *colon = strchr(line, ':');
    if (!colon) continue;
    *colon = '\0';
    if (strcasecmp(line, "Date") == 0 || strcasecmp(line, "Content-Length") == 0) continue;
    body->names[body->field_count] = line;
    body->values[body->field_count++] = colon + 1 + strspn(colon + 1, " ");
  }
}

pid_t bare_start(uint64_t size, const char *head, uint16_t *port) {
  int ready[2];
  if (pipe(ready) != 0) exit(1);
  fflush(NULL);
  pid_t process = fork();
  if (process == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    signal(SIGPIPE, SIG_IGN);
    bare body = {.size = size, .data = calloc(size ? size : 1, 1)};
    char *lines = strdup(head);
    if (!body.data || !lines) exit(1);
    take_fields(&body, lines);
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
