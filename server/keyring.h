/* The keys of --api-keys and --url-keys, and what each allows. */
#ifndef SRV_KEYRING_H
#define SRV_KEYRING_H

#include "api.h"
#include "config.h"

typedef struct srv_key_list {
  char *text; /* the keys' texts point into it */
  api_key *keys;
  size_t count;
} srv_key_list;

/* A value: a zeroed one may be deinited. */
typedef struct srv_keyring {
  api_keyring list; /* a view of the members below */
  srv_key_list keys, url_keys;
} srv_keyring;

/* Reads both settings, and the files that they name. False with one line in error. */
bool srv_keyring_read(const srv_config *config, srv_keyring *out, srv_error *error);
void srv_keyring_deinit(srv_keyring *keyring);

#endif
