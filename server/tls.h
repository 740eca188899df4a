/* The certificate for TLS connections. There is one for the whole process, because GnuTLS passes the callback
 * no context. */
#ifndef SRV_TLS_H
#define SRV_TLS_H

#include "fail.h"

#include <gnutls/abstract.h>
#include <stdbool.h>
#include <stddef.h>

/* GnuTLS priorities: TLS 1.3, and TLS 1.2 with forward secrecy and authenticated encryption only. */
#define SRV_TLS_PRIORITIES "NORMAL:-VERS-ALL:+VERS-TLS1.3:+VERS-TLS1.2:-RSA:-MAC-ALL:+AEAD"

/* Reads certificate chain and key (PEM) and uses them for handshakes from now on. False with one line in
 * error; the previous pair stays in use then. One thread at a time. */
bool srv_tls_read(const char *certificate_path, const char *key_path, srv_error *error);

/* A gnutls_certificate_retrieve_function2 that returns the newest pair. Any thread. */
int srv_tls_choose(gnutls_session_t session, const gnutls_datum_t *authorities, int authority_count,
                   const gnutls_pk_algorithm_t *algorithms, int algorithm_count, gnutls_pcert_st **chain,
                   unsigned *chain_size, gnutls_privkey_t *key);

/* Frees all pairs. No handshake may be in progress. */
void srv_tls_forget(void);

#endif
