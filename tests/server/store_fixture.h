/* A store in a folder of its own for each test. */
#ifndef STORE_FIXTURE_H
#define STORE_FIXTURE_H

#include "store_fs.h"

#include "test.h"

typedef struct fixture {
  char path[64];
  srv_store_fs *opened;
  api_store store;
} fixture;

/* cmocka fixtures; *state is a fixture. */
int set_up_store(void **state);
int tear_down_store(void **state);

void open_store(fixture *f);

/* With all that is in it; 0, or -1 with errno. */
int remove_folder(const char *path);

/* The id of a model of these bytes. */
void make_id(const char *bytes, size_t size, char id[API_ID_TEXT]);

#endif
