/* Requests against api/ with no socket: a service over a store in memory, and the answer to look at. */
#ifndef LOOPBACK_H
#define LOOPBACK_H

#include <cjson/cJSON.h>
#include <pthread.h>

#include "api.h"
#include "quotes.h"

/* A request's ticket, and the thread that waits for its waking. */
typedef struct loopback_ticket {
  api_ticket ticket; /* first: api hands it back */
  pthread_mutex_t lock;
  pthread_cond_t changed;
  int woken; /* times that were not awaited yet */
} loopback_ticket;

/* What came back, its body complete and terminated. */
typedef struct reply {
  int status;
  bool refused; /* by api_open, before the body */
  api_answer answer;
  char *body;
  size_t size;
  struct loopback *loop;
  loopback_ticket *ticket;
} reply;

/* The service of the running test. */
typedef struct loopback {
  api_service *service;
  api_settings settings;
  struct memory_store *store;
  uint64_t now_s; /* of the requests */
} loopback;

loopback_ticket *loopback_ticket_create(void);
void loopback_ticket_await(loopback_ticket *ticket);                   /* until it is woken */
void loopback_ticket_destroy(loopback *loop, loopback_ticket *ticket); /* NULLs accepted */

enum { ALL_RIGHTS = API_MAY_READ | API_MAY_WRITE | API_MAY_DELETE };

/* Settings that suit most tests: 1 MiB bodies, level 10, CORS "*", no keys. */
api_settings loopback_settings(void);
loopback *loopback_start(const api_settings *settings);
void loopback_stop(loopback *loop);

/* cmocka fixtures with loopback_settings; *state is the loopback. */
int loopback_setup(void **state);
int loopback_teardown(void **state);

/* A service that holds one model, the fixture of tests that ask for its answers. */
typedef struct one_model {
  loopback *loop;
  char id[API_ID_TEXT];
} one_model;

/* settings: NULL for loopback_settings. json: the model, uploaded as tweend JSON. */
one_model *one_model_start(const api_settings *settings, const char *json);
/* A cmocka teardown. */
int one_model_stop(void **state);

/* The store's mood. */
void loopback_store_fail(loopback *loop, bool fails);       /* API_STORE_UNAVAILABLE from now on */
void loopback_store_damage(loopback *loop, const char *id); /* the stored bytes, until they are put again */
void loopback_store_cut(loopback *loop, bool cuts);         /* what is open cannot be read any more */
void loopback_store_forget_summaries(loopback *loop);       /* NULL in lists from now on */
size_t loopback_store_count(loopback *loop);                /* objects held */
size_t loopback_store_opens(loopback *loop);                /* calls of open so far */

/* target: path and query. headers: "Name: value" lines, each ended by '\n', or NULL. A Content-Length
 * is added to a body unless the headers bear one or a Transfer-Encoding. Calls api_open, then
 * api_handle as light, then as heavy. The reply is freed by reply_free. */
reply loopback_ask(loopback *loop, const char *method, const char *target, const char *headers,
                   const void *body, size_t size);
reply loopback_get(loopback *loop, const char *target);
/* With text as the body, in which ' stands for ". */
reply loopback_post(loopback *loop, const char *target, const char *type, const char *body);
reply loopback_post_with(loopback *loop, const char *target, const char *headers, const char *body);
/* Uploads and returns the id in place; fails the test when the status is not 201 or 200. */
void loopback_upload(loopback *loop, const char *type, const char *body, char id[API_ID_TEXT]);
/* Asks whether the light stage alone could answer. */
bool loopback_is_light(loopback *loop, const char *target);
void reply_free(reply *r);

/* Whether the text, in which ' stands for ", is in the body; the assertion prints the body. */
bool reply_says(const reply *r, const char *text);
void assert_says(const reply *r, const char *text);
/* Nothing else is in the body. */
void assert_body(const reply *r, const char *text);
/* The header's value, NULL when absent. */
const char *reply_header(const reply *r, const char *name);
/* Asserts status and problem document; returns nothing but a failed test. pointer, word: NULL for
 * any; the word must stand in the detail. Frees the reply. */
void assert_problem(reply r, int status, const char *pointer, const char *word);

/* A member that must be there. */
const cJSON *json_member(const cJSON *object, const char *name);

/* The text of a file of the project, terminated; freed by the caller. */
char *loopback_file(const char *path, size_t *size);

#endif
