/* Sends requests to api/ without a socket: a service over a store in memory, and replies to examine. */
#ifndef LOOPBACK_H
#define LOOPBACK_H

#include <cjson/cJSON.h>
#include <pthread.h>

#include "api.h"
#include "quotes.h"

/* A request's ticket, on which the test's thread can wait. */
typedef struct loopback_ticket {
  api_ticket ticket; /* first: wake gets its address */
  pthread_mutex_t lock;
  pthread_cond_t changed;
  int woken; /* wake-ups that were not awaited yet */
} loopback_ticket;

/* A reply. Its body is complete and terminated. */
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
  uint64_t now_s;          /* Unix time of the requests */
  bool is_local, is_admin; /* on a listener of these kinds */
} loopback;

loopback_ticket *loopback_ticket_create(void);
void loopback_ticket_await(loopback_ticket *ticket);                   /* waits until the ticket is woken */
void loopback_ticket_destroy(loopback *loop, loopback_ticket *ticket); /* NULLs accepted */

enum { ALL_RIGHTS = API_MAY_READ | API_MAY_WRITE | API_MAY_DELETE };

/* Settings that suit most tests: 1 MiB bodies, level 10, CORS "*", no keys. */
api_settings loopback_settings(void);
loopback *loopback_start(const api_settings *settings);
void loopback_stop(loopback *loop);

/* cmocka fixtures with loopback_settings; *state is the loopback. */
int loopback_setup(void **state);
int loopback_teardown(void **state);

/* A service that holds one model: a fixture. */
typedef struct one_model {
  loopback *loop;
  char id[API_ID_TEXT];
} one_model;

/* settings: NULL for loopback_settings. json: the model, uploaded as tweend JSON. */
one_model *one_model_start(const api_settings *settings, const char *json);
/* A cmocka teardown of any struct that begins with its loopback. */
int fixture_stop(void **state);

/* Faults of the store. */
void loopback_store_fail(loopback *loop, bool fails);       /* API_STORE_UNAVAILABLE from now on */
void loopback_store_damage(loopback *loop, const char *id); /* damages the object until it is put again */
void loopback_store_cut(loopback *loop, bool cuts);         /* reads of open blobs fail */
void loopback_store_forget_summaries(loopback *loop);       /* summaries are NULL from now on */
void loopback_store_narrow(loopback *loop, uint64_t room);  /* bytes that the store has room for; 0: any */
/* The next put finds that another daemon has just stored the same bytes, with this summary. */
void loopback_store_come_second(loopback *loop, const char *summary);
size_t loopback_store_count(loopback *loop); /* objects held */
size_t loopback_store_opens(loopback *loop); /* calls of open so far */

/* Sends a request: calls api_open, then api_handle as light, then as heavy. target: path and query. headers:
 * lines "Name: value", each ended by '\n', or NULL; adds a Content-Length for a body unless the headers have
 * one or a Transfer-Encoding. Free the reply with reply_free. */
reply loopback_ask(loopback *loop, const char *method, const char *target, const char *headers,
                   const void *body, size_t size);
reply loopback_get(loopback *loop, const char *target);
/* POSTs a text, written with ' in place of ". */
reply loopback_post(loopback *loop, const char *target, const char *type, const char *body);
reply loopback_post_with(loopback *loop, const char *target, const char *headers, const char *body);
/* Uploads a model and returns its id; fails the test when the status is not 201 or 200. */
void loopback_upload(loopback *loop, const char *type, const char *body, char id[API_ID_TEXT]);
/* The same with a file of server/samples. */
void loopback_upload_sample(loopback *loop, const char *type, const char *name, char id[API_ID_TEXT]);
/* Sends a request to a stored model. rest: of the target, behind the id and a '/'; "" for the model itself.
 */
reply model_ask(loopback *loop, const char *method, const char *id, const char *rest, const char *headers);
reply model_get(loopback *loop, const char *id, const char *rest);
reply model_get_ok(loopback *loop, const char *id, const char *rest); /* fails the test unless it is 200 */
cJSON *model_get_json(loopback *loop, const char *id, const char *rest);
/* Whether the light stage alone answers the request. */
bool loopback_is_light(loopback *loop, const char *target);
void reply_free(reply *r);

/* Whether the body contains the text, written with ' in place of ". The assertion prints the body. */
bool reply_says(const reply *r, const char *text);
void assert_says(const reply *r, const char *text);
/* Asserts that the body is the text. */
void assert_body(const reply *r, const char *text);
/* The value of a header, NULL when absent. */
const char *reply_header(const reply *r, const char *name);
/* Asserts the status and that the body is a problem document. pointer: of its first error; word: contained in
 * its detail; NULL for any. Frees the reply. */
void assert_problem(reply r, int status, const char *pointer, const char *word);

/* A member of an object; fails the test when it is absent. */
const cJSON *json_member(const cJSON *object, const char *name);

/* The text of a file of the project, terminated; the caller frees it. path: from the project's root. */
char *loopback_file(const char *path, size_t *size);

#endif
