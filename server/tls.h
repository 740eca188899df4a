/* The certificate that TLS connections are served with. There is one for the process, because GnuTLS asks for
 * it without a context. */
#ifndef SRV_TLS_H
#define SRV_TLS_H

#include "fail.h"

#include <gnutls/abstract.h>
#include <stdbool.h>
#include <stddef.h>

/* For GnuTLS: TLS 1.3, and of TLS 1.2 what keeps past connections secret when the key is lost later. */
#define SRV_TLS_PRIORITIES "NORMAL:-VERS-ALL:+VERS-TLS1.3:+VERS-TLS1.2:-RSA"

/* Reads certificate chain and key (PEM) and takes them for handshakes from here on. False with one line in
 * error; then those that were read before stay. One thread at a time. */
bool srv_tls_read(const char *certificate_path, const char *key_path, srv_error *error);

/* A gnutls_certificate_retrieve_function2: the certificates that were read last. Any thread. */
int srv_tls_choose(gnutls_session_t session, const gnutls_datum_t *authorities, int authority_count,
                   const gnutls_pk_algorithm_t *algorithms, int algorithm_count, gnutls_pcert_st **chain,
                   unsigned *chain_size, gnutls_privkey_t *key);

/* No handshake may be under way. */
void srv_tls_forget(void);

#endif
