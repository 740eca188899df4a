/* A list of pairs of certificate and key, the newest first. Handshakes use a pair without a reference count,
 * so older pairs are kept; a new pair is made only when the files have changed. */
#include "tls.h"

#include "disk.h"

#include <errno.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PEM_MAX = 1 << 20, CHAIN_MAX = 16 };

typedef struct pair {
  struct pair *older;
  char *certificate_text, *key_text;
  gnutls_pcert_st chain[CHAIN_MAX];
  unsigned chain_size;
  gnutls_privkey_t key;
} pair;

static pair *_Atomic newest;

static void destroy_pair(pair *p) {
  for (unsigned i = 0; i < p->chain_size; i++) gnutls_pcert_deinit(&p->chain[i]);
  if (p->key) gnutls_privkey_deinit(p->key);
  free(p->certificate_text);
  free(p->key_text);
  free(p);
}

/* NULL with one line in error. */
static char *read_pem(const char *flag, const char *path, srv_error *error) {
  char *text = srv_read_text(path, PEM_MAX);
  if (!text) srv_fail(error, "%s: cannot read '%s': %s", flag, path, strerror(errno));
  return text;
}

static gnutls_datum_t view(char *text) {
  return (gnutls_datum_t){(unsigned char *)text, (unsigned)strlen(text)};
}

/* Whether certificate and key belong together: GnuTLS checks that when it takes them as credentials. */
static int check_pair(const pair *p) {
  gnutls_certificate_credentials_t credentials;
  int status = gnutls_certificate_allocate_credentials(&credentials);
  if (status < 0) return status;
  gnutls_datum_t certificate = view(p->certificate_text), key = view(p->key_text);
  status = gnutls_certificate_set_x509_key_mem(credentials, &certificate, &key, GNUTLS_X509_FMT_PEM);
  gnutls_certificate_free_credentials(credentials);
  return status;
}

/* Parses the texts of the pair. Negative: a GnuTLS error. */
static int parse_pair(pair *p) {
  int status = check_pair(p);
  if (status < 0) return status;
  gnutls_datum_t certificate = view(p->certificate_text), key = view(p->key_text);
  unsigned size = CHAIN_MAX;
  status = gnutls_pcert_list_import_x509_raw(p->chain, &size, &certificate, GNUTLS_X509_FMT_PEM, 0);
  if (status < 0) return status;
  p->chain_size = size;
  status = gnutls_privkey_init(&p->key);
  return status < 0 ? status : gnutls_privkey_import_x509_raw(p->key, &key, GNUTLS_X509_FMT_PEM, NULL, 0);
}

static bool is_known(const pair *p) {
  const pair *known = atomic_load(&newest);
  return known && strcmp(known->certificate_text, p->certificate_text) == 0 &&
         strcmp(known->key_text, p->key_text) == 0;
}

bool srv_tls_read(const char *certificate_path, const char *key_path, srv_error *error) {
  srv_fail(error, "out of memory");
  pair *p = calloc(1, sizeof *p);
  if (!p) return false;
  p->certificate_text = read_pem("--tls-cert", certificate_path, error);
  p->key_text = p->certificate_text ? read_pem("--tls-key", key_path, error) : NULL;
  bool is_read = p->key_text != NULL;
  if (is_read && !is_known(p)) {
    int status = parse_pair(p);
    if (status >= 0) {
      p->older = atomic_load(&newest);
      atomic_store(&newest, p);
      return true;
    }
    is_read = srv_fail(error, "--tls-cert: '%s' and '%s' are no certificate and its key: %s",
                       certificate_path, key_path, gnutls_strerror(status));
  }
  destroy_pair(p);
  return is_read;
}

int srv_tls_choose(gnutls_session_t session, const gnutls_datum_t *authorities, int authority_count,
                   const gnutls_pk_algorithm_t *algorithms, int algorithm_count, gnutls_pcert_st **chain,
                   unsigned *chain_size, gnutls_privkey_t *key) {
  (void)session;
  (void)authorities;
  (void)authority_count;
  (void)algorithms;
  (void)algorithm_count;
  pair *p = atomic_load(&newest);
  if (!p) return -1;
  *chain = p->chain;
  *chain_size = p->chain_size;
  *key = p->key;
  return 0;
}

void srv_tls_forget(void) {
  for (pair *p = atomic_exchange(&newest, NULL); p;) {
    pair *older = p->older;
    destroy_pair(p);
    p = older;
  }
}
