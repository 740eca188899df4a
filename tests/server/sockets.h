/* A daemon on a port of its own for each test, with a stand-in for api/ behind it, and a client that speaks
 * bytes. */
#ifndef SOCKETS_H
#define SOCKETS_H

#include "exchange.h"
#include "http.h"
#include "listen.h"

#include "test.h"

enum { ANSWER_MAX = 4 << 20, PATIENCE_MS = 30000 };

typedef struct fixture {
  srv_config config;
  bool is_tls; /* by what srv_tls_read has read */
  srv_server server;
  srv_http *http;
  srv_address address;
  char *answer; /* of the last exchange, terminated */
  size_t answer_size;
} fixture;

/* cmocka fixtures; *state is a fixture. */
int set_up(void **state);
int tear_down(void **state);

/* The daemon alone. stop: false when requests were still at compute threads. restart: with the config as it
 * is by now. */
void start(fixture *f);
bool stop(fixture *f);
void restart(fixture *f);

void wait_in_flight(fixture *f, size_t count); /* until so many requests are */

uint64_t clock_ms(void);
void pause_ms(long ms);

int connect_client(fixture *f);
void say(int fd, const char *text);
bool read_all(fixture *f, int fd); /* until the other side closes; false when it resets or stays open */
void read_until(fixture *f, int fd, const char *text);
bool ask(fixture *f, const char *request); /* one request on a connection of its own, up to its close */
void assert_refused(fixture *f, int expected,
                    const char *request); /* by that status, and the connection closes */

/* Of the last answer. */
int status(const fixture *f);
size_t answers(const fixture *f);
const char *body(const fixture *f);
size_t body_size(const fixture *f);
bool has(const fixture *f, const char *text);

#endif
