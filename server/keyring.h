/* The keys of --api-keys and --url-keys, and what each allows. */
#ifndef SRV_KEYRING_H
#define SRV_KEYRING_H

#include "api.h"
#include "config.h"

/* A value: a zeroed one may be deinited. */
typedef struct srv_keyring {
  api_keyring list; /* its parts lie in the members below */
  char *keys_text, *urls_text;
  api_key *keys;
  const char **url_keys;
} srv_keyring;

/* Both settings, read anew where they name files. False with one line in error. */
bool srv_keyring_read(const srv_config *config, srv_keyring *out, char *error, size_t error_size);
void srv_keyring_deinit(srv_keyring *keyring);

#endif
